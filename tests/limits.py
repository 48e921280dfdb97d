#!/usr/bin/env python3
"""Do --max-memory and --time-limit hold on difficult files? Puts every file of some folders through every
command under both limits, and prints a table: command, file, outcome, peak resident memory, seconds on the
clock, what the program says.

    tests/limits.py target/release/atlasfit ../shared/data/zoo ../shared/data/torture
    tests/limits.py target/release/atlasfit FOLDER --memory 300 --seconds 20 --only denoise

A run is right when it ends by itself within the time limit and a tenth (and a second to start on a busy
machine), peaks below 1.1 times the memory limit + 30 MB, and either succeeds and leaves an output with
something in it, or fails with status 1 or 2, one line that says why, and no output. Exit status 1 where one
is not. Needs numpy (memory.py does).
"""

import argparse
import pathlib
import sys
import tempfile

import memory

COMMANDS = {
    "info": [],
    "measure": [],
    "convert": ["{out}/c.ply"],
    "render": ["-o", "{out}/r.png"],
    "unwrap": ["-o", "{out}/u.glb"],
    "simplify": ["-o", "{out}/s.ply", "--faces", "1000"],
    "denoise": ["-o", "{out}/d.ply", "--points", "{out}/p.ply"],
}


def judge(peak, seconds, status, text, left, limits):
    """What is wrong with a run; nothing if all is well. `left` are the files that it wrote."""
    if peak > memory.FACTOR * limits.memory * memory.MB + memory.SLACK:
        return f"a peak of {peak / memory.MB:.0f} MB"
    if seconds > 1.1 * limits.seconds + 1:
        return f"{seconds:.1f} s"
    if status not in (0, 1, 2):
        return f"exit status {status}: {text[-200:]}"
    if status == 0:
        return next((f"{f.name} is empty" for f in left if not f.stat().st_size), None)
    if not text.startswith("atlasfit: ") and "\natlasfit: " not in text and "error: " not in text:
        return f"no reason: {text[-200:]}"
    return f"{left[0].name} was left" if left else None


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folders", type=pathlib.Path, nargs="+")
    parser.add_argument("--memory", type=int, default=300, metavar="MB")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--only", default="", help="runs whose command or file holds this word")
    limits = parser.parse_args()
    files = sorted(
        f
        for folder in limits.folders
        for f in folder.rglob("*")
        if f.is_file() and f.suffix not in (".md", ".mtl")
    )
    wrong = runs = 0
    print(f"{'command':9}{'file':44}{'outcome':10}{'peak MB':>8}{'seconds':>9}  says")
    for file in files:
        for command, more in COMMANDS.items():
            if limits.only not in f"{command} {file}":
                continue
            with tempfile.TemporaryDirectory() as out:
                arguments = [
                    command,
                    file,
                    *(a.format(out=out) for a in more),
                    "--time-limit",
                    limits.seconds,
                ]
                peak, seconds, status, text = memory.run(limits.program, arguments, limits.memory * memory.MB)
                problem = judge(peak, seconds, status, text, sorted(pathlib.Path(out).iterdir()), limits)
            runs += 1
            wrong += problem is not None
            outcome = "WRONG" if problem else "done" if status == 0 else "refused"
            says = problem or (text.splitlines()[-1][:90] if status else "")
            print(
                f"{command:9}{file.name[-43:]:44}{outcome:10}{peak / memory.MB:8.0f}{seconds:9.2f}  {says}",
                flush=True,
            )
    print(f"{runs} runs, {wrong} wrong")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
