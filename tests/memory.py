#!/usr/bin/env python3
"""Does --max-memory hold? Runs the program on meshes and scans under limits and prints a table: command,
input, threads, limit, accepted or refused, peak resident memory, seconds, what the refusal says. An accepted
run may peak at 1.1 times its limit + 30 MB (the program itself and what the system keeps of freed memory); a
refused one ends with status 1 and says how much is needed, before any work.

    tests/memory.py target/release/atlasfit --data ../shared/data             # all; about half an hour on
                                                                                two cores
    tests/memory.py target/release/atlasfit --only unwrap --limits 50M,300M   # a part
    tests/memory.py target/release/atlasfit --measure                         # peaks without a limit
    tests/memory.py target/release/atlasfit --address-space                   # ulimit -v instead of
                                                                                --max-memory

With --address-space the system itself gives no more (limits from the least that the program
starts in up, in steps of a tenth, until two in a row are enough): a run then ends with an output, or with
status 1, "out of memory" (or that no thread can be started), and no output; never by a signal.

The constants in rust/atlasfit/src/{unwrap,pipeline,measure}/memory.rs, bake and the program's info and render
were fitted by hand to such peaks. tests/python/test_memory.py runs a small case of this in CI.
"""

import argparse
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np

MB = 1 << 20
FACTOR, SLACK = 1.1, 30 * MB
UNITS = {"": 1, "K": 1 << 10, "M": MB, "G": 1 << 30}


def size(text):
    number, unit = re.fullmatch(r"([\d.]+)([KMG]?)", text).groups()
    return int(float(number) * UNITS[unit])


def write_ply(path, points, faces=None):
    """Binary PLY with single-precision positions, and triangles if there are any."""
    head = (
        ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
        + [f"property float {c}" for c in "xyz"]
    )
    if faces is not None:
        head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    with open(path, "wb") as out:
        out.write(("\n".join(head) + "\nend_header\n").encode())
        out.write(np.asarray(points, "<f4").tobytes())
        if faces is not None:
            rows = np.zeros(len(faces), [("n", "u1"), ("v", "<i4", 3)])
            rows["n"], rows["v"] = 3, faces
            out.write(rows.tobytes())
    return path


def grid(n):
    """A wavy sheet of n by n vertices."""
    i = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2)
    at = np.c_[i / n, 0.05 * np.sin(i[:, 0] / 9) * np.cos(i[:, 1] / 13)]
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    return at, np.r_[np.c_[a, b, c], np.c_[a, c, d]]


def soup(n):
    """Triangles that share no vertices: each is a chart of its own."""
    rng = np.random.default_rng(1)
    at = rng.random((n, 1, 3)) + 0.01 * rng.normal(size=(n, 3, 3))
    return at.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)


def ball(n):
    """Points of a bumpy ball with noise."""
    rng = np.random.default_rng(1)
    p = rng.normal(size=(n, 3))
    p /= np.linalg.norm(p, axis=1)[:, None]
    return p * (1 + 0.2 * np.sin(6 * p[:, :1]) * np.cos(5 * p[:, 1:2]) + 0.003 * rng.normal(size=(n, 1)))


def deep_json(n):
    """A glTF file whose JSON takes many times its bytes in memory once it is read."""
    return '{"asset":{"version":"2.0"},"extras":[' + ",".join(['{"a":[1]}'] * n) + "]}"


# A new process is charged with the memory of the one that started it: this small one stands between, and
# tells the peak on its output.
LAUNCH = """
import os, sys
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, 2, 1)])
_, status, used = os.wait4(child, 0)
print(used.ru_maxrss, os.waitstatus_to_exitcode(status))
"""


def run(program, args, limit=None, space=None):
    """Peak bytes, seconds, exit status, text on standard error. `limit` is --max-memory, `space` bytes of
    address space.
    """
    command = [str(program), *map(str, args), "--quiet", *(["--max-memory", str(limit)] if limit else [])]
    if space:
        command = ["/bin/sh", "-c", 'ulimit -v "$0" && exec "$@"', str(space >> 10), *command]
    started = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", LAUNCH, *command], capture_output=True, text=True, errors="replace"
    )
    kilobytes, status = map(int, done.stdout.split())
    return kilobytes * 1024, time.monotonic() - started, status, done.stderr.strip()


def is_over(text):
    """Whether a run was accepted and ended by its time limit: the networks take minutes, and their peak is
    reached in seconds.
    """
    return "time limit" in text


def judge(peak, status, text, limit):
    """What is wrong with a run under a limit; nothing if all is well."""
    if peak > FACTOR * limit + SLACK:
        return f"peak of {peak / MB:.0f} MB under a limit of {limit / MB:.0f} MB"
    if status != 0 and not (status == 1 and ("more than the limit" in text or is_over(text))):
        return f"exit status {status}: {text}"
    return None


def judge_space(status, text, outputs):
    """What is wrong with a run that the system gave too little memory; nothing if all is well."""
    if status == 0:
        return None
    told = "out of memory" in text or "start" in text and "thread" in text
    if status != 1 or not told:
        return f"exit status {status}: {text[-200:]}"
    return f"{outputs[0].name} was left" if outputs else None


def least_space(program):
    """Bytes of address space, in whole MB, in which the program starts at all: it says its version. In less
    the system ends it before it can say anything.
    """
    starts = lambda space: run(program, ["--version"], space=space)[2] == 0
    return next(filter(starts, range(MB, 1000 * MB, MB)))


def sweep(program, arguments, out, most=4096 * MB):
    """Runs in more and more address space until two runs in a row succeed; what went wrong, and the limits
    that were enough.
    """
    space, enough, wrong = least_space(program), [], []
    while space < most and enough[-2:] != [1, 1]:
        for file in out.iterdir():
            file.unlink()
        _, _, status, text = run(program, arguments, space=space)
        problem = judge_space(status, text, list(out.iterdir()))
        if problem:
            wrong.append(f"{space / MB:.0f} MB: {problem}")
        enough.append(int(status == 0))
        space = space * 11 // 10
    return wrong, enough


def write_pcd(path, points):
    """Binary PCD."""
    head = f"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\n"
    head += f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
    path.write_bytes(head.encode() + np.asarray(points, "<f4").tobytes())
    return path


def write_las(path, points):
    """LAS 1.2, point format 0, in steps of a tenth of a millimetre."""
    steps = np.round(np.asarray(points) * 1e4).astype("<i4")
    low, high = steps.min(0) * 1e-4, steps.max(0) * 1e-4
    head = struct.pack(
        "<4sHHI12xBB32s32sHHHIIBHI20x", b"LASF", 0, 0, 0, 1, 2, b"", b"", 1, 2026, 227, 227, 0, 0, 20,
        len(points),
    )
    head += struct.pack("<6d", *[1e-4] * 3, *[0.0] * 3) + np.c_[high, low].astype("<f8").tobytes()
    rows = np.zeros((len(points), 20), "u1")
    rows[:, :12] = steps.view("u1").reshape(-1, 12)
    path.write_bytes(head + rows.tobytes())
    return path


def formats(program, folder, mesh, points, at):
    """(command, file, further arguments) for a mesh and points in each format that is written or read. `at`
    are the points' positions.
    """
    for file, kinds in ((mesh, ("stl", "off", "obj", "glb")), (points, ("xyz",))):
        for kind in kinds:
            made = folder / f"{file.stem}.{kind}"
            yield "convert", file, ["{out}/c." + kind]
            subprocess.run([program, "convert", file, made, "--quiet"], check=True)
            yield "convert", made, ["{out}/c.ply"]
    yield "convert", write_pcd(folder / f"{points.stem}.pcd", at), ["{out}/c.ply"]
    yield "convert", write_las(folder / f"{points.stem}.las", at), ["{out}/c.ply"]


def cases(program, folder, data):
    """(command, file, further arguments). {out} is a folder for outputs."""
    made = lambda name, *content: write_ply(folder / name, *content)
    small, large = made("grid80k.ply", *grid(200)), made("grid977k.ply", *grid(700))
    torn, scan, many = (
        made("soup50k.ply", *soup(50_000)),
        made("ball100k.ply", ball(100_000)),
        made("ball1m.ply", ball(1_000_000)),
    )
    json = folder / "deep.gltf"
    json.write_text(deep_json(1_500_000))
    shared = [data / p for p in ("denoise/dragon.ply", "uv/dragon_500k.ply")] if data else []
    scans = (
        [data / p for p in ("scans/table_kinect.ply", "scans/rabbit_scan.ply", "torture/outl20.ply")]
        if data
        else []
    )
    for mesh in [small, torn, large, *shared]:
        yield "unwrap", mesh, ["-o", "{out}/u.ply"]
        yield "simplify", mesh, ["-o", "{out}/s.ply", "--faces", "1000"]
        yield "simplify", mesh, ["-o", "{out}/s.ply", "--max-error", "1e-6"]
        yield "info", mesh, []
        yield "measure", mesh, []
        yield "render", mesh, ["-o", "{out}/r.png"]
        yield "convert", mesh, ["{out}/c.glb"]
    if data:
        yield "unwrap", data / "uv/face.ply", ["-o", "{out}/u.ply", "--max-energy", "4.1"]
    yield from formats(program, folder, small, scan, ball(100_000))
    yield "measure", small, ["--against", large]
    yield "measure", small, ["--against", small, "--samples", "2000000"]
    yield "measure", many, ["--against", small]
    yield "render", small, ["-o", "{out}/r.png", "--size", "4000x4000"]
    yield "convert", json, ["{out}/c.ply"]
    for prior in ("level-set", "conv", "mlp"):
        yield "denoise", scan, ["-o", "{out}/d.ply", "--prior", prior, "--time-limit", "10"]
    for points in [scan, *scans, many]:
        yield "denoise", points, ["--points", "{out}/p.ply"]
        yield "denoise", points, ["-o", "{out}/d.ply"]
        yield "info", points, []
        yield "convert", points, ["{out}/c.xyz"]
    for points in [scan, *scans]:
        yield "denoise", points, ["-o", "{out}/d.ply", "--watertight"]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--data", type=pathlib.Path, help="folder of the shared meshes and scans")
    parser.add_argument("--only", default="", help="cases whose line holds this word")
    parser.add_argument("--limits", default="20M,50M,100M,200M,400M,800M,1600M")
    parser.add_argument("--threads", default="1,8")
    parser.add_argument("--measure", action="store_true", help="no limits: peaks only")
    parser.add_argument(
        "--address-space", action="store_true", help="limits by the system, not by --max-memory"
    )
    options = parser.parse_args()
    limits = [None] if options.measure else [size(s) for s in options.limits.split(",")]
    print(
        f"{'command':9}{'input':20}{'threads':>8}{'limit MB':>10}  "
        f"{'outcome':9}{'peak MB':>8}{'seconds':>9}  {'says'}"
    )
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for command, file, more in cases(options.program, folder, options.data):
            if options.only not in " ".join(map(str, [command, file.name, *more])):
                continue
            for threads in options.threads.split(","):
                out = folder / "out"
                out.mkdir(exist_ok=True)
                arguments = [command, file, *(str(a).format(out=out) for a in more), "--threads", threads]
                if options.address_space:
                    problems, enough = sweep(options.program, arguments, out)
                    wrong += len(problems)
                    print(
                        f"{command:9}{file.name:20}{threads:>4} threads: "
                        f"{len(enough)} limits, {sum(enough)} enough",
                        *problems,
                        sep="\n  ",
                        flush=True,
                    )
                    continue
                for limit in limits:
                    peak, seconds, status, text = run(options.program, arguments, limit)
                    problem = judge(peak, status, text, limit) if limit else (text if status else None)
                    wrong += problem is not None
                    accepted = status == 0 or is_over(text)
                    outcome = "WRONG" if problem else "accepted" if accepted else "refused"
                    says = problem or (
                        text.split("needs about ")[-1].split(" of memory")[0] if not accepted else ""
                    )
                    told = f"{limit / MB:.0f}" if limit else "none"
                    name = " ".join(
                        [file.name, *(str(m) for m in more if "{out}" not in str(m) and m != "-o")]
                    )
                    print(
                        f"{command:9}{name[-28:]:30}{threads:>4}{told:>6}  "
                        f"{outcome:9}{peak / MB:8.0f}{seconds:9.2f}  {says}",
                        flush=True,
                    )
                    if limit and accepted:
                        break  # a higher limit changes nothing
    print(f"{wrong} wrong")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
