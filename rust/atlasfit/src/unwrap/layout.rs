//! UVs as they are given out.
//!
//! In: charts and their placements. Out: a [`UvLayout`] in the order of the mesh.

use super::checked::Checked;
use super::split::SplitMesh;
use super::stack::StackedFace;
use super::surface::{NONE, Surface};
use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::run::Context;

/// UVs of a mesh, in the order of its triangles.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct UvLayout {
    /// UV per corner of every triangle, in [0, 1], v up.
    pub corner_uv: Vec<[[f32; 2]; 3]>,
    /// Chart per triangle: less than `charts`.
    pub face_chart: Vec<u32>,
    /// Page per triangle: less than `pages`.
    pub face_page: Vec<u32>,
    /// Number of charts.
    pub charts: usize,
    /// Number of pages.
    pub pages: usize,
    /// Width of a page in texels.
    pub width: u32,
    /// Height of a page in texels.
    pub height: u32,
    /// Free texels between charts and at a page's border: the padding asked for, or less where with that
    /// charts would have less than 4 texels each on average. Rounding takes up to a hundredth of a texel per
    /// 1024 texels of the page.
    pub padding_px: u32,
    /// Texels per user unit of length on the surface.
    pub texels_per_unit: f64,
    /// The stretch bound that was held: `max_stretch`, or more where `max_charts` asked for it.
    pub stretch_bound: f64,
    /// Share of the area stretched beyond the bound: 0 to 1.
    pub over_stretched: f64,
    /// Triangles of zero area or with repeated or non-finite vertices; they got small valid UV triangles.
    pub degenerate_faces: usize,
    /// Triangles that repeat the corners of an earlier one; they got UVs of their own.
    pub duplicate_faces: usize,
    /// Edges cut because more than two triangles, or two of clashing orientation, meet there.
    pub non_manifold_edges: usize,
    /// Vertices at open edges that lie exactly where another one does and were taken for it, for the layout
    /// only: a mesh without shared vertices hangs together in its UVs.
    pub welded_vertices: usize,
    /// Parts that lie on another one of their shape: see [`Stack`](super::Stack).
    pub stacked_parts: usize,
    /// Charts whose sides are straight and parallel to the page's: see [`Straighten`](super::Straighten).
    pub straightened_charts: usize,
    /// Charts that had to be cut further to stay free of flips and overlaps.
    pub repaired_charts: usize,
    /// Polygons that could not stay in one piece because they do not lie flat.
    pub split_polygons: usize,
    /// What the user should hear: the padding or the density was lowered, charts have hardly any texels.
    pub warnings: Vec<String>,
}

impl UvLayout {
    /// The UVs with the pages in one row: page p lies at u + p, as files without pages hold them.
    ///
    /// ```
    /// use atlasfit::unwrap::UvLayout;
    /// let mut layout = UvLayout::default();
    /// layout.corner_uv = vec![[[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]; 2];
    /// layout.face_page = vec![0, 1];
    /// assert_eq!(layout.side_by_side()[1], [[1.0, 0.0], [1.5, 0.0], [1.0, 0.5]]);
    /// ```
    #[must_use]
    pub fn side_by_side(&self) -> Vec<[[f32; 2]; 3]> {
        let on = |(uv, &page): (&[[f32; 2]; 3], &u32)| uv.map(|[u, v]| [u + page as f32, v]);
        self.corner_uv.iter().zip(&self.face_page).map(on).collect()
    }

    /// The mesh that was unwrapped with one vertex per pair of vertex and UV.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for a mesh of another number of triangles; those of
    /// [`TriMesh::validate`] and [`Context::check`].
    ///
    /// ```
    /// use atlasfit::{Run, geometry::TriMesh, unwrap::{UnwrapOptions, unwrap}};
    /// let mesh = TriMesh::new(
    ///     vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ///     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    /// );
    /// let split = Run::default()
    ///     .execute(|ctx| unwrap(&mesh, &UnwrapOptions::default(), ctx)?.split(&mesh, ctx))?;
    /// assert!(split.triangles.len() == 4 && split.source.len() > 4);
    /// # Ok::<(), atlasfit::Error>(())
    /// ```
    pub fn split(&self, mesh: &TriMesh, ctx: &Context<'_>) -> Result<SplitMesh> {
        mesh.validate()?;
        if mesh.triangles.len() != self.corner_uv.len() {
            return Err(Error::invalid(
                format!("{} corner UVs for {} triangles", self.corner_uv.len(), mesh.triangles.len()),
                "Give the mesh that was unwrapped",
            ));
        }
        SplitMesh::new(mesh.positions.len(), &mesh.triangles, &self.corner_uv, ctx)
    }
}

/// What each face gets.
struct Faces {
    uv: Vec<[[f32; 2]; 3]>,
    chart: Vec<u32>,
    page: Vec<u32>,
}

/// The layout of packed charts; `copies` take their UVs from other faces, `known` holds what was decided
/// before.
pub(crate) fn layout(
    s: &Surface,
    checked: &Checked,
    copies: &[StackedFace],
    polygon: Option<&[u32]>,
    known: UvLayout,
    ctx: &Context<'_>,
) -> Result<UvLayout> {
    let list = &checked.charts;
    let m = s.faces();
    let mut faces = Faces { uv: vec![[[0f32; 2]; 3]; m], chart: vec![NONE; m], page: vec![0; m] };
    for (id, (c, p)) in list.iter().zip(&checked.packed.placements).enumerate() {
        let at = p.positions(&c.uv);
        for (i, (&f, t)) in c.faces.iter().zip(&c.tris).enumerate() {
            ctx.check_at(i)?;
            faces.chart[f as usize] = id as u32;
            faces.page[f as usize] = p.page;
            faces.uv[f as usize] = t.map(|v| at[v as usize]);
        }
    }
    // Faces without a shape share a point inside the first chart's first face.
    for f in 0..m {
        ctx.check_at(f)?;
        if faces.chart[f] == NONE {
            let home = list.first().map_or(0, |c| c.faces[0] as usize);
            faces.chart[f] = faces.chart[home];
            faces.page[f] = faces.page[home];
            faces.uv[f] = [faces.uv[home][0]; 3];
        }
    }
    for (i, copy) in copies.iter().enumerate() {
        ctx.check_at(i)?;
        let (to, of) = (copy.face as usize, copy.of as usize);
        faces.uv[to] = copy.taken(faces.uv[of]);
        faces.chart[to] = faces.chart[of];
        faces.page[to] = faces.page[of];
    }
    let mut split_polygons = 0;
    let mut first = 0;
    for (i, run) in polygon.unwrap_or_default().chunk_by(|a, b| a == b).enumerate() {
        ctx.check_at(i)?;
        let own = first..first + run.len();
        first = own.end;
        split_polygons += usize::from(run.len() > 1 && !rejoin(s, own, &mut faces));
    }
    Ok(UvLayout {
        corner_uv: faces.uv,
        face_chart: faces.chart,
        charts: list.len(),
        pages: faces.page.iter().map(|&p| p as usize + 1).max().unwrap_or(1),
        face_page: faces.page,
        over_stretched: list.iter().map(|c| c.over).sum::<f64>(),
        degenerate_faces: s.degenerate,
        duplicate_faces: s.duplicate,
        non_manifold_edges: s.non_manifold,
        welded_vertices: s.welded,
        split_polygons,
        ..known
    })
}

/// Gives the faces of a polygon that have no shape the UVs of the others' corners. Returns whether all its
/// faces then lie in one chart and agree on the UVs of its corners.
fn rejoin(s: &Surface, own: std::ops::Range<usize>, faces: &mut Faces) -> bool {
    let Faces { uv, chart, page } = faces;
    let Some(home) = own.clone().find(|&f| s.usable[f]) else { return true };
    let corner = |uv: &[[[f32; 2]; 3]], v: u32| {
        (own.clone().filter(|&f| s.usable[f] && chart[f] == chart[home]))
            .find_map(|f| (0..3).find(|&k| s.tri[f][k] == v).map(|k| uv[f][k]))
    };
    let mut known = Vec::new();
    for f in own.clone() {
        let at = s.tri[f].map(|v| corner(uv, v));
        match at {
            [Some(a), Some(b), Some(c)] => known.push([a, b, c]),
            _ => return false,
        }
    }
    for (f, at) in own.clone().zip(known) {
        if s.usable[f] && (chart[f] != chart[home] || uv[f] != at) {
            return false;
        }
        uv[f] = at;
    }
    own.for_each(|f| (chart[f], page[f]) = (chart[home], page[home]));
    true
}
