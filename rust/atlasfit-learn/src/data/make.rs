//! The generator's collection: shapes of all families, split by seed, sampled and drawn.

use super::{
    Manifest, Painter, SHARD, Shard, Split, VERSION, make_folder, prepare, shard_file, write_manifest,
};
use crate::error::Result;
use crate::recipe::DataRecipe;
use crate::shapes::{Family, Shape};
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::rng::{Rng, shuffled};
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::{Context, Stage};
use rayon::prelude::*;
use std::path::Path;

/// Lowest and highest elevation of a view, in degrees: as one looks at furniture.
const ELEVATION: [f64; 2] = [-5.0, 35.0];

/// What was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Generated {
    /// Shapes to train, to validate, to test.
    pub shapes: [usize; 3],
}

/// The generator's seed of a shape: by the collection's seed and the shape's number in its family.
#[must_use]
pub const fn seed_of(collection: u64, number: u64) -> u64 {
    collection.wrapping_mul(1 << 32).wrapping_add(number)
}

/// Which shapes a split holds: each family's seeds, one after the other: 8 of 10 to train, 1 to validate, 1
/// to test.
fn seeds(recipe: &DataRecipe, split: Split) -> Vec<(Family, u64)> {
    let n = recipe.shapes as u64;
    let (low, high) = match split {
        Split::Train => (0, n * 8 / 10),
        Split::Validate => (n * 8 / 10, n * 9 / 10),
        Split::Test => (n * 9 / 10, n),
    };
    let all: Vec<(Family, u64)> = Family::ALL
        .into_iter()
        .flat_map(|family| (low..high).map(move |i| (family, seed_of(recipe.seed, i))))
        .collect();
    // Each shard holds all families.
    shuffled(all.len(), recipe.seed).into_iter().map(|i| all[i as usize]).collect()
}

/// Makes a collection in a folder. Shards that are there already are made anew.
///
/// # Errors
/// Files that cannot be written; cancelled or out of time.
pub fn generate(
    recipe: &DataRecipe,
    folder: &Path,
    painter: &dyn Painter,
    ctx: &Context<'_>,
) -> Result<Generated> {
    make_folder(folder)?;
    let splits = Split::ALL.map(|split| seeds(recipe, split));
    ctx.stage(Stage::Prepare, splits.iter().map(Vec::len).sum());
    for (split, seeds) in Split::ALL.into_iter().zip(&splits) {
        for (i, some) in seeds.chunks(SHARD).enumerate() {
            let shapes = some
                .par_iter()
                .map(|&(family, seed)| {
                    ctx.check()?;
                    let shape = Shape::new(family, seed);
                    let points = shape.sample(recipe.points, seed, ctx)?.into_iter().map(|s| s.0).collect();
                    let one = drawn(&shape.mesh().0, points, [family as u64, seed], recipe, painter, ctx)?;
                    ctx.advance(1);
                    Ok(one)
                })
                .collect::<Result<Vec<Shard>>>()?;
            let mut shard = Shard::new(recipe);
            shapes.into_iter().for_each(|s| shard.append(s));
            shard.write(&shard_file(folder, split, i), &ctx.stop())?;
        }
    }
    let shapes = [0, 1, 2].map(|k| splits[k].len());
    let families = Family::ALL.iter().map(|f| f.name().to_owned()).collect();
    let manifest =
        Manifest { version: VERSION, source: "generator".into(), families, recipe: recipe.clone(), shapes };
    write_manifest(folder, &manifest, &ctx.stop())?;
    Ok(Generated { shapes })
}

/// One shape with its pictures from random views.
pub(super) fn drawn(
    mesh: &TriMesh,
    points: Vec<Vec3>,
    [family, id]: [u64; 2],
    recipe: &DataRecipe,
    painter: &dyn Painter,
    ctx: &Context<'_>,
) -> Result<Shard> {
    let mut shard = Shard::new(recipe);
    shard.points = points.iter().flat_map(|p| p.to_f32()).collect();
    let mut rng = Rng::stream(id, 1000 + family);
    for _ in 0..recipe.views {
        let view = [360.0 * rng.uniform(), ELEVATION[0] + (ELEVATION[1] - ELEVATION[0]) * rng.uniform()];
        let image = painter.draw(mesh, view, recipe.image_side, ctx)?;
        shard.pictures.extend(prepare(&image, recipe.image_side, "a drawn shape")?);
    }
    shard.family.push(family as u8);
    shard.id.push(id);
    Ok(shard)
}
