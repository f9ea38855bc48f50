//! What further programs write: each robot has the volume of boxes and cylinders.

#![allow(clippy::unwrap_used)]

use wade_core::geometry::mesh::Mesh;
use wade_import::{Imported, Options};

use crate::solids::at;
use crate::write::{Folder, block, import, joint, link, placed, stl, urdf};

const HALF: [f64; 3] = [0.5, 0.3, 0.15];
/// Volume of `block(HALF)` [m3].
const VOLUME: f64 = 1.0 * 0.6 * 0.3;

fn sixty() -> Options {
    Options { mass: Some(60.0), ..Options::default() }
}

fn assert_volume(imported: &Imported, expected: f64) {
    let volume = imported.floating.displaced_volume;
    assert!((volume / expected - 1.0).abs() < 1e-5, "{volume} and not {expected}: {:?}", imported.warnings);
}

fn of_file(name: &str, bytes: impl AsRef<[u8]>) -> Imported {
    let folder = Folder::new();
    import(&[folder.write(name, bytes)], sixty()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The faces of a block that lie before its middle, and the others.
fn halves(mesh: &Mesh) -> [Mesh; 2] {
    let (front, rear): (Vec<usize>, Vec<usize>) =
        (0..mesh.faces.len()).partition(|face| mesh.face_centroid(*face).x > 0.0);
    [mesh.part(&front), mesh.part(&rear)]
}

#[test]
fn open_meshes_of_one_link_that_are_closed_together_are_its_hull() {
    let folder = Folder::new();
    let [front, rear] = halves(&block(HALF));
    folder.write("front.stl", stl(&front));
    folder.write("rear.stl", stl(&rear));
    let visual = |file: &str| format!("<visual><geometry><mesh filename=\"{file}\"/></geometry></visual>");
    // the collision shape is smaller, and is not needed
    let body = format!(
        "<link name=\"base\">{}{}<collision><geometry><box size=\"0.1 0.1 0.1\"/></geometry></collision></link>",
        visual("front.stl"),
        visual("rear.stl")
    );
    let imported = import(&[folder.write("robot.urdf", urdf(&body))], sixty()).unwrap();
    assert_volume(&imported, VOLUME);
    // as obj2mjcf writes them: a file for each material
    let model = "<mujoco><asset><mesh name=\"a\" file=\"front.stl\"/><mesh name=\"b\" file=\"rear.stl\"/></asset>\
                 <worldbody><body><freejoint/><geom type=\"mesh\" mesh=\"a\" mass=\"30\"/><geom type=\"mesh\" mesh=\"b\" mass=\"30\"/>\
                 </body></worldbody></mujoco>";
    let imported = import(&[folder.write("robot.xml", model)], Options { mass: None, ..sixty() }).unwrap();
    assert_volume(&imported, VOLUME);
}

/// An L of 1 x 1 m without a quarter, along x, as polygons of six corners and quadrilaterals.
const L: [[f64; 2]; 6] = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.5, 1.0], [0.0, 1.0]];
const L_VOLUME: f64 = 0.75 * 2.0;

/// Corners and polygons of the L, the first corner of each polygon turned by a number.
fn l_prism(turn: usize) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let corners: Vec<[f64; 3]> = [0.0, 2.0].iter().flat_map(|x| L.map(|[y, z]| [*x, y, z])).collect();
    let mut polygons: Vec<Vec<usize>> = (0..6)
        .map(|i| vec![i, i + 6, (i + 1) % 6 + 6, (i + 1) % 6])
        .map(|mut p| {
            p.reverse();
            p
        })
        .collect();
    polygons.push((0..6).rev().collect());
    polygons.push((6..12).collect());
    polygons.iter_mut().for_each(|polygon| {
        let count = polygon.len();
        polygon.rotate_left(turn % count);
    });
    (corners, polygons)
}

#[test]
fn concave_polygons_keep_their_area_wherever_they_begin() {
    for turn in 0..6 {
        let (corners, polygons) = l_prism(turn);
        let mut text = "\u{feff}# made by hand\r\nmtllib none.mtl\r\no the hull of it\r\n".to_owned();
        for [x, y, z] in &corners {
            text += &format!("v  {x} {y}\t{z} 0.5 0.5 0.5\r\n");
        }
        text += "vn 0 0 1\r\nvt 0 0\r\ns off\r\nusemtl paint\r\n";
        for polygon in &polygons {
            let indices: Vec<String> = polygon.iter().map(|i| format!("{}/1/1", i + 1)).collect();
            text += &format!("f {}\r\n", indices.join(" "));
        }
        assert_volume(&of_file("hull.obj", text.trim_end()), L_VOLUME);
        let list = |values: Vec<String>| values.join(" ");
        let dae = format!(
            "<COLLADA><asset><unit meter=\"1\"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id=\"g\"><mesh>\
             <source id=\"s\"><float_array>{}</float_array></source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\
             <polylist><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><vcount>{}</vcount><p>{}</p></polylist></mesh></geometry>\
             </library_geometries><library_visual_scenes><visual_scene><node><instance_geometry url=\"#g\"/></node></visual_scene>\
             </library_visual_scenes></COLLADA>",
            list(corners.iter().flatten().map(f64::to_string).collect()),
            list(polygons.iter().map(|polygon| polygon.len().to_string()).collect()),
            list(polygons.iter().flatten().map(usize::to_string).collect())
        );
        assert_volume(&of_file("hull.dae", dae), L_VOLUME);
    }
}

/// A rover of MuJoCo whose wheels are these bodies.
fn mujoco_rover(compiler: &str, joints: &str, geom: &str) -> String {
    let wheel = |(x, y): (f64, f64)| {
        format!(
            "<body pos=\"{x} {y} -0.1\">{joints}<geom type=\"cylinder\" size=\"0.15 0.05\" {geom} mass=\"2\"/></body>"
        )
    };
    let wheels = [(0.3, 0.36), (0.3, -0.36), (-0.3, 0.36), (-0.3, -0.36)].map(wheel).concat();
    format!(
        "<mujoco>{compiler}<worldbody><body name=\"base\" pos=\"0 0 0.2\"><freejoint/>\
         <geom type=\"box\" size=\"0.5 0.3 0.15\" mass=\"50\"/>{wheels}</body></worldbody></mujoco>"
    )
}

#[test]
fn wheels_that_are_steered_and_turned_by_joints_of_one_body_are_wheels() {
    let steered = "<joint axis=\"0 0 1\" range=\"-30 30\"/><joint axis=\"0 1 0\"/>";
    let imported = of_file("robot.xml", mujoco_rover("", steered, "euler=\"90 0 0\""));
    assert_eq!(imported.wheels.len(), 4, "{:?}", imported.notes);
    // a caster swivels without limit
    let caster = "<joint axis=\"0 0 1\"/><joint axis=\"0 1 0\"/>";
    let imported = of_file("robot.xml", mujoco_rover("", caster, "euler=\"90 0 0\""));
    assert_eq!(imported.wheels.len(), 4, "{:?}", imported.notes);
    // limits count where they are switched on, which is not everywhere the case
    let compiler = "<compiler autolimits=\"false\"/>";
    let unlimited = "<joint axis=\"0 1 0\" range=\"0 0\"/>";
    let imported = of_file("robot.xml", mujoco_rover(compiler, unlimited, "euler=\"90 0 0\""));
    assert_eq!(imported.wheels.len(), 4, "{:?}", imported.notes);
    // an attitude of the defaults gives way to one of the geom, in whatever form
    let defaults = "<default><geom quat=\"0.7071068 0 0.7071068 0\"/></default>";
    let imported =
        of_file("robot.xml", mujoco_rover(defaults, "<joint axis=\"0 1 0\"/>", "euler=\"90 0 0\""));
    assert_eq!(imported.wheels.len(), 4, "{:?}", imported.notes);
    assert!(imported.wheels.iter().all(|wheel| (wheel.width - 0.1).abs() < 1e-6), "{:?}", imported.wheels);
}

#[test]
fn joints_of_two_axes_of_an_sdf_turn_wheels_about_the_second() {
    let wheel = |(name, x, y): (&str, f64, f64)| {
        format!(
            "<link name=\"{name}\"><pose>{x} {y} -0.1 -1.5707963267948966 0 0</pose><visual name=\"v\"><geometry><cylinder>\
             <radius>0.15</radius><length>0.1</length></cylinder></geometry></visual></link>\
             <joint name=\"j_{name}\" type=\"revolute2\"><parent>base</parent><child>{name}</child>\
             <axis><xyz>0 -1 0</xyz><limit><lower>-0.5</lower><upper>0.5</upper></limit></axis>\
             <axis2><xyz>0 0 1</xyz></axis2></joint>"
        )
    };
    let wheels =
        [("a", 0.3, 0.36), ("b", 0.3, -0.36), ("c", -0.3, 0.36), ("d", -0.3, -0.36)].map(wheel).concat();
    let text = format!(
        "<sdf version=\"1.9\"><model name=\"m\"><link name=\"base\"><visual name=\"v\"><geometry><box><size>1 0.6 0.3</size></box>\
         </geometry></visual></link>{wheels}</model></sdf>"
    );
    let imported = of_file("robot.sdf", text);
    assert_eq!(imported.wheels.len(), 4, "{:?}", imported.notes);
}

#[test]
fn text_of_windows_is_read_in_its_encodings() {
    let text = urdf(&link("base", "", "<box size=\"1 0.6 0.3\"/>"));
    assert_volume(&of_file("robot.urdf", format!("\u{feff}{text}").replace('\n', "\r\n")), VOLUME);
    let wide = format!("\u{feff}{}", text.replace("version=\"1.0\"", "version=\"1.0\" encoding=\"UTF-16\""));
    let little: Vec<u8> = wide.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_volume(&of_file("robot.urdf", little), VOLUME);
    let big: Vec<u8> = wide.encode_utf16().flat_map(u16::to_be_bytes).collect();
    assert_volume(&of_file("robot.urdf", big), VOLUME);
}

/// A GLB of a mesh with indices of one byte and corners between normals, as a packer writes them.
fn packed_glb(mesh: &Mesh) -> Vec<u8> {
    let mut data: Vec<u8> = Vec::new();
    for vertex in &mesh.vertices {
        // z forward, y up; the normal follows each corner
        let corner = [vertex.y, vertex.z, vertex.x, 0.0, 1.0, 0.0];
        corner.iter().for_each(|c| data.extend((*c as f32).to_le_bytes()));
    }
    let corners = data.len();
    mesh.faces.iter().flatten().for_each(|v| data.push(*v as u8));
    let indices = data.len() - corners;
    data.resize(data.len().next_multiple_of(4), 0);
    let mut json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"indices\":1}}]}}],\"accessors\":[\
         {{\"bufferView\":0,\"componentType\":5126,\"count\":{},\"type\":\"VEC3\",\"min\":[-9,-9,-9],\"max\":[9,9,9]}},\
         {{\"bufferView\":1,\"componentType\":5121,\"count\":{indices},\"type\":\"SCALAR\"}}],\"bufferViews\":[\
         {{\"buffer\":0,\"byteLength\":{corners},\"byteStride\":24}},\
         {{\"buffer\":0,\"byteOffset\":{corners},\"byteLength\":{indices}}}],\"buffers\":[{{\"byteLength\":{}}}]}}",
        mesh.vertices.len(),
        data.len()
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let chunk =
        |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat();
    let body = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &data)].concat();
    [&b"glTF"[..], &2_u32.to_le_bytes(), &(body.len() as u32 + 12).to_le_bytes(), &body].concat()
}

#[test]
fn a_packed_glb_is_read_and_a_compressed_one_is_refused_with_the_way_out() {
    let glb = packed_glb(&block(HALF));
    let imported = of_file("robot.glb", &glb);
    assert_volume(&imported, VOLUME);
    assert!((imported.vehicle.dimensions.length - 1.0).abs() < 1e-6, "{:?}", imported.vehicle.dimensions);
    let folder = Folder::new();
    let compressed = crate::write::gltf(&[("a", block(HALF), "")])
        .replace("\"scene\":0", "\"scene\":0,\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"extensionsUsed\":[\"KHR_draco_mesh_compression\"]");
    let said = import(&[folder.write("robot.gltf", compressed)], sixty()).unwrap_err().to_string();
    assert!(said.contains("KHR_draco_mesh_compression") && said.contains("without"), "{said}");
}

#[test]
fn a_skin_over_bones_is_refused_rather_than_left_out() {
    let text = "<COLLADA><asset><up_axis>Z_UP</up_axis></asset><library_visual_scenes><visual_scene><node>\
                <instance_controller url=\"#skin\"/></node></visual_scene></library_visual_scenes></COLLADA>";
    let folder = Folder::new();
    let said = import(&[folder.write("hull.dae", text)], sixty()).unwrap_err().to_string();
    assert!(said.contains("hull.dae, line 1") && said.contains("export the file again"), "{said}");
}

#[test]
fn a_gap_of_a_tenth_of_a_millimeter_stays_and_rounding_does_not() {
    for (gap, volume) in [(1e-4, 2.0 * VOLUME), (0.0, 2.0 * VOLUME), (1e-8, 2.0 * VOLUME)] {
        let mut mesh = block(HALF);
        mesh.append(&placed(&block(HALF), &at(1.0 + gap, 0.0, 0.0), 1.0));
        let imported = of_file("both.stl", stl(&mesh));
        assert_volume(&imported, volume);
        let length = imported.vehicle.dimensions.length;
        assert!((length - 2.0 - gap).abs() < 1e-6, "{length}");
    }
}

#[test]
fn an_stl_of_several_solids_is_all_of_them() {
    let facet = |mesh: &Mesh, face: usize| {
        let corners = mesh.triangle(face).map(|v| format!("vertex {} {} {}\n", v.x, v.y, v.z)).concat();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let solid = |name: &str, mesh: &Mesh| {
        let facets: String = (0..mesh.faces.len()).map(|face| facet(mesh, face)).collect();
        format!("solid {name}\n{facets}endsolid {name}\n")
    };
    let mast = placed(&block([0.05; 3]), &at(0.0, 0.0, 0.2), 1.0);
    let text = solid("hull", &block(HALF)) + &solid("mast of facets", &mast);
    assert_volume(&of_file("robot.stl", text), VOLUME + 1e-3);
}

#[test]
fn damage_in_an_obj_is_named_with_its_line() {
    let folder = Folder::new();
    for (text, line) in [
        ("o a\nv 0,5 0 0\nv 1 0 0\n", "line 2"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 9\n", "line 5"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 b 3\n", "line 4"),
    ] {
        let said = import(&[folder.write("hull.obj", text)], sixty()).unwrap_err().to_string();
        assert!(said.contains("hull.obj") && said.contains(line), "{said}");
    }
}

#[test]
fn a_wheel_under_a_steering_knuckle_is_a_wheel() {
    let mut body = link("base", "", "<box size=\"1 0.6 0.3\"/>");
    for (name, x, y) in [("fl", 0.3, 0.4), ("fr", 0.3, -0.4), ("rl", -0.3, 0.4), ("rr", -0.3, -0.4)] {
        let (knuckle, wheel) = (format!("knuckle_{name}"), format!("wheel_{name}"));
        body += &format!("<link name=\"{knuckle}\"/>");
        body += &link(&wheel, "rpy=\"1.5707963267948966 0 0\"", "<cylinder radius=\"0.15\" length=\"0.1\"/>");
        body += &joint(
            "revolute",
            "base",
            &knuckle,
            &format!(
                "<origin xyz=\"{x} {y} -0.1\"/><axis xyz=\"0 0 1\"/><limit lower=\"-0.5\" upper=\"0.5\"/>"
            ),
        );
        body += &joint("continuous", &knuckle, &wheel, "<axis xyz=\"0 1 0\"/>");
    }
    let imported = of_file("robot.urdf", urdf(&body));
    assert_eq!(imported.wheels.len(), 4);
    let round = 96.0 / 2.0 * (std::f64::consts::TAU / 96.0).sin() * 0.15 * 0.15 * 0.1;
    assert_volume(&imported, VOLUME + 4.0 * round);
}
