"""Targets that go after what somebody asks for."""
import numpy as np
import pytest

from subadmm import following
from subadmm.rotations import conjugate, multiply, of_vector, to_vector, unit


def random_turns(seed, count=40):
    return unit(np.random.default_rng(seed).normal(size=(count, 4)))


def test_turns_are_those_of_rotations():
    first, second = random_turns(1), random_turns(2)
    vectors = np.random.default_rng(3).normal(size=(40, 3)) * np.logspace(-12, 0.4, 40)[:, None]
    between = following.velocity_between(np.zeros((40, 3)), first, np.ones((40, 3)), second, 0.5)
    assert np.allclose(between[:, :3], 2)
    assert np.allclose(between[:, 3:], to_vector(multiply(second, conjugate(first))) / 0.5, atol=1e-14)
    same = following.velocity_between(np.zeros((40, 3)), first, np.zeros((40, 3)), -first, 1)
    assert np.abs(same).max() < 1e-15                # a quaternion and its negative are one orientation
    assert np.allclose(following._turned(first, vectors), multiply(of_vector(vectors), first), atol=1e-15)


def test_a_follower_goes_there_without_a_jump_and_is_as_far_behind_as_it_says():
    rate, dt = 80.0, 1e-3
    follower = following.Follower(np.zeros((2, 3)), [[1, 0, 0, 0]] * 2, rate)
    follower.orientation = np.array([[0, 0, 0, 1], [0.6, 0, 0.8, 0]])
    speeds = []
    for k in range(1000):
        follower.position = np.full((2, 3), 0.3 * k * dt)        # 0.3 m/s
        at, turn, velocity = follower.step(dt)
        assert np.allclose(at + velocity[:, :3] * dt, follower.at)
        speeds.append(velocity[0, 0])
    assert speeds[-1] == pytest.approx(0.3, rel=1e-6) and np.abs(np.diff(speeds)).max() < 0.3 * rate * dt
    assert 0.3 * 999 * dt - follower.at[0, 0] == pytest.approx(0.3 * 2 / rate, rel=0.05)   # a step of 1 ms is 4 % of it
    assert np.allclose(np.abs((follower.turn * follower.orientation).sum(axis=1)), 1, atol=1e-12)
    follower.put(np.ones((2, 3)), [[1, 0, 0, 0]] * 2)
    assert (follower.step(dt)[2] == 0).all()
