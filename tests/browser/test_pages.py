"""Pages in a browser: what they show is what `simulate` says, and everything on them can be used."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from atwood import Scene, assemble, equilibria, page, simulate
from atwood.plotting.pages.modes import mode_page
from atwood_library import Ground, PointMass, Rod, Sphere
from atwood_library.scenes import SCENES

_EXACT: dict[str, Any] = {"rtol": 1e-11, "outputs": 21}


def _pixels(tab: Any) -> np.ndarray[Any, Any]:
    look = "position: fixed; left: 0; top: 0; width: 600px; height: 400px; z-index: 9"
    tab.evaluate(f"document.querySelector('.view').style = '{look}'")
    tab.wait_for_timeout(200)
    shot: np.ndarray[Any, Any] = imread(io.BytesIO(tab.locator(".view").screenshot()))[:, :, :3]
    return shot


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_what_a_live_page_computes_is_what_simulate_says(show: Callable[..., Any], tmp_path: Path, form: Any) -> None:
    scene = SCENES["double-pendulum"]()
    page(simulate(scene, form=form, **_EXACT), tmp_path / "a.html")
    tab = show(tmp_path / "a.html")
    assert tab.evaluate("window.atwood.mode") == "live"
    tab.evaluate("atwood.set('rod1.length', 0.7)")
    tab.evaluate("atwood.reset()")
    assert tab.evaluate("atwood.advance(2.0)")["code"] == "reached"
    scene.set("rod1.length", 0.7)
    wanted = simulate(scene, form=form, t_end=2.0, **_EXACT)
    for path in ("rod1.angle", "bob2.position.x", "bob1.velocity.z"):
        assert tab.evaluate(f"atwood.value('{path}')") == pytest.approx(wanted[path][-1], abs=1e-9)


def test_a_slider_and_a_number_set_a_parameter(show: Callable[..., Any], tmp_path: Path) -> None:
    page(SCENES["double-pendulum"](), tmp_path / "a.html", sliders="rod1.length=0.5:2")
    tab = show(tmp_path / "a.html")
    slider = tab.get_by_label("rod1.length", exact=True)
    assert (slider.get_attribute("min"), slider.get_attribute("max")) == ("0.5", "2")
    slider.fill("1.5")
    assert tab.get_by_label("rod1.length, number").input_value() == "1.5"
    tab.get_by_label("rod1.length, number").fill("-1")
    tab.get_by_label("rod1.length, number").press("Enter")
    assert "rod1.length" in tab.locator(".notice").inner_text()


def test_clutches_slip_and_stick_live_with_what_is_set(show: Callable[..., Any], tmp_path: Path) -> None:
    scene = SCENES["clutches"]()
    assert page(scene, tmp_path / "a.html", show=["rotor4.angular_velocity"]).mode == "live"
    tab = show(tmp_path / "a.html", "t=1.1&rotor2.moment=1.5")
    scene.set("rotor2.moment", 1.5)
    result = simulate(scene, t_end=1.1, outputs=[0.0, 1.1], rtol=1e-10)
    value = tab.evaluate("atwood.value('rotor4.angular_velocity')")
    assert value == pytest.approx(result["rotor4.angular_velocity"][-1], abs=1e-7)
    assert tab.evaluate("atwood.advance(1.15).code") == "reached"


def test_a_recorded_page_shows_the_values_of_the_run_and_says_why(show: Callable[..., Any], tmp_path: Path) -> None:
    result = simulate(SCENES["bouncing-ball"](), t_end=2.0)
    made = page(result, tmp_path / "a.html", show=["ball.position.z"], live="never")
    assert made.mode == "recorded"
    tab = show(tmp_path / "a.html", "t=1")
    k = int(np.argmin(np.abs(result.time - 1.0)))
    tab.get_by_role("tab", name="Curves").click()
    shown = tab.locator("output[data-path='ball.position.z']")
    assert float(shown.inner_text()) == result["ball.position.z"][k]
    assert float(shown.get_attribute("data-t")) == result.time[k]
    assert tab.locator("html").get_attribute("data-reason") == made.reason


def test_a_mode_swings_as_wide_as_asked_and_shows_its_shape(show: Callable[..., Any], tmp_path: Path) -> None:
    modes = next(one.modes for one in equilibria(SCENES["four-bar"]()) if one.stable)
    mode_page(modes, 0).save(tmp_path / "a.html")
    tab = show(tmp_path / "a.html", "t=0")
    amplitude = tab.get_by_label("Amplitude, in steps")
    for step, wanted in (("1", 0.1), ("4", 0.3)):
        amplitude.fill(step)
        said = tab.get_by_label("Amplitude", exact=True).inner_text()
        assert float(said.partition("±")[2].split()[0]) == pytest.approx(wanted, rel=0.01)
        swung = modes.motion(0, wanted, 61)
        assert tab.evaluate("atwood.value('rocker.angle')") == pytest.approx(swung["rocker.angle"][0], abs=1e-12)
    cells = tab.get_by_role("table", name="Shape of the mode").get_by_role("cell").all_inner_texts()
    assert any(text == f"{modes.shapes[0]['rocker.angle'].real:.4g} rad" for text in cells)
    assert f"{modes.frequencies[0]:.6g} Hz, period {modes.periods[0]:.6g} s" in tab.locator("header").inner_text()


@pytest.mark.parametrize("name", ["double-pendulum", "four-bar", "lagrange-top", "stewart-platform"])
def test_a_live_page_draws_what_a_recorded_one_draws(show: Callable[..., Any], tmp_path: Path, name: str) -> None:
    result = simulate(SCENES[name](), outputs=41, t_end=0.2, rtol=1e-10)
    page(result, tmp_path / "live.html")
    page(result, tmp_path / "recorded.html", live="never")
    live, recorded = (show(tmp_path / f"{one}.html", "t=0.2") for one in ("live", "recorded"))
    for tab in (live, recorded):
        tab.get_by_label("paths").uncheck()
    one, other = _pixels(live), _pixels(recorded)
    assert np.mean(np.any(one < 0.9, axis=2)) > 0.005, "the picture is empty"
    assert np.mean(np.any(np.abs(one - other) > 0.1, axis=2)) < 0.002


def test_what_falls_on_behind_the_end_of_its_record_stays_in_sight(show: Callable[..., Any], tmp_path: Path) -> None:
    scene = Scene(space="plane")
    scene.add("ball", Sphere(radius=0.05))
    scene.start.update({"ball.position.z": 0.0, "ball.velocity.x": 0.5})
    page(simulate(scene, t_end=0.2), tmp_path / "a.html")
    tab = show(tmp_path / "a.html")
    tab.get_by_label("paths").uncheck()

    def filled() -> float:
        return float(np.mean(np.any(_pixels(tab) < 0.9, axis=2)))

    at_start = filled()
    assert at_start > 0.005
    for time in (1.0, 3.0):
        tab.evaluate(f"atwood.advance({time})")
        assert filled() > 0.8 * at_start
    tab.evaluate("atwood.reset()")
    assert filled() == pytest.approx(at_start, rel=0.01)


def test_a_link_sets_what_it_names_and_says_what_it_cannot(show: Callable[..., Any], tmp_path: Path) -> None:
    page(SCENES["double-pendulum"](), tmp_path / "a.html")
    tab = show(tmp_path / "a.html", "t=0.5&rod1.length=1.2&show=rod1.angle,bob2.position.x")
    assert tab.evaluate("atwood.time") == 0.5
    assert tab.get_by_label("rod1.length, number").input_value() == "1.2"
    assert tab.locator("output[data-path='bob2.position.x']").count() == 1
    wrong = show(tmp_path / "a.html", "rod1.lenght=1.2&show=rod1.angel")
    said = wrong.locator(".notice").inner_text()
    assert "rod1.length" in said
    assert "rod1.angle" in said


def test_names_are_shown_as_text(show: Callable[..., Any], tmp_path: Path) -> None:
    name = '</script><img src=x onerror="document.title=1">'

    scene = Scene()
    ground, rod, bob = scene.add("g", Ground()), scene.add("r", Rod(length=1.0)), scene.add("b", PointMass(mass=1.0))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start["r.angle"] = 1.0
    result = simulate(assemble(scene, name=name), t_end=0.2)
    page(result, tmp_path / "a.html")
    tab = show(tmp_path / "a.html")
    assert tab.locator("h1").inner_text() == name
    assert tab.title() == name
    assert tab.locator("img").count() == 0


def test_two_results_are_shown_together(show: Callable[..., Any], tmp_path: Path) -> None:
    scene = SCENES["double-pendulum"]()
    results = {form: simulate(scene, form=form, t_end=1.0) for form in ("reduced", "dae")}
    page(results, tmp_path / "a.html", show="rod1.angle")
    tab = show(tmp_path / "a.html", "t=1")
    shown = [float(text) for text in tab.locator("output[data-path='rod1.angle']").all_inner_texts()]
    assert shown == [results[form]["rod1.angle"][-1] for form in ("reduced", "dae")]


@pytest.mark.parametrize(("width", "height"), [(1280, 760), (390, 844)])
def test_every_control_has_a_name_and_nothing_is_wider_than_the_window(
    show: Callable[..., Any], tmp_path: Path, width: int, height: int
) -> None:
    page(SCENES["four-bar"](), tmp_path / "a.html")
    tab = show(tmp_path / "a.html", "t=0", width, height)
    named = "one => one.labels?.length || one.getAttribute('aria-label') || one.textContent.trim()"
    assert tab.evaluate(f"[...document.querySelectorAll('button, input, select')].every({named})")
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    for name in ("Set", "Curves", "Energy", "Equations", "Parts", "About"):
        tab.get_by_role("tab", name=name).click()
        assert tab.get_by_role("tabpanel", name=name).is_visible()
        assert tab.get_by_role("tabpanel", name=name).inner_text().strip()
    tab.get_by_role("tab", name="Parts").click()
    tab.get_by_label("Part", exact=True).select_option("crank")
    assert "crank.angle" in tab.locator(".part").inner_text()


def test_the_picture_is_turned_by_keys_and_a_click_tells_a_part(show: Callable[..., Any], tmp_path: Path) -> None:
    page(SCENES["double-pendulum"](), tmp_path / "a.html")
    tab = show(tmp_path / "a.html")
    before = _pixels(tab)
    tab.locator(".view").focus()
    tab.keyboard.press("ArrowRight")
    assert np.any(before != _pixels(tab))
    tab.get_by_label("Look from the front").click(force=True)
    tab.evaluate("atwood.advance(0.7)")
    dark = np.argwhere(np.all(np.abs(_pixels(tab) - [0.82, 0.286, 0.357]) < 0.05, axis=2))
    y, x = dark.mean(axis=0)  # the second bob, which is red
    tab.mouse.click(float(x), float(y))
    assert "bob2" in tab.locator(".part h2").inner_text()


def test_a_body_is_pulled_by_the_pointer_and_let_go(show: Callable[..., Any], tmp_path: Path) -> None:
    scene = SCENES["double-pendulum"]()
    scene.start.update({"rod1.angle": 0.0, "rod2.angle": 0.0})
    page(scene, tmp_path / "a.html")
    tab = show(tmp_path / "a.html")
    assert tab.evaluate("atwood.advance(0.2)")["code"] == "reached"
    assert abs(tab.evaluate("atwood.value('bob2.position.x')")) < 1e-9, "it hangs at rest"
    dark = np.argwhere(np.all(np.abs(_pixels(tab) - [0.82, 0.286, 0.357]) < 0.05, axis=2))
    y, x = (float(one) for one in dark.mean(axis=0))
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 60.0, y, steps=4)
    tab.mouse.up()
    assert tab.evaluate("[atwood.time, atwood.value('bob2.velocity.x')]") == [0.2, 0.0], (
        "at rest it is put somewhere else"
    )
    assert tab.evaluate("atwood.value('bob2.position.x')") > 0.05
    tab.mouse.move(x + 60.0, y)
    tab.mouse.down()
    tab.mouse.move(x, y, steps=4)
    tab.mouse.up()
    assert abs(tab.evaluate("atwood.value('bob2.position.x')")) < 0.03
    tab.evaluate("atwood.play(true)")
    tab.mouse.down()
    tab.mouse.move(x + 60.0, y, steps=4)
    tab.wait_for_timeout(800)
    assert tab.evaluate("atwood.value('bob2.position.x')") > 0.05
    tab.mouse.up()
    tab.evaluate("atwood.play(false)")
    paths = [f"{bob}.{kind}_energy" for bob in ("bob1", "bob2") for kind in ("kinetic", "potential")]
    energy = " + ".join(f"atwood.value('{path}')" for path in paths)
    before = tab.evaluate(energy)
    tab.evaluate("atwood.advance(atwood.time + 0.5)")
    assert tab.evaluate(energy) == pytest.approx(before, abs=1e-4), "nothing pulls any more"


def test_forces_of_a_live_page_are_those_of_simulate(show: Callable[..., Any], tmp_path: Path) -> None:
    result = simulate(SCENES["double-pendulum"](), t_end=1.0, **_EXACT)
    page(result, tmp_path / "a.html", show="rod1.tension")
    tab = show(tmp_path / "a.html")
    assert tab.evaluate("atwood.advance(1.0)")["code"] == "reached"
    tab.get_by_role("tab", name="Curves").click()
    shown = float(tab.locator("output[data-path='rod1.tension']").inner_text())
    assert shown == pytest.approx(result["rod1.tension"][-1], abs=1e-8)
