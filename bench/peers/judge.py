"""What a run did, from its poses: the same for every engine, and by none of their code.

`Run` has the poses and velocities at the same times for all engines and time steps. Measures, largest over bodies and
times unless said otherwise:

    overlap       deepest overlap of two bodies, m: the least distance that parts them
    drift         way of a body from where it was at `Scene.settled`, m, at the end
    creep         the same over the second half of the run, m/s
    slip, slip_rate   drift and creep of the cube relative to the middle of the jaws
    joint_error   distance of the two anchors, or of the locked directions at 1 m: m
    energy_error  |E(t) - E(0)| as a share of the largest kinetic energy, by the velocities that the engine reports,
                  over the last tenth of the run
    energy_gain   the largest rise of E above an earlier value, as such a share
    error         distance from the exact motion, m: of centres of mass, and where the answer has orientations of the
                  points 0.1 m out on the axes
    natural_map   of the law of Signorini and Coulomb, m/s, median over the times at which there are contacts of the
                  largest over these, from the engine's own forces and the velocities at the end of the step:
                      |r - P(r - (u + e n)/w)| w,      P(s): s_n -> max(0, s_n), then |s_t| cut to mu times that
                  r impulse, u relative velocity, w the largest eigenvalue of its response to r; e = gap/dt where there
                  is a gap. Where bodies overlap, whatever speed parts them within the step is no error.
"""
import math
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Run:
    names: list                             # of the bodies, as in the scene
    times: np.ndarray
    poses: np.ndarray                       # times x bodies x 7: position, orientation w x y z
    velocities: np.ndarray                  # times x bodies x 6: linear, angular, world frame
    contacts: list = field(default_factory=list)    # a Contacts a time, where the engine tells forces
    dt: float = 0.005


@dataclass
class Contacts:
    """Contacts of one step. a and b: bodies. force: on b. places and turns: of all bodies, as the step was solved.
    velocities: at its end."""
    a: np.ndarray
    b: np.ndarray
    point: np.ndarray
    normal: np.ndarray                      # from a to b
    gap: np.ndarray
    friction: np.ndarray
    force: np.ndarray
    places: np.ndarray
    turns: np.ndarray
    velocities: np.ndarray


# ---- rotations ---------------------------------------------------------------------------------------------------

def matrices(q):
    """n x 3 x 3 of n x 4."""
    w, x, y, z = np.moveaxis(np.asarray(q, float), -1, 0)
    return np.stack([
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
        np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
        np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1)], -2)


# ---- overlaps ----------------------------------------------------------------------------------------------------

def box_box(xa, ra, ha, xb, rb, hb):
    """Overlap of pairs of boxes, negative: a lower bound of their distance. Arrays over pairs."""
    way = xb - xa
    # Nearly parallel edges: their cross product says nothing that the faces do not.
    crosses = np.cross(ra.transpose(0, 2, 1)[:, :, None, :], rb.transpose(0, 2, 1)[:, None, :, :]).reshape(-1, 9, 3)
    length = np.linalg.norm(crosses, axis=-1, keepdims=True)
    axes = np.concatenate([ra.transpose(0, 2, 1), rb.transpose(0, 2, 1), crosses / np.maximum(length, 1e-6)], 1)
    useful = np.concatenate([np.ones((len(way), 6), bool), length[..., 0] > 1e-6], 1)
    reach = (np.abs(np.einsum("pij,pki->pkj", ra, axes)) * ha[:, None]).sum(-1) \
        + (np.abs(np.einsum("pij,pki->pkj", rb, axes)) * hb[:, None]).sum(-1)
    along = reach - np.abs(np.einsum("pki,pi->pk", axes, way))
    return np.where(useful, along, np.inf).min(1)


def pairs_of(scene):
    """{kinds: n x 2 bodies} that may not overlap: all but those that cannot move and those that a joint connects."""
    jointed = {frozenset((joint.a, joint.b)) for joint in scene.joints}
    solid = [(k, body) for k, body in enumerate(scene.bodies) if body.shape is not None]
    pairs = {}
    for i, (a, first) in enumerate(solid):
        for b, second in solid[i + 1:]:
            if (first.mass or second.mass) and frozenset((first.name, second.name)) not in jointed:
                (k, kind), (m, other) = sorted(((a, first.shape.kind), (b, second.shape.kind)),
                                               key=lambda one: one[1] == "plane")  # the second, if either is
                pairs.setdefault((kind, other), []).append((k, m))
    return {kinds: np.array(found) for kinds, found in pairs.items()}


def overlap(scene, run):
    size = np.array([np.resize(body.shape.size, 3) if body.shape and body.shape.size else np.zeros(3)
                     for body in scene.bodies])
    deepest = 0.0
    for (kind, other), pairs in pairs_of(scene).items():
        for poses in run.poses:
            place, turns = poses[:, :3], matrices(poses[:, 3:])
            a, b = pairs.T
            if other == "plane":
                up = turns[b][:, :, 2]
                down = size[a, 0] if kind == "sphere" else (np.abs(np.einsum("pi,pij->pj", up, turns[a]))
                                                            * size[a]).sum(-1)
                depth = down - (up * (place[a] - place[b])).sum(-1)
            else:
                apart = np.linalg.norm(place[a] - place[b], axis=-1)
                if (kind, other) == ("sphere", "sphere"):
                    depth = size[a, 0] + size[b, 0] - apart
                elif (kind, other) == ("box", "box"):
                    near = apart < np.linalg.norm(size[a], axis=-1) + np.linalg.norm(size[b], axis=-1)
                    a, b = a[near], b[near]
                    depth = box_box(place[a], turns[a], size[a], place[b], turns[b], size[b])
                else:
                    raise ValueError(f"overlap of {kind} and {other}: not known")
            deepest = max(deepest, depth.max(initial=0))
    return deepest


# ---- measures ----------------------------------------------------------------------------------------------------

def moving(scene):
    return [k for k, body in enumerate(scene.bodies) if body.mass]


def way_from(scene, run, time):
    """How far each moving body is at the end from where it was at a time, m; and how long that took, s."""
    first = int(np.searchsorted(run.times, time - 1e-9))
    bodies = moving(scene)
    way = np.linalg.norm(run.poses[-1][bodies, :3] - run.poses[first][bodies, :3], axis=-1)
    return way.max(), run.times[-1] - run.times[first]


def drift(scene, run):
    return way_from(scene, run, scene.settled)[0]


def creep(scene, run):
    way, time = way_from(scene, run, (scene.settled + run.times[-1]) / 2)
    return way / time


def slip_from(run, time):
    first = int(np.searchsorted(run.times, time - 1e-9))
    cube, left, right = (run.names.index(name) for name in ("cube", "left", "right"))
    place = run.poses[:, cube, :3] - (run.poses[:, left, :3] + run.poses[:, right, :3]) / 2
    return np.linalg.norm(place[-1] - place[first]), run.times[-1] - run.times[first]


def slip(scene, run):
    return slip_from(run, scene.settled)[0]


def slip_rate(scene, run):
    way, time = slip_from(run, (scene.settled + run.times[-1]) / 2)
    return way / time


def joint_error(scene, run):
    start = {body.name: (np.array(body.position), matrices(body.orientation)) for body in scene.bodies}
    start[None] = np.zeros(3), np.eye(3)
    worst = 0.0
    for joint in scene.joints:
        now = []
        for name in (joint.a, joint.b):
            place, turn = start[name]
            anchor, axis = turn.T @ (np.array(joint.point) - place), turn.T @ np.array(joint.axis, float)
            if name is None:
                count = len(run.times)
                now.append((np.tile(anchor, (count, 1)), np.tile(axis, (count, 1)), np.tile(turn.T, (count, 1, 1))))
            else:
                poses = run.poses[:, run.names.index(name)]
                turns = matrices(poses[:, 3:])
                now.append((poses[:, :3] + turns @ anchor, turns @ axis, turns @ turn.T))
        (xa, axis_a, turn_a), (xb, axis_b, turn_b) = now
        way = xb - xa
        if joint.kind == "slider":
            way = way - (way * axis_a).sum(-1, keepdims=True) * axis_a
            worst = max(worst, np.linalg.norm(turn_a - turn_b, axis=(-2, -1)).max() / math.sqrt(2))
        if joint.kind == "hinge":
            worst = max(worst, np.linalg.norm(axis_a - axis_b, axis=-1).max())
        worst = max(worst, np.linalg.norm(way, axis=-1).max())
    return worst


def energies(scene, run):
    """Kinetic and total, J, at each time."""
    kinetic, height = np.zeros(len(run.times)), np.zeros(len(run.times))
    for k in moving(scene):
        body, turns = scene.bodies[k], matrices(run.poses[:, k, 3:])
        own = np.einsum("tij,ti->tj", turns, run.velocities[:, k, 3:])
        kinetic += 0.5 * body.mass * (run.velocities[:, k, :3] ** 2).sum(-1) + 0.5 * (own ** 2 @ np.array(body.inertia))
        height += body.mass * scene.gravity * run.poses[:, k, 2]
    return kinetic, kinetic + height


def energy_error(scene, run):
    kinetic, total = energies(scene, run)
    return np.abs(total - total[0])[-max(1, len(total) // 10):].max() / kinetic.max()


def energy_gain(scene, run):
    kinetic, total = energies(scene, run)
    return (total - np.minimum.accumulate(total)).max() / kinetic.max()


def error(scene, run):
    worst = 0.0
    for k, time in enumerate(run.times):
        for name, pose in scene.exact(time).items():
            own = run.poses[k, run.names.index(name)]
            worst = max(worst, np.linalg.norm(own[:3] - pose[:3]))
            if len(pose) == 7:
                turned = own[:3] - pose[:3] + 0.1 * (matrices(own[3:]) - matrices(pose[3:])).T
                worst = max(worst, np.linalg.norm(turned, axis=-1).max())
    return worst


def contact_errors(scene, contacts, dt):
    """Natural map of each contact, m/s."""
    c = contacts
    if not len(c.a):
        return np.zeros(0)
    response, u = np.zeros((len(c.a), 3, 3)), np.zeros((len(c.a), 3))
    for sign, side in ((-1, c.a), (1, c.b)):
        for k, body in enumerate(side):
            if body < 0:
                continue
            arm = c.point[k] - c.places[body]
            u[k] += sign * (c.velocities[body, :3] + np.cross(c.velocities[body, 3:], arm))
            if scene.bodies[body].mass:
                turn = matrices(c.turns[body])
                cross = np.cross(np.eye(3), arm)
                inverse = turn @ np.diag(1 / np.array(scene.bodies[body].inertia)) @ turn.T
                response[k] += np.eye(3) / scene.bodies[body].mass + cross @ inverse @ cross.T
    w = np.linalg.eigvalsh(response)[:, -1]
    u_n = (u * c.normal).sum(-1)
    e = np.where(c.gap > 0, c.gap / dt, -np.clip(u_n, 0, np.maximum(-c.gap, 0) / dt))
    r = c.force * dt
    r_n = (r * c.normal).sum(-1)
    r_t, u_t = r - r_n[:, None] * c.normal, u - u_n[:, None] * c.normal
    p_n = np.maximum(0, r_n - (u_n + e) / w)
    p_t = r_t - u_t / w[:, None]
    size = np.linalg.norm(p_t, axis=-1)
    p_t *= np.minimum(1, c.friction * p_n / np.maximum(size, 1e-300))[:, None]
    return np.sqrt((r_n - p_n) ** 2 + ((r_t - p_t) ** 2).sum(-1)) * w


def natural_map(scene, run):
    if not run.contacts:
        return None
    worst = [contact_errors(scene, contacts, run.dt).max() for contacts in run.contacts if len(contacts.a)]
    return np.median(worst) if worst else None


MEASURES = (overlap, drift, creep, slip, slip_rate, joint_error, energy_error, energy_gain, error, natural_map)
UNITS = {"overlap": "m", "drift": "m", "creep": "m/s", "slip": "m", "slip_rate": "m/s", "joint_error": "m",
         "energy_error": "1", "energy_gain": "1", "error": "m", "natural_map": "m/s"}


def judge(scene, run):
    """{measure: value} of what the scene asks for; None where the engine does not tell."""
    finite = bool(np.isfinite(run.poses).all())
    out = {}
    for measure in MEASURES:
        name = measure.__name__
        if name not in scene.judged:
            continue
        if not finite:
            out[name] = math.inf
        else:
            value = measure(scene, run)
            out[name] = None if value is None else float(value)
    return out
