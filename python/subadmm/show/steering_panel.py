"""The part of the view's page that leads couplings and joints: gizmos, sliders, and what the user would feel."""
from collections import deque

import numpy as np

_KEPT = 400   # figures over time
_MOST = 400   # sliders of joints


def _label(joint, chain):
    """The joint's name without the words that all of its chain begin with."""
    short = joint.name.replace("_", " ")
    short = short[len(chain.name):].strip() if short.startswith(chain.name) else short
    return f"{short or joint.name}, {'°' if joint.is_angle else 'mm'}"


class SteeringPanel:
    """Nothing where the world has neither couplings nor driven joints."""

    def __init__(self, server, session, is_near):
        """is_near(point): is it near enough to what there is to see for something to be led there?"""
        self.server, self.session, self._is_near = server, session, is_near
        self._reaction = []          # of each coupling: where it is held, force, torque
        self._time = deque(maxlen=_KEPT)
        self._force = deque(maxlen=_KEPT)
        self._torque = deque(maxlen=_KEPT)
        steering = session.steering
        self.there = bool(steering.leads or steering.chains)
        if not self.there:
            return
        gui = server.gui
        with gui.add_folder("Steering"):
            self._on = gui.add_checkbox("steer", False, hint="lead by hand; a scene's own motion stops meanwhile")
            self._said = gui.add_markdown("")
            self._sliders = []   # (slider, what it shows now)
            for k, hand in enumerate(steering.hands):
                self._add_hand(k, hand)
            self._plots = []
            for part, unit, colour in (("force", "N", "#1e5ac8"),
                                       ("torque", "N m", "#c87a1e")) if steering.leads else ():
                self._plots.append(gui.add_uplot(
                    (np.zeros(1),) * 2, ({"label": "s"}, {"label": unit, "stroke": colour, "width": 2}),
                    title=f"reaction {part}, {unit}", height=140, scales={"x": {"time": False}, "y": {"auto": True}},
                    axes=({"label": "time, s", "labelSize": 16, "size": 30, "space": 50}, {"size": 52, "space": 28}),
                    legend={"show": False}))
            if 0 < sum(len(chain.joints) for chain in steering.chains) <= _MOST:
                with gui.add_folder("joints", expand_by_default=False):
                    for chain in steering.chains:
                        with gui.add_folder(chain.name, expand_by_default=False):
                            for joint in chain.joints:
                                self._add_joint(joint, chain)
        self._on.on_update(lambda _: self._switch())

    # ---- sliders -----------------------------------------------------------------------------------------------------

    def _add_slider(self, label, lower, upper, step, shown, set_value):
        """shown(): its value now; set_value(value): called when a user moves it."""
        slider = self.server.gui.add_slider(label, lower, upper, step, float(np.clip(shown(), lower, upper)))
        self._sliders.append((slider, shown))

        @slider.on_update
        def _(event):
            if event.client_id is not None:    # not when it is set from here
                value = slider.value
                with self.session.lock:
                    if not self.session.steering.on:
                        self._on.value = True
                        self._switch()     # which shows where everything is
                    set_value(value)
                    self._show_values()

    def _add_joint(self, joint, chain):
        unit = 180 / np.pi if joint.is_angle else 1000.0

        def set_value(value):
            self.session.steering.set_joint(joint, value / unit)

        def shown():
            return self.session.steering.goals[joint.row, joint.coordinate] * unit

        wide = (joint.upper - joint.lower) * unit
        self._add_slider(_label(joint, chain), joint.lower * unit, joint.upper * unit, max(wide / 500, 1e-6), shown,
                         set_value)

    def _add_hand(self, k, hand):
        """The grip of the k-th hand, and of each of its fingers."""
        apart = hand.apart * 1000

        def steer(**what):
            steering = self.session.steering
            steering.close(steering.hands[k], **what)

        def now():
            return self.session.steering.hands[k]

        self._add_slider("grip, mm apart", 0.0, 1.3 * apart, apart / 500, lambda: (now().apart + now().opening) * 1000,
                         lambda value: steer(opening=value / 1000 - now().apart))
        with self.server.gui.add_folder("each finger, mm inwards", expand_by_default=False):
            for finger, of in enumerate(hand.fingers):
                self._add_slider(of.chain.name, -apart / 3, apart / 3, apart / 500,
                                 lambda finger=finger: now().more[finger] * 1000,
                                 lambda value, finger=finger: steer(finger=finger, more=value / 1000))

    def _show_values(self):
        for slider, shown in self._sliders:
            slider.value = float(np.clip(shown(), slider.min, slider.max))

    # ---- on and off --------------------------------------------------------------------------------------------------

    def _switch(self):
        with self.session.lock:
            steering = self.session.steering
            if self._on.value and not steering.on:
                steering.start()
            elif not self._on.value and steering.on:
                steering.stop()
            self._show_values()
            for gizmo, lead in zip(self._gizmos, steering.leads):
                gizmo.position, gizmo.wxyz = tuple(lead.position), tuple(lead.orientation)
                gizmo.visible = steering.on

    def begin_again(self):
        """The session has a new world."""
        if self.there:
            for kept in (self._time, self._force, self._torque):
                kept.clear()
            for plot in self._plots:
                plot.data = (np.zeros(1),) * 2
            self._switch()

    # ---- the scene ---------------------------------------------------------------------------------------------------

    def build_scene(self, radius):
        """radius: of what there is to see, m."""
        self._gizmos, self._length = [], 0.15 * radius
        if not self.there:
            return
        scene = self.server.scene
        for k, lead in enumerate(self.session.steering.leads):
            gizmo = scene.add_transform_controls(f"/steering/{k}", scale=0.15 * radius, depth_test=False, visible=False,
                                                 position=tuple(lead.at), wxyz=tuple(lead.turn))

            # A coroutine: poses come in order. Assigning is all there is to do; a step takes the newest.
            @gizmo.on_update
            async def _(event, k=k):
                position, orientation = np.array(event.target.position), np.array(event.target.wxyz)
                if self._is_near(position):
                    self.session.steering.leads[k].go(position, orientation)

            self._gizmos.append(gizmo)
        thin = 0.006 * radius
        self._arrows = [scene.add_arrows(f"/reaction/{name}", np.zeros((0, 2, 3), np.float32), colour,
                                         shaft_radius=thin,
                                         head_radius=2.5 * thin, head_length=6 * thin)
                        for name, colour in (("force", (30, 90, 200)), ("torque", (200, 122, 30)))]

    def read(self):
        """The current reaction. With the session locked."""
        session = self.session
        self._reaction = [(lead.grip(), *lead.reaction()) for lead in session.steering.leads]
        if self._reaction and session.running:
            self._time.append(session.steps * session.world.settings.dt)
            self._force.append(max(np.linalg.norm(force) for _, force, _ in self._reaction))
            self._torque.append(max(np.linalg.norm(torque) for _, _, torque in self._reaction))

    def draw(self):
        """Arrows along the reaction, of length `_length` at the largest of the last time."""
        if not self._reaction:
            return
        for part, handle, kept in ((1, self._arrows[0], self._force), (2, self._arrows[1], self._torque)):
            scale = self._length / max(max(kept, default=0), 1e-9)
            if self._on.value:
                handle.points = np.array([[one[0], one[0] + scale * one[part]] for one in self._reaction], np.float32)
            elif len(handle.points):
                handle.points = np.zeros((0, 2, 3), np.float32)

    def say(self):
        """The figures and the plot."""
        if not self._reaction:
            return
        lines = []
        for lead, (_, force, torque) in zip(self.session.steering.leads, self._reaction):
            x, y, z = force
            lines.append(f"{lead.name} feels {np.linalg.norm(force):.2f} N ({x:.1f}, {y:.1f}, {z:.1f}), "
                         f"{np.linalg.norm(torque):.3f} N m")
        self._said.content = "\n\n".join(lines)
        if len(self._time) > 1:
            for plot, values in zip(self._plots, (self._force, self._torque)):
                plot.data = (np.array(self._time), np.array(values))
