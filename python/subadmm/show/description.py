"""What there is to draw of a world: meshes with instances on bodies, their colours, and where to look from."""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._core import World
from ..given import real
from ..importing.model import Loaded
from ..rotations import multiply, rotate
from .colours import named_colour
from .meshes import Mesh, form_of
from .visuals import visuals_of

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
    body: np.ndarray          # n, rows of poses
    position: np.ndarray      # n x 3, m, in the body's frame
    orientation: np.ndarray   # n x 4, w x y z
    scale: np.ndarray         # n x 3
    colour: np.ndarray        # n x 3, sRGB, 0 to 1
    # n x 4: horizontal unit normal of a wall, away from the middle, and its place along it, m; 0: no wall
    wall: np.ndarray
    opacity: np.ndarray       # n, 0 to 1
    names: list               # n, of what it is in the file, or of the shape

    def part(self, which):
        """Some of the instances: n bool."""
        names = [name for name, use in zip(self.names, which) if use]
        return Group(self.mesh, self.is_ground, *(values[which] for values in (
            self.body, self.position, self.orientation, self.scale, self.colour, self.wall, self.opacity)), names)

    def poses(self, positions, orientations):
        """(positions n x 3, orientations n x 4) in the world, of bodies' poses."""
        turn = orientations[self.body]
        return positions[self.body] + rotate(turn, self.position), multiply(turn, self.orientation)

    def balls(self, positions, orientations):
        """(middles n x 3, radii n): of balls around the instances at bodies' poses, m."""
        if "_reach" not in vars(self):
            vertices = self.mesh.vertices
            self._middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
            self._reach = np.empty(len(self.scale))
            for scale in np.unique(self.scale, axis=0):
                of = (self.scale == scale).all(axis=1)
                self._reach[of] = np.linalg.norm((vertices - self._middle) * scale, axis=1).max(initial=0)
        place, turn = self.poses(positions, orientations)
        return place + rotate(turn, self.scale * self._middle), self._reach

    def tinted(self):
        """Colours n x 3 with what a texture makes of them on the whole, for what shows no textures."""
        return self.colour * self.mesh.tint


@dataclass
class Description:
    """groups: list of Group; centre, radius: of a ball around what moves, m."""
    groups: list
    bodies: int               # rows of poses: the world's bodies, and the world itself where something is fixed to it
    dynamic: np.ndarray       # which of them, bool
    centre: np.ndarray
    radius: float
    floor: float              # m, the highest ground plane under it, or the lowest point
    half: np.ndarray | None = None    # of a box around what moves, m; None: a ball
    fixed: int = 0            # rows that are no body's, at the end

    @property
    def count(self):
        """Bodies that there are."""
        return self.bodies - self.fixed

    def poses(self, state):
        """(positions, orientations) of the rows, of the array body_state of the world (n x 13)."""
        positions, orientations = state[:, :3], state[:, 3:7]
        if self.bodies > len(state):
            positions = np.concatenate([positions, np.zeros((1, 3))])
            orientations = np.concatenate([orientations, [[1.0, 0, 0, 0]]])
        return positions, orientations

    def hidden_from(self, eye):
        """For each group, n bool: walls between the eye and the middle, which a picture leaves out."""
        return [group.wall[:, :3].any(axis=1) & (group.wall[:, :3] @ eye > group.wall[:, 3]) for group in self.groups]


@dataclass
class Tiles(Description):
    """Copies of a Description. places: of each, m."""
    places: np.ndarray | None = None

    def poses(self, state):
        count = len(self.places)
        each = state.reshape(count, -1, state.shape[-1])
        parts = [Description([], self.bodies // count, None, None, 0, 0).poses(one) for one in each]
        return (np.concatenate([positions + place for (positions, _), place in zip(parts, self.places)]),
                np.concatenate([turns for _, turns in parts]))


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
    for row, body in enumerate(bodies):
        named = named_colour(body.name) if body.name else None
        if named is not None:
            colour[row] = named
    return colour


def world_of(source):
    """(the World of what is to be drawn, what load() returned or None). Raises TypeError."""
    if isinstance(source, World):
        return source, None
    if isinstance(source, Loaded):
        return source.world, source
    raise TypeError(f"world: {source!r}; must be a subadmm.World or what subadmm.load returned")


def describe(world: Any, collision: bool = False, reach: float = 12.0) -> Description:
    """What there is to draw of a world as it is now, or of what load() returned: of its file the visuals, or, where the
    file has none or with `collision`, the shapes that collide. reach: half the width of what is drawn of a plane, as a
    multiple of the radius of what moves, in [1, 1000]."""
    reach = real("reach", reach, 1, 1000)
    world, loaded = world_of(world)
    bodies = world.bodies
    state = world.get("body_state")
    rows = {body: k for k, body in enumerate(bodies)}
    colour = _colours(world, bodies)
    seen = visuals_of(loaded) if loaded is not None and not collision else []
    of_file = set()
    if seen:
        of_file = {shape for shapes in loaded.shapes.values() for shape in shapes}
    dynamic = [body.type == "dynamic" for body in bodies]
    named = [f"{body.name or f'body {k}'}" for k, body in enumerate(bodies)]

    # (key, make, plane?, row, position, orientation, scale, colour, opacity, name)
    parts = []
    for shape in world.shapes:
        definition = shape.definition
        if definition.sensor or shape in of_file:   # nobody sees sensors
            continue
        row = shape.body.index
        key, scale, make = form_of(definition)
        plane = definition.type == "plane"
        parts.append((key, make, plane, row, definition.position, definition.orientation, scale,
                      GROUND if plane else colour[row], 1.0, named[row]))
    count, fixed = len(bodies), False
    for one in seen:
        if one.body is not None and one.body not in rows:    # it was removed
            continue
        row = count if one.body is None else rows[one.body]
        fixed |= one.body is None
        own = one.colour
        if own is None:
            own = GROUND if one.is_plane else STILL if one.body is None else colour[row]
        parts.append((one.key, one.make, one.is_plane, row, one.position, one.orientation, one.scale, own, one.opacity,
                      one.name))
    if fixed:
        dynamic.append(False)
    dynamic = np.array(dynamic, dtype=bool)
    whole = Description([], count + fixed, dynamic, np.zeros(3), 1.0, 0.0, fixed=int(fixed))
    positions, turns = whole.poses(state)

    # How large what moves is, from the shapes' meshes; planes come afterwards, with a patch that fits.
    found = {}
    for part in parts:
        if not part[2]:
            if part[0] not in found:
                found[part[0]] = part[1](), []
            found[part[0]][1].append(part)
    groups = [_group(mesh, of, False) for mesh, of in found.values()]
    low, high = _extent(groups, positions, turns, dynamic)
    centre = (low + high) / 2
    radius = max(float(np.linalg.norm(high - low)) / 2, 1e-3)

    _find_walls(groups, positions, turns, dynamic, centre, radius)

    floor = float(low[2])
    patch = reach * radius
    for part in (part for part in parts if part[2]):
        _, make, _, row, position, orientation, _, own, opacity, name = part
        # The patch lies under what moves, wherever the plane's own origin is.
        turn = multiply(turns[row], np.array(orientation))
        origin = positions[row] + rotate(turns[row], np.array(position))
        normal = rotate(turn, np.array([0.0, 0.0, 1.0]))
        foot = centre - normal * np.dot(centre - origin, normal)
        back = turns[row] * [1, -1, -1, -1]
        mesh = make()
        if mesh.uv is not None:      # of a plane: repetitions a metre, from its own origin
            away = rotate(turn * [1, -1, -1, -1], foot - origin)
            mesh = replace(mesh, uv=(mesh.vertices[mesh.triangles][..., :2] * patch + away[:2]) * mesh.uv)
        groups.append(_group(mesh, [(None, None, True, row, rotate(back, foot - positions[row]), orientation,
                                     (patch, patch, 1.0), own, opacity, name)], True))
        if normal[2] > 0.9:
            floor = float(foot[2])
    return replace(whole, groups=groups, centre=centre, radius=radius, floor=floor, half=(high - low) / 2)


def tiled(description, count):
    """`count` copies side by side in a square; rows of poses are those of the first copy, then of the second ... The
    ground is there once. Its poses() puts each copy in its place."""
    if count <= 1:
        return description
    rows = description.bodies
    wide = int(np.ceil(np.sqrt(count)))
    pitch = 2.2 * description.radius
    k = np.arange(count)
    places = pitch * np.stack([k % wide - (wide - 1) / 2, (wide - 1) / 2 - k // wide, 0 * k], axis=1)
    groups = []
    for group in description.groups:
        if group.is_ground:
            groups.append(group)
            continue
        n = len(group.body)
        again = [np.tile(values, (count,) + (1,) * (values.ndim - 1)) for values in (
            group.position, group.orientation, group.scale, group.colour, group.wall, group.opacity)]
        body = np.tile(group.body, count) + rows * np.repeat(k, n).astype(np.int32)
        groups.append(Group(group.mesh, False, body.astype(np.int32), *again,
                            [f"{name} ({copy})" for copy in range(count) for name in group.names]))
    radius = float(np.linalg.norm([pitch * (wide - 1) / 2] * 2)) + description.radius
    return Tiles(groups, rows * count, np.tile(description.dynamic, count), description.centre, radius,
                 description.floor, fixed=count * description.fixed, places=places)


def _group(mesh, parts, ground):
    body = np.array([part[3] for part in parts], dtype=np.int32)
    position, orientation, scale, colour, opacity = (np.array([part[k] for part in parts], dtype=float)
                                                     for k in (4, 5, 6, 7, 8))
    return Group(mesh, ground, body, position, orientation, scale, colour, np.zeros((len(parts), 4)), opacity,
                 [part[9] for part in parts])


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
            place, reach = group.balls(positions, turns)
            lows.append((place - reach[:, None])[use])
            highs.append((place + reach[:, None])[use])
        if lows:
            return np.quantile(np.concatenate(lows), 0.01, axis=0), np.quantile(np.concatenate(highs), 0.99, axis=0)
    return np.array([-1.0, -1, -1]), np.array([1.0, 1, 1])
