//! Which shapes are tracks: by the names of their links, one a side.

use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Bounds;
use wade_core::vehicle::SurfaceKind;

use crate::limits::{LEAST_ROUNDNESS, WHEEL_GROUND_SHARE};
use crate::scene::{Joint, Scene};
use crate::solid::Piece;
use crate::wheels::Wheel;

/// Tracks with their pieces, the left one first: the shapes of links with the word `track` in their names that lie on one side and,
/// together, stand on the ground. Round wheels among them stay wheels, unless a track runs round about them.
pub fn find(
    scene: &Scene,
    pieces: &[Piece],
    wheels: &mut Vec<(Wheel, Vec<usize>)>,
    notes: &mut Vec<String>,
) -> Vec<(Wheel, Vec<usize>)> {
    let Some(whole) = bounds(pieces, &(0..pieces.len()).collect::<Vec<_>>()) else { return Vec::new() };
    let middle = whole.center().y;
    let is_round = |piece: &usize| {
        wheels.iter().any(|(wheel, members)| wheel.roundness >= LEAST_ROUNDNESS && members.contains(piece))
    };
    let named: Vec<usize> = (0..pieces.len())
        .filter(|piece| is_of_track(scene, pieces[*piece].link) && !is_round(piece))
        .collect();
    let mut found = Vec::new();
    for is_left in [true, false] {
        let is_beside = |piece: &usize| {
            let bounds = pieces[*piece].mesh.bounds();
            bounds.is_some_and(|b| if is_left { b.min.y >= middle } else { b.max.y <= middle })
        };
        let mut members: Vec<usize> = named.iter().copied().filter(is_beside).collect();
        let Some(belt) = bounds(pieces, &members) else { continue };
        let extent = belt.extent();
        if belt.min.z - whole.min.z > WHEEL_GROUND_SHARE * extent.z {
            continue;
        }
        let source = scene.links[pieces[members[0]].link].name.clone();
        wheels.retain(|(wheel, own)| {
            let is_within = contains(&belt, &wheel.center) || own.iter().any(|piece| members.contains(piece));
            if is_within {
                notes.push(format!(
                    "`{}` turns within the track of `{source}` and is part of it",
                    wheel.source
                ));
                let new: Vec<usize> = own.iter().copied().filter(|piece| !members.contains(piece)).collect();
                members.extend(new);
            }
            !is_within
        });
        let track = Wheel {
            name: format!("track_{}", if is_left { "left" } else { "right" }),
            kind: SurfaceKind::Track,
            source,
            axis: Vec3::y(),
            center: belt.center(),
            radius: 0.5 * extent.z,
            width: extent.y,
            length: extent.x,
            roundness: 0.0,
            is_left,
        };
        found.push((track, members));
    }
    found
}

/// True of a link with the word in its name, and of those fixed to it.
fn is_of_track(scene: &Scene, link: usize) -> bool {
    let mut at = link;
    loop {
        if has_word(&scene.links[at].name) {
            return true;
        }
        match (&scene.links[at].joint, scene.links[at].parent) {
            // parents come first, so this ends
            (Joint::Fixed, Some(parent)) => at = parent,
            _ => return false,
        }
    }
}

/// True of `left_track`, `track_r`, `Track2`, `rightTrack` and `tracks`, not of `tracker` or `backtracking`.
fn has_word(name: &str) -> bool {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for letter in name.chars() {
        if !letter.is_alphabetic() || (letter.is_uppercase() && before.is_lowercase()) {
            words.push(String::new());
        }
        if let (true, Some(word)) = (letter.is_alphabetic(), words.last_mut()) {
            word.extend(letter.to_lowercase());
        }
        before = letter;
    }
    words.iter().any(|word| matches!(word.as_str(), "track" | "tracks"))
}

fn bounds(pieces: &[Piece], members: &[usize]) -> Option<Bounds> {
    Bounds::around(members.iter().flat_map(|member| &pieces[*member].mesh.vertices))
}

fn contains(bounds: &Bounds, point: &Vec3) -> bool {
    (0..3).all(|axis| (bounds.min[axis]..=bounds.max[axis]).contains(&point[axis]))
}

#[cfg(test)]
mod tests {
    use super::has_word;

    #[test]
    fn a_track_is_a_word_of_its_own() {
        for name in ["left_track", "track_r", "Track2", "rightTrack", "TRACK-left", "main tracks", "track"] {
            assert!(has_word(name), "{name}");
        }
        for name in ["tracker", "backtracking", "trackball_link", "left_wheel", ""] {
            assert!(!has_word(name), "{name}");
        }
    }
}
