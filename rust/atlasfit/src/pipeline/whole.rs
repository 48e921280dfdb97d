//! What is known of a whole scan, as data: its frame, and what a tile of it must know.

use crate::numeric::vec3::Vec3;
use crate::partition::PatchSize;

/// The normalised frame in the user's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin, in the user's frame.
    pub origin: Vec3,
    /// Length of the unit, in the user's.
    pub scale: f64,
}

impl Frame {
    /// A place of the normalised frame in the user's.
    #[must_use]
    pub fn to_user(&self, p: Vec3) -> Vec3 {
        p * self.scale + self.origin
    }

    /// A place of the user's frame in the normalised one.
    #[must_use]
    pub fn of_user(&self, p: Vec3) -> Vec3 {
        (p - self.origin).map(|x| x / self.scale)
    }
}

/// What is known of a whole scan. Lengths are in the normalised frame, unless another unit is named.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Survey {
    /// Origin of the frame, in the user's.
    pub origin: [f64; 3],
    /// Length of the frame's unit, in the user's.
    pub scale: f64,
    /// Median spacing of the points.
    pub spacing: f64,
    /// A point farther than this from its neighbours is stray, unless it lies on a plane with them.
    pub lonely: f64,
    /// Standard deviation of the noise that tubes are looked for with.
    pub tube_noise: f64,
    /// Standard deviation of the noise that charts are fitted with.
    pub noise: f64,
    /// Side of a voxel at a detail of 1.
    pub voxel: f64,
    /// Points of the whole scan.
    pub points: usize,
}

impl Survey {
    pub(super) fn frame(&self) -> Frame {
        Frame { origin: Vec3(self.origin), scale: self.scale }
    }

    /// A place of the normalised frame in the user's.
    #[must_use]
    pub fn to_user(&self, p: [f64; 3]) -> [f64; 3] {
        self.frame().to_user(Vec3(p)).0
    }

    /// A place of the user's frame in the normalised one.
    #[must_use]
    pub fn to_frame(&self, p: [f64; 3]) -> [f64; 3] {
        self.frame().of_user(Vec3(p)).0
    }

    /// How far decisions about the charts of a place reach, in the user's unit: a tile is computed with the
    /// points about it up to this distance. Seeds keep their distance from each other, patches take points up
    /// to their radius, charts near another sheet are cut again. Source: measured (docs/scale.md): with four
    /// radii of a patch all that is not the scan's own border comes out the same, with two it does not.
    #[must_use]
    pub fn halo(&self) -> f64 {
        const RADII: f64 = 5.0;
        RADII * PatchSize::default().reach(self.spacing, self.noise) * self.scale
    }
}
