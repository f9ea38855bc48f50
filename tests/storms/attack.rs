//! What a bad neighbour sends: frames by hand (RFC 9113), since no client library sends such things.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

use crate::http2::{PREFACE, call, frame, message};

/// A field of protobuf that is a string.
pub fn text(field: u8, value: &str) -> Vec<u8> {
    [&[field << 3 | 2, value.len() as u8][..], value.as_bytes()].concat()
}

/// Where a server listens.
#[derive(Debug, Clone)]
pub enum Target {
    Tcp(SocketAddr),
    Unix(PathBuf),
}

trait Duplex: Read + Write + Send {}
impl<T: Read + Write + Send> Duplex for T {}

/// A connection that never blocks.
pub struct Wire(Box<dyn Duplex>);

impl Wire {
    pub fn open(target: &Target) -> std::io::Result<Self> {
        Ok(Self(match target {
            Target::Tcp(address) => {
                let stream = TcpStream::connect_timeout(address, Duration::from_secs(5))?;
                stream.set_nonblocking(true)?;
                Box::new(stream)
            }
            Target::Unix(path) => {
                let stream = UnixStream::connect(path)?;
                stream.set_nonblocking(true)?;
                Box::new(stream)
            }
        }))
    }

    /// As an HTTP/2 client that has shaken hands.
    pub fn greeted(target: &Target) -> std::io::Result<Self> {
        let mut wire = Self::open(target)?;
        let greeting = [PREFACE, &frame(4, 0, 0, &[])].concat();
        wire.send_all(&greeting)?;
        Ok(wire)
    }

    /// Sends as much as fits; how much that was.
    pub fn send(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self.0.write(bytes) {
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(0),
            sent => sent,
        }
    }

    /// Sends all of a few bytes to a peer that reads.
    pub fn send_all(&mut self, mut bytes: &[u8]) -> std::io::Result<()> {
        for _ in 0..1000 {
            let sent = self.send(bytes)?;
            bytes = &bytes[sent..];
            if bytes.is_empty() {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(ErrorKind::TimedOut.into())
    }

    /// Takes what has arrived; false once the peer has closed.
    pub fn drain(&mut self) -> bool {
        let mut buffer = [0; 16 << 10];
        loop {
            match self.0.read(&mut buffer) {
                Ok(0) => return false,
                Ok(_) => {}
                Err(error) => return error.kind() == ErrorKind::WouldBlock,
            }
        }
    }
}

/// A kind of flood on each of some connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flood {
    Ping,
    Settings,
    WindowUpdate,
    Reset,
    EmptyData,
    Priority,
    Unknown,
    Continuation,
    Greeting,
    GetVehicle,
    Reload,
}

impl Flood {
    pub const ALL: [Self; 11] = [
        Self::Ping,
        Self::Settings,
        Self::WindowUpdate,
        Self::Reset,
        Self::EmptyData,
        Self::Priority,
        Self::Unknown,
        Self::Continuation,
        Self::Greeting,
        Self::GetVehicle,
        Self::Reload,
    ];

    /// What precedes the flood on a connection, and the flood from this stream on: about 16 kB.
    fn frames(self, stream: &mut u32) -> Vec<u8> {
        let mut next = || {
            *stream += 2;
            *stream
        };
        match self {
            Self::Ping => frame(6, 0, 0, &[7; 8]).repeat(960),
            Self::Settings => frame(4, 0, 0, &[]).repeat(1800),
            Self::WindowUpdate => frame(8, 0, 0, &1_u32.to_be_bytes()).repeat(1260),
            Self::EmptyData => frame(0, 0, 1, &[]).repeat(1800),
            Self::Priority => frame(2, 0, 3, &[0, 0, 0, 1, 7]).repeat(1170),
            Self::Unknown => frame(0xf0, 0, 0, &[]).repeat(1800),
            Self::Continuation => {
                [frame(1, 0, next(), &[0x83]), frame(9, 0, *stream, &[]).repeat(1800)].concat()
            }
            Self::Greeting => Vec::new(),
            Self::GetVehicle => {
                let body = [text(1, "husky"), vec![2 << 3, 1]].concat();
                let of = |id: u32| {
                    [call(id, "/wade.v1.Hydrodynamics/GetVehicle"), message(id, &body, true)].concat()
                };
                (0..64).flat_map(|_| of(next())).collect()
            }
            Self::Reset => {
                let pair = |id| {
                    [call(id, "/wade.v1.Hydrodynamics/GetVehicle"), frame(3, 0, id, &8_u32.to_be_bytes())]
                };
                (0..128).flat_map(|_| pair(next()).concat()).collect()
            }
            Self::Reload => {
                let pair = |id| [call(id, "/wade.v1.Admin/Reload"), message(id, &[], true)].concat();
                (0..64).flat_map(|_| pair(next())).collect()
            }
        }
    }

    fn prelude(self) -> Vec<u8> {
        match self {
            Self::EmptyData => call(1, "/wade.v1.Hydrodynamics/Stream"),
            _ => Vec::new(),
        }
    }

    /// Floods until `stop`, over a new connection whenever the server closes one. Says which CPU time that took [ns].
    pub fn run(self, target: &Target, connections: usize, stop: &AtomicBool) -> u64 {
        let mut wires: Vec<Option<(Wire, u32, Vec<u8>)>> = (0..connections).map(|_| None).collect();
        while !stop.load(Relaxed) {
            let mut idle = true;
            for slot in &mut wires {
                if slot.is_none() {
                    // a server that has no room is asked again
                    *slot = Wire::greeted(target).ok().map(|wire| (wire, 1, self.prelude()));
                }
                let Some((wire, stream, left)) = slot else { continue };
                if left.is_empty() {
                    *left = self.frames(stream);
                    // whoever only shakes hands is back at once
                    idle &= self != Self::Greeting;
                }
                match wire.send(left) {
                    Ok(sent) => {
                        idle &= sent == 0;
                        left.drain(..sent);
                    }
                    Err(_) => {
                        *slot = None;
                        continue;
                    }
                }
                if !wire.drain() || *stream > 1 << 30 || self == Self::Greeting {
                    *slot = None;
                }
            }
            if idle {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        cpu_ns()
    }
}

/// CPU time of the calling thread [ns].
pub fn cpu_ns() -> u64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("the kernel counts");
    text.split_whitespace().next().and_then(|ns| ns.parse().ok()).expect("the first number")
}

/// A port that floods cost nothing: connections are accepted, and so many a second are closed.
pub fn sink(closed_per_s: f64) -> Target {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound");
    std::thread::spawn(move || {
        let mut open = std::collections::VecDeque::new();
        let mut due = Instant::now();
        // for ever: it ends with the tests
        while let Ok((stream, _)) = listener.accept() {
            open.push_back(stream);
            if closed_per_s > 0.0 {
                due = due.max(Instant::now()) + Duration::from_secs_f64(1.0 / closed_per_s);
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
                open.pop_front();
            }
        }
    });
    Target::Tcp(address)
}

/// Burns this share of a core in this many threads until `stop`, by writing to a socket of its own.
pub fn burn(share: f64, stop: &AtomicBool) -> u64 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let mut sender = TcpStream::connect(listener.local_addr().expect("bound")).expect("connected");
    let (mut receiver, _) = listener.accept().expect("accepted");
    let (block, mut sink) = (vec![7; 16 << 10], vec![0; 16 << 10]);
    let start = Instant::now();
    while !stop.load(Relaxed) {
        if (cpu_ns() as f64) < share * start.elapsed().as_nanos() as f64 {
            sender.write_all(&block).expect("sent");
            receiver.read_exact(&mut sink).expect("received");
        } else {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    cpu_ns()
}

/// Connections that ask for vehicles and never read.
pub fn never_read(target: &Target, connections: usize, stop: &AtomicBool) -> u64 {
    let body = [text(1, "husky"), vec![2 << 3, 1]].concat();
    let calls = |from: u32| -> Vec<u8> {
        let of = |id: u32| [call(id, "/wade.v1.Hydrodynamics/GetVehicle"), message(id, &body, true)].concat();
        (0..30).flat_map(|index| of(from + 2 * index)).collect()
    };
    let mut wires: Vec<Option<Wire>> = (0..connections).map(|_| None).collect();
    while !stop.load(Relaxed) {
        for wire in &mut wires {
            if stop.load(Relaxed) {
                break;
            }
            let asked = wire.as_mut().map(|wire| wire.send(&frame(6, 0, 0, &[0; 8])));
            if !matches!(asked, Some(Ok(_))) {
                *wire = Wire::greeted(target).ok();
                if let Some(wire) = wire {
                    let _ = wire.send(&calls(1));
                }
            }
        }
        std::thread::sleep(Duration::from_millis(200));
    }
    cpu_ns()
}

/// HTTP requests whose bodies never come, `connections` at a time.
pub fn slow_bodies(address: SocketAddr, connections: usize, stop: &AtomicBool) -> u64 {
    let head = b"POST /v1/query HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 1000\r\n\r\n{";
    let mut wires: Vec<Option<Wire>> = (0..connections).map(|_| None).collect();
    while !stop.load(Relaxed) {
        for wire in &mut wires {
            if !wire.as_mut().is_some_and(Wire::drain) {
                *wire = Wire::open(&Target::Tcp(address)).ok();
                if let Some(wire) = wire {
                    let _ = wire.send(head);
                }
            }
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    cpu_ns()
}

/// Streams that are opened and never used, as many as a server admits; they are opened again when they are ended.
pub fn idle_streams(target: &Target, streams: usize, stop: &AtomicBool) -> u64 {
    let mut wires: Vec<Option<Wire>> = (0..streams.div_ceil(16)).map(|_| None).collect();
    while !stop.load(Relaxed) {
        for wire in &mut wires {
            if !wire.as_mut().is_some_and(Wire::drain) {
                *wire = Wire::greeted(target).ok();
                let calls = (0..16).flat_map(|index| call(1 + 2 * index, "/wade.v1.Hydrodynamics/Stream"));
                if let Some(wire) = wire {
                    let _ = wire.send_all(&calls.collect::<Vec<u8>>());
                }
            }
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    cpu_ns()
}

/// An attack on threads of its own; dropping it ends it.
pub struct Attack {
    stop: Arc<AtomicBool>,
    cpu_ns: Arc<AtomicU64>,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Attack {
    pub fn start(threads: usize, body: impl Fn(&AtomicBool) -> u64 + Send + Sync + 'static) -> Self {
        let (stop, cpu_ns) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let body = Arc::new(body);
        let thread = |_| {
            let (stop, cpu_ns, body) = (Arc::clone(&stop), Arc::clone(&cpu_ns), Arc::clone(&body));
            std::thread::spawn(move || {
                cpu_ns.fetch_add(body(&stop), Relaxed);
            })
        };
        let threads = (0..threads).map(thread).collect();
        Self { stop, cpu_ns, threads }
    }

    /// Ends it and says which CPU time it took [s].
    pub fn end(mut self) -> f64 {
        self.join();
        self.cpu_ns.load(Relaxed) as f64 * 1e-9
    }

    fn join(&mut self) {
        self.stop.store(true, Relaxed);
        for thread in self.threads.drain(..) {
            thread.join().expect("the attack does not panic");
        }
    }
}

impl Drop for Attack {
    fn drop(&mut self) {
        self.join();
    }
}
