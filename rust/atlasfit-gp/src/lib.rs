//! The Gaussian processes behind the paper *Deep Manifold Prior* (Gadelha, Wang, Maji; section 4), computed.
//!
//! | File | What it gives |
//! |---|---|
//! | [`jet`] | numbers with exact derivatives |
//! | [`kernel`] | covariances of wide networks, their derivatives, gradient fields, tangent kernels |
//! | [`quadrature`] | integration; the kernels' moments by it |
//! | [`network`] | finite random networks |
//! | [`sample`] | curves and surfaces drawn from a process |
//! | [`convolution`] | the covariance between pixels of the convolutional networks |
//! | [`batch_norm`] | what batch norm does to the covariance |
//! | [`statistic`] | tests of distributions, slopes of power laws |
//! | [`curvature`] | the distributions of the curvature of such curves |
//! | [`disk`] | eigenvalues and eigenfunctions on the unit disk |
//! | [`bridge`] | how near the default prior of [`atlasfit`] is to the exact process |
//!
//! Each imports only those above it. Nothing here is used by the denoising itself: `atlasfit gp` draws and
//! prints it.

pub mod jet;

pub mod kernel;

pub mod quadrature;

pub mod network;

pub mod sample;

pub mod convolution;

pub mod batch_norm;

pub mod statistic;

pub mod curvature;

pub mod disk;

pub mod bridge;
