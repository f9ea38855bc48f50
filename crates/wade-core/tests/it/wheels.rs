//! Which surface is which wheel, and that a speed turns that one.

use wade_core::bundle;
use wade_core::condition::Condition;
use wade_core::forces::Forces;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parametric::{cuboid, cylinder};
use wade_core::model::kernel::Isa;
use wade_core::model::{Model, Workspace};
use wade_core::physics::{Base, Motion, Physics};
use wade_core::vehicle::{MAX_WHEELS, PerWheel, SurfaceKind, Vehicle};

use crate::bodies::{bodies, body, radiation};
use crate::common::{VEHICLES, model, vehicles};

/// A box on wheels of 0.3 m at these places.
fn on_wheels(name: &str, places: &[[f64; 2]]) -> Vehicle {
    let wheel = |&[x, y]: &[f64; 2]| (cylinder(&Vec3::new(x, y, -0.3), 0.3, 0.2, 32), SurfaceKind::Wheel);
    let hull = cuboid(&Bounds { min: Vec3::new(-2.0, -0.6, -0.3), max: Vec3::new(2.0, 0.6, 0.5) });
    let mut parts: Vec<(Mesh, SurfaceKind)> = places.iter().map(wheel).collect();
    parts.insert(1, (hull, SurfaceKind::Bottom));
    body(name, 900.0, &parts)
}

/// Places of the wheels in their order, in tenths of a meter.
fn order(vehicle: &Vehicle) -> Vec<(i32, i32)> {
    let tenths = |x: f64| (10.0 * x).round() as i32;
    let place = |&wheel: &usize| vehicle.surfaces[wheel].centroid;
    vehicle.wheels().iter().map(|wheel| (tenths(place(wheel).x), tenths(place(wheel).y))).collect()
}

#[test]
fn the_wheels_of_the_shipped_vehicles_are_front_left_front_right_rear_left_rear_right() {
    for name in VEHICLES {
        let model = model(name);
        let names: Vec<&str> =
            model.wheels().iter().map(|&wheel| model.vehicle().surfaces[wheel].name.as_str()).collect();
        assert_eq!(names, ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"], "{name}");
    }
}

#[test]
fn wheels_are_counted_by_axle_from_the_front_and_left_before_right() {
    let places = [[0.0, -0.8], [-1.5, 0.8], [1.5, -0.8], [-1.5, -0.8], [1.5, 0.8], [0.0, 0.8]];
    let mut six = on_wheels("six wheels", &places);
    let expected = [(15, 8), (15, -8), (0, 8), (0, -8), (-15, 8), (-15, -8)];
    assert_eq!(order(&six), expected);
    // the right one of the middle axle, which is the first surface, stands a little ahead, and then half a meter
    six.surfaces[0].centroid.x = 0.1;
    assert_eq!(order(&six)[2..4], [(0, 8), (1, -8)]);
    six.surfaces[0].centroid.x = 0.5;
    assert_eq!(order(&six)[2..4], [(5, -8), (0, 8)]);

    let three = on_wheels("three wheels", &[[-1.0, 0.0], [1.0, -0.8], [1.0, 0.8]]);
    assert_eq!(order(&three), [(10, 8), (10, -8), (-10, 0)]);
    // two pairs are two pairs, whatever the distances within them
    let mut four = on_wheels("four wheels", &[[1.0, -0.8], [-1.0, 0.8], [-1.0, -0.8], [1.0, 0.8]]);
    four.surfaces[0].centroid.x = 1.5;
    assert_eq!(order(&four), [(10, 8), (15, -8), (-10, 8), (-10, -8)]);
    let sphere = bodies().into_iter().find(|vehicle| vehicle.name == "sphere").expect("there");
    assert!(sphere.wheels().is_empty());
}

#[test]
fn a_speed_turns_its_own_wheel_and_those_of_another_number_none() {
    let places = [[0.0, -0.8], [-1.5, 0.8], [1.5, -0.8], [-1.5, -0.8], [1.5, 0.8], [0.0, 0.8]];
    let vehicle = on_wheels("six wheels", &places);
    let base = Base::new(&vehicle, radiation(&vehicle));
    let model = Model::of_physics(vehicle, 1, base);
    let state = Condition::level(Vec3::new(0.5, 0.0, 0.0), 0.4);
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    let mut thrusts = |speeds: Option<PerWheel<f64>>| -> Vec<f64> {
        let motion = Motion {
            wheel_speeds: &model.wheel_speeds(speeds.as_ref()),
            time_step: 0.0,
            implicit_added_mass: false,
            physics: Physics::Full,
            waters: None,
        };
        model.evaluate_moving(&state, (&motion, None), &mut workspace, &mut forces);
        forces.surfaces.iter().map(|surface| surface.force.x).collect()
    };
    let still = thrusts(None);
    assert_eq!(model.wheels().len(), 6);
    for wheel in 0..6 {
        let mut speeds = [0.0; 6];
        speeds[wheel] = 20.0;
        let turning = thrusts(Some(speeds.into()));
        for (surface, (turning, still)) in turning.iter().zip(&still).enumerate() {
            let is_its_own = surface == model.wheels()[wheel];
            assert_eq!(
                turning != still,
                is_its_own,
                "wheel {wheel}, surface {surface}: {still} N to {turning} N"
            );
        }
    }
    assert_eq!(thrusts(Some([20.0; 4].into())), still);
}

/// Drag of the Warthog's base [N] at a speed and a depth, without wheel speeds and with wheels whose rims have this speed.
fn drags(speed: f64, depth: f64, rim: f64) -> [f64; 2] {
    /// Of the outermost elements of the wheels [m].
    const RADIUS: f64 = 0.305;
    let model = model("warthog");
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    [None, Some([rim / RADIUS; 4].into())].map(|speeds: Option<PerWheel<f64>>| {
        let motion = Motion {
            wheel_speeds: &model.wheel_speeds(speeds.as_ref()),
            time_step: 0.0,
            implicit_added_mass: false,
            physics: Physics::QuasiSteady,
            waters: None,
        };
        let state = Condition::level(Vec3::new(speed, 0.0, 0.0), depth);
        model.evaluate_moving(&state, (&motion, None), &mut workspace, &mut forces);
        -forces.wrench.force.x
    })
}

#[test]
fn rolling_wheels_change_the_drag_as_little_as_in_resolved_flow() {
    // speed [m/s], depth [m], and what the drag loses [N] where bed and wheels move: set driving of campaigns/warthog, beside the
    // same states with both at rest
    for (speed, depth, loses) in [(3.0, 0.15, 6.9), (3.0, 0.20, 6.8), (4.0, 0.25, 62.9), (4.0, 0.40, 71.4)] {
        let [still, rolling] = drags(speed, depth, speed);
        let share = (still - rolling - loses).abs() / still;
        assert!(share < 0.03, "{speed} m/s, {depth} m: {still} N, rolling {rolling} N");
    }
}

#[test]
fn lugs_push_by_their_slip() {
    let push = |slip: f64| {
        let [still, turning] = drags(2.0, 0.2, 2.0 * (1.0 + slip));
        still - turning
    };
    let rolling = push(0.0);
    let [small, twice, braking] = [0.02, 0.04, -0.02].map(|slip| push(slip) - rolling);
    assert!(small > 0.0 && (1.8..2.3).contains(&(twice / small)), "{small} N, {twice} N");
    assert!(braking < 0.3 * small, "{braking} N");
}

#[test]
fn a_bundle_keeps_its_tracks_and_a_network_takes_them_for_wheels() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut husky = bundle::read(&vehicles().join("husky")).expect("sound");
    for wheel in husky.vehicle.wheels() {
        let surface = &mut husky.vehicle.surfaces[wheel];
        (surface.kind, surface.sprocket_radius) = (SurfaceKind::Track, Some(0.125));
    }
    let place = folder.path().join("husky");
    bundle::write(&place, &husky).expect("written");
    let tracked = bundle::load(&place, Isa::available()[0]).expect("sound");
    assert_eq!(tracked.vehicle().surfaces, husky.vehicle.surfaces);
    assert_eq!(tracked.wheels(), model("husky").wheels());
    let state = Condition::level(Vec3::new(0.8, 0.1, 0.0), 0.15);
    let forces = [tracked, model("husky")].map(|model| {
        let mut forces = Forces::default();
        model.evaluate(&state, &mut Workspace::new(), &mut forces);
        forces
    });
    assert_eq!(forces[0].surfaces, forces[1].surfaces);
}

#[test]
fn a_list_of_values_has_room_for_all_wheels_and_no_more() {
    let values: Vec<f32> = (0..MAX_WHEELS).map(|i| i as f32).collect();
    assert_eq!(*PerWheel::new(&values).expect("room"), *values);
    assert_eq!(PerWheel::new(&[0.0_f32; MAX_WHEELS + 1]), None);
    let two: PerWheel<f32> = [1.0, 2.0].into();
    assert_eq!(two.map(f64::from), [1.0, 2.0].into());
    assert_ne!(two, [1.0, 2.0, 0.0].into());
    assert_eq!(two.try_map(|x| if x > 1.0 { Err(x) } else { Ok(x) }), Err(2.0));
}
