"""The part of the view's page that looks back over the last minute, and that records."""
import importlib.util

import numpy as np

from .packing import TURN_STEP
from .recording import Recording, position_step
from .session import MINUTE

_MOST = 18000   # frames of a recording: ten minutes


def recording_of(description, title, times, states):
    """A Recording of states that were kept: arrays body_state, one a time (s)."""
    step = position_step(description)
    poses = [description.poses(np.asarray(state, float)) for state in states]
    places = np.rint(np.array([places for places, _ in poses]) / step).astype(np.int32)
    turns = np.array([turns for _, turns in poses])
    same = np.einsum("fij,fij->fi", turns[1:], turns[:-1])       # q and -q are the same orientation
    turns[1:] *= np.where(np.cumprod(np.where(same < 0, -1, 1), axis=0) < 0, -1, 1)[..., None]
    return Recording(description, title, step, np.array(times) - times[0], places,
                     np.rint(turns / TURN_STEP).astype(np.int16))


class TimePanel:
    """A time line, and a button that records. say(text): tells the user."""

    def __init__(self, server, session, title, describe, say):
        self.server, self.session, self.title, self.say = server, session, title, say
        self._describe = describe
        self._times, self._states = None, []
        gui = server.gui
        self.line = gui.add_slider("time line, s", -MINUTE, 0.0, 1 / 30, 0.0,
                                   hint="look back over the last minute; Run goes on from now")
        kinds = ["html", "glb"] + [kind for kind, module in (("mp4", "imageio_ffmpeg"), ("usda", "pxr"))
                                   if importlib.util.find_spec(module)]
        with gui.add_folder("Record", expand_by_default=True):
            self.button = gui.add_button("Record", color="red", icon=server_icon("PLAYER_RECORD"),
                                         hint="from now on, until it is pressed again")
            self.kind = gui.add_dropdown("file", tuple(kinds), initial_value="html")

        @self.line.on_update
        def _(event):
            if event.client_id is not None and self.line.value < 0:
                session.running = False

        @self.button.on_click
        def _(event):
            self._switch(event.client)

    # ---- back in time ------------------------------------------------------------------------------------------------

    @property
    def back(self):
        """How long ago what is shown is, s: 0 or less."""
        return 0.0 if self.session.running else float(self.line.value)

    def now(self):
        """Show what is now."""
        self.line.value = 0.0

    # ---- recordings --------------------------------------------------------------------------------------------------

    @property
    def recording(self):
        """Does it record?"""
        return self._times is not None

    def read(self):
        """Keep what is new. With the session locked."""
        tape = self.session.tape
        if self._times is None:
            return
        if self._times and tape.times[-1] < self._times[-1]:     # it has begun again
            self._times, self._states = [], []
        after = self._times[-1] if self._times else self._from
        for time_then, state in zip(tape.times, tape.states):
            if time_then > after or (not self._times and time_then >= after):
                self._times.append(time_then)
                self._states.append(state)
        del self._times[_MOST:], self._states[_MOST:]

    def _switch(self, client):
        session = self.session
        with session.lock:
            if not self.recording:
                self._times, self._states, self._from = [], [], session.tape.times[-1]
                self.button.label = "Stop and save"
                return
            self.read()
            times, states = self._times, self._states
            self._times, self._states = None, []
        self.button.label = "Record"
        try:
            if len(times) < 2:
                raise ValueError("nothing was recorded: the scene stood still")
            ending = self.kind.value
            data = recording_of(self._describe(), self.title, times, states).data(f"a.{ending}")
            data = data.encode() if isinstance(data, str) else data
            (client or self.server).send_file_download(f"recording.{ending}", data)
            self.say("")
        except (ValueError, ImportError, OSError) as error:
            self.say(str(error))


def server_icon(name):
    """Of viser's icons."""
    import viser

    return getattr(viser.Icon, name, None)
