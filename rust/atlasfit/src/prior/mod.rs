//! Priors over charts: what is believed about a surface patch before any data is seen.

pub(crate) mod basis;
pub(crate) mod constants;
pub(crate) mod evidence;
mod expansion;
pub(crate) mod gp;
pub(crate) mod normal_equations;
pub(crate) mod posterior;
pub(crate) mod smoothing;

pub use expansion::{eigenfunctions, freer_precisions, precisions};
