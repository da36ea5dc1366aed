"""What every call keeps to: nothing is made to fit in silence, objects are of their world, what fails leaves nothing
behind, names are texts, calls of several threads take turns, and what is no longer used is collected."""
import gc
import threading
import time
import weakref

import numpy as np
import pytest

import subadmm


def falling_box(**options):
    world = subadmm.World(**options)
    world.add_ground()
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=1000, position=(0, 0, 1), name="box")
    return world, box


def hinged():
    """A world with one object of each kind: (world, body, shape, joint, coupling, gear)."""
    world, box = falling_box()
    hinge = world.add_joint("revolute", None, box, position=(0, 0, 1))
    other = world.add_solid(subadmm.sphere(0.1), density=1000, position=(3, 0, 1))
    second = world.add_joint("revolute", None, other, position=(3, 0, 1))
    coupling = world.add_coupling(box, linear_stiffness=1.0)
    world.add_coupling(other, linear_stiffness=1.0)
    return world, box, world.shapes[1], hinge, coupling, world.add_gear(hinge, 5, second, 5)


# ---- arrays --------------------------------------------------------------------------------------------------------


def outs(rows, columns):
    """Arrays of the right size that are not what is asked for."""
    read_only = np.zeros((rows, columns))
    read_only.flags.writeable = False
    return {
        "float32": np.zeros((rows, columns), np.float32),
        "int64": np.zeros((rows, columns), np.int64),
        "complex": np.zeros((rows, columns), complex),
        "the other byte order": np.zeros((rows, columns), ">f8"),
        "every other column": np.zeros((rows, 2 * columns))[:, ::2],
        "Fortran order": np.zeros((rows, columns), order="F"),
        "reversed rows": np.zeros((rows, columns))[::-1],
        "a block of a larger one": np.zeros((rows, columns + 1))[:, :-1],
        "one axis": np.zeros(rows * columns),
        "three axes": np.zeros((rows, columns, 1)),
        "turned": np.zeros((columns, rows)),
        "more rows": np.zeros((rows + 1, columns)),
        "read only": read_only,
        "a list": [[0.0] * columns] * rows,
        "a number": 3,
    }


@pytest.mark.parametrize("array", ["body_state", "body_wrench", "body_contact_wrench", "body_inertia", "joint_position",
                                   "joint_target_speed", "coupling_target", "coupling_reaction"])
def test_out_is_filled_or_refused(array):
    world = hinged()[0]
    wanted = world.get(array)
    assert len(wanted) > 0 and wanted.flags.writeable
    for what, out in outs(*wanted.shape).items():
        before = np.copy(out)
        with pytest.raises(ValueError, match="out: must have shape"):
            world.get(array, out=out)
            raise AssertionError(f"{what} was taken")
        assert (np.asarray(out) == before).all(), what
    out = np.full(wanted.shape, np.nan)
    assert world.get(array, out=out) is out and (out == wanted).all()
    part = np.full((len(wanted) + 2, wanted.shape[1]), np.nan)
    assert world.get(array, out=part[1:-1]).base is part  # rows of a larger one have no gaps
    assert (part[1:-1] == wanted).all() and np.isnan(part[[0, -1]]).all()


def test_what_is_set_is_what_was_given():
    world, box = falling_box()
    state = world.get("body_state")
    state[1, :3] = 0.1, 0.2, 0.3
    for same in (state, state.tolist(), np.asfortranarray(state), np.repeat(state, 2, axis=1)[:, ::2],
                 state.astype(">f8")):
        world.set("body_state", np.where(np.arange(13) == 0, 5.0, world.get("body_state")))
        world.set("body_state", same)
        assert (world.get("body_state") == state).all()
    world.set("body_wrench", np.array([[1, 2, 3, 4, 5, 6]], np.int16), first=1)
    assert world.get("body_wrench")[1].tolist() == [1, 2, 3, 4, 5, 6]
    for wrong in (state.astype(complex), state.astype(str), state > 0, state.astype(object), None):
        with pytest.raises(TypeError):
            world.set("body_state", wrong)
    for wrong in (state[0], state[None], state[:, :12], [[1.0], [1.0, 2.0]]):
        with pytest.raises(ValueError, match="values"):
            world.set("body_state", wrong)
    assert (world.get("body_state") == state).all()


WRONG_POINTS = [np.zeros((3, 40)), np.zeros((30, 4)), np.zeros(30), np.zeros((10, 3, 1)), [[0, 0], [1, 1], [2, 2]]]


@pytest.mark.parametrize("points", WRONG_POINTS, ids=lambda points: str(np.shape(points)))
def test_points_are_rows_of_three(points):
    world, box = falling_box()
    for name, call in (
        ("points", lambda: subadmm.hull(points)),
        ("vertices", lambda: subadmm.mesh(points, [[0, 1, 2]])),
        ("vertices", lambda: subadmm.decompose((points, [[0, 1, 2]]))),
        ("origins", lambda: world.cast_rays(points, points)),
        ("directions", lambda: world.cast_rays(np.zeros((1, 3)), points)),
    ):
        with pytest.raises(ValueError, match=f"{name}: must have 3 columns of real numbers; is .* of shape"):
            call()
    with pytest.raises(TypeError, match="points"):
        subadmm.hull(np.zeros((9, 3), complex))
    with pytest.raises(ValueError, match="heights: must have rows and columns"):
        subadmm.heightfield(np.zeros(9), (1, 1))


@pytest.mark.parametrize("triangles, error, said", [
    ([[0.9, 1.9, 2.9]], TypeError, "whole numbers; is float64"),
    ([[0.0, 1.0, 2.0]], TypeError, "whole numbers; is float64"),
    ([[True, False, True]], TypeError, "whole numbers; is bool"),
    ([["0", "1", "2"]], TypeError, "whole numbers; is <U1"),
    ([[0, 1, 2**70]], TypeError, "whole numbers; is object"),
    (np.array([[0, 1, 2**32 + 2]]), ValueError, r"triangles\[0\]\[2\] = 4294967298: must be in \[0, 3\)"),
    (np.array([[0, 1, 2**63 + 1]], np.uint64), ValueError, r"= 9223372036854775809: must be in \[0, 3\)"),
    ([[0, 1, 2], [0, -1, 2]], ValueError, r"triangles\[1\]\[1\] = -1: must be in \[0, 3\)"),
    ([[0, 1, 2**31 - 1]], ValueError, r"= 2147483647: must be in \[0, 3\)"),
    ([0, 1, 2], ValueError, "3 columns"),
    ([[0, 1, 2, 0]], ValueError, "3 columns"),
])
def test_indices_are_whole_and_in_range(triangles, error, said):
    for make in (subadmm.mesh, lambda *mesh: subadmm.decompose(mesh)):
        with pytest.raises(error, match=said):
            make(np.eye(3), triangles)


def test_indices_of_any_width_are_the_same():
    for kind in (np.int8, np.uint8, np.int16, np.uint32, np.int64, np.uint64, ">i4"):
        assert subadmm.mesh(np.eye(3), np.array([[0, 1, 2]], kind)).geometry()[1].tolist() == [[0, 1, 2]]


# ---- numbers -------------------------------------------------------------------------------------------------------

WHOLE = {
    "n": lambda world, joint, x: world.step(x),
    "first": lambda world, joint, x: world.get("body_state", first=x),
    "count": lambda world, joint, x: world.get("body_state", count=x),
    "first of set": lambda world, joint, x: world.set("body_wrench", np.zeros((0, 6)), first=x),
    "capacity": lambda world, joint, x: world.record_events(x),
    "environment": lambda world, joint, x: world.add_body(type="static", environment=x),
    "device": lambda world, joint, x: world.set_backend("cpu", device=x),
    "device of World": lambda world, joint, x: subadmm.World(device=x),
    "device of scene": lambda world, joint, x: subadmm.scene("pyramid:2", device=x),
    "index": lambda world, joint, x: joint.coordinate(x),
    "index of set_coordinate": lambda world, joint, x: joint.set_coordinate(x, subadmm.Coordinate()),
    "index of set_target": lambda world, joint, x: joint.set_target(x, position=0.0),
    "index of set_spring_table": lambda world, joint, x: joint.set_spring_table(x, [], []),
    "key of coordinates": lambda world, joint, x: world.add_joint("spherical", None, world.bodies[1],
                                                                  coordinates={x: subadmm.Coordinate()}),
    "locks": lambda world, joint, x: world.add_joint("custom", None, world.bodies[1], locks=x),
    "coordinate_1": lambda world, joint, x: world.add_gear(joint, x, joint, 5),
    "coordinate_2": lambda world, joint, x: world.add_gear(joint, 5, joint, x),
    "category": lambda world, joint, x: subadmm.sphere(1, category=x),
    "mask": lambda world, joint, x: subadmm.sphere(1, mask=x),
    "category of rays": lambda world, joint, x: world.cast_rays([], [], category=x),
    "mask of rays": lambda world, joint, x: world.cast_rays([], [], mask=x),
    "id": lambda world, joint, x: world.find_body((x, 1)),
    "id of a shape": lambda world, joint, x: world.find_shape((1, x)),
    "iterations": lambda world, joint, x: subadmm.Settings(iterations=x),
    "threads": lambda world, joint, x: subadmm.scene("pyramid:2", settings={"threads": x}),
    "most": lambda world, joint, x: subadmm.decompose((np.eye(3), [[0, 1, 2]]), most=x),
    "seed": lambda world, joint, x: subadmm.decompose((np.eye(3), [[0, 1, 2]]), seed=x),
}


@pytest.mark.parametrize("name", WHOLE)
def test_whole_numbers_are_whole_and_of_their_size(name):
    """Floats, also numpy's and those that are whole, are no whole numbers; nor are texts. What is too large is said so,
    with the argument's name and value."""
    world, _, _, joint, _, _ = hinged()
    argument = name.split()[0]
    before = world.state_hash()
    for wrong in (1.0, 1.5, np.float32(1.5), np.float64(1), "1", (1, 1)):
        with pytest.raises(TypeError, match=f"{argument}.*[:;] must be a whole number"):
            WHOLE[name](world, joint, wrong)
    for wrong in (2**31 if argument not in ("category", "mask", "locks", "id", "n") else 2**32, 2**63, 2**70,
                  -(2**31) - 1):
        if argument == "n" and 0 <= wrong < 2**63:
            continue
        with pytest.raises(ValueError, match=f"{argument}.*{wrong}[:;] must be a whole number"):
            WHOLE[name](world, joint, wrong)
    assert world.state_hash() == before


def test_the_largest_counts_are_refused_without_memory_for_them():
    world, box = falling_box()
    most = 2**31 - 1
    for call, said in (
        (lambda: world.get("body_state", first=most), "first = 2147483647.*which has 2"),
        (lambda: world.get("body_state", count=most), "count = 2147483647.*which has 2"),
        (lambda: world.get("body_state", first=1, count=most, out=np.zeros((1, 13))),
         "count = 2147483647.*which has 2"),
        (lambda: world.set("body_state", world.get("body_state"), first=most), "first = 2147483647"),
        (lambda: world.record_events(most), r"capacity = 2147483647: must be in \[0, "),
        (lambda: setattr(world, "settings", subadmm.Settings(iterations=most)),
         r"iterations = 2147483647: must be in \[1, 1000000\]"),
        (lambda: subadmm.World(settings=subadmm.Settings(threads=most)),
         r"threads = 2147483647: must be in \[0, 1024\]"),
        (lambda: subadmm.scene("pile:2147483647"), r"N must be in \[1, "),
        (lambda: subadmm.scene("pile:3", settings={"substeps": most}), r"substeps = 2147483647: must be in \[1, 64\]"),
    ):
        with pytest.raises(subadmm.InvalidArgument, match=said):
            call()


VECTORS = {
    "position": lambda world, body, x: world.add_body(type="static", position=x),
    "inertia": lambda world, body, x: body.set_mass(1, x),
    "linear_velocity": lambda world, body, x: setattr(body, "linear_velocity", x),
    "force": lambda world, body, x: body.set_wrench(x),
    "torque": lambda world, body, x: body.set_wrench((0, 0, 0), x),
    "point": lambda world, body, x: body.add_force_at((0, 0, 0), x),
    "impulse": lambda world, body, x: body.apply_impulse_at(x, (0, 0, 0)),
    "lowest": lambda world, body, x: world.overlap_box(x, (9, 9, 9)),
    "position of overlap": lambda world, body, x: world.overlap(subadmm.sphere(1), x),
    "position of closest_to": lambda world, body, x: world.closest_to(subadmm.sphere(1), world.shapes[1], x),
    "position_a": lambda world, body, x: world.add_joint("fixed", None, body, position_a=x),
    "target_position": lambda world, body, x: world.add_coupling(body, target_position=x),
    "position of a shape": lambda world, body, x: subadmm.sphere(1, position=x),
    "gravity": lambda world, body, x: subadmm.Settings(gravity=x),
}


@pytest.mark.parametrize("name", VECTORS)
def test_vectors_have_as_many_numbers_as_they_have(name):
    world, box = falling_box()
    for wrong in ((0, 1), (0, 1, 2, 3), 3, "123", ("0", "1", "2"), np.zeros((3, 1)), np.zeros((1, 3)), np.ones(3) * 1j,
                  {1, 2, 3}, {0: 1, 1: 2, 2: 3}, (0, 1, None), [[0], [1], [2]]):
        with pytest.raises(TypeError, match=f"{name.split()[0]} = (.|\n)*: must be 3 numbers"):
            VECTORS[name](world, box, wrong)
    assert world.body_count == 2 and not world.joints and not world.couplings
    VECTORS[name](world, box, np.array([1, 1, 1], np.float32))
    VECTORS[name](world, box, [np.float64(1), True, 1])


def test_texts_have_no_end_within():
    world = subadmm.World()
    for call in (lambda: world.add_body(type="static", name="a\0b"), lambda: world.to_json("a\0b"),
                 lambda: world.to_json(description="a\0b"), lambda: subadmm.scene("pyramid:2\0:3")):
        with pytest.raises(ValueError, match=r"= '.*\\x00.*': must have no null character"):
            call()
    assert world.body_count == 0


@pytest.mark.parametrize("call, said", [
    (lambda: subadmm.World(settings=3), "settings = 3: must be a subadmm.Settings"),
    (lambda: subadmm.World(settings={"dt": 0.1}), "settings = {'dt': 0.1}: must be a subadmm.Settings"),
    (lambda: setattr(subadmm.World(), "settings", 3), "settings = 3: must be a subadmm.Settings"),
    (lambda: subadmm.load("none.xml", settings=3), "settings = 3: must be a subadmm.Settings"),
    (lambda: subadmm.load("none.usda", settings=3), "settings = 3: must be a subadmm.Settings"),
    (lambda: subadmm.scene("pyramid:2", settings=3), "settings = 3: must be a dict of changes"),
    (lambda: subadmm.scene("pyramid:2", settings={"dt": "a"}), "dt = 'a': must be of type float"),
    (lambda: subadmm.scene("pyramid:2", settings={3: 1}), "name of a member = 3: must be a string"),
    (lambda: subadmm.Settings(warm_start=3), "warm_start = 3: must be of type bool"),
    (lambda: subadmm.Coordinate(lower="a"), "lower = 'a': must be of type float"),
    (lambda: subadmm.sphere(1, friction="a"), "friction = 'a': must be of type float"),
    (lambda: subadmm.World().add_joint("spherical", coordinates={5: 3}),
     r"coordinates\[5\] = 3: must be a subadmm.Coordinate"),
    (lambda: subadmm.World().add_solid([None], mass=1), r"shapes\[0\] = None: must be a subadmm.Shape"),
    (lambda: subadmm.World().add_solid(3), "shapes = 3: must be a subadmm.Shape"),
    (lambda: subadmm.World().add_body(shapes=[subadmm.sphere(1), 3]), r"shapes\[1\] = 3: must be a subadmm.Shape"),
    (lambda: subadmm.World().add_solid(subadmm.sphere(1), mass="1"), "mass: '1'; must be a number in"),
    (lambda: subadmm.mass_of([None], 1.0), r"shapes\[0\] = None: must be a subadmm.Shape"),
    (lambda: subadmm.World().find_body(3), r"id = 3: must be \(slot, generation\)"),
    (lambda: subadmm.World().to_json(duration="x"), "duration: 'x'; must be a number"),
    (lambda: subadmm.decompose(3), "mesh: must be a Shape, a pair"),
])
def test_other_types_are_named(call, said):
    with pytest.raises(TypeError, match=said):
        call()


def test_other_values_are_named():
    world = subadmm.World()
    for duration in (np.nan, np.inf, -1, 1e10):
        with pytest.raises(ValueError, match=rf"duration: {duration}; must be a number in \[0, 1e\+09\]"):
            world.to_json(duration=duration)
    with pytest.raises(ValueError, match="mass: -1; must be a number in"):
        world.add_solid(subadmm.sphere(1), mass=-1)
    for type, size in (("sphere", [1, 2]), ("box", [1]), ("plane", [1]), ("capsule", [1, 2, 3])):
        with pytest.raises(ValueError, match="size: must have"):
            subadmm.Shape(type, size)


# ---- objects of other worlds ---------------------------------------------------------------------------------------


def test_objects_are_of_their_world():
    world, body, shape, joint, _, _ = hinged()
    _, other_body, other_shape, other_joint, _, _ = hinged()
    before = world.save()
    for name, call in (
        ("body", lambda: world.add_coupling(other_body, linear_stiffness=1)),
        ("a", lambda: world.add_joint("fixed", other_body, body)),
        ("b", lambda: world.add_joint("fixed", body, other_body)),
        ("joint_1", lambda: world.add_gear(other_joint, 5, joint, 5)),
        ("joint_2", lambda: world.add_gear(joint, 5, other_joint, 5)),
        ("other", lambda: body.ignore(other_body)),
        ("other", lambda: body.ignore(other_body, False)),
        ("other", lambda: shape.set_pair_friction(other_shape, 0.1)),
        ("ignore", lambda: world.cast_rays([[0, 0, 5]], [[0, 0, -1]], ignore=other_body)),
        ("a", lambda: world.closest_points(other_shape, shape)),
        ("b", lambda: world.closest_points(shape, other_shape)),
        ("other", lambda: world.closest_to(subadmm.sphere(1), other_shape)),
        ("sensor", lambda: world.sensor_overlaps(other_shape)),
    ):
        with pytest.raises(subadmm.InvalidArgument, match=f"^{name} = <.*>: must be of this world"):
            call()
    assert world.save() == before
    assert body != other_body and len({body, other_body}) == 2


# ---- what fails leaves nothing behind ------------------------------------------------------------------------------


def test_what_fails_leaves_nothing_behind():
    world, box = falling_box()
    good, bad = subadmm.box(1, 1, 1), subadmm.box(-1, 1, 1)
    mesh = subadmm.mesh(np.eye(3), [[0, 1, 2]])
    before = world.to_json()
    for call, error in (
        (lambda: world.add_ground(friction=-1), subadmm.InvalidArgument),
        (lambda: world.add_ground(height=np.nan), subadmm.InvalidArgument),
        (lambda: world.add_solid([good, bad], type="static"), subadmm.InvalidArgument),
        (lambda: world.add_solid([good, bad], type="kinematic"), subadmm.InvalidArgument),
        (lambda: world.add_solid([good, 3], type="static"), TypeError),
        (lambda: world.add_solid([good, subadmm.plane()], type="kinematic"), subadmm.InvalidArgument),
        (lambda: world.add_solid([good, subadmm.box(1, 1, 1, friction=-1)], density=1), subadmm.InvalidArgument),
        (lambda: world.add_solid([good, subadmm.box(1, 1, 1, sensor=True, restitution=2)], density=1),
         subadmm.InvalidArgument),
        (lambda: world.add_body(mass=1, inertia=(1, 1, 1), shapes=[good, mesh]), subadmm.InvalidArgument),
        (lambda: world.add_body(mass=-1, inertia=(1, 1, 1), shapes=[good]), subadmm.InvalidArgument),
        (lambda: world.add_joint("revolute", None, box, position=(0, 0, 1),
                                 coordinates={0: subadmm.Coordinate(friction=1)}),
         subadmm.InvalidArgument),
        (lambda: world.add_coupling(box, linear_stiffness=-1), subadmm.InvalidArgument),
    ):
        with pytest.raises(error):
            call()
        assert world.to_json() == before and world.body_count == 2 and world.shape_count == 2
    with pytest.raises(subadmm.InvalidArgument, match=r"^shapes\[1\]: def->size\[0\] = -1"):
        world.add_solid([good, bad], type="static")
    with pytest.raises(subadmm.InvalidArgument, match=r"^def->friction = -1"):
        world.add_ground(friction=-1)
    assert len(world.add_body(type="static", shapes=(good, good)).world.shapes) == 4


def test_nobody_sees_half_a_body():
    """Beside a thread that adds bodies whose last shape is refused, another one never sees any of them."""
    world, box = falling_box()
    shapes, seen = [subadmm.sphere(1)] * 20 + [subadmm.box(-1, 1, 1)], set()

    def add():
        with pytest.raises(subadmm.InvalidArgument):
            world.add_body(type="static", shapes=shapes)

    together(add, lambda: seen.update((world.body_count, world.shape_count)))
    assert seen == {2}


# ---- names ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("letter", ["n", "é", "€", "😀"])
@pytest.mark.parametrize("before", range(4))
def test_names_are_cut_at_characters(letter, before):
    world = subadmm.World()
    name = "x" * before + letter * 70
    body = world.add_body(type="static", name=name)
    whole = "x" * before + letter * ((63 - before) // len(letter.encode()))
    assert body.name == whole
    text = world.to_json()
    assert subadmm.scene_from_json(text).bodies[0].name == whole
    other = subadmm.World()
    other.restore(world.save())
    assert other.bodies[0].name == whole


@pytest.mark.parametrize("letter", ["é", "€", "😀"])
def test_messages_are_texts_wherever_they_are_cut(letter):
    for before in range(4):
        name = "x" * before + letter * 300
        with pytest.raises(subadmm.InvalidArgument, match=f'scene = "{name[:3]}'):
            subadmm.scene(name)
        with pytest.raises(subadmm.FileError, match=name[:3]):
            subadmm.scene(f"/none/{name}.json")
        with pytest.raises(subadmm.InvalidArgument, match="settings"):
            subadmm.scene_from_json('{"format": "subadmm scene", "format_version": 1, "settings": "%s"}' % name)


# ---- threads -------------------------------------------------------------------------------------------------------


def together(*functions, seconds=0.5):
    """Run functions over and over in threads of their own; what one of them raises is raised here."""
    end, errors = time.monotonic() + seconds, []

    def run(function):
        try:
            while time.monotonic() < end and not errors:
                function()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(function,)) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


def test_names_are_read_while_the_world_is_restored():
    world = subadmm.World()
    for k in range(30):
        world.add_body(mass=1, inertia=(1, 1, 1), name=f"body with a name {k}")
    saved, bodies = world.save(), world.bodies
    names = {f"body with a name {k}" for k in range(30)}
    seen = set()
    together(lambda: seen.update(body.name for body in bodies), lambda: world.restore(saved),
             lambda: seen.update(body.name for body in world.bodies))
    assert seen <= names and seen


def test_lists_and_arrays_are_of_one_moment():
    """Of worlds of 3 and of 40 bodies in turn."""
    saved = []
    for count in (3, 40):
        world = subadmm.World()
        for k in range(count):
            world.add_solid(subadmm.sphere(0.1), density=1, position=(k, 0, 0))
        saved.append(world.save())
    turns = iter(range(10**9))

    def look():
        assert len(world.bodies) in (3, 40) and len(world.shapes) in (3, 40)
        assert len(world.get("body_state")) in (3, 40) and len(world.positions) in (3, 40)

    together(look, look, lambda: world.restore(saved[next(turns) % 2]))


def test_what_two_threads_set_is_set():
    """Each sets one part of a state, or of a coordinate, which is read and set as a whole."""
    world, box = falling_box()
    hinge = world.add_joint("revolute", None, box, position=(0, 0, 1),
                            coordinates={5: subadmm.Coordinate(drive="position", drive_stiffness=1.0)})
    count = {"linear": 0, "angular": 0, "position": 0, "speed": 0}

    def linear():
        count["linear"] += 1
        box.linear_velocity = (count["linear"], 0, 0)
        assert box.linear_velocity[0] == count["linear"]

    def angular():
        count["angular"] += 1
        box.angular_velocity = (count["angular"], 0, 0)
        assert box.angular_velocity[0] == count["angular"]

    def position():
        count["position"] += 1
        hinge.set_target(5, position=count["position"])
        assert hinge.coordinate(5).target_position == count["position"]

    def speed():
        count["speed"] += 1
        hinge.set_target(5, speed=count["speed"])
        assert hinge.coordinate(5).target_speed == count["speed"]

    together(linear, angular, seconds=0.3)
    together(position, speed, seconds=0.3)


# ---- garbage -------------------------------------------------------------------------------------------------------


class Tag:
    pass


@pytest.mark.parametrize("kind", ["body", "shape", "joint", "coupling", "gear", "list", "method", "rows"])
def test_worlds_that_hold_their_own_objects_are_collected(kind):
    class Env(subadmm.World):
        pass

    def make():
        world = Env()
        arm = world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=1, position=(0, 0, 1))
        arm_2 = world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=1, position=(1, 0, 1))
        hinge, second = (world.add_joint("revolute", None, body, position=body.position) for body in (arm, arm_2))
        held = {
            "body": lambda: arm,
            "shape": lambda: world.shapes[0],
            "joint": lambda: hinge,
            "coupling": lambda: world.add_coupling(arm),
            "gear": lambda: world.add_gear(hinge, 5, second, 5),
            "list": lambda: {"bodies": world.bodies, "joints": tuple(world.joints)},
            "method": lambda: arm.set_wrench,
            "rows": lambda: world.get("body_state"),
        }[kind]()
        world.held, world.tag = held, Tag()
        return weakref.ref(world.tag), weakref.ref(world)

    gc.collect()
    refs = [ref for _ in range(5) for ref in make()]
    gc.collect()
    assert not any(ref() is not None for ref in refs)


def test_objects_keep_their_world():
    class Env(subadmm.World):
        pass

    def make():
        world = Env()
        world.add_ground()
        return world.add_solid(subadmm.sphere(0.1), density=1, position=(0, 0, 1)), weakref.ref(world)

    body, world = make()
    gc.collect()
    assert world() is body.world and body.position == [0, 0, 1]
    world().step(10)
    assert body.position[2] < 1
    del body
    gc.collect()
    assert world() is None


def test_finalizers_in_a_cycle_find_the_world_as_it_was():
    found = []

    class Env(subadmm.World):
        def __del__(self):
            found.append(self.body.position)

    def make():
        world = Env()
        world.body = world.add_solid(subadmm.sphere(0.1), density=1, position=(0, 0, 1))

    make()
    gc.collect()
    assert found == [[0, 0, 1]]


# ---- files ---------------------------------------------------------------------------------------------------------


def test_arguments_of_load_are_named(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "a.xml"
    path.write_text('<mujoco><worldbody><body><freejoint/><geom size=".1"/></body></worldbody>'
                    '<keyframe><key qpos="0 0 1 1 0 0 0"/><key qpos="0 0 2 1 0 0 0"/></keyframe></mujoco>')
    assert subadmm.load(path, keyframe=np.int64(1)).world.positions[0].tolist() == [0, 0, 2]
    for options, error, said in (
        (dict(keyframe=1.9), TypeError, "keyframe: 1.9; must be a whole number"),
        (dict(keyframe=2**31 - 1), ValueError, "keyframe: 2147483647 is none of the file's"),
        (dict(keyframe=-1), ValueError, "keyframe: -1 is none of the file's"),
        (dict(qpos=np.ones(7) * 1j), ValueError, "qpos: must be 7 finite numbers"),
        (dict(qpos=[0, 0, np.nan, 1, 0, 0, 0]), ValueError, "qpos: must be 7 finite numbers"),
        (dict(qvel=np.zeros((6, 1))), ValueError, "qvel: must be 6 finite numbers"),
        (dict(carrier_share=np.nan), ValueError, r"carrier_share: nan; must be a number in \[1e-06, 0.1\]"),
        (dict(carrier_share="a"), TypeError, "carrier_share: 'a'; must be a number"),
        (dict(decompose=2), ValueError, r"decompose: 2; must be a number in \[0.01, 1\]"),
        (dict(decompose="a"), TypeError, "decompose: 'a'; must be a number"),
        (dict(device=2**31), subadmm.InvalidArgument, "device = 2147483648: must be a whole number"),
    ):
        with pytest.raises(error, match=said):
            subadmm.load(path, **options)
    for threshold in (np.nan, np.inf, 0, 2):
        with pytest.raises(ValueError, match=f"threshold: {threshold}; must be a number in"):
            subadmm.decompose((np.eye(3), [[0, 1, 2]]), threshold=threshold)
