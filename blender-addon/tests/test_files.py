"""load() and save(): every format through the library, and what it cannot do is said."""

import zlib

import atlasfit
import numpy as np
import pytest
from atlasfit import _abi
from made import torus, triangles


@pytest.fixture(scope="module")
def mesh():
    vertices, quads = torus()
    return vertices, triangles(quads)[0]


@pytest.fixture(scope="module")
def denoised(sphere):
    colors = np.uint8(127.5 + 127 * np.clip(sphere, -1, 1))
    return atlasfit.denoise(sphere, colors=colors, attributes={"label": np.uint8(sphere[:, 2] > 0)})


def test_a_ply_file_holds_all_that_is_given(tmp_path, denoised):
    path = tmp_path / "surface.ply"
    assert atlasfit.save(path, denoised) == ("colours rounded to 8 bits",)
    back, s = atlasfit.load(path), denoised.surface
    assert np.array_equal(back.points, s.vertices) and np.array_equal(back.triangles, s.triangles)
    assert np.array_equal(back.corner_uv, s.corner_uv) and np.array_equal(back.face_charts, s.face_charts)
    assert np.allclose(back.normals, s.normals, atol=1e-6)
    assert np.abs(back.colors - s.colors).max() <= 0.51 / 255
    assert back.attributes["label"].dtype == np.uint8
    assert np.array_equal(back.attributes["label"], s.attributes["label"])
    assert s.corner_normals is None, "a sphere has no crease"
    assert back.notes == () and back.viewpoint is None and back.texture is None
    assert repr(back).startswith(
        f"Loaded({len(s.vertices):,} points, {len(s.triangles):,} triangles, normals, "
    )


@pytest.mark.parametrize("extension", ["ply", "obj", "glb", "off", "stl", "xyz"])
def test_every_format_that_is_written_is_read_again(tmp_path, mesh, extension):
    path = tmp_path / f"torus.{extension}"
    atlasfit.save(path, *mesh)
    back = atlasfit.load(str(path))
    assert len(back.triangles) == (0 if extension == "xyz" else len(mesh[1]))
    lengths = np.abs(back.points).max(axis=0)
    assert np.allclose(lengths, np.abs(mesh[0]).max(axis=0), rtol=1e-5)


def test_polygons_are_saved_as_they_are_where_the_format_holds_them(tmp_path):
    vertices, quads = torus(6, 4)
    faces = [*quads[1:].tolist(), *triangles(quads[:1])[0].tolist()]
    uv = np.random.default_rng(1).random((4 * 23 + 6, 2), np.float32)
    charts = np.arange(len(faces))
    for given in (quads, faces, tuple(map(np.asarray, faces))):
        atlasfit.save(tmp_path / "torus.off", vertices, given)
        assert (tmp_path / "torus.off").read_text().split()[1:3] == ["24", str(len(given))]
    atlasfit.save(tmp_path / "torus.obj", vertices, faces, corner_uv=uv, face_charts=charts)
    lines = (tmp_path / "torus.obj").read_text().splitlines()
    sizes = [len(line.split()) - 1 for line in lines if line.startswith("f ")]
    assert sorted(sizes) == sorted(map(len, faces))
    back = atlasfit.load(tmp_path / "torus.obj")
    assert len(back.triangles) == 48 and back.corner_uv.shape == (48, 3, 2)
    atlasfit.save(tmp_path / "torus.glb", vertices, quads, corner_uv=np.zeros((24, 4, 2)))
    assert len(atlasfit.load(tmp_path / "torus.glb").triangles) == 48
    with pytest.raises(ValueError, match=r"Give \(98, 2\)"):
        atlasfit.save(tmp_path / "torus.obj", vertices, faces, corner_uv=uv[1:])
    with pytest.raises(ValueError, match="at least three"):
        atlasfit.save(tmp_path / "torus.obj", vertices, quads[:, :2])
    with pytest.raises(atlasfit.Error, match="holds 24 but there are only 24 vertices"):
        atlasfit.save(tmp_path / "torus.obj", vertices, [[0, 1, 2, 24]])


def roof(n=4000):
    """Points of two planes that meet in a ridge along y, with a little noise."""
    x, y, z = np.random.default_rng(1).uniform(-0.5, 0.5, (3, n))
    return np.stack([x, y, 0.004 * z - np.abs(x)], axis=1)


def test_a_crease_keeps_its_normals_through_files_that_hold_them(tmp_path):
    surface = atlasfit.denoise(roof()).surface
    normals = surface.corner_normals
    assert normals.shape == (*surface.triangles.shape, 3) and "creases" in repr(surface)
    on_ridge = (np.abs(surface.vertices[:, 0]) < 0.004)[surface.triangles]
    sides = np.abs(normals[on_ridge] @ [1, 0, 0])
    assert on_ridge.sum() > 50 and np.median(np.abs(sides - 0.5**0.5)) < 0.02
    for name in ("a.obj", "a.glb"):
        atlasfit.save(tmp_path / name, surface)
        assert np.array_equal(atlasfit.load(tmp_path / name).corner_normals, normals)
    lost = atlasfit.save(tmp_path / "a.ply", surface)
    assert any("normals that differ" in line for line in lost)
    assert atlasfit.load(tmp_path / "a.ply").corner_normals is None
    with pytest.raises(ValueError, match="corner_normals"):
        atlasfit.save(tmp_path / "b.obj", surface, corner_normals=normals[1:])


def test_points_and_labels_of_all_types_come_back_exactly(tmp_path):
    points = np.array([[500_000.123, 5_000_000.456, 10], [1, 2, 3], [4, 5, 6]])
    types = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"]
    given = {kind: np.array([0, 1, 100]).astype(kind) for kind in types}
    path = tmp_path / "cloud.ply"
    assert atlasfit.save(path, points, attributes=given) == ()
    back = atlasfit.load(path)
    assert np.array_equal(back.points, points) and len(back.triangles) == 0
    for kind, values in given.items():
        assert back.attributes[kind].dtype == values.dtype and np.array_equal(back.attributes[kind], values)


def test_what_was_loaded_goes_into_denoise_and_out_again(tmp_path, sphere):
    path = tmp_path / "scan.xyz"
    atlasfit.save(path, sphere, colors=np.uint8([[255, 0, 0]] * len(sphere)))
    scan = atlasfit.load(path)
    result = atlasfit.denoise(scan.points, **scan.columns(), uv=False)
    assert result.surface.colors is not None and (result.surface.colors[:, 0] > 0.99).all()
    atlasfit.save(tmp_path / "again.ply", scan)
    assert np.array_equal(atlasfit.load(tmp_path / "again.ply").points, scan.points)


def test_a_texture_goes_with_a_mesh(tmp_path, mesh):
    uv = atlasfit.unwrap(*mesh)
    mesh = np.float32(mesh[0]), mesh[1]  # what GLB holds
    texels = atlasfit.bake(*mesh, uv.corner_uv, np.uint8([[9, 200, 30]] * len(mesh[0])), page_size=64)
    for name in ("torus.glb", "torus.obj"):
        assert atlasfit.save(tmp_path / name, *mesh, corner_uv=uv.corner_uv, texture=texels) == ()
        image = atlasfit.load(tmp_path / name).texture
        assert image.startswith(b"\x89PNG")
        data = image[image.index(b"IDAT") + 4 : image.index(b"IEND") - 8]
        rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(64, 1 + 4 * 64)
        assert (rows[:, 1:].reshape(64, 64, 4) == texels).all(), name
    assert (tmp_path / "torus.png").exists(), "beside the OBJ file"
    with pytest.raises(ValueError, match="texture is float64"):
        atlasfit.save(tmp_path / "bad.glb", *mesh, corner_uv=uv.corner_uv, texture=texels / 255)


def test_what_a_file_needed_mended_is_said(tmp_path):
    path = tmp_path / "two.off"
    path.write_text("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 7\n")
    back = atlasfit.load(path)
    assert len(back.triangles) == 1 and "faces that name a vertex that is not there" in back.notes[0]


def test_failures_say_which_file_and_why_and_leave_what_was_there(tmp_path, mesh, sphere):
    old = tmp_path / "old.ply"
    old.write_bytes(b"mine")
    cases = [
        (lambda: atlasfit.load(tmp_path / "none.ply"), _abi.IO, "none.ply: cannot open it"),
        (lambda: atlasfit.load(tmp_path), _abi.BAD_FILE, "folder"),
        (lambda: atlasfit.load(old), _abi.BAD_FILE, "old.ply"),
        (lambda: atlasfit.save(tmp_path / "a.e57", sphere), _abi.BAD_FILE, "only read"),
        (lambda: atlasfit.save(tmp_path / "a.stl", sphere), _abi.BAD_FILE, "no triangles"),
        (lambda: atlasfit.save(tmp_path / "no" / "a.ply", sphere), _abi.IO, "cannot"),
        (lambda: atlasfit.save(old, mesh[0], [[0, 1, 99999]]), _abi.BAD_FILE, "triangle 0"),
        (lambda: atlasfit.save(old, sphere, progress=lambda *_: False), _abi.CANCELLED, "cancel"),
        (lambda: atlasfit.load(old, memory_limit=1), _abi.OUT_OF_MEMORY, "memory"),
    ]
    for call, status, text in cases:
        with pytest.raises(atlasfit.Error, match=text) as caught:
            call()
        assert caught.value.status == status
    assert old.read_bytes() == b"mine" and [p.name for p in tmp_path.iterdir()] == ["old.ply"]
    with pytest.raises(ValueError, match="normals has 1 rows"):
        atlasfit.save(old, sphere, normals=[[0, 0, 1]])
    with pytest.raises(TypeError, match="unknown option shape"):
        atlasfit.load(old, shape=1)


def test_a_path_may_hold_any_letters(tmp_path, sphere):
    path = tmp_path / "Übung – 点.ply"
    atlasfit.save(path, sphere)
    assert len(atlasfit.load(path).points) == len(sphere)
