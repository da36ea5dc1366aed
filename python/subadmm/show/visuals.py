"""What files of robots have to be looked at: geoms of visual groups, <visual> of links, prims that are drawn."""
from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..importing.model import LoadedModel, LoadedStage, Report, name_of
from ..importing.poses import inverse, mul, pose, q_matrix
from .meshes import Mesh, form_of

_VISIBLE = 3             # groups of geoms that MuJoCo shows: 0 to 2
_NO_COLOUR = (0.5, 0.5, 0.5, 1)   # of a geom that says none


@dataclass
class Visual:
    """A mesh on a body (None: fixed in the world). key: what shares a mesh has the same; make(): the Mesh, of a plane
    with a texture `uv` is how often it is repeated a metre along x and y. position (m), orientation: in the body's
    frame. colour: sRGB, 0 to 1, or None: the file says none."""
    name: str
    body: Any
    position: np.ndarray
    orientation: np.ndarray
    key: tuple
    make: Callable[[], Mesh]
    scale: np.ndarray
    colour: np.ndarray | None
    opacity: float = 1.0
    is_plane: bool = False


def visuals_of(loaded: Any) -> list[Visual]:
    """Of what load() returned; none where the file has none. Read once."""
    if "_visuals" not in vars(loaded):
        if isinstance(loaded, LoadedStage):
            loaded._visuals = _of_stage(loaded)
        elif not isinstance(loaded, LoadedModel):
            loaded._visuals = []
        elif loaded.links is not None:
            loaded._visuals = _of_links(loaded)
        else:
            loaded._visuals = _of_geoms(loaded)
    return loaded._visuals


def _scaled(mesh, linear):
    """Through a matrix, which may be a mirror image."""
    triangles, uv = mesh.triangles, mesh.uv
    if np.linalg.det(linear) < 0:
        triangles, uv = triangles[:, ::-1], None if uv is None else uv[:, ::-1]
    return Mesh(mesh.vertices @ np.asarray(linear).T, np.ascontiguousarray(triangles, np.int32), uv, mesh.image)


# ---- MJCF ------------------------------------------------------------------------------------------------------------


def _image(source, texture):
    """height x width x 3, uint8; of a cube its six sides below each other."""
    width, height = int(source.tex_width[texture]), int(source.tex_height[texture])
    channels, begin = int(source.tex_nchannel[texture]), int(source.tex_adr[texture])
    data = source.tex_data if hasattr(source, "tex_data") else source.tex_rgb
    pixels = np.asarray(data[begin:begin + width * height * channels]).reshape(height, width, channels)
    pixels = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    return np.ascontiguousarray(pixels, np.uint8)


def _texture_of(source, material):
    """(image, is it flat rather than a cube?) of a material, or (None, False)."""
    import mujoco

    found = np.atleast_1d(source.mat_texid[material])
    texture = int(found[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] if len(found) > 1 else found[0])
    if texture < 0 and len(found) > 1:
        texture = int(found[int(mujoco.mjtTextureRole.mjTEXROLE_RGBA)])
    if texture < 0:
        return None, False
    return _image(source, texture), int(source.tex_type[texture]) == int(mujoco.mjtTexture.mjTEXTURE_2D)


def _geom_mesh(source, index, image):
    """Of a geom that is a mesh, with a texture where the file has places on it for one."""
    mesh = int(source.geom_dataid[index])
    first, begin = int(source.mesh_vertadr[mesh]), int(source.mesh_faceadr[mesh])
    count = int(source.mesh_facenum[mesh])
    vertices = np.array(source.mesh_vert[first:first + source.mesh_vertnum[mesh]], dtype=float)
    triangles = np.array(source.mesh_face[begin:begin + count], dtype=np.int32)
    at = int(source.mesh_texcoordadr[mesh])
    uv = None
    if image is not None and at >= 0:
        places = np.array(source.mesh_facetexcoord[begin:begin + count])
        uv = np.array(source.mesh_texcoord[at + places], dtype=float)
        uv[..., 1] = 1 - uv[..., 1]       # MuJoCo has images of meshes turned over already
    return Mesh(vertices, triangles, uv, None if uv is None else image)


def _flat_plane(repeat, image, size=None):
    """size: half its lengths, m; None: a plane without ends, whose uv is `repeat`."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    if size is not None:
        mesh.vertices *= [*size, 1]
    if repeat is not None:
        mesh.uv, mesh.image = repeat if size is None else mesh.vertices[mesh.triangles][..., :2] * repeat, image
    return mesh


#: Of a cube's sides in the image, from the uppermost one on: the axis, its sign, and what is to the right and down.
_SIDES = ((0, 1, (0, 0, -1), (0, -1, 0)), (0, -1, (0, 0, 1), (0, -1, 0)), (1, 1, (1, 0, 0), (0, 0, 1)),
          (1, -1, (1, 0, 0), (0, 0, -1)), (2, 1, (1, 0, 0), (0, -1, 0)), (2, -1, (-1, 0, 0), (0, -1, 0)))


def _boxed(image):
    """A box of half extents 1 with the six sides of a cube's image on it."""
    plain = form_of(_unit_box())[2]()
    normals, corners = plain.triangle_normals(), plain.vertices[plain.triangles]
    uv, inset = np.zeros((len(corners), 3, 2)), 1 - 1 / image.shape[1]
    for side, (axis, sign, right, down) in enumerate(_SIDES):
        of = normals[:, axis] * sign > 0.5
        uv[of, :, 0] = (corners[of] @ np.array(right) * inset + 1) / 2
        uv[of, :, 1] = (side + (corners[of] @ np.array(down) * inset + 1) / 2) / 6
    return Mesh(plain.vertices, plain.triangles, uv, image)


def _unit_box():
    from .. import box

    return box(1, 1, 1)


def _papered(repeat, image):
    """The same with a flat image, which is laid on it from above."""
    plain = form_of(_unit_box())[2]()
    return Mesh(plain.vertices, plain.triangles, plain.vertices[plain.triangles][..., :2] * repeat, image)


def _of_skins(loaded):
    """Skins, in pieces: each triangle is on the body that has the largest part in it."""
    source, out = loaded.source, []
    for k in range(source.nskin):
        rgba, material = np.array(source.skin_rgba[k], float), int(source.skin_matid[k])
        if material >= 0:
            image, _ = _texture_of(source, material)
            rgba = np.array(source.mat_rgba[material], float)
            rgba[:3] *= 1.0 if image is None else Mesh(None, None, None, image).tint
        if not 0 <= source.skin_group[k] < _VISIBLE or rgba[3] < 0.03:
            continue
        first, count = int(source.skin_vertadr[k]), int(source.skin_vertnum[k])
        begin = int(source.skin_faceadr[k])
        vertices = np.array(source.skin_vert[first:first + count], float)
        triangles = np.array(source.skin_face[begin:begin + source.skin_facenum[k]], np.int32)
        largest, bone_of = np.zeros(count), np.full(count, -1)
        bones = range(int(source.skin_boneadr[k]), int(source.skin_boneadr[k] + source.skin_bonenum[k]))
        for bone in bones:
            begin = int(source.skin_bonevertadr[bone])
            at = slice(begin, begin + int(source.skin_bonevertnum[bone]))
            ids, weights = np.array(source.skin_bonevertid[at]), np.array(source.skin_bonevertweight[at])
            more = weights > largest[ids]
            largest[ids[more]], bone_of[ids[more]] = weights[more], bone
        of = bone_of[triangles[:, 0]]
        for bone in bones:
            part = triangles[of == bone]
            if not len(part):
                continue
            body = int(source.skin_bonebodyid[bone])
            group = loaded.groups[body]
            place = mul(group.frame_in_body(body), inverse(pose(source.skin_bonebindpos[bone],
                                                                source.skin_bonebindquat[bone])))
            out.append(Visual(f"skin {k}", None if group.kind == "static" else group.body, *place, ("skin", k, bone),
                              lambda v=vertices, t=part: Mesh(v, t), np.ones(3), rgba[:3], float(rgba[3])))
    return out


def _of_geoms(loaded):
    import mujoco

    from .. import Error
    from ..importing.shapes import Shapes

    source, kinds = loaded.source, mujoco.mjtGeom
    makes, out = Shapes(source), _of_skins(loaded)
    for index in range(source.ngeom):
        rgba, material = np.array(source.geom_rgba[index], float), int(source.geom_matid[index])
        said = tuple(np.float32(rgba)) != tuple(np.float32(_NO_COLOUR))
        image, flat = None, False
        if material >= 0:
            if not said:
                rgba, said = np.array(source.mat_rgba[material], float), True
            image, flat = _texture_of(source, material)
        if not 0 <= source.geom_group[index] < _VISIBLE or rgba[3] < 0.03:
            continue
        body = int(source.geom_bodyid[index])
        group = loaded.groups[body]
        place = mul(group.frame_in_body(body), pose(source.geom_pos[index], source.geom_quat[index]))
        kind, scale = kinds(int(source.geom_type[index])), np.ones(3)
        colour, mesh_image = rgba[:3], image if flat else None
        plane = kind == kinds.mjGEOM_PLANE
        try:
            if plane:
                repeat = None
                if mesh_image is not None:
                    repeat = np.array(source.mat_texrepeat[material], float) / 2
                    size = np.array(source.geom_size[index, :2], float)
                    if not source.mat_texuniform[material]:
                        repeat = repeat / np.where(size > 0, size, 1)
                # A floor goes on for ever; a wall is as large as the file has it drawn.
                size = np.array(source.geom_size[index, :2], float)
                frame = mul(group.frame_in_world(body), pose(source.geom_pos[index], source.geom_quat[index]))
                plane = bool((size <= 0).any() or q_matrix(frame[1])[2, 2] > 0.9)
                size = None if plane else size
                key, make = ("plane", index), lambda r=repeat, i=mesh_image, z=size: _flat_plane(r, i, z)
                used = repeat is not None
            elif kind in (kinds.mjGEOM_MESH, kinds.mjGEOM_SDF):
                used = mesh_image is not None and source.mesh_texcoordadr[int(source.geom_dataid[index])] >= 0
                key = "geom", int(source.geom_dataid[index]), material if used else -1
                make = lambda k=index, i=mesh_image if used else None: _geom_mesh(source, k, i)  # noqa: E731
            elif kind == kinds.mjGEOM_BOX and image is not None and (flat or image.shape[0] == 6 * image.shape[1]):
                scale, used = np.array(source.geom_size[index], float), True
                repeat = np.array(source.mat_texrepeat[material], float) / 2
                if source.mat_texuniform[material]:
                    repeat = repeat * scale[:2]
                key = "papered", material, tuple(repeat) if flat else ()
                make = (lambda r=repeat, i=image: _papered(r, i)) if flat else (lambda i=image: _boxed(i))
            else:
                shape, = makes.make(index, False)
                (key, scale, make), used = form_of(shape), False
        except (Error, ValueError):       # a kind that there is none of here
            continue
        if image is not None and not used:
            colour = colour * Mesh(None, None, None, image).tint
        out.append(Visual(name_of(source, "geom", index), None if group.kind == "static" else group.body, *place, key,
                          make, scale, colour if said else None, float(rgba[3]), plane))
    return out


# ---- URDF ------------------------------------------------------------------------------------------------------------


def _parts_of_file(file):
    """[(Mesh, colour or None)] of a file of meshes, by trimesh."""
    import trimesh

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = trimesh.load(file)
        scene = scene if isinstance(scene, trimesh.Scene) else trimesh.Scene(scene)
        parts = []
        for node in scene.graph.nodes_geometry:
            matrix, name = scene.graph[node]
            geometry = scene.geometry[name]
            if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
                continue
            mesh = Mesh(np.array(geometry.vertices, float), np.array(geometry.faces, np.int32))
            colour, visual = None, geometry.visual
            if visual.defined:
                material = getattr(visual, "material", None)
                image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
                places = getattr(visual, "uv", None)
                if image is not None and places is not None and len(places) == len(mesh.vertices):
                    uv = np.array(places, float)[mesh.triangles]
                    mesh = Mesh(mesh.vertices, mesh.triangles, uv * [1, -1] + [0, 1],
                                np.ascontiguousarray(np.array(image.convert("RGB")), np.uint8))
                    colour = np.ones(3)
                elif material is not None:
                    colour = np.array(material.main_color[:3], float) / 255
                elif visual.kind in ("vertex", "face"):
                    colour = np.array(visual.main_color[:3], float) / 255
            parts.append((_moved(mesh, matrix), colour))
    return parts


def _moved(mesh, matrix):
    out = _scaled(mesh, matrix[:3, :3])
    return Mesh(out.vertices + matrix[:3, 3], out.triangles, out.uv, out.image)


def _of_links(loaded):
    import subadmm as s

    source, files, out = loaded.source, {}, []
    indices = {name_of(source, "body", k): k for k in range(source.nbody)}
    for link in loaded.links:
        index = indices.get(link.link, 0)     # 0: the world, which the base may have become
        group = loaded.groups[index]
        body = None if group.kind == "static" else group.body
        place = mul(group.frame_in_body(index), link.place)
        colour, opacity = (None, 1.0) if link.rgba is None else (np.array(link.rgba[:3]), float(link.rgba[3]))
        if opacity < 0.03:
            continue
        if link.kind == "mesh":
            if link.file not in files:
                try:
                    files[link.file] = _parts_of_file(link.file)
                except Exception as error:   # whatever a file's reader thinks of it: it is left out, and said so
                    files[link.file] = []
                    loaded.report.add(f"visual of link '{link.link}'", f"is not shown: {link.file}: {error}")
            for k, (mesh, own) in enumerate(files[link.file]):
                shown = np.ones(3) if mesh.image is not None else colour if colour is not None else own
                key = "file", link.file, k, tuple(link.size)
                out.append(Visual(link.link, body, *place, key, lambda m=mesh, z=link.size: _scaled(m, np.diag(z)),
                                  np.ones(3), shown, opacity))
            continue
        shape = {"box": s.box, "sphere": s.sphere, "cylinder": s.cylinder, "capsule": s.capsule}[link.kind](*link.size)
        key, scale, make = form_of(shape)
        out.append(Visual(link.link, body, *place, key, make, scale, colour, opacity))
    return out


# ---- USD -------------------------------------------------------------------------------------------------------------


def _input(shader, name, depth=0):
    """(constant, image) of a shader's input: what it is connected to, if that is a texture."""
    from pxr import UsdShade

    given = shader.GetInput(name)
    if not given:
        return None, None
    sources = given.GetConnectedSources()[0]
    if not sources:
        return given.Get(), None
    other, output = sources[0].source, sources[0].sourceName
    if other.GetPrim().IsA(UsdShade.Shader):
        file = UsdShade.Shader(other.GetPrim()).GetInput("file")
        return None, file.Get() if file else None
    if depth < 8:                       # of a material or a graph: its own input
        inner = UsdShade.ConnectableAPI(other.GetPrim()).GetInput(output)
        return (inner.Get() if inner else None), None
    return None, None


def _numbers(value):
    """3 finite numbers, or None."""
    out = None if value is None else np.array(value, dtype=float).reshape(-1)
    return out[:3] if out is not None and len(out) >= 3 and np.isfinite(out[:3]).all() else None


def _look(prim):
    """(colour or None, opacity) of a prim: its preview surface, else its displayColor; USD's colours are linear."""
    from pxr import UsdGeom, UsdShade

    colour, opacity = None, 1.0
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    surface = material.ComputeSurfaceSource()[0] if material else None
    if surface:
        for name in ("diffuseColor", "diffuse_color_constant", "diffuse_tint"):
            value, image = _input(surface, name)
            colour = _numbers(value)
            if colour is not None or image is not None:
                break
        if colour is None and image is not None and image.resolvedPath:
            from PIL import Image

            with Image.open(image.resolvedPath) as file:
                pixels = np.array(file.convert("RGB").resize((32, 32))) / 255
            colour = (pixels ** 2.2).reshape(-1, 3).mean(axis=0)
        value = _input(surface, "opacity")[0]
        opacity = float(value) if isinstance(value, float) and np.isfinite(value) else 1.0
    if colour is None:
        shown = UsdGeom.Gprim(prim).GetDisplayColorPrimvar().ComputeFlattened()
        if shown:
            colour = _numbers(np.array(shown, dtype=float).reshape(-1, 3).mean(axis=0))
        seen = UsdGeom.Gprim(prim).GetDisplayOpacityPrimvar().Get()
        opacity = float(seen[0]) if seen and np.isfinite(seen[0]) else opacity
    return (None if colour is None else np.clip(colour, 0, 1) ** (1 / 2.2)), float(np.clip(opacity, 0, 1))


def _is_drawn(prim):
    from pxr import UsdGeom

    image = UsdGeom.Imageable(prim)
    return (prim.IsA(UsdGeom.Gprim) and image.ComputeVisibility() != UsdGeom.Tokens.invisible
            and image.ComputePurpose() not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy))


def _of_stage(loaded):
    from .. import Error
    from ..importing.usd.colliders import _gprim
    from ..importing.usd.meshes import NoMesh, mesh_of
    from ..importing.usd.stage import Reader
    from pxr import UsdGeom

    reader, out = Reader(loaded.source, Report(), None), []
    for prim in reader.prims:
        try:
            if not _is_drawn(prim):
                continue
            owner = reader.body_of(prim)
            body = loaded.bodies.get(owner) if owner else None
            if owner and body is None:
                continue
            own = reader.place(prim)
            linear = q_matrix(own[1]).T @ reader.linear(prim) * reader.metre
            if owner:
                place = mul(loaded.frames[owner], mul(inverse(reader.place(reader.bodies[owner])), own))
            else:
                place = reader.in_world(own)
            colour, opacity = _look(prim)
            plane = False
            if prim.IsA(UsdGeom.Mesh):
                vertices, triangles = mesh_of(prim, linear)
                key = "prim", vertices.tobytes(), triangles.tobytes()
                make, scale = (lambda v=vertices, t=triangles: Mesh(v, t)), np.ones(3)
            else:
                shape = _gprim(reader, prim, linear)
                if shape is None:
                    continue
                place = mul(place, (shape.position, shape.orientation))
                plane = shape.type == "plane"
                key, scale, make = form_of(shape)
            if opacity >= 0.03:
                out.append(Visual(str(prim.GetPath()), body, *place, key, make, scale, colour, opacity, plane))
        except (Error, NoMesh, ValueError, OSError, ImportError, RuntimeError) as error:   # (USD's own are RuntimeErrors)
            loaded.report.add(reader.element(prim), f"is not shown: {error}")
    return out


