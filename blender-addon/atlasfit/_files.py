"""load() and save(): scans and meshes in and out of files, by the library's own readers and writers."""

from __future__ import annotations

import os
import struct
import zlib
from ctypes import byref, c_size_t, c_uint32, create_string_buffer
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np

from . import _abi
from ._abi import lib
from ._arrays import (
    SCALARS,
    Attributes,
    address,
    check_rows,
    corners,
    indices,
    points_struct,
    polygon_corners,
    polygons,
    positions,
    rows,
    set_colors,
)
from ._brief import brief, counted
from ._call import Handle, RunOptions, check, options_with, run
from ._denoise import Denoised, Surface
from ._show import show

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack

_LOST_BYTES = 4096  # of the text that says what a format could not hold


@dataclass(frozen=True, repr=False)
class Loaded:
    """What a file holds.

    points       (n, 3) float64, in the file's order and unit; of a mesh its vertices. Points that are not
    finite
                 are among them
    normals      (n, 3) float32, zeros where none is known; None without
    colors       (n, 4) float32 in [0, 1]; None without
    triangles    (m, 3) uint32; (0, 3) of a cloud. Polygons are cut into triangles
    corner_uv    (m, 3, 2) float32, v up; None without
    corner_normals (m, 3, 3) float32, for each corner of each triangle, where those of a vertex differ; None
                 where they do not
    face_charts  (m,) uint32, the UV chart of each triangle; None without
    attributes   by name, (n,) or (n, k), in the type that the file has them in
    viewpoint    (3,) where the scanner stood, where the file says so and there was one
    texture      the bytes of the image (PNG, JPEG) that colours the faces; None without
    notes        what was repaired or left out; empty where all is well
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float32] | None
    colors: NDArray[np.float32] | None
    triangles: NDArray[np.uint32]
    corner_uv: NDArray[np.float32] | None
    corner_normals: NDArray[np.float32] | None
    face_charts: NDArray[np.uint32] | None
    attributes: dict[str, NDArray[Any]]
    viewpoint: NDArray[np.float64] | None
    texture: bytes | None
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return brief(
            self,
            counted(len(self.points), "point"),
            len(self.triangles) and counted(len(self.triangles), "triangle"),
            self.normals is not None and "normals",
            self.colors is not None and "colors",
            self.corner_uv is not None and "UVs",
            self.texture is not None and "texture",
            *self.attributes,
            self.notes and counted(len(self.notes), "note"),
        )

    def columns(self) -> dict[str, Any]:
        """What denoise() takes beside the points: normals, colors, attributes, viewpoint, and of a mesh its
        triangles.

            scan = atlasfit.load("scan.e57")
            result = atlasfit.denoise(scan.points, **scan.columns())
        """
        return {
            "normals": self.normals,
            "colors": self.colors,
            "attributes": self.attributes,
            "viewpoint": self.viewpoint,
            "triangles": self.triangles if len(self.triangles) else None,
        }

    def show(self) -> None:
        """Opens a view of a mesh: see Surface.show()."""
        show(self.points, self.triangles, self.colors)


def load(path: str | os.PathLike[str], **options: Unpack[RunOptions]) -> Loaded:
    """Reads a scan or a mesh: PLY, OBJ, OFF, STL, XYZ and other columns of numbers, PCD, LAS, LAZ, E57, glTF.
    The content decides the format. What is mended is said in the notes.

        scan = atlasfit.load("scan.e57")
        result = atlasfit.denoise(scan.points, **scan.columns())

    >>> _ = atlasfit.save("triangle.off", np.eye(3), [[0, 1, 2]])
    >>> atlasfit.load("triangle.off")
    Loaded(3 points, 1 triangle)

    Raises Error, also where there is no such file.
    """
    file = Handle("file")
    name = os.fsencode(path)
    run(lambda r: lib().atlasfit_file_load(name, r, byref(file.pointer)), options)
    info = _abi.atlasfit_file_info()
    check(lib().atlasfit_file_get_info(file.pointer, byref(info)))
    n, m = info.points, info.triangles
    copy = file.copy
    return Loaded(
        points=copy("positions", (n, 3), np.float64),
        normals=copy("normals", (n, 3), np.float32) if info.has_normals else None,
        colors=copy("colors", (n, 4), np.float32) if info.has_colors else None,
        triangles=copy("triangles", (m, 3), np.uint32),
        corner_uv=copy("corner_uv", (m, 3, 2), np.float32) if info.has_uv else None,
        corner_normals=copy("corner_normals", (m, 3, 3), np.float32) if info.has_corner_normals else None,
        face_charts=copy("face_charts", (m,), np.uint32) if info.has_face_charts else None,
        attributes=dict(_attribute(file, i, n) for i in range(info.attributes)),
        viewpoint=np.array(info.viewpoint) if info.has_viewpoint else None,
        texture=copy("texture", (info.texture_bytes,), np.uint8).tobytes() if info.texture_bytes else None,
        notes=file.lines("notes"),
    )


def _attribute(file: Handle, i: int, n: int) -> tuple[str, NDArray[Any]]:
    """The name of an attribute, and its numbers in their type."""
    length, width, scalar = c_size_t(), c_uint32(), c_uint32()
    ask = lib().atlasfit_file_attribute_type
    check(ask(file.pointer, i, None, 0, byref(length), byref(width), byref(scalar)))
    name = create_string_buffer(length.value + 1)
    check(ask(file.pointer, i, name, len(name), byref(length), None, None))
    kind = next(dtype for dtype, number in SCALARS.items() if number == scalar.value)
    shape = (n,) if width.value == 1 else (n, width.value)
    return name.value.decode(), file.copy("attribute", shape, np.float64, i).astype(kind, copy=False)


def save(
    path: str | os.PathLike[str],
    points: ArrayLike | Denoised | Surface | Loaded,
    triangles: ArrayLike | Sequence[ArrayLike] | None = None,
    *,
    normals: ArrayLike | None = None,
    colors: ArrayLike | None = None,
    attributes: Mapping[str, ArrayLike] | None = None,
    corner_uv: ArrayLike | None = None,
    corner_normals: ArrayLike | None = None,
    face_charts: ArrayLike | None = None,
    texture: bytes | NDArray[np.uint8] | None = None,
    ascii: bool = False,
    **options: Unpack[RunOptions],
) -> tuple[str, ...]:
    """Writes points or a mesh: PLY, OBJ with its material, GLB, OFF, STL, XYZ, by the name's extension.
    The file is written whole or not at all; one that exists is replaced. Gives what the format could not
    hold,
    in words.

        atlasfit.save("surface.glb", result)                    # what denoise() gave: its surface
        atlasfit.save("points.ply", result.points, colors=colors)
        atlasfit.save("mesh.obj", vertices, faces, corner_uv=uv.corner_uv, texture=texels)

    points       (n, 3); or what denoise() or load() gave, whose columns those below replace
    triangles    (m, 3) where the points are the vertices of a mesh; or its polygons, (m, k) or a sequence of
                 the vertices of each: PLY, OBJ and OFF hold them as they are, GLB and STL the triangles that
                 they are cut into
    normals      (n, 3)
    colors       (n, 3) or (n, 4): floats in [0, 1], or whole numbers from 0 to 255
    attributes   by name, (n,) or (n, k)
    corner_uv    (m, 3, 2) UVs of each corner of each triangle; (corners, 2) of polygons, one after another
    corner_normals (m, 3, 3) normals of each corner of each triangle, (corners, 3) of polygons, where those of a
                 vertex differ: OBJ and GLB hold them
    face_charts  (m,) the UV chart of each triangle or polygon
    texture      the texels that bake() gave, or the bytes of a PNG file: GLB holds it inside, else it goes
    to a
                 file beside the output
    ascii        text where a format has both

    >>> atlasfit.save("triangle.stl", np.eye(3), [[0, 1, 2]], colors=[[255, 0, 0]] * 3)
    ('normals, colours and attributes of the vertices',)

    Raises Error, or ValueError and TypeError for arrays of a wrong shape or type.
    """
    if isinstance(points, Denoised):
        points = points.surface
    if isinstance(points, (Surface, Loaded)):
        given = points
        points = given.vertices if isinstance(given, Surface) else given.points
        triangles = given.triangles if triangles is None else triangles
        normals = given.normals if normals is None else normals
        colors = given.colors if colors is None else colors
        attributes = given.attributes if attributes is None else attributes
        corner_uv = given.corner_uv if corner_uv is None else corner_uv
        corner_normals = given.corner_normals if corner_normals is None else corner_normals
        face_charts = given.face_charts if face_charts is None else face_charts
        if texture is None and isinstance(given, Loaded) and (given.texture or b"").startswith(_PNG):
            texture = given.texture
    points = positions(points, "points")
    out = points_struct(points)
    held: list[Any] = [points]
    m, uv = 0, None
    if triangles is not None:
        around, ends = polygons(triangles, "triangles")
        m = len(ends) - 1
        held += [around, ends]
        if (np.diff(ends) == 3).all():
            out.triangles, out.triangle_count = address(around), m
        else:
            out.faces.corners, out.faces.offsets = address(around), address(ends)
            out.faces.count, out.faces.scalar = m, _abi.U32
            uv = None if corner_uv is None else polygon_corners(corner_uv, len(around))
    if normals is not None:
        normals = rows(normals, (3,), "normals", (np.float32,))
        check_rows(normals, len(points), "normals")
        out.normals, out.normal_stride = normals.ctypes.data, normals.strides[0]
    if colors is not None:
        held.append(set_colors(out, colors, len(points)))
    columns = Attributes(attributes or {}, len(points))
    out.attributes, out.attribute_count = columns.structs, len(columns.names)
    if uv is None and corner_uv is not None:
        uv = corners(corner_uv, m)
    at_corners = None
    if corner_normals is not None:
        total = 3 * m if triangles is None else len(around)
        at_corners = np.ascontiguousarray(np.reshape(corner_normals, (-1, 3)), np.float32)
        check_rows(at_corners, total, "corner_normals")
    charts = None if face_charts is None else indices(face_charts, (m,), "face_charts")
    png = texture if texture is None or isinstance(texture, bytes) else _png(texture)
    image = None if png is None else np.frombuffer(png, np.uint8)
    how = options_with(
        _abi.atlasfit_save_options(),
        corner_uv=address(uv),
        corner_normals=address(at_corners),
        face_charts=address(charts),
        texture=address(image),
        texture_bytes=0 if image is None else len(image),
        ascii=int(ascii),
    )
    lost = create_string_buffer(_LOST_BYTES)
    name = os.fsencode(path)
    run(
        lambda r: lib().atlasfit_file_save(name, byref(out), byref(how), r, lost, len(lost)),
        options,
    )
    return tuple(lost.value.decode().splitlines())


_PNG = b"\x89PNG\r\n\x1a\n"


def _png(texels: NDArray[np.uint8]) -> bytes:
    """A PNG file of (h, w, 3 or 4) texels, the top row first."""
    texels = np.asarray(texels)
    if texels.ndim != 3 or texels.shape[2] not in (3, 4) or texels.dtype != np.uint8:
        raise ValueError(f"texture is {texels.dtype} {texels.shape}. Give (height, width, 3 or 4) uint8")
    height, width, channels = texels.shape
    rows_with_filter = np.zeros((height, 1 + width * channels), np.uint8)
    rows_with_filter[:, 1:] = texels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    packed = zlib.compress(rows_with_filter.tobytes(), 6)
    return _PNG + chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
