//! Packing by bounding boxes, in rows.

use super::mask::{bounds, rotated};
use super::{Goal, Place};
use crate::unwrap::chart::Chart;

/// A chart's upright bounding box.
fn upright_box(c: &Chart, r: [f64; 2]) -> [[f64; 2]; 2] {
    let (lo, hi) = bounds(&rotated(&c.outline(), r));
    [lo, hi]
}

/// One page of rows of bounding boxes.
pub(super) fn one_page_of_boxes(charts: &[Chart], upright: &[[f64; 2]], goal: &Goal) -> (Vec<Place>, f64) {
    let boxes: Vec<[[f64; 2]; 2]> = charts.iter().zip(upright).map(|(c, &r)| upright_box(c, r)).collect();
    let padded: f64 = charts.iter().map(|c| c.area).sum::<f64>();
    let mut density = (f64::from(goal.page[0]) * f64::from(goal.page[1]) / padded).sqrt();
    loop {
        if let Some(places) = shelves(&boxes, upright, goal, density) {
            return (places, density);
        }
        density *= 0.99;
    }
}

/// Places the charts at a density on at most as many pages as allowed, in rows.
pub(super) fn fill_boxes(
    charts: &[Chart],
    upright: &[[f64; 2]],
    goal: &Goal,
    density: f64,
) -> Option<Vec<Place>> {
    let boxes: Vec<[[f64; 2]; 2]> = charts.iter().zip(upright).map(|(c, &r)| upright_box(c, r)).collect();
    shelves(&boxes, upright, goal, density)
}

/// Rows of bounding boxes, highest first.
fn shelves(boxes: &[[[f64; 2]; 2]], upright: &[[f64; 2]], goal: &Goal, density: f64) -> Option<Vec<Place>> {
    let [width, height] = goal.page.map(|p| f64::from(p) / density);
    let gap = f64::from(goal.padding.max(1)) / density;
    let size = |c: usize| [0, 1].map(|k| boxes[c][1][k] - boxes[c][0][k]);
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| size(b)[1].total_cmp(&size(a)[1]).then(a.cmp(&b)));
    let (mut page, mut x, mut y, mut row) = (0, gap, gap, 0f64);
    let mut out = vec![Place::default(); boxes.len()];
    for c in order {
        let [w, h] = size(c);
        if x + w + gap > width {
            (x, y, row) = (gap, y + row + gap, 0.0);
        }
        if y + h + gap > height {
            (page, x, y, row) = (page + 1, gap, gap, 0.0);
        }
        if page == goal.pages || x + w + gap > width || y + h + gap > height {
            return None;
        }
        out[c] = Place {
            page,
            rotation: upright[c],
            shift: [x - boxes[c][0][0], y - boxes[c][0][1]],
            ..Place::default()
        };
        x += w + gap;
        row = row.max(h);
    }
    Some(out)
}
