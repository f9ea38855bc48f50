//! Promise: cases without gauges state the water that gauges measure when the same plan is computed again.

use std::path::{Path, PathBuf};

use wade_core::frame::{GRAVITY, Vec3};
use wade_core::vehicle::{Vehicle, shipped};
use wade_learn::cfd::collect::{self, Collected};
use wade_learn::cfd::plan::Plan;
use wade_learn::dataset::{Dataset, Sample};

/// A campaign as planned, and in the water ahead of the vehicle.
fn both(folder: &Path, vehicle: &Vehicle) -> [Dataset; 2] {
    let plan = Plan::read(folder).unwrap();
    let collected = Collected::read(folder, &plan).unwrap();
    [
        collect::dataset(folder, &plan, &collected).unwrap(),
        collect::dataset_ahead(folder, &plan, vehicle, &collected).unwrap(),
    ]
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn the_depth_ahead_is_what_gauges_measured_when_the_plan_was_computed_again() {
    let campaigns = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
    for (shipped, most) in [(shipped::husky(), 0.02), (shipped::warthog(), 0.03)] {
        let vehicle = shipped.unwrap().vehicle().unwrap();
        let [planned, ahead] = both(&campaigns.join(&vehicle.name), &vehicle);
        let [measured, as_measured] = both(&campaigns.join("drive").join(&vehicle.name), &vehicle);
        assert_eq!(measured, as_measured, "gauges are believed");
        let of = |data: &Dataset, case: &str| -> Sample {
            data.samples.iter().find(|sample| sample.case == case).unwrap().clone()
        };
        let (mut errors, mut errors_of_plan) = (Vec::new(), Vec::new());
        for again in &measured.samples {
            let Some((_, number)) = again.case.split_once("-drive-paper-") else { continue };
            let case = format!("{}-paper-{number}", vehicle.name);
            let [planned, ahead] = [&planned, &ahead].map(|data| of(data, &case));
            let (speed, depth) = (planned.condition.velocity.norm(), planned.condition.depth);
            if speed * speed >= GRAVITY * depth {
                assert_eq!(planned, ahead, "no news of the hull goes upstream");
                continue;
            }
            errors.push(ahead.condition.depth / again.condition.depth - 1.0);
            errors_of_plan.push(depth / again.condition.depth - 1.0);
            let flow = |sample: &Sample| sample.condition.velocity.norm() * sample.condition.depth;
            assert!((flow(&ahead) / flow(&planned) - 1.0).abs() < 1e-9, "what comes in goes out");
            // counted from the water ahead: more of the same load is hydrostatic
            let rest = |sample: &Sample| -> Vec3 {
                sample.surfaces.iter().filter_map(|surface| surface.rest).map(|rest| rest.force).sum()
            };
            assert!(rest(&ahead).z > rest(&planned).z && ahead.net_force() == planned.net_force());
        }
        let [found, of_plan] = [&errors, &errors_of_plan].map(|errors| rms(errors));
        println!("{}: {} cases, {found:.4} instead of {of_plan:.4}", vehicle.name, errors.len());
        assert!(errors.len() >= 10 && found < most && of_plan > 3.0 * found, "{found} {of_plan}");
    }
}
