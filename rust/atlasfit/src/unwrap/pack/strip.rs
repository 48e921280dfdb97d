//! A strip of cells that masks are put on, and the search for free places.
//!
//! All positions of a mask in one row are tested at once: the positions where a run of cells meets an
//! occupied one are the occupied cells, spread by the run's length and shifted. Spreads by powers of two are
//! kept for every row; any run is the union of two of them.

use super::bitmap::set_range;
use super::constants::PACK;
use super::mask::{BLOCK, Mask, Run};

/// Occupied cells of some rows and their spreads.
struct Rows<const W: usize> {
    /// `spread[p]`, `W` words a row: bit x is set if one of the cells x..x + 2^p is. Spare words follow the
    /// last row, because a shifted row is read beyond its end.
    spread: Vec<Vec<u64>>,
    /// The longest free run of each row.
    free: Vec<u32>,
}

/// A strip of fixed width, at most `64 * W` cells: its rows, and the union of each row with the [`BLOCK`] - 1
/// above it.
pub(crate) struct Strip<const W: usize> {
    width: usize,
    single: Rows<W>,
    block: Rows<W>,
}

/// ORs the `W` words from bit `at` of `rows` into `into`. Bits from behind a row's end come to positions
/// where the mask would stick out of the strip; the caller leaves these out.
#[inline]
fn shift_or<const W: usize>(into: &mut [u64; W], rows: &[u64], at: usize) {
    let (word, bit) = (at / 64, at % 64);
    let source = &rows[word..word + W + 1];
    for i in 0..W {
        // In two steps, as no shift is by 64.
        into[i] |= source[i] >> bit | source[i + 1] << 1 << (63 - bit);
    }
}

/// ORs the row, shifted down by `by` bits, into itself.
fn widen<const W: usize>(row: &mut [u64; W], by: usize) {
    let (word, bit) = (by / 64, by % 64);
    for i in 0..W {
        let beyond = |k: usize| row.get(i + word + k).copied().unwrap_or(0);
        row[i] |= beyond(0) >> bit | beyond(1) << 1 << (63 - bit);
    }
}

impl<const W: usize> Rows<W> {
    fn new(width: usize) -> Self {
        let powers = (usize::BITS - width.leading_zeros()) as usize;
        Self { spread: vec![Vec::new(); powers], free: Vec::new() }
    }
    fn grow(&mut self, rows: usize, width: usize) {
        if self.free.len() < rows {
            // A shift starts less than W words into the last row.
            self.spread.iter_mut().for_each(|s| s.resize((rows + 1) * W, 0));
            self.free.resize(rows, width as u32);
        }
    }
    /// The cells of some rows from `row`.
    fn cells(&mut self, row: usize) -> &mut [u64] {
        &mut self.spread[0][row * W..]
    }
    /// Brings a row's spreads and longest gap up to date.
    fn update(&mut self, row: usize, width: usize) {
        let own = row * W..(row + 1) * W;
        let mut wide = [0; W];
        wide.copy_from_slice(&self.spread[0][own.clone()]);
        self.free[row] = longest_free(&wide, width);
        for (p, spread) in self.spread.iter_mut().enumerate().skip(1) {
            widen(&mut wide, 1 << (p - 1));
            spread[own.clone()].copy_from_slice(&wide);
        }
    }
    /// Whether a glance rules out all positions of the mask's first runs.
    fn refuses(&self, runs: &[Run], y: usize) -> bool {
        (runs.iter().take(PACK.glances))
            .any(|r| self.free.get(y + r.row as usize).is_some_and(|&f| f < r.to - r.from))
    }
    /// Blocks the positions where a run of the mask meets an occupied cell; false once none up to `last` is
    /// left.
    #[inline]
    fn block(&self, runs: &[Run], y: usize, last: usize, blocked: &mut [u64; W]) -> bool {
        for (n, &Run { row, from, to }) in runs.iter().enumerate() {
            let row = y + row as usize;
            let power = (to - from).ilog2() as usize;
            if row >= self.free.len() {
                continue;
            }
            let spread = &self.spread[power][row * W..];
            shift_or(blocked, spread, from as usize);
            if (to - from) as usize != 1 << power {
                shift_or(blocked, spread, to as usize - (1 << power));
            }
            if n % 4 == 0 && first_free(blocked, last).is_none() {
                return false;
            }
        }
        true
    }
}

impl<const W: usize> Strip<W> {
    pub(crate) fn new(width: usize) -> Self {
        Self { width, single: Rows::new(width), block: Rows::new(width) }
    }

    /// Whether nothing lies on it.
    pub(crate) fn is_empty(&self) -> bool {
        self.single.free.is_empty()
    }

    /// The lowest, then leftmost, free position from row `from` whose top stays at or below `limit`.
    pub(crate) fn find(&self, m: &Mask, from: usize, limit: usize) -> Option<(usize, usize)> {
        if m.width > self.width || m.height > limit {
            return None;
        }
        let last = self.width - m.width;
        for y in from..=limit - m.height {
            if self.block.refuses(&m.blocks, y) || self.single.refuses(&m.runs, y) {
                continue;
            }
            let mut blocked = [0u64; W];
            if self.block.block(&m.blocks, y, last, &mut blocked)
                && self.single.block(&m.runs, y, last, &mut blocked)
                && let Some(x) = first_free(&blocked, last)
            {
                return Some((x, y));
            }
        }
        None
    }

    /// Puts a mask at a position.
    pub(crate) fn put(&mut self, m: &Mask, x: usize, y: usize) {
        let need = y + m.height;
        self.single.grow(need, self.width);
        self.block.grow(need, self.width);
        for &Run { row, from, to } in &m.runs {
            set_range(self.single.cells(y + row as usize), x + from as usize, x + to as usize);
        }
        let top = self.single.free.len();
        for r in y..need {
            self.single.update(r, self.width);
        }
        for r in y.saturating_sub(BLOCK - 1)..need {
            let mut union = [0u64; W];
            for row in self.single.spread[0][r * W..(r + BLOCK).min(top) * W].chunks_exact(W) {
                union.iter_mut().zip(row).for_each(|(u, w)| *u |= w);
            }
            self.block.cells(r)[..W].copy_from_slice(&union);
            self.block.update(r, self.width);
        }
    }
}

/// The longest run of zero bits among the first `width`.
fn longest_free(row: &[u64], width: usize) -> u32 {
    let (mut longest, mut start) = (0, 0);
    for (i, &w) in row.iter().enumerate() {
        let mut w = w;
        while w != 0 {
            let at = i * 64 + w.trailing_zeros() as usize;
            longest = longest.max(at.saturating_sub(start));
            // Skip the run of ones.
            let ones = (w >> (at % 64)).trailing_ones() as usize;
            start = at + ones;
            w = if at % 64 + ones >= 64 { 0 } else { w & (u64::MAX << (at % 64 + ones)) };
        }
    }
    longest.max(width.saturating_sub(start)) as u32
}

fn first_free(blocked: &[u64], last: usize) -> Option<usize> {
    for (i, &w) in blocked.iter().enumerate() {
        if i * 64 > last {
            return None;
        }
        if w != u64::MAX {
            let x = i * 64 + (!w).trailing_zeros() as usize;
            return (x <= last).then_some(x);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mask of some cells.
    fn mask(rows: &[&str]) -> Mask {
        let mut runs = Vec::new();
        for (y, row) in rows.iter().enumerate() {
            for (x, _) in row.char_indices().filter(|c| c.1 == '#') {
                runs.push(Run::new(y, x, x + 1));
            }
        }
        Mask { width: rows[0].len(), height: rows.len(), runs, blocks: Vec::new() }
    }

    #[test]
    fn masks_go_to_the_lowest_free_place_and_into_holes() {
        let ring = mask(&["####", "#..#", "#..#", "####"]);
        let dot = mask(&["##", "##"]);
        let mut strip = Strip::<1>::new(9);
        assert!(strip.is_empty());
        assert_eq!(strip.find(&ring, 0, 100), Some((0, 0)));
        strip.put(&ring, 0, 0);
        assert_eq!(strip.find(&ring, 0, 100), Some((4, 0)));
        strip.put(&ring, 4, 0);
        assert_eq!(strip.find(&dot, 0, 100), Some((1, 1)));
        strip.put(&dot, 1, 1);
        assert_eq!(strip.find(&dot, 0, 100), Some((5, 1)));
        assert_eq!(strip.find(&ring, 0, 7), None);
    }
}
