//! Mass, center of mass and inertia of all links in one frame.

#![allow(clippy::unwrap_used)]

use nalgebra::Matrix3;
use wade_core::frame::Vec3;
use wade_import::Options;

use crate::write::{Folder, import, urdf};

/// Two blocks of which one is turned and moved.
const TWO: &str = "<link name=\"a\"><inertial><mass value=\"2\"/><inertia ixx=\"0.1\" iyy=\"0.2\" izz=\"0.25\"/></inertial>
  <visual><geometry><box size=\"0.4 0.2 0.2\"/></geometry></visual></link>
 <link name=\"b\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.02\" izz=\"0.025\"/></inertial>
  <visual><geometry><box size=\"0.2 0.1 0.1\"/></geometry></visual></link>
 <joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 0 0.15\" rpy=\"0 0 1.5707963267948966\"/></joint>";

#[test]
fn links_add_up_in_the_body_frame() {
    let folder = Folder::new();
    let file = folder.write("robot.urdf", urdf(TWO));
    let vehicle = import(std::slice::from_ref(&file), Options::default()).unwrap().vehicle;
    assert!((vehicle.mass - 3.0).abs() < 1e-12);
    // b's center is (0, 0.1, 0.15) in the frame of a; the box around both reaches from z = -0.1 to 0.2
    let center = Vec3::new(0.0, 0.1 / 3.0, 0.15 / 3.0) - Vec3::new(0.0, 0.0, 0.05);
    assert!((vehicle.center_of_mass - center).norm() < 1e-6, "{}", vehicle.center_of_mass);
    // by hand: b turned by 90 degrees swaps xx and yy; reduced mass 2/3 kg at (0, 0.1, 0.15)
    let moved = Matrix3::new(0.0325, 0.0, 0.0, 0.0, 0.0225, -0.015, 0.0, -0.015, 0.01) * (2.0 / 3.0);
    let expected = Matrix3::from_diagonal(&Vec3::new(0.12, 0.21, 0.275)) + moved;
    assert!((vehicle.inertia - expected).norm() < 1e-9, "{}", vehicle.inertia);
    // another mass scales the inertia
    let heavy = import(&[file], Options { mass: Some(6.0), ..Options::default() }).unwrap().vehicle;
    assert!((heavy.inertia - expected * 2.0).norm() < 1e-9 && heavy.mass == 6.0);
}

#[test]
fn what_no_file_states_is_assumed_and_said() {
    let folder = Folder::new();
    let file = folder.write(
        "robot.urdf",
        urdf("<link name=\"a\"><visual><geometry><box size=\"0.5 0.2 0.1\"/></geometry></visual></link>"),
    );
    let imported = import(&[file], Options::default()).unwrap();
    assert!((imported.vehicle.mass - 4.0).abs() < 1e-5, "400 kg a cubic meter");
    for part in ["no file states a mass", "no file states a center of mass"] {
        assert!(imported.warnings.iter().any(|warning| warning.contains(part)), "{:?}", imported.warnings);
    }
    assert!((imported.floating.depth.unwrap() - 0.04).abs() < 1e-5);
}

#[test]
fn an_inertia_that_no_body_has_is_replaced_and_said() {
    let folder = Folder::new();
    let file = folder.write("robot.urdf", urdf(&TWO.replace("izz=\"0.25\"", "izz=\"2.5\"")));
    let imported = import(&[file], Options::default()).unwrap();
    assert!(imported.warnings.iter().any(|warning| warning.contains("inertia")), "{:?}", imported.warnings);
}

#[test]
fn a_link_that_carries_the_mass_of_another_is_not_said_to_lack_it() {
    let folder = Folder::new();
    // as Clearpath's robots have it: the base has the shape, a link fixed to it the mass
    let body = "<link name=\"base\"><visual><geometry><box size=\"0.4 0.2 0.2\"/></geometry></visual></link>
      <link name=\"inertial\"><inertial><mass value=\"5\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>
      <joint name=\"j\" type=\"fixed\"><parent link=\"base\"/><child link=\"inertial\"/></joint>
      <link name=\"arm\"><visual><geometry><box size=\"0.1 0.1 0.1\"/></geometry></visual></link>
      <joint name=\"k\" type=\"prismatic\"><parent link=\"base\"/><child link=\"arm\"/></joint>";
    let file = folder.write("robot.urdf", urdf(body));
    let imported = import(&[file], Options::default()).unwrap();
    let said: Vec<&String> =
        imported.warnings.iter().filter(|warning| warning.contains("without a mass")).collect();
    assert!(said.len() == 1 && said[0].ends_with(": arm"), "{:?}", imported.warnings);
}
