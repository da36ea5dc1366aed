#!/usr/bin/env python3
"""Scene files as users have them: what is refused, and how that is said; the schema.

    test_scene_files.py PROJECT COMMAND

Files that differ from a good one in one place are refused by `subadmm run`, which names the place;
docs/scene.schema.json refuses them too where a schema can. Exports of all scenes, and the example of
docs/guide/scene-files.md, pass it. Without Python's jsonschema the schema itself is left out, which is said.
"""
import copy
import json
import os
import re
import subprocess
import sys
import tempfile

try:
    import jsonschema
except ImportError:
    jsonschema = None

INFINITE = float("inf")  # json.dumps makes it Infinity, which is no JSON

GOOD = {
    "format": "subadmm scene",
    "format_version": 1,
    "settings": {"dt": 0.01},
    "bodies": [
        {"name": "ground", "type": "static", "environment": -1,
         "shapes": [{"type": "plane"}, {"type": "mesh", "mesh": 0}, {"type": "mesh", "mesh": 1}]},
        {"name": "a", "mass": 1, "inertia": [1, 1, 1], "position": [0, 0, 3],
         "shapes": [{"type": "box", "size": [1, 1, 1]}]},
        {"name": "a", "mass": 2, "inertia": [1, 2, 3], "position": [5, 0, 3],
         "shapes": [{"type": "sphere", "size": [1]}]},
        {"name": "belt", "type": "kinematic", "position": [0, 9, 3], "move": {"position": [0, 9, 4]}, "shapes": []},
        {"name": "mallet", "density": 1000, "position": [9, 0, 3],
         "shapes": [{"type": "box", "size": [1, 1, 1]}, {"type": "sphere", "size": [1], "position": [1, 0, 0]},
                    {"type": "box", "size": [1, 1, 1], "sensor": True}]},
    ],
    "meshes": [
        {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]},
        {"heights": [[0, 0, 1], [0, 1, 0]], "spacing": [1, 2]},
    ],
    "joints": [
        {"kind": "revolute", "body_b": 1, "coordinates": [None, None, None, None, None, {"limits": [-1, None]}]},
        {"kind": "prismatic", "body_b": 2, "coordinates": [
            None, None, {"spring_table": {"positions": [0, 1], "forces": [0, 2]}}, None, None, None]},
    ],
    "couplings": [{"body": 1}],
    "gears": [{"joint_1": 0, "coordinate_1": 5, "joint_2": 1, "coordinate_2": 2}],
    "pair_friction": [{"body_a": 1, "body_b": 2, "friction": 0.2}],
    "contact_off": [{"body_a": 1, "body_b": "belt"}],
}

GONE = object()
# where, what is put there, what is said after the file's name; a fourth: no schema can tell.
NO_SCHEMA = True
CASES = [
    ("format", GONE, 'format: is missing: a scene file has "format": "subadmm scene"'),
    ("format", "other", 'format: must be "subadmm scene", is "other"'),
    ("format_version", GONE, "format_version: is missing"),
    ("format_version", 2, "format_version: must be a whole number in [1, 1], is 2"),
    ("colour", 1, "colour: is no member of a scene file; it may have $schema, format,"),
    ("name", 7, "name: must be a string, is 7"),
    ("n", 1.5, "n: must be a whole number in [0, 1000000000], is 1.5"),
    ("duration", -1, "duration: must be in [0, 1e+09] s, is -1"),
    ("duration", "long", 'duration: must be a number, is "long"'),
    ("iterations", {"paper": 0}, "iterations.paper: must be in [1, 1000000], is 0"),
    ("iterations", {"slow": 3}, "iterations.slow: is no member of what goes by method; it may have paper, fast"),
    ("substeps", {"fast": 65}, "substeps.fast: must be in [1, 64], is 65"),
    ("precision", "f16", 'precision: must be one of f32, f64, is "f16"'),
    ("contact_margin", 1.5, "contact_margin = 1.5: must be in [0, 1]"),
    ("friction_of_a_pair", "least", 'friction_of_a_pair: must be "geometric mean", is "least"'),
    ("settings", [], "settings: must be an object, is an array of 0"),
    ("settings.dt", 5, "settings.dt = 5: must be in [1e-06, 1]"),
    ("settings.dt", None, "settings.dt: must be a number, is null"),
    ("settings.dT", 5, "settings.dT: is no member of settings; it may have dt, substeps"),
    ("settings.iterations", 2.5, "settings.iterations: must be a whole number in"),
    ("settings.gravity", [0, 0], "settings.gravity: must be an array of 3 numbers, is an array of 2"),
    ("settings.gravity", [0, 0, "g"], 'settings.gravity[2]: must be a number, is "g"'),
    ("settings.warm_start", 1, "settings.warm_start: must be true or false, is 1"),
    ("settings.method", 1, "settings.method: must be one of paper, fast, is 1"),
    ("bodies", {}, "bodies: must be an array, is an object"),
    ("bodies[1]", 3, "bodies[1]: must be an object, is 3"),
    ("bodies[1].index", 2, "bodies[1].index: must be 1, the body's place in the list, or left out, is 2", NO_SCHEMA),
    ("bodies[1].name", "x" * 64, "bodies[1].name: must have at most 63 bytes, has 64"),
    ("bodies[1].type", "soft", 'bodies[1].type: must be one of dynamic, static, kinematic, is "soft"'),
    ("bodies[1].mass", GONE, "bodies[1].mass: is missing: a dynamic body has mass and inertia, or density"),
    ("bodies[1].density", 1000, "bodies[1].mass: must be left out, for the body has a density"),
    ("bodies[0].density", 1000, "bodies[0].density: must be null or left out, for the body is static"),
    ("bodies[4].inertia", [1, 1, 1], "bodies[4].inertia: must be left out, for the body has a density"),
    ("bodies[4].mass", None, "bodies[4].mass: must be a number, is null"),
    ("bodies[4].density", None, "bodies[4].mass: is missing: a dynamic body has mass and inertia, or density"),
    ("bodies[4].density", "steel", 'bodies[4].density: must be a number, is "steel"'),
    ("bodies[4].density", 0, "bodies[4].density: must be in [1e-30, 1e+30] kg/m^3, is 0"),
    ("bodies[4].density", -1, "bodies[4].density: must be in [1e-30, 1e+30] kg/m^3, is -1"),
    ("bodies[4].density", 1e20, "bodies[4].mass = ", NO_SCHEMA),
    ("bodies[4].shapes", [], "bodies[4].density: must be left out, for the body has no shape but sensors"),
    ("bodies[4].shapes", GONE, "bodies[4].density: must be left out, for the body has no shape but sensors"),
    ("bodies[4].shapes", [{"type": "sphere", "size": [1], "sensor": True}], "bodies[4].density: must be left out"),
    ("bodies[4].shapes", 1, "bodies[4].shapes: must be an array, is 1"),
    ("bodies[4].shapes[0]", {"type": "plane"},
     "bodies[4].shapes[0].type: must be a solid, for the body has a density, is plane"),
    ("bodies[4].shapes[1].size", [0], "bodies[4].shapes[1].size[0] = 0: must be in [1e-06, 1e+06] m"),
    ("bodies[4].shapes[1].size", GONE, "bodies[4].shapes[1].size: is missing, 1 number"),
    ("bodies[4].shapes[1].position", [0, 0, 1e7], "bodies[4].shapes[1].position[2] = 1e+07: must be in"),
    ("bodies[4].position", [0, 0, 1e10], "bodies[4].position[2] = 1e+10: must be in [-1e+09, 1e+09]"),
    ("bodies[4].orientation", [1, 1, 0, 0], "bodies[4].orientation = (1, 1, 0, 0)", NO_SCHEMA),
    ("joints[0]", {"body_a": 4, "body_b": 1, "position_a": [0, 0, 1e10]}, "joints[0].position_a[2] = 1e+10: must be"),
    ("couplings[0]", {"body": 4, "orientation": [1, 1, 0, 0]}, "couplings[0].orientation = (1, 1, 0, 0)", NO_SCHEMA),
    ("bodies[1].mass", -1, "bodies[1].mass = -1: must be in [1e-09, 1e+12]"),
    ("bodies[1].inertia", GONE, "bodies[1].inertia: is missing"),
    ("bodies[1].inertia", [1, 1, 3], "bodies[1].inertia[2] = 3: must be at most the sum of the other two, 2",
     NO_SCHEMA),
    ("bodies[1].position", [0, 0, 1e10], "bodies[1].position[2] = 1e+10: must be in [-1e+09, 1e+09]"),
    ("bodies[1].orientation", [1, 1, 0, 0], "bodies[1].orientation = (1, 1, 0, 0) of norm 1.41421: must be a unit",
     NO_SCHEMA),
    ("bodies[1].environment", -1, "bodies[1].environment = -1: must be >= 0"),
    ("bodies[1].environment", 1e10, "bodies[1].environment: must be a whole number in [-2147483648, 2147483647]"),
    ("bodies[1].force", [0, 0, 1e16], "bodies[1].force[2] = 1e+16: must be in"),
    ("bodies[1].gravity_scale", 1e7, "bodies[1].gravity_scale = 1e+07: must be in"),
    ("bodies[1].move", {"position": [0, 0, 0]}, "bodies[1].move: must be null or left out, for the body is dynamic"),
    ("bodies[0].mass", 1, "bodies[0].mass: must be null or left out, for the body is static"),
    ("bodies[0].torque", [0, 0, 0], "bodies[0].torque: must be null or left out, for the body is static"),
    ("bodies[0].linear_velocity", [1, 0, 0], "bodies[0].linear_velocity[0] = 1: must be 0, for the body is static"),
    ("bodies[3].linear_damping", 1, "bodies[3].linear_damping: must be null or left out, for the body is kinematic"),
    ("bodies[3].move.position", [2e9, 0, 0], "bodies[3].move.position[0] = 2e+09: must be in"),
    ("bodies[3].move.speed", 1, "bodies[3].move.speed: is no member of a move"),
    ("bodies[1].shapes", 1, "bodies[1].shapes: must be an array, is 1"),
    ("bodies[1].shapes[0].type", GONE, "bodies[1].shapes[0].type: is missing"),
    ("bodies[1].shapes[0].type", "plane", "bodies[1].shapes[0].size: must be an array of 0 numbers"),
    ("bodies[1].shapes[0]", {"type": "plane"}, "bodies[1].shapes[0].type ="),
    ("bodies[1].shapes[0].size", GONE, "bodies[1].shapes[0].size: is missing, 3 numbers"),
    ("bodies[1].shapes[0].size", [1, 1], "bodies[1].shapes[0].size: must be an array of 3 numbers, is an array of 2"),
    ("bodies[1].shapes[0].size", [1, -1, 1], "bodies[1].shapes[0].size[1] = -1: must be in [1e-06, 1e+06] m"),
    ("bodies[1].shapes[0].friction", -0.1, "bodies[1].shapes[0].friction = -0.1: must be in"),
    ("bodies[1].shapes[0].restitution", 2, "bodies[1].shapes[0].restitution = 2: must be in [0, 1]"),
    ("bodies[1].shapes[0].mask", -1, "bodies[1].shapes[0].mask: must be a whole number in [0, 4294967295], is -1"),
    ("bodies[1].shapes[0].mesh", 0, "bodies[1].shapes[0].mesh: must be left out, for the shape is a box"),
    ("bodies[1].shapes[0].hull", 0, "bodies[1].shapes[0].hull: must be left out, for the shape is a box"),
    ("bodies[0].shapes[0].index", 0, "bodies[0].shapes[1].index: is missing: all shapes must have one, or none",
     NO_SCHEMA),
    ("bodies[0].shapes[1].mesh", 2, "bodies[0].shapes[1].mesh: must be a whole number in [0, 1], is 2", NO_SCHEMA),
    ("bodies[0].shapes[1].mesh", GONE, "bodies[0].shapes[1].mesh: is missing"),
    ("bodies[0].shapes[1]", {"type": "hull", "hull": 0},
     "bodies[0].shapes[1].hull: names one of a list that is empty", NO_SCHEMA),
    ("hulls", [{"points": [[0, 0, 0]] * 3}], "hulls[0].point_count = 3: must be in [4, 1000000]"),
    ("hulls", [{"points": [[0, 0, 0]] * 4, "merge": 1}], "hulls[0].merge = 1: must be in [0, 0.01]"),
    ("hulls", [{}], "hulls[0].points: is missing"),
    ("meshes[0].triangles", GONE, "meshes[0].triangles: is missing, and there are vertices"),
    ("meshes[0].triangles", [[0, 1, 3]], "meshes[0].triangles[0][2]: must be a whole number in [0, 2], is 3",
     NO_SCHEMA),
    ("meshes[0].triangles", [[0, 1]], "meshes[0].triangles[0]: must be an array of 3 vertices, is an array of 2"),
    ("meshes[0].vertices[1]", [0, 2e6, 0], "meshes[0].vertices[4] = 2e+06: must be in"),
    ("meshes[0].heights", [[0, 0], [0, 0]],
     "meshes[0]: must have either vertices and triangles, or heights and spacing"),
    ("meshes[1].heights[1]", [0, 1], "meshes[1].heights[1]: must be an array of 3 numbers, is an array of 2",
     NO_SCHEMA),
    ("meshes[1].heights", [[]], "meshes[1].columns = 0: must be in [2, 16384]"),
    ("meshes[1].spacing", [0, 1], "meshes[1].spacing[0] = 0: must be in [1e-6, 1e6]"),
    ("joints[0].kind", "hinge", 'joints[0].kind: must be one of fixed, revolute, prismatic,'),
    ("joints[0].locks", 3, "joints[0].locks: must be 31, what this kind of joint locks, or left out, is 3", NO_SCHEMA),
    ("joints[0].body_b", 5, "joints[0].body_b: must be a whole number in [0, 4], is 5", NO_SCHEMA),
    ("joints[0].body_b", None, "joints[0].body_a, body_b: one of them must be dynamic"),
    ("joints[0].body_b", "c", 'joints[0].body_b: must be the name of a body, is "c"', NO_SCHEMA),
    ("joints[0].body_b", "a", 'joints[0].body_b: must be the name of one body only, is "a"', NO_SCHEMA),
    ("joints[0].body_b", True, "joints[0].body_b: must be a whole number in [0, 4], is true"),
    ("joints[0].body_a", 1, "joints[0].body_b: must be another body than body_a, is 1", NO_SCHEMA),
    ("joints[0].length", -2, "joints[0].length (or -1: as it is) = -2: must be in"),
    ("joints[0].break_force", -1, "joints[0].break_force = -1: must be in"),
    ("joints[0].coordinates", [None] * 5, "joints[0].coordinates: must be an array of 6, is an array of 5"),
    ("joints[0].coordinates[5].limits", [1], "joints[0].coordinates[5].limits: must be null or an array of 2 numbers"),
    ("joints[0].coordinates[5].limits", [2, 1], "joints[0].coordinates[5].lower = 2, upper = 1: must be", NO_SCHEMA),
    ("joints[0].coordinates[5].motor", 1, "joints[0].coordinates[5].motor: is no member of a coordinate"),
    ("joints[0].coordinates[5].friction", -1, "joints[0].coordinates[5].friction = -1: must be in [0, 1e+15]"),
    ("joints[0].coordinates[2]", {"friction": 1}, "joints[0].coordinates[2]: must be the default, for the joint locks",
     NO_SCHEMA),
    ("joints[1].coordinates[2].spring_table.forces", [0, 1, 2],
     "joints[1].coordinates[2].spring_table.forces: must have 2 numbers, as positions has, has 3", NO_SCHEMA),
    ("joints[1].coordinates[2].spring_table.forces", [0],
     "joints[1].coordinates[2].spring_table.forces: must have 2 to 64 numbers, has 1"),
    ("joints[1].coordinates[2].spring_table.positions", [1, 0],
     "joints[1].coordinates[2].spring_table.positions[1] = 0 after positions[0] = 1: must increase", NO_SCHEMA),
    ("couplings[0].body", 0, "couplings[0].body: must be a dynamic body", NO_SCHEMA),
    ("couplings[0].body", GONE, "couplings[0].body: must be a dynamic body"),
    ("couplings[0].linear_stiffness", -1, "couplings[0].linear_stiffness = -1: must be in"),
    ("gears[0].joint_2", 2, "gears[0].joint_2: must be a whole number in [0, 1], is 2", NO_SCHEMA),
    ("gears[0].joint_2", GONE, "gears[0].joint_2: is missing"),
    ("gears[0].coordinate_1", 6, "gears[0].coordinate_1 = 6: must be in [0, 6), free"),
    ("gears[0].ratio", 0, "gears[0].ratio = 0: its size must be in"),
    ("pair_friction[0].friction", -1, "pair_friction[0].friction: must be in [0, 1e6], is -1"),
    ("pair_friction[0].friction", GONE, "pair_friction[0].friction: is missing"),
    ("pair_friction[0].shape_b", 1, "pair_friction[0].shape_b: must be in [0, 1), the shapes of the body, is 1",
     NO_SCHEMA),
    ("pair_friction[0].body_a", None, "pair_friction[0].body_a: must be a body"),
    ("pair_friction[1]", {"body_a": 2, "body_b": 1, "friction": 1},
     "pair_friction[1]: must be another pair than those before it", NO_SCHEMA),
    ("contact_off[0].body_b", 1, "contact_off[0].body_b: must be another body than body_a", NO_SCHEMA),
    ("contact_off[1]", {"body_a": 3, "body_b": 1}, "contact_off[1]: must be another pair than those", NO_SCHEMA),
]

# Texts that are no JSON, or no object; what is said besides the place is jansson's.
TEXTS = [
    ("", "line 1, column 0"),
    ("[1]", "must be an object, is an array of 1"),
    ('{"format": "subadmm scene", "format": "subadmm scene"}', "line 1, column"),
    ('{"format": "subadmm scene", "format_version": 1, "duration": NaN}', "line 1, column"),
    ('{"format": "subadmm scene", "format_version": 1, "duration": 1e999}', "line 1, column"),
    ('{"format": "subadmm scene", "format_version": 1}{', "line 1, column 49"),
    ('{"name": "\xff"}'.encode("latin-1"), "line 1, column"),
    ("[" * 100000, "line 1, column"),
]

failures = []


def fail(text):
    failures.append(text)
    print(text)


def parts(path):
    return [int(part[1:-1]) if part[0] == "[" else part for part in re.findall(r"\[\d+\]|[^.\[]+", path)]


def edited(path, value):
    file = copy.deepcopy(GOOD)
    *before, last = parts(path)
    at = file
    for part in before:
        at = at[part]
    if value is GONE:
        del at[last]
    elif isinstance(at, list) and last == len(at):
        at.append(value)
    else:
        at[last] = value
    return file


def run(command, *arguments):
    return subprocess.run([command, *arguments], capture_output=True, text=True, errors="replace",
                          stdin=subprocess.DEVNULL)


def check_refused(command, path, text, says):
    with open(path, "wb") as file:
        file.write(text if isinstance(text, bytes) else text.encode())
    result = run(command, "run", path, "--steps", "0", "--quiet")
    if result.returncode != 1 or f"subadmm: {path}: {says}" not in result.stderr:
        fail(f"{text[-200:]!r}:\n  exit {result.returncode}, {result.stderr.strip()}\n  expected {says}")


def check_cases(command, schema):
    for place, value, says, *rest in CASES:
        file = edited(place, value)
        check_refused(command, "./bad.json", json.dumps(file), says)
        if schema and schema.is_valid(file) != bool(rest):
            fail(f"{place} = {value}: the schema {'takes' if schema.is_valid(file) else 'refuses'} it")
    for text, says in TEXTS:
        check_refused(command, "./bad.json", text, says)


def check_good(project, command, schema):
    """The file that is edited, a scene's export by every way in, and what may be over a file."""
    with open("good.json", "w", encoding="utf-8") as file:
        json.dump(GOOD, file)
    example = os.path.join(project, "examples", "swing.json")
    for arguments in (["run", "good.json", "--steps", "2"], ["check", example, "--steps", "2"],
                      ["scenes", "good.json"]):
        result = run(command, *arguments)
        if result.returncode != 0:
            fail(f"{arguments}: exit {result.returncode}, {result.stderr}")
        if arguments[0] == "run" and "no script, no measure of success" not in result.stdout:
            fail(f"a run of a file does not say what a file lacks:\n{result.stdout}")
    result = run(command, "scenes", "good.json", "--json", "good.json")
    if result.returncode == 0 or "good.json" not in result.stderr:
        fail(f"a scene was written over the file that it is read from: {result.stderr}")
    result = run(command, "run", "none.json")
    if result.returncode != 1 or "none.json: could not be opened" not in result.stderr:
        fail(f"a file that is not there: exit {result.returncode}, {result.stderr}")
    if schema:
        for error in schema.iter_errors(GOOD):
            fail(f"the schema refuses the good file: {error.message}")


def check_exports(command, schema):
    for scene in json.loads(run(command, "scenes", "--json").stdout):
        least = scene["name"] in ("arch", "peg_in_hole")
        spec = scene["name"] + ((":20" if least else ":2") if scene["arguments"] else "")
        result = run(command, "scenes", spec, "--json")
        if result.returncode != 0 and "qhull" in result.stderr:
            continue
        file = json.loads(result.stdout)
        for mesh in file["meshes"]:  # thousands of triangles take the schema seconds
            for rows in mesh.values():
                del rows[100:]
        del file["bodies"][100:]
        for error in schema.iter_errors(file):
            fail(f"{spec}: {error.json_path}: {error.message[:200]}")


def check_example(project, command, schema):
    """The block of docs/guide/scene-files.md is the file of examples, and that runs."""
    path = os.path.join(project, "examples", "swing.json")
    with open(path, encoding="utf-8") as file:
        text = file.read()
    with open(os.path.join(project, "docs", "guide", "scene-files.md"), encoding="utf-8") as file:
        blocks = re.findall(r"^```json\n(.*?)^```", file.read(), re.M | re.S)
    if text not in blocks:
        fail("docs/guide/scene-files.md has another example than examples/swing.json")
    result = run(command, "run", path, "--quiet", "--json")
    ran = json.loads(result.stdout) if result.returncode == 0 else {}
    # The ball, which lies 0.45 m from where the plank begins, is kicked and rolls.
    if not ran.get("displacement_max", 0) > 1:
        fail(f"examples/swing.json: exit {result.returncode}, {result.stderr}, moved {ran.get('displacement_max')} m")
    if schema:
        for error in schema.iter_errors(json.loads(text)):
            fail(f"examples/swing.json: {error.json_path}: {error.message}")


def check_settings(command, document):
    """The schema's settings are the library's; how many iterations and sub-steps there are goes by method in a file."""
    reported = json.loads(run(command, "settings", "--json").stdout)["properties"]
    for name in ("iterations", "substeps"):
        del reported[name]["default"]
    for properties in (reported, have := document["$defs"]["settings"]["properties"]):
        for value in properties.values():
            value.pop("description", None)
    for name in sorted({*reported, *have}):
        if reported.get(name) != have.get(name):
            fail(f"settings.{name}: the schema has {have.get(name)}, `subadmm settings --json` {reported.get(name)}")


def main():
    project, command = map(os.path.abspath, sys.argv[1:3])
    schema = None
    with open(os.path.join(project, "docs", "scene.schema.json"), encoding="utf-8") as file:
        document = json.load(file)
    if jsonschema:
        jsonschema.Draft202012Validator.check_schema(document)
        schema = jsonschema.Draft202012Validator(document)
    lists = subprocess.run([sys.executable, os.path.join(project, "scripts", "lists.py"), "--check", project],
                           capture_output=True, text=True, check=False)
    if lists.returncode:
        failures.append(lists.stdout + lists.stderr)
        print(failures[-1])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        check_good(project, command, schema)
        check_cases(command, schema)
        check_example(project, command, schema)
        check_settings(command, json.loads(json.dumps(document)))
        if schema:
            check_exports(command, schema)
        os.chdir("/")
    print(f"{len(CASES) + len(TEXTS)} files refused, {len(failures)} failures"
          + ("" if schema else "; the schema was left out: python3-jsonschema is not there"))
    sys.exit(bool(failures))


main()
