"""Shared by the MeshLab tests: the program, small scans and meshes. tests/meshlab/run sets the environment.
"""
import os
import pathlib
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
import made
from no_skips import *  # noqa: F403
from program import atlasfit, program  # noqa: F401


@pytest.fixture(scope="session")
def plugin():
    """The plugin in pymeshlab's MeshLab."""
    import pymeshlab

    path = os.environ.get("ATLASFIT_PLUGIN")
    if not path:
        pytest.skip("ATLASFIT_PLUGIN is not set: run tests/meshlab/run")
    pymeshlab.load_plugin(path)


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
    lines = [
        f"element vertex {len(points)}" if line.startswith("element vertex") else line
        for line in header.splitlines()
    ]
    path = folder / "scan.ply"
    path.write_bytes("\n".join(lines).encode() + b"\n" + points.tobytes())
    return path


@pytest.fixture(scope="session")
def torus():
    """Vertices and triangles of a torus."""
    vertices, quads = made.torus(tube=0.7, ring=2.0)
    return vertices, made.triangles(quads)[0]
