//! Derivatives of the net wrench with respect to the state.
//!
//! The formulas of the base and of the features of the network are evaluated on [`Dual`] numbers; elements, clipped faces and the layers
//! of the network have derivatives of their own in closed form. There is a kink, at which the derivative is that of one
//! side, where water reaches or leaves an element or a face that is level, at rest (drag goes with `|v| v`), where the motion
//! turns from ahead to astern or from left to right, and where a unit of the network switches.

use nalgebra::{SMatrix, UnitVector3, Vector3};

use super::blend::{part, through};
use super::kernel::{DIRECTIONS, FeatureSlopes, SlopeBuffers};
use super::{Anchored, Form, Learned, Model, WetSurface, Workspace};
use crate::anchor::{GLOBAL, Reading};
use crate::condition::Condition;
use crate::forces::Forces;
use crate::frame::Vec3;
use crate::physics::drag::SurfaceDrag;
use crate::physics::{Base, BaseLoads, Memory, Motion, Physics};
use crate::real::{Dual, Real};
use crate::vehicle::MAX_SURFACES;
use crate::wrench::Wrench;

/// Columns of a [`Jacobian`].
pub const COLUMNS: usize = 11;

/// Column of the water level; before it stand three of the velocity and three of the angular velocity.
const LEVEL: usize = 6;
/// First of three columns of the attitude.
const ATTITUDE: usize = 7;
/// Column of the density.
const DENSITY: usize = 10;

/// Derivatives of the net wrench about the center of mass, force first, body frame. The columns are, each with the others held:
///
/// | column | with respect to | unit |
/// | --- | --- | --- |
/// | 0 to 2 | velocity over ground, in water that moves as before | m/s |
/// | 3 to 5 | angular velocity | rad/s |
/// | 6 | water level above the body origin | m |
/// | 7 to 9 | attitude: a small turn of the body about its axes | rad |
/// | 10 | density | kg/m3 |
///
/// A turn of the body leaves the body components of the motion and the water level as they are. The derivative with
/// respect to depth is that of the water level times the z of up in the body frame.
pub type Jacobian = SMatrix<f64, 6, COLUMNS>;

/// A number with its derivatives with respect to the state.
type Full = Dual<COLUMNS>;
/// The same in the directions that the learned part sees.
type Level = Dual<DIRECTIONS>;

/// Working memory of [`Model::evaluate_with_jacobian`], good for every vehicle.
#[derive(Debug, Clone)]
pub struct JacobianWorkspace {
    loads: BaseLoads<Full>,
    reading: Reading<Level>,
    level_drag: Vec<SurfaceDrag<Level>>,
    features: Vec<FeatureSlopes>,
    slopes: SlopeBuffers,
}

impl JacobianWorkspace {
    /// Allocates for the largest vehicle.
    pub fn new() -> Self {
        Self {
            loads: BaseLoads::with_capacity(MAX_SURFACES),
            reading: Reading::with_capacity(MAX_SURFACES),
            level_drag: Vec::with_capacity(MAX_SURFACES),
            features: Vec::with_capacity(MAX_SURFACES),
            slopes: SlopeBuffers::new(MAX_SURFACES),
        }
    }
}

impl Default for JacobianWorkspace {
    fn default() -> Self {
        Self::new()
    }
}

/// Directions in which the learned part changes: neither vertical motion nor rates nor a turn about the vertical enter.
struct Directions([[f64; COLUMNS]; DIRECTIONS]);

impl Directions {
    fn about(up: &Vec3) -> Self {
        let flat = up.cross(&Vec3::ith(up.iamin(), 1.0)).normalize();
        let other = up.cross(&flat);
        let vector = |first: usize, along: &Vec3| {
            std::array::from_fn(|column| {
                if (first..first + 3).contains(&column) { along[column - first] } else { 0.0 }
            })
        };
        let unit = |at: usize| std::array::from_fn(|column| f64::from(u8::from(column == at)));
        Self([
            vector(0, &flat),
            vector(0, &other),
            unit(LEVEL),
            vector(ATTITUDE, &flat),
            vector(ATTITUDE, &other),
            unit(DENSITY),
        ])
    }

    fn level(&self, full: Full) -> Level {
        let slope = |direction: &[f64; COLUMNS]| direction.iter().zip(full.slope).map(|(a, b)| a * b).sum();
        Level { value: full.value, slope: self.0.each_ref().map(slope) }
    }

    fn full(&self, level: Level) -> Full {
        let slope = |column: usize| (0..DIRECTIONS).map(|k| level.slope[k] * self.0[k][column]).sum();
        Full { value: level.value, slope: std::array::from_fn(slope) }
    }
}

impl<T: Real> Condition<T> {
    /// The same state in other numbers.
    fn map<U: Real>(&self, with: impl Fn(T) -> U) -> Condition<U> {
        let vector = |v: &Vector3<T>| v.map(&with);
        Condition {
            velocity: vector(&self.velocity),
            ground_velocity: vector(&self.ground_velocity),
            angular_velocity: vector(&self.angular_velocity),
            acceleration: vector(&self.acceleration),
            angular_acceleration: vector(&self.angular_acceleration),
            depth: with(self.depth),
            water_level: self.water_level.map(&with),
            bed_clearance: self.bed_clearance.map(&with),
            stated_bed: self.stated_bed.map(&with),
            density: with(self.density),
            // a unit vector stays one
            up: UnitVector3::new_unchecked(vector(&self.up)),
            ground_contact: self.ground_contact,
        }
    }
}

/// Motion [m/s, rad/s] and tilt [rad] that have the derivatives of none: powers of less leave the range of the numbers.
const STILL: f64 = 1e-12;

/// A state that grows along each column of a [`Jacobian`].
fn moving(condition: &Condition, z0: f64) -> Condition<Full> {
    let still = |v: &Vec3| v.map(|x| if x.abs() < STILL { 0.0 } else { x });
    let condition = &Condition {
        velocity: still(&condition.velocity),
        ground_velocity: still(&condition.ground_velocity),
        angular_velocity: still(&condition.angular_velocity),
        up: UnitVector3::new_unchecked(still(&condition.up)),
        ..*condition
    };
    let level = condition.water_plane(z0).offset;
    let mut moving: Condition<Full> = condition.map(Full::from);
    for axis in 0..3 {
        moving.velocity[axis].slope[axis] = 1.0;
        moving.ground_velocity[axis].slope[axis] = 1.0;
        moving.angular_velocity[axis].slope[3 + axis] = 1.0;
    }
    // what is fixed in the world turns the other way in the body frame
    let turned: [Vec3; 3] = std::array::from_fn(|axis| condition.up.cross(&Vec3::ith(axis, 1.0)));
    let mut up = moving.up.into_inner();
    for (axis, component) in up.iter_mut().enumerate() {
        for (column, turned) in turned.iter().enumerate() {
            component.slope[ATTITUDE + column] = turned[axis];
        }
    }
    moving.up = UnitVector3::new_unchecked(up);
    moving.water_level = Some(Full::along(level, LEVEL));
    moving.density.slope[DENSITY] = 1.0;
    moving.resolved(z0)
}

/// A state a step along a column of a [`Jacobian`] further.
pub(crate) fn stepped(condition: &Condition, z0: f64, column: usize, step: f64) -> Condition {
    let level = condition.water_plane(z0).offset;
    let mut next = Condition { water_level: Some(level), ..*condition };
    match column {
        0..3 => {
            next.velocity[column] += step;
            next.ground_velocity[column] += step;
        }
        3..LEVEL => next.angular_velocity[column - 3] += step,
        LEVEL => next.water_level = Some(level + step),
        ATTITUDE..DENSITY => {
            let turned = condition.up.cross(&Vec3::ith(column - ATTITUDE, step));
            next.up = UnitVector3::new_normalize(condition.up.into_inner() + turned);
        }
        _ => next.density += step,
    }
    next.resolved(z0)
}

impl Model {
    /// [`Self::evaluate_moving`], and how the net wrench changes with the state; what the session remembers from before stays as
    /// it is. `None` of a bundle without the physical base. Allocates nothing.
    pub fn evaluate_with_jacobian(
        &self,
        condition: &Condition,
        (motion, memory): (&Motion<'_>, Option<&mut Memory>),
        (workspace, slopes): (&mut Workspace, &mut JacobianWorkspace),
        forces: &mut Forces,
    ) -> Option<Jacobian> {
        let before = memory.as_deref().copied();
        self.evaluate_moving(condition, (motion, memory), workspace, forces);
        self.jacobian(condition, (motion, before.as_ref()), workspace, slopes)
    }

    /// Derivatives in the state that `values` were computed in just before.
    fn jacobian(
        &self,
        condition: &Condition,
        (motion, memory): (&Motion<'_>, Option<&Memory>),
        values: &Workspace,
        workspace: &mut JacobianWorkspace,
    ) -> Option<Jacobian> {
        let base = self.base.as_ref()?;
        let moving = moving(condition, self.vehicle.z0);
        base.evaluate_dual(&moving, motion, (&values.base, memory), &mut workspace.loads);
        let learned = self.learned.as_ref().filter(|_| motion.physics != Physics::Hydrostatic);
        let learned = learned.map_or_else(Wrench::default, |learned| {
            self.learned_slopes((base, learned), &moving, values, workspace)
        });
        let loads = &workspace.loads;
        let own =
            loads.surfaces.iter().fold(loads.hull, |sum, surface| sum + surface.hydrostatic + surface.drag);
        let through = through(&moving, &learned, loads);
        let about = self.vehicle.center_of_mass.map(Full::from);
        let Wrench { force, moment } = (own + learned * through).moved(&Vector3::zeros(), &about);
        Some(Jacobian::from_fn(|row, column| match row {
            0..3 => force[row].slope[column],
            _ => moment[row - 3].slope[column],
        }))
    }

    /// The learned part about the body origin, before it is limited.
    fn learned_slopes(
        &self,
        (base, learned): (&Base, &Learned),
        moving: &Condition<Full>,
        values: &Workspace,
        workspace: &mut JacobianWorkspace,
    ) -> Wrench<Full> {
        let (Form::Anchored(form), Some(anchor)) = (&learned.weights.form, &learned.anchor) else {
            return Wrench::default();
        };
        let JacobianWorkspace { loads, reading, level_drag, features, slopes } = workspace;
        let Workspace { wet, buffers, .. } = values;
        let directions = Directions::about(&moving.up.map(Real::value));
        let level = moving.map(|x| directions.level(x)).levelled(directions.level(loads.bed_clearance));
        loads.wetting_into(|x| directions.level(x), reading.wetting_mut());
        base.drag_dual_into(&level, reading.wetting_mut(), level_drag);
        anchor.read_wet(&self.vehicle, &level, reading);
        features.clear();
        features.extend(
            wet.iter()
                .map(|wet| reading.surfaces[wet.surface].dynamic.map(|x| x.slope.map(|slope| slope as f32))),
        );
        let of_global: [_; GLOBAL] =
            std::array::from_fn(|i| reading.global[i].slope.map(|slope| slope as f32 / form.global_std[i]));
        let trust = Anchored::trust(form.distance_dual(reading));
        let outputs = buffers.outputs(wet.len());
        let inputs = form.remainder.global_names().len();
        let of_outputs = learned.kernel.slopes((&of_global[..inputs], features), buffers, slopes);
        let mut sum = loads.steady_hull(&level.velocity, |x| directions.level(x)) * -trust;
        for ((WetSurface { surface, .. }, output), of_output) in wet.iter().zip(outputs).zip(of_outputs) {
            let answer = std::array::from_fn(|i| Level {
                value: f64::from(output[i]),
                slope: of_output[i].map(f64::from),
            });
            let share = trust * learned.coverage[*surface];
            let base = (&level_drag[*surface].load, form.remainder);
            sum += part((&reading.surfaces[*surface], &answer), base) * share;
        }
        let full = |vector: Vector3<Level>| vector.map(|x| directions.full(x));
        Wrench { force: full(sum.force), moment: full(sum.moment) }
    }
}
