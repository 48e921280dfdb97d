//! The table of `bench denoise`, as Markdown.

use super::super::cells::{GAUSSIAN, Spec};
use super::row::Row;
use crate::number::short;
use std::fmt::Write as _;

/// The heading of the table.
const HEADING: &str = "| shape | sigma | acc (med) | com (med) | flipped | CD / floor | points | s \
    | parts, boundary, non-manifold | UV charts, 95%, flips, overlaps | Poisson acc, com, flipped, s \
    | oracle acc, com | acc, com : Poisson | acc, com : oracle | s : Poisson |\n\
    |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

/// In how many cells ours is at or below the peers in both acc and com.
#[derive(Default)]
struct Score {
    cells: usize,
    beats: usize,
    beats_oracle: usize,
}

/// One line per cell: ours, the peer's default setting, the oracle, and ratios. Ours is better where a ratio
/// is below 1.
///
/// `default` names the peer's default setting.
pub fn table(specs: &[Spec], default: Option<&str>, rows: &[Row]) -> String {
    let mut out = String::from(HEADING);
    let mut score = Score::default();
    for spec in specs {
        let cell: Vec<&Row> = rows.iter().filter(|r| r.spec == *spec).collect();
        let _ = write!(out, "| {} | {} ", spec.scene(), spec.sigma);
        line(&mut out, &mut score, &cell, default);
    }
    if score.cells > 0 {
        let _ = writeln!(
            out,
            "\nAt or below Poisson's default in both acc and com: {} of {cells} cells; \
             at or below the oracle: {} of {cells}.",
            score.beats,
            score.beats_oracle,
            cells = score.cells
        );
    }
    if specs.iter().any(|s| s.kind != GAUSSIAN) {
        by_kind(&mut out, specs, default, rows);
    }
    if rows.iter().any(|r| r.cached) {
        out.push_str("\n`*` the peer's time is from another run (--peer-cache).\n");
    }
    out
}

/// The rest of a cell's line.
fn line(out: &mut String, score: &mut Score, cell: &[&Row], default: Option<&str>) {
    let ours = cell.iter().find(|r| r.method == "ours");
    let default = default.and_then(|s| cell.iter().find(|r| r.method == s));
    let best =
        |key: &str| cell.iter().filter(|r| r.method != "ours").map(|r| r.get(key)).fold(f64::NAN, f64::min);
    match ours {
        Some(r) => our_columns(out, r),
        None => out.push_str("| | | | | | | | "),
    }
    match default {
        Some(p) => {
            let _ = write!(
                out,
                "| {}, {}, {}, {:.2}{} | {}, {} ",
                short(p.get("acc")),
                short(p.get("com")),
                percent(p.get("flipped")),
                p.seconds,
                if p.cached { "*" } else { "" },
                short(best("acc")),
                short(best("com"))
            );
        }
        None => out.push_str("| | "),
    }
    let (Some(r), Some(p)) = (ours, default) else {
        out.push_str("| | | |\n");
        return;
    };
    let ratio = |key: &str, to: f64| r.get(key) / to;
    let (a, c) = (ratio("acc", p.get("acc")), ratio("com", p.get("com")));
    let (oa, oc) = (ratio("acc", best("acc")), ratio("com", best("com")));
    score.cells += 1;
    score.beats += usize::from(a <= 1.0 && c <= 1.0);
    score.beats_oracle += usize::from(oa <= 1.0 && oc <= 1.0);
    let star = if p.cached { "*" } else { "" };
    let _ = writeln!(out, "| {a:.2}, {c:.2} | {oa:.2}, {oc:.2} | {:.2}{star} |", r.seconds / p.seconds);
}

/// The columns of our own surface.
fn our_columns(out: &mut String, r: &Row) {
    let _ = write!(
        out,
        "| {} ({}) | {} ({}) | {} | {} | {} | {:.2} | {}, {}, {} | {}, {:.2}, {}, {} ",
        short(r.get("acc")),
        short(r.get("acc_med")),
        short(r.get("com")),
        short(r.get("com_med")),
        percent(r.get("flipped")),
        known(r.get("cd") / r.get("floor"), |x| format!("{x:.2}")),
        short(r.get("points_rms")),
        r.seconds,
        r.get("parts"),
        r.get("boundary"),
        r.get("nonmanifold"),
        r.get("uv_charts"),
        r.get("uv_p95"),
        r.get("uv_flips"),
        r.get("uv_overlaps")
    );
}

/// A second table: what the cells of each kind have in common.
fn by_kind(out: &mut String, specs: &[Spec], default: Option<&str>, rows: &[Row]) {
    out.push_str(
        "\n| kind | cells | acc : Poisson | com : Poisson | flipped | flipped, Poisson |\n\
         |---|---|---|---|---|---|\n",
    );
    let mut kinds: Vec<&str> = Vec::new();
    for spec in specs {
        if !kinds.contains(&spec.kind.as_str()) {
            kinds.push(&spec.kind);
        }
    }
    for kind in kinds {
        let of = |method: &str| -> Vec<&Row> {
            rows.iter().filter(|r| r.spec.kind == kind && r.method == method).collect()
        };
        let (ours, theirs) = (of("ours"), default.map(of).unwrap_or_default());
        // Geometric mean over the cells that both have.
        let ratio = |key: &str| {
            let pairs = ours.iter().filter_map(|r| Some((r, theirs.iter().find(|p| p.spec == r.spec)?)));
            let logs: Vec<f64> = pairs.map(|(r, p)| (r.get(key) / p.get(key)).ln()).collect();
            known((logs.iter().sum::<f64>() / logs.len() as f64).exp(), |x| format!("{x:.2}"))
        };
        let flipped =
            |rows: &[&Row]| percent(rows.iter().map(|r| r.get("flipped")).sum::<f64>() / rows.len() as f64);
        let _ = writeln!(
            out,
            "| {kind} | {} | {} | {} | {} | {} |",
            ours.len(),
            ratio("acc"),
            ratio("com"),
            flipped(&ours),
            flipped(&theirs)
        );
    }
    out.push_str(
        "\nRatios are geometric means over the cells of a kind, flipped shares of the area plain means.\n",
    );
}

/// A share in per cent.
fn percent(share: f64) -> String {
    known(share, |x| format!("{:.1} %", 100.0 * x))
}

/// A number as text, a dash where it is not known.
fn known(x: f64, text: impl Fn(f64) -> String) -> String {
    if x.is_nan() { "-".into() } else { text(x) }
}
