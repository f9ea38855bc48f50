//! Forms in which other programs and people write robots and meshes. Every expected volume is one of boxes.

#![allow(clippy::unwrap_used)]

use nalgebra::Isometry3;
use wade_core::geometry::mesh::Mesh;
use wade_import::{Imported, Options, Shapes};

use crate::solids::at;
use crate::write::{Folder, block, import, joint, link, placed, stl, urdf};

/// Volume of `block(HALF)` [m3].
const VOLUME: f64 = 1.0 * 0.6 * 0.3;
const HALF: [f64; 3] = [0.5, 0.3, 0.15];

fn sixty() -> Options {
    Options { mass: Some(60.0), ..Options::default() }
}

fn moved(half: [f64; 3], pose: &Isometry3<f64>) -> Mesh {
    placed(&block(half), pose, 1.0)
}

fn with(mesh: &Mesh, more: &[Mesh]) -> Mesh {
    let mut all = mesh.clone();
    more.iter().for_each(|mesh| all.append(mesh));
    all
}

fn inside_out(mesh: &Mesh) -> Mesh {
    Mesh { vertices: mesh.vertices.clone(), faces: mesh.faces.iter().map(|[a, b, c]| [*a, *c, *b]).collect() }
}

fn assert_volume(imported: &Imported, expected: f64) {
    let volume = imported.floating.displaced_volume;
    assert!((volume / expected - 1.0).abs() < 1e-5, "{volume} and not {expected}: {:?}", imported.warnings);
}

fn of_stl(mesh: &Mesh, options: Options) -> Imported {
    let folder = Folder::new();
    import(&[folder.write("robot.stl", stl(mesh))], options).unwrap()
}

fn of_text(name: &str, text: &str) -> Imported {
    let folder = Folder::new();
    import(&[folder.write(name, text)], Options::default()).unwrap()
}

fn refusal(name: &str, text: &str) -> String {
    let folder = Folder::new();
    import(&[folder.write(name, text)], sixty()).unwrap_err().to_string()
}

#[test]
fn what_lies_in_a_closed_part_displaces_nothing() {
    let inner = block([0.45, 0.25, 0.1]);
    let folder = Folder::new();
    folder.write("meshes/hull.stl", stl(&with(&block(HALF), std::slice::from_ref(&inner))));
    let body = link("base", "", "<mesh filename=\"package://robot/meshes/hull.stl\"/>");
    let imported = import(&[folder.write("robot.urdf", urdf(&body))], sixty()).unwrap();
    assert_volume(&imported, VOLUME);
    assert!(
        imported.warnings.iter().any(|said| said.contains("lie inside others")),
        "{:?}",
        imported.warnings
    );
    // one that begins inside and reaches out counts as far as it does
    let through = moved([0.5, 0.1, 0.1], &at(0.25, 0.0, 0.0));
    assert_volume(
        &of_stl(&with(&block(HALF), std::slice::from_ref(&through)), sixty()),
        VOLUME + 0.25 * 0.2 * 0.2,
    );
    assert_volume(&of_stl(&with(&through, &[block(HALF)]), sixty()), VOLUME + 0.25 * 0.2 * 0.2);
    // a tank, inside out as a whole, and one with a payload in its cavity
    let tank = with(&block(HALF), &[inside_out(&inner)]);
    assert_volume(&of_stl(&inside_out(&tank), sixty()), VOLUME);
    assert_volume(&of_stl(&with(&tank, &[block([0.2; 3].map(|half| half * 0.4))]), sixty()), VOLUME);
}

#[test]
fn a_solid_that_is_written_twice_or_for_both_sides_counts_once() {
    let hull = block(HALF);
    assert_volume(&of_stl(&with(&hull, std::slice::from_ref(&hull)), sixty()), VOLUME);
    let imported = of_stl(&with(&hull, &[inside_out(&hull)]), sixty());
    assert_volume(&imported, VOLUME);
    assert!(
        imported.warnings.iter().any(|said| said.contains("once for each side")),
        "{:?}",
        imported.warnings
    );
    let mut one_face = hull.clone();
    one_face.faces.push(hull.faces[0]);
    assert_volume(&of_stl(&one_face, sixty()), VOLUME);
}

#[test]
fn a_concave_rim_is_closed_by_a_cap_of_its_own_form() {
    // a channel of U form along x, open at both ends: 0.3 m2 of 1 m2 are legs and floor
    let outline =
        [[-0.5, 0.0], [0.5, 0.0], [0.5, 0.4], [0.4, 0.4], [0.4, 0.1], [-0.4, 0.1], [-0.4, 0.4], [-0.5, 0.4]];
    let mut mesh = Mesh::default();
    for x in [-0.5, 0.5] {
        mesh.vertices.extend(outline.map(|[y, z]| nalgebra::Vector3::new(x, y, z)));
    }
    for side in 0..8_u32 {
        let next = (side + 1) % 8;
        mesh.faces.extend([[side, side + 8, next], [next, side + 8, next + 8]]);
    }
    let imported = of_stl(&mesh, Options { seal: true, ..sixty() });
    assert_volume(&imported, 1.0 * 0.1 + 2.0 * 0.1 * 0.3);
}

#[test]
fn one_wheel_inside_out_stays_a_wheel() {
    let wheel = |x: f64, y: f64| {
        let pose = Isometry3::new([x, y, 0.0].into(), [std::f64::consts::FRAC_PI_2, 0.0, 0.0].into());
        placed(&crate::write::ring(0.02, 0.12, 0.04, 64), &pose, 1.0)
    };
    let body = moved([0.4, 0.2, 0.05], &at(0.0, 0.0, 0.2));
    let others = [wheel(0.3, 0.3), wheel(0.3, -0.3), wheel(-0.3, 0.3)];
    let right = of_stl(&with(&with(&body, &others), &[wheel(-0.3, -0.3)]), sixty());
    let turned = of_stl(&with(&with(&body, &others), &[inside_out(&wheel(-0.3, -0.3))]), sixty());
    assert_eq!(right.wheels.len(), 4);
    assert_eq!(turned.wheels.len(), 4);
    assert_volume(&turned, right.floating.displaced_volume);
}

/// A rover of MuJoCo with further elements in its body.
fn rover(inside: &str) -> String {
    format!(
        "<mujoco><worldbody><body name=\"base\" pos=\"0 0 0.2\"><freejoint/>\
         <geom type=\"box\" size=\"0.5 0.3 0.15\" mass=\"50\"/>{inside}</body></worldbody></mujoco>"
    )
}

fn wheels(of: &str) -> String {
    [("fl", 0.4, 0.4), ("fr", 0.4, -0.4), ("rl", -0.4, 0.4), ("rr", -0.4, -0.4)]
        .map(|(name, x, y)| {
            format!(
                "<body name=\"{name}\" pos=\"{x} {y} -0.1\"><joint axis=\"0 1 0\"/>\
                 <geom type=\"cylinder\" size=\"0.15 0.05\" {of} mass=\"2\"/></body>"
            )
        })
        .concat()
}

#[test]
fn a_geom_that_collides_with_nothing_hides_no_other() {
    let lamp = "<geom type=\"box\" size=\"0.05 0.05 0.05\" pos=\"0.4 0 0.2\" contype=\"0\" conaffinity=\"0\" mass=\"0\"/>";
    assert_volume(&of_text("robot.xml", &rover(lamp)), VOLUME + 1e-3);
    // in another group it is the seen form of a body that collides as a box
    let seen = lamp.replace("pos=\"0.4 0 0.2\"", "group=\"2\"");
    assert_volume(&of_text("robot.xml", &rover(&seen)), 1e-3);
}

#[test]
fn frames_of_mujoco_place_what_is_in_them_and_what_its_compiler_makes_is_refused() {
    let turned = wheels("euler=\"90 0 0\"");
    let plain = of_text("robot.xml", &rover(&turned));
    assert_eq!(plain.wheels.len(), 4);
    let framed = of_text(
        "robot.xml",
        &rover(&format!("<frame pos=\"0 0 -0.05\"><frame pos=\"0 0 0.05\">{turned}</frame></frame>")),
    );
    assert_eq!(framed.wheels, plain.wheels);
    // the turn of the wheels by their frame
    let by_frame = [(0.4, 0.4), (0.4, -0.4), (-0.4, 0.4), (-0.4, -0.4)].map(|(x, y)| {
        format!(
            "<frame pos=\"{x} {y} -0.1\" euler=\"90 0 0\"><body><joint axis=\"0 0 1\"/>\
             <geom type=\"cylinder\" size=\"0.15 0.05\" mass=\"2\"/></body></frame>"
        )
    });
    let framed = of_text("robot.xml", &rover(&by_frame.concat()));
    assert_eq!(framed.wheels.len(), 4);
    assert_volume(&framed, plain.floating.displaced_volume);
    for made in [
        "<replicate count=\"2\" offset=\"1 0 0\"><geom size=\"0.1\"/></replicate>",
        "<attach model=\"m\" prefix=\"a\"/>",
    ] {
        assert!(refusal("robot.xml", &rover(made)).contains("mj_saveLastXML"));
    }
}

#[test]
fn compilers_that_stand_there_twice_are_one_and_the_frame_of_a_mesh_is_taken_off() {
    let radian = wheels("euler=\"1.5707963 0 0\"");
    let twice = rover(&radian)
        .replace("<mujoco>", "<mujoco><compiler angle=\"radian\"/><compiler autolimits=\"true\"/>");
    assert_eq!(of_text("robot.xml", &twice).wheels.len(), 4);
    let folder = Folder::new();
    folder.write("hull.stl", stl(&placed(&block(HALF), &Isometry3::identity(), 1000.0)));
    // MuJoCo 3.3 has this mesh from -0.45 to -0.15 m in z, 0.6 m long and 1 m wide
    let model = "<mujoco><asset><mesh name=\"hull\" file=\"hull.stl\" scale=\"0.001 0.001 0.001\" refpos=\"0 0 300\" \
                 refquat=\"0.70710678 0 0 0.70710678\"/></asset><worldbody><body><freejoint/>\
                 <geom type=\"mesh\" mesh=\"hull\" mass=\"60\"/><geom type=\"box\" size=\"0.1 0.1 0.1\" mass=\"1\"/>\
                 </body></worldbody></mujoco>";
    let size = import(&[folder.write("robot.xml", model)], Options::default()).unwrap().vehicle.dimensions;
    assert!((size.length - 0.6).abs() < 1e-5 && (size.width - 1.0).abs() < 1e-5, "{size:?}");
    assert!((size.height - 0.55).abs() < 1e-5, "{size:?}");
}

#[test]
fn macros_that_were_not_expanded_are_refused_with_the_command() {
    let body = link("base", "", "<box size=\"1 0.6 0.3\"/>") + "<xacro:wheel prefix=\"fl\"/>";
    let robot = urdf(&body).replace("<robot ", "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" ");
    assert!(robot.contains("xmlns"), "{robot}");
    let said = refusal("robot.urdf", &robot);
    assert!(said.contains("xacro FILE"), "{said}");
    let said = refusal("robot.urdf", &urdf(&link("base", "", "<box size=\"${length} 0.6 0.3\"/>")));
    assert!(said.contains("xacro FILE"), "{said}");
}

#[test]
fn a_link_without_the_shapes_that_are_asked_for_is_named() {
    let visual =
        "<link name=\"mast\"><visual><geometry><box size=\"0.1 0.1 0.5\"/></geometry></visual></link>";
    let both = "<link name=\"base\"><visual><geometry><box size=\"1 0.6 0.3\"/></geometry></visual>\
                <collision><geometry><box size=\"1 0.6 0.3\"/></geometry></collision></link>";
    let body = format!("{both}{visual}{}", joint("fixed", "base", "mast", ""));
    let folder = Folder::new();
    let file = folder.write("robot.urdf", urdf(&body));
    let imported = import(&[file], Options { shapes: Shapes::Collision, ..sixty() }).unwrap();
    assert_volume(&imported, VOLUME);
    let said = imported.warnings.iter().find(|said| said.contains("`mast`")).unwrap();
    assert!(said.contains("--shapes collision"), "{said}");
}

#[test]
fn of_two_files_of_one_name_each_mesh_finds_its_own() {
    let folder = Folder::new();
    let small = folder.write("front/part.stl", stl(&block([0.1, 0.1, 0.1])));
    let large = folder.write("rear/part.stl", stl(&block(HALF)));
    let body = link("base", "", "<mesh filename=\"package://robot/rear/part.stl\"/>")
        + &link("nose", "xyz=\"2 0 0\"", "<mesh filename=\"package://robot/front/part.stl\"/>")
        + &joint("fixed", "base", "nose", "");
    let robot = folder.write("elsewhere/robot.urdf", urdf(&body));
    let imported = import(&[robot, small, large], sixty()).unwrap();
    assert_volume(&imported, VOLUME + 8e-3);
}

#[test]
fn addresses_with_encoded_blanks_name_files_with_blanks() {
    let folder = Folder::new();
    let mesh = folder.write("my meshes/a hull.stl", stl(&block(HALF)));
    let address = format!("file://{}", mesh.display()).replace(' ', "%20");
    let body = link("base", "", &format!("<mesh filename=\"{address}\"/>"));
    assert_volume(&import(&[folder.write("robot.urdf", urdf(&body))], sixty()).unwrap(), VOLUME);
}

#[test]
fn strips_of_triangles_are_faces_too() {
    let corners = block(HALF);
    let values: Vec<String> = corners.vertices.iter().map(|v| format!("{} {} {}", v.x, v.y, v.z)).collect();
    // the two triangles of a side as a strip: the third corner of the second one comes last
    let strips: String = corners
        .faces
        .chunks_exact(2)
        .map(|side| {
            let [a, b, c] = side[0];
            let last = side[1].into_iter().find(|corner| !side[0].contains(corner)).unwrap();
            // the edge that both have lies between the second and the third corner
            let shared = |p: &u32, q: &u32| side[1].contains(p) && side[1].contains(q);
            let [first, second, third] = if shared(&b, &c) {
                [a, b, c]
            } else if shared(&c, &a) {
                [b, c, a]
            } else {
                [c, a, b]
            };
            format!("<p>{first} {second} {third} {last}</p>")
        })
        .collect();
    let text = format!(
        "<COLLADA><asset><unit meter=\"1\"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id=\"g\"><mesh>\
         <source id=\"s\"><float_array>{}</float_array></source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\
         <tristrips><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>{strips}</tristrips></mesh></geometry></library_geometries>\
         <library_visual_scenes><visual_scene><node><instance_geometry url=\"#g\"/></node></visual_scene></library_visual_scenes></COLLADA>",
        values.join(" ")
    );
    let folder = Folder::new();
    assert_volume(&import(&[folder.write("robot.dae", text)], sixty()).unwrap(), VOLUME);
}

#[test]
fn an_sdf_names_one_part_of_a_file_and_turns_wheels_about_axes_of_its_model() {
    let folder = Folder::new();
    let parts = crate::write::obj(&[("hull", block(HALF)), ("trailer", moved(HALF, &at(3.0, 0.0, 0.0)))]);
    folder.write("two.obj", parts);
    let model = |name: &str| {
        format!(
            "<sdf version=\"1.5\"><world name=\"w\"><model name=\"ground\"><static>true</static><link name=\"g\"><visual name=\"v\">\
             <geometry><plane/></geometry></visual></link></model><model name=\"m\"><link name=\"base\"><visual name=\"v\"><geometry>\
             <mesh><uri>two.obj</uri><submesh><name>{name}</name></submesh></mesh></geometry></visual></link></model></world></sdf>"
        )
    };
    assert_volume(&import(&[folder.write("robot.sdf", model("hull"))], sixty()).unwrap(), VOLUME);
    let said = import(&[folder.write("robot.sdf", model("boat"))], sixty()).unwrap_err().to_string();
    assert!(said.contains("`boat`") && said.contains("hull, trailer"), "{said}");
}

/// An ASCII STL as this exporter writes it: its keywords, its line ends and what stands before each line.
fn ascii_stl(mesh: &Mesh, upper: bool, end: &str, indent: &str) -> String {
    let word = |text: &str| if upper { text.to_uppercase() } else { text.to_owned() };
    let corner = |v: &nalgebra::Vector3<f64>| {
        format!("{indent}{indent}{}\t{:e} {:e}\t{:e}{end}", word("vertex"), v.x, v.y, v.z)
    };
    let facet = |face: usize| {
        let corners: String = mesh.triangle(face).iter().map(corner).collect();
        let (begin, ends) = (word("facet normal 0 0 0"), word("endloop"));
        let outer = word("outer loop");
        format!(
            "{indent}{begin}{end}{indent}{outer}{end}{corners}{indent}{ends}{end}{}{end}",
            word("endfacet")
        )
    };
    let facets: String = (0..mesh.faces.len()).map(facet).collect();
    format!("{} Hull of mine{end}{facets}{}{end}", word("solid"), word("endsolid Hull of mine"))
}

#[test]
fn an_stl_is_read_whatever_its_capitals_line_ends_tabs_and_first_bytes_are() {
    let hull = block(HALF);
    let mut forms = Vec::new();
    for upper in [false, true] {
        for (end, indent) in [("\n", "  "), ("\r\n", "\t"), ("\r", " "), (" ", "")] {
            let text = ascii_stl(&hull, upper, end, indent);
            // the rest of the first line is the name, so a file of one line cannot be one
            let text = if end == " " { text.replacen("mine ", "mine\n", 1) } else { text };
            forms.extend([text.clone(), format!("\u{feff}{text}"), format!("\n\t{text}\n\n")]);
        }
    }
    let folder = Folder::new();
    for text in forms {
        assert_volume(&import(&[folder.write("HULL.STL", &text)], sixty()).unwrap(), VOLUME);
    }
    // binary, whatever its header says
    for header in [&b"solid hull"[..], b"SOLID hull\r\nfacet normal", b"\xef\xbb\xbfsolid"] {
        let mut bytes = stl(&hull);
        bytes[..80].fill(b' ');
        bytes[..header.len()].copy_from_slice(header);
        assert_volume(&import(&[folder.write("hull.stl", &bytes)], sixty()).unwrap(), VOLUME);
        bytes.pop();
        let said = import(&[folder.write("hull.stl", &bytes)], sixty()).unwrap_err().to_string();
        let declared = format!("declares {} faces", hull.faces.len());
        assert!(said.contains(&declared) && said.contains("truncated"), "{said}");
    }
}

#[test]
fn both_ends_of_the_sizes_that_are_promised_are_imported() {
    let cube = |edge: f64, offset: f64| {
        urdf(&link(
            "base",
            &format!("xyz=\"{offset} 0 0\""),
            &format!("<box size=\"{edge} {edge} {edge}\"/>"),
        ))
    };
    for (edge, offset) in [(0.02, 0.0), (0.02, 10.1), (20.0, 0.0), (20.0, 0.3)] {
        assert_volume(&of_text("robot.urdf", &cube(edge, offset)), edge.powi(3));
        let mesh = moved([0.5 * edge; 3], &at(offset, 0.0, 0.0));
        for (drawn, scale) in [(1.0, 1.0), (1e3, 1e-3), (1.0 / 0.0254, 0.0254)] {
            let mesh = placed(&mesh, &Isometry3::identity(), drawn);
            let imported = of_stl(&mesh, Options { scale: Some(scale), mass: None, ..sixty() });
            let volume = imported.floating.displaced_volume;
            assert!((volume / edge.powi(3) - 1.0).abs() < 1e-3, "{volume} {edge}");
        }
    }
    for edge in [0.0199, 20.1] {
        assert!(refusal("robot.urdf", &cube(edge, 0.0)).contains("0.02 to 20 m"));
    }
}

/// An OBJ in which a word begins a group of faces, by number; the corners stand there once, or once more for each group.
fn grouped_obj(mesh: &Mesh, word: &str, is_shared: bool, group_of: impl Fn(usize) -> usize) -> String {
    let corners = |mesh: &Mesh| -> String {
        mesh.vertices.iter().map(|v| format!("v {} {} {}\r\n", v.x, v.y, v.z)).collect()
    };
    let groups = (0..mesh.faces.len()).map(&group_of).max().unwrap() + 1;
    let mut text = if is_shared { corners(mesh) } else { String::new() };
    for group in 0..groups {
        let faces = (0..mesh.faces.len()).filter(|face| group_of(*face) == group).collect::<Vec<_>>();
        let own = if is_shared { mesh.clone() } else { mesh.part(&faces) };
        let listed = if is_shared { faces } else { (0..own.faces.len()).collect() };
        text += &format!("{word} piece_{group}\r\n");
        if !is_shared {
            text += &corners(&own);
        }
        for face in listed {
            // from the last corner back
            let [a, b, c] = own.faces[face].map(|corner| i64::from(corner) - own.vertices.len() as i64);
            text += &format!("f {a} {b} {c}\r\n");
        }
    }
    text
}

#[test]
fn groups_of_an_obj_that_are_closed_together_alone_are_one_solid() {
    let hull = block(HALF);
    let folder = Folder::new();
    for word in ["o", "g", "usemtl"] {
        for is_shared in [true, false] {
            // a group for each face, two open halves, and two with no order in them
            let ways: [&dyn Fn(usize) -> usize; 3] =
                [&|face| face, &|face| usize::from(face >= hull.faces.len() / 2), &|face| face * 7 % 5];
            for group_of in ways {
                let text = grouped_obj(&hull, word, is_shared, group_of);
                let imported = import(&[folder.write("hull.obj", text)], sixty()).unwrap();
                assert_volume(&imported, VOLUME);
                // a material begins no group
                let is_said =
                    imported.notes.iter().any(|note| note.contains("joined where their edges meet"));
                assert!(is_said || word == "usemtl", "{:?}", imported.notes);
            }
        }
    }
    // wheels with a group for each facet stay wheels, the hull one part
    let wheel = |x: f64, y: f64| {
        let pose = Isometry3::new([x, y, -0.15].into(), [std::f64::consts::FRAC_PI_2, 0.0, 0.0].into());
        placed(&crate::write::ring(0.02, 0.12, 0.04, 48), &pose, 1.0)
    };
    let wheels = [wheel(0.3, 0.4), wheel(0.3, -0.4), wheel(-0.3, 0.4), wheel(-0.3, -0.4)];
    let rover = with(&hull, &wheels);
    let text = grouped_obj(&rover, "g", false, |face| face);
    let imported = import(&[folder.write("rover.obj", text)], sixty()).unwrap();
    assert_eq!(imported.wheels.len(), 4);
    let ring =
        48.0 / 2.0 * (std::f64::consts::TAU / 48.0).sin() * (0.12_f64.powi(2) - 0.02_f64.powi(2)) * 0.08;
    assert_volume(&imported, VOLUME + 4.0 * ring);
    // a hole stays a hole, once and for the whole
    let mut open = hull.clone();
    open.faces.pop();
    let file = folder.write("open.obj", grouped_obj(&open, "g", false, |face| face));
    let said = import(&[file], sixty()).unwrap_err().to_string();
    assert!(said.contains("holes: 1;") && !said.contains("open too"), "{said}");
    // a closed part beside open ones stays as it is
    let parts = with(&hull, &[moved([0.1; 3], &at(0.0, 0.0, 0.25))]);
    let text =
        grouped_obj(&parts, "g", true, |face| if face < hull.faces.len() { face } else { hull.faces.len() });
    assert_volume(&import(&[folder.write("parts.obj", text)], sixty()).unwrap(), VOLUME + 8e-3);
}
