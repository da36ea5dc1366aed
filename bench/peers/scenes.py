"""Scenes that every engine is given, each described once.

SI units; z is up; orientations are unit quaternions w x y z, body to world. A body's frame has its origin at the centre
of mass and its axes along the principal axes, and its mass and moments are given: no engine computes them. Bodies
connected by a joint do not collide. A scene also says what is measured in it (`Scene.judged`) and, where the motion has
an answer, what it is (`Scene.exact`).
"""
import math
from dataclasses import dataclass, field
from typing import Callable

import numpy as np

GRAVITY = 9.81
RAMP = 0.1      # of forces, s: a sudden one would move bodies before contacts are there


def force_at(body, time):
    return min(time / RAMP, 1.0) * np.array(body.force)


@dataclass
class Shape:
    kind: str            # "box": half extents; "sphere": radius; "plane": z <= 0 of the body's frame, static ones only
    size: tuple = ()


@dataclass
class Body:
    name: str
    position: tuple
    mass: float = 0.0                       # 0: static, or kinematic if it has a path
    inertia: tuple = (0.0, 0.0, 0.0)        # principal moments, kg m^2
    shape: Shape | None = None              # centred at the centre of mass
    orientation: tuple = (1.0, 0.0, 0.0, 0.0)
    velocity: tuple = (0.0, 0.0, 0.0)
    spin: tuple = (0.0, 0.0, 0.0)           # world frame, rad/s
    force: tuple = (0.0, 0.0, 0.0)          # world frame, at the centre of mass, N; grows from 0 within RAMP
    path: Callable | None = None            # time -> position, of a kinematic body


@dataclass
class Joint:
    kind: str            # "ball"; "hinge" about the axis; "slider" along the axis, which locks all rotations
    a: str | None        # None: the world
    b: str
    point: tuple         # world, at the start
    axis: tuple = (0.0, 0.0, 1.0)


@dataclass
class Scene:
    name: str
    what: str
    bodies: list
    joints: list = field(default_factory=list)
    gravity: float = GRAVITY
    friction: float = 0.5
    restitution: float = 0.0
    dt: float = 0.005
    duration: float = 3.0
    judged: tuple = ("overlap",)            # measures of judge.py, the first is the one that tables and pictures show
    settled: float = 0.0                    # drift and slip count from this time on, s
    exact: Callable | None = None           # time -> {name: position, or position and orientation}

    @property
    def smooth(self):
        """Nothing rubs: motions that keep their energy."""
        return not self.friction or sum(body.shape is not None for body in self.bodies) < 2


def box(name, half, mass, position, **more):
    x, y, z = half
    moments = tuple(mass / 3 * s for s in (y * y + z * z, z * z + x * x, x * x + y * y))
    return Body(name, tuple(position), mass, moments, Shape("box", tuple(half)), **more)


def ball(name, radius, mass, position, **more):
    return Body(name, tuple(position), mass, 3 * (0.4 * mass * radius ** 2,), Shape("sphere", (radius,)), **more)


def rod(name, start, end, mass, thickness=0.02):
    """A bar without a shape, its x axis from one end to the other."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = np.linalg.norm(end - start)
    body = box(name, (length / 2, thickness / 2, thickness / 2), mass, (start + end) / 2,
               orientation=turn_to((1, 0, 0), (end - start) / length))
    body.shape = None
    return body


def ground(**more):
    return Body("ground", (0.0, 0.0, 0.0), shape=Shape("plane"), **more)


def about(axis, angle):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return (math.cos(angle / 2), *(math.sin(angle / 2) * axis))


def turn_to(a, b):
    """The shortest turn of one unit vector to another that is not opposite."""
    q = np.array([1 + np.dot(a, b), *np.cross(a, b)])
    return tuple(q / np.linalg.norm(q))


def stack():
    half = 0.05
    return Scene("stack", "ten cubes of 1 kg on each other",
                 [ground()] + [box(f"cube{k}", 3 * (half,), 1.0, (0, 0, half * (2 * k + 1))) for k in range(10)],
                 judged=("drift", "creep", "overlap", "natural_map"))


def heavy_on_light():
    return Scene("heavy_on_light", "a cube of 1000 kg on one of 1 kg",
                 [ground(), box("light", 3 * (0.1,), 1.0, (0, 0, 0.1)), box("heavy", 3 * (0.1,), 1000.0, (0, 0, 0.3))],
                 judged=("overlap", "drift", "creep", "natural_map"))


def pyramid(rows=10):
    x, y, z = 0.1, 0.05, 0.05
    boxes = [box(f"box{row}_{k}", (x, y, z), 1.0, ((2 * k - (rows - 1 - row)) * 1.05 * x, 0, z * (2 * row + 1)))
             for row in range(rows) for k in range(rows - row)]
    return Scene("pyramid", f"{len(boxes)} boxes in {rows} rows", [ground()] + boxes,
                 judged=("drift", "creep", "overlap", "natural_map"))


def card_house(tilt=math.radians(15)):
    """Two storeys. Cards of a pair lean on each other by their upper inner edges; a card lies on their upper outer
    ones."""
    half = (0.0005, 0.03, 0.045)
    thick, tall = half[0], half[2]
    sine, cosine = math.sin(tilt), math.cos(tilt)
    side, rise = thick * cosine + tall * sine, thick * sine + tall * cosine
    spread = 2 * (tall * sine + thick * cosine) + 0.001

    def pair(name, x, z):
        for sign in (-1, 1):
            yield box(f"{name}{'rl'[sign < 0]}", half, 0.004, (x + sign * side, 0, z + rise),
                      orientation=about((0, 1, 0), -sign * tilt))
    flat = box("flat", half, 0.004, (0, 0, 2 * rise + thick), orientation=about((0, 1, 0), math.pi / 2))
    return Scene("card_house", "seven cards of 1 mm, two storeys",
                 [ground(), *pair("west", -spread, 0), *pair("east", spread, 0), flat,
                  *pair("top", 0, 2 * (rise + thick))],
                 judged=("drift", "creep", "overlap", "natural_map"))


def slope(share, duration, **more):
    """A box on a plane whose steepness is this share of the critical one; its edges point in other directions than the
    slope, and the slope in none of the world's axes."""
    friction = 0.5
    angle, heading = math.atan(share * friction), math.radians(30)
    tilt = np.array(about((-math.sin(heading), math.cos(heading), 0), angle))
    normal = np.array([math.sin(angle) * math.cos(heading), math.sin(angle) * math.sin(heading), math.cos(angle)])
    down = np.array([math.cos(angle) * math.cos(heading), math.cos(angle) * math.sin(heading), -math.sin(angle)])
    half = 0.1
    body = box("box", 3 * (half,), 5.0, half * normal, orientation=tuple(tilt))
    rate = GRAVITY * (math.sin(angle) - friction * math.cos(angle))
    exact = (lambda time: {"box": half * normal + 0.5 * rate * time ** 2 * down}) if share > 1 else None
    return Scene(bodies=[ground(orientation=tuple(tilt)), body], friction=friction, duration=duration, exact=exact,
                 **more)


def slope_below():
    return slope(0.95, 10.0, name="slope_below", what="a box on a slope at 95 % of the critical steepness",
                 judged=("creep", "drift", "overlap", "natural_map"))


def slope_above():
    return slope(1.05, 2.0, name="slope_above", what="the same at 105 %: it slides",
                 judged=("error", "overlap", "natural_map"))


def grip():
    """Two jaws on sliders of a carriage, pressed together by forces, lift a cube and hold it."""
    start, seconds, height = 0.2, 1.0, 0.3
    half, jaw, press, base = 0.05, (0.01, 0.04, 0.04), 400.0, 0.2

    def lift(time):
        s = min(max((time - start) / seconds, 0), 1)
        return (0.0, 0.0, base + height * (s - math.sin(2 * math.pi * s) / (2 * math.pi)))
    x = half + jaw[0]
    bodies = [ground(), Body("carriage", lift(0), path=lift), box("cube", 3 * (half,), 20.0, (0, 0, half)),
              box("left", jaw, 0.5, (-x, 0, half), force=(press, 0, 0)),
              box("right", jaw, 0.5, (x, 0, half), force=(-press, 0, 0))]
    joints = [Joint("slider", "carriage", side, bodies[k].position, (1, 0, 0))
              for k, side in ((3, "left"), (4, "right"))]
    return Scene("grip", "a cube of 20 kg, held for 10 s by jaws of 0.5 kg that press with 400 N", bodies, joints,
                 duration=start + seconds + 10, settled=start + seconds, judged=("slip", "slip_rate", "overlap"))


def pile(count=100):
    random = np.random.default_rng(1)
    half, wide = (0.06, 0.05, 0.04), 5
    bodies = [ground()]
    for k in range(count):
        q = random.normal(size=4)
        place = np.array([k % wide - 2, k // wide % wide - 2, k // wide ** 2 + 0.7]) * 0.17
        bodies.append(box(f"box{k}", half, 1.0, place, orientation=tuple(q / np.linalg.norm(q))))
    return Scene("pile", f"{count} boxes dropped", bodies, duration=3.0, judged=("overlap", "energy_gain",
                                                                                 "natural_map"))


def chain(links=20):
    length, mass, radius, angle = 0.1, 0.1, 0.1, math.radians(30)
    along = np.array([math.sin(angle), 0, -math.cos(angle)])
    bodies = [rod(f"link{k}", k * length * along, (k + 1) * length * along, mass) for k in range(links)]
    joints = [Joint("ball", f"link{k - 1}" if k else None, f"link{k}", tuple(k * length * along))
              for k in range(links)]
    end = links * length * along
    load = ball("load", radius, 100 * mass, end + radius * along)
    load.shape = None
    joints.append(Joint("ball", bodies[-1].name, "load", tuple(end)))
    exact = Bars(bodies + [load], [length] * links + [radius], [length / 2] * links + [radius],
                 [angle - math.pi / 2] * (links + 1))
    return Scene("chain", f"{links} links with a load 100 times as heavy, swinging", bodies + [load], joints,
                 duration=2.0, judged=("error", "joint_error", "energy_error"), exact=exact)


def four_bar():
    crank, coupler, rocker, base, angle = 0.2, 0.5, 0.4, 0.5, math.radians(45)
    a, d = np.zeros(3), np.array([base, 0, 0])
    b = crank * np.array([math.cos(angle), 0, math.sin(angle)])
    way = d - b
    apart = np.linalg.norm(way)
    along = (coupler ** 2 - rocker ** 2 + apart ** 2) / (2 * apart)
    up = np.array([-way[2], 0, way[0]]) / apart
    c = b + along * way / apart + math.sqrt(coupler ** 2 - along ** 2) * up
    bars = [rod("crank", a, b, 1.0), rod("coupler", b, c, 2.5), rod("rocker", c, d, 2.0)]
    joints = [Joint("hinge", *pair, tuple(point), (0, 1, 0)) for pair, point in (
        ((None, "crank"), a), (("crank", "coupler"), b), (("coupler", "rocker"), c), ((None, "rocker"), d))]
    lengths = np.array([crank, coupler, rocker])
    angles = [math.atan2(end[2] - start[2], end[0] - start[0]) for start, end in ((a, b), (b, c), (c, d))]
    return Scene("four_bar", "a closed loop of four hinges, let go", bars, joints, duration=3.0,
                 judged=("error", "joint_error", "energy_error"),
                 exact=Bars(bars, lengths, lengths / 2, angles, closed=True))


def tumbling():
    moments, spin = (0.01, 0.02, 0.03), (0.05, 5.0, 0.05)
    body = Body("body", (0, 0, 0), 1.0, moments, Shape("box", (0.1, 0.1, 0.1)), spin=spin)
    return Scene("tumbling", "a free body that turns about its middle axis", [body], gravity=0.0, duration=10.0,
                 judged=("error", "energy_error"), exact=Tumbling(moments, spin))


class Motion:
    """A motion by the classical fourth-order method: `rate` of a state, `poses` of one."""

    def __init__(self, state, step):
        self.known, self.step = {0.0: np.asarray(state, float)}, step

    def state_at(self, time):
        key = round(time, 9)
        if key not in self.known:
            start = max(known for known in self.known if known < key)
            state, steps = self.known[start], math.ceil((key - start) / self.step - 1e-6)
            h = (key - start) / steps
            for _ in range(steps):
                k1 = self.rate(state)
                k2 = self.rate(state + h / 2 * k1)
                k3 = self.rate(state + h / 2 * k2)
                k4 = self.rate(state + h * k3)
                state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            self.known[key] = state
        return self.known[key]

    def __call__(self, time):
        return self.poses(self.state_at(time))


class Tumbling(Motion):
    """Euler's equations."""

    def __init__(self, moments, spin):
        super().__init__([1, 0, 0, 0, *spin], step=1e-4)
        self.moments = np.array(moments)

    def rate(self, state):
        q, w = state[:4], state[4:]
        turn = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([turn, np.cross(self.moments * w, w) / self.moments])

    def poses(self, state):
        return {"body": np.concatenate([np.zeros(3), state[:4]])}


class Bars(Motion):
    """Bars in a row in the plane of x and z, the first one hung up at the origin; their angles to x are the unknowns.
    closed: the end of the last one stays where it is."""

    def __init__(self, bars, lengths, centres, angles, closed=False):
        super().__init__([*angles, *np.zeros(len(angles))], step=5e-4)
        self.names, self.lengths, self.closed = [bar.name for bar in bars], np.array(lengths), closed
        # A bar's centre of mass is a sum of all bars up to it; `share` has their lengths.
        self.share = np.tril(np.tile(self.lengths, (len(bars), 1)), -1) + np.diag(centres)
        mass = np.array([bar.mass for bar in bars])
        self.coupling = self.share.T @ (mass[:, None] * self.share)
        self.weight = GRAVITY * mass @ self.share
        self.moment = np.diag([bar.inertia[1] for bar in bars])

    def rate(self, state):
        angle, speed = np.split(state, 2)
        apart = angle[:, None] - angle
        mass = self.coupling * np.cos(apart) + self.moment
        force = -(self.coupling * np.sin(apart)) @ speed ** 2 - self.weight * np.cos(angle)
        if self.closed:
            rows = self.lengths * np.array([-np.sin(angle), np.cos(angle)])
            turn = self.lengths * np.array([np.cos(angle), np.sin(angle)]) @ speed ** 2
            mass = np.block([[mass, rows.T], [rows, np.zeros((2, 2))]])
            force = np.concatenate([force, turn])
        return np.concatenate([speed, np.linalg.solve(mass, force)[:len(angle)]])

    def poses(self, state):
        angle = state[:len(self.names)]
        x, z = self.share @ np.cos(angle), self.share @ np.sin(angle)
        return {name: np.array([x[k], 0, z[k]]) for k, name in enumerate(self.names)}


def rolling():
    """A ball that skids and then rolls: v = v0 - mu g t until 5/7 v0."""
    radius, speed, friction = 0.1, 2.0, 0.3
    heading = np.array([math.cos(math.radians(30)), math.sin(math.radians(30)), 0])

    def exact(time):
        slides = min(time, 2 * speed / (7 * friction * GRAVITY))
        way = speed * slides - friction * GRAVITY * slides ** 2 / 2 + 5 / 7 * speed * (time - slides)
        return {"ball": way * heading + np.array([0, 0, radius])}
    return Scene("rolling", "a ball skids until it rolls",
                 [ground(), ball("ball", radius, 1.0, (0, 0, radius), velocity=tuple(speed * heading))],
                 friction=friction, duration=3.0, judged=("error", "overlap", "natural_map"), exact=exact)


def cradle(count=5):
    """Balls with gaps, so that the impacts come one after the other and have one answer: the speed is handed on."""
    radius, gap, way, speed = 0.05, 0.01, 0.1, 1.0
    places = [0.0] + [way + 2 * radius * k + gap * (k - 1) for k in range(1, count)]

    def exact(time):
        out, start = {}, 0.0
        for k in range(count):
            room = (way if k == 0 else gap) if k + 1 < count else math.inf
            gone = min(max(speed * (time - start), 0.0), room)
            out[f"ball{k}"] = np.array([places[k] + gone, 0, 0])
            start += room / speed
        return out
    balls = [ball(f"ball{k}", radius, 1.0, (x, 0, 0)) for k, x in enumerate(places)]
    balls[0].velocity = (speed, 0, 0)
    return Scene("cradle", "five balls in a row hand on an impact, e = 1", balls, gravity=0.0, friction=0.0,
                 restitution=1.0, duration=1.0, judged=("error", "energy_error", "overlap"), exact=exact)


SCENES = {make.__name__: make for make in (
    stack, heavy_on_light, pyramid, card_house, slope_below, slope_above, grip, pile, chain, four_bar, tumbling,
    rolling, cradle)}
