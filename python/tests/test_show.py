"""Meshes, pictures and recordings of worlds."""
import base64
import json
import re
import struct
import zlib

import numpy as np
import pytest

import subadmm
from browser import decoded
from subadmm import show
from subadmm.__main__ import main
from subadmm.show import packing, page, png, recording
from subadmm.show.session import Session

try:
    TETRAHEDRON = subadmm.hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    ROUNDED = subadmm.hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], convex_radius=0.1)
except subadmm.Unavailable:
    TETRAHEDRON = ROUNDED = None

SHAPES = [
    subadmm.sphere(0.3),
    subadmm.capsule(0.2, 0.5),
    subadmm.box(0.1, 0.2, 0.3),
    subadmm.cylinder(0.3, 0.2),
    subadmm.cone(0.3, 0.2),
    subadmm.ellipsoid(0.1, 0.2, 0.4),
] + [shape for shape in (TETRAHEDRON, ROUNDED) if shape]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.type)
def test_meshes_are_closed_and_have_the_volume_of_the_solid(shape):
    exact = subadmm.mass_of([shape], 1.0).mass
    off = []
    for detail in (24, 96):
        mesh = show.mesh_of(shape, detail=detail)
        assert mesh.is_closed()
        off.append(1 - mesh.volume() / exact)
    # Inscribed: never more than the solid. A circle of 24 corners lacks 1.2 % of its area, a ball twice that; four
    # times the corners lack a sixteenth.
    assert -1e-9 <= off[1] <= off[0] + 1e-9 and off[0] < 0.04 and off[1] < 0.004
    normals = mesh.corner_normals()
    assert np.allclose(np.linalg.norm(normals, axis=2), 1)
    assert (np.einsum("tkj,tj->tk", normals, mesh.triangle_normals()) > 0.8).all()


def test_meshes_of_meshes_are_their_own_and_planes_are_patches():
    mesh = show.mesh_of(subadmm.box(1, 2, 3))
    again = show.mesh_of(subadmm.mesh(mesh.vertices, mesh.triangles))
    assert again.is_closed() and again.volume() == pytest.approx(48)
    field = show.mesh_of(subadmm.heightfield(np.zeros((3, 4)), (0.5, 0.5)))
    assert (field.triangle_normals() == [0, 0, 1]).all() and not field.is_closed()
    patch = show.mesh_of(subadmm.plane(), patch=4)
    assert np.ptp(patch.vertices, axis=0).tolist() == [8, 8, 0] and (patch.triangle_normals() == [0, 0, 1]).all()
    with pytest.raises(ValueError, match="detail: 3"):
        show.mesh_of(subadmm.sphere(1), detail=3)


def test_descriptions_have_one_group_for_a_form():
    world = subadmm.scene("mixed_pile:20")
    description = show.describe(world)
    moving = [group for group in description.groups if description.dynamic[group.body].any()]
    assert len(moving) == 1 and len(np.unique(moving[0].scale[:, 0])) > 1
    dolls = show.describe(subadmm.scene("ragdolls:2"))
    colours = np.concatenate([group.colour[dolls.dynamic[group.body]] for group in dolls.groups])
    assert len(colours) == 22
    # A doll is of one colour, up to lighter and darker.
    hues = np.unique(np.round(colours / colours.max(axis=1, keepdims=True), 3), axis=0)
    assert len(hues) == 2


def test_sensors_are_not_drawn():
    world = subadmm.World()
    body = world.add_solid([subadmm.sphere(0.1), subadmm.box(3, 3, 3, sensor=True)], density=1)
    groups = show.describe(world).groups
    assert len(groups) == 1 and len(groups[0].body) == 1 and groups[0].body[0] == body.index


def coloured(*triangles):
    """A picture, 32 x 32, straight down from 10 m on a square of 2 m, of triangles: (corners, colour)."""
    canvas, one = subadmm._core._Canvas(), np.ones((1, 3))
    for corners, colour in triangles:
        canvas.add(np.array(corners, np.float32), np.array([[0, 1, 2]], np.int32),
                   np.tile([0, 0, 1], (1, 3)).astype(np.float32), np.zeros(1, np.int32), np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), one,
                   np.array([[*colour, 1]], np.float32), False, None, None)
    light = np.array([[0.0, 0, 0], [1, 1, 1], [1, 1, 1], [0, 0, 0]])
    return canvas.draw(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), np.zeros(len(triangles), np.uint8), [0.0] * 3,
                       [0.0, 0, 10], [0.0] * 3, np.eye(3), 160.0, 0.1, 2.0, [0.0, 0, 1], light, 32, 32, 1, 64, 0, 1)


def test_the_nearest_triangle_is_seen_and_triangles_that_share_an_edge_leave_no_gap():
    far = [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[-1, -1, 0], [1, -1, 0], [1, 1, 0]]
    near = [[-0.5, -0.5, 0.1], [0.5, 0.5, 0.1], [-0.5, 0.5, 0.1]]
    red, green, blue = np.eye(3)
    image = coloured((far[0], red), (near, green), (far[1], red), (near[::-1], blue))
    assert ((image > 100).sum(axis=2) == 1).all() and not image[..., 2].any()     # from behind nothing is seen
    assert image[8, 8, 0] == 0 and image[12, 10, 1] == 255 and image[24, 24, 0] == 255 and image[1, 30, 0] == 255


def test_png_files_have_the_pixels():
    pixels = np.random.default_rng(3).integers(0, 256, (13, 17, 3)).astype(np.uint8)
    assert (decoded(png.png_of(pixels)) == pixels).all()


def test_pictures_show_the_scene_and_are_the_same_every_time(tmp_path):
    world = subadmm.scene("pile:30", backend="cpu")
    first = show.picture(world, 160, 100)
    assert first.shape == (100, 160, 3) and (first == show.picture(world, 160, 100)).all()
    # Boxes are colourful, the ground and the backdrop are grey.
    assert (np.ptp(first.astype(int), axis=2) > 40).mean() > 0.05 and np.ptp(
        first[:, :5].astype(int), axis=2
    ).max() < 20
    world.step(20)
    assert (first != show.picture(world, 160, 100)).any()
    out = tmp_path / "a.png"
    assert main(["picture", "pile:30", "--steps", "20", "--backend", "cpu", "--size", "160x100", "--threads", "1",
                 "-o", str(out)]) == 0
    assert (decoded(out.read_bytes()) == show.picture(world, 160, 100)).all()


def test_a_ball_is_lit_from_the_sun_and_throws_a_shadow():
    world = subadmm.World()
    world.add_ground()
    world.add_solid(subadmm.sphere(1), density=1, position=(0, 0, 1))
    ball = show.picture(world, 200, 160, show.Camera(np.array([0.0, -0.01, 12]), np.array([0.0, 0, 0])), smooth=1).sum(
        axis=2
    )
    # From above, x to the right: the sun comes from the left and below, the shadow lies to the right and above.
    assert ball[90:100, 80:90].mean() > ball[60:70, 110:120].mean() + 60
    assert ball[110, 80] > ball[50, 120] + 150


def test_what_is_wrong_is_said(tmp_path, capsys):
    world = subadmm.World()
    description = show.describe(world)
    for call, said in [
        (lambda: show.picture(world, width=4), "width: 4"),
        (lambda: show.record(world, 0), "seconds: 0"),
        (lambda: show.record(world, 1, fps=-1), "fps: -1"),
        (lambda: show.record(world, 1, contacts=-1), "contacts: -1"),
        (lambda: show.record(world, 1).save("x.txt"), "x.txt"),
        (lambda: show.picture(world, height=2**31 - 1), "height: 2147483647; must be a whole number in \\[16, 8192\\]"),
        (lambda: show.picture(world, smooth=5), "smooth: 5"),
        (lambda: show.record(world, np.inf), "seconds: inf; must be a number in \\(0, 1e\\+09\\]"),
        (lambda: show.record(world, np.nan), "seconds: nan"),
        (lambda: show.record(world, 1e9, fps=1000), "must be 10000000 at most"),
        (lambda: show.record(world, 1, fps=np.nan), "fps: nan"),
        (lambda: show.record(world, 1, contacts=2**31), "contacts: 2147483648"),
        (lambda: show.looking_at(description, azimuth=np.inf), "azimuth: inf; must be a number in \\[-3600, 3600\\]"),
        (lambda: show.looking_at(description, elevation=np.nan), "elevation: nan"),
        (lambda: show.looking_at(description, zoom=np.inf), "zoom: inf; must be a number in \\[0.001, 1000\\]"),
        (lambda: show.looking_at(description, field=0), "field: 0"),
        (lambda: show.Camera((0, 0, np.nan), (0, 0, 0)), "eye: .*; must be 3 finite numbers"),
        (lambda: show.Camera((0, 0, 1), (0, 0, 1)), "eye: .*; must be apart from the target"),
        (lambda: show.Camera((0, 0, 1), (0, 0, 0), np.inf), "field: inf"),
        (lambda: show.mesh_of(subadmm.sphere(1), detail=2**31 - 1), "detail: 2147483647; must be a whole number in"),
        (lambda: show.mesh_of(subadmm.plane(), patch=np.inf), "patch: inf"),
    ]:
        with pytest.raises(ValueError, match=said):
            call()
    for call, said in [
        (lambda: show.picture(world, width=960.0), "width: 960.0; must be a whole number"),
        (lambda: show.picture(world, camera=3), "camera: 3; must be a Camera"),
        (lambda: show.looking_at(description, azimuth="a"), "azimuth: 'a'; must be a number"),
        (lambda: show.record(world, "1"), "seconds: '1'; must be a number"),
        (lambda: show.record(world, 1, contacts=1.5), "contacts: 1.5; must be a whole number"),
        (lambda: show.Camera((0, 1), (0, 0, 0)), "eye: .*; must be 3 numbers"),
    ]:
        with pytest.raises(TypeError, match=said):
            call()
    for arguments, status, said in [
        (["picture", "nothing", "-o", "a.png"], 2, "nothing"),
        (["picture", "pile:3", "-o", "a.gif"], 2, "a.gif"),
        (["record", "pile:3", "-o", str(tmp_path / "no" / "a.html"), "--steps", "1"], 1, "no"),
        (["picture", "pile:3", "-o", "a.png", "--size", "4"], 2, "--size: 4"),
        (["picture", "pile:3", "-o", "a.png", "--threads", "1025"], 2, "--threads: 1025; must be a whole number"),
    ]:
        assert main(arguments) == status
        assert said in capsys.readouterr().err


def test_recordings_have_the_poses_of_the_world():
    made, again = (subadmm.scene("ragdolls:2", backend="cpu") for _ in range(2))
    taken = show.record(made, 0.5, fps=30)
    dt = again.settings.dt
    assert (
        len(taken.times) == 16 and taken.times[0] == 0 and abs(taken.times - np.arange(16) / 30).max() <= dt / 2 + 1e-12
    )
    done = 0
    for k, time in enumerate(taken.times):
        again.step(round(time / dt) - done)
        done = round(time / dt)
        places, turns = taken.poses(k)
        assert abs(places - again.positions).max() <= taken.position_step / 2 * (1 + 1e-9)
        same = abs(np.einsum("ij,ij->i", turns, again.orientations))
        assert (2 * np.arccos(np.minimum(same, 1))).max() < 5e-4
    assert taken.measures["kinetic"][-1] > 0 and "error" not in taken.measures


def test_kinetic_energy_is_that_of_the_bodies():
    world = subadmm.World()
    world.add_body(
        mass=2,
        inertia=(1, 2, 3),
        orientation=(0.5, 0.5, 0.5, 0.5),
        linear_velocity=(0, 3, 4),
        angular_velocity=(0, 0, 2),
    )
    # The turn takes the body's y axis to the world's z axis.
    assert show.measures.measure(world)["kinetic"] == pytest.approx(0.5 * 2 * 25 + 0.5 * 2 * 4)


def read_page(text):
    """What the page's script reads: (header, data)."""
    header = json.loads(re.search(r'id="header">(.*?)</script>', text, re.S).group(1))
    return header, zlib.decompress(base64.b64decode(re.search(r'id="data">(.*?)</script>', text, re.S).group(1)))


def test_pages_have_all_of_a_recording_and_nothing_from_elsewhere():
    taken = show.record(subadmm.scene("pile:20", backend="cpu"), 0.4, title="<pile> & co")
    text = page.page_of(taken)
    assert (
        "&lt;pile&gt;" in text
        and "<pile>" not in text
        and not re.search(r"(src|href)=\"(?!data:)|https?://|import ", text)
    )
    header, data = read_page(text)
    assert header["title"] == "<pile> & co" and header["frames"] == len(taken.times)
    for name, values in (("positions", taken.positions), ("turns", taken.orientations)):
        kind, at, count = header[name]
        assert kind == "u8"
        assert (packing.unpacked(data[at:at + count], *values.shape) == values).all()


def test_ten_seconds_of_2000_bodies_are_less_than_10_megabytes():
    """Of bodies that tumble all the time; those that come to rest take a fifth of it."""
    world = subadmm.World()
    for k in range(2000):
        world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=1000, position=(k % 50, k // 50, 1))
    description = show.describe(world)
    random = np.random.default_rng(1)
    frames = 301
    speed = np.cumsum(random.normal(0, 0.05, (frames, 2000, 3)), axis=0)
    place = world.positions + np.cumsum(speed, axis=0) / 30
    angle = (
        np.cumsum(random.normal(0, 3, (2000, 1)) + np.cumsum(random.normal(0, 0.3, (frames, 2000, 1)), axis=0), axis=0)
        / 30
    )
    axis = random.normal(0, 1, (2000, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    turn = np.concatenate([np.cos(angle / 2), np.sin(angle / 2) * axis], axis=2)
    step = recording.position_step(description)
    assert step <= 1e-4
    taken = show.Recording(
        description, "", step, np.arange(frames) / 30, np.rint(place / step), np.rint(turn / packing.TURN_STEP)
    )
    assert len(page.page_of(taken)) < 10e6


def test_contact_forces_have_the_errors_of_their_contacts():
    world = subadmm.scene("pile:20", backend="cpu", settings={"iterations": 5})
    world.step(300)
    with pytest.raises(subadmm.Unavailable, match="certify"):
        world.contact_errors()
    assert np.isnan(show.forces.forces_of(world, 10).error).all()
    settings = world.settings
    settings.certify = True
    world.settings = settings
    world.step()
    errors, certificate = world.contact_errors(), world.report.certificate
    assert len(errors) == world.report.contacts and errors.max() == certificate.ncp_max  # there are no joints
    assert errors.argmax() == certificate.ncp_worst and errors.mean() == pytest.approx(certificate.ncp_mean)
    forces, contacts = show.forces.forces_of(world, 10), world.contacts()
    size = np.linalg.norm(contacts["force"], axis=1)
    keep = np.sort(np.argsort(size)[-10:])
    assert (forces.force == contacts["force"][keep]).all() and (forces.error == errors[keep]).all()
    arrows = forces.arrows(0.3)
    assert np.linalg.norm(arrows[:, 1] - arrows[:, 0], axis=1).max() == pytest.approx(0.3)


def test_colours_of_errors_go_along_the_scale():
    scale, colours = show.forces.SCALE, show.forces.COLOURS
    found = show.forces.colours_of([10.0 ** power for power in scale] + [1e-15, 0, 1e3, np.nan])
    assert (found == [*colours, colours[0], colours[0], colours[-1], show.forces.UNMEASURED]).all()
    assert all(f"1e{power}" in show.forces.legend() for power in scale)


def test_pages_have_the_largest_contact_forces():
    world = subadmm.scene("pile:20", backend="cpu", settings={"certify": True})
    taken = show.record(world, 1, contacts=15)
    header, data = read_page(page.page_of(taken))

    def read(name):
        kind, at, count = header["forces"][name]
        return np.frombuffer(data, {"i32": "<i4", "u8": "u1"}[kind], count, at)

    counts = read("counts")
    assert counts.tolist() == [len(forces.force) for forces in taken.forces] and counts.max() == 15
    numbers = read("numbers").reshape(6, 2, -1).astype(int)
    numbers = numbers[:, 0] + 256 * numbers[:, 1]
    places = np.array(header["forces"]["low"]) + np.array(header["forces"]["span"]) * numbers[:3].T / 65535
    largest = header["forces"]["largest"]
    forces = (numbers[3:].T - 32768) / 32767 * 2 * largest
    whole = [np.concatenate([getattr(one, name) for one in taken.forces]) for name in ("position", "force", "error")]
    assert abs(places - whole[0]).max() <= max(header["forces"]["span"]) / 65535
    small = np.linalg.norm(whole[1], axis=1) < 2 * largest
    assert small.mean() > 0.5 and abs(forces - whole[1])[small].max() <= largest / 16384
    assert (np.linalg.norm(forces, axis=1) <= 2 * largest * 1.001).all()  # what jolts is cut
    low, high = header["forces"]["scale"][0], header["forces"]["scale"][-1]
    levels = low + (high - low) * (read("levels").astype(float) - 1) / 254
    inside = (whole[2] > 10.0 ** low) & (whole[2] < 10.0 ** high)
    assert inside.any() and abs(levels[inside] - np.log10(whole[2][inside])).max() <= (high - low) / 500
    without = read_page(page.page_of(show.record(world, 0.1)))[0]
    assert without["forces"] is None


def test_gltf_files_have_the_poses_of_the_recording(tmp_path):
    taken = show.record(subadmm.scene("ragdolls:2", backend="cpu"), 0.6, title="dolls")
    taken.save(tmp_path / "dolls.glb")
    data = (tmp_path / "dolls.glb").read_bytes()
    magic, version, length, size, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON") and size % 4 == 0
    whole = json.loads(data[20:20 + size])
    blob = data[28 + size:]
    assert len(blob) % 4 == 0 and whole["buffers"][0]["byteLength"] <= len(blob)

    def read(number):
        accessor = whole["accessors"][number]
        view = whole["bufferViews"][accessor["bufferView"]]
        values = np.frombuffer(blob, "<f4", view["byteLength"] // 4, view["byteOffset"]).reshape(accessor["count"], -1)
        if "min" in accessor:
            assert (values.min(axis=0) == np.float32(accessor["min"])).all() and (
                values.max(axis=0) == np.float32(accessor["max"])
            ).all()
        return values

    animation, = whole["animations"]
    moved = {(channel["target"]["node"], channel["target"]["path"]): animation["samplers"][channel["sampler"]]
             for channel in animation["channels"]}
    assert len(moved) == 2 * 22                      # all but the ground
    for frame in (0, 7, len(taken.times) - 1):
        places, turns = taken.poses(frame)
        for (node, path), sampler in moved.items():
            times, values = read(sampler["input"])[:, 0], read(sampler["output"])
            found = np.array([np.interp(taken.times[frame], times, values[:, k]) for k in range(values.shape[1])])
            assert np.allclose(found, places[node] if path == "translation" else turns[node][[1, 2, 3, 0]], atol=1e-5)
    # Every node but the uppermost is under one other, and the uppermost turns z to y.
    below = [child for node in whole["nodes"] for child in node.get("children", [])]
    assert sorted(below) == list(range(len(whole["nodes"]) - 1))
    x, y, z, w = whole["nodes"][-1]["rotation"]
    assert np.allclose([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], [0, 1, 0])


# ---- the page with the running world -------------------------------------------------------------------------------


def one_box():
    world = subadmm.World(backend="cpu")
    world.add_ground()
    world.add_solid(subadmm.box(0.1, 0.1, 0.1), mass=2, position=(0, 0, 0.1))
    return world


def test_sessions_run_by_the_clock_and_begin_again():
    session = Session(one_box)
    dt = session.world.settings.dt
    assert sum(session.advance(10.4 * dt, 1.0) for _ in range(10)) == 104
    session.speed = 0.5
    assert session.advance(10 * dt, 1.0) == 5
    session.running = False
    assert session.advance(1.0, 1.0) == 0
    session.change(method="paper", iterations=77, tolerance=0.0, ncp_points=0)
    session.step()
    assert session.world.report.iterations == 77 and session.steps == 110 and len(session.history["ms"]) == 110
    with pytest.raises(subadmm.InvalidArgument):
        session.change(iterations=0)
    session.reset()
    assert session.steps == 0 and session.world.settings.method == "fast"


def test_the_hand_feels_the_weight_of_what_it_lifts():
    session = Session(one_box)
    assert not session.grab(0, (0, 0, 0)) and session.hand() is None
    assert session.grab(1, (0, 0, 0.2))
    session.pull((0.3, 0, 0.8))
    session.step(800)
    held, hand, force = session.hand()
    assert session.world.bodies[1].position[2] > 0.5 and hand.tolist() == [0.3, 0, 0.8]
    # It has come to rest under the hand, but for a thousandth of its swing.
    assert abs(force - [0, 0, 2 * 9.81]).max() < 0.05 and np.linalg.norm(held - hand) < 0.02
    session.release()
    assert session.hand() is None and not session.world.couplings
    session.step(200)
    assert session.world.bodies[1].position[2] < 0.15


def test_split_meshes_have_edges_and_the_same_triangles():
    box = show.mesh_of(subadmm.box(1, 2, 3))
    split = box.split()
    assert len(split.vertices) == 24 and (split.vertices[split.triangles] == box.vertices[box.triangles]).all()
    ball = show.mesh_of(subadmm.sphere(1))
    assert len(ball.split().vertices) == len(ball.vertices)


def test_the_view_sends_what_moves():
    pytest.importorskip("viser")
    from subadmm.show.view import View

    view = View(Session(one_box), "a box", port=18437)
    try:
        view._contacts.value = True
        view.session.step(5)
        view.frame()
        (group, handle), = view._moving
        assert (
            np.allclose(handle.batched_positions, view.session.world.positions[1:], atol=1e-6)
            and len(view._forces.points) == 4
        )
        # Contact forces on the box are up, and so are the arrows.
        up = np.sign(view.session.world.contacts()["force"][:, 2])
        assert (np.sign(view._forces.points[:, 1, 2] - view._forces.points[:, 0, 2]) == up).all()
        assert view.session.world.settings.certify and len(view._plots) == 3
    finally:
        view.stop()
