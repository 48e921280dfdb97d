//! ShapeNet's folders and AtlasNet's renderings and splits as a collection of ours.
//!
//! Meshes: `SHAPENET/CATEGORY/MODEL/models/model_normalized.obj` (ShapeNetCore 2) or
//! `SHAPENET/CATEGORY/MODEL/model.obj` (ShapeNetCore 1). Pictures:
//! `RENDERINGS/CATEGORY/MODEL/rendering/00.png`
//! to `23.png` (AtlasNet's ShapeNetRendering); without them the project draws. Split: ShapeNet's `all.csv`
//! with the columns synsetId, modelId and split; without it the first 8 of 10 models of a category, by name,
//! train, the next one validates, the last one tests.

use super::make::drawn;
use super::{
    Manifest, Painter, SHARD, Shard, Split, VERSION, make_folder, prepare, shard_file, write_manifest,
};
use crate::error::{Error, Result};
use crate::recipe::DataRecipe;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::sample::uniform;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::{Context, Stage};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Where ShapeNet lies.
#[derive(Debug, Clone, Default)]
pub struct ShapeNet {
    /// The folder of categories.
    pub meshes: PathBuf,
    /// AtlasNet's renderings.
    pub renderings: Option<PathBuf>,
    /// ShapeNet's table of splits.
    pub split: Option<PathBuf>,
}

/// Names of ShapeNet's categories that the paper's table has, by their WordNet numbers.
const NAMES: [(&str, &str); 13] = [
    ("02691156", "plane"),
    ("02828884", "bench"),
    ("02933112", "cabinet"),
    ("02958343", "car"),
    ("03001627", "chair"),
    ("03211117", "monitor"),
    ("03636649", "lamp"),
    ("03691459", "speaker"),
    ("04090263", "firearm"),
    ("04256520", "couch"),
    ("04379243", "table"),
    ("04401088", "cellphone"),
    ("04530566", "watercraft"),
];

/// A model of a category.
struct Entry {
    category: usize,
    model: String,
    mesh: PathBuf,
}

/// Folders in a folder, by name.
fn folders(path: &Path) -> Result<Vec<String>> {
    let advice = "Give the folder whose folders are categories, such as 03001627";
    let bad = |e: std::io::Error| Error::bad_file(path, format!("this folder cannot be read ({e})"), advice);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(path).map_err(bad)? {
        let entry = entry.map_err(bad)?;
        if entry.path().is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

impl ShapeNet {
    /// All models, and the names of their categories.
    fn list(&self) -> Result<(Vec<Entry>, Vec<String>)> {
        let (mut entries, mut names) = (Vec::new(), Vec::new());
        for category in folders(&self.meshes)? {
            let folder = self.meshes.join(&category);
            let found: Vec<Entry> = folders(&folder)?
                .into_iter()
                .filter_map(|model| {
                    let inside = folder.join(&model);
                    let mesh = ["models/model_normalized.obj", "model.obj", "models/model.obj"]
                        .map(|name| inside.join(name))
                        .into_iter()
                        .find(|p| p.is_file())?;
                    Some(Entry { category: names.len(), model, mesh })
                })
                .collect();
            if !found.is_empty() {
                entries.extend(found);
                let name = NAMES.iter().find(|n| n.0 == category).map_or(category.as_str(), |n| n.1);
                names.push(name.to_owned());
            }
        }
        if entries.is_empty() {
            return Err(Error::bad_file(
                &self.meshes,
                "this is not ShapeNet's layout: there is neither CATEGORY/MODEL/models/model_normalized.obj \
                 nor CATEGORY/MODEL/model.obj",
                "Give the folder whose folders are categories, such as 03001627",
            ));
        }
        Ok((entries, names))
    }

    /// Which split each model is in, by its name; empty without a table.
    fn table(&self) -> Result<HashMap<String, Split>> {
        let Some(file) = &self.split else { return Ok(HashMap::new()) };
        let advice = "Give ShapeNet's all.csv: columns modelId and split (train, val, test)";
        let bad = |what: String| Error::bad_file(file, what, advice);
        let text = std::fs::read_to_string(file).map_err(|e| bad(format!("it cannot be read ({e})")))?;
        let mut lines = text.lines();
        let head: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
        let column = |name: &str| {
            head.iter().position(|h| *h == name).ok_or_else(|| bad(format!("there is no column {name}")))
        };
        let (model, split) = (column("modelId")?, column("split")?);
        let mut out = HashMap::new();
        for (i, line) in lines.enumerate().filter(|(_, l)| !l.trim().is_empty()) {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let (Some(model), Some(split)) = (cells.get(model), cells.get(split)) else {
                return Err(bad(format!("line {} has too few columns", i + 2)));
            };
            let split = match *split {
                "train" => Split::Train,
                "val" => Split::Validate,
                "test" => Split::Test,
                other => return Err(bad(format!("line {} has the split {other:?}", i + 2))),
            };
            out.insert((*model).to_owned(), split);
        }
        Ok(out)
    }
}

/// Makes a collection from ShapeNet. Models without a surface are left out; their number comes back with the
/// shapes of each split. `recipe.shapes` is the most of each category.
///
/// # Errors
/// [`Error::BadFile`] for folders of another layout, files that cannot be read or written; cancelled.
pub fn convert(
    from: &ShapeNet,
    recipe: &DataRecipe,
    folder: &Path,
    painter: &dyn Painter,
    ctx: &Context<'_>,
) -> Result<([usize; 3], usize)> {
    let (entries, families) = from.list()?;
    let table = from.table()?;
    let mut splits: [Vec<&Entry>; 3] = Default::default();
    for category in 0..families.len() {
        let all: Vec<&Entry> =
            entries.iter().filter(|e| e.category == category).take(recipe.shapes).collect();
        for (i, &entry) in all.iter().enumerate() {
            let by_order = [Split::Train, Split::Validate, Split::Test]
                [usize::from(10 * i >= 8 * all.len()) + usize::from(10 * i >= 9 * all.len())];
            let split = if table.is_empty() { Some(by_order) } else { table.get(&entry.model).copied() };
            splits
                .iter_mut()
                .enumerate()
                .filter(|(k, _)| split.is_some_and(|s| s as usize == *k))
                .for_each(|(_, list)| list.push(entry));
        }
    }
    make_folder(folder)?;
    ctx.stage(Stage::Prepare, splits.iter().map(Vec::len).sum());
    let (mut shapes, mut left_out) = ([0; 3], 0);
    for split in Split::ALL {
        let made: Vec<Option<Shard>> = splits[split as usize]
            .par_iter()
            .map(|entry| {
                ctx.check()?;
                let one = read(entry, from, recipe, painter, ctx)?;
                ctx.advance(1);
                Ok(one)
            })
            .collect::<Result<_>>()?;
        left_out += made.iter().filter(|m| m.is_none()).count();
        let good: Vec<Shard> = made.into_iter().flatten().collect();
        shapes[split as usize] = good.len();
        for (i, some) in good.chunks(SHARD).enumerate() {
            let mut shard = Shard::new(recipe);
            some.iter().for_each(|s| shard.append(s.clone()));
            shard.write(&shard_file(folder, split, i), &ctx.stop())?;
        }
    }
    let manifest =
        Manifest { version: VERSION, source: "shapenet".into(), families, recipe: recipe.clone(), shapes };
    write_manifest(folder, &manifest, &ctx.stop())?;
    Ok((shapes, left_out))
}

/// One model; `None` where it has no surface.
fn read(
    entry: &Entry,
    from: &ShapeNet,
    recipe: &DataRecipe,
    painter: &dyn Painter,
    ctx: &Context<'_>,
) -> Result<Option<Shard>> {
    let options = atlasfit_io::LoadOptions::default().with_stop(ctx.stop());
    let mut mesh = atlasfit_io::load(&entry.mesh, &options)?.into_mesh();
    normalise(&mut mesh);
    let id = entry.model.bytes().fold(0u64, |h, b| h.wrapping_mul(0x100_0000_01b3) ^ u64::from(b));
    let samples = match uniform(&mesh, recipe.points, id, ctx) {
        Ok(samples) => samples,
        Err(atlasfit::Error::Degenerate { .. }) => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    let points: Vec<Vec3> = samples.iter().map(|s| s.point).collect();
    let of = [entry.category as u64, id];
    let Some(renderings) = &from.renderings else {
        return drawn(&mesh, points, of, recipe, painter, ctx).map(Some);
    };
    let mut shard = Shard::new(recipe);
    shard.points = points.iter().flat_map(|p| p.to_f32()).collect();
    let category = entry.mesh.strip_prefix(&from.meshes).ok().and_then(|p| p.components().next());
    let category = category.map(|c| c.as_os_str().to_owned()).unwrap_or_default();
    let folder = renderings.join(category).join(&entry.model).join("rendering");
    for view in 0..recipe.views {
        let file = folder.join(format!("{view:02}.png"));
        let advice = "Give AtlasNet's ShapeNetRendering, or fewer views, or no renderings: then we draw";
        let bad = |what: String| Error::bad_file(&file, what, advice);
        let bytes = std::fs::read(&file).map_err(|e| bad(format!("it cannot be read ({e})")))?;
        let image = painter.read(&bytes).map_err(bad)?;
        shard.pictures.extend(prepare(&image, recipe.image_side, &file.display().to_string())?);
    }
    shard.family.push(entry.category as u8);
    shard.id.push(id);
    Ok(Some(shard))
}

/// Puts the box about the faces' vertices at 0 and makes its longest side 1.
fn normalise(mesh: &mut TriMesh) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &v in mesh.triangles.iter().flatten() {
        let p = mesh.positions[v as usize];
        low = [0, 1, 2].map(|k| low[k].min(p[k]));
        high = [0, 1, 2].map(|k| high[k].max(p[k]));
    }
    let longest = (0..3).map(|k| high[k] - low[k]).fold(f64::MIN_POSITIVE, f64::max);
    for p in &mut mesh.positions {
        *p = [0, 1, 2].map(|k| (p[k] - 0.5 * (low[k] + high[k])) / longest);
    }
}
