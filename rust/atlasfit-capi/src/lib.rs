//! The C ABI of atlasfit: what `include/atlasfit.h` declares.
//!
//! In: pointers from C. Out: statuses, and numbers copied to the caller's buffers. Each entry point checks its arguments,
//! calls one function of the core and copies out; there is no algorithm here. Conventions are at the head of the header
//! (`conventions.rs`), the page for its readers is `docs/c-api.md`.
//!
//! The pieces: `status` (status codes, the thread's last error, the guard around every entry), `handle` (opaque handles),
//! `sized` (structs that grow), `input` (borrowed arrays to the core's plain data), `run`, and one file per capability:
//! `denoise`, `atlas`, `unwrap`, `bake`, `measure`.

// The names are C's, and so is safety: the header says what a caller owes.
#![allow(non_camel_case_types, clippy::missing_safety_doc)]

// In the order of the header.
pub mod status;

pub mod run;

pub mod input;

pub mod denoise;

pub mod atlas;

pub mod unwrap;

pub mod bake;

pub mod measure;

// What they share; nothing of it is in the header but `atlasfit_live_handles`.
pub mod handle;
pub mod sized;
