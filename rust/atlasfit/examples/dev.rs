//! Development harness: raw f64 points in, denoised raw f64 out.
use atlasfit::geometry::neighbours::Neighbours;
use atlasfit::*;
use std::time::Instant;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let v: Vec<f64> = bytes.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
    let points: Vec<[f64; 3]> = v.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let t = Instant::now();
    let out = Run::default()
        .execute(|ctx| {
            let tree = Neighbours::build(&points)?;
            eprint!("tree {:.3} ", t.elapsed().as_secs_f64());
            let spacing = analyse::spacing(&points, &tree, ctx)?;
            let median_spacing = analyse::median(&mut spacing.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
            let mut sigma = analyse::noise(&points, &tree, ctx)?;
            eprint!("noise {:.3} (sigma {sigma:.5} s {median_spacing:.5}) ", t.elapsed().as_secs_f64());
            if let Some(s) = a.get(3) { let s: f64 = s.parse().unwrap(); if s > 0.0 { sigma = s; } }
            let analysis = analyse::Analysis { spacing, median_spacing, sigma };
            let mut size = partition::PATCH_SIZE;
            if let Some(s) = a.get(4) { size.spacings = s.parse().unwrap(); }
            if let Some(s) = a.get(5) { size.sigmas = s.parse().unwrap(); }
            let patches = partition::partition(&points, &tree, &analysis, size, ctx)?;
            eprint!("grow {:.3} ({} patches) ", t.elapsed().as_secs_f64(), patches.len());
            let mut fitted = fit::fit(&points, &patches, sigma, ctx)?;
            eprint!("fit {:.3} ", t.elapsed().as_secs_f64());
            let m = project::membership(points.len(), &fitted);
            let out = project::project_members(&points, &fitted, &m, ctx)?;
            eprintln!("project {:.3} orphans {} members/chart {:.1}", t.elapsed().as_secs_f64(), out.iter().filter(|p| p.chart == u32::MAX).count(), m.entries.len() as f64 / fitted.len() as f64);
            let rel = orient::relations(&points, &fitted, &m);
            let (signs, conflicts) = orient::orient(fitted.len(), &rel);
            if std::env::var("DBG").is_ok() {
                let mut mx = vec![0f64; fitted.len()];
                for r in &rel { for c in [r.a, r.b] { mx[c as usize] = mx[c as usize].max(r.agreement.abs()); } }
                let mut v: Vec<_> = rel.iter().filter(|r| conflicts.contains(&(r.a, r.b))).map(|r| (r.agreement.abs() / mx[r.a as usize].min(mx[r.b as usize]), r.agreement)).collect();
                v.sort_by(|a, b| b.0.total_cmp(&a.0));
                for x in v.iter().take(12) { eprintln!("conflict {x:?}"); }
            }
            for (f, s) in fitted.iter_mut().zip(&signs) { f.chart.sign = *s; }
            eprint!("orient {:.3} ({} rel {} conf) ", t.elapsed().as_secs_f64(), rel.len(), conflicts.len());
            let charts: Vec<_> = fitted.iter().map(|f| f.chart.clone()).collect();
            let h = a.get(6).map_or(0.6, |s| s.parse().unwrap()) * median_spacing;
            let anchors = project::anchors(&points, &out, &fitted, &m, &analysis.spacing);
            let c = surface::field::contour(&charts, &anchors, &rel, &conflicts, h, ctx)?;
            eprint!("contour {:.3} ({} quads) ", t.elapsed().as_secs_f64(), c.quads.len());
            let s = surface::clean::triangulate(c, 100);
            eprintln!("clean {:.3} ({} tris)", t.elapsed().as_secs_f64(), s.triangles.len());
            if std::env::var("DBG").is_ok() {
                let mut b = Vec::new();
                for (p, &c) in s.positions.iter().zip(&s.chart) {
                    let f = if c == u32::MAX { None } else { Some(&fitted[c as usize]) };
                    for x in p { b.extend_from_slice(&x.to_le_bytes()); }
                    let v = match f { Some(f) => [f64::from(c), f.chart.radii[0], f.chart.radii[1], f.chart.sigma, f.chart.support, f.members.len() as f64], None => [-1.0; 6] };
                    for x in v { b.extend_from_slice(&x.to_le_bytes()); }
                }
                std::fs::write("/tmp/dbg.raw", b).unwrap();
            }
            if a[2].ends_with(".ply") || true {
                use std::io::Write;
                let mut w = std::io::BufWriter::new(std::fs::File::create(format!("{}.ply", a[2])).unwrap());
                write!(w, "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n", s.positions.len(), s.triangles.len()).unwrap();
                for p in &s.positions { for x in p { w.write_all(&(*x as f32).to_le_bytes()).unwrap(); } }
                for t in &s.triangles { w.write_all(&[3]).unwrap(); for x in t { w.write_all(&x.to_le_bytes()).unwrap(); } }
            }
            Ok(out)
        })
        .unwrap();
    let mut b = Vec::new();
    for p in &out { for x in p.position { b.extend_from_slice(&x.to_le_bytes()); } }
    std::fs::write(&a[2], b).unwrap();
}
