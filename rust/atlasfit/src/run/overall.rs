//! How much of a whole job is done, from the stages it enters.
//!
//! In: a plan (the stages in the order in which they are expected, each with its share of the time) and each
//! stage that is entered. Out: a share of the job in [0, 1] that never falls. A stage of the plan covers its
//! share; a stage that comes again covers half of what is left until the plan's next one, so that the share
//! moves whatever the job does. Without a plan the first stage is taken for the whole job.

use super::stage::Stage;

/// A stage of a plan.
struct Step {
    stage: Stage,
    /// Share of the job that is done when the stage begins, and when it ends.
    from: f64,
    to: f64,
}

/// How much of a job is done.
#[derive(Default)]
pub(super) struct Overall {
    plan: Vec<Step>,
    /// The furthest step of the plan that was entered.
    step: Option<usize>,
    /// What the running stage covers.
    from: f64,
    to: f64,
    reached: f64,
    /// Whether a stage was entered.
    begun: bool,
}

impl Overall {
    /// Lays down what comes, unless somebody farther out has done so.
    pub fn plan(&mut self, shares: &[(Stage, f64)]) {
        if !self.plan.is_empty() {
            return;
        }
        let sum: f64 = shares.iter().map(|s| s.1).sum();
        let mut from = 0.0;
        for &(stage, share) in shares {
            let to = from + share / sum;
            self.plan.push(Step { stage, from, to });
            from = to;
        }
    }

    /// A stage begins, of which nothing is done yet.
    pub fn enter(&mut self, stage: Stage) {
        let next = self.step.map_or(0, |s| s + 1);
        let found = self.plan.iter().skip(next).position(|s| s.stage == stage).map(|i| next + i);
        if let Some(i) = found {
            (self.step, self.from, self.to) = (Some(i), self.reached.max(self.plan[i].from), self.plan[i].to);
        } else {
            let end = self.step.map_or(1.0, |i| self.plan[i].to);
            let whole = self.plan.is_empty() && !self.begun;
            (self.from, self.to) = (self.reached, if whole { 1.0 } else { 0.5 * (self.reached + end) });
        }
        self.begun = true;
        self.at(0.0);
    }

    /// The share of the job that is done when `fraction` of the running stage is.
    pub fn at(&mut self, fraction: f64) -> f64 {
        self.reached = self.reached.max(self.from + (self.to - self.from) * fraction).min(1.0);
        self.reached
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_never_falls_and_ends_at_one_whatever_comes_again() {
        use Stage::{Analyse, Fit, Partition, Surface};
        let mut overall = Overall::default();
        overall.plan(&[(Analyse, 1.0), (Partition, 4.0), (Fit, 2.0), (Surface, 3.0)]);
        overall.plan(&[(Fit, 1.0)]);
        let mut last = 0.0;
        for stage in [Analyse, Partition, Fit, Partition, Partition, Fit, Surface, Surface] {
            overall.enter(stage);
            for fraction in [0.0, 0.5, 0.25, 1.0] {
                let now = overall.at(fraction);
                assert!(now >= last && now <= 1.0, "{stage:?} {fraction}: {now} after {last}");
                last = now;
            }
        }
        assert!((last - 1.0).abs() < 1e-12, "{last}");
        let mut other = Overall::default();
        other.plan(&[(Analyse, 1.0), (Partition, 4.0)]);
        other.enter(Partition);
        assert!((other.at(0.5) - 0.6).abs() < 1e-12, "the stage left out counts as done");
        other.enter(Analyse);
        assert!(other.at(0.5) > 0.6, "a stage that comes again still moves");
        let mut single = Overall::default();
        single.enter(Fit);
        assert!((single.at(0.5) - 0.5).abs() < 1e-12, "one stage is the whole job");
    }
}
