#!/usr/bin/env python3
"""Doxygen's input filter: the comments of the public headers, which say everything in plain C comments, as its own.

    filter.py HEADER

A comment before a declaration is about it; one behind a member, a value or a declaration is about that; the first one
of a header is about the header. `|x|` and the like stay as they are: text is taken literally.
"""
import re
import sys

FORM = re.compile(r"/\*(.*?)\*/", re.S)


def literal(text):
    """Words that Doxygen would take for its commands or markup."""
    return re.sub(r"([@\\<>&#%])", r"\\\1", text)


def filtered(source):
    out, at, first = [], 0, True
    for comment in FORM.finditer(source):
        code = source[at:comment.start()]
        out.append(code)
        at = comment.end()
        text = literal(comment.group(1))
        lines = code.split("\n")
        behind = lines[-1].strip() != "" and not lines[-1].strip().startswith("#")
        rest = source[at:source.find("\n", at)].strip()
        if first:
            out.append("/** @file\n *" + text + "*/")
            first = False
        elif behind and rest == "":
            out.append("/**<" + text + "*/")
        elif not behind and rest == "" and not re.match(r"\s*\n\s*\n", source[at:]):
            out.append("/**" + text + "*/")
        else:
            out.append(comment.group(0))
    out.append(source[at:])
    return "".join(out)


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        sys.stdout.write(filtered(file.read()))
