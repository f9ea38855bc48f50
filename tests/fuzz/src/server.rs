//! A server with the shipped vehicles, once a process, and how long it may take.

use std::io::{ErrorKind, Read};
use std::net::SocketAddr;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use tempfile::TempDir;
use wade::config::Config;
use wade::server::{self, Running};

/// Longest wait for an answer or the end of a connection, below libFuzzer's own: a machine that is busy is no finding, and one
/// that builds beside it made a reload take more than 20 s.
pub const PATIENCE: Duration = Duration::from_secs(80);

/// The folder of the shipped vehicles.
pub fn vehicles() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles")
}

struct Served {
    running: Running,
    _folder: TempDir,
}

fn served() -> &'static Served {
    static SERVED: OnceLock<Served> = OnceLock::new();
    SERVED.get_or_init(|| {
        let folder = TempDir::new().expect("a temporary folder");
        let mut config = Config { vehicles: vehicles(), ..Config::default() };
        config.grpc.listen = String::new();
        config.grpc.unix_socket = folder.path().join("wade.sock");
        config.http.listen = "127.0.0.1:0".into();
        config.shm.enabled = false;
        // what slows a flood down has its own tests
        config.grpc.control_frames_per_s = 1e6;
        config.validate().expect("a valid configuration");
        let running = server::start(&config).expect("the server starts");
        Served { running, _folder: folder }
    })
}

/// A new connection to gRPC.
pub fn grpc() -> UnixStream {
    let stream =
        UnixStream::connect(served().running.unix_path().expect("the socket is on")).expect("a connection");
    for set in [UnixStream::set_read_timeout, UnixStream::set_write_timeout] {
        set(&stream, Some(PATIENCE)).expect("a socket");
    }
    stream
}

/// Where HTTP is.
pub fn http() -> SocketAddr {
    served().running.http_address().expect("HTTP is on")
}

/// Reads until the other side ends the connection, as it must.
pub fn read_to_end(stream: &mut impl Read) -> Vec<u8> {
    let (mut bytes, mut piece) = (Vec::new(), vec![0; 64 << 10]);
    loop {
        match stream.read(&mut piece) {
            Ok(0) => return bytes,
            Ok(len) => bytes.extend_from_slice(&piece[..len]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                panic!("the connection is still open after {PATIENCE:?}, {} bytes came", bytes.len())
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // reset
            Err(_) => return bytes,
        }
    }
}
