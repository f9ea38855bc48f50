//! A load cell as a chain: turned axes, a delay line, a gain of one channel or of all, a zero that is off,
//! steps or drifts.

use super::{Effect, Hidden, Setting};
use crate::{Track, Wrench6};
use wade_core::frame::Vec3;

/// What the chain makes of a wrench, less the wrench.
pub(super) fn change(hidden: &Hidden, setting: &Setting, track: &Track, wrench: &[Wrench6]) -> Vec<Wrench6> {
    let component = (hidden.shape[0] as usize).min(2);
    let zero = |value: f64| {
        let mut offset = Wrench6::zeros();
        offset[component] = value;
        offset
    };
    let size = hidden.size;
    match hidden.effect {
        Effect::SensorDelay => {
            let late = (0..wrench.len()).map(|i| delayed(wrench, i, size / track.step));
            late.zip(wrench).map(|(late, now)| late - now).collect()
        }
        Effect::SensorBias => vec![zero(size); wrench.len()],
        Effect::SensorBiasStep => {
            let jumped = track.session_time >= hidden.shape[1] * setting.session;
            vec![zero(if jumped { size } else { 0.0 }); wrench.len()]
        }
        Effect::SensorDrift => track.states.iter().map(|state| zero(size * state.t)).collect(),
        // below 0: of all channels
        Effect::SensorGain if hidden.shape[0] < 0.0 => wrench.iter().map(|wrench| wrench * size).collect(),
        Effect::SensorGain => wrench.iter().map(|wrench| zero(size * wrench[component])).collect(),
        _ => {
            // the sensor is turned by `size` about y
            let turn = nalgebra::Rotation3::from_axis_angle(&Vec3::y_axis(), -size);
            let seen = |wrench: &Wrench6| {
                let [force, moment] = [0, 3].map(|row| turn * Vec3::from(wrench.fixed_rows::<3>(row)));
                Wrench6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z) - wrench
            };
            wrench.iter().map(seen).collect()
        }
    }
}

/// The value some samples ago, cubic between samples (Catmull and Rom); before the record it was as at its beginning.
fn delayed(values: &[Wrench6], index: usize, samples: f64) -> Wrench6 {
    let place = index as f64 - samples;
    let below = place.floor();
    let s = place - below;
    let at = |offset: i64| values[(below as i64 + offset).clamp(0, values.len() as i64 - 1) as usize];
    let (p0, p1, p2, p3) = (at(-1), at(0), at(1), at(2));
    0.5 * (2.0 * p1
        + (p2 - p0) * s
        + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * (s * s)
        + (3.0 * p1 - p0 - 3.0 * p2 + p3) * (s * s * s))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::tests_support::*;
    use super::*;
    use crate::State;

    #[test]
    fn a_delay_line_shifts_a_sine_by_its_phase() {
        let (rate, step) = (4.0, 0.02);
        let sine = |t: f64| Wrench6::repeat((rate * t).sin());
        let values: Vec<Wrench6> = (0..200).map(|i| sine(i as f64 * step)).collect();
        for i in [40, 100, 177] {
            let found = delayed(&values, i, 0.033 / step);
            assert!((found - sine(i as f64 * step - 0.033)).norm() < 1e-4);
        }
        assert_eq!(delayed(&values, 7, 0.0), values[7]);
    }

    #[test]
    fn turned_axes_mix_x_and_z_and_keep_the_length() {
        let force = Wrench6::new(10.0, 0.0, 1000.0, 0.0, 0.0, 0.0);
        let states = vec![State::default(); 2];
        let change = on_box_with(hidden(Effect::AxisMisalignment, 0.02), states, &[force, force])[0];
        // sensor axes turned towards +z by 0.02 about y see less of z along x
        assert!((change[0].abs() - 20.0).abs() < 0.1, "{change}");
        assert!(((force + change).norm() - force.norm()).abs() < 1e-9);
    }

    #[test]
    fn gain_bias_and_drift_are_as_stated() {
        let wrench = [Wrench6::repeat(2.0); 3];
        let states: Vec<State> = (0..3).map(|i| State { t: f64::from(i), ..State::default() }).collect();
        let gain = on_box_with(hidden(Effect::SensorGain, 0.1), states.clone(), &wrench);
        assert!((gain[1] - Wrench6::x() * 0.2).norm() < 1e-12);
        let all = Hidden { shape: [-1.0, 0.0, 0.0], ..hidden(Effect::SensorGain, 0.1) };
        assert!((on_box_with(all, states.clone(), &wrench)[1] - Wrench6::repeat(0.2)).norm() < 1e-12);
        let drift = on_box_with(hidden(Effect::SensorDrift, 0.5), states.clone(), &wrench);
        assert_eq!([drift[0][0], drift[2][0], drift[2][1]], [0.0, 1.0, 0.0]);
        let bias = on_box_with(hidden(Effect::SensorBias, -3.0), states, &wrench);
        assert_eq!(bias[1][0], -3.0);
    }
}
