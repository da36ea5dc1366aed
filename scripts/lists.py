#!/usr/bin/env python3
"""Write what is made of the lists of members and names (src/core/base/*_fields.h, names.h) into docs/: the schema of
scene files, and the table of joint kinds.

    lists.py [--check] [PROJECT]

--check writes nothing, and says what is not as it would be. What a list cannot say (rules of a member's own, members of
files that no definition has) stays in the schema as it is written there.
"""
import argparse
import json
import os
import re
import sys

BASE = "src/core/base/"
SCHEMA = "docs/scene.schema.json"
JOINTS = "docs/guide/joints.md"
LISTS = {  # of the schema's "$defs"
    "settings": ("settings_fields.h", "SADMM_SETTINGS"),
    "body": ("definition_fields.h", "SADMM_BODY_FIELDS"),
    "shape": ("definition_fields.h", "SADMM_SHAPE_FIELDS"),
    "hull": ("definition_fields.h", "SADMM_HULL_FIELDS"),
    "joint": ("definition_fields.h", "SADMM_JOINT_FIELDS"),
    "coordinate": ("definition_fields.h", "SADMM_COORDINATE_FIELDS"),
    "coupling": ("definition_fields.h", "SADMM_COUPLING_FIELDS"),
    "gear": ("definition_fields.h", "SADMM_GEAR_FIELDS"),
}
NAMES = {"METHOD": "SADMM_METHODS", "BODY_TYPE": "SADMM_BODY_TYPES", "SHAPE_TYPE": "SADMM_SHAPE_TYPES",
         "JOINT_KIND": "SADMM_JOINT_KINDS", "DRIVE": "SADMM_DRIVES"}
NUMBERS = {"VECTOR": 3, "TURN": 4, "TWIST": 6}
# Left out, these have another value in files than in a definition, which their descriptions say; those of "type" must
# be there.
NO_DEFAULT = {("settings", "substeps"), ("settings", "iterations"), ("shape", "type")}


class Number(str):
    """A number as it is written."""


def rows_of(text, macro):
    """Arguments of every F(X, ...) of a list."""
    start = text.index("#define " + macro + "(F, X)")
    body = re.match(r"(?:.*\\\n)*.*\n", text[start:]).group(0).replace("\\\n", " ")[len("#define " + macro + "(F, X)"):]
    rows, at = [], 0
    while True:
        at = body.find("F(X,", at)
        if at < 0:
            return rows
        at += len("F(X,")
        arguments, depth, quoted, last = [], 0, False, at
        while True:
            c = body[at]
            if c == '"':
                quoted = not quoted
            elif not quoted and c == "(":
                depth += 1
            elif not quoted and c in ",)" and depth == 0:
                arguments.append(" ".join(body[last:at].split()))
                last = at + 1
                if c == ")":
                    break
            elif not quoted and c == ")":
                depth -= 1
            at += 1
        rows.append([re.sub(r'" *"', "", a).strip('"') if a.startswith('"') else a for a in arguments])


def names_in(texts, macro):
    return [(row[0], row[1]) for row in rows_of(texts["names.h"], macro)]


def schema_of(texts, kind, name, value, lo, hi, ends):
    """Of a member whose range the list says; None: the schema's own text stays."""
    if kind in NAMES:
        names = names_in(texts, NAMES[kind])
        return {"enum": [n for _, n in names], "default": dict(names)[value]}
    if kind == "FLAG":
        return {"type": "boolean", "default": value == "true"}
    if kind == "BOUND":
        return {"$ref": "#/$defs/boundOrInfinite"}
    if kind == "TURN":
        return {"$ref": "#/$defs/turn"}
    if ends == "ANY" and kind != "VECTOR":
        return None
    if kind in NUMBERS:
        numbers = re.fullmatch(r"SADMM_NUMBERS\((.*)\)", value).group(1).split(", ")
        return {"type": "array", "minItems": NUMBERS[kind], "maxItems": NUMBERS[kind],
                "items": {"type": "number", "minimum": Number(lo), "maximum": Number(hi)},
                "default": [Number(n) for n in numbers]}
    out = {"type": "integer" if kind in ("WHOLE", "BITS") else "number"}
    out["exclusiveMinimum" if ends == "ABOVE" else "minimum"] = Number(lo)
    if ends in ("CLOSED", "BELOW"):
        out["exclusiveMaximum" if ends == "BELOW" else "maximum"] = Number(hi)
    out["default"] = Number(value)
    return out


def with_what_is_said(new, old):
    """What a list does not say of a member is kept: its description, that it may be null."""
    merged = dict(new)
    if old is None:
        return merged
    if "type" in merged and isinstance(old.get("type"), list) and "null" in old["type"]:
        merged["type"] = [merged["type"], "null"]
    if "description" in old:
        merged = {**merged, "description": old["description"]}
    return merged


def update_schema(texts, schema):
    for of, (file, macro) in LISTS.items():
        properties = schema["$defs"][of]["properties"]
        for kind, role, name, value, lo, hi, ends, _ in rows_of(texts[file], macro):
            if role in ("OWN", "HIDDEN"):
                continue
            new = schema_of(texts, kind, name, value, lo, hi, ends)
            if new is None and name in properties:
                continue
            if new is None:
                sys.exit(f"{SCHEMA}: $defs.{of}.properties has no {name}, whose range no list says: write it there")
            if (of, name) in NO_DEFAULT or role == "DYNAMIC" and name in ("mass", "inertia"):
                new.pop("default")
            if role == "DYNAMIC" and name not in properties:
                new["type"] = [new["type"], "null"]
            properties[name] = with_what_is_said(new, properties.get(name))
        if of == "body":
            dynamic = [row[2] for row in rows_of(texts[file], macro) if row[1] == "DYNAMIC"]
            rules = schema["$defs"]["body"]["allOf"][0]
            for name in dynamic:
                plain = properties[name]["type"][0]
                rules["then"]["properties"].setdefault(name, {"type": plain})
                rules["else"]["properties"].setdefault(name, {"type": "null"})
    return schema


def text_of(value, indent=0, used=0):
    """JSON with short values in one line."""
    if isinstance(value, Number):
        return str(value)
    if not isinstance(value, (dict, list)):
        return json.dumps(value, ensure_ascii=False)
    parts = [json.dumps(k, ensure_ascii=False) + ": " + text_of(v, 0, -10**6) for k, v in value.items()] \
        if isinstance(value, dict) else [text_of(v, 0, -10**6) for v in value]
    ends = "{}" if isinstance(value, dict) else "[]"
    line = ends[0] + ", ".join(parts) + ends[1]
    if len(line) + used <= 120:
        return line
    inner = " " * (indent + 2)
    if isinstance(value, dict):
        lines = []
        for k, v in value.items():
            key = inner + json.dumps(k, ensure_ascii=False) + ": "
            lines.append(key + text_of(v, indent + 2, len(key) + 1))
    elif all(not isinstance(v, (dict, list)) for v in value):
        lines, current = [], inner
        for k, v in enumerate(value):
            piece = text_of(v) + ("," if k < len(value) - 1 else "")
            if len(current) + len(piece) > 120:
                lines.append(current.rstrip())
                current = inner
            current += piece + " "
        lines.append(current.rstrip())
        return ends[0] + "\n" + "\n".join(lines) + "\n" + " " * indent + ends[1]
    else:
        lines = [inner + text_of(v, indent + 2, indent + 3) for v in value]
    return ends[0] + "\n" + ",\n".join(lines) + "\n" + " " * indent + ends[1]


def update_joints(texts, page):
    rows = [f"| {name} | {free} | {use} |" for _, name, _, free, use in rows_of(texts["names.h"], "SADMM_JOINT_KINDS")]
    table = re.compile(r"(\| kind \| free coordinates \| use \|\n\|---\|---\|---\|\n)(?:\|.*\n)*")
    assert table.search(page), f"{JOINTS}: has no table of kinds"
    return table.sub(lambda m: m.group(1) + "\n".join(rows) + "\n", page)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("project", nargs="?", default=os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    given = parser.parse_args()
    check, project = given.check, given.project
    texts = {}
    for name in ("names.h", "settings_fields.h", "definition_fields.h"):
        with open(os.path.join(project, BASE, name), encoding="utf-8") as file:
            texts[name] = file.read()
    stale = 0
    for path in (SCHEMA, JOINTS):
        with open(os.path.join(project, path), encoding="utf-8") as file:
            old = file.read()
        if path == SCHEMA:
            new = text_of(update_schema(texts, json.loads(old, parse_float=Number, parse_int=Number))) + "\n"
        else:
            new = update_joints(texts, old)
        if new == old:
            continue
        stale += 1
        if check:
            print(f"{path}: is not what the lists say: run scripts/lists.py")
        else:
            with open(os.path.join(project, path), "w", encoding="utf-8") as file:
                file.write(new)
            print(path)
    sys.exit(1 if check and stale else 0)


if __name__ == "__main__":
    main()
