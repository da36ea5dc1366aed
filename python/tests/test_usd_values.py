"""Stages whose attributes have values that they cannot have: each is refused, or not carried over, by name."""
import math

import numpy as np
import pytest

import subadmm

pytest.importorskip("pxr")

from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade  # noqa: E402


#: Attributes in which an infinity says that there is no limit.
NO_LIMIT = ("lowerLimit", "upperLimit", "low", "high", "minDistance", "maxDistance", "maxForce", "breakForce",
            "breakTorque")


def stage():
    """One of each thing that has numbers."""
    made = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(made, 1.0)
    UsdGeom.SetStageUpAxis(made, "Z")
    UsdPhysics.Scene.Define(made, "/scene")
    UsdPhysics.CollisionAPI.Apply(UsdGeom.Plane.Define(made, "/ground").GetPrim())
    for k, kind in enumerate(("Cube", "Sphere", "Cone", "Cylinder", "Capsule", "Mesh")):
        prim = getattr(UsdGeom, kind).Define(made, f"/{kind}").GetPrim()
        UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(3 * k, 0, 4))
        UsdGeom.Xformable(prim).AddScaleOp().Set(Gf.Vec3f(1, 1, 1))
        for api in (UsdPhysics.CollisionAPI, UsdPhysics.RigidBodyAPI, UsdPhysics.MassAPI):
            api.Apply(prim)
    mesh = UsdGeom.Mesh(made.GetPrimAtPath("/Mesh"))
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    mesh.CreateFaceVertexCountsAttr([3] * 4)
    mesh.CreateFaceVertexIndicesAttr([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2])
    material = UsdShade.Material.Define(made, "/material")
    UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    UsdShade.MaterialBindingAPI.Apply(made.GetPrimAtPath("/Cube")).Bind(material)
    hinge = UsdPhysics.RevoluteJoint.Define(made, "/hinge")
    hinge.CreateLowerLimitAttr(-90), hinge.CreateUpperLimitAttr(90)
    drive = UsdPhysics.DriveAPI.Apply(hinge.GetPrim(), "angular")
    drive.CreateStiffnessAttr(1.0), drive.CreateDampingAttr(1.0)
    generic = UsdPhysics.Joint.Define(made, "/generic")
    limit = UsdPhysics.LimitAPI.Apply(generic.GetPrim(), "transX")
    limit.CreateLowAttr(-1), limit.CreateHighAttr(1)
    rope = UsdPhysics.DistanceJoint.Define(made, "/rope")
    rope.CreateMinDistanceAttr(0), rope.CreateMaxDistanceAttr(2)
    for joint, ends in ((hinge, ("/Cube", "/Sphere")), (generic, ("/Cone", "/Cylinder")),
                        (rope, ("/Capsule", "/Mesh"))):
        joint.CreateBody0Rel().SetTargets([ends[0]]), joint.CreateBody1Rel().SetTargets([ends[1]])
    return made


def attributes():
    """(path of the prim, name, type) of those that are read; of what all bodies have, one body's."""
    made = stage()  # which prims do not keep
    return [(str(prim.GetPath()), one.GetName(), str(one.GetTypeName()))
            for prim in made.Traverse() for one in prim.GetAttributes()
            if one.GetName() in ("radius", "height", "size", "axis", "points", "faceVertexCounts", "faceVertexIndices")
            or (one.GetName().startswith(("physics:", "xformOp:", "drive:", "limit:"))
                and str(prim.GetPath()) not in ("/Sphere", "/Cone", "/Cylinder", "/Capsule", "/generic")
                and one.GetName() not in ("xformOpOrder", "physics:excludeFromArticulation"))
            or one.GetName().startswith("limit:")]


def with_numbers(kind, x):
    """Values of a type with x in one place; none of types without numbers."""
    return {"float": [x], "double": [x], "float3": [Gf.Vec3f(0, x, 0)], "double3": [Gf.Vec3d(0, x, 0)],
            "point3f": [Gf.Vec3f(0, x, 0)], "vector3f": [Gf.Vec3f(0, x, 0)],
            "quatf": [Gf.Quatf(x, 0, 0, 0), Gf.Quatf(1, 0, x, 0)],
            "point3f[]": [[(0, 0, 0), (1, 0, 0), (0, x, 0), (0, 0, 1)]]}.get(kind, [])


def outcome(made):
    """What a load of a stage says: its error, or its report; None of a load without an error whose world cannot be
    stepped."""
    try:
        loaded = subadmm.load(made)
    except (ValueError, subadmm.Error) as error:
        assert type(error) is ValueError or isinstance(error, subadmm.Error), repr(error)  # no LinAlgError and the like
        return "error", str(error)
    assert np.isfinite(loaded.world.positions).all()
    loaded.world.step(2)
    return "report", str(loaded.report)


@pytest.fixture(scope="module")
def usual():
    return outcome(stage())[1]


@pytest.mark.parametrize("path, name, kind", [one for one in attributes() if with_numbers(one[2], 1.0)],
                         ids=lambda value: value.replace("/", "") if isinstance(value, str) else None)
def test_numbers_that_are_not_finite_are_named(path, name, kind):
    for x in (math.nan, math.inf):
        for bad in with_numbers(kind, x):
            made = stage()
            assert made.GetPrimAtPath(path).GetAttribute(name).Set(bad)
            how, said = outcome(made)
            if math.isnan(x) or not name.endswith(NO_LIMIT):
                assert f"{path}.{name}" in said or ("xformOp" in name and f" {path}: " in said), said
                assert how == "report" or "must" in said


@pytest.mark.parametrize("path, name, kind", attributes(),
                         ids=lambda value: value.replace("/", "") if isinstance(value, str) else None)
def test_values_of_another_type_are_named(path, name, kind, usual):
    made = stage()
    prim = made.GetRootLayer().GetPrimAtPath(path)
    if name in prim.attributes:
        prim.RemoveProperty(prim.attributes[name])
    text = Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.String)
    text.default = "text"
    how, said = outcome(made)
    assert said != usual, "it was taken in silence"
    assert f"{path}.{name} = 'text': must be" in said or ("xformOp" in name and f" {path}: " in said), said


@pytest.mark.parametrize("x", [1e300, -1.0, 0.0])
def test_sizes_out_of_range_are_of_their_prim(x):
    for path, name, kind in attributes():
        if name in ("radius", "height", "size"):
            made = stage()
            made.GetPrimAtPath(path).GetAttribute(name).Set(x)
            how, said = outcome(made)
            assert f" {path}: " in said and "size" in said, said


@pytest.mark.parametrize("x", [math.nan, math.inf, 0.0, -1.0, 1e300])
def test_units_are_numbers_above_0(x):
    for name, set_unit in (("metersPerUnit", UsdGeom.SetStageMetersPerUnit),
                           ("kilogramsPerUnit", UsdPhysics.SetStageKilogramsPerUnit)):
        made = stage()
        set_unit(made, x)
        assert outcome(made) == ("error", f"{name} = {x}: must be in [1e-12, 1e12]")


@pytest.mark.parametrize("path, name", [("/Cone", "axis"), ("/hinge", "physics:axis"),
                                        ("/hinge", "drive:angular:physics:type"),
                                        ("/Mesh", "orientation"), ("/ground", "axis")])
def test_names_that_there_are_not_are_named(path, name):
    made = stage()
    made.GetPrimAtPath(path).GetAttribute(name).Set("nonsense")
    how, said = outcome(made)
    assert f"{path}.{name} = 'nonsense': must be one of" in said
