//! Large meshes: charts are found on a coarse stand-in and taken back to the full surface.
//!
//! `patches` names the patches' border paths, `coarse` decimates (by the collapses of `collapse`), `refine`
//! flattens the charts level by level on the way back.

mod coarse;
mod collapse;
mod constants;
mod patches;
mod refine;

pub(crate) use coarse::coarsen;
pub(crate) use collapse::Level;
pub(crate) use constants::LARGE;
pub(crate) use patches::Patches;
pub(crate) use refine::refine;
