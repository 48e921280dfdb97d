"""What the cases share: the add-on installed from ADDON_ZIP, scenes, and what is asked of results."""

import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from made import sphere_points

EXTENSION = bpy.app.version >= (4, 2, 0)
if EXTENSION:
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["ADDON_ZIP"], repo="user_default", enable_on_install=True
    )
    import bl_ext.user_default.atlasfit_blender as addon
else:
    bpy.ops.preferences.addon_install(filepath=os.environ["ADDON_ZIP"], overwrite=True)
    bpy.ops.preferences.addon_enable(module="atlasfit_blender")
    import atlasfit_blender as addon
atlasfit, mesh = addon.native.atlasfit, addon.mesh


# ---- scenes


def link(me, name="object"):
    ob = bpy.data.objects.new(name, me)
    bpy.context.collection.objects.link(ob)
    select(ob)
    return ob


def select(*obs):
    for ob in bpy.context.view_layer.objects:
        ob.select_set(ob in obs)
    bpy.context.view_layer.objects.active = obs[0] if obs else None


def from_lists(vertices, faces, name="mesh", edges=()):
    me = bpy.data.meshes.new(name)
    me.from_pydata([tuple(map(float, v)) for v in vertices], list(edges), [tuple(map(int, f)) for f in faces])
    me.update()
    return link(me, name)


def monkey():
    bpy.ops.mesh.primitive_monkey_add()
    ob = bpy.context.object
    while ob.data.uv_layers:
        ob.data.uv_layers.remove(ob.data.uv_layers[0])
    return ob


def cylinder(depth=2.0, sides=32):
    bpy.ops.mesh.primitive_cylinder_add(vertices=sides, depth=depth)
    return bpy.context.object


def grid(n=10):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=n, y_subdivisions=n)
    return bpy.context.object


def scan(n=3000):
    me = bpy.data.meshes.new("scan")
    me.vertices.add(n)
    me.vertices.foreach_set("co", sphere_points(n).astype(np.float32).ravel())
    return link(me, "scan")


def everything():
    """Quads, an n-gon, triangles, a loose part, a loose vertex and edge; two materials, a vertex group, shape
    keys, a modifier.
    """
    t = 2 * np.pi * np.arange(8) / 8
    ring = lambda z, r: [(r * np.cos(a), r * np.sin(a), z) for a in t]
    vertices = (
        ring(0, 1)
        + ring(1, 1)
        + [(0, 0, 2)]
        + [(5, 0, 0), (6, 0, 0), (6, 1, 0), (5, 1, 0)]
        + [(9, 9, 9), (8, 8, 8)]
    )
    faces = [tuple(range(7, -1, -1))]
    faces += [(i, (i + 1) % 8, 8 + (i + 1) % 8, 8 + i) for i in range(8)]
    faces += [(8 + i, 8 + (i + 1) % 8, 16) for i in range(8)] + [(17, 18, 19, 20)]
    ob = from_lists(vertices, faces, "everything", edges=[(21, 22)])
    me = ob.data
    for name in ("red", "blue"):
        me.materials.append(bpy.data.materials.new(name))
    me.polygons.foreach_set("material_index", (np.arange(len(faces)) % 2).astype(np.int32))
    ob.vertex_groups.new(name="group").add([0, 1, 2], 0.5, "REPLACE")
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Tall")
    for i, v in enumerate(vertices):
        key.data[i].co = (v[0], v[1], 3 * v[2])
    key.value = 0.5
    ob.modifiers.new("subsurf", "SUBSURF")
    return ob


# ---- what is asked of results


def uvs(ob, name=None):
    layer = ob.data.uv_layers[name] if name else ob.data.uv_layers.active
    return mesh.uv_get(layer)


def quality(*obs):
    """The library's own judge, over the triangles that Blender draws, as scaled in the scene."""
    given = mesh.triangles(list(obs), False)
    corner_uv = np.concatenate([uvs(ob)[part.loops] for ob, part in zip(obs, given.parts)])
    return atlasfit.measure_uv(given.vertices, given.faces, corner_uv)


def assert_good(*obs, stretch=1.3):
    q = quality(*obs)
    assert q.flips == 0 and q.overlapping_faces == 0 and q.degenerate == 0, q
    assert q.inside and q.finite and q.stretch_p95 < stretch, q
    return q


def refused(call, text):
    """The operator reports an error with our text, which scripts see as a RuntimeError."""
    try:
        call()
    except RuntimeError as failure:
        assert text in str(failure), failure
        return
    raise AssertionError("it was not refused")


def report(ob):
    return dict(ob.data[mesh.REPORT])


def cut_edges(ob):
    """Edges whose two faces have different UVs there."""
    me, uv = ob.data, uvs(ob)
    seen = {}
    for polygon in me.polygons:
        loops = list(polygon.loop_indices)
        for a, b in zip(loops, loops[1:] + loops[:1]):
            key = tuple(sorted((me.loops[a].vertex_index, me.loops[b].vertex_index)))
            ends = {me.loops[a].vertex_index: tuple(uv[a]), me.loops[b].vertex_index: tuple(uv[b])}
            seen.setdefault(key, []).append(ends)
    return {key for key, ends in seen.items() if len(ends) == 2 and ends[0] != ends[1]}


def right(ob):
    """Polygons on the right of the grid's middle line, and their corners."""
    polygons = np.array([p.center.x > 0 for p in ob.data.polygons])
    return polygons, np.repeat(polygons, [p.loop_total for p in ob.data.polygons])


def unwrap_apart(ob):
    """Unwraps a grid and moves the UVs of its right half away: its middle is cut."""
    bpy.ops.uv.atlasfit_unwrap()
    uv = uvs(ob)
    uv[right(ob)[1], 0] += 2
    mesh.uv_put(ob.data.uv_layers.active, uv)


def edit(ob, part, chosen):
    """Edit mode with these vertices or polygons of an object selected, and nothing else."""
    for name in ("vertices", "edges", "polygons"):
        of = getattr(ob.data, name)
        of.foreach_set("select", chosen if name == part else np.zeros(len(of), bool))
    bpy.ops.object.mode_set(mode="EDIT")


def middle(ob, flag=None):
    """Edges on the grid's middle line, as cut_edges() names them; they get the flag."""
    co, out = [v.co for v in ob.data.vertices], set()
    for e in ob.data.edges:
        if all(abs(co[v].x) < 1e-6 for v in e.vertices):
            out.add(tuple(sorted(e.vertices)))
            if flag:
                setattr(e, flag, True)
    return out
