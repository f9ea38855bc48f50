//! What a unit takes and gives. The order is that of the value references, so a new variable comes last.

use std::ops::Range;

use crate::settings::Settings;

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Float64
    Real,
    /// Boolean
    Boolean,
    /// UInt32
    Count,
    /// Enumeration of [`PHYSICS`]
    Physics,
}

/// Names of how much of the physical base answers, numbered from 1.
pub const PHYSICS: [&str; 4] = ["as_served", "full", "quasi_steady", "hydrostatic"];

/// Who sets a variable, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// The user, before the run.
    Parameter,
    /// The simulator, at any step.
    Input,
    /// The unit.
    Output,
    /// Nobody: it is the time.
    Independent,
}

/// Length of an array along one of its axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// The same for every vehicle.
    Fixed(usize),
    /// One a surface.
    Surfaces,
    /// One a wheel or track.
    Wheels,
}

/// What is said of a variable.
#[derive(Debug)]
pub struct Row {
    /// Name in the description.
    pub name: &'static str,
    /// Type.
    pub kind: Kind,
    /// Who sets it.
    pub causality: Causality,
    /// Lengths of an array by rows; none of a number.
    pub lengths: &'static [Length],
    /// Its unit, by its name there; empty for numbers without one.
    pub unit: &'static str,
    /// Value before anybody sets it, in every place but those of `Variable::Gravity`.
    pub start: f64,
    /// A sentence.
    pub description: &'static str,
}

/// Makes the closed set of variables from one table.
macro_rules! variables {
    ($($variable:ident $name:literal $kind:ident $causality:ident $lengths:expr, $unit:literal $start:literal $description:literal;)*) => {
        /// A variable; see its [`Row`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[allow(missing_docs, reason = "the row of each says what it is")]
        pub enum Variable { $($variable,)* }

        const ROWS: &[Row] = &[$(Row {
            name: $name, kind: Kind::$kind, causality: Causality::$causality, lengths: $lengths, unit: $unit, start: $start,
            description: $description,
        },)*];

        impl Variable {
            /// In the order of their references.
            pub const ALL: [Self; ROWS.len()] = [$(Self::$variable,)*];
        }
    };
}

const VECTOR: &[Length] = &[Length::Fixed(3)];
const MATRIX: &[Length] = &[Length::Fixed(6), Length::Fixed(6)];
const SURFACES: &[Length] = &[Length::Surfaces];
const OF_SURFACES: &[Length] = &[Length::Surfaces, Length::Fixed(3)];

variables! {
    Time "time" Real Independent &[], "s" 0.0 "Simulated time";
    ImplicitAddedMass "implicit_added_mass" Boolean Parameter &[], "" 0.0 "The simulator adds added_mass to its own mass matrix: force and moment leave -M_A nu_dot out";
    DryContact "dry_contact" Boolean Parameter &[], "" 0.0 "No water pressure under the contact patches of the tires";
    Physics "physics" Physics Parameter &[], "" 1.0 "How much of the physical base answers";
    WheelSpeedsGiven "wheel_speeds_given" Boolean Parameter &[], "" 0.0 "wheel_speed_radps holds speeds; otherwise wheels roll with the velocity over ground";
    HeadingGiven "heading_given" Boolean Parameter &[], "" 0.0 "heading_rad holds the heading, for effects of a current";
    BedClearanceGiven "bed_clearance_given" Boolean Parameter &[], "" 0.0 "bed_clearance_m holds the clearance; otherwise the vehicle is on the bed up to the level at which it floats";
    Timeout "timeout_s" Real Parameter &[], "s" 1.0 "Longest wait for an answer of a server";
    OldestAnswer "oldest_answer_s" Real Parameter &[], "s" 0.0 "A server that does not answer is bridged with its last answer up to this age in simulated time; 0: never";
    Velocity "velocity_mps" Real Input VECTOR, "m/s" 0.0 "Velocity over ground, body frame";
    Current "current_mps" Real Input VECTOR, "m/s" 0.0 "Velocity of the water over ground, body frame";
    AngularVelocity "angular_velocity_radps" Real Input VECTOR, "rad/s" 0.0 "Angular velocity, body frame";
    Acceleration "acceleration_mps2" Real Input VECTOR, "m/s2" 0.0 "Acceleration of the body origin, body frame";
    AngularAcceleration "angular_acceleration_radps2" Real Input VECTOR, "rad/s2" 0.0 "Angular acceleration, body frame";
    Gravity "gravity_direction" Real Input VECTOR, "" 0.0 "Unit vector along gravity (down), body frame";
    WaterLevel "water_level_m" Real Input &[], "m" -100.0 "Signed height of the still-water plane above the body origin along up";
    Density "density_kgpm3" Real Input &[], "kg/m3" 1000.0 "Density of the water";
    WheelSpeed "wheel_speed_radps" Real Input &[Length::Wheels], "rad/s" 0.0 "Speed of each wheel or track by axle from the front, left before right";
    Heading "heading_rad" Real Input &[], "rad" 0.0 "Angle from the world's x to the body's x";
    BedClearance "bed_clearance_m" Real Input &[], "m" 0.0 "Distance from the ground-contact plane down to the bed";
    Force "force_n" Real Output VECTOR, "N" 0.0 "Net force of the water, body frame";
    Moment "moment_nm" Real Output VECTOR, "N.m" 0.0 "Net moment about center_of_mass_m, body frame";
    CenterOfMass "center_of_mass_m" Real Output VECTOR, "m" 0.0 "Point that the moment is about, body frame";
    ForceDeviation "force_deviation_n" Real Output VECTOR, "N" 0.0 "One standard deviation of the net force";
    MomentDeviation "moment_deviation_nm" Real Output VECTOR, "N.m" 0.0 "One standard deviation of the net moment";
    AddedMass "added_mass" Real Output MATRIX, "" 0.0 "Added mass and inertia about center_of_mass_m, forces first [kg, kg m, kg m2]";
    Damping "damping" Real Output MATRIX, "" 0.0 "Linear damping by waves about center_of_mass_m, forces first [N s/m, N s, N m s]; zero in a run, whose memory of waves has it";
    ShaftPower "shaft_power_w" Real Output &[], "W" 0.0 "Power that the shafts of the wheels put in";
    Outside "outside" Real Output &[Length::Fixed(8)], "" 0.0 "How far speed, flow angle, density, depth, tilt, vertical speed, angular speed and distance lie outside the training domain, each in its unit";
    InDomain "in_domain" Boolean Output &[], "" 0.0 "No quantity lies outside the training domain";
    WettedFraction "wetted_fraction" Real Output SURFACES, "" 0.0 "Share of each surface under water";
    Age "age_s" Real Output &[], "s" 0.0 "Simulated time since the state that the outputs answer; 0 unless a server was bridged";
    BundleVersion "bundle_version" Count Output &[], "" 0.0 "Version of the bundle that answered";
    SurfaceForce "surface_force_n" Real Output OF_SURFACES, "N" 0.0 "Force on each surface, body frame";
    SurfacePoint "surface_point_m" Real Output OF_SURFACES, "m" 0.0 "Point at which it acts, body frame";
    SurfaceCouple "surface_couple_nm" Real Output OF_SURFACES, "N.m" 0.0 "Moment of the load of each surface about that point, body frame";
}

/// Place of the z of the gravity direction.
const DOWN: usize = 2;

impl Variable {
    /// What is said of it.
    pub fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }

    /// Its value reference.
    pub fn reference(self) -> u32 {
        self as u32
    }

    /// The variable of a value reference.
    pub fn from_reference(reference: u32) -> Option<Self> {
        Self::ALL.get(reference as usize).copied()
    }

    /// Whether a unit has it.
    pub fn is_in(self, settings: &Settings) -> bool {
        match self {
            Self::SurfaceForce | Self::SurfacePoint | Self::SurfaceCouple => settings.surface_loads,
            Self::WheelSpeed | Self::WheelSpeedsGiven => settings.wheels > 0,
            Self::Timeout | Self::OldestAnswer | Self::Age => settings.address.is_some(),
            _ => true,
        }
    }

    /// Lengths of its array in a unit.
    pub fn lengths(self, settings: &Settings) -> impl Iterator<Item = usize> {
        self.row().lengths.iter().map(|length| match length {
            Length::Fixed(length) => *length,
            Length::Surfaces => settings.surfaces.len(),
            Length::Wheels => settings.wheels,
        })
    }

    /// Its values before anybody sets them.
    pub fn start(self, settings: &Settings) -> Vec<f64> {
        let mut values = vec![self.row().start; self.lengths(settings).product()];
        if self == Self::Gravity {
            values[DOWN] = -1.0;
        }
        values
    }
}

/// Where the values of a unit lie in its memory.
#[derive(Debug, Clone)]
pub struct Layout {
    places: Vec<Option<Range<usize>>>,
}

impl Layout {
    /// Where they lie, and what they begin with.
    pub fn new(settings: &Settings) -> (Self, Vec<f64>) {
        let mut values = Vec::new();
        let place = |variable: Variable| {
            variable.is_in(settings).then(|| {
                let begin = values.len();
                values.extend(variable.start(settings));
                begin..values.len()
            })
        };
        let places = Variable::ALL.into_iter().map(place).collect();
        (Self { places }, values)
    }

    /// The place of a variable; none of one that the unit does not have.
    pub fn place(&self, variable: Variable) -> Option<Range<usize>> {
        self.places[variable as usize].clone()
    }
}
