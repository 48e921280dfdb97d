"""unwrap(): UVs for a triangle mesh of any topology."""

from __future__ import annotations

from ctypes import byref, c_uint64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _abi
from ._abi import lib
from ._arrays import address, corners, indices, mesh_struct, numbers, positions, uv_triangles
from ._brief import brief, counted
from ._call import Handle, RunOptions, check, choice, options_with, run, size_of_page, values
from ._show import plot

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack


PRESETS = {
    "few-seams": _abi.PRESET_FEW_SEAMS,
    "balanced": _abi.PRESET_BALANCED,
    "low-stretch": _abi.PRESET_LOW_STRETCH,
}
STACKS = {
    "none": _abi.STACK_NONE,
    "identical": _abi.STACK_IDENTICAL,
    "mirrored": _abi.STACK_MIRRORED,
}
STRAIGHTENINGS = {"off": _abi.STRAIGHTEN_OFF, "auto": _abi.STRAIGHTEN_AUTO}


@dataclass(frozen=True, repr=False)
class UvInfo:
    """What UVs hold, and what had to be done for them."""

    triangles: int
    charts: int
    pages: int
    split_vertices: int
    """Vertices of the mesh in its split form: see Uv.split()."""
    degenerate_faces: int
    """Triangles of zero area or with repeated or non-finite vertices; they got small valid UV triangles."""
    duplicate_faces: int
    """Triangles that repeat the corners of an earlier one; they got UVs of their own."""
    non_manifold_edges: int
    """Edges cut because more than two triangles, or two of clashing orientation, meet there."""
    repaired_charts: int
    """Charts that had to be cut further to stay free of flips and overlaps."""
    split_polygons: int
    """Polygons that could not stay in one piece because they do not lie flat."""
    width: int
    """Width of a page in texels."""
    height: int
    texels_per_unit: float
    """Texels per unit of length on the surface."""
    stretch_bound: float
    """The stretch bound that was held: max_stretch, or more where max_charts asked for it."""
    over_stretched: float
    """Share of the area stretched beyond the bound."""
    coverage: float
    """Share of the pages that lies under faces."""
    welded_vertices: int
    """Vertices at open edges that were taken for another one at the same place, for the layout only."""
    stacked_parts: int
    """Parts that lie on another one of their shape."""
    straightened_charts: int
    """Charts whose sides are straight and parallel to the page's, where that was asked for."""
    seconds: float
    """Wall time of unwrapping itself."""
    padding: int
    """Free texels between charts and at a page's border: the padding asked for, or less where with
    that the charts would have had no room."""
    warnings: tuple[str, ...]
    """What the user should hear; empty where all is well."""

    def __repr__(self) -> str:
        return brief(
            self,
            counted(self.charts, "chart"),
            counted(self.triangles, "triangle"),
            self.pages > 1 and counted(self.pages, "page"),
            f"{self.width} x {self.height} texels",
            f"{100 * self.coverage:.0f} % filled",
            self.warnings and counted(len(self.warnings), "warning"),
        )



@dataclass(frozen=True, repr=False)
class Uv:
    """UVs of a mesh, which keeps its vertices and the order of its faces.

    corner_uv    (m, 3, 2) float32 in [0, 1], v up, for each corner of each face
    face_charts  (m,) uint32, 0 to info.charts - 1
    face_pages   (m,) uint32, 0 to info.pages - 1
    """

    corner_uv: NDArray[np.float32]
    face_charts: NDArray[np.uint32]
    face_pages: NDArray[np.uint32]
    info: UvInfo
    _split: Handle | tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float32]]

    def split(self) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float32]]:
        """The mesh with one vertex per pair of vertex and UV, what graphics cards and glTF want: (m, 3)
        indices of new vertices, (k,) the mesh's vertex that each came from, (k, 2) its UV.

        >>> vertices, faces = np.eye(3), [[0, 1, 2]]
        >>> new_faces, sources, uv = atlasfit.unwrap(vertices, faces).split()
        >>> vertices[sources][new_faces].shape, uv[new_faces].shape
        ((1, 3, 3), (1, 3, 2))
        """
        if isinstance(self._split, tuple):
            return self._split
        k = self.info.split_vertices
        faces, sources, uv = (
            np.empty((self.info.triangles, 3), np.uint32),
            np.empty(k, np.uint32),
            np.empty((k, 2), np.float32),
        )
        check(
            lib().atlasfit_uv_split(
                self._split.pointer, faces.ctypes.data, faces.size, sources.ctypes.data, uv.ctypes.data, k
            )
        )
        return faces, sources, uv

    def __repr__(self) -> str:
        return brief(self, self.info)

    def plot(self, ax: Any = None) -> Any:
        """Draws the charts, each in a colour of its own, with matplotlib; pages stand side by side. Gives the
        axes, which are those that are given, or new ones.
        """
        return plot(self.corner_uv, self.face_charts, self.face_pages, ax)

    def __getstate__(self) -> dict[str, Any]:
        # What the library holds cannot be pickled: all that is asked of it is taken out.
        return {**vars(self), "_split": self.split()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)



def unwrap_memory_needed(
    vertices: int, faces: int, max_energy: float | None = None, **options: Unpack[RunOptions]
) -> int:
    """Bytes that unwrap() needs at its peak for a mesh of so many vertices and faces, which is included.

    An upper bound, up to twice too large. A bound on the energy, max_energy, takes much more; no other option
    does.

    >>> atlasfit.unwrap_memory_needed(500_000, 1_000_000) > 1e8
    True
    >>> atlasfit.unwrap_memory_needed(5_000, 10_000, 4.1) > 2 * atlasfit.unwrap_memory_needed(5_000, 10_000)
    True
    """
    chosen = options_with(_abi.atlasfit_unwrap_options(), max_energy=max_energy)
    bytes_needed = c_uint64()
    call = lib().atlasfit_unwrap_memory_needed
    run(lambda r: call(vertices, faces, byref(chosen), r, byref(bytes_needed)), options)
    return bytes_needed.value


def _stretch_of(preset: str | None) -> float | None:
    """The bound that a preset stands for; None stays None."""
    number = choice(preset, PRESETS, "preset")
    if number is None:
        return None
    of_preset = options_with(_abi.atlasfit_unwrap_options())
    check(lib().atlasfit_unwrap_options_set_preset(byref(of_preset), number))
    return float(of_preset.max_stretch)


def unwrap(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    face_groups: ArrayLike | None = None,
    face_polygons: ArrayLike | None = None,
    seam_edges: ArrayLike | None = None,
    corner_uv: ArrayLike | None = None,
    keep_uvs: bool = False,
    preset: Literal["few-seams", "balanced", "low-stretch"] | None = None,
    max_stretch: float | None = None,
    max_charts: int | None = None,
    page_size: int | tuple[int, int] | None = None,
    padding: int | None = None,
    pages: int | None = None,
    packer: Literal["shapes", "boxes"] | None = None,
    texels_per_unit: float | None = None,
    hard_edge_angle: float | None = None,
    max_energy: float | None = None,
    stack: Literal["none", "identical", "mirrored"] | None = None,
    straighten: Literal["off", "auto"] | None = None,
    seams_hidden: float | None = None,
    up: ArrayLike | None = None,
    seam_price: ArrayLike | None = None,
    occupied_uv: ArrayLike | None = None,
    **options: Unpack[RunOptions],
) -> Uv:
    """Lays out UVs: charts of low stretch that neither flip nor overlap, packed on square pages.

    vertices         (n, 3); float32 and float64 are not copied
    faces            (m, 3) vertex indices, counter-clockwise seen from outside; int32 and uint32 are not
                     copied
    face_groups      (m,) a group per face (material, for example): no chart spans two
    face_polygons    (m,) the polygon that each face was cut from, any numbers: faces of one polygon stay in
                     one chart
    seam_edges       (k, 2) edges that must be seams, as pairs of vertices
    corner_uv        (m, 3, 2) UVs that the mesh already has: their seams stay seams
    keep_uvs         whether the charts of corner_uv stay as they are: moved, turned, scaled to one density
                     and packed; what flips or overlaps in them is cut (default False)
    preset           what matters most, a name for a bound on the stretch: "few-seams" (1.3), also for meshes
                     of few faces; "balanced" (1.1, default); "low-stretch" (1.05)
    max_stretch      bound on the stretch max(s1, 1/s2) at the 95th percentile by area; more than 1. Smaller
                     gives more charts (default: that of the preset)
    max_charts       most charts: those that only the page's shape asks for go first, then max_stretch is
                     raised as far as that needs; 0 = any number (default)
    page_size        side of a page in texels, or width and height (default 1024)
    padding          free texels between charts and at the page's border (default 2)
    pages            most pages; 0 = one, or with texels_per_unit as many as that density needs (default)
    packer           "shapes": charts lie in each other's bays and holes (default); "boxes": faster, and
                     wastes more
    texels_per_unit  texels per unit of length on the surface; 0 = what fills the pages (default)
    hard_edge_angle  edges bent by more than this many degrees are seams; 180 = none for that reason (default)
    max_energy       instead of max_stretch a bound on the mean symmetric Dirichlet energy, more than 4
                     (isometry): each connected part becomes one chart that is cut open, with seams as short
                     as can be found. Slower, for up to some ten thousand faces; 0 = none (default)
    stack            parts of one shape get the same UVs, corner on corner: "identical", moved and turned
                     copies; "mirrored", mirror images too; "none" (default). info.stacked_parts tells how
                     many lie on others
    straighten       "auto": what a person would straighten is straight and parallel to the page's sides,
                     within the bound on the stretch: strips, tubes that are cut open and rims become
                     rectangles, long sides of other charts straight lines; "off" (default).
                     info.straightened_charts counts such charts, measure_uv(...).straightness says how much
                     of all outlines lies so
    seams_hidden     how much seams are to lie where the outside hardly sees them, 0 (default: as short as can
                     be) to 1
    up               (3,) the direction up: with seams_hidden nobody looks from below (default: they look
                     from all around)
    seam_price       (n,) what a seam costs per unit of length at each vertex: 1 as usual, less where seams
                     may be, more where not; only ratios count
    occupied_uv      (k, 3, 2) triangles in UVs of the first page that charts keep free of, with the padding:
                     for example those of faces that are not laid out anew
    options          see RunOptions: seed, threads, time_limit, memory_limit, progress, cancel

    >>> vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> uv = atlasfit.unwrap(vertices, faces, preset="few-seams")
    >>> uv.corner_uv.shape, uv.face_charts.shape
    ((4, 3, 2), (4,))

    Raises Error (Cancelled, TimedOut), or ValueError and TypeError for arrays of a wrong shape or type.
    """
    vertices, faces = positions(vertices, "vertices"), indices(faces, (-1, 3), "faces")
    m = len(faces)
    kept = None if corner_uv is None else corners(corner_uv, m)
    groups = None if face_groups is None else indices(face_groups, (m,), "face_groups")
    polygons = None if face_polygons is None else indices(face_polygons, (m,), "face_polygons")
    seams = None if seam_edges is None else indices(seam_edges, (-1, 2), "seam_edges")
    mesh = mesh_struct(vertices, faces, kept)
    prices = None if seam_price is None else numbers(seam_price, (len(vertices),), "seam_price")
    mesh.face_group, mesh.face_polygon = address(groups), address(polygons)
    mesh.seam_price = address(prices)
    taken = None if occupied_uv is None else uv_triangles(occupied_uv, "occupied_uv")
    mesh.occupied_uv, mesh.occupied_count = address(taken), 0 if taken is None else len(taken)
    mesh.seam_edges, mesh.seam_edge_count = address(seams), 0 if seams is None else len(seams)
    width, height = size_of_page(page_size)
    chosen = options_with(
        _abi.atlasfit_unwrap_options(),
        max_stretch=_stretch_of(preset) if max_stretch is None else max_stretch,
        max_charts=max_charts,
        page_width=width,
        page_height=height,
        padding=padding,
        pages=pages,
        packer=choice(packer, {"shapes": _abi.PACK_SHAPES, "boxes": _abi.PACK_BOXES}, "packer"),
        keep_uv_seams=kept is not None,
        keep_uvs=keep_uvs,
        texels_per_unit=texels_per_unit,
        hard_edge_angle=hard_edge_angle,
        max_energy=max_energy,
        stack=choice(stack, STACKS, "stack"),
        straighten=choice(straighten, STRAIGHTENINGS, "straighten"),
        seams_hidden=seams_hidden,
        up=None if up is None else tuple(numbers(up, (3,), "up", np.float64)),
    )
    uv = Handle("uv")
    run(lambda r: lib().atlasfit_unwrap(byref(mesh), byref(chosen), r, byref(uv.pointer)), options)
    info = _abi.atlasfit_uv_info()
    check(lib().atlasfit_uv_get_info(uv.pointer, byref(info)))
    return Uv(
        corner_uv=uv.copy("corners", (m, 3, 2), np.float32),
        face_charts=uv.copy("face_charts", (m,), np.uint32),
        face_pages=uv.copy("face_pages", (m,), np.uint32),
        info=UvInfo(**values(UvInfo, info), warnings=uv.warnings()),
        _split=uv,
    )
