//! What Parquet writes about itself, in Thrift's compact protocol
//! (<https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>), compared with the bytes that are
//! there. The reader of Parquet passes over fields that it does not know element by element, as many as are claimed, also
//! where no bytes are left of them.

/// Structures and lists within each other, at most; those of Parquet are half as deep.
const DEPTH: usize = 16;

/// Why bytes hold no structure that Parquet has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Fault {
    /// They end in the middle of one.
    #[error("it ends in the middle of a field")]
    Short,
    /// A list of more elements than there are bytes.
    #[error("a list of {claim} elements in {left} bytes")]
    Elements {
        /// Elements.
        claim: u64,
        /// Bytes from its beginning on.
        left: usize,
    },
    /// Truth values in lists, sets and maps stand in no such structure.
    #[error("a field of kind {0}, which Parquet does not have")]
    Kind(u8),
    /// Structures within structures.
    #[error("fields of more than {DEPTH} levels")]
    Deep,
    /// A number of more than 64 bits.
    #[error("a number of more than 64 bits")]
    Number,
}

/// Passes over the structure at the beginning of some bytes.
pub(super) fn check(mut bytes: &[u8]) -> Result<(), Fault> {
    pass_structure(&mut bytes, DEPTH)
}

fn pass_structure(from: &mut &[u8], depth: usize) -> Result<(), Fault> {
    let depth = depth.checked_sub(1).ok_or(Fault::Deep)?;
    loop {
        let header = byte(from)?;
        if header & 0xf == 0 {
            return Ok(());
        }
        if header >> 4 == 0 {
            // the number of the field, where it is far from that before
            number(from)?;
        }
        match header & 0xf {
            // a truth value is its kind
            1 | 2 => {}
            kind => pass(from, kind, depth)?,
        }
    }
}

fn pass(from: &mut &[u8], kind: u8, depth: usize) -> Result<(), Fault> {
    match kind {
        3 => pass_bytes(from, 1),
        4..=6 => number(from).map(|_| ()),
        7 => pass_bytes(from, 8),
        8 => {
            let length = number(from)?;
            pass_bytes(from, length)
        }
        9 => pass_list(from, depth),
        12 => pass_structure(from, depth),
        _ => Err(Fault::Kind(kind)),
    }
}

fn pass_list(from: &mut &[u8], depth: usize) -> Result<(), Fault> {
    let depth = depth.checked_sub(1).ok_or(Fault::Deep)?;
    let header = byte(from)?;
    // an empty list of some writers, of no kind
    if header == 0 {
        return Ok(());
    }
    let claim = match header >> 4 {
        15 => number(from)?,
        few => u64::from(few),
    };
    // no element that is passed over here has less than a byte
    if claim > from.len() as u64 {
        return Err(Fault::Elements { claim, left: from.len() });
    }
    (0..claim).try_for_each(|_| pass(from, header & 0xf, depth))
}

fn pass_bytes(from: &mut &[u8], count: u64) -> Result<(), Fault> {
    let count = usize::try_from(count).map_err(|_| Fault::Short)?;
    *from = from.get(count..).ok_or(Fault::Short)?;
    Ok(())
}

fn byte(from: &mut &[u8]) -> Result<u8, Fault> {
    let (first, rest) = from.split_first().ok_or(Fault::Short)?;
    *from = rest;
    Ok(*first)
}

/// A number of seven bits a byte, the lowest ones first.
fn number(from: &mut &[u8]) -> Result<u64, Fault> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let byte = byte(from)?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(number);
        }
    }
    Err(Fault::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number 2^31 - 1.
    const MANY: [u8; 5] = [0xff, 0xff, 0xff, 0xff, 0x07];

    #[test]
    fn structures_are_passed_over_and_what_claims_more_than_there_is_is_not() {
        // a number, a text of three letters, a list of two doubles, a truth value, a structure with a byte in it
        let mut whole = vec![0x15, 0x80, 0x01, 0x18, 3, b'a', b'b', b'c', 0x19, 0x27];
        whole.extend([0; 16]);
        whole.extend([0x11, 0x1c, 0x13, 7, 0, 0]);
        assert_eq!(check(&whole), Ok(()));
        assert_eq!(check(&[&whole[..], b"and what follows"].concat()), Ok(()));
        for length in 0..whole.len() {
            let checked = check(&whole[..length]);
            assert!(matches!(checked, Err(Fault::Short | Fault::Elements { .. })), "{length}: {checked:?}");
        }
    }

    #[test]
    fn a_list_has_a_byte_for_each_element() {
        let list = |element: u8| [&[0x19, 0xf0 | element][..], &MANY, &[0; 9]].concat();
        for element in [3, 5, 7, 8, 9, 12] {
            assert_eq!(check(&list(element)), Err(Fault::Elements { claim: (1 << 31) - 1, left: 9 }));
        }
        // within the claim, elements of no bytes would be passed over without end
        assert_eq!(check(&[0x19, 0x31, 0, 0, 0, 0]), Err(Fault::Kind(1)));
        assert_eq!(check(&[0x1b, 0, 0]), Err(Fault::Kind(11)));
        assert_eq!(check(&[0x1a, 0x13, 0, 0]), Err(Fault::Kind(10)));
    }

    #[test]
    fn structures_within_structures_end() {
        assert_eq!(check(&[0x1c; 40]), Err(Fault::Deep));
        assert_eq!(
            check(&[0x15, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0]),
            Err(Fault::Number)
        );
    }
}
