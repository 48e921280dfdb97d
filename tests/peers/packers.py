#!/usr/bin/env python3
"""Compares the program's packers on meshes: share of the page covered, and seconds spent packing the same
charts.

usage: packers.py PROGRAM MESH... [--packers shapes,boxes,xatlas] [--rounds 1]
       (PROGRAM: cargo build --release -p atlasfit-cli --features xatlas)

Prints a Markdown table: a line per mesh, then the medians. With several rounds the least seconds count.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile


def measure(program, mesh, packer, rounds, folder):
    runs = []
    for _ in range(rounds):
        command = [program, "unwrap", mesh, "-o", str(folder / "out.ply"), "--packer", packer, "--json"]
        runs.append(json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout))
    last = runs[-1]
    assert last["flips"] == 0 and last["overlapping_faces"] == 0, (mesh, packer)
    return last["charts"], 100 * last["coverage"], min(r["stages"]["packing UV charts"] for r in runs)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program")
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--packers", default="shapes,boxes,xatlas")
    parser.add_argument("--rounds", type=int, default=1)
    args = parser.parse_args()
    packers = args.packers.split(",")
    print("| mesh | charts | " + " | ".join(f"{p}: %, s" for p in packers) + " |")
    print("|---|---:|" + "---:|" * len(packers), flush=True)
    all_runs = {p: [] for p in packers}
    with tempfile.TemporaryDirectory() as folder:
        for mesh in args.meshes:
            cells = []
            for p in packers:
                charts, coverage, seconds = measure(args.program, mesh, p, args.rounds, pathlib.Path(folder))
                all_runs[p].append((charts, coverage, seconds))
                cells.append(f"{coverage:.1f}, {seconds:.2f}")
            print(f"| {pathlib.Path(mesh).stem} | {charts} | " + " | ".join(cells) + " |", flush=True)
    median = [[statistics.median(column) for column in zip(*runs)] for runs in all_runs.values()]
    print(f"| median | {median[0][0]:.0f} | " + " | ".join(f"{c:.1f}, {s:.2f}" for _, c, s in median) + " |")


if __name__ == "__main__":
    main()
