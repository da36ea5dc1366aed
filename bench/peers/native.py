"""Engines behind peer.h: shared libraries, built here on demand where the engine is installed."""
import ctypes
import os
import shutil
import subprocess

import numpy as np

from judge import Contacts
from scenes import force_at

HERE = os.path.dirname(os.path.abspath(__file__))
BUILT = os.path.join(os.path.dirname(os.path.dirname(HERE)), "build-peers")
SHAPES = {"box": 1, "sphere": 2, "plane": 3}
JOINTS = {"ball": 0, "hinge": 1, "slider": 2}
MOST_CONTACTS = 16384


class Missing(Exception):
    """Why an engine cannot be had here."""


class SceneStruct(ctypes.Structure):
    _fields_ = [*((name, ctypes.c_double) for name in ("dt", "gravity", "friction", "restitution")),
                *((name, ctypes.c_int) for name in ("tuned", "smooth", "round", "forces"))]


class BodyStruct(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_int), ("shape", ctypes.c_int), ("mass", ctypes.c_double),
                ("inertia", ctypes.c_double * 3), ("size", ctypes.c_double * 3), ("pose", ctypes.c_double * 7),
                ("velocity", ctypes.c_double * 6)]


CONTACT = np.dtype({"names": ["a", "b", "point", "normal", "gap", "force"],
                    "formats": ["i4", "i4", ("f8", 3), ("f8", 3), "f8", ("f8", 3)],
                    "offsets": [0, 4, 8, 32, 56, 64], "itemsize": 88})


def load(path):
    """The functions of peer.h."""
    try:
        library = ctypes.CDLL(os.path.abspath(path))
        world, numbers, text = ctypes.c_void_p, ctypes.POINTER(ctypes.c_double), ctypes.c_char_p
        for name, result, arguments in (
                ("version", text, []), ("settings", text, [ctypes.c_int]),
                ("create", world, [ctypes.POINTER(SceneStruct)]), ("destroy", None, [world]),
                ("add_body", ctypes.c_int, [world, ctypes.POINTER(BodyStruct)]),
                ("add_joint", ctypes.c_int, [world, *3 * (ctypes.c_int,), numbers, numbers]),
                ("move", None, [world, ctypes.c_int, numbers]), ("push", None, [world, ctypes.c_int, numbers]),
                ("step", ctypes.c_double, [world]), ("state", None, [world, ctypes.c_int, numbers, numbers]),
                ("contacts", ctypes.c_int, [world, ctypes.c_void_p, ctypes.c_int])):
            function = getattr(library, "peer_" + name)
            function.restype, function.argtypes = result, arguments
        return library
    except (OSError, AttributeError) as error:
        raise Missing(f"{path}: {error}") from None


def build(source, package, install):
    """The library of a driver in this folder; `package`: of pkg-config."""
    compiler = shutil.which("g++" if source.endswith(".cpp") else "gcc")
    if not compiler or not shutil.which("pkg-config"):
        raise Missing("needs a compiler and pkg-config")
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", package], capture_output=True, text=True, check=False)
    if flags.returncode:
        raise Missing(f"not installed: {install}")
    path, target = os.path.join(HERE, source), os.path.join(BUILT, "lib" + os.path.splitext(source)[0] + ".so")
    inputs = [path, os.path.join(HERE, "peer.h")]
    if os.path.exists(target) and os.path.getmtime(target) > max(map(os.path.getmtime, inputs)):
        return target
    os.makedirs(BUILT, exist_ok=True)
    language = ["-std=c++17"] if source.endswith(".cpp") else ["-std=c11", "-D_POSIX_C_SOURCE=200809L"]
    command = [compiler, *language, "-O2", "-fPIC", "-shared", path, "-o", target, *flags.stdout.split(), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise Missing(f"its driver {source} does not compile:\n{done.stderr}")
    return target


def numbers(values):
    values = [float(x) for x in values]
    return (ctypes.c_double * len(values))(*values)


class Native:
    """Base of the adapters: `name`, and how to `locate` the library."""
    only_named = False

    @classmethod
    def find(cls):
        cls.library = load(cls.locate())
        cls.version = cls.library.peer_version().decode()
        cls.SETTINGS = {name: cls.library.peer_settings(tuned).decode()
                        for tuned, name in enumerate(("default", "tuned"))}

    def __init__(self, scene, dt, settings):
        self.scene, self.world = scene, None
        moving = [body.shape for body in scene.bodies if body.mass and body.shape]
        self.world = self.library.peer_create(SceneStruct(
            dt, scene.gravity, scene.friction, scene.restitution, settings != "default", scene.smooth,
            bool(moving) and all(shape.kind == "sphere" for shape in moving), "natural_map" in scene.judged))
        self.dt, self.start = dt, None
        if not self.world:
            raise MemoryError(f"{self.name}: no world")
        number = {None: -1}
        for body in scene.bodies:
            made = BodyStruct(1 if body.mass else 2 if body.path else 0, SHAPES[body.shape.kind] if body.shape else 0,
                              body.mass)
            size = np.resize(body.shape.size, 3) if body.shape and body.shape.size else np.zeros(3)
            made.inertia, made.size = numbers(body.inertia), numbers(size)
            made.pose = numbers((*body.position, *body.orientation))
            made.velocity = numbers((*body.velocity, *body.spin))
            number[body.name] = self.library.peer_add_body(self.world, made)
        for joint in scene.joints:
            self.library.peer_add_joint(self.world, JOINTS[joint.kind], number[joint.a], number[joint.b],
                                        numbers(joint.point), numbers(joint.axis))
        self.given = [np.array([*body.position, *body.orientation]) for body in scene.bodies]

    def __del__(self):
        if self.world:
            self.library.peer_destroy(self.world)

    def step(self, time):
        self.start = self.state()[0] if "natural_map" in self.scene.judged else None
        for k, body in enumerate(self.scene.bodies):
            if body.path:
                self.library.peer_move(self.world, k, numbers(body.path(time + self.dt)))
            if any(body.force):
                self.library.peer_push(self.world, k, numbers(force_at(body, time)))
        return self.library.peer_step(self.world)

    def state(self):
        count = len(self.scene.bodies)
        poses, velocities = np.zeros((count, 7)), np.zeros((count, 6))
        at = lambda array, k: array[k].ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        for k, body in enumerate(self.scene.bodies):
            if body.mass or body.path:
                self.library.peer_state(self.world, k, at(poses, k), at(velocities, k))
            else:
                poses[k] = self.given[k]    # of the scene, whatever shape the engine takes for it
        return poses, velocities

    def contacts(self):
        rows = np.zeros(MOST_CONTACTS, CONTACT)
        count = self.library.peer_contacts(self.world, rows.ctypes.data, MOST_CONTACTS)
        if count < 0:
            return None
        rows = rows[:count]
        return Contacts(rows["a"], rows["b"], rows["point"], rows["normal"], rows["gap"],
                        np.full(count, self.scene.friction), rows["force"], self.start[:, :3], self.start[:, 3:],
                        self.state()[1])


class Bullet(Native):
    name = "Bullet"

    @staticmethod
    def locate():
        return build("peer_bullet.cpp", "bullet-float64", "Debian and Ubuntu: libbullet-dev")


class ODE(Native):
    name = "ODE"

    @staticmethod
    def locate():
        return build("peer_ode.c", "ode", "Debian and Ubuntu: libode-dev")


def drivers(given):
    """Adapters of NAME=FILE, and the names of engines of which there is no package."""
    made = {}
    for name, _, path in (text.partition("=") for text in given):
        made[name] = type(name, (Native,), {"name": name, "locate": staticmethod(lambda path=path: path)})
    for name in ("Jolt", "Box3D"):
        made.setdefault(name, type(name, (Native,), {"name": name, "locate": staticmethod(not_built)}))
    return list(made.values())


def not_built():
    raise Missing("there is no package of it; build it behind bench/peers/peer.h, then --driver NAME=FILE")
