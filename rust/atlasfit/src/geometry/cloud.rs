//! A point cloud with its attributes: what a scan is before anything is known about its surface.

/// The type in which a file or a host keeps an attribute's numbers. Values are held as f64 (exact for all of
/// these), the kind says how to write them back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScalarKind {
    /// Unsigned 8 bit.
    U8,
    /// Signed 8 bit.
    I8,
    /// Unsigned 16 bit.
    U16,
    /// Signed 16 bit.
    I16,
    /// Unsigned 32 bit.
    U32,
    /// Signed 32 bit.
    I32,
    /// 32-bit float.
    F32,
    /// 64-bit float.
    F64,
}

impl ScalarKind {
    /// Whether values of this kind are whole numbers: labels, counts. Such values are copied from the nearest
    /// point, never averaged.
    #[must_use]
    pub const fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// One named attribute, `width` numbers per point.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Its name, as in the file ("intensity", "scan_id").
    pub name: String,
    /// Numbers per point, at least 1.
    pub width: usize,
    /// How the numbers are stored outside.
    pub kind: ScalarKind,
    /// `width` values per point, point after point.
    pub values: Vec<f64>,
}

/// Where the scanners stood that measured a cloud.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scanners {
    /// Their positions, in the cloud's unit and frame.
    pub positions: Vec<[f64; 3]>,
    /// For each point the scanner that measured it; any other number where that is not known.
    pub of_point: Vec<u32>,
}

/// A point cloud. Positions are f64 in the user's unit and frame; every optional column has one entry per
/// point.
///
/// ```
/// use atlasfit::geometry::PointCloud;
/// let cloud = PointCloud::from_positions(vec![[0.0; 3], [1.0, 0.0, 0.0]]);
/// assert!(cloud.len() == 2 && !cloud.is_empty() && cloud.bytes() >= 48);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Positions.
    pub positions: Vec<[f64; 3]>,
    /// Unit normals, if the scan came with them.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Red, green, blue, alpha in [0, 1], encoded as they were stored (sRGB by convention).
    pub colors: Option<Vec<[f32; 4]>>,
    /// Where the scanners stood, if the scan says so.
    pub scanners: Option<Scanners>,
    /// Everything else.
    pub attributes: Vec<Attribute>,
}

impl Attribute {
    /// The last column of this name: those that a result adds stand after the scan's own.
    ///
    /// ```
    /// use atlasfit::geometry::{Attribute, ScalarKind};
    /// let column = |values| Attribute { name: "age".into(), width: 1, kind: ScalarKind::U8, values };
    /// let all = [column(vec![1.0]), column(vec![2.0])];
    /// assert_eq!(Attribute::named(&all, "age").unwrap().values, [2.0]);
    /// assert!(Attribute::named(&all, "size").is_none());
    /// ```
    #[must_use]
    pub fn named<'a>(all: &'a [Self], name: &str) -> Option<&'a Self> {
        all.iter().rfind(|a| a.name == name)
    }
}

impl PointCloud {
    /// A cloud of bare positions.
    #[must_use]
    pub fn from_positions(positions: Vec<[f64; 3]>) -> Self {
        Self { positions, ..Self::default() }
    }
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }
    /// Bytes that its arrays hold.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let scanners = self.scanners.as_ref().map_or(0, |s| 4 * s.of_point.len() + 24 * s.positions.len());
        point_bytes(&self.positions, &self.normals, &self.colors, &self.attributes) + scanners as u64
    }
    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

/// Bytes that the columns of points or vertices hold.
pub(super) fn point_bytes(
    positions: &[[f64; 3]],
    normals: &Option<Vec<[f32; 3]>>,
    colors: &Option<Vec<[f32; 4]>>,
    attributes: &[Attribute],
) -> u64 {
    let normals = normals.as_ref().map_or(0, |c| size_of_val(&c[..]));
    let colors = colors.as_ref().map_or(0, |c| size_of_val(&c[..]));
    let others: usize = attributes.iter().map(|a| size_of_val(&a.values[..])).sum();
    (size_of_val(positions) + normals + colors + others) as u64
}
