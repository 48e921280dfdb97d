"""Fixtures of every folder of tests that runs the built program: a conftest.py imports them."""

import json
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def program():
    """The program: $ATLASFIT, or the newest build under target/."""
    given = os.environ.get("ATLASFIT")
    builds = (
        [pathlib.Path(given)]
        if given
        else [ROOT / "target" / kind / "atlasfit" for kind in ("release", "debug")]
    )
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
