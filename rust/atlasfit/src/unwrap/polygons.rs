//! UVs of triangles as those of the polygons that they were cut from.
//!
//! In: a [`UvLayout`] of the triangles. Out: a UV per corner of a polygon, a chart and a page per polygon.

use super::layout::UvLayout;
use super::split::{SplitCorners, split_corners};
use crate::error::{Error, Result};
use crate::geometry::Polygons;
use crate::run::Context;

/// UVs of polygons, in their order.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct PolygonLayout {
    /// UV per corner, in [0, 1], v up; 0, 0 for the corners of polygons without a triangle.
    pub corner_uv: Vec<[f32; 2]>,
    /// Chart per polygon; `u32::MAX` where it has no triangle.
    pub face_chart: Vec<u32>,
    /// Page per polygon; `u32::MAX` where it has no triangle.
    pub face_page: Vec<u32>,
    /// The polygons, in order, whose triangles do not agree on the UV of some corner, because they do not lie
    /// flat and were cut between charts. Their corners have the UVs of their first triangles.
    pub torn: Vec<u32>,
}

impl PolygonLayout {
    /// The UVs of `cut`'s polygons from those of its triangles.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for a layout of other triangles; those of [`Context::check`].
    ///
    /// ```
    /// use atlasfit::geometry::{Polygons, TriMesh};
    /// use atlasfit::{Run, unwrap::{PolygonLayout, UnwrapOptions, unwrap}};
    /// let at = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// let uvs = Run::default().execute(|ctx| {
    ///     let cut = Polygons::new(&at, vec![0, 1, 2, 3], vec![0, 4], None, ctx)?;
    ///     let options = UnwrapOptions::default().with_face_polygon(Some(cut.face_of.clone()));
    ///     let mesh = TriMesh::new(at.clone(), cut.triangles.clone());
    ///     PolygonLayout::new(&cut, &unwrap(&mesh, &options, ctx)?, ctx)
    /// })?;
    /// assert_eq!((uvs.corner_uv.len(), uvs.face_chart, uvs.torn), (4, vec![0], vec![]));
    /// # Ok::<(), atlasfit::Error>(())
    /// ```
    pub fn new(cut: &Polygons, layout: &UvLayout, ctx: &Context<'_>) -> Result<Self> {
        if cut.triangles.len() != layout.corner_uv.len() {
            return Err(Error::invalid(
                format!("UVs of {} triangles for {}", layout.corner_uv.len(), cut.triangles.len()),
                "Give the layout of the triangles that the polygons were cut into",
            ));
        }
        let mut out = Self {
            corner_uv: vec![[0.0; 2]; cut.corners.len()],
            face_chart: vec![u32::MAX; cut.len()],
            face_page: vec![u32::MAX; cut.len()],
            torn: Vec::new(),
        };
        let mut known = vec![false; cut.corners.len()];
        for (t, (&f, corners)) in cut.face_of.iter().zip(&cut.corners_of).enumerate() {
            ctx.check_at(t)?;
            let chart = &mut out.face_chart[f as usize];
            if *chart == u32::MAX {
                *chart = layout.face_chart[t];
                out.face_page[f as usize] = layout.face_page[t];
            }
            let mut agrees = *chart == layout.face_chart[t];
            for (&c, uv) in corners.iter().zip(&layout.corner_uv[t]) {
                let c = c as usize;
                if !std::mem::replace(&mut known[c], true) {
                    out.corner_uv[c] = *uv;
                }
                agrees &= out.corner_uv[c] == *uv;
            }
            if !agrees && out.torn.last() != Some(&f) {
                out.torn.push(f);
            }
        }
        Ok(out)
    }

    /// The polygons with one vertex per pair of vertex and UV.
    ///
    /// # Errors
    /// Those of [`Context::check`].
    pub fn split(&self, cut: &Polygons, vertices: usize, ctx: &Context<'_>) -> Result<SplitCorners> {
        split_corners(vertices, &cut.corners, &self.corner_uv, ctx)
    }
}
