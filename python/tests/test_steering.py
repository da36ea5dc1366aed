"""Leading couplings and driven joints, as the view does."""
import numpy as np
import pytest

import subadmm
from subadmm.show.chains import Finger, driven_chains
from subadmm.show.session import Session


def servo(**more):
    return subadmm.Coordinate(drive="position", drive_stiffness=50, drive_damping=2, **more)


def jaw_world():
    """A gripper of two jaws that slide, on an arm of one link, and a free lever with a motor of speed."""
    world = subadmm.World(backend="cpu", settings=subadmm.Settings(gravity=(0, 0, 0)))
    arm = world.add_body(mass=1, inertia=(0.1, 0.1, 0.1), name="arm")
    along_x = (0.5 ** 0.5, 0, 0.5 ** 0.5, 0)
    world.add_joint("revolute", None, arm, position=(0, 0, 0), coordinates={5: servo(limited=True, lower=-1, upper=2)})
    for name, x in (("left finger", -0.1), ("right finger", 0.1)):
        jaw = world.add_body(mass=0.1, inertia=(1e-4,) * 3, position=(x, 0.5, 0), name=name)
        world.add_joint("prismatic", arm, jaw, position=(x, 0.5, 0), orientation=along_x, coordinates={2: servo()})
    lever = world.add_body(mass=1, inertia=(0.1, 0.1, 0.1), position=(3, 0, 0), name="lever")
    world.add_joint("revolute", None, lever, position=(3, 0, 0),
                    coordinates={5: subadmm.Coordinate(drive="speed", target_speed=2, drive_damping=1)})
    return world


def test_chains_part_where_bodies_have_several():
    chains = driven_chains(jaw_world())
    assert [(chain.name, len(chain.joints), chain.is_finger) for chain in chains] == [
        ("arm", 1, False), ("left finger", 1, True), ("right finger", 1, True)]
    first = chains[0].joints[0]
    assert (first.lower, first.upper, first.coordinate) == (-1, 2, 5)
    hand = driven_chains(subadmm.scene("hand_demo", backend="cpu"))
    assert [(chain.name, len(chain.joints)) for chain in hand] == [
        ("wrist", 3), ("thumb", 6), ("forefinger", 6), ("middle finger", 6), ("ring finger", 6), ("little finger", 6)]


def test_where_a_finger_ends_is_where_its_body_is():
    """At the beginning, and where joints are led to."""
    world = subadmm.scene("hand_demo", backend="cpu")
    bodies, joints = world.bodies, world.get("joint_position")
    for chain in driven_chains(world)[1:]:
        place, turn, _ = Finger(chain).at([joints[joint.row, joint.coordinate] for joint in chain.joints])
        palm, tip = bodies[chain.base], bodies[chain.tip]
        assert palm.orientation == pytest.approx((1, 0, 0, 0)) and tip.name.endswith("tip")
        assert np.allclose(place + palm.position, tip.position, atol=1e-9)
        assert abs(np.dot(turn, tip.orientation)) == pytest.approx(1, abs=1e-9)


def test_joints_go_where_they_are_led_and_jaws_close():
    session = Session(jaw_world)
    steering = session.steering
    steering.start()
    steering.set_joint(steering.chains[0].joints[0], 1.5)
    hand, = steering.hands
    assert hand.apart == pytest.approx(0.2)
    steering.close(hand, opening=-0.1)
    session.step(1500)
    joints = session.world.get("joint_position")
    assert joints[0, 5] == pytest.approx(1.5, abs=1e-4)
    left, right = session.world.positions[1:3]
    assert np.linalg.norm(left - right) == pytest.approx(0.1, abs=1e-4)
    # What is not led goes on: the motor turns.
    assert session.world.get("joint_speed")[3, 5] == pytest.approx(2, abs=1e-6)
    steering.close(hand, finger=0, more=0.02)
    session.step(1500)
    left, right = session.world.positions[1:3]
    assert np.linalg.norm(left - right) == pytest.approx(0.08, abs=1e-4)


def test_a_target_goes_to_where_the_user_wants_it_without_jumps():
    def build():
        world = subadmm.World(backend="cpu", settings=subadmm.Settings(gravity=(0, 0, 0)))
        ball = world.add_solid(subadmm.sphere(0.1), mass=1)
        world.add_coupling(ball, linear_stiffness=1000, linear_damping=60, angular_stiffness=10, angular_damping=0.5)
        return world

    session = Session(build)
    session.steering.start()
    lead, = session.steering.leads
    lead.position, lead.orientation = np.array([0.2, 0, 0]), np.array([np.cos(0.5), 0, 0, np.sin(0.5)])
    reactions = []
    for _ in range(400):
        session.step()
        reactions.append(lead.reaction()[0][0])
    body = session.world.bodies[0]
    assert body.position == pytest.approx((0.2, 0, 0), abs=1e-4)
    assert abs(np.dot(body.orientation, lead.orientation)) == pytest.approx(1, abs=1e-6)
    # A jump of 0.2 m would be a reaction of 200 N and more at once.
    assert max(np.abs(np.diff(reactions))) < 60 and max(np.abs(reactions)) < 130


def test_a_led_hand_lifts_a_cube_and_feels_its_weight():
    session = Session(lambda: subadmm.scene("hand_demo", backend="cpu", settings={"threads": 1}))
    world, steering = session.world, session.steering
    cube = world.bodies[2 + 34]
    assert cube.mass == 1
    session.step(5)
    steering.start()
    assert not world.script
    lead, hand = steering.leads[0], steering.hands[0]
    assert lead.name == "palm" and len(hand.fingers) == 5 and hand.apart == pytest.approx(0.122, abs=1e-4)
    start = lead.position.copy()
    session.step(50)
    alone = lead.reaction()[0][2]                      # its own weight
    for position, opening, steps in (((0, 0, -0.117), 0, 250), ((0, 0, -0.117), -0.053, 150),
                                     ((0, 0, 0.03), -0.053, 300)):
        lead.position = start + position
        steering.close(hand, opening=opening)
        session.step(steps)
    assert cube.position[2] > 0.15
    # 1 kg; 2 %: of what it swings.
    assert alone - lead.reaction()[0][2] == pytest.approx(9.81, rel=0.02)
    steering.stop()
    assert world.script
    session.step(100)                             # the script goes on, where it is by then: it has the cube too
    assert np.isfinite(world.positions).all()
    session.reset()
    assert session.world.script and not session.steering.on


def test_only_scenes_have_a_script():
    world = subadmm.World(backend="cpu")
    assert not world.script
    with pytest.raises(ValueError, match="script"):
        world.script = True
    world.script = False
