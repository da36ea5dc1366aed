"""Mass matrix, bias forces, inverse dynamics and Jacobians of many robots at once.

By the tree of joints in the file's order of numbers (R. Featherstone, Rigid Body Dynamics Algorithms, 2008): twists and
wrenches are angular part first, about the world's origin. What ties joints to each other (loops, gears) is left out, and
so are contacts."""

import numpy as np

from .namespace import namespace_of
from .rotations import multiply, of_vector, rotate


def _cross(v, s):
    """Twist v acts on twist s."""
    xp = namespace_of(v, s)
    w, u, a, b = v[..., :3], v[..., 3:], s[..., :3], s[..., 3:]
    return xp.concatenate([xp.cross(w, a), xp.cross(w, b) + xp.cross(u, a)], -1)


def _cross_dual(v, f):
    """Twist v acts on wrench f."""
    xp = namespace_of(v, f)
    w, u, n, p = v[..., :3], v[..., 3:], f[..., :3], f[..., 3:]
    return xp.concatenate([xp.cross(w, n) + xp.cross(u, p), xp.cross(w, p)], -1)


class Tree:
    """The file's bodies with joints, parents first; numbers as `xp` has them."""

    def __init__(self, loaded, rows, xp):
        source = loaded.source
        self.source, self.groups, self.xp = source, loaded.groups, xp
        self.body_pos, self.body_quat = xp.array(source.body_pos), xp.array(source.body_quat)
        self.jnt_pos, self.jnt_axis, self.eye = xp.array(source.jnt_pos), xp.array(source.jnt_axis), xp.array(np.eye(6))
        self.all = xp.array(np.arange(source.nv))
        groups = enumerate(loaded.groups)
        self.bodies = [k for k, group in groups if group.root == k and group.kind == "dynamic"]
        self.rows = {k: rows[loaded.groups[k].body] for k in self.bodies}
        self.above = {}  # of a body: degrees of freedom that move it
        for k in self.bodies:
            parent = loaded.groups[source.body_parentid[k]]
            own = [d for d in range(source.nv) if source.dof_bodyid[d] == k]
            self.above[k] = self.above.get(parent.root, []) + own
        self.dofs = {k: xp.array(np.array(above, np.int64)) for k, above in self.above.items()}
        self.frames = {index: [xp.array(x) for x in group.frames[index]]
                       for index, group in enumerate(loaded.groups) if index in group.frames}
        self.inertial = {k: [xp.array(x) for x in loaded.groups[k].inertial] for k in self.bodies}


class Motion:
    """Where robots are: q, qd: n x nq, n x nv. twists: n x nv x 6, of each degree of freedom; poses of bodies."""

    def __init__(self, tree, q, qd):
        source, n = tree.source, len(q)
        self.tree, self.qd, self.xp = tree, qd, tree.xp
        self.twists, self.rates = self.xp.zeros((n, source.nv, 6)), self.xp.zeros((n, source.nv, 6))
        self.poses, self.velocities, self.accelerations = {}, {}, {}
        for body in tree.bodies:
            self._add(body, q)

    def _frame_of(self, index):
        """Of any body of the file: position, orientation, velocity and acceleration without those of joints."""
        group, n, xp = self.tree.groups[index], len(self.qd), self.xp
        place, turn = self.tree.frames[index]
        if group.kind != "dynamic":
            if group.kind == "kinematic":
                raise ValueError("dynamics of robots on bodies that move by themselves (mocap) are not there")
            return xp.broadcast_to(place, (n, 3)), xp.broadcast_to(turn, (n, 4)), xp.zeros((n, 6)), xp.zeros((n, 6))
        x, o = self.poses[group.root]
        return x + rotate(o, place), multiply(o, turn), self.velocities[group.root], self.accelerations[group.root]

    def _add(self, body, q):
        source = self.tree.source
        x, o, v, a = self._frame_of(int(source.body_parentid[body]))
        x = x + rotate(o, self.tree.body_pos[body])
        o = multiply(o, self.tree.body_quat[body])
        first = int(source.body_jntadr[body])
        for joint in range(first, first + int(source.body_jntnum[body])):
            x, o, v, a = self._turn(joint, q, x, o, v, a)
        self.poses[body], self.velocities[body], self.accelerations[body] = (x, o), v, a

    def _turn(self, joint, q, x, o, v, a):
        source, xp = self.tree.source, self.xp
        at, dof, kind = int(source.jnt_qposadr[joint]), int(source.jnt_dofadr[joint]), int(source.jnt_type[joint])
        if kind == 0:
            x, o = q[:, at : at + 3], q[:, at + 3 : at + 7]
            o = o / xp.norm(o)
            for k in range(3):
                self.twists[:, dof + k, 3 + k] = 1
                v = v + self.twists[:, dof + k] * self.qd[:, dof + k, None]
            return self._turn_freely(dof + 3, x, x, o, v, a)
        place = self.tree.jnt_pos[joint]
        if kind == 1:
            anchor = x + rotate(o, place)
            turned = q[:, at : at + 4] / xp.norm(q[:, at : at + 4])
            o = multiply(o, turned)
            return self._turn_freely(dof, anchor - rotate(o, place), anchor, o, v, a)
        axis, by = rotate(o, self.tree.jnt_axis[joint]), q[:, at] - float(source.qpos0[at])
        twist = self.twists[:, dof]
        if kind == 2:
            twist[:, 3:] = axis
            x = x + axis * by[:, None]
        else:
            anchor = x + rotate(o, place)
            o = multiply(of_vector(axis * by[:, None]), o)
            x = anchor - rotate(o, place)
            twist[:, :3], twist[:, 3:] = axis, xp.cross(anchor, axis)
        self.rates[:, dof] = _cross(v, twist)
        rate = self.qd[:, dof, None]
        return x, o, v + twist * rate, a + self.rates[:, dof] * rate

    def _turn_freely(self, dof, x, anchor, o, v, a):
        """About the body's own axes, which turn with it."""
        for k in range(3):
            axis = rotate(o, self.tree.eye[k, :3])
            self.twists[:, dof + k] = self.xp.concatenate([axis, self.xp.cross(anchor, axis)], -1)
            v = v + self.twists[:, dof + k] * self.qd[:, dof + k, None]
        for k in range(3):
            self.rates[:, dof + k] = _cross(v, self.twists[:, dof + k])
            a = a + self.rates[:, dof + k] * self.qd[:, dof + k, None]
        return x, o, v, a

    # ---- what follows ----------------------------------------------------------------------------------------------

    def inertias(self, numbers):
        """n x 6 x 6 of each body; numbers: n x bodies x (mass, three moments), of the world's bodies."""
        xp, eye = self.xp, self.tree.eye[:3, :3]
        for body in self.tree.bodies:
            place, turn = self.tree.inertial[body]
            x, o = self.poses[body]
            center, axes = x + rotate(o, place), multiply(o, turn)
            own = numbers[:, self.tree.rows[body]]
            columns = xp.stack([rotate(axes, eye[k]) for k in range(3)], -1)
            about = xp.einsum("nik,nk,njk->nij", columns, own[:, 1:], columns)
            across = xp.zeros((len(x), 3, 3))  # center x
            for i, j, k, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 0, 2, 1), (1, 2, 0, -1), (2, 0, 1, -1), (2, 1, 0, 1)):
                across[:, i, j] = sign * center[:, k]
            mass = own[:, 0, None, None]
            whole = xp.zeros((len(x), 6, 6))
            whole[:, :3, :3] = about - mass * across @ across
            whole[:, :3, 3:] = mass * across
            whole[:, 3:, :3] = -mass * across
            whole[:, 3:, 3:] = mass * eye
            yield body, whole

    def mass_matrix(self, numbers, armature):
        n, nv = self.qd.shape
        out = self.xp.zeros((n, nv, nv))
        for body, inertia in self.inertias(numbers):
            dofs = self.tree.dofs[body]
            part = self.twists[:, dofs]
            out[:, dofs[:, None], dofs] += self.xp.einsum("nai,nij,nbj->nab", part, inertia, part)
        out[:, self.tree.all, self.tree.all] += armature  # n x nv
        return out

    def forces(self, numbers, gravity, scale, armature, qdd):
        """M qdd + bias. gravity: n x 3, or 3; scale: n x bodies, of it; qdd: n x nv."""
        xp, out = self.xp, armature * qdd
        for body, inertia in self.inertias(numbers):
            dofs = self.tree.dofs[body]
            part = self.twists[:, dofs]
            a = self.accelerations[body] + xp.einsum("nai,na->ni", part, qdd[:, dofs])
            a[:, 3:] -= gravity * scale[:, self.tree.rows[body], None]
            v = self.velocities[body]
            wrench = xp.einsum("nij,nj->ni", inertia, a) + _cross_dual(v, xp.einsum("nij,nj->ni", inertia, v))
            out[:, dofs] += xp.einsum("nai,ni->na", part, wrench)
        return out

    def jacobian(self, index, point):
        """n x 6 x nv: velocity of a point of the file's body, then angular velocity, world."""
        out = self.xp.zeros((len(self.qd), 6, self.qd.shape[1]))
        group = self.tree.groups[index]
        if group.kind != "dynamic":
            return out
        x, o, _, _ = self._frame_of(index)
        at = x + rotate(o, self.xp.array(point))
        dofs = self.tree.dofs[group.root]
        part = self.twists[:, dofs]
        out[:, :3, dofs] = (part[..., 3:] + self.xp.cross(part[..., :3], at[:, None])).swapaxes(1, 2)
        out[:, 3:, dofs] = part[..., :3].swapaxes(1, 2)
        return out
