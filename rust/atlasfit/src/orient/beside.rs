//! How charts face each other that share no points, across gaps and steps.
//!
//! In: charts. Out: relations of those beside each other. They count little: they decide where nothing else
//! does. Charts that share a few points of a step say next to nothing of the two sheets that it joins.

use super::constants::ORIENT;
use crate::atlas::{FittedChart, Foot, Map, Monge, Relation};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;
use rayon::prelude::*;

/// How far two unit normals, at places in the unit direction `along` from each other, are those of a surface
/// that goes on from one to the other in an arc: -1 to 1. An arc takes a normal to its mirror image. Near 0
/// where a place does not lie beside the other but before it.
pub(crate) fn goes_on(from: Vec3, to: Vec3, along: Vec3) -> f64 {
    let (leaves, arrives) = (from.dot(along), to.dot(along));
    let carried = from - along * (2.0 * leaves);
    carried.dot(to) * (1.0 - leaves * leaves) * (1.0 - arrives * arrives)
}

/// Relations of each chart to those whose centres are nearest, of which neither lies over the other: what does
/// is the same sheet, or an opposing one.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn beside(fitted: &[FittedChart], ctx: &Context<'_>) -> Result<Vec<Relation>> {
    let centers: Vec<(u32, &Monge, Foot)> = (0..)
        .zip(fitted)
        .filter_map(|(c, f)| match &f.chart.map {
            Map::Monge(m) => Some((c, m, m.at([0.0; 2]))),
            Map::Tube(_) => None,
        })
        .collect();
    if centers.is_empty() {
        return Ok(Vec::new());
    }
    let at: Vec<Vec3> = centers.iter().map(|c| c.2.position).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let chunks = centers
        .par_chunks(64)
        .map(|chunk| {
            ctx.check()?;
            let (mut found, mut out) = (Vec::new(), Vec::new());
            for (a, map, p) in chunk {
                tree.nearest(p.position, ORIENT.beside_charts, &mut found);
                let others = found.iter().map(|f| &centers[f.index as usize]);
                let beside = |(_, other, q): &&(u32, &Monge, Foot)| {
                    map.weight(q.position) == 0.0 && other.weight(p.position) == 0.0
                };
                out.extend(others.filter(beside).map(|(b, _, q)| Relation {
                    a: *a.min(b),
                    b: *a.max(b),
                    agreement: ORIENT.beside
                        * goes_on(p.normal, q.normal, (q.position - p.position).normalized()),
                }));
            }
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(chunks.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: Vec3 = Vec3([0.0, 0.0, 1.0]);
    const X: Vec3 = Vec3([1.0, 0.0, 0.0]);

    #[test]
    fn a_surface_goes_on_with_the_normal_that_its_arc_gives_it() {
        assert_eq!(goes_on(UP, UP, X), 1.0);
        assert_eq!(goes_on(UP, -UP, X), -1.0);
        // A quarter of a circle, and a valley.
        let (a, b) = (Vec3([-0.6, 0.0, 0.8]), Vec3([0.6, 0.0, 0.8]));
        assert!(goes_on(a, b, X) > 0.4 && goes_on(b, a, X) > 0.4);
    }

    #[test]
    fn what_lies_before_a_surface_says_nothing() {
        assert_eq!(goes_on(UP, UP, UP), 0.0);
        assert_eq!(goes_on(UP, -UP, UP), 0.0);
    }
}
