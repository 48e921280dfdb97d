"""The package does what it says: results, errors, no copies, no leaks."""

import gc
import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import atlasfit
import numpy as np
import pytest
from atlasfit import _abi, _arrays
from made import sphere_points, torus, triangles, volumes


@pytest.fixture(scope="module")
def denoised(sphere):
    return atlasfit.denoise(sphere, attributes={"label": np.arange(len(sphere), dtype=np.int32)})


def test_denoising_a_sphere_brings_its_points_nearer_to_it(sphere, denoised):
    error = lambda p: np.sqrt(np.mean((np.linalg.norm(p, axis=1) - 1) ** 2))
    assert denoised.points.shape == sphere.shape and denoised.points.dtype == np.float64
    assert error(denoised.points) < 0.5 * error(sphere)
    on_a_chart = denoised.charts != atlasfit.NO_CHART
    assert (~on_a_chart).sum() == denoised.report.outliers < 30
    assert np.allclose(np.linalg.norm(denoised.normals[on_a_chart], axis=1), 1, atol=1e-3)
    assert (denoised.sources == np.arange(len(sphere))).all()
    assert denoised.report.noise == pytest.approx(0.01, rel=0.3)


def test_the_surface_is_closed_and_has_uvs(denoised):
    s = denoised.surface
    topology = atlasfit.measure_topology(s.vertices, s.triangles)
    assert topology.closed is True and topology.genus == 0 and topology.parts == 1
    assert (topology.vertices, topology.faces) == (len(s.vertices), len(s.triangles))
    quality = atlasfit.measure_uv(s.vertices, s.triangles, s.corner_uv)
    assert quality.flips == 0 and quality.overlapping_faces == 0 and quality.inside and quality.finite
    assert quality.charts == denoised.report.uv_charts == s.face_charts.max() + 1
    assert quality.face_stretch.shape == (len(s.triangles),)


def test_presets_stand_for_bounds_on_the_stretch_and_a_bound_of_ones_own_wins():
    vertices, quads = torus()
    faces = triangles(quads)[0]
    of = lambda **how: atlasfit.unwrap(vertices, faces, **how).info
    few, balanced, low = (of(preset=name) for name in ("few-seams", "balanced", "low-stretch"))
    assert few.stretch_bound > balanced.stretch_bound == of().stretch_bound > low.stretch_bound > 1
    assert few.charts < balanced.charts < low.charts
    assert of(preset="few-seams", max_stretch=1.07).stretch_bound == 1.07
    with pytest.raises(ValueError, match="preset is 'best'. Give one of few-seams, balanced, low-stretch"):
        of(preset="best")


def spiky_torus():
    """Vertices of a torus with noise and five spikes, its triangles, and the vertices with spikes."""
    vertices, quads = torus(96, 48)
    spikes = np.array([100, 1500, 2222, 3000, 4000])
    vertices += np.random.default_rng(3).normal(0, 0.003, vertices.shape)
    vertices[spikes] *= 2.5
    return vertices, triangles(quads)[0], spikes


def test_outliers_of_a_mesh_follow_their_neighbours_and_those_of_a_cloud_stay():
    vertices, faces, spikes = spiky_torus()
    off = lambda p: np.abs(np.hypot(np.hypot(p[:, 0], p[:, 1]) - 1, p[:, 2]) - 0.4)
    cloud = atlasfit.denoise(vertices, uv=False)
    assert (cloud.points[spikes] == vertices[spikes]).all() and cloud.report.followed_outliers == 0
    mesh = atlasfit.denoise(vertices, triangles=faces, uv=False)
    assert 5 <= mesh.report.followed_outliers == mesh.report.outliers and off(mesh.points).max() < 0.02
    assert (mesh.charts[spikes] == atlasfit.NO_CHART).all(), "they can still be selected"
    assert (np.delete(mesh.points, spikes, 0) == np.delete(cloud.points, spikes, 0)).all()
    with pytest.raises(atlasfit.Error, match="triangle 0 holds 9999 but there are only 4608 points"):
        atlasfit.denoise(vertices, triangles=[[0, 9999, 1]])
    with pytest.raises(ValueError, match="triangles has shape"):
        atlasfit.denoise(vertices, triangles=[0, 1, 2])


def test_parts_below_a_share_of_the_area_are_left_out_and_their_points_stay_unless_outliers_are_dropped(
    sphere,
):
    small = sphere_points(1000, seed=2) * 0.3 + [4, 0, 0]
    both = np.concatenate([sphere, small])
    all_parts = atlasfit.denoise(both, uv=False).report
    assert (all_parts.parts, all_parts.dropped_parts, all_parts.dropped_points) == (2, 0, 0)
    kept = atlasfit.denoise(both, uv=False, min_part=0.2)
    assert (kept.report.parts, kept.report.dropped_parts) == (1, 1) and len(kept.points) == len(both)
    assert kept.surface.vertices[:, 0].max() < 2 and 980 < kept.report.dropped_points <= 1000
    off = np.abs(np.linalg.norm((kept.points[-1000:] - [4, 0, 0]) / 0.3, axis=1) - 1)
    assert np.sqrt(np.mean(off**2)) < 0.007, "the points of the part that is left out are denoised"
    alone = atlasfit.denoise(both, uv=False, largest=True, outliers="drop")
    assert (alone.surface.vertices == kept.surface.vertices).all()
    assert len(alone.points) == len(both) - kept.report.dropped_points - kept.report.outliers
    with pytest.raises(atlasfit.Error, match="min_part is 2"):
        atlasfit.denoise(both, min_part=2)


def test_a_surface_has_as_many_triangles_as_points_or_as_asked_for(sphere):
    def triangles(**options):
        return len(atlasfit.denoise(sphere, uv=False, **options).surface.triangles)

    dense = triangles(max_error=0)
    assert dense > 3 * len(sphere) and triangles() < 1.2 * len(sphere)
    assert triangles(faces=500) <= 500 and triangles(max_error=0.05) < triangles(max_error=0.005) < dense
    with pytest.raises(atlasfit.Error, match="max_error is inf"):
        atlasfit.denoise(sphere, max_error=float("inf"))


def test_strength_says_how_far_points_are_moved(sphere):
    def moved(**options):
        out = atlasfit.denoise(sphere, uv=False, **options)
        return np.sqrt(np.mean(np.sum((out.points - sphere) ** 2, axis=1)))

    assert moved(strength=0) == 0 and 0 < moved(strength=0.5) < moved(strength=1) < moved(strength=2)
    assert moved(strength=1) == moved()
    for wrong, said in ((-1, "-1"), (float("nan"), "NaN"), (float("inf"), "inf")):
        with pytest.raises(atlasfit.Error, match=f"strength is {said}"):
            atlasfit.denoise(sphere, strength=wrong)


def test_integer_attributes_are_labels_of_the_nearest_point(sphere, denoised):
    label = denoised.surface.attributes["label"]
    assert label.shape == (len(denoised.surface.vertices),)
    assert (label == label.astype(int)).all() and label.min() >= 0 and label.max() < len(sphere)


@pytest.mark.parametrize(
    "labels",
    [np.int64([0, 10]), np.int64([-5, 2**31 + 1]), np.uint64([3, 2**40])],
    ids=["small", "wide", "unsigned"],
)
def test_64_bit_integers_are_labels_too(sphere, labels):
    given = labels[(sphere[:, 2] > 0).astype(int)]
    assert given.dtype.itemsize == 8
    surface = atlasfit.denoise(sphere, attributes={"label": given, "pair": given[:, None]}, uv=False).surface
    carried = surface.attributes["label"]
    assert carried.dtype == given.dtype and set(carried) == set(labels), "no label is made up between two"
    above = surface.vertices[:, 2] > 0.2
    assert (carried[above] == labels[1]).all() and (surface.attributes["pair"][:, 0] == carried).all()


def test_warnings_of_the_library_are_told(sphere, denoised):
    assert denoised.report.warnings == ()
    (warning,) = atlasfit.denoise(sphere, noise=1e-6, uv=False).report.warnings
    assert "noise" in warning
    assert atlasfit.unwrap(sphere[:3], [[0, 1, 2]]).info.warnings == ()


@pytest.mark.parametrize("name", volumes())
def test_points_that_fill_a_volume_are_told_so(name):
    out = atlasfit.denoise(volumes()[name], uv=False)
    assert any("the points fill a volume" in warning for warning in out.report.warnings), out.report.warnings


def test_colors_and_wide_attributes_are_carried(sphere):
    colors = np.clip(0.5 + 0.5 * sphere, 0, 1)
    out = atlasfit.denoise(sphere, colors=colors, attributes={"wide": np.float32(sphere)}, uv=False)
    s = out.surface
    assert s.corner_uv is None and s.face_charts is None
    assert np.abs(s.colors[:, :3] - (0.5 + 0.5 * s.vertices)).mean() < 0.03
    assert s.attributes["wide"].shape == s.vertices.shape


def test_an_atlas_projects_and_evaluates(denoised):
    atlas = denoised.atlas
    assert atlas.charts == denoised.report.charts
    off = 1.01 * denoised.points[:200]
    p = atlas.project(off)
    error = np.linalg.norm(p.positions, axis=1) - 1
    assert np.sqrt(np.mean(error**2)) < 0.35 * 0.01
    assert np.percentile(np.abs(error), 99) < 0.01 and np.abs(error).max() < 0.0125
    assert np.allclose(np.linalg.norm(p.positions - off, axis=1), p.distances, atol=1e-9)
    chart = int(p.charts[0])
    mine = p.charts == chart
    places = atlas.evaluate(chart, p.chart_uv[mine])
    assert np.abs(np.linalg.norm(places.positions, axis=1) - 1).max() < 0.02
    assert (places.inside >= 0).all() and (places.inside <= 1).all()


def test_an_atlas_outlives_its_result(sphere):
    atlas = atlasfit.denoise(sphere, uv=False).atlas
    gc.collect()
    assert len(atlas.project(sphere[:10]).positions) == 10


def test_an_atlas_comes_back_from_a_file_and_from_a_pickle(denoised, tmp_path):
    atlas = denoised.atlas
    path = tmp_path / "scan.safetensors"
    atlas.save(path)
    for again in (atlasfit.Atlas.load(path), pickle.loads(pickle.dumps(atlas))):
        assert (again.charts, again.unit, again.origin) == (atlas.charts, atlas.unit, atlas.origin)
        assert again.to_bytes() == atlas.to_bytes()
        a, b = (x.project(denoised.points[:100]).positions for x in (atlas, again))
        assert a.tobytes() == b.tobytes()
    for damaged in (b"", b"no atlas", path.read_bytes()[:-1]):
        with pytest.raises(atlasfit.Error) as caught:
            atlasfit.Atlas.from_bytes(damaged)
        assert caught.value.status in (_abi.BAD_FILE, _abi.INVALID_ARGUMENT)


def test_points_that_are_not_finite_are_counted_and_stay(sphere):
    dirty = sphere.copy()
    dirty[7, 1] = np.nan
    out = atlasfit.denoise(dirty, uv=False)
    assert out.report.not_finite == 1
    assert np.isnan(out.points[7, 1]) and out.charts[7] == atlasfit.NO_CHART


def test_float32_columns_of_a_wider_array_give_what_a_plain_copy_gives(sphere):
    wide = np.zeros((len(sphere), 5), np.float32)
    wide[:, 1:4] = sphere
    a = atlasfit.denoise(wide[:, 1:4], uv=False)
    b = atlasfit.denoise(np.ascontiguousarray(wide[:, 1:4]), uv=False)
    assert (
        a.points.tobytes() == b.points.tobytes()
        and a.surface.vertices.tobytes() == b.surface.vertices.tobytes()
    )


def test_unwrapping_a_torus_keeps_its_polygons_whole():
    vertices, quads = torus()
    faces, polygons = triangles(quads)
    seen = []
    uv = atlasfit.unwrap(
        vertices, faces, face_polygons=polygons, progress=lambda stage, share: seen.append((stage, share))
    )
    assert uv.corner_uv.shape == (len(faces), 3, 2) and uv.corner_uv.min() >= 0 and uv.corner_uv.max() <= 1
    assert (uv.face_charts[0::2] == uv.face_charts[1::2]).all()
    assert (uv.corner_uv[0::2, 0] == uv.corner_uv[1::2, 0]).all() and (
        uv.corner_uv[0::2, 2] == uv.corner_uv[1::2, 1]
    ).all()
    quality = atlasfit.measure_uv(vertices, faces, uv.corner_uv)
    assert quality.flips == quality.overlapping_faces == 0 and quality.stretch_p95 < 1.2
    assert seen and all(isinstance(stage, str) and 0 <= share <= 1 for stage, share in seen)


def test_the_split_form_says_the_same():
    vertices, quads = torus()
    faces, _ = triangles(quads)
    uv = atlasfit.unwrap(vertices, faces)
    new, sources, split_uv = uv.split()
    assert (sources[new] == faces).all() and (split_uv[new] == uv.corner_uv).all()


def test_seams_groups_and_hard_edges_are_kept():
    vertices, quads = torus()
    faces, polygons = triangles(quads)
    ring = np.stack([np.arange(24), np.roll(np.arange(24), -1)], 1)
    uv = atlasfit.unwrap(
        vertices, faces, seam_edges=ring, face_groups=(polygons % 24 < 12).astype(np.uint32), max_stretch=4
    )
    left, right = polygons < 24, polygons >= 47 * 24
    assert not set(uv.face_charts[polygons % 24 < 12]) & set(uv.face_charts[polygons % 24 >= 12])
    corners = {}
    for f in np.flatnonzero(left | right):
        for k in range(3):
            if faces[f, k] < 24:
                corners.setdefault(faces[f, k], {True: set(), False: set()})[bool(left[f])].add(
                    tuple(uv.corner_uv[f, k])
                )
    assert all(not side[True] & side[False] for side in corners.values())


def test_pages_and_a_given_density():
    vertices, quads = torus()
    faces, _ = triangles(quads)
    uv = atlasfit.unwrap(vertices, faces, page_size=(512, 256), texels_per_unit=100.0)
    assert (uv.info.width, uv.info.height, uv.info.texels_per_unit) == (512, 256, 100.0)
    assert uv.info.pages == uv.face_pages.max() + 1 > 1
    quality = atlasfit.measure_uv(
        vertices, faces, uv.corner_uv, face_pages=uv.face_pages, page_size=(512, 256)
    )
    assert quality.overlapping_faces == 0 and quality.charts == uv.info.charts and quality.stretch_p95 < 1.2
    assert quality.coverage == pytest.approx(uv.info.coverage, abs=0.02)


def test_a_vertex_that_is_not_finite_does_not_spoil_what_uvs_say_of_the_others():
    vertices, quads = torus()
    faces, _ = triangles(quads)
    uv = atlasfit.unwrap(vertices, faces).corner_uv
    whole = atlasfit.measure_uv(vertices, faces, uv)
    for broken in (np.nan, np.inf):
        spoilt = vertices.copy()
        spoilt[7] = broken
        found = atlasfit.measure_uv(spoilt, faces, uv)
        assert (found.charts, found.flips, found.degenerate) == (whole.charts, 0, 0)
        for name in ("stretch_median", "stretch_p95", "stretch_l2", "conformal", "seam", "coverage"):
            assert getattr(found, name) == pytest.approx(getattr(whole, name), rel=0.01), name
        others = (faces != 7).all(axis=1)
        assert np.allclose(found.face_stretch[others], whole.face_stretch[others], rtol=0.01)
        assert np.isfinite(found.face_stretch).all()


def test_baked_texels_are_the_programs(tmp_path):
    program = Path(os.environ.get("ATLASFIT", Path(__file__).resolve().parents[2] / "target/debug/atlasfit"))
    image = pytest.importorskip("PIL.Image")
    if not program.exists():
        pytest.skip("no program: cargo build -p atlasfit-cli, or let ATLASFIT name it")
    vertices, quads = torus()
    faces, _ = triangles(quads)
    vertices = vertices.astype(np.float32)
    colors = (np.arange(3 * len(vertices)) * 7 % 256).astype(np.uint8).reshape(-1, 3)
    rows = np.zeros(len(vertices), [("xyz", "<f4", 3), ("rgb", "u1", 3)])
    rows["xyz"], rows["rgb"] = vertices, colors
    corners = np.zeros(len(faces), [("n", "u1"), ("v", "<i4", 3)])
    corners["n"], corners["v"] = 3, faces
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n" + "".join(
        f"property float {c}\n" for c in "xyz"
    )
    head += (
        "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
        + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    (tmp_path / "in.ply").write_bytes(head.encode() + rows.tobytes() + corners.tobytes())
    out = tmp_path / "out.obj"
    subprocess.run(
        [program, "unwrap", tmp_path / "in.ply", "-o", out, "--bake", "--texture-size", "128", "--quiet"],
        check=True,
    )
    theirs = np.asarray(image.open(next(tmp_path.glob("*.png"))).convert("RGBA"))
    uv = atlasfit.unwrap(vertices, faces, page_size=128)
    ours = atlasfit.bake(vertices, faces, uv.corner_uv, colors, page_size=128)
    assert ours.tobytes() == theirs.tobytes()


def test_baking_the_colors_of_points_and_of_one_page():
    vertices, quads = torus()
    faces, _ = triangles(quads)
    uv = atlasfit.unwrap(vertices, faces, page_size=(64, 32), texels_per_unit=10.0)
    assert uv.info.pages > 1
    red, green = np.float32([1, 0, 0]), np.float32([0, 1, 0, 1])
    texels = atlasfit.bake(
        vertices,
        faces,
        uv.corner_uv,
        np.tile(red, (len(vertices), 1)),
        face_pages=uv.face_pages,
        page=uv.info.pages - 1,
        page_size=(64, 32),
    )
    assert texels.shape == (32, 64, 4) and (texels == [255, 0, 0, 255]).all()
    texels = atlasfit.bake(
        vertices, faces, uv.corner_uv, np.tile(green, (500, 1)), points=sphere_points(500), page_size=16
    )
    assert (texels == [0, 255, 0, 255]).all()


def test_seams_of_given_uvs_stay():
    vertices, quads = torus()
    faces, _ = triangles(quads)
    first = atlasfit.unwrap(vertices, faces, max_stretch=1.05)
    again = atlasfit.unwrap(vertices, faces, corner_uv=first.corner_uv, max_stretch=3)
    # A chart of the second lies in one of the first.
    pairs = set(zip(again.face_charts.tolist(), first.face_charts.tolist()))
    assert len(pairs) == again.info.charts


def test_arrays_that_are_contiguous_go_in_as_they_lie():
    for kind in (np.float32, np.float64):
        a = np.zeros((5, 3), kind)
        assert _arrays.positions(a, "points") is a
        assert np.shares_memory(_arrays.positions(np.zeros((5, 6), kind)[:, 2:5], "points"), a) is False
        wide = np.zeros((5, 6), kind)
        assert np.shares_memory(_arrays.positions(wide[:, 2:5], "points"), wide)
        assert np.shares_memory(_arrays.positions(wide[::2, 2:5], "points"), wide)
    for kind in (np.int32, np.uint32):
        f = np.zeros((4, 3), kind)
        assert np.shares_memory(_arrays.indices(f, (-1, 3), "faces"), f)


def test_arrays_that_are_not_contiguous_give_the_same_result():
    vertices, quads = torus(24, 12)
    faces, _ = triangles(quads)
    plain = atlasfit.unwrap(vertices, faces)
    for v, f in (
        (np.asfortranarray(vertices), np.asfortranarray(faces)),
        (vertices.astype(">f8"), faces.astype(np.int64)),
        (vertices[::-1].copy()[::-1], faces[::-1].copy()[::-1]),
        (vertices.tolist(), faces.tolist()),
    ):
        assert atlasfit.unwrap(v, f).corner_uv.tobytes() == plain.corner_uv.tobytes()


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (lambda: atlasfit.denoise(np.zeros((5, 2))), ValueError, r"\(5, 2\)"),
        (lambda: atlasfit.denoise(np.zeros((0, 3))), atlasfit.Error, ""),
        (lambda: atlasfit.denoise(sphere_points(), detail=-1), atlasfit.Error, "detail"),
        (lambda: atlasfit.denoise(sphere_points(), prior="magic"), ValueError, "magic"),
        (lambda: atlasfit.denoise(sphere_points(), colors=np.zeros((2, 3))), ValueError, "2 rows"),
        (lambda: atlasfit.denoise(sphere_points(), attributes={"a": np.zeros(2)}), ValueError, "'a'"),
        (lambda: atlasfit.denoise(sphere_points(), speed=3), TypeError, "speed"),
        (lambda: atlasfit.unwrap(np.zeros((3, 3)), [[0, 1, 7]]), atlasfit.Error, "7"),
        (lambda: atlasfit.unwrap(np.zeros((3, 3)), [[0, 1, -1]]), ValueError, "-1"),
        (lambda: atlasfit.unwrap(np.zeros((3, 3)), [[0.0, 1.0, 2.0]]), TypeError, "float64"),
        (lambda: atlasfit.unwrap(np.zeros((3, 3)), [[0, 1, 2, 0]]), ValueError, r"\(1, 4\)"),
        (lambda: atlasfit.unwrap(np.zeros((0, 3)), np.zeros((0, 3), int)), atlasfit.Error, ""),
        (
            lambda: atlasfit.bake(np.eye(3), [[0, 1, 2]], np.zeros((1, 3, 2)), np.zeros((2, 3))),
            ValueError,
            "2 rows",
        ),
        (
            lambda: atlasfit.bake(np.eye(3), [[0, 1, 2]], np.zeros((1, 3, 2)), np.zeros((3, 3)), page=2),
            atlasfit.Error,
            "page is 2",
        ),
        (
            lambda: atlasfit.measure_uv(np.eye(3), [[0, 1, 2]], np.zeros((2, 3, 2))),
            ValueError,
            r"\(1, 3, 2\)",
        ),
    ],
)
def test_bad_input_is_an_exception_that_says_what_was_wrong(call, kind, text):
    with pytest.raises(kind, match=text) as caught:
        call()
    assert str(caught.value)


def test_an_error_carries_its_status():
    with pytest.raises(atlasfit.Error) as caught:
        atlasfit.unwrap(np.eye(3), [[0, 1, 7]])
    assert caught.value.status == _abi.INDEX_OUT_OF_RANGE and caught.value.status_name


def test_importing_adds_little_to_numpy():
    """Measured and printed: timing decides no test."""
    script = (
        "import time, numpy, ctypes; t = time.perf_counter(); import atlasfit; print(time.perf_counter() - t)"
    )
    paths = os.pathsep.join([str(Path(atlasfit.__file__).parents[1])])
    seconds = min(
        float(
            subprocess.run(
                [sys.executable, "-c", script],
                env=os.environ | {"PYTHONPATH": paths},
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
        for _ in range(3)
    )
    print(f"import atlasfit: {1000 * seconds:.0f} ms beyond numpy")


def test_memory_is_told_beforehand_and_grows_with_the_work():
    with_uvs = atlasfit.denoise_memory_needed(1_000_000, threads=2)
    assert with_uvs > atlasfit.denoise_memory_needed(1_000_000, uv=False, threads=2) > 100 << 20
    large = atlasfit.unwrap_memory_needed(500_000, 1_000_000)
    assert large > atlasfit.unwrap_memory_needed(50_000, 100_000) > 10 << 20


def test_a_viewpoint_turns_the_surface_towards_it(sphere):
    far = 100.0 * sphere.max() * np.ones(3)
    with pytest.raises(ValueError):
        atlasfit.denoise(sphere, viewpoint=[1.0, 2.0])
    inside, outside = (atlasfit.denoise(sphere, viewpoint=at, uv=False).surface for at in (np.zeros(3), far))
    out = lambda surface: np.mean(np.einsum("ij,ij->i", surface.vertices, surface.normals) > 0)
    assert out(inside) < 0.1 and out(outside) > 0.9


def test_the_padding_kept_is_told(sphere):
    assert atlasfit.unwrap(sphere[:3], [[0, 1, 2]], padding=5).info.padding == 5


def test_sweeps_are_moved_together_and_told(sphere):
    second = np.arange(len(sphere)) % 2
    lifted = sphere + 0.05 * second[:, None] * [0, 0, 1]
    found = atlasfit.denoise(lifted, attributes={"view": second}, sweeps="view", uv=False)
    sweeps = found.report.sweeps
    assert [s.sweep for s in sweeps] == [0, 1] and [s.points for s in sweeps] == [len(sphere) // 2] * 2
    assert found.report.apart_after < 0.5 * found.report.apart_before
    assert sweeps[0].matrix[2, 3] - sweeps[1].matrix[2, 3] == pytest.approx(0.05, abs=0.01)
    assert found.report.apart_before > 0 and sweeps[1].pairs > 100 and sweeps[1].moved > 0.01
    with pytest.raises(atlasfit.Error, match='no attribute of that name'):
        atlasfit.denoise(lifted, attributes={"view": second}, sweeps="scan", uv=False)
    plain = atlasfit.denoise(sphere, uv=False).report
    assert plain.sweeps == () and plain.apart_before == plain.apart_after == 0
