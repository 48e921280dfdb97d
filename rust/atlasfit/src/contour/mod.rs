//! One stitched surface from the atlas.
//!
//! In: oriented charts. Out: a triangle mesh: one surface, boundary only where the scan has one.
//! The charts are blended to one signed distance field in a thin band of voxels, which is contoured; a chart takes part
//! only where it has data. Nothing is assumed of the whole: no inside and outside, no closedness, no orientability.

pub mod clean;
pub mod field;
pub mod holes;
pub mod surface;
