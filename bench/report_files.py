"""CSV files of measured figures, and the tables of the documents that are made of them (bench/report.py).

A CSV file has two parts, either of which may be missing: rows of backend cuda, and the others. Its first lines say on
which machine, when, by which version and by which command each part was measured; those of backend cuda begin so.
"""
import csv
import glob
import os
import platform
import re
import sys

from reports import PROJECT, REPORTS, Failed, part_of

DOCS = os.path.join(PROJECT, "docs")
RESULTS = os.path.join(DOCS, "results")


def machine():
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = re.search(r"model name\s*: (.*)", file.read()).group(1)
    except (OSError, AttributeError):
        model = platform.processor() or platform.machine()
    return f"{model}, {os.cpu_count()} cores"


# ---- CSV files ---------------------------------------------------------------------------------------------------

def csv_path(name, folder=RESULTS):
    return os.path.join(folder, name + ".csv")


def read_csv(path):
    """Its notes and its rows."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().splitlines()
    return ([line[2:] for line in lines if line.startswith("# ")],
            list(csv.DictReader(line for line in lines if not line.startswith("# "))))


def part_of_note(note):
    return "cuda" if note.startswith("cuda: ") else "cpu"


def parts_of(path):
    """{part: (notes, rows)} of those that the file has."""
    notes, rows = read_csv(path) if os.path.exists(path) else ([], [])
    parts = {}
    for part in ("cpu", "cuda"):
        own = [row for row in rows if part_of(row) == part]
        if own:
            parts[part] = [note for note in notes if part_of_note(note) == part], own
    return parts


def replace_parts(path, new):
    """Parts of the file in place of those that it has; the others stay."""
    if not new or not all(rows for _, rows in new.values()):
        raise Failed(f"{path}: nothing was measured")
    parts = {**parts_of(path), **new}
    order = [part for part in ("cpu", "cuda") if part in parts]
    rows = [row for part in order for row in parts[part][1]]
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path + ".new", "w", encoding="utf-8", newline="") as file:
        for note in (note for part in order for note in parts[part][0]):
            file.write(f"# {note}\n")
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    os.replace(path + ".new", path)


# ---- tables ------------------------------------------------------------------------------------------------------

def table_of(name, folder=RESULTS):
    """The lines of a table, of its CSV file. Columns that no row has are left out."""
    notes, rows = read_csv(csv_path(name, folder))
    rows = list(REPORTS[name].view(rows))
    columns = [(key, title) for key, title in REPORTS[name].columns if any(key in row for row in rows)]
    source = re.sub(r" \d{4}-\d\d-\d\d;", "", "; ".join(notes))  # the date is the file's
    yield ""
    yield "| " + " | ".join(title for _, title in columns) + " |"
    yield "|" + "---|" * len(columns)
    for row in rows:
        yield "| " + " | ".join(row.get(key, "-").replace("|", "\\|") for key, _ in columns) + " |"
    yield ""
    yield "*" + re.sub(r"\bbench/report\.py[^;]*", lambda command: f"`{command[0]}`", source) + "*"
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


def put_tables(check=False):
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
