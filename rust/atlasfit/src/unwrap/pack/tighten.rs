//! The last texels of a packing: the page shrinks a little at a time, and the charts on it give way to each
//! other.
//!
//! In: placements on one page. Out: placements that are closer together, with exactly the padding asked for.
//! Charts made of cells lie a cell or more farther apart than they must. Here they are drawn towards the
//! page's corner in proportion, then shifted and turned as little as keeps their outlines apart: each nearest
//! vertex and edge of two charts must keep the padding along the line between them, as in the compaction of
//! Li and Milenkovic (1995), whose linear program is replaced by projecting one such constraint after the
//! other, for shifts and turns alike (Müller et al. 2007). Straight charts do not turn, nor do
//! those whose border lies along the page's sides for the most part.

use super::constants::TIGHTEN;
use super::contacts::{Contact, Motion, Moved, Near, Page, Shape, WALL, dot, least_gap, plus};
use super::placement::{PackJob, Packed, Placement};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::planar::turned;
use rayon::prelude::*;

/// Pushes the charts together; `None` where that gains nothing.
pub(crate) fn tighten(
    charts: &[Chart],
    packed: &Packed,
    job: &PackJob<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Packed>> {
    let Packed { placements, density, padding } = packed;
    if charts.len() > TIGHTEN.most_charts
        || charts.iter().map(|c| c.border.len()).sum::<usize>() > TIGHTEN.most_edges
    {
        return Ok(None);
    }
    let longer = f64::from(job.page[0].max(job.page[1]));
    let unit = longer / density / TIGHTEN.units;
    let shapes: Vec<Shape> = (charts.par_iter().zip(placements))
        .map(|(c, p)| Shape::new(&c.outline(), !c.straight, p, unit))
        .collect();
    ctx.check()?;
    let shape = job.page.map(|p| f64::from(p) / longer);
    let share = f64::from(job.padding) / longer;
    let page = |side: f64| Page { size: shape.map(|s| s * side), gap: (share * side).max(TIGHTEN.least_gap) };
    let mut side = TIGHTEN.units;
    let mut motions = vec![Motion::default(); shapes.len()];
    let mut moved = all_moved(&shapes, &motions);
    let mut near = Near::find(&moved, &motions, page(side), ctx)?;
    let (mut step, mut halvings) = (TIGHTEN.step, 0);
    // No step may bring charts through each other. Two charts come nearer by at most the step's share of the
    // distance of their middles, and that distance is at most the page's diagonal.
    let slow = TIGHTEN.slow / shape[0].hypot(shape[1]);
    let mut least = least_gap(&near.contacts(&moved, page(side), ctx)?, page(side));
    for _ in 0..TIGHTEN.tries {
        step = step.min(slow * least);
        let target = side - step;
        // Towards the corner: what lies between two charts shrinks in proportion to how far apart they are.
        let pull = step / side;
        let mut next: Vec<Motion> = (moved.iter().zip(&motions))
            .map(|(m, &Motion { shift, angle })| Motion {
                shift: [0, 1].map(|k| shift[k] - pull * m.middle[k]),
                angle,
            })
            .collect();
        if let Some((gap, at)) = separate(&shapes, &mut next, page(target), &mut near, ctx)? {
            (motions, moved, side, least) = (next, at, target, gap);
        } else if halvings == TIGHTEN.halvings {
            break;
        } else {
            (step, halvings) = (0.5 * step, halvings + 1);
        }
    }
    if side == TIGHTEN.units {
        return Ok(None);
    }
    let placed = (placements.iter().zip(&shapes).zip(&motions))
        .map(|((p, shape), m)| {
            let middle = shape.middle.map(|x| x * unit);
            let off = turned([p.shift[0] - middle[0], p.shift[1] - middle[1]], m.rotation());
            let shift = plus(plus(middle, off), m.shift.map(|x| x * unit));
            Placement { rotation: turned(p.rotation, m.rotation()), shift, ..*p }
        })
        .collect();
    Ok(Some(Packed { placements: placed, density: density * TIGHTEN.units / side, padding: *padding }))
}

/// All charts where they are now.
fn all_moved(shapes: &[Shape], motions: &[Motion]) -> Vec<Moved> {
    shapes.par_iter().zip(motions).map(|(s, m)| s.moved(m)).collect()
}

/// Shifts and turns charts until all are apart and on the page. Gives their least distance and where they
/// are; `None` where that was not possible.
fn separate(
    shapes: &[Shape],
    motions: &mut [Motion],
    page: Page,
    near: &mut Near,
    ctx: &Context<'_>,
) -> Result<Option<(f64, Vec<Moved>)>> {
    let mut last = f64::INFINITY;
    for round in 0..TIGHTEN.rounds {
        ctx.check()?;
        let moved = all_moved(shapes, motions);
        if !near.holds(shapes, motions, page) {
            *near = Near::find(&moved, motions, page, ctx)?;
        }
        let contacts = near.contacts(&moved, page, ctx)?;
        let least = least_gap(&contacts, page);
        let lack = page.gap - contacts.iter().map(|c| c.gap).fold(page.gap, f64::min);
        if lack <= TIGHTEN.tolerance {
            return Ok(Some((least, moved)));
        }
        if round + 1 == TIGHTEN.rounds
            || least < TIGHTEN.touching * page.gap
            || round >= TIGHTEN.patience && lack > TIGHTEN.progress * last
        {
            return Ok(None);
        }
        last = lack;

        let more = project(&contacts, shapes, page);
        let most = TIGHTEN.apart * least;
        for ((motion, m), shape) in motions.iter_mut().zip(&more).zip(shapes) {
            let way = dot(m.shift, m.shift).sqrt() + m.angle.abs() * shape.radius;
            let part = (most / way).min(1.0);
            motion.shift = [0, 1].map(|k| motion.shift[k] + part * m.shift[k]);
            motion.angle += part * m.angle;
        }
    }
    Ok(None)
}

/// Motions that satisfy the contacts, as far as some passes go.
fn project(contacts: &[Contact], shapes: &[Shape], page: Page) -> Vec<Motion> {
    let mut more = vec![Motion::default(); shapes.len()];
    // Most contacts hold all along: these are looked at once in a while.
    let mut tight: Vec<&Contact> = Vec::new();
    for pass in 0..TIGHTEN.passes {
        let all = pass % TIGHTEN.look_at_all == 0;
        let mut worst: f64 = 0.0;
        if all {
            tight = contacts.iter().collect();
        }
        tight.retain(|c| {
            // The side of a page does not move.
            let ends = [(c.a, 1.0, c.arms[0]), (c.b, -1.0, c.arms[1])];
            let ends = ends.iter().filter(|e| e.0 != WALL).map(|&(i, sign, arm)| (i as usize, sign, arm));
            let (mut apart, mut ease) = (0.0, 0.0);
            for (i, sign, arm) in ends.clone() {
                apart += sign * (dot(c.normal, more[i].shift) + arm * more[i].angle);
                ease += 1.0 + shapes[i].turns * arm * arm;
            }
            let lack = page.gap + TIGHTEN.tolerance - c.gap - apart;
            if lack > 0.0 {
                worst = worst.max(lack);
                for (i, sign, arm) in ends {
                    let by = sign * lack / ease;
                    more[i].shift = [0, 1].map(|k| more[i].shift[k] + by * c.normal[k]);
                    more[i].angle += by * shapes[i].turns * arm;
                }
            }
            !all || lack > 0.0
        });
        if all && worst < 0.5 * TIGHTEN.tolerance {
            break;
        }
    }
    more
}

#[cfg(test)]
mod tests {
    use super::super::contacts::away;
    use super::*;
    use crate::run::Run;
    use crate::unwrap::Packer;
    use crate::unwrap::pack::Packing;
    use crate::unwrap::planar::rotated;
    use proptest::prelude::*;

    const PADDING: u32 = 4;

    /// A rectangle that may turn unless it is `straight`.
    fn rectangle([w, h]: [f64; 2], straight: bool) -> Chart {
        Chart {
            faces: vec![0, 1],
            tris: vec![[0, 1, 2], [0, 2, 3]],
            uv: vec![[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]],
            border: vec![(0, 0), (0, 1), (1, 1), (1, 2)],
            area: w * h,
            straight,
            ..Chart::default()
        }
    }

    /// Rectangles with their corners and angles on a page of some side; then their outlines, and the side.
    fn tightened(
        charts: &[Chart],
        places: &[([f64; 2], f64)],
        side: f64,
    ) -> Option<(Vec<Vec<[f64; 2]>>, f64)> {
        let place = |&(shift, angle): &([f64; 2], f64)| Placement {
            shift,
            rotation: [angle.cos(), angle.sin()],
            ..Placement::default()
        };
        let placements: Vec<Placement> = places.iter().map(place).collect();
        let job = PackJob {
            page: [1024; 2],
            padding: PADDING,
            density: None,
            pages: 1,
            occupied: &[],
            packer: Packing::Own(Packer::Shapes),
            seed: 0,
        };
        let packed = Packed { placements, density: 1024.0 / side, padding: PADDING };
        let run = |ctx: &Context<'_>| tighten(charts, &packed, &job, ctx);
        let Packed { placements, density, .. } = Run::default().execute(run).expect("nothing cancels")?;
        let outline = |(c, p): (&Chart, &Placement)| {
            rotated(&c.uv, p.rotation).iter().map(|q| [0, 1].map(|k| q[k] + p.shift[k])).collect()
        };
        Some((charts.iter().zip(&placements).map(outline).collect(), 1024.0 / density))
    }

    /// The distance of two convex polygons that do not meet, from the corners of either.
    fn distance(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
        let one = |a: &[[f64; 2]], b: &[[f64; 2]]| {
            let edges = (0..b.len()).map(|i| [b[i], b[(i + 1) % b.len()]]);
            let all = edges.flat_map(|e| a.iter().map(move |&p| away(p, e)));
            all.map(|d| dot(d, d).sqrt()).fold(f64::INFINITY, f64::min)
        };
        one(a, b).min(one(b, a))
    }

    #[test]
    fn three_squares_in_a_row_end_with_the_padding_between_them() {
        let squares = [(); 3].map(|()| rectangle([1.0; 2], true));
        let places = [0.05, 1.12, 2.2].map(|x| ([x, 0.1], 0.0));
        let (at, side) = tightened(&squares, &places, 3.3).expect("there is room");
        let least = 3.0 / (1.0 - 4.0 * f64::from(PADDING) / 1024.0);
        assert!((least - 1e-3..1.005 * least).contains(&side), "{side} for {least}");
        let gap = f64::from(PADDING) / 1024.0 * side;
        for pair in at.windows(2) {
            assert!(distance(&pair[0], &pair[1]) > 0.98 * gap, "{at:?}");
        }
    }

    #[test]
    fn a_page_without_room_stays_as_it_is() {
        let gap = f64::from(PADDING) / 1024.0;
        let full = [rectangle([1.0 - 2.0 * gap; 2], false)];
        assert_eq!(tightened(&full, &[([gap; 2], 0.0)], 1.0), None);
    }

    #[test]
    fn what_lies_along_the_page_stays_so_though_another_pushes_it() {
        // The second lies askew, with a corner against the first, above its middle.
        let charts = [[0.5, 1.0], [0.8, 0.2]].map(|size| rectangle(size, false));
        let places = [([0.02, 0.02], 0.0), ([0.56, 0.6], 0.4)];
        let (at, side) = tightened(&charts, &places, 1.5).expect("there is room");
        let slopes = [0, 1].map(|k| (at[k][1][1] - at[k][0][1]).abs());
        assert!(side < 1.4 && slopes[0] < 1e-12 && slopes[1] > 0.0, "{side} {slopes:?}");
    }

    #[test]
    fn a_rectangle_that_lies_askew_turns_until_it_fills_its_page_unless_it_is_straight() {
        let askew = |straight| {
            let place = ([0.08, 0.02], 0.05);
            tightened(&[rectangle([1.0; 2], straight)], &[place], 1.12).map_or(1.12, |t| t.1)
        };
        let least = 1.0 / (1.0 - 2.0 * f64::from(PADDING) / 1024.0);
        assert!(askew(false) < 1.005 * least, "{}", askew(false));
        assert!(askew(true) > 1.04 * least, "{}", askew(true));
    }

    proptest! {
        #[test]
        fn charts_keep_their_padding_and_stay_on_the_page(
            sizes in prop::collection::vec((0.05..0.2f64, 0.05..0.2f64, 0.0..1.0f64, any::<bool>()), 16)
        ) {
            let charts: Vec<Chart> =
                sizes.iter().map(|&(w, h, _, straight)| rectangle([w, h], straight)).collect();
            let places: Vec<_> = (sizes.iter().enumerate())
                .map(|(i, &(w, h, angle, straight))| {
                    // Each has a sixteenth of the page, and is turned as far as it has room to.
                    let angle = if straight { 0.0 } else { 0.2 * angle };
                    let (s, c) = angle.sin_cos();
                    let size = [c * w + s * h, s * w + c * h];
                    let at = |k: usize, n: usize| 0.25 * n as f64 + 0.5 * (0.25 - size[k]);
                    ([at(0, i % 4) + s * h, at(1, i / 4)], angle)
                })
                .collect();
            if let Some((at, side)) = tightened(&charts, &places, 1.0) {
                prop_assert!(side < 1.0);
                let least = 0.98 * f64::from(PADDING) / 1024.0 * side;
                for (i, p) in at.iter().enumerate() {
                    prop_assert!(p.iter().flatten().all(|x| (least..side - least).contains(x)), "{p:?}");
                    for q in &at[..i] {
                        prop_assert!(distance(p, q) > least, "{p:?} {q:?}");
                    }
                }
            }
        }
    }
}
