//! The unit of files that state none: by the mass that floats, else by the size, and said.

#![allow(clippy::unwrap_used)]

use nalgebra::Isometry3;
use wade_import::{Imported, Options, Unit};

use crate::write::{Folder, block, import, placed, stl};

/// A box of these edges [m], drawn in a unit.
fn drawn(edges: [f64; 3], unit: Unit, options: Options) -> Imported {
    let mesh = placed(&block(edges.map(|edge| 0.5 * edge)), &Isometry3::identity(), 1.0 / unit.meters());
    let folder = Folder::new();
    import(&[folder.write("hull.stl", stl(&mesh))], options).unwrap()
}

fn unit_warning(imported: &Imported) -> Option<&String> {
    imported.warnings.iter().find(|said| said.contains("no file states its unit"))
}

#[test]
fn the_mass_that_floats_decides_between_units() {
    // 30 to 60 % under water
    for edges in [[0.5, 0.35, 0.2], [0.99, 0.67, 0.3], [1.5, 1.3, 0.4], [3.0, 1.6, 0.8]] {
        let volume: f64 = edges.iter().product();
        for unit in Unit::ALL {
            for density in [300.0, 400.0, 600.0] {
                let mass = Some(density * volume);
                let imported = drawn(edges, unit, Options { mass, ..Options::default() });
                let found = imported.floating.displaced_volume;
                assert!((found / volume - 1.0).abs() < 1e-5, "{edges:?} {unit:?} {found}");
                let depth = imported.floating.depth.unwrap() / edges[2];
                assert!((depth - density * 1e-3).abs() < 1e-4, "{depth}");
                let note = imported.notes.iter().find(|note| note.starts_with("unit: ")).unwrap();
                assert!(note.contains("--unit"), "{note}");
            }
        }
    }
}

#[test]
fn without_a_mass_the_size_decides_and_the_other_units_are_named() {
    // file units, unit taken, words of the warning
    let cases: [(f64, Unit, &[&str]); 6] = [
        (0.4, Unit::Meters, &[]),
        (1.2, Unit::Meters, &["0.0305 m in inches"]),
        (8.0, Unit::Inches, &["8.0000 m in meters", "0.0800 m in centimeters"]),
        (60.0, Unit::Centimeters, &["0.0600 m in millimeters", "1.5240 m in inches"]),
        (400.0, Unit::Millimeters, &["4.0000 m in centimeters", "10.1600 m in inches"]),
        (4000.0, Unit::Millimeters, &[]),
    ];
    for (length, unit, others) in cases {
        let meters = length * unit.meters();
        let edges = [1.0, 0.6, 0.4].map(|share| share * meters);
        let imported = drawn(edges, unit, Options::default());
        assert!((imported.vehicle.dimensions.length / meters - 1.0).abs() < 1e-6, "{length}");
        let said = unit_warning(&imported).cloned().unwrap_or_default();
        assert!(said.is_empty() == others.is_empty(), "{said}");
        assert!(others.iter().all(|other| said.contains(other)), "{said}");
        assert!(
            said.is_empty() || said.contains("--unit m|mm|cm|in") && said.contains("--mass KG"),
            "{said}"
        );
    }
}

#[test]
fn a_mass_that_floats_in_no_unit_or_in_several_is_said() {
    // 60 units long: 1.2 kg in centimeters are 9 kg/m3, in inches less, in millimeters 9000
    let edges = [0.6, 0.5, 0.45];
    let imported = drawn(edges, Unit::Centimeters, Options { mass: Some(1.2), ..Options::default() });
    let said = unit_warning(&imported).unwrap();
    assert!(said.contains("in none of them 1.2 kg float"), "{said}");
    // 800 kg/m3 in centimeters and 49 in inches: both float
    let both = drawn(edges, Unit::Centimeters, Options { mass: Some(108.0), ..Options::default() });
    let said = unit_warning(&both).unwrap();
    assert!(said.contains("centimeters are taken") && said.contains("1.5240 m in inches"), "{said}");
    assert!(!said.contains("millimeters"), "{said}");
    let stated = drawn(edges, Unit::Centimeters, Options { scale: Some(0.01), ..Options::default() });
    assert!(unit_warning(&stated).is_none());
}
