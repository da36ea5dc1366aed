"""Triangle meshes of shapes: closed, counter-clockwise seen from outside, in the frame of the shape, in m."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import Shape, hull
from ..given import real, whole

#: Corners around a round shape, and twice those from pole to pole.
DETAIL = 24


@dataclass
class Mesh:
    """vertices: n x 3, m; triangles: m x 3 indices. Vertices are shared by the triangles that meet there.

    Where it has a texture: uv: m x 3 x 2, of the triangles' corners, v down from the image's uppermost row;
    image: height x width x 3, uint8, sRGB."""
    vertices: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray | None = None
    image: np.ndarray | None = None

    def scaled(self, scale):
        """The same, its axes multiplied by three positive numbers."""
        return Mesh(self.vertices * np.asarray(scale, float), self.triangles, self.uv, self.image)

    @property
    def tint(self):
        """What a texture multiplies colours by, sRGB, 0 to 1, on the whole; 1 without one."""
        if self.image is None:
            return np.ones(3)
        return ((self.image.reshape(-1, 3) / 255.0) ** 2.2).mean(axis=0) ** (1 / 2.2)

    def volume(self):
        """m^3, of a closed mesh."""
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)

    def is_closed(self):
        """Has every edge of a triangle exactly one other triangle, which runs along it the other way?"""
        edges = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        there = {tuple(edge) for edge in edges.tolist()}
        return len(there) == len(edges) and all((b, a) in there for a, b in there)

    def triangle_normals(self):
        """Unit normals, m x 3; 0 where a triangle has no area."""
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return _unit(np.cross(b - a, c - a))

    def corner_normals(self, crease=0.6):
        """Unit normals of all triangles' corners, m x 3 x 3: the mean over the triangles at a vertex that are turned by
        less than `crease` (rad), so that round shapes look round and edges stay edges."""
        count = len(self.triangles)
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)                             # as long as the area: large triangles count more
        normal = _unit(across)
        at = self.triangles.reshape(-1)
        order = np.argsort(at, kind="stable")
        size = np.bincount(at, minlength=len(self.vertices))
        first = np.concatenate([[0], np.cumsum(size)[:-1]])
        # Every corner with every corner at the same vertex.
        pairs = size[at]
        corner = np.repeat(np.arange(3 * count), pairs)
        step = np.arange(len(corner)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
        other = order[np.repeat(first[at], pairs) + step] // 3
        near = np.einsum("ij,ij->i", normal[corner // 3], normal[other]) > np.cos(crease)
        total = np.zeros((3 * count, 3))
        for k in range(3):
            total[:, k] = np.bincount(corner[near], across[other[near], k], 3 * count)
        alone = ~total.any(axis=1)
        total[alone] = normal[np.nonzero(alone)[0] // 3]
        return _unit(total).reshape(count, 3, 3)

    def split(self, crease=0.6):
        """The same triangles; vertices that have different normals are vertices of their own, so that the mean of the
        normals at each of them is that of corner_normals."""
        normal = np.rint(self.corner_normals(crease).reshape(-1, 3) * 1000).astype(np.int64)
        rows = np.column_stack([self.triangles.reshape(-1), normal])
        kept, which = np.unique(rows, axis=0, return_inverse=True)
        return Mesh(self.vertices[kept[:, 0]], which.reshape(-1, 3).astype(np.int32))


def _unit(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def _turned(profile, around):
    """The profile (radius, z), which begins and ends on the z axis and goes up, turned about it."""
    radius, z = np.asarray(profile, float)[1:-1].T
    angle = 2 * np.pi * np.arange(around) / around
    rings = np.stack([radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle),
                      np.repeat(z[:, None], around, 1)], axis=-1)
    vertices = np.concatenate([[[0, 0, profile[0][1]]], rings.reshape(-1, 3), [[0, 0, profile[-1][1]]]])
    here = np.arange(around)
    after = (here + 1) % around
    triangles = [np.stack([0 * here, 1 + after, 1 + here], axis=1)]
    for ring in range(len(z) - 1):
        low, high = 1 + ring * around, 1 + (ring + 1) * around
        triangles += [np.stack([low + here, low + after, high + after], axis=1),
                      np.stack([low + here, high + after, high + here], axis=1)]
    last = 1 + (len(z) - 1) * around
    triangles.append(np.stack([last + here, last + after, 0 * here + len(vertices) - 1], axis=1))
    return Mesh(vertices, np.concatenate(triangles).astype(np.int32))


def _arc(detail, below, above):
    """Half a circle of radius 1 from pole to pole; its halves moved along z by `below` and `above`."""
    half = max(detail // 4, 2)
    angle = np.linspace(-np.pi / 2, 0, half + 1)
    low = np.stack([np.cos(angle), np.sin(angle) + below], axis=1)
    high = np.stack([np.cos(angle), -np.sin(angle) + above], axis=1)[::-1]
    profile = np.concatenate([low, high[1:] if below == above else high])
    profile[[0, -1], 0] = 0
    return profile


def _box():
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return Mesh(corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32))


def _patch():
    return Mesh(
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    )


def _rounded(vertices, radius, detail):
    """The hull of balls around vertices: what is within the radius of a polyhedron."""
    ball = _turned(_arc(detail, 0, 0), detail).vertices
    return Mesh(*hull((vertices[:, None] + radius * ball[None]).reshape(-1, 3), merge=0).geometry())


def form_of(shape: Shape, patch=10.0, detail=DETAIL):
    """(key, scale, make): shapes of the same key are one mesh, make(), each with a scale of its own along its axes.

    patch: half the width of what is drawn of a plane, m."""
    kind, size = shape.type, np.array(shape.size)
    one = np.ones(3)
    if kind == "plane":
        return ("plane",), np.array([patch, patch, 1.0]), _patch
    if kind == "box":
        return ("box",), size, _box
    if kind in ("sphere", "ellipsoid"):
        scale = one * size[0] if kind == "sphere" else size
        return ("ball", detail), scale, lambda: _turned(_arc(detail, 0, 0), detail)
    if kind in ("cylinder", "cone"):
        top = [[1, 1], [0, 1]] if kind == "cylinder" else [[0, 1]]
        scale = np.array([size[0], size[0], size[1]])
        return (kind, detail), scale, lambda: _turned([[0, -1], [1, -1]] + top, detail)
    if kind == "capsule":
        length = size[1] / size[0]
        return (kind, detail, length), one * size[0], lambda: _turned(_arc(detail, -length, length), detail)
    if kind in ("hull", "mesh"):
        vertices, triangles = shape.geometry()
        convex_radius = shape.convex_radius
        key = (kind, vertices.tobytes(), triangles.tobytes(), convex_radius)
        if convex_radius > 0:
            return key, one, lambda: _rounded(vertices, convex_radius, max(detail // 2, 8))
        return key, one, lambda: Mesh(vertices, triangles)
    raise ValueError(f"shape: there is no mesh of type {kind}")


def mesh_of(shape: Shape, patch=10.0, detail=DETAIL) -> Mesh:
    """The mesh of a shape, in its own frame (its position and orientation are left out).

    patch: half the width of what is drawn of a plane, m, in (0, 1e9]; detail: corners around a round shape, in
    [8, 1024]. Round shapes are inscribed: their corners are on the surface."""
    patch, detail = real("patch", patch, 0, 1e9, above=True), whole("detail", detail, 8, 1024)
    _, scale, make = form_of(shape, patch, detail)
    return make().scaled(scale)
