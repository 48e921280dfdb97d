"""atlasfit.h in ctypes: every constant and function, and nowhere else; the structs are in _structs.py.

Names are the header's. tests/test_abi.py reads the header and compares each of them with this file.
Arrays go in and out as addresses (c_void_p), handles as c_void_p, structs as pointers to their classes.
"""

from __future__ import annotations

import ctypes
import os
import sys
from ctypes import POINTER, c_char_p, c_size_t, c_uint32, c_void_p
from functools import lru_cache
from pathlib import Path

from ._structs import *  # noqa: F403

VERSION = (0, 1, 0)

PRIOR_GP, PRIOR_MLP, PRIOR_CONV, PRIOR_LEVEL_SET = range(4)
RECIPE_FAST, RECIPE_PAPER = 0, 1
OUTLIERS_KEEP, OUTLIERS_DROP = 0, 1
F32, F64, U8, I8, U16, I16, U32, I32, U64, I64 = range(10)
SURFACE_NONE, SURFACE_SMOOTH, SURFACE_WRAP = range(3)
(
    POINT_POSITIONS,
    POINT_NORMALS,
    POINT_SOURCES,
    POINT_CHARTS,
    SURFACE_POSITIONS,
    SURFACE_NORMALS,
    SURFACE_TRIANGLES,
    SURFACE_CORNER_UV,
    SURFACE_FACE_CHARTS,
    SURFACE_COLORS,
    POINT_UNCERTAINTY,
    POINT_NOISE,
    POINT_OUTLIER_PROBABILITY,
    SURFACE_UNCERTAINTY,
    SURFACE_EXTRAPOLATED,
    SURFACE_CORNER_NORMALS,
) = range(16)
UV_CORNERS, UV_FACE_CHARTS, UV_FACE_PAGES = range(3)
PACK_SHAPES, PACK_BOXES = 0, 1
STACK_NONE, STACK_IDENTICAL, STACK_MIRRORED = range(3)
STRAIGHTEN_OFF, STRAIGHTEN_AUTO = 0, 1
PRESET_FEW_SEAMS, PRESET_BALANCED, PRESET_LOW_STRETCH = range(3)
LOG_ERROR, LOG_WARNING, LOG_INFO = range(1, 4)

OK = 0
INVALID_ARGUMENT = 1
ABI_MISMATCH = 2
INDEX_OUT_OF_RANGE = 3
INVALID_HANDLE = 4
EMPTY_INPUT = 5
BUFFER_TOO_SMALL = 6
CANCELLED = 7
TIMED_OUT = 8
DIVERGED = 9
OUT_OF_MEMORY = 10
DEGENERATE = 11
BAD_FILE = 12
NOT_AVAILABLE = 13
RESOURCE_EXHAUSTED = 14
IO = 15
INTERNAL = 100

_array = _handle = c_void_p
_new_handle = POINTER(c_void_p)
_run = POINTER(atlasfit_run)
_points = POINTER(atlasfit_points)
_mesh = POINTER(atlasfit_mesh)

# name: (result, arguments)
FUNCTIONS = {
    "atlasfit_atlas_free": (status, [_handle]),
    "atlasfit_atlas_get_info": (status, [_handle, POINTER(atlasfit_atlas_info)]),
    "atlasfit_projection_init": (status, [POINTER(atlasfit_projection), c_size_t]),
    "atlasfit_atlas_project": (status, [_handle, _points, _run, POINTER(atlasfit_projection)]),
    "atlasfit_atlas_eval": (status, [_handle, c_size_t, _array, c_size_t, _array, _array, _array, c_size_t]),
    "atlasfit_atlas_save": (status, [_handle, _array, c_size_t, _array]),
    "atlasfit_atlas_load": (status, [_array, c_size_t, _new_handle]),
    "atlasfit_bake_options_init": (status, [POINTER(atlasfit_bake_options), c_size_t]),
    "atlasfit_bake": (status, [_mesh, _points, POINTER(atlasfit_bake_options), _run, _array, c_size_t]),
    "atlasfit_image_init": (status, [POINTER(atlasfit_image), c_size_t]),
    "atlasfit_textures_init": (status, [POINTER(atlasfit_textures), c_size_t]),
    "atlasfit_textures_page": (status, [_mesh, POINTER(atlasfit_textures), _run, _array, _array, _array]),
    "atlasfit_texture_side": (c_uint32, [c_size_t]),
    "atlasfit_denoise_options_init": (status, [POINTER(atlasfit_denoise_options), c_size_t]),
    "atlasfit_denoise_memory_needed": (status, [c_size_t, POINTER(atlasfit_denoise_options), _run, _array]),
    "atlasfit_denoise": (status, [_points, POINTER(atlasfit_denoise_options), _run, _new_handle]),
    "atlasfit_result_free": (status, [_handle]),
    "atlasfit_result_warnings": (status, [_handle, _array, c_size_t, _array]),
    "atlasfit_result_report": (status, [_handle, POINTER(atlasfit_report)]),
    "atlasfit_result_sweep": (status, [_handle, c_size_t, POINTER(atlasfit_sweep)]),
    "atlasfit_result_point_positions": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_point_normals": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_point_sources": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_point_charts": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_positions": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_normals": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_triangles": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_corner_uv": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_face_charts": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_colors": (status, [_handle, _array, c_size_t]),
    "atlasfit_result_surface_attribute": (status, [_handle, c_size_t, _array, c_size_t]),
    "atlasfit_buffer_init": (status, [POINTER(atlasfit_buffer), c_size_t]),
    "atlasfit_result_copy": (status, [_handle, c_uint32, POINTER(atlasfit_buffer)]),
    "atlasfit_uv_copy": (status, [_handle, c_uint32, POINTER(atlasfit_buffer)]),
    "atlasfit_result_atlas": (status, [_handle, _new_handle]),
    "atlasfit_live_handles": (c_size_t, []),
    "atlasfit_attribute_init": (status, [POINTER(atlasfit_attribute), c_size_t]),
    "atlasfit_points_init": (status, [_points, c_size_t]),
    "atlasfit_mesh_init": (status, [_mesh, c_size_t]),
    "atlasfit_measure_topology": (status, [_mesh, _run, POINTER(atlasfit_topology)]),
    "atlasfit_measure_uv": (status, [_mesh, _run, POINTER(atlasfit_uv_quality), _array, c_size_t]),
    "atlasfit_distance_options_init": (status, [POINTER(atlasfit_distance_options), c_size_t]),
    "atlasfit_measure_surface": (
        status,
        [_mesh, _mesh, POINTER(atlasfit_distance_options), _run, POINTER(atlasfit_distance)],
    ),
    "atlasfit_measure_points": (
        status,
        [
            _points,
            _mesh,
            POINTER(atlasfit_distance_options),
            _run,
            POINTER(atlasfit_distance),
            _array,
            c_size_t,
        ],
    ),
    "atlasfit_cancel_new": (status, [_new_handle]),
    "atlasfit_cancel_request": (status, [_handle]),
    "atlasfit_cancel_free": (status, [_handle]),
    "atlasfit_run_init": (status, [_run, c_size_t]),
    "atlasfit_stage_name": (c_char_p, [c_uint32]),
    "atlasfit_simplify_options_init": (status, [POINTER(atlasfit_simplify_options), c_size_t]),
    "atlasfit_simplify": (status, [_mesh, POINTER(atlasfit_simplify_options), _run, _new_handle]),
    "atlasfit_simplified_free": (status, [_handle]),
    "atlasfit_simplified_get_info": (status, [_handle, POINTER(atlasfit_simplified_info)]),
    "atlasfit_simplified_warnings": (status, [_handle, _array, c_size_t, _array]),
    "atlasfit_simplified_positions": (status, [_handle, _array, c_size_t]),
    "atlasfit_simplified_triangles": (status, [_handle, _array, c_size_t]),
    "atlasfit_simplified_sources": (status, [_handle, _array, c_size_t]),
    "atlasfit_simplified_corner_uv": (status, [_handle, _array, c_size_t]),
    "atlasfit_simplified_colors": (status, [_handle, _array, c_size_t]),
    "atlasfit_version": (c_uint32, []),
    "atlasfit_features": (c_char_p, []),
    "atlasfit_status_name": (c_char_p, [status]),
    "atlasfit_last_error": (c_size_t, [c_void_p, c_size_t]),
    "atlasfit_unwrap_options_init": (status, [POINTER(atlasfit_unwrap_options), c_size_t]),
    "atlasfit_unwrap_options_set_preset": (status, [POINTER(atlasfit_unwrap_options), c_uint32]),
    "atlasfit_unwrap_memory_needed": (
        status, [c_size_t, c_size_t, POINTER(atlasfit_unwrap_options), _run, _array],
    ),
    "atlasfit_unwrap": (status, [_mesh, POINTER(atlasfit_unwrap_options), _run, _new_handle]),
    "atlasfit_uv_free": (status, [_handle]),
    "atlasfit_uv_warnings": (status, [_handle, _array, c_size_t, _array]),
    "atlasfit_uv_get_info": (status, [_handle, POINTER(atlasfit_uv_info)]),
    "atlasfit_uv_corners": (status, [_handle, _array, c_size_t]),
    "atlasfit_uv_face_charts": (status, [_handle, _array, c_size_t]),
    "atlasfit_uv_face_pages": (status, [_handle, _array, c_size_t]),
    "atlasfit_uv_face_torn": (status, [_handle, _array, c_size_t]),
    "atlasfit_uv_split": (status, [_handle, _array, c_size_t, _array, _array, c_size_t]),
    "atlasfit_file_free": (status, [_handle]),
    "atlasfit_file_load": (status, [_array, _run, _new_handle]),
    "atlasfit_file_get_info": (status, [_handle, POINTER(atlasfit_file_info)]),
    "atlasfit_file_notes": (status, [_handle, _array, c_size_t, _array]),
    "atlasfit_file_positions": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_normals": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_colors": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_triangles": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_corner_uv": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_corner_normals": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_face_charts": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_texture": (status, [_handle, _array, c_size_t]),
    "atlasfit_file_attribute_type": (
        status, [_handle, c_size_t, _array, c_size_t, _array, _array, _array],
    ),
    "atlasfit_file_attribute": (status, [_handle, c_size_t, _array, c_size_t]),
    "atlasfit_save_options_init": (status, [POINTER(atlasfit_save_options), c_size_t]),
    "atlasfit_file_save": (
        status, [_array, _points, POINTER(atlasfit_save_options), _run, _array, c_size_t],
    ),
}

LIBRARY_NAME = {"win32": "atlasfit.dll", "darwin": "libatlasfit.dylib"}.get(sys.platform, "libatlasfit.so")


@lru_cache(maxsize=None)
def lib() -> ctypes.CDLL:
    """The native library: the one beside this file, or the one that the environment variable ATLASFIT_LIBRARY
    names.
    """
    path = Path(os.environ.get("ATLASFIT_LIBRARY") or Path(__file__).with_name(LIBRARY_NAME))
    if not path.is_file():
        raise ImportError(
            f"the native library {path} is missing. Install the wheel or the add-on zip that was made for"
            " this platform, or let ATLASFIT_LIBRARY name the library that `cargo build --release -p"
            " atlasfit-capi` makes"
        )
    library = ctypes.CDLL(str(path))
    library.atlasfit_version.restype = c_uint32
    found = library.atlasfit_version()
    found = (found >> 24, found >> 16 & 255, found >> 8 & 255)
    # While major is 0 the ABI holds within one minor version.
    if found[:2] != VERSION[:2]:
        raise ImportError(
            f"the native library {path} is version {'.'.join(map(str, found))}, this package is for "
            f"{VERSION[0]}.{VERSION[1]}. Reinstall both together"
        )
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(library, name, None)
        if function is None:
            raise ImportError(
                f"the native library {path} has no {name}: it is older than this package. Reinstall both"
                " together"
            )
        function.restype, function.argtypes = result, arguments
    return library
