"""Mass, centre of mass and inertia of a rigid body, by UsdPhysics' rules: what the body says goes before what its
colliders add up to; of a collider its mass before its density, then the body's density, the material's, and water's."""

import numpy as np

from ..poses import IDENTITY, inverse, mul, pose, q_matrix, q_mul, q_of_matrix, q_turn
from .materials import density_of
from .stage import naming, quat, value

WATER = 1000.0  # kg/m^3
MASS, RADIUS = 1.0, 0.1  # kg, m: the ball that stands in where nothing is known


class Weight:
    """Mass (kg), centre (m) and inertia tensor about it (kg m^2), in the frame of the prim of the body."""

    def __init__(self, mass, centre, inertia):
        self.mass, self.centre, self.inertia = mass, centre, inertia


def _offset(arm):
    """Of a point of unit mass at `arm`."""
    return arm @ arm * np.eye(3) - np.outer(arm, arm)


def _given(reader, prim):
    """What a prim's MassAPI says: mass, density (0: nothing), centre (m, in the prim's frame without its scale),
    inertia (None: nothing), turn of its axes."""
    from pxr import UsdPhysics

    if not prim.HasAPI(UsdPhysics.MassAPI):
        return 0.0, 0.0, None, None, IDENTITY[1]
    api = UsdPhysics.MassAPI(prim)
    centre = np.array(value(api.GetCenterOfMassAttr(), infinite=True), dtype=np.float64)
    place = reader.place(prim)
    if not np.all(np.isneginf(centre)):  # which says that there is none
        value(api.GetCenterOfMassAttr())
        centre = q_matrix(place[1]).T @ (reader.point(prim, centre) - place[0])
    else:
        centre = None
    inertia = np.array(value(api.GetDiagonalInertiaAttr()), dtype=np.float64) * reader.kilogram * reader.metre**2
    axes = value(api.GetPrincipalAxesAttr())
    if np.any(inertia):
        if np.any(inertia <= 0):
            reader.report.add(reader.element(prim), f"diagonalInertia {inertia} is not positive, and not carried over")
            inertia = None
    else:
        if any(axes.GetImaginary()):
            reader.report.add(reader.element(prim), "principalAxes without diagonalInertia are not carried over")
        inertia = None
    mass, density = (max(0.0, float(value(a))) for a in (api.GetMassAttr(), api.GetDensityAttr()))
    return mass * reader.kilogram, density * reader.kilogram / reader.metre**3, centre, inertia, quat(axes)


def _tensor(moments, turn):
    turn = q_matrix(turn)
    return turn @ np.diag(moments) @ turn.T


def _collider(reader, prim, body, shapes, body_density):
    """The Weight of one, in the frame of the prim `body`."""
    from ... import mass_of

    mass, density, centre, inertia, axes = _given(reader, prim) if prim != body else (0.0, 0.0, None, None, IDENTITY[1])
    with naming(reader.element(prim)):
        whole = mass_of(shapes, density or body_density or density_of(reader, prim) or WATER)
    out = Weight(whole.mass, np.array(whole.centre), _tensor(whole.inertia, whole.orientation))
    if mass > 0:
        out.inertia *= mass / out.mass
        out.mass = mass
    local = mul(inverse(reader.place(body)), reader.place(prim))
    if centre is not None:
        centre = local[0] + q_turn(local[1], centre)
        if inertia is None:
            out.inertia = out.inertia + out.mass * _offset(centre - out.centre)
        out.centre = centre
    if inertia is not None:
        out.inertia = _tensor(inertia, q_mul(local[1], axes))
    return out


def _sum(parts):
    mass = sum(part.mass for part in parts)
    centre = sum(part.mass * part.centre for part in parts) / mass
    return Weight(mass, centre, sum(part.inertia + part.mass * _offset(part.centre - centre) for part in parts))


def weight_of(reader, body, colliders):
    """(mass, principal moments, pose of the principal frame in the prim's) of a body. colliders: [(prim, its
    shapes)]."""
    mass, density, centre, inertia, axes = _given(reader, body)
    parts = [_collider(reader, prim, body, shapes, density) for prim, shapes in colliders if shapes]
    if parts:
        whole = _sum(parts)
        if mass > 0:
            whole.inertia = whole.inertia * (mass / whole.mass)
            whole.mass = mass
    else:
        missing = [name for name, there in (("mass", mass > 0), ("inertia", inertia is not None)) if not there]
        whole = Weight(mass or MASS, np.zeros(3), np.eye(3) * 0.4 * (mass or MASS) * RADIUS**2)
        if missing:
            reader.report.add(
                reader.element(body),
                f"has no collider and no {' and no '.join(missing)}: it is a ball of {whole.mass:g} kg and {RADIUS} m",
            )
    if centre is not None:
        if inertia is None and parts:
            whole.inertia = whole.inertia + whole.mass * _offset(centre - whole.centre)
        whole.centre = centre
    if inertia is not None:
        return whole.mass, inertia, pose(whole.centre, axes)
    moments, turn = principal(whole.inertia)
    return whole.mass, moments, pose(whole.centre, turn)


def principal(tensor):
    """Principal moments and axes; the axes of the frame where they are principal."""
    if np.abs(tensor - np.diag(np.diag(tensor))).max() <= 1e-12 * np.abs(tensor).max():
        return np.diag(tensor).copy(), IDENTITY[1]
    moments, axes = np.linalg.eigh(tensor)
    if np.linalg.det(axes) < 0:
        axes[:, 2] = -axes[:, 2]
    return np.maximum(moments, 0), q_of_matrix(axes)
