"""The plugin in pymeshlab's MeshLab: the program's results, the host's rules, the host's errors."""
import os
import pathlib
import re
import resource
import subprocess
import sys

import numpy as np
import made
import pymeshlab as ml
import pytest

from conftest import ROOT

RECONSTRUCT = "generate_surface_reconstruction_atlas"
DENOISE = "apply_coord_denoising_atlas"
UNWRAP = "compute_texcoord_parametrization_atlas"
PACK = "compute_texcoord_packing_atlas"
DISTORTION = "compute_scalar_by_uv_distortion_per_face"
DATA = ROOT.parent / "shared/data"


pytestmark = pytest.mark.usefixtures("plugin")

# A mesh dies with its MeshSet, whoever still holds it, and pymeshlab writes its log to a MeshSet that may be
# gone: they stay until the end.
KEPT = []


def document(mesh=None):
    KEPT.append(ml.MeshSet(verbose=False))
    if mesh is not None:
        KEPT[-1].add_mesh(mesh)
    return KEPT[-1]


def opened(path):
    ms = document()
    ms.load_new_mesh(str(path))
    return ms


def layers(ms):
    return ms.mesh_number() if hasattr(ms, "mesh_number") else ms.number_meshes()  # 2022.2


def textured(folder, vertices, faces, uv):
    """A mesh with three UVs per face."""
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"vt {u} {v}" for u, v in uv]
    lines += [
        "f " + " ".join(f"{v + 1}/{3 * i + k + 1}" for k, v in enumerate(f)) for i, f in enumerate(faces)
    ]
    (folder / "textured.obj").write_text("\n".join(lines) + "\n")
    return opened(folder / "textured.obj")


def holding(vertices, faces):
    return document(ml.Mesh(vertices, np.asarray(faces, np.int32)))


def f32(a):
    return np.asarray(a).astype(np.float32)


@pytest.fixture(scope="session")
def reconstructed(plugin, scan):
    ms = opened(scan)
    return ms, ms.apply_filter(RECONSTRUCT)


def test_reconstruction_is_what_the_program_makes(scan, reconstructed, folder, atlasfit):
    ms, values = reconstructed
    said = atlasfit("denoise", scan, "-o", folder / "cli.ply")
    theirs = opened(folder / "cli.ply").current_mesh()
    ours = ms.current_mesh()
    assert np.array_equal(ours.face_matrix(), theirs.face_matrix())
    assert np.array_equal(f32(ours.vertex_matrix()), f32(theirs.vertex_matrix()))
    assert np.array_equal(f32(ours.wedge_tex_coord_matrix()), f32(theirs.wedge_tex_coord_matrix()))
    assert np.abs(ours.vertex_color_matrix() - theirs.vertex_color_matrix()).max() < 1.01 / 255
    for name in ("charts", "outliers", "vertices", "faces", "uv_charts", "boundary_edges"):
        assert values[name] == said[name], name
    assert values["noise"] == pytest.approx(said["noise"], rel=1e-6)


def test_reconstruction_adds_a_layer_and_keeps_the_scan(scan, reconstructed):
    ms, _ = reconstructed
    assert layers(ms) == 2 and ms.current_mesh_id() == 1
    assert np.array_equal(ms.mesh(0).vertex_matrix(), opened(scan).current_mesh().vertex_matrix())
    m = ms.current_mesh()
    assert m.has_vertex_color() and m.has_wedge_tex_coord()
    assert np.allclose(np.linalg.norm(m.vertex_normal_matrix(), axis=1), 1, atol=1e-4)
    assert list(m.textures()) == ["scan_atlas.png"]


def test_the_baked_page_shows_the_vertex_colours(reconstructed, folder):
    ms, _ = reconstructed
    before = ms.current_mesh().vertex_color_matrix()
    ms.save_current_mesh(str(folder / "baked.obj"))
    back = opened(folder / "baked.obj")
    back.apply_filter("compute_color_from_texture_per_vertex")
    after = back.current_mesh().vertex_color_matrix()
    assert np.mean(np.abs(after[:, :3] - before[:, :3])) < 0.03


def test_denoising_is_what_the_program_makes(scan, folder, atlasfit):
    ms = opened(scan)
    before = ms.current_mesh().vertex_matrix().copy()
    colours = ms.current_mesh().vertex_color_matrix().copy()
    ms.apply_filter("compute_selection_by_condition_per_vertex", condselect="x < 0")
    selected = ms.current_mesh().vertex_selection_array().copy()
    ms.apply_filter(DENOISE)
    atlasfit("denoise", scan, "--points", folder / "points.ply")
    m = ms.current_mesh()
    assert np.array_equal(
        f32(m.vertex_matrix()), f32(opened(folder / "points.ply").current_mesh().vertex_matrix())
    )
    assert (
        np.array_equal(m.vertex_color_matrix(), colours)
        and np.array_equal(m.vertex_selection_array(), selected)
    )
    assert np.allclose(m.vertex_scalar_array(), np.linalg.norm(m.vertex_matrix() - before, axis=1))


def test_only_selected_vertices_move(scan):
    everything, part = opened(scan), opened(scan)
    everything.apply_filter(DENOISE)
    before = part.current_mesh().vertex_matrix().copy()
    part.apply_filter("compute_selection_by_condition_per_vertex", condselect="x < 0")
    chosen = part.current_mesh().vertex_selection_array()
    assert part.apply_filter(DENOISE, onlyselected=True)["moved"] <= chosen.sum()
    after = part.current_mesh().vertex_matrix()
    assert np.array_equal(after[~chosen], before[~chosen])
    assert np.array_equal(after[chosen], everything.current_mesh().vertex_matrix()[chosen])


def test_outliers_can_be_selected_for_deletion(scan):
    ms = opened(scan)
    values = ms.apply_filter(DENOISE, selectoutliers=True)
    assert 0 < values["outliers"] == ms.current_mesh().vertex_selection_array().sum()


def test_denoising_a_mesh_keeps_its_faces(torus):
    vertices, faces = torus
    off = []
    for seed in range(1, 5):
        rng = np.random.default_rng(seed)
        ms = holding(vertices + rng.normal(0, 0.01, vertices.shape), faces)
        ms.apply_filter(DENOISE)
        m = ms.current_mesh()
        assert np.array_equal(m.face_matrix(), faces)
        p = m.vertex_matrix()
        off.append(np.hypot(np.hypot(p[:, 0], p[:, 1]) - 2, p[:, 2]) - 0.7)
    assert np.sqrt(np.mean(np.square(off))) < 0.6 * 0.01


def test_spikes_of_a_mesh_go_between_their_neighbours_and_can_be_selected(torus):
    vertices, faces = torus
    spikes = [100, 500, 900]
    spiky = vertices + np.random.default_rng(1).normal(0, 0.003, vertices.shape)
    spiky[spikes] *= 2.5
    ms = holding(spiky, faces)
    values = ms.apply_filter(DENOISE, selectoutliers=True)
    m = ms.current_mesh()
    chosen = np.flatnonzero(m.vertex_selection_array())
    assert set(spikes) <= set(chosen) and values["followed_outliers"] == values["outliers"] == len(chosen)
    p = m.vertex_matrix()
    assert np.abs(np.hypot(np.hypot(p[:, 0], p[:, 1]) - 2, p[:, 2]) - 0.7).max() < 0.05
    assert np.allclose(m.vertex_scalar_array()[spikes], np.linalg.norm(p - spiky, axis=1)[spikes], rtol=1e-3)
    assert values["moved"] == len(p)
    # Without faces they stay.
    cloud = holding(spiky, np.empty((0, 3)))
    assert cloud.apply_filter(DENOISE)["followed_outliers"] == 0
    assert np.allclose(cloud.current_mesh().vertex_matrix()[spikes], spiky[spikes])


def test_deleted_vertices_take_no_part(scan, folder):
    # MeshLab leaves deleted vertices in the layer until it is compacted.
    deleted = opened(scan)
    deleted.apply_filter("compute_selection_by_condition_per_vertex", condselect="x < -0.1")
    deleted.apply_filter("meshing_remove_selected_vertices")
    deleted.save_current_mesh(str(folder / "compact.ply"))
    fresh = opened(folder / "compact.ply")
    for ms in (deleted, fresh):
        ms.apply_filter(RECONSTRUCT, uv=False)
    assert np.array_equal(deleted.current_mesh().face_matrix(), fresh.current_mesh().face_matrix())
    assert np.array_equal(
        f32(deleted.current_mesh().vertex_matrix()), f32(fresh.current_mesh().vertex_matrix())
    )


def test_the_layers_matrix_is_applied_and_kept(scan, reconstructed):
    ms = opened(scan)
    matrix = np.diag([1000.0, 1000.0, 1000.0, 1.0])
    matrix[:3, 3] = [5, 6, 7]
    ms.apply_filter("set_matrix", transformmatrix=matrix, freeze=False)
    values = ms.apply_filter(RECONSTRUCT, uv=False)
    assert values["noise"] == pytest.approx(1000 * reconstructed[1]["noise"], rel=1e-3)
    m = ms.current_mesh()
    if hasattr(m, "transform_matrix"):  # not in 2022.2
        assert np.array_equal(m.transform_matrix(), matrix)
    box, expected = m.vertex_matrix(), reconstructed[0].current_mesh().vertex_matrix()
    assert np.allclose([box.min(0), box.max(0)], [expected.min(0), expected.max(0)], atol=2e-3)


def test_a_flat_matrix_is_an_error_and_changes_nothing(scan):
    ms = opened(scan)
    ms.apply_filter("set_matrix", transformmatrix=np.diag([1.0, 1.0, 0.0, 1.0]), freeze=False)
    with pytest.raises(ml.PyMeshLabException, match="the layer's matrix flattens it"):
        ms.apply_filter(RECONSTRUCT)
    assert layers(ms) == 1


def test_unwrapping_is_what_the_program_makes(torus, folder, atlasfit):
    path = DATA / "uv/spot.ply"
    if not path.exists():
        holding(*torus).save_current_mesh(str(folder / "torus.ply"))
        path = folder / "torus.ply"
    ms = opened(path)
    before = ms.current_mesh().vertex_matrix().copy(), ms.current_mesh().face_matrix().copy()
    values = ms.apply_filter(UNWRAP)
    said = atlasfit("unwrap", path, "-o", folder / "unwrapped.ply")
    m, theirs = ms.current_mesh(), opened(folder / "unwrapped.ply").current_mesh()
    assert np.array_equal(m.vertex_matrix(), before[0]) and np.array_equal(m.face_matrix(), before[1])
    assert np.array_equal(f32(m.wedge_tex_coord_matrix()), f32(theirs.wedge_tex_coord_matrix()))
    for name in ("charts", "flips", "overlapping_faces", "pages"):
        assert values[name] == said[name], name
    assert values["stretch_p95"] == pytest.approx(said["stretch_p95"], rel=1e-4)
    assert m.texture_number() == 0, "no page without colours"


def test_a_broken_mesh_gets_valid_uvs(torus):
    vertices, faces = torus
    fin = np.array([[0, 1, len(vertices)], [0, 1, len(vertices) + 1], [5, 5, 6]])
    ms = holding(
        np.concatenate([vertices, [[3, 0, 2], [3, 0, -2]]]), np.concatenate([faces, faces[:20], fin])
    )
    values = ms.apply_filter(UNWRAP)
    assert values["flips"] == 0 and values["overlapping_faces"] == 0 and values["inside"] == 1


def test_quads_stay_in_one_chart(torus):
    quads = made.torus()[1].astype(np.uint32)
    ms = document(ml.Mesh(torus[0], list(quads)))
    ms.apply_filter(UNWRAP)
    mesh = ms.current_mesh()
    birth = mesh.face_custom_scalar_attribute_array("poly_birth_faces").astype(int)
    faces, uv = mesh.face_matrix(), mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    for quad in range(len(quads)):
        a, b = np.flatnonzero(birth == quad)
        corner = {v: tuple(uv[a, k]) for k, v in enumerate(faces[a])}
        assert all(corner[v] == tuple(uv[b, k]) for k, v in enumerate(faces[b]) if v in corner)


def test_several_pages_have_a_texture_each(torus):
    ms = holding(*torus)
    values = ms.apply_filter(UNWRAP, pages=4, density=100.0, texturesize=256, texture="Checker")
    assert values["pages"] > 1 and ms.current_mesh().texture_number() == values["pages"]
    assert ms.apply_filter(DISTORTION)["overlapping_faces"] == 0


def squares(sizes):
    """Squares beside each other, of these sides: vertices and faces."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    vertices = np.concatenate([side * corners + [3 * i, 0, 0] for i, side in enumerate(sizes)])
    faces = [[4 * i + k for k in t] for i in range(len(sizes)) for t in ((0, 1, 2), (0, 2, 3))]
    return vertices, np.array(faces)


def test_packing_keeps_charts_as_they_are_and_gives_them_one_density(folder):
    vertices, faces = squares([2.0, 1.0, 0.5])
    flat = vertices[faces][:, :, :2]
    piled = ((flat - flat[:, :1]) / np.ptp(flat[:, :, :1], axis=1, keepdims=True)).reshape(-1, 2)
    ms = textured(folder, vertices, faces, piled)
    assert ms.apply_filter(DISTORTION)["overlapping_faces"] > 0
    values = ms.apply_filter(PACK)
    assert values["charts"] == 3 and values["overlapping_faces"] == values["flips"] == 0
    assert values["inside"] == 1 and values["coverage"] > 0.5 and values["stretch_linf"] < 1.001
    m = ms.current_mesh()
    assert np.array_equal(m.vertex_matrix(), vertices) and np.array_equal(m.face_matrix(), faces)
    assert m.texture_number() == 0


def test_packing_what_is_packed_keeps_its_charts_and_its_stretch(torus):
    ms = holding(*torus)
    first = ms.apply_filter(UNWRAP)
    before = ms.current_mesh().face_scalar_array().copy() if ms.apply_filter(DISTORTION) else None
    packed = ms.apply_filter(PACK, padding=8, texturesize=512)
    ms.apply_filter(DISTORTION)
    assert packed["charts"] == first["charts"] and packed["overlapping_faces"] == 0
    assert np.allclose(ms.current_mesh().face_scalar_array(), before, rtol=0.01)


def test_packing_needs_texture_coordinates(torus):
    with pytest.raises(ml.PyMeshLabException, match="(?i)per.wedge texture coord"):
        holding(*torus).apply_filter(PACK)


def test_parts_of_one_shape_are_stacked_where_that_is_asked_for(torus):
    vertices, faces = torus
    both = np.concatenate([vertices, vertices[:, [1, 2, 0]] + [9, 0, 0]])
    ms = holding(both, np.concatenate([faces, faces + len(vertices)]))
    apart = ms.apply_filter(UNWRAP)
    stacked = ms.apply_filter(UNWRAP, stack="Identical")
    assert stacked["texels_per_unit"] > 1.2 * apart["texels_per_unit"]
    corners = ms.current_mesh().wedge_tex_coord_matrix().reshape(2, -1, 2).round(6)
    assert {*map(tuple, corners[0])} == {*map(tuple, corners[1])}


def test_strips_are_laid_straight_where_that_is_asked_for():
    vertices, quads = made.strip()
    ms = holding(vertices, made.triangles(quads)[0])
    assert ms.apply_filter(UNWRAP)["straightness"] < 0.5
    values = ms.apply_filter(UNWRAP, straighten=True)
    assert values["straightness"] == 1 and values["stretch_p95"] <= 1.1
    assert values["flips"] == values["overlapping_faces"] == 0
    assert ms.apply_filter(DISTORTION)["straightness"] == 1


def test_seams_cost_what_the_quality_says_and_hide_where_that_is_asked_for():
    vertices, quads = made.torus(32, 16)
    ms = holding(vertices, made.triangles(quads)[0])
    ms.apply_filter(UNWRAP)
    layout = lambda: ms.current_mesh().wedge_tex_coord_matrix()
    plain = layout()
    ms.apply_filter("compute_scalar_by_function_per_vertex", q="2")
    ms.apply_filter(UNWRAP, seamprice=True)
    assert np.array_equal(layout(), plain), "one price everywhere changes nothing"
    ms.apply_filter("compute_scalar_by_function_per_vertex", q="z > 0 ? 10 : 1")
    ms.apply_filter(UNWRAP, seamprice=True)
    assert not np.array_equal(layout(), plain)
    values = ms.apply_filter(UNWRAP, seamshidden=1)
    assert not np.array_equal(layout(), plain) and values["flips"] == values["overlapping_faces"] == 0
    ms.apply_filter("compute_scalar_by_function_per_vertex", q="-1")
    with pytest.raises(ml.PyMeshLabException, match="seam_price of vertex 0 is -1"):
        ms.apply_filter(UNWRAP, seamprice=True)


def test_the_largest_error_of_a_surface_is_a_length_or_a_share_and_all_triangles_can_be_kept(scan):
    diagonal = np.linalg.norm(np.ptp(opened(scan).current_mesh().vertex_matrix(), axis=0))
    pure = getattr(ml, "PureValue", getattr(ml, "AbsoluteValue", None))
    share = getattr(ml, "PercentageValue", getattr(ml, "Percentage", None))
    faces = lambda **how: opened(scan).apply_filter(RECONSTRUCT, uv=False, **how)["faces"]
    plain, light = faces(), faces(maxerror=share(1.0))
    assert light == faces(maxerror=pure(0.01 * diagonal)) < 0.5 * plain
    assert faces(simplify=False) > 2 * plain


def test_distortion_of_known_uvs(folder):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    faces = [[0, 1, 2], [0, 2, 3]]
    corners = np.concatenate([square[f][:, :2] for f in faces])
    same = textured(folder, square, faces, corners)
    values = same.apply_filter(DISTORTION)
    assert values["charts"] == 1 and values["flips"] == values["overlapping_faces"] == 0
    assert np.allclose(same.current_mesh().face_scalar_array(), 1, atol=1e-6)
    wide = textured(folder, square, faces, corners * [1, 0.25])
    wide.apply_filter(DISTORTION)
    assert np.allclose(wide.current_mesh().face_scalar_array(), 2, atol=1e-6)
    flipped = corners.copy()
    flipped[[4, 5]] = flipped[[5, 4]]
    assert textured(folder, square, faces, flipped).apply_filter(DISTORTION)["charts"] == 2


def test_defaults_are_the_programs(program):
    def shown(command):
        text = subprocess.run([program, command, "--help"], capture_output=True, text=True, check=True).stdout
        options = re.split(r"\n +(?:-\w, )?--", text)
        return {
            o.split(maxsplit=1)[0]: m.group(1)
            for o in options
            if (m := re.search(r"\[default: ([^\];]+)", o))
        }

    said = shown("denoise"), shown("unwrap")
    lists = printed(RECONSTRUCT), printed(UNWRAP)
    auto = {"auto": "0"}
    for (of, option), parameter in {
        (0, "noise"): "noise", (0, "strength"): "strength", (0, "detail"): "detail", (0, "charts"): "charts",
        (0, "fill-holes"): "fillholes", (0, "min-part"): "minpart", (0, "texture-size"): "texturesize",
        (0, "seed"): "seed", (0, "threads"): "threads",
        (1, "texture-size"): "texturesize", (1, "padding"): "padding",
    }.items():
        assert float(auto.get(said[of][option], said[of][option])) == float(lists[of][parameter]), parameter


def printed(name):
    """Parameters and defaults as pymeshlab prints them."""
    code = (
        f"import pymeshlab as ml; ml.load_plugin({os.environ['ATLASFIT_PLUGIN']!r}); "
        f"ml.print_filter_parameter_list({name!r})"
    )
    text = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    return {k: v.rstrip("%") for k, v in re.findall(r"^\s+(\w+) : [^=]+= (.+)$", text, re.M)}


@pytest.mark.parametrize("name, options, text", [
    (DENOISE, {"onlyselected": True}, "no vertex is selected"),
    (DENOISE, {"seed": -1}, "seed is -1. Give 0 or more"),
    (DENOISE, {"strength": -1.0}, "strength is -1"),
    (RECONSTRUCT, {"detail": 99.0}, "detail"),
    (RECONSTRUCT, {"minpart": 2.0}, "min_part is 2"),
    (RECONSTRUCT, {"faces": 9, "watertight": True}, "watertight"),
    (RECONSTRUCT, {"timelimit": 0.001}, "time limit"),
    (DENOISE, {"memorylimit": 1}, "memory"),
    (RECONSTRUCT, {"texturesize": 60000}, "more than MeshLab can hold"),
])
def test_failures_are_the_hosts_errors_and_change_nothing(scan, name, options, text):
    ms = opened(scan)
    before = ms.current_mesh().vertex_matrix().copy()
    with pytest.raises(ml.PyMeshLabException, match=f"(?s)atlasfit: .*{text}"):
        ms.apply_filter(name, **options)
    assert layers(ms) == 1 and np.array_equal(ms.current_mesh().vertex_matrix(), before)


def test_points_that_are_no_surface_are_an_error():
    line = np.linspace(0, 1, 500)[:, None] * [[1.0, 2.0, 3.0]]
    ms = document(ml.Mesh(line))
    with pytest.raises(ml.PyMeshLabException, match="atlasfit: "):
        ms.apply_filter(RECONSTRUCT)
    assert layers(ms) == 1


@pytest.mark.parametrize("name", [RECONSTRUCT, DENOISE])
def test_points_that_fill_a_volume_are_told_so_in_the_log_and_a_scan_is_not(name, scan, folder):
    def log(points):
        np.save(folder / "points.npy", points)
        # The log goes to the first document of a process.
        code = (
            f"import numpy, os, pymeshlab as ml; ml.load_plugin({os.environ['ATLASFIT_PLUGIN']!r}); "
            f"ms = ml.MeshSet(verbose=True); "
            f"ms.add_mesh(ml.Mesh(numpy.load({str(folder / 'points.npy')!r}))); "
            f"ms.apply_filter({name!r}); os._exit(0)"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert "spacing" in done.stderr
        return done.stderr

    for points in made.volumes().values():
        assert "warning: the points fill a volume" in log(points)
    assert "fill a volume" not in log(opened(scan).current_mesh().vertex_matrix())


def test_simplified_with_texture_and_exported_the_uvs_stay_valid(reconstructed, folder, atlasfit):
    ms = opened_copy(reconstructed[0], folder)
    n = ms.current_mesh().face_number()
    ms.apply_filter("meshing_decimation_quadric_edge_collapse_with_texture", targetfacenum=n // 5)
    ms.save_current_mesh(str(folder / "simple.obj"))
    text = (folder / "simple.obj").read_text()
    assert 0.9 * n / 5 < text.count("\nf ") < 1.1 * n / 5
    page = re.search(r"map_Kd (.+)", (folder / "simple.obj.mtl").read_text()).group(1).strip()
    assert (folder / page).exists()
    uv = np.array(re.findall(r"^vt (\S+) (\S+)", text, re.M), float)
    assert len(uv) and np.isfinite(uv).all() and uv.min() > -0.01 and uv.max() < 1.01
    quality = opened(folder / "simple.obj").apply_filter(DISTORTION)
    assert quality["flips"] <= 0.01 * n / 5 and quality["stretch_median"] < 1.3


def opened_copy(ms, folder):
    ms.save_current_mesh(str(folder / "copy.obj"))
    return opened(folder / "copy.obj")


def test_presets_stand_for_bounds_and_a_bound_of_ones_own_wins(torus, program):
    def charts(**how):
        return holding(*torus).apply_filter(UNWRAP, texture="None", **how)["charts"]

    few, balanced, low = (charts(preset=name) for name in ("Few seams", "Balanced", "Low stretch"))
    assert few < balanced == charts() < low
    assert charts(preset="Low stretch", maxstretch=1.3) == few
    with pytest.raises(ml.PyMeshLabException, match="max_stretch is 0.5"):
        charts(maxstretch=0.5)


def test_many_runs_in_one_process_do_not_grow_it(torus):
    def resident():
        return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20

    def rounds(n):
        for _ in range(n):
            ms.clear()
            ms.add_mesh(ml.Mesh(*torus))
            ms.apply_filter(UNWRAP)
            ms.apply_filter(DISTORTION)

    ms = document()
    rounds(5)
    before = resident()
    rounds(20)
    assert resident() - before < 10, "MiB"


def test_a_real_scan_and_a_real_mesh_are_what_the_program_makes(folder, atlasfit):
    scan, mesh = DATA / "scans/owl_sfm.ply", DATA / "uv/cow.ply"
    if not (scan.exists() and mesh.exists()):
        pytest.skip("no ../shared/data beside the repository")
    values, said = opened(scan).apply_filter(RECONSTRUCT), atlasfit("denoise", scan, "-o", folder / "owl.ply")
    for name in ("charts", "outliers", "vertices", "faces", "uv_charts", "boundary_edges"):
        assert values[name] == said[name], name
    values, said = opened(mesh).apply_filter(UNWRAP), atlasfit("unwrap", mesh, "-o", folder / "cow.ply")
    for name in ("charts", "flips", "overlapping_faces"):
        assert values[name] == said[name], name
