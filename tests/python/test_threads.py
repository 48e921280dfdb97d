"""How many threads the program starts, and what it says where it gets none."""
import os
import pathlib
import subprocess

import memory
import pytest

np = pytest.importorskip("numpy")
resource = pytest.importorskip("resource")
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
# The program's own: one that runs the command, one that reads the file, one that waits for the pool, one that
# listens to Ctrl-C.
OWN = 4
pytestmark = pytest.mark.skipif(
    not pathlib.Path("/proc/self/status").exists(), reason="counts threads in /proc"
)


@pytest.fixture
def scan(tmp_path):
    return memory.write_ply(tmp_path / "scan.ply", memory.ball(20_000))


def most_threads(program, arguments, **environment):
    """The most threads seen, exit status, text on standard error."""
    child = subprocess.Popen(
        [program, *map(str, arguments)], env={**os.environ, **environment}, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True,
    )
    most = 0
    while child.poll() is None:
        try:
            status = pathlib.Path(f"/proc/{child.pid}/status").read_text()
        except OSError:
            break
        most = max(
            [most, *(int(line.split()[1]) for line in status.splitlines() if line.startswith("Threads:"))]
        )
    text = child.communicate()[1]
    return most, child.returncode, text


def test_the_environment_sets_neither_the_number_of_threads_nor_their_stack(program, scan):
    most, status, text = most_threads(program, ["info", scan], RAYON_NUM_THREADS="300", RUST_MIN_STACK="4096")
    assert status == 0, text
    assert most <= CORES + OWN


def test_far_more_threads_than_cores_are_not_started_and_that_is_said(program, scan):
    most, status, text = most_threads(program, ["info", scan, "--threads", "9999"])
    assert status == 0, text
    assert most <= max(4 * CORES, 16) + OWN
    assert text.count("threads are used instead of 9999") == 1, text
    _, status, text = most_threads(program, ["info", scan, "--threads", "1000000"])
    assert status == 2 and "Give 0 (all cores) to 65536" in text, text


def test_a_thread_that_is_not_started_is_an_error_that_says_so(program, tmp_path):
    tiny = memory.write_ply(tmp_path / "tiny.ply", *memory.grid(4))
    seen = []
    # From too little for the program to enough for sixteen stacks. A backtrace of a panic in there once waited
    # for itself.
    for room in range(memory.least_space(program), 64 * memory.MB, memory.MB):
        limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (room,) * 2)
        done = subprocess.run(
            [program, "info", tiny, "--threads", "16", "-q"], preexec_fn=limit, capture_output=True, text=True,
            env={**os.environ, "RUST_BACKTRACE": "1"}, timeout=60,
        )
        seen.append((room, done.returncode, done.stderr.strip()))
        assert memory.judge_space(done.returncode, done.stderr, []) is None, seen[-1]
        assert "report this" not in done.stderr
    assert any("starts no more threads" in text for _, _, text in seen), seen
