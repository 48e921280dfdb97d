//! Reads PLY: element after element, then the columns become a cloud or a mesh.

use super::body::Body;
use super::header::{self, Element, Encoding};
use super::{faces, vertices};
use crate::content::Content;
use crate::error::{Location, Result};
use crate::faces::Faces;
use crate::input::Input;

/// Whether an element holds faces.
fn is_faces(element: &Element) -> bool {
    matches!(element.name.as_str(), "face" | "tristrips")
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let header = header::read(input)?;
    let vertex = vertex_element(input, &header.elements)?;
    let has_faces = header.elements.iter().any(|e| is_faces(e) && e.count > 0);
    let mut body = Body::new(input, &header);
    let mut columns = None;
    let mut triangles = Faces::default();
    for (i, element) in header.elements.iter().enumerate() {
        if i == vertex {
            columns = Some(vertices::read(&mut body, element, has_faces)?);
        } else if element.name == "face" {
            faces::read(&mut body, element, &mut triangles)?;
        } else if element.name == "tristrips" {
            faces::read_strips(&mut body, element, &mut triangles)?;
        } else {
            let what = format!("rows of the element \"{}\", which is not used", element.name);
            body.input.report.add(what, element.count, None);
            // What follows the last element of use need not be looked at.
            if i < vertex || header.elements[i..].iter().any(is_faces) {
                body.skip(element)?;
            }
        }
    }
    let Some(columns) = columns else { return Ok(Content::default()) };
    let texture = header.texture.filter(|_| has_faces).and_then(|name| input.beside(&name));
    let faces = triangles.finish(&columns.positions, &mut input.report);
    Ok(Content { texture, ..columns.finish(input, faces)? })
}

/// Whether the file is rows of points behind the header and nothing else that is used: then it can be read
/// block by block.
pub(crate) fn is_rows(input: &Input<'_>) -> bool {
    header::read(input).is_ok_and(|h| {
        h.encoding != Encoding::Ascii
            && vertex_element(input, &h.elements).is_ok_and(|v| v == 0 && h.elements[v].stride().is_some())
            && (h.elements[1..].iter().all(|e| e.count == 0) || !h.elements.iter().any(is_faces))
    })
}

/// Which element holds the points: "vertex", or the first that has x, y and z.
fn vertex_element(input: &Input<'_>, elements: &[Element]) -> Result<usize> {
    let has_xyz = |e: &Element| {
        ["x", "y", "z"]
            .iter()
            .all(|c| e.properties.iter().any(|p| p.list.is_none() && p.name.eq_ignore_ascii_case(c)))
    };
    let named = elements.iter().position(|e| e.name == "vertex" && (has_xyz(e) || e.count == 0));
    named.or_else(|| elements.iter().position(has_xyz)).ok_or_else(|| {
        let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
        input.malformed(
            Location::Whole,
            format!("only the elements: {}", if names.is_empty() { "none".into() } else { names.join(", ") }),
            "an element \"vertex\" with the properties x, y and z",
            "This file holds no points",
        )
    })
}
