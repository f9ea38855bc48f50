//! Bad input is refused with what and where, and the way out.

#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use wade_core::geometry::mesh::Mesh;
use wade_import::Options;

use crate::write::{Folder, block, import, joint, link, obj, placed, stl, urdf};

fn refused(files: &[PathBuf], options: Options, parts: &[&str]) {
    let error = import(files, Options { mass: Some(1.0), ..options }).unwrap_err().to_string();
    println!("{error}");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

fn of_text(name: &str, text: impl AsRef<[u8]>, parts: &[&str]) {
    let folder = Folder::new();
    refused(&[folder.write(name, text)], Options::default(), parts);
}

#[test]
fn a_mesh_file_that_is_missing_is_named_with_the_places() {
    let body = link("base", "", "<mesh filename=\"package://rover/meshes/hull.stl\"/>");
    of_text(
        "r.urdf",
        urdf(&body),
        &["line 3", "link `base`", "package://rover/meshes/hull.stl", "command line"],
    );
    // and found when it is named
    let folder = Folder::new();
    let files =
        [folder.write("a/r.urdf", urdf(&body)), folder.write("b/hull.stl", stl(&block([0.1, 0.1, 0.1])))];
    import(&files, Options { mass: Some(1.0), ..Options::default() }).unwrap();
}

#[test]
fn loops_of_joints_and_links_without_joint_are_named() {
    let three: String = ["a", "b", "c"].map(|name| link(name, "", "<sphere radius=\"0.1\"/>")).concat();
    let ring = joint("fixed", "a", "b", "") + &joint("fixed", "b", "c", "") + &joint("fixed", "c", "a", "");
    of_text("r.urdf", urdf(&(three.clone() + &ring)), &["form a loop", "a, b, c"]);
    let two = joint("fixed", "a", "c", "") + &joint("fixed", "b", "c", "");
    of_text("r.urdf", urdf(&(three.clone() + &two)), &["two parents", "c, b, a"]);
    of_text(
        "r.urdf",
        urdf(&(three.clone() + &joint("fixed", "a", "b", ""))),
        &["no joint connects the links a, c"],
    );
    let sdf = "<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/><link name=\"b\"/>
      <joint name=\"1\" type=\"fixed\"><parent>a</parent><child>b</child></joint>
      <joint name=\"2\" type=\"fixed\"><parent>b</parent><child>a</child></joint></model></sdf>";
    of_text("r.sdf", sdf, &["form a loop", "a, b"]);
    let frames = "<sdf version=\"1.9\"><model name=\"m\"><frame name=\"f\"><pose relative_to=\"g\">0 0 0 0 0 0</pose></frame>
      <frame name=\"g\"><pose relative_to=\"f\">0 0 0 0 0 0</pose></frame>
      <link name=\"a\"><pose relative_to=\"f\">0 0 0 0 0 0</pose></link></model></sdf>";
    of_text("r.sdf", frames, &["relative to itself"]);
}

#[test]
fn bombs_of_xml_are_refused_before_they_grow() {
    let mut bomb = "<!DOCTYPE robot [<!ENTITY a0 \"aaaaaaaaaa\">".to_owned();
    for level in 1..20 {
        bomb += &format!("<!ENTITY a{level} \"{}\">", format!("&a{};", level - 1).repeat(10));
    }
    bomb += "]><robot name=\"&a19;\"/>";
    of_text("r.urdf", bomb, &["entities are not expanded"]);
    of_text(
        "r.xml",
        "<mujoco>".to_owned() + &"<body>".repeat(100_000) + &"</body>".repeat(100_000) + "</mujoco>",
        &["nested more than 200 deep"],
    );
    of_text(
        "r.urdf",
        "<robot>".to_owned() + &"<a/>".repeat(300_000) + "</robot>",
        &["at most 200000 elements"],
    );
    let external = "<!DOCTYPE r [<!ENTITY x SYSTEM \"file:///etc/passwd\">]><robot>&x;</robot>";
    of_text("r.urdf", external, &["entities are not expanded"]);
    of_text("r.urdf", vec![b' '; 17 << 20], &["bytes, at most 16777216"]);
}

#[test]
fn five_million_triangles_are_refused_with_the_way_out() {
    let folder = Folder::new();
    // a header that says so, and as many bytes
    let count = 5_000_000_u32;
    let path = folder.write("large.stl", [&[0; 80][..], &count.to_le_bytes()].concat());
    let file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
    file.set_len(84 + 50 * u64::from(count)).unwrap();
    refused(&[path], Options::default(), &["large.stl", "5000000 faces", "simplify the mesh"]);
    // many links that share one large mesh
    let line = Mesh { vertices: block([0.1; 3]).vertices, faces: block([0.1; 3]).faces.repeat(2_000) };
    folder.write("heavy.stl", stl(&line));
    let mut body = link("base", "", "<box size=\"1 1 1\"/>");
    for index in 0..200 {
        body += &link(&format!("l{index}"), "", "<mesh filename=\"heavy.stl\"/>");
        body += &joint("fixed", "base", &format!("l{index}"), "");
    }
    let robot = folder.write("robot.urdf", urdf(&body));
    refused(&[robot], Options::default(), &["triangles", "--shapes collision"]);
}

#[test]
fn open_hulls_are_refused_with_the_hole_and_sealed_when_asked() {
    let folder = Folder::new();
    let mut open = block([0.2, 0.1, 0.1]);
    // the lid: all faces that lie in z = 0.1
    open.faces.retain(|face| face.iter().any(|v| open.vertices[*v as usize].z < 0.05));
    let file = folder.write("open.stl", stl(&open));
    refused(
        std::slice::from_ref(&file),
        Options::default(),
        &["open.stl", "holes: 1", "spans 0.4472 m about (0.0000, 0.0000, 0.1000) m", "--seal"],
    );
    let second = folder.write("second.stl", stl(&open));
    refused(
        &[file.clone(), second],
        Options::default(),
        &["`open.stl`: not closed", "open too: `second.stl`"],
    );
    let options = Options { mass: Some(1.0), seal: true, ..Options::default() };
    let imported = wade_import::import(&[file], &options).unwrap();
    assert!((imported.floating.displaced_volume - 0.016).abs() < 1e-6);
    let said = imported.warnings.iter().find(|warning| warning.contains("closed by caps: 1")).unwrap();
    assert!(said.contains("l before") && said.contains("16.000 l after"), "{said}");
}

#[test]
fn inverted_hulls_are_turned_and_it_is_said() {
    let folder = Folder::new();
    let mut inverted = block([0.2, 0.1, 0.1]);
    inverted.faces.iter_mut().for_each(|face| face.swap(1, 2));
    let mut mixed = block([0.2, 0.1, 0.1]);
    mixed.faces[3].swap(1, 2);
    for (mesh, words) in [(inverted, "pointed inward"), (mixed, "against their neighbors")] {
        let file = folder.write("hull.stl", stl(&mesh));
        let imported = import(&[file], Options { mass: Some(1.0), ..Options::default() }).unwrap();
        assert!((imported.floating.displaced_volume - 0.016).abs() < 1e-6, "{words}");
        assert!(imported.warnings.iter().any(|warning| warning.contains(words)), "{:?}", imported.warnings);
    }
}

#[test]
fn sizes_that_no_vehicle_has_are_refused_with_the_unit() {
    let body = link("base", "", "<box size=\"300 200 100\"/>");
    of_text("r.urdf", urdf(&body), &["the longest edge is 300", "0.02 to 20 m", "--unit mm"]);
    let folder = Folder::new();
    let file = folder.write("hull.stl", stl(&block([50_000.0, 10.0, 10.0])));
    refused(&[file], Options::default(), &["in the files' unit", "--unit"]);
}

#[test]
fn sheets_and_nonsense_are_refused_by_name() {
    let folder = Folder::new();
    let sheet = Mesh { faces: vec![[0, 1, 2], [0, 2, 1]], vertices: block([0.1; 3]).vertices };
    let file = folder.write("sheet.stl", stl(&sheet));
    refused(&[file], Options::default(), &["sheet.stl", "without inside"]);
    of_text(
        "r.urdf",
        urdf(&link("base", "", "<box size=\"1 1\"/>")),
        &["line 3", "<box> size is `1 1`", "three finite"],
    );
    of_text("r.urdf", urdf(&link("base", "", "<box size=\"1 -1 1\"/>")), &["not positive"]);
    of_text(
        "r.urdf",
        urdf(&link("base", "xyz=\"nan 0 0\"", "<box size=\"1 1 1\"/>")),
        &["<origin> xyz is `nan 0 0`"],
    );
    of_text("r.urdf", urdf("<link name=\"a\"/>"), &["no link has a shape"]);
    of_text("r.urdf", "<robot", &["r.urdf"]);
    of_text("r.xml", "<html/>", &["neither <robot>, <sdf> nor <mujoco>"]);
    of_text("r.dae", "<COLLADA/>", &["r.dae", "visual_scene"]);
    of_text("r.step", "", &["export it as STL"]);
    of_text("r.xacro", "", &["xacro FILE"]);
    of_text("r.gltf", "{}", &["r.gltf"]);
    of_text("r.glb", "glTF rubbish", &["r.glb"]);
    of_text("r.obj", "v 0 0 0\nf 1 2 3\n", &["r.obj"]);
    of_text("r.obj", obj(&[("a", block([f64::NAN; 3]))]), &["r.obj"]);
    refused(&[folder.path().join("nowhere.stl")], Options::default(), &["nowhere.stl", "No such file"]);
    let mass = import(
        &[folder.write("b.stl", stl(&block([0.1; 3])))],
        Options { mass: Some(-1.0), ..Options::default() },
    );
    assert!(mass.unwrap_err().to_string().contains("--mass"));
}

#[test]
fn no_cut_of_a_file_makes_the_import_panic() {
    let folder = Folder::new();
    let whole = crate::write::gltf(&[("a", block([0.1; 3]), "")]);
    let robot = urdf(&(link("a", "", "<sphere radius=\"0.1\"/>")));
    for (name, bytes) in [("r.gltf", whole.as_bytes()), ("r.urdf", robot.as_bytes())] {
        for cut in (0..bytes.len()).step_by(7) {
            let file = folder.write(name, &bytes[..cut]);
            let _ = import(&[file], Options { mass: Some(1.0), ..Options::default() });
        }
    }
}

#[test]
fn no_mesh_that_crosses_itself_makes_the_import_panic() {
    let folder = Folder::new();
    let mut state = 1_u64;
    let mut random = || {
        // Knuth's constants
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    let (mut made, mut refusals) = (0, 0);
    for round in 0..60 {
        let mut mesh = block([0.1, 0.08, 0.06]);
        let jump = 0.01 * f64::from(round % 20);
        mesh.vertices.iter_mut().for_each(|v| v.iter_mut().for_each(|c| *c += jump * random()));
        mesh.append(&placed(&mesh.clone(), &nalgebra::Isometry3::translation(0.02, jump, 0.0), 1.0));
        let file = folder.write("crossing.stl", stl(&mesh));
        match import(&[file], Options { mass: Some(1.0), ..Options::default() }) {
            Ok(imported) => {
                made += 1;
                assert!(wade_core::geometry::watertight::is_closed(&imported.vehicle.hull.mesh));
                // not more than two boxes with all their corners moved out
                assert!(
                    (1e-4..0.05).contains(&imported.floating.displaced_volume),
                    "{:?}",
                    imported.floating
                );
            }
            Err(error) => {
                refusals += 1;
                assert!(error.to_string().contains("crossing.stl"), "{error}");
            }
        }
    }
    println!("{made} made, {refusals} refused");
    assert!(made > 30, "{made} of 60");
}

#[test]
fn messages_hold_words_of_the_options_and_no_names_of_the_program() {
    use wade_core::vehicle::spec::Axis;
    let folder = Folder::new();
    let file = folder.write("hull.stl", stl(&block([0.2, 0.1, 0.1])));
    let options = Options { forward: Some(Axis::PlusX), up: Some(Axis::MinusX), ..Options::default() };
    refused(&[file], options, &["--forward x and --up -x lie along one line"]);
    // the index of a position beyond its buffer, where the library panics
    let damaged =
        crate::write::gltf(&[("a", block([0.1; 3]), "")]).replace("\"POSITION\":0", "\"POSITION\":9");
    of_text("r.gltf", damaged, &["r.gltf"]);
    // and so that it stays: no message is made of a debug form
    let sources = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in [sources.clone(), sources.join("read")].iter().flat_map(|at| std::fs::read_dir(at).unwrap())
    {
        let path = entry.unwrap().path();
        let text = if path.is_file() { std::fs::read_to_string(&path).unwrap() } else { String::new() };
        let program = text.split("#[cfg(test)]").next().unwrap();
        assert!(!program.contains(":?}"), "{}", path.display());
    }
}
