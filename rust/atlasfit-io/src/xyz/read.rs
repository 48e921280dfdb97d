//! Reads columns of numbers.

use super::columns::{Column, MOST_COLUMNS, Table, named};
use super::layout::{Layout, SAMPLE, is_comment, layout};
use crate::bad_lines::BadLines;
use crate::content::Content;
use crate::error::Result;
use crate::input::Input;
use crate::text::{Line, Lines};
use atlasfit::geometry::{Attribute, ScalarKind};

/// What stands in front of the rows.
#[derive(Default)]
struct Preamble {
    /// The columns that a header or comment line names.
    header: Option<Vec<Column>>,
    /// The number of points that PTS writes in front.
    announced: Option<u64>,
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let layout = layout(input.data);
    let mut bad = BadLines::default();
    let mut lines = input.lines(0, 0);
    let preamble = preamble(&mut lines, layout, &mut bad);
    let table = table(input, lines, layout, preamble.header.as_deref(), &mut bad)?;
    let rows = table.rows();
    if rows == 0 || bad.count > rows as u64 {
        let count = bad.count;
        return Err(bad.error(
            input,
            "rows of three or more numbers, x y z first or named in a header line",
            format!("{count} lines are like this and {rows} could be read: check that this is a point file"),
        ));
    }
    input.report.add("lines that are not rows of numbers, left out", bad.count, bad.first());
    if let Some(count) = preamble.announced.filter(|&c| c != rows as u64) {
        let what = format!("points fewer or more than the first line announces ({count})");
        input.report.add(what, count.abs_diff(rows as u64), None);
    }
    Ok(content(input, table, preamble))
}

/// Reads what stands in front of the rows; `lines` then goes on with the first row.
fn preamble(lines: &mut Lines<'_>, layout: Layout, bad: &mut BadLines) -> Preamble {
    let mut out = Preamble::default();
    let mut start = lines.clone();
    while let Some(line) = lines.next() {
        let text = line.text.trim_ascii();
        if text.is_empty() {
            continue;
        }
        let numbers = layout.row(text);
        if numbers >= 3 && !is_comment(text) {
            break;
        }
        if let Some(columns) = named(text, layout) {
            out.header = Some(columns);
        } else if numbers == 1 && layout.fields(text).count() == 1 && out.announced.is_none() {
            out.announced = std::str::from_utf8(text).ok().and_then(|t| t.parse().ok());
        } else if !is_comment(text) && !text.first().is_some_and(u8::is_ascii_alphabetic) {
            bad.add(Line { text, number: line.number });
        }
        start = lines.clone();
        if out.header.is_some() && !is_comment(text) || lines.number() > SAMPLE as u64 {
            break;
        }
    }
    *lines = start;
    out
}

/// Reads the rows. The first of them give the width unless a header does.
fn table(
    input: &mut Input<'_>,
    lines: Lines<'_>,
    layout: Layout,
    header: Option<&[Column]>,
    bad: &mut BadLines,
) -> Result<Table> {
    let at = header.map_or([0, 1, 2], |h| {
        [0, 1, 2].map(|k| h.iter().position(|c| *c == Column::Position(k)).unwrap_or(k))
    });
    let fields = |line: Line<'_>| layout.fields(line.text.trim_ascii()).take(MOST_COLUMNS).count();
    let sample = lines.clone().take(SAMPLE).filter(|l| !is_comment(l.text.trim_ascii()));
    let width = sample.map(fields).max().unwrap_or(0);
    let width = width.max(at[0].max(at[1]).max(at[2]) + 1).min(MOST_COLUMNS);
    let mut table = Table { width, values: Vec::new(), missing: vec![0; width] };
    let mut row = vec![None; width];
    for line in lines {
        let text = line.text.trim_ascii();
        if text.is_empty() || is_comment(text) {
            continue;
        }
        row.fill(None);
        for (slot, field) in row.iter_mut().zip(layout.fields(text)) {
            *slot = layout.number(field);
        }
        if at.iter().any(|&c| row[c].is_none()) {
            bad.add(Line { text, number: line.number });
            continue;
        }
        // The table and the columns made from it.
        input.reserve(2 * width, 8)?;
        for (value, missing) in row.iter().zip(&mut table.missing) {
            *missing += usize::from(value.is_none());
            table.values.push(value.unwrap_or(0.0));
        }
    }
    Ok(table)
}

/// Makes a cloud of a table.
fn content(input: &mut Input<'_>, mut table: Table, preamble: Preamble) -> Content {
    drop_ragged(input, &mut table, preamble.header.is_some());
    let columns = match preamble.header {
        Some(mut header) => {
            let unnamed = header.len()..table.width;
            header.extend(unnamed.map(|c| Column::Scalar(format!("column_{}", c + 1))));
            header.truncate(table.width);
            header
        }
        None => {
            let extension = input.path.extension().and_then(|e| e.to_str());
            table.guess(preamble.announced.is_some() || extension == Some("pts"))
        }
    };
    // The places of three columns, if the table has them all.
    let three = |column: fn(usize) -> Column| -> Option<Vec<usize>> {
        let place = |k| columns.iter().position(|c| *c == column(k)).filter(|&c| !table.lacks(c));
        (0..3).map(place).collect()
    };
    let rows = || table.values.chunks_exact(table.width);
    let mut out = Content::default();
    let at = three(Column::Position).unwrap_or_else(|| vec![0, 1, 2]);
    out.cloud.positions = rows().map(|r| [r[at[0]], r[at[1]], r[at[2]]]).collect();
    if let Some(n) = three(Column::Normal) {
        let normal = |r: &[f64]| [r[n[0]] as f32, r[n[1]] as f32, r[n[2]] as f32];
        out.cloud.normals = Some(rows().map(normal).collect());
    }
    if let Some(c) = three(Column::Color) {
        let alpha = columns.iter().position(|c| *c == Column::Color(3));
        let scale = color_scale(&table, &c);
        let color = |r: &[f64]| {
            let a = alpha.map_or(1.0, |a| r[a] / scale);
            [r[c[0]] / scale, r[c[1]] / scale, r[c[2]] / scale, a].map(|v| v as f32)
        };
        out.cloud.colors = Some(rows().map(color).collect());
    }
    for (c, column) in columns.into_iter().enumerate() {
        if let Column::Scalar(name) = column
            && !table.lacks(c)
        {
            out.cloud.attributes.push(attribute(name, table.column(c).collect()));
        }
    }
    out
}

/// Drops the columns that many rows lack, and with them all that follow when nothing names them. Reports it.
fn drop_ragged(input: &mut Input<'_>, table: &mut Table, has_header: bool) {
    let first_lacking = (0..table.width).find(|&c| table.lacks(c)).unwrap_or(table.width);
    let kept = if has_header { table.width } else { first_lacking.max(3) };
    let dropped = |c: usize| c >= kept || table.lacks(c);
    let lost = (3..table.width).filter(|&c| dropped(c) && table.missing[c] < table.rows()).count();
    input.report.add("columns that many rows lack or that are not numbers, left out", lost as u64, None);
    let filled = (0..table.width).filter(|&c| !dropped(c)).map(|c| table.missing[c]).sum::<usize>();
    input.report.add("missing numbers, set to 0", filled as u64, None);
    table.truncate(kept);
}

/// What 1 is in the colour columns: whole numbers are bytes (or 16 bits when larger), fractions are in [0,
/// 1].
fn color_scale(table: &Table, columns: &[usize]) -> f64 {
    let largest = columns.iter().flat_map(|&c| table.column(c)).fold(0.0, f64::max);
    let integer = columns.iter().all(|&c| table.column(c).all(|v| v.fract() == 0.0));
    if largest > 255.0 {
        65535.0
    } else if integer || largest > 1.0 {
        255.0
    } else {
        1.0
    }
}

/// A column as an attribute: of whole numbers if all are, but a measure stays a measure.
fn attribute(name: String, values: Vec<f64>) -> Attribute {
    const MEASURES: [&str; 4] = ["intensity", "quality", "confidence", "column"];
    let measure = MEASURES.iter().any(|m| name.to_lowercase().contains(m));
    let whole = |v: &f64| v.fract() == 0.0 && v.abs() <= f64::from(i32::MAX);
    let kind = if !measure && values.iter().all(whole) { ScalarKind::I32 } else { ScalarKind::F64 };
    Attribute { name, width: 1, kind, values }
}
