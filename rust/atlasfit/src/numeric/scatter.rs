//! A random order of things that each of them decides by its name.
//!
//! In: names, such as a point's row in its scan, and a seed. Out: the numbers of the things in an order in
//! which any of them stand as they do among all: a scan and a tile of it choose the same points.

use super::rng::Rng;
use super::sort::sort;
use crate::error::Result;
use crate::run::Context;

/// A random number that depends on a name and the seed only.
#[must_use]
pub(crate) fn of_name(name: u64, seed: u64) -> u64 {
    Rng::stream(seed, name).bits()
}

/// Whether a thing is in an even share of all, one in so many: its name decides. Other seeds choose others.
#[must_use]
pub(crate) fn one_in(share: u64, name: u64, seed: u64) -> bool {
    share <= 1 || of_name(name, seed).is_multiple_of(share)
}

/// The numbers of names in a random order. Equal names stay in their order.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn by_name(names: &[u64], seed: u64, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut keys: Vec<(u64, u32)> = Vec::with_capacity(names.len());
    for (i, &name) in names.iter().enumerate() {
        ctx.check_at(i)?;
        keys.push((of_name(name, seed), i as u32));
    }
    sort(&mut keys, ctx)?;
    Ok(keys.into_iter().map(|k| k.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    #[test]
    fn some_come_in_the_order_that_they_have_among_all() {
        let all: Vec<u64> = (0..500).collect();
        let some: Vec<u64> = (100..500).step_by(3).collect();
        let order = |names: &[u64]| Run::default().execute(|ctx| by_name(names, 7, ctx)).unwrap();
        let of_all = order(&all);
        assert!(of_all.iter().zip(1..).any(|(a, b)| *a != b));
        let among_all = of_all.into_iter().filter(|i| *i >= 100 && (i - 100) % 3 == 0);
        assert!(among_all.map(|i| (i - 100) / 3).eq(order(&some)));
    }
}
