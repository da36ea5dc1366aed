"""Names and user data of all objects of a world; what debug_draw gives."""
import gc
import weakref

import numpy as np
import pytest

import subadmm


class Thing:
    """What can be looked at weakly."""


def machine():
    """A world with an object of every kind that has a name."""
    world = subadmm.World()
    skin = subadmm.sphere(0.1)
    skin.name = "skin"
    wheel = world.add_solid(skin, mass=1, name="wheel")
    pinion = world.add_solid(subadmm.sphere(0.1), mass=1, position=(1, 0, 0), name="pinion")
    axle = world.add_joint("revolute", None, wheel, name="axle")
    shaft = world.add_joint("revolute", None, pinion, position=(1, 0, 0), name="shaft")
    gear = world.add_gear(axle, 5, shaft, 5, name="mesh")
    hand = world.add_coupling(wheel, linear_stiffness=1, name="hand")
    return world, {"body": wheel, "shape": world.shapes[0], "joint": axle, "gear": gear, "coupling": hand}


def test_names():
    world, made = machine()
    assert {kind: one.name for kind, one in made.items()} == {
        "body": "wheel", "shape": "skin", "joint": "axle", "gear": "mesh", "coupling": "hand"}
    assert world.shape("skin") == made["shape"] and world.joint("axle") == made["joint"]
    assert world.gear("mesh") == made["gear"] and world.coupling("hand") == made["coupling"]
    assert world["wheel"] == made["body"]
    assert made["shape"].definition.name == "skin" and world.shapes[1].name == ""
    for one in made.values():
        assert one.name in repr(one)
    with pytest.raises(KeyError, match="is it 'shaft'"):
        world.joint("shafts")
    with pytest.raises(TypeError, match="must be a string; gears by their rows are World.gears"):
        world.gear(0)
    world.add_joint("fixed", None, world["pinion"], name="axle")
    with pytest.raises(ValueError, match="2 joints have it"):
        world.joint("axle")
    with pytest.raises(ValueError, match="name"):
        world.add_joint("fixed", None, world["pinion"], name="a\0b")


def test_names_are_kept():
    world, _ = machine()
    for other in (world.clone(), subadmm.scene_from_json(world.to_json())):
        assert other.joint("shaft").name == "shaft" and other.shape("skin").name == "skin"
        assert other.coupling("hand").body.name == "wheel" and other.gear("mesh").name == "mesh"


def test_a_definition_keeps_its_name():
    shape = subadmm.box(1, 1, 1)
    assert shape.name == ""
    shape.name = "crate"
    other = shape.copy()
    other.name = "lid"
    assert shape.name == "crate"
    world = subadmm.World()
    body = world.add_solid([shape, other], mass=1)
    assert [one.name for one in world.shapes] == ["crate", "lid"]
    assert body.add_shape(shape).name == "crate"
    with pytest.raises(ValueError, match="copy"):
        world.shapes[0].definition.name = "other"


def test_user_data():
    world, made = machine()
    for kind, one in made.items():
        assert one.user_data is None
        one.user_data = [kind]
    world.step(2)
    for kind, one in made.items():
        assert one.user_data == [kind]
    made["joint"].user_data.append(1)
    assert world.joint("axle").user_data == ["joint", 1]
    made["joint"].user_data = None
    assert world.joint("axle").user_data is None and made["gear"].user_data == ["gear"]


def test_user_data_by_what_names_the_shape():
    world, made = machine()
    made["shape"].user_data = "red"
    hit = world.cast_rays([(0, 0, 5)], [(0, 0, -1)])
    assert world.shapes[hit["shape"][0]].user_data == "red"
    world.add_solid(subadmm.sphere(0.1), mass=1, position=(0, 0, 0.19))
    world.step()
    contact = world.contacts()[0]
    assert "red" in [world.find_shape(contact[key]).user_data for key in ("shape_a", "shape_b")]


def test_user_data_of_what_is_gone():
    world, made = machine()
    thing = Thing()
    made["body"].user_data = thing
    made["body"].remove()
    with pytest.raises(subadmm.StaleId):
        made["body"].user_data
    with pytest.raises(subadmm.StaleId):
        made["body"].user_data = 1
    with pytest.raises(subadmm.StaleId):
        made["coupling"].name
    new = world.add_solid(subadmm.sphere(0.1), mass=1)  # in the same slot
    assert new.user_data is None
    seen = weakref.ref(thing)
    del thing
    for k in range(200):  # as much again has come: what nobody can reach is let go
        new.user_data = Thing()
    for _ in range(100):
        world.add_solid(subadmm.sphere(0.1), mass=1).user_data = Thing()
    assert seen() is None


def test_one_that_is_replaced_is_let_go():
    world, made = machine()
    thing = Thing()
    seen = weakref.ref(thing)
    made["gear"].user_data = thing
    del thing
    assert seen() is not None
    made["gear"].user_data = 1
    assert seen() is None


def test_user_data_and_copies():
    world, made = machine()
    made["shape"].user_data = thing = Thing()
    made["coupling"].user_data = "pull"
    other = world.clone()
    assert other.shape("skin").user_data is thing and other.coupling("hand").user_data == "pull"
    other.shape("skin").user_data = None
    assert made["shape"].user_data is thing
    state = world.save()
    world.step(3)
    world.restore(state)
    assert made["shape"].user_data is thing  # the same object is there
    fresh = subadmm.World()
    fresh.restore(state)
    assert fresh.shape("skin").user_data is None


def test_a_world_with_itself_inside_is_collected():
    world, made = machine()
    seen = weakref.ref(world)
    made["body"].user_data = world
    made["joint"].user_data = {"of": made["body"]}
    del world, made
    gc.collect()
    assert seen() is None


# ---- drawing ------------------------------------------------------------------------------------------------------------


def test_debug_draw():
    world, _ = machine()
    world.add_ground(height=-0.1)
    world.step(2)
    shapes = world.debug_draw()
    count = 2 * 24 * 22 + 2
    assert shapes["triangles"].shape == (count, 3, 3) and shapes["triangle_normals"].shape == (count, 3)
    assert shapes["lines"].shape == (0, 2, 3) and shapes["triangle_colours"].dtype == np.uint32
    ball = shapes["triangles"][:24 * 22].reshape(-1, 3)
    assert np.linalg.norm(ball - world["wheel"].position, axis=1) == pytest.approx(0.1, abs=1e-12)
    all_of_it = world.debug_draw(["joints", "names", "contacts", "centres"])
    assert sorted(text for text, _ in all_of_it["texts"]) == [
        "axle", "ground", "pinion", "shaft", "skin", "wheel"]
    assert len(all_of_it["points"]) == 2 + world.report.contacts
    assert len(world.debug_draw(["edges"], segments=8)["lines"]) == 2 * 3 * 8 + 22
    with pytest.raises(ValueError, match="what = .*must have names of 'shapes', 'edges'"):
        world.debug_draw(["shape"])
    with pytest.raises(TypeError, match="must be a sequence of names"):
        world.debug_draw("shapes")
    with pytest.raises(subadmm.InvalidArgument, match="segments = 6: must be a multiple of 4"):
        world.debug_draw(segments=6)
