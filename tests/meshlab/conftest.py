"""Shared by the MeshLab tests: the program, small scans and meshes. tests/meshlab/run sets the environment."""
import json
import os
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
ATLASFIT = os.environ.get("ATLASFIT", str(ROOT / "target/debug/atlasfit"))


@pytest.fixture(scope="session")
def atlasfit():
    """Runs the program with --json and gives its report."""

    def run(*args):
        done = subprocess.run([ATLASFIT, *map(str, args), "--json", "--quiet"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A folder for the whole session."""
    return tmp_path_factory.mktemp("meshlab")


@pytest.fixture(scope="session")
def scan(folder):
    """A coloured scan of about 4,000 points: every fifth of the example's."""
    raw = (ROOT / "examples/vase.ply").read_bytes()
    end = raw.index(b"end_header\n") + len(b"end_header\n")
    header = raw[:end].decode()
    types = {"float": "<f4", "double": "<f8", "uchar": "u1"}
    properties = [line.split()[1:] for line in header.splitlines() if line.startswith("property")]
    points = np.frombuffer(raw[end:], [(name, types[kind]) for kind, name in properties])[::5]
    lines = [f"element vertex {len(points)}" if line.startswith("element vertex") else line for line in header.splitlines()]
    path = folder / "scan.ply"
    path.write_bytes("\n".join(lines).encode() + b"\n" + points.tobytes())
    return path


@pytest.fixture(scope="session")
def torus():
    """Vertices and triangles of a torus."""
    n, m = 48, 24
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = 2 * np.pi * i / n, 2 * np.pi * j / m
    xyz = np.stack([(2 + 0.7 * np.cos(b)) * np.cos(a), (2 + 0.7 * np.cos(b)) * np.sin(a), 0.7 * np.sin(b)], -1).reshape(-1, 3)
    at = lambda i, j: (i % n) * m + j % m
    quads = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], -1).reshape(-1, 4)
    return xyz, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
