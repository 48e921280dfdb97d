//! Claims about `atlasfit gp`: figures come as pictures and as text, and say what they show.

mod common;

use common::{Folder, command, err};

#[test]
fn a_figure_is_a_png_and_an_svg_with_its_labels() {
    let folder = Folder::new("gp-figures");
    let to = folder.0.join("figures");
    let output = command()
        .args(["gp", "figures", "--only", "convolution", "--quiet", "--json", "-o"])
        .arg(&to)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", err(&output));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(said["files"].as_array().unwrap().len(), 2);
    let png = std::fs::read(to.join("convolution.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG") && png.len() > 10_000);
    let svg = std::fs::read_to_string(to.join("convolution.svg")).unwrap();
    for label in ["columns apart", "correlation", "3 blocks"] {
        assert!(svg.contains(label), "{label}");
    }
}

#[test]
fn tables_are_numbers_in_json_and_only_those_asked_for() {
    let output = command().args(["gp", "report", "--only", "width,batch-norm", "--json"]).output().unwrap();
    assert!(output.status.success(), "{}", err(&output));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let slope = said["width"]["rows"][0]["slope (limit -0.5)"].as_f64().unwrap();
    assert!((slope + 0.5).abs() < 0.1, "{slope}");
    assert!(said["bridge"].is_null());
}

#[test]
fn what_cannot_be_drawn_is_said_before_the_work() {
    let folder = Folder::new("gp-refused");
    let file = folder.file("taken", "");
    let output = command().args(["gp", "figures", "-o"]).arg(&file).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", err(&output));
    assert!(err(&output).contains("taken"));
    let output = command().args(["gp", "figures", "-o", "x", "--only", "nothing"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(err(&output).contains("spectrum"), "{}", err(&output));
    let few = folder.file("few.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n");
    let output = command().args(["gp", "report", "--scan"]).arg(&few).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("too few points"), "{}", err(&output));
}
