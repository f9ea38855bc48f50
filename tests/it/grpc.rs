//! Promise: the gRPC door keeps its limits, says what is wrong, honors deadlines, and drains.

use std::time::{Duration, Instant};

use crate::common::{PATIENCE, Served};
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Status};
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;
use tonic_types::StatusExt;
use wade_client::{Credentials, GrpcClient, Method};
use wade_wire::proto;
use wade_wire::proto::hydrodynamics_client::HydrodynamicsClient;

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime")
}

async fn channel(served: &Served) -> Channel {
    let endpoint = Endpoint::from_shared(served.url()).expect("a URL");
    endpoint.connect_timeout(PATIENCE).connect().await.expect("the server is there")
}

async fn client(served: &Served) -> HydrodynamicsClient<Channel> {
    HydrodynamicsClient::new(channel(served).await).max_decoding_message_size(64 << 20)
}

fn request(vehicle: &str, depth_m: f32) -> proto::EvaluateRequest {
    let velocity_mps = Some(proto::Vector3 { x: 0.5, y: 0.0, z: 0.0 });
    let state = proto::State { velocity_mps, depth_m: Some(depth_m), ..Default::default() };
    proto::EvaluateRequest { vehicle: vehicle.into(), state: Some(state) }
}

fn batch(states: usize) -> proto::EvaluateBatchRequest {
    proto::EvaluateBatchRequest { vehicle: "husky".into(), depth_m: vec![0.19; states], ..Default::default() }
}

fn violated_field(status: &Status) -> String {
    let request = status.get_details_bad_request().expect("a bad request names its field");
    request.field_violations[0].field.clone()
}

#[test]
fn accepted_connections_have_tcp_nodelay() {
    // the very function that the server accepts with
    runtime().block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("bound");
        let listener = wade::service::intake::Listener::Tcp(listener);
        let _client = tokio::net::TcpStream::connect(address).await.expect("connected");
        let (accepted, _) = listener.accept().await.expect("accepted");
        let wade::service::intake::Socket::Tcp(accepted) = accepted else { panic!("it is TCP") };
        assert!(accepted.nodelay().expect("a socket option"));
    });
}

#[test]
fn bad_requests_name_their_field_and_the_next_is_served() {
    let served = Served::start();
    runtime().block_on(async {
        let mut client = client(&served).await;
        let state = |change: fn(&mut proto::State)| {
            let mut request = request("husky", 0.1);
            change(request.state.as_mut().expect("set above"));
            request
        };
        let quaternion =
            |w, x| proto::state::Attitude::WorldFromBody(proto::Quaternion { w, x, y: 0.0, z: 0.0 });
        let mut bad = vec![
            (state(|s| s.depth_m = None), "state.depth_m"),
            (state(|s| s.depth_m = Some(f32::NAN)), "state.depth_m"),
            (state(|s| s.density_kgpm3 = Some(-1.0)), "state.density_kgpm3"),
            (proto::EvaluateRequest { state: None, ..request("husky", 0.1) }, "state"),
        ];
        let mut turned = request("husky", 0.1);
        turned.state.as_mut().expect("set").attitude = Some(quaternion(2.0, 0.0));
        bad.push((turned.clone(), "state.world_from_body"));
        turned.state.as_mut().expect("set").attitude = Some(quaternion(f32::NAN, 0.0));
        bad.push((turned, "state.world_from_body"));
        for (request, field) in bad {
            let status = client.evaluate(request).await.expect_err("a bad request");
            assert_eq!((status.code(), violated_field(&status).as_str()), (Code::InvalidArgument, field));
        }
        let status = client.evaluate(request("nautilus", 0.1)).await.expect_err("no such vehicle");
        assert_eq!(status.code(), Code::NotFound);
        assert!(status.message().contains("husky"), "the message lists what is served: {}", status.message());
        assert_eq!(status.get_details_resource_info().expect("named").resource_name, "nautilus");
        client.evaluate(request("husky", 0.1)).await.expect("the next request is served");
    });
}

#[test]
fn a_client_that_finds_nobody_says_each_reason_once_with_the_way_out() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let socket = folder.path().join("wade.sock");
    let url = format!("unix:{}", socket.display());
    let of_client = GrpcClient::unix(socket, "husky", Method::Unary, PATIENCE).map(|_| ());
    let of_reload =
        wade_client::reload(&url, proto::ReloadRequest::default(), PATIENCE, &Credentials::default())
            .map(|_| ());
    for error in [of_client.expect_err("nobody"), of_reload.expect_err("nobody")] {
        let text = error.to_string();
        assert_eq!(text.matches("No such file").count(), 1, "{text}");
        assert!(text.contains(&url) && text.contains("is wade serve running"), "{text}");
    }
}

#[test]
fn attitudes_in_all_three_forms_agree() {
    let served = Served::start();
    runtime().block_on(async {
        let mut client = client(&served).await;
        let (roll, pitch) = (0.05_f32, -0.08_f32);
        let up = wade_core::frame::up_from_roll_pitch(roll.into(), pitch.into());
        let q = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, 0.7_f32);
        let forms = [
            proto::state::Attitude::RollPitch(proto::RollPitch { roll_rad: roll, pitch_rad: pitch }),
            proto::state::Attitude::WorldFromBody(proto::Quaternion { w: q.w, x: q.i, y: q.j, z: q.k }),
            proto::state::Attitude::GravityDirection(proto::Vector3 {
                x: -up.x as f32,
                y: -up.y as f32,
                z: -up.z as f32,
            }),
        ];
        let mut forces = Vec::new();
        for attitude in forms {
            let mut request = request("warthog", 0.3);
            request.state.as_mut().expect("set").attitude = Some(attitude);
            let answer = client.evaluate(request).await.expect("answered").into_inner();
            forces.push(answer.wrench.and_then(|wrench| wrench.force_n).expect("a force"));
        }
        for force in &forces[1..] {
            assert!((force.z - forces[0].z).abs() < 0.01 * forces[0].z.abs(), "{forces:?}");
        }
    });
}

#[test]
fn bad_batches_are_refused_by_name() {
    let served = Served::with(|config| config.grpc.max_batch = 8);
    runtime().block_on(async {
        let mut client = client(&served).await;
        let status = client.evaluate_batch(batch(0)).await.expect_err("empty");
        assert_eq!((status.code(), violated_field(&status).as_str()), (Code::InvalidArgument, "depth_m"));
        let status = client.evaluate_batch(batch(9)).await.expect_err("too long");
        assert_eq!((status.code(), violated_field(&status).as_str()), (Code::InvalidArgument, "depth_m"));
        let unequal = proto::EvaluateBatchRequest { velocity_mps: vec![0.0; 7], ..batch(2) };
        let status = client.evaluate_batch(unequal).await.expect_err("unequal lengths");
        assert_eq!(violated_field(&status), "velocity_mps");
        let wrong = proto::EvaluateBatchRequest { density_kgpm3: vec![1000.0, f32::NAN], ..batch(2) };
        let status = client.evaluate_batch(wrong).await.expect_err("a NaN");
        assert_eq!(violated_field(&status), "density_kgpm3[1]");
        client.evaluate_batch(batch(8)).await.expect("the next batch is served");
    });
}

#[test]
fn a_message_over_the_limit_is_refused() {
    let served = Served::with(|config| config.grpc.max_message_bytes = 1024);
    runtime().block_on(async {
        let mut client = client(&served).await;
        let status = client.evaluate_batch(batch(1000)).await.expect_err("4 kB");
        assert_eq!(status.code(), Code::ResourceExhausted, "{status:?}");
        client.evaluate_batch(batch(10)).await.expect("the next is served");
    });
}

#[test]
fn streams_over_the_limit_are_refused_with_a_time_to_retry() {
    let served = Served::with(|config| config.grpc.max_streams = 1);
    runtime().block_on(async {
        let mut client = client(&served).await;
        let (first, outgoing) = tokio::sync::mpsc::channel(1);
        first.send(request("husky", 0.1)).await.expect("sent");
        let mut answers = client.stream(ReceiverStream::new(outgoing)).await.expect("opened").into_inner();
        answers.message().await.expect("answered").expect("one");
        let (_second, outgoing) = tokio::sync::mpsc::channel(1);
        let status = client.stream(ReceiverStream::new(outgoing)).await.expect_err("one too many");
        assert_eq!(status.code(), Code::ResourceExhausted);
        assert!(status.get_details_retry_info().expect("when to retry").retry_delay.is_some());
        drop((first, answers));
        // the place is given back once the server has seen the end of the stream
        let start = Instant::now();
        loop {
            let (sender, outgoing) = tokio::sync::mpsc::channel(1);
            sender.send(request("husky", 0.1)).await.expect("sent");
            if client.stream(ReceiverStream::new(outgoing)).await.is_ok() {
                break;
            }
            assert!(start.elapsed() < PATIENCE, "the place was never given back");
        }
    });
}

#[test]
fn who_watches_the_health_takes_no_place_of_a_stream_and_closes_nobody() {
    let served = Served::with(|config| config.grpc.max_streams = 1);
    runtime().block_on(async {
        let mut streaming = client(&served).await;
        let (sender, outgoing) = tokio::sync::mpsc::channel(1);
        let mut answers = streaming.stream(ReceiverStream::new(outgoing)).await.expect("opened").into_inner();
        let mut watching = HealthClient::new(channel(&served).await);
        let check = HealthCheckRequest { service: String::new() };
        let _first = watching.watch(check.clone()).await.expect("watched");
        // longer than whoever stands still is left in peace
        tokio::time::sleep(Duration::from_millis(1500)).await;
        for _ in 0..3 {
            let refused = HealthClient::new(channel(&served).await).watch(check.clone()).await;
            assert_eq!(refused.expect_err("the place is taken").code(), Code::ResourceExhausted);
        }
        sender.send(request("husky", 0.1)).await.expect("sent");
        answers.message().await.expect("the stream lives on").expect("one");
    });
}

#[test]
fn while_a_batch_is_computed_another_over_the_limit_is_refused_and_single_queries_are_answered() {
    let served = Served::with(|config| {
        config.grpc.max_requests = 1;
        config.grpc.max_batch = 1 << 16;
    });
    runtime().block_on(async {
        let (mut first, mut second) = (client(&served).await, client(&served).await);
        // now and then it is the long one that finds the place taken, or that loses it to the other: where the machine has no
        // time for either, it seems to stand still while it is received
        let long = tokio::spawn(async move {
            loop {
                match first.evaluate_batch(batch(1 << 16)).await {
                    Err(status) if [Code::ResourceExhausted, Code::Unavailable].contains(&status.code()) => {}
                    answer => break answer,
                }
            }
        });
        let start = Instant::now();
        let refused = loop {
            match second.evaluate_batch(batch(32)).await {
                Err(status) => break status,
                Ok(_) => assert!(start.elapsed() < PATIENCE && !long.is_finished(), "never refused"),
            }
        };
        assert_eq!(refused.code(), Code::ResourceExhausted);
        assert!(refused.get_details_retry_info().is_some());
        // single queries have a place of their own, which the server's question to itself takes for a moment
        let mut answered = 0;
        while answered < 20 {
            match second.evaluate(request("husky", 0.1)).await {
                Ok(_) => answered += 1,
                Err(status) => assert_eq!(status.code(), Code::ResourceExhausted),
            }
        }
        assert!(!long.is_finished(), "they did not wait for the batch");
        long.await.expect("joined").expect("the batch is answered");
        second.evaluate_batch(batch(32)).await.expect("there is room again");
    });
}

#[test]
fn a_deadline_that_has_passed_costs_no_computation() {
    let served = Served::start();
    runtime().block_on(async {
        let mut client = client(&served).await;
        let mut late = Request::new(request("husky", 0.1));
        late.set_timeout(Duration::from_nanos(1));
        let status = client.evaluate(late).await.expect_err("too late");
        assert!([Code::DeadlineExceeded, Code::Cancelled].contains(&status.code()), "{status:?}");
        client.evaluate(request("husky", 0.1)).await.expect("the next is served");
    });
    let recorded: u64 = served.running.metrics().latencies().iter().map(|row| row.since_start.count).sum();
    assert_eq!(recorded, 1, "the late request was not answered");
}

#[test]
fn a_batch_stops_between_states_when_its_deadline_passes() {
    let served = Served::with(|config| config.grpc.max_batch = 1 << 17);
    runtime().block_on(async {
        let mut client = client(&served).await;
        let mut long = Request::new(batch(1 << 17));
        // far less than 131,072 states take, far more than the transfer needs
        long.set_timeout(Duration::from_millis(200));
        let start = Instant::now();
        let status = client.evaluate_batch(long).await.expect_err("too long for its deadline");
        assert!([Code::DeadlineExceeded, Code::Cancelled].contains(&status.code()), "{status:?}");
        assert!(start.elapsed() < PATIENCE);
        client.evaluate(request("husky", 0.1)).await.expect("the next is served");
    });
    let text = served.running.metrics().render();
    let answered = text.contains(r#"transport="grpc_batch",vehicle="husky""#);
    assert!(!answered, "the batch was given up, not finished");
}

#[test]
fn a_stream_remembers_its_vehicle_and_ends_with_its_first_error() {
    let served = Served::start();
    runtime().block_on(async {
        let mut client = client(&served).await;
        let (sender, outgoing) = tokio::sync::mpsc::channel(8);
        let mut answers = None;
        for (vehicle, depth) in [("husky", 0.1), ("", 0.12), ("warthog", 0.2), ("", f32::INFINITY)] {
            sender.send(request(vehicle, depth)).await.expect("sent");
        }
        let outgoing = ReceiverStream::new(outgoing);
        let answers = answers.insert(client.stream(outgoing).await.expect("opened").into_inner());
        let mut counts = Vec::new();
        let status = loop {
            match answers.message().await {
                Ok(Some(answer)) => counts.push(answer.wetted_fraction.len()),
                Ok(None) => panic!("the stream ended without its error"),
                Err(status) => break status,
            }
        };
        assert_eq!(counts, [13, 13, 10]);
        assert_eq!(violated_field(&status), "state.depth_m");
    });
}

#[test]
fn vehicles_are_listed_and_described() {
    let served = Served::start();
    runtime().block_on(async {
        let mut client = client(&served).await;
        let list = client.list_vehicles(proto::ListVehiclesRequest {}).await.expect("listed").into_inner();
        let names: Vec<_> = list.vehicles.iter().map(|v| (v.name.as_str(), v.surface_count)).collect();
        assert_eq!(names, [("husky", 13), ("warthog", 10)]);
        let ask = |include_mesh| proto::GetVehicleRequest { vehicle: "husky".into(), include_mesh };
        let husky = client.get_vehicle(ask(true)).await.expect("described").into_inner();
        let mesh = wade_core::geometry::mesh::read_stl(&husky.mesh_stl).expect("a sound STL");
        assert_eq!(mesh.faces.len(), husky.face_surface.len());
        assert_eq!(husky.surfaces.len(), 13);
        assert!(client.get_vehicle(ask(false)).await.expect("described").into_inner().mesh_stl.is_empty());
        client.evaluate(request("husky", 0.1)).await.expect("answered");
        let latency = client.get_latency(proto::GetLatencyRequest {}).await.expect("known").into_inner();
        let unary = latency.latencies.iter().find(|row| row.transport == "grpc_unary").expect("recorded");
        assert_eq!(unary.since_start.expect("set").count, 1);
    });
}

#[test]
fn health_follows_the_server_and_reflection_answers_in_both_versions() {
    let served = Served::start();
    runtime().block_on(async {
        let channel = channel(&served).await;
        let mut health = HealthClient::new(channel.clone());
        for service in ["", "wade.v1.Hydrodynamics"] {
            let check = HealthCheckRequest { service: service.into() };
            let status = health.check(check).await.expect("known").into_inner().status();
            assert_eq!(status, ServingStatus::Serving);
        }
        macro_rules! services {
            ($version:ident) => {{
                use pb::server_reflection_request::MessageRequest;
                use pb::server_reflection_response::MessageResponse;
                use tonic_reflection::pb::$version as pb;
                let mut client = pb::server_reflection_client::ServerReflectionClient::new(channel.clone());
                let request = pb::ServerReflectionRequest {
                    host: String::new(),
                    message_request: Some(MessageRequest::ListServices(String::new())),
                };
                let answers = client.server_reflection_info(tokio_stream::once(request)).await;
                let answer = answers.expect("opened").into_inner().message().await.expect("answered");
                match answer.and_then(|answer| answer.message_response) {
                    Some(MessageResponse::ListServicesResponse(list)) => {
                        list.service.into_iter().map(|service| service.name).collect::<Vec<_>>()
                    }
                    other => panic!("no list: {other:?}"),
                }
            }};
        }
        for services in [services!(v1), services!(v1alpha)] {
            assert!(services.iter().any(|name| name == "wade.v1.Hydrodynamics"), "{services:?}");
        }
    });
}

#[test]
fn a_server_that_cannot_read_its_bundles_never_says_serving() {
    let folder = crate::common::copy_of_vehicles();
    std::fs::write(folder.path().join("husky/network.safetensors"), b"nothing").expect("written");
    let other = tempfile::TempDir::new().expect("a folder");
    let mut config = crate::common::config(other.path());
    config.vehicles = folder.path().to_owned();
    let error = wade::server::start(&config).expect_err("a damaged bundle").to_string();
    assert!(error.contains("network.safetensors"), "{error}");
    assert!(!config.grpc.unix_socket.exists(), "the socket is gone with the server");
}

#[test]
fn a_drain_answers_what_is_in_flight_and_ends_open_streams_within_its_bound() {
    let served = Served::with(|config| {
        config.grpc.max_batch = 1 << 14;
        // this is about what is answered, on a machine of any speed
        config.drain_s = PATIENCE.as_secs_f64();
    });
    let runtime = runtime();
    let _inside = runtime.enter();
    let (mut health, mut long, mut watched) = runtime.block_on(async {
        (HealthClient::new(channel(&served).await), client(&served).await, client(&served).await)
    });
    let check = HealthCheckRequest { service: String::new() };
    let mut states = runtime.block_on(health.watch(check)).expect("watched").into_inner();
    let (sender, outgoing) = tokio::sync::mpsc::channel(1);
    let mut answers = runtime.block_on(async {
        sender.send(request("husky", 0.1)).await.expect("sent");
        watched.stream(ReceiverStream::new(outgoing)).await.expect("opened").into_inner()
    });
    runtime.block_on(answers.message()).expect("answered").expect("one");
    // long to compute beside what is sent
    let request = proto::EvaluateBatchRequest { omit_surfaces: true, ..batch(1 << 14) };
    let in_flight = runtime.spawn(async move { long.evaluate_batch(request).await });
    // the batch is in flight once it has taken a place
    let requests = served.running.metrics().held(wade::metrics::Resource::batches);
    runtime.block_on(async {
        let start = Instant::now();
        while requests.get() == 0 {
            tokio::task::yield_now().await;
            assert!(start.elapsed() < PATIENCE && !in_flight.is_finished(), "the batch never arrived");
        }
    });
    let Served { running, config, .. } = served;
    let stopping = std::thread::spawn(move || {
        let start = Instant::now();
        running.shutdown();
        start.elapsed()
    });
    runtime.block_on(async {
        let status = answers.message().await.expect_err("the stream is ended");
        assert_eq!(status.code(), Code::Unavailable);
        in_flight.await.expect("joined").expect("what was in flight is answered");
        let mut last = ServingStatus::Serving;
        while let Ok(Some(state)) = states.message().await {
            last = state.status();
            if last == ServingStatus::NotServing {
                break;
            }
        }
        assert_eq!(last, ServingStatus::NotServing);
    });
    drop((states, health, watched, sender));
    let elapsed = stopping.join().expect("stopped");
    assert!(elapsed < Duration::from_secs_f64(config.drain_s) + PATIENCE, "{elapsed:?}");
}

#[test]
fn a_connection_that_never_speaks_does_not_hold_up_a_drain() {
    let served = Served::with(|config| config.drain_s = 0.3);
    let address = served.running.grpc_address().expect("TCP is on");
    let _silent = std::net::TcpStream::connect(address).expect("connected");
    let start = Instant::now();
    served.running.shutdown();
    assert!(start.elapsed() < Duration::from_secs(10), "bounded by drain_s: {:?}", start.elapsed());
}

#[test]
fn a_file_in_the_place_of_the_socket_is_not_removed() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut config = crate::common::config(folder.path());
    std::fs::write(&config.grpc.unix_socket, "settings").expect("written");
    wade::server::start(&config).expect_err("the place is taken");
    assert_eq!(std::fs::read_to_string(&config.grpc.unix_socket).expect("still there"), "settings");
    config.grpc.unix_socket = folder.path().join("other.sock");
    // a socket that nobody listens on any more is taken over
    drop(std::os::unix::net::UnixListener::bind(&config.grpc.unix_socket).expect("bound"));
    assert!(config.grpc.unix_socket.exists());
    wade::server::start(&config).expect("a stale socket is replaced").shutdown();
}

#[test]
fn a_vehicle_without_weights_and_base_is_left_out_and_the_others_are_served() {
    let folder = crate::common::copy_of_vehicles();
    let path = folder.path().join("warthog");
    let untrained = wade_core::bundle::read(&path).expect("sound");
    wade_core::bundle::write(
        &path,
        &wade_core::bundle::Bundle { trained: None, radiation: None, ..untrained },
    )
    .expect("written");
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    runtime().block_on(async {
        let mut client = client(&served).await;
        let list = client.list_vehicles(proto::ListVehiclesRequest {}).await.expect("listed").into_inner();
        let names: Vec<_> = list.vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect();
        assert_eq!(names, ["husky"]);
    });
}

#[test]
fn a_watch_of_our_health_hears_the_end_and_does_not_hold_up_a_drain() {
    let served = Served::with(|config| config.drain_s = 3600.0);
    let runtime = runtime();
    let mut states = runtime.block_on(async {
        let mut health = HealthClient::new(channel(&served).await);
        health.watch(HealthCheckRequest { service: String::new() }).await.expect("watched").into_inner()
    });
    let stopping = std::thread::spawn(move || served.running.shutdown());
    let mut seen = Vec::new();
    while let Ok(Some(state)) = runtime.block_on(states.message()) {
        seen.push(state.status());
    }
    assert_eq!(seen.last(), Some(&ServingStatus::NotServing), "{seen:?}");
    // a client that stands still cannot say goodbye, and would be waited for
    drop((states, runtime));
    stopping.join().expect("stopped long before its bound of an hour");
}

#[test]
fn an_administrators_call_over_tcp_is_refused_with_the_way_out_and_answered_on_the_unix_socket() {
    let served = Served::start();
    let socket = format!("unix:{}", served.config.grpc.unix_socket.display());
    let husky = || proto::ReloadRequest { vehicle: "husky".into(), ..Default::default() };
    let refused = wade_client::reload(&served.url(), husky(), PATIENCE, &Credentials::default())
        .expect_err("refused")
        .to_string();
    assert!(refused.contains(&socket) && refused.contains("grpc.admin_over_tcp"), "{refused}");
    let reloaded =
        wade_client::reload(&socket, husky(), PATIENCE, &Credentials::default()).expect("answered");
    assert_eq!((reloaded.len(), reloaded[0].refusal.as_str()), (1, ""));
    let unload = wade_wire::proto::inference::RepositoryModelUnloadRequest {
        model_name: "husky".into(),
        ..Default::default()
    };
    runtime().block_on(async {
        use wade_wire::proto::inference::grpc_inference_service_client::GrpcInferenceServiceClient;
        let mut inference = GrpcInferenceServiceClient::new(channel(&served).await);
        let status = inference.repository_model_unload(unload).await.expect_err("refused");
        assert_eq!(status.code(), Code::PermissionDenied);
        client(&served).await.evaluate(request("husky", 0.1)).await.expect("it is served still");
    });
}

#[test]
fn compressed_requests_are_answered_and_what_is_unpacked_has_the_same_limit() {
    let served = Served::with(|config| config.grpc.max_message_bytes = 4096);
    runtime().block_on(async {
        let mut client = client(&served).await.send_compressed(tonic::codec::CompressionEncoding::Gzip);
        client.evaluate(request("husky", 0.1)).await.expect("answered");
        let answer = client.evaluate_batch(batch(500)).await.expect("answered").into_inner();
        assert_eq!(answer.force_n.len(), 1500);
        // 40 kB that are 100 bytes on the wire
        let status = client.evaluate_batch(batch(10_000)).await.expect_err("too long");
        assert_eq!(status.code(), Code::ResourceExhausted, "{status:?}");
    });
}

/// The C core of gRPC names the path of a Unix socket as the authority, percent-encoded.
#[test]
fn a_stock_client_on_the_unix_socket_is_answered() {
    use std::io::{Read, Write};
    let served = Served::start();
    let mut socket =
        std::os::unix::net::UnixStream::connect(&served.config.grpc.unix_socket).expect("connected");
    socket.set_read_timeout(Some(PATIENCE)).expect("set");
    let frame = |kind: u8, flags: u8, stream: u8, payload: &[u8]| {
        [&[0, 0, payload.len() as u8, kind, flags, 0, 0, 0, stream][..], payload].concat()
    };
    let field = |first: &[u8], text: &str| [first, &[text.len() as u8], text.as_bytes()].concat();
    // the first call brings the authority into the table of the connection, the second takes it from there, where two
    // newer entries follow it
    let with = |authority: &[u8]| {
        let path = field(&[0x04], "/grpc.health.v1.Health/Check");
        [&[0x83, 0x86], &path[..], authority, &field(&[0x5f], "application/grpc"), b"\x40\x02te\x08trailers"]
            .concat()
    };
    let path = "%2Ftmp%2Fsome%2Fwade.sock";
    let sent = [
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(),
        frame(4, 0, 0, &[]),
        frame(1, 4, 1, &with(&field(&[0x41], path))),
        frame(0, 1, 1, &[0; 5]),
        frame(1, 4, 3, &with(&[0x80 | 64])),
        frame(0, 1, 3, &[0; 5]),
    ];
    socket.write_all(&sent.concat()).expect("sent");
    let mut answered = Vec::new();
    while answered.len() < 2 {
        let mut head = [0; 9];
        socket.read_exact(&mut head).expect("answered");
        let mut payload = vec![0; u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize];
        socket.read_exact(&mut payload).expect("the payload");
        assert!(head[3] != 3 && head[3] != 7, "stream {} was reset: {payload:?}", head[8]);
        if head[3] == 0 {
            // a response says SERVING: field 1 is 1
            assert_eq!(payload, [0, 0, 0, 0, 2, 8, 1]);
            answered.push(head[8]);
        }
    }
    answered.sort_unstable();
    assert_eq!(answered, [1, 3]);
}
