//! The gRPC client: blocking calls on a runtime of its own, so that an answer needs no other thread.

use std::path::PathBuf;
use std::time::Duration;

use tokio::runtime::Runtime;
use tonic::Request;

use super::credentials::{Credentials, sign};
use super::grpc_link::GrpcLink;
use super::{BaseReply, ClientError, EffectReply, Reply, SurfaceReply};
use wade_core::domain::{Domain, Outside, Quantity, Range};
use wade_core::effects::{BoxQuantity, Effect, LeftOut, OutsideBox};
use wade_wire::proto;
use wade_wire::proto::admin_client::AdminClient;
use wade_wire::{DERIVATIVES, State};

/// How single queries are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// One call each.
    Unary,
    /// All on one stream.
    Stream,
}

/// A blocking client of one vehicle.
#[derive(Debug)]
pub struct GrpcClient {
    runtime: Runtime,
    link: GrpcLink,
    method: Method,
}

impl GrpcClient {
    /// Connects to `http://HOST:PORT`, `https://HOST:PORT` or `unix:PATH`, with what is believed and shown there.
    pub fn connect(
        url: &str,
        vehicle: &str,
        method: Method,
        timeout: Duration,
        credentials: &Credentials,
    ) -> Result<Self, ClientError> {
        let runtime = runtime(url)?;
        let link = runtime.block_on(GrpcLink::connect(url, vehicle, timeout, credentials))?;
        Ok(Self { runtime, link, method })
    }

    /// Connects over TCP to a URL such as `http://127.0.0.1:50051`, and shows nothing there.
    pub fn tcp(url: &str, vehicle: &str, method: Method, timeout: Duration) -> Result<Self, ClientError> {
        Self::connect(url, vehicle, method, timeout, &Credentials::default())
    }

    /// Connects to a Unix socket.
    pub fn unix(
        path: PathBuf,
        vehicle: &str,
        method: Method,
        timeout: Duration,
    ) -> Result<Self, ClientError> {
        Self::tcp(&format!("unix:{}", path.display()), vehicle, method, timeout)
    }

    /// The forces in one state.
    pub fn evaluate(&mut self, state: &State) -> Result<proto::EvaluateResponse, ClientError> {
        match self.method {
            Method::Unary => self.runtime.block_on(self.link.evaluate(state)),
            Method::Stream => self.runtime.block_on(self.link.evaluate_in_stream(state)),
        }
    }

    /// The forces in each state of a batch.
    pub fn evaluate_batch(&mut self, states: &[State]) -> Result<proto::EvaluateBatchResponse, ClientError> {
        self.runtime.block_on(self.link.evaluate_batch(states))
    }

    /// How the vehicle stands; the request names it.
    pub fn stability(
        &mut self,
        query: proto::GetStabilityRequest,
    ) -> Result<proto::GetStabilityResponse, ClientError> {
        self.runtime.block_on(self.link.stability(query))
    }

    /// What the server says of the vehicle.
    pub fn vehicle(&mut self) -> Result<proto::GetVehicleResponse, ClientError> {
        self.runtime.block_on(self.link.vehicle())
    }

    /// The training domain of the vehicle, as the server states it.
    pub fn domain(&mut self) -> Result<Domain, ClientError> {
        let ranges = self.vehicle()?.domain;
        let range = |quantity: Quantity| {
            let range = ranges.iter().find(|range| range.quantity == quantity as i32);
            range.map_or(Range { min: 0.0, max: 0.0 }, |range| Range {
                min: range.minimum,
                max: range.maximum,
            })
        };
        Ok(Domain {
            speed_mps: range(Quantity::Speed),
            angle_rad: range(Quantity::Angle),
            density_kgpm3: range(Quantity::Density),
            depth_m: range(Quantity::Depth),
            tilt_rad: range(Quantity::Tilt),
            vertical_speed_mps: range(Quantity::VerticalSpeed),
            angular_speed_radps: range(Quantity::AngularSpeed),
        })
    }
}

/// Asks the server at a URL, as [`GrpcClient::connect`] takes it, to read bundles again: what `request` names.
pub fn reload(
    url: &str,
    request: proto::ReloadRequest,
    timeout: Duration,
    credentials: &Credentials,
) -> Result<Vec<proto::Reloaded>, ClientError> {
    let runtime = runtime(url)?;
    let mut request = Request::new(request);
    request.set_timeout(timeout);
    sign(request.metadata_mut(), credentials.authorization()?.as_ref());
    runtime.block_on(async {
        let mut client = AdminClient::new(credentials.connect(url, timeout).await?);
        let no_answer = |status: tonic::Status| {
            let message = status.message().to_owned();
            match status.code() {
                tonic::Code::Unavailable | tonic::Code::Unknown => {
                    ClientError::NoServer { at: url.to_owned(), reason: message }
                }
                tonic::Code::Cancelled | tonic::Code::DeadlineExceeded => ClientError::Timeout(timeout),
                code => ClientError::Refused { code, message },
            }
        };
        let response = client.reload(request).await.map_err(no_answer)?;
        Ok(response.into_inner().vehicles)
    })
}

/// A runtime on which the calling thread does everything itself.
fn runtime(url: &str) -> Result<Runtime, ClientError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|error| ClientError::NoServer { at: url.to_owned(), reason: error.to_string() })
}

pub(super) fn message(state: &State) -> proto::State {
    let vector = |[x, y, z]: [f32; 3]| Some(proto::Vector3 { x, y, z });
    let [x, y, z] = state.gravity;
    proto::State {
        velocity_mps: vector(state.velocity),
        current_mps: vector(state.current),
        angular_velocity_radps: vector(state.angular_velocity),
        acceleration_mps2: vector(state.acceleration),
        angular_acceleration_radps2: vector(state.angular_acceleration),
        depth_m: Some(state.depth).filter(|depth| !depth.is_nan()),
        water_level_m: state.water_level,
        bed_clearance_m: state.bed_clearance,
        bed: state.bed,
        density_kgpm3: Some(state.density),
        attitude: Some(proto::state::Attitude::GravityDirection(proto::Vector3 { x, y, z })),
        ground_contact: ground_contact(state).into(),
        heading_rad: state.heading,
        depth_rate_mps: state.depth_rate,
        wheel_speed_radps: state.wheel_speeds.map_or_else(Vec::new, |speeds| speeds.to_vec()),
        wave_vector_radpm: (state.wave_amplitude != 0.0).then(|| vector(state.wave_vector)).flatten(),
        wave_amplitude_m: state.wave_amplitude,
        wave_phase_rad: state.wave_phase,
        wheel_water_level_m: state.wheel_levels.map_or_else(Vec::new, |levels| levels.to_vec()),
        current_exponent: state.current_exponent,
        time_step_s: state.time_step,
        implicit_added_mass: state.implicit_added_mass,
        physics: state.physics.map_or(0, |physics| physics as i32),
        jacobian: state.jacobian,
    }
}

fn ground_contact(state: &State) -> proto::GroundContact {
    if state.dry_contact { proto::GroundContact::Dry } else { proto::GroundContact::Wetted }
}

/// What the states of a batch have in common: the message carries it once, or not at all.
pub(super) fn shared(state: &State) -> impl PartialEq + use<> {
    let State { heading, depth_rate, wheel_speeds, wheel_levels, physics, .. } = state;
    let [speeds, levels] = [wheel_speeds, wheel_levels].map(|values| values.map(|values| values.len()));
    let given = (heading.is_some(), depth_rate.is_some(), speeds, levels);
    (state.dry_contact, state.implicit_added_mass, state.jacobian, *physics, given)
}

pub(super) fn batch_message(vehicle: &str, states: &[State]) -> proto::EvaluateBatchRequest {
    let rows = |row: fn(&State) -> [f32; 3]| states.iter().flat_map(row).collect();
    proto::EvaluateBatchRequest {
        vehicle: vehicle.to_owned(),
        velocity_mps: rows(|s| s.velocity),
        current_mps: rows(|s| s.current),
        angular_velocity_radps: rows(|s| s.angular_velocity),
        acceleration_mps2: rows(|s| s.acceleration),
        angular_acceleration_radps2: rows(|s| s.angular_acceleration),
        depth_m: states.iter().map(|s| s.depth).collect(),
        water_level_m: stated(states, |s| s.water_level),
        bed_clearance_m: stated(states, |s| s.bed_clearance),
        bed: stated(states, |s| s.bed),
        density_kgpm3: states.iter().map(|s| s.density).collect(),
        gravity_direction: rows(|s| s.gravity),
        ground_contact: states.first().map_or(proto::GroundContact::Unspecified, ground_contact).into(),
        omit_surfaces: false,
        heading_rad: states.iter().filter_map(|s| s.heading).collect(),
        depth_rate_mps: states.iter().filter_map(|s| s.depth_rate).collect(),
        wheel_speed_radps: of_wheels(states, |s| s.wheel_speeds.as_deref()),
        wave_vector_radpm: unless_zero(rows(|s| s.wave_vector)),
        wave_amplitude_m: unless_zero(states.iter().map(|s| s.wave_amplitude).collect()),
        wave_phase_rad: unless_zero(states.iter().map(|s| s.wave_phase).collect()),
        wheel_water_level_m: of_wheels(states, |s| s.wheel_levels.as_deref()),
        current_exponent: unless_zero(states.iter().map(|s| s.current_exponent).collect()),
        implicit_added_mass: states.first().is_some_and(|s| s.implicit_added_mass),
        physics: states.first().and_then(|s| s.physics).map_or(0, |physics| physics as i32),
        jacobian: states.first().is_some_and(|s| s.jacobian),
    }
}

/// The values of the wheels, row by row; empty where none are stated.
fn of_wheels(states: &[State], values: fn(&State) -> Option<&[f32]>) -> Vec<f32> {
    states.iter().filter_map(values).flatten().copied().collect()
}

/// An array of which zero is the default; empty where it holds nothing else.
fn unless_zero(values: Vec<f32>) -> Vec<f32> {
    if values.iter().all(|value| *value == 0.0) { Vec::new() } else { values }
}

/// An array with NaN where a state has no value; empty where none has.
fn stated(states: &[State], value: fn(&State) -> Option<f32>) -> Vec<f32> {
    if states.iter().any(|state| value(state).is_some()) {
        states.iter().map(|state| value(state).unwrap_or(f32::NAN)).collect()
    } else {
        Vec::new()
    }
}

impl From<proto::EvaluateResponse> for Reply {
    fn from(response: proto::EvaluateResponse) -> Self {
        let vector = |v: Option<proto::Vector3>| v.map_or([0.0; 3], |v| [v.x, v.y, v.z]);
        let wrench = response.wrench.unwrap_or_default();
        Self {
            version: response.bundle_version,
            provenance: response.provenance,
            surfaces: surfaces(
                &response.surface_force_n,
                &response.surface_point_m,
                &response.surface_couple_nm,
                &response.wetted_fraction,
            ),
            force: vector(wrench.force_n),
            moment: vector(wrench.moment_nm),
            about: vector(wrench.about_m),
            uncertainty: vector(response.uncertainty_n),
            moment_uncertainty: vector(response.moment_uncertainty_nm),
            base: response.base.as_ref().and_then(base),
            outside: outside(response.outside.iter()),
            effects: response.effects.iter().filter_map(effect).collect(),
            effect_surface_forces: response.effect_surface_force_n.as_chunks::<3>().0.to_vec(),
            effects_outside: outside_box(response.effects_outside.iter()),
            added_mass: response.added_mass.as_slice().try_into().ok(),
            jacobian: response.jacobian.as_slice().try_into().ok(),
            compute_ns: response.compute_ns,
        }
    }
}

impl From<&Reply> for proto::EvaluateResponse {
    fn from(reply: &Reply) -> Self {
        let vector = |[x, y, z]: [f32; 3]| Some(proto::Vector3 { x, y, z });
        let effect = |load: &EffectReply| proto::EffectLoad {
            effect: load.effect.code() as i32,
            force_n: vector(load.force),
            moment_nm: vector(load.moment),
            left_out: load.left_out.map_or(0, |reason| reason as i32),
        };
        let outside = reply.outside.iter().map(|(quantity, excess)| proto::Outside {
            quantity: quantity as i32,
            excess: excess as f32,
            index: 0,
        });
        let effects_outside = BoxQuantity::ALL.into_iter().zip(reply.effects_outside);
        Self {
            surface_force_n: reply.surfaces.iter().flat_map(|surface| surface.force).collect(),
            surface_point_m: reply.surfaces.iter().flat_map(|surface| surface.point).collect(),
            surface_couple_nm: reply.surfaces.iter().flat_map(|surface| surface.couple).collect(),
            wetted_fraction: reply.surfaces.iter().map(|surface| surface.wetted_fraction).collect(),
            wrench: Some(proto::Wrench {
                force_n: vector(reply.force),
                moment_nm: vector(reply.moment),
                about_m: vector(reply.about),
            }),
            uncertainty_n: vector(reply.uncertainty),
            moment_uncertainty_nm: vector(reply.moment_uncertainty),
            base: reply.base.map(|base| proto::BaseAnswer {
                water_level_m: base.water_level,
                bed_clearance_m: base.bed_clearance,
                bed: base.bed,
                shaft_power_w: base.shaft_power,
                damping: base.damping.to_vec(),
            }),
            in_domain: reply.outside.is_inside(),
            outside: outside.collect(),
            bundle_version: reply.version,
            provenance: reply.provenance.clone(),
            compute_ns: reply.compute_ns,
            effects: reply.effects.iter().map(effect).collect(),
            effect_surface_force_n: reply.effect_surface_forces.iter().flatten().copied().collect(),
            effects_outside: effects_outside
                .filter(|(_, excess)| *excess != 0.0)
                .map(|(quantity, excess)| proto::EffectOutside {
                    quantity: quantity as i32,
                    excess: excess as f32,
                    index: 0,
                })
                .collect(),
            added_mass: reply.added_mass.map_or_else(Vec::new, Vec::from),
            jacobian: reply.jacobian.map_or_else(Vec::new, Vec::from),
        }
    }
}

/// The replies to the states of a batch, in order.
pub fn replies(response: proto::EvaluateBatchResponse) -> Vec<Reply> {
    let states = response.force_n.len() / 3;
    let surface_count = response.wetted_fraction.len() / states.max(1);
    let about = response.about_m.map_or([0.0; 3], |v| [v.x, v.y, v.z]);
    let row = |values: &[f32], i: usize| values.as_chunks::<3>().0.get(i).copied().unwrap_or_default();
    let effect_count = response.effects.len();
    let effect = |state: usize, number: usize| {
        let at = state * effect_count + number;
        Some(EffectReply {
            effect: Effect::from_code(*response.effects.get(number)? as u32)?,
            force: row(&response.effect_force_n, at),
            moment: row(&response.effect_moment_nm, at),
            left_out: LeftOut::from_code(*response.effect_left_out.get(at)? as u32),
        })
    };
    let reply = |i: usize| {
        let (from, to) = (i * surface_count, (i + 1) * surface_count);
        Reply {
            version: response.bundle_version,
            provenance: response.provenance.clone(),
            surfaces: surfaces(
                &response.surface_force_n[3 * from..3 * to],
                &response.surface_point_m[3 * from..3 * to],
                response.surface_couple_nm.get(3 * from..3 * to).unwrap_or_default(),
                &response.wetted_fraction[from..to],
            ),
            force: row(&response.force_n, i),
            moment: row(&response.moment_nm, i),
            about,
            uncertainty: row(&response.uncertainty_n, i),
            moment_uncertainty: row(&response.moment_uncertainty_nm, i),
            base: response.base.get(i).and_then(base),
            outside: outside(response.outside.iter().filter(|outside| outside.index as usize == i)),
            effects: (0..effect_count).filter_map(|number| effect(i, number)).collect(),
            effect_surface_forces: match effect_count {
                0 => Vec::new(),
                _ => response.effect_surface_force_n.as_chunks::<3>().0[from..to].to_vec(),
            },
            effects_outside: outside_box(
                response.effects_outside.iter().filter(|outside| outside.index as usize == i),
            ),
            added_mass: response.added_mass.as_chunks::<36>().0.get(i).copied(),
            jacobian: response.jacobian.as_chunks::<DERIVATIVES>().0.get(i).copied(),
            compute_ns: response.compute_ns,
        }
    };
    (0..states).map(reply).collect()
}

fn surfaces(forces: &[f32], points: &[f32], couples: &[f32], wetted: &[f32]) -> Vec<SurfaceReply> {
    let [forces, points, couples] = [forces, points, couples].map(|values| values.as_chunks::<3>().0);
    let rows = forces.iter().zip(points).zip(wetted).enumerate();
    rows.map(|(i, ((&force, &point), &wetted_fraction))| SurfaceReply {
        force,
        point,
        wetted_fraction,
        // a server from before there were any sends none
        couple: couples.get(i).copied().unwrap_or_default(),
    })
    .collect()
}

fn base(base: &proto::BaseAnswer) -> Option<BaseReply> {
    Some(BaseReply {
        water_level: base.water_level_m,
        bed_clearance: base.bed_clearance_m,
        bed: base.bed,
        shaft_power: base.shaft_power_w,
        damping: base.damping.as_slice().try_into().ok()?,
    })
}

fn effect(load: &proto::EffectLoad) -> Option<EffectReply> {
    let vector = |v: &Option<proto::Vector3>| v.as_ref().map_or([0.0; 3], |v| [v.x, v.y, v.z]);
    Some(EffectReply {
        effect: Effect::from_code(load.effect as u32)?,
        force: vector(&load.force_n),
        moment: vector(&load.moment_nm),
        left_out: LeftOut::from_code(load.left_out as u32),
    })
}

fn outside_box<'a>(entries: impl Iterator<Item = &'a proto::EffectOutside>) -> OutsideBox {
    let mut outside = OutsideBox::default();
    for entry in entries {
        if let Some(place) = BoxQuantity::ALL.into_iter().position(|q| q as i32 == entry.quantity) {
            outside[place] = entry.excess.into();
        }
    }
    outside
}

fn outside<'a>(entries: impl Iterator<Item = &'a proto::Outside>) -> Outside {
    let mut outside = Outside::default();
    for entry in entries {
        let quantity = Quantity::ALL.into_iter().find(|&quantity| quantity as i32 == entry.quantity);
        if let Some(quantity) = quantity {
            outside.excess[quantity as usize - 1] = entry.excess.into();
        }
    }
    outside
}
