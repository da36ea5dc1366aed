"""Which colliders meet: collision groups and filtered pairs."""

import numpy as np

from ..filters import MOST_CLASSES, classes_of


def _groups(reader):
    """{collider's path: frozenset of its groups' numbers}, and which groups meet (k x k)."""
    from pxr import UsdPhysics

    groups = [prim for prim in reader.prims if prim.IsA(UsdPhysics.CollisionGroup)]
    if not groups:
        return {}, np.ones((0, 0), dtype=bool)
    members = {}
    for number, prim in enumerate(groups):
        query = UsdPhysics.CollisionGroup(prim).GetCollidersCollectionAPI().ComputeMembershipQuery()
        for path, collider in reader.colliders.items():
            if query.IsPathIncluded(collider.GetPath()):
                members.setdefault(path, set()).add(number)
    table = UsdPhysics.CollisionGroup.ComputeCollisionGroupTable(reader.stage)
    paths = [prim.GetPath() for prim in groups]
    meets = np.array([[table.IsCollisionEnabled(a, b) for b in paths] for a in paths])
    return {path: frozenset(numbers) for path, numbers in members.items()}, meets


def _below(reader, path):
    """Bodies (their paths) and colliders that a filtered pair names: one of either, or all below a prim."""
    if str(path) in reader.bodies:
        return [str(path)], []
    if str(path) in reader.colliders:
        owner = reader.body_of(reader.colliders[str(path)])
        return ([], [str(path)]) if owner else ([str(path)], [])
    bodies = [p for p, prim in reader.bodies.items() if prim.GetPath().HasPrefix(path)]
    still = [p for p, prim in reader.colliders.items() if prim.GetPath().HasPrefix(path) and not reader.body_of(prim)]
    return bodies + still, []


def _pairs(reader):
    """Pairs of bodies' paths, and pairs of colliders' paths, that do not meet."""
    from pxr import UsdPhysics

    colliders_of = {}
    for path, prim in reader.colliders.items():
        colliders_of.setdefault(reader.body_of(prim) or path, []).append(path)
    bodies, colliders = [], []
    for prim in reader.prims:
        if not prim.HasAPI(UsdPhysics.FilteredPairsAPI):
            continue
        own = _below(reader, prim.GetPath())
        for target in UsdPhysics.FilteredPairsAPI(prim).GetFilteredPairsRel().GetTargets():
            other = _below(reader, target)
            if not any(own) or not any(other):
                reader.report.add(
                    reader.element(prim), f"filtered pair with {target}: not carried over, there is no body"
                )
            bodies += [(a, b) for a in own[0] for b in other[0] if a != b]
            for some, rest in ((own, other), (other, own)):
                colliders += [(a, b) for a in some[1] for body in rest[0] for b in colliders_of.get(body, [])]
            colliders += [(a, b) for a in own[1] for b in other[1] if a != b]
    return bodies, colliders


class Filters:
    """(category, mask) of colliders by their paths, and pairs of bodies that do not meet."""

    def __init__(self, reader):
        groups, table = _groups(reader)
        self._bodies, pairs = _pairs(reader)
        self._keys = {}
        if not groups and not pairs:
            return
        alone = {path for pair in pairs for path in pair}
        kinds, members = {}, []
        for path in reader.colliders:
            key = groups.get(path, frozenset()), path if path in alone else None
            if key not in kinds:
                kinds[key] = len(members)
                members.append([])
            members[kinds[key]].append(path)
        apart = {frozenset(pair) for pair in pairs}
        meets = np.zeros((len(members), len(members)), dtype=bool)
        for (some, one), i in kinds.items():
            for (others, other), j in kinds.items():
                free = all(table[g, h] for g in some for h in others)
                meets[i, j] = free and (one is None or other is None or frozenset((one, other)) not in apart)
        classes, crowded = classes_of(meets)
        if crowded:
            reader.report.add(
                "collision groups, filtered pairs",
                f"more than {MOST_CLASSES} kinds of colliders: those of the last bit meet more than they should",
            )
        for key, paths in zip(classes, members):
            self._keys.update({path: key or (0, 0) for path in paths})

    def mark(self, path, shape):
        """Set category and mask of a shape of a collider; without groups and pairs they stay the defaults."""
        if path in self._keys:
            shape.category, shape.mask = self._keys[path]

    def ignore(self, loaded):
        """Turn contact of the pairs of bodies off."""
        for a, b in self._bodies:
            if a in loaded.bodies and b in loaded.bodies:
                loaded.bodies[a].ignore(loaded.bodies[b])
