#!/usr/bin/env python3
"""Documents name what there is.

    test_docs.py PROJECT

In README.md, CONTRIBUTING.md, CHANGELOG.md, docs/*.md, docs/guide/*.md and docs/internals/*.md: links lead to files,
and to headings where they name one; in back quotes, files and folders exist, and so do functions, structs, macros and
options; a block of C or Python that names a program of examples in its first line is part of that program, which is
compiled and run; places of generated figures have an end, and a name that no other place has; no other table has
figures.
docs/internals/architecture.md names every folder of src. README.md leads to every page of docs/internals. The user's
guide, docs/guide, has no other block of C; its other blocks of Python compile (python/tests/test_guide.py runs them);
its index leads to every page.
"""
import os
import re
import sys

CODE = (".c", ".h", ".cu", ".cpp", ".in", ".py", ".sh", ".build", ".txt", ".ini", ".map")


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def tree(project):
    paths = []
    for top in ("include", "src", "bench", "tests", "examples", "docs", "scripts", "presets", "python"):
        for folder, _, names in os.walk(os.path.join(project, top)):
            paths += [os.path.relpath(os.path.join(folder, name), project) for name in names]
            paths.append(os.path.relpath(folder, project) + "/")
    return paths + [name for name in os.listdir(project) if os.path.isfile(os.path.join(project, name))]


def headings(text):
    """Anchors as the usual viewers make them."""
    titles = re.findall(r"^#+ +(.+)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def wrong_links(project, document, text):
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        path = os.path.normpath(os.path.join(project, os.path.dirname(document), path)) if path else None
        if path and not os.path.exists(path):
            yield f"link to {target}: no such file"
        elif anchor and anchor not in headings(read(path) if path else text):
            yield f"link to {target}: no such heading"


def wrong_names(text, paths, sources):
    # What stands in back quotes, outside of blocks and of file lists' indentation.
    for name in sorted(set(re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)))):
        if re.fullmatch(r"[\w./\-]+\.(c|h|cu|cpp|py|sh|md|ini|csv|png|build|txt|map)|[\w\-]+(/[\w\-]+)*/", name):
            if not any(path == name or path.endswith("/" + name) for path in paths):
                yield f"`{name}`: no such file or folder"
        elif re.fullmatch(r"(sadmm|SADMM|CUDA|CPU)_\w+(\(.*\))?|struct \w+", name):
            word = re.match(r"(?:struct )?(\w+)", name).group(1)
            if word not in sources and word != "sadmm_x":
                yield f"`{name}`: no such name in the sources"
        elif re.fullmatch(r"--[\w\-]+.*", name):
            option = re.match(r"--([\w\-]+)", name).group(1)
            if option != "buildtype" and not re.search(rf"(--|\"){re.escape(option)}\b", sources):
                yield f"`{name}`: no such option"


def wrong_references(project, path, text):
    """Documents that comments of a source name, and headings in them, do not exist: docs/PAGE.md, "Heading"."""
    plain = re.sub(r"\n\s*(?:\*(?!/)|//|#)?\s*", " ", text)
    for document, heading in re.findall(r'\b(docs/(?:[\w\-]+/)*[\w\-]+\.md)\b(?:, "([^"]+)")?', plain):
        if not os.path.exists(os.path.join(project, document)):
            yield f"{path}: {document}: no such document"
        elif heading and not re.search(rf"^#+ +{re.escape(heading)}$", read(os.path.join(project, document)), re.M):
            yield f"{path}: {document}: has no heading '{heading}'"


def wrong_commands(text, sources):
    """Options of the project's commands, in back quotes and in blocks."""
    spans = re.findall(r"^```.*?^```", text, re.M | re.S) + re.findall(r"`([^`]+)`", text)
    for span in spans:
        for command, rest in re.findall(r"(?<!-m )\b(subadmm(?:-bench)? [a-z]+)((?:[^#\n]|\n(?! *subadmm))*)", span):
            for option in re.findall(r"(?<!\S)--([a-z][\w\-]*)", rest):
                if f'"{option}"' not in sources:
                    yield f"{command} --{option}: no such option"


def wrong_examples(project, text):
    blocks = re.findall(r"^```c\n/\* (examples/\w+\.c) \*/\n(.*?)^```", text, re.M | re.S) + \
        re.findall(r"^```python\n# (examples/\w+\.py)\n(.*?)^```", text, re.M | re.S)
    for name, code in blocks:
        path = os.path.join(project, name)
        if not os.path.exists(path) or code not in read(path):
            yield f"the block of {name} is not in that file"


def wrong_reports(text, seen):
    """Places of generated figures: <!-- report: NAME -->, what a generator writes, <!-- end -->. `seen`: their
    names."""
    name = None
    for begin, end in re.findall(r"^<!-- (?:report: ([\w-]+)|(end)) -->$", text, re.M):
        if end:
            if name is None:
                yield "<!-- end --> without a report"
            name = None
            continue
        if name is not None:
            yield f"report {name}: no <!-- end -->"
        name = begin
        if name in seen:
            yield f"report {name}: is in two places"
        seen.add(name)
    if name is not None:
        yield f"report {name}: no <!-- end -->"
    for line in re.findall(r"^.*<!--.*report.*$", text, re.M):
        if not re.fullmatch(r"<!-- report: [\w-]+ -->", line):
            yield f"{line!r}: is no begin of a report"


def wrong_figures(text):
    """Tables of measured figures that no generator writes: those with two cells that are a number of three digits,
    with a point or with an exponent, alone or with a unit of time."""
    text = re.sub(r"<!-- report: .*?<!-- end -->|^```.*?^```", "", text, flags=re.M | re.S)
    for table in re.findall(r"(?:^\|.*\|\n)+", text, re.M):
        cells = [cell.strip() for row in table.splitlines() for cell in re.split(r"(?<!\\)\|", row)]
        figures = [cell for cell in cells
                   if re.fullmatch(r"[-+]?(\d[\d,]{2,}|\d*\.\d+|[\d.]+e[-+]?\d+)( ?(ms|s|us|\u00b5s|%))?", cell)]
        if len(figures) > 1:
            yield f"a table has figures ({', '.join(figures[:4])}) that bench/report.py does not write"


def missing_links(text, documents, folder):
    """Pages of a folder, written as a link has them, that a document does not lead to."""
    for document in documents:
        if document.startswith(folder) and f"]({document}" not in text:
            yield f"leads to no {document}"


def wrong_words(text, words):
    """In back quotes of the guide: members, functions and scenes that there are not, by their underscores."""
    spans = re.findall(r"`([^`/\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S))  # paths: wrong_names
    for word in sorted({word for span in spans for word in re.findall(r"[A-Za-z]\w*_\w+", span)}):
        if word not in words:
            yield f"`{word}`: no such name in the sources"


def wrong_blocks(text):
    """Blocks of the guide that nothing compiles."""
    for language, code in re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S):
        begin = code.split("\n")[0]
        if language == "c" and not re.fullmatch(r"/\* examples/\w+\.c \*/", begin):
            yield f"block of C that begins with {begin!r}: does not name its program"
        if language == "python":
            try:
                compile(code, "block", "exec")
            except SyntaxError as error:
                # Part of a program may begin within a function.
                if not begin.startswith("# examples/"):
                    yield f"block of Python that begins with {begin!r}: {error}"


def main():
    project = sys.argv[1]
    paths = tree(project)
    sources = "\n".join(read(os.path.join(project, path)) for path in paths
                        if path.endswith(CODE) and not path.startswith("docs/"))
    words = set(re.findall(r"\w+", sources))
    failed = False
    reports = set()
    documents = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"] + \
        sorted(path for path in paths if re.fullmatch(r"docs/((guide|internals)/)?[\w-]+\.md", path))
    for document in documents:
        text = read(os.path.join(project, document))
        errors = list(wrong_links(project, document, text)) + list(wrong_names(text, paths, sources)) + \
            list(wrong_commands(text, sources)) + list(wrong_examples(project, text)) + \
            list(wrong_reports(text, reports)) + list(wrong_figures(text))
        if document == "README.md":
            errors += missing_links(text, documents, "docs/internals/")
        if document == "docs/internals/architecture.md":
            for path in paths:
                folder = path[:-1]
                if path.startswith("src/") and path.endswith("/") and os.path.basename(folder) + "/" not in text:
                    errors.append(f"src folder {path} is not named")
        if document.startswith("docs/guide/"):
            errors += list(wrong_words(text, words)) + list(wrong_blocks(text))
        if document == "docs/guide/index.md":
            pages = {os.path.basename(path) for path in documents if path.startswith("docs/guide/")}
            errors += [f"leads to no {page}" for page in sorted(pages - {"index.md"}) if f"]({page}" not in text]
        for error in errors:
            print(f"{document}: {error}")
        failed = failed or bool(errors)
    for path in paths:
        if path.endswith(CODE) and not path.startswith("docs/") and path != "tests/test_docs.py":
            for error in wrong_references(project, path, read(os.path.join(project, path))):
                print(error)
                failed = True
    print(f"{len(documents)} documents")
    sys.exit(failed)


main()
