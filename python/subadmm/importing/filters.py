"""Which geoms meet, and with what friction: MuJoCo's rules as category and mask, and friction of pairs."""

import numpy as np

MOST_CLASSES = 32
MOST_PAIRS = 100_000  # of geoms with a friction of their own


def _meet(a, b):
    return bool((a[0] & b[1]) or (b[0] & a[1]))


def classes_of(meets):
    """(category, mask) of kinds of shapes, by which of them meet (symmetric, k x k, bool), None of those that meet
    nothing; and whether there are too many classes, so that some meet more than they should. Kinds that meet the same
    ones share a bit."""
    rows = {}
    for k in range(len(meets)):
        if meets[k].any():
            rows.setdefault(meets[k].tobytes(), []).append(k)
    crowded = len(rows) > MOST_CLASSES
    bit_of = {k: min(bit, MOST_CLASSES - 1) for bit, kinds in enumerate(rows.values()) for k in kinds}
    masks = {}
    for k, bit in bit_of.items():  # those that share the last bit meet all that any of them meets
        masks[bit] = masks.get(bit, 0) | sum(1 << b for b in {bit_of[int(j)] for j in np.flatnonzero(meets[k])})
    return [(1 << bit_of[k], masks[bit_of[k]]) if k in bit_of else None for k in range(len(meets))], crowded


class Filter:
    """category and mask of geoms: (contype, conaffinity) of two geoms meet if one's contype has a bit of the other's
    conaffinity, or they are an explicit pair."""

    def __init__(self, source):
        pairs = {(int(source.pair_geom1[k]), int(source.pair_geom2[k])) for k in range(source.npair)}
        alone = {geom for pair in pairs for geom in pair}
        keys, members = {}, []
        for geom in range(source.ngeom):
            key = (int(source.geom_contype[geom]), int(source.geom_conaffinity[geom]), geom if geom in alone else -1)
            if (key[0] == 0 and key[1] == 0) and geom not in alone:
                continue
            if key not in keys:
                keys[key] = len(members)
                members.append([])
            members[keys[key]].append(geom)
        meets = np.zeros((len(members), len(members)), dtype=bool)
        for a, i in keys.items():
            for b, j in keys.items():
                meets[i, j] = _meet(a, b) or (a[2], b[2]) in pairs or (b[2], a[2]) in pairs
        classes, self.crowded = classes_of(meets)
        self._category, self._mask = {}, {}
        for key, geoms in zip(classes, members):
            if key is not None:
                for geom in geoms:
                    self._category[geom], self._mask[geom] = key

    def touches(self, geom):
        """Does it meet anything?"""
        return geom in self._category

    def category(self, geom):
        return self._category[geom]

    def mask(self, geom):
        return self._mask[geom]

    def meet(self, a, b):
        return bool(self._category[a] & self._mask[b]) and bool(self._category[b] & self._mask[a])


def friction_of(source, a, b):
    """Sliding friction of two geoms: that of the higher priority, or the larger; 0 for contacts of one dimension."""
    first, second = source.geom_priority[a], source.geom_priority[b]
    if first != second:
        high = a if first > second else b
        return 0.0 if source.geom_condim[high] == 1 else float(source.geom_friction[high, 0])
    if max(source.geom_condim[a], source.geom_condim[b]) == 1:
        return 0.0
    return float(max(source.geom_friction[a, 0], source.geom_friction[b, 0]))
