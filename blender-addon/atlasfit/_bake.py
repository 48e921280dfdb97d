"""Colours into a texture: bake(), bake_textures() of old textures, and how large a texture has to be."""

from __future__ import annotations

from ctypes import byref, c_double, c_uint32, pointer, sizeof
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Sequence

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


@dataclass(frozen=True)
class TexturePage:
    """A page that keeps the detail of old textures.

    side     of the square page in texels, for page_size of unwrap()
    padding  free texels between charts that keep colours apart when the page is seen from far away, for
             padding of unwrap()
    density  texels per unit of length that the old textures have; where texels_per_unit of the new UVs is
    less,
             bake twice as large, or four times
    """

    side: int
    padding: int
    density: float


class _Textures:
    """The struct of old textures, and the arrays behind it."""

    def __init__(
        self,
        images: Sequence[NDArray[np.uint8]],
        old_corner_uv: ArrayLike,
        face_images: ArrayLike | None,
        normals: bool,
        faces: int,
    ) -> None:
        self.uv = corners(old_corner_uv, faces)
        self.of = None if face_images is None else indices(face_images, (faces,), "face_images")
        self.texels = [_rgba(image) for image in images]
        self.images = (_abi.atlasfit_image * max(len(images), 1))()
        for struct, texels in zip(self.images, self.texels):
            struct.struct_size, struct.rgba = sizeof(struct), texels.ctypes.data
            struct.height, struct.width = texels.shape[:2]
        self.struct = options_with(
            _abi.atlasfit_textures(),
            images=self.images,
            image_count=len(images),
            corner_uv=address(self.uv),
            face_image=address(self.of),
            normals=int(normals),
        )


def _rgba(image: Any) -> NDArray[np.uint8]:
    """An image as the library takes it."""
    array = np.asarray(image)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.dtype != np.uint8:
        raise ValueError(f"an image is {array.dtype} {array.shape}. Give (height, width, 3 or 4) uint8")
    if array.shape[2] == 3:
        array = np.concatenate([array, np.full((*array.shape[:2], 1), 255, np.uint8)], axis=2)
    return np.ascontiguousarray(array)


def texture_page(
    vertices: ArrayLike,
    faces: ArrayLike,
    images: Sequence[NDArray[np.uint8]],
    old_corner_uv: ArrayLike,
    *,
    face_images: ArrayLike | None = None,
    **options: Unpack[RunOptions],
) -> TexturePage:
    """How large a page must be to keep the detail of old textures: see bake_textures().

    >>> vertices, faces, uv = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[[0, 0], [1, 0], [0, 1]]]
    >>> atlasfit.texture_page(vertices, faces, [np.zeros((512, 512, 3), np.uint8)], uv)
    TexturePage(side=512, padding=24, density=512.0)
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    old = _Textures(images, old_corner_uv, face_images, False, len(faces))
    mesh, side, padding, density = mesh_struct(vertices, faces), c_uint32(), c_uint32(), c_double()
    run(
        lambda r: lib().atlasfit_textures_page(
            byref(mesh), byref(old.struct), r, byref(side), byref(padding), byref(density)
        ),
        options,
    )
    return TexturePage(side.value, padding.value, density.value)


def bake_textures(
    vertices: ArrayLike,
    faces: ArrayLike,
    corner_uv: ArrayLike,
    images: Sequence[NDArray[np.uint8]],
    old_corner_uv: ArrayLike,
    *,
    face_images: ArrayLike | None = None,
    normals: bool = False,
    face_pages: ArrayLike | None = None,
    page: int | None = None,
    page_size: int | tuple[int, int] | None = None,
    padding: int | None = None,
    **options: Unpack[RunOptions],
) -> NDArray[np.uint8]:
    """Draws the textures that a mesh has anew for other UVs: (height, width, 4) uint8, the top row first.

    images         the old textures, (height, width, 3 or 4) uint8 each; outside of [0, 1] they repeat
    old_corner_uv  (m, 3, 2) the UVs that they are for
    face_images    (m,) the image of each face, NO_IMAGE for one without; without it all have the first
    normals        whether they are normal maps, whose directions are turned to the new UVs
    All else is as in bake().

    >>> vertices, faces, uv = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[[0, 0], [1, 0], [0, 1]]]
    >>> new, red = atlasfit.unwrap(vertices, faces), np.uint8([[[255, 0, 0]]])
    >>> atlasfit.bake_textures(vertices, faces, new.corner_uv, [red], uv, page_size=64)[32, 32]
    array([255,   0,   0, 255], dtype=uint8)
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    uv = corners(corner_uv, len(faces))
    pages = None if face_pages is None else indices(face_pages, (len(faces),), "face_pages")
    mesh = mesh_struct(vertices, faces, uv)
    mesh.face_page = address(pages)
    old = _Textures(images, old_corner_uv, face_images, normals, len(faces))
    width, height = size_of_page(page_size)
    chosen = options_with(
        _abi.atlasfit_bake_options(),
        width=width,
        height=height,
        padding=padding,
        page=page,
        textures=pointer(old.struct),
    )
    out = np.empty((chosen.height, chosen.width, 4), np.uint8)
    run(
        lambda r: lib().atlasfit_bake(byref(mesh), None, byref(chosen), r, out.ctypes.data, out.size),
        options,
    )
    return out


def texture_side(points: int) -> int:
    """Side in texels of a square texture that keeps the colours of so many points, 512 to 8192.

    >>> atlasfit.texture_side(1_000_000)
    4096
    """
    return int(lib().atlasfit_texture_side(points))
