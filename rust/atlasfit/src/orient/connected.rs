//! Which charts hang together.
//!
//! In: the pairs of charts that share points. Out: the part of each chart.

use crate::atlas::Relation;
use crate::spatial::sets::Sets;

/// For each chart the first of the charts that it is connected with.
pub(crate) fn connected(charts: usize, relations: &[Relation]) -> Vec<u32> {
    let mut sets = Sets::new(charts);
    relations.iter().for_each(|r| sets.join(r.a, r.b));
    (0..charts as u32).map(|c| sets.find(c)).collect()
}
