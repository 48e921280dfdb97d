"""Judges: the topology of a mesh, the quality of any UVs, distances to a true surface."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import _abi
from ._abi import lib
from ._arrays import address, corners, indices, mesh_struct, points_struct, positions
from ._brief import brief, counted
from ._call import RunOptions, options_with, plain, run, size_of_page, values

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack


@dataclass(frozen=True)
class Topology:
    """How a mesh hangs together. Vertices in one place count as one."""

    vertices: int
    """Vertices in use, after welding."""
    edges: int
    faces: int
    """Faces that name three different places."""
    degenerate_faces: int
    """Faces that do not; they take no part in the other counts."""
    unused_vertices: int
    parts: int
    """Parts that share no vertex."""
    boundary_edges: int
    boundary_loops: int
    non_manifold_edges: int
    """Edges with three or more faces."""
    non_manifold_vertices: int
    """Vertices whose faces make more than one fan."""
    inconsistent_edges: int
    """Edges whose two faces run along them in the same direction."""
    euler: int
    """Vertices - edges + faces."""
    genus: int
    """Handles, summed over the parts, with holes filled; -1 where an edge is not manifold or the surface is
    one-sided.
    """
    orientable: bool
    closed: bool


@dataclass(frozen=True, repr=False)
class UvQuality:
    """Quality of UVs. Stretch is after one global scale that makes the summed areas equal: 1 = isometric."""

    faces: int
    charts: int
    """Groups of faces joined through edges with equal UVs at both ends."""
    flips: int
    """Faces turned against the majority of their chart."""
    degenerate: int
    """Faces with area in space and none in the texture, or with UVs that are not finite."""
    overlapping_faces: int
    """Faces whose inside meets another one's inside in the texture, by exact predicates."""
    seam: float
    """Length of the inner edges that are cut, divided by the square root of the surface's area."""
    stretch_l2: float
    """L2 stretch of Sander et al. 2001; infinite where every face has collapsed."""
    stretch_linf: float
    """L-infinity stretch of Sander et al. 2001, collapsed faces left out."""
    stretch_median: float
    """Median by area of max(s1, 1/s2), with s1 >= s2 the singular values of the map from surface to texture.
    """
    stretch_p95: float
    conformal: float
    """Mean by area of s1/s2: 1 = conformal."""
    overlap: float
    """Texels covered twice or more / texels covered, at 1024 x 1024 texels for all pages side by side."""
    coverage: float
    """Texels covered / all texels."""
    inside: bool
    """Whether all UVs lie on their pages, in [0, 1]."""
    finite: bool
    straightness: float
    """Share of the length of the charts' outlines in the texture that is parallel to a side of the page."""
    face_stretch: NDArray[np.float32]
    """(m,) stretch max(s1, 1/s2) per face, infinite where it has collapsed, 1 where it has no area in space.
    """

    def __repr__(self) -> str:
        return brief(
            self,
            counted(self.charts, "chart"),
            counted(self.faces, "face"),
            f"stretch {self.stretch_p95:.3f} (95 %)",
            f"seams {self.seam:.3g}",
            f"{100 * self.coverage:.0f} % filled",
            self.flips and f"{self.flips} flipped",
            self.overlapping_faces and f"{self.overlapping_faces} overlapping",
            self.degenerate and f"{self.degenerate} collapsed",
        )



@dataclass(frozen=True)
class DistanceStats:
    """Statistics of a set of distances."""

    rms: float
    mean: float
    median: float
    p95: float
    p99: float
    max: float


@dataclass(frozen=True, repr=False)
class Distance:
    """A mesh or points against the true surface."""

    accuracy: DistanceStats
    """From the result to the truth."""
    completeness: DistanceStats
    """From the truth to the result; zeros for points."""
    chamfer: float
    """Chamfer distance (Gadelha et al. 2020): squared length."""
    chamfer_floor: float
    """What two sets of samples of the truth give: no result can be expected to be below."""
    f_score: float
    """Harmonic mean of the shares of samples within the threshold, both ways, in [0, 1]; 0 for points."""
    threshold: float
    """The threshold that was used; 0 for points."""
    normal_consistency: float
    """Mean absolute cosine between the normals at nearest points, in [0, 1]; 0 for points."""
    normal_orientation: float
    """The same with sign: negative for a surface that is inside out; 0 for points."""
    not_finite: int
    """Points that are not finite and were left out; 0 for meshes."""
    point_distances: NDArray[np.float64] | None
    """(n,) distance of each point to the surface, infinite for points that are not finite; None for meshes.
    """

    def __repr__(self) -> str:
        return brief(self, f"rms {self.accuracy.rms:.3g}", f"95 % below {self.accuracy.p95:.3g}")



def measure_topology(vertices: ArrayLike, faces: ArrayLike, **options: Unpack[RunOptions]) -> Topology:
    """Counts the connectivity of a mesh: (n, 3) vertices, (m, 3) faces.

    >>> atlasfit.measure_topology(np.eye(3), [[0, 1, 2]]).boundary_edges
    3
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    mesh, out = mesh_struct(vertices, faces), _abi.atlasfit_topology()
    run(lambda r: lib().atlasfit_measure_topology(byref(mesh), r, byref(out)), options)
    return Topology(**values(Topology, out))


def measure_uv(
    vertices: ArrayLike,
    faces: ArrayLike,
    corner_uv: ArrayLike,
    *,
    face_pages: ArrayLike | None = None,
    page_size: int | tuple[int, int] | None = None,
    **options: Unpack[RunOptions],
) -> UvQuality:
    """Measures UVs, whoever made them.

    vertices    (n, 3)
    faces       (m, 3) vertex indices
    corner_uv   (m, 3, 2) UVs of each corner of each face
    face_pages  (m,) the page that each face's UVs are on; without it all are on one
    page_size   width and height of a page in any unit, where it is not square

    >>> corner_uv = [[[0, 0], [1, 0], [0, 1]]]
    >>> quality = atlasfit.measure_uv([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]], corner_uv)
    >>> quality.flips, round(float(quality.face_stretch[0]), 3)
    (0, 1.414)
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    uv = corners(corner_uv, len(faces))
    pages = None if face_pages is None else indices(face_pages, (len(faces),), "face_pages")
    mesh, out = mesh_struct(vertices, faces, uv), _abi.atlasfit_uv_quality()
    mesh.face_page = address(pages)
    if page_size is not None:
        mesh.page_width, mesh.page_height = map(plain, size_of_page(page_size))
    stretch = np.empty(len(faces), np.float32)
    run(
        lambda r: lib().atlasfit_measure_uv(byref(mesh), r, byref(out), stretch.ctypes.data, stretch.size),
        options,
    )
    return UvQuality(face_stretch=stretch, **values(UvQuality, out))


def measure_surface(
    vertices: ArrayLike,
    faces: ArrayLike,
    true_vertices: ArrayLike,
    true_faces: ArrayLike,
    *,
    samples: int | None = None,
    chamfer_samples: int | None = None,
    threshold: float | None = None,
    **options: Unpack[RunOptions],
) -> Distance:
    """Measures a mesh against the true surface in the same frame, by random samples that follow the seed.

    samples          of each surface for accuracy and completeness (default 60,000)
    chamfer_samples  of each surface for the Chamfer distance; its floor depends on it (default 16,000)
    threshold        distance below which a sample counts for the F-score; 0 = half a percent of the truth's
                     longest side (default)

    >>> square, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> raised = np.array(square) + [0, 0, 0.1]
    >>> round(atlasfit.measure_surface(raised, faces, square, faces).accuracy.rms, 3)
    0.1
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    true_vertices = positions(true_vertices, "true_vertices")
    true_faces = indices(true_faces, (-1, 3), "true_faces")
    mesh, truth = mesh_struct(vertices, faces), mesh_struct(true_vertices, true_faces)
    out = _abi.atlasfit_distance()
    how = options_with(
        _abi.atlasfit_distance_options(),
        samples=samples,
        chamfer_samples=chamfer_samples,
        threshold=threshold,
    )
    run(
        lambda r: lib().atlasfit_measure_surface(byref(mesh), byref(truth), byref(how), r, byref(out)),
        options,
    )
    return _distance(out, None)


def measure_points(
    points: ArrayLike,
    true_vertices: ArrayLike,
    true_faces: ArrayLike,
    *,
    chamfer_samples: int | None = None,
    **options: Unpack[RunOptions],
) -> Distance:
    """Measures (n, 3) points against the true surface in the same frame.

    >>> square, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> atlasfit.measure_points([[0.5, 0.5, 0.25], [0.5, 0.5, 0]], square, faces).point_distances
    array([0.25, 0.  ])
    """
    points = positions(points, "points")
    true_vertices = positions(true_vertices, "true_vertices")
    true_faces = indices(true_faces, (-1, 3), "true_faces")
    given, truth = points_struct(points), mesh_struct(true_vertices, true_faces)
    out = _abi.atlasfit_distance()
    how = options_with(_abi.atlasfit_distance_options(), chamfer_samples=chamfer_samples)
    each = np.empty(len(points))
    run(
        lambda r: lib().atlasfit_measure_points(
            byref(given), byref(truth), byref(how), r, byref(out), each.ctypes.data, each.size
        ),
        options,
    )
    return _distance(out, each)


def _distance(out: _abi.atlasfit_distance, each: NDArray[np.float64] | None) -> Distance:
    stats = {
        name: DistanceStats(**values(DistanceStats, getattr(out, name)))
        for name in ("accuracy", "completeness")
    }
    return Distance(**(values(Distance, out) | stats), point_distances=each)
