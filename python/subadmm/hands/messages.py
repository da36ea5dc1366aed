"""What the page of hands may say: joints and controllers of a user, a reset, run or pause. All else is dropped, as if
it had not come."""
import json
import math

import numpy as np

from ..rotations import multiply, rotate, unit
from ..show.guard import is_number
from .grasp import WIDEST, grasping
from .joints import SIDES

#: Bytes of a message, at most.
MOST_BYTES = 1 << 14
_FARTHEST = 100.0         # m, of a joint from where the user's space begins
_CLOSED = -0.02           # m: how far a trigger that is pulled has thumb and fingers apart
#: m: from where a controller is held, in the hand's frame, to the middle between the tips.
_AHEAD = np.array([0.013, 0.0, -0.025])
# Of WebXR's grip space: the back of the hand is on the side of x (right) or -x (left), the arm on that of y. To the
# hand's frame.
_GRIPS = {"right": unit(np.array([1.0, -1, 1, -1])), "left": unit(np.array([1.0, 1, -1, -1]))}


def _numbers(count):
    return lambda x: isinstance(x, list) and len(x) == count and all(is_number(n, -_FARTHEST, _FARTHEST) for n in x)


def _is_turn(q):
    return _numbers(4)(q) and 0.5 <= math.hypot(*q) <= 2


_POSITION = _numbers(3)


def _is_side(x):
    """What the page says of one side: nothing is tracked there, joints, or a controller."""
    if x is None:
        return True
    if not isinstance(x, dict):
        return False
    if x.keys() == {"joints"}:
        return _numbers(75)(x["joints"])
    return (x.keys() == {"position", "orientation", "closed"} and _POSITION(x["position"]) and
            _is_turn(x["orientation"]) and is_number(x["closed"], 0, 1))


#: Of each type of message, its other members.
_MEMBERS = {
    "hands": {side: _is_side for side in SIDES},
    "reset": {},
    "run": {"on": lambda x: isinstance(x, bool)},
}


def _no_number(text):
    raise ValueError(text)


def read(data):
    """The message, a dict, of what came over the socket; None: it is none that the page sends."""
    if not isinstance(data, str) or len(data) > MOST_BYTES:
        return None
    try:
        message = json.loads(data, parse_constant=_no_number)
    except (ValueError, RecursionError):
        return None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        return None
    members = _MEMBERS.get(message["type"])
    if members is None or message.keys() != {"type", *members}:
        return None
    return message if all(fits(message[name]) for name, fits in members.items()) else None


def held(side, position, orientation, closed):
    """21 x 3 joints, m, of a hand that holds a controller: WebXR's grip space, and how far its trigger is pulled, in
    [0, 1]."""
    turn = multiply(unit(np.array(orientation, dtype=float)), _GRIPS[side])
    place = np.array(position, dtype=float) + rotate(turn, _AHEAD)
    return grasping(side, place, turn, (1 - closed) * WIDEST + closed * _CLOSED)


def joints_of(side, said):
    """21 or 25 joints, m, in the user's space, of what the page says of a side; None: of nothing."""
    if said is None:
        return None
    if "joints" in said:
        return np.array(said["joints"], dtype=float).reshape(25, 3)
    return held(side, **said)
