"""The package beside this folder, over the library that ATLASFIT_LIBRARY names or that cargo built last."""

import gc
import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "blender-addon"), str(ROOT / "tests")]
from no_skips import *  # noqa: E402, F403

if "ATLASFIT_LIBRARY" not in os.environ:
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    built = sorted(target.glob("*/*atlasfit_capi.[sd][oyl]*"), key=lambda p: p.stat().st_mtime)
    if not built:
        pytest.exit(
            "no library: run `cargo build --release -p atlasfit-capi`, or let ATLASFIT_LIBRARY name it", 2
        )
    os.environ["ATLASFIT_LIBRARY"] = str(built[-1])

from atlasfit import _abi  # noqa: E402
from made import sphere_points  # noqa: E402


@pytest.fixture(autouse=True)
def no_handle_is_left():
    gc.collect()
    before = _abi.lib().atlasfit_live_handles()
    yield
    gc.collect()
    assert _abi.lib().atlasfit_live_handles() <= before


@pytest.fixture(scope="module")
def sphere():
    return sphere_points()
