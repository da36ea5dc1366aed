"""What load() returns."""

from typing import NamedTuple

import numpy as np

from .poses import mul, pose, q_of_vector, q_turn


class Note(NamedTuple):
    """Something that was not carried over, or not exactly."""

    element: str  # as "tendon 'left'"
    reason: str

    def __str__(self):
        return f"{self.element}: {self.reason}"


LONGEST_NAME = 63  # bytes, of a body


def world_name(name):
    """A name as bodies of a world can have it: of a longer one the end."""
    return name.encode()[-LONGEST_NAME:].decode(errors="ignore")


class Report(list):
    """A list of Note; printed one a line."""

    def add(self, element, reason):
        self.append(Note(element, reason))

    def __str__(self):
        return "\n".join(str(note) for note in self)


def name_of(source, kind, index):
    """The name of the index-th element of a kind ('body', 'joint', 'geom' ...); of one without a name '#index'."""
    return getattr(source, kind)(index).name or f"#{index}"


def element(source, kind, index):
    """As reports name it."""
    name = getattr(source, kind)(index).name
    return f"{kind} '{name}'" if name else f"{kind} #{index}"


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

    def to_coordinate(self, position):
        """The world's coordinate at a position of the file (hinge: rad, slide: m)."""
        return self.sign * (position - self.offset)

    @property
    def position(self):
        """As MuJoCo's qpos has it: a number (m, rad); ball: w x y z; free: position and w x y z of the body's frame."""
        if self.type == "free":
            return np.concatenate(mul(pose(self.body.position, self.body.orientation), self._frame))
        if self.type == "ball":
            return q_of_vector(q_turn(self._turn, self.joint.position[3:6]))
        return self.sign * self.joint.position[self.coordinate] + self.offset

    @property
    def speed(self):
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
    def control(self):
        """As MuJoCo's ctrl: a motor's force over its gain, a servo's target (m, rad or per s). In control_range."""
        return self._control

    @control.setter
    def control(self, value):
        value = float(value)
        if not np.isfinite(value):
            raise ValueError(f"control of actuator '{self.name}': {value} is not finite")
        self._control = min(max(value, self.control_range[0]), self.control_range[1])
        for joint, _ in self.parts:
            self._drives[joint].update()

    @property
    def input(self):
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

    def __init__(self, world, source, report):
        self.world = world
        self.source = source
        self.report = report
        self.bodies = {}
        self.joints = {}
        self.actuators = {}
        self.gears = {}
        self.loops = {}  # joints that the file's equality constraints became, by their names
        self.shapes = {}  # by geom index, or path of a prim

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

    def __init__(self, world, source, report):
        super().__init__(world, source, report)
        self.groups = []  # of tree.py, one a body of the file
        self.carriers = []  # bodies between several joints of one

    def frame(self, name):
        """The pose of the file's frame of a body, as MuJoCo's xpos and xquat: position (m, world), w x y z."""
        for index in range(self.source.nbody):
            if name_of(self.source, "body", index) == name:
                return self.groups[index].frame_in_world(index)
        raise KeyError(name)

    def positions(self):
        """All joints' positions, as MuJoCo's qpos (nq)."""
        out = np.zeros(self.source.nq)
        for index in range(self.source.njnt):
            at = self.source.jnt_qposadr[index]
            value = np.atleast_1d(self.joints[name_of(self.source, "joint", index)].position)
            out[at : at + value.size] = value
        return out


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

    def frame(self, path):
        """The pose of a body's prim, without its scale: position (m, world), w x y z."""
        body = self.bodies[str(path)]
        return mul(pose(body.position, body.orientation), self.frames[str(path)])
