"""What a chain costs grows linearly with its length."""

import gc
import itertools
from typing import Any

import numpy as np
import pytest
from tests.calls import calls

from atwood import Scene, simulate
from atwood.expr import Expression, affine_coefficients
from atwood.expr.core import graph as core_graph
from atwood.expr.simplify import alike
from atwood.expr.simplify.collect import collect
from atwood.forms import caches
from atwood.forms.accelerations import acceleration_program
from atwood.mechanics.constraints import elimination
from atwood.mechanics.dynamics import augmented
from atwood.pipeline import assemble
from atwood_library.scenes import Chain, FourBarRow


def operations(links: int, form: str) -> int:
    return sum(assemble(Chain(links=links), form=form).form_program().operations.values())


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_operations_grow_linearly(form: str) -> None:
    # well above the size up to which rows are rewritten as by hand
    counts = [operations(links, form) for links in (20, 30, 40, 50)]
    steps = [b - a for a, b in itertools.pairwise(counts)]
    assert len(set(steps)) == 1
    # a link costs a sine, a cosine, two accelerations and its share of the balance
    assert steps[0] / 10 < (32 if form == "reduced" else 40)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_hundred_links_are_derived_at_once(form: str) -> None:
    needed = []
    for links in (50, 100):
        with calls() as made:
            assembly = assemble(Chain(links=links), form=form)
            operations = assembly.form_program().residual.operations
        needed.append(made.count)
    assert sum(operations.values()) < 5000
    assert needed[1] < 2.2 * needed[0]


def test_a_constraint_looks_at_its_own_coordinates(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[int, int] = {}
    for windows in (5, 10):

        def counted(value: Any, free: Any, known: Any, windows: int = windows) -> Any:
            asked[windows] = max(asked.get(windows, 0), len(free))
            return affine_coefficients(value, free, known)

        monkeypatch.setattr(elimination, "affine_coefficients", counted)
        assert assemble(FourBarRow(windows=windows)).reduced.constraints
    assert 0 < asked[5] == asked[10]


def nodes_of_accelerations(links: int) -> list[tuple[object, ...]]:
    nodes = acceleration_program(assemble(Chain(links=links))).program.nodes
    place = {node: i for i, node in enumerate(nodes)}
    return [(one.operation, one.payload, *(place[argument] for argument in one.arguments)) for one in nodes]


def test_equal_links_are_rewritten_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rewritten = [0]

    def counted(*given: Any, **named: Any) -> Any:
        rewritten[0] += 1
        return collect(*given, **named)

    monkeypatch.setenv("ATWOOD_CACHE", "0")
    monkeypatch.setattr(alike, "collect", counted)
    found, counts = {}, {}
    for links in (20, 40):
        rewritten[0] = 0
        found[links] = nodes_of_accelerations(links)
        counts[links] = rewritten[0]
    assert counts[20] == counts[40]
    monkeypatch.setattr(alike, "_shape", lambda *_: object())  # as if each were of a shape of its own
    rewritten[0] = 0
    assert nodes_of_accelerations(40) == found[40]
    assert rewritten[0] > 4 * counts[40]


@pytest.mark.parametrize(("scene", "share"), [(Chain(links=20), 0.7), (FourBarRow(windows=3), 0.9)])
def test_what_a_large_graph_forgets_is_nothing_that_anybody_has(
    scene: Scene, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    how: dict[str, Any] = {"t_end": 0.05, "outputs": 5, "solver": "explicit"}
    before = simulate(scene, **how)
    for module in (core_graph, caches):
        monkeypatch.setattr(module, "MANY", 0)
    monkeypatch.setattr(augmented, "_MANY", 50)
    assembly = assemble(scene)
    found = simulate(assembly, **how)
    for path in before:
        np.testing.assert_allclose(found[path], before[path], rtol=1e-9, atol=1e-9, err_msg=path)
    graph = assembly.mechanism.table.graph
    there = {node for node in graph.nodes if node is not graph.zero}
    assert len(there) < share * len(graph)
    assert all(argument in there for node in there for argument in node.arguments if argument is not graph.zero)
    gc.collect()
    everywhere = {one for one in gc.get_objects() if type(one) is Expression and one.graph is graph}
    assert everywhere == there | {graph.zero}


def test_energies_of_parts_are_made_when_they_are_asked_for() -> None:
    assembly = assemble(Chain(links=3))
    observables, graph = assembly.observables, assembly.mechanism.table.graph
    assert "bob[0].velocity.x" in observables
    made = len(graph)
    kinetic = observables["bob[0].kinetic_energy"]
    assert len(graph) > made
    assert {"bob[0].kinetic_energy", "bob[0].potential_energy"} <= set(observables)
    assert observables["bob[0].kinetic_energy"] is kinetic
    with pytest.raises(KeyError):
        observables["ground.kinetic_energy"]  # it has no inertia


def test_no_sympy_on_the_way() -> None:
    import subprocess
    import sys

    script = (
        "import sys\n"
        "from atwood.pipeline import simulate\n"
        "from atwood_library.scenes import Chain\n"
        "result = simulate(Chain(links=3), t_end=0.1, outputs=2)\n"
        "result.at(-1)\n"
        "assert 'sympy' not in sys.modules and 'matplotlib' not in sys.modules\n"
    )
    import os
    from pathlib import Path

    root = Path(__file__).resolve().parents[2]
    path = os.pathsep.join([str(root / "src"), str(root / "library")])
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
