"""Bodies of one mechanism that overlap where they start.

MuJoCo's soft contacts bear links that are stuck in each other, say a hull around a bent link in the next one's. Hard
contacts and hard joints cannot both hold there, so contact of such pairs is left out, and reported."""

import numpy as np

from .model import element

#: Least depth that counts, as a share of the mean size of the file's bodies.
LEAST_DEPTH = 0.01
#: m: of bodies that no joint can part; the depth that contacts leave alone.
LEAST_HELD = 1e-5
#: m a unit of a joint's speed: less is rounding.
LEAST_MOTION = 1e-9


def _one_mechanism(source, groups, a, b):
    """Do joints tie the bodies of the file a and b? (The static world ties only what is jointed to it there.)"""
    if groups[a].kind == "static" or groups[b].kind == "static":
        still, moving = (a, b) if groups[a].kind == "static" else (b, a)
        root = groups[moving].root
        if source.body_parentid[root] == still and source.jnt_type[source.body_jntadr[root]] != 0:
            return True
    return source.body_rootid[a] == source.body_rootid[b]


def _depth(loaded, a, b, of_hulls):
    """Of two geoms, m: MuJoCo's, or where one is several hulls here, of those."""
    one, other = loaded.shapes[a], loaded.shapes[b]
    if len(one) == len(other) == 1 or of_hulls <= 0:
        return of_hulls
    return max(-loaded.world.closest_points(x, y)["distance"] for x in one for y in other)


def _is_held(source, data, contact, a, b):
    """Is it so that no joint moves the two bodies along the contact's normal? Nothing can part them then."""
    import mujoco

    rows = np.zeros((2, 3, source.nv))
    for row, body in zip(rows, (a, b)):
        mujoco.mj_jac(source, data, row, None, contact.pos, body)
    return np.abs(contact.frame[:3] @ (rows[1] - rows[0])).max(initial=0) < LEAST_MOTION


def overlapping(loaded, data):
    """Pairs of bodies that overlap in the start state, deepest first: (body, body, depth in m, a geom of each)."""
    import mujoco

    source, groups = loaded.source, loaded.groups
    mujoco.mj_collision(source, data)
    deepest = {}
    for k in range(data.ncon):
        a, b = (int(g) for g in data.contact[k].geom)
        if a not in loaded.shapes or b not in loaded.shapes:
            continue
        depth = _depth(loaded, a, b, -float(data.contact[k].dist))
        bodies = int(source.geom_bodyid[a]), int(source.geom_bodyid[b])
        if depth <= LEAST_HELD:
            continue
        if depth <= LEAST_DEPTH * source.stat.meansize and not _is_held(source, data, data.contact[k], *bodies):
            continue
        (one, a), (other, b) = sorted(((int(source.geom_bodyid[a]), a), (int(source.geom_bodyid[b]), b)))
        if groups[one] is not groups[other] and depth > deepest.get((one, other), (0.0,))[0]:
            deepest[one, other] = depth, a, b
    return sorted(((*bodies, *found) for bodies, found in deepest.items()), key=lambda pair: -pair[2])


def leave_out(loaded, data, ignore):
    """Call ignore(geom, geom) for each pair of bodies of one mechanism that overlap. Report all that do."""
    source = loaded.source
    for one, other, depth, a, b in overlapping(loaded, data):
        what = f"contact of {element(source, 'body', one)} and {element(source, 'body', other)}"
        if _one_mechanism(source, loaded.groups, one, other):
            loaded.report.add(what, f"left out: they overlap by {depth:.2g} m at the start, and are of one mechanism")
            ignore(a, b)
        else:
            loaded.report.add(what, f"they overlap by {depth:.2g} m at the start")
