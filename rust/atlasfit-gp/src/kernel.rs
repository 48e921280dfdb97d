//! The covariance of a network's outputs as its layers grow wide, and the tangent kernel of its training.
//!
//! In: activation, depth, variances of weights and biases; two inputs. Out: covariance, derivatives, tangent
//! kernel. Sources: *Deep Manifold Prior*, section 4; Williams 1997, "Computing with infinite networks"
//! (erf); Cho and Saul 2009, "Kernel methods for deep learning" (ReLU); Jacot, Gabriel and Hongler 2018,
//! "Neural tangent kernel".
//!
//! Outputs of a vector-valued network are independent, each with the same covariance: a curve in the plane is
//! two draws of one process, a surface in space three.

use crate::jet::{Jet, Number};
use std::f64::consts::PI;

/// What a hidden unit does to its sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// The error function, 2 / sqrt(pi) times the integral of exp(-t^2): smooth, sigmoid.
    Erf,
    /// max(0, t), as in the paper's fully connected networks.
    Relu,
    /// t, and 0.2 t below zero, as in the paper's convolutional networks.
    LeakyRelu,
}

/// Slope of the leaky ReLU for negative values (supplement A).
const LEAK: f64 = 0.2;

/// Second moments of a pair of centred Gaussian variables a, b: E[a a], E[a b], E[b b].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair<N> {
    /// E[a a].
    pub aa: N,
    /// E[a b].
    pub ab: N,
    /// E[b b].
    pub bb: N,
}

impl Activation {
    /// The activation's value.
    #[must_use]
    pub fn at(self, t: f64) -> f64 {
        match self {
            Self::Erf => erf(t),
            Self::Relu => t.max(0.0),
            Self::LeakyRelu => t.max(LEAK * t),
        }
    }

    /// The activation's value, first and second derivative; those of the kinks are 0.
    #[must_use]
    pub fn slopes(self, t: f64) -> [f64; 3] {
        let below = if self == Self::LeakyRelu { LEAK } else { 0.0 };
        match self {
            Self::Erf => {
                let slope = 2.0 / PI.sqrt() * (-t * t).exp();
                [erf(t), slope, -2.0 * t * slope]
            }
            _ => [self.at(t), if t > 0.0 { 1.0 } else { below }, 0.0],
        }
    }

    /// E[h(a) h(b)], closed form.
    pub fn second_moment<N: Number>(self, of: Pair<N>) -> N {
        match self {
            Self::Erf => {
                let (p, q2) = sigmoid_angle(of);
                p.atan2((q2 - p * p).sqrt()).times(2.0 / PI)
            }
            Self::Relu => rectified(of),
            Self::LeakyRelu => of.ab.times(LEAK) + rectified(of).times((1.0 - LEAK).powi(2)),
        }
    }

    /// E[h'(a) h'(b)], closed form.
    pub fn second_moment_of_slope<N: Number>(self, of: Pair<N>) -> N {
        let on = || (N::of(PI) - angle(of).1).times(0.5 / PI);
        match self {
            Self::Erf => {
                let (p, q2) = sigmoid_angle(of);
                (q2 - p * p).sqrt().inverse().times(4.0 / PI)
            }
            Self::Relu => on(),
            Self::LeakyRelu => N::of(LEAK) + on().times((1.0 - LEAK).powi(2)),
        }
    }
}

/// Numerator and squared denominator of Williams' arc sine.
fn sigmoid_angle<N: Number>(of: Pair<N>) -> (N, N) {
    let one = N::of(1.0);
    (of.ab.times(2.0), (one + of.aa.times(2.0)) * (one + of.bb.times(2.0)))
}

/// The sine, times the two standard deviations, of the angle between a and b, and the angle. On the diagonal
/// the sine is 0 and has no derivative.
fn angle<N: Number>(of: Pair<N>) -> (N, N) {
    let square = of.aa * of.bb - of.ab * of.ab;
    let sine = if square.value() > 0.0 { square.sqrt() } else { N::of(0.0) };
    (sine, sine.atan2(of.ab))
}

/// E[max(0, a) max(0, b)]: half of Cho and Saul's arc-cosine kernel of order 1.
fn rectified<N: Number>(of: Pair<N>) -> N {
    let (sine, psi) = angle(of);
    (sine + (N::of(PI) - psi) * of.ab).times(0.5 / PI)
}

/// The error function by its continued integral: series near 0, continued fraction beyond (Abramowitz and
/// Stegun 7.1.5, 7.1.14). Rounding only.
#[must_use]
pub fn erf(t: f64) -> f64 {
    let x = t.abs();
    let value = if x < 2.5 {
        let (mut term, mut sum) = (x, x);
        for n in 1..60 {
            term *= -x * x / f64::from(n);
            sum += term / f64::from(2 * n + 1);
        }
        sum * 2.0 / PI.sqrt()
    } else {
        1.0 - scaled_complement(x) * (-x * x).exp()
    };
    value.copysign(t)
}

/// exp(x^2) (1 - erf(x)) for x of 0 or more.
#[must_use]
pub fn scaled_complement(x: f64) -> f64 {
    if x < 2.5 {
        return (x * x).exp() * (1.0 - erf(x));
    }
    let fraction = (1..=60).rev().fold(x, |below, n| x + 0.5 * f64::from(n) / below);
    1.0 / (PI.sqrt() * fraction)
}

/// The process that a fully connected network tends to.
///
/// Weights of the first layer have variance 1, those of later ones `weight` over the number of units before
/// them; biases have variance `bias`.
///
/// ```
/// use atlasfit_gp::kernel::Kernel;
/// // Cho and Saul's kernel at a right angle: |x| |y| / pi.
/// let kernel = Kernel { bias: 0.0, ..Kernel::relu(1) };
/// assert!((kernel.at(&[2.0, 0.0], &[0.0, 3.0]) - 6.0 / std::f64::consts::PI).abs() < 1e-14);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    /// The hidden units.
    pub activation: Activation,
    /// Hidden layers, 1 or more.
    pub depth: usize,
    /// Variance of the weights after the first layer, times the number of units.
    pub weight: f64,
    /// Variance of the biases.
    pub bias: f64,
}

impl Kernel {
    /// ReLU: weights of variance 2, which keep the size of what passes (the paper's 1 / pi for Cho and Saul's
    /// 1 / (2 pi)); biases of variance 1, so that the process knows places and not directions only.
    #[must_use]
    pub const fn relu(depth: usize) -> Self {
        Self { activation: Activation::Relu, depth, weight: 2.0, bias: 1.0 }
    }

    /// The error function, weights and biases of variance 1.
    #[must_use]
    pub const fn erf(depth: usize) -> Self {
        Self { activation: Activation::Erf, depth, weight: 1.0, bias: 1.0 }
    }

    /// Another variance of the biases.
    #[must_use]
    pub const fn with_bias(self, bias: f64) -> Self {
        Self { bias, ..self }
    }

    /// Covariance of the outputs at two inputs.
    ///
    /// # Panics
    /// When the inputs are not of the same dimension.
    #[must_use]
    pub fn at(&self, x: &[f64], y: &[f64]) -> f64 {
        self.covariance(products(x, y)).ab
    }

    /// Correlation of the outputs at two inputs: cos psi in the paper.
    ///
    /// # Panics
    /// When the inputs are not of the same dimension.
    #[must_use]
    pub fn correlation(&self, x: &[f64], y: &[f64]) -> f64 {
        let k = self.covariance(products(x, y));
        k.ab / (k.aa * k.bb).sqrt()
    }

    /// Second moments of the outputs, from the inputs' inner products.
    pub fn covariance<N: Number>(&self, inputs: Pair<N>) -> Pair<N> {
        (0..self.depth).fold(self.first(inputs), |k, _| self.next(k))
    }

    /// The tangent kernel: the inner product of the outputs' gradients by all parameters. Wide trained
    /// networks are kernel regression with it.
    pub fn tangent<N: Number>(&self, inputs: Pair<N>) -> N {
        let mut k = self.first(inputs);
        let mut tangent = k.ab;
        for _ in 0..self.depth {
            let slope = self.activation.second_moment_of_slope(k).times(self.weight);
            k = self.next(k);
            tangent = tangent * slope + k.ab;
        }
        tangent
    }

    /// The sums of the first hidden layer.
    fn first<N: Number>(&self, inputs: Pair<N>) -> Pair<N> {
        let bias = N::of(self.bias);
        Pair { aa: inputs.aa + bias, ab: inputs.ab + bias, bb: inputs.bb + bias }
    }

    /// The sums of the layer after one with these sums.
    fn next<N: Number>(&self, of: Pair<N>) -> Pair<N> {
        let moment = |aa: N, ab: N, bb: N| {
            self.activation.second_moment(Pair { aa, ab, bb }).times(self.weight) + N::of(self.bias)
        };
        // A variable with itself: its moment needs no angle, whose derivative does not exist there.
        let own = |v: N| match self.activation {
            Activation::Erf => moment(v, v, v),
            Activation::Relu => v.times(0.5 * self.weight) + N::of(self.bias),
            Activation::LeakyRelu => v.times(0.5 * (1.0 + LEAK * LEAK) * self.weight) + N::of(self.bias),
        };
        Pair { aa: own(of.aa), ab: moment(of.aa, of.ab, of.bb), bb: own(of.bb) }
    }

    /// The covariance of f(x + s u) and f(y + t v), with its derivatives by s and t up to the second of each.
    /// `None` where they do not exist: for ReLU at the same input.
    ///
    /// # Panics
    /// When the vectors are not of the same dimension.
    #[must_use]
    pub fn jet(&self, x: &[f64], u: &[f64], y: &[f64], v: &[f64]) -> Option<Jet> {
        let mut ab = Jet::along(false, [dot(x, y), dot(u, y), 0.0]);
        ab.0[0][1] = dot(x, v);
        ab.0[1][1] = dot(u, v);
        let aa = Jet::along(false, [dot(x, x), 2.0 * dot(x, u), dot(u, u)]);
        let bb = Jet::along(true, [dot(y, y), 2.0 * dot(y, v), dot(v, v)]);
        let jet = self.covariance(Pair { aa, ab, bb }).ab;
        let smooth = self.activation == Activation::Erf || x != y;
        (smooth && jet.0.iter().flatten().all(|c| c.is_finite())).then_some(jet)
    }

    /// Covariance of the derivative along `u` at `x` and that along `v` at `y`: of the gradient field, whose
    /// directions are the normals of a level set.
    ///
    /// # Panics
    /// When the vectors are not of the same dimension.
    #[must_use]
    pub fn gradient(&self, x: &[f64], u: &[f64], y: &[f64], v: &[f64]) -> f64 {
        if let Some(jet) = self.jet(x, u, y, v) {
            return jet.derivative(1, 1);
        }
        // At one input: E[h'(z)^2 dz dz'] is half of E[dz dz'] for ReLU, since (z, dz) and (-z, -dz) are
        // alike.
        let leak = if self.activation == Activation::LeakyRelu { LEAK } else { 0.0 };
        dot(u, v) * (0.5 * (1.0 + leak * leak) * self.weight).powi(self.depth as i32)
    }
}

/// Inner products of two inputs.
///
/// # Panics
/// When they are not of the same dimension.
#[must_use]
pub fn products(x: &[f64], y: &[f64]) -> Pair<f64> {
    Pair { aa: dot(x, x), ab: dot(x, y), bb: dot(y, y) }
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    assert_eq!(x.len(), y.len(), "inputs of one dimension");
    x.iter().zip(y).map(|(a, b)| a * b).sum()
}
