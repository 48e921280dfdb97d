#!/usr/bin/env python3
"""Says whether two builds of the program give the same bytes, for changes that must not change any result.

    tests/same_bytes.py OLD NEW [--data FOLDER] [--only WORD]
    tests/same_bytes.py OLD FILE.json

OLD and NEW are builds of the program. Each case is one command; what it writes and reports is compared byte
for byte, but for times and paths. FILE.json keeps what OLD gave, and then stands for OLD. FOLDER holds scans
and meshes (default: ../shared/data beside the repository); cases whose input is missing there are counted and
left out, those on examples/vase.ply always run. Exit 1 where anything differs.
"""

import argparse
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
VASE = ROOT / "examples" / "vase.ply"
# Name of the case: the input below FOLDER, then the command with its options. {in} and {out} are filled in.
CASES = {
    # The main job on scans of each kind: closed, open, thin, thin tubes, several sheets, colours, outliers,
    # creases, one-sided.
    "vase": (None, "denoise {in} -o {out}.glb --points {out}.ply --bake --outliers drop"),
    "bunny": ("denoise/bunny.ply", "denoise {in} -o {out}.ply --points {out}.points.ply"),
    "bunny, given noise": (
        "denoise/bunny.ply",
        "denoise {in} -o {out}.ply --noise 0.002 --detail 0.7 --seed 7",
    ),
    "chair, few charts": ("denoise/chair.ply", "denoise {in} -o {out}.glb --charts 40"),
    "cup, detail": ("denoise/cup.ply", "denoise {in} -o {out}.ply --detail 1.5 --no-uv"),
    "owl": ("scans/owl_sfm.ply", "denoise {in} -o {out}.obj --points {out}.ply --fill-holes 0.5"),
    "black vase": ("scans/blackvase_sfm.ply", "denoise {in} -o {out}.glb"),
    "building": ("scans/building_lidar.ply", "denoise {in} -o {out}.ply"),
    "kinect": ("torture/kinect.ply", "denoise {in} -o {out}.ply"),
    "outliers": ("torture/outl20.ply", "denoise {in} -o {out}.ply --outliers drop --points {out}.points.xyz"),
    "cad": ("torture/cad2.ply", "denoise {in} -o {out}.ply --no-uv"),
    "net": ("torture/net.ply", "denoise {in} -o {out}.ply --no-uv"),
    # The paper's networks.
    "networks": (None, "denoise {in} -o {out}.ply --prior mlp --no-uv"),
    "convolutional": ("denoise/chair.ply", "denoise {in} -o {out}.ply --prior conv --no-uv"),
    "level set": ("denoise/chair.ply", "denoise {in} -o {out}.ply --prior level-set --no-uv"),
    # UVs.
    "cow": ("uv/cow.ply", "unwrap {in} -o {out}.obj"),
    "elephant": ("uv/elephant.ply", "unwrap {in} -o {out}.glb --max-stretch 1.5"),
    "fertility": ("uv/fertility.ply", "unwrap {in} -o {out}.ply --max-charts 8 --padding 4"),
    "fandisk": ("uv/fandisk.ply", "unwrap {in} -o {out}.ply --hard-edges 40 --packer boxes"),
    "blade": ("uv/blade.ply", "unwrap {in} -o {out}.ply"),
    "nefertiti": ("uv/nefertiti.ply", "unwrap {in} -o {out}.ply --density 300 --pages 3"),
    "homer": ("uv/homer.ply", "unwrap {in} -o {out}.ply --threads 1 --texture-size 512x2048"),
    "knot": ("uv/knot1.ply", "unwrap {in} -o {out}.ply --max-stretch 1.3"),
    "soup": ("torture/uv_soup.obj", "unwrap {in} -o {out}.obj"),
    "keep seams": ("torture/multi.obj", "unwrap {in} -o {out}.obj --keep-uv-seams"),
    "half a million faces": ("uv/dragon_500k.ply", "unwrap {in} -o {out}.ply"),
    # Looking and converting.
    "measure": ("denoise/cup.ply", "measure {in} --against {data}/denoise/bunny.ply"),
    "measure UVs": ("torture/uv_cad.obj", "measure {in}"),
    "info of points": ("scans/birdbath_sfm.ply", "info {in}"),
    "info of a mesh": ("uv/camel.ply", "info {in}"),
    "to GLB": ("scans/owl_sfm.ply", "convert {in} {out}.glb"),
    "to OBJ": ("torture/scene.glb", "convert {in} {out}.obj"),
    "to STL": ("uv/cow.ply", "convert {in} {out}.stl"),
    "picture": ("uv/cow.ply", "render {in} -o {out}.png --boundary"),
}
# What a report says of time and of places in the file system.
VARYING = {
    "seconds", "stages", "files", "scan", "mesh", "file", "input", "output", "result", "against", "memory"
}


def settled(report):
    """A report without what may differ between two runs of one build."""
    if isinstance(report, dict):
        return {k: settled(v) for k, v in report.items() if k not in VARYING}
    return [settled(v) for v in report] if isinstance(report, list) else report


def outputs(program, command, source, data):
    """Digest of each thing that the command writes, by name."""
    with tempfile.TemporaryDirectory() as folder:
        words = [w.format(**{"in": source, "out": f"{folder}/o", "data": data}) for w in command.split()]
        done = subprocess.run([program, *words, "--json", "--quiet"], capture_output=True, text=True)
        text = done.stderr if done.returncode else json.dumps(settled(json.loads(done.stdout)))
        found = {"exit code": str(done.returncode), "report": text.replace(folder, "")}
        for path in sorted(pathlib.Path(folder).iterdir()):
            found[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
        return found


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("old")
    ask.add_argument("new")
    ask.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared" / "data")
    ask.add_argument("--only", default="", help="cases whose name holds this word")
    given = ask.parse_args()
    if given.new.endswith(".json"):
        inputs = {name: given.data / path if path else VASE for name, (path, _) in CASES.items()}
        found = {k: outputs(given.old, CASES[k][1], i, given.data) for k, i in inputs.items() if i.exists()}
        pathlib.Path(given.new).write_text(json.dumps(found, indent=1))
        sys.exit(0)
    kept = json.loads(pathlib.Path(given.old).read_text()) if given.old.endswith(".json") else {}
    differ = skipped = same = 0
    for name, (path, command) in CASES.items():
        source = given.data / path if path else VASE
        if given.only not in name:
            continue
        if not source.exists():
            skipped += 1
            continue
        old = kept.get(name) or outputs(given.old, command, source, given.data)
        new = outputs(given.new, command, source, given.data)
        unlike = [k for k in old.keys() | new.keys() if old.get(k) != new.get(k)]
        if unlike:
            differ += 1
            print(f"DIFFERS  {name}: {', '.join(sorted(unlike))}")
            if "report" in unlike:
                print(f"         {old.get('report')}\n         {new.get('report')}")
        else:
            same += 1
    print(f"{same} the same, {differ} differ, {skipped} left out as their input is not there")
    sys.exit(1 if differ or not same else 0)


if __name__ == "__main__":
    main()
