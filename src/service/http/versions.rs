//! The versions of a vehicle side by side: those on disk, and batches that one of them answers.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use axum::Router;
use axum::body::Body;
use axum::extract::{Extension, Path, RawQuery, State};
use axum::response::Response;
use axum::routing::{get, post};
use serde::Serialize;

use super::query::{admit, read, whole};
use super::rejection::Rejection;
use super::{Shared, json};
use crate::metrics::{Resource, Transport};
use crate::service::accounts::{Computing, Connection};
use crate::service::batch::batch;
use crate::service::call::Call;
use wade_core::bundle::Kept;
use wade_core::served::ServedVehicle;
use wade_wire::{Refusal, proto};

/// Most states of a batch.
const LONGEST: usize = 4096;

/// Longest body of a batch [bytes]: every field of so many states.
const MAX_BATCH_BODY: usize = 2 << 20;

/// Most versions that are kept in memory beside those that are served.
const MOST: usize = 4;

/// Versions that were read before.
#[derive(Debug, Default)]
struct Cache {
    read: Mutex<BTreeMap<(String, u32), Arc<ServedVehicle>>>,
}

impl Cache {
    /// A version of a vehicle; the one that is served where it is that.
    async fn version(
        &self,
        shared: &Shared,
        name: &str,
        version: u32,
    ) -> Result<Arc<ServedVehicle>, Rejection> {
        let served = shared.grpc.engine.vehicle(name).map_err(Refusal::from)?;
        if served.model().version() == version {
            return Ok(served);
        }
        let key = (name.to_owned(), version);
        if let Some(known) = self.read.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(Arc::clone(known));
        }
        let (reloader, owned) = (Arc::clone(&shared.grpc.reloader), name.to_owned());
        let reading = tokio::task::spawn_blocking(move || reloader.version(&owned, version)).await;
        let none = |reason: String| Rejection::NoSuchVersion { version, reason };
        let vehicle =
            reading.map_err(|error| none(error.to_string()))?.map_err(|error| none(error.to_string()))?;
        let vehicle = Arc::new(vehicle);
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if read.len() >= MOST {
            read.clear();
        }
        read.insert(key, Arc::clone(&vehicle));
        Ok(vehicle)
    }
}

/// The paths of this module.
pub fn routes() -> Router<Arc<Shared>> {
    let cache = Arc::new(Cache::default());
    let answer = move |State(shared): State<Arc<Shared>>,
                       Extension(connection): Extension<Arc<Connection>>,
                       RawQuery(parameters): RawQuery,
                       body: Body| {
        let cache = Arc::clone(&cache);
        async move { evaluate(&cache, &shared, &connection, parameters.as_deref(), body).await }
    };
    Router::new().route("/v1/vehicles/{name}/versions", get(versions)).route("/v1/batch", post(answer))
}

/// Which version is asked: by default the one that is served.
fn asked(parameters: Option<&str>) -> Result<Option<u32>, Rejection> {
    let mut asked = None;
    for (name, value) in form_urlencoded::parse(parameters.unwrap_or_default().as_bytes()) {
        let number = if name == "version" { value.parse().ok() } else { None };
        let bad = || Rejection::Malformed {
            field: name.into_owned(),
            reason: "version=NUMBER is all there is".into(),
        };
        asked = Some(number.ok_or_else(bad)?);
    }
    Ok(asked)
}

#[derive(Debug, Serialize)]
struct Version {
    version: u32,
    served: bool,
    provenance: Option<String>,
    effects: Vec<&'static str>,
}

#[derive(Debug, Serialize)]
struct Versions {
    vehicle: String,
    versions: Vec<Version>,
}

async fn versions(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
) -> Result<Response, Rejection> {
    let served = shared.grpc.engine.vehicle(&name).map_err(Refusal::from)?.model().version();
    let (reloader, owned) = (Arc::clone(&shared.grpc.reloader), name.clone());
    let reading = tokio::task::spawn_blocking(move || reloader.versions(&owned)).await;
    let version = |kept: Kept| Version {
        version: kept.version,
        served: kept.version == served,
        provenance: kept.weights.map(|(_, provenance)| provenance),
        effects: kept.effects,
    };
    // a vehicle that was read from elsewhere has its own version alone
    let mut versions: Vec<Version> = match reading {
        Ok(Ok((current, others))) => others.into_iter().chain([current]).map(version).collect(),
        _ => Vec::new(),
    };
    if versions.iter().all(|version| !version.served) {
        versions.push(Version { version: served, served: true, provenance: None, effects: Vec::new() });
    }
    versions.sort_by_key(|version| version.version);
    Ok(json::document(&Versions { vehicle: name, versions }))
}

/// The net wrench of each state.
#[derive(Debug, Serialize)]
struct Batch {
    vehicle: String,
    version: u32,
    provenance: String,
    force: Vec<[f32; 3]>,
    moment: Vec<[f32; 3]>,
    uncertainty: Uncertainty,
    in_domain: Vec<bool>,
    compute_ns: u64,
}

#[derive(Debug, Serialize)]
struct Uncertainty {
    force: Vec<[f32; 3]>,
    moment: Vec<[f32; 3]>,
}

async fn evaluate(
    cache: &Cache,
    shared: &Shared,
    connection: &Arc<Connection>,
    parameters: Option<&str>,
    body: Body,
) -> Result<Response, Rejection> {
    let version = asked(parameters)?;
    let text = whole(shared, body, MAX_BATCH_BODY).await?;
    let _computing = Computing::begin(connection);
    let call = Call::arriving(&shared.grpc, Transport::http, None);
    let mut request: proto::EvaluateBatchRequest = read(shared, "wade.v1.EvaluateBatchRequest", &text)?;
    request.omit_surfaces = true;
    let _place = admit(shared, connection, Resource::batches)?;
    let vehicle = match version {
        Some(version) => cache.version(shared, &request.vehicle, version).await?,
        None => shared.grpc.engine.vehicle(&request.vehicle).map_err(Refusal::from)?,
    };
    let answer = batch(&call, vehicle, &request, LONGEST).await;
    let response = call.record(answer)?;
    let mut in_domain = vec![true; response.force_n.len() / 3];
    response.outside.iter().for_each(|outside| in_domain[outside.index as usize] = false);
    let rows = |values: &[f32]| values.as_chunks::<3>().0.to_vec();
    Ok(json::compact(&Batch {
        vehicle: request.vehicle,
        version: response.bundle_version,
        provenance: response.provenance,
        force: rows(&response.force_n),
        moment: rows(&response.moment_nm),
        uncertainty: Uncertainty {
            force: rows(&response.uncertainty_n),
            moment: rows(&response.moment_uncertainty_nm),
        },
        in_domain,
        compute_ns: response.compute_ns,
    }))
}
