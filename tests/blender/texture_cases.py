"""Cases of textures that a mesh has when it is unwrapped. Part of cases.py, which runs them."""

import os
import tempfile

import bpy
import numpy as np

from scenes import assert_good, edit, grid, mesh, report, right, select, uvs


def picture(name="wood", size=64):
    """A smooth image that repeats: red goes with u, green with v."""
    image = bpy.data.images.new(name, size, size)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    wave = lambda t: 0.5 + 0.5 * np.sin(2 * np.pi * t)
    values = np.stack([wave(x), wave(y), wave(x + y), np.ones_like(x)], 2).astype(np.float32)
    image.pixels.foreach_set(values.ravel())
    image.update()
    return image


def material(image, name="wood", uv_map=None):
    """A material that shows the image through the rendered UV map, or through a named one."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    node = nodes.new("ShaderNodeTexImage")
    node.image = image
    links.new(
        node.outputs["Color"], next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs["Base Color"]
    )
    if uv_map is not None:
        origin = nodes.new("ShaderNodeUVMap")
        origin.uv_map = uv_map
        links.new(origin.outputs["UV"], node.inputs["Vector"])
    return made


def shown(ob, slot=0):
    nodes = ob.material_slots[slot].material.node_tree.nodes
    return next(n.image for n in nodes if n.type == "TEX_IMAGE")


def colors(ob, image):
    """What the image shows in the middle of each triangle."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(image.size[1], image.size[0], 4)
    ob.data.calc_loop_triangles()
    corners = mesh.get(ob.data.loop_triangles, "loops", 3, np.int32)
    at = uvs(ob)[corners].mean(axis=1) % 1.0
    x, y = (at * [image.size[0], image.size[1]] - 0.5).T
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    s, t = (x - i)[:, None], (y - j)[:, None]
    texel = lambda a, b: values[b % image.size[1], a % image.size[0], :3]
    return (1 - t) * ((1 - s) * texel(i, j) + s * texel(i + 1, j)) + t * (
        (1 - s) * texel(i, j + 1) + s * texel(i + 1, j + 1)
    )


def wooden(image=None, **how):
    """A bent grid with UVs and a texture."""
    ob = grid()
    if not ob.data.uv_layers:
        ob.data.uv_layers.new(name="UVMap")
    co = mesh.positions(ob.data)
    mesh.uv_put(
        ob.data.uv_layers.active, co[mesh.get(ob.data.loops, "vertex_index", 1, np.int32)][:, :2] * 0.3 + 0.5
    )
    ob.data.materials.append(material(image or picture(), **how))
    return ob


def test_a_texture_is_drawn_anew_for_the_new_uvs():
    ob = wooden()
    before, old, old_uv = colors(ob, shown(ob)), shown(ob), uvs(ob)
    bpy.ops.uv.atlasfit_unwrap()
    assert_good(ob)
    new = shown(ob)
    assert (
        new != old
        and new.name == "wood Atlas"
        and old.name in bpy.data.images
        and new.packed_file is not None
    )
    assert np.abs(uvs(ob) - old_uv).max() > 0.05
    assert np.abs(colors(ob, new) - before).mean() < 2 / 255
    assert "drawn anew for the new UVs at 1024 x 1024: wood" in report(ob)["notes"]
    # Again: the image is ours and replaced.
    bpy.ops.uv.atlasfit_unwrap(preset="low-stretch")
    assert np.abs(colors(ob, shown(ob)) - before).mean() < 3 / 255
    assert sorted(i.name.split(".")[0] for i in bpy.data.images) == ["wood", "wood Atlas"]


def test_textures_that_other_uvs_show_stay():
    ob = wooden(uv_map="Other")
    image = shown(ob)
    ob.data.uv_layers.new(name="Other")
    bpy.ops.uv.atlasfit_unwrap()
    assert shown(ob) == image and "notes" not in report(ob)
    ob.data.uv_layers.active = ob.data.uv_layers["Other"]
    bpy.ops.uv.atlasfit_unwrap()
    assert shown(ob) != image
    ob = wooden()
    image = shown(ob)
    bpy.ops.uv.atlasfit_unwrap(target="NEW")
    assert shown(ob) == image and ob.data.uv_layers["UVMap"].active_render


def test_each_material_keeps_its_image_and_normal_maps_are_known():
    ob = wooden()
    second = picture("stone", 32)
    ob.data.materials.append(material(second, "stone"))
    nodes, links = (
        ob.material_slots[0].material.node_tree.nodes,
        ob.material_slots[0].material.node_tree.links,
    )
    bumps = nodes.new("ShaderNodeTexImage")
    bumps.image = picture("bumps", 16)
    bumps.image.colorspace_settings.name = "Non-Color"  # before the pixels, which it would reset
    bumps.image.pixels.foreach_set(np.tile(np.float32([0.5, 0.5, 1, 1]), 256))
    turn = nodes.new("ShaderNodeNormalMap")
    links.new(bumps.outputs["Color"], turn.inputs["Color"])
    chosen, _ = right(ob)
    ob.data.polygons.foreach_set("material_index", chosen.astype(np.int32))
    before = [colors(ob, image) for image in (shown(ob, 0), second)]
    bpy.ops.uv.atlasfit_unwrap()
    ob.data.calc_loop_triangles()
    side = chosen[mesh.get(ob.data.loop_triangles, "polygon_index", 1, np.int32)]
    for slot, mine in ((0, ~side), (1, side)):
        error = np.abs(colors(ob, shown(ob, slot)) - before[slot])[mine].mean()
        assert error < 2 / 255, (slot, error)
    flat = bumps.image
    assert flat.name == "bumps Atlas" and flat.colorspace_settings.name == "Non-Color"
    values = np.empty(len(flat.pixels), np.float32)
    flat.pixels.foreach_get(values)
    assert np.abs(values.reshape(-1, 4) - [0.5, 0.5, 1, 1]).max() < 0.02, "flat stays flat"


def test_a_material_that_another_object_has_too_stays_as_it_is():
    one, other = wooden(), grid()
    other.data.materials.append(one.material_slots[0].material)
    image = shown(other)
    select(one)
    bpy.ops.uv.atlasfit_unwrap()
    assert shown(other) == image != shown(one)


def test_what_cannot_be_drawn_anew_is_said():
    ob = wooden()
    bpy.ops.uv.atlasfit_unwrap(textures=False)
    assert "the image wood no longer fits: Keep Textures is off" in report(ob)["notes"]
    ob = wooden()
    nodes, links = (
        ob.material_slots[0].material.node_tree.nodes,
        ob.material_slots[0].material.node_tree.links,
    )
    mapping, coordinates = nodes.new("ShaderNodeMapping"), nodes.new("ShaderNodeTexCoord")
    links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], next(n for n in nodes if n.type == "TEX_IMAGE").inputs["Vector"])
    bpy.ops.uv.atlasfit_unwrap()
    assert "its node goes through a Mapping" in report(ob)["notes"]
    ob = wooden()
    edit(ob, "polygons", right(ob)[0])
    bpy.ops.uv.atlasfit_unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "keep their UVs" in report(ob)["notes"]


def test_new_textures_lie_beside_a_saved_file():
    where = tempfile.mkdtemp()
    bpy.ops.wm.save_as_mainfile(filepath=f"{where}/scene.blend")
    ob = wooden()
    bpy.ops.uv.atlasfit_unwrap()
    bpy.ops.uv.atlasfit_unwrap()
    assert sorted(os.listdir(where)) == ["scene.blend", "wood_Atlas.png"]
    assert shown(ob).filepath_raw == "//wood_Atlas.png"
