"""The state that a loaded model starts in, with MuJoCo's kinematics of it."""

import numpy as np

from ..given import whole


def start_of(source, keyframe, qpos, qvel):
    """A mujoco.MjData in the start state, with poses and velocities of all bodies."""
    import mujoco

    data = mujoco.MjData(source)
    if keyframe is not None:
        if isinstance(keyframe, str):
            index = mujoco.mj_name2id(source, mujoco.mjtObj.mjOBJ_KEY, keyframe)
        else:
            index = whole("keyframe", keyframe, -(2**31), 2**31 - 1)
        if not 0 <= index < source.nkey:
            names = [source.key(k).name or str(k) for k in range(source.nkey)]
            raise ValueError(f"keyframe: {keyframe!r} is none of the file's: {', '.join(names) or 'it has none'}")
        mujoco.mj_resetDataKeyframe(source, data, index)
    for name, values, into in (("qpos", qpos, data.qpos), ("qvel", qvel, data.qvel)):
        if values is None:
            continue
        values = np.asarray(values)
        if values.dtype.kind not in "iuf" or values.shape != into.shape or not np.all(np.isfinite(values)):
            raise ValueError(f"{name}: must be {into.size} finite numbers")
        into[:] = values
    mujoco.mj_kinematics(source, data)
    mujoco.mj_comPos(source, data)
    mujoco.mj_comVel(source, data)
    return data


def velocity_of_frame(source, data, body):
    """Of the origin of a MuJoCo body's frame: linear (m/s), angular (rad/s), world."""
    import mujoco

    out = np.zeros(6)
    mujoco.mj_objectVelocity(source, data, mujoco.mjtObj.mjOBJ_XBODY, body, out, 0)
    return out[3:], out[:3]
