//! Tracks: found by the names of their links, one a side, with what turns in them.

#![allow(clippy::unwrap_used)]

use wade_core::vehicle::SurfaceKind;
use wade_import::{Imported, Options};

use crate::write::{Folder, import, joint, link, urdf};

/// A hull between two belts of these names, which stand on the ground where `height` is 0.05 m.
fn between(names: [&str; 2], height: f64) -> String {
    let mut body = link("base", "xyz=\"0 0 0.12\"", "<box size=\"0.4 0.2 0.1\"/>");
    for (name, y) in names.into_iter().zip([0.15, -0.15]) {
        body += &link(name, "", "<box size=\"0.5 0.06 0.1\"/>");
        body += &joint("fixed", "base", name, &format!("<origin xyz=\"0.01 {y} {height}\"/>"));
    }
    body
}

fn imported(body: &str) -> Imported {
    let folder = Folder::new();
    let file = folder.write("robot.urdf", urdf(body));
    import(&[file], Options { mass: Some(6.0), ..Options::default() }).unwrap()
}

fn names(imported: &Imported) -> Vec<&str> {
    imported.vehicle.surfaces.iter().map(|surface| surface.name.as_str()).collect()
}

#[test]
fn links_with_track_in_their_names_on_the_ground_become_tracks() {
    let imported = imported(&between(["left_track", "track_r"], 0.05));
    assert_eq!(names(&imported)[5..], ["track_left", "track_right"]);
    let vehicle = &imported.vehicle;
    assert_eq!(vehicle.wheels(), [5, 6]);
    for (index, track) in vehicle.surfaces.iter().enumerate().skip(5) {
        assert_eq!((track.kind, track.mirror_left_right), (SurfaceKind::Track, 11 - index));
        assert!((track.sprocket_radius.unwrap() - 0.05).abs() < 1e-6, "{track:?}");
        assert!((track.normal.y.abs() - 1.0).abs() < 1e-12);
    }
    // the flat run of a belt of 0.5 m round two ends of 0.05 m
    let areas: Vec<f64> = vehicle.contacts.iter().map(|contact| contact.area).collect();
    assert!(areas.len() == 2 && areas.iter().all(|area| (area - 0.4 * 0.06).abs() < 1e-6), "{areas:?}");
    assert!(imported.notes.iter().any(|note| note.contains("track `track_right`: track_r")));
    assert!(!imported.warnings.iter().any(|warning| warning.contains("cylinder")), "{:?}", imported.warnings);
}

#[test]
fn other_names_and_what_does_not_stand_on_the_ground_are_no_tracks() {
    let body = between(["left_tracker", "backtrack"], 0.05);
    assert!(imported(&body).wheels.is_empty());
    assert!(imported(&between(["left_track", "right_track"], 0.15)).wheels.is_empty());
}

#[test]
fn what_turns_within_a_track_is_part_of_it() {
    let mut body = between(["left_track", "right_track"], 0.05);
    for (index, (x, y)) in [(0.1, 0.15), (-0.1, 0.15), (0.1, -0.15), (-0.1, -0.15)].into_iter().enumerate() {
        let name = format!("road_wheel_{index}");
        let parent = if y > 0.0 { "left_track" } else { "right_track" };
        body += &link(&name, "rpy=\"1.5707963267948966 0 0\"", "<cylinder radius=\"0.04\" length=\"0.08\"/>");
        let origin = format!("<origin xyz=\"{x} 0 0\"/><axis xyz=\"0 1 0\"/>");
        body += &joint("continuous", parent, &name, &origin);
    }
    let imported = imported(&body);
    assert_eq!(names(&imported)[5..], ["track_left", "track_right"]);
    assert_eq!(imported.notes.iter().filter(|note| note.contains("turns within the track")).count(), 4);
}
