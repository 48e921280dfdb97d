"""Surfaces from points by MeshLab's own filters. Needs numpy and pymeshlab.

A setting is DEPTH,NEIGHBOURS,WEIGHT for screened Poisson (octree depth, neighbours for normals, point weight)
or rimls, with what the Deep Manifold Prior paper says of it (relative filter size 10, 15 projections, a grid
of 200, 30 neighbours for normals). For each writes OUT/meshlab-SETTING.ply and prints a JSON line with the
setting and the seconds from points to surface, normals included, files and imports not: the median of REPEAT
runs.

usage: meshlab.py POINTS.ply OUT REPEAT SETTING...
"""
import json
import pathlib
import statistics
import sys
import time

import pymeshlab


def reconstruct(points, setting):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(points)
    start = time.perf_counter()
    if setting == "rimls":
        meshes.compute_normal_for_point_clouds(k=30)
        meshes.generate_marching_cubes_rimls(resolution=200, filterscale=10, maxprojectioniters=15)
    else:
        depth, neighbours, weight = setting.split(",")
        meshes.compute_normal_for_point_clouds(k=int(neighbours))
        meshes.generate_surface_reconstruction_screened_poisson(
            depth=int(depth), iters=8, pointweight=float(weight), preclean=False
        )
    return meshes, time.perf_counter() - start


if __name__ == "__main__":
    points, out, repeat = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])
    for setting in sys.argv[4:]:
        runs = [reconstruct(points, setting) for _ in range(repeat)]
        meshes, seconds = runs[-1][0], statistics.median(seconds for _, seconds in runs)
        path = out / ("meshlab-%s.ply" % setting.replace(",", "-"))
        meshes.save_current_mesh(str(path), save_vertex_normal=False)
        print(json.dumps({"setting": setting, "file": str(path), "seconds": seconds}), flush=True)
