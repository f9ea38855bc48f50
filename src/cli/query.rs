//! `wade query`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use wade::client::{Client, GrpcClient, InProcess, Method, Reply, ShmClient};
use wade::effects::{BoxQuantity, LeftOut};
use wade::service::shm::Wait;
use wade::service::{grpc, shm};

use super::state::StateArgs;
use super::{Vehicles, emit};

/// Ask for the forces in one state
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade query --vehicle husky --speed 0.8 --depth 0.18
  wade query --vehicle warthog --velocity 2,0.5,0 --depth 0.3 --transport shm --json
  wade query --vehicle husky --speed 0 --current -1,0,0 --depth 0.1 --addr http://10.0.0.7:50051")]
pub struct Query {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    #[command(flatten)]
    state: StateArgs,
    /// Ask the server at this URL, http://HOST:PORT or unix:PATH
    #[arg(long, value_name = "URL", conflicts_with = "transport")]
    addr: Option<String>,
    /// Compute here, or ask the server on this machine
    #[arg(long, value_enum, default_value_t = Transport::Inproc)]
    transport: Transport,
    /// Namespace of the server's shared memory
    #[arg(long, default_value = shm::NAMESPACE)]
    namespace: String,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Longest wait for an answer [s]
    #[arg(long, default_value_t = 1.0)]
    timeout: f64,
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

impl Query {
    /// Prints the forces.
    pub fn run(self) -> Result<ExitCode> {
        let (mut client, names) = self.client()?;
        let reply = client.evaluate(&self.state.state())?;
        if self.json {
            emit(&format!("{:#}\n", to_json(&self.vehicle, &names, &reply)))?;
        } else {
            emit(&to_table(&self.vehicle, &names, &reply))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// A client, and the names of the surfaces.
    fn client(&self) -> Result<(Client, Vec<String>)> {
        let (vehicle, timeout) = (self.vehicle.as_str(), Duration::try_from_secs_f64(self.timeout)?);
        let unary = Method::Unary;
        let defaults = grpc::Config::default();
        let mut grpc = match (&self.addr, self.transport) {
            (Some(url), _) => match url.strip_prefix("unix:") {
                Some(path) => GrpcClient::unix(PathBuf::from(path), vehicle, unary, timeout)?,
                None => GrpcClient::tcp(url, vehicle, unary, timeout)?,
            },
            (None, Transport::Grpc) => {
                GrpcClient::tcp(&format!("http://{}", defaults.listen), vehicle, unary, timeout)?
            }
            (None, Transport::Uds) => GrpcClient::unix(defaults.unix_socket, vehicle, unary, timeout)?,
            (None, Transport::Shm) => {
                let client = ShmClient::new(vehicle, Wait::Block, timeout).in_namespace(&self.namespace);
                // shared memory carries no names: those of our own bundle, where there is one
                let names = self.vehicles.model(vehicle).map(|model| surface_names(&model));
                return Ok((Client::Shm(Box::new(client)), names.unwrap_or_default()));
            }
            (None, Transport::Inproc) => {
                let served = self.vehicles.served(vehicle)?;
                let names = surface_names(served.model());
                return Ok((Client::InProcess(Box::new(InProcess::new(Arc::new(served)))), names));
            }
        };
        let names = grpc.vehicle()?.surfaces.into_iter().map(|surface| surface.name).collect();
        Ok((Client::Grpc(Box::new(grpc)), names))
    }
}

fn surface_names(model: &wade::model::Model) -> Vec<String> {
    model.vehicle().surfaces.iter().map(|surface| surface.name.clone()).collect()
}

fn name_of(names: &[String], index: usize) -> String {
    names.get(index).cloned().unwrap_or_else(|| format!("surface_{index}"))
}

fn to_json(vehicle: &str, names: &[String], reply: &Reply) -> Value {
    let surfaces = reply.surfaces.iter().enumerate().map(|(i, surface)| {
        json!({
            "name": name_of(names, i),
            "force": surface.force,
            "point": surface.point,
            "wetted_fraction": surface.wetted_fraction,
            "effects_force": reply.effect_surface_forces.get(i).copied().unwrap_or_default(),
        })
    });
    let effects = reply.effects.iter().map(|load| {
        json!({
            "name": load.effect.name(),
            "force": load.force,
            "moment": load.moment,
            "left_out": load.left_out.map(LeftOut::name),
        })
    });
    let outside =
        reply.outside.iter().map(|(quantity, excess)| json!({"quantity": quantity.name(), "excess": excess}));
    json!({
        "vehicle": vehicle,
        "version": reply.version,
        "provenance": reply.provenance,
        "surfaces": surfaces.collect::<Vec<_>>(),
        "wrench": {"force": reply.force, "moment": reply.moment, "about": reply.about},
        "uncertainty": {"force": reply.uncertainty},
        "in_domain": reply.outside.is_inside(),
        "outside": outside.collect::<Vec<_>>(),
        "effects": effects.collect::<Vec<_>>(),
        "effects_outside": effects_outside(reply)
            .map(|(quantity, excess)| json!({"quantity": quantity.name(), "excess": excess}))
            .collect::<Vec<_>>(),
        "added_mass": reply.added_mass.map(|matrix| matrix.chunks(6).map(<[f32]>::to_vec).collect::<Vec<_>>()),
        "compute_ns": reply.compute_ns,
    })
}

/// Where the state lies outside the box in which the effects were seen.
fn effects_outside(reply: &Reply) -> impl Iterator<Item = (BoxQuantity, f64)> + '_ {
    BoxQuantity::ALL.into_iter().zip(reply.effects_outside).filter(|(_, excess)| *excess != 0.0)
}

fn to_table(vehicle: &str, names: &[String], reply: &Reply) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    let row = |[x, y, z]: [f32; 3]| format!("{x:>10.2} {y:>10.2} {z:>10.2}");
    // writing to a String cannot fail
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    line(format!("{vehicle}, bundle version {}, weights: {}", reply.version, reply.provenance));
    line(format!("{:<18} {:>5} {:>10} {:>10} {:>10}", "surface", "wet", "Fx [N]", "Fy [N]", "Fz [N]"));
    for (i, surface) in reply.surfaces.iter().enumerate() {
        let wet = surface.wetted_fraction * 100.0;
        line(format!("{:<18} {wet:>4.0}% {}", name_of(names, i), row(surface.force)));
    }
    for load in &reply.effects {
        let why = load.left_out.map_or_else(String::new, |reason| format!("   left out: {}", reason.name()));
        line(format!("+ {:<22} {}{why}", load.effect.name(), row(load.force)));
    }
    line(format!("{:<24} {}", "net force [N]", row(reply.force)));
    line(format!("{:<24} {}", "  +- one std. dev.", row(reply.uncertainty)));
    let about = reply.about.map(|x| format!("{x:.3}")).join(", ");
    line(format!("{:<24} {}   about ({about}) m", "net moment [N m]", row(reply.moment)));
    for (quantity, excess) in reply.outside.iter() {
        line(format!("outside the training domain: {} by {excess:+.4}", quantity.name()));
    }
    for (quantity, excess) in effects_outside(reply) {
        line(format!("outside the box in which the effects were seen: {} by {excess:+.4}", quantity.name()));
    }
    line(format!("computed in {:.1} us", reply.compute_ns as f64 * 1e-3));
    text
}
