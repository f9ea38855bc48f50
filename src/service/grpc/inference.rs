//! The Open Inference Protocol: a vehicle as a model whose tensors are the arrays of a batch. The computation is the one
//! of `EvaluateBatch`, so that the bits are the same.

mod fault;
mod inputs;
mod outputs;

pub use fault::TensorFault;

use std::sync::Arc;

use tonic::{Request, Response, Status};

use super::handlers::{Answered, Call, Handlers, blocking};
use crate::engine::UnknownVehicle;
use crate::served::ServedVehicle;
use crate::service::admin::Reloader;
use crate::service::proto::inference::grpc_inference_service_server::GrpcInferenceService;
use crate::service::proto::inference::infer_parameter::ParameterChoice;
use crate::service::proto::inference::model_metadata_response::TensorMetadata;
use crate::service::proto::inference::repository_index_response::ModelIndex;
use crate::service::proto::inference::*;
use crate::service::wire::Refusal;
use inputs::{INPUTS, shape, short};

/// The state of a model that can be asked.
const READY: &str = "READY";

/// The handlers of `inference.GRPCInferenceService`.
#[derive(Debug)]
pub struct InferenceHandlers {
    pub(super) handlers: Handlers,
}

#[tonic::async_trait]
impl GrpcInferenceService for InferenceHandlers {
    async fn server_live(
        &self,
        _: Request<ServerLiveRequest>,
    ) -> Result<Response<ServerLiveResponse>, Status> {
        Ok(Response::new(ServerLiveResponse { live: true }))
    }

    async fn server_ready(
        &self,
        _: Request<ServerReadyRequest>,
    ) -> Result<Response<ServerReadyResponse>, Status> {
        Ok(Response::new(ServerReadyResponse { ready: self.is_ready() }))
    }

    async fn model_ready(
        &self,
        request: Request<ModelReadyRequest>,
    ) -> Result<Response<ModelReadyResponse>, Status> {
        let ModelReadyRequest { name, version } = request.get_ref();
        let ready = self.is_ready() && self.model(name, version).is_ok();
        Ok(Response::new(ModelReadyResponse { ready }))
    }

    async fn server_metadata(
        &self,
        _: Request<ServerMetadataRequest>,
    ) -> Result<Response<ServerMetadataResponse>, Status> {
        Ok(Response::new(ServerMetadataResponse {
            name: env!("CARGO_PKG_NAME").into(),
            version: env!("CARGO_PKG_VERSION").into(),
            extensions: vec!["model_repository".into()],
        }))
    }

    async fn model_metadata(
        &self,
        request: Request<ModelMetadataRequest>,
    ) -> Result<Response<ModelMetadataResponse>, Status> {
        let ModelMetadataRequest { name, version } = request.get_ref();
        let vehicle = self.model(name, version)?;
        Ok(Response::new(metadata(&vehicle)))
    }

    async fn model_infer(
        &self,
        request: Request<ModelInferRequest>,
    ) -> Result<Response<ModelInferResponse>, Status> {
        let Handlers { shared, names, requests, .. } = &self.handlers;
        let call = Call::begin(shared, names.infer, &request);
        let answer = match call.admit(requests) {
            Ok(_permit) => self.infer(&call, request.into_inner()).await,
            Err(refusal) => Err(refusal),
        };
        call.end(answer)
    }

    async fn repository_index(
        &self,
        request: Request<RepositoryIndexRequest>,
    ) -> Result<Response<RepositoryIndexResponse>, Status> {
        let RepositoryIndexRequest { repository_name, ready } = request.into_inner();
        one_repository(&repository_name)?;
        let reloader = Arc::clone(&self.handlers.shared.reloader);
        let names = blocking(move || reloader.names()).await?;
        let vehicles = self.handlers.shared.engine.vehicles();
        let models = names.into_iter().map(|name| index(vehicles.get(&name).map(Arc::as_ref), name));
        let models = models.filter(|model| !ready || model.state == READY).collect();
        Ok(Response::new(RepositoryIndexResponse { models }))
    }

    async fn repository_model_load(
        &self,
        request: Request<RepositoryModelLoadRequest>,
    ) -> Result<Response<RepositoryModelLoadResponse>, Status> {
        let RepositoryModelLoadRequest { repository_name, model_name, parameters } = request.into_inner();
        one_repository(&repository_name)?;
        only(parameters.keys(), "")?;
        let name = model_name.clone();
        let reloaded = self.administer(&model_name, move |reloader| reloader.reload(&name)).await?;
        let refusal = reloaded.into_iter().find_map(|reload| reload.refusal);
        refusal.map_or(Ok(Response::new(RepositoryModelLoadResponse {})), |refusal| {
            Err(Status::failed_precondition(refusal.to_string()))
        })
    }

    async fn repository_model_unload(
        &self,
        request: Request<RepositoryModelUnloadRequest>,
    ) -> Result<Response<RepositoryModelUnloadResponse>, Status> {
        let RepositoryModelUnloadRequest { repository_name, model_name, parameters } = request.into_inner();
        one_repository(&repository_name)?;
        only(parameters.keys(), "unload_dependents")?;
        let name = model_name.clone();
        self.administer(&model_name, move |reloader| reloader.unload(&name)).await?;
        Ok(Response::new(RepositoryModelUnloadResponse {}))
    }
}

impl InferenceHandlers {
    fn is_ready(&self) -> bool {
        !self.handlers.shared.engine.vehicles().is_empty() && !*self.handlers.stop.borrow()
    }

    /// A vehicle in this version; in the one that is served where none is named.
    fn model(&self, name: &str, version: &str) -> Result<Arc<ServedVehicle>, Refusal> {
        let vehicle = self.handlers.shared.engine.vehicle(name)?;
        let served = vehicle.model().version();
        if !version.is_empty() && version != served.to_string() {
            return Err(Refusal::UnknownVersion { vehicle: short(name), version: short(version), served });
        }
        Ok(vehicle)
    }

    async fn infer(
        &self,
        call: &Call<'_>,
        request: ModelInferRequest,
    ) -> Result<(ModelInferResponse, Answered), Refusal> {
        let vehicle = self.model(&request.model_name, &request.model_version)?;
        let mut batch = inputs::batch(&request, self.handlers.max_batch)?;
        let outputs = outputs::requested(&vehicle, &request.outputs, batch.depth_m.len() as i64)?;
        batch.omit_surfaces = !outputs::need_surfaces(&outputs);
        let (mut answer, answered) = self.handlers.batch_of(call, vehicle, &batch).await?;
        let parameters = [
            ("provenance", ParameterChoice::StringParam(std::mem::take(&mut answer.provenance))),
            ("compute_ns", ParameterChoice::Int64Param(answer.compute_ns as i64)),
        ];
        let parameter = |choice| InferParameter { parameter_choice: Some(choice) };
        let raw = !request.raw_input_contents.is_empty();
        let (outputs, raw_output_contents) = outputs::tensors(outputs, &mut answer, raw);
        let response = ModelInferResponse {
            model_name: request.model_name,
            model_version: answer.bundle_version.to_string(),
            id: request.id,
            parameters: parameters.map(|(name, choice)| (name.to_owned(), parameter(choice))).into(),
            outputs,
            raw_output_contents,
        };
        Ok((response, answered))
    }

    /// Reading and checking a bundle takes milliseconds, which must not stand before a query.
    async fn administer<T: Send + 'static>(
        &self,
        vehicle: &str,
        work: impl FnOnce(&Reloader) -> Result<T, UnknownVehicle> + Send + 'static,
    ) -> Result<T, Status> {
        if vehicle.is_empty() {
            // to the reloader an empty name is every vehicle
            self.model(vehicle, "")?;
        }
        let reloader = Arc::clone(&self.handlers.shared.reloader);
        Ok(blocking(move || work(&reloader)).await?.map_err(Refusal::from)?)
    }
}

/// There is one repository, without a name: the folder of the bundles.
fn one_repository(name: &str) -> Result<(), Refusal> {
    if name.is_empty() { Ok(()) } else { Err(Refusal::UnknownRepository { name: short(name) }) }
}

/// Refuses parameters beside the known one.
fn only<'n>(mut names: impl Iterator<Item = &'n String>, known: &'static str) -> Result<(), Refusal> {
    match names.find(|name| *name != known) {
        None => Ok(()),
        Some(name) => Err(TensorFault::Parameter { name: short(name), known }.into()),
    }
}

fn metadata(vehicle: &ServedVehicle) -> ModelMetadataResponse {
    let tensor = |name: &str, datatype: &str, shape| TensorMetadata {
        name: name.into(),
        datatype: datatype.into(),
        shape,
    };
    let outputs = outputs::of(vehicle, -1);
    ModelMetadataResponse {
        name: vehicle.model().vehicle().name.clone(),
        versions: vec![vehicle.model().version().to_string()],
        platform: env!("CARGO_PKG_NAME").into(),
        inputs: INPUTS.iter().map(|&(field, width)| tensor(field.name(), "FP32", shape(-1, width))).collect(),
        outputs: outputs.map(|(output, shape)| tensor(output.name(), output.datatype(), shape)).collect(),
    }
}

fn index(served: Option<&ServedVehicle>, name: String) -> ModelIndex {
    match served {
        Some(served) => ModelIndex {
            name,
            version: served.model().version().to_string(),
            state: READY.into(),
            reason: String::new(),
        },
        None => ModelIndex {
            name,
            state: "UNAVAILABLE".into(),
            reason: "not loaded: RepositoryModelLoad says why not, or serves it".into(),
            ..Default::default()
        },
    }
}
