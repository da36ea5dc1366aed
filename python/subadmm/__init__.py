"""Rigid bodies in exact frictional contact, on CPU cores and NVIDIA GPUs.

    import subadmm

    world = subadmm.World()
    world.add_ground()
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=1000, position=(0, 0, 1))
    world.step(400)
    print(box.position, world.report.penetration_max)

SI units everywhere; orientations are unit quaternions w x y z, body to world. What a name means in detail is said once,
in the C headers of the same names (include/subadmm/).
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._core import (
    CONTACT_BEGUN,
    CONTACT_ENDED,
    SENSOR_BEGUN,
    SENSOR_ENDED,
    Body,
    BodyShape,
    Certificate,
    Coordinate,
    Coupling,
    DeviceError,
    Error,
    FileError,
    Gear,
    InvalidArgument,
    Joint,
    LimitExceeded,
    Manifold,
    Mass,
    NonFinite,
    OutOfMemory,
    Report,
    Settings,
    Shape,
    StaleId,
    Unavailable,
    Unsupported,
    World,
    backends,
    build_commit,
    build_compiler,
    mass_of,
    scenes,
    version,
)
from .decomposition import decompose
from .environments import Environments
from .given import indices, numbers, real
from .importing import load
from .objects import add_to_module
from .robots import Robots
from .vectors import read_only
from .copies import replicate

__version__: str = version()
add_to_module()

__all__ = [
    "decompose", "load",
    "Body", "BodyShape", "Certificate", "Coordinate", "Coupling", "DeviceError", "Environments", "Error", "FileError",
    "Gear",
    "InvalidArgument", "Joint", "LimitExceeded", "Manifold", "Mass", "NonFinite", "OutOfMemory", "Report", "Robots",
    "Settings", "Shape",
    "StaleId",
    "Unavailable", "Unsupported", "World", "backends", "box", "build_commit", "build_compiler", "capsule", "cone",
    "CONTACT_BEGUN", "CONTACT_ENDED", "SENSOR_BEGUN", "SENSOR_ENDED", "event_dtype",
    "contact_dtype", "cylinder", "ellipsoid", "heightfield", "hull", "mass_of", "mesh", "plane", "replicate", "scene",
    "scene_from_json",
    "scenes", "sphere",
    "version",
]


# ---- shapes ----------------------------------------------------------------------------------------------------------


def _with(shape: Shape, options: dict[str, Any]) -> Shape:
    for name in options:
        if name not in ("position", "orientation", "friction", "restitution", "category", "mask", "sensor",
                        "surface_velocity"):
            raise TypeError(f"{name}: no such option of a shape")
    _core._set_members(shape, options)
    return shape


def plane(**options: Any) -> Shape:
    """Half-space z <= 0 of the shape's frame, for static bodies. Options of this and all shapes: position and
    orientation in the body's frame, friction (0.5), restitution (0), category, mask, sensor (False; a sensor has no
    contacts and reports overlaps), surface_velocity (0: how the surface moves while the shape stays, as a conveyor
    belt's, m/s, in the shape's frame)."""
    return _with(Shape("plane"), options)


def sphere(radius: float, **options: Any) -> Shape:
    """A ball; m."""
    return _with(Shape("sphere", [radius]), options)


def capsule(radius: float, half_length: float, **options: Any) -> Shape:
    """Radius and half length of the segment along the shape's z axis, m."""
    return _with(Shape("capsule", [radius, half_length]), options)


def box(x: float, y: float, z: float, **options: Any) -> Shape:
    """Half extents, m."""
    return _with(Shape("box", [x, y, z]), options)


def cylinder(radius: float, half_height: float, **options: Any) -> Shape:
    """Along the shape's z axis; m."""
    return _with(Shape("cylinder", [radius, half_height]), options)


def cone(radius: float, half_height: float, **options: Any) -> Shape:
    """Along the shape's z axis, apex up; the origin is halfway up; m."""
    return _with(Shape("cone", [radius, half_height]), options)


def ellipsoid(x: float, y: float, z: float, **options: Any) -> Shape:
    """Semi-axes, m."""
    return _with(Shape("ellipsoid", [x, y, z]), options)


def hull(points: ArrayLike, merge: float | None = None, convex_radius: float = 0.0, **options: Any) -> Shape:
    """The convex hull of points (n x 3, m). merge: faces that are flat to within this share of the extent become
    one; convex_radius: the shape is the Minkowski sum with a ball of this radius, m."""
    return _with(_core._hull(numbers("points", points, 3), -1.0 if merge is None else merge, convex_radius), options)


def mesh(vertices: ArrayLike, triangles: ArrayLike, **options: Any) -> Shape:
    """Triangles (m x 3 indices, counter-clockwise seen from outside) of vertices (n x 3, m), for static and kinematic
    bodies."""
    vertices = numbers("vertices", vertices, 3)
    return _with(_core._mesh(vertices, indices("triangles", triangles, len(vertices))), options)


def heightfield(heights: ArrayLike, spacing: ArrayLike, **options: Any) -> Shape:
    """Heights (rows along y x columns along x, m) over a grid centred at the origin; spacing: (x, y), m. For static and
    kinematic bodies."""
    return _with(_core._heightfield(numbers("heights", heights), spacing), options)


# ---- scenes ----------------------------------------------------------------------------------------------------------


def scene(spec: str | os.PathLike[str], *, backend: str = "auto", precision: str | None = None,
          method: str | None = None, device: int = 0, settings: Mapping[str, Any] | None = None) -> World:
    """The world of a scene by name ("pile:300"), or of a scene file (a path that ends in .json or has a slash), as the
    subadmm command makes it; World.step also runs the scene's script. `settings`: a dict of changes to the scene's
    settings, like {"dt": 0.002}; `method`, "fast" or "paper", also sets the scene's number of iterations for it."""
    return _core._scene(str(spec), False, backend=backend, precision=precision, method=method, device=device,
                        settings=settings)


def scene_from_json(text: str, *, backend: str = "auto", precision: str | None = None, method: str | None = None,
                    device: int = 0, settings: Mapping[str, Any] | None = None) -> World:
    """The same from the text of a scene file."""
    return _core._scene(text, True, backend=backend, precision=precision, method=method, device=device,
                        settings=settings)


# ---- worlds ----------------------------------------------------------------------------------------------------------


def _add_ground(self, friction=0.5, height=0.0):
    """A static plane z = height that bodies of all environments collide with."""
    return self.add_body(
        type="static", environment=-1, position=(0, 0, height), name="ground", shapes=[plane(friction=friction)]
    )


def _add_solid(self, shapes, density=None, mass=None, *, position=(0, 0, 0), orientation=(1, 0, 0, 0), type="dynamic",
               **options):
    """A solid body of one or several shapes, with a uniform density (kg/m^3) or a total mass (kg).

    `position` and `orientation` are those of the frame in which the shapes are placed (the layout); the origin of the
    body is its centre of mass, its axes are the principal axes. For static and kinematic bodies both frames are the
    same, and neither density nor mass is needed. Sensors have no mass. Other options: as add_body. After an error no
    body is added.
    """
    if isinstance(shapes, Shape):
        shapes = [shapes]
    elif not hasattr(shapes, "__iter__"):
        raise TypeError(f"shapes = {shapes!r}: must be a subadmm.Shape, or several")
    shapes = list(shapes)
    if not shapes:
        raise ValueError("shapes: must be one at least")
    if type != "dynamic":
        return self.add_body(type=type, position=position, orientation=orientation, shapes=shapes, **options)
    for k, shape in enumerate(shapes):
        if not isinstance(shape, Shape):
            raise TypeError(f"shapes[{k}] = {shape!r}: must be a subadmm.Shape")
    if (density is None) == (mass is None):
        raise ValueError("density, mass: one of the two must be given")
    solid = [shape for shape in shapes if not shape.sensor]
    if not solid:
        raise ValueError("shapes: one at least must be no sensor, which has no mass")
    if mass is not None:
        mass = real("mass", mass, 1e-9, 1e12)
    whole = mass_of(solid, 1.0)
    density = density if density is not None else mass / whole.mass
    whole = mass_of(solid, density)
    place, turn = whole.pose_of_body(position, orientation)
    own = [shape.copy() for shape in shapes]
    for shape in own:
        shape.position, shape.orientation = whole.pose_in_body(shape.position, shape.orientation)
    return self.add_body(mass=whole.mass, inertia=whole.inertia, position=place, orientation=turn, shapes=own,
                         **options)


def _struct_dtype(members, size):
    """Of a C structure: (name, format, count, offset) of its members, and its size."""
    return np.dtype({
        "names": [name for name, _, _, _ in members],
        "formats": [(form, (count,)) if count > 1 else form for _, form, count, _ in members],
        "offsets": [offset for _, _, _, offset in members],
        "itemsize": size,
    })


#: Members of World.contacts(): ids are (slot, generation); position, normal (from a to b) and
#: separation (< 0: penetration) in m, impulse on b in N s,
#: force on b in N; triangle: of a mesh, else -1.
contact_dtype: np.dtype[Any] = _struct_dtype(_core._contact_members, _core._contact_size)


def _contacts(self):
    """Contacts of the last step: an array of `contact_dtype`."""
    return np.frombuffer(self._contacts(), dtype=contact_dtype)


#: Members of World.events(): step; type, one of CONTACT_BEGUN, CONTACT_ENDED, SENSOR_BEGUN, SENSOR_ENDED; ids
#: are (slot, generation), a is the sensor. Of CONTACT_BEGUN: position (m), normal from a to b, closing speed (m/s) and
#: the pair's impulse on b (N s).
event_dtype: np.dtype[Any] = _struct_dtype(_core._event_members, _core._event_size)


def _events(self):
    """Take the events since the last call (record_events): an array of `event_dtype`, the oldest first. If there were
    more than the capacity, the oldest are lost, and a warning says how many."""
    data, dropped = self._take_events()
    if dropped:
        warnings.warn(f"{dropped} events were lost: take them more often, or keep more (record_events)", stacklevel=2)
    return np.frombuffer(data, dtype=event_dtype)


def _to_json(self, name=None, description=None, duration=None):
    """The world as it is now as the text of a scene file (docs/guide/scene-files.md), which `subadmm run FILE.json`,
    scene(path) and scene_from_json(text) read; duration: how long it is meant to be run for, s. Of scenes all three are
    the scene's own where they are not given, of other worlds 'world', nothing and 10 s. What steps leave for the next
    ones is not in it: see save()."""
    return self._to_json(name, description, None if duration is None else real("duration", duration, 0, 1e9))


def _cast_rays(self, origins, directions, length=np.inf, *, ignore=None, types=(), category=0, mask=0, from_inside=True,
               from_behind=False, sensors=False):
    """What rays hit: origins (n x 3, m, world), directions (n x 3, of any length), how far to search (m). A dict of
    arrays: shape (n; index in World.shapes, -1: nothing), distance (n, m; infinite: nothing), point and normal (n x 3,
    world), triangle (n; of a mesh, else -1). ignore: a Body; types: of bodies, like ("dynamic",); category, mask: only
    shapes that would collide with a shape with these; from_inside: also shapes that contain the origin, at distance 0;
    from_behind: also the back of mesh triangles; sensors: also sensors."""
    return self._cast_rays(numbers("origins", origins, 3), numbers("directions", directions, 3), length, ignore,
                           list(types),
                           category, mask, from_inside, from_behind, sensors)


def _render(self, width=640, height=480, camera=None):
    """A picture of the world as it is now: height x width x 3, uint8, sRGB, in software, without a window or a GPU.

    width, height: pixels, in [16, 8192]; camera: a show.Camera (eye and target in m, world frame; field in rad), or
    None: all that moves in view. The same world gives the same picture. show.picture() is smoother, and takes longer. Raises
    ValueError (out of range), TypeError (of another type)."""
    from .show import render

    return render(self, width, height, camera)


World.render = _render
World.to_json = _to_json
World.cast_rays = _cast_rays
World.add_ground = _add_ground
World.add_solid = _add_solid
World.contacts = _contacts
World.events = _events

_SETS = 'World.set("body_state", states)'
World.positions = property(lambda self: read_only(self.get("body_state")[:, :3], _SETS),
                           doc="Centres of mass of all bodies, n x 3, m; a copy.")
World.orientations = property(lambda self: read_only(self.get("body_state")[:, 3:7], _SETS),
                              doc="Of all bodies, n x 4, w x y z; a copy.")
World.velocities = property(lambda self: read_only(self.get("body_state")[:, 7:], _SETS),
                            doc="Linear (m/s) and angular (rad/s), n x 6; a copy.")
