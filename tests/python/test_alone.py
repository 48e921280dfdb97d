"""What the program measures and writes, judged by trimesh and libigl on shapes made here: needs nothing
beside the repository.
"""
import math
import pathlib
import runpy

import pytest

np = pytest.importorskip("numpy")
trimesh = pytest.importorskip("trimesh")
SHAPES = runpy.run_path(str(pathlib.Path(__file__).resolve().parents[1] / "peers" / "shapes.py"))


@pytest.fixture
def ring(tmp_path):
    V, F = SHAPES["clean"]("ring")
    path = tmp_path / "ring.ply"
    trimesh.Trimesh(V, F, process=False).export(path)
    return path, V, F


def test_distances_of_points_are_those_of_libigl(ring, atlasfit, tmp_path):
    igl = pytest.importorskip("igl")
    path, V, F = ring
    V = trimesh.load(path, process=False).vertices.view(np.ndarray)  # as the file holds them
    P = SHAPES["noisy"](V, F, 0.01)
    np.savetxt(tmp_path / "points.xyz", P, fmt="%.17g")
    d = np.sqrt(igl.point_mesh_squared_distance(P, V, F.astype(np.int64))[0])
    ours = atlasfit("measure", tmp_path / "points.xyz", "--against", path)["points"]["accuracy"]
    assert math.isclose(ours["rms"], np.sqrt((d**2).mean()), rel_tol=1e-6)
    assert math.isclose(ours["median"], np.median(d), rel_tol=1e-6)


def test_topology_is_that_of_trimesh(ring, atlasfit):
    path, V, F = ring
    mesh = trimesh.Trimesh(V, F)
    ours = atlasfit("info", path)
    assert ours["topology"]["euler"] == mesh.euler_number
    assert ours["parts"] == mesh.body_count
    assert np.allclose([ours["extent"]["min"], ours["extent"]["max"]], mesh.bounds, atol=1e-6)


@pytest.mark.parametrize("name", ["a.ply", "a.obj", "a.glb", "a.off", "a.stl"])
def test_trimesh_reads_what_convert_writes(name, ring, atlasfit, tmp_path):
    path, V, F = ring
    atlasfit("convert", path, tmp_path / name)
    mesh = trimesh.load(tmp_path / name, force="mesh")
    truth = trimesh.Trimesh(V, F)
    assert len(mesh.faces) == len(F)
    assert math.isclose(mesh.area, truth.area, rel_tol=1e-5)
    assert np.allclose(mesh.bounds, truth.bounds, atol=1e-5)
