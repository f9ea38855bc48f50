//! Every shape a closed mesh: near corners joined, faces turned outward, holes refused or closed when asked.

use std::collections::{BTreeMap, HashMap, HashSet};

use manifold_rust::linalg::Vec2;
use manifold_rust::manifold::Manifold;
use manifold_rust::polygon::triangulate_idx;
use manifold_rust::types::{Error, MeshGLP, PolyVert, WindingRule};
use wade_core::caught::caught;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parts::{Hole, find, holes, parts};
use wade_core::geometry::seal::seal;
use wade_core::geometry::tidy::{tidy, turned, weld_tolerance, welded};
use wade_core::geometry::watertight::{hull_share, is_closed};

use crate::limits::{HOLLOW_SHARE, LEAST_VOLUME_SHARE, MOST_UNION_SECONDS};
use crate::scene::{Link, Role, Scene, Shape};
use crate::watch::Watch;
use crate::{Shapes, at};

/// A mesh for the library of the union.
pub type Exchange = MeshGLP<f64, u32>;

/// A shape of a link on its way into the hull.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Index of the link.
    pub link: usize,
    /// Link and file, for messages.
    pub source: String,
    /// Its mesh.
    pub mesh: Mesh,
    /// Index of the wheel that it is part of.
    pub wheel: Option<usize>,
}

/// A shape without inside.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolidError {
    /// Holes.
    #[error(
        "{source_name}: not closed, holes: {count}; the largest spans {:.4} m about {} in the vehicle's axes, {} edges; close it in the CAD file, close holes by flat caps with --seal, or use the other shapes of the link with --shapes{}",
        hole.extent, at(&hole.center), hole.edges, also(others)
    )]
    Open {
        /// Link and file.
        source_name: String,
        /// Number of holes.
        count: usize,
        /// The largest.
        hole: Hole,
        /// Further shapes that are open.
        others: Vec<String>,
    },
    /// A mesh in a plane.
    #[error(
        "{source_name}: a sheet without inside, {area:.6} m2 about {}; leave it out of the file, or give it a thickness",
        at(center)
    )]
    Flat {
        /// Link and file.
        source_name: String,
        /// Area of its faces [m2].
        area: f64,
        /// Center of its box [m].
        center: Vec3,
    },
    /// A repair that takes too long.
    #[error(
        "{source_name}: faces cross each other, and the repair of its {faces} triangles takes longer than {MOST_UNION_SECONDS} s; simplify the mesh, or use the other shapes of the link with --shapes"
    )]
    Slow {
        /// Link and file.
        source_name: String,
        /// Triangles of the mesh.
        faces: usize,
    },
    /// A closed mesh that the library cannot read as a solid.
    #[error(
        "{source_name}: closed, but its faces cross each other so that it has no inside ({fault}); repair the mesh, or use the other shapes of the link with --shapes"
    )]
    Crossing {
        /// Link and file.
        source_name: String,
        /// What the library says.
        fault: String,
    },
}

fn also(others: &[String]) -> String {
    if others.is_empty() { String::new() } else { format!("; open too: {}", others.join(", ")) }
}

/// Closes all pieces; the error names every open one.
pub fn close_all(
    pieces: &mut [Piece],
    sealing: bool,
    watch: &Watch,
    warnings: &mut Vec<String>,
) -> Result<(), SolidError> {
    let mut first: Option<SolidError> = None;
    for piece in pieces {
        match (close(piece, sealing, watch, warnings), &mut first) {
            (Ok(()), _) => {}
            (Err(SolidError::Open { source_name, .. }), Some(SolidError::Open { others, .. })) => {
                others.push(source_name);
            }
            (Err(error @ SolidError::Open { .. }), first) => *first = Some(error),
            (Err(error), _) => return Err(error),
        }
    }
    first.map_or(Ok(()), Err)
}

/// The shapes of each link that make its hull.
pub fn choose(scene: &Scene, shapes: Shapes, warnings: &mut Vec<String>) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (index, link) in scene.links.iter().enumerate() {
        for shape in of_link(link, shapes, warnings) {
            let source = match link.name == shape.source {
                true => format!("`{}`", link.name),
                false => format!("link `{}`, {}", link.name, shape.source),
            };
            pieces.push(Piece { link: index, source, mesh: shape.mesh, wheel: None });
        }
    }
    pieces
}

fn of_link(link: &Link, shapes: Shapes, warnings: &mut Vec<String>) -> Vec<Shape> {
    let of = |role: Role| {
        joined(link.shapes.iter().filter(|shape| shape.role == role || shape.role == Role::Both).collect())
    };
    let (visual, collision) = (of(Role::Visual), of(Role::Collision));
    match shapes {
        Shapes::Visual => visual,
        Shapes::Collision => collision,
        Shapes::Auto if visual.is_empty() => collision,
        Shapes::Auto if collision.is_empty() => visual,
        Shapes::Auto => match visual.iter().find(|shape| !is_closed(&tidy(shape.mesh.clone()).0)) {
            Some(open) if collision.iter().all(|shape| is_closed(&tidy(shape.mesh.clone()).0)) => {
                warnings.push(format!(
                    "link `{}`: the visual {} is not closed; the hull of this link is its collision shape ({})",
                    link.name, open.source, collision[0].source
                ));
                collision
            }
            _ => visual,
        },
    }
}

/// Shapes, those that are open as one where their edges meet: exporters write a file for each material.
fn joined(shapes: Vec<&Shape>) -> Vec<Shape> {
    let meshes: Vec<&Mesh> = shapes.iter().map(|shape| &shape.mesh).collect();
    let whole = |group: Vec<usize>| {
        let mut whole = shapes[group[0]].clone();
        for other in &group[1..] {
            whole.mesh.append(meshes[*other]);
            whole.source = format!("{}, {}", whole.source, shapes[*other].source);
        }
        whole
    };
    that_meet(&meshes).into_iter().map(whole).collect()
}

/// Indices of open meshes that have an edge in common, each group in their order; a closed mesh is by itself.
pub fn that_meet(meshes: &[&Mesh]) -> Vec<Vec<usize>> {
    let mut root: Vec<usize> = (0..meshes.len()).collect();
    let (mut all, mut of_face) = (Mesh::default(), Vec::new());
    // one alone meets no other
    for (index, mesh) in meshes.iter().enumerate().filter(|_| meshes.len() > 1) {
        if !is_closed(&tidy((*mesh).clone()).0) {
            all.append(mesh);
            of_face.resize(all.faces.len(), index);
        }
    }
    let (all, _) = welded(&all, weld_tolerance(&all));
    for face_group in parts(&all) {
        for face in &face_group {
            let (a, b) = (find(&mut root, of_face[face_group[0]]), find(&mut root, of_face[*face]));
            root[a.max(b)] = a.min(b);
        }
    }
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    (0..meshes.len()).for_each(|mesh| groups.entry(find(&mut root, mesh)).or_default().push(mesh));
    groups.into_values().collect()
}

/// Makes a piece a closed mesh with its faces outward.
fn close(
    piece: &mut Piece,
    sealing: bool,
    watch: &Watch,
    warnings: &mut Vec<String>,
) -> Result<(), SolidError> {
    let source_name = piece.source.clone();
    let (mut mesh, _) = tidy(std::mem::take(&mut piece.mesh));
    if let Some(one_sided) = without_backs(&mesh) {
        warnings.push(format!(
            "{source_name}: its faces stand there twice, once for each side; one of both counts"
        ));
        mesh = one_sided;
    }
    let diagonal = mesh.bounds().map_or(0.0, |bounds| bounds.extent().norm());
    if !is_closed(&mesh) {
        let turned = orient(&mut mesh);
        if turned > 0 {
            warnings.push(format!(
                "{source_name}: {turned} faces were wound against their neighbors and are turned"
            ));
        }
    }
    if !is_closed(&mesh) {
        let open = holes(&mesh);
        let Some(&hole) = open.first().filter(|_| !sealing) else {
            piece.mesh = sealed(&source_name, mesh, warnings);
            return outward(piece, diagonal, watch, warnings);
        };
        return Err(SolidError::Open { source_name, count: open.len(), hole, others: Vec::new() });
    }
    piece.mesh = mesh;
    outward(piece, diagonal, watch, warnings)
}

fn outward(
    piece: &mut Piece,
    diagonal: f64,
    watch: &Watch,
    warnings: &mut Vec<String>,
) -> Result<(), SolidError> {
    let source_name = piece.source.clone();
    let crossing = |fault: String| SolidError::Crossing { source_name: source_name.clone(), fault };
    let (mut mesh, turned) = outward_shells(std::mem::take(&mut piece.mesh));
    if turned > 0 {
        warnings.push(format!("{source_name}: {turned} faces pointed inward and are turned"));
    }
    let has_inner = has_inner_shells(&mesh);
    if has_inner {
        warnings.push(format!(
            "{source_name}: closed parts of it lie inside others, where they displace nothing"
        ));
    }
    let least = LEAST_VOLUME_SHARE * diagonal.powi(3);
    if mesh.volume() <= least {
        let center = mesh.bounds().map_or_else(Vec3::zeros, |bounds| bounds.center());
        return Err(SolidError::Flat { source_name, area: mesh.area(), center });
    }
    match caught(|| repaired(&mesh, has_inner, watch)).ok() {
        Some(Ok(None)) => {}
        Some(Ok(Some(repaired))) if repaired.volume() > least => mesh = repaired,
        Some(Err(Error::Cancelled)) => return Err(SolidError::Slow { source_name, faces: mesh.faces.len() }),
        Some(Err(fault)) => return Err(crossing(fault_in_words(fault).to_owned())),
        Some(Ok(Some(_))) => return Err(crossing("nothing is left of it".to_owned())),
        None => return Err(crossing("the repair failed".to_owned())),
    }
    let volume = mesh.volume();
    if let Some(share) = hull_share(&mesh).filter(|share| *share < HOLLOW_SHARE) {
        warnings.push(format!(
            "{source_name}: fills {:.1} % of its convex hull, {:.3} l: it is taken as open to the water; where it is \
             closed in truth, model its outside or use the other shapes of the link with --shapes",
            share * 100.0,
            volume * 1e3
        ));
    }
    piece.mesh = mesh;
    Ok(())
}

/// What the library of the union says, in words.
pub fn fault_in_words(fault: Error) -> &'static str {
    match fault {
        Error::NonFiniteVertex => "a coordinate is not a finite number",
        Error::NotManifold | Error::NotClosed => "it has edges without two faces that agree",
        Error::ResultTooLarge => "the result is too large",
        Error::Cancelled => "it takes too long",
        _ => "the library of the union refuses the mesh",
    }
}

/// The mesh without faces that cross each other or lie in its inside; none where it has none.
fn repaired(mesh: &Mesh, has_inner: bool, watch: &Watch) -> Result<Option<Mesh>, Error> {
    let solid = Manifold::from_mesh_glp_robust(&to_exchange(mesh, 0));
    if solid.status() != Error::NoError {
        return Err(solid.status());
    }
    if !has_inner && !solid.has_self_intersections() {
        return Ok(None);
    }
    let rebuilt = solid.rebuild_solid_with_token(WindingRule::Nonzero, Some(watch.token()));
    match rebuilt.status() {
        Error::NoError => Ok(Some(from_exchange(&rebuilt.get_mesh_glp(0)).0)),
        fault => Err(fault),
    }
}

/// Turns closed shells that look inward and lie in no other, and counts their faces. Those in another are its cavities.
fn outward_shells(mut mesh: Mesh) -> (Mesh, usize) {
    let parts = parts(&mesh);
    let shells: Vec<Mesh> = parts.iter().map(|faces| mesh.part(faces)).collect();
    let mut turned = 0;
    for (index, shell) in shells.iter().enumerate().filter(|(_, shell)| shell.volume() < 0.0) {
        let is_cavity =
            shells.iter().enumerate().any(|(other, mesh)| other != index && encloses(mesh, shell));
        if !is_cavity {
            parts[index].iter().for_each(|face| mesh.faces[*face].swap(1, 2));
            turned += parts[index].len();
        }
    }
    (mesh, turned)
}

/// Whether a shell begins in the material of others: it lies there, or crosses them.
fn has_inner_shells(mesh: &Mesh) -> bool {
    let shells: Vec<(Mesh, Option<Bounds>)> = parts(mesh)
        .iter()
        .map(|faces| {
            let shell = mesh.part(faces);
            let bounds = shell.bounds();
            (shell, bounds)
        })
        .collect();
    let is_inner = |index: usize| {
        let corner = &shells[index].0.vertices[0];
        let is_near = |bounds: &Option<Bounds>| {
            bounds.is_some_and(|b| (0..3).all(|i| b.min[i] <= corner[i] && corner[i] <= b.max[i]))
        };
        let others =
            shells.iter().enumerate().filter(|(other, (_, bounds))| *other != index && is_near(bounds));
        let turns: f64 = others.map(|(_, (other, _))| winding_number(other, corner)).sum();
        turns > 0.5 && shells[index].0.volume() > 0.0
    };
    (0..shells.len()).any(is_inner)
}

/// The mesh with one face of each pair that differ in their side alone; none unless every face has
/// such a twin and the others are closed, which those of a sheet are not.
fn without_backs(mesh: &Mesh) -> Option<Mesh> {
    let all: HashSet<[u32; 3]> = mesh.faces.iter().map(|face| turned(*face)).collect();
    let back = |[a, b, c]: [u32; 3]| turned([a, c, b]);
    if mesh.faces.is_empty() || !all.iter().all(|face| all.contains(&back(*face))) {
        return None;
    }
    let mut kept: HashSet<[u32; 3]> = HashSet::new();
    let is_first = |&face: &usize| {
        let own = turned(mesh.faces[face]);
        !kept.contains(&back(own)) && kept.insert(own)
    };
    let faces: Vec<usize> = (0..mesh.faces.len()).filter(is_first).collect();
    let mut one_sided = mesh.part(&faces);
    orient(&mut one_sided);
    is_closed(&one_sided).then_some(one_sided)
}

/// Whether a closed mesh encloses another that does not cross it.
pub fn encloses(outer: &Mesh, inner: &Mesh) -> bool {
    let is_within = |(outer, inner): (Bounds, Bounds)| {
        (0..3).all(|i| outer.min[i] <= inner.min[i] && inner.max[i] <= outer.max[i])
    };
    outer.bounds().zip(inner.bounds()).is_some_and(is_within)
        && inner.vertices.first().is_some_and(|corner| winding_number(outer, corner).abs() > 0.5)
}

/// How often a closed mesh winds about a point, from the solid angles of its faces (van Oosterom and Strackee, "The solid
/// angle of a plane triangle", 1983).
fn winding_number(mesh: &Mesh, point: &Vec3) -> f64 {
    let angle = |face: usize| {
        let [a, b, c] = mesh.triangle(face).map(|corner| corner - point);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    (0..mesh.faces.len()).map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// A mesh for the library, its faces marked with an identity.
pub fn to_exchange(mesh: &Mesh, id: u32) -> Exchange {
    Exchange {
        num_prop: 3,
        vert_properties: mesh.vertices.iter().flat_map(|v| [v.x, v.y, v.z]).collect(),
        tri_verts: mesh.faces.iter().flatten().copied().collect(),
        run_original_id: if id == 0 { Vec::new() } else { vec![id] },
        ..Exchange::default()
    }
}

/// A mesh from the library, and the identity of each face.
pub fn from_exchange(exchange: &Exchange) -> (Mesh, Vec<u32>) {
    let vertices = (0..exchange.num_vert()).map(|v| Vec3::from(exchange.get_vert_pos(v))).collect();
    let mut same: HashMap<u32, u32> = HashMap::new();
    for (from, to) in exchange.merge_from_vert.iter().zip(&exchange.merge_to_vert) {
        same.insert(*from, *to);
    }
    let faces: Vec<[u32; 3]> = (0..exchange.num_tri())
        .map(|t| exchange.get_tri_verts(t).map(|v| same.get(&v).copied().unwrap_or(v)))
        .collect();
    let mut ids = vec![0; faces.len()];
    for (run, id) in exchange.run_original_id.iter().enumerate() {
        let start = exchange.run_index.get(run).map_or(0, |i| *i as usize / 3);
        let end = exchange.run_index.get(run + 1).map_or(faces.len(), |i| *i as usize / 3);
        ids[start.min(faces.len())..end.min(faces.len())].fill(*id);
    }
    (Mesh { vertices, faces }, ids)
}

/// Turns faces so that neighbors agree; the number of those turned, the fewer of both ways in each connected part.
fn orient(mesh: &mut Mesh) -> usize {
    let mut on_edge: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for (face, &[a, b, c]) in mesh.faces.iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            on_edge.entry((p.min(q), p.max(q))).or_default().push(face);
        }
    }
    let mut flip: Vec<Option<bool>> = vec![None; mesh.faces.len()];
    let mut turned = 0;
    for start in 0..mesh.faces.len() {
        if flip[start].is_some() {
            continue;
        }
        flip[start] = Some(false);
        let mut part = vec![start];
        let mut next = 0;
        while next < part.len() {
            let face = part[next];
            next += 1;
            let own = flip[face] == Some(true);
            let [a, b, c] = mesh.faces[face];
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let [one, two] = on_edge[&(p.min(q), p.max(q))][..] else { continue };
                let other = if one == face { two } else { one };
                if flip[other].is_none() {
                    let along = runs_along(&mesh.faces[other], p, q);
                    flip[other] = Some(own ^ along);
                    part.push(other);
                }
            }
        }
        let flipped = part.iter().filter(|face| flip[**face] == Some(true)).count();
        let fewer = flipped.min(part.len() - flipped);
        if fewer != flipped {
            part.iter().for_each(|face| flip[*face] = flip[*face].map(|turned| !turned));
        }
        turned += fewer;
    }
    for (face, flip) in mesh.faces.iter_mut().zip(flip) {
        if flip == Some(true) {
            face.swap(1, 2);
        }
    }
    turned
}

/// True where a face has the edge from `p` to `q` in this direction.
fn runs_along(&[a, b, c]: &[u32; 3], p: u32, q: u32) -> bool {
    [(a, b), (b, c), (c, a)].contains(&(p, q))
}

/// Closes holes by flat caps; where that closes nothing, the convex hull of each open part.
fn sealed(source: &str, mesh: Mesh, warnings: &mut Vec<String>) -> Mesh {
    let before = mesh.volume();
    let (capped, caps) = with_caps(&mesh);
    if is_closed(&capped) {
        warnings.push(format!(
            "{source}: holes closed by caps: {caps}; volume {:.3} l before, as far as an open mesh has one, {:.3} l after",
            before.abs() * 1e3,
            capped.volume().abs() * 1e3
        ));
        return capped;
    }
    let (hulled, sealing) = seal(&mesh);
    warnings.push(format!(
        "{source}: its holes have no simple rim, so open parts become convex hulls: {sealing}"
    ));
    hulled
}

/// The mesh with a cap over each rim.
fn with_caps(mesh: &Mesh) -> (Mesh, usize) {
    let mut balance: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    for &[a, b, c] in &mesh.faces {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            *balance.entry((p.min(q), p.max(q))).or_default() += if p < q { 1 } else { -1 };
        }
    }
    // the cap runs along each open edge against the face that is there
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ((p, q), sum) in balance {
        let (from, to) = if sum > 0 { (q, p) } else { (p, q) };
        (0..sum.abs()).for_each(|_| next.entry(from).or_default().push(to));
    }
    let (mut out, mut caps) = (mesh.clone(), 0);
    while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
        let mut rim = vec![start];
        while let Some(to) = rim.last().and_then(|last| next.get_mut(last)?.pop()) {
            if to == start {
                break;
            }
            rim.push(to);
        }
        next.retain(|_, to| !to.is_empty());
        if rim.len() < 3 {
            continue;
        }
        out.faces.extend(cap(&out.vertices, &rim));
        caps += 1;
    }
    (out, caps)
}

/// The triangles over a rim, which may be concave, in the plane that its corners are nearest to.
fn cap(vertices: &[Vec3], rim: &[u32]) -> Vec<[u32; 3]> {
    let at = |corner: &u32| vertices[*corner as usize];
    // twice the area, as Newell has it
    let ends = rim.iter().skip(1).chain(&rim[..1]);
    let area: Vec3 =
        rim.iter().zip(ends).map(|(a, b)| (at(a) - at(&rim[0])).cross(&(at(b) - at(&rim[0])))).sum();
    let normal = area.try_normalize(0.0).unwrap_or_else(Vec3::z);
    let x = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
    let y = normal.cross(&x);
    let place = |(number, corner): (usize, &u32)| PolyVert {
        pos: Vec2 { x: x.dot(&at(corner)), y: y.dot(&at(corner)) },
        idx: number as i32,
    };
    let polygon = rim.iter().enumerate().map(place).collect();
    let corner = |index: i32| rim[index as usize];
    let triangles = triangulate_idx(&vec![polygon], -1.0, true);
    triangles.iter().map(|of| [corner(of.x), corner(of.y), corner(of.z)]).collect()
}
