#!/usr/bin/env python3
"""Measures, and writes the tables of the documents.

    bench/report.py NAME...                   these reports (reports.py): docs/results/NAME.csv, pictures, tables
    bench/report.py --all                     every report that can be made here, on the CPU
    bench/report.py --gpu [NAME...]           what a GPU adds: rows of backend cuda beside those of the CPU
    bench/report.py --gpu --out DIR           the same into a folder, on a machine that gives back nothing but files,
    bench/report.py --merge DIR               and from there into docs/results
    bench/report.py --quick [NAME...]         does every report work? Shortened runs, ten minutes on two cores, into a
                                              folder; --quick --gpu: those of a GPU
    bench/report.py --tables                  the tables alone, from the CSV files that there are
    bench/report.py --check                   are the tables those of the CSV files? (part of the tests)

Each file is written as soon as it is measured. Of a report that cannot be made, or fails, file and table stay as they
are, and the others are made. Exit status 1: one failed, or one that was named could not be made.

A table stands in a document between the lines `<!-- report: NAME -->` and `<!-- end -->`; no other table has figures
(tests/test_docs.py).
"""
import argparse
import datetime
import glob
import math
import os
import sys
import time

from report_files import DOCS, RESULTS, csv_path, machine, parts_of, put_tables, read_csv, replace_parts, table_of
from reports import ONLY_NAMED, PROJECT, REPORTS, SAME_EVERYWHERE, Failed, Missing, Tools


def note_of(name, tools):
    """The line above the rows that tells where they are from."""
    quick, gpu = tools.choose("", "--quick "), "--gpu " if tools.backend == "cuda" else ""
    command = f"bench/report.py {quick}{gpu}{name}"
    if name in SAME_EVERYWHERE:
        return command
    where = f"cuda: {tools.device()}" if tools.backend == "cuda" else machine()
    version = tools.output([tools.subadmm, "--version"]).split("(")[0].strip()
    return f"{where}; {datetime.date.today()}; {version}; {command}"


def measure(name, tools, folder):
    """Writes the CSV file. In a folder other than that of the documents it has what was measured until a failure."""
    rows, note, end = [], note_of(name, tools), " (broken off)"
    try:
        for row in REPORTS[name].rows(tools):
            rows.append(row)
        end = ""
    finally:
        if not end or (rows and folder != RESULTS):
            replace_parts(csv_path(name, folder), {tools.backend: ([note + end], rows)})


def show(name, folder):
    """The picture and the table of a CSV file."""
    REPORTS[name].draw(csv_path(name, folder), DOCS if folder == RESULTS else folder)
    if folder == RESULTS:
        put_tables()
    elif REPORTS[name].columns:
        with open(os.path.join(folder, "tables.md"), "a", encoding="utf-8") as tables:
            tables.write("\n".join([f"## {name}", *table_of(name, folder), ""]))


def make(names, tools, folder, named=True):
    """Says of each report how long it took, or why it is not made. Returns those that failed, and of those that were
    named also those that cannot be made here."""
    begin, failed = time.monotonic(), []
    for name in names:
        start = time.monotonic()
        print(f"{name}: ", end="", flush=True)
        try:
            measure(name, tools, folder)
            show(name, folder)
            print(f"{time.monotonic() - start:.0f} s", flush=True)
        except Missing as reason:
            failed += [name] if named else []
            print(f"left out: {reason}", flush=True)
        except (SystemExit, Exception) as reason:  # whatever it is, the others are made
            failed.append(name)
            print(f"FAILED: {type(reason).__name__}: {reason}", flush=True)
    print(f"together {time.monotonic() - begin:.0f} s", flush=True)
    return failed


def merge(source, folder):
    """What is in the CSV files of a folder, in place of the same rows of another. Returns the names."""
    paths = sorted(glob.glob(os.path.join(source, "*.csv")))
    names = [os.path.splitext(os.path.basename(path))[0] for path in paths]
    if not paths:
        raise Failed(f"{source}: no CSV file")
    for name, path in zip(names, paths):
        if name not in REPORTS:
            raise Failed(f"{path}: no report has this name")
        if any("--quick" in note for note in read_csv(path)[0]):
            raise Failed(f"{path}: shortened runs (--quick)")
    for name, path in zip(names, paths):
        replace_parts(csv_path(name, folder), parts_of(path))
    return names


def is_outdated(name, tools):
    """Of what is the same everywhere: is its CSV file what the tools say?"""
    _, rows = read_csv(csv_path(name))
    return rows != [{key: str(value) for key, value in row.items()} for row in REPORTS[name].rows(tools)]


def check(tools):
    changed = put_tables(check=True)
    if os.path.exists(tools.subadmm):
        changed += [name for name in sorted(SAME_EVERYWHERE) if is_outdated(name, tools)]
    if changed:
        sys.exit("not what was measured (bench/report.py --tables; bench/report.py scenes): " + ", ".join(changed))


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(REPORTS))
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--all", action="store_true", help="every report that can be made here")
    what.add_argument("--merge", metavar="DIR", help="put the rows of a folder's CSV files into docs/results")
    what.add_argument("--tables", action="store_true", help="write the tables of the CSV files that there are")
    what.add_argument("--check", action="store_true", help="exit status 1 if a table is not that of its CSV file")
    parser.add_argument("--gpu", action="store_true", help="rows of backend cuda, by default of all that have them")
    parser.add_argument("--quick", action="store_true", help="shortened runs, by default of all reports")
    parser.add_argument("--out", metavar="DIR",
                        help="of --gpu and --quick: where to (default of --quick: quick_results in the build folder)")
    parser.add_argument("--seconds", type=float, metavar="S", help="of --gpu: nothing is measured for longer")
    parser.add_argument("--build", default=os.path.join(PROJECT, "build"), help="build folder (default build)")
    parser.add_argument("--repeats", type=int, default=3, help="of each timed run (default 3)")
    args = parser.parse_args()
    wrong = [name for name in args.names if name not in REPORTS]
    alone = next((f"--{option}" for option in ("all", "merge", "tables", "check") if getattr(args, option)), None)
    if wrong:
        parser.error(f"no report '{wrong[0]}'; there are {', '.join(REPORTS)}")
    if alone and args.names:
        parser.error(f"{alone}: takes no names")
    if alone and args.gpu:
        parser.error(f"{alone}: does not go with --gpu, which is a run by itself")
    if alone and alone != "--all" and args.quick:
        parser.error(f"{alone}: does not go with --quick")
    if args.out and not args.gpu and not args.quick:
        parser.error("--out: goes with --gpu or --quick")
    if args.seconds is not None and not args.gpu:
        parser.error("--seconds: goes with --gpu")
    if args.seconds is not None and not args.seconds > 0:
        parser.error(f"--seconds {args.seconds:g}: must be above 0")
    if args.repeats < 1:
        parser.error(f"--repeats {args.repeats}: must be at least 1")
    if args.gpu and [name for name in args.names if not REPORTS[name].gpu]:
        parser.error("--gpu: has rows of " + ", ".join(name for name in REPORTS if REPORTS[name].gpu))
    if not (args.names or alone or args.gpu or args.quick):
        parser.error("which reports? --all, or of " + ", ".join(REPORTS))
    return args


def names_of(args):
    if args.names:
        return args.names
    names = [name for name in REPORTS if REPORTS[name].gpu or not args.gpu]
    if not args.quick:
        for name in (name for name in names if name in ONLY_NAMED):
            print(f"{name}: left out: {ONLY_NAMED[name]}")
        names = [name for name in names if name not in ONLY_NAMED]
    return names


def main():
    args = parse()
    tools = Tools(args.build, args.repeats, args.quick, "cuda" if args.gpu else "cpu", args.seconds or math.inf)
    if args.check:
        check(tools)
    elif args.tables:
        put_tables()
    elif args.merge:
        try:
            for name in merge(args.merge, RESULTS):
                show(name, RESULTS)
        except Failed as reason:
            sys.exit(f"--merge {reason}")
    else:
        for path in (tools.subadmm, tools.bench):
            if not os.path.exists(path):
                sys.exit(f"{path}: is not there; --build names the build folder, by -Dcli=enabled -Dbench=enabled")
        if args.gpu:
            try:
                tools.device()
            except Missing as reason:
                sys.exit(f"--gpu: {reason}")
        folder = args.out or (os.path.join(args.build, "quick_results") if args.quick else RESULTS)
        if folder != RESULTS:
            os.makedirs(folder, exist_ok=True)
            open(os.path.join(folder, "tables.md"), "w", encoding="utf-8").close()
        failed = make(names_of(args), tools, folder, named=bool(args.names))
        if failed:
            sys.exit(f"not made: {', '.join(failed)}")


if __name__ == "__main__":
    main()
