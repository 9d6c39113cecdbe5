"""Every public object says what it is in ten lines at most, however large it is; notebooks show tables."""

from collections.abc import Callable, Iterator, Mapping
from html.parser import HTMLParser
from itertools import islice

import numpy as np
import pytest

import atwood
import atwood.checking
import atwood.plotting
import atwood.reporting
import atwood.solids
import atwood.study
from atwood.display import LINES, WIDTH, fitted
from atwood.result.trajectories import Group
from atwood.table import Table, facts, table
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import (
    Chain,
    DoublePendulum,
    FourBar,
    HeavyTop,
    Kepler,
    LagrangeTop,
    Oscillators,
    SimplePendulum,
)

FACADES = (atwood, atwood.checking, atwood.plotting, atwood.reporting, atwood.solids, atwood.study)
PUBLIC = {one for room in FACADES for one in (getattr(room, name) for name in room.__all__) if isinstance(one, type)}


class Everything(atwood.Component):
    """A component with connectors of every kind."""

    point: atwood.Point = atwood.connector(atwood.Point, "A point.")
    frame: atwood.Frame = atwood.connector(atwood.Frame, "A frame.")
    shaft: atwood.Shaft = atwood.connector(atwood.Shaft, "A shaft.")
    slide: atwood.Slide = atwood.connector(atwood.Slide, "A slide.")
    groove: atwood.Groove = atwood.connector(atwood.Groove, "A groove.")


def _declared() -> list[object]:
    """Return values that a person writes in laws, and what a report may hold."""
    import sympy

    x = sympy.Symbol("x")
    part, mesh = Everything(), atwood.solids.closed_mesh(_torus(60))
    return [
        part,
        mesh,
        atwood.Outline.mesh(mesh.vertices, mesh.triangles),
        atwood.Outline.revolved([(0.0, float(h)) for h in range(400)]),
        atwood.turn((0.0, 0.0, 1.0), 0.3),
        atwood.ExternalFunction("gust", abs),
        atwood.formula(sum(sympy.sin(k * x) for k in range(1, 300)), [x]),
        atwood.Placement(atwood.Vector(1.0, 2.0, 3.0)),
        atwood.Load(part.point, force=atwood.Vector(1.0, 2.0, 3.0)),
        atwood.CoordinateLoad(part.shaft, 2.0),
        atwood.reporting.MergedPart("a" * 200, "b"),
        atwood.reporting.DroppedPart("a", "word " * 500),
        atwood.checking.Finding("failure", "units", "law", "space", "word " * 500),
    ]


def _transformations() -> list[object]:
    import sympy

    one, two, new, other = sympy.symbols("q p Q P")
    hanging = DoublePendulum()
    return [
        atwood.canonical_transformation(((one,), (two,)), {new: two}, {other: -one}),
        atwood.point_transformation(hanging, {"rod1.angle": new, "rod2.angle": new + other}, [new, other]),
    ]


def _torus(count: int) -> np.ndarray:
    """Return the corners of the triangles of a torus, shape (triangles, 3, 3)."""
    angles = 2.0 * np.pi * np.arange(count) / count
    around, across = (one.ravel() for one in np.meshgrid(angles, angles, indexing="ij"))
    radius = 2.0 + np.cos(across)
    vertices = np.column_stack([radius * np.cos(around), radius * np.sin(around), np.sin(across)])
    at = np.arange(count * count).reshape(count, count)
    right, up = np.roll(at, -1, axis=0), np.roll(at, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    corners = [[at, right, both], [at, both, up]]
    return vertices[np.concatenate([np.stack([one.ravel() for one in three], axis=1) for three in corners])]


@pytest.fixture(scope="module")
def result() -> atwood.Result:
    return atwood.simulate(Chain(links=30), t_end=0.2, outputs=400)


class _MadeWhenAsked(Mapping[str, object]):
    """Values by name, each made when it is first asked for."""

    def __init__(self, made: Mapping[str, Callable[[], object]]) -> None:
        self._made, self._known = made, dict[str, object]()

    def __getitem__(self, name: str) -> object:
        if name not in self._known:
            self._known[name] = self._made[name]()
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._made)

    def __len__(self) -> int:
        return len(self._made)


@pytest.fixture(scope="module")
def roots(result, tmp_path_factory) -> Mapping[str, object]:
    scene = Chain(links=30)
    angles = {"rod[0].angle": np.linspace(0.0, 1.0, 40)}
    hanging = {path: 0.0 for path in scene.start if path.endswith("angle")}
    return _MadeWhenAsked(
        {
            "scene": lambda: scene,
            "result": lambda: result,
            "saved": lambda: atwood.load_result(result.save(tmp_path_factory.mktemp("saved") / "run.npz")),
            "loop": lambda: atwood.simulate(FourBar(), form="dae", t_end=0.2),
            "top": lambda: atwood.simulate(HeavyTop(), t_end=0.2),
            "report": lambda: atwood.report(scene),
            "report of a loop": lambda: atwood.report(FourBar()),
            "report in space": lambda: atwood.report(DoublePendulum(space="space")),
            "comparison": lambda: atwood.compare(DoublePendulum(), rtols=[1e-4], t_end=0.2),
            "long comparison": lambda: atwood.compare_long(SimplePendulum(), periods=10, period=2.0),
            "sweep": lambda: atwood.sweep(scene, start=angles, t_end=0.1, outputs=30),
            "check": lambda: atwood.check(Rod),
            "equations": lambda: (atwood.equations(DoublePendulum()), atwood.equations(DoublePendulum()).terms("bob1")),
            "hamiltonian": lambda: atwood.hamiltonian(DoublePendulum()),
            "tangent flow": lambda: atwood.tangent_flow(DoublePendulum(), t_end=0.2, outputs=2),
            "exponents": lambda: atwood.lyapunov_exponents(DoublePendulum(), t_end=0.5),
            "portrait": lambda: atwood.phase_portrait(SimplePendulum(), speeds=(-1.0, 1.0)),
            "section": lambda: atwood.poincare_section(DoublePendulum(), "rod1.angle crosses 0", ["rod2.angle"]),
            "action": lambda: atwood.action(DoublePendulum(), t_end=0.1),
            "variation": lambda: atwood.action(DoublePendulum(), t_end=0.1).variation(),
            "joining": lambda: atwood.boundary_value_motions(SimplePendulum(), {"rod.angle": 0.5}, t_end=0.3),
            "separated": lambda: _separated(),
            "action and angle": lambda: atwood.action_angle(SimplePendulum()),
            "linear": lambda: atwood.linearize(scene, at=hanging, inputs=[], outputs=["bob[0].position.x"]),
            "dynamics": lambda: atwood.dynamics(scene),
            "conserved": lambda: atwood.conserved(FourBar()),
            "transformations": lambda: _transformations(),
            "flow": lambda: atwood.flow_of("p**2 + q**2", (("q",), ("p",)), "s"),
            "algebra": lambda: atwood.bracket_algebra((("q",), ("p",)), ["a", "b"], ["p**2", "q*p"]),
            "principal function": lambda: atwood.principal_function(atwood.hamiltonian(Oscillators())),
            "cloud": lambda: atwood.phase_cloud(SimplePendulum(), t_end=0.1),
            "density": lambda: atwood.liouville_density("p_u**2", atwood.hamiltonian(Oscillators())),
            "conjugate": lambda: atwood.legendre_transform("exp(x)", ["x"]),
            "adiabatic": lambda: atwood.adiabatic_invariant(SimplePendulum(), t_end=0.2, outputs=3),
            "second variation": lambda: atwood.action(SimplePendulum(), t_end=0.1).second_variation(),
            "reduced": lambda: atwood.reduced(SimplePendulum()),
            "symmetry": lambda: atwood.Symmetry(dict.fromkeys(angles, 1.0), 0.0),
            "modes": lambda: atwood.normal_modes(scene, at=hanging),
            "equilibria": lambda: list(atwood.equilibria(DoublePendulum())),
            "equilibria of a loop": lambda: atwood.equilibria(FourBar()),
            "trim": lambda: atwood.trim(scene, at=hanging),
            "start": lambda: atwood.solve_initial_values(
                SimplePendulum(), unknowns=["rod.angular_velocity"], conditions={"bob.velocity.x": 1.0}
            ),
            "symbolic equilibria": lambda: atwood.equilibria(DoublePendulum(), symbolic=True),
            "symbolic modes": lambda: atwood.normal_modes(SimplePendulum(), symbolic=True),
            "top in closed form": lambda: atwood.symmetric_top(LagrangeTop()),
            "free rotation": lambda: atwood.free_rotation(moments=(1.0, 2.0, 3.0), spin=(1.0, 0.1, 0.2)),
            "locus": lambda: atwood.root_locus(scene, "gravity", [9.0, 10.0, 11.0], at=hanging),
            "branches": lambda: atwood.equilibrium_branches(DoublePendulum(), "gravity", (9.0, 10.0)),
            "branch point": lambda: atwood.BranchPoint(1.0, dict.fromkeys(angles, 0.0)),
            "declared": lambda: _declared(),
            "box": lambda: atwood.solids.box(1.0, 2.0, 3.0, density=1e3),
        }
    )


def _separated() -> tuple[object, object]:
    polar = {"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}
    found = atwood.separation(Kepler(), polar)
    return found, found.motion("r", [0.0, 0.5], [0.8, 0.0])


def _reachable(roots: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """Yield objects of Atwood's classes that public objects lead to, with the way there."""
    waiting, seen = list(roots.items()), {}
    while waiting:
        where, one = waiting.pop(0)
        own = str(type(one).__module__).startswith(("atwood", __name__))
        if isinstance(one, Mapping) and not own:
            waiting += [(f"{where}[{key!r}]", value) for key, value in islice(one.items(), 4)]
        elif isinstance(one, (tuple, list)):
            waiting += [(f"{where}[{k}]", value) for k, value in enumerate(one[:20])]
        if not own or isinstance(one, type) or id(one) in seen:
            continue
        seen[id(one)] = one  # kept, so that no other gets its number
        yield where, one
        if where.count(".") < 4:
            waiting += [(f"{where}.{name}", value) for name, value in _attributes(one)]


def _attributes(one: object) -> Iterator[tuple[str, object]]:
    """Yield what a public object offers, and the fields of any other."""
    is_public = isinstance(one, tuple(PUBLIC - {atwood.Scalar}))
    names = dir(one) if is_public else getattr(type(one), "__dataclass_fields__", ())
    for name in names:
        if not name.startswith("_"):
            try:
                yield name, getattr(one, name)
            except atwood.AtwoodError:  # what has a value inside a law only
                continue


def _screen_lines(text: str) -> int:
    return sum(max(1, -(-len(line) // WIDTH)) for line in text.split("\n"))


@pytest.mark.sample(0)
def test_every_object_within_reach_fits_ten_lines(roots):
    found = list(_reachable(roots))
    assert len({type(one) for _, one in found}) > 60
    shown = {base for _, one in found for base in type(one).__mro__}
    assert {one for one in PUBLIC - shown if not issubclass(one, Exception)} == {atwood.Scalar}  # which is no class
    long = {where: _screen_lines(repr(one)) for where, one in found if _screen_lines(repr(one)) > LINES}
    assert not long


SAID = {
    "scene": ("Chain(links=30)", "61 parts", "rod[0..29]", "connections"),
    "result": ("Result of Chain, reduced, explicit", "finished", "0 to 0.2 s, 400 output times"),
    "saved": ("SavedResult of Chain, reduced, explicit", "finished", "400 output times"),
    "loop": ("Result of FourBar, dae, explicit",),
    "report": ("MechanismReport of Chain", "30 degrees of freedom", "30 bodies"),
    "comparison": ("Comparison of DoublePendulum", "7 runs"),
    "long comparison": ("LongComparison of SimplePendulum", "10 periods"),
    "sweep": ("Sweep of Chain", "40 runs", "rod[0].angle 0 to 1 rad", "40 finished"),
}


@pytest.mark.sample(0)
@pytest.mark.parametrize("name", SAID)
def test_what_is_said(roots, name):
    for text in SAID[name]:
        assert text in repr(roots[name])


def test_an_assembly_says_what_it_is_of(result):
    assert repr(result.assembly) == (
        "<Assembly of Chain, reduced form: a mechanism in the plane of 61 parts, 31 joints>"
    )


def test_what_an_assembly_has_says_what_it_is(result):
    assembly = result.assembly
    assert repr(assembly.observables) == "<Observables of 61 parts, by path>"
    assert repr(assembly.shared).startswith("<Shared: ")


def test_a_scene_put_together_step_by_step_names_its_parts():
    scene = atwood.Scene(gravity=0.0)
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=2.0))
    bob = scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start["rod.angle"] = "30 deg"
    assert repr(scene).split("\n") == [
        "Scene(gravity=0.0)",
        "    3 parts: ground, rod, bob",
        "    2 connections: ground.frame - rod.a, rod.b - bob.point",
        "    start: rod.angle = 30 deg",
    ]
    assert repr(rod) == "Rod(length=2.0)"


class _Tags(HTMLParser):
    """Notes whether every tag is closed, and all text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.mark.parametrize("name", ["scene", "result", "saved", "loop", "report", "comparison", "sweep"])
def test_notebooks_show_a_table(roots, name):
    tags = _Tags()
    tags.feed(roots[name]._repr_html_())
    assert not tags.open
    title = {"scene": "Chain", "loop": "FourBar", "comparison": "DoublePendulum"}.get(name, "Chain")
    assert title in tags.text
    assert len(tags.text) < 6000


def test_texts_in_tables_are_escaped():
    assert "<script>" not in table(("<script>",), [("<script>",)], "<script>", ["<script>"]).html()


def test_keys_are_completed(roots):
    keys = roots["result"]._ipython_key_completions_()
    assert "rod[0].angle" in keys
    assert roots["scene"]._ipython_key_completions_()[:2] == ["ground", "rod[0]"]
    assert roots["sweep"]._ipython_key_completions_() == list(roots["sweep"].paths)
    group: Group = roots["result"].group("rod[0]")
    assert "angle" in group._ipython_key_completions_()


@pytest.mark.parametrize("lines", [1, 9, 10, 11, 500])
def test_only_what_does_not_fit_is_cut(lines):
    text = "\n".join(f"line {k}" for k in range(lines))
    assert (fitted(text) == text) is (lines <= LINES)
    assert _screen_lines(fitted(text)) <= LINES
    assert _screen_lines(fitted("word " * 40 * lines)) <= LINES


def _modes() -> Table:
    return table(("mode", "growth, 1/s>"), [("0", 0.25), ("12_b", -1.0)], "Modes", ["Two."])


def test_a_table_is_one_value_behind_text_data_and_latex() -> None:
    assert _modes().text() == "Modes\nmode  growth, 1/s\n0            0.25\n12_b           -1\nTwo."
    data = _modes().to_data()
    assert data["columns"] == [{"name": "mode", "unit": ""}, {"name": "growth", "unit": "1/s"}]
    assert data["rows"] == [["0", 0.25], ["12_b", -1.0]]
    assert _modes().latex().split("\n")[1:4] == [r"mode & growth, 1/s \\", r"\hline", r"0 & 0.25 \\"]
    assert r"12\_b & -1 \\" in _modes().latex()


def test_facts_wrap_their_sentences_under_themselves() -> None:
    told = facts([("long", "one two three four five six seven"), ("x", "")], "Facts")
    assert told.lines(26) == ["long  one two three four", "      five six seven", "x"]
    assert told.brief() == "<Facts>\n    long: one two three four five six seven\n    x: "
