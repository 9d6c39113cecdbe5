"""What is said of loops that nearly close: gaps and lengths with the digits in which they differ."""

from __future__ import annotations

import re

import pytest

from atwood import StartError, simulate

from ...helpers.mechanisms import parallel_four_bar


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("excess", [1e-9, 1e-6])
def test_a_gap_is_never_nothing_and_lengths_differ(form: str, excess: float) -> None:
    scene = parallel_four_bar(cranks=3)
    scene.set("crank1.length", 1.0 + excess)
    with pytest.raises(StartError) as caught:
        simulate(scene, form=form, t_end=0.1)
    said = str(caught.value)
    assert "by nothing" not in said
    gap = re.search(r"(?:by|found is) (\d\S*) m", said)
    assert gap is not None, said
    assert 0.01 * excess < float(gap[1]) < 10.0 * excess
    for new, old in re.findall(r"= (\S+) m \(it is (\S+) m\)", said):
        assert new != old
