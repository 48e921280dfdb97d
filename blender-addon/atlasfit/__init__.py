"""atlasfit: fits an atlas of smooth charts to a noisy 3D scan.

    import atlasfit
    scan = atlasfit.load("scan.e57")            # any format -> .points, .colors, .columns()
    result = atlasfit.denoise(scan.points, **scan.columns(), progress=True)     # or any (n, 3) array
    result.points, result.surface, result.atlas, result.report
    atlasfit.save("surface.glb", result)
    uv = atlasfit.unwrap(vertices, faces)       # any triangle mesh -> .corner_uv, .face_charts, .info
    atlasfit.bake(vertices, faces, uv.corner_uv, colors)    # -> the texture's texels

Every long function releases the GIL, takes progress= and cancel= (see RunOptions), and stops on Ctrl-C.
float32 and float64 arrays with contiguous rows, and int32 and uint32 faces, go in without a copy.
"""

from ._abi import VERSION
from ._atlas import Atlas, Places, Projection
from ._bake import TexturePage, bake, bake_textures, texture_page, texture_side
from ._call import Cancel, Cancelled, Error, RunOptions, TimedOut
from ._denoise import Denoised, Report, Surface, Sweep, denoise, denoise_memory_needed
from ._files import Loaded, load, save
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
from ._progress import Progress
from ._simplify import Simplified, simplify
from ._unwrap import Uv, UvInfo, unwrap, unwrap_memory_needed

__version__ = ".".join(map(str, VERSION))

NO_CHART = 0xFFFFFFFF
"""The chart of a point that lies on none."""
NO_IMAGE = 0xFFFFFFFF
"""The image of a face that has none."""


__all__ = [
    "NO_CHART",
    "NO_IMAGE",
    "Atlas",
    "Cancel",
    "Cancelled",
    "Denoised",
    "Distance",
    "DistanceStats",
    "Error",
    "Loaded",
    "Places",
    "Progress",
    "Projection",
    "Report",
    "RunOptions",
    "Simplified",
    "Surface",
    "Sweep",
    "TexturePage",
    "TimedOut",
    "Topology",
    "Uv",
    "UvInfo",
    "UvQuality",
    "bake",
    "bake_textures",
    "denoise",
    "denoise_memory_needed",
    "load",
    "measure_points",
    "measure_surface",
    "measure_topology",
    "measure_uv",
    "save",
    "simplify",
    "texture_page",
    "texture_side",
    "unwrap",
    "unwrap_memory_needed",
]
