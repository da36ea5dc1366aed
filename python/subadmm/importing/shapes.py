"""Geoms as shapes."""

import numpy as np

from .filters import MOST_CLASSES, MOST_PAIRS, Filter, friction_of
from .model import element, name_of
from .options import disabled
from .overlap import leave_out
from .poses import mul, pose


def _hull_points(source, mesh):
    """The corners of the convex hull that MuJoCo has of a mesh, or all vertices where it has none."""
    first = source.mesh_vertadr[mesh]
    vertices = np.array(source.mesh_vert[first : first + source.mesh_vertnum[mesh]], dtype=np.float64)
    graph = source.mesh_graphadr[mesh]
    if graph >= 0:
        count = source.mesh_graph[graph]
        begin = graph + 2 + count
        vertices = vertices[source.mesh_graph[begin : begin + count]]
    return vertices


def _heightfield(source, field):
    from .. import heightfield

    rows, columns = int(source.hfield_nrow[field]), int(source.hfield_ncol[field])
    x, y, top, _ = source.hfield_size[field]
    first = source.hfield_adr[field]
    heights = (
        np.array(source.hfield_data[first : first + rows * columns], dtype=np.float64).reshape(rows, columns) * top
    )
    return heightfield(heights, (2 * x / (columns - 1), 2 * y / (rows - 1)))


class Shapes:
    """Makes shapes of geoms; hulls once a mesh."""

    def __init__(self, source):
        self.source = source
        self._hulls = {}

    def _hull(self, mesh):
        from .. import Error, hull

        if mesh not in self._hulls:
            points = _hull_points(self.source, mesh)
            try:
                made = hull(points)
            except Error:  # too many corners, or none that fit a polyhedron: once more with coarser faces
                made = hull(points, merge=1e-3)
            self._hulls[mesh] = made
        return self._hulls[mesh].copy()

    def make(self, geom):
        """A Shape in its own frame. Raises subadmm.Error or ValueError."""
        import subadmm as s
        import mujoco

        g, size = mujoco.mjtGeom, [float(x) for x in self.source.geom_size[geom]]
        kind = g(int(self.source.geom_type[geom]))
        if kind == g.mjGEOM_PLANE:
            return s.plane()
        if kind == g.mjGEOM_SPHERE:
            return s.sphere(size[0])
        if kind == g.mjGEOM_CAPSULE:
            return s.capsule(size[0], size[1])
        if kind == g.mjGEOM_CYLINDER:
            return s.cylinder(size[0], size[1])
        if kind == g.mjGEOM_ELLIPSOID:
            return s.ellipsoid(*size)
        if kind == g.mjGEOM_BOX:
            return s.box(*size)
        if kind == g.mjGEOM_MESH:
            return self._hull(int(self.source.geom_dataid[geom]))
        if kind == g.mjGEOM_HFIELD:
            return _heightfield(self.source, int(self.source.geom_dataid[geom]))
        raise ValueError("its kind is none of those that there are here")


def add_shapes(loaded, data, overlaps):
    """Shapes on all bodies, and which of them meet. overlaps: of one mechanism, 'ignore' or 'keep'."""
    from .. import Error

    source, report, world = loaded.source, loaded.report, loaded.world
    if disabled(source, "CONTACT"):
        return
    chosen, makes, statics, owner = Filter(source), Shapes(source), {}, {}
    if chosen.crowded:
        report.add(
            "contype, conaffinity",
            f"more than {MOST_CLASSES} kinds of geoms: those of the last bit meet more than they should",
        )
    for geom in range(source.ngeom):
        if not chosen.touches(geom):
            continue
        index = int(source.geom_bodyid[geom])
        group = loaded.groups[index]
        at = mul(group.frame_in_body(index), pose(source.geom_pos[geom], source.geom_quat[geom]))
        try:
            shape = makes.make(geom)
            shape.position, shape.orientation = at
            shape.friction = 0.0 if source.geom_condim[geom] == 1 else float(source.geom_friction[geom, 0])
            shape.category, shape.mask = chosen.category(geom), chosen.mask(geom)
            if group.kind == "static":
                if index not in statics:
                    name = name_of(source, "body", index)
                    statics[index] = loaded.bodies[name] = world.add_body(type="static", environment=-1, name=name[:63])
                body = statics[index]
            else:
                body = group.body
            loaded.shapes[geom] = body.add_shape(shape)
            owner[geom] = body
        except (Error, ValueError) as error:
            report.add(element(source, "geom", geom), f"not carried over: {error}")
    _report_contact(loaded)
    ignored = _ignore(loaded, data, owner, statics, overlaps)
    _set_friction(loaded, chosen, owner, ignored)


def _report_contact(loaded):
    source, report = loaded.source, loaded.report
    geoms = list(loaded.shapes)

    def listed(what, mask):
        names = [name_of(source, "geom", g) for g in geoms if mask(g)]
        if names:
            more = f" and {len(names) - 8} more" if len(names) > 8 else ""
            report.add("geoms " + ", ".join(names[:8]) + more, what)

    listed("torsional and rolling friction (condim 4, 6) is not carried over", lambda g: source.geom_condim[g] > 3)
    listed("margin and gap are not carried over", lambda g: source.geom_margin[g] or source.geom_gap[g])
    listed("fluid forces are not carried over", lambda g: source.geom_fluid[g, 0])
    for name in ("geom_adhesion", "geom_surfacevel"):
        if hasattr(source, name):
            values = np.asarray(getattr(source, name))
            listed(f"{name[5:]} is not carried over", lambda g: np.any(values[g]))


def _ignore(loaded, data, owner, statics, overlaps):
    """Turn off contact between bodies that a joint ties, and those that the file leaves out. Returns the pairs of
    bodies."""
    source, report = loaded.source, loaded.report
    off = set()

    def ignore(a, b):
        if a is not None and b is not None and a != b and frozenset((a, b)) not in off:
            a.ignore(b)
            off.add(frozenset((a, b)))

    if not disabled(source, "FILTERPARENT"):
        for index, group in enumerate(loaded.groups):
            above = loaded.groups[source.body_parentid[index]]
            if group.root == index and index and above.kind != "static":
                ignore(group.body, above.body)
    touching = {index: [g for g in loaded.shapes if source.geom_bodyid[g] == index] for index in range(source.nbody)}
    for k in range(source.nexclude):
        ends = int(source.exclude_signature[k]) >> 16, int(source.exclude_signature[k]) & 0xFFFF
        groups = [loaded.groups[index] for index in ends]
        bodies = [statics.get(index) if group.kind == "static" else group.body for index, group in zip(ends, groups)]
        ignore(*bodies)
        for index, group in zip(ends, groups):
            if group.kind != "static" and any(touching[other] for other in group.members if other != index):
                report.add(
                    element(source, "exclude", k),
                    f"leaves out all that is fixed to {element(source, 'body', index)}, not that body alone",
                )
    if overlaps == "ignore":
        leave_out(loaded, data, lambda a, b: ignore(owner[a], owner[b]))
    return off


def _set_friction(loaded, chosen, owner, ignored):
    """Friction of pairs where the world's rule, the geometric mean, is not the file's."""
    source, report = loaded.source, loaded.report
    geoms = list(loaded.shapes)
    own = {g: 0.0 if source.geom_condim[g] == 1 else float(source.geom_friction[g, 0]) for g in geoms}
    same = {}
    for g in geoms:
        key = own[g], float(source.geom_friction[g, 0]), int(source.geom_priority[g]), int(source.geom_condim[g])
        same.setdefault(key, []).append(g)
    count = 0
    materials = list(same)
    for i, a in enumerate(materials):
        for b in materials[i:]:
            want = friction_of(source, same[a][0], same[b][0])
            if abs(np.sqrt(a[0] * b[0]) - want) <= 1e-12 * max(want, 1):
                continue
            for g in same[a]:
                for h in same[b]:
                    if owner[g] == owner[h] or not chosen.meet(g, h) or frozenset((owner[g], owner[h])) in ignored:
                        continue
                    if owner[g].type != "dynamic" and owner[h].type != "dynamic":
                        continue
                    count += 1
                    if count <= MOST_PAIRS:
                        loaded.shapes[g].set_pair_friction(loaded.shapes[h], want)
    if count > MOST_PAIRS:
        report.add("friction", f"of {count - MOST_PAIRS} pairs of geoms it is the geometric mean, not the larger one")
    for k in range(source.npair):
        g, h = int(source.pair_geom1[k]), int(source.pair_geom2[k])
        if g not in loaded.shapes or h not in loaded.shapes or owner[g] == owner[h]:
            report.add(element(source, "pair", k), "not carried over: its geoms are of one body, or not here")
        elif frozenset((owner[g], owner[h])) in ignored:
            report.add(element(source, "pair", k), "not carried over: contact of its bodies is left out")
        else:
            mu = 0.0 if source.pair_dim[k] == 1 else float(source.pair_friction[k, 0])
            loaded.shapes[g].set_pair_friction(loaded.shapes[h], mu)
            if source.pair_friction[k, 1] != source.pair_friction[k, 0] and source.pair_dim[k] > 1:
                report.add(element(source, "pair", k), "friction has no directions here: the first of the two is taken")
            if source.pair_margin[k] or source.pair_gap[k]:
                report.add(element(source, "pair", k), "margin and gap are not carried over")
            if source.pair_dim[k] > 3:
                report.add(element(source, "pair", k), "torsional and rolling friction is not carried over")
