//! A process that ends in the middle of its outputs leaves nothing of them. A file of its own: from
//! `discard_unfinished` on the whole process writes no more.

use atlasfit::Stop;
use atlasfit_io::{discard_unfinished, write_file};

#[test]
fn outputs_that_are_being_written_vanish_and_no_other_is_begun() {
    let folder = std::env::temp_dir().join(format!("atlasfit-discard-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let unfinished = || {
        let names = std::fs::read_dir(&folder).unwrap().map(|f| f.unwrap().file_name());
        names.filter(|n| n.to_string_lossy().ends_with(".part")).count()
    };
    let (path, bytes) = (folder.join("out.bin"), vec![7u8; 8 << 20]);
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| while write_file(&path, &bytes, &Stop::default()).is_ok() {});
        while unfinished() == 0 && !writer.is_finished() {}
        discard_unfinished();
        assert_eq!(unfinished(), 0, "gone at once");
        writer.join().unwrap();
    });
    assert_eq!(unfinished(), 0);
    let whole = !path.exists() || std::fs::read(&path).unwrap() == bytes;
    assert!(whole, "what is there is whole");
    assert!(write_file(&path, &bytes, &Stop::default()).is_err(), "no output is begun any more");
    std::fs::remove_dir_all(&folder).unwrap();
}
