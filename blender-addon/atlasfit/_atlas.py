"""The fitted atlas: overlapping charts, each a smooth map from the unit disk into space."""

from __future__ import annotations

import ctypes
import os
from ctypes import byref
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _abi
from ._abi import lib
from ._brief import brief, counted
from ._arrays import points_struct, positions, rows
from ._call import Handle, RunOptions, check, plain, run

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack


@dataclass(frozen=True, repr=False)
class Projection:
    """Points moved onto an atlas, in the points' order.

    positions  (n, 3) float64
    normals    (n, 3) float32, unit length, in the atlas's orientation
    charts     (n,) uint32, the nearest chart; NO_CHART for a point that is not finite (its position is given
               back, the rest is 0)
    chart_uv   (n, 2) float32, coordinates in that chart's unit disk
    distances  (n,) float64, from each point to its projection
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float32]
    charts: NDArray[np.uint32]
    chart_uv: NDArray[np.float32]
    distances: NDArray[np.float64]

    def __repr__(self) -> str:
        return brief(self, counted(len(self.positions), "point"))



@dataclass(frozen=True, repr=False)
class Places:
    """Places on one chart.

    positions  (n, 3) float64
    normals    (n, 3) float32, unit length
    inside     (n,) float32 in [0, 1]: one half at the edge of the surface, less beyond
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float32]
    inside: NDArray[np.float32]

    def __repr__(self) -> str:
        return brief(self, counted(len(self.positions), "place"))



class Atlas:
    """A fitted atlas, made by denoise() or read from a file. Immutable: any number of threads may use one at
    once. It can be pickled.
    """

    def __init__(self, handle: Handle) -> None:
        self._handle = handle
        info = _abi.atlasfit_atlas_info()
        check(lib().atlasfit_atlas_get_info(handle.pointer, byref(info)))
        self.charts: int = info.charts
        """Number of charts."""
        self.origin: tuple[float, float, float] = tuple(info.origin)
        """Origin of the frame that the charts are held in, in the scan's."""
        self.unit: float = info.unit
        """Length of that frame's unit in the scan's: about the scan's longest side."""

    def project(self, points: ArrayLike, **options: Unpack[RunOptions]) -> Projection:
        """Moves each of the (n, 3) points to the nearest place on the atlas's surface.

        It denoises points that the atlas was not fitted to, and the vertices of any mesh. Accurate for points
        nearer to the surface than it bends.
        """
        points = positions(points, "points")
        n = len(points)
        out = Projection(
            np.empty((n, 3)),
            np.empty((n, 3), np.float32),
            np.empty(n, np.uint32),
            np.empty((n, 2), np.float32),
            np.empty(n),
        )
        target = _abi.atlasfit_projection()
        target.capacity = n
        for name, array in vars(out).items():
            setattr(target, name, array.ctypes.data)
        given = points_struct(points)
        run(
            lambda r: lib().atlasfit_atlas_project(self._handle.pointer, byref(given), r, byref(target)),
            options,
        )
        return out

    def evaluate(self, chart: int, uv: ArrayLike) -> Places:
        """The places of (n, 2) chart coordinates in the unit disk: the circle of radius 1 about 0 is the
        chart's rim.
        """
        uv = np.ascontiguousarray(rows(uv, (2,), "uv", (np.float64,)))
        n = len(uv)
        out = Places(np.empty((n, 3)), np.empty((n, 3), np.float32), np.empty(n, np.float32))
        arrays: list[Any] = [array.ctypes.data for array in vars(out).values()]
        check(lib().atlasfit_atlas_eval(self._handle.pointer, plain(chart), uv.ctypes.data, n, *arrays, n))
        return out

    def to_bytes(self) -> bytes:
        """The atlas as a safetensors file's bytes, the same for the same atlas: about 1 KB per chart."""
        size = ctypes.c_size_t()
        check(lib().atlasfit_atlas_save(self._handle.pointer, None, 0, byref(size)))
        out = ctypes.create_string_buffer(size.value)
        check(lib().atlasfit_atlas_save(self._handle.pointer, out, size, byref(size)))
        return out.raw

    @classmethod
    def from_bytes(cls, data: bytes) -> Atlas:
        """The atlas that to_bytes() wrote. The bytes need not be trusted: what is no sound atlas raises
        Error.
        """
        handle = Handle("atlas")
        check(lib().atlasfit_atlas_load(data, len(data), byref(handle.pointer)))
        return cls(handle)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the atlas to a file."""
        Path(path).write_bytes(self.to_bytes())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Atlas:
        """Reads an atlas from a file that save() wrote."""
        return cls.from_bytes(Path(path).read_bytes())

    def __reduce__(self) -> tuple[Any, ...]:
        return Atlas.from_bytes, (self.to_bytes(),)

    def __repr__(self) -> str:
        return brief(self, counted(self.charts, "chart"))
