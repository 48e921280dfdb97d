"""atlasfit.h in ctypes: every constant, struct and function, and nowhere else.

Names are the header's. tests/test_abi.py reads the header and compares each of them with this file.
Arrays go in and out as addresses (c_void_p), handles as c_void_p, structs as pointers to the classes below.
"""

from __future__ import annotations

import ctypes
import os
import sys
from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_int32,
    c_int64,
    c_size_t,
    c_uint32,
    c_uint64,
    c_void_p,
)
from functools import lru_cache
from pathlib import Path

VERSION = (0, 1, 0)

PRIOR_GP, PRIOR_MLP, PRIOR_CONV, PRIOR_LEVEL_SET = range(4)
RECIPE_FAST, RECIPE_PAPER = 0, 1
OUTLIERS_KEEP, OUTLIERS_DROP = 0, 1
F32, F64, U8, I8, U16, I16, U32, I32 = range(8)
STAGE_LIMIT = 16
PACK_SHAPES, PACK_BOXES = 0, 1
PRESET_FEW_SEAMS, PRESET_BALANCED, PRESET_LOW_STRETCH = range(3)

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

status = c_int32
progress_fn = CFUNCTYPE(c_int32, c_void_p, c_uint32, c_double)


class Sized(Structure):
    """A struct that begins with its own size."""

    def __init__(self) -> None:
        super().__init__(ctypes.sizeof(type(self)))


class atlasfit_atlas_info(Sized):
    _fields_ = [("struct_size", c_size_t), ("charts", c_size_t), ("origin", c_double * 3), ("unit", c_double)]


class atlasfit_projection(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("capacity", c_size_t),
        ("positions", c_void_p),
        ("normals", c_void_p),
        ("charts", c_void_p),
        ("chart_uv", c_void_p),
        ("distances", c_void_p),
    ]


class atlasfit_attribute(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("name", c_char_p),
        ("values", c_void_p),
        ("stride", c_size_t),
        ("width", c_uint32),
        ("scalar", c_uint32),
    ]


class atlasfit_points(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("positions", c_void_p),
        ("count", c_size_t),
        ("stride", c_size_t),
        ("scalar", c_uint32),
        ("color_width", c_uint32),
        ("normals", c_void_p),
        ("normal_stride", c_size_t),
        ("colors", c_void_p),
        ("color_stride", c_size_t),
        ("color_scalar", c_uint32),
        ("attribute_count", c_uint32),
        ("attributes", POINTER(atlasfit_attribute)),
        ("triangles", c_void_p),
        ("triangle_count", c_size_t),
    ]


class atlasfit_run(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("seed", c_uint64),
        ("threads", c_uint32),
        ("reserved", c_uint32),
        ("time_limit_s", c_double),
        ("memory_limit_bytes", c_uint64),
        ("progress", progress_fn),
        ("progress_user", c_void_p),
        ("cancel", c_void_p),
        ("overall", c_void_p),
    ]


class atlasfit_denoise_options(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("noise", c_double),
        ("detail", c_double),
        ("fill_holes", c_double),
        ("charts", c_uint32),
        ("prior", c_uint32),
        ("outliers", c_uint32),
        ("uv", c_uint32),
        ("texture_size", c_uint32),
        ("network_charts", c_uint32),
        ("network_iterations", c_uint32),
        ("recipe", c_uint32),
        ("network_stretch_weight", c_double),
        ("network_learning_rate", c_double),
        ("viewpoint", c_double * 3),
        ("has_viewpoint", c_uint32),
        ("watertight", c_uint32),
        ("min_part", c_double),
        ("largest", c_uint32),
        ("faces", c_uint32),
        ("max_error", c_double),
        ("strength", c_double),
    ]


class atlasfit_report(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("points_given", c_size_t),
        ("not_finite", c_size_t),
        ("duplicates", c_size_t),
        ("outliers", c_size_t),
        ("points", c_size_t),
        ("vertices", c_size_t),
        ("triangles", c_size_t),
        ("charts", c_size_t),
        ("uv_charts", c_size_t),
        ("parts", c_size_t),
        ("boundary_loops", c_size_t),
        ("boundary_edges", c_size_t),
        ("filled_holes", c_size_t),
        ("attributes", c_size_t),
        ("one_sided", c_uint32),
        ("has_uv", c_uint32),
        ("has_colors", c_uint32),
        ("reserved", c_uint32),
        ("spacing", c_double),
        ("noise", c_double),
        ("voxel", c_double),
        ("stage_seconds", c_double * STAGE_LIMIT),
        ("dropped_parts", c_size_t),
        ("dropped_points", c_size_t),
        ("followed_outliers", c_size_t),
    ]


class atlasfit_mesh(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("positions", c_void_p),
        ("vertex_count", c_size_t),
        ("stride", c_size_t),
        ("scalar", c_uint32),
        ("reserved", c_uint32),
        ("triangles", c_void_p),
        ("triangle_count", c_size_t),
        ("corner_uv", c_void_p),
        ("face_group", c_void_p),
        ("face_polygon", c_void_p),
        ("seam_edges", c_void_p),
        ("seam_edge_count", c_size_t),
        ("face_page", c_void_p),
        ("page_width", c_uint32),
        ("page_height", c_uint32),
        ("colors", c_void_p),
        ("color_stride", c_size_t),
        ("color_scalar", c_uint32),
        ("color_width", c_uint32),
    ]


class atlasfit_image(Sized):
    _fields_ = [("struct_size", c_size_t), ("rgba", c_void_p), ("width", c_uint32), ("height", c_uint32)]


class atlasfit_textures(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("images", POINTER(atlasfit_image)),
        ("image_count", c_size_t),
        ("corner_uv", c_void_p),
        ("face_image", c_void_p),
        ("normals", c_uint32),
        ("reserved", c_uint32),
    ]


class atlasfit_bake_options(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("width", c_uint32),
        ("height", c_uint32),
        ("padding", c_uint32),
        ("page", c_uint32),
        ("textures", POINTER(atlasfit_textures)),
    ]


class atlasfit_topology(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("vertices", c_size_t),
        ("edges", c_size_t),
        ("faces", c_size_t),
        ("degenerate_faces", c_size_t),
        ("unused_vertices", c_size_t),
        ("parts", c_size_t),
        ("boundary_edges", c_size_t),
        ("boundary_loops", c_size_t),
        ("non_manifold_edges", c_size_t),
        ("non_manifold_vertices", c_size_t),
        ("inconsistent_edges", c_size_t),
        ("euler", c_int64),
        ("genus", c_int64),
        ("orientable", c_uint32),
        ("closed", c_uint32),
    ]


class atlasfit_uv_quality(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("faces", c_size_t),
        ("charts", c_size_t),
        ("flips", c_size_t),
        ("degenerate", c_size_t),
        ("overlapping_faces", c_size_t),
        ("seam", c_double),
        ("stretch_l2", c_double),
        ("stretch_linf", c_double),
        ("stretch_median", c_double),
        ("stretch_p95", c_double),
        ("conformal", c_double),
        ("overlap", c_double),
        ("coverage", c_double),
        ("inside", c_uint32),
        ("finite", c_uint32),
    ]


class atlasfit_distance_options(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("samples", c_size_t),
        ("chamfer_samples", c_size_t),
        ("threshold", c_double),
    ]


class atlasfit_distance_stats(Structure):
    _fields_ = [
        ("rms", c_double),
        ("mean", c_double),
        ("median", c_double),
        ("p95", c_double),
        ("p99", c_double),
        ("max", c_double),
    ]


class atlasfit_distance(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("accuracy", atlasfit_distance_stats),
        ("completeness", atlasfit_distance_stats),
        ("chamfer", c_double),
        ("chamfer_floor", c_double),
        ("f_score", c_double),
        ("threshold", c_double),
        ("normal_consistency", c_double),
        ("normal_orientation", c_double),
        ("not_finite", c_size_t),
    ]


class atlasfit_unwrap_options(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("max_stretch", c_double),
        ("max_charts", c_uint32),
        ("page_width", c_uint32),
        ("page_height", c_uint32),
        ("padding", c_uint32),
        ("pages", c_uint32),
        ("packer", c_uint32),
        ("keep_uv_seams", c_uint32),
        ("reserved", c_uint32),
        ("texels_per_unit", c_double),
        ("hard_edge_angle", c_double),
    ]


class atlasfit_uv_info(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("triangles", c_size_t),
        ("charts", c_size_t),
        ("pages", c_size_t),
        ("split_vertices", c_size_t),
        ("degenerate_faces", c_size_t),
        ("duplicate_faces", c_size_t),
        ("non_manifold_edges", c_size_t),
        ("repaired_charts", c_size_t),
        ("split_polygons", c_size_t),
        ("width", c_uint32),
        ("height", c_uint32),
        ("texels_per_unit", c_double),
        ("stretch_bound", c_double),
        ("over_stretched", c_double),
        ("coverage", c_double),
        ("seconds", c_double),
        ("padding", c_uint32),
        ("reserved", c_uint32),
    ]


class atlasfit_file_info(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("points", c_size_t),
        ("triangles", c_size_t),
        ("attributes", c_size_t),
        ("texture_bytes", c_size_t),
        ("has_normals", c_uint32),
        ("has_colors", c_uint32),
        ("has_uv", c_uint32),
        ("has_face_charts", c_uint32),
        ("has_viewpoint", c_uint32),
        ("reserved", c_uint32),
        ("viewpoint", c_double * 3),
    ]


class atlasfit_save_options(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("corner_uv", c_void_p),
        ("face_charts", c_void_p),
        ("texture", c_void_p),
        ("texture_bytes", c_size_t),
        ("ascii", c_uint32),
        ("reserved", c_uint32),
    ]


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
    "atlasfit_version": (c_uint32, []),
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
