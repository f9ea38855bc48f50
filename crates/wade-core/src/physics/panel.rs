//! Added mass by sources on the elements of a hull, and the waves that its motion makes.
//!
//! The water is inviscid. At once (infinite frequency) its surface is a plane of zero potential: the image of a source in it
//! has the other sign; that in the bed has the same (Newman, Marine Hydrodynamics, section 4.10 and 6.17). A source sits on
//! each element, whose own potential and velocity are those of a disc of its area.
//!
//! What the waves carry away follows from the wave that would excite the hull, by Haskind's relation
//! `B_ij = k / (8 pi rho g V_g) int Re(X_i conj X_j) d beta`, with `X_j = -int (p n_j + rho phi_j a . n) dS` for the pressure
//! `p` and the acceleration `a` of the wave (Newman, section 6.18), where the potential `phi_j` of the moving hull is that
//! of infinite frequency.

use nalgebra::{Complex, DMatrix, Matrix6, Vector6};
use std::f64::consts::PI;

use super::elements::Element;
use crate::frame::{GRAVITY, Vec3};

/// Images on either side of the pair of planes, surface and bed.
const IMAGES: i32 = 4;
/// Share of the potential of infinite frequency by which a hull scatters waves, by mode [-]: that of heave, roll and pitch is
/// half gone where their waves are largest (half-immersed sphere, and both shipped hulls, by capytaine 3.0).
const DIFFRACTED: Vector6<f64> = Vector6::new(1.0, 1.0, 0.5, 0.5, 0.5, 1.0);
/// Points a side of the grid that stands for a panel at close quarters.
const CLOSE: usize = 4;
/// Cosine between normals below which a panel at close quarters is across a plate or a gap [-].
const ACROSS: f64 = -0.9;
/// Factor by which the half axes of a panel may be stretched to a rectangle of its area [-].
const MOST_STRETCHED: f64 = 10.0;
/// Directions of waves over a full turn.
const HEADINGS: usize = 24;

/// The wet part of an element of an upright hull; body frame.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    area: f64,
    normal: Vec3,
    center: Vec3,
    /// Half axes of the rectangle that stands for it at close quarters [m].
    axes: [Vec3; 2],
}

/// Still water round an upright hull; heights in the body frame [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basin {
    /// Height of the surface.
    pub level: f64,
    /// Height of the bed; `None` where it is too deep to matter.
    pub bed: Option<f64>,
}

impl Basin {
    /// Depth of the water [m]; infinite where it is too deep to matter.
    fn depth(&self) -> f64 {
        self.bed.map_or(f64::INFINITY, |bed| self.level - bed)
    }
}

/// The wet parts of elements under level water.
pub fn wet_panels(elements: &[Element], level: f64) -> Vec<Panel> {
    let panel = |element: &Element| {
        let reach = (3.0 * element.spread.m33.max(0.0)).sqrt().max(1e-9);
        let depth = level - element.center.z;
        let share = ((depth + reach) / (2.0 * reach)).clamp(0.0, 1.0);
        // the wet part of a vertical element ends at the surface
        let center = element.center - Vec3::z() * (reach * (1.0 - share));
        let axes = half_axes(element, share);
        (share > 0.02).then_some(Panel { area: element.area * share, normal: element.normal, center, axes })
    };
    elements.iter().filter_map(panel).collect()
}

/// Half axes of a rectangle in the plane of an element with its second moments, which the water reaches to a share.
fn half_axes(element: &Element, share: f64) -> [Vec3; 2] {
    let along = element.normal.cross(&Vec3::z());
    // horizontal and uphill, so that water cuts the second one
    let along = along.try_normalize(1e-3).unwrap_or_else(Vec3::x);
    let uphill = element.normal.cross(&along);
    let half = |axis: &Vec3| (3.0 * axis.dot(&(element.spread * axis)).max(0.0)).sqrt();
    [along * half(&along), uphill * (half(&uphill) * share)]
}

/// The water that an upright hull sets in motion at once.
#[derive(Debug, Clone)]
pub struct Impulse {
    /// Added mass and inertia at infinite frequency about the body origin, over the density [m3, m4, m5]; symmetric.
    pub mass: Matrix6<f64>,
    /// Potential at each panel of a unit velocity of each mode [m, m2].
    potentials: Vec<Vector6<f64>>,
}

/// Solves for the sources. A hull that no water reaches moves none.
pub fn impulse(panels: &[Panel], basin: &Basin) -> Impulse {
    let count = panels.len();
    let none = Impulse { mass: Matrix6::zeros(), potentials: vec![Vector6::zeros(); count] };
    if count == 0 {
        return none;
    }
    let modes = DMatrix::from_fn(count, 6, |row, mode| panels[row].mode()[mode]);
    let mut velocity = DMatrix::zeros(count, count);
    let mut potential = DMatrix::zeros(count, count);
    for (row, at) in panels.iter().enumerate() {
        for (column, from) in panels.iter().enumerate() {
            let (phi, gradient) = from.potential(at, basin);
            potential[(row, column)] = phi;
            velocity[(row, column)] = gradient.dot(&at.normal) + if row == column { 0.5 } else { 0.0 };
        }
    }
    let Some(sources) = velocity.lu().solve(&modes) else { return none };
    let potentials = potential * sources;
    let potentials: Vec<Vector6<f64>> =
        (0..count).map(|row| Vector6::from_fn(|mode, _| potentials[(row, mode)])).collect();
    let mass = panels
        .iter()
        .zip(&potentials)
        .fold(Matrix6::zeros(), |sum, (panel, own)| sum - panel.mode() * own.transpose() * panel.area);
    Impulse { mass: 0.5 * (mass + mass.transpose()), potentials }
}

/// Radiation damping at a frequency [rad/s] about the body origin, over the density [m3/s, m4/s, m5/s]; symmetric, not negative.
pub fn damping(panels: &[Panel], basin: &Basin, impulse: &Impulse, frequency: f64) -> Matrix6<f64> {
    let wave = Wave::new(frequency, basin);
    let mut sum = Matrix6::zeros();
    for heading in 0..HEADINGS {
        let (sine, cosine) = (2.0 * PI * heading as f64 / HEADINGS as f64).sin_cos();
        let direction = Vec3::new(cosine, sine, 0.0);
        let mut excitation = Vector6::<Complex<f64>>::zeros();
        for (panel, potentials) in panels.iter().zip(&impulse.potentials) {
            let pressure = wave.pressure(&panel.center, &direction);
            let met = wave.acceleration(&panel.center, &direction);
            let met = met.x * panel.normal.x + met.y * panel.normal.y + met.z * panel.normal.z;
            excitation -= panel.mode().map(|n| pressure * (n * panel.area));
            excitation -= potentials.component_mul(&DIFFRACTED).map(|phi| met * (phi * panel.area));
        }
        sum += (excitation * excitation.adjoint()).map(|x| x.re);
    }
    let scale = 2.0 * PI / HEADINGS as f64;
    sum * (scale * wave.number / (8.0 * PI * GRAVITY * wave.group))
}

impl Panel {
    /// A panel of four corners, counter-clockwise seen from outside, the last one twice in a triangle; body frame [m].
    pub fn from_corners(corners: &[[f64; 3]; 4]) -> Self {
        let [a, b, c, d] = corners.map(Vec3::from);
        let halves =
            [[a, b, c], [a, c, d]].map(|[a, b, c]| ((b - a).cross(&(c - a)) * 0.5, (a + b + c) / 3.0));
        let [area, other] = halves.map(|(vector, _)| vector.norm());
        let whole = (area + other).max(f64::MIN_POSITIVE);
        let normal = (halves[0].0 + halves[1].0).try_normalize(0.0).unwrap_or_else(Vec3::z);
        // the rectangle of its area along its longer middle line
        let lines = [(b + c - a - d) / 4.0, (c + d - a - b) / 4.0];
        let longer = lines[usize::from(lines[1].norm() > lines[0].norm())];
        let across = normal.cross(&longer);
        let axes = [longer, across * (0.25 * (area + other) / longer.norm_squared().max(f64::MIN_POSITIVE))];
        Self { area: area + other, normal, center: (halves[0].1 * area + halves[1].1 * other) / whole, axes }
    }

    /// Generalized normal about the body origin.
    fn mode(&self) -> Vector6<f64> {
        let arm = self.center.cross(&self.normal);
        Vector6::new(self.normal.x, self.normal.y, self.normal.z, arm.x, arm.y, arm.z)
    }

    /// Potential and velocity at another panel of a source of strength one over this one, images included.
    fn potential(&self, at: &Panel, basin: &Basin) -> (f64, Vec3) {
        let mut sum = (0.0, Vec3::zeros());
        let mut add = |shift: f64, flip: f64, sign: f64| {
            // the other as the image's own panel sees it
            let seen = Vec3::new(at.center.x, at.center.y, flip * (at.center.z - shift));
            // an image is across the surface or the bed, where the gap is water
            let facing = if (shift, flip) == (0.0, 1.0) { at.normal.dot(&self.normal) } else { 0.0 };
            let (phi, gradient) = self.own_potential(&(seen - self.center), facing);
            sum.0 += sign * phi;
            sum.1 += Vec3::new(gradient.x, gradient.y, flip * gradient.z) * sign;
        };
        let level = basin.level;
        match basin.bed {
            None => {
                add(0.0, 1.0, 1.0);
                add(2.0 * level, -1.0, -1.0);
            }
            Some(bed) => {
                for n in -IMAGES..=IMAGES {
                    let shift = 2.0 * f64::from(n) * (level - bed);
                    // the series alternates: half of its last term is the better sum
                    let last = if n.abs() == IMAGES { 0.5 } else { 1.0 };
                    let sign = last * if n % 2 == 0 { 1.0 } else { -1.0 };
                    add(shift, 1.0, sign);
                    add(2.0 * bed + shift, -1.0, sign);
                }
            }
        }
        sum
    }

    /// The same without images, at an arm from the center: of a point from afar, of a grid of points at
    /// close quarters. `facing` is the cosine between the normals.
    fn own_potential(&self, arm: &Vec3, facing: f64) -> (f64, Vec3) {
        let near = 4.0 * (self.axes[0].norm_squared() + self.axes[1].norm_squared());
        if arm.norm_squared() >= near {
            self.potential_of_points(arm, 1)
        } else if facing < ACROSS {
            self.potential_across(arm)
        } else {
            self.potential_of_points(arm, CLOSE)
        }
    }

    /// The same of so many points a side.
    fn potential_of_points(&self, arm: &Vec3, cells: usize) -> (f64, Vec3) {
        let strength = self.area / (4.0 * PI * (cells * cells) as f64);
        // at the center of a disc of radius a the potential is that of a point at a/2
        let blunt = self.area / (4.0 * PI * (cells * cells) as f64);
        let mut sum = (0.0, Vec3::zeros());
        let place = |i: usize| (2 * i + 1) as f64 / cells as f64 - 1.0;
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let arm = arm - self.axes[0] * place(i) - self.axes[1] * place(j);
            let distance = (arm.norm_squared() + blunt).sqrt();
            sum.0 -= strength / distance;
            sum.1 += arm * (strength / distance.powi(3));
        }
        sum
    }

    /// The same on the other side of a plate or of a gap, of the rectangle: points let the flow pass
    /// between them. The potential starts from that of the points in the plane of the panel, so that what
    /// they miss is the same on both sides.
    fn potential_across(&self, arm: &Vec3) -> (f64, Vec3) {
        let sizes = self.axes.map(|axis| axis.norm());
        let scale = (self.area / (4.0 * sizes[0] * sizes[1])).sqrt();
        // a sliver has no rectangle of its area
        if scale.is_nan() || scale > MOST_STRETCHED {
            return self.potential_of_points(arm, CLOSE);
        }
        let height = arm.dot(&self.normal);
        let in_plane = arm - self.normal * height;
        let sides = [0, 1].map(|i| (self.axes[i] / sizes[i], scale * sizes[i]));
        let [(here, _), (there, velocity)] =
            [0.0, height].map(|height| potential_of_rectangle(&in_plane, &self.normal, height, &sides));
        (self.potential_of_points(&in_plane, CLOSE).0 + there - here, velocity)
    }
}

/// Potential and velocity of a source of strength one over a rectangle, at an arm in its plane from its
/// center and a height over it (Hess, Smith, Prog. Aeronaut. Sci. 8, 1967). Its half sides are
/// directions and lengths.
fn potential_of_rectangle(
    in_plane: &Vec3,
    normal: &Vec3,
    height: f64,
    sides: &[(Vec3, f64); 2],
) -> (f64, Vec3) {
    let [(e, half_e), (f, half_f)] = sides;
    let (x, y) = (in_plane.dot(e), in_plane.dot(f));
    let least = 1e-9 * half_e.min(*half_f);
    let mut sum = (0.0, Vec3::zeros());
    for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let (p, q) = (x - a * half_e, y - b * half_f);
        let r = (p * p + q * q + height * height).sqrt();
        let (in_p, in_q) = ((r + p).max(least).ln(), (r + q).max(least).ln());
        let angle = if height.abs() > least { (p * q / (height * r)).atan() } else { 0.0 };
        let sign = -a * b / (4.0 * PI);
        sum.0 += sign * (p * in_q + q * in_p - height * angle);
        sum.1 += (e * in_q + f * in_p - normal * angle) * sign;
    }
    sum
}

/// A wave of amplitude 1 m over the basin.
struct Wave {
    number: f64,
    group: f64,
    level: f64,
    depth: f64,
}

impl Wave {
    fn new(frequency: f64, basin: &Basin) -> Self {
        let depth = basin.depth();
        let deep = frequency * frequency / GRAVITY;
        let mut number = deep;
        if depth.is_finite() {
            // k tanh(k h) = omega^2 / g, by Newton from the larger of the two limits
            number = deep.max((deep / depth).sqrt());
            for _ in 0..20 {
                let (t, kh) = ((number * depth).tanh(), number * depth);
                number -= (number * t - deep) / (t + kh * (1.0 - t * t));
            }
        }
        let speed = frequency / number;
        let kh = (number * depth).min(50.0);
        let shallow = if depth.is_finite() { 2.0 * kh / (2.0 * kh).sinh() } else { 0.0 };
        Self { number, group: 0.5 * speed * (1.0 + shallow), level: basin.level, depth }
    }

    /// Decay with depth of pressure and of its rate along z [-, 1/m].
    fn profile(&self, z: f64) -> (f64, f64) {
        let (k, below) = (self.number, z - self.level);
        if self.depth.is_finite() && k * self.depth < 50.0 {
            let bottom = (k * self.depth).cosh();
            ((k * (below + self.depth)).cosh() / bottom, k * (k * (below + self.depth)).sinh() / bottom)
        } else {
            ((k * below).exp(), k * (k * below).exp())
        }
    }

    /// Pressure over the density [m2/s2].
    fn pressure(&self, at: &Vec3, direction: &Vec3) -> Complex<f64> {
        let phase = Complex::from_polar(1.0, self.number * direction.dot(at));
        phase * (GRAVITY * self.profile(at.z).0)
    }

    /// Acceleration of the water [m/s2].
    fn acceleration(&self, at: &Vec3, direction: &Vec3) -> nalgebra::Vector3<Complex<f64>> {
        let (level, rate) = self.profile(at.z);
        let phase = Complex::from_polar(GRAVITY, self.number * direction.dot(at));
        let along = phase * Complex::new(0.0, -self.number * level);
        nalgebra::Vector3::new(along * direction.x, along * direction.y, -phase * rate)
    }
}
