//! How likely it is that what is doubtful is surface.
//!
//! In: which points lie on surface beyond doubt, and groups of the others, each with what its charts say.
//! Out: for each group the logarithm of its odds. Surface goes on beside known surface; strays lie anywhere
//! in the scan's box. How many of the groups and of the points on no chart are strays is what makes their
//! places and the groups' evidence likeliest (expectation and maximisation; Dempster, Laird and Rubin 1977).
//! A scan with many strays far off then asks for much evidence, one without any for none.

use super::constants::STRAYS;
use super::density::each;
use crate::error::Result;
use crate::numeric::Rng;
use crate::numeric::vec3::Vec3;
use crate::partition::Cut;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::bvh::Aabb;
use crate::spatial::neighbours::Neighbour;

/// What is surface or strays as a whole.
#[derive(Debug, Clone, Default)]
pub(super) struct Group {
    /// The evidence that it is surface, in nats.
    pub evidence: f64,
    /// Its charts.
    pub charts: Vec<u32>,
    /// Its points.
    pub points: Vec<u32>,
}

/// The logarithm of each group's odds to be surface. `known` marks the points that are, `lone` are those on
/// no chart.
pub(super) fn of_groups(
    cut: &Cut<'_>,
    known: &[bool],
    groups: &[Group],
    lone: &[u32],
    ctx: &Context<'_>,
) -> Result<Vec<f64>> {
    let known: Vec<u32> = (0..known.len() as u32).filter(|&i| known[i as usize]).collect();
    let places: Vec<Vec3> = known.iter().map(|&i| cut.points[i as usize]).collect();
    let tree = Neighbours::build(&places, ctx)?;
    let is_beside = |at: Vec3, found: &mut Vec<Neighbour>| {
        tree.nearest(at, 1, found);
        found.first().is_some_and(|f| {
            let spacing = f64::from(cut.sampling.spacing[known[f.index as usize] as usize]);
            f.dist2 <= (STRAYS.window_spacings * spacing).powi(2)
        })
    };
    let of_point =
        |i: u32, found: &mut Vec<Neighbour>| f64::from(u8::from(is_beside(cut.points[i as usize], found)));
    let asked: Vec<u32> = groups.iter().flat_map(|g| &g.points).chain(lone).copied().collect();
    let beside = each(&asked, ctx, of_point)?;
    let mut left = &beside[..];
    let mut units: Vec<Unit> = Vec::with_capacity(groups.len() + lone.len());
    for group in groups {
        let (own, rest) = left.split_at(group.points.len());
        let beside = own.iter().sum::<f64>() / own.len().max(1) as f64;
        units.push(Unit { evidence: group.evidence, beside });
        left = rest;
    }
    // A point on no chart says nothing but where it lies.
    units.extend(left.iter().map(|&beside| Unit { evidence: 0.0, beside }));
    let mut odds = of_units(&units, share_beside(cut, is_beside, ctx)?);
    odds.truncate(groups.len());
    Ok(odds)
}

/// A group, or a point on no chart.
struct Unit {
    evidence: f64,
    /// The share of its points beside known surface.
    beside: f64,
}

/// The share of the scan's box that is beside known surface.
fn share_beside(
    cut: &Cut<'_>,
    is_beside: impl Fn(Vec3, &mut Vec<Neighbour>) -> bool + Sync,
    ctx: &Context<'_>,
) -> Result<f64> {
    let all = Aabb::of(cut.points);
    let mut rng = Rng::new(0);
    let anywhere = || Vec3::from_fn(|k| all.min[k] + rng.uniform() * (all.max[k] - all.min[k]));
    let places: Vec<Vec3> = std::iter::repeat_with(anywhere).take(STRAYS.places).collect();
    let numbers: Vec<u32> = (0..places.len() as u32).collect();
    let beside = each(&numbers, ctx, |i, found| is_beside(places[i as usize], found))?;
    let count = beside.iter().filter(|b| **b).count();
    // Laplace's rule of succession: neither none nor all.
    Ok((count as f64 + 1.0) / (places.len() as f64 + 2.0))
}

/// The logarithms of the units' odds, where so large a share of all strays lie beside surface.
fn of_units(units: &[Unit], strays_beside: f64) -> Vec<f64> {
    let beside = (STRAYS.beside / strays_beside).ln();
    let off = ((1.0 - STRAYS.beside) / (1.0 - strays_beside)).ln();
    let own: Vec<f64> =
        units.iter().map(|u| u.evidence + u.beside * beside + (1.0 - u.beside) * off).collect();
    let mut all = 0.0;
    for _ in 0..STRAYS.rounds {
        let surface: f64 = own.iter().map(|o| 1.0 / (1.0 + (-o - all).exp())).sum();
        // Laplace's rule of succession again.
        all = ((surface + 1.0) / (units.len() as f64 - surface + 1.0)).ln();
    }
    own.iter().map(|o| o + all).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use crate::spatial::spacing::Sampling;

    fn units(n: usize, evidence: f64, beside: f64) -> impl Iterator<Item = Unit> {
        (0..n).map(move |_| Unit { evidence, beside })
    }

    #[test]
    fn the_same_evidence_passes_in_a_clean_scan_and_fails_in_one_full_of_strays() {
        let odds = |far: usize| {
            let of: Vec<Unit> = units(1, 5.0, 0.0).chain(units(far, 0.0, 0.0)).collect();
            of_units(&of, 0.1)[0]
        };
        assert!(odds(0) > 0.0 && odds(300) < -2.0, "{} {}", odds(0), odds(300));
    }
    #[test]
    fn what_goes_on_beside_known_surface_needs_less_evidence_than_what_lies_off_it() {
        let mut of: Vec<Unit> = units(1, 4.0, 1.0).chain(units(1, 4.0, 0.0)).collect();
        of.extend(units(18, 0.0, 1.0).chain(units(182, 0.0, 0.0)));
        let odds = of_units(&of, 0.1);
        assert!(odds[0] > 0.0 && odds[1] < 0.0, "{} {}", odds[0], odds[1]);
    }
    #[test]
    fn groups_that_say_little_are_surface_where_nothing_lies_far_off() {
        let of: Vec<Unit> = units(20, -1.0, 1.0).chain(units(5, 0.0, 1.0)).collect();
        let odds = of_units(&of, 0.3);
        assert!(odds.iter().all(|o| *o > 0.0), "{odds:?}");
    }
    #[test]
    fn strays_that_by_chance_lie_beside_surface_are_not_taken_for_it() {
        // As many as their share of the box.
        let of: Vec<Unit> = units(30, 0.0, 1.0).chain(units(270, 0.0, 0.0)).collect();
        assert!(of_units(&of, 0.1).iter().all(|o| *o < 0.0));
    }
    #[test]
    fn points_beside_a_known_plane_speak_for_a_group_and_points_far_over_it_against_it() {
        // A plane, twelve points that go on from it, twelve as many spacings over it as it is wide.
        let mut points: Vec<Vec3> =
            (0..400).map(|i| Vec3([f64::from(i % 20), f64::from(i / 20), 0.0])).collect();
        for over in [0.0, 20.0] {
            points.extend((0..12).map(|i| Vec3([20.0 + f64::from(i % 2), 4.0 + f64::from(i / 2), over])));
        }
        let known: Vec<bool> = (0..points.len()).map(|i| i < 400).collect();
        let groups = [400..412, 412..424].map(|of| Group { points: of.collect(), ..Group::default() });
        let sampling = Sampling::new(vec![1.0; points.len()]);
        let odds = Run::default().execute(|ctx| {
            let tree = Neighbours::build(&points, ctx)?;
            let cut = Cut::whole(&points, &tree, &sampling, 0.1);
            of_groups(&cut, &known, &groups, &[], ctx)
        });
        let odds = odds.unwrap();
        assert!(odds[0] > 1.0 && odds[1] < -1.0, "{odds:?}");
    }
}
