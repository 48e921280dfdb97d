#!/usr/bin/env python3
"""Where the time goes: seconds and shares of the stages of `denoise` on scans of several sizes and of
`unwrap` on a large mesh, with what each point or face costs, as a Markdown table. Before it what the machine
does at most, by NumPy on one thread: multiplications with an addition (a product of matrices) and bytes (a
copy). docs/performance.md says what the stages need at least.

    tests/performance.py target/release/atlasfit                # some minutes
    tests/performance.py target/release/atlasfit --sizes 16000 --faces 0

The scan is a torus with bumps and noise of 0.005 of its longest side; the mesh is that torus without noise.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

# Read when NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import made
import memory

NOISE = 0.005


def bumpy(vertices):
    """Vertices with bumps of a tenth of the tube, the longest side 1."""
    angles = np.arctan2(vertices[:, 1], vertices[:, 0])
    moved = vertices * (1 + 0.04 * np.sin(9 * angles) * np.cos(12 * vertices[:, 2]))[:, None]
    return moved / np.ptp(moved, axis=0).max()


def scan(count, seed=1):
    """Points on the torus, even in area but for the bumps."""
    rng = np.random.default_rng(seed)
    v = rng.random(3 * count) * 2 * np.pi
    v = v[rng.random(len(v)) * 1.4 < 1 + 0.4 * np.cos(v)][:count]
    u = rng.random(len(v)) * 2 * np.pi
    out = 1 + 0.4 * np.cos(v)
    points = bumpy(np.c_[out * np.cos(u), out * np.sin(u), 0.4 * np.sin(v)])
    return points + NOISE * rng.normal(size=points.shape)


def best(work, runs=5):
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def machine():
    a = np.random.default_rng(0).random((1024, 1024))
    product = 1e-9 * 1024**3 / best(lambda: a @ a)
    source, target = np.ones(1 << 25), np.zeros(1 << 25)
    copied = 2e-9 * source.nbytes / best(lambda: np.copyto(target, source))
    return f"{product:.0f} thousand million multiplications with an addition, {copied:.1f} GB a second"


def run(program, job, path, out, threads):
    command = [program, job, path, "-o", out, "--json", "--quiet", "--threads", str(threads)]
    before = sum(os.times()[2:4])
    report = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    report["cpu"] = sum(os.times()[2:4]) - before
    return report


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--sizes", default="16000,300000,1000000", help="points of the scans")
    parser.add_argument("--faces", type=int, default=1000000, help="triangles of the mesh; 0 = none")
    parser.add_argument("--threads", type=int, default=0, help="0 = one per core")
    options = parser.parse_args()
    print(f"One thread of this machine does {machine()}.\n", flush=True)
    columns = []
    with tempfile.TemporaryDirectory() as folder:
        names = ("scan.ply", "mesh.ply", "out.ply")
        scan_path, mesh_path, out = (str(pathlib.Path(folder) / name) for name in names)
        for size in map(int, options.sizes.split(",")):
            memory.write_ply(scan_path, scan(size))
            report = run(options.program, "denoise", scan_path, out, options.threads)
            columns.append((f"{size:,} points", size, report))
        if options.faces:
            nv = max(8, round((options.faces / 5) ** 0.5))
            vertices, quads = made.torus(nu=round(options.faces / 2 / nv), nv=nv)
            memory.write_ply(mesh_path, bumpy(vertices), made.triangles(quads)[0])
            report = run(options.program, "unwrap", mesh_path, out, options.threads)
            columns.append((f"{report['triangles']:,} triangles", report["triangles"], report))
    stages = list(dict.fromkeys(s for _, _, report in columns for s in report["stages"]))
    print("| stage | " + " | ".join(name for name, _, _ in columns) + " |")
    print("|---" * (len(columns) + 1) + "|")

    def cell(seconds, size, whole):
        return f"{seconds:.2f} s, {100 * seconds / whole:.0f} %, {1e6 * seconds / size:.1f} µs"

    for stage in stages:
        row = [
            cell(r["stages"][stage], size, r["seconds"]) if stage in r["stages"] else ""
            for _, size, r in columns
        ]
        print(f"| {stage} | " + " | ".join(row) + " |")
    whole = [f"{r['seconds']:.2f} s, processor {r['cpu']:.2f} s" for *_, r in columns]
    print("| all | " + " | ".join(whole) + " |")
    for key in ("charts", "spacing", "noise", "voxel", "faces"):
        row = [f"{r[key]:,.4g}" if key in r else "" for *_, r in columns]
        print(f"| {key} | " + " | ".join(row) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
