//! A connection as the HTTP/2 library sees it: reads take turns with those of other connections and wait where too many
//! frames came that carry nothing, and every byte that moves is noted in the account.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Instant;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::Sleep;

use super::authority::Authority;
use super::frames::{Budget, DATA, Piece, Scanner, Verdict};
use crate::service::accounts::{Closed, Connection};
use crate::service::intake::Socket;

/// Bytes that are read of a connection before others get their turn.
const BYTES_PER_TURN: usize = 8 << 10;

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
    read_this_turn: usize,
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
            read_this_turn: 0,
        }
    }

    fn note_received(&mut self, mut bytes: &mut [u8]) {
        let (mut moved, before) = (false, self.received.is_past_preface());
        while !bytes.is_empty() {
            let (piece, len) = self.received.step(bytes);
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
            bytes = &mut bytes[len..];
        }
        if !before && self.received.is_past_preface() {
            self.connection.shakes_hands();
        }
        if moved {
            self.connection.moved();
        }
        self.budget.refused(self.connection.take_refused());
        match self.budget.judge(Instant::now()) {
            Verdict::Within => {}
            Verdict::Pause(pause) => {
                self.connection.accounts().metrics().count_pause();
                self.pause = Some(Box::pin(tokio::time::sleep(pause)));
            }
            Verdict::Close => self.connection.close(Closed::control_frames),
        }
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
        if self.read_this_turn >= BYTES_PER_TURN {
            // the rest is read when the others have had theirs
            self.read_this_turn = 0;
            cx.waker().wake_by_ref();
            return Poll::Pending;
        }
        let before = buf.filled().len();
        let polled = Pin::new(&mut self.socket).poll_read(cx, buf);
        match &polled {
            Poll::Ready(Ok(())) => {
                let bytes = &mut buf.filled_mut()[before..];
                self.read_this_turn += bytes.len();
                self.note_received(bytes);
            }
            _ => self.read_this_turn = 0,
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
