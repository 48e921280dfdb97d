# SPDX-License-Identifier: GPL-3.0-or-later
"""Atlas Unwrap: UVs for the selected faces or objects."""

from functools import partial

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from . import bake, copies, mesh, seams
from .layout import LAID_OUT, Layout, laid_out
from .long import Refused, within

UV_MAP_LIMIT = 8
PAINTED = 0.1  # what a seam costs where the seam group has weight 1


class UV_OT_atlasfit_unwrap(Layout, bpy.types.Operator):
    """Lay out UVs in charts of low stretch that neither flip nor overlap, and pack them.
    Seams are kept; pins are not: pinned UVs are laid out anew"""

    bl_idname = "uv.atlasfit_unwrap"
    bl_label = "Atlas Unwrap"

    preset: EnumProperty(
        name="Preset",
        description="What matters most. It stands for a bound on the stretch",
        items=(
            ("few-seams", "Few Seams", "Few charts and short seams, also for meshes of few faces"),
            ("balanced", "Balanced", "Between both"),
            ("low-stretch", "Low Stretch", "Lengths are kept best; most charts"),
        ),
        default="balanced",
    )
    max_stretch: FloatProperty(
        name="Max Stretch",
        description=(
            "Bound on the stretch of 95% of the surface: 1.1 is ten percent. Smaller gives more charts. 0 is"
            " that of the preset"
        ),
        default=0.0,
        min=0.0,
        soft_max=3.0,
        max=8.0,
    )
    max_charts: IntProperty(
        name="Max Charts",
        description="Most charts; the stretch grows as far as that needs. 0 is any number",
        default=0,
        min=0,
    )
    stack: EnumProperty(
        name="Stack",
        description="Parts of one shape that share their place in the UV map, corner on corner",
        items=(
            ("none", "None", "Each part has a place of its own"),
            ("identical", "Identical", "Parts that are moved and turned copies of each other"),
            ("mirrored", "Mirrored", "These and mirror images, whose UVs run the other way round"),
        ),
        default="none",
    )
    seams_hidden: FloatProperty(
        name="Hide Seams",
        description=(
            "How much seams go where they are hardly seen: between limbs, in folds, below. 0 is as short as"
            " can be"
        ),
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    seen_from_below: BoolProperty(
        name="Seen from Below",
        description="Hide Seams does not take them for hidden below, seen along the scene's Z",
        default=False,
    )
    seam_group: StringProperty(
        name="Seam Group",
        description=(
            "Vertex group that is painted where seams may be: at weight 1 they cost a tenth of what they"
            " cost elsewhere"
        ),
    )
    straighten: BoolProperty(
        name="Straighten",
        description=(
            "Strips, tubes, rims and long straight sides are laid along the sides of the UV map, as far as the"
            " bound on the stretch allows it"
        ),
        default=False,
    )
    seams: BoolProperty(name="Seams", description="Edges that are marked as seams are cut", default=True)
    sharp: BoolProperty(
        name="Sharp Edges", description="Edges that are marked as sharp are cut", default=True
    )
    materials: BoolProperty(name="Materials", description="No chart spans two materials", default=False)
    keep_uv_seams: BoolProperty(
        name="UV Seams", description="Where the active UV map is cut, the new one is cut", default=False
    )
    mark_seams: BoolProperty(
        name="Mark Seams",
        description="Edges where the new UV map is cut are marked as seams, to be edited and unwrapped again",
        default=False,
    )
    target: EnumProperty(
        name="UV Map",
        items=(
            ("ACTIVE", "Active", "Write to the active UV map"),
            ("NEW", "New", "Write to a new UV map and make it active"),
        ),
        default="ACTIVE",
    )
    name: StringProperty(name="Name", description="Name of a new UV map", default="Atlas")
    bake: BoolProperty(
        name="Bake Colors",
        description=(
            "Bake the active color attribute to an image, in a new material where the object has none"
        ),
        default=False,
    )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("preset", "max_stretch", "max_charts", "margin", "texture_size", "density", "pages"):
            layout.prop(self, name)
        column = layout.column(heading="Cut")
        for name in ("seams", "sharp", "materials", "keep_uv_seams"):
            column.prop(self, name)
        layout.prop(self, "seams_hidden")
        if self.seams_hidden > 0:
            layout.prop(self, "seen_from_below")
        layout.prop(self, "seam_group")
        layout.prop(self, "mark_seams")
        layout.prop(self, "straighten")
        layout.prop(self, "stack")
        layout.prop(self, "together")
        if context.mode == "EDIT_MESH" and self.target == "ACTIVE":
            layout.prop(self, "keep_clear")
        layout.prop(self, "target")
        if self.target == "NEW":
            layout.prop(self, "name")
        else:
            layout.prop(self, "textures")
        layout.prop(self, "bake")

    def library_options(self):
        """Of the library, besides those of the page."""
        return {
            "preset": self.preset,
            "max_stretch": self.max_stretch or None,
            "max_charts": self.max_charts,
            "stack": self.stack,
            "straighten": "auto" if self.straighten else "off",
            "seams_hidden": self.seams_hidden,
            "up": None if self.seen_from_below else (0, 0, 1),
        }

    def read(self, given):
        """How a group is unwrapped, its colours and old textures."""
        obs = mesh.meshes_of(given.parts)
        flagged = [
            mesh.edges(obs, given.parts, name)
            for name, wanted in (("use_seam", self.seams), ("use_edge_sharp", self.sharp))
            if wanted
        ]
        constraints = {"seam_edges": np.concatenate(flagged) if flagged else None}
        if self.materials:
            slots = max(len(ob.material_slots) for ob in obs) + 1
            constraints["face_groups"] = np.concatenate(
                [
                    mesh.get(ob.data.polygons, "material_index", 1, np.int32)[part.polygons] + slots * i
                    for i, (ob, part) in enumerate(zip(obs, given.parts))
                ]
            )
        if self.keep_uv_seams:
            constraints["corner_uv"] = mesh.corner_uvs(obs, given.parts, "whose seams could be kept")
        if self.seam_group:
            constraints["seam_price"] = 1 - (1 - PAINTED) * mesh.weights(obs, given.parts, self.seam_group)
        colors = None
        stacked = self.stack != "none"
        if self.bake and stacked:
            raise Refused("parts that are stacked share their pixels: turn Bake Colors off, or Stack")
        if self.bake:
            colors = np.concatenate(
                [bake.corner_colors(ob.data, part.loops) for ob, part in zip(obs, given.parts)]
            )
        kept = self.target == "ACTIVE" and not self.bake
        obstacle = "parts that are stacked share their pixels" if stacked else None
        unwrap = partial(copies.unwrap, first=copies.firsts(obs, given, constraints), **constraints)
        return given, unwrap, colors, self.old_textures(obs, given, obstacle) if kept else None

    @staticmethod
    def lay_out(given, unwrap, colors, old, options, progress, cancel):
        """The work on one group."""
        if colors is not None:
            options = options | {"pages": 1}  # one image
        laid = laid_out(given, unwrap, options, old, progress, cancel, painted=colors is not None)
        if colors is not None:
            how = {"progress": within(progress, LAID_OUT, 1.0), "cancel": cancel}
            laid.image = bake.image(colors, laid.uv.corner_uv, page_size=options["page_size"], **how)
        return laid

    def keeps_others(self):
        """Whether the other faces keep their UVs: a new UV map has none of theirs."""
        return self.target == "ACTIVE"

    def check_room(self, obs):
        """Refuses where a UV map is asked for and there is no room for it."""
        for me in {ob.data for ob in obs}:
            if (self.target == "NEW" or not me.uv_layers) and len(me.uv_layers) >= UV_MAP_LIMIT:
                raise Refused(
                    f"{me.name} has {UV_MAP_LIMIT} UV maps, which is Blender's limit. Remove one, or write to"
                    " the active one"
                )

    def layer(self, me):
        """The UV map to write to: the active one, or a new one."""
        layer = me.uv_layers.active
        if layer is not None and self.target != "NEW":
            return layer
        layer = me.uv_layers.new(name=self.name if self.target == "NEW" else "UVMap")
        me.uv_layers.active = layer
        return me.uv_layers[layer.name]  # creating one may move the others

    def wrote(self, part, me):
        """Marks the seams, if asked."""
        if self.mark_seams:
            seams.mark(me, np.unique(part.polygons))

    def _notes(self, info):
        out = super()._notes(info)
        if info.over_stretched > 0.06:  # the bound is on 95% of the area
            out.append(
                f"{100 * info.over_stretched:.0f}% of the surface is stretched beyond"
                f" {info.stretch_bound:.2f}"
            )
        return out

    def figures(self, info):
        """The bound that was kept, and what was asked for and found."""
        counts = {"stacked_parts": info.stacked_parts, "straightened_charts": info.straightened_charts}
        return {"stretch_bound": f"{info.stretch_bound:.3f}", **{k: n for k, n in counts.items() if n}}


register, unregister = bpy.utils.register_classes_factory((UV_OT_atlasfit_unwrap,))
