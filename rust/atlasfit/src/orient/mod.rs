//! Which way each chart faces, and where that is impossible (one-sided surfaces).
//!
//! In: charts and the points that they share. Out: a sign per chart, and the relations that contradict the
//! signs (after Hoppe et al. 1992, with charts in place of points: a chart's normal is far better known than
//! a point's). Where the scan says which way it faces, or one scanner saw all of it, or several from
//! within, the atlas faces that way; ground faces up.

mod above;
mod beside;
mod centers;
mod connected;
pub(crate) mod constants;
mod enclose;
mod hidden;
mod opposing;
mod relations;
mod scanner;
mod signs;
mod stations;
mod views;
mod votes;

pub(crate) use above::{Ground, ground};
pub(crate) use beside::beside;
pub(crate) use centers::Centers;
pub(crate) use connected::connected;
pub(crate) use enclose::{Sheets, dipole};
pub(crate) use hidden::hidden;
pub(crate) use opposing::opposing_sheets;
pub(crate) use relations::relations;
pub(crate) use scanner::find_scanner;
pub(crate) use signs::{Relations, agree, face, orient, to_turn};
pub(crate) use stations::{find_stations, votes_toward};
pub(crate) use views::{Piece, Views, open_along};
pub(crate) use votes::votes;
