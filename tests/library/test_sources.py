"""Sources against their functions, their rates against differences, and tables against scipy."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import interpolate

from atwood import Component, ParameterError, Scene, load_scene, save_scene, simulate, sweep
from atwood_library import (
    Drive,
    Force,
    Ground,
    Integrator,
    MinimumJerk,
    PointMass,
    PointToPoint,
    Pulse,
    Quintic,
    Ramp,
    Spring,
    Step,
    Table,
)

T = np.array([0.0, 0.4, 0.7, 1.3, 2.0, 2.5])
Y = np.array([0.0, 0.3, -0.2, 0.5, 0.1, 0.4])


def through_an_integrator(source: Component) -> Scene:
    scene = Scene()
    drive, sum_ = scene.add("drive", source), scene.add("sum", Integrator())
    scene.connect(drive.output("value"), sum_.input("u"))
    return scene


FUNCTIONS: dict[str, tuple[Component, Callable[[np.ndarray], np.ndarray]]] = {
    "step": (Step(height=2.0, offset=0.5, start_time=0.7), lambda t: 0.5 + 2.0 * (t >= 0.7)),
    "ramp": (Ramp(slope=3.0, offset=1.0), lambda t: 1.0 + 3.0 * t),
    "ramp with an end": (
        Ramp(slope=3.0, offset=1.0, start_time=0.5, duration=0.8), lambda t: 1.0 + 3.0 * np.clip(t - 0.5, 0.0, 0.8),
    ),
    "pulse": (
        Pulse(amplitude=2.0, offset=-1.0, period=0.6, width=0.25, start_time=0.2, count=2),
        lambda t: -1.0 + 2.0 * ((t >= 0.2) & (t < 1.4) & (np.mod(t - 0.2, 0.6) < 0.15)),
    ),
    "minimum jerk": (
        MinimumJerk(travel=-2.0, duration=1.5, start_time=0.3, offset=1.0),
        lambda t: 1.0 - 2.0 * np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], np.clip((t - 0.3) / 1.5, 0.0, 1.0)),
    ),
    "linear": (Table(table=np.column_stack([T, Y])), lambda t: np.interp(t, T, Y)),
    "akima": (
        Table(table=np.column_stack([T, Y]), interpolation="akima"), interpolate.Akima1DInterpolator(T, Y),
    ),
    "cubic": (Table(table=np.column_stack([T, Y]), interpolation="cubic"), interpolate.CubicSpline(T, Y)),
    "spline": (Table(table=interpolate.make_interp_spline(T, Y, k=4)), interpolate.make_interp_spline(T, Y, k=4)),
}  # fmt: skip


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize(("form", "solver"), [("reduced", "explicit"), ("reduced", "taylor"), ("dae", "ida")])
def test_a_source_is_its_function_and_is_integrated_across_all_its_switches(name: str, form: str, solver: str) -> None:
    source, function = FUNCTIONS[name]
    result = simulate(through_an_integrator(source.copy()), t_end=2.5, form=form, solver=solver, rtol=1e-10)
    inside = result.time < 2.5
    assert_allclose(result["drive.value"][inside], function(result.time[inside]), atol=1e-12)
    fine = np.linspace(0.0, 2.5, 2_000_001)
    middles = 0.5 * (fine[1:] + fine[:-1])
    assert result["sum.y"][-1] == pytest.approx(float(np.sum(function(middles)) * (fine[1] - fine[0])), abs=3e-6)


def test_a_quintic_has_the_values_and_rates_that_it_is_given() -> None:
    source = Quintic(
        start_time=0.5, duration=2.0, start_value=1.0, end_value=-2.0, start_rate=0.3, end_rate=-0.7,
        start_acceleration=2.0, end_acceleration=1.5,
    )  # fmt: skip
    scene = through_an_integrator(source)
    h, at = 1e-3, (0.5, 2.5)
    times = sorted({t + k * h for t in at for k in range(-3, 4)})
    result = simulate(scene, t_end=3.0, outputs=times)
    y = dict(zip(np.round(result.time, 9), result["drive.value"], strict=True))

    def value(t: float) -> float:
        return float(y[round(t, 9)])

    assert [value(t) for t in at] == pytest.approx([1.0, -2.0], abs=1e-12)
    inner = ((0.5, 1.0), (2.5, -1.0))
    rates = [s * (-3 * value(t) + 4 * value(t + s * h) - value(t + 2 * s * h)) / (2 * h) for t, s in inner]
    assert rates == pytest.approx([0.3, -0.7], abs=5e-5)
    seconds = [(2 * value(t) - 5 * value(t + s * h) + 4 * value(t + 2 * s * h) - value(t + 3 * s * h)) / h**2
               for t, s in inner]  # fmt: skip
    assert seconds == pytest.approx([2.0, 1.5], abs=1e-3)
    assert (value(0.5) - value(0.5 - h)) / h == pytest.approx(0.3, abs=1e-9)  # outside at the rate there


@pytest.mark.parametrize(("travel", "peak"), [(3.0, 1.5), (-0.5, -1.0)])
def test_point_to_point_is_as_fast_as_its_limits_allow(travel: float, peak: float) -> None:
    source = PointToPoint(travel=travel, largest_rate=1.5, largest_acceleration=2.0, start_time=0.25)
    result = simulate(through_an_integrator(source), t_end=5.0, outputs=5001)
    y, dt = result["drive.value"], 1e-3
    assert y[-1] == pytest.approx(travel, abs=1e-12)
    assert max(np.diff(y) / dt, key=abs) == pytest.approx(peak, abs=3e-3)
    assert np.max(np.abs(np.diff(y, 2))) / dt**2 == pytest.approx(2.0, rel=1e-4)
    rate = result["drive.rate"]
    assert rate[1:-1] == pytest.approx((y[2:] - y[:-2]) / (2.0 * dt), abs=2e-3)
    assert max(rate, key=abs) == pytest.approx(peak, abs=1e-12)
    way, v, a = abs(travel), 1.5, 2.0
    arrives = 0.25 + (way / v + v / a if way * a > v * v else 2.0 * np.sqrt(way / a))
    assert np.all(y[result.time >= arrives] == pytest.approx(travel, abs=1e-12))
    assert abs(y[np.searchsorted(result.time, arrives - 0.05)] - travel) > 1e-4


def driven(interpolation: str, form: str, solver: str) -> Any:
    """Return the motion of a mass on a spring whose other end a table moves."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive())
    spring, mass = scene.add("spring", Spring(stiffness=40.0, natural_length=1.0)), scene.add("mass", PointMass())
    table = scene.add("table", Table(table=np.column_stack([T, Y]), interpolation=interpolation))
    scene.connect(table.output("value"), drive.input("motion"))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, spring.a)
    scene.connect(spring.b, mass.point)
    scene.start["mass.position.x"], scene.start["mass.velocity.x"] = 1.0, 0.0
    return simulate(scene, t_end=2.5, form=form, solver=solver, rtol=1e-11, outputs=101)


@pytest.mark.sample(1)
@pytest.mark.parametrize("interpolation", ["linear", "akima", "cubic"])
def test_a_table_drives_with_its_rates(interpolation: str) -> None:
    from scipy.integrate import solve_ivp

    kinds = {"akima": interpolate.Akima1DInterpolator, "cubic": interpolate.CubicSpline}
    place = kinds[interpolation](T, Y) if interpolation in kinds else lambda t: np.interp(t, T, Y)
    state, expected = np.array([1.0, 0.0]), []
    for begin, end in pairwise(T):
        inside = np.linspace(0.0, 2.5, 101)
        inside = inside[(inside >= begin) & (inside < end)]
        found = solve_ivp(
            lambda t, y: [y[1], -40.0 * (y[0] - place(t) - 1.0)], (begin, end), state, method="DOP853", rtol=1e-12,
            atol=1e-13, t_eval=[*inside, end],
        )  # fmt: skip
        expected += found.y[0][:-1].tolist()
        state = found.y[:, -1]
    for form, solver in (("reduced", "explicit"), ("reduced", "taylor"), ("dae", "ida")):
        result = driven(interpolation, form, solver)
        assert_allclose(result["mass.position.x"][:-1], expected, atol=1e-7)
        assert result.energy.max_drift < 1e-6


def test_tables_are_read_from_what_holds_them(tmp_path: Path) -> None:
    rows = np.column_stack([T, Y])
    file = tmp_path / "motion.csv"
    file.write_text("time,value,more\n# a remark\n" + "\n".join(f"{t},{y},7" for t, y in rows) + "\n")
    pandas = pytest.importorskip("pandas") if _has_pandas() else None
    given: list[Any] = [rows, rows.tolist(), str(file), file]
    if pandas is not None:
        given += [pandas.Series(Y, index=T), pandas.DataFrame({"t": T, "y": Y})]
    assert len({Table(table=one).table for one in given}) == 1
    scene = through_an_integrator(Table(table=file))
    save_scene(scene, tmp_path / "scene.json")
    assert_allclose(simulate(load_scene(tmp_path / "scene.json"), t_end=2.0)["drive.value"][-2], np.interp(1.99, T, Y))


def _has_pandas() -> bool:
    import importlib.util

    return importlib.util.find_spec("pandas") is not None


def test_the_end_of_a_table_is_an_error_or_an_event() -> None:
    with pytest.raises(ParameterError, match=r"drive\.table: it ends at t = 2\.5 s, before the run"):
        simulate(through_an_integrator(Table(table=np.column_stack([T, Y]))), t_end=4.0)
    held = simulate(through_an_integrator(Table(table=np.column_stack([T, Y]), at_end="hold")), t_end=4.0)
    assert [(round(one.time, 9), one.part, one.message) for one in held.events] == [(2.5, "drive", "the table ends")]
    assert held["drive.value"][-1] == Y[-1]
    stopped = simulate(through_an_integrator(Table(table=np.column_stack([T, Y]), at_end="stop")), t_end=4.0)
    assert stopped.status == "stopped"
    assert stopped.time[-1] == pytest.approx(2.5, rel=1e-12)
    late = Scene(t_start=-1.0)
    late.add("drive", Table(table=np.column_stack([T, Y])))
    late.add("sum", Integrator())
    with pytest.raises(ParameterError, match=r"drive\.table: it begins at t = 0 s, and the run at t = -1 s"):
        simulate(late, t_end=1.0)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([(0.0, 1.0)], "two rows or more"),
        ([0.0, 1.0, 2.0], "two rows or more"),
        ([(0.0, 1.0), (1.0, 2.0), (1.0, 3.0)], "its times do not rise"),
        ("nowhere.csv", "'nowhere.csv' cannot be read"),
        ([(0.0, float("nan")), (1.0, 2.0)], "not a finite number"),
    ],
)
def test_what_makes_no_table_is_refused(rows: Any, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        simulate(through_an_integrator(Table(table=rows)), t_end=0.5)


def test_a_table_in_a_sweep_and_a_force_in_a_plane() -> None:
    scene = Scene(gravity=0.0)
    mass, force = scene.add("mass", PointMass()), scene.add("force", Force())
    table = scene.add("table", Table(table=np.column_stack([T, Y])))
    scene.connect(mass.point, force.point)
    scene.connect(table.output("value"), force.input("value"))
    found = sweep(scene, {"mass.mass": [1.0, 2.0]}, quantities=["mass.velocity.x"], t_end=2.5)
    area = float(np.sum(np.diff(T) * (Y[1:] + Y[:-1]) / 2.0))
    assert [row[-1] for row in found["mass.velocity.x"]] == pytest.approx([area, area / 2.0], rel=1e-8)
