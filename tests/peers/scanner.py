"""The benchmark's simulated scans: what a sensor sees of a true surface, with the errors that sensors make.
Needs numpy only.

Kinds (the noise is along the ray, sigma where the ray meets the surface at a right angle, more where it
grazes it):
  views          several cameras about the shape; what is hidden from all of them is not in the scan
  outliersP      the same; P (3, 5, 20) percent of the points are strays, half of them anywhere about the
                 shape, half in clusters
  misregistered  the same; each view is turned and moved by about two sigma; the scan says which view a point
                 is of
  quantised      the same; depths are rounded to steps of four sigma
  framesK        the same from K (2, 4) of the cameras, each of which has so many more pixels
  uneven         the same; the density falls along x by a factor of 30; of 1000 with uneven1000
  varied         the same; the noise grows along x by a factor of 20, from sigma / 4.5 to 4.5 sigma
  merged         the same; each point is there twice, a hundredth of sigma apart, as where a scan is merged with
                 a converted copy of itself
  lidar          one turning scanner in a room with furniture, line by line, with points in between where the
                 distance jumps
  stations       three such scanners in the same room, one after the other
  rowsR          the turning scanner again, with R (5, 10, 20) times as many points along a line as lines across
  depth          one depth camera in the same room: it measures the inverse of the depth, with a standard
                 error of sigma, and rounds it to steps of 2.5 sigma: both grow with the square of the depth
  sheetsK        two parallel plates K (3, 4, 5) sigma apart, each seen from its own side
The name of a kind without its number means all of its numbers. Shapes: see shapes.py; lidar,
stations, depth and sheets have their own.

usage: scanner.py cells [--kinds K,...] [--shapes S,...] [--data DIR]
           prints a JSON line per cell: kind and shape
       scanner.py scan SHAPE KIND SIGMA TRUTH.ply SEEN.ply SCAN.ply [--count N] [--seed N] [--data DIR]
Writes the true surface, whose triangles face the sensors that saw them, its seen part, and the scan; prints a
JSON line: how many points and strays the scan has, and the share of the area that was seen.
"""
import argparse
import json
import pathlib
import zlib
from dataclasses import dataclass

import numpy as np

import shapes
from rays import cast

TAU = 2 * np.pi
# Cameras about a shape, and how far they stand from its centre; its longest side is 1.
VIEWS, FAR = 10, 2.5
# Rays that meet the surface at a smaller cosine (80 degrees) do not come back.
LEAST_COSINE = np.cos(np.radians(80))
# The noise of a grazing ray is at most so many times that of one at a right angle.
MOST_GRAZING = 4
# Of a turning scanner: its place in the room, and the elevations of its lines' ends in degrees.
PLACE, LOWEST, HIGHEST = (0.12, -0.08, -0.02), -60, 80
# Of three of them.
STATIONS = (PLACE, (-0.33, 0.18, -0.02), (0.35, -0.2, 0.02))
# Distances of neighbours on a line that differ by more are a jump; that share of them is measured in between.
JUMP, MIXED = 0.05, 0.3
# Of a depth camera: its place in the room, where it looks, and half the width and height of its picture (58 by
# 45 degrees) at a distance of one.
EYE, GAZE, HALF = (-0.28, -0.34, 0.12), (0.4, 0.35, -0.15), (0.56, 0.42)


@dataclass
class Hits:
    """What rays met: place, direction of the ray, cosine of the angle to the normal, station, one entry of
    each per point.
    """

    at: np.ndarray
    ray: np.ndarray
    cosine: np.ndarray
    view: np.ndarray

    def take(self, which):
        return Hits(self.at[which], self.ray[which], self.cosine[which], self.view[which])


def normals(V, F):
    n = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    return n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None]


def look(V, F, origin, directions, view=0):
    """What rays in unit directions meet, and which of them met something."""
    distance, face = cast(V, F, origin, directions)
    cosine = np.abs(np.einsum("ij,ij->i", normals(V, F)[face], directions))
    met = np.where((face >= 0) & (cosine > LEAST_COSINE))[0]
    at = origin + directions[met] * distance[met, None]
    return Hits(at, directions[met], cosine[met], np.full(len(met), view)), met


def cameras(rng):
    """Where the cameras stand, evenly about the shape, and which way is up in their pictures."""
    i = np.arange(VIEWS) + 0.5
    z, turn = 1 - 2 * i / VIEWS, TAU * i * 0.6180339887
    ring = np.sqrt(1 - z * z)
    anyhow, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return (
        FAR * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], 1) @ anyhow,
        rng.normal(size=(VIEWS, 3)),
    )


def pixels(origin, up, pitch, rng):
    """Unit directions through the pixels of a camera that looks at the centre."""
    forward = -origin / np.linalg.norm(origin)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    half = np.sqrt(0.75) / np.sqrt(FAR**2 - 0.75)
    x = np.arange(-half, half, pitch)
    x, y = np.meshgrid(x + pitch * rng.random(), x + pitch * rng.random(), indexing="ij")
    d = forward + x.reshape(-1, 1) * right + y.reshape(-1, 1) * np.cross(right, forward)
    return d / np.linalg.norm(d, axis=1)[:, None]


def views(V, F, count, rng):
    """About so many points, seen by cameras: regular in each picture. The stations too."""
    places, ups = cameras(rng)
    at = lambda pitch: [
        look(V, F, o, pixels(o, up, pitch, rng), k)[0] for k, (o, up) in enumerate(zip(places, ups))
    ]
    coarse = 0.02
    pitch = coarse * np.sqrt(sum(len(h.at) for h in at(coarse)) / count)
    seen = at(pitch)
    return (
        Hits(*(np.concatenate([getattr(h, name) for h in seen]) for name in ("at", "ray", "cosine", "view"))),
        places,
    )


def along(hits, sigma, rng):
    """The points with noise along their rays."""
    grazing = np.minimum(1 / hits.cosine, MOST_GRAZING)
    return hits.at + hits.ray * (sigma * grazing * rng.normal(size=len(hits.at)))[:, None]


def plain(V, F, sigma, count, rng):
    hits, places = views(V, F, count, rng)
    return along(hits, sigma, rng), places, 0


def outliers(percent):
    def scan(V, F, sigma, count, rng):
        strays = round(count * percent / 100)
        points, places, _ = plain(V, F, sigma, count - strays, rng)
        low, high = V.min(0) - 0.2, V.max(0) + 0.2
        anywhere = rng.uniform(low, high, (strays - strays // 2, 3))
        clusters = (
            rng.uniform(low, high, (8, 3))[rng.integers(0, 8, strays // 2)]
            + rng.normal(0, 0.02, (strays // 2, 3))
        )
        return rng.permutation(np.concatenate([points, anywhere, clusters])), places, strays

    return scan


def misregistered(V, F, sigma, count, rng):
    hits, places = views(V, F, count, rng)
    points = along(hits, sigma, rng)
    for k in range(VIEWS):
        axis, move = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
        # A turn of four sigma moves what lies half a side from the centre by two.
        of = hits.view == k
        points[of] = rotated(points[of], axis, 4 * sigma) + 2 * sigma * move
    return points, places, 0, hits.view


def rotated(P, axis, angle):
    """Points turned about an axis through the origin (Rodrigues)."""
    along_axis = np.outer(P @ axis, axis) * (1 - np.cos(angle))
    return P * np.cos(angle) + np.cross(axis, P) * np.sin(angle) + along_axis


def rounded(hits, places, sigma, rng):
    points = along(hits, 0.3 * sigma, rng)
    step = 4 * sigma
    # Depth is along the camera's axis, not along the ray.
    forward = -places[hits.view] / FAR
    depth = np.einsum("ij,ij->i", points - places[hits.view], forward)
    more = (np.round(depth / step) * step - depth) / np.einsum("ij,ij->i", hits.ray, forward)
    return points + hits.ray * more[:, None], places, 0


def quantised(V, F, sigma, count, rng):
    return rounded(*views(V, F, count, rng), sigma, rng)


def frames(cameras):
    """A few of the cameras about the shape."""

    def scan(V, F, sigma, count, rng):
        hits, places = views(V, F, count * VIEWS // cameras, rng)
        apart = VIEWS // cameras
        few = np.arange(cameras) * apart
        hits = hits.take(np.isin(hits.view, few))
        hits.view //= apart
        return rounded(hits, places[few], sigma, rng)

    return scan


def uneven(fall):
    """The density falls along x by this factor."""
    # So many rays are cast that the densest end has enough.
    more = int(np.ceil(np.log(fall)))

    def scan(V, F, sigma, count, rng):
        hits, places = views(V, F, more * count, rng)
        x = (hits.at[:, 0] - V[:, 0].min()) / np.ptp(V[:, 0])
        share = fall**-x
        hits = hits.take(rng.random(len(x)) < share * count / share.sum())
        return along(hits, sigma, rng), places, 0

    return scan


def varied(V, F, sigma, count, rng):
    hits, places = views(V, F, count, rng)
    x = (hits.at[:, 0] - V[:, 0].min()) / np.ptp(V[:, 0])
    return along(hits, sigma * 20.0 ** (x - 0.5), rng), places, 0


def merged(V, F, sigma, count, rng):
    points, places, _ = plain(V, F, sigma, count // 2, rng)
    copy = points + rng.normal(0, 0.01 * sigma, points.shape)
    return rng.permutation(np.concatenate([points, copy])), places, 0


def lidar(V, F, sigma, count, rng, place=PLACE, dense=1):
    place, (low, high) = np.array(place), np.radians([LOWEST, HIGHEST])
    step = np.sqrt(TAU * (high - low) / count)
    across, along_line = step * np.sqrt(dense), step / np.sqrt(dense)
    azimuth, elevation = np.arange(0, TAU - across / 2, across), np.arange(low, high, along_line)
    a, e = (x.ravel() for x in np.meshgrid(azimuth, elevation, indexing="ij"))
    directions = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], 1)
    hits, met = look(V, F, place, directions)
    points = along(hits, sigma, rng)
    # The neighbour before it on the line.
    distance = np.linalg.norm(hits.at - place, axis=1)
    jump = (np.diff(met) == 1) & (met[1:] % len(elevation) != 0) & (np.abs(np.diff(distance)) > JUMP)
    mixed = 1 + np.where(jump & (rng.random(len(jump)) < MIXED))[0]
    between = rng.random(len(mixed)) * (distance[mixed - 1] - distance[mixed])
    points[mixed] += hits.ray[mixed] * between[:, None]
    return points, place[None], len(mixed)


def rows(dense):
    return lambda V, F, sigma, count, rng: lidar(V, F, sigma, count, rng, dense=dense)


def stations(V, F, sigma, count, rng):
    scans = [lidar(V, F, sigma, count // len(STATIONS), rng, place) for place in STATIONS]
    points, places, strays = zip(*scans)
    return np.concatenate(points), np.concatenate(places), sum(strays)


def picture():
    """The axes of a depth camera: to the right, up, and where it looks."""
    forward = np.array(GAZE) - np.array(EYE)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(right, forward), forward])


def depth(V, F, sigma, count, rng):
    pitch = np.sqrt(4 * HALF[0] * HALF[1] / count)
    x, y = (np.arange(-half + pitch / 2, half, pitch) for half in HALF)
    x, y = (c.ravel() for c in np.meshgrid(x, y, indexing="ij"))
    d = np.stack([x, y, np.ones_like(x)], 1) @ picture()
    length = np.linalg.norm(d, axis=1)
    hits, met = look(V, F, np.array(EYE), d / length[:, None])
    inverse = length[met] / np.linalg.norm(hits.at - EYE, axis=1) + sigma * rng.normal(size=len(met))
    step = 2.5 * sigma
    return EYE + d[met] / (np.round(inverse / step) * step)[:, None], np.array([EYE]), 0


# By name: how it is scanned, and the shape of its own, of which it is told the sigma; no such: any shape.
KINDS = {
    "views": (plain, None),
    **{"outliers%d" % p: (outliers(p), None) for p in (3, 5, 20)},
    "misregistered": (misregistered, None),
    "quantised": (quantised, None),
    **{"frames%d" % k: (frames(k), None) for k in (2, 4)},
    "uneven": (uneven(30.0), None),
    "uneven1000": (uneven(1000.0), None),
    "varied": (varied, None),
    "merged": (merged, None),
    "lidar": (lidar, ("room", lambda sigma: shapes.room())),
    **{"rows%d" % r: (rows(r), ("room", lambda sigma: shapes.room())) for r in (5, 10, 20)},
    "stations": (stations, ("room", lambda sigma: shapes.room())),
    "depth": (depth, ("room", lambda sigma: shapes.room())),
    **{"sheets%d" % k: (plain, ("plates", lambda sigma, k=k: shapes.plates(k * sigma))) for k in (3, 4, 5)},
}
MADE = ["bumps", "knot", "ring", "spiral"]


def seen_sides(V, F, places, reach=None):
    """For each triangle how many more of the places see its front than its back, and which are seen at all:
    those whose centroid is. `reach` says which directions a place looks at."""
    normal, centroid = normals(V, F), V[F].mean(1)
    side, seen = np.zeros(len(F), int), np.zeros(len(F), bool)
    for place in places:
        d = centroid - place
        cosine = np.einsum("ij,ij->i", normal, d) / np.linalg.norm(d, axis=1)
        asked = np.where((np.abs(cosine) > LEAST_COSINE) & (True if reach is None else reach(d)))[0]
        distance, _ = cast(V, F, place, d[asked])
        free = asked[distance > 1 - 1e-6]
        side[free] -= np.sign(cosine[free]).astype(int)
        seen[free] = True
    return side, seen


def in_lidar_reach(d):
    elevation = np.degrees(np.arcsin(d[:, 2] / np.linalg.norm(d, axis=1)))
    return (LOWEST < elevation) & (elevation < HIGHEST)


def in_picture(d):
    x, y, z = (d @ picture().T).T
    return (z > 0) & (np.abs(x) < HALF[0] * z) & (np.abs(y) < HALF[1] * z)


def scan(shape, kind, sigma, count=16000, seed=0, data=shapes.DATA):
    """The points; the true surface, turned to the sensors; which of its triangles were seen; the number of
    strays; the view of each point, where the scan is to tell.
    """
    how, own = KINDS[kind]
    V, F = shapes.fitted(*own[1](sigma)) if own else shapes.clean(shape, data)
    rng = np.random.default_rng([seed, zlib.crc32(("%s %s" % (shape, kind)).encode())])
    points, places, strays, *view = how(V, F, sigma, count, rng)
    turning = kind in ("lidar", "stations") or kind.startswith("rows")
    reach = in_lidar_reach if turning else in_picture if kind == "depth" else None
    side, seen = seen_sides(V, F, places, reach)
    F = np.where((side < 0)[:, None], F[:, [0, 2, 1]], F)
    return points, V, F, seen, strays, *(view or [None])


def cells(kinds, names, data):
    """Pairs of a kind and a shape. Names without their number stand for all of their numbers."""
    asked = []
    for kind in kinds or KINDS:
        meant = [k for k in KINDS if k == kind or k.rstrip("0123456789") == kind]
        if not meant:
            raise SystemExit("%s is no kind of scan. Give some of %s" % (kind, ", ".join(KINDS)))
        asked += [k for k in meant if k not in asked]
    names = names or MADE + sorted(p.stem for p in pathlib.Path(data).glob("*.ply"))
    return [(kind, shape) for kind in asked for shape in ([KINDS[kind][1][0]] if KINDS[kind][1] else names)]


def part(V, F):
    """The vertices that triangles use, and the triangles."""
    used, F = np.unique(F, return_inverse=True)
    return V[used], F.reshape(-1, 3)


def main():
    listed = lambda text: [w for w in text.split(",") if w]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("cells")
    one.add_argument("--kinds", type=listed, default=[])
    one.add_argument("--shapes", type=listed, default=[])
    two = commands.add_parser("scan")
    for name in ("shape", "kind"):
        two.add_argument(name)
    two.add_argument("sigma", type=float)
    for name in ("truth", "seen", "scan"):
        two.add_argument(name)
    two.add_argument("--count", type=int, default=16000)
    two.add_argument("--seed", type=int, default=0)
    for command in (one, two):
        command.add_argument("--data", default=shapes.DATA)
    args = parser.parse_args()
    if args.command == "cells":
        for kind, shape in cells(args.kinds, args.shapes, args.data):
            print(json.dumps({"kind": kind, "shape": shape}))
        return
    points, V, F, seen, strays, view = scan(args.shape, args.kind, args.sigma, args.count, args.seed, args.data)
    if not seen.any():
        raise SystemExit("%s: no triangle of it was seen" % args.shape)
    area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1)
    shapes.write_ply(args.truth, V, F)
    shapes.write_ply(args.seen, *part(V, F[seen]))
    shapes.write_ply(args.scan, points, view=view)
    print(json.dumps({"points": len(points), "strays": strays, "seen": area[seen].sum() / area.sum()}))


if __name__ == "__main__":
    main()
