//! The gRPC client: blocking calls on a runtime of its own, so that an answer needs no other thread.

use std::path::PathBuf;
use std::time::Duration;

use tokio::runtime::Runtime;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Status, Streaming};

use super::{ClientError, EffectReply, Reply, SurfaceReply};
use crate::domain::{Domain, Outside, Quantity, Range};
use crate::effects::{BoxQuantity, Effect, LeftOut, OutsideBox};
use crate::service::proto;
use crate::service::proto::admin_client::AdminClient;
use crate::service::proto::hydrodynamics_client::HydrodynamicsClient;
use crate::service::wire::State;

/// How single queries are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// One call each.
    Unary,
    /// All on one stream.
    Stream,
}

/// Where the server is.
#[derive(Debug, Clone)]
enum Address {
    Tcp(String),
    Unix(PathBuf),
}

impl Address {
    fn uri(&self) -> String {
        match self {
            Self::Tcp(uri) => uri.clone(),
            Self::Unix(path) => format!("unix:{}", path.display()),
        }
    }
}

/// A blocking client of one vehicle.
#[derive(Debug)]
pub struct GrpcClient {
    runtime: Runtime,
    client: HydrodynamicsClient<Channel>,
    address: Address,
    vehicle: String,
    method: Method,
    timeout: Duration,
    stream: Option<Open>,
}

#[derive(Debug)]
struct Open {
    requests: mpsc::Sender<proto::EvaluateRequest>,
    answers: Streaming<proto::EvaluateResponse>,
}

impl GrpcClient {
    /// Connects over TCP to a URL such as `http://127.0.0.1:50051`.
    pub fn tcp(url: &str, vehicle: &str, method: Method, timeout: Duration) -> Result<Self, ClientError> {
        Self::new(Address::Tcp(url.to_owned()), vehicle, method, timeout)
    }

    /// Connects to a Unix socket.
    pub fn unix(
        path: PathBuf,
        vehicle: &str,
        method: Method,
        timeout: Duration,
    ) -> Result<Self, ClientError> {
        Self::new(Address::Unix(path), vehicle, method, timeout)
    }

    fn new(address: Address, vehicle: &str, method: Method, timeout: Duration) -> Result<Self, ClientError> {
        let no_server =
            |error: &dyn std::error::Error| ClientError::NoServer { at: address.uri(), reason: chain(error) };
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| no_server(&e))?;
        let endpoint = Endpoint::from_shared(address.uri()).map_err(|e| no_server(&e))?;
        let endpoint = endpoint.connect_timeout(timeout).tcp_nodelay(true);
        let channel = runtime.block_on(endpoint.connect()).map_err(|e| no_server(&e))?;
        let client = HydrodynamicsClient::new(channel).max_decoding_message_size(64 << 20);
        Ok(Self { runtime, client, address, vehicle: vehicle.to_owned(), method, timeout, stream: None })
    }

    /// The forces in one state.
    pub fn evaluate(&mut self, state: &State) -> Result<proto::EvaluateResponse, ClientError> {
        let message = proto::EvaluateRequest { vehicle: self.vehicle.clone(), state: Some(message(state)) };
        match self.method {
            Method::Unary => {
                let request = self.request(message);
                self.runtime
                    .block_on(self.client.evaluate(request))
                    .map(tonic::Response::into_inner)
                    .map_err(|status| self.error(&status))
            }
            Method::Stream => self.evaluate_in_stream(message),
        }
    }

    fn evaluate_in_stream(
        &mut self,
        message: proto::EvaluateRequest,
    ) -> Result<proto::EvaluateResponse, ClientError> {
        let Self { runtime, client, stream, timeout, .. } = self;
        let exchange = async {
            let open = match stream {
                Some(open) => open,
                None => stream.insert(open(client).await?),
            };
            if open.requests.send(message).await.is_err() {
                tracing::debug!("the stream was closed by the server; its answer says why");
            }
            open.answers.message().await?.ok_or_else(|| Status::unavailable("the server closed the stream"))
        };
        let answer = runtime.block_on(async { tokio::time::timeout(*timeout, exchange).await });
        let answer = answer.unwrap_or_else(|_| Err(Status::deadline_exceeded("no answer in the stream")));
        answer.map_err(|status| {
            // a stream ends with its first error; the next query opens another
            self.stream = None;
            self.error(&status)
        })
    }

    /// The forces in each state of a batch.
    pub fn evaluate_batch(&mut self, states: &[State]) -> Result<proto::EvaluateBatchResponse, ClientError> {
        if states.windows(2).any(|pair| shared(&pair[0]) != shared(&pair[1])) {
            return Err(ClientError::MixedBatch);
        }
        let request = self.request(batch_message(&self.vehicle, states));
        self.runtime
            .block_on(self.client.evaluate_batch(request))
            .map(tonic::Response::into_inner)
            .map_err(|status| self.error(&status))
    }

    /// What the server says of the vehicle.
    pub fn vehicle(&mut self) -> Result<proto::GetVehicleResponse, ClientError> {
        let request =
            self.request(proto::GetVehicleRequest { vehicle: self.vehicle.clone(), include_mesh: false });
        self.runtime
            .block_on(self.client.get_vehicle(request))
            .map(tonic::Response::into_inner)
            .map_err(|status| self.error(&status))
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

    fn request<T>(&self, message: T) -> Request<T> {
        let mut request = Request::new(message);
        request.set_timeout(self.timeout);
        request
    }

    fn error(&self, status: &Status) -> ClientError {
        match status.code() {
            Code::DeadlineExceeded | Code::Cancelled => ClientError::Timeout(self.timeout),
            Code::Unavailable | Code::Unknown => {
                ClientError::NoServer { at: self.address.uri(), reason: status.message().to_owned() }
            }
            code => ClientError::Refused { code: format!("{code:?}"), message: status.message().to_owned() },
        }
    }
}

/// Asks the server at a URL, `http://HOST:PORT` or `unix:PATH`, to read a vehicle's bundle again.
pub fn reload(url: &str, vehicle: &str, timeout: Duration) -> Result<Vec<proto::Reloaded>, ClientError> {
    let no_server = |reason: String| ClientError::NoServer { at: url.to_owned(), reason };
    let failed = |error: &dyn std::error::Error| no_server(chain(error));
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|error| failed(&error))?;
    let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|error| failed(&error))?;
    runtime.block_on(async {
        let endpoint = endpoint.connect_timeout(timeout).timeout(timeout);
        let mut client = AdminClient::new(endpoint.connect().await.map_err(|error| failed(&error))?);
        let request = proto::ReloadRequest { vehicle: vehicle.to_owned() };
        let response =
            client.reload(request).await.map_err(|status| no_server(status.message().to_owned()))?;
        Ok(response.into_inner().vehicles)
    })
}

async fn open(client: &mut HydrodynamicsClient<Channel>) -> Result<Open, Status> {
    let (requests, outgoing) = mpsc::channel(1);
    let answers = client.stream(ReceiverStream::new(outgoing)).await?.into_inner();
    Ok(Open { requests, answers })
}

fn chain(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

fn message(state: &State) -> proto::State {
    let vector = |[x, y, z]: [f32; 3]| Some(proto::Vector3 { x, y, z });
    let [x, y, z] = state.gravity;
    proto::State {
        velocity_mps: vector(state.velocity),
        current_mps: vector(state.current),
        angular_velocity_radps: vector(state.angular_velocity),
        acceleration_mps2: vector(state.acceleration),
        angular_acceleration_radps2: vector(state.angular_acceleration),
        depth_m: state.depth,
        density_kgpm3: Some(state.density),
        attitude: Some(proto::state::Attitude::GravityDirection(proto::Vector3 { x, y, z })),
        ground_contact: ground_contact(state).into(),
        heading_rad: state.heading,
        depth_rate_mps: state.depth_rate,
        wheel_speed_radps: state.wheel_speeds.map_or_else(Vec::new, Vec::from),
        time_step_s: state.time_step,
        implicit_added_mass: state.implicit_added_mass,
    }
}

fn ground_contact(state: &State) -> proto::GroundContact {
    if state.dry_contact { proto::GroundContact::Dry } else { proto::GroundContact::Wetted }
}

/// What the states of a batch have in common: the message carries it once, or not at all.
fn shared(state: &State) -> [bool; 5] {
    let State { heading, depth_rate, wheel_speeds, .. } = state;
    let given = [heading.is_some(), depth_rate.is_some(), wheel_speeds.is_some()];
    [state.dry_contact, state.implicit_added_mass, given[0], given[1], given[2]]
}

fn batch_message(vehicle: &str, states: &[State]) -> proto::EvaluateBatchRequest {
    let rows = |row: fn(&State) -> [f32; 3]| states.iter().flat_map(row).collect();
    proto::EvaluateBatchRequest {
        vehicle: vehicle.to_owned(),
        velocity_mps: rows(|s| s.velocity),
        current_mps: rows(|s| s.current),
        angular_velocity_radps: rows(|s| s.angular_velocity),
        acceleration_mps2: rows(|s| s.acceleration),
        angular_acceleration_radps2: rows(|s| s.angular_acceleration),
        depth_m: states.iter().map(|s| s.depth).collect(),
        density_kgpm3: states.iter().map(|s| s.density).collect(),
        gravity_direction: rows(|s| s.gravity),
        ground_contact: states.first().map_or(proto::GroundContact::Unspecified, ground_contact).into(),
        omit_surfaces: false,
        heading_rad: states.iter().filter_map(|s| s.heading).collect(),
        depth_rate_mps: states.iter().filter_map(|s| s.depth_rate).collect(),
        wheel_speed_radps: states.iter().filter_map(|s| s.wheel_speeds).flatten().collect(),
        implicit_added_mass: states.first().is_some_and(|s| s.implicit_added_mass),
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
                &response.wetted_fraction,
            ),
            force: vector(wrench.force_n),
            moment: vector(wrench.moment_nm),
            about: vector(wrench.about_m),
            uncertainty: vector(response.uncertainty_n),
            outside: outside(response.outside.iter()),
            effects: response.effects.iter().filter_map(effect).collect(),
            effect_surface_forces: response.effect_surface_force_n.as_chunks::<3>().0.to_vec(),
            effects_outside: outside_box(response.effects_outside.iter()),
            added_mass: response.added_mass.as_slice().try_into().ok(),
            compute_ns: response.compute_ns,
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
                &response.wetted_fraction[from..to],
            ),
            force: row(&response.force_n, i),
            moment: row(&response.moment_nm, i),
            about,
            uncertainty: row(&response.uncertainty_n, i),
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
            compute_ns: response.compute_ns,
        }
    };
    (0..states).map(reply).collect()
}

fn surfaces(forces: &[f32], points: &[f32], wetted: &[f32]) -> Vec<SurfaceReply> {
    let rows = forces.as_chunks::<3>().0.iter().zip(points.as_chunks::<3>().0).zip(wetted);
    rows.map(|((&force, &point), &wetted_fraction)| SurfaceReply { force, point, wetted_fraction }).collect()
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
