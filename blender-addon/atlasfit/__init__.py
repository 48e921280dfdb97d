"""atlasfit: fits an atlas of smooth charts to a noisy 3D scan.

    import atlasfit
    result = atlasfit.denoise(points)           # (n, 3) -> .points, .surface, .atlas, .report
    uv = atlasfit.unwrap(vertices, faces)       # any triangle mesh -> .corner_uv, .face_charts, .info
    atlasfit.bake(vertices, faces, uv.corner_uv, colors)    # -> the texture's texels

Every long function releases the GIL, takes progress= and cancel= (see RunOptions), and stops on Ctrl-C.
float32 and float64 arrays with contiguous rows, and int32 and uint32 faces, go in without a copy.
"""

from ._abi import VERSION
from ._atlas import Atlas, Places, Projection
from ._bake import bake
from ._call import Cancel, Cancelled, Error, Progress, RunOptions, TimedOut
from ._denoise import Denoised, Report, Surface, denoise, denoise_memory_needed
from ._measure import (
    Distance,
    DistanceStats,
    Topology,
    UvQuality,
    measure_points,
    measure_surface,
    measure_topology,
    measure_uv,
)
from ._simplify import Simplified, simplify
from ._unwrap import Uv, UvInfo, unwrap, unwrap_memory_needed

__version__ = ".".join(map(str, VERSION))

NO_CHART = 0xFFFFFFFF
"""The chart of a point that lies on none."""


__all__ = [
    "NO_CHART",
    "Atlas",
    "Cancel",
    "Cancelled",
    "Denoised",
    "Distance",
    "DistanceStats",
    "Error",
    "Places",
    "Progress",
    "Projection",
    "Report",
    "RunOptions",
    "Simplified",
    "Surface",
    "TimedOut",
    "Topology",
    "Uv",
    "UvInfo",
    "UvQuality",
    "bake",
    "denoise",
    "denoise_memory_needed",
    "measure_points",
    "measure_surface",
    "measure_topology",
    "measure_uv",
    "simplify",
    "unwrap",
    "unwrap_memory_needed",
]
