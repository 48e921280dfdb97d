"""Unwraps every readable mesh under the given files and folders, and checks what every layout must satisfy.

usage: unwrap_zoo.py [--program atlasfit] [--seconds N] PATH...

Checked for each mesh with faces: the same vertices and faces in the same order; no flip, no overlap (the
program's exact measure), nothing collapsed that has area, nothing outside [0, 1], every face in a chart. A
mesh that cannot be read, or has no area at all, must end with an error of one line, not with a crash or a
hang. Exit code 1 if anything fails.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

SUFFIXES = {".ply", ".obj", ".off", ".stl", ".glb", ".gltf"}


def text_of(path):
    """An OBJ file as text; it may begin with a byte order mark, and comments may be in any encoding."""
    return path.read_text(encoding="utf-8-sig", errors="replace")


def vertices_of(path):
    """The vertices of an OBJ file as they are written there."""
    lines = text_of(path).splitlines()
    return [words[1:] for words in map(str.split, lines) if words[:1] == ["v"]]


def read_obj(path):
    """Vertices as text, faces as vertex numbers, and the texture coordinates of each face's corners."""
    vertices, texture, faces, corners = [], [], [], []
    for line in filter(str.strip, text_of(path).splitlines()):
        key, *words = line.split()
        if key == "v":
            vertices.append(words)
        elif key == "vt":
            texture.append([float(w) for w in words])
        elif key == "f":
            parts = [w.split("/") for w in words]
            faces.append([int(p[0]) for p in parts])
            corners.append([texture[int(p[1]) - 1] if len(p) > 1 and p[1] else None for p in parts])
    return vertices, faces, corners


def check(program, path, folder, seconds):
    """What happened, and what was wrong."""
    out, plain = folder / "out.obj", folder / "plain.obj"
    for f in (out, plain):
        f.unlink(missing_ok=True)
    try:
        done = subprocess.run(
            [program, "unwrap", path, "-o", out, "--json", "--quiet"],
            capture_output=True,
            text=True,
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        return "hang", ["does not end within %d s" % seconds]
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        clear = done.returncode in (1, 2) and len(lines) == 1 and "internal" not in lines[0]
        wrong = [] if clear else ["exit code %d: %s" % (done.returncode, done.stderr[:300])]
        return (
            "refused: " + (lines or [""])[-1][:140],
            wrong + (["an output in spite of the error"] if out.exists() else []),
        )
    said = json.loads(done.stdout)
    wrong = ["%s: %d" % (k, said[k]) for k in ("flips", "overlapping_faces", "collapsed") if said[k]]
    subprocess.run(
        [program, "convert", path, plain, "--quiet"], check=True, capture_output=True, timeout=seconds
    )
    (v, f, uv), (w, g, _) = read_obj(out), read_obj(plain)
    # An OBJ file keeps how it is written.
    if v != w and not (path.suffix.lower() == ".obj" and v == vertices_of(path)):
        wrong.append("vertices changed")
    if f != g and not said["split_polygons"]:
        wrong.append("faces changed")
    if not all(c and 0 <= c[0] <= said["pages"] and 0 <= c[1] <= 1 for face in uv for c in face):
        wrong.append("corners without UVs, or outside of the page")
    stretch = said["stretch_p95"]
    return "%d faces, %d charts, 95%% %s" % (len(f), said["charts"], stretch and round(stretch, 3)), wrong


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--program", default="target/debug/atlasfit")
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("paths", nargs="+", type=pathlib.Path)
    args = parser.parse_args()
    files = [
        f
        for p in args.paths
        for f in (sorted(p.rglob("*")) if p.is_dir() else [p])
        if f.suffix.lower() in SUFFIXES
    ]
    failed = unwrapped = 0
    with tempfile.TemporaryDirectory() as folder:
        for path in files:
            what, wrong = check(args.program, path, pathlib.Path(folder), args.seconds)
            unwrapped += not what.startswith("refused")
            failed += bool(wrong)
            print(
                "%s %s: %s%s" % ("FAIL" if wrong else "ok  ", path, what, "".join("; " + w for w in wrong)),
                flush=True,
            )
    print("%d files, %d unwrapped, %d failed" % (len(files), unwrapped, failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
