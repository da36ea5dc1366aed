"""What is measured, and what the tables of the documents show of it (bench/report.py): one entry of REPORTS each.

Times are medians over the repeats of the median step; errors are measured in runs of their own, since the certificate
takes time. A backend is a column of some reports: their rows on a GPU are measured by themselves, Tools.backend.
"""
import concurrent.futures
import csv
import io
import json
import math
import os
import re
import statistics
import subprocess
import sys
import time
import typing

import constants
import profiles

PROJECT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ABLATION_SCENES = ["vertical_stacks", "card_houses:1", "pile:300", "ragdolls:4", "hand_demo"]
PRECISION_SCENES = ["vertical_stacks:12", "oblique_stacks:2", "card_houses:1", "sliding_cubes:500", "pile:200",
                    "settled_pile:1000", "pyramid:30", "chain:20", "ragdolls:4", "grippers:8"]
SCENES = ["vertical_stacks", "oblique_stacks", "card_houses", "sliding_cubes:2000", "mixed_pile", "hand_demo"]
PEERS = os.path.join(PROJECT, "bench", "peers", "run.py")
ENGINES = ["subadmm", "MuJoCo", "Bullet", "ODE"]
LARGE = ["settled_pile:100000", "pile:100000"]
# Cases of `stress` with more than 5000 steps a row: shortened on a GPU, which takes 0.1 ms for a step of a small world.
LONG_CASES = ["step_at_rest", "step_sliding", "stiffness", "damping", "stiff_damped", "free_spring", "free_spin", "top",
              "gyroscope", "rolling", "rocking", "gas", "pendulum", "mechanism", "far"]


def part_of(row):
    """Rows of a CSV file are in two parts: those measured on a GPU, and the others."""
    return "cuda" if row.get("backend") == "cuda" else "cpu"


class Missing(Exception):
    """What a report needs is not here."""


class Failed(Exception):
    """A report could not be made."""


class Tools:
    def __init__(self, build, repeats=3, quick=False, backend="cpu", seconds=math.inf):
        self.subadmm = os.path.join(build, "src", "subadmm")
        self.bench = os.path.join(build, "bench", "subadmm-bench")
        self.repeats = 1 if quick else repeats
        self.quick = quick
        self.backend = backend
        self.end = time.monotonic() + seconds

    def choose(self, whole, quick):
        return quick if self.quick else whole

    def start(self, command):
        """A command's exit status, output and errors. Missing: it says which option builds what it needs."""
        left = self.end - time.monotonic()
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False,
                                  timeout=max(left, 0) if math.isfinite(left) else None)
        except subprocess.TimeoutExpired:
            raise Failed("the time is over") from None
        needed = re.search(r"^.*-D\w+=enabled.*$", done.stderr, re.M)
        if done.returncode and needed:
            raise Missing(needed[0])
        return done

    @staticmethod
    def must(command, done, allowed=(0,)):
        if done.returncode not in allowed:
            raise Failed(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")

    def output(self, command):
        done = self.start(command)
        self.must(command, done)
        return done.stdout

    def device(self):
        """The GPU's name."""
        listed = json.loads(self.output([self.subadmm, "backends", "--json"]))["backends"]
        cuda = next(backend for backend in listed if backend["name"] == "cuda")
        if not cuda["f32"] or not cuda["f64"]:
            raise Missing(f"backend cuda: {cuda['reason']}")
        return cuda["reason"]

    def run(self, scene, *options):
        steps = self.choose((), ("--steps", "10"))
        return json.loads(self.output([self.subadmm, "run", scene, "--quiet", "--json", "-", *options, *steps]))

    def rows(self, *words, quick=("--quick",), allowed=(0,)):
        """The CSV of a benchmark; if that fails, first the rows that were measured until then."""
        command = [self.bench, *words, "--csv", "-", *self.choose((), quick)]
        done = self.start(command)
        yield from (row for row in csv.DictReader(io.StringIO(done.stdout)) if None not in row.values())
        self.must(command, done, allowed)


def time_row(tools, scene, *options):
    """One scene: medians of its times."""
    timed = [tools.run(scene, *options) for _ in range(tools.repeats)]
    phases = {name: statistics.median(run["ms_per_step"][name]["median"] for run in timed)
              for name in ("total", "collide", "assemble", "solve", "finish")}
    first = timed[0]
    return {
        "scene": scene, "method": first["method"], "backend": first["backend"], "precision": first["precision"],
        "threads": first["threads"], "device": first["device"], "bodies": first["bodies"],
        "contacts": round(first["contacts"]["mean"]), "iterations": first["iterations"], "substeps": first["substeps"],
        **{f"{name}_ms": f"{value:.4g}" for name, value in phases.items()},
        "hash": first["state_hash"],
    }


def rows_readme(tools):
    for scene in SCENES:
        options = "--backend", "cpu", "--precision", "f32", "--threads", "1"
        error = tools.run(scene, *options, "--certify")["certificate"]
        yield {**time_row(tools, scene, *options), "ncp_end": f"{error['ncp_max']:.2g}",
               "ncp_most": f"{error['ncp_max_run']:.2g}"}


def rows_gpu(tools):
    if tools.backend != "cuda":
        raise Missing("it is part of --gpu")
    for scene in tools.choose(SCENES + LARGE, SCENES[:1]):
        for precision in ("f64", "f32"):
            more = ["--steps", "150"] if scene in LARGE else []
            yield time_row(tools, scene, "--backend", "cuda", "--precision", precision, *more)


def rows_scenes(tools):
    for scene in json.loads(tools.output([tools.subadmm, "scenes", "--json"])):
        yield {"name": scene["name"] + scene["arguments"], "seconds": f"{scene['duration']:g}",
               "iterations": scene["iterations"]["fast"], "description": scene["description"]}


def rows_motion(tools):
    """The table that the bench prints."""
    text = tools.output([tools.bench, "motion", "--known", tools.choose("20", "1"), "--precision", "f64"])
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    titles = [cell.strip() for cell in lines[0].strip("|").split("|")]
    for line in lines[1:]:
        yield dict(zip(titles, (cell.strip() for cell in line.strip("|").split("|"))))


def rows_convergence(tools):
    """All that the bench measures but times, which this is not about."""
    for row in tools.rows("convergence", "--max-seconds", "600"):
        yield {key: row[key] for key in ("kind", "name", "method", "backend", "precision", "contacts", "limit",
                                         "iterations", "tolerance", "ncp_balanced")}


def rows_precision(tools):
    for scene in tools.choose(PRECISION_SCENES, PRECISION_SCENES[:1]):
        for row in tools.rows("precision", "--backend", tools.backend, "--scene", scene,
                              quick=("--quick", "--limit", "100")):
            if row["kind"] == "curve":
                yield {key: row[key] for key in ("kind", "name", "method", "backend", "precision", "threads",
                                                 "contacts", "iterations", "ms", "ncp_balanced", "distance")}


def rows_profile(tools):
    """Every row, of what is not solved, too."""
    if not tools.quick and not os.path.exists(os.path.join(os.path.dirname(tools.bench), "subadmm-siconos")):
        raise Missing("subadmm-siconos is not in the build (-Dsiconos=enabled)")
    yield from tools.rows("profile", "--seconds", tools.choose("1", "0.01"))


def draw_curves(path, folder, name, *pictures):
    for only in pictures:
        done = subprocess.run([sys.executable, os.path.join(PROJECT, "bench", "plot_convergence.py"), path,
                               os.path.join(folder, name), "--only", only], check=False)
        if done.returncode:
            print("no picture", file=sys.stderr)


def soonest_of(rows):
    """By which precision, method and iterations each backend comes to an error in a scene first, and in how many ms.
    Bold: sooner than the other backend."""
    scenes = {}
    for row in rows:
        runs = scenes.setdefault(row["name"], {}).setdefault(row["backend"], {})
        runs.setdefault((row["precision"], row["method"]), []).append(
            (float(row["ncp_balanced"]), float(row["ms"] or "nan"), row["iterations"]))  # nan: it ended in no number
    for name, backends in scenes.items():
        lines = {backend: {"scene": name.removeprefix("scene "), "by": backend} for backend in backends}
        for level in ("1e-3", "1e-5", "1e-8"):
            first = {}
            for backend, runs in backends.items():
                reached = []
                for run, points in runs.items():
                    bad = max((k for k, point in enumerate(points) if not point[0] <= float(level)), default=-1)
                    if bad + 1 < len(points):
                        reached.append((points[bad + 1][1], f"{' '.join(run)}, {points[bad + 1][2]}"))
                first[backend] = min(reached, default=(math.inf, ""))
            for backend, (ms, run) in first.items():
                text = f"{run}: {ms:.3g} ms" if run else "-"
                soonest = run and len(first) > 1 and ms == min(first.values())[0]
                lines[backend][level] = f"**{text}**" if soonest else text
        yield from lines.values()


def rows_ablation(tools):
    chosen = tools.choose(ABLATION_SCENES, ABLATION_SCENES[1:2])
    yield from tools.rows("ablation", "--backend", tools.backend,
                          *(word for scene in chosen for word in ("--scene", scene)))


def times_and_errors_of(rows):
    """What is varied: how many times as long a step takes, and its error, scene by scene; of what is not, the time in
    ms."""
    lines = {}
    for row in rows:
        by = part_of(row)
        line = lines.setdefault((by, row["name"]), {"name": row["name"], "what": row["what"], "by": by})
        time = f"{float(row['total_ms']):.3g} ms" if row["name"] == "as it is" else f"{float(row['times']):.2f}"
        line[row["scene"]] = f"{time}, {float(row['ncp_max']):.0e}"
    return list(lines.values())


def verdicts_of(rows):
    """Case by case, backends and precisions beside each other: how many rows pass, are at a limit, fail."""
    cases = {}
    for row in rows:
        case = cases.setdefault(row["case"], {"parameter": row["parameter"], "values": set(), "runs": {}})
        case["values"].add(row["value"])
        counts = case["runs"].setdefault(f"{row['backend']} {row['precision']}", {"pass": 0, "limit": 0, "FAIL": 0})
        counts[row["verdict"]] += 1
    for name, case in cases.items():
        values = sorted(case["values"], key=float)
        yield {"case": name, "parameter": case["parameter"],
               "values": values[0] if len(values) == 1 else f"{values[0]} to {values[-1]}",
               **{run: ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
                  for run, counts in case["runs"].items()}}


def counts_of(rows):
    """Cold problems: iterations to 1e-6 m/s, the methods beside each other. Those of scenes are in `precision`."""
    problems = {}
    for row in rows:
        if row["kind"] == "count" and float(row["tolerance"]) == 1e-6 and not row["name"].startswith("scene "):
            problem = problems.setdefault(row["name"], {"problem": row["name"], "contacts": row["contacts"]})
            problem[row["method"]] = row["iterations"] or "> " + row["limit"]
    return list(problems.values())


def on_the_plane(rows):
    """Motions without their variants on other ground, which are much the same."""
    return [row for row in rows if not re.search(r" on (triangles|ice)$", row["motion"])]


def times_of(rows):
    """Milliseconds of a step, the precisions beside each other."""
    scenes = {}
    for row in rows:
        scene = scenes.setdefault(row["scene"], {key: row[key] for key in ("scene", "bodies", "contacts",
                                                                            "iterations")})
        scene[row["precision"]] = row["total_ms"]
    return list(scenes.values())


def rows_standing(tools):
    for scene in ("pyramid:30", "arch", "dry_stone", "kapla_tower"):
        steps = tools.choose(600, 20)
        text = tools.output([tools.bench, "stand", "--scene", scene, "--steps", str(steps), "--threads", "1"])
        found = {key: re.search(pattern, text) for key, pattern in (
            ("penetration_m", r"penetration +(\S+) m at most"),
            ("drift_m", r"drift +(\S+) m at most"), ("ncp", r"certificate +ncp (\S+) m/s"))}
        yield {"scene": scene, "steps": steps, **{key: match.group(1) if match else "" for key, match in found.items()}}


def rows_stress(tools):
    """Every row, those that fail too."""
    if tools.backend == "cpu":
        yield from tools.rows("stress", allowed=(0, 1))
        return
    listed = re.findall(r"^\w+", tools.output([tools.bench, "stress", "--list"]), re.M)

    def rows_of(case):
        shorter = ("--quick",) if case in LONG_CASES and not tools.quick else ()
        return list(tools.rows("stress", "--backend", "cuda", "--case", case, *shorter, allowed=(0, 1)))

    # side by side: no time of theirs is shown
    with concurrent.futures.ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        for rows in pool.map(rows_of, tools.choose(listed, ["two_balls"])):
            yield from rows


def rows_peers(tools):
    """Needs the Python package (PYTHONPATH, or installed) and all engines; a shortened run needs one of them."""
    wanted = ["--complete"] + [word for engine in ENGINES for word in ("--engine", engine)]
    command = [sys.executable, PEERS, "--csv", "-", *tools.choose(wanted, ["--quick"])]
    done = tools.start(command)
    missing = re.search(r"^.* is left out: .*$|^ModuleNotFoundError: .*$", done.stderr, re.M)
    if done.returncode and missing:
        raise Missing(missing[0])
    tools.must(command, done)
    yield from csv.DictReader(line for line in done.stdout.splitlines() if not line.startswith("#"))


def draw_peers(path, folder):
    picture = os.path.join(folder, "peers.png")
    if subprocess.run([sys.executable, PEERS, "--rows", path, "--picture", picture], stdout=subprocess.DEVNULL,
                      check=False).returncode:
        print("no picture", file=sys.stderr)


def side_by_side(rows):
    """Of each scene the measure that comes first, and the time of a step: tuned settings, the longer step."""
    scenes = {}
    for row in rows:
        scene = scenes.setdefault(row["scene"], {"scene": row["scene"], "measure": row["first"],
                                                "dt": float(row["dt"])})
        if row["settings"] == "tuned" and float(row["dt"]) == scene["dt"]:
            time = float(row["us_per_step"])
            scene[row["engine"]] = f"{row[row['first']]} ({time:.{0 if time >= 10 else 1}f})"
    return [{"scene": scene["scene"], "measure": scene["measure"].replace("_", " "),
             **{engine: scene.get(engine, "-") for engine in ENGINES}} for scene in scenes.values()]


def rows_constants(tools):
    return constants.rows(*tools.choose((), (["WEIGHT_STAGNATION"], constants.FACTORS[:1])))


def columns(**titles):
    return list(titles.items())


class Report(typing.NamedTuple):
    rows: typing.Callable                              # of the CSV file: what measures them
    columns: list = ()                                 # of the table: keys and titles; no document has one without
    view: typing.Callable = lambda rows: rows          # the table's rows, of those of the CSV file
    draw: typing.Callable = lambda path, folder: None  # pictures, of the CSV file's path; into which folder
    gpu: bool = False                                  # has rows on backend cuda


# What takes longest comes last.
REPORTS = {
    "scenes": Report(rows_scenes, columns(name="name", description="what")),
    "readme": Report(rows_readme, columns(
        scene="scene", bodies="bodies", contacts="contacts", iterations="iterations", total_ms="ms a step",
        solve_ms="of it solve", ncp_end="natural map at the end, m/s", ncp_most="largest of the run")),
    "gpu": Report(rows_gpu, columns(scene="scene", bodies="bodies", contacts="contacts", iterations="iterations",
                                    f64="ms a step, f64", f32="f32"), times_of, gpu=True),
    "standing": Report(rows_standing, columns(scene="scene", steps="steps", penetration_m="penetration, m",
                                              drift_m="drift, m", ncp="natural map, m/s")),
    "precision": Report(rows_precision, columns(scene="scene", by="by", **{level: f"{level} m/s" for level in
                                                                           ("1e-3", "1e-5", "1e-8")}), soonest_of,
                        lambda path, folder: draw_curves(path, folder, "precision", "time"), gpu=True),
    "ablation": Report(rows_ablation, columns(name="", what="what", by="by",
                                              **{scene: scene for scene in ABLATION_SCENES}),
                       times_and_errors_of, gpu=True),
    "stress": Report(rows_stress, columns(case="case", parameter="parameter", values="of", **{
        f"{backend} {precision}": f"{backend} {precision}" for backend in ("cpu", "cuda")
        for precision in ("f32", "f64")}), verdicts_of, gpu=True),
    "motion": Report(rows_motion, columns(**{
        key: key for key in ("motion", "error by dt", "dt/4", "order", "energy left")}), on_the_plane),
    "convergence": Report(rows_convergence, columns(problem="problem", contacts="contacts", paper="`paper`",
                                                    fast="`fast`"), counts_of,
                          lambda path, folder: draw_curves(path, folder, "convergence", "iterations", "warm")),
    "peers": Report(rows_peers, columns(scene="scene", measure="measure", **{name: name for name in ENGINES}),
                    side_by_side, draw_peers),
    "profile": Report(rows_profile, columns(solver="solver", **{
        f"{measure} {bound}": f"{measure} {bound}{unit}" for measure, unit in (("siconos", ""), ("natural map", " m/s"))
        for bound in ("0.0001", "1e-06", "1e-08")}), profiles.table,
                      lambda path, folder: draw_curves(path, folder, "solvers", "profile")),
    "constants": Report(rows_constants),
}
SAME_EVERYWHERE = {"scenes"}  # no figure of theirs is measured
ONLY_NAMED = {"constants": "only where it is named: it builds the library for every constant, which takes hours"}
