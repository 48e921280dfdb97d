//! Claims about training: the same bytes for any number of threads and when it goes on, nothing lost where it
//! fails, clear words for files that are no models.

use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::run::{Context, Run};
use atlasfit_learn::checkpoint::{self, Precision};
use atlasfit_learn::data::{Dataset, Painter, generate};
use atlasfit_learn::recipe::{Decoder, Encoder, Recipe};
use atlasfit_learn::train::{BEST, LAST, LOG, MODEL, Trained, train};
use atlasfit_learn::{Device, Result};
use std::path::{Path, PathBuf};

/// A folder of its own for each test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("atlasfit-train-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Draws the box about the vertices from above: enough to tell shapes apart.
struct Boxes;

impl Painter for Boxes {
    fn draw(&self, mesh: &TriMesh, _: [f64; 2], side: usize, _: &Context<'_>) -> atlasfit::Result<Image> {
        let reach = |k: usize| mesh.positions.iter().map(|p| p[k].abs()).fold(0.1, f64::max);
        let (wide, high) = (reach(0), reach(1));
        let at = |i: usize| ((i as f64 + 0.5) / side as f64 - 0.5).abs();
        let inside = |i: usize| at(i % side) <= 0.8 * wide && at(i / side) <= 0.8 * high;
        let rgba = (0..side * side).map(|i| if inside(i) { [90, 90, 90, 255] } else { [0; 4] }).collect();
        Ok(Image { width: side as u32, height: side as u32, rgba })
    }
    fn read(&self, _: &[u8]) -> std::result::Result<Image, String> {
        Err("these are no files".into())
    }
}

fn tiny(decoder: Decoder) -> Recipe {
    let mut recipe = Recipe::default();
    recipe.data.shapes = 20;
    (recipe.data.views, recipe.data.image_side, recipe.data.points) = (2, 32, 128);
    recipe.model.encoder = Encoder::Both;
    recipe.model.decoder = decoder;
    (recipe.model.charts, recipe.model.code, recipe.model.side) = (2, 16, 6);
    (recipe.model.image_side, recipe.model.image_width, recipe.model.channels) = (32, 2, 8);
    recipe.model.point_units = vec![16, 24];
    recipe.model.hidden = vec![16, 12];
    (recipe.train.epochs, recipe.train.batch, recipe.train.points) = (4, 8, 96);
    recipe
}

fn run<T: Send>(threads: usize, job: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
    Run { threads, ..Run::default() }.execute(|ctx| Ok(job(ctx)))?
}

fn data(folder: &Folder, recipe: &Recipe) -> Dataset {
    let path = folder.0.join("data");
    run(0, |ctx| generate(&recipe.data, &path, &Boxes, ctx)).unwrap();
    Dataset::open(&path).unwrap()
}

fn trained(recipe: &Recipe, data: &Dataset, to: &Path, resume: bool, threads: usize) -> Result<Trained> {
    run(threads, |ctx| train(recipe, data, to, resume, &Device::Cpu, ctx, &mut |_| {}))
}

fn bytes(folder: &Path) -> [Vec<u8>; 4] {
    [LAST, BEST, LOG, MODEL].map(|name| std::fs::read(folder.join(name)).unwrap())
}

#[test]
fn the_same_recipe_gives_the_same_bytes_for_any_number_of_threads_and_when_it_goes_on() {
    for decoder in [Decoder::AtlasNet, Decoder::ConvAtlas] {
        let folder = Folder::new(&format!("same-{decoder:?}"));
        let recipe = tiny(decoder);
        let data = data(&folder, &recipe);
        let to = |name: &str| folder.0.join(name);
        let done = trained(&recipe, &data, &to("one"), false, 1).unwrap();
        let first = done.state.epochs[0].validation();
        assert!(done.state.epochs[3].chamfer < done.state.epochs[0].chamfer, "it learns from {first}");
        trained(&recipe, &data, &to("three"), false, 3).unwrap();
        assert!(bytes(&to("one")) == bytes(&to("three")), "{decoder:?}: threads change the bytes");
        let mut half = recipe.clone();
        half.train.epochs = 2;
        trained(&half, &data, &to("resumed"), false, 2).unwrap();
        trained(&recipe, &data, &to("resumed"), true, 2).unwrap();
        assert!(bytes(&to("one")) == bytes(&to("resumed")), "{decoder:?}: going on changes the bytes");
    }
}

#[test]
fn a_loss_that_is_no_number_ends_training_and_the_last_good_checkpoint_stays() {
    let folder = Folder::new("diverged");
    let mut recipe = tiny(Decoder::AtlasNet);
    recipe.train.epochs = 1;
    let data = data(&folder, &recipe);
    let to = folder.0.join("model");
    trained(&recipe, &data, &to, false, 0).unwrap();
    let before = bytes(&to);
    // The next epoch starts from weights that are none.
    let mut loaded = checkpoint::load(&to.join(LAST), &Device::Cpu).unwrap();
    recipe.train.epochs = 2;
    let (adam, state) = loaded.training.as_mut().unwrap();
    adam.moments[0] = (adam.moments[0].ones_like().unwrap() * f64::from(f32::MAX)).unwrap();
    loaded.recipe.train.rate = 1e30;
    recipe.train.rate = 1e30;
    let poisoned = Some((&*adam, &*state));
    let stop = atlasfit::Stop::default();
    checkpoint::save(&to.join(LAST), &loaded.model, &loaded.recipe, poisoned, Precision::Single, &stop)
        .unwrap();
    let text = trained(&recipe, &data, &to, true, 0).unwrap_err().to_string();
    assert!(text.contains("epoch 2") && text.contains(LAST) && text.contains("rate"), "{text}");
    assert!(before[1..] == bytes(&to)[1..], "the best model and the log are untouched");
    assert!(checkpoint::load(&to.join(LAST), &Device::Cpu).is_ok());
}

#[test]
fn training_goes_on_by_its_own_recipe_only_and_refuses_folders_that_cannot_be_written() {
    let folder = Folder::new("refused");
    let mut recipe = tiny(Decoder::AtlasNet);
    recipe.train.epochs = 1;
    let data = data(&folder, &recipe);
    let to = folder.0.join("model");
    let said = |recipe: &Recipe, to: &Path, resume: bool| {
        trained(recipe, &data, to, resume, 0).unwrap_err().to_string()
    };
    assert!(said(&recipe, &to, true).contains(LAST), "there is no checkpoint to go on from");
    trained(&recipe, &data, &to, false, 0).unwrap();
    let mut other = recipe.clone();
    other.train.stretch = 0.5;
    assert!(said(&other, &to, true).contains("another recipe"));
    let mut other = recipe.clone();
    other.model.image_side = 64;
    assert!(said(&other, &to, false).contains("image_side"));
    other = recipe.clone();
    other.train.batch = 4000;
    assert!(said(&other, &to, false).contains("train.batch"));
    let file = folder.0.join("file");
    std::fs::write(&file, "").unwrap();
    assert!(said(&recipe, &file, false).contains("file"));
    // What cannot be replaced is told before the work, and nothing else is touched.
    let blocked = folder.0.join("blocked");
    std::fs::create_dir_all(blocked.join(LAST)).unwrap();
    assert!(said(&recipe, &blocked, false).contains(LAST));
    assert_eq!(std::fs::read_dir(&blocked).unwrap().count(), 1);
}

#[test]
fn files_that_are_no_models_are_refused_with_what_is_wrong() {
    let folder = Folder::new("files");
    let recipe = tiny(Decoder::ConvAtlas);
    let model = atlasfit_learn::Model::new(&recipe.model, 3, &Device::Cpu).unwrap();
    let path = folder.0.join("model.safetensors");
    let said = || checkpoint::load(&path, &Device::Cpu).map(|_| ()).unwrap_err().to_string();
    assert!(said().contains("model.safetensors") && said().contains("learn train"), "{}", said());
    let whole = checkpoint::to_bytes(&model, &recipe, None, Precision::Single).unwrap();
    for len in [0, 7, 100, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..len]).unwrap();
        assert!(said().contains("half written"), "{len} bytes: {}", said());
    }
    std::fs::write(&path, b"PK\x03\x04 some archive that is no model at all").unwrap();
    assert!(said().contains("damaged"));
    // Another model's numbers under this one's recipe.
    let mut other = recipe.clone();
    other.model.code = 20;
    let mixed = checkpoint::to_bytes(&model, &other, None, Precision::Single).unwrap();
    std::fs::write(&path, &mixed).unwrap();
    assert!(said().contains("numbers, not"), "{}", said());
}

#[test]
fn half_precision_keeps_a_model_within_its_rounding() {
    let recipe = tiny(Decoder::AtlasNet);
    let model = atlasfit_learn::Model::new(&recipe.model, 3, &Device::Cpu).unwrap();
    let half = checkpoint::to_bytes(&model, &recipe, None, Precision::Half).unwrap();
    let single = checkpoint::to_bytes(&model, &recipe, None, Precision::Single).unwrap();
    assert!((half.len() as f64) < 0.7 * single.len() as f64);
    let read = checkpoint::from_bytes(&half, "half".as_ref(), &Device::Cpu).unwrap();
    assert_eq!(read.recipe, recipe);
    for ((name, a), (_, b)) in model.params.vars.iter().zip(&read.model.params.vars) {
        let flat = |v: &candle_core::Var| v.flatten_all().unwrap().to_vec1::<f32>().unwrap();
        let off =
            flat(a).iter().zip(flat(b)).map(|(a, b)| (a - b).abs() / (a.abs() + 1e-3)).fold(0.0, f32::max);
        assert!(off < 1e-3, "{name}: {off}");
    }
}
