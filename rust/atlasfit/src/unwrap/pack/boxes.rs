//! Packing by bounding boxes, in rows.

use super::placement::{PackJob, Packed, Placement};
use crate::unwrap::chart::Chart;
use crate::unwrap::planar::{bounds, rotated};

/// Factor on the density until the boxes fit.
const LESS: f64 = 0.99;

/// A chart's upright bounding box.
fn upright_box(c: &Chart, r: [f64; 2]) -> [[f64; 2]; 2] {
    let (lo, hi) = bounds(&rotated(&c.outline(), r));
    [lo, hi]
}

/// One page of rows of bounding boxes.
pub(crate) fn one_page_of_boxes(charts: &[Chart], upright: &[[f64; 2]], job: &PackJob<'_>) -> Packed {
    let boxes: Vec<[[f64; 2]; 2]> = charts.iter().zip(upright).map(|(c, &r)| upright_box(c, r)).collect();
    let padded: f64 = charts.iter().map(|c| c.area).sum::<f64>();
    let mut density = (f64::from(job.page[0]) * f64::from(job.page[1]) / padded).sqrt();
    loop {
        if let Some(placements) = shelves(&boxes, upright, job, density) {
            return Packed { placements, density };
        }
        density *= LESS;
    }
}

/// Places the charts at a density on at most as many pages as allowed, in rows.
pub(crate) fn fill_boxes(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    density: f64,
) -> Option<Vec<Placement>> {
    let boxes: Vec<[[f64; 2]; 2]> = charts.iter().zip(upright).map(|(c, &r)| upright_box(c, r)).collect();
    shelves(&boxes, upright, job, density)
}

/// Rows of bounding boxes, highest first.
fn shelves(
    boxes: &[[[f64; 2]; 2]],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    density: f64,
) -> Option<Vec<Placement>> {
    let [width, height] = job.page.map(|p| f64::from(p) / density);
    let gap = f64::from(job.padding.max(1)) / density;
    let size = |c: usize| [0, 1].map(|k| boxes[c][1][k] - boxes[c][0][k]);
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| size(b)[1].total_cmp(&size(a)[1]).then(a.cmp(&b)));
    let (mut page, mut x, mut y, mut row) = (0, gap, gap, 0f64);
    let mut out = vec![Placement::default(); boxes.len()];
    for c in order {
        let [w, h] = size(c);
        if x + w + gap > width {
            (x, y, row) = (gap, y + row + gap, 0.0);
        }
        if y + h + gap > height {
            (page, x, y, row) = (page + 1, gap, gap, 0.0);
        }
        if page == job.pages || x + w + gap > width || y + h + gap > height {
            return None;
        }
        out[c] = Placement {
            page,
            rotation: upright[c],
            shift: [x - boxes[c][0][0], y - boxes[c][0][1]],
            ..Placement::default()
        };
        x += w + gap;
        row = row.max(h);
    }
    Some(out)
}
