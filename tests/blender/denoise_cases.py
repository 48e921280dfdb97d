"""Cases of Denoise Scan. Part of cases.py, which runs them."""

import bpy
import numpy as np

from scenes import edit, from_lists, link, mesh, refused, report, scan, select
from made import volumes


def radius_error(ob):
    return np.sqrt(np.mean((np.linalg.norm(mesh.positions(ob.data), axis=1) - 1) ** 2))


def test_a_scan_without_faces_becomes_a_new_object_with_its_attributes():
    ob = scan()
    before = radius_error(ob)
    mesh.add_attribute(ob.data, "intensity", "FLOAT", np.arange(3000.0))
    assert bpy.ops.object.atlasfit_denoise() == {"FINISHED"}
    new = bpy.context.object
    assert new != ob and radius_error(ob) == before and radius_error(new) < 0.5 * before
    assert (mesh.get(new.data.attributes["intensity"].data, "value", 1, np.float32) == np.arange(3000)).all()
    normals = mesh.get(new.data.attributes["point_normal"].data, "vector", 3, np.float32)
    chart = mesh.get(new.data.attributes["point_chart"].data, "value", 1, np.int32)
    assert (
        (chart >= 0).sum() > 2990
        and np.abs(np.sum(normals * mesh.positions(new.data), 1))[chart >= 0].min() > 0.95
    )
    assert float(report(new)["noise"]) > 0.005


def test_outliers_are_deleted_if_asked():
    ob = scan()
    me = ob.data
    co = mesh.positions(me)
    co[:5] *= 3
    mesh.put(me.vertices, "co", co)
    me.update()
    bpy.ops.object.atlasfit_denoise(drop=True, result="PLACE")
    assert 2900 < len(ob.data.vertices) <= 2995 and radius_error(ob) < 0.02


def test_a_shape_key_blends_between_scan_and_result():
    ob = scan()
    before = mesh.positions(ob.data)
    bpy.ops.object.atlasfit_denoise(result="SHAPE")
    keys = ob.data.shape_keys.key_blocks
    assert [k.name for k in keys] == ["Basis", "Denoised"] and keys["Denoised"].value == 1
    assert (mesh.get(keys["Basis"].data, "co", 3, np.float32) == before).all()
    moved = mesh.get(keys["Denoised"].data, "co", 3, np.float32)
    assert np.std(np.linalg.norm(moved, axis=1)) < 0.5 * np.std(np.linalg.norm(before, axis=1))
    refused(lambda: bpy.ops.object.atlasfit_denoise(result="SHAPE", drop=True), "Delete Outliers")


def noisy_ball():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
    ob = bpy.context.object
    co = mesh.positions(ob.data).astype(np.float64)
    co *= 1 + 0.01 * np.random.default_rng(2).normal(size=(len(co), 1))
    mesh.put(ob.data.vertices, "co", co.astype(np.float32))
    ob.data.update()
    return ob


def test_a_scanned_mesh_keeps_its_faces_and_shapes_move_along():
    ob = noisy_ball()
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Up", from_mix=False)
    up = mesh.get(key.data, "co", 3, np.float32) + np.float32([0, 0, 1])
    mesh.put(key.data, "co", up)
    faces = [tuple(p.vertices) for p in ob.data.polygons]
    before = radius_error(ob)
    bpy.ops.object.atlasfit_denoise(result="PLACE")
    assert [tuple(p.vertices) for p in ob.data.polygons] == faces and radius_error(ob) < 0.5 * before
    basis, up = (mesh.get(k.data, "co", 3, np.float32) for k in ob.data.shape_keys.key_blocks)
    assert np.allclose(up - basis, [0, 0, 1], atol=1e-5) and np.allclose(basis, mesh.positions(ob.data))


def test_points_that_fill_a_volume_are_told_so_and_a_scan_is_not():
    for run in (bpy.ops.object.atlasfit_reconstruct, bpy.ops.object.atlasfit_denoise):
        from_lists(volumes()["cube"], [])
        assert run() == {"FINISHED"}
        assert "the points fill a volume" in report(bpy.context.object)["notes"]
        scan()
        run()
        assert "volume" not in report(bpy.context.object).get("notes", "")


def test_spikes_of_a_mesh_go_between_their_neighbours_and_those_of_a_cloud_stay():
    spikes = [50, 700, 1500]
    for ball, stay in ((noisy_ball(), False), (scan(), True)):
        co = mesh.positions(ball.data)
        co[spikes] *= 3
        mesh.put(ball.data.vertices, "co", co)
        ball.data.update()
        for result in ("OBJECT", "PLACE"):
            select(ball)
            assert bpy.ops.object.atlasfit_denoise(result=result) == {"FINISHED"}
            new = bpy.context.object
            radius = np.linalg.norm(mesh.positions(new.data), axis=1)
            told = report(new)
            if stay:
                assert (mesh.positions(new.data)[spikes] == co[spikes]).all()
                assert "followed outliers" not in told and "between" not in told["notes"]
            else:
                assert np.abs(radius - 1).max() < 0.05
                assert int(told["followed outliers"]) == int(told["outliers"]) >= 3
                assert "put between their neighbours" in told["notes"]


def test_spikes_among_the_selected_vertices_go_between_their_selected_neighbours():
    ob = noisy_ball()
    co = mesh.positions(ob.data)
    top = co[:, 2] > 0
    spikes = [np.flatnonzero(co[:, 2] > 0.5)[k] for k in (10, 200)] + [np.flatnonzero(co[:, 2] < -0.5)[10]]
    co[spikes] *= 3
    mesh.put(ob.data.vertices, "co", co)
    edit(ob, "vertices", top)
    bpy.ops.object.atlasfit_denoise()
    bpy.ops.object.mode_set(mode="OBJECT")
    after = mesh.positions(ob.data)
    assert (after[~top] == co[~top]).all() and np.abs(np.linalg.norm(after[top], axis=1) - 1).max() < 0.1


def test_a_scaled_and_mirrored_scan_is_denoised_as_one_sees_it():
    ob = noisy_ball()
    co = mesh.positions(ob.data) / [-4, 1, 0.5]
    mesh.put(ob.data.vertices, "co", co)
    ob.scale, ob.location = (-4, 1, 0.5), (100, 0, 0)
    ob.data.update()
    bpy.context.view_layer.update()
    bpy.ops.object.atlasfit_denoise(result="PLACE")
    seen = mesh.positions(ob.data) * [-4, 1, 0.5]
    assert np.sqrt(np.mean((np.linalg.norm(seen, axis=1) - 1) ** 2)) < 0.005


def test_edit_mode_denoises_the_selected_points_only():
    ob = scan()
    before = mesh.positions(ob.data)
    upper = before[:, 2] > 0
    ob.data.vertices.foreach_set("select", upper)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.atlasfit_denoise()
    assert bpy.context.mode == "EDIT_MESH" and bpy.context.object == ob
    bpy.ops.object.mode_set(mode="OBJECT")
    after = mesh.positions(ob.data)
    assert (after[~upper] == before[~upper]).all() and (after[upper] != before[upper]).any(1).mean() > 0.9


def floats(ob, name):
    attribute = ob.data.attributes[name]
    assert (attribute.domain, attribute.data_type) == ("POINT", "FLOAT")
    return mesh.get(attribute.data, "value", 1, np.float32)


def test_sweeps_are_moved_together_and_an_attribute_that_tells_none_is_refused():
    ob = scan()
    co = mesh.positions(ob.data)
    second = np.arange(len(co)) % 2
    mesh.put_positions(ob.data, co + 0.05 * second[:, None] * [0, 0, 1])
    mesh.add_attribute(ob.data, "view", "INT", second.astype(np.int32))
    for make in (bpy.ops.object.atlasfit_denoise, bpy.ops.object.atlasfit_reconstruct):
        bpy.context.view_layer.objects.active = ob
        try:
            make(sweeps="views")
            raise AssertionError("not refused")
        except RuntimeError as error:
            assert "views is none (it has view)" in str(error)
        make(sweeps="view")
        told = report(bpy.context.object)
        assert bpy.context.object != ob and int(told["sweeps"]) == 2
        assert float(told["sweeps apart after"]) < float(told["sweeps apart before"]) / 2


OF_POINTS = {"uncertainty", "noise", "outlier_probability"}


def test_uncertainty_is_told_by_attributes_of_the_points_and_only_if_asked():
    ob = scan()
    co = mesh.positions(ob.data)
    co[5] *= 3
    mesh.put(ob.data.vertices, "co", co)
    bpy.ops.object.atlasfit_denoise(hide=False)
    plain = bpy.context.object
    assert not OF_POINTS & set(plain.data.attributes.keys())
    assert "uncertainty factor" not in report(plain)
    select(ob)
    bpy.ops.object.atlasfit_denoise(uncertainty=True)
    sure = bpy.context.object
    assert (mesh.positions(sure.data) == mesh.positions(plain.data)).all()
    sd, noise, stray = (floats(sure, name) for name in ("uncertainty", "noise", "outlier_probability"))
    off = np.abs(np.linalg.norm(mesh.positions(sure.data), axis=1) - 1)
    assert 0.8 < (off <= 1.645 * sd).mean() < 0.99 and 0.005 < np.median(noise) < 0.015
    assert stray[5] == 1 and abs(sd[5] - 2) < 0.1 and (stray > 0.5).mean() < 0.01
    # Again: the same attributes, of the new places.
    bpy.ops.object.atlasfit_denoise(uncertainty=True, result="PLACE")
    assert OF_POINTS == {n for n in sure.data.attributes.keys() if n.split(".")[0] in OF_POINTS}
    assert np.median(floats(sure, "noise")) < 0.5 * np.median(noise)


def test_a_scale_and_deleted_outliers_and_shape_keys_keep_uncertainty_with_its_points():
    ob = noisy_ball()
    ob.scale = (10, 10, 10)
    co = mesh.positions(ob.data)
    co[[50, 700]] *= 3
    mesh.put(ob.data.vertices, "co", co)
    bpy.context.view_layer.update()
    bpy.ops.object.atlasfit_denoise(result="SHAPE", uncertainty=True)
    noise, stray = floats(ob, "noise"), floats(ob, "outlier_probability")
    assert 0.05 < np.median(noise) < 0.15 and (stray[[50, 700]] == 1).all()
    ob.shape_key_clear()
    select(ob)
    bpy.ops.object.atlasfit_denoise(result="PLACE", drop=True, uncertainty=True)
    assert len(ob.data.vertices) == len(floats(ob, "uncertainty")) < len(co)
    assert floats(ob, "outlier_probability").max() < 1


def test_in_edit_mode_what_is_known_of_other_points_stays():
    ob = scan()
    upper = mesh.positions(ob.data)[:, 2] > 0
    for chosen in (upper, ~upper):
        ob.data.vertices.foreach_set("select", chosen)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.object.atlasfit_denoise(uncertainty=True)
        bpy.ops.object.mode_set(mode="OBJECT")
        if chosen is upper:
            first = floats(ob, "uncertainty")
            assert np.isnan(first[~upper]).all() and np.isfinite(first[upper]).all()
    both = floats(ob, "uncertainty")
    assert (both[upper] == first[upper]).all() and np.isfinite(both).all()


def test_a_surface_tells_its_uncertainty_beside_what_the_scan_has():
    ob = scan()
    mesh.add_attribute(ob.data, "label", "INT", np.full(3000, 7))
    mesh.add_attribute(ob.data, "uncertainty", "FLOAT", np.full(3000, 9.0))
    bpy.ops.object.atlasfit_reconstruct(bake=False)
    names = set(bpy.context.object.data.attributes.keys())
    assert names >= {"label", "uncertainty"} and "extrapolated" not in names
    select(ob)
    bpy.ops.object.atlasfit_reconstruct(bake=False, uncertainty=True)
    new = bpy.context.object
    assert new.data.attributes["label"].data_type == "INT"
    assert (floats(new, "uncertainty_before") == 9).all() and (floats(new, "extrapolated") == 0).all()
    off = np.abs(np.linalg.norm(mesh.positions(new.data), axis=1) - 1)
    assert 0.8 < (off <= 1.645 * floats(new, "uncertainty")).mean() < 0.995
    assert float(report(new)["uncertainty factor"]) >= 1


def test_scans_that_are_none_are_refused():
    from_lists([], [])
    refused(lambda: bpy.ops.object.atlasfit_denoise(), "no vertices")
    refused(lambda: bpy.ops.object.atlasfit_reconstruct(), "no vertices")
    from_lists([(0, 0, 0), (1, 0, 0)], [])
    refused(lambda: bpy.ops.object.atlasfit_denoise(), "Denoise Scan: ")


def test_creases_of_a_reconstructed_surface_are_sharp_edges():
    x, y, z = np.random.default_rng(1).uniform(-0.5, 0.5, (3, 4000))
    me = bpy.data.meshes.new("roof")
    me.vertices.add(4000)
    mesh.put(me.vertices, "co", np.stack([x, y, 0.004 * z - np.abs(x)], axis=1).astype(np.float32))
    select(link(me, "roof"))
    assert bpy.ops.object.atlasfit_reconstruct() == {"FINISHED"}
    me = bpy.context.object.data
    sharp = mesh.edge_flags(me, "use_edge_sharp")
    ends = mesh.positions(me)[mesh.get(me.edges, "vertices", 2, np.int32)]
    assert sharp.sum() > 20 and np.abs(ends[sharp][:, :, 0]).max() < 0.02
    # All along the ridge, and a rim is no crease.
    along = np.abs(ends[sharp][:, 0, 1] - ends[sharp][:, 1, 1]).sum()
    assert 0.8 < along < 1.1, along
    assert getattr(me, "use_auto_smooth", True)
