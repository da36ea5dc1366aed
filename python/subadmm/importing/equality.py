"""Equality constraints: loops as joints, ties of joints as gears."""

import numpy as np

from .model import element, name_of, world_name
from .options import disabled
from .poses import IDENTITY, mul, pose
from .wheel import tie_by_wheel

LEAST_GAP = 1e-6  # m, of a loop that is reported as open at the start


def _ends(loaded, index):
    """(index of the file's body, frame on it) of both objects of a connect or weld; sites have frames of their own."""
    import mujoco

    source = loaded.source
    out = []
    for obj in (int(source.eq_obj1id[index]), int(source.eq_obj2id[index])):
        if source.eq_objtype[index] == int(mujoco.mjtObj.mjOBJ_SITE):
            out.append((int(source.site_bodyid[obj]), pose(source.site_pos[obj], source.site_quat[obj])))
        else:
            out.append((obj, IDENTITY))
    return out


def _add_loop(loaded, index, weld):
    import mujoco

    source = loaded.source
    data = source.eq_data[index]
    (body_a, frame_a), (body_b, frame_b) = _ends(loaded, index)
    group_a, group_b = loaded.groups[body_a], loaded.groups[body_b]
    what = element(source, "equality", index)
    if group_a is group_b or "dynamic" not in (group_a.kind, group_b.kind):
        loaded.report.add(what, "not carried over: its bodies are fixed to each other")
        return
    sites = source.eq_objtype[index] == int(mujoco.mjtObj.mjOBJ_SITE)
    kind = "spherical"
    if not sites and not weld:
        frame_a, frame_b = pose(data[0:3], IDENTITY[1]), pose(data[3:6], IDENTITY[1])
    elif not sites:  # a point on b, the same point on a, b's orientation in a's
        frame_b = pose(data[0:3], IDENTITY[1])
        frame_a = pose(data[3:6], data[6:10])
    if weld and data[10] != 0:
        kind = "fixed"
    frame_a = mul(group_a.frame_in_body(body_a), frame_a)
    frame_b = mul(group_b.frame_in_body(body_b), frame_b)
    joint = loaded.world.add_joint(
        kind,
        None if group_a.kind == "static" else group_a.body,
        None if group_b.kind == "static" else group_b.body,
        position_a=frame_a[0],
        orientation_a=frame_a[1],
        position_b=frame_b[0],
        orientation_b=frame_b[1],
        collide=True,
        enabled=bool(source.eq_active0[index]),
        name=world_name(name_of(source, "equality", index)),
    )
    loaded.loops[name_of(source, "equality", index)] = joint
    off = np.linalg.norm(joint.position[:3])
    if off > LEAST_GAP:
        loaded.report.add(what, f"its ends are {off:.3g} m apart at the start")


def _add_tie(loaded, index):
    """q_1 - qpos0_1 = a_0 + a_1 (q_2 - qpos0_2) + ..."""
    from .. import Error

    source, report = loaded.source, loaded.report
    what = element(source, "equality", index)
    coefficients = source.eq_data[index, :5]
    first, second = int(source.eq_obj1id[index]), int(source.eq_obj2id[index])
    one = loaded.joints[name_of(source, "joint", first)]
    rest = source.qpos0[source.jnt_qposadr[first]] + coefficients[0]
    if second < 0 or not np.any(coefficients[1:]):
        if not source.eq_active0[index]:
            report.add(what, "not carried over: it is not active, and a joint held in place is a limit here")
            return
        c = one.joint.coordinate(one.coordinate).copy()
        c.limited = True
        c.lower = c.upper = one.to_coordinate(rest)
        one.joint.set_coordinate(one.coordinate, c)
        return
    if np.any(coefficients[2:]) or coefficients[1] == 0:
        report.add(what, "not carried over: a tie of joints that is not linear")
        return
    other = loaded.joints[name_of(source, "joint", second)]
    ratio, rest2 = float(coefficients[1]), source.qpos0[source.jnt_qposadr[second]]
    # with q = sign x + offset of both
    offset = one.sign * (rest - one.offset + ratio * (other.offset - rest2))
    ends = (one.joint, one.coordinate, other.joint, other.coordinate)
    terms = {"ratio": -one.sign * ratio * other.sign, "offset": float(offset),
             "enabled": bool(source.eq_active0[index])}
    try:
        gear = loaded.world.add_gear(*ends, **terms, name=world_name(name_of(source, "equality", index)))
    except Error as error:
        try:
            (gear, _), wheel = tie_by_wheel(loaded.world, *ends, **terms)
        except (Error, ValueError):
            report.add(what, f"not carried over: joints '{one.name}' and '{other.name}': {error}")
            return
        report.add(what,
                   f"by a wheel of {wheel.mass:.3g} kg between joints '{one.name}' and '{other.name}', with two gears")
    loaded.gears[name_of(source, "equality", index)] = gear


def add_equalities(loaded):
    import mujoco

    source, kinds = loaded.source, mujoco.mjtEq
    if disabled(source, "EQUALITY"):
        return
    for index in range(source.neq):
        kind = kinds(int(source.eq_type[index]))
        if kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            _add_loop(loaded, index, kind == kinds.mjEQ_WELD)
        elif kind == kinds.mjEQ_JOINT:
            _add_tie(loaded, index)
        else:
            what = element(source, "equality", index)
            loaded.report.add(what, f"not carried over: a {kind.name[5:].lower()} constraint")
