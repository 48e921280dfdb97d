"""denoise(): a noisy scan in; denoised points, one connected surface with UVs, and the fitted atlas out."""

from __future__ import annotations

from ctypes import byref, c_uint64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Mapping

import numpy as np

from . import _abi
from ._abi import lib
from ._arrays import Attributes, check_rows, indices, points_struct, positions, rows, set_colors
from ._atlas import Atlas
from ._brief import brief, counted
from ._call import Error, Handle, RunOptions, check, choice, options_with, run, values
from ._show import show

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack

PRIORS = {
    "gp": _abi.PRIOR_GP,
    "mlp": _abi.PRIOR_MLP,
    "conv": _abi.PRIOR_CONV,
    "level-set": _abi.PRIOR_LEVEL_SET,
}


SURFACES = {"none": _abi.SURFACE_NONE, "smooth": _abi.SURFACE_SMOOTH, "wrap": _abi.SURFACE_WRAP}


@dataclass(frozen=True)
class Sweep:
    """How a sweep was moved.

    sweep   its number, as the attribute has it
    points  its points that are finite
    pairs   its points that were seen on other sweeps, of those that were looked at; 0: it is where it was
    moved   how far its points were moved, root mean square, in their unit
    matrix  (3, 4) float64, a rotation and a shift: where its points go
    """

    sweep: int
    points: int
    pairs: int
    moved: float
    matrix: NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Report:
    """What was found and done. Lengths are in the points' unit."""

    points_given: int
    not_finite: int
    """Points given with a coordinate that is not finite. They are no part of the surface."""
    duplicates: int
    """Points that repeat the position of an earlier one, or are copies of it, far nearer than the next; they
    move with it.
    """
    outliers: int
    """Points that no chart claims: they belong to no surface."""
    followed_outliers: int
    """Outliers that follow the surface between their neighbours in the mesh; the others stay where they are.
    """
    points: int
    vertices: int
    triangles: int
    charts: int
    uv_charts: int
    """UV charts of the surface; 0 without UVs."""
    parts: int
    """Connected parts of the surface."""
    dropped_parts: int
    """Connected parts of the surface that were left out, as min_part and largest asked for."""
    dropped_points: int
    """Points given that lie on those parts. They are denoised all the same, and no outliers."""
    boundary_loops: int
    boundary_edges: int
    filled_holes: int
    one_sided: bool
    """Whether some part of the surface is one-sided."""
    spacing: float
    """Median distance between neighbouring points."""
    noise: float
    """Standard deviation along the normal, estimated or as given."""
    voxel: float
    """Side of the finest voxels that the surface was contoured with; where points lie far apart they are wider."""
    uncertainty_factor: float | None
    """By how much the charts' own standard deviations were widened, as the residuals ask for, 1 or more. None
    where uncertainty was not asked for, or the residuals do not tell.
    """
    sweeps: tuple[Sweep, ...]
    """How each sweep was moved, by their numbers; empty unless denoise() was told of sweeps."""
    apart_before: float
    """How far the sweeps were apart along the normal before they were moved (standard deviation, noise and
    misfit together); 0 without sweeps.
    """
    apart_after: float
    """The same after they were moved."""
    stage_seconds: dict[str, float]
    """Seconds spent in each stage that ran."""
    warnings: tuple[str, ...]
    """What the user should hear; empty where all is well."""

    def __repr__(self) -> str:
        return brief(
            self,
            counted(self.points_given, "point"),
            counted(self.outliers, "outlier"),
            f"noise {self.noise:.3g}",
            f"spacing {self.spacing:.3g}",
            counted(self.charts, "chart"),
            counted(self.triangles, "triangle"),
            self.warnings and counted(len(self.warnings), "warning"),
        )



@dataclass(frozen=True, repr=False)
class Surface:
    """One two-manifold triangle mesh.

    vertices     (v, 3) float64
    normals      (v, 3) float32, unit length
    triangles    (t, 3) uint32, counter-clockwise seen from outside
    corner_uv    (t, 3, 2) float32 in [0, 1], v up; None without UVs
    corner_normals (t, 3, 3) float32, unit length, for each corner of each triangle: at creases each side has
                 its own; None where there is no crease
    face_charts  (t,) uint32, the UV chart of each triangle; None without UVs
    colors       (v, 4) float32 in [0, 1]; None where the points had none
    attributes   by name, (v,) or (v, k): those given to denoise(), in the type that they were given in; with
                 uncertainty "uncertainty", (v,) float32, the standard deviation along the normal in the
                 points' unit; with that or watertight "extrapolated", (v,) uint8, 1 where a vertex was
                 invented, else 0. One of these names that was given gets "_before" added
    """

    vertices: NDArray[np.float64]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    corner_uv: NDArray[np.float32] | None
    corner_normals: NDArray[np.float32] | None
    face_charts: NDArray[np.uint32] | None
    colors: NDArray[np.float32] | None
    attributes: dict[str, NDArray[Any]]

    def __repr__(self) -> str:
        return brief(
            self,
            counted(len(self.vertices), "vertex", "vertices"),
            counted(len(self.triangles), "triangle"),
            self.corner_uv is not None and "UVs",
            self.corner_normals is not None and "creases",
            self.colors is not None and "colors",
            *self.attributes,
        )

    def show(self) -> None:
        """Opens a window, or a view in a notebook, with the surface: by pyvista where that is installed,
        else by
        trimesh.
        """
        show(self.vertices, self.triangles, self.colors)



@dataclass(frozen=True, repr=False)
class Denoised:
    """What denoise() made.

    points   (n, 3) float64, in input order; outliers (where kept, and unless they follow their neighbours in
             a mesh) and points that are not finite are where they were
    normals  (n, 3) float32, unit length; those of points on no chart are as given, or zeros, or where they
             follow their neighbours a mean of theirs
    sources  (n,) uint32, the given point that each was: 0, 1, 2, ... unless outliers are dropped
    charts   (n,) uint32, the chart that weighs most there; NO_CHART for outliers and points that are not
             finite
    attributes
             by name, (n,) float32, with uncertainty, else empty: "uncertainty", the standard deviation of the
             point's place along the normal, of outliers their distance from the nearest point that is none;
             "noise", the standard deviation of the noise that the point had, 0 of outliers;
             "outlier_probability", that it is on no surface. The first two in the points' unit; of points
             that are not finite the first and the last are NaN
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float32]
    sources: NDArray[np.uint32]
    charts: NDArray[np.uint32]
    attributes: dict[str, NDArray[np.float32]]
    surface: Surface
    atlas: Atlas
    report: Report

    def __repr__(self) -> str:
        points = counted(len(self.points), "point")
        return brief(self, points, *self.attributes, self.surface, self.atlas, self.report)

    def show(self) -> None:
        """Shows the surface: see Surface.show()."""
        self.surface.show()



def denoise_memory_needed(
    points: int,
    *,
    detail: float | None = None,
    uv: bool | None = None,
    uncertainty: bool | None = None,
    **options: Unpack[RunOptions],
) -> int:
    """Bytes that denoise() needs at its peak for so many evenly sampled points, which are included.

    An upper bound, up to twice too large.

    >>> atlasfit.denoise_memory_needed(1_000_000, uv=False) > 1e8
    True
    """
    chosen = options_with(_abi.atlasfit_denoise_options(), detail=detail, uv=uv, uncertainty=uncertainty)
    bytes_needed = c_uint64()
    call = lib().atlasfit_denoise_memory_needed
    run(lambda r: call(points, byref(chosen), r, byref(bytes_needed)), options)
    return bytes_needed.value


def denoise(
    points: ArrayLike,
    *,
    normals: ArrayLike | None = None,
    colors: ArrayLike | None = None,
    attributes: Mapping[str, ArrayLike] | None = None,
    triangles: ArrayLike | None = None,
    noise: float | None = None,
    detail: float | None = None,
    fill_holes: float | None = None,
    charts: int | None = None,
    outliers: Literal["keep", "drop"] | None = None,
    uv: bool | None = None,
    surface: Literal["smooth", "wrap", "none"] | None = None,
    texture_size: int | None = None,
    prior: Literal["gp", "mlp", "conv", "level-set"] | None = None,
    recipe: Literal["fast", "paper"] | None = None,
    network_charts: int | None = None,
    network_iterations: int | None = None,
    network_stretch_weight: float | None = None,
    network_learning_rate: float | None = None,
    viewpoint: ArrayLike | None = None,
    watertight: bool | None = None,
    min_part: float | None = None,
    largest: bool | None = None,
    faces: int | None = None,
    max_error: float | None = None,
    strength: float | None = None,
    uncertainty: bool | None = None,
    sweeps: str | None = None,
    **options: Unpack[RunOptions],
) -> Denoised:
    """Denoises a scan: denoised points, one connected surface with UVs, and the fitted atlas.

    points        (n, 3), at least a few hundred on a surface, in any unit; float32 and float64 are not copied
    normals       (n, 3): the surface faces their side; points that end up on no chart keep theirs
    colors        (n, 3) or (n, 4): floats in [0, 1], or whole numbers from 0 to 255; the surface carries them
    attributes    by name, (n,) or (n, k): the surface carries them, in the type that they are given in.
                  Integers are labels, copied from the nearest point; floats are averaged
    triangles     (m, 3) where the points are the vertices of a mesh: outliers that are kept follow the
                  surface between their neighbours in it, so that no spike stays; result.points are its new
                  vertices
    noise         standard deviation along the normal; 0 = estimate it, for each chart anew (default)
    detail        fineness of the surface, 0.1 to 10: 1 = what the data supports (default), 0.5 = voxels twice
                  as large
    fill_holes    holes with a boundary shorter than this are filled; 0 = only gaps of the sampling and places
                  about which the points thin out (default)
    charts        number of charts to aim for; 0 = as many as the shape needs (default)
    outliers      points on no surface: "keep" where they were, of a mesh between their neighbours (default),
                  or "drop", also those of parts that are left out, which else are denoised and kept
    uv            whether the surface gets UVs (default True)
    surface       "smooth", as the charts have it (default); "wrap", a watertight shell around that, where
                  the library was built with CGAL; "none": the call takes about half the time, result.surface
                  is empty, and points beside an edge of the part stay on its rounded charts
    texture_size  side of the texture page in texels, for the padding between UV charts (default 1024)
    prior         "gp", a Gaussian process as smooth as the limit of the paper's networks (default), or the
                  networks themselves, many times slower: "mlp", fully connected; "conv", convolutional;
                  "level-set", closed surfaces only
    recipe        how "mlp" and "conv" are trained: "fast", from coarse to fine (default), or "paper", all
                  samples at every step
    network_      charts that are trained (default 8), iterations at most (1000), stretch_weight against the
                  Chamfer distance (1), learning_rate of Adam (0.001); iterations and learning_rate are of the
                  recipe "paper"
    viewpoint     (3,) where the scanner stood, in the points' unit: the surface faces it, whatever the
                  normals say. Where more than a quarter of the points is hidden from there, connected
                  parts face it as wholes
    watertight    whether the surface is to be that of a solid, for printing: closed, without
                  self-intersections (default False). Its attribute "extrapolated" is 1 where it was invented
    min_part      connected parts of the surface that have less than this share of its area, 0 to 1, are left
                  out (default 0: all stay)
    largest       whether only the largest part of the surface by area is kept (default False)
    faces         triangles that the surface should have at the most; 0 = about as many as points (default)
    max_error     how far the surface may move to have fewer triangles; 0 = all that it is contoured with;
                  less than 0 = as far as faces asks for, without that a quarter of the noise or a
                  twentieth of the spacing (default -1)
    strength      how strongly to denoise, 0 or more: 1 = as much as the scan asks for (default),
                  2 = smoother. Detail below so many times the usual length is smoothed away, from a quarter
                  to 4 times, and the surface follows. Below 1 the points besides go only this share of the
                  way to the surface: 0 leaves them where they are
    uncertainty   whether to say how sure the result is (default False): result.attributes,
                  result.surface.attributes and report.uncertainty_factor; nothing else changes. A "wrap" has
                  none for its vertices
    sweeps        the name of an attribute that tells apart the sweeps of which the scan was merged: whole
                  numbers, 0 or more. They are moved together first, each by a small rigid motion, which
                  report.sweeps tells
    options       see RunOptions: seed, threads, time_limit, memory_limit, progress, cancel

    >>> points = np.random.default_rng(0).normal(size=(2000, 3))
    >>> points /= np.linalg.norm(points, axis=1, keepdims=True)     # a scan of a ball
    >>> result = atlasfit.denoise(points, noise=0.01)
    >>> result.points.shape, result.report.parts
    ((2000, 3), 1)

    Raises Error (Cancelled, TimedOut), or ValueError and TypeError for arrays of a wrong shape or type.
    """
    points = positions(points, "points")
    given = points_struct(points)
    if normals is not None:
        normals = rows(normals, (3,), "normals", (np.float32,))
        check_rows(normals, len(points), "normals")
        given.normals, given.normal_stride = normals.ctypes.data, normals.strides[0]
    if colors is not None:
        colors = set_colors(given, colors, len(points))
    columns = Attributes(attributes or {}, len(points))
    given.attributes, given.attribute_count = columns.structs, len(columns.names)
    if triangles is not None:
        triangles = indices(triangles, (-1, 3), "triangles")
        given.triangles, given.triangle_count = triangles.ctypes.data, len(triangles)
    chosen = options_with(
        _abi.atlasfit_denoise_options(),
        noise=noise,
        detail=detail,
        fill_holes=fill_holes,
        charts=charts,
        outliers=choice(outliers, {"keep": _abi.OUTLIERS_KEEP, "drop": _abi.OUTLIERS_DROP}, "outliers"),
        uv=uv,
        surface=choice(surface, SURFACES, "surface"),
        texture_size=texture_size,
        prior=choice(prior, PRIORS, "prior"),
        recipe=choice(recipe, {"fast": _abi.RECIPE_FAST, "paper": _abi.RECIPE_PAPER}, "recipe"),
        network_charts=network_charts,
        network_iterations=network_iterations,
        network_stretch_weight=network_stretch_weight,
        network_learning_rate=network_learning_rate,
        watertight=watertight,
        min_part=min_part,
        largest=largest,
        faces=faces,
        max_error=max_error,
        strength=strength,
        uncertainty=uncertainty,
    )
    if sweeps is not None:
        chosen.sweeps = sweeps.encode()
    if viewpoint is not None:
        chosen.viewpoint[:] = np.asarray(viewpoint, np.float64).reshape(3).tolist()
        chosen.has_viewpoint = 1
    result = Handle("result")
    run(lambda r: lib().atlasfit_denoise(byref(given), byref(chosen), r, byref(result.pointer)), options)
    return _read(result, columns, bool(uncertainty), bool(watertight))


def _told(result: Handle, array: int, count: int) -> NDArray[np.float32]:
    """An array of one number for each point or vertex."""
    return _copied(result, array, (count,))


def _copied(result: Handle, array: int, shape: tuple[int, ...]) -> NDArray[np.float32]:
    values = np.empty(shape, np.float32)
    to = options_with(_abi.atlasfit_buffer(), data=values.ctypes.data, capacity=values.size)
    check(lib().atlasfit_result_copy(result.pointer, array, byref(to)))
    return values


def _sweep(result: Handle, index: int) -> Sweep:
    raw = _abi.atlasfit_sweep()
    check(lib().atlasfit_result_sweep(result.pointer, index, byref(raw)))
    return Sweep(**values(Sweep, raw) | {"matrix": np.array(raw.matrix).reshape(3, 4)})


def _corner_normals(result: Handle, triangles: int) -> NDArray[np.float32] | None:
    """The normals at the corners of the triangles; None where the surface has no crease."""
    try:
        return _copied(result, _abi.SURFACE_CORNER_NORMALS, (triangles, 3, 3))
    except Error as error:
        if error.status == _abi.NOT_AVAILABLE:
            return None
        raise


def _beside(given: list[str], added: Mapping[str, object]) -> list[str]:
    """Names of given columns beside those that are added: one that is taken gets "_before"."""
    names = []
    for name in given:
        while name in added or name in names:
            name += "_before"
        names.append(name)
    return names


def _read(result: Handle, columns: Attributes, uncertainty: bool, watertight: bool) -> Denoised:
    raw = _abi.atlasfit_report()
    check(lib().atlasfit_result_report(result.pointer, byref(raw)))

    of_points: dict[str, NDArray[np.float32]] = {}
    of_surface: dict[str, NDArray[Any]] = {}
    if uncertainty:
        of_points = {
            "uncertainty": _told(result, _abi.POINT_UNCERTAINTY, raw.points),
            "noise": _told(result, _abi.POINT_NOISE, raw.points),
            "outlier_probability": _told(result, _abi.POINT_OUTLIER_PROBABILITY, raw.points),
        }
    # A shell carries no attributes.
    if uncertainty and raw.attributes:
        of_surface["uncertainty"] = _told(result, _abi.SURFACE_UNCERTAINTY, raw.vertices)
    if (uncertainty or watertight) and raw.attributes:
        marks = _told(result, _abi.SURFACE_EXTRAPOLATED, raw.vertices)
        of_surface["extrapolated"] = marks.astype(np.uint8)

    copy, n, v, t = result.copy, raw.points, raw.vertices, raw.triangles
    surface = Surface(
        vertices=copy("surface_positions", (v, 3), np.float64),
        normals=copy("surface_normals", (v, 3), np.float32),
        triangles=copy("surface_triangles", (t, 3), np.uint32),
        corner_uv=copy("surface_corner_uv", (t, 3, 2), np.float32) if raw.has_uv else None,
        corner_normals=_corner_normals(result, t),
        face_charts=copy("surface_face_charts", (t,), np.uint32) if raw.has_uv else None,
        colors=copy("surface_colors", (v, 4), np.float32) if raw.has_colors else None,
        attributes={
            name: columns.carried(i, copy("surface_attribute", (v, *shape), np.float64, i))
            for i, (name, shape) in enumerate(zip(_beside(columns.names, of_surface), columns.shapes))
            if raw.attributes
        }
        | of_surface,
    )
    atlas = Handle("atlas")
    check(lib().atlasfit_result_atlas(result.pointer, byref(atlas.pointer)))
    stages = {lib().atlasfit_stage_name(i).decode(): s for i, s in enumerate(raw.stage_seconds) if s > 0.0}
    report = values(Report, raw) | {
        "stage_seconds": stages,
        "warnings": result.warnings(),
        "uncertainty_factor": raw.uncertainty_factor or None,
        "sweeps": tuple(_sweep(result, i) for i in range(raw.sweeps)),
    }
    return Denoised(
        points=copy("point_positions", (n, 3), np.float64),
        normals=copy("point_normals", (n, 3), np.float32),
        sources=copy("point_sources", (n,), np.uint32),
        charts=copy("point_charts", (n,), np.uint32),
        attributes=of_points,
        surface=surface,
        atlas=Atlas(atlas),
        report=Report(**report),
    )
