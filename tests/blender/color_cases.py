"""Cases of colours: UV Stretch, baking, and the materials, images and UV maps that show what was baked.
Part of cases.py, which runs them.
"""

import bpy
import numpy as np

from scenes import everything, grid, mesh, monkey, refused, report, right, select, uvs


# ---- UV Stretch


def test_a_vertex_that_is_not_finite_does_not_spoil_the_stretch_of_the_others():
    ob = monkey()
    bpy.ops.uv.atlasfit_unwrap()
    bpy.ops.uv.atlasfit_stretch()
    before = report(ob)
    co = mesh.positions(ob.data)
    co[7] = np.nan
    mesh.put_positions(ob.data, co)
    bpy.ops.uv.atlasfit_stretch()
    after = report(ob)
    assert after["charts"] == before["charts"] and after["flipped"] == "0"
    for name in ("stretch L2", "stretch of 95 percent"):
        assert abs(float(after[name]) / float(before[name]) - 1) < 0.02, (name, after[name], before[name])
    shown = next(a for a in ob.data.color_attributes if mesh.shows_stretch(a))
    assert np.isfinite(mesh.get(shown.data, "color", 4, np.float32)).all()


def test_stretch_is_a_color_attribute():
    ob = grid()
    uv = uvs(ob)
    uv[right(ob)[1], 0] *= 3
    mesh.uv_put(ob.data.uv_layers.active, uv)
    assert bpy.ops.uv.atlasfit_stretch() == {"FINISHED"}
    attribute = ob.data.color_attributes.active_color
    assert attribute.name == "UV Stretch" and attribute.domain == "CORNER"
    assert len({tuple(c) for c in np.round(mesh.get(attribute.data, "color", 4, np.float32), 2)}) == 2
    assert "stretch of 95 percent" in report(ob)
    bpy.ops.uv.atlasfit_stretch()
    assert len(ob.data.color_attributes) == 1


def test_stretch_without_uvs_is_refused():
    monkey()
    refused(lambda: bpy.ops.uv.atlasfit_stretch(), "no UV map")


def painted(ob, color, name="paint"):
    """Gives the object an active colour attribute of one (linear) colour."""
    attribute = ob.data.color_attributes.new(name=name, type="FLOAT_COLOR", domain="CORNER")
    mesh.put(attribute.data, "color", np.tile(np.float32([*color, 1]), (len(ob.data.loops), 1)))
    ob.data.color_attributes.active_color = ob.data.color_attributes[name]
    return ob


def shown(ob):
    """The image of the object's only material."""
    nodes = ob.active_material.node_tree.nodes
    return next(n.image for n in nodes if n.type == "TEX_IMAGE")


def baked_color(image):
    """The mean of what is covered."""
    pixels = np.array(image.pixels[:]).reshape(-1, 4)
    return pixels[pixels[:, 3] > 0.5][:, :3].mean(0)


def test_colors_of_uv_stretch_are_never_the_ones_that_are_baked():
    ob = painted(grid(), (1, 1, 1), "first")
    painted(ob, (1, 0, 1))
    bpy.ops.uv.atlasfit_stretch()
    bpy.ops.uv.atlasfit_stretch()
    assert ob.data.color_attributes.active_color.name == "UV Stretch"
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    assert np.allclose(baked_color(shown(ob)), (1, 0, 1), atol=0.01)
    ob = grid()
    bpy.ops.uv.atlasfit_stretch()
    refused(lambda: bpy.ops.uv.atlasfit_unwrap(bake=True), "no color attribute")


def test_colors_of_uv_stretch_are_no_colors_of_a_scan():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
    bpy.ops.uv.atlasfit_stretch()
    bpy.ops.object.atlasfit_reconstruct(texture_size=64)
    me = bpy.context.object.data
    assert not me.color_attributes and [m.name for m in me.materials] == ["Atlas Checker"]


# ---- Bake


def test_vertex_colors_are_baked_and_materials_stay():
    ob = everything()
    attribute = ob.data.color_attributes.new(name="c", type="FLOAT_COLOR", domain="CORNER")
    mesh.put(attribute.data, "color", np.tile(np.float32([0.2, 0.4, 0.6, 1]), (len(ob.data.loops), 1)))
    ob.data.color_attributes.active_color = ob.data.color_attributes["c"]
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=128)
    assert (
        [m.name[:4] for m in ob.data.materials] == ["red", "blue"]
        and "in no material" in report(ob)["notes"]
    )
    image = next(i for i in bpy.data.images if i.name.startswith("everything"))
    pixels = np.array(image.pixels[:]).reshape(-1, 4)
    want = 1.055 * np.array([0.2, 0.4, 0.6]) ** (1 / 2.4) - 0.055
    assert np.abs(pixels[pixels[:, 3] > 0.5][:, :3] - want).max() < 0.01
    refused(lambda: (monkey(), bpy.ops.uv.atlasfit_unwrap(bake=True)), "no color attribute")


def test_a_material_shows_what_was_baked_last():
    ob = painted(grid(), (1, 0, 0))
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    material = ob.active_material
    painted(ob, (0, 1, 0), "other")
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=128, margin=4)
    assert ob.active_material == material and len(ob.data.materials) == 1
    assert tuple(shown(ob).size) == (128, 128) and np.allclose(baked_color(shown(ob)), (0, 1, 0), atol=0.01)
    assert len(bpy.data.images) == 1 and len(bpy.data.materials) == 1 and "notes" not in report(ob)


def test_the_uv_map_that_is_baked_is_the_one_that_is_rendered():
    ob = painted(grid(), (1, 0, 0))
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    for target in ("NEW", "ACTIVE"):
        bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64, target=target, name="Mine")
        assert [(u.name, u.active, u.active_render) for u in ob.data.uv_layers] == [
            ("UVMap", False, False), ("Mine", True, True),
        ]
    # Where the map that is rendered is not the active one, the one that is baked takes its place.
    ob.data.uv_layers["UVMap"].active_render = True
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    assert ob.data.uv_layers["Mine"].active_render


def test_materials_of_the_user_keep_the_uv_map_that_they_show():
    ob = painted(grid(), (1, 0, 0))
    ob.data.materials.append(bpy.data.materials.new("mine"))
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64, target="NEW")
    assert ob.data.uv_layers["UVMap"].active_render and ob.active_material.name == "mine"
    assert "in no material" in report(ob)["notes"]


def test_a_material_that_others_show_keeps_their_image():
    a, b = painted(grid(), (1, 0, 0)), painted(monkey(), (0, 0, 1))
    select(a, b)
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    both = shown(b)
    assert shown(a) == both and a.active_material == b.active_material
    select(a)
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=128)
    assert shown(b) == both and tuple(shown(a).size) == (128, 128)
    assert np.allclose(baked_color(shown(a)), (1, 0, 0), atol=0.01)
    # Baked together again they share one, and nothing is left of those before.
    select(a, b)
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    assert shown(a) == shown(b) and len(bpy.data.images) == len(bpy.data.materials) == 1


def test_new_uvs_without_a_bake_are_said_to_fit_the_image_no_longer():
    ob = painted(grid(), (1, 0, 0))
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    bpy.ops.uv.atlasfit_unwrap(target="NEW")
    assert "notes" not in report(ob) and ob.data.uv_layers["UVMap"].active_render
    ob.data.uv_layers.active = ob.data.uv_layers["UVMap"]
    bpy.ops.uv.atlasfit_unwrap(textures=False)
    assert "no longer fits: Keep Textures is off" in report(ob)["notes"]


def test_an_image_that_was_painted_on_is_kept():
    ob = painted(grid(), (1, 0, 0))
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    old = shown(ob)
    old.pixels[0] = 0.5
    old.update()
    assert old.is_dirty
    bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
    assert shown(ob) != old and old.use_fake_user and "painted on" in report(ob)["notes"]
