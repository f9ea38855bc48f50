//! The trials that would tell explanations apart.

use super::explanations::{Explanation, OUTSIDE_LIBRARY};
use super::locate::Region;
use super::report::Verdict;
use wade_core::effects::Effect;

/// Trials in words that tell sets of effects apart.
pub(super) fn separating(sets: &[Vec<Effect>]) -> String {
    let shared = |effect: &Effect| sets.iter().all(|set| set.contains(effect));
    let own: Vec<Vec<Effect>> =
        sets.iter().map(|set| set.iter().filter(|effect| !shared(effect)).copied().collect()).collect();
    let names = own
        .iter()
        .filter(|set| !set.is_empty())
        .map(|set| set.iter().map(|effect| effect.name()).collect::<Vec<_>>().join(" and "));
    let mut parts: Vec<String> = Vec::new();
    for effect in own.iter().flatten() {
        let part = format!("{} ({} alone shows there)", effect.spec().experiment, effect.name());
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    let names = names.collect::<Vec<_>>().join(" or ");
    match parts.len() {
        0..=2 => format!("{names}: {}", parts.join("; or ")),
        _ => format!("{names}: all but one of these trials separate them: {}", parts.join("; ")),
    }
}

/// What to do next where nothing is named: the trials that show or rule out the effects that are the most probable explanation, or
/// more trials where the gap is, where a load outside the library is.
pub(super) fn next_step(
    verdict: Verdict,
    explanations: &[Explanation],
    regions: &[Region],
) -> Option<String> {
    if !matches!(verdict, Verdict::NothingMissing | Verdict::NoCandidateFits) {
        return None;
    }
    let first = explanations.first()?;
    if first.is_of_library() {
        let experiment = |name: &&str| {
            Effect::from_name(name).map(|effect| format!("{} ({name})", effect.spec().experiment))
        };
        let experiments: Vec<String> = first.effects.iter().filter_map(experiment).collect();
        return Some(format!("to show or rule out {}, {}", first.in_words(), experiments.join("; and ")));
    }
    if first.effects != [OUTSIDE_LIBRARY] {
        return None;
    }
    let place = regions.first().map(|region| region.place.as_str())?;
    Some(format!(
        "repeat the trials in which {place}, each at two speeds and two depths, and look at what is there that the model does not know"
    ))
}
