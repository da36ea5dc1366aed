"""Files to MuJoCo's compiled models."""

import xml.etree.ElementTree as tree
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from .poses import q_about, q_mul

KNOWN_MESHES = (".obj", ".stl", ".msh")


@dataclass
class LinkVisual:
    """A <visual> of a URDF. place: in the link's frame; kind: 'box', 'sphere', 'cylinder', 'capsule' or 'mesh'; size:
    of the shape (half extents; radius and half length), of a mesh its scale; rgba: None where the file says none."""

    link: str
    place: tuple
    kind: str
    size: list
    file: Path | None
    rgba: list | None


def compile_file(path, report, floating=False):
    """(the mujoco.MjModel of an MJCF or URDF file, a URDF's visuals or None); floating: a URDF's base is free.

    Raises FileNotFoundError (also for a URDF's mesh), ValueError (with MuJoCo's message, on one line)."""
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"path: there is no file {path}")
    try:
        root = tree.parse(path).getroot()
    except tree.ParseError as error:
        raise ValueError(f"path: {path} is no XML: {error}") from error
    if root.tag == "mujoco":
        if floating:
            raise ValueError(f"floating: {path} is MJCF, which has free joints itself")
        with _said_of(path):
            return mujoco.MjModel.from_xml_path(str(path)), None
    if root.tag == "robot":
        visuals = _visuals_of(root, path, report)
        with _said_of(path):
            return _compile_urdf(root, path, report, floating), visuals
    raise ValueError(f"path: {path} is neither MJCF nor URDF: its root is <{root.tag}>")


@contextmanager
def _said_of(path):
    """What MuJoCo says names neither the file nor ends on its line."""
    try:
        yield
    except (ValueError, mujoco.FatalError) as error:
        raise ValueError(f"path: {path}: {' '.join(str(error).split())}") from error


def _values(element, name, default):
    """Finite numbers of an attribute, as many as the default has."""
    try:
        out = [float(x) for x in element.get(name).split()] if element is not None and element.get(name) else default
    except ValueError:
        return default
    return out if len(out) == len(default) and np.isfinite(out).all() else default


def _form(geometry, folder):
    """(kind, size, file) of a visual's <geometry>; None: of none that can be drawn."""
    for kind in ("box", "sphere", "cylinder", "capsule", "mesh"):
        found = geometry.find(kind) if geometry is not None else None
        if found is None:
            continue
        if kind == "mesh":
            file = _find(found.get("filename", ""), folder)
            return (kind, _values(found, "scale", [1.0, 1, 1]), file) if file else None
        if kind == "box":
            size = [x / 2 for x in _values(found, "size", [0.0, 0, 0])]
        else:
            size = _values(found, "radius", [0.0])
            size += [] if kind == "sphere" else [x / 2 for x in _values(found, "length", [0.0])]
        return (kind, size, None) if min(size) > 0 else None
    return None


def _visuals_of(root, path, report):
    """All <visual> of a URDF that can be drawn."""
    colours = {m.get("name"): m.find("color") for m in root.findall("material") if m.find("color") is not None}
    out = []
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            form = _form(visual.find("geometry"), path.parent)
            if form is None:
                report.add(f"visual of link '{link.get('name')}'", "is not shown: no shape or file that there is")
                continue
            origin, material, rgba = visual.find("origin"), visual.find("material"), None
            if material is not None:
                colour = material.find("color")
                colour = colours.get(material.get("name")) if colour is None else colour
                rgba = _values(colour, "rgba", [0.5, 0.5, 0.5, 1]) if colour is not None else None
            roll, pitch, yaw = _values(origin, "rpy", [0.0, 0, 0])
            turn = q_mul(q_about([0, 0, 1], yaw), q_mul(q_about([0, 1, 0], pitch), q_about([1, 0, 0], roll)))
            out.append(LinkVisual(link.get("name"), (np.array(_values(origin, "xyz", [0.0, 0, 0])), turn), *form, rgba))
    return out


def _compile_urdf(root, path, report, floating):
    """URDF has meshes where MuJoCo does not look for them, and in formats that it does not know."""
    if root.find("mujoco") is None:
        root.insert(0, tree.fromstring('<mujoco><compiler discardvisual="true"/></mujoco>'))
    options = root.find("mujoco")
    compiler = options.find("compiler")
    if compiler is None:
        compiler = tree.SubElement(options, "compiler")
    compiler.attrib.setdefault("fusestatic", "false")  # the base stays a body: which geoms are the robot's
    for kind in ("transmission", "gazebo", "ros2_control"):
        found = root.findall(kind)
        if found:
            report.add(f"<{kind}>", f"not carried over: {len(found)}")
    for link in root.findall("link"):
        if link.find("inertial") is not None or link.find("collision") is not None:
            for visual in link.findall("visual"):  # drawn only: nothing is known by it
                link.remove(visual)
    assets = {}
    for number, mesh in enumerate(root.iter("mesh")):
        file = _find(mesh.get("filename", ""), path.parent)
        if file is None:
            raise FileNotFoundError(f"path: {path}: there is no mesh {mesh.get('filename')}")
        data, suffix = _mesh_of(file)
        name = f"{file.stem}_{number}{suffix}"
        assets[name] = data
        mesh.set("filename", name)
    try:
        return _compile_text(tree.tostring(root, encoding="unicode"), assets, floating)
    except ValueError as error:
        if "balanceinertia" not in str(error):
            raise
        report.add(" ".join(str(error).partition("Element name")[2].split()) or "inertia",
                   "a moment of inertia is larger than the sum of the other two, as no solid's is: all three are their "
                   "mean here, and so on other bodies where that is so")
    compiler.set("balanceinertia", "true")
    return _compile_text(tree.tostring(root, encoding="unicode"), assets, floating)


def _compile_text(text, assets, floating):
    if not floating:
        return mujoco.MjModel.from_xml_string(text, assets)
    spec = mujoco.MjSpec.from_string(text, assets=assets)
    for base in spec.worldbody.bodies:
        if not base.joints:
            base.add_freejoint(name=f"{base.name}_free")
    return spec.compile()


def _find(name, folder):
    """The file that a URDF names: beside it, or by a package's name in the folders above."""
    plain = name.removeprefix("file://")
    if plain.startswith("package://"):
        plain = plain.removeprefix("package://")
        choices = [plain, plain.partition("/")[2]]
    elif plain.startswith("model://"):
        choices = [plain.removeprefix("model://")]
    else:
        choices = [plain]
    for above in (folder, *folder.resolve().parents):
        for choice in choices:
            if (above / choice).is_file():
                return above / choice
    return None


def _mesh_of(file):
    """Bytes and suffix of a mesh, in a format that MuJoCo reads."""
    suffix = file.suffix.lower()
    if suffix in KNOWN_MESHES:
        data = file.read_bytes()
        if suffix != ".stl" or not data[:5].lower().startswith(b"solid"):
            return data, suffix
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(f"{file}: this format needs the package trimesh: pip install trimesh") from error
    return trimesh.load(file, force="mesh").export(file_type="stl"), ".stl"
