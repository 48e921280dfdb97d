//! The numbers of the steps of the main job: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`PIPELINE`].
pub(crate) struct PipelineConstants {
    /// Scans smaller or larger than this, in any unit, cannot be computed with. Source: derived, sums and
    /// quotients of such lengths stay within f64's 1e-308 to 1e308.
    pub size: (f64, f64),
    /// Share of the points beyond each side of the frame: one stray point far away must not squeeze the rest
    /// into rounding noise. In (0, 0.5). Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub beyond: f64,
    /// Points farther than this many of the scan's sizes are stray. Source: chosen.
    /// Halved or doubled: same bytes.
    pub far: f64,
    /// Points whose neighbours are this many times farther than their neighbours' neighbours are stray. More
    /// than one. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub stray: f64,
    /// Points far from the dense ones are on a surface where the least of the three variances of a point and
    /// its nearest eight is a smaller share of all, in the median of those about it. Source: derived, half of
    /// the median share of a cloud that fills space, 0.125.
    pub flat: f64,
    /// Points that are looked at for a row: the nearest of a point, and itself. Source: chosen; they see
    /// three rows up to ten steps apart, and of rows that are farther apart one.
    pub row_points: usize,
    /// Points of a row among them, at the least. Source: derived, the nearest eight of a point are of its own
    /// row where rows are four steps apart.
    pub row_least: usize,
    /// Points of other rows among them, at the least. Source: derived, of points that are random seen from
    /// above three times as far aside, 1.8 % lie so by chance, with `row_width` too 0.05 %.
    pub row_beside: usize,
    /// Rows are no wider than this share of their length, nor thicker than this share of their width
    /// (standard deviations), and the points of others are one over it as far aside. In (0, 1). Source:
    /// derived, of nine points that are random on a plane 2.8 % lie so by chance, (2 x / (1 + x^2))^7.
    pub row_width: f64,
    /// A row that is wider than this many of its steps lies in a plane, that of the rays, or it is a thread.
    /// Source: chosen, what is narrower looks like a line whatever it is.
    pub row_noise: f64,
    /// A row goes on over steps up to this many times their median. Source: derived, of random points on a
    /// line one in 2^4 is farther from the next.
    pub row_gap: f64,
    /// Points that tell whether there are rows. Source: derived, a tenth of them has a standard error of 6 %.
    pub row_sample: usize,
    /// Rows of so many points are long. Source: derived, twice what makes one: vertices of meshes, threads
    /// and the steps of rounded depths stand in short ones.
    pub row_long: usize,
    /// Rows are averaged if long ones hold more than this share of the points. In (0, 1). Source: measured by
    /// `atlasfit bench denoise --scanner rows5`, where they hold 15 %: acc is 0.35 and 0.41 of what it is
    /// without. In a simulated LiDAR of 93,000 points, where they hold 5 %, it is 1.6; the command is not on
    /// record.
    pub row_share: f64,
    /// Averaging ends when pairs are fewer than this share of the points. In (0, 1). Source: chosen: they are
    /// not worth the time.
    pub row_pairs: f64,
    /// Rounds of averaging two points of a row. Source: derived, rows up to 4 x 2^6 = 256 times as dense
    /// along as across; only rounds that find pairs cost time.
    pub row_rounds: usize,
    /// Spacing, as a share of the scan's size, that rounding alone could make. Source: derived, some thousand
    /// times the rounding of f64.
    pub least_spacing: f64,
    /// Noise beyond this share of the scan's size leaves no shape. Source: chosen.
    /// Halved or doubled: same bytes.
    pub most_noise: f64,
    /// Points hang together when they are nearer than this many spacings. Source: chosen.
    /// Halved or doubled: same bytes.
    pub link: f64,
    /// Neighbours that a point may hang together with. Source: chosen.
    /// Halved or doubled: same bytes.
    pub links: usize,
    /// Fewer points that hang together are no part of a scan. Source: chosen.
    /// Halved or doubled: same bytes.
    pub part: usize,
    /// A given noise below this share of what the scan shows is worth a warning. In (0, 1). Changes no
    /// result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub noise_told: f64,
    /// Times that patches near another sheet are cut anew, with what the fit before says of which point
    /// belongs to which. The second time brings a third of what the first brings, a third one a third of
    /// that. Source: chosen.
    /// Halved: points 1.04 (plate 1.24), acc 1.00 (plate 1.09), com 1.02 (plate 1.15); doubled: points 0.94
    /// (plate 0.70), acc 0.98 (box 0.90), com 1.02 (plate 1.12).
    pub sheet_rounds: usize,
    /// A point that lies this far behind the surface that a viewpoint sees is hidden from it, in the larger
    /// one of noise and spacing. Source: chosen, three standard deviations.
    pub hidden_behind: f64,
    /// Share of the points that may be hidden from a viewpoint that saw them all. Source: measured on
    /// simulated scans: from the place of one scanner 0.003 of a room and 0.11 of a depth picture are hidden,
    /// from a place of a moving one 0.41 of a hall with shelves and 0.39 of a house and its ground.
    pub most_hidden: f64,
    /// Side of a voxel, in point spacings: finer ones follow the surface no better, coarser ones begin to
    /// cost completeness; triangles are then about four times as many as the points. Source: chosen.
    /// Halved: acc 0.94 (ring 0.81), com 0.89 (plate 0.76); doubled: acc 1.54 (ring 4.24), com 2.34 (spiral
    /// 6.70).
    pub voxel: f64,
    /// The same in standard deviations of the noise, where that is more. Source: derived, patches are as many
    /// of these wide as they are spacings, so that their splines have two voxels an interval either way.
    pub voxel_noise: f64,
    /// Voxels of one size, those of tiles, are at least this share of the root mean square of the spacing:
    /// where clumps set the median, voxels of its size would be many times as many as the points. Source:
    /// chosen.
    /// Halved or doubled: same bytes.
    pub voxel_spread: f64,
    /// And at least this share of it, as far as that is no more than the median: in rooms seen from one place
    /// the far walls have most of the surface and few of the points. Source: chosen; without it a simulated
    /// LiDAR of 93,000 points takes half more time, and acc is 1.4 times as large; the command is not on
    /// record.
    pub voxel_uneven: f64,
    /// A point alone covers a disk as wide as this many spacings. Source: chosen.
    /// Halved or doubled: same bytes.
    pub alone: f64,
    /// Holes with a boundary up to this many point spacings long are gaps of the sampling and always filled.
    /// Source: derived, random points leave gaps about four spacings wide.
    pub gap: f64,
    /// Slits up to this many spacings wide are closed: at the rim of a thin part its two sides end within a
    /// patch of each other. Source: chosen.
    /// Halved: acc 0.98 (spiral 0.92), com 1.01 (plate 1.05); doubled: same bytes.
    pub slit: f64,
    /// Parts of the surface with fewer triangles are specks: those of about fifty points, at voxels of the
    /// usual size. Source: chosen.
    /// Halved or doubled: same bytes.
    pub speck: f64,
    /// Whatever the voxels, fewer triangles are a speck. Source: chosen.
    /// Halved or doubled: same bytes.
    pub least_speck: f64,
    /// Parts of the surface on which fewer points lie are specks: where noise is larger than the spacing, a
    /// few strays make one of any size. Source: chosen.
    /// Halved or doubled: same bytes.
    pub unsupported: f64,
    /// How far the surface may move to have fewer triangles, in standard deviations of the noise. Source:
    /// chosen: an average over a patch of sixteen points is no nearer to the truth.
    /// Halved: acc 0.98 (ring 0.89), com 0.98 (ring 0.90); doubled: acc 1.03 (ring 1.18), com 1.03 (ring
    /// 1.15).
    pub light_noise: f64,
    /// The same in point spacings, where that is more. Source: chosen; at twice as much the tapered spikes of
    /// tests/tube.rs are 11 % farther off, with 9 % fewer triangles.
    /// Halved or doubled: no figure changes by 1 %.
    pub light_spacing: f64,
    /// Longest edges, in point spacings. Source: derived, triangles with equal sides of 1.5 spacings are as
    /// many as the points; collapses stop at edges of between a half and the whole of the greatest length.
    /// Halved: acc 0.96 (ring 0.87), com 0.97 (ring 0.89); doubled: acc 1.02 (sphere 1.14), com 1.02 (sphere
    /// 1.14).
    pub light_edge: f64,
    /// UV charts of the denoised surface may stretch this much at the 95th percentile. Above 1. Source:
    /// chosen, below the project's target of 1.3.
    pub uv_stretch: f64,
    /// Outliers of a mesh follow their neighbours up to this share of the mesh's size. Source: chosen, far
    /// below any noise. Changes the outliers of meshes only.
    pub follow_residual: f64,
    /// Steps of conjugate gradients for that, at the most: outliers that need more are many more edges away
    /// from the surface than a spike is. Source: chosen. Changes the outliers of meshes only.
    pub follow_steps: usize,
}

/// Their values.
pub(crate) const PIPELINE: PipelineConstants = PipelineConstants {
    size: (1e-280, 1e280),
    beyond: 0.005,
    far: 1e6,
    stray: 4.0,
    flat: 0.0625,
    row_points: 33,
    row_least: 9,
    row_beside: 4,
    row_width: 1.0 / 3.0,
    row_noise: 0.25,
    row_gap: 4.0,
    row_sample: 2500,
    row_long: 17,
    row_share: 0.1,
    row_pairs: 0.01,
    row_rounds: 6,
    least_spacing: 1e-12,
    most_noise: 0.25,
    link: 5.0,
    links: 8,
    part: 10,
    noise_told: 0.25,
    sheet_rounds: 2,
    hidden_behind: 3.0,
    most_hidden: 0.25,
    voxel: 0.75,
    voxel_noise: 0.75,
    voxel_spread: 0.2,
    voxel_uneven: 0.6,
    alone: 4.2,
    gap: 16.0,
    slit: 3.0,
    speck: 180.0,
    least_speck: 8.0,
    unsupported: 12.0,
    light_noise: 0.25,
    light_spacing: 0.05,
    light_edge: 2.5,
    uv_stretch: 1.25,
    follow_residual: 1e-12,
    follow_steps: 1000,
};

// Sizes of arrays.

/// Points that an attribute of a vertex is averaged over. Source: chosen. Changes attributes only.
pub(crate) const TRANSFER_K: usize = 4;
