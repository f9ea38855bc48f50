//! What is learnt from a sample: input rows, targets and loss. The epochs know none of these.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::anchored::loss::{AnchoredLoss, TARGETS, loss as anchored_loss};
use super::layers::Sizes;
use super::loss::{Batch, Counts, LossConfig, TargetScale, loss};
use super::samples::{Sample, SurfaceRow, sum};
use wade_core::features::{GLOBAL, INPUTS};
use wade_core::model::network::{MAX_WIDTH, OUTPUTS, Scaling};
use wade_core::vehicle::SurfaceKind;

/// The first of the three reference lengths, which are the last of the global features.
const DIMENSIONS: usize = GLOBAL - 3;
/// Places in a surface's row.
const NORMAL: std::ops::Range<usize> = 8..11;
const AREA: usize = 11;
const FRACTION: usize = 12;
const DEPTH: usize = 13;
const PROJECTED: usize = 14;

/// What a network of the paper is given and asked for. Only `Paper` can be served; the others are its ablations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// The paper's network as published: a row a surface, force over density of that surface.
    Paper,
    /// Without length, width and height among the global features.
    NoDimensions,
    /// All front surfaces of a vehicle as one plate, likewise all rear ones.
    MergedPlates,
    /// The global features alone, asked for the net force.
    GlobalOnly,
}

/// One sample as the layers take it: a row of inputs and targets a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Index of the vehicle.
    pub vehicle: usize,
    /// Row after row.
    pub inputs: Vec<f32>,
    /// Row after row.
    pub targets: Vec<f32>,
    /// True for the rows that count as dry.
    pub dry: Vec<bool>,
}

/// What is minimised.
#[derive(Debug, Clone, PartialEq)]
pub enum Objective {
    /// The paper's loss.
    Paper {
        /// Weights of its terms.
        config: LossConfig,
        /// Scale of the targets.
        scale: TargetScale<f32>,
    },
    /// That of the anchored network.
    Anchored(AnchoredLoss),
}

impl Objective {
    /// Numbers that a row's target has.
    pub fn targets(&self) -> usize {
        match self {
            Self::Paper { .. } => OUTPUTS,
            Self::Anchored(_) => TARGETS,
        }
    }

    /// The share of a part of a batch in the loss of the whole batch, which has `counts`; and its gradient by the outputs.
    pub fn loss(&self, batch: &Batch<f32>, counts: &Counts, output: &DMatrix<f32>) -> (f64, DMatrix<f32>) {
        match self {
            Self::Paper { config, scale } => {
                let (terms, gradient) = loss(config, scale, batch, counts, output);
                (terms.total(config), gradient)
            }
            Self::Anchored(config) => anchored_loss(config, batch, counts, output),
        }
    }

    /// The loss that sets the pace of the learning rate: that of validation, as in the paper. A network that is taught by a
    /// regression goes by its own: what held-out cases scatter is nothing that it could learn.
    pub fn pace(&self, training: f64, validation: f64) -> f64 {
        match self {
            Self::Paper { .. } => validation,
            Self::Anchored(_) => training,
        }
    }
}

impl Variant {
    /// The paper's ablations.
    pub const ABLATIONS: [Self; 3] = [Self::NoDimensions, Self::MergedPlates, Self::GlobalOnly];

    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::NoDimensions => "no_dimensions",
            Self::MergedPlates => "merged_plates",
            Self::GlobalOnly => "global_only",
        }
    }

    /// Inputs, width and outputs of the layers.
    pub fn sizes(self) -> Sizes {
        let inputs = match self {
            Self::Paper | Self::MergedPlates => INPUTS,
            Self::NoDimensions => INPUTS - (GLOBAL - DIMENSIONS),
            Self::GlobalOnly => GLOBAL,
        };
        Sizes { inputs, width: MAX_WIDTH, outputs: OUTPUTS }
    }

    /// The sample as this variant sees it: with merged surfaces, or with the net force on a single one.
    pub fn view(self, sample: &Sample) -> Sample {
        match self {
            Self::Paper | Self::NoDimensions => sample.clone(),
            Self::MergedPlates => merged(sample),
            Self::GlobalOnly => Sample {
                surfaces: vec![[0.0; INPUTS - GLOBAL]],
                targets: vec![sample.net_force_over_density()],
                fractions: vec![if sample.fractions.iter().any(|f| *f > 0.0) { 1.0 } else { 0.0 }],
                ..sample.clone()
            },
        }
    }

    /// Rows of a sample that `view` gave.
    pub fn rows(self, view: &Sample, scaling: &Scaling, dry_fraction: f32) -> Rows {
        let global = scaling.standardize(&view.global);
        let global = if self == Self::NoDimensions { &global[..DIMENSIONS] } else { &global[..] };
        let mut inputs = Vec::with_capacity(view.surfaces.len() * self.sizes().inputs);
        for surface in &view.surfaces {
            if self != Self::GlobalOnly {
                inputs.extend(surface);
            }
            inputs.extend(global);
        }
        Rows {
            vehicle: view.vehicle,
            inputs,
            targets: view.targets.iter().flat_map(|target| standardized(target, scaling)).collect(),
            dry: view.fractions.iter().map(|fraction| *fraction < dry_fraction).collect(),
        }
    }

    /// What the rows' inputs that stand for the global feature `index` are; `None` where it is left out.
    pub fn input_of_global(self, index: usize) -> Option<usize> {
        match self {
            Self::NoDimensions if index >= DIMENSIONS => None,
            Self::GlobalOnly => Some(index),
            _ => Some(INPUTS - GLOBAL + index),
        }
    }
}

fn standardized(target: &[f64; OUTPUTS], scaling: &Scaling) -> [f32; OUTPUTS] {
    std::array::from_fn(|c| (target[c] as f32 - scaling.target_mean[c]) / scaling.target_std[c])
}

/// Which surfaces become one: front with front, rear with rear; all others stay.
pub(crate) fn plates(surfaces: &[SurfaceRow]) -> Vec<Vec<usize>> {
    let mut plates: Vec<Vec<usize>> = Vec::new();
    for (index, row) in surfaces.iter().enumerate() {
        let kind = [SurfaceKind::Front, SurfaceKind::Rear].into_iter().find(|k| row[*k as usize] == 1.0);
        let partner =
            plates.iter_mut().find(|plate| kind.is_some_and(|k| surfaces[plate[0]][k as usize] == 1.0));
        match partner {
            Some(plate) => plate.push(index),
            None => plates.push(vec![index]),
        }
    }
    plates
}

fn merged(sample: &Sample) -> Sample {
    let plates = plates(&sample.surfaces);
    let rows: Vec<SurfaceRow> = plates.iter().map(|plate| plate_row(sample, plate)).collect();
    let targets = |plate: &Vec<usize>| sum(&plate.iter().map(|&s| sample.targets[s]).collect::<Vec<_>>());
    Sample {
        fractions: rows.iter().map(|row| row[FRACTION]).collect(),
        targets: plates.iter().map(targets).collect(),
        surfaces: rows,
        ..sample.clone()
    }
}

/// Means by area, the depth of the wet part by wet area; areas add up.
fn plate_row(sample: &Sample, plate: &[usize]) -> SurfaceRow {
    let [first] = plate else {
        let rows = || plate.iter().map(|&surface| &sample.surfaces[surface]);
        let area: f32 = rows().map(|row| row[AREA]).sum();
        let wet: f32 = rows().map(|row| row[AREA] * row[FRACTION]).sum();
        let mean = |i: usize| rows().map(|row| row[AREA] * row[i]).sum::<f32>() / area;
        let mut plate: SurfaceRow = std::array::from_fn(mean);
        let length = plate[NORMAL].iter().map(|n| n * n).sum::<f32>().sqrt();
        plate[NORMAL].iter_mut().for_each(|n| *n /= length.max(f32::MIN_POSITIVE));
        plate[AREA] = area;
        plate[PROJECTED] = rows().map(|row| row[PROJECTED]).sum();
        let depth: f32 = rows().map(|row| row[AREA] * row[FRACTION] * row[DEPTH]).sum();
        plate[DEPTH] = if wet > 0.0 { depth / wet } else { 0.0 };
        return plate;
    };
    sample.surfaces[*first]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn row(kind: SurfaceKind, area: f32, fraction: f32, depth: f32) -> SurfaceRow {
        let mut row = [0.0; INPUTS - GLOBAL];
        row[kind as usize] = 1.0;
        row[NORMAL.start] = 1.0;
        (row[AREA], row[FRACTION], row[DEPTH], row[PROJECTED]) = (area, fraction, depth, area);
        row
    }

    fn sample() -> Sample {
        Sample {
            vehicle: 0,
            density: 1000.0,
            global: std::array::from_fn(|i| i as f64),
            surfaces: vec![
                row(SurfaceKind::Front, 1.0, 1.0, 0.4),
                row(SurfaceKind::Side, 2.0, 0.5, 0.1),
                row(SurfaceKind::Front, 3.0, 0.5, 0.2),
            ],
            targets: vec![[1.0, 2.0, 3.0], [10.0, 20.0, 30.0], [100.0, 200.0, 300.0]],
            fractions: vec![1.0, 0.5, 0.5],
        }
    }

    #[test]
    fn the_husky_s_thirteen_surfaces_become_nine_as_in_the_paper_and_the_warthog_s_stay() {
        for (name, expected) in [("husky", [13, 9]), ("warthog", [10, 10])] {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles").join(name);
            let vehicle = wade_core::bundle::read_without_weights(&folder).unwrap().vehicle;
            let rows: Vec<_> = vehicle.surfaces.iter().map(|s| row(s.kind, 1.0, 1.0, 0.1)).collect();
            assert_eq!([rows.len(), plates(&rows).len()], expected, "{name}");
        }
    }

    #[test]
    fn plates_of_a_kind_become_one_with_means_by_area_as_worked_by_hand() {
        let merged = Variant::MergedPlates.view(&sample());
        assert_eq!(merged.targets, [[101.0, 202.0, 303.0], [10.0, 20.0, 30.0]]);
        let front = merged.surfaces[0];
        assert_eq!((front[AREA], front[FRACTION], front[PROJECTED]), (4.0, 0.625, 4.0));
        // wet areas 1.0 and 1.5
        assert!((front[DEPTH] - (0.4 + 1.5 * 0.2) / 2.5).abs() < 1e-6);
        assert_eq!(front[NORMAL], [1.0, 0.0, 0.0]);
        assert_eq!(merged.surfaces[1], sample().surfaces[1]);
    }

    #[test]
    fn rows_have_the_inputs_that_the_variant_says() {
        let scaling = Scaling {
            global_mean: [0.0; GLOBAL],
            global_std: [1.0; GLOBAL],
            target_mean: [0.0; OUTPUTS],
            target_std: [1.0; OUTPUTS],
        };
        for (variant, surfaces) in [
            (Variant::Paper, 3),
            (Variant::NoDimensions, 3),
            (Variant::MergedPlates, 2),
            (Variant::GlobalOnly, 1),
        ] {
            let rows = variant.rows(&variant.view(&sample()), &scaling, 0.01);
            assert_eq!(rows.inputs.len(), surfaces * variant.sizes().inputs, "{variant:?}");
            assert_eq!(rows.targets.len(), surfaces * OUTPUTS);
            for global in 0..GLOBAL {
                if let Some(input) = variant.input_of_global(global) {
                    assert_eq!(rows.inputs[input], global as f32, "{variant:?}");
                }
            }
        }
        let net = Variant::GlobalOnly.rows(&Variant::GlobalOnly.view(&sample()), &scaling, 0.01);
        assert_eq!(net.targets, [111.0, 222.0, 333.0]);
    }
}
