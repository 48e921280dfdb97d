//! Jobs of learning: how they run, and what their errors are to the program.

use crate::console::{Console, RunArgs, Usage};
use anyhow::Result;
use atlasfit::{Context, Error as Core};
use atlasfit_learn::Error;

/// An error of learning as the program's.
pub fn plain(error: Error) -> anyhow::Error {
    match error {
        Error::Core(e) => e.into(),
        Error::File(e) => e.into(),
        Error::Recipe { .. } => Usage(error.to_string()).into(),
        other => other.into(),
    }
}

/// Runs a job of learning, with the bar of the core's stages or without.
pub fn execute<T: Send>(
    args: &RunArgs,
    bar: bool,
    console: &Console,
    job: impl FnOnce(&Context<'_>) -> atlasfit_learn::Result<T> + Send,
) -> Result<T> {
    let mut run = if bar { console.start(args) } else { console.start_silent(args) };
    let done = run.execute(|ctx| Ok::<_, Core>(job(ctx)))?;
    done.map_err(plain)
}
