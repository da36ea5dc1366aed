"""A recording as one page: player.html with the meshes and poses in it. It needs no network and nothing installed."""
import base64
import html
import json
import zlib
from pathlib import Path

import numpy as np

from .camera import usual_camera
from .forces import COLOURS, SCALE, UNMEASURED, legend
from .measures import MEASURES
from .packing import TURN_STEP, packed
from .picture import SUN


def _forces(recording, put):
    """Arrows of all frames: places in a box and forces as 16-bit numbers, errors as 8-bit ones; each number's low
    bytes of all arrows, then its high ones, which deflates better."""
    whole = [np.concatenate([getattr(forces, name) for forces in recording.forces])
             for name in ("position", "force", "error")]
    position, force, error = whole
    if not len(position):
        return None
    low, high = position.min(axis=0), position.max(axis=0)
    span = np.maximum(high - low, 1e-9)
    size = np.linalg.norm(force, axis=1)
    # A jolt would make all others too short to see: what is usually the largest of a frame.
    largest = float(np.median([forces.size.max() for forces in recording.forces if len(forces.force)]))
    kept = force * np.minimum(1, 2 * largest / np.maximum(size, 1e-300))[:, None]
    places = np.rint((position - low) / span * 65535).astype(np.uint16)
    forces = np.rint(kept / (2 * largest) * 32767 + 32768).astype(np.uint16)
    numbers = np.concatenate([places, forces], axis=1).T
    # 0: not measured; 1 to 255: from the scale's lowest power of ten to its highest.
    power = np.log10(np.clip(np.nan_to_num(error, nan=1.0), 1e-300, None))
    level = 1 + 254 * np.clip((power - SCALE[0]) / (SCALE[-1] - SCALE[0]), 0, 1)
    level = np.where(np.isnan(error), 0, np.rint(level))
    return {
        "counts": put([len(forces.force) for forces in recording.forces], "i32"),
        "numbers": put(np.stack([numbers & 255, numbers >> 8], axis=1), "u8"),
        "levels": put(level, "u8"),
        "low": low.tolist(),
        "span": span.tolist(),
        "largest": largest,
        "scale": list(SCALE),
        "colours": COLOURS.tolist(),
        "unmeasured": list(UNMEASURED),
        "measured": bool(level.any()),
    }


class Blob:
    """Data of a page."""

    def __init__(self):
        self.data = bytearray()

    def put(self, values, kind):
        """Where the values are in the data: [type, offset in bytes, count]."""
        data = np.ascontiguousarray(values, {"f32": "<f4", "u8": "u1", "i8": "i1", "i32": "<i4"}[kind]).tobytes()
        self.data.extend(b"\0" * (-len(self.data) % 4))
        at = len(self.data)
        self.data.extend(data)
        return [kind, at, np.size(values)]


def drawing_of(description, camera, put):
    """What drawing.js has to know of a world, as members of a header; put: of a Blob."""
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
            "colour": put(np.rint(np.clip(group.tinted(), 0, 1) * 255), "u8"),
            "wall": put(group.wall, "f32"),
        })
    return {
        "bodies": description.bodies,
        "centre": list(map(float, description.centre)),
        "radius": description.radius,
        "eye": list(map(float, camera.eye)),
        "target": list(map(float, camera.target)),
        "field": camera.field,
        "sun": list(map(float, SUN)),
        "groups": groups,
    }


def filled(path, marks):
    """The text of a page's file, with drawing.js in it and what the marks stand for."""
    drawing = (Path(__file__).parent / "drawing.js").read_text(encoding="utf-8").rstrip("\n")
    page = Path(path).read_text(encoding="utf-8")
    for mark, text in (("drawing", drawing), *marks.items()):
        page = page.replace("{{" + mark + "}}", text)
    return page


def page_of(recording) -> str:
    """The page's text."""
    blob = Blob()
    put = blob.put
    header = {
        **drawing_of(recording.description, usual_camera(recording), put),
        "title": recording.title,
        "count": recording.description.count,
        "frames": len(recording.times),
        "times": put(recording.times, "f32"),
        "positionStep": recording.position_step,
        "turnStep": TURN_STEP,
        "positions": put(np.frombuffer(packed(recording.positions), np.uint8), "u8"),
        "turns": put(np.frombuffer(packed(recording.orientations), np.uint8), "u8"),
        "forces": _forces(recording, put) if recording.forces else None,
        "measures": [{"name": MEASURES[name][0], "unit": MEASURES[name][1], "values": put(values, "f32")}
                     for name, values in recording.measures.items()],
    }
    return filled(Path(__file__).parent / "player.html", {
        "title": html.escape(recording.title),
        "legend": legend(),
        "header": json.dumps(header).replace("<", "\\u003c"),
        "data": base64.b64encode(zlib.compress(bytes(blob.data), 9)).decode(),
    })
