"""Robots' files beside Pinocchio and MuJoCo; `.ci/peers` installs them."""

import re
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from atwood import Dynamics, Scene, dynamics
from atwood_library.robots import nearest_inertia, read_mjcf, read_urdf, write_mjcf, write_urdf

pytestmark = pytest.mark.filterwarnings("ignore")


def folder_of(package: str, module: str, inner: str) -> Path:
    """Return a folder of a package; without it the tests are skipped."""
    pytest.importorskip(module, reason=f"{module} is not installed")
    try:
        return Path(str(metadata.distribution(package).locate_file(inner)))
    except metadata.PackageNotFoundError:
        pytest.skip(f"{package} is not installed", allow_module_level=True)


def robots() -> list[Path]:
    """Return the URDF files of example-robot-data; ur3.urdf is a macro without links."""
    found = sorted(folder_of("example-robot-data", "pinocchio", "cmeel.prefix/share").rglob("*.urdf"))
    return [one for one in found if one.name != "ur3.urdf"]


def corrected(file: Path) -> str:
    """Return a URDF with inertias that bodies can have, by the same rule, and masses where there are inertias."""
    root = ElementTree.parse(file).getroot()
    for inertial in root.iter("inertial"):
        mass, tensor = inertial.find("mass"), inertial.find("inertia")
        assert mass is not None
        if tensor is None:
            continue
        xx, xy, xz, yy, yz, zz = (float(tensor.get(f"i{one}", 0.0)) for one in ("xx", "xy", "xz", "yy", "yz", "zz"))
        given = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = np.linalg.eigvalsh(given)
        if moments[0] < 0.0 or moments[2] > moments[0] + moments[1]:
            near = nearest_inertia(given) if float(mass.get("value", 0.0)) > 0.0 else np.zeros((3, 3))
        elif float(mass.get("value", 0.0)) == 0.0:
            near = np.zeros((3, 3))
        else:
            continue
        for i, k in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            tensor.set(f"i{'xyz'[i]}{'xyz'[k]}", repr(float(near[i, k])))
    return ElementTree.tostring(root, encoding="unicode")


class Beside:
    """A scene and Pinocchio's model of the same file.

    Joints that mimic others are tied: the speeds of Pinocchio are ``ties`` times those that are free, and its
    coordinates the same times the free ones, plus ``offsets``.
    """

    def __init__(self, file: Path, base: str = "fixed") -> None:
        import pinocchio

        self.pin, text = pinocchio, corrected(file)
        self.free = 6 if base == "free" else 0
        self.model = pinocchio.buildModelFromXML(text, *([pinocchio.JointModelFreeFlyer()] if self.free else []))
        self.data = self.model.createData()
        self.scene = read_urdf(file, inertias="nearest", friction=False, base=base)
        self.dynamics: Dynamics = dynamics(self.scene)
        plain = {re.sub(r"\W", "_", name): j for name, j in zip(self.model.names, self.model.joints, strict=True)}
        names = [one.rpartition(".")[0] for one in self.dynamics.coordinates[7 if self.free else 0 :]]
        joints = [plain.get(name) or plain[name.rstrip("_")] for name in names]
        self.rows = [*range(self.free), *(joint.idx_v for joint in joints)]
        self.find_ties(ElementTree.fromstring(text))

    def find_ties(self, robot: Any) -> None:
        self.ties, self.offsets = np.eye(self.model.nv), np.zeros(self.model.nv)
        given = {joint.get("name"): joint.find("mimic") for joint in robot.findall("joint")}
        follows = {name: one for name, one in given.items() if one is not None and one.get("joint") in given}
        for _ in follows:  # once more for each link of a chain
            for name, mimic in follows.items():
                i, master = self.row(name), self.row(mimic.get("joint"))
                ratio, offset = float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))
                self.ties[i] = 0.0 if master is None else ratio * self.ties[master]
                self.offsets[i] = offset + (0.0 if master is None else ratio * self.offsets[master])
        free = [i for i in range(self.model.nv) if i not in [self.row(name) for name in follows]]
        self.ties = self.ties[:, free]

    def row(self, name: str) -> int | None:
        """Return where the speed of a joint is; None if it is fixed."""
        return self.model.joints[self.model.getJointId(name)].idx_v if self.model.existJointName(name) else None

    def state(self, generator: np.random.Generator) -> tuple[Any, Any, Any]:
        """Return coordinates of Pinocchio and here, and the matrix and the rest of ``u' = S a + rest``.

        The base has the speeds of its origin in its own axes there, and of its centre of mass in world axes here.
        """
        values = self.ties @ generator.uniform(-1.0, 1.0, self.ties.shape[1]) + self.offsets
        q = np.zeros(self.model.nq)  # with cosine and sine where a joint turns without end
        for joint in self.model.joints:
            if joint.nv == 1:
                value = values[joint.idx_v]
                q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
        ours, turn = values[self.rows], np.eye(len(self.rows))
        if self.free:
            place, quaternion = generator.normal(size=3), generator.normal(size=4)
            quaternion /= np.linalg.norm(quaternion)
            q[:7] = *place, *quaternion
            body: Any = self.scene[self.dynamics.coordinates[0].partition(".")[0]]
            rotation, self.centre = self.pin.Quaternion(quaternion).matrix(), np.array(body.center)
            turn[:3, :3], turn[:3, 3:6] = rotation, -rotation @ self.pin.skew(self.centre)
            ours = np.concatenate([place + rotation @ self.centre, quaternion[[3, 0, 1, 2]], values[self.rows[6:]]])
        return q, ours, turn

    def rest(self, turn: Any, v: Any) -> Any:
        """Return what speeds add to the derivatives of the speeds of the base."""
        rest = np.zeros(len(self.rows))
        if self.free:
            spin = v[3:6]
            rest[:3] = turn[:3, :3] @ np.cross(spin, v[:3] + np.cross(spin, self.centre))
        return rest

    def errors(self, generator: np.random.Generator) -> list[float]:
        """Return relative errors of the mass matrix, of inverse and of forward dynamics at a random state.

        All are along the speeds that are free, as is what moves with them. Accelerations are as right as the condition
        of the mass matrix lets them be: 1e-12 up to a condition of 1e4. Where something turns that has no inertia, as
        in romeo.urdf, there are none.
        """
        pin, model, data, ties = self.pin, self.model, self.data, self.ties
        q, ours, turn = self.state(generator)
        kept = ties[self.rows]
        v, a = (ties @ generator.normal(size=ties.shape[1]) for _ in "va")
        mass = pin.crba(model, data, q).copy()
        mass = ties.T @ (np.triu(mass) + np.triu(mass, 1).T) @ ties
        damped = model.damping * v
        inverse, bias = (ties.T @ (pin.rnea(model, data, q, v, one) + damped) for one in (a, 0.0 * a))
        u, rest, onto = turn @ v[self.rows], self.rest(turn, v), turn @ kept
        acceleration = turn @ a[self.rows] + rest
        pairs = [
            (onto.T @ self.dynamics.mass_matrix(ours) @ onto, mass),
            (onto.T @ self.dynamics.inverse_dynamics(ours, u, acceleration), inverse),
        ]
        condition = np.linalg.cond(mass)
        if condition < 1e13:
            forward = onto @ np.linalg.solve(mass, -bias) + rest
            pairs.append((self.dynamics.forward_dynamics(ours, u), forward))
        found = [float(np.max(np.abs(x - y)) / max(np.max(np.abs(y)), 1e-30)) for x, y in pairs]
        return [*found[:2], *(one / max(1.0, 1e-4 * condition) for one in found[2:])]


@pytest.mark.parametrize("file", robots(), ids=lambda file: file.stem)
@pytest.mark.sample(8)
def test_urdf_beside_pinocchio(file: Path) -> None:
    generator = np.random.default_rng(0)
    beside = Beside(file)
    if beside.rows:
        assert max(max(beside.errors(generator)) for _ in range(20)) < 1e-12


@pytest.mark.parametrize("name", ["solo12", "bolt", "quadrotor_base", "double_pendulum_simple"])
def test_urdf_that_moves_freely_beside_pinocchio(name: str) -> None:
    generator = np.random.default_rng(0)
    beside = Beside(next(one for one in robots() if one.stem == name), "free")
    assert max(max(beside.errors(generator)) for _ in range(20)) < 1e-12


def models() -> list[Path]:
    """Return the models of dm_control's suite and of gymnasium."""
    suite = folder_of("dm-control", "mujoco", "dm_control/suite")
    return [*sorted(suite.glob("*.xml")), *sorted(folder_of("gymnasium", "mujoco", GYMNASIUM).glob("*.xml"))]


GYMNASIUM = "gymnasium/envs/mujoco/assets"


class BesideMujoco:
    """A scene and MuJoCo's model of the same file, without what the scene leaves out.

    Contact, limits, friction, equalities, actuators, tendons and the resistance of fluids are off.
    """

    def __init__(self, file: Path) -> None:
        import mujoco

        self.mujoco = mujoco
        self.model = model = mujoco.MjModel.from_xml_path(str(file))
        flags = mujoco.mjtDisableBit
        model.opt.disableflags |= int(flags.mjDSBL_CONSTRAINT) | int(flags.mjDSBL_ACTUATION)
        model.opt.density = model.opt.viscosity = 0.0
        for name in ("stiffness", "damping", "armature"):
            getattr(model, f"tendon_{name}")[:] = 0.0
        free = [j for j in range(model.njnt) if model.jnt_type[j] == 0]
        for joint in free:  # named by the reader as left out
            start = model.jnt_dofadr[joint]
            model.dof_damping[start : start + 6] = model.dof_armature[start : start + 6] = 0.0
            model.jnt_stiffness[joint] = 0.0
        for joint in range(model.njnt):  # springdamper, left out: its values as they are without
            if file.stem == "dog" and model.joint(joint).name.startswith("Ca_"):
                model.jnt_stiffness[joint], model.dof_damping[model.jnt_dofadr[joint]] = 0.1, 0.01
        self.data = mujoco.MjData(model)
        self.dynamics: Dynamics = dynamics(read_mjcf(file, friction=False))
        self.coordinates = self.places(self.dynamics.coordinates, "qposadr")
        self.speeds = self.places(self.dynamics.speeds, "dofadr")

    def places(self, paths: Any, where: str) -> list[int]:
        """Return where coordinates or speeds are in MuJoCo's."""
        model, found = self.model, []
        starts = getattr(model, f"jnt_{where}")
        plain: dict[str, int] = {}
        bodies: dict[str, int] = {}
        for joint in range(model.njnt):
            body = re.sub(r"\W", "_", model.body(model.jnt_bodyid[joint]).name)
            count, index = (
                model.body_jntnum[model.jnt_bodyid[joint]],
                joint - model.body_jntadr[model.jnt_bodyid[joint]],
            )
            unnamed = f"{body}_joint" if count == 1 else f"{body}_joint_{index + 1}"
            plain[re.sub(r"\W", "_", model.joint(joint).name) or unnamed] = starts[joint]
            if model.jnt_type[joint] == 0:
                bodies[body] = starts[joint] + 3
        for path in paths:
            owner, *inner = path.rstrip("'").split(".")
            letters = "wxyz" if inner[0] == "quaternion" else "xyz"
            known = bodies if len(inner) > 1 else plain
            while owner not in known:
                assert owner.endswith("_"), path
                owner = owner[:-1]
            found.append(known[owner] + (letters.index(inner[-1]) if inner[-1] in letters else 0))
        assert len(set(found)) == len(found)
        return found

    def errors(self, generator: np.random.Generator) -> Any:
        """Return errors and sizes of the mass matrix, of the bias and of accelerations at a random state."""
        mujoco, model, data = self.mujoco, self.model, self.data
        data.qpos[:] = generator.uniform(-1.0, 1.0, model.nq)
        mujoco.mj_normalizeQuat(model, data.qpos)
        data.qvel[:] = generator.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        for row, one in zip(mass, np.eye(model.nv), strict=True):
            mujoco.mj_mulM(model, data, row, one)
        q = (data.qpos - model.qpos0 * self.hinged())[self.coordinates]
        u, rows = data.qvel[self.speeds], self.speeds
        pairs = [
            (self.dynamics.mass_matrix(q), mass[np.ix_(rows, rows)]),
            (self.dynamics.bias(q, u), (data.qfrc_bias - data.qfrc_passive)[rows]),
            (self.dynamics.forward_dynamics(q, u), data.qacc[rows]),
        ]
        return np.array([(np.max(np.abs(x - y)), np.max(np.abs(y))) for x, y in pairs])

    def hinged(self) -> Any:
        """Return 1 for coordinates of hinges and slides, which have a reference, else 0."""
        found = np.zeros(self.model.nq)
        found[[int(self.model.jnt_qposadr[j]) for j in range(self.model.njnt) if self.model.jnt_type[j] > 1]] = 1.0
        return found


@pytest.mark.parametrize("file", models(), ids=lambda file: f"{file.parent.name}-{file.stem}")
@pytest.mark.sample(8)
def test_mjcf_beside_mujoco(file: Path) -> None:
    beside, generator = BesideMujoco(file), np.random.default_rng(0)
    if beside.speeds:
        errors, sizes = np.max([beside.errors(generator) for _ in range(20)], axis=0).T
        bound = np.array([1e-10, 1e-10, 1e-8 if file.stem == "dog" else 1e-10])  # its bones are meshes: M to 7e-12
        assert np.all(errors < bound * sizes)


def differences(first: Scene, second: Scene) -> float:
    """Return by how much mass matrix and inverse dynamics of two scenes with the same coordinates differ."""
    one, other = dynamics(first), dynamics(second)
    generator = np.random.default_rng(1)
    q, (u, a) = generator.normal(size=len(one.coordinates)), generator.normal(size=(2, len(one.speeds)))
    places = [one.coordinates.index(path) for path in other.coordinates]
    rows = [one.speeds.index(path) for path in other.speeds]
    pairs = (
        (one.mass_matrix(q)[np.ix_(rows, rows)], other.mass_matrix(q[places])),
        (one.inverse_dynamics(q, u, a)[rows], other.inverse_dynamics(q[places], u[rows], a[rows])),
    )
    return max(float(np.max(np.abs(x - y)) / np.max(np.abs(x))) for x, y in pairs)


@pytest.mark.parametrize("file", [*robots(), *models()], ids=lambda file: f"{file.parent.name}-{file.stem}")
@pytest.mark.sample(6)
def test_written_and_read_again(file: Path, tmp_path: Path) -> None:
    if file.suffix == ".urdf":
        first = read_urdf(file, inertias="nearest", friction=False)
        second = read_urdf(write_urdf(first, tmp_path / "again.urdf"))
    else:
        first = read_mjcf(file, friction=False)
        second = read_mjcf(write_mjcf(first, tmp_path / "again.xml"))
    if dynamics(first).speeds:
        assert differences(first, second) < 1e-12
