//! The state of a training on disk, from which a run that was killed goes on with the same bits.

use std::fs;
use std::path::{Path, PathBuf};
use wade_core::at::At;

use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

use super::adam::{Adam, Plateau};
use super::fit::{Epoch, State};
use super::layers::{Layers, Sizes};
use crate::files::write_whole;

/// Why a checkpoint was refused. The message names the file.
pub type CheckpointError = At<Fault>;

/// What is wrong with a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Missing, unreadable, or no room to write.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not safetensors, cut off, or a tensor is missing.
    #[error("no checkpoint: {0}")]
    File(#[from] SafeTensorError),
    /// Meta data of another form.
    #[error("no checkpoint: metadata {0}")]
    Metadata(#[from] serde_json::Error),
    /// A tensor of another length.
    #[error("no checkpoint: tensor {name} has {found} numbers instead of {expected}")]
    Length {
        /// The tensor.
        name: &'static str,
        /// Numbers that it has.
        found: usize,
        /// Numbers that it must have.
        expected: usize,
    },
    /// Of another training.
    #[error(
        "belongs to a training with other data, another split or other settings: give another --checkpoint"
    )]
    OtherTask,
    /// There already, and not asked to go on.
    #[error("is there already: give --resume to go on from it, or remove it")]
    Exists,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Metadata {
    task: String,
    steps: i32,
    patience: u32,
    waited: u32,
    best_epoch: Option<u32>,
}

const KEY: &str = "wade.checkpoint";

/// Where checkpoints go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// Goes on from it; otherwise it must not be there yet.
    pub resume: bool,
}

impl Checkpoint {
    /// Removes it, if it was ever written.
    pub fn remove(&self) -> std::io::Result<()> {
        if self.path.exists() { fs::remove_file(&self.path) } else { Ok(()) }
    }

    /// The state to go on from, if any.
    pub(super) fn start(&self, sizes: Sizes, task: &str) -> Result<Option<State>, CheckpointError> {
        let at = At::path(&self.path);
        if self.resume {
            return read(&self.path, sizes, task).map(Some).map_err(at);
        }
        if self.path.exists() { Err(at(Fault::Exists)) } else { Ok(None) }
    }

    /// Replaces the file as a whole: a run that is killed leaves the one before or this one.
    pub(super) fn write(&self, state: &State, task: &str) -> Result<(), CheckpointError> {
        write(&self.path, state, task).map_err(At::path(&self.path))
    }
}

fn write(path: &Path, state: &State, task: &str) -> Result<(), Fault> {
    let singles = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let doubles = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let rows = state.history.iter().flat_map(|e| [e.training_loss, e.validation_loss, e.learning_rate]);
    let best = state.best.as_ref().map_or(&[][..], |(parameters, _)| parameters);
    let tensors = [
        ("parameters", Dtype::F32, singles(&state.layers.parameters)),
        ("mean", Dtype::F32, singles(&state.adam.mean)),
        ("square", Dtype::F32, singles(&state.adam.square)),
        ("best", Dtype::F32, singles(best)),
        ("plateau", Dtype::F64, doubles(&[state.plateau.rate, state.plateau.best])),
        ("history", Dtype::F64, doubles(&rows.collect::<Vec<_>>())),
    ];
    let metadata = Metadata {
        task: task.to_owned(),
        steps: state.adam.steps,
        patience: state.plateau.patience,
        waited: state.plateau.waited,
        best_epoch: state.best.as_ref().map(|(_, epoch)| *epoch),
    };
    let size = |dtype| if dtype == Dtype::F32 { 4 } else { 8 };
    let views = tensors
        .iter()
        .map(|(name, dtype, bytes)| {
            Ok((*name, TensorView::new(*dtype, vec![bytes.len() / size(*dtype)], bytes)?))
        })
        .collect::<Result<Vec<_>, SafeTensorError>>()?;
    // a map of the library's own choice, which depends on its features
    let metadata = [(KEY.to_owned(), serde_json::to_string(&metadata)?)].into_iter().collect();
    Ok(write_whole(path, &safetensors::serialize(views, Some(metadata))?)?)
}

fn read(path: &Path, sizes: Sizes, task: &str) -> Result<State, Fault> {
    let bytes = fs::read(path)?;
    let tensors = SafeTensors::deserialize(&bytes)?;
    let (_, header) = SafeTensors::read_metadata(&bytes)?;
    let text = header.metadata().as_ref().and_then(|map| map.get(KEY)).map_or("", String::as_str);
    let metadata: Metadata = serde_json::from_str(text)?;
    if metadata.task != task {
        return Err(Fault::OtherTask);
    }
    let single = |name: &'static str| -> Result<Vec<f32>, Fault> {
        let chunks = tensors.tensor(name)?.data().as_chunks::<4>().0;
        Ok(chunks.iter().map(|chunk| f32::from_le_bytes(*chunk)).collect())
    };
    let double = |name: &'static str| -> Result<Vec<f64>, Fault> {
        let chunks = tensors.tensor(name)?.data().as_chunks::<8>().0;
        Ok(chunks.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect())
    };
    let weights = |name: &'static str| -> Result<Vec<f32>, Fault> {
        let (values, expected) = (single(name)?, sizes.parameters());
        let found = values.len();
        if found == expected { Ok(values) } else { Err(Fault::Length { name, found, expected }) }
    };
    let plateau = double("plateau")?;
    let &[rate, best] = plateau.as_slice() else {
        return Err(Fault::Length { name: "plateau", found: plateau.len(), expected: 2 });
    };
    let best_weights =
        metadata.best_epoch.map(|epoch| Ok::<_, Fault>((weights("best")?, epoch))).transpose()?;
    let epoch = |(index, row): (usize, &[f64; 3])| Epoch {
        number: index as u32 + 1,
        training_loss: row[0],
        validation_loss: row[1],
        learning_rate: row[2],
    };
    Ok(State {
        layers: Layers { sizes, parameters: weights("parameters")? },
        adam: Adam { steps: metadata.steps, mean: weights("mean")?, square: weights("square")? },
        plateau: Plateau { rate, patience: metadata.patience, best, waited: metadata.waited },
        history: double("history")?.as_chunks::<3>().0.iter().enumerate().map(epoch).collect(),
        best: best_weights,
    })
}
