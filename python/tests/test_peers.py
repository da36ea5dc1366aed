"""bench/peers: its judge finds what is known, and the engines that there are make its scenes."""

import csv
import math
import pathlib
import subprocess
import sys

import numpy as np
import pytest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "bench" / "peers"
sys.path.insert(0, str(FOLDER))

import engines  # noqa: E402
import judge  # noqa: E402
import scenes  # noqa: E402


def run_of(scene, poses, velocities=None, dt=0.1):
    poses = np.array(poses, float)
    if velocities is None:
        velocities = np.zeros((*poses.shape[:2], 6))
    return judge.Run([body.name for body in scene.bodies], dt * np.arange(len(poses)), poses, np.array(velocities))


def start_of(scene):
    return np.array([[*body.position, *body.orientation] for body in scene.bodies])


def test_overlap_of_boxes_is_the_least_way_apart():
    scene = scenes.Scene("two", "", [scenes.box(name, (1, 1, 1), 1.0, (0, 0, 0)) for name in "ab"])
    poses = start_of(scene)
    poses[1, :3] = 0.3, 1.9, 0.2
    assert judge.overlap(scene, run_of(scene, [poses])) == pytest.approx(0.1, abs=1e-12)
    # An edge, turned by 45 degrees, reaches sqrt 2 along x.
    poses[1] = [1 + math.sqrt(2) - 0.05, 0, 0, *scenes.about((0, 0, 1), math.pi / 4)]
    assert judge.overlap(scene, run_of(scene, [poses])) == pytest.approx(0.05, abs=1e-12)
    # Two crossed edges, each reaching sqrt 2: no face says that they are apart.
    poses[0, 3:] = scenes.about((1, 0, 0), math.pi / 4)
    poses[1] = [0, 0, 2 * math.sqrt(2) + 0.01, *scenes.about((0, 1, 0), math.pi / 4)]
    assert judge.overlap(scene, run_of(scene, [poses])) == 0
    poses[1, 2] -= 0.03
    assert judge.overlap(scene, run_of(scene, [poses])) == pytest.approx(0.02, abs=1e-12)


def test_overlap_with_a_tilted_plane_and_of_balls():
    scene = scenes.slope_below()
    poses = start_of(scene)
    assert judge.overlap(scene, run_of(scene, [poses])) == pytest.approx(0, abs=1e-12)
    poses[1, :3] -= 0.004 * judge.matrices(poses[0, 3:])[:, 2]
    assert judge.overlap(scene, run_of(scene, [poses])) == pytest.approx(0.004, abs=1e-12)
    scene = scenes.cradle()
    poses = start_of(scene)
    poses[1, 0] += 0.01 + 0.002     # the gap, and more
    assert judge.overlap(scene, run_of(scene, [poses])) == pytest.approx(0.002, abs=1e-12)


def test_drift_and_creep():
    scene = scenes.stack()
    poses = np.repeat(start_of(scene)[None], 11, axis=0)
    poses[:, 3, 1] += 0.02 * np.arange(11) * 0.1
    run = run_of(scene, poses)
    assert judge.drift(scene, run) == pytest.approx(0.02)
    assert judge.creep(scene, run) == pytest.approx(0.02)


def test_joint_errors_and_slip():
    scene = scenes.four_bar()
    poses = start_of(scene)
    assert judge.joint_error(scene, run_of(scene, [poses])) < 1e-15
    poses[2, 1] += 0.003
    assert judge.joint_error(scene, run_of(scene, [poses])) == pytest.approx(0.003)
    poses = start_of(scene)
    poses[0, 3:] = scenes.about((0, 0, 1), 0.01) @ quaternion_product(poses[0, 3:])     # its axis leans by 0.01
    assert judge.joint_error(scene, run_of(scene, [poses])) == pytest.approx(0.01, rel=1e-3)
    scene = scenes.grip()
    poses = np.repeat(start_of(scene)[None], 2, axis=0)
    poses[1, 1:, 2] += 0.3
    poses[1, 2, 2] -= 0.001
    scene.settled = 0.0
    assert judge.slip(scene, run_of(scene, poses)) == pytest.approx(0.001)


def quaternion_product(q):
    """The matrix that multiplies a row by q from the right."""
    w, x, y, z = q
    return np.array([[w, x, y, z], [-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])


def test_energy_and_error_of_a_throw():
    body = scenes.ball("ball", 0.1, 2.0, (0, 0, 0), velocity=(1, 0, 3))
    scene = scenes.Scene("throw", "", [body], exact=lambda t: {"ball": np.array([t, 0, 3 * t - 9.81 * t * t / 2])})
    times = 0.1 * np.arange(11)
    poses = np.array([[[*scene.exact(t)["ball"], 1, 0, 0, 0]] for t in times])
    velocities = np.array([[[1, 0, 3 - 9.81 * t, 0, 0, 0]] for t in times])
    run = run_of(scene, poses, velocities)
    assert judge.energy_error(scene, run) < 1e-14 and judge.error(scene, run) == 0
    run.velocities[-1, 0, 3] = 4.0
    share = 0.5 * 0.4 * 0.01 * 16 / (0.5 * (1 + (3 - 9.81) ** 2) + 0.5 * 0.4 * 0.01 * 16)
    assert judge.energy_error(scene, run) == pytest.approx(share)
    run.poses[4, 0, 1] += 0.007
    assert judge.error(scene, run) == pytest.approx(0.007)


def test_tumbling_keeps_energy_and_turns_over():
    exact = scenes.tumbling().exact
    start, end = exact.state_at(0.0), exact.state_at(2.0)
    energy = [exact.moments @ (state[4:] ** 2) for state in (start, end)]
    assert np.linalg.norm(end[:4]) == pytest.approx(1, abs=1e-12)
    assert energy[1] == pytest.approx(energy[0], rel=1e-12) and not np.allclose(start, end)


@pytest.mark.parametrize("make", [scenes.chain, scenes.four_bar])
def test_bars_start_in_the_scene_keep_energy_and_stay_closed(make):
    scene, exact = make(), make().exact
    start, end = exact.state_at(0.0), exact.state_at(0.5)
    for body in scene.bodies:
        assert exact.poses(start)[body.name] == pytest.approx(body.position, abs=1e-12)
    count = len(scene.bodies)
    for state in (start, end):
        angle, speed = state[:count], state[count:]
        if exact.closed:
            assert exact.lengths @ np.cos(angle) == pytest.approx(0.5) and abs(exact.lengths @ np.sin(angle)) < 1e-9
        kinetic = 0.5 * speed @ (exact.coupling * np.cos(angle[:, None] - angle) + exact.moment) @ speed
        assert kinetic + exact.weight @ np.sin(angle) == pytest.approx(exact.weight @ np.sin(start[:count]), rel=1e-8)
    assert kinetic > 0.1


def contact(force, velocity, gap=0.0):
    """One of a ball of 1 kg on the ground, friction 0.5."""
    scene = scenes.Scene("ball", "", [scenes.ground(), scenes.ball("ball", 1.0, 1.0, (0, 0, 1.0))])
    velocities = np.zeros((2, 6))
    velocities[1, :3] = velocity
    poses = start_of(scene)
    return judge.contact_errors(scene, judge.Contacts(
        np.array([0]), np.array([1]), np.zeros((1, 3)), np.array([[0, 0, 1.0]]), np.array([gap]), np.array([0.5]),
        np.array([force], float), poses[:, :3], poses[:, 3:], velocities), dt=0.01)[0]


def test_natural_map_is_zero_for_the_law_and_a_speed_otherwise():
    assert contact((0, 0, 10), (0, 0, 0)) == 0                      # rests
    assert contact((4, 0, 10), (0, 0, 0)) == 0                      # sticks within the cone
    assert contact((-5, 0, 10), (2, 0, 0)) == pytest.approx(0)      # slides
    assert contact((0, 0, 0), (1, 0, 0.5)) == 0                     # leaves
    assert contact((0, 0, 0), (0, 0, -0.1), gap=0.001) == pytest.approx(0)      # may close the gap, and no more
    assert contact((0, 0, 0), (0, 0, -0.3), gap=0.001) == pytest.approx(0.2)
    assert contact((0, 0, 10), (0, 0, 0.1), gap=-0.001) == pytest.approx(0)     # parts within the step
    assert contact((0, 0, 10), (0.003, 0, 0)) == pytest.approx(0.003)           # creeps
    assert contact((7, 0, 10), (0, 0, 0)) == pytest.approx(2 * 0.01 * 3.5)      # beyond the cone, w = 1 + 1/0.4


@pytest.mark.parametrize("engine", ["subadmm", "MuJoCo", "Bullet", "ODE"])
def test_quick_run(engine, tmp_path):
    try:
        next(known for known in engines.all_engines() if known.name == engine).find()
    except engines.Missing as reason:
        if engine == "subadmm":
            raise
        pytest.skip(str(reason))
    path = tmp_path / "rows.csv"
    names = ("stack", "heavy_on_light", "slope_below", "slope_above", "grip", "four_bar", "cradle")
    subprocess.run([sys.executable, str(FOLDER / "run.py"), "--quick", "--engine", engine, "--csv", str(path),
                    *(word for name in names for word in ("--scene", name))], check=True, capture_output=True)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    rows = {row["scene"]: row for row in csv.DictReader(lines)}
    assert set(rows) == set(names)
    # What is built wrongly falls, slides or breaks within the run, by far more than any engine errs.
    assert float(rows["stack"]["drift"]) < 5e-3 and float(rows["heavy_on_light"]["overlap"]) < 5e-3
    assert float(rows["slope_below"]["drift"]) < 1e-3 and float(rows["grip"]["slip"]) < 1e-3
    assert float(rows["four_bar"]["joint_error"]) < 1e-3 and float(rows["four_bar"]["error"]) < 5e-3
    assert float(rows["cradle"]["error"]) < 1e-9
    if engine == "subadmm":
        assert float(rows["stack"]["natural_map"]) < 1e-8 and float(rows["grip"]["slip_rate"]) < 1e-9
        assert float(rows["slope_above"]["error"]) < 1e-4


def test_what_cannot_be_had_is_named(tmp_path):
    done = subprocess.run([sys.executable, str(FOLDER / "run.py"), "--engine", "Jolt"], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 1 and "Jolt is left out" in done.stderr and "peer.h" in done.stderr
    done = subprocess.run([sys.executable, str(FOLDER / "run.py"), "--driver", "Mine=/nowhere.so", "--engine", "Mine"],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "Mine is left out: /nowhere.so" in done.stderr
