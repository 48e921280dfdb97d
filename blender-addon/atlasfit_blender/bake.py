# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of a mesh for a texture, and the image and material that show it."""

import os

import bpy
import numpy as np
from bpy.props import IntProperty

from . import mesh
from .long import Refused
from .native import atlasfit

CHECKER = "Atlas Checker"
TEXTURE = "Atlas Color"  # the node that shows a baked image: materials that have it are ours
# Of the operators that bake, or pack for a texture.
TEXTURE_SIZE = IntProperty(
    name="Texture Size", description="Side of the texture in pixels", default=1024, min=16, max=65536
)


def corner_colors(me, loops):
    """The mesh's own colours at triangle corners, (m, 3, 4) as an image holds them."""
    attribute = mesh.own_colors(me)
    if attribute is None:
        raise Refused(f"{me.name} has no color attribute to bake")
    colors = srgb(mesh.get(attribute.data, "color", 4, np.float32))
    if attribute.domain == "POINT":
        return colors[mesh.get(me.loops, "vertex_index", 1, np.int32)[loops]]
    return colors[loops]


def srgb(colors):
    """Linear colours, (n, 4), as an image of 8 bits holds them."""
    out = np.where(colors <= 0.0031308, 12.92 * colors, 1.055 * np.maximum(colors, 1e-9) ** (1 / 2.4) - 0.055)
    out[:, 3] = colors[:, 3]
    return out.astype(np.float32)


def linear(colors):
    """The reverse of srgb()."""
    low = np.maximum(colors, 0)
    out = np.where(low <= 0.04045, low / 12.92, ((low + 0.055) / 1.055) ** 2.4)
    out[:, 3] = colors[:, 3]
    return out.astype(np.float32)


def image(colors, corner_uv, **options):
    """Draws the colours of corners: atlasfit.bake() of a mesh that is cut apart, where each corner is a
    vertex.
    """
    corners = np.arange(3 * len(corner_uv)).reshape(-1, 3)
    return atlasfit.bake(
        np.zeros((corners.size, 3), np.float32), corners, corner_uv, colors.reshape(-1, 4), **options
    )


def write(texels, obs):
    """The texels as an image packed into the file. Objects without a material get one that shows it; one that
    a bake before made shows the new image instead of the old. The UV map that was baked is then the one that
    is rendered. Objects with materials of their own keep them. Returns what to tell.
    """
    name, notes = f"{obs[0].name} Color", []
    picture = bpy.data.images.new(name, texels.shape[1], texels.shape[0], alpha=True)
    picture.pixels.foreach_set((texels[::-1] / np.float32(255)).ravel())  # Blender's bottom row comes first
    picture.update()
    before = {slot.material: None for ob in obs for slot in ob.material_slots if _texture(slot.material)}
    showing = [ob for ob in obs if all(s.material in before for s in ob.material_slots if s.material)]
    images = {_texture(material).image: None for material in before} if showing else {}
    notes += save(picture, images)
    if showing:
        material = next((m for m in before if only_of(m, obs)), None) or _material(name)
        material.node_tree.nodes[TEXTURE].image = picture
        for ob in showing:
            _assign(ob, material)
            ob.data.uv_layers.active.active_render = True
        notes += _forget(before, images)
    kept = len(obs) - len(showing)
    if kept:
        notes.append(f"the image {picture.name} is in no material: {kept} objects keep their own")
    return notes


def save(picture, before):
    """Packs the image into the file, and saves it beside a .blend that is saved: what OBJ and other exports
    name. It takes the place of the one `before` it, else a name that is free. Returns what to tell.
    """
    if bpy.data.filepath:
        ours = [i.filepath_raw for i in before if i.filepath_raw.startswith("//") and not i.is_dirty]
        stem, n = bpy.path.clean_name(picture.name), 0
        path = ours[0] if ours else f"//{stem}.png"
        while not ours and os.path.lexists(bpy.path.abspath(path)):
            n += 1
            path = f"//{stem}_{n}.png"
        picture.filepath_raw, picture.file_format = path, "PNG"
        try:
            picture.save()
        except RuntimeError as failure:
            picture.filepath_raw = ""
            picture.pack()
            return [f"the image cannot be saved beside the .blend file: {failure}"]
    picture.pack()
    return []


def checker(ob):
    """Gives an object without a material one with a checker, on which one sees its UVs."""
    if any(slot.material for slot in ob.material_slots):
        return
    material = bpy.data.materials.get(CHECKER) or _material(CHECKER)
    node = material.node_tree.nodes.get(TEXTURE)
    if node is not None:
        node.name = CHECKER  # no bake replaces it
        node.image = bpy.data.images.new(CHECKER, 1024, 1024)
        node.image.generated_type = "UV_GRID"
    _assign(ob, material)


def _texture(material):
    """The node of a material of ours that shows a baked image; None in other materials."""
    nodes = material.node_tree.nodes if material is not None and material.node_tree is not None else {}
    node = nodes.get(TEXTURE)
    return node if node is not None and node.type == "TEX_IMAGE" and node.image is not None else None


def only_of(material, obs):
    """Whether no other mesh shows the material: another one's UVs are not those of the new image."""
    meshes = {ob.data for ob in obs}
    return all(
        ob.data in meshes
        for ob in bpy.data.objects
        if any(slot.material == material for slot in ob.material_slots)
    )


def _material(name):
    """A new material with a node for the image."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    texture = nodes.new("ShaderNodeTexImage")
    texture.name, texture.location = TEXTURE, (-300, 300)
    surface = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    return material


def _assign(ob, material):
    """Puts the material where there is one, or in the first slot."""
    filled = [slot for slot in ob.material_slots if slot.material]
    for slot in filled or list(ob.material_slots)[:1]:
        slot.material = material
    if not ob.material_slots:
        ob.data.materials.append(material)


def _forget(materials, images):
    """Removes the materials and images that nothing shows any more, but no image that was painted on.
    Returns what to tell.
    """
    notes = []
    for material in materials:
        if material.users == 0:
            bpy.data.materials.remove(material)
    for old in images:
        if old.users == 0 and not old.is_dirty:
            bpy.data.images.remove(old)
        elif old.users == 0:
            old.use_fake_user = True
            notes.append(f"the image {old.name} was painted on: it is kept, but in no material")
    return notes
