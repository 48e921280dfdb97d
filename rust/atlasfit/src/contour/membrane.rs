//! Fillings as smooth as the surface about them.
//!
//! In: a surface some vertices of which are free. Out: the same with those vertices where a thin plate would
//! lie that goes on from the surface: the sum of all squared distances from a vertex to the mean of its
//! neighbours is least (Kobbelt et al. 1998), those of the free vertices and of the ones next to them.

use super::constants::CONTOUR;
use super::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// Distances from vertices to the mean of their neighbours, as a linear map of the free vertices' places.
struct Plate {
    /// Vertices whose distance counts.
    rows: Vec<u32>,
    /// The neighbours of each.
    neighbours: Vec<Vec<u32>>,
    /// The first free vertex.
    first: u32,
}

impl Plate {
    /// Each row's vertex less the mean of its neighbours, of `value` at each vertex.
    fn bend(&self, value: impl Fn(u32) -> Vec3) -> Vec<Vec3> {
        let bend = |(i, &v): (usize, &u32)| {
            let near = &self.neighbours[i];
            let sum: Vec3 = near.iter().map(|&n| value(n)).sum();
            value(v) - sum * (1.0 / near.len() as f64)
        };
        self.rows.iter().enumerate().map(bend).collect()
    }
    /// The transposed map: what each free vertex gets of its rows.
    fn spread(&self, bends: &[Vec3], free: usize) -> Vec<Vec3> {
        let mut out = vec![Vec3::ZERO; free];
        for (i, (&v, &b)) in self.rows.iter().zip(bends).enumerate() {
            let near = &self.neighbours[i];
            let share = b * (1.0 / near.len() as f64);
            for (n, b) in near.iter().map(|&n| (n, -share)).chain([(v, b)]) {
                if let Some(to) = n.checked_sub(self.first).and_then(|k| out.get_mut(k as usize)) {
                    *to += b;
                }
            }
        }
        out
    }
}

/// Moves all vertices from `first` on.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn relax(s: &mut Surface, first: usize, ctx: &Context<'_>) -> Result<()> {
    let free = s.positions.len() - first;
    if free == 0 {
        return Ok(());
    }
    let mut counts = vec![false; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        if t.iter().any(|&v| v as usize >= first) {
            t.iter().for_each(|&v| counts[v as usize] = true);
        }
    }
    let rows: Vec<u32> = (0..counts.len() as u32).filter(|&v| counts[v as usize]).collect();
    let mut row = vec![u32::MAX; counts.len()];
    rows.iter().zip(0..).for_each(|(&v, i)| row[v as usize] = i);
    let mut neighbours = vec![Vec::new(); rows.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        for k in (0..3).filter(|&k| counts[t[k] as usize]) {
            neighbours[row[t[k] as usize] as usize].extend([t[(k + 1) % 3], t[(k + 2) % 3]]);
        }
    }
    for near in &mut neighbours {
        near.sort_unstable();
        near.dedup();
    }
    let plate = Plate { rows, neighbours, first: first as u32 };
    let within = |x: &[Vec3], v: u32| v.checked_sub(plate.first).map_or(Vec3::ZERO, |k| x[k as usize]);
    // Conjugate gradients for least squares (Hestenes and Stiefel 1952).
    let mut left: Vec<Vec3> = plate.bend(|v| s.positions[v as usize]).into_iter().map(|b| -b).collect();
    let mut slope = plate.spread(&left, free);
    let mut toward = slope.clone();
    let square = |x: &[Vec3]| x.iter().map(|x| x.norm2()).sum::<f64>();
    let mut size = square(&slope);
    let enough = CONTOUR.relaxed * size;
    for _ in 0..CONTOUR.relaxations {
        ctx.check()?;
        let bends = plate.bend(|v| within(&toward, v));
        let bent = square(&bends);
        if size <= enough || bent <= 0.0 {
            break;
        }
        let step = size / bent;
        s.positions[first..].iter_mut().zip(&toward).for_each(|(p, &d)| *p += d * step);
        left.iter_mut().zip(&bends).for_each(|(l, &b)| *l -= b * step);
        slope = plate.spread(&left, free);
        let now = square(&slope);
        let keep = now / size;
        size = now;
        toward.iter_mut().zip(&slope).for_each(|(d, &g)| *d = g + *d * keep);
    }
    Ok(())
}
