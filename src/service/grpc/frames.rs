//! The frames of an HTTP/2 connection by their headers alone (RFC 9113, section 4.1), and the budget for those that carry
//! nothing: each costs the receiver a thousand times what it costs the sender, and no request comes of it. And what a
//! connection may cost before others get their turn.

use std::time::Duration;

use tokio::time::Instant;

/// Length of a frame's header [bytes].
const HEADER: usize = 9;
/// Length of what a client sends before its first frame [bytes].
const PREFACE: usize = 24;

pub const DATA: u8 = 0;
pub const HEADERS: u8 = 1;
const RST_STREAM: u8 = 3;
pub const CONTINUATION: u8 = 9;

pub const END_STREAM: u8 = 0x1;
pub const PADDED: u8 = 0x8;
pub const PRIORITY: u8 = 0x20;

/// The header of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Head {
    /// Length of the payload [bytes].
    pub len: usize,
    /// Type.
    pub kind: u8,
    /// Flags.
    pub flags: u8,
}

impl Head {
    /// A frame of data that is empty and ends nothing.
    fn is_empty_data(self) -> bool {
        self.kind == DATA && self.len == 0 && self.flags & END_STREAM == 0
    }
}

/// A piece of the bytes that were scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// Before the first frame, or a part of a header.
    Nothing,
    /// A header is complete.
    Head(Head),
    /// Payload of this frame.
    Payload(Head),
}

/// Finds the frames in a stream of bytes that comes in parts.
#[derive(Debug)]
pub struct Scanner {
    preface_left: usize,
    header: [u8; HEADER],
    have: usize,
    head: Head,
    payload_left: usize,
}

impl Scanner {
    /// Of what a client sends.
    pub fn of_client() -> Self {
        let head = Head { len: 0, kind: 0, flags: 0 };
        Self { preface_left: PREFACE, header: [0; HEADER], have: 0, head, payload_left: 0 }
    }

    /// Of what a server sends.
    pub fn of_server() -> Self {
        Self { preface_left: 0, ..Self::of_client() }
    }

    /// Whether the client's first bytes are complete.
    pub fn is_past_preface(&self) -> bool {
        self.preface_left == 0
    }

    /// The first piece of these bytes and its length, which is not zero.
    pub fn step(&mut self, bytes: &[u8]) -> (Piece, usize) {
        if self.preface_left > 0 {
            let len = self.preface_left.min(bytes.len());
            self.preface_left -= len;
            return (Piece::Nothing, len);
        }
        if self.payload_left > 0 {
            let len = self.payload_left.min(bytes.len());
            self.payload_left -= len;
            return (Piece::Payload(self.head), len);
        }
        let len = (HEADER - self.have).min(bytes.len());
        self.header[self.have..self.have + len].copy_from_slice(&bytes[..len]);
        self.have += len;
        if self.have < HEADER {
            return (Piece::Nothing, len);
        }
        self.have = 0;
        let [a, b, c, kind, flags, ..] = self.header;
        self.payload_left = u32::from_be_bytes([0, a, b, c]) as usize;
        self.head = Head { len: self.payload_left, kind, flags };
        (Piece::Head(self.head), len)
    }
}

/// What a connection may cost before others get their turn, in the cost of a frame that carries nothing: three calls, or
/// 50 microseconds.
const TURN: usize = 32;
/// What the beginning of a call costs.
const CALL: usize = 10;
/// Bytes that cost as much as a frame.
const BYTES_A_FRAME: usize = 512;

/// What a connection has cost since it last stood back for others.
#[derive(Debug, Default)]
pub struct Turn {
    frames: usize,
    bytes: usize,
}

impl Turn {
    /// Counts a piece of what was received.
    pub fn takes(&mut self, piece: Piece, len: usize) {
        self.bytes += len;
        self.frames += match piece {
            Piece::Head(Head { kind: HEADERS | CONTINUATION, .. }) => CALL,
            Piece::Head(head) if head.is_empty_data() => TURN,
            Piece::Head(_) => 1,
            Piece::Nothing | Piece::Payload(_) => 0,
        };
    }

    /// Whether it is the others' turn.
    pub fn is_over(&self) -> bool {
        self.frames + self.bytes / BYTES_A_FRAME >= TURN
    }
}

/// Frames without a request that may come at once, as after a pause: tokens.
const BURST: f64 = 1000.0;
/// A frame of data that is shorter than this [bytes] carries no message of ours.
const SHORT_DATA: usize = 16;
/// Longest pause in reading a connection.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);
/// A connection that has been over its budget for this long without a break is closed.
const TOLERANCE: Duration = Duration::from_secs(10);
/// What a frame of data costs that is empty and ends nothing.
const EMPTY_DATA: f64 = 50.0;
/// What a call costs that was refused, or that has the administrator's work done: whoever goes on asking is asked to wait.
const DEAR_CALL: f64 = 10.0;
/// Bytes of an answer that earn the receiver one frame, such as a WINDOW_UPDATE.
const BYTES_A_TOKEN: f64 = 4096.0;

/// What a connection may send beside its requests: a steady rate, and as many again as its requests and answers explain.
#[derive(Debug)]
pub struct Budget {
    tokens: f64,
    per_second: f64,
    refilled: Instant,
    over_since: Option<Instant>,
}

/// What is to be done with a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Read on.
    Within,
    /// Read on after a pause.
    Pause(Duration),
    /// It has been over its budget for too long.
    Close,
}

impl Budget {
    /// A full budget that is refilled at this rate [frames/s].
    pub fn new(per_second: f64, now: Instant) -> Self {
        Self { tokens: BURST, per_second, refilled: now, over_since: None }
    }

    /// Counts a frame that was received.
    pub fn received(&mut self, head: Head) {
        self.tokens += match head.kind {
            DATA if head.len >= SHORT_DATA => 2.0,
            // the end of a request may be a frame of its own
            DATA if head.flags & END_STREAM != 0 => 0.0,
            HEADERS => 1.0,
            // the library ends a connection with its hundredth, and whoever floods would be back at once
            _ if head.is_empty_data() => -EMPTY_DATA,
            // a request that is begun and given up costs the server the whole of it
            RST_STREAM => -4.0,
            _ => -1.0,
        };
    }

    /// Counts calls that were refused, or that an administrator made.
    pub fn dear_calls(&mut self, calls: u32) {
        self.tokens -= DEAR_CALL * f64::from(calls);
    }

    /// Counts a frame of data that was sent.
    pub fn sent_data(&mut self, len: usize) {
        self.tokens += 1.0 + len as f64 / BYTES_A_TOKEN;
    }

    /// What the frames up to now have come to.
    pub fn judge(&mut self, now: Instant) -> Verdict {
        let elapsed = now.saturating_duration_since(self.refilled).as_secs_f64();
        self.refilled = now;
        let most = self.per_second * LONGEST_PAUSE.as_secs_f64();
        self.tokens = (self.tokens + elapsed * self.per_second).clamp(-most, BURST);
        if self.tokens >= 0.0 {
            self.over_since = None;
            return Verdict::Within;
        }
        let since = *self.over_since.get_or_insert(now);
        if now.saturating_duration_since(since) >= TOLERANCE {
            return Verdict::Close;
        }
        Verdict::Pause(Duration::from_secs_f64(-self.tokens / self.per_second).min(LONGEST_PAUSE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(kind: u8, flags: u8, payload: &[u8]) -> Vec<u8> {
        let len = (payload.len() as u32).to_be_bytes();
        [&len[1..], &[kind, flags, 0, 0, 0, 1], payload].concat()
    }

    #[test]
    fn frames_are_found_however_the_bytes_are_cut() {
        let mut bytes = vec![b'P'; PREFACE];
        for (kind, len) in [(4, 0), (HEADERS, 40), (DATA, 17), (6, 8), (DATA, 0)] {
            bytes.extend(frame(kind, 0, &vec![7; len]));
        }
        for part in 1..bytes.len() {
            let mut scanner = Scanner::of_client();
            let (mut heads, mut payload) = (Vec::new(), 0);
            for mut rest in bytes.chunks(part) {
                while !rest.is_empty() {
                    let (piece, len) = scanner.step(rest);
                    match piece {
                        Piece::Head(head) => heads.push((head.kind, head.len)),
                        Piece::Payload(_) => payload += len,
                        Piece::Nothing => {}
                    }
                    rest = &rest[len..];
                }
            }
            assert_eq!(heads, [(4, 0), (HEADERS, 40), (DATA, 17), (6, 8), (DATA, 0)], "cut at {part}");
            assert_eq!(payload, 65);
        }
    }

    #[test]
    fn a_flood_is_slowed_down_and_then_ended_and_requests_pay_for_what_they_bring() {
        let start = Instant::now();
        let ping = Head { len: 8, kind: 6, flags: 0 };
        let mut budget = Budget::new(100.0, start);
        let at = |ms| start + Duration::from_millis(ms);
        (0..1000).for_each(|_| budget.received(ping));
        assert_eq!(budget.judge(at(0)), Verdict::Within);
        (0..500).for_each(|_| budget.received(ping));
        assert_eq!(budget.judge(at(0)), Verdict::Pause(LONGEST_PAUSE));
        for second in 1..10 {
            (0..500).for_each(|_| budget.received(ping));
            assert!(matches!(budget.judge(at(1000 * second)), Verdict::Pause(_)));
        }
        (0..500).for_each(|_| budget.received(ping));
        assert_eq!(budget.judge(at(10_000)), Verdict::Close);

        // 1000 requests a second, each with a WINDOW_UPDATE and a PING, for a minute
        let mut budget = Budget::new(100.0, start);
        for ms in 0..60_000 {
            let message = Head { len: 40, kind: DATA, flags: 0 };
            [message, ping, ping].into_iter().for_each(|head| budget.received(head));
            budget.sent_data(600);
            assert_eq!(budget.judge(at(ms)), Verdict::Within);
        }
    }

    #[test]
    fn a_turn_ends_with_three_calls_or_one_empty_frame_and_not_with_a_query() {
        let pieces = |heads: &[Head]| {
            let mut turn = Turn::default();
            for &head in heads {
                turn.takes(Piece::Head(head), HEADER);
                turn.takes(Piece::Payload(head), head.len);
            }
            turn.is_over()
        };
        let head = |kind, len| Head { len, kind, flags: 0 };
        let call = [head(HEADERS, 90), head(DATA, 30)];
        assert!(!pieces(&call) && pieces(&call.repeat(3)));
        // a message of a stream that holds 20 states
        assert!(!pieces(&[head(DATA, 3000)]));
        assert!(pieces(&[head(DATA, 0)]));
        // the end of a request
        assert!(!pieces(&[Head { flags: END_STREAM, ..head(DATA, 0) }]));
    }

    #[test]
    fn a_flood_of_empty_data_is_ended_by_us_before_the_library_would() {
        let start = Instant::now();
        let mut budget = Budget::new(200.0, start);
        let (mut frames, mut now) = (0, start);
        loop {
            budget.received(Head { len: 0, kind: DATA, flags: 0 });
            frames += 1;
            match budget.judge(now) {
                Verdict::Within => {}
                Verdict::Pause(pause) => now += pause,
                Verdict::Close => break,
            }
        }
        assert!(now >= start + TOLERANCE && frames < 100, "{frames}");
    }

    #[test]
    fn requests_that_are_given_up_at_once_are_a_flood() {
        let start = Instant::now();
        let mut budget = Budget::new(100.0, start);
        for _ in 0..1000 {
            for kind in [HEADERS, RST_STREAM] {
                budget.received(Head { len: 4, kind, flags: 0 });
            }
        }
        assert!(matches!(budget.judge(start), Verdict::Pause(_)));
    }
}
