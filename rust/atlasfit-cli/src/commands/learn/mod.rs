//! `atlasfit learn`: models of a collection of shapes, from points or one picture to an atlas.

mod answers;
mod args;
mod correspond;
mod curves;
mod data;
mod eval;
mod painter;
mod reconstruct;
mod train;

use crate::console::{Console, RunArgs, Usage};
use anyhow::Result;
use atlasfit::{Context, Error as Core};
use atlasfit_learn::Error;

/// What to do.
#[derive(Debug, clap::Subcommand)]
pub enum Learn {
    /// Make a collection: shapes of the generator, or ShapeNet
    MakeData(args::MakeData),
    /// Train a model
    Train(args::Train),
    /// Measure models, family by family
    Eval(args::Eval),
    /// From a picture or a scan a mesh, by a model
    Reconstruct(args::Reconstruct),
    /// Colour two shapes by the places of a model's charts
    Correspond(args::Correspond),
}

/// Runs.
pub fn run(what: &Learn, console: &Console) -> Result<()> {
    match what {
        Learn::MakeData(args) => data::run(args, console),
        Learn::Train(args) => train::run(args, console),
        Learn::Eval(args) => eval::run(args, console),
        Learn::Reconstruct(args) => reconstruct::run(args, console),
        Learn::Correspond(args) => correspond::run(args, console),
    }
}

/// An error of learning as the program's.
fn plain(error: Error) -> anyhow::Error {
    match error {
        Error::Core(e) => e.into(),
        Error::File(e) => e.into(),
        Error::Recipe { .. } => Usage(error.to_string()).into(),
        other => other.into(),
    }
}

/// Runs a job of learning, with the bar of the core's stages or without.
fn execute<T: Send>(
    args: &RunArgs,
    bar: bool,
    console: &Console,
    job: impl FnOnce(&Context<'_>) -> atlasfit_learn::Result<T> + Send,
) -> Result<T> {
    let mut run = if bar { console.start(args) } else { console.start_silent(args) };
    let done = run.execute(|ctx| Ok::<_, Core>(job(ctx)))?;
    done.map_err(plain)
}
