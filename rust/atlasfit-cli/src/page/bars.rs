//! Bars of numbers as HTML: how often values occur, how long stages took.
//!
//! In: names and sizes. Out: markup that needs no script.

use crate::number::short;
use atlasfit::Stage;
use std::fmt::Write as _;

/// A plot of bars.
pub struct Bars {
    pub title: String,
    /// What the bars show, in a sentence.
    pub words: String,
    /// Name, size, and the size in words, of each bar.
    pub bars: Vec<(String, f64, String)>,
    /// Upright and without gaps, for a histogram: only the first, middle and last names are shown.
    pub upright: bool,
}

/// Bars of a histogram.
const BINS: usize = 41;

impl Bars {
    /// How long each stage took.
    pub fn of_stages(seconds: &[(Stage, f64)]) -> Self {
        let all: f64 = seconds.iter().map(|s| s.1).sum();
        let bar = |(stage, s): &(Stage, f64)| (stage.name().to_owned(), *s, format!("{s:.2} s"));
        Self {
            title: "Time of the stages".into(),
            words: format!("{all:.2} seconds in all, without reading and writing."),
            bars: seconds.iter().filter(|s| s.1 >= 0.005).map(bar).collect(),
            upright: false,
        }
    }

    /// How many of the values lie in each of the bins between two numbers; those beyond are in the outer
    /// bins, what is no number is left out.
    pub fn histogram(title: &str, words: String, values: &[f64], [from, to]: [f64; 2]) -> Self {
        let mut counts = [0usize; BINS];
        let step = (to - from) / BINS as f64;
        for v in values.iter().filter(|v| !v.is_nan()) {
            counts[(((v - from) / step).max(0.0) as usize).min(BINS - 1)] += 1;
        }
        let bar = |(i, &n): (usize, &usize)| {
            let middle = from + (i as f64 + 0.5) * step;
            (short(middle), n as f64, format!("{n} at {}", short(middle)))
        };
        Self { title: title.into(), words, bars: counts.iter().enumerate().map(bar).collect(), upright: true }
    }

    /// As markup.
    pub fn html(&self) -> String {
        let most = self.bars.iter().map(|b| b.1).fold(1e-300, f64::max);
        let (title, words) = (escaped(&self.title), escaped(&self.words));
        let mut out = format!("<section>\n<h2>{title}</h2>\n<p>{words}</p>\n");
        if self.upright {
            out += "<div class=\"bins\">";
            for (_, size, text) in &self.bars {
                let share = 100.0 * size / most;
                let _ = write!(out, "<i style=\"height:{share:.1}%\" title=\"{}\"></i>", escaped(text));
            }
            let name = |i: usize| self.bars.get(i).map_or("", |b| &b.0);
            let last = self.bars.len().saturating_sub(1);
            let _ = write!(
                out,
                "</div>\n<div class=\"ends\"><span>{}</span><span>{}</span><span>{}</span></div>\n",
                name(0),
                name(last / 2),
                name(last)
            );
        } else {
            out += "<table class=\"bars\">\n";
            for (name, size, text) in &self.bars {
                let (share, name, text) = (100.0 * size / most, escaped(name), escaped(text));
                let _ = writeln!(
                    out,
                    "<tr><th>{name}</th><td><i style=\"width:{share:.1}%\"></i></td><td>{text}</td></tr>"
                );
            }
            out += "</table>\n";
        }
        out + "</section>\n"
    }
}

/// Text as markup that shows it.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_falls_into_a_bin() {
        let values = [-9.0, -1.0, 0.0, 1.0, 9.0, f64::INFINITY, f64::NAN];
        let bars = Bars::histogram("", String::new(), &values, [-1.0, 1.0]);
        let counts: Vec<f64> = bars.bars.iter().map(|b| b.1).collect();
        assert_eq!((counts[0], counts[BINS / 2], counts[BINS - 1]), (2.0, 1.0, 3.0));
        assert_eq!(bars.bars[BINS / 2].0, "0");
    }
}
