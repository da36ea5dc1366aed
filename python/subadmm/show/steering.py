"""What a user leads: the targets of a world's couplings and of its joints' position drives."""
import numpy as np

from ..following import Follower, follow
from ..given import point, real, whole
from ..rotations import rotate, unit
from .chains import Finger, driven_chains, opposing, opposing_thumb


class Lead:
    """A coupling that is led: its target goes to `position` (m), `orientation` (w x y z), world."""

    def __init__(self, coupling):
        self.coupling = coupling
        self.name = coupling.body.name or f"body {coupling.body.index}"
        self.most = coupling.max_force      # N
        self._follower = Follower(*(np.array(values)[None] for values in coupling.target))

    at = property(lambda self: self._follower.at[0], doc="Where the target is, m, world.")
    turn = property(lambda self: self._follower.turn[0], doc="Its orientation, w x y z.")

    @property
    def position(self):
        return self._follower.position[0]

    @position.setter
    def position(self, value):
        self._follower.position = np.asarray(value)[None]

    @property
    def orientation(self):
        return self._follower.orientation[0]

    @orientation.setter
    def orientation(self, value):
        self._follower.orientation = np.asarray(value)[None]

    def go(self, position, orientation):
        """Where the target is to go: finite numbers, and an orientation that is none of length 0."""
        position, orientation = point("position", position), point("orientation", orientation, 4)
        if not np.linalg.norm(orientation) > 1e-6:
            raise ValueError(f"orientation: {orientation}; must be a quaternion, not 0")
        self.position, self.orientation = position, unit(orientation)

    def step(self, dt):
        """Bring the target on by a step."""
        at, turn, velocity = self._follower.step(dt)
        self.coupling.set_target(at[0].tolist(), turn[0].tolist(), velocity[0].tolist())

    def grip(self):
        """Where the frame on the body is, m, world."""
        body, (own, _) = self.coupling.body, self.coupling.frame
        return np.array(body.position) + rotate(np.array(body.orientation), np.array(own))

    def reaction(self):
        """(force, N; torque about the target, N m): what the user feels."""
        return np.array(self.coupling.reaction_force), np.array(self.coupling.reaction_torque)


class Hand:
    """Fingers on one body, which close along the line between the thumb and the others: all by `opening` (m, less
    than at the beginning: negative; between the thumb and the others), each by its own `more` (m, inwards)."""

    def __init__(self, fingers, targets):
        self.fingers = fingers
        self.begin = [np.array([targets[joint.row, joint.coordinate] for joint in finger.chain.joints])
                      for finger in fingers]
        self.ways = opposing(fingers, self.begin)
        self.opening, self.more = 0.0, [0.0] * len(fingers)
        tips = np.array([finger.at(own)[0] for finger, own in zip(fingers, self.begin)])
        thumb = opposing_thumb(tips)
        #: m, along that line, at the beginning
        self.apart = float((np.delete(tips, thumb, axis=0).mean(axis=0) - tips[thumb]) @ self.ways[thumb])

    def targets(self, k):
        """Coordinates of the k-th finger."""
        return self.fingers[k].reach(self.begin[k], (self.more[k] - self.opening / 2) * self.ways[k])


class Steering:
    """leads: of the world's couplings; chains: of its driven joints; hands: of those that are fingers. A scene's
    script does not act while `on`."""

    def __init__(self, world):
        self.world = world
        self.on = False
        self.leads = [Lead(coupling) for coupling in world.couplings]
        self.chains = driven_chains(world)
        self._read_targets()
        fingers = {}
        for chain in self.chains:
            if chain.is_finger and Finger.fits(chain):
                fingers.setdefault(chain.base, []).append(Finger(chain))
        self.hands = [Hand(of, self.targets) for of in fingers.values() if len(of) > 1]

    def _read_targets(self):
        self.targets = self.world.get("joint_target_position")
        self.goals, self._rates = self.targets.copy(), np.zeros(self.targets.shape)
        self._led = np.zeros(self.targets.shape, dtype=bool)
        for chain in self.chains:
            for joint in chain.joints:
                self._led[joint.row, joint.coordinate] = True
        self._speeds = np.where(self._led, 0.0, self.world.get("joint_target_speed"))

    def start(self):
        """Lead from now on, from where targets are."""
        has_script, self.on = self.world.script, True
        if has_script:
            self.world.script = False
        self._had_script = has_script
        self.leads = [Lead(lead.coupling) for lead in self.leads]
        self._read_targets()
        self.hands = [Hand(hand.fingers, self.targets) for hand in self.hands]

    def stop(self):
        """Leave them to the script again, where there is one, or where they are."""
        self.on = False
        if self._had_script:
            self.world.script = True
        for lead in self.leads:
            lead.coupling.set_target(lead.at.tolist(), lead.turn.tolist(), [0.0] * 6)
        self.world.set("joint_target_speed", self._speeds)

    def set_joint(self, joint, value):
        """Where a Driven is to go, m or rad."""
        value = real("value", value, -1e9, 1e9)
        self.goals[joint.row, joint.coordinate] = value

    def close(self, hand, opening=None, finger=None, more=None):
        """Close a Hand's fingers, or one of them (its number)."""
        if opening is not None:
            hand.opening = real("opening", opening, -1e9, 1e9)
        if finger is not None:
            hand.more[whole("finger", finger, 0, len(hand.fingers) - 1)] = real("more", more, -1e9, 1e9)
        for k in range(len(hand.fingers)) if finger is None else [finger]:
            for joint, value in zip(hand.fingers[k].chain.joints, hand.targets(k)):
                self.set_joint(joint, value)

    def before_step(self):
        """Bring all targets on. Called before every step."""
        if not self.on:
            return
        dt = self.world.settings.dt
        for lead in self.leads:
            lead.step(dt)
        if self.chains:
            offset, self._rates = follow(self.targets - self.goals, self._rates, dt)
            targets = self.goals + offset
            speeds = np.where(self._led, (targets - self.targets) / dt, self._speeds)
            self.world.set("joint_target_position", self.targets)
            self.world.set("joint_target_speed", speeds)
            self.targets = targets
