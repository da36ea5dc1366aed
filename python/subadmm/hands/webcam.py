"""Hands before a camera, by mediapipe: its landmarks become the 21 joints, in m, in the world."""
from __future__ import annotations

import errno
import os
import time
from typing import Any, Iterator

import numpy as np

from ..given import point, real, whole
from ..rotations import rotate, unit
from .joints import JOINTS, SIDES

#: Of a camera before a user who looks to x: it looks back, to -x; its x is y, its y is down.
FACING = (0.5, -0.5, -0.5, 0.5)


def _mediapipe():
    try:
        import mediapipe
    except ImportError as error:
        raise ImportError("hands before a camera need mediapipe: pip install 'mediapipe>=0.10.9'") from error
    return mediapipe


def _landmarks(name, given, columns):
    out = np.asarray(given)
    if out.shape != (len(JOINTS), columns) or out.dtype.kind not in "iuf":
        raise TypeError(f"{name}: must be {len(JOINTS)} x {columns} numbers; is {out.dtype} of shape {out.shape}")
    if not np.isfinite(out).all():
        raise ValueError(f"{name}: must be finite numbers")
    return out.astype(float)


def in_camera(image: Any, shape: Any, width: int, height: int, field: float) -> np.ndarray:
    """21 x 3 joints, m, in the frame of a camera: x to the right of its picture, y down, z ahead.

    image: 21 x 2, where they are in the picture: 0 to 1 from its left and top (mediapipe's hand_landmarks); shape:
    21 x 3, m, in the camera's axes from any origin (its hand_world_landmarks); width, height: of the picture, pixels;
    field: its horizontal angle of view, rad, in [0.1, 3]. The hand is put where its shape, as it is turned, is seen at
    these places as nearly as can be. Raises TypeError, ValueError (out of range; no place before the camera is so)."""
    image, shape = _landmarks("image", image, 2), _landmarks("shape", shape, 3)
    width, height = whole("width", width, 1, 1 << 20), whole("height", height, 1, 1 << 20)
    focal = width / 2 / np.tan(real("field", field, 0.1, 3) / 2)
    seen = (image - 0.5) * [width, height]
    # focal (shape + place)_xy = seen (shape + place)_z, linear in the place: least squares.
    left, right = np.zeros((2 * len(JOINTS), 3)), np.empty(2 * len(JOINTS))
    for axis in (0, 1):
        rows = slice(axis, None, 2)
        left[rows, axis], left[rows, 2] = focal, -seen[:, axis]
        right[rows] = seen[:, axis] * shape[:, 2] - focal * shape[:, axis]
    place, _, rank, _ = np.linalg.lstsq(left, right, rcond=None)
    joints = shape + place
    if rank < 3 or not (joints[:, 2] > 0).all():
        raise ValueError("image: no place before the camera is seen so")
    return joints


class Tracker:
    """Joints of hands in the pictures of a camera. It needs the package mediapipe, and a file of its hand landmarker
    (.task), which mediapipe does not bring.

    model: the file; field: the camera's horizontal angle of view, rad, in [0.1, 3]; position, orientation: of the
    camera's frame (in_camera) in the world, m, w x y z; the default orientation is that of a camera before a user who
    looks to x. How far away a hand is follows from how large it looks: mediapipe takes hands to be of a usual size.
    Raises ImportError, FileNotFoundError, TypeError, ValueError."""

    def __init__(self, model: Any, *, field: float = 1.1, position: Any = (0, 0, 0), orientation: Any = FACING):
        self.field = real("field", field, 0.1, 3)
        self.position, orientation = point("position", position), point("orientation", orientation, 4)
        if not np.linalg.norm(orientation) > 1e-6:
            raise ValueError(f"orientation: {orientation}; must be a quaternion, not 0")
        self.orientation = unit(orientation)
        self._mediapipe = mediapipe = _mediapipe()
        if not os.path.isfile(model):
            raise FileNotFoundError(errno.ENOENT, "model: there is no such file of mediapipe's hand landmarker", model)
        vision = mediapipe.tasks.vision
        self._landmarker = vision.HandLandmarker.create_from_options(vision.HandLandmarkerOptions(
            base_options=mediapipe.tasks.BaseOptions(model_asset_path=os.fspath(model)),
            running_mode=vision.RunningMode.VIDEO, num_hands=2))
        self._last = -1

    def close(self) -> None:
        """Free what mediapipe holds."""
        self._landmarker.close()

    def track(self, picture: Any, seconds: float) -> dict[str, np.ndarray | None]:
        """{'left': joints or None, 'right': ...}, 21 x 3, m, world, of a picture (height x width x 3, uint8, RGB, not
        mirrored) of a time (s), in order. Of several hands of one side the one that is surest. Raises TypeError."""
        picture = np.asarray(picture)
        if picture.ndim != 3 or picture.shape[2] != 3 or picture.dtype != np.uint8:
            raise TypeError(f"picture: must be height x width x 3, uint8; is {picture.dtype} of shape {picture.shape}")
        mediapipe = self._mediapipe
        image = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=np.ascontiguousarray(picture))
        self._last = max(round(real("seconds", seconds, 0, 1e9) * 1000), self._last + 1)   # later ones only
        found = self._landmarker.detect_for_video(image, self._last)
        seen: dict[str, np.ndarray | None] = dict.fromkeys(SIDES)
        surest = dict.fromkeys(SIDES, 0.0)
        for sides, flat, shape in zip(found.handedness, found.hand_landmarks, found.hand_world_landmarks):
            side, score = sides[0].category_name.lower(), sides[0].score
            if side not in SIDES or score <= surest[side]:
                continue
            try:
                joints = in_camera([(mark.x, mark.y) for mark in flat], [(mark.x, mark.y, mark.z) for mark in shape],
                                   picture.shape[1], picture.shape[0], self.field)
            except ValueError:      # no hand is seen so
                continue
            seen[side], surest[side] = self.position + rotate(self.orientation, joints), score
        return seen

    def watch(self, device: int = 0) -> Iterator[tuple[float, dict[str, np.ndarray | None]]]:
        """(time, s, and what track() gives) of each picture of a camera of this machine, until it ends. Raises OSError
        where it cannot be opened."""
        import cv2      # comes with mediapipe

        camera = cv2.VideoCapture(whole("device", device, 0, 1000))
        try:
            if not camera.isOpened():
                raise OSError(errno.ENODEV, f"device: {device}; no camera can be opened there")
            begun = time.monotonic()
            while True:
                there, picture = camera.read()
                if not there:
                    return
                seconds = time.monotonic() - begun
                yield seconds, self.track(picture[:, :, ::-1], seconds)
        finally:
            camera.release()
