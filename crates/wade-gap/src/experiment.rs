//! The trials that would tell explanations apart.

use wade_core::effects::Effect;

/// Trials in words that tell sets of effects apart.
pub(super) fn separating(sets: &[Vec<Effect>]) -> String {
    let shared = |effect: &Effect| sets.iter().all(|set| set.contains(effect));
    let own: Vec<Vec<Effect>> =
        sets.iter().map(|set| set.iter().filter(|effect| !shared(effect)).copied().collect()).collect();
    let names = own
        .iter()
        .filter(|set| !set.is_empty())
        .map(|set| set.iter().map(|effect| effect.name()).collect::<Vec<_>>().join(" and "));
    let mut parts: Vec<String> = Vec::new();
    for effect in own.iter().flatten() {
        let part = format!("{} ({} alone shows there)", alone(*effect), effect.name());
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    let names = names.collect::<Vec<_>>().join(" or ");
    match parts.len() {
        0..=2 => format!("{names}: {}", parts.join("; or ")),
        _ => format!("{names}: all but one of these trials separate them: {}", parts.join("; ")),
    }
}

/// A trial in which an effect shows in a way of its own.
fn alone(effect: Effect) -> &'static str {
    match effect {
        Effect::AddedMass => {
            "speed up and brake hard several times through one speed at the deepest level, and hold that speed for 10 s"
        }
        Effect::LinearDamping => {
            "hold a very low speed (Froude number below 0.1) and a high one at one depth"
        }
        Effect::DragCoefficientError => "hold at least four steady speeds over the whole range at two depths",
        Effect::Rotation => "turn on the spot at two rates without moving ahead",
        Effect::Current => "drive the same line in both directions, and stand still with the wheels locked",
        Effect::WaterLevelOffset => {
            "stand still at two depths that differ by half, each measured with a ruler at the hull"
        }
        Effect::DensityError => {
            "stand still at three depths, and weigh a liter of the water; a wrong density grows with the depth"
        }
        Effect::HullFlooding => {
            "stand still in the deepest water for two minutes from the moment of entry, then empty the hull"
        }
        Effect::WaterEntrySlamming => {
            "enter the water at three speeds over one ramp, and leave it again at the same speeds"
        }
        Effect::WaveMemory => {
            "speed up within a second, then hold the speed for 10 s; repeat after 2 s and after 60 s of rest"
        }
        Effect::ChannelBlockage => {
            "repeat steady runs in a channel of another width, or in open water (channel_widths in trials.toml)"
        }
        Effect::Squat => "hold at least four steady speeds at two depths and measure the vertical force",
        Effect::WheelPaddleThrust => {
            "let the wheels turn at two speeds while the vehicle is held, at one depth"
        }
        Effect::BedMotion => {
            "tow the parked vehicle (wheels locked, on a carriage) at the speeds at which it drove"
        }
        Effect::SensorDelay => {
            "tap the load cell with a hammer while the motion is recorded, or change the speed in steps at depth zero"
        }
        Effect::SensorBias => "read the sensor on dry ground before and after each trial",
        Effect::SensorBiasStep => "read the sensor on dry ground between all trials, in their order",
        Effect::SensorDrift => "read the sensor at rest on dry ground for as long as a trial lasts",
        Effect::SensorGain => {
            "hang three known weights on the sensor, in each direction that was measured (measured.known_loads in trials.toml)"
        }
        Effect::AxisMisalignment => {
            "hang a known weight on the sensor on level ground and read all components"
        }
        Effect::RollingResistance => "tow the vehicle over the same dry ground at two speeds",
        Effect::DriveGain => "pull against a spring balance on dry ground at three drive forces",
        Effect::MassError => "weigh the vehicle as it was tested, or speed up and brake on dry ground",
    }
}
