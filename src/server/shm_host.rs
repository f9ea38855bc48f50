//! Shared memory is served by a process of its own, because a process that maps what others can write cannot be sure to
//! live: a page without memory behind it or a damaged segment ends it at any instruction. This side starts that process,
//! passes changes of bundles on to it, counts its requests, and starts it again when it has ended or does not answer.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::time::{Duration, Instant};

use nix::errno::Errno;

use super::shm_link::{Counted, Order, Report, Start};
use crate::config::Config;
use crate::engine::Engine;
use crate::metrics::{Metrics, Transport};
use crate::service::health::{Health, Part, State};

/// The hidden command that serves shared memory.
pub(super) const COMMAND: &str = "serve-shm";

/// Pause before the process is started again: the first, and the longest after it was doubled at each start that failed.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LAST_PAUSE: Duration = Duration::from_secs(5);
/// The longest before one is that had served.
const LAST_PAUSE_OF_OPENED: Duration = Duration::from_millis(400);

/// A process that has served for this long is not in a row of those that end.
const STEADY: Duration = Duration::from_secs(3);

/// How often deadlines are looked at.
const LOOK: Duration = Duration::from_millis(50);

/// A process that has not opened its services, or answered its own question, for this long is ended; it asks four times a second.
const SILENCE: Duration = Duration::from_secs(6);

/// Longest wait of a reload for the process.
const RELOADING: Duration = Duration::from_secs(2);

/// What ends the process after the bound of the drain.
const GRACE: Duration = Duration::from_millis(500);

enum Message {
    /// The process of this number has said something.
    Report(u32, Report),
    /// The process of this number has closed its output.
    Ended(u32),
    /// A bundle has changed; the version that is served is sent back.
    Change(String, SyncSender<Option<u32>>),
    /// The server stops.
    Stop,
}

/// Speaks to the thread that keeps the process.
#[derive(Debug, Clone)]
pub(super) struct Host {
    messages: Sender<Message>,
}

impl Host {
    /// Passes on that a vehicle was loaded, reloaded or unloaded, and waits until it is so over shared memory too.
    pub(super) fn change(&self, vehicle: &str) {
        let (done, served) = sync_channel(1);
        // a keeper that is gone keeps nothing
        if self.messages.send(Message::Change(vehicle.to_owned(), done)).is_ok() {
            let _ = served.recv_timeout(RELOADING);
        }
    }

    /// Ends the process once it has answered what has come in.
    pub(super) fn stop(&self) {
        let _ = self.messages.send(Message::Stop);
    }
}

/// Keeps the process; lives on a thread of its own.
pub(super) struct Keeper {
    config: Config,
    engine: Arc<Engine>,
    metrics: Arc<Metrics>,
    health: Arc<Health>,
    sender: Sender<Message>,
    messages: Receiver<Message>,
    /// Processes that crashed.
    former: Vec<u32>,
    next_order: u64,
    waiting: Vec<(u64, SyncSender<Option<u32>>)>,
}

/// Why the process ended.
enum End {
    /// The server stops.
    Stopped,
    /// It could not serve.
    Unavailable(String),
    /// It should not have ended.
    Crashed {
        /// Whether it served before.
        opened: bool,
        /// What is known of the reason.
        reason: String,
    },
}

/// A process that runs.
struct Running {
    child: Child,
    orders: Option<ChildStdin>,
    opened: bool,
    /// When it last said that it answers.
    heard: Instant,
    unavailable: Option<String>,
    /// When it is killed, where it is to end.
    killed_at: Option<Instant>,
}

impl Keeper {
    /// A keeper, and what speaks to it.
    pub(super) fn new(
        config: &Config,
        engine: Arc<Engine>,
        metrics: Arc<Metrics>,
        health: Arc<Health>,
    ) -> (Self, Host) {
        let (sender, messages) = channel();
        let host = Host { messages: sender.clone() };
        let config = config.clone();
        let (former, waiting) = (Vec::new(), Vec::new());
        (Self { config, engine, metrics, health, sender, messages, former, next_order: 0, waiting }, host)
    }

    /// Keeps the process until the server stops.
    pub(super) fn run(mut self) {
        let (mut pause, mut crashed) = (FIRST_PAUSE, false);
        loop {
            let start = Instant::now();
            let end = self.serve(crashed);
            self.waiting.clear();
            let reason = match end {
                End::Stopped => return,
                End::Unavailable(reason) => reason,
                End::Crashed { opened, reason } => {
                    // what others wrote ended it: that costs its clients half a second more at most, however often
                    pause = if opened { pause.min(LAST_PAUSE_OF_OPENED) } else { pause };
                    crashed = true;
                    reason
                }
            };
            self.health.set(Part::Shm, State::Unavailable(reason));
            self.metrics.count_shm_restart();
            if start.elapsed() >= STEADY {
                pause = FIRST_PAUSE;
            }
            if self.stops_within(pause) {
                return;
            }
            pause = (2 * pause).min(LAST_PAUSE);
        }
    }

    /// Waits; true where the server stops meanwhile.
    fn stops_within(&self, pause: Duration) -> bool {
        let end = Instant::now() + pause;
        loop {
            match self.messages.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(Message::Stop) | Err(RecvTimeoutError::Disconnected) => return true,
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => return false,
            }
        }
    }

    fn serve(&mut self, crashed: bool) -> End {
        let mut running = match self.start(crashed) {
            Ok(running) => running,
            Err(error) => {
                return End::Unavailable(format!("its process cannot be started: {}", in_words(&error)));
            }
        };
        let number = running.child.id();
        let mut silent = false;
        loop {
            match self.messages.recv_timeout(LOOK) {
                Ok(Message::Report(of, report)) if of == number => self.hear(&mut running, report),
                Ok(Message::Ended(of)) if of == number => break,
                Ok(Message::Report(..) | Message::Ended(_)) | Err(RecvTimeoutError::Timeout) => {}
                Ok(Message::Change(vehicle, done)) => self.order(&mut running, vehicle, done),
                Ok(Message::Stop) | Err(RecvTimeoutError::Disconnected) => {
                    // the end of its input asks the process to end
                    running.orders = None;
                    let drain = Duration::from_secs_f64(self.config.drain_s);
                    running.killed_at = Some(Instant::now() + drain + GRACE);
                }
            }
            if !silent && running.killed_at.is_none() && running.heard.elapsed() > SILENCE {
                (silent, running.killed_at) = (true, Some(Instant::now()));
            }
            if running.killed_at.is_some_and(|at| Instant::now() >= at) {
                let _ = running.child.kill();
            }
        }
        let stops = running.orders.is_none();
        let status = running.child.wait();
        if stops {
            return End::Stopped;
        }
        if let Some(reason) = running.unavailable.take_if(|_| !running.opened) {
            return End::Unavailable(reason);
        }
        // it left everything as it was
        self.former.push(number);
        let reason = if let Some(reason) = running.unavailable {
            reason
        } else if silent {
            "its process did not answer its own question and was ended; it is started again".to_owned()
        } else {
            format!("its process ended{}; it is started again", described(status.ok()))
        };
        End::Crashed { opened: running.opened, reason }
    }

    fn start(&self, crashed: bool) -> std::io::Result<Running> {
        let mut command = Command::new(&self.config.shm.program);
        let mut child = command.arg(COMMAND).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let number = child.id();
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let sender = self.sender.clone();
        let reading = std::thread::Builder::new().name("wade-shm-reports".into()).spawn(move || {
            for line in
                output.into_iter().flat_map(|output| BufReader::new(output).lines()).map_while(Result::ok)
            {
                match serde_json::from_str(&line) {
                    Ok(report) => drop(sender.send(Message::Report(number, report))),
                    Err(error) => tracing::warn!(%error, line, "the process of shared memory"),
                }
            }
            let _ = sender.send(Message::Ended(number));
        });
        let mut running = Running {
            child,
            orders: input,
            opened: false,
            heard: Instant::now(),
            unavailable: None,
            killed_at: None,
        };
        if let Err(error) = reading {
            let _ = running.child.kill();
            let _ = running.child.wait();
            return Err(error);
        }
        let start = Start {
            config: self.config.clone(),
            vehicles: self.engine.vehicles().keys().cloned().collect(),
            server: std::process::id(),
            crashed,
            former: self.former.clone(),
        };
        running.write(&start);
        Ok(running)
    }

    fn hear(&mut self, running: &mut Running, report: Report) {
        match report {
            Report::Opened => {
                (running.opened, running.heard) = (true, Instant::now());
                self.health.set(Part::Shm, State::Ok);
            }
            Report::Unavailable(reason) => running.unavailable = Some(reason),
            Report::Answered => running.heard = Instant::now(),
            Report::Done { number, version } => {
                if let Some(place) = self.waiting.iter().position(|(waiting, _)| *waiting == number) {
                    let _ = self.waiting.swap_remove(place).1.send(version);
                }
            }
            Report::Counted(counted) => {
                let Counted { vehicle, batch, times, outside } = counted;
                self.metrics.recorder(transport(batch), &vehicle).record_all(&times, outside);
            }
            Report::Refused { batch, requests } => {
                for _ in 0..requests {
                    self.metrics.refuse(transport(batch), "invalid_argument");
                }
            }
        }
    }

    fn order(&mut self, running: &mut Running, vehicle: String, done: SyncSender<Option<u32>>) {
        self.next_order += 1;
        let serve = self.engine.vehicle(&vehicle).is_ok();
        running.write(&Order { number: self.next_order, vehicle, serve });
        self.waiting.push((self.next_order, done));
    }
}

fn transport(batch: bool) -> Transport {
    if batch { Transport::shm_batch } else { Transport::shm }
}

impl Running {
    /// Writes a line; a process that does not read it has ended, which shows at its output.
    fn write(&mut self, line: &impl serde::Serialize) {
        let Some(orders) = &mut self.orders else { return };
        let written = serde_json::to_string(line)
            .map_err(std::io::Error::from)
            .and_then(|text| orders.write_all((text + "\n").as_bytes()));
        if let Err(error) = written {
            tracing::debug!(%error, "the process of shared memory does not read");
        }
    }
}

/// What the system calls too many open files concerns sockets and pipes as well.
fn in_words(error: &std::io::Error) -> String {
    match error.raw_os_error().map(Errno::from_raw) {
        Some(Errno::EMFILE | Errno::ENFILE) => {
            "the limit of open file descriptors is reached; raise it (ulimit -n, LimitNOFILE=)".to_owned()
        }
        _ => error.to_string(),
    }
}

fn described(status: Option<ExitStatus>) -> String {
    let Some(status) = status else { return String::new() };
    match (status.signal().map(nix::sys::signal::Signal::try_from), status.code()) {
        (Some(Ok(signal)), _) => format!(" by {signal}"),
        (_, Some(code)) => format!(" with status {code}"),
        _ => format!(": {status}"),
    }
}
