//! What was found, in sentences.

use super::compose::Disproof;
use super::detect::GapSize;
use super::explanations::{Explanation, NOTHING, OUTSIDE_LIBRARY};
use super::gated::Gated;
use super::judge::Judge;
use super::locate;
use super::noise::Floor;
use super::page::{probability, refusal};
use super::report::{NamedEffect, Report, Verdict};
use super::verdict::{Found, STRUCTURE, Unfit};

/// What has no name, where it matters: how much of it is structure, and what came nearest.
pub(super) fn unexplained(judge: &Judge, found: &Found, disproof: Option<Disproof>) -> Option<String> {
    let left = &found.left;
    let whole = judge.missing();
    let share = left.gain / whole;
    let matters = match found.verdict {
        Verdict::NothingMissing => false,
        Verdict::NoCandidateFits => true,
        _ => left.deviate > STRUCTURE && share > 0.05,
    };
    if !matters {
        return None;
    }
    let functions: Vec<String> =
        left.strongest.iter().map(|(name, share)| format!("{name} ({:.0} %)", 100.0 * share)).collect();
    let beyond = if found.verdict == Verdict::NoCandidateFits { "" } else { " beyond the named effects" };
    let mut text = match (100.0 * share).clamp(0.0, 100.0).round() {
        0.0 => "no smooth function of the state predicts the gap".to_owned(),
        share => format!(
            "{share:.0} % of the gap above the noise floor can be predicted from the state{beyond}; the strongest functions are {}",
            functions.join(", ")
        ),
    };
    if let Some(unfit) = found.unfit.filter(|_| found.verdict == Verdict::NoCandidateFits) {
        let names = judge.names(&found.members).join(" and ").replace('_', " ");
        text += &match unfit {
            Unfit::Explains(share, asked) => format!(
                "; the closest candidate is {names}, which explains {:.0} % of it; {:.0} % are required",
                100.0 * share.max(0.0),
                100.0 * asked
            ),
            Unfit::Unresolved => {
                format!(
                    "; the closest candidate is {names}, which would decay faster than these samples resolve"
                )
            }
            Unfit::Imitates => {
                format!("; the closest candidate is {names}, but one effect in a region explains more")
            }
            Unfit::Unlikely(p) => format!(
                "; the closest candidate is {names}, but that none of the library explains the gap is more probable ({})",
                probability(p)
            ),
            Unfit::Outweighed(p) => format!(
                "; the closest candidate is {names}, but effects that the held-out trials disprove are more probable ({})",
                probability(p)
            ),
            Unfit::Doubtful(p) => format!(
                "; the closest candidate is {names}, but that nothing is missing has a probability of {}",
                probability(p)
            ),
            Unfit::Leaves => format!("; the closest candidate is {names}, but serial correlation remains"),
        };
    }
    if let Some(gated) = found.gated.first().filter(|_| found.verdict == Verdict::NoCandidateFits) {
        text += &format!(
            "; where {}, it resembles {}, which explains {:.0} % of it there",
            locate::in_words(&gated.limits),
            gated.effect.name().replace('_', " "),
            100.0 * gated.share.min(1.0)
        );
    }
    if let Some(disproof) = disproof {
        let names = judge.names(&found.members).join(" and ").replace('_', " ");
        let of = |share: f64, place: &str| match share > 0.0 {
            true => format!(
                "; {names} would explain {:.0} % of the squared gap of the held-out trials{place}",
                100.0 * share
            ),
            false => format!("; {names} would increase the gap of the held-out trials{place}"),
        };
        text += &match disproof {
            Disproof::Everywhere(share) => of(share, ""),
            Disproof::WhereItActs(share) => of(share, ", where it acts"),
            Disproof::Undetermined => {
                format!("; the closest is {names}, whose coefficients these trials do not determine")
            }
        };
    }
    Some(text)
}

/// Says so where the gap is clearly larger than the noise: only the model's own error keeps it from counting, or nothing that
/// that the trials measure correlates with it.
fn hidden(report: &Report) -> Option<String> {
    const CLEARLY: f64 = 2.0;
    const BEYOND: f64 = 1.5;
    let sizes = report.gap.floors.iter().filter_map(|(name, floor)| {
        let size = report.gap.size.get(name)?;
        Some((*name, *floor, size))
    });
    let most = |over: &dyn Fn(&Floor) -> f64, of: &dyn Fn(&(&str, Floor, &GapSize)) -> bool| {
        let times =
            |(_, floor, size): &(&str, Floor, &GapSize)| size.rms / over(floor).max(f64::MIN_POSITIVE);
        sizes.clone().filter(|entry| of(entry)).max_by(|a, b| times(a).total_cmp(&times(b)))
    };
    let is_beyond = |(_, floor, size): &(&str, Floor, &GapSize)| {
        size.above_floor && size.rms > BEYOND * floor.with_model()
    };
    if let Some((name, floor, size)) = most(&Floor::with_model, &is_beyond) {
        return Some(format!(
            ". The gap of {name} is {:.3}, more than the {:.3} expected from noise and model error, but it does not correlate with any measured quantity.",
            size.rms,
            floor.with_model(),
        ));
    }
    let is_hidden = |(_, floor, size): &(&str, Floor, &GapSize)| {
        floor.model > floor.total() && size.rms > CLEARLY * floor.total()
    };
    most(&Floor::total, &is_hidden).map(|(name, floor, size)| {
        format!(
            " and the predicted standard deviation. For {name} the gap is {:.3}; noise of {:.3} and a model error of {:.3} as predicted can cause up to {:.3}.",
            size.rms,
            floor.total(),
            floor.model,
            size.expected_at_most,
        )
    })
}

/// How near the next explanation was to the one that the verdict states, or what is suspected and why it is not named.
fn nearest(report: &Report) -> String {
    if !report.suspected.is_empty() {
        let (names, p) =
            (report.suspected.join(" and ").replace('_', " "), report.explanations[0].probability);
        let why = report.suspected.iter().find_map(|name| {
            report.rejected.iter().find(|rejected| rejected.name == *name).and_then(|rejected| rejected.why)
        });
        let why = why.map_or_else(String::new, |why| format!(": {}", refusal(why)));
        return format!(
            " {names} is suspected, with a probability of {}, but not named{why}.",
            probability(p)
        );
    }
    let mut stated: Vec<&str> = report.effects.iter().map(|effect| effect.name).collect();
    stated.sort_unstable();
    let is_stated = |explanation: &&Explanation| {
        let mut names = explanation.effects.clone();
        names.sort_unstable();
        match report.verdict {
            Verdict::NothingMissing => names == [NOTHING],
            Verdict::NoCandidateFits => names == [OUTSIDE_LIBRARY],
            _ => names == stated,
        }
    };
    match report.explanations.iter().find(|explanation| !is_stated(explanation)) {
        Some(next) => format!(
            " The nearest other explanation, {}, has a probability of {}.",
            next.in_words(),
            probability(next.probability)
        ),
        None => String::new(),
    }
}

/// The verdict.
pub(super) fn summary(report: &Report, gated: Option<&Gated>) -> String {
    let mut text = verdict(report, gated);
    text.push_str(&nearest(report));
    text
}

fn verdict(report: &Report, gated: Option<&Gated>) -> String {
    let names = |effects: &[NamedEffect]| {
        let of = |effect: &NamedEffect| {
            let name = effect.name.replace('_', " ");
            match effect.region.is_everywhere() {
                true => name,
                false => format!("{name} where {}", locate::region_in_words(&effect.region)),
            }
        };
        effects.iter().map(of).collect::<Vec<_>>().join(" and ")
    };
    let held = report.gap.held_out.get("all");
    let closed = held.and_then(|all| Some((all.closure?, all.interval))).map_or_else(String::new, |(c, interval)| {
        match interval.filter(|[low, _]| *low <= 0.0 && c > 0.0) {
            Some([low, high]) => format!(
                " The held-out trials are too few, or their gap is too small, to show how much of it that explains ({:.0} to {:.0} %).",
                100.0 * low,
                100.0 * high
            ),
            None => format!(" On held-out trials it explains {:.0} % of the RMS gap above the noise floor.", 100.0 * c),
        }
    });
    match report.verdict {
        Verdict::NothingMissing => {
            let within =
                "These trials do not show that anything is missing: the gap has no structure beyond noise";
            hidden(report).map_or_else(|| format!("{within}."), |why| format!("{within}{why}"))
        }
        Verdict::Named => {
            let is_whole = report.effects.iter().all(|effect| effect.region.is_everywhere());
            let there = gated.filter(|_| is_whole).map_or_else(String::new, |gated| {
                format!(" It explains more if it acts only where {}.", locate::in_words(&gated.limits))
            });
            let worse = report.gap.worse_regions.first();
            let worse = worse
                .map_or_else(String::new, |worse| format!(" But in part of the held-out trials {worse}."));
            format!("The model lacks {}.{closed}{worse}{there}", names(&report.effects))
        }
        Verdict::Ambiguous => format!(
            "The model lacks {}, or {}: these trials cannot separate them.{closed}",
            names(&report.effects),
            report
                .alternatives
                .iter()
                .map(|set| set.join(" and ").replace('_', " "))
                .collect::<Vec<_>>()
                .join(", or "),
        ),
        Verdict::NoCandidateFits => {
            let is_outside = |e: &Explanation| e.effects == [OUTSIDE_LIBRARY] && e.probability > 0.5;
            match report.explanations.iter().any(is_outside) {
                true => "The gap has structure that no effect of the library explains; nothing is applied.",
                false => "The gap is more than noise, and no explanation of it passes every check; nothing is applied.",
            }
            .into()
        }
    }
}
