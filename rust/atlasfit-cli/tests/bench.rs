//! Claims about `atlasfit bench`: two builds are timed in turn.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output};

const BOX: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// `bench unwrap` of a box against another program, in a folder of its own.
fn against(folder: &str, other: &str) -> Output {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(folder);
    std::fs::create_dir_all(&folder).unwrap();
    let mesh = folder.join("box.obj");
    std::fs::write(&mesh, BOX).unwrap();
    Command::new(env!("CARGO_BIN_EXE_atlasfit"))
        .args(["bench", "unwrap", "--repeat", "2", "--json", "--quiet", "--against", other])
        .arg(&mesh)
        .output()
        .unwrap()
}

#[test]
fn two_builds_are_timed_in_turn_and_their_medians_compared() {
    let output = against("in-turn", env!("CARGO_BIN_EXE_atlasfit"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    let cells = said["cells"].as_array().unwrap();
    assert_eq!((cells.len(), cells[0]["cell"].as_str()), (1, Some("box")));
    let number = |v: &Value| v.as_f64().unwrap();
    let ratio = number(&cells[0]["seconds"]) / number(&cells[0]["against_seconds"]);
    assert!(ratio > 0.0 && (number(&cells[0]["ratio"]) / ratio - 1.0).abs() < 1e-9);
    assert_eq!(said["median_ratio"], cells[0]["ratio"]);
    assert_eq!(said["ratio_of_totals"], cells[0]["ratio"]);
}

#[test]
fn a_program_that_is_no_build_of_atlasfit_is_named() {
    for (other, why) in [("/no/such/program", "cannot start"), ("true", "said no JSON")] {
        let output = against(why, other);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(why) && said.contains(other) && said.contains("--against"), "{said}");
    }
}
