"""How a call runs: progress, cancel, Ctrl-C, the time limit, threads."""

import json
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import atlasfit
import made
import pytest
from made import sphere_points, torus, triangles


def test_progress_is_of_the_whole_call_and_never_falls(sphere):
    seen = []
    atlasfit.denoise(sphere, progress=lambda stage, share: seen.append((stage, share)))
    shares = [share for _, share in seen]
    assert len({stage for stage, _ in seen}) > 1 and shares == sorted(shares)
    assert 0 <= shares[0] < shares[-1] <= 1


def test_a_callback_that_returns_false_cancels(sphere):
    with pytest.raises(atlasfit.Cancelled):
        atlasfit.denoise(sphere, progress=lambda stage, share: False)


def test_what_a_callback_raises_comes_out(sphere):
    def progress(stage, share):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        atlasfit.denoise(sphere, progress=progress)


def test_the_log_is_told_stages_and_why_a_call_fails(sphere, caplog):
    log = logging.getLogger("atlasfit.test")
    with caplog.at_level(logging.INFO, log.name):
        atlasfit.denoise(sphere, log=log.log)
        with pytest.raises(atlasfit.Error) as failed:
            atlasfit.load("no-such-file.ply", log=log.log)
    said = [(r.levelno, r.getMessage()) for r in caplog.records]
    assert (logging.INFO, "fitting charts") in said
    assert said[-1] == (logging.ERROR, str(failed.value))


def test_what_a_log_raises_comes_out(sphere):
    def log(level, line):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        atlasfit.denoise(sphere, log=log)
    # On another thread no Ctrl-C is waited for: the run must end all the same, without a result.
    with ThreadPoolExecutor(1) as threads:
        ended = threads.submit(atlasfit.denoise, sphere, log=log)
    assert isinstance(ended.exception(), KeyError) and atlasfit._abi.lib().atlasfit_live_handles() == 0


def test_the_time_limit(sphere):
    with pytest.raises(atlasfit.TimedOut):
        atlasfit.denoise(sphere, time_limit=1e-4)


def test_results_do_not_depend_on_threads():
    vertices, quads = torus()
    faces, _ = triangles(quads)
    one, two = (atlasfit.unwrap(vertices, faces, threads=t) for t in (1, 2))
    assert one.corner_uv.tobytes() == two.corner_uv.tobytes()


def test_a_token_cancels_from_another_thread_while_python_runs_on(sphere):
    """Also shows that the lock is released: the main thread counts while the library works."""
    token, ended = atlasfit.Cancel(), []
    large = sphere_points(200_000)

    def work():
        try:
            atlasfit.denoise(large, cancel=token)
            ended.append("finished")
        except atlasfit.Cancelled:
            ended.append("cancelled")

    thread = threading.Thread(target=work)
    thread.start()
    turns, until = 0, time.monotonic() + 0.3
    while time.monotonic() < until:
        turns += 1
    asked = time.monotonic()
    token.request()
    thread.join(10)
    assert ended == ["cancelled"] and turns > 1000
    print(f"cancelled after {1000 * (time.monotonic() - asked):.0f} ms")


SCRIPT = """
import sys, time, json, numpy as np, os, signal
# A shell that starts the tests in the background has its children ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path[:0] = json.loads(os.environ["FOLDERS"])
import atlasfit
from made import sphere_points
points = sphere_points(400_000)
print("ready", flush=True)
try:
    atlasfit.denoise(points, **(dict(progress=lambda *a: None) if sys.argv[1] == "progress" else {}))
    print("finished")
except KeyboardInterrupt:
    print("interrupted")
assert atlasfit._abi.lib().atlasfit_live_handles() == 0
"""


@pytest.mark.parametrize("how", ["plain", "progress"])
@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to send")
def test_ctrl_c_ends_the_run(how):
    folders = json.dumps([str(Path(atlasfit.__file__).parents[1]), str(Path(made.__file__).parent)])
    child = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, how],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"FOLDERS": folders},
    )
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    assert (out, err, child.returncode) == ("interrupted\n", "", 0)
