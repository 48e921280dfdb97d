"""`atlasfit measure` agrees with the independent judges in ../shared/eval within sampling error."""
import math

import pytest

SHAPES = ["ring", "mobius", "spiral", "bunny", "cup", "chair", "car"]


def write_obj(path, V, F, UV=None):
    with open(path, "w") as f:
        for v in V:
            f.write("v %r %r %r\n" % tuple(map(float, v)))
        if UV is not None:
            for corner in UV.reshape(-1, 2):
                f.write("vt %r %r\n" % tuple(map(float, corner)))
        for i, t in enumerate(F):
            corners = [
                str(v + 1) if UV is None else "%d/%d" % (v + 1, 3 * i + k + 1) for k, v in enumerate(t)
            ]
            f.write("f %s\n" % " ".join(corners))


def close(ours, theirs, relative, absolute=0.0):
    assert math.isclose(ours, theirs, rel_tol=relative, abs_tol=absolute), (ours, theirs)


@pytest.mark.parametrize("name", SHAPES)
def test_distances_of_a_distorted_surface_are_the_judges(name, atlasfit, judges, tmp_path):
    import numpy as np
    from denoise_eval import surface
    from shapes import clean

    V, F = clean(name)
    # A bumpy copy that lacks a part.
    bumpy = V + 0.01 * np.sin(25 * V[:, [1, 2, 0]])
    kept = F[V[F].mean(1)[:, 0] < 0.3]
    write_obj(tmp_path / "result.obj", bumpy, kept)
    write_obj(tmp_path / "truth.obj", V, F)
    theirs = surface(bumpy, kept, name)
    ours = atlasfit(
        "measure", tmp_path / "result.obj", "--against", tmp_path / "truth.obj", "--threshold", 0.005
    )
    d = ours["surface"]
    close(d["accuracy"]["rms"], theirs["acc"], 0.03)
    close(d["accuracy"]["median"], theirs["acc_med"], 0.03)
    close(d["completeness"]["rms"], theirs["com"], 0.03)
    close(d["completeness"]["median"], theirs["com_med"], 0.03)
    close(d["chamfer"], theirs["cd"], 0.06)
    close(d["chamfer_floor"], theirs["floor"], 0.04)
    close(d["f_score"], theirs["f1"], 0.0, 0.02)
    close(d["normal_consistency"], theirs["normal"], 0.0, 0.01)
    t = ours["topology"]
    assert (t["parts"], t["boundary_edges"], t["non_manifold_edges"]) == (
        theirs["parts"],
        theirs["boundary"],
        theirs["nonmanifold"],
    )


@pytest.mark.parametrize("name", ["ring", "bunny"])
def test_distances_of_points_are_the_judges(name, atlasfit, judges, tmp_path):
    from denoise_eval import points
    from shapes import clean, noisy

    P = noisy(name, 0.01)
    write_obj(tmp_path / "points.obj", P, [])
    write_obj(tmp_path / "truth.obj", *clean(name))
    theirs = points(P, name)
    ours = atlasfit("measure", tmp_path / "points.obj", "--against", tmp_path / "truth.obj")["points"]
    close(ours["accuracy"]["rms"], theirs["p2s"], 1e-6)
    close(ours["accuracy"]["median"], theirs["p2s_med"], 1e-6)
    close(ours["accuracy"]["p99"], theirs["p2s_p99"], 1e-6)
    close(ours["chamfer"], theirs["cd"], 0.04)


def projected(V, F):
    """Box projection: six charts per side of many pieces, with overlaps, stretch and some collapsed faces."""
    import numpy as np

    P = V[F]
    n = np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0])
    axis = np.abs(n).argmax(1)
    cols = np.array([[1, 2], [2, 0], [0, 1]])[axis]
    lo = V.min(0)
    q = (P - lo) / (V.max(0) - lo).max()
    uv = np.take_along_axis(q, cols[:, None, :].repeat(3, 1), 2)
    offset = np.stack([axis / 3, (np.take_along_axis(n, axis[:, None], 1)[:, 0] > 0) / 2], 1)
    return (uv / 3 + offset[:, None]).astype(np.float32)


def xatlas_uv(V, F):
    import numpy as np

    xatlas = pytest.importorskip("xatlas")
    vmap, index, uv = xatlas.parametrize(V.astype(np.float32), F.astype(np.uint32))
    return uv[index].astype(np.float32)


@pytest.mark.parametrize("unwrap", [projected, xatlas_uv])
@pytest.mark.parametrize("name", ["ring", "mobius", "cup", "chair", "car"])
def test_uv_quality_is_the_judges(name, unwrap, atlasfit, judges, tmp_path):
    from shapes import clean
    from uvmetrics import metrics

    V, F = clean(name)
    UV = unwrap(V, F)
    write_obj(tmp_path / "mesh.obj", V, F, UV)
    theirs = metrics(V, F, UV)
    ours = atlasfit("measure", tmp_path / "mesh.obj")["uv"]
    for key, value in [
        ("charts", theirs["charts"]),
        ("flips", theirs["flips"]),
        ("degenerate", theirs["deg"]),
        ("inside", theirs["inside"]),
        ("finite", theirs["finite"]),
    ]:
        assert ours[key] == value, key
    for key, value in [
        ("seam", theirs["seam"]),
        ("stretch_l2", theirs["L2"]),
        ("stretch_median", theirs["sd50"]),
        ("stretch_p95", theirs["sd95"]),
        ("conformal", theirs["conf"]),
        ("overlap", theirs["overlap"]),
        ("coverage", theirs["cover"]),
    ]:
        close(ours[key], value, 1e-6, 1e-9)
