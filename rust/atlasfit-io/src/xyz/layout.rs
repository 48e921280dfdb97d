//! How the lines of a file fall into fields.

use crate::text::{self, Lines};

/// Lines looked at to find separator and columns.
pub(super) const SAMPLE: usize = 1000;

/// How a line falls into fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layout {
    /// `None` = blanks.
    pub separator: Option<u8>,
    /// Whether numbers may have a comma instead of a point.
    pub decimal_comma: bool,
}

impl Layout {
    /// The fields of a line.
    pub fn fields(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        line.split(move |&b| match self.separator {
            None => b.is_ascii_whitespace(),
            Some(s) => b == s,
        })
        .map(<[u8]>::trim_ascii)
        .filter(move |f| self.separator.is_some() || !f.is_empty())
    }

    /// A field as a number.
    pub fn number(self, field: &[u8]) -> Option<f64> {
        if self.decimal_comma { text::number_or_comma(field).map(|n| n.0) } else { text::number(field) }
    }

    /// Numbers anywhere in a line: names may stand between them.
    pub fn numbers(self, line: &[u8]) -> usize {
        self.fields(line).filter(|f| self.number(f).is_some()).count()
    }

    /// Numbers at the start of a line.
    pub fn row(self, line: &[u8]) -> usize {
        self.fields(line).take_while(|f| self.number(f).is_some()).count()
    }
}

/// Whether a line is a comment.
pub(super) fn is_comment(line: &[u8]) -> bool {
    [&b"#"[..], b"//", b"%", b"!"].iter().any(|c| line.starts_with(c))
}

/// The layout under which most sample lines hold at least three numbers.
pub(super) fn layout(data: &[u8]) -> Layout {
    let layouts = [
        Layout { separator: None, decimal_comma: false },
        Layout { separator: Some(b','), decimal_comma: false },
        Layout { separator: Some(b';'), decimal_comma: true },
        Layout { separator: Some(b'|'), decimal_comma: false },
        Layout { separator: None, decimal_comma: true },
    ];
    let mut best = (0, layouts[0]);
    for layout in layouts {
        let rows = Lines::new(data).take(SAMPLE).filter(|l| layout.numbers(l.text.trim_ascii()) >= 3).count();
        if rows > best.0 {
            best = (rows, layout);
        }
    }
    best.1
}
