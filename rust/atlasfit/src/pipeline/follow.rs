//! Outliers of a mesh follow the surface between their neighbours.
//!
//! In: the denoised vertices of a mesh, its triangles, which of the vertices lie on the surface and which are
//! outliers. Out: where a membrane that is held by the vertices on the surface has the outliers: each is the
//! mean of its neighbours (the graph's Laplacian is zero there; Botsch et al. 2010, "Polygon Mesh
//! Processing", section 4.2). All edges weigh the same: cotangents have any size and sign on spikes.

use super::constants::PIPELINE;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::weld::weld;
use std::collections::VecDeque;

/// What a vertex is to the membrane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// It lies on the surface and holds the membrane.
    Holds,
    /// It is an outlier and follows.
    Follows,
    /// It has no part in it: it is not finite.
    Neither,
}

/// A membrane over the outliers that hang together with vertices on the surface.
pub(super) struct Membrane {
    /// The outliers, in the order in which they are reached from the surface. Of vertices in one place, the
    /// first stands for all.
    free: Vec<u32>,
    /// For each of `free` where its neighbours begin in `to`.
    start: Vec<u32>,
    /// Neighbours: places in `free`, or, from `free.len()` on, in `held`.
    to: Vec<u32>,
    /// The vertices that hold the membrane.
    held: Vec<u32>,
    /// For each vertex of the mesh its place in `free`; `u32::MAX` for all that do not follow.
    place: Vec<u32>,
}

impl Membrane {
    /// Finds who follows whom. `given` says which vertices are in one place: those of a mesh that is cut
    /// along its seams must not part.
    pub(super) fn new(
        given: &[Vec3],
        triangles: &[[u32; 3]],
        role: &[Role],
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let n = given.len();
        let mut out =
            Self { free: Vec::new(), start: vec![0], to: Vec::new(), held: Vec::new(), place: Vec::new() };
        if !role.contains(&Role::Follows) || triangles.is_empty() {
            out.place = ctx.filled(u32::MAX, n)?;
            return Ok(out);
        }
        let first = weld(given, 0.0, ctx)?;
        let edges = edges(triangles, &first, role, ctx)?;
        let order = reached(&edges, role, n, ctx)?;
        let mut place = ctx.filled(u32::MAX, n)?;
        for (k, &v) in order.iter().enumerate() {
            place[v as usize] = k as u32;
        }
        let mut held_place = ctx.filled(u32::MAX, n)?;
        for (k, &v) in order.iter().enumerate() {
            ctx.check_at(k)?;
            for &[_, to] in of(&edges, v) {
                let place = match role[to as usize] {
                    Role::Follows => place[to as usize],
                    _ => {
                        let at = &mut held_place[to as usize];
                        if *at == u32::MAX {
                            *at = (order.len() + out.held.len()) as u32;
                            out.held.push(to);
                        }
                        *at
                    }
                };
                out.to.push(place);
            }
            out.start.push(out.to.len() as u32);
        }
        out.free = order;
        out.place = (0..n)
            .map(|v| if role[v] == Role::Follows { place[first[v] as usize] } else { u32::MAX })
            .collect();
        Ok(out)
    }

    /// Where the membrane has what follows, of a quantity that is `at` the vertices which hold it: one for
    /// each place that [`Membrane::place`] tells.
    pub(super) fn solve(&self, at: impl Fn(u32) -> Vec3, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
        // Differences are small numbers also where coordinates are large.
        let Some(origin) = self.held.first().map(|&v| at(v)) else { return Ok(Vec::new()) };
        let held: Vec<Vec3> = self.held.iter().map(|&v| at(v) - origin).collect();
        // Of unit size, so that squares are numbers whatever the unit is; a power of two keeps all digits.
        let largest = held.iter().flat_map(|p| p.0).fold(0.0f64, |most, x| most.max(x.abs()));
        let unit = if largest > 0.0 { largest.log2().floor().exp2() } else { 1.0 };
        let held: Vec<Vec3> = held.into_iter().map(|p| p.map(|x| x / unit)).collect();
        let mut x = self.start_values(&held, ctx)?;
        self.relax(&mut x, &held, ctx)?;
        Ok(x.into_iter().map(|p| p * unit + origin).collect())
    }

    /// For a vertex its place in what [`Membrane::solve`] gives; none for those that stay.
    pub(super) fn place(&self, vertex: usize) -> Option<usize> {
        Some(self.place[vertex]).filter(|&p| p != u32::MAX).map(|p| p as usize)
    }

    fn neighbours(&self, i: usize) -> &[u32] {
        &self.to[self.start[i] as usize..self.start[i + 1] as usize]
    }

    /// Each the mean of those that were reached before it: exact for an outlier alone.
    fn start_values(&self, held: &[Vec3], ctx: &Context<'_>) -> Result<Vec<Vec3>> {
        let m = self.free.len();
        let mut x = ctx.filled(Vec3::ZERO, m)?;
        for i in 0..m {
            ctx.check_at(i)?;
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            for &to in self.neighbours(i) {
                let to = to as usize;
                if to < i {
                    sum += x[to];
                    count += 1.0;
                } else if to >= m {
                    sum += held[to - m];
                    count += 1.0;
                }
            }
            x[i] = sum.map(|s| s / count);
        }
        Ok(x)
    }

    /// Conjugate gradients with diagonal scaling. All sums run in one order, so that any number of threads
    /// gives the same bytes.
    fn relax(&self, x: &mut [Vec3], held: &[Vec3], ctx: &Context<'_>) -> Result<()> {
        let m = x.len();
        let enough = PIPELINE.follow_residual.powi(2);
        let degree = |i: usize| self.neighbours(i).len() as f64;
        let mut r: Vec<Vec3> = (0..m)
            .map(|i| {
                let near = |&to: &u32| x.get(to as usize).copied().unwrap_or_else(|| held[to as usize - m]);
                self.neighbours(i).iter().map(near).fold(-(x[i] * degree(i)), |sum, q| sum + q)
            })
            .collect();
        let scaled = |r: &[Vec3]| r.iter().enumerate().map(|(i, r)| r.dot(*r) / degree(i)).sum::<f64>();
        let mut d: Vec<Vec3> = r.iter().enumerate().map(|(i, r)| *r * (1.0 / degree(i))).collect();
        let mut q = ctx.filled(Vec3::ZERO, m)?;
        let mut rho = scaled(&r);
        for _ in 0..PIPELINE.follow_steps {
            ctx.check()?;
            if rho <= enough {
                break;
            }
            let mut dq = 0.0;
            for i in 0..m {
                ctx.check_at(i)?;
                let near = self.neighbours(i).iter().filter_map(|&to| d.get(to as usize));
                q[i] = near.fold(d[i] * degree(i), |sum, near| sum - *near);
                dq += d[i].dot(q[i]);
            }
            // Numbers so small that their squares are none.
            if dq <= 0.0 {
                break;
            }
            let alpha = rho / dq;
            for i in 0..m {
                x[i] += d[i] * alpha;
                r[i] -= q[i] * alpha;
            }
            let next = scaled(&r);
            for i in 0..m {
                d[i] = r[i] * (1.0 / degree(i)) + d[i] * (next / rho);
            }
            rho = next;
        }
        Ok(())
    }
}

/// The edges from each outlier to the vertices beside it, sorted, each once.
fn edges(triangles: &[[u32; 3]], first: &[u32], role: &[Role], ctx: &Context<'_>) -> Result<Vec<[u32; 2]>> {
    let mut edges = Vec::new();
    for (t, corners) in triangles.iter().enumerate() {
        ctx.check_at(t)?;
        let corners = corners.map(|v| first[v as usize]);
        for k in 0..3 {
            let from = corners[k];
            if role[from as usize] != Role::Follows {
                continue;
            }
            for to in [corners[(k + 1) % 3], corners[(k + 2) % 3]] {
                if to != from && role[to as usize] != Role::Neither {
                    edges.push([from, to]);
                }
            }
        }
    }
    sort(&mut edges, ctx)?;
    edges.dedup();
    Ok(edges)
}

/// The edges of one outlier.
fn of(edges: &[[u32; 2]], v: u32) -> &[[u32; 2]] {
    let from = edges.partition_point(|e| e[0] < v);
    &edges[from..from + edges[from..].partition_point(|e| e[0] == v)]
}

/// The outliers that hang together with a vertex that holds: those beside one first, then their neighbours.
fn reached(edges: &[[u32; 2]], role: &[Role], n: usize, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut seen = ctx.filled(false, n)?;
    let mut next = VecDeque::new();
    for &[from, to] in edges {
        if role[to as usize] == Role::Holds && !seen[from as usize] {
            seen[from as usize] = true;
            next.push_back(from);
        }
    }
    let mut order = Vec::new();
    while let Some(v) = next.pop_front() {
        ctx.check_at(order.len())?;
        order.push(v);
        for &[_, to] in of(edges, v) {
            if role[to as usize] == Role::Follows && !seen[to as usize] {
                seen[to as usize] = true;
                next.push_back(to);
            }
        }
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::watch::Watch;
    use crate::{Error, Run};
    use std::sync::Arc;
    use std::sync::atomic::Ordering;

    /// A grid of n x n vertices with steps of 1 in the plane z = 0.
    fn grid(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let at = (0..n * n).map(|i| Vec3([f64::from(i % n), f64::from(i / n), 0.0])).collect();
        let quads = (0..(n - 1) * (n - 1)).map(|i| i / (n - 1) * n + i % (n - 1));
        (at, quads.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect())
    }

    /// The vertices with outliers moved to where they follow; the others as they are.
    fn follow_in(
        at: &[Vec3],
        triangles: &[[u32; 3]],
        outliers: &[usize],
        run: &mut Run<'_>,
    ) -> Result<Vec<Vec3>> {
        let role: Vec<Role> = (0..at.len())
            .map(|v| match outliers.contains(&v) {
                _ if !at[v].iter().all(|x| x.is_finite()) => Role::Neither,
                true => Role::Follows,
                false => Role::Holds,
            })
            .collect();
        run.execute(|ctx| {
            let membrane = Membrane::new(at, triangles, &role, ctx)?;
            let new = membrane.solve(|v| at[v as usize], ctx)?;
            Ok((0..at.len()).map(|v| membrane.place(v).map_or(at[v], |p| new[p])).collect())
        })
    }

    fn follow(at: &[Vec3], triangles: &[[u32; 3]], outliers: &[usize]) -> Vec<Vec3> {
        follow_in(at, triangles, outliers, &mut Run::default()).expect("nothing stops it")
    }

    #[test]
    fn a_spike_on_a_grid_goes_exactly_to_where_its_vertex_was() {
        let (flat, triangles) = grid(9);
        let mut spiky = flat.clone();
        for v in [20, 24, 40, 60] {
            spiky[v] += Vec3([0.3, -0.2, 5.0]);
        }
        assert_eq!(follow(&spiky, &triangles, &[20, 24, 40, 60]), flat);
    }

    #[test]
    fn spikes_beside_each_other_lie_flat_again_also_far_from_the_origin() {
        let (mut flat, triangles) = grid(21);
        flat.iter_mut().for_each(|p| *p += Vec3([4e6, 5e6, 100.0]));
        let hill: Vec<usize> =
            (0..441).filter(|i| (5..16).contains(&(i % 21)) && (5..16).contains(&(i / 21))).collect();
        let mut spiky = flat.clone();
        for &v in &hill {
            spiky[v] += Vec3([0.0, 0.0, (v % 7) as f64]);
        }
        for (is, was) in follow(&spiky, &triangles, &hill).iter().zip(&flat) {
            assert!((*is - *was).norm() < 1e-7, "{is:?} {was:?}");
        }
        // And in units whose squares are no numbers.
        for unit in [2f64.powi(-700), 2f64.powi(700)] {
            let scaled: Vec<Vec3> = spiky.iter().map(|p| *p * unit).collect();
            for (is, was) in follow(&scaled, &triangles, &hill).iter().zip(&flat) {
                assert!((*is * (1.0 / unit) - *was).norm() < 1e-7, "{unit}: {is:?} {was:?}");
            }
        }
    }

    #[test]
    fn copies_of_a_vertex_along_a_seam_stay_together() {
        let (flat, mut triangles) = grid(5);
        let mut spiky = flat.clone();
        spiky[12] = Vec3([2.0, 2.0, 9.0]);
        spiky.push(spiky[12]);
        // The triangles to the right of the seam name the copy.
        for t in triangles.iter_mut().filter(|t| t.iter().any(|&v| v % 5 > 2)) {
            t.iter_mut().filter(|v| **v == 12).for_each(|v| *v = 25);
        }
        let new = follow(&spiky, &triangles, &[12, 25]);
        assert_eq!((new[12], new[25]), (flat[12], flat[12]));
    }

    #[test]
    fn outliers_that_nothing_holds_stay_and_vertices_that_are_not_finite_hold_nothing() {
        let (mut at, mut triangles) = grid(3);
        at[4] = Vec3([1.0, 1.0, 7.0]);
        // An island of outliers, and an outlier that no face names.
        at.extend([[9.0, 9.0, 9.0], [9.0, 8.0, 9.0], [8.0, 9.0, 9.0], [-5.0, 0.0, 0.0]].map(Vec3));
        triangles.push([9, 10, 11]);
        let new = follow(&at, &triangles, &[4, 9, 10, 11, 12]);
        assert_eq!((new[4], &new[9..]), (Vec3([1.0, 1.0, 0.0]), &at[9..]));
        // Of the six neighbours of the middle one, two opposite ones are left out.
        (at[0], at[8]) = (Vec3([f64::NAN; 3]), Vec3([f64::INFINITY; 3]));
        assert_eq!(follow(&at, &triangles, &[4])[4], Vec3([1.0, 1.0, 0.0]));
    }

    #[test]
    fn a_run_that_is_stopped_at_any_check_ends_as_cancelled() {
        let (mut at, triangles) = grid(9);
        let hill: Vec<usize> = (20..60).collect();
        hill.iter().for_each(|&v| at[v] += Vec3([0.0, 0.0, (v % 5) as f64]));
        let run = |stop_at: Option<usize>| {
            let watch = Arc::new(Watch { stop_at, ..Watch::default() });
            let mut run = Run { watch: Some(watch.clone()), ..Run::default() };
            let error = follow_in(&at, &triangles, &hill, &mut run).err();
            (error, watch.checks.load(Ordering::Relaxed))
        };
        let (error, checks) = run(None);
        assert!(error.is_none() && checks > 10, "{error:?} {checks}");
        for k in 0..checks {
            assert_eq!(run(Some(k)).0, Some(Error::Cancelled), "stopped at check {k} of {checks}");
        }
    }
}
