"""The benchmark's true surfaces and noisy samples. Needs numpy only.

Shapes: ring, spiral, mobius are made here; any other name is a binary PLY mesh NAME.ply in the data folder (../shared/data/denoise beside
the repository, or --data). Every shape is centred and scaled to a bounding box whose longest side is 1. Samples are uniform by area, plus
isotropic Gaussian noise. The random numbers are drawn in the order of ../shared/eval/shapes.py, so that the samples are the same.

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


def write_ply(path, V, F=None):
    """Doubles, so that nothing is rounded."""
    head = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(V)
    head += "".join("property double %s\n" % c for c in "xyz")
    body = np.asarray(V, "<f8").tobytes()
    if F is not None:
        head += "element face %d\nproperty list uchar int vertex_indices\n" % len(F)
        faces = np.empty(len(F), [("n", "u1"), ("i", "<i4", 3)])
        faces["n"], faces["i"] = 3, F
        body += faces.tobytes()
    pathlib.Path(path).write_bytes((head + "end_header\n").encode() + body)


def clean(name, data=DATA):
    """The true surface: vertices and triangles."""
    made = {"ring": ring, "spiral": spiral, "mobius": mobius}
    V, F = made[name]() if name in made else read_ply(pathlib.Path(data) / (name + ".ply"))
    low, high = V.min(0), V.max(0)
    return (V - (low + high) / 2) / (high - low).max(), F


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
    write_ply(args.truth, V, F)
    write_ply(args.noisy, noisy(V, F, args.sigma, args.count, args.seed))
