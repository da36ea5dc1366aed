"""Load models and compare them with MuJoCo: a table.

    python check_models.py FOLDER ...        # all MJCF and URDF files under them that MuJoCo compiles by themselves
    python check_models.py --list FOLDER ... # also what was not carried over, model by model

Errors are the largest of all bodies: mass and the inertia tensor (about the centre of mass, world axes) relative to the
body's largest, poses in m and as |q - q'|, at qpos0 and at a pose with every joint elsewhere. The last columns are of
1 s of motion
from qpos0: time, worst certificate of its last step, and how far joints are off (locked coordinates; m, rad).
"""

import argparse
import multiprocessing
import sys
import time
import xml.etree.ElementTree as tree
from pathlib import Path

import mujoco
import numpy as np

import subadmm
from subadmm.importing.compile import compile_file
from subadmm.importing.model import Report
from subadmm.importing.poses import q_matrix


def files_of(folders):
    """Files with a model of their own: of MJCF those with a body or a geom in a worldbody, which others do not
    include."""
    out, included = [], set()
    for folder in folders:
        for path in sorted(p for p in Path(folder).rglob("*") if p.suffix in (".xml", ".urdf", ".mjcf")):
            try:
                root = tree.parse(path).getroot()
            except (tree.ParseError, UnicodeDecodeError):
                continue
            included |= {(path.parent / i.get("file", "")).resolve() for i in root.iter("include")}
            if root.tag == "robot" or (root.tag == "mujoco" and root.find("worldbody") is not None):
                out.append(path)
    return [path for path in out if path.resolve() not in included]


def other_pose(source, seed=1):
    """Positions with every joint somewhere within its range."""
    random = np.random.default_rng(seed)
    qpos = np.array(source.qpos0)
    for j in range(source.njnt):
        at, kind = source.jnt_qposadr[j], source.jnt_type[j]
        if kind in (2, 3):
            low, high = source.jnt_range[j] if source.jnt_limited[j] else (qpos[at] - 1.0, qpos[at] + 1.0)
            qpos[at] = low + (high - low) * random.uniform(0.1, 0.9)
        else:
            q = random.normal(size=4)
            qpos[at + (3 if kind == 0 else 0) :][:4] = q / np.linalg.norm(q)
    return qpos


def data_at(source, qpos):
    data = mujoco.MjData(source)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(source, data)
    return data


def mass_errors(loaded, data):
    """Relative errors of mass and inertia, over the groups of bodies that are fixed to each other."""
    source, mass_error, inertia_error = loaded.source, 0.0, 0.0
    for group in {id(g): g for g in loaded.groups if g.kind == "dynamic"}.values():
        mass = sum(source.body_mass[i] for i in group.members)
        centre = sum(source.body_mass[i] * data.xipos[i] for i in group.members) / mass
        whole = np.zeros((3, 3))
        for i in group.members:
            turn, arm = data.ximat[i].reshape(3, 3), data.xipos[i] - centre
            whole += turn @ np.diag(source.body_inertia[i]) @ turn.T
            whole += source.body_mass[i] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        own = q_matrix(group.body.orientation)
        own = own @ np.diag(group.body.inertia) @ own.T
        mass_error = max(mass_error, abs(group.body.mass - mass) / mass)
        inertia_error = max(inertia_error, np.abs(own - whole).max() / np.abs(whole).max())
        inertia_error = max(inertia_error, np.linalg.norm(np.array(group.body.position) - centre))
    return mass_error, inertia_error


def pose_errors(loaded, data):
    """Largest differences of frames in m and |q - q'|, and of joints' positions from MuJoCo's."""
    at = turned = 0.0
    for index, group in enumerate(loaded.groups):
        position, turn = group.frame_in_world(index)
        at = max(at, np.linalg.norm(position - data.xpos[index]))
        turned = max(turned, min(np.linalg.norm(turn - data.xquat[index]), np.linalg.norm(turn + data.xquat[index])))
    off = np.abs(loaded.positions() - data.qpos)
    for j in range(loaded.source.njnt):
        if loaded.source.jnt_type[j] < 2:  # a quaternion's sign says nothing
            k = loaded.source.jnt_qposadr[j] + (3 if loaded.source.jnt_type[j] == 0 else 0)
            off[k : k + 4] = np.minimum(off[k : k + 4], np.abs(loaded.positions() + data.qpos)[k : k + 4])
    return max(at, turned), off.max() if off.size else 0.0


def lock_error(world, joints):
    """How far locked coordinates are off, m or rad."""
    worst = 0.0
    for joint in joints:
        locked = [k for k in range(6) if joint.locks >> k & 1]
        worst = max(worst, np.abs(np.array(joint.position)[locked]).max() if locked else 0.0)
    return worst


def tree_joints(loaded):
    return {id(j): j.joint for j in loaded.joints.values() if j.joint is not None}.values()


def check(path):
    """A row of the table: a dict."""
    row = {"model": path, "error": "", "notes": []}
    try:
        report = Report()
        source, _ = compile_file(path, report)
    except (FileNotFoundError, ValueError, ImportError) as error:
        row["error"] = "not compiled: " + " ".join(str(error).split())
        return row
    try:
        qpos = other_pose(source)
        flags = source.opt.disableflags
        source.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)  # no shapes: joints are looked at here
        moved = subadmm.load(source, qpos=qpos)
        source.opt.disableflags = flags
        row["moved"], row["coordinates"] = pose_errors(moved, data_at(source, qpos))
        row["locks"] = lock_error(moved.world, tree_joints(moved))
        loaded = subadmm.load(source)
    except (subadmm.Error, ValueError) as error:
        row["error"] = f"subadmm: {error}"
        return row
    data = data_at(source, source.qpos0)
    row["bodies"], row["joints"] = len({id(g) for g in loaded.groups if g.kind == "dynamic"}), source.njnt
    row["actuators"] = f"{len(loaded.actuators)}/{getattr(source, 'nactuator', source.nu)}"
    row["notes"] = [str(note) for note in [*report, *loaded.report]]
    row["mass"], row["inertia"] = mass_errors(loaded, data)
    row["pose"], _ = pose_errors(loaded, data)
    world = loaded.world
    settings = world.settings
    settings.certify, settings.dt = True, min(settings.dt, 0.005)
    world.settings = settings
    begin = time.perf_counter()
    try:
        world.step(max(1, round(1 / settings.dt)))
        row["ncp"] = world.report.certificate.ncp_max
        row["after"] = lock_error(world, tree_joints(loaded))
    except subadmm.Error as error:
        row["motion"] = str(error)
    row["seconds"] = time.perf_counter() - begin
    return row


def print_row(row, base, listed):
    name = str(row["model"].relative_to(base)) if base in row["model"].parents else str(row["model"])
    if row["error"]:
        print(f"| {name} | {row['error'][:200]} |", flush=True)
        return
    moved = row["motion"] if "motion" in row else f"{row['ncp']:.0e} | {row['after']:.0e}"
    print(
        f"| {name} | {row['bodies']} | {row['joints']} | {row['actuators']} | {len(row['notes'])} | "
        f"{row['mass']:.0e} | "
        f"{row['inertia']:.0e} | {row['pose']:.0e} | {max(row['moved'], row['coordinates'], row['locks']):.0e} | "
        f"{row['seconds']:.2f} | {moved} |",
        flush=True,
    )
    if listed:
        for note in row["notes"]:
            print("  -", note)


def worker(path, pipe):
    pipe.send(check(path))


def checked(path, limit):
    """check() in a process of its own, so that one model's time or crash is not the others'."""
    mine, its = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=worker, args=(path, its))
    process.start()
    its.close()
    row = {"model": path, "error": f"no answer within {limit} s", "notes": []}
    try:
        if mine.poll(limit):
            row = mine.recv()
    except EOFError:
        row["error"] = "the process ended"
    if process.is_alive():
        process.kill()
    process.join()
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--list", action="store_true", help="print what was not carried over")
    parser.add_argument("--jointed", action="store_true", help="print models without joints in the totals only")
    parser.add_argument("--limit", type=float, default=60, help="s a model")
    options = parser.parse_args()
    columns = (
        "model",
        "bodies",
        "joints",
        "actuators",
        "notes",
        "mass",
        "inertia",
        "pose",
        "pose elsewhere",
        "s",
        "natural map, m/s",
        "joints off",
    )
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    rows = []
    for folder in options.folders:
        for path in files_of([folder]):
            rows.append(checked(path, options.limit))
            if rows[-1].get("joints", 1) or not options.jointed:
                print_row(rows[-1], folder, options.list)
    compiled = [r for r in rows if not r["error"].startswith("not compiled")]
    loaded = [r for r in compiled if not r["error"]]
    print(f"\n{len(rows)} files; MuJoCo compiles {len(compiled)}; {len(loaded)} of these load")
    for key in ("mass", "inertia", "pose", "moved", "coordinates", "locks", "ncp", "after"):
        values = [r[key] for r in loaded if key in r]
        if values:
            print(f"{key}: worst {max(values):.1e}, median {np.median(values):.1e}")
    return 0 if len(loaded) == len(compiled) else 1


if __name__ == "__main__":
    sys.exit(main())
