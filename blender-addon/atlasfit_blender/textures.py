# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures that materials show through a UV map: read before it is laid out anew, then drawn anew."""

from dataclasses import dataclass

import bpy
import numpy as np

from . import bake, mesh
from .long import within
from .native import atlasfit

OURS = "atlasfit_texture"  # images that were made here: replaced, not heaped up


@dataclass
class Shown:
    """An image that some faces show."""

    image: str
    normals: bool
    texels: np.ndarray  # (height, width, 4) uint8, the top row first
    faces: np.ndarray  # (m,) of each triangle 0 or NO_IMAGE


@dataclass
class Old:
    """All that the triangles show through their UVs."""

    uv: np.ndarray  # (m, 3, 2)
    shown: list

    def page(self, vertices, faces, **how):
        """The page that keeps the detail of the densest of them."""
        pages = [
            atlasfit.texture_page(vertices, faces, [s.texels], self.uv, face_images=s.faces, **how)
            for s in self.shown
        ]
        return max(pages, key=lambda page: page.density)

    def draw(self, vertices, faces, uv, page, progress, cancel):
        """Each image for the new UVs."""
        size, texels, out = uv.info.width, uv.info.texels_per_unit, []
        while texels < page.density and 2 * size <= 8192:
            size, texels = 2 * size, 2 * texels
        for i, s in enumerate(self.shown):
            how = {
                "progress": within(progress, i / len(self.shown), (i + 1) / len(self.shown)),
                "cancel": cancel,
            }
            out.append(
                atlasfit.bake_textures(
                    vertices,
                    faces,
                    uv.corner_uv,
                    [s.texels],
                    self.uv,
                    face_images=s.faces,
                    normals=s.normals,
                    page_size=size,
                    **how,
                )
            )
        return out


def read(obs, parts, obstacle):
    """What the objects' triangles show through their active UV maps, or None; and what to tell of images that
    are shown but cannot be drawn anew. `obstacle`: why none can, where that is so.
    """
    found, notes, uv = {}, [], []
    first = 0
    total = sum(len(part.loops) for part in parts)
    for ob, part in zip(obs, parts):
        layer = ob.data.uv_layers.active
        count = len(part.loops)
        uv.append(mesh.uv_get(layer)[part.loops] if layer else np.zeros((count, 3, 2), np.float32))
        slot = mesh.get(ob.data.polygons, "material_index", 1, np.int32)[part.polygons]
        for node, slots in _nodes(ob, layer).items():
            mine = np.isin(slot, slots)
            if not mine.any():
                continue
            why = obstacle or _refusal(node)
            if why:
                notes.append(f"the image {node.image.name} no longer fits: {why}")
                continue
            faces = found.setdefault(
                (node.image.name, _is_normal(node)), np.full(total, atlasfit.NO_IMAGE, np.uint32)
            )
            faces[first : first + count][mine] = 0
        first += count
    shown = [
        Shown(image, normals, _texels(bpy.data.images[image]), faces)
        for (image, normals), faces in found.items()
    ]
    return (Old(np.concatenate(uv), shown) if shown else None), list(dict.fromkeys(notes))


def write(old, drawn, obs):
    """Puts the new images where the old ones were shown: in the objects' materials, or in copies of those
    that
    other objects have too. Returns what to tell.
    """
    notes, new = [], {}
    for s, texels in zip(old.shown, drawn):
        before = bpy.data.images[s.image]
        name = before.name if before.get(OURS) else f"{before.name.rsplit('.', 1)[0]} Atlas"
        picture = bpy.data.images.new(name, texels.shape[1], texels.shape[0], alpha=True)
        picture.colorspace_settings.name = before.colorspace_settings.name
        picture.alpha_mode = before.alpha_mode
        picture.pixels.foreach_set((texels[::-1] / np.float32(255)).ravel())
        picture.update()
        picture[OURS] = True
        notes += bake.save(picture, [before] if before.get(OURS) else [])
        new[s.image, s.normals] = picture
    for ob in obs:
        for node in list(_nodes(ob, ob.data.uv_layers.active)):
            material = next(s.material for s in ob.material_slots if _has(s.material, node))
            if not bake.only_of(material, obs):
                twin = material.copy()
                for slot in ob.material_slots:
                    if slot.material == material:
                        slot.material = twin
                node = twin.node_tree.nodes[node.name]
            picture = new.get((node.image.name, _is_normal(node)))
            if picture is not None:
                node.image = picture
    for s in old.shown:
        before = bpy.data.images[s.image]
        if before.get(OURS) and before.users == 0 and not before.is_dirty:
            bpy.data.images.remove(before)
    sizes = {f"{t.shape[1]} x {t.shape[0]}" for t in drawn}
    names = ", ".join(s.image for s in old.shown)
    return [f"drawn anew for the new UVs at {', '.join(sorted(sizes))}: {names}", *notes]


def _has(material, node):
    return material is not None and material.node_tree is not None and node.id_data == material.node_tree


def _nodes(ob, layer):
    """The image nodes of the object's materials that show an image through a UV map, each with the slots of
    its
    material.
    """
    out = {}
    for i, slot in enumerate(ob.material_slots):
        material = slot.material
        if layer is None or material is None or material.node_tree is None or not material.use_nodes:
            continue
        for node in material.node_tree.nodes:
            if node.type == "TEX_IMAGE" and node.image is not None and _through(node, layer):
                out.setdefault(node, []).append(i)
    return out


def _through(node, layer):
    """Whether a node looks its image up through the UV map."""
    source = _source(node)
    if source is None:
        return layer.active_render
    origin = source.from_node
    if origin.type == "UVMAP":
        return origin.uv_map == layer.name or not origin.uv_map and layer.active_render
    if origin.type == "ATTRIBUTE":
        return origin.attribute_name == layer.name
    return origin.type == "TEX_COORD" and source.from_socket.name == "UV" and layer.active_render


def _source(node):
    """The link that the node's place comes from, beyond mappings; None where nothing is linked."""
    link = next(iter(node.inputs["Vector"].links), None)
    while link is not None and link.from_node.type == "MAPPING":
        link = next(iter(link.from_node.inputs["Vector"].links), None)
    return link


def _refusal(node):
    """Why an image cannot be drawn anew; None where it can."""
    link = next(iter(node.inputs["Vector"].links), None)
    if link is not None and link.from_node.type == "MAPPING":
        return "its node goes through a Mapping"
    image = node.image
    if image.source not in {"FILE", "GENERATED"}:
        return f"images of the kind {image.source.lower()} are not drawn anew"
    if image.is_float:
        return "it has more than 8 bits"
    if not image.pixels or min(image.size) == 0:
        return "its file is missing"
    return None


def _is_normal(node):
    return any(link.to_node.type == "NORMAL_MAP" for socket in node.outputs for link in socket.links)


def _texels(image):
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(image.size[1], image.size[0], -1)
    out = np.full((*values.shape[:2], 4), 255, np.uint8)
    channels = min(values.shape[2], 4)
    out[:, :, :channels] = np.round(255 * np.clip(values[:, :, :channels], 0, 1))
    if channels < 3:  # grey
        out[:, :, 1:3] = out[:, :, :1]
    return np.ascontiguousarray(out[::-1])
