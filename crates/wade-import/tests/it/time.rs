//! How long an import takes; printed, and no test fails on a time.

#![allow(clippy::unwrap_used)]

use std::time::Instant;

use wade_import::Options;

use crate::solids::{at, turned};
use crate::write::{Folder, block, import, placed, ring, stl};

#[test]
fn twenty_thousand_triangles() {
    let folder = Folder::new();
    let mut mesh = placed(&block([0.4, 0.2, 0.1]), &at(0.0, 0.0, 0.25), 1.0);
    // wheels of fine facets whose inner sides reach into the chassis
    for (x, y) in [(0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2)] {
        let pose = turned([x, y, 0.15], [std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
        mesh.append(&placed(&ring(0.05, 0.15, 0.05, 625), &pose, 1.0));
    }
    assert!(mesh.faces.len() > 20_000, "{}", mesh.faces.len());
    let file = folder.write("rover.stl", stl(&mesh));
    let start = Instant::now();
    let imported = import(&[file], Options { mass: Some(40.0), ..Options::default() }).unwrap();
    println!(
        "{} triangles in {:.2} s, {} after the union",
        mesh.faces.len(),
        start.elapsed().as_secs_f64(),
        imported.vehicle.hull.mesh.faces.len()
    );
    assert_eq!(imported.wheels.len(), 4);
}
