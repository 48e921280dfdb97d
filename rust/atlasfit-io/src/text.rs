//! Lines, words and numbers of text files, over bytes: line ends LF, CRLF and CR, no allocation per word.

use crate::stopping::{ITEMS_PER_LOOK, is_stopped};
use atlasfit::Stop;
use std::borrow::Cow;

/// One line without its end.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// Its bytes.
    pub text: &'a [u8],
    /// Its number, from 1.
    pub number: u64,
}

/// Walks over the lines of a text.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    data: &'a [u8],
    at: usize,
    number: u64,
    stop: Option<&'a Stop>,
}

impl<'a> Lines<'a> {
    pub fn new(data: &'a [u8]) -> Self {
        Self { data, at: 0, number: 0, stop: None }
    }
    /// Byte offset of the next line.
    pub fn offset(&self) -> usize {
        self.at
    }
    /// Number of the last line given.
    pub fn number(&self) -> u64 {
        self.number
    }
    /// Starts at byte `at`, with `number` lines already read.
    pub fn from(data: &'a [u8], at: usize, number: u64) -> Self {
        Self { data, at, number, stop: None }
    }
    /// The same lines, which end early when the reading is to end.
    pub fn until(self, stop: Option<&'a Stop>) -> Self {
        Self { stop, ..self }
    }
    /// The next line with a word on it.
    pub fn next_filled(&mut self) -> Option<Line<'a>> {
        self.find(|l| l.text.iter().any(|b| !b.is_ascii_whitespace()))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;
    fn next(&mut self) -> Option<Line<'a>> {
        let rest = self.data.get(self.at..).filter(|r| !r.is_empty())?;
        if self.number.is_multiple_of(ITEMS_PER_LOOK as u64) && is_stopped(self.stop) {
            return None;
        }
        self.number += 1;
        let end = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
        self.at += end + 1;
        if rest.get(end) == Some(&b'\r') && rest.get(end + 1) == Some(&b'\n') {
            self.at += 1;
        }
        Some(Line { text: &rest[..end], number: self.number })
    }
}

/// The first line of a text.
pub(crate) fn first_line(data: &[u8]) -> &[u8] {
    Lines::new(data).next().map_or(b"", |l| l.text)
}

/// The words of a line.
pub(crate) fn tokens(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| b.is_ascii_whitespace()).filter(|t| !t.is_empty())
}

/// A number. Besides the usual forms: Fortran exponents (1.0D+00) and the NaN and infinity of C libraries.
pub(crate) fn number(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    if let Ok(value) = text.parse::<f64>() {
        return Some(value);
    }
    unusual_number(text)
}

#[cold]
fn unusual_number(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    let bare = lower.trim_start_matches(['-', '+']);
    if bare.starts_with("nan")
        || bare.starts_with("1.#qnan")
        || bare.starts_with("1.#ind")
        || bare == "1.#snan"
    {
        return Some(f64::NAN);
    }
    if bare.starts_with("1.#inf") {
        return Some(if lower.starts_with('-') { f64::NEG_INFINITY } else { f64::INFINITY });
    }
    let (mantissa, exponent) = lower.split_once('d')?;
    exponent.parse::<i32>().ok()?;
    format!("{mantissa}e{exponent}").parse().ok()
}

/// A number that may have a decimal comma. The flag says that it had one.
pub(crate) fn number_or_comma(token: &[u8]) -> Option<(f64, bool)> {
    number(token).map(|v| (v, false)).or_else(|| {
        let comma = token.iter().position(|&b| b == b',')?;
        let mut dotted = token.to_vec();
        dotted[comma] = b'.';
        number(&dotted).map(|v| (v, true))
    })
}

/// How many numbers a line begins with, whatever separates them.
pub(crate) fn row_of_numbers(line: &[u8]) -> usize {
    line.split(|&b| b.is_ascii_whitespace() || matches!(b, b',' | b';' | b'|'))
        .filter(|t| !t.is_empty())
        .take_while(|t| number(t).is_some())
        .count()
}

/// Bytes as text for an error message, short and printable.
pub(crate) fn quote(bytes: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(SHOWN)]);
    let dots = if bytes.len() > SHOWN { "..." } else { "" };
    format!("\"{}{dots}\"", text.escape_debug())
}

/// The text as UTF-8 bytes without a byte order mark; UTF-16 (which Windows programs write) is converted.
pub(crate) fn utf8(data: &[u8]) -> Cow<'_, [u8]> {
    let unit: fn([u8; 2]) -> u16 = match data {
        [0xEF, 0xBB, 0xBF, rest @ ..] => return Cow::Borrowed(rest),
        [0xFF, 0xFE, ..] => u16::from_le_bytes,
        [0xFE, 0xFF, ..] => u16::from_be_bytes,
        _ => return Cow::Borrowed(data),
    };
    let units = data[2..].chunks_exact(2).map(|c| unit([c[0], c[1]]));
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Cow::Owned(text.into_bytes())
}

/// Whether the first line with words on it, comments aside, holds two or three counts and no more.
pub(crate) fn starts_with_counts(data: &[u8]) -> bool {
    let first =
        Lines::new(data).take(100).find(|l| tokens(l.text).next().is_some_and(|w| !w.starts_with(b"#")));
    first.is_some_and(|l| {
        let words: Vec<&[u8]> = tokens(l.text).collect();
        let count = |w: &&[u8]| w.iter().all(u8::is_ascii_digit);
        (2..=3).contains(&words.len()) && words.iter().all(count)
    })
}
