"""Runs the peers of `atlasfit bench unwrap` on one mesh, or the independent judge on one layout.

usage: uv.py run MESH.bin OUT_FOLDER REPEAT SECONDS PEER...   -> a JSON line per peer: peer, file, seconds,
                                                                 or error
       uv.py judge MESH.bin LAYOUT.uv FOLDER_OF_UVMETRICS      -> a JSON line of figures
       uv.py peers                                             -> the peers that are installed

MESH.bin: uint32 vertices, uint32 triangles, float64 positions, uint32 triangles. LAYOUT.uv: 6 float32 per
triangle. Times are those of the peer's own call, the median of REPEAT; padding 2 texels, page 1024. Each peer
runs in a process of its own: a crash costs that peer only.
"""
import json
import os
import signal
import statistics
import sys
import time

import numpy as np


def read_mesh(path):
    raw = open(path, "rb").read()
    n, m = np.frombuffer(raw, "<u4", 2)
    return (
        np.frombuffer(raw, "<f8", 3 * n, 8).reshape(-1, 3),
        np.frombuffer(raw, "<u4", 3 * m, 8 + 24 * n).reshape(-1, 3),
    )


def xatlas(V, F):
    import xatlas

    atlas = xatlas.Atlas()
    atlas.add_mesh(V.astype(np.float32), F)
    pack = xatlas.PackOptions()
    pack.padding, pack.resolution = 2, 1024
    start = time.perf_counter()
    atlas.generate(xatlas.ChartOptions(), pack)
    seconds = time.perf_counter() - start
    _, indices, uv = atlas[0]
    return uv[indices], seconds


def uvunwrap(V, F):
    import uvunwrap

    mesh = uvunwrap.Mesh(V.astype(np.float32), F)
    start = time.perf_counter()
    atlas = uvunwrap.generate([mesh])
    seconds = time.perf_counter() - start
    out = atlas.meshes[0]
    uv, indices = np.asarray(out.uv).reshape(-1, 2), np.asarray(out.indices).reshape(-1, 3)
    return uv[indices], seconds


def blender(V, F, unwrap):
    """Blender's own: smart project, or unwrap with seams at edges sharper than 60 degrees, then pack;
    defaults otherwise.
    """
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(V.tolist(), [], F.tolist())
    thing = bpy.data.objects.new("mesh", mesh)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    mesh.uv_layers.new()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    margin = 2 / 1024
    start = time.perf_counter()
    if unwrap:
        bpy.ops.mesh.select_all(action="DESELECT")
        bpy.ops.mesh.select_mode(type="EDGE")
        bpy.ops.mesh.edges_select_sharp(sharpness=np.radians(60))
        bpy.ops.mesh.mark_seam()
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.unwrap(margin=margin)
    else:
        bpy.ops.uv.smart_project(island_margin=margin)
    bpy.ops.uv.average_islands_scale()
    bpy.ops.uv.pack_islands(margin=margin)
    seconds = time.perf_counter() - start
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = np.empty(6 * len(F), np.float32)
    mesh.uv_layers[0].data.foreach_get("uv", uv)
    return uv, seconds


PEERS = {
    "xatlas": ("xatlas", xatlas),
    "uvunwrap": ("uvunwrap", uvunwrap),
    "blender-smart": ("bpy", lambda V, F: blender(V, F, False)),
    "blender-unwrap": ("bpy", lambda V, F: blender(V, F, True)),
}


def run(path, out, repeat, limit, names):
    V, F = read_mesh(path)
    for name in names:
        file = os.path.join(out, name + ".uv")
        if os.path.exists(file):
            os.remove(file)
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            signal.alarm(limit)
            try:
                runs = [PEERS[name][1](V, F) for _ in range(repeat)]
                np.asarray(runs[-1][0], "<f4").tofile(file)
                said = {"peer": name, "file": file, "seconds": statistics.median(r[1] for r in runs)}
            except Exception as e:  # whatever a peer throws is its result
                said = {"peer": name, "error": str(e)[:200]}
            print(json.dumps(said), flush=True)
            os._exit(0)
        status = os.waitpid(child, 0)[1]
        if status:
            print(json.dumps({"peer": name, "error": "ended by signal %d" % (status & 127)}), flush=True)


def judge(path, layout, folder):
    sys.path.insert(0, folder)
    from uvmetrics import metrics

    V, F = read_mesh(path)
    uv = np.fromfile(layout, "<f4").reshape(-1, 3, 2)
    print(json.dumps(metrics(V, F, uv)))


def installed(module):
    import importlib.util

    return importlib.util.find_spec(module) is not None


if __name__ == "__main__":
    what, *rest = sys.argv[1:]
    if what == "run":
        run(rest[0], rest[1], int(rest[2]), int(rest[3]), rest[4:])
    elif what == "judge":
        judge(*rest)
    else:
        print("\n".join(name for name, (module, _) in PEERS.items() if installed(module)))
