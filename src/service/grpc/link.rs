//! A connection as the HTTP/2 library sees it: reads take turns with those of other connections and wait where too many
//! frames came that carry nothing, and every byte that moves is noted in the account.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, Sleep};

use super::authority::Authority;
use super::frames::{Budget, DATA, Piece, Scanner, Turn, Verdict};
use super::serving::{CONNECTION_WINDOW, GOODBYE};
use crate::service::accounts::{Closed, Connection};
use crate::service::intake::Socket;

/// What comes from a peer after the server's last word, which is read and left aside. A socket that is closed with bytes
/// unread, or gets some afterwards, is reset, and with it goes what the peer has not read yet: an answer.
#[derive(Debug)]
struct Linger {
    until: Pin<Box<Sleep>>,
    /// How much more a peer may have on its way [bytes].
    left: usize,
}

impl Linger {
    fn new() -> Self {
        Self { until: Box::pin(tokio::time::sleep(GOODBYE)), left: CONNECTION_WINDOW as usize }
    }

    /// Ready when the peer has closed its end too, or has had its time.
    fn poll(&mut self, socket: &mut Socket, cx: &mut Context<'_>) -> Poll<()> {
        let mut bytes = [0; 4096];
        loop {
            let mut buf = ReadBuf::new(&mut bytes);
            let Poll::Ready(read) = Pin::new(&mut *socket).poll_read(cx, &mut buf) else {
                return self.until.as_mut().poll(cx);
            };
            self.left = self.left.saturating_sub(buf.filled().len());
            if read.is_err() || buf.filled().is_empty() || self.left == 0 {
                return Poll::Ready(());
            }
        }
    }
}

/// A socket with its account.
#[derive(Debug)]
pub struct Link {
    socket: Socket,
    connection: Arc<Connection>,
    received: Scanner,
    sent: Scanner,
    budget: Budget,
    pause: Option<Pin<Box<Sleep>>>,
    authority: Option<Authority>,
    turn: Turn,
    /// What was read of the socket and is not yet the library's: its turn is over before.
    ahead: Vec<u8>,
    linger: Option<Linger>,
}

impl Link {
    /// A new connection, which may send so many frames without a request [1/s].
    pub fn new(socket: Socket, connection: Arc<Connection>, control_frames_per_s: f64) -> Self {
        let authority = matches!(socket, Socket::Unix(_)).then(Authority::new);
        Self {
            socket,
            connection,
            received: Scanner::of_client(),
            sent: Scanner::of_server(),
            budget: Budget::new(control_frames_per_s, Instant::now()),
            pause: None,
            authority,
            turn: Turn::default(),
            ahead: Vec::new(),
            linger: None,
        }
    }

    /// Notes what was received, up to the end of the turn; how many bytes that were.
    fn note_received(&mut self, bytes: &mut [u8]) -> usize {
        let (mut moved, before) = (false, self.received.is_past_preface());
        let mut noted = 0;
        while noted < bytes.len() && !self.turn.is_over() {
            let bytes = &mut bytes[noted..];
            let (piece, len) = self.received.step(bytes);
            self.turn.takes(piece, len);
            noted += len;
            match piece {
                Piece::Head(head) => {
                    self.budget.received(head);
                    if let Some(authority) = &mut self.authority {
                        authority.begin(head);
                    }
                }
                Piece::Payload(head) => {
                    moved |= head.kind == DATA;
                    if let Some(authority) = &mut self.authority {
                        authority.payload(head, &mut bytes[..len]);
                    }
                }
                Piece::Nothing => {}
            }
        }
        if !before && self.received.is_past_preface() {
            self.connection.shakes_hands();
        }
        if moved {
            self.connection.moved();
        }
        self.budget.dear_calls(self.connection.take_dear_calls());
        match self.budget.judge(Instant::now()) {
            Verdict::Within => {}
            Verdict::Pause(pause) => {
                self.connection.accounts().metrics().count_pause();
                self.pause = Some(Box::pin(tokio::time::sleep(pause)));
            }
            Verdict::Close => self.connection.close(Closed::control_frames),
        }
        noted
    }

    /// What was read ahead, else what the socket has.
    fn poll_bytes(&mut self, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        if self.ahead.is_empty() {
            return Pin::new(&mut self.socket).poll_read(cx, buf);
        }
        let len = self.ahead.len().min(buf.remaining());
        buf.put_slice(&self.ahead[..len]);
        self.ahead.drain(..len);
        Poll::Ready(Ok(()))
    }

    fn note_sent(&mut self, mut bytes: &[u8]) {
        let mut moved = false;
        while !bytes.is_empty() {
            let (piece, len) = self.sent.step(bytes);
            if let Piece::Payload(head) = piece
                && head.kind == DATA
            {
                self.budget.sent_data(len);
                moved = true;
            }
            bytes = &bytes[len..];
        }
        if moved {
            self.connection.sent();
        }
    }
}

impl AsyncRead for Link {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if let Some(pause) = &mut self.pause {
            ready!(pause.as_mut().poll(cx));
            self.pause = None;
        }
        if self.connection.stands_back() {
            // whoever polls the connection wakes it when the others have had their turn
            return Poll::Pending;
        }
        let before = buf.filled().len();
        let polled = self.poll_bytes(cx, buf);
        if let Poll::Ready(Ok(())) = &polled {
            let noted = before + self.note_received(&mut buf.filled_mut()[before..]);
            self.ahead.splice(..0, buf.filled()[noted..].iter().copied());
            buf.set_filled(noted);
            self.connection.set_stands_back(self.turn.is_over());
        }
        if polled.is_pending() || self.turn.is_over() {
            self.turn = Turn::default();
        }
        polled
    }
}

impl AsyncWrite for Link {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let written = ready!(Pin::new(&mut self.socket).poll_write(cx, bytes))?;
        self.note_sent(&bytes[..written]);
        Poll::Ready(Ok(written))
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = ready!(Pin::new(&mut self.socket).poll_write_vectored(cx, slices))?;
        let mut left = written;
        for slice in slices {
            let len = left.min(slice.len());
            self.note_sent(&slice[..len]);
            left -= len;
        }
        Poll::Ready(Ok(written))
    }

    fn is_write_vectored(&self) -> bool {
        self.socket.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.socket).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let Self { socket, linger, .. } = &mut *self;
        if linger.is_none() {
            ready!(Pin::new(&mut *socket).poll_shutdown(cx))?;
        }
        linger.get_or_insert_with(Linger::new).poll(socket, cx).map(Ok)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::time::Duration;

    use rustix::net::sockopt::set_socket_recv_buffer_size;
    use tokio::io::AsyncWriteExt;

    use super::*;
    use crate::metrics::{Metrics, Resource};
    use crate::service::accounts::{Accounts, Limits, Peer};
    use crate::service::intake::{Listener, listen_on_tcp};

    async fn accepted(listener: &Listener) -> Link {
        let limits = Limits {
            connections: 1,
            http_connections: 1,
            requests: 1,
            streams: 1,
            bytes: 1,
            peer_share: 1.0,
        };
        let accounts = Accounts::new(&limits, Arc::new(Metrics::new()));
        let (connection, _) = accounts.open(Peer::Process(1), Resource::connections).await.expect("room");
        Link::new(listener.accept().await.expect("accepted").0, connection, 1e6)
    }

    #[tokio::test]
    async fn a_peer_that_still_writes_gets_the_last_answer_whole() {
        // what the system holds of an answer
        const LEN: usize = 256 << 10;
        let listener = listen_on_tcp(([127, 0, 0, 1], 0).into()).expect("listening");
        let address = listener.local_addr().expect("an address");
        let listener = Listener::Tcp(tokio::net::TcpListener::from_std(listener).expect("in the runtime"));
        let peer = std::thread::spawn(move || {
            let mut peer = std::net::TcpStream::connect(address).expect("connected");
            // less than the answer, of which the rest is the system's to send when the server has said its last word
            set_socket_recv_buffer_size(&peer, 64 << 10).expect("set");
            peer.write_all(&[0; 2048]).expect("what the server does not read");
            std::thread::sleep(Duration::from_millis(100));
            let mut answer = Vec::new();
            loop {
                let mut bytes = [0; 4096];
                match peer.read(&mut bytes)? {
                    0 => return Ok::<_, io::Error>(answer.len()),
                    len => answer.extend_from_slice(&bytes[..len]),
                }
                peer.write_all(&[0; 1])?;
            }
        });
        let mut link = accepted(&listener).await;
        link.write_all(&vec![1; LEN]).await.expect("written");
        link.shutdown().await.expect("shut down");
        drop(link);
        assert_eq!(peer.join().expect("joined").expect("no reset"), LEN);
    }

    #[tokio::test]
    async fn a_peer_that_never_closes_its_end_has_its_time_and_no_more() {
        let (server, peer) = tokio::io::duplex(1024);
        let made = Arc::new(tokio::sync::Mutex::new({
            let (sender, made) = tokio::sync::mpsc::channel(1);
            sender.try_send(Ok((server, Peer::Process(1)))).expect("room");
            made
        }));
        let mut link = accepted(&Listener::Memory(made)).await;
        let start = Instant::now();
        link.shutdown().await.expect("shut down");
        assert!(start.elapsed() >= GOODBYE);
        drop(peer);
    }
}
