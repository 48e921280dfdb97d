//! Where a mesh's UVs lie: its pages side by side on one unit square.
//!
//! In: a mesh with texture coordinates per corner, and the pages that they lie on. Out: UVs in f64 on one
//! square.

use crate::error::{Error, Result};
use crate::geometry::{MOST_PAGES, TriMesh};

/// The UVs of the corners of one face.
pub(super) type FaceUv = [[f64; 2]; 3];

/// Corners whose UVs differ by less than this are one point of a chart. In sides of a page, about ten times
/// the rounding of f32 below 1 (6e-8): writers of text files keep six decimals.
pub(super) const SAME_UV: f64 = 1e-6;

/// The pages that UVs lie on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pages<'a> {
    /// Page of each face, below [`MOST_PAGES`]; `None`: all are on one.
    pub of_face: Option<&'a [u32]>,
    /// Width and height of a page, positive, in any unit: only their ratio counts.
    pub size: [f64; 2],
}

impl Default for Pages<'_> {
    /// One square page.
    fn default() -> Self {
        Self { of_face: None, size: [1.0; 2] }
    }
}

/// UVs with their pages side by side on one square.
pub(super) struct LaidOut {
    /// UVs of each face, in sides of the square.
    pub uvs: Vec<FaceUv>,
    /// The share of the square that is page, in (0, 1].
    pub page_share: f64,
}

/// Lays the mesh's pages side by side on one square. One factor scales all of them, so that shapes stay what
/// they are.
pub(super) fn laid_out(mesh: &TriMesh, pages: &Pages<'_>) -> Result<LaidOut> {
    let corners = corners(mesh)?;
    let [width, height] = pages.size;
    if !pages.size.iter().all(|x| *x > 0.0 && x.is_finite()) {
        return Err(Error::invalid(format!("a page is {width} by {height}"), "Give a positive size"));
    }
    if pages.of_face.is_some_and(|p| p.len() != corners.len()) {
        return Err(Error::invalid("there is not one page per face", "Give the page of each face"));
    }
    let page = |f: usize| pages.of_face.map_or(0, |p| p[f]);
    let last = (0..corners.len()).map(page).max().unwrap_or(0);
    if last >= MOST_PAGES {
        return Err(Error::IndexOutOfRange {
            what: "the page of a face".into(),
            value: u64::from(last),
            limit: u64::from(MOST_PAGES),
            of: "pages",
        });
    }
    let count = last + 1;
    let columns = (1..=count).find(|c| c * c >= count).unwrap_or(1);
    let side = (f64::from(columns) * width).max(f64::from(count.div_ceil(columns)) * height);
    let (wide, high) = (width / side, height / side);
    let place = |(f, uv): (usize, &[[f32; 2]; 3])| {
        let at = [page(f) % columns, page(f) / columns].map(f64::from);
        uv.map(|p| [(at[0] + f64::from(p[0])) * wide, (at[1] + f64::from(p[1])) * high])
    };
    let uvs = corners.iter().enumerate().map(place).collect();
    Ok(LaidOut { uvs, page_share: f64::from(count) * wide * high })
}

/// The mesh's UVs as they are stored, checked: three for each face, and at least one face.
pub(super) fn corners(mesh: &TriMesh) -> Result<&[[[f32; 2]; 3]]> {
    mesh.validate()?;
    let m = mesh.triangles.len();
    match &mesh.corner_uv {
        Some(uv) if uv.len() == m && m > 0 => Ok(uv),
        Some(uv) if m > 0 => Err(Error::invalid(
            format!("{} corner UVs for {m} faces", uv.len()),
            "Give three UVs for each face",
        )),
        _ => Err(Error::empty(
            format!("a mesh of {m} faces without texture coordinates"),
            "Unwrap the mesh first",
        )),
    }
}

/// Share of the pages that lies under faces, in [0, 1], by their areas: what
/// [`UvQuality::coverage`](super::UvQuality::coverage) counts in texels. It is exact where no faces overlap.
///
/// `corner_uv` has three UVs for each face, in sides of its page; `pages` is the number of pages, 0 counts as
/// 1.
///
/// ```
/// let half_a_page = [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]];
/// assert_eq!(atlasfit::measure::uv::coverage(&half_a_page, 1), 0.5);
/// ```
#[must_use]
pub fn coverage(corner_uv: &[[[f32; 2]; 3]], pages: usize) -> f64 {
    let area = |c: &[[f32; 2]; 3]| signed_area(&c.map(|p| p.map(f64::from))).abs();
    corner_uv.iter().map(area).sum::<f64>() / pages.max(1) as f64
}

/// Area of a face in the texture: positive for corners that run counter-clockwise.
pub(super) fn signed_area(c: &FaceUv) -> f64 {
    0.5 * ((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]))
}

/// Whether all UVs of a face are finite.
pub(super) fn is_finite(c: &FaceUv) -> bool {
    c.iter().flatten().all(|x| x.is_finite())
}
