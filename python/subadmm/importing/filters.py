"""Which geoms meet, and with what friction: MuJoCo's rules as category and mask, and friction of pairs."""

import numpy as np

MOST_CLASSES = 32
MOST_PAIRS = 100_000  # of geoms with a friction of their own


def _meet(a, b):
    return bool((a[0] & b[1]) or (b[0] & a[1]))


class Filter:
    """category and mask of geoms: (contype, conaffinity) of two geoms meet if one's contype has a bit of the other's
    conaffinity, or they are an explicit pair. Geoms that meet the same ones share a bit."""

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
        classes = {}
        for k in range(len(members)):
            if meets[k].any():
                classes.setdefault(meets[k].tobytes(), []).append(k)
        bits = [min(k, MOST_CLASSES - 1) for k in range(len(classes))]
        self.crowded = len(classes) > MOST_CLASSES
        bit_of = {k: bit for bit, group in zip(bits, classes.values()) for k in group}
        self._category, self._mask = {}, {}
        for bit, group in zip(bits, classes.values()):
            mask = 0
            for k in np.flatnonzero(meets[group[0]]):
                mask |= 1 << bit_of[int(k)]
            for k in group:
                for geom in members[k]:
                    self._category[geom] = 1 << bit
                    self._mask[geom] = mask
        if self.crowded:  # those that share the last bit meet all that any of them meets
            last = [geom for geom, category in self._category.items() if category == 1 << (MOST_CLASSES - 1)]
            mask = 0
            for geom in last:
                mask |= self._mask[geom]
            for geom in last:
                self._mask[geom] = mask

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
