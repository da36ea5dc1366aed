#!/usr/bin/env python3
"""Draw the JSON of `subadmm-bench motion`: errors against ms per simulated second, a panel a scene.

    subadmm-bench motion --scene pile:300 --json pile.json
    bench/plot_motion.py pile.json pile.png

A line a number of iterations, from the whole time step at its left end to the finest. Solid: the error, to the
reference; dashed: of the time step alone, with many iterations; dotted: of the iterations, to many at the same step.
Grey: rows that no other beats in both time and error; star: the least product of both. Several files may be given; the
last argument is the picture. Needs matplotlib.
"""
import argparse
import json
import math
import sys

PARTS = [("error", "-", "o"), ("error_step", "--", None), ("error_solver", ":", None)]


def number(value):
    return math.nan if value is None else value


def read_rows(path):
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    if document.get("bench") != "motion":
        sys.exit(f"plot_motion.py: {path} was not written by subadmm-bench motion")
    rows = [row for row in document["rows"] if row["ms_per_simulated_second"] is not None and row["error"] is not None]
    return document, rows


def series(document, rows):
    """{(precision, label): [row by time step]}: a number of iterations kept, and one divided with the step."""
    steps = sorted({row["dt"] for row in rows}, reverse=True)
    matched = {dt: max(1, math.floor(document["match"] * dt / document["frame"] + 0.5)) for dt in steps}
    lines = {}
    for row in sorted(rows, key=lambda row: (row["precision"], row["iterations"], -row["dt"])):
        lines.setdefault((row["precision"], f'{row["iterations"]} iterations'), []).append(row)
    lines = {key: line for key, line in lines.items() if len(line) == len(steps)}
    for precision in sorted({row["precision"] for row in rows}) if document["match"] and len(steps) > 1 else []:
        line = [row for row in rows if row["precision"] == precision and row["iterations"] == matched[row["dt"]]]
        label = ", ".join(str(matched[dt]) for dt in steps)
        lines[precision, f"{label} iterations"] = sorted(line, key=lambda row: -row["dt"])
    return lines


def draw_panel(plt, axis, document, rows):
    lines = series(document, rows)
    one_precision = len({precision for precision, _ in lines}) == 1
    for index, ((precision, label), line) in enumerate(lines.items()):
        colour = f"C{index % 10}"
        times = [row["ms_per_simulated_second"] for row in line]
        for part, style, marker in PARTS:
            axis.loglog(times, [1e3 * number(row[part]) or math.nan for row in line], style, marker=marker,
                        markersize=4, linewidth=1.4 if part == "error" else 0.9, color=colour,
                        label=(label if one_precision else f"{precision}, {label}") if part == "error" else None)
    front = sorted((row["ms_per_simulated_second"], 1e3 * row["error"]) for row in rows if row["front"])
    axis.loglog([x for x, _ in front], [y for _, y in front], color="0.8", linewidth=6, zorder=0)
    for row in rows:
        if row["best"]:
            axis.loglog(row["ms_per_simulated_second"], 1e3 * row["error"], "*", color="black", markersize=13, zorder=5,
                        label=f'dt {1e3 * row["dt"]:.4g} ms, {row["iterations"]} iterations')
    floor = document["reference"]["floor"]
    if floor:
        axis.axhline(1e3 * floor, color="0.6", linewidth=0.8)
        axis.annotate("half as fine a reference", (0.02, 1e3 * floor), xycoords=("axes fraction", "data"),
                      fontsize="x-small", color="0.4", va="bottom")
    axis.set_title(f'{document["scene"]}, {document["rows"][0]["method"]}', fontsize="small")
    axis.set_xlabel("ms per simulated second")
    axis.grid(True, which="major", alpha=0.4)
    axis.grid(True, which="minor", alpha=0.12)
    axis.legend(fontsize="x-small")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("json", nargs="+", help="written by subadmm-bench motion --json")
    parser.add_argument("picture", help="file to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    try:
        import matplotlib
    except ImportError:
        sys.exit("plot_motion.py: needs matplotlib (Debian and Ubuntu: python3-matplotlib)")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    panels = [(document, rows) for document, rows in map(read_rows, arguments.json) if rows]
    if not panels:
        sys.exit("plot_motion.py: no measured row in " + ", ".join(arguments.json))
    columns = min(2, len(panels))
    figure, axes = plt.subplots(-(-len(panels) // columns), columns, squeeze=False,
                                figsize=(6 * columns, 4.6 * -(-len(panels) // columns)))
    for axis, (document, rows) in zip(axes.flat, panels):
        draw_panel(plt, axis, document, rows)
    for axis in axes.flat[len(panels):]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("error, mm (solid; dashed: time step, dotted: solver)")
    first = panels[0][0]
    figure.suptitle(f'{first["runs_on"]}, {first["rows"][0]["backend"]}, {first["threads"]} thread'
                    f'{"" if first["threads"] == 1 else "s"}; commit {first["commit"]}', fontsize="small")
    figure.tight_layout()
    figure.savefig(arguments.picture, dpi=110)


if __name__ == "__main__":
    main()
