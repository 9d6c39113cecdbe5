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
from atwood.expr.functions import (
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
from atwood.expr.functions import solve as solve_linear  # `atwood.solve` is the package of solvers
from atwood.expr.graph import Expression
from atwood.expr.operations import ExternalFunction
from atwood.model.component import Component
from atwood.model.composite import Model, connect
from atwood.model.connectors import Connector, Frame, Groove, Point, Shaft, Slide, connector
from atwood.model.contributions import BodyInertia, Load, Placement, PointInertia
from atwood.model.fields import parameter, signal
from atwood.model.laws import (
    constraint,
    dissipation,
    event,
    force,
    inertia,
    joint,
    lagrangian,
    observable,
    potential,
)
from atwood.model.outline import Outline
from atwood.model.rotation import FREE, Rotation, normals, turn
from atwood.model.scene import Scene
from atwood.model.vector import Vector, as_vector, cross, dot, norm

if TYPE_CHECKING:
    from atwood.checking import CheckReport, check
    from atwood.expr.formula import Formula, formula
    from atwood.model.store import from_data, load_scene, save_scene, to_data
    from atwood.pipeline import Assembly, assemble, simulate
    from atwood.reporting import MechanismReport, report
    from atwood.result.files import SavedResult, load_result, save_result
    from atwood.result.result import Result
    from atwood.study.compare import Comparison, ComparisonRow, compare
    from atwood.study.sweep import Sweep, sweep
    from atwood.view.drawing import animate, plot_mechanism
    from atwood.view.plot import plot
    from atwood.view.precision import plot_comparison
    from atwood.view.sweep import plot_sweep

    __version__: str

__all__ = [
    "FREE",
    "Assembly",
    "AtwoodError",
    "BodyInertia",
    "CheckReport",
    "Comparison",
    "ComparisonRow",
    "Component",
    "ConnectError",
    "Connector",
    "DeclarationError",
    "Expression",
    "ExternalFunction",
    "Formula",
    "Frame",
    "Groove",
    "KernelEvaluationError",
    "Load",
    "MechanismReport",
    "Model",
    "Outline",
    "ParameterError",
    "Placement",
    "Point",
    "PointInertia",
    "Result",
    "ResultError",
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
    "dissipation",
    "dot",
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
    "load_result",
    "load_scene",
    "log",
    "maximum",
    "minimum",
    "norm",
    "normals",
    "observable",
    "parameter",
    "plot",
    "plot_comparison",
    "plot_mechanism",
    "plot_sweep",
    "potential",
    "report",
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
    "sweep",
    "tan",
    "tanh",
    "to_data",
    "turn",
]

_LATER = {
    "Assembly": "atwood.pipeline",
    "CheckReport": "atwood.checking",
    "Comparison": "atwood.study",
    "ComparisonRow": "atwood.study",
    "Formula": "atwood.expr.formula",
    "MechanismReport": "atwood.reporting",
    "Result": "atwood.result.result",
    "SavedResult": "atwood.result.files",
    "Sweep": "atwood.study",
    "animate": "atwood.view",
    "assemble": "atwood.pipeline",
    "check": "atwood.checking",
    "compare": "atwood.study",
    "formula": "atwood.expr.formula",
    "from_data": "atwood.model.store",
    "load_result": "atwood.result.files",
    "load_scene": "atwood.model.store",
    "plot": "atwood.view",
    "plot_comparison": "atwood.view",
    "plot_mechanism": "atwood.view",
    "plot_sweep": "atwood.view",
    "report": "atwood.reporting",
    "save_result": "atwood.result.files",
    "save_scene": "atwood.model.store",
    "simulate": "atwood.pipeline",
    "sweep": "atwood.study",
    "to_data": "atwood.model.store",
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
