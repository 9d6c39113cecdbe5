"""Atwood: mechanics from parts.

Everything that is needed to write components, models and scenes is here, and so are the functions that assemble and
run them; those are loaded when they are first used. Beside it, these rooms are public: `atwood.functions` (sines and
the like, for laws), `atwood.solids` (mass properties), `atwood.plotting`, `atwood.reporting`, `atwood.study`
and `atwood.checking`.
"""

from __future__ import annotations

import importlib
import sys
import warnings
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
    absolute as absolute,
    acos as acos,
    asin as asin,
    atan as atan,
    atan2 as atan2,
    cos as cos,
    cosh as cosh,
    exp as exp,
    external,
    floor as floor,
    hypot as hypot,
    is_zero,
    log as log,
    maximum as maximum,
    minimum as minimum,
    select,
    sign as sign,
    sin as sin,
    sinh as sinh,
    solve as solve_linear,
    sqrt as sqrt,
    tan as tan,
    tanh as tanh,
)
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import ExternalFunction
from atwood.model.compose.composite import Model
from atwood.model.compose.connection_rules import connect
from atwood.model.compose.scene import Scene
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Connector, Frame, Groove, Point, Shaft, Slide, connector
from atwood.model.declare.field_functions import Number, Triple, discrete_state, parameter, signal, state
from atwood.model.declare.law_results import BodyInertia, CoordinateLoad, Load, Placement, PointInertia
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
from atwood.model.values.outline import Outline
from atwood.model.values.rotation import FREE, Rotation, normals, turn
from atwood.model.values.space import Vector, as_vector, cross, dot, norm

if TYPE_CHECKING:
    from atwood.checking import CheckReport, check
    from atwood.expr.sympy_bridge import Formula, formula
    from atwood.forms.assembly import Assembly
    from atwood.model.compose.serialization import from_data, load_scene, save_scene, to_data
    from atwood.pipeline import assemble, simulate
    from atwood.plotting.drawing import animate, plot_mechanism, plot_mode
    from atwood.plotting.plots.energies import plot_energies
    from atwood.plotting.plots.linear import plot_bode, plot_branches, plot_nyquist, plot_root_locus
    from atwood.plotting.plots.phase import plot_phase_portrait, plot_section
    from atwood.plotting.plots.precision import plot_comparison
    from atwood.plotting.plots.quantities import plot
    from atwood.plotting.plots.reduction import plot_effective_potential, plot_top_path
    from atwood.plotting.plots.sweep import plot_sweep
    from atwood.plotting.polhodes import plot_polhodes
    from atwood.reporting import MechanismReport, report
    from atwood.result.files import SavedResult, load_result, save_result
    from atwood.result.result import Result
    from atwood.study.comparison.compare import compare
    from atwood.study.comparison.found import Comparison, ComparisonRow
    from atwood.study.comparison.long_runs import LongComparison, compare_long
    from atwood.study.sweeps.files import load_sweep
    from atwood.study.sweeps.result import Sweep
    from atwood.study.sweeps.sweep import sweep
    from atwood.theory.action import (
        Action,
        ActionAngle,
        JoiningMotion,
        SeparatedMotion,
        Separation,
        Variation,
        action,
        action_angle,
        boundary_value_motions,
        separation,
    )
    from atwood.theory.dynamics import Dynamics, StartSolution, dynamics, solve_initial_values
    from atwood.theory.equations import EquationsOfMotion, PartOfEquations, equations
    from atwood.theory.flow import (
        LyapunovExponents,
        PhasePortrait,
        PoincareSection,
        RestPoint,
        TangentFlow,
        lyapunov_exponents,
        phase_portrait,
        poincare_section,
        tangent_flow,
    )
    from atwood.theory.formulas.sheet import FormulaSheet, Statement
    from atwood.theory.hamiltonian import (
        CanonicalTransformation,
        Hamiltonian,
        PointTransformation,
        canonical_transformation,
        fundamental_brackets,
        generated_transformation,
        hamiltonian,
        point_transformation,
        poisson_bracket,
        poisson_brackets,
        total_derivative,
    )
    from atwood.theory.linear import (
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
    from atwood.theory.reduction import ReducedMotion, Routhian, reduced, routhian
    from atwood.theory.rigid import inertia_tensor, rigid_body, rotation_kinematics
    from atwood.theory.symmetry import Conserved, ConservedQuantity, Symmetry, conserved

    __version__: str

__all__ = ["__version__"]

# Scenes and models
__all__ += [
    "Model",
    "Scene",
    "connect",
    "from_data",
    "load_scene",
    "save_scene",
    "to_data",
]

# Runs and studies
__all__ += [
    "Assembly",
    "Comparison",
    "ComparisonRow",
    "MechanismReport",
    "Result",
    "SavedResult",
    "Sweep",
    "assemble",
    "compare",
    "compare_long",
    "load_result",
    "load_sweep",
    "report",
    "save_result",
    "simulate",
    "sweep",
]

# Equations and what follows from them
__all__ += [
    "Action",
    "ActionAngle",
    "BranchPoint",
    "CanonicalTransformation",
    "Conserved",
    "ConservedQuantity",
    "Dynamics",
    "EquationsOfMotion",
    "Equilibria",
    "Equilibrium",
    "EquilibriumBranch",
    "EquilibriumBranches",
    "FormulaSheet",
    "Hamiltonian",
    "JoiningMotion",
    "LinearModel",
    "LongComparison",
    "LyapunovExponents",
    "NormalModes",
    "PartOfEquations",
    "PhasePortrait",
    "PoincareSection",
    "PointTransformation",
    "ReducedMotion",
    "RestPoint",
    "RootLocus",
    "Routhian",
    "SeparatedMotion",
    "Separation",
    "StartSolution",
    "Statement",
    "Symmetry",
    "TangentFlow",
    "Trim",
    "Variation",
    "action",
    "action_angle",
    "boundary_value_motions",
    "canonical_transformation",
    "conserved",
    "dynamics",
    "equations",
    "equilibria",
    "equilibrium_branches",
    "fundamental_brackets",
    "generated_transformation",
    "hamiltonian",
    "inertia_tensor",
    "linearize",
    "lyapunov_exponents",
    "normal_modes",
    "phase_portrait",
    "poincare_section",
    "point_transformation",
    "poisson_bracket",
    "poisson_brackets",
    "reduced",
    "rigid_body",
    "root_locus",
    "rotation_kinematics",
    "routhian",
    "separation",
    "solve_initial_values",
    "tangent_flow",
    "total_derivative",
    "trim",
]

# Pictures
__all__ += [
    "animate",
    "plot",
    "plot_bode",
    "plot_branches",
    "plot_comparison",
    "plot_effective_potential",
    "plot_energies",
    "plot_mechanism",
    "plot_mode",
    "plot_nyquist",
    "plot_phase_portrait",
    "plot_polhodes",
    "plot_root_locus",
    "plot_section",
    "plot_sweep",
    "plot_top_path",
]

# Components of one's own
__all__ += [
    "FREE", "BodyInertia", "CheckReport", "Component", "Connector", "CoordinateLoad", "Expression",
    "ExternalFunction", "Formula", "Frame", "Groove", "Load", "Number", "Outline", "Placement", "Point", "PointInertia",
    "Rotation", "Scalar", "Shaft", "Slide", "Triple", "Vector", "as_vector", "check", "connector", "constraint",
    "cross", "derivative", "discrete_state", "dissipation", "dot", "event", "external", "force", "formula", "inertia",
    "is_zero", "joint", "lagrangian", "norm", "normals", "observable", "parameter", "potential", "select", "signal",
    "solve_linear", "state", "turn", "update",
]  # fmt: skip

# Errors
__all__ += [
    "AtwoodError",
    "ConnectError",
    "DeclarationError",
    "KernelEvaluationError",
    "ParameterError",
    "ResultError",
    "SolveError",
    "StartError",
    "TopologyError",
    "UnsupportedError",
    "UsageError",
]

_ROOMS = {
    "atwood.checking": ("CheckReport", "check"),
    "atwood.expr.sympy_bridge": ("Formula", "formula"),
    "atwood.model.compose.serialization": ("from_data", "load_scene", "save_scene", "to_data"),
    "atwood.pipeline": ("Assembly", "assemble", "simulate"),
    "atwood.plotting": ("animate", "plot", "plot_comparison", "plot_mechanism", "plot_sweep"),
    "atwood.plotting.drawing": ("plot_mode",),
    "atwood.plotting.plots.energies": ("plot_energies",),
    "atwood.plotting.plots.linear": ("plot_bode", "plot_branches", "plot_nyquist", "plot_root_locus"),
    "atwood.plotting.plots.reduction": ("plot_effective_potential", "plot_top_path"),
    "atwood.plotting.plots.phase": ("plot_phase_portrait", "plot_section"),
    "atwood.plotting.polhodes": ("plot_polhodes",),
    "atwood.reporting": ("MechanismReport", "report"),
    "atwood.result.files": ("SavedResult", "load_result", "save_result"),
    "atwood.result.result": ("Result",),
    "atwood.study": ("Comparison", "ComparisonRow", "Sweep", "compare", "load_sweep", "sweep"),
    "atwood.study.comparison.long_runs": ("LongComparison", "compare_long"),
    "atwood.theory.action": (
        "Action", "ActionAngle", "JoiningMotion", "SeparatedMotion", "Separation", "Variation",
        "action", "action_angle", "boundary_value_motions", "separation",
    ),
    "atwood.theory.hamiltonian": (
        "CanonicalTransformation", "Hamiltonian", "PointTransformation",
        "canonical_transformation", "fundamental_brackets", "generated_transformation", "hamiltonian",
        "point_transformation", "poisson_bracket", "poisson_brackets", "total_derivative",
    ),
    "atwood.theory.dynamics": ("Dynamics", "StartSolution", "dynamics", "solve_initial_values"),
    "atwood.theory.equations": ("EquationsOfMotion", "PartOfEquations", "equations"),
    "atwood.theory.flow": (
        "LyapunovExponents", "PhasePortrait", "PoincareSection", "RestPoint", "TangentFlow",
        "lyapunov_exponents", "phase_portrait",
        "poincare_section", "tangent_flow",
    ),
    "atwood.theory.linear": (
        "BranchPoint", "Equilibria", "Equilibrium", "EquilibriumBranch", "EquilibriumBranches",
        "LinearModel", "NormalModes",
        "RootLocus", "Trim", "equilibria", "equilibrium_branches", "linearize", "normal_modes", "root_locus", "trim",
    ),
    "atwood.theory.reduction": ("ReducedMotion", "Routhian", "reduced", "routhian"),
    "atwood.theory.formulas.sheet": ("FormulaSheet", "Statement"),
    "atwood.theory.rigid": ("inertia_tensor", "rigid_body", "rotation_kinematics"),
    "atwood.theory.symmetry": ("Conserved", "ConservedQuantity", "Symmetry", "conserved"),
}  # fmt: skip
_LATER = {name: room for room, names in _ROOMS.items() for name in names}
"""Names whose modules are imported when they are first used; each also stands in `__all__` and above."""

_RENAMED = {"motions_between": "boundary_value_motions", "solve_start": "solve_initial_values"}
"""Names that were others before; the earlier ones work, and warn."""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            found: Any = version("atwood")
        except PackageNotFoundError:  # a checkout that is not installed
            found = "0+unknown"
    elif name in _RENAMED:
        told = f"atwood.{name} is called atwood.{_RENAMED[name]} now; the earlier name will go"
        warnings.warn(told, DeprecationWarning, stacklevel=2)
        return getattr(sys.modules[__name__], _RENAMED[name])
    elif name in _LATER:
        found = getattr(importlib.import_module(_LATER[name]), name)
    else:
        raise AttributeError(f"module 'atwood' has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
