"""Runs a plan of tasks (`atlasfit tiles plan`, `atlasfit batch`) on an engine that there is.

    python -m atlasfit.tiles run WORK --engine local|dask|ray|slurm
    python -m atlasfit.tiles batch FOLDER -o OUT --engine ...

In: the plan of a work folder: tasks with a command each, their outputs and the tasks that come before them.
Out: the outputs; the exit code says whether all are there, and those that are missing are named. A task is
one run of the program `atlasfit`, which writes its files whole or not at all: an engine may run it again, or
twice. Dask and Ray order, place and repeat the tasks by themselves; Slurm gets a script of array jobs. All
machines must see the work folder and the results under the same paths.
"""

from __future__ import annotations

import argparse
import graphlib
import json
import os
import shlex
import shutil
import subprocess
import sys
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from pathlib import Path

__all__ = ["TaskFailed", "batch_tasks", "run", "run_task"]

# How often an engine tries a task whose machine was lost.
TRIES = 3


class TaskFailed(Exception):
    """A task's program failed: its name, and what it said."""


def run_task(task: dict, program: str, threads: int, *_before) -> str:
    """Runs one task; its name. `_before` are what the tasks before it gave: engines order by them.

    Raises TaskFailed where the program fails.
    """
    command = [program, *task["command"], "--threads", str(threads), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode < 0:
        raise TaskFailed(
            f"{task['name']}: ended by signal {-done.returncode}"
            + (" (as the system does where memory is short)" if done.returncode == -9 else "")
        )
    if done.returncode:
        raise TaskFailed(f"{task['name']}: {done.stderr.strip() or done.stdout.strip()}")
    return task["name"]


def is_done(task: dict) -> bool:
    """Whether all that a task writes is there."""
    return all(Path(output).exists() for output in task["outputs"])


def left(tasks: list[dict]) -> list[dict]:
    """The tasks that are not done; of the tasks before them, those that are left too."""
    todo = [t for t in tasks if not is_done(t)]
    names = {t["name"] for t in todo}
    return [{**t, "after": [a for a in t["after"] if a in names]} for t in todo]


def plan_tasks(work: str) -> list[dict]:
    """The tasks of the plan in a work folder (or of the file itself)."""
    path = Path(work)
    path = path / "plan.json" if path.is_dir() else path
    try:
        return json.loads(path.read_text())["tasks"]
    except (OSError, ValueError, KeyError) as error:
        raise SystemExit(f"{path}: no plan ({error}). Make one with `atlasfit tiles plan`") from error


def batch_tasks(folder: str, output: str, more: list[str]) -> list[dict]:
    """A task for each scan in a folder."""
    scans = sorted(p for p in Path(folder).iterdir() if p.is_file() and not p.name.startswith("."))
    out = Path(output).absolute()
    surface = more[more.index("--surface") + 1] if "--surface" in more else "glb"
    return [
        {
            "name": scan.name,
            "command": ["batch", str(Path(folder).absolute()), "-o", str(out), "--only", scan.name, *more],
            "outputs": [str(out / f"{scan.name}.{surface}")],
            "after": [],
            "memory": 0,
        }
        for scan in scans
    ]


def local(tasks: list[dict], program: str, workers: int, threads: int) -> list[str]:
    """On this machine, so many tasks at a time. Returns what failed."""
    sorter = graphlib.TopologicalSorter({t["name"]: t["after"] for t in tasks})
    sorter.prepare()
    of = {t["name"]: t for t in tasks}
    failed, running, lost = [], {}, set()
    with ThreadPoolExecutor(workers) as pool:
        while sorter.is_active():
            for name in sorter.get_ready():
                if lost.intersection(of[name]["after"]):
                    lost.add(name)
                    sorter.done(name)
                else:
                    running[pool.submit(run_task, of[name], program, threads)] = name
            if not running:
                continue
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                name = running.pop(future)
                if error := future.exception():
                    failed.append(str(error))
                    lost.add(name)
                sorter.done(name)
    return failed


def dask(tasks: list[dict], program: str, workers: int, threads: int, address: str | None = None) -> list[str]:
    """On Dask distributed: the cluster at `address`, or one of this machine with so many workers."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise SystemExit("--engine dask needs Dask: pip install distributed") from error
    cluster = None
    if address is None:
        # Each task is a process of its own already.
        cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
    try:
        with Client(address or cluster) as client:
            return dask_on(client, tasks, program, threads)
    finally:
        if cluster is not None:
            cluster.close()


def dask_on(client, tasks: list[dict], program: str, threads: int) -> list[str]:
    """The same on a client that there is already."""
    futures = {}
    for task in tasks:
        before = [futures[name] for name in task["after"]]
        # A task that has run before is asked for anew: its files may be gone.
        futures[task["name"]] = client.submit(
            run_task, task, program, threads, *before, pure=False, retries=TRIES - 1
        )
    failed = {}
    for future in futures.values():
        if error := future.exception():
            # Those that wait for a failed task fail with its error.
            failed[str(error)] = None
    return list(failed)


def ray(tasks: list[dict], program: str, workers: int, threads: int, address: str | None = None) -> list[str]:
    """On Ray: the cluster at `address`, or one of this machine with so many workers."""
    try:
        import ray as engine
    except ImportError as error:
        raise SystemExit("--engine ray needs Ray: pip install ray") from error
    ours = not engine.is_initialized()
    if ours:
        # Workers find this module where it is.
        here = {"env_vars": {"PYTHONPATH": str(Path(__file__).resolve().parents[1])}}
        if address:
            engine.init(address=address, runtime_env=here, log_to_driver=False)
        else:
            engine.init(num_cpus=workers, include_dashboard=False, runtime_env=here, log_to_driver=False)
    try:
        remote = engine.remote(max_retries=TRIES)(run_task)
        futures = {}
        for task in tasks:
            before = [futures[name] for name in task["after"]]
            futures[task["name"]] = remote.remote(task, program, threads, *before)
        failed = {}
        for future in futures.values():
            try:
                engine.get(future)
            except engine.exceptions.RayTaskError as error:
                failed[str(getattr(error, "cause", None) or error)] = None
            except engine.exceptions.RayError as error:
                failed[str(error)] = None
        return list(failed)
    finally:
        if ours:
            engine.shutdown()


def slurm(tasks: list[dict], program: str, threads: int, folder: Path, options: list[str]) -> Path:
    """Writes a script that hands the tasks to Slurm: an array job for each step, which waits for the step
    before it. `options` are put behind each `sbatch`. The script's path."""
    step = {}
    for task in tasks:
        step[task["name"]] = 1 + max((step[a] for a in task["after"]), default=-1)
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["#!/bin/sh", "# Run this where sbatch is: an array job for each step of the plan.", "set -eu"]
    before = ""
    for number in range(1 + max(step.values(), default=-1)):
        of_step = [t for t in tasks if step[t["name"]] == number]
        commands = folder / f"step-{number}.txt"
        commands.write_text(
            "".join(
                shlex.join([program, *t["command"], "--threads", str(threads), "--quiet"]) + "\n"
                for t in of_step
            )
        )
        memory = max(512, max(t["memory"] for t in of_step) // 2**20 * 5 // 4)
        job = f'sh -c "$(sed -n "${{SLURM_ARRAY_TASK_ID}}p" {shlex.quote(str(commands))})"'
        # afterany: a step runs what it can; the program refuses what lacks its inputs.
        lines.append(
            f"job{number}=$(sbatch --parsable --array=1-{len(of_step)} --cpus-per-task={max(threads, 1)} "
            f"--mem={memory}M --requeue --job-name=atlasfit-{number} {before}{shlex.join(options)} "
            f"--wrap {shlex.quote(job)})"
        )
        before = f"--dependency=afterany:$job{number} "
    lines.append('echo "jobs are with Slurm; `atlasfit tiles status` tells how they stand"')
    script = folder / "submit.sh"
    script.write_text("\n".join(lines) + "\n")
    script.chmod(0o755)
    return script


def run(
    tasks: list[dict],
    engine: str,
    program: str = "atlasfit",
    workers: int | None = None,
    threads: int = 1,
    address: str | None = None,
) -> tuple[list[str], list[str]]:
    """Runs what is left of the tasks on an engine: "local", "dask" or "ray". Returns what failed, and which
    outputs are missing: none of either where all went well."""
    workers = workers or max(1, (os.cpu_count() or 1) // max(threads, 1))
    todo = left(tasks)
    failed: list[str] = []
    if todo and engine == "local":
        failed = local(todo, program, workers, threads)
    elif todo and engine in ("dask", "ray"):
        failed = {"dask": dask, "ray": ray}[engine](todo, program, workers, threads, address)
    missing = [o for t in tasks for o in t["outputs"] if not Path(o).exists()]
    return failed, missing


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m atlasfit.tiles", description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(dest="what", required=True)
    plan = commands.add_parser("run", help="run what is left of a plan")
    plan.add_argument("work", help="the work folder of `atlasfit tiles plan`, or its plan.json")
    batch = commands.add_parser("batch", help="denoise every scan of a folder")
    batch.add_argument("folder")
    batch.add_argument("-o", "--output", required=True, help="folder for the results")
    batch.add_argument("--options", default="", help="for `atlasfit batch`, for example '--no-uv --points'")
    for one in (plan, batch):
        one.add_argument("--engine", choices=["local", "dask", "ray", "slurm"], default="local")
        one.add_argument("--workers", type=int, help="tasks at a time [default: cores / threads]")
        one.add_argument("--threads", type=int, default=1, help="threads of a task [default: 1]")
        one.add_argument("--address", help="of a Dask scheduler or Ray cluster [default: one of this machine]")
        one.add_argument("--program", help="the program [default: atlasfit of the PATH]")
        one.add_argument("--sbatch", default="", help="options for sbatch, for example '-p long -t 2:00:00'")
        one.add_argument("--scripts", help="folder for Slurm's script [default: slurm in the work folder]")
    args = parser.parse_args(arguments)
    program = args.program or os.environ.get("ATLASFIT_PROGRAM") or shutil.which("atlasfit")
    if program is None:
        parser.error("there is no program atlasfit on the PATH: name it with --program")
    if args.what == "run":
        tasks, home = plan_tasks(args.work), Path(args.work)
        home = home if home.is_dir() else home.parent
    else:
        tasks, home = batch_tasks(args.folder, args.output, shlex.split(args.options)), Path(args.output)
    if args.engine == "slurm":
        scripts = Path(args.scripts) if args.scripts else home / "slurm"
        print(slurm(left(tasks), program, args.threads, scripts, shlex.split(args.sbatch)))
        return 0
    failed, missing = run(tasks, args.engine, program, args.workers, args.threads, args.address)
    for text in failed:
        print(f"failed: {text}", file=sys.stderr)
    for output in missing:
        print(f"missing: {output}", file=sys.stderr)
    print(f"{sum(map(is_done, tasks))} of {len(tasks)} tasks are done")
    return 1 if failed or missing else 0


if __name__ == "__main__":
    sys.exit(main())
