"""A linear solver with fixed pivots as SUNDIALS calls it: its matrix is one column with all entries."""

from __future__ import annotations

from collections.abc import Mapping

from atwood.codegen.llvm.build import Built, build_code
from atwood.codegen.llvm.fixed_pivots import AGAIN, SLOTS, fixed_pivots_text
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.once import once
from atwood.codegen.sundials.text import array_of, sundials_layout

__all__ = ["fixed_pivots_addresses"]

_EXPORTS = ("setup_fixed", "answer_fixed")


def fixed_pivots_addresses() -> Mapping[str, int]:
    """Return the addresses of ``setup`` and ``solve`` with the signatures of SUNDIALS' linear solvers.

    The content of the solver is a block of `atwood.codegen.llvm.fixed_pivots.SLOTS`. Where the factors do not pass the
    probe, or are not finite, both go to the block's own functions until the next setup.
    """
    found = _code().code.addresses
    return dict(zip(("setup", "solve"), (found[name] for name in _EXPORTS), strict=True))


@once
def _code() -> Built:
    text = fixed_pivots_text() + _setup_text() + _solve_text()
    return build_code([], CodeOptions(level=2), more=text, exports=_EXPORTS)


def _slot(name: str, kind: str = "ptr") -> str:
    """Write how to read a slot of the block."""
    at = SLOTS.index(name)
    return f"""  %{name}.slot = getelementptr i64, ptr %block, i64 {at}
  %{name} = load {kind}, ptr %{name}.slot
"""


def _setup_text() -> str:
    entries = array_of("values", "matrix", sundials_layout().dense_data)
    return f"""define i32 @setup_fixed(ptr %solver, ptr %matrix) #0 {{
  %block = load ptr, ptr %solver
{entries}{_slot("entries", "i64")}{_slot("failed", "i64")}{_slot("mend")}
  store ptr %values, ptr %entries.slot
  br label %try
try:
  call void @factorise_fixed(ptr %block)
  %fails = call i1 @fails_fixed(ptr %block)
  %fails.so = zext i1 %fails to i64
  store i64 %fails.so, ptr %failed.slot
  br i1 %fails, label %otherwise, label %done
otherwise:
  %code = call i32 %mend()
  %again = icmp eq i32 %code, {AGAIN}
  br i1 %again, label %try, label %refuse
refuse:
  ret i32 %code
done:
  ret i32 0
}}
"""


def _solve_text() -> str:
    layout = sundials_layout()
    vectors = array_of("y", "solution", layout.vector_data) + array_of("b", "right", layout.vector_data)
    return f"""define i32 @answer_fixed(ptr %solver, ptr %matrix, ptr %solution, ptr %right, double %tolerance) #0 {{
  %block = load ptr, ptr %solver
{vectors}{_slot("failed", "i64")}  %well = icmp eq i64 %failed, 0
  br i1 %well, label %ours, label %otherwise
ours:
  call void @solve_fixed(ptr %block, ptr %b, ptr %y)
  ret i32 0
otherwise:
{_slot("solve")}  %code = call i32 %solve(ptr %b, ptr %y)
  ret i32 %code
}}
"""
