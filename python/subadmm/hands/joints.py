"""The joints of a hand: 21 in the order that MediaPipe uses, or the 25 of WebXR, and the poses of palm and fingertips
that they make."""
import numpy as np

SIDES = ("left", "right")
FINGERS = ("thumb", "index", "middle", "ring", "little")
#: What a hand in a world is made of.
PARTS = ("palm", *FINGERS)

#: The 21 joints, from the wrist; of the thumb its carpometacarpal, metacarpophalangeal and interphalangeal joint, of
#: each finger its metacarpophalangeal, proximal and distal interphalangeal joint; then the tip.
JOINTS = ("wrist", "thumb_cmc", "thumb_mcp", "thumb_ip", "thumb_tip",
          *(f"{finger}_{joint}" for finger in FINGERS[1:] for joint in ("mcp", "pip", "dip", "tip")))
#: The 25 joints of WebXR, in its order: those, and where the fingers' bones begin in the palm.
XR_JOINTS = ("wrist", "thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal", "thumb-tip",
             *(f"{finger}-finger-{joint}" if finger != "little" else f"pinky-finger-{joint}"
               for finger in FINGERS[1:] for joint in ("metacarpal", "phalanx-proximal", "phalanx-intermediate",
                                                       "phalanx-distal", "tip")))

WRIST, MIDDLE, INDEX, LITTLE = 0, 9, 5, 17    # of the 21: the wrist, and knuckles
TIPS = np.array([4, 8, 12, 16, 20])
_OF_XR = [k for k, name in enumerate(XR_JOINTS) if not name.endswith("finger-metacarpal")]
_LEAST = 1e-3      # m: joints that are nearer to each other than that have no direction


def check_side(side):
    """It, or an error."""
    if side not in SIDES:
        raise ValueError(f"side: {side!r}; must be 'left' or 'right'")
    return side


def as_joints(joints, name="joints"):
    """21 x 3, m, of 21 or 25 joints as rows or as one list. Raises TypeError, ValueError."""
    out = np.asarray(joints)
    if out.dtype.kind not in "iuf" or out.size not in (63, 75) or out.shape not in ((21, 3), (25, 3), (63,), (75,)):
        raise TypeError(f"{name}: must be 21 or 25 joints, x y z each; is {out.dtype} of shape {out.shape}")
    out = out.reshape(-1, 3).astype(float)
    wrong = ~(np.abs(out) <= 1e6).all(axis=1)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(f"{name}[{k}]: {out[k]}; must be 3 numbers in [-1e+06, 1e+06]")
    return out[_OF_XR] if len(out) == 25 else out


def _units(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.maximum(length, 1e-300), length[..., 0]


def _quaternions(turns):
    """w x y z of rotation matrices n x 3 x 3, whose columns are the axes."""
    m = np.asarray(turns)
    diagonal = np.einsum("nkk->nk", m)
    trace = diagonal.sum(axis=1)
    # Squares of the four components, times four; the largest one is divided by.
    four = np.stack([1 + trace, *(1 + 2 * diagonal[:, k] - trace for k in range(3))], axis=1)
    out = np.empty((len(m), 4))
    for n, (turn, largest) in enumerate(zip(m, four.argmax(axis=1))):
        twice = np.sqrt(four[n, largest])
        if largest == 0:
            out[n] = [twice, *((turn[(k + 2) % 3, (k + 1) % 3] - turn[(k + 1) % 3, (k + 2) % 3]) / twice
                               for k in range(3))]
        else:
            i = largest - 1
            j, k = (i + 1) % 3, (i + 2) % 3
            out[n, 0] = (turn[k, j] - turn[j, k]) / twice
            out[n, 1 + i] = twice
            out[n, 1 + j] = (turn[j, i] + turn[i, j]) / twice
            out[n, 1 + k] = (turn[k, i] + turn[i, k]) / twice
    return out / 2


def parts_of(joints, side, name="joints"):
    """(positions 6 x 3, m; orientations 6 x 4, w x y z) of the palm and of five fingertips, by 21 or 25 joints.

    The palm's frame is halfway between the wrist and the middle finger's knuckle: x points there, z out of the back of
    the hand. A tip's is at the tip: x goes on along the last bone, z is as near to the palm's as it can be. Raises
    ValueError where joints have no direction: the wrist and the knuckles in one line, a tip at the joint before it."""
    joints, side = as_joints(joints, name), check_side(side)
    ahead, reach = _units(joints[MIDDLE] - joints[WRIST])
    across = joints[INDEX] - joints[LITTLE] if side == "right" else joints[LITTLE] - joints[INDEX]
    back, wide = _units(np.cross(ahead, across))
    if not (reach > _LEAST and wide > _LEAST):
        raise ValueError(f"{name}: the wrist, {joints[WRIST]}, and the knuckles of index, {joints[INDEX]}, middle, "
                         f"{joints[MIDDLE]}, and little finger, {joints[LITTLE]}, must not be in one line")
    along, length = _units(joints[TIPS] - joints[TIPS - 1])
    if not (length > _LEAST).all():
        k = int(np.argmin(length))
        raise ValueError(f"{name}[{TIPS[k]}]: the tip of the {FINGERS[k]}, {joints[TIPS[k]]}, must be at least "
                         f"{_LEAST:g} m away from the joint before it")
    # A bone that is along the palm's z: the palm's x is then as good.
    helper = np.where(np.abs(along @ back)[:, None] < 0.99, back, -np.sign(along @ back)[:, None] * ahead)
    sideways, _ = _units(np.cross(helper, along))
    turns = np.concatenate([np.stack([ahead, np.cross(back, ahead), back], axis=1)[None],
                            np.stack([along, sideways, np.cross(along, sideways)], axis=2)])
    places = np.concatenate([(joints[WRIST] + joints[MIDDLE])[None] / 2, joints[TIPS]])
    return places, _quaternions(turns)
