//! Scans of any size: cut into tiles on disk, denoised one by one, put together again.
//!
//! In: files of points, together larger than memory. Out: denoised points file by file, the surface as one
//! file and as tiles. [`plan()`] reads the files once and writes a plan of tasks; each task is one command
//! that reads files and writes files whole or not at all, so that any engine may run them and a killed run
//! goes on. docs/scale.md has the design and the figures.
//!
//! Layers: `error` ← `store` ← `cut`, `folder` ← `plan` ← `tasks`, `job` ← `rings` ← `seams` ← `light` ←
//! `merge`, `planning` ← `run`.

mod cut;
mod error;
mod folder;
mod job;
mod light;
mod merge;
mod plan;
mod planning;
mod rings;
mod run;
mod seams;
mod store;
mod tasks;

pub use cut::Tree;
pub use error::{Error, Result};
pub use plan::{Options, Plan, Scan, Task, Tile};
pub use planning::{Request, plan};
pub use run::{Log, Simulated, Status, simulate, status, task};
pub use seams::Summary;
