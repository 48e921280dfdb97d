use super::*;
use crate::recipe::DataRecipe;
use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::run::{Context, Run};
use std::collections::BTreeSet;

/// A folder of its own for each test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("atlasfit-learn-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A painter whose pictures are a grey square in the middle; its "files" are a brightness.
struct Square;

fn square(side: usize, light: u8) -> Image {
    let inside = |i: usize| (side / 4..3 * side / 4).contains(&i);
    let pixel =
        |i: usize| if inside(i % side) && inside(i / side) { [light, light, light, 255] } else { [0; 4] };
    Image { width: side as u32, height: side as u32, rgba: (0..side * side).map(pixel).collect() }
}

impl Painter for Square {
    fn draw(&self, _: &TriMesh, _: [f64; 2], side: usize, _: &Context<'_>) -> atlasfit::Result<Image> {
        Ok(square(side, 100))
    }
    fn read(&self, bytes: &[u8]) -> std::result::Result<Image, String> {
        bytes.first().map(|&b| square(137, b)).ok_or_else(|| "it is empty".into())
    }
}

fn small() -> DataRecipe {
    DataRecipe { shapes: 40, views: 2, image_side: 16, points: 64, seed: 5 }
}

fn run<T: Send>(job: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
    Run::default().execute(|ctx| Ok(job(ctx)))?
}

#[test]
fn splits_share_no_shape_and_batches_show_all_of_them_in_an_order_of_the_seed() {
    let folder = Folder::new("splits");
    run(|ctx| generate(&small(), &folder.0, &Square, ctx)).unwrap();
    let data = Dataset::open(&folder.0).unwrap();
    assert_eq!(Split::ALL.map(|s| data.len(s)), [160, 20, 20]);
    let shapes = |split| -> BTreeSet<(u8, u64)> {
        let all = data.read_all(split).unwrap();
        all.family.iter().copied().zip(all.id).collect()
    };
    let [train, validate, test] = Split::ALL.map(shapes);
    assert!(train.is_disjoint(&validate) && train.is_disjoint(&test) && validate.is_disjoint(&test));
    assert_eq!((train.len(), validate.len(), test.len()), (160, 20, 20));
    let epoch =
        |epoch| -> Vec<Batch> { Batches::new(&data, 16, 32, 3, epoch).collect::<Result<Vec<_>>>().unwrap() };
    let first = epoch(0);
    assert_eq!(first.len(), 10);
    assert_eq!(first[0].points.len(), 16 * 32 * 3);
    assert_eq!(first, epoch(0));
    assert_ne!(first, epoch(1));
}

#[test]
fn a_folder_that_is_damaged_or_of_another_kind_is_refused_with_the_file_and_the_remedy() {
    let folder = Folder::new("damaged");
    let said = |f: &dyn Fn() -> Result<Dataset>| f().unwrap_err().to_string();
    assert!(said(&|| Dataset::open(&folder.0)).contains("learn make-data"));
    run(|ctx| generate(&small(), &folder.0, &Square, ctx)).unwrap();
    let shard = folder.0.join("test-0000.safetensors");
    let bytes = std::fs::read(&shard).unwrap();
    std::fs::write(&shard, &bytes[..bytes.len() / 2]).unwrap();
    let data = Dataset::open(&folder.0).unwrap();
    let text = data.read(Split::Test, 0).unwrap_err().to_string();
    assert!(text.contains("test-0000") && text.contains("half written"), "{text}");
    std::fs::remove_file(&shard).unwrap();
    assert!(said(&|| Dataset::open(&folder.0)).contains("test-0000"));
    std::fs::write(folder.0.join("manifest.json"), "{").unwrap();
    assert!(said(&|| Dataset::open(&folder.0)).contains("manifest"));
}

/// A folder in the layout of ShapeNet, AtlasNet's renderings and the table of splits.
fn shapenet(folder: &Path) -> ShapeNet {
    let (meshes, renderings) = (folder.join("ShapeNetCore"), folder.join("ShapeNetRendering"));
    let mut table = "id,synsetId,subSynsetId,modelId,split\n".to_owned();
    for (category, inner) in [("03001627", "models/model_normalized.obj"), ("04379243", "model.obj")] {
        for i in 0..4 {
            let model = format!("model{category}{i}");
            let mesh = meshes.join(category).join(&model).join(inner);
            std::fs::create_dir_all(mesh.parent().unwrap()).unwrap();
            // The last one has no surface.
            let end = if i == 3 { "0 0 0" } else { "0 0 1" };
            std::fs::write(&mesh, format!("v 0 0 0\nv 4 0 0\nv {end}\nf 1 2 3\n")).unwrap();
            let pictures = renderings.join(category).join(&model).join("rendering");
            std::fs::create_dir_all(&pictures).unwrap();
            for view in 0..2 {
                std::fs::write(pictures.join(format!("{view:02}.png")), [50 + i]).unwrap();
            }
            let split = ["train", "val", "test", "train"][i as usize];
            table += &format!("{i},{category},{category},{model},{split}\n");
        }
    }
    std::fs::write(folder.join("all.csv"), table).unwrap();
    ShapeNet { meshes, renderings: Some(renderings), split: Some(folder.join("all.csv")) }
}

#[test]
fn shapenets_folders_renderings_and_splits_become_a_collection() {
    let folder = Folder::new("shapenet");
    let from = shapenet(&folder.0);
    let to = folder.0.join("data");
    let (shapes, left_out) = run(|ctx| convert(&from, &small(), &to, &Square, ctx)).unwrap();
    assert_eq!((shapes, left_out), ([2, 2, 2], 2));
    let data = Dataset::open(&to).unwrap();
    assert_eq!(data.manifest.families, ["chair", "table"]);
    let train = data.read_all(Split::Train).unwrap();
    // The box's longest side is 1; the picture's brightness is that of the rendering.
    let widest = train.points_of(0).chunks_exact(3).map(|p| p[0].abs()).fold(0.0, f32::max);
    assert!(widest <= 0.5 && widest > 0.4, "{widest}");
    assert_eq!(train.picture_of(0, 1)[2 * (8 * 16 + 8)..][..2], [50, 255]);
    // Without a table the order of the names decides, without renderings the project draws.
    let bare = ShapeNet { meshes: from.meshes.clone(), ..ShapeNet::default() };
    let (shapes, _) = run(|ctx| convert(&bare, &small(), &to, &Square, ctx)).unwrap();
    assert_eq!(shapes.iter().sum::<usize>(), 6);
}

#[test]
fn folders_of_another_layout_are_refused_with_what_was_looked_for() {
    let folder = Folder::new("layout");
    let from = shapenet(&folder.0);
    let said = |from: &ShapeNet| {
        run(|ctx| convert(from, &small(), &folder.0.join("data"), &Square, ctx)).unwrap_err().to_string()
    };
    let text = said(&ShapeNet { meshes: folder.0.join("nowhere"), ..ShapeNet::default() });
    assert!(text.contains("nowhere") && text.contains("03001627"), "{text}");
    let text = said(&ShapeNet { meshes: from.renderings.clone().unwrap(), ..ShapeNet::default() });
    assert!(text.contains("model_normalized.obj"), "{text}");
    std::fs::remove_file(folder.0.join("ShapeNetRendering/04379243/model043792430/rendering/01.png"))
        .unwrap();
    assert!(said(&from).contains("01.png"));
    std::fs::write(folder.0.join("all.csv"), "id,model\n").unwrap();
    assert!(said(&from).contains("no column modelId"));
}

#[test]
fn pictures_of_any_size_with_or_without_alpha_show_the_object_in_the_middle() {
    let mut wide = Image { width: 301, height: 57, rgba: vec![[250, 250, 250, 255]; 301 * 57] };
    for y in 5..45 {
        for x in 260..280 {
            wide.rgba[y * 301 + x] = [30, 60, 90, 255];
        }
    }
    let opaque = prepare(&wide, 32, "wide.png").unwrap();
    for c in &mut wide.rgba {
        *c = if c[0] == 250 { [9, 9, 9, 0] } else { *c };
    }
    let clear = prepare(&wide, 32, "wide.png").unwrap();
    assert_eq!(opaque, clear);
    let at = |x: usize, y: usize| &opaque[2 * (y * 32 + x)..][..2];
    assert_eq!((at(16, 16), at(2, 16)), (&[54u8, 255][..], &[0u8, 0][..]));
    let covered: usize = opaque.chunks_exact(2).map(|p| usize::from(p[1])).sum();
    // 40 of 40 / 0.92 pixels high, half as wide.
    assert!((covered as f64 / 255.0 / 1024.0 - 0.5 * 0.92 * 0.92).abs() < 0.02);
    let blank = Image { width: 1, height: 1, rgba: vec![[7; 4]; 1] };
    assert!(prepare(&Image { rgba: vec![[7, 7, 7, 255]], ..blank.clone() }, 32, "b.png").is_err());
    let none = Image { width: 0, height: 0, rgba: Vec::new() };
    assert!(prepare(&none, 32, "none.png").unwrap_err().to_string().contains("none.png"));
}
