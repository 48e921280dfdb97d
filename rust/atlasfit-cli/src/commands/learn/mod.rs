//! `atlasfit learn`: models of a collection of shapes, from points or one picture to an atlas.

mod answers;
mod args;
mod correspond;
mod curves;
mod data;
mod eval;
mod job;
mod painter;
mod reconstruct;
mod train;

use crate::console::Console;
use anyhow::Result;

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
