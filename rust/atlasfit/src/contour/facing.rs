//! Which way the connected parts of the surface face.
//!
//! In: parts, each with consistent triangles. Out: for each whether it faces the right way. Six things
//! speak, in nats (a difference of log likelihoods): what the scan knows; what the part winds about, for a
//! body faces outward; how it faces beside its neighbours, for a surface goes on across a gap; how it faces
//! what lies before it ([`super::before`]); that open scans, such as terrain, face up; and what viewers see
//! ([`super::viewers`]). The parts are joined in the order of how much is said, then turned as long as
//! viewers see that better.

use super::adjacency::{FaceAdjacency, Turn};
use super::constants::CONTOUR;
use super::surface::{Surface, corners};
use super::viewers::Seen;
use crate::atlas::{Relation, Vote};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::orient;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;
use crate::spatial::triangle::area_vector;
use std::collections::BTreeMap;

/// What is known of how the surface faces, beside its shape.
pub(crate) struct Facing<'a> {
    /// Whether some part is one-sided.
    pub(crate) one_sided: bool,
    /// How the scan votes on each chart's side; none where nothing is known.
    pub(crate) votes: &'a [Vote],
    /// How charts that lie before each other face, before their signs.
    pub(crate) opposing: &'a [Relation],
}

/// A place on a part, with a direction: its normal as long as its area, or along its boundary, of unit
/// length, with the part on the left of it as seen from the side that it faces.
struct Place {
    position: Vec3,
    direction: Vec3,
}

/// A connected part of the surface.
pub(super) struct Component {
    pub(super) triangles: Vec<u32>,
    /// How the scan votes on the side of the turned triangles.
    vote: Vote,
    area: f64,
    /// Sum of its area vectors.
    mean_normal: Vec3,
    /// How often it winds about itself in the mean: 1/2 is a closed body that faces outward, 0 flat.
    winding: f64,
    /// Places along its boundary, evenly spread.
    rim: Vec<Place>,
}

/// How the triangles of the surface stand to each other.
pub(super) struct Sides<'a> {
    pub(super) turn: &'a [Turn],
    pub(super) adjacency: &'a [FaceAdjacency],
}

impl Component {
    /// Whether it has a boundary.
    pub(super) fn is_open(&self) -> bool {
        !self.rim.is_empty()
    }
    /// Measures a part.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn new(
        s: &Surface,
        triangles: Vec<u32>,
        sides: &Sides<'_>,
        vote: Vote,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let normal = |t: u32| {
            area_vector(corners(&s.positions, &s.triangles[t as usize]))
                * (0.5 * sides.turn[t as usize].sign())
        };
        let middle = |t: u32| {
            corners(&s.positions, &s.triangles[t as usize]).into_iter().fold(Vec3::ZERO, |a, b| a + b)
                * (1.0 / 3.0)
        };
        let place = |t: u32| Place { position: middle(t), direction: normal(t) };
        let (mut area, mut mean_normal) = (0.0, Vec3::ZERO);
        for (i, &t) in triangles.iter().enumerate() {
            ctx.check_at(i)?;
            area += normal(t).norm();
            mean_normal += normal(t);
        }
        let winding =
            winding(&every(&triangles, CONTOUR.winding_places).map(place).collect::<Vec<_>>(), area);
        ctx.check()?;
        let at_rim: Vec<u32> =
            triangles.iter().copied().filter(|&t| sides.adjacency[t as usize].at_boundary()).collect();
        let rim = every(&at_rim, CONTOUR.rim_places)
            .map(|t| {
                let corners = corners(&s.positions, &s.triangles[t as usize]);
                let edges = sides.adjacency[t as usize].boundary();
                let along = edges.map(|k| corners[(k + 1) % 3] - corners[k]);
                let along = along.fold(Vec3::ZERO, |a, b| a + b);
                Place { position: middle(t), direction: along.normalized() * sides.turn[t as usize].sign() }
            })
            .collect();
        Ok(Self { triangles, vote, area, mean_normal, winding, rim })
    }
}

/// At most `most` of the triangles, evenly spread in their order.
fn every(triangles: &[u32], most: usize) -> impl Iterator<Item = u32> {
    triangles.iter().copied().step_by(triangles.len().div_ceil(most).max(1))
}

/// How often places, with normals as long as their area, wind about each other in the mean (Jacobson et al.
/// 2013, each as a dipole). They stand for this area in all.
fn winding(places: &[Place], area: f64) -> f64 {
    let held: f64 = places.iter().map(|p| p.direction.norm()).sum();
    let (each, side) = (area / held.max(f64::MIN_POSITIVE), (area / places.len().max(1) as f64).sqrt());
    let about = |at: Vec3| -> f64 {
        places.iter().map(|p| orient::dipole(p.direction, p.position - at, side)).sum::<f64>() * each
    };
    places.iter().map(|p| about(p.position) * p.direction.norm()).sum::<f64>() / held.max(f64::MIN_POSITIVE)
}

/// 1 for each part that faces the right way, -1 for the others. `before` says how parts that lie before each
/// other face; `seen` what viewers see of the parts, if it is asked for.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn sides(
    parts: &[Component],
    mut before: Vec<Relation>,
    seen: Option<&Seen>,
    ctx: &Context<'_>,
) -> Result<Vec<f64>> {
    // What is open faces along the one axis that it faces most, upward.
    let open = parts.iter().filter(|c| c.is_open());
    let faced: Vec3 = open.fold(Vec3::ZERO, |sum, c| sum + Vec3(c.mean_normal.0.map(f64::abs)));
    let up = (0..3).max_by(|&i, &j| faced[i].total_cmp(&faced[j])).unwrap_or(2);
    let said = |c: &Component| {
        let shape = c.winding / CONTOUR.winding_spread.powi(2);
        let upward = if c.is_open() { c.mean_normal[up] / c.area.max(f64::MIN_POSITIVE) } else { 0.0 };
        CONTOUR.scan_knows * c.vote.verdict() + shape + CONTOUR.upward * upward
    };
    let votes: Vec<(u32, f64)> = (0..).zip(parts.iter().map(said)).collect();
    before.extend(beside(parts, ctx)?);
    let mut signs = orient::agree(parts.len(), &before, &votes, ctx)?;
    if let Some(seen) = seen {
        seen.turn(&votes, &before, &mut signs, ctx)?;
    }
    Ok(signs)
}

/// How the parts face each other across the gaps between them.
fn beside(parts: &[Component], ctx: &Context<'_>) -> Result<Vec<Relation>> {
    let places: Vec<(u32, &Place)> =
        (0..).zip(parts).flat_map(|(k, part)| part.rim.iter().map(move |p| (k, p))).collect();
    let positions: Vec<Vec3> = places.iter().map(|(_, p)| p.position).collect();
    if parts.iter().filter(|part| part.is_open()).count() < 2 {
        return Ok(Vec::new());
    }
    let tree = Neighbours::build(&positions, ctx)?;
    let mut found = Vec::new();
    // The nearest place that is of such a part. Most have another part near by; their own has no more places
    // than the second time.
    let mut nearest = |at: Vec3, wanted: &dyn Fn(u32) -> bool| {
        [CONTOUR.rim_near, CONTOUR.rim_places + 1].into_iter().find_map(|k| {
            tree.nearest(at, k, &mut found);
            found.iter().find(|f| wanted(places[f.index as usize].0)).copied()
        })
    };
    let mut sums: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for (i, &(a, p)) in places.iter().enumerate() {
        ctx.check_at(i)?;
        let Some(other) = nearest(p.position, &|part| part != a) else { continue };
        let (b, q) = places[other.index as usize];
        // A place that is nearer to others of this part is across the gap from those.
        let Some(back) = nearest(q.position, &|part| part == a) else { continue };
        let across = back.dist2 / other.dist2.max(f64::MIN_POSITIVE);
        let size2 = parts[a as usize].area.min(parts[b as usize].area);
        let share = CONTOUR.goes_on * across / parts[a as usize].rim.len() as f64;
        *sums.entry((a.min(b), a.max(b))).or_default() += share * agreement(p, q, size2);
    }
    Ok(sums.into_iter().map(|((a, b), agreement)| Relation { a, b, agreement }).collect())
}

/// How far the parts at two places on their boundaries face alike, -1 to 1, if the surface goes on from one to
/// the other: their boundaries then run against each other, across a gap as about a sharp edge. Less where the
/// gap is wide beside parts of this size.
fn agreement(p: &Place, q: &Place, size2: f64) -> f64 {
    let far = (q.position - p.position).norm2() / size2.max(f64::MIN_POSITIVE);
    -p.direction.dot(q.direction) / (1.0 + far)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::contour::{Facing, components};

    const PIECES: u32 = 5;

    /// Pieces of a surface over the unit square, with gaps between them; every other piece faces the other
    /// way.
    fn pieces(at: impl Fn(f64, f64) -> [f64; 3]) -> Surface {
        let n = 8;
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for piece in 0..PIECES {
            let first = positions.len() as u32;
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                let u = (f64::from(piece) + 0.9 * f64::from(i) / f64::from(n)) / f64::from(PIECES);
                positions.push(Vec3(at(u, f64::from(j) / f64::from(n))));
            }
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let a = first + i * (n + 1) + j;
                for mut t in [[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]] {
                    if piece % 2 == 1 {
                        t.swap(1, 2);
                    }
                    triangles.push(t);
                }
            }
        }
        let count = positions.len();
        Surface { positions, normals: vec![Vec3::ZERO; count], chart: vec![0; count], triangles }
    }

    /// For each piece how much of it faces along `out`, from -1 to 1.
    fn facing(s: &Surface, out: impl Fn(Vec3) -> Vec3) -> Vec<f64> {
        s.triangles
            .chunks(s.triangles.len() / PIECES as usize)
            .map(|piece| {
                let of = |t: &[u32; 3]| {
                    let c = corners(&s.positions, t);
                    area_vector(c).normalized().dot(out(c[0]).normalized())
                };
                piece.iter().map(of).sum::<f64>() / piece.len() as f64
            })
            .collect()
    }

    fn oriented(s: &Surface) -> Surface {
        let mut s = s.clone();
        Run::default()
            .execute(|ctx| {
                components::orient(
                    &mut s,
                    &[],
                    &Facing { one_sided: false, votes: &[], opposing: &[] },
                    0,
                    ctx,
                )
            })
            .unwrap();
        s
    }

    #[test]
    fn pieces_of_a_tube_face_outward_and_pieces_of_a_slope_upward() {
        let tube = |u: f64, v: f64| {
            let a = 6.0 * u;
            [a.cos(), 2.0 * v, a.sin()]
        };
        let out = facing(&oriented(&pieces(tube)), |p| Vec3([p[0], 0.0, p[2]]));
        assert!(out.iter().all(|f| *f > 0.9), "{out:?}");
        // Each piece alone is a gutter: it winds to neither side for sure.
        let slope = |u: f64, v: f64| [4.0 * u, v, 0.3 * (9.0 * u).sin()];
        let up = facing(&oriented(&pieces(slope)), |_| Vec3([0.0, 0.0, 1.0]));
        assert!(up.iter().all(|f| *f > 0.5), "{up:?}");
    }

    #[test]
    fn a_wall_beside_a_wall_faces_the_same_way_though_neither_is_up() {
        let wall = |u: f64, v: f64| [4.0 * u, 0.05 * (7.0 * v).sin() * (9.0 * u).cos(), v];
        let along = facing(&oriented(&pieces(wall)), |_| Vec3([0.0, 1.0, 0.0]));
        assert!(along.iter().all(|f| f.signum() == along[0].signum() && f.abs() > 0.5), "{along:?}");
    }

    #[test]
    fn a_quarter_turn_changes_nothing_of_a_tube_and_scale_nothing_at_all() {
        let bowl = |u: f64, v: f64| [4.0 * u, (3.0 * v).cos(), (3.0 * v).sin()];
        let first = oriented(&pieces(bowl)).triangles;
        let turned = oriented(&pieces(|u, v| {
            let [x, y, z] = bowl(u, v);
            [1e3 * y, 1e3 * z, 1e3 * x]
        }));
        assert_eq!(first, turned.triangles);
    }
}
