"""Meshes as sets of convex hulls, by the package coacd (the extra `decompose` of the package)."""
from __future__ import annotations


from typing import Any

import numpy as np

from . import _core
from .given import indices, numbers, real, whole

#: Share of a mesh's size that its hulls may be off by, where nothing else is said: coacd's own default.
THRESHOLD = 0.05


def vertices_and_triangles(mesh):
    """Of a Shape that is a mesh or a hull, of a pair, or of an object with vertices and faces, as trimesh has them."""
    if isinstance(mesh, _core.Shape):
        geometry = mesh.geometry()
        if geometry is None:
            raise ValueError(f"mesh: a {mesh.type} has no triangles")
        vertices, triangles = geometry
    elif hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        vertices, triangles = mesh.vertices, mesh.faces
    elif isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        vertices, triangles = mesh
    else:
        raise TypeError(f"mesh: must be a Shape, a pair (vertices, triangles) or have vertices and faces; "
                        f"is {type(mesh).__name__}")
    vertices = numbers("mesh: vertices", vertices, 3)
    if not np.isfinite(vertices).all():
        raise ValueError("mesh: vertices: must be finite numbers")
    try:
        triangles = indices("triangles", triangles, len(vertices))
    except ValueError as error:
        raise ValueError(f"mesh: triangles must be of its vertices: {error}") from None
    if len(triangles) == 0:
        raise ValueError("mesh: triangles must be one at least")
    return vertices, triangles


def volume_of(vertices, triangles):
    """m^3, of what a mesh encloses; None of one that is not closed."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    # Closed: each edge is walked as often one way as the other. Corners at the same place are one.
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    edges = same.reshape(-1)[edges]
    there = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    back = np.unique(edges[edges[:, 0] != edges[:, 1]][:, ::-1], axis=0, return_counts=True)
    if not all(np.array_equal(a, b) for a, b in zip(there, back)):
        return None
    a, b, c = (vertices[triangles[:, k]] - vertices[0] for k in range(3))
    return float(np.sum(np.cross(a, b) * c)) / 6


def decompose(mesh: Any, threshold: float = THRESHOLD, *, most: int | None = None, seed: int = 0,
              **options: Any) -> list[Any]:
    """A mesh as a list of hull shapes that together are close to it, by coacd (pip install coacd).

    mesh: a Shape made by subadmm.mesh, a pair (vertices n x 3 in m, triangles m x 3), or an object with `vertices` and
    `faces` (trimesh). threshold: concavity that may remain, in [0.01, 1], as a share of the mesh's size; smaller ones
    make more hulls and take longer. most: hulls at most; None: no bound. seed: of coacd's search; the same seed, the
    same hulls. Other options are those of shapes (friction ...), given to all of them; those of `mesh`, where it is a
    Shape, stand in where none are given.

    Raises ImportError (no coacd), ValueError (arguments), subadmm.Error (a part that is no solid).
    """
    threshold = real("threshold", threshold, 0.01, 1)
    most = -1 if most is None else whole("most", most, 1, 2**31 - 1)
    seed = whole("seed", seed, 0, 2**31 - 1)
    vertices, triangles = vertices_and_triangles(mesh)
    try:
        import coacd
    except ImportError as error:
        raise ImportError("subadmm.decompose needs the package coacd: pip install coacd") from error
    coacd.set_log_level("error")
    parts = coacd.run_coacd(
        coacd.Mesh(vertices, triangles), threshold=threshold, max_convex_hull=most, seed=seed
    )
    if not parts:
        raise ValueError("mesh: coacd makes no parts of it")
    if isinstance(mesh, _core.Shape):
        own = ("position", "orientation", "friction", "restitution", "category", "mask")
        options = {name: getattr(mesh, name) for name in own} | options
    return [hull_of(points, **options) for points, _ in parts]


def hull_of(points, **options):
    """A hull, with coarser faces where it has too many corners, or none that fit a polyhedron."""
    from . import Error, hull

    try:
        return hull(points, **options)
    except Error:
        return hull(points, merge=1e-3, **options)
