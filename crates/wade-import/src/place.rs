//! From the frame and unit of the files to the body's axes and meters, said in words.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Bounds;
use wade_core::vehicle::plausible::is_usual_length;
use wade_core::vehicle::spec::Axis;

use crate::limits::LENGTHS;
use crate::scene::{Inertial, Joint, Link, Scene, Shape};
use crate::shapes::scaled;
use crate::solid::Piece;
use crate::{Options, wheels};

/// Units in which meshes are drawn: meters a unit, and the name.
const UNITS: [(f64, &str); 4] =
    [(1.0, "meters"), (1e-3, "millimeters"), (1e-2, "centimeters"), (0.0254, "inches")];

/// Axes or a size that make no vehicle.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// Forward and up along one line.
    #[error("--forward {forward:?} and --up {up:?} lie along one line: name two different axes")]
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
        "the longest edge is {length:.6} m{}, and vehicles have {} to {} m; state the unit of the file: --scale 0.001 for millimeters, 1 for meters",
        if *is_stated { "" } else { " in the file's unit" }, LENGTHS[0], LENGTHS[1]
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
        notes: &mut Vec<String>,
    ) -> Result<Self, PlaceError> {
        let stated = options.forward.is_some() || options.up.is_some();
        let is_open = !stated && !scene.convention.is_metric;
        let guess = if is_open { guess_axes(pieces) } else { None };
        let (forward, up) = guess.map_or((scene.convention.forward, scene.convention.up), |(axes, _)| axes);
        let (forward, up) = (options.forward.unwrap_or(forward), options.up.unwrap_or(up));
        let rotation = rotation(forward, up).ok_or(PlaceError::Axes { forward, up })?;
        let bounds = Bounds::around(pieces.iter().flat_map(|piece| &piece.mesh.vertices));
        let length = bounds.ok_or(PlaceError::Empty)?.extent().max();
        let scale = scale(scene, options, length, notes)?;
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

/// Meters a unit of the file.
fn scale(scene: &Scene, options: &Options, length: f64, notes: &mut Vec<String>) -> Result<f64, PlaceError> {
    let stated = options.scale.or(scene.convention.is_metric.then_some(1.0));
    if let Some(scale) = stated {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(PlaceError::Scale { scale });
        }
        if !is_usual_length(length * scale) {
            return Err(PlaceError::Size { length: length * scale, is_stated: true });
        }
        return Ok(scale);
    }
    let fitting = UNITS.into_iter().find(|(scale, _)| is_usual_length(length * scale));
    let (scale, unit) = fitting.ok_or(PlaceError::Size { length, is_stated: false })?;
    notes.push(format!(
        "unit: {unit}, guessed by size: the longest edge of {length:.4} is {:.4} m; --scale changes it",
        length * scale
    ));
    Ok(scale)
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
