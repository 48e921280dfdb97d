//! `atlasfit denoise` as a user meets it: what it reports, what its options do, what bad scans get.

mod common;

use common::{Folder, command, err, out, run};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Runs, but fails the test when the program does not end in time.
fn run_for(seconds: u64, args: &[&dyn AsRef<std::ffi::OsStr>]) -> Output {
    let mut child = command()
        .args(args.iter().map(|a| a.as_ref()))
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let started = std::time::Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed().as_secs() > seconds {
            child.kill().unwrap();
            panic!("hangs: {:?}", args.iter().map(|a| a.as_ref()).collect::<Vec<_>>());
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/vase.ply")
}

#[test]
fn spikes_of_a_mesh_are_put_between_their_neighbours_and_counted() {
    let folder = Folder::new("spikes");
    let (mesh, points) = (folder.0.join("sheet.obj"), folder.0.join("points.xyz"));
    let mut text: String = (0..1600u32)
        .map(|i| {
            let noise = 0.1 * ((f64::from(i) * 12.9898).sin() * 43758.5453).fract();
            let z = if i == 820 { 12.0 } else { noise };
            format!("v {} {} {z}\n", i % 40, i / 40)
        })
        .collect();
    for a in (0..39 * 39).map(|i| i / 39 * 40 + i % 39 + 1) {
        text += &format!("f {} {} {} {}\n", a, a + 1, a + 41, a + 40);
    }
    std::fs::write(&mesh, text).unwrap();
    let arguments: [&dyn AsRef<std::ffi::OsStr>; 5] = [&"denoise", &mesh, &"--points", &points, &"--force"];
    let said = run(&arguments);
    assert!(
        out(&said).contains("1 point set aside, 1 put between their neighbours in the mesh"),
        "{}",
        out(&said)
    );
    let rows = std::fs::read_to_string(&points).unwrap();
    let spike: Vec<f64> = rows
        .lines()
        .filter(|l| !l.starts_with('#'))
        .nth(820)
        .unwrap()
        .split_whitespace()
        .map(|x| x.parse().unwrap())
        .collect();
    assert!(
        (spike[0] - 20.0).abs() < 0.1 && (spike[1] - 20.0).abs() < 0.1 && spike[2].abs() < 0.1,
        "{spike:?}"
    );
    let json = run(&[&"denoise", &mesh, &"--points", &points, &"--force", &"--json"]);
    let report: Value = serde_json::from_str(&out(&json)).unwrap();
    assert_eq!((&report["outliers"], &report["followed_outliers"]), (&1.into(), &1.into()));
}

#[test]
fn denoise_turns_the_example_scan_into_points_and_one_surface_whatever_the_threads() {
    let folder = Folder::new("denoise");
    let made = |threads: &str| {
        let (mesh, cloud) =
            (folder.0.join(format!("{threads}.ply")), folder.0.join(format!("{threads}-points.ply")));
        let output = run(&[
            &"denoise",
            &example(),
            &"-o",
            &mesh,
            &"--points",
            &cloud,
            &"--json",
            &"--threads",
            &threads,
        ]);
        assert!(output.status.success(), "{}", err(&output));
        let report: Value = serde_json::from_str(&out(&output)).unwrap();
        (report, std::fs::read(&mesh).unwrap(), std::fs::read(&cloud).unwrap())
    };
    let (report, mesh, cloud) = made("1");
    let (_, mesh2, cloud2) = made("3");
    assert!(mesh == mesh2 && cloud == cloud2, "the same bytes for any number of threads");
    assert_eq!(report["points"], 20_000);
    assert!(report["faces"].as_u64().unwrap() > 1000);
    let noise = report["noise"].as_f64().unwrap();
    assert!((0.4e-3..0.8e-3).contains(&noise), "the scan was made with 0.6 mm of noise, not {noise}");

    let denoised =
        atlasfit_io::load(&folder.0.join("1-points.ply"), &atlasfit_io::LoadOptions::default()).unwrap();
    assert_eq!(denoised.cloud.len(), 20_000, "every point, in input order");
    let topology: Value =
        serde_json::from_str(&out(&run(&[&"measure", &folder.0.join("1.ply"), &"--json"]))).unwrap();
    assert_eq!(topology["topology"]["non_manifold_edges"], 0);
    assert_eq!(topology["topology"]["inconsistent_edges"], 0);
}

/// A scan of a ball of radius `r` about `x` on the first axis: `n` points.
fn ball(n: usize, r: f64, x: f64) -> String {
    let point = |i| {
        let (z, turn) = (1.0 - (2 * i + 1) as f64 / n as f64, 2.4 * i as f64);
        let ring = r * (1.0 - z * z).sqrt();
        format!("{} {} {}\n", x + ring * turn.cos(), ring * turn.sin(), r * z)
    };
    (0..n).map(point).collect()
}

/// Denoises a scan into `out.ply` of the folder.
fn denoise(folder: &Folder, scan: &Path, more: &[&str]) -> Output {
    let args = ["denoise", "--no-uv", "--json", "--quiet"];
    command().args(args).args(more).arg(scan).arg("-o").arg(folder.0.join("out.ply")).output().unwrap()
}

#[test]
fn parts_that_are_too_small_are_left_out_and_counted_and_a_share_none_has_is_an_error() {
    let folder = Folder::new("parts");
    // Two balls: the second has a quarter of the points and a ninth of the area of both.
    let scan = folder.file("balls.xyz", &(ball(1600, 1.0, 0.0) + &ball(400, 0.35, 3.0)));
    let denoise = |more: &[&str]| denoise(&folder, &scan, more);
    let output = denoise(&["--min-part", "0.2"]);
    assert!(output.status.success(), "{}", err(&output));
    let said: Value = serde_json::from_str(&out(&output)).unwrap();
    let count = |key: &str| said[key].as_u64();
    assert_eq!(
        [count("parts"), count("dropped_parts"), count("dropped_points"), count("points")],
        [Some(1), Some(1), Some(400), Some(2000)]
    );
    let output = denoise(&["--min-part", "0.95"]);
    let said: Value = serde_json::from_str(&out(&output)).unwrap();
    let text = said["error"]["text"].as_str().unwrap();
    assert!(text.contains("0.95") && text.contains("the largest has 0.8"), "{text}");
    assert_eq!((output.status.code(), folder.names().len()), (Some(2), 2), "{text}");
}

#[test]
fn a_surface_has_as_many_triangles_as_points_or_as_asked_for_and_a_solid_keeps_its_own() {
    let folder = Folder::new("faces");
    let scan = folder.file("ball.xyz", &ball(2000, 1.0, 0.0));
    let denoise = |more: &[&str]| denoise(&folder, &scan, more);
    let output = denoise(&["--faces", "1000"]);
    let said: Value = serde_json::from_str(&out(&output)).unwrap();
    assert!((998..=1000).contains(&said["faces"].as_u64().unwrap()), "{said}");
    let faces = |more: &[&str]| {
        serde_json::from_str::<Value>(&out(&denoise(more))).unwrap()["faces"].as_u64().unwrap()
    };
    assert!((1000..=2400).contains(&faces(&[])), "about as many as points");
    assert!(faces(&["--max-error", "0"]) > 3 * 2000, "as it is contoured");
    for wrong in [&["--faces", "0"][..], &["--max-error", "-1"], &["--faces", "9", "--watertight"]] {
        assert_eq!(denoise(wrong).status.code(), Some(2), "{wrong:?}");
    }
}

/// Random points in the cube from -1 to 1 that are `wanted` by their squared distance from its middle.
fn volume(wanted: fn(f64) -> bool) -> String {
    let mut state = 9u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let random = std::iter::repeat_with(|| [uniform(), uniform(), uniform()]);
    let inside = random.filter(|p| wanted(p.iter().map(|x| x * x).sum()));
    inside.take(3000).map(|[x, y, z]| format!("{x} {y} {z}\n")).collect()
}

#[test]
fn points_that_fill_a_volume_are_told_so_and_scans_are_not() {
    let folder = Folder::new("volume");
    let said = |output: Output| -> Value { serde_json::from_str(&out(&output)).unwrap() };
    let told = |said: &Value| said["warnings"].to_string().contains("the points fill a volume");
    for wanted in [|_| true, |r| r < 1.0, |r| (0.25..1.0).contains(&r)] as [fn(f64) -> bool; 3] {
        let scan = folder.file("volume.xyz", &volume(wanted));
        assert!(told(&said(denoise(&folder, &scan, &["--force"]))));
        let output = run(&[&"denoise", &scan, &"--no-uv", &"--force", &"-o", &folder.0.join("out.ply")]);
        assert!(err(&output).contains("warning: the points fill a volume"), "{}", err(&output));
    }
    for scan in scans() {
        let said = said(denoise(&folder, &scan, &["--force"]));
        assert!(said["points"].as_u64() > Some(0) && !told(&said), "{}: {said}", scan.display());
    }
}

/// The example, and real scans where they lie beside the repository.
fn scans() -> Vec<PathBuf> {
    let real = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/scans");
    let names = ["owl_sfm.ply", "building_lidar.ply", "polyhedral_ball_scan.ply"];
    let real = names.iter().map(|name| real.join(name)).filter(|path| path.exists());
    std::iter::once(example()).chain(real).collect()
}

#[test]
fn strength_moves_points_ever_farther_and_0_not_at_all() {
    let folder = Folder::new("strength");
    let read = |path: &Path| {
        let loaded = atlasfit_io::load(path, &atlasfit_io::LoadOptions::default()).unwrap();
        loaded.cloud.positions
    };
    let points = folder.0.join("points.ply");
    for scan in scans() {
        let before = read(&scan);
        let moved = |strength: &str| {
            let output =
                run(&[&"denoise", &scan, &"--points", &points, &"--strength", &strength, &"--quiet"]);
            assert!(output.status.success(), "{}", err(&output));
            let pairs = before.iter().flatten().zip(read(&points).into_iter().flatten());
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        };
        let way = ["0", "0.5", "1", "2", "4"].map(moved);
        assert_eq!(way[0], 0.0, "{scan:?}");
        assert!(way.windows(2).all(|w| w[0] < w[1]), "{scan:?}: {way:?}");
    }
    for wrong in ["-1", "nan", "inf", "much"] {
        let output = denoise(&folder, &example(), &["--strength", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn bad_scans_give_a_result_or_a_clear_error_and_never_touch_the_output_on_failure() {
    let folder = Folder::new("bad");
    let many = |line: &str, n: usize| line.repeat(n);
    let collinear: String = (0..500).map(|i| format!("{i} {i} {i}\n")).collect();
    let ramp: String =
        (0..400).map(|i| format!("{} {} {}\n", i % 20, i / 20, (i % 7) as f64 * 1e-3)).collect();
    let tiny: String = (0..400).map(|i| format!("{}e-9 {}e-9 0\n", i % 20, i / 20)).collect();
    let far: String =
        (0..400).map(|i| format!("{} {} 1e9\n", 1e9 + f64::from(i % 20), 1e9 + f64::from(i / 20))).collect();
    for (name, content) in [
        ("empty.xyz", String::new()),
        ("one.xyz", "1 2 3\n".into()),
        ("two.xyz", "1 2 3\n4 5 6\n".into()),
        ("three.xyz", "0 0 0\n1 0 0\n0 1 0\n".into()),
        ("equal.xyz", many("1 2 3\n", 5000)),
        ("collinear.xyz", collinear),
        ("nan.xyz", many("nan nan nan\n", 50)),
        ("some-nan.xyz", format!("nan 0 0\n{ramp}inf 1 1\n")),
        ("duplicates.xyz", many(&ramp, 8)),
        ("tiny.xyz", tiny),
        ("far.xyz", far),
    ] {
        let scan = folder.file(name, &content);
        let before = folder.file("before.ply", "what was there");
        let output = run_for(60, &[&"denoise", &scan, &"-o", &before]);
        match output.status.code() {
            Some(0) => {
                let mesh = atlasfit_io::load(&before, &atlasfit_io::LoadOptions::default()).unwrap();
                assert!(mesh.cloud.positions.iter().flatten().all(|x| x.is_finite()), "{name}");
            }
            Some(1) => {
                assert!(!err(&output).contains("internal error"), "{name}: {}", err(&output));
                assert_eq!(std::fs::read_to_string(&before).unwrap(), "what was there", "{name}");
            }
            code => panic!("{name}: {code:?} {}", err(&output)),
        }
    }
    let left: Vec<String> =
        folder.names().into_iter().filter(|n| n.contains("part") || n.contains("tmp")).collect();
    assert!(left.is_empty(), "{left:?}");
}
