//! HTTP/2 by frames: whatever a peer sends before it stops sending, the connection ends. The server is that of the simulation,
//! whose clock moves on where it waits.

use std::cell::RefCell;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::OnceLock;

use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex, split};
use tokio::runtime::Runtime;
use wade::config::Config;
use wade::service::accounts::Peer;
use wade_simulation::http2::{
    DATA, END_HEADERS, END_STREAM, HEADERS, PING, PREFACE, SETTINGS, WINDOW_UPDATE, frame, header_block,
};
use wade_simulation::{Served, folder};

use crate::server::PATIENCE;

struct World {
    runtime: Runtime,
    served: Served,
}

thread_local! {
    static WORLD: RefCell<World> = RefCell::new(world());
}

static PAUSED: OnceLock<fn() -> Runtime> = OnceLock::new();

/// Says how a runtime of one thread is made whose clock is paused, once before the first input.
pub fn pause_by(paused: fn() -> Runtime) {
    let _ = PAUSED.set(paused);
}

fn world() -> World {
    let runtime = PAUSED.get().expect("said before the first input")();
    let config = Config { vehicles: folder(), ..Config::default() };
    let served = runtime.block_on(Served::start(&config));
    World { runtime, served }
}

/// Records of a type, flags, the low byte of a stream's number, a length and so many bytes of payload. The first byte says
/// whether what a connection begins with stands before them.
pub fn run(bytes: &[u8]) {
    let Some((&first, mut records)) = bytes.split_first() else { return };
    let mut sent = if first & 1 == 0 { [PREFACE, &frame(SETTINGS, 0, 0, &[])].concat() } else { Vec::new() };
    if first & 2 == 2 {
        // as they come off the wire
        sent.extend_from_slice(records);
    } else {
        while let [kind, flags, stream, len, rest @ ..] = records {
            let (payload, rest) = rest.split_at(rest.len().min(usize::from(*len)));
            sent.extend(frame(*kind, *flags, u32::from(*stream), payload));
            records = rest;
        }
    }
    WORLD.with_borrow(|World { runtime, served }| runtime.block_on(exchange(served, &sent)));
}

async fn exchange(served: &Served, sent: &[u8]) {
    let (near, far) = duplex(16 << 10);
    let peer = Peer::Address(IpAddr::V4(Ipv4Addr::new(10, 0, 0, 1)));
    served.making.send(Ok((far, peer))).await.expect("a server that accepts");
    let (mut from, mut to) = split(near);
    let sending = async {
        // it may refuse before it has read all
        let _ = to.write_all(sent).await;
        let _ = to.shutdown().await;
    };
    let reading = async {
        let mut piece = [0; 4096];
        while let Ok(1..) = from.read(&mut piece).await {}
    };
    let both = async { tokio::join!(sending, reading) };
    assert!(
        tokio::time::timeout(PATIENCE, both).await.is_ok(),
        "the connection is still open after {PATIENCE:?}"
    );
}

/// A call, and frames of each type.
pub fn seeds() -> Vec<Vec<u8>> {
    let record = |kind: u8, flags: u8, stream: u8, payload: &[u8]| {
        let len = u8::try_from(payload.len()).expect("short");
        [&[kind, flags, stream, len], payload].concat()
    };
    let headers = header_block("/wade.v1.Hydrodynamics/ListVehicles");
    let end = record(DATA, END_STREAM, 1, &[0; 5]);
    let call = [record(HEADERS, END_HEADERS, 1, &headers), end.clone()].concat();
    let parts = [record(HEADERS, 0, 1, &headers[..9]), record(9, END_HEADERS, 1, &headers[9..]), end];
    let padded = [&[3, 0, 0, 0, 1, 16][..], &headers, &[0; 3]].concat();
    let others = [
        record(SETTINGS, 0, 0, &[0, 3, 0, 0, 0, 100, 0, 4, 0, 1, 0, 0]),
        record(PING, 0, 0, &[7; 8]),
        record(WINDOW_UPDATE, 0, 0, &[0, 0, 1, 0]),
        record(2, 0, 1, &[0, 0, 0, 0, 16]),
        record(HEADERS, 0x2c, 3, &padded),
        record(3, 0, 3, &[0, 0, 0, 8]),
        record(7, 0, 0, &[0; 8]),
    ];
    let begun = |records: &[u8]| [&[0], records].concat();
    vec![begun(&call), begun(&parts.concat()), begun(&[&call[..], &others.concat()].concat())]
}
