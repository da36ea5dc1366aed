"""A recording as a USD stage, by usd-core: an Xform a body with its poses over time, a Mesh a shape under it."""
from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

ENDINGS = (".usd", ".usda", ".usdc")


def usd_of(recording, ending: str) -> bytes:
    """The file's bytes. ending: one of ENDINGS."""
    try:
        from pxr import Gf, Usd, UsdGeom, Vt
    except ImportError as error:
        raise ImportError("USD files need the package usd-core: pip install usd-core") from error
    from .video import frames_per_second

    description, rate = recording.description, frames_per_second(recording.times)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(0)
    codes = recording.times * rate
    stage.SetEndTimeCode(float(codes[-1]))
    world = UsdGeom.Xform.Define(stage, "/world")
    stage.SetDefaultPrim(world.GetPrim())
    if recording.title:
        world.GetPrim().SetDisplayName(recording.title)

    def quaternion(q, kind):
        return kind(float(q[0]), float(q[1]), float(q[2]), float(q[3]))

    poses = [recording.poses(k) for k in range(len(codes))]
    places, turns = (np.array([pose[k] for pose in poses]) for k in (0, 1))
    for body in range(description.bodies):
        xform = UsdGeom.Xform.Define(stage, f"/world/body_{body}")
        move, turn = xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble), xform.AddOrientOp()
        moves = (np.diff(places[:, body], axis=0) != 0).any() or (np.diff(turns[:, body], axis=0) != 0).any()
        if not moves:
            move.Set(Gf.Vec3d(*map(float, places[0, body])))
            turn.Set(quaternion(turns[0, body], Gf.Quatf))
            continue
        for k, code in enumerate(codes):
            move.Set(Gf.Vec3d(*map(float, places[k, body])), float(code))
            turn.Set(quaternion(turns[k, body], Gf.Quatf), float(code))
    number = 0
    for group in description.groups:
        mesh = group.mesh
        points = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.vertices, np.float32))
        counts = Vt.IntArray.FromNumpy(np.full(len(mesh.triangles), 3, np.int32))
        corners = Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.triangles, np.int32).reshape(-1))
        normals = np.ascontiguousarray(mesh.corner_normals().reshape(-1, 3), np.float32)
        colours = np.clip(group.tinted(), 0, 1) ** 2.2     # USD's are linear
        for k, body in enumerate(group.body):
            made = UsdGeom.Mesh.Define(stage, f"/world/body_{body}/shape_{number}")
            number += 1
            made.CreatePointsAttr(points)
            made.CreateFaceVertexCountsAttr(counts)
            made.CreateFaceVertexIndicesAttr(corners)
            made.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
            made.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
            made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
            made.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
            made.CreateDisplayColorAttr([Gf.Vec3f(*map(float, colours[k]))])
            if group.opacity[k] < 1:
                made.CreateDisplayOpacityAttr([float(group.opacity[k])])
            made.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*map(float, group.position[k])))
            made.AddOrientOp().Set(quaternion(group.orientation[k], Gf.Quatf))
            made.AddScaleOp().Set(Gf.Vec3f(*map(float, group.scale[k])))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"stage{ending}"
        stage.GetRootLayer().Export(str(path))
        return path.read_bytes()
