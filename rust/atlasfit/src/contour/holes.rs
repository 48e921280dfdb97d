//! Filling small holes.
//!
//! In: an oriented triangle surface, which boundaries to fill. Out: the same surface with those holes
//! triangulated; the wider ones by small triangles that go on from the surface as a thin plate would. Slits
//! are holes of any length whose sides run close to each other: where the two sides of a thin part fail to
//! meet at its rim.

use super::constants::CONTOUR;
use super::patch::{self, Patch, TakenEdges};
use super::slits::{self, Pieces};
use super::surface::{Surface, corners};
use super::{bowties, loops, membrane, refine, smooth};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// What was filled.
#[derive(Debug)]
pub(crate) struct Filled {
    /// Number of holes.
    pub(crate) holes: usize,
    /// Whether each vertex lies at one of them.
    pub(crate) touched: Vec<bool>,
    /// What stays open.
    pub(crate) left: Left,
}

/// Holes that stay open.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Left {
    /// Those with a boundary longer than asked for.
    pub(crate) longer: usize,
    /// The shortest boundary among them.
    pub(crate) shortest: f64,
    /// Shorter ones that no triangles fit, because they would share edges with others, or would be too many.
    pub(crate) tangled: usize,
}

/// Which holes are filled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits<'a> {
    /// Those whose boundary is at most so long.
    pub(crate) longest: f64,
    /// Those whose boundary is at most so long, or as many times longer as `sparse` says: gaps of the
    /// sampling. They are triangulated from side to side; others as by [`close`].
    pub(crate) plain: f64,
    /// For each chart how many times farther apart than usual its points lie.
    pub(crate) sparse: &'a [f64],
    /// And slits that are at most so wide in the mean.
    pub(crate) slit: f64,
}

/// Fills holes.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn fill(s: &mut Surface, limits: Limits<'_>, ctx: &Context<'_>) -> Result<Filled> {
    let Limits { longest, plain, sparse, slit: widest } = limits;
    let rings = loops::of(s, ctx)?;
    let mut touched = vec![false; s.positions.len()];
    if rings.is_empty() {
        return Ok(Filled { holes: 0, touched, left: Left::default() });
    }
    let taken = taken(s, rings.iter().flatten(), ctx)?;
    let was_cut = rings.iter().any(|r| r.len() > CONTOUR.max_edges);
    let Pieces { short: rings, long } = slits::cut(&s.positions, rings, &taken, CONTOUR.cut * widest, ctx)?;
    let positions = &s.positions;
    let whole: f64 = s.triangles.iter().map(|t| patch::area(corners(positions, t))).sum();
    let patches: Vec<Option<Filling>> = rings
        .par_iter()
        .map(|ring| {
            ctx.check()?;
            let length = length(positions, ring);
            let plain = plain * sparsity(&s.chart, ring, sparse);
            let longest = longest.max(plain);
            // A long one can only be a slit: nothing but short edges lead across.
            let across = if length <= longest { f64::INFINITY } else { CONTOUR.across * widest };
            let Some(patch) = patch::of_least_area(positions, ring, across, &taken, ctx)? else {
                return Ok(None);
            };
            let slit = patch.area <= 0.5 * length * widest && patch.area <= CONTOUR.ribbon * whole;
            let fine = length > plain && !slit;
            Ok((length <= longest || slit).then_some(Filling { triangles: patch.triangles, fine }))
        })
        .collect::<Result<_>>()?;
    let (mut holes, mut left) = (0, Left { shortest: f64::INFINITY, ..Left::default() });
    long.iter().for_each(|ring| left.note(length(&s.positions, ring), longest));
    let first = s.positions.len();
    for (filling, ring) in patches.into_iter().zip(&rings) {
        let Some(filling) = filling else {
            left.note(length(&s.positions, ring), longest);
            continue;
        };
        add(s, filling, ring, &taken, &mut touched, ctx)?;
        holes += 1;
    }
    membrane::relax(s, first, ctx)?;
    // A piece between two cuts that end in one vertex may be filled while those beside it stay open.
    if was_cut && holes > 0 {
        bowties::split(s, ctx)?;
        touched.resize(s.positions.len(), true);
    }
    Ok(Filled { holes, touched, left })
}

/// How many times farther apart than usual the points about a boundary lie, by the charts of its vertices.
fn sparsity(chart: &[u32], ring: &[u32], sparse: &[f64]) -> f64 {
    let of = |&v: &u32| sparse.get(chart[v as usize] as usize).copied().unwrap_or(1.0);
    ring.iter().map(of).sum::<f64>() / ring.len().max(1) as f64
}

/// Fills the holes with these boundaries where triangles fit, by small ones that go on from the surface as a
/// thin plate would. Returns how many it fills.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn close(s: &mut Surface, rings: &[Vec<u32>], ctx: &Context<'_>) -> Result<usize> {
    if rings.is_empty() {
        return Ok(0);
    }
    let taken = taken(s, rings.iter().flatten(), ctx)?;
    let patches: Vec<Option<Patch>> = rings
        .par_iter()
        .map(|ring| {
            ctx.check()?;
            if ring.len() > CONTOUR.max_edges {
                return Ok(None);
            }
            patch::of_least_area(&s.positions, ring, f64::INFINITY, &taken, ctx)
        })
        .collect::<Result<_>>()?;
    let mut touched = vec![false; s.positions.len()];
    let (first, mut filled) = (s.positions.len(), 0);
    for (patch, ring) in patches.into_iter().zip(rings) {
        let Some(Patch { triangles, .. }) = patch else { continue };
        add(s, Filling { triangles, fine: true }, ring, &taken, &mut touched, ctx)?;
        filled += 1;
    }
    membrane::relax(s, first, ctx)?;
    smooth::mend_normals(s, &touched, ctx)?;
    Ok(filled)
}

/// Edges between vertices of the rings.
fn taken<'a>(s: &Surface, rings: impl Iterator<Item = &'a u32>, ctx: &Context<'_>) -> Result<TakenEdges> {
    let mut of_ring = vec![false; s.positions.len()];
    for &v in rings {
        of_ring[v as usize] = true;
    }
    TakenEdges::among(&of_ring, &s.triangles, ctx)
}

/// A hole's triangles, and whether they are to be as small as its boundary's edges.
struct Filling {
    triangles: Vec<[u32; 3]>,
    fine: bool,
}

/// Adds the filling of a ring, and marks its vertices.
fn add(
    s: &mut Surface,
    filling: Filling,
    ring: &[u32],
    taken: &TakenEdges,
    touched: &mut Vec<bool>,
    ctx: &Context<'_>,
) -> Result<()> {
    let Filling { mut triangles, fine } = filling;
    if fine {
        let longest = CONTOUR.refined * length(&s.positions, ring) / ring.len() as f64;
        let made_of = refine::refine(&mut s.positions, &mut triangles, longest, taken, ctx)?;
        made_of.into_iter().for_each(|v| s.chart.push(s.chart[v as usize]));
        s.normals.resize(s.positions.len(), Vec3::ZERO);
        touched.resize(s.positions.len(), true);
    }
    for &v in triangles.iter().flatten() {
        touched[v as usize] = true;
    }
    s.triangles.extend(triangles);
    Ok(())
}

/// Triangles of the least area that close a ring of places, by their numbers in it; none where it has too
/// many, or none do without the edges `taken` between two of them.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn ring(
    positions: &[Vec3],
    taken: &[[u32; 2]],
    ctx: &Context<'_>,
) -> Result<Option<Vec<[u32; 3]>>> {
    let ring: Vec<u32> = (0..positions.len() as u32).collect();
    if !(3..=CONTOUR.max_edges).contains(&ring.len()) {
        return Ok(None);
    }
    let flat: Vec<[u32; 3]> = taken.iter().map(|&[a, b]| [a, b, a]).collect();
    let taken = TakenEdges::among(&vec![true; positions.len()], &flat, ctx)?;
    Ok(patch::of_least_area(positions, &ring, f64::INFINITY, &taken, ctx)?.map(|p| p.triangles))
}

impl Left {
    /// Notes a boundary of this length that stays open.
    fn note(&mut self, length: f64, longest: f64) {
        if length > longest {
            self.longer += 1;
            self.shortest = self.shortest.min(length);
        } else {
            self.tangled += 1;
        }
    }
}

/// Length of a closed ring.
pub(crate) fn length(positions: &[Vec3], ring: &[u32]) -> f64 {
    (0..ring.len())
        .map(|i| positions[ring[i] as usize].dist2(positions[ring[(i + 1) % ring.len()] as usize]).sqrt())
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    fn limits(longest: f64, slit: f64) -> Limits<'static> {
        Limits { longest, plain: longest, sparse: &[], slit }
    }

    /// An open box: four walls and a floor.
    fn open_box() -> Surface {
        let positions: Vec<Vec3> =
            (0..8).map(|i| Vec3([f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)])).collect();
        let quads = [[0, 2, 3, 1], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        Surface { normals: vec![Vec3::ZERO; 8], chart: vec![0; 8], positions, triangles }
    }

    fn boundary(s: &Surface) -> usize {
        Run::default().execute(|ctx| loops::of(s, ctx)).unwrap().iter().map(Vec::len).sum()
    }

    #[test]
    fn an_open_box_is_closed_by_two_triangles_that_face_out() {
        let mut s = open_box();
        assert_eq!(boundary(&s), 4);
        let Filled { holes: filled, .. } =
            Run::default().execute(|ctx| fill(&mut s, limits(4.5, 0.0), ctx)).unwrap();
        assert_eq!((filled, s.triangles.len(), boundary(&s)), (1, 12, 0));
        let volume: f64 = s
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| s.positions[v as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume.abs() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_hole_may_be_as_many_times_longer_as_points_lie_farther_apart() {
        for (times, expected) in [(1.0, 0), (1.5, 1)] {
            let mut s = open_box();
            let limits = Limits { sparse: &[times], ..limits(3.0, 0.0) };
            let filled = Run::default().execute(|ctx| fill(&mut s, limits, ctx)).unwrap();
            assert_eq!(filled.holes, expected, "{times}");
        }
    }

    /// A flat strip of squares of side 1 along a closed curve in the plane, on its outer side, `n` squares
    /// long.
    fn rim_of(n: usize, at: impl Fn(f64) -> [f64; 2]) -> Surface {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for k in 0..n as u32 {
            let [x, y] = at(f64::from(k) / n as f64);
            positions.push(Vec3([x, y, 0.0]));
            positions.push(Vec3([x, y, 1.0]));
            let [a, b] = [2 * k, (2 * k + 2) % (2 * n as u32)];
            triangles.push([a, b, b + 1]);
            triangles.push([a, b + 1, a + 1]);
        }
        Surface { normals: vec![Vec3::ZERO; 2 * n], chart: vec![0; 2 * n], positions, triangles }
    }

    #[test]
    fn the_outline_of_a_large_sheet_is_left_as_it_is() {
        // Two rims of 2,000 edges, round and with corners.
        let round = rim_of(2000, |t| {
            [318.0 * (t * std::f64::consts::TAU).cos(), 318.0 * (t * std::f64::consts::TAU).sin()]
        });
        let square = rim_of(2000, |t| {
            let (side, along) = ((4.0 * t) as usize, 500.0 * (4.0 * t).fract());
            [[along, 0.0], [500.0, along], [500.0 - along, 500.0], [0.0, 500.0 - along]][side]
        });
        for mut s in [round, square] {
            let Filled { holes: filled, left, .. } =
                Run::default().execute(|ctx| fill(&mut s, limits(20.0, 4.0), ctx)).unwrap();
            assert_eq!((filled, boundary(&s)), (0, 4000));
            assert_eq!((left.longer, left.tangled), (2, 0));
        }
    }

    #[test]
    fn a_slit_into_a_long_outline_is_closed_and_the_outline_stays() {
        // A square of side 500 with a slit 3 wide and 300 deep from the middle of its first side: 2,000 edges
        // of outline and 600 of slit.
        let corners: [[f64; 2]; 8] = [
            [0.0, 0.0],
            [248.5, 0.0],
            [248.5, 300.0],
            [251.5, 300.0],
            [251.5, 0.0],
            [500.0, 0.0],
            [500.0, 500.0],
            [0.0, 500.0],
        ];
        let mut points: Vec<[f64; 2]> = vec![];
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let steps = ((b[0] - a[0]).abs() + (b[1] - a[1]).abs()).round() as usize;
            points.extend((0..steps).map(|i| [0, 1].map(|c| a[c] + (b[c] - a[c]) * i as f64 / steps as f64)));
        }
        let n = points.len();
        let mut s = rim_of(n, |t| points[(t * n as f64).round() as usize]);
        let Filled { holes: filled, .. } =
            Run::default().execute(|ctx| fill(&mut s, limits(20.0, 4.0), ctx)).unwrap();
        // Both ends of the strip have the slit; what stays is the outline, across the slits' mouths.
        let left = boundary(&s);
        assert!(
            filled >= 2 && (3990..=4010).contains(&left),
            "{filled} filled, {left} edges left of {}",
            2 * n
        );
    }

    #[test]
    fn a_hole_longer_than_asked_stays() {
        let mut s = open_box();
        let Filled { holes: filled, left, .. } =
            Run::default().execute(|ctx| fill(&mut s, limits(3.9, 0.0), ctx)).unwrap();
        assert_eq!((filled, boundary(&s)), (0, 4));
        assert_eq!(left, Left { longer: 1, shortest: 4.0, tangled: 0 });
    }

    #[test]
    fn a_hole_in_a_sphere_is_filled_along_the_sphere() {
        // Rings of a sphere of radius 1 from 40 degrees to 120; what lacks is a cap of 40 degrees and more.
        let (n, rows) = (64u32, 24u32);
        let mut s = Surface::default();
        for i in 0..=rows {
            let polar = (40.0 + 80.0 * f64::from(i) / f64::from(rows)).to_radians();
            for k in 0..n {
                let around = f64::from(k) * std::f64::consts::TAU / f64::from(n);
                let p = Vec3([polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()]);
                s.positions.push(p);
                s.normals.push(p);
                s.chart.push(0);
            }
        }
        for i in 0..rows {
            for k in 0..n {
                let [a, b] = [i * n + k, i * n + (k + 1) % n];
                s.triangles.extend([[a, a + n, b + n], [a, b + n, b]]);
            }
        }
        let before = s.positions.len();
        let rings = vec![
            Run::default()
                .execute(|ctx| loops::of(&s, ctx))
                .unwrap()
                .into_iter()
                .find(|r| s.positions[r[0] as usize][2] > 0.0)
                .unwrap(),
        ];
        assert_eq!(Run::default().execute(|ctx| close(&mut s, &rings, ctx)).unwrap(), 1);
        assert_eq!(boundary(&s), n as usize);
        let off = s.positions[before..].iter().map(|p| (p.norm() - 1.0).abs()).fold(0.0, f64::max);
        // A flat filling is off by 1 - cos 40 degrees: 0.23; the plate bends a little too far.
        assert!(s.positions.len() > before + 100 && off < 0.08, "{off}");
        let along = s.normals[before..].iter().zip(&s.positions[before..]).map(|(n, p)| n.dot(*p));
        assert!(along.fold(1.0, f64::min) > 0.9);
    }
}
