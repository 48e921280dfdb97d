//! Chairs, tables, lamps.

use super::build::Build;
use super::loft::Loft;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;

/// A number between two.
pub(super) fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.uniform()
}

/// Whether something of this chance is so.
pub(super) fn chance(rng: &mut Rng, p: f64) -> bool {
    rng.uniform() < p
}

/// The four corners of a rectangle, in order round it.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Four legs from under a top to the floor, splayed outward.
fn legs(build: &mut Build, rng: &mut Rng, slot: u8, half: [f64; 2], top: f64) {
    let splay = if chance(rng, 0.4) { between(rng, 1.0, 1.25) } else { 1.0 };
    let thick = between(rng, 0.02, 0.05) * top.max(0.6);
    let (square, taper) = (chance(rng, 0.5), between(rng, 0.6, 1.0));
    for (i, [x, z]) in CORNERS.into_iter().enumerate() {
        let inset = |k: f64, h: f64| k * (h - thick);
        let (x, z) = (inset(x, half[0]), inset(z, half[1]));
        let line = [Vec3([x * splay, 0.0, z * splay]), Vec3([x, top, z])];
        build.add(slot + i as u8, Loft::bar(&line, &[thick * taper, thick], square));
    }
}

/// A column with a foot: a disc, or a star of bars.
fn pedestal(build: &mut Build, rng: &mut Rng, slot: u8, reach: f64, top: f64) {
    let thick = between(rng, 0.025, 0.06);
    build.add(slot, Loft::turned([0.0; 2], &[[thick, 0.06 * top], [thick * 0.8, top]], true));
    if chance(rng, 0.5) {
        let r = reach * between(rng, 0.7, 1.0);
        build.add(slot + 1, Loft::turned([0.0; 2], &[[r, 0.0], [r, 0.03], [thick, 0.08]], true));
    } else {
        let arms = 3 + rng.below(3);
        for i in 0..arms {
            let a = std::f64::consts::TAU * (i as f64 + 0.5) / arms as f64;
            let end = Vec3([reach * a.cos(), 0.03, reach * a.sin()]);
            let line = [end, Vec3([0.0, 0.09 * top, 0.0])];
            build.add(slot + 2 + i as u8, Loft::bar(&line, &[thick * 0.7, thick], false));
        }
    }
}

/// Slots: 0 seat, 1 back, 2 to 9 slats, 10 posts, 14 arms, 16 their supports, 20 legs, 24 pedestal.
pub(super) fn chair(build: &mut Build, rng: &mut Rng) {
    let half = [between(rng, 0.32, 0.5), between(rng, 0.32, 0.48)];
    let (seat, thick) = (between(rng, 0.6, 0.9), between(rng, 0.03, 0.09));
    let high = between(rng, 0.5, 1.2);
    let lean = between(rng, 0.0, 0.25) * high;
    build.add(0, Loft::block([0.0, seat + thick, 0.0], [half[0], thick, half[1]]));
    let foot = seat + thick;
    let at = |x: f64, t: f64| Vec3([x * half[0], foot + t * high, -half[1] - lean * t + 0.04]);
    let slab = between(rng, 0.025, 0.05);
    if chance(rng, 0.5) {
        // A solid back: a bar that is as wide as the seat.
        let wide = between(rng, 0.8, 1.0) * half[0];
        let ring = |t: f64| super::loft::Ring {
            centre: at(0.0, t),
            axes: [Vec3([wide, 0.0, 0.0]), Vec3([0.0, 0.0, slab])],
        };
        build.add(1, Loft::closed(vec![ring(0.0), ring(1.0)], true));
    } else {
        for (i, x) in [-0.93, 0.93].into_iter().enumerate() {
            build.add(10 + i as u8, Loft::bar(&[at(x, -0.05), at(x, 1.0)], &[slab], true));
        }
        build.add(1, Loft::bar(&[at(-0.93, 0.95), at(0.93, 0.95)], &[slab * 1.3], true));
        let slats = 2 + rng.below(4);
        let upright = chance(rng, 0.5);
        for i in 0..slats {
            let t = (i as f64 + 1.0) / (slats as f64 + 1.0);
            let line = if upright {
                [at(1.8 * t - 0.9, 0.0), at(1.8 * t - 0.9, 0.95)]
            } else {
                [at(-0.93, 0.9 * t), at(0.93, 0.9 * t)]
            };
            build.add(2 + i as u8, Loft::bar(&line, &[slab * 0.7], false));
        }
    }
    if chance(rng, 0.4) {
        let up = seat + between(rng, 0.25, 0.45);
        for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
            let x = x * (half[0] - slab);
            let line = [Vec3([x, up, -half[1]]), Vec3([x, up, half[1] * 0.8])];
            build.add(14 + i as u8, Loft::bar(&line, &[slab], true));
            let line = [Vec3([x, seat, half[1] * 0.7]), Vec3([x, up, half[1] * 0.7])];
            build.add(16 + i as u8, Loft::bar(&line, &[slab * 0.8], true));
        }
    }
    if chance(rng, 0.75) {
        legs(build, rng, 20, half, seat);
    } else {
        pedestal(build, rng, 24, half[0] * 1.1, seat);
    }
}

/// Slots: 0 top, 1 shelf, 2 apron, 20 legs, 24 pedestal, 40 trestles.
pub(super) fn table(build: &mut Build, rng: &mut Rng) {
    let half = [between(rng, 0.5, 1.2), between(rng, 0.4, 0.6)];
    let (top, thick) = (between(rng, 0.4, 1.0), between(rng, 0.02, 0.06));
    let round = chance(rng, 0.3);
    let r = half[0].min(0.9);
    if round {
        build.add(0, Loft::turned([0.0; 2], &[[r, top], [r, top + 2.0 * thick]], true));
    } else {
        build.add(0, Loft::block([0.0, top + thick, 0.0], [half[0], thick, half[1]]));
    }
    let half = if round { [r * 0.7; 2] } else { half };
    match rng.below(4) {
        0 => pedestal(build, rng, 24, 0.75 * half[1], top),
        1 if !round => {
            for (i, x) in [-0.85, 0.85].into_iter().enumerate() {
                let centre = [x * half[0], 0.5 * top, 0.0];
                build.add(40 + i as u8, Loft::block(centre, [0.03, 0.5 * top, half[1] * 0.85]));
            }
        }
        _ => legs(build, rng, 20, half, top),
    }
    if !round && chance(rng, 0.3) {
        let y = top * between(rng, 0.2, 0.5);
        build.add(1, Loft::block([0.0, y, 0.0], [half[0] * 0.9, 0.02, half[1] * 0.9]));
    }
}

/// Slots: 0 flat foot, 5 round foot, 1 pole, 2 shade, 3 arm, 4 bulb.
pub(super) fn lamp(build: &mut Build, rng: &mut Rng) {
    let high = between(rng, 0.6, 1.6);
    let foot = between(rng, 0.15, 0.35);
    let thin = between(rng, 0.015, 0.04);
    if chance(rng, 0.5) {
        build.add(0, Loft::turned([0.0; 2], &[[foot, 0.0], [foot, 0.04], [thin, 0.1]], true));
    } else {
        let belly = between(rng, 0.1, 0.25);
        let profile = [[belly * 0.6, 0.0], [belly, 0.12], [belly * 0.8, 0.3], [thin * 1.5, 0.42]];
        build.add(5, Loft::turned([0.0; 2], &profile, true));
    }
    let wide = between(rng, 0.2, 0.5);
    let narrow = wide * between(rng, 0.35, 1.0);
    let tall = between(rng, 0.2, 0.5);
    let reach = if chance(rng, 0.35) { between(rng, 0.3, 0.8) } else { 0.0 };
    build.add(1, Loft::turned([0.0; 2], &[[thin, 0.03], [thin, high]], true));
    if reach > 0.0 {
        let top = Vec3([reach, high + between(rng, -0.1, 0.2), 0.0]);
        build.add(3, Loft::bar(&[Vec3([0.0, high, 0.0]), top], &[thin], false));
        let y = top[1];
        build.add(2, Loft::turned([reach, 0.0], &[[wide * 0.7, y - tall * 0.6], [narrow * 0.4, y]], false));
        build.add(4, Loft::turned([reach, 0.0], &[[0.04, y - 0.15], [0.07, y - 0.08], [0.03, y]], true));
    } else {
        build
            .add(2, Loft::turned([0.0; 2], &[[wide, high - tall * 0.3], [narrow, high + tall * 0.7]], false));
        build.add(4, Loft::turned([0.0; 2], &[[0.03, high], [0.07, high + 0.07], [0.04, high + 0.13]], true));
    }
}
