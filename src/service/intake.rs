//! Where connections come in: the sockets, and the loop that accepts them. A loop that can have no descriptor waits longer
//! and longer instead of spinning, closes whoever asks nothing, and has a few descriptors of its own for HTTP, so that
//! probes are answered meanwhile.

use std::fs::File;
use std::io::{self, IoSlice};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use rustix::net::sockopt::{set_socket_recv_buffer_size, set_socket_send_buffer_size};
use tokio::io::{AsyncRead, AsyncWrite, DuplexStream, ReadBuf};
use tokio::net::{TcpListener, TcpStream, UnixListener, UnixStream};
use tokio::sync::{Mutex, mpsc};
use tokio_rustls::TlsStream;

use super::accounts::{Accounts, Closed, Connection, Peer, Place};
use crate::metrics::Resource;

/// First pause where the system has no descriptor for a connection; each further one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(10);
/// Longest such pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);
/// Time between two connections while all places are taken, or after one ended by its peer's fault.
const PACE: Duration = Duration::from_millis(50);
/// Descriptors that are held for probes.
const RESERVE: usize = 4;

/// What the system holds of a connection in each direction [bytes], as far ahead as HTTP/2 lets a peer send.
const SOCKET_BUFFER: usize = 256 << 10;

/// A connection of either kind.
#[derive(Debug)]
pub enum Socket {
    /// TCP, without delay.
    Tcp(TcpStream),
    /// The same, encrypted.
    Tls(Box<TlsStream<TcpStream>>),
    /// The Unix socket.
    Unix(UnixStream),
    /// Memory.
    Memory(DuplexStream),
}

/// Connections that are made in memory, with who is at their other end: those of a simulation.
pub type Made = Mutex<mpsc::Receiver<io::Result<(DuplexStream, Peer)>>>;

/// A listener of either kind.
#[derive(Debug)]
pub enum Listener {
    /// TCP.
    Tcp(TcpListener),
    /// The Unix socket.
    Unix(UnixListener),
    /// Whoever makes connections in memory.
    Memory(Arc<Made>),
}

/// Listens on TCP. What the system holds for a peer that does not read, or sends faster than it is read, counts in no account
/// of ours: it is bounded here, where the system would go to megabytes a connection.
pub fn listen_on_tcp(address: SocketAddr) -> io::Result<std::net::TcpListener> {
    let listener = std::net::TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    set_socket_recv_buffer_size(&listener, SOCKET_BUFFER)?;
    set_socket_send_buffer_size(&listener, SOCKET_BUFFER)?;
    Ok(listener)
}

impl Listener {
    /// The next connection and who is at its other end. Without TCP_NODELAY answers would wait up to 41 ms for a delayed
    /// acknowledgement.
    pub async fn accept(&self) -> io::Result<(Socket, Peer)> {
        match self {
            Self::Tcp(listener) => {
                let (stream, address) = listener.accept().await?;
                stream.set_nodelay(true)?;
                Ok((Socket::Tcp(stream), Peer::of(address)))
            }
            Self::Unix(listener) => {
                let (stream, _) = listener.accept().await?;
                let pid = stream.peer_cred().ok().and_then(|peer| peer.pid()).unwrap_or(0);
                Ok((Socket::Unix(stream), Peer::Process(pid)))
            }
            Self::Memory(made) => match made.lock().await.recv().await {
                Some(made) => made.map(|(stream, peer)| (Socket::Memory(stream), peer)),
                // whoever made them has gone
                None => std::future::pending().await,
            },
        }
    }
}

/// Descriptors that the process can do without for a moment.
#[derive(Debug, Default)]
struct Reserve(Vec<File>);

impl Reserve {
    fn fill(&mut self) {
        while self.0.len() < RESERVE {
            match File::open("/dev/null") {
                Ok(file) => self.0.push(file),
                Err(_) => return,
            }
        }
    }
}

/// Accepts connections for ever, and hands each to `serve` with its account and its place.
pub async fn accept_all(
    listener: Listener,
    accounts: Arc<Accounts>,
    kind: Resource,
    serve: impl Fn(Socket, Arc<Connection>, Place),
) {
    let mut reserve = Reserve::default();
    let mut pause = FIRST_PAUSE;
    let has_reserve = kind == Resource::http_connections;
    if has_reserve {
        reserve.fill();
    }
    loop {
        match listener.accept().await {
            Ok((socket, peer)) => {
                pause = FIRST_PAUSE;
                // not before: it would take what was given up for this one
                if has_reserve {
                    reserve.fill();
                }
                match accounts.open(peer, kind).await {
                    Ok((connection, place)) => serve(socket, connection, place),
                    Err(refused) => {
                        accounts.metrics().count_closed(Closed::no_room);
                        tracing::warn!(%peer, kind = kind.name(), %refused, "a connection was refused");
                    }
                }
                if kind == Resource::connections && (accounts.take_fault() || accounts.is_full(kind)) {
                    // whoever connects without end must not keep the thread
                    tokio::time::sleep(PACE).await;
                } else {
                    tokio::task::yield_now().await;
                }
            }
            Err(error) => {
                accounts.metrics().count_accept_error();
                tracing::warn!(%error, kind = kind.name(), "no connection could be accepted");
                if is_exhausted(&error) {
                    accounts.make_room_for_descriptor();
                    if reserve.0.pop().is_some() {
                        continue;
                    }
                    tokio::time::sleep(pause).await;
                    pause = (2 * pause).min(LONGEST_PAUSE);
                }
            }
        }
    }
}

/// Whether there is no descriptor, or no memory for one.
fn is_exhausted(error: &io::Error) -> bool {
    use nix::libc::{EMFILE, ENFILE, ENOBUFS, ENOMEM};
    error.raw_os_error().is_some_and(|code| [EMFILE, ENFILE, ENOBUFS, ENOMEM].contains(&code))
}

/// The same call on whichever socket it is.
macro_rules! either {
    ($self:ident, $call:ident ( $($argument:expr),* )) => {
        match $self.get_mut() {
            Self::Tcp(stream) => Pin::new(stream).$call($($argument),*),
            Self::Tls(stream) => Pin::new(stream.as_mut()).$call($($argument),*),
            Self::Unix(stream) => Pin::new(stream).$call($($argument),*),
            Self::Memory(stream) => Pin::new(stream).$call($($argument),*),
        }
    };
}

impl AsyncRead for Socket {
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        either!(self, poll_read(cx, buf))
    }
}

impl AsyncWrite for Socket {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        either!(self, poll_write(cx, bytes))
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        either!(self, poll_write_vectored(cx, slices))
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(self, poll_flush(cx))
    }

    fn poll_shutdown(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(self, poll_shutdown(cx))
    }
}
