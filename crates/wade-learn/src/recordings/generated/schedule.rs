//! Which trials: the source paper's table.

/// From where to where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Down the entry ramp into the channel.
    RampIn,
    /// Through the channel and up the exit ramp.
    RampOut,
    /// Down the entry ramp at an angle.
    RampInAngle,
}

impl Direction {
    fn name(self) -> &'static str {
        match self {
            Self::RampIn => "in",
            Self::RampOut => "out",
            Self::RampInAngle => "angle",
        }
    }
}

/// A row of the paper's table of trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableRow {
    /// From where to where.
    pub direction: Direction,
    /// Depth [in].
    pub inches: u32,
    /// Number of trials.
    pub cases: u32,
    /// Largest commanded speed [m/s].
    pub fastest: f64,
    /// Mean commanded speed [m/s].
    pub mean: f64,
}

/// The paper's table "Summary of Warthog water fording test cases": 71 trials. Its text speaks of 65 elsewhere (39 in, 26
/// out) and of 57 planar sections, of which 14 are at 10 inches, where the table has 18 trials.
pub const PAPER_TABLE: [TableRow; 7] = {
    use Direction::{RampIn, RampInAngle, RampOut};
    const fn row(direction: Direction, inches: u32, cases: u32, fastest: f64, mean: f64) -> TableRow {
        TableRow { direction, inches, cases, fastest, mean }
    }
    [
        row(RampIn, 4, 18, 4.952, 2.984),
        row(RampOut, 4, 17, 4.952, 2.708),
        row(RampIn, 8, 9, 3.025, 1.978),
        row(RampOut, 8, 5, 2.730, 1.654),
        row(RampIn, 10, 9, 2.531, 1.616),
        row(RampOut, 10, 9, 2.284, 1.550),
        row(RampInAngle, 4, 4, 3.518, 2.631),
    ]
};

/// Slowest command [m/s]: the paper's.
const SLOWEST: f64 = 0.5;

/// Meters in an inch.
const INCH: f64 = 0.0254;

/// One trial to be run.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Name, which says that it is generated.
    pub name: String,
    /// From where to where.
    pub direction: Direction,
    /// Water depth over the flat ground [m].
    pub depth: f64,
    /// Commanded speed [m/s].
    pub command: f64,
}

/// Every trial of the table. Commands rise from the slowest to the row's fastest by a power of their rank, chosen so that
/// their mean is the row's.
pub fn schedule() -> Vec<Planned> {
    let of_row = |row: TableRow| {
        let commands = commands(&row).into_iter().enumerate();
        commands.map(move |(index, command)| Planned {
            name: format!("generated-{}-{:02}in-{:02}", row.direction.name(), row.inches, index + 1),
            direction: row.direction,
            depth: f64::from(row.inches) * INCH,
            command,
        })
    };
    PAPER_TABLE.into_iter().flat_map(of_row).collect()
}

fn commands(row: &TableRow) -> Vec<f64> {
    let command = |power: f64, index: u32| {
        let rank = f64::from(index) / f64::from(row.cases - 1);
        SLOWEST + (row.fastest - SLOWEST) * rank.powf(power)
    };
    let mean = |power| (0..row.cases).map(|index| command(power, index)).sum::<f64>() / f64::from(row.cases);
    // the mean falls as the power rises
    let (mut low, mut high) = (0.01, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if mean(middle) > row.mean { low = middle } else { high = middle }
    }
    (0..row.cases).map(|index| command(low, index)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schedule_has_the_table_s_numbers() {
        let planned = schedule();
        assert_eq!(planned.len(), 71);
        assert!(planned.iter().all(|trial| trial.name.starts_with("generated-")));
        let mut start = 0;
        for row in PAPER_TABLE {
            let trials = &planned[start..start + row.cases as usize];
            start += row.cases as usize;
            let speeds: Vec<f64> = trials.iter().map(|trial| trial.command).collect();
            let mean = speeds.iter().sum::<f64>() / f64::from(row.cases);
            let fastest = speeds.iter().copied().fold(0.0, f64::max);
            assert!((mean - row.mean).abs() < 5e-4 && (fastest - row.fastest).abs() < 1e-12, "{row:?}");
            assert!(speeds.iter().all(|speed| (0.5..5.0).contains(speed)));
            assert!((trials[0].depth - f64::from(row.inches) * 0.0254).abs() < 1e-12);
        }
    }
}
