//! The numbers of creases: one place, each with its unit and where it is from.

/// The numbers, see [`CREASE`].
pub(crate) struct CreaseConstants {
    /// A crease is looked for where neighbouring triangles meet at more than this angle (cosine). Source:
    /// chosen, about 25 degrees: what bends less is within the noise of the points whichever way it is drawn.
    pub bend: f64,
    /// Distance between places that are looked at, in spacings. Source: chosen.
    pub apart: f64,
    /// The same of those that are looked at first ...
    pub first_apart: f64,
    /// ... and how near one that has found a crease others are looked at then, in spacings. Source for both:
    /// measured, eight CAD parts and a Kinect's room: 2 and 3 give the distances to truth that all places
    /// give, at 0.94 of the time in the room; 2 and 2 or 3 and 3 give up to 1.03 times the distances, at 0.86
    /// and 0.92.
    pub next_within: f64,
    /// Radii of the windows across and along the bend, in spacings, the widest first. Source: chosen: about
    /// 50 to 250 points.
    pub radii: [[f64; 2]; 4],
    /// A window of fewer points says nothing. Source: derived, twice the unknowns of the model.
    pub least_points: usize,
    /// Points of a window that are looked at: more make the decision no surer. Source: chosen.
    pub most_points: usize,
    /// Least cosine between a side's normal and the direction that the heights are over. Source: chosen, 84
    /// degrees.
    pub steep: f64,
    /// And the share of the points that it holds for. Source: chosen.
    pub on_sides: f64,
    /// Standard deviation of the charts' normals where they round an edge off (cosine). Source: chosen, 30
    /// degrees.
    pub turned: f64,
    /// Sides of a sheet that are told apart in a window. Source: chosen, as many as a step has between two
    /// rims.
    pub most_sides: usize,
    /// A plane is fitted to no fewer points. Source: derived, one more than determine it.
    pub least_on_side: usize,
    /// Times that planes are fitted to the points that lie on them. Source: chosen.
    pub settlings: usize,
    /// Pairs of sides that are looked at in a window, those that meet nearest to its middle. Source: derived,
    /// a corner has three edges.
    pub most_pairs: usize,
    /// Beside a crease, so far in spacings, no point may lie on a third side. Source: derived, half of the
    /// narrowest rim that has three sides by its points, three spacings.
    pub clear: f64,
    /// Where a side has no points along the crease for longer than this, in spacings, it has ended. Source:
    /// derived, twice the spacing.
    pub gap: f64,
    /// A bend wider than this, in spacings, is a rounding that the points show. Source: derived, points a
    /// spacing apart show nothing narrower than two. Wider ones need not be tried: where an edge is likelier
    /// than this one they are less likely still (the same bytes on nine scans without them).
    pub rounding: f64,
    /// Evidence, in nats, that a crease must have beyond that of a smooth surface, if one window is looked
    /// at, and the logarithm of their number if there are more: one place in a hundred is taken for a crease
    /// by chance. Source: derived, ln 100.
    pub margin: f64,
    /// Least weight of a point in a fit. Source: chosen, so that no point is lost for good.
    pub least_weight: f64,
    /// Added to each unknown's equation for each point. Source: chosen, the square root of the rounding.
    pub ridge: f64,
    /// Where the line is tried first, in spacings from the seed. Source: chosen.
    pub starts: [f64; 3],
    /// Steps of a fit. Source: chosen.
    pub steps: usize,
    /// Most that the line moves in a step, in spacings. Source: chosen.
    pub most_shift: f64,
    /// Most that it turns. Source: chosen.
    pub most_skew: f64,
    /// And most that it bends, in one over spacings. Source: chosen.
    pub most_arc: f64,
    /// A piece is believed within this share of its window. Source: chosen.
    pub reach: f64,
    /// Length of the strips by which a piece is found to go on, in spacings. Source: chosen.
    pub strip: f64,
    /// Most strips at either end. Source: chosen.
    pub strips: usize,
    /// Charts round a crease off by no more than this, in spacings: what lies farther off is another sheet.
    /// Source: chosen.
    pub deepest: f64,
    /// The sides are looked at this far from the crease, in spacings. Source: chosen, much less than a
    /// window.
    pub beside: f64,
    /// What lies on a side of a crease has a normal with at least this cosine. Source: chosen, 60 degrees.
    pub same_side: f64,
    /// Pieces of one crease have directions with at least this cosine. Source: chosen, 18 degrees.
    pub parallel: f64,
    /// And lie within this of each other's line, in spacings. Source: chosen.
    pub aligned: f64,
    /// A crease is at least this long, in the length that its first piece is believed for. Source: derived, a
    /// shorter one is seen by no window but those that hold all of it.
    pub longest_alone: f64,
    /// An edge lies along a crease whose ends are nearer to it than this share of its length. Source: chosen.
    pub along: f64,
    /// Ends of creases this near to each other, in spacings, may meet in a corner. Source: chosen, as far as
    /// a window's third side keeps a crease from the corner.
    pub meet: f64,
    /// Least volume of the box of three unit normals of a corner's sides. Source: chosen: three sides at 25
    /// degrees of each other.
    pub spread: f64,
    /// How far about a corner its fan reaches beyond the ends of the creases, in spacings: what is tried.
    /// Source: chosen.
    pub caps: [f64; 4],
    /// A triangle is folded whose normal has a smaller cosine with its side's. Source: chosen, 72 degrees.
    pub folded: f64,
    /// Times that folded triangles are spread out. Source: chosen.
    pub unfoldings: usize,
    /// A vertex this near to the crease goes onto it, as a share of its edge that crosses. Source: chosen.
    pub snap: f64,
    /// Places or seeds that one thread looks at in one go.
    pub check: usize,
    /// Triangles that one thread looks at in one go.
    pub triangles_at_once: usize,
}

/// Their values.
pub(crate) const CREASE: CreaseConstants = CreaseConstants {
    bend: 0.9,
    apart: 1.0,
    first_apart: 2.0,
    next_within: 3.0,
    radii: [[9.0, 9.0], [6.0, 6.0], [3.0, 8.0], [4.0, 4.0]],
    least_points: 20,
    most_points: 300,
    steep: 0.1,
    on_sides: 0.95,
    turned: 0.866,
    most_sides: 5,
    least_on_side: 4,
    settlings: 3,
    most_pairs: 3,
    clear: 1.5,
    gap: 2.0,
    rounding: 2.0,
    margin: 4.6,
    least_weight: 0.05,
    ridge: 1e-9,
    starts: [-1.0, 0.0, 1.0],
    steps: 4,
    most_shift: 0.5,
    most_skew: 0.3,
    most_arc: 0.05,
    reach: 0.5,
    strip: 1.0,
    strips: 6,
    deepest: 1.0,
    beside: 0.1,
    same_side: 0.5,
    parallel: 0.95,
    aligned: 0.5,
    longest_alone: 1.0,
    along: 0.25,
    meet: 4.0,
    spread: 0.15,
    caps: [1.5, 1.0, 2.0, 2.5],
    folded: 0.3,
    unfoldings: 8,
    snap: 0.2,
    check: 64,
    triangles_at_once: 4096,
};
