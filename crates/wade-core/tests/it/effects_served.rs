//! Promise: the effects of a bundle are served by the functions that they were fitted with, and each does what it says.
#![allow(clippy::unwrap_used)]

use crate::common::{Numbers, Recording, VEHICLES, effect, effects_file, every_effect, model, served_with};
use nalgebra::Vector6;
use wade_core::condition::Condition;
use wade_core::effects::channel_blockage::ChannelBlockage;
use wade_core::effects::current::Current;
use wade_core::effects::{
    ActiveEffect, BaseDrag, Body, Circumstances, Effect, EffectLoad, EffectRegion, Immersion, Input, LeftOut,
    Memory, RegionLimit, RegionQuantity, Shape,
};
use wade_core::forces::Forces;
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::model::Workspace;
use wade_core::served::{Loads, ServedVehicle, Session};
use wade_core::wrench::Wrench;

fn evaluate(served: &ServedVehicle, condition: &Condition, told: &Circumstances) -> Loads {
    let mut loads = Loads::default();
    served.evaluate(condition, told, None, &mut loads);
    loads
}

fn only(vehicle: &str, name: Effect, value: f64) -> ServedVehicle {
    served_with(vehicle, effects_file(vehicle, vec![effect(name, value)]))
}

fn load(loads: &Loads, name: Effect) -> EffectLoad {
    *loads.effects.loads.iter().find(|load| load.effect == name).unwrap()
}

/// A wading, turning, accelerating, tilted vehicle.
fn busy() -> Condition {
    let velocity = Vec3::new(0.7, -0.2, 0.05);
    Condition {
        angular_velocity: Vec3::new(0.1, -0.05, 0.4),
        acceleration: Vec3::new(0.8, 0.3, -0.2),
        angular_acceleration: Vec3::new(0.2, -0.1, 0.6),
        up: up_from_roll_pitch(0.03, -0.05),
        ..Condition::level(velocity, 0.17)
    }
}

fn told() -> Circumstances {
    Circumstances {
        heading: Some(0.6),
        depth_rate: Some(0.2),
        wheel_speeds: Some([3.0, 4.0, 5.0, 6.0].into()),
        ..Circumstances::default()
    }
}

fn close(a: &Vec3, b: &Vec3, tolerance: f64) -> bool {
    (a - b).norm() <= tolerance * (1.0 + a.norm().max(b.norm()))
}

#[test]
fn surfaces_and_effects_sum_to_the_wrench() {
    for vehicle in VEHICLES {
        let served = served_with(vehicle, every_effect(vehicle));
        let center = served.model().vehicle().center_of_mass;
        let mut session = Session::default();
        let mut numbers = Numbers::new(3);
        let mut loads = Loads::default();
        for _ in 0..50 {
            let drawn = numbers.drawn();
            let (condition, told) = (drawn.condition(), drawn.circumstances());
            served.evaluate(&condition, &told, Some(&mut session), &mut loads);
            let mut sum = Wrench::default();
            for surface in &loads.forces.surfaces {
                sum += Wrench::from_force_at(surface.force, &surface.point, &center);
                sum.moment += surface.couple;
            }
            for load in &loads.effects.loads {
                sum += load.wrench;
            }
            assert!(close(&sum.force, &loads.forces.wrench.force, 1e-12), "{vehicle} {condition:?}");
            assert!(close(&sum.moment, &loads.forces.wrench.moment, 1e-12), "{vehicle} {condition:?}");
        }
    }
}

#[test]
fn an_effect_that_acts_on_surfaces_says_on_which() {
    for name in [Effect::DragCoefficientError, Effect::LinearDamping, Effect::Rotation, Effect::BedMotion] {
        let loads = evaluate(&only("warthog", name, 0.3), &busy(), &told());
        let sum: Vec3 = loads.effects.surface_forces.iter().sum();
        assert!(sum.norm() > 0.1 && close(&sum, &load(&loads, name).wrench.force, 1e-12), "{}", name.name());
    }
    // the hull as a whole
    let loads = evaluate(&only("warthog", Effect::Squat, 0.3), &busy(), &told());
    assert!(loads.effects.surface_forces.iter().all(|force| *force == Vec3::zeros()));
}

#[test]
fn an_effect_of_a_region_is_whole_within_it_and_fades_over_its_border() {
    let depth = RegionLimit { quantity: RegionQuantity::Depth, above: Some([0.15, 0.19]), at_most: None };
    let region = EffectRegion { limits: vec![depth] };
    for name in [Effect::DragCoefficientError, Effect::LinearDamping, Effect::Current, Effect::AddedMass] {
        let limited = ActiveEffect { region: region.clone(), ..effect(name, 0.3) };
        let limited = served_with("warthog", effects_file("warthog", vec![limited]));
        let (whole, bare) = (only("warthog", name, 0.3), ServedVehicle::new(model("warthog"), None));
        let at =
            |served: &ServedVehicle, depth: f64| evaluate(served, &Condition { depth, ..busy() }, &told());
        // below the border nothing, in the middle of it half, from its end on the same bits
        for (depth, share) in [(0.12, 0.0), (0.15, 0.0), (0.17, 0.5), (0.19, 1.0), (0.25, 1.0)] {
            let (all, part) = (at(&whole, depth), at(&limited, depth));
            let expected = load(&all, name).wrench * share;
            let found = load(&part, name).wrench;
            assert!(close(&found.force, &expected.force, 1e-12), "{} at {depth}", name.name());
            assert!(close(&found.moment, &expected.moment, 1e-12), "{} at {depth}", name.name());
            if share == 1.0 {
                assert_eq!(part.forces, all.forces, "{} at {depth}", name.name());
                assert_eq!(part.effects.loads, all.effects.loads, "{} at {depth}", name.name());
            }
            let of = |loads: &Loads| loads.effects.added_mass.unwrap_or_default();
            let matrix = of(&at(&bare, depth)) * (1.0 - share) + of(&all) * share;
            assert!((of(&part) - matrix).norm() < 1e-9 * (1.0 + matrix.norm()), "{} at {depth}", name.name());
        }
    }
}

#[test]
fn a_hull_that_turns_and_drifts_with_a_current_feels_no_more_inertia_than_one_that_turns_in_still_water() {
    let turning =
        Condition { angular_velocity: Vec3::new(0.0, 0.0, 0.8), ..Condition::level(Vec3::zeros(), 0.17) };
    // straight over ground and unaccelerated, at the velocity of the water
    let drifting = Condition { ground_velocity: Vec3::new(0.9, -0.4, 0.0), ..turning };
    let in_turn = |name: Effect, condition: &Condition| {
        let served = only("warthog", name, 0.3);
        let mut session = Session::default();
        let (mut loads, mut last) = (Loads::default(), Wrench::default());
        for _ in 0..3 {
            let told = Circumstances { time_step: 0.1, ..told() };
            served.evaluate(condition, &told, Some(&mut session), &mut loads);
            last = load(&loads, name).wrench;
        }
        last
    };
    for name in [Effect::AddedMass, Effect::WaveMemory] {
        assert_eq!(in_turn(name, &drifting), in_turn(name, &turning), "{}", name.name());
    }
}

#[test]
fn without_effects_the_answer_is_the_model_s_own() {
    let bare = ServedVehicle::new(model("husky"), None);
    let mut forces = Forces::default();
    bare.model().evaluate(&busy(), &mut Workspace::new(), &mut forces);
    let loads = evaluate(&bare, &busy(), &Circumstances { wheel_speeds: None, ..told() });
    assert_eq!(loads.forces, forces);
    assert!(loads.effects.loads.is_empty());
    assert_eq!(loads.effects.added_mass, forces.base.map(|base| base.added_mass));
}

/// What fitting sees: the load of each coefficient at 1 along a motion, times its value.
fn as_fitted(served: &ServedVehicle, motion: &[(Condition, f64)], told: &Circumstances) -> Vec<Vec<Wrench>> {
    let body = Body::of_vehicle(served.model().vehicle());
    let file = served.effects().unwrap();
    let mut memories = vec![Memory::default(); file.effects.len()];
    let mut immersion = Immersion::default();
    let recorded = || Recording::of(served.model());
    let (mut recording, mut elsewhere) =
        (recorded(), file.effects.iter().map(|_| recorded()).collect::<Vec<_>>());
    let mut along = Vec::new();
    for (sample, (condition, step)) in motion.iter().enumerate() {
        let predicted = recording.wrench(condition, told.wheel_speeds.as_ref(), *step);
        body.immerse(condition, &mut immersion);
        let at = file.effects.iter().zip(&mut memories).zip(&mut elsewhere).map(
            |((effect, memory), elsewhere)| {
                let mut input = Input {
                    body: &body,
                    condition,
                    immersion: &immersion,
                    predicted,
                    elsewhere: None,
                    base_drag: BaseDrag::from(effect.base_drag),
                    yaw: told.heading.unwrap(),
                    wetting_rate: told.depth_rate.unwrap(),
                    channel_width: effect.channel_width,
                    wheel_speeds: told.wheel_speeds.unwrap().map(Some),
                };
                let since = if sample > 0 { *step } else { 0.0 };
                input.elsewhere = effect.shape.elsewhere(&input).map(|there| {
                    let speeds = told.wheel_speeds.as_ref().filter(|_| !there.wheels_at_rest);
                    if there.with_waves {
                        return elsewhere.wrench(&there.condition, speeds, *step) + predicted * -1.0;
                    }
                    let alone = |condition: &Condition, speeds| recorded().wrench(condition, speeds, 0.0);
                    alone(&there.condition, speeds) + alone(condition, told.wheel_speeds.as_ref()) * -1.0
                });
                effect.shape.advance(memory, &input, since);
                let mut sum = Wrench::default();
                effect.shape.basis(memory, &input, |coefficient, _, load| {
                    sum += load * effect.parameters[effect.effect().coefficients()[coefficient].name].value;
                });
                sum
            },
        );
        along.push(at.collect());
    }
    along
}

#[test]
fn what_is_served_along_a_run_is_what_was_fitted() {
    let forms = [None, Some((2.0, 0.02)), Some((3.0, -0.03))];
    for (vehicle, form) in VEHICLES.into_iter().flat_map(|vehicle| forms.map(|form| (vehicle, form))) {
        let mut file = every_effect(vehicle);
        // those of the drag and of the level that ask the model in other states
        for effect in &mut file.effects {
            let Some((drag, level)) = form else { continue };
            match effect.effect() {
                of @ Effect::DragCoefficientError => {
                    effect.shape = Shape::from_numbers(of, [drag, 0.0, 0.0]).unwrap()
                }
                of @ Effect::WaterLevelOffset => {
                    effect.shape = Shape::from_numbers(of, [level, 0.0, 0.0]).unwrap()
                }
                _ => {}
            }
        }
        let served = served_with(vehicle, file);
        let motion: Vec<(Condition, f64)> = (0..80)
            .map(|i| {
                let t = 0.05 * f64::from(i);
                let velocity = Vec3::new(0.5 + 0.4 * t.sin(), 0.1 * t.cos(), 0.0);
                let state = Condition {
                    acceleration: Vec3::new(0.4 * t.cos(), -0.1 * t.sin(), 0.0),
                    angular_velocity: Vec3::new(0.0, 0.02, 0.3 * t.sin()),
                    up: up_from_roll_pitch(0.02 * t.sin(), 0.04 * t.cos()),
                    ..Condition::level(velocity, 0.1 + 0.05 * t.sin().abs())
                };
                (state, if i == 0 { 0.0 } else { 0.05 })
            })
            .collect();
        let expected = as_fitted(&served, &motion, &told());
        let (mut session, mut loads) = (Session::of_recording(), Loads::default());
        let mut remembered = 0.0;
        for ((condition, time_step), expected) in motion.iter().zip(expected) {
            let told = Circumstances { time_step: *time_step, ..told() };
            served.evaluate(condition, &told, Some(&mut session), &mut loads);
            for (load, expected) in loads.effects.loads.iter().zip(&expected) {
                let name = load.effect.name();
                if load.effect == Effect::DragCoefficientError && form.is_some_and(|(drag, _)| drag == 3.0) {
                    // served without the waves of turning that a run at rest over ground would have
                    let expected = expected.force;
                    assert!(close(&load.wrench.force, &expected, 0.01), "{vehicle} {load:?} {expected}");
                } else {
                    assert_eq!(load.wrench, *expected, "{vehicle} {name}");
                }
                assert_eq!(load.left_out, None);
            }
            remembered += load(&loads, Effect::WaveMemory).wrench.force.norm()
                + load(&loads, Effect::HullFlooding).wrench.force.norm();
        }
        assert!(remembered > 1.0, "the run has a memory");
    }
}

#[test]
fn added_mass_pulls_back_by_its_mass_times_the_acceleration() {
    let served = only("husky", Effect::AddedMass, 0.5);
    let vehicle = served.model().vehicle();
    let still = Condition { acceleration: Vec3::new(1.2, 0.0, 0.0), ..Condition::level(Vec3::zeros(), 0.15) };
    let plane = still.water_plane(vehicle.z0);
    let volume = hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &vehicle.center_of_mass).displaced_volume;
    let loads = evaluate(&served, &still, &Circumstances::default());
    let force = load(&loads, Effect::AddedMass).wrench.force;
    let expected = -0.5 * 1000.0 * volume * 1.2;
    // the volume is looked up in a table
    assert!((force.x / expected - 1.0).abs() < 0.08 && force.y == 0.0, "{force} {expected}");
    let matrix = loads.effects.added_mass.unwrap() - loads.forces.base.unwrap().added_mass;
    assert!((matrix[(0, 0)] * 1.2 + force.x).abs() < 1e-9);
}

#[test]
fn the_matrix_times_the_acceleration_is_the_force_that_an_implicit_integration_is_spared() {
    for vehicle in VEHICLES {
        let served = only(vehicle, Effect::AddedMass, 0.7);
        let state = busy();
        let explicit = evaluate(&served, &state, &told());
        let implicit = evaluate(&served, &state, &Circumstances { implicit_added_mass: true, ..told() });
        let matrix = explicit.effects.added_mass.unwrap();
        assert_eq!(Some(matrix), implicit.effects.added_mass);
        assert!((matrix - matrix.transpose()).norm() < 1e-9 * matrix.norm());
        // rates of the body components of the velocity of the center of mass
        let center = served.model().vehicle().center_of_mass;
        let linear = state.acceleration - state.angular_velocity.cross(&state.velocity)
            + state.angular_acceleration.cross(&center);
        let angular = state.angular_acceleration;
        let rate = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z);
        let expected = -(matrix * rate);
        let (with, without) = (explicit.forces.wrench, implicit.forces.wrench);
        let (force, moment) = (with.force - without.force, with.moment - without.moment);
        assert!(close(&force, &Vec3::new(expected[0], expected[1], expected[2]), 1e-9), "{force} {expected}");
        assert!(
            close(&moment, &Vec3::new(expected[3], expected[4], expected[5]), 1e-9),
            "{moment} {expected}"
        );
        // what turns with the hull stays: a steady turn needs a force
        assert!(load(&implicit, Effect::AddedMass).wrench.force.norm() > 0.1);
    }
}

#[test]
fn a_current_acts_as_the_velocity_that_it_takes_off() {
    let drag = |velocity: Vec3, current: f64| {
        let loads =
            evaluate(&only("warthog", Effect::Current, current), &Condition::level(velocity, 0.25), &told());
        load(&loads, Effect::Current).wrench.force
    };
    let bare = |state: &Condition| {
        let mut forces = Forces::default();
        model("warthog").evaluate(state, &mut Workspace::new(), &mut forces);
        forces.wrench
    };
    let change = |from: &Condition, to: &Condition| bare(to) + bare(from) * -1.0;
    // parked, heading along the current of 0.3 m/s east and 0.3 m/s north: as the model is pushed by water from behind
    let heading = std::f64::consts::FRAC_PI_4;
    let ahead = Circumstances { heading: Some(heading), ..Circumstances::default() };
    let served = only("warthog", Effect::Current, 0.3);
    let parked = Condition::level(Vec3::zeros(), 0.25);
    let speed = 0.3 * 2_f64.sqrt();
    let moved = |state: Condition| Condition { velocity: state.velocity - Vec3::x() * speed, ..state };
    let pushed = load(&evaluate(&served, &parked, &ahead), Effect::Current).wrench;
    let expected = change(&parked, &moved(parked));
    assert!(pushed.force.x > 5.0 && close(&pushed.force, &expected.force, 1e-6), "{pushed:?} {expected:?}");
    assert!(close(&pushed.moment, &expected.moment, 1e-6), "{pushed:?} {expected:?}");
    // a vehicle that goes with the water at its speed has no drag left
    let with = Condition::level(Vec3::new(speed, 0.0, 0.0), 0.25);
    let taken = load(&evaluate(&served, &with, &ahead), Effect::Current).wrench;
    let expected = change(&with, &moved(with));
    assert!(taken.force.x > 5.0 && close(&taken.force, &expected.force, 1e-6), "{taken:?} {expected:?}");
    assert_eq!(drag(Vec3::new(1.0, 0.2, 0.0), 0.0), Vec3::zeros());
    // the world turns with the heading: east seen from a vehicle that looks east is ahead
    let east = |heading: f64| {
        let mut one = effect(Effect::Current, 0.0);
        one.parameters.get_mut("east").unwrap().value = 0.4;
        one.shape = Shape::Current(Current { east_mps: 0.4, ..Current::default() });
        let served = served_with("warthog", effects_file("warthog", vec![one]));
        let told = Circumstances { heading: Some(heading), ..Circumstances::default() };
        load(&evaluate(&served, &Condition::level(Vec3::zeros(), 0.25), &told), Effect::Current).wrench.force
    };
    assert!(east(0.0).x > 1.0 && east(0.0).y.abs() < 1e-9);
    // and from one that looks north it comes from the left
    let north = east(std::f64::consts::FRAC_PI_2);
    let from_the_left = Condition { velocity: Vec3::y() * 0.4, ..parked };
    let expected = change(&parked, &from_the_left).force;
    assert!(north.y < -1.0 && close(&north, &expected, 1e-6), "{north} {expected}");
}

#[test]
fn a_density_error_scales_the_model() {
    let served = only("husky", Effect::DensityError, 0.12);
    let mut forces = Forces::default();
    served.model().evaluate(&busy(), &mut Workspace::new(), &mut forces);
    let loads = evaluate(&served, &busy(), &Circumstances { wheel_speeds: None, ..told() });
    assert!(close(&loads.forces.wrench.force, &(forces.wrench.force * 1.12), 1e-12));
    assert!(close(&loads.forces.wrench.moment, &(forces.wrench.moment * 1.12), 1e-12));
    assert_eq!(loads.forces.surfaces, forces.surfaces, "surfaces keep the model's loads");
}

#[test]
fn a_channel_multiplies_the_drag_by_continuity_and_more_where_the_surface_falls() {
    let (width, depth, faded_at) = (4.0, 0.17, 0.8);
    let mut blockage = effect(Effect::ChannelBlockage, 1.0);
    blockage.shape = Shape::ChannelBlockage(ChannelBlockage::FallingSurface { faded_at });
    blockage.parameters.get_mut("faded_at").unwrap().value = faded_at;
    let served = served_with("husky", effects_file("husky", vec![blockage]));
    let vehicle = served.model().vehicle();
    // share of the channel's section that the hull's mean section takes
    let plane = Condition::level(Vec3::zeros(), depth).water_plane(vehicle.z0);
    let hydrostatics = hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &vehicle.center_of_mass);
    let share = hydrostatics.displaced_volume / (vehicle.dimensions.length * width * depth);
    let bare = ServedVehicle::new(model("husky"), None);
    // of the drag that the model has in the faster flow, as a share of that by continuity
    let more = |froude: f64| {
        let speed = froude * (wade_core::frame::GRAVITY * depth).sqrt();
        let state = Condition::level(Vec3::new(speed, 0.0, 0.0), depth);
        let loads = evaluate(&served, &state, &told());
        let faster = Condition { velocity: state.velocity / (1.0 - share), ..state };
        let in_faster = evaluate(&bare, &faster, &told()).forces.wrench.force.x;
        let by_continuity = in_faster - evaluate(&bare, &state, &told()).forces.wrench.force.x;
        load(&loads, Effect::ChannelBlockage).wrench.force.x / by_continuity
    };
    // slow flow has a level surface, and so has that above the end of the fade
    assert!((more(0.02) - 1.0).abs() < 0.03, "{}", more(0.02));
    assert!((more(0.85) - 1.0).abs() < 0.03, "{}", more(0.85));
    assert!(more(0.4) > 1.1 && more(0.6) > more(0.4), "{} {}", more(0.4), more(0.6));
}

#[test]
fn a_water_level_offset_lifts_by_the_waterplane() {
    let served = only("warthog", Effect::WaterLevelOffset, 0.01);
    let vehicle = served.model().vehicle();
    let state = Condition::level(Vec3::zeros(), 0.2);
    let lift = |depth: f64| {
        let plane = Condition { depth, ..state }.water_plane(vehicle.z0);
        hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &vehicle.center_of_mass).wrench.force.z
    };
    let expected = lift(0.205) - lift(0.195);
    let found = load(&evaluate(&served, &state, &told()), Effect::WaterLevelOffset).wrench.force.z;
    assert!((found / expected - 1.0).abs() < 0.15, "{found} {expected}");
    // from the wheels up to the hull the waterplane grows to several times its area: at its estimate the layer is the whole one
    for offset in [0.05, -0.05] {
        let mut level = effect(Effect::WaterLevelOffset, offset);
        level.shape = Shape::from_numbers(Effect::WaterLevelOffset, [offset, 0.0, 0.0]).unwrap();
        let served = served_with("warthog", effects_file("warthog", vec![level]));
        let found = load(&evaluate(&served, &state, &told()), Effect::WaterLevelOffset).wrench.force.z;
        let expected = lift(0.2 + offset) - lift(0.2);
        assert!((found / expected - 1.0).abs() < 0.03, "{offset}: {found} {expected}");
    }
}

#[test]
fn above_its_box_an_effect_is_that_of_the_edge_and_the_answer_says_so() {
    let mut file = every_effect("husky");
    file.validity.speed_mps = [0.2, 0.5];
    file.validity.depth_m = [0.05, 0.12];
    let served = served_with("husky", file);
    let at = |speed: f64, depth: f64| {
        evaluate(&served, &Condition::level(Vec3::new(speed, 0.0, 0.0), depth), &told())
    };
    let (edge, fast, deep) = (at(0.5, 0.12), at(2.0, 0.12), at(0.5, 0.19));
    assert_eq!(edge.effects.outside, [0.0; 5]);
    assert_eq!(fast.effects.outside, [0.0, 1.5, 0.0, 0.0, 0.0]);
    assert!((deep.effects.outside[0] - 0.07).abs() < 1e-12);
    for (load, other) in edge.effects.loads.iter().zip(fast.effects.loads.iter().chain(&deep.effects.loads)) {
        // the model's own wrench, which a density error scales, is that of the state
        if load.effect != Effect::DensityError {
            assert!(close(&load.wrench.force, &other.wrench.force, 1e-12), "{}", load.effect.name());
        }
    }
    assert!(fast.forces.surfaces != edge.forces.surfaces, "the model itself is not moved");
}

#[test]
fn what_cannot_be_told_is_left_out_and_named() {
    let served = served_with("husky", every_effect("husky"));
    let state = Condition::level(Vec3::new(0.5, 0.0, 0.0), 0.15);
    let why = |condition: &Condition, told: &Circumstances, session: Option<&mut Session>| {
        let mut loads = Loads::default();
        served.evaluate(condition, told, session, &mut loads);
        let left = loads.effects.loads.iter().filter_map(|load| Some((load.effect.name(), load.left_out?)));
        let left: Vec<_> = left.collect();
        let zero = loads.effects.loads.iter().filter(|load| load.left_out.is_some());
        zero.for_each(|load| assert_eq!(load.wrench, Wrench::default()));
        left
    };
    let nothing = why(&state, &Circumstances::default(), None);
    assert_eq!(
        nothing,
        [
            ("current", LeftOut::NoHeading),
            ("hull_flooding", LeftOut::NoSession),
            ("water_entry_slamming", LeftOut::NoDepthRate),
            ("wave_memory", LeftOut::NoSession),
            ("wheel_paddle_thrust", LeftOut::NoWheelSpeeds),
        ]
    );
    assert_eq!(why(&state, &told(), Some(&mut Session::default())), []);
    let stated = Condition { ground_velocity: Vec3::zeros(), ..state };
    assert_eq!(why(&stated, &told(), Some(&mut Session::default())), [("current", LeftOut::CurrentStated)]);
    // in a session the depth says how fast it changes, from its second state on
    let mut session = Session::default();
    let silent = Circumstances { depth_rate: None, time_step: 0.1, ..told() };
    assert_eq!(why(&state, &silent, Some(&mut session)), [("water_entry_slamming", LeftOut::NoDepthRate)]);
    assert_eq!(why(&Condition { depth: 0.17, ..state }, &silent, Some(&mut session)), []);
    let mut loads = Loads::default();
    served.evaluate(&state, &silent, Some(&mut session), &mut loads);
    assert_eq!(load(&loads, Effect::WaterEntrySlamming).wrench.force.z, 0.0, "it comes out of the water");
}

#[test]
fn a_hull_floods_along_a_session_and_a_step_of_no_time_changes_nothing() {
    let served = only("husky", Effect::HullFlooding, 0.4);
    let state = Condition::level(Vec3::zeros(), 0.16);
    let mut session = Session::default();
    let mut lost = |time_step: f64| {
        let mut loads = Loads::default();
        let told = Circumstances { time_step, ..Circumstances::default() };
        served.evaluate(&state, &told, Some(&mut session), &mut loads);
        -load(&loads, Effect::HullFlooding).wrench.force.z
    };
    assert_eq!(lost(0.0), 0.0, "dry at first");
    // Torricelli: full after sqrt(h) / (r sqrt(g / 2)) seconds, three quarters at half that time
    let full = 0.16_f64.sqrt() / (0.01 * (0.5 * 9.81_f64).sqrt());
    let half = lost(0.5 * full);
    assert_eq!(lost(0.0), half);
    let whole = lost(full);
    assert!((half / whole - 0.75).abs() < 1e-9, "{half} {whole}");
    assert!(whole > 1.0);
}
