#!/usr/bin/env python3
"""The README's figures: the plugin beside MeshLab's own filters in one process, its overhead over the C ABI,
memory over many runs.

    tests/meshlab/run PYTHON                                          builds the plugin
    ATLASFIT_PLUGIN=target/meshlab/pymeshlab/libfilter_atlasfit.so PYTHON tests/meshlab/figures.py [peers]
        [overhead] [memory] [scans[=FOLDER]]

Needs numpy and pymeshlab. The peers' times are seconds of processor time, all threads together, which a busy
machine disturbs least: compare them within one table only.
"""
import os
import pathlib
import resource
import sys
import time

import numpy as np
import pymeshlab as ml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
import made

MAJOR, MINOR = 2.0, 0.7
KEPT = []


def document(mesh=None):
    KEPT.append(ml.MeshSet(verbose=False))
    if mesh is not None:
        KEPT[-1].add_mesh(mesh)
    return KEPT[-1]


def torus(n, m):
    """Positions, normals and triangles of a torus."""
    vertices, quads = made.torus(n, m, MINOR, MAJOR)
    centre = vertices * [1, 1, 0]
    centre *= MAJOR / np.linalg.norm(centre, axis=1, keepdims=True)
    return vertices, (vertices - centre) / MINOR, made.triangles(quads)[0]


def timed(work, clock=time.perf_counter):
    started = clock()
    result = work()
    return result, clock() - started


def off(points):
    """Distances from the true torus."""
    return np.abs(np.hypot(np.hypot(points[:, 0], points[:, 1]) - MAJOR, points[:, 2]) - MINOR)


def peers():
    rng = np.random.default_rng(0)
    noise = 0.02
    clean, normal, faces = torus(200, 80)
    scan = clean + rng.normal(0, noise, clean.shape[:1])[:, None] * normal

    def reconstruct(name, *filters):
        ms = document(ml.Mesh(scan))
        _, seconds = timed(lambda: [ms.apply_filter(f, **o) for f, o in filters], time.process_time)
        m = ms.current_mesh()
        d = off(m.vertex_matrix())
        topology = ms.apply_filter("get_topological_measures")
        print(
            f"| {name} | {seconds:.1f} | {np.sqrt(np.mean(d**2)) / noise:.2f} "
            f"| {np.quantile(d, 0.95) / noise:.2f} | {m.face_number():,} "
            f"| {topology['connected_components_number']} | {topology['boundary_edges']} |",
            flush=True,
        )
        return ms

    print(f"Torus of {len(scan):,} points, noise {noise} along the normal (radii 2 and 0.7)\n")
    print(
        "| reconstruction | CPU s | RMS error / noise | 95% below, / noise | faces | parts "
        "| boundary edges |\n|---|---|---|---|---|---|---|"
    )
    # The peers need normals.
    normals = ("compute_normal_for_point_clouds", {"k": 20})
    reconstruct("atlas reconstruction", ("generate_surface_reconstruction_atlas", {}))
    reconstruct(
        "normals, screened Poisson (depth 8)",
        normals,
        ("generate_surface_reconstruction_screened_poisson", {"depth": 8, "threads": 1}),
    )
    reconstruct("normals, RIMLS (resolution 200)", normals, ("generate_marching_cubes_rimls", {}))

    def unwrap(name, *filters):
        ms = document(ml.Mesh(clean, faces))
        try:
            _, seconds = timed(lambda: [ms.apply_filter(f, **o) for f, o in filters], time.process_time)
            ms.set_current_mesh(ms.mesh_number() - 1)
            if not ms.current_mesh().has_wedge_tex_coord():
                ms.apply_filter("compute_texcoord_transfer_vertex_to_wedge")
            q = ms.apply_filter("compute_scalar_by_uv_distortion_per_face")
            print(
                f"| {name} | {seconds:.1f} | {q['charts']} | {q['seam']:.1f} | {q['stretch_l2']:.3f} "
                f"| {q['stretch_p95']:.3f} | {q['flips']} | {q['overlapping_faces']} | {q['coverage']:.2f} |",
                flush=True,
            )
        except ml.PyMeshLabException as e:
            print(f"| {name} | fails: {str(e).splitlines()[-1][:80]} |", flush=True)

    print(f"\nTorus of {len(faces):,} faces, without noise\n")
    print(
        "| UVs | CPU s | charts | seams / √area | L2 stretch | 95% below | flips | overlaps | coverage |\n"
        "|---|---|---|---|---|---|---|---|---|"
    )
    unwrap("stretch-regularized atlas", ("compute_texcoord_parametrization_atlas", {}))
    unwrap("Voronoi atlas", ("generate_voronoi_atlas_parametrization", {}))
    unwrap(
        "iso-parametrization",
        ("compute_iso_parametrization", {}),
        ("generate_iso_parametrization_atlased_mesh", {}),
    )
    unwrap(
        "trivial per triangle",
        ("compute_texcoord_parametrization_triangle_trivial_per_wedge", {"textdim": 4096}),
    )


def scans(folder=ROOT.parent / "shared/data/scans"):
    """Real scans, nearest in size to 100,000 points, beside screened Poisson: how far the scan's points lie
    from
    each surface (MeshLab's own Hausdorff filter), and the processor time. Scans without normals get
    MeshLab's.
    """
    sizes = {}
    for path in sorted(pathlib.Path(folder).glob("*.ply")):
        head = path.read_bytes()[:4096].split(b"end_header")[0].decode("ascii", "replace")
        sizes[path] = int(head.split("element vertex")[1].split()[0])
    if not sizes:
        print(f"no scans in {folder}")
        return
    nearest = sorted(sizes, key=lambda path: abs(sizes[path] - 100_000))[:5]
    print("\n| scan | points | surface | CPU s | RMS | mean | 95 % below | vertices |\n" + "|---" * 8 + "|")
    for path in nearest:
        for name in ("atlas", "screened Poisson (depth 9)"):
            ms = document()
            ms.load_new_mesh(str(path))
            points = ms.current_mesh().vertex_matrix().copy()
            _, seconds = timed(lambda: reconstruct_scan(ms, name), time.process_time)
            surface = ms.current_mesh_id()
            ms.add_mesh(ml.Mesh(points))  # cleaning before Poisson may take points away
            ms.apply_filter(
                "get_hausdorff_distance", sampledmesh=ms.current_mesh_id(), targetmesh=surface,
                samplevert=True, sampleedge=False, sampleface=False, samplenum=len(points),
                maxdist=ml.PercentageValue(50),
            )
            d = np.abs(ms.current_mesh().vertex_scalar_array())
            d /= np.linalg.norm(np.ptp(points, axis=0))
            print(
                f"| {path.stem} | {len(points):,} | {name} | {seconds:.1f} "
                f"| {1e5 * np.sqrt(np.mean(d**2)):.2f} | {1e5 * d.mean():.2f} "
                f"| {1e5 * np.quantile(d, 0.95):.2f} "
                f"| {ms.mesh(surface).vertex_number():,} |",
                flush=True,
            )
    print("\nDistances are in 1/100,000 of the scan's diagonal.")


def reconstruct_scan(ms, name):
    if name == "atlas":
        ms.apply_filter("generate_surface_reconstruction_atlas", uv=False, timelimit=0.0)
        return
    if not np.any(ms.current_mesh().vertex_normal_matrix()):
        ms.apply_filter("compute_normal_for_point_clouds", k=20)
    # Points of no face have no normal in scans with faces: Poisson refuses them without this.
    ms.apply_filter("generate_surface_reconstruction_screened_poisson", depth=9, preclean=True)


def overhead():
    """What the plugin adds: a filter's time less the time that it spent in libatlasfit, in one run."""
    print("\n| filter | vertices | s | of it in libatlasfit | overhead |\n|---|---|---|---|---|")
    clean, normal, faces = torus(1600, 625)
    rng = np.random.default_rng(0)
    scan = clean + rng.normal(0, 0.002, clean.shape[:1])[:, None] * normal
    small = scan[rng.permutation(len(scan))[:100_000]]
    for title, name, mesh in (
        ("denoise", "apply_coord_denoising_atlas", ml.Mesh(small)),
        ("parametrization", "compute_texcoord_parametrization_atlas", ml.Mesh(clean, faces)),
        ("denoise", "apply_coord_denoising_atlas", ml.Mesh(scan)),
    ):
        ms = document(mesh)
        values, seconds = timed(lambda: ms.apply_filter(name, timelimit=0.0))
        inside = values["library_seconds"]
        print(
            f"| {title} | {mesh.vertex_number():,} | {seconds:.1f} | {inside:.1f} "
            f"| {100 * (seconds - inside) / inside:.1f}% |",
            flush=True,
        )


def memory():
    """Resident memory over 20 consecutive runs of every filter in one process."""
    resident = (
        lambda: int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20
    )
    clean, normal, _ = torus(100, 40)
    ms = document()
    print("\n| run | resident MiB |\n|---|---|")
    for run in range(21):
        ms.clear()
        ms.add_mesh(ml.Mesh(clean + 0.01 * normal * np.sin(17 * np.arange(len(clean)))[:, None]))
        ms.apply_filter("apply_coord_denoising_atlas")
        ms.apply_filter("generate_surface_reconstruction_atlas")
        ms.apply_filter("compute_texcoord_parametrization_atlas")
        ms.apply_filter("compute_scalar_by_uv_distortion_per_face")
        if run in (0, 1, 2, 5, 10, 20):
            print(f"| {run} | {resident():.0f} |", flush=True)


if __name__ == "__main__":
    ml.load_plugin(
        os.environ.get("ATLASFIT_PLUGIN", str(ROOT / "target/meshlab/pymeshlab/libfilter_atlasfit.so"))
    )
    for what in sys.argv[1:] or ("peers", "overhead", "memory", "scans"):
        {"peers": peers, "overhead": overhead, "memory": memory, "scans": scans}[what.split("=")[0]](
            *what.split("=")[1:]
        )
