//! Units that cannot be: values beyond any limit, and columns that contradict each other.

use super::manifest::component_of;
use super::table::Table;
use super::trial::{DEPTH, WATER_LEVEL, WRENCH};
use super::{Fault, TrialError};
use wade_core::at::At;
use wade_core::frame::{GRAVITY, Vec3};

/// Least and largest plausible value of a column, and its unit.
const LIMITS: [(&[&str], f64, f64, &str); 8] = [
    (&["vx", "vy", "vz", "cx", "cy", "cz"], -50.0, 50.0, "m/s"),
    (&["wx", "wy", "wz"], -50.0, 50.0, "rad/s"),
    (&["pitch"], -1.6, 1.6, "rad"),
    (&[DEPTH, WATER_LEVEL], -100.0, 20.0, "m"),
    (&["ax", "ay", "az"], -500.0, 500.0, "m/s2"),
    (&["alx", "aly", "alz"], -5000.0, 5000.0, "rad/s2"),
    (&["rho"], 500.0, 3000.0, "kg/m3"),
    (&["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"], -1000.0, 1000.0, "rad/s"),
];

/// Largest roll of a trial with a depth, and of one with a water level, in which a vehicle may lie on its back [rad].
const ROLL: [f64; 2] = [1.6, 3.2];

/// No force, and no moment, measured, predicted or known, is larger.
const LOADS: [(f64, &str); 2] = [(1e7, "N"), (1e8, "N m")];
/// No trial lasts longer [s].
const LONGEST: f64 = 1e6;

/// An angle and the angular velocity that is nearly its rate in a body that is nearly level.
const ANGLES: [(&str, &str); 3] = [("roll", "wx"), ("pitch", "wy"), ("yaw", "wz")];

/// Two columns say the same but for a factor when they are correlated as well as this: a derivative is noisy.
const SAME: f64 = 0.7;
/// Least spread of the smaller and of the larger of two columns from which a factor can be told [rad or m/s2].
const EXCITED: [f64; 2] = [0.002, 0.02];
/// Share by which a factor of 57.3 or 1 / 9.81 may be missed by noise and filters.
const FACTOR_TOLERANCE: f64 = 0.3;

/// Refuses values beyond the limits of their column.
pub(super) fn check_limits(table: &Table) -> Result<(), TrialError> {
    let start = table.column("t").first().copied().unwrap_or_default();
    check_column(table, "t", (start, start + LONGEST, "s"))?;
    let roll = ROLL[usize::from(table.has(WATER_LEVEL))];
    check_column(table, "roll", (-roll, roll, "rad"))?;
    for (names, min, max, unit) in LIMITS {
        for &name in names {
            check_column(table, name, (min, max, unit))?;
        }
    }
    for name in table.columns.keys() {
        let own = WRENCH.iter().position(|known| *known == name.as_str());
        if let Some(component) = own.or_else(|| component_of(name)) {
            let (max, unit) = LOADS[component / 3];
            check_column(table, name, (-max, max, unit))?;
        }
    }
    Ok(())
}

fn check_column(
    table: &Table,
    name: &str,
    (min, max, unit): (f64, f64, &'static str),
) -> Result<(), TrialError> {
    match table.column(name).iter().position(|value| !(min..=max).contains(value)) {
        Some(row) => {
            let (value, row, column) = (table.column(name)[row], table.rows[row], name.to_owned());
            Err(At::path(&table.path)(Fault::Implausible { row, column, value, min, max, unit }))
        }
        None => Ok(()),
    }
}

/// Refuses angles in degrees and angular velocities in degrees a second, which show in each other.
pub(super) fn check_angles(table: &Table) -> Result<(), TrialError> {
    let t = table.column("t");
    for (angle, rate) in ANGLES.into_iter().filter(|(angle, _)| table.has(angle)) {
        let turned = integral(t, table.column(rate));
        let unwrapped = unwrapped(table.column(angle));
        let Some(ratio) = factor(&turned, &unwrapped) else { continue };
        let degrees = 180.0 / std::f64::consts::PI;
        let fault = if near(ratio, degrees) {
            let (row, value) = largest(table, angle);
            Fault::Degrees { row, column: angle, value, rate_column: rate, ratio }
        } else if near(ratio, 1.0 / degrees) {
            let (row, value) = largest(table, rate);
            Fault::DegreesPerSecond { row, column: angle, value, rate_column: rate, ratio: 1.0 / ratio }
        } else {
            continue;
        };
        return Err(At::path(&table.path)(fault));
    }
    Ok(())
}

/// Refuses accelerations in g and accelerations with gravity in them, against the derivative of the velocity [m/s2].
pub(super) fn check_accelerometer(table: &Table, from_velocity: &[Vec3]) -> Result<(), TrialError> {
    let names = ["ax", "ay", "az"];
    let fault = |fault| Err(At::path(&table.path)(fault));
    for (axis, column) in names.into_iter().enumerate() {
        let derived: Vec<f64> = from_velocity.iter().map(|a| a[axis]).collect();
        if let Some(ratio) = factor(&derived, table.column(column)).filter(|r| near(*r, 1.0 / GRAVITY)) {
            let (row, value) = largest(table, column);
            return fault(Fault::AccelerometerInG { row, column, value, ratio });
        }
    }
    let mean_of = |column: &str| mean(table.column(column));
    let measured = Vec3::from(names.map(mean_of));
    let derived = from_velocity.iter().sum::<Vec3>() / from_velocity.len().max(1) as f64;
    let extra = (measured - derived).norm();
    let in_g = if (extra / GRAVITY - 1.0).abs() < 0.1 {
        ""
    } else if (extra - 1.0).abs() < 0.1 && derived.norm() < 0.3 {
        " in g"
    } else {
        return Ok(());
    };
    let axis = (measured - derived).iamax();
    let (mean, from_velocity) = (measured[axis], derived[axis]);
    fault(Fault::Gravity { row: table.rows[0], column: names[axis], mean, from_velocity, in_g })
}

fn near(ratio: f64, factor: f64) -> bool {
    (ratio / factor - 1.0).abs() < FACTOR_TOLERANCE
}

fn largest(table: &Table, column: &str) -> (u64, f64) {
    let rows = table.rows.iter().copied().zip(table.column(column).iter().copied());
    rows.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or_default()
}

/// The factor between two columns that say the same, from the ratio of their spreads: noise bends it by less than the
/// factors of 10 and 57 that are looked for. `None` where they do not say the same, or hardly move.
fn factor(x: &[f64], y: &[f64]) -> Option<f64> {
    let (mx, my) = (mean(x), mean(y));
    let pairs = || x.iter().zip(y).map(|(x, y)| (x - mx, y - my));
    let (xx, yy) = pairs().fold((0.0, 0.0), |(xx, yy), (x, y)| (xx + x * x, yy + y * y));
    let xy: f64 = pairs().map(|(x, y)| x * y).sum();
    let spread = |squares: f64| (squares / x.len().max(1) as f64).sqrt();
    let excited = spread(xx.min(yy)) > EXCITED[0] && spread(xx.max(yy)) > EXCITED[1];
    (excited && xy > SAME * (xx * yy).sqrt()).then(|| (yy / xx).sqrt())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Trapezoids from the first sample on.
fn integral(t: &[f64], values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = (1..t.len()).map(|i| 0.5 * (values[i] + values[i - 1]) * (t[i] - t[i - 1]));
    std::iter::once(0.0)
        .chain(steps.map(|step| {
            sum += step;
            sum
        }))
        .collect()
}

/// An angle without its jumps of a whole turn, in radians or degrees.
fn unwrapped(angle: &[f64]) -> Vec<f64> {
    let turn = if angle.iter().any(|a| a.abs() > 2.0 * std::f64::consts::TAU) {
        360.0
    } else {
        std::f64::consts::TAU
    };
    let mut offset = 0.0;
    let mut last = angle.first().copied().unwrap_or_default();
    let mut next = |&value: &f64| {
        offset -= ((value - last) / turn).round() * turn;
        last = value;
        value + offset
    };
    angle.iter().map(&mut next).collect()
}
