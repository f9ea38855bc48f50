//! The wheels and tracks of a vehicle in the order in which their speeds are stated. Of a track it is that of its drive sprocket.

use std::ops::Deref;

use super::Vehicle;
use crate::frame::Vec3;

/// Most wheels whose speeds can be stated.
pub const MAX_WHEELS: usize = 8;

/// How far apart along x the wheels of one axle may be, over the radius of the smaller one [-].
const ONE_AXLE: f64 = 0.5;

impl Vehicle {
    /// Indices of the surfaces that turn, in the order in which their speeds are stated: by axle from the front, left before right.
    ///
    /// Of two pairs the order is front left, front right, rear left, rear right of the middle of the hull, also where the wheels
    /// of a pair are not at the same x. A vehicle may have more wheels than [`MAX_WHEELS`]; then no speeds can be stated for it.
    pub fn wheels(&self) -> Vec<usize> {
        let turns = |index: &usize| self.surfaces[*index].kind.turns();
        let mut wheels: Vec<usize> = (0..self.surfaces.len()).filter(turns).collect();
        let at = |index: usize| self.surfaces[index].centroid;
        let quarter = |index: usize| 2 * usize::from(at(index).x < 0.0) + usize::from(at(index).y < 0.0);
        let mut quarters: Vec<usize> = wheels.iter().map(|&index| quarter(index)).collect();
        quarters.sort_unstable();
        if quarters == [0, 1, 2, 3] {
            wheels.sort_by_key(|&index| quarter(index));
            return wheels;
        }
        let places: Vec<(Vec3, f64)> =
            wheels.iter().map(|&index| (at(index), self.radius_along_x(index))).collect();
        by_axle(&places).into_iter().map(|place| wheels[place]).collect()
    }

    /// Half the extent of a surface along x [m].
    fn radius_along_x(&self, surface: usize) -> f64 {
        self.hull.bounds_of(surface).map_or(0.0, |bounds| 0.5 * bounds.extent().x)
    }
}

/// Order of wheels, each with its center and radius [m], by axle from the front, left before right.
pub fn by_axle(wheels: &[(Vec3, f64)]) -> Vec<usize> {
    let center = |wheel: usize| wheels[wheel].0;
    let mut order: Vec<usize> = (0..wheels.len()).collect();
    order.sort_by(|&a, &b| center(b).x.total_cmp(&center(a).x));
    let mut rest = &mut order[..];
    while let Some(&first) = rest.first() {
        let reach = |wheel: usize| ONE_AXLE * wheels[first].1.min(wheels[wheel].1);
        let is_beside = |&&wheel: &&usize| center(first).x - center(wheel).x <= reach(wheel);
        let count = rest.iter().take_while(is_beside).count();
        let (axle, behind) = rest.split_at_mut(count);
        axle.sort_by(|&a, &b| center(b).y.total_cmp(&center(a).y));
        rest = behind;
    }
    order
}

/// One value a wheel in the order of [`Vehicle::wheels`], of up to [`MAX_WHEELS`]. A value to copy, without a heap.
#[derive(Clone, Copy)]
pub struct PerWheel<T> {
    values: [T; MAX_WHEELS],
    count: u8,
}

impl<T: Copy + Default> PerWheel<T> {
    /// No values.
    pub fn none() -> Self {
        Self { values: [T::default(); MAX_WHEELS], count: 0 }
    }

    /// These values; none where there are more than [`MAX_WHEELS`].
    pub fn new(values: &[T]) -> Option<Self> {
        let mut all = [T::default(); MAX_WHEELS];
        all.get_mut(..values.len())?.copy_from_slice(values);
        Some(Self { values: all, count: values.len() as u8 })
    }

    /// What a function makes of each value.
    pub fn map<U: Copy + Default>(&self, mut make: impl FnMut(T) -> U) -> PerWheel<U> {
        let mut values = [U::default(); MAX_WHEELS];
        values.iter_mut().zip(self.iter()).for_each(|(place, &value)| *place = make(value));
        PerWheel { values, count: self.count }
    }

    /// The same of a function that may fail: the first failure.
    pub fn try_map<U: Copy + Default, E>(
        &self,
        mut make: impl FnMut(T) -> Result<U, E>,
    ) -> Result<PerWheel<U>, E> {
        let mut values = [U::default(); MAX_WHEELS];
        for (place, &value) in values.iter_mut().zip(self.iter()) {
            *place = make(value)?;
        }
        Ok(PerWheel { values, count: self.count })
    }
}

impl PerWheel<f32> {
    /// The values up to the last that is a number, of places behind whose last wheel there is NaN: one at least.
    pub fn stated(places: &[f32; MAX_WHEELS]) -> Self {
        let count = places.iter().rposition(|value| !value.is_nan()).map_or(1, |last| last + 1);
        Self { values: *places, count: count as u8 }
    }
}

impl<T> Deref for PerWheel<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values[..usize::from(self.count)]
    }
}

impl<T: PartialEq> PartialEq for PerWheel<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: std::fmt::Debug> std::fmt::Debug for PerWheel<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        (**self).fmt(f)
    }
}

impl<T: Copy + Default, const COUNT: usize> From<[T; COUNT]> for PerWheel<T> {
    fn from(values: [T; COUNT]) -> Self {
        const { assert!(COUNT <= MAX_WHEELS, "more values than wheels") };
        let mut all = [T::default(); MAX_WHEELS];
        all[..COUNT].copy_from_slice(&values);
        Self { values: all, count: COUNT as u8 }
    }
}
