//! Shapes in random order, batch by batch, read by workers while others are trained on.
//!
//! Shards are taken in random order, a few at a time, whose shapes are mixed. The order follows from the seed
//! and the epoch, never from the workers.

use super::{Dataset, Shard, Split};
use crate::error::Result;
use atlasfit::numeric::rng::{Rng, shuffled};
use std::collections::VecDeque;
use std::thread::{JoinHandle, spawn};

/// Shards whose shapes are mixed.
const MIXED: usize = 4;
/// Groups of shards that are read ahead, each by a worker of its own.
const AHEAD: usize = 2;

/// Shapes to train on.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Batch {
    /// Number of shapes.
    pub len: usize,
    /// Coordinates, shapes x points x 3.
    pub points: Vec<f32>,
    /// One picture of each, shapes x side x side x 2, 0 to 255.
    pub pictures: Vec<u8>,
}

/// The batches of one epoch.
pub struct Batches {
    data: Dataset,
    groups: VecDeque<Vec<usize>>,
    reading: VecDeque<JoinHandle<Result<Shard>>>,
    shard: Shard,
    order: Vec<u32>,
    rng: Rng,
    points: usize,
    batch: usize,
}

impl Batches {
    /// The training shapes in the order of an epoch, with `points` random points of each.
    #[must_use]
    pub fn new(data: &Dataset, batch: usize, points: usize, seed: u64, epoch: u64) -> Self {
        let mut rng = Rng::stream(seed, epoch);
        let shards = shuffled(data.shards(Split::Train), rng.bits());
        let groups = shards.chunks(MIXED).map(|g| g.iter().map(|i| *i as usize).collect()).collect();
        let mut all = Self {
            data: data.clone(),
            groups,
            reading: VecDeque::new(),
            shard: Shard::new(&data.manifest.recipe),
            order: Vec::new(),
            rng,
            points: points.min(data.manifest.recipe.points),
            batch,
        };
        all.read_ahead();
        all
    }

    fn read_ahead(&mut self) {
        while self.reading.len() < AHEAD
            && let Some(group) = self.groups.pop_front()
        {
            let data = self.data.clone();
            self.reading.push_back(spawn(move || {
                let mut all = Shard::new(&data.manifest.recipe);
                for i in group {
                    all.append(data.read(Split::Train, i)?);
                }
                Ok(all)
            }));
        }
    }

    /// The next group of shards in place of one that is used up.
    fn next_group(&mut self) -> Option<Result<()>> {
        let shard = match self.reading.pop_front()?.join() {
            Ok(Ok(shard)) => shard,
            Ok(Err(e)) => return Some(Err(e)),
            Err(_) => {
                return Some(Err(atlasfit::Error::internal("a worker that reads shapes panicked").into()));
            }
        };
        self.read_ahead();
        self.order = shuffled(shard.len(), self.rng.bits());
        self.shard = shard;
        Some(Ok(()))
    }

    fn take(&mut self, some: &[u32]) -> Batch {
        let [all, views, side] = self.shard.size;
        let mut batch = Batch {
            len: some.len(),
            points: Vec::new(),
            pictures: Vec::with_capacity(some.len() * side * side),
        };
        for &shape in some {
            let shape = shape as usize;
            // Points are independent samples: any run of them is one.
            let points = self.shard.points_of(shape);
            let first = self.rng.below(all);
            let wanted = (0..self.points).map(|i| (first + i) % all);
            batch.points.extend(wanted.flat_map(|i| [points[3 * i], points[3 * i + 1], points[3 * i + 2]]));
            let view = self.rng.below(views);
            batch.pictures.extend_from_slice(self.shard.picture_of(shape, view));
        }
        batch
    }
}

/// The brightest pixel's number in a file; the encoder takes 1 for it.
pub(crate) const BRIGHTEST: f64 = 255.0;

/// Numbers of a picture as the encoder takes them.
pub(crate) fn pixels(bytes: &[u8]) -> impl Iterator<Item = f32> + '_ {
    bytes.iter().map(|&b| f32::from(b) / BRIGHTEST as f32)
}

impl Iterator for Batches {
    type Item = Result<Batch>;

    /// Batches are full; what is left of a group is left out of this epoch.
    fn next(&mut self) -> Option<Self::Item> {
        while self.order.len() < self.batch {
            if let Err(e) = self.next_group()? {
                return Some(Err(e));
            }
        }
        let some = self.order.split_off(self.order.len() - self.batch);
        Some(Ok(self.take(&some)))
    }
}
