//! For each of some points the nearest of a set: by looking at all of a small set with vector instructions,
//! by the core's trees in a large one.
//!
//! In: coordinates, finite (three numbers a point). Out: indices; of several at the same distance the first
//! where all are looked at.

use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::Neighbours;
use atlasfit_net::net::gemm::{Kernel, PANEL, dispatch};
use pulp::Simd;

/// Points up to which all are looked at: a tree's search takes about as long then (0.6 us on one core of
/// an EPYC with AVX2).
const FEW: usize = 4096;
/// Points whose nearest ones are looked for together, so that what is read serves all of them.
const QUERIES: usize = 4;

/// A set to search in.
pub(crate) enum Set {
    /// Coordinate by coordinate, filled up with points at infinity.
    All([Vec<f32>; 3]),
    /// Many points.
    Tree(Box<Neighbours>),
}

impl Set {
    pub(crate) fn new(points: &[[f32; 3]], ctx: &Context<'_>) -> atlasfit::Result<Self> {
        if points.len() > FEW {
            let points: Vec<Vec3> = points.iter().map(|p| Vec3(p.map(f64::from))).collect();
            return Ok(Self::Tree(Box::new(Neighbours::build(&points, ctx)?)));
        }
        Ok(Self::All([0, 1, 2].map(|axis| {
            let mut all: Vec<f32> = points.iter().map(|p| p[axis]).collect();
            all.resize(points.len().next_multiple_of(PANEL), f32::INFINITY);
            all
        })))
    }

    /// For each point the index of its nearest one.
    pub(crate) fn nearest(&self, points: &[[f32; 3]], ctx: &Context<'_>) -> atlasfit::Result<Vec<u32>> {
        let mut out = vec![0; points.len()];
        match self {
            Self::All(set) => {
                ctx.check()?;
                dispatch(Look { set, points, out: &mut out });
            }
            Self::Tree(tree) => {
                for (i, (p, out)) in points.iter().zip(&mut out).enumerate() {
                    ctx.check_at(i)?;
                    *out = tree.nearest_one(Vec3(p.map(f64::from))).index;
                }
            }
        }
        Ok(out)
    }
}

struct Look<'a> {
    set: &'a [Vec<f32>; 3],
    points: &'a [[f32; 3]],
    out: &'a mut [u32],
}

impl Kernel for Look<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let [x, y, z] = self.set.each_ref().map(|c| S::as_simd_f32s(c).0);
        let one = simd.splat_u32s(1);
        for (points, out) in self.points.chunks(QUERIES).zip(self.out.chunks_mut(QUERIES)) {
            let queries: [[S::f32s; 3]; QUERIES] =
                std::array::from_fn(|i| points[i.min(points.len() - 1)].map(|c| simd.splat_f32s(c)));
            let mut least = [simd.splat_f32s(f32::INFINITY); QUERIES];
            let mut at = [simd.splat_u32s(0); QUERIES];
            let mut now = simd.splat_u32s(0);
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                for q in 0..QUERIES {
                    let [a, b, c] = queries[q];
                    let (a, b, c) = (simd.sub_f32s(*x, a), simd.sub_f32s(*y, b), simd.sub_f32s(*z, c));
                    let far = simd.mul_f32s(a, a);
                    let far = simd.mul_add_e_f32s(c, c, simd.mul_add_e_f32s(b, b, far));
                    let nearer = simd.less_than_f32s(far, least[q]);
                    least[q] = simd.select_f32s(nearer, far, least[q]);
                    at[q] = simd.select_u32s(nearer, now, at[q]);
                }
                now = simd.add_u32s(now, one);
            }
            for ((out, least), at) in out.iter_mut().zip(least).zip(at) {
                *out = first::<S>(least, at);
            }
        }
    }
}

/// Index of the nearest point of all lanes, the first of several: each lane has looked at every so many.
#[inline(always)]
fn first<S: Simd>(least: S::f32s, at: S::u32s) -> u32 {
    let (mut far, mut turn) = ([f32::INFINITY; PANEL], [0u32; PANEL]);
    S::as_mut_simd_f32s(&mut far).0[0] = least;
    S::as_mut_simd_u32s(&mut turn).0[0] = at;
    let lanes = S::F32_LANES;
    let index = |l: usize| turn[l] * lanes as u32 + l as u32;
    let best = (1..lanes).fold(0, |best, l| {
        let nearer = far[l] < far[best] || (far[l] == far[best] && index(l) < index(best));
        if nearer { l } else { best }
    });
    index(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::numeric::rng::Rng;
    use atlasfit::run::Run;

    #[test]
    fn the_nearest_points_are_those_of_the_definition_in_small_and_in_large_sets() {
        let mut rng = Rng::new(1);
        let mut random =
            |n: usize| -> Vec<[f32; 3]> { (0..n).map(|_| [0; 3].map(|_| rng.normal() as f32)).collect() };
        for n in [1, 15, 700, FEW + 1] {
            let (set, points) = (random(n), random(103));
            let found = Run::default().execute(|ctx| Set::new(&set, ctx)?.nearest(&points, ctx)).unwrap();
            let far = |p: &[f32; 3], q: &[f32; 3]| -> f64 {
                p.iter().zip(q).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum()
            };
            for (p, i) in points.iter().zip(found) {
                let least = set.iter().map(|q| far(p, q)).fold(f64::INFINITY, f64::min);
                assert!(far(p, &set[i as usize]) <= least * (1.0 + 1e-5), "of {n}");
            }
        }
    }
}
