//! Messages of every method but those that unload: each call ends, and the connection stays usable.

use std::cell::RefCell;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;

use prost::Message;
use wade_simulation::http2::{
    ACK, DATA, END_STREAM, GOAWAY, HEADERS, PING, PREFACE, RST_STREAM, SETTINGS, WINDOW_UPDATE, call, frame,
    prefixed,
};
use wade_wire::proto;

use crate::server;

/// Longest payload of a frame [bytes].
const LONGEST: usize = 16 << 10;
/// Calls on a connection before the next one: far from the end of its window.
const CALLS: u32 = 200;

const METHODS: [&str; 18] = [
    "/wade.v1.Hydrodynamics/Evaluate",
    "/wade.v1.Hydrodynamics/EvaluateBatch",
    "/wade.v1.Hydrodynamics/Stream",
    "/wade.v1.Hydrodynamics/ListVehicles",
    "/wade.v1.Hydrodynamics/GetVehicle",
    "/wade.v1.Hydrodynamics/GetStability",
    "/wade.v1.Hydrodynamics/GetLatency",
    "/wade.v1.Admin/Reload",
    "/inference.GRPCInferenceService/ServerMetadata",
    "/inference.GRPCInferenceService/ModelReady",
    "/inference.GRPCInferenceService/ModelMetadata",
    "/inference.GRPCInferenceService/ModelInfer",
    "/inference.GRPCInferenceService/ModelStreamInfer",
    "/inference.GRPCInferenceService/ModelConfig",
    "/inference.GRPCInferenceService/ModelStatistics",
    "/inference.GRPCInferenceService/RepositoryIndex",
    "/grpc.health.v1.Health/Check",
    "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo",
];

struct Link {
    stream: UnixStream,
    next: u32,
}

impl Link {
    fn new() -> Self {
        let mut stream = server::grpc();
        let most = ((1_u32 << 31) - 1).to_be_bytes();
        let settings = [&[0, 4], &most[..]].concat();
        let window = (1_u32 << 30).to_be_bytes();
        let hello = [PREFACE.to_vec(), frame(SETTINGS, 0, 0, &settings), frame(WINDOW_UPDATE, 0, 0, &window)];
        stream.write_all(&hello.concat()).expect("a server that reads");
        Self { stream, next: 1 }
    }

    /// Asks, and reads until the call has ended. False where the connection has.
    fn call(&mut self, path: &str, body: &[u8]) -> bool {
        let id = self.next;
        self.next += 2;
        let mut sent = call(id, path);
        for piece in body.chunks(LONGEST) {
            sent.extend(frame(DATA, 0, id, piece));
        }
        sent.extend(frame(DATA, END_STREAM, id, &[]));
        // what was refused may end before all of it is sent
        let _ = self.stream.write_all(&sent);
        loop {
            let mut head = [0; 9];
            if self
                .stream
                .read_exact(&mut head)
                .is_err_and(|error| error.kind() != std::io::ErrorKind::UnexpectedEof)
            {
                panic!("no answer of {path} within {:?}", server::PATIENCE);
            }
            let [a, b, c, kind, flags, d, e, f, g] = head;
            let mut payload = vec![0; u32::from_be_bytes([0, a, b, c]) as usize];
            if head == [0; 9] || self.stream.read_exact(&mut payload).is_err() {
                panic!("the connection ended in a call of {path}");
            }
            let stream = u32::from_be_bytes([d, e, f, g]);
            match kind {
                SETTINGS | PING if flags & ACK == 0 => {
                    let payload = if kind == PING { &payload[..] } else { &[] };
                    self.stream.write_all(&frame(kind, ACK, 0, payload)).expect("a server that reads");
                }
                GOAWAY => return false,
                RST_STREAM if stream == id => return true,
                HEADERS | DATA if stream == id && flags & END_STREAM != 0 => return true,
                _ => {}
            }
        }
    }
}

/// The method, how the rest is to be read, and a message or the whole body.
pub fn run(bytes: &[u8]) {
    thread_local! {
        static LINK: RefCell<Option<Link>> = const { RefCell::new(None) };
    }
    let [method, form, rest @ ..] = bytes else { return };
    let path = METHODS[usize::from(*method) % METHODS.len()];
    let body = match form % 3 {
        0 => prefixed(rest),
        // two messages
        1 => {
            let (first, second) = rest.split_at(rest.len() / 2);
            [prefixed(first), prefixed(second)].concat()
        }
        // whatever stands there, the prefix as well
        _ => rest.to_vec(),
    };
    LINK.with_borrow_mut(|link| {
        let mut used = link.take().unwrap_or_else(Link::new);
        if used.call(path, &body) && used.next < 2 * CALLS {
            *link = Some(used);
        }
    });
}

/// A sound message of the larger methods, and an empty one of all.
pub fn seeds() -> Vec<Vec<u8>> {
    let of = |method: u8, bytes: Vec<u8>| [vec![method, 0], bytes].concat();
    let state = crate::state::message();
    let evaluate = proto::EvaluateRequest { vehicle: "husky".into(), state: Some(state) };
    let batch = crate::state::batch_of_two();
    let vehicle = proto::GetVehicleRequest { vehicle: "husky".into(), ..Default::default() };
    let stability = proto::GetStabilityRequest { vehicle: "husky".into(), ..Default::default() };
    let empty = (0..METHODS.len()).map(|method| of(u8::try_from(method).expect("few"), Vec::new()));
    let whole = [
        of(0, evaluate.encode_to_vec()),
        of(1, batch.encode_to_vec()),
        of(2, evaluate.encode_to_vec()),
        of(4, vehicle.encode_to_vec()),
        of(5, stability.encode_to_vec()),
    ];
    empty.chain(whole).collect()
}
