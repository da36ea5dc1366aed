"""What load() returns."""
from __future__ import annotations


from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import _core
from ..coordinates import Coordinates
from ..given import point
from ..namespace import NUMPY
from ..objects import no_such_name
from ..vectors import read_only
from .poses import mul, pose, q_of_vector, q_turn
from .start import start_of

if TYPE_CHECKING:
    from .._core import Body, BodyShape, Gear, Joint, World


class Note(NamedTuple):
    """Something that was not carried over, or not exactly."""

    element: str  # as "tendon 'left'"
    reason: str

    def __str__(self) -> str:
        return f"{self.element}: {self.reason}"


LONGEST_NAME = 63  # bytes, of a body


def world_name(name):
    """A name as objects of a world can have it: of a longer one the end."""
    return name.encode()[-LONGEST_NAME:].decode(errors="ignore")


class Report(list[Note]):
    """A list of Note; printed one a line."""

    def add(self, element: str, reason: str) -> None:
        self.append(Note(element, reason))

    def __str__(self) -> str:
        return "\n".join(str(note) for note in self)


def name_of(source, kind, index):
    """The name of the index-th element of a kind ('body', 'joint', 'geom' ...); of one without a name '#index'."""
    return getattr(source, kind)(index).name or f"#{index}"


def element(source, kind, index):
    """As reports name it."""
    name = getattr(source, kind)(index).name
    return f"{kind} '{name}'" if name else f"{kind} #{index}"


def _row(name, values, count):
    """Finite numbers, 1 x count."""
    return point(name, values, count)[None]


def start_numbers(loaded, keyframe):
    """q, qd and ctrl of a keyframe; ctrl: of the actuators that there are."""
    source = loaded.source
    data = start_of(source, keyframe, None, None)
    count = getattr(source, "nactuator", source.nu)
    at = source.actuator_ctrladr if hasattr(source, "actuator_ctrladr") else range(count)
    places = {name_of(source, "actuator", k): int(at[k]) for k in range(count)}
    return data.qpos.copy(), data.qvel.copy(), [data.ctrl[places[name]] for name in loaded.actuators]


class LoadedJoint:
    """A joint of the file, and where it is here.

    Coordinate `coordinate` of `joint` (None: a free body's) is sign x (the file's position - offset). Joints of one
    body may share a joint of the world.
    """

    def __init__(self, name, type, body, frame, joint=None, coordinate=None, sign=1.0, offset=0.0, turn=None):
        self.name = name
        self.type = type  #: 'free', 'ball', 'hinge' or 'slide'
        self.body = body  #: the Body that it moves
        self.joint = joint  #: the Joint of the world
        self.coordinate = coordinate  #: its free coordinate, of a ball the first of three
        self.sign = sign
        self.offset = offset
        self._frame = frame  # of free joints: the file's frame of the body in the Body's
        self._turn = turn  # of balls: the joint's frame to the file's

    def __repr__(self):
        return f"<subadmm joint '{self.name}', {self.type}>"

    def to_coordinate(self, position: float) -> float:
        """The world's coordinate at a position of the file (hinge: rad, slide: m)."""
        return self.sign * (position - self.offset)

    @property
    def position(self) -> Any:
        """As MuJoCo's qpos has it: a number (m, rad); ball: w x y z; free: position and w x y z of the body's frame."""
        if self.type == "free":
            return np.concatenate(mul(pose(self.body.position, self.body.orientation), self._frame))
        if self.type == "ball":
            return q_of_vector(q_turn(self._turn, self.joint.position[3:6]))
        return self.sign * self.joint.position[self.coordinate] + self.offset

    @property
    def speed(self) -> float:
        """Of hinges and slides, rad/s or m/s."""
        if self.type in ("free", "ball"):
            raise ValueError(f"joint '{self.name}': a {self.type} joint has no one speed; see its body's velocities")
        return self.sign * self.joint.speed[self.coordinate]


class LoadedActuator:
    """An actuator of the file. Set `control`; what it does to its joint holds until it is set again.

    Its force is gain control - stiffness length - damping rate + constant, in force_range; it acts on each of `parts`,
    pairs of a LoadedJoint and a factor (the gear), with factor times the force. Actuators on one joint add up.
    """

    def __init__(self, name, kind, parts, gain, stiffness, damping, constant, control_range, force_range, drives):
        self.name = name
        self.kind = kind  #: 'motor', 'position' or 'velocity'
        self.parts = parts
        self.gain, self.stiffness, self.damping, self.constant = gain, stiffness, damping, constant
        self.control_range = control_range  #: (lower, upper)
        self.force_range = force_range
        self._control = 0.0
        self._drives = drives

    def __repr__(self):
        return f"<subadmm actuator '{self.name}', {self.kind}>"

    @property
    def control(self) -> float:
        """As MuJoCo's ctrl: a motor's force over its gain, a servo's target (m, rad or per s). In control_range."""
        return self._control

    @control.setter
    def control(self, value: float) -> None:
        value = float(value)
        if not np.isfinite(value):
            raise ValueError(f"control of actuator '{self.name}': {value} is not finite")
        self._control = min(max(value, self.control_range[0]), self.control_range[1])
        for joint, _ in self.parts:
            self._drives[joint].update()

    @property
    def input(self) -> float:
        """The part of its force that does not depend on its joint, N or N m; a motor's is clipped to force_range."""
        force = self.gain * self._control + self.constant
        if self.stiffness == 0 and self.damping == 0:
            force = min(max(force, self.force_range[0]), self.force_range[1])
        return force


class Loaded:
    """A file in a world.

    `world`; `bodies`, `joints` ... by the file's names; `shapes`: lists of BodyShape by what they were made of;
    `report`: what was not carried over; `source`: the file as the package that read it has it.
    """

    def __init__(self, world: World, source: Any, report: Report) -> None:
        self.world: World = world
        self.source: Any = source
        self.report: Report = report
        self.bodies: dict[str, Body] = {}
        self.joints: dict[str, Any] = {}
        self.actuators: dict[str, LoadedActuator] = {}
        self.gears: dict[str, Gear] = {}
        self.loops: dict[str, Joint] = {}  # joints that the file's equality constraints became, by their names
        self.shapes: dict[Any, list[BodyShape]] = {}  # by geom index, or path of a prim

    def __getitem__(self, name: str) -> Any:
        """The body, joint or actuator of this name. KeyError: there is none; ValueError: several kinds have it."""
        kinds = ("bodies", "joints", "actuators")
        found = [kind for kind in kinds if name in getattr(self, kind)]
        if not found:
            raise no_such_name("body, joint or actuator", name, [n for kind in kinds for n in getattr(self, kind)])
        if len(found) > 1:
            raise ValueError(f"name = {name!r}: it is in {' and in '.join(found)}: take it from there")
        return getattr(self, found[0])[name]

    def render(self, width: int = 640, height: int = 480, camera: Any = None) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """A picture of it as it is now, by the file's visuals and colours: height x width x 3, uint8, sRGB. As
        World.render; camera: also the name of a camera of an MJCF file."""
        draw: Any = _core.World.render  # draws either
        return draw(self, width, height, camera)

    def __repr__(self):
        return (
            f"<subadmm model: {len(self.bodies)} bodies, {len(self.joints)} joints, {len(self.actuators)} actuators, "
            f"{len(self.report)} notes>"
        )


class LoadedModel(Loaded):
    """An MJCF or URDF model in a world.

    `bodies`, `joints`, `actuators` by the file's names (those without one: '#' and the index); `loops` and `gears`: the
    joints and gears that its equality constraints are; `source`: the mujoco.MjModel.

    Bodies that the file has without joints are part of the one they are fixed to: several names of one Body. What is
    fixed to the world has a Body only if something can touch it.
    """

    def __init__(self, world: World, source: Any, report: Report) -> None:
        super().__init__(world, source, report)
        self.groups = []  # of tree.py, one a body of the file
        self.carriers = []  # bodies between several joints of one
        self.links = None  # of a URDF: what there is to look at (LinkVisual of compile.py); None: the geoms
        self._start = None  # q, qd and ctrl, as they were loaded

    def frame(self, name: str) -> tuple[Any, Any]:
        """The pose of the file's frame of a body, as MuJoCo's xpos and xquat: position (m, world), w x y z."""
        for index in range(self.source.nbody):
            if name_of(self.source, "body", index) == name:
                return self.groups[index].frame_in_world(index)
        raise KeyError(name)

    def site(self, name: str) -> tuple[Any, Any]:
        """The pose of a site of the file, as MuJoCo's site_xpos: position (m, world), w x y z."""
        names = [name_of(self.source, "site", index) for index in range(self.source.nsite)]
        if name not in names:
            raise no_such_name("site", name, names)
        index = names.index(name)
        body = int(self.source.site_bodyid[index])
        own = pose(self.source.site_pos[index], self.source.site_quat[index])
        return mul(self.groups[body].frame_in_world(body), own)

    # ---- positions, velocities, controls: in MuJoCo's order --------------------------------------------------------

    def coordinates(self, xp=NUMPY):
        """A Coordinates of this robot, for arrays of a namespace."""
        source = self.source
        joints = [(self.joints[name_of(source, "joint", k)], int(source.jnt_qposadr[k]), int(source.jnt_dofadr[k]))
                  for k in range(source.njnt)]
        return Coordinates(self.world, joints, int(source.nq), int(source.nv), xp)

    def positions(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """All joints' positions, as MuJoCo's qpos (nq), a copy of your own."""
        return np.array(self.q)

    def _get(self, name):
        return self.world.get(name)[None]

    @property
    def q(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """All positions, as MuJoCo's qpos (nq): a copy, not to be written to. `robot.q = q` keeps the velocities."""
        return read_only(self.coordinates().q(self._get("body_state"), self._get("joint_position"))[0],
                         "set_positions(q, qd)")

    @q.setter
    def q(self, q: Any) -> None:
        self.set_positions(q, self.qd)

    @property
    def qd(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """All velocities, as MuJoCo's qvel (nv): a copy, not to be written to. `robot.qd = qd` keeps the positions."""
        arrays = (self._get(name) for name in ("body_state", "joint_position", "joint_speed"))
        return read_only(self.coordinates().qd(*arrays)[0], "set_positions(q, qd)")

    @qd.setter
    def qd(self, qd: Any) -> None:
        self.set_positions(self.q, qd)

    def set_positions(self, q: Any, qd: Any = None) -> None:
        """Positions (nq) and velocities (nv; None: 0) in MuJoCo's order. What moves with the bodies does so; contacts
        begin anew. If anything is refused, nothing is set. Time goes on, and controls stay."""
        coordinates = self.coordinates()
        q = _row("q", q, coordinates.nq)
        qd = _row("qd", np.zeros(coordinates.nv) if qd is None else qd, coordinates.nv)
        coordinates.check_turns(q)
        coordinates.place(self._get, lambda name, values: self.world.set(name, values[0]), q, qd)

    @property
    def ctrl(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Controls of `actuators`, in the file's order, as MuJoCo's ctrl: a copy, not to be written to. `robot.ctrl = u`
        sets them; each is brought into its actuator's range."""
        return read_only([actuator.control for actuator in self.actuators.values()], "robot.ctrl = (...)")

    @ctrl.setter
    def ctrl(self, ctrl: Any) -> None:
        for actuator, control in zip(self.actuators.values(), _row("ctrl", ctrl, len(self.actuators))[0]):
            actuator.control = control

    def reset(self, keyframe: str | int | None = None) -> None:
        """Positions, velocities and controls as they were loaded, or those of a keyframe of the file, by name or index.
        Time goes on; forces that were set stay."""
        q, qd, ctrl = self._start if keyframe is None else start_numbers(self, keyframe)
        self.set_positions(q, qd)
        self.ctrl = ctrl


class LoadedStage(Loaded):
    """A USD stage in a world: its frame has metres and z up (`stage_to_world`).

    `bodies`: by the prim's path, those of rigid bodies, and the static ones of colliders that are of none; `joints`:
    the world's Joint by the prim's path (coordinates in m and rad); `shapes`: by the collider's path; `source`: the
    pxr.Usd.Stage.
    """

    def __init__(self, world, source, report, stage_to_world):
        super().__init__(world, source, report)
        self.stage_to_world = stage_to_world  #: pose of the stage's frame, whose lengths are in m then, in the world
        self.frames = {}  # of bodies: the prim's frame in the Body's, by path

    def frame(self, path: Any) -> tuple[Any, Any]:
        """The pose of a body's prim, without its scale: position (m, world), w x y z."""
        body = self.bodies[str(path)]
        return mul(pose(body.position, body.orientation), self.frames[str(path)])
