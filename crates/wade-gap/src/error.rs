//! Why there is no report.

/// Why there is no verdict.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GapError {
    /// A setting that makes no sense.
    #[error("{key} = {value} must be {expected}")]
    Config {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Trials of another vehicle.
    #[error("the trials are of vehicle \"{trials}\", not \"{asked}\": give --vehicle {trials}")]
    Vehicle {
        /// In the trials.
        trials: String,
        /// Asked for.
        asked: String,
    },
    /// Another simulator's prediction, but nothing known of the body.
    #[error(
        "vehicle \"{vehicle}\" has no bundle, and trials.toml has no [body] table (length, width, draft, mass, displaced_volume, center_of_mass)"
    )]
    NoBody {
        /// The vehicle.
        vehicle: String,
    },
    /// Neither a bundle nor `sim_` columns.
    #[error(
        "{trial}.csv has no sim_ column and vehicle \"{vehicle}\" has no bundle: nothing predicts the wrench"
    )]
    NoPrediction {
        /// Name of the trial.
        trial: String,
        /// The vehicle.
        vehicle: String,
    },
    /// A control that is not there.
    #[error(
        "{trial}.csv has no sim_ column, which measured.sim_is = \"control\" of trials.toml calls a control: add the columns to every trial, or leave the key out"
    )]
    NoControl {
        /// Name of the trial.
        trial: String,
    },
    /// No component to compare.
    #[error(
        "{trial}.csv has no measured component that is predicted: it needs one of fx, fy, fz, mx, my, mz, or method = \"inverse_dynamics\" with the columns of the other forces"
    )]
    NothingMeasured {
        /// Name of the trial.
        trial: String,
    },
    /// Components that differ.
    #[error(
        "{trial}.csv differs from the trial before it in column {component}: all trials must have the same components; list those to use in measured.columns"
    )]
    Components {
        /// Name of the trial.
        trial: String,
        /// The component.
        component: &'static str,
    },
    /// Predictions of two makers.
    #[error(
        "{trial}.csv and {other}.csv differ in whether they have sim_ columns: one simulator must predict all trials"
    )]
    Predictions {
        /// Name of the trial.
        trial: String,
        /// Name of the one that differs.
        other: String,
    },
    /// A channel without a signal.
    #[error(
        "column {column}: {value} in every row of {place}, where a standard deviation of {spread:.3} {unit} is expected: the channel was dead or not recorded; leave the trial out, or list the other components in measured.columns"
    )]
    Dead {
        /// The trial, or all of them.
        place: String,
        /// The column.
        column: &'static str,
        /// The value.
        value: f64,
        /// Standard deviation of what is expected [N or N m].
        spread: f64,
        /// The unit.
        unit: &'static str,
    },
    /// A channel that stands at the end of its range.
    #[error(
        "column {column}: {count} samples of {place} are exactly {value} {unit}, an end of its range, where a standard deviation of {spread:.3} {unit} is expected: did the sensor saturate? Leave those rows or the trial out, or list the other components in measured.columns"
    )]
    Saturated {
        /// The trial, or all of them.
        place: String,
        /// The column.
        column: &'static str,
        /// The value [N or N m].
        value: f64,
        /// How many samples have it.
        count: usize,
        /// Standard deviation of what is expected in them [N or N m].
        spread: f64,
        /// The unit.
        unit: &'static str,
    },
    /// A load with the other sign.
    #[error(
        "column {column} of {place} is {ratio:.2} times what is expected: is its sign reversed, or that of the motion? x is forward, y left, z up, and loads are those of the water on the vehicle, without its weight"
    )]
    Reversed {
        /// The trial, or all of them.
        place: String,
        /// The column.
        column: &'static str,
        /// Measured over expected.
        ratio: f64,
    },
    /// Two channels, each of which is the other.
    #[error(
        "columns {column} and {other} of {place} hold what is expected of each other: are their names exchanged? x is forward, y left, z up"
    )]
    Swapped {
        /// The trial, or all of them.
        place: String,
        /// The column.
        column: &'static str,
        /// The other.
        other: &'static str,
    },
    /// One channel under two names.
    #[error("columns {column} and {other} hold the same values in every row: one of them was written twice")]
    Copied {
        /// The column.
        column: &'static str,
        /// The other.
        other: &'static str,
    },
    /// A load that holds the weight of the vehicle.
    #[error(
        "column {column} is {off:.0} N off what is expected in every trial, as where it holds the weight of the vehicle ({mass} kg, {weight:.0} N): loads are those of the water on the vehicle; take the weight off, m g along the world's up in body axes"
    )]
    Weight {
        /// The column.
        column: &'static str,
        /// Measured less expected, mean [N].
        off: f64,
        /// Of the vehicle [kg].
        mass: f64,
        /// Of the vehicle [N].
        weight: f64,
    },
    /// Known forces, or a mass, in another unit.
    #[error(
        "inverse_dynamics, {column}: the motion less the known forces is what is expected of the water if {what} of trials.toml is {factor:.3} times as large: {suspected}"
    )]
    Driven {
        /// The component.
        column: &'static str,
        /// What is in another unit.
        what: &'static str,
        /// What it must be multiplied with.
        factor: f64,
        /// A question.
        suspected: &'static str,
    },
    /// A load in another unit.
    #[error(
        "column {column} of {place} is {ratio:.2e} of what is expected: is it in {other}? It must be in {unit}"
    )]
    Unit {
        /// The trial, or all of them.
        place: String,
        /// The column.
        column: &'static str,
        /// Measured over expected.
        ratio: f64,
        /// What it must be in.
        unit: &'static str,
        /// What it seems to be in.
        other: &'static str,
    },
    /// Deeper than anything that wades.
    #[error(
        "{trial}.csv, row {row}, column {column}: {depth} m of water over the ground, where the hull is {height:.2} m high: is it in another unit?"
    )]
    Deep {
        /// Name of the trial.
        trial: String,
        /// Line of its file.
        row: u64,
        /// The column that states it.
        column: &'static str,
        /// The depth [m].
        depth: f64,
        /// Height of the hull [m].
        height: f64,
    },
    /// The same samples under two names.
    #[error("{trial}.csv holds the same samples as {other}.csv: leave one of them out")]
    SameTrial {
        /// Name of the trial.
        trial: String,
        /// Name of the other.
        other: String,
    },
    /// Dry twins beside a measured wrench.
    #[error(
        "{trial}.csv has a dry twin and a measured wrench: a twin is taken off what method = \"inverse_dynamics\" infers from the motion; leave measured.dry_twins out, or the columns of the wrench"
    )]
    TwinOfMeasured {
        /// Name of the trial.
        trial: String,
    },
    /// Too few to keep some back.
    #[error(
        "{trials} trials are too few: the method keeps some back and needs at least {least}, dry twins not counted"
    )]
    TooFewTrials {
        /// Trials found.
        trials: usize,
        /// Trials needed.
        least: usize,
    },
    /// A trial that is kept back and repeats one that is not: what was named would be tested on what it was named by.
    #[error(
        "{trial}.csv cannot be held out, since it repeats {other}.csv, which is used for naming (measured.repeats of trials.toml): record trials that repeat none, raise held_out so that a whole group is held out, or list only trials of one and the same command"
    )]
    RepeatKeptBack {
        /// Name of the trial.
        trial: String,
        /// Name of one that it repeats.
        other: String,
    },
    /// Too short to cut into blocks.
    #[error(
        "{blocks} blocks of {block_s} s are too few for {folds} folds: record longer trials, or make block_s smaller"
    )]
    TooShort {
        /// Blocks found.
        blocks: usize,
        /// Length of a block [s].
        block_s: f64,
        /// Folds.
        folds: usize,
    },
    /// A channel that the hull does not fit into.
    #[error(
        "{trial}.csv was run in a channel of {channel} m, and the hull is {hull:.3} m wide: channel_width and channel_widths of trials.toml are in meters"
    )]
    NarrowChannel {
        /// Name of the trial.
        trial: String,
        /// Width of the channel [m].
        channel: f64,
        /// Width of the hull [m].
        hull: f64,
    },
    /// Wheel speeds, or velocities, in another unit.
    #[error(
        "columns wheel_fl to wheel_rr: the wheels roll with a radius of {radius:.4} m, and have one of {wheel:.3} m, as where {suspected}"
    )]
    WheelUnit {
        /// Speed over wheel speed [m].
        radius: f64,
        /// Of the vehicle's wheels [m].
        wheel: f64,
        /// What is likely, and what to do.
        suspected: String,
    },
    /// A channel that stops.
    #[error(
        "column {column} of {place}: {count} samples from t = {from:.3} s on are exactly {value} {unit}, where a standard deviation of {spread:.3} {unit} is expected: the channel stopped; leave those rows or the trial out"
    )]
    Stopped {
        /// The trial.
        place: String,
        /// The column.
        column: &'static str,
        /// When it stopped [s].
        from: f64,
        /// How many samples have the value.
        count: usize,
        /// The value [N or N m].
        value: f64,
        /// Standard deviation of what is expected in them [N or N m].
        spread: f64,
        /// The unit.
        unit: &'static str,
    },
    /// No trial is in the water.
    #[error(
        "no sample of any trial is in the water: the largest depth is {depth:.3} m, and depth counts upwards from the plane on which the vehicle stands"
    )]
    Dry {
        /// Largest depth [m].
        depth: f64,
    },
    /// A twin that is not there.
    #[error("{trial}.csv has the dry twin {twin}, which is not there")]
    NoTwin {
        /// Name of the trial.
        trial: String,
        /// Name of the twin.
        twin: String,
    },
    /// A twin that ends before its trial.
    #[error(
        "{twin}.csv, the dry twin of {trial}.csv, is {seconds:.2} s shorter: cut the one, or record the other again"
    )]
    ShortTwin {
        /// Name of the trial.
        trial: String,
        /// Name of the twin.
        twin: String,
        /// By how much [s].
        seconds: f64,
    },
    /// A prediction that is no number.
    #[error("{trial}.csv, row {row}: the predicted wrench is not finite")]
    NotFinite {
        /// Name of the trial.
        trial: String,
        /// Line of its file.
        row: u64,
    },
}
