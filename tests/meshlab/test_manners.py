"""What people expect of a MeshLab filter: textures stay, layers are merged, lengths are shares too."""
import re
import subprocess
import sys

import numpy as np
import pymeshlab as ml
import pytest
from PIL import Image

from conftest import ROOT
from pages import bold, code
from test_pymeshlab import (
    DENOISE, DISTORTION, PACK, RECONSTRUCT, UNWRAP, document, holding, layers, opened, textured,
)

pytestmark = pytest.mark.usefixtures("plugin")


def painted_with(folder, image, name="old.png"):
    """A square of two faces whose UVs are its places, with a texture file."""
    Image.fromarray(image).save(folder / name)
    square = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.0]])
    (folder / "square.mtl").write_text(f"newmtl old\nmap_Kd {name}\n")
    lines = ["mtllib square.mtl", "usemtl old"]
    lines += [f"v {x} {y} {z}" for x, y, z in square] + ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    (folder / "square.obj").write_text("\n".join([*lines, "f 1/1 2/2 3/3", "f 1/1 3/3 4/4"]) + "\n")
    return opened(folder / "square.obj")


def colours_at(image, uv):
    """Texels at UVs, the nearest one."""
    height, width = image.shape[:2]
    x, y = np.clip((uv * [width, height]).astype(int), 0, [width - 1, height - 1]).T
    return image[height - 1 - y, x].astype(int)


def test_a_texture_is_drawn_anew_for_the_new_uvs(folder):
    y, x = np.mgrid[0:200, 0:400] / [[[200]], [[400]]]
    old = np.uint8(np.stack([255 * x, 255 * y, 128 + 0 * x], 2))
    ms = painted_with(folder, old)
    values = ms.apply_filter(UNWRAP)
    assert values["flips"] == 0 and ms.current_mesh().texture_number() == 1
    out = folder / "anew"
    out.mkdir(exist_ok=True)
    ms.save_current_mesh(str(out / "square.obj"))
    (file,) = out.glob("*.png")
    new = np.asarray(Image.open(file).convert("RGB"))
    uv = ms.current_mesh().wedge_tex_coord_matrix().reshape(-1, 3, 2)
    corners = ms.current_mesh().vertex_matrix()[ms.current_mesh().face_matrix()][:, :, :2] / [2, 1]
    weight = np.random.default_rng(0).dirichlet([1, 1, 1], 5000)[:, :, None]
    for face in (0, 1):
        before = colours_at(old, (corners[face] * weight).sum(axis=1))
        after = colours_at(new, (uv[face] * weight).sum(axis=1))
        assert np.abs(after - before).mean() < 2
    texels = values["texels_per_unit"] * new.shape[0] / 1024
    assert texels >= 200, "no lower density"


def test_packing_draws_a_texture_anew(folder):
    y, x = np.mgrid[0:200, 0:400] / [[[200]], [[400]]]
    old = np.uint8(np.stack([255 * x, 255 * y, 128 + 0 * x], 2))
    ms = painted_with(folder, old)
    assert ms.apply_filter(PACK)["charts"] == 1 and ms.current_mesh().texture_number() == 1
    out = folder / "packed"
    out.mkdir(exist_ok=True)
    ms.save_current_mesh(str(out / "square.obj"))
    (file,) = out.glob("*.png")
    new = np.asarray(Image.open(file).convert("RGB"))
    uv = ms.current_mesh().wedge_tex_coord_matrix().reshape(-1, 3, 2).mean(axis=1)
    m = ms.current_mesh()
    middle = m.vertex_matrix()[m.face_matrix()][:, :, :2].mean(axis=1) / [2, 1]
    assert np.abs(colours_at(new, uv) - colours_at(old, middle)).max() < 6


def test_charts_of_two_pages_that_meet_at_one_place_stay_two(folder):
    """Two squares side by side, with UVs that go on from one page to the other."""
    for name, colour in (("red", [255, 0, 0]), ("green", [0, 255, 0])):
        Image.fromarray(np.uint8(np.tile(colour, (64, 64, 1)))).save(folder / f"{name}.png")
    (folder / "two.mtl").write_text("".join(f"newmtl {n}\nmap_Kd {n}.png\n" for n in ("red", "green")))
    places = [(x, y) for x in (0, 1, 2) for y in (0, 1)]
    lines = ["mtllib two.mtl", *(f"v {x} {y} 0" for x, y in places), *(f"vt {x} {y}" for x, y in places)]
    for name, faces in (("red", ((1, 3, 4), (1, 4, 2))), ("green", ((3, 5, 6), (3, 6, 4)))):
        lines += [f"usemtl {name}", *("f " + " ".join(f"{v}/{v}" for v in face) for face in faces)]
    (folder / "two.obj").write_text("\n".join(lines) + "\n")
    ms = opened(folder / "two.obj")
    values = ms.apply_filter(PACK)
    assert values["charts"] == 2 and values["pages"] == 1 and values["overlapping_faces"] == 0
    out = folder / "together"
    out.mkdir(exist_ok=True)
    ms.save_current_mesh(str(out / "two.obj"))
    (file,) = out.glob("*.png")
    middle = ms.current_mesh().wedge_tex_coord_matrix().reshape(-1, 3, 2).mean(axis=1)
    shown = colours_at(np.asarray(Image.open(file).convert("RGB")), middle)
    assert (shown == np.repeat([[255, 0, 0], [0, 255, 0]], 2, axis=0)).all()


def test_a_mesh_without_colours_gets_no_page(torus):
    ms = holding(*torus)
    assert ms.apply_filter(UNWRAP)["charts"] > 0 and ms.current_mesh().texture_number() == 0
    ms = holding(*torus)
    ms.apply_filter(UNWRAP, texture="Checker")
    assert ms.current_mesh().texture_number() == 1


def test_visible_layers_are_merged(scan):
    whole = opened(scan)
    halves = document()
    points, colours = whole.current_mesh().vertex_matrix(), whole.current_mesh().vertex_color_matrix()
    for half in (points[:, 0] < 0, points[:, 0] >= 0):
        halves.add_mesh(ml.Mesh(points[half], v_color_matrix=colours[half]))
    stray = ml.Mesh(points * 5 + 3)
    halves.add_mesh(stray)
    halves.set_current_mesh_visibility(False)
    halves.set_current_mesh(0)
    expected = whole.apply_filter(RECONSTRUCT, uv=False)
    values = halves.apply_filter(RECONSTRUCT, uv=False, visiblelayers=True)
    assert layers(halves) == 4 and values["points"] == expected["points"]
    assert values["noise"] == pytest.approx(expected["noise"], rel=0.05)
    assert halves.current_mesh().has_vertex_color()
    alone = halves.mesh(0).vertex_number()
    halves.set_current_mesh(0)
    assert halves.apply_filter(RECONSTRUCT, uv=False)["points"] == alone


def test_layers_that_lie_apart_are_moved_together(scan):
    points = opened(scan).current_mesh().vertex_matrix()
    shift = 0.01 * np.linalg.norm(np.ptp(points, axis=0))
    sweeps = document()
    for sweep, way in ((points[::2], 0), (points[1::2], shift)):
        sweeps.add_mesh(ml.Mesh(sweep + [way, 0, 0]))
    values = sweeps.apply_filter(RECONSTRUCT, uv=False, visiblelayers=True, movelayers=True)
    assert values["apart_after"] < 0.5 * values["apart_before"]
    assert (sweeps.mesh(1).vertex_matrix() == points[1::2] + [shift, 0, 0]).all()
    with pytest.raises(Exception, match="one layer"):
        opened(scan).apply_filter(RECONSTRUCT, uv=False, movelayers=True)


def test_lengths_are_shares_of_the_diagonal_too(scan):
    diagonal = np.linalg.norm(np.ptp(opened(scan).current_mesh().vertex_matrix(), axis=0))
    pure = getattr(ml, "PureValue", getattr(ml, "AbsoluteValue", None))
    share = getattr(ml, "PercentageValue", getattr(ml, "Percentage", None))
    for value in (pure(0.01 * diagonal), share(1.0)):
        found = opened(scan).apply_filter(DENOISE, noise=value)["noise"]
        assert found == pytest.approx(0.01 * diagonal, rel=1e-3)


def test_distortion_is_shown_in_colours_from_blue_to_red(folder):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0], [3, 0, 0], [4, 0, 0], [4, 1, 0], [3, 1,
    0]])
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    uv = np.concatenate([square[f][:, :2] * ([0.2, 0.2] if f[0] == 0 else [0.4, 0.1]) for f in faces])
    ms = textured(folder, square, faces, uv)
    ms.apply_filter(DISTORTION)
    colours = ms.current_mesh().face_color_matrix()
    assert ms.current_mesh().has_face_color() and (colours[0, 2] > 0.99) and (colours[2, 0] > 0.99)
    ms = textured(folder, square, faces, uv)
    ms.apply_filter(DISTORTION, colorize=False)
    plain = ms.current_mesh()
    assert not plain.has_face_color() or np.ptp(plain.face_color_matrix(), axis=0).max() == 0


def test_a_vertex_that_is_not_finite_does_not_spoil_the_distortion_of_the_others(torus):
    ms = holding(*torus)
    ms.apply_filter(UNWRAP)
    before = ms.apply_filter(DISTORTION)
    broken = {axis: f"(vi == 7) ? 0/0 : {axis}" for axis in "xyz"}
    ms.apply_filter("compute_coord_by_function", **broken)
    assert np.isnan(ms.current_mesh().vertex_matrix()).sum() == 3
    values = ms.apply_filter(DISTORTION)
    assert values["stretch_median"] == pytest.approx(before["stretch_median"], rel=0.01)
    assert np.isfinite(ms.current_mesh().face_scalar_array()).all()


def test_the_page_for_meshlab_works_to_the_letter(scan, tmp_path):
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples/vase.ply").write_bytes(scan.read_bytes())
    page = code("meshlab.md")
    if not hasattr(ml, "PercentageValue"):  # 2022.2
        page = page.replace("PercentageValue", "Percentage")
    script = "import os\n" + page + "\nimport sys\nsys.stdout.flush()\nos._exit(0)\n"
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("vase 0.0"), done.stderr
    assert {"vase.obj", "vase.obj.mtl", "vase_atlas.png"} <= {p.name for p in tmp_path.iterdir()}
    about = (ROOT / "meshlab-plugin/src/about.cpp").read_text()
    assert bold("meshlab.md") and all(f'{{"{name}", ' in about for name in bold("meshlab.md"))


def test_names_and_help_are_what_people_look_for():
    about = (ROOT / "meshlab-plugin/src/about.cpp").read_text()
    names = ("Surface Reconstruction", "Denoise", "Parametrization")
    for name in (*(f"{name}: Atlas" for name in names), "Parametrization: Pack Charts", "UV Distortion"):
        assert f'{{"{name}", ' in about
    assert "(deep manifold prior)" not in about
    text = re.sub(r'"\s+"', "", about)
    for word in ("UV unwrap", "noise", "outliers", "parametrization", "point cloud", "noisy scan"):
        assert word in text, word
