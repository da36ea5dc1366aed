"""A world that runs at the speed of a clock, with figures over time, its last minute, and a hand that pulls bodies."""
import threading
import time
from collections import deque

import numpy as np

from .. import Error
from ..environments import Environments
from ..given import point as read_point, real, whole
from ..rotations import rotate
from .description import describe, tiled, world_of
from .measures import MEASURES, kinetic_energy, measure
from .steering import Steering

_KEPT = 12000     # figures over time
MINUTE = 60.0     # s of the world's time that poses are kept of
_RATE = 30        # poses a second of them
_MOST = 1 << 28   # bytes of them
_SHOWN = 64       # environments that are shown
_STIFFNESS = 4.0  # Hz: a body alone would swing on the hand's spring as often


class Tape:
    """Poses of the last minute: times (s) and the array body_state, as float32, of each."""

    def __init__(self):
        self.times, self.states = deque(), deque()

    def add(self, time_now, state):
        """Keep a state, unless the last one kept is as good as as old."""
        if self.times and time_now - self.times[-1] < (1 - 1e-6) / _RATE:
            return
        self.times.append(time_now)
        self.states.append(np.asarray(state, np.float32))
        most = _MOST // max(self.states[0].nbytes, 1)
        while time_now - self.times[0] > MINUTE or len(self.times) > max(most, 2):
            self.times.popleft()
            self.states.popleft()

    def at(self, seconds):
        """(time, state) next to a time before the last one."""
        wanted = self.times[-1] + seconds
        k = int(np.argmin(np.abs(np.array(self.times) - wanted)))
        return self.times[k], self.states[k].astype(float)


class Session:
    """build(): a new World; or what load() returned; or Environments, which are shown side by side, 64 at most. Calls
    from several threads wait for each other; `lock` keeps the world as it is while held."""

    def __init__(self, build):
        self.lock = threading.RLock()
        self.build = build
        #: Objects whose before_step() and after_step() are called around each step of a world.
        self.around_steps = []
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
        """A new world, from its beginning; figures and poses begin anew."""
        with self.lock:
            made = self.build()
            self.environments = made if isinstance(made, Environments) else None
            #: What is drawn.
            self.source = made if self.environments is None else getattr(made, "loaded", None) or made.world(0)
            self.world, self.loaded = world_of(self.source)
            self._coupling = self._target = None
            self._late = 0.0
            self.steps = 0
            self.history = {name: deque(maxlen=_KEPT) for name in ("time", *MEASURES)}
            self._inertia = self.world.get("body_inertia")
            self.steering = Steering(self.world)
            if self.loaded is not None and self.loaded.actuators or self.environments is not None:
                self.steering.chains, self.steering.hands = [], []    # the actuators' controls move them
            self.actuators = {} if self.loaded is None or self.environments is not None else self.loaded.actuators
            self.tape = Tape()
            self.tape.add(0.0, self.state())

    @property
    def settings(self):
        """Those that steps are made with."""
        return self.world.settings if self.environments is None else self.environments.settings

    @property
    def dt(self):
        """Of a step, s."""
        return self.settings.dt

    def state(self):
        """The array body_state, n x 13; of environments of all that are shown, one below the other."""
        if self.environments is None:
            return self.world.get("body_state")
        shown = np.arange(min(self.environments.count, _SHOWN))
        return np.asarray(self.environments.get("body_state", shown)).reshape(-1, 13)

    def describe(self, collision=False, reach=60.0):
        """A Description of what state() has the poses of."""
        description = describe(self.source, collision, reach)
        if self.environments is None:
            return description
        return tiled(description, len(self.state()) // self.world.body_count)

    def _measure(self):
        if self.environments is None:
            return measure(self.world, inertia=self._inertia)
        state = self.state()
        return {**dict.fromkeys(MEASURES, float("nan")), "ms": self._took * 1e3,
                "kinetic": kinetic_energy(state, np.tile(self._inertia, (len(state) // len(self._inertia), 1)))}

    def change(self, backend=None, **settings):
        """Other settings of the world, as method="paper", iterations=50, certify=True; from the next step on. All of
        them, or, where one is refused, none."""
        with self.lock:
            before, made = self.settings.copy(), self.settings.copy()
            for name, value in settings.items():
                setattr(made, name, value)
            if self.environments is not None:
                self.environments.settings = made
                if backend is not None:
                    raise ValueError("backend: environments stay on the one that they began on")
                return
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
                begun = time.perf_counter()
                if self.environments is not None:
                    self.environments.step()
                else:
                    self.steering.before_step()
                    for around in self.around_steps:
                        around.before_step()
                    self.world.step()
                    for around in self.around_steps:
                        around.after_step()
                self._took = time.perf_counter() - begun
                self.steps += 1
            now = self.steps * self.dt
            self.history["time"].append(now)
            for name, value in self._measure().items():
                self.history[name].append(value)
            if now - self.tape.times[-1] >= (1 - 1e-6) / _RATE:
                self.tape.add(now, self.state())

    def advance(self, seconds, budget):
        """Where it runs: as many steps as `seconds` of the clock ask for at this speed, but none begun after `budget`
        seconds of work. What could not be done is left out. Gives the number of steps."""
        seconds, budget = real("seconds", seconds, 0, 1e6), real("budget", budget, 0, 1e6)
        with self.lock:
            if not self.running:
                return 0
            dt = self.dt
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
            if self.environments is not None:
                return False
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
