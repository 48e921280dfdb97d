//! `atlasfit learn make-data`.

use super::args::{MakeData, RecipeArgs};
use super::job::{execute, plain};
use super::painter::Renderer;
use crate::console::{Console, Usage};
use crate::files;
use anyhow::Result;
use atlasfit_learn::data::{ShapeNet, convert, generate};
use atlasfit_learn::recipe::{BUILT_IN, Recipe};
use serde_json::json;

/// The recipe of a name or a file.
pub fn recipe(args: &RecipeArgs) -> Result<Recipe> {
    if let Some((_, text)) = BUILT_IN.iter().find(|r| r.0 == args.recipe) {
        return Recipe::read(text).map_err(plain);
    }
    let text = std::fs::read_to_string(&args.recipe).map_err(|e| {
        let names = BUILT_IN.map(|r| r.0).join(", ");
        Usage(format!(
            "{}: no recipe has this name, and no file ({e}). Give {names} or a TOML file",
            args.recipe
        ))
    })?;
    Recipe::read(&text).map_err(plain)
}

/// Makes a collection.
pub fn run(args: &MakeData, console: &Console) -> Result<()> {
    let recipe = recipe(&args.recipe)?.data;
    let mut left_out = 0;
    let shapes = match &args.shapenet {
        Some(meshes) => {
            let from = ShapeNet {
                meshes: meshes.clone(),
                renderings: args.renderings.clone(),
                split: args.split.clone(),
            };
            let done = execute(&args.run, true, console, |ctx| {
                convert(&from, &recipe, &args.output, &Renderer, ctx)
            })?;
            left_out = done.1;
            done.0
        }
        None => {
            execute(&args.run, true, console, |ctx| generate(&recipe, &args.output, &Renderer, ctx))?.shapes
        }
    };
    if left_out > 0 {
        console.note(format_args!("{left_out} models have no surface and are left out"));
    }
    let [train, validate, test] = shapes;
    let text = format!(
        "{}: {train} shapes to train, {validate} to validate, {test} to test\n",
        args.output.display()
    );
    let json = json!({
        "folder": files::text(&args.output), "train": train, "validate": validate, "test": test,
        "left_out": left_out,
    });
    console.report(&text, &json);
    Ok(())
}
