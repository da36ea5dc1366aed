#!/usr/bin/env python3
"""Measures, and writes the tables of the documents.

    bench/report.py [NAME...] [--build DIR] [--repeats N]   run what the reports need; results/NAME.csv and the tables
    bench/report.py --tables                                the tables alone, from the CSV files that there are
    bench/report.py --check                                 are the tables those of the CSV files? (part of the tests)

A table stands in a document between the lines `<!-- report: NAME -->` and `<!-- end -->`. A CSV file says in its first
lines on which machine, when, by which version and by which command its figures were measured. Times are medians over
the repeats of the median step; errors are measured in runs of their own, since the certificate takes time.
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

PROJECT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RESULTS = os.path.join(PROJECT, "docs", "results")
SCENES = ["vertical_stacks", "oblique_stacks", "card_houses", "sliding_cubes:2000", "mixed_pile", "hand_demo"]
LARGE = ["settled_pile:100000", "pile:100000"]


class Tools:
    def __init__(self, build, repeats):
        self.subadmm = os.path.join(build, "src", "subadmm")
        self.bench = os.path.join(build, "bench", "subadmm-bench")
        self.repeats = repeats

    @staticmethod
    def output(command):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
        return done.stdout

    def run(self, scene, *options):
        return json.loads(self.output([self.subadmm, "run", scene, "--quiet", "--json", "-", *options]))


def scene_row(tools, scene, *options):
    """One scene: its time without the certificate, its error with it."""
    timed = [tools.run(scene, *options) for _ in range(tools.repeats)]
    certified = tools.run(scene, *options, "--certify")
    phases = {name: statistics.median(run["ms_per_step"][name]["median"] for run in timed)
              for name in ("total", "collide", "assemble", "solve", "finish")}
    first = timed[0]
    return {
        "scene": scene, "method": first["method"], "backend": first["backend"], "precision": first["precision"],
        "threads": first["threads"], "device": first["device"], "bodies": first["bodies"],
        "contacts": round(first["contacts"]["mean"]), "iterations": first["iterations"], "substeps": first["substeps"],
        **{f"{name}_ms": f"{value:.4g}" for name, value in phases.items()},
        "ncp_end": f"{certified['certificate']['ncp_max']:.2g}",
        "ncp_most": f"{certified['certificate']['ncp_max_run']:.2g}",
        "hash": first["state_hash"],
    }


def rows_readme(tools):
    for scene in SCENES:
        yield scene_row(tools, scene, "--backend", "cpu", "--precision", "f32", "--threads", "1")


def rows_speed(tools):
    threads = ["1"] + ([str(os.cpu_count())] if os.cpu_count() > 1 else [])
    for scene in SCENES:
        for method in ("fast", "paper"):
            for precision in ("f64", "f32"):
                for count in threads:
                    yield scene_row(tools, scene, "--backend", "cpu", "--method", method, "--precision", precision,
                                    "--threads", count)


def rows_gpu(tools):
    for scene in SCENES + LARGE:
        for precision in ("f64", "f32"):
            more = ["--steps", "150"] if scene in LARGE else []
            yield scene_row(tools, scene, "--backend", "cuda", "--precision", precision, *more)


def rows_scenes(tools):
    for scene in json.loads(tools.output([tools.subadmm, "scenes", "--json"])):
        yield {"name": scene["name"] + scene["arguments"], "seconds": f"{scene['duration']:g}",
               "iterations": scene["iterations"]["fast"], "description": scene["description"]}


def rows_motion(tools):
    """The table that the bench prints."""
    lines = [line for line in tools.output([tools.bench, "motion", "--known", "20", "--precision", "f64"]).splitlines()
             if line.startswith("| ")]
    titles = [cell.strip() for cell in lines[0].strip("|").split("|")]
    for line in lines[1:]:
        yield dict(zip(titles, (cell.strip() for cell in line.strip("|").split("|"))))


def rows_convergence(tools):
    """Cold problems: iterations and ms to each tolerance, the methods beside each other."""
    cold = {}
    for row in csv.DictReader(io.StringIO(tools.output([tools.bench, "convergence", "--only", "cold", "--csv", "-"]))):
        if row["kind"] != "count":
            continue
        problem = cold.setdefault((row["name"], row["tolerance"]), {
            "problem": row["name"], "bodies": row["bodies"], "contacts": row["contacts"],
            "tolerance": row["tolerance"]})
        problem[row["method"] + "_iterations"] = row["iterations"] or "> " + row["limit"]
        problem[row["method"] + "_ms"] = row["ms"]
    yield from cold.values()


def rows_standing(tools):
    for scene in ("pyramid:30", "card_houses", "arch", "dry_stone", "kapla_tower"):
        text = tools.output([tools.bench, "stand", "--scene", scene, "--steps", "600"])
        found = {key: re.search(pattern, text) for key, pattern in (
            ("ms", r"whole step +([\d.]+) ms median"), ("penetration_m", r"penetration +(\S+) m at most"),
            ("drift_m", r"drift +(\S+) m at most"), ("ncp", r"certificate +ncp (\S+) m/s"))}
        yield {"scene": scene, "steps": 600, **{key: match.group(1) if match else "" for key, match in found.items()}}


SCENE_COLUMNS = [("scene", "scene"), ("bodies", "bodies"), ("contacts", "contacts"), ("iterations", "iterations"),
                 ("total_ms", "ms a step"), ("solve_ms", "of it solve"), ("ncp_end", "natural map at the end, m/s"),
                 ("ncp_most", "largest of the run")]
HOW_COLUMNS = [("method", "method"), ("backend", "backend"), ("precision", "precision"), ("threads", "threads")]
# name: what measures it, columns of its table (None: all of the CSV file)
REPORTS = {
    "readme": (rows_readme, SCENE_COLUMNS),
    "speed": (rows_speed, SCENE_COLUMNS[:1] + HOW_COLUMNS + SCENE_COLUMNS[2:]),
    "gpu": (rows_gpu, SCENE_COLUMNS[:1] + [HOW_COLUMNS[2]] + SCENE_COLUMNS[1:]),
    "scenes": (rows_scenes, [("name", "name"), ("seconds", "s"), ("iterations", "iterations"),
                             ("description", "what")]),
    "motion": (rows_motion, None),
    "convergence": (rows_convergence, [("problem", "problem"), ("contacts", "contacts"), ("tolerance", "to, m/s"),
                                       ("paper_iterations", "paper: iterations"), ("fast_iterations", "fast"),
                                       ("paper_ms", "paper: ms"), ("fast_ms", "fast")]),
    "standing": (rows_standing, [("scene", "scene"), ("steps", "steps"), ("ms", "ms a step"),
                                 ("penetration_m", "penetration, m"), ("drift_m", "drift, m"),
                                 ("ncp", "natural map, m/s")]),
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


def csv_path(name):
    return os.path.join(RESULTS, name + ".csv")


def write_csv(name, rows, tools):
    rows = list(rows)
    os.makedirs(RESULTS, exist_ok=True)
    with open(csv_path(name), "w", encoding="utf-8", newline="") as file:
        if name not in SAME_EVERYWHERE:
            device = next((row["device"] for row in rows if row.get("backend") == "cuda"), None)
            version = tools.output([tools.subadmm, "--version"]).split("(")[0].strip()
            file.write(f"# {device or machine()}; {datetime.date.today()}; {version}\n")
        file.write(f"# bench/report.py {name}\n")
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def is_outdated(name, tools):
    """Of what is the same everywhere: is its CSV file what the tools say?"""
    with open(csv_path(name), encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("# ")))
    return rows != [{key: str(value) for key, value in row.items()} for row in REPORTS[name][0](tools)]


def table_of(name):
    """The lines of a table, of its CSV file."""
    with open(csv_path(name), encoding="utf-8") as file:
        lines = file.read().splitlines()
    notes = [re.sub(r" [0-9-]{10};", "", line[2:]) for line in lines if line.startswith("# ")]  # the date is the file's
    rows = list(csv.DictReader(line for line in lines if not line.startswith("# ")))
    columns = REPORTS[name][1] or [(key, key) for key in rows[0]]
    yield ""
    yield "| " + " | ".join(title for _, title in columns) + " |"
    yield "|" + "---|" * len(columns)
    for row in rows:
        yield "| " + " | ".join(row[key].replace("|", "\\|") for key, _ in columns) + " |"
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(REPORTS))
    parser.add_argument("--build", default=os.path.join(PROJECT, "build"), help="build folder (default build)")
    parser.add_argument("--repeats", type=int, default=3, help="of each timed run (default 3)")
    parser.add_argument("--tables", action="store_true", help="write the tables of the CSV files that there are")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a table is not that of its CSV file")
    args = parser.parse_args()
    wrong = [name for name in args.names if name not in REPORTS]
    if wrong:
        parser.error(f"no report '{wrong[0]}'; there are {', '.join(REPORTS)}")
    if not args.names and not args.tables and not args.check:
        parser.error("which reports? " + ", ".join(REPORTS))
    tools = Tools(args.build, args.repeats)
    for name in args.names:
        print(name, flush=True)
        write_csv(name, REPORTS[name][0](tools), tools)
    changed = put_tables(args.check)
    if args.check and os.path.exists(tools.subadmm):
        changed += [name for name in sorted(SAME_EVERYWHERE) if is_outdated(name, tools)]
    if args.check and changed:
        sys.exit("not what was measured (bench/report.py --tables; bench/report.py scenes): " + ", ".join(changed))


if __name__ == "__main__":
    main()
