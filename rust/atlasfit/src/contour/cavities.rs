//! Which way closed parts of the surface face.
//!
//! In: parts of the surface; of the closed ones some were open when they were turned. Out: the same, the
//! closed ones facing outward; but a closed part within an odd number of other closed parts bounds a hollow
//! in them, and faces into it.

use super::surface::{Surface, corners};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::half_solid_angle;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A connected part of the surface.
struct Part {
    triangles: Vec<u32>,
    /// Its least and its greatest coordinates.
    low: Vec3,
    high: Vec3,
}

impl Part {
    /// Whether another part may lie inside.
    fn spans(&self, inner: &Self) -> bool {
        (0..3).all(|k| self.low[k] < inner.low[k] && inner.high[k] < self.high[k])
    }
}

/// Turns closed parts outward, and those that bound cavities inward.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn turn_closed(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let parts = parts(s, ctx)?;
    let mut pairs = Vec::new();
    for (inner, part) in parts.iter().enumerate() {
        ctx.check()?;
        pairs.extend((0..parts.len()).filter(|&o| parts[o].spans(part)).map(|outer| (inner, outer)));
    }
    let mut within = vec![0; parts.len()];
    let mut closed = vec![None; parts.len()];
    for (part, closed) in parts.iter().zip(&mut closed) {
        if volume(s, part, ctx)? < 0.0 && *closed.insert(is_closed(s, part, ctx)?) {
            turn(s, part);
        }
    }
    for (inner, outer) in pairs {
        ctx.check()?;
        let mut both_closed = true;
        for k in [inner, outer] {
            both_closed &= match closed[k] {
                Some(known) => known,
                None => *closed[k].insert(is_closed(s, &parts[k], ctx)?),
            };
        }
        let at = s.positions[s.triangles[parts[inner].triangles[0] as usize][0] as usize];
        if both_closed && winding(s, &parts[outer], at, ctx)?.abs() > 0.5 {
            within[inner] += 1;
        }
    }
    for (part, _) in parts.iter().zip(within).filter(|(_, n)| n % 2 == 1) {
        turn(s, part);
    }
    Ok(())
}

/// Turns the triangles of a part.
fn turn(s: &mut Surface, part: &Part) {
    for &t in &part.triangles {
        s.triangles[t as usize].swap(1, 2);
    }
}

/// Six times the volume that a part encloses, if it is closed; less than 0 where it faces inward.
fn volume(s: &Surface, part: &Part, ctx: &Context<'_>) -> Result<f64> {
    let mut sum = 0.0;
    for (i, &t) in part.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b, c] = corners(&s.positions, &s.triangles[t as usize]).map(|p| p - part.low);
        sum += a.dot(b.cross(c));
    }
    Ok(sum)
}

/// The connected parts, in the order of their first triangles.
fn parts(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Part>> {
    let mut sets = Sets::of_triangles(s.positions.len(), &s.triangles, ctx)?;
    let infinite = Vec3([f64::INFINITY; 3]);
    let mut number = BTreeMap::new();
    let mut parts: Vec<Part> = Vec::new();
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let part = *number.entry(sets.find(t[0])).or_insert(parts.len());
        if part == parts.len() {
            parts.push(Part { triangles: Vec::new(), low: infinite, high: -infinite });
        }
        let part = &mut parts[part];
        part.triangles.push(i as u32);
        for p in corners(&s.positions, t) {
            part.low = Vec3::from_fn(|k| part.low[k].min(p[k]));
            part.high = Vec3::from_fn(|k| part.high[k].max(p[k]));
        }
    }
    Ok(parts)
}

/// Whether every edge of a part has two triangles.
fn is_closed(s: &Surface, part: &Part, ctx: &Context<'_>) -> Result<bool> {
    let triangles: Vec<[u32; 3]> = part.triangles.iter().map(|&t| s.triangles[t as usize]).collect();
    Ok(Edges::new(&triangles, ctx)?.iter().all(|edge| edge.len() == 2))
}

/// How often a part winds about a point (Jacobson et al. 2013).
fn winding(s: &Surface, part: &Part, p: Vec3, ctx: &Context<'_>) -> Result<f64> {
    let mut half_angle = 0.0;
    for (i, &t) in part.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        half_angle += half_solid_angle(p, &corners(&s.positions, &s.triangles[t as usize]));
    }
    Ok(half_angle / (2.0 * PI))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// Tetrahedra about the origin of these sizes, that face outward.
    fn tetrahedra(sizes: &[f64]) -> Surface {
        let at = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let positions: Vec<Vec3> = sizes.iter().flat_map(|&s| at.map(|p| Vec3(p) * s)).collect();
        let triangles = (0..sizes.len() as u32).flat_map(|k| {
            [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]].map(|t: [u32; 3]| t.map(|v| v + 4 * k))
        });
        let n = positions.len();
        Surface { positions, normals: vec![Vec3::ZERO; n], chart: vec![0; n], triangles: triangles.collect() }
    }

    fn volumes(s: &Surface) -> Vec<f64> {
        let six = |t: &[u32; 3]| {
            let [a, b, c] = corners(&s.positions, t);
            a.dot(b.cross(c))
        };
        s.triangles.chunks(4).map(|part| part.iter().map(six).sum()).collect()
    }

    #[test]
    fn a_cavity_faces_its_hollow_and_a_body_in_the_hollow_faces_out() {
        let mut s = tetrahedra(&[8.0, 2.0, 0.5]);
        let outward = volumes(&s)[0].signum();
        Run::default().execute(|ctx| turn_closed(&mut s, ctx)).unwrap();
        let signs: Vec<f64> = volumes(&s).iter().map(|v| v.signum() * outward).collect();
        assert_eq!(signs, [1.0, -1.0, 1.0]);
    }

    #[test]
    fn a_body_that_faces_inward_is_turned_and_an_open_part_is_not() {
        let mut s = tetrahedra(&[2.0]);
        let outward = volumes(&s)[0].abs();
        for _ in 0..2 {
            s.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            Run::default().execute(|ctx| turn_closed(&mut s, ctx)).unwrap();
            assert!((volumes(&s)[0] - outward).abs() < 1e-12);
        }
        s.triangles.remove(0);
        s.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let before = s.triangles.clone();
        Run::default().execute(|ctx| turn_closed(&mut s, ctx)).unwrap();
        assert_eq!(s.triangles, before);
    }

    #[test]
    fn what_lies_in_an_open_part_stays() {
        let mut s = tetrahedra(&[8.0, 2.0]);
        s.triangles.remove(0);
        let before = s.triangles.clone();
        Run::default().execute(|ctx| turn_closed(&mut s, ctx)).unwrap();
        assert_eq!(s.triangles, before);
    }
}
