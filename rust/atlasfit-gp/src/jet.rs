//! Numbers with exact derivatives: Taylor polynomials in two variables, up to the second power of each.
//!
//! In: functions written over [`Number`]. Out: their values for `f64`, their derivatives too for [`Jet`].
//! Source: Griewank and Walther 2008, "Evaluating derivatives", chapter 13 (Taylor arithmetic).

use std::ops::{Add, Mul, Sub};

/// What kernels are computed with.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// A constant.
    fn of(x: f64) -> Self;
    /// The value without derivatives.
    fn value(self) -> f64;
    /// Times a constant.
    fn times(self, x: f64) -> Self;
    /// The square root; its derivatives are finite where the value is positive.
    fn sqrt(self) -> Self;
    /// The angle of the point with abscissa `x` and ordinate `self`, as [`f64::atan2`].
    fn atan2(self, x: Self) -> Self;
    /// One over the number.
    fn inverse(self) -> Self;
}

impl Number for f64 {
    fn of(x: f64) -> Self {
        x
    }
    fn value(self) -> f64 {
        self
    }
    fn times(self, x: f64) -> Self {
        self * x
    }
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    fn atan2(self, x: Self) -> Self {
        Self::atan2(self, x)
    }
    fn inverse(self) -> Self {
        1.0 / self
    }
}

/// Powers of each variable that are kept: 0, 1, 2.
const POWERS: usize = 3;
/// A polynomial without constant term vanishes when raised to this power.
const VANISHES: usize = 2 * (POWERS - 1) + 1;

/// A function of (s, t) near (0, 0): `self.0[i][j]` is the factor of s^i t^j.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet(pub [[f64; POWERS]; POWERS]);

impl Jet {
    /// a + b s + c s^2, or the same in t.
    #[must_use]
    pub fn along(in_t: bool, [a, b, c]: [f64; POWERS]) -> Self {
        let mut jet = Self::of(a);
        for (power, x) in [(1, b), (2, c)] {
            let [i, j] = if in_t { [0, power] } else { [power, 0] };
            jet.0[i][j] = x;
        }
        jet
    }

    /// The derivative, `i` times by s and `j` times by t, each at most 2.
    #[must_use]
    pub fn derivative(&self, i: usize, j: usize) -> f64 {
        let factorial = |n: usize| if n == 2 { 2.0 } else { 1.0 };
        self.0[i][j] * factorial(i) * factorial(j)
    }

    /// The function with Taylor coefficients `series` about the value, of this.
    fn compose(self, series: [f64; VANISHES]) -> Self {
        let mut off = self;
        off.0[0][0] = 0.0;
        // Horner's scheme.
        let [first, rest @ ..] = series;
        rest.into_iter().rev().chain([first]).fold(Self::of(0.0), |sum, x| sum * off + Self::of(x))
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] + b.0[i][j])))
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + b.times(-1.0)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        let entry = |i: usize, j: usize| -> f64 {
            (0..=i).flat_map(|k| (0..=j).map(move |l| self.0[k][l] * b.0[i - k][j - l])).sum()
        };
        Self(std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))))
    }
}

impl Number for Jet {
    fn of(x: f64) -> Self {
        let mut jet = Self([[0.0; POWERS]; POWERS]);
        jet.0[0][0] = x;
        jet
    }
    fn value(self) -> f64 {
        self.0[0][0]
    }
    fn times(self, x: f64) -> Self {
        Self(self.0.map(|row| row.map(|a| a * x)))
    }
    fn sqrt(self) -> Self {
        let a = self.value();
        let r = a.sqrt();
        self.compose([r, 0.5 / r, -0.125 / (r * a), 0.0625 / (r * a * a), -0.039_062_5 / (r * a * a * a)])
    }
    fn atan2(self, x: Self) -> Self {
        let (y0, x0) = (self.value(), x.value());
        // The angle from the direction of the value: its tangent has no constant term.
        let turned = (self.times(x0) - x.times(y0)) * (x.times(x0) + self.times(y0)).inverse();
        Self::of(y0.atan2(x0)) + turned.compose([0.0, 1.0, 0.0, -1.0 / 3.0, 0.0])
    }
    fn inverse(self) -> Self {
        let r = 1.0 / self.value();
        self.compose([r, -r * r, r.powi(3), -r.powi(4), r.powi(5)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 + s + t)^2 / (2 - s t) under root and arc tangent.
    fn function<N: Number>(s: N, t: N) -> N {
        let one = N::of(1.0);
        let a = (one + s + t) * (one + s + t) * (N::of(2.0) - s * t).inverse();
        (a + s).sqrt() + (a - t).atan2(one + s * s)
    }

    #[test]
    fn derivatives_are_those_of_finite_differences() {
        let jet = function(Jet::along(false, [0.0, 1.0, 0.0]), Jet::along(true, [0.0, 1.0, 0.0]));
        let h = 1e-2;
        // Stencils of the fourth order for the value, the first and the second derivative.
        let stencil = [
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0],
            [-1.0 / 12.0, 4.0 / 3.0, -2.5, 4.0 / 3.0, -1.0 / 12.0],
        ];
        for (i, in_s) in stencil.iter().enumerate() {
            for (j, in_t) in stencil.iter().enumerate() {
                let mut sum = 0.0;
                for (k, a) in in_s.iter().enumerate() {
                    for (l, b) in in_t.iter().enumerate() {
                        sum += a * b * function((k as f64 - 2.0) * h, (l as f64 - 2.0) * h);
                    }
                }
                let expected = sum / h.powi((i + j) as i32);
                assert!((jet.derivative(i, j) - expected).abs() < 1e-3, "{i} {j} {jet:?} {expected}");
            }
        }
    }
}
