//! Which charts each point of a scan belongs to.

/// The chart memberships of every point, as compressed rows.
pub struct Membership {
    /// Row starts, one more than there are points.
    pub start: Vec<u32>,
    /// Chart and robust weight.
    pub entries: Vec<(u32, f32)>,
    /// For each point how many it stands for where charts are compared: of charts with many points an even
    /// share is looked at, and the others stand for none.
    pub stands_for: Vec<u16>,
}

impl Membership {
    /// The charts of a point, with their robust weights.
    #[must_use]
    pub fn of(&self, point: usize) -> &[(u32, f32)] {
        &self.entries[self.start[point] as usize..self.start[point + 1] as usize]
    }
    /// The charts to compare at a point, and for how many points it stands; none where others stand for it.
    #[must_use]
    pub fn compared(&self, point: usize) -> (&[(u32, f32)], u16) {
        match self.stands_for[point] {
            0 => (&[], 0),
            many => (self.of(point), many),
        }
    }
}
