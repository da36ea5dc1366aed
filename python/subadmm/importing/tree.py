"""The file's tree of bodies and joints as bodies and joints of the world."""

import numpy as np

from . import chain
from .model import LoadedJoint, element, name_of, world_name
from .options import disabled
from .poses import IDENTITY, inverse, mul, pose, q_about, q_conjugate, q_matrix, q_mul, q_of_matrix, q_turn
from .start import velocity_of_frame


class Group:
    """Bodies of the file that are fixed to each other: one body of the world, or the static world."""

    def __init__(self, root, kind):
        self.root = root  # index of the body that has the joints
        self.kind = kind  # 'static', 'kinematic' or 'dynamic'
        self.members = []
        self.frames = {}  # the file's frames of its bodies in the root's
        self.body = None  # the world's
        self.inertial = IDENTITY  # the world's body's frame in the root's
        self.mass, self.inertia = 0.0, np.zeros(3)
        self.gravity_scale = 1.0

    def frame_in_body(self, index):
        """The file's frame of body `index` in the world's body (static: in the world)."""
        return mul(inverse(self.inertial), self.frames[index])

    def frame_in_world(self, index):
        if self.kind == "static":
            return self.frames[index]
        return mul(pose(self.body.position, self.body.orientation), self.frame_in_body(index))


def groups_of(source):
    """A Group for every body of the file."""
    out = []
    for index in range(source.nbody):
        parent = int(source.body_parentid[index])
        if index == 0:
            group = Group(0, "static")
            frame = IDENTITY
        elif source.body_mocapid[index] >= 0:
            group = Group(index, "kinematic")
            frame = IDENTITY
        elif source.body_jntnum[index] > 0:
            group = Group(index, "dynamic")
            frame = IDENTITY
        else:
            group = out[parent]
            frame = mul(group.frames[parent], pose(source.body_pos[index], source.body_quat[index]))
        group.members.append(index)
        group.frames[index] = frame
        out.append(group)
    return out


def weigh(source, group):
    """Mass, principal moments and inertial frame of all members."""
    parts = [
        (index, mul(group.frames[index], pose(source.body_ipos[index], source.body_iquat[index])))
        for index in group.members
        if source.body_mass[index] > 0 or np.any(source.body_inertia[index])
    ]
    if len(parts) == 1:
        index, group.inertial = parts[0]
        group.mass, group.inertia = float(source.body_mass[index]), np.array(source.body_inertia[index])
        return
    masses = np.array([source.body_mass[index] for index, _ in parts])
    group.mass = float(masses.sum())
    centre = sum(m * frame[0] for m, (_, frame) in zip(masses, parts)) / group.mass
    whole = np.zeros((3, 3))
    for mass, (index, frame) in zip(masses, parts):
        turn, arm = q_matrix(frame[1]), frame[0] - centre
        whole += turn @ np.diag(source.body_inertia[index]) @ turn.T + mass * (
            arm @ arm * np.eye(3) - np.outer(arm, arm)
        )
    moments, axes = np.linalg.eigh(whole)
    if np.linalg.det(axes) < 0:
        axes[:, 2] = -axes[:, 2]
    group.inertia = np.maximum(moments, 0)
    group.inertial = (centre, q_of_matrix(axes))


def _gravity_scale(loaded, group):
    """1 less the file's gravity compensation, which is a force at each member's centre of mass."""
    source = loaded.source
    heavy = [index for index in group.members if source.body_mass[index] > 0]
    shares = {float(source.body_gravcomp[index]) for index in heavy}
    if len(shares) > 1:
        loaded.report.add(
            element(source, "body", group.root),
            "gravcomp differs between bodies fixed to each other: "
            "their mean by mass acts, at the common centre of mass",
        )
    return 1 - sum(source.body_mass[index] * source.body_gravcomp[index] for index in heavy) / group.mass


def _add_body(loaded, data, group):
    """The world's body of a group, in the start state."""
    source, root = loaded.source, group.root
    start = mul(pose(data.xpos[root], data.xquat[root]), group.inertial)
    name = world_name(name_of(source, "body", root))
    if group.kind == "kinematic":
        group.body = loaded.world.add_body(type="kinematic", position=start[0], orientation=start[1], name=name)
        return
    weigh(source, group)
    start = mul(pose(data.xpos[root], data.xquat[root]), group.inertial)
    linear, angular = velocity_of_frame(source, data, root)
    linear = linear + np.cross(angular, start[0] - data.xpos[root])
    group.gravity_scale = _gravity_scale(loaded, group)
    group.body = _dynamic(
        loaded,
        group,
        mass=group.mass,
        inertia=group.inertia,
        position=start[0],
        orientation=start[1],
        linear_velocity=linear,
        angular_velocity=angular,
        name=name,
    )


def _dynamic(loaded, group, **options):
    """A dynamic body of a group; errors name the file's body."""
    from .. import Error

    try:
        return loaded.world.add_body(gravity_scale=group.gravity_scale, **options)
    except Error as error:
        error.args = (f"{element(loaded.source, 'body', group.root)}: {error}",)
        raise


def _passive(loaded, index, place, sign, offset):
    """What acts along a joint by itself, as a Coordinate."""
    from .. import Coordinate

    source, report = loaded.source, loaded.report
    dof, adr = source.jnt_dofadr[index], source.jnt_qposadr[index]
    hinge_or_slide = source.jnt_type[index] in (2, 3)
    c = Coordinate()
    if source.jnt_limited[index] and not disabled(source, "LIMIT"):
        if hinge_or_slide:
            ends = sorted(sign * (x - offset) for x in source.jnt_range[index])
            c.limited, c.lower, c.upper = True, ends[0], ends[1]
            if source.jnt_margin[index]:
                report.add(element(source, "joint", index), "the limit's margin is not carried over")
        elif place == 3:
            report.add(element(source, "joint", index), "a ball's limit (of its angle) is not carried over")
    if source.jnt_stiffness[index] and not disabled(source, "SPRING"):
        c.spring_stiffness = float(source.jnt_stiffness[index])
        if hinge_or_slide:
            c.spring_rest = float(sign * (source.qpos_spring[adr] - offset))
    if not disabled(source, "DAMPER"):
        c.spring_damping = float(source.dof_damping[dof])
    if not disabled(source, "FRICTIONLOSS"):
        c.friction = float(source.dof_frictionloss[dof])
    c.armature = float(source.dof_armature[dof])
    return c


def _report_start(loaded, index, at):
    """A start outside of a limit: the joint is drawn in, which something else may not let it."""
    low, high = loaded.source.jnt_range[index]
    if not low - 1e-9 <= at <= high + 1e-9:
        loaded.report.add(
            element(loaded.source, "joint", index), f"starts at {at:.4g}, outside of its range [{low:.4g}, {high:.4g}]"
        )


def _report_laws(loaded, index):
    """Laws of a joint that are not linear (MuJoCo 4)."""
    source = loaded.source
    dof = source.jnt_dofadr[index]
    for name, at, what in (("jnt_stiffnesspoly", index, "stiffness"), ("dof_dampingpoly", dof, "damping")):
        if hasattr(source, name) and np.any(getattr(source, name)[at]):
            loaded.report.add(element(source, "joint", index), f"the {what}'s higher coefficients are not carried over")
    if hasattr(source, "jnt_springyield") and source.jnt_springyield[index]:
        loaded.report.add(element(source, "joint", index), "the spring's yield is not carried over")


def _add_free(loaded, group, index):
    source = loaded.source
    dof = source.jnt_dofadr[index]
    for array, what in (
        (source.dof_damping, "damping"),
        (source.dof_armature, "armature"),
        (source.dof_frictionloss, "frictionloss"),
    ):
        if np.any(array[dof : dof + 6]):
            loaded.report.add(element(source, "joint", index), f"{what} of a free joint is not carried over")
    if source.jnt_stiffness[index]:
        loaded.report.add(element(source, "joint", index), "stiffness of a free joint is not carried over")
    name = name_of(source, "joint", index)
    loaded.joints[name] = LoadedJoint(name, "free", group.body, group.frame_in_body(group.root))


class _Motion:
    """Where joints bring a body's frame, one after the other, and how it moves."""

    def __init__(self, source, data, body):
        parent = source.body_parentid[body]
        self.source, self.data = source, data
        above = pose(data.xpos[parent], data.xquat[parent])
        self.pose = mul(above, pose(source.body_pos[body], source.body_quat[body]))
        linear, self.angular = velocity_of_frame(source, data, parent)
        self.linear = linear + np.cross(self.angular, self.pose[0] - above[0])

    def go(self, index):
        source, data = self.source, self.data
        position, turn = self.pose
        adr, dof = source.jnt_qposadr[index], source.jnt_dofadr[index]
        point = source.jnt_pos[index]
        anchor = position + q_turn(turn, point)
        if source.jnt_type[index] == 2:
            way = q_turn(turn, source.jnt_axis[index]) * (data.qpos[adr] - source.qpos0[adr])
            self.pose = position + way, turn
            self.linear = (
                self.linear + np.cross(self.angular, way) + q_turn(turn, source.jnt_axis[index]) * data.qvel[dof]
            )
            return
        at_anchor = self.linear + np.cross(self.angular, anchor - position)
        if source.jnt_type[index] == 3:
            turn = q_mul(turn, q_about(source.jnt_axis[index], data.qpos[adr] - source.qpos0[adr]))
            own = source.jnt_axis[index] * data.qvel[dof]
        else:
            turn = q_mul(turn, q_mul(q_conjugate(source.qpos0[adr : adr + 4]), data.qpos[adr : adr + 4]))
            own = data.qvel[dof : dof + 3]
        self.angular = self.angular + q_turn(turn, own)
        arm = -q_turn(turn, point)
        self.pose = anchor + arm, turn
        self.linear = at_anchor + np.cross(self.angular, arm)


def _add_carrier(loaded, group, motion, point, share):
    """A small body between two joints, at `point` of the group's frame."""
    arm = group.inertial[0] - point
    moment = share * (group.inertia.max() + group.mass * arm @ arm)
    return _dynamic(
        loaded,
        group,
        mass=share * group.mass,
        inertia=[moment] * 3,
        position=motion.pose[0] + q_turn(motion.pose[1], point),
        orientation=motion.pose[1],
        angular_velocity=motion.angular,
        linear_velocity=motion.linear + np.cross(motion.angular, q_turn(motion.pose[1], point)),
        name=world_name(f"carrier of {name_of(loaded.source, 'body', group.root)}"),
    )


def _add_joint(loaded, data, fit, a, base_a, b, base_b):
    """One joint of the world for a run of the file's. base: the file's frame at qpos0 in a's body and in b's. Returns
    the
    joint and, for each of the file's, the coordinate, sign and offset."""
    source = loaded.source
    turn_b, back, offsets, coordinates = fit.turn, np.zeros(3), [], {}
    for index, (place, sign) in zip(fit.joints, fit.places):
        adr, kind = source.jnt_qposadr[index], source.jnt_type[index]
        offset = 0.0
        if kind == 3:  # the coordinate begins within half a turn
            offset = 2 * np.pi * np.round(data.qpos[adr] / (2 * np.pi))
            turn_b = q_mul(turn_b, q_about(np.eye(3)[place - 3], sign * (source.qpos0[adr] - offset)))
        elif kind == 2:
            back += source.jnt_axis[index] * source.qpos0[adr]
        offsets.append(float(offset))
        law = _passive(loaded, index, place, sign, offset)
        if law.limited:
            _report_start(loaded, index, float(data.qpos[adr]))
        coordinates.update({k: law for k in ((3, 4, 5) if kind == 1 else (place,))})
        _report_laws(loaded, index)
    frame_a = mul(base_a, pose(fit.point - back, fit.turn))
    frame_b = mul(base_b, pose(fit.point, turn_b))
    joint = loaded.world.add_joint(
        fit.kind,
        a,
        b,
        position_a=frame_a[0],
        orientation_a=frame_a[1],
        position_b=frame_b[0],
        orientation_b=frame_b[1],
        locks=fit.locks,
        collide=True,
        coordinates=coordinates,
        name=world_name("+".join(name_of(source, "joint", index) for index in fit.joints)),
    )
    types = {1: "ball", 2: "slide", 3: "hinge"}
    for index, (place, sign), offset in zip(fit.joints, fit.places, offsets):
        name, kind = name_of(source, "joint", index), types[int(source.jnt_type[index])]
        loaded.joints[name] = LoadedJoint(name, kind, b, None, joint, place, sign, offset, fit.turn)


def _add_joints(loaded, data, group, share):
    """All joints of a group, with carriers between those that do not fit one."""
    source, root = loaded.source, group.root
    first = source.body_jntadr[root]
    joints = list(range(first, first + source.body_jntnum[root]))
    if source.jnt_type[joints[0]] == 0:
        _add_free(loaded, group, joints[0])
        return
    parent = int(source.body_parentid[root])
    above = loaded.groups[parent]
    a = above.body if above.kind != "static" else None
    base = mul(above.frame_in_body(parent), pose(source.body_pos[root], source.body_quat[root]))
    fits = chain.runs(source, joints)
    motion = _Motion(source, data, root)
    for k, fit in enumerate(fits):
        for index in fit.joints:
            motion.go(index)
        if k + 1 == len(fits):
            _add_joint(loaded, data, fit, a, base, group.body, inverse(group.inertial))
            break
        point = fits[k + 1].point
        carrier = _add_carrier(loaded, group, motion, point, share)
        loaded.carriers.append(carrier)
        _add_joint(loaded, data, fit, a, base, carrier, pose(-point, IDENTITY[1]))
        a, base = carrier, pose(-point, IDENTITY[1])
    if len(fits) > 1:
        loaded.report.add(
            element(source, "body", root),
            f"its {len(joints)} joints are {len(fits)} here, with {len(fits) - 1} carrier(s) in between, each of "
            f"{share:g} of its mass and inertia",
        )


def add_tree(loaded, data, share):
    source = loaded.source
    loaded.groups = groups_of(source)
    for index, group in enumerate(loaded.groups):
        if group.kind != "static" and group.root == index:
            _add_body(loaded, data, group)
    for index, group in enumerate(loaded.groups):
        if group.kind != "static":
            loaded.bodies[name_of(source, "body", index)] = group.body
            if group.root == index and group.kind == "dynamic":
                _add_joints(loaded, data, group, share)
