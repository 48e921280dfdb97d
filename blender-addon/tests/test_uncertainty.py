"""How sure a result is: only where it is asked for, in arrays of the points and vertices, and in files."""

import atlasfit
import numpy as np
import pytest

OF_POINTS = ["uncertainty", "noise", "outlier_probability"]
OF_VERTICES = ["uncertainty", "extrapolated"]


@pytest.fixture(scope="module")
def sure(sphere):
    return atlasfit.denoise(sphere, uncertainty=True)


def same(a, b):
    return all((x == y).all() and x.dtype == y.dtype for x, y in zip(a, b, strict=True))


def test_points_and_vertices_get_arrays_and_nothing_else_changes(sphere, sure):
    plain = atlasfit.denoise(sphere)
    assert plain.attributes == {} == plain.surface.attributes and plain.report.uncertainty_factor is None
    assert list(sure.attributes) == OF_POINTS and list(sure.surface.attributes) == OF_VERTICES
    assert sure.report.uncertainty_factor >= 1
    arrays = lambda r: [r.points, r.normals, r.charts, *(getattr(r.surface, name) for name in PARTS)]
    PARTS = ("vertices", "normals", "triangles", "corner_uv", "face_charts")
    assert same(arrays(plain), arrays(sure))
    for values, kind in zip(sure.attributes.values(), [np.float32] * 3):
        assert values.shape == (len(sphere),) and values.dtype == kind
    for values, kind in zip(sure.surface.attributes.values(), (np.float32, np.uint8)):
        assert values.shape == (len(sure.surface.vertices),) and values.dtype == kind


def test_the_noise_is_known_and_intervals_hold_the_sphere(sure):
    assert np.median(sure.attributes["noise"]) == pytest.approx(0.01, rel=0.3)
    for p, sd in (
        (sure.points, sure.attributes["uncertainty"]),
        (sure.surface.vertices, sure.surface.attributes["uncertainty"]),
    ):
        within = np.abs(np.linalg.norm(p, axis=1) - 1) <= 1.645 * sd
        assert 0.8 < within.mean() < 0.99
    assert sure.surface.attributes["extrapolated"].max() == 0 and sure.attributes["noise"].min() >= 0


def test_a_stray_is_told_and_points_that_are_not_finite_have_no_uncertainty(sphere):
    points = np.concatenate([sphere, [[3, 0, 0], [np.nan, 0, 0]]])
    told = atlasfit.denoise(points, uncertainty=True, uv=False).attributes
    assert told["outlier_probability"][-2] == 1 and told["uncertainty"][-2] == pytest.approx(2, abs=0.1)
    assert np.isnan(told["uncertainty"][-1]) and np.isnan(told["outlier_probability"][-1])
    assert np.mean(told["outlier_probability"][:-2] > 0.5) < 0.01


def test_a_column_of_the_scan_by_the_same_name_is_kept_beside(sphere):
    names = ["uncertainty", "uncertainty_before", "label"]
    given = {name: np.full(len(sphere), 7 + i, np.uint8) for i, name in enumerate(names)}
    found = atlasfit.denoise(sphere, attributes=given, uncertainty=True, uv=False).surface.attributes
    kept = ["uncertainty_before", "uncertainty_before_before", "label"]
    assert list(found) == kept + OF_VERTICES and found["uncertainty"].max() < 0.1
    assert all((found[name] == 7 + i).all() for i, name in enumerate(kept))
    plain = atlasfit.denoise(sphere, attributes=given, uv=False).surface.attributes
    assert list(plain) == names and all((plain[name] == given[name][0]).all() for name in names)


def test_a_solid_marks_what_was_invented_and_without_a_surface_there_are_points_only(sphere):
    cap = sphere[sphere[:, 2] < 0.8]
    solid = atlasfit.denoise(cap, watertight=True, uv=False)
    marks = solid.surface.attributes["extrapolated"]
    assert set(np.unique(marks)) == {0, 1} and solid.surface.vertices[marks == 1, 2].min() > 0.5
    assert solid.attributes == {} and list(solid.surface.attributes) == ["extrapolated"]
    bare = atlasfit.denoise(cap, surface="none", uncertainty=True)
    assert list(bare.attributes) == OF_POINTS and len(bare.attributes["noise"]) == len(cap)
    assert all(len(values) == 0 for values in bare.surface.attributes.values())


def test_files_hold_them(sure, tmp_path):
    assert atlasfit.save(tmp_path / "surface.ply", sure) == ()
    atlasfit.save(tmp_path / "points.ply", sure.points, attributes=sure.attributes)
    for name, given in (("surface", sure.surface.attributes), ("points", sure.attributes)):
        back = atlasfit.load(tmp_path / f"{name}.ply").attributes
        assert list(back) == list(given) and same(back.values(), given.values())
    lost = atlasfit.save(tmp_path / "surface.stl", sure)
    assert any("attributes" in line for line in lost)


def test_it_takes_memory_that_is_told_beforehand():
    plain, sure = (atlasfit.denoise_memory_needed(100_000, uncertainty=u) for u in (False, True))
    assert sure >= plain == atlasfit.denoise_memory_needed(100_000)
    with pytest.raises(atlasfit.Error, match="uncertainty is 2. Give 0 or 1"):
        atlasfit.denoise_memory_needed(9, uncertainty=2)
