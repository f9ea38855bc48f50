//! What the page draws: trials over time, and how the gap goes with the state.

use super::Named;
use super::candidates::Setting;
use super::holdout::explained;
use super::noise::Floor;
use super::rates::mean_square;
use super::report::{Trace, Trend};
use super::series::Series;
use wade_learn::trials::WRENCH;

/// Trials with the largest gap that are drawn, of those that are held out and of the others.
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

/// Bins of the trials with the largest gap in their worst component, and of the trial whose gap is the median, of those that are held
/// out and of the others; and how the gap of the worst component of all goes with the state.
pub(super) fn drawn(
    named: &[Named],
    all: &[Series],
    held: &[usize],
    setting: &Setting,
    floors: &[Floor; 6],
) -> (Vec<Trace>, Vec<Trend>) {
    let added: Vec<Vec<[f64; 6]>> =
        all.iter().enumerate().map(|(trial, series)| explained(named, series, trial, setting)).collect();
    let mut ranked: Vec<Ranked> =
        (0..all.len()).filter_map(|trial| worst(&all[trial], trial, setting, floors)).collect();
    ranked.sort_by(|a, b| b.size.total_cmp(&a.size).then(a.trial.cmp(&b.trial)));
    let trends = ranked.first().map_or_else(Vec::new, |first| trends(all, &added, first.component));
    let (kept, others): (Vec<_>, Vec<_>) = ranked.into_iter().partition(|one| held.contains(&one.trial));
    let of = |(part, is_held): (Vec<Ranked>, bool)| -> Vec<Trace> {
        let typical = part.get(part.len() / 2).filter(|_| part.len() / 2 >= WORST);
        let chosen = part.iter().take(WORST).map(|one| (one, false)).chain(typical.map(|one| (one, true)));
        let trace = |(&Ranked { trial, component, .. }, is_typical): (&Ranked, bool)| {
            let series = &all[trial];
            let samples = series.bins.iter().map(|bin| bin.len()).max().unwrap_or(1) as f64;
            let [before, after] = before_and_after(series, &added[trial], component);
            Trace {
                trial: series.name.clone(),
                component: WRENCH[component],
                is_held,
                is_typical,
                t: series.binned(|i| series.t[i] - series.t[0]),
                measured: series.binned(|i| series.seen[i][component] + series.gap[i][component]),
                before,
                after,
                noise: floors[component].sample / samples.sqrt(),
            }
        };
        chosen.map(trace).collect()
    };
    ([(kept, true), (others, false)].into_iter().flat_map(of).collect(), trends)
}

/// The component in which the gap of a trial is largest beside noise and the model's own error.
fn worst(series: &Series, trial: usize, setting: &Setting, floors: &[Floor; 6]) -> Option<Ranked> {
    let size = |&component: &usize| {
        let values: Vec<f64> = series.gap.iter().map(|gap| gap[component]).collect();
        let size = mean_square(&values).sqrt() / floors[component].with_model().max(1e-12);
        Ranked { size, trial, component }
    };
    setting.components.iter().map(size).max_by(|a, b| a.size.total_cmp(&b.size))
}

/// Gap of each bin without and with what the named effects add.
fn before_and_after(series: &Series, added: &[[f64; 6]], component: usize) -> [Vec<f64>; 2] {
    [
        series.binned(|i| series.gap[i][component]),
        series.binned(|i| series.gap[i][component] - added[i][component]),
    ]
}

/// How the gap goes with speed, depth, acceleration and heading: means over equal numbers of bins. A quantity that does not vary has
/// no trend.
fn trends(all: &[Series], added: &[Vec<[f64; 6]>], component: usize) -> Vec<Trend> {
    type Quantity = fn(&Series, usize) -> f64;
    let quantities: [(&str, &str, Quantity); 4] = [
        ("speed ahead", "m/s", |s, i| s.conditions[i].velocity.x),
        ("depth", "m", |s, i| s.conditions[i].depth),
        ("acceleration ahead", "m/s2", |s, i| s.conditions[i].acceleration.x),
        ("heading", "rad", |s, i| s.yaw[i]),
    ];
    let gaps: Vec<[Vec<f64>; 2]> =
        all.iter().zip(added).map(|(series, added)| before_and_after(series, added, component)).collect();
    let of = |(quantity, unit, value): (&'static str, &'static str, Quantity)| {
        let mut points: Vec<[f64; 3]> = Vec::new();
        for (series, [before, after]) in all.iter().zip(&gaps) {
            let at = series.binned(|i| value(series, i));
            points
                .extend(at.iter().zip(before).zip(after).map(|((at, before), after)| [*at, *before, *after]));
        }
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let range = points.last()?[0] - points.first()?[0];
        let mean = |chunk: &[[f64; 3]]| -> [f64; 3] {
            std::array::from_fn(|k| chunk.iter().map(|point| point[k]).sum::<f64>() / chunk.len() as f64)
        };
        let means: Vec<[f64; 3]> = points.chunks(points.len().div_ceil(POINTS)).map(mean).collect();
        let column = |k: usize| means.iter().map(|mean| mean[k]).collect();
        let (at, before, after) = (column(0), column(1), column(2));
        (range > 1e-6).then(|| Trend { component: WRENCH[component], quantity, unit, at, before, after })
    };
    quantities.into_iter().filter_map(of).collect()
}
