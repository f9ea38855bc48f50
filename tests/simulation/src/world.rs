//! One world: its server, its clients, its end.

use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::Duration;

use fastrand::Rng;
use tokio::runtime::Runtime;
use tokio::task::LocalSet;
use tokio::time::Instant;
use wade::config::Config;
use wade::metrics::Resource;
use wade::service::accounts::{Accounts, Peer};
use wade_core::bundle::load_served;
use wade_core::model::kernel::Isa;
use wade_core::served::ServedVehicle;

use crate::bundle::NAME;
use crate::client::Client;
use crate::hostile;
use crate::ledger::{Ledger, Place, SETTLED};
use crate::network::{self, Weather};
use crate::served::{Making, Served, folder, put};

thread_local! {
    static VEHICLE: ServedVehicle =
        load_served(&folder().join(NAME), Isa::available()[0]).expect("a sound bundle");
}

/// Does this with the vehicle.
pub fn with_vehicle<T>(work: impl FnOnce(&ServedVehicle) -> T) -> T {
    VEHICLE.with(work)
}

/// What happened in a world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seen {
    /// What the server owed and did not give.
    pub broken: Vec<String>,
    /// Everything that clients did and saw, with its time [us].
    pub trace: String,
    /// Calls that were answered.
    pub answered: usize,
    /// Calls that were not, of which a wild world has some.
    pub failed: usize,
}

/// Lives through the world of a seed on a runtime of one thread whose clock is paused. In every fourth all clients are polite and
/// nothing is short.
pub fn run(seed: u64, runtime: Runtime) -> Seen {
    put(1);
    LocalSet::new().block_on(&runtime, live(seed))
}

fn settings(calm: bool, chance: &mut Rng) -> Config {
    let mut config = Config { vehicles: folder(), drain_s: 3.0, ..Config::default() };
    let grpc = &mut config.grpc;
    grpc.admin_over_tcp = true;
    if !calm {
        grpc.max_connections = chance.usize(2..7);
        grpc.max_requests = chance.usize(1..5);
        grpc.max_streams = chance.usize(1..4);
        grpc.max_held_bytes = 64 << 10;
        grpc.max_batch = 64;
        grpc.peer_share = *chance.choice(&[0.5, 0.75, 1.0]).expect("three");
        (grpc.handshake_s, grpc.first_request_s, grpc.request_s, grpc.answer_s) = (1.0, 3.0, 2.0, 2.0);
        (grpc.stream_idle_s, grpc.idle_s) = (5.0, 10.0);
        // hyper asks the system's clock when it last heard something: what depends on it differs from run to run
        grpc.keepalive_s = 3600;
    }
    config
}

async fn live(seed: u64) -> Seen {
    let (mut chance, calm) = (Rng::with_seed(seed), seed.is_multiple_of(4));
    let config = settings(calm, &mut chance);
    let mut served = Served::start(&config).await;
    let accounts = Arc::clone(&served.accounts);
    let drain = Duration::from_secs_f64(config.drain_s);
    let ledger = Ledger::new();
    let sampling = tokio::task::spawn_local(sample(ledger.clone(), Arc::clone(&accounts)));
    let weather =
        Weather { latest: Duration::from_millis(chance.u64(0..20)), piece: chance.usize(512..8192) };
    let clients: Vec<_> = (0..chance.usize(2..7))
        .map(|number| {
            let lives = Lives {
                name: format!("client {number}"),
                peer: Peer::Address(IpAddr::V4(Ipv4Addr::new(10, 0, 0, chance.u8(1..4)))),
                making: served.making.clone(),
                weather,
                calm,
                ledger: ledger.clone(),
                chance: chance.fork(),
            };
            tokio::task::spawn_local(lives.live())
        })
        .collect();
    let until_stop = Duration::from_millis(chance.u64(500..20_000));
    let all = async {
        for client in clients {
            client.await.expect("a client that ends");
        }
    };
    let hurried = !calm && chance.bool();
    let mut all = std::pin::pin!(all);
    if hurried {
        tokio::select! {
            biased;
            () = &mut all => {}
            () = tokio::time::sleep(until_stop) => ledger.note("the server is stopped while clients ask"),
        }
    } else {
        (&mut all).await;
        // what is not given back now never will be
        tokio::time::sleep(SETTLED + Duration::from_secs(3)).await;
        for resource in Resource::ALL.into_iter().filter(|&resource| resource != Resource::connections) {
            let held = accounts.held(resource);
            if held > 0 {
                ledger.breaks(format!("{held} {} are held by nobody", resource.name()));
            }
        }
    }

    let bound = drain + Duration::from_millis(600);
    if tokio::time::timeout(bound, served.stop()).await.is_err() {
        ledger.breaks(format!("the drain has not ended after {bound:?}"));
    }
    ledger.note("drained");
    tokio::time::sleep(SETTLED).await;
    for resource in Resource::ALL {
        let held = accounts.held(resource);
        if held > 0 {
            ledger.breaks(format!("{held} {} are held after the drain", resource.name()));
        }
    }
    sampling.abort();
    let read = served.reloads();
    let asked = ledger.reloads_asked();
    if read > asked {
        ledger.breaks(format!("bundles were read {read} times for {asked} reloads"));
    }
    let (broken, trace, answered, failed) = ledger.close();
    Seen { broken, trace, answered, failed }
}

/// Compares what clients surely have open with what the server counts: no limit is passed, and no place is free too early.
async fn sample(ledger: Ledger, accounts: Arc<Accounts>) {
    let mut looks: Vec<(Instant, [usize; 2])> = Vec::new();
    let kinds = [(Place::Request, Resource::requests), (Place::Stream, Resource::streams)];
    loop {
        tokio::time::sleep(Duration::from_millis(50)).await;
        let now = Instant::now();
        looks.push((now, kinds.map(|(_, resource)| accounts.held(resource))));
        while looks.first().is_some_and(|(at, _)| *at + SETTLED <= now) {
            let (at, held) = looks.remove(0);
            // open before, and open still
            let open = ledger.open_since(at - SETTLED);
            for ((place, resource), held) in kinds.into_iter().zip(held) {
                let open = open.get(&place).copied().unwrap_or(0);
                if open > held {
                    ledger.breaks(format!("{open} {} are open and {held} are counted", resource.name()));
                }
            }
        }
    }
}

/// What a client is born with.
struct Lives {
    name: String,
    peer: Peer,
    making: Making,
    weather: Weather,
    calm: bool,
    ledger: Ledger,
    chance: Rng,
}

impl Lives {
    async fn live(mut self) {
        for _ in 0..self.chance.usize(1..5) {
            tokio::time::sleep(Duration::from_millis(self.chance.u64(0..500))).await;
            if !self.calm && self.chance.u32(0..10) == 0 {
                // the system has no descriptor, or the peer has gone again
                let code = *self.chance.choice(&[24, 103]).expect("two");
                let _ = self.making.try_send(Err(io::Error::from_raw_os_error(code)));
            }
            let (near, far, cable) = network::connection(self.weather, &mut self.chance);
            if self.making.try_send(Ok((far, self.peer))).is_err() {
                continue;
            }
            if !self.calm && self.chance.u32(0..8) == 0 {
                hostile::attack(near, &mut self.chance, &self.ledger, &self.name).await;
                drop(cable);
                continue;
            }
            let who = (self.ledger.clone(), self.chance.fork(), self.name.clone(), self.calm);
            let Some(mut client) = Client::connect(near, cable, who).await else { continue };
            for _ in 0..self.chance.usize(1..8) {
                if !client.act().await {
                    break;
                }
                tokio::time::sleep(Duration::from_millis(self.chance.u64(0..400))).await;
            }
        }
    }
}
