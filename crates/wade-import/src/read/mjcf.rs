//! MJCF: nested bodies with geoms; <https://mujoco.readthedocs.io/en/stable/XMLreference.html>.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, UnitQuaternion};
use wade_core::frame::Vec3;
use wade_core::geometry::watertight::is_closed;

use super::builder::{MeshReference, Shaper};
use super::locate::Locator;
use super::xml::{self, Element};
use super::{ReadError, Wanted};
use crate::limits::MOST_LINKS;
use crate::mass;
use crate::scene::{Convention, Inertial, Joint, Link, Role, Scene, Shape};
use crate::shapes::Primitive;

/// Density of a geom that states neither mass nor density [kg/m3].
const DEFAULT_DENSITY: f64 = 1000.0;

/// What the compiler of a model makes other elements of, which are not read here.
const MADE_OF: [&str; 5] = ["include", "replicate", "attach", "composite", "flexcomp"];

/// Reads a model; `beside` are further files that may be its meshes.
pub fn read(path: &Path, beside: Vec<PathBuf>, wanted: Wanted) -> Result<Scene, ReadError> {
    let text = super::text(path)?;
    let document = xml::parse(path, &text)?;
    let root = Element { path, node: document.root_element() };
    let is_made = |node: &roxmltree::Node<'_, '_>| MADE_OF.iter().any(|tag| node.has_tag_name(*tag));
    if let Some(node) = root.node.descendants().find(is_made) {
        let element = Element { node, ..root };
        return Err(element
            .fault("is not read: save the compiled model as one file, as mj_saveLastXML does".to_owned()));
    }
    let mut reader = Reader::new(root, Shaper::new(Locator::new(path, beside), wanted))?;
    let mut scene =
        Scene { links: Vec::new(), convention: Convention::ROBOT, notes: Vec::new(), warnings: Vec::new() };
    let mut tops: Vec<Body<'_, '_>> = Vec::new();
    for world in root.children("worldbody") {
        let placed = reader.children(world, "body", &Isometry3::identity(), None)?;
        tops.extend(placed.into_iter().map(|placed| Body { placed, parent: None }));
    }
    let is_free = |body: &&Body<'_, '_>| {
        let element = body.placed.element;
        element.child("freejoint").is_some()
            || element.children("joint").any(|joint| joint.attribute("type") == Some("free"))
    };
    let free: Vec<&Body<'_, '_>> = tops.iter().filter(is_free).collect();
    let mut open: Vec<Body<'_, '_>> = match free[..] {
        // a robot in a scene
        [one] if tops.len() > 1 => {
            let name = one.placed.element.attribute("name").unwrap_or("body");
            scene
                .notes
                .push(format!("{} bodies in the world: `{name}`, the free one, is imported", tops.len()));
            vec![*one]
        }
        _ => tops.iter().rev().copied().collect(),
    };
    if open.is_empty() {
        return Err(ReadError::Nothing { path: path.to_owned(), what: "body in a worldbody" });
    }
    while let Some(body) = open.pop() {
        if scene.links.len() >= MOST_LINKS {
            return Err(ReadError::Many { path: path.to_owned(), what: "bodies" });
        }
        let element = body.placed.element;
        let class = element.attribute("childclass").map_or(body.placed.class, Some);
        let link = reader.link(&body, class, scene.links.len())?;
        let (own, pose) = (scene.links.len(), link.pose);
        scene.links.push(link);
        let children = reader.children(element, "body", &pose, class)?;
        open.extend(children.into_iter().rev().map(|placed| Body { placed, parent: Some(own) }));
    }
    scene.warnings.append(&mut reader.warnings);
    Ok(scene)
}

/// An element in the frames around it.
#[derive(Clone, Copy)]
struct Placed<'a, 'input> {
    element: Element<'a, 'input>,
    /// The frame that its own pose counts from, in that of the scene.
    above: Isometry3<f64>,
    /// Class of defaults that it inherits.
    class: Option<&'a str>,
}

/// A body that is still to be read.
#[derive(Clone, Copy)]
struct Body<'a, 'input> {
    placed: Placed<'a, 'input>,
    /// Its parent's number; none of a body of the world.
    parent: Option<usize>,
}

/// Attributes of the defaults of one class, by element.
type Defaults<'a> = HashMap<&'a str, HashMap<&'a str, &'a str>>;

struct Reader<'a, 'input> {
    shaper: Shaper,
    meshes: HashMap<String, Element<'a, 'input>>,
    classes: HashMap<&'a str, Defaults<'a>>,
    /// Joints that a velocity actuator drives.
    driven: HashSet<&'a str>,
    mesh_folder: &'a str,
    is_degrees: bool,
    /// True where a range is a limit without saying so.
    has_autolimits: bool,
    euler: &'a str,
    /// What looks wrong.
    warnings: Vec<String>,
}

impl<'a, 'input> Reader<'a, 'input> {
    fn new(root: Element<'a, 'input>, shaper: Shaper) -> Result<Self, ReadError> {
        // sections that stand there twice are one, in which the last word counts
        let setting =
            |name: &str| root.children("compiler").filter_map(|section| section.attribute(name)).last();
        let mut meshes = HashMap::new();
        for mesh in root.children("asset").flat_map(|asset| asset.children("mesh")) {
            let file = mesh.attribute("file").unwrap_or_default();
            let stem =
                file.rsplit('/').next().and_then(|name| name.rsplit_once('.')).map_or(file, |(stem, _)| stem);
            meshes.insert(mesh.attribute("name").unwrap_or(stem).to_owned(), mesh);
        }
        let mut classes = HashMap::new();
        for default in root.children("default") {
            read_defaults(default, None, &mut classes);
        }
        let actuators = root.children("actuator").flat_map(|actuator| actuator.children("velocity"));
        Ok(Self {
            shaper,
            meshes,
            classes,
            driven: actuators.filter_map(|actuator| actuator.attribute("joint")).collect(),
            mesh_folder: setting("meshdir").or(setting("assetdir")).unwrap_or_default(),
            is_degrees: setting("angle") != Some("radian"),
            has_autolimits: setting("autolimits") != Some("false"),
            euler: setting("eulerseq").unwrap_or("xyz"),
            warnings: Vec::new(),
        })
    }

    /// Children of that name, those in `<frame>` elements too.
    fn children(
        &self,
        of: Element<'a, 'input>,
        name: &'static str,
        above: &Isometry3<f64>,
        class: Option<&'a str>,
    ) -> Result<Vec<Placed<'a, 'input>>, ReadError> {
        let mut children = Vec::new();
        for node in of.node.children().filter(|node| node.is_element()) {
            let element = Element { node, ..of };
            if element.tag() == name {
                children.push(Placed { element, above: *above, class });
            } else if element.tag() == "frame" {
                let inner = above * self.pose(element, None)?;
                let class = element.attribute("childclass").map_or(class, Some);
                // the document is bounded in depth
                children.extend(self.children(element, name, &inner, class)?);
            }
        }
        Ok(children)
    }

    /// An attribute of an element, or that of its class of defaults.
    fn attribute(&self, element: Element<'a, 'input>, class: Option<&str>, name: &str) -> Option<&'a str> {
        let class = element.attribute("class").or(class).unwrap_or("main");
        let default = || {
            let class = self.classes.get(class).or_else(|| self.classes.get("main"))?;
            class.get(element.tag())?.get(name).copied()
        };
        element.attribute(name).or_else(default)
    }

    fn list(
        &self,
        element: Element<'a, 'input>,
        class: Option<&str>,
        name: &str,
    ) -> Result<Option<Vec<f64>>, ReadError> {
        self.attribute(element, class, name).map(|text| element.parse_list(name, text)).transpose()
    }

    fn vector<const N: usize>(
        &self,
        element: Element<'a, 'input>,
        class: Option<&str>,
        name: &str,
    ) -> Result<Option<[f64; N]>, ReadError> {
        self.attribute(element, class, name).map(|text| element.parse_numbers(name, text)).transpose()
    }

    fn link(
        &mut self,
        body: &Body<'a, 'input>,
        class: Option<&'a str>,
        number: usize,
    ) -> Result<Link, ReadError> {
        let element = body.placed.element;
        let name = element.attribute("name").map_or_else(|| format!("body {number}"), str::to_owned);
        let pose = body.placed.above * self.pose(element, None)?;
        let geoms = self.children(element, "geom", &pose, class)?;
        let roles = self.roles(&geoms);
        let (mut shapes, mut parts, mut has_others) = (Vec::new(), Vec::new(), false);
        for (Placed { element: geom, above, class }, role) in geoms.into_iter().zip(roles) {
            let Some(shape) = self.shape(&name, geom, class, (role, &above))? else { continue };
            parts.extend(self.geom_mass(geom, class, &shape)?);
            if self.shaper.wants(role) {
                shapes.push(shape);
            } else {
                has_others = true;
            }
        }
        self.warnings.extend(self.shaper.left_out(&name, !shapes.is_empty(), has_others));
        let inertial = match self.children(element, "inertial", &pose, class)?.first() {
            Some(inertial) => Some(self.inertial(inertial.element, &inertial.above)?),
            None => sum(&parts),
        };
        let joint = if body.parent.is_some() { self.joint(element, class, &pose)? } else { Joint::Fixed };
        Ok(Link { name, parent: body.parent, joint, pose, shapes, inertial })
    }

    /// What the geoms of a body are for. One that collides with nothing is only seen; those that collide are a second model of
    /// the body where they are of other groups than these, and are seen with them where they are of the same.
    fn roles(&self, geoms: &[Placed<'a, 'input>]) -> Vec<Role> {
        let off =
            |geom: &Placed<'a, 'input>, name| self.attribute(geom.element, geom.class, name) == Some("0");
        let group =
            |geom: &Placed<'a, 'input>| self.attribute(geom.element, geom.class, "group").unwrap_or("0");
        let is_visual = |geom: &Placed<'a, 'input>| off(geom, "contype") && off(geom, "conaffinity");
        let seen: HashSet<&str> = geoms.iter().filter(|geom| is_visual(geom)).map(group).collect();
        let role = |geom: &Placed<'a, 'input>| match is_visual(geom) {
            true => Role::Visual,
            false if seen.is_empty() || seen.contains(group(geom)) => Role::Both,
            false => Role::Collision,
        };
        geoms.iter().map(role).collect()
    }

    fn joint(
        &self,
        body: Element<'a, 'input>,
        class: Option<&str>,
        pose: &Isometry3<f64>,
    ) -> Result<Joint, ReadError> {
        let joints = self.children(body, "joint", pose, class)?;
        // of several the last one turns the shapes, those before it steer or spring
        let turning = joints.iter().rfind(|joint| self.turns_without_limit(joint));
        let Some(&Placed { element: joint, above: pose, class }) = turning else {
            return Ok(if joints.is_empty() { Joint::Fixed } else { Joint::Other });
        };
        let name = joint.attribute("name").unwrap_or_default();
        let axis = Vec3::from(self.vector(joint, class, "axis")?.unwrap_or([0.0, 0.0, 1.0]));
        let Some(unit) = axis.try_normalize(1e-9) else {
            return Err(joint.fault("has an axis of length zero".to_owned()));
        };
        let at = Vec3::from(self.vector(joint, class, "pos")?.unwrap_or([0.0; 3]));
        let origin = (pose * nalgebra::Point3::from(at)).coords;
        Ok(Joint::Turning { name: name.to_owned(), axis: pose.rotation * unit, origin })
    }

    fn turns_without_limit(&self, joint: &Placed<'a, 'input>) -> bool {
        let attribute = |name| self.attribute(joint.element, joint.class, name);
        let is_limited = match attribute("limited") {
            Some("true") => true,
            Some("false") => false,
            _ => self.has_autolimits && attribute("range").is_some(),
        };
        let is_driven = self.driven.contains(joint.element.attribute("name").unwrap_or_default());
        attribute("type").unwrap_or("hinge") == "hinge" && (!is_limited || is_driven)
    }

    /// Position and attitude of an element in its parent.
    fn pose(&self, element: Element<'a, 'input>, class: Option<&str>) -> Result<Isometry3<f64>, ReadError> {
        let at = Vec3::from(self.vector(element, class, "pos")?.unwrap_or([0.0; 3]));
        Ok(Isometry3::from_parts(at.into(), self.attitude(element, class)?))
    }

    fn attitude(
        &self,
        element: Element<'a, 'input>,
        class: Option<&str>,
    ) -> Result<UnitQuaternion<f64>, ReadError> {
        let angle = |value: f64| if self.is_degrees { value.to_radians() } else { value };
        let no_direction = || element.fault("has a direction of length zero".to_owned());
        if let Some([x, y, z, turn]) = self.vector(element, class, "axisangle")? {
            let axis = nalgebra::Unit::try_new(Vec3::new(x, y, z), 1e-9).ok_or_else(no_direction)?;
            return Ok(UnitQuaternion::from_axis_angle(&axis, angle(turn)));
        }
        if let Some(angles) = self.vector::<3>(element, class, "euler")? {
            return Ok(self.euler(angles.map(angle)));
        }
        if let Some(axes) = self.list(element, class, "xyaxes")? {
            let [a, b, c, d, e, f] = axes[..] else {
                return Err(element.fault("has xyaxes that are not six numbers".to_owned()));
            };
            let x = Vec3::new(a, b, c).try_normalize(1e-9).ok_or_else(no_direction)?;
            let y = Vec3::new(d, e, f);
            let y = (y - x * x.dot(&y)).try_normalize(1e-9).ok_or_else(no_direction)?;
            let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            return Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)));
        }
        if let Some(z) = self.vector::<3>(element, class, "zaxis")? {
            return Ok(towards(&Vec3::from(z)));
        }
        // last: in MuJoCo the other forms replace a quaternion, which may be that of the defaults
        let Some([w, x, y, z]) = self.vector(element, class, "quat")? else {
            return Ok(UnitQuaternion::identity());
        };
        UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).ok_or_else(no_direction)
    }

    /// Small letters turn about the axes that moved, capitals about those that stand.
    fn euler(&self, angles: [f64; 3]) -> UnitQuaternion<f64> {
        let mut turn = UnitQuaternion::identity();
        for (letter, angle) in self.euler.chars().zip(angles) {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vec3::x_axis(),
                'y' => Vec3::y_axis(),
                _ => Vec3::z_axis(),
            };
            let one = UnitQuaternion::from_axis_angle(&axis, angle);
            turn = if letter.is_ascii_lowercase() { turn * one } else { one * turn };
        }
        turn
    }

    fn shape(
        &mut self,
        link: &str,
        geom: Element<'a, 'input>,
        class: Option<&str>,
        (role, frame): (Role, &Isometry3<f64>),
    ) -> Result<Option<Shape>, ReadError> {
        let default = if self.attribute(geom, class, "mesh").is_some() { "mesh" } else { "sphere" };
        let kind = self.attribute(geom, class, "type").unwrap_or(default);
        let size = self.list(geom, class, "size")?.unwrap_or_default();
        let at = |index: usize| {
            size.get(index).copied().ok_or_else(|| geom.fault(format!("`{kind}` has too few sizes")))
        };
        let (ends, pose) = match self.list(geom, class, "fromto")? {
            Some(ends) => {
                let [a, b, c, d, e, f] = ends[..] else {
                    return Err(geom.fault("has a fromto that is not six numbers".to_owned()));
                };
                let (from, to) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
                let pose = Isometry3::from_parts(((from + to) * 0.5).into(), towards(&(to - from)));
                (Some((to - from).norm()), pose)
            }
            None => (None, self.pose(geom, class)?),
        };
        let pose = frame * pose;
        let half = |index: usize| ends.map_or_else(|| at(index), |length| Ok(0.5 * length));
        let primitive = match kind {
            "box" if ends.is_some() => Primitive::Box(Vec3::new(2.0 * at(0)?, 2.0 * at(0)?, 2.0 * half(2)?)),
            "box" => Primitive::Box(Vec3::new(at(0)?, at(1)?, at(2)?) * 2.0),
            "sphere" => Primitive::Sphere(at(0)?),
            "cylinder" => Primitive::Cylinder(at(0)?, 2.0 * half(1)?),
            "capsule" => Primitive::Capsule(at(0)?, 2.0 * half(1)?),
            "ellipsoid" if ends.is_some() => Primitive::Ellipsoid(Vec3::new(at(0)?, at(0)?, half(2)?)),
            "ellipsoid" => Primitive::Ellipsoid(Vec3::new(at(0)?, at(1)?, at(2)?)),
            "mesh" => return self.mesh(link, geom, class, (role, &pose)).map(Some),
            // the ground
            "plane" | "hfield" => return Ok(None),
            _ => {
                return Err(geom.value(
                    "type",
                    kind,
                    "one of box, sphere, cylinder, capsule, ellipsoid, mesh, plane and hfield",
                ));
            }
        };
        self.shaper.primitive(geom, role, primitive, &pose).map(Some)
    }

    fn mesh(
        &mut self,
        link: &str,
        geom: Element<'a, 'input>,
        class: Option<&str>,
        (role, pose): (Role, &Isometry3<f64>),
    ) -> Result<Shape, ReadError> {
        let name = self.attribute(geom, class, "mesh").unwrap_or_default();
        let Some(&asset) = self.meshes.get(name) else {
            return Err(geom.fault(format!("names the mesh `{name}`, which is no asset")));
        };
        let Some(reference) = asset.attribute("file") else {
            return Err(asset.fault(format!("`{name}` has no file: meshes of vertices are not read")));
        };
        let scale = self.vector(asset, None, "scale")?.unwrap_or([1.0; 3]);
        let folder = self.mesh_folder;
        // MuJoCo takes the frame of the mesh off its corners, and then scales them
        let at = Vec3::from(self.vector(asset, None, "refpos")?.unwrap_or([0.0; 3]));
        let [w, x, y, z] = self.vector(asset, None, "refquat")?.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9);
        let turn = turn.ok_or_else(|| asset.fault("has a direction of length zero".to_owned()))?;
        if turn.angle() > 0.0 && scale.iter().any(|other| *other != scale[0]) {
            return Err(
                asset.fault("has a refquat and a scale that differs by axis, which are not read".to_owned())
            );
        }
        let frame = Isometry3::from_parts(at.component_mul(&Vec3::from(scale)).into(), turn);
        let file = MeshReference { link, reference, scale, folder, part: None };
        self.shaper.mesh(geom, role, file, &(pose * frame.inverse()))
    }

    /// Mass of a geom by its own statement or by density; none for an open mesh.
    fn geom_mass(
        &self,
        geom: Element<'a, 'input>,
        class: Option<&str>,
        shape: &Shape,
    ) -> Result<Option<Inertial>, ReadError> {
        let mass = self.vector::<1>(geom, class, "mass")?.map(|[mass]| mass);
        let density = self.vector::<1>(geom, class, "density")?.map_or(DEFAULT_DENSITY, |[density]| density);
        let (mesh, _) = wade_core::geometry::tidy::tidy(shape.mesh.clone());
        let volume = mesh.volume();
        if !is_closed(&mesh) || volume <= 0.0 {
            return Ok(None);
        }
        let density = mass.map_or(density, |mass| mass / volume);
        Ok((density > 0.0).then(|| mass::solid(&mesh, density)))
    }

    fn inertial(&self, element: Element<'a, 'input>, frame: &Isometry3<f64>) -> Result<Inertial, ReadError> {
        let [mass] = element.numbers::<1>("mass")?.ok_or_else(|| element.fault("has no mass".to_owned()))?;
        let at = frame * self.pose(element, None)?;
        let diagonal = element.numbers::<3>("diaginertia")?.unwrap_or([0.0; 3]);
        let mut matrix = Matrix3::from_diagonal(&Vec3::from(diagonal));
        if let Some(full) = element.numbers::<6>("fullinertia")? {
            let [xx, yy, zz, xy, xz, yz] = full;
            matrix = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        }
        let turn = at.rotation.to_rotation_matrix().into_inner();
        let center = at.translation.vector;
        Ok(Inertial { mass, center, inertia: turn * matrix * turn.transpose() })
    }
}

/// The turn that brings z to a direction.
fn towards(direction: &Vec3) -> UnitQuaternion<f64> {
    let turn = UnitQuaternion::rotation_between(&Vec3::z(), direction);
    turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI))
}

fn read_defaults<'a>(
    default: Element<'a, '_>,
    above: Option<&str>,
    classes: &mut HashMap<&'a str, Defaults<'a>>,
) {
    let name = default.attribute("class").unwrap_or("main");
    let mut own: Defaults<'a> = above.and_then(|above| classes.get(above)).cloned().unwrap_or_default();
    for element in default.node.children().filter(|node| node.is_element()) {
        let attributes = own.entry(element.tag_name().name()).or_default();
        attributes.extend(element.attributes().map(|attribute| (attribute.name(), attribute.value())));
    }
    classes.insert(name, own);
    // the document is bounded in depth
    default.children("default").for_each(|inner| read_defaults(inner, Some(name), classes));
}

/// Mass of the geoms of a body.
fn sum(parts: &[Inertial]) -> Option<Inertial> {
    let mass: f64 = parts.iter().map(|part| part.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let center = parts.iter().map(|part| part.center * part.mass).sum::<Vec3>() / mass;
    let inertia = parts.iter().map(|part| part.inertia + mass::steiner(part, &center)).sum();
    Some(Inertial { mass, center, inertia })
}
