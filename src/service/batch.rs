//! A batch, on the thread that read it, turn by turn.

use std::sync::Arc;

use super::call::{Answered, Call, EVALUATOR, STATES_PER_TURN};
use wade_core::served::ServedVehicle;
use wade_wire::{Refusal, proto};

/// Answers a batch of at most `longest` states for this version of its vehicle.
pub(super) async fn batch(
    call: &Call<'_>,
    vehicle: Arc<ServedVehicle>,
    request: &proto::EvaluateBatchRequest,
    longest: usize,
) -> Result<(proto::EvaluateBatchResponse, Answered), Refusal> {
    let states = wade_wire::batch(request, &vehicle, longest)?;
    let with_surfaces = !request.omit_surfaces;
    let mut response = wade_wire::batch_response(&vehicle, states.len(), with_surfaces);
    for (turn, states) in states.chunks(STATES_PER_TURN).enumerate() {
        if turn > 0 {
            tokio::task::yield_now().await;
        }
        EVALUATOR.with_borrow_mut(|evaluator| {
            for (i, state) in states.iter().enumerate() {
                let index = turn * STATES_PER_TURN + i;
                call.check_deadline(Some(index))?;
                let checked = state.check_for(&vehicle);
                let checked = checked.map_err(|invalid| Refusal::Invalid { invalid, index: Some(index) })?;
                let evaluated = evaluator.evaluate(&vehicle, &checked, None);
                wade_wire::push(&mut response, &evaluated, index as u32, with_surfaces);
            }
            Ok::<(), Refusal>(())
        })?;
    }
    let mut outside: Vec<u32> = response.outside.iter().map(|outside| outside.index).collect();
    outside.dedup();
    let out_of_domain = outside.len() as u64;
    Ok((response, Answered { vehicle, out_of_domain }))
}
