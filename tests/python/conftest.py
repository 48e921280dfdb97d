"""Shared by the Python tests: the built program, the judges and data beside the repository (skipped where
they are absent).
"""
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from no_skips import *  # noqa: F403
from program import atlasfit, program  # noqa: F401

SHARED = ROOT.parent / "shared"
if (SHARED / "eval").is_dir():
    sys.path.insert(0, str(SHARED / "eval"))


@pytest.fixture(scope="session")
def judges():
    """The folder of the independent judges."""
    if not (SHARED / "eval").is_dir():
        pytest.skip("no ../shared/eval beside the repository")
    for module in ("numpy", "scipy", "trimesh", "igl"):
        pytest.importorskip(module)
    return SHARED / "eval"
