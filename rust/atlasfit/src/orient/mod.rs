//! Which way each chart faces, and where that is impossible (one-sided surfaces).
//!
//! In: charts and the points that they share. Out: a sign per chart, and the relations that contradict the
//! signs (after Hoppe et al. 1992, with charts in place of points: a chart's normal is far better known than
//! a point's).

pub(crate) mod constants;
mod opposing;
mod relations;
mod signs;

pub(crate) use opposing::opposing_sheets;
pub(crate) use relations::relations;
pub(crate) use signs::{face, orient};
