//! Which connected parts of the surface stay.
//!
//! In: a surface. Out: the same without the parts that are too small, and the vertices that went.

use super::compact::compact;
use super::surface::{Surface, corners};
use crate::error::{Error, Result};
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::area_vector;

/// What went with the parts that were dropped.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dropped {
    /// How many parts went.
    pub(crate) parts: usize,
    /// Where their vertices were.
    pub(crate) positions: Vec<Vec3>,
    /// The chart that weighed most at each.
    pub(crate) chart: Vec<u32>,
}

/// Drops the parts that have less than `share`, from 0 to 1, of the area of a surface without unused
/// vertices; where only the `largest` is wanted, the others too: of several of the same area the one with the
/// first vertex stays.
///
/// # Errors
/// [`Error::InvalidArgument`] where no part is large enough; cancelled or out of time.
pub(crate) fn drop_small(s: &mut Surface, share: f64, largest: bool, ctx: &Context<'_>) -> Result<Dropped> {
    if (share <= 0.0 && !largest) || s.triangles.is_empty() {
        return Ok(Dropped::default());
    }
    let mut sets = Sets::of_triangles(s.positions.len(), &s.triangles, ctx)?;
    // At each part's root.
    let mut area = vec![0.0; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        area[sets.find(t[0]) as usize] += 0.5 * area_vector(corners(&s.positions, t)).norm();
    }
    let total: f64 = area.iter().sum();
    let most = area.iter().fold(0.0f64, |m, &a| m.max(a));
    let first_of_most = area.iter().position(|&a| a == most);
    if most < share * total {
        return Err(Error::invalid(
            format!("no part of the surface has {share} of its area: the largest has {:.3}", most / total),
            "Give a smaller share, or ask for the largest part",
        ));
    }
    let stays = |root: usize, area: f64| area >= share * total && (!largest || first_of_most == Some(root));
    let mut dropped = Dropped::default();
    let mut goes = vec![false; s.positions.len()];
    for (v, goes) in goes.iter_mut().enumerate() {
        ctx.check_at(v)?;
        let root = sets.find(v as u32) as usize;
        *goes = !stays(root, area[root]);
        if *goes {
            dropped.parts += usize::from(root == v);
            dropped.positions.push(s.positions[v]);
            dropped.chart.push(s.chart[v]);
        }
    }
    if dropped.parts > 0 {
        s.triangles.retain(|t| !goes[t[0] as usize]);
        compact(s, ctx)?;
    }
    Ok(dropped)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// Squares in the plane, apart from each other, of these sides: a chart each.
    fn squares(sides: &[f64]) -> Surface {
        let mut s = Surface::default();
        for (k, &side) in sides.iter().enumerate() {
            let (x, first) = (10.0 * k as f64, 4 * k as u32);
            let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]];
            s.positions.extend(corners.map(|c| Vec3([x + c[0], c[1], 0.0])));
            s.normals.extend([Vec3([0.0, 0.0, 1.0]); 4]);
            s.chart.extend([k as u32; 4]);
            s.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| v + first)));
        }
        s
    }

    /// The charts that are left, those that went, and how many parts went.
    fn left(sides: &[f64], share: f64, largest: bool) -> (Vec<u32>, Vec<u32>, usize) {
        let mut s = squares(sides);
        let dropped = Run::default().execute(|ctx| drop_small(&mut s, share, largest, ctx)).unwrap();
        assert_eq!((s.positions.len(), s.triangles.len()), (s.chart.len(), s.chart.len() / 2));
        let each = |chart: Vec<u32>| chart.chunks(4).map(|c| c[0]).collect();
        (each(s.chart), each(dropped.chart), dropped.parts)
    }

    #[test]
    fn parts_below_the_share_of_the_area_go_and_one_at_it_stays() {
        // Shares of the area: 0.1, 0.4, 0.5.
        let sides = [1.0, 2.0, 5f64.sqrt()];
        assert_eq!(left(&sides, 0.0, false), (vec![0, 1, 2], vec![], 0));
        assert_eq!(left(&sides, 0.09, false), (vec![0, 1, 2], vec![], 0));
        assert_eq!(left(&sides, 0.2, false), (vec![1, 2], vec![0], 1));
        assert_eq!(left(&sides, 0.45, false), (vec![2], vec![0, 1], 2));
        assert_eq!(left(&[3.0], 1.0, false), (vec![0], vec![], 0), "a part alone is all of the surface");
    }

    #[test]
    fn the_largest_stays_alone_and_of_equals_the_first() {
        assert_eq!(left(&[1.0, 3.0, 2.0], 0.0, true), (vec![1], vec![0, 2], 2));
        assert_eq!(left(&[2.0, 2.0, 1.0], 0.3, true), (vec![0], vec![1, 2], 2));
    }

    #[test]
    fn a_share_that_no_part_has_is_an_error_that_tells_the_largest() {
        let mut s = squares(&[1.0, 1.0]);
        let error = Run::default().execute(|ctx| drop_small(&mut s, 0.6, false, ctx)).unwrap_err();
        let said = error.to_string();
        assert!(said.contains("0.6") && said.contains("0.500"), "{said}");
    }
}
