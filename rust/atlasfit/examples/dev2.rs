use atlasfit::*;
use atlasfit::geometry::neighbours::Neighbours;
use atlasfit::partition::grow::*;
fn main() {
    for path in std::env::args().skip(1) {
    let bytes = std::fs::read(&path).unwrap();
    let v: Vec<f64> = bytes.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
    let points: Vec<[f64; 3]> = v.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let tree = Neighbours::build(&points).unwrap();
    let out = Run::default().execute(|ctx| analyse::spacing(&points, &tree, ctx)).unwrap();
    let s = analyse::median(&mut out.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
    println!("{path} spacing {s:.5}");
    for k in 0..9 {
        let sigma = 0.0016 * 1.5f64.powi(k);
        let mut scratch = Scratch::default();
        let (mut ratio, mut sound, mut small, mut n, mut mem) = (vec![], 0, vec![], 0, vec![]);
        for i in (0..points.len()).step_by(points.len() / 300) {
            let sp = f64::from(out[i]);
            let p = GrowParams { sigma, spacing: sp, max_radius: (6.0 * sp).max(7.0 * sigma) };
            if let Some(g) = grow(&points, &tree, i, &p, &mut scratch) {
                n += 1;
                if g.sound { sound += 1; }
                ratio.push(g.residual / sigma);
                small.push(g.radii[0].min(g.radii[1]) / p.max_radius);
                mem.push(g.members.len() as f64);
            }
        }
        println!("  sigma {sigma:.5} n {n} sound {:.2} ratio {:.2} radius {:.2} members {:.0}", sound as f64 / n as f64, analyse::median(&mut ratio), analyse::median(&mut small), analyse::median(&mut mem));
    }
    }
}
