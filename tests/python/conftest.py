"""Shared by the Python tests: the built program, the judges and data beside the repository (skipped where they are absent)."""
import json
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
if (SHARED / "eval").is_dir():
    sys.path.insert(0, str(SHARED / "eval"))


@pytest.fixture(scope="session")
def program():
    """The program: $ATLASFIT, or the newest build under target/."""
    given = os.environ.get("ATLASFIT")
    builds = [pathlib.Path(given)] if given else [ROOT / "target" / kind / "atlasfit" for kind in ("release", "debug")]
    builds = [b for b in builds if b.exists()]
    if not builds:
        pytest.skip("the program is not built: cargo build -p atlasfit-cli")
    return max(builds, key=lambda b: b.stat().st_mtime)


@pytest.fixture(scope="session")
def atlasfit(program):
    """Runs the program with --json and gives its report."""

    def run(*args):
        done = subprocess.run([program, *map(str, args), "--json", "--quiet"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.fixture(scope="session")
def judges():
    """The folder of the independent judges."""
    if not (SHARED / "eval").is_dir():
        pytest.skip("no ../shared/eval beside the repository")
    for module in ("numpy", "scipy", "trimesh", "igl"):
        pytest.importorskip(module)
    return SHARED / "eval"
