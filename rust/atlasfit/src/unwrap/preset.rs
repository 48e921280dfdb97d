//! Names for usual bounds on the stretch. Their numbers stand here and nowhere else.

/// What matters most of a layout: a name for a bound on the stretch,
/// [`UnwrapOptions::max_stretch`](super::UnwrapOptions::max_stretch).
///
/// ```
/// use atlasfit::unwrap::{Preset, UnwrapOptions};
/// let few = UnwrapOptions::default().with_preset(Preset::FewSeams);
/// assert_eq!(few.max_stretch, Preset::FewSeams.max_stretch());
/// assert!(few.max_stretch > UnwrapOptions::default().max_stretch);
/// assert_eq!(Preset::from_name("low-stretch"), Some(Preset::LowStretch));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Few charts and short seams, for painting by hand and for meshes of few faces, which bend much at each
    /// edge.
    FewSeams,
    /// The default.
    #[default]
    Balanced,
    /// Lengths are kept best; most charts.
    LowStretch,
}

impl Preset {
    /// All of them, from the fewest charts to the most.
    pub const ALL: [Self; 3] = [Self::FewSeams, Self::Balanced, Self::LowStretch];

    /// Its name for users: lower case, words joined by a hyphen.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FewSeams => "few-seams",
            Self::Balanced => "balanced",
            Self::LowStretch => "low-stretch",
        }
    }

    /// The preset of a name; `None` for any other text.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Its bound on the stretch max(s1, 1/s2) of 95% of the area; more than 1. Source: chosen from `atlasfit
    /// unwrap --max-stretch` on Blender's monkey (968 triangles), an elephant and a knot: 1.3 has a third of
    /// the charts that 1.1 has (16, 12 and 6 instead of 44, 37 and 15), more than that shortens the seams
    /// little; 1.05 has about twice as many (73, 66 and 37).
    #[must_use]
    pub const fn max_stretch(self) -> f64 {
        match self {
            Self::FewSeams => 1.3,
            Self::Balanced => 1.1,
            Self::LowStretch => 1.05,
        }
    }
}
