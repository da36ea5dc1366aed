"""Geoms as shapes."""

import numpy as np

from ..decomposition import decompose, hull_of, volume_of
from .filters import MOST_CLASSES, MOST_PAIRS, Filter, friction_of
from .model import element, name_of, world_name
from .options import disabled
from .overlap import leave_out
from .poses import mul, pose

#: Volume of a hull over the mesh's, up to which the report says nothing.
MOST_FILLING = 1.1


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


def _mesh(source, mesh):
    """Vertices and triangles of a mesh."""
    first, begin = source.mesh_vertadr[mesh], source.mesh_faceadr[mesh]
    vertices = source.mesh_vert[first : first + source.mesh_vertnum[mesh]]
    return np.array(vertices, dtype=np.float64), source.mesh_face[begin : begin + source.mesh_facenum[mesh]]


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
    """Makes shapes of geoms; hulls once a mesh. threshold: of meshes that are to be several hulls (decompose)."""

    def __init__(self, source, threshold=None):
        self.source = source
        self.threshold = threshold
        self._hulls, self._parts, self._shares = {}, {}, {}
        self.failed = {}  # meshes that are one hull because they could not be made several: why

    def _hull(self, mesh):
        if mesh not in self._hulls:
            self._hulls[mesh] = hull_of(_hull_points(self.source, mesh))
        return self._hulls[mesh].copy()

    def _several(self, mesh):
        from .. import Error

        if mesh not in self._parts:
            try:
                self._parts[mesh] = decompose(_mesh(self.source, mesh), self.threshold)
            except (Error, ValueError) as error:
                self.failed[mesh] = str(error)
                self._parts[mesh] = [self._hull(mesh)]
        return [part.copy() for part in self._parts[mesh]]

    def filling(self, geom):
        """Volume of a mesh's hull over the mesh's own; 1 of other geoms, and of meshes that are not closed."""
        from .. import mass_of

        mesh = int(self.source.geom_dataid[geom])
        if mesh not in self._hulls:
            return 1.0
        if mesh not in self._shares:
            volume = volume_of(*_mesh(self.source, mesh)) or 0.0
            whole = mass_of([self._hulls[mesh]], 1.0).mass
            self._shares[mesh] = whole / volume if volume > 1e-6 * whole else 1.0
        return self._shares[mesh]

    def make(self, geom, moves):
        """Its shapes, in their own frame: one, but for meshes of bodies that move. Raises subadmm.Error or
        ValueError."""
        import subadmm as s
        import mujoco

        g, size = mujoco.mjtGeom, [float(x) for x in self.source.geom_size[geom]]
        kind = g(int(self.source.geom_type[geom]))
        if kind == g.mjGEOM_PLANE:
            return [s.plane()]
        if kind == g.mjGEOM_SPHERE:
            return [s.sphere(size[0])]
        if kind == g.mjGEOM_CAPSULE:
            return [s.capsule(size[0], size[1])]
        if kind == g.mjGEOM_CYLINDER:
            return [s.cylinder(size[0], size[1])]
        if kind == g.mjGEOM_ELLIPSOID:
            return [s.ellipsoid(*size)]
        if kind == g.mjGEOM_BOX:
            return [s.box(*size)]
        if kind == g.mjGEOM_MESH:
            mesh = int(self.source.geom_dataid[geom])
            return self._several(mesh) if moves and self.threshold is not None else [self._hull(mesh)]
        if kind == g.mjGEOM_HFIELD:
            return [_heightfield(self.source, int(self.source.geom_dataid[geom]))]
        raise ValueError("its kind is none of those that there are here")


def add_shapes(loaded, data, overlaps, threshold):
    """Shapes on all bodies, and which of them meet. overlaps: of one mechanism, 'ignore' or 'keep'; threshold: as of
    Shapes."""
    from .. import Error

    source, report, world = loaded.source, loaded.report, loaded.world
    if disabled(source, "CONTACT"):
        return
    chosen, makes, statics, owner = Filter(source), Shapes(source, threshold), {}, {}
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
            shapes = makes.make(geom, group.kind != "static")
            for shape in shapes:
                shape.position, shape.orientation = at
                shape.friction = 0.0 if source.geom_condim[geom] == 1 else float(source.geom_friction[geom, 0])
                shape.category, shape.mask = chosen.category(geom), chosen.mask(geom)
            if group.kind == "static":
                if index not in statics:
                    name = name_of(source, "body", index)
                    statics[index] = loaded.bodies[name] = world.add_body(
                        type="static", environment=-1, name=world_name(name)
                    )
                body = statics[index]
            else:
                body = group.body
            loaded.shapes[geom] = [body.add_shape(shape) for shape in shapes]
            owner[geom] = body
        except (Error, ValueError) as error:
            report.add(element(source, "geom", geom), f"not carried over: {error}")
    _report_contact(loaded)
    _report_hulls(loaded, makes)
    ignored = _ignore(loaded, data, owner, statics, overlaps)
    _set_friction(loaded, chosen, owner, ignored)


def _named(source, geoms):
    """As reports name several geoms."""
    names = [name_of(source, "geom", g) for g in geoms]
    return "geoms " + ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")


def _report_hulls(loaded, makes):
    """Meshes of moving bodies that their hulls are much larger than."""
    source = loaded.source
    for mesh, reason in makes.failed.items():
        loaded.report.add(element(source, "mesh", mesh), f"is one hull, not several: {reason}")
    moving = [g for g in loaded.shapes if loaded.groups[int(source.geom_bodyid[g])].kind != "static"]
    hollow = [g for g in moving if len(loaded.shapes[g]) == 1 and makes.filling(g) > MOST_FILLING]
    if hollow:
        most = max(makes.filling(g) for g in hollow)
        loaded.report.add(
            _named(source, hollow),
            f"the convex hull of each mesh stands in, as in MuJoCo: up to {most:.2g} times its volume "
            "(decompose=True: several hulls)",
        )


def _report_contact(loaded):
    source, report = loaded.source, loaded.report
    geoms = list(loaded.shapes)

    def listed(what, mask):
        named = [g for g in geoms if mask(g)]
        if named:
            report.add(_named(source, named), what)

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


def _set_pair(loaded, g, h, friction):
    for one in loaded.shapes[g]:
        for other in loaded.shapes[h]:
            one.set_pair_friction(other, friction)


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
                        _set_pair(loaded, g, h, want)
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
            _set_pair(loaded, g, h, mu)
            if source.pair_friction[k, 1] != source.pair_friction[k, 0] and source.pair_dim[k] > 1:
                report.add(element(source, "pair", k), "friction has no directions here: the first of the two is taken")
            if source.pair_margin[k] or source.pair_gap[k]:
                report.add(element(source, "pair", k), "margin and gap are not carried over")
            if source.pair_dim[k] > 3:
                report.add(element(source, "pair", k), "torsional and rolling friction is not carried over")
