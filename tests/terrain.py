#!/usr/bin/env python3
"""How a scan in tiles compares with one in memory. Makes terrain of any size and prints a Markdown table:
points, seconds, seconds of the processor for a million, peak memory, and the rate of the tiles as a share of
the rate in memory.

    tests/terrain.py target/release/atlasfit WORK                       # 4 million points; some minutes
    tests/terrain.py target/release/atlasfit WORK --points 50000000     # hours on two cores, 40 GB on disk

WORK is a folder for the scans, the work of the tiles and the results. What is there goes on or is used again.
The terrain: hills of 20 units, a flat roof of 24 units' side on three of five lots of 60, one point for each
unit's square, noise of a tenth of a unit. Needs numpy, and a system that counts processor time of children.
"""

import argparse
import os
import pathlib
import subprocess
import time

import numpy as np

# Points that are made at once.
CHUNK = 1_000_000
LOT, ROOF = 60, 12
NOISE = 0.1


def part(rng, count, low, high, side):
    """Points of the terrain with x from `low` to `high`, far from the origin."""
    x = low + (high - low) * rng.random(count)
    y = side * rng.random(count)
    z = 10 * np.sin(x / 37) + 7 * np.cos(y / 29) + 3 * np.sin((x + y) / 13)
    lots = [np.floor(v / LOT).astype(int) for v in (x, y)]
    middle = [(lot + 0.5) * LOT for lot in lots]
    built = (lots[0] + 2 * lots[1]) % 5 < 3
    roofed = built & (abs(x - middle[0]) < ROOF) & (abs(y - middle[1]) < ROOF)
    z = np.where(roofed, 35 + 5 * np.sin(lots[0] + lots[1]), z)
    return np.stack([x, y, z], 1) + NOISE * rng.normal(size=(count, 3)) + [500_000, 5_400_000, 300]


def make(path, count):
    """Writes so many points, in strips from west to east."""
    rng = np.random.default_rng(1)
    side = count**0.5
    head = "ply\nformat binary_little_endian 1.0\n"
    head += f"element vertex {count}\n" + "".join(f"property double {c}\n" for c in "xyz") + "end_header\n"
    with open(path, "wb") as out:
        out.write(head.encode())
        for first in range(0, count, CHUNK):
            last = min(first + CHUNK, count)
            strip = part(rng, last - first, side * first / count, side * last / count, side)
            out.write(strip.astype("<f8").tobytes())


def run(*command):
    """Seconds, seconds of the processor and peak memory in bytes of a command."""
    start = time.time()
    child = subprocess.Popen([str(c) for c in command])
    _, status, used = os.wait4(child.pid, 0)
    if status != 0:
        raise SystemExit(f"exit status {status}: {command}")
    return time.time() - start, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--points", type=int, default=4_000_000)
    parser.add_argument("--whole", type=int, default=1_000_000, help="points of the scan in memory")
    parser.add_argument("--tile-points", type=int, default=1_000_000)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)

    print("| | points | seconds | of the processor, for a million | peak memory | rate |")
    print("|---|---|---|---|---|---|", flush=True)
    whole = None
    tiles = ["--tiles", "--tile-points", args.tile_points, "--work", args.work / "tiles"]
    for name, count, more in [("in memory", args.whole, []), ("in tiles", args.points, tiles)]:
        scan = args.work / f"terrain-{count}.ply"
        if not scan.exists():
            make(scan, count)
        surface = args.work / f"surface-{count}.ply"
        command = [args.program, "denoise", scan, "-o", surface, "--no-uv", "--quiet", *more]
        seconds, processor, memory = run(*command)
        rate = count / seconds
        whole = whole or rate
        million = processor / count * 1e6
        peak = f"{memory / 1e9:.2f} GB"
        cells = [name, f"{count:,}", f"{seconds:,.0f}", f"{million:.0f}", peak, f"{rate / whole:.2f}"]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
