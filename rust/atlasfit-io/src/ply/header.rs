//! The PLY header: elements and their properties.

use crate::bytes::size;
use crate::error::{Place, Result};
use crate::load::Input;
use crate::text::{self, Lines};
use atlasfit::geometry::ScalarKind;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Debug, Clone)]
pub struct Property {
    pub name: String,
    pub kind: ScalarKind,
    /// The type of the count in front of a list.
    pub list: Option<ScalarKind>,
}

#[derive(Debug, Clone)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes per row, `None` where lists make them differ.
    pub fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.list.is_none().then(|| size(p.kind))).sum()
    }
    /// Fewest bytes that a row takes in a binary file.
    pub fn least_bytes(&self) -> usize {
        self.properties.iter().map(|p| size(p.list.unwrap_or(p.kind))).sum()
    }
}

pub const fn type_name(kind: ScalarKind) -> &'static str {
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

pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the data begin.
    pub end: usize,
    /// Lines of the header.
    pub lines: u64,
    /// The image file that a comment names.
    pub texture: Option<String>,
}

/// Known files have up to ten.
const MOST_ELEMENTS: usize = 1000;

pub fn read(input: &Input<'_>) -> Result<Header> {
    let mut lines = Lines::new(input.data);
    // Where lines end with a lone CR, a LF behind `end_header` is the first byte of the data.
    let first = text::first_line(input.data).len();
    let cr_only = input.data.get(first) == Some(&b'\r') && input.data.get(first + 1) != Some(&b'\n');
    let mut encoding = None;
    let mut texture = None;
    let mut elements: Vec<Element> = Vec::new();
    while let Some(line) = lines.next() {
        let words: Vec<&[u8]> = text::tokens(line.text).take(6).collect();
        let wrong = |expected: &str, advice: &str| {
            input.malformed(Place::Line(line.number), text::quote(line.text), expected, advice)
        };
        match words.as_slice() {
            [b"comment", name, ..] if name.eq_ignore_ascii_case(b"TextureFile") => {
                let line = String::from_utf8_lossy(line.text.trim_ascii()).into_owned();
                texture = line.split_once("File").map(|l| l.1.trim().to_owned()).or(texture);
            }
            [b"ply", ..] | [b"comment", ..] | [b"obj_info", ..] | [] => {}
            [b"format", name, ..] => {
                encoding = Some(match *name {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => {
                        return Err(wrong(
                            "format ascii, binary_little_endian or binary_big_endian",
                            "Write the file again in one of them",
                        ));
                    }
                });
            }
            [b"element", name, count, ..] => {
                let count =
                    std::str::from_utf8(count).ok().and_then(|c| c.parse::<u64>().ok()).ok_or_else(|| {
                        wrong("an element's name and how many there are", "Correct the count in the header")
                    })?;
                if elements.len() >= MOST_ELEMENTS {
                    return Err(wrong(
                        "the end of the header",
                        "No program writes so many elements: the file is damaged",
                    ));
                }
                elements.push(Element {
                    name: String::from_utf8_lossy(name).into_owned(),
                    count,
                    properties: Vec::new(),
                });
            }
            [b"property", rest @ ..] => {
                let property = match rest {
                    [b"list", count, item, name, ..] => kind_of(count).zip(kind_of(item)).map(|(c, i)| {
                        Property { name: String::from_utf8_lossy(name).into_owned(), kind: i, list: Some(c) }
                    }),
                    [kind, name, ..] => kind_of(kind).map(|kind| Property {
                        name: String::from_utf8_lossy(name).into_owned(),
                        kind,
                        list: None,
                    }),
                    _ => None,
                };
                match (property, elements.last_mut()) {
                    (Some(p), Some(e)) => e.properties.push(p),
                    (None, _) => {
                        return Err(wrong(
                            "property TYPE NAME or property list TYPE TYPE NAME with the types of PLY 1.0",
                            "Correct the header",
                        ));
                    }
                    (_, None) => return Err(wrong("an element before its properties", "Correct the header")),
                }
            }
            [b"end_header", ..] => {
                let Some(encoding) = encoding else {
                    return Err(wrong(
                        "a line \"format ...\" in the header",
                        "The file is damaged: get it again",
                    ));
                };
                let mut end = lines.offset().min(input.data.len());
                if encoding != Encoding::Ascii && cr_only && end >= 2 && &input.data[end - 2..end] == b"\r\n"
                {
                    end -= 1;
                }
                return Ok(Header { encoding, elements, end, lines: line.number, texture });
            }
            _ => {
                return Err(wrong(
                    "format, comment, obj_info, element, property or end_header",
                    "The header is damaged: get the file again",
                ));
            }
        }
    }
    Err(input.malformed(
        Place::Byte(input.data.len() as u64),
        "the end of the file",
        "end_header",
        "The file is cut off: get it again",
    ))
}
