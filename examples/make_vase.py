"""Makes examples/vase.ply: a small made-up scan of a painted vase, open at the top, with noise and stray
points. Needs numpy.

The vase is 0.3 m high; 20,000 points uniform by area; noise of 0.6 mm along all axes; 60 stray points;
colours of a glaze with bands.
"""

import pathlib

import numpy as np

HEIGHT, NOISE, POINTS, STRAY = 0.3, 0.0006, 20000, 60


def surface(s, t):
    """The wall for s in [0, 1] from the middle of the foot to the rim, t once round: twisted flutes on a
    baluster.
    """
    angle = 2 * np.pi * t
    foot = np.clip(s / 0.12, 0, 1)  # the flat bottom
    z = np.clip((s - 0.12) / 0.88, 0, 1)
    profile = (
        0.052
        + 0.045 * np.sin(np.pi * z**0.8) ** 2
        - 0.012 * np.exp(-(((z - 0.86) / 0.07) ** 2))
        + 0.02 * z**6
    )
    flutes = 1 + 0.06 * np.cos(10 * angle + 7 * z) * np.sin(np.pi * np.clip(z / 0.8, 0, 1)) ** 2
    radius = profile * flutes * foot
    return np.stack([radius * np.cos(angle), HEIGHT * z, radius * np.sin(angle)], -1)


def color(s, t):
    """A celadon glaze with cobalt bands and dots."""
    z = np.clip((s - 0.12) / 0.88, 0, 1)
    glaze = np.array([168, 198, 178.0])[None] * (0.92 + 0.08 * np.cos(40 * z))[:, None]
    cobalt = np.array([38, 62, 140.0])
    rust = np.array([170, 84, 42.0])
    band = (np.abs(z - 0.16) < 0.02) | (np.abs(z - 0.72) < 0.015) | (z > 0.97)
    dots = (np.abs(z - 0.45) / 0.05) ** 2 + ((t * 10 + 0.5) % 1 - 0.5) ** 2 / 0.09 < 1
    return np.where(dots[:, None], rust, np.where(band[:, None], cobalt, glaze))


if __name__ == "__main__":
    rng = np.random.default_rng(1)
    n, m = 400, 600
    s, t = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(m) + 0.5) / m, indexing="ij")
    h = 0.25 / n
    du = surface(s + h, t) - surface(s - h, t)
    dv = surface(s, t + h) - surface(s, t - h)
    area = np.linalg.norm(np.cross(du, dv), axis=-1).ravel()
    cell = rng.choice(n * m, POINTS, p=area / area.sum())
    s = s.ravel()[cell] + (rng.random(POINTS) - 0.5) / n
    t = t.ravel()[cell] + (rng.random(POINTS) - 0.5) / m
    P = surface(s, t) + rng.normal(0, NOISE, (POINTS, 3))
    C = color(s, t % 1) + rng.normal(0, 4, (POINTS, 3))
    low, high = P.min(0), P.max(0)
    P[:STRAY] = low + (high - low) * (rng.random((STRAY, 3)) * 1.4 - 0.2)
    order = rng.permutation(POINTS)
    rows = np.empty(POINTS, [("p", "<f4", 3), ("c", "u1", 3)])
    rows["p"], rows["c"] = P[order], np.clip(C[order], 0, 255)
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment made by examples/make_vase.py\nelement vertex %d\n"
        % POINTS
    )
    head += "".join("property float %s\n" % c for c in "xyz")
    head += "".join("property uchar %s\n" % c for c in ("red", "green", "blue")) + "end_header\n"
    pathlib.Path(__file__).with_name("vase.ply").write_bytes(head.encode() + rows.tobytes())
