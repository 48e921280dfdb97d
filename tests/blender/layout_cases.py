"""Cases of Pack Islands, Mark Seams, and of a density beside tiles. Part of cases.py, which runs them."""

import bmesh
import bpy
import numpy as np

from scenes import (
    assert_good, cut_edges, cylinder, edit, from_lists, grid, mesh, middle, monkey, quality, refused, report,
    right, select, unwrap_apart, uvs,
)
from made import strip
from texture_cases import colors, shown, wooden


# ---- Pack Islands


def seams(ob):
    return {tuple(sorted(e.vertices)) for e in ob.data.edges if e.use_seam}


def lengths(ob):
    """Lengths of each polygon's UV edges."""
    uv, out = uvs(ob), []
    for p in ob.data.polygons:
        corners = uv[list(p.loop_indices)]
        out.append(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1))
    return out


def piled():
    """Three flat sheets, of 4, 1 and 1/4 of the area, each over all of the UV page."""
    vertices, faces = [], []
    for i, size in enumerate((2.0, 1.0, 0.5)):
        faces.append([4 * i + k for k in range(4)])
        vertices += [(size * x, size * y, i) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    ob = from_lists(vertices, faces)
    layer = ob.data.uv_layers.new(name="UVMap")
    mesh.uv_put(layer, np.tile(np.float32([[0, 0], [1, 0], [1, 1], [0, 1]]), (3, 1)))
    return ob


def test_packing_keeps_charts_as_they_are_and_gives_them_one_density():
    ob = piled()
    assert quality(ob).overlapping_faces > 0
    assert bpy.ops.uv.atlasfit_pack() == {"FINISHED"}
    q = assert_good(ob, stretch=1.001)
    assert q.charts == 3 and q.coverage > 0.5
    sides = np.array([l.mean() for l in lengths(ob)])
    assert np.allclose(sides / sides[0], [1, 0.5, 0.25], rtol=1e-3), "lengths on the page are those in space"
    ob = monkey()
    bpy.ops.uv.atlasfit_unwrap()
    cut, charts, before = cut_edges(ob), quality(ob).charts, lengths(ob)
    bpy.ops.uv.atlasfit_pack(margin=8, texture_size=256)
    assert quality(ob).charts == charts and cut_edges(ob) == cut
    for a, b in zip(lengths(ob), before):
        assert np.allclose(a / a.max(), b / b.max(), atol=2e-3)
    assert report(ob)["title"] == "Pack Islands"


def test_objects_are_packed_on_one_texture_or_on_one_each():
    a, b = monkey(), piled()
    select(a)
    bpy.ops.uv.atlasfit_unwrap()
    select(a, b)
    bpy.ops.uv.atlasfit_pack()
    assert_good(a, b)
    bpy.ops.uv.atlasfit_pack(together=False)
    assert_good(a)
    assert_good(b)
    assert quality(a, b).overlapping_faces > 0


def test_charts_with_pins_stay_and_the_others_go_on_a_free_tile():
    ob = piled()
    before, layer = uvs(ob), ob.data.uv_layers.active
    layer.data[1].pin_uv = True
    bpy.ops.uv.atlasfit_pack()
    after = uvs(ob)
    assert (after[:4] == before[:4]).all(), "one corner is pinned, the whole chart stays"
    assert (np.floor(after[4:]) == [1, 0]).all() and quality(ob).overlapping_faces == 0
    assert "charts with pinned UVs stay; the others begin on tile 1002" in report(ob)["notes"]
    bpy.ops.uv.atlasfit_pack(pinned=False)
    assert_good(ob)
    assert "1 pinned UVs" in report(ob)["notes"]
    for i in range(12):
        ob.data.uv_layers.active.data[i].pin_uv = True
    refused(lambda: bpy.ops.uv.atlasfit_pack(), "all charts have pinned UVs")


def test_packing_in_edit_mode_packs_the_selected_faces_and_leaves_the_others():
    ob = piled()
    before = uvs(ob)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    edited = bmesh.from_edit_mesh(ob.data)
    for face in edited.faces:
        face.select_set(face.index > 0)
    bmesh.update_edit_mesh(ob.data)
    bpy.ops.uv.atlasfit_pack()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert (uvs(ob)[:4] == before[:4]).all() and (uvs(ob)[4:] != before[4:]).any()


def test_in_edit_mode_charts_keep_clear_of_the_other_faces_at_their_density():
    for call in (bpy.ops.uv.atlasfit_unwrap, bpy.ops.uv.atlasfit_pack):
        ob = grid()
        # The whole sheet in a quarter of the page, with a gap in it.
        mesh.uv_put(ob.data.uv_layers.active, 0.5 * uvs(ob) + 0.25)
        before, (chosen, corner) = uvs(ob), right(ob)
        scale = 0.5 / ob.dimensions.x
        edit(ob, "polygons", chosen)
        assert call(texture_size=1024) == {"FINISHED"}
        bpy.ops.object.mode_set(mode="OBJECT")
        assert (uvs(ob)[~corner] == before[~corner]).all() and (uvs(ob)[corner] != before[corner]).any()
        q = assert_good(ob)
        assert q.overlapping_faces == 0
        assert float(report(ob)["pixels per unit"]) == float(f"{1024 * scale:.4g}")
        assert call(keep_clear=False) == {"FINISHED"}
    ob = piled()
    edit(ob, "polygons", [False, True, True])
    bpy.ops.uv.atlasfit_pack()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "leave no room" in report(ob)["notes"]


def test_packing_draws_textures_anew_and_needs_uvs():
    ob = wooden()
    mesh.uv_put(ob.data.uv_layers.active, 0.4 * uvs(ob) + 0.5)
    before, old = colors(ob, shown(ob)), shown(ob)
    bpy.ops.uv.atlasfit_pack()
    assert shown(ob) != old and np.abs(colors(ob, shown(ob)) - before).mean() < 2 / 255
    ob = monkey()
    refused(lambda: bpy.ops.uv.atlasfit_pack(), "has no UV map that could be packed")


# ---- Mark Seams


def test_seams_are_marked_edited_and_honoured():
    ob = cylinder()
    bpy.ops.uv.atlasfit_unwrap(sharp=False)
    cut = cut_edges(ob)
    assert cut and not seams(ob)
    bpy.ops.uv.atlasfit_mark_seams()
    assert seams(ob) == cut
    bpy.ops.uv.atlasfit_unwrap(sharp=False)
    assert cut_edges(ob) >= cut, "unwrapped again: cut there"
    # One more, along the side: it opens nothing else.
    height = lambda e: abs(ob.data.vertices[e.vertices[0]].co.z - ob.data.vertices[e.vertices[1]].co.z)
    upright = next(e for e in ob.data.edges if not e.use_seam and height(e) > 0)
    upright.use_seam = True
    bpy.ops.uv.atlasfit_unwrap(sharp=False)
    assert cut_edges(ob) >= cut | {tuple(sorted(upright.vertices))}
    assert_good(ob)


def test_a_seam_that_was_cleared_is_sewn_and_one_that_was_added_is_cut():
    ob = grid()
    wanted = middle(ob, "use_seam")
    bpy.ops.uv.atlasfit_unwrap(mark_seams=True)
    assert seams(ob) == cut_edges(ob) == wanted
    for e in ob.data.edges:
        e.use_seam = False
    across = {
        tuple(sorted(e.vertices))
        for e in ob.data.edges
        if all(abs(ob.data.vertices[v].co.y) < 1e-6 for v in e.vertices)
    }
    for e in ob.data.edges:
        e.use_seam = tuple(sorted(e.vertices)) in across
    bpy.ops.uv.atlasfit_unwrap()
    assert cut_edges(ob) == across, "cut where the artist says, and no longer where it was cleared"


def test_marking_seams_in_edit_mode_leaves_those_of_other_faces():
    ob = grid()
    unwrap_apart(ob)
    own = next(e for e in ob.data.edges if all(ob.data.vertices[v].co.x < -0.5 for v in e.vertices))
    own.use_seam = True
    name = tuple(sorted(own.vertices))
    chosen = np.array([p.center.x > -0.3 for p in ob.data.polygons])
    edit(ob, "polygons", chosen)
    bpy.ops.uv.atlasfit_mark_seams()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert seams(ob) == middle(ob) | {name}
    bpy.ops.uv.atlasfit_mark_seams(clear=False)
    assert seams(ob) == middle(ob) | {name}
    bpy.ops.uv.atlasfit_mark_seams()
    assert seams(ob) == middle(ob)
    monkey()
    refused(lambda: bpy.ops.uv.atlasfit_mark_seams(), "has no UV map")


# ---- a density beside tiles


def tiles(ob):
    inside = [uvs(ob)[list(p.loop_indices)].mean(axis=0) for p in ob.data.polygons]
    return {tuple(np.floor(c).astype(int)) for c in inside}


def density(ob):
    """Pixels per unit on a tile of 256 pixels, as the UVs have it."""
    area = sum(p.area for p in ob.data.polygons)
    flat = sum(
        abs(np.cross(b - a, c - a)) / 2 + abs(np.cross(c - a, d - a)) / 2
        for a, b, c, d in (uvs(ob)[list(p.loop_indices)] for p in ob.data.polygons)
    )
    return 256 * np.sqrt(flat / area)


def test_a_density_is_kept_on_as_many_tiles_as_it_needs_also_by_charts_larger_than_a_tile():
    ob = grid()  # 2 x 2 units: one chart
    bpy.ops.uv.atlasfit_unwrap(texture_size=256, density=100.0)
    assert tiles(ob) == {(0, 0)} and abs(density(ob) - 100) < 0.5 and "notes" not in report(ob)
    bpy.ops.uv.atlasfit_pack(texture_size=256, density=50.0)
    assert tiles(ob) == {(0, 0)} and abs(density(ob) - 50) < 0.5 and "notes" not in report(ob)
    bpy.ops.uv.atlasfit_unwrap(texture_size=256, density=200.0)
    assert len(tiles(ob)) > 1 and abs(density(ob) - 200) < 0.5 and "density" not in report(ob)["notes"]
    bpy.ops.uv.atlasfit_unwrap()
    bpy.ops.uv.atlasfit_pack(texture_size=256, density=200.0)
    assert density(ob) < 130, "a chart that is kept is not cut"
    assert "the density was lowered" in report(ob)["notes"]


def test_copies_keep_a_density_on_as_many_tiles_as_they_need_together():
    ob = grid()
    obs = [ob]
    for _ in range(3):
        copy = ob.copy()
        copy.data = ob.data.copy()
        bpy.context.collection.objects.link(copy)
        obs.append(copy)
    select(*obs)
    for wanted in (100.0, 200.0):
        bpy.ops.uv.atlasfit_unwrap(texture_size=256, density=wanted)
        assert all(abs(density(copy) - wanted) < 0.5 for copy in obs)
        assert "density" not in report(ob)["notes"] and quality(*obs).overlapping_faces == 0
        alone = [len(tiles(copy)) for copy in obs]
        if wanted == 100.0:  # a sheet takes most of a tile
            assert alone == [1] * 4 and len(set().union(*map(tiles, obs))) == 4
        else:  # and is cut where it is larger than one
            assert min(alone) > 1 and len({frozenset(cut_edges(copy)) for copy in obs}) == 1


def test_tiles_bound_what_a_density_takes_and_that_is_said():
    ob = grid()
    ob.modifiers.new("solid", "SOLIDIFY").thickness = 0.5
    bpy.ops.object.modifier_apply(modifier="solid")  # six sides
    found = []
    for pages in (1, 2, 4):
        bpy.ops.uv.atlasfit_unwrap(texture_size=256, density=400.0, pages=pages)
        assert len(tiles(ob)) <= pages and "the density was lowered" in report(ob)["notes"]
        assert f"{density(ob):.0f}" == f"{float(report(ob)['pixels per unit']):.0f}"
        found.append(density(ob))
    assert found[0] < found[1] < found[2] < 400, "more tiles, more density"


def test_textures_are_drawn_anew_on_one_tile_and_more_are_refused_before_the_work():
    ob = wooden()
    before, image = uvs(ob), shown(ob)
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(pages=2, density=100.0), "turn Keep Textures off")
    assert (uvs(ob) == before).all() and shown(ob) == image
    bpy.ops.uv.atlasfit_unwrap(pages=2, density=100.0, textures=False)
    bpy.ops.uv.atlasfit_unwrap(density=100.0)
    assert tiles(ob) == {(0, 0)}


def test_parts_of_one_shape_are_stacked_where_that_is_asked_for():
    first, second = cylinder(), cylinder()
    second.location.x = 5
    mesh.put_positions(second.data, mesh.positions(second.data)[:, [1, 2, 0]])
    select(first, second)
    bpy.ops.uv.atlasfit_unwrap(stack="identical", seams=False)
    assert int(report(first)["stacked parts"]) == 1
    corners = [{*map(tuple, uvs(ob).reshape(-1, 2).round(6))} for ob in (first, second)]
    assert corners[0] == corners[1]
    bpy.ops.uv.atlasfit_unwrap()
    assert "stacked parts" not in report(first)
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(stack="mirrored", bake=True), "share their pixels")


def test_strips_are_laid_straight_where_that_is_asked_for():
    ob = from_lists(*strip())
    bpy.ops.uv.atlasfit_unwrap()
    assert quality(ob).straightness < 0.5 and "straightened charts" not in report(ob)
    bpy.ops.uv.atlasfit_unwrap(straighten=True)
    q = assert_good(ob, stretch=1.1)
    assert q.straightness == 1.0 and int(report(ob)["straightened charts"]) == q.charts


def test_seams_go_where_a_vertex_group_is_painted_and_where_they_are_hidden():
    ob = monkey()
    behind = mesh.positions(ob.data)[:, 1] > 0  # the face looks along -y

    def share():
        """Of the cut edges' length, the part that lies behind."""
        ends = np.array([e for e in cut_edges(ob)])
        at = mesh.positions(ob.data)[ends]
        length = np.linalg.norm(at[:, 0] - at[:, 1], axis=1)
        return length[behind[ends].all(1)].sum() / length.sum()

    bpy.ops.uv.atlasfit_unwrap(preset="few-seams")
    plain, layout = share(), uvs(ob)
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(seam_group="Behind"), "no object has a vertex group Behind")
    group = ob.vertex_groups.new(name="Behind")
    group.add([int(i) for i in np.flatnonzero(behind)], 1.0, "REPLACE")
    bpy.ops.uv.atlasfit_unwrap(preset="few-seams", seam_group="Behind")
    assert share() > plain + 0.02, (plain, share())
    bpy.ops.uv.atlasfit_unwrap(preset="few-seams", seams_hidden=1.0)
    assert_good(ob, stretch=1.3)
    hidden = uvs(ob)
    bpy.ops.uv.atlasfit_unwrap(preset="few-seams", seams_hidden=1.0, seen_from_below=True)
    assert not np.array_equal(hidden, layout) and not np.array_equal(hidden, uvs(ob))
