//! The numbers of deciding which way each chart faces: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`ORIENT`].
pub(crate) struct OrientConstants {
    /// Sheets closer than this many standard deviations of the noise may be one. Source: chosen, below 2,
    /// where two equal Gaussians begin to have two modes.
    /// Halved: same bytes; doubled: no figure changes by 1 %.
    pub apart: f64,
    /// What one opposing chart counts, in shared points. Source: chosen.
    /// Halved: points 1.11 (plate 1.81), acc 1.13 (plate 2.00), com 1.20 (plate 2.94); doubled: points 0.97
    /// (plate 0.87), acc 0.99 (plate 0.90), com 0.97 (plate 0.86).
    pub counts: f64,
    /// What one chart beside another counts, in shared points. Source: measured: of the 24 facades of
    /// tests/sides.rs none faces two ways with 0.01 to 0.1, two with none; with 0.1 the two sides of a thin
    /// wedge (fandisk, simulated scan) face alike.
    /// Halved: com 1.03 (facade0 1.14), facing 0.96 (spiral 0.67); doubled: points 1.01 (plate 1.17), acc
    /// 1.02 (plate 1.18), com 1.01 (plate 1.15), facing 0.96 (spiral 0.70).
    pub beside: f64,
    /// Charts whose centres are nearest to a chart's lie beside it, itself among them. Source: chosen, two
    /// rings.
    /// Halved: com 1.03 (facade1 1.14), facing 0.98 (plate 0.78); doubled: acc 1.04 (plate 1.20), com 1.01
    /// (plate 1.29), facing 0.96 (spiral 0.64).
    pub beside_charts: usize,
    /// Points about a place by which a chart's density there is known. Source: derived, none is there by
    /// chance once in e^12 times.
    /// Halved: points 1.00 (plate 0.98), com 1.00 (facade3 0.97), facing 1.00 (plate 1.01); doubled: acc 1.00
    /// (plate 1.01), com 1.00 (plate 1.01).
    pub points_there: f64,
    /// Sheets whose normals have a greater cosine are parallel (46 degrees). Source: chosen.
    /// Halved: points 0.99 (plate 0.93), acc 1.01 (plate 1.09), com 1.02 (plate 1.14); doubled: points 1.14
    /// (plate 2.16), acc 1.20 (plate 2.85), com 1.28 (plate 4.36).
    pub parallel: f64,
    /// Of the charts on one side, those up to this many standard deviations of the noise beyond the nearest
    /// are of the same sheet. Source: chosen.
    /// Halved or doubled: same bytes.
    pub same_sheet: f64,
    /// Charts so many standard deviations of the noise apart, or less than the point spacing, may be of one
    /// sheet or of two: sweeps of a scanner that are misaligned lie as near, and face the same way. Source:
    /// chosen.
    /// Halved: com 0.99 (plate 0.94); doubled: points 1.09 (plate 1.70), acc 1.16 (plate 2.34), com 1.23
    /// (plate 3.46).
    pub unsure: f64,
    /// Agreement (in points) below which a contradiction is chance: a stray chart, not a one-sided surface,
    /// whose charts contradict each other over whole overlaps. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub min_conflict: f64,
    /// Share of all agreement that must be contradicted before a surface counts as one-sided. A Moebius strip
    /// must be cut across its whole width, which takes one or two percent of its overlaps; stray charts
    /// contradict in far fewer. Source: chosen between the two.
    /// Halved or doubled: same bytes.
    pub one_sided: f64,
    /// Charts that a part must have before what it encloses is asked for. Source: chosen.
    /// Halved: points 1.02 (plate 1.12), acc 1.07 (plate 1.47), com 1.15 (plate 2.36); doubled: no figure
    /// changes by 1 %.
    pub least_part: usize,
    /// Sets of a part's charts that are tried the other way round, the largest. Source: chosen.
    pub turned_sets: usize,
    /// How often all sets of charts are tried the other way round, and how often signs follow from what the
    /// charts enclose with the signs before, at the most. Source: chosen; both end before, where nothing
    /// changes.
    pub turn_rounds: usize,
    /// Places of a part where its winding is looked at, at the most. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub winding_samples: usize,
    /// Windings of charts about such places that are held at once, at the most. Source: chosen, 64 MB.
    /// Halved or doubled: same bytes.
    pub windings: usize,
    /// Error of a winding about a chart's middle that is summed over points. Source: chosen.
    /// Halved or doubled: same bytes.
    pub winding_error: f64,
    /// Charts farther away than this many of their radii wind as one piece: what is left out is the square
    /// of its inverse, 16 % of a far chart's small part. Source: chosen.
    /// Halved or doubled: same bytes.
    pub winding_far: f64,
    /// What a share of the surface that viewers see counts, in nats for a nat of its logarithm in the mean.
    /// Source: measured on simulated scans of seven objects on the ground, which differ by 0.14 and more from
    /// the same seen from below, and of a terrain and a room, which differ by 0.015 to 0.09 either way.
    /// Halved or doubled: same bytes.
    pub seen: f64,
    /// Directions from which the sides of charts are looked at. Source: chosen, 19 degrees apart.
    /// Halved or doubled: no figure changes by 1 %.
    pub views: usize,
    /// Rounds in which the shares of viewers in them are estimated. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub view_rounds: usize,
    /// Side of the squares in which what lies before is seen, in spacings: an empty one, through which a
    /// hidden side is seen, comes once in e^4 times where the surface does not lean. Source: derived.
    /// Halved or doubled: no figure changes by 1 %.
    pub view_cell: f64,
    /// Share of the points whose spacing is not above the one that this takes. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: facing 1.10 (spiral 2.52).
    pub view_widest: f64,
    /// How far a surface rises over the plane of a piece, for its distance along it and the side of a square.
    /// Source: derived: a sphere of five spacings' radius rises by less within a square that is seen head-on.
    /// Halved: points 0.97 (plate 0.77), acc 0.94 (plate 0.51), com 0.94 (plate 0.51), facing 1.05 (plate
    /// 1.59); doubled: no figure changes by 1 %.
    pub view_bend: f64,
    /// Squares across the scan at the most. Source: chosen, 8 MB a direction.
    /// Halved or doubled: same bytes.
    pub view_cells: usize,
    /// Cosine between a direction and a normal from which on a side is seen. Source: chosen (70 degrees).
    /// Halved: no figure changes by 1 %; doubled: points 0.97 (plate 0.77), acc 0.94 (plate 0.51), com 0.94
    /// (plate 0.51), facing 1.05 (plate 1.59).
    pub view_cosine: f64,
    /// Share of a chart that is seen of the hidden side, through squares that are empty by chance. Source:
    /// derived, as `view_cell`, twice, as squares' edges let through too.
    /// Halved: points 0.97 (plate 0.77), acc 0.94 (plate 0.51), com 0.94 (plate 0.51), facing 1.05 (plate
    /// 1.59); doubled: no figure changes by 1 %.
    pub seen_by_chance: f64,
    /// Points in a square in which a viewer sees the nearest surface, in the mean. Source: chosen: where
    /// points are as dense as there, one in e^8 squares is empty.
    pub sights_a_square: f64,
    /// Rounds in which the squares' size is found. Source: chosen; the last changes it by a few percent.
    pub square_rounds: usize,
    /// Squares across a side of the cube at the most. Source: chosen, for speed.
    pub most_squares: u32,
    /// Points that the search for a scanner looks at; more make the position no better than the model is.
    /// Source: chosen.
    /// Halved or doubled: same bytes.
    pub scanner_sample: usize,
    /// Of those, one in so many is looked at while the search begins. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub scanner_few: usize,
    /// Of the starts, so many are followed with few points, and of these so many with all. Source: chosen,
    /// for speed.
    pub starts_followed: [usize; 2],
    /// Neighbours that a spacing is taken from: spacings of points nearer to each other are one measurement.
    /// Source: derived, `SPATIAL.wide_k`.
    /// Halved or doubled: same bytes.
    pub shared: f64,
    /// Cosines between a ray and a normal count as at least this: surfaces that lean more are hardly measured
    /// at all. Source: chosen (87 degrees).
    /// Halved or doubled: same bytes.
    pub least_cosine: f64,
    /// Distances from the scan's middle, in longest sides, at which the search begins. Source: chosen.
    /// Halved or doubled: same bytes.
    pub starts: [f64; 3],
    /// The search ends when its step is this share of the distance to the scan's middle. Source: chosen.
    /// Halved or doubled: same bytes.
    pub step_end: f64,
    /// Steps of the search at the most. Source: chosen; it ends before.
    /// Halved or doubled: same bytes.
    pub most_steps: usize,
    /// The scanner must explain this share of the spacings' variance. Any density that varies smoothly is
    /// explained to some part by a scanner somewhere. In (0, 1). Source: measured by `find_scanner`: flight
    /// lines over terrain 0.15, photogrammetry of a castle 0.17; scans that one depth camera or one laser
    /// made 0.65 and more.
    /// Halved or doubled: same bytes.
    pub explained: f64,
    /// Points of a part below which stations are not looked for. Source: chosen, twenty for each of five.
    pub station_points: usize,
    /// Mean absolute deviation of the logarithm of the area that a point stands for, below which a scan is as
    /// even as one from outside: stations are not looked for. Source: chosen, for speed: surveys of rooms,
    /// halls and caves have 0.46 to 1.05, most scans of objects 0.15 to 0.4.
    pub station_uneven: f64,
    /// Neighbours over which the density is averaged where feet of stations are looked for. Source: chosen.
    pub foot_points: usize,
    /// Feet are at least this far apart, in longest sides. Source: chosen.
    pub feet_apart: f64,
    /// Most stations that are looked for. Source: chosen.
    pub most_stations: usize,
    /// Points so far about a foot say where the station begins, in longest sides. Source: chosen.
    pub foot_reach: f64,
    /// Heights over a foot at which its station is looked for first, in longest sides. Source: chosen.
    pub station_heights: [f64; 5],
    /// Rounds of the search for stations. Source: chosen.
    pub station_rounds: usize,
    /// Its first step with all stations at once, in longest sides. Source: chosen.
    pub station_step: f64,
    /// Cosine that a point has which faces away from a station, in its place: noise turns normals. Source:
    /// chosen, nearly none.
    pub away: f64,
    /// Stations must explain this share of the spacings' variance. In (0, 1). Source: measured: surveys of
    /// rooms, halls and caves 0.64 to 0.95 from within and up to 0.56 from without, photogrammetry up to
    /// 0.55.
    pub station_explained: f64,
    /// And their side of the surface must be likelier than the other by so many nats. Source: derived, ln
    /// 1e9: what surfaces enclose is overruled.
    pub station_margin: f64,
    /// Ground is at most this high, in its lesser width. Source: chosen.
    pub flat: f64,
    /// Side of the columns that are looked down through, in spacings. Source: chosen, so that about four
    /// points are in one.
    pub cell: f64,
    /// Two points of a column are on two surfaces when one is this far off the other's tangent plane, in
    /// standard deviations of the noise or spacings, the larger of the two. Source: denoised points are
    /// within half a deviation of their surface, and one that bends by a tenth of a spacing within one is off
    /// its tangent plane by 0.4 within a column.
    pub above: f64,
    /// Cosine between the normals of surfaces that lie above each other. Source: chosen; those of a wall and
    /// what it stands on are near 0.
    pub same_way: f64,
    /// Share of the points of ground that others may hide from above: trees, eaves. Source: chosen; of a body
    /// it is half.
    pub hidden: f64,
    /// What must speak against it that ground faces up, in nats. Source: chosen, one in seven by chance.
    pub not_up: f64,
    /// Where a viewer above stands, in longest sides: all rays to it are alike. Source: chosen.
    pub far_above: f64,
    /// One scanner sees only what faces it. This share of the points may seem not to: noise turns those that
    /// lean most, and so do mixed pixels at the edges. Source: chosen.
    /// Halved or doubled: same bytes.
    pub turned_away: f64,
}

/// Their values.
pub(crate) const ORIENT: OrientConstants = OrientConstants {
    apart: 1.5,
    counts: 0.3,
    beside: 0.02,
    beside_charts: 12,
    points_there: 12.0,
    parallel: 0.7,
    same_sheet: 2.0,
    unsure: 1.8,
    min_conflict: 1.0,
    one_sided: 0.004,
    least_part: 8,
    turned_sets: 32,
    turn_rounds: 4,
    winding_samples: 1000,
    windings: 1 << 24,
    winding_error: 0.05,
    winding_far: 2.5,
    seen: 40.0,
    views: 64,
    view_rounds: 8,
    view_cell: 2.0,
    view_widest: 0.9,
    view_bend: 0.2,
    view_cells: 1000,
    view_cosine: 0.35,
    sights_a_square: 8.0,
    square_rounds: 4,
    most_squares: 512,
    seen_by_chance: 0.04,
    scanner_sample: 2000,
    scanner_few: 8,
    starts_followed: [4, 2],
    shared: 32.0,
    least_cosine: 0.05,
    starts: [0.35, 1.0, 2.5],
    step_end: 0.01,
    most_steps: 200,
    explained: 0.5,
    station_points: 100,
    station_uneven: 0.4,
    foot_points: 8,
    feet_apart: 0.08,
    most_stations: 16,
    foot_reach: 0.2,
    station_heights: [0.02, 0.04, 0.08, 0.16, 0.3],
    station_rounds: 12,
    station_step: 0.05,
    away: 0.005,
    station_explained: 0.6,
    station_margin: 20.7,
    flat: 0.5,
    cell: 2.0,
    above: 1.0,
    same_way: 0.5,
    hidden: 0.1,
    not_up: 2.0,
    far_above: 1e3,
    turned_away: 0.1,
};
