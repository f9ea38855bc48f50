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
    assert_eq!(read_stl(&collapsed).unwrap_err(), StlError::Degenerate { face: 0 });
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
    assert_eq!(check(&leaky), Err(LeakError::Open { open_edges: 3, non_manifold_edges: 0, parts: 1 }));
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
    assert_eq!(check(&beside(0.7)), Err(LeakError::Overlap { first: 0, second: 1, pairs: 1 }));
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
    let (sealed, report) = build_reporting(&shipped.spec, &write_stl(&leaky), true).unwrap();
    assert_eq!(report.unwrap().hulled, [0]);
    assert!((sealed.hull.mesh.volume() / shipped.mesh.volume() - 1.0).abs() < 1e-5);
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
    (spec.symmetric_left_right, spec.symmetric_front_rear) = (false, false);
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
    warthog.spec.symmetric_front_rear = true;
    let flag = "symmetric_front_rear";
    assert!(matches!(warthog.vehicle(), Err(BuildError::NotMirrored { flag: f, .. }) if f == flag));
    assert!(toml::from_str::<VehicleSpec>(&format!("weight = 3\n{HUSKY_SPEC}")).is_err());
}
