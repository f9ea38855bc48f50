//! A recording with holes falls into pieces.

use std::ops::Range;

use super::median;

/// A step of more than this many median steps is a hole.
pub const GAP_STEPS: f64 = 5.0;

/// The median step between stamps [s]; `None` below two stamps.
pub fn median_step(times: &[f64]) -> Option<f64> {
    median(&mut times.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>())
}

/// The runs of stamps between holes: nothing may be interpolated or differentiated across one.
pub fn pieces(times: &[f64]) -> Vec<Range<usize>> {
    let limit = median_step(times).map_or(f64::INFINITY, |step| GAP_STEPS * step);
    let ends = (1..times.len()).filter(|&at| times[at] - times[at - 1] > limit).chain([times.len()]);
    let mut start = 0;
    ends.map(|end| std::mem::replace(&mut start, end)..end).filter(|piece| !piece.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_splits_at_its_holes_and_jitter_is_none() {
        let times = [0.0, 0.9, 2.1, 3.0, 9.5, 10.4, 11.5];
        assert_eq!(pieces(&times), [0..4, 4..7]);
        assert_eq!(pieces(&times[..4]), vec![0..4; 1]);
        assert_eq!((pieces(&times[..1]), median_step(&times[..1])), (vec![0..1; 1], None));
        assert!(pieces(&[]).is_empty());
    }
}
