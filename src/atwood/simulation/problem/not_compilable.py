"""What of a scene cannot become machine code, and which component and law it comes from.

A function in Python that a law calls (`atwood.external`), or an operation that nobody has written code for, leaves the
scene to kernels in Python. That is slower by far, so it is said.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from atwood.expr import Expression, live
from atwood.expr.core.program import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.model.declare.component import bind
from atwood.model.local.parts import LocalPart
from atwood.model.values.vector import Vector

_NOT_COMPILABLE: Key[str] = Key("what cannot be compiled")

_PLAIN = ("potential", "dissipation", "force", "inertia", "lagrangian", "derivative")


def find_not_compilable(assembly: Assembly, program: Program) -> str:
    """Return what keeps a program from being compiled, with the component and the law; empty if nothing does."""
    return assembly.shared.get(_NOT_COMPILABLE, lambda: _describe(assembly, program), program)


def announce(assembly: Assembly, not_compilable: str) -> None:
    """Warn that a scene runs through kernels in Python."""
    warnings.warn(
        f"{assembly.flat.name} is evaluated in Python, which is slower: {not_compilable}. Write it in plain "
        "arithmetic with Atwood's functions to have it compiled.",
        stacklevel=2,
    )


def _is_obstacle(node: Expression) -> bool:
    from atwood.codegen.llvm.text import has_code  # not with this module: code that is cached needs no more of LLVM

    return node.operation == "external" or not has_code(node.operation)


def _describe(assembly: Assembly, program: Program) -> str:
    kinds = {node.operation: node for node in program.nodes}
    obstacle = next((node for node in kinds.values() if _is_obstacle(node)), None)
    if obstacle is None:
        return ""
    for path, local in assembly.mechanism.locals_.items():
        for law, expressions in _laws(local):
            for node in live(expressions):
                if _is_obstacle(node):
                    return f"{path}.{law} {_reason(node)}"
    return f"an equation {_reason(obstacle)}"


def _reason(node: Expression) -> str:
    if node.operation == "external":
        return f"calls the function {node.payload.name!r} in Python"
    return f"needs the operation {node.operation!r}, for which there is no machine code"


def _laws(local: LocalPart) -> Iterator[tuple[str, list[Expression]]]:
    """Yield the laws and inputs of a part, by name, with what they compute."""
    for name in local.part.signals:
        yield name, list(_expressions(local.binding.values[name]))
    for joint in local.joints:
        yield joint.law.name, list(_expressions(joint.placement))
    for constraint in local.constraints:
        yield constraint.law.name, [constraint.value]
    component = local.part.component
    bound = bind(component, local.binding)
    for kind in _PLAIN:
        for law in component.laws(kind):  # type: ignore[arg-type]
            if law.holds_in(local.binding.space):
                yield law.name, list(_expressions(getattr(bound, law.name)()))


def _expressions(value: Any) -> Iterator[Expression]:
    """Yield the expressions inside whatever a law returns."""
    if isinstance(value, Expression):
        yield value
    elif isinstance(value, (list, tuple, Vector)):
        for one in value:
            yield from _expressions(one)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            yield from _expressions(getattr(value, field.name))
    elif isinstance(value, Iterator):
        yield from _expressions(list(value))
