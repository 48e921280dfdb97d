//! Bottom-up merging of charts: neighbours become one chart while the merged flattening stays within the
//! bound.
//!
//! In: flattened charts. Out: fewer flattened charts. `rounds` merges what fits; `trade` then moves borders
//! to where they are shorter, as `region` and `ways` know, and merges what fits now; where the bound is
//! loose, `spend` uses up what the whole surface may stretch beyond it; borders of quads then follow edge
//! loops (`straight_on`). `join` tries one pair: `align` lays one against the other, `dart` finds a part of
//! their border where all of it does not close, `overlap` tells whether there is room for that, `patch` and
//! `glue` make them one. `charts` holds the charts and who owns which face.

mod align;
mod charts;
mod constants;
mod dart;
mod glue;
mod join;
mod limits;
mod overlap;
mod patch;
mod region;
mod rounds;
mod spend;
mod straight_on;
mod trade;
mod ways;

pub(crate) use charts::Charts;
pub(crate) use glue::price_of_waste;
pub(crate) use rounds::merge;
pub(crate) use spend::spend;
pub(crate) use straight_on::{run_straight, turns};
pub(crate) use trade::{shorten_borders, shorten_borders_of_large};
