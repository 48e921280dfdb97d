//! How near the default prior of `atlasfit` is to the exact process.
//!
//! In: the exact kernel's expansion on the disk; heights over a disk. Out: how much of the exact
//! eigenfunctions the default prior's functions hold; posterior means of both, and of the exact process on
//! other coordinates. Both priors leave a plane free and choose their smoothness by restricted marginal
//! likelihood (Rasmussen and Williams 2006, sections 2.7 and 5.4), the default prior its bends too.

use crate::disk::Expansion;
use crate::kernel::Kernel;
use atlasfit::Vec3;
use atlasfit::numeric::dense::principal;
use atlasfit::prior::{eigenfunctions, freer_precisions, precisions};
use atlasfit::spatial::neighbours::Neighbours;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Angles of the places that subspaces are compared at.
const ANGLES: usize = 64;

/// How the spans of functions lie to each other.
#[derive(Debug, Clone)]
pub struct Alignment {
    /// Of each exact eigenfunction, the share of its square that the default prior's functions hold.
    pub held: Vec<f64>,
    /// Principal angles between the spans of as many functions of each, in degrees, the smallest first.
    pub angles: Vec<f64>,
}

/// Compares the first `count` exact eigenfunctions with the default prior's functions.
#[must_use]
pub fn alignment(exact: &Expansion, count: usize) -> Alignment {
    let places = exact.places(ANGLES);
    let weighted = |mut m: DMatrix<f64>| {
        for (mut row, (_, w)) in m.row_iter_mut().zip(&places) {
            row *= w.sqrt();
        }
        m
    };
    let exact = weighted(exact.functions(count, ANGLES));
    let rows: Vec<f64> = places.iter().flat_map(|(p, _)| eigenfunctions(p[0], p[1])).collect();
    let ours = weighted(DMatrix::from_row_slice(places.len(), precisions().len(), &rows));
    let project = |m: DMatrix<f64>| m.qr().q().transpose() * &exact;
    let few = ours.columns(0, count.min(ours.ncols())).into_owned();
    let held = project(ours).column_iter().map(|c| c.norm_squared()).collect();
    let mut angles: Vec<f64> =
        project(few).singular_values().iter().map(|s| s.clamp(-1.0, 1.0).acos().to_degrees()).collect();
    angles.sort_by(f64::total_cmp);
    Alignment { held, angles }
}

/// Heights over a plane.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Places in the plane; the farthest is 1 from the middle.
    pub at: Vec<[f64; 2]>,
    /// In the same unit.
    pub heights: Vec<f64>,
}

impl Patch {
    /// The `count` points nearest to one, over their principal plane. With `aspect` above 1 distances along a
    /// direction of the plane count that much less: the patch is longer than wide, and its longer side is the
    /// first coordinate.
    #[must_use]
    pub fn around(
        points: &[Vec3],
        tree: &Neighbours,
        middle: usize,
        count: usize,
        aspect: f64,
    ) -> Option<Self> {
        let mut found = Vec::new();
        tree.nearest(points[middle], (count as f64 * aspect * aspect) as usize, &mut found);
        let near: Vec<Vec3> = found.iter().map(|f| points[f.index as usize]).collect();
        let plane = principal(near.iter().map(|p| (*p, 1.0)))?;
        let [normal, u, v] = plane.axes;
        let local = |p: &Vec3| [(*p - points[middle]).dot(u), (*p - points[middle]).dot(v)];
        let far = |p: &Vec3| (local(p)[0] / aspect).hypot(local(p)[1]);
        let mut near = near;
        near.sort_by(|a, b| far(a).total_cmp(&far(b)));
        near.truncate(count);
        let size = near.iter().map(|p| local(p)[0].hypot(local(p)[1])).fold(0.0, f64::max);
        (near.len() == count && size > 0.0).then(|| Self {
            at: near.iter().map(|p| local(p).map(|x| x / size)).collect(),
            heights: near.iter().map(|p| (*p - points[middle]).dot(normal) / size).collect(),
        })
    }
}

/// What is believed of heights before they are seen.
#[derive(Debug, Clone, Copy)]
pub enum Belief {
    /// The default prior.
    Default,
    /// The exact process of a kernel.
    Exact(Kernel),
}

/// What is believed after.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// At the places asked for.
    pub mean: Vec<f64>,
    /// Standard deviation of the surface there, without noise.
    pub deviation: Vec<f64>,
    /// Standard deviation of the noise.
    pub sigma: f64,
    /// Logarithm of the ratio of noise to prior variance.
    pub log_kappa: f64,
    /// Twice the negative log likelihood, up to what is the same for all beliefs of the same heights.
    pub score: f64,
}

/// Range and step of the search for the logarithm of kappa.
#[derive(Debug, Clone, Copy)]
pub struct Search {
    /// From here.
    pub from: f64,
    /// To here.
    pub to: f64,
    /// In steps of this.
    pub step: f64,
}

impl Search {
    /// So fine that a finer one changes nothing visible.
    pub const FINE: Self = Self { from: -23.0, to: 5.0, step: 0.25 };
    /// In factors of 8, as the default prior searches.
    pub const COARSE: Self = Self { from: -23.0, to: 5.0, step: 2.1 };
}

/// Columns that are free, then columns with unit prior precision: a Gaussian linear model of both priors.
struct Model {
    seen: DMatrix<f64>,
    asked: DMatrix<f64>,
    free: usize,
}

/// The posterior of the heights of a patch at other places.
///
/// `None` where no smoothness gives a solution.
#[must_use]
pub fn posterior(belief: Belief, patch: &Patch, at: &[[f64; 2]], search: Search) -> Option<Posterior> {
    let of = |model: &Model| posterior_of(model, patch, at.len(), search);
    match belief {
        Belief::Default => {
            let bends = [precisions().to_vec(), freer_precisions()];
            let found = bends.iter().filter_map(|p| of(&default_model(p, &patch.at, at)));
            found.min_by(|a, b| a.score.total_cmp(&b.score))
        }
        Belief::Exact(kernel) => of(&exact_model(&kernel, &patch.at, at)?),
    }
}

fn posterior_of(model: &Model, patch: &Patch, asked: usize, search: Search) -> Option<Posterior> {
    let heights = DVector::from_column_slice(&patch.heights);
    let gram = model.seen.tr_mul(&model.seen);
    let side = model.seen.tr_mul(&heights);
    let dof = (patch.at.len() - model.free) as f64;
    let bound = model.seen.ncols() - model.free;
    let system = |kappa: f64| -> Option<Cholesky<f64, Dyn>> {
        let mut a = gram.clone();
        for i in model.free..a.nrows() {
            a[(i, i)] += kappa;
        }
        Cholesky::new(a)
    };
    let mut best: Option<(f64, f64, f64)> = None;
    let steps = ((search.to - search.from) / search.step) as usize;
    for log_kappa in (0..=steps).map(|k| search.from + k as f64 * search.step) {
        let Some(factor) = system(log_kappa.exp()) else { continue };
        let weights = factor.solve(&side);
        let sigma2 = (heights.norm_squared() - side.dot(&weights)).max(1e-300) / dof;
        let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        let score = dof * sigma2.ln() + log_det - bound as f64 * log_kappa;
        if best.is_none_or(|b| score < b.0) {
            best = Some((score, log_kappa, sigma2));
        }
    }
    let (score, log_kappa, sigma2) = best?;
    let factor = system(log_kappa.exp())?;
    let mean = &model.asked * factor.solve(&side);
    let spread = factor.solve(&model.asked.transpose());
    let deviation = (0..asked)
        .map(|i| (sigma2 * model.asked.row(i).transpose().dot(&spread.column(i))).max(0.0).sqrt())
        .collect();
    Some(Posterior { mean: mean.as_slice().to_vec(), deviation, sigma: sigma2.sqrt(), log_kappa, score })
}

/// The linear model of the default prior, with these precisions of its functions.
fn default_model(precisions: &[f64], seen: &[[f64; 2]], asked: &[[f64; 2]]) -> Model {
    let scales: Vec<f64> = precisions.iter().map(|p| if *p > 0.0 { 1.0 / p.sqrt() } else { 1.0 }).collect();
    let values: Vec<f64> = (seen.iter().chain(asked))
        .flat_map(|p| {
            eigenfunctions(p[0], p[1]).into_iter().zip(&scales).map(|(f, s)| f * s).collect::<Vec<_>>()
        })
        .collect();
    split(&DMatrix::from_row_slice(seen.len() + asked.len(), scales.len(), &values), seen.len())
}

/// The linear model of the exact process, in the eigenvectors of its covariance between all places.
fn exact_model(kernel: &Kernel, seen: &[[f64; 2]], asked: &[[f64; 2]]) -> Option<Model> {
    let all: Vec<Vec<f64>> = seen.iter().chain(asked).map(|p| p.to_vec()).collect();
    // What lies in the span of the free plane is told by it: only the rest needs columns.
    let mut k = crate::sample::matrix(kernel, &all);
    let mean = k.trace() / all.len() as f64;
    for i in 0..all.len() {
        k[(i, i)] += 1e-9 * mean;
    }
    let factor = Cholesky::new(k)?.unpack();
    let mut rows = DMatrix::zeros(all.len(), all.len() + 3);
    for (i, p) in all.iter().enumerate() {
        rows[(i, 0)] = 1.0;
        rows[(i, 1)] = p[0];
        rows[(i, 2)] = p[1];
    }
    rows.columns_mut(3, all.len()).copy_from(&factor);
    Some(split(&rows, seen.len()))
}

/// Rows of the places that are seen, then of those that are asked for.
fn split(rows: &DMatrix<f64>, seen: usize) -> Model {
    let asked = rows.rows(seen, rows.nrows() - seen).into_owned();
    Model { seen: rows.rows(0, seen).into_owned(), asked, free: 3 }
}

/// Two beliefs on the same patches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Comparison {
    /// Root mean square difference of the posterior means, in standard deviations of the second's posterior.
    pub apart: f64,
    /// Root mean square error of each at points left out, over the second's noise.
    pub errors: [f64; 2],
    /// Patches that both solved.
    pub patches: usize,
}

/// Compares two beliefs, each with its own search and its own coordinates: every fourth point of a patch is
/// left out and asked for.
#[must_use]
pub fn compare(beliefs: [(Belief, Search); 2], patches: &[[Patch; 2]]) -> Comparison {
    let mut sum = Comparison::default();
    let mut asked = 0usize;
    for pair in patches {
        let found: Vec<Option<(Posterior, Vec<f64>)>> = (beliefs.iter().zip(pair))
            .map(|((belief, search), patch)| {
                let part = |out: bool| -> Patch {
                    let chosen = || (0..patch.at.len()).filter(move |i| (i % 4 == 1) == out);
                    Patch {
                        at: chosen().map(|i| patch.at[i]).collect(),
                        heights: chosen().map(|i| patch.heights[i]).collect(),
                    }
                };
                let out = part(true);
                Some((posterior(*belief, &part(false), &out.at, *search)?, out.heights))
            })
            .collect();
        let [Some((a, truth)), Some((b, _))] = &found[..] else { continue };
        sum.patches += 1;
        asked += truth.len();
        for (i, h) in truth.iter().enumerate() {
            sum.apart += ((a.mean[i] - b.mean[i]) / b.deviation[i]).powi(2);
            for (error, p) in sum.errors.iter_mut().zip([a, b]) {
                *error += ((p.mean[i] - h) / b.sigma).powi(2);
            }
        }
    }
    let root = |x: f64| (x / asked.max(1) as f64).sqrt();
    Comparison { apart: root(sum.apart), errors: sum.errors.map(root), ..sum }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::Resolution;
    use atlasfit::numeric::rng::Rng;

    fn waves(sigma: f64) -> Patch {
        let mut rng = Rng::new(4);
        let at: Vec<[f64; 2]> = std::iter::repeat_with(|| [0; 2].map(|_| 2.0 * rng.uniform() - 1.0))
            .filter(|p| p[0].hypot(p[1]) < 1.0)
            .take(120)
            .collect();
        let heights =
            at.iter().map(|p| 0.1 * (3.0 * p[0]).sin() * (2.0 * p[1]).cos() + sigma * rng.normal()).collect();
        Patch { at, heights }
    }

    #[test]
    fn the_default_prior_holds_nearly_all_of_the_exact_processes_first_functions() {
        let kernel = Kernel::relu(1);
        let how = Resolution { radii: 20, angles: 256, periods: 16 };
        let exact = Expansion::new(|p| kernel.covariance(p).ab, how);
        let found = alignment(&exact, 25);
        let mean = found.held.iter().sum::<f64>() / 25.0;
        assert!(mean > 0.98 && mean <= 1.0 + 1e-9, "{found:?}");
    }

    #[test]
    fn posteriors_find_the_noise_and_agree_within_a_deviation() {
        let patch = waves(0.01);
        let exact = Belief::Exact(Kernel::relu(1));
        for belief in [Belief::Default, exact] {
            let found = posterior(belief, &patch, &patch.at, Search::FINE).unwrap();
            assert!((found.sigma / 0.01 - 1.0).abs() < 0.3, "{belief:?} {}", found.sigma);
        }
        let same = [[patch.clone(), patch]];
        let found = compare([(Belief::Default, Search::FINE), (exact, Search::FINE)], &same);
        assert!(found.apart < 1.0 && found.patches == 1, "{found:?}");
    }
}
