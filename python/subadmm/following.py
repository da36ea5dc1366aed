"""Targets that go after what somebody asks for, which comes in jumps, as a critically damped spring would."""
import numpy as np

from .rotations import conjugate, multiply, of_vector, to_vector, unit

RATE = 40.0  # 1/s: of the spring


def follow(offset, speed, dt, rate=RATE):
    """(offset, speed) after dt (s) of what goes to 0, at first with this offset and speed: exactly."""
    both = (speed + rate * offset) * dt
    fade = np.exp(-rate * dt)
    return (offset + both) * fade, (speed - rate * both) * fade


class Follower:
    """Poses (n x 3, m; n x 4, w x y z) that go to `position` and `orientation`; `at` and `turn`: where they are now.
    Moved steadily, they are 2 / rate (s) behind."""

    def __init__(self, position, orientation, rate=RATE):
        self.rate = rate
        self.put(position, orientation)

    def put(self, position, orientation):
        """Be there at once, at rest."""
        self.at, self.turn = np.array(position, dtype=float), np.array(orientation, dtype=float)
        self.position, self.orientation = self.at, self.turn
        self._speed, self._spin = np.zeros_like(self.at), np.zeros_like(self.at)

    def step(self, dt):
        """Bring them on by dt (s). Gives (at, turn, velocity n x 6: linear m/s, angular rad/s, world): where they were
        and what brings them to where they are now."""
        position, orientation = self.position, self.orientation      # which another thread may set
        offset, self._speed = follow(self.at - position, self._speed, dt, self.rate)
        away = to_vector(multiply(self.turn, conjugate(orientation)))
        angle, self._spin = follow(away, self._spin, dt, self.rate)
        before = self.at, self.turn
        self.at, self.turn = position + offset, unit(multiply(of_vector(angle), orientation))
        return (*before, velocity_between(*before, self.at, self.turn, dt))


def velocity_between(at, turn, next_at, next_turn, dt):
    """n x 6: linear (m/s) and angular (rad/s) velocity, world, that takes poses to the next ones in dt (s)."""
    spin = to_vector(multiply(next_turn, conjugate(turn)))
    return np.concatenate([next_at - at, spin], axis=-1) / dt
