"""Scans in tiles: results do not depend on the tiles, killed runs go on, files come back with all they hold;
engines finish what they can and name the rest."""

import importlib.util
import json
import os
import random
import signal
import stat
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "blender-addon"))
SPACING = 1.0


def terrain(n=14000, seed=1):
    """Hills with two flat roofs above them, far from the origin; noise of a tenth of the spacing of 1."""
    rng = np.random.default_rng(seed)
    x, y = rng.random((2, n)) * n**0.5
    z = 6 * np.sin(x / 37) + 5 * np.cos(y / 29) + 2 * np.sin((x + y) / 13)
    for a, b in [(30, 40), (60, 85)]:
        z = np.where((abs(x - a) < 12) & (abs(y - b) < 12), 25, z)
    p = np.stack([x, y, z], 1) + 0.1 * rng.normal(size=(n, 3))
    return p + [500000, 5400000, 300]


TYPES = {"double": "<f8", "float": "<f4", "uchar": "u1", "int": "<i4"}


def write_ply(path, points, **more):
    columns = [(k, "double", points[:, i]) for i, k in enumerate("xyz")]
    columns += [(k, "uchar" if v.dtype == np.uint8 else "double", v) for k, v in more.items()]
    rows = np.zeros(len(points), [(n, TYPES[t]) for n, t, _ in columns])
    for name, _, values in columns:
        rows[name] = values
    head = "".join(f"property {t} {n}\n" for n, t, _ in columns)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{head}end_header\n"
    path.write_bytes(head.encode() + rows.tobytes())
    return path


def read_ply(path):
    data = path.read_bytes()
    head, rest = data.split(b"end_header\n", 1)
    fields, count = [], 0
    for line in head.decode().splitlines():
        words = line.split()
        if words[:2] == ["element", "vertex"]:
            count = int(words[2])
        elif words[0] == "element":
            break
        elif words[0] == "property":
            fields.append((words[2], TYPES[words[1]]))
    rows = np.frombuffer(rest, fields, count)
    return rows, np.stack([rows[k] for k in "xyz"], 1)


def start(program, *args, **how):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([program, *map(str, args), "--quiet"], **pipes, **how)


def fails(program, *args):
    done = start(program, *args)
    told = done.communicate()[1]
    assert done.returncode == 1, told
    return told


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    points = terrain()
    red = (np.arange(len(points)) % 256).astype(np.uint8)
    more = {"red": red, "green": red // 2, "blue": red // 3, "gps_time": np.arange(len(points)) * 1e-3}
    return write_ply(tmp_path_factory.mktemp("scan") / "scan.ply", points, **more)


@pytest.fixture(scope="module")
def whole(scan, atlasfit, tmp_path_factory):
    """The scan denoised at once."""
    out = tmp_path_factory.mktemp("whole")
    report = atlasfit(
        "denoise", scan, "-o", out / "s.ply", "--points", out / "p.ply", "--no-uv", "--max-error", 0
    )
    return report, out


@pytest.mark.parametrize("size", [20000, 5000, 2500])
def test_the_result_is_that_of_the_whole_for_any_size_of_the_tiles(scan, whole, atlasfit, size, tmp_path):
    report, at_once = whole
    in_tiles = atlasfit(
        *("denoise", scan, "-o", tmp_path / "s.ply", "--points", tmp_path / "p", "--tile-points", size),
        *("--no-uv", "--max-error", 0),
    )
    assert in_tiles["tiles"] == {20000: 1, 5000: 4, 2500: 8}[size] and in_tiles["surface"]["cracks"] == 0
    found = atlasfit("measure", tmp_path / "s.ply", "--against", at_once / "s.ply")
    topology, distance = found["topology"], found["surface"]
    for name in ("parts", "boundary_loops"):
        assert topology[name] == report[name] == in_tiles["surface"][name], name
    # No crack, no edge of three triangles, all facing alike: tiles share their vertices bit by bit.
    assert topology["non_manifold_edges"] == topology["inconsistent_edges"] == 0
    # Within, the surface is the same to the step of the grid that vertices lie on. The scan's borders, which
    # are decided along all of their length, are off by no more than a border may be put off the data.
    for way in ("accuracy", "completeness"):
        assert distance[way]["p95"] < 1e-3 * SPACING and distance[way]["max"] < 2 * SPACING
    _, one = read_ply(at_once / "s.ply")
    _, other = read_ply(tmp_path / "s.ply")
    apart = np.concatenate([cKDTree(one).query(other)[0], cKDTree(other).query(one)[0]])
    assert (apart > 0.1 * SPACING).mean() < 0.01
    # Points go where they go in the whole, row by row, and keep all else.
    before, _ = read_ply(scan)
    after, moved = read_ply(tmp_path / "p" / "0000-scan.ply")
    _, expected = read_ply(at_once / "p.ply")
    assert np.abs(moved - expected).max() < 0.1 * SPACING
    assert np.quantile(np.abs(moved - expected), 0.99) < 1e-9
    assert all((before[k] == after[k]).all() for k in before.dtype.names if k not in "xyz")


def test_a_killed_run_goes_on_and_gives_the_same_bytes(scan, program, tmp_path):
    def command(name):
        out = tmp_path / name
        return ("denoise", scan, "-o", out / "s.ply", "--points", out / "p", "--tileset", out / "t") + (
            *("--tile-points", 5000, "--work", out / "work", "--no-uv"),
        )

    begun = time.monotonic()
    assert start(program, *command("a")).wait() == 0
    seconds = time.monotonic() - begun
    rng = random.Random(1)
    (tmp_path / "b").mkdir()
    killed = 0
    for _ in range(20):
        run = start(program, *command("b"))
        try:
            run.wait(rng.uniform(0, 0.15) * seconds)
        except subprocess.TimeoutExpired:
            run.send_signal(signal.SIGKILL)
            run.wait()
            killed += 1
    print(f"killed {killed} times; undisturbed it takes {seconds:.1f} s")
    assert start(program, *command("b")).wait() == 0
    results = lambda name: {
        str(f.relative_to(tmp_path / name)): f.read_bytes()
        for f in sorted((tmp_path / name).rglob("*"))
        if f.is_file() and "work" not in f.parts
    }
    a, b = results("a"), results("b")
    assert a.keys() == b.keys() and len(a) > 5
    assert all(a[name] == b[name] for name in a)
    assert not list((tmp_path / "b").rglob("*.part"))


def test_the_tileset_names_files_that_meet_bit_by_bit(scan, program, atlasfit, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    assert start(program, "denoise", scan, "--tileset", tmp_path / "t", "--tile-points", 8000).wait() == 0
    tileset = json.loads((tmp_path / "t" / "tileset.json").read_text())
    assert tileset["asset"]["version"] == "1.1"
    root = tileset["root"]
    levels = {}
    for child in root["children"]:
        place = np.add(root["transform"][12:15], child["transform"][12:15])
        node, errors = child, []
        while node:
            mesh = trimesh.load(tmp_path / "t" / node["content"]["uri"], process=False, force="mesh")
            assert mesh.visual.uv is not None and mesh.visual.material.baseColorTexture is not None
            # y is up within a file.
            at = np.asarray(mesh.vertices, float)[:, [0, 2, 1]] * [1, -1, 1] + place
            levels.setdefault(len(errors), []).append({tuple(p) for p in at})
            errors.append(node["geometricError"])
            node = node.get("children", [None])[0]
        assert errors == sorted(errors, reverse=True) and errors[-1] == 0
    # Two tiles: vertices where they meet are equal on every level, so that levels may stand side by side.
    shared = [a & b for a, b in levels.values()]
    assert len(shared[0]) > 50 and all(shared[0] == s for s in shared)


def las(path, points, crs=b"one", scale=0.001, formats=1):
    """LAS 1.2 with GPS time and a record that says what the coordinates mean."""
    vlr = struct.pack("<H16sHH32s", 0, b"LASF_Projection", 2112, len(crs), b"") + crs
    offset = [500000.0, 5400000.0, 0.0]
    head = bytearray(227)
    head[:4], head[24:26] = b"LASF", bytes([1, 2])
    struct.pack_into("<HIIBHI", head, 94, 227, 227 + len(vlr), 1, formats, 28, len(points))
    struct.pack_into("<6d", head, 131, *[scale] * 3, *offset)
    rows = np.zeros(len(points), [("xyz", "<i4", 3), ("i", "<u2"), ("rest", "u1", 6), ("gps", "<f8")])
    rows["xyz"] = np.round((points - offset) / scale)
    rows["i"], rows["gps"] = np.arange(len(points)) % 60000, np.arange(len(points)) * 0.5
    path.write_bytes(bytes(head) + vlr + rows.tobytes())
    return path


def las_rows(path):
    data = path.read_bytes()
    start_of_points = struct.unpack_from("<I", data, 96)[0]
    types = [("xyz", "<i4", 3), ("i", "<u2"), ("rest", "u1", 6), ("gps", "<f8")]
    return data, np.frombuffer(data[start_of_points:], types)


def test_las_files_come_back_in_their_order_with_time_and_coordinate_system(atlasfit, tmp_path):
    points = terrain(9000)
    left = points[:, 0] < 500050
    # The strip between 45 and 50 is in both files: the same points twice.
    both = points[:, 0] > 500045
    files = [las(tmp_path / "a.las", points[left]), las(tmp_path / "b.las", points[~left | both])]
    report = atlasfit("denoise", *files, "--points", tmp_path / "p", "--tile-points", 3000)
    assert report["points"] == left.sum() + (~left | both).sum()
    moved = []
    for k, name in enumerate("ab"):
        (old, before), (new, after) = las_rows(files[k]), las_rows(tmp_path / "p" / f"000{k}-{name}.las")
        assert (before["gps"] == after["gps"]).all() and (before["i"] == after["i"]).all()
        # The header is the same but for the extent.
        assert old[:179] == new[:179] and old[227:284] == new[227:284]
        off = (after["xyz"] - before["xyz"]) * 0.001
        assert 0.03 < off.std() < 0.1 and np.abs(off).max() < 1
        moved.append(after["xyz"])
    # Points that both files have went the same way.
    assert len(np.intersect1d(*[m.copy().view("i4,i4,i4").ravel() for m in moved])) == (left & both).sum()


def test_input_that_does_not_fit_is_refused_in_words(program, tmp_path):
    points = terrain(3000)
    a, b = las(tmp_path / "a.las", points), las(tmp_path / "b.las", points, crs=b"two")
    run = lambda *scans: fails(program, "denoise", *scans, "-o", tmp_path / "s.ply", "--tiles")
    assert "different coordinate systems" in run(a, b)
    assert "named twice" in run(a, a)
    assert "no points" in run(write_ply(tmp_path / "none.ply", np.zeros((0, 3))))
    cut = tmp_path / "cut.las"
    cut.write_bytes(a.read_bytes()[:-1000])
    assert "ends before the last point" in run(cut)
    assert "cannot" in run(tmp_path / "missing.las")
    plan = ("tiles", "plan", a, "-o", tmp_path / "t.ply", "--points", tmp_path / "p")
    assert start(program, *plan, "--work", tmp_path / "w").wait() == 0
    a.write_bytes(a.read_bytes() + b"more")
    assert "was changed since" in fails(program, "tiles", "run", tmp_path / "w")
    a.unlink()
    assert "a.las" in fails(program, "tiles", "run", tmp_path / "w")


def test_one_point_far_away_and_points_that_are_not_finite_do_no_harm(atlasfit, tmp_path):
    points = terrain(6000)
    odd = np.vstack([points[:10], [[5e8, 5400000, 300]], points[10:], [[np.nan, 0, 0]]])
    file = write_ply(tmp_path / "far.ply", odd)
    report = atlasfit(
        *("denoise", file, "-o", tmp_path / "s.ply", "--points", tmp_path / "p", "--tile-points", 2000)
    )
    assert report["tiles"] < 10 and report["not_finite"] == 1 and report["surface"]["parts"] == 3
    _, moved = read_ply(tmp_path / "p" / "0000-far.ply")
    assert (moved[10] == odd[10]).all() and np.isnan(moved[-1][0])
    assert np.abs(moved[20:-1] - odd[20:-1]).max() < 2 * SPACING


@pytest.fixture()
def planned(scan, program, tmp_path):
    """A plan of four tiles, not run yet."""
    out = ("-o", tmp_path / "s.ply", "--points", tmp_path / "p", "--tile-points", 5000, "--no-uv")
    assert start(program, "tiles", "plan", scan, *out, "--work", tmp_path / "work").wait() == 0
    return tmp_path / "work"


def engine(*args, **env):
    command = [sys.executable, "-m", "atlasfit.tiles", *map(str, args)]
    env = {**os.environ, "PYTHONPATH": str(ROOT / "blender-addon"), **env}
    return subprocess.run(command, capture_output=True, text=True, env=env)


def test_tasks_run_side_by_side_and_the_status_says_how_far_they_are(planned, program, atlasfit, tmp_path):
    before = atlasfit("tiles", "status", planned)
    assert before["done"] == 0 and before["tasks"] == 11 and len(before["missing"]) > 11
    done = engine("run", planned, "--engine", "local", "--workers", 2, "--program", program)
    assert done.returncode == 0, done.stderr
    after = atlasfit("tiles", "status", planned)
    assert after["done"] == 11 and not after["missing"] and not after["failed"]
    one = atlasfit("tiles", "plan", planned, "--simulate", 1)
    two = atlasfit("tiles", "plan", planned, "--simulate", 2)
    assert one["measured"] and one["busy"] > 0.99 and one["seconds"] > 1.2 * two["seconds"]


def wrapper(path, program, body):
    """A program that does `body` first."""
    path.write_text(f"#!/bin/sh\n{body}\nexec {program} \"$@\"\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.mark.parametrize("trouble", ["killed", "full"])
def test_a_task_that_fails_is_named_and_the_next_run_does_the_rest(planned, program, trouble, tmp_path):
    # As the system kills where memory is short; as a disk that takes no more.
    body = {"killed": "kill -9 $$", "full": "trap '' XFSZ; ulimit -f 200"}[trouble]
    body = f'case "$*" in *tile-000002*) {body};; esac'
    bad = wrapper(tmp_path / "bad", program, body)
    run = engine("run", planned, "--engine", "local", "--workers", 2, "--program", bad)
    assert run.returncode == 1
    assert {"killed": "tile-000002: ended by signal 9", "full": "cannot write it"}[trouble] in run.stderr
    assert f"missing: {tmp_path / 's.ply'}" in run.stderr
    assert not (tmp_path / "s.ply").exists() and (planned / "tiles" / "000003.mesh").exists()
    done = engine("run", planned, "--engine", "local", "--program", program)
    assert done.returncode == 0 and (tmp_path / "s.ply").exists(), done.stderr
    assert not list(tmp_path.rglob("*.part"))


def test_slurm_gets_an_array_job_for_each_step(planned, program, atlasfit, tmp_path):
    written = engine("run", planned, "--engine", "slurm", "--program", program, "--sbatch", "-p long")
    script = Path(written.stdout.strip())
    # What Slurm would do, at once.
    fake = tmp_path / "bin" / "sbatch"
    fake.parent.mkdir()
    fake.write_text(
        "#!/bin/sh\necho \"$*\" >> \"$LOG\"\nfor a; do case $a in --array=1-*) n=${a#--array=1-};; esac; "
        "command=$a; done\nfor i in $(seq $n); do SLURM_ARRAY_TASK_ID=$i sh -c \"$command\" >&2; done\n"
        "echo 7\n"
    )
    fake.chmod(0o755)
    log = tmp_path / "log"
    env = {**os.environ, "PATH": f"{fake.parent}:{os.environ['PATH']}", "LOG": str(log)}
    subprocess.run(["sh", script], env=env, check=True, capture_output=True)
    jobs = log.read_text().splitlines()
    assert len(jobs) == 4 and "--array=1-4 " in jobs[0] and all("-p long" in j for j in jobs)
    assert "--dependency=afterany:7" in jobs[1] and (tmp_path / "s.ply").exists()
    assert not atlasfit("tiles", "status", planned)["missing"]


def test_dask_finishes_though_a_worker_is_killed(planned, program, tmp_path):
    distributed = pytest.importorskip("distributed")
    from atlasfit import tiles

    # Tasks wait until they may go on, so that there is one to kill.
    gate = tmp_path / "gate"
    slow = wrapper(tmp_path / "slow", program, f"while [ ! -e {gate} ]; do sleep 0.05; done")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())
        tasks = tiles.plan_tasks(str(planned))
        import threading

        def kill():
            while not any(client.processing().values()):
                time.sleep(0.05)
            os.kill(pids[0], signal.SIGKILL)
            gate.touch()

        killer = threading.Thread(target=kill)
        killer.start()
        failed = tiles.dask_on(client, tiles.left(tasks), str(slow), 1)
        killer.join()
    assert not failed and (tmp_path / "s.ply").exists()
    assert not list(tmp_path.rglob("*.part"))


# Ray is not in tests/requirements.txt, as it is 70 MB: where it is installed, it is tested.
if importlib.util.find_spec("ray"):

    def test_ray_runs_a_plan(planned, program, tmp_path):
        done = engine("run", planned, "--engine", "ray", "--workers", 2, "--program", program)
        assert done.returncode == 0 and (tmp_path / "s.ply").exists(), done.stderr


def test_an_engine_that_is_not_installed_is_named(planned, program, tmp_path):
    for name, package in [("dask", "distributed"), ("ray", "ray")]:
        hidden = tmp_path / name
        hidden.mkdir()
        (hidden / f"{package}.py").write_text("raise ImportError('hidden')")
        path = f"{hidden}:{ROOT / 'blender-addon'}"
        done = engine("run", planned, "--engine", name, "--program", program, PYTHONPATH=path)
        assert done.returncode == 1 and f"pip install {package}" in done.stderr


def test_a_batch_names_what_failed_and_does_the_rest(program, tmp_path):
    scans, out = tmp_path / "scans", tmp_path / "out"
    scans.mkdir()
    for k in range(2):
        write_ply(scans / f"{k}.ply", terrain(1500, seed=k))
    (scans / "bad.ply").write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n")
    run = start(program, "batch", scans, "-o", out, "--no-uv")
    told, error = run.communicate()
    lines = [json.loads(line) for line in told.splitlines()]
    assert run.returncode == 1 and "1 of 3 scans failed" in error and "bad.ply" in error
    assert [Path(line["scan"]).name for line in lines] == ["0.ply", "1.ply", "bad.ply"]
    assert all("parts" in line for line in lines[:2]) and lines[2]["error"]["text"]
    assert sorted(f.name for f in out.iterdir()) == ["0.ply.glb", "1.ply.glb"]
    (scans / "bad.ply").unlink()
    again = engine("batch", scans, "-o", out, "--program", program, "--options=--no-uv")
    assert again.returncode == 0 and "2 of 2" in again.stdout, again.stderr


def test_the_surface_with_fewer_triangles_has_no_cracks_either(scan, whole, program, atlasfit, tmp_path):
    """The lighter surface, as it is written by default, is near the points and without cracks, too."""
    out = ("-o", tmp_path / "s.ply", "--points", tmp_path / "p", "--tile-points", 5000)
    assert start(program, "denoise", scan, *out, "--no-uv").wait() == 0
    _, vertices = read_ply(tmp_path / "s.ply")
    _, points = read_ply(tmp_path / "p" / "0000-scan.ply")
    away = cKDTree(vertices).query(points)[0]
    assert np.quantile(away, 0.95) < 2 * SPACING
    topology = atlasfit("measure", tmp_path / "s.ply")["topology"]
    assert topology["non_manifold_edges"] == topology["inconsistent_edges"] == 0
    assert all(topology[name] == whole[0][name] for name in ("parts", "boundary_loops"))
