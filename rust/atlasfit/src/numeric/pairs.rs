//! What many items say of pairs, summed.
//!
//! In: for each item some pairs with numbers. Out: each pair once, with the sums, in the order of the pairs;
//! the same for any number of threads.

use super::sort::sort_by;
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Items between two looks at the run.
const BLOCK: usize = 1024;

/// Numbers of a pair, the first less than the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairOf<T, const N: usize> {
    /// The first.
    pub a: u32,
    /// The second.
    pub b: u32,
    /// The numbers.
    pub values: [T; N],
}

/// Sums what the items 0 to `items` say, `of_item` each.
///
/// # Errors
/// Cancelled or out of time.
pub fn sums<const N: usize, I: IntoIterator<Item = PairOf<f32, N>>>(
    items: usize,
    of_item: impl Fn(usize) -> I + Sync,
    ctx: &Context<'_>,
) -> Result<Vec<PairOf<f64, N>>> {
    let blocks = (0..items.div_ceil(BLOCK)).into_par_iter().map(|k| {
        ctx.check()?;
        Ok((k * BLOCK..items.min((k + 1) * BLOCK)).flat_map(&of_item).collect::<Vec<_>>())
    });
    let mut said = blocks.collect::<Result<Vec<_>>>()?.concat();
    // The numbers are keys too: the order of the sums is then the same on every run.
    sort_by(&mut said, order, ctx)?;
    let mut out: Vec<PairOf<f64, N>> = Vec::new();
    for (i, PairOf { a, b, values }) in said.into_iter().enumerate() {
        ctx.check_at(i)?;
        match out.last_mut() {
            Some(p) if (p.a, p.b) == (a, b) => {
                p.values.iter_mut().zip(values).for_each(|(sum, v)| *sum += f64::from(v));
            }
            _ => out.push(PairOf { a, b, values: values.map(f64::from) }),
        }
    }
    Ok(out)
}

fn order<const N: usize>(x: &PairOf<f32, N>, y: &PairOf<f32, N>) -> Ordering {
    let numbers = || x.values.iter().zip(&y.values).map(|(a, b)| a.total_cmp(b));
    (x.a, x.b).cmp(&(y.a, y.b)).then_with(|| numbers().find(|o| o.is_ne()).unwrap_or(Ordering::Equal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn each_pair_comes_once_with_all_that_is_said_of_it() {
        // Item i says i and 1 of the pair (i mod 3, 5).
        let of = |i: usize| [PairOf { a: i as u32 % 3, b: 5, values: [i as f32, 1.0] }];
        let found = Run::default().execute(|ctx| sums(3000, of, ctx)).unwrap();
        let expected = [0u32, 1, 2].map(|a| {
            let sum = (0..1000).map(|k| f64::from(3 * k + a)).sum::<f64>();
            PairOf { a, b: 5, values: [sum, 1000.0] }
        });
        assert_eq!(found, expected);
    }
}
