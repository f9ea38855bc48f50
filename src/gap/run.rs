//! The workflow from trials to report.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use sha2::{Digest, Sha256};

use super::candidates::{Setting, is_inferred, shapes, unavailable};
use super::design::Design;
use super::detect::{self, Excitation};
use super::experiment::separating;
use super::features::{General, Structure, energy};
use super::fit::{Fit, Parameter, fit};
use super::holdout::{closures, explained, worse};
use super::noise::{Floor, floors, floors_of, row_noise, smoothing};
use super::report::{GapReport, NamedEffect, NotTestable, Rejected, Report, Sources, Trace, Verdict};
use super::select::{Judge, Member};
use super::series::{Series, series};
use super::split::hold_out;
use super::statistics::quantile;
use super::{Config, GapError, Named, Predicted, locate};
use crate::condition::Condition;
use crate::effects::{self, Block, Body, Effect, Kind, Memory, Part, Shape};
use crate::frame::{GRAVITY, Vec3};
use crate::trials::{Trials, WRENCH};

/// Deviates that structure without a name needs.
const STRUCTURE: f64 = 5.0;
/// Deviates that energy without a phase needs; with a score a trial it cannot exceed the root of their number, so that
/// few trials need this share of the root.
const ENERGY: [f64; 2] = [4.5, 0.8];

/// The body that `trials.toml` describes, for another simulator's prediction.
pub fn body_of(trials: &Trials) -> Result<Body, GapError> {
    let vehicle = &trials.manifest.vehicle;
    let body = trials.manifest.body.ok_or_else(|| GapError::NoBody { vehicle: vehicle.clone() })?;
    let block = Block {
        length: body.length,
        width: body.width,
        draft: body.draft,
        mass: body.mass,
        displaced_volume: body.displaced_volume,
        center_of_mass: body.center_of_mass,
    };
    Ok(Body::of_block(vehicle, block))
}

/// Runs the workflow. `predict` is asked where trials have no `sim_` columns; it answers about the body's center of mass.
pub fn run(
    trials: &Trials,
    body: &Body,
    predict: &mut dyn FnMut(&Condition) -> Predicted,
    config: &Config,
) -> Result<Report, GapError> {
    config.check()?;
    if trials.manifest.vehicle != body.name {
        let (trials, asked) = (trials.manifest.vehicle.clone(), body.name.clone());
        return Err(GapError::Vehicle { trials, asked });
    }
    let (all, components) = series(trials, body, predict, config)?;
    let (naming, held) = hold_out(&all, config);
    let floors = floors(&all, &trials.manifest, &components);
    let mut setting = Setting {
        body,
        base_drag: Vec3::zeros(),
        channel_width: trials.manifest.channel_width,
        mass: trials.manifest.mass.unwrap_or(body.mass),
        components,
        inferred: is_inferred(&trials.manifest),
        one_clock: one_clock(&all),
        first_stamp: all.iter().map(|s| s.t[0]).fold(f64::INFINITY, f64::min),
    };
    setting.base_drag = base_drag(&all, &setting);
    let library: Vec<Effect> = Effect::ALL
        .into_iter()
        .filter(|&effect| unavailable(effect, &setting, &trials.manifest, &all).is_none())
        .collect();
    let forms: Vec<(Effect, Shape)> = library
        .iter()
        .flat_map(|&effect| shapes(effect, &all, &setting).into_iter().map(move |shape| (effect, shape)))
        .collect();
    let noise = row_noise(&all, &naming, &setting.components, &floors, smoothing(&all, &naming));
    let mut design = Design::new(&all, naming, &setting, &forms, noise, config);
    if design.rows.blocks < 2 * config.folds {
        let (blocks, block_s, folds) = (design.rows.blocks, config.block_s, config.folds);
        return Err(GapError::TooShort { blocks, block_s, folds });
    }
    settle(&mut design, &all, &setting);
    let general = General::new(&all, &design, &setting.components);
    let gap_structure = general.structure(&design, &setting.components, &design.y);
    let floor_loss = floor_loss(&design, &gap_structure);
    let mut members = {
        let judge = Judge { design: &design, setting: &setting, config, floors: &floors, floor_loss };
        judge.select(&library)
    };
    refine(&mut design, &all, &setting, &members);
    // what stood in for a shape that was not yet right has no place any more
    members =
        Judge { design: &design, setting: &setting, config, floors: &floors, floor_loss }.confirmed(&members);
    let judge = Judge { design: &design, setting: &setting, config, floors: &floors, floor_loss };
    let found = Found::of(&judge, &members, &library, &general, &gap_structure, config, &all);
    Ok(report(trials, &all, &judge, found, held, &library))
}

/// What the search found.
struct Found {
    verdict: Verdict,
    members: Vec<Member>,
    alternatives: Vec<Vec<Member>>,
    residual: DVector<f64>,
    /// What is left, without a name.
    left: Structure,
    loss: f64,
}

impl Found {
    fn of(
        judge: &Judge,
        members: &[Member],
        library: &[Effect],
        general: &General,
        gap_structure: &Structure,
        config: &Config,
        all: &[Series],
    ) -> Self {
        let design = judge.design;
        let columns = judge.columns(members);
        let (beta, loss) =
            design.solve(&columns).unwrap_or_else(|| (DVector::zeros(columns.len()), design.empty_loss()));
        let residual = design.residual(&columns, &beta);
        let left = general.structure(design, &judge.setting.components, &residual);
        let whole = design.empty_loss() - judge.floor_loss;
        let coverage = if whole > 0.0 { (design.empty_loss() - loss) / whole } else { 1.0 };
        let alternatives = judge.alternatives(members, library);
        let mut found =
            Self { verdict: Verdict::Named, members: members.to_vec(), alternatives, residual, left, loss };
        found.verdict = if members.is_empty() {
            match found.is_structured(judge, gap_structure, config, all) {
                true => Verdict::NoCandidateFits,
                false => Verdict::NothingMissing,
            }
        } else if coverage < config.coverage {
            Verdict::NoCandidateFits
        } else if found.alternatives.is_empty() {
            Verdict::Named
        } else {
            Verdict::Ambiguous
        };
        found
    }

    /// Predictable from the state, and large enough to matter.
    fn is_structured(&self, judge: &Judge, structure: &Structure, config: &Config, all: &[Series]) -> bool {
        let design = judge.design;
        let rows = design.y.len().max(1) as f64;
        // gain per row is in bins' noise; relevance is in samples' noise
        let relative = judge
            .setting
            .components
            .iter()
            .map(|&c| judge.floors[c].sample.hypot(judge.floors[c].model) / design.noise.bin[c])
            .fold(f64::INFINITY, f64::min);
        let least = config.relevance * relative;
        let size = (structure.gain / rows).sqrt();
        // a force that comes and goes with no phase of its own shows in its energy alone
        let (deviate, _, energy) = energy(all, design, &design.y);
        let bar = f64::min(ENERGY[0], ENERGY[1] * (design.trials.len() as f64).sqrt());
        structure.deviate > STRUCTURE && size > least || deviate > bar && energy > 2.0 * least.max(0.5)
    }
}

/// True where the stamps of all trials are of one clock: they do not overlap.
fn one_clock(all: &[Series]) -> bool {
    let mut spans: Vec<(f64, f64)> = all.iter().map(|s| (s.t[0], s.t[s.t.len() - 1])).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    spans.windows(2).all(|pair| pair[1].0 > pair[0].1)
}

/// Loss that nothing explains: the whole library at once, or the general model, whichever leaves less.
fn floor_loss(design: &Design, structure: &Structure) -> f64 {
    let mut columns: Vec<usize> = Vec::new();
    for candidate in &design.candidates {
        for &(column, _) in &candidate.columns {
            if design.novelty(column, &columns) > 1e-3 {
                columns.push(column);
            }
        }
    }
    let rows = design.y.len() as f64;
    let freedom = rows / (rows - columns.len() as f64).max(1.0);
    let library = design.solve(&columns).map_or(f64::INFINITY, |(_, loss)| loss * freedom);
    library.min(structure.loss).min(design.empty_loss()).max(0.0)
}

/// Drag of the prediction as coefficients on windward areas: least squares over forces beside buoyancy and lift.
fn base_drag(all: &[Series], setting: &Setting) -> Vec3 {
    const COLUMNS: usize = 5;
    let mut xx = DMatrix::<f64>::zeros(COLUMNS, COLUMNS);
    let mut xy = DVector::<f64>::zeros(COLUMNS);
    for series in all {
        for bin in &series.bins {
            let sample = bin.start + bin.len() / 2;
            let input = series.input(sample, setting.body, Vec3::zeros(), None);
            let mut rows = [[0.0; COLUMNS]; 3];
            effects::basis(
                Effect::DragCoefficientError,
                &[0.0; 3],
                &Memory::default(),
                &input,
                |coefficient, _, load| (0..3).for_each(|axis| rows[axis][coefficient] += load.force[axis]),
            );
            let state = input.condition;
            let up = state.up.into_inner();
            let weight = state.density * GRAVITY * input.immersion.volume;
            let lift = 0.5 * state.density * state.velocity.norm_squared() * input.immersion.waterplane_area;
            for axis in 0..3 {
                rows[axis][3] = up[axis] * weight;
                rows[axis][4] = up[axis] * lift;
                let y = series.predicted[sample][axis];
                if y == 0.0 {
                    continue;
                }
                for i in 0..COLUMNS {
                    xy[i] += rows[axis][i] * y;
                    (0..COLUMNS).for_each(|j| xx[(i, j)] += rows[axis][i] * rows[axis][j]);
                }
            }
        }
    }
    let scale: Vec<f64> = (0..COLUMNS).map(|i| xx[(i, i)].sqrt().max(1e-9)).collect();
    let scaled = DMatrix::from_fn(COLUMNS, COLUMNS, |i, j| {
        xx[(i, j)] / (scale[i] * scale[j]) + if i == j { 1e-6 } else { 0.0 }
    });
    let right = DVector::from_fn(COLUMNS, |i, _| xy[i] / scale[i]);
    let Some(factor) = scaled.cholesky() else { return Vec3::zeros() };
    let solved = factor.solve(&right);
    // a drag that is not excited is taken as none
    Vec3::from_fn(|i, _| (solved[i] / scale[i]).clamp(0.0, 5.0))
}

/// Sets the shapes that are estimates of the effect's own coefficients: a current, a delay.
fn settle(design: &mut Design, all: &[Series], setting: &Setting) {
    for candidate in 0..design.candidates.len() {
        if design.candidates[candidate].effect == Effect::Current {
            iterate(design, all, setting, candidate, &[], 3);
        }
    }
}

/// Fixed point of a shape that is the effect's own estimate, beside other columns.
fn iterate(
    design: &mut Design,
    all: &[Series],
    setting: &Setting,
    candidate: usize,
    others: &[usize],
    times: usize,
) {
    for _ in 0..times {
        let own = design.candidates[candidate].columns.clone();
        let columns: Vec<usize> =
            own.iter().map(|(column, _)| *column).chain(others.iter().copied()).collect();
        let Some((beta, _)) = design.solve(&columns) else { return };
        let effect = design.candidates[candidate].effect;
        let mut shape = design.candidates[candidate].shape;
        for (index, &(column, coefficient)) in own.iter().enumerate() {
            let [low, high] = effect.coefficients()[coefficient].bounds;
            shape[coefficient] = (beta[index] / design.scale[column]).clamp(low, high);
        }
        design.reshape(all, setting, candidate, shape);
    }
}

/// Fits the nonlinear parameters of the named effects beside each other.
fn refine(design: &mut Design, all: &[Series], setting: &Setting, members: &[Member]) {
    for _ in 0..2 {
        for index in 0..members.len() {
            let others: Vec<usize> = members
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != index)
                .flat_map(|(_, member)| member.columns.iter().map(|(column, _)| *column))
                .collect();
            let candidate = members[index].candidate;
            match design.candidates[candidate].effect {
                Effect::Current | Effect::SensorDelay => iterate(design, all, setting, candidate, &others, 3),
                Effect::HullFlooding => search(design, all, setting, &members[index], &others, &[0]),
                Effect::WaveMemory => search(design, all, setting, &members[index], &others, &[0, 1]),
                _ => {}
            }
        }
    }
}

/// Coordinate search over the nonlinear parameters of a member, by factors that shrink.
fn search(
    design: &mut Design,
    all: &[Series],
    setting: &Setting,
    member: &Member,
    others: &[usize],
    axes: &[usize],
) {
    const TRIES: usize = 8;
    let columns: Vec<usize> =
        member.columns.iter().map(|(column, _)| *column).chain(others.iter().copied()).collect();
    let loss = |design: &Design| design.solve(&columns).map_or(f64::INFINITY, |(_, loss)| loss);
    let memory = design.candidates[member.candidate].effect == Effect::WaveMemory;
    let shortest = if memory { 0.8 * (setting.body.length / GRAVITY).sqrt() } else { 0.0 };
    let mut best = loss(design);
    for step in [1.5, 1.15, 1.05, 1.015] {
        for &axis in axes {
            for factor in [step, 1.0 / step] {
                for _ in 0..TRIES {
                    let held = design.candidates[member.candidate].shape;
                    let mut shape = held;
                    shape[axis] *= factor;
                    // a frequency of zero has no factor
                    if shape[axis] == held[axis] || (axis == 0 && shape[0] < shortest) {
                        break;
                    }
                    design.reshape(all, setting, member.candidate, shape);
                    let found = loss(design);
                    if found >= best {
                        design.reshape(all, setting, member.candidate, held);
                        break;
                    }
                    best = found;
                }
            }
        }
    }
}

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
            Named { effect: candidate.effect, shape: candidate.shape, coefficients }
        })
        .collect()
}

fn report(
    trials: &Trials,
    all: &[Series],
    judge: &Judge,
    found: Found,
    held: Vec<usize>,
    library: &[Effect],
) -> Report {
    let (design, setting, config) = (judge.design, judge.setting, judge.config);
    let fitted = fit(design, &found.members, all, setting, config);
    // nothing that does not fit is applied or shown as if it did
    let holds = matches!(found.verdict, Verdict::Named | Verdict::Ambiguous);
    let named = match &fitted {
        Some(fitted) if holds => named(design, &found.members, fitted),
        _ => Vec::new(),
    };
    let effects = match &fitted {
        Some(fitted) if holds => named_effects(judge, &found, &named, fitted, all),
        _ => Vec::new(),
    };
    let gap_excess = |trial: usize| excess(all, design, setting, trial);
    let (regions, regions_tried) = match found.verdict {
        Verdict::NothingMissing => (Vec::new(), 0),
        _ => locate::locate(all, &design.trials, gap_excess, config),
    };
    let excitation =
        detect::excitations(design, all, setting, &trials.manifest, &found.residual, &Effect::ALL, config);
    let not_testable = excitation.iter().filter_map(not_testable).collect();
    let alternatives: Vec<Vec<&'static str>> = match holds {
        true => found.alternatives.iter().map(|set| names(judge, set)).collect(),
        false => Vec::new(),
    };
    let separating_experiment = found.alternatives.first().filter(|_| holds).map(|rival| {
        let effects = |set: &[Member]| set.iter().map(|m| judge.effect(m)).collect::<Vec<_>>();
        separating(&effects(&found.members), &effects(rival))
    });
    let held_floors = floors_of(all, &held, judge.floors, &setting.components);
    let unexplained = unexplained(judge, &found);
    let gap = GapReport {
        held_out: closures(&named, all, &held, setting, &held_floors, config),
        size: detect::sizes(all, judge.floors, &setting.components, config),
        shares: shares(judge, &found),
        floors: setting.components.iter().map(|&c| (WRENCH[c], judge.floors[c])).collect(),
        worse_regions: worse(&named, all, &held, setting, judge.floors, &regions),
        held_out_trials: held.iter().map(|&trial| all[trial].name.clone()).collect(),
        unexplained,
    };
    let mut report = Report {
        verdict: found.verdict,
        summary: String::new(),
        vehicle: trials.manifest.vehicle.clone(),
        generated: trials.manifest.generated.clone(),
        rejected: rejected(judge, &found, library),
        effects,
        alternatives,
        separating_experiment,
        not_testable,
        regions,
        regions_tried,
        gap,
        excitation,
        validity: validity(all),
        base_drag: setting.base_drag.into(),
        trials: all.len(),
        samples: all.iter().map(|s| s.t.len()).sum(),
        remarks: trials.remarks().iter().map(ToString::to_string).collect(),
        sources: Sources { trials: hash(trials), ..Sources::default() },
        traces: traces(&named, all, setting, judge.floors),
    };
    report.summary = summary(&report);
    report
}

fn names(judge: &Judge, set: &[Member]) -> Vec<&'static str> {
    set.iter().map(|member| judge.effect(member).name()).collect()
}

fn named_effects(
    judge: &Judge,
    found: &Found,
    named: &[Named],
    fitted: &Fit,
    all: &[Series],
) -> Vec<NamedEffect> {
    let design = judge.design;
    let whole = (design.empty_loss() - judge.floor_loss).max(f64::MIN_POSITIVE);
    let mut first = 0;
    let mut effects = Vec::new();
    for (index, (member, one)) in found.members.iter().zip(named).enumerate() {
        let count = member.columns.len();
        let others: Vec<Member> =
            found.members.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, m)| m.clone()).collect();
        let without = design.solve(&judge.columns(&others)).map_or(found.loss, |(_, loss)| loss);
        let placebo = judge.beats_placebos(&found.members, member).unwrap_or_default();
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
        for (axis, &(name, unit)) in one.effect.shape_names().iter().enumerate() {
            let (value, std) = (one.shape[axis], fitted.shape_std[index][axis]);
            let interval = [value - 1.645 * std, value + 1.645 * std];
            parameters.insert(name, Parameter { value, std, unit, interval, literature: None });
        }
        effects.push(NamedEffect {
            name: one.effect.name(),
            kind: one.effect.kind(),
            parameters,
            share_of_gap: ((without - found.loss) / whole).clamp(0.0, 1.0),
            provisional: fitted.provisional[index],
            placebo: [placebo.0, placebo.1],
            surfaces: surfaces(one, all, judge.setting),
            covariance: (0..count)
                .map(|i| (0..count).map(|j| fitted.covariance[(first + i, first + j)]).collect())
                .collect(),
            coefficients: one.coefficients.iter().map(|&(c, _)| specs[c].name).collect(),
            effect: one.effect,
            shape: one.shape,
        });
        first += count;
    }
    effects
}

/// Shares of the load of an effect by surface, over a sample of the bins; what acts on the hull as a whole is `hull`.
fn surfaces(named: &Named, all: &[Series], setting: &Setting) -> BTreeMap<String, f64> {
    let mut loads: BTreeMap<String, f64> = BTreeMap::new();
    if named.effect.kind() != Kind::Physics {
        return loads;
    }
    for series in all {
        let mut memory = Memory::default();
        for (index, bin) in series.bins.iter().enumerate() {
            let input = series.input(bin.start, setting.body, setting.base_drag, setting.channel_width);
            if index > 0 {
                let dt = series.t[bin.start] - series.t[series.bins[index - 1].start];
                effects::advance(named.effect, &named.shape, &mut memory, &input, dt);
            }
            effects::basis(named.effect, &named.shape, &memory, &input, |coefficient, part, load| {
                let value =
                    named.coefficients.iter().find(|(c, _)| *c == coefficient).map_or(0.0, |(_, v)| *v);
                let name = match part {
                    Part::Panel(panel) => setting.body.panels[panel].name.clone(),
                    Part::Hull => "hull".to_owned(),
                };
                *loads.entry(name).or_default() += (load.force * value).norm();
            });
        }
    }
    let whole: f64 = loads.values().sum();
    loads.retain(|_, load| *load > 0.01 * whole);
    loads.values_mut().for_each(|load| *load /= whole.max(f64::MIN_POSITIVE));
    loads
}

fn rejected(judge: &Judge, found: &Found, library: &[Effect]) -> Vec<Rejected> {
    let whole = (judge.design.empty_loss() - judge.floor_loss).max(f64::MIN_POSITIVE);
    let share = |gain: f64| (gain / whole).clamp(0.0, 1.0);
    let free = library.iter().filter(|effect| !found.members.iter().any(|m| judge.effect(m) == **effect));
    let mut all: Vec<Rejected> = free
        .filter_map(|&effect| {
            let beside = judge.judge(&found.members, effect)?;
            let alone = judge.judge(&[], effect)?;
            let (why, name) = (beside.refused, effect.name());
            Some(Rejected { name, why, share_of_gap: share(beside.gain), share_alone: share(alone.gain) })
        })
        .collect();
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

fn unexplained(judge: &Judge, found: &Found) -> Option<String> {
    let left = &found.left;
    let whole = (judge.design.empty_loss() - judge.floor_loss).max(f64::MIN_POSITIVE);
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
    Some(format!(
        "{:.0} % of the gap above the floor can be predicted from the state beyond the named effects; it goes most with {}",
        (100.0 * share).clamp(0.0, 100.0),
        functions.join(", ")
    ))
}

/// Squared standardised gap of each bin less that of noise.
fn excess(all: &[Series], design: &Design, setting: &Setting, trial: usize) -> Vec<f64> {
    let series = &all[trial];
    let mut sum = vec![0.0; series.bins.len()];
    for &component in &setting.components {
        let values = series.binned(|sample| series.gap[sample][component]);
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += (value / design.noise.bin[component]).powi(2) - 1.0;
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
    quantities.into_iter().map(|(name, of)| (name, range(of))).collect()
}

/// Hash over all numbers, whatever the order of the trials.
fn hash(trials: &Trials) -> String {
    let mut sorted: Vec<_> = trials.trials.iter().collect();
    sorted.sort_by(|a, b| a.name.cmp(&b.name));
    let mut digest = Sha256::new();
    digest.update(trials.manifest.to_toml());
    for trial in sorted {
        digest.update(&trial.name);
        let columns = [&trial.t, &trial.depth, &trial.density, &trial.roll, &trial.pitch, &trial.yaw];
        let measured = trial.measured.iter().chain(&trial.simulated).flatten();
        for column in columns.into_iter().chain(measured).chain(trial.other_forces.values()) {
            column.iter().for_each(|value| digest.update(value.to_le_bytes()));
        }
        for vectors in [&trial.velocity, &trial.angular_velocity, &trial.acceleration] {
            vectors.iter().flat_map(|v| v.iter()).for_each(|value| digest.update(value.to_le_bytes()));
        }
    }
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bins of the trials with the largest gap in their worst component.
fn traces(named: &[Named], all: &[Series], setting: &Setting, floors: &[Floor; 6]) -> Vec<Trace> {
    const MOST: usize = 3;
    let mut worst: Vec<(f64, usize, usize)> = Vec::new();
    for (trial, series) in all.iter().enumerate() {
        let size = |&c: &usize| {
            let squares = series.gap.iter().map(|gap| gap[c].powi(2)).sum::<f64>();
            ((squares / series.gap.len() as f64).sqrt() / floors[c].total().max(1e-12), trial, c)
        };
        worst.extend(setting.components.iter().map(size).max_by(|a, b| a.0.total_cmp(&b.0)));
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    worst
        .into_iter()
        .take(MOST)
        .map(|(_, trial, component)| {
            let series = &all[trial];
            let added = explained(named, series, trial, setting);
            let samples = series.bins.iter().map(|bin| bin.len()).max().unwrap_or(1) as f64;
            Trace {
                trial: series.name.clone(),
                component: WRENCH[component],
                t: series.binned(|i| series.t[i] - series.t[0]),
                before: series.binned(|i| series.gap[i][component]),
                after: series.binned(|i| series.gap[i][component] - added[i][component]),
                noise: floors[component].sample / samples.sqrt(),
            }
        })
        .collect()
}

fn summary(report: &Report) -> String {
    let names = |effects: &[NamedEffect]| effects.iter().map(|e| e.name).collect::<Vec<_>>().join(" and ");
    let closed = report.gap.held_out.get("all").and_then(|all| all.closure);
    let closed = closed.map_or_else(String::new, |c| {
        format!(" On trials that took no part it closes {:.0} % of the gap above the noise.", 100.0 * c)
    });
    match report.verdict {
        Verdict::NothingMissing => {
            "Nothing is missing that these trials can show: the gap holds no structure beyond its noise."
                .into()
        }
        Verdict::Named => format!("The gap is {}.{closed}", names(&report.effects)),
        Verdict::Ambiguous => format!(
            "The gap is {}, or {}: these trials cannot tell them apart.{closed}",
            names(&report.effects),
            report.alternatives.iter().map(|set| set.join(" and ")).collect::<Vec<_>>().join(", or "),
        ),
        Verdict::NoCandidateFits => {
            "There is a gap with structure, and no effect of the library explains it; nothing is applied."
                .into()
        }
    }
}
