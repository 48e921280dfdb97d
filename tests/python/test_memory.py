"""--max-memory holds in every command: a small part of tests/memory.py."""
import memory
import pytest

np = pytest.importorskip("numpy")


@pytest.fixture
def files(tmp_path):
    made = {name: memory.write_ply(tmp_path / f"{name}.ply", *content) for name, content in {
        "mesh": memory.grid(120), "scan": (memory.ball(4000),), "torn": memory.soup(1000)}.items()}
    made["json"] = tmp_path / "deep.gltf"
    made["json"].write_text(memory.deep_json(600_000))
    return made


@pytest.mark.parametrize("command, file, more, enough", [
    ("unwrap", "mesh", ["-o", "{}/u.ply"], 60),
    ("unwrap", "torn", ["-o", "{}/u.ply"], 60),
    ("denoise", "scan", ["-o", "{}/d.ply", "--points", "{}/p.ply"], 60),
    ("measure", "mesh", [], 60),
    ("info", "mesh", [], 60),
    ("render", "mesh", ["-o", "{}/r.png", "--size", "200x200"], 60),
    ("convert", "mesh", ["{}/c.glb"], 60),
    ("convert", "json", ["{}/c.ply"], None),
])
def test_a_limit_is_kept_or_the_run_is_refused_before_it_works(
    program, files, tmp_path, command, file, more, enough
):
    arguments = [command, files[file], *(m.format(tmp_path) for m in more), "--threads", "2"]
    outcomes = []
    for limit in (memory.MB, 40 * memory.MB, *([enough * memory.MB] if enough else [])):
        peak, _, status, text = memory.run(program, arguments, limit)
        assert memory.judge(peak, status, text, limit) is None
        outcomes.append(status)
        assert status == 0 or not list(tmp_path.glob("[udprc].*"))
    assert outcomes[0] == 1
    assert enough is None or outcomes[-1] == 0, "a limit far above what is needed is enough"


@pytest.mark.parametrize("command, file, more", [
    ("denoise", "scan", ["-o", "{}/d.ply", "--points", "{}/p.ply"]),
    ("unwrap", "mesh", ["-o", "{}/u.ply"]),
    ("unwrap", "painted", ["-o", "{}/u.glb", "--bake", "--texture-size", "512"]),
    ("convert", "mesh", ["{}/c.glb"]),
    ("convert", "painted", ["{}/c.glb"]),
    ("render", "mesh", ["-o", "{}/r.png", "--size", "300x300"]),
    ("measure", "mesh", []),
])
def test_under_any_limit_of_address_space_a_run_ends_well_or_with_an_error(
    program, files, tmp_path, command, file, more
):
    pytest.importorskip("resource")
    at, faces = memory.grid(60)
    files["painted"] = tmp_path / "painted.obj"
    files["painted"].write_text(
        "".join(f"v {x} {y} {z} 0.5 {x} 1\n" for x, y, z in at)
        + "".join("f {} {} {}\n".format(*t) for t in faces + 1)
    )
    out = tmp_path / "out"
    out.mkdir()
    arguments = [command, files[file], *(m.format(out) for m in more), "--threads", "1"]
    enough = []
    least = memory.least_space(program) // memory.MB
    for space in (least, 36, 60, 100, 200, 400, 1000):
        for left in out.iterdir():
            left.unlink()
        _, _, status, text = memory.run(program, arguments, space=space * memory.MB)
        assert memory.judge_space(status, text, list(out.iterdir())) is None, f"{space} MB of address space"
        enough.append(status == 0)
    assert not enough[0] and enough[-1]


@pytest.mark.parametrize("command, more", [("unwrap", ["-o", "{}/u.ply"]), ("info", []), ("measure", [])])
def test_where_the_system_gives_no_memory_the_run_ends_with_an_error(program, files, tmp_path, command, more):
    resource = pytest.importorskip("resource")
    import subprocess

    big = memory.write_ply(tmp_path / "big.ply", *memory.grid(600))
    # Room for the program and its threads, not for the work.
    room = lambda: resource.setrlimit(resource.RLIMIT_AS, (56 << 20,) * 2)
    done = subprocess.run(
        [program, command, big, *(m.format(tmp_path) for m in more), "--threads", "1", "-q"],
        preexec_fn=room,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1 and "out of memory" in done.stderr, (done.returncode, done.stderr)
