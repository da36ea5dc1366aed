#!/usr/bin/env python3
"""Steps of robots, here and in MuJoCo, with the same controls: time and error.

    python -m pip install mujoco gymnasium dm_control
    bench/robots.py                      # all models of both packages that are listed below
    bench/robots.py FILE.xml ... --steps 2000
    bench/robots.py --environments 64 --threads 2

Each model is stepped with contacts, from its first pose, with random controls within their ranges that change every 50
steps, on one thread: MuJoCo by its Euler integrator and defaults, subadmm by what load() chooses, in f64 and in f32. A
line has the median of the times of blocks of 50 steps, us a step; their ratio; and of subadmm's f64 the natural map,
m/s, largest of all steps and in how many it is above 1e-6, and steps that made iterations. Run it on a quiet machine.

With --environments so many copies of each model are stepped together, on --threads threads, each with controls of its
own that change every 50 steps: MuJoCo by mujoco.rollout, subadmm by replicate(), f64. A line has the median us a step
and copy of both; what share of MuJoCo's speed that is; the largest error of the last steps of blocks, m/s; and the bytes
that a copy takes.
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


def time_rollout(mujoco, model, rows, threads):
    """us a step and copy; rows: blocks x copies x controls."""
    from mujoco import rollout

    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    workers = [mujoco.MjData(model) for _ in range(threads)]
    count = rows.shape[1]
    state, times = np.zeros((count, mujoco.mj_stateSize(model, full))), []
    for own in state:
        mujoco.mj_getState(model, workers[0], own, full)
    with rollout.Rollout(nthread=threads) as pool:
        for row in rows:
            repeated = np.repeat(row[:, None], BLOCK, axis=1)
            begin = time.perf_counter()
            states, _ = pool.rollout(model, workers, state, repeated, nstep=BLOCK)
            times.append((time.perf_counter() - begin) / BLOCK / count * 1e6)
            state = states[:, -1].copy()
    return statistics.median(times)


def time_environments(subadmm, path, rows, threads):
    """us a step and copy, the largest error, bytes a copy."""
    template = subadmm.load(path, backend="cpu")
    settings = template.world.settings
    settings.threads = threads
    template.world.settings = settings
    robots = subadmm.replicate(template, rows.shape[1])
    times, largest = [], 0.0
    for row in rows:
        robots.ctrl[:] = row
        begin = time.perf_counter()
        robots.step(BLOCK)
        times.append((time.perf_counter() - begin) / BLOCK / rows.shape[1] * 1e6)
        largest = max(largest, robots.error.max())
    if robots.failed.any():
        print(f"{path}: {robots.failed.sum()} copies failed: {robots.reason(int(np.argmax(robots.failed)))}")
    return statistics.median(times), largest, robots.memory


def compare_environments(mujoco, subadmm, chosen, arguments):
    count, threads = arguments.environments, arguments.threads
    print(f"MuJoCo {mujoco.__version__}, subadmm {subadmm.__version__}, {count} copies, {threads} threads")
    print(f"{'':24s}{'MuJoCo':>9s}{'f64':>9s}{'speed':>7s}{'error':>10s}{'bytes':>8s}")
    shares = []
    for name, path in chosen:
        model = mujoco.MjModel.from_xml_path(str(path))
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        blocks = controls(model, arguments.steps * count).reshape(-1, count, model.nu)
        other = time_rollout(mujoco, model, blocks, threads)
        own, largest, memory = time_environments(subadmm, path, blocks, threads)
        shares.append(other / own)
        print(f"{name:24s}{other:9.1f}{own:9.1f}{other / own:7.2f}{largest:10.1e}{memory:8d}", flush=True)
    print(f"median {statistics.median(shares):.2f}, least {min(shares):.2f} of MuJoCo's speed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=pathlib.Path, help="MJCF files instead")
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--environments", type=int, help="copies of each model")
    parser.add_argument("--threads", type=int, default=1, help="with --environments")
    arguments = parser.parse_args()
    import mujoco
    import subadmm

    chosen = [(file.stem, file) for file in arguments.files] or models()
    if arguments.environments:
        compare_environments(mujoco, subadmm, chosen, arguments)
        return
    print(f"MuJoCo {mujoco.__version__}, subadmm {subadmm.__version__}, one thread, {arguments.steps} steps")
    print(f"{'':24s}{'MuJoCo':>9s}{'f64':>9s}{'ratio':>7s}{'f32':>9s}{'ncp max':>10s}{'> 1e-6':>8s}{'iterated':>10s}")
    ratios = []
    for name, path in chosen:
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
