# SPDX-License-Identifier: GPL-3.0-or-later
"""Import Scan: points with colours and columns, and meshes, from every format that the library reads."""

import os

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty

from . import bake, mesh
from .long import LongOperator, Refused, within
from .native import atlasfit

EXTENSIONS = (
    "e57",
    "las",
    "laz",
    "pcd",
    "ply",
    "xyz",
    "pts",
    "asc",
    "txt",
    "csv",
    "obj",
    "off",
    "stl",
    "glb",
    "gltf",
)
Y_UP = (".obj", ".glb", ".gltf")  # the axis that is up in these, as Blender's own importers take it
# Blender's numbers have 24 bits: so many times its own size away from the origin a scan loses digits that one
# can see.
FAR = 100.0


class IMPORT_OT_atlasfit_scan(LongOperator, bpy.types.Operator):
    """Reads scans."""

    bl_idname = "import_mesh.atlasfit_scan"
    bl_label = "Import Scan"
    bl_description = (
        "Read scans, with the colors and columns of their points: E57, LAS, LAZ, PCD, PLY, XYZ and other "
        "columns of numbers; also meshes"
    )

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})
    filter_glob: StringProperty(default=";".join(f"*.{e}" for e in EXTENSIONS), options={"HIDDEN"})
    to_origin: BoolProperty(
        name="Move to Origin",
        description=(
            "Scans in survey coordinates are moved to the origin, where Blender's numbers are fine enough; "
            "the mesh keeps the way as its property atlasfit_origin"
        ),
        default=True,
    )

    up: EnumProperty(
        name="Up",
        description="The axis of the file that is up; Z is in Blender",
        items=(
            ("AUTO", "By Format", "Y in OBJ and glTF files, Z in all others, as in Blender's own importers"),
            ("Y", "Y", "The file's Y is up: the scan is turned"),
            ("Z", "Z", "The file's Z is up: coordinates stay as they are"),
        ),
        default="AUTO",
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop(self, "up")
        self.layout.prop(self, "to_origin")

    def invoke(self, context, event):
        """Asks for the files, unless they are named."""
        if self.filepath or self.files:
            return super().invoke(context, event)
        self._browsed = True
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """What the file browser calls; scripts too."""
        if getattr(self, "_browsed", False):
            self._browsed = False  # redo comes here again
            return super().invoke(context, None)
        return super().execute(context)

    def prepare(self, context):
        """Names the files; the work reads them."""
        paths = [os.path.join(self.directory, file.name) for file in self.files if file.name]
        paths = [bpy.path.abspath(path) for path in paths or [self.filepath] if path]
        if not paths:
            raise Refused("no file is named")
        up = self.up

        def work(progress, cancel):
            out = []
            for i, path in enumerate(paths):
                how = {"progress": within(progress, i / len(paths), (i + 1) / len(paths)), "cancel": cancel}
                name, end = os.path.splitext(os.path.basename(path))
                y_up = up == "Y" or up == "AUTO" and end.lower() in Y_UP
                out.append((name, y_up, atlasfit.load(path, **how)))
            return out

        return work

    def finish(self, context, result):
        """An object for each file, side by side in the active collection."""
        notes = []
        for other in context.selected_objects:
            other.select_set(False)
        for name, y_up, found in result:
            me, said = _mesh(name, found, y_up, self.to_origin)
            notes += [f"{name}: {note}" for note in said] if len(result) > 1 else said
            ob = bpy.data.objects.new(name, me)
            context.collection.objects.link(ob)
            ob.select_set(True)
            context.view_layer.objects.active = ob
        mesh.show_result(context, colors=any(found.colors is not None for *_, found in result))
        points = sum(len(found.points) for *_, found in result)
        faces = sum(len(found.triangles) for *_, found in result)
        text = f"{points} points" + (f", {faces} triangles" if faces else "")
        self.report({"WARNING"} if notes else {"INFO"}, "; ".join([text, *notes]))


def _turned(vectors, y_up):
    """Vectors of a file as Blender has them: its Y becomes Z, by a turn about X."""
    return vectors[..., [0, 2, 1]] * np.array([1, -1, 1], vectors.dtype) if y_up else vectors


def _mesh(name, found, y_up, to_origin):
    """A mesh of what a file holds, and what to tell."""
    notes, points = list(found.notes), _turned(found.points, y_up)
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        raise Refused(f"{name} has no point with a finite position")
    low, high = points[finite].min(axis=0), points[finite].max(axis=0)
    origin = np.zeros(3)
    if to_origin and np.abs(low + high).max() / 2 > FAR * max((high - low).max(), 1e-30):
        origin = np.round((low + high) / 2)
        notes.append("moved by {:g}, {:g}, {:g} to the origin".format(*-origin))
    me = mesh.new_mesh(name, points - origin, found.triangles)
    if origin.any():
        me["atlasfit_origin"] = origin.tolist()
    if found.viewpoint is not None:
        me[mesh.VIEWPOINT] = (_turned(found.viewpoint, y_up) - origin).tolist()
    if found.corner_uv is not None:
        layer = me.uv_layers.new(name="UVMap")
        mesh.uv_put(me.uv_layers[layer.name], found.corner_uv)
    if found.colors is not None:
        mesh.add_attribute(me, "Color", "BYTE_COLOR", bake.linear(found.colors))
        me.color_attributes.active_color = me.color_attributes["Color"]
    if found.normals is not None and not len(found.triangles):
        mesh.add_attribute(me, mesh.NORMAL, "FLOAT_VECTOR", _turned(found.normals, y_up))
    left = []
    for column, values in found.attributes.items():
        kind = _kind(values)
        if kind is None:
            left.append(column)
        else:
            mesh.add_attribute(me, column, kind, values)
    if left:
        notes.append(f"columns that Blender has no place for: {', '.join(left)}")
    return me, notes


def _kind(values):
    """The kind of attribute that holds a column; None where there is none."""
    width = 1 if values.ndim == 1 else values.shape[1]
    if values.dtype.kind == "f":
        return {1: "FLOAT", 2: "FLOAT2", 3: "FLOAT_VECTOR"}.get(width)
    fits = not values.size or values.max() <= np.iinfo(np.int32).max
    return "INT" if width == 1 and fits else None


def _entry(menu, context):
    menu.layout.operator(IMPORT_OT_atlasfit_scan.bl_idname, text="Scan (.e57, .las, .laz, .pcd, .ply, .xyz)")


_register, _unregister = bpy.utils.register_classes_factory((IMPORT_OT_atlasfit_scan,))


def register():
    _register()
    bpy.types.TOPBAR_MT_file_import.append(_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(_entry)
    _unregister()
