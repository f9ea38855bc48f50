//! The Open Inference Protocol: a vehicle as a model whose tensors are the arrays of a batch. The computation is the one
//! of `EvaluateBatch`, so that the bits are the same.

mod inputs;
mod outputs;

use std::pin::Pin;
use std::sync::Arc;

use tokio_stream::{Stream, StreamExt};
use tonic::{Request, Response, Status, Streaming};

use super::handlers::Handlers;
use crate::metrics::Transport;
use crate::service::access::Caller;
use crate::service::admin::{Job, Jobs};
use crate::service::call::{Answered, Call};
use inputs::{shape, short};
use wade_core::served::ServedVehicle;
use wade_wire::proto::Reloaded;
use wade_wire::proto::inference::grpc_inference_service_server::GrpcInferenceService;
use wade_wire::proto::inference::infer_parameter::ParameterChoice;
use wade_wire::proto::inference::model_metadata_response::TensorMetadata;
use wade_wire::proto::inference::repository_index_response::ModelIndex;
use wade_wire::proto::inference::*;
use wade_wire::{Field, Refusal, TensorFault};

/// The state of a model that can be asked.
const READY: &str = "READY";

/// The handlers of `inference.GRPCInferenceService`.
#[derive(Debug, Clone)]
pub struct InferenceHandlers {
    pub(super) handlers: Handlers,
    pub(super) jobs: Arc<Jobs>,
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
            extensions: ["model_repository", "model_configuration", "statistics"].map(Into::into).into(),
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
        let Handlers { shared, names, .. } = &self.handlers;
        let call = Call::begin(shared, names.infer, &request);
        self.infer(call, request.into_inner()).await
    }

    type ModelStreamInferStream =
        Pin<Box<dyn Stream<Item = Result<ModelStreamInferResponse, Status>> + Send>>;

    async fn model_stream_infer(
        &self,
        request: Request<Streaming<ModelInferRequest>>,
    ) -> Result<Response<Self::ModelStreamInferStream>, Status> {
        let this = self.clone();
        let answers = request.into_inner().then(move |request| {
            let this = this.clone();
            async move {
                let request = request?;
                let Handlers { shared, names, .. } = &this.handlers;
                let call = Call::arriving(shared, names.infer, None);
                let answer = this.infer(call, request).await;
                Ok(match answer {
                    Ok(response) => ModelStreamInferResponse {
                        infer_response: Some(response.into_inner()),
                        ..Default::default()
                    },
                    Err(status) => ModelStreamInferResponse {
                        error_message: status.message().to_owned(),
                        ..Default::default()
                    },
                })
            }
        });
        Ok(Response::new(Box::pin(answers)))
    }

    async fn model_config(
        &self,
        request: Request<ModelConfigRequest>,
    ) -> Result<Response<ModelConfigResponse>, Status> {
        let ModelConfigRequest { name, version } = request.get_ref();
        let vehicle = self.model(name, version)?;
        Ok(Response::new(ModelConfigResponse { config: Some(config(&vehicle)) }))
    }

    async fn model_statistics(
        &self,
        request: Request<ModelStatisticsRequest>,
    ) -> Result<Response<ModelStatisticsResponse>, Status> {
        let ModelStatisticsRequest { name, version } = request.get_ref();
        let vehicles = if name.is_empty() {
            self.handlers.shared.engine.vehicles().values().cloned().collect()
        } else {
            vec![self.model(name, version)?]
        };
        let model_stats = vehicles.iter().map(|vehicle| self.statistics(vehicle)).collect();
        Ok(Response::new(ModelStatisticsResponse { model_stats }))
    }

    async fn repository_index(
        &self,
        request: Request<RepositoryIndexRequest>,
    ) -> Result<Response<RepositoryIndexResponse>, Status> {
        let RepositoryIndexRequest { repository_name, ready } = request.into_inner();
        one_repository(&repository_name)?;
        // the names of a folder, which no query notices
        let names = self.handlers.shared.reloader.names();
        let vehicles = self.handlers.shared.engine.vehicles();
        let models = names.into_iter().map(|name| index(vehicles.get(&name).map(Arc::as_ref), name));
        let models = models.filter(|model| !ready || model.state == READY).collect();
        Ok(Response::new(RepositoryIndexResponse { models }))
    }

    async fn repository_model_load(
        &self,
        request: Request<RepositoryModelLoadRequest>,
    ) -> Result<Response<RepositoryModelLoadResponse>, Status> {
        let caller = request.extensions().get().cloned();
        let RepositoryModelLoadRequest { repository_name, model_name, parameters } = request.into_inner();
        one_repository(&repository_name)?;
        only(parameters.keys(), "")?;
        let reloaded = self.administer(Job::reload, model_name, caller).await?;
        let refusal = reloaded.into_iter().map(|one| one.refusal).find(|refusal| !refusal.is_empty());
        refusal.map_or(Ok(Response::new(RepositoryModelLoadResponse {})), |refusal| {
            Err(Status::failed_precondition(refusal))
        })
    }

    async fn repository_model_unload(
        &self,
        request: Request<RepositoryModelUnloadRequest>,
    ) -> Result<Response<RepositoryModelUnloadResponse>, Status> {
        let caller = request.extensions().get().cloned();
        let RepositoryModelUnloadRequest { repository_name, model_name, parameters } = request.into_inner();
        one_repository(&repository_name)?;
        only(parameters.keys(), "unload_dependents")?;
        self.administer(Job::Unload, model_name, caller).await?;
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

    /// Answers a request and records it.
    async fn infer(
        &self,
        mut call: Call<'_>,
        request: ModelInferRequest,
    ) -> Result<Response<ModelInferResponse>, Status> {
        if let Some(timeout) = inputs::timeout(&request) {
            call.limit(timeout);
        }
        let answer = self.compute(&call, request).await;
        call.end(answer)
    }

    fn statistics(&self, vehicle: &ServedVehicle) -> ModelStatistics {
        let name = vehicle.model().vehicle().name.clone();
        let transports = [Transport::grpc_infer, Transport::uds_infer];
        let (count, ns) = self.handlers.shared.metrics.totals(&transports, &name);
        let duration = Some(StatisticDuration { count, ns });
        ModelStatistics {
            name,
            version: vehicle.model().version().to_string(),
            inference_count: count,
            execution_count: count,
            inference_stats: Some(InferStatistics { success: duration, compute_infer: duration }),
        }
    }

    async fn compute(
        &self,
        call: &Call<'_>,
        request: ModelInferRequest,
    ) -> Result<(ModelInferResponse, Answered), Refusal> {
        let vehicle = self.model(&request.model_name, &request.model_version)?;
        let mut batch = inputs::batch(&request, &vehicle, self.handlers.max_batch)?;
        // a state has one of the two
        let rows = batch.depth_m.len().max(batch.water_level_m.len());
        let outputs = outputs::requested(&vehicle, &request.outputs, (rows as i64, batch.jacobian))?;
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

    async fn administer(
        &self,
        job: fn(String) -> Job,
        vehicle: String,
        caller: Option<Caller>,
    ) -> Result<Vec<Reloaded>, Refusal> {
        if vehicle.is_empty() {
            // to the reloader an empty name is every vehicle
            self.model(&vehicle, "")?;
        }
        self.jobs.run(job(vehicle), caller.as_ref()).await
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
    let outputs = outputs::of(vehicle, -1, false);
    ModelMetadataResponse {
        name: vehicle.model().vehicle().name.clone(),
        versions: vec![vehicle.model().version().to_string()],
        platform: env!("CARGO_PKG_NAME").into(),
        inputs: inputs::of_vehicle(vehicle)
            .map(|(field, width)| tensor(field.name(), "FP32", shape(-1, width)))
            .collect(),
        outputs: outputs.map(|(output, shape)| tensor(output.name(), output.datatype(), shape)).collect(),
    }
}

/// The metadata in the words of Triton's configuration of a model.
fn config(vehicle: &ServedVehicle) -> ModelConfig {
    let metadata = metadata(vehicle);
    let data_type = |datatype: &str| match datatype {
        "BOOL" => DataType::TypeBool,
        "INT32" => DataType::TypeInt32,
        _ => DataType::TypeFp32,
    };
    let input = metadata.inputs.into_iter().map(|tensor| ModelInput {
        data_type: data_type(&tensor.datatype).into(),
        optional: tensor.name != Field::Depth.name(),
        name: tensor.name,
        dims: tensor.shape,
    });
    let output = metadata.outputs.into_iter().map(|tensor| ModelOutput {
        data_type: data_type(&tensor.datatype).into(),
        name: tensor.name,
        dims: tensor.shape,
    });
    ModelConfig {
        name: metadata.name,
        platform: metadata.platform.clone(),
        max_batch_size: 0,
        input: input.collect(),
        output: output.collect(),
        backend: metadata.platform,
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
