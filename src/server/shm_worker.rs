//! The process that serves shared memory for a server; see `shm_host`.

use std::io::{BufRead, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::sys::signal::{SigSet, Signal};

use super::shm_link::{Counted, Order, Report, Start};
use crate::config::Config;
use crate::engine::Engine;
use crate::metrics::{Metrics, Transport};
use crate::service::admin::Reloader;
use crate::service::shm::{Opening, ShmServer};
use crate::service::shm_owner::Owner;
use crate::service::shm_probe::{Own, Probe, Probed, Pulse, Stall};
use crate::service::shm_remains::{self, Remains, ServiceFiles};
use wade_core::model::kernel::Isa;
use wade_wire::shm::room;

/// How often requests are reported.
const REPORT: Duration = Duration::from_millis(100);
/// How often the thread that answers is looked at.
const LOOK: Duration = Duration::from_millis(50);
/// Looks between two questions of the server's own client, and how long it waits where nothing else tells.
const LOOKS_PER_QUESTION: u32 = 5;
const PATIENCE: Duration = Duration::from_secs(2);
/// Questions without an answer, one after the other, after which the services are opened again.
const UNANSWERED: u32 = 2;
/// The same of questions for which the client could not connect.
const UNCONNECTED: u32 = 4;

/// Why requests are refused over shared memory, as metrics have it.
const INVALID: &str = "invalid_argument";

/// Exit status of a process that has said why it cannot serve.
const UNAVAILABLE: i32 = 2;
/// Exit status of a process whose server ended or did not answer.
const BROKEN: i32 = 3;

/// Serves shared memory until standard input ends.
#[derive(Debug)]
pub struct Worker(Start);

impl Worker {
    /// Reads the settings from standard input. From here on the process ends with its server, and with nothing else.
    pub fn read() -> std::io::Result<Self> {
        // a terminal and a service manager send these to every process of the server
        let signals = [
            Signal::SIGTERM,
            Signal::SIGINT,
            Signal::SIGQUIT,
            Signal::SIGHUP,
            Signal::SIGUSR1,
            Signal::SIGUSR2,
        ];
        SigSet::from_iter(signals).thread_block()?;
        nix::sys::prctl::set_pdeathsig(Signal::SIGKILL)?;
        let mut line = String::new();
        std::io::stdin().lock().read_line(&mut line)?;
        let start: Start = serde_json::from_str(&line)?;
        if nix::unistd::getppid().as_raw().unsigned_abs() != start.server {
            return Err(std::io::Error::other("its server has ended"));
        }
        Ok(Self(start))
    }

    /// The settings of the server.
    pub fn config(&self) -> &Config {
        &self.0.config
    }

    /// Serves, and ends the process.
    pub fn run(self) -> ! {
        let Start { config, vehicles, server, crashed, former } = self.0;
        let (engine, metrics) = (Arc::new(Engine::default()), Arc::new(Metrics::new()));
        let isa = Isa::available()[0];
        let reloader = Reloader::new(
            config.named_vehicles().map(Path::to_owned),
            isa,
            config.physics,
            Arc::clone(&engine),
            Arc::clone(&metrics),
        );
        for vehicle in &vehicles {
            load(&reloader, vehicle);
        }
        let mut owner = Owner::new(&config.shm.namespace, server).unwrap_or_else(|error| unavailable(&error));
        room::check(vehicles.len()).unwrap_or_else(|error| unavailable(&error));
        let former: Vec<u32> = former.into_iter().chain(owner.former().iter().copied()).collect();
        for process in &former {
            shm_remains::remove_untold_of(*process);
        }
        owner.forget_former(server);
        let owner = Arc::new(owner);
        let remains = Remains { crashed, former };
        let (stop, own, pulse) =
            (Arc::new(AtomicBool::new(false)), Own::default(), Arc::new(Pulse::default()));
        let watching: Arc<Mutex<Option<Watching>>> = Arc::default();
        let counts = Arc::new(Counts::new(Arc::clone(&metrics)));
        let serving = {
            let (stop, counts, settings) = (Arc::clone(&stop), Arc::clone(&counts), config.shm.clone());
            let (engine, owner) = (Arc::clone(&engine), Arc::clone(&owner));
            let watch = Arc::clone(&watching);
            std::thread::Builder::new().name("wade-shm".into()).spawn(move || {
                // a panic must not leave a process that serves nothing
                let _end = EndOfServing(Arc::clone(&stop));
                let open = |remains| {
                    let (metrics, own, pulse) = (Arc::clone(&metrics), Arc::clone(&own), Arc::clone(&pulse));
                    let opening = Opening { metrics, remains, own, pulse };
                    ShmServer::new(settings.clone(), Arc::clone(&engine), opening)
                };
                let opened = open(remains.clone()).or_else(|error| {
                    // a dead server may keep its place in a service whatever iceoryx2 tries
                    tracing::warn!(%error, "all services are created again");
                    open(Remains { crashed: true, ..remains })
                });
                let server = opened.unwrap_or_else(|error| unavailable(&error));
                say(&Report::Opened);
                let (namespace, files) = (settings.namespace, server.files());
                let thread = start_watching(Watched { namespace, engine, owner, files, own, pulse });
                *watch.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread);
                start_reporting(counts);
                if !crashed {
                    start_clearing(Arc::clone(&stop));
                }
                server.run(&stop);
            })
        };
        let serving = serving.unwrap_or_else(|error| unavailable(&error));
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            match serde_json::from_str(&line) {
                Ok(order) => obey(&reloader, &engine, order),
                Err(error) => tracing::warn!(%error, line, "an order of the server"),
            }
        }
        // the server's own client goes first, so that the last of all ports is the server's
        let watching = watching.lock().unwrap_or_else(PoisonError::into_inner).take();
        drop(watching);
        stop.store(true, Ordering::Relaxed);
        let ended = serving.join();
        counts.report();
        drop(owner);
        std::process::exit(if ended.is_ok() { 0 } else { BROKEN })
    }
}

/// Ends the process where its serving thread ends unasked, by a panic too.
struct EndOfServing(Arc<AtomicBool>);

impl Drop for EndOfServing {
    fn drop(&mut self) {
        if !self.0.load(Ordering::Relaxed) {
            std::process::exit(BROKEN);
        }
    }
}

/// Says why there is no shared memory, and ends the process.
fn unavailable(error: &dyn std::fmt::Display) -> ! {
    say(&Report::Unavailable(error.to_string()));
    std::process::exit(UNAVAILABLE)
}

/// Writes a report; a server that does not read has ended, and so does this process.
fn say(report: &Report) {
    let written = serde_json::to_string(report).map_err(std::io::Error::from).and_then(|line| {
        let mut out = std::io::stdout().lock();
        out.write_all((line + "\n").as_bytes())?;
        out.flush()
    });
    if written.is_err() {
        std::process::exit(UNAVAILABLE);
    }
}

fn load(reloader: &Reloader, vehicle: &str) -> Option<u32> {
    let reloads = reloader.reload(vehicle).unwrap_or_default();
    for refusal in reloads.iter().filter_map(|reload| reload.refusal.as_ref()) {
        tracing::warn!(vehicle, %refusal, "over shared memory");
    }
    reloads.first().map(|reload| reload.served_version)
}

fn obey(reloader: &Reloader, engine: &Engine, order: Order) {
    let Order { number, vehicle, serve } = order;
    if serve {
        load(reloader, &vehicle);
    } else {
        // one that is not served is as good as unloaded
        let _ = reloader.unload(&vehicle);
    }
    let version = engine.vehicle(&vehicle).ok().map(|served| served.model().version());
    say(&Report::Done { number, version });
}

/// What has been reported of the requests.
struct Counts {
    metrics: Arc<Metrics>,
    /// Refusals so far, of single queries and of batches.
    refused: Mutex<[u64; 2]>,
}

impl Counts {
    fn new(metrics: Arc<Metrics>) -> Self {
        Self { metrics, refused: Mutex::default() }
    }

    /// Reports what has come since the last report.
    fn report(&self) {
        let mut refused = self.refused.lock().unwrap_or_else(PoisonError::into_inner);
        for (before, (transport, batch)) in
            refused.iter_mut().zip([(Transport::shm, false), (Transport::shm_batch, true)])
        {
            for (vehicle, recorder) in self.metrics.recorders(transport) {
                let (times, outside) = recorder.drain();
                if !times.is_empty() {
                    say(&Report::Counted(Counted { vehicle, batch, times, outside }));
                }
            }
            let now = self.metrics.refused(transport, INVALID);
            if now > *before {
                say(&Report::Refused { batch, requests: now - *before });
                *before = now;
            }
        }
    }
}

fn start_reporting(counts: Arc<Counts>) {
    start("wade-shm-counts", move || {
        loop {
            std::thread::sleep(REPORT);
            counts.report();
        }
    });
}

fn start_clearing(stop: Arc<AtomicBool>) {
    start("wade-shm-remains", move || shm_remains::clear(&stop));
}

fn start(name: &str, body: impl FnOnce() + Send + 'static) -> JoinHandle<()> {
    let thread = std::thread::Builder::new().name(name.into()).spawn(body);
    thread.unwrap_or_else(|error| unavailable(&format_args!("cannot start a thread: {error}")))
}

/// What shows that shared memory is served.
struct Watched {
    namespace: String,
    engine: Arc<Engine>,
    owner: Arc<Owner>,
    files: ServiceFiles,
    own: Own,
    pulse: Arc<Pulse>,
}

/// A thread that ends, and is waited for, when this is dropped.
struct Watching {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Watching {
    fn drop(&mut self) {
        self.stop = None;
        // one that panicked has nothing left to end
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Asks the server as a client does, and ends the process where that finds what a client would suffer from. Returns once the
/// server's own client is connected: its place is taken before another client can be answered.
fn start_watching(watched: Watched) -> Watching {
    let (stop, stopped) = channel::<()>();
    let (connected, is_connected) = channel::<()>();
    let thread = start("wade-shm-watch", move || {
        let stall = Stall::new(Arc::clone(&watched.pulse));
        let mut asking = Asking { probe: None, unanswered: 0, stall };
        asking.connect(&watched);
        drop(connected);
        for look in 0_u32.. {
            if look.is_multiple_of(LOOKS_PER_QUESTION) {
                if !watched.owner.is_in_place() || !watched.files.are_in_place() {
                    unavailable(&"its files were removed or replaced by somebody else; they are made again");
                }
                asking.ask(&watched);
            }
            if asking.stall.is_there() {
                std::process::exit(BROKEN);
            }
            if stopped.recv_timeout(LOOK) != Err(RecvTimeoutError::Timeout) {
                break;
            }
        }
    });
    // ends with the sender
    let _ = is_connected.recv();
    Watching { stop: Some(stop), thread: Some(thread) }
}

struct Asking {
    probe: Option<(String, Probe)>,
    unanswered: u32,
    stall: Stall,
}

impl Asking {
    /// Connects to the first vehicle, or stays with one that is still served. False where there is nothing to ask, which is
    /// no fault: without a vehicle, and where other clients have every place.
    fn connect(&mut self, watched: &Watched) -> bool {
        let Watched { namespace, engine, own, .. } = watched;
        let vehicles = engine.vehicles();
        if self.probe.as_ref().is_some_and(|(vehicle, _)| vehicles.contains_key(vehicle)) {
            return true;
        }
        self.probe = None;
        let Some(vehicle) = vehicles.keys().next() else { return false };
        match Probe::new(namespace, vehicle, own) {
            Ok(Some(probe)) => self.probe = Some((vehicle.clone(), probe)),
            Ok(None) => {
                tracing::debug!(vehicle, "other clients have every place: the server is not asked");
                return false;
            }
            Err(error) => tracing::debug!(%error, "the server's own client"),
        }
        true
    }

    fn ask(&mut self, watched: &Watched) {
        while self.connect(watched) {
            let start = Instant::now();
            let Some((_, probe)) = &mut self.probe else {
                // a client that cannot connect tries again with the next question
                self.unanswered += 1;
                if self.unanswered > UNCONNECTED {
                    std::process::exit(BROKEN);
                }
                return;
            };
            let probed = probe.ask(PATIENCE, &mut self.stall);
            if probed == Probed::Answered {
                break;
            }
            tracing::debug!(elapsed = ?start.elapsed(), ?probed, "the server's own client has no answer");
            self.probe = None;
            self.unanswered += 1;
            if probed == Probed::Stalled || self.unanswered >= UNANSWERED {
                std::process::exit(BROKEN);
            }
        }
        self.unanswered = 0;
        say(&Report::Answered);
    }
}
