//! Windows of convolutions, pictures of twice the size, sums of rows: twins of `ops::unfold`, `ops::upsample`
//! and `ops::outer`.

use crate::launch::{Call, Given, index, view};
use candle_core::backend::BackendStorage;
use candle_core::{CudaStorage, Result};

/// Pictures and the windows that are taken from them.
#[derive(Debug, Clone, Copy)]
pub struct Windows {
    /// Pictures, rows, columns, channels.
    pub size: [usize; 4],
    /// Windows along the rows and the columns.
    pub along: [usize; 2],
    /// Pixels along a side of a window, odd.
    pub side: usize,
    /// Pixels between two windows.
    pub stride: usize,
}

impl Windows {
    /// Calls `one`, or where the channels are a multiple of four and lie so in memory `fours`.
    fn call(&self, [one, fours]: [&str; 2], given: Given<'_>, len: usize) -> Result<CudaStorage> {
        let [_, rows, columns, channels] = self.size;
        let by_four = channels % 4 == 0 && given.1.start_offset() % 4 == 0;
        let (name, numbers) = if by_four { (fours, 4) } else { (one, 1) };
        // The windows' numbers are counted in 32 bits too.
        index(self.windows())?;
        let [high, wide] = self.along;
        let counts = [len / numbers, rows, columns, channels / numbers, high, wide, self.side, self.stride];
        let mut sizes = [0; 8];
        for (to, n) in sizes.iter_mut().zip(counts) {
            *to = index(n)?;
        }
        let grid = Call::threads(sizes[0]);
        let call = Call { name, grid, inputs: &[view(given)?], sizes: &sizes, factors: &[] };
        call.make::<f32>(given.0.device(), len)
    }

    fn windows(&self) -> usize {
        self.size[0] * self.along[0] * self.along[1] * self.side * self.side * self.size[3]
    }
}

/// Windows (pictures, high, wide, side side channels) of pictures.
///
/// # Errors
/// Those of candle; more numbers than 32 bits count.
pub fn unfold(x: Given<'_>, windows: &Windows) -> Result<CudaStorage> {
    windows.call(["unfold", "unfold_fours"], x, windows.windows())
}

/// The adjoint of [`unfold`].
///
/// # Errors
/// As [`unfold`].
pub fn fold(d: Given<'_>, windows: &Windows) -> Result<CudaStorage> {
    windows.call(["fold", "fold_fours"], d, windows.size.iter().product())
}

fn doubled(name: &str, given: Given<'_>, len: usize, side: usize, channels: usize) -> Result<CudaStorage> {
    let sizes = [index(len)?, index(side)?, index(channels)?];
    index(4 * len)?;
    let call =
        Call { name, grid: Call::threads(sizes[0]), inputs: &[view(given)?], sizes: &sizes, factors: &[] };
    call.make::<f32>(given.0.device(), len)
}

/// Pictures of twice the side from (count, side, side, channels).
///
/// # Errors
/// As [`unfold`].
pub fn upsample(x: Given<'_>, [count, side, channels]: [usize; 3]) -> Result<CudaStorage> {
    doubled("upsample", x, 4 * count * side * side * channels, side, channels)
}

/// The adjoint of [`upsample`].
///
/// # Errors
/// As [`unfold`].
pub fn upsample_adjoint(d: Given<'_>, [count, side, channels]: [usize; 3]) -> Result<CudaStorage> {
    doubled("upsample_adjoint", d, count * side * side * channels, side, channels)
}

/// From (outer, count, inner) the sums over the middle.
///
/// # Errors
/// As [`unfold`].
pub fn sum_middle(d: Given<'_>, [outer, count, inner]: [usize; 3]) -> Result<CudaStorage> {
    index(outer * count * inner)?;
    let sizes = [index(outer * inner)?, index(count)?, index(inner)?];
    let grid = Call::threads(sizes[0]);
    let call = Call { name: "sum_middle", grid, inputs: &[view(d)?], sizes: &sizes, factors: &[] };
    call.make::<f32>(d.0.device(), outer * inner)
}

/// Sums (groups, a, b, units) of each row of one (groups, a, units) with each of the other (groups, b,
/// units).
///
/// # Errors
/// As [`unfold`].
pub fn outer_add(x: Given<'_>, y: Given<'_>, [groups, a, b, units]: [usize; 4]) -> Result<CudaStorage> {
    let len = groups * a * b * units;
    let sizes = [index(len)?, index(a)?, index(b)?, index(units)?];
    let inputs = [view(x)?, view(y)?];
    let call = Call {
        name: "outer_add",
        grid: Call::threads(sizes[0]),
        inputs: &inputs,
        sizes: &sizes,
        factors: &[],
    };
    call.make::<f32>(x.0.device(), len)
}
