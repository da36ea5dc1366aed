"""What there is to draw of a world: meshes with instances on bodies, their colours, and where to look from."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..rotations import multiply, rotate
from .meshes import Mesh, form_of

# sRGB, 0 to 1. Bodies that joints hold together share a colour.
PALETTE = np.array([[217, 106, 74], [232, 176, 74], [110, 160, 98], [58, 140, 140], [78, 124, 186], [140, 104, 166],
                    [206, 98, 124], [198, 158, 116]]) / 255
STILL = np.array([176, 180, 186]) / 255
GROUND = np.array([222, 222, 220]) / 255


@dataclass
class Group:
    """Instances of one mesh. A point p of it is at body(position + rotate(orientation, scale * p))."""
    mesh: Mesh
    is_ground: bool
    body: np.ndarray          # n, rows of the world's arrays
    position: np.ndarray      # n x 3, m, in the body's frame
    orientation: np.ndarray   # n x 4, w x y z
    scale: np.ndarray         # n x 3
    colour: np.ndarray        # n x 3, sRGB, 0 to 1
    # n x 4: horizontal unit normal of a wall, away from the middle, and its place along it, m; 0: no wall
    wall: np.ndarray

    def part(self, which):
        """Some of the instances: n bool."""
        return Group(self.mesh, self.is_ground, *(values[which] for values in (
            self.body, self.position, self.orientation, self.scale, self.colour, self.wall)))

    def poses(self, positions, orientations):
        """(positions n x 3, orientations n x 4) in the world, of bodies' poses."""
        turn = orientations[self.body]
        return positions[self.body] + rotate(turn, self.position), multiply(turn, self.orientation)

    def corners(self, positions, orientations):
        """All triangles' corners in the world, n m x 3 x 3, and their normals."""
        place, turn = self.poses(positions, orientations)
        local = self.mesh.vertices[self.mesh.triangles].reshape(-1, 3)
        normal = self.mesh.corner_normals().reshape(-1, 3)
        at = rotate(turn[:, None], self.scale[:, None] * local[None]) + place[:, None]
        across = rotate(turn[:, None], normal[None] / self.scale[:, None])
        across /= np.linalg.norm(across, axis=-1, keepdims=True)
        return at.reshape(-1, 3, 3), across.reshape(-1, 3, 3)


@dataclass
class Description:
    """groups: list of Group; centre, radius: of a ball around what moves, m."""
    groups: list
    bodies: int
    dynamic: np.ndarray       # which bodies, bool
    centre: np.ndarray
    radius: float
    floor: float              # m, the highest ground plane under it, or the lowest point

    def hidden_from(self, eye):
        """For each group, n bool: walls between the eye and the middle, which a picture leaves out."""
        return [group.wall[:, :3].any(axis=1) & (group.wall[:, :3] @ eye > group.wall[:, 3]) for group in self.groups]


def _colours(world, bodies):
    """n x 3: one of the palette for each assembly of bodies, a little lighter or darker from body to body."""
    root = list(range(len(bodies)))

    def find(k):
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    still = np.array([body.type == "static" for body in bodies], dtype=bool)
    for joint in world.joints:
        a, b = joint.body_a, joint.body_b
        if a is not None and b is not None and not still[a.index] and not still[b.index]:
            a, b = find(a.index), find(b.index)
            root[max(a, b)] = min(a, b)
    first = np.array([find(k) for k in range(len(bodies))], dtype=np.uint64)
    # A mixing of the index, so that neighbours differ and a body has the same colour in every run.
    mixed = (first * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(40)
    colour = PALETTE[mixed % np.uint64(len(PALETTE))]
    own = (np.arange(len(bodies), dtype=np.uint64) * np.uint64(0xBF58476D1CE4E5B9)) >> np.uint64(48)
    colour = np.clip(colour * (0.92 + 0.16 * (own[:, None] / 65535.0)), 0, 1)
    colour[still] = STILL
    return colour


def describe(world: Any) -> Description:
    """What there is to draw of a world, as it is now."""
    bodies = world.bodies
    state = world.get("body_state")
    positions, turns = state[:, :3], state[:, 3:7]
    dynamic = np.array([body.type == "dynamic" for body in bodies], dtype=bool)
    colour = _colours(world, bodies)
    shapes = [(shape.body.index, shape.definition) for shape in world.shapes]
    shapes = [(row, shape) for row, shape in shapes if not shape.sensor]  # nobody sees them

    # How large what moves is, from the shapes' meshes; planes come afterwards, with a patch that fits.
    found = {}
    for row, shape in shapes:
        if shape.type != "plane":
            key, scale, make = form_of(shape)
            if key not in found:
                found[key] = (make(), [])
            found[key][1].append((row, shape.position, shape.orientation, scale))
    groups = [_group(mesh, parts, colour, False) for mesh, parts in found.values()]
    low, high = _extent(groups, positions, turns, dynamic)
    centre = (low + high) / 2
    radius = max(float(np.linalg.norm(high - low)) / 2, 1e-3)

    _find_walls(groups, positions, turns, dynamic, centre, radius)

    planes = [(row, shape) for row, shape in shapes if shape.type == "plane"]
    floor = float(low[2])
    if planes:
        patch = 12 * radius
        parts = []
        for row, shape in planes:
            _, scale, make = form_of(shape, patch)
            # The patch lies under what moves, wherever the plane's own origin is.
            turn = multiply(turns[row], np.array(shape.orientation))
            origin = positions[row] + rotate(turns[row], np.array(shape.position))
            normal = rotate(turn, np.array([0.0, 0.0, 1.0]))
            foot = centre - normal * np.dot(centre - origin, normal)
            back = turns[row] * [1, -1, -1, -1]
            parts.append((row, rotate(back, foot - positions[row]), shape.orientation, scale))
            if normal[2] > 0.9:
                floor = float(foot[2])
        groups.append(_group(make(), parts, np.tile(GROUND, (len(bodies), 1)), True))
    return Description(groups, len(bodies), dynamic, centre, radius, floor)


def _group(mesh, parts, colour, ground):
    body = np.array([part[0] for part in parts], dtype=np.int32)
    position, orientation, scale = (np.array([part[k] for part in parts], dtype=float) for k in (1, 2, 3))
    return Group(mesh, ground, body, position, orientation, scale, colour[body], np.zeros((len(parts), 4)))


def _find_walls(groups, positions, turns, dynamic, centre, radius):
    """Which still shapes stand beside what moves, wide and high, and would hide it."""
    for group in groups:
        still = np.nonzero(~dynamic[group.body])[0]
        place, turn = group.poses(positions, turns)
        for k in still:
            corners = rotate(turn[k], group.scale[k] * group.mesh.vertices) + place[k]
            low, high = corners.min(axis=0), corners.max(axis=0)
            away = np.clip(centre, low, high) - centre
            away[2] = 0
            length = np.linalg.norm(away)
            across = (high - low) @ np.abs([away[1], away[0], 0]) / max(length, 1e-300)
            if length > 0.2 * radius and across > radius and low[2] < centre[2] < high[2]:
                group.wall[k] = [*away / length, away @ centre / length + length]


def extent_of(description, positions, orientations):
    """(low, high): corners of a box around what moves at other poses."""
    groups = [group for group in description.groups if not group.is_ground]
    return _extent(groups, positions, orientations, description.dynamic)


def _extent(groups, positions, turns, dynamic):
    """Corners of an axis-parallel box around what moves, but for the outermost hundredth of the shapes; around all,
    where nothing moves."""
    for which in (dynamic, np.ones_like(dynamic)):
        lows, highs = [], []
        for group in groups:
            use = which[group.body]
            if not use.any():
                continue
            place, _ = group.poses(positions, turns)
            reach = np.linalg.norm(group.mesh.vertices[None] * group.scale[:, None], axis=-1).max(axis=1)[:, None]
            lows.append((place - reach)[use])
            highs.append((place + reach)[use])
        if lows:
            return np.quantile(np.concatenate(lows), 0.01, axis=0), np.quantile(np.concatenate(highs), 0.99, axis=0)
    return np.array([-1.0, -1, -1]), np.array([1.0, 1, 1])
