//! The rows behind the header, one value after the other: what the readers of vertices and of faces share.

use super::header::{Element, Encoding, Header};
use crate::bytes::{ColumnLayout, column, scalar, size};
use crate::error::{Error, Location, Result};
use crate::input::Input;
use crate::text::{Line, Lines};
use atlasfit::geometry::ScalarKind;

/// A place in the rows.
pub(super) struct Body<'i, 'd> {
    pub input: &'i mut Input<'d>,
    pub encoding: Encoding,
    /// Next byte of a binary body.
    pub at: usize,
    /// Next line of an ASCII body.
    pub lines: Lines<'d>,
    /// The entries of the list that was read last.
    pub list: Vec<f64>,
}

impl<'i, 'd> Body<'i, 'd> {
    pub fn new(input: &'i mut Input<'d>, header: &Header) -> Self {
        Self {
            at: header.end,
            lines: input.lines(header.end, header.lines),
            list: Vec::new(),
            input,
            encoding: header.encoding,
        }
    }

    pub fn big_endian(&self) -> bool {
        self.encoding == Encoding::Big
    }

    /// Rows of the element that the rest of the file can hold at most.
    pub fn rows_possible(&self, element: &Element) -> u64 {
        let rest = match self.encoding {
            Encoding::Ascii => (self.input.data.len().saturating_sub(self.lines.offset()) as u64).div_ceil(2),
            _ => {
                let least = element.least_bytes().max(1);
                (self.input.len.saturating_sub(self.at) / least) as u64
            }
        };
        element.count.min(rest)
    }

    /// The error of a file that ends after `whole` rows of the element.
    pub fn cut_off(&self, element: &Element, whole: u64) -> Error {
        let (at, unit) = match self.encoding {
            Encoding::Ascii => (Location::Line(self.lines.number()), "lines"),
            _ => (Location::Byte(self.input.len as u64), "bytes"),
        };
        self.input.malformed(
            at,
            format!("the end of the file after at most {whole} rows of the element \"{}\"", element.name),
            format!("{} rows, as the header says", element.count),
            format!(
                "The file is cut off, or its header is wrong: get it again, or correct the count if the \
                 {unit} are all there"
            ),
        )
    }

    /// The next line of an ASCII body that is neither blank nor a comment.
    pub fn next_line(&mut self) -> Option<Line<'d>> {
        loop {
            let line = self.lines.next_filled()?;
            if !line.text.starts_with(b"comment") {
                return Some(line);
            }
        }
    }

    /// Reads one property of a binary row. A scalar is returned; of a list the length is returned, and its
    /// entries go to `self.list`.
    pub fn take(&mut self, list: Option<ScalarKind>, kind: ScalarKind) -> Option<f64> {
        let big_endian = self.big_endian();
        let rest = self.input.data.get(self.at..)?;
        let Some(count_kind) = list else {
            let bytes = rest.get(..size(kind))?;
            self.at += size(kind);
            return Some(scalar(bytes, kind, big_endian));
        };
        let count = scalar(rest.get(..size(count_kind))?, count_kind, big_endian);
        if !(0.0..=f64::from(u32::MAX)).contains(&count) {
            return None;
        }
        let from = size(count_kind);
        let entries = rest.get(from..from.checked_add((count as usize).checked_mul(size(kind))?)?)?;
        self.list.clear();
        let out = &mut self.list;
        let layout = ColumnLayout { stride: size(kind), offset: 0, kind, big_endian };
        column(entries, layout, |_, v| out.push(v));
        self.at += from + entries.len();
        Some(count)
    }

    /// Passes over the rows of an element.
    pub fn skip(&mut self, element: &Element) -> Result<()> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let possible = self.rows_possible(element);
        if possible < element.count {
            return Err(self.cut_off(element, possible));
        }
        match (self.encoding, element.stride()) {
            (Encoding::Ascii, _) => {
                for row in self.input.watched(0..element.count) {
                    if self.next_line().is_none() {
                        return Err(self.cut_off(element, row));
                    }
                }
            }
            (_, Some(stride)) => self.at += element.count as usize * stride,
            (_, None) => {
                for row in self.input.watched(0..element.count) {
                    for p in &element.properties {
                        if self.take(p.list, p.kind).is_none() {
                            return Err(self.cut_off(element, row));
                        }
                    }
                }
            }
        }
        Ok(())
    }
}
