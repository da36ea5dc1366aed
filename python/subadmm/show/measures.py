"""Figures of a world over time, for plots."""
import numpy as np

from ..rotations import rotate

#: name: (what it is, unit)
MEASURES = {
    "kinetic": ("kinetic energy", "J"),
    "contacts": ("contact points", ""),
    "penetration": ("deepest overlap", "m"),
    "ms": ("time of a step", "ms"),
    "error": ("natural map", "m/s"),
}


def kinetic_energy(state, inertia):
    """J, of the arrays body_state and body_inertia; static bodies have none."""
    linear = inertia[:, 0] * np.einsum("ij,ij->i", state[:, 7:10], state[:, 7:10])
    back = state[:, 3:7] * [1, -1, -1, -1]
    spin = rotate(back, state[:, 10:13])
    return 0.5 * float(np.sum(linear + np.einsum("ij,ij->i", inertia[:, 1:], spin * spin)))


def measure(world, state=None, inertia=None):
    """All of MEASURES, of the last step; error: NaN where settings do not ask for it."""
    report = world.report
    state = world.get("body_state") if state is None else state
    inertia = world.get("body_inertia") if inertia is None else inertia
    error = report.certificate.ncp_max
    return {
        "kinetic": kinetic_energy(state, inertia),
        "contacts": report.contacts,
        "penetration": report.penetration_max,
        "ms": report.ms["total"],
        "error": error if error >= 0 else float("nan"),
    }
