"""The benchmark's simulated scans are what they claim to be (tests/peers/scanner.py)."""
import importlib
import json
import pathlib
import subprocess
import sys

import pytest

np = pytest.importorskip("numpy")
PEERS = pathlib.Path(__file__).resolve().parents[1] / "peers"
NAMES = ("rays", "shapes", "scanner")
SIGMA = 0.004


@pytest.fixture(scope="module")
def made():
    """The modules rays, shapes and scanner of tests/peers; the judges have modules of the same names, which
    stay.
    """
    theirs = {name: sys.modules.pop(name) for name in NAMES if name in sys.modules}
    sys.path.insert(0, str(PEERS))
    try:
        yield dict(zip(NAMES, map(importlib.import_module, NAMES)))
    finally:
        sys.path.remove(str(PEERS))
        for name in NAMES:
            sys.modules.pop(name, None)
        sys.modules.update(theirs)


def ball(made):
    """A ball of radius 0.5, whose triangles are at most 0.0014 below it."""
    turn = lambda s, t: (2 * np.pi * s, np.pi * t)
    at = lambda a, b: tuple(0.5 * x for x in (np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), -np.cos(b)))
    return made["shapes"].sheet(60, 40, lambda s, t: at(*turn(s, t)), True, False)


def scanned(made, kind, sigma=SIGMA, count=2000):
    """A scan of the ball, the distances of its points from it, and how many strays are among them."""
    how, _ = made["scanner"].KINDS[kind]
    points, _, strays, *_ = how(*ball(made), sigma, count, np.random.default_rng(5))
    return points, np.abs(np.linalg.norm(points, axis=1) - 0.5), strays


def test_rays_meet_the_first_triangle_in_their_way_in_every_direction(made):
    rng = np.random.default_rng(1)
    V, F = made["shapes"].box((-1, -1, -1), (1, 1, 1))
    inner, inside = made["shapes"].box((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3))
    V, F = np.concatenate([V, inner]), np.concatenate([F, inside + len(V)])
    d = rng.normal(size=(3000, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    for origin, reach in (((0, 0, 0), 0.3), ((0.5, 0.5, 0.5), None)):
        distance, face = made["rays"].cast(V, F, np.array(origin, float), d)
        at = origin + distance[:, None] * d
        assert (face >= 0).all()
        # Every hit lies on a box, none of them beyond the first.
        on = lambda h: np.isclose(np.abs(at).max(1), h, atol=1e-9)
        assert on(0.3).all() if reach else (on(0.3) | on(1)).all() and 20 < on(0.3).sum() < 1500
    narrow = d[d[:, 2] > 0.9]
    outside, face = made["rays"].cast(V, F, np.array([0, 0, -5.0]), narrow)
    assert (face[np.isinf(outside)] == -1).all()
    assert np.allclose((outside[:, None] * narrow)[np.isfinite(outside)][:, 2].min(), 4)


def test_a_view_sees_the_front_and_its_noise_grows_where_it_grazes(made):
    scanner, rng = made["scanner"], np.random.default_rng(2)
    V, F = ball(made)
    hits, places = scanner.views(V, F, 6000, rng)
    assert len(places) == scanner.VIEWS and abs(len(hits.at) / 6000 - 1) < 0.1
    # Nothing lies between a camera and what it met.
    for k in range(scanner.VIEWS):
        of = np.where(hits.view == k)[0][::20]
        distance, _ = scanner.cast(V, F, places[k], hits.at[of] - places[k])
        assert np.abs(distance - 1).max() < 1e-6 and (hits.at[of] @ places[k]).min() > 0
    moved = scanner.along(hits, SIGMA, rng) - hits.at
    off = np.einsum("ij,ij->i", moved, hits.ray)
    assert np.abs(np.linalg.norm(moved, axis=1) - np.abs(off)).max() < 1e-12, "it is along the ray"
    assert off[hits.cosine > 0.9].std() == pytest.approx(SIGMA, rel=0.15)
    assert off[hits.cosine < 0.4].std() > 2 * SIGMA


@pytest.mark.parametrize("percent", [3, 20])
def test_strays_are_as_many_as_the_kind_says(made, percent):
    points, distance, strays = scanned(made, "outliers%d" % percent)
    assert strays == 20 * percent and abs(len(points) - 2000) < 150
    far = (distance > 0.06).sum()
    assert 0.6 * strays < far <= strays, "some strays lie at the surface by chance"


def test_views_are_misregistered_by_about_two_sigma(made):
    scanner = made["scanner"]
    assert scanned(made, "views", 1e-9)[1].max() < 0.0015
    assert scanned(made, "views")[1].mean() < scanned(made, "misregistered")[1].mean() < 4 * SIGMA
    axis = np.array([0, 0, 1.0])
    turned = scanner.rotated(np.array([[1.0, 0, 2]]), axis, np.pi / 2)
    assert np.allclose(turned, [[0, 1, 2]])


def test_quantised_depths_are_steps_of_four_sigma(made):
    scanner, seed = made["scanner"], 3
    V, F = ball(made)
    points, places, _ = scanner.quantised(V, F, SIGMA, 2000, np.random.default_rng(seed))
    view = scanner.views(V, F, 2000, np.random.default_rng(seed))[0].view
    depth = np.einsum("ij,ij->i", points - places[view], -places[view] / scanner.FAR) / (4 * SIGMA)
    assert np.abs(depth - np.round(depth)).max() < 1e-6


def test_frames_are_of_a_few_cameras(made):
    scanner = made["scanner"]
    V, F = ball(made)
    points, places, _ = scanner.frames(2)(V, F, SIGMA, 2000, np.random.default_rng(3))
    assert len(places) == 2 and abs(len(points) - 2000) < 300
    axes = -places / scanner.FAR
    depth = np.stack([(points - p) @ a for p, a in zip(places, axes)]) / (4 * SIGMA)
    assert np.abs(depth - np.round(depth)).min(0).max() < 1e-6


def test_the_density_of_an_uneven_scan_falls_thirtyfold(made):
    scanner, rng = made["scanner"], np.random.default_rng(4)
    V, F = ball(made)
    even = scanner.views(V, F, 8000, rng)[0].at[:, 0]
    uneven = scanner.uneven(30.0)(V, F, 0, 2500, rng)[0][:, 0]
    share = lambda x, side: (side * x > 0.4).mean()
    falls = (share(uneven, -1) / share(even, -1)) / (share(uneven, 1) / share(even, 1))
    assert 30**0.8 < falls < 30


def test_a_lidar_scans_line_by_line_and_sees_no_bottom_of_the_furniture(made):
    scanner = made["scanner"]
    points, V, F, seen, strays, _ = scanner.scan("room", "lidar", 1e-9, 3000)
    d = points - np.array(scanner.PLACE)
    azimuth = np.arctan2(d[:, 1], d[:, 0]) % (2 * np.pi)
    lines = np.unique(np.round(azimuth / 1e-6).astype(int))
    assert len(lines) < 150 and (np.diff(azimuth) > -1e-6).all(), "whole lines, one after the other"
    elevation = np.degrees(np.arcsin(d[:, 2] / np.linalg.norm(d, axis=1)))
    assert scanner.LOWEST - 1 < elevation.min() and elevation.max() < scanner.HIGHEST
    assert 0 < strays < 0.05 * len(points)
    below = scanner.normals(V, F)[:, 2] < -0.9
    low = V[F].mean(1)[:, 2] < -0.05
    assert seen.mean() > 0.5 and not seen[below & low].any()


def test_rows_are_denser_along_than_across_and_as_many_points_as_a_lidar_has(made):
    scanner = made["scanner"]
    for dense in (5, 20):
        points = scanner.scan("room", "rows%d" % dense, 1e-9, 12000)[0]
        d = points - np.array(scanner.PLACE)
        azimuth = np.round(np.arctan2(d[:, 1], d[:, 0]) % (2 * np.pi), 6)
        along = np.diff(np.arcsin(d[:, 2] / np.linalg.norm(d, axis=1)))
        across = np.median(np.diff(np.unique(azimuth)))
        assert across / np.median(along) == pytest.approx(dense, rel=0.01)
        assert abs(len(points) / 12000 - 1) < 0.1


def test_stations_in_one_room_see_more_of_it_than_one(made):
    scanner = made["scanner"]
    points, V, F, seen, strays, _ = scanner.scan("room", "stations", 1e-9, 3000)
    alone = scanner.scan("room", "lidar", 1e-9, 3000)[3]
    assert seen[alone].all() and seen.mean() > alone.mean()
    assert abs(len(points) / 3000 - 1) < 0.3 and 0 < strays < 0.05 * len(points)


def test_a_depth_camera_has_steps_that_grow_with_the_square_of_the_depth(made):
    scanner = made["scanner"]
    points, V, F, seen, strays, _ = scanner.scan("room", "depth", SIGMA, 3000)
    x, y, z = ((points - np.array(scanner.EYE)) @ scanner.picture().T).T
    steps = 1 / (2.5 * SIGMA * z)
    assert np.abs(steps - np.round(steps)).max() < 1e-6 and strays == 0
    assert (np.abs(x / z) < scanner.HALF[0]).all() and (np.abs(y / z) < scanner.HALF[1]).all()
    clean = scanner.scan("room", "depth", 1e-9, 3000)[0]
    far = ((clean - np.array(scanner.EYE)) @ scanner.picture()[2])
    assert len(clean) == len(points) and (z - far).std() < 1.5 * SIGMA * (far**2).max()
    assert 0.1 < seen.mean() < 0.4, "what is behind the camera is not asked for"


def test_sheets_are_sigmas_apart_and_each_is_seen_from_its_own_side(made):
    points, V, F, seen, *_ = made["scanner"].scan("plates", "sheets5", SIGMA, 4000)
    assert np.ptp(V[:, 2]) == pytest.approx(5 * SIGMA) and seen.all()
    assert (points[:, 2] > 0).mean() == pytest.approx(0.5, abs=0.1)
    assert (np.sign(made["scanner"].normals(V, F)[:, 2]) == np.sign(V[F].mean(1)[:, 2])).all()


def test_the_truth_faces_the_sensors_and_only_what_they_see_is_asked_for(made, tmp_path):
    scanner, shapes = made["scanner"], made["shapes"]
    V, F = shapes.clean("bumps")
    side, seen = scanner.seen_sides(V, F[:, ::-1], np.array([[0, 0, 3.0]]))
    up = scanner.normals(V, F)[:, 2]
    assert (side[seen] == -1).all(), "it was inside out"
    assert not seen[up < 0].any() and seen[up > 0.5].mean() > 0.95
    used, triangles = scanner.part(V, F[seen])
    assert (
        (np.unique(triangles) == np.arange(len(used))).all()
        and np.array_equal(used[triangles], V[F[seen]])
    )


def test_the_same_seed_gives_the_same_scan_and_another_one_another(made):
    one, two, other = (made["scanner"].scan("plates", "sheets3", SIGMA, 500, seed)[0] for seed in (0, 0, 1))
    assert np.array_equal(one, two) and not np.array_equal(one[:9], other[:9])


def test_the_program_lists_cells_and_refuses_what_it_does_not_know(tmp_path):
    def said(*args):
        done = subprocess.run(
            [sys.executable, PEERS / "scanner.py", "cells", "--data", tmp_path, *args],
            capture_output=True,
            text=True,
        )
        return done, [tuple(json.loads(line).values()) for line in done.stdout.splitlines()]

    listed = said("--kinds", "sheets,outliers5", "--shapes", "knot")[1]
    assert listed == [
        ("sheets3", "plates"),
        ("sheets4", "plates"),
        ("sheets5", "plates"),
        ("outliers5", "knot"),
    ]
    assert len(said()[1]) == 12 * 4 + 9
    refused, _ = said("--kinds", "fog")
    assert refused.returncode != 0 and "fog is no kind of scan" in refused.stderr


def test_the_benchmark_measures_a_simulated_scan_and_asks_only_for_what_was_seen(atlasfit, tmp_path):
    options = ["--python", sys.executable, "--scripts", PEERS, "--no-peers", "--count", 3000]
    said = atlasfit(
        "bench", "denoise", "--scanner", "lidar", "--csv", tmp_path / "all.csv", "--keep", tmp_path, *options
    )
    (row,) = said["rows"]
    assert (row["shape"], row["kind"], row["method"]) == ("room", "lidar", "ours") and said["failed"] == []
    assert 0.5 < row["seen"] < 0.9 and row["flipped"] < 0.2 and row["acc"] < 0.05
    # The seen part is near the surface, the rest is not.
    whole = atlasfit(
        "measure",
        tmp_path / "room-lidar-0.004-ours.ply",
        "--against",
        tmp_path / "room-lidar-0.004-truth.ply",
    )
    assert row["com"] < 0.5 * whole["surface"]["completeness"]["rms"]
    assert (tmp_path / "all.csv").read_text().startswith("shape,kind,sigma,method")
