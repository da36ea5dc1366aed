"""A recording as one page: player.html with the meshes and poses in it. It needs no network and nothing installed."""
import base64
import html
import json
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from .camera import looking_at
from .description import extent_of
from .measures import MEASURES
from .picture import SUN
from .recording import TURN_STEP, packed


def _usual_view(recording):
    """The description with the middle and the radius of what moves that it has on average over the recording."""
    boxes = [extent_of(recording.description, *recording.poses(k))
             for k in np.unique(np.linspace(0, len(recording.times) - 1, 9).astype(int))]
    low, high = np.mean(boxes, axis=0)
    return replace(
        recording.description, centre=(low + high) / 2, radius=max(float(np.linalg.norm(high - low)) / 2, 1e-3)
    )


def page_of(recording) -> str:
    """The page's text."""
    description = recording.description
    blob = bytearray()

    def put(values, kind):
        """Where the values are in the data: [type, offset in bytes, count]."""
        data = np.ascontiguousarray(values, {"f32": "<f4", "u8": "u1", "i8": "i1", "i32": "<i4"}[kind]).tobytes()
        blob.extend(b"\0" * (-len(blob) % 4))
        at = len(blob)
        blob.extend(data)
        return [kind, at, np.size(values)]

    groups = []
    for group in description.groups:
        groups.append({
            "corners": put(group.mesh.vertices[group.mesh.triangles], "f32"),
            "normals": put(np.rint(group.mesh.corner_normals() * 127), "i8"),
            "ground": group.is_ground,
            "body": put(group.body, "i32"),
            "place": put(group.position, "f32"),
            "turn": put(group.orientation, "f32"),
            "scale": put(group.scale, "f32"),
            "colour": put(np.rint(group.colour * 255), "u8"),
            "wall": put(group.wall, "f32"),
        })
    camera = looking_at(_usual_view(recording))
    header = {
        "title": recording.title,
        "bodies": description.bodies,
        "frames": len(recording.times),
        "centre": list(map(float, description.centre)),
        "radius": description.radius,
        "eye": list(map(float, camera.eye)),
        "target": list(map(float, camera.target)),
        "field": camera.field,
        "sun": list(map(float, SUN)),
        "times": put(recording.times, "f32"),
        "positionStep": recording.position_step,
        "turnStep": TURN_STEP,
        "positions": put(np.frombuffer(packed(recording.positions), np.uint8), "u8"),
        "turns": put(np.frombuffer(packed(recording.orientations), np.uint8), "u8"),
        "groups": groups,
        "measures": [{"name": MEASURES[name][0], "unit": MEASURES[name][1], "values": put(values, "f32")}
                     for name, values in recording.measures.items()],
    }
    page = (Path(__file__).parent / "player.html").read_text(encoding="utf-8")
    data = base64.b64encode(zlib.compress(bytes(blob), 9)).decode()
    for mark, text in (
        ("{{title}}", html.escape(recording.title)),
        ("{{header}}", json.dumps(header).replace("<", "\\u003c")),
        ("{{data}}", data),
    ):
        page = page.replace(mark, text)
    return page
