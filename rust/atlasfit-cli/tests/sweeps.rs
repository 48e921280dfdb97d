//! `denoise` of a scan in several files, and its sweeps moved together, as a user meets them.

mod common;

use common::{Folder, err, out, run};
use serde_json::Value;

/// A bumpy sheet as text, `up` higher; with a colour where asked for.
fn sheet(up: f64, color: &str) -> String {
    let point = |i: u32| {
        let (x, y) = (f64::from(i % 40) / 20.0, f64::from(i / 40) / 20.0);
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5;
        format!("{x} {y} {}{color}\n", up + 0.3 * (3.0 * x).sin() * (2.0 * y).cos() + 0.02 * noise)
    };
    (0..1600).map(point).collect()
}

#[test]
fn several_files_are_one_scan_and_their_sweeps_fit_once_they_are_moved() {
    let folder = Folder::new("sweeps");
    let [a, b, points] = ["a.xyz", "b.xyz", "points.ply"].map(|name| folder.0.join(name));
    std::fs::write(&a, sheet(0.0, "")).unwrap();
    std::fs::write(&b, sheet(0.05, " 255 0 0")).unwrap();
    let said = run(&[&"denoise", &a, &b, &"--points", &points, &"--force", &"--sweeps", &"file", &"--json"]);
    assert!(said.status.success(), "{}", err(&said));
    assert!(err(&said).contains("not all files have it alike: colors"), "{}", err(&said));
    let json: Value = serde_json::from_str(&out(&said)).unwrap();
    assert_eq!((json["points"].as_u64(), json["scans"].as_array().map(Vec::len)), (Some(3200), Some(2)));
    let moved = &json["registration"];
    assert!(moved["apart_after"].as_f64() < moved["apart_before"].as_f64().map(|x| 0.5 * x), "{moved}");
    let height = |sweep: usize| moved["sweeps"][sweep]["matrix"][2][3].as_f64().unwrap();
    assert!((height(0) - height(1) - 0.05).abs() < 0.01, "{moved}");
    let file = std::fs::read(&points).unwrap();
    let head = String::from_utf8_lossy(&file[..file.len().min(1000)]).into_owned();
    assert!(head.contains("property uint file\n"), "{head}");
}

#[test]
fn a_scan_without_that_attribute_is_refused_and_nothing_is_written() {
    let folder = Folder::new("no-sweeps");
    let [a, points] = ["a.xyz", "points.ply"].map(|name| folder.0.join(name));
    std::fs::write(&a, sheet(0.0, "")).unwrap();
    let said = run(&[&"denoise", &a, &"--points", &points, &"--sweeps", &"scan_id"]);
    assert!(!said.status.success() && err(&said).contains("no attribute of that name"), "{}", err(&said));
    assert!(!points.exists());
}
