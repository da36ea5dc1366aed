"""Targets that go after what somebody asks for, which comes in jumps, as a critically damped spring would."""
import numpy as np

RATE = 40.0  # 1/s: of the spring

# Of the products a_i b_j of two quaternions, 16, to the quaternion ab.
_PRODUCT = np.zeros((4, 4, 4))
for _i, _j, _k, _sign in ((0, 0, 0, 1), (1, 1, 0, -1), (2, 2, 0, -1), (3, 3, 0, -1),
                          (0, 1, 1, 1), (1, 0, 1, 1), (2, 3, 1, 1), (3, 2, 1, -1),
                          (0, 2, 2, 1), (2, 0, 2, 1), (3, 1, 2, 1), (1, 3, 2, -1),
                          (0, 3, 3, 1), (3, 0, 3, 1), (1, 2, 3, 1), (2, 1, 3, -1)):
    _PRODUCT[_i, _j, _k] = _sign
_PRODUCT = _PRODUCT.reshape(16, 4)
_CONJUGATE = np.array([1.0, -1, -1, -1])


# As the functions of rotations.py, for n quaternions in arrays of numpy: of few, as there are in every step, in a fifth
# of the time.


def _product(a, b):
    return (a[:, :, None] * b[:, None, :]).reshape(-1, 16) @ _PRODUCT


def _turn_between(first, second):
    """n x 3: rotation vectors, world, that turn the first orientations to the second ones."""
    q = _product(second, first * _CONJUGATE)
    w, v = q[:, 0], q[:, 1:]
    sine = np.sqrt((v * v).sum(axis=1))
    return (2 * np.arctan2(sine, np.abs(w)) * np.where(w < 0, -1.0, 1.0) / np.maximum(sine, 1e-300))[:, None] * v


def _turned(orientation, vector):
    """Orientations turned on by rotation vectors, world."""
    half = np.sqrt((vector * vector).sum(axis=1))[:, None] / 2
    q = _product(np.concatenate([np.cos(half), np.sinc(half / np.pi) / 2 * vector], axis=1), orientation)
    return q / np.sqrt((q * q).sum(axis=1))[:, None]


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
        away = _turn_between(orientation, self.turn)
        angle, self._spin = follow(away, self._spin, dt, self.rate)
        before = self.at, self.turn
        self.at, self.turn = position + offset, _turned(orientation, angle)
        return (*before, velocity_between(*before, self.at, self.turn, dt))


def velocity_between(at, turn, next_at, next_turn, dt):
    """n x 6: linear (m/s) and angular (rad/s) velocity, world, that takes poses to the next ones in dt (s)."""
    return np.concatenate([next_at - at, _turn_between(turn, next_turn)], axis=1) / dt
