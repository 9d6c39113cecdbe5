"""A scene that is shifted, turned and carried along moves as its motion does; what does not is refused by name."""

import numpy as np
import pytest

import atwood
from atwood import UnsupportedError, UsageError
from atwood_library.scenes import (
    ChargedParticle,
    Clutches,
    DoublePendulum,
    FoucaultPendulum,
    FourBar,
    LagrangeTop,
    MassSpringChain,
    PendulumOnCart,
    RigidBodies,
    RollingDisc,
    SimplePendulum,
    TwoBody,
)

PLANE = {"by": (1.0, 0.0, -0.5), "turned": 0.7}
SPACE = {"by": (1.0, 2.0, 3.0), "turned": 2.5, "axis": (1.0, 2.0, -1.0)}
BOOST = {"velocity": (1.0, 2.0, 3.0), "turned": -1.0, "axis": (0.0, 1.0, 1.0)}


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("scene", "change"),
    [
        (DoublePendulum, PLANE),
        (FourBar, PLANE),
        (PendulumOnCart, PLANE),
        (Clutches, PLANE),
        (SimplePendulum, {"turned": np.pi}),
        (SimplePendulum, {"turned": 2.0, "axis": (0.0, 3.0, 0.0), "by": (1e3, 0.0, 1e-3)}),
        (MassSpringChain, {"by": (-2.0, 0.0, 0.0)}),
        (LagrangeTop, SPACE),
        (RollingDisc, SPACE),
        (TwoBody, BOOST),
        (RigidBodies, BOOST),
    ],
)
def test_motions_are_the_same_up_to_the_transformation(scene, change, form):
    found = atwood.moved(scene(), form=form, t_end=1.0, **change)
    assert found.difference < 1e-6
    assert found.assembly.form == form
    assert np.allclose(found.rotation @ found.rotation.T, np.eye(3), rtol=0.0, atol=1e-14)


def test_moving_back_gives_the_scene_and_places_are_where_they_should_be():
    there = atwood.moved(TwoBody(), by=(1.0, 0.0, 0.0), velocity=(0.0, 0.0, 2.0), t_end=1.0)
    plain, run = (atwood.simulate(one, t_end=1.0, outputs=[1.0]) for one in (TwoBody(), there.assembly))
    assert run["body1.position.z"][-1] == pytest.approx(plain["body1.position.z"][-1] + 2.0, abs=1e-7)
    assert run["body1.position.x"][-1] == pytest.approx(plain["body1.position.x"][-1] + 1.0, abs=1e-7)
    back = atwood.moved(there.assembly, by=(-1.0, 0.0, 0.0), velocity=(0.0, 0.0, -2.0), t_end=1.0)
    start = atwood.assemble(TwoBody()).flat.start
    assert {path: back.assembly.flat.start[path] for path in start} == pytest.approx(start)


@pytest.mark.parametrize(
    ("scene", "change", "error", "said"),
    [
        (SimplePendulum, {"velocity": (1.0, 0.0, 0.0)}, UnsupportedError, "ground: it stands still in the world"),
        (ChargedParticle, {"turned": 0.5}, UnsupportedError, "particle: it does not move alike"),
        (FoucaultPendulum, {"turned": 0.5}, UnsupportedError, "its moved start is none of the moved scene"),
        (SimplePendulum, {"by": (0.0, 1.0, 0.0)}, UsageError, "it would leave the plane"),
        (SimplePendulum, {"turned": 1.0, "axis": (0.0, 0.0, 1.0)}, UsageError, "it would leave the plane"),
        (SimplePendulum, {"axis": (0.0, 0.0, 0.0)}, UsageError, "axis"),
    ],
)
def test_what_does_not_move_alike_is_refused_by_name(scene, change, error, said):
    with pytest.raises(error, match=said):
        atwood.moved(scene(), t_end=1.0, **change)
