//! Names, kinds and coefficients of the library.

use serde::{Deserialize, Serialize};

/// Most coefficients of one effect.
pub const MAX_COEFFICIENTS: usize = 7;

/// Physical effects in the library: the most that a model can have.
pub const PHYSICS: usize = 14;

/// Nonlinear parameters of an effect; those it has none for are 0.
pub type Shape = [f64; 3];

/// What an effect is: a load of the water, a fault of the measuring chain, or of the drive's model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A load of the water.
    Physics,
    /// A fault of the measuring chain.
    Sensor,
    /// A fault in what is known of mass, drive and ground.
    Drive,
}

/// A named reason why a model and a measurement disagree. The place in this list is the wire's, see [`Effect::code`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Inertia of the water that moves with the hull.
    AddedMass,
    /// Drag in proportion to speed.
    LinearDamping,
    /// Quadratic drag with another coefficient.
    DragCoefficientError,
    /// Local velocity from the angular velocity.
    Rotation,
    /// Water that moves over ground.
    Current,
    /// The water stands higher than was said.
    WaterLevelOffset,
    /// The water is denser than was said.
    DensityError,
    /// Water runs into the hull.
    HullFlooding,
    /// The blow of entering the water.
    WaterEntrySlamming,
    /// Waves that the hull has made before.
    WaveMemory,
    /// The channel's walls speed the flow up.
    ChannelBlockage,
    /// The hull is drawn down by its own speed.
    Squat,
    /// Turning wheels throw water.
    WheelPaddleThrust,
    /// The hull drives over the bed instead of standing on it in a current.
    BedMotion,
    /// The wrench is stamped late.
    SensorDelay,
    /// A constant zero error.
    SensorBias,
    /// A zero that jumps.
    SensorBiasStep,
    /// A zero that drifts with time.
    SensorDrift,
    /// A wrong scale of a component.
    SensorGain,
    /// Sensor axes turned against the body's.
    AxisMisalignment,
    /// Rolling resistance that was not taken off.
    RollingResistance,
    /// A wrong scale of the known drive force.
    DriveGain,
    /// A wrong mass.
    MassError,
}

/// A coefficient: name, unit, what it can physically be, and what the literature says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficient {
    /// Name.
    pub name: &'static str,
    /// Unit; 1 where it has none.
    pub unit: &'static str,
    /// Least and largest value that is physically possible.
    pub bounds: [f64; 2],
    /// Band in which published values lie.
    pub literature: Option<[f64; 2]>,
}

const fn c(name: &'static str, unit: &'static str, low: f64, high: f64) -> Coefficient {
    Coefficient { name, unit, bounds: [low, high], literature: None }
}

const fn l(name: &'static str, low: f64, high: f64, band: [f64; 2]) -> Coefficient {
    Coefficient { name, unit: "1", bounds: [low, high], literature: Some(band) }
}

const ANY: f64 = 1e9;

impl Effect {
    /// The library.
    pub const ALL: [Self; 23] = [
        Self::AddedMass,
        Self::LinearDamping,
        Self::DragCoefficientError,
        Self::Rotation,
        Self::Current,
        Self::WaterLevelOffset,
        Self::DensityError,
        Self::HullFlooding,
        Self::WaterEntrySlamming,
        Self::WaveMemory,
        Self::ChannelBlockage,
        Self::Squat,
        Self::WheelPaddleThrust,
        Self::BedMotion,
        Self::SensorDelay,
        Self::SensorBias,
        Self::SensorBiasStep,
        Self::SensorDrift,
        Self::SensorGain,
        Self::AxisMisalignment,
        Self::RollingResistance,
        Self::DriveGain,
        Self::MassError,
    ];

    /// The name in reports and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::AddedMass => "added_mass",
            Self::LinearDamping => "linear_damping",
            Self::DragCoefficientError => "drag_coefficient_error",
            Self::Rotation => "rotation",
            Self::Current => "current",
            Self::WaterLevelOffset => "water_level_offset",
            Self::DensityError => "density_error",
            Self::HullFlooding => "hull_flooding",
            Self::WaterEntrySlamming => "water_entry_slamming",
            Self::WaveMemory => "wave_memory",
            Self::ChannelBlockage => "channel_blockage",
            Self::Squat => "squat",
            Self::WheelPaddleThrust => "wheel_paddle_thrust",
            Self::BedMotion => "bed_motion",
            Self::SensorDelay => "sensor_delay",
            Self::SensorBias => "sensor_bias",
            Self::SensorBiasStep => "sensor_bias_step",
            Self::SensorDrift => "sensor_drift",
            Self::SensorGain => "sensor_gain",
            Self::AxisMisalignment => "axis_misalignment",
            Self::RollingResistance => "rolling_resistance",
            Self::DriveGain => "drive_gain",
            Self::MassError => "mass_error",
        }
    }

    /// Number on the wire, from 1; new effects come last.
    pub fn code(self) -> u32 {
        self as u32 + 1
    }

    /// The effect of a number of the wire.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.code() == code)
    }

    /// Equation of a physical effect in a line, without what is common to all: loads act on the wet hull.
    pub fn equation(self) -> &'static str {
        match self {
            Self::AddedMass => {
                "W = -(M_A nu_dot + C_A(nu) nu), M_A = rho V diag(surge, sway, heave, roll (b2+d2)/12, pitch (l2+d2)/12, yaw (l2+b2)/12), or heave, roll, pitch with rho pi b A_wp / 8 for rho V"
            }
            Self::LinearDamping => "f_i = -c_i rho sqrt(g L) A_i u_i, u = v + omega x r",
            Self::DragCoefficientError => "f_i = -1/2 rho C_i A_i |v| v_i",
            Self::Rotation => "f = D(v + omega x r) - D(v), D_i(u) = -1/2 rho C A_i |u| u_i",
            Self::Current => "f = D(v - R^T u) - D(v) with the model's drag D",
            Self::WaterLevelOffset => {
                "W = offset dF/dd: rho g A_wp upwards, and the model's drag in proportion to the depth"
            }
            Self::DensityError => "W = e W_model",
            Self::HullFlooding => {
                "W = -phi rho g V h_in / h_out upwards, dh_in/dt = r sign(h_out - h_in) sqrt(2 g |h_out - h_in|)"
            }
            Self::WaterEntrySlamming => {
                "F = C rho dV/dd w^2 upwards and -C_h rho dV/dd w u across, w the rate of the depth d, on entry only; V the water displaced, or pi l (b d / h)^2 / 8 until d = h, wet_at, on each strip of length l with its own d and w"
            }
            Self::WaveMemory => {
                "f_i = -k_i rho V sqrt(g / L) Re z_i, or -k_i rho V (g / (L W)) Im z_i, z' = -(1/T - i W) z + dv/dt in body axes"
            }
            Self::ChannelBlockage => {
                "W = k D ((1 - m)^-2 - 1), m = A_wet,front / (w d), or W = k D (((1 - m)(1 - s / d))^-2 - 1) with m and s of squat in a channel"
            }
            Self::Squat => {
                "Fz = -c rho g A_wp s, s = v^2 / 2g (or / sqrt(|1 - Fr_h^2|), at most twice), in a channel s / d = Fr_h^2 / 2 (((1 - m)(1 - s / d))^-2 - 1) up to Schijf's limit and from there to 0 at faded_at, m = V / (L w d) but at most b / w, and a trim"
            }
            Self::WheelPaddleThrust => {
                "F = 1/2 rho C pi r^2 wet |omega r| (omega r - v_x) on each wheel, or F = 1/2 rho C r^2 int |u| u cos(phi) dphi over its wet lugs, u = omega r - v_x cos(phi); torque -1/2 rho C_t r^3 of the same without the cosine"
            }
            Self::BedMotion => {
                "F = 1/2 rho A |v_g| (-C_D v_g - C_S v_gy y + C_L |v_g| up), A the wet front or underside or |D| / (1/2 rho K v^2) with the model's drag D; the drag and the side force at the bed, the lift under the center of buoyancy"
            }
            _ => "",
        }
    }

    /// Whose fault it is.
    pub fn kind(self) -> Kind {
        match self {
            Self::SensorDelay
            | Self::SensorBias
            | Self::SensorBiasStep
            | Self::SensorDrift
            | Self::SensorGain
            | Self::AxisMisalignment => Kind::Sensor,
            Self::RollingResistance | Self::DriveGain | Self::MassError => Kind::Drive,
            _ => Kind::Physics,
        }
    }

    /// True where the coefficients after the first say more of the same load: its arm, its trim, its torque, the blow backwards
    /// that comes with one upwards.
    pub fn needs_its_first(self) -> bool {
        matches!(self, Self::HullFlooding | Self::Squat | Self::WheelPaddleThrust | Self::WaterEntrySlamming)
    }

    /// True where the load depends on the past, so that a server keeps a state.
    pub fn has_memory(self) -> bool {
        matches!(self, Self::HullFlooding | Self::WaveMemory)
    }

    /// The coefficients in which the effect is linear; sensor effects have one a wrench component.
    pub fn coefficients(self) -> &'static [Coefficient] {
        match self {
            // surge, sway, heave and roll, pitch, yaw over the displaced water's mass and inertia; sway and heave in
            // shallow water reach a few times the deep-water value (Zhou, Lo, Tan 2005)
            Self::AddedMass => {
                const {
                    &[
                        l("surge", 0.0, 6.0, [0.05, 1.5]),
                        l("sway", 0.0, 8.0, [0.2, 2.5]),
                        l("heave", 0.0, 10.0, [0.3, 3.0]),
                        l("roll", 0.0, 10.0, [0.02, 2.0]),
                        l("pitch", 0.0, 10.0, [0.05, 2.0]),
                        l("yaw", 0.0, 10.0, [0.05, 2.0]),
                    ]
                }
            }
            Self::LinearDamping => {
                const {
                    &[
                        l("surge", 0.0, 5.0, [0.0, 0.5]),
                        l("sway", 0.0, 5.0, [0.0, 0.5]),
                        l("heave", 0.0, 5.0, [0.0, 0.5]),
                    ]
                }
            }
            // the difference of two coefficients that each lie in 0 to 4
            Self::DragCoefficientError => {
                const {
                    &[
                        l("surge", -4.0, 4.0, [-1.0, 1.0]),
                        l("sway", -4.0, 4.0, [-1.0, 1.0]),
                        l("heave", -4.0, 4.0, [-1.0, 1.0]),
                    ]
                }
            }
            Self::Rotation => const { &[l("drag_coefficient", 0.0, 6.0, [0.4, 2.1])] },
            Self::Current => const { &[c("east", "m/s", -3.0, 3.0), c("north", "m/s", -3.0, 3.0)] },
            Self::WaterLevelOffset => const { &[c("offset", "m", -0.2, 0.2)] },
            Self::DensityError => const { &[c("relative_error", "1", -0.3, 1.0)] },
            Self::HullFlooding => const { &[c("flooded_share", "1", 0.0, 1.0), c("arm_x", "m", -2.0, 2.0)] },
            // von Karman's blow has no reserve: Wagner's is pi/2 of it
            Self::WaterEntrySlamming => {
                const { &[l("vertical", 0.0, 8.0, [0.3, 2.0]), l("horizontal", 0.0, 8.0, [0.3, 2.0])] }
            }
            Self::WaveMemory => {
                const { &[c("surge", "1", -10.0, 10.0), c("sway", "1", -10.0, 10.0), c("heave", "1", -10.0, 10.0)] }
            }
            Self::ChannelBlockage => const { &[l("strength", 0.0, 5.0, [0.5, 1.5])] },
            Self::Squat => const { &[l("sinkage", 0.0, 4.0, [0.1, 1.5]), c("trim", "1", -2.0, 2.0)] },
            Self::WheelPaddleThrust => {
                const { &[l("thrust", 0.0, 6.0, [0.1, 2.0]), c("torque", "1", -12.0, 12.0)] }
            }
            Self::BedMotion => {
                const { &[c("drag", "1", -4.0, 4.0), c("lift", "1", -4.0, 4.0), c("side", "1", -4.0, 4.0)] }
            }
            Self::SensorDelay => const { &[c("delay", "s", 0.0, 1.0)] },
            Self::SensorBias | Self::SensorBiasStep => {
                const {
                    &[
                        c("fx", "N", -ANY, ANY),
                        c("fy", "N", -ANY, ANY),
                        c("fz", "N", -ANY, ANY),
                        c("mx", "N m", -ANY, ANY),
                        c("my", "N m", -ANY, ANY),
                        c("mz", "N m", -ANY, ANY),
                    ]
                }
            }
            Self::SensorDrift => {
                const {
                    &[
                        c("fx", "N/s", -ANY, ANY),
                        c("fy", "N/s", -ANY, ANY),
                        c("fz", "N/s", -ANY, ANY),
                        c("mx", "N m/s", -ANY, ANY),
                        c("my", "N m/s", -ANY, ANY),
                        c("mz", "N m/s", -ANY, ANY),
                    ]
                }
            }
            Self::SensorGain => {
                const {
                    // farther off it is no error of a scale: such a channel was zeroed in the water, or holds something else
                    &[
                        c("fx", "1", -0.5, 1.0),
                        c("fy", "1", -0.5, 1.0),
                        c("fz", "1", -0.5, 1.0),
                        c("mx", "1", -0.5, 1.0),
                        c("my", "1", -0.5, 1.0),
                        c("mz", "1", -0.5, 1.0),
                        // one calibration factor of the whole sensor
                        c("all", "1", -0.5, 1.0),
                    ]
                }
            }
            Self::AxisMisalignment => {
                const {
                    &[
                        c("about_x", "rad", -0.5, 0.5),
                        c("about_y", "rad", -0.5, 0.5),
                        c("about_z", "rad", -0.5, 0.5),
                    ]
                }
            }
            Self::RollingResistance => const { &[l("coefficient", 0.0, 0.5, [0.01, 0.15])] },
            Self::DriveGain => const { &[c("relative_error", "1", -0.9, 3.0)] },
            Self::MassError => const { &[c("relative_error", "1", -0.5, 1.0)] },
        }
    }

    /// True for the form that takes the drag of the prediction itself, in proportion.
    pub fn is_in_proportion(self, shape: &Shape) -> bool {
        match self {
            Self::DragCoefficientError | Self::BedMotion => shape[0] > 1.5,
            Self::ChannelBlockage => shape[0] > 0.0,
            _ => false,
        }
    }

    /// True for an effect that changes the flow which the model's own drag speaks of.
    pub(super) fn acts_on_own_drag(self) -> bool {
        matches!(self, Self::Current | Self::WaterLevelOffset)
    }

    /// Names and units of the nonlinear parameters that a report states.
    pub fn shape_names(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::HullFlooding => &[("opening_ratio", "1")],
            Self::Squat | Self::ChannelBlockage => &[("faded_at", "1")],
            Self::WaterEntrySlamming => &[("wet_at", "m")],
            Self::WaveMemory => &[("time_constant", "s"), ("frequency", "rad/s")],
            _ => &[],
        }
    }

    /// The effect of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_reports_and_coefficients_have_room() {
        for effect in Effect::ALL {
            assert_eq!(Effect::from_name(effect.name()), Some(effect));
            assert_eq!(serde_json::to_value(effect).ok(), Some(effect.name().into()));
            let coefficients = effect.coefficients();
            assert!((1..=MAX_COEFFICIENTS).contains(&coefficients.len()));
            assert!(coefficients.iter().all(|c| c.bounds[0] < c.bounds[1] && c.bounds[0] <= 0.0));
            assert_eq!(Effect::from_code(effect.code()), Some(effect));
            assert_eq!(effect.equation().is_empty(), effect.kind() != Kind::Physics);
        }
        let physics = Effect::ALL.into_iter().filter(|effect| effect.kind() == Kind::Physics);
        assert_eq!(physics.count(), PHYSICS);
    }

    #[test]
    fn the_documentation_lists_every_effect_with_its_parameters() {
        let page = include_str!("../../../../docs/src/concepts/effects.md");
        for effect in Effect::ALL {
            let row = format!("| `{}` |", effect.name());
            let row = page.lines().find(|line| line.starts_with(&row)).unwrap_or_default();
            let coefficients = effect.coefficients().iter().map(|c| c.name);
            for name in coefficients.chain(effect.shape_names().iter().map(|(name, _)| *name)) {
                let is_component = matches!(name, "fy" | "fz" | "mx" | "my");
                assert!(
                    is_component || row.contains(&format!("`{name}`")),
                    "{}: {name} in {row}",
                    effect.name()
                );
            }
        }
    }
}
