//! Answers against the keys, and the table of them.

use std::time::Instant;

use serde::Serialize;

use super::case::{Case, Group};
use super::cause::Cause;
use super::generate::generate;
use super::key::{Grade, Key, names};
use crate::answer::{Answer, Verdict};
use crate::run::{Progress, Tool};
use crate::score::{Compared, Reach, Row, bootstrap, compare, median, relative_error, share};

/// Strengths from each of these on make a row, up to the next.
const STRENGTHS: [f64; 5] = [0.0, 0.1, 0.3, 1.0, f64::INFINITY];

/// One case as it was answered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Graded {
    /// What is true.
    pub key: Key,
    /// The grade; `None` without an answer.
    pub grade: Option<Grade>,
    /// Why, or why there is no answer.
    pub reason: String,
    /// The verdict.
    pub verdict: Option<Verdict>,
    /// What was named.
    pub named: Vec<String>,
    /// What was held possible.
    pub possible: Vec<String>,
    /// Planted parameters that were estimated, where the answer is right.
    pub parameters: Vec<Compared>,
    /// Held-out closure as the tool states it.
    pub closure: Option<f64>,
    /// Time taken [s].
    pub seconds: f64,
}

impl Graded {
    /// Grades an answer.
    pub fn new(key: Key, answer: Result<Answer, String>, seconds: f64) -> Self {
        let mut graded = Self {
            key,
            grade: None,
            reason: String::new(),
            verdict: None,
            named: Vec::new(),
            possible: Vec::new(),
            parameters: Vec::new(),
            closure: None,
            seconds,
        };
        match answer {
            Ok(answer) => graded.grade(&answer),
            Err(error) => graded.reason = error,
        }
        graded
    }

    fn grade(&mut self, answer: &Answer) {
        let owned = |names: std::collections::BTreeSet<&str>| names.into_iter().map(str::to_owned).collect();
        let (grade, reason) = self.key.allowed.grade(answer);
        (self.grade, self.reason, self.verdict) = (Some(grade), reason.to_owned(), Some(answer.verdict));
        (self.named, self.possible) = (owned(answer.names()), owned(answer.possible()));
        self.closure = answer.closure();
        if grade != Grade::Right || answer.verdict != Verdict::Named {
            return;
        }
        for (planted, parameters) in self.key.hidden.iter().zip(&self.key.parameters) {
            let names = names(planted.cause, self.key.plan);
            let stated = answer.effects.iter().find(|effect| names.contains(&effect.name.as_str()));
            self.parameters
                .extend(stated.into_iter().flat_map(|effect| compare(&effect.name, parameters, effect)));
        }
    }
}

/// Runs every tool on every case.
pub fn run(cases: &[Case], tools: &[(&str, &Tool)], progress: &mut dyn FnMut(Progress)) -> Vec<Vec<Graded>> {
    let mut outcomes = vec![Vec::new(); tools.len()];
    for (index, case) in cases.iter().enumerate() {
        progress(Progress { case: &case.name, done: [index, cases.len()] });
        let generated = generate(case);
        for ((_, tool), outcome) in tools.iter().zip(&mut outcomes) {
            let start = Instant::now();
            let answer = tool(&generated.trials).map_err(|error| error.to_string());
            outcome.push(Graded::new(generated.key.clone(), answer, start.elapsed().as_secs_f64()));
        }
    }
    progress(Progress { case: "", done: [cases.len(), cases.len()] });
    outcomes
}

/// All measures over some answers: effects by noise and by strength, faults, nulls and the rest by sort.
pub fn rows(graded: &[Graded]) -> Vec<Row> {
    let has_cause = |case: &&Graded| !case.key.hidden.is_empty();
    let nulls = || graded.iter().filter(|case| case.key.hidden.is_empty());
    let of = |group: Group| graded.iter().filter(move |case| case.key.group == group).filter(has_cause);
    let mut rows = vec![
        share("cases without an answer", Reach::AtMost(0.0), graded.iter().map(|case| case.grade.is_none())),
        share(
            "nulls in which any effect is named",
            Reach::AtMost(0.01),
            nulls().map(|case| !case.named.is_empty()),
        ),
        share("nulls: nothing missing", Reach::Open, nulls().map(|case| case.grade == Some(Grade::Right))),
        share(
            "wrong name stated with confidence",
            Reach::AtMost(0.03),
            graded
                .iter()
                .map(|case| case.grade == Some(Grade::Wrong) && case.verdict == Some(Verdict::Named)),
        ),
    ];
    for noise in [0.1, 0.5, 2.0] {
        let cases: Vec<_> = of(Group::Effect).filter(|case| case.key.marker_noise == noise).collect();
        rows.extend(grades(&format!("effects, {noise} mm"), &cases));
    }
    for range in STRENGTHS.windows(2) {
        let is_within = |case: &&Graded| (range[0]..range[1]).contains(&case.key.strength);
        let cases: Vec<_> = of(Group::Effect).filter(is_within).collect();
        let range = match range {
            [least, f64::INFINITY] => format!("from {least}"),
            [least, below] => format!("{least} to {below}"),
            _ => String::new(),
        };
        rows.extend(grades(&format!("effects, {range} x the floor"), &cases));
    }
    for cause in Cause::ALL.into_iter().filter(|cause| !cause.is_fault()) {
        let is_it = |case: &&Graded| case.key.hidden[0].cause == cause;
        let cases: Vec<_> = of(Group::Effect).filter(is_it).collect();
        rows.extend(grades(cause.name(), &cases));
    }
    for group in [Group::Fault, Group::Identity, Group::DryTwins, Group::Wheels] {
        rows.extend(grades(&group.name().replace('_', " "), &of(group).collect::<Vec<_>>()));
    }
    let parameters = || graded.iter().flat_map(|case| &case.parameters);
    let errors: Vec<f64> = parameters().filter(|p| p.is_largest).map(relative_error).collect();
    rows.push(bootstrap("parameter error, median", Reach::Open, &errors, median));
    let covered = parameters().filter_map(Compared::is_covered);
    rows.push(share("stated 90 % interval covers", Reach::Within([0.85, 0.95]), covered));
    let times: Vec<f64> = graded.iter().map(|case| case.seconds).collect();
    rows.push(bootstrap("time of a case, median [s]", Reach::Open, &times, median));
    rows
}

/// Shares of right, abstaining and wrong answers.
fn grades(what: &str, cases: &[&Graded]) -> Vec<Row> {
    [("right", Grade::Right), ("abstained", Grade::Abstained), ("wrong", Grade::Wrong)]
        .map(|(word, grade)| {
            let holds = cases.iter().map(|case| case.grade == Some(grade));
            share(&format!("{what}: {word}"), Reach::Open, holds)
        })
        .into()
}
