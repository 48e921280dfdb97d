# SPDX-License-Identifier: GPL-3.0-or-later
"""Scan operators: Denoise Scan (the points, moved) and Reconstruct (one new surface)."""

from itertools import zip_longest

import bmesh
import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from . import bake, fit, mesh
from .long import Refused, within
from .native import atlasfit

FITTED = 0.9  # share of the progress that fitting takes where colours are baked after it


class OBJECT_OT_atlasfit_denoise(fit.Fit, bpy.types.Operator):
    """Denoises points where they are."""

    bl_idname = "object.atlasfit_denoise"
    bl_label = "Denoise Scan"
    bl_description = (
        "Move the points of a scan, or the vertices of a scanned mesh, onto a smooth surface that is fitted "
        "to them. In Edit mode the selected vertices are moved in place"
    )

    result: EnumProperty(
        name="Result",
        items=(
            ("OBJECT", "New Object", "A copy of the object is moved"),
            ("SHAPE", "Shape Key", "The mesh gets a shape key, so that the movement can be blended"),
            ("PLACE", "In Place", "The mesh itself is moved"),
        ),
        default="OBJECT",
    )
    hide: BoolProperty(
        name="Hide Scan", description="Hide the scan where the result is a new object", default=True
    )
    drop: BoolProperty(
        name="Delete Outliers",
        description=(
            "Points that lie on no surface are deleted, else they stay where they are, or with faces follow"
            " the surface between their neighbours"
        ),
        default=False,
    )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in (
            "result",
            "hide",
            "drop",
            "strength",
            "noise",
            "charts",
            "prior",
            "uncertainty",
            "sweeps",
        ):
            layout.prop(self, name)

    def prepare(self, context):
        """Reads the vertices; the work fits and projects them."""
        ob = fit.active(context)
        self._edit = context.mode == "EDIT_MESH"
        with mesh.object_mode(context, [ob]):
            points, normals, triangles, columns = self._read(ob)
        options = self.fit_options() | {"viewpoint": fit.viewpoint_of(ob.data, mesh.linear(ob))}
        return lambda progress, cancel: atlasfit.denoise(
            points,
            normals=normals,
            attributes=columns,
            triangles=triangles,
            uv=False,
            **options,
            progress=progress,
            cancel=cancel,
        )

    def _read(self, ob):
        me = ob.data
        chosen = (
            np.flatnonzero(mesh.get(me.vertices, "select", 1, np.bool_))
            if self._edit
            else np.arange(mesh.count(me))
        )
        if len(chosen) == 0:
            raise Refused("no vertex is selected" if self._edit else "the mesh has no vertices")
        if self.drop and self.result == "SHAPE":
            raise Refused("a shape key keeps all points: turn Delete Outliers off, or choose another result")
        if mesh.is_cloud(me) and (self.drop or self.result == "SHAPE"):
            what = "a point cloud object has no shape keys, and its points cannot be deleted"
            raise Refused(f"{what}: choose another result, or convert it to a mesh first (Object, Convert)")
        matrix = mesh.linear(ob)
        points = mesh.positions(me)[chosen] @ matrix.T
        normals = fit.normals_of(me, matrix)
        normals = None if normals is None else normals[chosen]
        self._source = (ob.name, mesh.count(me), chosen, matrix)
        # Outliers that are deleted follow nothing.
        triangles = None if self.drop or mesh.is_cloud(me) else self._triangles(me, chosen)
        columns = {self.sweeps: fit.sweeps_of(me, self.sweeps)[chosen]} if self.sweeps else {}
        return points, normals, triangles, columns

    @staticmethod
    def _triangles(me, chosen):
        """The triangles between the chosen vertices, by their places among them."""
        place = np.full(len(me.vertices), -1, np.int32)
        place[chosen] = np.arange(len(chosen), dtype=np.int32)
        all_three = place[mesh.triangle_vertices(me)]
        return all_three[(all_three >= 0).all(axis=1)]

    def finish(self, context, result):
        """Moves the vertices of the object or of a copy."""
        name, count, chosen, matrix = self._source
        ob = bpy.data.objects.get(name)
        if ob is None or mesh.count(ob.data) != count:
            raise Refused(f"the object {name} was changed meanwhile. Run it again")
        with mesh.object_mode(context, [ob]):
            if self.result == "OBJECT" and not self._edit:
                ob = self._copy(context, ob, self.hide)
            me = ob.data
            old = mesh.positions(me)
            new = old.copy()
            new[chosen] = result.points @ np.linalg.inv(matrix).T
            if self.result == "SHAPE":
                if me.shape_keys is None:
                    ob.shape_key_add(name="Basis", from_mix=False)
                key = ob.shape_key_add(name="Denoised", from_mix=False)
                mesh.put(key.data, "co", new)
                key.value = 1.0
            else:
                mesh.put_positions(me, new)
                # Each shape is moved along: what it adds to the rest stays the same.
                shapes = getattr(me, "shape_keys", None)
                for key in shapes.key_blocks if shapes else ():
                    mesh.put(key.data, "co", mesh.get(key.data, "co", 3, np.float32) + (new - old))
            if not mesh.has_faces(me) and not self._edit:
                known = me.attributes.get(mesh.NORMAL)
                if known is not None:
                    me.attributes.remove(known)
                mesh.add_attribute(me, mesh.NORMAL, "FLOAT_VECTOR", fit.unit(result.normals @ matrix))
                mesh.add_attribute(me, "point_chart", "INT", result.charts.view(np.int32))
            for column, values in result.attributes.items():
                mesh.put_floats(me, column, chosen, values)
            outliers = chosen[result.charts == atlasfit.NO_CHART]
            if self.drop and len(outliers):
                self._delete(me, outliers)
            mesh.updated(me)
            notes = fit.notes_of(result.report)
            fit.keep_report(me, self.bl_label, result.report, self.seconds(), notes)
        moved = np.sqrt(np.mean(np.sum((np.asarray(new, np.float64) - old)[chosen] ** 2, axis=1)))
        text = (
            f"{len(chosen)} points moved by {moved:.3g} (RMS) in {self.seconds():.1f} s, noise"
            f" {result.report.noise:.3g}"
        )
        self.report({"WARNING"} if result.report.warnings else {"INFO"}, "; ".join([text, *notes]))

    @staticmethod
    def _copy(context, ob, hide):
        new = ob.copy()
        new.data = ob.data.copy()
        new.name = f"{ob.name} Denoised"
        mesh.put_beside(context, new, ob, hide)
        return new

    @staticmethod
    def _delete(me, vertices):
        editable = bmesh.new()
        editable.from_mesh(me)
        editable.verts.ensure_lookup_table()
        bmesh.ops.delete(editable, geom=[editable.verts[i] for i in vertices], context="VERTS")
        editable.to_mesh(me)
        editable.free()


class OBJECT_OT_atlasfit_reconstruct(fit.Fit, bpy.types.Operator):
    """Makes a surface of a scan."""

    bl_idname = "object.atlasfit_reconstruct"
    bl_label = "Reconstruct"
    bl_description = (
        "Make one connected surface from a scan, with UVs, colors and attributes, as a new object. "
        "Modifiers of the scan count"
    )

    detail: FloatProperty(
        name="Detail",
        description="Fineness of the surface: 1 is what the scan supports, 0.5 has voxels twice as large",
        default=1.0,
        min=0.1,
        max=10.0,
    )
    fill_holes: FloatProperty(
        name="Fill Holes",
        description=(
            "Holes with a boundary shorter than this are filled, as scaled in the scene. 0 fills only gaps of"
            " the sampling and places about which the points thin out"
        ),
        default=0.0,
        min=0.0,
    )
    min_part: FloatProperty(
        name="Smallest Part",
        description=(
            "Connected parts of the surface that have less than this share of its area are left out. "
            "0 keeps all"
        ),
        default=0.0,
        min=0.0,
        max=1.0,
    )
    largest: BoolProperty(
        name="Largest Part Only",
        description="Keep only the largest connected part of the surface, by area",
        default=False,
    )
    faces: IntProperty(
        name="Triangles",
        description="Triangles that the surface should have at the most. 0 is about as many as points",
        default=0,
        min=0,
    )
    max_error: FloatProperty(
        name="Largest Error",
        description=(
            "How far the surface may move to have fewer triangles, as scaled in the scene. 0 keeps all that"
            " it is made with; -1 is as far as Triangles asks for, without that a quarter of the noise or a"
            " twentieth of the spacing"
        ),
        default=-1.0,
        min=-1.0,
    )
    watertight: BoolProperty(
        name="Watertight",
        description=(
            "Close the surface to a solid for printing; the attribute extrapolated marks what was invented"
        ),
        default=False,
    )
    texture_size: IntProperty(
        name="Texture Size",
        description="Side of the texture in pixels. 0 is what the scan's points fill",
        default=0,
        min=0,
        max=65536,
    )
    bake: BoolProperty(
        name="Material",
        description=(
            "Bake the scan's colors to an image and a material; without colors the material shows a checker"
        ),
        default=True,
    )
    hide: BoolProperty(
        name="Hide Scan", description="Hide the scan, so that one sees the surface", default=True
    )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in (
            "detail",
            "fill_holes",
            "min_part",
            "largest",
            "faces",
            "max_error",
            "watertight",
            "strength",
            "noise",
            "charts",
            "prior",
            "uncertainty",
            "sweeps",
            "texture_size",
            "bake",
            "hide",
        ):
            layout.prop(self, name)

    def prepare(self, context):
        """Reads the points as the modifiers leave them; the work fits, makes the surface, and bakes."""
        ob = fit.active(context)
        with mesh.object_mode(context, [ob]):
            points, normals, colors, columns = self._read(context, ob)
        size = self.texture_size or atlasfit.texture_side(len(points))
        paint = bake.srgb(colors) if self.bake and colors is not None else None
        options = self.fit_options() | {
            "detail": self.detail,
            "fill_holes": self.fill_holes,
            "min_part": self.min_part,
            "largest": self.largest,
            "faces": self.faces,
            "max_error": self.max_error,
            "watertight": self.watertight,
            "texture_size": size,
            "viewpoint": self._viewpoint,
        }

        def work(progress, cancel):
            fitted = 1.0 if paint is None else FITTED
            out = atlasfit.denoise(
                points,
                normals=normals,
                colors=colors,
                attributes=columns,
                **options,
                progress=within(progress, 0.0, fitted),
                cancel=cancel,
            )
            if paint is None:
                return out, None
            s = out.surface
            return out, atlasfit.bake(
                s.vertices,
                s.triangles,
                s.corner_uv,
                paint,
                points=out.points,
                page_size=size,
                progress=within(progress, fitted, 1.0),
                cancel=cancel,
            )

        return work

    def _read(self, context, ob):
        matrix = mesh.linear(ob)
        self._source = (ob.name, matrix)
        evaluated = ob.evaluated_get(context.evaluated_depsgraph_get())
        made = evaluated.to_mesh() if ob.type == "MESH" else None
        me = evaluated.data if made is None else made
        try:
            if not mesh.count(me):
                raise Refused("the mesh has no vertices")
            if self.sweeps:
                fit.sweeps_of(me, self.sweeps)
            columns, self._left = mesh.attributes(me)
            colors, self._color = mesh.point_colors(me)
            columns.pop(self._color, None)
            if not mesh.has_faces(me):
                columns.pop(mesh.NORMAL, None)  # the surface has its own
            self._kinds = [me.attributes[name].data_type for name in columns]
            self._viewpoint = fit.viewpoint_of(ob.data, matrix)
            return mesh.positions(me) @ matrix.T, fit.normals_of(me, matrix), colors, columns
        finally:
            if made is not None:
                evaluated.to_mesh_clear()

    def finish(self, context, result):
        """The new object."""
        out, texels = result
        name, matrix = self._source
        source = bpy.data.objects.get(name)
        if source is None:
            raise Refused(f"the object {name} is gone")
        surface = out.surface
        if context.mode == "EDIT_MESH":
            bpy.ops.object.mode_set(mode="OBJECT")
        me = mesh.new_mesh(
            f"{source.data.name} Surface", surface.vertices @ np.linalg.inv(matrix).T, surface.triangles
        )
        if surface.corner_normals is not None:
            mesh.mark_creases(me, surface.triangles, surface.corner_normals)
        layer = me.uv_layers.new(name="UVMap")
        mesh.uv_put(me.uv_layers[layer.name], surface.corner_uv)
        if surface.colors is not None:
            mesh.add_attribute(me, self._color, "FLOAT_COLOR", surface.colors)
            me.color_attributes.active_color = me.color_attributes[self._color]
        # What was found comes after what the scan has.
        columns = zip_longest(surface.attributes.items(), self._kinds, fillvalue="FLOAT")
        for (column, values), kind in columns:
            mesh.add_attribute(me, column, kind, values)
        ob = bpy.data.objects.new(f"{source.name} Surface", me)
        ob.matrix_world = source.matrix_world
        mesh.put_beside(context, ob, source, self.hide)
        notes = fit.notes_of(out.report)
        if self._left:
            notes.append(f"attributes of kinds that cannot be carried: {', '.join(self._left)}")
        if source.vertex_groups:
            notes.append("vertex groups are not carried")
        if texels is not None:
            notes += bake.write(texels, [ob])
        elif self.bake:
            bake.checker(ob)
        mesh.show_result(context, surface.colors is not None, self.bake)
        fit.keep_report(me, self.bl_label, out.report, self.seconds(), notes)
        text = (
            f"{len(surface.triangles)} triangles, {out.report.parts} parts, {out.report.boundary_loops} holes"
            f" in {self.seconds():.1f} s"
        )
        self.report({"WARNING"} if out.report.warnings else {"INFO"}, "; ".join([text, *notes]))


register, unregister = bpy.utils.register_classes_factory(
    (OBJECT_OT_atlasfit_denoise, OBJECT_OT_atlasfit_reconstruct)
)
