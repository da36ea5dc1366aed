"""The part of the view's page that has a slider for each actuator of a loaded model."""
import numpy as np

_MOST = 200   # sliders


def _range(actuator):
    """(lower, upper, factor, unit) of its slider: of its control, or, where that has no ends, of its joint's."""
    lower, upper = actuator.control_range
    joint, _ = actuator.parts[0]
    turns = joint.type == "hinge"
    position = actuator.kind == "position" and len(actuator.parts) == 1
    factor, unit = (180 / np.pi, "°") if position and turns else (1000.0, "mm") if position else (1.0, "")
    if not np.isfinite([lower, upper]).all():
        law = joint.joint.coordinate(joint.coordinate)
        wide = np.pi if turns else 0.5
        ends = [joint.sign * end + joint.offset for end in (law.lower, law.upper)] if law.limited else [-wide, wide]
        ends = np.clip(sorted(ends), -wide, wide) if position else np.array([-1.0, 1.0])
        lower = lower if np.isfinite(lower) else ends[0]
        upper = upper if np.isfinite(upper) else ends[1]
    return float(min(lower, actuator.control)), float(max(upper, actuator.control)), factor, unit


class ActuatorPanel:
    """Nothing where the session's model has no actuators."""

    def __init__(self, server, session):
        self.session, self._sliders = session, {}
        if not session.actuators:
            return
        with server.gui.add_folder("Actuators"):
            for name in list(session.actuators)[:_MOST]:
                self._add(server.gui, name)

    def _add(self, gui, name):
        actuator = self.session.actuators[name]
        lower, upper, factor, unit = _range(actuator)
        if not upper > lower:
            return
        low, high = lower * factor, upper * factor
        label = name if not name.startswith("#") else f"{actuator.parts[0][0].name} ({name})"
        slider = gui.add_slider(f"{label}, {unit}" if unit else label, low, high, max((high - low) / 500, 1e-9),
                                actuator.control * factor, hint=f"control of a {actuator.kind} actuator")
        self._sliders[name] = slider, factor

        @slider.on_update
        def _(event):
            if event.client_id is not None:      # not when it is set from here
                with self.session.lock:
                    self.session.actuators[name].control = slider.value / factor

    def begin_again(self):
        """The session has a new world."""
        for name, (slider, factor) in self._sliders.items():
            slider.value = float(np.clip(self.session.actuators[name].control * factor, slider.min, slider.max))
