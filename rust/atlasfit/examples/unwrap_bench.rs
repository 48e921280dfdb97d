//! Unwraps meshes and prints one line of figures each; for development and for tests/peers/unwrap_peers.py.
//!
//! usage: unwrap_bench [--stretch S] [--out DIR] [--threads N] MESH.ply...
//! Reads binary little-endian PLY files of float positions and triangles. With --out, writes DIR/NAME.uv: 6
//! float32 per triangle, then one uint32 page per triangle, then one
//! uint32 chart per triangle.

use atlasfit::geometry::TriMesh;
use atlasfit::unwrap::{UnwrapOptions, unwrap};
use atlasfit::{Run, Stage};
use std::io::{Error, ErrorKind, Result, Write};
use std::time::Instant;

fn read_ply(path: &str) -> Result<TriMesh> {
    let data = std::fs::read(path)?;
    let bad = |what: &str| Error::new(ErrorKind::InvalidData, format!("{path}: {what}"));
    let end = data.windows(11).position(|w| w == b"end_header\n").ok_or_else(|| bad("no header"))? + 11;
    let header = String::from_utf8_lossy(&data[..end]);
    let count = |name: &str| {
        header
            .lines()
            .find_map(|l| {
                l.strip_prefix(&format!("element {name} ")).and_then(|n| n.trim().parse::<usize>().ok())
            })
            .ok_or_else(|| bad("no element count"))
    };
    let (n, m) = (count("vertex")?, count("face")?);
    let f = |at: usize| f32::from_le_bytes([data[at], data[at + 1], data[at + 2], data[at + 3]]);
    let i = |at: usize| u32::from_le_bytes([data[at], data[at + 1], data[at + 2], data[at + 3]]);
    if data.len() < end + 12 * n + 13 * m {
        return Err(bad("short file, or not plain positions and triangles"));
    }
    let positions = (0..n).map(|v| [0, 1, 2].map(|k| f64::from(f(end + 12 * v + 4 * k)))).collect();
    let base = end + 12 * n;
    let triangles = (0..m).map(|t| [0, 1, 2].map(|k| i(base + 13 * t + 1 + 4 * k))).collect();
    Ok(TriMesh::new(positions, triangles))
}

fn main() -> Result<()> {
    let mut options = UnwrapOptions::default();
    let (mut out, mut threads) = (None, 0);
    let mut args = std::env::args().skip(1);
    while let Some(a) = args.next() {
        match a.as_str() {
            "--stretch" => options.max_stretch = args.next().and_then(|x| x.parse().ok()).unwrap_or(1.1),
            "--out" => out = args.next(),
            "--threads" => threads = args.next().and_then(|x| x.parse().ok()).unwrap_or(0),
            path => {
                let mesh = read_ply(path)?;
                let name =
                    std::path::Path::new(path).file_stem().unwrap_or_default().to_string_lossy().to_string();
                let start = Instant::now();
                let mut run = Run { threads, ..Run::default() };
                let result = run.execute(|ctx| Ok((unwrap(&mesh, &options, ctx)?, ctx.stage_seconds())));
                let t = start.elapsed().as_secs_f64();
                match result {
                    Ok((uv, stages)) => {
                        let of = |s: Stage| stages.iter().find(|x| x.0 == s).map_or(0.0, |x| x.1);
                        println!(
                            "{name} faces {} charts {} over {:.4} t {t:.3} segment {:.3} flatten {:.3} pack {:.3} fill {:.4}",
                            mesh.triangles.len(),
                            uv.charts,
                            uv.over_stretched,
                            of(Stage::Segment),
                            of(Stage::Parametrize),
                            of(Stage::Pack),
                            fill(&uv.corner_uv)
                        );
                        if let Some(dir) = &out {
                            std::fs::create_dir_all(dir)?;
                            let mut w =
                                std::io::BufWriter::new(std::fs::File::create(format!("{dir}/{name}.uv"))?);
                            for x in uv.corner_uv.iter().flatten().flatten() {
                                w.write_all(&x.to_le_bytes())?;
                            }
                            for p in uv.face_page.iter().chain(&uv.face_chart) {
                                w.write_all(&p.to_le_bytes())?;
                            }
                        }
                    }
                    Err(e) => println!("{name} error {e}"),
                }
            }
        }
    }
    Ok(())
}

/// Share of the page that faces cover.
fn fill(uv: &[[[f32; 2]; 3]]) -> f64 {
    let twice = |t: &[[f32; 2]; 3]| {
        let [a, b, c] = t.map(|p| p.map(f64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    uv.iter().map(twice).sum::<f64>() / 2.0
}
