"""How recordings keep poses: small whole numbers, and as few bytes as that takes."""
import numpy as np

#: Quaternions are kept to whole multiples of this: half of it is the largest error of a component.
TURN_STEP = 2.0 ** -12


def packed(values):
    """Whole numbers, frames x bodies x components, as bytes that deflate well: of each component and body the changes
    of the change from frame to frame, folded to 0, -1, 1, -2 ... = 0, 1, 2, 3 ..., their lowest bytes first, then the
    next."""
    rows = np.moveaxis(np.asarray(values, np.int64), 0, -1).transpose(1, 0, 2)
    change = np.diff(rows, axis=-1)
    change = np.concatenate([rows[..., :1], np.diff(change, axis=-1, prepend=0)], axis=-1)
    folded = np.ascontiguousarray((change << 1 ^ change >> 63).astype(np.uint64).astype("<u4"))
    return folded.view(np.uint8).reshape(-1, 4).T.tobytes()


def unpacked(data, frames, bodies, components):
    """What packed() was given."""
    folded = np.ascontiguousarray(np.frombuffer(data, np.uint8).reshape(4, -1).T).view("<u4").astype(np.int64)
    change = (folded >> 1 ^ -(folded & 1)).reshape(components, bodies, frames)
    change[..., 1:] = np.cumsum(change[..., 1:], axis=-1)
    rows = np.cumsum(change, axis=-1)
    return np.moveaxis(rows.transpose(1, 0, 2), -1, 0)
