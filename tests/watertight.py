"""Whether `atlasfit denoise --watertight` gives solids: closed, two-manifold, consistently oriented, outward,
without self-intersections.

usage: watertight.py [--program ATLASFIT] [--noise 0.005] [--points 30000] [--keep FOLDER] FILE...
  A FILE with faces is a clean shape: points are drawn on it, with noise (in its longest sides), and the
  surface is judged against it.
  A FILE without faces is a scan, and so is one given as scan:FILE (its vertices).
A line a file: whether the solid is one (what is wrong otherwise), its parts, pairs of triangles that meet,
the share of its area that is marked as extrapolated, rms distance to the truth where there are data (of the
open surface, of the solid's unmarked triangles), and of the truth to both, smallest angle (1% quantile,
degrees), vertices and seconds of both. Ends with 1 if one is no solid. Needs numpy and scipy; igl makes
distances exact.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile
import time
from fractions import Fraction

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

ROOT = pathlib.Path(__file__).resolve().parents[1]
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}


def read_ply(path):
    """The columns of the vertices of a binary PLY by name, and its triangles. Lists of the vertices or strips
    are not read.
    """
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    elements = []
    for line in head.decode("latin1").splitlines():
        words = line.split()
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    at, columns, faces = 0, {}, np.zeros((0, 3), np.int64)
    for name, count, properties in elements:
        if name == "vertex":
            kind = np.dtype([(p[1], "<" + TYPES[p[0]]) for p in properties])
            rows = np.frombuffer(body, kind, count, at)
            columns, at = {n: rows[n].astype(float) for n in kind.names}, at + count * kind.itemsize
        elif name == "face" and count:
            parts = []
            for p in properties:
                if p[0] != "list":
                    parts.append((p[1], "<" + TYPES[p[0]]))
                    continue
                # Texture coordinates: two for each corner.
                entries = 3 if p[3].startswith("vertex_ind") else 6
                parts += [(p[3] + " count", "<" + TYPES[p[1]]), (p[3], "<" + TYPES[p[2]], entries)]
            rows = np.frombuffer(body, np.dtype(parts), count, at)
            faces = rows[next(n for n in rows.dtype.names if n in ("vertex_indices", "vertex_index"))].astype(
                np.int64
            )
    return columns, faces


def positions(columns):
    return np.stack([columns[k] for k in "xyz"], -1)


def components(pairs, n):
    """How many pieces n things make that are joined in pairs."""
    graph = coo_matrix((np.ones(len(pairs), bool), pairs.T), (n, n))
    return connected_components(graph, directed=False)[0]


def parts(faces):
    used, at = np.unique(faces, return_inverse=True)
    at = at.reshape(-1, 3)
    return components(np.concatenate([at[:, :2], at[:, 1:]]), len(used))


def wrong(vertices, faces):
    """What keeps triangles from being a closed, oriented two-manifold that faces outward; nothing where they
    are one.
    """
    if not len(faces):
        return "empty"
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forth, back = (np.sort(half[:, k] << 32 | half[:, 1 - k]) for k in (0, 1))
    if (forth[1:] == forth[:-1]).any():
        return "not oriented"
    if (forth != back).any():
        return "open"
    # One fan about every vertex: its triangles, joined across edges, are one piece.
    triangle = np.tile(np.arange(len(faces)), 3)
    corner = lambda v: 3 * triangle + (faces[triangle] == v[:, None]).argmax(1)
    order, reverse = np.lexsort(half.T[::-1]), np.lexsort(half[:, ::-1].T[::-1])
    pairs = np.concatenate(
        [np.stack([corner(half[:, k])[order], corner(half[:, 1 - k])[reverse]], -1) for k in (0, 1)]
    )
    if components(pairs, 3 * len(faces)) != len(np.unique(faces)):
        return "not two-manifold"
    a, b, c = (vertices[faces[:, k]] - vertices.mean(0) for k in range(3))
    return "inward" if (a * np.cross(b, c)).sum() <= 0 else ""


def box_pairs(low, high):
    """Pairs of boxes that meet, in blocks."""
    size = max(np.median((high - low).max(1)) * 2, (high.max(0) - low.min(0)).max() / 1000)
    first, last = (np.floor((x - low.min(0)) / size).astype(np.int64) for x in (low, high))
    spans = last - first + 1
    count = spans.prod(1)
    box = np.repeat(np.arange(len(low)), count)
    index = np.arange(count.sum()) - np.repeat(count.cumsum() - count, count)
    s = spans[box]
    cell = first[box] + np.stack(
        [index // (s[:, 1] * s[:, 2]), index // s[:, 2] % s[:, 1], index % s[:, 2]], -1
    )
    key = (cell[:, 0] << 42) | (cell[:, 1] << 21) | cell[:, 2]
    order = np.argsort(key, kind="stable")
    box, key = box[order], key[order]
    step = 1
    while True:
        same = np.flatnonzero(key[step:] == key[:-step])
        if not len(same):
            return
        i, j = box[same], box[same + step]
        meet = ((low[i] <= high[j]) & (low[j] <= high[i])).all(1)
        yield i[meet], j[meet]
        step += 1


def crosses(p, q, t):
    """Whether segments meet triangles."""
    a, b, c = (t[:, k] - p for k in range(3))
    along = q - p
    side = np.stack([(np.cross(x, y) * along).sum(1) for x, y in ((b, c), (c, a), (a, b))])
    hit = (side >= 0).all(0) | (side <= 0).all(0)
    normal = np.cross(b - a, c - a)
    with np.errstate(all="ignore"):
        share = (normal * a).sum(1) / (normal * along).sum(1)
    return hit & (share >= 0) & (share <= 1)


def meetings(vertices, faces):
    """Pairs of triangles that meet elsewhere than at shared vertices and edges."""
    corners, found = vertices[faces], []
    for i, j in box_pairs(corners.min(1), corners.max(1)):
        common = (faces[i][:, :, None] == faces[j][:, None, :]).any(2)
        shared = common.sum(1)
        bad = np.zeros(len(i), bool)
        for x, y in ((i, j), (j, i)):
            own = (faces[x][:, :, None] == faces[y][:, None, :]).any(2)
            for k in range(3):
                free = np.flatnonzero(~own[:, k] & ~own[:, (k + 1) % 3] & (shared < 2))
                if len(free):
                    bad[free] |= crosses(corners[x[free], k], corners[x[free], (k + 1) % 3], corners[y[free]])
        n = [np.cross(corners[x, 1] - corners[x, 0], corners[x, 2] - corners[x, 0]) for x in (i, j)]
        bad |= (shared == 2) & (
            (n[0] * n[1]).sum(1) < -(1 - 1e-9) * np.linalg.norm(n[0], axis=1) * np.linalg.norm(n[1], axis=1)
        )
        found.append(np.stack([i, j], -1)[bad & (shared < 3)])
    suspects = np.unique(np.sort(np.concatenate(found), 1), axis=0) if found else []
    return sum(meet_exactly(vertices, faces[i], faces[j]) for i, j in suspects)


def meet_exactly(vertices, s, t):
    """Whether two triangles meet elsewhere than at what they share, in rational numbers: rounding makes
    suspects of some in nearly one plane.
    """
    if len(set(s) & set(t)) > 1:
        return True
    point = lambda v: [Fraction(float(x)) for x in vertices[v]]
    minus = lambda a, b: [x - y for x, y in zip(a, b)]
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    dot = lambda a, b: sum(x * y for x, y in zip(a, b))
    volume = lambda a, b, c, d: dot(minus(b, a), cross(minus(c, a), minus(d, a)))
    for one, other in ((s, t), (t, s)):
        a, b, c = map(point, other)
        for u, v in zip(one, np.roll(one, -1)):
            if u in other or v in other:
                continue
            p, q = point(u), point(v)
            low, high = volume(a, b, c, p), volume(a, b, c, q)
            if low * high > 0:
                continue
            if low == high == 0:  # in one plane: not told apart further
                return True
            sides = [volume(p, q, x, y) for x, y in ((a, b), (b, c), (c, a))]
            if all(x >= 0 for x in sides) or all(x <= 0 for x in sides):
                return True
    return False


def areas(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def draw(vertices, faces, n, rng):
    area = areas(vertices, faces)
    f = faces[rng.choice(len(faces), n, p=area / area.sum())]
    u, v = np.sqrt(rng.random((n, 1))), rng.random((n, 1))
    return vertices[f[:, 0]] * (1 - u) + vertices[f[:, 1]] * (u * (1 - v)) + vertices[f[:, 2]] * (u * v)


def rms(of, to, rng, n=20000):
    """Root mean square distance of one surface to the other: to the nearest of many samples, refined on the
    plane there.
    """
    try:
        import igl

        d = igl.point_mesh_squared_distance(
            draw(*of, n, rng), np.ascontiguousarray(to[0]), np.ascontiguousarray(to[1])
        )[0]
        return float(np.sqrt(d.mean()))
    except ImportError:
        d, _ = cKDTree(draw(*to, 2_000_000, rng)).query(draw(*of, n, rng))
        return float(np.sqrt((d**2).mean()))


def least_angle(vertices, faces):
    t = vertices[faces]
    least = np.full(len(t), 180.0)
    for k in range(3):
        a, b = t[:, (k + 1) % 3] - t[:, k], t[:, (k + 2) % 3] - t[:, k]
        cos = (a * b).sum(1) / np.maximum(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), 1e-300)
        least = np.minimum(least, np.degrees(np.arccos(np.clip(cos, -1, 1))))
    return np.quantile(least, 0.01)


def denoise(program, scan, out, *more):
    start = time.time()
    done = subprocess.run(
        [program, "denoise", scan, "-o", out, "--no-uv", "--quiet", *more], capture_output=True, text=True
    )
    if done.returncode:
        sys.exit(f"{scan}: {done.stderr}")
    return time.time() - start


def judge(name, program, options, folder):
    path, rng = pathlib.Path(name.removeprefix("scan:")), np.random.default_rng(1)
    truth = None
    scan = path
    if not name.startswith("scan:") and path.suffix == ".ply":
        columns, faces = read_ply(path)
        if len(faces):
            truth = positions(columns), faces
            size = np.ptp(truth[0], axis=0).max()
            points = (
                draw(*truth, options.points, rng)
                + rng.normal(size=(options.points, 3)) * options.noise * size
            )
            scan = folder / f"{path.stem}.scan.xyz"
            np.savetxt(scan, points, fmt="%.9g")
    out = [folder / f"{path.stem}.{k}.ply" for k in ("open", "solid")]
    seconds = denoise(program, scan, out[0]), denoise(program, scan, out[1], "--watertight")
    (columns, faces), (before, before_faces) = read_ply(out[1]), read_ply(out[0])
    vertices, before = positions(columns), positions(before)
    fault, meet = wrong(vertices, faces), meetings(vertices, faces)
    marked = columns["extrapolated"][faces].max(1) > 0
    area = areas(vertices, faces)
    far = ""
    if truth:
        known = faces[~marked]
        figures = [
            rms(a, b, rng) / size
            for a, b in (
                ((before, before_faces), truth),
                ((vertices, known), truth),
                (truth, (before, before_faces)),
                (truth, (vertices, faces)),
            )
        ]
        far = "acc {:.5f} > {:.5f}  com {:.5f} > {:.5f}  ".format(*figures)
    print(
        f"{path.stem:24} {fault or 'solid':16} parts {parts(faces):4}  meet {meet:3}  "
        f"marked {area[marked].sum() / area.sum():6.2%}  {far}"
        f"angle {least_angle(vertices, faces):4.1f}  vertices {len(before)} > {len(vertices)}  "
        f"seconds {seconds[0]:.1f} > {seconds[1]:.1f}",
        flush=True,
    )
    return not fault and not meet


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--program", default=ROOT / "target" / "release" / "atlasfit")
    parser.add_argument("--noise", type=float, default=0.005)
    parser.add_argument("--points", type=int, default=30000)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = options.keep or pathlib.Path(made)
        folder.mkdir(parents=True, exist_ok=True)
        return all([judge(f, options.program, options, folder) for f in options.files])


if __name__ == "__main__":
    sys.exit(not main())
