"""Joints, with limits and drives."""

import numpy as np

from ..model import world_name
from ..poses import inverse, mul, pose, q_mul, q_of_matrix
from .stage import ALONG, one_of, quat, value

#: Coordinates of a D6 joint by the names of its limits and drives.
D6 = {"transX": 0, "transY": 1, "transZ": 2, "rotX": 3, "rotY": 4, "rotZ": 5}
LEAST_GAP = 1e-6  # m and rad, of frames that are reported as apart at the start: single precision of 1 m and more


class Side:
    """One end of a joint: the world's body (None: the static world), the joint's frame in the world, and the prim."""

    def __init__(self, loaded, reader, joint, number, turn):
        targets = getattr(joint, f"GetBody{number}Rel")().GetTargets()
        position = value(getattr(joint, f"GetLocalPos{number}Attr")())
        local = q_mul(quat(value(getattr(joint, f"GetLocalRot{number}Attr")())), turn)
        self.prim = self.path = self.body = None
        if targets:
            self.prim = reader.stage.GetPrimAtPath(targets[0])
            if not self.prim:
                raise ValueError(f"body{number} is {targets[0]}, which is not there")
        if self.prim:
            self.place = reader.in_world(
                pose(reader.point(self.prim, position), q_mul(reader.place(self.prim)[1], local))
            )
            owner = reader.body_of(self.prim)
            self.path = owner or str(self.prim.GetPath())
            self.body = loaded.bodies.get(self.path)
            if owner and self.body is None:
                raise ValueError(f"body{number} is {owner}, which is not carried over")
        else:
            self.place = reader.in_world(pose(np.array(position, dtype=np.float64) * reader.metre, local))

    @property
    def local(self):
        if self.body is None:
            return self.place
        return mul(inverse(pose(self.body.position, self.body.orientation)), self.place)

    @property
    def moves(self):
        return self.body is not None and self.body.type == "dynamic"


def _instances(prim, schema):
    """Names of a schema's instances on a prim: 'rotX' of PhysicsLimitAPI:rotX."""
    return [name.partition(":")[2] for name in prim.GetAppliedSchemas() if name.startswith(schema + ":")]


def _unit(reader, index):
    """What a coordinate's number is to be multiplied by: m or rad."""
    return reader.metre if index < 3 else np.pi / 180


def _force(reader, index):
    """N or N m of a unit of the stage."""
    return reader.kilogram * reader.metre * (1 if index < 3 else reader.metre)


def _limit(coordinate, low, high):
    coordinate.limited = bool(np.isfinite(low) or np.isfinite(high))
    coordinate.lower, coordinate.upper = float(low), float(high)


def _drive(reader, prim, name, index, coordinate):
    from pxr import UsdPhysics

    drive = UsdPhysics.DriveAPI(prim, name)
    stiffness, damping = value(drive.GetStiffnessAttr()), value(drive.GetDampingAttr())
    kinds = UsdPhysics.Tokens.force, UsdPhysics.Tokens.acceleration
    if one_of(drive.GetTypeAttr(), kinds) == UsdPhysics.Tokens.acceleration:
        reader.report.add(
            reader.element(prim), f"drive '{name}' is not carried over: its force is relative to the mass"
        )
        return
    if stiffness == 0 and damping == 0:
        return
    unit, force = _unit(reader, index), _force(reader, index)
    coordinate.drive = "position"
    coordinate.drive_stiffness, coordinate.drive_damping = stiffness * force / unit, damping * force / unit
    coordinate.target_position = value(drive.GetTargetPositionAttr()) * unit
    coordinate.target_speed = value(drive.GetTargetVelocityAttr()) * unit
    coordinate.drive_force = float(value(drive.GetMaxForceAttr(), infinite=True)) * force


def _law(reader, prim):
    """kind, locks, {index: Coordinate}, length of a joint. Raises ValueError where it is none that there is here."""
    from pxr import UsdPhysics

    from ... import Coordinate

    coordinates = {}
    limits, drives = _instances(prim, "PhysicsLimitAPI"), _instances(prim, "PhysicsDriveAPI")
    names, kind, locks, length = {}, "custom", 0, -1.0
    if prim.IsA(UsdPhysics.FixedJoint):
        kind = "fixed"
    elif prim.IsA(UsdPhysics.RevoluteJoint) or prim.IsA(UsdPhysics.PrismaticJoint):
        turns = prim.IsA(UsdPhysics.RevoluteJoint)
        joint = (UsdPhysics.RevoluteJoint if turns else UsdPhysics.PrismaticJoint)(prim)
        kind, index = ("revolute", 5) if turns else ("prismatic", 2)
        names = {"angular" if turns else "linear": index}
        low, high = (value(a, infinite=True) * _unit(reader, index)
                     for a in (joint.GetLowerLimitAttr(), joint.GetUpperLimitAttr()))
        if low > high:
            raise ValueError(f"lowerLimit is above upperLimit: {low:g}, {high:g}")
        coordinates[index] = Coordinate()
        _limit(coordinates[index], low, high)
    elif prim.IsA(UsdPhysics.SphericalJoint):
        kind, joint = "spherical", UsdPhysics.SphericalJoint(prim)
        if max(value(joint.GetConeAngle0LimitAttr(), True), value(joint.GetConeAngle1LimitAttr(), True)) >= 0:
            reader.report.add(reader.element(prim), "the limit of its cone is not carried over")
    elif prim.IsA(UsdPhysics.DistanceJoint):
        joint = UsdPhysics.DistanceJoint(prim)
        low, high = (value(a, infinite=True) * reader.metre
                     for a in (joint.GetMinDistanceAttr(), joint.GetMaxDistanceAttr()))
        low, high = max(low, 0.0), high if high >= 0 else np.inf
        if low > high:
            raise ValueError(f"minDistance is above maxDistance: {low:g} m, {high:g} m")
        if low == high:
            kind, length = "distance", low
        elif low > 0 or np.isfinite(high):
            kind, coordinates[0] = "spring", Coordinate()
            _limit(coordinates[0], low if low > 0 else -np.inf, high)
        else:
            raise ValueError("it has neither a least nor a greatest distance")
    else:
        names = D6
        kind, locks = _d6(reader, prim, limits, coordinates)
    for name in limits if names is not D6 else []:
        reader.report.add(reader.element(prim), f"limit '{name}' is not carried over: joints of its type have none")
    for name in drives:
        if name not in names:
            reader.report.add(reader.element(prim), f"drive '{name}' is not carried over: joints of its type have none")
        elif locks >> names[name] & 1 == 0:
            _drive(reader, prim, name, names[name], coordinates.setdefault(names[name], Coordinate()))
    return kind, locks, coordinates, length


def _d6(reader, prim, limits, coordinates):
    """kind and locks of a generic joint; limits whose lower end is above the upper one lock."""
    from pxr import UsdPhysics

    from ... import Coordinate

    locks = 0
    for name in limits:
        api = UsdPhysics.LimitAPI(prim, name)
        low, high = value(api.GetLowAttr(), infinite=True), value(api.GetHighAttr(), infinite=True)
        if name not in D6:
            if np.isfinite(low) or np.isfinite(high):
                reader.report.add(
                    reader.element(prim), f"limit '{name}' is not carried over: not beside other coordinates"
                )
            continue
        index = D6[name]
        if low > high:
            locks |= 1 << index
            continue
        coordinates[index] = Coordinate()
        _limit(coordinates[index], low * _unit(reader, index), high * _unit(reader, index))
    turns = [k for k in range(3, 6) if not locks >> k & 1]
    if len(turns) > 1 and any(coordinates[k].limited for k in turns if k in coordinates):
        what = "the rotation vector's components" if len(turns) == 3 else "angles about an axis of either body"
        reader.report.add(reader.element(prim), f"limits of its rotations are of {what}, not of twist and swing")
    return ("fixed", 0) if locks == 63 else ("custom", locks)


def _report_start(reader, prim, joint, coordinates):
    """Frames that do not fit, and coordinates outside of their limits: both are drawn in, which something may not let
    them."""
    now = np.array(joint.position)
    locked = [k for k in range(6) if joint.locks >> k & 1]
    if joint.kind not in ("distance", "spring") and np.abs(now[locked]).max(initial=0) > LEAST_GAP:
        off = np.abs(now[locked]).max()
        reader.report.add(reader.element(prim), f"its frames are up to {off:.3g} (m, rad) apart at the start")
    for index, c in coordinates.items():
        if c.limited and not c.lower - LEAST_GAP <= now[index] <= c.upper + LEAST_GAP:
            what = f"starts at {now[index]:.4g}, outside of its range [{c.lower:.4g}, {c.upper:.4g}] (m, rad)"
            reader.report.add(reader.element(prim), what)


def _add_joint(loaded, reader, prim):
    from pxr import UsdPhysics

    joint = UsdPhysics.Joint(prim)
    axis = prim.GetAttribute("physics:axis")
    turn = q_of_matrix(ALONG[one_of(axis, ALONG)] if axis else np.eye(3))
    a, b = (Side(loaded, reader, joint, number, turn) for number in (0, 1))
    if not a.moves and not b.moves:
        raise ValueError("neither of its bodies moves by forces")
    if a.body == b.body:
        raise ValueError("both of its ends are on one body")
    kind, locks, coordinates, length = _law(reader, prim)
    meets = bool(value(joint.GetCollisionEnabledAttr()))
    force = reader.kilogram * reader.metre
    made = loaded.world.add_joint(
        kind,
        a.body,
        b.body,
        position_a=a.local[0],
        orientation_a=a.local[1],
        position_b=b.local[0],
        orientation_b=b.local[1],
        locks=locks,
        length=length,
        collide=meets,
        enabled=bool(value(joint.GetJointEnabledAttr())),
        break_force=float(value(joint.GetBreakForceAttr(), infinite=True)) * force,
        break_torque=float(value(joint.GetBreakTorqueAttr(), infinite=True)) * force * reader.metre,
        coordinates=coordinates,
        name=world_name(str(prim.GetPath())),
    )
    loaded.joints[str(prim.GetPath())] = made
    _report_start(reader, prim, made, coordinates)
    if not meets:  # what is below a prim that is no body itself
        for side, other in ((a, b), (b, a)):
            if side.prim is not None and side.body is None:
                for path, collider in reader.colliders.items():
                    if collider.GetPath().HasPrefix(side.prim.GetPath()) and path in loaded.bodies:
                        other.body.ignore(loaded.bodies[path])


def add_joints(loaded, reader):
    from pxr import UsdPhysics

    from ... import Error

    for prim in reader.prims:
        if prim.IsA(UsdPhysics.Joint):
            try:
                _add_joint(loaded, reader, prim)
            except (Error, ValueError) as error:
                reader.report.add(reader.element(prim), f"not carried over: {error}")
