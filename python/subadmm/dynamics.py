"""Mass matrix, bias forces, inverse dynamics and Jacobians of many robots at once.

By the tree of joints in the file's order of numbers (R. Featherstone, Rigid Body Dynamics Algorithms, 2008): twists and
wrenches are angular part first, about the world's origin. What ties joints to each other (loops, gears) is left out, and
so are contacts."""

import numpy as np

from .rotations import multiply, of_vector, rotate


def _cross(v, s):
    """Twist v acts on twist s."""
    w, u, a, b = v[..., :3], v[..., 3:], s[..., :3], s[..., 3:]
    return np.concatenate([np.cross(w, a), np.cross(w, b) + np.cross(u, a)], -1)


def _cross_dual(v, f):
    """Twist v acts on wrench f."""
    w, u, n, p = v[..., :3], v[..., 3:], f[..., :3], f[..., 3:]
    return np.concatenate([np.cross(w, n) + np.cross(u, p), np.cross(w, p)], -1)


class Tree:
    """The file's bodies with joints, parents first."""

    def __init__(self, loaded, rows):
        source = loaded.source
        self.source, self.groups = source, loaded.groups
        groups = enumerate(loaded.groups)
        self.bodies = [k for k, group in groups if group.root == k and group.kind == "dynamic"]
        self.rows = {k: rows[loaded.groups[k].body] for k in self.bodies}
        self.above = {}  # of a body: degrees of freedom that move it
        for k in self.bodies:
            parent = loaded.groups[source.body_parentid[k]]
            own = [d for d in range(source.nv) if source.dof_bodyid[d] == k]
            self.above[k] = self.above.get(parent.root, []) + own


class Motion:
    """Where robots are: q, qd: n x nq, n x nv. twists: n x nv x 6, of each degree of freedom; poses of bodies."""

    def __init__(self, tree, q, qd):
        source, n = tree.source, len(q)
        self.tree, self.qd = tree, qd
        self.twists, self.rates = np.zeros((n, source.nv, 6)), np.zeros((n, source.nv, 6))
        self.poses, self.velocities, self.accelerations = {}, {}, {}
        for body in tree.bodies:
            self._add(body, q)

    def _frame_of(self, index):
        """Of any body of the file: position, orientation, velocity and acceleration without those of joints."""
        group, n = self.tree.groups[index], len(self.qd)
        place, turn = group.frames[index]
        if group.kind != "dynamic":
            if group.kind == "kinematic":
                raise ValueError("dynamics of robots on bodies that move by themselves (mocap) are not there")
            return np.broadcast_to(place, (n, 3)), np.broadcast_to(turn, (n, 4)), np.zeros((n, 6)), np.zeros((n, 6))
        x, o = self.poses[group.root]
        return (x + rotate(o, place), multiply(o, np.broadcast_to(turn, o.shape)), self.velocities[group.root],
                self.accelerations[group.root])

    def _add(self, body, q):
        source = self.tree.source
        x, o, v, a = self._frame_of(int(source.body_parentid[body]))
        x = x + rotate(o, source.body_pos[body])
        o = multiply(o, np.broadcast_to(source.body_quat[body], o.shape))
        first = int(source.body_jntadr[body])
        for joint in range(first, first + int(source.body_jntnum[body])):
            x, o, v, a = self._turn(joint, q, x, o, v, a)
        self.poses[body], self.velocities[body], self.accelerations[body] = (x, o), v, a

    def _turn(self, joint, q, x, o, v, a):
        source = self.tree.source
        at, dof, kind = int(source.jnt_qposadr[joint]), int(source.jnt_dofadr[joint]), int(source.jnt_type[joint])
        if kind == 0:
            x, o = q[:, at : at + 3], q[:, at + 3 : at + 7]
            o = o / np.linalg.norm(o, axis=-1, keepdims=True)
            for k in range(3):
                self.twists[:, dof + k, 3 + k] = 1
                v = v + self.twists[:, dof + k] * self.qd[:, dof + k, None]
            return self._turn_freely(dof + 3, x, x, o, v, a)
        if kind == 1:
            anchor = x + rotate(o, source.jnt_pos[joint])
            turned = q[:, at : at + 4] / np.linalg.norm(q[:, at : at + 4], axis=-1, keepdims=True)
            o = multiply(o, turned)
            return self._turn_freely(dof, anchor - rotate(o, source.jnt_pos[joint]), anchor, o, v, a)
        axis, by = rotate(o, source.jnt_axis[joint]), q[:, at] - source.qpos0[at]
        twist = self.twists[:, dof]
        if kind == 2:
            twist[:, 3:] = axis
            x = x + axis * by[:, None]
        else:
            anchor = x + rotate(o, source.jnt_pos[joint])
            o = multiply(of_vector(axis * by[:, None]), o)
            x = anchor - rotate(o, source.jnt_pos[joint])
            twist[:, :3], twist[:, 3:] = axis, np.cross(anchor, axis)
        self.rates[:, dof] = _cross(v, twist)
        rate = self.qd[:, dof, None]
        return x, o, v + twist * rate, a + self.rates[:, dof] * rate

    def _turn_freely(self, dof, x, anchor, o, v, a):
        """About the body's own axes, which turn with it."""
        for k in range(3):
            axis = rotate(o, np.eye(3)[k])
            self.twists[:, dof + k] = np.concatenate([axis, np.cross(anchor, axis)], -1)
            v = v + self.twists[:, dof + k] * self.qd[:, dof + k, None]
        for k in range(3):
            self.rates[:, dof + k] = _cross(v, self.twists[:, dof + k])
            a = a + self.rates[:, dof + k] * self.qd[:, dof + k, None]
        return x, o, v, a

    # ---- what follows ----------------------------------------------------------------------------------------------

    def inertias(self, numbers):
        """n x 6 x 6 of each body; numbers: n x bodies x (mass, three moments), of the world's bodies."""
        for body in self.tree.bodies:
            place, turn = self.tree.groups[body].inertial
            x, o = self.poses[body]
            center, axes = x + rotate(o, place), multiply(o, np.broadcast_to(turn, o.shape))
            own = numbers[:, self.tree.rows[body]]
            columns = np.stack([rotate(axes, np.eye(3)[k]) for k in range(3)], -1)
            about = np.einsum("nik,nk,njk->nij", columns, own[:, 1:], columns)
            across = np.zeros((len(x), 3, 3))  # center x
            for i, j, k, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 0, 2, 1), (1, 2, 0, -1), (2, 0, 1, -1), (2, 1, 0, 1)):
                across[:, i, j] = sign * center[:, k]
            mass = own[:, 0, None, None]
            whole = np.zeros((len(x), 6, 6))
            whole[:, :3, :3] = about - mass * across @ across
            whole[:, :3, 3:] = mass * across
            whole[:, 3:, :3] = -mass * across
            whole[:, 3:, 3:] = mass * np.eye(3)
            yield body, whole

    def mass_matrix(self, numbers, armature):
        n, nv = self.qd.shape
        out = np.zeros((n, nv, nv))
        for body, inertia in self.inertias(numbers):
            dofs = self.tree.above[body]
            part = self.twists[:, dofs]
            out[np.ix_(range(n), dofs, dofs)] += np.einsum("nai,nij,nbj->nab", part, inertia, part)
        out[:, range(nv), range(nv)] += armature  # n x nv
        return out

    def forces(self, numbers, gravity, scale, armature, qdd):
        """M qdd + bias. gravity: n x 3; scale: n x bodies, of it; qdd: n x nv."""
        out = armature * qdd
        for body, inertia in self.inertias(numbers):
            dofs = self.tree.above[body]
            part = self.twists[:, dofs]
            a = self.accelerations[body] + np.einsum("nai,na->ni", part, qdd[:, dofs])
            a[:, 3:] -= gravity * scale[:, self.tree.rows[body], None]
            v = self.velocities[body]
            wrench = np.einsum("nij,nj->ni", inertia, a) + _cross_dual(v, np.einsum("nij,nj->ni", inertia, v))
            out[:, dofs] += np.einsum("nai,ni->na", part, wrench)
        return out

    def jacobian(self, index, point):
        """n x 6 x nv: velocity of a point of the file's body, then angular velocity, world."""
        out = np.zeros((len(self.qd), 6, self.qd.shape[1]))
        group = self.tree.groups[index]
        if group.kind != "dynamic":
            return out
        x, o, _, _ = self._frame_of(index)
        at = x + rotate(o, point)
        dofs = self.tree.above[group.root]
        part = self.twists[:, dofs]
        out[:, :3, dofs] = (part[..., 3:] + np.cross(part[..., :3], at[:, None])).swapaxes(1, 2)
        out[:, 3:, dofs] = part[..., :3].swapaxes(1, 2)
        return out
