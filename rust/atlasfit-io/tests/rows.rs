//! Claims about points read block by block and written again: all but the positions stays.

mod common;

use atlasfit::Stop;
use atlasfit_io::{LoadOptions, RowBlock, Rows, RowsWriter, load};
use common::Folder;
use std::path::{Path, PathBuf};

/// Puts a file into a folder.
fn file(folder: &Folder, name: &str, data: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, data).expect("a file");
    path
}

/// Writes a file again with all positions `by` farther along x; how many points it has.
fn shifted(from: &Path, to: &Path, by: f64) -> usize {
    let stop = Stop::default();
    let mut rows = Rows::open(from, &stop).expect("opens");
    let mut writer = RowsWriter::create(&rows, to).expect("begins");
    let (mut block, mut count) = (RowBlock::default(), 0);
    while rows.next(1000, &mut block, &stop).expect("reads") {
        let places: Vec<[f64; 3]> = block.positions.iter().map(|p| [p[0] + by, p[1], p[2]]).collect();
        count += places.len();
        writer.put(&rows, &mut block, &places, &stop).expect("writes");
    }
    writer.finish(rows, &stop).expect("ends");
    count
}

#[test]
fn files_written_again_hold_what_they_held_at_other_places() {
    let folder = Folder::new();
    let mut ply =
        b"ply\nformat binary_big_endian 1.0\ncomment kept\nelement vertex 2500\nproperty float x\nproperty \
        float y\nproperty double z\nproperty ushort red\nproperty ushort green\nproperty ushort \
        blue\nproperty int label\nend_header\n"
            .to_vec();
    for i in 0..2500i32 {
        ply.extend((i as f32).to_be_bytes().iter().chain(&1f32.to_be_bytes()).chain(&2.5f64.to_be_bytes()));
        ply.extend([i as u16, 7, 9].iter().flat_map(|c| c.to_be_bytes()));
        ply.extend((-i).to_be_bytes());
    }
    let files = [
        ("a.las", common::las(2500)),
        ("b.laz", common::laz(2500, 3)),
        ("c.laz", common::laz(120_000, 7)),
        ("d.ply", ply),
        ("e.xyz", (0..2500).flat_map(|i| format!("{i} 1 2.5\n").into_bytes()).collect()),
    ];
    for (name, data) in files {
        let from = file(&folder, name, &data);
        let to = folder
            .0
            .join(format!("to-{name}"))
            .with_extension(Rows::open(&from, &Stop::default()).expect("opens").extension());
        let count = shifted(&from, &to, 0.25);
        let [before, after] = [&from, &to].map(|f| load(f, &LoadOptions::default()).expect("reads").cloud);
        assert_eq!((count, before.len()), (after.len(), after.len()), "{name}");
        for (p, q) in before.positions.iter().zip(&after.positions) {
            assert!((q[0] - p[0] - 0.25).abs() < 1e-9 && p[1..] == q[1..], "{name}: {p:?} {q:?}");
        }
        assert_eq!(before.attributes, after.attributes, "{name}");
        assert_eq!(before.colors, after.colors, "{name}");
    }
}

#[test]
fn a_file_that_ends_too_soon_is_an_error_and_leaves_nothing() {
    let folder = Folder::new();
    for (name, data) in [("a.las", common::las(500)), ("b.laz", common::laz(500, 7))] {
        let from = file(&folder, name, &data[..data.len() * 3 / 4]);
        let stop = Stop::default();
        let read = Rows::open(&from, &stop).and_then(|mut rows| {
            let to = folder.0.join("out");
            let mut writer = RowsWriter::create(&rows, &to)?;
            let mut block = RowBlock::default();
            while rows.next(100, &mut block, &stop)? {
                let places = block.positions.clone();
                writer.put(&rows, &mut block, &places, &stop)?;
            }
            writer.finish(rows, &stop)
        });
        let told = read.expect_err(name).to_string();
        assert!(told.contains("cut off"), "{told}");
    }
    let left: Vec<_> = std::fs::read_dir(&folder.0).expect("a folder").flatten().collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn a_place_beyond_what_the_files_numbers_hold_is_an_error() {
    let folder = Folder::new();
    let from = file(&folder, "a.las", &common::las(10));
    let stop = Stop::default();
    let mut rows = Rows::open(&from, &stop).expect("opens");
    let mut writer = RowsWriter::create(&rows, &folder.0.join("b.las")).expect("begins");
    let mut block = RowBlock::default();
    assert!(rows.next(10, &mut block, &stop).expect("reads"));
    let far = vec![[1e12, 0.0, 0.0]; 10];
    let told = writer.put(&rows, &mut block, &far, &stop).expect_err("too far").to_string();
    assert!(told.contains("beyond what its numbers hold"), "{told}");
}
