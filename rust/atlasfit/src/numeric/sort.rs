//! Sorting and splitting of long lists in a run: in place, on all threads, and never long without a look at
//! the run.
//!
//! The order is the comparison's alone, so the result does not depend on the number of threads.

use crate::error::Result;
use crate::run::Context;
use std::cmp::Ordering;

/// Elements handled between two checks: a millisecond or two of work.
const BLOCK: usize = 1 << 15;
/// Elements that a pivot is chosen from.
const SAMPLE: usize = 63;

/// Sorts. Elements that compare equal may come in any order.
///
/// # Errors
/// Cancelled or out of time; the elements are then in no particular order.
pub fn sort_by<T: Copy + Send>(
    v: &mut [T],
    compare: impl Fn(&T, &T) -> Ordering + Copy + Send + Sync,
    ctx: &Context<'_>,
) -> Result<()> {
    ctx.check()?;
    if v.len() <= BLOCK {
        v.sort_unstable_by(compare);
        return Ok(());
    }
    let mut sample: Vec<T> = (0..SAMPLE).map(|k| v[k * (v.len() - 1) / (SAMPLE - 1)]).collect();
    sample.sort_unstable_by(compare);
    let pivot = sample[SAMPLE / 2];
    let cut = partition(v, |x| compare(x, &pivot).is_lt(), ctx)?;
    let (below, rest) = v.split_at_mut(cut);
    // What equals the pivot stands where it belongs.
    let equal = partition(rest, |x| compare(x, &pivot).is_eq(), ctx)?;
    let above = &mut rest[equal..];
    let (a, b) = rayon::join(|| sort_by(below, compare, ctx), || sort_by(above, compare, ctx));
    a.and(b)
}

/// Sorts by the elements' own order.
///
/// # Errors
/// Cancelled or out of time.
pub fn sort<T: Copy + Send + Ord>(v: &mut [T], ctx: &Context<'_>) -> Result<()> {
    sort_by(v, T::cmp, ctx)
}

/// Moves the elements that `first` holds for to the front; returns how many they are.
///
/// # Errors
/// Cancelled or out of time.
pub fn partition<T: Copy>(v: &mut [T], first: impl Fn(&T) -> bool, ctx: &Context<'_>) -> Result<usize> {
    let mut front = 0;
    let mut from = 0;
    while from < v.len() {
        ctx.check()?;
        let to = (from + BLOCK).min(v.len());
        // Without a branch: a swap of two later elements does no harm.
        for k in from..to {
            let x = v[k];
            v.swap(front, k);
            front += usize::from(first(&x));
        }
        from = to;
    }
    Ok(front)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::rng::Rng;

    #[test]
    fn long_lists_are_sorted_whatever_they_hold() {
        let mut rng = Rng::new(1);
        let n = 5 * BLOCK;
        let random: Vec<u64> = (0..n).map(|_| (rng.uniform() * 1e15) as u64).collect();
        let few: Vec<u64> = random.iter().map(|x| x % 3).collect();
        for v in [random, few, vec![7; n], (0..n as u64).collect(), (0..n as u64).rev().collect()] {
            let (mut a, mut b) = (v.clone(), v);
            Run::default().execute(|ctx| sort(&mut a, ctx)).unwrap();
            b.sort_unstable();
            assert!(a == b);
        }
    }
}
