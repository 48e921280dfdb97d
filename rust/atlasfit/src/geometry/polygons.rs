//! Faces of any number of corners as the triangles that the library works on, and what belongs to faces and
//! corners carried from one to the other.
//!
//! In: the vertices of each face's corners. Out: triangles, and the face and the corners that each has.

use super::triangulate::{MOST_TESTS, triangulate};
use crate::error::{Error, Result};
use crate::run::Context;

/// Faces and the triangles that they are cut into: a face of n corners gives n - 2. Corners are numbered on
/// from face to face. Faces of fewer than three corners, and those that are left out, give none.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Polygons {
    /// The vertex of each corner.
    pub corners: Vec<u32>,
    /// Where the corners of each face begin, and one more: their number.
    pub offsets: Vec<u32>,
    /// Vertices of the triangles, in the order of their faces.
    pub triangles: Vec<[u32; 3]>,
    /// The face of each triangle.
    pub face_of: Vec<u32>,
    /// The three corners of each triangle.
    pub corners_of: Vec<[u32; 3]>,
}

impl Polygons {
    /// Cuts faces into triangles that do not fold. `offsets` says where the corners of each face begin, and
    /// at last how many there are; faces whose entry in `left_out` is true give no triangle.
    ///
    /// ```
    /// use atlasfit::{Run, geometry::Polygons};
    /// let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]];
    /// let cut = Run::default().execute(|ctx| {
    ///     Polygons::new(&square, vec![0, 1, 2, 3, 2, 4, 3], vec![0, 4, 7], None, ctx)
    /// })?;
    /// assert_eq!(cut.triangles, [[0, 1, 2], [0, 2, 3], [2, 4, 3]]);
    /// assert_eq!((cut.face_of.as_slice(), cut.corners_of[2]), ([0, 0, 1].as_slice(), [4, 5, 6]));
    /// # Ok::<(), atlasfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::IndexOutOfRange`] for a corner that names no vertex, [`Error::InvalidArgument`] for offsets
    /// that fall or do not end at the number of corners; those of [`Context::check`].
    pub fn new(
        positions: &[[f64; 3]],
        corners: Vec<u32>,
        offsets: Vec<u32>,
        left_out: Option<&[bool]>,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        check(positions.len(), &corners, &offsets)?;
        let mut out = Self { corners, offsets, ..Self::default() };
        let (mut tests, mut cut) = (MOST_TESTS, Vec::new());
        for (f, ends) in out.offsets.windows(2).enumerate() {
            ctx.check_at(f)?;
            let own = &out.corners[ends[0] as usize..ends[1] as usize];
            if left_out.is_some_and(|l| l[f]) {
                continue;
            }
            triangulate(positions, own, &mut tests, &mut cut);
            for t in &cut {
                out.triangles.push(t.map(|k| own[k as usize]));
                out.corners_of.push(t.map(|k| ends[0] + k));
                out.face_of.push(f as u32);
            }
        }
        Ok(out)
    }

    /// How many faces there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no face.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A column of the faces as one of the triangles.
    #[must_use]
    pub fn of_triangles<T: Copy>(&self, of_faces: &[T]) -> Vec<T> {
        self.face_of.iter().map(|&f| of_faces[f as usize]).collect()
    }

    /// A column of the corners as one of the triangles' corners.
    #[must_use]
    pub fn of_triangle_corners<T: Copy>(&self, of_corners: &[T]) -> Vec<[T; 3]> {
        self.corners_of.iter().map(|t| t.map(|c| of_corners[c as usize])).collect()
    }

    /// A column of the triangles as one of the faces: of each face the largest; `none` where it has no
    /// triangle.
    #[must_use]
    pub fn largest_of_faces(&self, of_triangles: &[f32], none: f32) -> Vec<f32> {
        let mut out = vec![none; self.len()];
        let mut last = u32::MAX;
        for (&f, &value) in self.face_of.iter().zip(of_triangles) {
            let at = &mut out[f as usize];
            *at = if f == last { at.max(value) } else { value };
            last = f;
        }
        out
    }
}

/// Checks indices and offsets.
fn check(vertices: usize, corners: &[u32], offsets: &[u32]) -> Result<()> {
    let advice =
        "They start at 0, never fall, and end at the number of corners, one more than there are faces";
    if offsets.first() != Some(&0) || offsets.last().map(|&n| n as usize) != Some(corners.len()) {
        return Err(Error::invalid("the offsets of the faces have the wrong ends", advice));
    }
    if let Some(f) = offsets.windows(2).position(|w| w[0] > w[1]) {
        return Err(Error::invalid(format!("the offsets of the faces fall after face {f}"), advice));
    }
    if let Some(c) = corners.iter().position(|&v| v as usize >= vertices) {
        return Err(Error::IndexOutOfRange {
            what: format!("corner {} of face {}", c, offsets.partition_point(|&o| o as usize <= c) - 1),
            value: u64::from(corners[c]),
            limit: vertices as u64,
            of: "vertices",
        });
    }
    Ok(())
}
