#!/usr/bin/env python3
"""Times reading a million points beside the usual Python readers, all in one run, turn by turn.

usage: read_speed.py COUNTS_PROGRAM [--points 1000000] [--rounds 7] [--large 0]
       (COUNTS_PROGRAM: cargo build --release -p atlasfit-io --example counts; it prints the milliseconds of
       each load)

PLY (binary: float positions, normals, byte colours) against trimesh and pymeshlab; LAS (point format 3)
against laspy; PCD (binary: float positions, packed colours, intensity) against pypcd4. laspy and pypcd4 only
copy the file's records on reading; our load gives every column apart, positions and attributes in double
precision, colours unpacked. So more than one is shown: "read" is their load call alone, "columns" also takes
every column out as an array of the file's type (laspy: positions scaled), "doubles" gives what our load
gives. Times are wall-clock milliseconds of the load alone, files and program warm: median and least over the
rounds. --large N also reads a PLY of N MB and says how far its speed is from that of reading its bytes into
memory. Exit code 1 if we are slower (medians) than a peer at what our load does. Needs numpy, trimesh,
pymeshlab, laspy, pypcd4.
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np

warnings.filterwarnings("ignore")


def write_ply(path, n, rng):
    rows = np.zeros(n, [("p", "<f4", 3), ("n", "<f4", 3), ("c", "u1", 3)])
    rows["p"], rows["n"], rows["c"] = (
        rng.normal(size=(n, 3)),
        rng.normal(size=(n, 3)),
        rng.integers(0, 256, (n, 3)),
    )
    names = [
        "float x", "float y", "float z", "float nx", "float ny", "float nz", "uchar red", "uchar green",
        "uchar blue",
    ]
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {n}\n"
        + "".join(f"property {p}\n" for p in names)
        + "end_header\n"
    )
    path.write_bytes(head.encode() + rows.tobytes())


def write_las(path, n, rng):
    import laspy

    las = laspy.create(point_format=3, file_version="1.2")
    las.header.scales, las.header.offsets = [0.001] * 3, [1e5, 2e5, 100.0]
    las.x, las.y, las.z = (rng.normal(size=n) + o for o in (1e5, 2e5, 100.0))
    las.intensity = rng.integers(0, 65536, n)
    las.classification = rng.integers(0, 10, n)
    las.gps_time = np.arange(n) * 1e-6
    las.red, las.green, las.blue = (rng.integers(0, 65536, n) for _ in range(3))
    las.write(str(path))


def write_pcd(path, n, rng):
    rows = np.zeros(n, [("p", "<f4", 3), ("rgb", "<u4"), ("intensity", "<f4")])
    rows["p"], rows["rgb"], rows["intensity"] = (
        rng.normal(size=(n, 3)),
        rng.integers(0, 1 << 24, n),
        rng.random(n),
    )
    head = ("VERSION 0.7\nFIELDS x y z rgb intensity\nSIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 1 1 1 1 1\n"
            f"WIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n")
    path.write_bytes(head.encode() + rows.tobytes())


def trimesh_read(path):
    import trimesh

    return trimesh.load(path, process=False)


def pymeshlab_read(path):
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(path)
    return meshes


def laspy_read(path):
    import laspy

    return laspy.read(path)


def laspy_columns(path):
    las = laspy_read(path)
    return [las.xyz] + [np.array(las[name]) for name in las.point_format.dimension_names]


def pypcd_read(path):
    from pypcd4 import PointCloud

    return PointCloud.from_path(path)


def pypcd_columns(path):
    cloud = pypcd_read(path)
    return [cloud.numpy(("x", "y", "z"))] + [
        np.array(cloud.pc_data[name]) for name in cloud.fields if name not in "xyz"
    ]


def pypcd_doubles(path):
    cloud = pypcd_read(path)
    colors = type(cloud).decode_rgb(np.array(cloud.pc_data["rgb"]))
    return [
        cloud.numpy(("x", "y", "z")).astype(float),
        colors.astype(np.float32) / 255,
        cloud.pc_data["intensity"].astype(float),
    ]


CASES = [
    ("ply", write_ply, {"trimesh": trimesh_read, "pymeshlab": pymeshlab_read}, {}),
    ("las", write_las, {"laspy columns": laspy_columns}, {"laspy read": laspy_read}),
    (
        "pcd", write_pcd, {"pypcd4 doubles": pypcd_doubles},
        {"pypcd4 columns": pypcd_columns, "pypcd4 read": pypcd_read},
    ),
]


def ours(program, path):
    # The third load of one process: the readers beside us are called again and again in one process, too.
    out = subprocess.run([program, *[str(path)] * 3], capture_output=True, text=True, check=True).stdout
    return float(out.splitlines()[-1].split("\t")[4])


def timed(job, path):
    start = time.perf_counter()
    kept = job(str(path))
    took = 1e3 * (time.perf_counter() - start)
    del kept
    return took


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program")
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--large", type=int, default=0)
    args = parser.parse_args()
    slower = []
    with tempfile.TemporaryDirectory() as folder:
        for kind, write, peers, shown in CASES:
            path = pathlib.Path(folder) / f"points.{kind}"
            write(path, args.points, np.random.default_rng(1))
            jobs = {"atlasfit": lambda p: None, **peers, **shown}
            times = {name: [] for name in jobs}
            for r in range(args.rounds + 1):
                for name, job in jobs.items():
                    took = ours(args.program, path) if name == "atlasfit" else timed(job, path)
                    # The first round warms the files and the imports.
                    if r:
                        times[name].append(took)
            mine = statistics.median(times["atlasfit"])
            for name, t in times.items():
                m = statistics.median(t)
                print(
                    f"{kind}  {name:16} median {m:8.1f} ms  least {min(t):8.1f} ms  {m / mine:6.2f} x ours",
                    flush=True,
                )
                if name in peers and m < mine:
                    slower.append(f"{kind}: {name}")
        if args.large:
            large(args, pathlib.Path(folder) / "large.ply")
    print("slower than: " + ", ".join(slower) if slower else "nowhere slower")
    return 1 if slower else 0


def large(args, path):
    write_ply(path, args.large * 1_000_000 // 27, np.random.default_rng(2))
    size = os.path.getsize(path) / 1e6
    mine, plain = [], []
    for _ in range(3):
        mine.append(ours(args.program, path))
        buffer = bytearray(os.path.getsize(path))
        start = time.perf_counter()
        with open(path, "rb", buffering=0) as f:
            view, at = memoryview(buffer), 0
            while got := f.readinto(view[at:]):
                at += got
        plain.append(1e3 * (time.perf_counter() - start))
        del view, buffer
    print(
        f"ply of {size:.0f} MB: ours {size / min(mine):.2f} GB/s, "
        f"its bytes into memory {size / min(plain):.2f} GB/s (cached file)"
    )


if __name__ == "__main__":
    sys.exit(main())
