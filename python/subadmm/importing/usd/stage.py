"""A stage's units and frames, and which of its prims are bodies and colliders."""

import os
from collections import Counter
from contextlib import contextmanager

import numpy as np

from ..poses import IDENTITY, mul, pose, q_about, q_of_matrix, q_turn

EARTH = 9.81  # m/s^2
LARGEST = 1e30  # of a transform's numbers: squares of them are finite

#: From z to the axis that a gprim or a joint is along: columns are where x, y, z go.
ALONG = {
    "X": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    "Y": np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "Z": np.eye(3),
}


def open_stage(path):
    """The pxr.Usd.Stage of a file; one that is open already. Raises ImportError, FileNotFoundError, ValueError."""
    try:
        from pxr import Tf, Usd
    except ImportError as error:
        raise ImportError("USD files need the package usd-core: pip install usd-core") from error
    if isinstance(path, Usd.Stage):
        return path
    path = os.fspath(path)
    if not os.path.isfile(path):
        raise FileNotFoundError(f"path: there is no file {path}")
    try:
        return Usd.Stage.Open(path)
    except Tf.ErrorException as error:
        said = " ".join(getattr(one, "commentary", str(one)).strip() for one in error.args)
        raise ValueError(f"path: {path} is no USD stage: {said}") from error


def quat(q):
    """Of a Gf quaternion; of one that is 0, which stands for none, the identity."""
    out = np.array([q.GetReal(), *q.GetImaginary()], dtype=np.float64)
    length = np.linalg.norm(out)
    return out / length if length > 0 else IDENTITY[1].copy()


def _numbers_of(x):
    """Of a value of USD that is numbers, as an array of them; None of one that is none."""
    if hasattr(x, "GetReal"):
        return np.array([x.GetReal(), *x.GetImaginary()])
    out = np.asarray(x)
    return out if out.dtype.kind in "iuf" else None


def _is_like(x, wanted):
    """Is a value of the type of another one? Numbers are, of any precision."""
    if isinstance(wanted, (bool, str)):
        return isinstance(x, type(wanted))
    if hasattr(x, "GetReal") != hasattr(wanted, "GetReal"):
        return False
    found, like = _numbers_of(x), np.shape(wanted)
    if hasattr(x, "GetReal") or found is None:
        return found is not None
    any_length = hasattr(wanted, "__len__") and not like[0]
    return found.ndim == len(like) and found.shape[1:] == like[1:] and (any_length or found.shape == like)


def value(attribute, infinite=False):
    """At the stage's beginning, where it is animated. infinite: infinities mean something in it, as that there is no
    limit. Raises ValueError, which names the attribute, where it is of another type than the schema's or has numbers
    that are not finite. (A file may say anything.)"""
    from pxr import Usd

    out, kind = attribute.Get(Usd.TimeCode.EarliestTime()), attribute.GetTypeName()
    wanted = kind.defaultValue
    if out is None or wanted is None:
        return out
    if not _is_like(out, wanted):
        raise ValueError(f"{attribute.GetPath()} = {str(out)[:60]!r}: must be of type {kind}")
    numbers = None if isinstance(wanted, (bool, str)) else _numbers_of(out)
    if numbers is None or numbers.dtype.kind != "f":
        return out
    wrong = np.isnan(numbers) if infinite else ~np.isfinite(numbers)
    if wrong.any():
        place = tuple(int(k) for k in np.argwhere(wrong)[0])
        named = "".join(f"[{k}]" for k in place)
        raise ValueError(f"{attribute.GetPath()}{named} = {numbers[place]}: must be "
                         f"{'a number' if infinite else 'finite'}")
    return out


def one_of(attribute, names):
    """The value of an attribute that is one of some names."""
    out = value(attribute)
    if out not in names:
        raise ValueError(f"{attribute.GetPath()} = {out!r}: must be one of {', '.join(map(repr, names))}")
    return out


def _unit(name, size):
    """Metres or kilograms of a unit of the stage."""
    if not 1e-12 <= size <= 1e12:
        raise ValueError(f"{name} = {size}: must be in [1e-12, 1e12]")
    return size


class Reader:
    """What the parts of the import share: the stage, its units, the prims of interest.

    Lengths are brought to m by `metre`, masses to kg by `kilogram`; poses in the stage's frame by `turn`, the pose of
    that frame in the world's, whose z is up.
    """

    def __init__(self, stage, report, threshold):
        from pxr import Usd, UsdGeom, UsdPhysics

        self.stage, self.report, self.threshold = stage, report, threshold
        self.reported = set()  # paths of what several prims share and is said once
        self.forms = {}  # shapes of meshes that are equal
        self.metre = _unit("metersPerUnit", UsdGeom.GetStageMetersPerUnit(stage))
        self.kilogram = _unit("kilogramsPerUnit", UsdPhysics.GetStageKilogramsPerUnit(stage))
        if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
            report.add("metersPerUnit", "is not given: 0.01, USD's default")
        up = UsdGeom.GetStageUpAxis(stage)
        if up not in ("Y", "Z"):
            raise ValueError(f"upAxis = {up!r}: must be 'Y' or 'Z'")
        self.turn = IDENTITY if up == "Z" else (np.zeros(3), q_about([1, 0, 0], np.pi / 2))
        self._transforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        walk = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())
        self.prims = [prim for prim in walk]
        scenes = [prim for prim in self.prims if prim.IsA(UsdPhysics.Scene)]
        self.scene = UsdPhysics.Scene(scenes[0]) if scenes else None
        for prim in scenes[1:]:
            report.add(self.element(prim), f"not carried over: a world has one scene, here {scenes[0].GetPath()}")
        self.bodies, self._foreign = {}, set()  # path: prim; paths of bodies of other scenes
        for prim in self.prims:
            api, path = UsdPhysics.RigidBodyAPI(prim), str(prim.GetPath())
            if prim.HasAPI(UsdPhysics.RigidBodyAPI) and value(api.GetRigidBodyEnabledAttr()):
                if self.is_owned(prim, api.GetSimulationOwnerRel()):
                    self.bodies[path] = prim
                else:
                    self._foreign.add(path)
        self.colliders = {}  # path: prim
        for prim in self.prims:
            api = UsdPhysics.CollisionAPI(prim)
            if prim.HasAPI(UsdPhysics.CollisionAPI) and value(api.GetCollisionEnabledAttr()):
                owner = self.body_of(prim)
                if owner in self._foreign or not (owner or self.is_owned(prim, api.GetSimulationOwnerRel())):
                    continue
                self.colliders[str(prim.GetPath())] = prim

    def is_owned(self, prim, owners):
        """Is it of this scene? One that is not is reported."""
        targets = owners.GetTargets()
        if not targets or (self.scene and targets[0] == self.scene.GetPath()):
            return True
        self.report.add(self.element(prim), f"not carried over: it is of the scene {targets[0]}")
        return False

    @staticmethod
    def element(prim):
        """As reports name it."""
        return f"{prim.GetTypeName() or 'prim'} {prim.GetPath()}"

    def body_of(self, prim):
        """Path of the rigid body that a prim is part of: the nearest one above, or itself; None: it is static."""
        from pxr import UsdGeom

        while prim and not prim.IsPseudoRoot():
            path = str(prim.GetPath())
            if path in self.bodies or path in self._foreign:
                return path
            if UsdGeom.Xformable(prim) and UsdGeom.Xformable(prim).GetResetXformStack():
                return None
            prim = prim.GetParent()
        return None

    def _matrix(self, prim):
        """From a prim's own frame to the stage's, 4 x 4, of row vectors."""
        from pxr import Tf

        try:
            m = np.array(self._transforms.GetLocalToWorldTransform(prim))
        except Tf.ErrorException:
            raise ValueError(f"{self.element(prim)}: its transform has values of the wrong type") from None
        if not np.isfinite(m).all() or np.abs(m).max() > LARGEST:
            raise ValueError(f"{self.element(prim)}: its transform must have finite numbers of at most {LARGEST:g}")
        return m

    def linear(self, prim):
        """The linear part of where a prim's own frame is in the stage's: 3 x 3, with its scale."""
        return self._matrix(prim)[:3, :3].T

    def place(self, prim):
        """The pose of a prim without its scale, in the stage's frame, m."""
        # Gf.Matrix4d.RemoveScaleShear, to the last digits: the rotation next to the matrix, of a mirror image's
        # negative
        m = self._matrix(prim)
        u, _, v = np.linalg.svd(m[:3, :3].T)
        return pose(m[3, :3] * self.metre, q_of_matrix(u @ v * np.sign(np.linalg.det(u @ v))))

    def point(self, prim, local):
        """A point of a prim's own frame (its units) in the stage's frame, m."""
        m = self._matrix(prim)
        return (m[:3, :3].T @ np.array(local, dtype=np.float64) + m[3, :3]) * self.metre

    def in_world(self, place):
        """A pose of the stage's frame, in the world's."""
        return mul(self.turn, place)

    def report_motion(self, prim):
        """A prim whose pose is animated."""
        from pxr import UsdGeom

        above = prim
        while above and not above.IsPseudoRoot():
            if UsdGeom.Xformable(above) and UsdGeom.Xformable(above).TransformMightBeTimeVarying():
                self.report.add(self.element(prim), "its animated pose is not carried over: it starts at the first one")
                return
            above = above.GetParent()


def gravity_of(reader):
    """m/s^2, in the world's frame."""
    if reader.scene is None:
        reader.report.add("PhysicsScene", "there is none: gravity is the Earth's")
        return [0.0, 0.0, -EARTH]
    attribute = reader.scene.GetGravityMagnitudeAttr()
    size = value(attribute, infinite=True)
    if not size * reader.metre <= 1e6:
        raise ValueError(f"{attribute.GetPath()} = {size}: must be less than 0, or at most {1e6 / reader.metre:g}")
    size = EARTH if size < 0 else size * reader.metre
    way = np.array(value(reader.scene.GetGravityDirectionAttr()), dtype=np.float64)
    length = np.linalg.norm(way)
    if length == 0:
        return [0.0, 0.0, -float(size)]
    return [float(x) for x in size * q_turn(reader.turn[1], way / length)]


@contextmanager
def naming(element):
    """What the world refuses in here is of this element, and its message says so."""
    from ... import Error

    try:
        yield
    except Error as error:
        error.args = (f"{element}: {error}",)
        raise


class Counts:
    """Things that a report counts rather than names each: how often, and one of them."""

    def __init__(self):
        self._count, self._first = Counter(), {}

    def add(self, what, prim):
        self._count[what] += 1
        self._first.setdefault(what, prim.GetPath())

    def __iter__(self):
        return ((what, count, self._first[what]) for what, count in self._count.items())
