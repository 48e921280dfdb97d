//! The numbers of unwrapping that belong to no one step: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`UNWRAP`].
pub(crate) struct UnwrapConstants {
    /// Bound on 1 - |mean normal| of the first patches for a stretch of 1.1; in proportion to the excess
    /// stretch for others. Finer patches leave merging more choice, coarser ones less work. In (0, 1).
    /// Source: chosen.
    /// Halved: charts 1.16 (homer 1.65), seam 1.08 (maze 1.27), stretch 0.99 (homer 0.95), coverage 1.01
    /// (homer 1.06); doubled: charts 1.03 (maze 0.47), seam 0.93 (maze 0.45), coverage 1.01 (camel 0.87).
    pub flatness: f64,
    /// Least factor on it for a tight stretch bound. In (0, 1]. Source: chosen.
    /// Halved or doubled: same bytes.
    pub least_flatness: f64,
    /// Largest factor on it for a loose one. At least 1. Source: chosen.
    /// Halved: charts 1.05 (elephant 1.29), seam 1.03 (homer 1.17), coverage 1.01 (homer 1.05); doubled:
    /// charts 1.04 (elephant 1.29), seam 1.00 (elephant 0.95), coverage 1.01 (elephant 1.14).
    pub most_flatness: f64,
    /// Factor on the excess stretch while there are too many charts. Above 1. Source: chosen.
    /// Halved: same bytes, 1 of 9 meshes fail; doubled: charts 1.01 (homer 1.12).
    pub loosen: f64,
    /// Halvings of the range between a bound with too many charts and one with few enough. Source: chosen;
    /// two leave an eighth of the excess stretch open.
    pub narrowings: usize,
    /// Share of the area that may be stretched beyond the bound. Source: derived, the bound is a 95th
    /// percentile.
    pub beyond: f64,
    /// Looser bounds that are tried after the one with the fewest charts so far. Source: chosen; three are a
    /// fourfold excess stretch.
    pub patience: usize,
    /// Times that charts are made anew because all together they stretch beyond the bound at one density,
    /// which none of them knows. Source: chosen; one was enough on 39 meshes at four bounds, an ellipsoid in
    /// one chart at a bound of 4 takes four.
    pub tightenings: i32,
    /// Factor on the excess stretch that is left to them then, beside what they had too much; its square and
    /// so on where that was not enough. Below 1.
    /// Source: chosen.
    pub tightened: f64,
    /// Excess stretch that is tried first to keep a bound on the energy: mean energies of 4.1 have bounds
    /// from
    /// 1.25 to 1.5. Source: measured, the 27 meshes of OptCuts.
    pub energetic: f64,
    /// Factor on it while the energy is too high. Below 1. Source: chosen.
    pub less_energetic: f64,
    /// Excess stretch below which none is tried to keep a bound on the energy. Source: chosen; with 1.01
    /// hardly two faces that do not lie flat share a chart.
    pub least_excess: f64,
    /// As-rigid-as-possible iterations for a first chart. Source: chosen.
    /// Halved: charts 1.07 (homer 1.76), seam 1.04 (homer 1.27), stretch 0.99 (homer 0.95), coverage 1.01
    /// (homer 1.08); doubled: no figure changes by 1 %.
    pub first_steps: usize,
    /// Faces whose normal has less than this cosine with the mean one look away from the rest (78 degrees).
    /// Source: chosen.
    /// Halved or doubled: same bytes.
    pub facing_cos: f64,
    /// Rounds of cutting out what single precision spoils; in the last, spoiled charts fall apart into single
    /// faces. At least 1. Source: chosen.
    /// Halved or doubled: same bytes.
    pub repairs: usize,
    /// A density below this share of what was asked for is worth a warning. Below 1. Source: chosen, above
    /// what rounding does.
    /// Halved or doubled: same bytes.
    pub density_kept: f64,
    /// A chart is cut where the page would have to be this much larger for it than for the area of all
    /// charts: a seam across is little to pay for half as many texels again. Above 1. Source: chosen.
    /// Halved or doubled: same bytes.
    pub too_large: f64,
    /// It is cut at most this far from its middle, in shares of its length. Below 0.5. Source: chosen.
    /// Halved or doubled: same bytes.
    pub middle: f64,
    /// Rotations in a half turn, in which the page that a chart needs is looked for. Source: chosen; 7.5
    /// degrees apart.
    /// Halved or doubled: same bytes.
    pub page_turns: usize,
    /// Corners of a hull that are enough to turn it upright, or to see how long it is. Source: derived, an
    /// even polygon of as many corners is a circle to one part in 100,000.
    pub enough_corners: usize,
    /// Factors on `flatness` for further tries, in the order in which they are made. Source: measured,
    /// `unwrap --json` of 40 meshes: the best of 1 and 2 has 0.957 of the seam of 1 alone, of 1, 2 and 0.5
    /// 0.945, of all five 0.932, the geometric mean.
    pub flatnesses: [f64; 5],
    /// As many tries are made as have no more faces than this all together. Source: chosen, for speed: a
    /// tenth of a second on two cores.
    pub faces_tried: usize,
}

/// Their values.
pub(crate) const UNWRAP: UnwrapConstants = UnwrapConstants {
    flatness: 0.06,
    least_flatness: 0.25,
    most_flatness: 2.0,
    loosen: 1.6,
    narrowings: 2,
    beyond: 0.05,
    patience: 3,
    tightenings: 4,
    tightened: 0.97,
    energetic: 0.5,
    less_energetic: 0.85,
    least_excess: 0.01,
    first_steps: 5,
    facing_cos: 0.2,
    repairs: 5,
    density_kept: 0.999,
    too_large: 1.5,
    middle: 0.1,
    page_turns: 24,
    enough_corners: 1024,
    flatnesses: [1.0, 2.0, 0.5, 1.4, 0.7],
    faces_tried: 12_000,
};

/// The numbers of what seams cost, see [`PRICES`].
pub(crate) struct PriceConstants {
    /// A seam costs the share of it that is seen to this power, where seams are to hide. Source: measured,
    /// `unwrap --seams-hidden 1` and `measure` of 35 meshes: 2 and 4 give 0.94 and 0.94 of the share that is
    /// seen, with `--up 0,0,1` 0.85 and 0.89.
    pub contrast: i32,
    /// Least price of a seam per unit of its length, where the mean is 1: seams that cost nothing would not
    /// end. Source: chosen.
    pub least_price: f64,
    /// Faces up to which every edge is looked at along all rays; where there are twice as many, along half of
    /// them, and so on. Source: chosen, for speed.
    pub faces_of_all_rays: usize,
    /// But along one ray in so many. Source: chosen: 16 rays, off by 0.5 / sqrt(16) = 13 % of the directions.
    pub fewest_rays: usize,
}

/// Their values.
pub(crate) const PRICES: PriceConstants =
    PriceConstants { contrast: 2, least_price: 0.1, faces_of_all_rays: 20_000, fewest_rays: 4 };
