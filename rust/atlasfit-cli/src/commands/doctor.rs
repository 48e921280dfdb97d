//! `atlasfit doctor`: what the program can use on this machine, and whether it works here.
//!
//! In: nothing. Out: processor, memory, features, and the time of a small job that is really done.

use crate::console::{Console, RunArgs};
use crate::number::{count, json as number};
use crate::version;
use anyhow::Result;
use atlasfit::geometry::PointCloud;
use atlasfit::numeric::dense::lanes_here;
use atlasfit::pipeline::{DenoiseOptions, denoise, memory_needed};
use serde_json::{Value, json};
use std::time::Instant;
use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// Options of `doctor`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    run: RunArgs,
}

/// Points of the job that is done to see whether the program works.
const TEST_POINTS: usize = 2_000;
/// Bytes in a GiB.
const GIB: f64 = (1u64 << 30) as f64;

/// What was found.
struct Facts {
    threads: usize,
    /// Numbers of 64 bits that one instruction handles.
    lanes: usize,
    /// Bytes that this process may still take, and those that there are for it in all.
    memory: Option<[u64; 2]>,
    /// The most points that this memory is enough for, by the estimate that `--max-memory` is compared with.
    most_points: Option<usize>,
    /// Seconds that the job took.
    seconds: f64,
}

/// Looks, tries, and tells.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let threads = console.start_silent(&args.run).execute(|ctx| Ok(ctx.threads()))?;
    let memory = memory();
    let seconds = try_out(args, console)?;
    let most_points = memory.map(|[free, _]| most_points(free, threads));
    let facts = Facts { threads, lanes: lanes_here(), memory, most_points, seconds };
    console.answer(&facts.text(), &facts.json());
    Ok(())
}

/// Denoises points on a sphere; the seconds that it took.
fn try_out(args: &Args, console: &Console) -> Result<f64> {
    let started = Instant::now();
    let cloud = PointCloud::from_positions(sphere(TEST_POINTS));
    denoise(&cloud, &DenoiseOptions::default(), &mut console.start_silent(&args.run))?;
    Ok(started.elapsed().as_secs_f64())
}

/// Points spread evenly over a sphere.
fn sphere(points: usize) -> Vec<[f64; 3]> {
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / points as f64;
        let (sin, cos) = (turn * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    };
    (0..points).map(point).collect()
}

/// Memory in bytes that is free, and that there is, by the machine and the container's limit; `None` where
/// the system does not tell.
fn memory() -> Option<[u64; 2]> {
    let what = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    let system = System::new_with_specifics(what).ok()?;
    let [mut free, mut all] = [system.available_memory(), system.total_memory()];
    if let Some(limits) = system.cgroup_limits() {
        free = free.min(limits.free_memory);
        all = all.min(limits.total_memory);
    }
    (all > 0).then_some([free, all])
}

/// The most points that so many bytes are enough for.
fn most_points(bytes: u64, threads: usize) -> usize {
    let options = DenoiseOptions::default();
    let fits = |points: &usize| memory_needed(*points, &options, threads) <= bytes;
    // Steps of a tenth are as exact as the estimate.
    std::iter::successors(Some(1_000usize), |n| Some(n + n / 10)).take_while(fits).last().unwrap_or(0)
}

impl Facts {
    /// The vector instructions in words.
    fn instructions(&self) -> &'static str {
        match self.lanes {
            1 => "none that are used",
            4 if cfg!(target_arch = "x86_64") => "AVX2 and FMA",
            _ if cfg!(target_arch = "aarch64") => "NEON",
            _ => "yes",
        }
    }

    fn text(&self) -> String {
        let memory = match (self.memory, self.most_points) {
            (Some([free, all]), Some(points)) => format!(
                "{:.1} of {:.1} GiB free: enough to denoise {:.1} million points",
                free as f64 / GIB,
                all as f64 / GIB,
                points as f64 / 1e6
            ),
            _ => "not told by the system".into(),
        };
        let features: Vec<String> = version::FEATURES
            .iter()
            .map(|(name, inside)| format!("{name} {}", if *inside { "yes" } else { "no" }))
            .collect();
        format!(
            "program        atlasfit {} ({})\nlicence        {}\nthreads        {}\nvectors        {}\n\
             memory         {memory}\nfeatures       {}\nit works       {} points denoised in {:.2} s\n",
            env!("CARGO_PKG_VERSION"),
            version::build(),
            version::LICENCE,
            self.threads,
            self.instructions(),
            features.join(", "),
            count(TEST_POINTS),
            self.seconds
        )
    }

    fn json(&self) -> Value {
        let features: Value = version::FEATURES.iter().map(|(n, inside)| (*n, *inside)).collect::<Value>();
        json!({
            "version": env!("CARGO_PKG_VERSION"), "build": version::build(), "licence": version::LICENCE,
            "threads": self.threads, "vector_lanes": self.lanes, "vectors": self.instructions(),
            "memory_free": self.memory.map(|m| m[0]), "memory": self.memory.map(|m| m[1]),
            "most_points": self.most_points, "features": features,
            "test_points": TEST_POINTS, "seconds": number(self.seconds),
        })
    }
}
