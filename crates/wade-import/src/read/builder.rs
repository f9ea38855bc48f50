//! What the readers of robot descriptions share: meshes are read once, and counted.

use std::collections::HashMap;
use std::path::PathBuf;

use nalgebra::{Isometry3, Matrix3};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Mesh;

use super::locate::Locator;
use super::meshes;
use super::xml::Element;
use super::{ReadError, Wanted};
use crate::file_name;
use crate::limits::{MOST_FACES, MOST_LINKS};
use crate::scene::{Role, Shape};
use crate::shapes::{Primitive, moved, scaled};

/// Reads shapes.
pub struct Shaper {
    locator: Locator,
    /// Which shapes are wanted.
    pub wanted: Wanted,
    loaded: HashMap<(PathBuf, Option<String>), Mesh>,
    faces: usize,
    shapes: usize,
}

/// A mesh file as a robot refers to it.
#[derive(Debug, Clone, Copy)]
pub struct MeshReference<'a> {
    /// The link that wants it.
    pub link: &'a str,
    /// Path or address in the file.
    pub reference: &'a str,
    /// Scale along each axis.
    pub scale: [f64; 3],
    /// Further folder that the path may start at.
    pub folder: &'a str,
    /// Name of the one part of the file that is meant; else the whole file is.
    pub part: Option<&'a str>,
}

impl Shaper {
    /// Meshes beside a description.
    pub fn new(locator: Locator, wanted: Wanted) -> Self {
        Self { locator, wanted, loaded: HashMap::new(), faces: 0, shapes: 0 }
    }

    /// True for shapes of a role that is asked for.
    pub fn wants(&self, role: Role) -> bool {
        match role {
            Role::Visual => self.wanted.visual,
            Role::Collision => self.wanted.collision,
            Role::Both => true,
        }
    }

    /// The `<visual>` and `<collision>` elements of a link that are asked for, with what they are.
    pub fn wanted_elements<'a, 'i>(&self, link: Element<'a, 'i>) -> Vec<(Role, Element<'a, 'i>)> {
        let roles = [("visual", Role::Visual), ("collision", Role::Collision)].into_iter();
        let wanted = roles.filter(|(_, role)| self.wants(*role));
        wanted.flat_map(|(tag, role)| link.children(tag).map(move |element| (role, element))).collect()
    }

    /// [`Shaper::left_out`] of a link with `<visual>` and `<collision>` elements.
    pub fn link_left_out(&self, link: Element<'_, '_>) -> Result<Option<String>, ReadError> {
        let has = |tag, is_wanted: bool| is_wanted && link.child(tag).is_some();
        let Wanted { visual, collision } = self.wanted;
        let wanted = has("visual", visual) || has("collision", collision);
        let others = has("visual", !visual) || has("collision", !collision);
        Ok(self.left_out(link.required("name")?, wanted, others))
    }

    /// That a link has shapes, and none of the kind that is asked for.
    pub fn left_out(&self, link: &str, has_wanted: bool, has_others: bool) -> Option<String> {
        let asked = if self.wanted.visual { "visual" } else { "collision" };
        (has_others && !has_wanted)
            .then(|| format!("link `{link}` is left out: it has shapes, and none for --shapes {asked}"))
    }

    /// A primitive at a pose.
    pub fn primitive(
        &mut self,
        element: Element<'_, '_>,
        role: Role,
        primitive: Primitive,
        pose: &Isometry3<f64>,
    ) -> Result<Shape, ReadError> {
        if !primitive.is_sound() {
            return Err(element.fault(format!("is a {} whose sizes are not positive", primitive.name())));
        }
        let mesh = moved(&primitive.mesh(), pose);
        self.count(element, mesh.faces.len())?;
        Ok(Shape { role, source: primitive.name().to_owned(), mesh })
    }

    /// A mesh file at a pose.
    pub fn mesh(
        &mut self,
        element: Element<'_, '_>,
        role: Role,
        file: MeshReference<'_>,
        pose: &Isometry3<f64>,
    ) -> Result<Shape, ReadError> {
        let folders: &[&str] = if file.folder.is_empty() { &[] } else { &[file.folder] };
        let path = self.locator.find(file.reference, folders).map_err(|tried| ReadError::MeshMissing {
            path: element.path.to_owned(),
            line: element.line(),
            link: file.link.to_owned(),
            reference: file.reference.to_owned(),
            tried,
        })?;
        if !file.scale.iter().all(|s| *s != 0.0) {
            return Err(element.fault("has a scale of zero".to_owned()));
        }
        let key = (path, file.part.map(str::to_owned));
        if !self.loaded.contains_key(&key) {
            let parts = meshes::load(&key.0)?;
            let is_meant = |part: &&meshes::Part| file.part.is_none_or(|name| part.name == name);
            let mut whole = Mesh::default();
            parts.iter().filter(is_meant).for_each(|part| whole.append(&part.mesh));
            if let Some(name) = file.part.filter(|_| whole.faces.is_empty()) {
                let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
                return Err(element.fault(format!(
                    "names the part `{name}` of {}; it has {}",
                    file.reference,
                    names.join(", ")
                )));
            }
            self.loaded.insert(key.clone(), whole);
        }
        let (mesh, path) = (&self.loaded[&key], &key.0);
        let map = Matrix3::from_diagonal(&Vec3::from(file.scale));
        let mesh = moved(&scaled(mesh, &map), pose);
        self.count(element, mesh.faces.len())?;
        Ok(Shape { role, source: file_name(path), mesh })
    }

    fn count(&mut self, element: Element<'_, '_>, faces: usize) -> Result<(), ReadError> {
        let path = || element.path.to_owned();
        self.shapes += 1;
        self.faces += faces;
        if self.shapes > MOST_LINKS {
            return Err(ReadError::Many { path: path(), what: "shapes" });
        }
        // visual and collision shapes are read both
        if self.faces > 2 * MOST_FACES {
            return Err(ReadError::Faces { path: path(), faces: self.faces });
        }
        Ok(())
    }
}
