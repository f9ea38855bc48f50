//! The same data told in another way: an answer must not change.

use wade_core::frame::Vec3;
use wade_learn::random::Random;
use wade_learn::trials::{Trial, Trials, component_of};

/// Components that change their sign: fy, mx, mz.
const TURNED: [usize; 3] = [1, 3, 5];

/// The trials in another order.
pub fn shuffled(trials: &Trials, random: &mut Random) -> Trials {
    let mut shuffled = trials.clone();
    random.shuffle(&mut shuffled.trials);
    shuffled
}

/// The mirror image across the plane y = 0 of the body.
pub fn mirrored(trials: &Trials) -> Trials {
    let mut mirrored = trials.clone();
    if let Some(body) = &mut mirrored.manifest.body {
        body.center_of_mass[1] = -body.center_of_mass[1];
    }
    mirrored.trials.iter_mut().for_each(mirror);
    mirrored
}

fn mirror(trial: &mut Trial) {
    let polar = |v: &mut Vec3| v.y = -v.y;
    // a rate of turning about x or z changes its sense, one about y does not
    let axial = |v: &mut Vec3| (v.x, v.z) = (-v.x, -v.z);
    trial.velocity.iter_mut().for_each(polar);
    trial.current.iter_mut().for_each(polar);
    trial.acceleration.iter_mut().for_each(polar);
    trial.angular_velocity.iter_mut().for_each(axial);
    trial.angular_acceleration.iter_mut().for_each(axial);
    let turned = [&mut trial.roll, &mut trial.yaw];
    turned.into_iter().flatten().for_each(|angle| *angle = -*angle);
    trial.wheel_speeds.swap(0, 1);
    trial.wheel_speeds.swap(2, 3);
    for wrench in [&mut trial.measured, &mut trial.simulated] {
        for component in TURNED {
            wrench[component].iter_mut().flatten().for_each(|value| *value = -*value);
        }
    }
    for (name, column) in trial.other_forces.iter_mut().chain(&mut trial.known_loads) {
        if component_of(name).is_some_and(|component| TURNED.contains(&component)) {
            column.iter_mut().for_each(|value| *value = -*value);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::case::{Family, cases};
    use crate::generate::generate;
    use crate::{Hull, Prediction, Schedule, Simulator};
    use wade_core::vehicle::shipped;

    #[test]
    fn known_forces_are_mirrored_as_the_wrench_is() {
        let schedule = Schedule::slice(&shipped::warthog().unwrap().vehicle().unwrap(), 1);
        let hull = Hull::generated_box();
        let simulator = Simulator { hull: &hull, prediction: Prediction::Analytic, vehicle: "generated-box" };
        let mut trials = generate(&cases(&[Family::Null], 1, 1)[0], &schedule, simulator).trials;
        let trial = &mut trials.trials[0];
        trial.other_forces.insert("drive_fx".into(), vec![2.0; trial.len()]);
        trial.other_forces.insert("drive_fy".into(), vec![3.0; trial.len()]);
        trial.known_loads.insert("hung_my".into(), vec![4.0; trial.len()]);
        trial.known_loads.insert("hung_mz".into(), vec![5.0; trial.len()]);
        let mirrored = &mirrored(&trials).trials[0];
        let of =
            |column: &str| mirrored.other_forces.get(column).or(mirrored.known_loads.get(column)).unwrap()[0];
        assert_eq!(["drive_fx", "drive_fy", "hung_my", "hung_mz"].map(of), [2.0, -3.0, 4.0, -5.0]);
    }
}
