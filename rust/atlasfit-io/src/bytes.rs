//! Numbers out of rows of bytes: what PLY, PCD and LAS share.

use atlasfit::geometry::ScalarKind;

/// `n` zeros for a column whose bytes are known to be in the file. Several threads touch the pages of a large
/// one: the first touch of its memory costs more than all else that reading rows does.
pub(crate) fn zeros<T: Copy + Send>(zero: T, n: usize) -> Vec<T> {
    /// Smaller columns take less time than starting threads.
    const LARGE: usize = 4 << 20;
    /// More threads wait for each other in the system.
    const MOST_THREADS: usize = 8;
    const PAGE: usize = 4096;
    /// Stack of a thread that touches pages, in bytes.
    const STACK: usize = 64 << 10;
    let mut out = vec![zero; n];
    let threads = std::thread::available_parallelism().map_or(1, |t| t.get().min(MOST_THREADS));
    if n * size_of::<T>() >= LARGE && threads > 1 {
        let step = (PAGE / size_of::<T>()).max(1);
        std::thread::scope(|scope| {
            for part in out.chunks_mut(n.div_ceil(threads)) {
                let touch = move || part.iter_mut().step_by(step).for_each(|x| *x = zero);
                // The environment (RUST_MIN_STACK) does not decide how much stack there is.
                let builder = std::thread::Builder::new().stack_size(STACK);
                // Without a thread the pages are touched when they are filled.
                let _ = builder.spawn_scoped(scope, touch);
            }
        });
    }
    out
}

/// Bytes of a number.
pub(crate) const fn size(kind: ScalarKind) -> usize {
    match kind {
        ScalarKind::U8 | ScalarKind::I8 => 1,
        ScalarKind::U16 | ScalarKind::I16 => 2,
        ScalarKind::U32 | ScalarKind::I32 | ScalarKind::F32 => 4,
        ScalarKind::F64 => 8,
    }
}

/// Where the numbers of a column stand in rows of bytes.
#[derive(Clone, Copy)]
pub(crate) struct ColumnLayout {
    /// Bytes from one row to the next.
    pub stride: usize,
    /// Where the number starts in its row, in bytes.
    pub offset: usize,
    pub kind: ScalarKind,
    pub big_endian: bool,
}

/// Calls `put(i, value)` for the number of each row.
#[inline]
pub(crate) fn column(data: &[u8], layout: ColumnLayout, mut put: impl FnMut(usize, f64)) {
    columns::<1>(data, layout, |i, [value]| put(i, value));
}

/// Calls `put(i, values)` for `C` numbers of each row, which stand one behind the other from the offset on.
#[inline]
pub(crate) fn columns<const C: usize>(
    data: &[u8],
    layout: ColumnLayout,
    mut put: impl FnMut(usize, [f64; C]),
) {
    let ColumnLayout { stride, offset, kind, big_endian } = layout;
    macro_rules! each {
        ($t:ty) => {{
            const N: usize = size_of::<$t>();
            for (i, row) in data.chunks_exact(stride).enumerate() {
                if let Some(bytes) = row.get(offset..offset + N * C) {
                    let (numbers, _) = bytes.as_chunks::<N>();
                    let value = |c: usize| {
                        f64::from(if big_endian {
                            <$t>::from_be_bytes(numbers[c])
                        } else {
                            <$t>::from_le_bytes(numbers[c])
                        })
                    };
                    put(i, std::array::from_fn(value));
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

/// Puts a number at the start of `bytes`, which are long enough, rounded to what `kind` holds; gives what it
/// then is, nothing where it is out of range.
pub(crate) fn put(bytes: &mut [u8], kind: ScalarKind, big_endian: bool, value: f64) -> Option<f64> {
    macro_rules! put {
        ($t:ty, $value:expr) => {{
            let held: $t = $value;
            let encoded = if big_endian { held.to_be_bytes() } else { held.to_le_bytes() };
            bytes[..size_of::<$t>()].copy_from_slice(&encoded);
            Some(f64::from(held))
        }};
    }
    macro_rules! whole {
        ($t:ty) => {{
            let rounded = value.round();
            let range = f64::from(<$t>::MIN)..=f64::from(<$t>::MAX);
            if range.contains(&rounded) { put!($t, rounded as $t) } else { None }
        }};
    }
    match kind {
        ScalarKind::U8 => whole!(u8),
        ScalarKind::I8 => whole!(i8),
        ScalarKind::U16 => whole!(u16),
        ScalarKind::I16 => whole!(i16),
        ScalarKind::U32 => whole!(u32),
        ScalarKind::I32 => whole!(i32),
        ScalarKind::F32 => put!(f32, value as f32),
        ScalarKind::F64 => put!(f64, value),
    }
}

/// The number at the start of `bytes`, which are long enough.
#[inline]
pub(crate) fn scalar(bytes: &[u8], kind: ScalarKind, big_endian: bool) -> f64 {
    let stride = size(kind);
    let mut value = 0.0;
    column(&bytes[..stride], ColumnLayout { stride, offset: 0, kind, big_endian }, |_, v| value = v);
    value
}
