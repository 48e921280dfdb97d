//! The C ABI of atlasfit: what `include/atlasfit.h` declares.
//!
//! In: pointers from C. Out: statuses, and numbers copied to the caller's buffers. Each entry point checks
//! its arguments, calls one function of the core and copies out; there is no algorithm here. Conventions are
//! at the head of the header (`cbindgen.toml`), the page for its readers is `docs/c-api.md`.
//!
//! Each file imports only files that stand above it in this list:
//!
//! - `status`: status codes, the thread's last error, the guard around every entry point;
//! - `sized`: structs that grow; `handle`: opaque handles; `arrays` and `buffer`: arrays in and out;
//! - `run`: seed, threads, limits, progress, cancel; `faces`, `points` and `mesh`: what the caller gives;
//! - one file per capability: `atlas`, `result` and `result_copy` (what denoising made), `denoise`, `uv`
//!   (what unwrapping made), `unwrap`, `bake`, `simplify`, `measure`, `files` (read), `save`.

// The names are C's, and so is safety: the header says what a caller owes.
#![allow(non_camel_case_types, clippy::missing_safety_doc)]

// cbindgen writes the header in the order of these lines.
pub mod status;

pub mod log;

pub mod run;

pub mod arrays;

pub mod buffer;

pub mod faces;

pub mod points;

pub mod mesh;

pub mod denoise;

pub mod result;

pub mod result_copy;

pub mod atlas;

pub mod unwrap;

pub mod uv;

pub mod bake;

pub mod simplify;

pub mod measure;

pub mod files;

pub mod save;

// Shared by the others; of these only `atlasfit_live_handles` is in the header.
pub mod handle;
pub mod sized;
