//! What `denoise` tells, as text and as JSON.

use super::scans::named;
use crate::files;
use crate::number::{boundary, count, counted, json as number, seconds, short, stages_json, vertices};
use atlasfit::geometry::TriMesh;
use atlasfit::pipeline::Report;
use atlasfit::register::{Registration, SweepMotion};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

/// What was done.
pub struct Done<'a> {
    /// The files of the scan.
    pub scans: &'a [PathBuf],
    pub report: &'a Report,
    pub surface: &'a TriMesh,
    /// Whether the noise was given, not estimated.
    pub noise_given: bool,
    /// Whether UVs were asked for.
    pub uv: bool,
    /// The middle one of the points' uncertainties, where they were asked for.
    pub unsure: Option<f64>,
    /// Seconds of everything, reading and writing too.
    pub seconds: f64,
    /// The files that were written.
    pub files: &'a [String],
}

impl Done<'_> {
    /// What was found and made, for people.
    pub fn facts(&self) -> String {
        let mut text = self.scan_text();
        if !self.surface.triangles.is_empty() {
            text += &self.surface_text();
        }
        text
    }

    /// The report for people.
    pub fn text(&self) -> String {
        let mut text = self.facts();
        let _ = writeln!(text, "seconds        {}", seconds(self.seconds, &self.report.seconds));
        let _ = writeln!(text, "written        {}", self.files.join(", "));
        text
    }

    /// What the surface is like.
    fn surface_text(&self) -> String {
        let (r, mesh) = (self.report, self.surface);
        let mut text = String::new();
        let _ = writeln!(
            text,
            "surface        {}, {}, {}{}",
            vertices(mesh.positions.len()),
            counted(mesh.triangles.len(), "face"),
            counted(r.parts, "part"),
            if r.one_sided { ", one-sided" } else { "" }
        );
        if r.dropped_parts > 0 {
            let _ = writeln!(
                text,
                "left out       {} with {}",
                counted(r.dropped_parts, "part"),
                counted(r.dropped_points, "point")
            );
        }
        let _ = writeln!(text, "boundary       {}", boundary(r.boundary_edges, r.boundary_loops));
        if self.uv {
            let _ = writeln!(text, "UV charts      {}", count(r.uv_charts));
        }
        text
    }

    /// What was found in the scan.
    fn scan_text(&self) -> String {
        let r = self.report;
        let mut text = format!("scan           {} in {}\n", counted(r.points, "point"), named(self.scans));
        if let Some(moved) = &r.registration {
            text += &registered(moved);
        }
        if r.not_finite + r.duplicates > 0 {
            let _ = writeln!(
                text,
                "repairs        {} not finite and left out, {}",
                counted(r.not_finite, "point"),
                counted(r.duplicates, "duplicate")
            );
        }
        let given = if self.noise_given { " as given" } else { "" };
        let _ = writeln!(text, "spacing        {}", short(r.spacing));
        let _ = writeln!(text, "noise          {}{given}", short(r.noise));
        if let Some(sd) = self.unsure {
            let widened = r.uncertainty_factor.map_or_else(
                || "not checked by the residuals".to_string(),
                |f| format!("widened {} times by the residuals", short(f)),
            );
            let _ = writeln!(text, "uncertainty    {} (median), {widened}", short(sd));
        }
        let followed = match r.followed_outliers {
            0 => String::new(),
            n => format!(", {} put between their neighbours in the mesh", count(n)),
        };
        let _ = writeln!(text, "outliers       {} set aside{followed}", counted(r.outliers, "point"));
        let _ = writeln!(text, "charts         {}", count(r.charts));
        text
    }

    /// The report as JSON.
    pub fn json(&self) -> Value {
        let (r, mesh) = (self.report, self.surface);
        let mut said = json!({
            "scan": files::text(&self.scans[0]), "points": r.points, "not_finite": r.not_finite,
            "duplicates": r.duplicates, "outliers": r.outliers, "followed_outliers": r.followed_outliers,
            "spacing": number(r.spacing),
            "noise": number(r.noise), "charts": r.charts, "voxel": number(r.voxel),
            "vertices": mesh.positions.len(), "faces": mesh.triangles.len(), "parts": r.parts,
            "dropped_parts": r.dropped_parts, "dropped_points": r.dropped_points, "one_sided": r.one_sided,
            "boundary_edges": r.boundary_edges,
            "boundary_loops": r.boundary_loops, "uv_charts": r.uv_charts, "seconds": number(self.seconds),
            "stages": stages_json(&r.seconds), "files": self.files,
        });
        if self.scans.len() > 1 {
            said["scans"] = self.scans.iter().map(|path| files::text(path)).collect();
        }
        if let Some(moved) = &r.registration {
            said["registration"] = registration(moved);
        }
        if let Some(sd) = self.unsure {
            said["uncertainty"] = number(sd);
            said["uncertainty_factor"] = r.uncertainty_factor.map_or(Value::Null, number);
        }
        said
    }
}

/// How the sweeps were moved, for people.
fn registered(r: &Registration) -> String {
    let moved = r.sweeps.iter().map(|s| s.moved).fold(0.0, f64::max);
    let turned = r.sweeps.iter().map(|s| s.motion.angle()).fold(0.0, f64::max);
    format!(
        "sweeps         {} moved by {} at the most, turned by {} degrees; apart {} before, {} after\n",
        count(r.sweeps.len()),
        short(moved),
        short(turned.to_degrees()),
        short(r.apart_before),
        short(r.apart_after)
    )
}

/// How the sweeps were moved, as JSON: matrices take a point of the scan to where it was moved.
fn registration(r: &Registration) -> Value {
    let sweep = |s: &SweepMotion| {
        let row = |i: usize| {
            let [a, b, c] = s.motion.rotation[i];
            json!([number(a), number(b), number(c), number(s.motion.shift[i])])
        };
        json!({
            "sweep": s.sweep, "points": s.points, "pairs": s.pairs, "moved": number(s.moved),
            "degrees": number(s.motion.angle().to_degrees()), "matrix": [row(0), row(1), row(2)],
        })
    };
    let sweeps: Vec<Value> = r.sweeps.iter().map(sweep).collect();
    json!({
        "apart_before": number(r.apart_before), "apart_after": number(r.apart_after), "sweeps": sweeps,
    })
}
