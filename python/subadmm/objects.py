"""What objects of the library have in Python beside what the module gives them: copies, names, and how they are shown."""
import difflib

import numpy as np

from . import _core

# ---- values: settings and coordinates of joints -----------------------------------------------------------------------

_COORDINATE = tuple(name for name, member in vars(_core.Coordinate).items() if isinstance(member, property))
_DEFAULTS = {_core.Settings: _core.Settings(), _core.Coordinate: _core.Coordinate()}


def _members(value):
    names = _core.Settings._names if isinstance(value, _core.Settings) else _COORDINATE
    out = {name: getattr(value, name) for name in names}
    return {name: tuple(x.tolist()) if isinstance(x, np.ndarray) else x for name, x in out.items()}


def _made(kind, members):
    out = kind()
    _core._set_members(out, members)
    return out


def _copy(self, memo=None):
    """One of your own, that belongs to no world."""
    return _made(type(self), _members(self))


def _equal(self, other):
    return _members(self) == _members(other) if type(other) is type(self) else NotImplemented


def _shown(self):
    usual = _members(_DEFAULTS[type(self)])
    changed = (f"{name}={value!r}" for name, value in _members(self).items() if value != usual[name])
    return f"subadmm.{type(self).__name__}({', '.join(changed)})"


def _add_values():
    for kind in _DEFAULTS:
        kind.copy = _copy
        kind.__copy__ = kind.__deepcopy__ = _copy
        kind.__reduce__ = lambda self: (_made, (type(self), _members(self)))
        kind.__eq__ = _equal
        kind.__hash__ = None
        kind.__repr__ = _shown


# ---- names and rows -----------------------------------------------------------------------------------------------------


def no_such_name(what, name, names):
    """The KeyError for a name that none has."""
    near = difflib.get_close_matches(str(name), [n for n in names if n], 3)
    return KeyError(f"{name!r}: no {what} has this name" + (f"; is it {' or '.join(map(repr, near))}?" if near else ""))


def _row_named(name, names, what, plural):
    if not isinstance(name, str):
        raise TypeError(f"name = {name!r}: must be a string; {plural} by their rows are World.{plural}")
    rows = [k for k, other in enumerate(names) if other == name]
    if not rows or not name:
        raise no_such_name(what, name, names)
    if len(rows) > 1:
        raise ValueError(f"name = {name!r}: {len(rows)} {plural} have it, rows {rows[0]}, {rows[1]} ... of World.{plural}")
    return rows[0]


def _body_named(self, name):
    """The body with the name. KeyError: none has it; ValueError: several have."""
    return self.bodies[_row_named(name, self.names, "body", "bodies")]


def _finder(what, plural):
    def find(self, name):
        objects = getattr(self, plural)
        return objects[_row_named(name, [one.name for one in objects], what, plural)]

    find.__name__ = what
    find.__doc__ = f"The {what} with the name. KeyError: none has it; ValueError: several have."
    return find


def _has_name(self, name):
    return name in self.names


def _rows_of(ids, known, name):
    ids = np.asarray(ids)
    if ids.dtype.kind not in "iu" or ids.ndim == 0 or ids.shape[-1] != 2:
        raise TypeError(f"{name}: must be ids, (slot, generation), in the last axis; is {ids.dtype} of shape {ids.shape}")
    table = np.full((int(max(known[:, 0].max(initial=0), ids[..., 0].max(initial=0))) + 1, 2), -1, np.int64)
    table[known[:, 0], 0] = np.arange(len(known))
    table[known[:, 0], 1] = known[:, 1]
    found = table[ids[..., 0].astype(np.int64)]
    return np.where(found[..., 1] == ids[..., 1], found[..., 0], -1).astype(np.int32)


def _body_rows(self, ids):
    """Rows of World.bodies, and so of the arrays, of ids (... x 2, slot and generation) as contacts and events have them,
    like contacts()["body_a"]; -1: the body was removed."""
    return _rows_of(ids, self._body_ids(), "ids")


def _shape_rows(self, ids):
    """The same of shapes: rows of World.shapes."""
    return _rows_of(ids, self._shape_ids(), "ids")


# ---- how they are shown -------------------------------------------------------------------------------------------------


def _or_removed(show):
    def shown(self):
        try:
            return f"<subadmm.{type(self).__name__} {show(self)}>"
        except _core.StaleId:
            return f"<subadmm.{type(self).__name__}, removed>"

    return shown


def _id(of):
    return "{}.{}".format(*of.id)


def _quoted(of):
    return f" '{of.name}'" if of.name else ""


def _of_joint(joint):
    ends = [f"{_id(body)}{_quoted(body)}" if body is not None else "the world" for body in (joint.body_a, joint.body_b)]
    return f"{joint.index}{_quoted(joint)}, {joint.kind}, between {ends[0]} and {ends[1]}"


def _of_report(report):
    if report.step == 0:
        return "of no step"
    error = f"{report.error:.2g} m/s" if report.error >= 0 else "not known"
    return f"of step {report.step} on {report.backend} {report.precision}: {report.contacts} contacts, " \
           f"{report.iterations} iterations, error {error}"


def _of_world(self):
    count = len(self.joints)
    return f"<subadmm.{type(self).__name__}: {self.body_count} bodies, {self.shape_count} shapes, {count} joints>"


def _add_reprs():
    _core.World.__repr__ = _of_world
    _core.Body.__repr__ = _or_removed(lambda b: f"{_id(b)}{_quoted(b)}, {b.type}")
    _core.BodyShape.__repr__ = _or_removed(lambda s: f"{_id(s)}{_quoted(s)}, {s.definition.type} on {s.body!r}")
    _core.Joint.__repr__ = _or_removed(_of_joint)
    _core.Coupling.__repr__ = _or_removed(lambda c: f"{c.index}{_quoted(c)}, of {c.body!r}")
    _core.Gear.__repr__ = _or_removed(lambda g: f"{_quoted(g)[1:]}{', ' if g.name else ''}with error {g.error:.3g}")
    _core.Report.__repr__ = lambda r: f"<subadmm.Report {_of_report(r)}>"
    _core.Mass.__repr__ = lambda m: f"<subadmm.Mass {m.mass:.6g} kg, centre {m.centre.tolist()}>"
    _core.Certificate.__repr__ = lambda c: f"<subadmm.Certificate ncp_max {c.ncp_max:.3g} m/s, " \
                                           f"momentum_max {c.momentum_max:.3g}>"
    _core.Shape.__repr__ = lambda s: f"<subadmm.Shape {s.type}" + (f", size {s.size.tolist()} m" if s.size.any() else "") + ">"
    _core.Shape.__copy__ = lambda s: s.copy()
    _core.Shape.__deepcopy__ = lambda s, memo: s.copy()


def add_to_module():
    """Puts all of this into the module's classes."""
    _add_values()
    _add_reprs()
    _core.World.__getitem__ = _body_named
    _core.World.__contains__ = _has_name
    for what in ("shape", "joint", "gear", "coupling"):
        setattr(_core.World, what, _finder(what, what + "s"))
    _core.World.body_rows = _body_rows
    _core.World.shape_rows = _shape_rows
