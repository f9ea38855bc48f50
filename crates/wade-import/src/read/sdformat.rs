//! SDF: the first model of a file; <http://sdformat.org/spec>.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Point3};
use wade_core::frame::Vec3;

use super::builder::{MeshReference, Shaper};
use super::locate::Locator;
use super::xml::{self, Element};
use super::{ReadError, Wanted};
use crate::limits::{MOST_DEPTH, MOST_LINKS};
use crate::scene::{Convention, Inertial, Joint, Link, Role, Scene, Shape};
use crate::shapes::Primitive;

/// Reads a model; `beside` are further files that may be its meshes.
pub fn read(path: &Path, beside: Vec<PathBuf>, wanted: Wanted) -> Result<Scene, ReadError> {
    let text = super::text(path)?;
    let document = xml::parse(path, &text)?;
    let root = Element { path, node: document.root_element() };
    let models: Vec<Element<'_, '_>> = root
        .children("model")
        .chain(root.children("world").flat_map(|world| world.children("model")))
        .collect();
    // the ground and the walls of a world stand still
    let moves = |model: &&Element<'_, '_>| !matches!(model.text("static"), Some("true" | "1"));
    let Some(&model) = (models.iter().find(|model| model.child("joint").is_some()))
        .or_else(|| models.iter().find(moves))
        .or(models.first())
    else {
        return Err(ReadError::Nothing { path: path.to_owned(), what: "model" });
    };
    let mut scene =
        Scene { links: Vec::new(), convention: Convention::ROBOT, notes: Vec::new(), warnings: Vec::new() };
    if models.len() > 1 {
        let name = model.attribute("name").unwrap_or_default();
        scene.notes.push(format!("{} models in the file: `{name}` is imported", models.len()));
    }
    for tag in ["include", "model"] {
        for inner in model.children(tag) {
            scene.warnings.push(format!("line {}: <{tag}> inside the model is not read", inner.line()));
        }
    }
    let mut shaper = Shaper::new(Locator::new(path, beside), wanted);
    let frames = Frames::of(model)?;
    let links: Vec<Element<'_, '_>> = model.children("link").collect();
    if links.is_empty() {
        return Err(ReadError::Nothing { path: path.to_owned(), what: "link" });
    }
    if links.len() > MOST_LINKS {
        return Err(ReadError::Many { path: path.to_owned(), what: "links" });
    }
    let joints = joints(model, &frames)?;
    for name in order(path, &links, &joints)? {
        let Some(element) = links.iter().find(|link| link.attribute("name") == Some(name)) else { continue };
        scene.warnings.extend(shaper.link_left_out(*element)?);
        let pose = frames.pose(name)?;
        let above = joints.get(name);
        let parent = above.and_then(|above| scene.links.iter().position(|link| link.name == above.parent));
        scene.links.push(Link {
            name: name.to_owned(),
            parent,
            // a joint to the world moves the whole
            joint: above.filter(|_| parent.is_some()).map_or(Joint::Fixed, |above| above.joint.clone()),
            shapes: shapes(*element, &pose, &frames, &mut shaper)?,
            inertial: inertial(*element, &pose)?,
            pose,
        });
    }
    Ok(scene)
}

/// The named frames of a model: links, joints and frames.
struct Frames<'a, 'input> {
    model: Element<'a, 'input>,
    named: HashMap<&'a str, Element<'a, 'input>>,
}

impl<'a, 'input> Frames<'a, 'input> {
    fn of(model: Element<'a, 'input>) -> Result<Self, ReadError> {
        let mut named = HashMap::new();
        for tag in ["link", "joint", "frame"] {
            for element in model.children(tag) {
                let name = element.required("name")?;
                if named.insert(name, element).is_some() {
                    return Err(element.fault(format!("`{name}` is there twice")));
                }
            }
        }
        Ok(Self { model, named })
    }

    /// A frame in that of the model.
    fn pose(&self, name: &str) -> Result<Isometry3<f64>, ReadError> {
        self.pose_below(name, 0)
    }

    fn pose_below(&self, name: &str, depth: usize) -> Result<Isometry3<f64>, ReadError> {
        if matches!(name, "" | "__model__" | "world") {
            return Ok(Isometry3::identity());
        }
        let element = self.named.get(name).copied();
        let element = element.ok_or_else(|| self.model.fault(format!("has no frame `{name}`")))?;
        if depth > MOST_DEPTH {
            return Err(element.fault(format!("`{name}` is placed relative to itself")));
        }
        let (own, stated) = own_pose(element)?;
        let default = match element.tag() {
            // a joint stands in its child
            "joint" => element.text("child").unwrap_or_default(),
            "frame" => element.attribute("attached_to").unwrap_or_default(),
            _ => "",
        };
        Ok(self.pose_below(stated.unwrap_or(default), depth + 1)? * own)
    }
}

/// The pose of an element, and what it is relative to where that is stated.
fn own_pose<'a>(element: Element<'a, '_>) -> Result<(Isometry3<f64>, Option<&'a str>), ReadError> {
    let Some(pose) = element.child("pose") else { return Ok((Isometry3::identity(), None)) };
    let text = pose.node.text().unwrap_or_default();
    let relative = pose.attribute("relative_to").filter(|name| !name.is_empty());
    if pose.attribute("rotation_format") == Some("quat_xyzw") {
        let values = pose.parse_list("pose", text)?;
        let [x, y, z, i, j, k, w] = values[..] else {
            return Err(pose.value("pose", text, "seven finite numbers"));
        };
        let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        return Ok((Isometry3::from_parts(Vec3::new(x, y, z).into(), turn), relative));
    }
    if text.trim().is_empty() {
        return Ok((Isometry3::identity(), relative));
    }
    let [x, y, z, mut roll, mut pitch, mut yaw] = pose.parse_numbers::<6>("pose", text)?;
    if pose.attribute("degrees") == Some("true") {
        [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_radians);
    }
    Ok((xml::pose([x, y, z], [roll, pitch, yaw]), relative))
}

/// The joint above a link.
struct Above {
    parent: String,
    joint: Joint,
}

fn joints<'a>(model: Element<'a, '_>, frames: &Frames<'a, '_>) -> Result<HashMap<&'a str, Above>, ReadError> {
    let mut above: HashMap<&str, Above> = HashMap::new();
    for element in model.children("joint") {
        let end =
            |name: &'static str| element.text(name).ok_or_else(|| element.fault(format!("has no <{name}>")));
        let (parent, child) = (end("parent")?.to_owned(), end("child")?);
        let joint = joint(element, frames)?;
        if let Some(other) = above.insert(child, Above { parent: parent.clone(), joint }) {
            let links = vec![child.to_owned(), parent, other.parent];
            return Err(ReadError::Loop { path: model.path.to_owned(), links });
        }
    }
    Ok(above)
}

fn joint(element: Element<'_, '_>, frames: &Frames<'_, '_>) -> Result<Joint, ReadError> {
    let name = element.required("name")?;
    let kind = element.required("type")?;
    if kind == "fixed" {
        return Ok(Joint::Fixed);
    }
    // the first axis of two steers
    let axis = element.child(if kind == "revolute2" { "axis2" } else { "axis" });
    let is_turning = match kind {
        "continuous" => true,
        "revolute" | "revolute2" => axis.map_or(Ok(true), turns_without_limit)?,
        _ => false,
    };
    if !is_turning {
        return Ok(Joint::Other);
    }
    let pose = frames.pose(name)?;
    let stated = axis.and_then(|axis| axis.child("xyz"));
    let xyz =
        axis.map(|axis| axis.text_numbers::<3>("xyz")).transpose()?.flatten().unwrap_or([0.0, 0.0, 1.0]);
    let expressed = stated.and_then(|xyz| xyz.attribute("expressed_in")).filter(|frame| !frame.is_empty());
    // of SDFormat before 1.7
    let is_of_model = matches!(axis.and_then(|axis| axis.text("use_parent_model_frame")), Some("true" | "1"));
    let turn = match expressed {
        Some(frame) => frames.pose(frame)?.rotation,
        None if is_of_model => nalgebra::UnitQuaternion::identity(),
        None => pose.rotation,
    };
    let Some(unit) = Vec3::from(xyz).try_normalize(1e-9) else {
        return Err(element.fault("has an axis of length zero".to_owned()));
    };
    Ok(Joint::Turning { name: name.to_owned(), axis: turn * unit, origin: pose.translation.vector })
}

/// Two turns or more between the limits are none for a wheel.
fn turns_without_limit(axis: Element<'_, '_>) -> Result<bool, ReadError> {
    let Some(limit) = axis.child("limit") else { return Ok(true) };
    // infinite limits are written inf or 1e16
    let value = |name| limit.text(name).and_then(|text: &str| text.parse::<f64>().ok());
    Ok(match (value("lower"), value("upper")) {
        (Some(lower), Some(upper)) => upper - lower > 2.0 * TAU || (upper - lower).is_nan(),
        _ => true,
    })
}

/// Names of links, parents before children.
fn order<'a>(
    path: &Path,
    links: &[Element<'a, '_>],
    joints: &HashMap<&'a str, Above>,
) -> Result<Vec<&'a str>, ReadError> {
    let names = links.iter().map(|link| link.required("name")).collect::<Result<Vec<_>, _>>()?;
    let mut placed: Vec<&str> = Vec::new();
    let mut rest = names.clone();
    while !rest.is_empty() {
        let is_ready = |name: &&str| {
            joints.get(*name).is_none_or(|above| {
                placed.contains(&above.parent.as_str()) || !names.contains(&above.parent.as_str())
            })
        };
        let (ready, later): (Vec<&str>, Vec<&str>) = rest.iter().partition(|name| is_ready(name));
        if ready.is_empty() {
            return Err(ReadError::Loop {
                path: path.to_owned(),
                links: later.into_iter().map(str::to_owned).collect(),
            });
        }
        placed.extend(ready);
        rest = later;
    }
    Ok(placed)
}

fn shapes(
    link: Element<'_, '_>,
    frame: &Isometry3<f64>,
    frames: &Frames<'_, '_>,
    shaper: &mut Shaper,
) -> Result<Vec<Shape>, ReadError> {
    let mut shapes = Vec::new();
    for (role, element) in shaper.wanted_elements(link) {
        let (own, relative) = own_pose(element)?;
        let at = match relative {
            Some(name) => frames.pose(name)? * own,
            None => frame * own,
        };
        let geometry = element.geometry()?;
        shapes.extend(shape(link.required("name")?, geometry, (role, &at), shaper)?);
    }
    Ok(shapes)
}

fn shape(
    link: &str,
    geometry: Element<'_, '_>,
    (role, at): (Role, &Isometry3<f64>),
    shaper: &mut Shaper,
) -> Result<Option<Shape>, ReadError> {
    let number = |name: &'static str| {
        let value = geometry.text_numbers::<1>(name)?;
        value.map(|[value]| value).ok_or_else(|| geometry.fault(format!("has no <{name}>")))
    };
    let vector = |name: &'static str| {
        let value = geometry.text_numbers::<3>(name)?;
        value.map(Vec3::from).ok_or_else(|| geometry.fault(format!("has no <{name}>")))
    };
    let primitive = match geometry.tag() {
        "box" => Primitive::Box(vector("size")?),
        "cylinder" => Primitive::Cylinder(number("radius")?, number("length")?),
        "capsule" => Primitive::Capsule(number("radius")?, number("length")?),
        "sphere" => Primitive::Sphere(number("radius")?),
        "ellipsoid" => Primitive::Ellipsoid(vector("radii")?),
        "mesh" => {
            let reference = geometry.text("uri").ok_or_else(|| geometry.fault("has no <uri>".to_owned()))?;
            let scale = geometry.text_numbers("scale")?.unwrap_or([1.0; 3]);
            let submesh = geometry.child("submesh");
            if let Some(submesh) =
                submesh.filter(|submesh| matches!(submesh.text("center"), Some("true" | "1")))
            {
                return Err(submesh.fault("with <center> is not read: move the part in its file".to_owned()));
            }
            let part = submesh.and_then(|submesh| submesh.text("name"));
            let file = MeshReference { link, reference, scale, folder: "", part };
            return shaper.mesh(geometry, role, file, at).map(Some);
        }
        // the ground
        "plane" | "heightmap" | "empty" => return Ok(None),
        _ => {
            return Err(geometry.fault(
                "is no shape: box, cylinder, capsule, sphere, ellipsoid and mesh are read".to_owned(),
            ));
        }
    };
    shaper.primitive(geometry, role, primitive, at).map(Some)
}

fn inertial(link: Element<'_, '_>, frame: &Isometry3<f64>) -> Result<Option<Inertial>, ReadError> {
    let Some(element) = link.child("inertial") else { return Ok(None) };
    let Some([mass]) = element.text_numbers::<1>("mass")? else { return Ok(None) };
    let at = frame * own_pose(element)?.0;
    let mut matrix = Matrix3::zeros();
    if let Some(inertia) = element.child("inertia") {
        let entries =
            [("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2)];
        for (name, row, column) in entries {
            let value = inertia.text_numbers::<1>(name)?.map_or(0.0, |[value]| value);
            (matrix[(row, column)], matrix[(column, row)]) = (value, value);
        }
    }
    let turn = at.rotation.to_rotation_matrix().into_inner();
    let center = (at * Point3::origin()).coords;
    Ok(Some(Inertial { mass, center, inertia: turn * matrix * turn.transpose() }))
}
