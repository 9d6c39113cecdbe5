"""A scene in a notebook, moved by sliders there and by Python, each of which hears of the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from atwood.arguments import TEXT, instance, number, takes
from atwood.errors import UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.forms.other_values import Slot, find_slots
from atwood.lazy_modules import needed
from atwood.model.compose.composite import Model
from atwood.pipeline import simulate
from atwood.plotting.pages.document import pack, page_style, widget_script
from atwood.plotting.pages.page import PATH_LIST, SLIDERS, known_path, page_content, read_slider
from atwood.result.result import Result


class Viewer:
    """A page of a scene as a widget: what its sliders set is here, and what is set here is shown by them.

    It needs ``pip install 'atwood[notebook]'``. A cell that returns it shows it; its `widget` stands in layouts of
    ipywidgets.

    Parameters
    ----------
    scene
        A scene, which is simulated; its assembly; or a result.
    show, sliders
        See `page`.

    Attributes
    ----------
    widget
        The widget, by anywidget.
    result
        The run that is shown, or that the live page begins with.

    Raises
    ------
    UsageError
        If anywidget is missing, or a path is not known.
    """

    @takes(
        scene=instance("a scene, its assembly, or a Result", Model, Assembly, Result), show=PATH_LIST, sliders=SLIDERS
    )
    def __init__(
        self, scene: Model | Assembly | Result, *, show: str | Sequence[str] = (), sliders: str | Sequence[str] = ()
    ) -> None:
        needed("anywidget", "'atwood[notebook]'", "a viewer needs anywidget, which")
        self._shown = show
        self._bounds = dict(map(read_slider, sliders))
        self._first: dict[str, dict[str, float]] = {}
        self._reason = ""
        self.widget = _make_widget(self._take(scene if isinstance(scene, Result) else simulate(scene)))

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters that can be set, with what they are now, in SI units."""
        return self._now("parameters")

    @property
    def start(self) -> dict[str, float]:
        """Start values that can be set, with what they are now, in SI units."""
        return self._now("starts")

    @property
    def time(self) -> float:
        """The time that is shown, s."""
        return float(self.widget.time)

    @takes(path=TEXT, value=number())
    def set(self, path: str, value: float) -> None:
        """Set a parameter or a start value, in SI units, as its slider does.

        Raises
        ------
        UsageError
            If there is none that can be set.
        AtwoodError
            If the value is not admissible.
        """
        self._check(path)
        settings = {**self.widget.settings, path: float(value)}
        self._assembly(settings)
        self.widget.settings = settings

    @takes(result=instance("a Result, as simulate returns it", Result))
    def show(self, result: Result) -> None:
        """Show a result in the place of what is shown; its parameters and its start are those that are set then."""
        packets = self._take(result)
        with self.widget.hold_sync():
            self.widget.settings = {}
            self.widget.packets = packets

    def run(self, **options: Any) -> Result:
        """Simulate the scene with what is set, and show it.

        Parameters
        ----------
        options
            See `simulate`.
        """
        self.show(simulate(self._assembly(self.widget.settings), **options))
        return self.result

    def __repr__(self) -> str:
        return f"<Viewer of {self.result.assembly.flat.name}, t = {self.time:g} s>"

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)

    def _take(self, result: Result) -> dict[str, str]:
        """Take up a result, and return the packets that show it."""
        for path in self._shown:
            known_path(path, list(result.paths))
        content = page_content({result.method: result}, self._shown, self._bounds, "auto")
        self.result, self._reason = result, content.program.reason
        data = content.program.data if content.modules else {}
        self._first = {
            kind: {one["path"]: float(one["value"]) for one in data.get(kind, ())} for kind in ("parameters", "starts")
        }
        return pack(content.payload, content.modules)

    def _check(self, path: str) -> None:
        known = [*self._first["parameters"], *self._first["starts"]]
        if path in known:
            return
        advice = suggestion(path, known) if known else f"The page is not live: {self._reason}"
        raise UsageError("nothing of that name can be set here", where=path, advice=advice)

    def _now(self, kind: str) -> dict[str, float]:
        settings = self.widget.settings
        return {path: settings.get(path, value) for path, value in self._first[kind].items()}

    def _assembly(self, settings: Mapping[str, float]) -> Assembly:
        """Return the scene with what is set, and nothing else changed."""
        before = self.result.assembly
        starts = {path: value for path, value in settings.items() if path in self._first["starts"]}
        slots, values = {slot.path: slot for _, slot in find_slots(before.flat)}, dict[str, Any]()
        for path, value in settings.items():
            if path in starts:
                continue
            slot = slots[path]
            if isinstance(slot.axis, int):  # one component of a vector
                whole = f"{slot.part}.{slot.name}"
                values.setdefault(whole, list(before.flat.parts[slot.part].values[slot.name]))[slot.axis] = value
            else:
                values[path if slot.axis is None else _read_by_name(before, slot)] = value
        made = before.with_values(values, start=starts)
        for slot in dict(find_slots(made.flat)).values():
            now = slot.read(made.flat)
            if slot.path not in settings and isinstance(now, float) and now != slots[slot.path].read(before.flat):
                raise UsageError(
                    f"{slot.path} follows what is set here, so that the page and Python would differ",
                    where=", ".join(settings),
                    advice="Set the parameter in the scene, and make a viewer of that.",
                )
        return made


def _read_by_name(assembly: Assembly, slot: Slot) -> str:
    """Return the parameter of the scene that a function takes by its name."""
    assert assembly.source is not None
    assert assembly.source.scene is not None
    part = assembly.source.scene[slot.part]
    scope = part._parent if slot.name in part._settings else part
    return ".".join(filter(None, (scope.path, str(slot.axis))))


def _make_widget(packets: Mapping[str, str]) -> Any:
    """Return the widget; its class is made when it is asked for, since anywidget need not be there."""
    import anywidget
    import traitlets

    class ViewerWidget(anywidget.AnyWidget):
        _esm = widget_script()
        look = traitlets.Unicode(page_style()).tag(sync=True)
        packets = traitlets.Dict().tag(sync=True)
        settings = traitlets.Dict().tag(sync=True)
        time = traitlets.Float(0.0).tag(sync=True)

    return ViewerWidget(packets=dict(packets))
