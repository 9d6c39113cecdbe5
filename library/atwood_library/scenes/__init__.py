"""Scenes of the library: each is known to the command line by its name, and can be a part of another scene."""

from atwood import Scene
from atwood_library.scenes.atwood import Atwood
from atwood_library.scenes.chain import Chain
from atwood_library.scenes.double_atwood import DoubleAtwood
from atwood_library.scenes.double_pendulum import DoublePendulum
from atwood_library.scenes.driven_pendulum import DrivenPendulum
from atwood_library.scenes.four_bar import FourBar
from atwood_library.scenes.mass_spring_chain import MassSpringChain
from atwood_library.scenes.pendulum_on_cart import PendulumOnCart
from atwood_library.scenes.simple_pendulum import SimplePendulum
from atwood_library.scenes.slider_crank import SliderCrank

__all__ = [
    "SCENES",
    "Atwood",
    "Chain",
    "DoubleAtwood",
    "DoublePendulum",
    "DrivenPendulum",
    "FourBar",
    "MassSpringChain",
    "PendulumOnCart",
    "SimplePendulum",
    "SliderCrank",
]

SCENES: dict[str, type[Scene]] = {
    "simple-pendulum": SimplePendulum,
    "double-pendulum": DoublePendulum,
    "pendulum-on-cart": PendulumOnCart,
    "mass-spring-chain": MassSpringChain,
    "atwood": Atwood,
    "double-atwood": DoubleAtwood,
    "four-bar": FourBar,
    "slider-crank": SliderCrank,
    "chain": Chain,
    "driven-pendulum": DrivenPendulum,
}
"""All scenes by the name that the command line knows them by."""
