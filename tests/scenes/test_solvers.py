"""The driver with compiled equations against the reference: scikit-sundae with equations in Python."""

import numpy as np
import pytest

from atwood import UsageError, simulate
from atwood.solve.sundials_library import available
from atwood_library.scenes import SCENES


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SCENES)
def test_both_drivers_agree(name: str, form: str) -> None:
    assert available()
    scene = SCENES[name]()
    end = min(scene.t_end, 1.0)
    native, reference = (
        simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=11, solver=solver) for solver in ("ida", "ida-sundae")
    )
    assert (native.run.solver, reference.run.solver) == ("ida", "ida-sundae")
    for path in native.paths:
        one, other = native.array(path), reference.array(path)
        assert np.max(np.abs(one - other)) <= 3e-6 * max(1.0, np.max(np.abs(other))), path


def test_an_unknown_solver_is_refused() -> None:
    with pytest.raises(UsageError, match="ida-sundae"):
        simulate(SCENES["atwood"](), solver="ida-sundea")
