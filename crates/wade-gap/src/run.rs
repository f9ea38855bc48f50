//! The workflow from trials to report.

use super::base_drag::BaseDrag;
use super::calibrate::calibrate;
use super::candidates::{Setting, shapes, unavailable};
use super::color::Color;
use super::compose::{compose, is_disproved, is_shown};
use super::contradictions;
use super::design::{Design, Rows};
use super::elsewhere::Questions;
use super::explanations::weigh;
use super::gated::Gated;
use super::general::General;
use super::judge::{Judge, Member};
use super::measurement::{is_computed, is_inferred};
use super::noise::{floors, row_noise};
use super::nonlinear::{refine, see, settle, through_sensors};
use super::plausible;
use super::report::{Report, Verdict};
use super::series::{Series, one_clock, series};
use super::smoothing::{Smoothing, smoothed};
use super::split::hold_out;
use super::statistics::median;
use super::verdict::{Found, floor_loss};
use super::{Asked, Config, GapError, Predicted};
use wade_core::effects::{Block, Body, Effect, Shape};
use wade_core::frame::GRAVITY;
use wade_learn::trials::{Trial, Trials};

/// The body that `trials.toml` describes, for another simulator's prediction; its wheels are as large as they roll.
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
        wheel_radius: rolling_radius(trials),
    };
    Ok(Body::of_block(vehicle, block))
}

/// Runs the workflow. `predict` is asked along each trial that has no `sim_` columns; it answers about the body's center of mass.
pub fn run(
    trials: &Trials,
    body: &Body,
    predict: &mut dyn FnMut(&Asked<'_>) -> Predicted,
    config: &Config,
) -> Result<Report, GapError> {
    config.check()?;
    // neither the order in which effects are asked for nor that one is asked for twice must matter
    let mut library = config.library.clone();
    library.sort();
    library.dedup();
    let config = &Config { library, ..config.clone() };
    if trials.manifest.vehicle != body.name {
        let (trials, asked) = (trials.manifest.vehicle.clone(), body.name.clone());
        return Err(GapError::Vehicle { trials, asked });
    }
    let (mut all, components) = series(trials, body, predict, config)?;
    let mass = trials.manifest.mass.unwrap_or(body.mass);
    plausible::check(&all, &components, is_inferred(&trials.manifest), mass)?;
    contradictions::check(&all, body, rolling_radius(trials))?;
    let manifest = contradictions::with_true_repeats(&all, &trials.manifest);
    let (naming, held) = hold_out(&all, &manifest.measured.repeats, config);
    check_kept_back(&all, &naming, &held, &manifest.measured.repeats)?;
    let floors = floors(&all, &naming, &manifest, &components);
    let simulated = trials.trials.iter().any(Trial::is_simulated);
    let questions = Questions::new(body, predict);
    let changes = |shape: &Shape, series: &Series| questions.changes(shape, series);
    let setting = Setting {
        elsewhere: if simulated { None } else { Some(&changes) },
        body,
        base_drag: BaseDrag::new(&all, body),
        in_channel: all.iter().any(|series| series.channel_width.is_some()),
        mass,
        inertia: trials.manifest.inertia_matrix(),
        components,
        inferred: is_inferred(&trials.manifest),
        computed: is_computed(&trials.manifest),
        one_clock: one_clock(all.iter().map(|series| series.t.as_slice())),
        first_stamp: all.iter().map(|s| s.t[0]).fold(f64::INFINITY, f64::min),
    };
    let available = |effect: &Effect| unavailable(*effect, &setting, &trials.manifest, &all).is_none();
    let library: Vec<Effect> = config.library.iter().copied().filter(available).collect();
    let forms: Vec<Shape> = library.iter().flat_map(|&effect| shapes(effect, &all, &setting)).collect();
    let rows = Rows::new(&all, &naming, &setting.components, config.block_s);
    if rows.blocks / 2 < config.folds {
        let (blocks, block_s, folds) = (rows.blocks, config.block_s, config.folds);
        return Err(GapError::TooShort { blocks, block_s, folds });
    }
    let mut smoothing = if setting.computed { Smoothing::default() } else { calibrate(&mut all) };
    let colors = colors(&all, &naming, &setting);
    from_forces(&mut all, &setting, &colors);
    // what is weighed by the spectrum of its noise needs no smoothing
    smoothing
        .0
        .iter_mut()
        .zip(&colors)
        .filter(|(_, color)| color.is_some())
        .for_each(|(length, _)| *length = 0.0);
    let noise = row_noise(&all, &naming, &setting.components, (&floors, &manifest), smoothing, colors);
    let mut design = Design::new(&all, naming, rows, &setting, &forms, noise, config);
    settle(&mut design, &all, &setting, 0);
    let general = General::new(&all, &design, &setting.components);
    let gap_structure = general.structure(&design, &setting.components, &design.y);
    let floor_loss = floor_loss(&design, &gap_structure);
    let mut members = {
        let judge = Judge::new(&design, &all, &setting, config, &floors, floor_loss);
        judge.select(&library)
    };
    // the set of the search while a more probable one is tried in its place, and the names of one that the held-out trials disproved
    let (mut searched, mut refuted): (Option<(Vec<Member>, Verdict)>, Vec<&str>) = (None, Vec::new());
    let mut is_tried = false;
    // where the search ended in nothing, a set that is far more probable than not is taken for its weight: it has passed no gate of
    // the search, and the held-out trials judge it
    let mut for_its_weight = false;
    // what acts in a region beside the set that the search found
    let mut in_regions: Option<Vec<Gated>> = None;
    let (found, weighed, in_region) = loop {
        let asked = members.clone();
        refine(&mut design, &all, &setting, &members);
        through_sensors(&mut design, &mut all, &setting, &members);
        // what stood in for a shape that was not yet right has no place any more
        let judge = Judge::new(&design, &all, &setting, config, &floors, floor_loss);
        if !for_its_weight {
            members = judge.confirmed(&members);
        }
        let mut found = Found::of(&judge, &members, &library, &general, &gap_structure, for_its_weight);
        let in_regions = in_regions.get_or_insert_with(|| found.gated.clone());
        let weighed = weigh(&judge, &found, &library);
        let is_disproved = |set: &[Member]| is_disproved(&judge, set, &held);
        let names = |set: &[Member]| judge.sorted_names(set);
        let next = match searched.take() {
            Some((searched, verdict)) => {
                // no more open than what was searched for, unless that cannot be
                let may_be_open =
                    || for_its_weight || verdict == Verdict::Ambiguous || is_disproved(&searched);
                let is_named = match found.verdict {
                    Verdict::Named => true,
                    Verdict::Ambiguous => may_be_open(),
                    _ => false,
                };
                let is_whole = is_named && names(&members) == names(&asked);
                if is_disproved(&members) {
                    refuted = names(&asked);
                }
                (!is_whole || !refuted.is_empty()).then_some(searched)
            }
            None if is_tried => None,
            None => found.set_to_name(&judge, &weighed).inspect(|_| searched = Some((asked, found.verdict))),
        };
        for_its_weight = searched.is_some() && !matches!(found.verdict, Verdict::Named | Verdict::Ambiguous);
        let Some(next) = next else {
            found.heed(&weighed, |set| names(set) != refuted && !is_disproved(set));
            // a name that the held-out trials disprove leaves the question open
            let is_open = || match found.verdict {
                Verdict::NoCandidateFits => true,
                Verdict::NothingMissing => found.unfit.is_some(),
                Verdict::Named => is_disproved(&found.members),
                _ => false,
            };
            let in_region = in_regions.iter().find(|gated| gated.may_be_named());
            let in_region = in_region.filter(|_| is_open()).cloned();
            break (found, weighed, in_region);
        };
        is_tried = true;
        members = next;
        see(&mut design, &mut all, &setting, &[]);
    };
    let candidates = design.candidates.len();
    let limited = in_region.as_ref().and_then(|gated| {
        see(&mut design, &mut all, &setting, &[]);
        let member = gated.add_to(&mut design, &all, &setting, &library, config.folds)?;
        refine(&mut design, &all, &setting, std::slice::from_ref(&member));
        let judge = Judge::new(&design, &all, &setting, config, &floors, floor_loss);
        let members = judge.confirmed(&[member]);
        let mut limited = Found::of(&judge, &members, &library, &general, &gap_structure, false);
        let weighed = weigh(&judge, &limited, &library);
        let is_shown = |set: &[Member]| is_shown(&judge, set, &held);
        limited.heed(&weighed, is_shown);
        limited.gated = vec![gated.clone()];
        // with borders that nobody stated an effect imitates many others
        let is_named = limited.verdict == Verdict::Named && limited.is_likely(&weighed);
        (is_named && is_shown(&limited.members)).then_some((limited, weighed))
    });
    if limited.is_none() {
        design.keep(candidates);
    }
    let (found, weighed) = limited.unwrap_or((found, weighed));
    let judge = Judge::new(&design, &all, &setting, config, &floors, floor_loss);
    Ok(compose(trials, &judge, found, &weighed, held, &library))
}

/// The color of the noise of forces that were inferred from the motion of the trials themselves. Moments are left out: the rates in their
/// columns are the recorded ones.
fn colors(all: &[Series], naming: &[usize], setting: &Setting) -> [Option<Color>; 6] {
    let are_colored = !setting.computed && all.iter().all(|series| series.inertia.is_some());
    std::array::from_fn(|component| {
        let is_colored = are_colored && component < 3 && setting.components.contains(&component);
        if is_colored { Color::of(all, naming, component) } else { None }
    })
}

/// Sets the accelerations that effects see to those that the known forces and the prediction give, `m a = F - m g up`, with as much of
/// the gap as stands above its noise. A recorded acceleration has the noise that stands in the inferred wrench, and would agree
/// with it (instrumental variables; Fuller, Measurement Error Models, section 1.4).
fn from_forces(all: &mut [Series], setting: &Setting, colors: &[Option<Color>; 6]) {
    /// Length over which a dry twin's acceleration is smoothed where the gap says nothing [s].
    const SLOW: f64 = 1.0;
    for (axis, color) in colors.iter().enumerate() {
        let Some(color) = color else { continue };
        for series in all.iter_mut() {
            let slow = color.above_s.map(|length| smoothed(series, length, |i| series.gap[i][axis]));
            let length = color.above_s.unwrap_or(SLOW);
            let dry = series.dry_acceleration.as_ref().map(|dry| smoothed(series, length, |i| dry[i][axis]));
            for sample in 0..series.t.len() {
                let slow = slow.as_ref().map_or(0.0, |slow| slow[sample]);
                let inertia = (series.other[sample][axis] + series.seen[sample][axis] + slow) / setting.mass;
                // a twin drives with the same attitude
                let acceleration = match &dry {
                    Some(dry) => inertia + dry[sample],
                    None => inertia - GRAVITY * series.conditions[sample].up[axis],
                };
                series.calibrated[sample].acceleration[axis] = acceleration;
                series.conditions[sample].acceleration[axis] = acceleration;
                if let Some(stated) = &mut series.inertia {
                    stated[sample][axis] = inertia;
                }
            }
        }
    }
}

/// Refuses trials kept back that repeat trials which are not.
fn check_kept_back(
    all: &[Series],
    naming: &[usize],
    held: &[usize],
    repeats: &[Vec<String>],
) -> Result<(), GapError> {
    for group in repeats {
        let of_group = |trials: &[usize]| {
            trials.iter().map(|&trial| all[trial].name.clone()).find(|name| group.contains(name))
        };
        if let (Some(trial), Some(other)) = (of_group(held), of_group(naming)) {
            return Err(GapError::RepeatKeptBack { trial, other });
        }
    }
    Ok(())
}

/// Radius at which the wheels roll [m]: the median of speed over turning, where wheels turn the way the vehicle goes. Most
/// driving is rolling; `None` where too little of it was recorded.
fn rolling_radius(trials: &Trials) -> Option<f64> {
    const SLOWEST: f64 = 0.3;
    const LEAST: usize = 50;
    let mut radii = Vec::new();
    for trial in &trials.trials {
        let wheels: Vec<&Vec<f64>> = trial.wheel_speeds.iter().flatten().collect();
        let turning =
            |i: usize| wheels.iter().map(|wheel| wheel[i]).sum::<f64>() / f64::max(wheels.len() as f64, 1.0);
        let rolling = (0..trial.len()).map(|i| (trial.velocity[i].x, turning(i)));
        radii.extend(rolling.filter(|(v, omega)| v.abs() > SLOWEST && v * omega > 0.0).map(|(v, w)| v / w));
    }
    (radii.len() >= LEAST).then(|| median(&mut radii))
}
