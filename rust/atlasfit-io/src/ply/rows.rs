//! PLY row by row: where things stand.

use super::columns::{Target, named_targets};
use super::header::{self, Encoding};
use crate::bytes::{ColumnLayout, size};
use crate::error::Result;
use crate::input::Input;
use crate::row_layout::RowLayout;
use atlasfit::geometry::ScalarKind;

/// Where things stand; nothing where this is not rows of bytes that are points.
pub(crate) fn row_layout(input: &Input<'_>) -> Result<Option<RowLayout>> {
    let header = header::read(input)?;
    let [vertices] = &header.elements[..] else { return Ok(None) };
    let (Some(stride), true) = (vertices.stride(), vertices.name == "vertex") else { return Ok(None) };
    if header.encoding == Encoding::Ascii {
        return Ok(None);
    }
    let mut axes = [None; 3];
    let mut colors = [None; 3];
    let mut full = 1.0;
    let mut offset = 0;
    for (p, target) in vertices.properties.iter().zip(named_targets(&vertices.properties, false)) {
        let big_endian = header.encoding == Encoding::Big;
        let layout = ColumnLayout { stride, offset, kind: p.kind, big_endian };
        match target {
            Some(Target::Position(k)) => axes[k] = Some(layout),
            Some(Target::Color(k)) if k < 3 => {
                colors[k] = Some(layout);
                full = super::columns::color_scale(p.kind);
            }
            _ => {}
        }
        offset += size(p.kind);
    }
    let float = |l: &ColumnLayout| matches!(l.kind, ScalarKind::F32 | ScalarKind::F64);
    let [Some(x), Some(y), Some(z)] = axes else { return Ok(None) };
    // Whole numbers cannot hold where the points go.
    if ![x, y, z].iter().all(float) {
        return Ok(None);
    }
    let colors = match colors {
        [Some(r), Some(g), Some(b)] => Some(([r, g, b], full)),
        _ => None,
    };
    Ok(Some(RowLayout {
        start: header.end as u64,
        count: vertices.count,
        stride,
        axes: [x, y, z],
        scale: [1.0; 3],
        offset: [0.0; 3],
        colors,
        crs: None,
        packing: None,
    }))
}
