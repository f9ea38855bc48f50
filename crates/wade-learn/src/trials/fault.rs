//! What can be wrong with measured data.

use super::glitch::Glitch;
use super::manifest::MANIFEST_FILE;
use wade_core::condition::LEAST_UPRIGHT;

/// What is wrong with a file of measured data. Rows are lines of the file, the header being row 1.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Missing or unreadable.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// Not CSV.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// A folder without a manifest.
    #[error("there is no {MANIFEST_FILE}: it names at least the vehicle (vehicle = \"warthog\")")]
    NoManifest,
    /// A folder without a trial.
    #[error("there is no trial: a trial is a CSV file beside {MANIFEST_FILE}")]
    NoTrial,
    /// Two files whose names differ in the case of their endings alone.
    #[error(
        "{name}.csv is there twice, its ending once in capitals: rename one, a trial is named after its file"
    )]
    SameName {
        /// The name of both.
        name: String,
    },
    /// A column that is needed.
    #[error("column {column} is missing; there are: {present}")]
    MissingColumn {
        /// The column.
        column: String,
        /// Those in the file.
        present: String,
    },
    /// Neither a depth nor a water level.
    #[error("column depth is missing, or water_level in its place; there are: {present}")]
    NoLevel {
        /// Columns of the file.
        present: String,
    },
    /// A depth over the flat ground that the trial's depths contradict.
    #[error(
        "nominal_depth.{trial} = {stated}, in meters over the flat ground, but the samples of {trial}.csv lie {deepest:.3} m deep at most: correct the one or the other"
    )]
    NominalDepth {
        /// The trial.
        trial: String,
        /// As stated [m].
        stated: f64,
        /// Largest depth but for a twentieth of the samples [m].
        deepest: f64,
    },
    /// A depth and a water level.
    #[error("columns depth and water_level are both there: give one of the two")]
    TwoLevels,
    /// A depth of a vehicle that lies on its side or its back.
    #[error(
        "row {row}, column depth: a depth means nothing for a vehicle on its side or its back (body z within {:.0} degrees of level or below): give water_level",
        LEAST_UPRIGHT.asin().to_degrees()
    )]
    NoDepth {
        /// The row.
        row: u64,
    },
    /// A bed above the ground-contact plane.
    #[error("row {row}, column {column}: {value} must not be negative: leave the column out for the default")]
    Negative {
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The value.
        value: f64,
    },
    /// No share.
    #[error("row {row}, column {column}: {value} must lie between 0 (parked) and 1 (driving)")]
    NoShare {
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The value.
        value: f64,
    },
    /// Another vehicle than the folder's.
    #[error(
        "row {row}, column vehicle: \"{found}\" is not the vehicle of trials.toml, \"{expected}\": put the trials of each vehicle into a folder of their own"
    )]
    Vehicle {
        /// The row.
        row: u64,
        /// In the row.
        found: String,
        /// In the manifest.
        expected: String,
    },
    /// Two columns of one name.
    #[error(
        "column \"{column}\" is there twice, as number {first} and {second}: leave one out or name it otherwise"
    )]
    DuplicateColumn {
        /// The column.
        column: String,
        /// Its place, from 1.
        first: usize,
        /// The place of the other.
        second: usize,
    },
    /// A cell without a finite number.
    #[error(
        "row {row}, column {column}: \"{value}\" is no finite number: mend the value or leave the row out"
    )]
    NotANumber {
        /// The row.
        row: u64,
        /// The column.
        column: String,
        /// What stands there.
        value: String,
    },
    /// Time does not increase.
    #[error(
        "row {row}, column t: {t} s does not come after {before} s: sort the rows and leave repeated ones out"
    )]
    Time {
        /// The row.
        row: u64,
        /// Its time [s].
        t: f64,
        /// The time of the row before [s].
        before: f64,
    },
    /// Samples that stand alone, too many to leave them out.
    #[error(
        "{count} of {rows} rows stand alone among those around them, the first in row {}, column {} ({}): the recording is damaged; mend it, or take the column out of measured.columns",
        .first.row, .first.column, .first.value
    )]
    Glitches {
        /// How many.
        count: usize,
        /// Rows in the file.
        rows: usize,
        /// One of them.
        first: Glitch,
    },
    /// No header.
    #[error("the file is empty: its first line names the columns")]
    Empty,
    /// Too few rows.
    #[error("{rows} rows are too few, at least {least} are needed")]
    TooShort {
        /// Rows in the file.
        rows: usize,
        /// Rows needed.
        least: usize,
    },
    /// A value beyond what the quantity can be.
    #[error("row {row}, column {column}: {value} lies outside {min} to {max} {unit}: is it in another unit?")]
    Implausible {
        /// The row.
        row: u64,
        /// The column.
        column: String,
        /// The value.
        value: f64,
        /// Least plausible value.
        min: f64,
        /// Largest plausible value.
        max: f64,
        /// The unit of the column.
        unit: &'static str,
    },
    /// Angles that change as fast in degrees as the angular velocity says in radians.
    #[error(
        "row {row}, column {column}: {value} seems to be in degrees, since the column changes {ratio:.0} times as fast as {rate_column} says: convert it to radians"
    )]
    Degrees {
        /// The row of the largest value.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The angular velocity.
        rate_column: &'static str,
        /// How many times as fast.
        ratio: f64,
    },
    /// An angular velocity in degrees per second.
    #[error(
        "row {row}, column {rate_column}: {value} seems to be in degrees a second, since it is {ratio:.0} times what {column} shows: convert it to rad/s"
    )]
    DegreesPerSecond {
        /// The row of the largest value.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The angular velocity.
        rate_column: &'static str,
        /// How many times as large.
        ratio: f64,
    },
    /// An angular velocity in turns a minute.
    #[error(
        "row {row}, column {rate_column}: {value} seems to be in turns a minute, since it is {ratio:.1} times what {column} shows: divide it by 9.549"
    )]
    TurnsPerMinute {
        /// The row of the largest value.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The angular velocity.
        rate_column: &'static str,
        /// How many times as large.
        ratio: f64,
    },
    /// An angle that turns against its rate.
    #[error(
        "row {row}, column {column}: it turns against {rate_column}: the sign of one of the two is reversed"
    )]
    Opposed {
        /// The first row.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The angular velocity.
        rate_column: &'static str,
    },
    /// A clock that counts something else than seconds.
    #[error(
        "row {row}, column t: it seems to be in {unit}, since {column} changes {ratio:.2e} times as fast over it as {rate_column} says: convert it to seconds"
    )]
    TimeUnit {
        /// The first row.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The angular velocity.
        rate_column: &'static str,
        /// The change of the angle over what its rate turns.
        ratio: f64,
        /// What it seems to be in.
        unit: &'static str,
    },
    /// A depth or a level that does not change as the vertical velocity says.
    #[error(
        "row {row}, column {column}: it changes {ratio:.3} times as much as vx, vy, vz, roll and pitch say that the vehicle goes down: {suspected} Lengths are in m, velocities in m/s"
    )]
    Vertical {
        /// The first row.
        row: u64,
        /// The column.
        column: &'static str,
        /// Its change over that of the height.
        ratio: f64,
        /// A question.
        suspected: &'static str,
    },
    /// A depth or a level that rises with the vehicle.
    #[error(
        "row {row}, column {column}: it falls where vx, vy, vz, roll and pitch say that the vehicle goes down: {column} counts the water upwards, and vz points up; the sign of one of them is reversed"
    )]
    Rising {
        /// The first row.
        row: u64,
        /// The column.
        column: &'static str,
    },
    /// A clock that contradicts velocity and acceleration.
    #[error(
        "row {row}, column t: {column} is {ratio:.3e} times the change of the velocity over t: t must be in seconds, velocities in m/s and accelerations in m/s2, with one sign"
    )]
    Clock {
        /// The first row.
        row: u64,
        /// The acceleration.
        column: &'static str,
        /// The acceleration over the derivative of the velocity.
        ratio: f64,
    },
    /// An accelerometer in multiples of gravity.
    #[error(
        "row {row}, column {column}: {value} seems to be an accelerometer in g, since it is {ratio:.2} of what the velocity shows: multiply by 9.81"
    )]
    AccelerometerInG {
        /// The row of the largest value.
        row: u64,
        /// The column.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The column over the derivative of the velocity.
        ratio: f64,
    },
    /// An accelerometer that feels gravity.
    #[error(
        "row {row}, column {column}: its mean of {mean:.2} holds gravity{in_g}, while the velocity shows {from_velocity:.2} m/s2: take gravity off"
    )]
    Gravity {
        /// The first row.
        row: u64,
        /// The column with most of it.
        column: &'static str,
        /// Its mean.
        mean: f64,
        /// The mean derivative of the velocity [m/s2].
        from_velocity: f64,
        /// Says so where the unit is g.
        in_g: &'static str,
    },
    /// A name in the manifest that no file has.
    #[error("{key} names \"{name}\", but there is no {name}.csv")]
    UnknownTrial {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A name in the manifest that is no component of the wrench.
    #[error("{key} names \"{name}\", which is none of fx, fy, fz, mx, my, mz")]
    UnknownComponent {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A column of known forces whose name does not say on what it acts.
    #[error(
        "{key} names \"{name}\", which ends in none of _fx, _fy, _fz, _mx, _my, _mz: name it after the component it acts on"
    )]
    NoComponentInName {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// Known loads of a cell where there is none.
    #[error(
        "measured.known_loads is what a load cell bears; with inverse_dynamics name the columns in other_forces"
    )]
    KnownLoadsInferred,
    /// No component at all.
    #[error(
        "measured.columns is empty: list the measured components, or leave the key out for those that a trial has"
    )]
    NoColumns,
    /// A trial that is listed twice among the repeats.
    #[error(
        "measured.repeats lists \"{name}\" twice: put all trials that repeat each other into one list, each once"
    )]
    RepeatTwice {
        /// The trial.
        name: String,
    },
    /// A dry twin that is itself a trial in water.
    #[error(
        "measured.dry_twins makes \"{dry}\" the dry twin of \"{wet}\" and a trial in water, too: name the run of the same command without water"
    )]
    WetTwin {
        /// The trial in water.
        wet: String,
        /// Its twin.
        dry: String,
    },
    /// A column that is promised and that no trial has.
    #[error("{key} names \"{name}\", which is a column of no trial")]
    UnknownColumn {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// An inertia that no body has.
    #[error(
        "inertia {why}: state it by rows, [[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]] in kg m2 about the center of mass, products as they stand in the matrix"
    )]
    Inertia {
        /// What is wrong.
        why: &'static str,
    },
    /// A number in the manifest that makes no sense.
    #[error("{key} = {value} must be {expected}")]
    Number {
        /// The key of the manifest.
        key: String,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}
