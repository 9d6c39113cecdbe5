"""The same bits on every processor: runs from given states, and no fused operation in any object."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest
from llvmlite import binding

from atwood import simulate, sweep
from atwood.codegen.llvm import build, engine, own, tiers
from atwood.codegen.llvm.engine import lane_count
from atwood_library.scenes import SCENES, Chain

from .bits import differences
from .emulated import MACHINES
from .lanes import SOLVERS, ends
from .run import EMULATED, ROOT

SAMPLE = (
    "double-pendulum explicit",
    "double-pendulum taylor",
    "kepler gauss",
    "kepler composition",
    "four-bar explicit",
    "heavy-top dae",
    "slider-crank taylor",
)
"""Runs that the suite makes; the command makes all."""

FUSED = re.compile(r"\b(vf(n?m)(add|sub)\w*|f(n?)m(add|sub|la|ls)\b\S*)")

PROCESSORS = (("", "skylake-avx512"), ("aarch64-unknown-linux-gnu", "cortex-a76"))


def test_runs_from_given_states_end_in_the_bits_of_the_file() -> None:
    assert differences(SAMPLE) == []


@pytest.mark.parametrize("name", ["nehalem", "haswell", "skylakex"])
def test_another_processor_gives_the_same_bits(name: str) -> None:
    machine = MACHINES[name]
    if not machine.possible:
        pytest.skip("this machine cannot do what that one does")
    inherited = {key: value for key, value in os.environ.items() if key not in EMULATED}
    done = subprocess.run(
        [sys.executable, "-m", "tests.machines.bits", "check", *SAMPLE[:3]],
        cwd=ROOT,
        env={**inherited, **machine.environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "3 runs compared, 0 differ\n", done.stdout + done.stderr


@pytest.mark.parametrize(("name", "width"), [("nehalem", 2), ("haswell", 4), ("skylakex", 8)])
def test_lanes_of_another_processor_have_the_bits_of_runs_alone(name: str, width: int) -> None:
    machine = MACHINES[name]
    if not machine.possible:
        pytest.skip("this machine cannot do what that one does")
    inherited = {key: value for key, value in os.environ.items() if key not in EMULATED}
    done = subprocess.run(
        [sys.executable, "-m", "tests.machines.lanes", str(width)],
        cwd=ROOT,
        env={**inherited, **machine.environment},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == [ends(solver, 1) for solver in SOLVERS]


def assembly_of(text: str, level: int, has_variables: bool, triple: str, processor: str) -> str:
    """Return a module in the language of a processor that has fused operations."""
    target = binding.Target.from_triple(triple or binding.get_process_triple())
    machine = target.create_target_machine(cpu=processor, opt=level)
    with binding.create_context() as context, binding.parse_assembly(text, context) as module:
        found: str = machine.emit_assembly(module)
    return found


def test_nothing_is_fused(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[tuple[str, int, bool]] = []

    def compile_text(text: str, level: int, has_variables: bool = False) -> bytes:
        written.append((text, level, has_variables))
        return engine.compile_text(text, level, has_variables)

    for module in (build, tiers):
        monkeypatch.setattr(module, "compile_text", compile_text)
    tiers._code_of_tapes.cache_clear()
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    monkeypatch.setattr(own, "compiled", {})  # what is in use stays
    functions = own.own_functions.__wrapped__()
    tiers.evaluator.__wrapped__()
    simulate(SCENES["four-bar"](), form="dae", t_end=0.01)
    simulate(Chain(links=7), solver="taylor", t_end=0.01)
    simulate(SCENES["four-bar"](), solver="ida", t_end=0.01)
    sweep(SCENES["double-pendulum"](), {"gravity": [*range(5, 13)]}, t_end=0.01, solver="explicit", threads=1)
    assert any(f"@own_sin_cos_{lane_count()}" in text for text, _, _ in written)
    assert functions.addresses
    assert sum("@evaluate(" in text for text, _, _ in written) > 1
    assert len(written) > 2
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    for triple, processor in PROCESSORS:
        for one in written:
            assert not FUSED.search(assembly_of(*one, triple, processor)), processor


def test_fused_operations_are_seen() -> None:
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    text = """declare double @llvm.fma.f64(double, double, double)
define double @f(double %a, double %b) {
  %c = call double @llvm.fma.f64(double %a, double %a, double %b)
  ret double %c
}"""
    assert all(FUSED.search(assembly_of(text, 1, False, *one)) for one in PROCESSORS)
