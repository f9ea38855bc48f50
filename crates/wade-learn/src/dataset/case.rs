//! The description of a CFD case, `case.toml`: the state that it was run in, and how the solver's axes become the body
//! frame.
//!
//! ```toml
//! vehicle = "warthog"
//! set = "paper"
//! speed_mps = 2.0              # of the water past the vehicle, with flow_angle_deg or heading_deg;
//! flow_angle_deg = 60.0        # or water_velocity_mps = [0, 0, -2], in the axes of the CFD
//! density_kgpm3 = 1000.0
//! depth_m = 0.2
//! domain_m = [10.0, 6.0, 3.0]  # length, width, height; optional
//! bed = "parked"               # or "driving": the bed moves with the water
//! ground_contact = "dry"       # or "wetted": water reaches under the tires
//! rest = "rest"                # folder with the same files for the case at rest; optional
//!
//! [frame]                      # of a CFD with z forward, y up and so x to the left
//! x = "z"                      # the axis of the CFD that points forward, left and up when the vehicle is level
//! y = "x"
//! z = "y"
//! origin_m = [0.0, 0.0, 0.0]   # the body origin in coordinates of the CFD
//! yaw_deg = 0.0                # how the vehicle stands in these axes; also pitch_deg and roll_deg
//!
//! [surfaces]                   # the solver's name of a surface, where it is not ours
//! wheel_fl = "wheel-front-left"
//!
//! [report]                     # Fluent alone: the columns of the report files
//! force = "{surface}-f{axis}"  # axis: x, y, z of the CFD
//! viscous = "{surface}-v{axis}"
//! moment = "{surface}-m{axis}"
//! moment_center_m = [0.0, 0.0, 0.0]
//! ```
//!
//! The source paper has z from the rear to the front, y up and x to the right, and calls that right-handed, which it is
//! not: one of the three is mistaken. Its lateral forces are mirrored, so their sign does not show; that of moments would.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Rotation3, UnitVector3};
use serde::{Deserialize, Serialize};

use wade_core::condition::{Condition, GroundContact};
use wade_core::frame::Vec3;
use wade_core::vehicle::spec::{Axis, BodyFromStl};

/// What the file holds, as it is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseFile {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the set that the case was planned in.
    #[serde(default = "cfd")]
    pub set: String,
    /// Speed of the water past the vehicle [m/s].
    pub speed_mps: Option<f64>,
    /// Angle of the vehicle's velocity from its right side, the paper's phi [degrees]: 90 head-on, below that the
    /// vehicle drifts to its left.
    ///
    /// The paper leaves the sign of the lateral part open, and mirrors every case; this is the sign of our own plan.
    pub flow_angle_deg: Option<f64>,
    /// Direction of the vehicle's velocity from ahead to the left [degrees]: 90 less the flow angle.
    pub heading_deg: Option<f64>,
    /// Velocity of the undisturbed water in the axes of the CFD [m/s], instead of speed and angle.
    pub water_velocity_mps: Option<[f64; 3]>,
    /// Density of the fluid [kg/m3].
    pub density_kgpm3: f64,
    /// Depth of the undisturbed water [m].
    pub depth_m: f64,
    /// Length, width and height of the domain [m].
    pub domain_m: Option<[f64; 3]>,
    /// Whether the bed moves.
    pub bed: Bed,
    /// Whether water reaches under the tires.
    pub ground_contact: GroundContact,
    /// From the axes of the CFD to the body frame.
    pub frame: Frame,
    /// The solver's names of surfaces.
    #[serde(default)]
    pub surfaces: BTreeMap<String, String>,
    /// Folder, beside the description, with the same files for the case at rest.
    pub rest: Option<String>,
    /// Columns of Fluent's report files.
    pub report: Option<Report>,
}

fn cfd() -> String {
    "cfd".to_owned()
}

/// What the bed does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bed {
    /// The vehicle is parked in a current.
    Parked,
    /// The vehicle drives through still water: the bed moves with the water.
    Driving,
}

/// From the axes of the CFD to the body frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// The axis of the CFD that points forward when yaw, pitch and roll are zero.
    pub x: Axis,
    /// The axis that points left.
    pub y: Axis,
    /// The axis that points up, against gravity.
    pub z: Axis,
    /// The body origin in coordinates of the CFD [m].
    pub origin_m: [f64; 3],
    /// Positive to the left [degrees].
    #[serde(default)]
    pub yaw_deg: f64,
    /// Positive lowers the nose [degrees].
    #[serde(default)]
    pub pitch_deg: f64,
    /// Positive lowers the right side [degrees].
    #[serde(default)]
    pub roll_deg: f64,
}

/// Names of columns, in which `{surface}` and `{axis}` stand for a surface and for x, y or z.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// Pressure and viscous force.
    pub force: String,
    /// The viscous part.
    pub viscous: Option<String>,
    /// Moment about `moment_center_m`.
    pub moment: Option<String>,
    /// The point that moments are taken about, in coordinates of the CFD [m].
    pub moment_center_m: Option<[f64; 3]>,
}

impl Report {
    fn check(&self) -> Result<(), CaseError> {
        let patterns = [Some(&self.force), self.viscous.as_ref(), self.moment.as_ref()];
        let vague = |pattern: &&String| !(pattern.contains("{surface}") && pattern.contains("{axis}"));
        match patterns.into_iter().flatten().find(vague) {
            Some(pattern) => Err(CaseError::Pattern { pattern: pattern.clone() }),
            None if self.moment.is_some() && self.moment_center_m.is_none() => Err(CaseError::MomentCenter),
            None => Ok(()),
        }
    }
}

/// Why a description describes nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CaseError {
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// The velocity is stated twice or not at all.
    #[error(
        "state the velocity in one way: speed_mps with flow_angle_deg, speed_mps with heading_deg, or water_velocity_mps"
    )]
    Velocity,
    /// A number that makes no sense.
    #[error("{key} is {value}, which is not {expected}")]
    Number {
        /// Name of the key.
        key: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Axes that are left-handed or not perpendicular.
    #[error(
        "frame: x, y and z are left-handed or name an axis twice, and a solver's axes are right-handed: look again which points forward, left and up"
    )]
    Axes,
    /// A name that is the same for two columns.
    #[error("report: `{pattern}` must hold {{surface}} and {{axis}}")]
    Pattern {
        /// The name.
        pattern: String,
    },
    /// Moments about an unknown point.
    #[error("report: moment needs moment_center_m")]
    MomentCenter,
}

/// Where the vehicle stands in the axes of the CFD.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Turns vectors of the CFD into the body frame.
    pub body_from_cfd: Matrix3<f64>,
    /// The body origin in coordinates of the CFD [m].
    pub origin: Vec3,
    /// World up in the body frame.
    pub up: UnitVector3<f64>,
}

impl Placement {
    /// A force of the CFD in the body frame [N].
    pub fn force(&self, force: &Vec3) -> Vec3 {
        self.body_from_cfd * force
    }

    /// A moment of the CFD about `about`, with its force, as the moment about the body origin in the body frame [N m].
    pub fn moment(&self, moment: &Vec3, force: &Vec3, about: &Vec3) -> Vec3 {
        self.body_from_cfd * (moment + (about - self.origin).cross(force))
    }
}

impl CaseFile {
    /// Reads the text of a description and checks it.
    pub fn parse(text: &str) -> Result<Self, CaseError> {
        let file: Self = toml::from_str(text)?;
        file.check()?;
        Ok(file)
    }

    fn check(&self) -> Result<(), CaseError> {
        let [length, width, height] = self.domain_m.unwrap_or([f64::MAX; 3]);
        let positive = [
            ("density_kgpm3", self.density_kgpm3),
            ("depth_m", self.depth_m),
            ("domain_m", length.min(width)),
            ("domain_m: height less depth_m", height - self.depth_m),
        ];
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(CaseError::Number { key, value, expected: "positive" });
            }
        }
        if let Some(value) = self.speed_mps.filter(|speed| !(*speed >= 0.0 && speed.is_finite())) {
            return Err(CaseError::Number { key: "speed_mps", value, expected: "0 or more" });
        }
        let Frame { origin_m, yaw_deg, pitch_deg, roll_deg, .. } = self.frame;
        let angles = [yaw_deg, pitch_deg, roll_deg].into_iter();
        let direction = [self.flow_angle_deg, self.heading_deg].into_iter().flatten();
        let velocity = self.water_velocity_mps.into_iter().flatten();
        let mut finite = angles.chain(origin_m).chain(direction).chain(velocity);
        if let Some(value) = finite.find(|value| !value.is_finite()) {
            return Err(CaseError::Number {
                key: "an angle, a velocity or origin_m",
                value,
                expected: "finite",
            });
        }
        if (self.axes().determinant() - 1.0).abs() > 1e-9 {
            return Err(CaseError::Axes);
        }
        self.report.as_ref().map_or(Ok(()), Report::check)?;
        self.velocity().map(|_| ())
    }

    fn axes(&self) -> Matrix3<f64> {
        let Frame { x, y, z, .. } = self.frame;
        BodyFromStl { scale: 1.0, x, y, z }.matrix()
    }

    /// From the body frame to axes that are level and keep the vehicle's yaw.
    fn level_from_body(&self) -> Rotation3<f64> {
        let Frame { pitch_deg, roll_deg, .. } = self.frame;
        Rotation3::from_euler_angles(roll_deg.to_radians(), pitch_deg.to_radians(), 0.0)
    }

    /// Where the vehicle stands.
    pub fn placement(&self) -> Placement {
        let yaw = Rotation3::from_axis_angle(&Vec3::z_axis(), self.frame.yaw_deg.to_radians());
        let body_from_level = self.level_from_body().inverse();
        Placement {
            body_from_cfd: (body_from_level * yaw.inverse()).into_inner() * self.axes(),
            origin: self.frame.origin_m.into(),
            up: body_from_level * Vec3::z_axis(),
        }
    }

    /// Velocity of the vehicle through the water, body frame [m/s]: against that of the water past it.
    fn velocity(&self) -> Result<Vec3, CaseError> {
        let heading = match (self.flow_angle_deg, self.heading_deg) {
            (Some(angle), None) => Some(90.0 - angle),
            (None, heading) => heading,
            (Some(_), Some(_)) => return Err(CaseError::Velocity),
        };
        match (self.speed_mps, heading.map(f64::to_radians), self.water_velocity_mps) {
            (Some(speed), Some(heading), None) => {
                let level = Vec3::new(heading.cos(), heading.sin(), 0.0) * speed;
                Ok(self.level_from_body().inverse() * level)
            }
            (None, None, Some(water)) => Ok(-(self.placement().body_from_cfd * Vec3::from(water))),
            _ => Err(CaseError::Velocity),
        }
    }

    /// The state of the vehicle.
    pub fn condition(&self) -> Result<Condition, CaseError> {
        let velocity = self.velocity()?;
        let ground_velocity = match self.bed {
            Bed::Parked => Vec3::zeros(),
            Bed::Driving => velocity,
        };
        Ok(Condition {
            ground_velocity,
            density: self.density_kgpm3,
            up: self.placement().up,
            ground_contact: self.ground_contact,
            ..Condition::level(velocity, self.depth_m)
        })
    }

    /// The solver's name of a surface.
    pub fn name_in_solver<'a>(&'a self, surface: &'a str) -> &'a str {
        self.surfaces.get(surface).map_or(surface, String::as_str)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// A CFD with z forward, y up and x to the left.
    fn case(lines: &str, frame: &str) -> Result<CaseFile, CaseError> {
        CaseFile::parse(&format!(
            "vehicle = \"warthog\"\ndensity_kgpm3 = 1000.0\ndepth_m = 0.2\nbed = \"parked\"\nground_contact = \"dry\"\n\
             {lines}\n[frame]\nx = \"z\"\ny = \"x\"\nz = \"y\"\norigin_m = [0.0, 0.4, 0.0]\n{frame}"
        ))
    }

    fn close(a: Vec3, b: [f64; 3]) -> bool {
        (a - Vec3::from(b)).norm() < 1e-12
    }

    #[test]
    fn water_that_comes_from_ahead_is_a_vehicle_that_moves_forward() {
        let flow = case("water_velocity_mps = [0.0, 0.0, -2.0]", "").unwrap().condition().unwrap();
        assert!(close(flow.velocity, [2.0, 0.0, 0.0]), "{}", flow.velocity);
        let angle = case("speed_mps = 2.0\nflow_angle_deg = 90.0", "").unwrap().condition().unwrap();
        assert!(close(angle.velocity, [2.0, 0.0, 0.0]), "{}", angle.velocity);
        assert_eq!(angle.ground_velocity, Vec3::zeros(), "parked in a current");
    }

    #[test]
    fn an_oblique_flow_is_a_drift_to_the_left_and_heading_says_the_same() {
        let expected = [2.0 * 0.5, 2.0 * 0.75_f64.sqrt(), 0.0];
        for lines in [
            "speed_mps = 2.0\nflow_angle_deg = 30.0".to_owned(),
            "speed_mps = 2.0\nheading_deg = 60.0".to_owned(),
            // to the left is x of the CFD, and water moves against the vehicle
            format!("water_velocity_mps = [{}, 0.0, -1.0]", -2.0 * 0.75_f64.sqrt()),
        ] {
            let velocity = case(&lines, "").unwrap().condition().unwrap().velocity;
            assert!(close(velocity, expected), "{lines}: {velocity}");
        }
    }

    #[test]
    fn forces_and_moments_turn_into_the_body_frame() {
        let placement = case("water_velocity_mps = [0.0, 0.0, -2.0]", "").unwrap().placement();
        // drag is against z, lift along y
        assert!(close(placement.force(&Vec3::new(3.0, 50.0, -100.0)), [-100.0, 3.0, 50.0]));
        // a lift of 50 N and a drag of 100 N one meter ahead of the body origin: My = -50 N m, which lifts the nose. The
        // solver takes moments about the point on the ground 0.4 m below the body origin.
        let (force, point) = (Vec3::new(0.0, 50.0, -100.0), Vec3::new(0.0, 0.4, 1.0));
        let moment = placement.moment(&point.cross(&force), &force, &Vec3::zeros());
        assert!(close(moment, [0.0, -50.0, 0.0]), "{moment}");
    }

    #[test]
    fn a_vehicle_turned_in_the_channel_feels_the_flow_from_its_side() {
        // yawed 90 degrees to the left, water still comes along -z: from the vehicle's right side
        let state =
            case("water_velocity_mps = [0.0, 0.0, -2.0]", "yaw_deg = 90.0").unwrap().condition().unwrap();
        assert!(close(state.velocity, [0.0, -2.0, 0.0]), "{}", state.velocity);
    }

    #[test]
    fn attitude_means_what_it_means_in_a_query() {
        let tilted = case("speed_mps = 2.0\nheading_deg = 0.0", "pitch_deg = 10.0\nroll_deg = 5.0").unwrap();
        let expected = wade_core::frame::up_from_roll_pitch(5_f64.to_radians(), 10_f64.to_radians());
        let state = tilted.condition().unwrap();
        assert!((state.up.into_inner() - expected.into_inner()).norm() < 1e-12);
        assert!(state.velocity.dot(&state.up).abs() < 1e-12, "the water moves horizontally");
    }

    #[test]
    fn a_description_that_a_program_writes_reads_the_same() {
        let file =
            case("speed_mps = 2.0\nflow_angle_deg = 60.0\ndomain_m = [6.0, 5.0, 1.5]", "yaw_deg = 3.0")
                .unwrap();
        assert_eq!(CaseFile::parse(&toml::to_string(&file).unwrap()).unwrap(), file);
    }

    #[test]
    fn what_describes_no_case_is_refused() {
        let refused = |lines: &str, frame: &str| case(lines, frame).unwrap_err();
        assert_eq!(refused("", ""), CaseError::Velocity);
        assert_eq!(refused("speed_mps = 1.0", ""), CaseError::Velocity);
        assert_eq!(
            refused("speed_mps = 1.0\nflow_angle_deg = 90.0\nheading_deg = 0.0", ""),
            CaseError::Velocity
        );
        let both = "speed_mps = 1.0\nflow_angle_deg = 90.0\nwater_velocity_mps = [0.0, 0.0, -1.0]";
        assert_eq!(refused(both, ""), CaseError::Velocity);
        let domain = refused("speed_mps = 1.0\nheading_deg = 0.0\ndomain_m = [6.0, 5.0, 0.1]", "");
        assert!(domain.to_string().contains("domain_m"), "{domain}");
        let paper = case("speed_mps = 1.0\nheading_deg = 0.0", "")
            .map(|case| Frame { y: Axis::MinusX, ..case.frame });
        let left_handed =
            CaseFile { frame: paper.unwrap(), ..case("speed_mps = 1.0\nheading_deg = 0.0", "").unwrap() };
        assert_eq!(left_handed.check(), Err(CaseError::Axes));
        let typo = refused("speed = 1.0\nheading_deg = 0.0", "").to_string();
        assert!(typo.contains("speed"), "{typo}");
    }
}
