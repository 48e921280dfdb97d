# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's meshes as numpy arrays, and back. Bulk copies only; no operator calls but for the mode."""

from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np

from .long import Refused

# Attribute types that the library carries: property, numbers per element, array type.
KINDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}
REPORT = "atlasfit_report"
NORMAL = "point_normal"  # the normals of points without faces
VIEWPOINT = "atlasfit_viewpoint"  # where the scanner stood, in the mesh's frame
STRETCH = "UV Stretch"  # the colours that show stretch: they are never taken for the mesh's own
COLOR = "atlasfit_color"  # the mesh's own active colours while those of stretch are active
# Blender 5 has all of a mesh's columns as attributes, which are copied ten times faster than properties of
# elements.
PLAIN = bpy.app.version >= (5, 0, 0)
EDGE_FLAGS = {"use_seam": "uv_seam", "use_edge_sharp": "sharp_edge"}


def get(collection, name, width, kind):
    """One property of all elements: (n, width), or (n,) for width 1."""
    out = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, out)
    return out.reshape(-1, width) if width > 1 else out


def put(collection, name, values):
    """The reverse of get()."""
    collection.foreach_set(name, np.ascontiguousarray(values).ravel())


def linear(ob):
    """The object's rotation and scale, (3, 3): lengths that are measured after it are what one sees. A
    mirroring one is mirrored back along x, so that the outside stays outside, and up stays up.
    """
    out = np.array(ob.matrix_world, np.float64)[:3, :3]
    if not np.isfinite(out).all() or np.linalg.cond(out) > 1e9:
        raise Refused(f"the object {ob.name} is scaled to nothing. Give it a scale that is not 0")
    return out * [[-1], [1], [1]] if np.linalg.det(out) < 0 else out


def objects(context):
    """The mesh objects to work on: those in Edit mode, or the selected ones with the active one; each mesh
    once.
    """
    if context.mode == "EDIT_MESH":
        found = list(context.objects_in_mode_unique_data)
    else:
        active = context.view_layer.objects.active
        found = [ob for ob in context.selected_objects if ob.type == "MESH"]
        if active is not None and active.type == "MESH" and active not in found:
            found.append(active)
    found = list({ob.data.name_full: ob for ob in found}.values())
    if not found:
        raise Refused("no mesh object is selected")
    for ob in found:
        if ob.data.library is not None:
            raise Refused(
                f"the mesh of {ob.name} is linked from another file and cannot be written. Make it local"
                " first"
            )
    return found


def other_scales(context, obs):
    """What to tell of selected objects that share a mesh with one of `obs` and are scaled otherwise: UVs of
    one mesh are laid out once.
    """
    notes = []
    for ob in obs:
        size = lambda other: np.sort(np.linalg.svd(linear(other), compute_uv=False))
        others = [o for o in context.selected_objects if o != ob and o.type == "MESH" and o.data == ob.data]
        unlike = [o.name for o in others if not np.allclose(size(o), size(ob), rtol=1e-3)]
        if unlike:
            notes.append(
                f"{', '.join(unlike)} share the mesh of {ob.name} and are scaled otherwise: measured as"
                f" {ob.name}"
            )
    return notes


def poll(context):
    """Whether there is a mesh to work on."""
    ob = context.view_layer.objects.active
    return context.mode in {"OBJECT", "EDIT_MESH"} and (
        any(o.type == "MESH" for o in context.selected_objects) or ob is not None and ob.type == "MESH"
    )


@contextmanager
def object_mode(context, obs):
    """Object mode for as long as meshes are read or written: in Edit mode their columns are elsewhere. The
    mode and the selection are as before afterwards.
    """
    was = context.mode
    if was != "EDIT_MESH":
        yield
        return
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        # Edit mode takes the selected objects in: those that it held and were not selected are selected for
        # the moment.
        added = [ob for ob in obs if not ob.select_get()]
        for ob in added:
            ob.select_set(True)
        bpy.ops.object.mode_set(mode="EDIT")
        for ob in added:
            ob.select_set(False)


@dataclass
class Part:
    """One object's share of the triangles that are handed over."""

    object: str
    mesh: str
    loops: np.ndarray  # the mesh's corner of each triangle corner, (m, 3)
    polygons: np.ndarray  # the mesh's polygon of each triangle, (m,)
    corner_count: int  # to see whether the mesh changed meanwhile


@dataclass
class Triangles:
    """Several meshes as one: what unwrap() takes."""

    vertices: np.ndarray
    faces: np.ndarray
    face_polygons: np.ndarray
    parts: list

    def some(self, wanted):
        """Those triangles only, of the same vertices."""
        parts, at = [], 0
        for part in self.parts:
            mine = wanted[at : at + len(part.loops)]
            at += len(part.loops)
            if mine.any():
                parts.append(replace(part, loops=part.loops[mine], polygons=part.polygons[mine]))
        return Triangles(self.vertices, self.faces[wanted], self.face_polygons[wanted], parts)


def triangles(obs, only_selected):
    """The objects' triangles in one array, scaled as one sees them, the objects beside each other: borders
    that meet would be taken for one surface. Refuses where there is none.
    """
    vertices, faces, polygons, parts = [], [], [], []
    n = p = 0
    end = None
    for ob in obs:
        me = ob.data
        if not me.polygons:
            continue
        verts = triangle_vertices(me)
        corners = get(me.loop_triangles, "loops", 3, np.int32)
        polygon = triangle_polygons(me)
        if only_selected:
            mine = selected(me)[polygon]
            corners, verts, polygon = corners[mine], verts[mine], polygon[mine]
        if len(verts) == 0:
            continue
        at, end = beside(end, positions(me) @ linear(ob).T)
        vertices.append(at)
        faces.append(verts + n if n else verts)
        polygons.append(polygon + p if p else polygon)
        parts.append(Part(ob.name, me.name, corners, polygon, len(me.loops)))
        n, p = n + len(me.vertices), p + len(me.polygons)
    if not parts:
        what = "no face is selected" if only_selected else "the mesh has no faces"
        raise Refused(f"{what}. Select faces, or use Reconstruct to make a surface from points")
    join = lambda arrays: arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
    return Triangles(join(vertices), join(faces), join(polygons), parts)


def beside(end, points):
    """Points moved along x beyond where the last ones end, and where these end; the first ones stay."""
    finite = points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        return points, end
    low, size = finite[:, 0].min(), np.ptp(finite, axis=0).max()
    if end is not None:
        points = points + [end - low, 0.0, 0.0]
        low = end
    return points, low + 2.0 * size


def selected(me):
    """Whether each polygon is selected and seen."""
    return get(me.polygons, "select", 1, np.bool_) & ~get(me.polygons, "hide", 1, np.bool_)


def triangle_vertices(me):
    """The vertices of the triangles that polygons are cut into, (m, 3)."""
    me.calc_loop_triangles()
    if PLAIN and len(me.loop_triangles):
        corners = get(me.loop_triangles, "loops", 3, np.int32)
        return get(me.attributes[".corner_vert"].data, "value", 1, np.int32)[corners]
    return get(me.loop_triangles, "vertices", 3, np.int32)


def triangle_polygons(me):
    """The polygon of each of those triangles, (m,)."""
    if PLAIN:
        return get(me.loop_triangle_polygons, "value", 1, np.int32)
    return get(me.loop_triangles, "polygon_index", 1, np.int32)


def not_selected(obs):
    """The UVs of the triangles that are not selected, (m, 3, 2), and the side of a square in UVs for one of
    side 1 in the scene, 0 where there is none.
    """
    uvs, flat, area = [np.zeros((0, 3, 2), np.float32)], 0.0, 0.0
    for ob in obs:
        me = ob.data
        if not me.uv_layers or not me.polygons:
            continue
        vertices = triangle_vertices(me)
        others = ~selected(me)[triangle_polygons(me)]
        uv = uv_get(me.uv_layers.active)[get(me.loop_triangles, "loops", 3, np.int32)[others]]
        at = (positions(me) @ linear(ob).T)[vertices[others]]
        sound = np.isfinite(uv).all(axis=(1, 2)) & np.isfinite(at).all(axis=(1, 2))
        uv, at = uv[sound], at[sound]
        uvs.append(uv)
        (a, b), (p, q) = ((x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) for x in (uv.astype(np.float64), at))
        flat += np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
        area += np.linalg.norm(np.cross(p, q), axis=1).sum()
    return np.concatenate(uvs), float(np.sqrt(flat / area)) if flat > 0 and area > 0 else 0.0


def is_scan(ob):
    """Whether an object has points: a mesh, or a point cloud (Blender 5)."""
    return ob is not None and ob.type in {"MESH", "POINTCLOUD"}


def is_cloud(me):
    """Whether this is the data of a point cloud object: it has the attributes of a mesh and no faces."""
    return hasattr(me, "points")


def has_faces(me):
    """Whether there are faces."""
    return not is_cloud(me) and len(me.polygons) > 0


def count(me):
    """The number of vertices, or of points."""
    return len(me.points if is_cloud(me) else me.vertices)


def put_positions(me, values):
    """The reverse of positions()."""
    if is_cloud(me):
        put(me.attributes["position"].data, "vector", values)
    else:
        put(me.vertices, "co", values)


def updated(me):
    """Says that the data were changed."""
    if is_cloud(me):
        me.update_tag()
    else:
        me.update()


def positions(me):
    """Positions of vertices or points, (n, 3) float32."""
    attribute = me.attributes.get("position")  # a plain copy where Blender keeps positions so (3.5 and later)
    if attribute is not None:
        return get(attribute.data, "vector", 3, np.float32)
    return get(me.vertices, "co", 3, np.float32)


def edges(obs, parts, name):
    """The joined meshes' edges that have a flag (use_seam, use_edge_sharp), as pairs of vertices."""
    out, n = [], 0
    for part in parts:
        me = next(ob.data for ob in obs if ob.name == part.object)
        flagged = edge_flags(me, name)
        if flagged.any():
            out.append(get(me.edges, "vertices", 2, np.int32)[flagged] + n)
        n += len(me.vertices)
    return np.concatenate(out) if out else np.empty((0, 2), np.int32)


def weights(obs, parts, name):
    """The weights of the joined meshes' vertices in a vertex group; 0 of those that are not in it."""
    out = []
    for part in parts:
        ob = next(ob for ob in obs if ob.name == part.object)
        group = ob.vertex_groups.get(name)
        found = np.zeros(len(ob.data.vertices), np.float32)
        if group is not None:
            # There is no way to get all weights at once.
            for v in ob.data.vertices:
                for member in v.groups:
                    if member.group == group.index:
                        found[v.index] = member.weight
        out.append(found)
    if not any(ob.vertex_groups.get(name) for ob in obs):
        raise Refused(f"no object has a vertex group {name}. Give the name of one, or leave it empty")
    return np.concatenate(out)


def edge_flags(me, name):
    """Whether each edge has a flag; what has no attribute has no flag."""
    if not PLAIN:
        return get(me.edges, name, 1, np.bool_)
    attribute = me.attributes.get(EDGE_FLAGS[name])
    return np.zeros(0, np.bool_) if attribute is None else get(attribute.data, "value", 1, np.bool_)


def meshes_of(parts):
    """The objects of the parts again, in order; refuses where one has changed since it was read."""
    out = []
    for part in parts:
        ob = bpy.data.objects.get(part.object)
        if (
            ob is None
            or ob.data is None
            or ob.data.name != part.mesh
            or len(ob.data.loops) != part.corner_count
        ):
            raise Refused(f"the object {part.object} was changed meanwhile. Run it again")
        out.append(ob)
    return out


def uv_get(layer):
    """A UV map's coordinates, (corners, 2)."""
    if hasattr(layer, "uv"):  # 3.5 and later
        return get(layer.uv, "vector", 2, np.float32)
    return get(layer.data, "uv", 2, np.float32)


def uv_put(layer, values):
    """The reverse of uv_get()."""
    if hasattr(layer, "uv"):
        # Not to layer.uv: it writes to the memory that a copy of the mesh shares with the one it was made of.
        put(layer.id_data.attributes[layer.name].data, "vector", values)
    else:
        put(layer.data, "uv", values)


def corner_uvs(obs, parts, purpose):
    """The UVs of the triangles in the active UV maps, (m, 3, 2)."""
    for ob in obs:
        if not ob.data.uv_layers:
            raise Refused(f"{ob.name} has no UV map {purpose}")
    return np.concatenate([uv_get(ob.data.uv_layers.active)[part.loops] for ob, part in zip(obs, parts)])


def pinned(layer):
    """Whether each corner is pinned."""
    if hasattr(layer, "pin"):
        return get(layer.pin, "value", 1, np.bool_) if len(layer.pin) else np.zeros(0, np.bool_)
    return get(layer.data, "pin_uv", 1, np.bool_)


def attributes(me):
    """The points' own attributes by name that the library can carry, and the names of those that it cannot.
    """
    out, left = {}, []
    for attribute in me.attributes:
        internal = attribute.name.startswith(".") or getattr(attribute, "is_internal", False)
        if attribute.domain != "POINT" or internal or attribute.name == "position":
            continue
        kind = KINDS.get(attribute.data_type)
        if kind is None:
            left.append(attribute.name)
            continue
        name, width, dtype = kind
        out[attribute.name] = get(attribute.data, name, width, dtype)
    return out, left


def add_attribute(me, name, kind, values):
    """A point attribute of one of KINDS. A name that is taken gets a number, as ever in Blender."""
    attribute = me.attributes.new(name=name, type=kind, domain="POINT")
    # Creating one may move the others: fetched again by its name.
    prop, _, dtype = KINDS[kind]
    put(me.attributes[attribute.name].data, prop, values.astype(dtype))


def put_floats(me, name, points, values):
    """A float attribute of these points. The others keep what it was there, or get NaN: nothing is known."""
    known = me.attributes.get(name)
    there = known is not None and (known.domain, known.data_type) == ("POINT", "FLOAT")
    of_all = get(known.data, "value", 1, np.float32) if there else np.full(count(me), np.nan, np.float32)
    of_all[points] = values
    if there:
        put(known.data, "value", of_all)
    else:
        add_attribute(me, name, "FLOAT", of_all)


def shows_stretch(attribute):
    """Whether a colour attribute is one that UV Stretch made; Blender may have put a number to its name."""
    return attribute.name.split(".")[0] == STRETCH


def own_colors(me):
    """The mesh's active colour attribute. Where UV Stretch shows its own: the one that was active before it,
    else the one that is rendered, else any other. None without.
    """
    found = [a for a in me.color_attributes if not shows_stretch(a)]
    if not found:
        return None
    # Those of a point cloud have neither.
    active = getattr(me.color_attributes, "active_color", None)
    rendered = getattr(me.color_attributes, "render_color_index", -1)
    wanted = [active.name if active is not None else None, me.get(COLOR)]
    if 0 <= rendered < len(me.color_attributes):
        wanted.append(me.color_attributes[rendered].name)
    return next((a for name in wanted for a in found if a.name == name), found[0])


def point_colors(me):
    """The active colours per vertex, (n, 4) linear, averaged where they belong to corners; None without."""
    attribute = own_colors(me)
    if attribute is None:
        return None, None
    colors = get(attribute.data, "color", 4, np.float32)
    if attribute.domain == "CORNER":
        vertex = get(me.loops, "vertex_index", 1, np.int32)
        count = np.maximum(np.bincount(vertex, minlength=len(me.vertices)), 1)
        colors = np.stack(
            [np.bincount(vertex, colors[:, k], len(me.vertices)) / count for k in range(4)], 1
        ).astype(np.float32)
    return colors, attribute.name


def new_mesh(name, vertices, faces):
    """A smooth triangle mesh."""
    me = bpy.data.meshes.new(name)
    me.vertices.add(len(vertices))
    me.loops.add(3 * len(faces))
    me.polygons.add(len(faces))
    put(me.vertices, "co", vertices.astype(np.float32))
    put(me.loops, "vertex_index", faces.astype(np.int32))
    put(me.polygons, "loop_start", np.arange(0, 3 * len(faces), 3, dtype=np.int32))
    if bpy.app.version < (3, 6, 0):  # later ones know where the next face starts
        put(me.polygons, "loop_total", np.full(len(faces), 3, np.int32))
    put(me.polygons, "use_smooth", np.ones(len(faces), np.bool_))
    me.update(calc_edges=True)
    return me


def mark_creases(me, triangles, corner_normals):
    """Marks as sharp the edges of a new_mesh() at whose ends the two triangles have other normals (t, 3, 3)."""
    start = triangles.ravel().astype(np.int64)
    end = np.roll(triangles, -1, axis=1).ravel().astype(np.int64)
    at_start = corner_normals.reshape(-1, 3)
    at_end = np.roll(corner_normals, -1, axis=1).reshape(-1, 3)
    turned = (start > end)[:, None]
    normals = np.where(turned, np.hstack([at_end, at_start]), np.hstack([at_start, at_end]))
    key = np.minimum(start, end) * len(me.vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    key, normals = key[order], normals[order]
    same = key[1:] == key[:-1]
    creased = key[1:][same & (normals[1:] != normals[:-1]).any(axis=1)]
    ends = np.sort(get(me.edges, "vertices", 2, np.int32).astype(np.int64), axis=1)
    put(me.edges, "use_edge_sharp", np.isin(ends[:, 0] * len(me.vertices) + ends[:, 1], creased))
    if hasattr(me, "use_auto_smooth"):  # later ones always look at sharp edges
        me.use_auto_smooth, me.auto_smooth_angle = True, np.pi


def set_report(me, title, notes=(), **lines):
    """Keeps a report with the mesh: the panel shows it, files carry it."""
    if notes:
        lines["notes"] = "; ".join(notes)
    me[REPORT] = {"title": title, **{key.replace("_", " "): str(value) for key, value in lines.items()}}


def put_beside(context, new, old, hide=False):
    """Links a new object where the old one is, and makes it the selected and active one; hides the old one if
    asked, so that the two do not flicker through each other.
    """
    for collection in old.users_collection:
        collection.objects.link(new)
    for other in context.selected_objects:
        other.select_set(False)
    new.select_set(True)
    context.view_layer.objects.active = new
    if hide and old.name in context.view_layer.objects:
        old.hide_set(True)


def show_result(context, colors=False, texture=False):
    """Lets the window's 3D views frame the selected objects, and show in solid shading what colours them."""
    if bpy.app.background or context.window is None:
        return
    for area in context.window.screen.areas:
        space, region = area.spaces.active, next((r for r in area.regions if r.type == "WINDOW"), None)
        if area.type != "VIEW_3D" or region is None:
            continue
        if space.shading.type == "SOLID" and (colors or texture):
            space.shading.color_type = "TEXTURE" if texture else "VERTEX"
        if space.region_3d is not None and space.region_3d.view_perspective != "CAMERA":
            with context.temp_override(window=context.window, area=area, region=region):
                bpy.ops.view3d.view_selected()
