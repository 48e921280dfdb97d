//! The stages of the work, with their names.
//!
//! In: nothing. Out: what progress callbacks and reports are told.

/// A stage of the work. They are numbered in the order in which each is first entered when a scan is
/// denoised; `unwrap` packs (and may flatten again) after flattening. Any stage may be entered again, also
/// after a later one: sheets that are separated are cut and fitted anew, for example.
/// [`Progress::overall`](super::Progress::overall) never falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
#[non_exhaustive]
pub enum Stage {
    /// Checking and normalising the input.
    Prepare = 0,
    /// Neighbours, spacing, noise, normals, outliers.
    Analyse = 1,
    /// Cutting the scan into overlapping charts.
    Partition = 2,
    /// Fitting the charts.
    Fit = 3,
    /// Projecting points onto the atlas.
    Project = 4,
    /// Stitching one surface.
    Surface = 5,
    /// Laying out UVs: segmentation.
    Segment = 6,
    /// Laying out UVs: flattening.
    Parametrize = 7,
    /// Laying out UVs: packing.
    Pack = 8,
    /// Measuring a result.
    Measure = 9,
    /// Baking textures.
    Bake = 10,
    /// Reading a file.
    Read = 11,
    /// Writing a file.
    Write = 12,
    /// Making a mesh of fewer triangles.
    Simplify = 13,
}

impl Stage {
    /// Every stage, in order.
    pub const ALL: [Self; 14] = [
        Self::Prepare,
        Self::Analyse,
        Self::Partition,
        Self::Fit,
        Self::Project,
        Self::Surface,
        Self::Segment,
        Self::Parametrize,
        Self::Pack,
        Self::Measure,
        Self::Bake,
        Self::Read,
        Self::Write,
        Self::Simplify,
    ];

    /// A short name for people, lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prepare => "preparing",
            Self::Analyse => "analysing the scan",
            Self::Partition => "cutting charts",
            Self::Fit => "fitting charts",
            Self::Project => "projecting points",
            Self::Surface => "stitching the surface",
            Self::Segment => "cutting UV charts",
            Self::Parametrize => "flattening UV charts",
            Self::Pack => "packing UV charts",
            Self::Measure => "measuring",
            Self::Bake => "baking textures",
            Self::Read => "reading",
            Self::Write => "writing",
            Self::Simplify => "simplifying",
        }
    }
}
