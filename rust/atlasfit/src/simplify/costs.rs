//! What edges cost, counted by size.
//!
//! In: costs. Out: the cost that so many edges stay below. Counts of blocks add up to the same in any order.

/// Bits of a cost's square, below its exponent, by which costs are told apart. Source: chosen, a step is 12 %
/// at the most.
const BITS: u32 = 2;
/// Counts: the last is of costs of at least 1, the first of those below 2^-24 and of zero.
const BINS: usize = (48 << BITS) + 1;
/// What a square's bits are shifted by, and those of 1 then.
const SHIFT: u32 = f64::MANTISSA_DIGITS - 1 - BITS;
const ONE: u64 = 1f64.to_bits() >> SHIFT;

/// How many edges cost how much, in shares of the greatest error.
#[derive(Clone, Copy)]
pub(super) struct Costs([u32; BINS]);

impl Default for Costs {
    fn default() -> Self {
        Self([0; BINS])
    }
}

impl Costs {
    /// Counts an edge; takes the square of its cost.
    #[inline]
    pub(super) fn count(&mut self, cost2: f64) {
        let least = ONE - (BINS as u64 - 1);
        self.0[((cost2.to_bits() >> SHIFT).clamp(least, ONE) - least) as usize] += 1;
    }

    /// Takes the counts of others.
    pub(super) fn add(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += b);
    }

    /// A cost that about so many edges stay below, at most 1; nothing where none was counted.
    pub(super) fn of_rank(&self, rank: usize) -> Option<f64> {
        let mut below = 0usize;
        let bin = self.0.iter().position(|&n| {
            below += n as usize;
            below >= rank.max(1)
        });
        (below > 0).then(|| {
            let above = bin.unwrap_or(BINS - 1) + 2;
            f64::from_bits((ONE + above as u64 - BINS as u64) << SHIFT).sqrt().min(1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cost_of_a_rank_is_the_next_step_above_that_of_the_edge() {
        let mut costs = Costs::default();
        assert_eq!(costs.of_rank(1), None);
        for k in 1..=100 {
            costs.count((f64::from(k) / 100.0).powi(2));
        }
        costs.count(0.0);
        for rank in [1, 11, 51, 101, 1000] {
            let edge = (rank as f64 - 1.0).clamp(2f64.powi(-24), 100.0) / 100.0;
            let told = costs.of_rank(rank).unwrap();
            assert!(
                told >= edge.min(1.0) && told <= (edge * 1.2).max(2f64.powi(-23)),
                "{rank} {told} {edge}"
            );
        }
    }
}
