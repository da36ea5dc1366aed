"""A recording as binary glTF 2.0 with an animation: a node a body, and under it a node a shape. glTF has y up: a node
above all turns the scene."""
import json
import struct

import numpy as np

_FLOAT, _INDEX = 5126, 5125


def glb_of(recording) -> bytes:
    """The file's bytes."""
    description = recording.description
    blob = bytearray()
    views, accessors, meshes, materials, nodes = [], [], [], [], []

    def put(values, kind, shape, target=None, bounds=False):
        """The number of an accessor of the values."""
        values = np.ascontiguousarray(values, {_FLOAT: "<f4", _INDEX: "<u4"}[kind])
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": values.nbytes})
        if target:
            views[-1]["target"] = target
        accessor = {"bufferView": len(views) - 1, "componentType": kind, "count": len(values), "type": shape}
        if bounds:
            low, high = values.reshape(len(values), -1).min(axis=0), values.reshape(len(values), -1).max(axis=0)
            accessor.update(min=low.tolist(), max=high.tolist())
        accessors.append(accessor)
        blob.extend(values.tobytes())
        return len(accessors) - 1

    def numbers(values):
        return [float(value) for value in values]

    # Node k is body k; those that are in motion have their first pose in the animation as well.
    place, turn = recording.poses(0)
    children = [[] for _ in range(description.bodies)]
    for k in range(description.bodies):
        nodes.append({"name": f"body {k}", "translation": numbers(place[k]), "rotation": _xyzw(turn[k])})
    material = {}
    for group in description.groups:
        corners = group.mesh.vertices[group.mesh.triangles].reshape(-1, 3)
        attributes = {"POSITION": put(corners, _FLOAT, "VEC3", 34962, True),
                      "NORMAL": put(group.mesh.corner_normals().reshape(-1, 3), _FLOAT, "VEC3", 34962)}
        of_colour, colours = {}, group.tinted()
        for k, body in enumerate(group.body):
            colour = *np.round(np.clip(colours[k], 0, 1) ** 2.2, 3).tolist(), float(np.round(group.opacity[k], 3))
            if colour not in material:
                material[colour] = len(materials)
                materials.append({"pbrMetallicRoughness": {"baseColorFactor": list(colour), "metallicFactor": 0.0,
                                                           "roughnessFactor": 0.7},
                                  **({"alphaMode": "BLEND"} if colour[3] < 1 else {})})
            if colour not in of_colour:
                of_colour[colour] = len(meshes)
                meshes.append({"primitives": [{"attributes": attributes, "material": material[colour]}]})
            children[body].append(len(nodes))
            nodes.append({"mesh": of_colour[colour], "translation": numbers(group.position[k]),
                          "rotation": _xyzw(group.orientation[k]), "scale": numbers(group.scale[k])})
    for k, of in enumerate(children):
        if of:
            nodes[k]["children"] = of
    half = float(np.sqrt(0.5))
    nodes.append({"name": recording.title or "world", "rotation": [-half, 0.0, 0.0, half]})
    if description.bodies:
        nodes[-1]["children"] = list(range(description.bodies))

    whole = {"asset": {"version": "2.0", "generator": "subadmm"}, "scene": 0, "scenes": [{"nodes": [len(nodes) - 1]}],
             "nodes": nodes, "meshes": meshes, "materials": materials}
    animation = _animation(recording, put)
    if animation:
        whole["animations"] = [animation]
    whole.update(accessors=accessors, bufferViews=views, buffers=[{"byteLength": len(blob)}] if blob else [])
    text = json.dumps({name: value for name, value in whole.items() if value != []}, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    blob.extend(b"\0" * (-len(blob) % 4))
    return (
        struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(blob))
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(blob), b"BIN\0")
        + bytes(blob)
    )


def _xyzw(q):
    return [float(q[1]), float(q[2]), float(q[3]), float(q[0])]


def _animation(recording, put):
    """Of each body that moves: the frames at which its pose changes and those beside them, between which it is
    linear."""
    times = recording.times
    poses = np.concatenate([recording.positions, recording.orientations], axis=2)
    changed = (np.diff(poses, axis=0) != 0).any(axis=2)                     # frames - 1 x bodies
    keep = np.zeros(poses.shape[:2], dtype=bool)
    keep[:-1] |= changed
    keep[1:] |= changed
    samplers, channels, inputs = [], [], {}
    for body in np.nonzero(keep.any(axis=0))[0]:
        frames = np.nonzero(keep[:, body])[0]
        key = frames.tobytes()
        if key not in inputs:
            inputs[key] = put(times[frames], _FLOAT, "SCALAR", bounds=True)
        turn = recording.orientations[frames, body].astype(float)
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        for path, values, shape in (
            ("translation", recording.positions[frames, body] * recording.position_step, "VEC3"),
            ("rotation", turn[:, [1, 2, 3, 0]], "VEC4"),
        ):
            samplers.append({"input": inputs[key], "output": put(values, _FLOAT, shape), "interpolation": "LINEAR"})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": int(body), "path": path}})
    return {"name": "run", "samplers": samplers, "channels": channels} if channels else None
