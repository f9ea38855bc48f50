//! COLLADA 1.4 meshes, which robots' visual shapes often are: triangles and polygons of the scene's nodes.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Matrix4, Unit, Vector4};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Mesh;

use super::meshes::{Part, fan, strip};
use super::xml::{self, Element};
use super::{ReadError, bytes};
use crate::limits::{MOST_DEPTH, MOST_FACES, MOST_LINKS, MOST_MESH_BYTES};
use crate::shapes::scaled;

/// The parts of a file in meters with z up, a node each.
pub fn load(path: &Path) -> Result<Vec<Part>, ReadError> {
    let text = String::from_utf8_lossy(&bytes(path, MOST_MESH_BYTES)?).into_owned();
    let document = xml::parse(path, &text)?;
    let root = Element { path, node: document.root_element() };
    let asset = root.child("asset");
    let unit = match asset.and_then(|asset| asset.child("unit")) {
        Some(unit) => unit.numbers::<1>("meter")?.map_or(1.0, |[meter]| meter),
        None => 1.0,
    };
    let up = asset.and_then(|asset| asset.text("up_axis")).unwrap_or("Y_UP");
    let turn = match up {
        "Z_UP" => Matrix4::identity(),
        "X_UP" => Matrix4::from_axis_angle(&Vec3::y_axis(), -std::f64::consts::FRAC_PI_2),
        _ => Matrix4::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2),
    };
    let mut scene = Scene::of(root)?;
    let visual =
        root.children("library_visual_scenes").flat_map(|library| library.children("visual_scene")).next();
    let Some(visual) = visual else {
        return Err(ReadError::Nothing { path: path.to_owned(), what: "visual_scene" });
    };
    let frame = turn * Matrix4::new_scaling(unit);
    let mut open: Vec<(Element<'_, '_>, Matrix4<f64>, usize)> =
        visual.children("node").map(|node| (node, frame, 0)).collect();
    open.reverse();
    let (mut parts, mut seen) = (Vec::new(), 0);
    while let Some((node, above, depth)) = open.pop() {
        seen += 1;
        if seen > MOST_LINKS || depth > MOST_DEPTH {
            return Err(node.fault(format!("is one of more than {MOST_LINKS} nodes, or a node of itself")));
        }
        if let Some(skin) = node.child("instance_controller") {
            return Err(skin.fault(
                "is a skin over bones, which is not read: apply it to the mesh and export the file again"
                    .to_owned(),
            ));
        }
        let frame = above * transform(node)?;
        for instance in node.children("instance_geometry") {
            let mesh = scene.geometry(instance)?;
            let name = node.attribute("name").or(node.attribute("id")).unwrap_or("node").to_owned();
            parts.push(Part { name, mesh: under(mesh, &frame) });
        }
        for instance in node.children("instance_node") {
            let url = instance.required("url")?;
            let target = scene.nodes.get(url.trim_start_matches('#')).copied();
            let target =
                target.ok_or_else(|| instance.fault(format!("names `{url}`, which there is not")))?;
            open.push((target, frame, depth + 1));
        }
        open.extend(node.children("node").map(|child| (child, frame, depth + 1)));
    }
    Ok(parts)
}

/// What instances refer to.
struct Scene<'a, 'input> {
    geometries: HashMap<&'a str, Element<'a, 'input>>,
    nodes: HashMap<&'a str, Element<'a, 'input>>,
    read: HashMap<&'a str, Mesh>,
    faces: usize,
}

impl<'a, 'input> Scene<'a, 'input> {
    fn of(root: Element<'a, 'input>) -> Result<Self, ReadError> {
        let (mut geometries, mut nodes) = (HashMap::new(), HashMap::new());
        for geometry in root.children("library_geometries").flat_map(|library| library.children("geometry")) {
            geometries.insert(geometry.required("id")?, geometry);
        }
        for node in root.node.descendants().filter(|node| node.has_tag_name("node")) {
            node.attribute("id").iter().for_each(|id| {
                nodes.insert(*id, Element { node, ..root });
            });
        }
        Ok(Self { geometries, nodes, read: HashMap::new(), faces: 0 })
    }

    fn geometry(&mut self, instance: Element<'a, 'input>) -> Result<&Mesh, ReadError> {
        let id = instance.required("url")?.trim_start_matches('#');
        if !self.read.contains_key(id) {
            let geometry = self.geometries.get(id).copied();
            let geometry =
                geometry.ok_or_else(|| instance.fault(format!("names `{id}`, which there is not")))?;
            self.read.insert(id, mesh_of(geometry)?);
        }
        let mesh = &self.read[id];
        self.faces += mesh.faces.len();
        match self.faces > MOST_FACES {
            true => Err(ReadError::Faces { path: instance.path.to_owned(), faces: self.faces }),
            false => Ok(mesh),
        }
    }
}

/// The faces of a geometry in its own frame.
fn mesh_of(geometry: Element<'_, '_>) -> Result<Mesh, ReadError> {
    // splines and convex hulls have no faces
    let Some(mesh) = geometry.child("mesh") else { return Ok(Mesh::default()) };
    let vertices = mesh.child("vertices").ok_or_else(|| mesh.fault("has no <vertices>".to_owned()))?;
    let input = vertices.children("input").find(|input| input.attribute("semantic") == Some("POSITION"));
    let input = input.ok_or_else(|| vertices.fault("has no input POSITION".to_owned()))?;
    let id = input.required("source")?.trim_start_matches('#');
    let source = mesh.children("source").find(|source| source.attribute("id") == Some(id));
    let source = source.ok_or_else(|| input.fault(format!("names `{id}`, which there is not")))?;
    let array = source.child("float_array").ok_or_else(|| source.fault("has no <float_array>".to_owned()))?;
    let values = array.parse_list("float_array", array.node.text().unwrap_or_default())?;
    let vertices = values.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
    let mut out = Mesh { vertices, faces: Vec::new() };
    for tag in ["triangles", "polylist", "polygons", "tristrips", "trifans"] {
        for element in mesh.children(tag) {
            polygons(element, &mut out)?;
        }
    }
    Ok(out)
}

/// Appends the faces of an element, polygons as fans.
fn polygons(element: Element<'_, '_>, out: &mut Mesh) -> Result<(), ReadError> {
    let offset = |input: Element<'_, '_>| {
        input.attribute("offset").map_or(Some(0), |text| text.parse::<usize>().ok()).ok_or_else(|| {
            input.value("offset", input.attribute("offset").unwrap_or_default(), "a whole number")
        })
    };
    let (mut stride, mut position) = (0, None);
    for input in element.children("input") {
        let own = offset(input)?;
        stride = stride.max(own.saturating_add(1));
        if input.attribute("semantic") == Some("VERTEX") {
            position = Some(own);
        }
    }
    let position = position.ok_or_else(|| element.fault("has no input VERTEX".to_owned()))?;
    let numbers = |text: &str, of: Element<'_, '_>| {
        let numbers: Option<Vec<u32>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        numbers.ok_or_else(|| of.fault("holds an index that is no whole number".to_owned()))
    };
    let counts = match element.child("vcount") {
        Some(vcount) => Some(numbers(vcount.node.text().unwrap_or_default(), vcount)?),
        None => None,
    };
    for list in element.children("p") {
        let indices = numbers(list.node.text().unwrap_or_default(), list)?;
        let corners: Vec<u32> = indices.chunks_exact(stride).map(|corner| corner[position]).collect();
        let sides = match (&counts, element.tag()) {
            (_, "tristrips") => {
                out.faces.extend(strip(&corners));
                continue;
            }
            (_, "trifans") | (None, "polygons") => vec![corners.len()],
            (Some(counts), _) => counts.iter().map(|count| *count as usize).collect(),
            _ => vec![3; corners.len() / 3],
        };
        let mut rest = &corners[..];
        for count in sides {
            let Some((polygon, after)) = rest.split_at_checked(count) else {
                return Err(list.fault("holds fewer corners than its polygons have".to_owned()));
            };
            rest = after;
            out.faces.extend(fan(polygon));
        }
    }
    Ok(())
}

/// The product of a node's transforms in their order.
fn transform(node: Element<'_, '_>) -> Result<Matrix4<f64>, ReadError> {
    let mut product = Matrix4::identity();
    for child in node.node.children().filter(|child| child.is_element()) {
        let element = Element { node: child, ..node };
        let text = child.text().unwrap_or_default();
        let one = match element.tag() {
            "matrix" => {
                let values = element.parse_list("matrix", text)?;
                if values.len() != 16 {
                    return Err(element.value("matrix", text, "sixteen finite numbers"));
                }
                Matrix4::from_row_slice(&values)
            }
            "translate" => {
                let [x, y, z] = element.parse_numbers("translate", text)?;
                Matrix4::new_translation(&Vec3::new(x, y, z))
            }
            "rotate" => {
                let [x, y, z, degrees] = element.parse_numbers("rotate", text)?;
                let axis = Unit::try_new(Vec3::new(x, y, z), 1e-9);
                axis.map_or_else(Matrix4::identity, |axis| {
                    Matrix4::from_axis_angle(&axis, degrees.to_radians())
                })
            }
            "scale" => {
                let [x, y, z] = element.parse_numbers("scale", text)?;
                Matrix4::from_diagonal(&Vector4::new(x, y, z, 1.0))
            }
            _ => continue,
        };
        product *= one;
    }
    Ok(product)
}

fn under(mesh: &Mesh, frame: &Matrix4<f64>) -> Mesh {
    let mut out = scaled(mesh, &frame.fixed_view::<3, 3>(0, 0).into_owned());
    let shift: Vec3 = frame.fixed_view::<3, 1>(0, 3).into_owned();
    out.vertices.iter_mut().for_each(|v| *v += shift);
    out
}
