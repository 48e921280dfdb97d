# SPDX-License-Identifier: GPL-3.0-or-later
"""Menu entries and the sidebar panel, which also shows the report of the active mesh."""

import inspect

import bpy

from . import mesh
from .files import IMPORT_OT_atlasfit_scan
from .long import Status
from .pack import UV_OT_atlasfit_pack
from .scan import OBJECT_OT_atlasfit_denoise, OBJECT_OT_atlasfit_reconstruct
from .seams import UV_OT_atlasfit_mark_seams
from .stretch import UV_OT_atlasfit_stretch
from .uv import UV_OT_atlasfit_unwrap

UV_OPERATORS = (UV_OT_atlasfit_unwrap, UV_OT_atlasfit_mark_seams, UV_OT_atlasfit_pack, UV_OT_atlasfit_stretch)
SCAN_OPERATORS = (OBJECT_OT_atlasfit_denoise, OBJECT_OT_atlasfit_reconstruct)


def _entries(operators):
    def draw(menu, context):
        menu.layout.separator()
        menu.layout.operator_context = "INVOKE_DEFAULT"  # else a menu may call execute() and block the window
        for operator in operators:
            menu.layout.operator(operator.bl_idname)

    return draw


_uv_entries = _entries(UV_OPERATORS)
_object_entries = _entries(UV_OPERATORS + SCAN_OPERATORS)  # Object mode has no UV menu
_edit_entries = _entries(SCAN_OPERATORS[:1])


def _menus():
    yield "IMAGE_MT_uvs_unwrap", _uv_entries  # the UV editor's; from 4.5 the 3D view's UV menu embeds it
    if "IMAGE_MT_uvs_unwrap" not in inspect.getsource(bpy.types.VIEW3D_MT_uv_map.draw):
        yield "VIEW3D_MT_uv_map", _uv_entries
    yield "VIEW3D_MT_object", _object_entries
    yield "VIEW3D_MT_edit_mesh", _edit_entries


class _Panel:
    bl_label = "Atlasfit"
    bl_region_type = "UI"
    bl_category = "Atlasfit"
    operators = ()

    def draw(self, context):
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        if Status.label:
            column = layout.column(align=True)
            column.label(text=f"{Status.label}: Esc cancels")
            text = f"{Status.stage} {100 * Status.share:.0f} %{Status.left}"
            if hasattr(column, "progress"):  # 4.0 and later
                column.progress(factor=Status.share, text=text)
            else:
                column.label(text=text)
        column = layout.column(align=True)
        for operator in self.operators:
            column.operator(operator.bl_idname)
        ob = context.view_layer.objects.active
        report = ob.data.get(mesh.REPORT) if mesh.is_scan(ob) else None
        if report is None:
            return
        box = layout.box()
        box.label(text=report["title"], icon="INFO")
        rows = box.column(align=True)
        for key, value in report.items():
            if key == "notes":
                for note in value.split("; "):
                    rows.label(text=note)
            elif key != "title":
                split = rows.split(factor=0.6)
                split.label(text=key.capitalize())
                split.label(text=value)


class VIEW3D_PT_atlasfit(_Panel, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    operators = (IMPORT_OT_atlasfit_scan, *UV_OPERATORS, *SCAN_OPERATORS)


class IMAGE_PT_atlasfit(_Panel, bpy.types.Panel):
    bl_space_type = "IMAGE_EDITOR"
    operators = UV_OPERATORS


_register, _unregister = bpy.utils.register_classes_factory((VIEW3D_PT_atlasfit, IMAGE_PT_atlasfit))


def register():
    _register()
    for name, draw in _menus():
        getattr(bpy.types, name).append(draw)


def unregister():
    for name, draw in _menus():
        getattr(bpy.types, name).remove(draw)
    _unregister()
