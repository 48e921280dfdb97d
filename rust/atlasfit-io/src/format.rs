//! The formats, and how a file's format is found: by its first bytes; its name only breaks ties.

use crate::{e57, las, off, pcd, stl, text};
use std::path::Path;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Stanford PLY, ASCII or binary. Holds everything.
    Ply,
    /// Wavefront OBJ, with an MTL beside it.
    Obj,
    /// Geomview OFF with its COFF, NOFF, STOFF.
    Off,
    /// STL, binary or ASCII.
    Stl,
    /// Plain columns of numbers: XYZ, TXT, CSV, PTS, ASC.
    Xyz,
    /// Point Cloud Library PCD. Read only.
    Pcd,
    /// LAS, or LAZ. Read only.
    Las,
    /// ASTM E57. Read only.
    E57,
    /// glTF 2.0, as text (`.gltf`) or in one binary file (`.glb`).
    Gltf,
}

impl Format {
    /// The format's name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Obj => "OBJ",
            Self::Off => "OFF",
            Self::Stl => "STL",
            Self::Xyz => "XYZ",
            Self::Pcd => "PCD",
            Self::Las => "LAS",
            Self::E57 => "E57",
            Self::Gltf => "glTF",
        }
    }

    /// Whether this crate writes the format; all are read (LAZ, E57 and glTF by default features).
    #[must_use]
    pub const fn can_write(self) -> bool {
        !matches!(self, Self::Pcd | Self::Las | Self::E57)
    }

    /// The extension of its files, lower case.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Off => "off",
            Self::Stl => "stl",
            Self::Xyz => "xyz",
            Self::Pcd => "pcd",
            Self::Las => "las",
            Self::E57 => "e57",
            Self::Gltf => "glb",
        }
    }

    /// Whether it holds points that no face names.
    #[must_use]
    pub const fn holds_points(self) -> bool {
        !matches!(self, Self::Stl)
    }

    /// Whether it holds faces.
    #[must_use]
    pub const fn holds_faces(self) -> bool {
        !matches!(self, Self::Xyz | Self::Pcd | Self::Las | Self::E57)
    }

    /// Whether it holds texture coordinates per corner as this crate writes it, and names a texture.
    #[must_use]
    pub const fn holds_uv(self) -> bool {
        matches!(self, Self::Ply | Self::Obj | Self::Gltf)
    }

    /// Bytes of memory that writing some content in this format takes, the content included: a rough upper
    /// bound. GLB is put together in memory, the other formats are written as they go.
    #[must_use]
    pub const fn memory_to_write(self, content_bytes: u64, corner_bytes: u64) -> u64 {
        match self {
            // The bytes of the file, and which vertex each was; UVs and normals of corners split vertices.
            Self::Gltf => 2 * content_bytes + 4 * corner_bytes,
            _ => content_bytes,
        }
    }

    /// The format that a file name asks for.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "ply" => Self::Ply,
            "obj" => Self::Obj,
            "xyz" | "txt" | "csv" | "pts" | "asc" | "xyzn" | "xyzrgb" | "neu" => Self::Xyz,
            "off" | "coff" | "noff" => Self::Off,
            "stl" => Self::Stl,
            "pcd" => Self::Pcd,
            "las" | "laz" => Self::Las,
            "e57" => Self::E57,
            "glb" | "gltf" => Self::Gltf,
            _ => return None,
        })
    }

    /// The format of some content. `name` decides only where the content fits several.
    #[must_use]
    pub fn detect(data: &[u8], name: &Path) -> Option<Self> {
        let asked = Self::from_path(name);
        let first = text::first_line(data);
        let word = text::tokens(first).next().unwrap_or(b"");
        if word == b"ply" {
            return Some(Self::Ply);
        }
        if data.starts_with(b"glTF") {
            return Some(Self::Gltf);
        }
        if las::is_las(data) {
            return Some(Self::Las);
        }
        if e57::is_e57(data) {
            return Some(Self::E57);
        }
        if pcd::is_pcd(data) {
            return Some(Self::Pcd);
        }
        if stl::is_stl(data, asked == Some(Self::Stl)) {
            return Some(Self::Stl);
        }
        if data.iter().take(4096).any(|&b| b == 0) {
            return None;
        }
        if word.starts_with(b"{") {
            return Some(Self::Gltf);
        }
        // The keyword may be missing from a file that is called so.
        if off::is_off(data) || asked == Some(Self::Off) && text::starts_with_counts(data) {
            return Some(Self::Off);
        }
        text_format(data, asked)
    }
}

/// Votes over the first lines of a text without a signature: OBJ statements, or rows of numbers.
fn text_format(data: &[u8], asked: Option<Format>) -> Option<Format> {
    const LINES: usize = 2000;
    const STATEMENTS: [&[u8]; 14] = [
        b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"usemtl", b"mtllib", b"usemap",
        b"cstype",
    ];
    let (mut obj, mut rows) = (0usize, 0usize);
    let mut lines = text::Lines::new(data);
    for _ in 0..LINES {
        let Some(line) = lines.next() else { break };
        let Some(word) = text::tokens(line.text).next() else { continue };
        if word.starts_with(b"#") {
            continue;
        }
        if STATEMENTS.contains(&word) {
            obj += 1;
        } else if text::row_of_numbers(line.text) >= 3 {
            rows += 1;
        }
    }
    if obj > rows {
        Some(Format::Obj)
    } else if rows > 0 {
        Some(Format::Xyz)
    } else {
        // Nothing but comments and blank lines: an empty file of the kind that its name says.
        asked.filter(|f| matches!(f, Format::Obj | Format::Xyz))
    }
}
