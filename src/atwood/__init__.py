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
    from atwood.checking import CheckReport as CheckReport, check as check
    from atwood.exchange.c.export import export_c as export_c
    from atwood.exchange.environments.environment import Environment as Environment
    from atwood.exchange.fmi.export import ExportedFMU as ExportedFMU, export_fmu as export_fmu
    from atwood.exchange.fmi.part import FMU as FMU
    from atwood.expr.sympy_bridge import Formula as Formula, formula as formula
    from atwood.forms.assembly import Assembly as Assembly
    from atwood.model.compose.serialization import (
        from_data as from_data,
        load_scene as load_scene,
        save_scene as save_scene,
        to_data as to_data,
    )
    from atwood.pipeline import assemble as assemble, simulate as simulate
    from atwood.plotting.diagram import Diagram as Diagram, diagram as diagram
    from atwood.plotting.drawing import animate as animate, plot_mechanism as plot_mechanism, plot_mode as plot_mode
    from atwood.plotting.pages.page import Page as Page, page as page
    from atwood.plotting.pages.viewer import Viewer as Viewer
    from atwood.plotting.plots.energies import plot_energies as plot_energies
    from atwood.plotting.plots.fit import plot_fit as plot_fit
    from atwood.plotting.plots.linear import (
        plot_bode as plot_bode,
        plot_branches as plot_branches,
        plot_nyquist as plot_nyquist,
        plot_root_locus as plot_root_locus,
    )
    from atwood.plotting.plots.phase import (
        plot_phase_cloud as plot_phase_cloud,
        plot_phase_portrait as plot_phase_portrait,
        plot_section as plot_section,
    )
    from atwood.plotting.plots.precision import plot_comparison as plot_comparison
    from atwood.plotting.plots.quantities import plot as plot
    from atwood.plotting.plots.reduction import (
        plot_effective_potential as plot_effective_potential,
        plot_top_path as plot_top_path,
    )
    from atwood.plotting.plots.sweep import plot_sweep as plot_sweep
    from atwood.plotting.polhodes import plot_free_rotation as plot_free_rotation, plot_polhodes as plot_polhodes
    from atwood.reporting import MechanismReport as MechanismReport, report as report
    from atwood.result.files import SavedResult as SavedResult, load_result as load_result, save_result as save_result
    from atwood.result.result import Result as Result
    from atwood.study.comparison.compare import compare as compare
    from atwood.study.comparison.found import Comparison as Comparison, ComparisonRow as ComparisonRow
    from atwood.study.comparison.long_runs import LongComparison as LongComparison, compare_long as compare_long
    from atwood.study.optimal.optimize import Optimum as Optimum, optimize as optimize
    from atwood.study.sensitivities.fit import Fit as Fit, fit as fit
    from atwood.study.sensitivities.frameworks import RunFunction as RunFunction, as_jax as as_jax, as_torch as as_torch
    from atwood.study.sensitivities.sensitivities import Sensitivities as Sensitivities, sensitivities as sensitivities
    from atwood.study.sweeps.files import load_sweep as load_sweep
    from atwood.study.sweeps.indices import SobolIndices as SobolIndices
    from atwood.study.sweeps.result import Sweep as Sweep
    from atwood.study.sweeps.sweep import sweep as sweep
    from atwood.theory.action.action_angle import ActionAngle as ActionAngle, action_angle as action_angle
    from atwood.theory.action.adiabatic import (
        AdiabaticInvariant as AdiabaticInvariant,
        adiabatic_invariant as adiabatic_invariant,
    )
    from atwood.theory.action.boundary_values import (
        JoiningMotion as JoiningMotion,
        boundary_value_motions as boundary_value_motions,
    )
    from atwood.theory.action.integral import (
        Action as Action,
        SecondVariation as SecondVariation,
        Variation as Variation,
        action as action,
    )
    from atwood.theory.action.principal import (
        PrincipalFunction as PrincipalFunction,
        principal_function as principal_function,
    )
    from atwood.theory.action.separation import (
        SeparatedMotion as SeparatedMotion,
        Separation as Separation,
        separation as separation,
    )
    from atwood.theory.dynamics.dynamics import Dynamics as Dynamics, dynamics as dynamics
    from atwood.theory.dynamics.initial_values import (
        StartSolution as StartSolution,
        solve_initial_values as solve_initial_values,
    )
    from atwood.theory.equations.equations import (
        EquationsOfMotion as EquationsOfMotion,
        PartOfEquations as PartOfEquations,
        equations as equations,
    )
    from atwood.theory.flow.cloud import (
        LiouvilleDensity as LiouvilleDensity,
        PhaseCloud as PhaseCloud,
        liouville_density as liouville_density,
        phase_cloud as phase_cloud,
    )
    from atwood.theory.flow.phase_portrait import (
        PhasePortrait as PhasePortrait,
        PoincareSection as PoincareSection,
        RestPoint as RestPoint,
        Separatrix as Separatrix,
        phase_portrait as phase_portrait,
        poincare_section as poincare_section,
    )
    from atwood.theory.flow.tangent_flow import (
        LyapunovExponents as LyapunovExponents,
        TangentFlow as TangentFlow,
        lyapunov_exponents as lyapunov_exponents,
        tangent_flow as tangent_flow,
    )
    from atwood.theory.formulas.sheet import FormulaSheet as FormulaSheet, Statement as Statement
    from atwood.theory.hamiltonian.conjugate import Conjugate as Conjugate, legendre_transform as legendre_transform
    from atwood.theory.hamiltonian.flow import (
        Algebra as Algebra,
        Flow as Flow,
        bracket_algebra as bracket_algebra,
        flow_of as flow_of,
    )
    from atwood.theory.hamiltonian.hamiltonian import Hamiltonian as Hamiltonian, hamiltonian as hamiltonian
    from atwood.theory.hamiltonian.point_transformations import (
        PointTransformation as PointTransformation,
        point_transformation as point_transformation,
    )
    from atwood.theory.hamiltonian.transformations import (
        CanonicalTransformation as CanonicalTransformation,
        canonical_transformation as canonical_transformation,
        fundamental_brackets as fundamental_brackets,
        generated_transformation as generated_transformation,
        poisson_bracket as poisson_bracket,
        poisson_brackets as poisson_brackets,
        total_derivative as total_derivative,
    )
    from atwood.theory.linear.branches import (
        BranchPoint as BranchPoint,
        EquilibriumBranch as EquilibriumBranch,
        EquilibriumBranches as EquilibriumBranches,
        equilibrium_branches as equilibrium_branches,
    )
    from atwood.theory.linear.equilibria import (
        Equilibria as Equilibria,
        Equilibrium as Equilibrium,
        equilibria as equilibria,
    )
    from atwood.theory.linear.linear_model import LinearModel as LinearModel
    from atwood.theory.linear.linearize import linearize as linearize
    from atwood.theory.linear.normal_modes import (
        NormalModes as NormalModes,
        RootLocus as RootLocus,
        normal_modes as normal_modes,
        root_locus as root_locus,
    )
    from atwood.theory.linear.steady import Trim as Trim, trim as trim
    from atwood.theory.oscillations.equilibria import (
        SymbolicEquilibria as SymbolicEquilibria,
        SymbolicEquilibrium as SymbolicEquilibrium,
    )
    from atwood.theory.oscillations.modes import SymbolicMode as SymbolicMode, SymbolicModes as SymbolicModes
    from atwood.theory.reduction.reduced import ReducedMotion as ReducedMotion, reduced as reduced
    from atwood.theory.reduction.routhian import Routhian as Routhian, routhian as routhian
    from atwood.theory.rigid.angles import rotation_kinematics as rotation_kinematics
    from atwood.theory.rigid.bodies import rigid_body as rigid_body
    from atwood.theory.rigid.frames import foucault_formulas as foucault_formulas
    from atwood.theory.rigid.free import (
        FreeRotation as FreeRotation,
        free_body as free_body,
        free_rotation as free_rotation,
    )
    from atwood.theory.rigid.tensors import inertia_tensor as inertia_tensor
    from atwood.theory.rigid.tops import (
        SymmetricTop as SymmetricTop,
        symmetric_top as symmetric_top,
        top_formulas as top_formulas,
    )
    from atwood.theory.symmetry.conserved import (
        Conserved as Conserved,
        ConservedQuantity as ConservedQuantity,
        conserved as conserved,
    )
    from atwood.theory.symmetry.galilean import galilean as galilean
    from atwood.theory.symmetry.moved import MovedScene as MovedScene, moved as moved
    from atwood.theory.symmetry.stated import Symmetry as Symmetry

    __version__: str

_ROOMS = {
    "atwood.checking": ("CheckReport", "check"),
    "atwood.exchange.c.export": ("export_c",),
    "atwood.exchange.fmi.part": ("FMU",),
    "atwood.exchange.fmi.export": ("ExportedFMU", "export_fmu"),
    "atwood.expr.sympy_bridge": ("Formula", "formula"),
    "atwood.model.compose.serialization": ("from_data", "load_scene", "save_scene", "to_data"),
    "atwood.pipeline": ("Assembly", "assemble", "simulate"),
    "atwood.plotting": ("animate", "plot", "plot_comparison", "plot_mechanism", "plot_sweep"),
    "atwood.plotting.diagram": ("Diagram", "diagram"),
    "atwood.plotting.drawing": ("plot_mode",),
    "atwood.plotting.pages.page": ("Page", "page"),
    "atwood.plotting.pages.viewer": ("Viewer",),
    "atwood.plotting.plots.fit": ("plot_fit",),
    "atwood.plotting.plots.energies": ("plot_energies",),
    "atwood.plotting.plots.linear": ("plot_bode", "plot_branches", "plot_nyquist", "plot_root_locus"),
    "atwood.plotting.plots.reduction": ("plot_effective_potential", "plot_top_path"),
    "atwood.plotting.plots.phase": ("plot_phase_cloud", "plot_phase_portrait", "plot_section"),
    "atwood.plotting.polhodes": ("plot_free_rotation", "plot_polhodes"),
    "atwood.reporting": ("MechanismReport", "report"),
    "atwood.result.files": ("SavedResult", "load_result", "save_result"),
    "atwood.result.result": ("Result",),
    "atwood.exchange.environments.environment": ("Environment",),
    "atwood.study": ("Comparison", "ComparisonRow", "SobolIndices", "Sweep", "compare", "load_sweep", "sweep"),
    "atwood.study.optimal.optimize": ("Optimum", "optimize"),
    "atwood.study.sensitivities.fit": ("Fit", "fit"),
    "atwood.study.sensitivities.frameworks": ("RunFunction", "as_jax", "as_torch"),
    "atwood.study.sensitivities.sensitivities": ("Sensitivities", "sensitivities"),
    "atwood.study.comparison.long_runs": ("LongComparison", "compare_long"),
    "atwood.theory.action.action_angle": ("ActionAngle", "action_angle"),
    "atwood.theory.action.adiabatic": ("AdiabaticInvariant", "adiabatic_invariant"),
    "atwood.theory.action.boundary_values": ("JoiningMotion", "boundary_value_motions"),
    "atwood.theory.action.integral": ("Action", "SecondVariation", "Variation", "action"),
    "atwood.theory.action.principal": ("PrincipalFunction", "principal_function"),
    "atwood.theory.action.separation": ("SeparatedMotion", "Separation", "separation"),
    "atwood.theory.hamiltonian.conjugate": ("Conjugate", "legendre_transform"),
    "atwood.theory.hamiltonian.flow": ("Algebra", "Flow", "bracket_algebra", "flow_of"),
    "atwood.theory.hamiltonian.hamiltonian": ("Hamiltonian", "hamiltonian"),
    "atwood.theory.hamiltonian.point_transformations": ("PointTransformation", "point_transformation"),
    "atwood.theory.hamiltonian.transformations": (
        "CanonicalTransformation", "canonical_transformation", "fundamental_brackets", "generated_transformation",
        "poisson_bracket", "poisson_brackets", "total_derivative",
    ),
    "atwood.theory.dynamics.dynamics": ("Dynamics", "dynamics"),
    "atwood.theory.dynamics.initial_values": ("StartSolution", "solve_initial_values"),
    "atwood.theory.equations.equations": ("EquationsOfMotion", "PartOfEquations", "equations"),
    "atwood.theory.flow.cloud": ("LiouvilleDensity", "PhaseCloud", "liouville_density", "phase_cloud"),
    "atwood.theory.flow.phase_portrait": (
        "PhasePortrait", "PoincareSection", "RestPoint", "Separatrix", "phase_portrait", "poincare_section",
    ),
    "atwood.theory.flow.tangent_flow": ("LyapunovExponents", "TangentFlow", "lyapunov_exponents", "tangent_flow"),
    "atwood.theory.linear.branches": (
        "BranchPoint", "EquilibriumBranch", "EquilibriumBranches", "equilibrium_branches",
    ),
    "atwood.theory.linear.equilibria": ("Equilibria", "Equilibrium", "equilibria"),
    "atwood.theory.linear.linear_model": ("LinearModel",),
    "atwood.theory.linear.linearize": ("linearize",),
    "atwood.theory.linear.normal_modes": ("NormalModes", "RootLocus", "normal_modes", "root_locus"),
    "atwood.theory.linear.steady": ("Trim", "trim"),
    "atwood.theory.oscillations.equilibria": ("SymbolicEquilibria", "SymbolicEquilibrium"),
    "atwood.theory.oscillations.modes": ("SymbolicMode", "SymbolicModes"),
    "atwood.theory.reduction.reduced": ("ReducedMotion", "reduced"),
    "atwood.theory.reduction.routhian": ("Routhian", "routhian"),
    "atwood.theory.formulas.sheet": ("FormulaSheet", "Statement"),
    "atwood.theory.rigid.angles": ("rotation_kinematics",),
    "atwood.theory.rigid.bodies": ("rigid_body",),
    "atwood.theory.rigid.frames": ("foucault_formulas",),
    "atwood.theory.rigid.free": ("FreeRotation", "free_body", "free_rotation"),
    "atwood.theory.rigid.tensors": ("inertia_tensor",),
    "atwood.theory.rigid.tops": ("SymmetricTop", "symmetric_top", "top_formulas"),
    "atwood.theory.symmetry.conserved": ("Conserved", "ConservedQuantity", "conserved"),
    "atwood.theory.symmetry.galilean": ("galilean",),
    "atwood.theory.symmetry.moved": ("MovedScene", "moved"),
    "atwood.theory.symmetry.stated": ("Symmetry",),
}  # fmt: skip
_LATER = {name: room for room, names in _ROOMS.items() for name in names}
"""Names whose modules are imported when they are first used; type checkers read them above."""

__all__ = ["__version__", *_LATER]

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
