"""Many copies of a loaded robot, in MuJoCo's order of numbers."""
from __future__ import annotations


import contextlib
from typing import Any

import numpy as np

from .dynamics import Motion, Tree
from .environments import Environments
from .given import numbers, point
from .importing.actuators import FORCE_SPEED
from .importing.model import name_of
from .namespace import to_numpy
from .rotations import conjugate, multiply, rotate

#: Positions, velocities and accelerations that may be given.
MOST = 1e9


class Robots(Environments):
    """Copies of a robot. `q`, `qd`: all positions and velocities in MuJoCo's order and frames (count x nq, count x nv);
    `ctrl`: controls of the actuators (count x nu), which are written to and hold from the next step on; `loaded`: the
    template. On CUDA these, sensors and dynamics are tensors of torch, worked out on the device."""

    def __init__(self, loaded: Any, count: int) -> None:
        self._drives = _Drives(loaded)
        with self._drives.all_on():
            super().__init__(loaded.world, count)
        self.loaded = loaded
        self._drives.place(self.xp)
        self._mounts, self._pull = {}, (None, None)
        source, world = loaded.source, loaded.world
        rows = {body: k for k, body in enumerate(world.bodies)}
        self._tree = Tree(loaded, rows, self.xp)
        self._inputs = {name: world.get(name) for name in ("body_inertia", "body_gravity_scale", "joint_armature")}
        self._coordinates = loaded.coordinates(self.xp)
        self._state = self.array("body_state")
        self._position, self._speed = self.array("joint_position"), self.array("joint_speed")
        #: Controls, as MuJoCo's ctrl, of the actuators in `loaded.actuators`.
        self.ctrl = self.xp.array(np.tile(self._drives.start, (count, 1)))
        self._arrays = {name: self.array(name) for name in self._drives.arrays}

    def __repr__(self) -> str:
        return f"<subadmm robots: {self.count}>"

    def step(self, steps: int = 1) -> None:
        """Make `steps` time steps with the controls in `ctrl`, each within its actuator's range. Of an environment with
        a control that is no number it is said in `failed`."""
        shape = self.count, self._drives.start.size
        if np.shape(self.ctrl) != shape:
            raise ValueError(f"ctrl: must have shape {shape}, has {np.shape(self.ctrl)}")
        self._drives.write(self.xp.array(self.ctrl), self._arrays)
        super().step(steps)

    def set(self, name: str, values: Any, which: Any = None) -> None:
        super().set(name, values, which)
        if self.device >= 0 and (name in self._inputs or name == "gravity") and not self._bound_of(name):
            self.array(name)

    set.__doc__ = Environments.set.__doc__

    def _bound_of(self, name):
        return [array for (of, _), array in self._bound.items() if of == name]

    # ---- positions and velocities ----------------------------------------------------------------------------------

    @property
    def q(self) -> Any:
        """Positions, as MuJoCo's qpos: count x nq, a copy."""
        return self._coordinates.q(self._state, self._position)

    @property
    def qd(self) -> Any:
        """Velocities, as MuJoCo's qvel: count x nv, a copy."""
        return self._coordinates.qd(self._state, self._position, self._speed)

    def set_positions(self, q: Any, qd: Any = None, which: Any = None) -> None:
        """Positions and velocities (None: 0) in MuJoCo's order, of environments (numbers, or a mask; None: all): one row
        for all, or one each. What moves with the bodies does so; contacts begin anew. If anything is refused, nothing is
        set. On CUDA, too, the host does it."""
        rows = self._which(which)
        n = self.count if rows is None else len(rows)
        source = self.loaded.source
        q = self._rows("q", q, n, source.nq)
        qd = self._rows("qd", np.zeros(source.nv) if qd is None else qd, n, source.nv)
        self._coordinates.check_turns(q)
        self._place(rows, q, qd)

    @staticmethod
    def _rows(name, values, n, columns):
        values = numbers(name, np.atleast_2d(to_numpy(values)), columns)
        if len(values) not in (1, n):
            raise ValueError(f"{name}: must have 1 row or {n}, and has {len(values)}")
        if not (np.abs(values) <= MOST).all():
            raise ValueError(f"{name}: must be finite numbers within +-{MOST:g}")
        return np.broadcast_to(values, (n, columns))

    def _place(self, rows, q, qd):
        core = self._core
        self._coordinates.place(lambda name: core.get(name, rows),
                                lambda name, values: core.set(name, values, rows), q, qd)

    # ---- sensors ---------------------------------------------------------------------------------------------------

    def _named(self, body):
        names = [name_of(self.loaded.source, "body", k) for k in range(self.loaded.source.nbody)]
        if body not in names:
            raise KeyError(f"body: the file has none of the name {body!r}")
        return names.index(body)

    def frame(self, body: str, place: Any = (0.0, 0.0, 0.0), turn: Any = (1.0, 0.0, 0.0, 0.0)) -> tuple[Any, Any]:
        """Where a frame on a body of the file is (by name; place, m, and turn, w x y z, in the body's frame): positions
        (count x 3, world), orientations (count x 4, w x y z)."""
        row, (place, turn) = self._mounted(body, place, turn)
        x, o = self._state[:, row, :3], self._state[:, row, 3:7]
        return x + rotate(o, place), multiply(o, turn)

    def _mounted(self, body, place, turn):
        """The row of the world's body that has a frame, and its pose there."""
        place, turn = point("place", place), point("turn", turn, 4)
        key = body, *place, *turn
        if key not in self._mounts:
            self._mounts[key] = self._mount(body, place, turn)
        return self._mounts[key]

    def _mount(self, body, place, turn):
        index = self._named(body)
        group = self.loaded.groups[index]
        if group.body is None or group.kind == "static":
            raise ValueError(f"body: {body!r} does not move")
        if np.linalg.norm(turn) < 1e-6:
            raise ValueError("turn: must be a quaternion, not 0")
        outer = group.frame_in_body(index)
        inner = outer[0] + rotate(outer[1], place), multiply(outer[1], turn / np.linalg.norm(turn))
        return self.loaded.world.bodies.index(group.body), tuple(self.xp.array(x) for x in inner)

    def imu(self, body: str, place: Any = (0.0, 0.0, 0.0), turn: Any = (1.0, 0.0, 0.0, 0.0)) -> tuple[Any, Any]:
        """What an inertial sensor in a frame on a body of the file reads (place, m, and turn, w x y z, in the body's
        frame): angular velocity (count x 3, rad/s) and acceleration less gravity (count x 3, m/s^2), in the sensor's
        axes. The acceleration is the mean of the last (sub-)step."""
        row, (place, turn) = self._mounted(body, place, turn)
        xp, o = self.xp, self._state[:, row, 3:7]
        acceleration = self.array("body_acceleration")[:, row]
        spin, arm = self._state[:, row, 10:], rotate(o, place)
        turning, inward = xp.cross(acceleration[:, 3:], arm), xp.cross(spin, xp.cross(spin, arm))
        there = acceleration[:, :3] + turning + inward - self._gravity(None)
        back = conjugate(multiply(o, turn))
        return rotate(back, spin), rotate(back, there)

    # ---- dynamics --------------------------------------------------------------------------------------------------

    def _pick(self, rows):
        return slice(None) if rows is None else self.xp.array(rows.astype(np.int64))

    def _motion(self, rows):
        pick = self._pick(rows)
        return Motion(self._tree, self.q[pick], self.qd[pick])

    def _input(self, name, rows):
        """Rows of an input array, n x rows x columns, where the robots are: those on a device have the template's where
        they have no array of it."""
        if self.device < 0:
            return self.xp.array(self._core.get(name, rows))
        for bound in self._bound_of(name):
            return self.xp.asarray(bound[self._pick(rows)], dtype=self.xp.float64)
        now = self.xp.array(self._inputs[name])
        return self.xp.broadcast_to(now, (self.count if rows is None else len(rows), *now.shape))

    def _gravity(self, rows):
        """n x 3, or the three that all have."""
        if self.device < 0:
            return self.xp.array(self._core.get("gravity", rows))[:, 0]
        for bound in self._bound_of("gravity"):
            return self.xp.asarray(bound[self._pick(rows)], dtype=self.xp.float64)[:, 0]
        now = tuple(self._library.settings.gravity)
        if now != self._pull[0]:
            self._pull = now, self.xp.array(now)
        return self._pull[1]

    def _armature(self, rows):
        """n x nv: of joints what each has, of free bodies the file's."""
        now = self._input("joint_armature", rows)
        out = self.xp.array(np.tile(self.loaded.source.dof_armature, (len(now), 1)))
        _, qd, row, coordinate, _, _ = self._coordinates.own_hinges
        out[:, qd] = now[:, row, coordinate]
        for _, at, row, _, _ in self._coordinates.balls:
            out[:, at] = now[:, row, 3:]
        return out

    def mass_matrix(self, which: Any = None) -> Any:
        """n x nv x nv of environments (numbers, or a mask; None: all): kinetic energy is qd M qd / 2. By the masses,
        inertias and armatures that each has."""
        rows = self._which(which)
        return self._motion(rows).mass_matrix(self._input("body_inertia", rows), self._armature(rows))

    def inverse_dynamics(self, qdd: Any, which: Any = None) -> Any:
        """n x nv: generalised forces that accelerations qdd (n x nv, or one row for all) take: M qdd and those of
        gravity and velocities. Damping, springs, friction, loops and contacts are left out. The host checks qdd, on
        CUDA, too."""
        rows = self._which(which)
        motion = self._motion(rows)
        qdd = self.xp.array(self._rows("qdd", qdd, *motion.qd.shape))
        return motion.forces(self._input("body_inertia", rows), self._gravity(rows),
                             self._input("body_gravity_scale", rows)[..., 0], self._armature(rows), qdd)

    def bias(self, which: Any = None) -> Any:
        """n x nv: generalised forces of gravity and velocities: MuJoCo's qfrc_bias, less its gravity compensation."""
        return self.inverse_dynamics(np.zeros(self.loaded.source.nv), which)

    def jacobian(self, body: str, place: Any = (0.0, 0.0, 0.0), which: Any = None) -> Any:
        """n x 6 x nv: times qd the velocity of a point of a body of the file (by name; in its frame, m) and its angular
        velocity, in the world's axes."""
        return self._motion(self._which(which)).jacobian(self._named(body), point("place", place))


class _Drives:
    """What controls are to drives of joints (importing/actuators.py), for many robots at once."""

    def __init__(self, loaded):
        world = loaded.world
        joints = {joint: k for k, joint in enumerate(world.joints)}
        actuators = list(loaded.actuators.values())
        drives = list(dict.fromkeys(d for a in actuators for d in (a._drives[joint] for joint, _ in a.parts)))
        index = {id(a): k for k, a in enumerate(actuators)}
        self.drives = drives
        self.start = np.array([a.control for a in actuators])
        self.range = np.array([a.control_range for a in actuators]).reshape(-1, 2)
        self.gain = np.array([a.gain for a in actuators])
        self.constant = np.array([a.constant for a in actuators])
        motor = np.array([a.stiffness == 0 and a.damping == 0 for a in actuators], bool)
        force = np.array([a.force_range for a in actuators]).reshape(-1, 2)
        self.force_range = np.where(motor[:, None], force, (-np.inf, np.inf)) if actuators else force
        self.share = np.zeros((len(actuators), len(drives)))  # of an input in a drive's force
        kinds = {"stiff": [], "damped": [], "force": []}
        for column, drive in enumerate(drives):
            for actuator, factor in drive.actuators:
                self.share[index[id(actuator)], column] += factor
            stiffness = sum(f * f * a.stiffness for a, f in drive.actuators)
            damping = sum(f * f * a.damping for a, f in drive.actuators)
            joint = drive.joint
            kind, scale = (("stiff", 1 / stiffness) if stiffness > 0 else ("damped", 1 / damping) if damping > 0
                           else ("force", 1.0))
            kinds[kind].append((column, joints[joint.joint], joint.coordinate, joint.sign, joint.offset, scale))
        self.kinds = {kind: [np.array(column) for column in zip(*parts)] for kind, parts in kinds.items() if parts}
        self.arrays = []
        if "stiff" in self.kinds:
            self.arrays.append("joint_target_position")
        if "damped" in self.kinds or "force" in self.kinds:
            self.arrays.append("joint_target_speed")
        if "force" in self.kinds:
            self.arrays.append("joint_drive_damping")

    def place(self, xp):
        """Numbers that steps need, as `xp` has them."""
        self.xp = xp
        self.own = [xp.array(x) for x in (*self.range.T, self.gain, self.constant, *self.force_range.T, self.share)]
        self.parts = {kind: [xp.array(x) for x in parts] for kind, parts in self.kinds.items()}

    @contextlib.contextmanager
    def all_on(self):
        """A force of 0 is no drive: here it is one, since it may be another force in some environment."""
        off = []
        for drive in self.drives:
            joint, k = drive.joint.joint, drive.joint.coordinate
            c = joint.coordinate(k).copy()
            if c.drive == "off":
                off.append((joint, k, joint.coordinate(k)))
                c.drive, c.drive_force = "position", drive.limit
                joint.set_coordinate(k, c)
        try:
            yield
        finally:
            for joint, k, c in off:
                joint.set_coordinate(k, c)

    def write(self, ctrl, arrays):
        if not self.start.size:
            return
        xp = self.xp
        least, most, gain, constant, weakest, strongest, share = self.own
        inputs = xp.clip(xp.clip(ctrl, least, most) * gain + constant, weakest, strongest)
        forces = inputs @ share
        for kind, (column, row, coordinate, sign, offset, scale) in self.parts.items():
            force = forces[:, column]
            if kind == "stiff":
                arrays["joint_target_position"][:, row, coordinate] = sign * (force * scale - offset)
            elif kind == "damped":
                arrays["joint_target_speed"][:, row, coordinate] = sign * force * scale
            else:
                arrays["joint_drive_damping"][:, row, coordinate] = xp.abs(force) / FORCE_SPEED
                arrays["joint_target_speed"][:, row, coordinate] = sign * xp.sign(force) * FORCE_SPEED
