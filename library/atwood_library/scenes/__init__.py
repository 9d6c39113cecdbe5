"""Scenes of the library: each is known to the command line by its name, and can be a part of another scene.

A scene is loaded when it is first used. A new one stands here twice: as an import, for type checkers and editors, and
in `_CLASSES`; its file is named after it, with underscores.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from atwood import Scene

if TYPE_CHECKING:
    from atwood_library.scenes.andrews_squeezer import AndrewsSqueezer as AndrewsSqueezer
    from atwood_library.scenes.atwood import Atwood as Atwood
    from atwood_library.scenes.ball_in_shell import BallInShell as BallInShell
    from atwood_library.scenes.bead_on_surface import BeadOnSurface as BeadOnSurface
    from atwood_library.scenes.bead_on_wire import BeadOnWire as BeadOnWire
    from atwood_library.scenes.benchmark_bicycle import BenchmarkBicycle as BenchmarkBicycle
    from atwood_library.scenes.billiards import Billiards as Billiards
    from atwood_library.scenes.bouncing_ball import BouncingBall as BouncingBall
    from atwood_library.scenes.bricard import Bricard as Bricard
    from atwood_library.scenes.car_axis import CarAxis as CarAxis
    from atwood_library.scenes.cart_pole import CartPole as CartPole
    from atwood_library.scenes.chain import Chain as Chain
    from atwood_library.scenes.chaplygin_sleigh import ChaplyginSleigh as ChaplyginSleigh
    from atwood_library.scenes.charged_particle import ChargedParticle as ChargedParticle
    from atwood_library.scenes.clutches import Clutches as Clutches
    from atwood_library.scenes.double_atwood import DoubleAtwood as DoubleAtwood
    from atwood_library.scenes.double_cardan_twice import DoubleCardanTwice as DoubleCardanTwice
    from atwood_library.scenes.double_pendulum import DoublePendulum as DoublePendulum
    from atwood_library.scenes.double_pendulum_3d import DoublePendulum3D as DoublePendulum3D
    from atwood_library.scenes.driven_pendulum import DrivenPendulum as DrivenPendulum
    from atwood_library.scenes.elastic_pendulum import ElasticPendulum as ElasticPendulum
    from atwood_library.scenes.falling_with_drag import FallingWithDrag as FallingWithDrag
    from atwood_library.scenes.flyball_governor import FlyballGovernor as FlyballGovernor
    from atwood_library.scenes.foucault_pendulum import FoucaultPendulum as FoucaultPendulum
    from atwood_library.scenes.four_bar import FourBar as FourBar
    from atwood_library.scenes.four_bar_row import FourBarRow as FourBarRow
    from atwood_library.scenes.free_body import FreeBody as FreeBody
    from atwood_library.scenes.free_symmetric_body import FreeSymmetricBody as FreeSymmetricBody
    from atwood_library.scenes.furuta_pendulum import FurutaPendulum as FurutaPendulum
    from atwood_library.scenes.gyroscope import Gyroscope as Gyroscope
    from atwood_library.scenes.heavy_top import HeavyTop as HeavyTop
    from atwood_library.scenes.intermediate_axis import IntermediateAxis as IntermediateAxis
    from atwood_library.scenes.kepler import Kepler as Kepler
    from atwood_library.scenes.lagrange_top import LagrangeTop as LagrangeTop
    from atwood_library.scenes.mass_spring_chain import MassSpringChain as MassSpringChain
    from atwood_library.scenes.n_body import NBody as NBody
    from atwood_library.scenes.newtons_cradle import NewtonsCradle as NewtonsCradle
    from atwood_library.scenes.oscillators import Oscillators as Oscillators
    from atwood_library.scenes.overhead_crane import OverheadCrane as OverheadCrane
    from atwood_library.scenes.pendulum_on_cart import PendulumOnCart as PendulumOnCart
    from atwood_library.scenes.pulley_with_inertia import PulleyWithInertia as PulleyWithInertia
    from atwood_library.scenes.quarter_car import QuarterCar as QuarterCar
    from atwood_library.scenes.rattleback import Rattleback as Rattleback
    from atwood_library.scenes.rigid_bodies import RigidBodies as RigidBodies
    from atwood_library.scenes.rocking_block import RockingBlock as RockingBlock
    from atwood_library.scenes.rolling_ball import RollingBall as RollingBall
    from atwood_library.scenes.rolling_disc import RollingDisc as RollingDisc
    from atwood_library.scenes.rotating_frame import RotatingFrame as RotatingFrame
    from atwood_library.scenes.rotating_hoop_driven import RotatingHoopDriven as RotatingHoopDriven
    from atwood_library.scenes.rotating_hoop_free import RotatingHoopFree as RotatingHoopFree
    from atwood_library.scenes.scott_russell_lift import ScottRussellLift as ScottRussellLift
    from atwood_library.scenes.simple_pendulum import SimplePendulum as SimplePendulum
    from atwood_library.scenes.six_axis_arm import SixAxisArm as SixAxisArm
    from atwood_library.scenes.slider_crank import SliderCrank as SliderCrank
    from atwood_library.scenes.spatial_slider_crank import SpatialSliderCrank as SpatialSliderCrank
    from atwood_library.scenes.spherical_pendulum import SphericalPendulum as SphericalPendulum
    from atwood_library.scenes.stewart_platform import StewartPlatform as StewartPlatform
    from atwood_library.scenes.stick_slip import StickSlip as StickSlip
    from atwood_library.scenes.strandbeest import Strandbeest as Strandbeest
    from atwood_library.scenes.swinging_atwood import SwingingAtwood as SwingingAtwood
    from atwood_library.scenes.trebuchet import Trebuchet as Trebuchet
    from atwood_library.scenes.triple_atwood import TripleAtwood as TripleAtwood
    from atwood_library.scenes.two_body import TwoBody as TwoBody
    from atwood_library.scenes.universal_shaft import UniversalShaft as UniversalShaft
    from atwood_library.scenes.wilberforce_pendulum import WilberforcePendulum as WilberforcePendulum
    from atwood_library.scenes.woodpecker import Woodpecker as Woodpecker

_CLASSES = {
    "simple-pendulum": "SimplePendulum",
    "double-pendulum": "DoublePendulum",
    "pendulum-on-cart": "PendulumOnCart",
    "mass-spring-chain": "MassSpringChain",
    "atwood": "Atwood",
    "double-atwood": "DoubleAtwood",
    "four-bar": "FourBar",
    "slider-crank": "SliderCrank",
    "chain": "Chain",
    "driven-pendulum": "DrivenPendulum",
    "bricard": "Bricard",
    "double-pendulum-3d": "DoublePendulum3D",
    "flyball-governor": "FlyballGovernor",
    "foucault-pendulum": "FoucaultPendulum",
    "four-bar-row": "FourBarRow",
    "free-body": "FreeBody",
    "gyroscope": "Gyroscope",
    "heavy-top": "HeavyTop",
    "intermediate-axis": "IntermediateAxis",
    "lagrange-top": "LagrangeTop",
    "rolling-ball": "RollingBall",
    "rolling-disc": "RollingDisc",
    "spatial-slider-crank": "SpatialSliderCrank",
    "spherical-pendulum": "SphericalPendulum",
    "stewart-platform": "StewartPlatform",
    "universal-shaft": "UniversalShaft",
    "rotating-hoop-driven": "RotatingHoopDriven",
    "rotating-hoop-free": "RotatingHoopFree",
    "charged-particle": "ChargedParticle",
    "two-body": "TwoBody",
    "kepler": "Kepler",
    "n-body": "NBody",
    "bead-on-wire": "BeadOnWire",
    "bead-on-surface": "BeadOnSurface",
    "rotating-frame": "RotatingFrame",
    "falling-with-drag": "FallingWithDrag",
    "free-symmetric-body": "FreeSymmetricBody",
    "rigid-bodies": "RigidBodies",
    "elastic-pendulum": "ElasticPendulum",
    "wilberforce-pendulum": "WilberforcePendulum",
    "oscillators": "Oscillators",
    "triple-atwood": "TripleAtwood",
    "pulley-with-inertia": "PulleyWithInertia",
    "swinging-atwood": "SwingingAtwood",
    "overhead-crane": "OverheadCrane",
    "trebuchet": "Trebuchet",
    "chaplygin-sleigh": "ChaplyginSleigh",
    "rattleback": "Rattleback",
    "ball-in-shell": "BallInShell",
    "benchmark-bicycle": "BenchmarkBicycle",
    "andrews-squeezer": "AndrewsSqueezer",
    "car-axis": "CarAxis",
    "double-cardan-twice": "DoubleCardanTwice",
    "scott-russell-lift": "ScottRussellLift",
    "strandbeest": "Strandbeest",
    "six-axis-arm": "SixAxisArm",
    "cart-pole": "CartPole",
    "quarter-car": "QuarterCar",
    "furuta-pendulum": "FurutaPendulum",
    "bouncing-ball": "BouncingBall",
    "newtons-cradle": "NewtonsCradle",
    "woodpecker": "Woodpecker",
    "rocking-block": "RockingBlock",
    "clutches": "Clutches",
    "stick-slip": "StickSlip",
    "billiards": "Billiards",
}
"""The class of each scene by the name that the command line knows it by."""

_NAMES = {kind: name for name, kind in _CLASSES.items()}


class _Scenes(Mapping[str, type[Scene]]):
    """Scenes by name; each is loaded when it is asked for."""

    def __getitem__(self, name: str) -> type[Scene]:
        kind = _CLASSES[name]
        found: type[Scene] = getattr(importlib.import_module(f"{__name__}.{name.replace('-', '_')}"), kind)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(_CLASSES)

    def __len__(self) -> int:
        return len(_CLASSES)

    def __contains__(self, name: object) -> bool:
        return name in _CLASSES


SCENES: Mapping[str, type[Scene]] = _Scenes()
"""All scenes by the name that the command line knows them by."""

__all__ = ["SCENES", *_NAMES]

if not TYPE_CHECKING:  # so that type checkers know which names there are

    def __getattr__(name):
        if name not in _NAMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found = SCENES[_NAMES[name]]
        globals()[name] = found
        return found

    def __dir__():
        return sorted({*globals(), *__all__})
