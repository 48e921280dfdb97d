"""simplify(): a mesh with fewer triangles."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import _abi
from ._abi import lib
from ._arrays import corners, indices, mesh_struct, positions
from ._call import Handle, RunOptions, check, options_with, run

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack


@dataclass(frozen=True)
class Simplified:
    """A mesh with fewer triangles. Vertices at one place are one.

    vertices   (n, 3) float64
    faces      (m, 3) uint32
    sources    (n,) uint32, a vertex of the given mesh near each: for columns of your own
    corner_uv  (m, 3, 2) float32, those of the same places on the given mesh; None where it had none
    warnings   what the user should hear
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.uint32]
    sources: NDArray[np.uint32]
    corner_uv: NDArray[np.float32] | None
    warnings: tuple[str, ...]


def simplify(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    faces: int | None = None,
    max_error: float | None = None,
    corner_uv: ArrayLike | None = None,
    **options: Unpack[RunOptions],
) -> Simplified:
    """Makes a mesh of fewer triangles: larger where it is flat. Boundary and UV seams stay where they are
    within the error, both sides of a seam stay together, no triangle turns over in UV space.

    vertices   (n, 3); float32 and float64 are not copied
    triangles  (m, 3) vertex indices
    faces      triangles that are few enough; None = as few as max_error allows
    max_error  how far any vertex, and the middle of any edge, may be from the new mesh;
               None = as far as faces asks for
    corner_uv  (m, 3, 2) UVs of the mesh
    options    see RunOptions: seed, threads, time_limit, memory_limit, progress, cancel

    Raises Error (Cancelled, TimedOut), or ValueError and TypeError for arrays of a wrong shape or type.

    A flat square of 200 triangles needs few:

    >>> x, y = np.meshgrid(np.arange(11.0), np.arange(11.0))
    >>> square = np.stack([x.ravel(), y.ravel(), np.zeros(121)], axis=1)
    >>> at = np.arange(110)[np.arange(110) % 11 < 10]
    >>> corners = np.concatenate([np.stack([at, at + 1, at + 12], 1), np.stack([at, at + 12, at + 11], 1)])
    >>> len(atlasfit.simplify(square, corners, max_error=0.01).faces) < 20
    True
    """
    vertices, triangles = positions(vertices, "vertices"), indices(triangles, (-1, 3), "triangles")
    uv = None if corner_uv is None else corners(corner_uv, len(triangles))
    mesh = mesh_struct(vertices, triangles, uv)
    chosen = options_with(_abi.atlasfit_simplify_options(), faces=faces, max_error=max_error)
    light = Handle("simplified")
    run(lambda r: lib().atlasfit_simplify(byref(mesh), byref(chosen), r, byref(light.pointer)), options)
    info = _abi.atlasfit_simplified_info()
    check(lib().atlasfit_simplified_get_info(light.pointer, byref(info)))
    return Simplified(
        vertices=light.copy("positions", (info.vertices, 3), np.float64),
        faces=light.copy("triangles", (info.triangles, 3), np.uint32),
        sources=light.copy("sources", (info.vertices,), np.uint32),
        corner_uv=light.copy("corner_uv", (info.triangles, 3, 2), np.float32) if info.has_uv else None,
        warnings=light.warnings(),
    )
