"""Pictures of a world without a window or a GPU: a rasteriser with a sun, its shadows and ambient occlusion."""
from __future__ import annotations

from typing import Any

import numpy as np

from .._core import World
from ..given import whole
from ..output import Output
from .camera import Camera, looking_at
from .description import describe
from .png import png_of
from .raster import rasterise

SUN = np.array([-0.42, -0.5, 0.76]) / np.linalg.norm([-0.42, -0.5, 0.76])   # towards it
_SUN_LIGHT = np.array([1.0, 0.95, 0.86]) * 0.82
_SKY_LIGHT = np.array([0.86, 0.93, 1.0]) * 0.62
_GROUND_LIGHT = np.array([0.92, 0.88, 0.82]) * 0.3
_BACKGROUND = np.array([0.93, 0.945, 0.965])
_SHADOW_PIXELS = 2048
_NEIGHBOURS = 28


def check_size(width, height, prefix=""):
    """(width, height) of a picture, or an error; prefix: of their names in it."""
    return whole(f"{prefix}width", width, 16, 8192), whole(f"{prefix}height", height, 16, 8192)


def picture(world: World, width: int = 960, height: int = 600, camera: Any = None, smooth: int = 2,
            description: Any = None) -> Any:
    """The world as it is now: height x width x 3, uint8, sRGB. The same world gives the same picture.

    width, height: in [16, 8192]; camera: Camera, or None: all that moves in view; smooth: samples along a pixel's side,
    1 to 4."""
    width, height = check_size(width, height)
    smooth = whole("smooth", smooth, 1, 4)
    if camera is not None and not isinstance(camera, Camera):
        raise TypeError(f"camera: {camera!r}; must be a Camera")
    description = description or describe(world)
    camera = camera or looking_at(description)
    state = world.get("body_state")
    corners, normals, colours, ground = _triangles(description, state[:, :3], state[:, 3:7],
                                                     description.hidden_from(camera.eye))

    wide, high = width * smooth, height * smooth
    axes = camera.axes()
    focal = high / 2 / np.tan(camera.field / 2)
    near = 1e-2 * description.radius
    corners, normals, colours, ground = _cut(corners, normals, colours, ground, camera.eye - near * axes[2], -axes[2])
    view = (corners - camera.eye) @ axes.T
    away = -view[..., 2]
    # Depth for the buffer: it has to be linear over the picture, and 1 - near / distance is.
    screen = np.stack([wide / 2 + focal * view[..., 0] / away, high / 2 - focal * view[..., 1] / away,
                       1 + 1e-6 - near / away], axis=-1)
    triangle, _ = rasterise(screen, wide, high)
    seen = triangle >= 0
    at = triangle[seen]

    # Where each sample is, and the shares of the corners there: from the ray, which knows no rounding of the depth.
    row, column = np.nonzero(seen)
    ray = (
        np.stack([(column + 0.5 - wide / 2) / focal, (high / 2 - row - 0.5) / focal, -np.ones(len(row))], axis=1) @ axes
    )
    a, b, c = corners[at, 0], corners[at, 1], corners[at, 2]
    across = np.cross(b - a, c - a)
    place = (
        camera.eye + ray * (np.einsum("ij,ij->i", a - camera.eye, across) / np.einsum("ij,ij->i", ray, across))[:, None]
    )
    square = np.einsum("ij,ij->i", across, across)
    share_b = np.einsum("ij,ij->i", np.cross(place - a, c - a), across) / square
    share_c = np.einsum("ij,ij->i", np.cross(b - a, place - a), across) / square
    shares = np.clip(np.stack([1 - share_b - share_c, share_b, share_c], axis=1), 0, 1)
    normal = np.einsum("ik,ikj->ij", shares, normals[at])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)

    lit = _sunlit(place, normal, across / np.sqrt(square)[:, None], corners, description)
    open_ = _openness(place, normal, seen, focal, camera, description.radius)
    linear = np.clip(colours[at], 0, 1) ** 2.2
    facing = np.clip(normal @ SUN, 0, None) * lit
    sky = 0.5 + 0.5 * normal[:, 2:]
    light = facing[:, None] * _SUN_LIGHT + (sky * _SKY_LIGHT + (1 - sky) * _GROUND_LIGHT) * open_[:, None]
    colour = linear * light
    backdrop = _BACKGROUND ** 2.2
    # The ground goes over into the backdrop far from what moves.
    far = np.linalg.norm(place[:, :2] - description.centre[:2], axis=1) / description.radius
    fade = (np.clip((far - 1.8) / 5, 0, 1) ** 0.8 * ground[at])[:, None]
    colour = colour * (1 - fade) + backdrop * fade

    image = np.empty((high, wide, 3))
    image[:] = backdrop
    image[seen] = colour
    image = image.reshape(height, smooth, width, smooth, 3).mean(axis=(1, 3))
    return np.clip(np.rint(np.clip(image, 0, 1) ** (1 / 2.2) * 255), 0, 255).astype(np.uint8)


def save_picture(path: Any, world: World, **options: Any) -> None:
    """Write picture(world, ...) as a PNG file, which is complete or as it was."""
    with Output("path", path) as file:
        file.write(png_of(picture(world, **options)))


def _triangles(description, positions, orientations, hidden):
    corners, normals, colours, ground = [], [], [], []
    for group, out in zip(description.groups, hidden):
        group = group.part(~out)
        at, across = group.corners(positions, orientations)
        corners.append(at)
        normals.append(across)
        colours.append(np.repeat(group.colour, len(group.mesh.triangles), axis=0))
        ground.append(np.full(len(at), group.is_ground))
    if not corners:
        return np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool)
    return np.concatenate(corners), np.concatenate(normals), np.concatenate(colours), np.concatenate(ground)


def _cut(corners, normals, colours, ground, point, direction):
    """Only what is in front of a plane: triangles that it goes through are cut."""
    beyond = (corners - point) @ direction
    front = beyond > 0
    whole = front.all(axis=1)
    new = []
    for t in np.nonzero(front.any(axis=1) & ~whole)[0]:
        polygon = []
        for k in range(3):
            n = (k + 1) % 3
            p, q = np.stack([corners[t, k], normals[t, k]]), np.stack([corners[t, n], normals[t, n]])
            if front[t, k]:
                polygon.append(p)
            if front[t, k] != front[t, n]:
                share = beyond[t, k] / (beyond[t, k] - beyond[t, n])
                polygon.append(p + (q - p) * share)
        new += [(t, np.stack([polygon[0], polygon[k], polygon[k + 1]])) for k in range(1, len(polygon) - 1)]
    if not new:
        return corners[whole], normals[whole], colours[whole], ground[whole]
    of = np.array([t for t, _ in new])
    parts = np.stack([part for _, part in new])
    return (np.concatenate([corners[whole], parts[:, :, 0]]), np.concatenate([normals[whole], parts[:, :, 1]]),
            np.concatenate([colours[whole], colours[of]]), np.concatenate([ground[whole], ground[of]]))


def _sunlit(place, normal, flat, corners, description):
    """Share of sunlight that comes to each place, by a shadow map with soft edges."""
    side = np.cross([0.0, 1.0, 0.0], SUN)
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(SUN, side), SUN])
    reach = 1.7 * description.radius
    scale = _SHADOW_PIXELS / (2 * reach)
    view = (corners - description.centre) @ axes.T
    depth = 20 * description.radius - view[..., 2]
    screen = np.stack(
        [_SHADOW_PIXELS / 2 + scale * view[..., 0], _SHADOW_PIXELS / 2 - scale * view[..., 1], depth], axis=-1
    )
    _, nearest = rasterise(screen, _SHADOW_PIXELS, _SHADOW_PIXELS)
    slope = np.clip(1 / np.maximum(flat @ SUN, 0.1), 1, 6)
    moved = place + flat * (1.2 * slope / scale)[:, None]
    at = (moved - description.centre) @ axes.T
    x, y = _SHADOW_PIXELS / 2 + scale * at[:, 0], _SHADOW_PIXELS / 2 - scale * at[:, 1]
    mine = 20 * description.radius - at[:, 2]
    lit = np.zeros(len(place))
    offsets = (-1.5, -0.5, 0.5, 1.5)
    for dx in offsets:
        for dy in offsets:
            column = np.clip(np.floor(x + dx), 0, _SHADOW_PIXELS - 1).astype(np.int64)
            row = np.clip(np.floor(y + dy), 0, _SHADOW_PIXELS - 1).astype(np.int64)
            lit += mine <= nearest[row, column] + 0.5 / scale
    lit /= len(offsets) ** 2
    outside = (x < 2) | (y < 2) | (x > _SHADOW_PIXELS - 2) | (y > _SHADOW_PIXELS - 2)
    lit[outside] = 1
    lit[normal @ SUN <= 0] = 0
    return lit


def _openness(place, normal, seen, focal, camera, radius):
    """Share of the sky that what is near leaves open, at each sample that is seen; 1: all.

    A neighbour in the picture covers sky as it stands above the tangent plane, and the less the farther away it is."""
    height, width = seen.shape
    at = np.full((height, width, 3), 1e6 * radius, np.float32)
    at[seen] = place - camera.target
    across = np.zeros((height, width, 3), np.float32)
    across[seen] = normal
    reach = np.float32(0.14 * radius)
    pixels = reach * focal / np.linalg.norm(camera.eye - camera.target)
    total = np.zeros((height, width), np.float32)
    for k in range(_NEIGHBOURS):
        # A spiral: as many neighbours near as far.
        far = max(pixels * ((k + 1) / _NEIGHBOURS) ** 1.5, 1.0)
        dx, dy = int(round(far * np.cos(2.4 * k))), int(round(far * np.sin(2.4 * k)))
        here, there = _overlap(height, dy), _overlap(height, -dy)
        here_x, there_x = _overlap(width, dx), _overlap(width, -dx)
        toward = at[there, there_x] - at[here, here_x]
        square = np.einsum("ijk,ijk->ij", toward, toward) + np.float32(1e-6) * reach * reach
        above = np.einsum("ijk,ijk->ij", toward, across[here, here_x]) / np.sqrt(square)
        total[here, here_x] += np.clip(above - np.float32(0.1), 0, 1) * np.clip(1 - square / (reach * reach), 0, 1)
    return np.clip(1 - 2.6 * total[seen] / _NEIGHBOURS, 0.2, 1)


def _overlap(size, step):
    """Of an axis of the picture: the part from which `step` farther on is still inside."""
    return slice(max(-step, 0), size - max(step, 0))
