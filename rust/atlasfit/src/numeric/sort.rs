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
///
/// ```
/// use atlasfit::{Run, numeric::sort::sort_by};
/// let mut v = [1.5_f64, -2.0, 0.5];
/// Run::default().execute(|ctx| sort_by(&mut v, |a, b| b.total_cmp(a), ctx))?;
/// assert_eq!(v, [1.5, 0.5, -2.0]);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn sort_by<T: Copy + Send>(
    v: &mut [T],
    compare: impl Fn(&T, &T) -> Ordering + Copy + Send + Sync,
    ctx: &Context<'_>,
) -> Result<()> {
    let halvings = (v.len() / BLOCK).max(1).ilog2() as usize + 1;
    sort_to(v, compare, 2 * halvings, ctx)
}

/// Sorts with so many levels of sampled pivots, twice as many as halves would need. A list made against the
/// samples, of which each takes off a few elements only, is cut at its true middle from there on.
fn sort_to<T: Copy + Send>(
    v: &mut [T],
    compare: impl Fn(&T, &T) -> Ordering + Copy + Send + Sync,
    levels: usize,
    ctx: &Context<'_>,
) -> Result<()> {
    ctx.check()?;
    if v.len() <= BLOCK {
        v.sort_unstable_by(compare);
        return Ok(());
    }
    let pivot = if levels > 0 {
        let mut sample: Vec<T> = (0..SAMPLE).map(|k| v[k * (v.len() - 1) / (SAMPLE - 1)]).collect();
        sample.sort_unstable_by(compare);
        sample[SAMPLE / 2]
    } else {
        // Linear in the worst case.
        *v.select_nth_unstable_by(v.len() / 2, compare).1
    };
    let cut = partition(v, |x| compare(x, &pivot).is_lt(), ctx)?;
    let (below, rest) = v.split_at_mut(cut);
    // Where nothing is below the pivot there may be many that equal it: they stand where they belong.
    let equal = if cut == 0 { partition(rest, |x| compare(x, &pivot).is_eq(), ctx)? } else { 0 };
    let above = &mut rest[equal..];
    let levels = levels.saturating_sub(1);
    let (a, b) =
        rayon::join(|| sort_to(below, compare, levels, ctx), || sort_to(above, compare, levels, ctx));
    a.and(b)
}

/// Sorts by the elements' own order.
///
/// # Errors
/// Cancelled or out of time.
///
/// ```
/// use atlasfit::{Run, numeric::sort::sort};
/// let mut v = [3, 1, 2];
/// Run::default().execute(|ctx| sort(&mut v, ctx))?;
/// assert_eq!(v, [1, 2, 3]);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn sort<T: Copy + Send + Ord>(v: &mut [T], ctx: &Context<'_>) -> Result<()> {
    sort_by(v, T::cmp, ctx)
}

/// Puts the `n` least elements first. Those on either side of the cut come in any order, and so may elements
/// that compare equal to the one at the cut.
///
/// # Errors
/// Cancelled or out of time; the elements are then in no particular order.
pub fn select_by<T: Copy>(
    v: &mut [T],
    n: usize,
    compare: impl Fn(&T, &T) -> Ordering + Copy,
    ctx: &Context<'_>,
) -> Result<()> {
    let (mut v, mut n) = (v, n);
    // Twice as many rounds as halves would need; then what is left is cut at once, in linear time.
    let rounds = 2 * ((v.len() / BLOCK).max(1).ilog2() as usize + 1);
    for _ in 0..rounds {
        ctx.check()?;
        if v.len() <= BLOCK || n == 0 || n >= v.len() {
            break;
        }
        let mut sample: Vec<T> = (0..SAMPLE).map(|k| v[k * (v.len() - 1) / (SAMPLE - 1)]).collect();
        sample.sort_unstable_by(compare);
        let pivot = sample[SAMPLE / 2];
        let cut = partition(v, |x| compare(x, &pivot).is_lt(), ctx)?;
        let (below, rest) = v.split_at_mut(cut);
        if n <= cut {
            v = below;
            continue;
        }
        let equal = partition(rest, |x| compare(x, &pivot).is_eq(), ctx)?;
        (v, n) = (&mut rest[equal..], (n - cut).saturating_sub(equal));
    }
    if n > 0 && n < v.len() {
        v.select_nth_unstable_by(n, compare);
    }
    Ok(())
}

/// Moves the elements that `first` holds for to the front; returns how many they are.
///
/// # Errors
/// Cancelled or out of time.
///
/// ```
/// use atlasfit::{Run, numeric::sort::partition};
/// let mut v = [1, 2, 3, 4];
/// let even = Run::default().execute(|ctx| partition(&mut v, |x| x % 2 == 0, ctx))?;
/// assert!(even == 2 && v[..2].iter().all(|x| x % 2 == 0));
/// # Ok::<(), atlasfit::Error>(())
/// ```
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

    #[test]
    fn the_least_are_put_first_whatever_the_list_holds() {
        let mut rng = Rng::new(2);
        let n = 5 * BLOCK;
        let random: Vec<u64> = (0..n).map(|_| (rng.uniform() * 1e15) as u64).collect();
        let few: Vec<u64> = random.iter().map(|x| x % 3).collect();
        for v in [random, few, vec![7; n], (0..n as u64).collect(), (0..n as u64).rev().collect()] {
            let mut sorted = v.clone();
            sorted.sort_unstable();
            for cut in [0, 1, 100, n / 2, n - 1, n] {
                let mut cut_at = v.clone();
                Run::default().execute(|ctx| select_by(&mut cut_at, cut, u64::cmp, ctx)).unwrap();
                let (first, last) = cut_at.split_at_mut(cut);
                first.sort_unstable();
                last.sort_unstable();
                assert!(first == &sorted[..cut] && last == &sorted[cut..], "{cut}");
            }
        }
    }

    /// McIlroy's adversary ("A killer adversary for quicksort", 1999): values are decided while they are
    /// compared, so that each pivot is among the least. An element is a place in `value`.
    struct Adversary {
        value: Vec<u32>,
        decided: u32,
        candidate: u32,
        compared: u64,
    }

    const OPEN: u32 = u32::MAX;

    impl Adversary {
        fn compare(&mut self, a: u32, b: u32) -> Ordering {
            self.compared += 1;
            let open = |s: &Self, x: u32| s.value[x as usize] == OPEN;
            if open(self, a) && open(self, b) && a != b {
                let pivot = if a == self.candidate { a } else { b };
                self.value[pivot as usize] = self.decided;
                self.decided += 1;
            }
            if open(self, a) {
                self.candidate = a;
            } else if open(self, b) {
                self.candidate = b;
            }
            self.value[a as usize].cmp(&self.value[b as usize])
        }
    }

    #[test]
    fn a_list_made_against_the_samples_is_sorted_as_fast_as_others() {
        let n = BLOCK + BLOCK / 4;
        let mut v: Vec<u32> = (0..n as u32).collect();
        let adversary = Adversary { value: vec![OPEN; n], decided: 0, candidate: 0, compared: 0 };
        let adversary = std::sync::Mutex::new(adversary);
        let compare = |a: &u32, b: &u32| adversary.lock().expect("no comparison panics").compare(*a, *b);
        let mut run = Run { threads: 1, ..Run::default() };
        run.execute(|ctx| sort_by(&mut v, compare, ctx)).unwrap();
        let adversary = adversary.into_inner().unwrap();
        assert!(v.is_sorted_by_key(|&i| adversary.value[i as usize]));
        // n log2 n is 15 n; without the guard it was over 150 n.
        assert!(adversary.compared < 60 * n as u64, "{} comparisons of {n}", adversary.compared);
    }
}
