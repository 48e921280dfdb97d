/* atlasfit.h - the C ABI of atlasfit. C99 and C++. Written by cbindgen from rust/atlasfit-capi: do not edit.
 * SPDX-License-Identifier: MIT OR Apache-2.0 */

#ifndef ATLASFIT_H
#define ATLASFIT_H

#include <stddef.h>
#include <stdint.h>

/* Conventions
 *
 * Status    0 is success. After a failure atlasfit_last_error() gives this thread's text: what was wrong,
 *           where, what to do. A call that fails writes nothing, but for NULL to a handle that it was to
 *           make.
 * Handles   Each kind has one _free, which takes NULL. Handles are checked: one that was freed, or is of
 *           another kind, gives a status and no crash. A handle given as const may be used by any number of
 *           threads at once; all results are immutable.
 * Structs   Each begins with struct_size. Fill structs that go in with their _init; set struct_size of those
 *           that come out. Structs only grow, at the end: a program keeps working with newer libraries of
 *           the same major version (while major is 0: of the same minor version).
 * Memory    Inputs are borrowed for the call, outputs are copied to the caller's buffers. A capacity counts
 *           numbers (floats, indices) unless said otherwise. Strides are in bytes, 0 = tightly packed;
 *           nothing needs to be aligned. Strings are UTF-8.
 * Lengths   All are in the caller's unit and frame. f64 positions keep survey coordinates.
 * Threads   Each long call has worker threads of its own, which end before it returns. Progress is called on
 *           the calling thread only.
 * Results   Input, options, seed and version decide every byte; the number of threads does not.
 * Limits    Nothing unwinds out of the library: no panic, no exception. It prints nothing, reads no
 *           environment variable, and no file but those that atlasfit_file_... is told of. On Linux dlclose()
 *           leaves the library in the process; elsewhere never unload it. */

/* Defined as ATLASFIT_STATIC when linking libatlasfit.a on Windows; nothing to define elsewhere. */
#ifndef ATLASFIT_API
#if defined(_WIN32) && !defined(ATLASFIT_STATIC)
#define ATLASFIT_API __declspec(dllimport)
#else
#define ATLASFIT_API
#endif
#endif

/* The version of this header; the library's own is atlasfit_version(). */
#define ATLASFIT_VERSION \
  (((uint32_t)ATLASFIT_VERSION_MAJOR << 24) | ((uint32_t)ATLASFIT_VERSION_MINOR << 16) | \
   ((uint32_t)ATLASFIT_VERSION_PATCH << 8))


/**
 * Major version of this header.
 */
#define ATLASFIT_VERSION_MAJOR 0

/**
 * Minor version of this header.
 */
#define ATLASFIT_VERSION_MINOR 1

/**
 * Patch version of this header.
 */
#define ATLASFIT_VERSION_PATCH 0

/**
 * Done.
 */
#define ATLASFIT_OK 0

/**
 * An argument or option is out of range, or a pointer that must be given is NULL.
 */
#define ATLASFIT_INVALID_ARGUMENT 1

/**
 * A struct_size fits no version of the struct that this library knows, or a field is set that only a newer
 * library knows.
 */
#define ATLASFIT_ABI_MISMATCH 2

/**
 * A triangle or seam edge names a vertex that does not exist, or a chart index is too large.
 */
#define ATLASFIT_INDEX_OUT_OF_RANGE 3

/**
 * A pointer is no live handle of the kind that is asked for: it never was one, was freed, or is of another
 * kind.
 */
#define ATLASFIT_INVALID_HANDLE 4

/**
 * Nothing usable was given.
 */
#define ATLASFIT_EMPTY_INPUT 5

/**
 * The caller's buffer is smaller than the result; nothing was written to it.
 */
#define ATLASFIT_BUFFER_TOO_SMALL 6

/**
 * The progress callback or a cancel token asked to stop.
 */
#define ATLASFIT_CANCELLED 7

/**
 * The time limit passed.
 */
#define ATLASFIT_TIMED_OUT 8

/**
 * An iteration left the finite numbers.
 */
#define ATLASFIT_DIVERGED 9

/**
 * The memory limit would be exceeded, or memory ran out.
 */
#define ATLASFIT_OUT_OF_MEMORY 10

/**
 * The input has no surface that could be fitted, or no area that could be measured or unwrapped.
 */
#define ATLASFIT_DEGENERATE 11

/**
 * A file, or bytes, of no known format, damaged beyond repair, or of a newer version; or data that the
 * format of the output cannot hold.
 */
#define ATLASFIT_BAD_FILE 12

/**
 * The result does not hold what is asked for (UVs of a run without UVs, for example), or the library was
 * built without it.
 */
#define ATLASFIT_NOT_AVAILABLE 13

/**
 * The system refuses what a run needs beside memory: it starts no more threads.
 */
#define ATLASFIT_RESOURCE_EXHAUSTED 14

/**
 * A file cannot be opened, read or written: the system refuses.
 */
#define ATLASFIT_IO 15

/**
 * A defect of this library; please report it with the input that caused it.
 */
#define ATLASFIT_INTERNAL 100

/**
 * Level of a line of the log: why the call fails. It is the text of atlasfit_last_error().
 */
#define ATLASFIT_LOG_ERROR 1

/**
 * Level of a line of the log: what the user should hear of the result.
 */
#define ATLASFIT_LOG_WARNING 2

/**
 * Level of a line of the log: what the call is doing.
 */
#define ATLASFIT_LOG_INFO 3

/**
 * Length of stage_seconds in #atlasfit_report: no version numbers more stages.
 */
#define ATLASFIT_STAGE_LIMIT 16

/**
 * 32-bit float.
 */
#define ATLASFIT_F32 0

/**
 * 64-bit float.
 */
#define ATLASFIT_F64 1

/**
 * Unsigned 8-bit integer.
 */
#define ATLASFIT_U8 2

/**
 * Signed 8-bit integer.
 */
#define ATLASFIT_I8 3

/**
 * Unsigned 16-bit integer.
 */
#define ATLASFIT_U16 4

/**
 * Signed 16-bit integer.
 */
#define ATLASFIT_I16 5

/**
 * Unsigned 32-bit integer.
 */
#define ATLASFIT_U32 6

/**
 * Signed 32-bit integer.
 */
#define ATLASFIT_I32 7

/**
 * Unsigned 64-bit integer.
 */
#define ATLASFIT_U64 8

/**
 * Signed 64-bit integer.
 */
#define ATLASFIT_I64 9

/**
 * atlasfit_denoise_options.prior: a Gaussian process as smooth as the limit of the paper's networks.
 */
#define ATLASFIT_PRIOR_GP 0

/**
 * atlasfit_denoise_options.prior: the paper's fully connected networks, trained on the scan first; many
 * times slower.
 */
#define ATLASFIT_PRIOR_MLP 1

/**
 * atlasfit_denoise_options.prior: the paper's convolutional networks.
 */
#define ATLASFIT_PRIOR_CONV 2

/**
 * atlasfit_denoise_options.prior: the paper's level set: closed surfaces only.
 */
#define ATLASFIT_PRIOR_LEVEL_SET 3

/**
 * atlasfit_denoise_options.recipe: training from coarse to fine, with falling learning rates.
 */
#define ATLASFIT_RECIPE_FAST 0

/**
 * atlasfit_denoise_options.recipe: training as in the paper, with all samples at every step.
 */
#define ATLASFIT_RECIPE_PAPER 1

/**
 * atlasfit_denoise_options.outliers: outliers stay among the denoised points, where
 * they were (those of a mesh between their neighbours: see triangles of atlasfit_points). There are as many
 * points as were given, in the same order.
 */
#define ATLASFIT_OUTLIERS_KEEP 0

/**
 * atlasfit_denoise_options.outliers: outliers are left out of the denoised points, and so are the points of
 * parts of the surface that were left out (min_part, largest).
 */
#define ATLASFIT_OUTLIERS_DROP 1

/**
 * atlasfit_denoise_options.surface: none; points and atlas only, in about half the time. Points beside an
 * edge of the part stay on its rounded charts, and what is asked of the surface (watertight, faces,
 * max_error, min_part, largest, fill_holes) is refused.
 */
#define ATLASFIT_SURFACE_NONE 0

/**
 * atlasfit_denoise_options.surface: as the charts have it, open where the data end.
 */
#define ATLASFIT_SURFACE_SMOOTH 1

/**
 * atlasfit_denoise_options.surface: a watertight shell around that, by CGAL's alpha wrap, as far off as the
 * noise or a tenth of the spacing. It has no colours and attributes. #ATLASFIT_NOT_AVAILABLE where the
 * library was built without CGAL: see atlasfit_features().
 */
#define ATLASFIT_SURFACE_WRAP 2

/**
 * atlasfit_result_copy(): x, y, z of each denoised point.
 */
#define ATLASFIT_POINT_POSITIONS 0

/**
 * atlasfit_result_copy(): the normal of each denoised point.
 */
#define ATLASFIT_POINT_NORMALS 1

/**
 * atlasfit_result_copy(): the given point that each denoised point came from.
 */
#define ATLASFIT_POINT_SOURCES 2

/**
 * atlasfit_result_copy(): the chart of each denoised point.
 */
#define ATLASFIT_POINT_CHARTS 3

/**
 * atlasfit_result_copy(): x, y, z of each vertex of the surface.
 */
#define ATLASFIT_SURFACE_POSITIONS 4

/**
 * atlasfit_result_copy(): the normal of each vertex of the surface.
 */
#define ATLASFIT_SURFACE_NORMALS 5

/**
 * atlasfit_result_copy(): the vertices of each triangle of the surface.
 */
#define ATLASFIT_SURFACE_TRIANGLES 6

/**
 * atlasfit_result_copy(): u, v of each corner of each triangle of the surface.
 */
#define ATLASFIT_SURFACE_CORNER_UV 7

/**
 * atlasfit_result_copy(): the UV chart of each triangle of the surface.
 */
#define ATLASFIT_SURFACE_FACE_CHARTS 8

/**
 * atlasfit_result_copy(): red, green, blue, alpha of each vertex of the surface.
 */
#define ATLASFIT_SURFACE_COLORS 9

/**
 * atlasfit_result_copy(), with uncertainty: the standard deviation of each denoised point's place along its
 * normal, in the points' unit. Of outliers their distance from the nearest point that is none; not a number
 * for points that are not finite.
 */
#define ATLASFIT_POINT_UNCERTAINTY 10

/**
 * atlasfit_result_copy(), with uncertainty: the standard deviation of the noise that each denoised point
 * had, in the points' unit; 0 of outliers.
 */
#define ATLASFIT_POINT_NOISE 11

/**
 * atlasfit_result_copy(), with uncertainty: the probability that each denoised point is on no surface, 0 to
 * 1; not a number for points that are not finite.
 */
#define ATLASFIT_POINT_OUTLIER_PROBABILITY 12

/**
 * atlasfit_result_copy(), with uncertainty: the standard deviation of each vertex of the surface along its
 * normal, in the points' unit.
 */
#define ATLASFIT_SURFACE_UNCERTAINTY 13

/**
 * atlasfit_result_copy(), with uncertainty or watertight: 1 for each vertex of the surface that was
 * invented, where a hole was filled or nothing was scanned near it, else 0.
 */
#define ATLASFIT_SURFACE_EXTRAPOLATED 14

/**
 * atlasfit_result_copy(): the unit normal at each corner of each triangle of the surface, where the surface
 * has creases: there each side has its own. #ATLASFIT_NOT_AVAILABLE where those of the vertices hold.
 */
#define ATLASFIT_SURFACE_CORNER_NORMALS 15

/**
 * atlasfit_unwrap_options.packer: packs charts by their shapes: they lie in each other's bays and holes.
 */
#define ATLASFIT_PACK_SHAPES 0

/**
 * atlasfit_unwrap_options.packer: packs charts by their bounding boxes, in rows: fastest, and wastes most.
 */
#define ATLASFIT_PACK_BOXES 1

/**
 * atlasfit_unwrap_options_set_preset(): "few-seams": few charts and short seams, also for meshes of few
 * faces, which bend much at each edge.
 */
#define ATLASFIT_PRESET_FEW_SEAMS 0

/**
 * atlasfit_unwrap_options_set_preset(): "balanced": what atlasfit_unwrap_options_init() gives.
 */
#define ATLASFIT_PRESET_BALANCED 1

/**
 * atlasfit_unwrap_options_set_preset(): "low-stretch": lengths are kept best; most charts.
 */
#define ATLASFIT_PRESET_LOW_STRETCH 2

/**
 * atlasfit_unwrap_options.stack: each part of the mesh has texels of its own.
 */
#define ATLASFIT_STACK_NONE 0

/**
 * atlasfit_unwrap_options.stack: parts that are moved and turned copies of each other get the same UVs.
 */
#define ATLASFIT_STACK_IDENTICAL 1

/**
 * atlasfit_unwrap_options.stack: these and mirror images, whose UVs run the other way round.
 */
#define ATLASFIT_STACK_MIRRORED 2

/**
 * atlasfit_unwrap_options.straighten: charts lie as they have least stretch.
 */
#define ATLASFIT_STRAIGHTEN_OFF 0

/**
 * atlasfit_unwrap_options.straighten: what a person would straighten is straight and parallel to the page's
 * sides.
 */
#define ATLASFIT_STRAIGHTEN_AUTO 1

/**
 * atlasfit_uv_copy(): u, v of each corner of each face.
 */
#define ATLASFIT_UV_CORNERS 0

/**
 * atlasfit_uv_copy(): the chart of each face.
 */
#define ATLASFIT_UV_FACE_CHARTS 1

/**
 * atlasfit_uv_copy(): the page of each face.
 */
#define ATLASFIT_UV_FACE_PAGES 2

/**
 * A fitted atlas: overlapping charts, each a smooth map from plane coordinates (u, v) in [-1, 1] into space.
 * Most charts are sheets over the unit disk; charts of thin tubes have u along the tube and v = angle / pi
 * around it. Immutable: any number of threads may use one at once.
 */
typedef struct atlasfit_atlas atlasfit_atlas;

/**
 * A token that cancels runs from another thread. Any number of runs may hold it; once asked, it stays asked.
 */
typedef struct atlasfit_cancel atlasfit_cancel;

/**
 * What a file holds: points, the faces between them if there are any, and columns beside them. Immutable:
 * any number of threads may read one at once.
 */
typedef struct atlasfit_file atlasfit_file;

/**
 * What denoising made: denoised points, the surface, the atlas, a report. Immutable: any number of threads
 * may read one at once.
 */
typedef struct atlasfit_result atlasfit_result;

/**
 * A mesh with fewer triangles. Immutable: any number of threads may read one at once.
 */
typedef struct atlasfit_simplified atlasfit_simplified;

/**
 * UVs of a mesh. Immutable: any number of threads may read one at once.
 */
typedef struct atlasfit_uv atlasfit_uv;

/**
 * The outcome of a call: #ATLASFIT_OK or one of the failures below. New failures may be added: treat an
 * unknown status as a failure.
 */
typedef int32_t atlasfit_status;

/**
 * A callback that is told how far a run is, on the thread that called into the library, at most 50 times a
 * second. It must return: no longjmp, no C++ exception.
 *
 * @param user     The atlasfit_run's progress_user.
 * @param stage    The running stage; atlasfit_stage_name() gives its name. A stage may come again, and later
 *                 versions may add stages.
 * @param fraction Share of the stage that is done, in [0, 1]. See also overall of the atlasfit_run.
 * @return 0 to cancel, anything else to go on.
 */
typedef int32_t (*atlasfit_progress_fn)(void *user, uint32_t stage, double fraction);

/**
 * A callback that is told what happens in a call, a line each, on the thread that called into the library.
 * It must return: no longjmp, no C++ exception. It may call the library.
 *
 * @param user  The atlasfit_run's log_user.
 * @param level #ATLASFIT_LOG_ERROR, #ATLASFIT_LOG_WARNING or #ATLASFIT_LOG_INFO; later versions may add
 *              levels, with larger numbers for what matters less.
 * @param text  UTF-8 that ends in a 0, in English, without a line's end. It is gone after the call.
 */
typedef void (*atlasfit_log_fn)(void *user, uint32_t level, const char *text);

/**
 * How long work is run. Fill it with atlasfit_run_init(); a NULL pointer to one means the defaults.
 */
typedef struct {
  /**
   * sizeof(atlasfit_run).
   */
  size_t struct_size;
  /**
   * Seed of everything random. Same input, options, seed and version give the same bytes on machines of
   * one type, which have the same vector instructions. Default 0.
   */
  uint64_t seed;
  /**
   * Worker threads of this call, 0 = all cores, at most 65536. No more than these work at once, the
   * calling thread waits meanwhile, and all have ended when the call returns. Many times more than there
   * are cores are not started: the report of a denoised scan says so. The result does not depend on it.
   * Default 0.
   */
  uint32_t threads;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Seconds after which the run gives up with #ATLASFIT_TIMED_OUT; 0 = no limit. Default 0.
   */
  double time_limit_s;
  /**
   * Bytes of memory for the work, its input and its result: a run whose own estimate is larger fails with
   * #ATLASFIT_OUT_OF_MEMORY before it works; 0 = no limit. Default 0.
   */
  uint64_t memory_limit_bytes;
  /**
   * The callback that is told how far the run is; may be NULL. Default NULL.
   */
  atlasfit_progress_fn progress;
  /**
   * Handed to the callback as it is. Default NULL.
   */
  void *progress_user;
  /**
   * A token that cancels the run from another thread; may be NULL. Borrowed for the call. Default NULL.
   */
  const atlasfit_cancel *cancel;
  /**
   * Where the share of the whole call that is done, in [0, 1], is put before each call of progress, for
   * one bar: it never falls, while fraction begins anew with each stage. NULL = nowhere. Default NULL.
   */
  double *overall;
  /**
   * A callback that is told what happens: each stage that begins and takes more than a few hundredths of a
   * second, what the user should hear of the result, why the call fails; may be NULL. Default NULL.
   */
  atlasfit_log_fn log;
  /**
   * Handed to that callback as it is. Default NULL.
   */
  void *log_user;
} atlasfit_run;

/**
 * Where an array of a result is copied to, and how: for each point, vertex, corner or triangle an element of
 * one or a few numbers. Fill it with atlasfit_buffer_init(), then set data, capacity and scalar.
 */
typedef struct {
  /**
   * sizeof(atlasfit_buffer).
   */
  size_t struct_size;
  /**
   * The first number of the first element.
   */
  void *data;
  /**
   * Elements that there is room for.
   */
  size_t capacity;
  /**
   * Bytes from one element to the next; 0 = tightly packed. Default 0.
   */
  size_t stride;
  /**
   * Bytes from one number of an element to the next (x to y); 0 = tightly packed. Default 0.
   */
  size_t component_stride;
  /**
   * Type of the numbers. Floats become #ATLASFIT_F32 or #ATLASFIT_F64, colours also #ATLASFIT_U8 (0 to
   * 255). Indices become any integer type that holds them; UINT32_MAX (none) then becomes -1, or the
   * largest number of an unsigned type. Default #ATLASFIT_F32.
   */
  uint32_t scalar;
  /**
   * Must be 0.
   */
  uint32_t reserved;
} atlasfit_buffer;

/**
 * One or a few numbers per point that the surface is to carry: intensity or scan id, for example. Numbers of
 * an integer type are labels, copied from the nearest point; floats are averaged.
 */
typedef struct {
  /**
   * sizeof(atlasfit_attribute), in bytes. All attributes of an array have the same: it is the distance
   * between them.
   */
  size_t struct_size;
  /**
   * Name in UTF-8, for error texts; may be NULL.
   */
  const char *name;
  /**
   * The numbers: `width` per point.
   */
  const void *values;
  /**
   * Bytes from one point's first number to the next point's; 0 = tightly packed.
   */
  size_t stride;
  /**
   * Numbers per point, 1 to 64. Default 1.
   */
  uint32_t width;
  /**
   * Type of the numbers: #ATLASFIT_F32 to #ATLASFIT_I32. Default #ATLASFIT_F32.
   */
  uint32_t scalar;
} atlasfit_attribute;

/**
 * Faces of any number of corners, with indices of any type. Part of atlasfit_mesh and atlasfit_points: it
 * does not grow.
 */
typedef struct {
  /**
   * The vertex of each corner, face after face, counter-clockwise seen from outside, of type `scalar`.
   * NULL = faces are not given this way. Default NULL.
   */
  const void *corners;
  /**
   * Where the corners of each face begin in `corners`, and at last how many there are: count + 1 numbers
   * of type `scalar` that start at 0 and never fall. NULL = each face has three corners. Default NULL.
   */
  const void *offsets;
  /**
   * Number of faces. Their corners are fewer than 2^32 - 1.
   */
  size_t count;
  /**
   * Bytes from one corner of a face to the next; 0 = tightly packed.
   */
  size_t corner_stride;
  /**
   * Without offsets: bytes from the first corner of one face to that of the next; 0 = three corners.
   */
  size_t face_stride;
  /**
   * Type of corners and offsets: #ATLASFIT_U8 to #ATLASFIT_I64. Default #ATLASFIT_U32.
   */
  uint32_t scalar;
  /**
   * Must be 0.
   */
  uint32_t reserved;
} atlasfit_faces;

/**
 * Points, borrowed for the call. Fill it with atlasfit_points_init(), then set what there is.
 */
typedef struct {
  /**
   * sizeof(atlasfit_points).
   */
  size_t struct_size;
  /**
   * Positions: x, y, z of each point, of type `scalar`, in any unit. Points that are not finite are left
   * out and counted.
   */
  const void *positions;
  /**
   * Number of points, below 2^32 - 1.
   */
  size_t count;
  /**
   * Bytes from one point to the next; 0 = tightly packed.
   */
  size_t stride;
  /**
   * Type of the positions: #ATLASFIT_F32 or #ATLASFIT_F64. Default #ATLASFIT_F32.
   */
  uint32_t scalar;
  /**
   * Colour channels: 3 (red, green, blue) or 4 (and alpha). Default 4.
   */
  uint32_t color_width;
  /**
   * Normals: 3 floats per point, zeros where none is known. The surface faces their side; the fit
   * uses them for nothing else.
   * Points that end up on no chart keep theirs in the result. NULL = none. Default NULL.
   */
  const float *normals;
  /**
   * Bytes from one normal to the next; 0 = tightly packed.
   */
  size_t normal_stride;
  /**
   * Colours, carried over to the surface. NULL = none. Default NULL.
   */
  const void *colors;
  /**
   * Bytes from one colour to the next; 0 = tightly packed.
   */
  size_t color_stride;
  /**
   * Type of the colours: #ATLASFIT_F32 (0 to 1) or #ATLASFIT_U8 (0 to 255). Default #ATLASFIT_F32.
   */
  uint32_t color_scalar;
  /**
   * Number of attributes, at most 1024. Default 0.
   */
  uint32_t attribute_count;
  /**
   * Other attributes, carried over to the surface.
   */
  const atlasfit_attribute *attributes;
  /**
   * Where the points are the vertices of a mesh: its triangles, three indices of points each. Outliers
   * that are kept then follow the surface between their neighbours in the mesh, so that no spike stays.
   * Those that no vertex on the surface holds stay where they are. NULL = none. Default NULL. Read by
   * atlasfit_denoise().
   */
  const uint32_t *triangles;
  /**
   * Number of triangles, below 2^32 / 3. Default 0.
   */
  size_t triangle_count;
  /**
   * Bytes from x to y to z of a point, where they lie apart; `stride` is then from x to x, 0 = tightly
   * packed. 0 = x, y, z lie beside each other. Default 0.
   */
  size_t component_stride;
  /**
   * The mesh's faces, with `triangles` NULL: polygons, or triangles with indices of other types or
   * strides. Default none.
   */
  atlasfit_faces faces;
} atlasfit_points;

/**
 * A mesh, borrowed for the call and never changed. Fill it with atlasfit_mesh_init(), then set what there
 * is. Its faces are `triangles`, or `faces` of any number of corners, which are cut into triangles that do
 * not fold: quads along the shorter diagonal, others by ear clipping. A face of fewer than three corners
 * has no triangle.
 */
typedef struct {
  /**
   * sizeof(atlasfit_mesh).
   */
  size_t struct_size;
  /**
   * Vertex positions: x, y, z of each, of type `scalar`, in any unit.
   */
  const void *positions;
  /**
   * Number of vertices, below 2^32 - 1.
   */
  size_t vertex_count;
  /**
   * Bytes from one vertex to the next; 0 = tightly packed.
   */
  size_t stride;
  /**
   * Type of the positions: #ATLASFIT_F32 or #ATLASFIT_F64. Default #ATLASFIT_F32.
   */
  uint32_t scalar;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Three vertex indices per triangle, counter-clockwise seen from outside.
   */
  const uint32_t *triangles;
  /**
   * Number of triangles, below 2^32 / 3.
   */
  size_t triangle_count;
  /**
   * Texture coordinates: u, v of each corner of each face (6 floats per triangle), v up. NULL = none.
   * Read by atlasfit_measure_uv(), atlasfit_bake(), atlasfit_simplify(), and atlasfit_unwrap() with
   * keep_uv_seams or keep_uvs.
   */
  const float *corner_uv;
  /**
   * A group (material, for example) per face: no UV chart spans two. NULL = one group. Read by
   * atlasfit_unwrap().
   */
  const uint32_t *face_group;
  /**
   * The polygon that each triangle was cut from; any numbers name polygons. Triangles of one polygon stay
   * in one chart. NULL = each triangle is a polygon. Not with `faces`, which are the polygons. Read by
   * atlasfit_unwrap().
   */
  const uint32_t *face_polygon;
  /**
   * Edges that must be seams, as pairs of vertex indices; a pair that is no edge is left out. NULL = none.
   * Read by atlasfit_unwrap().
   */
  const uint32_t *seam_edges;
  /**
   * Number of seam edges.
   */
  size_t seam_edge_count;
  /**
   * The page that each face's UVs are on, 0 to 4095. NULL = all are on page 0. Read by
   * atlasfit_measure_uv() and atlasfit_bake().
   */
  const uint32_t *face_page;
  /**
   * Width of a page, in texels or any other unit; 0, with a height of 0 = pages are square. Read by
   * atlasfit_measure_uv().
   */
  uint32_t page_width;
  /**
   * Height of a page, in the unit of page_width.
   */
  uint32_t page_height;
  /**
   * Colours of the vertices. NULL = none. Read by atlasfit_bake().
   */
  const void *colors;
  /**
   * Bytes from one colour to the next; 0 = tightly packed.
   */
  size_t color_stride;
  /**
   * Type of the colours: #ATLASFIT_F32 (0 to 1) or #ATLASFIT_U8 (0 to 255). Default #ATLASFIT_F32.
   */
  uint32_t color_scalar;
  /**
   * Colour channels: 3 (red, green, blue) or 4 (and alpha). Default 4.
   */
  uint32_t color_width;
  /**
   * Bytes from x to y to z of a vertex, where they lie apart; `stride` is then from x to x, 0 = tightly
   * packed. 0 = x, y, z lie beside each other. Default 0.
   */
  size_t component_stride;
  /**
   * The faces, with `triangles` NULL: polygons, or triangles with indices of other types or strides.
   */
  atlasfit_faces faces;
  /**
   * A byte per face, not 0 where the face is to be ignored: as if it had no triangle, but it keeps its
   * number. NULL = none is. Default NULL.
   */
  const uint8_t *face_ignored;
  /**
   * What a UV seam costs per unit of its length at each vertex, finite, not negative; an edge costs the
   * mean of its ends. 1 as usual, less where seams may be, more where not: only ratios count. NULL = the
   * same everywhere. Read by atlasfit_unwrap(), not with keep_uvs. Default NULL.
   */
  const float *seam_price;
  /**
   * Triangles in UVs of the first page, 6 numbers each, that the charts of atlasfit_unwrap() keep free of,
   * with the padding: for example those of faces that are not laid out anew. Finite; what lies outside
   * the page does not count. Charts are then packed by their shapes; where no room is left for them the
   * call fails with #ATLASFIT_INVALID_ARGUMENT. NULL = the page is free. Default NULL.
   */
  const float *occupied_uv;
  /**
   * Number of those triangles. Default 0.
   */
  size_t occupied_count;
} atlasfit_mesh;

/**
 * How to denoise. Fill it with atlasfit_denoise_options_init(); a NULL pointer to one means the defaults,
 * which suit an ordinary scan.
 */
typedef struct {
  /**
   * sizeof(atlasfit_denoise_options).
   */
  size_t struct_size;
  /**
   * Standard deviation of the noise along the normal, in the points' unit; 0 = estimate it, for each chart
   * anew. Given, it decides how closely charts follow the points. Default 0.
   */
  double noise;
  /**
   * Fineness of the surface, 0.1 to 10: 1 = what the data supports, 0.5 = voxels twice as large. Default
   * 1.
   */
  double detail;
  /**
   * Holes whose boundary is shorter than this are filled, in the points' unit; 0 = only gaps of the
   * sampling are, and places about which the points thin out, as they do where a surface turns away from
   * every scanner. Default 0.
   */
  double fill_holes;
  /**
   * Number of charts to aim for; 0 = as many as the shape needs. Default 0.
   */
  uint32_t charts;
  /**
   * #ATLASFIT_PRIOR_GP to #ATLASFIT_PRIOR_LEVEL_SET. Default #ATLASFIT_PRIOR_GP.
   */
  uint32_t prior;
  /**
   * #ATLASFIT_OUTLIERS_KEEP or #ATLASFIT_OUTLIERS_DROP. Default #ATLASFIT_OUTLIERS_KEEP.
   */
  uint32_t outliers;
  /**
   * Whether to lay out UVs: 0 = no, 1 = yes. Default 1.
   */
  uint32_t uv;
  /**
   * Side of the texture page in texels, 16 to 65536; the padding between UV charts is made for it. Default
   * 1024.
   */
  uint32_t texture_size;
  /**
   * #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV: number of charts that are trained, 1 or more. Default 8.
   */
  uint32_t network_charts;
  /**
   * With #ATLASFIT_RECIPE_PAPER: steps of training, at most. Default 1000.
   */
  uint32_t network_iterations;
  /**
   * How #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV are trained: #ATLASFIT_RECIPE_FAST or
   * #ATLASFIT_RECIPE_PAPER. Default #ATLASFIT_RECIPE_FAST.
   */
  uint32_t recipe;
  /**
   * #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV: weight of the stretch term, beside a Chamfer distance of
   * weight 1; 0 or more. Default 1.
   */
  double network_stretch_weight;
  /**
   * With #ATLASFIT_RECIPE_PAPER: learning rate of Adam, more than 0. Default 0.001.
   */
  double network_learning_rate;
  /**
   * With has_viewpoint: where the scanner stood, x, y, z in the points' unit. The surface faces it,
   * whatever the points' normals say. Where more than a quarter of the points is hidden from there,
   * connected parts face it as wholes.
   */
  double viewpoint[3];
  /**
   * 1 if viewpoint counts, else 0. Default 0.
   */
  uint32_t has_viewpoint;
  /**
   * 1 makes the surface that of a solid, for printing: closed, two-manifold, without self-intersections.
   * #ATLASFIT_SURFACE_EXTRAPOLATED tells where vertices were invented. 0 leaves the surface open where the
   * data end. Default 0.
   */
  uint32_t watertight;
  /**
   * Connected parts of the surface that have less than this share of its area are left out, 0 to 1; 0
   * keeps all. #ATLASFIT_INVALID_ARGUMENT where no part is that large. Their points stay among the
   * denoised points, unless outliers are dropped, and their charts in the atlas. Default 0.
   */
  double min_part;
  /**
   * 1 keeps only the largest part of the surface by area; the others are left out as with min_part.
   * Default 0.
   */
  uint32_t largest;
  /**
   * Triangles that the surface should have at the most; 0 = about as many as there are points, fewer where
   * it is flat. Where they cannot be had within max_error, a warning says so. Default 0.
   */
  uint32_t faces;
  /**
   * How far the surface may be from the contoured one to have fewer triangles, in the points' unit; 0 =
   * all triangles that it is contoured with. Less than 0 = as far as faces asks for; without that a
   * quarter of the noise or a twentieth of the spacing. A watertight surface keeps all its triangles.
   * Default -1.
   */
  double max_error;
  /**
   * How strongly to denoise, 0 or more: 1 = as much as the scan asks for, 2 = smoother. Detail below so
   * many times the usual length is smoothed away, from a quarter to 4 times, and the surface follows.
   * Below 1 the points besides go only this share of the way to the surface: 0 leaves them where they are.
   * Default 1.
   */
  double strength;
  /**
   * What the surface is: #ATLASFIT_SURFACE_NONE to #ATLASFIT_SURFACE_WRAP. Default
   * #ATLASFIT_SURFACE_SMOOTH.
   */
  uint32_t surface;
  /**
   * 1 says how sure the result is: #ATLASFIT_POINT_UNCERTAINTY to #ATLASFIT_SURFACE_EXTRAPOLATED, and
   * uncertainty_factor of the report. All else stays the same, byte for byte. Default 0.
   */
  uint32_t uncertainty;
  /**
   * The name of an attribute of the points, of width 1, that tells apart the sweeps of which the scan was
   * merged: whole numbers, 0 or more. They are moved together first, each by a small rigid motion; the
   * result is where the moved ones say, and atlasfit_result_sweep() tells the motions. NULL moves none.
   * Default NULL.
   */
  const char *sweeps;
} atlasfit_denoise_options;

/**
 * What was found and done. Lengths are in the points' unit.
 */
typedef struct {
  /**
   * sizeof(atlasfit_report), set by the caller.
   */
  size_t struct_size;
  /**
   * Points given.
   */
  size_t points_given;
  /**
   * Points given with a coordinate that is not finite. They are no part of the surface.
   */
  size_t not_finite;
  /**
   * Points that repeat the position of an earlier one, or are copies of it, far nearer than the next. They
   * move with it.
   */
  size_t duplicates;
  /**
   * Points that no chart claims: they belong to no surface.
   */
  size_t outliers;
  /**
   * Denoised points; as many as were given unless outliers are dropped.
   */
  size_t points;
  /**
   * Vertices of the surface.
   */
  size_t vertices;
  /**
   * Triangles of the surface.
   */
  size_t triangles;
  /**
   * Charts of the atlas.
   */
  size_t charts;
  /**
   * UV charts of the surface; 0 without UVs.
   */
  size_t uv_charts;
  /**
   * Connected parts of the surface.
   */
  size_t parts;
  /**
   * Boundary loops of the surface.
   */
  size_t boundary_loops;
  /**
   * Edges on the boundary.
   */
  size_t boundary_edges;
  /**
   * Holes that were filled.
   */
  size_t filled_holes;
  /**
   * Columns of attributes that the surface carries: as many as were given, then what watertight and
   * uncertainty of the options add.
   */
  size_t attributes;
  /**
   * 1 if some part of the surface is one-sided, else 0.
   */
  uint32_t one_sided;
  /**
   * 1 if the surface has UVs, else 0.
   */
  uint32_t has_uv;
  /**
   * 1 if the surface has colours, else 0.
   */
  uint32_t has_colors;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Median distance between neighbouring points; where many lie in rows far apart, between those that are
   * left when the points of a row are averaged.
   */
  double spacing;
  /**
   * Noise (standard deviation along the normal), estimated or as given.
   */
  double noise;
  /**
   * Side of the finest voxels that the surface was contoured with; they are wider where points lie far
   * apart.
   */
  double voxel;
  /**
   * Seconds spent in each stage, by the stage's number.
   */
  double stage_seconds[ATLASFIT_STAGE_LIMIT];
  /**
   * Connected parts of the surface that were left out, as min_part and largest of the options asked for.
   */
  size_t dropped_parts;
  /**
   * Points given that lie on those parts. They are denoised all the same, and no outliers.
   */
  size_t dropped_points;
  /**
   * Outliers that follow the surface between their neighbours in the mesh, as triangles of atlasfit_points
   * says; the other outliers stay where they are.
   */
  size_t followed_outliers;
  /**
   * By how much the charts' own standard deviations were widened, as the residuals of points beside each
   * other ask for: 1 or more; 0 where uncertainty was not asked for, or the residuals do not tell.
   */
  double uncertainty_factor;
  /**
   * Sweeps that were looked at to be moved together, as sweeps of the options asked for; else 0.
   */
  size_t sweeps;
  /**
   * How far the sweeps were apart along the normal (standard deviation, noise and misfit together) before
   * they were moved; 0 without sweeps.
   */
  double apart_before;
  /**
   * The same after they were moved.
   */
  double apart_after;
} atlasfit_report;

/**
 * How a sweep was moved, as sweeps of atlasfit_denoise_options asked for.
 */
typedef struct {
  /**
   * sizeof(atlasfit_sweep), set by the caller.
   */
  size_t struct_size;
  /**
   * Its number, as the attribute has it.
   */
  uint32_t sweep;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Its points that are finite.
   */
  size_t points;
  /**
   * Its points that were seen on other sweeps, of those that were looked at. 0: it is where it was.
   */
  size_t pairs;
  /**
   * How far its points were moved, root mean square, in their unit.
   */
  double moved;
  /**
   * Where its points go: three rows of four, a rotation and a shift, in the points' frame and unit.
   */
  double matrix[12];
} atlasfit_sweep;

/**
 * What an atlas holds.
 */
typedef struct {
  /**
   * sizeof(atlasfit_atlas_info), set by the caller.
   */
  size_t struct_size;
  /**
   * Number of charts.
   */
  size_t charts;
  /**
   * Origin of the frame that the charts are held in, in the scan's frame.
   */
  double origin[3];
  /**
   * Length of that frame's unit in the scan's unit: about the scan's longest side.
   */
  double unit;
} atlasfit_atlas_info;

/**
 * Where projection puts its results: arrays of the caller. Each has room for `capacity` points, or is NULL
 * where it is not wanted.
 */
typedef struct {
  /**
   * sizeof(atlasfit_projection).
   */
  size_t struct_size;
  /**
   * Points that each array has room for; at least as many as are projected.
   */
  size_t capacity;
  /**
   * x, y, z per point.
   */
  double *positions;
  /**
   * Unit normal per point, 3 numbers, in the atlas's orientation.
   */
  float *normals;
  /**
   * Nearest chart per point. UINT32_MAX for a point that is not finite: its position is given back, its
   * other numbers are 0.
   */
  uint32_t *charts;
  /**
   * Coordinates in that chart, 2 numbers per point.
   */
  float *chart_uv;
  /**
   * Distance from the point to its projection.
   */
  double *distances;
} atlasfit_projection;

/**
 * How to unwrap. Fill it with atlasfit_unwrap_options_init(); a NULL pointer to one means the defaults.
 */
typedef struct {
  /**
   * sizeof(atlasfit_unwrap_options).
   */
  size_t struct_size;
  /**
   * Bound on the stretch of 95% of the area, more than 1. Stretch is max(s1, 1/s2), with s1 >= s2 the
   * singular values of the map from surface to texture, at one texel density for all charts. A smaller
   * bound gives more charts. Default 1.1; atlasfit_unwrap_options_set_preset() sets others by name.
   */
  double max_stretch;
  /**
   * Most charts: those that only the shape of the page asks for go first, then max_stretch is raised until
   * they are few enough. More are still made where the topology or the constraints need them. 0 = any
   * number. Default 0.
   */
  uint32_t max_charts;
  /**
   * Width of a page in texels, 16 to 65536. Default 1024.
   */
  uint32_t page_width;
  /**
   * Height of a page in texels, 16 to 65536. Default 1024.
   */
  uint32_t page_height;
  /**
   * Free texels between charts and at the page's border, at most an eighth of the page. Default 2.
   */
  uint32_t padding;
  /**
   * Most pages, up to 4096; 0 = one page or, where texels_per_unit is set, as many as that density needs.
   * Default 0.
   */
  uint32_t pages;
  /**
   * #ATLASFIT_PACK_SHAPES or #ATLASFIT_PACK_BOXES. Default #ATLASFIT_PACK_SHAPES.
   */
  uint32_t packer;
  /**
   * 1 if seams of the UVs that the mesh already has (atlasfit_mesh.corner_uv) stay seams, else 0. Default
   * 0.
   */
  uint32_t keep_uv_seams;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Texels per unit of length on the surface; 0 = as many as fill the pages. Default 0.
   */
  double texels_per_unit;
  /**
   * Edges whose triangles meet at an angle of more than this many degrees are seams, 0 to 180; 180 = none
   * are for that reason. Default 180.
   */
  double hard_edge_angle;
  /**
   * 1 if the charts are those of the UVs that the mesh already has (atlasfit_mesh.corner_uv): moved,
   * turned and scaled to one density, and packed; what flips or overlaps in them is cut. 0 makes new
   * ones. Default 0.
   */
  uint32_t keep_uvs;
  /**
   * Which parts of the mesh lie on each other on the page, corner on corner: #ATLASFIT_STACK_NONE to
   * #ATLASFIT_STACK_MIRRORED. A part is what hangs together after all cuts; two have one shape where their
   * triangles are alike one by one, to a ten thousandth of the part's size. Parts of two groups are not
   * stacked. Not with keep_uvs. Default #ATLASFIT_STACK_NONE.
   */
  uint32_t stack;
  /**
   * Bound on the mean symmetric Dirichlet energy s1^2 + s2^2 + 1/s1^2 + 1/s2^2 by area instead of
   * max_stretch, more than 4 (isometry): each connected part becomes one chart that is cut open, with
   * seams as short as can be found. Slower: for up to some ten thousand triangles. 0 = max_stretch counts.
   * Default 0.
   */
  double max_energy;
  /**
   * Whether charts are laid straight: #ATLASFIT_STRAIGHTEN_OFF or #ATLASFIT_STRAIGHTEN_AUTO. Strips, tubes
   * that are cut open and rims become rectangles, long sides of other charts straight lines, within the
   * bound on the stretch; such charts are turned in quarter turns only, which costs texels where charts
   * are few and large. Not with keep_uvs. Default #ATLASFIT_STRAIGHTEN_OFF.
   */
  uint32_t straighten;
  /**
   * Must be 0.
   */
  uint32_t reserved_too;
  /**
   * How much seams are to lie where the outside hardly sees them, 0 to 1: 0 = as short as can be. Not with
   * keep_uvs. Default 0.
   */
  double seams_hidden;
  /**
   * The direction up, of any length: where seams_hidden counts, nobody looks from below. All 0 = they look
   * from all around. Default 0.
   */
  double up[3];
} atlasfit_unwrap_options;

/**
 * What UVs hold.
 */
typedef struct {
  /**
   * sizeof(atlasfit_uv_info), set by the caller.
   */
  size_t struct_size;
  /**
   * Triangles that the mesh has, or that its faces were cut into.
   */
  size_t triangles;
  /**
   * Charts.
   */
  size_t charts;
  /**
   * Pages.
   */
  size_t pages;
  /**
   * Vertices of the mesh in its split form.
   */
  size_t split_vertices;
  /**
   * Triangles of zero area or with repeated or non-finite vertices; they got small, valid
   * UV triangles.
   */
  size_t degenerate_faces;
  /**
   * Triangles that repeat the corners of an earlier one; they got UVs of their own.
   */
  size_t duplicate_faces;
  /**
   * Edges that were cut because more than two triangles, or two of opposite orientation, meet there.
   */
  size_t non_manifold_edges;
  /**
   * Charts that had to be cut further to stay free of flips and overlaps.
   */
  size_t repaired_charts;
  /**
   * Polygons that could not stay in one piece because they do not lie flat.
   */
  size_t split_polygons;
  /**
   * Width of a page in texels.
   */
  uint32_t width;
  /**
   * Height of a page in texels.
   */
  uint32_t height;
  /**
   * Texels per unit of length on the surface.
   */
  double texels_per_unit;
  /**
   * The stretch bound that was kept: max_stretch, or more where max_charts needed it.
   */
  double stretch_bound;
  /**
   * Share of the area stretched beyond the bound.
   */
  double over_stretched;
  /**
   * Share of the pages that lies under triangles.
   */
  double coverage;
  /**
   * Wall time of unwrapping, in seconds, without the copying of the mesh and the making of the split form.
   */
  double seconds;
  /**
   * Free texels between charts and at a page's border: the padding asked for, or less where with that the
   * charts would have had no room.
   */
  uint32_t padding;
  /**
   * Is 0.
   */
  uint32_t reserved;
  /**
   * Faces that were given: polygons or triangles.
   */
  size_t faces;
  /**
   * Corners of those faces: three for each triangle.
   */
  size_t corners;
  /**
   * Faces that do not lie flat and were cut between charts, so that their triangles do not agree on the
   * UVs of their corners: see atlasfit_uv_face_torn().
   */
  size_t torn_faces;
  /**
   * Vertices at open edges that lie exactly where another one does and were taken for it, for the layout
   * only.
   */
  size_t welded_vertices;
  /**
   * Parts that lie on another one of their shape, as stack of the options asked for.
   */
  size_t stacked_parts;
  /**
   * Charts whose sides are straight and parallel to the page's, as straighten of the options asked for.
   */
  size_t straightened_charts;
} atlasfit_uv_info;

/**
 * An image of a mesh's old textures, borrowed for the call.
 */
typedef struct {
  /**
   * sizeof(atlasfit_image), in bytes. All images of an array have the same: it is the distance between
   * them.
   */
  size_t struct_size;
  /**
   * Red, green, blue, alpha of each pixel, 0 to 255; row after row, the top row (v = 1) first.
   */
  const uint8_t *rgba;
  /**
   * Width in pixels.
   */
  uint32_t width;
  /**
   * Height in pixels.
   */
  uint32_t height;
} atlasfit_image;

/**
 * Old textures of one kind (colours, or roughness, ...) of a mesh, borrowed for the call. Fill it with
 * atlasfit_textures_init(), then set what there is.
 */
typedef struct {
  /**
   * sizeof(atlasfit_textures).
   */
  size_t struct_size;
  /**
   * The images; outside of [0, 1] they repeat.
   */
  const atlasfit_image *images;
  /**
   * Number of images.
   */
  size_t image_count;
  /**
   * The UVs that the images are for: u, v of each corner of each triangle of the mesh, v up.
   */
  const float *corner_uv;
  /**
   * The image of each triangle; UINT32_MAX for one without. NULL = the first for all. Default NULL.
   */
  const uint32_t *face_image;
  /**
   * 1 where the images are normal maps, whose directions are turned to the new UVs; else 0. Default 0.
   */
  uint32_t normals;
  /**
   * Must be 0.
   */
  uint32_t reserved;
} atlasfit_textures;

/**
 * How to bake. Fill it with atlasfit_bake_options_init(); a NULL pointer to one means the defaults.
 */
typedef struct {
  /**
   * sizeof(atlasfit_bake_options).
   */
  size_t struct_size;
  /**
   * Width of the texture in texels, 1 to 65536. Default 1024.
   */
  uint32_t width;
  /**
   * Height of the texture in texels, 1 to 65536. Default 1024.
   */
  uint32_t height;
  /**
   * Texels by which colours spread beyond the borders of the charts, so that filtered look-ups find no
   * foreign colour. Texels farther out have the mean colour. Default 16.
   */
  uint32_t padding;
  /**
   * The page to bake: triangles of other pages (atlasfit_mesh.face_page) are left out. Default 0.
   */
  uint32_t page;
  /**
   * Old textures of the mesh, which are drawn anew for its corner_uv, in place of colours of vertices or
   * points. NULL = none. Default NULL.
   */
  const atlasfit_textures *textures;
} atlasfit_bake_options;

/**
 * How far to simplify. Fill it with atlasfit_simplify_options_init(), then set faces, max_error or both.
 */
typedef struct {
  /**
   * sizeof(atlasfit_simplify_options).
   */
  size_t struct_size;
  /**
   * Triangles that are few enough; 0 = as few as max_error allows. Default 0.
   */
  size_t faces;
  /**
   * How far any vertex, and the middle of any edge, may be from the new mesh, in the mesh's unit; 0 = as far
   * as faces asks for. Default 0.
   */
  double max_error;
} atlasfit_simplify_options;

/**
 * How large a simplified mesh is.
 */
typedef struct {
  /**
   * sizeof(atlasfit_simplified_info), set by the caller.
   */
  size_t struct_size;
  /**
   * Vertices.
   */
  size_t vertices;
  /**
   * Triangles.
   */
  size_t triangles;
  /**
   * 1 if it has UVs, as the mesh had, else 0.
   */
  uint32_t has_uv;
  /**
   * 1 if it has colours, as the mesh had, else 0.
   */
  uint32_t has_colors;
} atlasfit_simplified_info;

/**
 * Connectivity of a mesh. Vertices in one place count as one.
 */
typedef struct {
  /**
   * sizeof(atlasfit_topology), set by the caller.
   */
  size_t struct_size;
  /**
   * Vertices in use, after welding.
   */
  size_t vertices;
  /**
   * Edges.
   */
  size_t edges;
  /**
   * Faces that name three different places.
   */
  size_t faces;
  /**
   * Faces that do not; they take no part in the other counts.
   */
  size_t degenerate_faces;
  /**
   * Vertices that no face uses.
   */
  size_t unused_vertices;
  /**
   * Parts that share no vertex.
   */
  size_t parts;
  /**
   * Edges with one face.
   */
  size_t boundary_edges;
  /**
   * Closed chains of boundary edges.
   */
  size_t boundary_loops;
  /**
   * Edges with three or more faces.
   */
  size_t non_manifold_edges;
  /**
   * Vertices whose faces make more than one fan.
   */
  size_t non_manifold_vertices;
  /**
   * Edges whose two faces run along them in the same direction.
   */
  size_t inconsistent_edges;
  /**
   * Vertices - edges + faces.
   */
  int64_t euler;
  /**
   * Genus with holes filled, summed over the parts; -1 where an edge is not manifold or the surface is
   * one-sided.
   */
  int64_t genus;
  /**
   * 1 if the faces could be turned so that no edge is inconsistent, else 0.
   */
  uint32_t orientable;
  /**
   * 1 if there is neither boundary nor an edge with more than two faces, else 0.
   */
  uint32_t closed;
} atlasfit_topology;

/**
 * Quality of UVs. Stretch is after one global scale that makes the summed areas equal: 1 = isometric.
 */
typedef struct {
  /**
   * sizeof(atlasfit_uv_quality), set by the caller.
   */
  size_t struct_size;
  /**
   * Triangles.
   */
  size_t faces;
  /**
   * Groups of triangles joined through edges with equal UVs at both ends.
   */
  size_t charts;
  /**
   * Triangles turned against the majority of their chart.
   */
  size_t flips;
  /**
   * Triangles with area in space and none in the texture, or with UVs that are not finite.
   */
  size_t degenerate;
  /**
   * Triangles whose inside meets another one's inside in the texture, by exact predicates.
   */
  size_t overlapping_faces;
  /**
   * Length of the inner edges that are cut, divided by the square root of the surface's area.
   */
  double seam;
  /**
   * L2 stretch of Sander et al. 2001; infinite where every triangle has collapsed.
   */
  double stretch_l2;
  /**
   * L-infinity stretch of Sander et al. 2001, collapsed triangles left out.
   */
  double stretch_linf;
  /**
   * Median by area of max(s1, 1/s2), with s1 >= s2 the singular values of the map from surface to texture.
   */
  double stretch_median;
  /**
   * 95% of the area is below.
   */
  double stretch_p95;
  /**
   * Mean by area of s1/s2: 1 = conformal.
   */
  double conformal;
  /**
   * Share of the covered texels that are covered more than once; 1024 x 1024 texels for all pages side by
   * side.
   */
  double overlap;
  /**
   * Share of all texels that are covered.
   */
  double coverage;
  /**
   * 1 if all UVs lie on their pages, in [0, 1], else 0.
   */
  uint32_t inside;
  /**
   * 1 if all UVs are finite, else 0.
   */
  uint32_t finite;
  /**
   * Share of the length of the charts' outlines in the texture that is parallel to a side of the page, to
   * within a millionth of the page for each edge, 0 to 1.
   */
  double straightness;
} atlasfit_uv_quality;

/**
 * How to measure distances. Fill it with atlasfit_distance_options_init(); a NULL pointer to one means the
 * defaults.
 */
typedef struct {
  /**
   * sizeof(atlasfit_distance_options).
   */
  size_t struct_size;
  /**
   * Samples of each surface for accuracy and completeness. Default 60,000.
   */
  size_t samples;
  /**
   * Samples of each surface for the Chamfer distance; chamfer_floor depends on it. Default 16,000.
   */
  size_t chamfer_samples;
  /**
   * Distance below which a sample counts for the F-score; 0 = half a percent of the truth's longest side.
   * Default 0.
   */
  double threshold;
} atlasfit_distance_options;

/**
 * Statistics of a set of distances, in the meshes' unit. Part of atlasfit_distance: it does not grow.
 */
typedef struct {
  /**
   * Root of the mean square.
   */
  double rms;
  /**
   * Mean.
   */
  double mean;
  /**
   * Median.
   */
  double median;
  /**
   * 95% are below.
   */
  double p95;
  /**
   * 99% are below.
   */
  double p99;
  /**
   * The largest.
   */
  double max;
} atlasfit_distance_stats;

/**
 * A mesh or points against the true surface.
 */
typedef struct {
  /**
   * sizeof(atlasfit_distance), set by the caller.
   */
  size_t struct_size;
  /**
   * From the result to the truth.
   */
  atlasfit_distance_stats accuracy;
  /**
   * From the truth to the result; zeros for points.
   */
  atlasfit_distance_stats completeness;
  /**
   * Chamfer distance (Gadelha et al. 2020): squared length.
   */
  double chamfer;
  /**
   * Chamfer distance of two sets of samples of the truth: no result can be expected to be below.
   */
  double chamfer_floor;
  /**
   * Harmonic mean of the shares of samples within the threshold, both ways, in [0, 1]; 0 for points.
   */
  double f_score;
  /**
   * The threshold that was used; 0 for points.
   */
  double threshold;
  /**
   * Mean absolute cosine between the normals at nearest points, in [0, 1]; 0 for points.
   */
  double normal_consistency;
  /**
   * The same with sign: negative for a surface that is inside out; 0 for points.
   */
  double normal_orientation;
  /**
   * Points that are not finite and were left out; 0 for meshes.
   */
  size_t not_finite;
} atlasfit_distance;

/**
 * What a file holds.
 */
typedef struct {
  /**
   * sizeof(atlasfit_file_info), set by the caller.
   */
  size_t struct_size;
  /**
   * Points; of a mesh its vertices.
   */
  size_t points;
  /**
   * Triangles; 0 of a cloud.
   */
  size_t triangles;
  /**
   * Attributes: columns besides positions, normals and colours.
   */
  size_t attributes;
  /**
   * Bytes of the image that colours the faces; 0 without one.
   */
  size_t texture_bytes;
  /**
   * 1 if the points have normals, else 0.
   */
  uint32_t has_normals;
  /**
   * 1 if the points have colours, else 0.
   */
  uint32_t has_colors;
  /**
   * 1 if the triangles have UVs, else 0.
   */
  uint32_t has_uv;
  /**
   * 1 if the triangles have UV charts, else 0.
   */
  uint32_t has_face_charts;
  /**
   * 1 if the file says where the one scanner stood that measured it, else 0.
   */
  uint32_t has_viewpoint;
  /**
   * 1 if the normals of some vertices differ between their triangles, else 0.
   */
  uint32_t has_corner_normals;
  /**
   * Where it stood, for viewpoint of atlasfit_denoise_options.
   */
  double viewpoint[3];
} atlasfit_file_info;

/**
 * What a file is to hold besides the points, and how it is written. Fill it with
 * atlasfit_save_options_init();
 * a NULL pointer to one means the defaults.
 */
typedef struct {
  /**
   * sizeof(atlasfit_save_options).
   */
  size_t struct_size;
  /**
   * u, v of each corner of each triangle or face of the points, v up. NULL = none. Default NULL.
   */
  const float *corner_uv;
  /**
   * UV chart of each triangle or face. NULL = none. Default NULL.
   */
  const uint32_t *face_charts;
  /**
   * The bytes of a PNG file that the UVs show. GLB holds it inside, else it goes to a file beside the
   * output.
   * NULL = none. Default NULL.
   */
  const uint8_t *texture;
  /**
   * Number of these bytes.
   */
  size_t texture_bytes;
  /**
   * 1 for text where a format has both, 0 for binary. Default 0.
   */
  uint32_t ascii;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Unit normal at each corner of each triangle or face of the points, 3 numbers, where those of a vertex
   * differ, as at creases: OBJ and GLB hold them. NULL = those of the points. Default NULL.
   */
  const float *corner_normals;
} atlasfit_save_options;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The library's version: major << 24 | minor << 16 | patch << 8. Header and library agree where it has the
 * major version of #ATLASFIT_VERSION and, while that is 0, also its minor version.
 */
ATLASFIT_API uint32_t atlasfit_version(void);

/**
 * The optional parts that this library was built with, by name and with a space between them; those under
 * the GPL say so: "cgal(GPL)". Empty for the library as it is distributed, which is under MIT or Apache 2.0
 * only. Static text, never NULL.
 */
ATLASFIT_API const char *atlasfit_features(void);

/**
 * The name of a status, for logs: "invalid argument" for example, or "unknown status" for a value that is
 * none. Static text, never NULL.
 */
ATLASFIT_API const char *atlasfit_status_name(atlasfit_status status);

/**
 * Copies the text of this thread's last failed call: what was wrong, where, and what to do. A call that
 * succeeds keeps the text as it is.
 *
 * At most `capacity` bytes are written, the last of them 0; a longer text is cut between two UTF-8
 * characters. To ask for the length only, give NULL as `buffer`.
 *
 * @return The length of the whole text in bytes, without the terminating 0; 0 where no call has failed on
 *         this thread.
 */
ATLASFIT_API size_t atlasfit_last_error(char *buffer, size_t capacity);

/**
 * Makes a cancel token. Free it with atlasfit_cancel_free().
 *
 * @param out Where the token is put; NULL on failure.
 */
ATLASFIT_API atlasfit_status atlasfit_cancel_new(atlasfit_cancel **out);

/**
 * Asks every run that holds the token to stop: it returns #ATLASFIT_CANCELLED within 100 ms and leaves no
 * output. May be called from any thread, but not from a signal handler: set a flag there, and return 0 from
 * the progress callback.
 */
ATLASFIT_API atlasfit_status atlasfit_cancel_request(const atlasfit_cancel *token);

/**
 * Frees a token; NULL is allowed. Runs that hold it go on.
 */
ATLASFIT_API atlasfit_status atlasfit_cancel_free(atlasfit_cancel *token);

/**
 * Fills a run with its defaults.
 *
 * @param run         The struct to fill.
 * @param struct_size sizeof(atlasfit_run).
 */
ATLASFIT_API atlasfit_status atlasfit_run_init(atlasfit_run *run, size_t struct_size);

/**
 * A short name for a stage, in lower case: "fitting charts" for example, or "working" for a number that is
 * no stage. Static text, never NULL.
 */
ATLASFIT_API const char *atlasfit_stage_name(uint32_t stage);

/**
 * Fills a buffer with its defaults: no room.
 *
 * @param buffer      The struct to fill.
 * @param struct_size sizeof(atlasfit_buffer).
 */
ATLASFIT_API atlasfit_status atlasfit_buffer_init(atlasfit_buffer *buffer, size_t struct_size);

/**
 * Fills an attribute with its defaults.
 *
 * @param attribute   The struct to fill.
 * @param struct_size sizeof(atlasfit_attribute).
 */
ATLASFIT_API atlasfit_status atlasfit_attribute_init(atlasfit_attribute *attribute, size_t struct_size);

/**
 * Fills points with their defaults: none.
 *
 * @param points      The struct to fill.
 * @param struct_size sizeof(atlasfit_points).
 */
ATLASFIT_API atlasfit_status atlasfit_points_init(atlasfit_points *points, size_t struct_size);

/**
 * Fills a mesh with its defaults: no triangle.
 *
 * @param mesh        The struct to fill.
 * @param struct_size sizeof(atlasfit_mesh).
 */
ATLASFIT_API atlasfit_status atlasfit_mesh_init(atlasfit_mesh *mesh, size_t struct_size);

/**
 * Fills options with their defaults.
 *
 * @param options     The struct to fill.
 * @param struct_size sizeof(atlasfit_denoise_options).
 */
ATLASFIT_API
atlasfit_status atlasfit_denoise_options_init(atlasfit_denoise_options *options,
                                              size_t struct_size);

/**
 * Tells how many bytes atlasfit_denoise() needs at its peak for an evenly sampled scan, its points included:
 * an upper bound that is up to twice too large. The points need not be there. A scan whose spacing varies,
 * and the network priors, need more.
 *
 * @param points  How many points.
 * @param options How to denoise; NULL = the defaults.
 * @param run     How long work is run, of which the threads count; NULL = the defaults.
 * @param bytes   Set to the bytes; 0 on failure.
 */
ATLASFIT_API
atlasfit_status atlasfit_denoise_memory_needed(size_t points,
                                               const atlasfit_denoise_options *options,
                                               const atlasfit_run *run,
                                               uint64_t *bytes);

/**
 * Denoises a scan: denoised points, one connected surface with UVs, and the fitted atlas.
 *
 * @param points  The scan, at least a few hundred points on a surface.
 * @param options How to denoise; NULL = the defaults.
 * @param run     How long work is run; NULL = the defaults.
 * @param out     Where the result is put; NULL on failure. Free it with atlasfit_result_free().
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
 *         triangle names no point), #ATLASFIT_EMPTY_INPUT (no finite point), #ATLASFIT_DEGENERATE (the
 *         points are no surface), #ATLASFIT_DIVERGED, #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT,
 *         #ATLASFIT_OUT_OF_MEMORY, #ATLASFIT_RESOURCE_EXHAUSTED (no more threads).
 */
ATLASFIT_API
atlasfit_status atlasfit_denoise(const atlasfit_points *points,
                                 const atlasfit_denoise_options *options,
                                 const atlasfit_run *run,
                                 atlasfit_result **out);

/**
 * Frees a result; NULL is allowed. Atlases taken from it stay.
 */
ATLASFIT_API atlasfit_status atlasfit_result_free(atlasfit_result *result);

/**
 * Tells what was found and done, and how large the result's arrays are.
 *
 * @param report Filled; its struct_size must be set.
 */
ATLASFIT_API atlasfit_status atlasfit_result_report(const atlasfit_result *result, atlasfit_report *report);

/**
 * Copies the warnings of denoising: what the user should hear, a line each, in English. No line where all
 * is well.
 *
 * @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
 * @param capacity At least the length and 1, unless `text` is NULL.
 * @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_warnings(const atlasfit_result *result,
                                         char *text,
                                         size_t capacity,
                                         size_t *length);

/**
 * Tells how a sweep was moved. #ATLASFIT_INDEX_OUT_OF_RANGE where there are not that many.
 *
 * @param index Its place among the sweeps, which are sorted by their numbers: 0 to report.sweeps - 1.
 * @param sweep Filled; its struct_size must be set.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_sweep(const atlasfit_result *result,
                                      size_t index,
                                      atlasfit_sweep *sweep);

/**
 * Copies the denoised positions: x, y, z per point, in input order. Outliers that are kept, unless they
 * follow their neighbours in a mesh, and points that are not finite, are where they were.
 *
 * @param xyz      Room for `capacity` numbers.
 * @param capacity At least 3 * report.points.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_point_positions(const atlasfit_result *result,
                                                double *xyz,
                                                size_t capacity);

/**
 * Copies the denoised points' unit normals: 3 numbers per point. Points that are on no chart have the normal
 * that was given, or zeros; outliers that follow their neighbours in a mesh a mean of theirs.
 *
 * @param normals  Room for `capacity` numbers.
 * @param capacity At least 3 * report.points.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_point_normals(const atlasfit_result *result,
                                              float *normals,
                                              size_t capacity);

/**
 * Copies, for each denoised point, the index of the given point that it came from: 0, 1, 2, ... unless
 * outliers are dropped.
 *
 * @param sources  Room for `capacity` numbers.
 * @param capacity At least report.points.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_point_sources(const atlasfit_result *result,
                                              uint32_t *sources,
                                              size_t capacity);

/**
 * Copies, for each denoised point, the chart of the atlas that has the largest weight there; UINT32_MAX for
 * a point on no chart, which is an outlier or not finite.
 *
 * @param charts   Room for `capacity` numbers.
 * @param capacity At least report.points.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_point_charts(const atlasfit_result *result,
                                             uint32_t *charts,
                                             size_t capacity);

/**
 * Copies the surface's vertex positions: x, y, z per vertex.
 *
 * @param xyz      Room for `capacity` numbers.
 * @param capacity At least 3 * report.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_positions(const atlasfit_result *result,
                                                  double *xyz,
                                                  size_t capacity);

/**
 * Copies the surface's unit normals: 3 numbers per vertex.
 *
 * @param normals  Room for `capacity` numbers.
 * @param capacity At least 3 * report.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_normals(const atlasfit_result *result,
                                                float *normals,
                                                size_t capacity);

/**
 * Copies the surface's triangles: 3 vertex indices each, counter-clockwise seen from outside.
 *
 * @param triangles Room for `capacity` numbers.
 * @param capacity  At least 3 * report.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_triangles(const atlasfit_result *result,
                                                  uint32_t *triangles,
                                                  size_t capacity);

/**
 * Copies the surface's UVs: u, v in [0, 1], v up, for each corner of each triangle. #ATLASFIT_NOT_AVAILABLE
 * where the surface has none.
 *
 * @param corner_uv Room for `capacity` numbers.
 * @param capacity  At least 6 * report.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_corner_uv(const atlasfit_result *result,
                                                  float *corner_uv,
                                                  size_t capacity);

/**
 * Copies the UV chart of each triangle, 0 to report.uv_charts - 1, or UINT32_MAX for a triangle on no chart.
 * #ATLASFIT_NOT_AVAILABLE where the surface has no UVs.
 *
 * @param face_charts Room for `capacity` numbers.
 * @param capacity    At least report.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_face_charts(const atlasfit_result *result,
                                                    uint32_t *face_charts,
                                                    size_t capacity);

/**
 * Copies the surface's colours: red, green, blue, alpha per vertex, 0 to 1. #ATLASFIT_NOT_AVAILABLE where
 * the points had none.
 *
 * @param rgba     Room for `capacity` numbers.
 * @param capacity At least 4 * report.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_colors(const atlasfit_result *result,
                                               float *rgba,
                                               size_t capacity);

/**
 * Copies one attribute of the surface: as many numbers per vertex as it was given with.
 *
 * @param attribute Its place in the array that was given, 0 to report.attributes - 1. What watertight and
 *                  uncertainty of the options add comes after those: the uncertainty, then whether a vertex
 *                  was invented, each of width 1.
 * @param values    Room for `capacity` numbers.
 * @param capacity  At least the attribute's width * report.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_result_surface_attribute(const atlasfit_result *result,
                                                  size_t attribute,
                                                  double *values,
                                                  size_t capacity);

/**
 * Gives the atlas that was fitted, as a handle of its own. It outlives the result and shares its memory.
 * Free it with atlasfit_atlas_free().
 *
 * @param out Where the atlas is put; NULL on failure.
 */
ATLASFIT_API atlasfit_status atlasfit_result_atlas(const atlasfit_result *result, atlasfit_atlas **out);

/**
 * Copies an array of a result as the caller has its own: numbers of another type, at any stride. The arrays
 * are those of the functions above, those that uncertainty of the options adds (floats), and the normals of
 * corners.
 *
 * @param array #ATLASFIT_POINT_POSITIONS to #ATLASFIT_SURFACE_CORNER_NORMALS.
 * @param to    Where and how.
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT (no such array, a type that does not suit it),
 *         #ATLASFIT_NOT_AVAILABLE (there is none, or it was not asked for), #ATLASFIT_BUFFER_TOO_SMALL,
 *         #ATLASFIT_INDEX_OUT_OF_RANGE (an index that the type does not hold).
 */
ATLASFIT_API
atlasfit_status atlasfit_result_copy(const atlasfit_result *result,
                                     uint32_t array,
                                     const atlasfit_buffer *to);

/**
 * Frees an atlas; NULL is allowed.
 */
ATLASFIT_API atlasfit_status atlasfit_atlas_free(atlasfit_atlas *atlas);

/**
 * Tells what an atlas holds.
 *
 * @param info Filled; its struct_size must be set.
 */
ATLASFIT_API atlasfit_status atlasfit_atlas_get_info(const atlasfit_atlas *atlas, atlasfit_atlas_info *info);

/**
 * Fills a projection with its defaults: no array.
 *
 * @param projection  The struct to fill.
 * @param struct_size sizeof(atlasfit_projection).
 */
ATLASFIT_API atlasfit_status atlasfit_projection_init(atlasfit_projection *projection, size_t struct_size);

/**
 * Moves each point to the nearest place on the atlas's surface; results are in the order of the points. This
 * denoises points that the atlas was not fitted to, or the vertices of any mesh. It is accurate for points
 * whose distance to the surface is less than the surface's radius of curvature.
 *
 * @param atlas  The atlas.
 * @param points Points; only their positions are read.
 * @param run    How long work is run; NULL = the defaults.
 * @param out    Where results are put. Its arrays may not overlap the points.
 */
ATLASFIT_API
atlasfit_status atlasfit_atlas_project(const atlasfit_atlas *atlas,
                                       const atlasfit_points *points,
                                       const atlasfit_run *run,
                                       const atlasfit_projection *out);

/**
 * Evaluates a chart: the places of chart coordinates. Takes well under a microsecond per place.
 *
 * @param atlas    The atlas.
 * @param chart    Index of the chart, 0 to info.charts - 1.
 * @param uv       u, v of each place, from -1 to 1.
 * @param count    Number of places.
 * @param xyz      x, y, z per place; NULL = not wanted.
 * @param normals  Unit normal per place, 3 numbers; NULL = not wanted.
 * @param inside   How far inside the surface each place is, from 0 (outside the chart's domain) to 1; one
 *                 half at the surface's edge. NULL = not wanted.
 * @param capacity Places that each array has room for, at least `count`.
 */
ATLASFIT_API
atlasfit_status atlasfit_atlas_eval(const atlasfit_atlas *atlas,
                                    size_t chart,
                                    const double *uv,
                                    size_t count,
                                    double *xyz,
                                    float *normals,
                                    float *inside,
                                    size_t capacity);

/**
 * Writes an atlas as the bytes of a safetensors file, about 1 KB per chart. The same atlas gives the same
 * bytes.
 *
 * @param atlas    The atlas.
 * @param bytes    Room for `capacity` bytes; NULL to ask for the size.
 * @param capacity At least the size, unless `bytes` is NULL.
 * @param size     Set to the number of bytes that the atlas takes, also with #ATLASFIT_BUFFER_TOO_SMALL.
 */
ATLASFIT_API
atlasfit_status atlasfit_atlas_save(const atlasfit_atlas *atlas,
                                    uint8_t *bytes,
                                    size_t capacity,
                                    size_t *size);

/**
 * Reads an atlas from bytes that atlasfit_atlas_save() made. The bytes need not be trusted: any that are not
 * a valid atlas give #ATLASFIT_BAD_FILE.
 *
 * @param bytes The bytes, borrowed for the call.
 * @param size  Their number.
 * @param out   Where the atlas is put; NULL on failure. Free it with atlasfit_atlas_free().
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_BAD_FILE, #ATLASFIT_OUT_OF_MEMORY.
 */
ATLASFIT_API atlasfit_status atlasfit_atlas_load(const uint8_t *bytes, size_t size, atlasfit_atlas **out);

/**
 * Fills options with their defaults.
 *
 * @param options     The struct to fill.
 * @param struct_size sizeof(atlasfit_unwrap_options).
 */
ATLASFIT_API
atlasfit_status atlasfit_unwrap_options_init(atlasfit_unwrap_options *options,
                                             size_t struct_size);

/**
 * Sets the numbers of options that a preset stands for, which is max_stretch. What is set after it counts.
 *
 * @param options The struct, filled by its _init.
 * @param preset  #ATLASFIT_PRESET_FEW_SEAMS (a stretch of 1.3), #ATLASFIT_PRESET_BALANCED (1.1) or
 *                #ATLASFIT_PRESET_LOW_STRETCH (1.05).
 */
ATLASFIT_API
atlasfit_status atlasfit_unwrap_options_set_preset(atlasfit_unwrap_options *options,
                                                   uint32_t preset);

/**
 * Tells how many bytes atlasfit_unwrap() needs at its peak, the mesh included: an upper bound that is up to
 * twice too large. The mesh need not be there.
 *
 * @param vertices  How many vertices.
 * @param triangles How many triangles.
 * @param options   How to unwrap; NULL = the defaults.
 * @param run       How long work is run, of which the threads count; NULL = the defaults.
 * @param bytes     Set to the bytes; 0 on failure.
 */
ATLASFIT_API
atlasfit_status atlasfit_unwrap_memory_needed(size_t vertices,
                                              size_t triangles,
                                              const atlasfit_unwrap_options *options,
                                              const atlasfit_run *run,
                                              uint64_t *bytes);

/**
 * Lays out UVs for a mesh of any topology: charts of low stretch that neither flip nor overlap, packed on
 * pages of the size that the options say. The mesh keeps its vertices and the order of its triangles. A
 * chart so long that it alone would decide the scale on the page is cut across, unless the options set
 * max_charts, a density or several pages.
 *
 * @param mesh    The mesh; face_group, face_polygon, seam_edges, seam_price and occupied_uv are read, and
 *                corner_uv with keep_uv_seams or keep_uvs. The triangles of a polygon stay together, so that
 *                each of its corners has one UV, unless it does not lie flat: see atlasfit_uv_face_torn().
 * @param options How to unwrap; NULL = the defaults.
 * @param run     How long work is run; NULL = the defaults.
 * @param out     Where the UVs are put; NULL on failure. Free them with atlasfit_uv_free().
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
 *         triangle names no vertex), #ATLASFIT_EMPTY_INPUT or #ATLASFIT_DEGENERATE (no area),
 *         #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
 */
ATLASFIT_API
atlasfit_status atlasfit_unwrap(const atlasfit_mesh *mesh,
                                const atlasfit_unwrap_options *options,
                                const atlasfit_run *run,
                                atlasfit_uv **out);

/**
 * Frees UVs; NULL is allowed.
 */
ATLASFIT_API atlasfit_status atlasfit_uv_free(atlasfit_uv *uv);

/**
 * Tells what UVs hold.
 *
 * @param info Filled; its struct_size must be set.
 */
ATLASFIT_API atlasfit_status atlasfit_uv_get_info(const atlasfit_uv *uv, atlasfit_uv_info *info);

/**
 * Copies the warnings of unwrapping: what the user should hear, a line each, in English. No line where all
 * is well.
 *
 * @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
 * @param capacity At least the length and 1, unless `text` is NULL.
 * @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
 */
ATLASFIT_API
atlasfit_status atlasfit_uv_warnings(const atlasfit_uv *uv,
                                     char *text,
                                     size_t capacity,
                                     size_t *length);

/**
 * Copies the UVs: u, v in [0, 1], v up, for each corner of each face. Faces without a triangle have zeros.
 *
 * @param corner_uv Room for `capacity` numbers.
 * @param capacity  At least 2 * info.corners (6 * info.triangles for a mesh of triangles).
 */
ATLASFIT_API atlasfit_status atlasfit_uv_corners(const atlasfit_uv *uv, float *corner_uv, size_t capacity);

/**
 * Copies the chart of each face, 0 to info.charts - 1; UINT32_MAX for a face without a triangle.
 *
 * @param face_charts Room for `capacity` numbers.
 * @param capacity    At least info.faces.
 */
ATLASFIT_API
atlasfit_status atlasfit_uv_face_charts(const atlasfit_uv *uv,
                                        uint32_t *face_charts,
                                        size_t capacity);

/**
 * Copies the page of each face, 0 to info.pages - 1; UINT32_MAX for a face without a triangle.
 *
 * @param face_pages Room for `capacity` numbers.
 * @param capacity   At least info.faces.
 */
ATLASFIT_API
atlasfit_status atlasfit_uv_face_pages(const atlasfit_uv *uv,
                                       uint32_t *face_pages,
                                       size_t capacity);

/**
 * Copies an array of UVs as the caller has its own: numbers of another type, at any stride.
 *
 * @param array #ATLASFIT_UV_CORNERS to #ATLASFIT_UV_FACE_PAGES.
 * @param to    Where and how.
 * @return As atlasfit_result_copy().
 */
ATLASFIT_API
atlasfit_status atlasfit_uv_copy(const atlasfit_uv *uv,
                                 uint32_t array,
                                 const atlasfit_buffer *to);

/**
 * Copies the numbers of the faces that were cut between charts because they do not lie flat, ascending. A
 * corner of such a face may have one UV in one of its triangles and another in the next;
 * atlasfit_uv_corners() gives that of the first.
 *
 * @param torn     Room for `capacity` numbers.
 * @param capacity At least info.torn_faces.
 */
ATLASFIT_API atlasfit_status atlasfit_uv_face_torn(const atlasfit_uv *uv, uint32_t *torn, size_t capacity);

/**
 * Copies the split form of the mesh, with one vertex per pair of vertex and UV: what graphics cards and glTF
 * take.
 *
 * @param indices         The new vertex of each corner of each face, in the mesh's order.
 * @param index_capacity  Numbers that `indices` has room for, at least info.corners.
 * @param sources         The mesh's vertex that each new vertex came from.
 * @param vertex_uv       u, v of each new vertex.
 * @param vertex_capacity New vertices that `sources` and `vertex_uv` have room for, at least
 *                        info.split_vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_uv_split(const atlasfit_uv *uv,
                                  uint32_t *indices,
                                  size_t index_capacity,
                                  uint32_t *sources,
                                  float *vertex_uv,
                                  size_t vertex_capacity);

/**
 * Fills an image with its defaults: none.
 *
 * @param image       The struct to fill.
 * @param struct_size sizeof(atlasfit_image).
 */
ATLASFIT_API atlasfit_status atlasfit_image_init(atlasfit_image *image, size_t struct_size);

/**
 * Fills textures with their defaults: none.
 *
 * @param textures    The struct to fill.
 * @param struct_size sizeof(atlasfit_textures).
 */
ATLASFIT_API atlasfit_status atlasfit_textures_init(atlasfit_textures *textures, size_t struct_size);

/**
 * Tells how large a page must be to keep the detail of a mesh's old textures when they are drawn anew for
 * other UVs.
 *
 * @param mesh     The mesh; only its positions and triangles are read.
 * @param textures Its old textures of one kind; of several the largest page counts.
 * @param run      How long work is run; NULL = the defaults.
 * @param side     Set to the side of a square page, 256 to 8192: page_width and page_height of
 *                 atlasfit_unwrap_options.
 * @param padding  Set to the free texels between charts that keep colours apart when the page is seen from
 *                 far away: padding of atlasfit_unwrap_options.
 * @param density  Set to the texels per unit of length that the old textures have. Where texels_per_unit of
 *                 the new UVs is less, bake them twice as large, or four times; 0 where no face has a
 *                 texture.
 */
ATLASFIT_API
atlasfit_status atlasfit_textures_page(const atlasfit_mesh *mesh,
                                       const atlasfit_textures *textures,
                                       const atlasfit_run *run,
                                       uint32_t *side,
                                       uint32_t *padding,
                                       double *density);

/**
 * Side in texels of a square texture that keeps the colours of so many points, 512 to 8192.
 */
ATLASFIT_API uint32_t atlasfit_texture_side(size_t points);

/**
 * Fills options with their defaults.
 *
 * @param options     The struct to fill.
 * @param struct_size sizeof(atlasfit_bake_options).
 */
ATLASFIT_API atlasfit_status atlasfit_bake_options_init(atlasfit_bake_options *options, size_t struct_size);

/**
 * Draws colours into a texture for a mesh's UVs: the colours of its vertices, those of points that lie near
 * it, for example a scan, which is often finer, or the textures that it has with other UVs. Colours are
 * averaged as plain numbers, without gamma correction. Parts of the UVs outside [0, 1] are left out.
 *
 * @param mesh     The mesh with its corner_uv, and its colors where `points` is NULL.
 * @param points   Points in the mesh's frame; only their positions and colors are read. NULL = the colours
 *                 of the mesh's vertices.
 * @param options  How to bake; NULL = the defaults.
 * @param run      How long work is run; NULL = the defaults.
 * @param rgba     Red, green, blue, alpha of each texel, 0 to 255; row after row, the top row (v = 1) first.
 * @param capacity Bytes that `rgba` has room for, at least 4 * options.width * options.height.
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
 *         triangle names no vertex, or none is on the page), #ATLASFIT_EMPTY_INPUT (no UVs, no colours),
 *         #ATLASFIT_BUFFER_TOO_SMALL, #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
 */
ATLASFIT_API
atlasfit_status atlasfit_bake(const atlasfit_mesh *mesh,
                              const atlasfit_points *points,
                              const atlasfit_bake_options *options,
                              const atlasfit_run *run,
                              uint8_t *rgba,
                              size_t capacity);

/**
 * Fills options with their defaults: nothing is asked for.
 *
 * @param options     The struct to fill.
 * @param struct_size sizeof(atlasfit_simplify_options).
 */
ATLASFIT_API
atlasfit_status atlasfit_simplify_options_init(atlasfit_simplify_options *options,
                                               size_t struct_size);

/**
 * Makes a mesh of fewer triangles: larger where it is flat. Its boundary, and the seams of its UVs, stay
 * where they are within the error; both sides of a seam stay together, and no triangle turns over in UV
 * space. What is no surface (edges of three triangles, vertices that hold two sheets together) stays as it
 * is. Vertices at one place are one.
 *
 * @param mesh    The mesh; corner_uv and colors are read.
 * @param options How far to simplify: faces, max_error or both.
 * @param run     How long work is run; NULL = the defaults.
 * @param out     Where the mesh is put; NULL on failure. Free it with atlasfit_simplified_free().
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
 *         triangle names no vertex), #ATLASFIT_DEGENERATE (no area), #ATLASFIT_CANCELLED,
 *         #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplify(const atlasfit_mesh *mesh,
                                  const atlasfit_simplify_options *options,
                                  const atlasfit_run *run,
                                  atlasfit_simplified **out);

/**
 * Frees a simplified mesh; NULL is allowed.
 */
ATLASFIT_API atlasfit_status atlasfit_simplified_free(atlasfit_simplified *mesh);

/**
 * Tells how large a simplified mesh is.
 *
 * @param info Filled; its struct_size must be set.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_get_info(const atlasfit_simplified *mesh,
                                             atlasfit_simplified_info *info);

/**
 * Copies the warnings of simplifying: what the user should hear, a line each, in English.
 *
 * @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
 * @param capacity At least the length and 1, unless `text` is NULL.
 * @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_warnings(const atlasfit_simplified *mesh,
                                             char *text,
                                             size_t capacity,
                                             size_t *length);

/**
 * Copies the vertex positions: x, y, z per vertex.
 *
 * @param xyz      Room for `capacity` numbers.
 * @param capacity At least 3 * info.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_positions(const atlasfit_simplified *mesh,
                                              double *xyz,
                                              size_t capacity);

/**
 * Copies the triangles: 3 vertex indices each.
 *
 * @param triangles Room for `capacity` numbers.
 * @param capacity  At least 3 * info.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_triangles(const atlasfit_simplified *mesh,
                                              uint32_t *triangles,
                                              size_t capacity);

/**
 * Copies, for each vertex, a vertex of the given mesh that is near: for columns of the caller's own.
 *
 * @param sources  Room for `capacity` numbers.
 * @param capacity At least info.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_sources(const atlasfit_simplified *mesh,
                                            uint32_t *sources,
                                            size_t capacity);

/**
 * Copies the UVs: u, v for each corner of each triangle, those of the same places on the given mesh.
 * #ATLASFIT_NOT_AVAILABLE where that had none.
 *
 * @param corner_uv Room for `capacity` numbers.
 * @param capacity  At least 6 * info.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_corner_uv(const atlasfit_simplified *mesh,
                                              float *corner_uv,
                                              size_t capacity);

/**
 * Copies the colours: red, green, blue, alpha per vertex, 0 to 1. #ATLASFIT_NOT_AVAILABLE where the given
 * mesh had none.
 *
 * @param rgba     Room for `capacity` numbers.
 * @param capacity At least 4 * info.vertices.
 */
ATLASFIT_API
atlasfit_status atlasfit_simplified_colors(const atlasfit_simplified *mesh,
                                           float *rgba,
                                           size_t capacity);

/**
 * Counts a mesh's connectivity.
 *
 * @param mesh The mesh.
 * @param run  How long work is run; NULL = the defaults.
 * @param out  Filled; its struct_size must be set.
 */
ATLASFIT_API
atlasfit_status atlasfit_measure_topology(const atlasfit_mesh *mesh,
                                          const atlasfit_run *run,
                                          atlasfit_topology *out);

/**
 * Measures the UVs of a mesh, atlasfit_mesh.corner_uv, whichever program made them.
 *
 * @param mesh         The mesh with its UVs; face_page, page_width and page_height say what they lie on.
 * @param run          How long work is run; NULL = the defaults.
 * @param out          Filled; its struct_size must be set.
 * @param face_stretch Stretch max(s1, 1/s2) per face, of its worst triangle: infinite for one that has
 *                     collapsed, 1 for one without area in space. NULL = not wanted.
 * @param capacity     Numbers that `face_stretch` has room for, at least the number of faces unless it is
 *                     NULL.
 */
ATLASFIT_API
atlasfit_status atlasfit_measure_uv(const atlasfit_mesh *mesh,
                                    const atlasfit_run *run,
                                    atlasfit_uv_quality *out,
                                    float *face_stretch,
                                    size_t capacity);

/**
 * Fills options with their defaults.
 *
 * @param options     The struct to fill.
 * @param struct_size sizeof(atlasfit_distance_options).
 */
ATLASFIT_API
atlasfit_status atlasfit_distance_options_init(atlasfit_distance_options *options,
                                               size_t struct_size);

/**
 * Measures a mesh against the true surface, by random samples that follow the run's seed.
 *
 * @param mesh    The mesh to judge.
 * @param truth   The true surface, in the same frame.
 * @param options How to measure; NULL = the defaults.
 * @param run     How long work is run; NULL = the defaults.
 * @param out     Filled; its struct_size must be set.
 */
ATLASFIT_API
atlasfit_status atlasfit_measure_surface(const atlasfit_mesh *mesh,
                                         const atlasfit_mesh *truth,
                                         const atlasfit_distance_options *options,
                                         const atlasfit_run *run,
                                         atlasfit_distance *out);

/**
 * Measures points against the true surface.
 *
 * @param points         The points to judge; only their positions are read.
 * @param truth          The true surface, in the same frame.
 * @param options        How to measure; NULL = the defaults.
 * @param run            How long work is run; NULL = the defaults.
 * @param out            Filled; its struct_size must be set.
 * @param point_distance Distance to the surface per point, infinite for points that are not finite; NULL =
 *                       not wanted.
 * @param capacity       Numbers that `point_distance` has room for, at least points.count unless it is NULL.
 */
ATLASFIT_API
atlasfit_status atlasfit_measure_points(const atlasfit_points *points,
                                        const atlasfit_mesh *truth,
                                        const atlasfit_distance_options *options,
                                        const atlasfit_run *run,
                                        atlasfit_distance *out,
                                        double *point_distance,
                                        size_t capacity);

/**
 * Frees what was read of a file; NULL is allowed.
 */
ATLASFIT_API atlasfit_status atlasfit_file_free(atlasfit_file *file);

/**
 * Reads a file: PLY, OBJ, OFF, STL, XYZ and other columns of numbers, PCD, LAS, LAZ, E57, glTF. Its content
 * decides the format, its name only breaks ties. Polygons are cut into triangles.
 *
 * @param path The file's path: UTF-8, on Unix any bytes.
 * @param run  Memory and time limit, progress and cancel of the reading; NULL = the defaults.
 * @param out  Where the handle is put; NULL on failure.
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_IO (the file cannot be
 *         opened or read), #ATLASFIT_BAD_FILE (of no known format, or broken beyond repair),
 *         #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_load(const char *path,
                                   const atlasfit_run *run,
                                   atlasfit_file **out);

/**
 * Tells what a file holds, and how large its arrays are.
 *
 * @param info Filled; its struct_size must be set.
 */
ATLASFIT_API atlasfit_status atlasfit_file_get_info(const atlasfit_file *file, atlasfit_file_info *info);

/**
 * Copies what had to be repaired or left out while reading, a line each, in English. No line where all is
 * well.
 *
 * @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
 * @param capacity At least the length and 1, unless `text` is NULL.
 * @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_notes(const atlasfit_file *file,
                                    char *text,
                                    size_t capacity,
                                    size_t *length);

/**
 * Copies the positions: x, y, z per point, in the file's order and unit. Points that are not finite are
 * among them.
 *
 * @param xyz      Room for `capacity` numbers.
 * @param capacity At least 3 * info.points.
 */
ATLASFIT_API atlasfit_status atlasfit_file_positions(const atlasfit_file *file, double *xyz, size_t capacity);

/**
 * Copies the normals: 3 numbers per point, zeros where none is known. #ATLASFIT_NOT_AVAILABLE without.
 *
 * @param normals  Room for `capacity` numbers.
 * @param capacity At least 3 * info.points.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_normals(const atlasfit_file *file,
                                      float *normals,
                                      size_t capacity);

/**
 * Copies the colours: red, green, blue, alpha per point, 0 to 1, encoded as they were stored.
 * #ATLASFIT_NOT_AVAILABLE without.
 *
 * @param rgba     Room for `capacity` numbers.
 * @param capacity At least 4 * info.points.
 */
ATLASFIT_API atlasfit_status atlasfit_file_colors(const atlasfit_file *file, float *rgba, size_t capacity);

/**
 * Copies the triangles: 3 vertex indices each.
 *
 * @param triangles Room for `capacity` numbers.
 * @param capacity  At least 3 * info.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_triangles(const atlasfit_file *file,
                                        uint32_t *triangles,
                                        size_t capacity);

/**
 * Copies the UVs: u, v, v up, for each corner of each triangle. #ATLASFIT_NOT_AVAILABLE without.
 *
 * @param corner_uv Room for `capacity` numbers.
 * @param capacity  At least 6 * info.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_corner_uv(const atlasfit_file *file,
                                        float *corner_uv,
                                        size_t capacity);

/**
 * Copies the unit normals at the corners of the triangles: 3 numbers each. #ATLASFIT_NOT_AVAILABLE where
 * those of the points hold.
 *
 * @param corner_normals Room for `capacity` numbers.
 * @param capacity       At least 9 * info.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_corner_normals(const atlasfit_file *file,
                                             float *corner_normals,
                                             size_t capacity);

/**
 * Copies the UV chart of each triangle. #ATLASFIT_NOT_AVAILABLE without.
 *
 * @param face_charts Room for `capacity` numbers.
 * @param capacity    At least info.triangles.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_face_charts(const atlasfit_file *file,
                                          uint32_t *face_charts,
                                          size_t capacity);

/**
 * Copies the image that colours the faces through their UVs, as the bytes of its file (PNG or JPEG).
 * #ATLASFIT_NOT_AVAILABLE without.
 *
 * @param bytes    Room for `capacity` bytes.
 * @param capacity At least info.texture_bytes.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_texture(const atlasfit_file *file,
                                      uint8_t *bytes,
                                      size_t capacity);

/**
 * Tells the name and type of an attribute.
 *
 * @param attribute Its place, 0 to info.attributes - 1.
 * @param name      Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
 * @param capacity  At least the length and 1, unless `name` is NULL.
 * @param length    Set to the bytes that the name takes, without the 0.
 * @param width     Set to the numbers per point; NULL = not wanted.
 * @param scalar    Set to the type that the file keeps them in, #ATLASFIT_F32 to #ATLASFIT_I32; NULL = not
 *                  wanted.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_attribute_type(const atlasfit_file *file,
                                             size_t attribute,
                                             char *name,
                                             size_t capacity,
                                             size_t *length,
                                             uint32_t *width,
                                             uint32_t *scalar);

/**
 * Copies an attribute: its numbers per point, exact for all types.
 *
 * @param attribute Its place, 0 to info.attributes - 1.
 * @param values    Room for `capacity` numbers.
 * @param capacity  At least the attribute's width * info.points.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_attribute(const atlasfit_file *file,
                                        size_t attribute,
                                        double *values,
                                        size_t capacity);

/**
 * Fills options with their defaults.
 *
 * @param options     The struct to fill.
 * @param struct_size sizeof(atlasfit_save_options).
 */
ATLASFIT_API atlasfit_status atlasfit_save_options_init(atlasfit_save_options *options, size_t struct_size);

/**
 * Writes points, or with their `triangles` or `faces` a mesh, to a file: PLY, OBJ, GLB, OFF, STL, XYZ, by
 * the name's extension. PLY, OBJ and OFF hold polygons as they are, GLB and STL the triangles that they
 * are cut into. Faces of fewer than three corners are left out. The file is written whole or not at all;
 * one that exists is replaced. Images and material libraries go beside it.
 *
 * @param path     The file's path: UTF-8, on Unix any bytes.
 * @param points   Positions, normals, colours, attributes, and triangles or faces.
 * @param options  What the file is to hold besides; NULL = nothing.
 * @param run      Memory and time limit, progress and cancel of the writing; NULL = the defaults.
 * @param lost     Room for `capacity` bytes, filled with UTF-8 and a 0: what the format could not hold, a
 *                 line each, cut where there is no more room. NULL = not wanted.
 * @param capacity Bytes that `lost` has room for.
 * @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_IO (the file cannot be
 *         written), #ATLASFIT_BAD_FILE (an extension that is not written, a triangle that names no vertex,
 *         no faces for a format that holds only those), #ATLASFIT_INDEX_OUT_OF_RANGE (a corner of
 *         `faces` that names no vertex), #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
 */
ATLASFIT_API
atlasfit_status atlasfit_file_save(const char *path,
                                   const atlasfit_points *points,
                                   const atlasfit_save_options *options,
                                   const atlasfit_run *run,
                                   char *lost,
                                   size_t capacity);

/**
 * The number of handles of all kinds that were made and not freed: 0 at the end of a program that frees what
 * it makes. Handles are kept in a table, so a leak checker does not see one that was forgotten.
 */
ATLASFIT_API size_t atlasfit_live_handles(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ATLASFIT_H */
