"""Colliders as shapes, in the frame of the body that they are of (a prim's, without its scale; m)."""

import numpy as np

from ...decomposition import decompose, hull_of, volume_of
from ..poses import IDENTITY, inverse, mul, pose, q_matrix, q_of_matrix
from ..shapes import MOST_FILLING
from .materials import material_of
from .meshes import NoMesh, mesh_of, outline
from .stage import ALONG, one_of, value

#: Relative; up to here lengths are equal, and directions at right angles. Transforms may be of single precision.
SAME = 1e-5


def _axes(linear):
    """Rotation and lengths of a matrix whose columns are at right angles; None of another."""
    lengths = np.linalg.norm(linear, axis=0)
    if lengths.min() <= 0:
        raise ValueError("its scale is 0")
    turn = linear / lengths
    if np.abs(turn.T @ turn - np.eye(3)).max() > SAME:
        return None
    if np.linalg.det(turn) < 0:
        turn[:, 0] = -turn[:, 0]  # a mirror image along x: of what is along z, the same solid
    return q_of_matrix(turn), lengths


def _sphere(radius, linear):
    import subadmm as s

    u, sizes, _ = np.linalg.svd(linear)
    axes = _axes(linear)
    if sizes[0] - sizes[2] <= SAME * sizes[0]:
        return s.sphere(radius * sizes[0])
    if axes is not None:
        return s.ellipsoid(*(radius * axes[1]), orientation=axes[0])
    if np.linalg.det(u) < 0:
        u[:, 0] = -u[:, 0]
    return s.ellipsoid(*(radius * sizes), orientation=q_of_matrix(u))


def _box(half, linear):
    import subadmm as s

    axes = _axes(linear)
    if axes is not None:
        return s.box(*(half * axes[1]), orientation=axes[0])
    corners = half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return s.hull(corners @ linear.T)


def _round(reader, prim, make, bottom, top, half_height, caps, linear):
    """A capsule, cylinder or cone along z of `linear`, exactly where it is one, else as a polyhedron. make(radius, half
    height); caps: are the ends balls?"""
    axes = _axes(linear)
    if axes is not None and make is not None:
        (x, y, z), turn = axes[1], axes[0]
        if abs(x - y) <= SAME * max(x, y) and (not caps or abs(x - z) <= SAME * z):
            return make(bottom * (x + y) / 2, half_height * z, orientation=turn)
    reader.report.add(
        reader.element(prim), "is no round shape here, by its scale or its two radii: a polyhedron stands in"
    )
    return hull_of(outline(bottom, top, half_height, caps) @ linear.T)


def _gprim(reader, prim, linear):
    """The shape of a gprim other than a mesh, and None of one that is not known."""
    from pxr import UsdGeom

    import subadmm as s

    def get(name):
        return value(prim.GetAttribute(name))

    def along():
        return linear @ ALONG[one_of(prim.GetAttribute("axis"), ALONG)]

    if prim.IsA(UsdGeom.Sphere):
        return _sphere(get("radius"), linear)
    if prim.IsA(UsdGeom.Cube):
        return _box(get("size") / 2, linear)
    if prim.IsA(UsdGeom.Capsule):
        return _round(reader, prim, s.capsule, *[get("radius")] * 2, get("height") / 2, True, along())
    if prim.IsA(UsdGeom.Cylinder):
        return _round(reader, prim, s.cylinder, *[get("radius")] * 2, get("height") / 2, False, along())
    if prim.IsA(UsdGeom.Cone):
        return _round(reader, prim, s.cone, get("radius"), 0.0, get("height") / 2, False, along())
    for name, make, caps in (("Capsule_1", s.capsule, True), ("Cylinder_1", s.cylinder, False)):
        if prim.GetTypeName() == name:
            bottom, top = get("radiusBottom"), get("radiusTop")
            make = make if bottom == top else None
            return _round(reader, prim, make, bottom, top, get("height") / 2, caps, along())
    if prim.IsA(UsdGeom.Plane):
        frame = along()
        normal = np.linalg.inv(frame).T[:, 2]
        normal, x = normal / np.linalg.norm(normal), frame[:, 0] / np.linalg.norm(frame[:, 0])
        turn = np.stack([x, np.cross(normal, x), normal], axis=1)
        return s.plane(orientation=q_of_matrix(turn))
    return None


def _bounding_box(vertices, linear):
    """Along the prim's own axes."""
    import subadmm as s

    axes = _axes(linear)
    turn = axes[0] if axes is not None else IDENTITY[1]
    own = vertices @ q_matrix(turn)
    low, high = own.min(axis=0), own.max(axis=0)
    return s.box(*((high - low) / 2), position=q_matrix(turn) @ ((low + high) / 2), orientation=turn)


def _bounding_sphere(vertices):
    import subadmm as s

    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return s.sphere(np.linalg.norm(vertices - middle, axis=1).max(), position=middle)


def _hull(reader, prim, vertices, triangles, asked):
    """One hull; said so where it is not what was asked for, or much larger than the mesh."""
    from ... import mass_of

    shape = hull_of(vertices)
    if asked not in ("convexHull", "convexDecomposition"):
        reader.report.add(
            reader.element(prim),
            f"the convex hull stands in (approximation {asked!r}): bodies that move by forces are solids here "
            "(decompose=True: several hulls)",
        )
    elif asked == "convexHull":
        volume = volume_of(vertices, triangles)
        share = mass_of([shape], 1.0).mass / volume if volume and volume > 0 else 1.0
        if share > MOST_FILLING:
            reader.report.add(
                reader.element(prim), f"the convex hull, as the stage asks for, has {share:.2g} times its volume"
            )
    return [shape]


def _decomposed(reader, prim, vertices, triangles):
    """Several hulls, by coacd; one where that cannot be done, and the report says why."""
    from ... import Error
    from ...decomposition import THRESHOLD

    try:
        return decompose((vertices, triangles), THRESHOLD if reader.threshold is None else reader.threshold)
    except (ImportError, ValueError, Error) as error:
        if isinstance(error, ImportError) and reader.threshold is not None:
            raise  # asked for by the caller, not by the stage
        reader.report.add(reader.element(prim), f"is one hull, not several: {error}")
        return _hull(reader, prim, vertices, triangles, "convexDecomposition")


def _mesh(reader, prim, linear, kind):
    """Shapes of a Mesh by its approximation, made once for all that are equal; kind: of the body."""
    from pxr import UsdPhysics

    vertices, triangles = mesh_of(prim, linear)
    asked = "none"
    if prim.HasAPI(UsdPhysics.MeshCollisionAPI):
        asked = str(value(UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr()))
    key = vertices.tobytes(), triangles.tobytes(), linear.tobytes(), asked, kind
    if key not in reader.forms:
        reader.forms[key] = _approximated(reader, prim, linear, kind, asked, vertices, triangles)
    return [shape.copy() for shape in reader.forms[key]]


def _approximated(reader, prim, linear, kind, asked, vertices, triangles):
    import subadmm as s

    if asked == "boundingCube":
        return [_bounding_box(vertices, linear)]
    if asked == "boundingSphere":
        return [_bounding_sphere(vertices)]
    several = reader.threshold is not None and (kind == "dynamic" or (kind == "kinematic" and asked == "convexHull"))
    if asked == "convexDecomposition" or several:
        return _decomposed(reader, prim, vertices, triangles)
    if asked == "convexHull" or kind == "dynamic":
        return _hull(reader, prim, vertices, triangles, asked)
    if asked != "none":
        reader.report.add(reader.element(prim), f"approximation {asked!r} is not made: its triangles are as they are")
    return [s.mesh(vertices, triangles)]


def _rounded(linear):
    """To 9 digits: what is the same for several prims but for rounding (3 x 3 with their scale) is the same."""
    size = 2.0 ** np.ceil(np.log2(np.abs(linear).max() or 1.0))
    return np.round(linear / size, 9) * size + 0.0  # (no -0)


def shapes_of(reader, prim, body, kind):
    """Shapes of a collider in the frame of the prim `body`; none where it is not carried over, which the report says.
    kind: of the body."""
    from pxr import UsdGeom

    from ... import Error

    frame = reader.place(body)
    own = reader.place(prim)
    # The prim's frame, turned as the prim is but not scaled, keeps what the shapes are placed in at right angles.
    local = mul(inverse(frame), own)
    linear = _rounded(q_matrix(own[1]).T @ reader.linear(prim) * reader.metre)
    try:
        if prim.IsA(UsdGeom.Mesh):
            shapes = _mesh(reader, prim, linear, kind)
        else:
            shape = _gprim(reader, prim, linear)
            if shape is None:
                raise ValueError(f"a {prim.GetTypeName() or 'prim without a type'} is no collider that there is here")
            shapes = [shape]
        if kind != "static" and any(shape.type == "plane" for shape in shapes):
            raise ValueError("planes are of static bodies only")
        friction, restitution = material_of(reader, prim)
        for shape in shapes:
            place = mul(local, pose(shape.position, shape.orientation))
            shape.position, shape.orientation = place
            shape.friction, shape.restitution = friction, restitution
        return shapes
    except (Error, NoMesh, ValueError) as error:
        reader.report.add(reader.element(prim), f"not carried over: {error}")
        return []
