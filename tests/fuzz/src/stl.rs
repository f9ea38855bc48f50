//! A mesh in STL: refused, or tidied, looked at, and made a vehicle of where it is closed.

use wade_core::geometry::stl::{read_stl, write_stl};
use wade_core::geometry::tidy::tidy;
use wade_core::geometry::watertight::inspect;

use wade_simulation::bundle::block;

use crate::robot::imported;

/// The file.
pub fn run(bytes: &[u8]) {
    let Ok(mesh) = read_stl(bytes) else { return };
    let again = read_stl(&write_stl(&mesh)).expect("what was read can be written");
    assert_eq!(mesh.faces.len(), again.faces.len());
    let (tidied, _) = tidy(mesh);
    let report = inspect(&tidied);
    let _ = report.verdict(Default::default()).map_err(|leak| leak.to_string());
    imported("mesh.stl", bytes);
}

/// A box, one without a lid, and text.
pub fn seeds() -> Vec<Vec<u8>> {
    let whole = block([0.8, 0.6, 0.4]);
    let mut open = whole[..whole.len() - 50].to_vec();
    open[80] -= 1;
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    vec![whole, open, text.into()]
}
