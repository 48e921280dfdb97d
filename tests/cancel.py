#!/usr/bin/env python3
"""Presses Ctrl-C at random moments of every command, and prints how long the program took to end.

usage: cancel.py PROGRAM [--moments 50] [--size 200000] [--limit MS] [--only WORD] [--longest SECONDS]
                 [--busy N] [--seed N] [--table FILE.md]

Each command of the program runs on a scan or a mesh of SIZE points or faces made here (and denoise on as many
near-duplicates: each point twice, 1e-7 apart). It runs once to its end, or for --longest seconds, to learn
how long it takes; then MOMENTS times it gets SIGINT at a random moment. Prints a Markdown table: the time
from signal to end, worst and median, in milliseconds, and the moment of the worst; beside it the worst of
KILLS runs that are killed (SIGKILL): so long the system itself takes to end the process and to take its
memory back. --busy N keeps N other processors' worth of work going. Exit code 1 where a run did not end with
130 (or 0 when it was done first), left a file, or took longer than --limit milliseconds (100). Needs only
Python.
"""
import argparse
import math
import multiprocessing
import pathlib
import random
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

# Seconds after which a run that does not end is killed and counted as such.
HANG = 30
# Runs of each command that are killed, for comparison.
KILLS = 5


def scan(path, count, twice=False):
    """A sphere's points with noise of 0.002, or each point twice, 1e-7 apart; a binary PLY with colours."""
    rng = random.Random(1)
    rows = []
    for i in range(count // 2 if twice else count):
        z = 2 * (i + 0.5) / count * (2 if twice else 1) - 1
        a, s = 2.39996323 * i, math.sqrt(max(0.0, 1 - z * z))
        r = 1 + rng.gauss(0, 0.002)
        p = (r * s * math.cos(a), r * s * math.sin(a), r * z)
        color = (int(127 + 127 * z), 80, 160)
        rows.append((*p, *color))
        if twice:
            rows.append((p[0] + 1e-7, p[1], p[2], *color))
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n"
        + "".join(f"property double {c}\n" for c in "xyz")
    )
    head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue")) + "end_header\n"
    path.write_bytes(head.encode() + b"".join(struct.pack("<3d3B", *r) for r in rows))


def mesh(path, faces):
    """A bumpy torus of so many triangles; an OBJ with a UV per vertex."""
    n = max(4, int(math.sqrt(faces / 4)))
    m = max(4, faces // (2 * n))
    lines = []
    for i in range(m):
        for j in range(n):
            u, v = 2 * math.pi * i / m, 2 * math.pi * j / n
            r = 0.4 + 0.03 * math.sin(9 * u) * math.cos(5 * v)
            lines.append(
                f"v {(1 + r * math.cos(v)) * math.cos(u):.7f} {(1 + r * math.cos(v)) * math.sin(u):.7f} "
                f"{r * math.sin(v):.7f} 0.8 0.4 0.2"
            )
            lines.append(f"vt {i / m:.6f} {j / n:.6f}")
    at = lambda i, j: (i % m) * n + j % n + 1
    for i in range(m):
        for j in range(n):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            lines += [f"f {a}/{a} {b}/{b} {c}/{c}", f"f {a}/{a} {c}/{c} {d}/{d}"]
    path.write_text("\n".join(lines) + "\n")


COMMANDS = {
    "denoise": "denoise {scan} -o {out}.ply --points {out}p.ply",
    "denoise, near-duplicates": "denoise {twice} -o {out}.ply",
    "denoise, watertight": "denoise {scan} -o {out}.ply --watertight --no-uv",
    "denoise, baked": "denoise {scan} -o {out}.glb --bake --texture-size 2048",
    "denoise, mlp": "denoise {scan} -o {out}.ply --prior mlp",
    "denoise, conv": "denoise {scan} -o {out}.ply --prior conv",
    "denoise, level set": "denoise {scan} -o {out}.ply --prior level-set",
    "denoise, uncertainty": "denoise {scan} -o {out}.ply --uncertainty --no-uv",
    "compare": "compare {scan} {twice} -o {out}.ply",
    "unwrap": "unwrap {mesh} -o {out}.ply",
    "unwrap, boxes": "unwrap {mesh} -o {out}.ply --packer boxes",
    "simplify": "simplify {mesh} -o {out}.ply --faces 5000",
    "bake": "unwrap {mesh} -o {out}.glb --packer boxes --bake --texture-size 4096",
    "convert": "convert {mesh} {out}.glb",
    "convert to text": "convert {scan} {out}.ply --ascii",
    "render": "render {mesh} -o {out}.png --size 4096x4096",
    "render points": "render {scan} -o {out}.png --size 4096x4096",
    "measure": "measure {mesh} --against {mesh}",
    "info": "info {mesh}",
    "info of points": "info {scan}",
}


def run(command, moment, sent=signal.SIGINT):
    """Runs, with a signal after so many seconds; the exit code, and the seconds from the signal to the end
    (None: it was done before).
    """
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        child.wait(timeout=moment)
        return child.returncode, None
    except subprocess.TimeoutExpired:
        pass
    # A wait with a timeout would sleep up to 50 ms beyond the end.
    guard = threading.Timer(HANG, child.kill)
    guard.start()
    at = time.perf_counter()
    child.send_signal(sent)
    child.wait()
    seconds = time.perf_counter() - at
    guard.cancel()
    return child.returncode, seconds


def spin():
    while True:
        pass


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--size", type=int, default=200_000)
    parser.add_argument("--limit", type=float, default=100.0)
    parser.add_argument("--only", default="")
    parser.add_argument("--longest", type=float, default=60.0)
    parser.add_argument("--busy", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--table", type=pathlib.Path)
    args = parser.parse_args()
    rng = random.Random(args.seed)
    busy = [multiprocessing.Process(target=spin, daemon=True) for _ in range(args.busy)]
    for process in busy:
        process.start()
    table = [
        "| command | seconds | cancelled | median ms | worst ms | at second | killed, worst ms | wrong |",
        "|---|---|---|---|---|---|---|---|",
    ]
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        files = {"scan": folder / "scan.ply", "twice": folder / "twice.ply", "mesh": folder / "mesh.obj"}
        scan(files["scan"], args.size)
        scan(files["twice"], args.size, twice=True)
        mesh(files["mesh"], args.size)
        print(table[0], table[1], sep="\n", flush=True)
        for name, line in COMMANDS.items():
            if args.only not in name:
                continue
            out = folder / "out"
            out.mkdir()
            command = [str(args.program), *line.format(**files, out=out / "result").split(), "--quiet"]
            started = time.perf_counter()
            run(command, args.longest)
            seconds = time.perf_counter() - started
            waits, wrong = [], []
            for _ in range(args.moments):
                for file in out.iterdir():
                    file.unlink()
                moment = rng.uniform(0.02, max(0.03, min(seconds, args.longest)))
                code, wait = run(command, moment)
                if wait is None:
                    wrong += [f"exit {code}"] if code else []
                    continue
                waits.append((wait, moment))
                # Done as the signal came is no failure.
                if code not in (130, 0, -signal.SIGINT):
                    wrong.append(f"exit {code} at {moment:.3f} s")
                left = sorted(f.name for f in out.iterdir())
                if left and code != 0:
                    wrong.append(f"left {left} at {moment:.3f} s")
            kills = [
                run(command, rng.uniform(0.02, max(0.03, min(seconds, args.longest))), signal.SIGKILL)[1]
                for _ in range(KILLS)
            ]
            killed = max((k for k in kills if k is not None), default=0.0)
            worst = max(waits, default=(0.0, 0.0))
            median = statistics.median([w for w, _ in waits]) if waits else 0.0
            failed |= bool(wrong) or 1000 * worst[0] > args.limit
            row = (
                f"| {name} | {seconds:.2f} | {len(waits)} of {args.moments} | {1000 * median:.0f} "
                f"| {1000 * worst[0]:.0f} | {worst[1]:.3f} | {1000 * killed:.0f} | {'; '.join(wrong)} |"
            )
            table.append(row)
            print(row, flush=True)
            for file in out.iterdir():
                file.unlink()
            out.rmdir()
    for process in busy:
        process.terminate()
    if args.table:
        args.table.write_text("\n".join(table) + "\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
