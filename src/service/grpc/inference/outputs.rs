//! The answer to a batch as tensors.

use std::mem::take;

use super::inputs::short;
use wade_core::domain::Quantity;
use wade_core::effects::{BoxQuantity, Effect};
use wade_core::model::COLUMNS;
use wade_core::served::ServedVehicle;
use wade_wire::TensorFault;
use wade_wire::proto;
use wade_wire::proto::inference::model_infer_request::InferRequestedOutputTensor;
use wade_wire::proto::inference::{InferTensorContents, model_infer_response::InferOutputTensor};

/// An output, by the name of the array of the answer to a batch; `in_domain` and `outside` are by state here, and `outside`
/// and `effects_outside` hold 0 for what is not outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    Force,
    Moment,
    Uncertainty,
    InDomain,
    Outside,
    SurfaceForce,
    SurfacePoint,
    WettedFraction,
    EffectForce,
    EffectMoment,
    EffectLeftOut,
    EffectSurfaceForce,
    EffectsOutside,
    AddedMass,
    Jacobian,
}

const ALL: [Output; 15] = [
    Output::Force,
    Output::Moment,
    Output::Uncertainty,
    Output::InDomain,
    Output::Outside,
    Output::SurfaceForce,
    Output::SurfacePoint,
    Output::WettedFraction,
    Output::EffectForce,
    Output::EffectMoment,
    Output::EffectLeftOut,
    Output::EffectSurfaceForce,
    Output::EffectsOutside,
    Output::AddedMass,
    Output::Jacobian,
];

impl Output {
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force_n",
            Self::Moment => "moment_nm",
            Self::Uncertainty => "uncertainty_n",
            Self::InDomain => "in_domain",
            Self::Outside => "outside",
            Self::SurfaceForce => "surface_force_n",
            Self::SurfacePoint => "surface_point_m",
            Self::WettedFraction => "wetted_fraction",
            Self::EffectForce => "effect_force_n",
            Self::EffectMoment => "effect_moment_nm",
            Self::EffectLeftOut => "effect_left_out",
            Self::EffectSurfaceForce => "effect_surface_force_n",
            Self::EffectsOutside => "effects_outside",
            Self::AddedMass => "added_mass",
            Self::Jacobian => "jacobian",
        }
    }

    pub fn datatype(self) -> &'static str {
        match self {
            Self::InDomain => "BOOL",
            Self::EffectLeftOut => "INT32",
            _ => "FP32",
        }
    }

    /// The array of a surface, which a batch can leave out.
    fn is_of_surfaces(self) -> bool {
        matches!(
            self,
            Self::SurfaceForce | Self::SurfacePoint | Self::WettedFraction | Self::EffectSurfaceForce
        )
    }

    /// The dimensions of a state.
    fn dimensions(self, surfaces: i64, effects: i64) -> Vec<i64> {
        match self {
            Self::Force | Self::Moment | Self::Uncertainty => vec![3],
            Self::InDomain => vec![],
            Self::Outside => vec![Quantity::ALL.len() as i64],
            Self::SurfaceForce | Self::SurfacePoint | Self::EffectSurfaceForce => vec![surfaces, 3],
            Self::WettedFraction => vec![surfaces],
            Self::EffectForce | Self::EffectMoment => vec![effects, 3],
            Self::EffectLeftOut => vec![effects],
            Self::EffectsOutside => vec![BoxQuantity::ALL.len() as i64],
            Self::AddedMass => vec![6, 6],
            Self::Jacobian => vec![6, COLUMNS as i64],
        }
    }
}

/// The outputs of a vehicle, with the shape of each for so many states; the derivatives where they are asked for.
pub fn of(vehicle: &ServedVehicle, rows: i64, jacobian: bool) -> impl Iterator<Item = (Output, Vec<i64>)> {
    let surfaces = vehicle.model().vehicle().surfaces.len() as i64;
    let effects = vehicle.effects().map_or(&[][..], |file| &file.effects);
    let count = effects.len() as i64;
    let has_base = vehicle.model().base().is_some();
    let has_added_mass = has_base || effects.iter().any(|effect| effect.effect() == Effect::AddedMass);
    let there = move |output: &Output| match output {
        Output::EffectForce
        | Output::EffectMoment
        | Output::EffectLeftOut
        | Output::EffectSurfaceForce
        | Output::EffectsOutside => count > 0,
        Output::AddedMass => has_added_mass,
        Output::Jacobian => jacobian,
        _ => true,
    };
    let shape = move |output: Output| {
        let dimensions = output.dimensions(surfaces, count);
        (output, std::iter::once(rows).chain(dimensions).collect())
    };
    ALL.into_iter().filter(there).map(shape)
}

/// Those of a vehicle that a request asks for: all where it names none.
pub fn requested(
    vehicle: &ServedVehicle,
    requested: &[InferRequestedOutputTensor],
    (rows, jacobian): (i64, bool),
) -> Result<Vec<(Output, Vec<i64>)>, TensorFault> {
    let all: Vec<_> = of(vehicle, rows, jacobian).collect();
    if requested.is_empty() {
        return Ok(all);
    }
    let mut chosen: Vec<(Output, Vec<i64>)> = Vec::new();
    for InferRequestedOutputTensor { name, parameters } in requested {
        let known = || all.iter().map(|(output, _)| output.name()).collect::<Vec<_>>().join(", ");
        let found = all.iter().find(|(output, _)| output.name() == name);
        let found = found.ok_or_else(|| TensorFault::Unknown { name: short(name), known: known() })?;
        if let Some(parameter) = parameters.keys().next() {
            return Err(TensorFault::Parameter { name: short(parameter), known: "none" });
        }
        if chosen.iter().any(|(output, _)| *output == found.0) {
            return Err(TensorFault::Repeated { name: short(name) });
        }
        chosen.push(found.clone());
    }
    Ok(chosen)
}

/// Whether any of them needs the arrays of the surfaces.
pub fn need_surfaces(outputs: &[(Output, Vec<i64>)]) -> bool {
    outputs.iter().any(|(output, _)| output.is_of_surfaces())
}

/// The values of a tensor.
enum Values {
    Fp32(Vec<f32>),
    Int32(Vec<i32>),
    Bool(Vec<bool>),
}

impl Values {
    fn raw(&self) -> Vec<u8> {
        match self {
            Self::Fp32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::Int32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::Bool(values) => values.iter().map(|&value| u8::from(value)).collect(),
        }
    }

    fn typed(self) -> InferTensorContents {
        let mut contents = InferTensorContents::default();
        match self {
            Self::Fp32(values) => contents.fp32_contents = values,
            Self::Int32(values) => contents.int_contents = values,
            Self::Bool(values) => contents.bool_contents = values,
        }
        contents
    }
}

/// The tensors and, where `raw`, their contents apart.
pub fn tensors(
    outputs: Vec<(Output, Vec<i64>)>,
    answer: &mut proto::EvaluateBatchResponse,
    raw: bool,
) -> (Vec<InferOutputTensor>, Vec<Vec<u8>>) {
    let mut contents = Vec::new();
    let tensors = outputs.into_iter().map(|(output, shape)| {
        let values = values(output, answer, shape[0] as usize);
        let mut tensor = InferOutputTensor {
            name: output.name().into(),
            datatype: output.datatype().into(),
            shape,
            ..Default::default()
        };
        if raw {
            contents.push(values.raw());
        } else {
            tensor.contents = Some(values.typed());
        }
        tensor
    });
    let tensors = tensors.collect();
    (tensors, contents)
}

/// Takes them out of the answer.
fn values(output: Output, answer: &mut proto::EvaluateBatchResponse, rows: usize) -> Values {
    Values::Fp32(match output {
        Output::Force => take(&mut answer.force_n),
        Output::Moment => take(&mut answer.moment_nm),
        Output::Uncertainty => take(&mut answer.uncertainty_n),
        Output::SurfaceForce => take(&mut answer.surface_force_n),
        Output::SurfacePoint => take(&mut answer.surface_point_m),
        Output::WettedFraction => take(&mut answer.wetted_fraction),
        Output::EffectForce => take(&mut answer.effect_force_n),
        Output::EffectMoment => take(&mut answer.effect_moment_nm),
        Output::EffectSurfaceForce => take(&mut answer.effect_surface_force_n),
        Output::AddedMass => take(&mut answer.added_mass),
        Output::Jacobian => take(&mut answer.jacobian),
        Output::EffectLeftOut => return Values::Int32(take(&mut answer.effect_left_out)),
        Output::InDomain => {
            let mut inside = vec![true; rows];
            answer.outside.iter().for_each(|outside| inside[outside.index as usize] = false);
            return Values::Bool(inside);
        }
        Output::Outside => {
            let entries = answer.outside.iter().map(|o| (o.index, o.quantity, o.excess));
            by_state(rows, Quantity::ALL.len(), entries)
        }
        Output::EffectsOutside => {
            let entries = answer.effects_outside.iter().map(|o| (o.index, o.quantity, o.excess));
            by_state(rows, BoxQuantity::ALL.len(), entries)
        }
    })
}

/// Entries of state, quantity and value as a table; the quantities count from 1.
fn by_state(rows: usize, width: usize, entries: impl Iterator<Item = (u32, i32, f32)>) -> Vec<f32> {
    let mut table = vec![0.0; rows * width];
    for (index, quantity, value) in entries {
        table[index as usize * width + quantity as usize - 1] = value;
    }
    table
}
