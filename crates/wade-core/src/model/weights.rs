//! What is learnt, and how a network's answers become forces.

use crate::anchor::{Anchor, COORDINATES, GLOBAL, OUTPUTS as ANCHORED_OUTPUTS, Reading, Remainder};
use crate::condition::GroundContact;
use crate::model::network::{Network, OUTPUTS, Scaling};
use crate::real::{Dual, Real, smoothstep};
use crate::vehicle::Vehicle;

/// What the weights are and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Layers.
    pub network: Network,
    /// What the network is told and what its answers mean.
    pub form: Form,
    /// Source of the training data, such as `analytic`.
    pub provenance: String,
}

/// What a network is told and what its answers mean.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// The paper's: the force on a surface over the density, as a whole.
    Paper(Paper),
    /// See [`crate::anchor`]: what is left of the force besides hydrostatics and a simple drag.
    Anchored(Box<Anchored>),
}

/// The paper's standardisation.
#[derive(Debug, Clone, PartialEq)]
pub struct Paper {
    /// Standardisation of inputs and targets.
    pub scaling: Scaling,
    /// Convention of the training data for the contact patches, which the weights have baked in.
    pub ground_contact: GroundContact,
    /// Root mean square of the error of the net force over density on held-out cases of this vehicle [m4/s2].
    pub held_out_rms: [f64; OUTPUTS],
}

/// Index of the answer that says how far the others may be off.
pub const SPREAD: usize = ANCHORED_OUTPUTS;

/// Distances, in units of what is usual, up to which all of the learnt part counts, and from which nothing of it: one case in
/// twenty lies farther from its neighbors than the unit, and the network was taught some way beyond the cases.
const FADES: [f64; 2] = [2.0, 4.0];

/// What goes with a network that learnt the remainder.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchored {
    /// What the answer is a remainder of.
    pub remainder: Remainder,
    /// Mean of each global feature over the training cases.
    pub global_mean: [f32; GLOBAL],
    /// Standard deviation of each global feature; 1 where it never varied.
    pub global_std: [f32; GLOBAL],
    /// One standard deviation of each component of the net force, over the network's own measure of it [-].
    pub spread: [f32; OUTPUTS],
    /// Where the training cases lie; in units of `coordinate_scale`.
    pub cases: Vec<[f32; COORDINATES]>,
    /// Unit of each coordinate.
    pub coordinate_scale: [f32; COORDINATES],
    /// Distance to their nearest neighbor that 95 % of the training cases keep.
    pub near: f32,
}

impl Anchored {
    /// Standardised global features, of which the network takes the first [`Remainder::global_names`].
    pub fn standardize(&self, global: &[f64; GLOBAL]) -> [f32; GLOBAL] {
        std::array::from_fn(|i| (global[i] as f32 - self.global_mean[i]) / self.global_std[i])
    }

    /// Distance to the nearest training case or its mirror image, over what is usual among these; so far that nothing counts where
    /// the hull is tilted by a right angle or more.
    pub fn distance(&self, reading: &Reading) -> f64 {
        let here = self.place(&reading.coordinates);
        let to = |here: &[f32; COORDINATES]| {
            self.cases.iter().map(|case| squared(here, case)).fold(f32::INFINITY, f32::min)
        };
        let nearest = match self.remainder {
            // its coordinates have no side
            Remainder::OfDrag => to(&here),
            Remainder::OfPhysics => to(&here).min(to(&mirrored(here))),
        };
        f64::from(nearest.sqrt() / self.near) + overturned(reading.upright)
    }

    /// The same with derivatives: those of the distance to the case that is nearest.
    pub fn distance_dual<const N: usize>(&self, reading: &Reading<Dual<N>>) -> Dual<N> {
        let coordinates = &reading.coordinates;
        let here = self.place(&coordinates.map(Real::value));
        // the state and a case are as far apart as the state's mirror image and the case's
        let images = match self.remainder {
            Remainder::OfDrag => 1,
            Remainder::OfPhysics => 2,
        };
        let as_seen = [|case: &_| *case, |case: &_| mirrored(*case)];
        let distances = as_seen[..images]
            .iter()
            .flat_map(|as_seen| self.cases.iter().map(as_seen).map(|case| (squared(&here, &case), case)));
        let nearest = distances.reduce(|best, next| if next.0 < best.0 { next } else { best });
        let Some((_, nearest)) = nearest else { return f64::INFINITY.into() };
        let sum = (0..COORDINATES).fold(Dual::default(), |sum, axis| {
            let unit = f64::from(self.coordinate_scale[axis]);
            let gap = coordinates[axis] / unit - f64::from(nearest[axis]);
            sum + gap * gap
        });
        sum.sqrt() / f64::from(self.near) + overturned(reading.upright)
    }

    /// How far loads had set in on each surface of a vehicle in the case that wetted it most: what was dry in all has nothing
    /// learnt, and what the network says of it is anybody's guess.
    pub fn learnt(&self, anchor: &Anchor, vehicle: &Vehicle) -> Vec<f64> {
        let mut learnt = vec![0.0; vehicle.surfaces.len()];
        for case in &self.cases {
            let coordinates = std::array::from_fn(|i| f64::from(case[i] * self.coordinate_scale[i]));
            let onsets = anchor.onsets(vehicle, &coordinates);
            learnt.iter_mut().zip(onsets).for_each(|(most, onset)| *most = f64::max(*most, onset));
        }
        learnt
    }

    /// Coordinates of a state in the units of the cases.
    pub fn place(&self, coordinates: &[f64; COORDINATES]) -> [f32; COORDINATES] {
        std::array::from_fn(|i| coordinates[i] as f32 / self.coordinate_scale[i])
    }

    /// How much of the learnt part counts at a distance: all of it up to 2, nothing from 4, smooth between.
    pub fn trust<T: Real>(distance: T) -> T {
        smoothstep((-distance + FADES[1]) / (FADES[1] - FADES[0]))
    }

    /// How much of the learnt part may be wrong because the state is a stranger: none as near to a case as is usual, all of it
    /// where nothing of it counts any more.
    pub fn doubt(distance: f64) -> f64 {
        let share = (distance - 1.0) / (FADES[1] - 1.0);
        share.clamp(0.0, 1.0).max(1.0 - Self::trust(distance))
    }

    /// The measure that the network states of a surface's uncertainty, 0 or more: `ln(1 + e^x)`.
    pub fn softplus(output: f32) -> f64 {
        let x = f64::from(output);
        x.max(0.0) + (-x.abs()).exp().ln_1p()
    }
}

/// What is added to the distance of a hull whose up has such a component along body z: nothing up to a tilt of 60 degrees.
fn overturned<T: Real>(upright: T) -> T {
    smoothstep((-upright + 0.5) / 0.5) * FADES[1]
}

/// Where the coordinates stand that change their sign in the mirror across y = 0: those of direction and of up along y.
const ASIDE: [usize; 2] = [4, 6];

/// The place of the mirror image across y = 0.
fn mirrored(mut place: [f32; COORDINATES]) -> [f32; COORDINATES] {
    ASIDE.into_iter().for_each(|axis| place[axis] = -place[axis]);
    place
}

/// Square of the distance between two places.
fn squared(here: &[f32; COORDINATES], case: &[f32; COORDINATES]) -> f32 {
    here.iter().zip(case).fold(0.0, |sum, (a, b)| sum + (a - b) * (a - b))
}

impl Form {
    /// Name in files and reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Paper(_) => "paper",
            Self::Anchored(_) => "anchored",
        }
    }
}

impl Weights {
    /// True of weights that stand on the physical base where the bundle has one. The paper's network answers the whole force, as
    /// published.
    pub fn takes_base(&self) -> bool {
        matches!(self.form, Form::Anchored(_))
    }

    /// True of weights that answer nothing without the physical base.
    pub fn needs_base(&self) -> bool {
        matches!(&self.form, Form::Anchored(form) if form.remainder == Remainder::OfPhysics)
    }

    /// Convention for the contact patches that the weights have baked in; `None` where they serve both.
    pub fn ground_contact(&self) -> Option<GroundContact> {
        match &self.form {
            Form::Paper(paper) => Some(paper.ground_contact),
            Form::Anchored(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Anchored;

    #[test]
    fn doubt_grows_from_what_is_usual_to_where_nothing_counts_any_more() {
        let at: Vec<f64> = (0..=50).map(|i| Anchored::doubt(0.1 * f64::from(i))).collect();
        assert!(at[..=10].iter().all(|doubt| *doubt == 0.0) && at[40..].iter().all(|doubt| *doubt == 1.0));
        assert!(at.is_sorted() && at[15] > 0.1, "{at:?}");
        assert!(at.iter().enumerate().all(|(i, d)| *d >= 1.0 - Anchored::trust(0.1 * i as f64)));
    }
}
