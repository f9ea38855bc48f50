//! Which samples a model may be judged by: those that the report of its training lists as held out.

use super::EvaluateError;
use crate::dataset::split::{By, Split, split};
use crate::train::Source;
use crate::train::report::{DataFile, Record, fingerprint};
use wade_core::model::Weights;

/// Both sides of the split that weights were learnt with.
///
/// `source` must be the data set with the mirror images that the record's settings ask for.
pub fn of(record: &Record, file: &DataFile, source: &Source) -> Result<Split, EvaluateError> {
    if record.data.sha256 != file.sha256 {
        let sha256 = record.data.sha256.clone().unwrap_or_else(|| "none: generated".to_owned());
        let (file, learnt_from) = (file.name.clone(), record.data.name.clone());
        return Err(EvaluateError::OtherData { file, learnt_from, sha256 });
    }
    let split = if record.split.by_sample { by_sample(record, source)? } else { by_case(record, source)? };
    if split.held_out.is_empty() { Err(EvaluateError::NothingHeldOut) } else { Ok(split) }
}

/// Refuses weights that are not those of the record.
pub fn check_weights(record: &Record, vehicle: &str, weights: &Weights) -> Result<(), EvaluateError> {
    if fingerprint(&weights.network) == record.weights_sha256 {
        Ok(())
    } else {
        Err(EvaluateError::OtherWeights { vehicle: vehicle.to_owned() })
    }
}

fn by_case(record: &Record, source: &Source) -> Result<Split, EvaluateError> {
    let sides = &record.split;
    if let Some(case) = sides.training_cases.intersection(&sides.held_out_cases).next() {
        return Err(EvaluateError::TrainingCase { case: case.clone() });
    }
    let samples = &source.data.samples;
    let known = |case: &String| sides.training_cases.contains(case) || sides.held_out_cases.contains(case);
    if let Some(stranger) = samples.iter().find(|sample| !known(&sample.case)) {
        return Err(EvaluateError::UnknownCase { case: stranger.case.clone() });
    }
    let (held_out, training) =
        (0..samples.len()).partition(|&number| sides.held_out_cases.contains(&samples[number].case));
    Ok(Split { name: sides.name.clone(), training, held_out })
}

fn by_sample(record: &Record, source: &Source) -> Result<Split, EvaluateError> {
    let by = By::Sample { share: record.config.held_out_share };
    let splits = split(&source.data, by, record.config.seed).map_err(|_| EvaluateError::OtherSplit)?;
    let recorded = (record.split.training_samples, record.split.held_out_samples);
    let same = |split: &Split| (split.training.len(), split.held_out.len()) == recorded;
    splits.into_iter().find(same).ok_or(EvaluateError::OtherSplit)
}
