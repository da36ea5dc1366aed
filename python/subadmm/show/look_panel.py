"""The part of the view's page that says what there is to see: visuals or shapes that collide, joint frames, grid, and
what was picked."""
import numpy as np

from ..rotations import multiply, rotate


def _nice(length):
    """A round length near to one: 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * min((1, 2, 5, 10), key=lambda k: abs(np.log(k * power / length))))


class LookPanel:
    """layers: of the scene, {name: list of handles}; of them one is shown."""

    def __init__(self, server, session, layers):
        self.server, self.session, self._picked = server, session, None
        gui = server.gui
        with gui.add_folder("Look"):
            self.layer = None
            if len(layers) > 1:
                self.layer = gui.add_dropdown("shown", tuple(layers), initial_value=next(iter(layers)))
            self.joints = gui.add_checkbox("joint frames", False)
            self.grid = gui.add_checkbox("grid", True)
        with gui.add_folder("Picked"):
            self.said = gui.add_markdown("click a body")

        if self.layer is not None:
            @self.layer.on_update
            def _(_):
                for name, handles in layers.items():
                    for handle in handles:
                        handle.visible = name == self.layer.value

    # ---- the scene ---------------------------------------------------------------------------------------------------

    def build_scene(self, description):
        """Frames of joints, and a grid on the floor."""
        scene, world = self.server.scene, self.session.world
        rows, places, turns = [], [], []
        for joint in world.joints:
            body, (place, turn) = joint.body_a, joint.frame_a
            rows.append(-1 if body is None else body.index)
            places.append(place)
            turns.append(turn)
        self._rows = np.array(rows, dtype=int)
        self._places, self._turns = np.array(places, float).reshape(-1, 3), np.array(turns, float).reshape(-1, 4)
        size = 0.22 * description.radius
        self._frames = scene.add_batched_axes("/joints", self._turns, self._places, axes_length=size,
                                              axes_radius=0.035 * size, visible=False)
        cell = _nice(description.radius / 4)
        has_ground = any(group.is_ground and group.mesh.image is None for group in description.groups)
        self.grid.value = has_ground
        self._grid = scene.add_grid(
            "/grid", infinite_grid=True, cell_size=cell, section_size=5 * cell, cell_color=(168, 174, 184),
            section_color=(120, 128, 142), cell_thickness=0.8, section_thickness=1.2,
            fade_distance=14 * description.radius, fade_from="origin", shadow_opacity=0.0, visible=has_ground,
            position=(0.0, 0.0, description.floor + 2e-3 * description.radius))
        self.joints.disabled = not len(self._rows)
        self._bodies = description.bodies

        @self.grid.on_update
        def _(_):
            self._grid.visible = self.grid.value

        @self.joints.on_update
        def _(_):
            self._frames.visible = self.joints.value

    def draw(self, state):
        """The joints' frames at an array body_state."""
        if self.joints.value and len(self._rows):
            fixed = self._rows < 0
            turn = np.where(fixed[:, None], [1.0, 0, 0, 0], state[self._rows, 3:7])
            place = np.where(fixed[:, None], 0.0, state[self._rows, :3])
            self._frames.batched_positions = (place + rotate(turn, self._places)).astype(np.float32)
            self._frames.batched_wxyzs = multiply(turn, self._turns).astype(np.float32)

    # ---- picked ------------------------------------------------------------------------------------------------------

    def pick(self, row, name):
        """A body was clicked: its row of poses, and the name of what it was clicked at."""
        self._picked = row, name
        self.say()

    def say(self):
        """What was picked, as it is now."""
        if self._picked is None:
            return
        row, name = self._picked
        session = self.session
        with session.lock:
            bodies, states = session.world.bodies, session.state()
            copies = max(len(states) // max(len(bodies), 1), 1)
            copy, row = divmod(row, self._bodies // copies)     # rows of poses in each copy
            if row >= len(bodies):
                self.said.content = f"**{name}**: fixed in the world"
                return
            body, state = bodies[row], states[copy * len(bodies) + row]
            x, v = state[:3], state[7:10]
            lines = [f"**{body.name or f'body {row}'}**, {body.type}" + (f", environment {copy}" if copies > 1 else "")]
            if name and name != body.name:
                lines.append(f"at {name}")
            if body.type == "dynamic":
                lines.append(f"{body.mass:.4g} kg")
            lines.append(f"at {x[0]:.3f}, {x[1]:.3f}, {x[2]:.3f} m")
            if body.type != "static":
                lines.append(f"{np.linalg.norm(v):.3g} m/s, {np.linalg.norm(state[10:13]):.3g} rad/s")
            shapes = [shape.definition for shape in session.world.shapes if shape.body == body]
            if shapes:
                kinds = sorted({shape.type for shape in shapes})
                frictions = sorted({round(shape.friction, 4) for shape in shapes})
                slippery = ", ".join(f"{friction:g}" for friction in frictions[:4])
                lines.append(f"{len(shapes)} × {', '.join(kinds)}; friction {slippery}")
            joints = [joint for joint in session.world.joints if body in (joint.body_a, joint.body_b)]
            if joints:
                lines.append(", ".join(f"{joint.kind} joint" for joint in joints[:6]))
        self.said.content = "  \n".join(lines)
