//! The numbers of blending charts: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`BLEND`].
pub(crate) struct BlendConstants {
    /// Charts are evaluated up to this far from their surface, in voxels: the corners of every crossed voxel
    /// lie within sqrt(3), and the rest lets the field be filled in from both sides of a gap. At least 1.74.
    /// Source: derived, and margin.
    pub band: f64,
    /// Tubes whose radius is smaller, in voxels, are contoured as if it were this, and their vertices put
    /// back onto them. Source: derived, sqrt(3) / 2: a corner then lies within every piece of a tube; and
    /// margin.
    pub thinnest: f64,
    /// Least blended mask, in [0, 1], at which the charts' distance at a corner is believed. Sensible: below
    /// 0.5, where the data end. Source: chosen.
    /// Halved: acc 1.01 (box 1.07); doubled: acc 0.98 (box 0.87), com 1.07 (mobius 1.17).
    pub min_support: f64,
    /// Voxels from the origin within which surfaces are built. Source: derived, 2^19 blocks of 4 voxels, less
    /// room for what a point reaches.
    pub range: f64,
    /// A sheet this many voxels away counts half as much as one at the corner itself when charts disagree
    /// which sheet a corner belongs to. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub near: f64,
    /// Added to the mask, in [0, 1], in that choice: where no chart has data the nearest still leads. Source:
    /// chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub mask_floor: f64,
    /// Charts whose distances differ by less than so many voxels ... Source: chosen.
    /// Halved: acc 1.01 (box 1.06); doubled: acc 0.99 (plate 0.96).
    pub same_sheet_voxels: f64,
    /// ... plus so many standard deviations of the noise see the same sheet. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub same_sheet_sigmas: f64,
    /// So do charts whose normals' cosine is above this (60 degrees). Source: chosen.
    /// Halved: com 1.01 (plate 1.05); doubled: acc 0.99 (plate 0.91), com 0.97 (plate 0.83).
    pub same_way: f64,
    /// Charts with less than this share of the weight at a corner are not evaluated there. Source: derived,
    /// they would move the corner by less than a thousandth of what charts disagree by.
    pub least_share: f64,
    /// A place of a chart is empty where none of its points lies within so many spacings. Source: chosen,
    /// less than a voxel: with one, 0.75, acc of 116 simulated scans is 0.3 % larger, com 0.1 % smaller
    /// (private runs).
    pub trim_empty: f64,
    /// Points of sheets across a chart say so far about them whether there is a surface, as a multiple of
    /// that. Source: chosen, two spacings: a dozen points of the two walls of a plate as thick.
    pub trim_reach: f64,
    /// And so high over and under it, as a multiple of the same. Source: derived, a spacing and a fifth:
    /// farther off is what lies beyond a thin lip.
    pub trim_high: f64,
    /// How much they must say against it, in votes of one point at the place. Source: chosen.
    pub trim_votes: f64,
    /// Points so many standard deviations of the noise off a chart may lie on its sheet. Source: derived, one
    /// in 400 lies farther off.
    pub trim_sigmas: f64,
    /// Charts that one worker trims in one go. Changes no result. Source: chosen.
    pub trim_chunk: usize,
    /// Pairs of a block and a point handled at a time: bounds the memory, costs a look at all points each
    /// time. Changes no result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub pairs: usize,
    /// One in so many pairs takes part in the choice of what is handled at a time. Changes no result. Source:
    /// chosen.
    /// Halved or doubled: same bytes.
    pub pair_sample: usize,
    /// Blocks or points that one worker handles between two checks. Changes no result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub chunk: usize,
    /// Points that one worker handles between two checks where it is told how wide voxels are; blocks that
    /// several of them reach are named once. Changes no result. Source: chosen.
    pub level_chunk: usize,
    /// Bytes for one block: its corners, the blocks around it, its charts; and the vertices and quads in it.
    /// Source: measured; the command is not on record.
    /// Halved or doubled: same bytes.
    pub bytes_per_block: u64,
    /// Bytes for one chart at this stage. Source: measured; the command is not on record.
    /// Halved or doubled: same bytes.
    pub bytes_per_chart: u64,
    /// Bytes for one point at this stage. Source: measured; the command is not on record.
    /// Halved or doubled: same bytes.
    pub bytes_per_point: u64,
    /// Rounds of filling: each extends the field by one voxel, so that gaps of up to twice as many voxels
    /// close. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub fill_rounds: u8,
    /// Sweeps that smooth the filled values. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub relax: usize,
    /// Filled values may differ by this many voxels along an edge that no two sheets are the ends of. At
    /// least 2. Source: derived, values one voxel on either side of the surface differ by two; the rest is
    /// margin.
    pub fill_jump: f64,
    /// Reach of a point's influence, in point spacings. Gaps between random points are seldom wider than
    /// twice this. Source: derived, a circle of radius r spacings is empty with probability exp(-pi r^2),
    /// 1e-8 at 2.4.
    pub reach: f64,
    /// Squared point spacings, added to the squared distance: at the point itself the weight stays finite.
    /// Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub softening: f64,
    /// Half the diagonal of a block, in its sides. Source: derived, sqrt(3) / 2, rounded up.
    pub half_diagonal: f64,
    /// What a curved surface leaves its tangent plane by within a point's reach, as a share of it. Source:
    /// chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub curved: f64,
    /// Charts whose members are listed between two checks. Changes no result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub check_charts: usize,
    /// Points of a chart at which it is compared with others: as many as it has where the noise is below the
    /// spacing; where it is larger, charts are wider and an even share of their points does. Source: derived,
    /// `PARTITION.patch_spacings`: pi 6^2.
    pub compared: usize,
    /// Sites are no nearer to each other than the noise divided by this, in the mean: where it is many
    /// spacings, a share of the points makes them. Above 1. Source: chosen, four sites where a scan with
    /// noise below its spacing has one.
    pub oversampled: f64,
}

/// Their values.
pub(crate) const BLEND: BlendConstants = BlendConstants {
    band: 2.2,
    thinnest: 1.0,
    min_support: 0.25,
    range: 2e6,
    near: 0.5,
    mask_floor: 0.02,
    same_sheet_voxels: 1.0,
    same_sheet_sigmas: 1.0,
    same_way: 0.5,
    least_share: 1e-3,
    trim_empty: 0.6,
    trim_reach: 3.3,
    trim_high: 2.0,
    trim_votes: 0.3,
    trim_sigmas: 3.0,
    trim_chunk: 64,
    pairs: 1 << 22,
    pair_sample: 64,
    chunk: 64,
    level_chunk: 1024,
    bytes_per_block: 1560,
    bytes_per_chart: 900,
    bytes_per_point: 300,
    fill_rounds: 4,
    relax: 8,
    fill_jump: 2.2,
    reach: 2.4,
    softening: 0.3,
    half_diagonal: 0.87,
    curved: 0.5,
    check_charts: 256,
    compared: 113,
    oversampled: 2.0,
};

// Sizes of arrays.

/// Voxels along one side of a block. Small blocks follow the surface closely, large ones share more corners.
/// Changes no result. Source: chosen, for speed.
pub(crate) const BLOCK: i32 = 4;
