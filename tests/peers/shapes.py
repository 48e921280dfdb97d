"""The benchmark's true surfaces and noisy samples. Needs numpy only.

Shapes: ring, spiral, mobius, bumps, knot, room, box, rack, spikes are made here; any other is a PLY mesh
NAME.ply in the data folder (../shared/data/denoise beside the repository, or --data). Every shape is
centred and scaled to a bounding box whose longest side is 1. Samples are uniform by area, plus isotropic
Gaussian noise. The random numbers are drawn in the order of ../shared/eval/shapes.py, so that the samples are
the same.

usage: shapes.py SHAPE SIGMA TRUTH.ply NOISY.ply [--count N] [--seed N] [--data DIR]
"""
import argparse
import pathlib

import numpy as np

DATA = pathlib.Path(__file__).resolve().parents[3] / "shared" / "data" / "denoise"
TAU = 2 * np.pi


def sheet(rows, columns, at, closed_rows, closed_columns):
    """Triangles of a grid of parameters in [0, 1]^2, mapped by `at`; closed directions wrap round."""
    s = np.linspace(0, 1, rows, endpoint=not closed_rows)
    t = np.linspace(0, 1, columns, endpoint=not closed_columns)
    s, t = (x.ravel() for x in np.meshgrid(s, t, indexing="ij"))
    i = np.arange(rows if closed_rows else rows - 1)
    j = np.arange(columns if closed_columns else columns - 1)
    i, j = (x.ravel() for x in np.meshgrid(i, j, indexing="ij"))

    def index(a, b):
        return (a % rows) * columns + b % columns

    corners = index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)
    triangles = [np.stack([corners[0], corners[k], corners[k + 1]], 1) for k in (1, 2)]
    return np.stack(at(s, t), 1), np.concatenate(triangles)


def ring():
    """A thin torus: radii 1 and 0.03."""

    def at(s, t):
        r = 1.0 + 0.03 * np.cos(TAU * t)
        return r * np.cos(TAU * s), r * np.sin(TAU * s), 0.03 * np.sin(TAU * t)

    return sheet(256, 48, at, True, True)


def spiral():
    """An open tube of radius 0.03 along three turns of a helix."""
    turn = 3 * TAU

    def at(s, t):
        a = turn * s
        tangent = np.stack([-turn * np.sin(a), turn * np.cos(a), 2 + 0 * a], 1)
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        inward = np.stack([-np.cos(a), -np.sin(a), 0 * a], 1)
        side = np.cross(tangent, inward)
        b = TAU * t[:, None]
        centre = np.stack([np.cos(a), np.sin(a), 2 * s - 1], 1)
        return (centre + 0.03 * (np.cos(b) * inward + np.sin(b) * side)).T

    return sheet(800, 24, at, False, True)


def mobius():
    """A band of width 0.8 with half a twist, round a circle of radius 1."""

    def at(s, t):
        a, w = TAU * s, (t - 0.5) * 0.8
        r = 1 + w * np.cos(a / 2)
        return r * np.cos(a), r * np.sin(a), w * np.sin(a / 2)

    return sheet(400, 40, at, False, False)


def ball(radius):
    """A ball whose radius is a function of the angles about its axis and from it."""
    rows, columns = 160, 81

    def at(s, t):
        a, b = TAU * s, np.pi * t
        r = radius(a, b)
        return r * np.cos(a) * np.sin(b), r * np.sin(a) * np.sin(b), r * np.cos(b)

    V, F = sheet(rows, columns, at, True, False)
    # Each pole is one vertex; the triangles between its copies go.
    column = np.arange(len(V)) % columns
    first_of = np.where((column == 0) | (column == columns - 1), column, np.arange(len(V)))
    F = first_of[F][:, ::-1]
    F = F[(F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])]
    used, F = np.unique(F, return_inverse=True)
    return V[used], F.reshape(-1, 3)


def bumps():
    """A ball of radius 1 with bumps of 0.12."""
    return ball(lambda a, b: 1 + 0.12 * np.sin(3 * a) * np.sin(b) ** 3 * np.cos(5 * b))


def knot():
    """A tube of radius 0.25 along a trefoil: the torus knot of 2 and 3."""

    def middle(a):
        r = 2 + np.cos(3 * a)
        return np.stack([r * np.cos(2 * a), r * np.sin(2 * a), np.sin(3 * a)], 1)

    def at(s, t):
        a, b = TAU * s, TAU * t[:, None]
        tangent = middle(a + 1e-5) - middle(a - 1e-5)
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        # From the middle of the torus' tube to the curve: the frame closes without a twist.
        out = middle(a) - np.stack([2 * np.cos(2 * a), 2 * np.sin(2 * a), 0 * a], 1)
        out -= np.einsum("ij,ij->i", out, tangent)[:, None] * tangent
        out /= np.linalg.norm(out, axis=1)[:, None]
        return (middle(a) + 0.25 * (np.cos(b) * out + np.sin(b) * np.cross(out, tangent))).T

    return sheet(400, 32, at, True, True)


def panel(corner, one, two, pitch=0.03):
    """A parallelogram in small triangles, that faces the cross product of its sides."""
    corner, one, two = (np.asarray(x, float) for x in (corner, one, two))
    steps = [2 + int(np.linalg.norm(side) / pitch) for side in (one, two)]
    return sheet(*steps, lambda s, t: (corner + s[:, None] * one + t[:, None] * two).T, False, False)


def together(parts):
    """One mesh of several."""
    first = np.cumsum([0] + [len(V) for V, _ in parts])
    return np.concatenate([V for V, _ in parts]), np.concatenate([F + n for (_, F), n in zip(parts, first)])


def box(low, high, inward=False):
    """The six sides of a box."""
    low, size = np.asarray(low, float), np.subtract(high, low)
    parts = []
    for k in range(3):
        one, two, across = (size * (np.arange(3) == (k + j) % 3) for j in (1, 2, 3))
        for corner, outward in ((low + across, True), (low, False)):
            parts.append(panel(corner, *((one, two) if outward != inward else (two, one))))
    return together(parts)


def rack():
    """A bar of 1 by 0.3 by 0.4 with eight teeth, 0.04 thick and 0.15 high: about three spacings of 16,000
    points.
    """
    high, deep, bottom, top = 0.0, 0.4, -0.3, 0.15
    teeth = [(-0.5 + 0.1 + 0.11 * k, -0.5 + 0.14 + 0.11 * k) for k in range(8)]
    corners = [(-0.5, high)]
    for low, right in teeth:
        corners += [(low, high), (low, top), (right, top), (right, high)]
    corners += [(0.5, high), (0.5, bottom), (-0.5, bottom)]
    parts = []
    for (x, y), (u, v) in zip(corners, corners[1:] + corners[:1]):
        parts.append(panel((x, y, 0), (0, 0, deep), (u - x, v - y, 0)))
    for low, right, under, over in [(-0.5, 0.5, bottom, high)] + [(a, b, high, top) for a, b in teeth]:
        along, up = (right - low, 0, 0), (0, over - under, 0)
        parts += [panel((low, under, deep), along, up), panel((low, under, 0), up, along)]
    return together(parts)


def room():
    """A room of 1 by 0.8 by 0.45, seen from inside, with a table, a cupboard and a bench: closed boxes a
    little above the floor.
    """
    furniture = [
        ((0.15, 0.05, -0.1), (0.4, 0.3, -0.08)),
        ((-0.48, -0.3, -0.22), (-0.36, 0.0, 0.12)),
        ((-0.2, 0.25, -0.22), (0.1, 0.38, -0.13)),
    ]
    return together([box((-0.5, -0.4, -0.225), (0.5, 0.4, 0.225), True)] + [box(*b) for b in furniture])


def spikes():
    """A ball of radius 0.5 with 40 spikes of length 0.45, 0.03 thick at their feet and 0.004 at their tips."""
    golden = np.pi * (3 - 5**0.5)

    def spike(k):
        z = 1 - (2 * k + 1) / 40
        axis = np.array([np.cos(golden * k) * (1 - z * z) ** 0.5, np.sin(golden * k) * (1 - z * z) ** 0.5, z])
        one = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        one /= np.linalg.norm(one)
        two = np.cross(axis, one)

        def at(s, t):
            thick = 0.03 - 0.026 * s[:, None]
            round_ = np.cos(TAU * t)[:, None] * one - np.sin(TAU * t)[:, None] * two
            return ((0.495 + 0.455 * s[:, None]) * axis + thick * round_).T

        return sheet(30, 16, at, False, True)

    return together([ball(lambda a, b: 0.5 + 0 * a)] + [spike(k) for k in range(40)])


def plates(gap):
    """Two parallel squares of side 1, so far apart; they face away from each other."""
    parts = [
        panel((-0.5, -0.5, gap / 2), (1, 0, 0), (0, 1, 0)),
        panel((-0.5, -0.5, -gap / 2), (0, 1, 0), (1, 0, 0)),
    ]
    return together(parts)


def read_ply(path):
    """A binary little-endian PLY of float x, y, z and lists of three int indices."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    words = [line.split() for line in data[:end].decode("ascii").splitlines()]
    count = {w[1]: int(w[2]) for w in words if w[0] == "element"}
    vertex = [w for w in words if w[:2] == ["property", "float"]]
    if ["format", "binary_little_endian", "1.0"] not in words or len(vertex) != 3:
        raise SystemExit("%s: expected a binary little-endian PLY with float x, y, z" % path)
    V = np.frombuffer(data, "<f4", 3 * count["vertex"], end).reshape(-1, 3)
    face = np.dtype([("n", "u1"), ("i", "<i4", 3)])
    F = np.frombuffer(data, face, count["face"], end + 12 * count["vertex"])
    if (F["n"] != 3).any():
        raise SystemExit("%s: expected triangles" % path)
    return V.astype(float), F["i"].astype(np.int64)


def write_ply(path, V, F=None, view=None):
    """Doubles, so that nothing is rounded. `view` is a whole number for each vertex."""
    head = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(V)
    head += "".join("property double %s\n" % c for c in "xyz")
    body = np.asarray(V, "<f8").tobytes()
    if view is not None:
        head += "property int view\n"
        rows = np.empty(len(V), [("at", "<f8", 3), ("view", "<i4")])
        rows["at"], rows["view"] = V, view
        body = rows.tobytes()
    if F is not None:
        head += "element face %d\nproperty list uchar int vertex_indices\n" % len(F)
        faces = np.empty(len(F), [("n", "u1"), ("i", "<i4", 3)])
        faces["n"], faces["i"] = 3, F
        body += faces.tobytes()
    pathlib.Path(path).write_bytes((head + "end_header\n").encode() + body)


def fitted(V, F):
    """Centred, the longest side 1."""
    low, high = V.min(0), V.max(0)
    return (V - (low + high) / 2) / (high - low).max(), F


def clean(name, data=DATA):
    """The true surface: vertices and triangles."""
    made = {
        "ring": ring,
        "spiral": spiral,
        "mobius": mobius,
        "bumps": bumps,
        "knot": knot,
        "room": room,
        "spikes": spikes,
        "rack": rack,
        "box": lambda: box((-0.5, -0.3, -0.2), (0.5, 0.3, 0.2)),
    }
    if name in made:
        return fitted(*made[name]())
    path = pathlib.Path(data) / (name + ".ply")
    if not path.exists():
        raise SystemExit(
            "%s: no such file, and no shape of that name is made here (%s)" % (path, ", ".join(made))
        )
    return fitted(*read_ply(path))


def noisy(V, F, sigma, count=16000, seed=0):
    """Samples of a surface with noise."""
    rng = np.random.default_rng(seed)
    T = V[F]
    area = np.linalg.norm(np.cross(T[:, 1] - T[:, 0], T[:, 2] - T[:, 0]), axis=1)
    T = T[rng.choice(len(F), count, p=area / area.sum())]
    a = np.sqrt(rng.random(count))[:, None]
    b = rng.random(count)[:, None]
    P = (1 - a) * T[:, 0] + a * (1 - b) * T[:, 1] + a * b * T[:, 2]
    return P + rng.normal(0, sigma, P.shape)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("shape")
    parser.add_argument("sigma", type=float)
    parser.add_argument("truth")
    parser.add_argument("noisy")
    parser.add_argument("--count", type=int, default=16000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--data", default=DATA)
    args = parser.parse_args()
    V, F = clean(args.shape, args.data)
    # The judge's spiral, whose samples these are, faces inward.
    write_ply(args.truth, V, F[:, [0, 2, 1]] if args.shape == "spiral" else F)
    write_ply(args.noisy, noisy(V, F, args.sigma, args.count, args.seed))
