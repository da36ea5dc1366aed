#!/usr/bin/env python3
"""Draw the CSV of `subadmm-bench convergence`: errors of cold solves against iterations, a panel a problem, and errors
of warm steps against the iterations a step, a panel a scene.

    subadmm-bench convergence --csv convergence.csv
    bench/plot_convergence.py convergence.csv docs/convergence

writes docs/convergence_iterations.png, docs/convergence_time.png and docs/convergence_warm.png; what was not
measured is left out. The CSV of `subadmm-bench precision` has curves, too. That of `subadmm-bench profile` gives
PREFIX_profile.png: performance profiles, a panel a measure and bound. Needs matplotlib.
"""
import argparse
import csv
import math
import sys
from collections import defaultdict

import profiles

COLOURS = {"paper": "tab:red", "fast": "tab:blue", "paper cuda": "tab:orange", "fast cuda": "tab:cyan"}
STYLES = ["-", "--", ":", "-."]


def number(text):
    return float(text) if text else math.nan


def read_curves(paths, kind, x, y):
    """{name: {(method, series): [(x, y)]}} in the order of the files; points that were not measured are left out."""
    curves = defaultdict(lambda: defaultdict(list))
    for path in paths:
        with open(path, newline="") as file:
            for row in csv.DictReader(line for line in file if not line.startswith("#")):
                point = number(row.get(x, "")), number(row[y])
                if row["kind"] != kind or not all(math.isfinite(value) for value in point):
                    continue
                series = f'{row["backend"]} {row["precision"]}'
                if row["backend"] == "cpu" and "threads" in row:
                    series += f', {row["threads"]} thread{"" if row["threads"] == "1" else "s"}'
                curves[row["name"]][row["method"], series].append(point)
    return curves


def read_profiles(paths, most=1e4):
    """{measure and bound: {(solver, ""): [(factor, share)]}}"""
    rows = []
    for path in paths:
        with open(path, newline="") as file:
            rows += csv.DictReader(line for line in file if not line.startswith("#"))
    return {f"{measure}, {bound}": {(solver, ""): profiles.curve(values, most) for solver, values in found.items()}
            for (measure, bound), found in profiles.ratios(rows).items()}


def draw(plt, curves, path, x_label, y_label, columns=5, shares=False):
    if not curves:
        print(f"not drawn: {path}: nothing measured")
        return
    rows = -(-len(curves) // columns)
    all_series = sorted({series for lines in curves.values() for _, series in lines})
    methods = list(dict.fromkeys(method for lines in curves.values() for method, _ in lines))
    beside = shares or len(all_series) > 2  # too many for the legend to be in a panel
    figure, axes = plt.subplots(rows, columns, figsize=(3.2 * columns + 2 * beside, 2.5 * rows), squeeze=False)
    for axis, (name, lines) in zip(axes.flat, curves.items()):
        for (method, series), points in sorted(lines.items()):
            if shares:
                at = methods.index(method)
                axis.semilogx([x for x, _ in points], [y for _, y in points], STYLES[at // 10 % len(STYLES)],
                              drawstyle="steps-post", color=f"C{at % 10}", label=method)
                axis.set_ylim(0, 1.02)
                continue
            points.sort()
            # What is exact to rounding is drawn at 1e-12.
            axis.loglog([x for x, _ in points], [max(y, 1e-12) for _, y in points],
                        STYLES[all_series.index(series) % len(STYLES)], marker=".", markersize=3,
                        color=COLOURS.get(f"{method} cuda" if series.startswith("cuda") else method, "tab:green"),
                        label=method if len(all_series) == 1 else f"{method}, {series}")
        axis.set_title(name, fontsize="small")
        axis.grid(True, which="major", alpha=0.4)
        axis.tick_params(labelsize="x-small")
        values = sorted({x for points in lines.values() for x, _ in points})
        axis.xaxis.set_minor_formatter(plt.NullFormatter())
        if len(values) <= 6 and not shares:
            axis.set_xticks(values, [f"{x:g}" for x in values])
    for axis in axes.flat[len(curves):]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel(y_label, fontsize="small")
    for column in range(columns):
        visible = [axis for axis in axes[:, column] if axis.get_visible()]
        if visible:
            visible[-1].set_xlabel(x_label, fontsize="small")
    if beside:
        figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="center right")
    else:
        axes[0, 0].legend(fontsize="x-small")
    figure.tight_layout(rect=(0, 0, 0.83 if shares else 0.88, 1) if beside else None)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", nargs="+", help="written by subadmm-bench convergence, precision or profile --csv")
    parser.add_argument("prefix", help="of the pictures' paths")
    parser.add_argument("--only", choices=("iterations", "time", "warm", "profile"), help="of the pictures")
    parser.add_argument("--suffix", default="png", help="png (default), svg or pdf")
    arguments = parser.parse_args()
    try:
        import matplotlib
    except ImportError:
        sys.exit("plot_convergence.py: needs matplotlib (Debian and Ubuntu: python3-matplotlib)")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    if arguments.only == "profile":
        draw(plt, read_profiles(arguments.csv), f"{arguments.prefix}_profile.{arguments.suffix}",
             "time over that of the fastest", "share of the problems", columns=3, shares=True)
        return
    error = "error, m/s"
    for kind, x, x_label, name in (("curve", "iterations", "iterations", "iterations"), ("curve", "ms", "ms", "time"),
                                   ("warm", "iterations", "iterations a step", "warm")):
        if arguments.only in (None, name):
            draw(plt, read_curves(arguments.csv, kind, x, "ncp_balanced"),
                 f"{arguments.prefix}_{name}.{arguments.suffix}", x_label, error)


if __name__ == "__main__":
    main()
