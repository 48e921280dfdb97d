#!/usr/bin/env python3
"""Shows what each numeric constant of the core does: how the figures of scans with known truth, or of UVs,
change when it is halved and doubled.

    tests/constants.py --list [WORD ...]    the constants, and those that are left out with the reason
    tests/constants.py [WORD ...]           measures those whose name or file holds each WORD (all: hours)
    tests/constants.py --table              the results so far as a table

A constant is a `const NAME: type = value;` of rust/atlasfit/src outside of tests; numbers in a tuple or in
the fields of a struct count one by one, an array of numbers as one. They are changed in a copy of the tree
below --scratch, which is built there (release, without link-time optimisation) and run on every scan, or on
every mesh for the constants of unwrap/; the checkout is only read. In the copy, the structs of constants.rs
read their numbers when the program starts, so that one build serves for all of them; any other constant takes
two builds of its own. Results are kept line by line in results.jsonl beside the copy: a later call goes on
from there, and asks for --fresh where the sources have changed since.

What changes nothing here may do so elsewhere: only `denoise` with the default prior and its UVs runs, on
clean small scans, and `unwrap` as MESHES says; the unchanged program measures.

Scans are made here: a thin ring and a spiral (tubes), a one-sided band, a sphere with stray points, a box
(creases), a thin plate (two opposing sheets), and facades with windows set back (open parts that face one
way). --shapes adds others by the names of tests/peers/shapes.py.
Meshes lie in the folder --meshes. Needs numpy.
"""

import argparse
import hashlib
import json
import math
import os
import pathlib
import resource
import runpy
import shutil
import subprocess
import sys
import time

from constants_of import KNOB, ROOT, SOURCES, at_start, changed, constants, listed, read_at_start

FACTORS = {"half": 0.5, "double": 2}
# Name of a scan: shape, noise (standard deviation, in longest sides), and the share of stray points.
SCANS = {
    "ring": ("ring", 0.01, 0.0),
    "spiral": ("spiral", 0.005, 0.0),
    "mobius": ("mobius", 0.005, 0.0),
    "sphere": ("sphere", 0.01, 0.02),
    "box": ("box", 0.005, 0.0),
    "plate": ("plate", 0.004, 0.0),
    **{f"facade{seed}": ("facade", 0.0045, 0.0) for seed in range(4)},
}
# What is unwrapped: the file of a mesh and the options. Between them each way through the unwrapper is taken:
# a loose bound, a bound on the charts, pages of fixed size, boxes, a large mesh, very many charts.
MESHES = {
    "cow": ("cow.ply", []),
    "fandisk": ("fandisk.ply", ["--hard-edges", "40"]),
    "fertility": ("fertility.ply", []),
    "elephant": ("elephant.ply", ["--max-stretch", "1.5"]),
    "homer": ("homer.ply", ["--max-charts", "30"]),
    "knot": ("knot1.ply", ["--pages", "2"]),
    "camel": ("camel.ply", ["--packer", "boxes", "--padding", "0"]),
    "nefertiti": ("nefertiti.ply", []),
    "maze": ("maze.ply", ["--texture-size", "64"]),
}
# Figures of a mesh: UV charts, length of seams, stretch at the 95th percentile, share of the pages that is
# covered, processor time.
UV_FIGURES = ["charts", "seam", "stretch", "coverage", "cpu"]
# Figures of a scan whose changes the table shows as ratios: root mean square distances (denoised points to
# the truth, surface to truth, truth to surface), share of the surface that faces as the truth does, counts,
# UV quality, time.
FIGURES = ["points", "acc", "com", "facing", "charts", "faces", "uv_charts", "stretch", "coverage", "seconds"]
FIGURES_OF = {"scans": FIGURES, "meshes": UV_FIGURES}


def kind_of(constant):
    """What shows the effect of a constant."""
    return "meshes" if constant["file"].startswith("unwrap/") else "scans"


# Scans with known truth.


def cube(n, size, onto_sphere=False):
    """Six grids of n x n squares, as triangles, on a box or pressed onto the unit sphere."""
    import numpy as np

    u, v = (
        x.ravel() for x in np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1), indexing="ij")
    )
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a, b = i * (n + 1) + j, (i + 1) * (n + 1) + j
    squares = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    V, F = [], []
    for axis in range(3):
        for side in (1, -1):
            grid = np.roll(np.stack([np.full_like(u, side), u, v], 1), axis, 1)
            F.append(squares[:, ::side] + len(V) * len(u))
            V.append(grid)
    V = np.concatenate(V)
    return (V / np.linalg.norm(V, axis=1)[:, None] if onto_sphere else V * size), np.concatenate(F)


def facade(sigma, seed):
    """A wall of longest side 1 whose middle third stands out, with windows set back: the truth, and points of
    it in clumps as photographs give them."""
    import numpy as np

    rng = np.random.default_rng(seed)

    def depth(p):
        inside = lambda t, half: np.abs(t % 1 - 0.5) < half
        window = inside(8 * p[:, 0], 0.2) & inside(6 * p[:, 1], 0.3)
        return 0.05 * (np.abs(p[:, 0]) < 0.165) - 0.03 * window

    V, F = cube(200, 0.5)
    front = np.all(V[F][:, :, 0] == 0.5, 1)
    V = V[:, [1, 2, 0]]
    V[:, 2] = depth(V)
    P = rng.uniform(-0.5, 0.5, (3000, 2))
    clumps = rng.uniform(-0.5, 0.5, (120, 2))
    P[1::2] = clumps[np.arange(1500) % 120] + 0.03 * rng.standard_normal((1500, 2))
    return V, F[front], np.column_stack([P, depth(P)]) + sigma * rng.standard_normal((3000, 3)) * [0, 0, 1]


def facing(surface, truth, places=2000):
    """The share of a surface's area that faces as the truth does, at places spread by area; both are binary
    STL files."""
    import numpy as np

    def spread(file, n):
        triangle = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
        corners = np.fromfile(file, triangle, offset=84)["corners"].astype(float)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(normal, axis=1)
        at = np.random.default_rng(0).choice(len(corners), n, p=area / area.sum())
        return corners.mean(1)[at], normal[at]

    (P, N), (Q, M) = spread(surface, places), spread(truth, 4 * places)
    near = np.concatenate([np.argmin(((p[:, None] - Q) ** 2).sum(2), 1) for p in np.array_split(P, 50)])
    return float(np.mean((N * M[near]).sum(1) > 0))


def make_scans(folder, scans, count):
    """Writes NAME.truth.ply and NAME.ply for each scan."""
    import numpy as np

    peers = runpy.run_path(str(ROOT / "tests" / "peers" / "shapes.py"))
    own = {"sphere": (48, 1.0, True), "box": (1, [0.5, 0.4, 0.3]), "plate": (1, [0.5, 0.35, 0.015])}
    for name, (shape, sigma, stray) in scans.items():
        if shape == "facade":
            V, F, P = facade(sigma, int(name.removeprefix("facade")))
        else:
            V, F = cube(*own[shape]) if shape in own else peers["clean"](shape)
            V = V / (V.max(0) - V.min(0)).max()
            P = peers["noisy"](V, F, sigma, count)
        rng = np.random.default_rng(1)
        P = np.concatenate([P, rng.uniform(V.min(0) - 0.1, V.max(0) + 0.1, (int(stray * count), 3))])
        peers["write_ply"](folder / f"{name}.truth.ply", V, F)
        peers["write_ply"](folder / f"{name}.ply", P)


# Building and measuring.


class Workplace:
    """The copy of the tree, its build, and the scans."""

    def __init__(self, scratch, scans, count, more, meshes):
        """`more`: further arguments of denoise. `meshes`: the folder of the meshes."""
        self.more, self.meshes = more, meshes
        self.scans, self.folder, self.tree = scans, scratch / "scans", scratch / "tree"
        self.build_folder = scratch / "build"
        self.results = scratch / "results.jsonl"
        shutil.rmtree(self.tree, ignore_errors=True)
        # New times for all files: what an ended run left built is never taken for what is here.
        for name in listed():
            (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, self.tree / name)
        found = [c for c in constants([]) if "reason" not in c and at_start(c)]
        for file in sorted({c["file"] for c in found}):
            path = self.tree / SOURCES / file
            path.write_text(read_at_start(path.read_text(), [c for c in found if c["file"] == file]))
        (self.tree / SOURCES / "knob.rs").write_text(KNOB)
        with (self.tree / SOURCES / "lib.rs").open("a") as lib:
            lib.write("\nmod knob;\n")
        self.folder.mkdir(parents=True, exist_ok=True)
        make_scans(self.folder, scans, count)
        digest = hashlib.sha256(json.dumps([scans, count, more, MESHES]).encode())
        for name in listed():
            if len(name.parts) < 3 or name.parts[2] == "src":  # not the tests and benchmarks of a crate
                digest.update((ROOT / name).read_bytes())
        self.digest = digest.hexdigest()

    def build(self):
        """The program, or None with what the compiler said."""
        settings = {
            "CARGO_TARGET_DIR": str(self.build_folder),
            "CARGO_INCREMENTAL": "1",
            "CARGO_PROFILE_RELEASE_LTO": "off",
        }
        settings["CARGO_PROFILE_RELEASE_CODEGEN_UNITS"] = "16"
        command = ["cargo", "build", "--release", "-q", "-p", "atlasfit-cli", "--locked"]
        done = subprocess.run(
            command, cwd=self.tree, env=os.environ | settings, capture_output=True, text=True
        )
        errors = [line for line in done.stderr.splitlines() if line.startswith("error")]
        return (
            (self.build_folder / "release" / "atlasfit", None)
            if done.returncode == 0
            else (None, (errors or ["?"])[0])
        )

    def mesh_figures(self, program, name, limit, knob):
        """Figures of one mesh's UVs."""
        file, options = MESHES[name]
        out = self.folder / f"{name}.uv.ply"
        start = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        said = ran([program, "unwrap", self.meshes / file, "-o", out, *options], limit, knob)
        if "failed" in said:
            return said
        found = {k: said[k] for k in ("charts", "seam", "coverage", "seconds")}
        return found | {
            "stretch": said["stretch_p95"],
            "cpu": resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - start,
            "bytes": hashlib.sha256(out.read_bytes()).hexdigest(),
        }

    def figures(self, program, judge, name, limit, knob, base):
        """Figures of one scan. `judge` is the unchanged program: it measures what `program` makes, unless
        that is what `base` says. `knob` is the number that `program` is to change when it starts."""
        out, points, truth = (str(self.folder / f"{name}.{kind}.ply") for kind in ("out", "points", "truth"))
        scan = str(self.folder / f"{name}.ply")
        command = [program, "denoise", scan, "-o", out, "--points", points, *self.more]
        said = ran(command, limit, knob)
        if "failed" in said:
            return said
        digest = hashlib.sha256(
            pathlib.Path(out).read_bytes() + pathlib.Path(points).read_bytes()
        ).hexdigest()
        if base and base["bytes"] == digest:
            return base | {"seconds": said["seconds"]}
        stl = [f"{file}.stl" for file in (out, truth)]
        done = [ran([judge, "measure", x, "--against", truth], 600) for x in (out, points)]
        done += [ran([judge, "convert", x, y], 600) for x, y in zip((out, truth), stl)]
        if failed := [d for d in done if "failed" in d]:
            return failed[0]
        surface, moved = done[:2]
        found = {k: said[k] for k in ("charts", "faces", "parts", "outliers", "uv_charts", "seconds")}
        uv = surface.get("uv") or {}
        rms = {"acc": surface["surface"]["accuracy"]["rms"], "com": surface["surface"]["completeness"]["rms"]}
        rms["points"] = moved["points"]["accuracy"]["rms"]
        rms["facing"] = facing(*stl)
        return (
            found | rms | {"stretch": uv.get("stretch_p95"), "coverage": uv.get("coverage"), "bytes": digest}
        )

    def measure(self, kind, program, judge, base=None, knob=""):
        """Figures of all scans or meshes. A run may take ten seconds and twenty times the unchanged
        program's.
        """
        limit = lambda name: 600 if base is None else 10 + 20 * base[name]["seconds"]
        before = lambda name: base and base[name]
        if kind == "meshes":
            return {n: self.mesh_figures(program, n, limit(n), knob) for n in MESHES}
        return {n: self.figures(program, judge, n, limit(n), knob, before(n)) for n in self.scans}

    def kept(self):
        lines = self.results.read_text().splitlines() if self.results.exists() else []
        return [json.loads(line) for line in lines]

    def keep(self, record):
        with self.results.open("a") as out:
            out.write(json.dumps(record) + "\n")


def ran(command, limit, knob=""):
    """What a command reports as JSON, or {"failed": reason}."""
    try:
        done = subprocess.run(
            [*map(str, command), "--json", "--quiet"],
            capture_output=True,
            text=True,
            timeout=limit,
            env=os.environ | {"ATLASFIT_CONSTANT": knob},
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"over {limit:.0f} s"}
    return (
        json.loads(done.stdout)
        if done.returncode == 0
        else {"failed": (done.stderr.strip() or str(done.returncode))[:200]}
    )


def run(work, todo):
    kept = work.kept()
    if kept and kept[0]["digest"] != work.digest:
        sys.exit(f"{work.results} is of other sources or scans: --fresh begins anew")
    print("building the unchanged program", flush=True)
    program, error = work.build()
    if error:
        sys.exit(f"the tree does not build: {error}")
    judge = work.build_folder / "judge"
    shutil.copy2(program, judge)
    bases = {r["kind"]: r["scans"] for r in kept if "kind" in r}
    for kind in {kind_of(constant) for constant in todo} - bases.keys():
        bases[kind] = work.measure(kind, judge, judge)
        if any("failed" in figures for figures in bases[kind].values()):
            sys.exit(f"the unchanged program fails: {bases[kind]}")
        work.keep({"digest": work.digest, "kind": kind, "scans": bases[kind]})
    done = {(r["file"], r["name"], r["factor"]) for r in kept if "kind" not in r}
    for constant in todo:
        kind = kind_of(constant)
        base = bases[kind]
        path = SOURCES / constant["file"]
        source = (ROOT / path).read_text()
        for word, factor in FACTORS.items():
            if (constant["file"], constant["name"], word) in done:
                continue
            record = {k: constant[k] for k in ("file", "name", "value")} | {"factor": word}
            start = time.monotonic()
            text = changed(source, constant, factor)
            if text is None:
                record["failed"] = "would be 0 or the same"
            elif at_start(constant):
                knob = f"{constant['file']} {constant['name']} {word}"
                record["scans"] = work.measure(kind, judge, judge, base, knob)
            else:
                (work.tree / path).write_text(text)
                program, error = work.build()
                record |= {"failed": error} if error else {"scans": work.measure(kind, program, judge, base)}
                (work.tree / path).write_text(source)
            work.keep(record)
            row = " | ".join(cells(record, base, FIGURES_OF[kind])[4:])
            print(
                f"{constant['file']} {constant['name']} {word} ({time.monotonic() - start:.0f} s): {row}",
                flush=True,
            )


# The table.


def cells(record, base, names):
    """File, name, value, factor, scans with the same bytes, then ratios: geometric mean, and the worst."""
    head = [record["file"], record["name"], record["value"], record["factor"]]
    if "failed" in record:
        return [*head, record["failed"]]
    good = {n: f for n, f in record["scans"].items() if "failed" not in f}
    if not good:
        return [*head, "every scan fails"]
    same = sum(f["bytes"] == base[n]["bytes"] for n, f in good.items())
    out = [
        *head,
        f"{same}/{len(base)}" + (f", {len(base) - len(good)} fail" if len(good) < len(base) else ""),
    ]
    for figure in names:
        ratios = {n: f[figure] / base[n][figure] for n, f in good.items() if f[figure] and base[n][figure]}
        mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios)) if ratios else math.nan
        worst = max(ratios, key=lambda n: abs(math.log(ratios[n])), default=None)
        far = (
            worst
            and figure not in ("seconds", "cpu")
            and abs(math.log(ratios[worst])) > max(0.01, 1.5 * abs(math.log(mean)))
        )
        out.append(f"{mean:.3f}" + (f" ({worst} {ratios[worst]:.3f})" if far else ""))
    return out


def table(kept):
    if not kept:
        sys.exit("no results yet")
    print("Ratios to the unchanged program: geometric mean, and the scan or mesh that changes most.")
    for kind, names in FIGURES_OF.items():
        base = next((r["scans"] for r in kept if r.get("kind") == kind), None)
        rows = [r for r in kept if "kind" not in r and kind_of(r) == kind]
        if not base or not rows:
            continue
        head = ["file", "constant", "value", "times", "same bytes", *names]
        print("\n| " + " | ".join(head) + " |\n|" + "---|" * len(head))
        for record in rows:
            row = cells(record, base, names)
            print("| " + " | ".join(row + [""] * (len(head) - len(row))) + " |")


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument(
        "words", nargs="*", metavar="WORD", help="only constants whose name or file holds each of these"
    )
    ask.add_argument("--list", action="store_true", help="show the constants, build nothing")
    ask.add_argument(
        "--table", action="store_true", help="show the results so far as a Markdown table, build nothing"
    )
    ask.add_argument("--fresh", action="store_true", help="forget earlier results")
    ask.add_argument(
        "--scratch",
        type=pathlib.Path,
        help="folder of the copy and the results; default: constants/ in the target folder",
    )
    ask.add_argument("--count", type=int, default=6000, help="points of a scan")
    ask.add_argument("--no-uv", action="store_true", help="lay out no UVs: three times as fast")
    ask.add_argument(
        "--meshes",
        type=pathlib.Path,
        default=ROOT.parent / "shared" / "data" / "uv",
        help="folder of the meshes that are unwrapped",
    )
    ask.add_argument(
        "--denoise", default="", help="more options of denoise, in one word: --denoise=--watertight"
    )
    ask.add_argument("--shapes", default="", help="more shapes, with commas: NAME or NAME:SIGMA")
    given = ask.parse_args()
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    scratch = given.scratch or (target if target.is_absolute() else ROOT / target) / "constants"
    if given.table:
        results = scratch / "results.jsonl"
        return table(
            [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
        )
    found = list(constants(given.words))
    todo = [c for c in found if "reason" not in c]
    for c in found if given.list else [c for c in found if "reason" in c]:
        print(f"{c['file']} {c['name']}: {'left out: ' + c['reason'] if 'reason' in c else c['value']}")
    print(f"{len(todo)} numbers to change, {len(found) - len(todo)} left out")
    if given.list or not todo:
        return None
    scans = dict(SCANS)
    for shape in filter(None, given.shapes.split(",")):
        name, _, sigma = shape.partition(":")
        scans[shape.replace(":", "-")] = (name, float(sigma or 0.005), 0.0)
    absent = [file for file, _ in MESHES.values() if not (given.meshes / file).exists()]
    if absent and any(kind_of(c) == "meshes" for c in todo):
        sys.exit(f"not in {given.meshes}: {', '.join(absent)} (see --meshes)")
    if given.fresh:
        (scratch / "results.jsonl").unlink(missing_ok=True)
    more = [*(["--no-uv"] * given.no_uv), *given.denoise.split()]
    return run(Workplace(scratch, scans, given.count, more, given.meshes), todo)


if __name__ == "__main__":
    main()
