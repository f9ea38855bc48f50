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
use crate::service::accounts::{Closed, Connection};
use crate::service::intake::Socket;

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
        Pin::new(&mut self.socket).poll_shutdown(cx)
    }
}
