//! What an effect needs to know of a hull.

use super::hydrotable::Hydrotable;
use super::immersion::{Immersion, WetPanel};
use crate::condition::Condition;
use crate::forces::SurfaceForce;
use crate::frame::{Vec3, WaterPlane};
use crate::vehicle::{SurfaceKind, Vehicle};

/// A piece of the hull; body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Name of the surface.
    pub name: String,
    /// Centroid [m].
    pub centroid: Vec3,
    /// Spread of the area about the centroid along each axis, one standard deviation [m].
    pub spread: Vec3,
    /// Area seen from +x, +y, +z [m2].
    pub facing_plus: Vec3,
    /// Area seen from -x, -y, -z [m2].
    pub facing_minus: Vec3,
    /// Number of the wheel speed that turns it, in the order of the vehicle's wheels; none of what is no wheel.
    pub wheel: Option<usize>,
}

impl Panel {
    /// Four points of equal weight with the first and second moments of the wet part of the panel, which is as wide as
    /// the panel and as high as its share.
    pub fn points(&self, wet: &WetPanel) -> [Vec3; 4] {
        let s = self.wet_spread(wet);
        [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)]
            .map(|(x, y, z)| wet.point + Vec3::new(x * s.x, y * s.y, z * s.z))
    }

    /// Spread of the wet part about its centroid, one standard deviation [m].
    pub fn wet_spread(&self, wet: &WetPanel) -> Vec3 {
        Vec3::new(self.spread.x, self.spread.y, self.spread.z * wet.fraction)
    }

    /// Area that meets the flow along each axis [m2]: the side that looks ahead, and always the bottom, since the top of
    /// a wading hull is dry.
    pub fn windward(&self, velocity: &Vec3) -> Vec3 {
        let of = |axis: usize| {
            if velocity[axis] >= 0.0 { self.facing_plus[axis] } else { self.facing_minus[axis] }
        };
        Vec3::new(of(0), of(1), self.facing_minus.z)
    }
}

/// A body of which only lengths are known: a box with vertical sides whose volume follows the stated one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Along x [m].
    pub length: f64,
    /// Along y [m].
    pub width: f64,
    /// Height under water at which it displaces `displaced_volume` [m].
    pub draft: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Volume under water at `draft` [m3].
    pub displaced_volume: f64,
    /// Center of mass [m] in a frame whose origin lies amidships, half a draft above the ground-contact plane.
    pub center_of_mass: [f64; 3],
    /// Radius of a wheel [m], where it is known.
    pub wheel_radius: Option<f64>,
}

impl Block {
    fn wheel_radius(&self) -> f64 {
        self.wheel_radius.unwrap_or(BOX_WHEELS[0] * self.length)
    }
}

/// A hull prepared for the effects; body frame.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name of the vehicle.
    pub name: String,
    /// Along x [m].
    pub length: f64,
    /// Along y [m].
    pub width: f64,
    /// Along z [m].
    pub height: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Point that moments are taken about [m].
    pub center_of_mass: Vec3,
    /// Height of the ground-contact plane [m].
    pub z0: f64,
    /// Radius of a wheel [m].
    pub wheel_radius: f64,
    /// The pieces of the hull.
    pub panels: Vec<Panel>,
    hull: Hull,
}

#[derive(Debug, Clone)]
enum Hull {
    Mesh { table: Box<Hydrotable>, samples: Box<crate::vehicle::Samples> },
    Block { block: Block, height: f64 },
}

/// Height of a box over its draft: a level above it wets no more.
const BOX_HEIGHT: f64 = 2.0;
/// Wheels of a box: radius and half the wheelbase over its length, half the track over its width; about those of the
/// Husky and the Warthog.
const BOX_WHEELS: [f64; 3] = [0.2, 0.32, 0.42];

impl Body {
    /// A vehicle with its mesh. Tabulates the hydrostatics over level and tilt, which takes a tenth of a second.
    pub fn of_vehicle(vehicle: &Vehicle) -> Self {
        let wheels = vehicle.wheels();
        let panel = |index: usize| {
            // the belt of a track is no wheel that pushes water with its disc or its lugs
            let turns = vehicle.surfaces[index].kind == SurfaceKind::Wheel;
            mesh_panel(vehicle, index, wheels.iter().position(|&wheel| turns && wheel == index))
        };
        let panels: Vec<Panel> = (0..vehicle.surfaces.len()).map(panel).collect();
        let radius = |panel: &Panel| panel.wheel.map(|_| panel.centroid.z - vehicle.z0);
        let wheel_radius =
            panels.iter().find_map(radius).unwrap_or(BOX_WHEELS[0] * vehicle.dimensions.length);
        Self {
            name: vehicle.name.clone(),
            length: vehicle.dimensions.length,
            width: vehicle.dimensions.width,
            height: vehicle.dimensions.height,
            mass: vehicle.mass,
            center_of_mass: vehicle.center_of_mass,
            z0: vehicle.z0,
            wheel_radius,
            panels,
            hull: Hull::Mesh {
                table: Box::new(Hydrotable::of(&vehicle.hull.mesh, vehicle.z0, vehicle.dimensions.height)),
                samples: Box::new(vehicle.samples.clone()),
            },
        }
    }

    /// A body of which only lengths are known.
    pub fn of_block(name: &str, block: Block) -> Self {
        let height = BOX_HEIGHT * block.draft;
        Self {
            name: name.to_owned(),
            length: block.length,
            width: block.width,
            height,
            mass: block.mass,
            center_of_mass: Vec3::from(block.center_of_mass),
            z0: -0.5 * block.draft,
            wheel_radius: block.wheel_radius(),
            panels: box_panels(&block, height),
            hull: Hull::Block { block, height },
        }
    }

    /// Where the water reaches in a state.
    pub fn immerse(&self, condition: &Condition, out: &mut Immersion) {
        let plane = condition.water_plane(self.z0);
        out.depth = condition.depth.max(0.0);
        out.panels.clear();
        match &self.hull {
            Hull::Mesh { samples, .. } => {
                out.panels.extend(samples.surfaces.iter().zip(&self.panels).map(|(surface, panel)| {
                    let wet = surface.submergence(&plane);
                    let point = if wet.fraction > 0.0 { wet.wet_centroid } else { panel.centroid };
                    WetPanel { fraction: wet.fraction, point }
                }));
            }
            Hull::Block { height, .. } => {
                out.panels.extend(self.panels.iter().map(|panel| wet_part(&plane, panel, self.z0, *height)));
            }
        }
        self.displace(&plane, out);
    }

    /// What it displaces below a plane, without the wet parts of panels. Allocates nothing.
    pub fn displace(&self, plane: &WaterPlane, out: &mut Immersion) {
        match &self.hull {
            Hull::Mesh { table, .. } => table.immerse(plane, out),
            Hull::Block { block, height } => immerse_box(block, *height, self.z0, plane, out),
        }
    }

    /// The same where a model has found the wet part of each surface already.
    pub fn immerse_as(&self, condition: &Condition, surfaces: &[SurfaceForce], out: &mut Immersion) {
        let Hull::Mesh { table, .. } = &self.hull else { return self.immerse(condition, out) };
        out.depth = condition.depth.max(0.0);
        out.panels.clear();
        let wet =
            |surface: &SurfaceForce| WetPanel { fraction: surface.wetted_fraction, point: surface.point };
        out.panels.extend(surfaces.iter().map(wet));
        table.immerse(&condition.water_plane(self.z0), out);
    }

    /// True where speeds are those of four wheels.
    pub fn has_four_wheels(&self) -> bool {
        let mut wheels: Vec<usize> = self.panels.iter().filter_map(|panel| panel.wheel).collect();
        wheels.sort_unstable();
        wheels == [0, 1, 2, 3]
    }

    /// True where the wheels' places and sizes are known, not assumed.
    pub fn has_wheels(&self) -> bool {
        matches!(self.hull, Hull::Mesh { .. }) && self.panels.iter().any(|panel| panel.wheel.is_some())
    }
}

fn mesh_panel(vehicle: &Vehicle, index: usize, wheel: Option<usize>) -> Panel {
    let surface = &vehicle.surfaces[index];
    let (mut plus, mut minus) = (Vec3::zeros(), Vec3::zeros());
    for face in vehicle.hull.faces_of(index) {
        let area = vehicle.hull.mesh.area_vector(face);
        plus += area.sup(&Vec3::zeros());
        minus -= area.inf(&Vec3::zeros());
    }
    let spread = vehicle
        .hull
        .patch(index)
        .map_or_else(Vec3::zeros, |patch| patch.spread.diagonal().map(|variance| variance.max(0.0).sqrt()));
    Panel {
        name: surface.name.clone(),
        centroid: surface.centroid,
        spread,
        facing_plus: plus,
        facing_minus: minus,
        wheel,
    }
}

/// Number of a wheel speed in the order front left, front right, rear left, rear right.
fn wheel_at(front: bool, left: bool) -> usize {
    2 * usize::from(!front) + usize::from(!left)
}

/// Sides cut into strips, so that the local velocity of a turning hull varies along them.
fn box_panels(block: &Block, height: f64) -> Vec<Panel> {
    const STRIPS: usize = 4;
    let (length, width) = (block.length, block.width);
    let z0 = -0.5 * block.draft;
    let middle = z0 + 0.5 * height;
    let rise = height / 12_f64.sqrt();
    let panel = |name: &str, centroid: Vec3, spread: Vec3, plus: Vec3, minus: Vec3| Panel {
        name: name.to_owned(),
        centroid,
        spread,
        facing_plus: plus,
        facing_minus: minus,
        wheel: None,
    };
    let zero = Vec3::zeros;
    let across = Vec3::new(0.0, width / 12_f64.sqrt(), rise);
    let end = Vec3::x() * (width * height);
    let mut panels = vec![
        panel("front", Vec3::new(0.5 * length, 0.0, middle), across, end, zero()),
        panel("rear", Vec3::new(-0.5 * length, 0.0, middle), across, zero(), end),
    ];
    let strip = length / STRIPS as f64;
    let along = strip / 12_f64.sqrt();
    for index in 0..STRIPS {
        let x = (index as f64 + 0.5) * strip - 0.5 * length;
        let side = Vec3::y() * (strip * height);
        let spread = Vec3::new(along, 0.0, rise);
        panels.push(panel("left", Vec3::new(x, 0.5 * width, middle), spread, side, zero()));
        panels.push(panel("right", Vec3::new(x, -0.5 * width, middle), spread, zero(), side));
        let spread = Vec3::new(along, width / 12_f64.sqrt(), 0.0);
        let bottom = Vec3::z() * (strip * width);
        panels.push(panel("bottom", Vec3::new(x, 0.0, z0), spread, zero(), bottom));
    }
    let [_, base, track] = BOX_WHEELS;
    let radius = block.wheel_radius();
    for (front, left) in [(true, true), (true, false), (false, true), (false, false)] {
        let sign = |positive: bool| if positive { 1.0 } else { -1.0 };
        let center = Vec3::new(sign(front) * base * length, sign(left) * track * width, z0 + radius);
        // a wheel of a box has no drag of its own: that is the box's
        let mut wheel = panel("wheel", center, zero(), zero(), zero());
        wheel.wheel = Some(wheel_at(front, left));
        wheel.spread = Vec3::z() * radius;
        panels.push(wheel);
    }
    panels
}

/// Wet part of a panel of a box, from the level above its foot.
fn wet_part(plane: &WaterPlane, panel: &Panel, z0: f64, height: f64) -> WetPanel {
    let foot = Vec3::new(panel.centroid.x, panel.centroid.y, z0);
    let level = plane.depth_below(&foot) / plane.normal.z.max(0.1);
    // a millimeter of water wets the bottom
    let tall = match panel.wheel {
        Some(_) => 2.0 * panel.spread.z,
        None if panel.facing_minus.z > 0.0 => 0.001,
        None => height,
    };
    let fraction = (level / tall).clamp(0.0, 1.0);
    let point = if fraction > 0.0 { foot + Vec3::z() * (0.5 * fraction * tall) } else { panel.centroid };
    WetPanel { fraction, point }
}

fn immerse_box(block: &Block, height: f64, z0: f64, plane: &WaterPlane, out: &mut Immersion) {
    const CUTS: usize = 8;
    let area = block.displaced_volume / block.draft;
    let part = area / CUTS as f64;
    let (mut volume, mut moment, mut waterplane, mut center) = (0.0, Vec3::zeros(), 0.0, Vec3::zeros());
    for cut in 0..CUTS {
        let x = ((cut as f64 + 0.5) / CUTS as f64 - 0.5) * block.length;
        let level = plane.depth_below(&Vec3::new(x, 0.0, z0)) / plane.normal.z.max(0.1);
        let wet = level.clamp(0.0, height);
        volume += part * wet;
        // a roll moves the center sideways by the second moment of the cut's width
        let slope = -plane.normal.y / plane.normal.z.max(0.1);
        let y = if wet > 0.0 && wet < height { slope * block.width.powi(2) / (12.0 * wet) } else { 0.0 };
        moment += Vec3::new(x, y.clamp(-0.5 * block.width, 0.5 * block.width), z0 + 0.5 * wet) * (part * wet);
        if level > 0.0 && level < height {
            waterplane += part;
            center += Vec3::new(x, 0.0, z0 + wet) * part;
        }
    }
    out.volume = volume;
    out.center_of_buoyancy = if volume > 0.0 { moment / volume } else { Vec3::zeros() };
    out.waterplane_area = waterplane;
    out.waterplane_center = if waterplane > 0.0 { center / waterplane } else { Vec3::zeros() };
}
