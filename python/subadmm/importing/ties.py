"""Joints that equality constraints tie to each other, so that one position says them all."""

from .model import name_of


class Ties:
    """of(joint): (root, ratio, offset), position = ratio x root's + offset (m, rad, the file's); a joint that nothing
    ties is its own root. Those count that are gears of the world, from the start."""

    def __init__(self, loaded):
        self._source = source = loaded.source
        self._to = {}
        for index in range(source.neq):
            if name_of(source, "equality", index) in loaded.gears and source.eq_active0[index]:
                constant, ratio = source.eq_data[index, :2]
                self._tie(int(source.eq_obj1id[index]), int(source.eq_obj2id[index]), float(ratio), float(constant))

    def _rest(self, joint):
        return float(self._source.qpos0[self._source.jnt_qposadr[joint]])

    def _tie(self, first, second, ratio, constant):
        """q_1 - qpos0_1 = constant + ratio (q_2 - qpos0_2), as an edge between the two roots."""
        one, a, b = self.of(first)
        other, c, d = self.of(second)
        if one == other:
            return  # tied already
        # a r_1 + b = rest_1 + constant + ratio (c r_2 + d - rest_2)
        free = self._rest(first) + constant + ratio * (d - self._rest(second)) - b
        self._to[one] = (other, ratio * c / a, free / a)

    def of(self, joint):
        ratio, offset = 1.0, 0.0
        while joint in self._to:
            joint, r, o = self._to[joint]
            ratio, offset = ratio * r, ratio * o + offset
        return joint, ratio, offset
