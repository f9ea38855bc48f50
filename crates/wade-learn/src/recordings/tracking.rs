//! Frames that tracking got wrong: a pose that stops while the vehicle moves, and one that jumps.

use std::ops::Range;

use super::recording::{Recording, RecordingFault};
use crate::signal::pieces;

/// A pose that stays the same to the last bit for longer than this [s], and in more frames, has stopped: cameras have noise.
const FROZEN_DURATION: f64 = 0.5;
const FROZEN_FRAMES: usize = 20;
/// How long before and after it the vehicle may have moved [s], and the speed above which it did [m/s]: a recording of a
/// simulator has no noise while the vehicle stands.
const AROUND: f64 = 0.1;
const REST_SPEED: f64 = 0.1;
/// No wading vehicle is faster [m/s], or turns faster [rad/s].
const FASTEST: f64 = 12.0;
const FASTEST_TURN: f64 = 10.0;
/// What noise of markers adds between two frames [m], [rad].
const NOISE: f64 = 0.02;
const NOISE_TURN: f64 = 0.1;

/// Refuses a recording with such frames.
pub(super) fn check_tracking(recording: &Recording) -> Result<(), RecordingFault> {
    for piece in pieces(&recording.t) {
        // a pose that goes on after it stopped jumps, too
        check_frozen(recording, &piece)?;
        check_jumps(recording, piece)?;
    }
    Ok(())
}

fn check_jumps(recording: &Recording, piece: Range<usize>) -> Result<(), RecordingFault> {
    for (before, after) in piece.clone().zip(piece.skip(1)) {
        let [from, to] = [before, after].map(|at| recording.t[at]);
        let distance = (recording.position[after] - recording.position[before]).norm();
        let turn = recording.rotation[before].angle_to(&recording.rotation[after]);
        let seconds = to - from;
        if distance > FASTEST * seconds + NOISE || turn > FASTEST_TURN * seconds + NOISE_TURN {
            return Err(RecordingFault::Jump { from, to, distance, turn: turn.to_degrees() });
        }
    }
    Ok(())
}

fn check_frozen(recording: &Recording, piece: &Range<usize>) -> Result<(), RecordingFault> {
    let t = &recording.t;
    let same = |at: usize| {
        recording.position[at] == recording.position[at - 1]
            && recording.rotation[at] == recording.rotation[at - 1]
    };
    let mut first = piece.start;
    for at in piece.start + 1..=piece.end {
        if at < piece.end && same(at) {
            continue;
        }
        let stays = first..at;
        let lasts = t[at - 1] - t[first] >= FROZEN_DURATION && stays.len() >= FROZEN_FRAMES;
        if lasts && moves_around(recording, piece, &stays) {
            return Err(RecordingFault::Frozen { from: t[first], to: t[at - 1] });
        }
        first = at;
    }
    Ok(())
}

/// True where the vehicle moved just before or just after.
fn moves_around(recording: &Recording, piece: &Range<usize>, stays: &Range<usize>) -> bool {
    let (t, position) = (&recording.t, &recording.position);
    let last = stays.end - 1;
    let before = (piece.start..stays.start).rev().find(|&at| t[stays.start] - t[at] >= AROUND);
    let after = (stays.end..piece.end).find(|&at| t[at] - t[last] >= AROUND);
    let moved = |at: usize, from: usize| {
        (position[at] - position[from]).norm() > REST_SPEED * (t[at] - t[from]).abs()
    };
    before.is_some_and(|at| moved(at, stays.start)) || after.is_some_and(|at| moved(at, last))
}
