//! What `unwrap` tells: notes on the mesh and the layout, the report as text and as JSON.

use crate::console::Console;
use crate::files;
use crate::number::{count, counted, json as number, seconds, short, stages_json, vertices};
use atlasfit::Stage;
use atlasfit::measure::UvQuality;
use atlasfit::unwrap::{UnwrapOptions, UvLayout};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// What the user should know about the mesh and the result.
pub fn notes(layout: &UvLayout, options: &UnwrapOptions, console: &Console) {
    for (n, what) in [
        (layout.degenerate_faces, "faces without area got small or empty UV triangles"),
        (layout.duplicate_faces, "faces that repeat another got UVs of their own"),
        (
            layout.non_manifold_edges,
            "edges where more than two faces, or two that face apart, meet: cut in the UVs",
        ),
        (
            layout.welded_vertices,
            "vertices lie where another does: taken for one in the layout only, the mesh keeps them",
        ),
        (layout.split_polygons, "polygons that do not lie flat were cut: these are written as triangles"),
    ] {
        if n > 0 {
            console.note(format_args!("{} {what}", count(n)));
        }
    }
    if layout.stretch_bound > options.max_stretch {
        console.note(format_args!(
            "the stretch bound was raised to {} for fewer charts",
            short(layout.stretch_bound)
        ));
    }
    if let Some(most) = options.max_charts
        && layout.charts > most
    {
        console.note(format_args!(
            "{} is the least found for this mesh and its constraints",
            counted(layout.charts, "chart")
        ));
    }
    layout.warnings.iter().for_each(|w| console.note(w));
}

/// What was done.
pub struct Done<'a> {
    /// The file of the mesh.
    pub path: &'a Path,
    pub vertices: usize,
    pub triangles: usize,
    /// Faces of the file, where some have more than three corners.
    pub polygons: Option<usize>,
    pub layout: &'a UvLayout,
    pub quality: &'a UvQuality,
    /// Seconds of everything, reading and writing too.
    pub seconds: f64,
    /// Seconds of each stage of unwrapping.
    pub stages: &'a [(Stage, f64)],
    /// The files that were written.
    pub files: &'a [String],
}

impl Done<'_> {
    /// What was found and made, for people.
    pub fn facts(&self) -> String {
        let (layout, quality) = (self.layout, self.quality);
        let mut text = format!(
            "mesh           {}, {}{} in {}\n",
            vertices(self.vertices),
            counted(self.triangles, "triangle"),
            self.polygons.map_or(String::new(), |n| format!(" of {}", counted(n, "face"))),
            self.path.display()
        );
        let _ = writeln!(text, "charts         {}", count(layout.charts));
        if layout.stacked_parts > 0 {
            let _ = writeln!(text, "stacked        {} on others", counted(layout.stacked_parts, "part"));
        }
        if layout.straightened_charts > 0 {
            let _ = writeln!(
                text,
                "straightened   {}: {:.1}% of all outlines along the page's sides",
                counted(layout.straightened_charts, "chart"),
                100.0 * quality.straightness
            );
        }
        let _ = writeln!(
            text,
            "stretch        95% of the area below {:.3}, L2 {:.4}, conformal {:.3}",
            quality.stretch_p95, quality.stretch_l2, quality.conformal
        );
        let _ = writeln!(text, "seams          {} times the square root of the area", short(quality.seam));
        let _ = writeln!(
            text,
            "flips          {}, overlapping faces {}{}, collapsed {}",
            quality.flips,
            quality.overlapping_faces,
            if layout.stacked_parts > 0 { " (with those of stacked parts)" } else { "" },
            quality.degenerate
        );
        let _ = writeln!(
            text,
            "pages          {} of {} x {} texels, {:.1}% covered, {} texels per unit",
            layout.pages,
            layout.width,
            layout.height,
            100.0 * quality.coverage,
            short(layout.texels_per_unit)
        );
        text
    }

    /// The report for people.
    pub fn text(&self) -> String {
        let mut text = self.facts();
        let _ = writeln!(text, "seconds        {}", seconds(self.seconds, self.stages));
        let _ = writeln!(text, "written        {}", self.files.join(", "));
        text
    }

    /// The report as JSON.
    pub fn json(&self) -> Value {
        let (layout, quality) = (self.layout, self.quality);
        json!({
            "mesh": files::text(self.path), "vertices": self.vertices, "triangles": self.triangles,
            "polygons": self.polygons, "charts": layout.charts,
            "stretch_bound": number(layout.stretch_bound), "over_stretched": number(layout.over_stretched),
            "stretch_p95": number(quality.stretch_p95), "stretch_l2": number(quality.stretch_l2),
            "conformal": number(quality.conformal), "seam": number(quality.seam), "flips": quality.flips,
            "overlapping_faces": quality.overlapping_faces, "collapsed": quality.degenerate,
            "pages": layout.pages, "width": layout.width, "height": layout.height,
            "coverage": number(quality.coverage), "texels_per_unit": number(layout.texels_per_unit),
            "degenerate_faces": layout.degenerate_faces, "duplicate_faces": layout.duplicate_faces,
            "non_manifold_edges": layout.non_manifold_edges, "welded_vertices": layout.welded_vertices,
            "stacked_parts": layout.stacked_parts, "straightened_charts": layout.straightened_charts,
            "straightness": number(quality.straightness), "repaired_charts": layout.repaired_charts,
            "split_polygons": layout.split_polygons, "padding": layout.padding_px,
            "warnings": layout.warnings, "seconds": number(self.seconds),
            "stages": stages_json(self.stages),
            "files": self.files,
        })
    }
}
