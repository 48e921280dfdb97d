//! Numbers out of rows of bytes: what PLY, PCD and LAS share.

use atlasfit::geometry::ScalarKind;

/// Bytes of a number.
pub const fn size(kind: ScalarKind) -> usize {
    match kind {
        ScalarKind::U8 | ScalarKind::I8 => 1,
        ScalarKind::U16 | ScalarKind::I16 => 2,
        ScalarKind::U32 | ScalarKind::I32 | ScalarKind::F32 => 4,
        ScalarKind::F64 => 8,
    }
}

/// Calls `put(i, value)` for the number at `offset` of each row.
#[inline]
pub fn column(
    data: &[u8],
    stride: usize,
    offset: usize,
    kind: ScalarKind,
    big: bool,
    mut put: impl FnMut(usize, f64),
) {
    macro_rules! each {
        ($t:ty) => {{
            const N: usize = size_of::<$t>();
            for (i, row) in data.chunks_exact(stride).enumerate() {
                if let Some(Ok(bytes)) = row.get(offset..offset + N).map(<[u8; N]>::try_from) {
                    let value = if big { <$t>::from_be_bytes(bytes) } else { <$t>::from_le_bytes(bytes) };
                    put(i, f64::from(value));
                }
            }
        }};
    }
    match kind {
        ScalarKind::U8 => each!(u8),
        ScalarKind::I8 => each!(i8),
        ScalarKind::U16 => each!(u16),
        ScalarKind::I16 => each!(i16),
        ScalarKind::U32 => each!(u32),
        ScalarKind::I32 => each!(i32),
        ScalarKind::F32 => each!(f32),
        ScalarKind::F64 => each!(f64),
    }
}

/// The number at the start of `bytes`, which are long enough.
#[inline]
pub fn scalar(bytes: &[u8], kind: ScalarKind, big: bool) -> f64 {
    let mut value = 0.0;
    column(&bytes[..size(kind)], size(kind), 0, kind, big, |_, v| value = v);
    value
}
