//! The `:authority` that gRPC's C core (C++, Python, Ruby, C#, PHP) sends over a Unix socket: the path of the socket,
//! percent-encoded. The HTTP/2 library refuses a percent sign there and resets the call. Every percent sign of that value
//! becomes a hyphen, byte for byte, so that no length and no entry of the compression table changes.
//!
//! Read: the blocks of HEADERS and CONTINUATION frames as sequences of representations (RFC 7541, section 6). Values in
//! Huffman code stay as they are: that core does not send them.

use super::frames::{CONTINUATION, HEADERS, Head, PADDED, PRIORITY};

const NAME: &[u8] = b":authority";
/// Index of `:authority` in the static table.
const STATIC: usize = 1;
/// A longer number is none of ours; the decoder behind refuses it as well.
const LONGEST: usize = 1 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum At {
    /// The first byte of a representation.
    Start,
    /// The rest of an index, up to which shift.
    Index { value: usize, shift: u32, literal: bool },
    /// The first byte of a name's or a value's length.
    Length { of_name: bool },
    /// The rest of such a length.
    LengthRest { of_name: bool, huffman: bool, value: usize, shift: u32 },
    /// So many bytes of a name or a value are left.
    Text { of_name: bool, huffman: bool, left: usize },
    /// Something that cannot be: the decoder behind says so.
    Lost,
}

/// Where in a header block we are, across the parts in which it comes.
#[derive(Debug)]
pub struct Authority {
    at: At,
    /// Bytes of the frame before the block: the length of the padding, the priority.
    skip: usize,
    /// Bytes of padding after the block.
    padding: usize,
    padded: bool,
    left: usize,
    matched: Option<usize>,
    is_authority: bool,
}

impl Authority {
    /// Before the first frame.
    pub fn new() -> Self {
        Self {
            at: At::Start,
            skip: 0,
            padding: 0,
            padded: false,
            left: 0,
            matched: None,
            is_authority: false,
        }
    }

    /// A frame begins.
    pub fn begin(&mut self, head: Head) {
        self.left = head.len;
        (self.padding, self.skip, self.padded) = (0, 0, false);
        if head.kind == HEADERS {
            if self.at != At::Lost {
                self.at = At::Start;
            }
            self.padded = head.flags & PADDED != 0;
            self.skip = 5 * usize::from(head.flags & PRIORITY != 0);
        }
    }

    /// A part of a frame's payload, changed where it is the value.
    pub fn payload(&mut self, head: Head, bytes: &mut [u8]) {
        if head.kind != HEADERS && head.kind != CONTINUATION {
            return;
        }
        for byte in bytes {
            self.left = self.left.saturating_sub(1);
            if std::mem::take(&mut self.padded) {
                self.padding = usize::from(*byte);
            } else if self.skip > 0 {
                self.skip -= 1;
            } else if self.left >= self.padding {
                self.step(byte);
            }
        }
    }

    fn step(&mut self, byte: &mut u8) {
        let b = *byte;
        self.at = match self.at {
            At::Start => match b {
                // an indexed field stands for itself
                0x80..=0xff => self.index(b, 7, false),
                0x40..=0x7f => self.index(b, 6, true),
                0x20..=0x3f => self.index(b, 5, false),
                _ => self.index(b, 4, true),
            },
            At::Index { value, shift, literal } => match number(value, shift, b) {
                Number::More(value, shift) => At::Index { value, shift, literal },
                Number::Done(index) => self.after_index(index, literal),
                Number::TooLong => At::Lost,
            },
            At::Length { of_name } => {
                let (huffman, value) = (b & 0x80 != 0, usize::from(b & 0x7f));
                if value == 0x7f {
                    At::LengthRest { of_name, huffman, value, shift: 0 }
                } else {
                    self.text(of_name, huffman, value)
                }
            }
            At::LengthRest { of_name, huffman, value, shift } => match number(value, shift, b) {
                Number::More(value, shift) => At::LengthRest { of_name, huffman, value, shift },
                Number::Done(len) => self.text(of_name, huffman, len),
                Number::TooLong => At::Lost,
            },
            At::Text { of_name, huffman, left } => {
                if of_name {
                    let at = self.matched.filter(|&at| !huffman && NAME.get(at) == Some(&b));
                    self.matched = at.map(|at| at + 1);
                } else if self.is_authority && !huffman && b == b'%' {
                    *byte = b'-';
                }
                if left > 1 { At::Text { of_name, huffman, left: left - 1 } } else { self.after(of_name) }
            }
            At::Lost => At::Lost,
        };
    }

    fn index(&mut self, byte: u8, bits: u32, literal: bool) -> At {
        let most = (1_u8 << bits) - 1;
        let value = usize::from(byte & most);
        if value == usize::from(most) {
            At::Index { value, shift: 0, literal }
        } else {
            self.after_index(value, literal)
        }
    }

    fn after_index(&mut self, index: usize, literal: bool) -> At {
        if !literal {
            return At::Start;
        }
        self.is_authority = index == STATIC;
        At::Length { of_name: index == 0 }
    }

    fn text(&mut self, of_name: bool, huffman: bool, len: usize) -> At {
        if of_name {
            self.matched = Some(0);
        }
        if len > 0 { At::Text { of_name, huffman, left: len } } else { self.after(of_name) }
    }

    fn after(&mut self, of_name: bool) -> At {
        if of_name {
            self.is_authority = self.matched == Some(NAME.len());
            At::Length { of_name: false }
        } else {
            self.is_authority = false;
            At::Start
        }
    }
}

enum Number {
    More(usize, u32),
    Done(usize),
    TooLong,
}

/// The next byte of a number (RFC 7541, section 5.1).
fn number(value: usize, shift: u32, byte: u8) -> Number {
    let value = value + (usize::from(byte & 0x7f) << shift);
    match byte & 0x80 {
        _ if value > LONGEST || shift > 21 => Number::TooLong,
        0 => Number::Done(value),
        _ => Number::More(value, shift + 7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: &[u8] = b"%2Ftmp%2Fwade.sock";

    fn literal(first: &[u8], value: &[u8]) -> Vec<u8> {
        [first, &[value.len() as u8], value].concat()
    }

    /// The block in a frame, in parts of this length.
    fn passed(block: &[u8], flags: u8, part: usize) -> Vec<u8> {
        let head = Head { len: block.len(), kind: HEADERS, flags };
        let mut authority = Authority::new();
        authority.begin(head);
        let mut bytes = block.to_vec();
        bytes.chunks_mut(part).for_each(|part| authority.payload(head, part));
        bytes
    }

    #[test]
    fn the_percent_signs_of_the_authority_alone_become_hyphens() {
        let name = [&[0x40, NAME.len() as u8], NAME].concat();
        let other = literal(&[0x44], b"/a%b");
        for first in [&[0x41][..], &[0x01], &[0x11], &name] {
            let block = [&[0x83, 0x86][..], &other, &literal(first, PATH), &other, &[0xff, 0x03]].concat();
            let wanted =
                [&[0x83, 0x86][..], &other, &literal(first, b"-2Ftmp-2Fwade.sock"), &other, &[0xff, 0x03]];
            for part in 1..=block.len() {
                assert_eq!(passed(&block, 0, part), wanted.concat(), "in parts of {part}");
            }
        }
    }

    #[test]
    fn padding_and_priority_are_no_part_of_the_block() {
        let block = [&[3_u8, 0x41, 1, b'%', 0, 9][..], &literal(&[0x41], b"a%b"), b"%%%"].concat();
        let wanted = [&[3_u8, 0x41, 1, b'%', 0, 9][..], &literal(&[0x41], b"a-b"), b"%%%"].concat();
        assert_eq!(passed(&block, PADDED | PRIORITY, 4), wanted);
    }

    #[test]
    fn long_values_and_nonsense_are_passed_through() {
        let long = vec![b'%'; 300];
        // 300 = 127 + 173, in two bytes of seven bits
        let block = [&[0x41, 0x7f, 0xad, 0x01][..], &long].concat();
        assert!(passed(&block, 0, 7)[4..].iter().all(|&b| b == b'-'));
        let nonsense = vec![0xff; 64];
        assert_eq!(passed(&nonsense, 0, 5), nonsense);
    }
}
