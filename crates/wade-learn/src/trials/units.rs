//! Units that cannot be: values beyond any limit, and columns that contradict each other.
//!
//! An angle turns at its rate, and the water rises along a hull as fast as the hull goes down: still water and a clock in seconds
//! leave no other factor than 1 between them.

use super::manifest::component_of;
use super::table::Table;
use super::trial::{DEPTH, WATER_LEVEL, WRENCH};
use super::{Fault, TrialError};
use wade_core::at::At;
use wade_core::frame::{GRAVITY, Vec3, up_from_roll_pitch};

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
/// Turns a minute of a radian a second.
const PER_MINUTE: f64 = 30.0 / std::f64::consts::PI;
/// Times by which an acceleration and the derivative of the velocity may differ, where noise and filters bend either, and the
/// correlation from which they say the same.
const CLOCK: f64 = 1.7;
const SAME_MOTION: f64 = 0.95;
/// Share by which a factor of 57.3 or 1 / 9.81 may be missed by noise and filters.
const FACTOR_TOLERANCE: f64 = 0.3;

/// Share of what the rate turns, over a clock that counts frames, below which an angle changes: nothing is recorded at less than
/// 5 Hz.
const FRAMES: f64 = 0.2;
/// Share by which a factor of [`VERTICAL`] may be missed: two of them are a tenth apart.
const VERTICAL_TOLERANCE: f64 = 0.12;
/// Times that the water rises along the hull what the hull goes down, in other units.
const VERTICAL: [(f64, &str); 10] = [
    (1000.0, "is it in millimeters?"),
    (100.0, "is it in centimeters?"),
    (1.0 / 0.0254, "is it in inches?"),
    (1.0 / 0.3048, "is it in feet?"),
    (1.0 / 1.943_844, "are the velocities in knots?"),
    (1.0 / 2.236_936, "are the velocities in miles an hour?"),
    (0.3048, "are the velocities in feet a second?"),
    (1.0 / 3.6, "are the velocities in km/h?"),
    (0.01, "are the velocities in cm/s?"),
    (0.001, "are the velocities in mm/s, or t in milliseconds?"),
];

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

/// Refuses angles in degrees, angular velocities in degrees a second and a clock that does not count seconds, which show in
/// each other.
pub(super) fn check_angles(table: &Table) -> Result<(), TrialError> {
    let t = table.column("t");
    for (angle, rate) in ANGLES.into_iter().filter(|(angle, _)| table.has(angle)) {
        let turned = integral(t, table.column(rate));
        let unwrapped = unwrapped(table.column(angle));
        let Some(ratio) = factor(&turned, &unwrapped, SAME) else { continue };
        if near(-ratio, 1.0) {
            let fault = Fault::Opposed { row: table.rows[0], column: angle, rate_column: rate };
            return Err(At::path(&table.path)(fault));
        }
        if ratio < 0.0 {
            continue;
        }
        let degrees = 180.0 / std::f64::consts::PI;
        let clock = match is_count(t) && ratio < FRAMES {
            true => Some("frames"),
            false => near(ratio, 1e-3).then_some("milliseconds"),
        };
        let fault = if let Some(unit) = clock {
            Fault::TimeUnit { row: table.rows[0], column: angle, rate_column: rate, ratio, unit }
        } else if near(ratio, degrees) {
            let (row, value) = largest(table, angle);
            Fault::Degrees { row, column: angle, value, rate_column: rate, ratio }
        } else if near(ratio, 1.0 / degrees) {
            let (row, value) = largest(table, rate);
            Fault::DegreesPerSecond { row, column: angle, value, rate_column: rate, ratio: 1.0 / ratio }
        } else if near(ratio, 1.0 / PER_MINUTE) {
            let (row, value) = largest(table, rate);
            Fault::TurnsPerMinute { row, column: angle, value, rate_column: rate, ratio: 1.0 / ratio }
        } else {
            continue;
        };
        return Err(At::path(&table.path)(fault));
    }
    Ok(())
}

/// Refuses depths, levels and velocities whose unit or sign shows in each other: still water rises along a hull as fast as the
/// hull goes down.
pub(super) fn check_vertical(table: &Table) -> Result<(), TrialError> {
    let column = if table.has(WATER_LEVEL) { WATER_LEVEL } else { DEPTH };
    let of = |name: &str, row: usize| table.column(name).get(row).copied().unwrap_or_default();
    let count = table.column("t").len();
    let ups: Vec<Vec3> =
        (0..count).map(|row| up_from_roll_pitch(of("roll", row), of("pitch", row)).into_inner()).collect();
    let falling = |row: usize| -Vec3::from(["vx", "vy", "vz"].map(|name| of(name, row))).dot(&ups[row]);
    let sunk = integral(table.column("t"), &(0..count).map(falling).collect::<Vec<_>>());
    // a depth is counted along the body's z
    let upright = |row: usize| if column == DEPTH { ups[row].z } else { 1.0 };
    let level: Vec<f64> = (0..count).map(|row| of(column, row) * upright(row)).collect();
    let Some(ratio) = factor(&sunk, &level, SAME_MOTION) else { return Ok(()) };
    let row = table.rows[0];
    if near(-ratio, 1.0) {
        return Err(At::path(&table.path)(Fault::Rising { row, column }));
    }
    // of a negative ratio it is no number
    let distance = |factor: f64| (ratio / factor).ln().abs();
    let nearest = VERTICAL.into_iter().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
    match nearest.filter(|(factor, _)| distance(*factor) < VERTICAL_TOLERANCE) {
        Some((_, suspected)) => Err(At::path(&table.path)(Fault::Vertical { row, column, ratio, suspected })),
        None => Ok(()),
    }
}

/// True for a clock that counts.
fn is_count(t: &[f64]) -> bool {
    t.len() > 1 && t.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// Refuses accelerations in g and accelerations with gravity in them, against the derivative of the velocity [m/s2].
pub(super) fn check_accelerometer(table: &Table, from_velocity: &[Vec3]) -> Result<(), TrialError> {
    let names = ["ax", "ay", "az"];
    let fault = |fault| Err(At::path(&table.path)(fault));
    let derived = [0, 1, 2].map(|axis| from_velocity.iter().map(|a| a[axis]).collect::<Vec<f64>>());
    for (derived, column) in derived.iter().zip(names) {
        if let Some(ratio) = factor(derived, table.column(column), SAME).filter(|r| near(*r, 1.0 / GRAVITY)) {
            let (row, value) = largest(table, column);
            return fault(Fault::AccelerometerInG { row, column, value, ratio });
        }
    }
    for (derived, column) in derived.iter().zip(names) {
        let ([xx, xy, yy], spread) = products(derived, table.column(column));
        let ratio = (yy / xx).sqrt().copysign(xy);
        let is_same = xy.abs() > SAME_MOTION * (xx * yy).sqrt() && spread > EXCITED[1];
        if is_same && !(1.0 / CLOCK..CLOCK).contains(&ratio) {
            return fault(Fault::Clock { row: table.rows[0], column, ratio });
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

/// The factor between two columns of at least a correlation, negative where one goes against the other, from the ratio of their
/// spreads: noise bends it by less than the factors that are looked for. `None` where they do not say the same, or hardly move.
fn factor(x: &[f64], y: &[f64], same: f64) -> Option<f64> {
    let ([xx, xy, yy], _) = products(x, y);
    let spread = |squares: f64| (squares / x.len().max(1) as f64).sqrt();
    let excited = spread(xx.min(yy)) > EXCITED[0] && spread(xx.max(yy)) > EXCITED[1];
    (excited && xy.abs() > same * (xx * yy).sqrt()).then(|| (yy / xx).sqrt().copysign(xy))
}

/// Sums of squares and products about the means, and the spread of the second.
fn products(x: &[f64], y: &[f64]) -> ([f64; 3], f64) {
    let (mx, my) = (mean(x), mean(y));
    let pairs = x.iter().zip(y).map(|(x, y)| (x - mx, y - my));
    let sums = pairs.fold([0.0; 3], |[xx, xy, yy], (x, y)| [xx + x * x, xy + x * y, yy + y * y]);
    (sums, (sums[2] / y.len().max(1) as f64).sqrt())
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
