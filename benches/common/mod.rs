//! Turns, tails and tables for the benches.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use hdrhistogram::Histogram;

/// Each subject is measured in this many turns, one after the other, so that a drift of the machine meets all.
const TURNS: usize = 10;
/// Length of a turn.
const TURN: Duration = Duration::from_millis(300);

/// A row of a table.
pub struct Row {
    subject: String,
    histogram: Histogram<u64>,
    /// Multiply-adds of the subject, where a share of the peak is of interest; else 0.
    multiply_adds: u64,
}

impl Row {
    pub fn new(subject: impl Into<String>, multiply_adds: u64) -> Self {
        let histogram = Histogram::new_with_bounds(1, 1_000_000_000, 3).expect("valid bounds");
        Self { subject: subject.into(), histogram, multiply_adds }
    }

    fn us(&self, quantile: f64) -> f64 {
        self.histogram.value_at_quantile(quantile) as f64 * 1e-3
    }
}

/// A row and what it times.
pub type Subject = (Row, Box<dyn FnMut()>);

/// Times every call of every subject, turn by turn.
pub fn measure(subjects: &mut [Subject]) {
    for _ in 0..TURNS {
        for (row, work) in &mut *subjects {
            let end = Instant::now() + TURN;
            loop {
                let start = Instant::now();
                work();
                let now = Instant::now();
                row.histogram.saturating_record((now - start).as_nanos() as u64);
                if now >= end {
                    break;
                }
            }
        }
    }
}

/// Commit, processor and time of a measurement.
pub fn machine() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs();
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = cpuinfo.lines().find_map(|line| line.strip_prefix("model name\t: ")).unwrap_or("unknown");
    let cores = cpuinfo.lines().filter(|line| line.starts_with("processor")).count();
    format!("commit {}, {cpu}, {cores} cores, {seconds} s since 1970", env!("WADE_COMMIT"))
}

/// Writes a table into the folder after `--out`, if there is one.
pub fn write(name: &str, csv: &str) {
    let arguments: Vec<String> = std::env::args().collect();
    let out = arguments.iter().position(|a| a == "--out").and_then(|i| arguments.get(i + 1));
    let Some(folder) = out.map(PathBuf::from) else { return };
    let path = folder.join(format!("{name}.csv"));
    std::fs::create_dir_all(&folder).expect("the folder");
    std::fs::write(&path, csv).expect("the table");
    println!("{}", path.display());
}

/// What a bench prints and writes.
pub struct Table {
    name: &'static str,
    rows: Vec<Row>,
    /// Multiply-adds a second that the core can do [1/s].
    peak: Option<f64>,
}

impl Table {
    pub fn new(name: &'static str) -> Self {
        Self { name, rows: Vec::new(), peak: None }
    }

    pub fn add(&mut self, subjects: Vec<Subject>) {
        self.rows.extend(subjects.into_iter().map(|(row, _)| row));
    }

    #[allow(dead_code, reason = "every bench is a crate of its own, and one has a peak")]
    pub fn set_peak(&mut self, multiply_adds_per_second: f64) {
        self.peak = Some(multiply_adds_per_second);
    }

    /// Time of the row's multiply-adds at the peak of the core [us].
    fn floor_us(&self, row: &Row) -> Option<f64> {
        let peak = self.peak.filter(|_| row.multiply_adds > 0)?;
        Some(row.multiply_adds as f64 / peak * 1e6)
    }

    pub fn print(&self) {
        if let Some(peak) = self.peak {
            println!("peak of this core: {:.1} GFLOP/s in single precision", 2e-9 * peak);
        }
        println!(
            "{:<52} {:>9} {:>9} {:>10} {:>17}",
            "subject", "p50 [us]", "p99 [us]", "p99.9 [us]", "dense floor [us]"
        );
        for row in &self.rows {
            let floor = self.floor_us(row).map(|floor| format!("{floor:.2}")).unwrap_or_default();
            let (p50, p99, p99_9) = (row.us(0.5), row.us(0.99), row.us(0.999));
            println!("{:<52} {p50:>9.2} {p99:>9.2} {p99_9:>10.2} {floor:>17}", row.subject);
        }
    }

    /// Writes the table into the folder after `--out`, if there is one.
    pub fn write_where_asked(&self) {
        write(self.name, &self.csv());
    }

    fn csv(&self) -> String {
        let mut csv = format!("# {}\n", machine());
        if let Some(peak) = self.peak {
            // writing to a String cannot fail
            let _ = writeln!(csv, "# peak of the core {:.1} GFLOP/s in single precision", 2e-9 * peak);
        }
        csv.push_str("subject,count,p50_us,p99_us,p99_9_us,max_us,dense_floor_us\n");
        for row in &self.rows {
            let floor = self.floor_us(row).map(|floor| format!("{floor:.3}")).unwrap_or_default();
            let [p50, p99, p99_9, max] = [0.5, 0.99, 0.999, 1.0].map(|q| row.us(q));
            let count = row.histogram.len();
            let _ =
                writeln!(csv, "\"{}\",{count},{p50:.3},{p99:.3},{p99_9:.3},{max:.3},{floor}", row.subject);
        }
        csv
    }
}
