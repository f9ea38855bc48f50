//! A quantity over time, at the steps that a solver chose.

/// Rounding of a time that a solver prints [s].
const TIME_ROUNDING: f64 = 1e-6;

/// Values at increasing times; linear in between.
#[derive(Debug, Clone, PartialEq)]
pub struct History<const N: usize> {
    times: Vec<f64>,
    values: Vec<[f64; N]>,
}

/// Why rows are no history, or a history has no average.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HistoryError {
    /// No row.
    #[error("the history is empty")]
    Empty,
    /// A time or a value that is not finite.
    #[error("at {time} s there is a value that is not finite")]
    NotFinite {
        /// The time [s].
        time: f64,
    },
    /// Time stands still or runs back.
    #[error("after {before} s comes {time} s: time does not increase")]
    Order {
        /// The time of the row before [s].
        before: f64,
        /// The time of the row [s].
        time: f64,
    },
    /// The window reaches beyond the history.
    #[error("{from:.4} s to {to:.4} s is wanted and the history covers {first:.4} s to {last:.4} s")]
    NotCovered {
        /// Start of the window [s].
        from: f64,
        /// End of the window [s].
        to: f64,
        /// First time of the history [s].
        first: f64,
        /// Last time of the history [s].
        last: f64,
    },
    /// The steps are longer than the window.
    #[error(
        "between {from:.4} s and {to:.4} s the history has no value: its steps are too long for such a window"
    )]
    TooCoarse {
        /// Start of the window [s].
        from: f64,
        /// End of the window [s].
        to: f64,
    },
}

impl<const N: usize> History<N> {
    /// Takes rows of a time [s] and values.
    pub fn new(rows: impl IntoIterator<Item = (f64, [f64; N])>) -> Result<Self, HistoryError> {
        let (times, values): (Vec<f64>, Vec<[f64; N]>) = rows.into_iter().unzip();
        if times.is_empty() {
            return Err(HistoryError::Empty);
        }
        let finite = |(time, row): (&f64, &[f64; N])| time.is_finite() && row.iter().all(|x| x.is_finite());
        if let Some(bad) = times.iter().zip(&values).position(|row| !finite(row)) {
            return Err(HistoryError::NotFinite { time: times[bad] });
        }
        match times.windows(2).find(|pair| pair[1] <= pair[0]) {
            Some(pair) => Err(HistoryError::Order { before: pair[0], time: pair[1] }),
            None => Ok(Self { times, values }),
        }
    }

    /// The times [s].
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The values, one row a time.
    pub fn values(&self) -> &[[f64; N]] {
        &self.values
    }

    /// Continues with a run that was started again at `since` [s]: what this one has after that is dropped.
    pub fn overlay(&mut self, later: Self, since: f64) {
        let first = later.times[0];
        let keep = self.times.partition_point(|&time| time <= since + TIME_ROUNDING && time < first);
        self.times.truncate(keep);
        self.values.truncate(keep);
        self.times.extend(later.times);
        self.values.extend(later.values);
    }

    /// Mean over `from` to `to` [s], weighted by time.
    ///
    /// Trapezoids under the line through the values, cut at both ends of the window. The other choice, each value
    /// standing for the step before it, is of first order only and gives a section the weight of steps that began
    /// before it; both agree where the steps are equal and end with the window.
    pub fn mean(&self, from: f64, to: f64) -> Result<[f64; N], HistoryError> {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        if from < first - TIME_ROUNDING || to > last + TIME_ROUNDING || to <= from {
            return Err(HistoryError::NotCovered { from, to, first, last });
        }
        let inside = self.times.partition_point(|&t| t < from)..self.times.partition_point(|&t| t <= to);
        if inside.is_empty() {
            return Err(HistoryError::TooCoarse { from, to });
        }
        let between = inside.map(|i| (self.times[i], self.values[i]));
        let points = [(from, self.at(from))].into_iter().chain(between).chain([(to, self.at(to))]);
        let mut sum = [0.0; N];
        let mut before: Option<(f64, [f64; N])> = None;
        for (time, value) in points {
            if let Some((t, v)) = before {
                (0..N).for_each(|c| sum[c] += 0.5 * (v[c] + value[c]) * (time - t));
            }
            before = Some((time, value));
        }
        Ok(sum.map(|x| x / (to - from)))
    }

    /// The value at a time, by the line between its neighbors; that of the nearest end beyond them.
    fn at(&self, time: f64) -> [f64; N] {
        let after = self.times.partition_point(|&t| t < time);
        if after == 0 || after == self.times.len() {
            return self.values[after.min(self.times.len() - 1)];
        }
        let (a, b) = (after - 1, after);
        let share = (time - self.times[a]) / (self.times[b] - self.times[a]);
        std::array::from_fn(|c| self.values[a][c] + share * (self.values[b][c] - self.values[a][c]))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// Steps that grow by a quarter, from 0 to 1.1.
    fn history(value: impl Fn(f64) -> f64) -> History<1> {
        let steps = (0..13).scan((0.0, 0.02), |(time, step), _| {
            let now = *time;
            *time += *step;
            *step *= 1.25;
            Some(now)
        });
        History::new(steps.map(|t| (t, [value(t)]))).unwrap()
    }

    #[test]
    fn the_mean_of_a_line_is_exact_whatever_the_steps() {
        let line = history(|t| 3.0 - 2.0 * t);
        for (from, to) in [(0.0, 1.0), (0.1, 0.2), (0.33, 0.71)] {
            let mean = line.mean(from, to).unwrap()[0];
            assert!((mean - (3.0 - (from + to))).abs() < 1e-12, "{from} to {to}: {mean}");
        }
    }

    #[test]
    fn the_mean_of_a_parabola_errs_by_the_square_of_the_steps() {
        // trapezoids under t^2 with steps h are too large by sum h^3 / 6: hand-worked for steps of 0.1 and of 0.05
        for (step, count) in [(0.1, 10), (0.05, 20)] {
            let rows = (0..=count).map(|i| (f64::from(i) * step, [(f64::from(i) * step).powi(2)]));
            let mean = History::new(rows).unwrap().mean(0.0, 1.0).unwrap()[0];
            assert!((mean - (1.0 / 3.0 + step * step / 6.0)).abs() < 1e-12, "{step}: {mean}");
        }
    }

    #[test]
    fn neighboring_windows_share_no_time_and_lose_none() {
        let wave = history(|t| (9.0 * t).sin());
        let whole = wave.mean(0.1, 0.9).unwrap()[0] * 0.8;
        let edges = [0.1, 0.3, 0.35, 0.62, 0.9];
        let part = |pair: &[f64]| wave.mean(pair[0], pair[1]).unwrap()[0] * (pair[1] - pair[0]);
        assert!((whole - edges.windows(2).map(part).sum::<f64>()).abs() < 1e-12);
    }

    #[test]
    fn the_ends_of_a_window_count_half() {
        let history = History::new([(0.0, [1.0]), (1.0, [3.0]), (2.0, [8.0])]).unwrap();
        assert_eq!(history.mean(0.0, 2.0).unwrap(), [3.75]);
    }

    #[test]
    fn a_restart_replaces_what_ran_beyond_it() {
        let mut first = History::new([(1.0, [1.0]), (2.0, [2.0]), (2.5, [2.5]), (3.0, [3.0])]).unwrap();
        first.overlay(History::new([(2.6, [20.0]), (3.2, [30.0])]).unwrap(), 2.0);
        assert_eq!(first.times(), [1.0, 2.0, 2.6, 3.2]);
        assert_eq!(first.values(), [[1.0], [2.0], [20.0], [30.0]]);
    }

    #[test]
    fn what_is_no_history_is_refused() {
        assert_eq!(History::<1>::new([]), Err(HistoryError::Empty));
        let nan = History::new([(0.0, [1.0]), (1.0, [f64::NAN])]);
        assert_eq!(nan, Err(HistoryError::NotFinite { time: 1.0 }));
        let back = History::new([(0.0, [1.0]), (0.0, [1.0])]);
        assert_eq!(back, Err(HistoryError::Order { before: 0.0, time: 0.0 }));
    }

    #[test]
    fn a_window_beyond_the_history_or_between_two_steps_has_no_mean() {
        let history = History::new([(0.5, [1.0]), (1.0, [1.0]), (2.0, [1.0])]).unwrap();
        assert!(matches!(history.mean(0.4, 1.0), Err(HistoryError::NotCovered { .. })));
        assert!(matches!(history.mean(1.9, 2.1), Err(HistoryError::NotCovered { .. })));
        assert!(matches!(history.mean(1.2, 1.4), Err(HistoryError::TooCoarse { .. })));
        assert!(history.mean(1.0, 2.0 + 1e-9).is_ok(), "a time that was rounded in print");
    }
}
