//! Sums over the points of a window, four points at a time, with vector instructions (chosen at run time by
//! pulp).
//!
//! In: points, and what weighs them. Out: weighted sums of monomials in x and y, with signs and without:
//! whatever is quadratic in polynomials on the two sides of a line is made of them. The sums are the same to
//! the last bit on every machine, since the order of additions is.

use crate::numeric::dense::LANES;
use pulp::{Arch, Simd, WithSimd};

/// One number for each of some points.
pub(super) type Lanes = [f64; LANES];

/// How many monomials there are of a degree up to this.
pub(super) const fn monomials(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// The place of x^i y^j among monomials.
pub(super) const fn at(i: usize, j: usize) -> usize {
    (i + j) * (i + j + 1) / 2 + j
}

/// Some points, coordinate by coordinate.
#[derive(Clone, Copy, Default)]
pub(super) struct Few {
    pub x: Lanes,
    pub y: Lanes,
    pub z: Lanes,
    /// 1 for a point, 0 where there is none.
    pub is: Lanes,
}

/// Points, some together.
pub(super) struct Columns {
    few: Vec<Few>,
    /// How many points they are.
    pub len: usize,
}

impl Columns {
    /// The columns of points.
    pub fn new(points: &[[f64; 3]]) -> Self {
        let few = points.chunks(LANES).map(|points| {
            let mut few = Few::default();
            for (k, &[x, y, z]) in points.iter().enumerate() {
                (few.x[k], few.y[k], few.z[k], few.is[k]) = (x, y, z, 1.0);
            }
            few
        });
        Self { few: few.collect(), len: points.len() }
    }
    /// The points, one by one.
    pub fn points(&self) -> impl Iterator<Item = [f64; 3]> {
        let all = self.few.iter().flat_map(|few| (0..LANES).map(|l| [few.x[l], few.y[l], few.z[l]]));
        all.take(self.len)
    }
}

/// What some points count.
pub(super) struct Weighed {
    pub weight: Lanes,
    /// The value that is summed up with the monomials.
    pub value: Lanes,
    /// The sign of the second sums.
    pub sign: Lanes,
}

/// What weighs points. Its functions are inlined always, so that they are compiled for the wider vectors.
pub(super) trait Weigh {
    /// Whether signs count.
    const SIDED: bool;
    fn weigh(&self, points: &Few) -> Weighed;
}

/// Weighted sums of monomials: `M` of them alone, the first `V` of them times the values.
#[derive(Clone, Copy)]
pub(super) struct Sums<const M: usize, const V: usize> {
    pub alone: [f64; M],
    pub values: [f64; V],
}

/// The sums, with all points counted alike and with their signs.
pub(super) fn sums<W: Weigh, const M: usize, const V: usize>(
    columns: &Columns,
    weigh: &W,
) -> [Sums<M, V>; 2] {
    Arch::new().dispatch(Gather::<'_, W, M, V> { columns, weigh })
}

struct Gather<'a, W, const M: usize, const V: usize> {
    columns: &'a Columns,
    weigh: &'a W,
}

impl<W: Weigh, const M: usize, const V: usize> WithSimd for Gather<'_, W, M, V> {
    type Output = [Sums<M, V>; 2];
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let mut alone = [[[0.0; LANES]; M]; 2];
        let mut values = [[[0.0; LANES]; V]; 2];
        for few in &self.columns.few {
            let Weighed { mut weight, value, sign } = self.weigh.weigh(few);
            times(&mut weight, &few.is);
            let mut all = [[0.0; LANES]; M];
            all[0] = weight;
            let (mut degree, mut first) = (0, 1);
            // Each degree is the one before times x, and its last times y.
            while first < M {
                for k in first..=first + degree {
                    all[k] = all[k - degree - 1];
                    times(&mut all[k], &few.x);
                }
                let last = first + degree + 1;
                all[last] = all[first - 1];
                times(&mut all[last], &few.y);
                (degree, first) = (degree + 1, last + 1);
            }
            for k in 0..M {
                add(&mut alone[0][k], &all[k], &[1.0; LANES]);
                if W::SIDED {
                    add(&mut alone[1][k], &all[k], &sign);
                }
            }
            for k in 0..V {
                let mut valued = all[k];
                times(&mut valued, &value);
                add(&mut values[0][k], &valued, &[1.0; LANES]);
                if W::SIDED {
                    add(&mut values[1][k], &valued, &sign);
                }
            }
        }
        [0, 1].map(|s| Sums { alone: alone[s].map(total), values: values[s].map(total) })
    }
}

#[inline(always)]
fn times(a: &mut Lanes, b: &Lanes) {
    for l in 0..LANES {
        a[l] *= b[l];
    }
}

#[inline(always)]
fn add(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for l in 0..LANES {
        sum[l] += a[l] * b[l];
    }
}

#[inline(always)]
fn total([a, b, c, d]: Lanes) -> f64 {
    (a + b) + (c + d)
}

/// The sum over points of what they cost.
pub(super) fn sum<C: Cost>(columns: &Columns, cost: &C) -> f64 {
    Arch::new().dispatch(Total { columns, cost })
}

/// What points cost. Inlined always, as for [`Weigh`].
pub(super) trait Cost {
    fn cost(&self, points: &Few) -> Lanes;
}

struct Total<'a, C> {
    columns: &'a Columns,
    cost: &'a C,
}

impl<C: Cost> WithSimd for Total<'_, C> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sum = [0.0; LANES];
        for few in &self.columns.few {
            add(&mut sum, &self.cost.cost(few), &few.is);
        }
        total(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Odd;

    impl Weigh for Odd {
        const SIDED: bool = true;
        fn weigh(&self, p: &Few) -> Weighed {
            let of = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
            Weighed {
                weight: of(&|l| 1.0 + p.x[l] * p.x[l]),
                value: p.z,
                sign: of(&|l| if p.y[l] > 0.0 { 1.0 } else { -1.0 }),
            }
        }
    }

    #[test]
    fn sums_are_those_of_the_points_one_by_one() {
        let points: Vec<[f64; 3]> =
            (0..23).map(f64::from).map(|k| [(0.7 * k).sin(), (1.3 * k).cos(), 0.1 * k]).collect();
        let found: [Sums<15, 6>; 2] = sums(&Columns::new(&points), &Odd);
        for (i, j) in (0..=4).flat_map(|i| (0..=4 - i).map(move |j| (i, j))) {
            let of = |signed: bool, valued: bool| -> f64 {
                let one = |&[x, y, z]: &[f64; 3]| {
                    let sign = if signed && y <= 0.0 { -1.0 } else { 1.0 };
                    let value = if valued { z } else { 1.0 };
                    sign * value * (1.0 + x * x) * x.powi(i) * y.powi(j)
                };
                points.iter().map(one).sum()
            };
            let k = at(i as usize, j as usize);
            for (s, found) in found.iter().enumerate() {
                assert!((found.alone[k] - of(s == 1, false)).abs() < 1e-12, "{i} {j} {s}");
                if i + j <= 2 {
                    assert!((found.values[k] - of(s == 1, true)).abs() < 1e-12, "{i} {j} {s}");
                }
            }
        }
    }
}
