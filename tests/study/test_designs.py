"""Sweeps of distributions: designs, what is refused, and Sobol's indices against Ishigami's function."""

from typing import Any

import numpy as np
import pytest
import scipy.stats
from numpy.testing import assert_allclose, assert_array_equal

from atwood import AtwoodError, Component, Number, Scalar, Scene, UsageError, observable, parameter, sin, sweep
from atwood.ranges import values_of
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import DoublePendulum

MASS = {"mass1": scipy.stats.norm(1.0, 0.05), "mass2": scipy.stats.uniform(0.5, 1.0)}


class Ishigami(Component):
    """T. Ishigami and T. Homma, Proc. ISUMA '90: sin(x1) + 7 sin(x2)^2 + 0.1 x3^4 sin(x1)."""

    x1: Number = parameter(0.1, doc="First.")
    x2: Number = parameter(0.1, doc="Second.")
    x3: Number = parameter(0.1, doc="Third.")

    @observable(unit="1", doc="Value.")
    def value(self) -> Scalar:
        return sin(self.x1) + 7.0 * sin(self.x2) * sin(self.x2) + 0.1 * self.x3**4 * sin(self.x1)


def ishigami() -> Scene:
    scene = Scene()
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    scene.add("f", Ishigami())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    return scene


def test_sobol_indices_of_ishigamis_function() -> None:
    """The figures are exact (Saltelli et al., Global Sensitivity Analysis, Wiley, 2008)."""
    wide = scipy.stats.uniform(-np.pi, 2.0 * np.pi)
    vary = {f"f.x{k}": wide for k in (1, 2, 3)}
    found = sweep(ishigami(), vary, quantities=["f.value"], design="saltelli", runs=5 * 2048, t_end=0.01)
    indices = found.sobol_indices("f.value")
    first, total = np.array([0.31390519, 0.44241114, 0.0]), np.array([0.55758886, 0.44241114, 0.24368366])
    assert_allclose(indices.first, first, atol=0.02)
    assert_allclose(indices.total, total, atol=0.02)
    assert np.all(np.abs(indices.first - first) < 3.0 * indices.first_errors)
    assert np.all(np.abs(indices.total - total) < 3.0 * indices.total_errors)
    assert np.all((indices.first_errors < 0.06) & (indices.total_errors < 0.04))
    assert (indices.points, indices.left_out) == (2048, 0)
    assert "f.x2" in str(indices)


@pytest.mark.parametrize("design", ["sobol", "latin", "random", "saltelli"])
def test_samples_have_their_distribution_and_come_again(design: str) -> None:
    options = {"design": design, "runs": 256, "t_end": 0.01}
    one, again, other = (sweep(DoublePendulum(), MASS, **options, seed=seed) for seed in (3, 3, 4))
    for path, values in one.parameters.items():
        assert_array_equal(values, again.parameters[path])
        assert not np.array_equal(values, other.parameters[path])
        assert scipy.stats.kstest(values, MASS[path].cdf).pvalue > 1e-3
    assert one.design == design
    assert one.shape == (256,)


def test_starts_and_counts_have_distributions_too() -> None:
    found = sweep(DoublePendulum(), start={"rod1.angle": scipy.stats.norm(0.0, 0.1)}, runs=8, t_end=0.01)
    assert (found.design, np.std(found.start["rod1.angle"]) > 0.03) == ("sobol", True)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"vary": {"mass1": scipy.stats.norm(1.0, -1.0)}}, "no number"),
        ({"vary": {"mass1": scipy.stats.norm(np.nan, 1.0)}}, "no number"),
        ({"vary": {"mass1": scipy.stats.norm(0.0, 1.0)}}, "mass1"),
        ({"vary": {"mass1": [1.0, 2.0]}}, "distribution"),
        ({"vary": {"mass1": [1.0, 2.0], "mass2": MASS["mass2"]}}, "list of values"),
        ({"vary": {"mass1": scipy.stats.norm}}, "mass1"),
        ({"vary": MASS, "runs": None}, "runs=1024"),
        ({"vary": MASS, "design": "sobel"}, "sobol"),
        ({"vary": MASS, "design": "saltelli", "runs": 63}, "runs=64 or 128"),
        ({"vary": {"mass3": MASS["mass1"]}}, "mass3"),
    ],
)
def test_what_cannot_be_sampled_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(AtwoodError, match=said):
        sweep(DoublePendulum(), **({"runs": 64, "t_end": 0.01} | given))


def test_indices_of_what_has_none_are_refused() -> None:
    plain = sweep(DoublePendulum(), MASS, runs=8, t_end=0.01)
    with pytest.raises(UsageError, match="saltelli"):
        plain.sobol_indices("rod1.angle")
    still = sweep(ishigami(), {"f.x1": scipy.stats.uniform()}, quantities=["rod.angle"],
                  design="saltelli", runs=24, t_end=0.01)  # fmt: skip
    with pytest.raises(AtwoodError, match="does not vary"):
        still.sobol_indices("rod.angle")


def test_distributions_as_they_are_typed() -> None:
    assert values_of("normal(1, 0.05)").mean() == 1.0
    assert values_of("uniform(0.5,2)").support() == (0.5, 2.0)
    assert_allclose(values_of("triangular(1,1.5,3)").support(), (1.0, 3.0))
    assert_allclose(values_of("lognormal(2,0.1)").median(), 2.0)
    for bad in ("norm(1,2)", "normal(1)", "uniform(a,2)", "triangular(1,1,1)", "uniform(0,60)deg"):
        with pytest.raises(UsageError):
            values_of(bad)
