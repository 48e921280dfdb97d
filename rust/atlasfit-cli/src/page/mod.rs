//! The report that people look at: one HTML file that needs no network.
//!
//! In: what a command did, in words and numbers ([`Page`]) and as shapes to turn ([`scene::Scene`]). Out: the
//! bytes of the file. Each file imports only files that stand before it: `scene`, `bars`.

pub mod bars;
pub mod scene;

use bars::{Bars, escaped};
use scene::Scene;
use std::fmt::Write as _;

/// The frame of the page, its style, and the program that shows the scene.
const FRAME: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const VIEWER: &str = include_str!("viewer.js");

/// What the page says and shows.
pub struct Page<'a> {
    /// What was done to what.
    pub title: String,
    /// The command's report as text: a line for each fact, its name in the first [`NAME`] columns.
    pub facts: &'a str,
    pub warnings: &'a [String],
    pub notes: &'a [String],
    pub scene: &'a Scene,
    pub bars: &'a [Bars],
}

/// Columns of the names in a report's lines.
const NAME: usize = 15;

impl Page<'_> {
    /// The whole file.
    pub fn html(&self) -> String {
        let mut told = String::new();
        for (kind, texts) in [("warning", self.warnings), ("note", self.notes)] {
            for text in texts {
                let _ = writeln!(told, "<p class=\"{kind}\"><b>{kind}</b> {}</p>", escaped(text));
            }
        }
        if self.warnings.is_empty() {
            told.insert_str(0, "<p>There is nothing to warn of.</p>\n");
        }
        let parts = [
            ("TITLE", escaped(&self.title)),
            ("STYLE", STYLE.to_owned()),
            ("TOLD", told),
            ("FACTS", self.facts()),
            ("BARS", self.bars.iter().map(Bars::html).collect()),
            ("VERSION", env!("CARGO_PKG_VERSION").to_owned()),
            // In a script element only this character could end the JSON.
            ("SCENE", self.scene.json().to_string().replace('<', "\\u003c")),
            ("VIEWER", VIEWER.to_owned()),
        ];
        filled(FRAME, &parts)
    }

    /// The facts as rows of a table.
    fn facts(&self) -> String {
        let mut rows = String::new();
        for line in self.facts.lines() {
            let (name, value) = line.split_at_checked(NAME).unwrap_or((line, ""));
            let (name, value) = (escaped(name.trim()), escaped(value.trim()));
            let _ = writeln!(rows, "<tr><th>{name}</th><td>{value}</td></tr>");
        }
        rows
    }
}

/// The frame with each `{{NAME}}` replaced. What is put in is not searched again.
fn filled(frame: &str, parts: &[(&str, String)]) -> String {
    let mut pieces = frame.split("{{");
    let mut out = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        out += parts.iter().find(|p| p.0 == name).map_or("", |p| p.1.as_str());
        out += rest;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_and_texts_cannot_become_markup() {
        let page = Page {
            title: "</title><script>alert(1)</script> {{SCENE}}".into(),
            facts: "scan           10 points in <b>.ply\n",
            warnings: &["a < b & c".into()],
            notes: &[],
            scene: &Scene::default(),
            bars: &[],
        };
        let html = page.html();
        assert!(!html.contains("alert(1)</script>") && html.contains("&lt;b&gt;.ply"), "{html}");
        assert!(html.contains("a &lt; b &amp; c") && html.contains("<th>scan</th>"), "{html}");
        assert!(html.contains("{{SCENE}}"), "what is put in is not replaced again");
    }
}
