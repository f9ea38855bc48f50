//! The attitude afloat of boxes whose center of mass lies aside, by the formula of a wall-sided hull.

#![allow(clippy::unwrap_used)]

use wade_core::condition::FRESH_WATER;
use wade_import::{Imported, Options};

use crate::write::{Folder, import, urdf};

const MASS: f64 = 60.0;

/// A box of 1 x 0.6 x 0.3 m with its center of mass here, from its center.
fn with_center_of_mass(x: f64, y: f64, z: f64) -> Imported {
    let text = format!(
        "<link name=\"base\"><inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{MASS}\"/>\
         <inertia ixx=\"2\" iyy=\"5\" izz=\"6\"/></inertial>\
         <visual><geometry><box size=\"1 0.6 0.3\"/></geometry></visual></link>"
    );
    let folder = Folder::new();
    import(&[folder.write("robot.urdf", urdf(&text))], Options::default()).unwrap()
}

/// Angle at which the couple of a wall-sided box, `sin t (GM + BM tan2 t / 2)`, balances an offset of the center of mass
/// (K. J. Rawson and E. C. Tupper, Basic Ship Theory, chapter 4).
fn wall_sided(offset: f64, length: f64, below_center: f64) -> f64 {
    let draft = MASS / (FRESH_WATER * 0.6);
    let metacenter = length * length / (12.0 * draft);
    let height = metacenter + 0.5 * draft - (0.15 - below_center);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let tan: f64 = 0.5 * (low + high);
        if tan * (height + 0.5 * metacenter * tan * tan) < offset { low = tan } else { high = tan }
    }
    low.atan()
}

#[test]
fn a_large_trim_is_that_of_the_tilted_hull() {
    let pitch = wall_sided(0.13, 1.0, 0.05);
    assert!((0.1..0.19).contains(&pitch), "beyond the linear range, the deck dry: {pitch}");
    let floating = with_center_of_mass(0.13, 0.0, -0.05).floating;
    assert!((floating.pitch.unwrap() - pitch).abs() < 1e-4, "{floating:?} {pitch}");
    let floating = with_center_of_mass(-0.13, 0.0, -0.05).floating;
    assert!((floating.pitch.unwrap() + pitch).abs() < 1e-4, "{floating:?} {pitch}");
}

#[test]
fn angles_afloat_lie_within_half_a_turn() {
    // far before the bow: the box hangs on its end, by its symmetry at a right angle
    for (x, expected) in [(5.0, 90.0), (-5.0, -90.0)] {
        let imported = with_center_of_mass(x, 0.0, 0.0);
        let pitch = imported.floating.pitch.unwrap().to_degrees();
        assert!((pitch - expected).abs() < 0.01, "{pitch} {expected}");
        let words = if x > 0.0 { "90.0 degrees nose down" } else { "90.0 degrees nose up" };
        assert!(imported.warnings.iter().any(|said| said.contains(words)), "{:?}", imported.warnings);
    }
    for y in [-3.0, -0.5, 0.5, 3.0] {
        let roll = with_center_of_mass(0.0, y, 0.1).floating.roll;
        // a hull that the center of mass would tip over has none
        assert!(roll.is_none_or(|roll| roll.abs() <= std::f64::consts::PI), "{y} {roll:?}");
    }
}
