"""Meshes as several hulls, by coacd: what they fill, that they are the same each time, and what load() makes of
them."""

import sys

import numpy as np
import pytest

import subadmm

# A U: a box of 0.4 x 0.1 x 0.3 with a gap of 0.2 x 0.2 from above; along y. Volume 0.1 (0.4 x 0.3 - 0.2 x 0.2).
OUTLINE = [(-0.2, 0), (0.2, 0), (0.2, 0.3), (0.1, 0.3), (0.1, 0.1), (-0.1, 0.1), (-0.1, 0.3), (-0.2, 0.3)]
FACE = [(0, 1, 4), (0, 4, 5), (1, 2, 3), (1, 3, 4), (0, 5, 6), (0, 6, 7)]
VOLUME = 0.1 * (0.4 * 0.3 - 0.2 * 0.2)


def u_mesh():
    """Vertices and triangles, counter-clockwise seen from outside."""
    near = [(x, -0.05, z) for x, z in OUTLINE]
    far = [(x, 0.05, z) for x, z in OUTLINE]
    count = len(OUTLINE)
    triangles = [face for face in FACE] + [(a + count, c + count, b + count) for a, b, c in FACE]
    for k in range(count):
        j = (k + 1) % count
        triangles += [(k, k + count, j), (j, k + count, j + count)]
    return np.array(near + far), np.array(triangles, dtype=np.int32)


def test_the_mesh_itself():
    from subadmm.decomposition import volume_of

    vertices, triangles = u_mesh()
    assert volume_of(vertices, triangles) == pytest.approx(VOLUME)
    assert volume_of(vertices, triangles[:-1]) is None  # not closed


def test_wrong_arguments_are_named(monkeypatch):
    vertices, triangles = u_mesh()
    with pytest.raises(ValueError, match="threshold"):
        subadmm.decompose((vertices, triangles), threshold=0)
    with pytest.raises(ValueError, match="most"):
        subadmm.decompose((vertices, triangles), most=0)
    with pytest.raises(ValueError, match="triangles must be"):
        subadmm.decompose((vertices, triangles + 100))
    with pytest.raises(ValueError, match="a box has no triangles"):
        subadmm.decompose(subadmm.box(1, 1, 1))
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(ImportError, match="pip install coacd"):
        subadmm.decompose((vertices, triangles))


def test_hulls_fill_the_mesh_and_are_the_same_each_time():
    pytest.importorskip("coacd")
    parts = subadmm.decompose(u_mesh(), friction=0.3)
    assert 2 <= len(parts) <= 8 and all(part.type == "hull" and part.friction == 0.3 for part in parts)
    # hulls of cut parts of a solid of flat faces: coacd moves vertices by some 1e-3 of the size
    assert subadmm.mass_of(parts, 1.0).mass == pytest.approx(VOLUME, rel=0.02)
    again = subadmm.decompose(subadmm.mesh(*u_mesh(), friction=0.7))
    assert [part.friction for part in again] == [0.7] * len(parts)
    for one, other in zip(parts, again):
        assert np.array_equal(one.geometry()[0], other.geometry()[0])


HOOK = """
<mujoco><asset><mesh name="u" vertex="{vertices}" face="{faces}"/></asset><worldbody>
  <geom name="bar" type="box" size=".05 .3 .05" pos="0 0 1"/>
  <body name="hook" pos="0 0 1.17" quat="0 1 0 0"><freejoint/><geom name="u" type="mesh" mesh="u"/></body>
</worldbody></mujoco>
"""


def hook(**options):
    mujoco = pytest.importorskip("mujoco")
    vertices, triangles = u_mesh()
    text = HOOK.format(vertices=" ".join(map(str, vertices.ravel())), faces=" ".join(map(str, triangles.ravel())))
    return subadmm.load(mujoco.MjModel.from_xml_string(text), **options)


def test_a_hook_hangs_on_a_bar():
    """A U, upside down, over a bar that is in its gap: its hull is pushed out, the U stays."""
    hull = hook()
    note = [note for note in hull.report if "geoms u" in note.element]
    assert len(note) == 1 and "1.5 times" in note[0].reason  # 0.12 / 0.08
    pytest.importorskip("coacd")
    several = hook(decompose=0.2)
    assert len(several.shapes[several.source.geom("u").id]) > 1 and not [
        n for n in several.report if "geoms u" in n.element
    ]
    assert several.bodies["hook"].mass == hull.bodies["hook"].mass  # MuJoCo's, of the mesh
    several.world.step(1000)
    report, place = several.world.report, several.bodies["hook"].position
    assert report.contacts >= 2 and place[2] > 1 and np.linalg.norm(several.bodies["hook"].linear_velocity) < 1e-3


def u_stage():
    """Two U's, one that asks for a decomposition and one for a hull."""
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    vertices, triangles = u_mesh()
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for path in ("/asked", "/hull"):
        mesh = UsdGeom.Mesh.Define(stage, path)
        mesh.CreatePointsAttr([Gf.Vec3f(*map(float, v)) for v in vertices])
        mesh.CreateFaceVertexCountsAttr([3] * len(triangles))
        mesh.CreateFaceVertexIndicesAttr([int(k) for k in triangles.ravel()])
        UsdPhysics.CollisionAPI.Apply(mesh.GetPrim()), UsdPhysics.RigidBodyAPI.Apply(mesh.GetPrim())
        kind = "convexDecomposition" if path == "/asked" else "convexHull"
        UsdPhysics.MeshCollisionAPI.Apply(mesh.GetPrim()).CreateApproximationAttr(kind)
    return stage


def test_without_coacd(monkeypatch):
    """A stage that asks for parts has one hull then; a caller that does is told."""
    pytest.importorskip("pxr")
    stage = u_stage()
    monkeypatch.setitem(sys.modules, "coacd", None)
    loaded = subadmm.load(stage)
    assert len(loaded.shapes["/asked"]) == 1
    assert any("/asked" in note.element and "one hull" in note.reason for note in loaded.report)
    with pytest.raises(ImportError, match="pip install coacd"):
        subadmm.load(stage, decompose=True)


def test_a_stage_that_asks_for_it():
    pytest.importorskip("pxr")
    pytest.importorskip("coacd")
    stage = u_stage()
    loaded = subadmm.load(stage)
    said = [str(note) for note in loaded.report]
    assert any("/hull" in note and "1.5 times" in note for note in said)
    assert loaded.bodies["/hull"].mass == pytest.approx(12, rel=1e-6)
    assert len(loaded.shapes["/asked"]) > 1 and loaded.bodies["/asked"].mass == pytest.approx(8, rel=0.02)
    assert len(subadmm.load(stage, decompose=0.1).shapes["/hull"]) > 1
