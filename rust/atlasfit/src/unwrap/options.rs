//! What can be asked of the unwrapper, and the checks of it.

use super::preset::Preset;
use crate::error::{Error, Result};
use crate::geometry::{MOST_PAGES, TriMesh};
use crate::setters::setters;
use std::ops::RangeInclusive;

/// What the width and the height of a page may be, in texels.
pub const PAGE_TEXELS: RangeInclusive<u32> = 16..=65536;
/// `max_charts` raises the stretch bound no further than this.
pub const STRETCH_LIMIT: f64 = 8.0;

/// How charts are put on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Packer {
    /// By their shapes: charts lie in each other's bays and holes. The default.
    #[default]
    Shapes,
    /// By their bounding boxes, in rows: fastest, and wastes most.
    Boxes,
}

/// Which parts of the mesh share their place on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stack {
    /// None: each part has texels of its own. The default.
    #[default]
    None,
    /// Parts of one shape, moved and turned: their corners get the same UVs.
    Identical,
    /// These and mirror images, whose UVs then run the other way round.
    Mirrored,
}

/// Whether charts are laid straight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Straighten {
    /// They lie as they have least stretch. The default.
    #[default]
    Off,
    /// What a person would straighten is straight, and parallel to the page's sides: strips, tubes that are
    /// cut open and rims become rectangles, long sides of other charts straight lines, where the bound on the
    /// stretch allows it. Charts whose sides are mostly straight are turned in quarter turns only.
    Auto,
}

/// How to unwrap.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct UnwrapOptions {
    /// Bound on the stretch max(s1, 1/s2) at the 95th percentile by area, at one texel density; more than 1.
    /// Smaller gives more charts. Default that of [`Preset::Balanced`], 1.1.
    pub max_stretch: f64,
    /// Bound on the mean symmetric Dirichlet energy s1² + s2² + 1/s1² + 1/s2² by area, instead of
    /// `max_stretch`: more than 4, which is isometry; 4.1 is what OptCuts uses. Seams are as short as can be
    /// found within it: each connected part is one chart, cut open, where that comes out shorter than several
    /// charts. `None` = `max_stretch` counts.
    pub max_energy: Option<f64>,
    /// Most charts: those that only the shape of the page asks for go first, then `max_stretch` is raised as
    /// far as that needs (up to [`STRETCH_LIMIT`]). `None` = any number. More are still made where the
    /// topology or the constraints ask for them.
    pub max_charts: Option<usize>,
    /// Width and height of a page in texels, each in [`PAGE_TEXELS`]. Default 1024 by 1024.
    pub page_size: [u32; 2],
    /// Free texels between charts and at the page's border, at most an eighth of the page. Halved, and again,
    /// where charts would otherwise have less than 4 texels each on average; the layout says so. Default 2.
    pub padding_px: u32,
    /// Texels per user unit of length on the surface, positive; `None` = what fills the pages.
    pub texels_per_unit: Option<f64>,
    /// Most pages, at least 1. `None` = one page, or with `texels_per_unit` as many as that density needs.
    /// Where the density needs more pages than this it is lowered.
    pub pages: Option<u32>,
    /// Triangles in UVs of the first page that charts keep free of, with the padding: for example those of
    /// faces that are not laid out anew. Finite, any number; what lies outside the page does not count.
    /// Charts are then put by their shapes, whatever `packer` says. `None` = the page is free.
    pub occupied: Option<Vec<[[f32; 2]; 3]>>,
    /// How charts are put on the page.
    pub packer: Packer,
    /// Which parts lie on each other on the page, corner on corner. A part is what hangs together after the
    /// cuts that the options ask for; parts are of one shape where their meshes are alike triangle by
    /// triangle and lengths differ by a ten thousandth of the part's size at the most. Parts of two groups
    /// are not stacked. Not with [`keep_uvs`](Self::keep_uvs).
    pub stack: Stack,
    /// Whether charts are laid straight. Not with [`keep_uvs`](Self::keep_uvs).
    pub straighten: Straighten,
    /// Groups per triangle (materials, for example): no chart spans two. One entry per triangle.
    pub face_group: Option<Vec<u32>>,
    /// How much seams are to lie where the outside hardly sees them, in [0, 1]: 0 = as short as can be, 1 =
    /// a seam costs the square of the share of it that is seen, as
    /// [`measure::uv::seams_seen`](crate::measure::uv::seams_seen) takes it.
    /// Not with [`keep_uvs`](Self::keep_uvs).
    pub seams_hidden: f64,
    /// The direction up, of any length but 0: where `seams_hidden` counts, nobody looks from below. `None` =
    /// they look from all around.
    pub up: Option<[f64; 3]>,
    /// What a seam costs per unit of its length, per vertex (an edge costs the mean of its ends): 1 as usual,
    /// less where seams may be, more where not; only ratios count. Finite, not negative. One entry per
    /// vertex.
    /// Not with [`keep_uvs`](Self::keep_uvs).
    pub seam_price: Option<Vec<f32>>,
    /// The polygon that each triangle is cut from: triangles of one polygon stay in one chart, whose UVs are
    /// then those of the polygon. One entry per triangle; any numbers.
    pub face_polygon: Option<Vec<u32>>,
    /// Edges that must be seams, as pairs of vertices; a pair that is no edge does nothing.
    pub seam_edges: Option<Vec<[u32; 2]>>,
    /// Whether the seams of the UVs that the mesh already has stay seams.
    pub keep_uv_seams: bool,
    /// Whether the charts are those of the UVs that the mesh already has, which it must have then: they are
    /// moved, turned and scaled to one density, and packed. What flips or overlaps in them is cut. Charts
    /// stay as they are whatever their stretch; what else cuts charts still does.
    pub keep_uvs: bool,
    /// Edges that are bent by more than this are seams: degrees in [0, 180]. `None` = none are for that
    /// reason.
    pub hard_edge_angle: Option<f64>,
}

setters! {
    UnwrapOptions {
        with_max_stretch: max_stretch: f64,
        with_max_energy: max_energy: Option<f64>,
        with_max_charts: max_charts: Option<usize>,
        with_page_size: page_size: [u32; 2],
        with_padding_px: padding_px: u32,
        with_texels_per_unit: texels_per_unit: Option<f64>,
        with_pages: pages: Option<u32>,
        with_occupied: occupied: Option<Vec<[[f32; 2]; 3]>>,
        with_packer: packer: Packer,
        with_stack: stack: Stack,
        with_straighten: straighten: Straighten,
        with_face_group: face_group: Option<Vec<u32>>,
        with_seams_hidden: seams_hidden: f64,
        with_up: up: Option<[f64; 3]>,
        with_seam_price: seam_price: Option<Vec<f32>>,
        with_face_polygon: face_polygon: Option<Vec<u32>>,
        with_seam_edges: seam_edges: Option<Vec<[u32; 2]>>,
        with_keep_uv_seams: keep_uv_seams: bool,
        with_keep_uvs: keep_uvs: bool,
        with_hard_edge_angle: hard_edge_angle: Option<f64>,
    }
}

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self {
            max_stretch: Preset::default().max_stretch(),
            max_energy: None,
            max_charts: None,
            page_size: [1024; 2],
            padding_px: 2,
            texels_per_unit: None,
            pages: None,
            occupied: None,
            packer: Packer::Shapes,
            stack: Stack::None,
            straighten: Straighten::Off,
            face_group: None,
            seams_hidden: 0.0,
            up: None,
            seam_price: None,
            face_polygon: None,
            seam_edges: None,
            keep_uv_seams: false,
            keep_uvs: false,
            hard_edge_angle: None,
        }
    }
}

impl UnwrapOptions {
    /// Sets the numbers that the preset stands for; set after it, a number of one's own counts.
    #[must_use]
    pub fn with_preset(self, preset: Preset) -> Self {
        self.with_max_stretch(preset.max_stretch())
    }

    /// Most pages that the charts may go on.
    pub(crate) fn most_pages(&self) -> u32 {
        self.pages.unwrap_or(if self.texels_per_unit.is_some() { MOST_PAGES } else { 1 })
    }

    /// Whether the charts are scaled to fill one page.
    pub(crate) fn fills_one_page(&self) -> bool {
        self.texels_per_unit.is_none() && self.most_pages() == 1
    }

    /// Checks the ranges, and the lengths of what is given per triangle and per vertex.
    pub(crate) fn validate(&self, mesh: &TriMesh) -> Result<()> {
        self.validate_charts(mesh)?;
        self.validate_pages()?;
        self.validate_prices(mesh)?;
        self.validate_constraints(mesh)
    }

    /// What is asked of the charts.
    fn validate_charts(&self, mesh: &TriMesh) -> Result<()> {
        if !(self.max_stretch > 1.0 && self.max_stretch.is_finite()) {
            return Err(Error::invalid(
                format!("max_stretch is {}", self.max_stretch),
                "Give a finite number above 1, for example 1.1",
            ));
        }
        if let Some(e) = self.max_energy
            && !(e > 4.0 && e.is_finite())
        {
            return Err(Error::invalid(
                format!("max_energy is {e}"),
                "Give a finite number above 4 (isometry), for example 4.1, or none",
            ));
        }
        if self.max_charts == Some(0) {
            return Err(Error::invalid("max_charts is 0", "Give at least 1, or none"));
        }
        let uvs = mesh.corner_uv.as_deref().unwrap_or_default();
        let whole = uvs.len() == mesh.triangles.len();
        if self.keep_uvs && !(whole && uvs.iter().flatten().flatten().all(|x| x.is_finite())) {
            return Err(Error::invalid(
                "keep_uvs is asked for, but the mesh has no UVs, or some that are not finite",
                "Give finite UVs for each corner, or leave out keep_uvs",
            ));
        }
        let changes = [
            ("stack", self.stack != Stack::None),
            ("straighten", self.straighten != Straighten::Off),
            ("seams_hidden", self.seams_hidden != 0.0),
            ("seam_price", self.seam_price.is_some()),
        ];
        if self.keep_uvs
            && let Some((name, _)) = changes.iter().find(|c| c.1)
        {
            return Err(Error::invalid(
                format!("{name} is asked for with keep_uvs, whose charts stay as they are"),
                "Leave out one of the two",
            ));
        }
        Ok(())
    }

    /// What is asked of the pages.
    fn validate_pages(&self) -> Result<()> {
        let [width, height] = self.page_size;
        if self.page_size.iter().any(|s| !PAGE_TEXELS.contains(s)) {
            return Err(Error::invalid(
                format!("page_size is {width} by {height}"),
                format!("Give {} to {} texels", PAGE_TEXELS.start(), PAGE_TEXELS.end()),
            ));
        }
        if self.padding_px > width.min(height) / 8 {
            return Err(Error::invalid(
                format!("padding_px is {} on a page of {width} by {height}", self.padding_px),
                "Give at most an eighth of the page",
            ));
        }
        if let Some(t) = self.texels_per_unit
            && !(t > 0.0 && t.is_finite())
        {
            return Err(Error::invalid(format!("texels_per_unit is {t}"), "Give a positive number, or none"));
        }
        let occupied = self.occupied.iter().flatten();
        if let Some(i) = occupied.flatten().position(|uv| !uv.iter().all(|x| x.is_finite())) {
            return Err(Error::invalid(
                format!("corner {} of occupied triangle {} is not finite", i % 3, i / 3),
                "Leave such triangles out",
            ));
        }
        if let Some(n) = self.pages
            && !(1..=MOST_PAGES).contains(&n)
        {
            return Err(Error::invalid(format!("pages is {n}"), format!("Give 1 to {MOST_PAGES}, or none")));
        }
        Ok(())
    }

    /// What seams cost.
    fn validate_prices(&self, mesh: &TriMesh) -> Result<()> {
        if !(0.0..=1.0).contains(&self.seams_hidden) {
            return Err(Error::invalid(format!("seams_hidden is {}", self.seams_hidden), "Give 0 to 1"));
        }
        if let Some(up) = self.up
            && !(up.iter().all(|x| x.is_finite()) && up.iter().any(|&x| x != 0.0))
        {
            let [x, y, z] = up;
            return Err(Error::invalid(
                format!("up is ({x}, {y}, {z})"),
                "Give three finite numbers, not all 0, for example 0, 0, 1",
            ));
        }
        let Some(price) = &self.seam_price else { return Ok(()) };
        if price.len() != mesh.positions.len() {
            return Err(Error::invalid(
                format!("seam_price has {} entries for {} vertices", price.len(), mesh.positions.len()),
                "Give one entry per vertex",
            ));
        }
        if let Some(i) = price.iter().position(|p| !(*p >= 0.0 && p.is_finite())) {
            return Err(Error::invalid(
                format!("seam_price of vertex {i} is {}", price[i]),
                "Give finite numbers that are not negative",
            ));
        }
        Ok(())
    }

    /// What must be seams, and what must not.
    fn validate_constraints(&self, mesh: &TriMesh) -> Result<()> {
        if let Some(a) = self.hard_edge_angle
            && !(0.0..=180.0).contains(&a)
        {
            return Err(Error::invalid(format!("hard_edge_angle is {a}"), "Give 0 to 180 degrees, or none"));
        }
        let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
        for (i, edge) in self.seam_edges.iter().flatten().enumerate() {
            if let Some(&bad) = edge.iter().find(|&&v| v as usize >= vertices) {
                return Err(Error::IndexOutOfRange {
                    what: format!("seam edge {i}"),
                    value: u64::from(bad),
                    limit: vertices as u64,
                    of: "vertices",
                });
            }
        }
        for (name, column) in [("face_group", &self.face_group), ("face_polygon", &self.face_polygon)] {
            if let Some(c) = column
                && c.len() != faces
            {
                return Err(Error::invalid(
                    format!("{name} has {} entries for {faces} triangles", c.len()),
                    "Give one entry per triangle",
                ));
            }
        }
        if self.keep_uv_seams && mesh.corner_uv.as_ref().is_some_and(|uv| uv.len() != faces) {
            return Err(Error::invalid(
                "corner_uv of the mesh has another length than its triangles",
                "Give UVs for every triangle, or do not ask for their seams to be kept",
            ));
        }
        Ok(())
    }
}
