//! All cases through a tool.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde::Serialize;

use super::answer::Answer;
use super::case::{Case, Family};
use super::generate::generate;
use super::score::Judged;
use super::{Schedule, Simulator, folder, invariance};
use wade_learn::random::Random;
use wade_learn::trials::Trials;

/// A tool that is scored: trials in, an answer or the reason for none out.
pub type Tool<'a> = dyn Fn(&Trials) -> Result<Answer, ToolError> + 'a;

/// Why a tool gave no answer.
#[derive(Debug, thiserror::Error)]
pub enum ToolError {
    /// The trials could not be written or the report not be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The report is not what it should be.
    #[error("report.json: {0}")]
    Report(#[from] serde_json::Error),
    /// The tool refused the trials.
    #[error(transparent)]
    Refused(Box<dyn std::error::Error + Send + Sync>),
    /// The command ended with a failure.
    #[error("the command ended with {status}: {stderr}")]
    Failed {
        /// How it ended.
        status: std::process::ExitStatus,
        /// The last line of what it said.
        stderr: String,
    },
}

/// Where a benchmark stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress<'a> {
    /// The case that is next.
    pub case: &'a str,
    /// Cases done and all.
    pub done: [usize; 2],
}

/// What a tool made of the cases.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Outcome {
    /// Case by case.
    pub judged: Vec<Judged>,
    /// Answers that stayed the same for shuffled trials, and those that were asked for.
    pub same_when_shuffled: [usize; 2],
    /// The same for data mirrored left to right.
    pub same_when_mirrored: [usize; 2],
}

/// What holds for all cases.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The trials.
    pub schedule: &'a Schedule,
    /// What predicts them.
    pub simulator: Simulator<'a>,
    /// Every how many cases the tools are asked again with trials shuffled and mirrored; 0 for never.
    pub invariance: usize,
}

/// Runs every tool on every case; every `invariance`-th one that is not for timing is asked again with its trials shuffled
/// and mirrored, none where that is 0.
pub fn run(
    cases: &[Case],
    setup: Setup<'_>,
    tools: &[(&str, &Tool)],
    progress: &mut dyn FnMut(Progress),
) -> Vec<Outcome> {
    let Setup { schedule, simulator, invariance } = setup;
    let fine = schedule.of_thousand_samples();
    let mut outcomes = vec![Outcome::default(); tools.len()];
    for (index, case) in cases.iter().enumerate() {
        progress(Progress { case: &case.name, done: [index, cases.len()] });
        let schedule = if case.family == Family::Timing { &fine } else { schedule };
        let generated = generate(case, schedule, simulator);
        for ((_, tool), outcome) in tools.iter().zip(&mut outcomes) {
            let start = Instant::now();
            let answer = tool(&generated.trials);
            let seconds = start.elapsed().as_secs_f64();
            let again = invariance > 0 && index % invariance == 0 && case.family != Family::Timing;
            if let Some(answer) = answer.as_ref().ok().filter(|_| again) {
                let mut random = Random::new(case.seed);
                let shuffled = invariance::shuffled(&generated.trials, &mut random);
                count(&mut outcome.same_when_shuffled, answer, tool(&shuffled));
                count(
                    &mut outcome.same_when_mirrored,
                    answer,
                    tool(&invariance::mirrored(&generated.trials)),
                );
            }
            let answer = answer.map_err(|error| error.to_string());
            outcome.judged.push(Judged::new(case, &generated, answer, seconds));
        }
    }
    progress(Progress { case: "", done: [cases.len(), cases.len()] });
    outcomes
}

fn count(same: &mut [usize; 2], answer: &Answer, again: Result<Answer, ToolError>) {
    let is_same = again.is_ok_and(|again| again.verdict == answer.verdict && again.names() == answer.names());
    same[0] += usize::from(is_same);
    same[1] += 1;
}

/// A tool that is a shell command: `{trials}` and `{out}` in it stand for the folder of the trials and the one in which
/// it leaves `report.json`.
pub fn command_tool(command: &str) -> impl Fn(&Trials) -> Result<Answer, ToolError> {
    let command = command.to_owned();
    move |trials| {
        let place = tempfile::tempdir()?;
        let (input, out) = (place.path().join("trials"), place.path().join("out"));
        folder::write(&input, trials)?;
        let quoted = |path: &Path| format!("'{}'", path.display());
        let line = command.replace("{trials}", &quoted(&input)).replace("{out}", &quoted(&out));
        let output = Command::new("sh").arg("-c").arg(line).output()?;
        if !output.status.success() {
            let stderr = String::from_utf8_lossy(&output.stderr);
            let stderr = stderr.lines().last().unwrap_or_default().to_owned();
            return Err(ToolError::Failed { status: output.status, stderr });
        }
        let report = std::fs::read(out.join("report.json"))?;
        Ok(Answer::from_report(&serde_json::from_slice(&report)?)?)
    }
}
