"""Materials bound to colliders."""

from .stage import value

DEFAULT_FRICTION = 0.5  # where no physics material is bound; that of shapes


def physics_material(prim):
    """The UsdPhysics.MaterialAPI of what is bound to a prim, by the purpose 'physics' or for all; or None."""
    from pxr import UsdPhysics, UsdShade

    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    if material and material.GetPrim().HasAPI(UsdPhysics.MaterialAPI):
        return UsdPhysics.MaterialAPI(material.GetPrim())
    return None


def material_of(reader, prim):
    """Friction and restitution of a collider."""
    from pxr import UsdGeom

    for child in prim.GetChildren():
        if child.IsA(UsdGeom.Subset) and physics_material(child) is not None:
            reader.report.add(reader.element(child), "its material is not carried over: a collider has one")
    material = physics_material(prim)
    if material is None:
        return DEFAULT_FRICTION, 0.0
    still, moving = material.GetStaticFrictionAttr(), material.GetDynamicFrictionAttr()
    friction = value(moving) if moving.HasAuthoredValue() or not still.HasAuthoredValue() else value(still)
    if value(still) != value(moving) and material.GetPath() not in reader.reported:
        reader.reported.add(material.GetPath())
        reader.report.add(
            reader.element(material.GetPrim()),
            f"static friction {value(still):.4g} and dynamic {value(moving):.4g}: there is one here, {friction:.4g}",
        )
    restitution = value(material.GetRestitutionAttr())
    if not 0 <= restitution <= 1:
        reader.report.add(reader.element(material.GetPrim()), f"restitution {restitution:.4g} is brought into [0, 1]")
    return max(0.0, float(friction)), min(max(0.0, float(restitution)), 1.0)


def density_of(reader, prim):
    """Of the material of a collider, kg/m^3; 0: none."""
    material = physics_material(prim)
    density = 0.0 if material is None else value(material.GetDensityAttr())
    return density * reader.kilogram / reader.metre**3
