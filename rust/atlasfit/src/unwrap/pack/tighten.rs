//! The last texels of a packing: the page shrinks a little at a time, and the charts on it give way to each
//! other.
//!
//! In: placements on one page. Out: placements that are closer together, with exactly the padding asked for.
//! Charts made of cells lie a cell or more farther apart than they must. Here they are drawn towards the
//! page's corner in proportion, then shifted as little as keeps their outlines apart: each nearest vertex and
//! edge of two charts must keep the padding along the line between them, as in the compaction of Li and
//! Milenkovic (1995), whose linear program is replaced by projecting one such constraint after the other
//! (Müller et al. 2007).

use super::constants::TIGHTEN;
use super::contacts::{Contact, Near, Page, Shape, dot, least_gap};
use super::placement::{PackJob, Packed, Placement};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
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
    let shapes: Vec<Shape> =
        charts.par_iter().zip(placements).map(|(c, p)| Shape::new(&c.outline(), p, unit)).collect();
    ctx.check()?;
    let shape = job.page.map(|p| f64::from(p) / longer);
    let share = f64::from(job.padding) / longer;
    let page = |side: f64| Page { size: shape.map(|s| s * side), gap: (share * side).max(TIGHTEN.least_gap) };
    let mut side = TIGHTEN.units;
    let mut shifts = vec![[0.0; 2]; shapes.len()];
    let mut near = Near::find(&shapes, &shifts, page(side), ctx)?;
    let (mut step, mut halvings) = (TIGHTEN.step, 0);
    // No step may bring charts through each other. Two charts come nearer by at most the step's share of the
    // distance of their middles, and that distance is at most the page's diagonal.
    let slow = TIGHTEN.slow / shape[0].hypot(shape[1]);
    let mut least = least_gap(&near.contacts(&shapes, &shifts, page(side), ctx)?, page(side));
    for _ in 0..TIGHTEN.tries {
        step = step.min(slow * least);
        let target = side - step;
        // Towards the corner: what lies between two charts shrinks in proportion to how far apart they are.
        let pull = step / side;
        let mut next: Vec<[f64; 2]> = (shapes.iter().zip(&shifts))
            .map(|(s, d)| [0, 1].map(|k| d[k] - pull * (0.5 * (s.lo[k] + s.hi[k]) + d[k])))
            .collect();
        if let Some(gap) = separate(&shapes, &mut next, page(target), &mut near, ctx)? {
            (shifts, side, least) = (next, target, gap);
        } else if halvings == TIGHTEN.halvings {
            break;
        } else {
            (step, halvings) = (0.5 * step, halvings + 1);
        }
    }
    if side == TIGHTEN.units {
        return Ok(None);
    }
    let moved = (placements.iter().zip(&shifts))
        .map(|(p, d)| Placement { shift: [0, 1].map(|k| p.shift[k] + d[k] * unit), ..*p })
        .collect();
    Ok(Some(Packed { placements: moved, density: density * TIGHTEN.units / side, padding: *padding }))
}

/// Shifts charts until all are apart and on the page. Gives their least distance; `None` where that was not
/// possible.
fn separate(
    shapes: &[Shape],
    shifts: &mut [[f64; 2]],
    page: Page,
    near: &mut Near,
    ctx: &Context<'_>,
) -> Result<Option<f64>> {
    let too_large = |s: &Shape| (0..2).any(|k| s.hi[k] - s.lo[k] + 2.0 * page.gap > page.size[k]);
    if shapes.iter().any(too_large) {
        return Ok(None);
    }
    let mut last = f64::INFINITY;
    for round in 0..TIGHTEN.rounds {
        ctx.check()?;
        if !near.holds(shapes, shifts, page) {
            *near = Near::find(shapes, shifts, page, ctx)?;
        }
        let contacts = near.contacts(shapes, shifts, page, ctx)?;
        let least = least_gap(&contacts, page);
        let off_page = |(s, d): (&Shape, &[f64; 2])| {
            let beyond = |k: usize| (-s.lo[k] - d[k]).max(s.hi[k] + d[k] - page.size[k]);
            page.gap + beyond(0).max(beyond(1))
        };
        let lack = (shapes.iter().zip(shifts.iter())).map(off_page).fold(page.gap - least, f64::max);
        if lack <= TIGHTEN.tolerance {
            return Ok(Some(least));
        }
        if round + 1 == TIGHTEN.rounds
            || least < TIGHTEN.touching * page.gap
            || round >= TIGHTEN.patience && lack > TIGHTEN.progress * last
        {
            return Ok(None);
        }
        last = lack;

        let more = project(&contacts, shapes, shifts, page);
        let most = TIGHTEN.apart * least;
        for (d, m) in shifts.iter_mut().zip(&more) {
            let part = (most / dot(*m, *m).sqrt()).min(1.0);
            *d = [d[0] + part * m[0], d[1] + part * m[1]];
        }
    }
    Ok(None)
}

/// Shifts that satisfy the contacts and keep to the page, as far as some passes go.
fn project(contacts: &[Contact], shapes: &[Shape], shifts: &[[f64; 2]], page: Page) -> Vec<[f64; 2]> {
    let mut more = vec![[0.0; 2]; shapes.len()];
    for _ in 0..TIGHTEN.passes {
        let mut worst: f64 = 0.0;
        for c in contacts {
            let (a, b) = (c.a as usize, c.b as usize);
            let apart = dot(c.normal, [more[a][0] - more[b][0], more[a][1] - more[b][1]]);
            let lack = page.gap + TIGHTEN.tolerance - c.gap - apart;
            if lack > 0.0 {
                worst = worst.max(lack);
                for k in 0..2 {
                    more[a][k] += 0.5 * lack * c.normal[k];
                    more[b][k] -= 0.5 * lack * c.normal[k];
                }
            }
        }
        for (i, s) in shapes.iter().enumerate() {
            for k in 0..2 {
                let at = shifts[i][k] + more[i][k];
                let low = page.gap - (s.lo[k] + at);
                let high = s.hi[k] + at - (page.size[k] - page.gap);
                if low > 0.0 {
                    more[i][k] += low;
                } else if high > 0.0 {
                    more[i][k] -= high;
                }
                worst = worst.max(low).max(high);
            }
        }
        if worst < 0.5 * TIGHTEN.tolerance {
            break;
        }
    }
    more
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use crate::unwrap::Packer;
    use crate::unwrap::pack::Packing;
    use proptest::prelude::*;

    const PADDING: u32 = 4;

    fn rectangle([w, h]: [f64; 2]) -> Chart {
        Chart {
            faces: vec![0, 1],
            tris: vec![[0, 1, 2], [0, 2, 3]],
            uv: vec![[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]],
            border: vec![(0, 0), (0, 1), (1, 1), (1, 2)],
            area: w * h,
            ..Chart::default()
        }
    }

    /// Rectangles at corners on a page of some side; the corners afterwards, and the side.
    fn tightened(boxes: &[([f64; 2], [f64; 2])], side: f64) -> Option<(Vec<[f64; 2]>, f64)> {
        let charts: Vec<Chart> = boxes.iter().map(|b| rectangle(b.1)).collect();
        let placements: Vec<Placement> =
            boxes.iter().map(|b| Placement { shift: b.0, ..Placement::default() }).collect();
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
        let run = |ctx: &Context<'_>| tighten(&charts, &packed, &job, ctx);
        let Packed { placements, density, .. } = Run::default().execute(run).expect("nothing cancels")?;
        Some((placements.iter().map(|p| p.shift).collect(), 1024.0 / density))
    }

    #[test]
    fn three_squares_in_a_row_end_with_the_padding_between_them() {
        let boxes = [0.05, 1.12, 2.2].map(|x| ([x, 0.1], [1.0; 2]));
        let (at, side) = tightened(&boxes, 3.3).expect("there is room");
        let least = 3.0 / (1.0 - 4.0 * f64::from(PADDING) / 1024.0);
        assert!((least - 1e-3..1.005 * least).contains(&side), "{side} for {least}");
        let gap = f64::from(PADDING) / 1024.0 * side;
        for pair in at.windows(2) {
            assert!(pair[1][0] - pair[0][0] - 1.0 > 0.98 * gap, "{at:?}");
        }
    }

    #[test]
    fn a_page_without_room_stays_as_it_is() {
        let gap = f64::from(PADDING) / 1024.0;
        assert_eq!(tightened(&[([gap; 2], [1.0 - 2.0 * gap; 2])], 1.0), None);
    }

    proptest! {
        #[test]
        fn charts_keep_their_padding_and_stay_on_the_page(
            sizes in prop::collection::vec((0.05..0.2f64, 0.05..0.2f64, 0.0..1.0f64, 0.0..1.0f64), 16)
        ) {
            let boxes: Vec<_> = (sizes.iter().enumerate())
                .map(|(i, &(w, h, x, y))| {
                    let room = |size: f64| 0.25 - 0.02 - size;
                    let at = |k: usize, part: f64, size: f64| 0.25 * k as f64 + 0.01 + part * room(size);
                    ([at(i % 4, x, w), at(i / 4, y, h)], [w, h])
                })
                .collect();
            if let Some((at, side)) = tightened(&boxes, 1.0) {
                prop_assert!(side < 1.0);
                let least = 0.98 * f64::from(PADDING) / 1024.0 * side;
                for (i, (p, b)) in at.iter().zip(&boxes).enumerate() {
                    for k in 0..2 {
                        prop_assert!(p[k] > least && p[k] + b.1[k] < side - least);
                    }
                    for (q, c) in at[..i].iter().zip(&boxes) {
                        let apart = [0, 1].map(|k| (q[k] - p[k] - b.1[k]).max(p[k] - q[k] - c.1[k]).max(0.0));
                        prop_assert!(apart[0].hypot(apart[1]) > least, "{apart:?}");
                    }
                }
            }
        }
    }
}
