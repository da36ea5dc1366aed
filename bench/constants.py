#!/usr/bin/env python3
"""What the tuned constants of src/core are worth: half of each, and twice it.

    bench/constants.py --list                   the constants and their values
    bench/constants.py [NAME...] [--csv FILE]   measures them, all by default, one a core at a time
    bench/constants.py --check                  is every tuned constant marked? (part of the tests)

Beside a tuned constant stands `measured: bench/constants.py, ` and the figures that it acts on. A variant is a build of
a copy of the sources with that one number changed, in double precision on one thread. Figures are geometric means over
a few scenes, divided by those of the sources as they are; less is better. Heaps are chaotic: there 0.7 to 1.4 means
nothing.

    cold        iterations of single problems to 1e-4 m/s
    heaps       error of steps with 10 and 20 iterations
    standing    drift, and time to settle, of stacks, pyramids, card houses, walls with 5, 10, 20 iterations
    mechanisms  joints' drift and largest error
    motion      error against motions with known answers
"""
import argparse
import collections
import concurrent.futures
import csv
import glob
import io
import json
import math
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile

PROJECT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
MARK = "measured: bench/constants.py"
MARKED = re.compile(re.escape(MARK) + r"(?:, (\w+(?: \w+)*))? \*/")
CONSTANT = re.compile(r"(?:#define +|\b)([A-Z][A-Z0-9_]{3,})(?: = | +)(\d[\d.]*(?:e-?\d+)?\b|\(1 / [\d.]+\))")
FACTORS = (0.5, 2)
FALLEN = 1  # m, the drift of a scene that does not even come to its end
TUNED = tuple(f"src/core/math/{name}.h" for name in ("weight", "energy_limit", "trapezoid"))
Constant = collections.namedtuple("Constant", "name value figures path at end")


class Failed(Exception):
    pass


# ---- the constants -----------------------------------------------------------------------------------------------

def constants_of(text, path):
    """Those of the lines with a mark."""
    start = 0
    for at, line in enumerate(text.splitlines(keepends=True)):
        start += len(line)
        if MARK not in line:
            continue
        mark, code = MARKED.search(line), line.split("/*")[0]
        found = list(CONSTANT.finditer(code))
        figures = (mark[1] or "").split() if mark else []
        if not found or not figures or not set(figures) <= set(FIGURES):
            raise Failed(f"{path}:{at + 1}: must be a constant, and '{MARK}, ' with some of {' '.join(FIGURES)}")
        for each in found:
            yield Constant(each[1], each[2], figures, path, start - len(line) + each.start(2),
                           start - len(line) + each.end(2))


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def constants(root=PROJECT):
    found = {}
    for path in sorted(glob.glob(os.path.join(root, "src", "core", "**", "*.[ch]"), recursive=True)):
        for constant in constants_of(read(path), os.path.relpath(path, root)):
            if constant.name in found:
                raise Failed(f"{constant.name}: marked in {found[constant.name].path} and {constant.path}")
            found[constant.name] = constant
    if not found:
        raise Failed(f"src/core: '{MARK}' is nowhere")
    return found


def number(value):
    """Of a literal, or of (1 / x)."""
    return 1 / float(value.strip("()").split("/")[1]) if "/" in value else float(value)


def changed(value, factor):
    """A whole number stays one, and is at least 1."""
    return str(max(round(int(value) * factor), 1)) if value.isdigit() else repr(number(value) * factor)


def check():
    """Has each constant a half and a double? Is every one of the TUNED files marked, unless it is about rounding?"""
    found = constants()
    for constant in found.values():
        if any(float(changed(constant.value, factor)) == number(constant.value) for factor in FACTORS):
            raise Failed(f"{constant.path}: {constant.name} = {constant.value} has no half and no double")
    for path in TUNED:
        above = ""
        for line in read(os.path.join(PROJECT, path)).splitlines():
            name = re.match(r"#define +(\w+) +[\d(]", line)
            if name and name[1] not in found and "rounding" not in (above + line).lower():
                raise Failed(f"{path}: {name[1]}: must have '{MARK}, ' and figures, or be rounding")
            above = above + line if line.startswith(("/*", " *")) else line


# ---- the scenes --------------------------------------------------------------------------------------------------

def output(command, allowed=(0,)):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in allowed:
        said = (done.stderr or done.stdout).splitlines()[-20:]
        raise Failed("\n".join([f"{' '.join(command)}: exit status {done.returncode}", *said]))
    return done.stdout


def mean(values, least):
    return math.exp(sum(math.log(max(value, least)) for value in values) / len(values))


def convergence(build, part, names, *more):
    option = "--problem" if part == "cold" else "--scene"
    groups = [[name] for name in names] if part == "cold" else [names[i:i + 16] for i in range(0, len(names), 16)]
    for group in groups:
        words = [word for name in group for word in (option, name)]
        yield from csv.DictReader(io.StringIO(output(
            [os.path.join(build, "bench", "subadmm-bench"), "convergence", "--only", part, "--method", "fast",
             "--csv", "-", *more, *words])))


def cold(build):
    names = ("plates", "bar", "chain", "random pile 60", "oblique_stacks", "card_houses", "burst")
    return mean([float(row["iterations"] or 2 * float(row["limit"])) for row in convergence(build, "cold", names)
                 if row["kind"] == "count" and float(row["tolerance"]) == 1e-4], 1)


def heaps(build):
    names = [f"{kind}:{count}" for kind in ("pile", "mixed_pile", "sliding_pile") for count in (140, 147, 155)]
    return mean([float(row["ncp_balanced"]) for row in convergence(build, "warm", names, "--budgets", "10,20")],
                1e-9)


def standing(build):
    names = ["vertical_stacks:12", "oblique_stacks:2", "card_houses:1", "kicked_cubes:10"]
    values = [float(row["settle_s"] or 10) / 0.01 + 1
              for row in convergence(build, "warm", names, "--budgets", "5,10,20")]
    for scene in ("pyramid:50", "card_houses:1", "dry_stone:4"):
        for iterations in ("5", "10", "20"):
            text = output([os.path.join(build, "bench", "subadmm-bench"), "stand", "--scene", scene, "--iterations",
                           iterations, "--steps", "300", "--precision", "f64", "--threads", "1"], (0, 1))
            drift = re.search(r"drift .*?: (\S+) of the", text)
            values.append((float(drift[1]) if drift else FALLEN) / 1e-6 + 1)
    return mean(values, 1)


def mechanisms(build):
    values = []
    for scene in ("chain:20", "bridge", "ragdolls:4", "four_bar", "bricard", "slider_crank", "grippers:1"):
        run = json.loads(output([os.path.join(build, "src", "subadmm"), "run", scene, "--backend", "cpu", "--precision",
                                 "f64", "--threads", "1", "--quiet", "--certify", "--json", "-"]))
        values += [run["joint_drift"] / 1e-9, run["certificate"]["ncp_max_run"] / 1e-9]
    return mean(values, 1)


def motion(build):
    lines = [line for line in output([os.path.join(build, "bench", "subadmm-bench"), "motion", "--known", "5",
                                      "--precision", "f64"]).splitlines() if line.startswith("| ")]
    return mean([float(line.split("|")[2]) for line in lines[1:]], 1e-9)


FIGURES = {"cold": cold, "heaps": heaps, "standing": standing, "mechanisms": mechanisms, "motion": motion}


# ---- the variants ------------------------------------------------------------------------------------------------

def not_sources(folder, names):
    return [name for name in names if name in (".git", "__pycache__") or
            os.path.exists(os.path.join(folder, name, "meson-info"))]  # a build folder


class Copy:
    """A copy of what the library and its commands are built from, to be changed."""

    def __init__(self, folder):
        self.root, self.build = os.path.join(folder, "copy"), os.path.join(folder, "copy", "build")
        shutil.copytree(PROJECT, self.root, ignore=not_sources, symlinks=True)
        output(["meson", "setup", self.build, self.root, "-Dcuda=disabled", "-Demulated_cuda=disabled",
                "-Dtests=disabled", "-Dpython=disabled", "-Dcpu_isas=baseline"])

    def figures(self, names, constant=None, value=None):
        if constant:
            path = os.path.join(self.root, constant.path)
            text = read(path)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text[:constant.at] + value + text[constant.end:])
        try:
            output(["ninja", "-j", "1", "-C", self.build, "src/subadmm", "bench/subadmm-bench"])
            return {name: FIGURES[name](self.build) for name in names}
        finally:
            if constant:
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)


class Copies:
    """As many copies as cores, each measuring one thing at a time."""

    def __init__(self, folder, count):
        self.free = queue.Queue()
        for k in range(count):
            self.free.put(os.path.join(folder, str(k)))
        self.made = {}

    def figures(self, names, constant=None, factor=1):
        folder = self.free.get()
        try:
            if folder not in self.made:
                self.made[folder] = Copy(folder)
            return self.made[folder].figures(names, constant, constant and changed(constant.value, factor))
        finally:
            self.free.put(folder)


def rows(names=(), factors=FACTORS):
    """One for each constant, with the factors' figures in one cell."""
    found = constants()
    chosen = [found[name] for name in names] or list(found.values())
    cores = min(len(os.sched_getaffinity(0)), 1 + len(chosen) * len(factors))
    with tempfile.TemporaryDirectory() as folder:
        copies, pool = Copies(folder, cores), concurrent.futures.ThreadPoolExecutor(cores)
        try:
            bases = {name: pool.submit(copies.figures, [name])
                     for name in FIGURES if any(name in constant.figures for constant in chosen)}
            variants = {constant.name: [pool.submit(copies.figures, constant.figures, constant, factor)
                                        for factor in factors] for constant in chosen}
            base = {name: future.result()[name] for name, future in bases.items()}
            for constant in chosen:
                measured = [future.result() for future in variants[constant.name]]
                row = {"constant": constant.name, "value": constant.value,
                       **{name: "/".join(f"{variant[name] / base[name]:.2f}" for variant in measured
                                         if name in variant) for name in FIGURES}}
                print(*row.values(), file=sys.stderr, flush=True)
                yield row
        finally:
            pool.shutdown(cancel_futures=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="which constants (default all)")
    parser.add_argument("--list", action="store_true", help="print the constants and their values")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a constant is not marked")
    parser.add_argument("--csv", metavar="FILE", help="write the rows there (default: standard output)")
    args = parser.parse_args()
    try:
        found = constants()
        wrong = [name for name in args.names if name not in found]
        if wrong:
            parser.error(f"no constant '{wrong[0]}'; there are {', '.join(found)}")
        if args.list:
            for constant in found.values():
                print(f"{constant.name} {constant.value} ({constant.path})")
        elif args.check:
            check()
        else:
            with open(args.csv, "w", encoding="utf-8", newline="") if args.csv else sys.stdout as file:
                writer = csv.DictWriter(file, ["constant", "value", *FIGURES], lineterminator="\n")
                writer.writeheader()
                for row in rows(args.names):
                    writer.writerow(row)
                    file.flush()
    except Failed as failed:
        sys.exit(str(failed))


if __name__ == "__main__":
    main()
