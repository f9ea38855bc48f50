//! The same data told in another way: an answer must not change.

use crate::frame::Vec3;
use crate::random::Random;
use crate::trials::{Trial, Trials};

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
        // fy, mx, mz
        for component in [1, 3, 5] {
            wrench[component].iter_mut().flatten().for_each(|value| *value = -*value);
        }
    }
}
