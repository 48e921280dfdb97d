//! Priors over charts: what is believed about a surface patch before any data is seen.

pub mod evidence;
pub mod explicit;
pub mod gp;
pub mod level_set;
pub mod net;
pub mod normal;
mod support;

pub use support::{project, trim};
