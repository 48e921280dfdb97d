//! `denoise --uncertainty`, `compare` and `render --mode uncertainty` as a user meets them.

mod common;

use common::{Folder, err, out, run};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/vase.ply")
}

/// What a file's bytes hold of a text.
fn holds(file: &Path, text: &str) -> bool {
    std::fs::read(file).unwrap().windows(text.len()).any(|w| w == text.as_bytes())
}

#[test]
fn attributes_are_in_the_files_and_the_picture_has_colours() {
    let folder = Folder::new("uncertainty");
    let [ply, glb, points, png] =
        ["out.ply", "out.glb", "points.ply", "out.png"].map(|name| folder.0.join(name));
    let scan = example();
    for surface in [&ply, &glb] {
        let said = run(&[
            &"denoise",
            &scan,
            &"-o",
            surface,
            &"--points",
            &points,
            &"--uncertainty",
            &"--no-uv",
            &"--json",
        ]);
        assert!(said.status.success(), "{}", err(&said));
        let said: Value = serde_json::from_str(&out(&said)).unwrap();
        let (sd, noise) = (said["uncertainty"].as_f64().unwrap(), said["noise"].as_f64().unwrap());
        assert!(sd > 0.05 * noise && sd < noise, "{sd} {noise}");
        assert!(said["uncertainty_factor"].as_f64().unwrap() >= 1.0);
    }
    assert!(holds(&ply, "property float uncertainty\n") && holds(&ply, "property uchar extrapolated\n"));
    assert!(holds(&glb, "\"_UNCERTAINTY\"") && holds(&glb, "\"_EXTRAPOLATED\""));
    for name in ["uncertainty", "noise", "outlier_probability"] {
        assert!(holds(&points, &format!("property float {name}\n")), "{name}");
    }
    let shot = |arguments: &[&dyn AsRef<std::ffi::OsStr>]| {
        let first: [&dyn AsRef<std::ffi::OsStr>; 6] =
            [&"render", &ply, &"-o", &png, &"--mode", &"uncertainty"];
        run(&[&first[..], arguments].concat())
    };
    let said = shot(&[&"--size", &"200x200"]);
    assert!(said.status.success() && std::fs::metadata(&png).unwrap().len() > 1000, "{}", err(&said));
    let said = shot(&[&"--attribute", &"depth"]);
    assert!(!said.status.success() && err(&said).contains("no attribute \"depth\""), "{}", err(&said));
}

#[test]
fn a_scan_has_not_changed_beside_itself_and_one_elsewhere_is_refused() {
    let folder = Folder::new("compare");
    let (scan, changed) = (example(), folder.0.join("changed.ply"));
    let said = run(&[&"compare", &scan, &scan, &"-o", &changed, &"--json"]);
    assert!(said.status.success(), "{}", err(&said));
    let figures: Value = serde_json::from_str(&out(&said)).unwrap();
    let count = |name: &str| figures[name].as_u64().unwrap();
    assert!(count("compared") * 100 > 99 * (count("points") - 100), "{figures:#}");
    assert!(count("changed") * 100 <= count("compared"), "{figures:#}");
    for column in ["float distance", "float distance_uncertainty", "uchar significant"] {
        assert!(holds(&changed, &format!("property {column}\n")), "{column}");
    }
    let elsewhere: String = (0..900)
        .map(|i| format!("{} {} {}\n", 50 + i % 30, 50 + i / 30, 50.0 + 0.01 * f64::from(i * 7 % 13)))
        .collect();
    let elsewhere = folder.file("elsewhere.xyz", &elsewhere);
    let said = run(&[&"compare", &scan, &elsewhere]);
    assert!(said.status.code() == Some(1) && err(&said).contains("do not overlap"), "{}", err(&said));
}
