"""Compares atlasfit's vertex and face counts with trimesh's and MeshLab's over the zoo of difficult files.

usage: io_zoo_counts.py COUNTS_PROGRAM [FOLDER]  (COUNTS_PROGRAM: cargo build -p atlasfit-io --example counts)

Each file is loaded by trimesh (process=False; STL merged by position, as we and MeshLab do) and by pymeshlab
in a process of its own, since some files crash them. A file counts as agreed when our counts equal those of
one of them. Prints the files that differ and the share that agrees; exit code 1 below 95 %.
"""
import pathlib
import subprocess
import sys

PEER = r"""
import sys, warnings, logging
warnings.filterwarnings("ignore"); logging.disable(logging.CRITICAL)
peer, path = sys.argv[1:]
if peer == "trimesh":
    import trimesh
    kind = path.rsplit(".", 1)[-1].lower()
    g = trimesh.load(path, process=False, maintain_order=True) if kind != "stl" else trimesh.load(path)
    if isinstance(g, trimesh.Scene):
        parts = list(g.geometry.values())
    else:
        parts = [g]
    v = sum(len(p.vertices) for p in parts); f = sum(len(getattr(p, "faces", ())) for p in parts)
else:
    import pymeshlab
    ms = pymeshlab.MeshSet(); ms.load_new_mesh(path)
    v = sum(m.vertex_number() for m in ms); f = sum(m.face_number() for m in ms)
print("COUNTS", v, f)
"""


def peer(name, path):
    try:
        run = subprocess.run(
            [sys.executable, "-c", PEER, name, str(path)], capture_output=True, text=True, timeout=60
        )
    except subprocess.TimeoutExpired:
        return None
    for line in run.stdout.splitlines():
        if line.startswith("COUNTS"):
            return tuple(int(x) for x in line.split()[1:])
    return None


def main():
    program = sys.argv[1]
    folder = pathlib.Path(
        sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).parents[2] / "shared/data/zoo"
    )
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    out = subprocess.run([program, *map(str, files)], capture_output=True, text=True, check=True).stdout
    ours = {}
    for line in out.splitlines():
        name, kind, *rest = line.split("\t")
        ours[name] = (None, rest[0]) if kind == "error" else ((int(rest[0]), int(rest[1])), rest[3])
    loadable, agreed = 0, 0
    for path in files:
        mine, text = ours[str(path)]
        theirs = {name: peer(name, path) for name in ("trimesh", "meshlab")}
        # A peer that "loads" nothing at all has not loaded the file.
        loaded = {n: c for n, c in theirs.items() if c and c != (0, 0)}
        if not loaded:
            continue
        loadable += 1
        if mine in loaded.values():
            agreed += 1
        else:
            print(f"{path.relative_to(folder)}: ours {mine}, {loaded}  {text[:200]}", flush=True)
    share = agreed / max(loadable, 1)
    print(
        f"{agreed} of {loadable} files that trimesh or MeshLab load agree in vertices and faces: "
        f"{100 * share:.1f} %"
    )
    return share < 0.95


if __name__ == "__main__":
    sys.exit(main())
