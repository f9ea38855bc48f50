//! Every bound and threshold of the import, with its unit and meaning.

use wade_core::condition::FRESH_WATER;
use wade_core::vehicle::plausible::{LEAST_LENGTH, MOST_LENGTH};

/// Largest description file: URDF, SDF, MJCF [bytes]. Public robots have up to 1 MB.
pub const MOST_DESCRIPTION_BYTES: u64 = 16 << 20;

/// Largest mesh file, and largest buffer of a glTF file [bytes]: two million faces of a binary STL and room for text.
pub const MOST_MESH_BYTES: u64 = 512 << 20;

/// Most XML elements of a description.
pub const MOST_NODES: u32 = 200_000;

/// Most links of a robot, nodes of a scene, or shapes of either.
pub const MOST_LINKS: usize = 4_000;

/// Deepest chain of links, bodies or nodes.
pub const MOST_DEPTH: usize = 200;

/// Most triangles of all shapes together. The union and the hydrostatics of more take minutes and give no better answer.
pub const MOST_FACES: usize = 1_000_000;

/// Time after which repair and union of the shapes are given up [s].
pub const MOST_UNION_SECONDS: u64 = 240;

/// Longest edge of a vehicle [m]: from a toy to a mining truck.
pub const LENGTHS: [f64; 2] = [LEAST_LENGTH, MOST_LENGTH];

/// Facets around a cylinder, capsule or sphere: the inscribed polygon is 0.07 % too small.
pub const FACETS: u32 = 96;

/// Mean density assumed where no file and no option states a mass [kg/m3]: a vehicle that floats with 40 % under water.
pub const ASSUMED_DENSITY: f64 = 400.0;

/// Longest edge of most wading robots and vehicles [m]: among several units that fit, one in which it lies here is taken.
pub const TYPICAL_LENGTHS: [f64; 2] = [0.1, 6.0];

/// Mass over volume from which, and up to which, the level at which a vehicle floats lies inside its hull [kg/m3]: rigid foam to
/// fresh water.
pub const FLOATING_DENSITY: [f64; 2] = [20.0, FRESH_WATER];

/// Smallest volume of a shape over the cube of its diagonal; below it is a sheet without inside.
pub const LEAST_VOLUME_SHARE: f64 = 1e-9;

/// A wheel's axis is within this angle of the lateral axis [degrees].
pub const WHEEL_AXIS_DEGREES: f64 = 30.0;

/// Smallest over largest radius of a wheel, around its axis; a tire with lugs reaches 0.93.
pub const LEAST_ROUNDNESS: f64 = 0.9;

/// The same for a part of a plain mesh that is taken for a wheel without a joint saying so.
pub const LEAST_ROUNDNESS_UNNAMED: f64 = 0.98;

/// Height of the lowest point of a wheel above the ground, over its diameter, up to which it stands on the ground.
pub const WHEEL_GROUND_SHARE: f64 = 0.1;

/// Length of a tire's contact with the ground over its radius: 0.155 m of 0.305 m, the Warthog's of the paper.
pub const CONTACT_SHARE: f64 = 0.155 / 0.305;

/// Angle from straight down within which a face belongs to the bottom, and from straight up to the deck [degrees].
pub const LEVEL_DEGREES: f64 = 45.0;

/// Volume lost in the union, over the sum of the shapes, from which the overlap is reported.
pub const REPORTED_OVERLAP_SHARE: f64 = 1e-3;

/// Share of its convex hull below which a shape is reported as hollow.
pub const HOLLOW_SHARE: f64 = 0.15;

/// Directions in which the radius of a wheel is looked at.
pub const WHEEL_SECTORS: usize = 36;

/// Size of the smallest cavity that is reported [m3]: a milliliter.
pub const REPORTED_CAVITY: f64 = 1e-6;
