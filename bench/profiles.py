"""Performance profiles (Dolan and More, Math. Program. 91, 2002) of the rows of `subadmm-bench profile --csv`."""
import math


def ratios(rows):
    """{(measure, bound): {solver: [ratio]}}: of each problem the solver's time over that of the fastest; infinite where
    it does not solve the problem, or nobody does."""
    times = {}
    for row in rows:
        solved = times.setdefault((row["measure"], row["bound"]), {}).setdefault(row["problem"], {})
        solved[row["solver"]] = float(row["seconds"]) if row["solved"] == "1" else math.inf
    found = {}
    for key, problems in times.items():
        of_solvers = found.setdefault(key, {})
        for solved in problems.values():
            least = min(solved.values())
            for solver, seconds in solved.items():
                of_solvers.setdefault(solver, []).append(seconds / least if math.isfinite(seconds) else math.inf)
    return found


def share(values, factor):
    """Of all problems those that are solved within a factor of the fastest time; math.inf: at all."""
    return sum(math.isfinite(value) and value <= factor for value in values) / len(values)


def curve(values, most):
    """[(factor, share)] from 1 to `most`: the steps of the profile."""
    steps = sorted(value for value in values if 1 < value <= most)
    return [(factor, share(values, factor)) for factor in [1.0, *steps, most]]


def table(rows):
    """Of each solver, by measure and bound: % solved: % the fastest, within 2 times, within 10 times its time."""
    lines = {}
    for (measure, bound), of_solvers in ratios(rows).items():
        for solver, values in of_solvers.items():
            shares = [f"{100 * share(values, factor):.0f}" for factor in (math.inf, 1, 2, 10)]
            lines.setdefault(solver, {"solver": solver})[f"{measure} {bound}"] = shares[0] + ": " + ", ".join(shares[1:])
    return list(lines.values())
