//! Wheels: found by their joints, measured, and questioned.

#![allow(clippy::unwrap_used)]

use wade_import::{Imported, Options};

use crate::write::{Folder, import, joint, link, urdf};

fn with(geometry: &str, axis: &str) -> Imported {
    let folder = Folder::new();
    let body = link("base", "xyz=\"0 0 0.1\"", "<box size=\"0.4 0.2 0.1\"/>")
        + &link("turning", "rpy=\"1.5707963267948966 0 0\"", geometry)
        + &joint(
            "continuous",
            "base",
            "turning",
            &format!("<origin xyz=\"0.1 0.15 0.06\"/><axis xyz=\"{axis}\"/>"),
        );
    let file = folder.write("robot.urdf", urdf(&body));
    import(&[file], Options { mass: Some(2.0), ..Options::default() }).unwrap()
}

#[test]
fn a_wheel_that_is_no_cylinder_is_said() {
    let imported = with("<box size=\"0.1 0.1 0.04\"/>", "0 1 0");
    assert_eq!(imported.wheels.len(), 1);
    let said = imported.warnings.iter().find(|warning| warning.contains("no cylinder")).unwrap();
    assert!(said.contains("turning") && said.contains("to 0.0707 m"), "{said}");
    // half an edge over half a diagonal
    assert!((imported.wheels[0].roundness - 0.5_f64.sqrt()).abs() < 0.02, "{:?}", imported.wheels);
    let round = with("<cylinder radius=\"0.05\" length=\"0.04\"/>", "0 1 0");
    assert!(!round.warnings.iter().any(|warning| warning.contains("no cylinder")), "{:?}", round.warnings);
}

#[test]
fn what_turns_about_another_axis_is_no_wheel() {
    let imported = with("<cylinder radius=\"0.05\" length=\"0.04\"/>", "0 0 1");
    assert!(imported.wheels.is_empty());
    assert!(imported.notes.iter().any(|note| note.contains("is no wheel")), "{:?}", imported.notes);
}

#[test]
fn a_tire_fixed_to_a_hub_that_turns_is_the_wheel() {
    let folder = Folder::new();
    let mut body = link("base", "", "<box size=\"0.4 0.2 0.1\"/>");
    for index in 0..10 {
        let (hub, tire) = (format!("hub{index}"), format!("tire{index}"));
        let x = 0.18 - 0.04 * f64::from(index / 2) * 2.0;
        let y = if index % 2 == 0 { 0.13 } else { -0.13 };
        body += &format!("<link name=\"{hub}\"/>");
        body += &link(&tire, "rpy=\"1.5707963267948966 0 0\"", "<cylinder radius=\"0.03\" length=\"0.03\"/>");
        body += &joint(
            "continuous",
            "base",
            &hub,
            &format!("<origin xyz=\"{x} {y} -0.05\"/><axis xyz=\"0 1 0\"/>"),
        );
        body += &joint("fixed", &hub, &tire, "");
    }
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(2.0), ..Options::default() }).unwrap();
    assert_eq!(imported.wheels.len(), 10, "wheels beyond four");
    let last = &imported.wheels[9];
    assert_eq!((last.name.as_str(), last.source.as_str()), ("wheel_right_5", "hub9"));
    let surface = imported.vehicle.surfaces.iter().find(|surface| surface.name == "wheel_left_3").unwrap();
    assert_eq!(imported.vehicle.surfaces[surface.mirror_left_right].name, "wheel_right_3");
}
