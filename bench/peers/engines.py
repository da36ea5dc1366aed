"""Engines: each builds a scene of scenes.py, makes steps, and tells poses, velocities and, where it can, contact
forces.

An adapter is a class with

    name, version                  as tables show them
    SETTINGS                       {"default": ..., "tuned": ...}: what is set, a dict or a text; where there is
                                   "tuned, smooth", that is taken for scenes in which nothing rubs
    __init__(scene, dt, settings)  builds, by a key of these; one thread, nothing sleeps
    step(time)                     one step that begins at this time; returns the seconds of the engine's own call
    only_named                     True: left out where --engine does not name it
    state()                        (poses: bodies x 7, velocities: bodies x 6), in the scene's order
    contacts()                     judge.Contacts of the last step, or None

and the class method find(), which sets `version` or raises Missing with the reason why the engine cannot be had.
Engines written in C or C++ have a driver instead: a shared library with the functions of peer.h (native.py).
"""
import math
import os
import time as clock

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import native
from judge import Contacts, matrices
from native import Missing
from scenes import force_at, turn_to


class Subadmm:
    name = "subadmm"
    only_named = False
    SETTINGS = {
        # As the library comes: error at most 1e-6 m/s a step, in at most 200 iterations.
        "default": {},
        # The error of the solve below that of anything else.
        "tuned": {"tolerance": 1e-9, "iterations": 2000},
        # What turns far in a step loses accuracy (docs/guide/choose.md, "Time step").
        "tuned, smooth": {"tolerance": 1e-9, "iterations": 2000, "substeps": 4},
    }

    @classmethod
    def find(cls):
        try:
            import subadmm
        except ImportError as error:
            raise Missing(f"the package subadmm cannot be imported ({error}): install it, or set PYTHONPATH") from None
        cls.module, cls.version = subadmm, subadmm.version()

    def __init__(self, scene, dt, settings):
        self.dt, self.scene = dt, scene
        self.world = self.module.World(backend="cpu", settings=self.module.Settings(
            dt=dt, gravity=(0, 0, -scene.gravity), threads=1, **self.SETTINGS[settings]))
        self.bodies = {None: None}
        for body in scene.bodies:
            options = {}
            if body.mass:
                options = {"mass": body.mass, "inertia": body.inertia, "linear_velocity": body.velocity,
                           "angular_velocity": body.spin}
            kind = "dynamic" if body.mass else "kinematic" if body.path else "static"
            shapes = []
            if body.shape:
                make = getattr(self.module, body.shape.kind)
                shapes = [make(*body.shape.size, friction=scene.friction, restitution=scene.restitution)]
            made = self.world.add_body(name=body.name, type=kind, position=body.position, orientation=body.orientation,
                                       shapes=shapes, **options)
            self.bodies[body.name] = made
        for joint in scene.joints:
            kind = {"ball": "spherical", "hinge": "revolute", "slider": "prismatic"}[joint.kind]
            self.world.add_joint(kind, self.bodies[joint.a], self.bodies[joint.b], position=joint.point,
                                 orientation=turn_to((0, 0, 1), joint.axis))
        self.moved = [(self.bodies[body.name], body) for body in scene.bodies if body.path]
        self.pressed = [(self.bodies[body.name], body) for body in scene.bodies if any(body.force)]
        self.rows = [self.bodies[body.name].index for body in scene.bodies]

    def step(self, time):
        for made, body in self.moved:
            made.move_to(body.path(time + self.dt), body.orientation)
        for made, body in self.pressed:
            made.set_wrench(force_at(body, time))
        self.start = self.world.get("body_state")[self.rows]
        start = clock.perf_counter()
        self.world.step()
        return clock.perf_counter() - start

    def state(self):
        states = self.world.get("body_state")[self.rows]
        return states[:, :7].copy(), states[:, 7:].copy()

    def contacts(self):
        rows = self.world.contacts()
        order = np.argsort(self.rows)   # nothing is ever removed, so an id's slot is the index + 1
        a, b = (order[rows[side][:, 0].astype(int) - 1] for side in ("body_a", "body_b"))
        return Contacts(a, b, rows["position"], rows["normal"], rows["separation"], rows["friction"], rows["force"],
                        self.start[:, :3], self.start[:, 3:7], self.state()[1])


class MuJoCo:
    name = "MuJoCo"
    only_named = False
    SETTINGS = {
        "default": {},
        # What MuJoCo's own guide says for contacts that are stiff and do not slip ("Tuning", "Preventing slip"):
        # elliptic cones; friction stiffer than the normal by impratio; the discrete integrator, which takes any solref
        # and makes contacts as stiff as the step can resolve; impedances near 1; iterations to 1e-10. Its noslip pass
        # makes stacks and grips worse beside these.
        "tuned": {"cone": "elliptic", "impratio": 1000, "integrator": "discrete", "iterations": 200, "tolerance": 1e-10,
                  "solref_steps": 0.1, "solimp": "0.99 0.999 0.0001"},
        # ... and for motions without friction: "RK4 for nearly energy-conserving or tumbling systems". It needs a
        # solref of two steps.
        "tuned, smooth": {"integrator": "RK4", "iterations": 200, "tolerance": 1e-10, "solref_steps": 2,
                          "solimp": "0.99 0.999 0.0001"},
    }
    HUGE = 1e9  # armature of what moves as prescribed, kg

    @classmethod
    def find(cls):
        try:
            import mujoco
        except ImportError as error:
            raise Missing(f"not installed ({error}): python -m pip install mujoco") from None
        cls.module, cls.version = mujoco, mujoco.__version__

    def __init__(self, scene, dt, settings):
        self.dt, self.scene = dt, scene
        self.model = self.module.MjModel.from_xml_string(self.xml(scene, dt, self.SETTINGS[settings]))
        self.data = self.module.MjData(self.model)
        number = self.module.mj_name2id
        self.ids = [number(self.model, self.module.mjtObj.mjOBJ_BODY, body.name) for body in scene.bodies]
        self.row_of = {made: k for k, made in enumerate(self.ids)}
        self.moved = []
        self.pressed = [(made, body) for made, body in zip(self.ids, scene.bodies) if any(body.force)]
        for made, body in zip(self.ids, scene.bodies):
            dof = self.model.body_dofadr[made]
            if body.path:
                self.moved.append((body, self.model.jnt_qposadr[self.model.body_jntadr[made]], dof))
            elif self.free(body):
                self.data.qvel[dof:dof + 3] = body.velocity
                self.data.qvel[dof + 3:dof + 6] = matrices(body.orientation).T @ body.spin
        self.places = self.now = None

    def free(self, body):
        return body.mass and not any(body.name in (joint.a, joint.b) for joint in self.scene.joints)

    def xml(self, scene, dt, settings):
        """Bodies that joints hold are a tree, as MuJoCo wants it; a joint that closes a loop is an equality."""
        numbers = lambda values: " ".join(repr(float(x)) for x in np.atleast_1d(values))
        options = {key: value for key, value in settings.items() if key not in ("solref_steps", "solimp")}
        contact = {"condim": "1" if not scene.friction else "3", "friction": numbers((scene.friction, 0, 0))}
        stiff = {}
        if "solimp" in settings:
            stiff = {"solref": f"{settings['solref_steps'] * dt!r} 1", "solimp": settings["solimp"]}
        contact.update(stiff)
        if scene.restitution:
            # The direct form without damping is how MuJoCo makes elastic contacts ("Restitution"). Five steps for half
            # an oscillation are closest to the exact impact.
            contact["solref"] = f"{-(math.pi / (5 * dt)) ** 2!r} 0"
            contact["solimp"] = "0.9999 0.9999 0.001"
        attributes = lambda given: " ".join(f'{key}="{value}"' for key, value in given.items())
        parents, closing = {}, []
        for joint in scene.joints:
            if joint.b in parents:
                closing.append(joint)
            else:
                parents[joint.b] = joint

        def body_xml(body, place, turn):
            joint = parents.get(body.name)
            frame = matrices(body.orientation)
            own = [f'<body name="{body.name}" pos="{numbers(turn.T @ (np.array(body.position) - place))}" '
                   f'quat="{numbers(quaternion_between(turn, body.orientation))}">']
            if body.mass:
                own.append(f'<inertial pos="0 0 0" mass="{body.mass!r}" diaginertia="{numbers(body.inertia)}"/>')
            if body.path:
                # Moves as prescribed: its coordinate is set before each step, and nothing can push it.
                own.append('<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>')
                own.append(f'<joint type="slide" axis="0 0 1" armature="{self.HUGE!r}"/>')
            elif joint:
                anchor = numbers(frame.T @ (np.array(joint.point) - np.array(body.position)))
                kind = {"ball": "ball", "hinge": "hinge", "slider": "slide"}[joint.kind]
                axis = "" if kind == "ball" else f' axis="{numbers(frame.T @ np.array(joint.axis, float))}"'
                own.append(f'<joint type="{kind}" pos="{anchor}"{axis}/>')
            elif body.mass:
                own.append("<freejoint/>")
            if body.shape:
                kind, size = body.shape.kind, body.shape.size or (0, 0, 1)
                own.append(f'<geom type="{kind}" size="{numbers(size)}"/>')
            for other in scene.bodies:
                link = parents.get(other.name)
                if link and link.a == body.name:
                    own += body_xml(other, np.array(body.position), frame)
            return own + ["</body>"]
        tree = [line for body in scene.bodies if parents.get(body.name) is None or parents[body.name].a is None
                for line in body_xml(body, np.zeros(3), np.eye(3))]
        loops = []
        for joint in closing:
            b = next(body for body in scene.bodies if body.name == joint.b)
            anchor = matrices(b.orientation).T @ (np.array(joint.point) - np.array(b.position))
            loops.append(f'<connect body1="{joint.b}"{"" if joint.a is None else f" body2={joint.a!r}"} '
                         f'anchor="{numbers(anchor)}" {attributes(stiff)}/>')
        return "\n".join([
            "<mujoco><compiler angle=\"radian\"/>",
            f'<option timestep="{dt!r}" gravity="0 0 {-scene.gravity!r}" {attributes(options)}/>',
            f"<default><geom {attributes(contact)}/></default>",
            "<worldbody>", *tree, "</worldbody>", "<equality>", *loops, "</equality></mujoco>"])

    def step(self, time):
        for body, position, dof in self.moved:
            start, now, end = (body.path(t)[2] for t in (0, time, time + self.dt))
            self.data.qpos[position], self.data.qvel[dof] = now - start, (end - now) / self.dt
        for made, body in self.pressed:
            self.data.xfrc_applied[made, :3] = force_at(body, time)
        return self.advance()

    def advance(self):
        start = clock.perf_counter()
        self.module.mj_step(self.model, self.data)
        return clock.perf_counter() - start

    def state(self):
        mujoco, model, data = self.module, self.model, self.data
        # mj_step leaves places of its beginning. These are kept for the contacts, which belong to them.
        self.places = data.xpos[self.ids].copy(), data.xquat[self.ids].copy()
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        velocities, one = np.zeros((len(self.ids), 6)), np.zeros((6, 1))
        for k, made in enumerate(self.ids):
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, made, one, 0)
            velocities[k] = np.roll(one[:, 0], 3)     # rotation first
        self.now = velocities
        return np.concatenate([data.xpos[self.ids], data.xquat[self.ids]], 1), velocities

    def contacts(self):
        """After state()."""
        data, wrench = self.data, np.zeros((6, 1))
        rows = range(data.ncon)
        frames = np.array([data.contact[k].frame.reshape(3, 3) for k in rows]).reshape(-1, 3, 3)
        forces = np.zeros((data.ncon, 3))
        for k in rows:
            self.module.mj_contactForce(self.model, data, k, wrench)
            forces[k] = wrench[:3, 0] @ frames[k]   # on the second geom
        a, b = ([self.row_of[self.model.geom_bodyid[data.contact[k].geom[side]]] for k in rows] for side in (0, 1))
        points = np.array([data.contact[k].pos for k in rows]).reshape(-1, 3)
        return Contacts(np.array(a, int), np.array(b, int), points, frames[:, 0],
                        np.array([data.contact[k].dist for k in rows]),
                        np.array([data.contact[k].friction[0] for k in rows]), forces, *self.places, self.now)


class MuJoCoWarp(MuJoCo):
    """One world, in single precision; it tells no contact forces here."""
    name = "MuJoCo-Warp"
    only_named = True       # made for thousands of worlds on a GPU: its time for one says little
    SETTINGS = {
        "default": {},
        # As for MuJoCo, but for what it lacks: the discrete integrator, and with it shorter solrefs than two steps.
        "tuned": {"cone": "elliptic", "impratio": 100, "integrator": "implicitfast", "iterations": 200,
                  "tolerance": 1e-6, "solref_steps": 2, "solimp": "0.99 0.999 0.0001"},
        "tuned, smooth": {"integrator": "RK4", "iterations": 200, "tolerance": 1e-6, "solref_steps": 2,
                          "solimp": "0.99 0.999 0.0001"},
    }
    MOST = {"nconmax": 2048, "njmax": 8192}     # contacts and rows that it has room for

    @classmethod
    def find(cls):
        super().find()
        try:
            import mujoco_warp
            import warp
        except ImportError as error:
            raise Missing(f"not installed ({error}): python -m pip install mujoco-warp") from None
        warp.config.quiet = True
        cls.device, cls.warp = mujoco_warp, warp
        cls.version = getattr(mujoco_warp, "__version__", "unknown")

    def __init__(self, scene, dt, settings):
        super().__init__(scene, dt, settings)
        self.device_model = self.device.put_model(self.model)
        self.device_data = self.device.put_data(self.model, self.data, nworld=1, **self.MOST)

    def advance(self):
        data = self.device_data
        if self.moved:
            data.qpos.assign(self.data.qpos[None].astype(np.float32))
            data.qvel.assign(self.data.qvel[None].astype(np.float32))
        if self.pressed:
            data.xfrc_applied.assign(self.data.xfrc_applied[None].astype(np.float32))
        self.warp.synchronize()
        start = clock.perf_counter()
        self.device.step(self.device_model, data)
        self.warp.synchronize()
        spent = clock.perf_counter() - start
        self.data.qpos[:], self.data.qvel[:] = data.qpos.numpy()[0], data.qvel.numpy()[0]
        return spent

    def contacts(self):
        return None


def quaternion_between(turn, orientation):
    """Of an orientation relative to a frame's matrix."""
    return quaternion_of(turn.T @ matrices(orientation))


def quaternion_of(m):
    """Of a rotation matrix, by its largest component."""
    trace = np.array([np.trace(m), *np.diag(m)])
    k = int(trace.argmax())
    if k == 0:
        q = np.array([1 + trace[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i, j, l = k - 1, k % 3, (k + 1) % 3
        q = np.zeros(4)
        q[0] = m[l, j] - m[j, l]
        q[1 + i] = 1 + m[i, i] - m[j, j] - m[l, l]
        q[1 + j], q[1 + l] = m[j, i] + m[i, j], m[l, i] + m[i, l]
    return q / np.linalg.norm(q)


def key_of(engine, scene, settings):
    """Of SETTINGS, for a scene."""
    smooth = f"{settings}, smooth"
    return smooth if scene.smooth and smooth in engine.SETTINGS else settings


def text_of(engine, key):
    given = engine.SETTINGS[key]
    if isinstance(given, str):
        return given
    return ", ".join(f"{name} {value}" for name, value in given.items()) or "as it comes"


def all_engines(drivers=()):
    return [Subadmm, MuJoCo, native.Bullet, native.ODE, MuJoCoWarp, *native.drivers(drivers)]
