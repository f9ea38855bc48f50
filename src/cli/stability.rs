//! `wade stability`.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;
use wade::service::stability::Document;
use wade_client::{Address, ClientError, GrpcClient, Method};
use wade_wire::{Evaluator, Refusal, proto};

use super::state::Contact;
use super::trust::Trust;
use super::{Vehicles, emit};

/// Whether a vehicle that stands in moving water floats, slides, topples or can be steered
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  A Warthog parked across a current of 1.5 m/s, 0.4 m deep:
  wade stability --vehicle warthog --depth 0.4 --speed 1.5 --heading 1.571
  A map of 10,000 states as a table; wade serve draws one at /#view=stability:
  wade stability --vehicle husky --depth 0:0.5:100 --speed 0:3:100 > map.csv")]
pub struct StabilityCommand {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    /// Water surface above the bed [m], or MIN:MAX:COUNT
    #[arg(long, value_name = "D", value_parser = range, allow_hyphen_values = true)]
    depth: Range,
    /// Speed through the water [m/s], or MIN:MAX:COUNT
    #[arg(long, value_name = "S", value_parser = range)]
    speed: Range,
    /// Where the water comes from: 0 ahead, 1.571 left, 3.142 behind [rad]
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    heading: f32,
    /// Friction of the wheels on the bed, or MIN:MAX, each value as likely [default: 0.32:0.9, tires on wet roads]
    #[arg(long, value_name = "MU", value_parser = friction)]
    friction: Option<(f32, f32)>,
    /// Density of the fluid [kg/m3]
    #[arg(long, default_value_t = 1000.0)]
    density: f32,
    /// Slope of the bed across, positive lowers the right side [rad]
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    roll: f32,
    /// Slope of the bed along, positive lowers the nose [rad]
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pitch: f32,
    /// Share of the motion through the water that is motion over the bed: 0 parked in a current, 1 driving
    #[arg(long, default_value_t = 0.0)]
    bed: f32,
    /// Whether water reaches under the tires
    #[arg(long, value_enum, default_value_t = Contact::Wetted)]
    ground_contact: Contact,
    /// Exit status 1 where it floats, slides, topples or cannot be steered with a greater probability
    #[arg(long, value_name = "P")]
    risk: Option<f32>,
    /// Ask this server: host:port, https://host:port or unix:PATH [default: compute here]
    #[arg(long)]
    addr: Option<Address>,
    #[command(flatten)]
    trust: Trust,
    /// Longest wait for an answer [s]
    #[arg(long, default_value_t = 60.0)]
    timeout: f64,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Numbers from one to another.
#[derive(Debug, Clone, PartialEq)]
struct Range(Vec<f32>);

fn range(text: &str) -> Result<Range, String> {
    let number = |text: &str| text.trim().parse::<f32>().map_err(|error| format!("`{text}`: {error}"));
    match text.split(':').collect::<Vec<_>>()[..] {
        [value] => Ok(Range(vec![number(value)?])),
        [low, high, count] => {
            let (low, high) = (number(low)?, number(high)?);
            let count: u16 = count.trim().parse().map_err(|error| format!("`{count}`: {error}"))?;
            if count < 2 {
                return Err("COUNT is 2 at least".into());
            }
            let last = f32::from(count - 1);
            Ok(Range((0..count).map(|i| low + (high - low) * (f32::from(i) / last)).collect()))
        }
        _ => Err("a number, or MIN:MAX:COUNT, is needed".into()),
    }
}

fn friction(text: &str) -> Result<(f32, f32), String> {
    let number = |text: &str| text.trim().parse::<f32>().map_err(|error| format!("`{text}`: {error}"));
    match text.split_once(':') {
        Some((low, high)) => Ok((number(low)?, number(high)?)),
        None => number(text).map(|friction| (friction, friction)),
    }
}

impl StabilityCommand {
    pub fn run(self) -> Result<ExitCode> {
        let request = self.request();
        let response = match &self.addr {
            None => self.computed(&request)?,
            Some(Address::Shm(_)) => bail!(
                "--addr: shared memory does not answer how a vehicle stands; name host:port or unix:PATH, or leave --addr out"
            ),
            Some(address) => {
                let timeout = Duration::try_from_secs_f64(self.timeout)?;
                let url = address.url().unwrap_or_default();
                let credentials = self.trust.credentials()?;
                GrpcClient::connect(&url, &self.vehicle, Method::Unary, timeout, &credentials)?
                    .stability(request.clone())?
            }
        };
        let is_one = request.depth_m.len() == 1 && request.speed_mps.len() == 1;
        let text = match (self.json, is_one) {
            (true, one) => serde_json::to_string_pretty(&Document::new(&request, &response, one))? + "\n",
            (false, true) => described(&request, &response),
            (false, false) => table(&request, &response)?,
        };
        emit(&text)?;
        let outside = response.in_domain.iter().filter(|in_domain| !**in_domain).count();
        if outside > 0 && !self.json {
            eprintln!(
                "warning: {outside} of {} states are outside the training domain: the deviations stated there are those of the base",
                response.in_domain.len()
            );
        }
        let risk = worst(&response);
        Ok(ExitCode::from(u8::from(self.risk.is_some_and(|limit| risk > limit))))
    }

    fn request(&self) -> proto::GetStabilityRequest {
        proto::GetStabilityRequest {
            vehicle: self.vehicle.clone(),
            depth_m: self.depth.0.clone(),
            speed_mps: self.speed.0.clone(),
            heading_rad: self.heading,
            friction_min: self.friction.map(|(min, _)| min),
            friction_max: self.friction.map(|(_, max)| max),
            density_kgpm3: Some(self.density),
            roll_pitch: Some(proto::RollPitch { roll_rad: self.roll, pitch_rad: self.pitch }),
            ground_contact: match self.ground_contact {
                Contact::Wetted => proto::GroundContact::Wetted,
                Contact::Dry => proto::GroundContact::Dry,
            }
            .into(),
            bed: Some(self.bed),
            // a table has no column for them
            normal_forces: self.json || (self.depth.0.len() == 1 && self.speed.0.len() == 1),
        }
    }

    fn computed(&self, request: &proto::GetStabilityRequest) -> Result<proto::GetStabilityResponse> {
        let vehicle = self.vehicles.served(&self.vehicle)?;
        let refused = |refusal: Refusal| {
            let code = refusal.code();
            ClientError::Refused { code, message: refusal.to_string() }
        };
        Ok(wade_wire::stability(request, &vehicle, &mut Evaluator::default()).map_err(refused)?)
    }
}

/// Name, probabilities and margins of each mode.
fn modes(response: &proto::GetStabilityResponse) -> [(&'static str, Vec<f32>, Vec<f32>); 4] {
    let [probability, margin] =
        [&response.probability, &response.margin].map(|modes| modes.clone().unwrap_or_default());
    [
        ("floats", probability.floats, margin.floats),
        ("slides", probability.slides, margin.slides),
        ("topples", probability.topples, margin.topples),
        ("steers", probability.steers, margin.steers),
    ]
}

/// The greatest probability of a loss of hold.
fn worst(response: &proto::GetStabilityResponse) -> f32 {
    let lost = |(name, probability, _): (&str, Vec<f32>, Vec<f32>)| {
        let lost = move |value: f32| if name == "steers" { 1.0 - value } else { value };
        probability.into_iter().map(lost).fold(0.0, f32::max)
    };
    modes(response).into_iter().map(lost).fold(0.0, f32::max)
}

fn described(request: &proto::GetStabilityRequest, response: &proto::GetStabilityResponse) -> String {
    let mut text = format!(
        "{} version {} (provenance: {}), {} m of water at {} m/s\n{:<10} {:>11} {:>8}\n",
        request.vehicle,
        response.bundle_version,
        response.provenance,
        request.depth_m[0],
        request.speed_mps[0],
        "",
        "probability",
        "margin"
    );
    for (name, probability, margin) in modes(response) {
        if let (Some(probability), Some(margin)) = (probability.first(), margin.first()) {
            text += &format!("{name:<10} {probability:>11.3} {margin:>8.2}\n");
        }
    }
    let needed = response.friction_needed.first().filter(|needed| needed.is_finite());
    let needed =
        needed.map_or("none is enough: it floats".to_owned(), |needed| format!("{needed:.2} needed"));
    let (min, max) = (response.friction_min, response.friction_max);
    let taken = if min < max { format!("{min} to {max}") } else { format!("{min}") };
    text += &format!("friction   {needed}, {taken} taken\n");
    for (foot, force) in response.feet.iter().zip(&response.normal_force_n) {
        text += &format!("{:<24} {force:>9.1} N on the bed\n", foot.surface);
    }
    text
}

fn table(request: &proto::GetStabilityRequest, response: &proto::GetStabilityResponse) -> Result<String> {
    let modes: Vec<_> =
        modes(response).into_iter().filter(|(_, probability, _)| !probability.is_empty()).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = ["depth", "speed"].map(str::to_owned).into_iter();
    let names = modes.iter().map(|(name, ..)| (*name).to_owned());
    let margins = modes.iter().map(|(name, ..)| format!("margin_{name}"));
    let rest = ["friction_needed", "in_domain"].map(str::to_owned);
    writer.write_record(columns.chain(names).chain(margins).chain(rest))?;
    for i in 0..response.in_domain.len() {
        let speeds = request.speed_mps.len();
        let state = [request.depth_m[i / speeds], request.speed_mps[i % speeds]];
        let numbers = state
            .into_iter()
            .chain(modes.iter().map(|(_, probability, _)| probability[i]))
            .chain(modes.iter().map(|(_, _, margin)| margin[i]))
            .chain([response.friction_needed[i]]);
        let inside = u8::from(response.in_domain[i]).to_string();
        writer.write_record(numbers.map(|number| number.to_string()).chain([inside]))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
