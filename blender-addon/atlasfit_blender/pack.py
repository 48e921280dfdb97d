# SPDX-License-Identifier: GPL-3.0-or-later
"""Pack Islands: the charts of the active UV maps stay as they are, and are packed."""

from functools import partial

import bpy
import numpy as np
from bpy.props import BoolProperty

from . import mesh
from .layout import UDIM_ROW, Layout, laid_out, unwrapped
from .long import Refused
from .native import atlasfit

TILES = 100  # of a UDIM texture


class UV_OT_atlasfit_pack(Layout, bpy.types.Operator):
    """Packs charts."""

    bl_idname = "uv.atlasfit_pack"
    bl_label = "Pack Islands"
    bl_description = (
        "Pack the charts of the active UV map by their shapes: they are moved, turned and scaled to one "
        "density, and stay as they are otherwise. What flips or overlaps in a chart is cut"
    )

    pinned: BoolProperty(
        name="Pinned Charts Stay",
        description=(
            "Charts with pinned UVs stay where they are, and the others go on the first UDIM tiles that are"
            " free of them; else they are packed with the others"
        ),
        default=True,
    )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("margin", "texture_size", "density", "pages", "pinned", "together", "textures"):
            layout.prop(self, name)
        if context.mode == "EDIT_MESH":
            layout.prop(self, "keep_clear")

    def library_options(self):
        """Of the library, besides those of the page."""
        return {"keep_uvs": True}

    def read(self, given):
        """A group's UVs and pins, and its old textures."""
        obs = mesh.meshes_of(given.parts)
        uv = mesh.corner_uvs(obs, given.parts, "that could be packed. Run Atlas Unwrap first")
        pins = np.zeros(len(given.faces), bool)
        if self.pinned:
            pins = np.concatenate([_pins(ob.data, part) for ob, part in zip(obs, given.parts)])
        obstacle = "charts with pinned UVs keep theirs" if pins.any() else None
        return given, uv, pins, self.old_textures(obs, given, obstacle)

    @staticmethod
    def lay_out(given, uv, pins, old, options, progress, cancel):
        """The work on one group."""
        tiles, notes = None, []
        if pins.any():
            stay = _charts_with(pins, given, uv, cancel)
            if stay.all():
                raise Refused("all charts have pinned UVs. Clear some pins, or turn Pinned Charts Stay off")
            tiles = _free_tiles(uv[stay])
            given, uv = given.some(~stay), uv[~stay]
            if "occupied_uv" in options and len(tiles):
                first = [tiles[0] % UDIM_ROW, tiles[0] // UDIM_ROW]
                options = options | {"occupied_uv": options["occupied_uv"] - np.float32(first)}
        laid = laid_out(given, partial(unwrapped, corner_uv=uv), options, old, progress, cancel)
        if tiles is not None:
            pages = laid.uv.info.pages
            if len(tiles) < pages:
                raise Refused(f"the charts need {pages} UDIM tiles, and pins leave {len(tiles)} free")
            laid.tiles = tiles[:pages]
            notes.append(f"charts with pinned UVs stay; the others begin on tile {1001 + tiles[0]}")
        laid.notes += notes
        return laid


def _pins(me, part):
    """Whether a corner of each triangle is pinned."""
    pins = mesh.pinned(me.uv_layers.active)
    return pins[part.loops].any(axis=1) if len(pins) else np.zeros(len(part.loops), bool)


def _charts_with(pins, given, uv, cancel):
    """Whether each triangle is of a chart with a pinned corner. The library says what the charts are."""
    boxes = atlasfit.unwrap(
        given.vertices,
        given.faces,
        face_polygons=given.face_polygons,
        corner_uv=uv,
        keep_uvs=True,
        packer="boxes",
        cancel=cancel,
    )
    return np.isin(boxes.face_charts, boxes.face_charts[pins])


def _free_tiles(uv):
    """The UDIM tiles, counted from 1001, on which none of these triangles lies."""
    inside = uv + 1e-3 * (uv.mean(axis=1, keepdims=True) - uv)  # a border belongs to no tile
    low, high = np.floor(inside.min(axis=1)).astype(int), np.floor(inside.max(axis=1)).astype(int)
    free = np.ones((TILES // UDIM_ROW, UDIM_ROW), bool)
    boxes = np.clip(np.unique(np.concatenate([low, high], axis=1), axis=0), 0, None)
    for u0, v0, u1, v1 in boxes:
        free[v0 : v1 + 1, u0 : u1 + 1] = False
    return np.flatnonzero(free)


register, unregister = bpy.utils.register_classes_factory((UV_OT_atlasfit_pack,))
