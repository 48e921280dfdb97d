//! The columns of the points while records fill them.

use super::header::{Field, Header, fields};
use crate::bytes::{ColumnLayout, column, columns, size, zeros};
use crate::content::Content;
use crate::input::Input;
use atlasfit::geometry::{Attribute, ScalarKind};

/// Points taken at a time.
pub(super) const BLOCK: usize = 4096;

/// The columns while they fill.
pub(super) struct Points {
    pub header: Header,
    fields: Vec<Field>,
    /// Where the colour starts in a record, in bytes.
    color: Option<usize>,
    pub content: Content,
    /// Per field; empty while all values are zero.
    values: Vec<Vec<f64>>,
    /// Points taken.
    done: usize,
    /// Points for which memory is set aside at once: those whose bytes are there.
    pub expected: usize,
}

/// At least `n` entries.
fn grow<T: Copy + Send>(column: &mut Vec<T>, zero: T, n: usize) {
    if column.is_empty() {
        *column = zeros(zero, n);
    } else if column.len() < n {
        column.resize(n, zero);
    }
}

impl Points {
    pub fn new(mut header: Header) -> Self {
        let mut fields = fields(&mut header);
        fields.retain(|f| f.offset + size(f.stored) <= header.record);
        let color = match header.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        };
        let values = fields.iter().map(|_| Vec::new()).collect();
        Self { fields, color, header, content: Content::default(), values, done: 0, expected: 0 }
    }

    /// Bytes of memory that a point takes.
    pub fn bytes_per_point(&self) -> usize {
        24 + 16 + 8 * self.fields.len()
    }

    /// Takes whole records.
    pub fn take(&mut self, records: &[u8]) {
        let Self { header, fields, color, content, values, done, expected } = self;
        let (stride, first, expected) = (header.record, *done, *expected);
        *done += records.len() / stride;
        let room = expected.max(*done);
        let positions = &mut content.cloud.positions;
        grow(positions, [0.0; 3], room);
        let added = &mut positions[first..];
        let (scale, add) = (header.scale, header.offset);
        let layout = |offset, kind| ColumnLayout { stride, offset, kind, big_endian: false };
        columns(records, layout(0, ScalarKind::I32), |i, v: [f64; 3]| {
            added[i] = [0, 1, 2].map(|k| v[k] * scale[k] + add[k]);
        });
        for (field, out) in fields.iter().zip(values) {
            let layout = layout(field.offset, field.stored);
            if out.is_empty() {
                // A column that is zero so far takes no memory.
                let mut zero = true;
                column(records, layout, |_, v| zero &= field.value(v) == 0.0);
                if zero {
                    continue;
                }
            }
            grow(out, 0.0, room);
            let added = &mut out[first..];
            column(records, layout, |i, v| added[i] = field.value(v));
        }
        if let Some(offset) = *color {
            let colors = content.cloud.colors.get_or_insert_default();
            grow(colors, [0.0; 4], room);
            let added = &mut colors[first..];
            columns(records, layout(offset, ScalarKind::U16), |i, v: [f64; 3]| {
                let [r, g, b] = v.map(|v| v as f32 / 65535.0);
                added[i] = [r, g, b, 1.0];
            });
        }
    }

    /// The points as a cloud.
    pub fn finish(self, input: &mut Input<'_>) -> Content {
        let mut content = self.content;
        if let Some(colors) = &mut content.cloud.colors {
            const LARGEST_BYTE: f32 = 255.0 / 65535.0;
            let any = |least: f32| colors.iter().any(|c| c[..3].iter().any(|&v| v > least));
            if !any(0.0) {
                content.cloud.colors = None;
            } else if !any(LARGEST_BYTE) {
                let n = colors.len() as u64;
                input.report.add("colours not above 255, read as 8 bits (LAS asks for 16)", n, None);
                colors.iter_mut().flat_map(|c| &mut c[..3]).for_each(|c| *c = (*c * 65535.0).round() / 255.0);
            }
        }
        for (field, values) in self.fields.into_iter().zip(self.values) {
            if !values.is_empty() {
                content.cloud.attributes.push(Attribute {
                    name: field.name,
                    width: 1,
                    kind: field.kind,
                    values,
                });
            }
        }
        content
    }
}
