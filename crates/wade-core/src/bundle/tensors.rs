//! The safetensors files. All metadata of a file is one JSON text under the key `wade`, so that the same content is
//! always the same bytes.

use nalgebra::Matrix6;
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::anchor::{self, COORDINATES, GLOBAL, Remainder};
use crate::condition::GroundContact;
use crate::features::{GLOBAL_NAMES, SURFACE_NAMES};
use crate::frame::Vec3;
use crate::geometry::distance::{GridError, SignedDistanceGrid};
use crate::geometry::submergence::Samples;
use crate::model::network::{Network, OUTPUTS, Scaling, WIDTHS};
use crate::model::{Anchored, Form, Paper, SPREAD, Weights};
use crate::physics::radiation::{NODES, Node, POLES, Pole, Radiation, RadiationError};

/// No weight or statistic is larger: with 256 inputs a layer and bounded states, every sum then stays finite.
const LARGEST: f32 = 1e6;
/// No standard deviation is smaller.
const LEAST_DEVIATION: f32 = 1e-9;

/// What is wrong with a tensor file.
#[derive(Debug, thiserror::Error)]
pub enum TensorError {
    /// Not safetensors, or a tensor is missing.
    #[error("not sound safetensors: {0}")]
    File(#[from] SafeTensorError),
    /// The metadata is missing.
    #[error("no metadata under the key \"wade\"")]
    NoMetadata,
    /// The metadata is not what it should be.
    #[error("metadata: {0}")]
    Metadata(#[from] serde_json::Error),
    /// Another type or shape.
    #[error("tensor {name} is {found}, expected {expected}")]
    Shape {
        /// The tensor.
        name: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// A NaN or an infinity.
    #[error("tensor {name} holds a number that is not finite, the first at {index}")]
    NotFinite {
        /// The tensor.
        name: &'static str,
        /// Index of the number.
        index: usize,
    },
    /// Hidden layers of a width that there is no kernel for.
    #[error("the hidden layers have {found} units, expected one of {WIDTHS:?}")]
    Width {
        /// Units of the first one.
        found: usize,
    },
    /// A number so large that products with it would not stay finite.
    #[error("tensor {name} holds a number beyond {LARGEST} at {index}")]
    TooLarge {
        /// The tensor.
        name: &'static str,
        /// Index of the number.
        index: usize,
    },
    /// A standard deviation of zero or below, or too small to divide by.
    #[error("tensor {name} holds a standard deviation below {LEAST_DEVIATION} at {index}")]
    NotPositive {
        /// The tensor.
        name: &'static str,
        /// Index of the number.
        index: usize,
    },
    /// Weights for other inputs.
    #[error("the weights were trained on other features: {found}")]
    Features {
        /// The names in the file.
        found: String,
    },
    /// Weights for a remainder of something else.
    #[error("the weights are a remainder of {found}, not of {expected}: train them again", expected = [Remainder::OfPhysics, Remainder::OfDrag].map(Remainder::name).join(" or of "))]
    Base {
        /// What the file says.
        found: String,
    },
    /// The paper's weights without the convention that they have baked in.
    #[error("metadata: the paper's weights must state their ground_contact")]
    NoGroundContact,
    /// No training case, from which no distance can be told.
    #[error("tensor cases has no row")]
    NoCases,
    /// A table of waves that no hull has.
    #[error("{0}")]
    Radiation(#[from] RadiationError),
    /// A grid that is none.
    #[error("{0}")]
    Grid(#[from] GridError),
}

/// What the weights' file says of itself.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WeightsMetadata {
    kind: Kind,
    global_features: Vec<String>,
    surface_features: Vec<String>,
    provenance: String,
    /// Of weights that have a convention baked in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ground_contact: Option<GroundContact>,
    /// Of weights that answer a remainder: [`Remainder::name`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    base: Option<String>,
}

/// Kinds of model.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    /// The paper's network as published.
    Paper,
    /// What is known of the physics, and a learned remainder.
    Anchored,
}

impl Kind {
    /// The static features, then those that change with the state.
    fn surface_features(self) -> Vec<String> {
        let names = match self {
            Self::Paper => SURFACE_NAMES.to_vec(),
            Self::Anchored => [&anchor::STATIC_NAMES[..], &anchor::DYNAMIC_NAMES[..]].concat(),
        };
        names.into_iter().map(str::to_owned).collect()
    }

    fn outputs(self) -> usize {
        match self {
            Self::Paper => OUTPUTS,
            Self::Anchored => SPREAD + 1,
        }
    }
}

/// What the file of added mass and waves says of itself.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RadiationMetadata {
    source: String,
    bed_reach_m: f64,
    frequency_radps: f64,
    /// Natural frequency [rad/s] and damping ratio of each oscillator.
    poles: [[f64; 2]; POLES],
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GridMetadata {
    origin_m: [f64; 3],
    spacing_m: f64,
    /// Metres per step of the stored integers.
    step_m: f64,
}

struct File<'a> {
    tensors: SafeTensors<'a>,
}

impl<'a> File<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self, TensorError> {
        Ok(Self { tensors: SafeTensors::deserialize(bytes)? })
    }

    fn view(
        &self,
        name: &'static str,
        dtype: Dtype,
        shape: &[Option<usize>],
    ) -> Result<TensorView<'a>, TensorError> {
        let view = self.tensors.tensor(name)?;
        let fits = view.shape().len() == shape.len()
            && view.shape().iter().zip(shape).all(|(have, want)| want.is_none_or(|want| want == *have));
        if view.dtype() == dtype && fits {
            return Ok(view);
        }
        let found = format!("{:?} {:?}", view.dtype(), view.shape());
        let sizes: Vec<String> =
            shape.iter().map(|n| n.map_or_else(|| "any".into(), |n| n.to_string())).collect();
        Err(TensorError::Shape { name, found, expected: format!("{dtype:?} [{}]", sizes.join(", ")) })
    }

    fn floats(&self, name: &'static str, shape: &[Option<usize>]) -> Result<Vec<f32>, TensorError> {
        let view = self.view(name, Dtype::F32, shape)?;
        let values: Vec<f32> = numbers(view.data(), f32::from_le_bytes);
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(TensorError::NotFinite { name, index });
        }
        match values.iter().position(|value| value.abs() > LARGEST) {
            Some(index) => Err(TensorError::TooLarge { name, index }),
            None => Ok(values),
        }
    }

    fn array<const N: usize>(&self, name: &'static str) -> Result<[f32; N], TensorError> {
        Ok(array(&self.floats(name, &[Some(N)])?))
    }

    fn deviations(&self, name: &'static str, count: usize) -> Result<Vec<f32>, TensorError> {
        let values = self.floats(name, &[Some(count)])?;
        match values.iter().position(|&value| value < LEAST_DEVIATION) {
            Some(index) => Err(TensorError::NotPositive { name, index }),
            None => Ok(values),
        }
    }
}

fn metadata<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, TensorError> {
    let (_, header) = SafeTensors::read_metadata(bytes)?;
    let text = header.metadata().as_ref().and_then(|map| map.get("wade")).ok_or(TensorError::NoMetadata)?;
    Ok(serde_json::from_str(text)?)
}

fn numbers<T, const SIZE: usize>(bytes: &[u8], from: fn([u8; SIZE]) -> T) -> Vec<T> {
    bytes.as_chunks::<SIZE>().0.iter().map(|chunk| from(*chunk)).collect()
}

fn write(
    tensors: &[(&'static str, Dtype, Vec<usize>, Vec<u8>)],
    metadata: Option<&impl Serialize>,
) -> Vec<u8> {
    let views = tensors.iter().map(|(name, dtype, shape, bytes)| {
        let view = TensorView::new(*dtype, shape.clone(), bytes).expect("the shape is that of the data");
        (*name, view)
    });
    let metadata = metadata.map(|metadata| {
        let text = serde_json::to_string(metadata).expect("plain structs are always JSON");
        // a map of the library's own choice, which depends on its features
        [("wade".to_owned(), text)].into_iter().collect()
    });
    safetensors::serialize(views, metadata).expect("names are unique and views are sound")
}

fn bytes_of<T: Copy, const SIZE: usize>(values: &[T], to: fn(T) -> [u8; SIZE]) -> Vec<u8> {
    values.iter().flat_map(|&value| to(value)).collect()
}

fn floats(
    name: &'static str,
    shape: Vec<usize>,
    values: &[f32],
) -> (&'static str, Dtype, Vec<usize>, Vec<u8>) {
    (name, Dtype::F32, shape, bytes_of(values, f32::to_le_bytes))
}

pub fn read_patches(bytes: &[u8]) -> Result<Vec<u16>, TensorError> {
    let file = File::new(bytes)?;
    Ok(numbers(file.view("face_surface", Dtype::U16, &[None])?.data(), u16::from_le_bytes))
}

pub fn write_patches(face_surface: &[u16]) -> Vec<u8> {
    let bytes = bytes_of(face_surface, u16::to_le_bytes);
    write(&[("face_surface", Dtype::U16, vec![face_surface.len()], bytes)], None::<&()>)
}

/// Samples as they are stored.
pub struct SampleParts {
    pub points: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub offsets: Vec<usize>,
}

pub fn read_samples(bytes: &[u8]) -> Result<SampleParts, TensorError> {
    let file = File::new(bytes)?;
    let vectors =
        |name| Ok::<_, TensorError>(file.floats(name, &[None, Some(3)])?.as_chunks::<3>().0.to_vec());
    let offsets = numbers(file.view("offsets", Dtype::U32, &[None])?.data(), u32::from_le_bytes);
    Ok(SampleParts {
        points: vectors("points")?,
        normals: vectors("normals")?,
        offsets: offsets.into_iter().map(|offset| offset as usize).collect(),
    })
}

pub fn write_samples(samples: &Samples) -> Vec<u8> {
    let (points, normals) = (samples.points(), samples.normals());
    let offsets: Vec<u32> = samples.offsets().into_iter().map(|offset| offset as u32).collect();
    let tensors = [
        floats("points", vec![points.len(), 3], points.as_flattened()),
        floats("normals", vec![normals.len(), 3], normals.as_flattened()),
        ("offsets", Dtype::U32, vec![offsets.len()], bytes_of(&offsets, u32::to_le_bytes)),
    ];
    write(&tensors, None::<&()>)
}

pub fn read_distance(bytes: &[u8]) -> Result<SignedDistanceGrid, TensorError> {
    let file = File::new(bytes)?;
    let meta: GridMetadata = metadata(bytes)?;
    let view = file.view("distance", Dtype::I16, &[None, None, None])?;
    let steps = numbers(view.data(), i16::from_le_bytes);
    let values = steps.into_iter().map(|step| (f64::from(step) * meta.step_m) as f32).collect();
    let shape = std::array::from_fn(|i| view.shape()[i]);
    Ok(SignedDistanceGrid::from_parts(Vec3::from(meta.origin_m), meta.spacing_m, shape, values)?)
}

/// Sixteen bits a point: the rounding, at most half a step, is far below what the grid itself resolves.
pub fn write_distance(grid: &SignedDistanceGrid) -> Vec<u8> {
    let largest = grid.values.iter().fold(0.0_f32, |largest, value| largest.max(value.abs()));
    let step_m = f64::from(largest.max(f32::MIN_POSITIVE)) / f64::from(i16::MAX);
    let steps: Vec<i16> =
        grid.values.iter().map(|value| (f64::from(*value) / step_m).round() as i16).collect();
    let meta = GridMetadata { origin_m: grid.origin.into(), spacing_m: grid.spacing, step_m };
    let tensor = ("distance", Dtype::I16, grid.shape.to_vec(), bytes_of(&steps, i16::to_le_bytes));
    write(&[tensor], Some(&meta))
}

/// Tables of matrices, a matrix each row: mass, then one gain each oscillator.
const RADIATION_TABLES: [&str; 2] = ["deep", "standing"];

pub fn read_radiation(bytes: &[u8]) -> Result<Radiation, TensorError> {
    let file = File::new(bytes)?;
    let meta: RadiationMetadata = metadata(bytes)?;
    let table = |name: &'static str| {
        let shape = [Some(NODES), Some(1 + POLES), Some(36)];
        let values: Vec<f64> = numbers(file.view(name, Dtype::F64, &shape)?.data(), f64::from_le_bytes);
        let sound = |value: &f64| value.is_finite() && value.abs() <= LARGEST.into();
        if let Some(index) = values.iter().position(|value| !sound(value)) {
            return Err(TensorError::NotFinite { name, index });
        }
        let matrices: Vec<_> =
            values.as_chunks::<36>().0.iter().map(|m| Matrix6::from_row_slice(m)).collect();
        let row = |row: &[Matrix6<f64>]| Node { mass: row[0], gains: std::array::from_fn(|m| row[1 + m]) };
        Ok(matrices.chunks_exact(1 + POLES).map(row).collect::<Vec<_>>())
    };
    let radiation = Radiation {
        deep: table(RADIATION_TABLES[0])?,
        standing: table(RADIATION_TABLES[1])?,
        source: meta.source,
        bed_reach: meta.bed_reach_m,
        frequency: meta.frequency_radps,
        poles: meta.poles.map(|[frequency, damping]| Pole { frequency, damping }),
    };
    Ok(radiation.checked()?)
}

pub fn write_radiation(radiation: &Radiation) -> Vec<u8> {
    let meta = RadiationMetadata {
        source: radiation.source.clone(),
        bed_reach_m: radiation.bed_reach,
        frequency_radps: radiation.frequency,
        poles: radiation.poles.map(|pole| [pole.frequency, pole.damping]),
    };
    let table = |name: &'static str, rows: &[Node]| {
        let matrices = rows.iter().flat_map(|row| std::iter::once(&row.mass).chain(&row.gains));
        let values: Vec<f64> =
            matrices.flat_map(|m| m.transpose().iter().copied().collect::<Vec<_>>()).collect();
        (name, Dtype::F64, vec![rows.len(), 1 + POLES, 36], bytes_of(&values, f64::to_le_bytes))
    };
    let tables =
        [table(RADIATION_TABLES[0], &radiation.deep), table(RADIATION_TABLES[1], &radiation.standing)];
    write(&tables, Some(&meta))
}

pub fn read_weights(bytes: &[u8]) -> Result<Weights, TensorError> {
    let file = File::new(bytes)?;
    let meta: WeightsMetadata = metadata(bytes)?;
    let kind = meta.kind;
    let remainder = remainder(kind, meta.base.as_deref())?;
    let (of_state, of_surface) = (global_features(remainder), kind.surface_features());
    if meta.global_features != of_state || meta.surface_features != of_surface {
        let found = [meta.surface_features, meta.global_features].concat().join(" ");
        return Err(TensorError::Features { found });
    }
    let network = read_network(&file, of_surface.len() + of_state.len(), kind.outputs())?;
    let form = match kind {
        Kind::Paper => Form::Paper(Paper {
            scaling: Scaling {
                global_mean: file.array("global_mean")?,
                global_std: array(&file.deviations("global_std", GLOBAL_NAMES.len())?),
                target_mean: file.array("target_mean")?,
                target_std: array(&file.deviations("target_std", OUTPUTS)?),
            },
            ground_contact: meta.ground_contact.ok_or(TensorError::NoGroundContact)?,
            held_out_rms: file.array::<OUTPUTS>("held_out_rms")?.map(f64::from),
        }),
        Kind::Anchored => {
            let remainder = remainder.expect("anchored weights are a remainder");
            Form::Anchored(Box::new(read_anchored(&file, remainder)?))
        }
    };
    Ok(Weights { network, form, provenance: meta.provenance })
}

/// What weights of a kind whose file states such a base answer a remainder of; nothing of the paper's.
fn remainder(kind: Kind, base: Option<&str>) -> Result<Option<Remainder>, TensorError> {
    let known = base.and_then(Remainder::from_name);
    let fits = match kind {
        Kind::Paper => base.is_none(),
        Kind::Anchored => known.is_some(),
    };
    let found = || base.unwrap_or("an earlier drag").to_owned();
    if fits { Ok(known) } else { Err(TensorError::Base { found: found() }) }
}

fn global_features(remainder: Option<Remainder>) -> Vec<String> {
    let names = remainder.map_or(&GLOBAL_NAMES[..], Remainder::global_names);
    names.iter().copied().map(str::to_owned).collect()
}

fn read_network(file: &File<'_>, inputs: usize, outputs: usize) -> Result<Network, TensorError> {
    let matrix = |name, rows, columns| file.floats(name, &[Some(rows), Some(columns)]);
    let bias = |name, rows| file.floats(name, &[Some(rows)]);
    let b1 = file.floats("b1", &[None])?;
    let width = b1.len();
    if !WIDTHS.contains(&width) {
        return Err(TensorError::Width { found: width });
    }
    Ok(Network {
        inputs,
        width,
        outputs,
        w1: matrix("w1", width, inputs)?,
        b1,
        w2: matrix("w2", width, width)?,
        b2: bias("b2", width)?,
        w3: matrix("w3", outputs, width)?,
        b3: bias("b3", outputs)?,
    })
}

fn read_anchored(file: &File<'_>, remainder: Remainder) -> Result<Anchored, TensorError> {
    let (inputs, apart) = (remainder.global_names().len(), remainder.coordinates());
    let cases = file.floats("cases", &[None, Some(apart)])?;
    let cases: Vec<[f32; COORDINATES]> = cases.chunks_exact(apart).map(|case| filled(case, 0.0)).collect();
    if cases.is_empty() {
        return Err(TensorError::NoCases);
    }
    let [near] = array(&file.deviations("near", 1)?);
    Ok(Anchored {
        remainder,
        global_mean: filled::<GLOBAL>(&file.floats("global_mean", &[Some(inputs)])?, 0.0),
        global_std: filled::<GLOBAL>(&file.deviations("global_std", inputs)?, 1.0),
        spread: array(&file.deviations("spread", 3)?),
        cases,
        coordinate_scale: filled(&file.deviations("coordinate_scale", apart)?, 1.0),
        near,
    })
}

/// Numbers that a file has, and `rest` for inputs and coordinates that its remainder does not have.
fn filled<const N: usize>(values: &[f32], rest: f32) -> [f32; N] {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(rest))
}

/// As many numbers as a shape that was checked has.
fn array<const N: usize>(values: &[f32]) -> [f32; N] {
    std::array::from_fn(|i| values[i])
}

pub fn write_weights(weights: &Weights) -> Vec<u8> {
    let mut tensors: Vec<_> = weights
        .network
        .tensors()
        .into_iter()
        .map(|(name, shape, values)| floats(name, shape, values))
        .collect();
    let vector = |name, values: &[f32]| floats(name, vec![values.len()], values);
    let (kind, remainder) = match &weights.form {
        Form::Paper(Paper { scaling, held_out_rms, .. }) => {
            tensors.extend([
                vector("global_mean", &scaling.global_mean),
                vector("global_std", &scaling.global_std),
                vector("target_mean", &scaling.target_mean),
                vector("target_std", &scaling.target_std),
                vector("held_out_rms", &held_out_rms.map(|rms| rms as f32)),
            ]);
            (Kind::Paper, None)
        }
        Form::Anchored(form) => {
            let (inputs, apart) = (form.remainder.global_names().len(), form.remainder.coordinates());
            let cases: Vec<f32> = form.cases.iter().flat_map(|case| case[..apart].iter().copied()).collect();
            tensors.extend([
                vector("global_mean", &form.global_mean[..inputs]),
                vector("global_std", &form.global_std[..inputs]),
                vector("spread", &form.spread),
                floats("cases", vec![form.cases.len(), apart], &cases),
                vector("coordinate_scale", &form.coordinate_scale[..apart]),
                vector("near", &[form.near]),
            ]);
            (Kind::Anchored, Some(form.remainder))
        }
    };
    let meta = WeightsMetadata {
        kind,
        global_features: global_features(remainder),
        surface_features: kind.surface_features(),
        provenance: weights.provenance.clone(),
        ground_contact: weights.ground_contact(),
        base: remainder.map(|remainder| remainder.name().to_owned()),
    };
    write(&tensors, Some(&meta))
}
