//! A robot's description or a mesh in one of the formats of the importer: refused with words, or a vehicle.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;
use wade_import::{Options, import};
use wade_simulation::bundle::block;

thread_local! {
    static FOLDER: TempDir = folder();
}

const NAMES: [&str; 6] = ["robot.urdf", "robot.sdf", "robot.xml", "mesh.obj", "mesh.gltf", "mesh.dae"];

fn folder() -> TempDir {
    let folder = TempDir::new_in("/dev/shm").expect("a temporary folder");
    fs::write(folder.path().join("box.stl"), block([0.8, 0.6, 0.4])).expect("written");
    folder
}

/// Which format, then the file.
pub fn run(bytes: &[u8]) {
    if let Some((&number, bytes)) = bytes.split_first() {
        imported(NAMES[usize::from(number) % NAMES.len()], bytes);
    }
}

/// Imports a file of this name that holds these bytes.
pub fn imported(name: &str, bytes: &[u8]) {
    FOLDER.with(|folder| {
        let path: PathBuf = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        let options =
            Options { name: "fuzzed".into(), seal: bytes.len().is_multiple_of(2), ..Options::default() };
        match import(&[path], &options) {
            Err(error) => assert!(!error.to_string().is_empty()),
            Ok(imported) => {
                imported.vehicle.validate().expect("a vehicle that may be written");
                assert!(imported.vehicle.mass > 0.0 && imported.vehicle.hull.mesh.volume() > 0.0);
            }
        }
    });
}

/// A small robot in each format.
pub fn seeds() -> Vec<Vec<u8>> {
    let of = |number: u8, text: &str| [&[number], text.as_bytes()].concat();
    let inertial = r#"<inertial><mass value="5"/><origin xyz="0 0 0.1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    let wheel = r#"<link name="w"><visual><origin rpy="1.57 0 0"/><geometry><cylinder radius="0.2" length="0.1"/></geometry></visual></link>
        <joint name="j" type="continuous"><parent link="b"/><child link="w"/><origin xyz="0.3 0.4 -0.2"/><axis xyz="0 1 0"/></joint>"#;
    let urdf = format!(
        r#"<robot name="r"><link name="b">{inertial}<visual><geometry><box size="0.8 0.6 0.4"/></geometry></visual>
        <collision><geometry><mesh filename="box.stl" scale="1 1 1"/></geometry></collision></link>{wheel}</robot>"#
    );
    let sdf = r#"<sdf version="1.9"><model name="m"><link name="a"><pose>0 0 0.2 0 0 0.1</pose>
        <inertial><mass>5</mass></inertial><visual name="v"><geometry><box><size>0.8 0.6 0.4</size></box></geometry></visual></link></model></sdf>"#;
    let mjcf = r#"<mujoco><asset><mesh name="m" file="box.stl"/></asset><worldbody><body pos="0 0 1"><joint type="free"/>
        <geom type="box" size="0.4 0.3 0.2" mass="5"/><geom type="mesh" mesh="m"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.1"/></body></worldbody></mujoco>"#;
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let gltf = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let dae = r##"<COLLADA><asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
        <source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common><accessor source="#a" count="4" stride="3"/></technique_common></source>
        <vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>
        </mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"##;
    vec![of(0, &urdf), of(1, sdf), of(2, mjcf), of(3, obj), of(4, gltf), of(5, dae)]
}
