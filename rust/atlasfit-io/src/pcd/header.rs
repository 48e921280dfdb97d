//! The header of a PCD file: its fields, and how many points are behind.

use crate::bytes::size;
use crate::error::{Error, Location, Result};
use crate::input::Input;
use crate::text::{self, Line, Lines};
use atlasfit::geometry::ScalarKind;

/// A field's number type: ours, or a 64-bit integer (time stamps), which becomes a float.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Ours(ScalarKind),
    U64,
    I64,
}

impl Kind {
    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::Ours(k) => size(k),
            _ => 8,
        }
    }

    /// The type that attributes are stored as.
    pub fn stored(self) -> ScalarKind {
        match self {
            Self::Ours(k) => k,
            _ => ScalarKind::F64,
        }
    }
}

/// A field of the points.
pub(super) struct Field {
    pub name: String,
    pub kind: Kind,
    /// Numbers per point.
    pub count: usize,
}

/// How the points are written.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    /// Point after point.
    Binary,
    /// Field after field, packed by LZF.
    Compressed,
}

/// A header.
pub(super) struct Header {
    pub fields: Vec<Field>,
    pub points: u64,
    pub encoding: Encoding,
    /// Where the data begin: a byte offset.
    pub end: usize,
    /// How many lines the header has.
    pub lines: u64,
    /// Where the scanner stood; `None` at the origin, which is also what PCL writes when it does not know.
    pub viewpoint: Option<[f64; 3]>,
}

impl Header {
    /// Numbers of a point.
    pub fn numbers(&self) -> usize {
        self.fields.iter().map(|f| f.count).fold(0, usize::saturating_add)
    }
    /// Bytes of a point.
    pub fn row(&self) -> usize {
        self.fields.iter().map(|f| f.kind.bytes().saturating_mul(f.count)).fold(0, usize::saturating_add)
    }
}

/// The words of the header's lines, not yet checked.
#[derive(Default)]
struct Raw {
    names: Vec<String>,
    sizes: Vec<String>,
    types: Vec<String>,
    counts: Vec<String>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
    viewpoint: Option<[f64; 3]>,
}

/// Whether these bytes are a PCD file.
pub(crate) fn is_pcd(data: &[u8]) -> bool {
    Lines::new(data)
        .take(50)
        .map(|l| text::tokens(l.text).next().unwrap_or_default())
        .find(|w| !w.is_empty() && !w.starts_with(b"#"))
        .is_some_and(|w| w == b"VERSION" || w == b"FIELDS")
}

/// Reads the header.
pub(super) fn read(input: &Input<'_>) -> Result<Header> {
    let mut raw = Raw::default();
    let mut lines = Lines::new(input.data);
    let mut data = None;
    for line in lines.by_ref() {
        let mut words = text::tokens(line.text);
        let Some(key) = words.next() else { continue };
        let words: Vec<String> = words.map(|w| String::from_utf8_lossy(w).into_owned()).collect();
        if key == b"DATA" {
            data = words.first().map(|w| (w.to_lowercase(), line)).filter(|d| !d.0.is_empty());
            break;
        }
        raw.take(input, line, key, words)?;
    }
    let Some((data, line)) = data else {
        let expected = "DATA ascii, binary or binary_compressed";
        return Err(damaged(input, "a header without DATA".into(), expected));
    };
    let fields = raw.fields(input)?;
    let points = match (raw.points, raw.width) {
        (Some(p), _) => p,
        (None, Some(w)) => w.saturating_mul(raw.height.unwrap_or(1)),
        (None, None) => {
            return Err(damaged(input, "neither POINTS nor WIDTH".into(), "the number of points"));
        }
    };
    let encoding = match data.as_str() {
        "ascii" => Encoding::Ascii,
        "binary" => Encoding::Binary,
        "binary_compressed" => Encoding::Compressed,
        other => {
            return Err(input.malformed(
                Location::Line(line.number),
                format!("DATA {other}"),
                "DATA ascii, binary or binary_compressed",
                "Write the file again with PCL",
            ));
        }
    };
    let mut end = lines.offset().min(input.data.len());
    // Only a LF ends this line when the body is binary, unless all lines end with CR and LF.
    if encoding != Encoding::Ascii && end >= 2 && input.data.get(end - 2) == Some(&b'\r') && line.number > 1 {
        let crlf = input.data[..end - 2].windows(2).any(|w| w == b"\r\n");
        end -= usize::from(!crlf);
    }
    Ok(Header { fields, points, encoding, end, lines: line.number, viewpoint: raw.viewpoint })
}

/// The position in the words of VIEWPOINT (a position, then a quaternion), where they give one.
fn viewpoint(words: &[String]) -> Option<[f64; 3]> {
    let [x, y, z] = words.get(..3)? else { return None };
    let at = [x.parse().ok()?, y.parse().ok()?, z.parse().ok()?];
    (at != [0.0; 3] && at.iter().all(|c: &f64| c.is_finite())).then_some(at)
}

/// The error of a header that contradicts itself.
fn damaged(input: &Input<'_>, found: String, expected: &str) -> Error {
    input.malformed(Location::Whole, found, expected, "The header is damaged: get the file again")
}

impl Raw {
    /// Takes a line.
    fn take(&mut self, input: &Input<'_>, line: Line<'_>, key: &[u8], words: Vec<String>) -> Result<()> {
        let number = || words.first().and_then(|w| w.parse::<u64>().ok());
        let wrong = |expected: &str| {
            input.malformed(
                Location::Line(line.number),
                text::quote(line.text),
                expected,
                "Correct the header",
            )
        };
        match key {
            b"FIELDS" | b"COLUMNS" => self.names = words,
            b"SIZE" => self.sizes = words,
            b"TYPE" => self.types = words,
            b"COUNT" => self.counts = words,
            b"WIDTH" => self.width = Some(number().ok_or_else(|| wrong("WIDTH and a number"))?),
            b"HEIGHT" => self.height = Some(number().ok_or_else(|| wrong("HEIGHT and a number"))?),
            b"POINTS" => self.points = Some(number().ok_or_else(|| wrong("POINTS and a number"))?),
            b"VIEWPOINT" => self.viewpoint = viewpoint(&words),
            b"VERSION" => {}
            w if w.starts_with(b"#") => {}
            _ => {
                return Err(wrong(
                    "VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS or DATA",
                ));
            }
        }
        Ok(())
    }

    /// The fields that FIELDS, SIZE, TYPE and COUNT describe together.
    fn fields(&self, input: &Input<'_>) -> Result<Vec<Field>> {
        let Self { names, sizes, types, counts, .. } = self;
        if names.is_empty() || sizes.len() != names.len() || types.len() != names.len() {
            let found = format!("{} FIELDS, {} SIZE, {} TYPE", names.len(), sizes.len(), types.len());
            return Err(damaged(input, found, "as many of each"));
        }
        let mut fields = Vec::with_capacity(names.len());
        for (i, name) in names.iter().enumerate() {
            let (t, s) = (types[i].as_str(), sizes[i].as_str());
            let kind = kind_of(t, s).ok_or_else(|| {
                damaged(input, format!("TYPE {t} of SIZE {s}"), "F, U or I of 1, 2, 4 or 8 bytes")
            })?;
            let count = counts.get(i).map_or(Ok(1), |c| c.parse::<usize>()).unwrap_or(usize::MAX);
            // A row longer than the file cannot be there.
            if count > input.len {
                return Err(damaged(
                    input,
                    format!("COUNT {}", counts[i]),
                    "the numbers per point of a field",
                ));
            }
            fields.push(Field { name: name.clone(), kind, count });
        }
        Ok(fields)
    }
}

/// The type of a letter and a number of bytes.
fn kind_of(letter: &str, bytes: &str) -> Option<Kind> {
    Some(match (letter, bytes) {
        ("F", "4") => Kind::Ours(ScalarKind::F32),
        ("F", "8") => Kind::Ours(ScalarKind::F64),
        ("U", "1") => Kind::Ours(ScalarKind::U8),
        ("U", "2") => Kind::Ours(ScalarKind::U16),
        ("U", "4") => Kind::Ours(ScalarKind::U32),
        ("I", "1") => Kind::Ours(ScalarKind::I8),
        ("I", "2") => Kind::Ours(ScalarKind::I16),
        ("I", "4") => Kind::Ours(ScalarKind::I32),
        ("U", "8") => Kind::U64,
        ("I", "8") => Kind::I64,
        _ => return None,
    })
}
