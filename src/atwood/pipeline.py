"""From a declared scene to a result, one stage after another.

    scene --flatten--> FlatScene --read_mechanism--> Mechanism --assemble_flat--> Assembly      `assemble`
          Assembly --find_start--> Start --run--> Run --> Result                                `simulate`

| value | what it is | made in |
|---|---|---|
| `FlatScene` | the leaves of a scene with their values, and their connections | `model.local.flatten` |
| `Mechanism` | the laws of all parts on symbols, and the joints and bodies they make | `mechanics.read` |
| `Assembly` | a mechanism in one form; equations and programs are derived when they are asked for | here |
| `Start` | consistent coordinates and speeds at the start | `simulation.initialization.start` |
| `Run` | the samples of a run, in segments of one mode each, and what happened on the way | `simulation.run.run` |
| `Result` | quantities by path, energies and reactions, computed when they are asked for | `result.result` |

Each stage takes frozen values and gives frozen values; what is derived from an assembly is kept in caches beside it.
Events enter other modes of an assembly, which is assembled anew for them (`forms.reassembly`). `Result.timings` says
how long each stage of `atwood.stages` took.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from atwood.arguments import instance, number, one_of, optional, takes
from atwood.clock import GRACE, Clock, TimeIsUp
from atwood.errors import UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import without_collection
from atwood.forms.other_values import Source
from atwood.forms.reassembly import assembled, assembled_again
from atwood.forms.residuals import check_level
from atwood.lazy_dataclasses import replace
from atwood.mechanics.read import LineSigns
from atwood.model.compose.composite import Model
from atwood.model.local.flatten import FlatScene, flatten
from atwood.progress import told
from atwood.result.result import Result
from atwood.simulation.initialization.start import find_places, has_start, start_with_line_signs, take_start
from atwood.simulation.problem.arguments import (
    ACCURACY,
    ATOL,
    CONDITIONS,
    FORM,
    LEVEL,
    LIMITS,
    MONITOR,
    NAME,
    NOMINAL,
    ORDER,
    ORIENTATION,
    OUTPUTS,
    PROGRESS,
    RTOL,
    SAMPLES,
    SOLVER,
    STRUCTURE,
    T_END,
    refuse_idle_settings,
    refuse_two_accuracies,
)
from atwood.simulation.problem.conditions import conditions_of
from atwood.simulation.problem.options import RunOptions, sizes_of
from atwood.simulation.run.run import choice_at_start, run
from atwood.simulation.run.run_record import Run, run_out_of_time
from atwood.simulation.run.stall_diagnosis import raised_where_too_tight
from atwood.stages import stage, watching
from atwood.tolerances import tolerances
from atwood.topology.orientation_coordinates import check_orientation

__all__ = ["Assembly", "assemble", "assemble_flat", "assembly_of", "simulate", "solve_as_asked"]

SCENE = instance("a scene, or an assembly of one", Model, Assembly)


@takes(scene=instance("a scene, such as Scene()", Model), form=FORM, level=LEVEL, orientation=ORIENTATION, name=NAME)
def assemble(
    scene: Model,
    *,
    form: str = "reduced",
    level: str = "ggl",
    orientation: str = "quaternion",
    name: str | None = None,
) -> Assembly:
    """Assemble a scene in one form.

    Parameters
    ----------
    scene
        The scene, or a model to be simulated with the usual settings.
    form
        Whether constraints are eliminated, so that the unknowns are generalized coordinates (``"reduced"``), or stay,
        with Lagrange multipliers (``"dae"``).
    level
        Level of the constraints of the dae form: ``"ggl"``, ``"index1-projected"`` or ``"index1"``. The reduced form
        has no levels.
    orientation
        Coordinates of orientations in space in the reduced form: ``"quaternion"``, or Euler angles such as
        ``"euler-zyz"``. There are all twelve conventions, as turns about axes of the frame that the turns before have
        made. Euler angles are switched along a run before they become singular. The speeds are the angular velocity in
        the axes of the body in both.
    name
        What to call the scene.

    Returns
    -------
    Assembly
        The mechanism and its equations, worked out when asked for.

    Raises
    ------
    AtwoodError
        If the scene is not sound; the error names the part.
    """
    with stage("flatten"), without_collection():
        flat, own = flatten(scene, name), scene.copy()
    return assemble_flat(flat, own, form=form, level=level, orientation=orientation)


_USUAL = {"form": "reduced", "level": "ggl", "orientation": "quaternion"}


def _to_run(scene: Model | Assembly, **given: str | None) -> Assembly:
    """Return an assembly, or assemble a scene to be run; the equations of one of the same structure are used again."""
    if isinstance(scene, Assembly):
        return assembly_of(scene, **given)
    with stage("flatten"), without_collection():
        flat, own = flatten(scene, None), scene.copy()
    form, level, orientation = (given[key] or usual for key, usual in _USUAL.items())
    new = partial(assemble_flat, flat, own, form=form, level=level, orientation=orientation)
    made, before = assembled_again(new, flat, Source(find_places, own), has_start, form, level, orientation)
    if before is not None:
        take_start(made, before)
    return made


def assemble_flat(
    flat: FlatScene,
    scene: Model | None = None,
    *,
    form: str = "reduced",
    level: str = "ggl",
    orientation: str = "quaternion",
    modes: Mapping[str, str] | None = None,
    line_signs: LineSigns | None = None,
) -> Assembly:
    """Assemble a scene that has been taken apart into leaves; `scene` is what its parameters are set in."""
    check_orientation(orientation, form, flat.space.name)
    check_level(level, form)
    chosen: Any = form  # its type says which there are
    level = level if form == "dae" else ""
    return assembled(Assembly, flat, Source(find_places, scene), chosen, level, orientation, modes, line_signs)


def assembly_of(scene: Model | Assembly, name: str | None = None, **asked: str | None) -> Assembly:
    """Return an assembly as it is, or assemble a scene as was asked for."""
    given = {key: value for key, value in asked.items() if value is not None}
    if not isinstance(scene, Assembly):
        return assemble(scene, name=name, **given)
    _refuse_contradictions(scene, given)
    return scene


def scene_of(assembly: Assembly, advice: str = "") -> Model:
    """Return the scene that an assembly was made of; refuse one that was made of leaves alone."""
    if assembly.source is None or assembly.source.scene is None:
        message = "it was assembled from leaves, so that its scene is not known"
        raise UsageError(message, where=assembly.flat.name, advice=advice)
    return assembly.source.scene


def smooth_assembly_of(scene: Model | Assembly, **asked: str | None) -> Assembly:
    """Return the same for what reads equations that hold everywhere; see `refuse_contacts`."""
    assembly = assembly_of(scene, **asked)
    refuse_contacts(assembly)
    return assembly


def refuse_contacts(assembly: Assembly) -> None:
    """Refuse a scene whose equations depend on which gaps are closed and on what sticks."""
    from atwood.simulation.contacts.groups import refuse_groups  # few scenes have any

    refuse_groups(assembly)
    part = next((path for path, local in assembly.mechanism.locals_.items() if local.contacts), None)
    if part is not None:
        raise UnsupportedError(
            "its gap or its dry friction makes other equations of the scene where it opens, closes, slips or sticks",
            where=part,
            advice="Ask this of the scene without that part, or with a joint in its place; runs have it as it is.",
        )


@takes(
    scene=SCENE,
    form=optional(FORM),
    level=optional(LEVEL),
    orientation=optional(ORIENTATION),
    t_end=T_END,
    rtol=RTOL,
    atol=ATOL,
    outputs=OUTPUTS,
    max_step=optional(number("a number of seconds above 0", above=0.0)),
    first_step=optional(number("a number of seconds above 0", above=0.0)),
    impacts=one_of(("together", "one_by_one")),
    solver=SOLVER,
    order=ORDER,
    step=optional(number("a number of seconds above 0", above=0.0)),
    samples=SAMPLES,
    structure=STRUCTURE,
    progress=PROGRESS,
    until=CONDITIONS,
    record=CONDITIONS,
    accuracy=ACCURACY,
    monitor=MONITOR,
    nominal=NOMINAL,
    **LIMITS,
)
def simulate(
    scene: Model | Assembly,
    *,
    form: str | None = None,
    level: str | None = None,
    orientation: str | None = None,
    t_end: float | str | None = None,
    rtol: float = tolerances.RTOL,
    atol: float | None = None,
    outputs: Any = 201,
    max_steps: int | None = None,
    max_seconds: float | None = None,
    max_step: float | None = None,
    solver: str = "auto",
    order: int | None = None,
    step: float | None = None,
    samples: int = 400,
    structure: bool = False,
    progress: Callable[[float], object] | bool | None = None,
    until: Any = None,
    record: Any = None,
    accuracy: float | None = None,
    monitor: Any = None,
    nominal: Mapping[str, Any] | None = None,
    first_step: float | None = None,
    impacts: str = "together",
) -> Result:
    """Simulate a scene from its start to its end.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    form, level, orientation
        See `assemble`. An assembly has them already; what contradicts it is refused.
    t_end
        Time of the end, s, or text such as ``"2 min"``; the scene's own if not given.
    rtol
        Relative tolerance of the solver.
    atol
        Absolute tolerance of the solver, as a share of the scene's own sizes; the same number as `rtol` if not given.
        It is `atol` times the extent of the scene for lengths, `atol` rad for angles, and these divided by the scene's
        time scale for speeds. So it depends on no unit.
    outputs
        Number of output times, evenly spread over the run, or the times themselves, s. Results have just the times
        that are given and were reached, and the last state where none was; with a number of times they also have the
        states before and after each event.
    max_steps, max_seconds
        Limits; a run that meets one returns what it has, and says so in its status. The time counts from this call
        on; a result may have no samples where it does not last to find the start. What is left of it holds for
        `Result.energy`, which makes some runs again.
    max_step, first_step
        The largest step, and the first one at the start and after each event, s, which is worked out if not given: a
        shorter one helps where forces set in far faster than they act at the start.
    solver
        Method: IDA, a Runge-Kutta method, Taylor series, or a symplectic one; ``"auto"`` chooses one that suits. It is
        ``"ida"``: SUNDIALS IDA with the equations as machine code. ``"ida-sundae"``: the same method with IDA's own
        options and the equations as Python, the reference. ``"explicit"``: a Runge-Kutta method of order 8(5,3),
        on constraints too. ``"tsitouras"``: one of order 5(4), which takes fewer slopes where few digits are asked for.
        ``"taylor"``: Taylor series, on constraints too, where every law has them. ``"auto"``: IDA for what is
        stiff, or turns out so, and for index 1; else an explicit method. `Result.solver` says which, and why.
        ``"gauss"``: a symplectic method with equal steps, whose energy error does not grow, for scenes that have a
        Hamiltonian, closed loops that formulas solve included. ``"composition"``: the same where that is
        T(p) + V(q, t), by explicit steps. ``"moreau"``: time stepping over impacts, with equal steps that look for no
        event, for scenes with gaps and dry friction in which very much happens.
    order, step
        Of ``"gauss"`` the order, 2, 4, 6, 8, 10 or 12, and of ``"composition"``, up to 8 (8 if not given), and the
        step, s. A step that is not given is chosen so that the first steps are within the tolerances; ``"moreau"``
        must be given its step.
    samples
        The run is sampled at least so often, whatever is shown of it: for the work that is put in, and for angles to
        count their turns. More are taken where functions of time change faster, unless this is 1.
    structure
        Whether nothing needs to move: a truss, whose forces are asked for. Otherwise what cannot move is refused.
    progress
        Called with the time reached, s; True for a line on standard error that says how far the run is.
    until
        Where the run stops: text such as ``"rod1.angle crosses 30 deg"``, with crosses, rises above or falls below; or
        a function of the scene's quantities by path, ``lambda q: q["bob.position.z"] < -1.0``, which returns a
        comparison that becomes true, or what passes zero; or a list of these. It stops at `t_end` at the latest,
        and where a jump over a value meets a condition, as that of a speed in an impact, just behind it.
    record
        The same, where the run goes on; `Result.events` has when. It changes nothing in the run.
    accuracy
        The largest error of the motion at the outputs, of positions relative to the extent of the scene, and of
        angles, rad, such as 1e-8. The tolerance is chosen for it, in place of `rtol`, by a second solution; where it
        cannot be met, as in chaos, a warning says what was reached and until when. See `Result.accuracy`.
    monitor
        What `atwood.conserved(scene)` returns: `Result.conserved` then has these quantities along the run, and by how
        much they drift.
    nominal
        Sizes of quantities by path, such as ``{"slider.displacement": "1 mm"}``, in place of the scene's own. `atol` is
        a share of them for coordinates, and what is linear in these, and their rates; errors are relative to them in
        `accuracy`, in which other quantities, such as forces, then count too.
    impacts
        How several gaps that close at once collide: ``"together"``, or ``"one_by_one"``, the fastest first.

    Returns
    -------
    Result
        The motion, and everything that follows from it.

    Raises
    ------
    StartError
        If the start is not consistent.
    TopologyError
        If joints and ties let nothing move, and no structure is meant.
    UsageError
        If the end is not after the start, or an argument contradicts the assembly.
    SolveError
        If the solver fails.
    """
    clock = Clock(max_seconds)
    refuse_idle_settings(solver, order, step, first_step)
    refuse_two_accuracies(accuracy, rtol, atol, step)
    with watching() as stopwatch:
        assembly = _to_run(scene, form=form, level=level, orientation=orientation)
        end = assembly.flat.t_end if t_end is None else float(t_end)
        with told(progress, assembly.flat.name, partial(_share, assembly.flat.t_start, end)) as watch:
            options = RunOptions(
                t_end=end,
                relative_tolerance=rtol,
                absolute_tolerance=atol,
                outputs=outputs,
                max_steps=max_steps,
                max_seconds=max_seconds,
                progress=watch,
                max_step=max_step,
                first_step=first_step,
                solver=solver,
                order=order,
                step=step,
                samples=samples,
                structure=structure,
                conditions=conditions_of(until, record),
                nominal=sizes_of(assembly, nominal),
                impacts=impacts,
            )
            made, second, said = _solve_to(accuracy, assembly, options, clock)
    if said:
        warnings.warn(f"{assembly.flat.name}: {said}", stacklevel=3)
    result = Result(replace(made, timings=stopwatch.in_order()), second=second)
    if monitor is None or not made.segments:
        return result
    return Result(result.run, monitor.along(result), second)


def _solve(assembly: Assembly, options: RunOptions, clock: Clock) -> Run:
    """Find the start of an assembly, and run it from there."""
    try:
        with clock.kept(GRACE), stage("start"), without_collection():
            assembly, start = start_with_line_signs(assembly)
    except TimeIsUp:
        return run_out_of_time(assembly, None, options)
    with stage("integration"):
        return run(assembly, start, options, assembly.other_mode, clock)


def solve_as_asked(assembly: Assembly, options: RunOptions) -> tuple[Result, str]:
    """Run an assembly as accurately as its options ask; with what is to be said where that was not reached."""
    made, second, said = _solve_to(options.accuracy, assembly, options, Clock(options.max_seconds))
    return Result(made, second=second), said


def _solve_to(
    accuracy: float | None, assembly: Assembly, options: RunOptions, clock: Clock
) -> tuple[Run, Run | None, str]:
    """Run an assembly, with tolerances for the accuracy that was asked for, if any; see `accurate_run`."""
    if accuracy is None:
        return raised_where_too_tight(lambda given: _solve(assembly, given, clock), assembly, options), None, ""
    from atwood.result.accuracy import accurate_run
    from atwood.simulation.events.sampling import refuse_updates

    refuse_updates(assembly)
    try:
        with clock.kept(GRACE):
            signed, start = start_with_line_signs(assembly)
            solver = choice_at_start(signed, start, options, signed.other_mode).solver
    except TimeIsUp:
        return run_out_of_time(assembly, None, options), None, ""
    return accurate_run(lambda given: _solve(assembly, given, clock), options, accuracy, solver)


def _share(begin: float, end: float, t: float) -> tuple[float, str]:
    """Return how much of a run is done at a time, and where it is in words."""
    return (t - begin) / (end - begin), f"t = {t:.3g} of {end:g} s"


def _refuse_contradictions(assembly: Assembly, given: Mapping[str, str]) -> None:
    """Refuse arguments that say something else than the assembly that is to be run."""
    has = {"form": assembly.form, "level": assembly.level, "orientation": assembly.orientation.kind}
    for name, value in given.items():
        if value != has[name]:
            own = f"has {name} {has[name]!r}" if has[name] else "is in the reduced form, which has no level"
            raise UsageError(
                f"{name}={value!r} contradicts the assembly, which {own}",
                where=assembly.flat.name,
                advice=f"Leave {name} out, or assemble the scene with it.",
            )
