"""A camera that looks at a point."""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..given import point, real
from ..importing.model import LoadedModel, name_of
from ..importing.poses import mul, pose, q_matrix
from ..objects import no_such_name


_WIDER = 1.3    # pictures are, than high
_FILLED = 0.9   # share of a picture that what moves may take


@dataclass
class Camera:
    """eye, target: m, world frame, apart; field: vertical angle of view, rad, in [0.001, 3]; up: what is up in the
    picture, world frame, as far as it can be."""
    eye: Any
    target: Any
    field: float = 0.6
    up: Any = (0.0, 0.0, 1.0)

    def __post_init__(self):
        self.eye, self.target = point("eye", self.eye), point("target", self.target)
        self.up = point("up", self.up)
        self.field = real("field", self.field, 1e-3, 3)
        if not np.linalg.norm(self.eye - self.target) > 0:
            raise ValueError(f"eye: {self.eye}; must be apart from the target")

    def axes(self):
        """3 x 3, rows: to the right, up, and back to the viewer."""
        back = self.eye - self.target
        back = back / np.linalg.norm(back)
        right = np.cross(self.up, back)
        if np.linalg.norm(right) < 1e-6:
            right = np.cross([0.0, 1.0, 0.0] if abs(back[1]) < 0.9 else [0.0, 0.0, 1.0], back)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])


def check_place(azimuth, elevation, zoom, prefix=""):
    """(azimuth, elevation, zoom) as looking_at() takes them, or an error; prefix: of their names in it."""
    return (real(f"{prefix}azimuth", azimuth, -3600, 3600), real(f"{prefix}elevation", elevation, -89, 89),
            real(f"{prefix}zoom", zoom, 1e-3, 1e3))


def looking_at(description: Any, azimuth: float = -60.0, elevation: float = 24.0, zoom: float = 1.0,
               field: float = 0.6) -> Camera:
    """A camera that has what moves in view. azimuth, elevation: where it stands, degrees, in [-3600, 3600] and
    [-89, 89]; zoom: 2 comes twice as near, in [0.001, 1000]; field: as of Camera."""
    azimuth, elevation, zoom = check_place(azimuth, elevation, zoom)
    field = real("field", field, 1e-3, 3)
    across, up = np.radians([azimuth, elevation])
    direction = np.array([np.cos(across) * np.cos(up), np.sin(across) * np.cos(up), np.sin(up)])
    target = np.array(description.centre)
    distance = description.radius / np.tan(field / 2) * 0.95
    if getattr(description, "half", None) is not None:
        # All corners of the box are in a picture that is at least a little wider than high.
        corners = description.half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        view = corners @ Camera(target + direction, target, field).axes().T
        across = np.maximum(np.abs(view[:, 1]), np.abs(view[:, 0]) / _WIDER)
        distance = max(float((across / (_FILLED * np.tan(field / 2)) + view[:, 2]).max()), 0.3 * distance)
    return Camera(target + distance / zoom * direction, target, field)


def usual_camera(recording: Any) -> Camera:
    """A camera that has in view what moves, where it is on average over a recording."""
    from .description import extent_of

    boxes = [extent_of(recording.description, *recording.poses(k))
             for k in np.unique(np.linspace(0, len(recording.times) - 1, 9).astype(int))]
    low, high = np.mean(boxes, axis=0)
    return looking_at(replace(recording.description, centre=(low + high) / 2, half=(high - low) / 2,
                              radius=max(float(np.linalg.norm(high - low)) / 2, 1e-3)))


def camera_of(loaded: Any, name: str) -> Camera:
    """The camera of an MJCF file, where it is now. KeyError: the file has none of this name."""
    if not isinstance(loaded, LoadedModel):
        raise TypeError(f"camera: {name!r}; only MJCF files that were loaded have cameras with names")
    source = loaded.source
    names = [name_of(source, "camera", k) for k in range(source.ncam)]
    if name not in names:
        raise no_such_name("camera", name, names)
    k = names.index(name)
    place = mul(loaded.groups[int(source.cam_bodyid[k])].frame_in_world(int(source.cam_bodyid[k])),
                pose(source.cam_pos[k], source.cam_quat[k]))
    turn = q_matrix(place[1])
    return Camera(place[0], place[0] - turn[:, 2], float(np.clip(np.radians(source.cam_fovy[k]), 1e-3, 3)), turn[:, 1])
