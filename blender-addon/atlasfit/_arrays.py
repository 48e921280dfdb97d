"""numpy arrays in and out of the library's structs.

An input is passed as it lies in memory if its rows are contiguous (C-contiguous arrays, and columns cut from
wider ones); otherwise it is copied once. The array that was passed must outlive the call: each function keeps
what these return.
"""

from __future__ import annotations

from ctypes import sizeof
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np

from . import _abi

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, DTypeLike, NDArray

SCALARS: dict[np.dtype[Any], int] = {
    np.dtype(np.float32): _abi.F32,
    np.dtype(np.float64): _abi.F64,
    np.dtype(np.uint8): _abi.U8,
    np.dtype(np.int8): _abi.I8,
    np.dtype(np.uint16): _abi.U16,
    np.dtype(np.int16): _abi.I16,
    np.dtype(np.uint32): _abi.U32,
    np.dtype(np.int32): _abi.I32,
}


def rows(values: ArrayLike, widths: tuple[int, ...], what: str, types: tuple[type, ...]) -> NDArray[Any]:
    """(n, width) numbers whose rows are contiguous; types[0] is what other types become."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] not in widths:
        raise ValueError(f"{what} has shape {array.shape}. Give (n, {' or '.join(map(str, widths))})")
    if array.dtype.type not in types or not array.dtype.isnative:
        array = array.astype(types[0])
    width = array.shape[1] * array.itemsize
    # A stride of 0 (a broadcast row) or less means something else to the library.
    if array.strides[1] != array.itemsize or (len(array) > 1 and array.strides[0] < width):
        array = np.ascontiguousarray(array)
    return array


def positions(values: ArrayLike, what: str) -> NDArray[Any]:
    """(n, 3) floats."""
    return rows(values, (3,), what, (np.float64, np.float32))


def indices(values: ArrayLike, shape: tuple[int, ...], what: str) -> NDArray[np.uint32]:
    """C-contiguous indices of this shape, -1 standing for any length; int32 and uint32 as they are."""
    array = np.asarray(values)
    if array.size == 0:
        array = array.astype(np.uint32).reshape([max(n, 0) for n in shape])
    if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape)):
        raise ValueError(
            f"{what} has shape {array.shape}. Give ({', '.join('n' if n < 0 else str(n) for n in shape)})"
        )
    if array.dtype.kind not in "iu":
        raise TypeError(f"{what} are of type {array.dtype}. Give integers")
    if array.dtype.newbyteorder("=") not in (np.uint32, np.int32) and array.size:
        low, high = array.min(), array.max()
        if low < 0 or high > 0xFFFFFFFF:
            raise ValueError(f"{what} hold {low if low < 0 else high}, which is no index")
    if array.dtype == np.int32 and array.dtype.isnative:
        array = array.view(np.uint32)
    return np.ascontiguousarray(array, np.uint32)


def polygons(
    values: ArrayLike | Sequence[ArrayLike], what: str
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Faces, (m, k) or a sequence of the vertices of each: all corners one after another, and where those of
    each face begin, and at last end.
    """
    if isinstance(values, (list, tuple)):
        sizes = [np.size(face) for face in values]
        if len(set(sizes)) > 1:
            flat = np.concatenate([np.ravel(face) for face in values])
            return indices(flat, (-1,), what), np.cumsum([0, *sizes], dtype=np.uint32)
    array = indices(values, (-1, -1), what)
    if array.size and array.shape[1] < 3:
        raise ValueError(f"{what} has shape {array.shape}. Give at least three vertices for each face")
    return array.reshape(-1), np.arange(0, array.size + 1, max(array.shape[1], 1), dtype=np.uint32)


def points_struct(points: NDArray[Any]) -> _abi.atlasfit_points:
    """Points with their positions only. `points` must outlive it."""
    out = _abi.atlasfit_points()
    out.positions, out.count, out.stride = points.ctypes.data, len(points), points.strides[0]
    out.scalar, out.color_width = SCALARS[points.dtype], 4
    return out


def mesh_struct(
    vertices: NDArray[Any], faces: NDArray[np.uint32], corner_uv: NDArray[np.float32] | None = None
) -> _abi.atlasfit_mesh:
    """A mesh. The arrays must outlive it."""
    out = _abi.atlasfit_mesh()
    out.positions, out.vertex_count, out.stride = vertices.ctypes.data, len(vertices), vertices.strides[0]
    out.scalar = SCALARS[vertices.dtype]
    out.triangles, out.triangle_count = faces.ctypes.data, len(faces)
    out.corner_uv = address(corner_uv)
    return out


def _as_colors(values: ArrayLike) -> NDArray[Any]:
    """Colours as the library takes them: floats in [0, 1], or uint8. Whole numbers from 0 to 255 are taken
    for
    those of 8 bits, whatever their type; what is neither is refused.
    """
    array = np.asarray(values)
    if array.dtype.kind in "iu" and array.dtype != np.uint8 and array.size:
        low, high = array.min(), array.max()
        if low < 0 or high > 255:
            more = " Divide colors of 16 bits by 65535.0" if high > 255 else ""
            raise ValueError(f"colors of integers go from {low} to {high}. Give 0 to 255.{more}")
        return array.astype(np.uint8)
    if array.dtype.kind == "f" and array.size and (high := np.max(array)) > 1:
        if high <= 255 and np.min(array) >= 0 and (array == np.floor(array)).all():
            return array.astype(np.uint8)
        if high > _BRIGHTEST:
            raise ValueError(
                f"colors of floats go up to {high:.6g}. Give 0 to 1 (divide those of 8 bits by 255), or uint8"
            )
    return array


_BRIGHTEST = 16.0
"""Floats above 1 and up to this are light brighter than white, as hosts have it, and no colours of 8 bits."""


def set_colors(
    struct: _abi.atlasfit_points | _abi.atlasfit_mesh, values: ArrayLike, count: int
) -> NDArray[Any]:
    """Gives points or a mesh its colours, (count, 3 or 4). What is returned must outlive the struct."""
    array = rows(_as_colors(values), (3, 4), "colors", (np.float32, np.uint8))
    check_rows(array, count, "colors")
    struct.colors, struct.color_stride = array.ctypes.data, array.strides[0]
    struct.color_width, struct.color_scalar = array.shape[1], SCALARS[array.dtype]
    return array


def check_rows(array: NDArray[Any], count: int, what: str) -> None:
    """Refuses what has not one row for each point or vertex."""
    if len(array) != count:
        raise ValueError(f"{what} has {len(array)} rows. Give one for each of the {count} points or vertices")


def numbers(
    values: ArrayLike, shape: tuple[int, ...], what: str, kind: DTypeLike = np.float32
) -> NDArray[Any]:
    """Numbers of this shape."""
    array = np.ascontiguousarray(values, kind)
    if array.shape != shape:
        raise ValueError(f"{what} has shape {array.shape}. Give {shape}")
    return array


def corners(values: ArrayLike, faces: int) -> NDArray[np.float32]:
    """UVs per corner, (faces, 3, 2)."""
    array = np.ascontiguousarray(values, np.float32)
    if array.shape != (faces, 3, 2):
        raise ValueError(
            f"corner_uv has shape {array.shape}. Give ({faces}, 3, 2): u, v of each corner of each face"
        )
    return array


def uv_triangles(values: ArrayLike, name: str) -> NDArray[np.float32]:
    """Any number of UV triangles, (k, 3, 2)."""
    array = np.ascontiguousarray(values, np.float32)
    if array.ndim != 3 or array.shape[1:] != (3, 2):
        raise ValueError(f"{name} has shape {array.shape}. Give (k, 3, 2): u, v of each corner")
    return array


def polygon_corners(values: ArrayLike, count: int) -> NDArray[np.float32]:
    """UVs of so many corners of polygons, (count, 2) or by face (m, k, 2)."""
    array = np.ascontiguousarray(values, np.float32)
    if array.size != 2 * count or array.shape[-1] != 2:
        raise ValueError(f"corner_uv has shape {array.shape}. Give ({count}, 2): u, v of each corner")
    return array


def _labels(array: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Integers in a type that the library takes as labels: truth values as uint8, 64 bits as 32. Where the
    numbers need all 64, their places among the distinct ones, and those.
    """
    if array.dtype == np.bool_:
        return array.astype(np.uint8), None
    if array.dtype.kind not in "iu" or array.itemsize < 8:
        return array, None
    low, high = (int(array.min()), int(array.max())) if array.size else (0, 0)
    for narrow in (np.int32, np.uint32):
        if np.iinfo(narrow).min <= low and high <= np.iinfo(narrow).max:
            return array.astype(narrow), None
    distinct, places = np.unique(array, return_inverse=True)
    return places.reshape(array.shape).astype(np.uint32), distinct


class Attributes:
    """The attribute structs of named columns, (n,) or (n, k), and the arrays behind them."""

    def __init__(self, columns: Mapping[str, ArrayLike], count: int) -> None:
        self.names = list(columns)
        self.arrays: list[NDArray[Any]] = []
        self.shapes: list[tuple[int, ...]] = []
        self.types: list[np.dtype[Any]] = []
        self.labels: list[NDArray[Any] | None] = []
        self.structs = (_abi.atlasfit_attribute * max(len(columns), 1))()
        for struct, (name, values) in zip(self.structs, columns.items()):
            array = np.asarray(values)
            if array.shape[:1] != (count,) or array.ndim > 2:
                raise ValueError(
                    f"attribute {name!r} has shape {array.shape}. Give one row for each of the {count} points"
                )
            self.shapes.append(array.shape[1:])
            self.types.append(array.dtype if array.dtype.kind in "fiub" else np.dtype(np.float64))
            array, labels = _labels(array)
            self.labels.append(labels)
            array = array.reshape(count, -1) if array.ndim == 1 else array
            array = rows(
                array, (array.shape[1],), f"attribute {name!r}", (np.float64, *(t.type for t in SCALARS))
            )
            self.arrays.append(array)
            struct.struct_size = sizeof(struct)
            struct.name, struct.values, struct.stride = name.encode(), array.ctypes.data, array.strides[0]
            struct.width, struct.scalar = array.shape[1], SCALARS[array.dtype]

    def carried(self, i: int, values: NDArray[np.float64]) -> NDArray[Any]:
        """Column `i` of the surface, in the numbers and the type that were given."""
        labels = self.labels[i]
        found = values if labels is None else labels[values.astype(np.intp)]
        return found.astype(self.types[i], copy=False)


def address(array: NDArray[Any] | None) -> int | None:
    """Where an array's numbers are; None stays NULL."""
    return None if array is None else array.ctypes.data
