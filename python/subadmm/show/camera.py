"""A camera that looks at a point."""
from dataclasses import dataclass

import numpy as np


@dataclass
class Camera:
    """eye, target: m, world frame; field: vertical angle of view, rad; z is up."""
    eye: np.ndarray
    target: np.ndarray
    field: float = 0.6

    def axes(self):
        """3 x 3, rows: to the right, up, and back to the viewer."""
        back = self.eye - self.target
        back = back / np.linalg.norm(back)
        right = np.cross([0.0, 0.0, 1.0], back)
        if np.linalg.norm(right) < 1e-6:
            right = np.array([1.0, 0.0, 0.0])
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])


def looking_at(description, azimuth=-60.0, elevation=24.0, zoom=1.0, field=0.6):
    """A camera that has what moves in view. azimuth, elevation: where it stands, degrees; zoom: 2 comes twice as
    near."""
    if not zoom > 0:
        raise ValueError(f"zoom: {zoom}; must be greater than 0")
    if not -89 <= elevation <= 89:
        raise ValueError(f"elevation: {elevation}; must be in [-89, 89] degrees")
    across, up = np.radians([azimuth, elevation])
    direction = np.array([np.cos(across) * np.cos(up), np.sin(across) * np.cos(up), np.sin(up)])
    distance = description.radius / np.tan(field / 2) * 0.95 / zoom
    target = np.array(description.centre)
    return Camera(target + distance * direction, target, field)
