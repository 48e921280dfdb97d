//! The numbers of merging charts: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`MERGE`].
pub(crate) struct MergeConstants {
    /// Beyond this stretch bound, merges that as-rigid-as-possible steps do not manage are tried without
    /// flips, at some cost. Within it hardly anything comes of that. Above 1. Source: chosen.
    /// Halved: charts 0.96 (homer 1.71), seam 1.00 (homer 1.31), stretch 0.99 (homer 0.91), coverage 1.01
    /// (homer 1.07), time 2.0; doubled: charts 1.04 (elephant 1.43), seam 1.01 (elephant 1.07), coverage 1.01
    /// (elephant 1.09), time 0.71.
    pub loose: f64,
    /// Times that all refusals are forgotten and tried again, plus one. Source: chosen.
    /// Halved: charts 1.07 (elephant 1.43), seam 1.02 (cow 1.09); doubled: same bytes.
    pub passes: usize,
    /// Merges whose score is at least this share of the round's best are tried in the same round. In [0, 1].
    /// Source: chosen.
    /// Halved: charts 1.09 (homer 1.76), seam 1.06 (homer 1.28), stretch 1.00 (homer 0.95), coverage 1.02
    /// (homer 1.09); doubled: charts 1.12 (homer 1.71), seam 1.04 (homer 1.26), stretch 0.99 (homer 0.93),
    /// coverage 1.00 (elephant 1.10).
    pub floor: f64,
    /// Largest squared gap, relative to seam length times chart size, per squared stretch allowance, for
    /// which a merge is tried at all. Source: measured, of 760 merges tried beyond it on five shapes, 65
    /// would have succeeded; the command is not on record.
    /// Halved: charts 1.06 (knot 1.20), seam 1.02 (knot 1.08); doubled: charts 1.01 (fertility 1.05).
    pub mismatch: f64,
    /// Where two charts do not become one along all of a path, parts of it are tried: of so many shares of
    /// what it costs as a seam all but one, all but two and so on. At least 2. Source: chosen.
    /// Halved: charts 1.01 (cow 1.14), coverage 0.98 (elephant 0.93); doubled: charts 0.98 (elephant 0.83),
    /// time 1.34.
    pub dart_parts: u32,
    /// Charts that meet along several paths are joined along all of them where the gaps that rigid motion
    /// leaves are, as a root mean square, below this share of the square root of the smaller one's area.
    /// Source: chosen.
    /// Halved or doubled: same bytes.
    pub closed: f64,
    /// How far into the larger chart a merge may move vertices, in square roots of the smaller chart's area
    /// ... Source: chosen.
    /// Halved: charts 1.01 (knot 0.93); doubled: charts 1.07 (homer 1.76), seam 1.03 (homer 1.30), stretch
    /// 1.00 (homer 0.94), coverage 1.01 (homer 1.06).
    pub reach: f64,
    /// ... plus this share of the width and height of the shared edges' box. Source: chosen.
    /// Halved: charts 1.07 (homer 1.76), seam 1.03 (homer 1.30), stretch 0.99 (homer 0.95), coverage 1.01
    /// (homer 1.05); doubled: charts 1.07 (homer 1.76), seam 1.03 (homer 1.30), stretch 0.99 (homer 0.95),
    /// coverage 1.02 (homer 1.10).
    pub reach_of_seam: f64,
    /// Where more tenths than this of the larger chart's faces take part, all do: little would be saved. At
    /// most 10. Source: chosen, for speed.
    /// Halved: charts 1.07 (homer 1.76), seam 1.03 (homer 1.30), stretch 1.00 (homer 0.94), coverage 1.00
    /// (homer 1.09); doubled: charts 1.00 (knot 0.93).
    pub whole_tenths: usize,
    /// Most as-rigid-as-possible iterations spent on testing one merge. Source: chosen.
    /// Halved: charts 1.02 (knot 1.07), coverage 0.99 (cow 0.95); doubled: same bytes.
    pub steps: usize,
    /// How far these go on in the direction of the last one, in its lengths. In [0, 1). Source: measured,
    /// `unwrap --json` of 40 meshes: 0.8 gives as much; of 16 meshes: 0 gives 1.02 of the seam in 1.1 of the
    /// time.
    pub momentum: f64,
    /// A merge is given up where more than this many times the allowed area is stretched beyond the bound at
    /// the first look ... Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub first_hope: f64,
    /// ... or more than this many times at a later one ... Source: chosen.
    /// Halved: charts 1.03 (fertility 1.14), seam 1.02 (fertility 1.05); doubled: same bytes.
    pub hope: f64,
    /// ... or where what there is has not come down to this share of the last look. Below 1. Source: chosen.
    /// Halved: charts 1.03 (fertility 1.14), seam 1.01 (fertility 1.05); doubled: charts 1.04 (homer 1.76),
    /// seam 1.02 (homer 1.30), stretch 0.99 (homer 0.95), coverage 0.99 (knot 0.90).
    pub progress: f64,
    /// Seam length that must be saved per hull area newly left empty (the surface has area 1). Larger means
    /// more, rounder charts that pack better. Source: measured, `bench unwrap FOLDER --peers uvunwrap` of 41
    /// meshes: 12, 18, 26, 36 give 0.26, 0.29, 0.31, 0.34 of its charts, 0.60, 0.60, 0.62, 0.63 of its seams
    /// and 1.04, 1.08, 1.10, 1.13 of its coverage in the median.
    /// Halved: charts 0.86 (nefertiti 0.60), seam 1.01 (camel 1.05), coverage 0.91 (knot 0.85); doubled:
    /// charts 1.16 (fertility 1.36), seam 1.03 (knot 1.12), coverage 1.00 (cow 1.10).
    pub waste: f64,
    /// Stretch bound up to which that holds; beyond it in inverse proportion to the stretch that is allowed:
    /// who allows more wants fewer charts. Above 1. Source: derived, the default bound.
    pub usual: f64,
    /// Charts of more faces are not flattened without flips: that takes seconds, for crumbs at their borders.
    /// Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub hard_faces: usize,
    /// Share of the area that may be stretched beyond the bound which a merge may use up, unless it is
    /// tried hard. In [0, 1]. Source: measured, `unwrap --json` of 40 meshes: 0.65, 0.8, 1 give 0.999, 0.960,
    /// 0.965 of the seam and 0.998, 1.001, 1.002 of the stretch at the 95th percentile of a build that did
    /// not know the bound in its steps.
    pub over: f64,
    /// Share of a chart's area that may be stretched beyond the bound where charts are merged at the others'
    /// expense. In [0, 1]. Source: chosen.
    /// Halved or doubled: same bytes.
    pub over_spent: f64,
    /// How far from the border faces may be that change hands, in lengths of the border ... Source: measured,
    /// `unwrap --json` of 40 meshes: 0.5 and three reaches give 0.985 of the seam in 1.19 of the time.
    pub trade_reach: f64,
    /// ... tried as often, each time half as far, until something comes of it. At least 1. Source: the same.
    pub reaches: i32,
    /// The same on large meshes. Source: measured, `unwrap --json` of the dragon of 500,000 faces: two take
    /// 1.4 times as long for 0.98 of the seam.
    pub reaches_of_large: i32,
    /// ... and in depths of a chart's deepest face: what lies deeper stays. In (0, 1). Source: chosen, half.
    /// 0.7 gave the same figures of the 40 meshes.
    pub core: f64,
    /// Faces near a border without ends beyond which it stays as it is. Source: chosen, for speed.
    pub cut_faces: usize,
    /// Share of a border that must be saved for faces to change hands. Source: measured, the same meshes:
    /// 0.02 gives 0.993 of the seam in 1.25 of the time, 0.1 gives 1.016 in 0.93.
    pub trade_gain: f64,
    /// Borders of one chart that are moved at a time: most stay where they are, so that little is found in
    /// vain. At least 1. Source: measured, `unwrap --json` of the same meshes: two take 0.93 of the time of
    /// one on two threads, for 1.003 of the seam; with four a third is found in vain.
    pub trades_at_once: u32,
    /// Times that charts are merged and borders moved again after borders have moved; never on large meshes.
    /// Source: measured, the same meshes: one gives 0.94 of the charts and 0.98 of the seam in 1.25 of the
    /// time; once more brings nothing.
    pub regrowths: usize,
    /// Share of the area that may be stretched beyond the bound which is spent on such charts. In [0, 1].
    /// Source: chosen, so that what comes after has some room.
    /// Halved: same bytes; doubled: charts 0.98 (elephant 0.86), seam 0.99 (elephant 0.94), stretch 1.01
    /// (elephant 1.14).
    pub spent: f64,
    /// What a turn of a border where four polygons meet counts, in lengths of the edges there. Source:
    /// chosen: a seam may be as much longer as one edge to go straight on.
    pub turn: f64,
    /// Share of what it saves of turns that a straighter border must be worth in all, so that none is moved
    /// for rounding. In (0, 1). Source: chosen.
    pub straighter: f64,
    /// Most edges of a way straight on. Source: chosen, above what small meshes have.
    pub longest_way: usize,
}

/// Their values.
pub(crate) const MERGE: MergeConstants = MergeConstants {
    loose: 1.35,
    passes: 2,
    floor: 0.2,
    mismatch: 1.44,
    dart_parts: 16,
    closed: 0.05,
    reach: 1.5,
    reach_of_seam: 0.2,
    whole_tenths: 7,
    steps: 14,
    momentum: 0.7,
    first_hope: 5.0,
    hope: 2.0,
    progress: 0.9,
    waste: 18.0,
    usual: 1.1,
    hard_faces: 20_000,
    over: 0.8,
    over_spent: 0.6,
    trade_reach: 0.25,
    reaches: 2,
    reaches_of_large: 1,
    core: 0.5,
    cut_faces: 5_000,
    trade_gain: 0.05,
    trades_at_once: 2,
    regrowths: 1,
    spent: 0.95,
    turn: 1.0,
    straighter: 0.1,
    longest_way: 1_000,
};
