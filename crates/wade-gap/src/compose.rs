//! The report of what was found.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};

use super::candidates::Setting;
use super::carriers::{carriers, of_region};
use super::design::Design;
use super::detect::{self, Excitation};
use super::effects_file::remarks;
use super::experiment::{next_step, separating};
use super::explanations::{Weighed, stated, suspected};
use super::fit::{Fit, Parameter, fit};
use super::holdout::{
    Closure, Explained, closures, explained_of_rows, explained_of_trials, explained_where_acting, worse,
};
use super::judge::{Judge, Member, Refusal};
use super::locate::{self, OPEN};
use super::noise::{Floor, floors_of};
use super::report::{GapReport, NamedEffect, NotTestable, Rejected, Report, Sources, Verdict};
use super::sentences::{summary, unexplained};
use super::series::Series;
use super::statistics::{Z90, quantile};
use super::traces::drawn;
use super::verdict::Found;
use super::{Named, contradictions, measurement, plausible};
use wade_core::condition::Condition;
use wade_core::digest::hexadecimal;
use wade_core::effects::{self, Effect};
use wade_learn::trials::{SIMULATED, SimIs, Trials, WHEELS, WRENCH};

fn named(design: &Design, members: &[Member], fit: &Fit) -> Vec<Named> {
    let mut values = fit.values.iter();
    members
        .iter()
        .map(|member| {
            let candidate = &design.candidates[member.candidate];
            let coefficients = member
                .columns
                .iter()
                .map(|&(_, coefficient)| (coefficient, values.next().copied().unwrap_or(0.0)))
                .collect();
            let (effect, shape, region) = (candidate.effect, candidate.shape, candidate.region.clone());
            Named { effect, shape, region, coefficients }
        })
        .collect()
}

/// Share of the squared gap that is explained by what is half as large as the gap: what is named must be no less where it acts. Else
/// something else is most of the gap, such as the model's own error, and what is small beside that may be a part of it.
const HALF_AS_LARGE: f64 = 0.25;

/// What a set of effects does for the held-out trials.
struct HeldOut {
    fitted: Option<Fit>,
    named: Vec<Named>,
    closures: BTreeMap<&'static str, Closure>,
    /// What says that it is not what is missing.
    disproof: Option<Disproof>,
    /// True where they add enough to those trials to be judged by them.
    acts: bool,
}

/// Share of the squared gap that a set of effects explains where that is too little, or less than nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Disproof {
    /// Of all of the held-out trials.
    Everywhere(f64),
    /// Of what they hold where the set acts.
    WhereItActs(f64),
    /// No share is known: the trials do not determine the coefficients of the set.
    Undetermined,
}

impl HeldOut {
    fn of(judge: &Judge, members: &[Member], held: &[usize]) -> Self {
        let (design, all, setting, config) = (judge.design, judge.all, judge.setting, judge.config);
        let fitted = if members.is_empty() { None } else { fit(design, members, all, setting, config) };
        let named = fitted.as_ref().map_or_else(Vec::new, |fitted| named(design, members, fitted));
        let floors = floors_of(all, held, judge.floors, &setting.components);
        let added = explained_of_trials(&named, all, held, setting);
        let closures = closures(&added, all, held, setting, &floors, config);
        let small = closures.get("all").and_then(|closure| {
            let explained = explained_of_rows(&added, all, held, judge).unwrap_or(closure.explained());
            closure.disproof(explained, config.coverage, judge.has_fault(members))
        });
        let share = explained_where_acting(&added, all, held, (setting, judge.floors), config);
        let slight = share.filter(|share| *share < HALF_AS_LARGE).map(Disproof::WhereItActs);
        let disproof = small.or_else(|| disproved(&closures, judge.floors));
        let undetermined = fitted.is_none() && !members.is_empty();
        let undetermined = undetermined.then_some(Disproof::Undetermined);
        let disproof = undetermined.or(disproof.map(Disproof::Everywhere)).or(slight);
        Self { fitted, named, closures, disproof, acts: share.is_some() }
    }
}

/// True for effects with which the gap of the held-out trials grows, or which leave too much of it.
pub(super) fn is_disproved(judge: &Judge, members: &[Member], held: &[usize]) -> bool {
    HeldOut::of(judge, members, held).disproof.is_some()
}

/// True for effects that the held-out trials show: they act in them, and are not disproved. What was seen in a region is asked for
/// this, since naming chose its borders.
pub(super) fn is_shown(judge: &Judge, members: &[Member], held: &[usize]) -> bool {
    let of = HeldOut::of(judge, members, held);
    of.acts && of.disproof.is_none()
}

pub(super) fn compose(
    trials: &Trials,
    judge: &Judge,
    mut found: Found,
    weighed: &[Weighed],
    held: Vec<usize>,
    library: &[Effect],
) -> Report {
    let (design, all, setting, config) = (judge.design, judge.all, judge.setting, judge.config);
    // nothing that does not fit is applied or shown as if it did
    let fits = matches!(found.verdict, Verdict::Named | Verdict::Ambiguous);
    let members = if fits { found.members.as_slice() } else { &[] };
    let HeldOut { fitted, mut named, closures: mut held_out, disproof, .. } =
        HeldOut::of(judge, members, &held);
    let is_fault = judge.has_fault(&found.members);
    // of several explanations one may hold, and the trials that tell them apart are asked for, unless the gap grows or is another's; a
    // fault is exact or is none
    let is_for_all = |disproof: &Disproof| match disproof {
        Disproof::Everywhere(share) => found.verdict == Verdict::Named || is_fault || *share < 0.0,
        Disproof::WhereItActs(_) | Disproof::Undetermined => true,
    };
    let disproof = disproof.filter(|disproof| fits && is_for_all(disproof));
    if disproof.is_some() {
        found.name_nothing(found.unfit);
        HeldOut { named, closures: held_out, .. } = HeldOut::of(judge, &[], &held);
    }
    let size = detect::sizes(all.iter(), judge.floors, &design.error, setting, config);
    if found.verdict == Verdict::NothingMissing && size.values().any(|size| size.above_floor) {
        found.verdict = Verdict::NoCandidateFits;
    }
    let holds = fits && disproof.is_none();
    let effects = match &fitted {
        Some(fitted) if holds => named_effects(judge, &found, &named, fitted),
        _ => Vec::new(),
    };
    let gap_excess = |trial: usize| excess(all, design, setting, trial);
    let (mut regions, regions_tried) = match found.verdict {
        Verdict::NothingMissing => (Vec::new(), 0),
        _ => locate::locate(all, &design.trials, gap_excess, found.gated.first(), config),
    };
    for region in &mut regions {
        region.surfaces = of_region(region, &named, all, setting, judge.floors);
    }
    let excitation =
        detect::excitations(design, all, setting, &trials.manifest, &found.residual, &named, config);
    let not_testable = excitation.iter().filter_map(not_testable).collect();
    let alternatives: Vec<Vec<&'static str>> = match holds {
        true => found.alternatives.iter().map(|set| judge.names(set)).collect(),
        false => Vec::new(),
    };
    let separating_experiment = (holds && !found.alternatives.is_empty()).then(|| {
        let sets = std::iter::once(&found.members).chain(&found.alternatives);
        let effects = |set: &Vec<Member>| set.iter().map(|m| judge.effect(m)).collect::<Vec<_>>();
        separating(&sets.map(effects).collect::<Vec<_>>())
    });
    let mut said: Vec<String> = trials.remarks().iter().map(ToString::to_string).collect();
    if trials.manifest.measured.sim_is == SimIs::Control {
        said.push(
            "the sim_ columns are a control: the gap is what differs from it, not that of the vehicle's model".into(),
        );
    }
    said.extend(measurement::remarks(trials, setting.mass));
    said.extend(sampled(trials, all));
    said.extend(outside(all));
    if !setting.computed {
        said.extend(plausible::remarks(all, &setting.components));
        said.extend(contradictions::remarks(all, &trials.manifest, &setting.components));
    }
    said.extend(remarks(&effects));
    said.extend(unpublished(&effects));
    let explanations = stated(weighed);
    let unexplained = unexplained(judge, &found, disproof);
    let gap = GapReport {
        held_out,
        size,
        shares: shares(judge, &found),
        floors: setting.components.iter().map(|&c| (WRENCH[c], judge.floors[c])).collect(),
        worse_regions: worse(&named, all, &held, setting, judge.floors, &regions),
        held_out_trials: held.iter().map(|&trial| all[trial].name.clone()).collect(),
        unexplained,
    };
    let (traces, trends) = drawn(&named, all, &held, setting, judge.floors);
    let mut report = Report {
        verdict: found.verdict,
        summary: String::new(),
        vehicle: trials.manifest.vehicle.clone(),
        generated: trials.manifest.generated.clone(),
        rejected: rejected(judge, &found, library, holds),
        effects,
        alternatives,
        suspected: suspected(&explanations, holds),
        next_step: next_step(found.verdict, &explanations, &regions),
        explanations,
        separating_experiment,
        not_testable,
        regions,
        regions_tried,
        gap,
        excitation,
        validity: validity(all),
        trials: all.len(),
        samples: all.iter().map(|s| s.t.len()).sum(),
        bin_s: config.bin_s,
        remarks: said,
        sources: Sources { trials: hash(trials), ..Sources::default() },
        traces,
        trends,
    };
    report.summary = summary(&report, found.gated.first());
    report
}

/// Share of the squared gap that effects explain of the held-out trials, where it grows with them or leaves far more than noise and
/// the model's own error in a component that they act on.
fn disproved(held_out: &BTreeMap<&'static str, Closure>, floors: &[Floor; 6]) -> Option<f64> {
    /// Floors that may be left: a law that is there leaves some per cent, and a floor may be a fifth too low.
    const LEFT: f64 = 2.0;
    /// Share of the squared gap that a law may leave: formulas of one effect differ by as much.
    const OFF: f64 = 0.2;
    let all = held_out.get("all")?;
    let Explained { share, .. } = all.explained();
    let leaves = |(name, floor): (&&str, &Floor)| {
        held_out.get(name).is_some_and(|of| {
            let floor = of.noise_floor.hypot(floor.model);
            let [before, after] = [of.before, of.after].map(|size| size * size);
            (before - after).abs() > floor.powi(2) && of.after > LEFT * floor && after > OFF * before
        })
    };
    let grows = all.closure.is_some_and(|closure| closure < 0.0);
    (grows || WRENCH.iter().zip(floors).any(leaves)).then_some(share)
}

/// Values of which not even the interval reaches into the band of what is published.
fn unpublished(effects: &[NamedEffect]) -> Vec<String> {
    let all = effects.iter().flat_map(|effect| effect.parameters.iter().map(move |of| (effect, of)));
    let beyond = all.filter_map(|(effect, (name, p))| {
        let [low, high] = p.literature.filter(|[low, high]| p.interval[0] > *high || p.interval[1] < *low)?;
        let of = effect.name.replace('_', " ");
        Some(format!(
            "{name} of {of} is {:.3} ({:.3} to {:.3}), beyond what is published of it, {low} to {high}: another law may be at work",
            p.value, p.interval[0], p.interval[1]
        ))
    });
    beyond.collect()
}

/// How much of what was recorded the report rests on, where that is not every sample by itself.
fn sampled(trials: &Trials, all: &[Series]) -> Option<String> {
    let recorded: usize = all
        .iter()
        .filter_map(|series| trials.trials.iter().find(|trial| trial.name == series.name))
        .map(|trial| trial.len())
        .sum();
    let used: usize = all.iter().map(|series| series.t.len()).sum();
    let averaged = all.iter().map(|series| series.averaged).fold(1.0, f64::max);
    let held: f64 = all.iter().map(|series| series.averaged * series.t.len() as f64).sum();
    // windows at the ends of bins hold some samples more or less
    let is_cut = held < 0.9 * recorded as f64;
    match (averaged > 1.0, is_cut) {
        (false, false) => None,
        (true, false) => Some(format!(
            "samples were averaged, up to {averaged:.0} in one: {used} means stand for {recorded} samples, and noise is that of the means"
        )),
        (_, true) => Some(format!(
            "the trials are long: {used} samples or means of the start, the quickest changes and even distances of each trial stand for {recorded} samples"
        )),
    }
}

/// The trials in which the model answers for states that it did not learn.
fn outside(all: &[Series]) -> Option<String> {
    let share = |series: &Series| {
        series.outside.iter().filter(|outside| **outside).count() as f64 / series.t.len().max(1) as f64
    };
    let mut far: Vec<(&Series, f64)> = all.iter().map(|series| (series, share(series))).collect();
    far.retain(|(_, share)| *share > 0.5);
    far.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (worst, _) = far.first()?;
    Some(format!(
        "{} of {} trials, such as {}, are in states outside the training domain: a gap there can be an error of the model, and they are held out only if there are too few other trials",
        far.len(),
        all.len(),
        worst.name
    ))
}

fn named_effects(judge: &Judge, found: &Found, named: &[Named], fitted: &Fit) -> Vec<NamedEffect> {
    let design = judge.design;
    let whole = judge.missing();
    let mut effects = Vec::new();
    let counts = || found.members.iter().map(|member| member.columns.len());
    let starts: Vec<usize> = (0..found.members.len()).map(|index| counts().take(index).sum()).collect();
    for (index, (member, one)) in found.members.iter().zip(named).enumerate() {
        let (first, count) = (starts[index], member.columns.len());
        let with = |other: usize| -> Vec<Vec<f64>> {
            let (start, width) = (starts[other], found.members[other].columns.len());
            let row = |i: usize| (0..width).map(|j| fitted.covariance[(first + i, start + j)]).collect();
            (0..count).map(row).collect()
        };
        let others: Vec<Member> =
            found.members.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, m)| m.clone()).collect();
        let without = design.solve(&judge.columns(&others)).map_or(found.loss, |(_, loss)| loss);
        let specs = one.effect.coefficients();
        let mut parameters = BTreeMap::new();
        for (i, &(coefficient, value)) in one.coefficients.iter().enumerate() {
            let spec = &specs[coefficient];
            let std = fitted.covariance[(first + i, first + i)].max(0.0).sqrt();
            let interval = fitted.intervals[first + i];
            parameters.insert(
                spec.name,
                Parameter { value, std, unit: spec.unit, interval, literature: spec.literature },
            );
        }
        // one that is 0 has no place in the law that was found, such as a frequency in a memory that only fades
        let nonlinear = one.effect.spec().parameters.iter().enumerate();
        for (axis, &effects::Parameter { name, unit }) in
            nonlinear.filter(|(axis, _)| one.shape.parameter(*axis) != 0.0)
        {
            let (value, std) = (one.shape.parameter(axis), fitted.shape_std[index][axis]);
            let interval = [value - Z90 * std, value + Z90 * std];
            parameters.insert(name, Parameter { value, std, unit, interval, literature: None });
        }
        effects.push(NamedEffect {
            name: one.effect.name(),
            kind: one.effect.kind(),
            parameters,
            share_of_gap: ((without - found.loss) / whole).clamp(0.0, 1.0),
            provisional: fitted.provisional[index],
            surfaces: carriers(std::slice::from_ref(one), judge.all, judge.setting, &OPEN),
            covariance: with(index),
            covariance_with: (index + 1..named.len()).map(|j| (named[j].effect.name(), with(j))).collect(),
            coefficients: one.coefficients.iter().map(|&(c, _)| specs[c].name).collect(),
            effect: one.effect,
            shape: one.shape,
            region: one.region.clone(),
            base_drag: judge.setting.base_drag.of(&one.shape).into(),
        });
    }
    effects
}

/// What is not named: effects beside the set that was found, or each by itself where none holds.
fn rejected(judge: &Judge, found: &Found, library: &[Effect], holds: bool) -> Vec<Rejected> {
    let whole = judge.missing();
    // where nothing is missing nothing has a share
    let share = |gain: f64| if whole > f64::MIN_POSITIVE { (gain / whole).clamp(0.0, 1.0) } else { 0.0 };
    let of = |&effect: &Effect| {
        if holds && found.members.iter().any(|member| judge.effect(member) == effect) {
            return None;
        }
        let named: &[Member] = if holds { &found.members } else { &[] };
        let beside = judge.weighed(named, effect)?;
        let alone = judge.design.empty_loss() - judge.ranked(&[], effect)?.first()?.0;
        let why = beside.refused.or((!holds).then_some(Refusal::Incomplete));
        let (share_of_gap, share_alone) = (share(beside.gain), share(alone));
        Some(Rejected { name: effect.name(), why, share_of_gap, share_alone })
    };
    let mut all: Vec<Rejected> = library.iter().filter_map(of).collect();
    all.sort_by(|a, b| b.share_alone.total_cmp(&a.share_alone).then(a.name.cmp(b.name)));
    all
}

fn not_testable(excitation: &Excitation) -> Option<NotTestable> {
    let why = excitation.not_testable.clone()?;
    Some(NotTestable {
        name: excitation.name,
        why,
        minimum_detectable: excitation.minimum_detectable.clone(),
    })
}

fn shares(judge: &Judge, found: &Found) -> BTreeMap<&'static str, f64> {
    let whole = judge.design.empty_loss().max(f64::MIN_POSITIVE);
    let holds = matches!(found.verdict, Verdict::Named | Verdict::Ambiguous);
    let loss = if holds { found.loss } else { judge.design.empty_loss() };
    let noise = judge.floor_loss.min(loss) / whole;
    let explained = (1.0 - loss / whole).max(0.0);
    BTreeMap::from([
        ("noise", noise),
        ("explained", explained),
        ("unexplained", (1.0 - noise - explained).max(0.0)),
    ])
}

/// Squared standardised gap of each bin less that of noise and of the zero of a trial.
fn excess(all: &[Series], design: &Design, setting: &Setting, trial: usize) -> Vec<f64> {
    let series = &all[trial];
    let mut sum = vec![0.0; series.bins.len()];
    for &component in &setting.components {
        let values = series.binned(|sample| series.gap[sample][component]);
        let zero = design.noise.offset[trial][component];
        for (bin, (sum, value)) in sum.iter_mut().zip(values).enumerate() {
            *sum += (value * value - zero * zero) / design.noise.of_bin(trial, component, bin).powi(2) - 1.0;
        }
    }
    sum
}

fn validity(all: &[Series]) -> BTreeMap<&'static str, [f64; 2]> {
    type Quantity = fn(&Condition) -> f64;
    let quantities: [(&'static str, Quantity); 5] = [
        ("depth_m", |c| c.depth),
        ("speed_mps", |c| c.velocity.norm()),
        ("acceleration_mps2", |c| c.acceleration.norm()),
        ("angular_speed_radps", |c| c.angular_velocity.norm()),
        ("density_kgpm3", |c| c.density),
    ];
    let range = |of: Quantity| {
        let mut values: Vec<f64> = all.iter().flat_map(|s| s.conditions.iter().map(of)).collect();
        // single samples of noise do not widen what was tested
        [quantile(&mut values.clone(), 0.005), quantile(&mut values, 0.995)]
    };
    // at rest and in steady motion an effect has less to say than anywhere, whatever the noise of rates made of that
    let from = |name: &str, [low, high]: [f64; 2]| match name {
        "speed_mps" | "acceleration_mps2" | "angular_speed_radps" => [0.0, high],
        _ => [low, high],
    };
    quantities.into_iter().map(|(name, of)| (name, from(name, range(of)))).collect()
}

/// Hash over all numbers, whatever the order of the trials; each column with its name and length, so that no number passes for
/// one of another.
fn hash(trials: &Trials) -> String {
    let mut sorted: Vec<_> = trials.trials.iter().collect();
    sorted.sort_by(|a, b| a.name.cmp(&b.name));
    let mut digest = Sha256::new();
    let mut add = |name: &str, count: usize, values: &mut dyn Iterator<Item = f64>| {
        digest.update(format!("{name} {count}\n"));
        values.for_each(|value| digest.update(value.to_le_bytes()));
    };
    let manifest = trials.manifest.to_toml();
    add(&manifest, 0, &mut std::iter::empty());
    for trial in sorted {
        add(&trial.name, trial.len(), &mut std::iter::empty());
        let columns = [
            ("t", &trial.t),
            trial.still_water.column(),
            ("rho", &trial.density),
            ("roll", &trial.roll),
            ("pitch", &trial.pitch),
            ("yaw", &trial.yaw),
        ];
        let wheels = WHEELS.into_iter().zip(&trial.wheel_speeds);
        let wrenches =
            WRENCH.into_iter().zip(&trial.measured).chain(SIMULATED.into_iter().zip(&trial.simulated));
        let bed = [("bed_clearance", &trial.bed_clearance), ("bed", &trial.bed)];
        let optional =
            wheels.chain(wrenches).chain(bed).filter_map(|(name, column)| Some((name, column.as_ref()?)));
        let stated = trial.other_forces.iter().chain(&trial.known_loads);
        let stated = stated.map(|(name, column)| (name.as_str(), column));
        for (name, column) in columns.into_iter().chain(optional).chain(stated) {
            add(name, column.len(), &mut column.iter().copied());
        }
        for (name, vectors) in [
            ("v", &trial.velocity),
            ("c", &trial.current),
            ("w", &trial.angular_velocity),
            ("a", &trial.acceleration),
            ("al", &trial.angular_acceleration),
        ] {
            add(name, vectors.len(), &mut vectors.iter().flat_map(|v| v.iter().copied()));
        }
    }
    hexadecimal(&digest.finalize())
}
