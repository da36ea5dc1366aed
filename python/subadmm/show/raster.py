"""Which triangle is seen in each pixel, by a depth buffer."""
import numpy as np

_AT_ONCE = 1 << 21   # fragments
NOTHING = np.iinfo(np.uint64).max


def rasterise(corners, width, height):
    """corners: m x 3 x 3 of triangles counter-clockwise in view, columns x to the right and y down in pixels, and
    depth, which is greater than 0 and linear over the picture. Gives (triangle, depth), height x width; triangle -1 and
    depth infinite where there is none. Triangles seen from behind are left out. The nearer one is kept; of equal ones
    the first."""
    x, y = corners[:, :, 0], corners[:, :, 1]
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    left = np.clip(np.ceil(x.min(axis=1) - 0.5), 0, width).astype(np.int64)
    right = np.clip(np.floor(x.max(axis=1) - 0.5) + 1, 0, width).astype(np.int64)
    top = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, height).astype(np.int64)
    bottom = np.clip(np.floor(y.max(axis=1) - 0.5) + 1, 0, height).astype(np.int64)
    use = np.nonzero((area < 0) & (right > left) & (bottom > top))[0]
    best = np.full(width * height, NOTHING, np.uint64)
    # Parts of triangles of at most _AT_ONCE fragments: rows of those that are larger one after the other.
    rows, columns = (bottom - top)[use], (right - left)[use]
    tall = np.maximum(_AT_ONCE // np.maximum(columns, 1), 1)
    parts = -(-rows // tall)
    piece = np.repeat(use, parts)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    begin = top[piece] + number * np.repeat(tall, parts)
    end = np.minimum(begin + np.repeat(tall, parts), bottom[piece])
    count = (end - begin) * (right[piece] - left[piece])
    done = 0
    total = np.cumsum(count)
    while done < len(piece):
        upto = max(int(np.searchsorted(total, (total[done - 1] if done else 0) + _AT_ONCE, side="right")), done + 1)
        _fill(best, corners, area, piece[done:upto], left, right, begin[done:upto], count[done:upto], width)
        done = upto
    depth = (best >> np.uint64(32)).astype(np.uint32).view(np.float32).astype(np.float64)
    seen = best != NOTHING
    triangle = np.where(seen, (best & np.uint64(0xFFFFFFFF)).astype(np.int64), -1)
    return triangle.reshape(height, width), np.where(seen, depth, np.inf).reshape(height, width)


def _fill(best, corners, area, piece, left, right, begin, count, width):
    of = np.repeat(np.arange(len(piece)), count)
    inside = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    across = (right - left)[piece][of]
    px = left[piece][of] + inside % across
    py = begin[of] + inside // across
    at = corners[piece]
    scale = 1 / area[piece]
    fx, fy = px + 0.5, py + 0.5
    depth = np.zeros(len(of))
    covered = np.ones(len(of), dtype=bool)
    for k in range(3):
        b, c = at[:, (k + 1) % 3], at[:, (k + 2) % 3]
        # Share of corner k: an affine function of the pixel.
        gx, gy = (b[:, 1] - c[:, 1]) * scale, (c[:, 0] - b[:, 0]) * scale
        g0 = (b[:, 0] * c[:, 1] - c[:, 0] * b[:, 1]) * scale
        share = gx[of] * fx + gy[of] * fy + g0[of]
        covered &= share >= -1e-9
        depth += share * at[:, k, 2][of]
    keep = covered & (depth > 0)
    key = depth[keep].astype(np.float32).view(np.uint32).astype(np.uint64) << np.uint64(32) | piece[of[keep]].astype(
        np.uint64
    )
    np.minimum.at(best, py[keep] * width + px[keep], key)
