"""Scenes of the library: each is known to the command line by its name, and can be a part of another scene."""

from atwood import Scene
from atwood_library.scenes.atwood import Atwood
from atwood_library.scenes.bricard import Bricard
from atwood_library.scenes.chain import Chain
from atwood_library.scenes.double_atwood import DoubleAtwood
from atwood_library.scenes.double_pendulum import DoublePendulum
from atwood_library.scenes.double_pendulum_3d import DoublePendulum3D
from atwood_library.scenes.driven_pendulum import DrivenPendulum
from atwood_library.scenes.flyball_governor import FlyballGovernor
from atwood_library.scenes.foucault_pendulum import FoucaultPendulum
from atwood_library.scenes.four_bar import FourBar
from atwood_library.scenes.four_bar_row import FourBarRow
from atwood_library.scenes.free_body import FreeBody
from atwood_library.scenes.gyroscope import Gyroscope
from atwood_library.scenes.heavy_top import HeavyTop
from atwood_library.scenes.intermediate_axis import IntermediateAxis
from atwood_library.scenes.lagrange_top import LagrangeTop
from atwood_library.scenes.mass_spring_chain import MassSpringChain
from atwood_library.scenes.pendulum_on_cart import PendulumOnCart
from atwood_library.scenes.rolling_ball import RollingBall
from atwood_library.scenes.rolling_disc import RollingDisc
from atwood_library.scenes.simple_pendulum import SimplePendulum
from atwood_library.scenes.slider_crank import SliderCrank
from atwood_library.scenes.spatial_slider_crank import SpatialSliderCrank
from atwood_library.scenes.spherical_pendulum import SphericalPendulum
from atwood_library.scenes.stewart_platform import StewartPlatform
from atwood_library.scenes.universal_shaft import UniversalShaft

__all__ = [
    "SCENES",
    "Atwood",
    "Bricard",
    "Chain",
    "DoubleAtwood",
    "DoublePendulum",
    "DoublePendulum3D",
    "DrivenPendulum",
    "FlyballGovernor",
    "FoucaultPendulum",
    "FourBar",
    "FourBarRow",
    "FreeBody",
    "Gyroscope",
    "HeavyTop",
    "IntermediateAxis",
    "LagrangeTop",
    "MassSpringChain",
    "PendulumOnCart",
    "RollingBall",
    "RollingDisc",
    "SimplePendulum",
    "SliderCrank",
    "SpatialSliderCrank",
    "SphericalPendulum",
    "StewartPlatform",
    "UniversalShaft",
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
    "bricard": Bricard,
    "double-pendulum-3d": DoublePendulum3D,
    "flyball-governor": FlyballGovernor,
    "foucault-pendulum": FoucaultPendulum,
    "four-bar-row": FourBarRow,
    "free-body": FreeBody,
    "gyroscope": Gyroscope,
    "heavy-top": HeavyTop,
    "intermediate-axis": IntermediateAxis,
    "lagrange-top": LagrangeTop,
    "rolling-ball": RollingBall,
    "rolling-disc": RollingDisc,
    "spatial-slider-crank": SpatialSliderCrank,
    "spherical-pendulum": SphericalPendulum,
    "stewart-platform": StewartPlatform,
    "universal-shaft": UniversalShaft,
}
"""All scenes by the name that the command line knows them by."""
