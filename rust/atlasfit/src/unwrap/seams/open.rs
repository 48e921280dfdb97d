//! What a new cut would save, judged by what is near it.
//!
//! In: a layout and a path of edges to be cut. Out: what the mean energy comes to where only the faces about
//! the path give way.

use super::around::Around;
use super::constants::SEAMS;
use super::sheet::{Layout, Sheet, parted};
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::NONE;

/// The mean energy with a new cut; `None` where its sides cannot be drawn apart, or when the run is to stop.
pub(super) fn opened(sheet: &Sheet<'_>, now: &Layout, path: &[u32], ctx: &Context<'_>) -> Option<f64> {
    let mut around = Around::new(sheet, now, path);
    let before = around.energy(sheet.area);
    let mut place = vec![NONE; sheet.faces.len()];
    around.faces.iter().enumerate().for_each(|(i, &f)| place[f as usize] = i as u32);
    let across = |i: usize, _, k: usize| {
        let f = around.faces[i] as usize;
        let (g, e) = (sheet.across[f][k], sheet.edge[f][k]);
        (g != NONE && !now.cut[e as usize] && !path.contains(&e) && place[g as usize] != NONE)
            .then(|| place[g as usize])
    };
    let on_surface = around.faces.iter().map(|&f| sheet.faces[f as usize]).collect();
    let mut chart = Chart::glue(sheet.s, on_surface, across, ctx)?;
    // The number that each vertex had.
    let mut had = vec![[NONE; 2]; chart.vertices()];
    for (t, o) in chart.tris.iter().zip(&around.tris) {
        t.iter().zip(o).for_each(|(&v, &o)| had[v as usize] = [o, o]);
    }
    chart.uv = had.iter().map(|h| around.uv[h[0] as usize]).collect();
    // Edges between what is held and what is not are no border.
    chart.border.retain(|&(i, k)| {
        let (f, k) = (around.faces[i as usize] as usize, usize::from(k));
        let (g, e) = (sheet.across[f][k], sheet.edge[f][k]);
        g == NONE || now.cut[e as usize] || path.contains(&e)
    });
    let mut held: Vec<bool> = had.iter().map(|h| around.held[h[0] as usize]).collect();
    // What is outside keeps its number, after those of the new ones.
    let n = held.len() as u32;
    let mut number: Vec<u32> = (n..n + around.vertex.len() as u32).collect();
    for (v, h) in had.iter().enumerate().filter(|v| held[v.0]) {
        // What is held cannot be drawn apart.
        if number[h[0] as usize] < n {
            return None;
        }
        number[h[0] as usize] = v as u32;
    }
    if !parted(&mut chart, &had, ctx) {
        return None;
    }
    let ends = |&(i, k): &(u32, u8)| {
        let (t, k) = (chart.tris[i as usize], usize::from(k));
        ([t[k], t[(k + 1) % 3]], NONE)
    };
    let mut segments: Vec<([u32; 2], u32)> = chart.border.iter().map(ends).collect();
    segments.extend(around.segments[around.own..].iter().map(|s| (s.0.map(|v| number[v as usize]), s.1)));
    let old = std::mem::take(&mut around.uv);
    held.resize(held.len() + old.len(), true);
    chart.uv.extend(old);
    (around.tris, around.uv, around.held, around.segments) = (chart.tris, chart.uv, held, segments);
    if around.border().touches(&around.uv, ctx).ok()? {
        return None;
    }
    let energy = now.energy + around.relaxed(sheet.area, SEAMS.trial_steps, ctx)? - before;
    energy.is_finite().then_some(energy)
}
