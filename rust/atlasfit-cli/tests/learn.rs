//! Claims about `atlasfit learn`: from data to a model to a mesh, and clear words where something is wrong.
#![cfg(feature = "learn")]

mod common;

use common::{Folder, command, err, out};
use std::path::{Path, PathBuf};
use std::process::Output;

/// A recipe that takes seconds.
const TINY: &str = "
[data]
shapes = 20
views = 1
image_side = 32
points = 200
[model]
charts = 2
code = 24
point_units = [16, 32]
image_side = 32
image_width = 2
hidden = [24, 16]
side = 8
[train]
epochs = 2
batch = 16
points = 150
";

fn learn(args: &[&dyn AsRef<std::ffi::OsStr>]) -> Output {
    let mut all: Vec<&std::ffi::OsStr> = vec!["learn".as_ref()];
    all.extend(args.iter().map(|a| a.as_ref()));
    command().args(all).output().unwrap()
}

fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", err(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name)
}

#[test]
fn data_are_made_models_trained_measured_and_used_by_files_alone() {
    let folder = Folder::new("learn");
    let recipe = folder.file("tiny.toml", TINY);
    let (data, model) = (folder.0.join("data"), folder.0.join("model"));
    let made = json(&learn(&[&"make-data", &"--recipe", &recipe, &"-o", &data, &"--json", &"-q"]));
    assert_eq!(
        [&made["train"], &made["validate"], &made["test"]].map(|n| n.as_u64()),
        [80, 10, 10].map(Some)
    );
    let train = learn(&[&"train", &"--recipe", &recipe, &"--data", &data, &"-o", &model, &"--json"]);
    let trained = json(&train);
    assert!(err(&train).contains("epoch 2/2") && err(&train).contains("14.5 million"), "{}", err(&train));
    assert!(trained["validation"].as_f64().unwrap() < trained["constant"].as_f64().unwrap() * 4.0);
    let names =
        ["best.safetensors", "curves.png", "last.safetensors", "log.csv", "model.safetensors", "recipe.toml"];
    let mut found: Vec<String> =
        std::fs::read_dir(&model).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    found.sort();
    assert_eq!(found, names);
    assert!(std::fs::read(model.join("curves.png")).unwrap().starts_with(b"\x89PNG"));
    // Another 1 epoch from the recipe of the folder.
    let longer = folder.file("longer.toml", &TINY.replace("epochs = 2", "epochs = 3"));
    let more = learn(&[&"train", &"--recipe", &longer, &"--data", &data, &"-o", &model, &"--resume", &"-q"]);
    assert!(more.status.success(), "{}", err(&more));
    assert_eq!(std::fs::read_to_string(model.join("log.csv")).unwrap().lines().count(), 4);
    let half = model.join("model.safetensors");
    let best = model.join("best.safetensors");
    let table = json(&learn(&[
        &"eval",
        &half,
        &best,
        &"--data",
        &data,
        &"--pairs",
        &"1",
        &"--samples",
        &"500",
        &"--json",
    ]));
    let row = &table["models"][1]["inputs"]["image"][4];
    assert_eq!(row["family"], "aircraft");
    for key in ["chamfer", "overlap", "stretch", "conformal", "correspondence", "correspondence_geodesic"] {
        assert!(row[key].as_f64().is_some_and(|x| x >= 0.0), "{key}: {row}");
    }
    let mesh = folder.0.join("charts.ply");
    let scan = example("vase.ply");
    let used =
        learn(&[&"reconstruct", &scan, &"--model", &half, &"--charts", &"-o", &mesh, &"--samples", &"600"]);
    assert!(used.status.success(), "{}", err(&used));
    assert!(out(&used).contains("from points"));
    let picture = folder.0.join("both.png");
    let used = learn(&[&"correspond", &scan, &scan, &"--model", &half, &"-o", &picture]);
    assert!(used.status.success(), "{}", err(&used));
}

#[test]
fn the_picture_of_a_chair_becomes_a_mesh_with_uvs_by_the_model_that_comes_along() {
    let folder = Folder::new("learn-chair");
    let mesh = folder.0.join("chair.glb");
    let done = json(&learn(&[&"reconstruct", &example("chair.png"), &"-o", &mesh, &"--json", &"-q"]));
    assert_eq!(done["from"], "image");
    assert!(done["faces"].as_u64().unwrap() > 500);
    let said = command().args(["measure", "--json"]).arg(&mesh).output().unwrap();
    assert!(json(&said)["uv"].is_object(), "{}", out(&said));
}

#[test]
fn what_is_wrong_is_said_with_the_file_and_the_remedy() {
    let folder = Folder::new("learn-refused");
    let to = folder.0.join("x.ply");
    let fails = |args: &[&dyn AsRef<std::ffi::OsStr>], code: i32, words: &[&str]| {
        let output = learn(args);
        assert_eq!(output.status.code(), Some(code), "{}", err(&output));
        words.iter().for_each(|w| assert!(err(&output).contains(w), "{w}: {}", err(&output)));
    };
    fails(&[&"train", &"--recipe", &"nothing", &"-o", &to], 2, &["nothing", "quick-conv"]);
    let wrong = folder.file("wrong.toml", "[train]\nbatch = 1\n");
    fails(&[&"train", &"--recipe", &wrong, &"-o", &to], 2, &["train.batch is 1", "Give 2 to 4096"]);
    fails(&[&"train", &"--data", &folder.0, &"-o", &to], 1, &["manifest.json", "learn make-data"]);
    let chair = example("chair.png");
    let half = folder.file("half.safetensors", "\u{10}");
    fails(&[&"reconstruct", &chair, &"-o", &to, &"--model", &half], 1, &["half.safetensors", "half written"]);
    let text = folder.file("picture.png", "\u{89}PNG");
    std::fs::write(&text, b"\x89PNG\r\n\x1a\n and no more").unwrap();
    fails(&[&"reconstruct", &text, &"-o", &to], 1, &["picture.png", "PNG or JPEG"]);
    let plain = folder.0.join("plain.png");
    std::fs::write(&plain, common::png_of([9, 9, 9])).unwrap();
    fails(&[&"reconstruct", &plain, &"-o", &to], 1, &["plain.png", "looks like background"]);
    fails(&[&"make-data", &"--shapenet", &folder.0, &"-o", &to], 1, &["ShapeNet's layout"]);
    fails(&[&"train", &"--device", &"cuda", &"-o", &to], 1, &["cuda"]);
    let output = command()
        .args(["denoise", "--init", "x"])
        .arg(example("vase.ply"))
        .arg("-o")
        .arg(&to)
        .output()
        .unwrap();
    assert!(output.status.code() == Some(2) && err(&output).contains("--prior mlp"), "{}", err(&output));
    assert!(!to.exists(), "nothing was written");
}
