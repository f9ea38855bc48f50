//! A network of memory: what is sent comes in pieces and late, and a connection may be cut.

use std::time::Duration;

use fastrand::Rng;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf, duplex, split};
use tokio::task::JoinHandle;

/// What the systems at both ends hold of a connection [bytes].
const BUFFER: usize = 16 << 10;

/// How a connection behaves.
#[derive(Debug, Clone, Copy)]
pub struct Weather {
    /// Longest time that a piece is under way.
    pub latest: Duration,
    /// Longest piece [bytes].
    pub piece: usize,
}

/// What carries the bytes of a connection; cut where this is dropped.
#[derive(Debug)]
pub struct Cable([JoinHandle<()>; 2]);

impl Drop for Cable {
    fn drop(&mut self) {
        self.0.iter().for_each(JoinHandle::abort);
    }
}

/// The client's end, the server's, and what is between.
pub fn connection(weather: Weather, chance: &mut Rng) -> (DuplexStream, DuplexStream, Cable) {
    let (client, near) = duplex(BUFFER);
    let (far, server) = duplex(BUFFER);
    let (from_client, to_client) = split(near);
    let (from_server, to_server) = split(far);
    let there = tokio::spawn(carry(from_client, to_server, weather, chance.fork()));
    let back = tokio::spawn(carry(from_server, to_client, weather, chance.fork()));
    (client, server, Cable([there, back]))
}

async fn carry(
    mut from: ReadHalf<DuplexStream>,
    mut to: WriteHalf<DuplexStream>,
    weather: Weather,
    mut chance: Rng,
) {
    let mut piece = vec![0; weather.piece];
    while let Ok(len @ 1..) = from.read(&mut piece).await {
        // cut anywhere; how often chance is asked must not depend on the length: answers state how long they really took, and
        // are a byte longer now and then
        let cut = (len as f32 * chance.f32()) as usize;
        let mut is_open = true;
        for part in [&piece[..cut], &piece[cut..len]] {
            // some at once, so that neighbors race
            let pause = if chance.bool() { weather.latest.mul_f32(chance.f32()) } else { Duration::ZERO };
            tokio::time::sleep(pause).await;
            is_open &= to.write_all(part).await.is_ok();
        }
        if !is_open {
            break;
        }
    }
    // what was sent has arrived, and then the end of it
    let _ = to.shutdown().await;
}
