"""UV layouts of meshes, each beside its model in the colours of the charts from two sides, on one picture:
slivers, ragged seams and charts that nobody would cut so are seen at once.

usage: uv_sheet.py OUT.png PROGRAM [--tile 120] [--columns 5] MESH... [-- OPTION...]
  Options after -- go to `unwrap`. Above each: its name, the number of charts, the length of seams over the
  square root of the area, the share of the page that is covered.
Needs Pillow. Ends with 1 if the program fails.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw

# Azimuth and elevation in degrees.
SIDES = ("30,20", "210,20")
# Height of a line of text in pixels.
TEXT = 14
# More colours make the file larger, not clearer.
COLOURS = 64


def picture(program, mesh, out, how, size):
    """The mesh as `render` shows it."""
    how = [*how, "--size", f"{size}x{size}", "--plain", "--quiet"]
    subprocess.run([program, "render", mesh, "-o", out, *how], check=True)
    return Image.open(out).convert("RGB")


def main():
    given = sys.argv[1:]
    own, options = (given[: given.index("--")], given[given.index("--") + 1 :]) if "--" in given else (given, [])
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("program")
    parser.add_argument("--tile", type=int, default=120)
    parser.add_argument("--columns", type=int, default=5)
    parser.add_argument("meshes", nargs="+", type=pathlib.Path)
    args = parser.parse_args(own)
    width, height = (1 + len(SIDES)) * args.tile, args.tile + TEXT
    rows = -(-len(args.meshes) // args.columns)
    sheet = Image.new("RGB", (width * args.columns, height * rows), "white")
    draw = ImageDraw.Draw(sheet)
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        laid, shot = pathlib.Path(folder, "laid.obj"), pathlib.Path(folder, "shot.png")
        for i, mesh in enumerate(args.meshes):
            x, y = i % args.columns * width, i // args.columns * height
            command = [args.program, "unwrap", mesh, "-o", laid, "--json", *options]
            run = subprocess.run(command, capture_output=True, text=True)
            if run.returncode:
                print(f"{mesh.stem}: {run.stderr.strip()}", file=sys.stderr)
                failed = True
                continue
            told = json.loads(run.stdout)
            charts = "1 chart" if told["charts"] == 1 else f"{told['charts']} charts"
            words = f"{mesh.stem}: {charts}, {told['seam']:.1f}, {100 * told['coverage']:.0f} %"
            draw.text((x + 2, y + 1), words, "black")
            views = [["--mode", "uv"]] + [["--mode", "charts", "--view", side] for side in SIDES]
            for column, how in enumerate(views):
                tile = picture(args.program, laid, shot, how, args.tile)
                sheet.paste(tile, (x + column * args.tile, y + TEXT))
    sheet.quantize(COLOURS).save(args.out, optimize=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
