"""Surfaces of scans by one or several builds, each from two sides, on one picture: defects that no figure
names are seen at once.

usage: contact_sheet.py OUT.png --program NAME=ATLASFIT... [--tile 240] [--z-up STEM,...] SCAN...
  A row a scan; for each program the surface of `denoise` with defaults (no UVs), seen from the front and from
  behind, 20 degrees above; faces seen from behind are orange. The last program draws all pictures.
Needs Pillow. Ends with 1 if a program fails.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw

# Azimuth and elevation in degrees.
SIDES = ("30,20", "210,20")
# Height of a line of text in pixels.
TEXT = 14
# Greys and the orange of back faces: more make the file larger, not clearer.
COLOURS = 32


def surface(program, scan, out):
    """Whether `program` wrote the surface of a scan."""
    command = [program, "denoise", scan, "-o", out, "--no-uv", "--quiet"]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        print(f"{scan.stem}: {run.stderr.strip()}", file=sys.stderr)
    return run.returncode == 0


def picture(program, mesh, view, up, tile, out):
    """The mesh from one side."""
    how = ["--view", view, "--up", up, "--size", f"{tile}x{tile}", "--plain", "--quiet"]
    subprocess.run([program, "render", mesh, "-o", out, *how], check=True)
    return Image.open(out).convert("RGB")


def main():
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--program", action="append", required=True, metavar="NAME=ATLASFIT")
    parser.add_argument("--tile", type=int, default=240)
    parser.add_argument("--z-up", default="", help="stems of the scans whose third axis is up")
    parser.add_argument("scans", nargs="+", type=pathlib.Path)
    args = parser.parse_args()
    programs = [p.split("=", 1) for p in args.program]
    width, height = len(SIDES) * len(programs) * args.tile, args.tile + TEXT
    sheet = Image.new("RGB", (width, height * len(args.scans)), "white")
    draw = ImageDraw.Draw(sheet)
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        mesh, shot = pathlib.Path(folder, "surface.glb"), pathlib.Path(folder, "shot.png")
        for row, scan in enumerate(args.scans):
            up = "z" if scan.stem in args.z_up.split(",") else "y"
            for column, (name, program) in enumerate(programs):
                left, top = column * len(SIDES) * args.tile, row * height
                draw.text((left + 4, top + 1), f"{scan.stem}, {name}", fill="black")
                if not surface(program, scan, mesh):
                    failed = True
                    continue
                for side, view in enumerate(SIDES):
                    tile = picture(programs[-1][1], mesh, view, up, args.tile, shot)
                    sheet.paste(tile, (left + side * args.tile, top + TEXT))
                mesh.unlink()
    sheet.quantize(COLOURS).save(args.out, optimize=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
