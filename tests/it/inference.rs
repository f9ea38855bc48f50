//! Promise: the Open Inference Protocol answers with the bits of `Evaluate`, names the tensor that is wrong, and lets an
//! administrator load and unload vehicles. clients/inference asks with an existing client.

use std::collections::HashMap;

use crate::common::{Numbers, Served, VEHICLES};
use tonic::transport::Channel;
use tonic::{Code, Status};
use tonic_types::StatusExt;
use wade_client::{Client, ClientError, Method, Reply};
use wade_core::physics::Physics;
use wade_wire::State;
use wade_wire::proto::inference::grpc_inference_service_client::GrpcInferenceServiceClient;
use wade_wire::proto::inference::infer_parameter::ParameterChoice;
use wade_wire::proto::inference::model_infer_request::{InferInputTensor, InferRequestedOutputTensor};
use wade_wire::proto::inference::*;

type Inference = GrpcInferenceServiceClient<Channel>;

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime")
}

async fn connect(served: &Served) -> Inference {
    let endpoint = tonic::transport::Endpoint::from_shared(served.url()).expect("a URL");
    GrpcInferenceServiceClient::new(endpoint.connect().await.expect("the server is there"))
}

fn tensor(name: &str, width: usize, values: Vec<f32>) -> InferInputTensor {
    let rows = (values.len() / width) as i64;
    InferInputTensor {
        name: name.into(),
        datatype: "FP32".into(),
        shape: if width == 1 { vec![rows] } else { vec![rows, width as i64] },
        contents: Some(InferTensorContents { fp32_contents: values, ..Default::default() }),
        ..Default::default()
    }
}

/// The version of a shipped bundle.
fn version(vehicle: &str) -> String {
    crate::common::model(vehicle).version().to_string()
}

/// Every tensor there is.
fn request(vehicle: &str, states: &[State]) -> ModelInferRequest {
    let rows = |of: &dyn Fn(&State) -> Vec<f32>| states.iter().flat_map(of).collect::<Vec<f32>>();
    let inputs = vec![
        tensor("velocity_mps", 3, rows(&|s| s.velocity.to_vec())),
        tensor("current_mps", 3, rows(&|s| s.current.to_vec())),
        tensor("angular_velocity_radps", 3, rows(&|s| s.angular_velocity.to_vec())),
        tensor("acceleration_mps2", 3, rows(&|s| s.acceleration.to_vec())),
        tensor("angular_acceleration_radps2", 3, rows(&|s| s.angular_acceleration.to_vec())),
        tensor("gravity_direction", 3, rows(&|s| s.gravity.to_vec())),
        tensor("depth_m", 1, rows(&|s| vec![s.depth])),
        tensor("density_kgpm3", 1, rows(&|s| vec![s.density])),
        tensor("heading_rad", 1, rows(&|s| s.heading.into_iter().collect())),
        tensor("depth_rate_mps", 1, rows(&|s| s.depth_rate.into_iter().collect())),
        tensor(
            "wheel_speed_radps",
            4,
            rows(&|s| s.wheel_speeds.iter().flat_map(|speeds| speeds.to_vec()).collect()),
        ),
    ];
    ModelInferRequest { model_name: vehicle.into(), id: "seven".into(), inputs, ..Default::default() }
}

/// The same with raw contents.
fn raw(mut request: ModelInferRequest) -> ModelInferRequest {
    for input in &mut request.inputs {
        let values = input.contents.take().expect("typed").fp32_contents;
        request.raw_input_contents.push(values.iter().flat_map(|value| value.to_le_bytes()).collect());
    }
    request
}

/// Bits of the outputs by name, from either form; booleans as 0 and 1.
fn outputs(response: &ModelInferResponse) -> HashMap<String, Vec<u32>> {
    let typed = |contents: &InferTensorContents| -> Vec<u32> {
        let floats = contents.fp32_contents.iter().map(|value| value.to_bits());
        let integers = contents.int_contents.iter().map(|value| *value as u32);
        floats.chain(integers).chain(contents.bool_contents.iter().map(|value| u32::from(*value))).collect()
    };
    let values = |index: usize| match &response.outputs[index].contents {
        Some(contents) => typed(contents),
        None if response.outputs[index].datatype == "BOOL" => {
            response.raw_output_contents[index].iter().map(|&value| value.into()).collect()
        }
        None => {
            let (words, rest) = response.raw_output_contents[index].as_chunks::<4>();
            assert!(rest.is_empty());
            words.iter().map(|word| u32::from_le_bytes(*word)).collect()
        }
    };
    response.outputs.iter().enumerate().map(|(index, tensor)| (tensor.name.clone(), values(index))).collect()
}

fn bits<'r>(replies: &'r [Reply], of: impl Fn(&'r Reply) -> Vec<f32>) -> Vec<u32> {
    replies.iter().flat_map(of).map(f32::to_bits).collect()
}

#[test]
fn the_tensors_have_the_bits_of_single_queries_in_both_forms_with_every_effect() {
    let bundles = crate::common::copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = bundles.path().to_owned());
    let mut numbers = Numbers::new(66);
    for vehicle in VEHICLES {
        let mut client = Client::Grpc(Box::new(served.tcp(vehicle, Method::Unary)));
        // the contact and the added mass hold for a whole request
        let state = |_| State { dry_contact: true, implicit_added_mass: true, ..numbers.state() };
        let states: Vec<State> = (0..70).map(state).collect();
        let replies: Vec<Reply> =
            states.iter().map(|state| client.evaluate(state).expect("answered")).collect();
        let mut request = request(vehicle, &states);
        let parameter = |choice| InferParameter { parameter_choice: Some(choice) };
        request.parameters = HashMap::from([
            ("ground_contact".into(), parameter(ParameterChoice::StringParam("GROUND_CONTACT_DRY".into()))),
            ("implicit_added_mass".into(), parameter(ParameterChoice::BoolParam(true))),
        ]);
        let (typed, raw) = runtime().block_on(async {
            let mut inference = connect(&served).await;
            let typed = inference.model_infer(request.clone()).await.expect("answered").into_inner();
            let raw = inference.model_infer(raw(request)).await.expect("answered").into_inner();
            (typed, raw)
        });
        assert!(typed.raw_output_contents.is_empty() && raw.outputs.iter().all(|o| o.contents.is_none()));
        assert_eq!(outputs(&typed), outputs(&raw));
        assert_eq!(
            (raw.model_version.as_str(), raw.id.as_str()),
            (replies[0].version.to_string().as_str(), "seven")
        );
        let found = outputs(&raw);
        let surfaces = |of: fn(&wade_client::SurfaceReply) -> Vec<f32>| {
            bits(&replies, |reply| reply.surfaces.iter().flat_map(of).collect())
        };
        assert_eq!(found["force_n"], bits(&replies, |reply| reply.force.to_vec()));
        assert_eq!(found["moment_nm"], bits(&replies, |reply| reply.moment.to_vec()));
        assert_eq!(found["uncertainty_n"], bits(&replies, |reply| reply.uncertainty.to_vec()));
        assert_eq!(found["surface_force_n"], surfaces(|s| s.force.to_vec()));
        assert_eq!(found["surface_point_m"], surfaces(|s| s.point.to_vec()));
        assert_eq!(found["wetted_fraction"], surfaces(|s| vec![s.wetted_fraction]));
        let effects = |of: fn(&wade_client::EffectReply) -> [f32; 3]| {
            bits(&replies, |reply| reply.effects.iter().flat_map(of).collect())
        };
        assert_eq!(found["effect_force_n"], effects(|effect| effect.force));
        assert_eq!(found["effect_moment_nm"], effects(|effect| effect.moment));
        let left_out = replies.iter().flat_map(|reply| &reply.effects);
        let left_out: Vec<u32> =
            left_out.map(|effect| effect.left_out.map_or(0, |reason| reason as u32)).collect();
        assert_eq!(found["effect_left_out"], left_out);
        let added = bits(&replies, |reply| reply.added_mass.expect("there is such an effect").to_vec());
        assert_eq!(found["added_mass"], added);
        let inside: Vec<u32> = replies.iter().map(|reply| u32::from(reply.outside.is_inside())).collect();
        assert_eq!(found["in_domain"], inside);
        assert_eq!(found["outside"], bits(&replies, |reply| reply.outside.excess.map(|x| x as f32).to_vec()));
        for tensor in &raw.outputs {
            let count: i64 = tensor.shape.iter().product();
            assert_eq!(found[&tensor.name].len() as i64, count, "{}", tensor.name);
        }
    }
}

#[test]
fn derivatives_are_a_tensor_where_a_parameter_asks_for_them() {
    let served = Served::start();
    let mut numbers = Numbers::new(67);
    let state = |_| State { jacobian: true, dry_contact: false, ..numbers.state() };
    let states: Vec<State> = (0..20).map(state).collect();
    let mut client = Client::Grpc(Box::new(served.tcp("husky", Method::Unary)));
    let replies: Vec<Reply> = states.iter().map(|state| client.evaluate(state).expect("answered")).collect();
    let asks = InferParameter { parameter_choice: Some(ParameterChoice::BoolParam(true)) };
    let parameters = HashMap::from([("jacobian".into(), asks)]);
    let request = ModelInferRequest { parameters, ..request("husky", &states) };
    let response = runtime().block_on(async {
        connect(&served).await.model_infer(request).await.expect("answered").into_inner()
    });
    let found = outputs(&response);
    assert_eq!(found["jacobian"], bits(&replies, |reply| reply.jacobian.expect("asked for").to_vec()));
    // the base has it, without an effect
    assert_eq!(found["added_mass"], bits(&replies, |reply| reply.added_mass.expect("a base").to_vec()));
    let shape =
        response.outputs.iter().find(|tensor| tensor.name == "jacobian").map(|tensor| &tensor.shape[..]);
    assert_eq!(shape, Some(&[20, 6, 11][..]));
}

#[test]
fn the_physics_of_the_server_answers_tensors() {
    let served = Served::with(|config| config.physics = Physics::Hydrostatic);
    let state = State { acceleration: [1.0, 0.0, 0.0], heading: Some(0.0), ..State::still(0.2) };
    let state = State { depth_rate: Some(0.0), wheel_speeds: Some([0.0; 4].into()), ..state };
    let mut client = Client::Grpc(Box::new(served.tcp("husky", Method::Unary)));
    let mut force = |physics: Physics| {
        let reply = client.evaluate(&State { physics: Some(physics), ..state }).expect("answered");
        reply.force.map(f32::to_bits).to_vec()
    };
    let response = runtime().block_on(async {
        let request = request("husky", &[state]);
        connect(&served).await.model_infer(request).await.expect("answered").into_inner()
    });
    let found = outputs(&response).remove("force_n").expect("a force");
    assert_eq!(found, force(Physics::Hydrostatic));
    assert_ne!(found, force(Physics::Full));
}

#[test]
fn the_metadata_are_those_of_the_answers() {
    let served = Served::start();
    runtime().block_on(async {
        let mut inference = connect(&served).await;
        assert!(inference.server_live(ServerLiveRequest {}).await.expect("answered").into_inner().live);
        assert!(inference.server_ready(ServerReadyRequest {}).await.expect("answered").into_inner().ready);
        let server =
            inference.server_metadata(ServerMetadataRequest {}).await.expect("answered").into_inner();
        assert_eq!(server.name, "wade");
        let metadata = ModelMetadataRequest { name: "husky".into(), version: version("husky") };
        let metadata = inference.model_metadata(metadata).await.expect("answered").into_inner();
        assert_eq!(metadata.versions, [version("husky")]);
        let depth = [0.1, 0.15];
        let request = ModelInferRequest {
            model_name: "husky".into(),
            inputs: vec![tensor("depth_m", 1, depth.to_vec())],
            ..Default::default()
        };
        let response = inference.model_infer(request.clone()).await.expect("answered").into_inner();
        let stated: Vec<_> = metadata.outputs.iter().map(|t| (&t.name, &t.datatype, &t.shape[1..])).collect();
        let answered: Vec<_> =
            response.outputs.iter().map(|t| (&t.name, &t.datatype, &t.shape[1..])).collect();
        assert_eq!(stated, answered);
        assert!(
            metadata.outputs.iter().all(|t| t.shape[0] == -1)
                && response.outputs.iter().all(|t| t.shape[0] == 2)
        );
        let by_level =
            ModelInferRequest { inputs: vec![tensor("water_level_m", 1, depth.to_vec())], ..request.clone() };
        let by_level = inference.model_infer(by_level).await.expect("answered").into_inner();
        assert!(by_level.outputs.iter().all(|t| t.shape[0] == 2));
        // outputs are those asked for, in the order asked for
        let asked = |name: &str| InferRequestedOutputTensor { name: name.into(), ..Default::default() };
        let some = ModelInferRequest {
            outputs: vec![asked("wetted_fraction"), asked("force_n")],
            ..request.clone()
        };
        let some = inference.model_infer(some).await.expect("answered").into_inner();
        let names: Vec<_> = some.outputs.iter().map(|tensor| tensor.name.as_str()).collect();
        assert_eq!(names, ["wetted_fraction", "force_n"]);
        assert_eq!(outputs(&some)["force_n"], outputs(&response)["force_n"]);
        let net = ModelInferRequest { outputs: vec![asked("force_n")], ..request };
        let net = inference.model_infer(net).await.expect("answered").into_inner();
        assert_eq!(outputs(&net)["force_n"], outputs(&response)["force_n"]);
        let served = version("husky");
        for (name, version, expected) in
            [("husky", "", true), ("husky", &served, true), ("husky", "1", false), ("tank", "", false)]
        {
            let ready = ModelReadyRequest { name: name.into(), version: version.into() };
            let ready = inference.model_ready(ready).await.expect("answered").into_inner().ready;
            assert_eq!(ready, expected, "{name} {version}");
        }
    });
}

/// Code and field of a refusal; the message must name the field too.
fn refusal(status: &Status) -> (Code, String) {
    let violations = status.get_details_bad_request().map(|bad| bad.field_violations).unwrap_or_default();
    let field = violations.into_iter().next().map(|violation| violation.field).unwrap_or_default();
    let name = field.split(['[', '.']).find(|part| !part.is_empty() && *part != "state").unwrap_or_default();
    assert!(status.message().contains(name) || status.message().starts_with("the batch has"), "{status:?}");
    (status.code(), field)
}

#[test]
fn a_wrong_tensor_is_named_and_the_next_request_is_answered() {
    let served = Served::with(|config| config.grpc.max_batch = 4);
    let good = ModelInferRequest {
        model_name: "husky".into(),
        inputs: vec![tensor("depth_m", 1, vec![0.1, 0.2]), tensor("velocity_mps", 3, vec![0.1; 6])],
        ..Default::default()
    };
    let change = |change: &dyn Fn(&mut ModelInferRequest)| {
        let mut request = good.clone();
        change(&mut request);
        request
    };
    let velocity = |of: &dyn Fn(&mut InferInputTensor)| change(&|request| of(&mut request.inputs[1]));
    let depth = |of: &dyn Fn(&mut InferInputTensor)| change(&|request| of(&mut request.inputs[0]));
    let parameter = |name: &str, choice: ParameterChoice| {
        let value = InferParameter { parameter_choice: Some(choice) };
        change(&|request| {
            request.parameters.insert(name.into(), value.clone());
        })
    };
    let bytes = |len: usize| {
        let mut request = raw(good.clone());
        request.raw_input_contents[1] = vec![0; len];
        request
    };
    let asked = |name: &str, times: usize| {
        let output = InferRequestedOutputTensor { name: name.into(), ..Default::default() };
        change(&|request| request.outputs = vec![output.clone(); times])
    };
    let invalid = Code::InvalidArgument;
    let cases = [
        (change(&|r| r.inputs.clear()), invalid, "depth_m"),
        (depth(&|t| t.shape = vec![-1]), invalid, "depth_m"),
        (depth(&|t| t.shape = vec![2, 1]), invalid, "depth_m"),
        (depth(&|t| t.shape = vec![]), invalid, "depth_m"),
        (depth(&|t| t.shape = vec![0]), invalid, "depth_m"),
        (depth(&|t| t.shape = vec![i64::MAX]), invalid, "depth_m"),
        (depth(&|t| t.shape = vec![5]), invalid, "depth_m"),
        (depth(&|t| t.contents = None), invalid, "depth_m"),
        (depth(&|t| t.name = "depth".into()), invalid, "depth_m"),
        (velocity(&|t| t.datatype = "FP64".into()), invalid, "velocity_mps"),
        (velocity(&|t| t.datatype = "BYTES".into()), invalid, "velocity_mps"),
        (velocity(&|t| t.shape = vec![3, 2]), invalid, "velocity_mps"),
        (velocity(&|t| t.shape = vec![6]), invalid, "velocity_mps"),
        (velocity(&|t| t.shape = vec![2, 3, 1, 1, 1, 1, 1]), invalid, "velocity_mps"),
        (
            velocity(&|t| t.contents.as_mut().expect("typed").fp32_contents.truncate(5)),
            invalid,
            "velocity_mps",
        ),
        (
            velocity(&|t| t.contents.as_mut().expect("typed").fp32_contents[4] = f32::NAN),
            invalid,
            "velocity_mps[1]",
        ),
        (velocity(&|t| t.name = "x".repeat(100_000)), invalid, &"x".repeat(64)),
        (velocity(&|t| t.name = "speed".into()), invalid, "speed"),
        (change(&|r| r.inputs[1] = r.inputs[0].clone()), invalid, "depth_m"),
        (
            velocity(&|t| {
                t.parameters.insert("shared_memory_region".into(), InferParameter::default());
            }),
            invalid,
            "shared_memory_region",
        ),
        (bytes(23), invalid, "velocity_mps"),
        (bytes(20), invalid, "velocity_mps"),
        (bytes(0), invalid, "velocity_mps"),
        (change(&|r| r.raw_input_contents = vec![vec![0; 8], vec![0; 24]]), invalid, "depth_m"),
        (change(&|r| r.raw_input_contents = vec![vec![0; 8]]), invalid, "raw_input_contents"),
        (parameter("sequence_id", ParameterChoice::Int64Param(3)), invalid, "sequence_id"),
        (parameter("implicit_added_mass", ParameterChoice::Int64Param(1)), invalid, "implicit_added_mass"),
        (
            parameter("ground_contact", ParameterChoice::StringParam("WET".into())),
            invalid,
            "state.ground_contact",
        ),
        (asked("forces", 1), invalid, "forces"),
        (asked("force_n", 2), invalid, "force_n"),
        (asked("effect_force_n", 1), invalid, "effect_force_n"),
        // not asked for by its parameter
        (asked("jacobian", 1), invalid, "jacobian"),
        (change(&|r| r.model_name = "tank".into()), Code::NotFound, ""),
        (change(&|r| r.model_version = u32::MAX.to_string()), Code::NotFound, ""),
    ];
    runtime().block_on(async {
        let mut inference = connect(&served).await;
        for (request, code, field) in cases {
            let status = inference.model_infer(request).await.expect_err(field);
            assert_eq!(refusal(&status), (code, field.to_owned()), "{status:?}");
            inference.model_infer(good.clone()).await.expect("the next is answered");
        }
    });
}

/// Asks by a client that blocks, from a thread without a runtime.
fn answers(served: &Served, vehicle: &str) -> bool {
    let ask = || served.tcp(vehicle, Method::Unary).evaluate(&State::still(0.0)).is_ok();
    std::thread::scope(|scope| scope.spawn(ask).join().expect("joined"))
}

#[test]
fn load_tools_find_the_configuration_the_statistics_and_a_stream() {
    let served = Served::start();
    runtime().block_on(async {
        let mut inference = connect(&served).await;
        let named = |name: &str| (name.to_owned(), String::new());
        let (name, version) = named("husky");
        let metadata = ModelMetadataRequest { name: name.clone(), version: version.clone() };
        let metadata = inference.model_metadata(metadata).await.expect("answered").into_inner();
        let config = ModelConfigRequest { name, version };
        let config = inference.model_config(config).await.expect("answered").into_inner();
        let config = config.config.expect("a configuration");
        assert_eq!((config.name.as_str(), config.max_batch_size), ("husky", 0));
        let stated: Vec<_> = metadata.inputs.iter().map(|tensor| (&tensor.name, &tensor.shape)).collect();
        let configured: Vec<_> = config.input.iter().map(|input| (&input.name, &input.dims)).collect();
        assert_eq!(stated, configured);
        assert!(config.input.iter().all(|input| input.optional == (input.name != "depth_m")));
        assert_eq!(config.output.len(), metadata.outputs.len());
        let (name, version) = named("tank");
        let unknown =
            inference.model_config(ModelConfigRequest { name, version }).await.expect_err("unknown");
        assert_eq!(unknown.code(), Code::NotFound);

        let good = ModelInferRequest {
            model_name: "husky".into(),
            inputs: vec![tensor("depth_m", 1, vec![0.1, 0.2])],
            ..Default::default()
        };
        let mut with = good.clone();
        let parameter = |choice| InferParameter { parameter_choice: Some(choice) };
        with.parameters.insert("priority".into(), parameter(ParameterChoice::Uint64Param(2)));
        with.parameters.insert("timeout".into(), parameter(ParameterChoice::Int64Param(20_000_000)));
        let answer = inference.model_infer(with.clone()).await.expect("answered").into_inner();
        with.parameters.insert("timeout".into(), parameter(ParameterChoice::Int64Param(1)));
        let late = inference.model_infer(with).await.expect_err("a microsecond is too short");
        assert_eq!(late.code(), Code::DeadlineExceeded);

        let bad = ModelInferRequest { model_name: "tank".into(), ..good.clone() };
        let requests = tokio_stream::iter([good.clone(), bad, good]);
        let mut answers = inference.model_stream_infer(requests).await.expect("opened").into_inner();
        for refused in [false, true, false] {
            let next = answers.message().await.expect("answered").expect("one a request");
            assert_eq!(next.error_message.contains("tank"), refused, "{next:?}");
            let response = next.infer_response;
            assert_eq!(response.is_none(), refused);
            if let Some(response) = response {
                assert_eq!(outputs(&response), outputs(&answer));
            }
        }
        assert!(answers.message().await.expect("ended").is_none());

        let asked = ModelStatisticsRequest { name: "husky".into(), version: String::new() };
        let found = inference.model_statistics(asked).await.expect("answered").into_inner().model_stats;
        assert_eq!((found.len(), found[0].inference_count), (1, 3));
        let success = found[0].inference_stats.and_then(|stats| stats.success).expect("counted");
        assert!(success.count == 3 && success.ns > 0, "{success:?}");
        let every = inference.model_statistics(ModelStatisticsRequest::default()).await.expect("answered");
        assert_eq!(every.into_inner().model_stats.len(), VEHICLES.len());
    });
}

#[test]
fn an_administrator_loads_and_unloads() {
    let bundles = crate::common::copy_of_vehicles();
    let served = Served::with(|config| {
        config.vehicles = bundles.path().to_owned();
        config.grpc.admin_over_tcp = true;
    });
    let load = |name: &str| RepositoryModelLoadRequest { model_name: name.into(), ..Default::default() };
    let unload = |name: &str| RepositoryModelUnloadRequest { model_name: name.into(), ..Default::default() };
    runtime().block_on(async {
        let mut inference = connect(&served).await;
        let index = async |inference: &mut Inference, ready| {
            let request = RepositoryIndexRequest { ready, ..Default::default() };
            let models = inference.repository_index(request).await.expect("answered").into_inner().models;
            models
                .into_iter()
                .map(|model| format!("{} {} {}", model.name, model.version, model.state))
                .collect::<Vec<_>>()
        };
        let ready = VEHICLES.map(|vehicle| format!("{vehicle} {} READY", version(vehicle)));
        assert_eq!(index(&mut inference, false).await, ready);
        let state = State { depth: 0.1, ..State::default() };
        let mut shm = served.shm("husky", wade_wire::shm::Wait::Block);
        shm.evaluate(&state).expect("answered");
        inference.repository_model_unload(unload("husky")).await.expect("unloaded");
        // a client whose ports are open hears of it, alone and in a batch
        for error in [shm.evaluate(&state).map(|_| ()), shm.evaluate_batch(&[state; 2]).map(|_| ())] {
            let unknown = error.expect_err("not served any more");
            assert!(matches!(unknown, ClientError::UnknownVehicle { .. }), "{unknown}");
            assert!(unknown.to_string().ends_with("warthog"), "{unknown}");
        }
        assert_eq!(index(&mut inference, false).await, ["husky  UNAVAILABLE", &ready[1]]);
        assert_eq!(index(&mut inference, true).await, [ready[1].as_str()]);
        assert!(!answers(&served, "husky") && answers(&served, "warthog"));
        let again = inference.repository_model_unload(unload("husky")).await.expect_err("it is gone");
        assert_eq!(again.code(), Code::NotFound);
        inference.repository_model_load(load("husky")).await.expect("loaded");
        assert_eq!(index(&mut inference, false).await, ready);
        // every vehicle is served again over shared memory too
        shm.evaluate(&state).expect("answered");
        std::fs::write(bundles.path().join("husky/network.safetensors"), b"damaged").expect("written");
        let damaged = inference.repository_model_load(load("husky")).await.expect_err("refused");
        assert_eq!(damaged.code(), Code::FailedPrecondition);
        assert!(damaged.message().contains("network.safetensors"), "{damaged:?}");
        assert!(answers(&served, "husky"), "the version before it is served");
        for name in ["", "tank", "../husky"] {
            let status = inference.repository_model_load(load(name)).await.expect_err(name);
            assert_eq!(status.code(), Code::NotFound, "{name}");
        }
        let mut overridden = load("husky");
        overridden.parameters.insert("config".into(), ModelRepositoryParameter::default());
        let status =
            inference.repository_model_load(overridden).await.expect_err("no configuration to override");
        assert_eq!(status.code(), Code::InvalidArgument);
    });
}
