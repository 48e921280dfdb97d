//! Priors over charts: what is believed about a surface patch before any data is seen.

pub mod gp;
pub mod mlp;
