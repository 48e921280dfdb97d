"""Made-up meshes and scans that the tests of the package, of the Blender add-on and of the MeshLab plugin
share, by numpy alone.
"""

import numpy as np


def sphere_points(n=3000, noise=0.01, seed=1):
    rng = np.random.default_rng(seed)
    p = rng.normal(size=(n, 3))
    p /= np.linalg.norm(p, axis=1)[:, None]
    return p * (1 + noise * rng.normal(size=(n, 1)))


def volumes(n=3000, seed=9):
    """By name: points that fill a cube, a ball, and a shell half as thick as its radius, and show no surface.
    """
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    share = rng.random((n, 1))
    return {
        "cube": rng.random((n, 3)),
        "ball": direction * np.cbrt(share),
        "shell": direction * np.cbrt(1 / 8 + 7 / 8 * share),
    }


def torus(nu=48, nv=24, tube=0.4, ring=1.0):
    """Vertices, quads (nu * nv, 4); the radii of the tube and of the ring."""
    u, v = np.meshgrid(np.arange(nu) * 2 * np.pi / nu, np.arange(nv) * 2 * np.pi / nv, indexing="ij")
    out = ring + tube * np.cos(v)
    vertices = np.stack([out * np.cos(u), out * np.sin(u), tube * np.sin(v)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij")
    at = lambda a, b: (a % nu) * nv + b % nv
    quads = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], -1).reshape(-1, 4)
    return vertices, quads.astype(np.int32)


def strip(n=40, m=6):
    """Vertices, quads (n * m, 4) of a band of a plane's ring that rises: with least stretch it is an arc."""
    u, v = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1), indexing="ij")
    out = 1 + 0.12 * v
    vertices = np.stack([out * np.cos(2 * u), out * np.sin(2 * u), 0.1 * u**2], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    at = lambda a, b: a * (m + 1) + b
    quads = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], -1).reshape(-1, 4)
    return vertices, quads.astype(np.int32)


def triangles(quads):
    """Two triangles per quad, and the quad of each."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), np.repeat(np.arange(len(quads)), 2)
