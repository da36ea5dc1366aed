"""A page with a running world, by viser: meshes, controls, plots, contact forces, and a hand that pulls bodies."""
import threading
import time

import numpy as np

from .. import Error
from .._core import _names
from ..given import whole
from . import guard
from .actuator_panel import ActuatorPanel
from .camera import looking_at
from .forces import Forces, colours_of, forces_of, legend
from .look_panel import LookPanel
from .measures import MEASURES
from .picture import SUN
from .session import MINUTE, Session
from .steering_panel import SteeringPanel
from .time_panel import TimePanel

_FRAME = 1 / 30          # s between frames
_PLOT = 0.5              # s between plots
_REACH = 100             # radii of what there is to see: bodies are not pulled to places farther away
_BY_POWER = ("kinetic", "error")   # drawn as powers of ten: they go over many
_POINTS = 600            # of a curve
_CERTIFIED = 500         # bodies
_ARROWS = 2000           # contacts drawn at most: those with the largest forces
_NO_FORCES = Forces(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
_TWICE = 0.15            # s: a key and the button that has the focus, at once, are one press
_BRAND = (22, 118, 128)  # of buttons and sliders
_SKY, _HORIZON = np.array([176, 203, 232]), np.array([233, 239, 246])


def _viser():
    try:
        import viser
    except ImportError as error:
        raise ImportError("the view needs viser: pip install 'viser<2'") from error
    return viser


class View:
    """A server with the page of a session. frame() brings it up to date; url: where it is."""

    def __init__(self, session, title="", host="127.0.0.1", port=8080):
        self._viser = viser = _viser()
        self.session = session
        self.server = server = guard.serve(viser, host, port)
        self.url = f"http://{f'[{host}]' if ':' in host else host}:{server.get_port()}"
        self.title = title or "subadmm"
        server.gui.set_panel_label(self.title)
        server.gui.configure_theme(brand_color=_BRAND, show_logo=False, show_share_button=False)
        server.scene.set_up_direction("+z")
        self._wrong = ""         # what is said until the user does something
        self._plotted, self._pressed = 0.0, (0.0, "")
        self._pressing = threading.Lock()
        self._build_controls()
        self._build_scene()
        guard.tell_refused(server, self._refuse)
        self._last = time.perf_counter()

    def stop(self):
        """End the server."""
        self.server.stop()

    # ---- the panel ---------------------------------------------------------------------------------------------------

    def _build_controls(self):
        gui, session = self.server.gui, self.session
        # The error costs about as much as a step of a few iterations: small worlds have it from the beginning.
        if session.environments is None and session.world.body_count <= _CERTIFIED:
            session.change(certify=True)
        settings = session.settings
        icons = self._viser.Icon
        self._run = gui.add_button("Pause", icon=icons.PLAYER_PAUSE, hint="space")
        step = gui.add_button("Step", icon=icons.PLAYER_TRACK_NEXT, color="gray", hint="right arrow")
        reset = gui.add_button("Reset", icon=icons.REFRESH, color="gray", hint="r")
        self._said = gui.add_markdown("")
        speed = gui.add_slider("speed", 0.05, 2.0, 0.05, 1.0)
        self._time = TimePanel(self.server, session, self.title, self._describe, self._complain)
        self._layers = {}
        self._look = LookPanel(self.server, session, self._layer_names())
        self._actuators = ActuatorPanel(self.server, session)
        self._steering = SteeringPanel(self.server, session, self._is_near)
        with gui.add_folder("Solver", expand_by_default=False):
            self._method = gui.add_dropdown("method", _names["method"], initial_value=settings.method)
            self._iterations = gui.add_number("iterations", settings.iterations, min=1, max=1000000, step=1)
            here = session.world.report.backend
            names = tuple(backend["name"] for backend in _backends() if backend["f64"])
            self._backend = gui.add_dropdown("backend", ("as begun",) + names)
            self._certify = gui.add_checkbox("measure the error", settings.certify)
        self._contacts = gui.add_checkbox("contact forces", False)
        self._legend = gui.add_html(f'<div style="padding:0 1em">{legend()}</div>', visible=False)
        self._plots = {}
        with gui.add_folder("Plots", expand_by_default=True):
            for name in ("kinetic", "ms", "error"):
                what, unit = MEASURES[name]
                what = f"log10 of {what}" if name in _BY_POWER else what
                self._plots[name] = gui.add_uplot(
                    _NO_CURVE,
                    ({"label": "s"}, {"label": unit, "stroke": "#0f766e", "width": 2}),
                    title=f"{what}, {unit}",
                    scales={"x": {"time": False}, "y": {"auto": True}},
                    axes=({"label": "time, s", "labelSize": 16, "size": 30, "space": 50}, {"size": 52, "space": 28}),
                    legend={"show": False},
                    height=150,
                )

        self._run.on_click(lambda _: self._once("button", self._toggle))
        step.on_click(lambda _: self._once("button", self._step))
        reset.on_click(lambda _: self._once("button", self._reset))
        for label, key, act in (("Run or pause", "space", self._toggle), ("One step", "arrowright", self._step),
                                ("Reset", "R", self._reset)):
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(lambda _, act=act: self._once("key", act))

        @self._contacts.on_update
        def _(_):
            for _, handle in self._moving:     # forces are seen through bodies
                if hasattr(handle, "opacity"):
                    handle.opacity = 0.35 if self._contacts.value else None

        @speed.on_update
        def _(_):
            session.speed = speed.value

        settle = self._settle
        self._method.on_update(lambda _: settle(method=self._method.value))
        self._iterations.on_update(lambda _: settle(iterations=int(self._iterations.value)))
        self._certify.on_update(lambda _: settle(certify=self._certify.value))
        self._backend.on_update(
            lambda _: settle(backend=here if self._backend.value == "as begun" else self._backend.value))

    def _once(self, source, act):
        """What a button or a key does. A key that also presses the button with the focus does it once."""
        with self._pressing:
            now, (then, other) = time.monotonic(), self._pressed
            if source != other and now - then < _TWICE:
                return
            self._pressed = now, source
        act()

    def _complain(self, text):
        self._wrong = text
        if text:
            self._said.content = f"**{text}**"

    def _refuse(self, label, why):
        """A value of a control that was not taken."""
        self._complain(f"{label}: {why}")

    def _toggle(self):
        self._wrong = ""
        with self.session.lock:
            self.session.running = not self.session.running
            if self.session.running:
                self._time.now()
        self._show_state()

    def _step(self):
        self._wrong = ""
        session = self.session
        with session.lock:
            session.running = False
            self._time.now()
            try:
                session.step()
            except Error as error:
                self._wrong = str(error)
        self._show_state()

    def _reset(self):
        session = self.session
        with session.lock:
            session.reset()
            self._wrong = ""
            changes = {"method": self._method.value, "iterations": int(self._iterations.value),
                       "certify": self._certify.value}
            backend = self._backend.value
            self._settle(**changes, **({} if backend == "as begun" else {"backend": backend}))
            self._steering.begin_again()
            self._actuators.begin_again()
            self._time.now()
            self._plotted = 0.0
            for handle in self._plots.values():
                handle.data = _NO_CURVE

    def _settle(self, **changes):
        self._wrong = ""
        try:
            self.session.change(**changes)
        except Exception as error:              # a refused setting: say so, and go on with the old one
            self._complain(str(error))

    def _show_state(self):
        """The button says what it does now."""
        running, icons = self.session.running, self._viser.Icon
        label = "Pause" if running else "Run"
        if self._run.label != label:
            self._run.label = label
            self._run.icon = icons.PLAYER_PAUSE if running else icons.PLAYER_PLAY

    # ---- the scene ---------------------------------------------------------------------------------------------------

    def _layer_names(self):
        """{name: its handles, none yet}: what the scene can be shown as."""
        from .visuals import visuals_of

        if self.session.loaded is not None and visuals_of(self.session.loaded):
            self._layers["visuals"] = []
            self._layers["collision shapes"] = []
        else:
            self._layers["shapes"] = []
        return self._layers

    def _describe(self):
        return self.session.describe(reach=12.0)

    def _build_scene(self):
        scene, world = self.server.scene, self.session.world
        state = self.session.state()
        self._moving = []
        for name, handles in self._layers.items():
            description = self.session.describe(name == "collision shapes")
            if not handles and name == next(iter(self._layers)):
                self.description = description
            self._add_layer(name, handles, description, state)
        description = self.description
        still = np.array([body.type == "static" for body in world.bodies], dtype=bool)
        self._still = still
        radius = description.radius
        # A sun with shadows, and less light from all around than viser has by itself, which makes colours pale.
        scene.configure_default_lights(False)
        scene.configure_environment_map("studio", environment_intensity=0.12)
        scene.add_light_directional("/sun", color=(255, 244, 225), intensity=3.0, cast_shadow=True, position=tuple(
            description.centre + 3 * radius * SUN))
        scene.add_light_hemisphere("/sky", sky_color=(220, 235, 255), ground_color=(200, 190, 180), intensity=0.5)
        # The sky goes over into the ground far away.
        share = np.clip(np.linspace(0, 2.2, 256), 0, 1)[:, None, None]
        sky = np.rint(_SKY + (_HORIZON - _SKY) * share).astype(np.uint8)
        scene.set_background_image(np.repeat(sky, 4, axis=1), format="png")
        scene.configure_fog(6 * radius, 45 * radius, color=tuple(map(int, _HORIZON)))
        self._look.build_scene(description)
        self._arrow = 0.12 * radius
        none, thin = np.zeros((0, 2, 3), np.float32), 0.003 * radius
        self._forces = scene.add_arrows("/forces", none, (200, 40, 50), shaft_radius=thin, head_radius=2.5 * thin,
                                        head_length=6 * thin)
        self._hand = scene.add_arrows("/hand", none, (30, 90, 200), shaft_radius=2 * thin, head_radius=5 * thin,
                                      head_length=12 * thin)
        self._steering.build_scene(radius)
        camera = looking_at(description, field=1.0)
        self.server.initial_camera.position = tuple(camera.eye)
        self.server.initial_camera.look_at = tuple(camera.target)

    def _add_layer(self, layer, handles, description, state):
        """Meshes of a layer; those that move are in `_moving`."""
        scene, moves = self.server.scene, np.ones(description.bodies, dtype=bool)
        copies = max(len(state) // max(self.session.world.body_count, 1), 1)
        still = np.array([body.type == "static" for body in self.session.world.bodies], dtype=bool)
        rows = description.bodies // copies
        moves[np.tile(np.arange(rows), copies) >= len(still)] = False
        moves[:] &= ~np.tile(np.concatenate([still, np.ones(rows - len(still), bool)]), copies)
        visible = layer == next(iter(self._layers))
        for k, group in enumerate(description.groups):
            place, turn = group.poses(*description.poses(state))
            name = f"/{layer.replace(' ', '_')}/{k}"
            if group.mesh.uv is None or group.mesh.image is None:
                mesh = group.mesh.split()
                handle = scene.add_batched_meshes_simple(
                    name, mesh.vertices, mesh.triangles, turn, place, batched_scales=group.scale,
                    batched_colors=_linear(group.colour),
                    batched_opacities=group.opacity.astype(np.float32) if (group.opacity < 1).any() else None,
                    lod="off", cast_shadow=not group.is_ground, visible=visible)
            else:
                handle = scene.add_batched_meshes_trimesh(
                    name, _textured(group), turn, place, batched_scales=group.scale, lod="off",
                    cast_shadow=not group.is_ground, visible=visible)
            handles.append(handle)
            handle.on_click(lambda event, group=group: self._pick(event, group))
            if moves[group.body].any():
                self._moving.append((group, handle))
                handle.on_drag(lambda event, group=group: self._drag(event, group))

    def _pick(self, event, group):
        instance = event.instance_index or 0
        if instance < len(group.body):
            self._look.pick(int(group.body[instance]), group.names[instance])

    def _is_near(self, point):
        """Within what a mouse can mean: farther away, a hand's spring would tear the scene apart."""
        return np.linalg.norm(np.asarray(point) - self.description.centre) <= _REACH * self.description.radius

    def _drag(self, event, group):
        instance = event.instance_index or 0
        if event.phase == "end":
            self.session.release()
        elif instance < len(group.body) and self._is_near(event.start_position) and self._is_near(event.end_position):
            if event.phase == "start":
                self.session.grab(int(group.body[instance]), event.start_position)
            self.session.pull(event.end_position)

    def frame(self):
        """Run as far as the clock asks for, and send what has changed."""
        now = time.perf_counter()
        session, panel = self.session, self._time
        try:
            session.advance(min(now - self._last, 0.1), 0.8 * _FRAME)
        except Error as error:      # a step that cannot be made: the page stays, for another setting or a reset
            session.running, self._wrong = False, str(error)
        self._last = now
        with session.lock:
            panel.read()
            now_at, state, back = session.steps * session.dt, None, panel.back
            if back < 0:
                now_at, state = session.tape.at(back)
            else:
                state = session.state()
            forces = (forces_of(session.world, _ARROWS)
                      if self._contacts.value and back == 0 and session.environments is None else _NO_FORCES)
            self._steering.read()
            hand = session.hand()
            report = session.world.report
        with self.server.atomic():
            self._show_state()
            poses = self.description.poses(state)
            for group, handle in self._moving:
                if not handle.visible:
                    continue
                place, turn = group.poses(*poses)
                handle.batched_positions = place.astype(np.float32)
                handle.batched_wxyzs = turn.astype(np.float32)
            if len(forces.force) or len(self._forces.points):
                self._forces.points = forces.arrows(self._arrow).astype(np.float32)
                self._forces.colors = colours_of(forces.error)
                self._legend.visible = self._contacts.value and not np.isnan(forces.error).all()
            self._look.draw(state)
            self._steering.draw()
            if hand is not None:
                self._hand.points = np.stack([hand[0], hand[1]])[None].astype(np.float32)
            elif len(self._hand.points):
                self._hand.points = np.zeros((0, 2, 3), np.float32)
        if now - self._plotted >= _PLOT:
            self._plotted = now
            said = f"{now_at:.2f} s"
            if session.environments is None:
                said += f", {report.contacts} contacts, {report.ms['total']:.2f} ms a step"
            else:
                said += f", {session.environments.count} environments"
            if back < 0:
                said += f", {-back:.1f} s ago"
            elif not session.running:
                said += ", paused"
            if panel.recording:
                said += ", recording"
            if self._wrong:
                said += f"\n\n**{self._wrong}**"
            if hand is not None:
                said += f"\n\nhand: {np.linalg.norm(hand[2]):.3g} N"
            self._said.content = said
            self._steering.say()
            self._look.say()
            self._plot()

    def _plot(self):
        with self.session.lock:
            history = {name: np.array(values, float) for name, values in self.session.history.items()}
        times = history["time"]
        if len(times) > 1:
            use = times >= times[-1] - MINUTE
            use &= np.arange(len(times)) % max(int(use.sum()) // _POINTS, 1) == 0
            for name, handle in self._plots.items():
                values = history[name][use]
                if len(values) > 1 and np.isfinite(values).any():
                    values = np.nan_to_num(values)
                    if name in _BY_POWER:
                        # What is at rest is not shown far below: all else would be one line.
                        values = np.log10(np.maximum(values, max(values.max() * 1e-9, 1e-16)))
                    handle.data = (times[use], values)


#: Of a plot that has none.
_NO_CURVE = (np.zeros(1), np.zeros(1))


def _linear(colour):
    """Colours n x 3 as the page takes those of instances: linear, where meshes and textures have sRGB. As sRGB they
    would be pale."""
    return np.rint(np.clip(colour, 0, 1) ** 2.2 * 255).astype(np.uint8)


def _textured(group):
    """A mesh with a texture, as trimesh has it; the colour of the first instance is in the texture."""
    import trimesh
    from PIL import Image

    mesh = group.mesh
    tint = np.clip(group.colour[0], 0, 1)
    image = Image.fromarray(np.rint(mesh.image * tint).astype(np.uint8))
    uv = mesh.uv.reshape(-1, 2) * [1, -1] + [0, 1]          # trimesh has v up from the lowest row
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image, metallicFactor=0.0, roughnessFactor=0.8)
    corners = mesh.vertices[mesh.triangles].reshape(-1, 3)
    made = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False,
                           visual=trimesh.visual.TextureVisuals(uv=uv, material=material),
                           vertex_normals=mesh.corner_normals().reshape(-1, 3))
    return made


def _backends():
    from .. import backends
    return backends()


def serve(build, title="", host="127.0.0.1", port=8080):
    """Show build(), a new world, what load() returned or Environments, at http://host:port until it is interrupted.
    host: an address or a name of this machine; port: in [0, 65535], or the next one that is
    free; 0: any. Raises OSError where it cannot be served there."""
    guard.free_port(host, whole("port", port, 0, 65535))     # before a world is built
    view = View(Session(build), title, host, port)
    print(f"{title}: {view.url}", flush=True)
    try:
        while True:
            begun = time.perf_counter()
            view.frame()
            time.sleep(max(_FRAME - (time.perf_counter() - begun), 0))
    finally:
        view.stop()
