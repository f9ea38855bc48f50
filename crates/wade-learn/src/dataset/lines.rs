//! Lines of numbers, as solvers write them while they run.

/// What to do with a last line that is not whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CutOff {
    /// Refuse the file: a run that ended has whole lines.
    Refuse,
    /// Leave the line out: the run goes on.
    Drop,
}

/// A line that is no row of numbers. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LineError {
    /// The last line is not whole.
    #[error(
        "line {line}: the file is cut off here; where the run still goes on, --running leaves the line out"
    )]
    CutOff {
        /// Number of the line.
        line: usize,
    },
    /// Too few or too many numbers, or something else among them.
    #[error("line {line}: {found} numbers can be read where there must be {expected}")]
    Numbers {
        /// Number of the line.
        line: usize,
        /// Numbers up to the first that is none, or to the end.
        found: usize,
        /// Numbers of a row.
        expected: usize,
    },
    /// NaN or infinite.
    #[error("line {line}, number {number}: {value} is not finite; did the run diverge?")]
    NotFinite {
        /// Number of the line.
        line: usize,
        /// Which number of the line, from 1.
        number: usize,
        /// What stands there.
        value: f64,
    },
}

/// Reads the lines of one text.
pub(super) struct Lines<'a> {
    text: &'a str,
    cut_off: CutOff,
    count: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a str, cut_off: CutOff) -> Self {
        Self { text, cut_off, count: text.lines().count() }
    }

    /// The lines with their numbers from 1, blank ones left out.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &'a str)> + use<'a> {
        let numbered = self.text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
        numbered.filter(|(_, line)| !line.is_empty())
    }

    /// The numbers of a line, all of them finite; `None` where it is cut off and that is allowed.
    pub(super) fn row(
        &self,
        line: usize,
        text: &str,
        expected: usize,
    ) -> Result<Option<Vec<f64>>, LineError> {
        let row = self.numbers(line, text, expected)?;
        row.iter().flatten().enumerate().try_for_each(|(index, value)| finite(line, index, *value))?;
        Ok(row)
    }

    /// The same where NaN and infinity may stand in it.
    pub(super) fn numbers(
        &self,
        line: usize,
        text: &str,
        expected: usize,
    ) -> Result<Option<Vec<f64>>, LineError> {
        let row: Vec<f64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
        let found = row.len();
        let whole = found == expected && text.split_whitespace().count() == expected;
        // without the end of its line the last number may have lost digits
        let last = line == self.count;
        if last && (found < expected || !self.text.ends_with('\n')) {
            return match self.cut_off {
                CutOff::Drop => Ok(None),
                CutOff::Refuse => Err(LineError::CutOff { line }),
            };
        }
        if !whole {
            return Err(LineError::Numbers { line, found, expected });
        }
        Ok(Some(row))
    }
}

/// Refuses a number of a line that is not finite, counted from 0.
pub(super) fn finite(line: usize, index: usize, value: f64) -> Result<(), LineError> {
    match value.is_finite() {
        true => Ok(()),
        false => Err(LineError::NotFinite { line, number: index + 1, value }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn second(text: &str, cut_off: CutOff) -> Result<Option<Vec<f64>>, LineError> {
        let lines = Lines::new(text, cut_off);
        lines.iter().nth(1).map_or(Ok(None), |(line, text)| lines.row(line, text, 2))
    }

    #[test]
    fn a_last_line_without_its_end_is_refused_even_if_it_has_all_its_numbers() {
        for text in ["1 2\n3 4", "1 2\n3", "1 2\n3\n", "1 2\n3 4e-"] {
            assert_eq!(second(text, CutOff::Refuse), Err(LineError::CutOff { line: 2 }), "{text:?}");
            assert_eq!(second(text, CutOff::Drop), Ok(None), "{text:?}");
        }
        assert_eq!(second("1 2\n3 4\n", CutOff::Refuse), Ok(Some(vec![3.0, 4.0])));
    }

    #[test]
    fn a_damaged_line_is_refused_whether_or_not_the_run_goes_on() {
        for cut_off in [CutOff::Refuse, CutOff::Drop] {
            let damaged = second("1 2\n3\n5 6\n", cut_off);
            assert_eq!(damaged, Err(LineError::Numbers { line: 2, found: 1, expected: 2 }));
            let longer = second("1 2\n3 4 5\n5 6\n", cut_off);
            assert_eq!(longer, Err(LineError::Numbers { line: 2, found: 3, expected: 2 }));
            let diverged = second("1 2\n3 -nan\n5 6\n", cut_off);
            assert!(matches!(diverged, Err(LineError::NotFinite { line: 2, number: 2, .. })));
        }
    }
}
