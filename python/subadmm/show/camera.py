"""A camera that looks at a point."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..given import point, real


@dataclass
class Camera:
    """eye, target: m, world frame, apart; field: vertical angle of view, rad, in [0.001, 3]; z is up."""
    eye: np.ndarray
    target: np.ndarray
    field: float = 0.6

    def __post_init__(self):
        self.eye, self.target = point("eye", self.eye), point("target", self.target)
        self.field = real("field", self.field, 1e-3, 3)
        if not np.linalg.norm(self.eye - self.target) > 0:
            raise ValueError(f"eye: {self.eye}; must be apart from the target")

    def axes(self):
        """3 x 3, rows: to the right, up, and back to the viewer."""
        back = self.eye - self.target
        back = back / np.linalg.norm(back)
        right = np.cross([0.0, 0.0, 1.0], back)
        if np.linalg.norm(right) < 1e-6:
            right = np.array([1.0, 0.0, 0.0])
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
    distance = description.radius / np.tan(field / 2) * 0.95 / zoom
    target = np.array(description.centre)
    return Camera(target + distance * direction, target, field)
