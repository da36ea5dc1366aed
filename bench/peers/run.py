#!/usr/bin/env python3
"""The same scenes in several engines: time of a step, and errors measured from poses.

    bench/peers/run.py                                   all scenes and engines, a table; 20 minutes
    bench/peers/run.py --engine subadmm --engine MuJoCo --scene stack --csv stack.csv --picture stack.png
    bench/peers/run.py --list                            scenes, engines and what is set in them
    bench/peers/run.py --driver Jolt=libpeer_jolt.so     an engine of your own build, behind the functions of peer.h

Every engine makes each scene (scenes.py) with its default and with tuned settings (engines.py), by the scene's time
step and by a quarter of it, in double precision where it has that, on one thread, without sleeping. judge.py says how
errors are measured. Time is the median of the engine's own call. Engines that cannot be had are named and left out.
`--quick`: a tenth of the duration, tuned, by the whole step only.
"""
import argparse
import csv
import datetime
import math
import os
import statistics
import sys
import warnings

os.environ.setdefault("OMP_NUM_THREADS", "1")
FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [FOLDER, os.path.dirname(FOLDER)]

import numpy as np

import engines
import judge
import scenes
from report_files import machine

FRAME = 0.01            # between the times at which poses are compared, s
LIMIT = 300.0           # of a run, s of the engine's own time


def simulate(engine, scene, dt, settings, seconds, contacts=True):
    """The run, and the times of its steps, s."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)     # what misses its tolerance shows in the errors
        world = engine(scene, dt, settings)
        every, count = max(1, round(FRAME / dt)), round(seconds / dt)
        times, poses, velocities, told, costs = [0.0], [], [], [], []
        first = world.state()
        poses.append(first[0]), velocities.append(first[1])
        for k in range(count):
            costs.append(world.step(k * dt))
            if (k + 1) % every and k + 1 < count:
                continue
            state = world.state()
            times.append((k + 1) * dt)
            poses.append(state[0]), velocities.append(state[1])
            if contacts:
                told.append(world.contacts())
            if not np.isfinite(state[0]).all() or sum(costs) > LIMIT:
                break
    run = judge.Run([body.name for body in scene.bodies], np.array(times), np.array(poses), np.array(velocities),
                    [] if not told or told[0] is None else told, dt)
    return run, costs


def measure(engine, scene, dt, settings, seconds):
    key = engines.key_of(engine, scene, settings)
    run, costs = simulate(engine, scene, dt, key, seconds, "natural_map" in scene.judged)
    ended = run.times[-1] >= seconds - 1e-9
    found = judge.judge(scene, run) if ended else dict.fromkeys(scene.judged, math.inf)
    shown = {name: "" if name not in found or found[name] is None else f"{found[name]:.3g}" for name in judge.UNITS}
    return {"scene": scene.name, "engine": engine.name, "version": engine.version, "settings": settings,
            "dt": f"{dt:g}", "us_per_step": f"{1e6 * statistics.median(costs):.4g}", "steps": len(costs), **shown,
            "first": scene.judged[0], "set": engines.text_of(engine, key)}


def rows_of(names, chosen, quick, progress):
    for name in names:
        scene = scenes.SCENES[name]()   # once, so that exact motions are integrated once
        seconds = scene.duration
        if quick:
            seconds, scene.settled = max(round(scene.duration / 10 / FRAME), 4) * FRAME, 0.0
        for engine in chosen:
            for settings in ("tuned",) if quick else ("default", "tuned"):
                for part in (1,) if quick else (1, 4):
                    progress(f"{name}: {engine.name}, {settings}, dt {scene.dt / part:g}")
                    yield measure(engine, scene, scene.dt / part, settings, seconds)


def find_engines(wanted, drivers):
    """Those that can be had, and why the others cannot."""
    known = {engine.name.lower(): engine for engine in engines.all_engines(drivers)}
    for name in wanted:
        if name.lower() not in known:
            sys.exit(f"--engine {name}: must be one of {', '.join(engine.name for engine in known.values())}")
    chosen, missing = [], []
    for key, engine in known.items():
        if key not in [name.lower() for name in wanted] if wanted else engine.only_named:
            continue
        try:
            engine.find()
            chosen.append(engine)
        except engines.Missing as reason:
            missing.append(f"{engine.name} is left out: {reason}")
    return chosen, missing


def write_csv(file, rows, chosen, missing):
    versions = ", ".join(f"{engine.name} {engine.version}" for engine in chosen)
    file.write(f"# {machine()}; {datetime.date.today()}; {versions}; one thread\n")
    for line in missing:
        file.write(f"# {line}\n")
    writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)


def read_csv(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def with_unit(measure):
    return measure if judge.UNITS[measure] == "1" else f"{measure}, {judge.UNITS[measure]}"


def print_table(rows):
    for name in dict.fromkeys(row["scene"] for row in rows):
        scene = scenes.SCENES[name]()
        print(f"\n{name}: {scene.what}")
        titles = ["engine", "settings", "dt", "us_per_step", *scene.judged]
        lines = [[row[title] for title in titles] for row in rows if row["scene"] == name]
        heads = ["engine", "settings", "dt, s", "us a step", *map(with_unit, scene.judged)]
        widths = [max(len(line[k]) for line in [heads, *lines]) for k in range(len(heads))]
        for line in [heads, *lines]:
            print("  " + "  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip())


def draw(rows, path):
    """First measure of each scene against time a step, a panel a scene; hollow: default settings."""
    try:
        import matplotlib
    except ImportError:
        print("no picture: needs matplotlib (python -m pip install matplotlib)", file=sys.stderr)
        return
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import matplotlib.ticker
    names = list(dict.fromkeys(row["scene"] for row in rows))
    wide = min(5, len(names))
    figure, axes = plt.subplots(-(-len(names) // wide), wide, squeeze=False,
                                figsize=(2.9 * wide, 2.6 * -(-len(names) // wide)))
    kinds = list(dict.fromkeys(row["engine"] for row in rows))
    for axis, name in zip(axes.flat, names):
        first = scenes.SCENES[name]().judged[0]
        for row in rows:
            if row["scene"] != name or not row[first] or not math.isfinite(float(row[first])):
                continue
            scene_dt = scenes.SCENES[name]().dt
            cost = float(row["us_per_step"]) / float(row["dt"]) * 1e-3
            colour = f"C{kinds.index(row['engine'])}"
            axis.loglog(cost, max(float(row[first]), 1e-16), "o" if float(row["dt"]) == scene_dt else "s", color=colour,
                        markerfacecolor=colour if row["settings"] == "tuned" else "none")
        axis.set_title(name, fontsize="small")
        axis.set_ylabel(with_unit(first), fontsize="x-small")
        axis.tick_params(labelsize="x-small")
        axis.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        axis.grid(True, alpha=0.3)
    for axis in axes.flat[len(names):]:
        axis.set_visible(False)
    for axis in axes.flat[max(0, len(names) - wide):len(names)]:
        axis.set_xlabel("ms per simulated second", fontsize="x-small")
    marks = [plt.Line2D([], [], marker="o", linestyle="", color=f"C{k}", label=kind) for k, kind in enumerate(kinds)]
    marks += [plt.Line2D([], [], marker=mark, linestyle="", color="0.3", markerfacecolor=face, label=label)
              for mark, face, label in (("o", "none", "default"), ("o", "0.3", "tuned"), ("s", "0.3", "dt/4"))]
    figure.legend(handles=marks, loc="lower center", ncol=len(marks), fontsize="small")
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(path, dpi=100)


def print_list(drivers):
    for name, make in scenes.SCENES.items():
        print(f"{name:16}{make().what}")
    for engine in engines.all_engines(drivers):
        try:
            engine.find()
        except engines.Missing as reason:
            print(f"\n{engine.name}: {reason}")
            continue
        print(f"\n{engine.name} {engine.version}")
        for settings in engine.SETTINGS:
            print(f"  {settings}: {engines.text_of(engine, settings)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engine", action="append", default=[], metavar="NAME", help="only this one; may be repeated")
    parser.add_argument("--scene", action="append", default=[], metavar="NAME", help="likewise")
    parser.add_argument("--driver", action="append", default=[], metavar="NAME=FILE",
                        help="an engine behind peer.h, as a shared library")
    parser.add_argument("--rows", metavar="FILE", help="do not measure; take the rows of such a CSV file")
    parser.add_argument("--csv", metavar="FILE", help="write all rows (-: to standard output)")
    parser.add_argument("--picture", metavar="FILE", help="draw errors against time")
    parser.add_argument("--complete", action="store_true", help="do not measure where an engine cannot be had")
    parser.add_argument("--quick", action="store_true", help="a tenth of the duration, tuned, whole steps only")
    parser.add_argument("--list", action="store_true", help="scenes, engines and their settings")
    args = parser.parse_args()
    if args.list:
        print_list(args.driver)
        return
    for name in args.scene:
        if name not in scenes.SCENES:
            parser.error(f"--scene {name}: must be one of {', '.join(scenes.SCENES)}")
    if args.rows:
        rows = read_csv(args.rows)
        print_table(rows)
        if args.picture:
            draw(rows, args.picture)
        return
    chosen, missing = find_engines(args.engine, args.driver)
    for line in missing:
        print(line, file=sys.stderr)
    if args.complete and missing:
        sys.exit("not every engine can be had")
    if not chosen:
        sys.exit("no engine can be had")
    rows = list(rows_of(args.scene or list(scenes.SCENES), chosen, args.quick,
                        lambda line: print(line, file=sys.stderr, flush=True)))
    if args.csv == "-":
        write_csv(sys.stdout, rows, chosen, missing)
    else:
        print_table(rows)
        if args.csv:
            with open(args.csv, "w", encoding="utf-8", newline="") as file:
                write_csv(file, rows, chosen, missing)
    if args.picture:
        draw(rows, args.picture)


if __name__ == "__main__":
    main()
