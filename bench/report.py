#!/usr/bin/env python3
"""Measures, and writes the tables of the documents.

    bench/report.py [NAME...] [--build DIR] [--repeats N]   run what the reports need; results/NAME.csv and the tables
    bench/report.py --tables                                the tables alone, from the CSV files that there are
    bench/report.py --check                                 are the tables those of the CSV files? (part of the tests)
    bench/report.py --quick [NAME...] [--out DIR]           does every report work? Shortened runs, ten minutes on two
                                                            cores; CSV files, pictures and tables.md go to DIR

A table stands in a document between the lines `<!-- report: NAME -->` and `<!-- end -->`; no other table has figures
(tests/test_docs.py). A CSV file says in its first lines on which machine, when, by which version and by which command
its figures were measured. Times are medians over the repeats of the median step; errors are measured in runs of their
own, since the certificate takes time. `gpu` needs a GPU; elsewhere its table stays that of the CSV file.
"""
import argparse
import csv
import datetime
import glob
import io
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import time
import typing

import constants
import profiles

PROJECT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DOCS = os.path.join(PROJECT, "docs")
RESULTS = os.path.join(DOCS, "results")
ABLATION_SCENES = ["vertical_stacks", "card_houses:1", "pile:300", "ragdolls:4", "hand_demo"]
PRECISION_SCENES = ["vertical_stacks:12", "oblique_stacks:2", "card_houses:1", "sliding_cubes:500", "pile:200",
                    "settled_pile:1000", "pyramid:30", "chain:20", "ragdolls:4", "grippers:8"]
SCENES = ["vertical_stacks", "oblique_stacks", "card_houses", "sliding_cubes:2000", "mixed_pile", "hand_demo"]
PEERS = os.path.join(PROJECT, "bench", "peers", "run.py")
ENGINES = ["subadmm", "MuJoCo", "Bullet", "ODE"]
LARGE = ["settled_pile:100000", "pile:100000"]


class Missing(Exception):
    """What a report needs is not here."""


class Tools:
    def __init__(self, build, repeats, quick=False):
        self.subadmm = os.path.join(build, "src", "subadmm")
        self.bench = os.path.join(build, "bench", "subadmm-bench")
        self.repeats = 1 if quick else repeats
        self.quick = quick

    def choose(self, whole, quick):
        return quick if self.quick else whole

    @staticmethod
    def output(command):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
        return done.stdout

    def run(self, scene, *options):
        steps = self.choose((), ("--steps", "10"))
        return json.loads(self.output([self.subadmm, "run", scene, "--quiet", "--json", "-", *options, *steps]))

    def rows(self, *words, quick=("--quick",)):
        """The CSV of a benchmark."""
        text = self.output([self.bench, *words, "--csv", "-", *self.choose((), quick)])
        return csv.DictReader(io.StringIO(text))


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
    backends = json.loads(tools.output([tools.subadmm, "backends", "--json"]))
    if not any(backend["name"] == "cuda" and (backend["f32"] or backend["f64"]) for backend in backends["backends"]):
        raise Missing("no GPU, or a build without CUDA")
    for scene in SCENES + LARGE:
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
    chosen = tools.choose(PRECISION_SCENES, PRECISION_SCENES[:1])
    for row in tools.rows("precision", *(word for scene in chosen for word in ("--scene", scene))):
        if row["kind"] == "curve":
            yield {key: row[key] for key in ("kind", "name", "method", "backend", "precision", "threads", "contacts",
                                             "iterations", "ms", "ncp_balanced", "distance")}


def rows_profile(tools):
    """Every row, of what is not solved, too."""
    yield from tools.rows("profile", "--seconds", tools.choose("1", "0.01"))


def draw_curves(path, folder, name, *pictures):
    for only in pictures:
        done = subprocess.run([sys.executable, os.path.join(PROJECT, "bench", "plot_convergence.py"), path,
                               os.path.join(folder, name), "--only", only], check=False)
        if done.returncode:
            print("no picture", file=sys.stderr)


def soonest_of(rows):
    """By which backend, precision, method and iterations a scene comes to an error first, and in how many ms."""
    scenes = {}
    for row in rows:
        scene = scenes.setdefault(row["name"], {})
        scene.setdefault((row["backend"], row["precision"], row["method"]), []).append(
            (float(row["ncp_balanced"]), float(row["ms"]), row["iterations"]))
    for name, runs in scenes.items():
        line = {"scene": name.removeprefix("scene ")}
        for level in ("1e-3", "1e-5", "1e-8"):
            reached = []
            for run, points in runs.items():
                bad = max((k for k, point in enumerate(points) if not point[0] <= float(level)), default=-1)
                if bad + 1 < len(points):
                    reached.append((points[bad + 1][1], f"{' '.join(run)}, {points[bad + 1][2]}"))
            line[level] = "{1}: {0:.3g} ms".format(*min(reached)) if reached else "-"
        yield line


def rows_ablation(tools):
    words = [word for scene in ABLATION_SCENES for word in ("--scene", scene)]
    yield from tools.rows("ablation", *words, quick=("--steps", "4", "--repeats", "1"))


def times_and_errors_of(rows):
    """What is varied: how many times as long a step takes, and its error, scene by scene."""
    lines = {}
    for row in rows:
        line = lines.setdefault(row["name"], {"name": row["name"], "what": row["what"]})
        line[row["scene"]] = f"{float(row['times']):.2f}, {float(row['ncp_max']):.0e}"
    return list(lines.values())


def verdicts_of(rows):
    """Case by case: how many rows there are, pass, are at a limit, fail; what is worst."""
    cases = {}
    for row in rows:
        case = cases.setdefault(row["case"], {"case": row["case"], "parameter": row["parameter"], "values": [],
                                              "pass": 0, "limit": 0, "FAIL": 0})
        case[row["verdict"]] += 1
        if row["value"] not in case["values"]:
            case["values"].append(row["value"])
    for case in cases.values():
        values = sorted(case["values"], key=float)
        span = values[0] if len(values) == 1 else f"{values[0]} to {values[-1]}"
        yield {**{key: str(value) for key, value in case.items()}, "values": span}


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
    command = [tools.bench, "stress", "--csv", "-", *tools.choose((), ("--quick",))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1) or not done.stdout:
        sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
    yield from csv.DictReader(io.StringIO(done.stdout))


def rows_peers(tools):
    """Needs the Python package (PYTHONPATH, or installed) and the engines that are to stand in the table."""
    command = [sys.executable, PEERS, "--csv", "-", *tools.choose((), ("--quick",))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if "no engine can be had" in done.stderr:
        raise Missing("no engine: " + done.stderr.splitlines()[0])
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
    text = done.stdout
    yield from csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))


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


REPORTS = {
    "readme": Report(rows_readme, columns(
        scene="scene", bodies="bodies", contacts="contacts", iterations="iterations", total_ms="ms a step",
        solve_ms="of it solve", ncp_end="natural map at the end, m/s", ncp_most="largest of the run")),
    "gpu": Report(rows_gpu, columns(scene="scene", bodies="bodies", contacts="contacts", iterations="iterations",
                                    f64="ms a step, f64", f32="f32"), times_of),
    "scenes": Report(rows_scenes, columns(name="name", description="what")),
    "motion": Report(rows_motion, columns(**{
        key: key for key in ("motion", "error by dt", "dt/4", "order", "energy left")}), on_the_plane),
    "convergence": Report(rows_convergence, columns(problem="problem", contacts="contacts", paper="`paper`",
                                                    fast="`fast`"), counts_of,
                          lambda path, folder: draw_curves(path, folder, "convergence", "iterations", "warm")),
    "precision": Report(rows_precision, columns(scene="scene", **{level: f"{level} m/s" for level in
                                                                  ("1e-3", "1e-5", "1e-8")}), soonest_of,
                        lambda path, folder: draw_curves(path, folder, "precision", "time")),
    "profile": Report(rows_profile, columns(solver="solver", **{
        f"{measure} {bound}": f"{measure} {bound}{unit}" for measure, unit in (("siconos", ""), ("natural map", " m/s"))
        for bound in ("0.0001", "1e-06", "1e-08")}), profiles.table,
                      lambda path, folder: draw_curves(path, folder, "solvers", "profile")),
    "ablation": Report(rows_ablation, columns(name="", what="what", **{scene: scene for scene in ABLATION_SCENES}),
                       times_and_errors_of),
    "standing": Report(rows_standing, columns(scene="scene", steps="steps", penetration_m="penetration, m",
                                              drift_m="drift, m", ncp="natural map, m/s")),
    "peers": Report(rows_peers, columns(scene="scene", measure="measure", **{name: name for name in ENGINES}),
                    side_by_side, draw_peers),
    "constants": Report(rows_constants),
    "stress": Report(rows_stress, columns(case="case", parameter="parameter", values="of", **{
        "pass": "pass", "limit": "limits", "FAIL": "fails"}), lambda rows: list(verdicts_of(rows))),
}
SAME_EVERYWHERE = {"scenes"}  # no figure of theirs is measured


# ---- files -------------------------------------------------------------------------------------------------------

def machine():
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = re.search(r"model name\s*: (.*)", file.read()).group(1)
    except (OSError, AttributeError):
        model = platform.processor() or platform.machine()
    return f"{model}, {os.cpu_count()} cores"


def csv_path(name, folder=RESULTS):
    return os.path.join(folder, name + ".csv")


def write_csv(name, rows, tools, folder=RESULTS):
    rows = list(rows)
    os.makedirs(folder, exist_ok=True)
    with open(csv_path(name, folder), "w", encoding="utf-8", newline="") as file:
        if name not in SAME_EVERYWHERE:
            device = next((row["device"] for row in rows if row.get("backend") == "cuda"), None)
            version = tools.output([tools.subadmm, "--version"]).split("(")[0].strip()
            file.write(f"# {device or machine()}; {datetime.date.today()}; {version}\n")
        file.write(f"# bench/report.py {tools.choose('', '--quick ')}{name}\n")
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def is_outdated(name, tools):
    """Of what is the same everywhere: is its CSV file what the tools say?"""
    with open(csv_path(name), encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("# ")))
    return rows != [{key: str(value) for key, value in row.items()} for row in REPORTS[name].rows(tools)]


def table_of(name, folder=RESULTS):
    """The lines of a table, of its CSV file."""
    with open(csv_path(name, folder), encoding="utf-8") as file:
        lines = file.read().splitlines()
    notes = [re.sub(r" [0-9-]{10};", "", line[2:]) for line in lines if line.startswith("# ")]  # the date is the file's
    report = REPORTS[name]
    rows = report.view(list(csv.DictReader(line for line in lines if not line.startswith("# "))))
    yield ""
    yield "| " + " | ".join(title for _, title in report.columns) + " |"
    yield "|" + "---|" * len(report.columns)
    for row in rows:
        yield "| " + " | ".join(row[key].replace("|", "\\|") for key, _ in report.columns) + " |"
    yield ""
    yield "*" + "; ".join("`" + note + "`" if note.startswith("bench/") else note for note in notes) + "*"
    yield ""


def documents():
    pages = glob.glob(os.path.join(PROJECT, "docs", "**", "*.md"), recursive=True)
    return [os.path.join(PROJECT, "README.md")] + sorted(pages)


def with_tables(text):
    def block(match):
        name = match.group(1)
        if name not in REPORTS:
            sys.exit(f"<!-- report: {name} -->: no such report; there are {', '.join(REPORTS)}")
        lines = table_of(name) if os.path.exists(csv_path(name)) else []
        return "\n".join([f"<!-- report: {name} -->", *lines, "<!-- end -->"])
    return re.sub(r"<!-- report: (\w+) -->.*?<!-- end -->", block, text, flags=re.S)


def put_tables(check):
    """Returns the documents whose tables were not those of the CSV files."""
    changed = []
    for path in documents():
        with open(path, encoding="utf-8") as file:
            text = file.read()
        new = with_tables(text)
        if new == text:
            continue
        changed.append(os.path.relpath(path, PROJECT))
        if not check:
            with open(path, "w", encoding="utf-8") as file:
                file.write(new)
    return changed


def try_all(names, tools, folder):
    """All reports, shortened, into a folder. Those that cannot be made here are said; returns those that fail."""
    os.makedirs(folder, exist_ok=True)
    failed = []
    with open(os.path.join(folder, "tables.md"), "w", encoding="utf-8") as tables:
        for name in names:
            begin = time.monotonic()
            try:
                write_csv(name, REPORTS[name].rows(tools), tools, folder)
                REPORTS[name].draw(csv_path(name, folder), folder)
                if REPORTS[name].columns:
                    tables.write("\n".join([f"## {name}", *table_of(name, folder), ""]))
                said = f"{time.monotonic() - begin:.0f} s"
            except Missing as reason:
                said = f"left out: {reason}"
            except (SystemExit, Exception) as reason:  # whatever it is, the others are tried
                failed.append(name)
                said = f"FAILED: {type(reason).__name__}: {reason}"
            print(f"{name}: {said}", flush=True)
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(REPORTS))
    parser.add_argument("--build", default=os.path.join(PROJECT, "build"), help="build folder (default build)")
    parser.add_argument("--repeats", type=int, default=3, help="of each timed run (default 3)")
    parser.add_argument("--tables", action="store_true", help="write the tables of the CSV files that there are")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a table is not that of its CSV file")
    parser.add_argument("--quick", action="store_true", help="shortened runs, by default of all reports")
    parser.add_argument("--out", metavar="DIR", help="of --quick: where to (default quick_results in the build folder)")
    args = parser.parse_args()
    wrong = [name for name in args.names if name not in REPORTS]
    if wrong:
        parser.error(f"no report '{wrong[0]}'; there are {', '.join(REPORTS)}")
    if args.out and not args.quick:
        parser.error("--out: goes with --quick")
    if not args.names and not args.tables and not args.check and not args.quick:
        parser.error("which reports? " + ", ".join(REPORTS))
    tools = Tools(args.build, args.repeats, args.quick)
    if args.quick:
        folder = args.out or os.path.join(args.build, "quick_results")
        failed = try_all(args.names or REPORTS, tools, folder)
        print(f"tables: {os.path.join(folder, 'tables.md')}")
        sys.exit(f"failed: {', '.join(failed)}" if failed else 0)
    for name in args.names:
        print(name, flush=True)
        try:
            write_csv(name, REPORTS[name].rows(tools), tools)
        except Missing as reason:
            sys.exit(f"{name}: {reason}")
        REPORTS[name].draw(csv_path(name), DOCS)
    changed = put_tables(args.check)
    if args.check and os.path.exists(tools.subadmm):
        changed += [name for name in sorted(SAME_EVERYWHERE) if is_outdated(name, tools)]
    if args.check and changed:
        sys.exit("not what was measured (bench/report.py --tables; bench/report.py scenes): " + ", ".join(changed))


if __name__ == "__main__":
    main()
