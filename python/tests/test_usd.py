"""subadmm.load of USD stages: units, frames, masses, shapes, joints, filters, and what is not carried over."""

import sys

import numpy as np
import pytest

import subadmm
from subadmm.importing.poses import q_about, q_matrix, q_mul

pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade  # noqa: E402

SINGLE = 2e-6  # relative: attributes of UsdPhysics are of single precision


def new_stage(metres=1.0, up="Z", kilograms=1.0, gravity=True):
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    UsdGeom.SetStageUpAxis(stage, up)
    UsdPhysics.SetStageKilogramsPerUnit(stage, kilograms)
    scene = UsdPhysics.Scene.Define(stage, "/scene")
    if not gravity:
        scene.CreateGravityMagnitudeAttr(0.0)
    return stage


def place(prim, position=(0, 0, 0), turn=(1, 0, 0, 0), scale=None):
    prim = UsdGeom.Xformable(prim)
    prim.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*map(float, position)))
    w, x, y, z = map(float, turn)
    prim.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(w, x, y, z))
    if scale is not None:
        prim.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*map(float, scale)))
    return prim.GetPrim()


def body(stage, path, position=(0, 0, 0), turn=(1, 0, 0, 0), scale=None, mass=None, gprim=None, **attributes):
    """A rigid body; gprim: its type, as 'Sphere', which collides then; None: an Xform."""
    prim = stage.DefinePrim(path, gprim or "Xform")
    for name, value in attributes.items():
        prim.GetAttribute(name).Set(value)
    UsdPhysics.RigidBodyAPI.Apply(prim)
    if gprim:
        UsdPhysics.CollisionAPI.Apply(prim)
    if mass is not None:
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(mass)
    return place(prim, position, turn, scale)


def collider(stage, path, gprim, position=(0, 0, 0), turn=(1, 0, 0, 0), scale=None, **attributes):
    prim = stage.DefinePrim(path, gprim)
    for name, value in attributes.items():
        prim.GetAttribute(name).Set(value)
    UsdPhysics.CollisionAPI.Apply(prim)
    return place(prim, position, turn, scale)


def mesh(stage, path, points, faces, approximation=None, **options):
    prim = collider(stage, path, "Mesh", **options)
    shape = UsdGeom.Mesh(prim)
    shape.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    shape.CreateFaceVertexCountsAttr([len(face) for face in faces])
    shape.CreateFaceVertexIndicesAttr([k for face in faces for k in face])
    if approximation:
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(approximation)
    return prim


CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def joint(
    stage,
    kind,
    path,
    a=None,
    b=None,
    position_a=(0, 0, 0),
    position_b=(0, 0, 0),
    turn_a=None,
    turn_b=None,
    **attributes,
):
    made = getattr(UsdPhysics, kind).Define(stage, path)
    for number, target, position, turn in ((0, a, position_a, turn_a), (1, b, position_b, turn_b)):
        if target:
            getattr(made, f"CreateBody{number}Rel")().SetTargets([target])
        getattr(made, f"CreateLocalPos{number}Attr")(Gf.Vec3f(*map(float, position)))
        if turn is not None:
            w, x, y, z = map(float, turn)
            getattr(made, f"CreateLocalRot{number}Attr")(Gf.Quatf(w, x, y, z))
    for name, value in attributes.items():
        made.GetPrim().GetAttribute("physics:" + name).Set(value)
    return made.GetPrim()


def limit(prim, name, low, high):
    api = UsdPhysics.LimitAPI.Apply(prim, name)
    api.CreateLowAttr(low), api.CreateHighAttr(high)


def material(stage, path, *prims, **attributes):
    made = UsdShade.Material.Define(stage, path)
    api = UsdPhysics.MaterialAPI.Apply(made.GetPrim())
    for name, value in attributes.items():
        getattr(api, f"Create{name}Attr")(value)
    for prim in prims:
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(made, UsdShade.Tokens.weakerThanDescendants, "physics")


def noted(loaded, name, reason=""):
    return [str(note) for note in loaded.report if name in note.element and reason in note.reason]


def tensor(one):
    """About the centre of mass, along the world's axes."""
    turn = q_matrix(one.orientation)
    return turn @ np.diag(one.inertia) @ turn.T


# ---- units and frames ----------------------------------------------------------------------------------------------


def falling(metres, up, kilograms):
    """A turned box with a velocity, in a group that is turned, over a plane; lengths and masses in the stage's
    units."""
    stage, turn = new_stage(metres, up, kilograms), q_about([1, 0, 0], -np.pi / 2) if up == "Y" else (1, 0, 0, 0)
    top = stage.DefinePrim("/top", "Xform")
    place(top, turn=turn)  # what is below has z up
    collider(stage, "/top/ground", "Plane")
    one = body(
        stage,
        "/top/one",
        np.array([0.1, 0.2, 0.5]) / metres,
        q_about([0.6, 0, 0.8], 0.5),
        np.array([0.1, 0.2, 0.05]) / metres,
        mass=3.0 / kilograms,
        gprim="Cube",
        size=2.0,
    )
    api = UsdPhysics.RigidBodyAPI(one)
    api.CreateVelocityAttr(Gf.Vec3f(0.5 / metres, 0, 0)), api.CreateAngularVelocityAttr(Gf.Vec3f(0, 0, 90))
    return subadmm.load(stage)


def test_units_and_the_up_axis_do_not_matter():
    first = falling(1.0, "Z", 1.0)
    assert not first.report
    one = first.bodies["/top/one"]
    assert one.position == pytest.approx([0.1, 0.2, 0.5]) and one.linear_velocity == pytest.approx([0.5, 0, 0])
    assert one.angular_velocity == pytest.approx([0, 0, np.pi / 2], rel=SINGLE)
    assert one.mass == 3 and one.inertia == pytest.approx([3 / 3 * (0.04 + 0.0025), 0.0125, 0.05], rel=SINGLE)
    assert first.world.settings.gravity == [0, 0, -9.81]
    first.world.step(400)
    assert one.position[2] < 0.21
    for metres, up, kilograms in ((0.01, "Z", 1.0), (1.0, "Y", 0.001), (0.01, "Y", 1000.0)):
        other = falling(metres, up, kilograms)
        other.world.step(400)
        # rounding of single precision, 1e-7, at the start; what a body that tumbles and slides makes of it
        assert other.bodies["/top/one"].position == pytest.approx(one.position, abs=1e-4)
        assert other.frame("/top/one")[0] == pytest.approx(one.position, abs=1e-4)


def test_gravity_of_the_scene():
    stage = new_stage(metres=0.01, up="Y")
    scene = UsdPhysics.Scene(stage.GetPrimAtPath("/scene"))
    scene.CreateGravityDirectionAttr(Gf.Vec3f(0, 0, 3)), scene.CreateGravityMagnitudeAttr(162.0)
    assert subadmm.load(stage).world.settings.gravity == pytest.approx([0, -1.62, 0], abs=1e-12)
    stage.RemovePrim("/scene")
    bare = subadmm.load(stage)
    assert bare.world.settings.gravity == [0, 0, -9.81] and noted(bare, "PhysicsScene")
    assert subadmm.load(stage, settings=subadmm.Settings(gravity=[1, 2, 3])).world.settings.gravity == [1, 2, 3]


# ---- masses --------------------------------------------------------------------------------------------------------


def test_masses_by_the_rules_of_usd():
    stage = new_stage(kilograms=1.0)
    body(stage, "/water", gprim="Sphere", radius=0.5)
    UsdPhysics.MassAPI.Apply(body(stage, "/dense", gprim="Sphere", radius=0.5)).CreateDensityAttr(3.0)
    stuff = body(stage, "/stuff", gprim="Sphere", radius=0.5)
    material(stage, "/gold", stuff, Density=7.0)
    # two balls: one by its own density, one by the body's, though it has a material
    both = body(stage, "/both", scale=(2, 2, 2))
    UsdPhysics.MassAPI.Apply(both).CreateDensityAttr(2.0)
    left = collider(stage, "/both/left", "Sphere", (-1, 0, 0), radius=0.25)
    UsdPhysics.MassAPI.Apply(left).CreateDensityAttr(6.0)
    right = collider(stage, "/both/right", "Sphere", (1, 0, 0), radius=0.25)
    material(stage, "/lead", right, Density=11.0)
    # the colliders' masses, unless the body has one
    for name, mass in (("sum", None), ("given", 5.0)):
        body(stage, f"/{name}", mass=mass)
        for k, share in ((0, 1.0), (1, 3.0)):
            UsdPhysics.MassAPI.Apply(collider(stage, f"/{name}/part{k}", "Cube", (0, k, 0), size=0.2)).CreateMassAttr(
                share
            )
    loaded = subadmm.load(stage)
    assert not loaded.report
    ball = 4 / 3 * np.pi * 0.5**3
    assert [loaded.bodies[p].mass for p in ("/water", "/dense", "/stuff")] == pytest.approx(
        [1000 * ball, 3 * ball, 7 * ball]
    )
    one = loaded.bodies["/both"]
    assert one.mass == pytest.approx(8 * ball) and one.position == pytest.approx([-1, 0, 0])  # (6 (-2) + 2 (2)) / 8
    about = 0.4 * 8 * ball * 0.25  # and 6 at 1 m, 2 at 3 m of the middle
    assert np.diag(tensor(one)) == pytest.approx(np.array([about, about + 24 * ball, about + 24 * ball]))
    summed, given = loaded.bodies["/sum"], loaded.bodies["/given"]
    assert (summed.mass, given.mass) == pytest.approx((4, 5))
    assert summed.position == pytest.approx([0, 0.75, 0]) and given.position == pytest.approx([0, 0.75, 0])
    assert tensor(given) == pytest.approx(1.25 * tensor(summed), abs=1e-12)


def test_given_inertia_and_centre_of_mass():
    stage, turn, axes = new_stage(metres=0.1), q_about([0, 0.6, 0.8], 0.7), q_about([0.8, 0, 0.6], 1.1)
    one = body(stage, "/one", (1, 2, 3), turn, scale=(1, 2, 1), mass=2.0)
    api = UsdPhysics.MassAPI(one)
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(30, 40, 50)), api.CreateCenterOfMassAttr(Gf.Vec3f(0.5, 0.5, 0))
    api.CreatePrincipalAxesAttr(Gf.Quatf(*map(float, axes)))
    # a centre alone: the inertia of the collider is brought there
    two = body(stage, "/two", gprim="Cube", size=2.0, mass=6.0)
    UsdPhysics.MassAPI(two).CreateCenterOfMassAttr(Gf.Vec3f(0.5, 0, 0))
    body(stage, "/point", mass=3.0)
    loaded = subadmm.load(stage)
    made = loaded.bodies["/one"]
    assert made.mass == 2 and made.position == pytest.approx(
        np.array([0.1, 0.2, 0.3]) + q_matrix(turn) @ [0.05, 0.1, 0], rel=SINGLE
    )
    whole = q_matrix(q_mul(turn, axes))
    assert tensor(made) == pytest.approx(whole @ np.diag([0.3, 0.4, 0.5]) @ whole.T, rel=1e-5, abs=1e-7)
    assert loaded.frame("/one")[0] == pytest.approx([0.1, 0.2, 0.3], abs=1e-7)
    assert np.diag(tensor(loaded.bodies["/two"])) == pytest.approx(
        [0.04, 0.04 + 6 * 0.0025, 0.04 + 6 * 0.0025], rel=SINGLE
    )
    assert loaded.bodies["/point"].inertia == pytest.approx([0.4 * 3 * 0.01] * 3) and noted(
        loaded, "/point", "ball of 3 kg"
    )


# ---- shapes --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "gprim, attributes, scale, type, size, volume",
    [
        ("Cube", dict(size=0.4), (1, 2, 0.5), "box", (0.2, 0.4, 0.1), 0.064),
        ("Sphere", dict(radius=0.3), (2, 2, 2), "sphere", (0.6,), 4 / 3 * np.pi * 0.216),
        ("Sphere", dict(radius=0.5), (1, 0.4, 0.6), "ellipsoid", (0.5, 0.2, 0.3), 4 / 3 * np.pi * 0.03),
        (
            "Capsule",
            dict(radius=0.1, height=0.6, axis="X"),
            None,
            "capsule",
            (0.1, 0.3),
            np.pi * 0.01 * (0.6 + 0.4 / 3),
        ),
        ("Cylinder", dict(radius=0.2, height=0.6, axis="Y"), (2, 0.5, 2), "cylinder", (0.4, 0.15), np.pi * 0.16 * 0.3),
        ("Cone", dict(radius=0.2, height=0.6, axis="Z"), (1, 1, 2), "cone", (0.2, 0.6), np.pi * 0.04 * 1.2 / 3),
        ("Cone", dict(radius=0.2, height=0.6, axis="X"), (2, 1, 1.5), "hull", None, np.pi * 0.06 * 1.2 / 3),
        (
            "Capsule_1",
            dict(radiusTop=0.1, radiusBottom=0.1, height=0.4),
            None,
            "capsule",
            (0.1, 0.2),
            np.pi * 0.01 * (0.4 + 0.4 / 3),
        ),
        (
            "Cylinder_1",
            dict(radiusTop=0.1, radiusBottom=0.2, height=0.3),
            None,
            "hull",
            None,
            np.pi * 0.1 * (0.01 + 0.02 + 0.04),
        ),
    ],
)
def test_gprims(gprim, attributes, scale, type, size, volume):
    stage, turn = new_stage(), q_about([0.6, 0.8, 0], 0.4)
    body(stage, "/one", (1, 2, 3), turn, scale, gprim=gprim, **attributes)
    loaded = subadmm.load(stage)
    shape = loaded.shapes["/one"][0].definition
    assert shape.type == type and bool(loaded.report) == (type == "hull")
    if size:
        assert shape.size[: len(size)] == pytest.approx(size, rel=SINGLE)
        assert loaded.bodies["/one"].mass == pytest.approx(1000 * volume, rel=3 * SINGLE)
    else:  # a circle of 32 sides is 0.6 % less
        assert loaded.bodies["/one"].mass == pytest.approx(1000 * volume, rel=0.008)
    # the box around it is the one that USD sees, along the prim's axes; a ray along each of them leaves there
    bound = UsdGeom.Boundable(stage.GetPrimAtPath("/one")).ComputeExtentFromPlugins(
        UsdGeom.Boundable(stage.GetPrimAtPath("/one")), Usd.TimeCode.Default()
    )
    low, high = np.array(bound, dtype=float) * (scale or (1, 1, 1))
    middle, axes = np.array([1, 2, 3]) + q_matrix(turn) @ ((low + high) / 2), q_matrix(turn).T
    for k, half in enumerate((high - low) / 2):
        if gprim.startswith(("Cone", "Cylinder_1")) and k != {"X": 0, "Y": 1, "Z": 2}[attributes.get("axis", "Z")]:
            continue  # narrower at half the height
        hit = loaded.world.cast_rays([middle + 5 * axes[k]], [-axes[k]])
        # (a cone's apex is a point: the ray may pass it by single precision's share of its slope)
        assert 5 - hit["distance"][0] == pytest.approx(half, rel=1e-5)


def test_a_sphere_and_a_cube_under_a_skew_frame():
    stage = new_stage()
    top = body(stage, "/top", turn=q_about([0, 0, 1], 0.3), scale=(1, 3, 1))
    assert top
    collider(stage, "/top/ball", "Sphere", turn=q_about([0, 0, 1], 0.7), scale=(0.5, 1, 1), radius=0.2)
    collider(stage, "/top/cube", "Cube", (3, 0, 0), turn=q_about([0, 0, 1], 0.5), size=0.2)
    loaded = subadmm.load(stage)
    ball, cube = loaded.shapes["/top/ball"][0].definition, loaded.shapes["/top/cube"][0].definition
    assert (ball.type, cube.type) == ("ellipsoid", "hull") and not loaded.report
    assert np.prod(ball.size) == pytest.approx(0.008 * 1.5, rel=SINGLE)  # volumes go by the determinant
    assert subadmm.mass_of([cube], 1).mass == pytest.approx(0.008 * 3, rel=SINGLE)
    # the ellipsoid is where the sphere's points are: x^T M x = 1 on all of them
    frame = np.array(UsdGeom.Xformable(stage.GetPrimAtPath("/top/ball")).ComputeLocalToWorldTransform(0))[:3, :3]
    unit = np.random.default_rng(1).normal(size=(50, 3))
    points = 0.2 * unit / np.linalg.norm(unit, axis=1)[:, None] @ frame
    turn = q_matrix(q_mul(loaded.bodies["/top"].orientation, ball.orientation))
    assert np.sum((points @ turn / ball.size) ** 2, axis=1) == pytest.approx(1, rel=1e-5)


def test_meshes_by_their_approximation():
    stage = new_stage()
    kinds = ("convexHull", "boundingCube", "boundingSphere", None, "meshSimplification")
    for k, kind in enumerate(kinds):
        place(stage.DefinePrim(f"/moving{k}", "Xform"), (3 * k, 0, 0))
        UsdPhysics.RigidBodyAPI.Apply(stage.GetPrimAtPath(f"/moving{k}"))
        mesh(stage, f"/moving{k}/mesh", CUBE, FACES, kind, scale=(0.1, -0.2, 0.3))  # mirrored
        mesh(stage, f"/static{k}", CUBE, FACES, kind, position=(3 * k, 5, 0), scale=(0.1, 0.2, 0.3))
    loaded = subadmm.load(stage)
    types = ["hull", "box", "sphere", "hull", "hull"]
    assert [loaded.shapes[f"/moving{k}/mesh"][0].definition.type for k in range(5)] == types
    types = ["hull", "box", "sphere", "mesh", "mesh"]
    assert [loaded.shapes[f"/static{k}"][0].definition.type for k in range(5)] == types
    for k in (0, 1, 3):
        assert loaded.bodies[f"/moving{k}"].mass == pytest.approx(48, rel=SINGLE)
    assert [bool(noted(loaded, f"/moving{k}/")) for k in range(5)] == [False, False, False, True, True]
    assert [bool(noted(loaded, f"/static{k}")) for k in range(5)] == [False, False, False, False, True]
    # equal ones share a hull
    for k in range(3):
        place(stage.DefinePrim(f"/copy{k}", "Xform"), (0, 9, k), q_about([0.6, 0, 0.8], k), scale=(0.3, 0.3, 0.3))
        UsdPhysics.RigidBodyAPI.Apply(stage.GetPrimAtPath(f"/copy{k}"))
        mesh(stage, f"/copy{k}/mesh", CUBE, FACES, "convexHull")
    assert subadmm.load(stage).world.to_json().count('"points"') == 5  # and four of those above
    # sides of triangles: rays from outside meet them
    mesh(stage, "/mirrored", CUBE, FACES, position=(0, 20, 0), scale=(-1, 1, 1))
    UsdGeom.Mesh(
        mesh(stage, "/handed", CUBE, [face[::-1] for face in FACES], position=(0, 30, 0))
    ).CreateOrientationAttr("leftHanded")
    loaded = subadmm.load(stage)
    hits = loaded.world.cast_rays([[3 * 3, 5, 9], [0, 20, 9], [0, 30, 9]], [[0, 0, -1]] * 3)
    assert hits["distance"] == pytest.approx([8.7, 8, 8], rel=SINGLE)


def test_broken_meshes_are_named():
    stage = new_stage()
    mesh(stage, "/empty", [], [])
    mesh(stage, "/wrong", CUBE, [(0, 1, 99)])
    collider(stage, "/curve", "BasisCurves")
    body(stage, "/flying", gprim="Plane")
    loaded = subadmm.load(stage)
    for path in ("/empty", "/wrong", "/curve", "/flying"):
        assert noted(loaded, path, "not carried over"), path


def test_bodies_rest_on_the_plane_where_they_should():
    stage = new_stage()
    collider(stage, "/ground", "Plane", axis="X", turn=q_about([0, 1, 0], -np.pi / 2))  # x up
    heights = {"Sphere": 0.1, "Cube": 0.1, "Cylinder": 0.2, "Cone": 0.2}
    for k, (kind, height) in enumerate(heights.items()):
        size = dict(size=0.2) if kind == "Cube" else dict(radius=0.1)
        if kind in ("Cylinder", "Cone"):
            size["height"] = 0.4
        body(stage, f"/{kind}", (k, 0, height + 0.05), gprim=kind, **size)
    loaded = subadmm.load(stage)
    loaded.world.step(300)
    for kind, height in heights.items():
        # penetration that is left alone: settings.slop and less
        assert loaded.frame(f"/{kind}")[0][2] == pytest.approx(height, abs=2e-5), kind


def test_a_box_slides_by_its_material():
    stage = new_stage()
    ground = collider(stage, "/ground", "Plane", turn=q_about([0, 1, 0], np.radians(30)))
    down = np.array([np.sin(np.radians(60)), 0, -0.5])
    one = body(
        stage,
        "/one",
        0.1 * np.array([0.5, 0, np.cos(np.radians(30))]),
        q_about([0, 1, 0], np.radians(30)),
        gprim="Cube",
        size=0.2,
    )
    material(stage, "/slick", ground, one, StaticFriction=0.4, DynamicFriction=0.3)
    rough = body(
        stage,
        "/rough",
        (0, 3, 0.05 + 0.1 * np.cos(np.radians(30))),
        q_about([0, 1, 0], np.radians(30)),
        gprim="Cube",
        size=0.2,
    )
    material(stage, "/sand", rough, StaticFriction=2.0, Restitution=0.25)
    loaded = subadmm.load(stage)
    assert noted(loaded, "/slick", "0.4") and loaded.shapes["/rough"][0].definition.restitution == 0.25
    loaded.world.step(200)
    fall = 9.81 * (np.sin(np.radians(30)) - 0.3 * np.cos(np.radians(30)))
    assert np.array(loaded.bodies["/one"].linear_velocity) @ down == pytest.approx(fall, rel=1e-4)  # 1 s
    assert np.linalg.norm(loaded.bodies["/rough"].linear_velocity) < 1e-6  # sqrt(0.3 x 2) > tan 30 degrees


# ---- joints --------------------------------------------------------------------------------------------------------


def test_a_pendulum_moves_as_the_same_by_hand():
    """Of cm, y up, with the hinge off the bar's frame; against a world of the same numbers made call by call."""
    stage = new_stage(metres=0.01, up="Y")
    bar = body(stage, "/bar", (25, 200, 0), gprim="Cube", size=1.0, scale=(50, 4, 6), mass=2.0)
    assert bar
    joint(
        stage,
        "RevoluteJoint",
        "/hinge",
        None,
        "/bar",
        (0, 200, 0),
        (-0.5, 0, 0),
        axis="Z",
        lowerLimit=-150.0,
        upperLimit=10.0,
    )
    drive = UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath("/hinge"), "angular")
    drive.CreateStiffnessAttr(400.0), drive.CreateDampingAttr(20.0), drive.CreateTargetPositionAttr(-60.0)
    loaded = subadmm.load(stage)
    assert not loaded.report
    world = subadmm.World(settings=loaded.world.settings)
    own = world.add_body(
        mass=2.0,
        inertia=2 / 12 * np.array([0.04**2 + 0.06**2, 0.5**2 + 0.06**2, 0.5**2 + 0.04**2]),
        position=(0.25, 0, 2),
        orientation=q_about([1, 0, 0], np.pi / 2),
    )
    degree = np.pi / 180
    law = subadmm.Coordinate(
        limited=True,
        lower=-150 * degree,
        upper=10 * degree,
        drive="position",
        drive_stiffness=400e-4 / degree,
        drive_damping=20e-4 / degree,
        target_position=-60 * degree,
    )
    hinge = world.add_joint(
        "revolute", None, own, position=(0, 0, 2), orientation=q_about([1, 0, 0], np.pi / 2), coordinates={5: law}
    )
    assert np.array(own.inertia) == pytest.approx(np.array(loaded.bodies["/bar"].inertia), rel=SINGLE)
    for _ in range(10):
        world.step(20)
        loaded.world.step(20)
        assert loaded.joints["/hinge"].position[5] == pytest.approx(hinge.position[5], abs=1e-5)
        assert loaded.bodies["/bar"].position == pytest.approx(own.position, abs=1e-5)
    assert -1.3 < hinge.position[5] < -0.3


def test_joints_of_every_kind():
    stage = new_stage(gravity=False)
    for k, name in enumerate(("fixed", "slide", "ball", "rope", "rod", "six", "free")):
        body(stage, f"/a{k}", (k, 0, 1), gprim="Cube", size=0.2)
        body(stage, f"/{name}", (k, 0, 1.5), gprim="Cube", size=0.2)
    ends = dict(position_a=(0, 0, 0.25), position_b=(0, 0, -0.25))
    joint(stage, "FixedJoint", "/j/fixed", "/a0", "/fixed", **ends, breakForce=100.0, breakTorque=20.0)
    joint(stage, "PrismaticJoint", "/j/slide", "/a1", "/slide", **ends, axis="Y", lowerLimit=-0.1, upperLimit=0.3)
    joint(stage, "SphericalJoint", "/j/ball", "/a2", "/ball", **ends, jointEnabled=False, coneAngle0Limit=30.0)
    joint(stage, "DistanceJoint", "/j/rope", "/a3", "/rope", maxDistance=0.7, collisionEnabled=True)
    joint(stage, "DistanceJoint", "/j/rod", "/a4", "/rod", minDistance=0.5, maxDistance=0.5)
    six = joint(stage, "Joint", "/j/six", "/a5", "/six", **ends)
    for name in ("transX", "transY", "rotX", "rotY"):
        limit(six, name, 1.0, -1.0)
    limit(six, "transZ", -0.2, 0.2), limit(six, "rotZ", -90.0, 45.0)
    drive = UsdPhysics.DriveAPI.Apply(six, "rotZ")
    drive.CreateStiffnessAttr(1.0), drive.CreateDampingAttr(0.1), drive.CreateTargetPositionAttr(
        30.0
    ), drive.CreateMaxForceAttr(50.0)
    joint(stage, "Joint", "/j/free", "/a6", "/free")
    loaded = subadmm.load(stage)
    made = {path[3:]: one for path, one in loaded.joints.items()}
    assert {name: (one.kind, one.locks) for name, one in made.items()} == {
        "fixed": ("fixed", 63), "slide": ("prismatic", 0b111011), "ball": ("spherical", 0b111), "rope": ("spring", 0),
        "rod": ("distance", 1), "six": ("custom", 0b011011), "free": ("custom", 0),
    }  # fmt: skip
    for one in made.values():
        if one.kind != "custom" or one.locks:
            assert np.abs([x for k, x in enumerate(one.position) if one.locks >> k & 1]).max(initial=0) < 1e-7
    assert not made["ball"].enabled and noted(loaded, "/j/ball", "cone")
    slide, rope, turn = made["slide"].coordinate(2), made["rope"].coordinate(0), made["six"].coordinate(5)
    assert (slide.lower, slide.upper) == pytest.approx((-0.1, 0.3), rel=SINGLE)
    assert rope.limited and rope.upper == pytest.approx(0.7) and rope.lower == -np.inf
    assert (turn.lower, turn.upper) == pytest.approx((-np.pi / 2, np.pi / 4), rel=SINGLE)
    assert (turn.drive_stiffness, turn.drive_force) == pytest.approx((180 / np.pi, 50))
    # what they let: pulled apart, along y and along z
    loaded.bodies["/slide"].apply_impulse_at([0, 8, 0], [1, 0, 1.5])
    loaded.bodies["/rope"].apply_impulse_at([0, 0, 8], [3, 0, 1.5])
    loaded.bodies["/rod"].apply_impulse_at([8, 0, 0], [4, 0, 1.5])
    loaded.bodies["/fixed"].apply_impulse_at([0.4, 0, 0], [0, 0, 1.5])
    loaded.world.step(400)
    assert made["slide"].position[2] == pytest.approx(0.3, abs=1e-3)  # still drifting against the stop
    assert made["rope"].position[0] == pytest.approx(0.7, abs=1e-5)
    assert np.linalg.norm(np.subtract(loaded.bodies["/rod"].position, loaded.bodies["/a4"].position)) == pytest.approx(
        0.5, abs=1e-5
    )
    assert made["six"].position[5] == pytest.approx(np.radians(30), abs=1e-3)
    assert not made["fixed"].broken
    loaded.bodies["/fixed"].apply_impulse_at([8, 0, 0], [0, 0, 1.5])
    loaded.world.step(2)
    assert made["fixed"].broken


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_axes_and_signs(axis):
    """A speed drive turns body1 about the axis of body0 by the right hand, and pushes it along it."""
    stage, turn = new_stage(gravity=False), q_about([0.6, 0, 0.8], 0.9)
    body(stage, "/turning", (0, 0, 1), turn, gprim="Cube", size=0.2)
    body(stage, "/sliding", (2, 0, 1), turn, gprim="Cube", size=0.2)
    for kind, name, at in (("RevoluteJoint", "/turning", (0, 0, 1)), ("PrismaticJoint", "/sliding", (2, 0, 1))):
        made = joint(stage, kind, "/joint" + name[1:], None, name, at, turn_a=turn, axis=axis)
        drive = UsdPhysics.DriveAPI.Apply(made, "angular" if kind == "RevoluteJoint" else "linear")
        drive.CreateDampingAttr(1e6), drive.CreateTargetVelocityAttr(90.0 if kind == "RevoluteJoint" else 0.5)
    loaded = subadmm.load(stage)
    loaded.world.step(10)
    way = q_matrix(turn)[:, "XYZ".index(axis)]
    # the drive is a damper of 1e6, which is off by its share of the inertia
    assert loaded.bodies["/turning"].angular_velocity == pytest.approx(np.pi / 2 * way, abs=1e-5)
    assert loaded.bodies["/sliding"].linear_velocity == pytest.approx(0.5 * way, abs=1e-5)


def test_ends_of_joints():
    """On a prim below a body, on a static collider, on a prim that is neither; and ends that fit no joint."""
    stage = new_stage()
    wall = collider(stage, "/wall", "Cube", (0, 0, 2), size=0.4)
    place(stage.DefinePrim("/group", "Xform"), (5, 0, 2))
    collider(stage, "/group/post", "Cube", size=0.4)
    for name, x in (("door", 0.3), ("gate", 5.3)):
        body(stage, f"/{name}", (x, 0, 2), gprim="Cube", size=0.4)
        place(stage.DefinePrim(f"/{name}/edge", "Xform"), (-0.1, 0, 0), scale=(2, 2, 2))
    joint(stage, "RevoluteJoint", "/door_hinge", "/wall", "/door/edge", (0.2, 0, 0), axis="Z")
    joint(stage, "RevoluteJoint", "/gate_hinge", "/group", "/gate/edge", (0.2, 0, 0), axis="Z")
    joint(stage, "FixedJoint", "/none", None, "/wall")
    joint(stage, "FixedJoint", "/own", "/door", "/door/edge")
    joint(stage, "FixedJoint", "/gone", "/door", "/nothing")
    joint(stage, "RevoluteJoint", "/crossed", None, "/door", lowerLimit=10.0, upperLimit=-10.0)
    assert wall
    loaded = subadmm.load(stage)
    for path in ("/none", "/own", "/gone", "/crossed"):
        assert noted(loaded, path, "not carried over") and path not in loaded.joints
    loaded.world.step(100)
    assert loaded.world.report.contacts == 0  # door and wall overlap by 0.1 m, and are left out
    for path in ("/door_hinge", "/gate_hinge"):
        assert np.abs(loaded.joints[path].position).max() < 1e-6
    assert loaded.joints["/door_hinge"].body_a == loaded.bodies["/wall"] and loaded.joints["/gate_hinge"].body_a is None


def test_starts_that_do_not_fit_are_named():
    stage = new_stage(gravity=False)
    for k in range(3):
        body(stage, f"/b{k}", (k, 0, 0), gprim="Sphere", radius=0.1)
    joint(stage, "FixedJoint", "/apart", None, "/b0", (0, 0, 0.01))
    joint(stage, "PrismaticJoint", "/outside", None, "/b1", (1, 0, 0), axis="Z", lowerLimit=0.2, upperLimit=0.3)
    push = joint(stage, "PrismaticJoint", "/heavy", None, "/b2", (2, 0, 0), axis="Z")
    drive = UsdPhysics.DriveAPI.Apply(push, "linear")
    drive.CreateTypeAttr("acceleration"), drive.CreateDampingAttr(1.0)
    UsdPhysics.DriveAPI.Apply(push, "rotX")
    loaded = subadmm.load(stage)
    assert noted(loaded, "/apart", "0.01") and noted(loaded, "/outside", "outside of its range")
    assert noted(loaded, "/heavy", "'linear'") and noted(loaded, "/heavy", "'rotX'")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_frames_are_those_that_usd_sees():
    """Joint frames of bodies with scale and of a deep tree, against USD's own parser."""
    if not hasattr(UsdPhysics, "LoadUsdPhysicsFromRange"):
        pytest.skip("this usd-core has no parser of UsdPhysics")
    stage = new_stage(gravity=False)
    place(stage.DefinePrim("/top", "Xform"), (1, 2, 3), q_about([1, 0, 0], 0.4), (2, 2, 2))
    a = body(stage, "/top/a", (1, 0, 0), q_about([0, 1, 0], 0.3), (1, 1, 0.5), gprim="Cube", size=1.0)
    b = body(stage, "/top/b", (0, 1, 0), q_about([0, 0, 1], 0.8), gprim="Sphere", radius=0.5)
    place(stage.DefinePrim("/top/b/tip", "Xform"), (0, 0, 0.5), q_about([1, 0, 0], 0.2))
    joint(
        stage,
        "Joint",
        "/joint",
        "/top/a",
        "/top/b/tip",
        (0.1, 0.2, 0.4),
        (0.3, 0, 0.1),
        q_about([0, 0, 1], 0.2),
        q_about([0, 1, 0], 0.6),
    )
    loaded = subadmm.load(stage)
    parsed = UsdPhysics.LoadUsdPhysicsFromRange(stage, ["/"])
    desc = next(value[1][0] for key, value in parsed.items() if key == UsdPhysics.ObjectType.D6Joint)
    made = loaded.joints["/joint"]
    for prim, frame, position, turn in (
        (a, made.frame_a, desc.localPose0Position, desc.localPose0Orientation),
        (b, made.frame_b, desc.localPose1Position, desc.localPose1Orientation),
    ):
        at, q = loaded.frame(str(prim.GetPath()))
        one = loaded.bodies[str(prim.GetPath())]
        have = np.array(one.position) + q_matrix(one.orientation) @ frame[0]
        have_turn = q_mul(one.orientation, frame[1])
        want_turn = q_mul(q, [turn.GetReal(), *turn.GetImaginary()])
        assert have == pytest.approx(at + q_matrix(q) @ np.array(position), abs=1e-5)
        assert abs(have_turn @ want_turn) == pytest.approx(1, abs=1e-6)


# ---- filters -------------------------------------------------------------------------------------------------------


def test_collision_groups_and_filtered_pairs():
    stage = new_stage()
    collider(stage, "/ground", "Plane")
    names = ("meets", "group", "pair", "off", "inner", "outer")
    for k, name in enumerate(names):
        body(stage, f"/{name}", (k, 0, 0.3))
        collider(stage, f"/{name}/ball", "Sphere", radius=0.1)
    UsdPhysics.CollisionAPI(stage.GetPrimAtPath("/off/ball")).CreateCollisionEnabledAttr(False)
    one, other = (UsdPhysics.CollisionGroup.Define(stage, path) for path in ("/g/one", "/g/other"))
    one.GetCollidersCollectionAPI().CreateIncludesRel().SetTargets(["/group"])
    other.GetCollidersCollectionAPI().CreateIncludesRel().SetTargets(["/ground"])
    one.CreateFilteredGroupsRel().SetTargets(["/g/other"])
    UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath("/pair")).CreateFilteredPairsRel().SetTargets(["/ground"])
    # of a body with two colliders one falls through, the other one does not
    collider(stage, "/inner/second", "Sphere", (0, 0, 0.05), radius=0.1)
    UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath("/inner/ball")).CreateFilteredPairsRel().SetTargets(
        ["/ground"]
    )
    place(stage.DefinePrim("/nobody", "Xform"))
    UsdPhysics.FilteredPairsAPI.Apply(stage.GetPrimAtPath("/outer")).CreateFilteredPairsRel().SetTargets(["/nobody"])
    loaded = subadmm.load(stage)
    loaded.world.step(150)
    height = {name: loaded.frame(f"/{name}")[0][2] for name in names}
    assert [height[name] < -0.5 for name in names] == [False, True, True, True, False, False]
    assert height["meets"] == pytest.approx(0.1, abs=2e-5) and height["inner"] == pytest.approx(0.05, abs=2e-5)
    assert noted(loaded, "/outer", "/nobody") and len(loaded.report) == 2  # and the body without colliders
    assert noted(loaded, "/off", "no collider")


# ---- what is left --------------------------------------------------------------------------------------------------


def test_kinematic_bodies_and_disabled_ones():
    stage = new_stage()
    for name in ("led", "still"):
        body(stage, f"/{name}", (0, 0, 1), gprim="Cube", size=0.2)
    UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath("/led")).CreateKinematicEnabledAttr(True)
    UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath("/still")).CreateRigidBodyEnabledAttr(False)
    loaded = subadmm.load(stage)
    assert [loaded.bodies[path].type for path in ("/led", "/still")] == ["kinematic", "static"]
    assert not loaded.report


def test_what_is_not_carried_over_is_named():
    stage = new_stage()
    one = body(stage, "/one", gprim="Sphere", radius=0.1)
    one.AddAppliedSchema("PhysxRigidBodyAPI")
    UsdPhysics.RigidBodyAPI(one).CreateStartsAsleepAttr(True)
    UsdPhysics.Scene.Define(stage, "/second")
    other = body(stage, "/other", gprim="Sphere", radius=0.1)
    UsdPhysics.RigidBodyAPI(other).CreateSimulationOwnerRel().SetTargets(["/second"])
    collider(stage, "/other/part", "Cube")
    joint(stage, "FixedJoint", "/tie", "/one", "/other")
    stage.DefinePrim("/gears", "PhysxPhysicsGearJoint")
    UsdGeom.Mesh.Define(stage, "/drawn"), UsdGeom.Camera.Define(stage, "/eye")
    group = stage.DefinePrim("/instances", "PointInstancer")
    body(stage, "/instances/proto", gprim="Sphere", radius=0.1)
    assert group
    moving = collider(stage, "/moving", "Cube", size=0.1)
    UsdGeom.Xformable(moving).GetOrderedXformOps()[0].Set(Gf.Vec3d(0, 0, 1), 0)
    UsdGeom.Xformable(moving).GetOrderedXformOps()[0].Set(Gf.Vec3d(0, 0, 2), 24)
    UsdPhysics.MassAPI.Apply(stage.DefinePrim("/weight", "Xform"))
    loaded = subadmm.load(stage)
    for element, reason in (
        ("PhysxRigidBodyAPI", "/one"), ("/one", "startsAsleep"), ("/second", "one scene"), ("/other", "/second"),
        ("PhysxPhysicsGearJoint", "/gears"), ("what is drawn", "1 gprims, 1 cameras"), ("/instances", "instances"),
        ("/moving", "animated"), ("/weight", "mass"), ("/tie", "/other"),
    ):  # fmt: skip
        assert noted(loaded, element, reason), (element, str(loaded.report))
    assert len(loaded.report) == 10 and "/other" not in loaded.bodies


def test_errors_name_what_they_are_about(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError, match="nothing.usda"):
        subadmm.load(tmp_path / "nothing.usda")
    (tmp_path / "wrong.usda").write_text("no stage")
    with pytest.raises(ValueError, match="wrong.usda"):
        subadmm.load(tmp_path / "wrong.usda")
    stage = new_stage()
    with pytest.raises(ValueError, match="keyframe"):
        subadmm.load(stage, keyframe="home")
    with pytest.raises(ValueError, match="decompose"):
        subadmm.load(stage, decompose=2.0)
    body(stage, "/mote", gprim="Sphere", radius=1e-5)
    with pytest.raises(subadmm.InvalidArgument, match="Sphere /mote"):
        subadmm.load(stage)
    for name in [name for name in sys.modules if name.startswith("pxr")]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match="pip install usd-core"):
        subadmm.load(tmp_path / "nothing.usda")


def test_a_file_by_its_suffix(tmp_path):
    """Files of text and of bytes, with instances, whose prims are seen by all."""
    stage = new_stage()
    stage.DefinePrim("/part", "Xform").GetPrim()
    collider(stage, "/part/ball", "Sphere", radius=0.1)
    for k in range(2):
        prim = stage.DefinePrim(f"/copy{k}", "Xform")
        prim.GetReferences().AddInternalReference("/part")
        prim.SetInstanceable(True)
        UsdPhysics.RigidBodyAPI.Apply(place(prim, (k, 0, 1)))
    for name in ("a.usda", "a.usdc", "a.usd"):
        stage.Export(str(tmp_path / name))
        loaded = subadmm.load(tmp_path / name)
        assert [shape for shape in loaded.shapes] == ["/part/ball", "/copy0/ball", "/copy1/ball"]
        assert loaded.bodies["/copy1"].mass == pytest.approx(4000 / 3 * np.pi * 1e-3)
    assert Sdf.Path("/part") and loaded.bodies["/copy0"].type == "dynamic"
