"""Colours by names: bodies that are named after a colour have it."""
from __future__ import annotations

import re

import numpy as np

#: sRGB, 0 to 255, of the words that a body may have in its name.
NAMED = {
    "black": (40, 40, 44), "blue": (44, 98, 190), "bronze": (160, 104, 52), "brown": (122, 82, 52),
    "copper": (186, 104, 62), "cyan": (38, 168, 190), "gold": (226, 170, 32), "golden": (226, 170, 32),
    "gray": (128, 130, 134), "green": (66, 148, 76), "grey": (128, 130, 134), "magenta": (190, 52, 142),
    "orange": (232, 126, 36), "pink": (228, 134, 164), "purple": (122, 72, 156), "red": (200, 52, 46),
    "silver": (184, 188, 196), "turquoise": (42, 176, 160), "violet": (122, 72, 156), "white": (238, 238, 234),
    "yellow": (238, 200, 44),
}


def named_colour(name: str):
    """sRGB, 0 to 1, of the first colour in a name, as of "golden cube" or "left_red_wheel"; None: there is none."""
    for word in re.split(r"[^a-z]+", name.lower()):
        if word in NAMED:
            return np.array(NAMED[word]) / 255
    return None
