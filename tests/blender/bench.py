"""Atlas Unwrap beside Blender's own operators, in one process, on a folder of triangle meshes (binary PLY):

    ADDON_ZIP=... python bench.py FOLDER OUT.json [--methods A,B] [--meshes NAME,NAME]    with the package bpy

Blender's unwrap needs seams: it gets those of smart_project's islands, free of charge. Times are the
operators' own, wall clock and processor; the judge is the library's measure_uv, the same for all. OUT.json is
added to, so that methods can be run one after another; OUT.md beside it is the table.
"""

import argparse
import json
import math
import os
import resource
import time
from pathlib import Path

import bpy
import numpy as np

LIMIT = 150_000  # faces beyond which Blender's own are left out: they take minutes
MARGIN = 2 / 1024

bpy.ops.extensions.package_install_files(
    filepath=os.environ["ADDON_ZIP"], repo="user_default", enable_on_install=True
)
import bl_ext.user_default.atlasfit_blender as addon

mesh, atlasfit = addon.mesh, addon.native.atlasfit


def read_ply(path):
    """Vertices and triangles of a little-endian PLY with float positions and int lists."""
    data = path.read_bytes()
    head, body = data[: data.index(b"end_header\n") + 11], data[data.index(b"end_header\n") + 11 :]
    counts = {
        line.split()[1]: int(line.split()[2])
        for line in head.decode().splitlines()
        if line.startswith("element")
    }
    n, m = counts["vertex"], counts["face"]
    vertices = np.frombuffer(body, "<f4", 3 * n).reshape(-1, 3)
    faces = np.frombuffer(body, np.dtype([("k", "u1"), ("v", "<i4", 3)]), m, 12 * n)
    assert (faces["k"] == 3).all()
    return vertices, faces["v"]


def unwrap_with(method):
    def run():
        bpy.ops.uv.unwrap(method=method, margin=MARGIN)
        bpy.ops.uv.pack_islands(margin=MARGIN)

    return run


METHODS = {
    "Atlas Unwrap": lambda: bpy.ops.uv.atlasfit_unwrap(),
    "smart_project": lambda: bpy.ops.uv.smart_project(angle_limit=math.radians(66), island_margin=MARGIN),
    "ANGLE_BASED": unwrap_with("ANGLE_BASED"),
    "CONFORMAL": unwrap_with("CONFORMAL"),
    "MINIMUM_STRETCH": unwrap_with("MINIMUM_STRETCH"),
}
OURS, SMART = "Atlas Unwrap", "smart_project"


def seconds():
    use = resource.getrusage(resource.RUSAGE_SELF)
    return time.perf_counter(), use.ru_utime + use.ru_stime


def measured(ob, run):
    """One method on the active object in Edit mode with everything selected."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    wall, processor = seconds()
    run()
    wall, processor = (b - a for a, b in zip((wall, processor), seconds()))
    bpy.ops.object.mode_set(mode="OBJECT")
    given = mesh.triangles([ob], False)
    q = atlasfit.measure_uv(
        given.vertices, given.faces, mesh.uv_get(ob.data.uv_layers.active)[given.parts[0].loops]
    )
    keys = (
        "charts", "seam", "stretch_l2", "stretch_p95", "coverage", "flips", "overlapping_faces", "degenerate"
    )
    return {"wall": wall, "processor": processor, **{k: getattr(q, k) for k in keys}}


def one(path, methods):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    vertices, faces = read_ply(path)
    me = mesh.new_mesh(path.stem, vertices, faces)
    ob = bpy.data.objects.new(path.stem, me)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    me.uv_layers.new(name="UVMap")
    out = {}
    if OURS in methods:  # first: before there are seams
        out[OURS] = measured(ob, METHODS[OURS])
    peers = [m for m in METHODS if m in methods and m != OURS]
    if peers and len(faces) <= LIMIT:
        out[SMART] = measured(ob, METHODS[SMART])
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.uv.select_all(action="SELECT")
        bpy.ops.uv.seams_from_islands()
        bpy.ops.object.mode_set(mode="OBJECT")
        out |= {m: measured(ob, METHODS[m]) for m in peers if m != SMART}
    return len(faces), out


def table(results):
    """Markdown: medians of each method, the share of meshes on which ours is ahead, then every mesh."""
    having = lambda *methods: [r for _, r in results.values() if all(m in r for m in methods)]
    column = lambda rows, method, key: np.array([r[method][key] for r in rows], float)
    lines = [
        "Medians over the meshes that a method was run on. Seam in units of the square root of the area; "
        "stretch: 1 is isometric; bad: meshes with flips, overlaps or collapsed faces.",
        "",
        "| | meshes | charts | seam | stretch L2 | stretch p95 | coverage | bad | seconds "
        "| processor seconds |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for m in METHODS:
        rows = having(m)
        if not rows:
            continue
        bad = int(
            sum(column(rows, m, k) for k in ("flips", "overlapping_faces", "degenerate")).astype(bool).sum()
        )
        med = lambda key: np.median(column(rows, m, key))
        lines.append(
            f"| {m} | {len(rows)} | {med('charts'):.0f} | {med('seam'):.1f} | {med('stretch_l2'):.3f} "
            f"| {med('stretch_p95'):.3f} | {100 * med('coverage'):.0f} % | {bad} "
            f"| {med('wall'):.2f} | {med('processor'):.2f} |"
        )
    lines.append("")
    keys = {
        "seam": "seam", "stretch_l2": "stretch L2", "stretch_p95": "stretch p95", "wall": "time",
        "processor": "processor time",
    }
    for m in METHODS:
        rows = having(OURS, m)
        if m != OURS and rows:
            ahead = {
                text: np.mean(column(rows, OURS, key) < column(rows, m, key)) for key, text in keys.items()
            }
            lines.append(
                f"Ahead of {m} on {len(rows)} meshes: "
                + ", ".join(f"{text} {100 * share:.0f} %" for text, share in ahead.items())
                + "."
            )
            lines.append("")
    lines += [
        "| mesh | triangles | " + " | ".join(f"{m}: charts, seam, L2, s" for m in METHODS) + " |",
        "|---|---|" + "---|" * len(METHODS),
    ]
    for name, (faces, r) in results.items():
        cell = lambda v: f"{v['charts']}, {v['seam']:.1f}, {v['stretch_l2']:.3f}, {v['wall']:.2f}"
        lines.append(
            f"| {name} | {faces} | " + " | ".join(cell(r[m]) if m in r else "" for m in METHODS) + " |"
        )
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--methods", type=lambda t: t.split(","), default=list(METHODS))
    parser.add_argument("--meshes", type=lambda t: t.split(","))
    arguments = parser.parse_args()
    results = json.loads(arguments.out.read_text()) if arguments.out.exists() else {}
    for path in sorted(arguments.folder.glob("*.ply"), key=lambda p: p.stat().st_size):
        if arguments.meshes and path.stem not in arguments.meshes:
            continue
        faces, found = one(path, arguments.methods)
        results[path.stem] = (faces, (results[path.stem][1] if path.stem in results else {}) | found)
        arguments.out.write_text(json.dumps(results))
        arguments.out.with_suffix(".md").write_text(
            f"Blender {bpy.app.version_string}, {os.cpu_count()} processors. {table(results)}"
        )
        print(path.stem, faces, flush=True)
    os._exit(0)


main()
