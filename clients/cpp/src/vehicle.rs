//! What a server says of a vehicle.

use std::sync::mpsc::channel;
use std::time::Duration;

use wade_client::{Address, ClientError, ShmClient};
use wade_core::effects::Effect;
use wade_wire::proto;
use wade_wire::shm::Wait;

use crate::abi::{WADE_MAX_EFFECTS, WADE_MAX_SURFACES, WADE_NAME_SIZE, WadeRange, WadeSurface, WadeVehicle};
use crate::convert::write_text;
use crate::credentials::CredentialFiles;
use crate::worker::Worker;

/// Asks the server at an address, on a thread of its own: whoever calls is not to get a signal. Connecting has the timeout, and
/// the answer too.
pub fn get(
    address: Address,
    vehicle: String,
    credentials: CredentialFiles,
    timeout: Duration,
) -> Result<Box<WadeVehicle>, ClientError> {
    let (answer, answered) = channel();
    let failed = |reason: &str| ClientError::NoServer { at: address.to_string(), reason: reason.to_owned() };
    let at = address.clone();
    let ask = move || {
        let response = described(&at, &vehicle, &credentials, timeout);
        // nobody waits any more where it took too long
        let _ = answer.send(response.map(|response| Box::new(WadeVehicle::from(&response))));
    };
    let worker = Worker::spawn("wade-vehicle", ask).map_err(|error| failed(&error.to_string()))?;
    let asked = answered.recv().unwrap_or_else(|_| Err(failed("the thread that asked broke down")));
    worker.end();
    asked
}

fn described(
    address: &Address,
    vehicle: &str,
    credentials: &CredentialFiles,
    timeout: Duration,
) -> Result<proto::GetVehicleResponse, ClientError> {
    if let Address::Shm(namespace) = address {
        return ShmClient::new(vehicle, Wait::Block, timeout).in_namespace(namespace).vehicle();
    }
    let url = address.url().unwrap_or_default();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime =
        runtime.map_err(|error| ClientError::NoServer { at: url.clone(), reason: error.to_string() })?;
    let answer =
        runtime.block_on(async { credentials.connect(&url, vehicle, timeout).await?.vehicle().await });
    // a name that is being looked up is not waited for
    runtime.shutdown_background();
    answer
}

fn vector(vector: &Option<proto::Vector3>) -> [f32; 3] {
    vector.as_ref().map_or([0.0; 3], |v| [v.x, v.y, v.z])
}

impl From<&proto::GetVehicleResponse> for WadeVehicle {
    fn from(response: &proto::GetVehicleResponse) -> Self {
        let mut vehicle = Self {
            name: [0; WADE_NAME_SIZE],
            provenance: [0; WADE_NAME_SIZE],
            bundle_version: 0,
            surface_count: response.surfaces.len().min(WADE_MAX_SURFACES) as u32,
            effect_count: response.effects.len().min(WADE_MAX_EFFECTS) as u32,
            effects: [0; WADE_MAX_EFFECTS],
            length_m: response.length_m,
            width_m: response.width_m,
            height_m: response.height_m,
            z0_m: response.z0_m,
            mass_kg: response.mass_kg,
            center_of_mass_m: vector(&response.center_of_mass_m),
            inertia_kgm2: response.inertia_kgm2.as_slice().try_into().unwrap_or([0.0; 9]),
            domain: [WadeRange { minimum: f64::NEG_INFINITY, maximum: f64::INFINITY }; 8],
            surfaces: [WadeSurface::NONE; WADE_MAX_SURFACES],
        };
        if let Some(summary) = &response.summary {
            write_text(&mut vehicle.name, &summary.name);
            write_text(&mut vehicle.provenance, &summary.provenance);
            vehicle.bundle_version = summary.bundle_version;
        }
        for range in &response.domain {
            // the numbers of the wire begin at 1
            let place =
                usize::try_from(range.quantity - 1).ok().and_then(|place| vehicle.domain.get_mut(place));
            if let Some(place) = place {
                *place = WadeRange { minimum: range.minimum, maximum: range.maximum };
            }
        }
        for (place, effect) in vehicle.effects.iter_mut().zip(&response.effects) {
            *place = Effect::from_code(effect.effect as u32).map_or(0, Effect::code);
        }
        for (place, surface) in vehicle.surfaces.iter_mut().zip(&response.surfaces) {
            write_text(&mut place.name, &surface.name);
            write_text(&mut place.kind, &surface.kind);
            place.centroid_m = vector(&surface.centroid_m);
            place.normal = vector(&surface.normal);
            place.area_m2 = surface.area_m2;
        }
        vehicle
    }
}

impl WadeSurface {
    const NONE: Self = Self {
        name: [0; WADE_NAME_SIZE],
        kind: [0; 16],
        centroid_m: [0.0; 3],
        normal: [0.0; 3],
        area_m2: 0.0,
    };
}
