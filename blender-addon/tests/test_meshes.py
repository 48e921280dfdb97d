"""Meshes with fewer triangles, UVs that are only packed, points without a surface."""

import atlasfit
import numpy as np
import pytest
from made import strip, torus, triangles


def test_simplifying_keeps_the_mesh_whole_and_its_uvs_sound():
    vertices, quads = torus(96, 48)
    faces = triangles(quads)[0]
    uv = atlasfit.unwrap(vertices, faces).corner_uv
    light = atlasfit.simplify(vertices, faces, faces=len(faces) // 8, corner_uv=uv)
    assert 0 < len(light.faces) <= len(faces) // 8 and light.warnings == ()
    topology = atlasfit.measure_topology(light.vertices, light.faces)
    assert topology.closed and topology.genus == 1
    assert atlasfit.measure_uv(light.vertices, light.faces, light.corner_uv).flips == 0
    off = np.linalg.norm(vertices[light.sources] - light.vertices, axis=1)
    assert np.median(off) < 0.08, "sides are 0.2 long"
    assert atlasfit.simplify(vertices, faces, max_error=0.05).corner_uv is None
    with pytest.raises(atlasfit.Error, match="neither faces nor max_error"):
        atlasfit.simplify(vertices, faces)


def test_charts_that_are_kept_are_only_moved():
    vertices, quads = torus(24, 12)
    faces = triangles(quads)[0]
    made = atlasfit.unwrap(vertices, faces)
    piled = np.mod(made.corner_uv * 3, 1).astype(np.float32)
    packed = atlasfit.unwrap(vertices, faces, corner_uv=made.corner_uv, keep_uvs=True)
    assert packed.info.charts == made.info.charts and packed.info.repaired_charts == 0
    assert atlasfit.measure_uv(vertices, faces, packed.corner_uv).overlapping_faces == 0
    assert atlasfit.unwrap(vertices, faces, corner_uv=piled, keep_uvs=True).info.charts >= made.info.charts


def test_points_alone_are_the_same_without_a_surface(sphere):
    both = atlasfit.denoise(sphere, attributes={"label": np.arange(len(sphere))}, uv=False)
    only = atlasfit.denoise(sphere, attributes={"label": np.arange(len(sphere))}, surface="none")
    assert (only.points == both.points).all() and (only.normals == both.normals).all()
    assert len(only.surface.vertices) == len(only.surface.triangles) == 0
    with pytest.raises(atlasfit.Error, match="built without CGAL"):
        atlasfit.denoise(sphere, surface="wrap")


def test_parts_of_one_shape_are_stacked_corner_on_corner():
    vertices, quads = torus(16, 8)
    faces = triangles(quads)[0]
    n = len(faces)
    turned = vertices[:, [1, 2, 0]] + [5, 0, 0]
    both, all_faces = np.concatenate([vertices, turned]), np.concatenate([faces, faces + len(vertices)])
    plain = atlasfit.unwrap(both, all_faces)
    stacked = atlasfit.unwrap(both, all_faces, stack="identical")
    assert (plain.info.stacked_parts, stacked.info.stacked_parts, stacked.info.welded_vertices) == (0, 1, 0)
    corners = stacked.corner_uv.reshape(2, -1, 2)
    assert {*map(tuple, corners[0])} == {*map(tuple, corners[1])}
    assert {*stacked.face_charts[:n]} == {*stacked.face_charts[n:]}
    with pytest.raises(ValueError, match="stack"):
        atlasfit.unwrap(vertices, faces, stack="same")
    with pytest.raises(atlasfit.Error, match="stack"):
        atlasfit.unwrap(vertices, faces, corner_uv=plain.corner_uv[:n], keep_uvs=True, stack="identical")


def test_a_strip_is_laid_straight_where_that_is_asked_for():
    vertices, quads = strip()
    faces = triangles(quads)[0]
    plain, straight = atlasfit.unwrap(vertices, faces), atlasfit.unwrap(vertices, faces, straighten="auto")
    assert plain.info.straightened_charts == 0 < straight.info.straightened_charts == straight.info.charts
    judged = [atlasfit.measure_uv(vertices, faces, uv.corner_uv) for uv in (plain, straight)]
    assert judged[0].straightness < 0.5 and judged[1].straightness == 1.0
    assert judged[1].flips == judged[1].overlapping_faces == 0
    assert judged[1].stretch_p95 <= straight.info.stretch_bound
    off = atlasfit.unwrap(vertices, faces, straighten="off")
    assert np.array_equal(off.corner_uv, plain.corner_uv)
    with pytest.raises(ValueError, match="straighten"):
        atlasfit.unwrap(vertices, faces, straighten="on")
    with pytest.raises(atlasfit.Error, match="straighten is asked for with keep_uvs"):
        atlasfit.unwrap(vertices, faces, corner_uv=plain.corner_uv, keep_uvs=True, straighten="auto")


def test_seams_go_where_they_are_cheap_or_hidden():
    vertices, quads = torus(32, 16)
    faces = triangles(quads)[0]
    plain = atlasfit.unwrap(vertices, faces)
    same = atlasfit.unwrap(vertices, faces, seam_price=np.full(len(vertices), 3), up=[0, 0, 1])
    assert np.array_equal(plain.corner_uv, same.corner_uv)

    def above(uv):
        """The share of the seams' length that lies in the upper half."""
        ends = {}
        for t, c in zip(faces, uv.corner_uv):
            for k in range(3):
                pair = sorted([(t[k], tuple(c[k])), (t[k - 2], tuple(c[k - 2]))])
                ends.setdefault((pair[0][0], pair[1][0]), set()).add((pair[0][1], pair[1][1]))
        seams = np.array([pair for pair, uvs in ends.items() if len(uvs) > 1])
        a, b = (np.asarray(vertices)[seams[:, k]] for k in (0, 1))
        length = np.linalg.norm(b - a, axis=1)
        return length[(a + b)[:, 2] > 0].sum() / length.sum()

    price = np.where(np.asarray(vertices)[:, 2] > 0, 10.0, 1.0)
    priced = atlasfit.unwrap(vertices, faces, seam_price=price)
    hidden = atlasfit.unwrap(vertices, faces, seams_hidden=1, up=(0, 0, 1))
    assert above(priced) < above(plain) - 0.1 and above(hidden) != above(plain)
    for wrong, words in (({"seam_price": [1, 2]}, "seam_price"), ({"up": [1, 2]}, "up")):
        with pytest.raises(ValueError, match=words):
            atlasfit.unwrap(vertices, faces, **wrong)
    with pytest.raises(atlasfit.Error, match="seams_hidden is 2"):
        atlasfit.unwrap(vertices, faces, seams_hidden=2)


def test_charts_keep_free_of_what_is_occupied():
    vertices, quads = torus(32, 16)
    faces = triangles(quads)[0]
    left = [[[0, 0], [0.5, 0], [0.5, 1]], [[0, 0], [0.5, 1], [0, 1]]]
    uv = atlasfit.unwrap(vertices, faces, occupied_uv=left)
    assert uv.corner_uv[..., 0].min() > 0.5
    with pytest.raises(ValueError, match="occupied_uv"):
        atlasfit.unwrap(vertices, faces, occupied_uv=[[0, 0], [1, 1]])
    with pytest.raises(atlasfit.Error, match="no room"):
        atlasfit.unwrap(vertices, faces, occupied_uv=[[[0, 0], [2, 0], [0, 2]]])


def test_a_bound_on_the_energy_makes_one_chart():
    vertices, quads = torus(16, 8)
    faces = triangles(quads)[0]
    found = atlasfit.unwrap(vertices, faces, max_energy=4.3)
    assert found.info.charts == 1
    with pytest.raises(atlasfit.Error, match="max_energy"):
        atlasfit.unwrap(vertices, faces, max_energy=4.0)
