//! From the frame and unit of the files to the body's axes and meters, said in words.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Bounds;
use wade_core::vehicle::plausible::is_usual_length;
use wade_core::vehicle::spec::Axis;

use crate::limits::{ASSUMED_DENSITY, FLOATING_DENSITY, LENGTHS, TYPICAL_LENGTHS};
use crate::scene::{Inertial, Joint, Link, Scene, Shape};
use crate::shapes::scaled;
use crate::solid::Piece;
use crate::{Options, wheels};

/// A unit in which meshes are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// 1 m.
    Meters,
    /// 0.001 m.
    Millimeters,
    /// 0.01 m.
    Centimeters,
    /// 0.0254 m.
    Inches,
}

impl Unit {
    /// Every unit, the most frequent first: of those that fit alike the first is taken.
    pub const ALL: [Self; 4] = [Self::Meters, Self::Millimeters, Self::Centimeters, Self::Inches];

    /// Its length [m].
    pub fn meters(self) -> f64 {
        match self {
            Self::Meters => 1.0,
            Self::Millimeters => 1e-3,
            Self::Centimeters => 1e-2,
            Self::Inches => 0.0254,
        }
    }

    /// The word of the option.
    pub fn name(self) -> &'static str {
        match self {
            Self::Meters => "m",
            Self::Millimeters => "mm",
            Self::Centimeters => "cm",
            Self::Inches => "in",
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Meters => "meters",
            Self::Millimeters => "millimeters",
            Self::Centimeters => "centimeters",
            Self::Inches => "inches",
        }
    }
}

/// Axes or a size that make no vehicle.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// Forward and up along one line.
    #[error("--forward {} and --up {} lie along one line: name two different axes", axis_name(*.forward), axis_name(*.up))]
    Axes {
        /// The one.
        forward: Axis,
        /// The other.
        up: Axis,
    },
    /// A scale that is no number.
    #[error("--scale {scale} is not a positive number")]
    Scale {
        /// The scale.
        scale: f64,
    },
    /// A size that no vehicle has.
    #[error(
        "the longest edge is {length:.6} {}, and vehicles have {} to {} m; state the unit of the files: --unit mm, cm, in or m, or --scale with the meters of another",
        if *is_stated { "m" } else { "in the files' unit" }, LENGTHS[0], LENGTHS[1]
    )]
    Size {
        /// The longest edge.
        length: f64,
        /// True where the format or an option states the unit.
        is_stated: bool,
    },
    /// No vertex.
    #[error("the files hold no vertex")]
    Empty,
}

/// Scale and rotation from the scene to the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    rotation: UnitQuaternion<f64>,
    scale: f64,
}

impl Placement {
    /// Decides axes and scale, and says how.
    pub fn of(
        scene: &Scene,
        pieces: &[Piece],
        options: &Options,
        (notes, warnings): (&mut Vec<String>, &mut Vec<String>),
    ) -> Result<Self, PlaceError> {
        let stated = options.forward.is_some() || options.up.is_some();
        let is_open = !stated && !scene.convention.is_metric;
        let guess = if is_open { guess_axes(pieces) } else { None };
        let (forward, up) = guess.map_or((scene.convention.forward, scene.convention.up), |(axes, _)| axes);
        let (forward, up) = (options.forward.unwrap_or(forward), options.up.unwrap_or(up));
        let rotation = rotation(forward, up).ok_or(PlaceError::Axes { forward, up })?;
        let drawn = Drawn::of(pieces).ok_or(PlaceError::Empty)?;
        let scale = match options.scale.or(scene.convention.is_metric.then_some(1.0)) {
            Some(scale) => drawn.checked(scale)?,
            None => drawn.guessed(options.mass, notes, warnings)?.meters(),
        };
        let by = match (stated, guess) {
            (true, _) => "as stated".to_owned(),
            (false, Some((_, wheels))) => {
                format!("guessed from {wheels} parts that stand like wheels; --forward and --up change it")
            }
            (false, None) if is_open => {
                "assumed, since the format has no convention: --forward and --up change it".to_owned()
            }
            (false, None) => "the convention of the format".to_owned(),
        };
        notes.push(format!("axes: {} points forward and {} up ({by})", axis_name(forward), axis_name(up)));
        Ok(Self { rotation, scale })
    }

    /// A piece in the body's axes [m].
    pub fn piece(&self, piece: Piece) -> Piece {
        let map = self.rotation.to_rotation_matrix().into_inner() * self.scale;
        Piece { mesh: scaled(&piece.mesh, &map), ..piece }
    }

    /// The links in the body's axes [m], without their shapes.
    pub fn scene(&self, scene: Scene) -> Scene {
        let point = |p: Vec3| self.rotation * p * self.scale;
        let inertial = |i: Inertial| {
            let turn = self.rotation.to_rotation_matrix().into_inner();
            Inertial { center: point(i.center), inertia: turn * i.inertia * turn.transpose(), ..i }
        };
        let joint = |joint: Joint| match joint {
            Joint::Turning { name, axis, origin } => {
                Joint::Turning { name, axis: self.rotation * axis, origin: point(origin) }
            }
            other => other,
        };
        let link = |link: Link| Link {
            pose: Isometry3::from_parts(
                point(link.pose.translation.vector).into(),
                self.rotation * link.pose.rotation,
            ),
            joint: joint(link.joint),
            inertial: link.inertial.map(inertial),
            shapes: link
                .shapes
                .into_iter()
                .map(|shape| Shape { mesh: Default::default(), ..shape })
                .collect(),
            name: link.name,
            parent: link.parent,
        };
        Scene { links: scene.links.into_iter().map(link).collect(), ..scene }
    }
}

/// Forward and up of a file without convention, the usual ones first.
const USUAL_AXES: [(Axis, Axis); 5] = [
    (Axis::PlusX, Axis::PlusZ),
    (Axis::PlusY, Axis::PlusZ),
    (Axis::PlusZ, Axis::PlusY),
    (Axis::PlusX, Axis::PlusY),
    (Axis::PlusX, Axis::MinusY),
];

/// The axes in which most parts stand like wheels, with their number; none where no parts do.
fn guess_axes(pieces: &[Piece]) -> Option<((Axis, Axis), usize)> {
    let count = |(forward, up): (Axis, Axis)| {
        let turn = rotation(forward, up)?.to_rotation_matrix().into_inner();
        let turned: Vec<Piece> =
            pieces.iter().map(|piece| Piece { mesh: scaled(&piece.mesh, &turn), ..piece.clone() }).collect();
        Some(((forward, up), wheels::count_by_form(&turned)))
    };
    let counts: Vec<((Axis, Axis), usize)> = USUAL_AXES.into_iter().filter_map(count).collect();
    let most = counts.iter().map(|(_, wheels)| *wheels).max().filter(|wheels| *wheels > 0)?;
    counts.into_iter().find(|(_, wheels)| *wheels == most)
}

/// From the axes of the file to those of the body; none where both lie along one line.
fn rotation(forward: Axis, up: Axis) -> Option<UnitQuaternion<f64>> {
    let left = direction(up).cross(&direction(forward));
    let rows = [direction(forward), left, direction(up)].map(|v| v.transpose());
    (left.norm() > 0.5).then(|| UnitQuaternion::from_matrix(&Matrix3::from_rows(&rows)))
}

/// Sizes of what the files hold, in their unit.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    /// Longest edge of the box around all.
    length: f64,
    /// Sum over the pieces, of open ones as far as they have one, at most that of the box.
    volume: f64,
}

impl Drawn {
    fn of(pieces: &[Piece]) -> Option<Self> {
        let bounds = Bounds::around(pieces.iter().flat_map(|piece| &piece.mesh.vertices))?;
        let sum: f64 = pieces.iter().map(|piece| piece.mesh.volume().abs()).sum();
        Some(Self { length: bounds.extent().max(), volume: sum.min(bounds.extent().product()) })
    }

    /// A scale that is stated.
    fn checked(&self, scale: f64) -> Result<f64, PlaceError> {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(PlaceError::Scale { scale });
        }
        let length = self.length * scale;
        if is_usual_length(length) { Ok(scale) } else { Err(PlaceError::Size { length, is_stated: true }) }
    }

    /// The unit in which the mass floats, or else the one of a usual size; the warning names the others that would do.
    fn guessed(
        &self,
        mass: Option<f64>,
        notes: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) -> Result<Unit, PlaceError> {
        let fits: Vec<Unit> =
            Unit::ALL.into_iter().filter(|unit| is_usual_length(self.length * unit.meters())).collect();
        let mass = mass.filter(|mass| *mass > 0.0 && mass.is_finite() && self.volume > 0.0);
        let floating = mass.map_or_else(Vec::new, |mass| self.floating(&fits, mass));
        let (unit, others, by) = match floating.first() {
            Some(unit) => (*unit, &floating, "by size and mass"),
            None => (self.of_usual_size(&fits)?, &fits, "by size"),
        };
        let length = |unit: Unit| format!("{:.4} m in {}", self.length * unit.meters(), unit.words());
        notes.push(format!(
            "unit: {}, guessed {by}: the longest edge of {:.4} is {}; --unit or --scale changes it",
            unit.words(),
            self.length,
            length(unit)
        ));
        let others: Vec<String> =
            others.iter().filter(|other| **other != unit).map(|unit| length(*unit)).collect();
        if !others.is_empty() {
            let way_out = match (mass, floating.is_empty()) {
                (None, _) => ", or the mass with --mass KG".to_owned(),
                (Some(mass), true) => format!("; in none of them {mass} kg float"),
                (Some(_), false) => String::new(),
            };
            warnings.push(format!(
                "no file states its unit: {} are taken, so that the longest edge is {}; it would be {}; state the unit with --unit {}{way_out}",
                unit.words(),
                length(unit),
                others.join(", "),
                Unit::ALL.map(Unit::name).join("|")
            ));
        }
        Ok(unit)
    }

    /// The units in which the vehicle floats with its deck dry, the one first whose density is nearest to the usual one.
    fn floating(&self, fits: &[Unit], mass: f64) -> Vec<Unit> {
        let density = |unit: &Unit| mass / (self.volume * unit.meters().powi(3));
        let floats = |unit: &Unit| (FLOATING_DENSITY[0]..FLOATING_DENSITY[1]).contains(&density(unit));
        let distance = |unit: &Unit| (density(unit) / ASSUMED_DENSITY).ln().abs();
        let mut floating: Vec<Unit> = fits.iter().copied().filter(floats).collect();
        floating.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        floating
    }

    fn of_usual_size(&self, fits: &[Unit]) -> Result<Unit, PlaceError> {
        let is_typical =
            |unit: &&Unit| (TYPICAL_LENGTHS[0]..=TYPICAL_LENGTHS[1]).contains(&(self.length * unit.meters()));
        let unit = fits.iter().find(is_typical).or(fits.first()).copied();
        unit.ok_or(PlaceError::Size { length: self.length, is_stated: false })
    }
}

fn direction(axis: Axis) -> Vec3 {
    match axis {
        Axis::PlusX => Vec3::x(),
        Axis::MinusX => -Vec3::x(),
        Axis::PlusY => Vec3::y(),
        Axis::MinusY => -Vec3::y(),
        Axis::PlusZ => Vec3::z(),
        Axis::MinusZ => -Vec3::z(),
    }
}

fn axis_name(axis: Axis) -> &'static str {
    match axis {
        Axis::PlusX => "x",
        Axis::MinusX => "-x",
        Axis::PlusY => "y",
        Axis::MinusY => "-y",
        Axis::PlusZ => "z",
        Axis::MinusZ => "-z",
    }
}
