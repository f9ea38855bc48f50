//! Cuts the faces of a hull at its middle plane, so that left and right of a symmetric vehicle are mirror images.

use std::collections::HashMap;

use wade_core::geometry::mesh::Mesh;

use crate::unite::United;

/// Share of the width within which a corner lies in the plane.
const ON_PLANE_SHARE: f64 = 1e-9;

/// The same hull, in which no face has corners on both sides of the middle of its width. It stays closed: both faces of an
/// edge are cut at the same point.
pub fn halve(united: United) -> United {
    let Some(bounds) = united.mesh.bounds() else { return united };
    let (middle, room) = (bounds.center().y, ON_PLANE_SHARE * bounds.extent().y);
    let mut cut = Cut { mesh: united.mesh, middle, room, points: HashMap::new() };
    let (mut faces, mut face_piece) = (Vec::new(), Vec::new());
    for (face, piece) in std::mem::take(&mut cut.mesh.faces).into_iter().zip(united.face_piece) {
        let before = faces.len();
        cut.face(face, &mut faces);
        face_piece.extend(std::iter::repeat_n(piece, faces.len() - before));
    }
    United { mesh: Mesh { faces, ..cut.mesh }, face_piece }
}

struct Cut {
    mesh: Mesh,
    /// y of the plane [m].
    middle: f64,
    /// Distance within which a corner lies in it [m].
    room: f64,
    /// Where an edge meets the plane, by its corners.
    points: HashMap<(u32, u32), u32>,
}

impl Cut {
    /// -1 on the right, 0 in the plane, 1 on the left.
    fn side(&self, corner: u32) -> i32 {
        let y = self.mesh.vertices[corner as usize].y - self.middle;
        if y.abs() <= self.room { 0 } else { y.signum() as i32 }
    }

    fn point(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (a.min(b), a.max(b));
        let [p, q] = [a, b].map(|corner| self.mesh.vertices[corner as usize]);
        let next = self.mesh.vertices.len() as u32;
        let point = *self.points.entry((a, b)).or_insert(next);
        if point == next {
            let mut middle = p + (q - p) * ((self.middle - p.y) / (q.y - p.y));
            middle.y = self.middle;
            self.mesh.vertices.push(middle);
        }
        point
    }

    fn face(&mut self, face: [u32; 3], out: &mut Vec<[u32; 3]>) {
        let sides = face.map(|corner| self.side(corner));
        if sides.iter().all(|side| *side >= 0) || sides.iter().all(|side| *side <= 0) {
            return out.push(face);
        }
        let from = |first: usize| [0, 1, 2].map(|i| face[(first + i) % 3]);
        if let Some(first) = sides.iter().position(|side| *side == 0) {
            let [a, b, c] = from(first);
            let point = self.point(b, c);
            return out.extend([[a, b, point], [a, point, c]]);
        }
        // one corner is alone on its side
        let alone = sides.iter().position(|side| sides.iter().filter(|other| *other == side).count() == 1);
        let [a, b, c] = from(alone.unwrap_or(0));
        let (ab, ca) = (self.point(a, b), self.point(c, a));
        out.extend([[a, ab, ca], [ab, b, c], [ab, c, ca]]);
    }
}

#[cfg(test)]
mod tests {
    use wade_core::frame::Vec3;
    use wade_core::geometry::watertight::is_closed;

    use super::*;
    use crate::shapes::Primitive;

    #[test]
    fn a_hull_that_is_cut_keeps_its_volume_and_is_closed() {
        let mut mesh = Primitive::Ellipsoid(Vec3::new(0.3, 0.2, 0.1)).mesh();
        // turned, so that no corner lies in the plane, and with one that does
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, 0.2, 0.1);
        mesh.vertices.iter_mut().for_each(|v| *v = turn * *v);
        mesh.append(&Primitive::Box(Vec3::new(0.1, 0.1, 0.1)).mesh());
        let (volume, count) = (mesh.volume(), mesh.faces.len());
        let face_piece = vec![0; count];
        let United { mesh, face_piece } = halve(United { mesh, face_piece });
        assert!(is_closed(&mesh) && mesh.faces.len() > count && face_piece.len() == mesh.faces.len());
        assert!((mesh.volume() / volume - 1.0).abs() < 1e-9);
        let middle = mesh.bounds().map_or(0.0, |bounds| bounds.center().y);
        for face in 0..mesh.faces.len() {
            let y = mesh.triangle(face).map(|corner| corner.y - middle);
            assert!(y.iter().all(|y| *y > -1e-9) || y.iter().all(|y| *y < 1e-9), "{y:?}");
        }
    }
}
