"""Who knows the Modelica Standard Library finds each part by its name there: all its mechanical parts and blocks."""

import pytest

from atwood.cli.parts import parts_called

MECHANICS = "Modelica.Mechanics."
# What each class of Modelica is here: one part, or several of which it is made, or one for each of its uses.
TABLE = {
    "MultiBody": "World Ground",
    "MultiBody.Joints": """
        Prismatic Slider; Revolute Pivot; RevolutePlanarLoopConstraint Pivot; Cylindrical Cylindrical;
        Universal Universal; Planar Planar; Spherical Spherical; FreeMotion FreeJoint; FreeMotionScalarInit
        FreeJoint; SphericalSpherical Rod; UniversalSpherical Spherical Universal; GearConstraint Gear;
        RollingWheel RollingDisc Wheel; RollingWheelSet RollingDisc""",
    "MultiBody.Joints.Constraints": "Prismatic Slider; Revolute Pivot; Spherical Spherical; Universal Universal",
    "MultiBody.Joints.Assemblies": """
        JointUPS Slider Spherical Universal; JointUSR Pivot Spherical Universal; JointUSP Slider Spherical
        Universal; JointSSR Pivot Spherical; JointSSP Slider Spherical; JointRRR Pivot; JointRRP Pivot
        Slider""",
    "MultiBody.Parts": """
        Fixed Ground; FixedTranslation Weld; FixedRotation Weld; Body RigidBody; BodyShape Link; BodyBox
        Box; BodyCylinder Cylinder; PointMass PointMass; Mounting1D Rotor; Rotor1D Rotor; BevelGear1D Gear;
        RollingWheel RollingDisc Wheel; RollingWheelSet Wheel""",
    "MultiBody.Forces": """
        WorldForceAndTorque Force Torque; WorldForce Force; WorldTorque Torque; ForceAndTorque Force Torque;
        Force Force; Torque Torque; LineForceWithMass Spring; LineForceWithTwoMasses Spring; Spring Spring;
        Damper Damper; SpringDamperParallel Damper Spring; SpringDamperSeries Damper Spring""",
    "MultiBody.Sensors": """
        AbsoluteSensor PositionSensor; RelativeSensor FrameSensor; AbsolutePosition PositionSensor;
        AbsoluteVelocity PositionSensor; AbsoluteAngles OrientationSensor; AbsoluteAngularVelocity
        FrameSensor OrientationSensor; RelativePosition RelativePositionSensor; RelativeVelocity
        RelativePositionSensor; RelativeAngles AngleSensor OrientationSensor; RelativeAngularVelocity
        FrameSensor OrientationSensor; Distance RelativePositionSensor; CutForceAndTorque ForceSensor;
        CutForce ForceSensor; CutTorque ForceSensor; Power ForceSensor; TransformAbsoluteVector
        PositionSensor; TransformRelativeVector RelativePositionSensor""",
    "Rotational.Components": """
        Fixed RotationalMotion; Inertia Inertia; Disc RotationalCoupling; Spring RotationalSpringDamper;
        Damper RotationalSpringDamper; SpringDamper RotationalSpringDamper; ElastoBacklash RotationalGap;
        ElastoBacklash2 RotationalGap; BearingFriction RotationalFriction; Brake RotationalFriction;
        IdealGear Gear; LossyGear LossyGear; Clutch
        RotationalFriction; OneWayClutch OneWayClutch; IdealPlanetary PlanetaryGear; Gearbox Gear; IdealGearR2T
        RackAndPinion; IdealRollingWheel RackAndPinion; RelativeStates RotationalSensor;
        AngleToTorqueAdaptor RotationalMotion; TorqueToAngleAdaptor RotationalSource""",
    "Rotational.Sensors": """
        AngleSensor RotationalSensor; SpeedSensor RotationalSensor; AccSensor RotationalSensor;
        RelAngleSensor RotationalSensor; RelSpeedSensor RotationalSensor; RelAccSensor RotationalSensor;
        TorqueSensor RotationalCoupling; PowerSensor RotationalCoupling; MultiSensor RotationalSensor""",
    "Rotational.Sources": """
        Position RotationalMotion; Speed RotationalMotion; Accelerate RotationalMotion; Move
        RotationalMotion; Torque RotationalSource; Torque2 RotationalSource; LinearSpeedDependentTorque
        RotationalResistance; QuadraticSpeedDependentTorque RotationalResistance; ConstantTorque
        RotationalSource; SignTorque RotationalResistance; ConstantSpeed RotationalMotion; TorqueStep
        RotationalSource; EddyCurrentTorque RotationalResistance; InverseSpeedDependentTorque
        RotationalResistance""",
    "Translational.Components": """
        Fixed TranslationalMotion; Mass Mass1D; Rod TranslationalCoupling; Spring TranslationalSpringDamper;
        Damper TranslationalSpringDamper; SpringDamper TranslationalSpringDamper; ElastoGap
        TranslationalGap; SupportFriction TranslationalFriction; Brake TranslationalFriction;
        IdealGearR2T RackAndPinion; IdealRollingWheel RackAndPinion; MassWithStopAndFriction
        TranslationalStop; RelativeStates TranslationalSensor""",
    "Translational.Sensors": """
        PositionSensor TranslationalSensor; SpeedSensor TranslationalSensor; AccSensor TranslationalSensor;
        RelPositionSensor TranslationalSensor; RelSpeedSensor TranslationalSensor; RelAccSensor
        TranslationalSensor; ForceSensor TranslationalCoupling; PowerSensor TranslationalCoupling;
        MultiSensor TranslationalSensor""",
    "Translational.Sources": """
        Position TranslationalMotion; Speed TranslationalMotion; Accelerate TranslationalMotion; Move
        TranslationalMotion; Force TranslationalSource; Force2 TranslationalSource;
        LinearSpeedDependentForce TranslationalResistance; QuadraticSpeedDependentForce
        TranslationalResistance; ConstantForce TranslationalSource; SignForce TranslationalResistance;
        ConstantSpeed TranslationalMotion; ForceStep TranslationalSource; EddyCurrentForce
        TranslationalResistance; InverseSpeedDependentForce TranslationalResistance; RollingResistance
        TranslationalResistance""",
    "Blocks.Continuous": """
        Integrator Integrator; LimIntegrator Integrator; Derivative TransferFunction; FirstOrder FirstOrder;
        SecondOrder SecondOrder; PI PI; PID PID; LimPID PID; TransferFunction TransferFunction; StateSpace
        StateSpace; LowpassButterworth TransferFunction; CriticalDamping TransferFunction; Filter
        TransferFunction""",
    "Blocks.Discrete": """
        Sampler SampleAndHold; ZeroOrderHold SampleAndHold; UnitDelay SampleDelay; StateSpace
        SampledFeedback; TriggeredSampler SampleAndHold""",
    "Blocks.Nonlinear": "Limiter Limiter; VariableLimiter Limiter; DeadZone DeadZone; PadeDelay TransferFunction",
    "Blocks.Math": """
        Gain Gain; Sum Add; Feedback Add; Add Add; Add3 Add; MultiSum Add; Product SignalFunction; Division
        SignalFunction; Abs SignalFunction; Sign SignalFunction; Sqrt SignalFunction; Sin SignalFunction;
        Cos SignalFunction; Tan SignalFunction; Asin SignalFunction; Acos SignalFunction; Atan
        SignalFunction; Atan2 SignalFunction; Exp SignalFunction; Log SignalFunction; Max SignalFunction;
        Min SignalFunction""",
    "Blocks.Sources": """
        RealExpression TimeFunction; Clock Ramp; ContinuousClock Ramp; Constant TimeFunction; Step Step;
        Ramp Ramp; Sine Sine; Cosine Sine; SineVariableFrequencyAndAmplitude TimeFunction; Sinc
        TimeFunction; ExpSine TimeFunction; Exponentials TimeFunction; Pulse Pulse; SawTooth TimeFunction;
        Trapezoid TimeFunction; LogFrequencySweep TimeFunction; KinematicPTP PointToPoint; KinematicPTP2
        PointToPoint; TimeTable Table; CombiTimeTable Table""",
}
ROWS = [
    (package, *entry.split(maxsplit=1)) for package, rows in TABLE.items() for entry in rows.split(";")
]  # fmt: skip


@pytest.mark.sample(4)
@pytest.mark.parametrize("package", TABLE)
def test_parts_are_found_by_the_full_names_of_modelica(package: str) -> None:
    for _, name, parts in (row for row in ROWS if row[0] == package):
        root = "Modelica." if package.startswith("Blocks") else MECHANICS
        assert set(parts_called(f"{root}{package}.{name}")) == set(parts.split()), name


def test_parts_are_found_by_the_last_word_alone() -> None:
    lost = {}
    for _, name, parts in ROWS:
        found = set(parts_called(name))
        if not set(parts.split()) <= found and name not in found:  # unless a part has that very name
            lost[name] = found
    assert not lost


def test_what_is_no_part_is_not_found() -> None:
    for name in ("Modelica.Mechanics.MultiBody.Joints.Hovercraft", "Rotational", "Components"):
        assert not parts_called(name), name


@pytest.mark.parametrize(
    ("word", "part"),
    [
        *(("friction", "RotationalFriction"), ("friction", "TranslationalFriction"), ("contact", "PointContact")),
        *(("clutch", "RotationalFriction"), ("brake", "RotationalFriction"), ("backlash", "RotationalStop")),
        *(("stop", "TranslationalStop"), ("impact", "PointContact"), ("freewheel", "OneWayClutch")),
        *(("capstan", "RoughPulley"), ("pawl", "Ratchet"), ("worm gear", "LossyGear")),
    ],
)
def test_one_sided_parts_are_found_by_what_people_call_them(word: str, part: str) -> None:
    assert part in parts_called(word)
