//! Growing one patch: the largest neighbourhood of a point that is a graph over a plane.
//!
//! In: the points, their search tree, a seed, the noise. Out: base plane, elliptic domain and members of a
//! patch, or nothing where there are too few points. A small quadric is fitted first; the patch then grows
//! while the quadric predicts the points of the next ring to within the noise, so that a second sheet near in
//! space is never taken in. The domain is shortened across strong curvature: along a tube a patch is long,
//! around it short.

use super::constants::PARTITION;
use super::moments::{PatchPoints, fit_quadric, quad};
use crate::atlas::Monge;
use crate::atlas::Patch;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::dense::principal;
use crate::numeric::robust::TUKEY;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};

/// What growing needs to know of the scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GrowParams<'a> {
    /// Noise, standard deviation.
    pub sigma: f64,
    /// Point spacing about the seed.
    pub spacing: f64,
    /// No patch grows beyond this radius.
    pub max_radius: f64,
    /// Where an earlier fit put the points: a patch takes none of an opposing sheet.
    pub earlier: Option<&'a [ProjectedPoint]>,
    /// The points that may be taken, in order, if not all.
    pub only: Option<&'a [u32]>,
}

/// Whether point `b` of an earlier fit lies on a sheet that opposes the place with this normal. It does when
/// it faces the other way, unless it lies where a smooth surface that starts at the place would come by it
/// and `b` is only turned the wrong way. (The chord of an arc is perpendicular to the sum of its ends'
/// normals.)
#[must_use]
pub(crate) fn is_across(place: Vec3, normal: Vec3, b: &ProjectedPoint, sigma: f64) -> bool {
    let facing = b.normal;
    b.chart != u32::MAX
        && facing.dot(normal) < 0.0
        && (b.position - place).dot(normal - facing).abs() >= 2.0 * PARTITION.between * sigma
}

/// Buffers of one worker.
#[derive(Default)]
pub(crate) struct Scratch {
    found: Vec<Neighbour>,
    local: PatchPoints,
}

struct State {
    center: Vec3,
    axes: [Vec3; 3],
    radii: [f64; 2],
    quadric: [f64; 6],
    residual: f64,
}

/// Grows a patch from point `seed`; none where there are too few points.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn grow(
    points: &[Vec3],
    tree: &Neighbours,
    seed: usize,
    p: &GrowParams<'_>,
    scratch: &mut Scratch,
    ctx: &Context<'_>,
) -> Result<Option<Patch>> {
    let Scratch { found, local } = scratch;
    let origin = points[seed];
    let same_sheet = |found: &mut Vec<Neighbour>| {
        if let Some(only) = p.only {
            found.retain(|f| only.binary_search(&f.index).is_ok());
        }
        if let Some(earlier) = p.earlier
            && earlier[seed].chart != u32::MAX
        {
            let own = &earlier[seed];
            found.retain(|f| !is_across(own.position, own.normal, &earlier[f.index as usize], p.sigma));
        }
    };
    tree.within(origin, p.max_radius * PARTITION.rim, found);
    same_sheet(found);
    if found.len() < PARTITION.min_members {
        tree.nearest(origin, PARTITION.min_members + 3, found);
        same_sheet(found);
        // The few nearest may stand a little beyond; strays have theirs far away.
        if found.len() < PARTITION.min_members
            || found[PARTITION.min_members - 1].dist2.sqrt() > 2.0 * p.max_radius
        {
            return Ok(None);
        }
    }
    let mut all = thin(found);
    let start = found[found.len().min(10) - 1].dist2.sqrt().max(2.5 * p.sigma).max(1e-12);
    let near = found
        .partition_point(|f| f.dist2 <= start * start * (1.0 + 1e-9))
        .max(PARTITION.min_members)
        .min(found.len());
    let mut state = first_plane(points, &found[..near], origin, start);
    let mut best: Option<State> = None;
    let mut radius = start;
    let mut accepted = false;
    let (mut wide, mut followed) = (false, 0);
    loop {
        ctx.check()?;
        let reach = radius * PARTITION.rim * 1.5;
        let take = found.partition_point(|f| f.dist2 <= reach * reach);
        let Some(mut next) = step(points, &found[..take.max(near)], &state, radius, p.sigma, local) else {
            break;
        };
        let first = best.is_none();
        let ok = accept(points, &found[..take.max(near)], &mut next, p.sigma);
        if !ok && !first {
            break;
        }
        accepted = ok;
        let bent = next.radii[0] < radius * 0.999 && next.radii[1] < radius * 0.999;
        state = State { ..next };
        best = Some(State { ..next });
        // Where curvature keeps a patch narrow it may grow longer: as many points, the same smoothing.
        let narrow = state.radii[0].min(state.radii[1]);
        let limit = p.max_radius * (0.6 * p.max_radius / narrow).clamp(1.0, PARTITION.max_lengthen);
        if !ok || bent || radius >= limit || followed == PARTITION.most_followed {
            break;
        }
        followed += usize::from(radius * PARTITION.growth > limit);
        radius = (radius * PARTITION.growth).min(limit);
        if radius > p.max_radius && !wide {
            wide = true;
            tree.within(origin, PARTITION.max_lengthen * p.max_radius * PARTITION.rim, found);
            same_sheet(found);
            all = thin(found);
        }
    }
    let found = all.as_ref().unwrap_or(found);
    let Some(s) = best else { return Ok(None) };
    let members = members(points, found, &s, p.sigma);
    Ok(patch(s, members, accepted, p))
}

/// The patch, if enough points are its members.
fn patch(s: State, members: Vec<u32>, accepted: bool, p: &GrowParams<'_>) -> Option<Patch> {
    let State { center, axes, radii, quadric, residual } = s;
    (members.len() >= PARTITION.min_members).then_some(Patch {
        center,
        axes,
        radii,
        quadric,
        members,
        residual,
        spacing: p.spacing,
        sigma: p.sigma,
        of_two: p.only.is_some(),
        accepted,
    })
}

/// The plane through the principal directions of the nearest points, weighted towards the seed at `origin`.
fn first_plane(points: &[Vec3], near: &[Neighbour], origin: Vec3, radius: f64) -> State {
    let (mean, normal) = plane(points, near, radius);
    State {
        center: origin + normal * (mean - origin).dot(normal),
        axes: Monge::frame(normal, normal.tangents().0),
        radii: [radius; 2],
        quadric: [0.0; 6],
        residual: 0.0,
    }
}

/// The points over the domain, and a little beyond, that follow the quadric.
fn members(points: &[Vec3], found: &[Neighbour], s: &State, sigma: f64) -> Vec<u32> {
    let limit = TUKEY * sigma + 0.03 * s.radii[0].min(s.radii[1]);
    found
        .iter()
        .filter(|f| {
            let d = points[f.index as usize] - s.center;
            let (u, v) = (d.dot(s.axes[0]) / s.radii[0], d.dot(s.axes[1]) / s.radii[1]);
            u * u + v * v <= PARTITION.rim * PARTITION.rim
                && (d.dot(s.axes[2]) - quad(&s.quadric, u, v)).abs() < limit
        })
        .map(|f| f.index)
        .collect()
}

/// Leaves an even share of too many points and gives them all back.
fn thin(found: &mut Vec<Neighbour>) -> Option<Vec<Neighbour>> {
    let step = found.len().div_ceil(PARTITION.max_found);
    (step > 1).then(|| {
        let few = found.iter().step_by(step).copied().collect();
        std::mem::replace(found, few)
    })
}

fn plane(points: &[Vec3], near: &[Neighbour], radius: f64) -> (Vec3, Vec3) {
    let weight = |d2: f64| (1.0 - d2 / (radius * radius * 1.5)).max(0.05);
    let near = near.iter().map(|f| (points[f.index as usize], weight(f.dist2)));
    principal(near).map_or((Vec3::ZERO, Vec3([0.0, 0.0, 1.0])), |p| (p.mean, p.axes[0]))
}

/// Refits the quadric within `radius`, turns the base plane to it, and bounds the domain by its curvature.
fn step(
    points: &[Vec3],
    found: &[Neighbour],
    from: &State,
    radius: f64,
    sigma: f64,
    local: &mut PatchPoints,
) -> Option<State> {
    let mut s = State { ..*from };
    // The old quadric predicts heights; in the new units its coefficients scale.
    let grow = [radius / s.radii[0], radius / s.radii[1]];
    s.radii = [radius; 2];
    let q = s.quadric;
    s.quadric = [
        q[0],
        q[1] * grow[0],
        q[2] * grow[1],
        q[3] * grow[0] * grow[0],
        q[4] * grow[0] * grow[1],
        q[5] * grow[1] * grow[1],
    ];
    let mut deviation = [0.0; 2];
    let mut domain =
        from.radii.map(|r| if r < from.radii[0].max(from.radii[1]) * 0.999 { r } else { radius });
    for turn in 0..2 {
        local.clear();
        for f in found {
            let d = points[f.index as usize] - s.center;
            let (x, y, z) = (d.dot(s.axes[0]), d.dot(s.axes[1]), d.dot(s.axes[2]));
            let (a, b) = (x / domain[0], y / domain[1]);
            if a * a + b * b <= PARTITION.rim * PARTITION.rim {
                local.push(x / radius, y / radius, z);
            }
        }
        if local.u.len() < PARTITION.min_members {
            return None;
        }
        local.fill();
        // Slack beyond the noise: what a quadric of the previous, smaller patch may miss of the new ring.
        let slack = if turn == 0 { 0.10 } else { 0.05 } * domain[0].min(domain[1]);
        for _ in 0..2 {
            deviation = fit_quadric(
                local,
                &mut s.quadric,
                TUKEY * sigma + slack,
                sigma / (PARTITION.curved * radius),
            )?;
        }
        // Turn the base plane to the tangent plane at the centre.
        let (a, b) = (s.quadric[1] / radius, s.quadric[2] / radius);
        let n = (s.axes[2] + (s.axes[0] * -a + s.axes[1] * -b)).normalized();
        s.center += s.axes[2] * s.quadric[0];
        // Principal directions of the second fundamental form (slopes are zero at the new centre).
        let (xx, xy, yy) = (2.0 * s.quadric[3], s.quadric[4], 2.0 * s.quadric[5]);
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let (c, d) = (angle.cos(), angle.sin());
        let along = (s.axes[0] * c) + (s.axes[1] * d);
        let k1 = (xx * c * c + 2.0 * xy * c * d + yy * d * d) / (radius * radius);
        let k2 = (xx * d * d - 2.0 * xy * c * d + yy * c * c) / (radius * radius);
        s.axes = Monge::frame(n, along);
        s.quadric = [0.0, 0.0, 0.0, 0.5 * k1 * radius * radius, 0.0, 0.5 * k2 * radius * radius];
        // Only curvature that stands out of the noise shortens the domain.
        let doubt = 2.0 * 2.0 * sigma * deviation[0].max(deviation[1]) / (radius * radius);
        domain = [k1, k2].map(|k: f64| radius.min(PARTITION.max_bend / (k.abs() - doubt).max(1e-12)));
    }
    // The final domain's units.
    s.radii = domain;
    let f = domain.map(|d| d / radius);
    s.quadric[3] *= f[0] * f[0];
    s.quadric[5] *= f[1] * f[1];
    Some(s)
}

/// Whether the points over the domain lie on the quadric to within the noise, and are not mixed with another
/// sheet's. Notes the residual.
fn accept(points: &[Vec3], found: &[Neighbour], s: &mut State, sigma: f64) -> bool {
    let small = s.radii[0].min(s.radii[1]);
    let limit = TUKEY * sigma + 0.05 * small;
    let (mut total, mut sum, mut near, mut astray) = (0.0f64, 0.0f64, 0usize, 0usize);
    for f in found {
        let d = points[f.index as usize] - s.center;
        let (u, v) = (d.dot(s.axes[0]) / s.radii[0], d.dot(s.axes[1]) / s.radii[1]);
        if u * u + v * v > 1.0 {
            continue;
        }
        let e = d.dot(s.axes[2]) - quad(&s.quadric, u, v);
        if e.abs() < limit {
            total += 1.0;
            sum += e * e;
            near += 1;
        } else if e.abs() < 1.5 * limit {
            astray += 1;
        }
    }
    if near < PARTITION.min_members {
        return false;
    }
    let rms = (sum / total).sqrt();
    s.residual = (sum / (total - 6.0).max(1.0)).sqrt();
    explains(rms, small, sigma) && astray * 5 <= near
}

/// Whether a residual is the noise's, on a domain whose smaller half axis is `small`.
#[must_use]
pub(crate) fn explains(residual: f64, small: f64, sigma: f64) -> bool {
    residual <= (PARTITION.explained * sigma).max(PARTITION.followed * small)
}
