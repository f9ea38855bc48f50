//! Displaced volume of robots of known volume, against a count on a 2 mm grid by formula.

#![allow(clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;

use wade_core::frame::Vec3;
use wade_import::{Imported, Options, Shapes};

use crate::solids::{Solid, at, count, turned};
use crate::write::{Folder, block, gltf, import, joint, link, obj, placed, ring, stl, tub, urdf};

/// Share by which the import may miss the count.
const TOLERANCE: f64 = 0.01;

const HALF_TURN: [f64; 3] = [FRAC_PI_2, 0.0, 0.0];

fn assert_volume(imported: &Imported, expected: f64) {
    let volume = imported.floating.displaced_volume;
    println!(
        "{:.4} l, counted {:.4} l, {:+.3} %",
        volume * 1e3,
        expected * 1e3,
        100.0 * (volume / expected - 1.0)
    );
    assert!((volume / expected - 1.0).abs() < TOLERANCE, "{volume} {expected}");
    assert!(wade_core::geometry::watertight::is_closed(&imported.vehicle.hull.mesh), "closed after rounding");
}

fn names(imported: &Imported) -> Vec<&str> {
    imported.vehicle.surfaces.iter().map(|surface| surface.name.as_str()).collect()
}

fn cuboid(x: f64, y: f64, z: f64) -> Solid {
    Solid::Box(Vec3::new(x, y, z) * 0.5)
}

#[test]
fn one_overlapping_boxes_count_once() {
    let folder = Folder::new();
    let body = link("base", "", "<box size=\"0.3 0.2 0.1\"/>")
        + &link("mast", "xyz=\"0.05 0 0.06\"", "<box size=\"0.06 0.06 0.12\"/>")
        + &link("bar", "xyz=\"0 0 0.02\" rpy=\"0 0.3 0\"", "<box size=\"0.4 0.03 0.03\"/>")
        + &joint("fixed", "base", "mast", "")
        + &joint("fixed", "base", "bar", "");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(3.0), ..Options::default() }).unwrap();
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.3, 0.2, 0.1)),
        (at(0.05, 0.0, 0.06), cuboid(0.06, 0.06, 0.12)),
        (turned([0.0, 0.0, 0.02], [0.0, 0.3, 0.0]), cuboid(0.4, 0.03, 0.03)),
    ];
    assert_volume(&imported, count(&shapes, 0.22));
    assert!(imported.notes.iter().any(|note| note.contains("overlap by")), "{:?}", imported.notes);
    assert_eq!(names(&imported), ["front", "rear", "left", "right", "bottom"]);
}

/// Four wheels of a car that reach into its chassis.
fn car(wheel: &str, inside: &str) -> String {
    let mut body = link("base", "xyz=\"0 0 0.07\"", "<box size=\"0.36 0.2 0.08\"/>");
    for (name, x, y) in [("fl", 0.12, 0.1), ("fr", 0.12, -0.1), ("rl", -0.12, 0.1), ("rr", -0.12, -0.1)] {
        body += &link(&format!("wheel_{name}"), "rpy=\"1.5707963267948966 0 0\"", wheel);
        let origin = format!("<origin xyz=\"{x} {y} 0.05\"/>{inside}");
        body += &joint("continuous", "base", &format!("wheel_{name}"), &origin);
    }
    body
}

fn four(solid: Solid) -> Vec<(nalgebra::Isometry3<f64>, Solid)> {
    let wheel = |x: f64, y: f64| (turned([x, y, 0.05], HALF_TURN), solid);
    vec![
        (at(0.0, 0.0, 0.07), cuboid(0.36, 0.2, 0.08)),
        wheel(0.12, 0.1),
        wheel(0.12, -0.1),
        wheel(-0.12, 0.1),
        wheel(-0.12, -0.1),
    ]
}

#[test]
fn two_wheels_that_reach_into_the_chassis_are_surfaces_of_their_own() {
    let folder = Folder::new();
    let body = car("<cylinder radius=\"0.05\" length=\"0.06\"/>", "<axis xyz=\"0 1 0\"/>");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(3.0), ..Options::default() }).unwrap();
    assert_volume(&imported, count(&four(Solid::Ring(0.0, 0.05, 0.03)), 0.2));
    let wheels = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];
    assert_eq!(names(&imported)[5..], wheels);
    assert_eq!(imported.wheels.iter().map(|w| w.source.as_str()).collect::<Vec<_>>(), wheels);
    for wheel in &imported.wheels {
        assert!((wheel.radius - 0.05).abs() < 1e-9 && (wheel.width - 0.06).abs() < 1e-9, "{wheel:?}");
        assert!(wheel.roundness > 0.99, "{wheel:?}");
    }
}

#[test]
fn three_wheel_rims_stay_open() {
    let folder = Folder::new();
    folder.write("meshes/rim.stl", stl(&ring(0.035, 0.05, 0.02, 96)));
    let body = car("<mesh filename=\"package://robot/meshes/rim.stl\"/>", "<axis xyz=\"0 -1 0\"/>");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(3.0), ..Options::default() }).unwrap();
    assert_volume(&imported, count(&four(Solid::Ring(0.035, 0.05, 0.02)), 0.2));
    assert_eq!(imported.wheels.len(), 4);
}

#[test]
fn four_a_hollow_tub_stays_hollow() {
    let folder = Folder::new();
    let half = [0.15, 0.1, 0.06];
    let file = folder.write("tub.stl", stl(&tub(half, 0.006)));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    assert_volume(&imported, count(&[(at(0.0, 0.0, 0.0), Solid::Tub(half.into(), 0.006))], 0.16));
    let said = imported.warnings.iter().find(|warning| warning.contains("convex hull")).unwrap();
    assert!(said.contains("open to the water"), "{said}");
}

#[test]
fn five_a_gap_of_three_millimeters_stays_a_gap() {
    let folder = Folder::new();
    let body = link("base", "", "<box size=\"0.2 0.2 0.1\"/>")
        + &link("box", "", "<box size=\"0.1 0.2 0.1\"/>")
        + &joint("fixed", "base", "box", "<origin xyz=\"0.153 0 0\"/>");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(3.0), ..Options::default() }).unwrap();
    let shapes = [(at(0.0, 0.0, 0.0), cuboid(0.2, 0.2, 0.1)), (at(0.153, 0.0, 0.0), cuboid(0.1, 0.2, 0.1))];
    assert_volume(&imported, count(&shapes, 0.22));
    assert!((imported.vehicle.dimensions.length - 0.303).abs() < 1e-6);
}

#[test]
fn six_links_of_links_stand_where_their_joints_put_them() {
    let folder = Folder::new();
    let arm = "<box size=\"0.12 0.03 0.03\"/>";
    let origin = "<origin xyz=\"0.1 0.02 0\" rpy=\"0.2 -0.5 0.7\"/>";
    let body = link("base", "", "<box size=\"0.1 0.1 0.1\"/>")
        + &link("a", "xyz=\"0.05 0 0\"", arm)
        + &link("b", "xyz=\"0.05 0 0\"", arm)
        + &link("c", "xyz=\"0.05 0 0\"", arm)
        + &joint("fixed", "base", "a", origin)
        + &joint(
            "revolute",
            "a",
            "b",
            &format!("{origin}<axis xyz=\"0 0 1\"/><limit lower=\"-1\" upper=\"1\"/>"),
        )
        + &joint("prismatic", "b", "c", origin);
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    let step = turned([0.1, 0.02, 0.0], [0.2, -0.5, 0.7]);
    let middle = at(0.05, 0.0, 0.0);
    let arm = cuboid(0.12, 0.03, 0.03);
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.1, 0.1, 0.1)),
        (step * middle, arm),
        (step * step * middle, arm),
        (step * step * step * middle, arm),
    ];
    assert_volume(&imported, count(&shapes, 0.36));
}

#[test]
fn seven_scaled_and_mirrored_meshes_stay_outward() {
    let folder = Folder::new();
    // a block off its origin, so that a mirror image is elsewhere
    let mesh = placed(&block([0.05, 0.03, 0.02]), &at(0.1, 0.08, 0.0), 1.0);
    folder.write("part.stl", stl(&mesh));
    let body = link("base", "", "<box size=\"0.2 0.1 0.06\"/>")
        + &link("left", "", "<mesh filename=\"part.stl\" scale=\"1 1 1.5\"/>")
        + &link("right", "", "<mesh filename=\"part.stl\" scale=\"1 -1 1.5\"/>")
        + &joint("fixed", "base", "left", "")
        + &joint("fixed", "base", "right", "");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    let part = cuboid(0.1, 0.06, 0.06);
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.2, 0.1, 0.06)),
        (at(0.1, 0.08, 0.0), part),
        (at(0.1, -0.08, 0.0), part),
    ];
    assert_volume(&imported, count(&shapes, 0.17));
    assert!(!imported.warnings.iter().any(|warning| warning.contains("inward")), "{:?}", imported.warnings);
}

#[test]
fn eight_a_plain_stl_in_millimeters_is_a_vehicle_in_meters() {
    let folder = Folder::new();
    let mut mesh = placed(&block([0.2, 0.1, 0.04]), &at(0.0, 0.0, 0.1), 1000.0);
    let mut shapes = vec![(at(0.0, 0.0, 0.1), cuboid(0.4, 0.2, 0.08))];
    for (x, y) in [(0.14, 0.13), (0.14, -0.13), (-0.14, 0.13), (-0.14, -0.13), (0.0, 0.13), (0.0, -0.13)] {
        let pose = turned([x, y, 0.06], HALF_TURN);
        mesh.append(&placed(&ring(0.01, 0.06, 0.02, 96), &pose, 1000.0));
        shapes.push((pose, Solid::Ring(0.01, 0.06, 0.02)));
    }
    // left and right are those of the vehicle, wherever the origin of the file is
    let mesh = placed(&mesh, &at(0.0, 2000.0, 0.0), 1.0);
    let file = folder.write("rover.stl", stl(&mesh));
    let imported = import(&[file], Options { mass: Some(4.0), ..Options::default() }).unwrap();
    assert_volume(&imported, count(&shapes, 0.22));
    assert!(imported.notes.iter().any(|note| note.contains("unit: millimeters")), "{:?}", imported.notes);
    assert!((imported.vehicle.dimensions.length - 0.4).abs() < 1e-6);
    let wheels =
        ["left_1", "right_1", "left_2", "right_2", "left_3", "right_3"].map(|n| format!("wheel_{n}"));
    assert_eq!(names(&imported)[5..], wheels);
}

#[test]
fn axes_of_a_file_without_convention_are_guessed_from_its_wheels() {
    let folder = Folder::new();
    let mut parts = vec![block([0.2, 0.1, 0.04])];
    for (x, y) in [(0.14, 0.13), (0.14, -0.13), (-0.14, 0.13), (-0.14, -0.13)] {
        parts.push(placed(&ring(0.01, 0.06, 0.02, 96), &turned([x, y, -0.04], HALF_TURN), 1.0));
    }
    // y up and z forward, as many modelers have it
    let turn = |v: &Vec3| Vec3::new(v.y, v.z, v.x);
    let turned: Vec<(&str, wade_core::geometry::mesh::Mesh)> = parts
        .iter()
        .map(|mesh| {
            let vertices = mesh.vertices.iter().map(turn).collect();
            ("part", wade_core::geometry::mesh::Mesh { vertices, faces: mesh.faces.clone() })
        })
        .collect();
    let file = folder.write("rover.obj", obj(&turned));
    let imported = import(&[file], Options { mass: Some(4.0), ..Options::default() }).unwrap();
    let note = imported.notes.iter().find(|note| note.contains("guessed from 4 parts")).unwrap();
    assert!(note.contains("z points forward and y up"), "{note}");
    assert_eq!(names(&imported)[5..], ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"]);
    assert!((imported.vehicle.dimensions.length - 0.4).abs() < 1e-6);
}

#[test]
fn nine_a_gltf_is_y_up_and_looks_along_z() {
    let folder = Folder::new();
    let file = gltf(&[
        ("body", block([0.1, 0.05, 0.2]), ""),
        ("mast", block([0.02, 0.1, 0.02]), ",\"translation\":[0,0.1,0.1]"),
        (
            "fin",
            block([0.1, 0.02, 0.02]),
            ",\"translation\":[0.1,0,0],\"rotation\":[0,0,0.3826834,0.9238795]",
        ),
        ("twin", block([0.05, 0.01, 0.02]), ",\"translation\":[-0.1,0,0],\"scale\":[-2,2,1]"),
    ]);
    let file = folder.write("robot.gltf", file);
    let imported = import(&[file], Options { mass: Some(4.0), ..Options::default() }).unwrap();
    // x forward is z of the file, y left is x, z up is y
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.4, 0.2, 0.1)),
        (at(0.1, 0.0, 0.1), cuboid(0.04, 0.04, 0.2)),
        (turned([0.0, 0.1, 0.0], [std::f64::consts::FRAC_PI_4, 0.0, 0.0]), cuboid(0.04, 0.2, 0.04)),
        (at(0.0, -0.1, 0.0), cuboid(0.04, 0.2, 0.04)),
    ];
    assert_volume(&imported, count(&shapes, 0.22));
    assert!((imported.vehicle.dimensions.length - 0.4).abs() < 1e-6, "{:?}", imported.vehicle.dimensions);
}

#[test]
fn ten_an_mjcf_nests_bodies_and_names_sizes_by_halves() {
    let folder = Folder::new();
    folder.write("assets/wheel.stl", stl(&ring(0.01, 0.04, 0.015, 96)));
    let text = "<mujoco><compiler meshdir=\"assets\" angle=\"degree\"/>
      <default><geom density=\"500\"/><default class=\"wheel\"><joint axis=\"0 0 1\"/><geom type=\"mesh\" mesh=\"wheel\"/></default></default>
      <asset><mesh name=\"wheel\" file=\"wheel.stl\"/></asset>
      <worldbody><geom type=\"plane\" size=\"5 5 1\"/>
       <body name=\"base\" pos=\"0 0 3\"><freejoint/>
        <geom type=\"box\" size=\"0.15 0.08 0.03\"/>
        <geom type=\"capsule\" size=\"0.02\" fromto=\"-0.1 0 0.02 0.1 0 0.1\"/>
        <body name=\"front_left\" pos=\"0.1 0.1 -0.03\" euler=\"-90 0 0\" childclass=\"wheel\"><joint name=\"fl\"/><geom/></body>
        <body name=\"front_right\" pos=\"0.1 -0.1 -0.03\" euler=\"-90 0 0\" childclass=\"wheel\"><joint name=\"fr\"/><geom/></body>
        <body name=\"caster\" pos=\"-0.12 0 -0.05\"><joint type=\"ball\"/><geom type=\"sphere\" size=\"0.02\"/></body>
       </body></worldbody></mujoco>";
    let file = folder.write("robot.xml", text);
    let imported = import(&[file], Options::default()).unwrap();
    let (from, to) = (Vec3::new(-0.1, 0.0, 0.02), Vec3::new(0.1, 0.0, 0.1));
    let tilt = (to - from).x.atan2((to - from).z);
    let wheel = Solid::Ring(0.01, 0.04, 0.015);
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.3, 0.16, 0.06)),
        (turned([0.0, 0.0, 0.06], [0.0, tilt, 0.0]), Solid::Capsule(0.02, 0.5 * (to - from).norm())),
        (turned([0.1, 0.1, -0.03], HALF_TURN), wheel),
        (turned([0.1, -0.1, -0.03], HALF_TURN), wheel),
        (at(-0.12, 0.0, -0.05), Solid::Ellipsoid(Vec3::repeat(0.02))),
    ];
    let volume = count(&shapes, 0.17);
    assert_volume(&imported, volume);
    assert_eq!(names(&imported)[5..], ["wheel_left_1", "wheel_right_1"]);
    // parts of even density, the overlap counts for each
    assert!(imported.vehicle.mass > 500.0 * volume && imported.vehicle.mass < 520.0 * volume);
}

#[test]
fn eleven_an_sdf_places_links_relative_to_each_other() {
    let folder = Folder::new();
    let text = "<?xml version=\"1.0\"?><sdf version=\"1.9\"><world name=\"w\"><model name=\"ground\"><link name=\"l\">
      <collision name=\"c\"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link></model>
      <model name=\"boat\"><pose>5 5 5 0 0 1</pose>
      <frame name=\"mount\"><pose>0.1 0 0.05 0 0 0.5</pose></frame>
      <link name=\"hull\"><inertial><mass>2</mass></inertial>
       <visual name=\"v\"><geometry><ellipsoid><radii>0.2 0.1 0.06</radii></ellipsoid></geometry></visual>
       <visual name=\"w\"><pose degrees=\"true\">0 0 0.03 0 0 90</pose><geometry><box><size>0.04 0.3 0.02</size></box></geometry></visual>
      </link>
      <link name=\"mast\"><pose relative_to=\"mount\">0 0 0.05 0 0.4 0</pose>
       <visual name=\"v\"><geometry><cylinder><radius>0.015</radius><length>0.2</length></cylinder></geometry></visual></link>
      <joint name=\"j\" type=\"fixed\"><parent>hull</parent><child>mast</child></joint>
      </model></world></sdf>";
    let file = folder.write("boat.sdf", text);
    let imported = import(&[file], Options::default()).unwrap();
    let mount = turned([0.1, 0.0, 0.05], [0.0, 0.0, 0.5]);
    let shapes = [
        (at(0.0, 0.0, 0.0), Solid::Ellipsoid(Vec3::new(0.2, 0.1, 0.06))),
        (turned([0.0, 0.0, 0.03], [0.0, 0.0, FRAC_PI_2]), cuboid(0.04, 0.3, 0.02)),
        (mount * turned([0.0, 0.0, 0.05], [0.0, 0.4, 0.0]), Solid::Ring(0.0, 0.015, 0.1)),
    ];
    assert_volume(&imported, count(&shapes, 0.24));
    assert!((imported.vehicle.mass - 2.0).abs() < 1e-12);
}

#[test]
fn twelve_an_obj_in_inches_with_touching_and_nested_parts() {
    let folder = Folder::new();
    let inch = 1.0 / 0.0254;
    // one on the other, one wholly inside, one across both
    let parts = [
        ("low", placed(&block([0.1, 0.1, 0.04]), &at(0.0, 0.0, 0.0), inch)),
        ("high", placed(&block([0.06, 0.1, 0.04]), &at(0.0, 0.0, 0.08), inch)),
        ("engine", placed(&block([0.03, 0.03, 0.02]), &at(0.0, 0.0, 0.0), inch)),
        (
            "tube",
            placed(&ring(0.0075, 0.015, 0.15, 64), &turned([0.0, 0.0, 0.04], [0.3, FRAC_PI_2, 0.0]), inch),
        ),
    ];
    let file = folder.write("robot.obj", obj(&parts));
    let options = Options { mass: Some(4.0), scale: Some(0.0254), ..Options::default() };
    let imported = import(&[file], options).unwrap();
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.2, 0.2, 0.08)),
        (at(0.0, 0.0, 0.08), cuboid(0.12, 0.2, 0.08)),
        (turned([0.0, 0.0, 0.04], [0.3, FRAC_PI_2, 0.0]), Solid::Ring(0.0075, 0.015, 0.15)),
    ];
    assert_volume(&imported, count(&shapes, 0.17));
}

#[test]
fn a_cavity_that_no_water_reaches_is_displaced_and_said() {
    let folder = Folder::new();
    let mut mesh = block([0.1, 0.1, 0.05]);
    let mut inner = block([0.09, 0.09, 0.04]);
    inner.faces.iter_mut().for_each(|face| face.swap(1, 2));
    mesh.append(&inner);
    let file = folder.write("box.stl", stl(&mesh));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    assert!((imported.floating.displaced_volume - 0.004).abs() < 1e-6, "{:?}", imported.floating);
    assert!(
        imported.warnings.iter().any(|w| w.contains("closed cavity of 2.592 l")),
        "{:?}",
        imported.warnings
    );
}

#[test]
fn an_open_visual_gives_way_to_the_collision_shape_and_says_so() {
    let folder = Folder::new();
    let mut open = block([0.1, 0.05, 0.05]);
    open.faces.pop();
    folder.write("open.stl", stl(&open));
    let body = "<link name=\"base\"><visual><geometry><mesh filename=\"open.stl\"/></geometry></visual>
      <collision><geometry><box size=\"0.2 0.1 0.1\"/></geometry></collision></link>";
    let file = folder.write("robot.urdf", urdf(body));
    let options = |shapes| Options { mass: Some(1.0), shapes, ..Options::default() };
    let imported = import(std::slice::from_ref(&file), options(Shapes::Auto)).unwrap();
    assert!((imported.floating.displaced_volume - 0.002).abs() < 1e-6);
    assert!(
        imported.warnings.iter().any(|warning| warning.contains("is not closed")),
        "{:?}",
        imported.warnings
    );
    let error = import(&[file], options(Shapes::Visual)).unwrap_err().to_string();
    assert!(error.contains("link `base`, open.stl: not closed") && error.contains("--seal"), "{error}");
}

/// A box of quadrilaterals in centimeters with y up, in a node that is moved.
const COLLADA: &str = "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">
 <asset><unit name=\"centimeter\" meter=\"0.01\"/><up_axis>Y_UP</up_axis></asset>
 <library_geometries><geometry id=\"g\"><mesh>
  <source id=\"p\"><float_array id=\"a\" count=\"24\">-10 -2 -5 10 -2 -5 10 2 -5 -10 2 -5 -10 -2 5 10 -2 5 10 2 5 -10 2 5</float_array></source>
  <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>
  <polylist count=\"6\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><input semantic=\"NORMAL\" source=\"#n\" offset=\"1\"/>
   <vcount>4 4 4 4 4 4</vcount>
   <p>0 0 3 0 2 0 1 0 4 0 5 0 6 0 7 0 0 0 1 0 5 0 4 0 2 0 3 0 7 0 6 0 0 0 4 0 7 0 3 0 1 0 2 0 6 0 5 0</p></polylist>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id=\"s\"><node id=\"n\"><translate>0 10 0</translate><scale>1 1 2</scale>
  <instance_geometry url=\"#g\"/></node></visual_scene></library_visual_scenes></COLLADA>";

#[test]
fn a_collada_mesh_of_a_link_keeps_its_unit_and_axes() {
    let folder = Folder::new();
    folder.write("part.dae", COLLADA);
    let body = link("base", "", "<box size=\"0.1 0.1 0.3\"/>")
        + &link("part", "", "<mesh filename=\"part.dae\"/>")
        + &joint("fixed", "base", "part", "");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    // 0.2 m along x, 0.2 m along y of the link, which is -z of the file, 0.04 m high, 0.1 m up
    let shapes = [(at(0.0, 0.0, 0.0), cuboid(0.1, 0.1, 0.3)), (at(0.0, 0.0, 0.1), cuboid(0.2, 0.2, 0.04))];
    assert_volume(&imported, count(&shapes, 0.16));
}

#[test]
fn shells_of_one_mesh_that_cross_count_once() {
    let folder = Folder::new();
    let mut mesh = block([0.1, 0.05, 0.04]);
    mesh.append(&placed(&block([0.03, 0.03, 0.1]), &turned([0.02, 0.0, 0.0], [0.1, 0.2, 0.3]), 1.0));
    folder.write("both.stl", stl(&mesh));
    let file = folder.write("robot.urdf", urdf(&link("base", "", "<mesh filename=\"both.stl\"/>")));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.2, 0.1, 0.08)),
        (turned([0.02, 0.0, 0.0], [0.1, 0.2, 0.3]), cuboid(0.06, 0.06, 0.2)),
    ];
    assert_volume(&imported, count(&shapes, 0.14));
}

#[test]
fn touching_and_equal_shapes_count_once() {
    let folder = Folder::new();
    let body = link("base", "", "<box size=\"0.2 0.1 0.1\"/>")
        + &link("twin", "", "<box size=\"0.2 0.1 0.1\"/>")
        + &link("deck", "xyz=\"0 0 0.06\"", "<box size=\"0.2 0.1 0.02\"/>")
        + &link("ball", "xyz=\"0.1 0 0\"", "<sphere radius=\"0.05\"/>")
        + &joint("fixed", "base", "twin", "")
        + &joint("fixed", "base", "deck", "")
        + &joint("fixed", "base", "ball", "");
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
    let shapes = [
        (at(0.0, 0.0, 0.0), cuboid(0.2, 0.1, 0.1)),
        (at(0.0, 0.0, 0.06), cuboid(0.2, 0.1, 0.02)),
        (at(0.1, 0.0, 0.0), Solid::Ellipsoid(Vec3::repeat(0.05))),
    ];
    assert_volume(&imported, count(&shapes, 0.16));
}
