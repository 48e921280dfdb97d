//! Fits an atlas of smooth charts to a noisy 3D scan.
//!
//! In: a [`geometry::PointCloud`] (or the vertices of a [`geometry::TriMesh`]). Out: denoised points in
//! input order, one stitched surface, and chart UVs.
//! Method: *Deep Manifold Prior* (Gadelha, Wang, Maji); the default prior is a
//! Gaussian process of the smoothness order of these networks' limit.
//!
//! Long work takes a [`Run`] (seed, threads, progress, cancel, time and memory limits). Nothing here
//! prints, reads the environment or touches files.

// The layers, in order: each imports only what stands above it. `unwrap`, `measure` and `bake` stand beside
// the steps of denoising, on the layers up to `geometry`; `pipeline` calls all of them. A test reads the
// imports (tests/layers). Blank lines keep the order from being sorted.

pub mod error;

pub mod run;

pub mod numeric;

pub mod spatial;

pub mod geometry;

pub mod atlas;

pub mod prior;

pub(crate) mod partition;

pub(crate) mod fit;

pub(crate) mod strays;

pub(crate) mod noise;

pub(crate) mod orient;

pub(crate) mod blend;

pub(crate) mod contour;

pub(crate) mod rim;

pub(crate) mod handles;

pub(crate) mod crease;

pub mod simplify;

pub(crate) mod solid;

pub(crate) mod uncertainty;

pub mod measure;

pub mod bake;

pub mod unwrap;

pub mod register;

pub mod pipeline;

mod setters;

pub use error::{Error, Result};
pub use numeric::Vec3;
pub use pipeline::{DenoiseOptions, Denoised, denoise};
pub use run::{CancelToken, Context, Deadline, Progress, Run, Stage, Stop};
