//! Material libraries of OBJ files (MTL).
//!
//! In: the text of a library. Out: the images that its materials name; the same text with other images.

use super::edit::argument;
use crate::text::{self, Lines};

/// An image of a material.
pub(crate) struct Map {
    pub material: String,
    /// The statement in lower case: `map_kd`, `norm`, ...
    pub key: String,
    /// The file's name.
    pub file: String,
    /// What texture coordinates are multiplied by, then moved by (`-s`, `-o`).
    pub scale: [f32; 2],
    pub offset: [f32; 2],
}

/// Statements that name an image which UVs place on the surface.
const MAPS: [&str; 15] = [
    "map_kd", "map_ka", "map_ks", "map_ke", "map_ns", "map_d", "map_tr", "map_pr", "map_pm", "map_ps",
    "map_bump", "bump", "norm", "disp", "decal",
];

/// The image that a statement names.
fn map_of(statement: &[u8], material: &str) -> Option<Map> {
    let key = String::from_utf8_lossy(text::tokens(statement).next()?).to_lowercase();
    if !MAPS.contains(&&*key) {
        return None;
    }
    let (mut scale, mut offset) = ([1.0; 2], [0.0; 2]);
    let argument = argument(statement);
    let mut rest = &*argument;
    // Options stand before the name, which may hold spaces.
    while rest.starts_with('-') {
        let mut words = rest.splitn(2, char::is_whitespace);
        let option = words.next().unwrap_or_default().to_owned();
        rest = words.next().unwrap_or_default().trim_start();
        let most = match &*option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for k in 0..most {
            let (word, behind) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            let value = word.parse::<f32>().ok();
            if behind.is_empty() || (most > 1 && value.is_none()) {
                break;
            }
            match (&*option, value, k) {
                ("-s", Some(v), 0 | 1) => scale[k] = v,
                ("-o", Some(v), 0 | 1) => offset[k] = v,
                _ => {}
            }
            rest = behind.trim_start();
        }
    }
    (!rest.is_empty()).then(|| Map { material: material.into(), key, file: rest.into(), scale, offset })
}

/// Calls `each` with every line of a library, its image and its material.
fn each_line(library: &[u8], mut each: impl FnMut(&[u8], Option<Map>)) {
    let mut material = String::new();
    for line in Lines::new(library) {
        if text::tokens(line.text).next() == Some(b"newmtl") {
            material = argument(line.text);
        }
        each(line.text, map_of(line.text, &material));
    }
}

/// All images of a library.
pub(crate) fn maps(library: &[u8]) -> Vec<Map> {
    let mut out = Vec::new();
    each_line(library, |_, map| out.extend(map));
    out
}

/// The library with the image that `name` gives for each map; one without is left out.
pub(crate) fn renamed(library: &[u8], name: impl Fn(&Map) -> Option<String>) -> Vec<u8> {
    let mut out = Vec::new();
    each_line(library, |text, map| {
        match map {
            None => out.extend_from_slice(text),
            Some(map) => {
                let Some(file) = name(&map) else { return };
                let key = text::tokens(text).next().unwrap_or_default();
                out.extend_from_slice(key);
                out.push(b' ');
                if map.key == "bump" || map.key == "map_bump" || map.key == "norm" {
                    let text = String::from_utf8_lossy(text);
                    let mut words = text.split_whitespace().skip_while(|w| *w != "-bm");
                    if let (Some(option), Some(value)) = (words.next(), words.next()) {
                        out.extend_from_slice(format!("{option} {value} ").as_bytes());
                    }
                }
                out.extend_from_slice(file.as_bytes());
            }
        }
        out.push(b'\n');
    });
    out
}
