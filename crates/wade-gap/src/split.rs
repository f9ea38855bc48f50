//! Which trials take no part in naming, and how blocks are dealt into folds: both by what they excite.

use super::Config;
use super::design::Rows;
use super::features::of_bins;
use super::holdout::ENOUGH;
use super::series::Series;
use wade_learn::random::Random;

/// Trials of which [`ENOUGH`] can be spared.
const MANY: usize = 10;

/// Means that tell what is excited.
fn signature(bins: &[[f64; 9]]) -> [f64; 6] {
    let mean = |of: &dyn Fn(&[f64; 9]) -> f64| bins.iter().map(of).sum::<f64>() / bins.len().max(1) as f64;
    [
        mean(&|f| f[0]),
        mean(&|f| f[2]),
        mean(&|f| f[3]),
        mean(&|f| f[4]),
        mean(&|f| f[5].max(0.0)),
        mean(&|f| f[7].abs()),
    ]
}

/// Orders items so that neighbors excite the same: by the feature that stands out most, then by its size.
fn by_excitation(signatures: &[[f64; 6]]) -> Vec<(usize, usize)> {
    let count = signatures.len() as f64;
    let mean: [f64; 6] = std::array::from_fn(|f| signatures.iter().map(|s| s[f]).sum::<f64>() / count);
    let std: [f64; 6] = std::array::from_fn(|f| {
        let variance = signatures.iter().map(|s| (s[f] - mean[f]).powi(2)).sum::<f64>() / count;
        variance.sqrt().max(1e-9 + 1e-6 * mean[f].abs())
    });
    let score = |s: &[f64; 6], f: usize| (s[f] - mean[f]) / std[f];
    let mut order: Vec<(usize, usize)> = signatures
        .iter()
        .enumerate()
        .map(|(index, s)| {
            // depth is the base of all: it stands out only beyond the others
            let class = (0..6).max_by(|&a, &b| score(s, a).total_cmp(&score(s, b))).unwrap_or_default();
            (class, index)
        })
        .collect();
    order.sort_by(|a, b| {
        let value = |(class, index): &(usize, usize)| signatures[*index][*class];
        a.0.cmp(&b.0).then(value(a).total_cmp(&value(b))).then(a.1.cmp(&b.1))
    });
    order
}

/// Trials for naming and those kept back. A kind of excitation that fewer than three trials have stays with naming, and so do trials
/// in states that the model did not learn, where there are enough others. Trials that
/// repeat each other are kept back together, or what was named would be tested on what it was named by; a group that is more
/// than what is to be kept back stays with naming.
pub(super) fn hold_out(all: &[Series], repeats: &[Vec<String>], config: &Config) -> (Vec<usize>, Vec<usize>) {
    let signatures: Vec<[f64; 6]> = all.iter().map(|s| signature(&of_bins(s))).collect();
    let order = by_excitation(&signatures);
    // as many as an interval of the closure takes, where enough are left to name by
    let least = if all.len() >= MANY { ENOUGH } else { 1 };
    let wanted = ((all.len() as f64 * config.held_out).round() as usize).clamp(least, all.len() - 2);
    let together = |trial: usize| -> Vec<usize> {
        let name = |trial: usize| &all[trial].name;
        let groups: Vec<&Vec<String>> = repeats.iter().filter(|group| group.contains(name(trial))).collect();
        let is_one =
            |&other: &usize| other == trial || groups.iter().any(|group| group.contains(name(other)));
        (0..all.len()).filter(is_one).collect()
    };
    // where the model did not learn the states, what is kept back would try the model and not what was named
    let learnt =
        |trial: usize| 2 * all[trial].outside.iter().filter(|outside| **outside).count() < all[trial].t.len();
    let many_learnt = (0..all.len()).filter(|&trial| learnt(trial)).count() >= 2 * wanted;
    let may = |trial: usize| learnt(trial) || !many_learnt;
    let fits = |trial: usize| together(trial).len() <= wanted;
    let of_class = |class: usize| order.iter().filter(|(c, i)| *c == class && may(*i)).count();
    let sizes: Vec<usize> = (0..6).map(of_class).collect();
    let any =
        |keep: &dyn Fn(usize) -> bool| order.iter().map(|(_, i)| *i).filter(|&i| keep(i)).collect::<Vec<_>>();
    let free: Vec<usize> = order
        .iter()
        .filter(|(class, i)| sizes[*class] >= 3 && fits(*i) && may(*i))
        .map(|(_, i)| *i)
        .collect();
    let free = if free.len() > wanted { free } else { any(&|i| fits(i) && may(i)) };
    let free = if free.is_empty() { any(&fits) } else { free };
    let free = if free.is_empty() { any(&|_| true) } else { free };
    let stride = free.len() as f64 / wanted as f64;
    let start = Random::new(config.seed ^ 0x4e1d).unit();
    let mut held: Vec<usize> = Vec::new();
    for k in 0..wanted {
        let pick = free[((k as f64 + start) * stride) as usize % free.len()];
        let group = if fits(pick) { together(pick) } else { vec![pick] };
        if !held.contains(&pick) && held.len() + group.len() <= wanted {
            held.extend(group);
        }
    }
    held.sort_unstable();
    let naming = (0..all.len()).filter(|index| !held.contains(index)).collect();
    (naming, held)
}

/// Fold of each block.
pub(super) fn folds(all: &[Series], rows: &Rows, config: &Config) -> Vec<usize> {
    let features: Vec<Vec<[f64; 9]>> = all.iter().map(of_bins).collect();
    let signatures: Vec<[f64; 6]> = (0..rows.blocks)
        .map(|block| signature(&features[rows.block_trial[block]][rows.block_bins[block].clone()]))
        .collect();
    let mut fold = vec![0; rows.blocks];
    for (place, (_, block)) in by_excitation(&signatures).into_iter().enumerate() {
        fold[block] = place % config.folds;
    }
    fold
}
