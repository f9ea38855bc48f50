//! `wade query`.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use clap::{Args, ValueEnum};
use wade::service::answer::Answer;
use wade::service::grpc;
use wade_client::{Address, Client, GrpcClient, InProcess, Method, Reply, ShmClient};
use wade_core::domain::Domain;
use wade_core::model::{COLUMNS, Model};
use wade_wire::proto::EvaluateResponse;
use wade_wire::shm::{NAMESPACE, Wait};

use super::state::StateArgs;
use super::trust::Trust;
use super::{Vehicles, emit, outside, usage_error};

/// Ask for the forces in one state
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade query --vehicle husky --speed 0.8 --depth 0.18
  wade query --vehicle warthog --velocity 2,0.5,0 --depth 0.3 --transport shm
  wade query --vehicle husky --current -1,0,0 --depth 0.1 --addr 10.0.0.7:50051")]
pub struct Query {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    #[command(flatten)]
    state: StateArgs,
    /// Ask this server: host:port, https://host:port, unix:PATH or shm:NAMESPACE
    #[arg(long)]
    addr: Option<Address>,
    /// Compute here, or ask the server on this machine at its usual address [default: inproc, or that of --addr]
    #[arg(long, value_enum)]
    transport: Option<Transport>,
    /// Namespace of the server's shared memory, with --transport shm
    #[arg(long, conflicts_with = "addr")]
    namespace: Option<String>,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Longest wait for an answer [s]
    #[arg(long, default_value_t = 1.0)]
    timeout: f64,
    /// Exit status 1 where the state is outside the training domain
    #[arg(long)]
    strict: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Transport {
    /// In this process, no server
    Inproc,
    /// gRPC on 127.0.0.1:50051
    Grpc,
    /// gRPC on the Unix socket /tmp/wade.sock
    Uds,
    /// Shared memory
    Shm,
}

impl Transport {
    fn suits(self, address: &Address) -> bool {
        matches!(
            (self, address),
            (Self::Grpc, Address::Tcp(_) | Address::Tls(_))
                | (Self::Uds, Address::Unix(_))
                | (Self::Shm, Address::Shm(_))
        )
    }
}

/// What is known of a vehicle beside its answers.
#[derive(Default)]
struct About {
    /// Names of its surfaces.
    surfaces: Vec<String>,
    /// The training domain of its weights.
    domain: Option<Domain>,
}

impl About {
    fn of_model(model: &Model) -> Self {
        let surfaces = model.vehicle().surfaces.iter().map(|surface| surface.name.clone()).collect();
        Self { surfaces, domain: Some(*model.domain()) }
    }

    fn name(&self, index: usize) -> String {
        self.surfaces.get(index).cloned().unwrap_or_else(|| format!("surface_{index}"))
    }
}

impl Query {
    /// Prints the forces.
    pub fn run(self) -> Result<ExitCode> {
        let (mut client, about) = self.client()?;
        let reply = client
            .evaluate(&self.state.state())
            .inspect_err(|_| eprint!("{}", outside::degrees(&self.state)))?;
        let warnings = [
            outside::warning(&self.state, &reply.outside, about.domain.as_ref()),
            outside::effects_warning(&reply.effects_outside),
        ];
        let is_outside = warnings.iter().any(Option::is_some);
        if self.json {
            let answer = Answer::new(&self.vehicle, &about.surfaces, EvaluateResponse::from(&reply));
            emit(&format!("{}\n", serde_json::to_string_pretty(&answer)?))?;
        } else {
            emit(&to_table(&self.vehicle, &about, &reply))?;
        }
        warnings.into_iter().flatten().for_each(|warning| eprint!("{warning}"));
        Ok(ExitCode::from(u8::from(self.strict && is_outside)))
    }

    /// The server that is asked; none for a query in this process. What contradicts the address is refused.
    fn address(&self) -> Option<Address> {
        let usual = grpc::Config::default();
        if self.namespace.is_some() && self.transport != Some(Transport::Shm) {
            usage_error("--namespace goes with --transport shm");
        }
        match (&self.addr, self.transport) {
            (Some(address), None) => Some(address.clone()),
            (Some(address), Some(transport)) if transport.suits(address) => Some(address.clone()),
            (Some(address), Some(transport)) => {
                let transport = transport.to_possible_value().map(|value| value.get_name().to_owned());
                usage_error(&format!(
                    "--addr is {address}, which --transport {} does not ask; leave --transport out",
                    transport.unwrap_or_default()
                ))
            }
            (None, None | Some(Transport::Inproc)) => None,
            (None, Some(Transport::Grpc)) => Some(Address::Tcp(usual.listen)),
            (None, Some(Transport::Uds)) => Some(Address::Unix(usual.unix_socket)),
            (None, Some(Transport::Shm)) => {
                Some(Address::Shm(self.namespace.clone().unwrap_or_else(|| NAMESPACE.to_owned())))
            }
        }
    }

    /// A client, and what is known of the vehicle.
    fn client(&self) -> Result<(Client, About)> {
        let (vehicle, timeout) = (self.vehicle.as_str(), Duration::try_from_secs_f64(self.timeout)?);
        let unary = Method::Unary;
        let address = match self.address() {
            Some(address) => address,
            None => {
                let served = self.vehicles.served(vehicle)?;
                let about = About::of_model(served.model());
                return Ok((Client::InProcess(Box::new(InProcess::new(Arc::new(served)))), about));
            }
        };
        let mut grpc = match &address {
            Address::Shm(namespace) => {
                let client = ShmClient::new(vehicle, Wait::Block, timeout).in_namespace(namespace);
                // shared memory carries neither names nor ranges: those of our own bundle, where there is one
                let about = self.vehicles.model(vehicle).map(|model| About::of_model(&model));
                return Ok((Client::Shm(Box::new(client)), about.unwrap_or_default()));
            }
            Address::Tcp(_) | Address::Tls(_) | Address::Unix(_) => {
                let (url, credentials) = (address.url().unwrap_or_default(), self.trust.credentials()?);
                GrpcClient::connect(&url, vehicle, unary, timeout, &credentials)?
            }
        };
        let surfaces = grpc.vehicle()?.surfaces.into_iter().map(|surface| surface.name).collect();
        let about = About { surfaces, domain: Some(grpc.domain()?) };
        Ok((Client::Grpc(Box::new(grpc)), about))
    }
}

/// Columns of the derivatives; turns are those about the body's axes.
const DERIVED: [(&str, &str); COLUMNS] = [
    ("vx", "m/s"),
    ("vy", "m/s"),
    ("vz", "m/s"),
    ("wx", "rad/s"),
    ("wy", "rad/s"),
    ("wz", "rad/s"),
    ("level", "m"),
    ("turn x", "rad"),
    ("turn y", "rad"),
    ("turn z", "rad"),
    ("rho", "kg/m3"),
];

fn to_table(vehicle: &str, about: &About, reply: &Reply) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    // what is rounded to nothing has no sign
    let two = |x: f32| if x.abs() < 0.005 { "0.00".into() } else { format!("{x:.2}") };
    let row = |[x, y, z]: [f32; 3]| format!("{:>10} {:>10} {:>10}", two(x), two(y), two(z));
    // writing to a String cannot fail
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    line(format!("{vehicle}, bundle version {}, weights: {}", reply.version, reply.provenance));
    line(format!("{:<18} {:>5} {:>10} {:>10} {:>10}", "surface", "wet", "Fx [N]", "Fy [N]", "Fz [N]"));
    for (i, surface) in reply.surfaces.iter().enumerate() {
        let wet = surface.wetted_fraction * 100.0;
        line(format!("{:<18} {wet:>4.0}% {}", about.name(i), row(surface.force)));
    }
    for load in &reply.effects {
        let why = load.left_out.map_or_else(String::new, |reason| format!("   left out: {}", reason.name()));
        line(format!("+ {:<22} {}{why}", load.effect.name(), row(load.force)));
    }
    line(format!("{:<24} {}", "net force [N]", row(reply.force)));
    line(format!("{:<24} {}", "  +- one std. dev.", row(reply.uncertainty)));
    let center = reply.about.map(|x| format!("{x:.3}")).join(", ");
    line(format!("{:<24} {}   about ({center}) m", "net moment [N m]", row(reply.moment)));
    let outside: Vec<&str> = reply.outside.iter().map(|(quantity, _)| quantity.words()).collect();
    if !outside.is_empty() {
        line(format!("OUTSIDE the training domain: {}", outside.join(", ")));
    }
    if let Some(jacobian) = &reply.jacobian {
        line(format!(
            "{:<6} {}",
            "d/d",
            DERIVED.map(|(name, unit)| format!("{:>10}", format!("{name} [{unit}]"))).join(" ")
        ));
        for (row, name) in jacobian.as_chunks::<COLUMNS>().0.iter().zip(["Fx", "Fy", "Fz", "Mx", "My", "Mz"])
        {
            line(format!("{name:<6} {}", row.map(|x| format!("{x:>10.4}")).join(" ")));
        }
    }
    line(format!("computed in {:.1} us", reply.compute_ns as f64 * 1e-3));
    text
}
