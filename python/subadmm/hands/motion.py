"""The recorded motion of a hand's 21 joints, and its file: CSV."""
from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np

from ..given import point, real
from ..output import Output
from ..rotations import rotate, unit
from .joints import JOINTS, as_joints, check_side

_COLUMNS = 1 + 3 * len(JOINTS)
_HEADER = ["time", *(f"{joint}_{axis}" for joint in JOINTS for axis in "xyz")]
_FARTHEST = 1e6    # m, and s


class Motion:
    """Positions of 21 joints (JOINTS) over time.

    times: n, s, each later than the one before, in [-1e6, 1e6]; joints: n x 21 x 3, m, in [-1e6, 1e6]; side: 'left' or
    'right'. Raises TypeError, ValueError."""

    def __init__(self, times: Any, joints: Any, side: str = "right"):
        self.side = check_side(side)
        times, joints = np.asarray(times), np.asarray(joints)
        if times.ndim != 1 or times.dtype.kind not in "iuf" or not len(times):
            raise TypeError(f"times: must be one number or more; is {times.dtype} of shape {times.shape}")
        if joints.shape != (len(times), len(JOINTS), 3) or joints.dtype.kind not in "iuf":
            raise TypeError(f"joints: must be {len(times)} x {len(JOINTS)} x 3 numbers; is {joints.dtype} of shape "
                            f"{joints.shape}")
        self.times, self.joints = times.astype(float), joints.astype(float)
        for k, time in enumerate(self.times):
            real(f"times[{k}]", time, -_FARTHEST, _FARTHEST)
            as_joints(self.joints[k], f"joints[{k}]")
        late = np.flatnonzero(np.diff(self.times) <= 0)
        if len(late):
            k = int(late[0]) + 1
            raise ValueError(f"times[{k}]: {self.times[k]}; must be greater than the one before, {self.times[k - 1]}")
        # Slopes for a cubic curve through the frames: velocities have no jumps.
        self._slopes = np.gradient(self.joints, self.times, axis=0) if len(times) > 1 else np.zeros_like(self.joints)
        if len(times) > 1:      # before and after it rests
            self._slopes[[0, -1]] = 0

    @property
    def duration(self) -> float:
        """From the first frame to the last, s."""
        return float(self.times[-1] - self.times[0])

    def at(self, time: float) -> np.ndarray:
        """21 x 3, m, at `time` (s), in the times of the frames; before the first and after the last one it rests."""
        time = real("time", time, -1e9, 1e9)
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        if k < 0:
            return self.joints[0].copy()
        if k >= len(self.times) - 1:
            return self.joints[-1].copy()
        span = self.times[k + 1] - self.times[k]
        s = (time - self.times[k]) / span
        return ((1 + 2 * s) * (1 - s) ** 2 * self.joints[k] + s * s * (3 - 2 * s) * self.joints[k + 1]
                + span * s * (1 - s) * ((1 - s) * self._slopes[k] - s * self._slopes[k + 1]))

    def moved(self, position: Any = (0, 0, 0), orientation: Any = (1, 0, 0, 0), scale: float = 1.0) -> Motion:
        """Another one, scaled about the origin (in (0, 1000]), then turned (w x y z), then moved (m): from the frame of
        what recorded it into a world."""
        position, orientation = point("position", position), point("orientation", orientation, 4)
        if not np.linalg.norm(orientation) > 1e-6:
            raise ValueError(f"orientation: {orientation}; must be a quaternion, not 0")
        scale = real("scale", scale, 0, 1000, above=True)
        return Motion(self.times, position + rotate(unit(orientation), scale * self.joints), self.side)

    # ---- files -------------------------------------------------------------------------------------------------------

    def save(self, path: Any) -> None:
        """Write it as CSV, which load() reads back to the last bit. Raises OSError."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(_HEADER)
        for time, joints in zip(self.times.tolist(), self.joints.reshape(len(self.times), -1).tolist()):
            writer.writerow(map(repr, [time, *joints]))
        with Output("path", path) as file:
            file.write(text.getvalue().encode())

    @classmethod
    def load(cls, path: Any, side: str = "right") -> Motion:
        """Of a CSV file: in each line the time, s, then x, y, z of the 21 joints, m, in the order of JOINTS; commas
        between them. A first line of names, empty lines and those that begin with # are passed over. Raises OSError,
        and ValueError that names file, line and column."""
        check_side(side)
        rows, first = [], True
        with open(path, encoding="utf-8-sig", newline="") as file:
            lines = csv.reader(file)
            try:
                for row in lines:
                    if not row or row[0].lstrip().startswith("#") or not "".join(row).strip():
                        continue
                    if first and row[0].strip().lower() in ("time", "t"):
                        first = False
                        continue
                    first = False
                    rows.append(_numbers(row, f"{path}:{lines.line_num}"))
                    if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
                        raise ValueError(f"{path}:{lines.line_num}: time {rows[-1][0]}; must be greater than the one "
                                         f"before, {rows[-2][0]}")
            except (csv.Error, UnicodeDecodeError) as error:
                raise ValueError(f"{path}:{lines.line_num}: is no CSV: {error}") from None
        if not rows:
            raise ValueError(f"{path}: has no line of numbers")
        table = np.array(rows)
        return cls(table[:, 0], table[:, 1:].reshape(len(rows), len(JOINTS), 3), side)


def _numbers(row, where):
    if len(row) != _COLUMNS:
        raise ValueError(f"{where}: has {len(row)} columns; must be {_COLUMNS}: time and 21 x (x, y, z)")
    out = []
    for name, text in zip(_HEADER, row):
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not abs(value) <= _FARTHEST:
            raise ValueError(f"{where}: {name}: {text.strip()[:60]!r}; must be a number in [-1e+06, 1e+06]")
        out.append(value)
    return out
