#!/usr/bin/env python3
"""Performance profiles (bench/profiles.py) of times that are known: test_profiles.py PROJECT."""
import math
import os
import sys

sys.path.insert(0, os.path.join(sys.argv[1], "bench"))
import profiles  # noqa: E402

# Problem by problem, of solvers a, b, c; None: not solved. The last one nobody solves.
SECONDS = {"one": (1, 2, None), "two": (8, 2, 20), "three": (3, 3, 2.9), "four": (None, None, None)}
ROWS = [{"problem": problem, "solver": solver, "measure": "natural map", "bound": "1e-06",
         "seconds": "" if time is None else str(time), "solved": "0" if time is None else "1"}
        for problem, times in SECONDS.items() for solver, time in zip("abc", times)]


def main():
    found = profiles.ratios(ROWS)[("natural map", "1e-06")]
    assert found["a"][:2] == [1, 4] and math.isinf(found["a"][3])
    assert found["c"][:3] == [math.inf, 10, 1]
    # not solved is in no share, and solved by nobody counts for nobody; ties and bounds are within
    assert [profiles.share(found[solver], math.inf) for solver in "abc"] == [0.75, 0.75, 0.5]
    assert [profiles.share(found[solver], 1) for solver in "abc"] == [0.25, 0.25, 0.25]
    assert [profiles.share(found[solver], 2) for solver in "abc"] == [0.5, 0.75, 0.25]
    assert [profiles.share(found[solver], 10) for solver in "abc"] == [0.75, 0.75, 0.5]
    assert profiles.curve(found["c"], 100) == [(1.0, 0.25), (10, 0.5), (100, 0.5)]
    assert profiles.table(ROWS)[0] == {"solver": "a", "natural map 1e-06": "75: 25, 50, 75"}


if __name__ == "__main__":
    main()
