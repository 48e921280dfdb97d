//! Writes columns of numbers.

use super::columns::{Column, meaning};
use crate::job::{Job, Written, to_u8};
use std::io::{Result, Write};

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> Result<Written> {
    let mut written = Written::default();
    written.note_rounded(job.colors);
    if !job.triangles.is_empty() {
        written.lost.push(format!("{} triangles: columns of numbers hold points only", job.triangles.len()));
    }
    let alpha = job.has_alpha();
    let separator = if job.extension == "csv" { "," } else { " " };
    let names = names(job, alpha);
    if job.attributes.iter().any(|a| a.width > 1) {
        written.lost.push("attributes of several numbers, split into columns".into());
    }
    if job.extension == "csv" {
        writeln!(out, "{}", names.join(","))?;
    } else if job.extension == "pts" {
        writeln!(out, "{}", job.positions.len())?;
    }
    // `x y z` and `x y z nx ny nz` are understood by everyone, and by some only without a comment.
    if job.extension != "csv" && (job.colors.is_some() || !job.attributes.is_empty()) {
        writeln!(out, "# {}", names.join(" "))?;
    }
    for (i, [x, y, z]) in job.positions.iter().enumerate() {
        write!(out, "{x}{separator}{y}{separator}{z}")?;
        for c in job.normals.map(|n| n[i]).into_iter().flatten() {
            write!(out, "{separator}{c}")?;
        }
        if let Some(colors) = job.colors {
            for &c in &colors[i][..if alpha { 4 } else { 3 }] {
                write!(out, "{separator}{}", to_u8(c))?;
            }
        }
        for a in job.attributes {
            for v in &a.values[i * a.width..(i + 1) * a.width] {
                write!(out, "{separator}{v}")?;
            }
        }
        writeln!(out)?;
    }
    Ok(written)
}

/// The names of the columns: an attribute's is changed where it would be split or mean something else.
fn names(job: &Job<'_>, alpha: bool) -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "z"].map(Into::into).into();
    if job.normals.is_some() {
        names.extend(["nx", "ny", "nz"].map(Into::into));
    }
    if job.colors.is_some() {
        names.extend(["red", "green", "blue"].map(Into::into));
        if alpha {
            names.push("alpha".into());
        }
    }
    let clean = |c: char| if c.is_whitespace() || c.is_control() || ",;|\"'#/".contains(c) { '_' } else { c };
    for a in job.attributes {
        for k in 0..a.width {
            let mut name: String = a.name.chars().map(clean).collect();
            if a.width > 1 {
                name = format!("{name}_{k}");
            }
            while name.is_empty() || !matches!(meaning(&name), Column::Scalar(_)) || names.contains(&name) {
                name.push('_');
            }
            names.push(name);
        }
    }
    names
}
