//! The trials that would tell explanations apart.

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
