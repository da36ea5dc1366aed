"""Actuators as drives of joints.

An actuator's force is linear: gain control + constant - stiffness length - damping rate, its length gear times the
joint's position. All of a joint add up to one drive: K = sum gear^2 stiffness, D = sum gear^2 damping, and a force.
Where there is neither K nor D, a drive of a very small damping and a very large target speed is the force."""

import numpy as np

from .model import LoadedActuator, element, name_of
from .options import disabled
from .ties import Ties

#: Of a drive that stands for a force: its target, m/s or rad/s. The force is off by a share of speed / target.
FORCE_SPEED = 1e8


class Drive:
    """What actuators do to one joint together."""

    def __init__(self, joint, limit):
        self.joint = joint
        self.limit = limit  # the joint's own bound of all actuators' force
        self.actuators = []  # (actuator, factor)

    def update(self):
        joint = self.joint
        stiffness = sum(f * f * a.stiffness for a, f in self.actuators)
        damping = sum(f * f * a.damping for a, f in self.actuators)
        force = sum(f * a.input for a, f in self.actuators)
        bounds = [self.limit]
        servos = [(a, f) for a, f in self.actuators if a.stiffness or a.damping]
        if len(self.actuators) == 1 and servos:
            a, f = servos[0]
            bounds.append(abs(f) * max(abs(a.force_range[0]), abs(a.force_range[1])))
        c = joint.joint.coordinate(joint.coordinate).copy()
        c.drive, c.drive_force = "position", float(min(bounds))
        c.drive_stiffness, c.drive_damping, c.target_position, c.target_speed = stiffness, damping, 0.0, 0.0
        if stiffness > 0:
            c.target_position = joint.to_coordinate(force / stiffness)
        elif damping > 0:
            c.target_speed = joint.sign * force / damping
        elif force != 0:
            c.drive_damping, c.target_speed = abs(force) / FORCE_SPEED, joint.sign * float(np.sign(force)) * FORCE_SPEED
        else:
            c.drive = "off"
        joint.joint.set_coordinate(joint.coordinate, c)


def _parts(loaded, index):
    """[(joint, factor)] that an actuator's force acts on, or why there are none."""
    import mujoco

    source, kinds = loaded.source, mujoco.mjtTrn
    kind, target = kinds(int(source.actuator_trntype[index])), int(source.actuator_trnid[index, 0])
    gear = float(source.actuator_gear[index, 0])
    if kind in (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT):
        joint = loaded.joints[name_of(source, "joint", target)]
        return ([(joint, gear)], "") if joint.type in ("hinge", "slide") else ([], f"it acts on a {joint.type} joint")
    if kind == kinds.mjTRN_TENDON:
        begin = source.tendon_adr[target]
        wraps = range(begin, begin + source.tendon_num[target])
        if all(source.wrap_type[w] == int(mujoco.mjtWrap.mjWRAP_JOINT) for w in wraps):
            return [
                (loaded.joints[name_of(source, "joint", int(source.wrap_objid[w]))], gear * float(source.wrap_prm[w]))
                for w in wraps
            ], ""
        return [], f"it acts on {element(source, 'tendon', target)}, which goes through space"
    return [], f"it acts on a {kind.name[6:].lower()}"


def _index_of(source, joint):
    """The file's index of a LoadedJoint."""
    return next(k for k in range(source.njnt) if name_of(source, "joint", k) == joint.name)


def _one_part(loaded, ties, parts):
    """A servo's parts on joints that are tied together, as one part and the length that is left at its position 0;
    None where they are not."""
    tied = [(factor, *ties.of(_index_of(loaded.source, joint))) for joint, factor in parts]
    roots = {root for _, root, _, _ in tied}
    if len(roots) != 1:
        return None
    name = name_of(loaded.source, "joint", roots.pop())
    factor = sum(factor * ratio for factor, _, ratio, _ in tied)
    return (loaded.joints[name], factor), sum(factor * offset for factor, _, _, offset in tied)


def _law(source, index):
    """gain, stiffness, damping, constant, or why there is none."""
    import mujoco

    gain, bias = source.actuator_gainprm[index], source.actuator_biasprm[index]
    gain_kind = mujoco.mjtGain(int(source.actuator_gaintype[index]))
    bias_kind = mujoco.mjtBias(int(source.actuator_biastype[index]))
    if gain_kind == mujoco.mjtGain.mjGAIN_AFFINE and np.any(gain[1:3]):
        return None, "its gain depends on length or speed"
    if gain_kind not in (mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtGain.mjGAIN_AFFINE):
        return None, f"its gain is that of a {gain_kind.name[7:].lower()}"
    if bias_kind not in (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE):
        return None, f"its bias is that of a {bias_kind.name[7:].lower()}"
    if bias_kind == mujoco.mjtBias.mjBIAS_NONE:
        return (float(gain[0]), 0.0, 0.0, 0.0), ""
    if bias[1] > 0 or bias[2] > 0:
        return None, "its force grows with length or speed"
    return (float(gain[0]), float(-bias[1]), float(-bias[2]), float(bias[0])), ""


def _range(limited, values):
    return (float(values[0]), float(values[1])) if limited else (-np.inf, np.inf)


def _report_dynamics(loaded, index, law, parts):
    """Notes on what an actuator that is carried over has beside its law."""
    import mujoco

    source, report, what = loaded.source, loaded.report, element(loaded.source, "actuator", index)
    kind = mujoco.mjtDyn(int(source.actuator_dyntype[index]))
    if kind != mujoco.mjtDyn.mjDYN_NONE:
        name = kind.name[6:].lower()
        report.add(what, f"its dynamics ({name}) is not carried over: the control set is the activation")
    if hasattr(source, "actuator_delay") and source.actuator_delay[index]:
        report.add(what, "its delay is not carried over")
    lower, upper = source.actuator_forcerange[index]
    if source.actuator_forcelimited[index] and (law[1] or law[2]) and lower != -upper:
        report.add(what, f"forcerange [{lower:g}, {upper:g}] is +-{max(abs(lower), abs(upper)):g} here")
    if hasattr(source, "actuator_dampingpoly") and np.any(source.actuator_dampingpoly[index]):
        report.add(what, "the damping's higher coefficients are not carried over")


def _add_reflected(source, index, parts):
    """Armature and damping that an actuator brings along to its joint (MuJoCo 3.5 and later)."""
    for name, field in (("actuator_armature", "armature"), ("actuator_damping", "spring_damping")):
        value = float(getattr(source, name)[index]) if hasattr(source, name) else 0.0
        if value and len(parts) == 1:
            joint, factor = parts[0]
            c = joint.joint.coordinate(joint.coordinate).copy()
            setattr(c, field, getattr(c, field) + factor * factor * value)
            joint.joint.set_coordinate(joint.coordinate, c)


def add_actuators(loaded, data):
    source, report = loaded.source, loaded.report
    if disabled(source, "ACTUATION"):
        return
    drives = {}
    controls = []
    ties = Ties(loaded)
    for index in range(getattr(source, "nactuator", source.nu)):
        what = element(source, "actuator", index)
        parts, reason = _parts(loaded, index)
        law, why = _law(source, index)
        reason = reason or why
        if not reason and len(parts) > 1 and (law[1] or law[2]):
            one = _one_part(loaded, ties, parts)
            if one is None:
                reason = "a servo of a tendon over several joints that are not tied together"
            else:
                part, left = one
                parts, law = [part], (law[0], law[1], law[2], law[3] - law[1] * left)
        if reason:
            report.add(what, f"not carried over: {reason}")
            continue
        _report_dynamics(loaded, index, law, parts)
        _add_reflected(source, index, parts)
        at = int(source.actuator_ctrladr[index]) if hasattr(source, "actuator_ctrladr") else index
        controlled = source.actuator_ctrllimited[at] and not disabled(source, "CLAMPCTRL")
        actuator = LoadedActuator(
            name_of(source, "actuator", index),
            "position" if law[1] else "velocity" if law[2] else "motor",
            parts,
            *law,
            _range(controlled, source.actuator_ctrlrange[at]),
            _range(source.actuator_forcelimited[index], source.actuator_forcerange[index]),
            drives,
        )
        loaded.actuators[actuator.name] = actuator
        for joint, factor in parts:
            drives.setdefault(joint, Drive(joint, _joint_limit(loaded, joint))).actuators.append((actuator, factor))
        controls.append((actuator, data.ctrl[at]))
    for joint, drive in drives.items():
        bound = [a.name for a, _ in drive.actuators if (a.stiffness or a.damping) and np.isfinite(a.force_range[1])]
        if bound and len(drive.actuators) > 1:
            report.add(
                "actuators " + ", ".join(bound), f"no forcerange here: joint '{joint.name}' has several actuators"
            )
    for actuator, control in controls:
        actuator.control = control


def _joint_limit(loaded, joint):
    """The most that all actuators give a joint (actfrcrange)."""
    source = loaded.source
    index = _index_of(source, joint)
    if not source.jnt_actfrclimited[index]:
        return np.inf
    lower, upper = source.jnt_actfrcrange[index]
    most = float(max(abs(lower), abs(upper)))
    if lower != -upper:
        loaded.report.add(
            element(source, "joint", index), f"actuatorfrcrange [{lower:g}, {upper:g}] is +-{most:g} here"
        )
    return most
