//! The union of closed shapes that overlap, with the shape that each face came from.

use manifold_rust::cancel::CancelToken;
use manifold_rust::manifold::Manifold;
use manifold_rust::types::{BooleanEngine, Error, OpType};
use wade_core::caught::caught;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parts::parts;
use wade_core::geometry::watertight::is_closed;

use crate::at;
use crate::limits::{MOST_UNION_SECONDS, REPORTED_CAVITY, REPORTED_OVERLAP_SHARE};
use crate::solid::{Piece, encloses, fault_in_words, from_exchange, to_exchange};
use crate::watch::Watch;

/// The hull of all shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct United {
    /// Closed, outward [m].
    pub mesh: Mesh,
    /// The piece that each face came from.
    pub face_piece: Vec<usize>,
}

/// A union that failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UniteError {
    /// It takes too long.
    #[error(
        "the union of {source_name} with the shapes before it ({faces} triangles) takes longer than {MOST_UNION_SECONDS} s; simplify the meshes, or use --shapes collision"
    )]
    Slow {
        /// Link and file.
        source_name: String,
        /// Triangles so far.
        faces: usize,
    },
    /// The library gives none.
    #[error(
        "{source_name} cannot be united with the shapes that it overlaps ({fault}); repair the mesh, or use the other shapes of the link with --shapes"
    )]
    Failed {
        /// Link and file.
        source_name: String,
        /// What the library says.
        fault: String,
    },
}

/// Unites pieces whose boxes overlap and sets the others beside each other. Cavities that no water reaches are filled.
pub fn unite(
    pieces: &[Piece],
    watch: &Watch,
    notes: &mut Vec<String>,
    warnings: &mut Vec<String>,
) -> Result<United, UniteError> {
    let mut united = United { mesh: Mesh::default(), face_piece: Vec::new() };
    for group in groups(pieces) {
        let (mesh, face_piece) = match group[..] {
            [one] => (pieces[one].mesh.clone(), vec![one; pieces[one].mesh.faces.len()]),
            _ => caught(|| union_of(pieces, &group, watch.token())).unwrap_or_else(|_| {
                let source_name = group.iter().map(|piece| pieces[*piece].source.clone()).collect::<Vec<_>>();
                Err(UniteError::Failed {
                    source_name: source_name.join(", "),
                    fault: "the union failed".to_owned(),
                })
            })?,
        };
        united.mesh.append(&mesh);
        united.face_piece.extend(face_piece);
    }
    let united = without_cavities(united, warnings);
    let (sum, volume): (f64, f64) = (pieces.iter().map(|p| p.mesh.volume()).sum(), united.mesh.volume());
    let lost = sum - volume;
    if lost > REPORTED_OVERLAP_SHARE * sum {
        notes.push(format!(
            "shapes overlap by {:.3} l, {:.1} % of their sum of {:.3} l, which counts once",
            lost * 1e3,
            100.0 * lost / sum,
            sum * 1e3
        ));
    }
    Ok(united)
}

/// Indices of pieces that are connected through boxes that touch.
fn groups(pieces: &[Piece]) -> Vec<Vec<usize>> {
    let bounds: Vec<Option<Bounds>> = pieces.iter().map(|piece| piece.mesh.bounds()).collect();
    let touch = |a: &Bounds, b: &Bounds| (0..3).all(|i| a.min[i] <= b.max[i] && b.min[i] <= a.max[i]);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, own) in bounds.iter().enumerate() {
        let near = |other: &usize| own.zip(bounds[*other]).is_some_and(|(a, b)| touch(&a, &b));
        let (joined, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| group.iter().any(near));
        groups = apart;
        let mut group: Vec<usize> = joined.into_iter().flatten().collect();
        group.push(index);
        group.sort_unstable();
        groups.push(group);
    }
    groups.sort();
    groups
}

fn union_of(
    pieces: &[Piece],
    group: &[usize],
    token: &CancelToken,
) -> Result<(Mesh, Vec<usize>), UniteError> {
    let first = Manifold::reserve_ids(group.len() as u32);
    let solid =
        |at: usize| Manifold::from_mesh_glp_robust(&to_exchange(&pieces[group[at]].mesh, first + at as u32));
    let mut sum = solid(0);
    for at in 1..group.len() {
        let source_name = pieces[group[at]].source.clone();
        let (before, other) = (sum.volume(), solid(at));
        let unite = |engine| sum.boolean_with_engine_and_token(&other, OpType::Add, engine, Some(token));
        let mut union = unite(BooleanEngine::Auto);
        // neither less than the larger nor more than both
        let least = before.max(other.volume()) * (1.0 - 1e-6);
        let is_sound = |union: &Manifold| {
            union.status() == Error::NoError
                && (least..=(before + other.volume()) * (1.0 + 1e-6)).contains(&union.volume())
        };
        if !is_sound(&union) && union.status() != Error::Cancelled {
            union = unite(BooleanEngine::Robust);
        }
        match union.status() {
            Error::Cancelled => {
                return Err(UniteError::Slow { source_name, faces: sum.num_tri() + other.num_tri() });
            }
            _ if is_sound(&union) => sum = union,
            Error::NoError => {
                let fault = "the volume of the result is not between those of its parts".to_owned();
                return Err(UniteError::Failed { source_name, fault });
            }
            fault => {
                return Err(UniteError::Failed { source_name, fault: fault_in_words(fault).to_owned() });
            }
        }
    }
    let (mesh, ids) = from_exchange(&sum.get_mesh_glp(0));
    let last = pieces[group[group.len() - 1]].source.clone();
    if !is_closed(&mesh) {
        return Err(UniteError::Failed { source_name: last, fault: "the result is open".to_owned() });
    }
    let piece = |id: u32| group[(id.saturating_sub(first) as usize).min(group.len() - 1)];
    Ok((mesh, ids.into_iter().map(piece).collect()))
}

/// Drops shells that look inward: the water does not reach what they enclose, nor what lies in there.
fn without_cavities(united: United, warnings: &mut Vec<String>) -> United {
    let mut keep = Vec::new();
    let shells: Vec<(Vec<usize>, Mesh)> = parts(&united.mesh)
        .into_iter()
        .map(|part| {
            let shell = united.mesh.part(&part);
            (part, shell)
        })
        .collect();
    let cavities: Vec<&Mesh> =
        shells.iter().map(|(_, shell)| shell).filter(|shell| shell.volume() < 0.0).collect();
    for (part, shell) in &shells {
        let volume = shell.volume();
        if volume > 0.0 {
            if !cavities.iter().any(|cavity| encloses(cavity, shell)) {
                keep.extend(part);
            }
        } else if volume < -REPORTED_CAVITY {
            let center = shell.bounds().map_or_else(Default::default, |bounds| bounds.center());
            warnings.push(format!(
                "a closed cavity of {:.3} l about {} is counted as displaced, since no water reaches it",
                -volume * 1e3,
                at(&center)
            ));
        }
    }
    if keep.len() == united.mesh.faces.len() {
        return united;
    }
    keep.sort_unstable();
    United {
        mesh: united.mesh.part(&keep),
        face_piece: keep.iter().map(|face| united.face_piece[*face]).collect(),
    }
}
