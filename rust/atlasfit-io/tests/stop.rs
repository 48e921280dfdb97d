//! A cancel or a deadline ends reading and writing of every format, as an error of its own, without a file.
//! A format that is asked for wrongly is an error, no panic.

mod common;

use atlasfit::geometry::PointCloud;
use atlasfit::{CancelToken, Deadline, Stop};
use atlasfit_io::{Error, Format, LoadOptions, SaveCloud, SaveMesh, load, load_bytes, save_cloud, save_mesh};
use common::{Folder, cube};
use std::path::Path;
use std::time::Instant;

const WRITTEN: [&str; 6] = ["a.ply", "a.obj", "a.glb", "a.off", "a.stl", "a.xyz"];

fn stops() -> [(Stop, atlasfit::Error); 2] {
    let token = CancelToken::new();
    token.cancel();
    let late = Deadline::new(Instant::now(), 0.0).unwrap();
    [
        (Stop::default().with_cancel(Some(token)), atlasfit::Error::Cancelled),
        (Stop::default().with_deadline(Some(late)), atlasfit::Error::TimedOut { limit_s: 0.0, stage: "" }),
    ]
}

fn is_stopped<T>(result: atlasfit_io::Result<T>, by: &atlasfit::Error) -> bool {
    matches!(result, Err(Error::Stopped(e)) if std::mem::discriminant(&e) == std::mem::discriminant(by))
}

#[test]
fn reading_and_writing_stop_in_every_format_and_leave_no_file() {
    let folder = Folder::new();
    for name in WRITTEN {
        for ascii in [false, true] {
            let path = folder.join(name);
            save_mesh(&path, &cube(), &SaveMesh::default().with_ascii(ascii)).unwrap();
            for (stop, by) in stops() {
                assert!(is_stopped(load(&path, &LoadOptions::default().with_stop(stop)), &by), "{name}");
            }
            let mut written = vec![path.clone()];
            written.push(folder.join("a.mtl"));
            written.iter().for_each(|p| drop(std::fs::remove_file(p)));
            for (stop, by) in stops() {
                let how = SaveMesh::default().with_ascii(ascii).with_stop(stop.clone());
                assert!(is_stopped(save_mesh(&path, &cube(), &how), &by), "{name}");
                if name != "a.stl" {
                    let how = SaveCloud::default().with_ascii(ascii).with_stop(stop);
                    let cloud = PointCloud::from_positions(vec![[0.0; 3]; 10]);
                    assert!(is_stopped(save_cloud(&path, &cloud, &how), &by), "{name}");
                }
            }
            let left = std::fs::read_dir(&folder.0).unwrap().count();
            assert_eq!(left, 0, "{name}: nothing is left behind");
        }
    }
}

#[test]
fn a_format_asked_for_wrongly_is_an_error_or_a_reading_and_no_panic() {
    let folder = Folder::new();
    let formats = ["ply", "obj", "off", "stl", "xyz", "pcd", "las", "e57", "glb"]
        .map(|e| Format::from_path(&Path::new("a").with_extension(e)).unwrap());
    for name in WRITTEN {
        let path = folder.join(name);
        save_mesh(&path, &cube(), &SaveMesh::default()).unwrap();
        let data = std::fs::read(&path).unwrap();
        for format in formats {
            let how = LoadOptions::default().with_format(Some(format));
            for cut in [0, 1, 7, 60, data.len() / 2, data.len()] {
                let loaded = load_bytes(&path, &data[..cut.min(data.len())], &how);
                assert!(loaded.is_err() || loaded.unwrap().format == format);
            }
            drop(load(&path, &how));
        }
    }
}
