"""Triangles of a UsdGeom.Mesh, and outlines of round gprims that are no round shapes here."""

import numpy as np

from .stage import one_of, value

SIDES = 32  # of the polyhedra that stand in for round gprims with an elliptical section, or two radii


class NoMesh(ValueError):
    """A mesh that cannot be used; the text says why."""


def mesh_of(prim, linear):
    """Vertices (n x 3, through `linear`) and triangles (m x 3, counter-clockwise seen from outside) of a Mesh."""
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(prim)
    points, counts, corners = (
        value(a) for a in (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    if not points or not counts or not corners:
        raise NoMesh("it has no points or no faces")
    points = np.array(points, dtype=np.float64)
    counts, corners = np.array(counts), np.array(corners)
    if counts.min() < 3 or counts.sum() != len(corners) or corners.min() < 0 or corners.max() >= len(points):
        raise NoMesh("its faces do not fit its points")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    kept = np.ones(len(counts), dtype=bool)
    holes = value(mesh.GetHoleIndicesAttr())
    if holes:
        kept[[h for h in holes if 0 <= h < len(counts)]] = False
    triangles = []
    for size in np.unique(counts[kept]):  # fans, faces of one size at a time
        first = starts[kept & (counts == size)]
        for k in range(1, size - 1):
            triangles.append(np.stack([corners[first], corners[first + k], corners[first + k + 1]], axis=1))
    if not triangles:
        raise NoMesh("all its faces are holes")
    triangles = np.concatenate(triangles).astype(np.int32)
    sides = UsdGeom.Tokens.rightHanded, UsdGeom.Tokens.leftHanded
    if (one_of(mesh.GetOrientationAttr(), sides) == UsdGeom.Tokens.leftHanded) != (np.linalg.det(linear) < 0):
        triangles = triangles[:, ::-1]
    return points @ linear.T, np.ascontiguousarray(triangles)


def _ring(radius, height):
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(SIDES, height)], axis=1)


def outline(bottom, top, half_height, caps):
    """Points whose hull is a cylinder, a cone or a capsule along z, roughly: radii at both ends; caps: balls there."""
    out = []
    for radius, height, side in ((bottom, -half_height, -1), (top, half_height, 1)):
        if radius == 0:
            out.append(np.array([[0.0, 0, height]]))
        elif not caps:
            out.append(_ring(radius, height))
        else:
            for angle in np.linspace(0, np.pi / 2, SIDES // 4 + 1)[:-1]:
                out.append(_ring(radius * np.cos(angle), height + side * radius * np.sin(angle)))
            out.append(np.array([[0.0, 0, height + side * radius]]))
    return np.concatenate(out)
