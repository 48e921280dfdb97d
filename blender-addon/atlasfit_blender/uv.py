# SPDX-License-Identifier: GPL-3.0-or-later
"""UV operators: Atlas Unwrap (UVs for the selected faces or objects) and UV Stretch (a colour for how far
each face is stretched).
"""

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from . import bake, mesh, textures
from .long import LongOperator, Refused, within
from .native import atlasfit

UV_MAP_LIMIT = 8
UDIM_ROW = 10
LAID_OUT = 0.8  # share of a job's progress that its layout takes where colours are baked after it


class UV_OT_atlasfit_unwrap(LongOperator, bpy.types.Operator):
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
    margin: IntProperty(
        name="Margin", description="Free pixels between charts", default=2, min=0, soft_max=64
    )
    texture_size: bake.TEXTURE_SIZE
    density: FloatProperty(
        name="Density",
        description=(
            "Pixels per unit of length, as scaled in the scene. 0 fills the texture; more than fits goes on"
            " to further UDIM tiles"
        ),
        default=0.0,
        min=0.0,
    )
    pages: IntProperty(
        name="Tiles",
        description="Most UDIM tiles. 0 is one, or with a density as many as it needs; baking makes one",
        default=0,
        min=0,
        max=100,
    )
    seams: BoolProperty(name="Seams", description="Edges that are marked as seams are cut", default=True)
    sharp: BoolProperty(
        name="Sharp Edges", description="Edges that are marked as sharp are cut", default=True
    )
    materials: BoolProperty(name="Materials", description="No chart spans two materials", default=False)
    keep_uv_seams: BoolProperty(
        name="UV Seams", description="Where the active UV map is cut, the new one is cut", default=False
    )
    together: BoolProperty(
        name="One Texture",
        description="Several objects are packed on one texture, else on one each",
        default=True,
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
    textures: BoolProperty(
        name="Keep Textures",
        description=(
            "Images that the materials show through the UV map are drawn anew for the new UVs, at no lower"
            " density"
        ),
        default=True,
    )
    bake: BoolProperty(
        name="Bake Colors",
        description=(
            "Bake the active color attribute to an image, in a new material where the object has none"
        ),
        default=False,
    )

    @classmethod
    def poll(cls, context):
        return mesh.poll(context)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("preset", "max_stretch", "max_charts", "margin", "texture_size", "density", "pages"):
            layout.prop(self, name)
        column = layout.column(heading="Cut")
        for name in ("seams", "sharp", "materials", "keep_uv_seams"):
            column.prop(self, name)
        layout.prop(self, "together")
        layout.prop(self, "target")
        if self.target == "NEW":
            layout.prop(self, "name")
        else:
            layout.prop(self, "textures")
        layout.prop(self, "bake")

    def prepare(self, context):
        """Reads the meshes; the work lays out each group of them."""
        obs = mesh.objects(context)
        self._told = mesh.other_scales(context, obs)
        only_selected = context.mode == "EDIT_MESH"
        groups = [obs] if self.together else [[ob] for ob in obs]
        with mesh.object_mode(context, obs):
            jobs = [self._read(group, only_selected) for group in groups]
        options = {
            "preset": self.preset,
            "max_stretch": self.max_stretch or None,
            "max_charts": self.max_charts,
            "page_size": self.texture_size,
            "padding": self.margin,
            "pages": 1 if self.bake else self.pages,  # one image
            "texels_per_unit": self.density,
        }

        def work(progress, cancel):
            n = len(jobs)
            return [
                _lay_out(*job, options, progress=within(progress, i / n, (i + 1) / n), cancel=cancel)
                for i, job in enumerate(jobs)
            ]

        return work

    def _read(self, obs, only_selected):
        given = mesh.triangles(obs, only_selected)
        obs = mesh.meshes_of(given.parts)
        seams = [
            mesh.edges(obs, given.parts, name)
            for name, wanted in (("use_seam", self.seams), ("use_edge_sharp", self.sharp))
            if wanted
        ]
        constraints = {"seam_edges": np.concatenate(seams) if seams else None}
        if self.materials:
            slots = max(len(ob.material_slots) for ob in obs) + 1
            constraints["face_groups"] = np.concatenate(
                [
                    mesh.get(ob.data.polygons, "material_index", 1, np.int32)[part.polygons] + slots * i
                    for i, (ob, part) in enumerate(zip(obs, given.parts))
                ]
            )
        if self.keep_uv_seams:
            for ob in obs:
                if not ob.data.uv_layers:
                    raise Refused(f"{ob.name} has no UV map whose seams could be kept")
            constraints["corner_uv"] = np.concatenate(
                [mesh.uv_get(ob.data.uv_layers.active)[part.loops] for ob, part in zip(obs, given.parts)]
            )
        colors = None
        if self.bake:
            colors = np.concatenate(
                [bake.corner_colors(ob.data, part.loops) for ob, part in zip(obs, given.parts)]
            )
        old = None
        if self.target == "ACTIVE" and not self.bake:
            obstacle = None if self.textures else "Keep Textures is off"
            if any(len(part.loops) < len(ob.data.loop_triangles) for ob, part in zip(obs, given.parts)):
                obstacle = obstacle or "some of the faces that show it keep their UVs"
            old, said = textures.read(obs, given.parts, obstacle)
            self._told += said
        return given, constraints, colors, old

    def finish(self, context, result):
        """Writes the UVs, images and reports."""
        notes, charts, faces = list(self._told), 0, 0
        obs = [ob for given, *_ in result for ob in mesh.meshes_of(given.parts)]
        for ob in obs:
            self._check_room(ob.data)
        with mesh.object_mode(context, obs):
            for given, uv, image, old, drawn in result:
                charts, faces = charts + uv.info.charts, faces + uv.info.triangles
                tile = uv.face_pages[:, None] + np.zeros((1, 3), np.uint32)
                corner_uv = uv.corner_uv
                if uv.info.pages > 1:
                    shift = np.stack([tile % UDIM_ROW, tile // UDIM_ROW], -1)
                    corner_uv = corner_uv + shift.astype(np.float32)
                    notes.append(f"{uv.info.pages} UDIM tiles")
                notes += self._notes(uv.info)
                at = 0
                folded = pins = 0
                for part in given.parts:
                    mine = corner_uv[at : at + len(part.loops)]
                    at += len(part.loops)
                    me = bpy.data.objects[part.object].data
                    torn, moved = self._write(me, part, mine)
                    folded, pins = folded + torn, pins + moved
                written = [bpy.data.objects[part.object] for part in given.parts]
                if image is not None:
                    notes += bake.write(image, written)
                if old is not None:
                    notes += textures.write(old, drawn, written)
                if folded:
                    notes.append(
                        f"{folded} faces are too bent to lie flat in one piece and overlap in the UV map:"
                        " triangulate them"
                    )
                if pins:
                    notes.append(f"{pins} pinned UVs were laid out anew")
                for part in given.parts:
                    self._tell(bpy.data.objects[part.object].data, uv, notes)
        text = f"{charts} charts for {faces} triangles in {self.seconds():.1f} s"
        self.report({"WARNING"} if notes else {"INFO"}, "; ".join([text, *notes]))

    def _check_room(self, me):
        if (self.target == "NEW" or not me.uv_layers) and len(me.uv_layers) >= UV_MAP_LIMIT:
            raise Refused(
                f"{me.name} has {UV_MAP_LIMIT} UV maps, which is Blender's limit. Remove one, or write to the"
                " active one"
            )

    def _write(self, me, part, corner_uv):
        """Writes one mesh's UVs; returns how many polygons could not stay in one piece, and how many pins
        were moved.
        """
        layer = me.uv_layers.active
        if layer is None or self.target == "NEW":
            layer = me.uv_layers.new(name=self.name if self.target == "NEW" else "UVMap")
            me.uv_layers.active = layer
            layer = me.uv_layers[layer.name]  # creating one may move the others
        pins = mesh.pinned(layer)
        moved = int(pins[np.unique(part.loops)].sum()) if pins.any() else 0
        values = mesh.uv_get(layer)
        values[part.loops.ravel()] = corner_uv.reshape(-1, 2)
        torn = (values[part.loops] != corner_uv).any(axis=(1, 2))
        mesh.uv_put(layer, values)
        me.update()
        return len(np.unique(part.polygons[torn])), moved

    def _notes(self, info):
        out = []
        if self.density and info.texels_per_unit < 0.999 * self.density:
            out.append(f"the density is {info.texels_per_unit:.4g}: more does not fit the tiles")
        if info.degenerate_faces:
            out.append(f"{info.degenerate_faces} triangles have no area")
        if info.duplicate_faces:
            out.append(f"{info.duplicate_faces} triangles repeat another")
        if info.non_manifold_edges:
            out.append(f"{info.non_manifold_edges} edges are not manifold and were cut")
        if info.over_stretched > 0.06:  # the bound is on 95% of the area
            out.append(
                f"{100 * info.over_stretched:.0f}% of the surface is stretched beyond"
                f" {info.stretch_bound:.2f}"
            )
        return out + list(info.warnings)

    def _tell(self, me, uv, notes):
        mesh.set_report(
            me,
            self.bl_label,
            notes,
            charts=uv.info.charts,
            triangles=uv.info.triangles,
            stretch_bound=f"{uv.info.stretch_bound:.3f}",
            texture_filled=f"{100 * uv.info.coverage:.0f} %",
            pixels_per_unit=f"{uv.info.texels_per_unit:.4g}",
            seconds=f"{self.seconds():.2f}",
        )


def _lay_out(given, constraints, colors, old, options, progress, cancel):
    """The work on one group: what was given, UVs, baked colours, old textures, those drawn anew."""
    page, image, drawn = None, None, []
    if old is not None:
        page = old.page(given.vertices, given.faces, cancel=cancel)
        side, padding = max(options["page_size"], page.side), max(options["padding"], page.padding)
        options = options | {"page_size": side, "padding": padding, "pages": 1}
    laid_out = 1.0 if colors is None and old is None else LAID_OUT
    uv = atlasfit.unwrap(
        given.vertices,
        given.faces,
        face_polygons=given.face_polygons,
        **constraints,
        **options,
        progress=within(progress, 0.0, laid_out),
        cancel=cancel,
    )
    how = {"progress": within(progress, laid_out, 1.0), "cancel": cancel}
    if colors is not None:
        image = bake.image(colors, uv.corner_uv, page_size=options["page_size"], **how)
    if old is not None:
        drawn = old.draw(given.vertices, given.faces, uv, page, **how)
    return given, uv, image, old, drawn


class UV_OT_atlasfit_stretch(LongOperator, bpy.types.Operator):
    """Measures UVs and shows their stretch."""

    bl_idname = "uv.atlasfit_stretch"
    bl_label = "UV Stretch"
    bl_description = (
        "Measure the active UV map, and color each face by its stretch: blue is none, green a little, red is "
        "Full Scale or more"
    )
    full_scale: FloatProperty(
        name="Full Scale", description="The stretch that is shown in red", default=1.5, min=1.01, soft_max=8.0
    )

    @classmethod
    def poll(cls, context):
        return mesh.poll(context)

    def prepare(self, context):
        """Reads each mesh with its UVs; the work measures them."""
        jobs, obs = [], mesh.objects(context)
        with mesh.object_mode(context, obs):
            for ob in obs:
                given = mesh.triangles([ob], False)
                if not ob.data.uv_layers:
                    raise Refused(f"{ob.name} has no UV map. Run Atlas Unwrap first")
                jobs.append((given, mesh.uv_get(ob.data.uv_layers.active)[given.parts[0].loops]))

        def work(progress, cancel):
            out = []
            for i, (given, uv) in enumerate(jobs):
                how = {"progress": within(progress, i / len(jobs), (i + 1) / len(jobs)), "cancel": cancel}
                out.append((given, atlasfit.measure_uv(given.vertices, given.faces, uv, **how)))
            return out

        return work

    def finish(self, context, result):
        """Writes the colours and the reports."""
        obs = mesh.meshes_of([given.parts[0] for given, _ in result])
        with mesh.object_mode(context, obs):
            for ob, (given, quality) in zip(obs, result):
                me, part = ob.data, given.parts[0]
                colors = np.ones((len(me.loops), 4), np.float32)
                colors[part.loops.ravel()] = np.repeat(
                    _heat(quality.face_stretch, self.full_scale), 3, axis=0
                )
                own = mesh.own_colors(me)
                if own is not None:
                    me[mesh.COLOR] = own.name
                attribute = next((a for a in me.color_attributes if mesh.shows_stretch(a)), None)
                if attribute is None:
                    attribute = me.color_attributes.new(name=mesh.STRETCH, type="BYTE_COLOR", domain="CORNER")
                name = attribute.name
                mesh.put(me.color_attributes[name].data, "color", colors)
                me.color_attributes.active_color = me.color_attributes[name]
                me.update()
                mesh.set_report(
                    me,
                    self.bl_label,
                    charts=quality.charts,
                    flipped=quality.flips,
                    overlapping=quality.overlapping_faces,
                    collapsed=quality.degenerate,
                    seam_length=f"{quality.seam:.2f}",
                    stretch_L2=f"{quality.stretch_l2:.4f}",
                    stretch_of_95_percent=f"{quality.stretch_p95:.3f}",
                    texture_filled=f"{100 * quality.coverage:.0f} %",
                )
        space = context.space_data
        if space is not None and space.type == "VIEW_3D" and space.shading.type == "SOLID":
            space.shading.color_type = "VERTEX"
        worst = max(quality.stretch_p95 for _, quality in result)
        self.report({"INFO"}, f"95% of the surface is stretched by less than {worst:.3f}")


def _heat(stretch, full):
    """Blue, green, red (linear) for stretch 1 to `full` on a logarithmic scale."""
    with np.errstate(divide="ignore"):
        t = np.clip(np.log(np.maximum(stretch, 1.0)) / np.log(full), 0.0, 1.0)
    t = np.nan_to_num(t, nan=1.0)
    out = np.ones((len(t), 4), np.float32)
    out[:, 0], out[:, 2] = np.clip(2 * t - 1, 0, 1), np.clip(1 - 2 * t, 0, 1)
    out[:, 1] = 1 - np.abs(2 * t - 1)
    return out


register, unregister = bpy.utils.register_classes_factory((UV_OT_atlasfit_unwrap, UV_OT_atlasfit_stretch))
