//! How wide the voxels are where: levels of blocks, as the points ask.
//!
//! In: points with their spacing, the side of the finest voxels. Out: which blocks a point reaches. Blocks of
//! a level are twice as wide as those of the level before; each is either whole or cut into the eight of the
//! level before. Blocks that touch differ by one level at the most (a balanced octree; von Herzen and Barr
//! 1987). Beside a coarser block, a fine one needs corners that the coarser one has not: blocks of the fine
//! level lie over it there and lend theirs.

use super::blocks::{LEVELS, block_key, block_of_key, level_of_key, side};
use super::constants::BLEND;
use super::influence::{Reach, visit_blocks};
use crate::atlas::BlendSite;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// How wide voxels are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Voxels {
    /// Side of the finest.
    pub finest: f64,
    /// Side in spacings of the points where those lie far apart; zero: all are of one size.
    pub per_spacing: f64,
}

impl Voxels {
    /// The level that points so far apart ask for.
    fn level(self, spacing: f64) -> usize {
        let ratio = self.per_spacing * spacing / self.finest;
        if ratio >= 2.0 { (ratio.log2() as usize).min(LEVELS - 1) } else { 0 }
    }
    /// Side of a voxel where points lie so far apart.
    pub(crate) fn side(self, spacing: f64) -> f64 {
        side(self.finest, self.level(spacing))
    }
}

/// Which blocks of which level there are.
pub(super) struct Levels {
    voxels: Voxels,
    /// The coarsest level.
    pub(super) top: usize,
    /// Blocks that are cut into eight.
    cut: FxHashSet<u64>,
    /// Whole blocks that blocks of the level before lie over.
    covered: FxHashSet<u64>,
    /// Those.
    lenders: FxHashSet<u64>,
    /// Those, and whole blocks that touch coarser ones: their corners must be known as far from the surface
    /// as the coarser ones need.
    wide: FxHashSet<u64>,
}

impl Levels {
    /// The levels that points ask for.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn of(sites: &[BlendSite], voxels: Voxels, ctx: &Context<'_>) -> Result<Self> {
        let top = sites.par_iter().map(|site| voxels.level(site.spacing)).max().unwrap_or(0);
        let mut levels = Self {
            voxels,
            top,
            cut: FxHashSet::default(),
            covered: FxHashSet::default(),
            lenders: FxHashSet::default(),
            wide: FxHashSet::default(),
        };
        // Blocks of the level before that are cut.
        let mut before: Vec<u64> = Vec::new();
        for level in 1..=top {
            let mut cut = asked(sites, voxels, level - 1, ctx)?;
            cut.extend(before.iter().flat_map(|&key| around(key)).map(parent));
            unique(&mut cut, ctx)?;
            levels.cut.extend(&cut);
            before = cut;
        }
        levels.lend(ctx)?;
        Ok(levels)
    }

    /// Finds the whole blocks that touch coarser ones, and puts lenders where they do so on their upper
    /// sides.
    fn lend(&mut self, ctx: &Context<'_>) -> Result<()> {
        for (i, &cut) in self.cut.iter().enumerate() {
            ctx.check_at(i)?;
            for whole in children(cut).filter(|child| !self.cut.contains(child)) {
                for beside in around(whole).filter(|&key| !self.cut.contains(&parent(key))) {
                    self.wide.insert(whole);
                    let (b, beside_b) = (block_of_key(whole), block_of_key(beside));
                    if (0..3).all(|k| beside_b[k] >= b[k]) {
                        self.lenders.insert(beside);
                        self.covered.insert(parent(beside));
                    }
                }
            }
        }
        self.wide.extend(&self.lenders);
        Ok(())
    }

    /// Names the blocks that a point reaches. None is coarser by more than one level than it asks for: what
    /// it reaches at its own level is cut that far, and blocks that touch differ by one.
    pub(super) fn visit(&self, site: &BlendSite, mut visit: impl FnMut(u64)) {
        let level = (self.voxels.level(site.spacing) + 1).min(self.top);
        visit_blocks(&Reach::new(site, self.side(level)), |b| {
            let key = block_key(level, b);
            if level == self.top || self.cut.contains(&parent(key)) || self.lenders.contains(&key) {
                self.descend(site, key, &mut visit);
            }
        });
    }

    fn side(&self, level: usize) -> f64 {
        side(self.voxels.finest, level)
    }

    /// The same within a block that the point reaches.
    fn descend(&self, site: &BlendSite, key: u64, visit: &mut impl FnMut(u64)) {
        let level = level_of_key(key);
        let is_cut = level > 0 && self.cut.contains(&key);
        if !is_cut {
            visit(key);
            if level == 0 || !self.covered.contains(&key) {
                return;
            }
        }
        let reach = Reach::new(site, self.side(level - 1));
        for child in children(key) {
            let b = block_of_key(child);
            // Blocks within one that is cut need what the widest of them do.
            if reach.holds(b, 2.0 * BLEND.band)
                && (is_cut || self.lenders.contains(&child))
                && (reach.holds(b, BLEND.band) || self.wide.contains(&child) || self.cut.contains(&child))
            {
                self.descend(site, child, visit);
            }
        }
    }

    /// How far from the surface corners of a block must be known, in its voxels.
    pub(super) fn band(&self, key: u64) -> f64 {
        if self.wide.contains(&key) { 2.0 * BLEND.band } else { BLEND.band }
    }

    /// Whether the voxels of a block are contoured.
    pub(super) fn contours(&self, key: u64) -> bool {
        !self.lenders.contains(&key)
    }
}

/// The blocks of the level after the given that hold those that points of this level reach.
fn asked(sites: &[BlendSite], voxels: Voxels, level: usize, ctx: &Context<'_>) -> Result<Vec<u64>> {
    let found: Vec<Vec<u64>> = sites
        .par_chunks(BLEND.level_chunk)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            for site in chunk.iter().filter(|site| voxels.level(site.spacing) == level) {
                let reach = Reach::new(site, side(voxels.finest, level));
                visit_blocks(&reach, |b| found.push(parent(block_key(level, b))));
            }
            found.sort_unstable();
            found.dedup();
            Ok(found)
        })
        .collect::<Result<_>>()?;
    Ok(found.concat())
}

fn unique(keys: &mut Vec<u64>, ctx: &Context<'_>) -> Result<()> {
    sort(keys, ctx)?;
    keys.dedup();
    Ok(())
}

/// The block of the next level that holds a block.
fn parent(key: u64) -> u64 {
    block_key(level_of_key(key) + 1, block_of_key(key).map(|x| x.div_euclid(2)))
}

/// The eight blocks of the level before in a block.
fn children(key: u64) -> impl Iterator<Item = u64> {
    let (level, b) = (level_of_key(key), block_of_key(key));
    (0..8).map(move |c| block_key(level - 1, [0, 1, 2].map(|k| 2 * b[k] + (c >> k & 1))))
}

/// A block and the 26 around it.
fn around(key: u64) -> impl Iterator<Item = u64> {
    let (level, b) = (level_of_key(key), block_of_key(key));
    (0..27).map(move |n| block_key(level, [b[0] + n % 3 - 1, b[1] + n / 3 % 3 - 1, b[2] + n / 9 - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::atlas::SITE_CHARTS;
    use crate::numeric::rng::Rng;
    use crate::numeric::vec3::Vec3;

    /// Points of a plane that lie farther apart away from its middle.
    fn sites() -> Vec<BlendSite> {
        let mut rng = Rng::new(1);
        let site = |_| {
            let r = 300.0 * rng.uniform().powi(4);
            let a = rng.uniform() * std::f64::consts::TAU;
            BlendSite {
                position: Vec3([r * a.cos(), r * a.sin(), 0.3]),
                normal: Vec3([0.0, 0.6, 0.8]),
                spacing: 1.0 + 0.2 * r,
                charts: [(0, 1.0); SITE_CHARTS],
            }
        };
        (0..300).map(site).collect()
    }

    fn levels(sites: &[BlendSite]) -> Levels {
        let voxels = Voxels { finest: 0.75, per_spacing: 0.75 };
        Run::default().execute(|ctx| Levels::of(sites, voxels, ctx)).unwrap()
    }

    /// The blocks that the points reach, ascending.
    fn reached(levels: &Levels, sites: &[BlendSite]) -> Vec<u64> {
        let mut keys = Vec::new();
        sites.iter().for_each(|site| levels.visit(site, |key| keys.push(key)));
        keys.sort_unstable();
        keys.dedup();
        keys
    }

    #[test]
    fn no_contoured_block_lies_in_another_and_those_that_touch_differ_by_one_level() {
        let sites = sites();
        let levels = levels(&sites);
        assert!(levels.top >= 4, "{}", levels.top);
        let keys: FxHashSet<u64> =
            reached(&levels, &sites).into_iter().filter(|&key| levels.contours(key)).collect();
        let within =
            |key| std::iter::successors(Some(parent(key)), |&key| Some(parent(key))).take(levels.top);
        for &key in &keys {
            assert!(!within(key).any(|over| keys.contains(&over)));
            // A neighbour's place holds no block that is wider by two levels.
            for beside in around(key) {
                assert!(!within(beside).skip(1).any(|over| keys.contains(&over)));
            }
        }
    }

    #[test]
    fn every_corner_of_a_contoured_voxel_has_a_block_of_its_level_where_points_reach() {
        let sites = sites();
        let levels = levels(&sites);
        let keys: FxHashSet<u64> = reached(&levels, &sites).into_iter().collect();
        let mut lent = 0;
        for &key in keys.iter().filter(|&&key| levels.contours(key)) {
            let (level, b) = (level_of_key(key), block_of_key(key));
            for o in 1..8 {
                let beside = [0, 1, 2].map(|k| b[k] + (o >> k & 1));
                let beside_key = block_key(level, beside);
                let is_finer = children_of_level(beside_key).any(|child| keys.contains(&child));
                let reach = |site| Reach::new(site, levels.side(level)).holds(beside, BLEND.band);
                let missing = !keys.contains(&beside_key) && !is_finer;
                assert!(!missing || !sites.iter().any(reach), "level {level}: {beside:?}");
                lent += usize::from(!levels.contours(beside_key) && keys.contains(&beside_key));
            }
        }
        assert!(lent > 100, "{lent}");
    }

    fn children_of_level(key: u64) -> Box<dyn Iterator<Item = u64>> {
        if level_of_key(key) == 0 { Box::new(std::iter::empty()) } else { Box::new(children(key)) }
    }

    #[test]
    fn points_of_one_density_have_voxels_of_one_size() {
        let mut sites = sites();
        sites.iter_mut().for_each(|site| site.spacing = 1.0);
        let levels = levels(&sites);
        assert_eq!((levels.top, levels.cut.len(), levels.lenders.len()), (0, 0, 0));
    }
}
