"""The component library of Atwood. A part is loaded when it is first used.

A new part stands here twice: as an import, for type checkers and editors, and in `_MODULES`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from atwood_library.blocks.add import Add as Add
    from atwood_library.blocks.dead_zone import DeadZone as DeadZone
    from atwood_library.blocks.first_order import FirstOrder as FirstOrder
    from atwood_library.blocks.gain import Gain as Gain
    from atwood_library.blocks.integrator import Integrator as Integrator
    from atwood_library.blocks.limiter import Limiter as Limiter
    from atwood_library.blocks.pi import PI as PI
    from atwood_library.blocks.pid import PID as PID
    from atwood_library.blocks.sample_and_hold import SampleAndHold as SampleAndHold
    from atwood_library.blocks.sample_delay import SampleDelay as SampleDelay
    from atwood_library.blocks.sampled_feedback import SampledFeedback as SampledFeedback
    from atwood_library.blocks.second_order import SecondOrder as SecondOrder
    from atwood_library.blocks.servo_controller import ServoController as ServoController
    from atwood_library.blocks.signal_function import SignalFunction as SignalFunction
    from atwood_library.blocks.state_space import StateSpace as StateSpace
    from atwood_library.blocks.transfer_function import TransferFunction as TransferFunction
    from atwood_library.contacts.ball_contact import BallContact as BallContact
    from atwood_library.contacts.ball_pair_contact import BallPairContact as BallPairContact
    from atwood_library.contacts.box_contact import BoxContact as BoxContact
    from atwood_library.contacts.compliant_contact import CompliantContact as CompliantContact
    from atwood_library.contacts.convex_contacts import ConvexContacts as ConvexContacts
    from atwood_library.contacts.disc_contacts import DiscContacts as DiscContacts
    from atwood_library.contacts.distance_contact import DistanceContact as DistanceContact
    from atwood_library.contacts.ellipsoid_contact import EllipsoidContact as EllipsoidContact
    from atwood_library.contacts.lossy_gear import LossyGear as LossyGear
    from atwood_library.contacts.one_way_clutch import OneWayClutch as OneWayClutch
    from atwood_library.contacts.point_contact import PointContact as PointContact
    from atwood_library.contacts.polygon_contact import PolygonContact as PolygonContact
    from atwood_library.contacts.ratchet import Ratchet as Ratchet
    from atwood_library.contacts.rotational_friction import RotationalFriction as RotationalFriction
    from atwood_library.contacts.rotational_stop import RotationalStop as RotationalStop
    from atwood_library.contacts.surface_contact import SurfaceContact as SurfaceContact
    from atwood_library.contacts.translational_friction import TranslationalFriction as TranslationalFriction
    from atwood_library.contacts.translational_stop import TranslationalStop as TranslationalStop
    from atwood_library.contacts.vertex_contact import VertexContact as VertexContact
    from atwood_library.drives.inertia import Inertia as Inertia
    from atwood_library.drives.rotational_coupling import RotationalCoupling as RotationalCoupling
    from atwood_library.drives.rotational_gap import RotationalGap as RotationalGap
    from atwood_library.drives.rotational_maxwell import RotationalMaxwell as RotationalMaxwell
    from atwood_library.drives.rotational_motion import RotationalMotion as RotationalMotion
    from atwood_library.drives.rotational_resistance import RotationalResistance as RotationalResistance
    from atwood_library.drives.rotational_sensor import RotationalSensor as RotationalSensor
    from atwood_library.drives.rotational_source import RotationalSource as RotationalSource
    from atwood_library.drives.rotational_spring_damper import RotationalSpringDamper as RotationalSpringDamper
    from atwood_library.drives.rotor import Rotor as Rotor
    from atwood_library.drives.translational_coupling import TranslationalCoupling as TranslationalCoupling
    from atwood_library.drives.translational_gap import TranslationalGap as TranslationalGap
    from atwood_library.drives.translational_maxwell import TranslationalMaxwell as TranslationalMaxwell
    from atwood_library.drives.translational_motion import TranslationalMotion as TranslationalMotion
    from atwood_library.drives.translational_resistance import TranslationalResistance as TranslationalResistance
    from atwood_library.drives.translational_sensor import TranslationalSensor as TranslationalSensor
    from atwood_library.drives.translational_source import TranslationalSource as TranslationalSource
    from atwood_library.drives.translational_spring_damper import TranslationalSpringDamper as TranslationalSpringDamper
    from atwood_library.fields.charge import Charge as Charge
    from atwood_library.fields.coordinate_lagrangian import CoordinateLagrangian as CoordinateLagrangian
    from atwood_library.fields.lorentz_force import LorentzForce as LorentzForce
    from atwood_library.fields.mutual_potential import MutualPotential as MutualPotential
    from atwood_library.fields.pair_potential import PairPotential as PairPotential
    from atwood_library.fields.potential import Potential as Potential
    from atwood_library.forces.bushing import Bushing as Bushing
    from atwood_library.forces.central_gravity import CentralGravity as CentralGravity
    from atwood_library.forces.damper import Damper as Damper
    from atwood_library.forces.drag import Drag as Drag
    from atwood_library.forces.force import Force as Force
    from atwood_library.forces.spring import Spring as Spring
    from atwood_library.forces.torque import Torque as Torque
    from atwood_library.forces.torsion_damper import TorsionDamper as TorsionDamper
    from atwood_library.forces.torsion_spring import TorsionSpring as TorsionSpring
    from atwood_library.interfaces.reparametrized import reparametrized as reparametrized
    from atwood_library.joints.blade import Blade as Blade
    from atwood_library.joints.constant_velocity import ConstantVelocity as ConstantVelocity
    from atwood_library.joints.cylindrical import Cylindrical as Cylindrical
    from atwood_library.joints.drive import Drive as Drive
    from atwood_library.joints.frame_on_curve import FrameOnCurve as FrameOnCurve
    from atwood_library.joints.free_joint import FreeJoint as FreeJoint
    from atwood_library.joints.gear import Gear as Gear
    from atwood_library.joints.pivot import Pivot as Pivot
    from atwood_library.joints.planar import Planar as Planar
    from atwood_library.joints.planetary_gear import PlanetaryGear as PlanetaryGear
    from atwood_library.joints.point_on_circle import PointOnCircle as PointOnCircle
    from atwood_library.joints.point_on_curve import PointOnCurve as PointOnCurve
    from atwood_library.joints.point_on_level_surface import PointOnLevelSurface as PointOnLevelSurface
    from atwood_library.joints.point_on_line import PointOnLine as PointOnLine
    from atwood_library.joints.point_on_plane import PointOnPlane as PointOnPlane
    from atwood_library.joints.point_on_surface import PointOnSurface as PointOnSurface
    from atwood_library.joints.rack_and_pinion import RackAndPinion as RackAndPinion
    from atwood_library.joints.rolling_disc import RollingDisc as RollingDisc
    from atwood_library.joints.rolling_ellipsoid import RollingEllipsoid as RollingEllipsoid
    from atwood_library.joints.rolling_on_round import RollingOnRound as RollingOnRound
    from atwood_library.joints.rolling_sphere import RollingSphere as RollingSphere
    from atwood_library.joints.rotary_drive import RotaryDrive as RotaryDrive
    from atwood_library.joints.screw import Screw as Screw
    from atwood_library.joints.slide_gear import SlideGear as SlideGear
    from atwood_library.joints.slider import Slider as Slider
    from atwood_library.joints.spherical import Spherical as Spherical
    from atwood_library.joints.universal import Universal as Universal
    from atwood_library.joints.weld import Weld as Weld
    from atwood_library.parts.appearance import Appearance as Appearance
    from atwood_library.parts.bar import Bar as Bar
    from atwood_library.parts.box import Box as Box
    from atwood_library.parts.cone import Cone as Cone
    from atwood_library.parts.cylinder import Cylinder as Cylinder
    from atwood_library.parts.disc import Disc as Disc
    from atwood_library.parts.ground import Ground as Ground
    from atwood_library.parts.link import Link as Link
    from atwood_library.parts.mass_1d import Mass1D as Mass1D
    from atwood_library.parts.mesh_body import MeshBody as MeshBody
    from atwood_library.parts.point_mass import PointMass as PointMass
    from atwood_library.parts.rigid_body import RigidBody as RigidBody
    from atwood_library.parts.rim import Rim as Rim
    from atwood_library.parts.rod import Rod as Rod
    from atwood_library.parts.sphere import Sphere as Sphere
    from atwood_library.parts.tube import Tube as Tube
    from atwood_library.parts.wheel import Wheel as Wheel
    from atwood_library.ropes.elastic_rope import ElasticRope as ElasticRope
    from atwood_library.ropes.linked_rope import LinkedRope as LinkedRope
    from atwood_library.ropes.pulley import Pulley as Pulley
    from atwood_library.ropes.rope import Rope as Rope
    from atwood_library.ropes.rough_pulley import RoughPulley as RoughPulley
    from atwood_library.ropes.wound_rope import WoundRope as WoundRope
    from atwood_library.sensors.angle_sensor import AngleSensor as AngleSensor
    from atwood_library.sensors.energy_sensor import EnergySensor as EnergySensor
    from atwood_library.sensors.force_sensor import ForceSensor as ForceSensor
    from atwood_library.sensors.frame_sensor import FrameSensor as FrameSensor
    from atwood_library.sensors.orientation_sensor import OrientationSensor as OrientationSensor
    from atwood_library.sensors.position_sensor import PositionSensor as PositionSensor
    from atwood_library.sensors.relative_position_sensor import RelativePositionSensor as RelativePositionSensor
    from atwood_library.sensors.totals_sensor import TotalsSensor as TotalsSensor
    from atwood_library.sources.minimum_jerk import MinimumJerk as MinimumJerk
    from atwood_library.sources.noise import Noise as Noise
    from atwood_library.sources.point_to_point import PointToPoint as PointToPoint
    from atwood_library.sources.pulse import Pulse as Pulse
    from atwood_library.sources.quintic import Quintic as Quintic
    from atwood_library.sources.ramp import Ramp as Ramp
    from atwood_library.sources.sine import Sine as Sine
    from atwood_library.sources.step import Step as Step
    from atwood_library.sources.table import Table as Table
    from atwood_library.sources.time_function import TimeFunction as TimeFunction

_MODULES = {
    "Add": "blocks.add",
    "AngleSensor": "sensors.angle_sensor",
    "Appearance": "parts.appearance",
    "BallContact": "contacts.ball_contact",
    "BallPairContact": "contacts.ball_pair_contact",
    "Bar": "parts.bar",
    "Blade": "joints.blade",
    "Box": "parts.box",
    "BoxContact": "contacts.box_contact",
    "Bushing": "forces.bushing",
    "CentralGravity": "forces.central_gravity",
    "Charge": "fields.charge",
    "CompliantContact": "contacts.compliant_contact",
    "Cone": "parts.cone",
    "ConstantVelocity": "joints.constant_velocity",
    "CoordinateLagrangian": "fields.coordinate_lagrangian",
    "Cylinder": "parts.cylinder",
    "Cylindrical": "joints.cylindrical",
    "Damper": "forces.damper",
    "DeadZone": "blocks.dead_zone",
    "Disc": "parts.disc",
    "ConvexContacts": "contacts.convex_contacts",
    "DiscContacts": "contacts.disc_contacts",
    "DistanceContact": "contacts.distance_contact",
    "Drag": "forces.drag",
    "Drive": "joints.drive",
    "ElasticRope": "ropes.elastic_rope",
    "EllipsoidContact": "contacts.ellipsoid_contact",
    "EnergySensor": "sensors.energy_sensor",
    "FirstOrder": "blocks.first_order",
    "Force": "forces.force",
    "ForceSensor": "sensors.force_sensor",
    "FrameOnCurve": "joints.frame_on_curve",
    "FrameSensor": "sensors.frame_sensor",
    "FreeJoint": "joints.free_joint",
    "Gain": "blocks.gain",
    "Gear": "joints.gear",
    "Ground": "parts.ground",
    "Inertia": "drives.inertia",
    "Integrator": "blocks.integrator",
    "Limiter": "blocks.limiter",
    "Link": "parts.link",
    "LinkedRope": "ropes.linked_rope",
    "LorentzForce": "fields.lorentz_force",
    "LossyGear": "contacts.lossy_gear",
    "Mass1D": "parts.mass_1d",
    "MeshBody": "parts.mesh_body",
    "MinimumJerk": "sources.minimum_jerk",
    "MutualPotential": "fields.mutual_potential",
    "Noise": "sources.noise",
    "OneWayClutch": "contacts.one_way_clutch",
    "OrientationSensor": "sensors.orientation_sensor",
    "PI": "blocks.pi",
    "PID": "blocks.pid",
    "PairPotential": "fields.pair_potential",
    "Pivot": "joints.pivot",
    "Planar": "joints.planar",
    "PlanetaryGear": "joints.planetary_gear",
    "PointContact": "contacts.point_contact",
    "PointMass": "parts.point_mass",
    "PointOnCircle": "joints.point_on_circle",
    "PointOnCurve": "joints.point_on_curve",
    "PointOnLevelSurface": "joints.point_on_level_surface",
    "PointOnLine": "joints.point_on_line",
    "PointOnPlane": "joints.point_on_plane",
    "PointOnSurface": "joints.point_on_surface",
    "PointToPoint": "sources.point_to_point",
    "PolygonContact": "contacts.polygon_contact",
    "PositionSensor": "sensors.position_sensor",
    "Potential": "fields.potential",
    "Pulley": "ropes.pulley",
    "Pulse": "sources.pulse",
    "Quintic": "sources.quintic",
    "RackAndPinion": "joints.rack_and_pinion",
    "Ramp": "sources.ramp",
    "Ratchet": "contacts.ratchet",
    "RelativePositionSensor": "sensors.relative_position_sensor",
    "RigidBody": "parts.rigid_body",
    "Rim": "parts.rim",
    "Rod": "parts.rod",
    "RollingDisc": "joints.rolling_disc",
    "RollingEllipsoid": "joints.rolling_ellipsoid",
    "RollingOnRound": "joints.rolling_on_round",
    "RollingSphere": "joints.rolling_sphere",
    "Rope": "ropes.rope",
    "RotaryDrive": "joints.rotary_drive",
    "RotationalCoupling": "drives.rotational_coupling",
    "RotationalFriction": "contacts.rotational_friction",
    "RotationalGap": "drives.rotational_gap",
    "RotationalMaxwell": "drives.rotational_maxwell",
    "RotationalMotion": "drives.rotational_motion",
    "RotationalResistance": "drives.rotational_resistance",
    "RotationalSensor": "drives.rotational_sensor",
    "RotationalSource": "drives.rotational_source",
    "RotationalSpringDamper": "drives.rotational_spring_damper",
    "RotationalStop": "contacts.rotational_stop",
    "Rotor": "drives.rotor",
    "RoughPulley": "ropes.rough_pulley",
    "SampleAndHold": "blocks.sample_and_hold",
    "SampleDelay": "blocks.sample_delay",
    "SampledFeedback": "blocks.sampled_feedback",
    "Screw": "joints.screw",
    "SecondOrder": "blocks.second_order",
    "ServoController": "blocks.servo_controller",
    "SignalFunction": "blocks.signal_function",
    "Sine": "sources.sine",
    "SlideGear": "joints.slide_gear",
    "Slider": "joints.slider",
    "Sphere": "parts.sphere",
    "Spherical": "joints.spherical",
    "Spring": "forces.spring",
    "StateSpace": "blocks.state_space",
    "Step": "sources.step",
    "SurfaceContact": "contacts.surface_contact",
    "Table": "sources.table",
    "TimeFunction": "sources.time_function",
    "Torque": "forces.torque",
    "TorsionDamper": "forces.torsion_damper",
    "TorsionSpring": "forces.torsion_spring",
    "TotalsSensor": "sensors.totals_sensor",
    "TransferFunction": "blocks.transfer_function",
    "TranslationalCoupling": "drives.translational_coupling",
    "TranslationalFriction": "contacts.translational_friction",
    "TranslationalGap": "drives.translational_gap",
    "TranslationalMaxwell": "drives.translational_maxwell",
    "TranslationalMotion": "drives.translational_motion",
    "TranslationalResistance": "drives.translational_resistance",
    "TranslationalSensor": "drives.translational_sensor",
    "TranslationalSource": "drives.translational_source",
    "TranslationalSpringDamper": "drives.translational_spring_damper",
    "TranslationalStop": "contacts.translational_stop",
    "Tube": "parts.tube",
    "Universal": "joints.universal",
    "VertexContact": "contacts.vertex_contact",
    "Weld": "joints.weld",
    "Wheel": "parts.wheel",
    "WoundRope": "ropes.wound_rope",
    "reparametrized": "interfaces.reparametrized",
}
"""The module of each part, below this package."""

__all__ = [*_MODULES]

if not TYPE_CHECKING:  # so that type checkers know which names there are

    def __getattr__(name):
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found = getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
        globals()[name] = found
        return found

    def __dir__():
        return sorted({*globals(), *__all__})
