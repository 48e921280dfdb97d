# SPDX-License-Identifier: GPL-3.0-or-later
"""UV Stretch: a colour for how far each face is stretched."""

import bpy
import numpy as np
from bpy.props import FloatProperty

from . import mesh
from .long import LongOperator, Refused, within
from .native import atlasfit


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


register, unregister = bpy.utils.register_classes_factory((UV_OT_atlasfit_stretch,))
