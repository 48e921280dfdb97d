"""Screened Poisson reconstruction by MeshLab's own filters. Needs numpy and pymeshlab.

For each setting DEPTH,NEIGHBOURS,WEIGHT (octree depth, neighbours for normals, point weight) writes OUT/poisson-SETTING.ply and prints a JSON line with
the setting and the seconds from points to surface, normals included, files and imports not: the median of REPEAT runs.

usage: poisson.py POINTS.ply OUT REPEAT SETTING...
"""
import json
import pathlib
import statistics
import sys
import time

import pymeshlab


def reconstruct(points, depth, neighbours, weight):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(points)
    start = time.perf_counter()
    meshes.compute_normal_for_point_clouds(k=neighbours)
    meshes.generate_surface_reconstruction_screened_poisson(
        depth=depth, iters=8, pointweight=weight, preclean=False
    )
    return meshes, time.perf_counter() - start


if __name__ == "__main__":
    points, out, repeat = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])
    for setting in sys.argv[4:]:
        depth, neighbours, weight = setting.split(",")
        runs = [reconstruct(points, int(depth), int(neighbours), float(weight)) for _ in range(repeat)]
        meshes, seconds = runs[-1][0], statistics.median(seconds for _, seconds in runs)
        path = out / ("poisson-%s.ply" % setting.replace(",", "-"))
        meshes.save_current_mesh(str(path), save_vertex_normal=False)
        print(json.dumps({"setting": setting, "file": str(path), "seconds": seconds}), flush=True)
