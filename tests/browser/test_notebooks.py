"""Pages in notebooks: in a frame, and as a widget whose other end is played here."""

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from atwood import Viewer, page, simulate
from atwood.plotting.pages.document import widget_script
from atwood_library.scenes import SCENES

_MODEL = """
<!doctype html><html data-mode="live"><meta charset="utf-8"><body><div id="cell"></div><script type="module">
import widget from "data:text/javascript;base64,{module}";
const state = {state};
const heard = new Map();
window.saved = [];
window.model = {{
  get: (name) => state[name],
  set: (name, value) => {{ state[name] = value; }},
  save_changes: () => saved.push(JSON.parse(JSON.stringify([state.settings, state.time]))),
  on: (name, call) => heard.set(name, call),
  off: (name) => heard.delete(name),
  arrive: (name, value) => {{ state[name] = value; heard.get(`change:${{name}}`)(); }},
}};
window.heard = heard;
window.leave = widget.render({{ model, el: document.getElementById("cell") }});
</script></body></html>
"""


def test_pages_are_shown_in_frames(show: Callable[..., Any], tmp_path: Path) -> None:
    result = simulate(SCENES["double-pendulum"](), t_end=0.5, outputs=11)
    cells = "".join(page(result, show="rod1.angle", live=live)._repr_html_() for live in ("auto", "never"))
    (tmp_path / "notebook.html").write_text(f'<html data-mode="live"><body>{cells}</body></html>')
    tab = show(tmp_path / "notebook.html")
    for frame, mode in zip(tab.frames[1:], ("live", "recorded"), strict=True):
        frame.wait_for_selector(f"html[data-mode={mode}]")
        assert frame.evaluate("atwood.advance(0.5).code") == "reached"
        assert frame.evaluate("atwood.value('rod1.angle')") == pytest.approx(result["rod1.angle"][-1], abs=1e-6)
        frame.get_by_role("button", name="Copy a link").click()
        frame.get_by_text("Copied").wait_for()
    # The link of a page in a frame is the whole page.
    tab.goto(tab.frames[1].evaluate("location.href.split('#')[0]") + "#t=0.25&rod1.length=1.2")
    tab.wait_for_selector("html[data-mode=live]")
    assert tab.evaluate("atwood.time") == 0.25
    assert tab.get_by_label("rod1.length, number").input_value() == "1.2"


def test_a_widget_tells_what_is_set_and_hears_it(show: Callable[..., Any], tmp_path: Path) -> None:
    pytest.importorskip("anywidget")
    viewer = Viewer(simulate(SCENES["double-pendulum"](), t_end=0.5, outputs=11), sliders="rod1.length=0.5:2")
    state = {name: getattr(viewer.widget, name) for name in ("look", "packets", "settings", "time")}
    module = base64.b64encode(widget_script().encode()).decode()
    (tmp_path / "cell.html").write_text(_MODEL.format(module=module, state=json.dumps(state)), encoding="utf-8")
    tab = show(tmp_path / "cell.html")
    tab.wait_for_selector("#page[data-mode=live]")
    slider, number = tab.get_by_label("rod1.length", exact=True), tab.get_by_label("rod1.length, number")
    slider.fill("1.5")
    tab.get_by_role("button", name="One step", exact=True).click()
    tab.wait_for_function("saved.some(([settings, time]) => settings['rod1.length'] === 1.5 && time > 0)")
    tab.evaluate("model.arrive('settings', { 'rod1.length': 1.25 })")
    assert number.input_value() == "1.25"
    tab.evaluate("model.arrive('settings', {})")
    assert number.input_value() == "1"
    # What Python shows next comes in the place of what is shown.
    other = Viewer(simulate(SCENES["four-bar"](), t_end=0.1, outputs=3))
    tab.evaluate("packets => model.arrive('packets', packets)", other.widget.packets)
    tab.get_by_role("heading", name="FourBar").or_(tab.get_by_role("heading", name="four-bar")).wait_for()
    assert tab.locator("#page").count() == 1
    tab.evaluate("leave()")
    assert tab.evaluate("heard.size") == 0
