//! Small scans of known surfaces, made here, and how far points lie from the truth.
#![allow(dead_code)] // Each test program uses some of them.

use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::measure::Topology;
use atlasfit::numeric::rng::Rng;
use atlasfit::{DenoiseOptions, Denoised, Result, Run, denoise};
use std::f64::consts::{PI, TAU};

pub type Vec3 = [f64; 3];

/// A sampled surface: exact points and unit normals, and the side of the square that one point stands for.
pub struct Sampled {
    pub points: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub spacing: f64,
}

impl Sampled {
    fn new(area: f64, at: impl IntoIterator<Item = (Vec3, Vec3)>) -> Self {
        let (points, normals): (Vec<_>, Vec<_>) = at.into_iter().unzip();
        let spacing = (area / points.len() as f64).sqrt();
        Self { points, normals, spacing }
    }
    /// The points with Gaussian noise along the normal, its deviation in spacings.
    pub fn noisy(&self, spacings: f64, seed: u64) -> Vec<Vec3> {
        self.noisy_by(Rng::stream(seed, 99), |_| spacings * self.spacing)
    }
    /// The points with Gaussian noise along the normal, its deviation by the place.
    pub fn noisy_by(&self, mut rng: Rng, sigma: impl Fn(&Vec3) -> f64) -> Vec<Vec3> {
        let moved = |(p, n): (&Vec3, &Vec3)| {
            let d = sigma(p) * rng.normal();
            [0, 1, 2].map(|k| p[k] + d * n[k])
        };
        self.points.iter().zip(&self.normals).map(moved).collect()
    }
}

/// The unit sphere.
pub fn sphere(n: usize, seed: u64) -> Sampled {
    let mut rng = Rng::new(seed);
    Sampled::new(
        4.0 * PI,
        (0..n).map(|_| {
            let v = [rng.normal(), rng.normal(), rng.normal()];
            let l = norm(v);
            let v = v.map(|x| x / l);
            (v, v)
        }),
    )
}

/// A torus about the z axis with radii 1 and `r`, uniform by area.
pub fn torus(n: usize, r: f64, seed: u64) -> Sampled {
    let mut rng = Rng::new(seed);
    let mut at = Vec::new();
    while at.len() < n {
        let (a, b) = (TAU * rng.uniform(), TAU * rng.uniform());
        if rng.uniform() * (1.0 + r) > 1.0 + r * b.cos() {
            continue;
        }
        let normal = [b.cos() * a.cos(), b.cos() * a.sin(), b.sin()];
        let ring = 1.0 + r * b.cos();
        at.push(([ring * a.cos(), ring * a.sin(), r * b.sin()], normal));
    }
    Sampled::new(TAU * TAU * r, at)
}

/// The square [-1, 1]^2 at height `z`, without the disk of radius `hole` about the origin.
pub fn square(n: usize, z: f64, hole: f64, seed: u64) -> Sampled {
    let mut rng = Rng::new(seed);
    let mut at = Vec::new();
    while at.len() < n {
        let (x, y) = (2.0 * rng.uniform() - 1.0, 2.0 * rng.uniform() - 1.0);
        if x.hypot(y) >= hole {
            at.push(([x, y, z], [0.0, 0.0, 1.0]));
        }
    }
    Sampled::new(4.0 - PI * hole * hole, at)
}

/// A Moebius strip of radius 1 and the given half width.
pub fn moebius(n: usize, half: f64, seed: u64) -> Sampled {
    let mut rng = Rng::new(seed);
    Sampled::new(
        TAU * 2.0 * half,
        (0..n).map(|_| {
            let (a, w) = (TAU * rng.uniform(), half * (2.0 * rng.uniform() - 1.0));
            let (c, s) = ((a / 2.0).cos(), (a / 2.0).sin());
            let radial = [a.cos(), a.sin(), 0.0];
            let p = [0, 1, 2].map(|k| (1.0 + w * c) * radial[k] + if k == 2 { w * s } else { 0.0 });
            // Normal of the centre line's frame: across the width and along the circle.
            let n = [-s * radial[0], -s * radial[1], c];
            (p, n)
        }),
    )
}

/// The side of a cylinder about the z axis, of radius `r` and length 2.
pub fn tube(n: usize, r: f64, seed: u64) -> Sampled {
    let mut rng = Rng::new(seed);
    Sampled::new(
        TAU * r * 2.0,
        (0..n).map(|_| {
            let (a, z) = (TAU * rng.uniform(), 2.0 * rng.uniform() - 1.0);
            ([r * a.cos(), r * a.sin(), z], [a.cos(), a.sin(), 0.0])
        }),
    )
}

pub fn cloud(points: &[Vec3]) -> PointCloud {
    PointCloud::from_positions(points.to_vec())
}

/// The defaults without UVs, which most claims do not need.
pub fn plain() -> DenoiseOptions {
    DenoiseOptions::default().with_uv(false)
}

pub fn run(points: &[Vec3]) -> Result<Denoised> {
    denoise(&cloud(points), &plain(), &mut Run::default())
}

pub fn topology(mesh: &TriMesh) -> Topology {
    Run::default().execute(|ctx| atlasfit::measure::topology(mesh, ctx)).expect("a valid mesh")
}

/// Places evenly spread over a surface, whatever the size of its triangles.
pub fn places(mesh: &TriMesh) -> Vec<Vec3> {
    let all = Run::default().execute(|ctx| atlasfit::measure::sample::uniform(mesh, 20_000, 1, ctx));
    all.expect("a surface").into_iter().map(|s| s.point.0).collect()
}

pub fn norm(v: Vec3) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values.into_iter().fold((0.0, 0.0), |(s, n), x| (s + x * x, n + 1.0));
    f64::sqrt(sum / n)
}

/// Signed distance to the unit sphere.
pub fn off_sphere(p: &Vec3) -> f64 {
    norm(*p) - 1.0
}

/// Signed distance to the torus of radii 1 and `r`.
pub fn off_torus(p: &Vec3, r: f64) -> f64 {
    (p[0].hypot(p[1]) - 1.0).hypot(p[2]) - r
}

/// Signed volume that a mesh spans with the origin: positive where its faces look outward.
pub fn volume(mesh: &TriMesh) -> f64 {
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            (a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
                / 6.0
        })
        .sum()
}

/// A rotation about a skew axis by one radian.
pub fn turned(p: &Vec3) -> Vec3 {
    let (c, s) = (1f64.cos(), 1f64.sin());
    let [x, y, z] = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
    [x, c * y - s * z, s * y + c * z]
}
