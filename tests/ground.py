#!/usr/bin/env python3
"""Which way objects on the ground face, and the ground under them. Makes scans of seven objects on a square of
ground, as viewers above see them, with two levels of noise, in four positions: upright, upside down, and
turned at random twice. Prints for each program a Markdown table: of how many scans the object, the ground, both
face outward (on nine tenths of the area that is near enough to truth and parallel to it), and which do not.

    tests/ground.py OLD-PROGRAM NEW-PROGRAM...
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

POINTS = 12000
SIGMAS = (0.003, 0.008)
# Of the longest side of the object: half a side of the ground, and how far from truth a surface is looked at.
HALF, NEAR = 0.7, 0.05


def objects():
    """Closed meshes by name."""
    make = trimesh.creation
    lying = make.capsule(1, 0.3)
    lying.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    leaning = make.cylinder(0.2, 1)
    leaning.apply_transform(trimesh.transformations.rotation_matrix(0.9, [1, 0, 0]))
    egg = make.icosphere(4)
    egg.apply_scale([1.0, 0.7, 0.7])
    return {
        "ball": make.icosphere(4),
        "egg": egg,
        "lying capsule": lying,
        "leaning cylinder": leaning,
        "cylinder": make.cylinder(0.4, 1),
        "box": make.box([1, 0.7, 0.5]),
        "ring": make.torus(1, 0.4),
    }


def scene(mesh):
    """The object in its own size, longest side 1, on ground at height 0."""
    mesh = mesh.copy()
    mesh.apply_scale(1 / mesh.extents.max())
    mesh.apply_translation([*-mesh.bounds.mean(axis=0)[:2], -mesh.bounds[0, 2]])
    return mesh


def samples(mesh, count, rng):
    """Places evenly spread over object and ground, their normals, and which are of the ground."""
    ground_area = 4 * HALF * HALF
    on_ground = int(count * ground_area / (ground_area + mesh.area))
    at, face = trimesh.sample.sample_surface(mesh, count - on_ground, seed=int(rng.integers(1 << 30)))
    ground = np.c_[rng.uniform(-HALF, HALF, (on_ground, 2)), np.zeros(on_ground)]
    normals = np.r_[mesh.face_normals[face], np.tile([0.0, 0, 1], (on_ground, 1))]
    return np.r_[at, ground], normals, np.arange(count) >= count - on_ground


def seen(at, normals, view, cell=0.02):
    """Which places are seen from a direction: those that face it, with none before them in their cell."""
    across = np.linalg.svd(view[None])[2][1:]
    cells = np.floor(at @ across.T / cell).astype(int)
    cells -= cells.min(axis=0)
    key = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    front = np.full(key.max() + 1, -np.inf)
    np.maximum.at(front, key, at @ view)
    cosine = normals @ view
    return (cosine > 0.15) & (front[key] - at @ view < 2 * cell / np.maximum(cosine, 0.15))


def scan(mesh, sigma, rng):
    at, normals, _ = samples(mesh, 40 * POINTS, rng)
    views = [np.array([x, y, 0.5]) / 1.5 for x in (-1, 1) for y in (-1, 1)] + [np.array([0.0, 0, 1])]
    views = [v / np.linalg.norm(v) for v in views]
    points = np.concatenate([at[seen(at, normals, view)] for view in views])
    points = points[rng.choice(len(points), POINTS, replace=False)]
    return points + rng.normal(0, sigma, points.shape)


def outward(surface, turned, mesh):
    """The share of object and ground that faces outward."""
    at, normals, ground = samples(mesh, 20000, np.random.default_rng(1))
    back = turned.inv()
    distance, nearest = cKDTree(back.apply(np.array(surface.triangles_center))).query(at)
    cosine = (back.apply(np.array(surface.face_normals))[nearest] * normals).sum(axis=1)
    # What is under the object was not seen.
    looked = (distance < NEAR) & (np.abs(cosine) > 0.7) & (normals[:, 2] > -0.3)
    return [np.mean(cosine[looked & part] > 0) for part in (~ground, ground)]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("programs", nargs="+", type=pathlib.Path)
    programs = parser.parse_args().programs
    found = {program: [] for program in programs}
    names = []
    with tempfile.TemporaryDirectory() as folder:
        file, out = (pathlib.Path(folder) / name for name in ("scan.ply", "surface.ply"))
        for k, (name, mesh) in enumerate(objects().items()):
            mesh = scene(mesh)
            for sigma in SIGMAS:
                points = scan(mesh, sigma, np.random.default_rng(k))
                turns = [Rotation.identity(), Rotation.from_euler("x", 180, degrees=True)]
                turns += list(Rotation.random(2, random_state=k))
                for position, turn in enumerate(turns):
                    trimesh.PointCloud(turn.apply(points)).export(file)
                    names.append(f"{name} {sigma} {position}")
                    for program in programs:
                        subprocess.run([program, "denoise", file, "-o", out, "--no-uv", "--quiet"], check=True)
                        found[program].append(outward(trimesh.load(out, process=False), turn, mesh))
    print("| program | scans | object faces outward | ground | both | not both: object, noise, position |")
    print("|---|---|---|---|---|---|")
    for program, shares in found.items():
        right = np.array(shares) > 0.9
        both = right.all(axis=1)
        wrong = ", ".join(name for name, b in zip(names, both) if not b)
        counts = " | ".join(str(n) for n in (*right.sum(axis=0), both.sum()))
        print(f"| {program.name} | {len(names)} | {counts} | {wrong} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
