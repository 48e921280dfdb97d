//! Prints one line per file: name, format, points, triangles, milliseconds, repairs, columns; or the error.
//! `tests/io_zoo_counts.py` compares these lines with other programs' counts.

fn main() {
    let options = atlasfit_io::LoadOptions::default().with_max_memory_bytes(Some(8 << 30));
    for name in std::env::args().skip(1) {
        let start = std::time::Instant::now();
        match atlasfit_io::load(std::path::Path::new(&name), &options) {
            Ok(l) => {
                let mut columns: Vec<&str> = Vec::new();
                columns.extend(l.cloud.normals.is_some().then_some("normals"));
                columns.extend(l.cloud.colors.is_some().then_some("colours"));
                columns.extend(l.corner_uv.is_some().then_some("uv"));
                columns.extend(l.cloud.attributes.iter().map(|a| a.name.as_str()));
                let notes: Vec<String> = l.report.notes.iter().map(ToString::to_string).collect();
                println!(
                    "{name}\t{}\t{}\t{}\t{:.1}\t{}\t{}",
                    l.format.name(),
                    l.cloud.len(),
                    l.faces.len(),
                    start.elapsed().as_secs_f64() * 1e3,
                    notes.join("; "),
                    columns.join(" ")
                );
            }
            Err(e) => println!("{name}\terror\t{e}"),
        }
    }
}
