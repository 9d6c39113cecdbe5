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
from atwood.lazy_modules import names_for_checkers
from atwood.model.compose.composite import Model
from atwood.model.compose.connection_rules import connect
from atwood.model.compose.scene import Scene
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Connector, Frame, Groove, Point, Shaft, Slide, connector
from atwood.model.declare.contact_group import ContactGroup
from atwood.model.declare.contact_laws import dry_friction, unilateral
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
    from atwood.exchange.c.export import export_c
    from atwood.exchange.environments.environment import Environment
    from atwood.exchange.fmi.export import ExportedFMU, export_fmu
    from atwood.exchange.fmi.part import FMU
    from atwood.expr.sympy_bridge import Formula, formula
    from atwood.forms.assembly import Assembly
    from atwood.model.compose.serialization import from_data, load_scene, save_scene, to_data
    from atwood.pipeline import assemble, simulate
    from atwood.plotting.diagram import Diagram, diagram
    from atwood.plotting.drawing import animate, plot_mechanism, plot_mode
    from atwood.plotting.pages.page import Page, page
    from atwood.plotting.pages.viewer import Viewer
    from atwood.plotting.plots.energies import plot_energies
    from atwood.plotting.plots.fit import plot_fit
    from atwood.plotting.plots.linear import plot_bode, plot_branches, plot_nyquist, plot_root_locus
    from atwood.plotting.plots.phase import plot_phase_cloud, plot_phase_portrait, plot_section
    from atwood.plotting.plots.precision import plot_comparison
    from atwood.plotting.plots.quantities import plot
    from atwood.plotting.plots.reduction import plot_effective_potential, plot_top_path
    from atwood.plotting.plots.sweep import plot_sweep
    from atwood.plotting.polhodes import plot_free_rotation, plot_polhodes
    from atwood.reporting import MechanismReport, report
    from atwood.result.files import SavedResult, load_result, save_result
    from atwood.result.result import Result
    from atwood.study.comparison.compare import compare
    from atwood.study.comparison.found import Comparison, ComparisonRow
    from atwood.study.comparison.long_runs import LongComparison, compare_long
    from atwood.study.optimal.optimize import Optimum, optimize
    from atwood.study.sensitivities.fit import Fit, fit
    from atwood.study.sensitivities.frameworks import RunFunction, as_jax, as_torch
    from atwood.study.sensitivities.sensitivities import Sensitivities, sensitivities
    from atwood.study.sweeps.files import load_sweep
    from atwood.study.sweeps.indices import SobolIndices
    from atwood.study.sweeps.result import Sweep
    from atwood.study.sweeps.sweep import sweep
    from atwood.theory.action.action_angle import ActionAngle, action_angle
    from atwood.theory.action.adiabatic import AdiabaticInvariant, adiabatic_invariant
    from atwood.theory.action.boundary_values import JoiningMotion, boundary_value_motions
    from atwood.theory.action.integral import Action, SecondVariation, Variation, action
    from atwood.theory.action.principal import PrincipalFunction, principal_function
    from atwood.theory.action.separation import SeparatedMotion, Separation, separation
    from atwood.theory.dynamics.dynamics import Dynamics, dynamics
    from atwood.theory.dynamics.initial_values import StartSolution, solve_initial_values
    from atwood.theory.equations.equations import EquationsOfMotion, PartOfEquations, equations
    from atwood.theory.flow.cloud import LiouvilleDensity, PhaseCloud, liouville_density, phase_cloud
    from atwood.theory.flow.phase_portrait import (
        PhasePortrait,
        PoincareSection,
        RestPoint,
        Separatrix,
        phase_portrait,
        poincare_section,
    )
    from atwood.theory.flow.tangent_flow import LyapunovExponents, TangentFlow, lyapunov_exponents, tangent_flow
    from atwood.theory.formulas.sheet import FormulaSheet, Statement
    from atwood.theory.hamiltonian.conjugate import Conjugate, legendre_transform
    from atwood.theory.hamiltonian.flow import Algebra, Flow, bracket_algebra, flow_of
    from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian
    from atwood.theory.hamiltonian.point_transformations import PointTransformation, point_transformation
    from atwood.theory.hamiltonian.transformations import (
        CanonicalTransformation,
        canonical_transformation,
        fundamental_brackets,
        generated_transformation,
        poisson_bracket,
        poisson_brackets,
        total_derivative,
    )
    from atwood.theory.linear.branches import BranchPoint, EquilibriumBranch, EquilibriumBranches, equilibrium_branches
    from atwood.theory.linear.equilibria import Equilibria, Equilibrium, equilibria
    from atwood.theory.linear.linear_model import LinearModel
    from atwood.theory.linear.linearize import linearize
    from atwood.theory.linear.normal_modes import NormalModes, RootLocus, normal_modes, root_locus
    from atwood.theory.linear.steady import Trim, trim
    from atwood.theory.oscillations.equilibria import SymbolicEquilibria, SymbolicEquilibrium
    from atwood.theory.oscillations.modes import SymbolicMode, SymbolicModes
    from atwood.theory.reduction.reduced import ReducedMotion, reduced
    from atwood.theory.reduction.routhian import Routhian, routhian
    from atwood.theory.rigid.angles import rotation_kinematics
    from atwood.theory.rigid.bodies import rigid_body
    from atwood.theory.rigid.frames import foucault_formulas
    from atwood.theory.rigid.free import FreeRotation, free_body, free_rotation
    from atwood.theory.rigid.tensors import inertia_tensor
    from atwood.theory.rigid.tops import SymmetricTop, symmetric_top, top_formulas
    from atwood.theory.symmetry.conserved import Conserved, ConservedQuantity, conserved
    from atwood.theory.symmetry.galilean import galilean
    from atwood.theory.symmetry.moved import MovedScene, moved
    from atwood.theory.symmetry.stated import Symmetry

    __version__: str

_LATER = names_for_checkers(__name__)
"""Modules of names, which are imported when these are first used."""

__all__ = [  # noqa: RUF022 - by rooms
    "__version__", "CheckReport", "check", "export_c", "FMU", "ExportedFMU", "export_fmu", "Formula", "formula",
    "from_data", "load_scene", "save_scene", "to_data", "Assembly", "assemble", "simulate", "animate", "plot",
    "plot_comparison", "plot_mechanism", "plot_sweep", "Diagram", "diagram", "plot_mode", "Page", "page",
    "Viewer", "plot_fit", "plot_energies", "plot_bode", "plot_branches", "plot_nyquist", "plot_root_locus",
    "plot_effective_potential", "plot_top_path", "plot_phase_cloud", "plot_phase_portrait", "plot_section",
    "plot_free_rotation", "plot_polhodes", "MechanismReport", "report", "SavedResult", "load_result",
    "save_result", "Result", "Environment", "Comparison", "ComparisonRow", "SobolIndices", "Sweep", "compare",
    "load_sweep", "sweep", "Optimum", "optimize", "Fit", "fit", "RunFunction", "as_jax", "as_torch",
    "Sensitivities", "sensitivities", "LongComparison", "compare_long", "ActionAngle", "action_angle",
    "AdiabaticInvariant", "adiabatic_invariant", "JoiningMotion", "boundary_value_motions", "Action",
    "SecondVariation", "Variation", "action", "PrincipalFunction", "principal_function", "SeparatedMotion",
    "Separation", "separation", "Conjugate", "legendre_transform", "Algebra", "Flow", "bracket_algebra",
    "flow_of", "Hamiltonian", "hamiltonian", "PointTransformation", "point_transformation",
    "CanonicalTransformation", "canonical_transformation", "fundamental_brackets", "generated_transformation",
    "poisson_bracket", "poisson_brackets", "total_derivative", "Dynamics", "dynamics", "StartSolution",
    "solve_initial_values", "EquationsOfMotion", "PartOfEquations", "equations", "LiouvilleDensity",
    "PhaseCloud", "liouville_density", "phase_cloud", "PhasePortrait", "PoincareSection", "RestPoint",
    "Separatrix", "phase_portrait", "poincare_section", "LyapunovExponents", "TangentFlow",
    "lyapunov_exponents", "tangent_flow", "BranchPoint", "EquilibriumBranch", "EquilibriumBranches",
    "equilibrium_branches", "Equilibria", "Equilibrium", "equilibria", "LinearModel", "linearize",
    "NormalModes", "RootLocus", "normal_modes", "root_locus", "Trim", "trim", "SymbolicEquilibria",
    "SymbolicEquilibrium", "SymbolicMode", "SymbolicModes", "ReducedMotion", "reduced", "Routhian", "routhian",
    "FormulaSheet", "Statement", "rotation_kinematics", "rigid_body", "foucault_formulas", "FreeRotation",
    "free_body", "free_rotation", "inertia_tensor", "SymmetricTop", "symmetric_top", "top_formulas",
    "Conserved", "ConservedQuantity", "conserved", "galilean", "MovedScene", "moved", "Symmetry",
]  # fmt: skip

# Scenes and models
__all__ += ["Model", "Scene", "connect"]

# Components of one's own
__all__ += [
    "FREE", "BodyInertia", "Component", "Connector", "ContactGroup", "CoordinateLoad", "Expression",
    "ExternalFunction", "Frame", "Groove", "Load", "Number", "Outline", "Placement", "Point", "PointInertia",
    "Rotation", "Scalar", "Shaft", "Slide", "Triple", "Vector", "as_vector", "connector", "constraint",
    "cross", "derivative", "discrete_state", "dissipation", "dot", "dry_friction", "event", "external", "force",
    "inertia", "is_zero", "joint", "lagrangian", "norm", "normals", "observable", "parameter", "potential",
    "select", "signal", "solve_linear", "state", "turn", "unilateral", "update",
]  # fmt: skip

# Errors
__all__ += [
    "AtwoodError", "ConnectError", "DeclarationError", "KernelEvaluationError", "ParameterError", "ResultError",
    "SolveError", "StartError", "TopologyError", "UnsupportedError", "UsageError",
]  # fmt: skip

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
