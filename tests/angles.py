#!/usr/bin/env python3
"""How well shaped the triangles of denoised surfaces are: for each scan the share of them with an angle below
20 and below 10 degrees, the triangles for each point, and the median over the scans. Prints a Markdown table.

    tests/angles.py target/release/atlasfit SCAN...
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import trimesh


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("scans", nargs="+", type=pathlib.Path)
    options = parser.parse_args()
    print("| scan | below 20 degrees, % | below 10 degrees, % | triangles for each point |")
    print("|---|---|---|---|")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "surface.ply"
        for scan in options.scans:
            command = [options.program, "denoise", scan, "-o", out, "--no-uv", "--json", "--quiet"]
            report = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
            least = np.degrees(trimesh.load(out, process=False).face_angles.min(axis=1))
            shares = [100 * np.mean(least < limit) for limit in (20, 10)]
            rows.append([*shares, len(least) / report["points"]])
            print(f"| {scan.stem} | " + " | ".join(f"{x:.2f}" for x in rows[-1]) + " |", flush=True)
    print("| median | " + " | ".join(f"{x:.2f}" for x in np.median(rows, axis=0)) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
