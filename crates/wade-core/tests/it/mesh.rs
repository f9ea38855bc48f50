//! Meshes from files: round trips, bad input, and bodies that are none.

#![allow(clippy::unwrap_used)]

use proptest::prelude::*;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh, StlError, read_stl, write_stl};
use wade_core::geometry::parametric::{Section, cuboid, cylinder, loft, sphere};
use wade_core::geometry::seal::seal;
use wade_core::geometry::watertight::{Allowances, LeakError, check, check_allowing, inspect};
use wade_core::vehicle::build::{BuildError, build, build_reporting};
use wade_core::vehicle::shipped::{HUSKY_SPEC, husky, warthog};
use wade_core::vehicle::spec::{Axis, VehicleSpec};

fn box_at(center: Vec3, edge: f64) -> Mesh {
    let half = Vec3::repeat(0.5 * edge);
    cuboid(&Bounds { min: center - half, max: center + half })
}

fn unit_box() -> Mesh {
    box_at(Vec3::zeros(), 1.0)
}

fn together(parts: &[Mesh]) -> Mesh {
    let mut mesh = Mesh::default();
    parts.iter().for_each(|p| mesh.append(p));
    mesh
}

fn inside_out(mut mesh: Mesh) -> Mesh {
    mesh.faces.iter_mut().for_each(|f| f.swap(1, 2));
    mesh
}

/// A tub of thin sheet: closed, outward, but it holds a cavity open at the top.
fn tub(sheet: f64) -> Mesh {
    let outer = unit_box();
    let inner = |p: &Vec3| Vec3::new(p.x * (1.0 - sheet), p.y * (1.0 - sheet), p.z.max(sheet - 0.5));
    // drop the lid of both skins and join the rims
    let lidless: Vec<[u32; 3]> = outer
        .faces
        .iter()
        .filter(|f| f.iter().any(|v| outer.vertices[*v as usize].z < 0.0))
        .copied()
        .collect();
    let n = outer.vertices.len() as u32;
    let mut mesh = Mesh { vertices: outer.vertices.clone(), faces: lidless.clone() };
    mesh.vertices.extend(outer.vertices.iter().map(inner));
    mesh.faces.extend(lidless.iter().map(|f| [f[0] + n, f[2] + n, f[1] + n]));
    for i in 8..16 {
        let j = if i == 15 { 8 } else { i + 1 };
        mesh.faces.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    mesh
}

#[test]
fn parametric_parts_are_sound_and_have_the_volume_of_the_formula() {
    let frustum = loft(
        &[
            Section { z: 0.0, x: [-1.0, 1.0], y: [-1.0, 1.0] },
            Section { z: 3.0, x: [-0.5, 0.5], y: [-0.5, 0.5] },
        ],
        [0.1, -0.2],
    );
    let pi = std::f64::consts::PI;
    let cases = [
        (unit_box(), 1.0, 1e-12),
        (frustum, 3.0 / 3.0 * (4.0 + 1.0 + 2.0), 1e-12),
        (cylinder(&Vec3::x(), 0.5, 2.0, 64), pi * 0.25 * 2.0, 2e-3),
        (sphere(&Vec3::x(), 0.5, 96), pi / 6.0, 3e-3),
    ];
    for (mesh, volume, tolerance) in cases {
        check(&mesh).unwrap();
        assert!((mesh.volume() / volume - 1.0).abs() < tolerance, "{} {volume}", mesh.volume());
    }
    assert!((unit_box().area() - 6.0).abs() < 1e-12);
}

#[test]
fn binary_stl_goes_round() {
    for mesh in [husky().unwrap().mesh, warthog().unwrap().mesh] {
        let back = read_stl(&write_stl(&mesh)).unwrap();
        assert_eq!(back.faces.len(), mesh.faces.len());
        assert!((back.volume() / mesh.volume() - 1.0).abs() < 1e-6);
        check(&back).unwrap();
        assert_eq!(read_stl(&write_stl(&back)).unwrap(), back, "a mesh that was read is kept to the bit");
    }
}

const TETRAHEDRON: &str = "solid t
 facet normal 0 0 -1
  outer loop
   vertex 0 0 0
   vertex 0 1e0 0
   vertex 1 0 0
  endloop
 endfacet
 facet normal 0 0 0
  outer loop
   vertex 0 0 0
   vertex 1 0 0
   vertex 0 0 1
  endloop
 endfacet
 facet normal 0 0 0
  outer loop
   vertex 0 0 0
   vertex 0 0 1
   vertex -0 1 0
  endloop
 endfacet
 facet normal 0 0 0
  outer loop
   vertex 1 0 0
   vertex 0 1 0
   vertex 0 0 1
  endloop
 endfacet
endsolid t
";

#[test]
fn ascii_stl_is_read_and_welded() {
    let mesh = read_stl(TETRAHEDRON.as_bytes()).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.faces.len()), (4, 4));
    check(&mesh).unwrap();
    assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-12);
}

#[test]
fn a_binary_file_whose_header_says_solid_is_binary() {
    let mut bytes = write_stl(&unit_box());
    bytes[..6].copy_from_slice(b"solid ");
    assert_eq!(read_stl(&bytes).unwrap().faces.len(), unit_box().faces.len());
}

#[test]
fn damaged_files_are_refused_by_name() {
    let good = write_stl(&unit_box());
    let with = |at: usize, value: f32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        read_stl(&bytes).unwrap_err()
    };
    assert_eq!(read_stl(b"").unwrap_err(), StlError::TooShort { bytes: 0 });
    assert!(matches!(read_stl(&good[..good.len() - 1]), Err(StlError::FaceCount { .. })));
    assert_eq!(with(84 + 50 * 3 + 12, f32::NAN), StlError::NotFinite { face: 3 });
    assert_eq!(with(84 + 50 * 2 + 24, f32::INFINITY), StlError::NotFinite { face: 2 });
    let mut collapsed = good.clone();
    collapsed.copy_within(84 + 12..84 + 24, 84 + 24);
    assert_eq!(read_stl(&collapsed).unwrap().faces.len(), unit_box().faces.len(), "kept for tidy to judge");
    let lying = [&[0; 80][..], &u32::MAX.to_le_bytes(), &[0; 50]].concat();
    assert!(matches!(read_stl(&lying), Err(StlError::FaceCount { declared: 0xffff_ffff, held: 1, .. })));
    assert_eq!(read_stl(&[0; 84]).unwrap_err(), StlError::Empty);
}

#[test]
fn broken_ascii_is_refused_with_its_line() {
    let error = |from: &str, to: &str| read_stl(TETRAHEDRON.replacen(from, to, 1).as_bytes()).unwrap_err();
    assert!(matches!(error("1e0", "one"), StlError::Grammar { line: 5, .. }));
    assert!(matches!(error("   vertex 0 0 0\n", ""), StlError::Grammar { line: 6, .. }));
    assert!(matches!(error("endsolid t", ""), StlError::Grammar { .. }));
    assert!(matches!(error("outer loop", "outer space\nfoo"), StlError::Grammar { line: 4, .. }));
    assert!(matches!(error("1e0", "nan"), StlError::NotFinite { face: 0 }));
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_stl(&bytes);
    }

    #[test]
    fn no_damage_makes_the_reader_panic(at in 0usize..2000, byte: u8, cut in 0usize..2000) {
        for mut bytes in [write_stl(&unit_box()), TETRAHEDRON.as_bytes().to_vec()] {
            let n = bytes.len();
            bytes[at % n] = byte;
            if let Ok(mesh) = read_stl(&bytes) {
                prop_assert!(mesh.faces.iter().flatten().all(|v| (*v as usize) < mesh.vertices.len()));
            }
            // an ASCII file may lose the name after its last `endsolid`
            bytes.truncate(cut % (n - 11));
            prop_assert!(read_stl(&bytes).is_err());
        }
    }
}

#[test]
fn a_hole_is_counted_and_sealed() {
    let mut leaky = unit_box();
    leaky.faces.pop();
    let Err(LeakError::Open { open_edges: 3, non_manifold_edges: 0, parts: 1, hole }) = check(&leaky) else {
        panic!("{:?}", check(&leaky));
    };
    // the rim is a face of half an edge by half an edge of the box
    assert!((hole.extent - 0.5_f64.sqrt()).abs() < 1e-12 && hole.edges == 3, "{hole:?}");
    let (sealed, report) = seal(&leaky);
    check(&sealed).unwrap();
    assert!((sealed.volume() - 1.0).abs() < 1e-9);
    assert_eq!(report.hulled, [0]);
}

#[test]
fn a_wall_inside_is_non_manifold() {
    let mut walled = unit_box();
    let (a, b) = (walled.faces[0][0], walled.faces[0][1]);
    let opposite = walled.vertices.len() as u32 - 1;
    walled.faces.push([a, b, opposite]);
    let report = inspect(&walled);
    assert!(report.non_manifold_edges >= 1 && report.open_edges >= 1, "{report:?}");
    assert!(matches!(check(&walled), Err(LeakError::Open { .. })));
}

#[test]
fn a_flipped_face_and_a_body_inside_out_are_told_apart() {
    let mut flipped = unit_box();
    flipped.faces[0].swap(1, 2);
    assert_eq!(check(&flipped), Err(LeakError::Inverted { inverted_edges: 3 }));
    let reversed = together(&[unit_box(), inside_out(box_at(Vec3::x() * 3.0, 1.0))]);
    assert_eq!(check(&reversed), Err(LeakError::Inward { part: 1 }));
    for bad in [flipped, reversed] {
        let (sealed, _) = seal(&bad);
        check(&sealed).unwrap();
        assert!((sealed.volume() - sealed.area() / 6.0).abs() < 1e-9, "unit boxes: a sixth of the area");
    }
}

#[test]
fn an_inner_skin_is_noticed_whichever_way_it_looks() {
    for inner in [box_at(Vec3::zeros(), 0.98), inside_out(box_at(Vec3::zeros(), 0.98))] {
        let double = together(&[unit_box(), inner]);
        assert_eq!(check(&double), Err(LeakError::InnerSkin { part: 1 }));
        let (sealed, report) = seal(&double);
        check(&sealed).unwrap();
        assert!((sealed.volume() - 1.0).abs() < 1e-9);
        assert_eq!((report.kept, report.inside), (vec![0], vec![1]));
    }
}

#[test]
fn a_double_skin_joined_at_its_rim_is_noticed() {
    let tub = tub(0.02);
    let report = inspect(&tub);
    assert_eq!((report.open_edges, report.inverted_edges, report.parts), (0, 0, 1), "closed to the letter");
    assert!(tub.volume() < 0.1);
    assert!(matches!(check(&tub), Err(LeakError::Thin { part: 0, percent }) if percent < 10.0));
    check_allowing(&tub, Allowances { thin_parts: true, overlaps: false }).unwrap();
    let (sealed, _) = seal(&tub);
    check(&sealed).unwrap();
    assert!((sealed.volume() - 1.0).abs() < 1e-9);
}

#[test]
fn overlapping_parts_are_noticed_and_touching_ones_are_not() {
    let beside = |x: f64| together(&[unit_box(), box_at(Vec3::new(x, 0.3, 0.2), 1.0)]);
    check(&beside(1.0)).unwrap();
    check(&beside(1.1)).unwrap();
    let Err(LeakError::Overlap { worst, pairs: 1, total_m3, percent }) = check(&beside(0.7)) else {
        panic!("{:?}", check(&beside(0.7)));
    };
    assert_eq!(worst.parts, (0, 1));
    // 0.3 x 0.7 x 0.8 m are shared about the middle of the two
    assert!((total_m3 - 0.168).abs() < 1e-6 && (percent - 8.4).abs() < 1e-3, "{total_m3} {percent}");
    assert!((worst.center - Vec3::new(0.35, 0.15, 0.1)).norm() < 1e-6, "{worst:?}");
    check_allowing(&beside(0.7), Allowances { thin_parts: false, overlaps: true }).unwrap();
    // a bar through a box: no corner of either lies in the other
    let half = Vec3::new(2.0, 0.1, 0.1);
    let bar = cuboid(&Bounds { min: -half, max: half });
    assert!(matches!(check(&together(&[unit_box(), bar])), Err(LeakError::Overlap { .. })));
}

#[test]
fn sealing_goes_part_by_part() {
    // two leaky boxes far apart: two boxes, not the hull around both
    let mut leaky = together(&[unit_box(), box_at(Vec3::x() * 5.0, 1.0), tub(0.5)]);
    leaky.faces.remove(0);
    let (sealed, report) = seal(&leaky);
    assert!((sealed.volume() - 2.0).abs() < 1e-9, "{report:?} {}", sealed.volume());
}

#[test]
fn the_builder_refuses_a_leak_and_seals_when_asked() {
    let shipped = husky().unwrap();
    let mut leaky = shipped.mesh.clone();
    leaky.faces.remove(0);
    let refused = build(&shipped.spec, &write_stl(&leaky), false);
    assert!(matches!(refused, Err(BuildError::Leak(LeakError::Open { open_edges: 3, .. }))));
    let built = build_reporting(&shipped.spec, &write_stl(&leaky), true).unwrap();
    assert_eq!(built.sealing.unwrap().hulled, [0]);
    assert!((built.vehicle.hull.mesh.volume() / shipped.mesh.volume() - 1.0).abs() < 1e-5);
}

#[test]
fn a_file_in_millimetres_with_other_axes_gives_the_same_vehicle() {
    let shipped = husky().unwrap();
    let mut file = shipped.mesh.clone();
    file.vertices
        .iter_mut()
        .for_each(|v| *v = Vec3::new(v.y, v.z, v.x) * 1000.0 + Vec3::new(5.0, 70.0, -300.0));
    let mut spec = shipped.spec.clone();
    (spec.body_from_stl.scale, spec.body_from_stl.x) = (0.001, Axis::PlusZ);
    (spec.body_from_stl.y, spec.body_from_stl.z) = (Axis::PlusX, Axis::PlusY);
    // f32 millimetres far from the origin are not symmetric to a millionth
    (spec.symmetric_left_right, spec.symmetric_front_rear) = (Some(false), Some(false));
    let (here, there) = (shipped.vehicle().unwrap(), build(&spec, &write_stl(&file), false).unwrap());
    for (a, b) in here.surfaces.iter().zip(&there.surfaces) {
        assert!((a.centroid - b.centroid).norm() < 1e-5 && (a.area - b.area).abs() < 1e-5, "{}", a.name);
    }
    spec.body_from_stl.y = Axis::MinusX;
    assert!(matches!(build(&spec, &write_stl(&file), false), Err(BuildError::Axes { .. })));
}

#[test]
fn wrong_vehicle_files_are_refused_by_name() {
    let shipped = husky().unwrap();
    let with = |change: &dyn Fn(&mut VehicleSpec)| {
        let mut spec = shipped.spec.clone();
        change(&mut spec);
        build(&spec, &shipped.stl(), false).unwrap_err()
    };
    assert!(matches!(with(&|s| { s.rule.pop(); }), BuildError::NoPatch { faces, .. } if faces > 0));
    assert!(
        matches!(with(&|s| s.rule[4].patch = "left".into()), BuildError::EmptyPatch { name } if name == "bottom")
    );
    assert!(
        matches!(with(&|s| s.rule[0].patch = "wheel".into()), BuildError::UnknownPatch { name } if name == "wheel")
    );
    assert!(matches!(with(&|s| s.mass_kg = f64::NAN), BuildError::Vehicle(_)));
    assert!(matches!(
        with(&|s| s.patch[1].name = "front_lower".into()),
        BuildError::UnknownPatch { name } if name == "front_mid"
    ));
    assert!(matches!(
        with(&|s| s.patch[6].left_right = Some("bottom".into())),
        BuildError::NotMirrored { .. }
    ));
    let mut warthog = warthog().unwrap();
    warthog.spec.patch[6].front_rear = Some("wheel_rl".into());
    warthog.spec.symmetric_front_rear = Some(true);
    let flag = "symmetric_front_rear";
    assert!(matches!(warthog.vehicle(), Err(BuildError::NotMirrored { flag: f, .. }) if f == flag));
    assert!(toml::from_str::<VehicleSpec>(&format!("weight = 3\n{HUSKY_SPEC}")).is_err());
}

/// A vehicle file with one surface.
fn plain_spec(more: &str) -> VehicleSpec {
    let text = format!(
        "name = \"box\"\nmass_kg = 50\n{more}\n[[patch]]\nname = \"body\"\nkind = \"side\"\n[[rule]]\npatch = \"body\"\n"
    );
    toml::from_str(&text).unwrap()
}

const CENTERED: &str = "center_of_mass_m = [0, 0, 0]";

#[test]
fn a_track_has_a_sprocket_of_half_its_height_or_of_the_radius_stated() {
    let build = |kind: &str, radius: &str| {
        let mut spec = plain_spec(CENTERED);
        let text = format!("name = \"body\"\nkind = \"{kind}\"\n{radius}");
        spec.patch = vec![toml::from_str(&text).unwrap()];
        build(&spec, &write_stl(&unit_box()), false)
    };
    let radius = |more: &str| build("track", more).unwrap().surfaces[0].sprocket_radius;
    assert!((radius("").unwrap() - 0.5).abs() < 1e-6);
    assert_eq!(radius("sprocket_radius_m = 0.2"), Some(0.2));
    assert_eq!(build("wheel", "").unwrap().surfaces[0].sprocket_radius, None);
    for (kind, radius) in [("track", "0.0"), ("track", "nan"), ("wheel", "0.2")] {
        let refused = build(kind, &format!("sprocket_radius_m = {radius}")).unwrap_err().to_string();
        assert!(refused.contains("`body`") && refused.contains("sprocket_radius_m"), "{refused}");
    }
}

/// The corner of a face of a binary STL that is moved.
fn with_corner_moved(mesh: &Mesh, by: f32) -> Vec<u8> {
    let mut bytes = write_stl(mesh);
    let at = 84 + 12;
    let value = f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) + by;
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    bytes
}

#[test]
fn corners_within_a_millionth_of_the_size_are_one() {
    let spec = plain_spec(CENTERED);
    let built = build_reporting(&spec, &with_corner_moved(&unit_box(), 1e-6), false).unwrap();
    assert_eq!(built.tidying.joined_corners, 1);
    assert!((built.vehicle.hull.mesh.volume() - 1.0).abs() < 1e-5);
    let refused = build(&spec, &with_corner_moved(&unit_box(), 1e-4), false);
    assert!(matches!(refused, Err(BuildError::Leak(LeakError::Open { .. }))), "{refused:?}");
}

#[test]
fn a_flat_face_goes_unless_the_mesh_needs_it() {
    let spec = plain_spec(CENTERED);
    let mut mesh = unit_box();
    let [a, b, c] = mesh.faces[0];
    let middle = mesh.vertices.len() as u32;
    mesh.vertices.push((mesh.vertices[a as usize] + mesh.vertices[b as usize]) * 0.5);
    // one too many
    let mut extra = mesh.clone();
    extra.faces.push([a, middle, b]);
    let built = build_reporting(&spec, &write_stl(&extra), false).unwrap();
    assert_eq!(
        (built.tidying.dropped_faces, built.vehicle.hull.mesh.faces.len()),
        (1, unit_box().faces.len())
    );
    // the face is cut at the middle of an edge that its neighbor has whole: a flat face closes the seam
    mesh.faces[0] = [a, middle, c];
    mesh.faces.push([middle, b, c]);
    assert!(build(&spec, &write_stl(&mesh), false).is_err());
    mesh.faces.push([a, b, middle]);
    let built = build_reporting(&spec, &write_stl(&mesh), false).unwrap();
    assert_eq!((built.tidying.dropped_faces, built.vehicle.hull.mesh.faces.len()), (0, mesh.faces.len()));
    assert!((built.vehicle.hull.mesh.volume() - 1.0).abs() < 1e-6);
}

#[test]
fn a_mesh_that_is_closed_keeps_its_bits() {
    for shipped in [husky().unwrap(), warthog().unwrap()] {
        let mesh = read_stl(&shipped.stl()).unwrap();
        let (tidied, tidying) = wade_core::geometry::tidy::tidy(mesh.clone());
        assert!(tidying.is_nothing() && tidied == mesh, "{tidying:?}");
    }
}

#[test]
fn a_hull_in_millimeters_is_refused_with_the_way_out() {
    let mut mesh = unit_box();
    mesh.vertices.iter_mut().for_each(|v| *v *= 400.0);
    let error = build(&plain_spec(CENTERED), &write_stl(&mesh), false).unwrap_err();
    assert!(matches!(error, BuildError::Implausible(_)), "{error}");
    assert!(error.to_string().contains("millimeters? scale = 0.001"), "{error}");
    let scaled = plain_spec(&format!("{CENTERED}\n[body_from_stl]\nscale = 0.001"));
    build(&scaled, &write_stl(&mesh), false).unwrap();
    let small = plain_spec(&format!("{CENTERED}\n[body_from_stl]\nscale = 0.00001"));
    assert!(build(&small, &write_stl(&mesh), false).unwrap_err().to_string().contains("meters"));
}

#[test]
fn the_center_of_mass_may_be_in_the_frame_of_the_mesh() {
    let mut mesh = unit_box();
    mesh.vertices.iter_mut().for_each(|v| *v = (*v + Vec3::new(3.0, 0.0, 1.0)) * 1000.0);
    let spec = plain_spec("center_of_mass_stl = [3100, 0, 800]\n[body_from_stl]\nscale = 0.001");
    let vehicle = build(&spec, &write_stl(&mesh), false).unwrap();
    assert!((vehicle.center_of_mass - Vec3::new(0.1, 0.0, -0.2)).norm() < 1e-6, "{}", vehicle.center_of_mass);
    for wrong in ["", "center_of_mass_m = [0, 0, 0]\ncenter_of_mass_stl = [0, 0, 0]"] {
        assert_eq!(build(&plain_spec(wrong), &write_stl(&unit_box()), false), Err(BuildError::CenterOfMass));
    }
}

#[test]
fn symmetry_is_that_of_the_mesh_unless_claimed() {
    let vehicle = build(&plain_spec(CENTERED), &write_stl(&unit_box()), false).unwrap();
    assert!(vehicle.symmetric_left_right, "its own image");
    assert!(!vehicle.symmetric_front_rear, "no counterpart is named");
    let mut skewed = unit_box();
    // a corner and the middles beside it go 2 cm to the left
    skewed.vertices.iter_mut().filter(|v| v.x > 0.4 && v.y > 0.4).for_each(|v| v.y += 0.02);
    let free = build(&plain_spec(CENTERED), &write_stl(&skewed), false).unwrap();
    assert!(!free.symmetric_left_right);
    let claimed = plain_spec(&format!("{CENTERED}\nsymmetric_left_right = true"));
    let error = build(&claimed, &write_stl(&skewed), false).unwrap_err();
    let BuildError::NotMirrored { fault, .. } = &error else { panic!("{error}") };
    assert!((0.001..0.05).contains(&fault.distance) && fault.tolerance < 1e-5, "{error}");
    assert!(error.to_string().contains(" m is allowed"), "{error}");
    let both = plain_spec(&format!("{CENTERED}\nsymmetric_front_rear = true"));
    let error = build(&both, &write_stl(&unit_box()), false);
    assert!(matches!(error, Err(BuildError::NoCounterpart { .. })), "what train would refuse: {error:?}");
}

#[test]
fn a_body_floats_where_archimedes_says_and_lies_where_its_center_of_mass_pulls_it() {
    use wade_core::vehicle::plausible::{Floating, questions};
    let half = Vec3::new(1.0, 0.5, 0.2);
    let bounds = Bounds { min: -half, max: half };
    let spec = |x: f64| {
        let spec = plain_spec(&format!("center_of_mass_m = [{x}, 0, -0.1]"));
        VehicleSpec { mass_kg: 200.0, ..spec }
    };
    let vehicle = build(&spec(0.01), &write_stl(&cuboid(&bounds)), false).unwrap();
    let floating = Floating::of(&vehicle);
    // 2 x 1 x 0.4 m of 200 kg: 0.1 m deep, BM = L2 / 12 d = 3.3333 m, BG = 0.05 m with G above B
    let righting = 4.0 / (12.0 * 0.1) - 0.05;
    assert!((floating.depth.unwrap() - 0.1).abs() < 1e-5, "{floating:?}");
    assert!((floating.pitch.unwrap() - 0.01 / righting).abs() < 1e-5, "{floating:?}");
    assert!(floating.roll.unwrap().abs() < 1e-6 && questions(&vehicle, &floating).is_empty());
    let heavy =
        build(&VehicleSpec { mass_kg: 900.0, ..spec(0.0) }, &write_stl(&cuboid(&bounds)), false).unwrap();
    assert_eq!(Floating::of(&heavy).depth, None, "it sinks");
}

/// An open tub of squares cut in two, turned about z, as a file in f32 has it.
fn open_tub(cuts: u32, angle: f64) -> Mesh {
    let (sin, cos) = angle.sin_cos();
    let turned = |p: Vec3| Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z);
    let (length, width, height) = (Vec3::x() * 0.8, Vec3::y() * 0.4, Vec3::z() * 0.2);
    let sides = [
        (Vec3::zeros(), width, length),
        (Vec3::zeros(), length, height),
        (width, height, length),
        (Vec3::zeros(), height, width),
        (length, width, height),
    ];
    let mut mesh = Mesh::default();
    for (origin, u, v) in sides {
        let at = |i: u32, j: u32| {
            turned(origin + u * (f64::from(i) / f64::from(cuts)) + v * (f64::from(j) / f64::from(cuts)))
        };
        for (i, j) in (0..cuts).flat_map(|i| (0..cuts).map(move |j| (i, j))) {
            for corners in
                [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            {
                let first = mesh.vertices.len() as u32;
                mesh.vertices.extend(corners);
                mesh.faces.push([first, first + 1, first + 2]);
            }
        }
    }
    mesh
}

#[test]
fn the_hulls_that_sealing_makes_are_hulls_that_are_read() {
    let spec = VehicleSpec { mass_kg: 10.0, ..plain_spec(CENTERED) };
    for cuts in 2..=10 {
        for angle in [0.0, 0.3, 0.7, 1.1, 1.4, 2.9] {
            let built = build_reporting(&spec, &write_stl(&open_tub(cuts, angle)), true);
            let built = built.unwrap_or_else(|error| panic!("{cuts} {angle}: {error}"));
            let volume = built.vehicle.hull.mesh.volume();
            assert!((volume - 0.064).abs() < 1e-6, "{cuts} {angle}: {volume}");
            let sealing = built.sealing.unwrap();
            assert!((sealing.volume_after - 0.064).abs() < 1e-6);
            assert!(sealing.to_string().contains("replaced by their convex hulls; volume"), "{sealing}");
        }
    }
}

#[test]
fn a_bundle_without_the_counterparts_that_training_needs_is_refused() {
    use wade_core::vehicle::VehicleError;
    let mut vehicle = husky().unwrap().vehicle().unwrap();
    assert!(vehicle.symmetric_front_rear);
    let bottom = vehicle.surface_index("bottom").unwrap();
    vehicle.surfaces[bottom].mirror_front_rear = None;
    assert_eq!(vehicle.validate(), Err(VehicleError::NoCounterpart { name: "bottom".to_owned() }));
}
