//! How the program talks: progress, notes, reports, Ctrl-C.
//!
//! A bar on a terminal, one plain line per stage elsewhere, nothing with `--quiet`. One deadline and one
//! Ctrl-C end the whole command: reading, working, baking, writing.

use anyhow::{Context as _, Result, ensure};
use atlasfit::{CancelToken, Deadline, Progress, Run, Stop};
use serde_json::{Value, json};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

/// A mistake on the command line that only shows once the input is known.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// How long work is run; the same options for every command.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Run")]
pub struct RunArgs {
    /// Worker threads; 0 = all cores. The result does not depend on it
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub threads: usize,
    /// Seed of everything random
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub seed: u64,
    /// Give up after this many seconds of the whole command (of each run of a benchmark)
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time_limit: Option<f64>,
    /// Give up rather than use more memory, for example 2G or 500M
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub max_memory: Option<u64>,
}

fn seconds(s: &str) -> Result<f64, String> {
    match s.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("give a positive number of seconds".into()),
    }
}

fn bytes(s: &str) -> Result<u64, String> {
    let digits = s.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let factor = match s[digits.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 1.0,
        "K" | "KB" | "KIB" => 1024.0,
        "M" | "MB" | "MIB" => 1024f64.powi(2),
        "G" | "GB" | "GIB" => 1024f64.powi(3),
        "T" | "TB" | "TIB" => 1024f64.powi(4),
        _ => f64::NAN,
    };
    match digits.parse::<f64>().map(|x| x * factor) {
        Ok(x) if (1.0..1e18).contains(&x) => Ok(x as u64),
        _ => Err("give a number with K, M, G or T behind it, for example 2G".into()),
    }
}

/// What the program has told so far.
#[derive(Default)]
struct Told {
    notes: Vec<String>,
    warnings: Vec<String>,
}

/// Stack of a thread that is left behind: that of a program's first thread on Linux.
const STACK_BYTES: usize = 8 << 20;
/// Stack of a thread that the standard library is not told a size for.
#[cfg(not(target_family = "wasm"))]
const DEFAULT_STACK_BYTES: usize = 2 << 20;
/// What is left for the program beside a stack: less would end it while the thread starts, without a word.
const BESIDE_STACK_BYTES: usize = 1 << 20;

/// Fails where the system gives no memory for one more thread.
fn room_for_a_thread(stack_bytes: usize) -> Result<()> {
    ensure!(
        atlasfit::run::has_room(stack_bytes + BESIDE_STACK_BYTES),
        "out of memory: the system gives no room for one more thread. Give the program more memory"
    );
    Ok(())
}

/// How often Ctrl-C and the time limit are looked at while such a thread works: well inside the 100 ms that a
/// cancel may take.
const TICK: Duration = Duration::from_millis(20);

/// The program's voice.
pub struct Console {
    quiet: bool,
    json: bool,
    cancel: CancelToken,
    /// When the command began: its time limit counts from here.
    started: Instant,
    told: Mutex<Told>,
    /// The part of the command that runs: shares of the whole where it begins and ends, in [0, 1].
    part: Mutex<Option<[f64; 2]>>,
    /// Whether standard output holds a file, so that the report goes to standard error.
    output_taken: AtomicBool,
    /// Whether each run has the time limit to itself: in benchmarks.
    runs_alone: AtomicBool,
}

/// The first Ctrl-C cancels, the second ends the program at once.
#[cfg(not(target_family = "wasm"))]
fn listen(token: CancelToken) -> Result<()> {
    room_for_a_thread(DEFAULT_STACK_BYTES)?;
    ctrlc::set_handler(move || {
        if token.is_cancelled() {
            atlasfit_io::discard_unfinished();
            std::process::exit(130);
        }
        token.cancel();
    })
    .context("cannot start the thread that listens to Ctrl-C, give the program more memory")
}

impl Console {
    /// Listens to Ctrl-C: the first cancels the run, the second ends the program at once, without leaving
    /// half an output.
    pub fn new(quiet: bool, json: bool) -> Result<Self> {
        let cancel = CancelToken::new();
        #[cfg(not(target_family = "wasm"))]
        listen(cancel.clone())?;
        Ok(Self {
            quiet,
            json,
            cancel,
            started: Instant::now(),
            told: Mutex::default(),
            part: Mutex::default(),
            output_taken: AtomicBool::new(false),
            runs_alone: AtomicBool::new(false),
        })
    }

    /// What ends the command before it is done.
    pub fn stop(&self, args: &RunArgs) -> Stop {
        let limit = args.time_limit.filter(|_| !self.runs_alone.load(Ordering::Relaxed));
        // The command line has checked the seconds.
        let deadline = limit.and_then(|s| Deadline::new(self.started, s).ok());
        Stop::default().with_cancel(Some(self.cancel.clone())).with_deadline(deadline)
    }

    /// From here on each run has the time limit to itself.
    pub fn run_alone(&self) {
        self.runs_alone.store(true, Ordering::Relaxed);
    }

    /// The report goes to standard error: standard output holds a file.
    pub fn take_output(&self) {
        self.output_taken.store(true, Ordering::Relaxed);
    }

    /// The next part of the command begins, which takes up the bar to `end`, a share of the whole in [0, 1].
    pub fn part_to(&self, end: f64) {
        if let Ok(mut part) = self.part.lock() {
            *part = Some([part.map_or(0.0, |p| p[1]), end]);
        }
    }

    /// A run with these options whose progress is shown.
    pub fn start(&self, args: &RunArgs) -> Run<'static> {
        let stop = self.stop(args);
        let run = Run {
            seed: args.seed,
            threads: args.threads,
            time_limit_s: args.time_limit.filter(|_| stop.deadline.is_none()),
            deadline: stop.deadline,
            memory_limit_bytes: args.max_memory,
            cancel: stop.cancel,
            progress: self.progress(),
        };
        if let Some(warning) = run.threads_warning() {
            self.note(warning);
        }
        run
    }

    /// The same run without progress: for many short runs in a row.
    pub fn start_silent(&self, args: &RunArgs) -> Run<'static> {
        Run { progress: None, ..self.start(args) }
    }

    /// Work in a browser tells no progress.
    #[cfg(target_family = "wasm")]
    fn progress(&self) -> Option<Box<dyn FnMut(Progress) -> bool>> {
        None
    }

    #[cfg(not(target_family = "wasm"))]
    fn progress(&self) -> Option<Box<dyn FnMut(Progress) -> bool>> {
        use atlasfit::Stage;
        use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
        use std::io::IsTerminal;

        if self.quiet {
            return None;
        }
        let mut stage: Option<Stage> = None;
        if !std::io::stderr().is_terminal() {
            return Some(Box::new(move |p| {
                // Preparing is over before anyone could read about it.
                if stage.replace(p.stage) != Some(p.stage) && p.stage != Stage::Prepare {
                    eprintln!("{} ...", p.stage.name());
                }
                true
            }));
        }
        let [from, to] = self.part.lock().ok().and_then(|p| *p).unwrap_or([0.0, 1.0]);
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:24} {bar:30} {percent:>3}% {elapsed}") {
            bar.set_style(style);
        }
        let bar = bar.with_elapsed(self.started.elapsed());
        // Dropped with the run: the bar clears itself.
        struct Clearing(ProgressBar);
        impl Drop for Clearing {
            fn drop(&mut self) {
                self.0.finish_and_clear();
            }
        }
        let bar = Clearing(bar);
        Some(Box::new(move |p| {
            if stage.replace(p.stage) != Some(p.stage) {
                bar.0.set_message(p.stage.name());
            }
            bar.0.set_position((1000.0 * (from + (to - from) * p.overall)) as u64);
            true
        }))
    }

    /// Fails if Ctrl-C was pressed or the time is up: for work that is no run.
    pub fn check(&self, args: &RunArgs, doing: &'static str) -> Result<()> {
        Ok(self.stop(args).check(doing)?)
    }

    /// Runs `job`, which cannot be stopped and changes nothing outside, in a thread of its own, which is left
    /// behind where the command ends before it.
    pub fn apart<T: Send + 'static>(
        &self,
        args: &RunArgs,
        doing: &'static str,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T> {
        // There are no threads in a browser.
        if cfg!(target_family = "wasm") {
            return Ok(job());
        }
        let (give, take) = sync_channel(1);
        let work = move || drop(give.send(job()));
        room_for_a_thread(STACK_BYTES)?;
        std::thread::Builder::new().stack_size(STACK_BYTES).spawn(work).context("cannot start a thread")?;
        loop {
            self.check(args, doing)?;
            match take.recv_timeout(TICK) {
                Ok(done) => return Ok(done),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(atlasfit::Error::internal(format!("a panic while {doing}")).into());
                }
            }
        }
    }

    /// Something that the user may want to know, on standard error and in the JSON.
    pub fn note(&self, text: impl std::fmt::Display) {
        self.tell("note", text.to_string(), |told| &mut told.notes);
    }

    /// How long work stands, on standard error; nothing with `--quiet`.
    #[cfg(feature = "learn")]
    pub fn tell_progress(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// The step of a long command that begins, on standard error; nothing with `--quiet`.
    pub fn step(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            eprintln!("{text} ...");
        }
    }

    /// Something that may make the result wrong, on standard error and in the JSON.
    pub fn warn(&self, text: impl std::fmt::Display) {
        self.tell("warning", text.to_string(), |told| &mut told.warnings);
    }

    fn tell(&self, kind: &str, text: String, list: fn(&mut Told) -> &mut Vec<String>) {
        let Ok(mut told) = self.told.lock() else { return };
        // Several runs of a command may say the same.
        if !list(&mut told).contains(&text) {
            if !self.quiet {
                eprintln!("{kind}: {text}");
            }
            list(&mut told).push(text);
        }
    }

    /// The notes and the warnings so far.
    pub fn told(&self) -> [Vec<String>; 2] {
        self.told.lock().map(|t| [t.notes.clone(), t.warnings.clone()]).unwrap_or_default()
    }

    /// The report of a command that writes files, or does other work: as [`answer`](Self::answer), but
    /// `--quiet` silences the text.
    pub fn report(&self, text: &str, json: &Value) {
        if self.json || !self.quiet {
            self.answer(text, json);
        }
    }

    /// What a command was asked for: text, or the JSON with `--json`, with all notes and warnings.
    pub fn answer(&self, text: &str, json: &Value) {
        let out = if self.json { format!("{:#}\n", self.with_told(json.clone())) } else { text.to_owned() };
        // A closed pipe (`| head`) is no failure.
        use std::io::Write as _;
        let _ = if self.output_taken.load(Ordering::Relaxed) {
            std::io::stderr().write_all(out.as_bytes())
        } else {
            std::io::stdout().write_all(out.as_bytes())
        };
    }

    /// The report of a command that failed.
    pub fn failed(&self, kind: &str, text: &str, code: u8) {
        eprintln!("atlasfit: {text}");
        if self.json {
            self.report("", &json!({ "error": { "kind": kind, "text": text }, "exit_code": code }));
        }
    }

    /// A report with all that was told besides.
    fn with_told(&self, mut json: Value) -> Value {
        if let (Some(object), Ok(told)) = (json.as_object_mut(), self.told.lock()) {
            for (name, list) in [("notes", &told.notes), ("warnings", &told.warnings)] {
                let all = object.entry(name).or_insert_with(|| json!([]));
                if let Some(all) = all.as_array_mut() {
                    all.extend(list.iter().map(|t| json!(t)));
                }
            }
        }
        json
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_seconds_are_read_or_refused() {
        assert_eq!(bytes("2G"), Ok(2 << 30));
        assert_eq!(bytes("1.5k"), Ok(1536));
        assert_eq!(bytes("1000"), Ok(1000));
        for bad in ["", "G", "-1", "2X", "1e300", "nan"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
        assert!(seconds("0").is_err() && seconds("inf").is_err() && seconds("0.5") == Ok(0.5));
    }
}
