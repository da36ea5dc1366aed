"""A world that runs at the speed of a clock, with its figures over time and a hand that pulls bodies."""
import threading
import time
from collections import deque

import numpy as np

from .. import Error
from ..given import point as read_point, real, whole
from ..rotations import rotate
from .measures import MEASURES, measure
from .steering import Steering

_KEPT = 400       # figures over time
_STIFFNESS = 4.0  # Hz: a body alone would swing on the hand's spring as often


class Session:
    """build(): a new world. Calls from several threads wait for each other; `lock` keeps the world as it is while
    held."""

    def __init__(self, build):
        self.lock = threading.RLock()
        self.build = build
        self.running = True
        self._speed = 1.0
        self.reset()

    @property
    def speed(self):
        """Of the world's time over the clock's, in [0, 1000]."""
        return self._speed

    @speed.setter
    def speed(self, value):
        self._speed = real("speed", value, 0, 1000)

    def reset(self):
        """A new world, from its beginning."""
        with self.lock:
            self.world = self.build()
            self._coupling = self._target = None
            self._late = 0.0
            self.steps = 0
            self.history = {name: deque(maxlen=_KEPT) for name in ("time", *MEASURES)}
            self._inertia = self.world.get("body_inertia")
            self.steering = Steering(self.world)

    def change(self, backend=None, **settings):
        """Other settings of the world, as method="paper", iterations=50, certify=True; from the next step on. All of
        them, or, where one is refused, none."""
        with self.lock:
            before, made = self.world.settings.copy(), self.world.settings.copy()
            for name, value in settings.items():
                setattr(made, name, value)
            self.world.settings = made
            if backend is not None:
                try:
                    self.world.set_backend(backend, self.world.report.precision or "f64")
                except (Error, ValueError):
                    self.world.settings = before
                    raise

    def step(self, n=1):
        """Make steps, and keep their figures."""
        with self.lock:
            for _ in range(n):
                self.steering.before_step()
                self.world.step()
                self.steps += 1
            self.history["time"].append(self.steps * self.world.settings.dt)
            for name, value in measure(self.world, inertia=self._inertia).items():
                self.history[name].append(value)

    def advance(self, seconds, budget):
        """Where it runs: as many steps as `seconds` of the clock ask for at this speed, but none begun after `budget`
        seconds of work. What could not be done is left out. Gives the number of steps."""
        seconds, budget = real("seconds", seconds, 0, 1e6), real("budget", budget, 0, 1e6)
        with self.lock:
            if not self.running:
                return 0
            dt = self.world.settings.dt
            self._late += seconds * self.speed
            begun, done = time.perf_counter(), 0
            while self._late >= dt and (done == 0 or time.perf_counter() - begun < budget):
                self.step()
                self._late -= dt
                done += 1
            self._late = min(self._late, dt)
            return done

    # ---- the hand ----------------------------------------------------------------------------------------------------

    def grab(self, index, point):
        """Take the body of a row at a point (m, world); False: it is one that does not move by forces."""
        with self.lock:
            index = whole("index", index, 0, self.world.body_count - 1)
            point = read_point("point", point)
            self.release()
            body = self.world.bodies[index]
            if body.type != "dynamic":
                return False
            turn = np.array(body.orientation)
            self._held, self._at = body, rotate(turn * [1, -1, -1, -1], point - body.position)
            rate = 2 * np.pi * _STIFFNESS
            self._coupling = self.world.add_coupling(
                body, position=self._at.tolist(), target_position=list(map(float, point)),
                linear_stiffness=body.mass * rate ** 2, linear_damping=2 * body.mass * rate,
                angular_damping=max(body.inertia) * rate)
            return True

    def pull(self, point):
        """Move the hand to a point (m, world)."""
        with self.lock:
            point = read_point("point", point)
            if self._coupling is not None:
                self._coupling.set_target(point.tolist(), velocity=[0.0] * 6)
                self._target = point

    def release(self):
        """Let go."""
        with self.lock:
            if self._coupling is not None:
                self._coupling.remove()
            self._coupling = self._target = None

    def hand(self):
        """(where the body is held, where the hand is: m, world; the force on the body, N), or None."""
        with self.lock:
            if self._coupling is None or self._target is None:
                return None
            held = np.array(self._held.position) + rotate(np.array(self._held.orientation), self._at)
            return held, self._target, -np.array(self._coupling.reaction_force)
