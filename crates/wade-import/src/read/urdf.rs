//! URDF: links joined to a tree; <http://wiki.ros.org/urdf/XML>.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Point3};
use wade_core::frame::Vec3;

use super::builder::{MeshReference, Shaper};
use super::locate::Locator;
use super::xml::{self, Element, pose};
use super::{ReadError, Wanted};
use crate::limits::MOST_LINKS;
use crate::scene::{Convention, Inertial, Joint, Link, Role, Scene, Shape};
use crate::shapes::Primitive;

/// Reads a robot; `beside` are further files that may be its meshes.
pub fn read(path: &Path, beside: Vec<PathBuf>, wanted: Wanted) -> Result<Scene, ReadError> {
    let text = super::text(path)?;
    let document = xml::parse(path, &text)?;
    let robot = Element { path, node: document.root_element() };
    let mut shaper = Shaper::new(Locator::new(path, beside), wanted);
    let mut scene =
        Scene { links: Vec::new(), convention: Convention::ROBOT, notes: Vec::new(), warnings: Vec::new() };
    let is_macro = |node: &roxmltree::Node<'_, '_>| {
        node.tag_name().namespace().is_some_and(|namespace| namespace.ends_with("xacro"))
            || node.attributes().any(|attribute| attribute.value().contains("${"))
    };
    if robot.node.descendants().any(|node| is_macro(&node)) {
        return Err(robot.fault("holds xacro macros: expand them with `xacro FILE > robot.urdf`".to_owned()));
    }
    let elements: Vec<Element<'_, '_>> = robot.children("link").collect();
    if elements.is_empty() {
        return Err(ReadError::Nothing { path: path.to_owned(), what: "link" });
    }
    if elements.len() > MOST_LINKS {
        return Err(ReadError::Many { path: path.to_owned(), what: "links" });
    }
    for placed in Tree::read(robot, &elements)?.placed()? {
        let element = elements[placed.element];
        scene.warnings.extend(shaper.link_left_out(element)?);
        let link = Link {
            name: element.required("name")?.to_owned(),
            parent: placed.parent,
            joint: placed.joint,
            shapes: shapes(element, &placed.pose, &mut shaper)?,
            inertial: inertial(element, &placed.pose)?,
            pose: placed.pose,
        };
        scene.links.push(link);
    }
    Ok(scene)
}

/// The joints by the child that each carries.
struct Tree<'a, 'input> {
    path: &'a Path,
    names: Vec<&'a str>,
    /// Of each link: the joint above it and the index of its parent.
    above: Vec<Option<(Element<'a, 'input>, usize)>>,
}

/// A link with its place in the tree.
struct Placed {
    element: usize,
    parent: Option<usize>,
    joint: Joint,
    pose: Isometry3<f64>,
}

impl<'a, 'input> Tree<'a, 'input> {
    fn read(robot: Element<'a, 'input>, links: &[Element<'a, 'input>]) -> Result<Self, ReadError> {
        let names = links.iter().map(|link| link.required("name")).collect::<Result<Vec<_>, _>>()?;
        let mut index: HashMap<&str, usize> = HashMap::new();
        for (at, name) in names.iter().enumerate() {
            if index.insert(name, at).is_some() {
                return Err(links[at].fault(format!("`{name}` is there twice")));
            }
        }
        let mut above: Vec<Option<(Element<'_, '_>, usize)>> = vec![None; links.len()];
        for joint in robot.children("joint") {
            let end = |name: &'static str| {
                let element = joint.child(name).ok_or_else(|| joint.fault(format!("has no <{name}>")))?;
                let link = element.required("link")?;
                let at = index.get(link).copied();
                at.ok_or_else(|| element.fault(format!("names the link `{link}`, which there is not")))
            };
            let (parent, child) = (end("parent")?, end("child")?);
            if let Some((_, other)) = above[child] {
                let links = [names[child], names[parent], names[other]].map(str::to_owned).to_vec();
                return Err(ReadError::Loop { path: robot.path.to_owned(), links });
            }
            above[child] = Some((joint, parent));
        }
        Ok(Self { path: robot.path, names, above })
    }

    /// Links in an order in which parents come before children.
    fn placed(&self) -> Result<Vec<Placed>, ReadError> {
        let owned = |at: &usize| self.names[*at].to_owned();
        let roots: Vec<usize> = (0..self.above.len()).filter(|at| self.above[*at].is_none()).collect();
        if roots.len() > 1 {
            return Err(ReadError::Roots {
                path: self.path.to_owned(),
                links: roots.iter().map(owned).collect(),
            });
        }
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); self.above.len()];
        for (child, above) in self.above.iter().enumerate() {
            above.iter().for_each(|(_, parent)| children[*parent].push(child));
        }
        let mut placed: Vec<Placed> = Vec::new();
        let mut open: Vec<(usize, Option<usize>)> = roots.into_iter().map(|root| (root, None)).collect();
        while let Some((link, parent)) = open.pop() {
            let (pose, joint) = match (self.above[link], parent) {
                (Some((element, _)), Some(parent)) => joint(element, &placed[parent].pose)?,
                _ => (Isometry3::identity(), Joint::Fixed),
            };
            let own = placed.len();
            placed.push(Placed { element: link, parent, joint, pose });
            open.extend(children[link].iter().rev().map(|child| (*child, Some(own))));
        }
        if placed.len() < self.above.len() {
            let reached: Vec<usize> = placed.iter().map(|placed| placed.element).collect();
            let rest = (0..self.above.len()).filter(|at| !reached.contains(at));
            return Err(ReadError::Loop {
                path: self.path.to_owned(),
                links: rest.map(|at| owned(&at)).collect(),
            });
        }
        Ok(placed)
    }
}

/// Pose of the child at joint position zero, and how it moves.
fn joint(element: Element<'_, '_>, parent: &Isometry3<f64>) -> Result<(Isometry3<f64>, Joint), ReadError> {
    let pose = parent * origin(element)?;
    let kind = element.required("type")?;
    let axis = match element.child("axis") {
        Some(axis) => axis.numbers::<3>("xyz")?.unwrap_or([1.0, 0.0, 0.0]),
        None => [1.0, 0.0, 0.0],
    };
    let is_turning = match kind {
        "continuous" => true,
        "revolute" => turns_without_limit(element)?,
        "fixed" => return Ok((pose, Joint::Fixed)),
        "prismatic" | "floating" | "planar" => false,
        other => {
            return Err(element.value(
                "type",
                other,
                "one of continuous, revolute, prismatic, fixed, floating, planar",
            ));
        }
    };
    if !is_turning {
        return Ok((pose, Joint::Other));
    }
    let axis = Vec3::from(axis);
    let Some(unit) = axis.try_normalize(1e-9) else {
        return Err(element.fault("has an axis of length zero".to_owned()));
    };
    let name = element.attribute("name").unwrap_or_default().to_owned();
    Ok((pose, Joint::Turning { name, axis: pose.rotation * unit, origin: pose.translation.vector }))
}

/// Two turns or more between the limits are none for a wheel.
fn turns_without_limit(element: Element<'_, '_>) -> Result<bool, ReadError> {
    let Some(limit) = element.child("limit") else { return Ok(false) };
    let value = |name| limit.numbers::<1>(name).map(|value| value.map_or(0.0, |[value]| value));
    Ok(value("upper")? - value("lower")? > 2.0 * TAU)
}

fn origin(element: Element<'_, '_>) -> Result<Isometry3<f64>, ReadError> {
    let Some(origin) = element.child("origin") else { return Ok(Isometry3::identity()) };
    let zero = [0.0; 3];
    Ok(pose(origin.numbers("xyz")?.unwrap_or(zero), origin.numbers("rpy")?.unwrap_or(zero)))
}

fn shapes(
    link: Element<'_, '_>,
    frame: &Isometry3<f64>,
    shaper: &mut Shaper,
) -> Result<Vec<Shape>, ReadError> {
    let mut shapes = Vec::new();
    for (role, element) in shaper.wanted_elements(link) {
        let at = frame * origin(element)?;
        let geometry = element.geometry()?;
        shapes.push(shape(link.required("name")?, geometry, (role, &at), shaper)?);
    }
    Ok(shapes)
}

fn shape(
    link: &str,
    geometry: Element<'_, '_>,
    (role, at): (Role, &Isometry3<f64>),
    shaper: &mut Shaper,
) -> Result<Shape, ReadError> {
    let number = |name: &str| {
        let value = geometry.numbers::<1>(name)?;
        value.map(|[value]| value).ok_or_else(|| geometry.fault(format!("has no attribute {name}")))
    };
    let primitive = match geometry.tag() {
        "box" => {
            let size = geometry.numbers::<3>("size")?;
            Primitive::Box(size.ok_or_else(|| geometry.fault("has no attribute size".to_owned()))?.into())
        }
        "cylinder" => Primitive::Cylinder(number("radius")?, number("length")?),
        "capsule" => Primitive::Capsule(number("radius")?, number("length")?),
        "sphere" => Primitive::Sphere(number("radius")?),
        "mesh" => {
            let reference = geometry.required("filename")?;
            let scale = geometry.numbers("scale")?.unwrap_or([1.0; 3]);
            let file = MeshReference { link, reference, scale, folder: "", part: None };
            return shaper.mesh(geometry, role, file, at);
        }
        _ => {
            return Err(
                geometry.fault("is no shape: box, cylinder, capsule, sphere and mesh are read".to_owned())
            );
        }
    };
    shaper.primitive(geometry, role, primitive, at)
}

fn inertial(link: Element<'_, '_>, frame: &Isometry3<f64>) -> Result<Option<Inertial>, ReadError> {
    let Some(element) = link.child("inertial") else { return Ok(None) };
    let Some(mass) = element.child("mass") else { return Ok(None) };
    let Some([mass]) = mass.numbers::<1>("value")? else { return Ok(None) };
    let at = frame * origin(element)?;
    let mut matrix = Matrix3::zeros();
    if let Some(inertia) = element.child("inertia") {
        let entries =
            [("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2)];
        for (name, row, column) in entries {
            let value = inertia.numbers::<1>(name)?.map_or(0.0, |[value]| value);
            (matrix[(row, column)], matrix[(column, row)]) = (value, value);
        }
    }
    let turn = at.rotation.to_rotation_matrix().into_inner();
    let center = (at * Point3::origin()).coords;
    Ok(Some(Inertial { mass, center, inertia: turn * matrix * turn.transpose() }))
}
