"""A page by which a user puts hands into a running world: WebXR, beside the view."""
from __future__ import annotations

import html
import json
import struct
import threading
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np

from .. import Error
from ..given import point, real, whole
from ..show.camera import looking_at
from ..show.description import describe, world_of
from ..show.guard import free_port
from ..show.page import Blob, drawing_of, filled
from ..show.session import Session
from ..rotations import of_vector, rotate
from .grasp import grasping
from .hand import Hand
from .joints import PARTS, SIDES, XR_JOINTS
from .messages import joints_of
from .server import Client, Server, context_of

_FRAME = 1 / 60          # s between frames
_MESHES, _POSES = 0, 1   # of binary messages: the first four bytes
_LOST = 0.5              # s: a hand that comes back after so long is put to where it is
_JUMP = 0.15             # m: and one that has been seen so far from where it was
_ASIDE = 0.25            # m: hands wait so far to the left and right, before they are tracked ...
_WAITING = 1.3           # ... and so high above the user's floor
_FULL = 5.0              # N: controllers pulse as hard as they can from there on; of a hand of the usual size
_EYES = 1.4              # m: over the floor; where a browser has no floor


class Place:
    """Where the user's space is in the world: `stand`, m, is where its floor has its middle; the user looks to x,
    turned by `yaw` (rad) about z; a metre of the user's is `scale` metres."""

    def __init__(self, stand, yaw=0.0, scale=1.0):
        self.stand, self.scale = point("stand", stand), real("scale", scale, 1e-3, 1e3)
        self.turn = of_vector([0.0, 0.0, real("yaw", yaw, -1e3, 1e3)])

    def __call__(self, joints):
        """Joints (n x 3, m) of WebXR, whose y is up and whose -z is ahead, in the world."""
        return self.stand + self.scale * rotate(self.turn, np.asarray(joints)[:, [2, 0, 1]] * [-1, -1, 1])

    def matrix(self):
        """4 x 4, from the user's space to the world."""
        out = np.eye(4)
        out[:3, :3] = (self(np.eye(3)) - self.stand).T
        out[:3, 3] = self.stand
        return out


def usual_stand(description):
    """Where a user stands who has what moves in front of the chest: on the floor of the world, or lower."""
    away = float(np.clip(description.radius + 0.2, 0.45, 3.0))
    centre = description.centre
    return np.array([centre[0] - away, centre[1], min(description.floor, centre[2] - 1.0)])


class _Felt:
    """A hand around the steps of a session: the largest forces since they were taken, and what was touched."""

    def __init__(self, hand):
        self.hand, self.before_step = hand, hand.before_step
        self.largest, self.touches = np.zeros(len(PARTS)), []
        self.seen = None         # when the clock it was tracked last

    def after_step(self):
        self.touches += self.hand.after_step()
        self.largest = np.maximum(self.largest, np.linalg.norm(self.hand.forces, axis=1))

    def take(self):
        taken = self.largest, self.touches
        self.largest, self.touches = np.zeros(len(PARTS)), []
        return taken


class HandPage:
    """A server with the page of a world that a user's hands are in. frame() brings it up to date; url: where it is.

    build(): a new World, or what load() returned. The page sends both hands' 25 joints, or controllers, and is told
    what fingers feel. stand, yaw, scale: Place; stand None: usual_stand(). certificate, key: PEM files; browsers have
    WebXR on localhost, and elsewhere by them only. options: of Hand; its size is `scale` if none is given, and
    on_touch is called from frame(). Raises TypeError, ValueError (an argument that is none), OSError where it cannot
    be served, ImportError without the package websockets."""

    def __init__(self, build: Callable[[], Any], title: str = "", host: str = "127.0.0.1", port: int = 8081, *,
                 certificate: Any = None, key: Any = None, stand: Any = None, yaw: float = 0.0, scale: float = 1.0,
                 **options: Any):
        context = context_of(certificate, key)
        free_port(host, whole("port", port, 0, 65535))     # before a world is built
        self.title = title or "subadmm"
        self._build, self._given, self._options = build, (stand, yaw, scale), options
        self._said: Any = None
        self._speaker: Client | None = None
        self._hearing = threading.Lock()
        self._asked: list[str] = []
        self._wrong = ""         # why it has stopped
        self.session = Session(self._with_hands)
        self._begin()
        self._last = time.perf_counter()
        page = filled(Path(__file__).parent / "page.html", {"title": html.escape(self.title)})
        self._server = Server(page, host, port, context, self._hear, self._greet, self._gone)
        self.port = self._server.port
        self.url = f"http{'s' if context else ''}://{f'[{host}]' if ':' in host else host}:{self.port}"

    def stop(self) -> None:
        """End the server."""
        self._server.stop()

    @property
    def hands(self) -> dict[str, Hand]:
        """The hands in the world, by 'left' and 'right'; others after a reset."""
        return {side: felt.hand for side, felt in self._felt.items()}

    # ---- the world ---------------------------------------------------------------------------------------------------

    def _with_hands(self):
        source = self._build()
        world, _ = world_of(source)
        stand, yaw, scale = self._given
        self.place = Place(usual_stand(describe(source)) if stand is None else stand, yaw, scale)
        self._felt = {}
        for side, across in zip(SIDES, (-_ASIDE, _ASIDE)):
            waiting = grasping(side, (0, -across, _WAITING))      # as a user of the world's axes has them
            joints = self.place(waiting[:, [1, 2, 0]] * [-1, 1, -1])
            self._felt[side] = _Felt(Hand(world, side, joints, **{"size": self.place.scale, **self._options}))
        return source

    def _begin(self):
        """After a reset. With the session locked, but for the first time."""
        self.session.around_steps = list(self._felt.values())
        description = self.session.describe()
        blob = Blob()
        header = {
            **drawing_of(description, looking_at(description), blob.put), "type": "scene", "title": self.title,
            "count": description.count, "toWorld": self.place.matrix().T.ravel().tolist(), "eyes": _EYES,
            "full": _FULL * self.place.scale ** 4,
            "joints": XR_JOINTS, "parts": PARTS,
        }
        self._description = description
        self._scene = [json.dumps(header), struct.pack("<I", _MESHES) + bytes(blob.data)]

    # ---- what the page says ------------------------------------------------------------------------------------------

    def _greet(self, client: Client):
        with self.session.lock:
            client.tell_scene(self._scene)

    def _gone(self, client: Client):
        with self._hearing:
            if self._speaker is client:
                self._speaker, self._said = None, None

    def _hear(self, client: Client, message):
        with self._hearing:
            if message["type"] == "hands":
                if self._speaker is None:        # the first one has the hands; others look on
                    self._speaker = client
                if self._speaker is client:
                    self._said = message
            elif message["type"] == "reset":
                self._asked = ["reset"]
            else:
                self._asked.append("run" if message["on"] else "pause")
                del self._asked[:-10]

    def _lead(self, now):
        """Hands go to where the page has them."""
        with self._hearing:
            said, self._said = self._said, None
            asked, self._asked = self._asked, []
        for what in asked:
            if what == "reset":
                self._wrong = ""
                self.session.reset()
                self._begin()
                for client in self._server.everybody():
                    client.tell_scene(self._scene)
            else:
                self.session.running, self._wrong = what == "run", ""
        for side, felt in self._felt.items() if said is not None else ():
            joints = joints_of(side, said[side])
            if joints is None:
                continue
            joints = self.place(joints)
            try:
                if felt.seen is None or (now - felt.seen > _LOST and felt.hand.is_far(joints, _JUMP)):
                    felt.hand.place(joints)
                else:
                    felt.hand.go(joints)
                felt.seen = now
            except ValueError:      # joints without a direction
                pass

    # ---- frames ------------------------------------------------------------------------------------------------------

    def frame(self) -> None:
        """Run as far as the clock asks for, and tell the pages. A step that cannot be made pauses it; the page says why
        and offers a reset."""
        now = time.perf_counter()
        session = self.session
        with session.lock:
            self._lead(now)
            try:
                session.advance(min(now - self._last, 0.1), 0.8 * _FRAME)
            except Error as error:
                session.running, self._wrong = False, str(error)
            self._last = now
            places, turns = self._description.poses(session.state())
            texels = np.zeros((len(places), 8), "<f4")
            texels[:, :3], texels[:, 4:] = places, turns
            taken = {side: felt.take() for side, felt in self._felt.items()}
        poses = struct.pack("<I", _POSES) + texels.tobytes()
        event = {"type": "forces", "running": session.running, "time": session.steps * session.dt,
                 "wrong": self._wrong,
                 **{side: [round(float(x), 4) for x in largest] for side, (largest, _) in taken.items()},
                 "touches": [[side, touch.part, touch.begun, round(float(np.linalg.norm(touch.force)), 4)]
                             for side, (_, touches) in taken.items() for touch in touches]}
        text = json.dumps(event)
        for client in self._server.everybody():
            client.tell(poses, text)


def serve(build: Callable[[], Any], title: str = "", host: str = "127.0.0.1", port: int = 8081, **options: Any) -> None:
    """Serve a HandPage until it is interrupted; its arguments."""
    page = HandPage(build, title, host, port, **options)
    print(f"{page.title}: {page.url}", flush=True)
    try:
        while True:
            begun = time.perf_counter()
            page.frame()
            time.sleep(max(_FRAME - (time.perf_counter() - begun), 0))
    finally:
        page.stop()
