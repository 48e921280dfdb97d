//! Where results go: outputs are checked before the work starts, and written whole or not at all. `-` is
//! standard output, which the report then leaves for standard error.

use crate::console::{Console, RunArgs, Usage};
use crate::files::{STANDARD, format_named};
use anyhow::{Context as _, Result};
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit_io::{Asset, Format, Polygons, SaveCloud, SaveMesh, Texture, check_output, is_same_file};
use std::io::Write as _;
use std::path::Path;

/// How outputs are written.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct OutputArgs {
    /// Format of an output whose name has no extension that says so: ply, obj, glb, off, stl, xyz
    #[arg(long, value_name = "FORMAT", value_parser = format_named, help_heading = "Files")]
    pub output_format: Option<Format>,
    /// Write text where the format has both text and binary
    #[arg(long, help_heading = "Files")]
    pub ascii: bool,
    /// Let the output replace the input
    #[arg(long, help_heading = "Files")]
    pub force: bool,
}

/// What an output has to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// Whatever the input does.
    Anything,
    Points,
    Faces,
    /// Faces with texture coordinates.
    Uvs,
    /// Pixels, in a PNG file.
    Picture,
    /// Text and pictures, in an HTML file.
    Page,
}

/// An output of a command.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// The option that names it.
    pub option: &'static str,
    pub path: &'a Path,
    pub holds: Holds,
}

impl Output<'_> {
    fn is_standard(&self) -> bool {
        self.path == Path::new(STANDARD)
    }

    /// The format to write.
    pub fn format(&self, args: OutputArgs) -> Result<Format> {
        const WRITTEN: &str = "Use .ply, .obj, .glb, .off, .stl or .xyz";
        let path = self.path.display();
        let format = Format::from_path(self.path).or(args.output_format);
        let wrong = match format {
            None if self.is_standard() => "standard output has no extension. Give --output-format".into(),
            None => format!("{path}: no known format has this extension. {WRITTEN}"),
            Some(f) if !f.can_write() => {
                format!("{path}: {} files are only read, not written. {WRITTEN}", f.name())
            }
            Some(f) if self.holds == Holds::Points && !f.holds_points() => {
                format!("{path}: {} files hold faces only, no points. Use .ply or .xyz", f.name())
            }
            Some(f) if matches!(self.holds, Holds::Faces | Holds::Uvs) && !f.holds_faces() => {
                format!("{path}: {} files hold no faces. Use .ply, .obj or .glb", f.name())
            }
            Some(f) if self.holds == Holds::Uvs && !f.holds_uv() => {
                format!("{path}: {} files hold no UVs. Use .ply, .obj or .glb", f.name())
            }
            Some(f) => return Ok(f),
        };
        Err(Usage(wrong).into())
    }

    /// Fails where this cannot be written.
    fn check(&self, args: OutputArgs, inputs: &[&Path]) -> Result<()> {
        let named = |extension| self.path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
        let wrong = match self.holds {
            Holds::Picture if !self.is_standard() && !named("png") => "pictures are PNG files. Use .png",
            Holds::Page if !named("html") => "reports are HTML files. Use .html",
            Holds::Picture | Holds::Page => "",
            _ => {
                self.format(args)?;
                ""
            }
        };
        if !wrong.is_empty() {
            return Err(Usage(format!("{}: {wrong}", self.path.display())).into());
        }
        if self.is_standard() {
            return Ok(());
        }
        if !args.force && inputs.iter().any(|i| is_same_file(i, self.path)) {
            return Err(Usage(format!(
                "{} is an input. Give --force to replace it, or another {}",
                self.path.display(),
                self.option
            ))
            .into());
        }
        Ok(check_output(self.path)?)
    }
}

/// Fails where an output cannot be written, or would replace another or an input: a mistake must not cost the
/// work.
pub fn check(outputs: &[Output<'_>], inputs: &[&Path], args: OutputArgs, console: &Console) -> Result<()> {
    for (i, output) in outputs.iter().enumerate() {
        output.check(args, inputs)?;
        let same = |o: &&Output<'_>| o.path == output.path || is_same_file(o.path, output.path);
        if let Some(other) = outputs[..i].iter().find(same) {
            return Err(Usage(format!(
                "{} and {} name the same file, {}. Give two",
                other.option,
                output.option,
                output.path.display()
            ))
            .into());
        }
    }
    if args.output_format.is_some()
        && outputs.iter().all(|o| o.holds == Holds::Page || Format::from_path(o.path).is_some())
    {
        let wrong = "--output-format is for an output without a known extension. Leave it away";
        return Err(Usage(wrong.into()).into());
    }
    if outputs.iter().any(Output::is_standard) {
        console.take_output();
    }
    Ok(())
}

/// What was written.
#[derive(Debug, Default)]
pub struct Written {
    pub files: Vec<String>,
    /// What the formats could not hold, by file.
    pub lost: Vec<String>,
}

impl Written {
    /// Tells what was lost, and remembers it.
    fn add(&mut self, files: &[impl AsRef<Path>], lost: Vec<String>, console: &Console) {
        let name = files.first().map(|f| f.as_ref().display().to_string()).unwrap_or_default();
        lost.iter().for_each(|l| console.note(format_args!("{name}: not kept: {l}")));
        self.files.extend(files.iter().map(|f| f.as_ref().display().to_string()));
        self.lost.extend(lost);
    }
}

/// Writes the results of a command.
pub struct Writer<'a> {
    pub args: OutputArgs,
    pub run: &'a RunArgs,
    pub console: &'a Console,
    pub written: Written,
}

impl<'a> Writer<'a> {
    pub fn new(args: OutputArgs, run: &'a RunArgs, console: &'a Console) -> Self {
        Self { args, run, console, written: Written::default() }
    }

    /// Writes a mesh. What `kept` says is not among what was lost.
    pub fn mesh(
        &mut self,
        output: Output<'_>,
        mesh: &TriMesh,
        polygons: Option<&Polygons>,
        png: Option<&[u8]>,
        kept: fn(&str) -> bool,
    ) -> Result<()> {
        let how = SaveMesh::default()
            .with_format(Some(output.format(self.args)?))
            .with_ascii(self.args.ascii)
            .with_polygons(polygons)
            .with_texture(png.map(Texture::Png))
            .with_stop(self.console.stop(self.run));
        let (files, mut lost) = if output.is_standard() {
            (vec![output.path.to_owned()], atlasfit_io::write_mesh(std::io::stdout().lock(), mesh, &how)?)
        } else {
            let saved = atlasfit_io::save_mesh(output.path, mesh, &how)?;
            (saved.files, saved.lost)
        };
        lost.retain(|l| !kept(l));
        self.written.add(&files, lost, self.console);
        Ok(())
    }

    /// Writes the file of `asset` again with the UVs of `mesh` and one new image per layer, or none.
    pub fn asset(
        &mut self,
        output: Output<'_>,
        asset: &Asset,
        mesh: &TriMesh,
        polygons: Option<&Polygons>,
        pages: &[Vec<u8>],
    ) -> Result<()> {
        let how = SaveMesh::default()
            .with_format(Some(output.format(self.args)?))
            .with_polygons(polygons)
            .with_stop(self.console.stop(self.run));
        let saved = asset.save(output.path, mesh, pages, &how)?;
        self.written.add(&saved.files, saved.lost, self.console);
        Ok(())
    }

    /// Writes a cloud.
    pub fn cloud(&mut self, output: Output<'_>, cloud: &PointCloud) -> Result<()> {
        let how = SaveCloud::default()
            .with_format(Some(output.format(self.args)?))
            .with_ascii(self.args.ascii)
            .with_stop(self.console.stop(self.run));
        let (files, lost) = if output.is_standard() {
            (vec![output.path.to_owned()], atlasfit_io::write_cloud(std::io::stdout().lock(), cloud, &how)?)
        } else {
            let saved = atlasfit_io::save_cloud(output.path, cloud, &how)?;
            (saved.files, saved.lost)
        };
        self.written.add(&files, lost, self.console);
        Ok(())
    }

    /// Writes bytes.
    pub fn bytes(&mut self, output: Output<'_>, bytes: &[u8]) -> Result<()> {
        if output.is_standard() {
            self.console.check(self.run, "writing")?;
            std::io::stdout().write_all(bytes).context("cannot write to standard output")?;
        } else {
            atlasfit_io::write_file(output.path, bytes, &self.console.stop(self.run))?;
        }
        self.written.add(&[output.path], Vec::new(), self.console);
        Ok(())
    }
}
