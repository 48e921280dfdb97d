//! The atlas: overlapping charts, each a smooth map into space.
//!
//! Most charts are Monge patches: heights over a plane. Thin tubes, whose curvature would leave a patch too
//! few points to average over, are charts of their own: an axis and a radius. Everything downstream sees a
//! chart only through [`Chart::view`], [`Chart::nearest`] and [`Chart::weight`]. Lengths are in the
//! normalised frame (the scan's longest side is 1).

pub mod chart;
pub mod file;
pub mod fitted;
pub(crate) mod known;
pub mod mask;
pub mod membership;
pub mod monge;
pub mod patch;
pub mod projected;
pub mod query;
pub mod relation;
pub mod site;
pub mod tube;
pub mod view;
pub mod vote;

pub use chart::{Chart, Map};
pub use fitted::{FittedChart, Smoothness};
pub(crate) use known::KnownScan;
pub use membership::Membership;
pub use monge::Monge;
pub use patch::Patch;
pub use projected::ProjectedPoint;
pub use relation::{Pair, Relation};
pub use site::{BlendSite, SITE_CHARTS};
pub use tube::Tube;
pub use view::{Foot, View};
pub use vote::Vote;
