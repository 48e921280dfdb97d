"""bake(): colours into a texture."""

from __future__ import annotations

from ctypes import byref
from typing import TYPE_CHECKING

import numpy as np

from . import _abi
from ._abi import lib
from ._arrays import address, corners, indices, mesh_struct, points_struct, positions, set_colors
from ._call import RunOptions, options_with, run, size_of_page

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack


def bake(
    vertices: ArrayLike,
    faces: ArrayLike,
    corner_uv: ArrayLike,
    colors: ArrayLike,
    *,
    points: ArrayLike | None = None,
    face_pages: ArrayLike | None = None,
    page: int | None = None,
    page_size: int | tuple[int, int] | None = None,
    padding: int | None = None,
    **options: Unpack[RunOptions],
) -> NDArray[np.uint8]:
    """Draws colours into a texture: (height, width, 4) uint8, red, green, blue, alpha, the top row (v = 1)
    first.

    vertices    (n, 3)
    faces       (m, 3) vertex indices
    corner_uv   (m, 3, 2) UVs of each corner of each face; what lies outside [0, 1] is left out
    colors      (n, 3) or (n, 4) of the vertices, or of the points where they are given: floats in [0, 1], or
                whole numbers from 0 to 255, averaged as the numbers that they are
    points      (k, 3) points near the mesh, whose colours are drawn then: a scan, which is often finer than
                its mesh
    face_pages  (m,) the page that each face's UVs are on; without it all are on page 0
    page        the page to bake (default 0)
    page_size   side of the texture in texels, or width and height (default 1024)
    padding     texels that colours spread beyond the charts; what is left has the mean colour (default 16)
    options     see RunOptions: seed, threads, time_limit, memory_limit, progress, cancel

    >>> vertices, faces = np.eye(3), [[0, 1, 2]]
    >>> uv = atlasfit.unwrap(vertices, faces)
    >>> colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255]]
    >>> atlasfit.bake(vertices, faces, uv.corner_uv, colors, page_size=64).shape
    (64, 64, 4)

    Raises Error (Cancelled, TimedOut), or ValueError and TypeError for arrays of a wrong shape or type.
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    uv = corners(corner_uv, len(faces))
    pages = None if face_pages is None else indices(face_pages, (len(faces),), "face_pages")
    mesh, scan = mesh_struct(vertices, faces, uv), None
    mesh.face_page = address(pages)
    if points is None:
        colors = set_colors(mesh, colors, len(vertices))
    else:
        points = positions(points, "points")
        scan = points_struct(points)
        colors = set_colors(scan, colors, len(points))
    width, height = size_of_page(page_size)
    chosen = options_with(
        _abi.atlasfit_bake_options(), width=width, height=height, padding=padding, page=page
    )
    out = np.empty((chosen.height, chosen.width, 4), np.uint8)
    run(
        lambda r: lib().atlasfit_bake(
            byref(mesh), None if scan is None else byref(scan), byref(chosen), r, out.ctypes.data, out.size
        ),
        options,
    )
    return out
