#!/usr/bin/env python3
"""The sources speak the field's words (CONTRIBUTING.md, "Words"), in lines of 120 columns at most.

    test_words.py PROJECT

Names and files of include and src are split at underscores and at capitals; a part that has another word in this table
is an error. So is a longer line of C, C++ or CUDA, tests and examples included.
"""
import glob
import os
import re
import sys

WORDS = {
    "lead": "trapezoid correction", "leads": "trapezoid corrections", "jolt": "penetrates", "jolts": "penetrates",
    "flyer": "swept body", "flyers": "swept bodies", "driven": "kinematic", "steered": "prescribed",
    "joined": "articulation", "loose": "floating, active", "suspect": "candidate", "suspects": "candidates",
    "suspected": "candidate", "steady": "extrapolation", "reweigh": "weights", "misfit": "mispredicted",
    "careful": "conservative", "midway": "midpoint", "facing": "clip", "felt": "reaction",
    "baumgarte": "correction_factor",
    "gap": "separation", "gaps": "separations", "edited": "dirty", "told": "reported",
}
# Where a word has another sense: the duality gap of interior points; by how much a spring's law is ahead of its time.
PLAIN = {
    "src/core/solve/ncp_interior.c": "gap",
    "src/core/math/joint.h": "lead",
    "src/core/model/joint_law.h": "lead",
}
FOLDERS = ("include", "src")
LEFT_OUT = ("src/scenes", "src/cli")  # plain English: the gap between two cards, the lead of a thread
COLUMNS = 120
CODE = (".c", ".h", ".cu", ".cpp", ".py", ".pyi", ".build")


def names(path):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if path.endswith((".py", ".pyi", ".build")):
        text = re.sub(r"#[^\n]*|\"\"\".*?\"\"\"", " ", text, flags=re.S)
    else:
        text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)
    text = re.sub(r"\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'", " ", text)
    return set(re.findall(r"[A-Za-z_]\w*", text))


def long_lines(project):
    for folder in ("include", "src", "tests", "bench", "examples", "python"):
        pattern = os.path.join(project, folder, "**", "*")
        for path in sorted(glob.glob(pattern, recursive=True)):
            if path.endswith((".c", ".h", ".cu", ".cpp")):
                with open(path, encoding="utf-8") as file:
                    yield from (f"{os.path.relpath(path, project)}:{number}: {len(line) - 1} columns"
                                for number, line in enumerate(file, 1) if len(line) - 1 > COLUMNS)


def main():
    project, count = sys.argv[1], 0
    long = list(long_lines(project))
    print("\n".join(long), end="\n" * bool(long))
    wrong = len(long)
    for top in FOLDERS:
        for folder, _, files in os.walk(os.path.join(project, top)):
            for file in files:
                path = os.path.relpath(os.path.join(folder, file), project)
                if not file.endswith(CODE) or path.startswith(LEFT_OUT):
                    continue
                for name in sorted(names(os.path.join(project, path)) | {os.path.splitext(file)[0]}):
                    count += 1
                    for word in re.findall(r"[a-z]+|[A-Z]+(?![a-z])|[A-Z][a-z]+", name):
                        if word.lower() in WORDS and PLAIN.get(path) != word.lower():
                            print(f"{path}: {name}: {WORDS[word.lower()]}, not {word.lower()}")
                            wrong += 1
    print(f"{count} names")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
