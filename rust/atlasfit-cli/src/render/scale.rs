//! Numbers as colours: vertices in the colours of an attribute, and the legend that says which is which.
//!
//! In: a mesh with the attribute. Out: its vertices' colours, and a scale; a picture with its legend.

use crate::render::color::{Rgb, eight_bits, mix};
use crate::render::font::{FONT, fonts};
use crate::render::style::Picture;
use anyhow::{Result, anyhow};
use atlasfit::Error;
use atlasfit::geometry::{Attribute, TriMesh};
use atlasfit::pipeline::{EXTRAPOLATED, OUTLIER_PROBABILITY};
use plotters::prelude::*;

/// From little to much: dark blue, green, yellow (viridis, van der Walt and Smith 2015).
const RISING: [Rgb; 5] = [
    [0.267, 0.005, 0.329],
    [0.229, 0.322, 0.545],
    [0.128, 0.567, 0.551],
    [0.369, 0.789, 0.383],
    [0.993, 0.906, 0.144],
];
/// From below zero to above: blue, white, red (ColorBrewer's RdBu).
const SIGNED: [Rgb; 5] =
    [[0.02, 0.19, 0.38], [0.26, 0.58, 0.76], [0.97, 0.97, 0.97], [0.84, 0.38, 0.30], [0.40, 0.0, 0.12]];
/// Where there is no number, or no data.
const NOTHING: Rgb = [0.62, 0.62, 0.62];
/// The share of the numbers that the scale holds; those beyond have its last colour.
const SHARE: f64 = 0.98;

/// What the colours mean.
pub struct Scale {
    name: String,
    from: f64,
    to: f64,
    /// Whether some of the mesh has no number.
    nothing: bool,
}

impl Scale {
    /// A scale that holds most of the numbers: from zero, or to both sides of it where some are below.
    pub fn over(name: &str, values: &[f64]) -> Self {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted.get((share * sorted.len() as f64) as usize).or(sorted.last()).copied();
        let (low, high) = (at(1.0 - SHARE).unwrap_or(0.0), at(SHARE).unwrap_or(1.0));
        let (from, to) = if low < 0.0 {
            let most = high.max(-low);
            (-most, most)
        } else {
            (0.0, if high > 0.0 { high } else { 1.0 })
        };
        Self { name: name.to_owned(), from, to, nothing: sorted.len() < values.len() }
    }

    /// A scale between two numbers.
    pub fn between(name: &str, from: f64, to: f64) -> Self {
        Self { name: name.to_owned(), from, to, nothing: false }
    }

    /// The numbers at its ends.
    pub fn ends(&self) -> [f64; 2] {
        [self.from, self.to]
    }

    /// Its colours, evenly from one end to the other.
    pub fn colors(&self) -> &'static [Rgb; 5] {
        if self.from < 0.0 { &SIGNED } else { &RISING }
    }

    /// The colour of a number; grey where it is none.
    pub fn color(&self, value: f64) -> Rgb {
        if !value.is_finite() {
            return NOTHING;
        }
        let t = ((value - self.from) / (self.to - self.from).max(1e-300)).clamp(0.0, 1.0) as f32 * 4.0;
        let k = (t as usize).min(3);
        mix(self.colors()[k], self.colors()[k + 1], t - k as f32)
    }
}

/// The colours that an attribute gives the vertices: grey where they are extrapolated or outliers.
pub fn painted(mesh: &TriMesh, name: &str) -> atlasfit::Result<(Vec<[f32; 4]>, Scale)> {
    let of = |name: &str| mesh.attributes.iter().rfind(|a: &&Attribute| a.name.eq_ignore_ascii_case(name));
    let Some(column) = of(name).filter(|a| a.width == 1) else {
        return Err(Error::InvalidArgument {
            what: format!("the file has no attribute \"{name}\""),
            advice: "Denoise with --uncertainty and write .ply, or name another with --attribute".into(),
        });
    };
    let left_out = [EXTRAPOLATED, OUTLIER_PROBABILITY].map(of);
    let values: Vec<f64> = (column.values.iter().enumerate())
        .map(|(i, &v)| {
            let out = left_out.iter().flatten().any(|a| a.name != column.name && a.values[i] >= 1.0);
            if out { f64::NAN } else { v }
        })
        .collect();
    let scale = Scale::over(&column.name, &values);
    let painted = values.iter().map(|v| {
        let [r, g, b] = scale.color(*v);
        [r, g, b, 1.0]
    });
    Ok((painted.collect(), scale))
}

/// Draws the legend into the lower left of a picture.
pub fn legend(picture: &mut Picture, scale: &Scale) -> Result<()> {
    fonts()?;
    let failed = |e: &dyn std::fmt::Display| anyhow!("cannot draw the legend: {e}");
    let [width, height] = picture.size.map(|s| s as i32);
    let (long, thick, edge) = ((width / 3).max(60), (height / 50).max(8), (height / 40).max(6));
    let size = f64::from((height / 42).max(10));
    let area =
        BitMapBackend::with_buffer(&mut picture.rgb, (width as u32, height as u32)).into_drawing_area();
    let top = height - edge - thick - size as i32 - 4;
    let right = edge + long + if scale.nothing { 9 } else { 3 } * size as i32;
    let behind = [(0, top - size as i32 - 6), (right, height)];
    area.draw(&Rectangle::new(behind, WHITE.filled())).map_err(|e| failed(&e))?;
    let rgb = |c: Rgb| {
        let [r, g, b] = eight_bits(c);
        RGBColor(r, g, b)
    };
    for x in 0..long {
        let value = scale.from + (scale.to - scale.from) * f64::from(x) / f64::from(long - 1);
        let line = [(edge + x, top), (edge + x, top + thick)];
        area.draw(&PathElement::new(line.to_vec(), rgb(scale.color(value)))).map_err(|e| failed(&e))?;
    }
    let text = |words: &str, x: i32, y: i32| {
        area.draw_text(words, &(FONT, size).into_font().color(&BLACK), (x, y)).map_err(|e| failed(&e))
    };
    let below = top + thick + 3;
    text(&crate::number::short(scale.from), edge, below)?;
    let most = format!("{} and more", crate::number::short(scale.to));
    text(&most, edge + long - 3 * size as i32, below)?;
    text(&scale.name.replace('_', " "), edge, top - size as i32 - 3)?;
    if scale.nothing {
        let left = edge + long + 5 * size as i32;
        let square = [(left, top), (left + thick, top + thick)];
        area.draw(&Rectangle::new(square, rgb(NOTHING).filled())).map_err(|e| failed(&e))?;
        text("no data", left + thick + 4, top)?;
    }
    area.present().map_err(|e| failed(&e))
}
