//! The `.hlog` file: an HdrHistogram interval log (format 1.3, V2 compressed histograms, nanoseconds).
//!
//! Lines without a tag are response times, as log tools read by default; `service`, `control` and `warm-up`
//! stand beside them under their tags. Times are counted from the start of the schedule (`BaseTime`).

use std::time::{Duration, SystemTime};

use hdrhistogram::{
    Counter, Histogram,
    serialization::{
        V2DeflateSerializeError, V2DeflateSerializer,
        interval_log::{IntervalLogWriter, IntervalLogWriterBuilder, IntervalLogWriterError, Tag},
    },
};

use super::{
    hiccup::Hiccups,
    record::{IntervalCounts, Recording, histogram},
};

/// Maxima are written in ms, as the Java tools do [ns].
const MAX_DIVISOR: f64 = 1e6;

/// A histogram could not be written.
pub type HlogError = IntervalLogWriterError<V2DeflateSerializeError>;

type Writer<'a, 'b> = IntervalLogWriter<'a, 'b, Vec<u8>, V2DeflateSerializer>;

/// The log as text.
pub(super) fn write(
    recording: &Recording,
    hiccups: &Hiccups,
    started: SystemTime,
) -> Result<Vec<u8>, HlogError> {
    let (mut text, mut serializer) = (Vec::new(), V2DeflateSerializer::new());
    let mut log = IntervalLogWriterBuilder::new()
        .add_comment("[Histogram log format version 1.3]")
        .add_comment("[wade soak: times in ns; no tag = response time]")
        .with_start_time(started)
        .with_base_time(started)
        .with_max_value_divisor(MAX_DIVISOR)
        .begin_log_with(&mut text, &mut serializer)?;
    line(&mut log, Some("warm-up"), &recording.warm_up.response, 0, recording.warm_up_ns)?;
    let controls = control_by_interval(recording, hiccups);
    for (index, (interval, control)) in recording.intervals.iter().zip(&controls).enumerate() {
        let start = recording.warm_up_ns + index as u64 * recording.interval_ns;
        line(&mut log, None, &interval.response, start, recording.interval_ns)?;
        line(&mut log, Some("service"), &interval.service, start, recording.interval_ns)?;
        line(&mut log, Some("control"), control, start, recording.interval_ns)?;
    }
    Ok(text)
}

fn line<T: Counter>(
    log: &mut Writer<'_, '_>,
    tag: Option<&'static str>,
    times: &Histogram<T>,
    start_ns: u64,
    length_ns: u64,
) -> Result<(), HlogError> {
    let (start, length) = (Duration::from_nanos(start_ns), Duration::from_nanos(length_ns));
    log.write_histogram(times, start, length, tag.and_then(Tag::new))
}

/// The control's overshoots in the intervals of the recording [ns].
pub(super) fn control_by_interval(recording: &Recording, hiccups: &Hiccups) -> Vec<IntervalCounts> {
    let mut controls: Vec<_> =
        recording.intervals.iter().map(|interval| histogram(interval.response.high())).collect();
    for overshoot in &hiccups.overshoots {
        if let Some(index) = recording.interval_index(overshoot.due) {
            controls[index].saturating_record(overshoot.late);
        }
    }
    controls
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use hdrhistogram::serialization::{
        Deserializer,
        interval_log::{IntervalLogIterator, LogEntry},
    };

    use super::{
        super::{
            hiccup::Overshoot,
            record::{Outcome, Sample},
        },
        *,
    };

    const SECOND: u64 = 1_000_000_000;

    /// One answered request a millisecond, which takes 1 us more than the one before.
    fn recording() -> Recording {
        let mut recording = Recording::new(Duration::from_secs(1), Duration::from_secs(3), 1);
        for index in 0..4000 {
            let intended = index * SECOND / 1000;
            let (sent, done) = (intended + 100, intended + 1000 * (index + 1));
            let outcome = Outcome::Answered(10);
            recording.record(&Sample { intended, sent, done, own_lag: 100, stall: None, outcome });
        }
        recording
    }

    /// Untagged lines decoded by the crate, and how many lines each tag has.
    fn read(text: &[u8]) -> (Vec<IntervalCounts>, BTreeMap<String, usize>) {
        let (mut untagged, mut lines) = (Vec::new(), BTreeMap::new());
        for entry in IntervalLogIterator::new(text) {
            let LogEntry::Interval(interval) = entry.expect("every line parses") else { continue };
            let tag = interval.tag().map(|tag| tag.as_str().to_owned()).unwrap_or_default();
            *lines.entry(tag.clone()).or_default() += 1;
            if tag.is_empty() {
                let bytes = base64(interval.encoded_histogram());
                untagged.push(Deserializer::new().deserialize(&mut &bytes[..]).expect("a V2 histogram"));
            }
        }
        (untagged, lines)
    }

    fn base64(text: &str) -> Vec<u8> {
        const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let bits = |c: u8| ALPHABET.iter().position(|&a| a == c).expect("base64") as u32;
        let mut bytes = Vec::new();
        for four in text.trim_end_matches('=').as_bytes().chunks(4) {
            let word = four.iter().fold(0, |word, &c| word << 6 | bits(c)) << (6 * (4 - four.len()));
            bytes.extend_from_slice(&word.to_be_bytes()[1..four.len()]);
        }
        bytes
    }

    #[test]
    fn the_log_read_back_has_the_same_counts() {
        let recording = recording();
        let hiccups = Hiccups { overshoots: vec![Overshoot { due: 2 * SECOND, late: 77 }], core: None };
        let text = write(&recording, &hiccups, SystemTime::now()).expect("writes to memory");
        let (read, lines) = read(&text);
        assert_eq!(read.len(), 3);
        for (read, interval) in read.iter().zip(&recording.intervals) {
            assert_eq!(read, &interval.response);
            assert_eq!(read.len(), 1000);
        }
        for (tag, count) in [("", 3), ("service", 3), ("control", 3), ("warm-up", 1)] {
            assert_eq!(lines[tag], count, "{tag}");
        }
    }

    #[test]
    fn the_control_is_sorted_into_the_seconds_and_the_warm_up_left_out() {
        let overshoots = [0, SECOND, 2 * SECOND, 2 * SECOND + 1].map(|due| Overshoot { due, late: 5 });
        let hiccups = Hiccups { overshoots: overshoots.to_vec(), core: None };
        let counts: Vec<_> = control_by_interval(&recording(), &hiccups).iter().map(|c| c.len()).collect();
        assert_eq!(counts, [1, 2, 0]);
    }
}
