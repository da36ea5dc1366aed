"""What a stage has besides, and that is not carried over."""

from .stage import Counts

#: Beginnings of applied schemas that are of drawing, assets and collections, or that other parts of the import read.
NO_PHYSICS = (
    "MaterialBindingAPI", "CollectionAPI", "GeomModelAPI", "MotionAPI", "PrimvarsAPI", "VisibilityAPI",
    "XformCommonAPI", "ShapingAPI", "ShadowAPI", "LightAPI", "LightListAPI", "MeshLightAPI", "VolumeLightAPI",
    "ClipsAPI", "ModelAPI", "SkelBindingAPI", "ConnectableAPI", "CoordSysAPI", "NodeDefAPI", "Semantics",
    "ColorSpace", "AssetPreviewsAPI", "SceneGraphPrimAPI", "HydraGenerativeProceduralAPI", "RenderSettings",
    "PreviewSurface",
)  # fmt: skip
READ = (
    "PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsCollisionAPI", "PhysicsMeshCollisionAPI", "PhysicsMaterialAPI",
    "PhysicsFilteredPairsAPI", "PhysicsLimitAPI", "PhysicsDriveAPI", "PhysicsArticulationRootAPI",
)  # fmt: skip


def _is_of_instances(prim):
    """Has anything below it a body or a collider?"""
    from pxr import Usd, UsdPhysics

    return any(
        below.HasAPI(UsdPhysics.RigidBodyAPI) or below.HasAPI(UsdPhysics.CollisionAPI) for below in Usd.PrimRange(prim)
    )


def report_leftover(reader):
    """Notes on schemas and types that are not known, each once, and on what is drawn."""
    from pxr import Usd, UsdGeom, UsdLux, UsdPhysics, UsdShade

    schemas, types, drawn = Counts(), Counts(), Counts()
    registry = Usd.SchemaRegistry()
    for prim in reader.prims:
        # (those that are not registered are in the second list only)
        for name in sorted({*prim.GetAppliedSchemas(), *prim.GetPrimTypeInfo().GetAppliedAPISchemas()}):
            if not name.startswith(NO_PHYSICS + READ):
                schemas.add(name.partition(":")[0], prim)
        kind = str(prim.GetTypeName())
        if kind and not registry.FindConcretePrimDefinition(kind):
            types.add(kind, prim)
        if prim.HasAPI(UsdPhysics.MassAPI):
            if str(prim.GetPath()) not in reader.bodies and str(prim.GetPath()) not in reader.colliders:
                reader.report.add(reader.element(prim), "its mass is not carried over: it is no body and no collider")
        if prim.IsA(UsdGeom.PointInstancer) and _is_of_instances(prim):
            reader.report.add(
                reader.element(prim), "not carried over: its instances (its prototypes are, where they stand)"
            )
        if prim.IsA(UsdGeom.Gprim) and not prim.HasAPI(UsdPhysics.CollisionAPI):
            drawn.add("gprims", prim)
        elif prim.IsA(UsdGeom.Camera):
            drawn.add("cameras", prim)
        elif prim.HasAPI(UsdLux.LightAPI):
            drawn.add("lights", prim)
        elif prim.IsA(UsdShade.Material) and not prim.HasAPI(UsdPhysics.MaterialAPI):
            drawn.add("materials", prim)
    for name, count, first in schemas:
        reader.report.add(name, f"not carried over: {count}, as {first}")
    for name, count, first in types:
        reader.report.add(f"prims of type {name}", f"not carried over: {count}, as {first}")
    if any(True for _ in drawn):
        reader.report.add(
            "what is drawn", "not carried over: " + ", ".join(f"{count} {what}" for what, count, _ in drawn)
        )
