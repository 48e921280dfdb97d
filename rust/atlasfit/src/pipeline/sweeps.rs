//! Sweeps of a scan moved together before it is looked at, where that is asked for.
//!
//! In: the cloud, the name of the column that tells its sweeps apart. Out: the cloud with each sweep moved,
//! and how; or nothing. The two sides of a thin wall must not be taken for one place: where the scan does not
//! say which way its points face, they are fitted once as they are, which tells it.

use super::facing;
use super::options::DenoiseOptions;
use crate::error::{Error, Result};
use crate::geometry::{Attribute, PointCloud};
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::{self, Vec3};
use crate::numeric::wording::counted;
use crate::register::{self, Registration};
use crate::run::Context;

/// Unit normals of points by a fit, turned to one side; zero where they are not known.
type Normals<'a> = dyn Fn(&[Vec3]) -> Result<Vec<Vec3>> + 'a;

/// The cloud whose sweeps fit each other, where the options name them.
pub(super) fn registered(
    cloud: &PointCloud,
    options: &DenoiseOptions,
    normals: &Normals<'_>,
    ctx: &Context<'_>,
) -> Result<Option<(PointCloud, Registration)>> {
    let Some(name) = &options.sweeps else { return Ok(None) };
    let sweep_of = numbers(cloud, name, ctx)?;
    let points = vec3::of(&cloud.positions);
    // Before anything is fitted.
    register::numbers(points, &sweep_of, ctx)?;
    let register = |toward: &[Vec3]| register::register(points, &sweep_of, toward, ctx);
    let registration = match facing::directions(cloud, options) {
        Some(direction) => {
            let finite = |d: Vec3| if d.iter().all(|x| x.is_finite()) { d } else { Vec3::ZERO };
            let mut toward = Vec::with_capacity(cloud.len());
            for i in 0..cloud.len() {
                ctx.check_at(i)?;
                toward.push(finite(direction(i)));
            }
            register(&toward)?
        }
        // Two sweeps of one sheet that lie far apart look like the two sides of a slab: where no side of one
        // is beside the same side of another, they are taken for that sheet.
        None => match register(&facing_of_sweeps(points, &sweep_of, normals, ctx)?) {
            Err(Error::Degenerate { .. }) => register(&[])?,
            other => other?,
        },
    };
    let mut moved = cloud.clone();
    let motions = &registration.sweeps;
    let motion = |i: usize| {
        let place = motions.binary_search_by_key(&sweep_of[i], |m| m.sweep).ok()?;
        Some(&motions[place].motion)
    };
    for i in 0..cloud.len() {
        ctx.check_at(i)?;
        let Some(motion) = motion(i) else { continue };
        moved.positions[i] = motion.of(Vec3(cloud.positions[i])).0;
        if let Some(normals) = &mut moved.normals {
            normals[i] = motion.turned(Vec3(normals[i].map(f64::from))).to_f32();
        }
    }
    if let Some(scanners) = &mut moved.scanners {
        // A scanner goes with the first of its points.
        let mut first = vec![None; scanners.positions.len()];
        for (i, &scanner) in scanners.of_point.iter().enumerate() {
            if let Some(first) = first.get_mut(scanner as usize) {
                first.get_or_insert(i);
            }
        }
        for (at, i) in scanners.positions.iter_mut().zip(first) {
            if let Some(motion) = i.and_then(motion) {
                *at = motion.of(Vec3(*at)).0;
            }
        }
    }
    Ok(Some((moved, registration)))
}

/// The side that each point faces, zero where that is not known: by a fit of its sweep alone, which knows
/// front from back however sweeps lie, turned as most of its points are by a fit of all.
fn facing_of_sweeps(
    points: &[Vec3],
    sweep_of: &[u32],
    normals: &Normals<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Vec3>> {
    let mut toward = normals(points)?;
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    sort_by(&mut order, |&a, &b| (sweep_of[a as usize], a).cmp(&(sweep_of[b as usize], b)), ctx)?;
    for sweep in order.chunk_by(|&a, &b| sweep_of[a as usize] == sweep_of[b as usize]) {
        let own: Vec<Vec3> = sweep.iter().map(|&i| points[i as usize]).collect();
        let own = match normals(&own) {
            Ok(own) => own,
            // Too few points, or none that are finite: they are not moved.
            Err(Error::Degenerate { .. } | Error::EmptyInput { .. }) => continue,
            Err(error) => return Err(error),
        };
        let agree: f64 = sweep.iter().zip(&own).map(|(&i, n)| n.dot(toward[i as usize])).sum();
        for (&i, n) in sweep.iter().zip(own) {
            toward[i as usize] = n * agree.signum();
        }
    }
    Ok(toward)
}

/// The sweep of each point.
fn numbers(cloud: &PointCloud, name: &str, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let Some(column) = Attribute::named(&cloud.attributes, name) else {
        let known: Vec<&str> = cloud.attributes.iter().map(|a| a.name.as_str()).collect();
        return Err(Error::invalid(
            format!("sweeps is \"{name}\", but the scan has no attribute of that name"),
            if known.is_empty() {
                "It has none at all: register the sweeps before they are merged, or leave sweeps out".into()
            } else {
                format!("It has {}", known.join(", "))
            },
        ));
    };
    if column.width != 1 {
        return Err(Error::invalid(
            format!("sweeps is \"{name}\", which has {} a point", counted(column.width, "number")),
            "Give an attribute that has one",
        ));
    }
    let mut numbers = Vec::with_capacity(column.values.len());
    for (i, &value) in column.values.iter().enumerate() {
        ctx.check_at(i)?;
        if value.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&value) {
            return Err(Error::invalid(
                format!("sweeps is \"{name}\", and point {i} has {value} there"),
                "Give an attribute that numbers the sweeps: whole, 0 or more",
            ));
        }
        numbers.push(value as u32);
    }
    Ok(numbers)
}
