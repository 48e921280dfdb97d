# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of a mesh for a texture, and the image and material that show it."""

import bpy
import numpy as np
from bpy.props import IntProperty

from . import mesh
from .long import Refused
from .native import atlasfit

# Of the operators that bake, or pack for a texture.
TEXTURE_SIZE = IntProperty(
    name="Texture Size", description="Side of the texture in pixels", default=1024, min=16, max=65536
)


def corner_colors(me, loops):
    """The active colour attribute at triangle corners, (m, 3, 4) as an image holds them."""
    attribute = me.color_attributes.active_color if len(me.color_attributes) else None
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


def image(colors, corner_uv, **options):
    """Draws the colours of corners: atlasfit.bake() of a mesh that is cut apart, where each corner is a
    vertex.
    """
    corners = np.arange(3 * len(corner_uv)).reshape(-1, 3)
    return atlasfit.bake(
        np.zeros((corners.size, 3), np.float32), corners, corner_uv, colors.reshape(-1, 4), **options
    )


def write(texels, obs):
    """The texels as an image packed into the file, and a material with it for the objects that have none.
    Returns what to tell.
    """
    name = f"{obs[0].name} Color"
    picture = bpy.data.images.new(name, texels.shape[1], texels.shape[0], alpha=True)
    picture.pixels.foreach_set((texels[::-1] / np.float32(255)).ravel())  # Blender's bottom row comes first
    picture.update()
    picture.pack()
    bare = [ob for ob in obs if not any(slot.material for slot in ob.material_slots)]
    if bare:
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        nodes = material.node_tree.nodes
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = picture
        texture.location = (-300, 300)
        surface = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
        material.node_tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
        for ob in bare:
            if ob.material_slots:
                ob.material_slots[0].material = material
            else:
                ob.data.materials.append(material)
    kept = len(obs) - len(bare)
    return [f"the image {picture.name} is in no material: {kept} objects keep their own"] if kept else []
