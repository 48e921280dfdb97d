//! How charts face each other that share no points, across gaps and steps.
//!
//! In: charts. Out: relations of those beside each other. They count little: they decide where nothing else
//! does. Charts that share a few points of a step say next to nothing of the two sheets that it joins.

use super::centers::{About, Center, Centers};
use super::constants::ORIENT;
use crate::atlas::Relation;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// How far two unit normals, at places in the unit direction `along` from each other, are those of a surface
/// that goes on from one to the other in an arc: -1 to 1. An arc takes a normal to its mirror image. Near 0
/// where a place does not lie beside the other but before it.
fn goes_on(from: Vec3, to: Vec3, along: Vec3) -> f64 {
    let (leaves, arrives) = (from.dot(along), to.dot(along));
    let carried = from - along * (2.0 * leaves);
    carried.dot(to) * (1.0 - leaves * leaves) * (1.0 - arrives * arrives)
}

/// Relations of each chart to those whose centres are nearest, of which neither lies over the other: what
/// does is the same sheet, or an opposing one.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn beside(centers: &Centers<'_>, ctx: &Context<'_>) -> Result<Vec<Relation>> {
    let look = |a: &Center<'_>, about: &mut About<'_>, out: &mut Vec<Relation>| {
        let (p, n) = (a.foot.position, a.foot.normal);
        let others = about.nearest(a, ORIENT.beside_charts);
        let beside = others.filter(|b| a.map.weight(b.foot.position) == 0.0 && b.map.weight(p) == 0.0);
        out.extend(beside.map(|b| Relation {
            a: a.chart.min(b.chart),
            b: a.chart.max(b.chart),
            agreement: ORIENT.beside * goes_on(n, b.foot.normal, (b.foot.position - p).normalized()),
        }));
    };
    centers.relations(look, ctx)
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
