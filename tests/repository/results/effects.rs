//! The effects as they describe themselves.

use wade_core::effects::{Effect, EffectSpec, Kind, Quantity};

use super::markdown;

/// Names with their units, which stand once behind the names that share one.
fn with_units(names: impl Iterator<Item = (&'static str, &'static str)>) -> Vec<String> {
    let names: Vec<_> = names.collect();
    let shared = names.chunk_by(|(_, one), (_, other)| one == other);
    let group = |names: &[(&str, &str)]| {
        let unit = if names[0].1 == "1" { String::new() } else { format!(" [{}]", names[0].1) };
        names.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ") + &unit
    };
    shared.map(group).collect()
}

fn parameters(spec: &EffectSpec) -> String {
    let linear = with_units(spec.coefficients.iter().map(|c| (c.name, c.unit)));
    let nonlinear = with_units(spec.parameters.iter().map(|p| (p.name, p.unit)));
    let reference = (!spec.reference.is_empty()).then(|| spec.reference.to_owned());
    linear.into_iter().chain(nonlinear).chain(reference).collect::<Vec<_>>().join(", ")
}

fn table(header: &[&str; 3], holds: fn(Kind) -> bool) -> String {
    let specs = Effect::ALL.into_iter().map(Effect::spec).filter(|spec| holds(spec.kind));
    let row = |spec: &EffectSpec| vec![format!("`{}`", spec.name), spec.summary.to_owned(), parameters(spec)];
    markdown(header, specs.map(row).collect())
}

pub fn physics() -> String {
    let header = ["physics: served once named", "what the model lacks", "parameters"];
    table(&header, |kind| kind == Kind::Physics)
}

/// What each effect of the water corrects from the physical base on.
pub fn totals() -> String {
    let row = |spec: &EffectSpec| {
        [format!("`{}`", spec.name), spec.corrects.to_owned(), spec.total.to_owned()].to_vec()
    };
    let specs = Effect::ALL.into_iter().map(Effect::spec).filter(|spec| spec.kind == Kind::Physics);
    markdown(
        &["effect", "term of the base that it corrects", "base and effect together"],
        specs.map(row).collect(),
    )
}

pub fn faults() -> String {
    let header = ["sensor and drive faults: named, never added to a bundle", "what is wrong", "parameters"];
    table(&header, |kind| kind != Kind::Physics)
}

pub fn experiments() -> String {
    let inputs = |spec: &EffectSpec| {
        spec.inputs.iter().map(|input: &Quantity| input.name()).collect::<Vec<_>>().join(", ")
    };
    let row = |spec: &EffectSpec| vec![format!("`{}`", spec.name), inputs(spec), spec.experiment.to_owned()];
    let specs = Effect::ALL.into_iter().map(Effect::spec);
    markdown(&["effect", "inputs", "trial that separates it"], specs.map(row).collect())
}
