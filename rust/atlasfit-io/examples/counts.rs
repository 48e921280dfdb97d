//! Prints one line per file: name, format, points, triangles, milliseconds, repairs; or the error.
//! `tests/io_zoo_counts.py` compares these lines with other programs' counts.

fn main() {
    let options = atlasfit_io::LoadOptions { max_memory_bytes: Some(2 << 30) };
    for name in std::env::args().skip(1) {
        let start = std::time::Instant::now();
        match atlasfit_io::load(std::path::Path::new(&name), &options) {
            Ok(l) => {
                let notes: Vec<String> = l.report.notes.iter().map(ToString::to_string).collect();
                println!(
                    "{name}\t{}\t{}\t{}\t{:.1}\t{}",
                    l.format.name(),
                    l.cloud.len(),
                    l.faces.len(),
                    start.elapsed().as_secs_f64() * 1e3,
                    notes.join("; ")
                );
            }
            Err(e) => println!("{name}\terror\t{e}"),
        }
    }
}
