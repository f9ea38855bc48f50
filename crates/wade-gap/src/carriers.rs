//! Which surfaces carry a load: that of the named effects, or of a gap without a name in a region.

use std::collections::BTreeMap;

use super::Named;
use super::candidates::Setting;
use super::features::of_bins;
use super::locate::{Limits, Region, inside};
use super::noise::Floor;
use super::series::Series;
use wade_core::effects::{Effect, EffectRegion, Kind, Memory, Part};

/// Components of a load along the water's surface and across it: the force along x and y with the moment about z, the force along
/// z with the moments about x and y.
const ALONG: [usize; 3] = [0, 1, 5];
const ACROSS: [usize; 3] = [2, 3, 4];

/// Shares of the load of effects of the water by surface, over the bins within some limits; what acts on the hull as a whole is
/// `hull`, and what carries next to nothing is left out.
pub(super) fn carriers(
    named: &[Named],
    all: &[Series],
    setting: &Setting,
    limits: &Limits,
) -> BTreeMap<String, f64> {
    let mut loads: BTreeMap<String, f64> = BTreeMap::new();
    for named in named.iter().filter(|named| named.effect.kind() == Kind::Physics) {
        let base_drag = setting.base_drag.of(&named.shape);
        for series in all {
            let (features, mut memory) = (of_bins(series), Memory::default());
            for (index, bin) in series.bins.iter().enumerate() {
                let input = series.input(bin.start, setting.body, base_drag);
                let dt = match index.checked_sub(1) {
                    Some(before) => series.t[bin.start] - series.t[series.bins[before].start],
                    None => 0.0,
                };
                named.shape.advance(&mut memory, &input, dt);
                if !inside(limits, &features[index]) {
                    continue;
                }
                let share = named.region.share(input.condition);
                named.shape.basis(&memory, &input, |coefficient, part, load| {
                    let own = named.coefficients.iter().find(|(c, _)| *c == coefficient);
                    let value = own.map_or(0.0, |(_, value)| share * value);
                    let name = match part {
                        Part::Panel(panel) => setting.body.panels[panel].name.clone(),
                        Part::Hull => "hull".to_owned(),
                    };
                    *loads.entry(name).or_default() += (load.force * value).norm();
                });
            }
        }
    }
    let whole: f64 = loads.values().sum();
    loads.retain(|_, load| *load > 0.01 * whole);
    loads.values_mut().for_each(|load| *load /= whole.max(f64::MIN_POSITIVE));
    loads
}

/// The largest shares in words.
pub fn in_shares(shares: &BTreeMap<String, f64>) -> String {
    const MOST: usize = 5;
    let mut largest: Vec<(&String, &f64)> = shares.iter().collect();
    largest.sort_by(|a, b| b.1.total_cmp(a.1).then(a.0.cmp(b.0)));
    let of = |(name, share): &(&String, &f64)| format!("{name} {:.0} %", 100.0 * **share);
    let mut words: Vec<String> = largest.iter().take(MOST).map(of).collect();
    let rest: f64 = largest.iter().skip(MOST).map(|(_, share)| **share).sum();
    if rest > 0.0 {
        words.push(format!("others {:.0} %", 100.0 * rest));
    }
    words.join(", ")
}

/// What carries the named effects in a region; where none of the water is named, what would carry such a gap there: the surfaces
/// that meet the flow one along the water, and those that the water lifts one across it.
pub(super) fn of_region(
    region: &Region,
    named: &[Named],
    all: &[Series],
    setting: &Setting,
    floors: &[Floor; 6],
) -> BTreeMap<String, f64> {
    if named.iter().any(|named| named.effect.kind() == Kind::Physics) {
        return carriers(named, all, setting, &region.limits);
    }
    let size = |components: [usize; 3]| -> f64 {
        let compared = components.into_iter().filter(|c| setting.components.contains(c));
        let square = |c: usize| -> f64 {
            let floor = floors[c].with_model().max(1e-12);
            let of = |series: &Series| -> f64 {
                let bins = series.binned(|sample| (series.gap[sample][c] / floor).powi(2));
                let within = of_bins(series).into_iter().zip(bins);
                within
                    .filter(|(features, _)| inside(&region.limits, features))
                    .map(|(_, square)| square)
                    .sum()
            };
            all.iter().map(of).sum()
        };
        compared.map(square).sum()
    };
    let effect = match size(ALONG) >= size(ACROSS) {
        true => Effect::DragCoefficientError,
        false => Effect::WaterLevelOffset,
    };
    let coefficients = (0..effect.coefficients().len()).map(|coefficient| (coefficient, 1.0)).collect();
    let everywhere = EffectRegion::default();
    let named = Named { effect, shape: effect.plain(), region: everywhere, coefficients };
    carriers(&[named], all, setting, &region.limits)
}
