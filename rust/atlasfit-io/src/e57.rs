//! E57 (ASTM E2807), through the `e57` crate: all scans of a file, each moved by its pose, one after the
//! other.
//!
//! Read: positions (spherical ones converted), colours, intensity in [0, 1], and the number of the scan as
//! `scan_id` where there are several, and where the scanners stood, as their poses say. Points that a scan
//! marks as invalid are left out and counted.

use crate::content::Content;
use crate::error::Result;
use crate::input::Input;

/// Whether these bytes are an E57 file.
pub(crate) fn is_e57(data: &[u8]) -> bool {
    data.starts_with(b"ASTM-E57")
}

#[cfg(not(feature = "e57"))]
pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    Err(input.unsupported(
        "this is E57, which this build does not read",
        "Build with the feature \"e57\", or convert it to PLY",
    ))
}

#[cfg(feature = "e57")]
pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    use crate::error::Location;
    match crate::foreign::guarded(|| scans(input)) {
        Some(result) => result,
        None => Err(input.malformed(
            Location::Whole,
            "data that cannot be read",
            "the points that the file describes",
            "The file is damaged: get it again",
        )),
    }
}

/// The number of the scanner that made a scan, whose position is added; `u32::MAX` where it is not known.
/// Programs that merge scans write a pose that moves nothing: it says nothing of a scanner.
#[cfg(feature = "e57")]
fn scanner_of(scan: &e57::PointCloud, positions: &mut Vec<[f64; 3]>) -> u32 {
    let pose = scan.transform.as_ref().map(|t| [t.translation.x, t.translation.y, t.translation.z]);
    let Some(at) = pose.filter(|at| *at != [0.0; 3]) else { return u32::MAX };
    positions.push(at);
    positions.len() as u32 - 1
}

#[cfg(feature = "e57")]
fn scans(input: &mut Input<'_>) -> Result<Content> {
    use crate::error::Location;
    use atlasfit::geometry::{Attribute, ScalarKind, Scanners};
    use e57::{CartesianCoordinate, E57Reader};
    let damaged = |input: &Input<'_>, e: e57::Error| {
        input.malformed(
            Location::Whole,
            e.to_string(),
            "an E57 file",
            "The file is cut off or damaged: get it again",
        )
    };
    let mut reader = E57Reader::new(std::io::Cursor::new(input.data)).map_err(|e| damaged(input, e))?;
    let scans = reader.pointclouds();
    // A column of equal numbers costs no bytes in E57, but a whole point without any is no measurement.
    const POINTS_PER_BYTE: u64 = 64;
    let announced = scans.iter().fold(0u64, |sum, s| sum.saturating_add(s.records));
    if announced / POINTS_PER_BYTE > input.data.len() as u64 {
        return Err(input.malformed(
            Location::Whole,
            format!("{announced} points announced in {} bytes", input.data.len()),
            "a file that could hold them",
            "The file is damaged: get it again",
        ));
    }
    let mut out = Content::default();
    let mut colors: Vec<[f32; 4]> = Vec::new();
    let mut intensity: Vec<f64> = Vec::new();
    let mut scan_id: Vec<f64> = Vec::new();
    let mut scanners = Scanners::default();
    let (mut has_color, mut has_intensity, mut invalid, mut colorless) = (false, false, 0u64, 0u64);
    for (id, scan) in scans.iter().enumerate() {
        let scanner = scanner_of(scan, &mut scanners.positions);
        has_color |= scan.has_color();
        has_intensity |= scan.has_intensity();
        let mut points = match reader.pointcloud_simple(scan) {
            Ok(p) => p,
            Err(e) => return Err(damaged(input, e)),
        };
        points.intensity_to_color(false);
        for point in input.watched(points) {
            let point = match point {
                Ok(p) => p,
                Err(e) if out.cloud.positions.is_empty() => return Err(damaged(input, e)),
                Err(e) => {
                    input.report.add(format!("scans that end early ({e})"), 1, Some(format!("scan {id}")));
                    break;
                }
            };
            let CartesianCoordinate::Valid { x, y, z } = point.cartesian else {
                invalid += 1;
                continue;
            };
            input.reserve(1, 60)?;
            out.cloud.positions.push([x, y, z]);
            let c = point.color.map(|c| [c.red, c.green, c.blue, 1.0]);
            colorless += u64::from(c.is_none());
            colors.push(c.unwrap_or([1.0; 4]));
            intensity.push(f64::from(point.intensity.unwrap_or(0.0)));
            scan_id.push(id as f64);
            scanners.of_point.push(scanner);
        }
    }
    input.report.add("points marked as invalid by the scanner, left out", invalid, None);
    if has_color {
        input.report.add("points without a colour among coloured ones, made white", colorless, None);
        out.cloud.colors = Some(colors);
    }
    if has_intensity {
        let name = "intensity".into();
        out.cloud.attributes.push(Attribute { name, width: 1, kind: ScalarKind::F32, values: intensity });
    }
    out.cloud.scanners = (!scanners.positions.is_empty()).then_some(scanners);
    if scans.len() > 1 {
        let name = "scan_id".into();
        out.cloud.attributes.push(Attribute { name, width: 1, kind: ScalarKind::U32, values: scan_id });
    }
    Ok(out)
}
