"""The component library of Atwood."""

from atwood_library.forces.bushing import Bushing
from atwood_library.forces.central_gravity import CentralGravity
from atwood_library.forces.damper import Damper
from atwood_library.forces.drag import Drag
from atwood_library.forces.force import Force
from atwood_library.forces.spring import Spring
from atwood_library.forces.torque import Torque
from atwood_library.forces.torsion_damper import TorsionDamper
from atwood_library.forces.torsion_spring import TorsionSpring
from atwood_library.joints.constant_velocity import ConstantVelocity
from atwood_library.joints.cylindrical import Cylindrical
from atwood_library.joints.drive import Drive
from atwood_library.joints.free_joint import FreeJoint
from atwood_library.joints.gear import Gear
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.planar import Planar
from atwood_library.joints.planetary_gear import PlanetaryGear
from atwood_library.joints.point_on_circle import PointOnCircle
from atwood_library.joints.point_on_line import PointOnLine
from atwood_library.joints.point_on_plane import PointOnPlane
from atwood_library.joints.rack_and_pinion import RackAndPinion
from atwood_library.joints.rolling_disc import RollingDisc
from atwood_library.joints.rolling_sphere import RollingSphere
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.joints.screw import Screw
from atwood_library.joints.slide_gear import SlideGear
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.joints.universal import Universal
from atwood_library.joints.weld import Weld
from atwood_library.parts.bar import Bar
from atwood_library.parts.box import Box
from atwood_library.parts.cone import Cone
from atwood_library.parts.cylinder import Cylinder
from atwood_library.parts.disc import Disc
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.mass_1d import Mass1D
from atwood_library.parts.mesh_body import MeshBody
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rigid_body import RigidBody
from atwood_library.parts.rim import Rim
from atwood_library.parts.rod import Rod
from atwood_library.parts.sphere import Sphere
from atwood_library.parts.tube import Tube
from atwood_library.parts.wheel import Wheel
from atwood_library.ropes.pulley import Pulley
from atwood_library.ropes.rope import Rope
from atwood_library.sensors.angle_sensor import AngleSensor
from atwood_library.sensors.energy_sensor import EnergySensor
from atwood_library.sensors.force_sensor import ForceSensor
from atwood_library.sensors.frame_sensor import FrameSensor
from atwood_library.sensors.orientation_sensor import OrientationSensor
from atwood_library.sensors.position_sensor import PositionSensor
from atwood_library.sensors.relative_position_sensor import RelativePositionSensor
from atwood_library.sources.ramp import Ramp
from atwood_library.sources.sine import Sine

__all__ = [
    "AngleSensor",
    "Bar",
    "Box",
    "Bushing",
    "CentralGravity",
    "Cone",
    "ConstantVelocity",
    "Cylinder",
    "Cylindrical",
    "Damper",
    "Disc",
    "Drag",
    "Drive",
    "EnergySensor",
    "Force",
    "ForceSensor",
    "FrameSensor",
    "FreeJoint",
    "Gear",
    "Ground",
    "Link",
    "Mass1D",
    "MeshBody",
    "OrientationSensor",
    "Pivot",
    "Planar",
    "PlanetaryGear",
    "PointMass",
    "PointOnCircle",
    "PointOnLine",
    "PointOnPlane",
    "PositionSensor",
    "Pulley",
    "RackAndPinion",
    "Ramp",
    "RelativePositionSensor",
    "RigidBody",
    "Rim",
    "Rod",
    "RollingDisc",
    "RollingSphere",
    "Rope",
    "RotaryDrive",
    "Screw",
    "Sine",
    "SlideGear",
    "Slider",
    "Sphere",
    "Spherical",
    "Spring",
    "Torque",
    "TorsionDamper",
    "TorsionSpring",
    "Tube",
    "Universal",
    "Weld",
    "Wheel",
]
