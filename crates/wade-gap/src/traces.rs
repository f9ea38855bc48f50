//! What the page draws: trials over time, and how the gap goes with the state.

use super::Named;
use super::candidates::Setting;
use super::holdout::explained;
use super::noise::Floor;
use super::rates::mean_square;
use super::report::{Trace, Trend};
use super::series::Series;
use wade_learn::trials::WRENCH;

/// Trials with the largest gap that are drawn, of those that took no part in naming and of the others.
const WORST: usize = 2;
/// Points of a trend.
const POINTS: usize = 12;

/// A trial in its worst component, with the size of the gap there in floors.
#[derive(Clone, Copy)]
struct Ranked {
    size: f64,
    trial: usize,
    component: usize,
}

/// Bins of the trials with the largest gap in their worst component, and of the trial whose gap is the median: of those that took
/// no part, then of the others.
pub(super) fn traces(
    named: &[Named],
    all: &[Series],
    held: &[usize],
    setting: &Setting,
    floors: &[Floor; 6],
) -> Vec<Trace> {
    let mut ranked: Vec<Ranked> =
        (0..all.len()).filter_map(|trial| worst(&all[trial], trial, setting, floors)).collect();
    ranked.sort_by(|a, b| b.size.total_cmp(&a.size).then(a.trial.cmp(&b.trial)));
    let (kept, others): (Vec<_>, Vec<_>) = ranked.into_iter().partition(|one| held.contains(&one.trial));
    let of = |(part, is_held): (Vec<Ranked>, bool)| -> Vec<Trace> {
        let typical = part.get(part.len() / 2).filter(|_| part.len() / 2 >= WORST);
        let chosen = part.iter().take(WORST).map(|one| (one, false)).chain(typical.map(|one| (one, true)));
        let trace = |(one, is_typical): (&Ranked, bool)| {
            let trace = trace(named, &all[one.trial], *one, setting, floors);
            Trace { is_typical, is_held, ..trace }
        };
        chosen.map(trace).collect()
    };
    [(kept, true), (others, false)].into_iter().flat_map(of).collect()
}

/// The component in which the gap of some samples is largest beside noise and the model's own error.
fn worst(series: &Series, trial: usize, setting: &Setting, floors: &[Floor; 6]) -> Option<Ranked> {
    let size = |&component: &usize| {
        let values: Vec<f64> = series.gap.iter().map(|gap| gap[component]).collect();
        let size = mean_square(&values).sqrt() / floors[component].with_model().max(1e-12);
        Ranked { size, trial, component }
    };
    setting.components.iter().map(size).max_by(|a, b| a.size.total_cmp(&b.size))
}

fn trace(
    named: &[Named],
    series: &Series,
    Ranked { trial, component, .. }: Ranked,
    setting: &Setting,
    floors: &[Floor; 6],
) -> Trace {
    let added = explained(named, series, trial, setting);
    let samples = series.bins.iter().map(|bin| bin.len()).max().unwrap_or(1) as f64;
    Trace {
        trial: series.name.clone(),
        component: WRENCH[component],
        is_held: false,
        is_typical: false,
        t: series.binned(|i| series.t[i] - series.t[0]),
        measured: series.binned(|i| series.seen[i][component] + series.gap[i][component]),
        before: series.binned(|i| series.gap[i][component]),
        after: series.binned(|i| series.gap[i][component] - added[i][component]),
        noise: floors[component].sample / samples.sqrt(),
    }
}

/// How the gap of the worst component of all trials goes with speed, depth, acceleration and heading: means over equal numbers of
/// bins. A quantity that does not vary has no trend.
pub(super) fn trends(named: &[Named], all: &[Series], setting: &Setting, floors: &[Floor; 6]) -> Vec<Trend> {
    type Quantity = fn(&Series, usize) -> f64;
    let quantities: [(&str, &str, Quantity); 4] = [
        ("speed ahead", "m/s", |s, i| s.conditions[i].velocity.x),
        ("depth", "m", |s, i| s.conditions[i].depth),
        ("acceleration ahead", "m/s2", |s, i| s.conditions[i].acceleration.x),
        ("heading", "rad", |s, i| s.yaw[i]),
    ];
    let sizes = all.iter().enumerate().filter_map(|(trial, series)| worst(series, trial, setting, floors));
    let Some(Ranked { component, .. }) = sizes.max_by(|a, b| a.size.total_cmp(&b.size)) else {
        return Vec::new();
    };
    let added: Vec<Vec<[f64; 6]>> =
        all.iter().enumerate().map(|(trial, series)| explained(named, series, trial, setting)).collect();
    let of = |(quantity, unit, value): (&'static str, &'static str, Quantity)| {
        let mut points: Vec<[f64; 3]> = Vec::new();
        for (series, added) in all.iter().zip(&added) {
            let at = series.binned(|i| value(series, i));
            let before = series.binned(|i| series.gap[i][component]);
            let after = series.binned(|i| series.gap[i][component] - added[i][component]);
            points.extend(
                at.iter().zip(&before).zip(&after).map(|((at, before), after)| [*at, *before, *after]),
            );
        }
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let range = points.last()?[0] - points.first()?[0];
        let means: Vec<[f64; 3]> = points
            .chunks(points.len().div_ceil(POINTS))
            .map(|chunk| {
                std::array::from_fn(|k| chunk.iter().map(|p| p[k]).sum::<f64>() / chunk.len() as f64)
            })
            .collect();
        let column = |k: usize| means.iter().map(|mean| mean[k]).collect();
        let component = WRENCH[component];
        (range > 1e-6).then(|| Trend {
            component,
            quantity,
            unit,
            at: column(0),
            before: column(1),
            after: column(2),
        })
    };
    quantities.into_iter().filter_map(of).collect()
}
