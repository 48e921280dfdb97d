//! Columns of numbers as text: XYZ, TXT, CSV, PTS, ASC.
//!
//! Read: the separator (blank, comma, semicolon, bar), decimal commas, header and comment lines, and the count
//! line of PTS are detected. Columns get their meaning from a header line if there is one, or else from their
//! values: three whole numbers up to 255 are a colour, three that make unit vectors a normal. Written: `x y z`,
//! then normals, colours and attributes, named in a first line where a reader could not guess them.

use crate::error::{Place, Result};
use crate::load::{Content, Input};
use crate::save::{Job, Written, colors_lost, to_u8};
use crate::text::{self, Lines};
use atlasfit::geometry::{Attribute, ScalarKind};
use std::io::Write;

/// Lines looked at to find separator and columns.
const SAMPLE: usize = 1000;
/// Columns beyond this are not read: nobody names so many.
const MOST_COLUMNS: usize = 64;
/// A column must be there in all but one of so many rows to be kept.
const RAGGED: usize = 100;

/// How a line falls into fields.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layout {
    separator: Option<u8>,
    decimal_comma: bool,
}

impl Layout {
    fn fields(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        line.split(move |&b| match self.separator {
            None => b.is_ascii_whitespace(),
            Some(s) => b == s,
        })
        .map(<[u8]>::trim_ascii)
        .filter(move |f| self.separator.is_some() || !f.is_empty())
    }
    fn number(self, field: &[u8]) -> Option<f64> {
        if self.decimal_comma { text::number_or_comma(field).map(|n| n.0) } else { text::number(field) }
    }
    /// Numbers anywhere in a line: names may stand between them.
    fn numbers(self, line: &[u8]) -> usize {
        self.fields(line).filter(|f| self.number(f).is_some()).count()
    }
    /// Numbers at the start of a line.
    fn row(self, line: &[u8]) -> usize {
        self.fields(line).take_while(|f| self.number(f).is_some()).count()
    }
}

fn is_comment(line: &[u8]) -> bool {
    [&b"#"[..], b"//", b"%", b"!"].iter().any(|c| line.starts_with(c))
}

/// The layout under which most sample lines hold at least three numbers.
fn layout(data: &[u8]) -> Layout {
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

/// What a column holds.
#[derive(Clone, Debug, PartialEq)]
enum Column {
    Position(usize),
    Normal(usize),
    Color(usize),
    Scalar(String),
}

/// The meaning of a header's word.
fn meaning(word: &str) -> Column {
    let bare = word.trim_matches(['"', '\'', '#', '/']).trim().to_lowercase();
    let name = bare.split(['[', '(']).next().unwrap_or("").trim();
    match name {
        "x" | "easting" | "east" | "px" | "points:0" | "x_coord" => Column::Position(0),
        "y" | "northing" | "north" | "py" | "points:1" | "y_coord" => Column::Position(1),
        "z" | "elevation" | "height" | "altitude" | "pz" | "points:2" | "z_coord" => Column::Position(2),
        "nx" | "normal_x" | "normalx" => Column::Normal(0),
        "ny" | "normal_y" | "normaly" => Column::Normal(1),
        "nz" | "normal_z" | "normalz" => Column::Normal(2),
        "r" | "red" => Column::Color(0),
        "g" | "green" => Column::Color(1),
        "b" | "blue" => Column::Color(2),
        "a" | "alpha" => Column::Color(3),
        _ => Column::Scalar(word.trim_matches(['"', '\'']).trim().to_owned()),
    }
}

/// The columns named by a header or comment line, if it names x, y and z.
fn named(line: &[u8], layout: Layout) -> Option<Vec<Column>> {
    let text = String::from_utf8_lossy(line);
    let text = text.trim().trim_start_matches(['#', '/', '%', '!']).trim();
    // A comment may separate its names otherwise than the rows.
    let words: Vec<&str> = match layout.separator {
        Some(s) if text.as_bytes().contains(&s) => text.split(char::from(s)).collect(),
        _ => text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).collect(),
    };
    let columns: Vec<Column> = words.iter().take(MOST_COLUMNS).map(|w| meaning(w)).collect();
    (0..3).all(|k| columns.iter().filter(|c| **c == Column::Position(k)).count() == 1).then_some(columns)
}

/// Rows of equal length, one after the other.
struct Table {
    width: usize,
    values: Vec<f64>,
    /// Per column, rows that have no number there.
    missing: Vec<usize>,
}

impl Table {
    fn rows(&self) -> usize {
        self.values.len() / self.width
    }
    fn column(&self, c: usize) -> impl Iterator<Item = f64> {
        self.values.iter().skip(c).step_by(self.width).copied()
    }
    /// Whether three columns hold whole numbers from 0 to 255.
    fn is_color(&self, c: usize) -> bool {
        c + 3 <= self.width
            && (c..c + 3).all(|c| self.column(c).all(|v| v.fract() == 0.0 && (0.0..=255.0).contains(&v)))
    }
    /// Whether three columns hold unit vectors (or zeros where there is none).
    fn is_normal(&self, c: usize) -> bool {
        let length2 = |r: &[f64]| r[c..c + 3].iter().map(|v| v * v).sum::<f64>();
        let mut units = 0;
        c + 3 <= self.width
            && self.values.chunks_exact(self.width).all(|r| {
                let l = length2(r);
                units += usize::from((l - 1.0).abs() < 0.02);
                l == 0.0 || (l - 1.0).abs() < 0.02
            })
            && units > 0
    }
    /// Columns by their values, for rows without a header. `pts`: intensity comes before the colour.
    fn guess(&self, pts: bool) -> Vec<Column> {
        let mut out: Vec<Column> = (0..3).map(Column::Position).collect();
        let (mut color, mut normal) = (false, false);
        while out.len() < self.width {
            let c = out.len();
            let intensity_first = c == 3 && self.width == 7 && self.is_color(4) && (pts || !self.is_color(3));
            if !color && !intensity_first && self.is_color(c) {
                color = true;
                out.extend((0..3).map(Column::Color));
            } else if !normal && self.is_normal(c) {
                normal = true;
                out.extend((0..3).map(Column::Normal));
            } else if c == 3 && (self.width == 4 || intensity_first) {
                out.push(Column::Scalar("intensity".into()));
            } else {
                out.push(Column::Scalar(format!("column_{}", c + 1)));
            }
        }
        out
    }
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let layout = layout(input.data);
    let mut header: Option<Vec<Column>> = None;
    let mut announced: Option<u64> = None;
    let (mut bad, mut first_bad) = (0u64, None::<(u64, String)>);
    let mut width = 0;
    let mut lines = Lines::new(input.data);
    // The first row gives the width unless a header does; later rows may be longer, see below.
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
            header = Some(columns);
        } else if numbers == 1 && layout.fields(text).count() == 1 && announced.is_none() {
            announced = std::str::from_utf8(text).ok().and_then(|t| t.parse().ok());
        } else if !is_comment(text) && !text.first().is_some_and(u8::is_ascii_alphabetic) {
            bad += 1;
            first_bad.get_or_insert((line.number, text::quote(text)));
        }
        if header.is_some() && !is_comment(text) || lines.number() > SAMPLE as u64 {
            start = lines.clone();
            break;
        }
        start = lines.clone();
    }
    for line in start.clone().take(SAMPLE) {
        let text = line.text.trim_ascii();
        if !is_comment(text) {
            width = width.max(layout.fields(text).take(MOST_COLUMNS).count());
        }
    }
    let at = header.as_ref().map_or([0, 1, 2], |h| {
        [0, 1, 2].map(|k| h.iter().position(|c| *c == Column::Position(k)).unwrap_or(k))
    });
    let width = width.max(at[0].max(at[1]).max(at[2]) + 1).min(MOST_COLUMNS);
    let mut table = Table { width, values: Vec::new(), missing: vec![0; width] };
    let mut row = vec![None; width];
    for line in start {
        let text = line.text.trim_ascii();
        if text.is_empty() || is_comment(text) {
            continue;
        }
        row.fill(None);
        for (slot, field) in row.iter_mut().zip(layout.fields(text)) {
            *slot = layout.number(field);
        }
        if at.iter().any(|&c| row[c].is_none()) {
            bad += 1;
            first_bad.get_or_insert((line.number, text::quote(text)));
            continue;
        }
        // The table and the columns made from it.
        input.reserve(2 * width, 8)?;
        for (value, missing) in row.iter().zip(&mut table.missing) {
            *missing += usize::from(value.is_none());
            table.values.push(value.unwrap_or(0.0));
        }
    }
    let rows = table.rows();
    if rows == 0 || bad > rows as u64 {
        let (number, found) = first_bad.unwrap_or((1, "no row of numbers".into()));
        return Err(input.malformed(
            Place::Line(number),
            found,
            "rows of three or more numbers, x y z first or named in a header line",
            format!("{bad} lines are like this and {rows} could be read: check that this is a point file"),
        ));
    }
    input.report.add(
        "lines that are not rows of numbers, left out",
        bad,
        first_bad.map(|f| format!("line {}", f.0)),
    );
    if let Some(count) = announced.filter(|&c| c != rows as u64) {
        let what = format!("points fewer or more than the first line announces ({count})");
        input.report.add(what, count.abs_diff(rows as u64), None);
    }
    Ok(content(input, table, header, announced.is_some()))
}

/// Makes a cloud of a table.
fn content(input: &mut Input<'_>, mut table: Table, header: Option<Vec<Column>>, counted: bool) -> Content {
    let rows = table.rows();
    // Ragged files: a column that many rows lack is left out, and with it all that follow when nothing names them.
    let lacking = |c: usize| table.missing[c] * RAGGED > rows;
    let kept = match &header {
        Some(_) => table.width,
        None => (0..table.width).find(|&c| lacking(c)).unwrap_or(table.width).max(3),
    };
    let dropped = |c: usize| c >= kept || lacking(c);
    let lost = (3..table.width).filter(|&c| dropped(c) && table.missing[c] < rows).count();
    input.report.add("columns that many rows lack or that are not numbers, left out", lost as u64, None);
    let filled = (0..table.width).filter(|&c| !dropped(c)).map(|c| table.missing[c]).sum::<usize>();
    input.report.add("missing numbers, set to 0", filled as u64, None);
    if kept < table.width {
        let old = std::mem::take(&mut table.values);
        table.values = old.chunks_exact(table.width).flat_map(|r| &r[..kept]).copied().collect();
        table.width = kept;
    }
    let pts = counted || Some("pts") == input.path.extension().and_then(|e| e.to_str());
    let columns = match header {
        Some(mut h) => {
            while h.len() < table.width {
                h.push(Column::Scalar(format!("column_{}", h.len() + 1)));
            }
            h.truncate(table.width);
            h
        }
        None => table.guess(pts),
    };
    let whole = |k: &dyn Fn(usize) -> Column, n: usize| -> Option<Vec<usize>> {
        (0..n).map(|i| columns.iter().position(|c| *c == k(i)).filter(|&c| !lacking_in(&table, c))).collect()
    };
    let mut out = Content::default();
    let at = whole(&Column::Position, 3).unwrap_or_else(|| vec![0, 1, 2]);
    out.cloud.positions =
        table.values.chunks_exact(table.width).map(|r| [r[at[0]], r[at[1]], r[at[2]]]).collect();
    if let Some(n) = whole(&Column::Normal, 3) {
        let normal = |r: &[f64]| [r[n[0]] as f32, r[n[1]] as f32, r[n[2]] as f32];
        out.cloud.normals = Some(table.values.chunks_exact(table.width).map(normal).collect());
    }
    if let Some(c) = whole(&Column::Color, 3) {
        let alpha = columns.iter().position(|c| *c == Column::Color(3));
        let largest = c.iter().flat_map(|&c| table.column(c)).fold(0.0, f64::max);
        let integer = c.iter().all(|&c| table.column(c).all(|v| v.fract() == 0.0));
        // Whole numbers are bytes (or 16 bits when larger), fractions are in [0, 1].
        let scale = if largest > 255.0 {
            65535.0
        } else if integer || largest > 1.0 {
            255.0
        } else {
            1.0
        };
        let color = |r: &[f64]| {
            let a = alpha.map_or(1.0, |a| r[a] / scale);
            [r[c[0]] / scale, r[c[1]] / scale, r[c[2]] / scale, a].map(|v| v as f32)
        };
        out.cloud.colors = Some(table.values.chunks_exact(table.width).map(color).collect());
    }
    for (c, column) in columns.iter().enumerate() {
        if let Column::Scalar(name) = column
            && !lacking_in(&table, c)
        {
            let values: Vec<f64> = table.column(c).collect();
            // A measure stays a measure even where its values happen to be whole.
            let measure = ["intensity", "quality", "confidence", "column"]
                .iter()
                .any(|m| name.to_lowercase().contains(m));
            let whole = |v: &f64| v.fract() == 0.0 && v.abs() <= f64::from(i32::MAX);
            let kind = if !measure && values.iter().all(whole) { ScalarKind::I32 } else { ScalarKind::F64 };
            out.cloud.attributes.push(Attribute { name: name.clone(), width: 1, kind, values });
        }
    }
    out
}

fn lacking_in(table: &Table, c: usize) -> bool {
    table.missing[c] * RAGGED > table.rows()
}

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> std::io::Result<Written> {
    let mut written = Written::default();
    colors_lost(job.colors, &mut written);
    if !job.triangles.is_empty() {
        written.lost.push(format!("{} triangles: columns of numbers hold points only", job.triangles.len()));
    }
    let alpha = job.has_alpha();
    let separator = if job.extension == "csv" { "," } else { " " };
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
