"""Hands in a world: joints, recordings, couplings and what they feel."""
import numpy as np
import pytest

import subadmm
from subadmm import hands
from subadmm.hands import joints as of_joints
from subadmm.rotations import multiply, rotate
from test_examples import example

TURN = np.array([0.8, 0.3, -0.4, 0.33]) / np.linalg.norm([0.8, 0.3, -0.4, 0.33])


def world_of(**settings):
    return subadmm.World(backend="cpu", settings=subadmm.Settings(dt=0.002, threads=1, **settings))


# ---- joints --------------------------------------------------------------------------------------------------------


def test_webxr_joints_are_the_21_and_four_more():
    """The names as WebXR Hand Input has them; its joint k is where this order puts it."""
    assert len(hands.JOINTS) == 21 and len(hands.XR_JOINTS) == 25
    every = np.arange(75.0).reshape(25, 3)
    kept = hands.as_joints(every)
    assert (hands.as_joints(every.ravel()) == kept).all() and kept.shape == (21, 3)
    names = dict(zip(hands.XR_JOINTS, every[:, 0]))
    assert {joint: kept[k, 0] for k, joint in enumerate(hands.JOINTS) if joint in ("wrist", "thumb_tip", "index_mcp",
                                                                                  "little_tip")} == {
        "wrist": names["wrist"], "thumb_tip": names["thumb-tip"], "index_mcp": names["index-finger-phalanx-proximal"],
        "little_tip": names["pinky-finger-tip"]}


@pytest.mark.parametrize("side", of_joints.SIDES)
def test_frames_turn_with_the_hand_and_left_mirrors_right(side):
    joints = hands.grasping(side, (0, 0, 0), opening=0.06)
    places, turns = hands.parts_of(joints, side)
    # Fingers point to x, the back of the hand is up; tips of fingers and thumb are apart along x and point down.
    assert np.allclose(rotate(turns[0], np.eye(3))[2], [0, 0, 1], atol=1e-12)
    assert rotate(turns[0], np.array([1.0, 0, 0]))[0] > 0.99
    assert np.allclose(rotate(turns[1:], np.array([1.0, 0, 0])), [0, 0, -1], atol=1e-12)
    assert np.allclose(places[1], [-0.03, 0, 0]) and np.allclose(places[2:, 0], 0.03)
    assert (places[2, 1] > places[5, 1]) == (side == "right")       # the index finger is beside the thumb
    for turn in (TURN, [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]):   # all branches of quaternions from axes
        moved_places, moved_turns = hands.parts_of(rotate(np.array(turn, float), joints) + [1, 2, 3], side)
        assert np.allclose(moved_places, rotate(np.array(turn, float), places) + [1, 2, 3])
        assert np.allclose(np.abs((moved_turns * multiply(np.array(turn, float), turns)).sum(axis=1)), 1)
    other = hands.grasping("left" if side == "right" else "right", (0, 0, 0), opening=0.06)
    assert np.allclose(other * [1, -1, 1], joints)


def test_a_hand_that_is_open_by_so_much_has_bones_of_the_same_length():
    def bones(opening):
        joints = hands.grasping("right", (0, 0, 0), opening=opening)
        return np.concatenate([np.linalg.norm(np.diff(joints[first:first + 4], axis=0), axis=1)
                               for first in (1, 5, 9, 13, 17)])

    assert np.allclose([bones(opening) for opening in (-0.02, 0, 0.03, 0.08, hands.WIDEST)], bones(0.05), atol=1e-12)


@pytest.mark.parametrize("change, error, said", [
    (lambda joints: joints[:20], TypeError, "21 or 25 joints"),
    (lambda joints: "joints", TypeError, "21 or 25 joints"),
    (lambda joints: joints.T.reshape(3, 21), TypeError, "21 or 25 joints"),
    (lambda joints: joints + 1j, TypeError, "21 or 25 joints"),
    (lambda joints: np.where(np.arange(21)[:, None] == 7, np.nan, joints), ValueError, r"joints\[7\]"),
    (lambda joints: joints + 1e7, ValueError, r"joints\[0\].*1e\+06"),
    (lambda joints: 0 * joints, ValueError, "one line"),
    (lambda joints: np.where(np.arange(21)[:, None] == 12, joints[11], joints), ValueError, "tip of the middle"),
])
def test_joints_that_are_none_are_refused_and_change_nothing(change, error, said):
    joints = hands.grasping("right", (0, 0, 0.3))
    with pytest.raises(error, match=said):
        hands.parts_of(change(joints), "right")
    world = world_of()
    with pytest.raises(error, match=said):
        hands.Hand(world, "right", change(joints))
    assert world.body_count == 0
    hand = hands.Hand(world, "right", joints)
    for call in (hand.go, hand.place):
        with pytest.raises(error, match=said):
            call(change(joints))
    hand.before_step()
    assert np.allclose([coupling.target[0] for coupling in hand.couplings], world.positions)


def test_other_arguments_are_refused():
    world, joints = world_of(), hands.grasping("right", (0, 0, 0.3))
    for wrong, said in (({"side": "up"}, "side: 'up'"), ({"friction": -1}, "friction: -1"),
                        ({"tip_force": 0}, "tip_force: 0"), ({"size": 0}, "size: 0"),
                        ({"palm_force": float("nan")}, "palm_force: nan")):
        with pytest.raises(ValueError, match=said):
            hands.Hand(world, **{"side": "right", "joints": joints, **wrong})
    with pytest.raises(TypeError, match="world"):
        hands.Hand(None, "right", joints)
    with pytest.raises(ValueError, match="motion: is of the left hand"):
        hands.Hand(world_of(), "right", joints).follow(hands.Motion([0], joints[None], "left"), 0)
    with pytest.raises(ValueError, match="opening: 0.2"):
        hands.grasping("right", (0, 0, 0), opening=0.2)
    with pytest.raises(ValueError, match="orientation"):
        hands.grasping("right", (0, 0, 0), (0, 0, 0, 0))
    assert world.body_count == 0 and not world.couplings


# ---- hands ---------------------------------------------------------------------------------------------------------


def test_hands_go_to_where_they_are_led_and_do_not_meet_themselves():
    world = world_of(gravity=(0, 0, 0))
    both = {side: hands.Hand(world, side, hands.grasping(side, (0, y, 0.3))) for side, y in (("left", 0.3),
                                                                                           ("right", -0.3))}
    wanted = {side: hands.grasping(side, (0.2, hand.bodies[0].position[1], 0.5), (0, 0, 0, 1), 0.0)
              for side, hand in both.items()}
    for _ in range(400):
        for side, hand in both.items():
            hand.go(wanted[side])
            hand.before_step()
        world.step()
        assert all(hand.after_step() == [] for hand in both.values())  # tips are in the same place, and pass
    for side, hand in both.items():
        places, turns = hands.parts_of(wanted[side], side)
        at = np.array([body.position for body in hand.bodies])
        turn = np.array([body.orientation for body in hand.bodies])
        reach = np.array([[0.0, 0, 0]] + [[hands.TIP_RADIUS + of_hand_half(), 0, 0]] * 5)
        assert np.allclose(at + rotate(turn, reach), places, atol=1e-6)
        assert np.allclose(np.abs((turn * turns).sum(axis=1)), 1, atol=1e-9)
        # 0.8 s is over: nothing moves, and nothing is felt.
        assert np.abs(hand.reactions).max() < 1e-3
    both["left"].remove()
    assert world.body_count == 6 and len(world.couplings) == 6


def of_hand_half():
    from subadmm.hands.hand import TIP_HALF
    return TIP_HALF


def test_a_tip_presses_with_its_bounded_force_and_touches_are_told():
    """On a wall: the target goes through it; the tip stays, and presses with the spring's force, at most tip_force."""
    world = world_of(gravity=(0, 0, 0))
    world.add_solid(subadmm.box(0.02, 0.5, 0.5), mass=1, type="static", position=(0.2, 0, 0.3))
    said, touches = [], []
    hand = hands.Hand(world, "right", hands.grasping("right", (0, 0, 0.3), opening=0.05), tip_force=3,
                      on_touch=said.append)
    for k in range(1000):
        forward = 0.19 * min(k, 1000 - k) / 500      # there and back
        hand.go(hands.grasping("right", (forward, 0, 0.3), opening=0.05))
        hand.before_step()
        world.step()
        touches += hand.after_step()
        if k == 500:
            # 3 N along each axis of the target, which is turned a little; at rest the spring bears that.
            assert ((hand.forces[2:, 0] < -3) & (hand.forces[2:, 0] > -3 * 3 ** 0.5)).all()
            assert np.allclose(hand.forces[2:, 0], hand.reactions[2:, 0], atol=1e-3)
            assert (np.abs(hand.forces[1]) < 1e-9).all()            # the thumb is behind
            assert hand.bodies[2].position[0] <= 0.18 - hands.TIP_RADIUS + 1e-4
    assert said == touches
    for part in ("index", "middle", "ring", "little"):
        of = [touch for touch in touches if touch.part == part]
        assert [touch.begun for touch in of] == [True, False] and of[0].side == "right"
        assert of[0].force[0] < -0.05 and (of[1].force == 0).all()
    assert not any(touch.part == "thumb" for touch in touches)


def test_a_hand_of_another_size_moves_alike():
    """All lengths, its way too, are eight times as large, and forces 4096 times."""
    seen = []
    for size in (1, 8):
        world = world_of(gravity=(0, 0, 0))
        world.add_solid(subadmm.box(0.02 * size, 0.5 * size, 0.5 * size), mass=1, type="static",
                        position=(0.1 * size, 0, 0.3 * size))
        hand = hands.Hand(world, "left", size * hands.grasping("left", (0, 0, 0.3), opening=0.05), size=size)
        touches = []
        for k in range(150):
            hand.go(size * hands.grasping("left", (0.1 * min(k / 100, 1), 0, 0.3), opening=0.05))
            hand.before_step()
            world.step()
            touches += [(k, touch.part, touch.begun) for touch in hand.after_step()]
        seen.append((world.positions / size, hand.forces / size ** 4, touches))
    # 1e-4 m, N: of the position correction's speed and slop, which are lengths that do not grow.
    assert np.allclose(seen[0][0], seen[1][0], atol=1e-4) and np.allclose(seen[0][1], seen[1][1], atol=0.1)
    assert np.abs(seen[0][1][2:, 0]).min() > 5 and seen[0][2] == seen[1][2]


def test_a_hand_is_placed_at_once():
    world = world_of(gravity=(0, 0, 0))
    hand = hands.Hand(world, "left", hands.grasping("left", (0, 0, 0.3)))
    hand.go(hands.grasping("left", (1, 0, 0.3)))
    for _ in range(20):
        hand.before_step()
        world.step()
    assert np.linalg.norm(world.velocities) > 1
    hand.place(hands.grasping("left", (5, 0, 0.3)))
    for _ in range(20):
        hand.before_step()
        world.step()
    assert np.allclose(hands.parts_of(hands.grasping("left", (5, 0, 0.3)), "left")[0][0], hand.bodies[0].position)
    assert np.abs(world.velocities).max() < 1e-9


def test_forces_that_are_not_recovered_are_said():
    world = world_of(recover_wrenches=False)
    hand = hands.Hand(world, "left", hands.grasping("left", (0, 0, 0.3)))
    hand.before_step()
    world.step()
    with pytest.raises(subadmm.Unavailable):
        hand.after_step()


# ---- recordings ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def lifting():
    return example("lift_by_hand")


@pytest.mark.parametrize("side, mass", [("right", 0.3), ("left", 0.3), ("right", 1.0)])
def test_a_recorded_hand_lifts_a_cube_by_friction(lifting, side, mass, tmp_path, capsys):
    cube, forces = lifting.main(["--side", side, "--mass", str(mass), "--file", str(tmp_path / "lift.csv")])
    # 12 cm, less what the couplings of the tips give: 9.81 N on springs of 4,000 N/m together.
    assert 0.12 - 9.81 * mass / 4000 == pytest.approx(cube.position[2] - lifting.HALF, abs=3e-3)
    # The hand rests: the force of all contacts is the cube's weight. 0.2 %: what it still swings.
    assert -forces.sum(axis=0) == pytest.approx([0, 0, 9.81 * mass], abs=2e-3 * 9.81 * mass)
    assert forces[0] == pytest.approx([0, 0, 0], abs=1e-9)             # by fingertips alone
    # Thumb against fingers, each within its cone of friction (1).
    assert forces[1, 0] < -5 and (forces[2:, 0] > 1).all()
    assert (np.hypot(forces[1:, 1], forces[1:, 2]) <= np.abs(forces[1:, 0]) * (1 + 1e-6)).all()
    assert "the cube weighs" in capsys.readouterr().out


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_a_world_that_is_restored_makes_the_same_steps_with_its_hand(lifting, precision):
    motion = lifting.record()
    world = subadmm.World(backend="cpu", precision=precision, settings=subadmm.Settings(dt=0.004, threads=1))
    world.add_ground(friction=0.8)
    world.add_solid(subadmm.box(*[lifting.HALF] * 3, friction=1), mass=0.3, position=(0, 0, lifting.HALF), name="cube")
    hand = hands.Hand(world, "right", motion.at(0))

    def run(first, last):
        for k in range(first, last):
            hand.follow(motion, k * 0.004)
            world.step()
            hand.after_step()
        return world.positions, hand.forces

    run(0, 350)
    saved = world.save()
    positions, forces = run(350, 500)
    assert world["cube"].position[2] > lifting.HALF + 0.1
    world.restore(saved)
    again, felt = run(350, 500)
    assert (again == positions).all() and (felt == forces).all()


def test_what_friction_cannot_hold_stays_on_the_ground(lifting):
    """The thumb presses with 7.7 N: friction holds 15.3 N at most."""
    cube, forces = lifting.lift(lifting.record(), mass=3)
    assert cube.position[2] == pytest.approx(lifting.HALF, abs=1e-4) and np.abs(forces).max() < 1e-6


def test_files_bring_back_the_same_motion(lifting, tmp_path):
    motion = lifting.record("left")
    motion.save(tmp_path / "a.csv")
    again = hands.Motion.load(tmp_path / "a.csv", "left")
    assert (again.times == motion.times).all() and (again.joints == motion.joints).all() and again.side == "left"
    text = (tmp_path / "a.csv").read_text().splitlines()
    assert text[0].startswith("time,wrist_x,wrist_y,wrist_z,thumb_cmc_x") and len(text[1].split(",")) == 64
    # Without names, with comments, with a byte order mark, as other programs write it.
    (tmp_path / "b.csv").write_text("\ufeff# by hand\n\n" + "\r\n".join(text[1:]) + "\n,,\n".replace(",,\n", ""),
                                    encoding="utf-8")
    assert (hands.Motion.load(tmp_path / "b.csv").joints == motion.joints).all()


@pytest.mark.parametrize("line, said", [
    ("1" + ",0" * 62, "2: has 63 columns; must be 64"),
    ("1" + ",0" * 64, "2: has 65 columns"),
    ("x" + ",0" * 63, "2: time: 'x'"),
    ("1" + ",0" * 5 + ",nan" + ",0" * 57, "2: thumb_cmc_z: 'nan'"),
    ("1,1e7" + ",0" * 62, "2: wrist_x: '1e7'; must be a number in"),
    ("1," + ",0" * 62, "2: wrist_x: ''"),
    ("0" + ",0" * 63, "2: time 0.0; must be greater than the one before, 0.0"),
])
def test_files_that_are_wrong_say_where(line, said, tmp_path):
    path = tmp_path / "wrong.csv"
    path.write_text("0" + ",0" * 63 + "\n" + line + "\n")
    with pytest.raises(ValueError, match=said):
        hands.Motion.load(path)


def test_no_file_no_numbers_and_no_text(tmp_path):
    with pytest.raises(FileNotFoundError):
        hands.Motion.load(tmp_path / "none.csv")
    (tmp_path / "empty.csv").write_text("time,wrist_x\n# nothing\n")
    with pytest.raises(ValueError, match="has no line of numbers"):
        hands.Motion.load(tmp_path / "empty.csv")
    (tmp_path / "bytes.csv").write_bytes(bytes(range(256)))
    with pytest.raises(ValueError, match="bytes.csv:.*(is no CSV|columns)"):
        hands.Motion.load(tmp_path / "bytes.csv")
    with pytest.raises(ValueError, match="side: 'both'"):
        hands.Motion.load(tmp_path / "empty.csv", "both")


def test_between_frames_it_goes_on_smoothly_and_rests_at_its_ends():
    times = np.array([0.0, 0.1, 0.25, 0.4])
    base = hands.grasping("right", (0, 0, 0))
    motion = hands.Motion(times, base + np.array([0, 0.1, 0.25, 0.4])[:, None, None])   # 1 m/s
    assert motion.duration == pytest.approx(0.4)
    for k, time in enumerate(times):
        assert np.allclose(motion.at(time), motion.joints[k], atol=1e-15)
    assert np.allclose(motion.at(0.17), base + 0.17)                # exact where it moves steadily
    assert (motion.at(-1) == motion.joints[0]).all() and (motion.at(9) == motion.joints[-1]).all()
    fine = np.array([motion.at(t)[0, 0] for t in np.linspace(-0.1, 0.5, 6001)])
    speed = np.diff(fine) / 1e-4
    assert np.abs(np.diff(speed)).max() < 0.02                      # no jumps: 1e-4 s of at most 60 m/s^2
    moved = motion.moved((1, 2, 3), (0, 0, 0, 2), 2)
    assert np.allclose(moved.at(0.17), (base + 0.17) * [-2, -2, 2] + [1, 2, 3])
    one = hands.Motion([5], base[None])
    assert one.duration == 0 and (one.at(7) == base).all()


@pytest.mark.parametrize("times, error, said", [
    ([0, 0], ValueError, r"times\[1\]: 0.0; must be greater"), ([0, float("nan")], ValueError, r"times\[1\]: nan"),
    ([], TypeError, "times"), ([0, 1, 2], TypeError, "joints: must be 3 x 21 x 3"), ("ab", TypeError, "times"),
])
def test_motions_that_are_none_are_refused(times, error, said):
    with pytest.raises(error, match=said):
        hands.Motion(times, [hands.grasping("right", (0, 0, 0))] * 2)
    motion = hands.Motion([0], [hands.grasping("right", (0, 0, 0))])
    for wrong in ({"scale": 0}, {"scale": float("inf")}, {"orientation": (0, 0, 0, 0)}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            motion.moved(**wrong)
