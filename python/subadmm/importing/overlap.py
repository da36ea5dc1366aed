"""Bodies of one mechanism that overlap where they start.

MuJoCo's soft contacts bear links that are stuck in each other, say a hull around a bent link in the next one's. Hard
contacts and hard joints cannot both hold there, so contact of such pairs is left out, and reported."""

from .model import element

#: Least depth that counts, as a share of the mean size of the file's bodies.
LEAST_DEPTH = 0.01


def _one_mechanism(source, groups, a, b):
    """Do joints tie the bodies of the file a and b? (The static world ties only what is jointed to it there.)"""
    if groups[a].kind == "static" or groups[b].kind == "static":
        still, moving = (a, b) if groups[a].kind == "static" else (b, a)
        root = groups[moving].root
        if source.body_parentid[root] == still and source.jnt_type[source.body_jntadr[root]] != 0:
            return True
    return source.body_rootid[a] == source.body_rootid[b]


def overlapping(loaded, data):
    """Pairs of geoms (a, b, depth in m), of two bodies of one mechanism each, in the start state."""
    import mujoco

    source, groups = loaded.source, loaded.groups
    mujoco.mj_collision(source, data)
    least, deepest = LEAST_DEPTH * source.stat.meansize, {}
    for k in range(data.ncon):
        a, b = sorted(int(g) for g in (data.contact[k].geom[0], data.contact[k].geom[1]))
        depth = -float(data.contact[k].dist)
        if depth <= least or a not in loaded.shapes or b not in loaded.shapes:
            continue
        ends = int(source.geom_bodyid[a]), int(source.geom_bodyid[b])
        if groups[ends[0]] is not groups[ends[1]] and _one_mechanism(source, groups, *ends):
            deepest[a, b] = max(depth, deepest.get((a, b), 0.0))
    return [(a, b, depth) for (a, b), depth in deepest.items()]


def leave_out(loaded, data, ignore):
    """Call ignore(geom, geom) for one pair of geoms of each pair of bodies that overlap."""
    source, done = loaded.source, set()
    for a, b, depth in sorted(overlapping(loaded, data), key=lambda pair: -pair[2]):
        bodies = int(source.geom_bodyid[a]), int(source.geom_bodyid[b])
        if bodies in done:
            continue
        done.add(bodies)
        loaded.report.add(
            f"contact of {element(source, 'body', bodies[0])} and {element(source, 'body', bodies[1])}",
            f"left out: they overlap by {depth:.2g} m at the start, and belong to one mechanism",
        )
        ignore(a, b)
