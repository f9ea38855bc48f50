//! The files of one OpenFOAM case, from templates.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::mesh::{Channel, MeshSettings};
use super::openfoam::{MeshKind, OpenFoam};
use super::placement::Placement;
use super::plan::{Bed, Case};
use wade_core::frame::{GRAVITY, VISCOSITY, Vec3};
use wade_core::geometry::mesh::Mesh;
use wade_core::vehicle::Vehicle;

/// Density of the air above [kg/m3].
pub const AIR_DENSITY: f64 = 1.0;

/// Turbulence intensity of the inflow, and its length scale over the depth.
const TURBULENCE: (f64, f64) = (0.03, 0.07);
/// Speed below which the inflow is no longer less turbulent [m/s].
const LEAST_TURBULENT_SPEED: f64 = 0.05;
/// Sections of an unsteady case before its ramp [s].
pub const SECTIONS_BEFORE_S: f64 = 0.5;
/// Largest time step of an unsteady case [s]: short enough that the Courant number seldom asks for less, so that steps begin
/// and end with the ramp.
const UNSTEADY_STEP_S: f64 = 0.01;
/// `C_mu` of the k-omega model.
const C_MU: f64 = 0.09;

/// Distance of the gauges from the front of the vehicle, in its lengths, and their places across the channel over its width.
pub const GAUGES_AHEAD: f64 = 1.2;
const GAUGES_ACROSS: [f64; 5] = [-0.44, -0.22, 0.0, 0.22, 0.44];
/// Places across the channel at which its depth is taken.
const CROSSINGS: usize = 50;
/// The patch of a ramp, and the ramp in the dictionary of the mesh.
pub(super) const RAMP_PATCH: &str = "ground_ramp";
const RAMP_GEOMETRY: &str = "ramp.stl { type triSurfaceMesh; name ground_ramp; }";
const RAMP_LEVEL: &str = "ground_ramp { level (0 0); patchInfo { type wall; } }";

/// How a case is computed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Largest Courant number.
    pub courant: f64,
    /// Largest Courant number at the interface.
    pub interface_courant: f64,
    /// Time before the first window, in vehicle lengths over the speed.
    pub settle_lengths: f64,
    /// Least and greatest time before the first window [s].
    pub settle_s: [f64; 2],
    /// Duration of the window that is averaged [s].
    pub window_s: f64,
    /// Drift between the halves of the window, as a share of the dynamic force, that counts as settled.
    pub drift: f64,
    /// Windows at most; the last one is kept.
    pub windows: u32,
    /// Time between two samples of the forces [s]; also the largest time step of a steady case.
    pub sample_s: f64,
    /// Processor time after which a program of a case is given up [s]; longer on finer meshes, see [`Settings::limit`].
    pub limit_s: f64,
    /// Flow time and window in lengths of the vehicle, in place of `settle_lengths`, `settle_s`, `window_s` and `windows`; such a
    /// case is labelled with the depth and the speed that gauges measure ahead of the vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flow_time: Option<FlowTime>,
    /// The mesh.
    pub mesh: MeshSettings,
}

/// Flow time and window of a case in lengths of the vehicle over the speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowTime {
    /// Flow time at Froude numbers below each of [`FROUDE_NUMBERS`], and above all of them.
    pub lengths: [f64; 4],
    /// The window that is averaged, at the end of the flow time.
    pub window: f64,
    /// How much earlier the window is with which it is compared.
    pub shift: f64,
}

/// Froude numbers of the depth at which the flow time changes.
pub const FROUDE_NUMBERS: [f64; 3] = [0.4, 0.6, 1.3];

/// Speed for which a vehicle at rest has its flow time [m/s].
const REST_SPEED: f64 = 0.5;

impl Default for Settings {
    fn default() -> Self {
        Self {
            courant: 8.0,
            interface_courant: 6.0,
            settle_lengths: 3.5,
            settle_s: [2.0, 30.0],
            window_s: 2.0,
            drift: 0.05,
            windows: 3,
            sample_s: 0.05,
            limit_s: 3600.0,
            flow_time: None,
            mesh: MeshSettings::default(),
        }
    }
}

impl Settings {
    /// Time before the first window of a case of a vehicle of `length` [s].
    pub fn settle(&self, length: f64, speed: f64) -> f64 {
        let [least, most] = self.settle_s;
        // the sections are tenths of a second: a window that starts on one is easier to read
        let time =
            if speed > 0.0 { (self.settle_lengths * length / speed).clamp(least, most) } else { least };
        (10.0 * time).ceil() / 10.0
    }

    /// Processor time that a program may take on cells `cell_scale` times as long [s]: there are as many more as they are smaller.
    pub fn limit(&self, cell_scale: f64) -> f64 {
        self.limit_s / cell_scale.min(1.0).powi(3)
    }

    /// A field out of its range, what it is, and what it must be.
    pub fn fault(&self) -> Option<(&'static str, String, &'static str)> {
        let MeshSettings { cells_per_length, wet_layer, hull_level, wheel_level, channel_m } = self.mesh;
        let [least, most] = self.settle_s;
        let within = |value: f64, min: f64, max: f64| (min..=max).contains(&value);
        let fields = [
            ("courant", within(self.courant, 0.01, 100.0), self.courant.to_string(), "from 0.01 to 100"),
            (
                "interface_courant",
                within(self.interface_courant, 0.01, 100.0),
                self.interface_courant.to_string(),
                "from 0.01 to 100",
            ),
            (
                "settle_lengths",
                within(self.settle_lengths, 0.0, 1000.0),
                self.settle_lengths.to_string(),
                "from 0 to 1000 lengths",
            ),
            (
                "settle_s",
                within(least, 0.0, most) && most <= 1000.0,
                format!("{:?}", self.settle_s),
                "two times from 0 to 1000 s, the lesser first",
            ),
            ("window_s", within(self.window_s, 0.2, 1000.0), self.window_s.to_string(), "from 0.2 to 1000 s"),
            ("drift", within(self.drift, 0.0, 10.0), self.drift.to_string(), "a share from 0 to 10"),
            ("windows", (1..=100).contains(&self.windows), self.windows.to_string(), "from 1 to 100"),
            (
                "sample_s",
                within(self.sample_s, 1e-4, 0.05),
                self.sample_s.to_string(),
                "from 0.0001 to 0.05 s",
            ),
            (
                "limit_s",
                within(self.limit_s, 1e-3, 1e7),
                self.limit_s.to_string(),
                "from 0.001 to 10000000 s",
            ),
            (
                "mesh.cells_per_length",
                within(cells_per_length, 1.0, 50.0),
                cells_per_length.to_string(),
                "from 1 to 50",
            ),
            ("mesh.wet_layer", within(wet_layer, 0.05, 2.0), wet_layer.to_string(), "from 0.05 to 2"),
            ("mesh.hull_level", hull_level <= 6, hull_level.to_string(), "from 0 to 6"),
            ("mesh.wheel_level", wheel_level <= 6, wheel_level.to_string(), "from 0 to 6"),
            (
                "mesh.channel_m",
                channel_m.is_none_or(|size| size.iter().all(|&edge| within(edge, 0.1, 1000.0))),
                format!("{channel_m:?}"),
                "three lengths from 0.1 to 1000 m",
            ),
        ];
        let flow = |time: FlowTime| {
            let least = time.window + time.shift;
            let is_long = time.lengths.iter().all(|&lengths| within(lengths, least, 1000.0));
            time.window > 0.0 && time.shift > 0.0 && is_long
        };
        let fields = fields.into_iter().chain([(
            "flow_time",
            self.flow_time.is_none_or(flow),
            format!("{:?}", self.flow_time),
            "lengths that hold window and shift, both above 0",
        )]);
        let wrong = fields.into_iter().find(|(_, is_right, ..)| !is_right);
        wrong.map(|(field, _, value, expected)| (field, value, expected))
    }

    /// Settings for another attempt at a case that diverged.
    pub fn cautious(self) -> Self {
        Self { courant: 0.3 * self.courant, interface_courant: 0.3 * self.interface_courant, ..self }
    }
}

/// Everything that fixes the files of a case.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// The case.
    pub case: &'a Case,
    /// How it is computed.
    pub settings: &'a Settings,
    /// The solver at hand.
    pub solver: &'a OpenFoam,
}

/// The flow that gauges measured, at the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowAtVehicle {
    /// Depth at the body origin [m].
    pub depth_m: f64,
    /// Speed relative to the vehicle [m/s].
    pub speed_mps: f64,
    /// Depth of the channel times the speed squared, which the dynamic force is nearly proportional to [m3/s2].
    pub pressure: f64,
}

impl Inputs<'_> {
    /// Time in which the vehicle moves by its length [s].
    pub fn length_s(&self) -> f64 {
        let speed = self.case.speed_mps;
        self.vehicle.dimensions.length / if speed > 0.0 { speed } else { REST_SPEED }
    }

    /// Flow time of a case by its Froude number [s], in whole samples.
    fn flow_s(&self, time: &FlowTime, placement: &Placement) -> f64 {
        let depth = placement.water_level - placement.bed(0.0, 0.0);
        let froude = self.case.speed_mps / (GRAVITY * depth).sqrt();
        let class = FROUDE_NUMBERS.iter().filter(|&&limit| froude >= limit).count();
        let sample = self.settings.sample_s;
        (time.lengths[class] * self.length_s() / sample).ceil() * sample
    }

    /// End of the first window [s]; of an unsteady case, the end of all.
    pub fn first_end(&self, placement: &Placement) -> f64 {
        let Self { case, settings, vehicle, .. } = self;
        if let Some(time) = &settings.flow_time {
            return self.flow_s(time, placement);
        }
        let settle = settings.settle(vehicle.dimensions.length, case.speed_mps);
        if case.is_unsteady() { settle + case.ramp_s + settings.window_s } else { settle + settings.window_s }
    }

    /// Start of the window that ends at `end`, of an unsteady case that of what is kept [s].
    pub fn window_start(&self, end: f64) -> f64 {
        if self.case.is_unsteady() { self.settle() - SECTIONS_BEFORE_S } else { end - self.settings.window_s }
    }

    /// The earlier window and the last one, which ends at `end` [s].
    pub fn windows(&self, time: &FlowTime, end: f64) -> [[f64; 2]; 2] {
        let long = time.window * self.length_s();
        [end - time.shift * self.length_s(), end].map(|end| [end - long, end])
    }

    /// The flow at the vehicle, from the rise of the level [m] and the speed [m/s] at the gauges.
    pub fn flow_at_vehicle(&self, placement: &Placement, rise: f64, speed: f64) -> FlowAtVehicle {
        let up = self.case.up().z;
        let depths = [0.0, self.gauges_x(placement)].map(|x| self.mean_depth(placement, x) + rise);
        let current = speed - self.bed_speed();
        let speed_mps = self.bed_speed() + current * depths[1] / depths[0];
        FlowAtVehicle {
            depth_m: self.case.depth_m + rise / up,
            speed_mps,
            pressure: depths[0] * speed_mps * speed_mps,
        }
    }

    /// Every file of the case but the field `U` of the viscous flow, by its path in the folder.
    pub fn files(&self, placement: &Placement) -> BTreeMap<String, String> {
        let Self { case, solver, .. } = self;
        let speed = case.speed_mps.max(case.end_speed_mps);
        let channel = self.channel(placement);
        let level = placement.water_level;
        let mut files = BTreeMap::new();
        let mut add = |path: &str, text: String| {
            files.insert(path.to_owned(), text);
        };
        add("constant/triSurface/hull.stl", self.hull_stl(placement));
        if let Some(ramp) = placement.ramp {
            let mesh = ramp.surface(channel.size.norm());
            add("constant/triSurface/ramp.stl", solid("ramp", &mesh));
        }
        add("constant/g", fill(include_str!("templates/g"), &[("gravity", &number(GRAVITY))]));
        add("constant/hRef", fill(include_str!("templates/hRef"), &[("water_level", &number(level))]));
        let densities = [
            ("nu_water", number(VISCOSITY / case.density_kgpm3)),
            ("rho_water", number(case.density_kgpm3)),
            ("rho_air", number(AIR_DENSITY)),
        ];
        add("constant/transportProperties", fill(include_str!("templates/transportProperties"), &densities));
        add("constant/turbulenceProperties", include_str!("templates/turbulenceProperties").to_owned());
        if case.is_unsteady() {
            add("constant/fvOptions", include_str!("templates/acceleration").to_owned());
            add("constant/acceleration.dat", self.acceleration_table(placement));
        }
        add("system/blockMeshDict", block_mesh(&channel, level));
        add("system/snappyHexMeshDict", self.snappy(&channel, placement.ramp.is_some()));
        add("system/controlDict", self.control(placement, 0.0, self.first_end(placement)));
        add("system/fvSchemes", schemes(solver.mesh_kind));
        add("system/fvSolution", fill(include_str!("templates/fvSolution"), &[("local_time_stepping", "")]));
        let set_fields = fill(include_str!("templates/setFieldsDict"), &[("water_level", &number(level))]);
        add("system/setFieldsDict", set_fields);
        let flow = number(-self.speed_at(placement, 0.5 * channel.size.x));
        let start = fill(include_str!("templates/U"), &[("flow", &flow)]);
        add("0/U", start + &fill(include_str!("templates/U.potential"), &[("flow", &flow)]));
        add("0/p", include_str!("templates/p").to_owned());
        add("0/p_rgh", include_str!("templates/p_rgh").to_owned());
        add("0/alpha.water", include_str!("templates/alpha.water").to_owned());
        let (k, omega) = turbulence(speed, level);
        add("0/k", fill(include_str!("templates/k"), &[("value", &number(k))]));
        add("0/omega", fill(include_str!("templates/omega"), &[("value", &number(omega))]));
        add("0/nut", include_str!("templates/nut").to_owned());
        files
    }

    /// Boundary conditions of `U` for the viscous flow, which replace those of the potential flow.
    pub fn viscous_boundary(&self, placement: &Placement) -> String {
        let Self { vehicle, case, .. } = self;
        let half_length = 0.5 * self.channel(placement).size.x;
        let flow = number(-self.speed_at(placement, half_length));
        let uniform = format!("type fixedValue; value uniform ({flow} 0 0);");
        let surge = || {
            let settle = self.settle();
            let (from, to) = (number(-case.speed_mps), number(-case.end_speed_mps));
            let (start, end) = (number(settle), number(settle + case.ramp_s));
            format!(
                "type uniformFixedValue; uniformValue table ((0 ({from} 0 0)) ({start} ({from} 0 0)) \
                 ({end} ({to} 0 0)) (1e4 ({to} 0 0))); value uniform ({from} 0 0);"
            )
        };
        let inlet = if case.is_unsteady() { surge() } else { uniform };
        let outlet = if case.is_unsteady() {
            // the mean velocity of the other condition is a constant
            inlet.clone()
        } else if case.speed_mps > 0.0 {
            let speed = number(self.speed_at(placement, -half_length));
            let flow = format!("-{speed}");
            format!(
                "type outletPhaseMeanVelocity; alpha alpha.water; Umean {speed}; value uniform ({flow} 0 0);"
            )
        } else {
            // the condition divides by the velocity
            "type noSlip;".to_owned()
        };
        // a ramp has faces across the motion too: through them passes what the bed displaces as it moves
        let ground = || format!("type fixedValue; value uniform ({} 0 0);", number(-self.bed_speed()));
        let (ground, wheels) = match case.bed {
            Bed::Parked => ("type noSlip;".to_owned(), String::new()),
            Bed::Driving => (ground(), self.turning_wheels(placement, vehicle)),
        };
        let values = [
            ("flow", flow.as_str()),
            ("outlet", &outlet),
            ("inlet", &inlet),
            ("ground", &ground),
            ("wheels", &wheels),
        ];
        fill(include_str!("templates/U.viscous"), &values)
    }

    /// Velocity over ground [m/s].
    fn bed_speed(&self) -> f64 {
        self.case.share_of_bed() * self.case.speed_mps
    }

    /// Speed of the undisturbed water relative to the vehicle [m/s], mean over the cross-section at `x`: what the bed does not
    /// take with it passes every section of a channel of changing depth.
    fn speed_at(&self, placement: &Placement, x: f64) -> f64 {
        let Self { case, .. } = self;
        let current = case.speed_mps - self.bed_speed();
        let depth = |x: f64| self.mean_depth(placement, x);
        self.bed_speed() + current * depth(0.0) / depth(x)
    }

    /// Mean depth of the undisturbed channel at `x` [m].
    fn mean_depth(&self, placement: &Placement, x: f64) -> f64 {
        if placement.ramp.is_none() {
            return placement.water_level;
        }
        let width = self.channel(placement).size.y;
        let places = (0..CROSSINGS).map(|i| ((i as f64 + 0.5) / CROSSINGS as f64 - 0.5) * width);
        let depths = places.map(|y| (placement.water_level - placement.bed(x, y)).max(0.0));
        depths.sum::<f64>() / CROSSINGS as f64
    }

    fn gauges_x(&self, placement: &Placement) -> f64 {
        placement.bounds.max.x + GAUGES_AHEAD * self.vehicle.dimensions.length
    }

    fn channel(&self, placement: &Placement) -> Channel {
        let Self { vehicle, case, settings, .. } = self;
        let speed = case.speed_mps.max(case.end_speed_mps);
        let scales = [case.cell_scale, case.channel_scale];
        Channel::new(&settings.mesh, placement, vehicle.dimensions.length, speed, scales)
    }

    fn largest_step(&self) -> f64 {
        let steady = self.settings.sample_s;
        if self.case.is_unsteady() { steady.min(UNSTEADY_STEP_S) } else { steady }
    }

    fn settle(&self) -> f64 {
        self.settings.settle(self.vehicle.dimensions.length, self.case.speed_mps)
    }

    fn turning_wheels(&self, placement: &Placement, vehicle: &Vehicle) -> String {
        let forward = self.case.condition(self.case.speed_mps, 0.0).ground_velocity.x;
        let wheel = |wheel: super::placement::Wheel| {
            format!(
                "    hull_{} {{ type rotatingWallVelocity; origin ({}); axis ({}); omega {}; \
                 value uniform (0 0 0); }}\n",
                wheel.surface,
                triple(&wheel.center),
                triple(&wheel.axle),
                number(forward / wheel.radius)
            )
        };
        placement.wheels(vehicle).into_iter().map(wheel).collect()
    }

    /// `system/controlDict` for a run from `start` to `end` [s]; what a restart needs is written at the end.
    pub fn control(&self, placement: &Placement, start: f64, end: f64) -> String {
        let Self { vehicle, case, settings, .. } = self;
        let speed = case.speed_mps.max(case.end_speed_mps);
        let length = vehicle.dimensions.length;
        let every = number(settings.sample_s);
        // the solver shortens its steps to meet what is adjustable: sections of a tenth of a second, and with them the ramp
        let samples = if case.is_unsteady() { "adjustableRunTime" } else { "runTime" };
        let origin = triple(&placement.origin);
        let force = |surface: &wade_core::vehicle::Surface| {
            let values = [
                ("surface", surface.name.as_str()),
                ("origin", &origin),
                ("every", &every),
                ("samples", samples),
            ];
            fill(include_str!("templates/forces"), &values)
        };
        let flow =
            |patch: &str| fill(include_str!("templates/mass_flow"), &[("patch", patch), ("every", &every)]);
        let functions: String = vehicle
            .surfaces
            .iter()
            .map(force)
            .chain(["inlet_water", "inlet_air", "outlet", "top"].map(flow))
            .chain(placement.ramp.map(|_| flow(RAMP_PATCH)))
            .chain(settings.flow_time.map(|_| self.gauges(placement)))
            .collect();
        let values = [
            ("end_time_s", number(end)),
            ("first_step_s", number(1e-3 * length / speed.max(0.5))),
            ("write_interval_s", number(end - start)),
            ("courant", number(settings.courant)),
            ("interface_courant", number(settings.interface_courant)),
            ("largest_step_s", number(self.largest_step())),
            ("functions", functions),
        ];
        fill(include_str!("templates/controlDict"), &values)
    }

    /// Gauges of level and speed across the channel, ahead of the vehicle, at 0.6 of the depth below the surface, where the
    /// speed of a stream is near its mean over the depth (ISO 748).
    fn gauges(&self, placement: &Placement) -> String {
        let width = self.channel(placement).size.y;
        let x = self.gauges_x(placement);
        let place = |share: f64| {
            let (y, level) = (share * width, placement.water_level);
            let bed = placement.bed(x, y);
            format!("({})", triple(&Vec3::new(x, y, bed + 0.4 * (level - bed))))
        };
        let places = GAUGES_ACROSS.map(place).join(" ");
        let every = number(self.settings.sample_s);
        fill(include_str!("templates/gauges"), &[("places", &places), ("every", &every)])
    }

    fn snappy(&self, channel: &Channel, has_ramp: bool) -> String {
        let Self { vehicle, settings, solver, .. } = self;
        let MeshSettings { hull_level, wheel_level, .. } = settings.mesh;
        let wheels = vehicle.surfaces.iter().filter(|s| s.kind.turns());
        let levels: String = wheels
            .map(|s| {
                format!("                {} {{ level ({wheel_level} {wheel_level}); patchInfo {{ type wall; }} }}\n", s.name)
            })
            .collect();
        // off the faces of the background cells, high above the vehicle's head
        let point = Vec3::new(0.4931 * channel.size.x, 0.4917 * channel.size.y, 0.9873 * channel.size.z);
        let values = [
            ("snap", (solver.mesh_kind == MeshKind::Snapped).to_string()),
            ("near_corner", triple(&channel.near.corner)),
            ("near_forward", triple(&channel.near.forward)),
            ("near_span", triple(&channel.near.span)),
            ("wake_min", triple(&channel.wake.min)),
            ("wake_max", triple(&channel.wake.max)),
            ("hull_level", hull_level.to_string()),
            ("wheel_levels", levels),
            ("point_in_air", triple(&point)),
            ("ramp", if has_ramp { RAMP_GEOMETRY } else { "" }.to_owned()),
            ("ramp_level", if has_ramp { RAMP_LEVEL } else { "" }.to_owned()),
        ];
        fill(include_str!("templates/snappyHexMeshDict"), &values)
    }

    /// An ASCII STL with one solid a surface; OpenFOAM names a patch `hull_<surface>`.
    fn hull_stl(&self, placement: &Placement) -> String {
        let solids = self.vehicle.surfaces.iter().zip(&placement.surfaces);
        solids.map(|(surface, mesh)| solid(&surface.name, mesh)).collect()
    }

    /// Acceleration of the vehicle against time, of which the solver takes the opposite as a body force; dense, since it is
    /// interpolated. It is half a largest step late: an implicit step takes the acceleration of its end, while the inflow
    /// changes by its mean over the step. Where the two differ, the water as a whole pushes the hull, for that one step with
    /// the whole inertia of what it displaces: steps longer or shorter than the largest would do so.
    fn acceleration_table(&self, placement: &Placement) -> String {
        let (case, settle) = (self.case, self.settle());
        let acceleration = (case.end_speed_mps - case.speed_mps) / case.ramp_s;
        let step = 0.5 * UNSTEADY_STEP_S;
        let start = settle + 0.5 * self.largest_step();
        let rows = (self.first_end(placement) / step).ceil() as usize + 2;
        let row = |i: usize| {
            let time = i as f64 * step;
            let inside = time >= start && time < start + case.ramp_s;
            let value = if inside { acceleration } else { 0.0 };
            format!("({} (({} 0 0) (0 0 0) (0 0 0)))\n", number(time), number(value))
        };
        format!("(\n{})\n", (0..rows).map(row).collect::<String>())
    }
}

/// Writes the files of a case into its folder.
pub fn write(folder: &Path, files: &BTreeMap<String, String>) -> std::io::Result<()> {
    for (path, text) in files {
        let path = folder.join(path);
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        std::fs::write(path, text)?;
    }
    Ok(())
}

fn block_mesh(channel: &Channel, level: f64) -> String {
    let Channel { size, cells, layers, deep, air_grading, .. } = channel;
    let [nx, ny] = cells;
    let (x, y) = (number(size.x / 2.0), number(size.y / 2.0));
    // the blocks of the water: one, or a coarser one under it
    let water = |low: &str, grading: f64, layers: usize, high: &str| {
        let grading = number(grading);
        format!("    hex ({low} {high}) ({nx} {ny} {layers}) simpleGrading (1 1 {grading})\n")
    };
    let (bottom, middle, top) = ("0 1 2 3", "12 13 14 15", "4 5 6 7");
    let (corners, blocks) = match deep {
        None => (String::new(), water(bottom, 1.0, layers[0], top)),
        Some(deep) => {
            let z = number(deep.height);
            let corners = format!("    (-{x} -{y} {z}) ({x} -{y} {z}) ({x} {y} {z}) (-{x} {y} {z})\n");
            let blocks =
                water(bottom, deep.grading, deep.layers, middle) + &water(middle, 1.0, layers[0], top);
            (corners, blocks)
        }
    };
    let has_deep = deep.is_some();
    let faces = |one: &str, two: &str| if has_deep { two.to_owned() } else { one.to_owned() };
    let values = [
        ("x0", number(-size.x / 2.0)),
        ("x1", x.clone()),
        ("y0", number(-size.y / 2.0)),
        ("y1", y.clone()),
        ("zw", number(level)),
        ("z1", number(size.z)),
        ("nx", nx.to_string()),
        ("ny", ny.to_string()),
        ("deep_corners", corners),
        ("water_blocks", blocks),
        ("nz_air", layers[1].to_string()),
        ("air_grading", number(*air_grading)),
        ("inlet_water", faces("(1 2 6 5)", "(1 2 14 13) (13 14 6 5)")),
        ("outlet_water", faces("(0 4 7 3)", "(0 12 15 3) (12 4 7 15)")),
        ("sides_water", faces("(0 1 5 4) (3 7 6 2)", "(0 1 13 12) (12 13 5 4) (3 15 14 2) (15 7 6 14)")),
    ];
    fill(include_str!("templates/blockMeshDict"), &values)
}

fn schemes(mesh: MeshKind) -> String {
    // snapped cells are tilted at the hull too, where the correction is needed: it is left on until a sound build has shown more
    let (normal, density) = match mesh {
        MeshKind::Castellated => ("corrected", "uncorrected"),
        MeshKind::Snapped => ("limited corrected 0.5", "limited corrected 0.5"),
    };
    let values = [("time_scheme", "Euler"), ("normal_gradient", normal), ("density_gradient", density)];
    fill(include_str!("templates/fvSchemes"), &values)
}

/// Turbulent kinetic energy [m2/s2] and specific dissipation rate [1/s] of the inflow.
fn turbulence(speed: f64, level: f64) -> (f64, f64) {
    let (intensity, length) = TURBULENCE;
    let k = 1.5 * (intensity * speed.max(LEAST_TURBULENT_SPEED)).powi(2);
    (k, k.sqrt() / (C_MU.powf(0.25) * length * level))
}

fn solid(name: &str, mesh: &Mesh) -> String {
    let vertex = |v: Vec3| format!("vertex {}\n", triple(&v));
    let facet = |face: usize| {
        let corners: String = mesh.triangle(face).into_iter().map(vertex).collect();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let facets: String = (0..mesh.faces.len()).map(facet).collect();
    format!("solid {name}\n{facets}endsolid {name}\n")
}

/// Replaces each `{{key}}` of a template.
fn fill<V: AsRef<str>>(template: &str, values: &[(&str, V)]) -> String {
    let mut text = template.to_owned();
    for (key, value) in values {
        text = text.replace(&format!("{{{{{key}}}}}"), value.as_ref());
    }
    debug_assert!(!text.contains("{{"), "a place is left open in {text}");
    text
}

/// Nine digits: enough for a tenth of a micrometer, and the same text on every machine.
fn number(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    // tiny numbers, such as a viscosity, keep their digits
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { text.to_owned() }
}

fn triple(v: &Vec3) -> String {
    format!("{} {} {}", number(v.x), number(v.y), number(v.z))
}
