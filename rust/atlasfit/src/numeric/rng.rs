//! A small counter-based random generator, so that sampling gives the same bytes for any thread count.
//!
//! Source: SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").

/// The generator's increment: 2^64 over the golden ratio.
pub(crate) const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A SplitMix64 stream. Give every block of parallel work a stream of its own ([`Rng::stream`]).
///
/// ```
/// use atlasfit::numeric::Rng;
/// let (mut a, mut b) = (Rng::new(7), Rng::stream(7, 1));
/// assert_ne!(a.bits(), b.bits());
/// assert!((0.0..1.0).contains(&a.uniform()) && a.below(6) < 6 && a.normal().is_finite());
/// ```
#[derive(Debug, Clone)]
pub struct Rng(u64);

impl Rng {
    /// The generator of a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }
    /// The generator of one of many independent streams of a seed.
    #[must_use]
    pub const fn stream(seed: u64, stream: u64) -> Self {
        Self(mix(mix(seed.wrapping_add(GOLDEN)) ^ mix(stream.wrapping_mul(GOLDEN).wrapping_add(1))))
    }
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }
    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }
    /// Uniform in 0..n, n > 0 (Lemire's multiplication; the bias is below n / 2^64).
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }
    /// Standard normal (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

const fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The numbers 0..n in a random order that depends on the seed only (Fisher and Yates).
///
/// ```
/// let mut order = atlasfit::numeric::rng::shuffled(5, 1);
/// order.sort_unstable();
/// assert_eq!(order, [0, 1, 2, 3, 4]);
/// ```
#[must_use]
pub fn shuffled(n: usize, seed: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    let mut rng = Rng::new(seed ^ GOLDEN);
    for i in (1..n).rev() {
        let j = rng.below(i + 1);
        order.swap(i, j);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_and_normal_have_their_moments_and_streams_differ() {
        let mut rng = Rng::new(7);
        let n = 100_000;
        let mean = (0..n).map(|_| rng.uniform()).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 5e-3, "{mean}");
        let var = (0..n).map(|_| rng.normal().powi(2)).sum::<f64>() / f64::from(n);
        assert!((var - 1.0).abs() < 2e-2, "{var}");
        assert!((0..1000).all(|_| rng.below(3) < 3));
        assert_ne!(Rng::stream(1, 2).bits(), Rng::stream(1, 3).bits());
        assert_ne!(Rng::stream(1, 2).bits(), Rng::stream(2, 2).bits());
    }
}
