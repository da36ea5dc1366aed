"""A user's hand in a world: a palm and five fingertips, drawn by couplings to where the user's are."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable

import numpy as np

from .. import World, box, capsule
from ..following import Follower, velocity_between
from ..given import real
from ..rotations import rotate
from .joints import FINGERS, PARTS, check_side, parts_of
from .motion import Motion

_PALM_HALF = (0.035, 0.035, 0.01)    # m
_PALM_MASS, _TIP_MASS = 0.25, 0.02   # kg
_PALM: dict[str, Any] = {
    "linear_stiffness": 2000.0, "linear_damping": 45.0, "angular_stiffness": 10.0, "angular_damping": 0.1}
_TIP: dict[str, Any] = {
    "linear_stiffness": 800.0, "linear_damping": 8.0, "angular_stiffness": 0.05, "angular_damping": 5e-4}
_PALM_TORQUE, _TIP_TORQUE = 3.0, 0.2  # N m, at most
#: Radius of a fingertip and half length of its axis, m.
TIP_RADIUS, TIP_HALF = 0.008, 0.005
_BACK = TIP_RADIUS + TIP_HALF        # m, from the tip to the middle of its body
_RATE = 80.0                         # 1/s: a target that is led is 25 ms behind
_BEGINS, _ENDS = 0.05, 0.02          # N: a touch


@dataclass(frozen=True)
class Touch:
    """A part of a hand has begun or ended to touch something. side: 'left' or 'right'; part: one of PARTS; force: on
    it, N, world, in the step that it began in; 0 where it ended."""
    side: str
    part: str
    begun: bool
    force: Any


class Hand:
    """A palm and five fingertips of a hand in a world, each a small body on a coupling. They have no weight, which is
    the user's to bear.

    world: subadmm.World; side: 'left' or 'right'; joints: where it begins, 21 or 25 joints (parts_of), m, world. They
    are free of each other and meet all other shapes. friction: of their shapes, in [0, 1e6]; size: of the hand, in
    [0.01, 100], 1: a usual one; lengths of the bodies grow with it, masses with its third power, forces with its
    fourth, so that it moves alike; palm_force, tip_force: the largest force of a coupling along each of its target's
    axes, N, in (0, 1e9], default 60 and 15 times size^4; on_touch: called by after_step() with each Touch. Not
    thread-safe, as its world. Raises TypeError, ValueError (an argument that is none), subadmm.Error; nothing is added
    then.

    go() leads it, as a tracked hand does, and follow() as a Motion has it. Each step has before_step() or follow()
    before it, and after_step() after it where forces are wanted:

        hand.go(joints)
        hand.before_step()
        world.step()
        touches = hand.after_step()
    """

    def __init__(self, world: Any, side: str, joints: Any, *, friction: float = 1.0, size: float = 1.0,
                 palm_force: float | None = None, tip_force: float | None = None,
                 on_touch: Callable[[Touch], Any] | None = None):
        if not isinstance(world, World):
            raise TypeError(f"world: {world!r}; must be a subadmm.World")
        self.world, self.side, self.on_touch = world, check_side(side), on_touch
        friction, size = real("friction", friction, 0, 1e6), real("size", size, 0.01, 100)
        self.size, self._strong = size, size ** 4
        heavy, strong = size ** 3, size ** 4
        places, turns = self._targets(parts_of(joints, side))
        most = [real("palm_force", 60.0 * strong if palm_force is None else palm_force, 0, 1e9, above=True)] + \
            [real("tip_force", 15.0 * strong if tip_force is None else tip_force, 0, 1e9, above=True)] * len(FINGERS)
        palm = box(*(size * half for half in _PALM_HALF), friction=friction)
        along_x = (0.5 ** 0.5, 0, 0.5 ** 0.5, 0)
        tip = capsule(size * TIP_RADIUS, size * TIP_HALF, friction=friction, orientation=along_x)
        #: The bodies and their couplings, in the order of PARTS.
        self.bodies, self.couplings = [], []
        try:
            for k, part in enumerate(PARTS):
                pose = {"position": places[k].tolist(), "orientation": turns[k].tolist()}
                mass = (_TIP_MASS if k else _PALM_MASS) * heavy
                body = world.add_solid(tip if k else palm, mass=mass, name=f"{side} {part}", gravity_scale=0, **pose)
                self.bodies.append(body)
                for other in self.bodies[:-1]:
                    body.ignore(other)
                self.couplings.append(world.add_coupling(
                    body, target_position=pose["position"], target_orientation=pose["orientation"],
                    max_force=most[k], max_torque=(_TIP_TORQUE if k else _PALM_TORQUE) * size * strong,
                    **{name: value * heavy * (size ** 2 if name.startswith("angular") else 1)
                       for name, value in (_TIP if k else _PALM).items()}))
        except Exception:
            self.remove()
            raise
        self._follower = Follower(places, turns, _RATE)
        self._touching = [False] * len(PARTS)
        #: 6 x 3, N, world: what the contacts of the last step did to each part, in the order of PARTS. Of after_step().
        self.forces = np.zeros((len(PARTS), 3))

    def _targets(self, parts):
        """(positions, orientations) of the bodies' middles."""
        places, turns = parts
        back = self.size * np.array([[0.0, 0, 0]] + [[-_BACK, 0, 0]] * len(FINGERS))
        return places + rotate(turns, back), turns

    def remove(self) -> None:
        """Take its bodies and couplings out of the world."""
        for body in self.bodies:
            body.remove()
        self.bodies, self.couplings = [], []

    # ---- where it goes -----------------------------------------------------------------------------------------------

    def go(self, joints: Any) -> None:
        """Lead it to 21 or 25 joints, m, world: targets go there smoothly, and are some 25 ms behind what moves. Raises
        TypeError, ValueError (parts_of); nothing is changed then."""
        self._follower.position, self._follower.orientation = self._targets(parts_of(joints, self.side))

    def place(self, joints: Any) -> None:
        """Be at these joints at once, at rest, as where tracking begins anew. Raises as go()."""
        places, turns = self._targets(parts_of(joints, self.side))
        self._follower.put(places, turns)
        for body, coupling, place, turn in zip(self.bodies, self.couplings, places.tolist(), turns.tolist()):
            body.position, body.orientation = place, turn
            body.linear_velocity = body.angular_velocity = (0.0, 0.0, 0.0)
            coupling.set_target(place, turn)

    def is_far(self, joints: Any, distance: float) -> bool:
        """Is the palm farther (m) than that from where these joints have it? Raises as go()."""
        places, _ = parts_of(joints, self.side)
        return bool(np.linalg.norm(places[0] - self.bodies[0].position) > distance)

    def before_step(self) -> None:
        """Bring the targets on by a step of the world. Call it before every step."""
        self._set(*self._follower.step(self.world.settings.dt))

    def follow(self, motion: Motion, time: float) -> None:
        """In the place of before_step(): the targets of the next step are those of a Motion at `time`, s, with the
        velocities to where they are a step later. Raises ValueError (a motion of the other hand; joints that parts_of()
        refuses)."""
        if motion.side != self.side:
            raise ValueError(f"motion: is of the {motion.side} hand; this is the {self.side} one")
        dt = self.world.settings.dt
        places, turns = self._targets(parts_of(motion.at(time), self.side))
        then, turned = self._targets(parts_of(motion.at(time + dt), self.side))
        self._set(places, turns, velocity_between(places, turns, then, turned, dt))
        self._follower.put(then, turned)

    def _set(self, places, turns, velocities):
        for coupling, place, turn, velocity in zip(self.couplings, places.tolist(), turns.tolist(),
                                                   velocities.tolist()):
            coupling.set_target(place, turn, velocity)

    # ---- what it feels -----------------------------------------------------------------------------------------------

    def after_step(self) -> list[Touch]:
        """Read `forces`. Gives what has begun or ended to be touched in the last step, and tells on_touch. A touch
        begins at 0.05 N and ends below 0.02 N, times size^4. Raises subadmm.Unavailable before the first step, and
        where settings.recover_wrenches is false."""
        self.forces = np.array([body.contact_wrench[:3] for body in self.bodies])
        touches = []
        for k, force in enumerate(np.linalg.norm(self.forces, axis=1)):
            touching = bool(force > self._strong * (_ENDS if self._touching[k] else _BEGINS))
            if touching != self._touching[k]:
                self._touching[k] = touching
                felt = self.forces[k].copy() if touching else np.zeros(3)
                touches.append(Touch(self.side, PARTS[k], touching, felt))
        if self.on_touch is not None:
            for touch in touches:
                self.on_touch(touch)
        return touches

    @property
    def reactions(self) -> np.ndarray:
        """6 x 3, N, world: of the couplings on the user, which have the parts' inertia in them; the mean over the last
        step. The parts have no weight: that of the hand is the user's own."""
        return np.array([coupling.reaction_force for coupling in self.couplings])
