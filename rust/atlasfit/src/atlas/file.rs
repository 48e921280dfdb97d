//! An atlas as bytes, and back: a safetensors file, readable from any language.
//!
//! In: an [`Atlas`], or bytes from anywhere. Out: bytes that are the same for the same atlas, or a checked
//! atlas. Bytes are not trusted: whatever does not make a sound atlas is [`Error::BadFile`], and nothing is
//! allocated beyond a small multiple of what was given.
//!
//! The tensors, for n charts of which s are sheets and t tubes, in the charts' order:
//!
//! | name | type, shape | content |
//! |---|---|---|
//! | `frame` | f64, 4 | origin of the normalised frame in the user's, length of its unit |
//! | `kind` | u8, n | 0 = sheet, 1 = tube |
//! | `chart` | f64, n × 3 | sigma, sign, support |
//! | `sheet.base` | f64, s × 14 | centre, three axes, two radii |
//! | `sheet.coeffs` | f32, s × COEFFS | spline coefficients of the height |
//! | `sheet.mask` | u8, s × 81 | trim mask |
//! | `sheet.trimmed` | u32, s × 32 | squares of the domain without surface, a bit each; optional |
//! | `tube.base` | f64, t × 22 | centre, three axes, half length, axis offsets (two cubics), mean radius |
//! | `tube.radius` | f32, t × (nodes · harmonics) | spline coefficients of the radius |
//! | `tube.mask` | u8, t × 65 | trim mask |
//!
//! The metadata hold `atlasfit-atlas`: the format's version.

use crate::atlas::mask::{self, Mask, SQUARES, Trimmed};
use crate::atlas::query::Atlas;
use crate::atlas::tube::{HARMONICS, MASK_NODES};
use crate::atlas::{Chart, Map, Monge, Tube};
use crate::error::{Error, Result};
use crate::numeric::spline;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::collections::HashMap;

/// Key and value of the metadata.
const VERSION: (&str, &str) = ("atlasfit-atlas", "1");
/// Numbers per row of each tensor.
const FRAME: usize = 4;
const CHART: usize = 3;
const SHEET: usize = 14;
const SHEET_MASK: usize = mask::SIDE * mask::SIDE;
const TUBE: usize = 22;
const TUBE_RADIUS: usize = spline::SIDE * HARMONICS;
/// Lengths in the normalised frame are about 1; those of a scan's farthest strays are far below this.
const LARGEST: f64 = 1e6;
/// Lengths in the user's frame: far enough from overflow that squares are finite.
const LARGEST_OUTSIDE: f64 = 1e100;
/// Axes are orthonormal to this, being written without rounding.
const ORTHONORMAL: f64 = 1e-6;

fn bad(what: impl Into<String>) -> Error {
    Error::BadFile {
        what: what.into(),
        advice: "Give the bytes that saving an atlas made, with a version of atlasfit that reads them".into(),
    }
}

/// The atlas as bytes.
///
/// # Errors
/// [`Error::Internal`] where the format refuses, which it does for no atlas.
pub fn to_bytes(atlas: &Atlas) -> Result<Vec<u8>> {
    let charts = atlas.charts();
    let f64s =
        |numbers: &mut dyn Iterator<Item = f64>| numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let f32s =
        |numbers: &mut dyn Iterator<Item = f32>| numbers.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let sheets = || {
        charts.iter().filter_map(|c| match &c.map {
            Map::Monge(m) => Some(m),
            Map::Tube(_) => None,
        })
    };
    let tubes = || {
        charts.iter().filter_map(|c| match &c.map {
            Map::Tube(t) => Some(t),
            Map::Monge(_) => None,
        })
    };
    let (n, s, t) = (charts.len(), sheets().count(), tubes().count());
    let frame = f64s(&mut atlas.origin().into_iter().chain([atlas.unit()]));
    let kind: Vec<u8> = charts.iter().map(|c| u8::from(matches!(c.map, Map::Tube(_)))).collect();
    let chart = f64s(&mut charts.iter().flat_map(|c| [c.sigma, c.sign, c.support]));
    let sheet_base = f64s(
        &mut sheets()
            .flat_map(|m| m.center.0.into_iter().chain(m.axes.into_iter().flat_map(|a| a.0)).chain(m.radii)),
    );
    let sheet_coeffs = f32s(&mut sheets().flat_map(|m| m.coeffs.iter().copied()));
    let sheet_mask: Vec<u8> = sheets().flat_map(|m| m.mask.nodes.iter().copied()).collect();
    let untrimmed = [0; SQUARES];
    let rows = sheets().flat_map(|m| m.mask.trimmed.as_deref().unwrap_or(&untrimmed));
    let sheet_trimmed: Vec<u8> = rows.flat_map(|row| row.to_le_bytes()).collect();
    let tube_base = f64s(&mut tubes().flat_map(|t| {
        let axis = t.axis.into_iter().flatten();
        t.center
            .into_iter()
            .chain(t.axes.into_iter().flat_map(|a| a.0))
            .chain([t.half_length])
            .chain(axis)
            .chain([t.mean_radius])
    }));
    let tube_radius = f32s(&mut tubes().flat_map(|t| t.radius.iter().flatten().copied()));
    let tube_mask: Vec<u8> = tubes().flat_map(|t| t.mask.iter().copied()).collect();
    let tensors = [
        ("frame", Dtype::F64, vec![FRAME], &frame),
        ("kind", Dtype::U8, vec![n], &kind),
        ("chart", Dtype::F64, vec![n, CHART], &chart),
        ("sheet.base", Dtype::F64, vec![s, SHEET], &sheet_base),
        ("sheet.coeffs", Dtype::F32, vec![s, spline::COEFFS], &sheet_coeffs),
        ("sheet.mask", Dtype::U8, vec![s, SHEET_MASK], &sheet_mask),
        ("sheet.trimmed", Dtype::U32, vec![s, SQUARES], &sheet_trimmed),
        ("tube.base", Dtype::F64, vec![t, TUBE], &tube_base),
        ("tube.radius", Dtype::F32, vec![t, TUBE_RADIUS], &tube_radius),
        ("tube.mask", Dtype::U8, vec![t, MASK_NODES], &tube_mask),
    ];
    let refused =
        |e: safetensors::SafeTensorError| Error::internal(format!("an atlas cannot be written: {e}"));
    let views = tensors
        .iter()
        .map(|(name, kind, shape, bytes)| Ok((*name, TensorView::new(*kind, shape.clone(), bytes)?)))
        .collect::<std::result::Result<Vec<_>, _>>()
        .map_err(refused)?;
    // One entry: a map of several would be written in an order of its own.
    let about = HashMap::from([(VERSION.0.to_owned(), VERSION.1.to_owned())]);
    safetensors::serialize(views, Some(about)).map_err(refused)
}

/// The atlas that bytes hold.
///
/// # Errors
/// [`Error::BadFile`] for bytes that are no sound atlas or one of another version; cancel and time limit.
pub fn from_bytes(bytes: &[u8], ctx: &Context<'_>) -> Result<Atlas> {
    let (_, header) =
        SafeTensors::read_metadata(bytes).map_err(|e| bad(format!("no safetensors file: {e}")))?;
    match header.metadata().as_ref().and_then(|m| m.get(VERSION.0)) {
        None => return Err(bad("a safetensors file, but no atlas")),
        Some(v) if v != VERSION.1 => {
            return Err(bad(format!("an atlas of format version {v:?}; this library reads {}", VERSION.1)));
        }
        Some(_) => {}
    }
    let file = SafeTensors::deserialize(bytes).map_err(|e| bad(format!("no safetensors file: {e}")))?;
    let tensor = |name: &str, kind: Dtype, width: usize| -> Result<(&[u8], usize)> {
        let t = file.tensor(name).map_err(|e| bad(format!("{name}: {e}")))?;
        let rows = match *t.shape() {
            [rows] if width == 1 => rows,
            [rows, w] if w == width => rows,
            _ => return Err(bad(format!("{name}: the shape is {:?}, not rows of {width}", t.shape()))),
        };
        if t.dtype() != kind {
            return Err(bad(format!("{name}: the type is {:?}, not {kind:?}", t.dtype())));
        }
        Ok((t.data(), rows))
    };
    let (frame, four) = tensor("frame", Dtype::F64, 1)?;
    let (kind, n) = tensor("kind", Dtype::U8, 1)?;
    let (chart, rows) = tensor("chart", Dtype::F64, CHART)?;
    let (sheet_base, s) = tensor("sheet.base", Dtype::F64, SHEET)?;
    let (sheet_coeffs, s1) = tensor("sheet.coeffs", Dtype::F32, spline::COEFFS)?;
    let (sheet_mask, s2) = tensor("sheet.mask", Dtype::U8, SHEET_MASK)?;
    // Older files know nothing of it.
    let has_trimmed = file.names().contains(&"sheet.trimmed");
    let sheet_trimmed = has_trimmed.then(|| tensor("sheet.trimmed", Dtype::U32, SQUARES)).transpose()?;
    let (tube_base, t) = tensor("tube.base", Dtype::F64, TUBE)?;
    let (tube_radius, t1) = tensor("tube.radius", Dtype::F32, TUBE_RADIUS)?;
    let (tube_mask, t2) = tensor("tube.mask", Dtype::U8, MASK_NODES)?;
    if let Some(i) = kind.iter().position(|k| *k > 1) {
        return Err(bad(format!("chart {i} is of kind {}, which this version does not know", kind[i])));
    }
    let tube_count = kind.iter().filter(|k| **k == 1).count();
    let counts = four == FRAME
        && rows == n
        && [s, s1, s2, sheet_trimmed.map_or(s, |t| t.1)] == [n - tube_count; 4]
        && [t, t1, t2] == [tube_count; 3];
    if n == 0 || !counts {
        return Err(bad(format!("{n} charts, {tube_count} of them tubes, but tensors of other lengths")));
    }
    let frame: [f64; FRAME] = row(frame, 0);
    if !frame.iter().all(|x| x.abs() <= LARGEST_OUTSIDE) || frame[3] < 1.0 / LARGEST_OUTSIDE {
        return Err(bad(format!("the frame is {frame:?}")));
    }
    let mut charts = Vec::with_capacity(n);
    let (mut sheet, mut tube) = (0, 0);
    for (i, k) in kind.iter().enumerate() {
        if i % 1024 == 0 {
            ctx.check()?;
        }
        let unsound = |what: &str| bad(format!("chart {i}: {what}"));
        let [sigma, sign, support]: [f64; CHART] = row(chart, i);
        if !((0.0..=LARGEST).contains(&sigma) && sign.abs() == 1.0 && support >= 0.0 && support.is_finite()) {
            return Err(unsound("sigma, sign or support is out of range"));
        }
        let map = if *k == 0 {
            let mask = Mask {
                trimmed: sheet_trimmed.and_then(|t| row_trimmed(t.0, sheet)),
                ..Mask::of_nodes(row_u8(sheet_mask, sheet))
            };
            let map = read_sheet(row(sheet_base, sheet), singles(sheet_coeffs, sheet), mask);
            sheet += 1;
            map.map(Map::Monge).map_err(unsound)?
        } else {
            let mask = Box::new(row_u8(tube_mask, tube));
            let map = read_tube(row(tube_base, tube), singles(tube_radius, tube), mask);
            tube += 1;
            map.map(Map::Tube).map_err(unsound)?
        };
        charts.push(Chart { map, sigma, sign, support });
    }
    Atlas::new(charts, Vec3([frame[0], frame[1], frame[2]]), frame[3], ctx)
}

/// A patch from its row of numbers, or what is wrong with it. `coeffs` is none where one is out of range.
fn read_sheet(
    base: [f64; SHEET],
    coeffs: Option<[f32; spline::COEFFS]>,
    mask: Mask,
) -> std::result::Result<Monge, &'static str> {
    let (center, axes) = frame_of(&base).ok_or("the frame is not orthonormal")?;
    let radii = [base[12], base[13]];
    if !radii.iter().all(|r| (1.0 / LARGEST..=LARGEST).contains(r)) {
        return Err("a radius is out of range");
    }
    let coeffs = Box::new(coeffs.ok_or("a coefficient is out of range")?);
    Ok(Monge { center, axes, radii, coeffs, mask })
}

/// A tube from its row of numbers, or what is wrong with it. `radius` is none where one is out of range.
fn read_tube(
    base: [f64; TUBE],
    radius: Option<[f32; TUBE_RADIUS]>,
    mask: Box<[u8; MASK_NODES]>,
) -> std::result::Result<Tube, &'static str> {
    let (center, axes) = frame_of(&base).ok_or("the frame is not orthonormal")?;
    let (half_length, mean_radius) = (base[12], base[21]);
    let axis = [0, 1].map(|k| std::array::from_fn(|j| base[13 + 4 * k + j]));
    let lengths = [half_length, mean_radius].iter().all(|r| (1.0 / LARGEST..=LARGEST).contains(r));
    if !lengths || !axis.as_flattened().iter().all(|x: &f64| x.abs() <= LARGEST) {
        return Err("its axis or radius is out of range");
    }
    let flat = radius.ok_or("a coefficient is out of range")?;
    let mut radius = Box::new([[0f32; HARMONICS]; spline::SIDE]);
    radius.as_flattened_mut().copy_from_slice(&flat);
    Ok(Tube { center, axes, half_length, axis, mean_radius, radius, mask })
}

/// A row of doubles; the caller has checked the tensor's shape, and safetensors its length.
fn row<const N: usize>(bytes: &[u8], index: usize) -> [f64; N] {
    let at = &bytes[8 * N * index..];
    std::array::from_fn(|k| f64::from_le_bytes(std::array::from_fn(|b| at[8 * k + b])))
}

/// What is trimmed of a sheet, if anything.
fn row_trimmed(bytes: &[u8], index: usize) -> Option<Box<Trimmed>> {
    let at = &bytes[4 * SQUARES * index..];
    let rows: Trimmed = std::array::from_fn(|k| u32::from_le_bytes(std::array::from_fn(|b| at[4 * k + b])));
    (rows != [0; SQUARES]).then(|| Box::new(rows))
}

fn row_u8<const N: usize>(bytes: &[u8], index: usize) -> [u8; N] {
    std::array::from_fn(|k| bytes[N * index + k])
}

/// A row of singles; `None` where one is not finite or too large.
fn singles<const N: usize>(bytes: &[u8], index: usize) -> Option<[f32; N]> {
    let at = &bytes[4 * N * index..];
    let all: [f32; N] = std::array::from_fn(|k| f32::from_le_bytes(std::array::from_fn(|b| at[4 * k + b])));
    all.iter().all(|x| f64::from(x.abs()) <= LARGEST).then_some(all)
}

/// Centre and axes of a chart's base; `None` where they are no right-handed frame.
fn frame_of(base: &[f64]) -> Option<(Vec3, [Vec3; 3])> {
    let at = |k: usize| Vec3([base[k], base[k + 1], base[k + 2]]);
    let (center, axes) = (at(0), [at(3), at(6), at(9)]);
    let unit = axes.iter().all(|a| (a.norm2() - 1.0).abs() <= ORTHONORMAL);
    let right = axes[0].cross(axes[1]).dist2(axes[2]) <= ORTHONORMAL * ORTHONORMAL;
    let near = center.iter().all(|x| x.abs() <= LARGEST);
    (unit && right && near).then_some((center, axes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::atlas::FittedChart;

    #[test]
    fn what_was_trimmed_is_kept_and_older_files_know_nothing_of_it() {
        let mut chart = FittedChart::flat(0.5, 0.01, 0..1).chart;
        let rows: Trimmed = std::array::from_fn(|k| 1 << k);
        if let Map::Monge(map) = &mut chart.map {
            map.mask.trimmed = Some(Box::new(rows));
        }
        let read = |bytes: &[u8]| Run::default().execute(|ctx| from_bytes(bytes, ctx)).unwrap();
        let atlas =
            Run::default().execute(|ctx| Atlas::new(vec![chart.clone()], Vec3::ZERO, 1.0, ctx)).unwrap();
        let bytes = to_bytes(&atlas).unwrap();
        assert_eq!(read(&bytes).charts(), [chart.clone()]);
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let older = file.tensors().into_iter().filter(|(name, _)| name != "sheet.trimmed");
        let about = HashMap::from([(VERSION.0.to_owned(), VERSION.1.to_owned())]);
        let older = safetensors::serialize(older, Some(about)).unwrap();
        if let Map::Monge(map) = &mut chart.map {
            map.mask.trimmed = None;
        }
        assert_eq!(read(&older).charts(), [chart]);
    }
}
