//! The charts blended into one surface by a partition of unity.

pub mod membership;
pub mod project;
pub mod sites;
