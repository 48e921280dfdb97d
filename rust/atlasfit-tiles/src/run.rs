//! Tasks run, and what is known of them.
//!
//! In: a work folder with a plan. Out: the tasks' files, a record of each task. A task whose files are there
//! is done: it is not run again. Any number of processes may run tasks of one plan.

use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::plan::{Plan, Task, Tile};
use crate::tasks::{self, Kind};
use crate::{job, light, merge, seams, store};
use atlasfit::{Run, Stop};
use atlasfit_io::discard_begun;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// How a task went.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Log {
    /// Seconds that it took.
    pub seconds: f64,
    /// Threads that it had.
    pub threads: usize,
    /// Why it failed, the last time.
    pub error: Option<String>,
}

/// How a plan stands.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Status {
    /// Tasks.
    pub tasks: usize,
    /// Those that are done.
    pub done: usize,
    /// Those that failed when they ran last, and why.
    pub failed: Vec<(String, String)>,
    /// Seconds that those left take one after the other, by those that are done; nothing before there are
    /// such.
    pub seconds_left: Option<f64>,
    /// Outputs that are not there.
    pub missing: Vec<String>,
    /// What was decided at the seams, once it is.
    pub summary: Option<seams::Summary>,
}

impl Task {
    /// Whether all that it writes is there.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.outputs.iter().all(|o| o.exists())
    }
}

/// Runs a task by its name.
///
/// # Errors
/// [`Error`]: no such task, tasks before it that are not done, and those of its work. They are noted in the
/// folder too.
pub fn task(plan: &Plan, folder: &Path, name: &str, run: &mut Run<'_>, stop: &Stop) -> Result<()> {
    let Some((task, kind)) = plan.tasks.iter().find(|t| t.name == name).zip(Kind::of(name)) else {
        return Err(Error::refused(format!("the plan has no task {name}"), "See `tasks` in plan.json"));
    };
    if task.is_done() {
        task.outputs.iter().for_each(|o| discard_begun(o));
        return Ok(());
    }
    if let Some(before) = plan.tasks.iter().find(|t| task.after.contains(&t.name) && !t.is_done()) {
        return Err(Error::refused(
            format!("{name} needs {}, which is not done", before.name),
            "Run that first, or all tasks",
        ));
    }
    let started = Instant::now();
    run.seed = plan.options.seed;
    let at = Folder(folder);
    let done = match kind {
        Kind::Tile(k) => job::run(plan, at, k, run),
        Kind::Seams => seams::run(plan, at, run, stop),
        Kind::Light(k) => light::run(plan, at, k, run, stop),
        Kind::Points(k) => merge::points(plan, at, k, stop),
        Kind::Surface => merge::surface(plan, at, stop),
        Kind::Tileset => merge::tileset(plan, at, stop),
    };
    // Where another process was first, the outputs are there all the same.
    let done = if task.is_done() { Ok(()) } else { done };
    if done.is_ok() {
        // What killed processes have left.
        task.outputs.iter().for_each(|o| discard_begun(o));
    }
    let log = Log {
        seconds: started.elapsed().as_secs_f64(),
        threads: run.threads,
        error: done.as_ref().err().map(ToString::to_string),
    };
    let (there, other) = match done {
        Ok(()) => (at.log(name), at.failed(name)),
        Err(_) => (at.failed(name), at.log(name)),
    };
    let _ = std::fs::remove_file(other);
    // A full disk must not hide why the task failed.
    let noted = store::text(&there, &serde_json::to_string(&log).unwrap_or_default());
    done.and(noted)
}

/// What a record says.
fn log(path: &Path) -> Option<Log> {
    serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
}

/// How a plan stands.
#[must_use]
pub fn status(plan: &Plan, folder: &Path) -> Status {
    let at = Folder(folder);
    let mut status = Status { tasks: plan.tasks.len(), ..Status::default() };
    let mut times = Times::default();
    for task in &plan.tasks {
        if task.is_done() {
            status.done += 1;
            if let Some(log) = log(&at.log(&task.name)) {
                times.add(task, log.seconds);
            }
        } else {
            status.missing.extend(task.outputs.iter().map(|o| o.display().to_string()));
            let failed = log(&at.failed(&task.name)).and_then(|l| l.error);
            status.failed.extend(failed.map(|e| (task.name.clone(), e)));
        }
    }
    let left: Vec<&Task> = plan.tasks.iter().filter(|t| !t.is_done()).collect();
    if times.known() {
        status.seconds_left = Some(left.iter().map(|t| times.of(t)).sum());
    }
    status.summary =
        std::fs::read_to_string(at.summary()).ok().and_then(|text| serde_json::from_str(&text).ok());
    status
}

/// How long tasks take, by kind: seconds for a point.
#[derive(Default)]
struct Times {
    sums: std::collections::BTreeMap<String, [f64; 2]>,
}

/// The kind of a task, by its name.
fn kind(task: &Task) -> String {
    task.name.split('-').next().unwrap_or_default().to_owned()
}

impl Times {
    fn add(&mut self, task: &Task, seconds: f64) {
        let sum = self.sums.entry(kind(task)).or_default();
        sum[0] += seconds;
        sum[1] += task.points as f64;
    }
    fn known(&self) -> bool {
        !self.sums.is_empty()
    }
    /// Seconds that a task takes; of a kind that has not run, a share of those of tiles. Measured,
    /// docs/scale.md.
    fn of(&self, task: &Task) -> f64 {
        let rate = |kind: &str| self.sums.get(kind).map(|s| s[0] / s[1].max(1.0));
        let kind = kind(task);
        let share = match kind.as_str() {
            "tile" => 1.0,
            "light" => 0.5,
            _ => 0.01,
        };
        rate(&kind).or_else(|| rate("tile").map(|r| share * r)).unwrap_or(share * USUAL) * task.points as f64
    }
}

/// Seconds that a tile takes for a point on two cores, before any is measured. Measured, docs/scale.md.
const USUAL: f64 = 6e-5;

/// How a plan would run on several workers.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Simulated {
    /// Workers.
    pub workers: usize,
    /// Tasks.
    pub tasks: usize,
    /// Seconds from the first task to the last.
    pub seconds: f64,
    /// Seconds of all tasks together.
    pub work_seconds: f64,
    /// Share of the workers' time that they work.
    pub busy: f64,
    /// Most memory that the workers need together at a time, in bytes.
    pub peak_memory: u64,
    /// Whether the times are measured: by the tasks of this plan that are done.
    pub measured: bool,
}

/// A plan as it would be for so many points of the same kind: its tiles and files again and again.
fn as_if(plan: &Plan, points: u64, folder: &Path) -> Plan {
    let own: u64 = plan.tiles.iter().map(|t| t.own).sum();
    let times = points.div_ceil(own.max(1)).max(1);
    let mut larger = plan.clone();
    let files = plan.scans.len() as u32;
    let tile = |k: u64, t: &Tile| Tile {
        files: t.files.iter().map(|f| f + files * k as u32).collect(),
        ..t.clone()
    };
    larger.tiles = (0..times).flat_map(|k| plan.tiles.iter().map(move |t| tile(k, t))).collect();
    larger.scans = (0..times).flat_map(|_| plan.scans.iter().cloned()).collect();
    larger.tasks = tasks::of(&larger, folder);
    larger
}

/// Runs the plan on paper: each worker takes the first task that may run as soon as it is free. Times are
/// those of the tasks that are done, by points. With `points`, as if the scan had so many.
#[must_use]
pub fn simulate(plan: &Plan, folder: &Path, workers: usize, points: Option<u64>) -> Simulated {
    let workers = workers.max(1);
    let mut times = Times::default();
    for task in &plan.tasks {
        if let Some(log) = log(&Folder(folder).log(&task.name)) {
            times.add(task, log.seconds);
        }
    }
    let larger = points.map(|points| as_if(plan, points, folder));
    let plan = larger.as_ref().unwrap_or(plan);
    let number: std::collections::BTreeMap<&str, usize> =
        plan.tasks.iter().enumerate().map(|(i, t)| (t.name.as_str(), i)).collect();
    let mut waits: Vec<usize> = plan.tasks.iter().map(|t| t.after.len()).collect();
    let mut then: Vec<Vec<usize>> = vec![Vec::new(); plan.tasks.len()];
    for (i, task) in plan.tasks.iter().enumerate() {
        task.after.iter().filter_map(|a| number.get(a.as_str())).for_each(|&a| then[a].push(i));
    }
    let mut ready: std::collections::BTreeSet<usize> = (0..waits.len()).filter(|&i| waits[i] == 0).collect();
    // Tasks that run: when they end, in nanoseconds.
    let mut running: std::collections::BTreeSet<(u64, usize)> = std::collections::BTreeSet::new();
    let (mut now, mut work, mut memory, mut peak) = (0u64, 0.0, 0u64, 0u64);
    loop {
        while running.len() < workers
            && let Some(task) = ready.pop_first()
        {
            let seconds = times.of(&plan.tasks[task]);
            work += seconds;
            memory += plan.tasks[task].memory;
            peak = peak.max(memory);
            running.insert((now + (seconds * 1e9) as u64, task));
        }
        let Some((end, task)) = running.pop_first() else { break };
        now = end;
        memory -= plan.tasks[task].memory;
        for &t in &then[task] {
            waits[t] -= 1;
            if waits[t] == 0 {
                ready.insert(t);
            }
        }
    }
    let seconds = now as f64 / 1e9;
    Simulated {
        workers,
        tasks: plan.tasks.len(),
        seconds,
        work_seconds: work,
        busy: work / (seconds * workers as f64).max(f64::MIN_POSITIVE),
        peak_memory: peak,
        measured: times.known(),
    }
}
