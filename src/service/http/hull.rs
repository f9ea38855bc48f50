//! The hull as triangles with the surface of each, for drawing.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Serialize;

use super::Shared;
use super::rejection::Rejection;
use wade_core::digest::sha256;
use wade_core::served::ServedVehicle;
use wade_wire::{Refusal, single};

/// Most triangles that are sent: about 10 MB of JSON.
const MAX_TRIANGLES: usize = 200_000;

/// Hulls that were written before, for the vehicles that are served.
#[derive(Debug, Default)]
struct Cache {
    hulls: Mutex<BTreeMap<String, Written>>,
}

#[derive(Debug, Clone)]
struct Written {
    /// Which version it is the hull of.
    vehicle: Weak<ServedVehicle>,
    text: Bytes,
    etag: String,
}

/// The path of this module.
pub fn routes() -> Router<Arc<Shared>> {
    let cache = Arc::new(Cache::default());
    let answer = move |State(shared): State<Arc<Shared>>, Path(name): Path<String>, headers: HeaderMap| {
        std::future::ready(hull(&cache, &shared, &name, &headers))
    };
    Router::new().route("/v1/vehicles/{name}/hull", get(answer))
}

fn hull(cache: &Cache, shared: &Shared, name: &str, headers: &HeaderMap) -> Result<Response, Rejection> {
    let vehicle = shared.grpc.engine.vehicle(name).map_err(Refusal::from)?;
    let Written { text, etag, .. } = cache.written(name, &vehicle)?;
    let known = headers.get(header::IF_NONE_MATCH).is_some_and(|value| value.as_bytes() == etag.as_bytes());
    let cached = [(header::ETAG, etag), (header::CACHE_CONTROL, "no-cache".into())];
    if known {
        return Ok((StatusCode::NOT_MODIFIED, cached).into_response());
    }
    Ok((cached, [(header::CONTENT_TYPE, "application/json")], text).into_response())
}

impl Cache {
    fn written(&self, name: &str, vehicle: &Arc<ServedVehicle>) -> Result<Written, Rejection> {
        let mut hulls = self.hulls.lock().unwrap_or_else(PoisonError::into_inner);
        let is_current = |written: &&Written| std::ptr::eq(written.vehicle.as_ptr(), Arc::as_ptr(vehicle));
        if let Some(written) = hulls.get(name).filter(is_current) {
            return Ok(written.clone());
        }
        let text = write(vehicle)?;
        let digest = sha256(&text);
        let written = Written {
            vehicle: Arc::downgrade(vehicle),
            text: text.into(),
            etag: format!("\"{}\"", &digest[..16]),
        };
        hulls.insert(name.to_owned(), written.clone());
        Ok(written)
    }
}

/// The hull in the body frame.
#[derive(Debug, Serialize)]
struct Hull<'v> {
    vehicle: &'v str,
    bundle_version: u32,
    /// [V, 3] corners, single precision [m].
    vertices_m: Vec<f32>,
    /// [T, 3] indices of corners, counter-clockwise from outside.
    triangles: Vec<u32>,
    /// [T] index of the surface of each triangle.
    triangle_surface: &'v [u16],
}

fn write(vehicle: &ServedVehicle) -> Result<Vec<u8>, Rejection> {
    let model = vehicle.model();
    let hull = &model.vehicle().hull;
    let triangles = hull.mesh.faces.len();
    if triangles > MAX_TRIANGLES {
        return Err(Rejection::HullTooLarge { triangles, limit: MAX_TRIANGLES });
    }
    let hull = Hull {
        vehicle: &model.vehicle().name,
        bundle_version: model.version(),
        vertices_m: hull.mesh.vertices.iter().flat_map(single).collect(),
        triangles: hull.mesh.faces.iter().flatten().copied().collect(),
        triangle_surface: &hull.face_surface,
    };
    Ok(serde_json::to_vec(&hull).expect("numbers are text"))
}
