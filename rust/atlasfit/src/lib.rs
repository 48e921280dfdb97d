//! Fits an atlas of smooth charts to a noisy 3D scan.
//!
//! In: a [`geometry::PointCloud`] (or the vertices of a [`geometry::TriMesh`]). Out: denoised points in
//! input order, one stitched surface, and chart UVs.
//! Method: *Deep Manifold Prior* (Gadelha, Wang, Maji, ECCV 2020); the default prior is the
//! Gaussian-process limit of the paper's networks.
//!
//! Long work takes a [`Run`] (seed, threads, progress, cancel, time and memory limits). Nothing here
//! prints, reads the environment or touches files.

pub mod analyse;
pub mod atlas;
pub mod bake;
pub mod denoise;
pub mod error;
pub mod fit;
pub mod geometry;
pub mod loss;
pub mod measure;
pub mod orient;
pub mod partition;
pub mod prior;
pub mod project;
pub mod rng;
pub mod run;
pub mod scan;
pub mod surface;
pub mod unwrap;

pub use denoise::{DenoiseOptions, Denoised, denoise};
pub use error::{Error, Result};
pub use geometry::vec3::Vec3;
pub use run::{CancelToken, Context, Progress, Run, Stage};
