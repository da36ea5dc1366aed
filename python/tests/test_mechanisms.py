"""Random mechanisms that fall on the ground, by the direct solves (ncp_points): trees of joints of every kind with limits,
drives, friction and dampers, masses over two decades. Bodies begin apart, so that every step has a solution."""

import numpy as np
import pytest

import subadmm

KINDS = ("fixed", "revolute", "prismatic", "cylindrical", "spherical", "universal", "planar", "distance")
FREE = {"revolute": (5,), "prismatic": (2,), "cylindrical": (2, 5), "universal": (3, 4), "planar": (0, 1, 5)}
STEPS = 100


def direction(random):
    q = random.normal(size=4)
    return q / np.linalg.norm(q)


def coordinate(random):
    """What acts along a free coordinate, if anything."""
    options = {}
    if random.random() < 0.4:
        options.update(limited=True, lower=-random.uniform(0.1, 1), upper=random.uniform(0.1, 1))
    what = random.random()
    if what < 0.2:
        options.update(drive="speed", target_speed=random.uniform(-2, 2), drive_force=10 ** random.uniform(-1, 1))
    elif what < 0.4:
        options.update(drive="position", target_position=random.uniform(-0.1, 0.1), drive_force=10 ** random.uniform(0, 1),
                       drive_stiffness=10 ** random.uniform(0, 2), drive_damping=10 ** random.uniform(-1, 0))
    if random.random() < 0.2:
        options.update(friction=10 ** random.uniform(-2, 0))
    if random.random() < 0.2:
        options.update(spring_damping=10 ** random.uniform(-2, 0))
    return subadmm.Coordinate(**options) if options else None


def mechanism(seed, precision):
    random = np.random.default_rng(seed)
    settings = subadmm.Settings(dt=float(random.choice([0.001, 0.002, 0.005])), iterations=60, ncp_points=64)
    settings.certify = True
    world = subadmm.World(settings=settings, backend="cpu", precision=precision)
    world.add_ground()
    bodies = []
    for i in range(int(random.integers(2, 11))):
        size, mass = random.uniform(0.04, 0.1), 10 ** random.uniform(-1, 1)
        shape = random.choice(3)
        shape = (subadmm.sphere(size), subadmm.box(size, size, size), subadmm.capsule(size, size / 2))[shape]
        body = world.add_solid(shape, density=1000, position=(0.4 * i, 0, 0.3 + 0.2 * random.random()),
                               orientation=direction(random))
        scale = mass / body.mass
        body.set_mass(mass, np.array(body.inertia) * scale)
        bodies.append(body)
        if i == 0:
            continue
        kind, parent = str(random.choice(KINDS)), bodies[int(random.integers(0, i))]
        if kind == "distance":
            world.add_joint(kind, parent, body)
            continue
        acting = {k: coordinate(random) for k in FREE.get(kind, ())}
        world.add_joint(kind, parent, body, position=(np.array(parent.position) + body.position) / 2,
                        orientation=direction(random), coordinates={k: c for k, c in acting.items() if c})
    return world, bodies


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_every_step_is_solved(precision):
    steps = unsolved = iterated = 0
    for seed in range(40):
        world, bodies = mechanism(seed, precision)
        for _ in range(STEPS):
            world.step()
            report = world.report
            unsolved += report.certificate.ncp_max > 1e-6
            iterated += report.iterations > 0
            steps += 1
            assert report.joint_drift < 5e-3
        # drives of at most 10 N m on a tenth of a kilogram, for less than a second
        assert max(np.linalg.norm(body.linear_velocity) for body in bodies) < 50
    assert unsolved <= steps // 1000 and iterated <= steps // 1000, (unsolved, iterated, steps)
