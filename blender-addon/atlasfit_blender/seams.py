# SPDX-License-Identifier: GPL-3.0-or-later
"""Mark Seams: the edges where a UV map is cut become seams, to be edited and unwrapped again."""

import bpy
import numpy as np
from bpy.props import BoolProperty

from . import mesh
from .long import FAILURES, Refused


def mark(me, polygons, clear=True):
    """Marks those edges of the polygons as seams where the active UV map is cut; returns how many. `clear`:
    the others of their edges are seams no more.
    """
    cut, touched = _cuts(me, polygons)
    flags = mesh.get(me.edges, "use_seam", 1, np.bool_)
    flags[touched] = cut[touched] if clear else cut[touched] | flags[touched]
    mesh.put(me.edges, "use_seam", flags)
    me.update()
    return int(cut.sum())


def _cuts(me, polygons):
    """For each edge whether two of the polygons meet there with different UVs, and whether one has it."""
    uv, vertex = mesh.uv_get(me.uv_layers.active), mesh.get(me.loops, "vertex_index", 1, np.int32)
    start = mesh.get(me.polygons, "loop_start", 1, np.int32)[polygons]
    total = mesh.get(me.polygons, "loop_total", 1, np.int32)[polygons]
    first = np.repeat(start, total)
    loop = first + np.arange(total.sum()) - np.repeat(np.cumsum(total) - total, total)
    last = loop == first + np.repeat(total, total) - 1
    beyond = np.where(last, first, loop + 1)
    # Both faces of an edge name its ends in one order.
    turned = vertex[loop] > vertex[beyond]
    ends = np.concatenate(
        [uv[np.where(turned, beyond, loop)], uv[np.where(turned, loop, beyond)]], axis=1
    )
    edge = mesh.get(me.loops, "edge_index", 1, np.int32)[loop]
    order = np.argsort(edge, kind="stable")
    edge, ends = edge[order], ends[order]
    at = np.flatnonzero(np.r_[True, edge[1:] != edge[:-1]])
    differ = (np.minimum.reduceat(ends, at) != np.maximum.reduceat(ends, at)).any(axis=1)
    cut, touched = np.zeros(len(me.edges), bool), np.zeros(len(me.edges), bool)
    cut[edge[at]], touched[edge[at]] = differ, True
    return cut, touched


class UV_OT_atlasfit_mark_seams(bpy.types.Operator):
    """Marks seams where UVs are cut."""

    bl_idname = "uv.atlasfit_mark_seams"
    bl_label = "Mark Seams"
    bl_description = (
        "Mark the edges where the active UV map is cut as seams: of the selected faces in Edit mode. Edit "
        "them, then Atlas Unwrap cuts there"
    )
    bl_options = {"REGISTER", "UNDO"}

    clear: BoolProperty(
        name="Clear Others", description="Edges where the UV map is not cut are seams no more", default=True
    )

    @classmethod
    def poll(cls, context):
        return mesh.poll(context)

    def execute(self, context):
        """Marks them at once."""
        try:
            obs, count = mesh.objects(context), 0
            only_selected = context.mode == "EDIT_MESH"
            with mesh.object_mode(context, obs):
                for ob in obs:
                    if not ob.data.uv_layers:
                        raise Refused(f"{ob.name} has no UV map. Run Atlas Unwrap first")
                for ob in obs:
                    wanted = mesh.selected(ob.data) if only_selected else np.ones(len(ob.data.polygons), bool)
                    if wanted.any():
                        count += mark(ob.data, np.flatnonzero(wanted), self.clear)
        except FAILURES as failure:
            self.report({"ERROR"}, f"{self.bl_label}: {failure}")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{count} edges are seams")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((UV_OT_atlasfit_mark_seams,))
