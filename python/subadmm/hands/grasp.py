"""Hands by how far they are open: what a controller's trigger stands for, and recordings that are made up."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..given import point, real
from ..rotations import rotate, unit
from .joints import check_side

#: How far thumb and fingers may be apart, m.
WIDEST = 0.1
# Of a right hand, m: x to where the fingers point, y to the index finger's side, z out of the back of the hand.
_GRIP = np.array([0.098, 0.0, -0.055])       # the middle between the tips of thumb and fingers, from the wrist
_THUMB = np.array([0.02, 0.025, -0.015])     # its root
_THUMB_BONES = (0.055, 0.046, 0.028)
_KNUCKLES = np.array([[0.09, 0.03, 0], [0.092, 0.01, 0], [0.088, -0.01, 0], [0.082, -0.03, 0]])
_BONES = ((0.045, 0.028, 0.022), (0.048, 0.03, 0.023), (0.045, 0.028, 0.022), (0.046, 0.032, 0.021))
_LAST = np.array([0.0, 0.0, -1.0])           # the last bones point downwards: pads face each other


def _bent(root, bones, tip, bow):
    """Two joints between root and tip, and the tip: the last bone points downwards, the two before, which have to be
    long enough together, bow towards `bow`."""
    end = tip - bones[2] * _LAST
    way = end - root
    distance = np.linalg.norm(way)
    way = way / distance
    along = (bones[0] ** 2 - bones[1] ** 2 + distance ** 2) / (2 * distance)
    off = np.sqrt(bones[0] ** 2 - along ** 2)
    outward = bow - way * (way @ bow)
    return [root + along * way + off * outward / np.linalg.norm(outward), end, tip]


def grasping(side: str, position: Any, orientation: Any = (1, 0, 0, 0),
             opening: float = WIDEST) -> np.ndarray:
    """21 x 3 joints, m, of a hand with the pads of thumb and fingers face to face.

    position: the middle between the tips, m; orientation, w x y z, of the hand's frame: x to where its fingers point, z
    out of its back; opening: between the tips of thumb and fingers, along x, m, in [-0.02, 0.1]. Negative: they would
    pass each other, which squeezes what is thin."""
    check_side(side)
    position, orientation = point("position", position), point("orientation", orientation, 4)
    if not np.linalg.norm(orientation) > 1e-6:
        raise ValueError(f"orientation: {orientation}; must be a quaternion, not 0")
    opening = real("opening", opening, -0.02, WIDEST)
    half, out = np.array([opening / 2, 0, 0]), [np.zeros(3), _THUMB]
    out += _bent(_THUMB, _THUMB_BONES, _GRIP - half, np.array([-0.5, 0.3, -1.0]))
    for knuckle, bones in zip(_KNUCKLES, _BONES):
        tip = _GRIP + half + [0, knuckle[1] * 0.8, 0]
        out += [knuckle, *_bent(knuckle, bones, tip, np.array([1.0, 0, 1.0]))]
    joints = np.array(out) - _GRIP
    if side == "left":
        joints[:, 1] *= -1
    return position + rotate(unit(orientation), joints)
