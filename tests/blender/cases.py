"""The add-on in a real Blender, without a window. Run by tests/blender/run as

    blender --background --factory-startup --python-exit-code 1 --python cases.py
    python cases.py                       (with the package bpy)

ADDON_ZIP names the zip to install: the legacy one below Blender 4.2, else the extension. Each test_ function
starts from an empty scene.
"""

import os
import subprocess
import sys
import tempfile
import time
import traceback

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from scenes import (
    EXTENSION, addon, assert_good, atlasfit, cut_edges, cylinder, edit, everything, from_lists, grid,
    link, mesh, middle, monkey, quality, refused, report, right, scan, select, unwrap_apart, uvs,
)
from made import torus, triangles
from color_cases import *  # noqa: F403
from denoise_cases import *  # noqa: F403
from import_cases import *  # noqa: F403
from layout_cases import *  # noqa: F403
from texture_cases import *  # noqa: F403


# ---- Atlas Unwrap


def test_suzanne():
    ob = monkey()
    assert bpy.ops.uv.atlasfit_unwrap() == {"FINISHED"}
    assert len(ob.data.polygons) == 500 and [layer.name for layer in ob.data.uv_layers] == ["UVMap"]
    assert_good(ob)
    assert int(report(ob)["charts"]) == quality(ob).charts


def test_presets_stand_for_bounds_and_a_bound_of_ones_own_wins():
    ob = monkey()
    found = []
    for preset in ("few-seams", "balanced", "low-stretch"):
        bpy.ops.uv.atlasfit_unwrap(preset=preset)
        assert_good(ob, stretch=1.5)
        found.append((int(report(ob)["charts"]), float(report(ob)["stretch bound"])))
    charts, bounds = zip(*found)
    assert charts[0] <= 20 < charts[1] < charts[2] and bounds[0] > bounds[1] > bounds[2]
    bpy.ops.uv.atlasfit_unwrap()
    assert (int(report(ob)["charts"]), float(report(ob)["stretch bound"])) == found[1]
    bpy.ops.uv.atlasfit_unwrap(preset="low-stretch", max_stretch=1.5)
    assert float(report(ob)["stretch bound"]) == 1.5
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(max_stretch=0.5), "max_stretch is 0.5")


def test_everything_else_is_kept():
    ob = everything()

    def all_but_uvs(me):
        return {
            "polygons": [tuple(p.vertices) for p in me.polygons],
            "materials": [p.material_index for p in me.polygons],
            "group": [(g.group, g.weight) for v in me.vertices for g in v.groups],
            "shapes": [(k.name, k.value, [tuple(d.co) for d in k.data]) for k in me.shape_keys.key_blocks],
            "edges": [tuple(e.vertices) for e in me.edges],
            "modifiers": [m.type for m in ob.modifiers],
        }

    before = all_but_uvs(ob.data)
    assert bpy.ops.uv.atlasfit_unwrap() == {"FINISHED"}
    assert all_but_uvs(ob.data) == before
    assert_good(ob)


def test_no_chart_spans_two_materials_if_asked():
    ob = grid()
    ob.data.materials.append(bpy.data.materials.new("a"))
    ob.data.materials.append(bpy.data.materials.new("b"))
    ob.data.polygons.foreach_set("material_index", right(ob)[0].astype(np.int32))
    bpy.ops.uv.atlasfit_unwrap()
    assert not cut_edges(ob)
    bpy.ops.uv.atlasfit_unwrap(materials=True)
    assert middle(ob) and cut_edges(ob) == middle(ob)


def test_seams_and_sharp_edges_are_cut_and_can_be_left():
    for flag, option in (("use_seam", "seams"), ("use_edge_sharp", "sharp")):
        ob = grid()
        wanted = middle(ob, flag)
        bpy.ops.uv.atlasfit_unwrap()
        assert cut_edges(ob) == wanted, flag
        bpy.ops.uv.atlasfit_unwrap(**{option: False})
        assert not cut_edges(ob), flag


def test_seams_of_the_uv_map_are_kept_if_asked():
    ob = grid()
    unwrap_apart(ob)
    wanted = cut_edges(ob)
    assert wanted
    bpy.ops.uv.atlasfit_unwrap(keep_uv_seams=True)
    assert cut_edges(ob) == wanted


def test_edit_mode_unwraps_the_selected_faces_and_leaves_the_others():
    ob = grid()
    before = uvs(ob)
    chosen, corner = right(ob)
    edit(ob, "polygons", chosen)
    assert bpy.ops.uv.atlasfit_unwrap() == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    after = uvs(ob)
    assert (after[~corner] == before[~corner]).all() and (after[corner] != before[corner]).any(1).all()


def test_edit_mode_heeds_seams_and_measures_uvs():
    ob = grid()
    wanted = middle(ob, "use_seam")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.atlasfit_unwrap()
    bpy.ops.uv.atlasfit_unwrap(seams=False, keep_uv_seams=True)
    bpy.ops.uv.atlasfit_stretch()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert cut_edges(ob) == wanted and len(ob.data.color_attributes) == 1 and int(report(ob)["charts"]) == 2


def test_edit_mode_without_a_selection_is_refused():
    ob = grid()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(), "no face is selected")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert ob.data.uv_layers


def test_several_objects_in_edit_mode_share_a_texture():
    a, b = grid(), monkey()
    select(a, b)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    assert bpy.ops.uv.atlasfit_unwrap() == {"FINISHED"}
    assert {ob.name for ob in bpy.context.objects_in_mode} == {a.name, b.name}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_good(a, b)


def test_several_objects_in_object_mode_share_a_texture_or_have_one_each():
    a, b = grid(), monkey()
    twin = bpy.data.objects.new("twin", b.data)  # the same mesh again: it is laid out once
    bpy.context.collection.objects.link(twin)
    select(a, b, twin)
    bpy.ops.uv.atlasfit_unwrap()
    assert_good(a, b)
    bpy.ops.uv.atlasfit_unwrap(together=False)
    assert_good(a)
    assert_good(b)
    assert np.ptp(uvs(a), axis=0).max() > 0.95


def bent():
    """An open sheet."""
    ob = grid()
    co = mesh.positions(ob.data)
    co[:, 2] = np.sin(2 * co[:, 0]) * np.cos(2 * co[:, 1])
    mesh.put_positions(ob.data, co)
    ob.data.update()
    return ob


def copied(ob):
    """A copy with a mesh of its own."""
    copy = ob.copy()
    copy.data = ob.data.copy()
    bpy.context.collection.objects.link(copy)
    return copy


def test_a_copy_that_is_unwrapped_leaves_the_uvs_of_what_it_was_copied_from():
    ob = bent()
    bpy.ops.uv.atlasfit_unwrap()
    before, copy = uvs(ob), copied(ob)
    select(copy)
    bpy.ops.uv.atlasfit_unwrap(texture_size=256, margin=32)
    assert (uvs(ob) == before).all() and np.abs(uvs(copy) - before).max() > 0.01


def test_forty_copies_get_the_charts_that_one_gets():
    for make in (monkey, bent):
        ob = make()
        bpy.ops.uv.atlasfit_unwrap()
        cut, charts = cut_edges(ob), int(report(ob)["charts"])
        obs = [ob, *(copied(ob) for _ in range(39))]
        for i, copy in enumerate(obs):
            copy.rotation_euler, copy.location, copy.scale = (i, 2 * i, 0), (3 * i, 0, 0), [1 + i % 3] * 3
        bpy.context.view_layer.update()
        select(*obs)
        bpy.ops.uv.atlasfit_unwrap()
        assert int(report(ob)["charts"]) == 40 * charts and "notes" not in report(ob), report(ob)
        assert all(cut_edges(copy) == cut for copy in obs)
        assert_good(*obs)


def test_what_makes_a_copy_another_shape_gives_it_charts_of_its_own():
    cut = grid()
    ob, longer, painted = (copied(cut) for _ in range(3))
    longer.scale = (1, 3, 1)
    across = middle(cut, "use_seam")
    halves, _ = right(painted)
    painted.data.polygons.foreach_set("material_index", halves.astype(np.int32))
    bpy.context.view_layer.update()
    obs = [ob, longer, cut, painted, bent(), copied(cut)]
    select(*obs)
    for materials in (False, True):
        bpy.ops.uv.atlasfit_unwrap(materials=materials)
        assert_good(*obs)
        assert not cut_edges(ob) and not cut_edges(longer) and cut_edges(obs[4])
        assert cut_edges(cut) == cut_edges(obs[5]) == across
        assert cut_edges(painted) == (across if materials else set())


def test_objects_whose_borders_meet_are_not_one_surface():
    left, right = grid(), grid()
    co = mesh.positions(right.data)
    mesh.put_positions(right.data, co + [2, 0, 0])
    third = copied(left)
    third.scale = (1, 2, 1)
    bpy.context.view_layer.update()
    select(left, right, third)
    bpy.ops.uv.atlasfit_unwrap()
    assert int(report(left)["charts"]) == 3 and "notes" not in report(left), report(left)
    assert_good(left, right, third)


def test_copies_get_one_layout_where_seams_are_hidden_and_painted_copies_another():
    first, second, third = monkey(), monkey(), monkey()
    third.vertex_groups.new(name="Seams").add(list(range(200)), 1.0, "REPLACE")
    select(first, second, third)
    bpy.ops.uv.atlasfit_unwrap(preset="few-seams", seams_hidden=1.0, seam_group="Seams")
    seams = [cut_edges(ob) for ob in (first, second, third)]
    assert seams[0] == seams[1] != seams[2]


def test_linked_copies_with_other_scales_are_named():
    ob = monkey()
    copies = [ob.copy(), ob.copy()]
    for copy in copies:
        bpy.context.collection.objects.link(copy)
    copies[0].name, copies[0].scale = "Large", (2, 2, 2)
    copies[1].rotation_euler = (1, 0, 0)
    bpy.context.view_layer.update()
    select(ob, *copies)
    bpy.ops.uv.atlasfit_unwrap()
    said = report(ob)["notes"]
    assert "share the mesh of" in said and "are scaled otherwise" in said and "Large" in said, said
    select(ob, copies[1])
    bpy.ops.uv.atlasfit_unwrap()
    assert "notes" not in report(ob)


def test_pins_are_moved_and_that_is_said():
    ob = grid()
    layer = ob.data.uv_layers.active
    for i in range(3):
        layer.data[i].pin_uv = True
    bpy.ops.uv.atlasfit_unwrap()
    assert "3 pinned UVs" in report(ob)["notes"]


def test_stretch_is_what_one_sees_of_a_scaled_object():
    ob = cylinder()
    ob.scale = (1, 1, 7)
    ob.modifiers.new("array", "ARRAY")
    bpy.context.view_layer.update()
    bpy.ops.uv.atlasfit_unwrap()
    assert_good(ob)
    assert [m.type for m in ob.modifiers] == ["ARRAY"]


def test_a_mirrored_object_has_no_mirrored_charts():
    ob = monkey()
    bpy.ops.uv.atlasfit_unwrap()
    plain = uvs(ob)
    ob.scale = (-1, 1, 1)
    bpy.context.view_layer.update()
    bpy.ops.uv.atlasfit_unwrap()
    area = lambda uv: [
        np.cross(
            uv[p.loop_indices[1]] - uv[p.loop_indices[0]], uv[p.loop_indices[2]] - uv[p.loop_indices[0]]
        ) > 0
        for p in ob.data.polygons
    ]
    assert area(plain) == area(uvs(ob))
    assert_good(ob)


def test_an_object_scaled_to_nothing_is_refused():
    ob = grid()
    ob.scale = (1, 1, 0)
    bpy.context.view_layer.update()
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(), "scale")


def test_a_mesh_without_faces_is_refused():
    from_lists([], [])
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(), "no faces")
    scan(10)
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(), "no faces")
    from_lists([(0, 0, 0)] * 3, [(0, 1, 2)])
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(), "")


def test_a_new_uv_map_and_no_room_for_one():
    ob = grid()
    before = uvs(ob)
    bpy.ops.uv.atlasfit_unwrap(target="NEW", name="Mine")
    assert (
        [layer.name for layer in ob.data.uv_layers] == ["UVMap", "Mine"]
        and ob.data.uv_layers.active.name == "Mine"
    )
    assert (uvs(ob, "UVMap") == before).all()
    while len(ob.data.uv_layers) < 8:
        ob.data.uv_layers.new()
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(target="NEW"), "limit")


def test_twice_is_the_same():
    ob = everything()
    bpy.ops.uv.atlasfit_unwrap()
    first = uvs(ob)
    bpy.ops.uv.atlasfit_unwrap()
    assert first.tobytes() == uvs(ob).tobytes()


def test_a_density_goes_on_to_further_tiles():
    ob = monkey()
    bpy.ops.uv.atlasfit_unwrap(texture_size=256, density=200)
    uv = uvs(ob)
    tile = np.floor(uv).astype(int)
    assert uv.max() > 1 and tile[:, 0].max() <= 9
    for p in ob.data.polygons:
        assert len({tuple(tile[i]) for i in p.loop_indices}) == 1
    assert 100 < float(report(ob)["pixels per unit"]) <= 200
    assert ("density" in report(ob)["notes"]) == (float(report(ob)["pixels per unit"]) < 200)


def test_a_file_keeps_uvs_and_report():
    ob = monkey()
    bpy.ops.uv.atlasfit_unwrap()
    before, told, name = uvs(ob).tobytes(), report(ob), ob.name
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "file.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    ob = bpy.data.objects[name]
    assert uvs(ob).tobytes() == before and report(ob) == told


def test_half_a_million_faces():
    vertices, quads = torus(1000, 250, 1, 3)
    ob = link(mesh.new_mesh("large", vertices, triangles(quads)[0]))
    assert len(ob.data.polygons) == 500_000
    started = time.perf_counter()
    bpy.ops.uv.atlasfit_unwrap()
    whole = time.perf_counter() - started
    q = assert_good(ob)
    print(f"   500,000 faces: {whole:.2f} s, {q.charts} charts")


# ---- Reconstruct


def test_a_scan_becomes_a_closed_surface_with_uvs_colors_attributes_and_an_image():
    ob = scan()
    me = ob.data
    co = mesh.positions(me)
    colors = np.ones((3000, 4), np.float32)
    colors[:, :3] = 0.5 + 0.5 * np.clip(co, -1, 1)
    me.color_attributes.new(name="paint", type="FLOAT_COLOR", domain="POINT")
    mesh.put(me.color_attributes["paint"].data, "color", colors)
    mesh.add_attribute(me, "label", "INT", (co[:, 2] > 0) * 7)
    mesh.add_attribute(me, "height", "FLOAT", co[:, 2])
    assert bpy.ops.object.atlasfit_reconstruct(texture_size=256) == {"FINISHED"}
    new = bpy.context.object
    assert new != ob and not ob.select_get()
    q = assert_good(new)
    given = mesh.triangles([new], False)
    topology = atlasfit.measure_topology(given.vertices, given.faces)
    assert topology.closed and topology.genus == 0 and not new.data.validate()
    # Outwards: the volume is that of the ball.
    a, b, c = (given.vertices[given.faces[:, k]] for k in range(3))
    assert abs(np.sum(a * np.cross(b, c)) / 6 - 4.19) < 0.1
    p = mesh.positions(new.data)
    got = mesh.get(new.data.color_attributes["paint"].data, "color", 4, np.float32)
    assert np.abs(got[:, :3] - (0.5 + 0.5 * p)).mean() < 0.03
    assert set(mesh.get(new.data.attributes["label"].data, "value", 1, np.int32)) == {0, 7}
    assert (
        np.abs(mesh.get(new.data.attributes["height"].data, "value", 1, np.float32) - p[:, 2]).mean() < 0.03
    )
    nodes = new.data.materials[0].node_tree.nodes
    image = next(n.image for n in nodes if n.type == "TEX_IMAGE")
    assert tuple(image.size) == (256, 256) and image.packed_file
    pixels = np.empty(256 * 256 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(256, 256, 4)
    # At the middle of each triangle the texture has the colour of the place, as sRGB.
    middle, at = (
        given.vertices[given.faces].mean(1),
        (uvs(new)[given.parts[0].loops].mean(1) * 256).astype(int),
    )
    want = 0.5 + 0.5 * np.clip(middle, -1, 1)
    want = 1.055 * want ** (1 / 2.4) - 0.055
    assert np.abs(pixels[at[:, 1], at[:, 0], :3] - want).mean() < 0.04
    assert q.charts == int(report(new)["uv charts"])


def test_modifiers_of_a_scan_count_and_it_stays_where_it_is():
    ob = scan()
    ob.location, ob.scale = (1, 2, 3), (2, 2, 2)
    modifier = ob.modifiers.new("move", "DISPLACE")
    modifier.direction, modifier.strength, modifier.mid_level = "X", 5.0, 0.0
    bpy.context.view_layer.update()
    bpy.ops.object.atlasfit_reconstruct()
    new = bpy.context.object
    assert np.allclose(new.matrix_world, ob.matrix_world)
    assert np.allclose(mesh.positions(new.data).mean(0), [5, 0, 0], atol=0.05)
    assert [m.name for m in new.data.materials] == ["Atlas Checker"], "nothing was baked"


# ---- around the operators


def test_a_cancelled_run_ends_at_once_and_leaves_everything():
    """What Esc does, without a window: see gui.py for the key itself."""
    ob = scan(100_000)
    work = lambda progress, cancel: atlasfit.denoise(
        mesh.positions(ob.data), progress=progress, cancel=cancel
    )
    job = addon.long.Job(work)
    time.sleep(0.3)
    assert job.thread.is_alive()
    asked = time.perf_counter()
    job.stop()
    job.thread.join(5)
    waited = time.perf_counter() - asked
    assert isinstance(job.failure, atlasfit.Cancelled) and job.result is None and waited < 2
    print(f"   cancelled after {1000 * waited:.0f} ms")


def test_the_bar_never_falls_and_says_the_time_left():
    shares = []

    def work(progress, cancel):
        for share in (0.1, 0.5, 0.3, 0.8):
            progress("working", share)
            shares.append(job.share)

    job = addon.long.Job(lambda progress, cancel: (time.sleep(0.1), work(progress, cancel)))
    job.thread.join(5)
    assert shares == [0.1, 0.5, 0.5, 0.8]
    left = addon.long.time_left
    assert left(10, 0.25) == ", 30 s left" and left(60, 0.1) == ", 9 min left"
    assert left(0.5, 0.5) == left(10, 0.01) == left(10, 1) == ""


def test_it_can_be_turned_off_and_on():
    draws = lambda: [
        len(getattr(bpy.types, m).draw._draw_funcs)
        for m in ("VIEW3D_MT_object", "VIEW3D_MT_edit_mesh", "IMAGE_MT_uvs_unwrap")
    ]
    on = draws()
    addon.unregister()
    assert not hasattr(bpy.types, "UV_OT_atlasfit_unwrap") and [n - 1 for n in on] == draws()
    addon.register()
    assert on == draws()
    monkey()
    assert bpy.ops.uv.atlasfit_unwrap() == {"FINISHED"}


def test_where_extensions_are_unknown_theirs_is_refused_with_a_sentence_that_names_the_other_zip():
    if EXTENSION:
        return
    code = (
        f"import bpy; bpy.ops.preferences.addon_install(filepath={os.environ['EXTENSION_ZIP']!r}); "
        "print('enabled:', bpy.ops.preferences.addon_enable(module='atlasfit_blender'), "
        "hasattr(bpy.types, 'UV_OT_atlasfit_unwrap'))"
    )
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [bpy.app.binary_path, "--background", "--factory-startup", "--python-expr", code],
            env=os.environ | {"BLENDER_USER_SCRIPTS": folder},
            capture_output=True,
            text=True,
        )
        assert os.listdir(f"{folder}/addons") == ["atlasfit_blender"], "nothing lies about"
    assert "enabled: {'CANCELLED'} False" in done.stdout, done.stdout + done.stderr
    assert "atlasfit_blender-VERSION-legacy-PLATFORM.zip" in done.stdout and "Traceback" not in done.stdout


def main():
    print(
        "Blender", bpy.app.version_string, "Python", sys.version.split()[0],
        "extension" if EXTENSION else "legacy add-on",
    )
    wanted = os.environ.get("ONLY", "")
    failed = 0
    for name, test in list(globals().items()):
        if not name.startswith("test_") or wanted not in name:
            continue
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
        started = time.perf_counter()
        try:
            test()
            print(f"ok   {name} ({time.perf_counter() - started:.1f} s)")
        except Exception:
            failed += 1
            print(f"FAIL {name}")
            traceback.print_exc(file=sys.stdout)
        sys.stdout.flush()
    print("all passed" if not failed else f"{failed} failed")
    sys.stdout.flush()
    os._exit(1 if failed else 0)  # bpy may hang in its destructors


main()
