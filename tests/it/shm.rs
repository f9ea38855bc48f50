//! Promise: over shared memory, either side survives the death of the other, and a hostile client gets an error code.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::process::{Process, state, until_answered};
use crate::common::{PATIENCE, Served, namespace, vehicles};
use iceoryx2::node::NodeBuilder;
use iceoryx2::prelude::ipc;
use tempfile::TempDir;
use wade_client::{ClientError, Method, ShmClient};
use wade_wire::shm::Wait;
use wade_wire::shm::layout::{
    Answer, BatchAnswer, BatchHeader, BatchQuery, FULL, HAS_BED, HAS_BED_CLEARANCE, HAS_HEADING,
    HAS_WATER_LEVEL, HAS_WHEEL_COUNT, HAS_WHEEL_LEVELS, HAS_WHEEL_SPEEDS, HYDROSTATIC, MAX_BATCH, MAX_WHEELS,
    Names, QUASI_STEADY, Query, SERVER_POLLS, Status, SurfaceAnswer,
};
use wade_wire::{Field, InvalidState, Problem};

#[test]
fn a_living_client_finds_a_killed_and_restarted_server_again() {
    for (wait, name) in [(Wait::Spin, "spin"), (Wait::Block, "block")] {
        let (folder, namespace) = (TempDir::new().expect("a folder"), namespace());
        let timeout = Duration::from_millis(100);
        let mut client = ShmClient::new("husky", wait, timeout).in_namespace(&namespace);
        let server = Process::start(folder.path(), &namespace, name);
        let before = until_answered(&mut client);

        server.kill();
        let start = Instant::now();
        let error = client.evaluate(&state()).expect_err("nobody answers");
        assert!(matches!(error, ClientError::Timeout(_) | ClientError::NoServer { .. }), "{error:?}");
        assert!(start.elapsed() < PATIENCE, "a call ends by itself: {:?}", start.elapsed());
        let error = client.evaluate(&state()).expect_err("still nobody").to_string();
        assert!(!error.is_empty());

        let _server = Process::start(folder.path(), &namespace, name);
        let start = Instant::now();
        let after = until_answered(&mut client);
        println!("{name}: found again {:?} after the new server was started", start.elapsed());
        assert_eq!(after.force_n, before.force_n, "{name}: the same bits from the new server");
    }
}

#[test]
fn a_server_goes_on_when_clients_are_killed() {
    let served = Served::start();
    let mut survivor = served.shm("husky", Wait::Block);
    survivor.evaluate(&state()).expect("answered");
    let out = TempDir::new().expect("a folder");
    for _ in 0..6 {
        // a client that asks without end, until it is killed in the middle of it
        let mut child = Command::new(env!("CARGO_BIN_EXE_wade"))
            .args(["soak", "--vehicle", "husky", "--transport", "shm-block", "--rate", "max"])
            .args(["--duration", "60s", "--warm-up", "1ms", "--pin", "off"])
            .arg("--addr")
            .arg(format!("shm:{}", served.config.shm.namespace))
            .arg("--vehicles")
            .arg(vehicles())
            .arg("--out")
            .arg(out.path())
            .stdin(Stdio::null())
            .spawn()
            .expect("the client starts");
        let before = answered(&served);
        let start = Instant::now();
        while answered(&served) < before + 10 {
            assert!(start.elapsed() < PATIENCE, "the client never asked");
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().expect("killed");
        child.wait().expect("reaped");
        survivor.evaluate(&state()).expect("the server goes on");
    }
    served.shm("husky", Wait::Spin).evaluate(&state()).expect("a new client is served");
}

fn answered(served: &Served) -> u64 {
    served.running.metrics().latencies().iter().map(|row| row.since_start.count).sum()
}

#[test]
fn a_client_without_a_server_gets_an_error_of_its_own() {
    let mut client = ShmClient::new("husky", Wait::Spin, PATIENCE).in_namespace(&namespace());
    let error = client.evaluate(&state()).expect_err("nobody");
    assert!(matches!(error, ClientError::NoServer { .. }), "{error:?}");
}

#[test]
fn a_vehicle_that_is_not_served_is_an_error() {
    let served = Served::start();
    let error = served.shm("nautilus", Wait::Block).evaluate(&state()).expect_err("not served");
    assert!(matches!(error, ClientError::UnknownVehicle { .. }), "{error:?}");
}

#[test]
fn a_vehicle_is_described_as_over_grpc() {
    let served = Served::start();
    for vehicle in ["husky", "warthog"] {
        let expected = served.tcp(vehicle, Method::Unary).vehicle().expect("served");
        for wait in [Wait::Block, Wait::Spin] {
            let mut client = served.shm(vehicle, wait);
            assert_eq!(client.vehicle().expect("described"), expected);
            // on the ports that are open, and beside queries
            client.evaluate(&state()).expect("forces");
            assert_eq!(client.vehicle().expect("described again"), expected);
        }
        assert!(expected.surfaces.iter().any(|surface| surface.name == "wheel_fl"));
    }
}

/// A client that writes what it likes, by the layout alone.
struct Raw {
    single: iceoryx2::port::client::Client<ipc::Service, Query, (), Answer, ()>,
    batch: iceoryx2::port::client::Client<ipc::Service, BatchQuery, (), BatchAnswer, ()>,
    _node: iceoryx2::node::Node<ipc::Service>,
}

impl Raw {
    fn new(served: &Served) -> Self {
        let names = Names::new(&served.config.shm.namespace);
        let node = NodeBuilder::new().create::<ipc::Service>().expect("a node");
        macro_rules! port {
            ($name:expr, $query:ty, $answer:ty) => {{
                let name = $name.as_str().try_into().expect("a name");
                let service = node.service_builder(&name).request_response::<$query, $answer>().open();
                service.expect("served").client_builder().create().expect("a client")
            }};
        }
        Self {
            single: port!(names.evaluate("husky"), Query, Answer),
            batch: port!(names.evaluate_batch("husky"), BatchQuery, BatchAnswer),
            _node: node,
        }
    }
}

fn patiently<T>(mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < PATIENCE, "no answer");
    }
}

#[test]
fn a_hostile_request_gets_an_error_code_and_the_next_is_served() {
    let served = Served::with(|config| config.shm.wait = Wait::Spin);
    let raw = Raw::new(&served);
    let good = Query::from(&state());
    let bad = [
        Query { depth_m: f32::NAN, ..good },
        Query { velocity_mps: [f32::INFINITY; 3], ..good },
        Query { gravity_direction: [0.0; 3], ..good },
        Query { density_kgpm3: -1.0, flags: u64::MAX, session: u64::MAX, ..good },
    ];
    for (sequence, query) in (1..).zip(bad) {
        // a wake key that no listener has must not hold anybody up
        let query = Query { sequence, wake_key: u64::MAX - sequence, ..query };
        let pending = raw.single.send_copy(query).expect("sent");
        let answer = patiently(|| pending.receive().expect("received").map(|answer| *answer));
        assert_eq!((answer.status, answer.sequence), (Status::InvalidState as u32, sequence));
        assert!(answer.refusal().is_some() && answer.force_n.iter().all(|force| force.is_nan()));
        let pending = raw.single.send_copy(Query { sequence: 99, ..good }).expect("sent");
        let answer = patiently(|| pending.receive().expect("received").map(|answer| *answer));
        assert_eq!((answer.status, answer.sequence), (Status::Ok as u32, 99));
    }
}

/// What a polling server answers to a query that was written by the layout alone.
fn asked(raw: &Raw, query: Query) -> Answer {
    let pending = raw.single.send_copy(query).expect("sent");
    patiently(|| pending.receive().expect("received").map(|answer| *answer))
}

#[test]
fn what_is_set_and_cannot_be_used_is_refused_by_name() {
    let served = Served::with(|config| config.shm.wait = Wait::Spin);
    let raw = Raw::new(&served);
    let good = Query::from(&state());
    let mut wheels = [f32::NAN; MAX_WHEELS];
    wheels[5] = 3.0;
    let six = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, f32::NAN, f32::NAN];
    let (level, clearance) = (0.1, 0.5);
    use Problem::{
        Count, Negative, NoLevel, NoShare, NotFinite, TwoLevels, Unknown, Unsupported, WithoutFlag,
    };
    let cases = [
        (Query { flags: HAS_WATER_LEVEL, water_level_m: level, ..good }, Field::WaterLevel, TwoLevels),
        (Query { water_level_m: level, ..good }, Field::WaterLevel, WithoutFlag),
        (
            Query { flags: HAS_BED_CLEARANCE, bed_clearance_m: -clearance, ..good },
            Field::BedClearance,
            Negative,
        ),
        (Query { bed_clearance_m: 0.0, ..good }, Field::BedClearance, WithoutFlag),
        (Query { flags: HAS_BED, bed: 1.5, ..good }, Field::Bed, NoShare),
        (Query { flags: HAS_WHEEL_LEVELS, wheel_water_level_m: six, ..good }, Field::WheelWaterLevel, Count),
        (Query { wheel_water_level_m: wheels, ..good }, Field::WheelWaterLevel, WithoutFlag),
        (Query { flags: HAS_WHEEL_SPEEDS, wheel_speed_radps: six, ..good }, Field::WheelSpeed, Count),
        (Query { wheel_speed_radps: wheels, ..good }, Field::WheelSpeed, WithoutFlag),
        (Query { flags: HAS_WHEEL_SPEEDS, ..good }, Field::WheelSpeed, NotFinite),
        (Query { flags: HAS_HEADING, ..good }, Field::Heading, NotFinite),
        (Query { heading_rad: 0.0, ..good }, Field::Heading, WithoutFlag),
        (Query { flags: 1 << 63, ..good }, Field::Flags, Unsupported),
        (Query { depth_m: f32::NAN, ..good }, Field::Depth, NoLevel),
        (Query { flags: HYDROSTATIC | QUASI_STEADY, ..good }, Field::Physics, Unknown),
        (Query { flags: HYDROSTATIC | FULL, ..good }, Field::Physics, Unknown),
    ];
    for (query, field, problem) in cases {
        let answer = asked(&raw, query);
        assert_eq!(answer.refusal(), Some(InvalidState::new(field, problem)));
        assert!(answer.force_n.iter().all(|force| force.is_nan()) && answer.surface_count == 0);
    }
    assert_eq!(asked(&raw, good).status, Status::Ok as u32);
}

#[test]
fn what_no_model_answers_yet_is_unset_and_never_zero() {
    // the paper's network has no base below it
    let folder = crate::common::copy_of_vehicles();
    crate::common::paper::put_into(&folder.path().join("husky"));
    let served = Served::with(|config| {
        config.shm.wait = Wait::Spin;
        config.vehicles = folder.path().to_owned();
    });
    let answer = asked(&Raw::new(&served), Query::from(&state()));
    assert_eq!((answer.status, answer.flags), (Status::Ok as u32, SERVER_POLLS | HAS_WHEEL_COUNT));
    assert_eq!(answer.wheel_count, 4);
    let surfaces = answer.surfaces();
    assert!(!surfaces.is_empty() && answer.effects().is_empty());
    let answered = |load: &SurfaceAnswer| [load.force_n, load.point_m].concat().iter().all(|x| x.is_finite());
    assert!(surfaces.iter().all(answered));
    let unset = [
        &surfaces.iter().flat_map(|load| [load.couple_nm, load.effect_force_n].concat()).collect::<Vec<_>>()
            [..],
        &answer.surfaces[surfaces.len()..].iter().flat_map(|load| load.force_n).collect::<Vec<_>>(),
        &answer.effects_outside,
        &answer.outside[8..],
        &[answer.water_level_m, answer.bed_clearance_m, answer.bed, answer.shaft_power_w],
        &answer.added_mass,
        &answer.damping,
    ];
    for (place, values) in unset.iter().enumerate() {
        assert!(values.iter().all(|value| value.is_nan()), "group {place}: {values:?}");
    }
}

#[test]
fn a_batch_that_lies_about_its_length_gets_an_error_code() {
    let served = Served::with(|config| config.shm.wait = Wait::Spin);
    let raw = Raw::new(&served);
    let good = Query::from(&state());
    for count in [0, MAX_BATCH as u32 + 1, u32::MAX] {
        let mut request = raw
            .batch
            .loan_uninit()
            .expect("a slot")
            .write_payload(BatchQuery { header: BatchHeader::UNSET, queries: [good; MAX_BATCH] });
        request.payload_mut().header.count = count;
        let pending = request.send().expect("sent");
        let (status, answered) =
            patiently(|| pending.receive().expect("received").map(|answer| (answer.status, answer.count)));
        assert_eq!((status, answered), (Status::InvalidBatch as u32, 0));
    }
}

#[test]
fn requests_that_nobody_waits_for_do_not_hold_up_the_others() {
    let served = Served::with(|config| config.shm.wait = Wait::Spin);
    let raw = Raw::new(&served);
    let mut client = served.shm("husky", Wait::Spin);
    for _ in 0..200 {
        drop(raw.single.send_copy(Query::from(&state())).expect("sent"));
        client.evaluate(&state()).expect("answered");
    }
}

#[test]
fn a_client_that_never_waits_does_not_starve_the_others() {
    let served = Served::with(|config| config.shm.wait = Wait::Spin);
    let raw = Raw::new(&served);
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for _ in 0..100 {
                client_turn(&served);
            }
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        // two requests alive at any time, each replaced as soon as it is answered
        let mut alive: Vec<_> =
            (0..2).map(|_| raw.single.send_copy(Query::from(&state())).expect("sent")).collect();
        while !stop.load(std::sync::atomic::Ordering::Relaxed) {
            for pending in &mut alive {
                if pending.receive().expect("received").is_some()
                    && let Ok(next) = raw.single.send_copy(Query::from(&state()))
                {
                    *pending = next;
                }
            }
        }
    });
}

/// One answer on a client of its own.
fn client_turn(served: &Served) {
    served.shm("husky", Wait::Spin).evaluate(&state()).expect("answered beside the others");
}
