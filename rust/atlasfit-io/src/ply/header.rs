//! The PLY header: elements and their properties.

use crate::bytes::size;
use crate::error::{Location, Result};
use crate::input::Input;
use crate::text::{self, Lines};
use atlasfit::geometry::ScalarKind;

/// How the rows behind the header are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// One value, or one list of values, of every row of an element.
#[derive(Debug, Clone)]
pub(super) struct Property {
    pub name: String,
    /// The type of the value, or of the list's entries.
    pub kind: ScalarKind,
    /// The type of the count in front of a list.
    pub list: Option<ScalarKind>,
}

/// A table of rows with the same properties.
#[derive(Debug, Clone)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes per row, `None` where lists make them differ.
    pub(super) fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.list.is_none().then(|| size(p.kind))).sum()
    }

    /// Fewest bytes that a row takes in a binary file.
    pub(super) fn least_bytes(&self) -> usize {
        self.properties.iter().map(|p| size(p.list.unwrap_or(p.kind))).sum()
    }
}

/// The name of a type in a header.
pub(super) const fn type_name(kind: ScalarKind) -> &'static str {
    match kind {
        ScalarKind::U8 => "uchar",
        ScalarKind::I8 => "char",
        ScalarKind::U16 => "ushort",
        ScalarKind::I16 => "short",
        ScalarKind::U32 => "uint",
        ScalarKind::I32 => "int",
        ScalarKind::F32 => "float",
        ScalarKind::F64 => "double",
    }
}

/// The type that a header names, by its old or its new name.
fn kind_of(word: &[u8]) -> Option<ScalarKind> {
    Some(match word {
        b"uchar" | b"uint8" | b"bool" => ScalarKind::U8,
        b"char" | b"int8" => ScalarKind::I8,
        b"ushort" | b"uint16" => ScalarKind::U16,
        b"short" | b"int16" => ScalarKind::I16,
        b"uint" | b"uint32" => ScalarKind::U32,
        b"int" | b"int32" => ScalarKind::I32,
        b"float" | b"float32" => ScalarKind::F32,
        b"double" | b"float64" => ScalarKind::F64,
        _ => return None,
    })
}

/// A header.
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the data begin: a byte offset.
    pub end: usize,
    /// How many lines the header has.
    pub lines: u64,
    /// The image file that a comment names.
    pub texture: Option<String>,
}

/// More elements than this: the file is damaged. Known files have up to ten.
const MOST_ELEMENTS: usize = 1000;

/// Reads the header of a PLY file.
pub(super) fn read(input: &Input<'_>) -> Result<Header> {
    let mut lines = Lines::new(input.data);
    let mut encoding = None;
    let mut texture = None;
    let mut elements: Vec<Element> = Vec::new();
    while let Some(line) = lines.next() {
        let words: Vec<&[u8]> = text::tokens(line.text).take(6).collect();
        let wrong = |wrong: Wrong| {
            input.malformed(Location::Line(line.number), text::quote(line.text), wrong.expected, wrong.advice)
        };
        match words.as_slice() {
            [b"comment", name, ..] if name.eq_ignore_ascii_case(b"TextureFile") => {
                let line = String::from_utf8_lossy(line.text.trim_ascii()).into_owned();
                texture = line.split_once("File").map(|l| l.1.trim().to_owned()).or(texture);
            }
            [b"ply", ..] | [b"comment", ..] | [b"obj_info", ..] | [] => {}
            [b"format", name, ..] => encoding = Some(encoding_of(name).ok_or_else(|| wrong(WRONG_FORMAT))?),
            [b"element", name, count, ..] => {
                let element = element_of(name, count).ok_or_else(|| wrong(WRONG_ELEMENT))?;
                if elements.len() >= MOST_ELEMENTS {
                    return Err(wrong(TOO_MANY_ELEMENTS));
                }
                elements.push(element);
            }
            [b"property", rest @ ..] => {
                let property = property_of(rest).ok_or_else(|| wrong(WRONG_PROPERTY))?;
                let element = elements.last_mut().ok_or_else(|| wrong(NO_ELEMENT))?;
                element.properties.push(property);
            }
            [b"end_header", ..] => {
                let encoding = encoding.ok_or_else(|| wrong(NO_FORMAT))?;
                let end = end_of_header(input.data, lines.offset(), encoding);
                return Ok(Header { encoding, elements, end, lines: line.number, texture });
            }
            _ => return Err(wrong(UNKNOWN_LINE)),
        }
    }
    Err(input.malformed(
        Location::Byte(input.data.len() as u64),
        "the end of the file",
        "end_header",
        "The file is cut off: get it again",
    ))
}

/// What a wrong line should be, and what to do.
struct Wrong {
    expected: &'static str,
    advice: &'static str,
}

const WRONG_FORMAT: Wrong = Wrong {
    expected: "format ascii, binary_little_endian or binary_big_endian",
    advice: "Write the file again in one of them",
};
const WRONG_ELEMENT: Wrong =
    Wrong { expected: "an element's name and how many there are", advice: "Correct the count in the header" };
const TOO_MANY_ELEMENTS: Wrong = Wrong {
    expected: "the end of the header",
    advice: "No program writes so many elements: the file is damaged",
};
const WRONG_PROPERTY: Wrong = Wrong {
    expected: "property TYPE NAME or property list TYPE TYPE NAME with the types of PLY 1.0",
    advice: "Correct the header",
};
const NO_ELEMENT: Wrong =
    Wrong { expected: "an element before its properties", advice: "Correct the header" };
const NO_FORMAT: Wrong =
    Wrong { expected: "a line \"format ...\" in the header", advice: "The file is damaged: get it again" };
const UNKNOWN_LINE: Wrong = Wrong {
    expected: "format, comment, obj_info, element, property or end_header",
    advice: "The header is damaged: get the file again",
};

fn encoding_of(name: &[u8]) -> Option<Encoding> {
    Some(match name {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::Little,
        b"binary_big_endian" => Encoding::Big,
        _ => return None,
    })
}

fn element_of(name: &[u8], count: &[u8]) -> Option<Element> {
    let count = std::str::from_utf8(count).ok()?.parse().ok()?;
    Some(Element { name: String::from_utf8_lossy(name).into_owned(), count, properties: Vec::new() })
}

fn property_of(words: &[&[u8]]) -> Option<Property> {
    let (name, kind, list) = match words {
        [b"list", count, item, name, ..] => (name, kind_of(item)?, Some(kind_of(count)?)),
        [kind, name, ..] => (name, kind_of(kind)?, None),
        _ => return None,
    };
    Some(Property { name: String::from_utf8_lossy(name).into_owned(), kind, list })
}

/// Where the data begin, if the line behind `end_header` begins at byte `next`.
fn end_of_header(data: &[u8], next: usize, encoding: Encoding) -> usize {
    let end = next.min(data.len());
    // Where lines end with a lone CR, a LF behind `end_header` is the first byte of the data.
    let first = text::first_line(data).len();
    let cr_only = data.get(first) == Some(&b'\r') && data.get(first + 1) != Some(&b'\n');
    let is_data = encoding != Encoding::Ascii && cr_only && end >= 2 && &data[end - 2..end] == b"\r\n";
    end - usize::from(is_data)
}
