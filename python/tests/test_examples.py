"""The examples in Python do what they say."""

import importlib.util
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_falling_box(capsys):
    force, weight = example("falling_box").main()
    assert force == pytest.approx(weight, rel=1e-6)
    assert "4 contacts" in capsys.readouterr().out


def test_hinge_motor():
    hinge = example("hinge_motor").main()
    assert hinge.position[5] == pytest.approx(1.5, abs=1e-6)
    # At the limit the motor gives all of its 15 N m; dry friction takes up to 0.2 of them, the limit the rest.
    assert hinge.drive_force[5] == pytest.approx(15, abs=1e-6)
    assert -15.2 < hinge.limit_force[5] < -14.8 + 1e-6


def test_contact_force():
    box, normal, begun = example("contact_force").main()
    assert box.contact_wrench[:3] == pytest.approx([-8, 0, box.mass * 9.81], abs=1e-6)
    # The push and friction, 0.1 m apart, are a torque of 0.8 N m. Pairs of points 0.2 m apart differ by 4 N.
    assert sorted(normal) == pytest.approx([2.905, 2.905, 6.905, 6.905], abs=1e-3)
    assert len(begun) == 1


def test_thousand_grippers(capsys):
    grippers = example("thousand_grippers")
    held, slip = grippers.main(["--count", "15", "--backend", "cpu"])
    assert held.all() and slip.max() < 1e-4  # fingers and couplings are springs: they give by some hundredths of a mm
    assert "15 of 15 hold" in capsys.readouterr().out
    grippers.SQUEEZE = 0.0  # fingers that only touch hold nothing
    held, _ = grippers.main(["--count", "6", "--backend", "cpu"])
    assert not held.any()


@pytest.mark.parametrize("mass, lifted", [(0.2, True), (4.0, False)])
def test_arm_lifts_cube(mass, lifted, capsys):
    """Two fingers of 10.5 N with friction 1 hold 21 N: 0.2 kg, and not 4."""
    pytest.importorskip("mujoco")
    if importlib.util.find_spec("gymnasium_robotics") is None:
        pytest.skip("the arm's model is in gymnasium-robotics")
    up, height, moved = example("arm_lifts_cube").main(["--mass", str(mass)])
    assert up == lifted
    if lifted:
        # 2 mm: the last of the way that the arm is behind. The cube does not slip down (the hand's z) or along the
        # fingers. 0.5 mm: pads that are rigid may bear all of the load at one point each, about which the cube then
        # turns a little; whether they do, rounding says.
        along_fingers = (moved[0] + moved[1]) / 2**0.5
        assert height == pytest.approx(0.25, abs=2e-3)
        assert abs(moved[2]) < 5e-5 and abs(along_fingers) < 1e-4 and max(abs(moved)) < 5e-4
    else:
        assert height < 0.01
    assert ("not lifted" in capsys.readouterr().out) != lifted


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_learn_balance(seed):
    """A pole stays up after some iterations, and the same ones whenever it is learnt, on one thread or two."""
    pytest.importorskip("gymnasium", minversion="1.1")
    learn = example("learn_balance").learn
    curves = [learn(seed, threads, report=lambda line: None) for threads in (1, 2)]
    assert (curves[0] == curves[1]).all()
    assert curves[0][-1] == 200 and len(curves[0]) <= 20 and curves[0][0] < 100
