//! Development harness: raw f64 points in, denoised raw f64 and a PLY surface out.
use atlasfit::*;
use std::io::Write;
use std::time::Instant;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let v: Vec<f64> = bytes.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
    let points: Vec<[f64; 3]> = v.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let cloud = geometry::PointCloud::from_positions(points);
    let mut o = DenoiseOptions { uv: a.iter().any(|x| x == "uv"), ..DenoiseOptions::default() };
    for x in &a[3..] {
        if let Some(s) = x.strip_prefix("noise=") { o.noise = s.parse().ok(); }
        if let Some(s) = x.strip_prefix("detail=") { o.detail = s.parse().unwrap(); }
        if let Some(s) = x.strip_prefix("mlp=") { o.prior = atlasfit::denoise::Prior::Mlp(prior::mlp::MlpOptions { iterations: s.parse().unwrap(), ..Default::default() }); }
        if let Some(s) = x.strip_prefix("charts=") { o.charts = s.parse().ok(); }
    }
    let t = Instant::now();
    let d = denoise(&cloud, &o, &mut Run::default()).unwrap();
    eprintln!("total {:.3} sigma {:.5} {:?} ", t.elapsed().as_secs_f64(), d.report.noise, d.report);
    let mut b = Vec::new();
    for p in &d.points.positions { for x in p { b.extend_from_slice(&x.to_le_bytes()); } }
    std::fs::write(&a[2], b).unwrap();
    let s = &d.surface;
    let mut w = std::io::BufWriter::new(std::fs::File::create(format!("{}.ply", a[2])).unwrap());
    write!(w, "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\n{}end_header\n", s.positions.len(), s.triangles.len(), if s.corner_uv.is_some() { "property list uchar float texcoord\n" } else { "" }).unwrap();
    for p in &s.positions { for x in p { w.write_all(&(*x as f32).to_le_bytes()).unwrap(); } }
    for (i, t) in s.triangles.iter().enumerate() {
        w.write_all(&[3]).unwrap();
        for x in t { w.write_all(&x.to_le_bytes()).unwrap(); }
        if let Some(uv) = &s.corner_uv { w.write_all(&[6]).unwrap(); for c in uv[i] { for x in c { w.write_all(&x.to_le_bytes()).unwrap(); } } }
    }
}
