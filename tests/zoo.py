#!/usr/bin/env python3
"""Puts every file of the zoo of difficult files, and damaged copies of it, through `atlasfit info`, `denoise`
and `measure`.

usage: zoo.py PROGRAM [FOLDER] [--table FILE.md] [--only WORD] [--commands info,denoise,measure]
              [--kinds whole,changed] [--jobs 2] [--results FILE.jsonl]
       zoo.py --damage FILE KIND OUT        writes one damaged copy, to look at a failure
                                            (KIND: cut0 ... cut9, changed)

--kinds: which copies; by default whole, cut0 ... cut9, changed. --results: what came of each run is kept
there and not run again, so that a long run can be stopped and taken up later, with the same program; table
and summary are of all that is in it.

Damaged copies: the file cut off at 10 random places, and the file with 20 random bytes changed; always the
same ones, by the file's name. Each run may take 30 s of processor time with one thread (so that a busy
machine does not decide) and 2 GB. A run passes when it ends with a valid result or with a clear error: exit
code 0, 1 or 2, one line on standard error that names the reason, no panic, no signal. A surface that was
written must load again and be finite. Prints the failures and a summary, writes a table of all files; exit
code 1 if anything fails. Needs only Python.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import zlib

SECONDS = 30
# On the clock: a run that waits for ever uses no processor time.
PATIENCE = 20 * SECONDS
MEMORY = 2 << 30
KINDS = ["whole", *(f"cut{i}" for i in range(10)), "changed"]
COMMANDS = ["info", "denoise", "measure"]


def damaged(data, name, kind):
    """The copy of this kind: "whole", "cut0" ... or "changed"."""
    if kind == "whole":
        return data
    rng = random.Random(zlib.crc32(f"{name}/{kind}".encode()))
    if kind.startswith("cut"):
        return data[: rng.randrange(len(data))] if data else data
    out = bytearray(data)
    for _ in range(min(20, len(out))):
        out[rng.randrange(len(out))] = rng.randrange(256)
    return bytes(out)


def run(arguments):
    """Exit code (negative: signal), processor seconds, peak bytes, standard output and error; code None: it
    had to be killed.
    """

    def limits():
        # Address space is more than memory in use; this only keeps a runaway from taking the machine down.
        resource.setrlimit(resource.RLIMIT_AS, (3 * MEMORY, 3 * MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5))

    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = subprocess.Popen(
            arguments, stdin=subprocess.DEVNULL, stdout=out, stderr=err, preexec_fn=limits
        )
        late = threading.Event()

        def kill():
            late.set()
            os.kill(child.pid, signal.SIGKILL)

        timer = threading.Timer(PATIENCE, kill)
        timer.start()
        _, status, usage = os.wait4(child.pid, 0)
        timer.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = usage.ru_utime + usage.ru_stime
        out.seek(0), err.seek(0)
        code = None if late.is_set() or child.returncode == -signal.SIGXCPU else child.returncode
        return (
            code, seconds, usage.ru_maxrss * 1024, out.read().decode(errors="replace"),
            err.read().decode(errors="replace"),
        )


def fault(code, seconds, peak, out, err):
    """Why this run is no pass; None for a pass."""
    if code is None:
        return f"still running after {SECONDS} s"
    if code < 0:
        return f"ended by signal {-code}"
    if "panicked" in err or "internal error" in err:
        return "panic: " + err.strip().splitlines()[-1][:300]
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if peak > MEMORY:
        return f"{peak >> 20} MB"
    if code and not [line for line in err.splitlines() if line.startswith("atlasfit: ")]:
        return f"exit code {code} without a reason"
    return None


def finite(value):
    """Whether JSON text holds no number that is not finite (the program writes those as null in `extent`)."""
    extent = (value.get("extent") or {}) if isinstance(value, dict) else {}
    return all(
        x is not None
        for corner in extent.values()
        for x in (corner if isinstance(corner, list) else [corner])
    )


def check(program, folder, path, kind, command):
    """One run: dictionary with what came of it."""
    name = str(path.relative_to(folder))
    with tempfile.TemporaryDirectory() as place:
        # The copy keeps its name: messages and ties between formats depend on it.
        copy = pathlib.Path(place) / path.name
        copy.write_bytes(damaged(path.read_bytes(), name, kind))
        arguments = [program, command, str(copy), "--json", "--quiet", "--threads", "1"]
        surface = pathlib.Path(place) / "surface-out.ply"
        if command == "denoise":
            arguments += ["-o", str(surface)]
        code, seconds, peak, out, err = run(arguments)
        why = fault(code, seconds, peak, out, err)
        if why is None and code == 0:
            try:
                json.loads(out)
            except ValueError:
                why = "the report is no JSON"
        if why is None and command == "denoise":
            if code == 0:
                again = run([program, "info", str(surface), "--json", "--quiet", "--threads", "1"])
                if again[0] != 0:
                    why = "its surface cannot be read: " + again[4].strip()[:200]
                else:
                    said = json.loads(again[3])
                    if said.get("not_finite", 0) or not said.get("faces"):
                        why = "its surface is empty or not finite"
            elif surface.exists():
                why = "it failed and left an output"
        leftover = [p.name for p in pathlib.Path(place).iterdir() if p not in (copy, surface)]
        if why is None and leftover:
            why = "it left " + ", ".join(leftover)
        text = err.strip().splitlines()[-1] if err.strip() else ""
        return dict(file=name, kind=kind, command=command, code=code, seconds=seconds, peak=peak, fault=why,
                    text=text.replace(place + "/", "").removeprefix("atlasfit: "))


def table(results, commands):
    """Markdown: one row per file."""
    lines = [
        "| file | " + " | ".join(commands)
        + " | damaged copies: results / errors / failures | slowest s | most MB |",
        "|---|" + "---|" * (len(commands) + 3),
    ]
    by_file = {}
    for r in results:
        by_file.setdefault(r["file"], []).append(r)
    for name, rows in sorted(by_file.items()):
        cells = []
        for command in commands:
            whole = [r for r in rows if r["kind"] == "whole" and r["command"] == command]
            if not whole:
                cells.append("not run")
                continue
            r = whole[0]
            said = (
                "**FAILS: " + r["fault"] + "**"
                if r["fault"]
                else "result" if r["code"] == 0 else "error: " + r["text"]
            )
            cells.append(said[:160].replace("|", "\\|"))
        rest = [r for r in rows if r["kind"] != "whole"]
        bad = sum(1 for r in rest if r["fault"])
        good = sum(1 for r in rest if not r["fault"] and r["code"] == 0)
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {good} / {len(rest) - good - bad} / {bad}"
                     f" | {max(r['seconds'] for r in rows):.1f} | {max(r['peak'] for r in rows) >> 20} |")
    return "\n".join(lines) + "\n"


def main():
    if sys.argv[1:2] == ["--damage"]:
        path, kind, out = sys.argv[2:5]
        path = pathlib.Path(path)
        # Names are relative to the zoo's folder: its collections are one level deep.
        pathlib.Path(out).write_bytes(damaged(path.read_bytes(), f"{path.parent.name}/{path.name}", kind))
        return 0
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program")
    parser.add_argument(
        "folder", nargs="?", default=pathlib.Path(__file__).resolve().parents[2] / "shared/data/zoo"
    )
    parser.add_argument("--table", type=pathlib.Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--commands", default=",".join(COMMANDS))
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--results", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    folder = pathlib.Path(args.folder)
    program = str(pathlib.Path(args.program).resolve())
    commands = args.commands.split(",")
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and args.only in str(p.relative_to(folder))]
    kinds = args.kinds.split(",")
    # Whole files first: their failures matter most.
    work = [(program, folder, p, kind, command) for kind in kinds for p in files for command in commands]
    results = []
    if args.results and args.results.exists():
        results = [json.loads(line) for line in args.results.read_text().splitlines()]
    there = {(r["file"], r["kind"], r["command"]) for r in results}
    work = [w for w in work if (str(w[2].relative_to(folder)), w[3], w[4]) not in there]
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for done, r in enumerate(pool.map(lambda w: check(*w), work), 1):
            results.append(r)
            if args.results:
                with args.results.open("a") as out:
                    out.write(json.dumps(r) + "\n")
            if done % 500 == 0:
                print(f"{done} of {len(work)} runs", file=sys.stderr, flush=True)
            if r["fault"]:
                print(
                    f"FAILS {r['file']} ({r['kind']}) {r['command']}: {r['fault']}  [{r['seconds']:.1f} s]",
                    flush=True,
                )
    if args.table:
        args.table.write_text(table(results, commands))
    bad = [r for r in results if r["fault"]]
    slowest = max(results, key=lambda r: r["seconds"], default=None)
    most = max(results, key=lambda r: r["peak"], default=None)
    if not results:
        print("no files")
        return 1
    good = sum(r["code"] == 0 and not r["fault"] for r in results)
    print(
        f"{len({r['file'] for r in results})} files, {len(results)} runs: "
        f"{good} results, {len(results) - len(bad) - good} clear errors; "
        f"slowest {slowest['seconds']:.1f} s ({slowest['file']}, {slowest['kind']}, {slowest['command']}), "
        f"most memory {most['peak'] >> 20} MB ({most['file']}, {most['kind']}, {most['command']})"
    )
    print(f"{len(results) - len(bad)} passed, {len(bad)} failed")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
