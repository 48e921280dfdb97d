# SPDX-License-Identifier: GPL-3.0-or-later
"""Corner colours drawn into a texture through UVs, and the image and material that show it."""

import bpy
import numpy as np

from . import mesh
from .long import Refused

TEXELS_AT_ONCE = 4_000_000  # bounds the memory of one step and the time until a cancel is seen


def corner_colors(me, loops):
    """The active colour attribute at triangle corners, (m, 3, 4) linear."""
    attribute = me.color_attributes.active_color if len(me.color_attributes) else None
    if attribute is None:
        raise Refused(f"{me.name} has no color attribute to bake")
    colors = mesh.get(attribute.data, "color", 4, np.float32)
    if attribute.domain == "POINT":
        return colors[mesh.get(me.loops, "vertex_index", 1, np.int32)[loops]]
    return colors[loops]


def image(colors, corner_uv, size, margin, progress):
    """Draws triangles with interpolated colours, (size, size, 4) float32, bottom row first; the margin is filled with what is beside it."""
    uv = corner_uv.astype(np.float64) * size - 0.5  # texel centres on integers
    low = np.clip(np.ceil(uv.min(1)), 0, size - 1).astype(np.int64)
    high = np.clip(np.floor(uv.max(1)), -1, size - 1).astype(np.int64)
    wide, tall = np.maximum(high - low + 1, 0).T
    count = wide * tall
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    out, drawn = np.zeros((size * size, 4), np.float32), np.zeros(size * size, bool)
    # A texel under no triangle's middle still gets a colour: each corner is drawn first.
    at = np.clip(np.rint(uv), 0, size - 1).astype(np.int64)
    flat = (at[..., 1] * size + at[..., 0]).ravel()
    out[flat], drawn[flat] = colors.reshape(-1, 4), True
    ends = np.cumsum(count)
    start, faces = 0, len(count)
    while start < faces:
        done = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, done + TEXELS_AT_ONCE)), start + 1)
        which = np.repeat(np.arange(start, stop), count[start:stop])
        nth = np.arange(len(which)) - np.repeat(ends[start:stop] - count[start:stop] - done, count[start:stop])
        x, y = low[which, 0] + nth % wide[which], low[which, 1] + nth // wide[which]
        p = np.stack([x, y], 1) - uv[which, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (p[:, 0] * b[which, 1] - p[:, 1] * b[which, 0]) / area[which]
            t = (a[which, 0] * p[:, 1] - a[which, 1] * p[:, 0]) / area[which]
        inside = (s >= 0) & (t >= 0) & (s + t <= 1)
        which, s, t = which[inside], s[inside, None], t[inside, None]
        texel = y[inside] * size + x[inside]
        out[texel] = (1 - s - t) * colors[which, 0] + s * colors[which, 1] + t * colors[which, 2]
        drawn[texel] = True
        start = stop
        if progress("baking colors", start / faces) is False:
            break  # asked to stop: what is drawn will not be used
    return _bleed(out.reshape(size, size, 4), drawn.reshape(size, size), margin + 1)


def _bleed(colors, drawn, texels):
    """Grows what is drawn into what is not, one texel a turn: filtering at a chart's edge must not see the background."""
    for _ in range(texels):
        total, weight = np.zeros_like(colors), np.zeros(drawn.shape, np.float32)
        for axis in (0, 1):
            for step in (1, -1):
                source = [slice(None)] * 2
                target = [slice(None)] * 2
                source[axis], target[axis] = (slice(None, -1), slice(1, None)) if step == 1 else (slice(1, None), slice(None, -1))
                mine = drawn[tuple(source)]
                total[tuple(target)] += colors[tuple(source)] * mine[..., None]
                weight[tuple(target)] += mine
        new = ~drawn & (weight > 0)
        colors[new] = total[new] / weight[new, None]
        drawn = drawn | new
    return colors


def write(pixels, obs):
    """The pixels as an image packed into the file, and a material with it for the objects that have none. Returns what to tell."""
    name = f"{obs[0].name} Color"
    size = len(pixels)
    picture = bpy.data.images.new(name, size, size, alpha=True)
    srgb = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.maximum(pixels, 1e-9) ** (1 / 2.4) - 0.055)
    srgb[..., 3] = pixels[..., 3]
    picture.pixels.foreach_set(np.clip(srgb, 0, 1).astype(np.float32).ravel())
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
