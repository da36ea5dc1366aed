"""Contact forces as arrows, coloured by how far each contact is from its law."""
from dataclasses import dataclass

import numpy as np

from .. import Unavailable

#: Powers of ten of natural maps, m/s, and their colours, sRGB; between them colours are mixed.
SCALE = (-12, -9, -6, -3, -1)
COLOURS = np.array([(52, 94, 172), (40, 150, 160), (120, 176, 70), (232, 170, 40), (206, 42, 46)])
UNMEASURED = (200, 40, 50)


@dataclass
class Forces:
    """position: n x 3, m, world; force: n x 3, on body b, N; error: n, natural map, m/s; NaN: not measured."""
    position: np.ndarray
    force: np.ndarray
    error: np.ndarray

    @property
    def size(self):
        return np.linalg.norm(self.force, axis=1)

    def arrows(self, length, largest=None):
        """n x 2 x 3, m: along each force; one of size `largest` (N; None: the largest there is) is `length` long."""
        largest = self.size.max(initial=0) if largest is None else largest
        return np.stack([self.position, self.position + self.force * (length / max(largest, 1e-300))], axis=1)


def forces_of(world, most):
    """The `most` largest contact forces of the last step, in the order of the contacts; without those that are 0."""
    contacts = world.contacts()
    try:
        error = world.contact_errors()
    except Unavailable:
        error = np.full(len(contacts), np.nan)
    size = np.linalg.norm(contacts["force"], axis=1)
    keep = np.nonzero(size > 0)[0]
    if len(keep) > most:
        keep = np.sort(keep[np.argpartition(size[keep], -most)[-most:]]) if most > 0 else keep[:0]
    return Forces(contacts["position"][keep], contacts["force"][keep], error[keep])


def colours_of(error):
    """n x 3, 0 to 255."""
    error = np.asarray(error, float)
    power = np.log10(np.clip(np.nan_to_num(error, nan=1.0), 1e-300, None))
    mixed = np.stack([np.interp(power, SCALE, COLOURS[:, k]) for k in range(3)], axis=-1)
    return np.rint(np.where(np.isnan(error)[..., None], UNMEASURED, mixed)).astype(np.uint8)


def legend():
    """A bar with the colours and what they mean, as HTML."""
    low, high = SCALE[0], SCALE[-1]
    at = [100 * (power - low) / (high - low) for power in SCALE]
    stops = ", ".join(f"rgb{tuple(map(int, colour))} {place:.0f}%" for colour, place in zip(COLOURS, at))
    marks = "".join(f'<span style="position:absolute;white-space:nowrap;'
                    f'left:{place:.0f}%;transform:translateX(-{place:.0f}%)">'
                    f"1e{power}</span>" for power, place in zip(SCALE, at))
    return (f'<div style="font-size:0.8em">natural map of contacts, m/s<div style="height:8px;border-radius:4px;'
            f'background:linear-gradient(to right, {stops})"></div>'
            f'<div style="position:relative;height:1.4em">{marks}</div></div>')
