//! The physical effects of a report as `effects.toml`.

use std::collections::BTreeMap;

use super::holdout::Worse;
use super::report::{NamedEffect, Report, Verdict};
use wade_core::effects::{
    ActiveEffect, Between, Effect, EffectsFile, Evidence, Kind, ParameterValue, Validity,
};
use wade_learn::trials::{Manifest, Trials};

/// Why nothing of a report may be added to a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotApplicable {
    /// There is no gap.
    #[error("nothing is missing")]
    NothingMissing,
    /// A gap without a name.
    #[error("no effect of the library explains the gap")]
    NoCandidateFits,
    /// More than one name.
    #[error(
        "other effects explain the gap as well; record the trial that separates them, and run again with it"
    )]
    Ambiguous,
    /// Sensors and drive alone.
    #[error("no named effect is one of the water")]
    NotPhysics,
    /// A part of the trials kept back that it makes worse.
    #[error("on held-out trials {0}: the named effects do not hold there")]
    Worse(Worse),
    /// Seen in one condition only.
    #[error("{effects} was observed in one condition only: record another, or accept it with --provisional")]
    Provisional {
        /// Names of the effects.
        effects: String,
    },
}

/// The physical effects of a report: coefficients, units, standard errors, covariance, the ranges in which they were seen,
/// and the hashes of what they rest on. Faults of sensors and drive are never in it. What was seen in one condition only is
/// in it where that is asked for. A value that its errors alone carried beyond what is physically possible is the nearest one
/// that is possible, as the report's remarks say. The hash of the weights is left to whoever puts it into a bundle.
pub fn effects_file(
    report: &Report,
    trials: &Trials,
    with_provisional: bool,
) -> Result<EffectsFile, NotApplicable> {
    match report.verdict {
        Verdict::Named => {}
        Verdict::NothingMissing => return Err(NotApplicable::NothingMissing),
        Verdict::NoCandidateFits => return Err(NotApplicable::NoCandidateFits),
        Verdict::Ambiguous => return Err(NotApplicable::Ambiguous),
    }
    let physical: Vec<&NamedEffect> = report.effects.iter().filter(|e| e.kind == Kind::Physics).collect();
    if physical.is_empty() {
        return Err(NotApplicable::NotPhysics);
    }
    if let Some(worse) = report.gap.worse_regions.first() {
        return Err(NotApplicable::Worse(worse.clone()));
    }
    let provisional: Vec<&str> = physical.iter().filter(|e| e.provisional).map(|e| e.name).collect();
    if !provisional.is_empty() && !with_provisional {
        return Err(NotApplicable::Provisional { effects: provisional.join(" and ") });
    }
    let effects = physical.iter().map(|effect| active(effect, trials)).collect();
    let file = EffectsFile::new(report.vehicle.clone(), evidence(report, trials), validity(report), effects);
    Ok(file.with_between(between(&physical)))
}

/// Covariances between each two of the effects.
fn between(physical: &[&NamedEffect]) -> Vec<Between> {
    let pairs = physical.iter().enumerate().flat_map(|(i, a)| physical[i + 1..].iter().map(move |b| (a, b)));
    let of = |(a, b): (&&NamedEffect, &&NamedEffect)| {
        let covariance = a.covariance_with.get(b.name)?.clone();
        Some(Between { effects: [a.effect, b.effect], covariance })
    };
    pairs.filter_map(of).collect()
}

fn evidence(report: &Report, trials: &Trials) -> Evidence {
    let mut names: Vec<String> = trials.trials.iter().map(|trial| trial.name.clone()).collect();
    names.sort();
    Evidence {
        trials: names,
        trials_sha256: report.sources.trials.clone(),
        generated: report.generated.clone(),
        samples: report.samples,
        model_sha256: report.sources.model.clone(),
        weights_sha256: String::new(),
        base: None,
        tool: report.sources.tool.clone(),
        closure: report.gap.held_out.get("all").and_then(|all| all.closure),
    }
}

fn validity(report: &Report) -> Validity {
    let range = |name: &str| report.validity.get(name).copied().unwrap_or_default();
    Validity {
        depth_m: range("depth_m"),
        speed_mps: range("speed_mps"),
        acceleration_mps2: range("acceleration_mps2"),
        angular_speed_radps: range("angular_speed_radps"),
        density_kgpm3: range("density_kgpm3"),
    }
}

/// The value within the bounds of a coefficient: a gate lets it lie two standard errors beyond them.
fn possible(effect: Effect, name: &str, value: f64) -> f64 {
    let bounds = effect.coefficients().iter().find(|spec| spec.name == name).map(|spec| spec.bounds);
    bounds.map_or(value, |[low, high]| value.clamp(low, high))
}

/// What is written of named effects otherwise than it was fitted.
pub(super) fn remarks(effects: &[NamedEffect]) -> Vec<String> {
    let physical = effects.iter().filter(|effect| effect.kind == Kind::Physics);
    let all =
        physical.flat_map(|effect| effect.parameters.iter().map(move |(name, p)| (effect, name, p.value)));
    let beyond = all.filter_map(|(effect, name, value)| {
        let written = possible(effect.effect, name, value);
        let of = effect.name.replace('_', " ");
        (written != value).then(|| format!("{name} of {of} is {value:.3} within its error of {written}, what is possible: {written} is applied"))
    });
    beyond.collect()
}

/// The narrowest of the channels whose widths are stated by trial [m].
fn narrowest(manifest: &Manifest) -> Option<f64> {
    manifest.channel_widths.values().copied().filter(|width| width.is_finite()).reduce(f64::min)
}

fn active(effect: &NamedEffect, trials: &Trials) -> ActiveEffect {
    let parameters = effect.parameters.iter().map(|(name, parameter)| {
        let (value, unit) = (possible(effect.effect, name, parameter.value), parameter.unit.to_owned());
        ((*name).to_owned(), ParameterValue { value, std: parameter.std, unit })
    });
    // the report states those alone that have a place in the law
    let nothing = |unit: &str| ParameterValue { value: 0.0, std: 0.0, unit: unit.to_owned() };
    let nonlinear = effect.effect.spec().parameters.iter();
    let nonlinear = nonlinear.map(|spec| (spec.name.to_owned(), nothing(spec.unit)));
    ActiveEffect {
        equation: effect.effect.equation().to_owned(),
        provisional: effect.provisional,
        share_of_gap: effect.share_of_gap,
        shape: effect.shape,
        region: effect.region.clone(),
        base_drag: effect.base_drag,
        channel_width: (trials.manifest.channel_width.filter(|width| width.is_finite()))
            .or_else(|| narrowest(&trials.manifest)),
        coefficients: effect.coefficients.iter().map(|name| (*name).to_owned()).collect(),
        covariance: effect.covariance.clone(),
        parameters: nonlinear.chain(parameters).collect::<BTreeMap<_, _>>(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beyond_the_bounds_by_its_error_is_written_at_them() {
        let of = |value: f64| possible(Effect::AddedMass, "surge", value);
        assert_eq!((of(-0.01), of(0.7), of(6.5)), (0.0, 0.7, 6.0));
        assert_eq!(possible(Effect::HullFlooding, "opening_ratio", 0.01), 0.01, "a shape has no bounds");
    }
}
