//! `atlasfit simplify` as a user runs it, and `denoise --surface none`.

mod common;

use common::*;

/// A bumpy sheet of squares with UVs, as OBJ.
fn sheet() -> String {
    let mut text = String::new();
    for i in 0..41 * 41 {
        let (x, y) = (f64::from(i % 41) / 40.0, f64::from(i / 41) / 40.0);
        text += &format!("v {x} {y} {}\nvt {x} {y}\n", 0.05 * (6.0 * x).sin());
    }
    for i in 0..1600 {
        let a = i / 40 * 41 + i % 40 + 1;
        text += &format!("f {a}/{a} {b}/{b} {c}/{c} {d}/{d}\n", b = a + 1, c = a + 42, d = a + 41);
    }
    text
}

#[test]
fn simplify_writes_a_light_mesh_that_keeps_its_uvs() {
    let folder = Folder::new("simplify");
    let (sheet, light) = (folder.file("sheet.obj", &sheet()), folder.0.join("light.obj"));
    let done = run(&[&"simplify", &sheet, &"-o", &light, &"--faces", &"320", &"--json"]);
    assert!(done.status.success(), "{}", err(&done));
    let json: serde_json::Value = serde_json::from_str(&out(&done)).unwrap();
    assert_eq!(json["faces_before"], 3200);
    assert!(json["faces"].as_u64().unwrap() <= 320);
    let measured = run(&[&"measure", &light, &"--json"]);
    let json: serde_json::Value = serde_json::from_str(&out(&measured)).unwrap();
    assert_eq!((&json["uv"]["flips"], &json["uv"]["charts"]), (&0.into(), &1.into()), "{json}");
}

#[test]
fn simplify_says_what_it_needs() {
    let folder = Folder::new("simplify-wrong");
    let (sheet, points) = (folder.file("sheet.obj", &sheet()), folder.file("points.xyz", "0 0 0\n1 0 0\n"));
    let light = folder.0.join("light.ply");
    let neither = run(&[&"simplify", &sheet, &"-o", &light]);
    assert_eq!(neither.status.code(), Some(2), "{}", err(&neither));
    let bare = run(&[&"simplify", &points, &"-o", &light, &"--faces", &"3"]);
    assert!(!bare.status.success() && err(&bare).contains("no faces"), "{}", err(&bare));
    assert_eq!(folder.names(), ["points.xyz", "sheet.obj"]);
}

#[test]
fn denoise_without_a_surface_writes_the_points() {
    let folder = Folder::new("points-only");
    let scan = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/vase.ply");
    let points = folder.0.join("points.ply");
    let done = run(&[&"denoise", &scan, &"--points", &points, &"--surface", &"none"]);
    assert!(done.status.success() && !out(&done).contains("surface"), "{}{}", out(&done), err(&done));
    assert_eq!(folder.names(), ["points.ply"]);
    let both = run(&[&"denoise", &scan, &"-o", &points, &"--surface", &"none"]);
    assert_eq!(both.status.code(), Some(2));
}
