#!/usr/bin/env python3
"""Add up meson's test logs, and pytest's, and print "N passed, N failed, N skipped", and what took the most time.

usage: sum_tests.py [--broken "STEP STEP"] [--left-out "STEP STEP"] [--passed "STEP STEP"] [TESTLOG.json | JUNIT.xml]...

A Check program counts with each of its checks, any other program as one. A program that ended without its checks'
summary (a crash, a time-out) is one failure, and so is a step that did not build or a log that is missing. A step that
could not run on this machine is one skipped, one that is a check by itself one passed. Exit status 1 when something
failed or nothing passed.
"""
import argparse
import json
import pathlib
import re
import sys
import xml.etree.ElementTree

CHECK_SUMMARY = re.compile(r"^\d+%: Checks: (\d+), Failures: (\d+), Errors: (\d+)", re.MULTILINE)


def count(test):
    """(passed, failed, skipped) of one line of a log."""
    result = test["result"]
    if result == "SKIP":
        return 0, 0, 1
    good = result in ("OK", "EXPECTEDFAIL")
    checks = failures = 0
    for total, failed, errors in CHECK_SUMMARY.findall(test.get("stdout", "")):
        checks += int(total)
        failures += int(failed) + int(errors)
    if checks == 0:
        return int(good), int(not good), 0
    if not good and failures == 0:  # the checks were fine, the program was not (a leak found at its exit)
        return checks, 1, 0
    return checks - failures, failures, 0


def results(log):
    """Of each test of a log: its name, its result, (passed, failed, skipped), seconds."""
    if log.suffix == ".xml":
        for case in xml.etree.ElementTree.parse(log).iter("testcase"):
            of = {child.tag for child in case}
            result = "FAIL" if of & {"failure", "error"} else "SKIP" if "skipped" in of else "OK"
            yield (case.get("name"), result, (int(result == "OK"), int(result == "FAIL"), int(result == "SKIP")),
                   float(case.get("time", 0)))
        return
    for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
        test = json.loads(line)
        yield test["name"].split(" / ")[-1], test["result"], count(test), test.get("duration", 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--broken", default="", help="steps that did not build")
    parser.add_argument("--left-out", default="", help="steps that could not run here")
    parser.add_argument("--passed", default="", help="steps that passed and have no log")
    parser.add_argument("logs", nargs="*", type=pathlib.Path)
    arguments = parser.parse_args()

    broken, left_out = arguments.broken.split(), arguments.left_out.split()
    passed = arguments.passed.split()
    total = [len(passed), len(broken), len(left_out)]
    for step in passed:
        print(f"{step}: passed")
    for step in broken:
        print(f"{step}: did not build")
    for step in left_out:
        print(f"{step}: left out")
    for log in arguments.logs:
        step = log.parent.parent.name.removeprefix("build-")
        counts = [0, 0, 0]
        if not log.is_file():
            counts[1] = 1
            print(f"{step}: no test ran")
        else:
            seconds = {}
            for name, result, of, took in results(log):
                counts = [a + b for a, b in zip(counts, of)]
                seconds[name] = seconds.get(name, 0) + took
                if result not in ("OK", "EXPECTEDFAIL", "SKIP"):
                    print(f"{step}: {name}: {result}")
            longest = sorted(seconds, key=seconds.get, reverse=True)[:5]
            print(f"{step}: programs took {sum(seconds.values()):.0f} s, of it " +
                  ", ".join(f"{name} {seconds[name]:.0f}" for name in longest))
        print(f"{step}: {counts[0]} passed, {counts[1]} failed, {counts[2]} skipped")
        total = [a + b for a, b in zip(total, counts)]
    print(f"{total[0]} passed, {total[1]} failed, {total[2]} skipped")
    return 1 if total[1] or not total[0] else 0


if __name__ == "__main__":
    sys.exit(main())
