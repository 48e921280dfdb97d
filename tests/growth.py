#!/usr/bin/env python3
"""How the time of unwrap grows with the number of faces on meshes that a sparse factorisation finds hard.
Prints a Markdown table: seconds of processor at each size, and the growth from size to size beside that of n
log n.

    tests/growth.py target/release/atlasfit             # 10,000, 100,000 and 1,000,000 faces; some minutes
    tests/growth.py target/release/atlasfit --sizes 10000,100000

A fan is a disc whose triangles all meet at one vertex of its rim, as CAD programs make caps; a wheel a disc
whose triangles meet at its middle; a strip a band two triangles wide. Exit status 1 where the time of a
larger mesh is more than FACTOR times what n log n says. Needs numpy (memory.py does), and a system that
counts processor time of children.
"""

import argparse
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

import memory

# Share by which the time may grow faster than n log n: caches and memory get slower with size.
FACTOR = 2.0


def rim(n):
    a = 2 * np.pi * np.arange(n) / n
    return np.c_[np.cos(a), np.sin(a), np.zeros(n)]


def fan(n):
    k = np.arange(1, n + 1)
    return rim(n + 2), np.c_[np.zeros(n, int), k, k + 1]


def wheel(n):
    k = np.arange(n)
    return np.r_[rim(n), [[0, 0, 0.0]]], np.c_[np.full(n, n), k, (k + 1) % n]


def strip(n):
    m = n // 2
    k = np.arange(m)
    x = np.arange(m + 1)
    lower, upper = (np.c_[x, np.full(m + 1, y), 0.2 * np.sin(x / 7)] for y in (0.0, 1.0))
    return np.r_[lower, upper], np.r_[np.c_[k, k + 1, k + m + 2], np.c_[k, k + m + 2, k + m + 1]]


def seconds(program, mesh, out):
    """Processor seconds of an unwrap."""
    before = os.times()
    subprocess.run([program, "unwrap", mesh, "-o", out, "--quiet"], check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--sizes", default="10000,100000,1000000")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    sizes = [int(s) for s in options.sizes.split(",")]
    growth = [n * math.log(n) / (m * math.log(m)) for m, n in zip(sizes, sizes[1:])]
    print("| mesh | " + " | ".join(f"{n:,} faces, s" for n in sizes) + " | growth | n log n |")
    print("|---" * (len(sizes) + 3) + "|")
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for make in (fan, wheel, strip):
            if options.only not in make.__name__:
                continue
            taken = [
                seconds(options.program, memory.write_ply(folder / "m.ply", *make(n)), folder / "u.ply")
                for n in sizes
            ]
            grown = [b / a for a, b in zip(taken, taken[1:])]
            wrong += any(g > FACTOR * most for g, most in zip(grown, growth))
            cells = (
                [f"{t:.2f}" for t in taken]
                + [", ".join(f"{g:.1f}" for g in grows) for grows in (grown, growth)]
            )
            print(f"| {make.__name__} | " + " | ".join(cells) + " |", flush=True)
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
