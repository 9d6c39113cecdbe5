"""Atwood: mechanics from parts.

Everything that is needed to write components, models and scenes is here, and so are the functions that assemble and
run them; those are loaded when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from atwood.errors import (
    AtwoodError,
    ConnectError,
    DeclarationError,
    KernelEvaluationError,
    ParameterError,
    ResultError,
    SolveError,
    StartError,
    TopologyError,
    UnsupportedError,
    UsageError,
)
from atwood.expr.core.functions import (
    Scalar,
    absolute,
    acos,
    asin,
    atan,
    atan2,
    cos,
    cosh,
    exp,
    external,
    floor,
    hypot,
    is_zero,
    log,
    maximum,
    minimum,
    select,
    sign,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)
from atwood.expr.core.functions import solve as solve_linear  # a law would read `solve` as anything
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import ExternalFunction
from atwood.model.compose.composite import Model, connect
from atwood.model.compose.scene import Scene
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Connector, Frame, Groove, Point, Shaft, Slide, connector
from atwood.model.declare.contributions import BodyInertia, Load, Placement, PointInertia
from atwood.model.declare.fields import parameter, signal
from atwood.model.declare.laws import (
    constraint,
    derivative,
    dissipation,
    event,
    force,
    inertia,
    joint,
    lagrangian,
    observable,
    potential,
    update,
)
from atwood.model.declare.states import discrete_state, state
from atwood.model.values.outline import Outline
from atwood.model.values.rotation import FREE, Rotation, normals, turn
from atwood.model.values.vector import Vector, as_vector, cross, dot, norm

if TYPE_CHECKING:
    from atwood.checking import CheckReport, check
    from atwood.expr.formulas.formula import Formula, formula
    from atwood.model.compose.serialization import from_data, load_scene, save_scene, to_data
    from atwood.pipeline import Assembly, assemble, simulate
    from atwood.plotting.drawing import animate, plot_mechanism
    from atwood.plotting.mode_shapes import plot_mode
    from atwood.plotting.plots.linear import plot_bode, plot_branches, plot_nyquist, plot_root_locus
    from atwood.plotting.plots.precision import plot_comparison
    from atwood.plotting.plots.quantities import plot
    from atwood.plotting.plots.sweep import plot_sweep
    from atwood.reporting import MechanismReport, report
    from atwood.result.files import SavedResult, load_result, save_result
    from atwood.result.result import Result
    from atwood.study.comparison.compare import Comparison, ComparisonRow, compare
    from atwood.study.sweeps.files import load_sweep
    from atwood.study.sweeps.sweep import Sweep, sweep
    from atwood.theory.dynamics import Dynamics, dynamics
    from atwood.theory.equations import EquationsOfMotion, PartOfEquations, equations
    from atwood.theory.linearization import (
        BranchPoint,
        Equilibria,
        Equilibrium,
        EquilibriumBranch,
        EquilibriumBranches,
        LinearModel,
        NormalModes,
        RootLocus,
        Trim,
        equilibria,
        equilibrium_branches,
        linearize,
        normal_modes,
        root_locus,
        trim,
    )

    __version__: str

__all__ = [
    "FREE",
    "Assembly",
    "AtwoodError",
    "BodyInertia",
    "BranchPoint",
    "CheckReport",
    "Comparison",
    "ComparisonRow",
    "Component",
    "ConnectError",
    "Connector",
    "DeclarationError",
    "Dynamics",
    "EquationsOfMotion",
    "Equilibria",
    "Equilibrium",
    "EquilibriumBranch",
    "EquilibriumBranches",
    "Expression",
    "ExternalFunction",
    "Formula",
    "Frame",
    "Groove",
    "KernelEvaluationError",
    "LinearModel",
    "Load",
    "MechanismReport",
    "Model",
    "NormalModes",
    "Outline",
    "ParameterError",
    "PartOfEquations",
    "Placement",
    "Point",
    "PointInertia",
    "Result",
    "ResultError",
    "RootLocus",
    "Rotation",
    "SavedResult",
    "Scalar",
    "Scene",
    "Shaft",
    "Slide",
    "SolveError",
    "StartError",
    "Sweep",
    "TopologyError",
    "Trim",
    "UnsupportedError",
    "UsageError",
    "Vector",
    "__version__",
    "absolute",
    "acos",
    "animate",
    "as_vector",
    "asin",
    "assemble",
    "atan",
    "atan2",
    "check",
    "compare",
    "connect",
    "connector",
    "constraint",
    "cos",
    "cosh",
    "cross",
    "derivative",
    "discrete_state",
    "dissipation",
    "dot",
    "dynamics",
    "equations",
    "equilibria",
    "equilibrium_branches",
    "event",
    "exp",
    "external",
    "floor",
    "force",
    "formula",
    "from_data",
    "hypot",
    "inertia",
    "is_zero",
    "joint",
    "lagrangian",
    "linearize",
    "load_result",
    "load_scene",
    "load_sweep",
    "log",
    "maximum",
    "minimum",
    "norm",
    "normal_modes",
    "normals",
    "observable",
    "parameter",
    "plot",
    "plot_bode",
    "plot_branches",
    "plot_comparison",
    "plot_mechanism",
    "plot_mode",
    "plot_nyquist",
    "plot_root_locus",
    "plot_sweep",
    "potential",
    "report",
    "root_locus",
    "save_result",
    "save_scene",
    "select",
    "sign",
    "signal",
    "simulate",
    "sin",
    "sinh",
    "solve_linear",
    "sqrt",
    "state",
    "sweep",
    "tan",
    "tanh",
    "to_data",
    "trim",
    "turn",
    "update",
]

_LATER = {
    "Assembly": "atwood.pipeline",
    "BranchPoint": "atwood.theory.linearization",
    "CheckReport": "atwood.checking",
    "Comparison": "atwood.study",
    "ComparisonRow": "atwood.study",
    "Dynamics": "atwood.theory.dynamics",
    "EquationsOfMotion": "atwood.theory.equations",
    "Equilibria": "atwood.theory.linearization",
    "Equilibrium": "atwood.theory.linearization",
    "EquilibriumBranch": "atwood.theory.linearization",
    "EquilibriumBranches": "atwood.theory.linearization",
    "Formula": "atwood.expr.formulas.formula",
    "LinearModel": "atwood.theory.linearization",
    "MechanismReport": "atwood.reporting",
    "NormalModes": "atwood.theory.linearization",
    "PartOfEquations": "atwood.theory.equations",
    "Result": "atwood.result.result",
    "RootLocus": "atwood.theory.linearization",
    "SavedResult": "atwood.result.files",
    "Sweep": "atwood.study",
    "Trim": "atwood.theory.linearization",
    "animate": "atwood.plotting",
    "assemble": "atwood.pipeline",
    "check": "atwood.checking",
    "compare": "atwood.study",
    "dynamics": "atwood.theory.dynamics",
    "equations": "atwood.theory.equations",
    "equilibria": "atwood.theory.linearization",
    "equilibrium_branches": "atwood.theory.linearization",
    "formula": "atwood.expr.formulas.formula",
    "from_data": "atwood.model.compose.serialization",
    "linearize": "atwood.theory.linearization",
    "load_result": "atwood.result.files",
    "load_scene": "atwood.model.compose.serialization",
    "load_sweep": "atwood.study",
    "normal_modes": "atwood.theory.linearization",
    "plot": "atwood.plotting",
    "plot_bode": "atwood.plotting.plots.linear",
    "plot_branches": "atwood.plotting.plots.linear",
    "plot_comparison": "atwood.plotting",
    "plot_mechanism": "atwood.plotting",
    "plot_mode": "atwood.plotting.mode_shapes",
    "plot_nyquist": "atwood.plotting.plots.linear",
    "plot_root_locus": "atwood.plotting.plots.linear",
    "plot_sweep": "atwood.plotting",
    "report": "atwood.reporting",
    "root_locus": "atwood.theory.linearization",
    "save_result": "atwood.result.files",
    "save_scene": "atwood.model.compose.serialization",
    "simulate": "atwood.pipeline",
    "sweep": "atwood.study",
    "to_data": "atwood.model.compose.serialization",
    "trim": "atwood.theory.linearization",
}
"""Names whose modules are imported when they are first used; each also stands in `__all__` and above."""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            found: Any = version("atwood")
        except PackageNotFoundError:  # a checkout that is not installed
            found = "0+unknown"
    elif name in _LATER:
        found = getattr(importlib.import_module(_LATER[name]), name)
    else:
        raise AttributeError(f"module 'atwood' has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
