//! `atlasfit unwrap` told where seams may be, as a user runs it.

mod common;

use common::*;
use std::path::PathBuf;

/// A fluted half pipe of squares, as ASCII PLY, whose vertices say that seams are cheap in some bands.
fn pipe(folder: &Folder) -> PathBuf {
    let mut text = String::from("ply\nformat ascii 1.0\nelement vertex 1681\n");
    for name in ["x", "y", "z", "price"] {
        text += &format!("property float {name}\n");
    }
    text += "element face 1600\nproperty list uchar int vertex_indices\nend_header\n";
    for i in 0..41 * 41 {
        let (turn, y) = (3.0 * f64::from(i % 41) / 40.0, f64::from(i / 41) / 10.0);
        let r = (1.0 + 0.3 * (1.5 * y).sin()) * (1.0 + 0.25 * (6.0 * turn).cos());
        let price = if i / 41 % 8 < 2 { 0.1 } else { 1.0 };
        text += &format!("{} {y} {} {price}\n", r * turn.cos(), r * turn.sin());
    }
    for i in 0..1600 {
        let a = i / 40 * 41 + i % 40;
        text += &format!("4 {a} {} {} {}\n", a + 1, a + 42, a + 41);
    }
    folder.file("pipe.ply", &text)
}

#[test]
fn an_attribute_prices_seams_and_they_are_hidden_where_that_is_asked_for() {
    let folder = Folder::new("seams");
    let (pipe, made) = (pipe(&folder), folder.0.join("made.obj"));
    let layout = |options: &[&str]| {
        let mut args: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"unwrap", &pipe, &"-o", &made];
        args.extend(options.iter().map(|o| o as &dyn AsRef<std::ffi::OsStr>));
        let done = run(&args);
        assert!(done.status.success(), "{}", err(&done));
        std::fs::read_to_string(&made).unwrap()
    };
    let plain = layout(&[]);
    assert!(plain != layout(&["--seam-price", "price"]));
    assert!(plain != layout(&["--seams-hidden", "1", "--up", "0,1,0"]));
    let seen = |up: &str| {
        let json = out(&run(&[&"measure", &made, &"--up", &up, &"--json"]));
        serde_json::from_str::<serde_json::Value>(&json).unwrap()["uv"]["seams_seen"].as_f64().unwrap()
    };
    assert!(seen("0,1,0") != seen("0,-1,0"));
}

#[test]
fn what_is_no_price_is_refused_and_nothing_is_written() {
    let folder = Folder::new("seams-wrong");
    let (pipe, made) = (pipe(&folder), folder.0.join("made.obj"));
    for (options, said) in [
        (["--seam-price", "cost"], "no attribute \"cost\" of one number per vertex. It has: price"),
        (["--seams-hidden", "2"], "give a share, 0 to 1"),
        (["--up", "0,0,1"], "--seams-hidden"),
    ] {
        let done = run(&[&"unwrap", &pipe, &"-o", &made, &options[0], &options[1]]);
        assert!(!done.status.success() && err(&done).contains(said), "{}", err(&done));
    }
    let flat = run(&[&"unwrap", &pipe, &"-o", &made, &"--seams-hidden", &"1", &"--up", &"0,0,0"]);
    assert!(err(&flat).contains("give a direction"), "{}", err(&flat));
    assert!(!made.exists());
}
