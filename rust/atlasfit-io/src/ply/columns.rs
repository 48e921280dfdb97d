//! The columns of the vertices: which property goes where, and what the full columns become.

use super::header::{Element, Property};
use crate::bytes::zeros;
use crate::content::{Content, FaceColumns};
use crate::error::Result;
use crate::input::Input;
use atlasfit::geometry::{Attribute, ScalarKind};

/// Where a vertex property goes; the number is the coordinate, the channel, or the index of the column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Target {
    Position(usize),
    Normal(usize),
    Color(usize),
    Uv(usize),
    Scalar(usize),
    List(usize),
}

/// The vertex columns while they fill.
pub(super) struct Columns {
    /// What each property becomes, in the file's order.
    pub targets: Vec<Target>,
    pub positions: Vec<[f64; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub colors: Vec<[f32; 4]>,
    pub uv: Vec<[f32; 2]>,
    pub scalars: Vec<Attribute>,
    /// What a number of each colour channel is divided by.
    pub color_scale: [f64; 4],
    lists: Vec<List>,
}

/// What stands in the place of an attribute that was taken out.
const EMPTY: Attribute =
    Attribute { name: String::new(), width: 1, kind: ScalarKind::F64, values: Vec::new() };

/// A list property of the vertices: an attribute if all lists have one length.
struct List {
    name: String,
    kind: ScalarKind,
    /// The length of the first list.
    width: Option<usize>,
    /// Whether some list has another length.
    ragged: bool,
    values: Vec<f64>,
}

/// What 1 in a column of [0, 1] is in a colour property of this type.
pub(super) fn color_scale(kind: ScalarKind) -> f64 {
    match kind {
        ScalarKind::F32 | ScalarKind::F64 => 1.0,
        ScalarKind::U16 | ScalarKind::I16 => 65535.0,
        _ => 255.0,
    }
}

/// The target of each property that its name tells; the others are attributes.
pub(super) fn named_targets(properties: &[Property], has_faces: bool) -> Vec<Option<Target>> {
    let scalar =
        |name: &str| properties.iter().position(|p| p.list.is_none() && p.name.eq_ignore_ascii_case(name));
    let mut targets: Vec<Option<Target>> = vec![None; properties.len()];
    // Takes properties of these names if all are there and free.
    let mut take = |names: &[&str], target: fn(usize) -> Target| -> bool {
        let found: Option<Vec<usize>> = names.iter().map(|n| scalar(n)).collect();
        let Some(found) = found.filter(|f| f.iter().all(|&i| targets[i].is_none())) else { return false };
        for (k, &i) in found.iter().enumerate() {
            targets[i] = Some(target(k));
        }
        true
    };
    take(&["x", "y", "z"], Target::Position);
    take(&["nx", "ny", "nz"], Target::Normal);
    let colors = [
        ["red", "green", "blue", "alpha"],
        ["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"],
        ["r", "g", "b", "a"],
    ];
    let _ = colors.iter().any(|n| take(n, Target::Color) || take(&n[..3], Target::Color));
    // Texture coordinates belong to faces: without any, "u" and "v" are numbers like others.
    if has_faces {
        let names = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
        let _ = names.iter().any(|n| take(n, Target::Uv));
    }
    targets
}

impl Columns {
    /// Decides where each property of the vertices goes. The columns are empty until [`Self::size`].
    pub fn plan(element: &Element, has_faces: bool) -> Self {
        let mut columns = Columns {
            targets: Vec::with_capacity(element.properties.len()),
            positions: Vec::new(),
            normals: Vec::new(),
            colors: Vec::new(),
            uv: Vec::new(),
            scalars: Vec::new(),
            color_scale: [1.0; 4],
            lists: Vec::new(),
        };
        let named = named_targets(&element.properties, has_faces);
        for (p, target) in element.properties.iter().zip(named) {
            columns.targets.push(match target {
                Some(Target::Color(k)) => {
                    columns.color_scale[k] = color_scale(p.kind);
                    Target::Color(k)
                }
                Some(target) => target,
                None if p.list.is_some() => {
                    let (name, values) = (p.name.clone(), Vec::new());
                    columns.lists.push(List { name, kind: p.kind, width: None, ragged: false, values });
                    Target::List(columns.lists.len() - 1)
                }
                None => {
                    let values = Vec::new();
                    columns.scalars.push(Attribute { name: p.name.clone(), width: 1, kind: p.kind, values });
                    Target::Scalar(columns.scalars.len() - 1)
                }
            });
        }
        columns
    }

    /// Makes room for `n` rows in every column that some property goes to.
    pub fn size(&mut self, n: usize, input: &mut Input<'_>) -> Result<()> {
        let has = |target: Target| self.targets.contains(&target);
        let [normals, colors, alpha, uv] =
            [Target::Normal(0), Target::Color(0), Target::Color(3), Target::Uv(0)].map(has);
        let bytes = |there: bool, bytes: usize| if there { bytes } else { 0 };
        let optional = bytes(normals, 12) + bytes(colors, 16) + bytes(uv, 8);
        input.reserve(n, 24 + 8 * self.scalars.len() + optional)?;
        self.positions = zeros([0.0; 3], n);
        if normals {
            self.normals = zeros([0.0; 3], n);
        }
        if colors {
            self.colors = zeros([0.0; 4], n);
            if !alpha {
                self.colors.iter_mut().for_each(|c| c[3] = 1.0);
            }
        }
        if uv {
            self.uv = zeros([0.0; 2], n);
        }
        for a in &mut self.scalars {
            a.values = zeros(0.0, n);
        }
        Ok(())
    }

    /// Stores one number of a row.
    #[inline]
    pub fn set(&mut self, target: Target, row: usize, value: f64) {
        match target {
            Target::Position(k) => self.positions[row][k] = value,
            Target::Normal(k) => self.normals[row][k] = value as f32,
            Target::Color(k) => self.colors[row][k] = (value / self.color_scale[k]) as f32,
            Target::Uv(k) => self.uv[row][k] = value as f32,
            Target::Scalar(k) => self.scalars[k].values[row] = value,
            Target::List(_) => {}
        }
    }

    /// Stores the next row's entries of list property `k`.
    pub fn push_list(&mut self, k: usize, entries: &[f64]) {
        let list = &mut self.lists[k];
        match list.width {
            None => list.width = Some(entries.len()),
            Some(w) if w != entries.len() => {
                list.ragged = true;
                list.values = Vec::new();
            }
            _ => {}
        }
        if !list.ragged {
            list.values.extend_from_slice(entries);
        }
    }

    /// The columns as a cloud with these faces.
    pub fn finish(mut self, input: &mut Input<'_>, faces: FaceColumns) -> Result<Content> {
        let mut content = Content { faces, ..Content::default() };
        content.cloud.attributes = self.take_attributes(input);
        if !self.uv.is_empty() && content.faces.corner_uv.is_none() {
            let triangles = &content.faces.triangles;
            input.reserve(triangles.len(), 24)?;
            let uv = |v: u32| self.uv[v as usize];
            content.faces.corner_uv = Some(triangles.iter().map(|t| t.map(uv)).collect());
        }
        self.rescale_colors(input);
        content.cloud.positions = self.positions;
        content.cloud.normals = (!self.normals.is_empty()).then_some(self.normals);
        content.cloud.colors = (!self.colors.is_empty()).then_some(self.colors);
        Ok(content)
    }

    /// Scalars and lists of one length, in the file's order.
    fn take_attributes(&mut self, input: &mut Input<'_>) -> Vec<Attribute> {
        let n = self.positions.len();
        let mut attributes = Vec::new();
        for target in &self.targets {
            match *target {
                Target::Scalar(k) => attributes.push(std::mem::replace(&mut self.scalars[k], EMPTY)),
                Target::List(k) => {
                    let list = &mut self.lists[k];
                    match list.width {
                        Some(width) if width > 0 && list.values.len() == n * width => {
                            let (name, values) =
                                (std::mem::take(&mut list.name), std::mem::take(&mut list.values));
                            attributes.push(Attribute { name, width, kind: list.kind, values });
                        }
                        Some(0) | None => {}
                        _ => {
                            let name = &list.name;
                            let what = format!("lists \"{name}\" of differing length at vertices, left out");
                            input.report.add(what, n as u64, None);
                        }
                    }
                }
                _ => {}
            }
        }
        attributes
    }

    /// Floating-point colours are in [0, 1] by convention; some programs write 0 to 255.
    fn rescale_colors(&mut self, input: &mut Input<'_>) {
        let above_1 = |c: &[f32; 4]| c[..3].iter().any(|&v| v > 1.0);
        if self.color_scale[0] != 1.0 || !self.colors.iter().any(above_1) {
            return;
        }
        let n = self.positions.len() as u64;
        input.report.add("floating-point colours above 1, read as 0 to 255", n, None);
        let alpha = self.colors.iter().any(|c| c[3] > 1.0);
        for c in &mut self.colors {
            for v in &mut c[..if alpha { 4 } else { 3 }] {
                *v /= 255.0;
            }
        }
    }
}
