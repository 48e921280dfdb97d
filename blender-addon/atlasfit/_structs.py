"""The structs of atlasfit.h in ctypes, by its names."""

from __future__ import annotations

import ctypes
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

STAGE_LIMIT = 16
status = c_int32
progress_fn = CFUNCTYPE(c_int32, c_void_p, c_uint32, c_double)
log_fn = CFUNCTYPE(None, c_void_p, c_uint32, c_char_p)


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


class atlasfit_buffer(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("data", c_void_p),
        ("capacity", c_size_t),
        ("stride", c_size_t),
        ("component_stride", c_size_t),
        ("scalar", c_uint32),
        ("reserved", c_uint32),
    ]


class atlasfit_faces(Structure):
    _fields_ = [
        ("corners", c_void_p),
        ("offsets", c_void_p),
        ("count", c_size_t),
        ("corner_stride", c_size_t),
        ("face_stride", c_size_t),
        ("scalar", c_uint32),
        ("reserved", c_uint32),
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
        ("component_stride", c_size_t),
        ("faces", atlasfit_faces),
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
        ("log", log_fn),
        ("log_user", c_void_p),
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
        ("surface", c_uint32),
        ("uncertainty", c_uint32),
        ("sweeps", c_char_p),
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
        ("uncertainty_factor", c_double),
        ("sweeps", c_size_t),
        ("apart_before", c_double),
        ("apart_after", c_double),
    ]


class atlasfit_sweep(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("sweep", c_uint32),
        ("reserved", c_uint32),
        ("points", c_size_t),
        ("pairs", c_size_t),
        ("moved", c_double),
        ("matrix", c_double * 12),
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
        ("component_stride", c_size_t),
        ("faces", atlasfit_faces),
        ("face_ignored", c_void_p),
        ("seam_price", c_void_p),
        ("occupied_uv", c_void_p),
        ("occupied_count", c_size_t),
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
        ("straightness", c_double),
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
        ("keep_uvs", c_uint32),
        ("stack", c_uint32),
        ("max_energy", c_double),
        ("straighten", c_uint32),
        ("reserved_too", c_uint32),
        ("seams_hidden", c_double),
        ("up", c_double * 3),
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
        ("faces", c_size_t),
        ("corners", c_size_t),
        ("torn_faces", c_size_t),
        ("welded_vertices", c_size_t),
        ("stacked_parts", c_size_t),
        ("straightened_charts", c_size_t),
    ]


class atlasfit_simplify_options(Sized):
    _fields_ = [("struct_size", c_size_t), ("faces", c_size_t), ("max_error", c_double)]


class atlasfit_simplified_info(Sized):
    _fields_ = [
        ("struct_size", c_size_t),
        ("vertices", c_size_t),
        ("triangles", c_size_t),
        ("has_uv", c_uint32),
        ("has_colors", c_uint32),
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
        ("has_corner_normals", c_uint32),
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
        ("corner_normals", c_void_p),
    ]
