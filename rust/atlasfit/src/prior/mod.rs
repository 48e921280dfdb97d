//! Priors over charts: what is believed about a surface patch before any data is seen.

pub mod basis;
pub(crate) mod constants;
pub mod evidence;
pub mod gp;
pub mod normal_equations;
pub(crate) mod smoothing;
