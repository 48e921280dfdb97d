//! How the program talks: progress, notes, reports, Ctrl-C.
//!
//! A bar on a terminal, one plain line per stage elsewhere, nothing with `--quiet`.

use anyhow::{Context as _, Result};
use atlasfit::{CancelToken, Progress, Run, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::BTreeSet;
use std::io::IsTerminal;
use std::sync::Mutex;

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
    /// Give up after this many seconds
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

/// The program's voice.
pub struct Console {
    quiet: bool,
    json: bool,
    cancel: CancelToken,
    /// Notes told so far: several runs of a command may say the same.
    told: Mutex<BTreeSet<String>>,
}

impl Console {
    /// Listens to Ctrl-C: the first cancels the run, the second ends the program at once.
    pub fn new(quiet: bool, json: bool) -> Result<Self> {
        let cancel = CancelToken::new();
        let token = cancel.clone();
        ctrlc::set_handler(move || {
            if token.is_cancelled() {
                std::process::exit(130);
            }
            token.cancel();
        })
        .context("cannot listen to Ctrl-C")?;
        Ok(Self { quiet, json, cancel, told: Mutex::default() })
    }

    /// A run with these options whose progress is shown.
    pub fn start(&self, args: &RunArgs) -> Run<'static> {
        let run = Run {
            seed: args.seed,
            threads: args.threads,
            time_limit_s: args.time_limit,
            memory_limit_bytes: args.max_memory,
            cancel: Some(self.cancel.clone()),
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

    fn progress(&self) -> Option<Box<dyn FnMut(Progress) -> bool>> {
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
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:24} {bar:30} {percent:>3}% {elapsed}") {
            bar.set_style(style);
        }
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
            bar.0.set_position((1000.0 * p.fraction) as u64);
            true
        }))
    }

    /// Fails if Ctrl-C was pressed: for work that is no run.
    pub fn check(&self) -> Result<()> {
        if self.cancel.is_cancelled() { Err(atlasfit::Error::Cancelled.into()) } else { Ok(()) }
    }

    /// Something that the user should know, on standard error; the same only once.
    pub fn note(&self, text: impl std::fmt::Display) {
        let text = text.to_string();
        let new = self.told.lock().map_or(true, |mut told| told.insert(text.clone()));
        if !self.quiet && new {
            eprintln!("note: {text}");
        }
    }

    /// The report of a command: text, or the JSON with `--json`. `--quiet` silences the text.
    pub fn report(&self, text: &str, json: &serde_json::Value) {
        use std::io::Write as _;
        let out = if self.json { format!("{json:#}\n") } else { text.to_owned() };
        if self.json || !self.quiet {
            // A closed pipe (`| head`) is no failure.
            let _ = std::io::stdout().write_all(out.as_bytes());
        }
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
