"""The methods that solve a scene: one record each, and the one list of them."""

from atwood.integrators.methods.dormand_prince import EXPLICIT
from atwood.integrators.methods.ida import IDA, IDA_SUNDAE
from atwood.integrators.methods.moreau import MOREAU
from atwood.integrators.methods.record import LEAST, Method, Task
from atwood.integrators.methods.symplectic import COMPOSITION, GAUSS
from atwood.integrators.methods.taylor import TAYLOR
from atwood.integrators.methods.tsitouras import TSITOURAS

__all__ = [
    "AUTO",
    "EXPLICIT",
    "GAUSS",
    "IDA",
    "IDA_SUNDAE",
    "LEAST",
    "METHODS",
    "MOREAU",
    "TAYLOR",
    "TSITOURAS",
    "Method",
    "Task",
    "advise",
]

AUTO = "auto"
"""What asks for the method that suits a scene."""

METHODS = {one.key: one for one in (IDA, IDA_SUNDAE, EXPLICIT, TSITOURAS, TAYLOR, GAUSS, COMPOSITION, MOREAU)}
"""All methods, by how they are asked for."""


def advise(*methods: Method) -> str:
    """Return the advice to use one of some methods instead."""
    return f"Use the solver {' or '.join(repr(one.key) for one in methods)}."
