#!/usr/bin/env python3
"""Steps of robots, here and in MuJoCo, with the same controls: time and error.

    python -m pip install mujoco gymnasium dm_control
    bench/robots.py                      # all models of both packages that are listed below
    bench/robots.py FILE.xml ... --steps 2000

Each model is stepped with contacts, from its first pose, with random controls within their ranges that change every 50
steps, on one thread: MuJoCo by its Euler integrator and defaults, subadmm by what load() chooses, in f64 and in f32. A
line has the median of the times of blocks of 50 steps, us a step; their ratio; and of subadmm's f64 the natural map,
m/s, largest of all steps and in how many it is above 1e-6, and steps that made iterations. Run it on a quiet machine.
"""
import argparse
import importlib.util
import os
import pathlib
import statistics
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

MODELS = {
    "gymnasium": ("envs/mujoco/assets", "ant half_cheetah hopper humanoid swimmer walker2d_v5".split()),
    "dm_control": ("suite", "dog humanoid quadruped".split()),
}
BLOCK = 50


def models():
    for package, (folder, names) in MODELS.items():
        spec = importlib.util.find_spec(package)
        if spec is None:
            print(f"{package} is not installed: its models are left out", file=sys.stderr)
            continue
        for name in names:
            yield f"{package}/{name}", pathlib.Path(spec.origin).parent / folder / f"{name}.xml"


def controls(model, steps):
    """One row a block: within the ranges of limited controls, else within [-1, 1]."""
    limited = model.actuator_ctrllimited.astype(bool)
    low = np.where(limited, model.actuator_ctrlrange[:, 0], -1)
    high = np.where(limited, model.actuator_ctrlrange[:, 1], 1)
    return np.random.default_rng(1).uniform(low, high, (steps // BLOCK, model.nu))


def time_mujoco(mujoco, model, rows):
    data, times = mujoco.MjData(model), []
    for row in rows:
        data.ctrl[:] = row
        begin = time.perf_counter()
        for _ in range(BLOCK):
            mujoco.mj_step(model, data)
        times.append((time.perf_counter() - begin) / BLOCK * 1e6)
    return statistics.median(times)


def run_ours(subadmm, path, rows, precision, step_by_step):
    """us a step; step by step: also the largest natural map, steps above 1e-6 m/s, steps with iterations."""
    model = subadmm.load(path, backend="cpu", precision=precision)
    world, actuators = model.world, list(model.actuators.values())
    times, maps, iterated = [], [], 0
    if step_by_step:
        settings = world.settings
        settings.certify = True
        world.settings = settings
    for row in rows:
        for actuator, value in zip(actuators, row):
            actuator.control = value
        if step_by_step:
            for _ in range(BLOCK):
                world.step()
                maps.append(world.report.certificate.ncp_max)
                iterated += world.report.iterations > 0
            continue
        begin = time.perf_counter()
        world.step(BLOCK)
        times.append((time.perf_counter() - begin) / BLOCK * 1e6)
    if step_by_step:
        return max(maps), sum(x > 1e-6 for x in maps), iterated
    return statistics.median(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=pathlib.Path, help="MJCF files instead")
    parser.add_argument("--steps", type=int, default=1000)
    arguments = parser.parse_args()
    import mujoco
    import subadmm

    print(f"MuJoCo {mujoco.__version__}, subadmm {subadmm.__version__}, one thread, {arguments.steps} steps")
    print(f"{'':24s}{'MuJoCo':>9s}{'f64':>9s}{'ratio':>7s}{'f32':>9s}{'ncp max':>10s}{'> 1e-6':>8s}{'iterated':>10s}")
    ratios = []
    for name, path in [(file.stem, file) for file in arguments.files] or models():
        model = mujoco.MjModel.from_xml_path(str(path))
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        rows = controls(model, arguments.steps)
        other = time_mujoco(mujoco, model, rows)
        own = run_ours(subadmm, path, rows, "f64", False)
        single = run_ours(subadmm, path, rows, "f32", False)
        largest, above, iterated = run_ours(subadmm, path, rows, "f64", True)
        ratios.append(own / other)
        print(f"{name:24s}{other:9.1f}{own:9.1f}{own / other:7.2f}{single:9.1f}{largest:10.1e}{above:8d}{iterated:10d}",
              flush=True)
    print(f"median ratio {statistics.median(ratios):.2f}, largest {max(ratios):.2f}")


if __name__ == "__main__":
    main()
