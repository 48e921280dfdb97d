"""The classic primitives, of quads, unwrapped: what comes of each beside what a person would do.

usage: primitives.py FOLDER PROGRAM...
  Writes the twelve meshes into FOLDER as OBJ and prints a table: for each PROGRAM, in turn, the number of charts,
  the seams over the square root of the area, and the share of the page that is covered.
  `uv_sheet.py OUT.png PROGRAM FOLDER/*.obj` draws them.
Needs numpy. Ends with 1 if a program fails.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from made import torus

TURN = 2 * np.pi


def grid(n, m, place, closed_u, closed_v):
    """Vertices and faces of n by m quads; place(u, v) gives the points for shares of the way along both."""
    i, j = np.meshgrid(np.arange(n + (not closed_u)), np.arange(m + (not closed_v)), indexing="ij")
    rows, columns = i.shape
    at = lambda a, b: (a % rows) * columns + b % columns
    a, b = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    faces = np.stack([at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)], 1)
    return np.stack(np.broadcast_arrays(*place(i.ravel() / n, j.ravel() / m)), 1), faces.tolist()


def revolved(n, m, profile):
    """A surface of revolution: profile(v) gives radius and height."""

    def place(u, v):
        r, z = profile(v)
        return r * np.cos(TURN * u), r * np.sin(TURN * u), z

    return grid(n, m, place, True, False)


def swept(n, m, radius, curve, closed):
    """A tube of this radius about curve(u), with frames that turn little."""
    u = np.arange(n + (not closed)) / n
    middle = np.stack(curve(u), 1)
    along = (np.stack(curve(u + 1e-5), 1) - np.stack(curve(u - 1e-5), 1)) / 2e-5
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.cross(along, [0.1, 0.2, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(side, along)
    place = lambda u, v: tuple(
        (
            middle[np.rint(u * n).astype(int)]
            + radius * np.cos(TURN * v)[:, None] * side[np.rint(u * n).astype(int)]
            + radius * np.sin(TURN * v)[:, None] * up[np.rint(u * n).astype(int)]
        ).T
    )
    return grid(n, m, place, closed, True)


def capped(n, m, profile):
    """A surface of revolution, its two ends closed by a polygon each."""
    vertices, faces = revolved(n, m, profile)
    ends = [[i * (m + 1) for i in range(n)][::-1], [i * (m + 1) + m for i in range(n)]]
    return vertices, faces + ends


def cone(n):
    rim = [[np.cos(TURN * i / n), np.sin(TURN * i / n), 0.0] for i in range(n)]
    return np.array([*rim, [0, 0, 2.0]]), [[i, (i + 1) % n, n] for i in range(n)] + [list(range(n))[::-1]]


def cube():
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float), faces


def ball(n, m):
    """Rings of quads between two poles of triangles."""
    ring = lambda v: (np.sin(np.pi * (v * (m - 2) + 1) / m), np.cos(np.pi * (v * (m - 2) + 1) / m))
    vertices, faces = revolved(n, m - 2, ring)
    top, rows = len(vertices), m - 1
    for i in range(n):
        j = (i + 1) % n
        faces += [[top, i * rows, j * rows], [i * rows + m - 2, top + 1, j * rows + m - 2]]
    return np.vstack([vertices, [[0, 0, 1], [0, 0, -1]]]), faces


def cube_ball(n):
    """A cube of n by n quads a side, blown up."""
    number, faces = {}, []
    for axis in range(3):
        for end in (0, n):
            for i in range(n):
                for j in range(n):
                    corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    face = []
                    for a, b in corners if end else corners[::-1]:
                        p = [0, 0, 0]
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = end, a, b
                        face.append(number.setdefault(tuple(p), len(number)))
                    faces.append(face)
    p = np.tan((np.array(list(number)) / n - 0.5) * np.pi / 2)
    return p / np.linalg.norm(p, axis=1)[:, None], faces


# Name, mesh, and what a person would do.
PRIMITIVES = {
    "cube": (cube, "a cross of six squares, or strips of them"),
    "cylinder": (lambda: capped(32, 4, lambda v: (1 + 0 * v, 2 * v)), "two discs; the side a strip"),
    "tube": (lambda: revolved(32, 8, lambda v: (1 + 0 * v, 2 * v)), "a rectangle, cut open once"),
    "cone": (lambda: cone(32), "a disc; the side a sector, cut open once"),
    "ball": (lambda: ball(32, 16), "two halves, or segments from pole to pole"),
    "cube ball": (lambda: cube_ball(12), "six sides, in a cross or alone"),
    "torus": (lambda: torus(48, 12, tube=0.25), "strips about the ring, cut across"),
    "ring": (lambda: torus(64, 8, tube=0.08), "strips about the ring"),
    "pipe": (
        lambda: swept(60, 12, 0.2, lambda u: (4 * u - 2, np.sin(TURN * u), 0 * u), False),
        "one strip, cut open along it",
    ),
    "spring": (
        lambda: swept(
            160, 10, 0.15, lambda u: (np.cos(4 * TURN * u), np.sin(4 * TURN * u), 2 * u), False
        ),
        "strips along it",
    ),
    "vase": (
        lambda: revolved(40, 30, lambda v: (0.5 + 0.25 * np.sin(5 * v + 0.3), 2 * v)),
        "a foot and a neck, each cut open along one side",
    ),
    "knot": (
        lambda: swept(
            160,
            12,
            0.25,
            lambda u: (
                np.sin(TURN * u) + 2 * np.sin(2 * TURN * u),
                np.cos(TURN * u) - 2 * np.cos(2 * TURN * u),
                -np.sin(3 * TURN * u),
            ),
            True,
        ),
        "strips along it",
    ),
}


def write(path, vertices, faces):
    lines = ["v {:.7f} {:.7f} {:.7f}".format(*p) for p in vertices]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def main():
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("programs", nargs="+")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    columns = len(args.programs)
    print("| primitive | a person would make |" + " charts, seam, coverage |" * columns)
    print("|---|---|" + "---|" * columns)
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        for name, (make, person) in PRIMITIVES.items():
            mesh = args.folder / f"{name.replace(' ', '_')}.obj"
            write(mesh, *make())
            cells = []
            for program in args.programs:
                command = [program, "unwrap", mesh, "-o", pathlib.Path(folder, "out.obj"), "--json"]
                run = subprocess.run(command, capture_output=True, text=True)
                if run.returncode:
                    print(f"{name}: {run.stderr.strip()}", file=sys.stderr)
                    failed = True
                    cells.append("failed")
                    continue
                told = json.loads(run.stdout)
                cells.append(f"{told['charts']}, {told['seam']:.2f}, {told['coverage']:.3f}")
            print(f"| {name} | {person} | " + " | ".join(cells) + " |")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
