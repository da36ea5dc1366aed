"""A page with a running world, by viser: meshes, controls, plots, contact forces, and a hand that pulls bodies."""
import time

import numpy as np

from .. import Error
from .._core import _names
from ..given import whole
from . import guard
from .camera import looking_at
from .description import describe
from .forces import Forces, colours_of, forces_of, legend
from .measures import MEASURES
from .picture import SUN
from .session import Session
from .steering_panel import SteeringPanel

_FRAME = 1 / 30          # s between frames
_PLOT = 0.5              # s between plots
_REACH = 100             # radii of what there is to see: bodies are not pulled to places farther away
_BY_POWER = ("kinetic", "error")   # drawn as powers of ten: they go over many
_CERTIFIED = 500         # bodies
_ARROWS = 2000           # contacts drawn at most: those with the largest forces
_NO_FORCES = Forces(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


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
        server.gui.set_panel_label(title or "subadmm")
        server.scene.set_up_direction("+z")
        self._build_controls()
        self._build_scene()
        self._last = time.perf_counter()
        self._plotted = 0.0
        self._wrong = ""         # what is said until the user does something

    def stop(self):
        """End the server."""
        self.server.stop()

    # ---- the panel ---------------------------------------------------------------------------------------------------

    def _build_controls(self):
        gui, session = self.server.gui, self.session
        # The error costs about as much as a step of a few iterations: small worlds have it from the beginning.
        if session.world.body_count <= _CERTIFIED:
            session.change(certify=True)
        settings = session.world.settings
        buttons = gui.add_button_group("run", ("Run / Pause", "Step", "Reset"))
        speed = gui.add_slider("speed", 0.05, 2.0, 0.05, 1.0)
        with gui.add_folder("Solver"):
            method = gui.add_dropdown("method", _names["method"], initial_value=settings.method)
            iterations = gui.add_number("iterations", settings.iterations, min=1, max=1000000, step=1)
            here = session.world.report.backend
            names = tuple(backend["name"] for backend in _backends() if backend["f64"])
            backend = gui.add_dropdown("backend", ("as begun",) + names)
            certify = gui.add_checkbox("measure the error", settings.certify)
        self._contacts = gui.add_checkbox("contact forces", False)
        self._legend = gui.add_html(f'<div style="padding:0 1em">{legend()}</div>', visible=False)
        self._steering = SteeringPanel(self.server, session, self._is_near)
        self._said = gui.add_markdown("")
        self._plots = {}
        with gui.add_folder("Plots", expand_by_default=True):
            for name in ("kinetic", "ms", "error"):
                what, unit = MEASURES[name]
                if name in _BY_POWER:
                    what, unit = f"{what}: power of ten of {unit}", "power"
                self._plots[name] = gui.add_uplot(
                    (np.zeros(1), np.zeros(1)),
                    ({"label": "s"}, {"label": unit, "stroke": "#3a8c8c", "width": 2}),
                    title=what,
                    scales={"x": {"time": False}, "y": {"auto": True}},
                    height=150,
                )

        def settle(**changes):
            self._wrong = ""
            try:
                session.change(**changes)
            except Exception as error:              # a refused setting: say so, and go on with the old one
                self._wrong = str(error)
                self._said.content = f"**{error}**"

        def reset():
            with session.lock:
                session.reset()
                changes = {"method": method.value, "iterations": int(iterations.value), "certify": certify.value}
                settle(**changes, **({} if backend.value == "as begun" else {"backend": backend.value}))
                self._steering.begin_again()

        @buttons.on_click
        def _(_):
            self._wrong = ""
            if buttons.value == "Step":
                session.running = False
                try:
                    session.step()
                except Error as error:
                    self._wrong = str(error)
            elif buttons.value == "Reset":
                reset()
            else:
                session.running = not session.running

        @self._contacts.on_update
        def _(_):
            for _, handle in self._moving:     # forces are seen through bodies
                handle.opacity = 0.35 if self._contacts.value else None

        @speed.on_update
        def _(_):
            session.speed = speed.value

        method.on_update(lambda _: settle(method=method.value))
        iterations.on_update(lambda _: settle(iterations=int(iterations.value)))
        certify.on_update(lambda _: settle(certify=certify.value))
        backend.on_update(lambda _: settle(backend=here if backend.value == "as begun" else backend.value))

    # ---- the scene ---------------------------------------------------------------------------------------------------

    def _build_scene(self):
        scene, world = self.server.scene, self.session.world
        self.description = description = describe(world)
        state = world.get("body_state")
        still = np.array([body.type == "static" for body in world.bodies], dtype=bool)
        self._moving = []
        for k, group in enumerate(description.groups):
            mesh = group.mesh.split()
            place, turn = group.poses(state[:, :3], state[:, 3:7])
            handle = scene.add_batched_meshes_simple(
                f"/bodies/{k}", mesh.vertices, mesh.triangles, turn, place, batched_scales=group.scale,
                batched_colors=np.rint(group.colour * 255).astype(np.uint8), lod="off")
            if not still[group.body].all():
                self._moving.append((group, handle))
                handle.on_drag(lambda event, group=group: self._drag(event, group))
        radius = description.radius
        # A sun with shadows, and less light from all around than viser has by itself, which makes colours pale.
        scene.configure_default_lights(False)
        scene.configure_environment_map("studio", environment_intensity=0.12)
        scene.add_light_directional("/sun", color=(255, 244, 225), intensity=1.1, cast_shadow=True, position=tuple(
            description.centre + 3 * radius * SUN))
        scene.add_light_hemisphere("/sky", sky_color=(220, 235, 255), ground_color=(200, 190, 180), intensity=0.45)
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
        session = self.session
        try:
            session.advance(min(now - self._last, 0.1), 0.8 * _FRAME)
        except Error as error:      # a step that cannot be made: the page stays, for another setting or a reset
            session.running, self._wrong = False, str(error)
        self._last = now
        with session.lock:
            state = session.world.get("body_state")
            forces = forces_of(session.world, _ARROWS) if self._contacts.value else _NO_FORCES
            self._steering.read()
            hand = session.hand()
            report = session.world.report
            now_at = session.steps * session.world.settings.dt
        with self.server.atomic():
            for group, handle in self._moving:
                place, turn = group.poses(state[:, :3], state[:, 3:7])
                handle.batched_positions = place.astype(np.float32)
                handle.batched_wxyzs = turn.astype(np.float32)
            if len(forces.force) or len(self._forces.points):
                self._forces.points = forces.arrows(self._arrow).astype(np.float32)
                self._forces.colors = colours_of(forces.error)
                self._legend.visible = self._contacts.value and not np.isnan(forces.error).all()
            self._steering.draw()
            if hand is not None:
                self._hand.points = np.stack([hand[0], hand[1]])[None].astype(np.float32)
            elif len(self._hand.points):
                self._hand.points = np.zeros((0, 2, 3), np.float32)
        if now - self._plotted >= _PLOT:
            self._plotted = now
            said = f"{now_at:.2f} s, {report.contacts} contacts, {report.ms['total']:.2f} ms a step"
            if not session.running:
                said += ", paused"
            if self._wrong:
                said += f"\n\n**{self._wrong}**"
            if hand is not None:
                said += f"\n\nhand: {np.linalg.norm(hand[2]):.3g} N"
            self._said.content = said
            self._steering.say()
            self._plot()

    def _plot(self):
        with self.session.lock:
            history = {name: np.array(values, float) for name, values in self.session.history.items()}
        if len(history["time"]) > 1:
            for name, handle in self._plots.items():
                values = history[name]
                if np.isfinite(values).any():
                    values = np.nan_to_num(values)
                    if name in _BY_POWER:
                        values = np.log10(np.maximum(values, 1e-20))
                    handle.data = (history["time"], values)


def _backends():
    from .. import backends
    return backends()


def serve(build, title="", host="127.0.0.1", port=8080):
    """Show build(), a world, at http://host:port until it is interrupted. host: an address or a name of this machine;
    port: in [0, 65535], or the next one that is free; 0: any. Raises OSError where it cannot be served there."""
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
