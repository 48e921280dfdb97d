//! Rows of numbers, and what their columns mean: by a header's words, or by their values.

use super::layout::Layout;

/// Columns beyond this are not read: nobody names so many.
pub(super) const MOST_COLUMNS: usize = 64;
/// A column must be there in all but one of so many rows to be kept.
const RAGGED: usize = 100;

/// What a column holds; the number is the coordinate or the channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Column {
    Position(usize),
    Normal(usize),
    Color(usize),
    Scalar(String),
}

/// The meaning of a header's word.
pub(super) fn meaning(word: &str) -> Column {
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
pub(super) fn named(line: &[u8], layout: Layout) -> Option<Vec<Column>> {
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
pub(super) struct Table {
    /// Numbers per row.
    pub width: usize,
    pub values: Vec<f64>,
    /// Per column, rows that have no number there.
    pub missing: Vec<usize>,
}

impl Table {
    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.values.len() / self.width
    }

    /// The numbers of a column.
    pub fn column(&self, c: usize) -> impl Iterator<Item = f64> {
        self.values.iter().skip(c).step_by(self.width).copied()
    }

    /// Whether three columns hold whole numbers from 0 to 255.
    fn is_color(&self, c: usize) -> bool {
        c + 3 <= self.width
            && (c..c + 3).all(|c| self.column(c).all(|v| v.fract() == 0.0 && (0.0..=255.0).contains(&v)))
    }

    /// Whether three columns hold unit vectors (or zeros where there is none).
    fn is_normal(&self, c: usize) -> bool {
        /// Of the squared length of a unit vector written with few digits.
        const ROUNDING: f64 = 0.02;
        let length2 = |r: &[f64]| r[c..c + 3].iter().map(|v| v * v).sum::<f64>();
        let mut units = 0;
        c + 3 <= self.width
            && self.values.chunks_exact(self.width).all(|r| {
                let l = length2(r);
                units += usize::from((l - 1.0).abs() < ROUNDING);
                l == 0.0 || (l - 1.0).abs() < ROUNDING
            })
            && units > 0
    }

    /// Columns by their values, for rows without a header. `pts`: intensity comes before the colour.
    pub fn guess(&self, pts: bool) -> Vec<Column> {
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

    /// Whether so many rows lack a column that it is left out.
    pub fn lacks(&self, c: usize) -> bool {
        self.missing[c] * RAGGED > self.rows()
    }

    /// Keeps the first columns of every row.
    pub fn truncate(&mut self, width: usize) {
        if width < self.width {
            let old = std::mem::take(&mut self.values);
            self.values = old.chunks_exact(self.width).flat_map(|r| &r[..width]).copied().collect();
            self.width = width;
        }
    }
}
