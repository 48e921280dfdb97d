//! No file breaks the readers: cut anywhere, with bytes changed, every file gives a valid result or an error.
//! Runs over small files of every format made here, and over the zoo of difficult files where that lies
//! beside the repository.

mod common;

use atlasfit_io::{LoadOptions, Loaded, SaveMesh, load, load_bytes, save_mesh};
use std::path::{Path, PathBuf};

/// A limit that no damaged file of a few hundred kilobytes has a reason to reach.
const MEMORY: u64 = 1 << 30;

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }
}

/// What every loaded file must satisfy, however it got here.
fn check(name: &str, l: &Loaded) {
    let n = l.cloud.len();
    assert!(l.cloud.normals.as_ref().is_none_or(|c| c.len() == n), "{name}: normals");
    assert!(l.cloud.colors.as_ref().is_none_or(|c| c.len() == n), "{name}: colours");
    assert!(
        l.cloud.attributes.iter().all(|a| a.width > 0 && a.values.len() == n * a.width),
        "{name}: attributes"
    );
    assert!(l.faces.iter().flatten().all(|&v| (v as usize) < n), "{name}: indices");
    assert!(l.corner_uv.as_ref().is_none_or(|c| c.len() == l.faces.len()), "{name}: uv");
    assert!(l.face_chart.as_ref().is_none_or(|c| c.len() == l.faces.len()), "{name}: charts");
}

fn try_load(name: &str, data: &[u8]) -> bool {
    let options = LoadOptions::default().with_max_memory_bytes(Some(MEMORY));
    match load_bytes(Path::new(name), data, &options) {
        Ok(l) => {
            check(name, &l);
            true
        }
        Err(e) => {
            let text = e.to_string();
            assert!(text.contains(name) && text.len() < 2000, "{name}: {text}");
            false
        }
    }
}

/// The file as it is, cut at `cuts` places, with 20 bytes changed `changes` times.
fn torture(name: &str, data: &[u8], cuts: usize, changes: usize) -> bool {
    let mut random = Random(data.len() as u64 + name.len() as u64);
    let whole = try_load(name, data);
    for _ in 0..cuts {
        try_load(name, &data[..random.below(data.len())]);
    }
    for _ in 0..changes {
        let mut changed = data.to_vec();
        for _ in 0..20.min(data.len()) {
            let at = random.below(data.len());
            changed[at] = random.below(256) as u8;
        }
        try_load(name, &changed);
    }
    // Headers are where the counts are: changed on their own, they are hit more often.
    for _ in 0..changes {
        let mut changed = data.to_vec();
        for _ in 0..2 {
            let at = random.below(data.len().min(300));
            if let Some(b) = changed.get_mut(at) {
                *b = [b'0', b'9', b'-', 0xFF, 0, 0x7F, b'\n'][random.below(7)];
            }
        }
        try_load(name, &changed);
    }
    whole
}

/// The most memory that this process has held, bytes (Linux; 0 elsewhere).
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("");
    line.split_whitespace().nth(1).and_then(|v| v.parse::<u64>().ok()).unwrap_or(0) * 1024
}

#[test]
fn damaged_files_of_every_format_give_a_result_or_an_error() {
    // Panics of other crates' readers are errors by the time they get here: their texts only hide a real one.
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !atlasfit_io::panics_become_errors() {
            tell(panic);
        }
    }));
    for (name, data) in common::samples() {
        assert!(torture(name, &data, 200, 300), "{name} does not load");
    }
    assert!(peak_memory() < 2 * MEMORY, "{} bytes", peak_memory());
}

#[test]
fn claims_without_bytes_to_back_them_are_errors() {
    let ply =
        "element vertex 99999999999999\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("a.ply", format!("ply\nformat binary_little_endian 1.0\n{ply}").into_bytes()),
        ("a.ply", format!("ply\nformat ascii 1.0\n{ply}1 2 3\n").into_bytes()),
        (
            "a.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n\
              property list uchar int a\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
                .to_vec(),
        ),
        ("a.off", b"OFF\n4000000000 4000000000 0\n0 0 0\n".to_vec()),
        ("a.pcd", common::pcd_header("binary", usize::MAX).into_bytes()),
        ("a.pcd", common::pcd_header("binary_compressed", usize::MAX).into_bytes()),
        ("a.pcd", common::pcd_header("ascii", usize::MAX).into_bytes()),
        ("a.stl", [&[b' '; 80][..], &[0xFF; 4], &[0; 20]].concat()),
        (
            "a.gltf",
            concat!(
                r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"#,
                r#""accessors":[{"componentType":5126,"count":99999999999,"type":"VEC3"}]}"#
            )
            .as_bytes()
            .to_vec(),
        ),
    ];
    for (name, data) in files {
        assert!(!try_load(name, &data), "{name} loads");
    }
    // Elements without a byte each are no reason to count to the end.
    let empty = b"ply\nformat ascii 1.0\nelement nothing 99999999999999\nelement vertex 1\n\
        property float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    assert!(try_load("a.ply", empty));
}

/// Found by fuzzing: 16 bits do not hold the sum of the sizes.
#[test]
fn laz_items_that_add_up_to_more_than_a_record_may_have_are_an_error() {
    let mut data = common::laz(10, 3);
    let items = data.windows(4).position(|w| w == [6, 0, 20, 0]).expect("an item of type 6 and 20 bytes");
    for item in data[items..items + 18].chunks_exact_mut(6) {
        // Bytes as they are, and many of them.
        item[..4].copy_from_slice(&[0, 0, 0xEB, 0xFF]);
    }
    assert!(!try_load("a.laz", &data));
}

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { out.extend(files(&path)) } else { out.push(path) }
    }
    out.sort();
    out
}

/// What loads can be written in every format, and what was written loads again with the same counts.
fn write_and_read(name: &str, data: &[u8]) {
    let Ok(loaded) = load_bytes(Path::new(name), data, &LoadOptions::default()) else { return };
    let mesh = loaded.into_mesh();
    let folder = common::Folder::new();
    for format in ["ply", "obj", "off", "glb", "stl", "xyz"] {
        let path = folder.join(&format!("a.{format}"));
        if save_mesh(&path, &mesh, &SaveMesh::default()).is_err() {
            assert!(format == "glb" && mesh.positions.is_empty(), "{name} as {format} cannot be written");
            continue;
        }
        let back = match load(&path, &LoadOptions::default()) {
            Ok(b) => b,
            // A file of columns without a row is an empty file.
            Err(e) => {
                assert!(format == "xyz" && mesh.positions.is_empty(), "{name} as {format}: {e}");
                continue;
            }
        };
        if format != "xyz" {
            assert_eq!(back.faces.len(), mesh.triangles.len(), "{name} as {format}");
        }
        // STL and GLB join equal vertices.
        if !matches!(format, "stl" | "glb") {
            assert_eq!(back.cloud.len(), mesh.positions.len(), "{name} as {format}");
        }
    }
}

/// The zoo's files, where it lies beside the repository or where ATLASFIT_SHARED says.
fn zoo() -> Vec<PathBuf> {
    let root = std::env::var_os("ATLASFIT_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    files(&root.join("data/zoo"))
}

/// `cargo test -p atlasfit-io --test robustness -- --ignored` before `cargo fuzz run`.
#[test]
#[ignore = "writes fuzz/corpus, which only fuzzing needs"]
fn seeds_for_the_fuzz_targets_are_written() {
    const LARGEST: usize = 20_000;
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let mut seeds: Vec<(String, Vec<u8>)> =
        common::samples().into_iter().map(|(name, data)| (name.to_owned(), data)).collect();
    for path in zoo() {
        let parts = path.iter().rev().take(2).map(|p| p.to_string_lossy().to_lowercase()).collect::<Vec<_>>();
        seeds.push((format!("{}-{}", parts[1], parts[0]), std::fs::read(&path).unwrap()));
    }
    for (name, data) in seeds.iter().filter(|s| s.1.len() <= LARGEST) {
        let target = match name.rsplit('.').next().unwrap() {
            "laz" => "las",
            "glb" => "gltf",
            "csv" => "xyz",
            known => known,
        };
        std::fs::create_dir_all(corpus.join(target)).unwrap();
        std::fs::write(corpus.join(target).join(name), data).unwrap();
    }
}

#[test]
fn the_zoo_of_difficult_files_gives_results_or_errors() {
    let zoo = zoo();
    let mut loaded = 0;
    for path in &zoo {
        let name = path.file_name().unwrap().to_str().unwrap();
        let data = std::fs::read(path).unwrap();
        loaded += usize::from(torture(name, &data, 10, 3));
        write_and_read(name, &data);
    }
    println!("{loaded} of {} files load, peak memory {} MB", zoo.len(), peak_memory() >> 20);
    assert!(10 * loaded >= 8 * zoo.len());
    assert!(peak_memory() < 2 * MEMORY, "{} bytes", peak_memory());
}
