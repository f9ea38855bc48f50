//! Mass, center of mass and inertia summed over links.

use nalgebra::Matrix3;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Mesh;

use crate::scene::{Inertial, Joint, Scene};

/// The whole vehicle as one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Mass [kg].
    pub mass: f64,
    /// Center of mass [m].
    pub center: Vec3,
    /// Inertia about it [kg m2]; `None` where the links state none that a body can have.
    pub inertia: Option<Matrix3<f64>>,
}

/// Sums the links; `None` where none has a mass.
pub fn sum(scene: &Scene, warnings: &mut Vec<String>) -> Option<Body> {
    let stated = scene.links.iter().filter_map(|link| Some((link, link.inertial?)));
    let links: Vec<_> = stated.filter(|(_, inertial)| inertial.mass > 0.0).collect();
    let mass: f64 = links.iter().map(|(_, inertial)| inertial.mass).sum();
    if !(mass > 0.0 && mass.is_finite()) {
        return None;
    }
    let without = without_mass(scene);
    if !without.is_empty() {
        warnings.push(format!("links with a shape and without a mass: {}", without.join(", ")));
    }
    let center = links.iter().map(|(_, i)| i.center * i.mass).sum::<Vec3>() / mass;
    let inertia: Matrix3<f64> = links.iter().map(|(_, i)| i.inertia + steiner(i, &center)).sum();
    let sound = is_inertia(&inertia);
    if !sound {
        warnings.push(
            "the inertia of the links is none that a body can have: that of a box is taken instead"
                .to_owned(),
        );
    }
    Some(Body { mass, center, inertia: sound.then_some((inertia + inertia.transpose()) * 0.5) })
}

/// Links with a shape of which neither they nor those fixed to them have a mass.
fn without_mass(scene: &Scene) -> Vec<&str> {
    // parents come first
    let mut root: Vec<usize> = Vec::new();
    for (index, link) in scene.links.iter().enumerate() {
        let parent = link.parent.filter(|_| link.joint == Joint::Fixed);
        root.push(parent.map_or(index, |parent| root[parent]));
    }
    let mut has_mass = vec![false; scene.links.len()];
    for (link, root) in scene.links.iter().zip(&root) {
        has_mass[*root] |= link.inertial.is_some_and(|inertial| inertial.mass > 0.0);
    }
    let bare =
        (0..scene.links.len()).filter(|own| !scene.links[*own].shapes.is_empty() && !has_mass[root[*own]]);
    bare.map(|own| scene.links[own].name.as_str()).collect()
}

/// The parallel-axis term of a link.
pub fn steiner(link: &Inertial, center: &Vec3) -> Matrix3<f64> {
    let arm = link.center - center;
    (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * link.mass
}

/// Positive definite, and no principal moment larger than the sum of the other two.
fn is_inertia(inertia: &Matrix3<f64>) -> bool {
    if !inertia.iter().all(|x| x.is_finite()) {
        return false;
    }
    let moments = ((inertia + inertia.transpose()) * 0.5).symmetric_eigenvalues();
    let largest = moments.max();
    moments.min() > 0.0 && 2.0 * largest <= moments.sum() * (1.0 + 1e-6)
}

/// Center of the volume that a closed mesh encloses.
pub fn centroid(mesh: &Mesh) -> Vec3 {
    let (mut volume, mut first) = (0.0, Vec3::zeros());
    for face in 0..mesh.faces.len() {
        let [a, b, c] = mesh.triangle(face);
        let six = a.dot(&b.cross(&c));
        volume += six;
        first += (a + b + c) * (six / 4.0);
    }
    first / volume
}

/// Mass and inertia of an even solid of this density, about its centroid.
pub fn solid(mesh: &Mesh, density: f64) -> Inertial {
    let center = centroid(mesh);
    let mut second = Matrix3::zeros();
    let mut six_volumes = 0.0;
    for face in 0..mesh.faces.len() {
        let [a, b, c] = mesh.triangle(face).map(|v| v - center);
        let six = a.dot(&b.cross(&c));
        let sum = a + b + c;
        second += (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose())
            * (six / 120.0);
        six_volumes += six;
    }
    let inertia = (Matrix3::identity() * second.trace() - second) * density;
    Inertial { mass: six_volumes / 6.0 * density, center, inertia }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Primitive;

    #[test]
    fn an_even_box_has_the_inertia_of_the_formula() {
        let size = Vec3::new(0.4, 0.6, 0.2);
        let body = solid(&Primitive::Box(size).mesh(), 1000.0);
        let (x, y, z) = (size.x * size.x, size.y * size.y, size.z * size.z);
        let expected = Matrix3::from_diagonal(&(Vec3::new(y + z, x + z, x + y) * (48.0 / 12.0)));
        assert!((body.mass - 48.0).abs() < 1e-9 && body.center.norm() < 1e-12);
        assert!((body.inertia - expected).norm() < 1e-9, "{}", body.inertia);
    }
}
