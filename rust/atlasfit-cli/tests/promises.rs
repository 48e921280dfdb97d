//! Promises of the program: outputs checked before the work, one deadline, failures as JSON, `-`, odd names.

mod common;

use common::{Folder, command, err, out, run};
use serde_json::Value;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};

const CLOUD: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

fn example() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/vase.ply"))
}

/// Runs a command line of words; those with a slash in front are files of the folder.
fn words(folder: &Folder, line: &str) -> Output {
    let word = |w: &str| w.strip_prefix('/').map_or(PathBuf::from(w), |name| folder.0.join(name));
    command().args(line.split(' ').map(word)).output().unwrap()
}

/// Fails with this code and these words, long before any work could be done.
fn refused(folder: &Folder, line: &str, code: i32, text: &str) {
    let done = words(folder, line);
    assert_eq!(done.status.code(), Some(code), "{line}: {}", err(&done));
    assert!(err(&done).contains(text), "{line}: {}", err(&done));
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let folder = Folder::new("refused");
    folder.file("scan.xyz", CLOUD);
    folder.file("mesh.obj", SQUARE);
    std::fs::create_dir(folder.0.join("dir.ply")).unwrap();
    // The scan does not exist: what is said of the output is said before anything is read.
    for (line, code, text) in [
        ("denoise /none.ply -o /nowhere/out.ply", 1, "its folder does not exist"),
        ("denoise /none.ply -o /dir.ply", 1, "this is a folder"),
        ("denoise /none.ply -o /x.ply --points /x.ply", 2, "name the same file"),
        ("denoise /none.ply -o /x.ply --points /./x.ply", 2, "name the same file"),
        ("denoise /none.ply --points /p.stl", 2, "hold faces only"),
        ("denoise /none.ply -o /out.xyz", 2, "hold no faces"),
        ("denoise /none.ply -o /out.off --bake", 2, "hold no UVs"),
        ("convert /none.ply /out.las", 2, "only read"),
        ("convert /scan.xyz /scan.xyz", 2, "--force"),
        ("unwrap /mesh.obj -o /mesh.obj", 2, "--force"),
        ("render /none.ply -o /out.jpg", 2, "PNG"),
        ("convert /scan.xyz /out.stl", 2, "no faces"),
        ("convert /scan.xyz -", 2, "--output-format"),
        ("convert /scan.xyz /out.ply --output-format xyz", 2, "without a known extension"),
    ] {
        refused(&folder, line, code, text);
    }
    assert_eq!(folder.names(), ["dir.ply", "mesh.obj", "scan.xyz"], "nothing is left behind");
    let done = words(&folder, "convert /scan.xyz /scan.xyz --force");
    assert!(done.status.success(), "{}", err(&done));
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_a_read_only_file_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new("links");
    let scan = folder.file("scan.xyz", CLOUD);
    let (real, link, locked) =
        (folder.0.join("real.ply"), folder.0.join("link.ply"), folder.0.join("locked.ply"));
    std::fs::write(&real, "before").unwrap();
    std::fs::set_permissions(&real, PermissionsExt::from_mode(0o640)).unwrap();
    symlink("real.ply", &link).unwrap();
    symlink("scan.xyz", folder.0.join("scan-link.xyz")).unwrap();
    symlink("not-yet.ply", folder.0.join("dangling.ply")).unwrap();
    std::fs::write(&locked, "kept").unwrap();
    std::fs::set_permissions(&locked, PermissionsExt::from_mode(0o444)).unwrap();

    assert!(words(&folder, "convert /scan.xyz /link.ply").status.success());
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert!(std::fs::read(&real).unwrap().starts_with(b"ply"));
    assert_eq!(real.metadata().unwrap().permissions().mode() & 0o777, 0o640);
    assert!(words(&folder, "convert /scan.xyz /dangling.ply").status.success());
    assert!(std::fs::read(folder.0.join("not-yet.ply")).unwrap().starts_with(b"ply"));
    refused(&folder, "convert /scan.xyz /locked.ply", 1, "read-only");
    refused(&folder, "convert /scan.xyz /locked.ply --force", 1, "read-only");
    refused(&folder, "convert /scan.xyz /scan-link.xyz", 2, "--force");
    refused(&folder, "denoise /scan.xyz -o /real.ply --points /link.ply", 2, "name the same file");
    assert_eq!(std::fs::read(&locked).unwrap(), b"kept");
    assert_eq!(std::fs::read_to_string(&scan).unwrap(), CLOUD);
    let hidden: Vec<String> = folder.names().into_iter().filter(|n| n.starts_with('.')).collect();
    assert!(hidden.is_empty(), "{hidden:?}");
}

#[test]
fn the_time_limit_holds_for_reading_and_writing_too() {
    let folder = Folder::new("deadline");
    folder.file("scan.xyz", CLOUD);
    folder.file("mesh.obj", SQUARE);
    for line in [
        "convert /scan.xyz /out.ply",
        "info /scan.xyz",
        "measure /mesh.obj",
        "render /mesh.obj -o /out.png",
        "unwrap /mesh.obj -o /out.ply",
        "denoise /scan.xyz -o /out.ply",
    ] {
        // Over before the first byte is read.
        let done = words(&folder, &format!("{line} --time-limit 0.000001 --json"));
        assert_eq!(done.status.code(), Some(1), "{line}: {}", err(&done));
        let report: Value = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(report["error"]["kind"], "timed out", "{line}: {report}");
        assert!(report["error"]["text"].as_str().unwrap().contains("reading"), "{line}: {report}");
    }
    assert_eq!(folder.names(), ["mesh.obj", "scan.xyz"]);
}

#[test]
fn a_failure_is_an_object_too_and_every_report_holds_notes_and_warnings() {
    let folder = Folder::new("json");
    folder.file("scan.xyz", "0 0 0\n1 0 nan\n0 1 0\n");
    folder.file("mesh.obj", SQUARE);
    folder.file("broken.ply", "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\n");
    for (line, code, kind) in [
        ("info /none.ply --json", 1, "io"),
        ("info /broken.ply --json", 1, "malformed"),
        ("denoise /scan.xyz -o /out.jpg --json", 2, "usage"),
        ("denoise --json", 2, "usage"),
        ("measure /mesh.obj --against /mesh.obj --samples 0 --json", 2, "invalid argument"),
        ("convert /scan.xyz /out.stl --json", 2, "usage"),
    ] {
        let done = words(&folder, line);
        assert_eq!(done.status.code(), Some(code), "{line}: {}", err(&done));
        let report: Value = serde_json::from_slice(&done.stdout).unwrap_or_else(|e| panic!("{line}: {e}"));
        assert_eq!((&report["error"]["kind"], &report["exit_code"]), (&kind.into(), &code.into()), "{line}");
        assert!(
            report["error"]["text"].as_str().unwrap().len() > 10 && report["notes"].is_array(),
            "{report}"
        );
    }
    for line in [
        "convert /scan.xyz /out.ply",
        "info /scan.xyz",
        "measure /mesh.obj",
        "render /mesh.obj -o /out.png",
        "unwrap /mesh.obj -o /uv.ply",
    ] {
        let done = words(&folder, &format!("{line} --json --quiet"));
        let report: Value = serde_json::from_slice(&done.stdout).unwrap_or_else(|e| panic!("{line}: {e}"));
        assert!(report["notes"].is_array() && report["warnings"].is_array(), "{line}: {report}");
        assert!(!line.contains("scan.xyz") || report["notes"][0].as_str().unwrap().contains("not finite"));
    }
}

#[test]
fn a_minus_is_standard_input_and_standard_output() {
    let folder = Folder::new("streams");
    let piped = |args: &[&str], input: &[u8]| {
        let mut child = command()
            .args(args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(input).unwrap();
        child.wait_with_output().unwrap()
    };
    let done = piped(&["convert", "-", "-", "--output-format", "ply"], CLOUD.as_bytes());
    assert!(done.status.success() && done.stdout.starts_with(b"ply"), "{}", err(&done));
    assert!(err(&done).contains("4 points"), "the report goes to standard error: {}", err(&done));
    let loaded =
        atlasfit_io::load_bytes("a.ply".as_ref(), &done.stdout, &atlasfit_io::LoadOptions::default());
    assert_eq!(loaded.unwrap().cloud.len(), 4);

    let done = piped(&["info", "-", "--json", "-q"], SQUARE.as_bytes());
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!((&report["format"], &report["file"]), (&"OBJ".into(), &"-".into()));
    let done = piped(
        &["info", "-", "--json", "-q", "--input-format", "off"],
        b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    );
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(report["format"], "OFF", "without its keyword only the option tells: {report}");

    folder.file("mesh.obj", SQUARE);
    let done = words(&folder, "render /mesh.obj -o - --size 8x8");
    assert!(done.stdout.starts_with(b"\x89PNG"), "{}", err(&done));
    let done = words(&folder, "unwrap /mesh.obj -o - --output-format obj");
    assert!(out(&done).contains("vt ") && err(&done).contains("charts"), "{}", err(&done));
    let done = piped(&["measure", "-", "--against", "-"], SQUARE.as_bytes());
    assert_eq!(done.status.code(), Some(2), "{}", err(&done));
}

#[cfg(unix)]
#[test]
fn a_wait_for_standard_input_is_cancelled_and_limited() {
    let mut waiting = command()
        .args(["info", "-", "--time-limit", "0.2", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Nothing is ever written to it.
    let held = waiting.stdin.take();
    let done = waiting.wait_with_output().unwrap();
    drop(held);
    assert_eq!(done.status.code(), Some(1), "{}", err(&done));
    assert!(out(&done).contains("timed out"), "{}", out(&done));
}

#[cfg(target_os = "linux")]
#[test]
fn names_that_are_not_utf_8_work_in_every_command() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::new("names");
    let named = |bytes: &[u8]| folder.0.join(std::ffi::OsStr::from_bytes(bytes));
    let (mesh, uv, other, picture) =
        (named(b"m\xff.obj"), named(b"u\xff.obj"), named(b"c\xff.ply"), named(b"p\xff.png"));
    std::fs::write(&mesh, SQUARE).unwrap();
    let w: &dyn Fn(&'static str) -> &'static Path = &Path::new;
    for args in [
        vec![w("info"), &mesh],
        vec![w("unwrap"), &mesh, w("-o"), &uv],
        vec![w("convert"), &mesh, &other],
        vec![w("measure"), &mesh, w("--against"), &mesh],
        vec![w("render"), &mesh, w("-o"), &picture],
    ] {
        for json in [&["--json"][..], &[]] {
            let done = command().args(&args).args(json).output().unwrap();
            assert!(done.status.success(), "{args:?}: {}", err(&done));
            assert!(json.is_empty() || serde_json::from_slice::<Value>(&done.stdout).is_ok(), "{args:?}");
        }
    }
    let (scan, points) = (named(b"s\xff.ply"), named(b"d\xff.ply"));
    std::fs::copy(example(), &scan).unwrap();
    let done = run(&[&"denoise", &scan, &"--points", &points, &"--json", &"--time-limit", &"0.05"]);
    assert!(serde_json::from_slice::<Value>(&done.stdout).is_ok(), "{}", err(&done));
}

#[test]
fn the_program_names_itself_and_counts_and_options_read_well() {
    let folder = Folder::new("words");
    folder.file("scan.xyz", CLOUD);
    folder.file("mesh.obj", SQUARE);
    assert!(out(&run(&[&"--version"])).starts_with("atlasfit "));
    assert!(out(&run(&[&"denoise", &"--version"])).starts_with("atlasfit"));
    let text = out(&words(&folder, "measure /mesh.obj"));
    assert!(text.contains("in 1 loop\n") && text.contains("1 part\n"), "{text}");
    for (line, hint) in [
        ("denoise /scan.xyz -o /out.ply --noise -1", "give a positive number"),
        ("denoise /scan.xyz -o /out.ply --fill-holes -0.5", "give a number, 0 or more"),
        ("denoise /scan.xyz -o /out.ply --time-limit -3", "give a positive number of seconds"),
        ("unwrap /mesh.obj -o /out.ply --density -2", "Give a positive number"),
    ] {
        refused(&folder, line, 2, hint);
    }
}

#[test]
fn a_report_is_an_html_file_that_is_checked_before_the_work() {
    let folder = Folder::new("report");
    folder.file("mesh.obj", SQUARE);
    // The scan does not exist: what is said of the report is said before anything is read.
    refused(&folder, "denoise /none.ply -o /out.ply --report /out.ply", 2, "Use .html");
    refused(&folder, "denoise /none.ply -o /out.ply --report -", 2, "Use .html");
    refused(&folder, "unwrap /mesh.obj -o /out.obj --report /missing/page.html", 1, "missing");
    assert_eq!(folder.names(), ["mesh.obj"]);
    let done = words(&folder, "unwrap /mesh.obj -o /out.obj --report /page.html --json");
    let told: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(told["files"].as_array().map(Vec::len), Some(2), "{}", err(&done));
    let page = std::fs::read_to_string(folder.0.join("page.html")).unwrap();
    assert!(page.contains("2 triangles unwrapped") && page.ends_with("</html>\n"));
}
