"""Rigid bodies and static colliders as bodies of the world, with their shapes."""

import numpy as np

from ..model import world_name
from ..poses import IDENTITY, inverse, mul, pose, q_turn
from .colliders import shapes_of
from .masses import weight_of
from .stage import naming, value


def _velocity(reader, prim):
    """Of the centre of mass (m/s) and angular (rad/s), in the world's frame; the prim has them in its parent's."""
    from pxr import UsdPhysics

    api, parent = UsdPhysics.RigidBodyAPI(prim), prim.GetParent()
    linear = np.array(value(api.GetVelocityAttr()), dtype=np.float64)
    angular = np.radians(np.array(value(api.GetAngularVelocityAttr()), dtype=np.float64))
    if not parent.IsPseudoRoot():
        linear = reader.linear(parent) @ linear
        angular = q_turn(reader.place(parent)[1], angular)
    return q_turn(reader.turn[1], linear * reader.metre), q_turn(reader.turn[1], angular)


def _add_moving(loaded, reader, filters, path, prim, colliders):
    """The Body of a rigid body. colliders: [(prim, shapes in the frame of the body's prim)]."""
    from pxr import UsdPhysics

    kinematic = value(UsdPhysics.RigidBodyAPI(prim).GetKinematicEnabledAttr())
    place = reader.in_world(reader.place(prim))
    name = world_name(path)
    reader.report_motion(prim)
    if kinematic:
        inertial = IDENTITY
        with naming(reader.element(prim)):
            body = loaded.world.add_body(type="kinematic", position=place[0], orientation=place[1], name=name)
    else:
        mass, moments, inertial = weight_of(reader, prim, colliders)
        start = mul(place, inertial)
        linear, angular = _velocity(reader, prim)
        with naming(reader.element(prim)):
            body = loaded.world.add_body(
                mass=mass,
                inertia=moments,
                position=start[0],
                orientation=start[1],
                linear_velocity=linear,
                angular_velocity=angular,
                name=name,
            )
    if value(UsdPhysics.RigidBodyAPI(prim).GetStartsAsleepAttr()):
        loaded.report.add(reader.element(prim), "startsAsleep is not carried over: bodies do not sleep")
    loaded.bodies[path] = body
    loaded.frames[path] = inverse(inertial)
    _add_shapes(loaded, reader, filters, body, inverse(inertial), colliders)


def _add_shapes(loaded, reader, filters, body, back, colliders):
    """back: the prim's frame in the body's."""
    for prim, shapes in colliders:
        added = []
        for shape in shapes:
            shape.position, shape.orientation = mul(back, pose(shape.position, shape.orientation))
            filters.mark(str(prim.GetPath()), shape)
            with naming(reader.element(prim)):
                added.append(body.add_shape(shape))
        loaded.shapes[str(prim.GetPath())] = added


def add_bodies(loaded, reader, filters):
    """All of them, in the stage's order; a collider of no body is a static body of its own."""
    from pxr import UsdPhysics

    of_body = {path: [] for path in reader.bodies}
    static = []
    for path, prim in reader.colliders.items():
        owner = reader.body_of(prim)
        if owner is None:
            static.append((path, prim))
        else:
            of_body[owner].append(prim)
    for path, prim in static:
        shapes = shapes_of(reader, prim, prim, "static")
        if not shapes:
            continue
        reader.report_motion(prim)
        place = reader.in_world(reader.place(prim))
        with naming(reader.element(prim)):
            body = loaded.world.add_body(
                type="static", environment=-1, position=place[0], orientation=place[1], name=world_name(path)
            )
        loaded.bodies[path], loaded.frames[path] = body, IDENTITY
        _add_shapes(loaded, reader, filters, body, IDENTITY, [(prim, shapes)])
    for path, prim in reader.bodies.items():
        kind = "kinematic" if value(UsdPhysics.RigidBodyAPI(prim).GetKinematicEnabledAttr()) else "dynamic"
        shapes = [(collider, shapes_of(reader, collider, prim, kind)) for collider in of_body[path]]
        _add_moving(loaded, reader, filters, path, prim, shapes)
