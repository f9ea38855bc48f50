//! Promise: metrics, probes and queries as JSON answer over HTTP, the latter with the bits of every other transport and to
//! nobody's browser but the user's own.

use std::fs::File;
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::http::{Answer, get, post, send};
use crate::common::{Numbers, PATIENCE, Served, VEHICLES};
use serde_json::{Value, json};
use tempfile::TempDir;
use wade_client::{Client, GrpcClient, Method};
use wade_core::physics::Physics;
use wade_wire::State;

fn address(served: &Served) -> SocketAddr {
    served.running.http_address().expect("HTTP is on")
}

#[test]
fn a_served_query_shows_in_the_metrics() {
    let served = Served::start();
    let mut client = served.tcp("husky", Method::Unary);
    client.evaluate(&State::still(0.3)).expect("answered");
    client.evaluate(&State::default()).expect_err("refused");
    post(address(&served), "/v1/query", r#"{"vehicle": "husky", "state": {"depth_m": 0.1}}"#);
    post(address(&served), "/v1/query", r#"{"vehicle": "husky", "state": {}}"#);
    let text = get(address(&served), "/metrics").body;
    for expected in [
        r#"wade_request_duration_seconds_count{transport="grpc_unary",vehicle="husky"} 1"#,
        r#"wade_request_duration_seconds_count{transport="http",vehicle="husky"} 1"#,
        r#"wade_out_of_domain_total{transport="grpc_unary",vehicle="husky"} 1"#,
        r#"wade_refusals_total{transport="grpc_unary",reason="invalid_argument"} 1"#,
        r#"wade_refusals_total{transport="http",reason="invalid_argument"} 1"#,
        r#"wade_bundle_version{vehicle="warthog"}"#,
    ] {
        assert!(text.contains(expected), "{expected} is not in\n{text}");
    }
}

#[test]
fn metrics_come_in_the_format_that_is_accepted() {
    let served = Served::start();
    let ask = |accept: &[(&str, &str)]| send(address(&served), "GET /metrics", accept, "");
    let prometheus = "application/openmetrics-text;version=1.0.0;q=0.5,text/plain;version=0.0.4;q=0.4";
    let open = ask(&[("Accept", prometheus)]);
    assert!(open.header("content-type").is_some_and(|kind| kind.starts_with("application/openmetrics-text")));
    assert!(open.body.ends_with("# EOF\n") && open.body.contains("# TYPE wade_reloads counter\n"));
    for accept in ["*/*", "text/plain", "application/openmetrics-text;q=0, */*"] {
        let plain = ask(&[("Accept", accept)]);
        let kind = plain.header("content-type").map(str::to_owned);
        assert_eq!(kind.as_deref(), Some("text/plain; version=0.0.4; charset=utf-8"), "{accept}");
        assert!(!plain.body.contains("# EOF") && !plain.body.contains("# UNIT"), "{}", plain.body);
        assert!(plain.body.contains("# TYPE wade_reloads_total counter\n"), "{}", plain.body);
        assert!(plain.body.contains("wade_limit{resource=\"streams\"} 64\n"), "{}", plain.body);
    }
}

#[test]
fn probes_say_live_and_ready() {
    let served = Served::start();
    assert_eq!(get(address(&served), "/livez").status, 200);
    assert_eq!(get(address(&served), "/readyz").status, 200);
    let nothing = get(address(&served), "/nothing");
    assert_eq!(nothing.status, 404);
    assert!(nothing.body.contains("/v1/query"), "{nothing:?}");
}

/// A bundle that somebody writes, so that reading it lasts until the file is dropped, or for some seconds.
fn being_written(bundle: &Path) -> File {
    let name = bundle.file_name().expect("a name").to_string_lossy().into_owned();
    let lock = File::create(bundle.with_file_name(format!(".{name}.lock"))).expect("made");
    lock.lock().expect("nobody else writes");
    lock
}

#[test]
fn who_asks_while_bundles_are_read_is_told_to_come_back() {
    let (bundles, folder) = (crate::common::copy_of_vehicles(), TempDir::new().expect("a folder"));
    let writer = being_written(&bundles.path().join("warthog"));
    let mut config = crate::common::config(folder.path());
    config.vehicles = bundles.path().to_owned();
    let probe = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = probe.local_addr().expect("an address");
    drop(probe);
    config.http.listen = address.to_string();
    std::thread::scope(|scope| {
        let starting = scope.spawn(|| wade::server::start(&config));
        while std::net::TcpStream::connect(address).is_err() {
            assert!(!starting.is_finished(), "the server waits for the writer");
            std::thread::sleep(Duration::from_millis(1));
        }
        let ask = || post(address, "/v1/query", r#"{"vehicle": "husky", "state": {"depth_m": 0.1}}"#);
        let answers = [get(address, "/readyz"), ask(), get(address, "/v1/vehicles/husky")];
        assert_eq!(answers.each_ref().map(|answer| answer.status), [503; 3], "{answers:?}");
        assert_eq!(answers[1].json()["error"]["status"], "UNAVAILABLE");
        assert_eq!(answers[1].header("retry-after"), Some("1"));
        // the process lives, and a page that is open may stay so
        assert_eq!([get(address, "/livez").status, get(address, "/").status], [200; 2]);
        drop(writer);
        let _running = starting.join().expect("it does not panic").expect("the server starts");
        assert_eq!([get(address, "/readyz").status, ask().status], [200; 2]);
    });
}

/// A query with every field there is.
fn query(vehicle: &str, state: &State) -> Value {
    let vector = |[x, y, z]: [f32; 3]| json!({"x": x, "y": y, "z": z});
    json!({"vehicle": vehicle, "state": {
        "velocity_mps": vector(state.velocity),
        "current_mps": vector(state.current),
        "angular_velocity_radps": vector(state.angular_velocity),
        "acceleration_mps2": vector(state.acceleration),
        "angular_acceleration_radps2": vector(state.angular_acceleration),
        "depth_m": state.depth,
        "density_kgpm3": state.density,
        "gravity_direction": vector(state.gravity),
        "ground_contact": if state.dry_contact { "GROUND_CONTACT_DRY" } else { "GROUND_CONTACT_WETTED" },
        "heading_rad": state.heading,
        "depth_rate_mps": state.depth_rate,
        "wheel_speed_radps": state.wheel_speeds.as_deref(),
        "time_step_s": state.time_step,
        "implicit_added_mass": state.implicit_added_mass,
    }})
}

fn bits<'v>(values: impl IntoIterator<Item = &'v Value>) -> Vec<u32> {
    values.into_iter().map(|value| (value.as_f64().expect("a number") as f32).to_bits()).collect()
}

fn vector_bits(value: &Value) -> Vec<u32> {
    bits(["x", "y", "z"].map(|axis| &value[axis]))
}

#[test]
fn a_query_as_json_has_the_bits_of_grpc_with_every_effect() {
    let bundles = crate::common::copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = bundles.path().to_owned());
    let mut numbers = Numbers::new(6);
    for vehicle in VEHICLES {
        let mut client = Client::Grpc(Box::new(served.tcp(vehicle, Method::Unary)));
        for _ in 0..20 {
            let state = numbers.state();
            let expected = client.evaluate(&state).expect("answered");
            let answer = post(address(&served), "/v1/query", &query(vehicle, &state).to_string());
            assert_eq!(answer.status, 200, "{answer:?}");
            let answer = answer.json();
            let forces = bits(answer["surface_force_n"].as_array().expect("an array"));
            let points = bits(answer["surface_point_m"].as_array().expect("an array"));
            let expected_forces: Vec<u32> =
                expected.surfaces.iter().flat_map(|surface| surface.force.map(f32::to_bits)).collect();
            let expected_points: Vec<u32> =
                expected.surfaces.iter().flat_map(|surface| surface.point.map(f32::to_bits)).collect();
            assert_eq!((forces, points), (expected_forces, expected_points));
            assert_eq!(vector_bits(&answer["wrench"]["force_n"]), expected.force.map(f32::to_bits));
            assert_eq!(vector_bits(&answer["wrench"]["moment_nm"]), expected.moment.map(f32::to_bits));
            assert_eq!(vector_bits(&answer["uncertainty_n"]), expected.uncertainty.map(f32::to_bits));
            assert_eq!(answer["in_domain"], json!(expected.outside.is_inside()));
            assert_eq!(answer["bundle_version"], json!(expected.version));
            let effects = answer["effects"].as_array().expect("an array");
            assert_eq!(effects.len(), expected.effects.len());
            for (effect, expected) in effects.iter().zip(&expected.effects) {
                assert_eq!(vector_bits(&effect["force_n"]), expected.force.map(f32::to_bits));
            }
            let rows = answer["added_mass"].as_array().expect("an array");
            assert_eq!(
                bits(rows.iter().flat_map(|row| row.as_array().expect("a row"))),
                expected.added_mass.expect("there is such an effect").map(f32::to_bits)
            );
        }
    }
}

#[test]
fn the_physics_of_a_query_as_json_wins_over_that_of_the_server() {
    let served = Served::with(|config| config.physics = Physics::Hydrostatic);
    let force = |physics: Option<&str>| {
        let state = json!({"depth_m": 0.2, "acceleration_mps2": {"x": 1.0}, "physics": physics});
        let query = json!({"vehicle": "husky", "state": state}).to_string();
        vector_bits(&post(address(&served), "/v1/query", &query).json()["wrench"]["force_n"])
    };
    assert_eq!(force(None), force(Some("PHYSICS_HYDROSTATIC")));
    assert_ne!(force(None), force(Some("PHYSICS_FULL")));
}

#[test]
fn the_command_and_the_server_write_one_document() {
    let bundles = crate::common::copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = bundles.path().to_owned());
    let url = format!("http://{}", served.running.grpc_address().expect("TCP is on"));
    let state = json!({"velocity_mps": {"x": 2.0}, "depth_m": 0.5, "gravity_direction": {"z": -1.0}});
    let body = json!({"vehicle": "husky", "state": state}).to_string();
    let mut expected = post(address(&served), "/v1/query", &body).json();
    assert_eq!(expected["surfaces"][9]["name"], "wheel_fl");
    assert_eq!(expected["outside"][0]["quantity"], "speed_mps");
    assert_eq!(expected["effects"][0]["name"], "added_mass");
    expected["compute_ns"] = Value::Null;
    let folder = bundles.path().to_str().expect("UTF-8");
    for more in [["--addr", &url], ["--vehicles", folder]] {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_wade"))
            .args(["query", "--vehicle", "husky", "--speed", "2", "--depth", "0.5", "--json"])
            .args(more)
            .output()
            .expect("the program runs");
        let mut document: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        document["compute_ns"] = Value::Null;
        assert_eq!(document, expected, "{more:?}");
    }
}

#[test]
fn a_query_by_parameters_and_by_other_names_is_the_same_query() {
    let served = Served::start();
    let without_time = |answer: Answer| {
        assert_eq!(answer.status, 200, "{answer:?}");
        let mut answer = answer.json();
        answer["compute_ns"] = Value::Null;
        answer
    };
    let expected = without_time(post(
        address(&served),
        "/v1/query",
        r#"{"vehicle": "husky", "state": {"depth_m": 0.15, "velocity_mps": {"x": 0.5, "y": -0.25},
            "roll_pitch": {"pitch_rad": -0.1}, "implicit_added_mass": true, "wheel_speed_radps": [1, 2, 3, 4]}}"#,
    ));
    let camel = r#"{"vehicle": "husky", "state": {"depthM": "0.15", "velocityMps": {"x": 0.5, "y": -0.25},
        "rollPitch": {"pitchRad": -0.1}, "implicitAddedMass": true, "wheelSpeedRadps": [1, 2, 3, 4]}}"#;
    assert_eq!(without_time(post(address(&served), "/v1/query", camel)), expected);
    let parameters = "/v1/query?vehicle=husky&state.depth_m=0.15&state.velocity_mps.x=0.5&state.velocity_mps.y=-0.25\
        &state.roll_pitch.pitch_rad=-0.1&state.implicit_added_mass=true&state.wheel_speed_radps=1\
        &state.wheel_speed_radps=2&state.wheel_speed_radps=3&state.wheel_speed_radps=4";
    assert_eq!(without_time(get(address(&served), parameters)), expected);
}

/// Status, status in words, and field of a refusal.
fn refusal(answer: &Answer) -> (u16, String, String) {
    let error = answer.json()["error"].clone();
    assert_eq!(error["code"], json!(answer.status));
    assert!(error["message"].as_str().is_some_and(|message| message.len() > 5), "{error}");
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    (answer.status, text(&error["status"]), text(&error["field_violations"][0]["field"]))
}

#[test]
fn bad_queries_are_refused_by_field_and_the_next_good_one_is_answered() {
    let served = Served::start();
    let invalid = |field: &str| (400, "INVALID_ARGUMENT".to_owned(), field.to_owned());
    let bodies = [
        ("", invalid("")),
        ("{", invalid("")),
        ("[1]", invalid("")),
        (r#"{"vehicle": "husky", "state": {"depth_m": 0.1}} x"#, invalid("")),
        (r#"{"vehicle": "husky"}"#, invalid("state")),
        (r#"{"vehicle": "husky", "state": {"depth": 0.1}}"#, invalid("state")),
        (r#"{"vehicle": "husky", "state": {"depth_m": "deep"}}"#, invalid("state.depth_m")),
        (r#"{"vehicle": "husky", "state": {"depth_m": 1e99}}"#, invalid("state.depth_m")),
        (r#"{"vehicle": "husky", "state": {"depth_m": "NaN"}}"#, invalid("state.depth_m")),
        (r#"{"vehicle": "husky", "state": {}}"#, invalid("state.depth_m")),
        (
            r#"{"vehicle": "husky", "state": {"depth_m": 0.1, "water_level_m": 0.1}}"#,
            invalid("state.water_level_m"),
        ),
        (r#"{"vehicle": "husky", "state": {"depth_m": 0.1, "bed": 2}}"#, invalid("state.bed")),
        (r#"{"vehicle": "husky", "state": {"velocity_mps": [1, 2, 3]}}"#, invalid("state.velocity_mps")),
        (
            r#"{"vehicle": "husky", "state": {"velocity_mps": {"x": "Infinity"}}}"#,
            invalid("state.velocity_mps"),
        ),
        (r#"{"vehicle": "husky", "state": {"wheel_speed_radps": [1]}}"#, invalid("state.wheel_speed_radps")),
        (r#"{"vehicle": "husky", "state": {"ground_contact": "WET"}}"#, invalid("state.ground_contact")),
        (r#"{"vehicle": "tank", "state": {}}"#, (404, "NOT_FOUND".into(), String::new())),
    ];
    for (body, expected) in bodies {
        let answer = post(address(&served), "/v1/query", body);
        assert_eq!(refusal(&answer), expected, "{body}: {answer:?}");
    }
    let parameters = [
        ("vehicle=husky&depth_m=0.1", invalid("depth_m")),
        ("vehicle=husky&state=1", invalid("state")),
        ("vehicle=husky&state.velocity_mps=1", invalid("state.velocity_mps")),
        ("vehicle=husky&state.depth_m.x=1", invalid("state.depth_m.x")),
        ("vehicle=husky&state.depth_m=1&state.depth_m=2", invalid("state.depth_m")),
        ("vehicle=husky&state.depth_m=deep", invalid("state.depth_m")),
        ("vehicle=husky&vehicle=warthog", invalid("vehicle")),
        ("", (404, "NOT_FOUND".into(), String::new())),
    ];
    for (parameters, expected) in parameters {
        let answer = get(address(&served), &format!("/v1/query?{parameters}"));
        assert_eq!(refusal(&answer), expected, "{parameters}: {answer:?}");
    }
    let unknown = post(address(&served), "/v1/query", r#"{"vehicle": "husky", "state": {"depth": 0.1}}"#);
    assert!(unknown.body.contains("depth_m"), "the way out is named: {unknown:?}");
    let long = post(address(&served), "/v1/query", &format!("{{\"vehicle\": \"{}\"}}", "x".repeat(1 << 17)));
    assert_eq!(refusal(&long), (413, "RESOURCE_EXHAUSTED".into(), String::new()));
    let deep = post(address(&served), "/v1/query", &"[".repeat(60_000));
    assert_eq!(refusal(&deep), invalid(""));
    let name = post(address(&served), "/v1/query", &json!({"vehicle": "x".repeat(50_000)}).to_string());
    assert!(name.status == 404 && name.body.len() < 1000, "{name:?}");
    let good = post(address(&served), "/v1/query", r#"{"vehicle": "husky", "state": {"depth_m": 0.1}}"#);
    assert_eq!(good.status, 200);
}

#[test]
fn a_batch_as_json_is_refused_while_grpc_takes_every_place() {
    let served = Served::with(|config| {
        config.grpc.max_requests = 1;
        config.grpc.max_batch = 1 << 14;
    });
    let address = address(&served);
    // this is about places, on a machine of any speed
    let patience = 10 * PATIENCE;
    let mut client =
        GrpcClient::tcp(&served.url(), "husky", Method::Unary, patience).expect("the server is there");
    let states = vec![State { depth: 0.1, ..State::default() }; 1 << 13];
    // one batch after the other, since on a busy machine a single one may be done before anybody asks; now and then it is the
    // batch that finds the place taken
    let enough = Arc::new(AtomicBool::new(false));
    let until = Arc::clone(&enough);
    let long = std::thread::spawn(move || {
        let mut answered = 0;
        while !until.load(Ordering::Relaxed) {
            answered += u32::from(client.evaluate_batch(&states).is_ok());
        }
        answered
    });
    let start = Instant::now();
    let refused = loop {
        let answer = post(address, "/v1/batch", r#"{"vehicle": "husky", "depth_m": [0.1, 0.2]}"#);
        if answer.status != 200 {
            break answer;
        }
        assert!(start.elapsed() < patience, "never refused");
    };
    enough.store(true, Ordering::Relaxed);
    assert_eq!(refusal(&refused), (429, "RESOURCE_EXHAUSTED".into(), String::new()));
    assert_eq!(refused.header("retry-after"), Some("1"));
    assert!(long.join().expect("joined") > 0, "batches are answered");
}

#[test]
fn a_hull_has_the_areas_that_the_vehicle_states_and_is_sent_once() {
    let served = Served::start();
    for vehicle in VEHICLES {
        let answer = get(address(&served), &format!("/v1/vehicles/{vehicle}/hull"));
        let hull = answer.json();
        let numbers = |key: &str| -> Vec<f64> {
            hull[key]
                .as_array()
                .expect("an array")
                .iter()
                .map(|value| value.as_f64().expect("a number"))
                .collect()
        };
        let (vertices, triangles, surface) =
            (numbers("vertices_m"), numbers("triangles"), numbers("triangle_surface"));
        let corner = |index: f64| nalgebra::Vector3::from_column_slice(&vertices[3 * index as usize..][..3]);
        let stated = get(address(&served), &format!("/v1/vehicles/{vehicle}")).json();
        let stated = stated["surfaces"].as_array().expect("an array").clone();
        let mut areas = vec![0.0; stated.len()];
        for (triangle, surface) in triangles.chunks(3).zip(&surface) {
            let [a, b, c] = [0, 1, 2].map(|k| corner(triangle[k]));
            areas[*surface as usize] += (b - a).cross(&(c - a)).norm() / 2.0;
        }
        for (area, stated) in areas.iter().zip(&stated) {
            let expected = stated["area_m2"].as_f64().expect("a number");
            assert!((area / expected - 1.0).abs() < 1e-5, "{}: {area} {expected}", stated["name"]);
        }
        let etag = answer.header("etag").expect("a tag").to_owned();
        let again = send(
            address(&served),
            &format!("GET /v1/vehicles/{vehicle}/hull"),
            &[("If-None-Match", &etag)],
            "",
        );
        assert_eq!((again.status, again.body.as_str()), (304, ""));
    }
    assert_eq!(get(address(&served), "/v1/vehicles/tank/hull").status, 404);
    assert_eq!(get(address(&served), "/v1/vehicles/%2e%2e%2fhusky/hull").status, 404);
}

#[test]
fn a_hull_is_written_anew_for_a_new_version() {
    let bundles = crate::common::copy_of_vehicles();
    let served = Served::with(|config| config.vehicles = bundles.path().to_owned());
    let version = || get(address(&served), "/v1/vehicles/husky/hull").json()["bundle_version"].as_u64();
    let before = version().expect("a number");
    wade_core::bundle::apply(&bundles.path().join("husky"), crate::common::every_effect("husky"))
        .expect("applied");
    served.running.reloader().reload("husky").expect("known");
    assert_eq!(version(), Some(before + 1));
}

#[test]
fn only_those_who_call_the_server_by_a_known_name_and_from_its_own_page_are_answered() {
    let served = Served::with(|config| config.http.hosts = vec!["rig.lab".into()]);
    let address = address(&served);
    let port = address.port();
    let ask =
        |path: &str, headers: &[(&str, &str)]| send(address, &format!("GET {path}"), headers, "").status;
    for host in ["127.0.0.1", "[::1]:80", "localhost", &format!("LOCALHOST:{port}"), "rig.lab:1", "10.1.2.3"]
    {
        assert_eq!(ask("/", &[("Host", host)]), 200, "{host}");
        assert_eq!(ask("/v1/vehicles", &[("Host", host)]), 200, "{host}");
    }
    for host in [
        "evil.example",
        "127.0.0.1.evil.example",
        "localhost.evil.example",
        "rig.lab@evil.example",
        "",
        "a b",
    ] {
        assert_eq!(ask("/", &[("Host", host)]), 403, "{host:?}");
        assert_eq!(ask("/v1/vehicles/husky/hull", &[("Host", host)]), 403, "{host:?}");
        assert_eq!(ask("/readyz", &[("Host", host)]), 200, "probes come by any name: {host:?}");
    }
    let ours = format!("http://{address}");
    for (headers, expected) in [
        (vec![("Sec-Fetch-Site", "cross-site")], 403),
        (vec![("Sec-Fetch-Site", "same-site")], 403),
        (vec![("Sec-Fetch-Site", "same-origin")], 200),
        (vec![("Sec-Fetch-Site", "none")], 200),
        (vec![("Origin", "https://evil.example")], 403),
        (vec![("Origin", "null")], 403),
        (vec![("Origin", ours.as_str())], 200),
    ] {
        assert_eq!(ask("/v1/latency", &headers), expected, "{headers:?}");
    }
    assert_eq!(ask("/", &[("Sec-Fetch-Site", "cross-site")]), 200, "a link may lead here");
    let preflight = send(
        address,
        "OPTIONS /v1/query",
        &[("Origin", "https://evil.example"), ("Access-Control-Request-Method", "POST")],
        "",
    );
    assert!(preflight.status >= 400 && !preflight.headers.to_lowercase().contains("access-control"));
}

#[test]
fn the_page_needs_nothing_from_elsewhere() {
    let served = Served::start();
    let page = get(address(&served), "/");
    let policy = page.header("content-security-policy").expect("a policy");
    assert!(
        policy.contains("default-src 'none'") && !policy.contains("unsafe") && !policy.contains('*'),
        "{policy}"
    );
    assert!(page.header("access-control-allow-origin").is_none());
    let mut queue: Vec<String> = quoted(&page.body).filter(|path| path.starts_with("/page/")).collect();
    assert!(!page.body.contains("://"), "an address of another host");
    let mut seen = 0;
    while let Some(path) = queue.pop() {
        let file = get(address(&served), &path);
        assert_eq!(file.status, 200, "{path}");
        assert!(!file.body.contains("://"), "{path} names another host");
        let imports = file.body.lines().filter(|line| line.starts_with("import"));
        queue.extend(imports.flat_map(quoted).map(|name| name.replacen("./", "/page/", 1)));
        seen += 1;
    }
    assert!(seen >= 8, "{seen}");
}

fn quoted(text: &str) -> impl Iterator<Item = String> + '_ {
    text.split('"').skip(1).step_by(2).map(str::to_owned)
}

#[test]
fn connections_that_say_nothing_do_not_keep_others_out() {
    use std::io::{Read, Write};
    let served = Served::start();
    let address = address(&served);
    let silent: Vec<_> = (0..200)
        .map(|index| {
            let mut stream = std::net::TcpStream::connect(address).expect("connected");
            // half a request is no more than none
            if index % 2 == 0 {
                stream.write_all(b"GET /livez HTTP/1.1\r\nHost: local").expect("sent");
            }
            stream
        })
        .collect();
    // of the machine's queue and the server's places all are taken before this one
    assert_eq!(get(address, "/livez").status, 200);
    let mut first = &silent[0];
    first.set_read_timeout(Some(PATIENCE)).expect("set");
    let mut answer = Vec::new();
    // closed, with an answer (408) or without
    first.read_to_end(&mut answer).expect("closed before long");
    let answer = String::from_utf8_lossy(&answer).into_owned();
    assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 408"), "{answer}");
}
