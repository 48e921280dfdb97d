//! The program as a user meets it: exit codes, what goes to which stream, files that stay untouched.

mod common;

use common::{Folder, command, err, out, run};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// A unit cube without its top, with one chart per side laid out in a row.
const BOX: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    vt 0 0\nvt 0.19 0\nvt 0.19 0.19\nvt 0 0.19\nvt 0.2 0\nvt 0.39 0\nvt 0.39 0.19\nvt 0.2 0.19\n\
    vt 0.4 0\nvt 0.59 0\nvt 0.59 0.19\nvt 0.4 0.19\nvt 0.6 0\nvt 0.79 0\nvt 0.79 0.19\nvt 0.6 0.19\n\
    vt 0.8 0\nvt 0.99 0\nvt 0.99 0.19\nvt 0.8 0.19\nf 4/1 3/2 2/3 1/4\nf 1/5 2/6 6/7 5/8\n\
    f 2/9 3/10 7/11 6/12\nf 3/13 4/14 8/15 7/16\nf 4/17 1/18 5/19 8/20\n";

// Over 80 lines: a list of command lines.
#[test]
fn wrong_command_lines_exit_with_2_and_failed_work_with_1() {
    let folder = Folder::new("codes");
    let mesh = folder.file("box.obj", BOX);
    let cloud = folder.file("cloud.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    let picture = folder.0.join("out.png");
    for (code, args) in [
        (2, vec!["measure".as_ref()]),
        (
            2,
            vec![
                "render".as_ref(),
                mesh.as_os_str(),
                "-o".as_ref(),
                picture.as_os_str(),
                "--view".as_ref(),
                "up".as_ref(),
            ],
        ),
        (
            2,
            vec![
                "render".as_ref(),
                mesh.as_os_str(),
                "-o".as_ref(),
                picture.as_os_str(),
                "--size".as_ref(),
                "0x9".as_ref(),
            ],
        ),
        (2, vec!["measure".as_ref(), cloud.as_os_str()]),
        (2, vec!["measure".as_ref(), mesh.as_os_str(), "--against".as_ref(), cloud.as_os_str()]),
        (
            2,
            vec![
                "measure".as_ref(),
                mesh.as_os_str(),
                "--against".as_ref(),
                mesh.as_os_str(),
                "--samples".as_ref(),
                "0".as_ref(),
            ],
        ),
        (2, vec!["denoise".as_ref(), cloud.as_os_str(), "-o".as_ref(), "out.unknown".as_ref()]),
        (2, vec!["denoise".as_ref(), cloud.as_os_str()]),
        (
            2,
            vec![
                "denoise".as_ref(),
                cloud.as_os_str(),
                "-o".as_ref(),
                "out.ply".as_ref(),
                "--noise".as_ref(),
                "-1".as_ref(),
            ],
        ),
        (
            2,
            vec![
                "denoise".as_ref(),
                cloud.as_os_str(),
                "-o".as_ref(),
                "out.ply".as_ref(),
                "--min-part".as_ref(),
                "1.5".as_ref(),
            ],
        ),
        (1, vec!["measure".as_ref(), "no such file.ply".as_ref()]),
        (1, vec!["denoise".as_ref(), "no such file.ply".as_ref(), "-o".as_ref(), "out.ply".as_ref()]),
        (
            1,
            vec![
                "render".as_ref(),
                cloud.as_os_str(),
                "-o".as_ref(),
                picture.as_os_str(),
                "--mode".as_ref(),
                "uv".as_ref(),
            ],
        ),
        (0, vec!["--help".as_ref()]),
        (0, vec!["--version".as_ref()]),
    ] as [(i32, Vec<&std::ffi::OsStr>); 15]
    {
        let output = command().args(&args).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", err(&output));
        assert_eq!(err(&output).is_empty(), code == 0, "{args:?}: an error says why");
        if code == 1 {
            assert!(out(&output).is_empty() && err(&output).lines().count() == 1, "{}", err(&output));
        }
    }
    assert_eq!(folder.names(), ["box.obj", "cloud.xyz"], "no failed command left a file");
}

#[test]
fn measure_reports_topology_uvs_and_distances_as_text_and_as_json() {
    let folder = Folder::new("measure");
    let mesh = folder.file("box.obj", BOX);
    let text = out(&run(&[&"measure", &mesh]));
    assert!(text.contains("10 faces, 1 part") && text.contains("4 edges in 1 loop"), "{text}");
    assert!(text.contains("0 flips, 0 overlapping faces"), "{text}");

    let output = run(&[&"measure", &mesh, &"--against", &mesh, &"--json"]);
    let json: Value = serde_json::from_str(&out(&output)).unwrap();
    assert_eq!(json["topology"]["boundary_edges"], 4);
    assert_eq!(json["uv"]["charts"], 5);
    assert!((json["uv"]["stretch_l2"].as_f64().unwrap() - 1.0).abs() < 1e-6);
    assert!(json["surface"]["accuracy"]["max"].as_f64().unwrap() < 1e-12);
    assert!((json["surface"]["threshold"].as_f64().unwrap() - 0.005).abs() < 1e-12);

    let cloud = folder.file("cloud.xyz", "0.5 0.5 -0.1\n0.2 0.2 -0.1\n");
    let json: Value =
        serde_json::from_str(&out(&run(&[&"measure", &cloud, &"--against", &mesh, &"--json"]))).unwrap();
    assert!((json["points"]["accuracy"]["rms"].as_f64().unwrap() - 0.1).abs() < 1e-12);
}

#[test]
fn presets_of_unwrap_are_names_for_bounds_and_a_bound_of_ones_own_wins() {
    let folder = Folder::new("presets");
    let cube = folder.file("box.obj", BOX);
    let made = folder.0.join("out.obj");
    let bound = |more: &[&str]| {
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            vec![&"unwrap", &cube, &"-o", &made, &"--json", &"--force"];
        more.iter().for_each(|m| arguments.push(m));
        let output = run(&arguments);
        assert!(output.status.success(), "{}", err(&output));
        serde_json::from_str::<Value>(&out(&output)).unwrap()["stretch_bound"].as_f64().unwrap()
    };
    let [few, balanced, low] =
        ["few-seams", "balanced", "low-stretch"].map(|name| bound(&["--preset", name]));
    assert!(few > balanced && balanced == bound(&[]) && balanced > low, "{few} {balanced} {low}");
    assert_eq!(bound(&["--preset", "few-seams", "--max-stretch", "1.07"]), 1.07);
    let wrong = run(&[&"unwrap", &cube, &"-o", &made, &"--preset", &"best"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(err(&wrong).contains("[possible values: few-seams, balanced, low-stretch]"), "{}", err(&wrong));
}

#[test]
fn the_same_seed_gives_the_same_report_for_any_number_of_threads() {
    let folder = Folder::new("seed");
    let mesh = folder.file("box.obj", BOX);
    let report = |seed: &str, threads: &str| {
        out(&run(&[
            &"measure",
            &mesh,
            &"--against",
            &mesh,
            &"--json",
            &"--seed",
            &seed,
            &"--threads",
            &threads,
        ]))
    };
    assert_eq!(report("1", "1"), report("1", "3"));
    assert_ne!(report("1", "1"), report("2", "1"));
}

#[test]
fn quiet_says_what_was_asked_for_only_and_progress_never_mixes_with_the_report() {
    let folder = Folder::new("quiet");
    let mesh = folder.file("box.obj", BOX);
    let output = run(&[&"convert", &mesh, &folder.0.join("box.ply"), &"--quiet"]);
    assert!(out(&output).is_empty() && err(&output).is_empty());
    let output = run(&[&"measure", &mesh, &"--against", &mesh, &"--quiet"]);
    assert!(out(&output).starts_with("accuracy") && err(&output).is_empty());
    let output = run(&[&"measure", &mesh, &"--against", &mesh, &"--json"]);
    assert!(serde_json::from_str::<Value>(&out(&output)).is_ok());
}

fn pixels(path: &Path) -> (u32, u32, Vec<u8>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    data.truncate(info.buffer_size());
    (info.width, info.height, data)
}

#[test]
fn pictures_show_the_surface_its_back_and_its_boundary() {
    let folder = Folder::new("render");
    let mesh = folder.file("box.obj", BOX);
    let picture = folder.0.join("out.png");
    let share = |args: &[&str], is: fn([u8; 3]) -> bool| {
        let output = command()
            .args([
                "render",
                mesh.to_str().unwrap(),
                "-o",
                picture.to_str().unwrap(),
                "--size",
                "200x120",
                "--up",
                "z",
            ])
            .args(args)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", err(&output));
        let (w, h, data) = pixels(&picture);
        assert_eq!((w, h), (200, 120));
        data.chunks_exact(3).filter(|p| is([p[0], p[1], p[2]])).count() as f64 / f64::from(w * h)
    };
    let white: fn([u8; 3]) -> bool = |p| p == [255; 3];
    let orange: fn([u8; 3]) -> bool = |[r, _, b]| r > 40 && u32::from(r) * 2 > u32::from(b) * 5;
    let red: fn([u8; 3]) -> bool = |[r, g, b]| r > 200 && g < 60 && b < 60;
    // From the front a square as high as the picture but for its margins; from the top one looks into the
    // box.
    assert!((share(&[], white) - (1.0 - 0.92 * 0.92 * 0.6)).abs() < 0.02);
    assert!(share(&[], orange) < 0.001);
    assert!(share(&["--view", "top"], orange) > 0.45);
    assert!(share(&["--view", "top"], red) < 0.001 && share(&["--view", "top", "--boundary"], red) > 0.02);
    for mode in ["charts", "checker", "uv", "wire", "points"] {
        assert!(share(&["--mode", mode, "--view", "30,30"], white) < 0.999, "{mode}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_exits_with_130_and_leaves_no_output() {
    let folder = Folder::new("interrupt");
    let mesh = folder.file("box.obj", BOX);
    // So many samples that it runs for seconds.
    let mut child = command()
        .args(["measure", mesh.to_str().unwrap(), "--against", mesh.to_str().unwrap()])
        .args(["--samples", "1000000", "--chamfer-samples", "1000000"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(400));
    assert!(child.try_wait().unwrap().is_none(), "still at work");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", err(&output));
    assert!(err(&output).contains("cancelled"));
}

#[test]
fn limits_are_errors_that_name_the_limit() {
    let folder = Folder::new("limits");
    let mesh = folder.file("box.obj", BOX);
    let output =
        run(&[&"measure", &mesh, &"--against", &mesh, &"--time-limit", &"0.05", &"--samples", &"1000000"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("time limit of 0.05 s"), "{}", err(&output));
    let picture = folder.0.join("out.png");
    let output = run(&[&"render", &mesh, &"-o", &picture, &"--size", &"2000x2000", &"--max-memory", &"1M"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("limit of 1.0 MB") && !picture.exists(), "{}", err(&output));
    let output = run(&[&"measure", &mesh, &"--max-memory", &"100"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("limit of 100 bytes"), "{}", err(&output));
    let unwrapped = folder.0.join("unwrapped.ply");
    let output = run(&[&"unwrap", &mesh, &"-o", &unwrapped, &"--max-memory", &"100k"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("simplify the mesh") && !unwrapped.exists(), "{}", err(&output));
}

#[test]
fn info_tells_counts_columns_extent_and_defects() {
    let folder = Folder::new("info");
    let report = |path: &Path| -> Value {
        let output = run(&[&"info", &path, &"--json", &"--quiet"]);
        assert!(output.status.success(), "{}", err(&output));
        serde_json::from_str(&out(&output)).unwrap()
    };
    let mesh = report(&folder.file("box.obj", BOX));
    assert_eq!((&mesh["format"], &mesh["points"], &mesh["faces"]), (&"OBJ".into(), &8.into(), &10.into()));
    assert_eq!(mesh["extent"]["max"], serde_json::json!([1.0, 1.0, 1.0]));
    assert_eq!((&mesh["parts"], &mesh["topology"]["boundary_edges"]), (&1.into(), &4.into()));
    assert_eq!(mesh["attributes"][0]["name"], "uv");
    assert_eq!(mesh["repairs"][0]["what"], "polygons, cut into triangles");

    // A face twice, one collapsed, a vertex that no face uses.
    let odd = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\nf 3 1 2\nf 1 1 2\n";
    let odd = report(&folder.file("odd.obj", odd));
    assert_eq!(odd["duplicate_faces"], 1);
    let warnings = odd["warnings"].to_string();
    assert!(warnings.contains("1 faces repeat") && warnings.contains("1 vertices belong"), "{warnings}");
    assert!(odd["spacing"].is_null() && warnings.contains("only 4 distinct points"), "{warnings}");

    // Two flat grids far apart, one point at a place twice, one not finite, far from the origin.
    let grid: String = (0..800)
        .map(|i| format!("{} {} {}\n", 1e7 + f64::from(i % 20), i / 20 % 20, i / 400 * 1000))
        .collect();
    let cloud = report(&folder.file("grids.xyz", &format!("{grid}10000000 0 0\nnan 0 0\n")));
    assert_eq!((&cloud["not_finite"], &cloud["duplicates"]), (&1.into(), &1.into()));
    assert_eq!((&cloud["parts"], &cloud["stray"]), (&2.into(), &0.into()));
    assert!((cloud["spacing"].as_f64().unwrap() - 1.0).abs() < 0.3, "{}", cloud["spacing"]);
    assert!(cloud["noise"].as_f64().unwrap() < 1e-3, "{}", cloud["noise"]);
    assert!(cloud["warnings"].to_string().contains("32-bit"), "{}", cloud["warnings"]);

    let text = out(&run(&[&"info", &folder.0.join("box.obj")]));
    assert!(text.contains("8 points, 10 faces") && text.contains("genus 0"), "{text}");
    // The limit holds for reading and for what comes after.
    for limit in ["100", "100000"] {
        let output = run(&[&"info", &folder.0.join("grids.xyz"), &"--max-memory", &limit]);
        assert_eq!(output.status.code(), Some(1), "{limit}");
        assert!(err(&output).contains("memory"), "{}", err(&output));
    }
}

#[test]
fn convert_keeps_the_data_and_says_what_it_cannot_keep() {
    let folder = Folder::new("convert");
    let mesh = folder.file("box.obj", BOX);
    let load =
        |path: &Path| atlasfit_io::load(path, &atlasfit_io::LoadOptions::default()).unwrap().into_mesh();
    let there = folder.0.join("box.ply");
    assert!(run(&[&"convert", &mesh, &there]).status.success());
    assert_eq!(load(&mesh), load(&there));

    let output = run(&[&"convert", &there, &folder.0.join("box.stl"), &"--json"]);
    assert!(err(&output).contains("not kept: texture coordinates"), "{}", err(&output));
    let report: Value = serde_json::from_str(&out(&output)).unwrap();
    assert_eq!(
        (&report["format"], &report["written"], &report["faces"]),
        (&"PLY".into(), &"STL".into(), &10.into())
    );
    assert!(report["lost"].to_string().contains("texture coordinates"));

    let cloud = folder.file("cloud.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    for (from, to) in [(&cloud, "cloud.stl"), (&mesh, "box.las"), (&mesh, "box.unknown")] {
        let output = run(&[&"convert", from, &folder.0.join(to)]);
        assert_eq!(output.status.code(), Some(2), "{to}");
        assert!(!folder.0.join(to).exists());
    }
}

#[test]
fn the_papers_bench_keeps_each_result_and_does_not_do_it_again() {
    let folder = Folder::new("paper");
    let fits = || {
        let run = run(&[&"bench", &"paper", &"--quick", &"--only", &"dots", &"-o", &folder.0]);
        assert!(run.status.success(), "{}", err(&run));
        (out(&run), std::fs::read_to_string(folder.0.join("results.jsonl")).unwrap())
    };
    let (report, results) = fits();
    assert_eq!(results.lines().count(), 1);
    assert!(report.contains("dotted drawing") && folder.names().contains(&"dots-curve.png".to_string()));
    assert_eq!(fits(), (report, results));
}

#[test]
#[cfg(not(feature = "xatlas"))]
fn a_program_without_xatlas_says_how_to_build_it_in() {
    let folder = Folder::new("xatlas");
    let (mesh, uv) = (folder.file("box.obj", BOX), folder.0.join("out.obj"));
    let output = run(&[&"unwrap", &mesh, &"-o", &uv, &"--packer", &"xatlas"]);
    assert_eq!(output.status.code(), Some(2), "{}", err(&output));
    assert!(err(&output).contains("--features xatlas"), "{}", err(&output));
    assert_eq!(folder.names(), ["box.obj"]);
}
