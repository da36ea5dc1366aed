#!/usr/bin/env python3
"""Draw the CSV of `subadmm-bench scaling`: ms against bodies, the solver and the whole step, one line a series.

    subadmm-bench scaling --csv scaling.csv
    bench/plot_scaling.py scaling.csv docs/scaling.png

Several CSV files (of several machines, say) may be given; the last argument is the picture. Needs matplotlib.
"""
import argparse
import csv
import sys
from collections import defaultdict

PANELS = [("solver_ms", "solver (all but finding contacts)"), ("step_ms", "whole step")]


def read_series(paths):
    """{(runs_on, backend, precision, threads): [row by bodies]} of the rows that were measured."""
    series = defaultdict(list)
    skipped = []
    for path in paths:
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                if not row["step_ms"]:
                    skipped.append(f'{row["scene"]}, {row["backend"]} {row["threads"]}: {row["status"]}')
                    continue
                key = (row["runs_on"], row["backend"], row["precision"], int(row["threads"]))
                series[key].append(row)
    for rows in series.values():
        rows.sort(key=lambda row: int(row["bodies"]))
    return series, skipped


def label(key):
    runs_on, backend, precision, threads = key
    return f"{backend} {precision}" + (f", {threads} thread{'s' if threads > 1 else ''}" if backend != "cuda" else "")


def draw(series, path):
    try:
        import matplotlib
    except ImportError:
        sys.exit("plot_scaling.py: needs matplotlib (Debian and Ubuntu: python3-matplotlib)")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(PANELS), figsize=(12, 5.5), sharex=True, sharey=True)
    # The CPU in shades of one colour, dark for many threads; the GPU in others.
    cpu_keys = sorted(key for key in series if key[1] != "cuda")
    other = iter(["tab:green", "tab:olive", "tab:red", "tab:purple"] * len(series))
    colours = {key: plt.cm.Blues(0.35 + 0.6 * i / max(1, len(cpu_keys) - 1)) for i, key in enumerate(cpu_keys)}
    for key in sorted(series):
        if key not in colours:
            colours[key] = next(other)
    for axis, (column, title) in zip(axes, PANELS):
        for key in sorted(series):
            rows = series[key]
            axis.loglog([int(row["bodies"]) for row in rows], [float(row[column]) for row in rows], "o-",
                        color=colours[key], markersize=4, label=label(key))
        axis.set_title(title)
        axis.set_xlabel("bodies")
        axis.grid(True, which="major", alpha=0.5)
        axis.grid(True, which="minor", alpha=0.15)
    axes[0].set_ylabel("ms per step (median)")
    axes[0].legend(fontsize="small")
    first = next(iter(series.values()))[0]
    machines = ", ".join(sorted({key[0] for key in series}))
    figure.suptitle(f'{first["scene"].split(":")[0]}, {first["iterations"]} iterations a step; {machines}; '
                    f'commit {first["commit"]}', fontsize="medium")
    figure.tight_layout()
    figure.savefig(path, dpi=150)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", nargs="+", help="written by subadmm-bench scaling --csv")
    parser.add_argument("picture", help="file to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    series, skipped = read_series(arguments.csv)
    for text in skipped:
        print(f"not drawn: {text}")
    if not series:
        sys.exit("plot_scaling.py: no measured row in " + ", ".join(arguments.csv))
    draw(series, arguments.picture)


if __name__ == "__main__":
    main()
