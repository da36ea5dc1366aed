#!/usr/bin/env python3
"""Imports run one way (docs/internals/architecture.md, "Folders and layers").

    test_layers.py PROJECT [ARCHIVE | FOLDER OF OBJECTS]...

Of every source below PROJECT/src: folders include those they may, and no file includes itself, directly or through
others.
Of the objects in the archives and folders (by nm): no two of them call each other, directly or through others; folders
call those they may include, and define what their own headers declare. What is there several times over (precisions,
instruction sets) counts as one object.
What stands below the world does not see its header.
Of both together: a source and the header of its name are one part, and no part uses itself through others.
Of the modules below PROJECT/python/subadmm: none imports itself through others, also where a function imports. What the
package itself exports is the public API, which every module may use, as the C sources use include/subadmm.
"""
import ast
import glob
import os
import re
import shutil
import subprocess
import sys

# folder -> folders it may use, besides itself. Within a group of folders each may use those before it.
CORE = ["core/base", "core/math", "core/model", "core/solve"]
COLLISION = ["collision/" + name for name in
             ("base", "shapes", "hull", "convex", "mesh", "manifold", "broad", "find", "query")] + ["collision"]
WORLD = ["world/" + name for name in ("state", "step", "resident", "query", "objects", "draw")] + ["world", "world/save", "world/environments"]
CUDA = ["backend_cuda/" + name for name in
        ("device", "collide", "graph", "assemble", "weight", "iterate", "step", "table")]
FLIGHT = "collision/flight"


def layers(folders, below=()):
    return {folder: [*below, *folders[:place]] for place, folder in enumerate(folders)}


MAY_USE = {
    **layers(CORE),
    **layers(COLLISION, CORE[:2]),
    FLIGHT: CORE[:3] + COLLISION,
    **layers(WORLD, CORE + COLLISION + [FLIGHT]),
    **layers(CUDA, CORE + COLLISION + [FLIGHT]),
    "mesh_file": ["core/base"],
    "backend_ref": CORE,
    "backend_cpu": CORE,
    "scene_file": ["core/base"],
    "scenes": ["core/base", "core/math", "scene_file"],
    "fclib": ["core/base", "core/model"],
    "cli": ["core/base", "scene_file", "scenes", "fclib"],
}
# What is built on the public API: what they call of it is theirs to call.
TOOLS = ["scene_file", "scenes", "fclib", "cli"]
# The list of backends: the one place that names them (each through its find function).
BACKEND_LIST = "core/solve/registry.c"


def files_below(root):
    for folder, _, names in os.walk(root):
        for name in names:
            if name.endswith((".h", ".c", ".cpp", ".cu")):
                yield os.path.relpath(os.path.join(folder, name), root)


def includes(root, files):
    graph = {}
    for file in files:
        with open(os.path.join(root, file), encoding="utf-8") as lines:
            wanted = re.findall(r'^\s*#\s*include\s+"([^"]+)"', lines.read(), re.M)
        beside = [os.path.normpath(os.path.join(os.path.dirname(file), name)) for name in wanted]
        graph[file] = {near if near in files else name for near, name in zip(beside, wanted)} & files
    return graph


def public_names(folder):
    names = set()
    for header in glob.glob(os.path.join(folder, "*.h")):
        with open(header, encoding="utf-8") as text:
            names.update(re.findall(r"\bsadmm_\w+", text.read()))
    return names


def above_the_world(root, files):
    """Files that stand below the world and include its header, subadmm/world.h, directly or through public headers."""
    graph = {}
    for name in os.listdir(root):
        if name.endswith(".h"):
            with open(os.path.join(root, name), encoding="utf-8") as text:
                graph[name] = set(re.findall(r'^#include "(?:subadmm/)?([^"/]+)"', text.read(), re.M))

    def reaches(name):
        return name == "world.h" or any(reaches(other) for other in graph.get(name, ()))

    for file in sorted(files):
        if os.path.dirname(file) in WORLD + TOOLS:
            continue
        with open(os.path.join(root, "..", "..", "src", file), encoding="utf-8") as text:
            for name in re.findall(r'^\s*#\s*include\s+"subadmm/([^"]+)"', text.read(), re.M):
                if reaches(name):
                    yield f"{file} includes subadmm/{name}, and with it world.h: it stands below the world"


def declared_names(root, files):
    """Symbol -> folders of the headers that declare it."""
    folders = {}
    for file in files:
        if file.endswith(".h"):
            with open(os.path.join(root, file), encoding="utf-8") as text:
                for name in re.findall(r"^(?!static|#|\s).*\b(sadmm_\w+)\(", text.read(), re.M):
                    folders.setdefault(name, set()).add(os.path.dirname(file))
    return folders


def calls(archives, files, public):
    """Object -> objects that define what it uses, and symbol -> object that defines it; objects by their source below
    src, where one is known."""
    source = {re.sub(r"[/.]", "_", os.path.splitext(file)[0]): file for file in files if not file.endswith(".h")}

    def source_of(member):
        name = re.sub(r"(_f32|_f64|_emulated)?(\.c|\.cpp)?\.o$", "", member).split("_.._")[-1]
        return source.get(name) or source.get("backend_cuda_" + re.sub("^cuda_", "", name))

    defined, used = {}, {}
    for archive in archives:
        member = None
        objects = glob.glob(os.path.join(archive, "*.o")) if os.path.isdir(archive) else [archive]
        listing = subprocess.run(["nm", "--format=posix", *objects], capture_output=True, text=True, check=True)
        for line in listing.stdout.splitlines():
            if line.endswith("]:") or line.endswith(".o:"):
                member = source_of(os.path.basename(re.sub(r"^.*\[|\]?:$", "", line)))
                continue
            fields = line.split()
            if not member or len(fields) < 2:
                continue
            if fields[1] in "TDBRC":
                defined[fields[0]] = member
            elif fields[1] == "U":
                used.setdefault(member, set()).add(fields[0])
    return {file: {defined[symbol] for symbol in symbols - (public if os.path.dirname(file) in TOOLS else set())
                   if symbol in defined} - {file} for file, symbols in used.items()}, defined


def parts(*graphs):
    """A source and its header are one part."""
    joined = {}
    for graph in graphs:
        for file, others in graph.items():
            part = os.path.splitext(file)[0]
            joined.setdefault(part, set()).update(os.path.splitext(other)[0] for other in others)
    return {part: others - {part} for part, others in joined.items()}


def python_imports(root):
    """Module -> modules of the package that it imports; packages by their names."""
    modules = {}
    for path in glob.glob(os.path.join(root, "**", "*.py"), recursive=True):
        name = os.path.splitext(os.path.relpath(path, root))[0].split(os.sep)
        modules[tuple(name[:-1] if name[-1] == "__init__" else name)] = path
    graph = {}
    for module, path in modules.items():
        package = module if path.endswith("__init__.py") else module[:-1]
        used = set()
        with open(path, encoding="utf-8") as text:
            for node in ast.walk(ast.parse(text.read())):
                if isinstance(node, ast.ImportFrom) and node.level > 0:
                    within = tuple(node.module.split(".")) if node.module else ()
                    start = package[:len(package) - node.level + 1] + within
                    used.update(start + (name.name,) if start + (name.name,) in modules else start
                                for name in node.names)
        graph["/".join(module) or "subadmm"] = {"/".join(name) for name in used if name and name != module}
    return graph


def circle(graph):
    """Some circle, as a list; None: there is none."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return None
        path.append(node)
        for other in sorted(graph.get(node, ())):
            found = visit(other)
            if found:
                return found
        path.pop()
        done.add(node)
        return None

    for node in sorted(graph):
        found = visit(node)
        if found:
            return found
    return None


def wrong_edges(graph, verb):
    for file in sorted(graph):
        folder = os.path.dirname(file)
        if folder not in MAY_USE:
            yield f"{file}: folder src/{folder} has no layer in tests/test_layers.py"
            continue
        for other in sorted(graph[file]):
            to = os.path.dirname(other)
            if to == folder or to in MAY_USE[folder]:
                continue
            if file == BACKEND_LIST and to.startswith("backend_") and verb == "calls":
                continue
            yield f"{file} {verb} {other}: src/{folder} may use {', '.join(MAY_USE[folder]) or 'nothing'}"


def wrong_places(defined, declared):
    """What a header declares is defined in its folder; what finds a backend, in the backend's."""
    for symbol in sorted(set(defined) & set(declared)):
        folder = os.path.dirname(defined[symbol])
        finds_backend = folder.startswith("backend_") and os.path.dirname(BACKEND_LIST) in declared[symbol]
        if folder not in declared[symbol] and not finds_backend:
            yield f"{defined[symbol]} defines {symbol}, which is declared in src/{', src/'.join(declared[symbol])}"


def main():
    root, archives = os.path.join(sys.argv[1], "src"), sys.argv[2:]
    files = set(files_below(root))
    graphs = [("includes", includes(root, files))]
    misplaced = []
    if archives and shutil.which("nm"):
        graph, defined = calls(archives, files, public_names(os.path.join(sys.argv[1], "include", "subadmm")))
        graphs.append(("calls", graph))
        misplaced = list(wrong_places(defined, declared_names(root, files)))
        if len(graphs[-1][1]) < 20:
            sys.exit(f"only {len(graphs[-1][1])} objects of src found in {' '.join(archives)}")
    graphs.append(("uses", parts(*(graph for _, graph in graphs))))
    graphs.append(("imports", python_imports(os.path.join(sys.argv[1], "python", "subadmm"))))
    failed = False
    for verb, graph in graphs:
        errors = list(wrong_edges(graph, verb)) if verb in ("includes", "calls") else []
        if verb == "calls":
            errors += misplaced
        if verb == "includes":
            errors += above_the_world(os.path.join(sys.argv[1], "include", "subadmm"), files)
        found = circle(graph)
        if found:
            errors.append(f"a circle: {f' {verb} '.join(found)}")
        for error in errors:
            print(error)
        failed = failed or bool(errors)
        what = {"uses": "part", "imports": "module"}.get(verb, "file")
        print(f"{sum(map(len, graph.values()))} times a {what} {verb} another: "
              f"{'no circle, one way' if not errors else f'{len(errors)} wrong'}")
    sys.exit(failed)


main()
