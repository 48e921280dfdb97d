//! Bow ties: vertices where several fans of triangles meet.
//!
//! In: triangles with every edge in at most two of them. Out: the same, but each fan has a vertex of its own,
//! so that every vertex has one fan.

use super::constants::CONTOUR;
use super::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::sets::Sets;

/// Gives each fan of triangles around a vertex its own vertex.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn split(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let stars = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    let mut sets = Sets::new(0);
    let mut fan = Vec::new();
    for v in 0..s.positions.len() {
        ctx.check_at(v)?;
        let star = stars.of(v as u32);
        join_fans(s, v as u32, star, &mut sets);
        fan.clear();
        fan.extend((0..star.len() as u32).map(|i| sets.find(i) as usize));
        if fan.iter().any(|&f| f != 0) {
            split_vertex(s, v, star, &fan);
        }
    }
    Ok(())
}

/// Joins the triangles of a vertex's star, by their places in it, that share an edge at the vertex.
fn join_fans(s: &Surface, v: u32, star: &[u32], sets: &mut Sets) {
    sets.reset(star.len());
    for i in 0..star.len() {
        for j in 0..i {
            let (a, b) = (s.triangles[star[i] as usize], s.triangles[star[j] as usize]);
            if a.iter().any(|x| *x != v && b.contains(x)) {
                sets.join(i as u32, j as u32);
            }
        }
    }
}

/// Gives each fan of a star but the first a copy of its vertex. `fan` says for each triangle of the star
/// which is the first of its fan. Each fan's vertex steps a little into its fan: two vertices in one place
/// would be one again for whoever merges by position.
fn split_vertex(s: &mut Surface, v: usize, star: &[u32], fan: &[usize]) {
    let apart = |s: &Surface, i: usize| {
        let mut sum = Vec3::ZERO;
        let mut count = 0.0;
        for j in (0..star.len()).filter(|&j| fan[j] == i) {
            for &x in &s.triangles[star[j] as usize] {
                sum += s.positions[x as usize];
                count += 1.0;
            }
        }
        let p = s.positions[v];
        p + (sum * (1.0 / count) - p) * CONTOUR.step_apart
    };
    let firsts: Vec<usize> = (0..star.len()).filter(|&i| fan[i] == i).collect();
    let moved: Vec<Vec3> = firsts.iter().map(|&i| apart(s, i)).collect();
    s.positions[v] = moved[0];
    for (&i, &position) in firsts.iter().zip(&moved).skip(1) {
        let copy = s.positions.len() as u32;
        s.positions.push(position);
        s.normals.push(s.normals[v]);
        s.chart.push(s.chart[v]);
        for (_, &t) in fan.iter().zip(star).filter(|x| *x.0 == i) {
            for x in &mut s.triangles[t as usize] {
                if *x == v as u32 {
                    *x = copy;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    #[test]
    fn two_triangles_that_meet_in_a_vertex_come_apart_there() {
        let positions: Vec<Vec3> = [[0.0, 0.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
            .map(|[x, y]| Vec3([x, y, 0.0]))
            .to_vec();
        let triangles = vec![[0, 1, 2], [0, 3, 4]];
        let mut s = Surface { normals: vec![Vec3::ZERO; 5], chart: vec![0; 5], positions, triangles };
        Run::default().execute(|ctx| split(&mut s, ctx)).unwrap();
        assert_eq!(s.triangles, [[0, 1, 2], [5, 3, 4]]);
        assert!(s.positions[0][0] > 0.0 && s.positions[5][0] < 0.0);
    }
}
