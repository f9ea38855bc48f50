//! Numbers that the physics is written for: plain ones, and ones that carry derivatives.
//!
//! A [`Dual`] is a value with its derivatives in `N` directions; each operation applies the chain rule (forward mode; Griewank,
//! Walther, Evaluating Derivatives, 2008, chapter 3). A formula that is generic over [`Real`] so has its derivative
//! beside it, and cannot disagree with it.

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar, Vector3};
use num_traits::{One, Zero};

/// A number. Where a function has a kink the derivative is that of the side that its value is taken from; that of a root at
/// zero is zero.
pub trait Real:
    Scalar
    + Copy
    + Default
    + Zero
    + One
    + PartialOrd
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + From<f64>
{
    /// Without derivatives.
    fn value(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// A power of a whole number.
    fn powi(self, exponent: i32) -> Self;
    /// Logarithm of base ten.
    fn log10(self) -> Self;

    /// Absolute value.
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    /// The larger one.
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() { other } else { self }
    }
    /// The smaller one.
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() { other } else { self }
    }
    /// Between two limits.
    fn clamp(self, low: f64, high: f64) -> Self {
        self.max(low.into()).min(high.into())
    }
}

impl Real for f64 {
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    fn powi(self, exponent: i32) -> Self {
        self.powi(exponent)
    }
    fn log10(self) -> Self {
        self.log10()
    }
    fn abs(self) -> Self {
        self.abs()
    }
    fn max(self, other: Self) -> Self {
        self.max(other)
    }
    fn min(self, other: Self) -> Self {
        self.min(other)
    }
    fn clamp(self, low: f64, high: f64) -> Self {
        self.clamp(low, high)
    }
}

/// 0 up to 0, 1 from 1, `x^2 (3 - 2 x)` between: with no kink.
pub fn smoothstep<T: Real>(x: T) -> T {
    let x = x.clamp(0.0, 1.0);
    x * x * (-(x * 2.0) + 3.0)
}

/// Length of a vector.
pub fn norm<T: Real>(vector: &Vector3<T>) -> T {
    vector.dot(vector).sqrt()
}

/// A value with its derivatives in `N` directions.
#[derive(Debug, Clone, Copy)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivative in each direction.
    pub slope: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A value that grows by one in a direction.
    pub fn along(value: f64, direction: usize) -> Self {
        Self { value, slope: std::array::from_fn(|i| f64::from(u8::from(i == direction))) }
    }

    /// A function of one number with this value and this derivative.
    #[inline(always)]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * derivative) }
    }

    /// `a x + b y` of the derivatives of two numbers.
    #[inline(always)]
    fn joined(value: f64, (a, x): (f64, Self), (b, y): (f64, Self)) -> Self {
        Self { value, slope: std::array::from_fn(|i| a * x.slope[i] + b * y.slope[i]) }
    }
}

impl<const N: usize> Real for Dual<N> {
    fn value(self) -> f64 {
        self.value
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    fn powi(self, exponent: i32) -> Self {
        self.chain(self.value.powi(exponent), f64::from(exponent) * self.value.powi(exponent - 1))
    }
    fn log10(self) -> Self {
        self.chain(self.value.log10(), (self.value * std::f64::consts::LN_10).recip())
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }
}

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        0.0.into()
    }
}

impl<const N: usize> Zero for Dual<N> {
    fn zero() -> Self {
        0.0.into()
    }
    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl<const N: usize> One for Dual<N> {
    fn one() -> Self {
        1.0.into()
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value && self.slope == other.slope
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::joined(self.value + other.value, (1.0, self), (1.0, other))
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::joined(self.value - other.value, (1.0, self), (-1.0, other))
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::joined(self.value * other.value, (other.value, self), (self.value, other))
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        let over = other.value.recip();
        Self::joined(quotient, (over, self), (-quotient * over, other))
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Self { value: self.value - other, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, other)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        self.chain(self.value / other, other.recip())
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize> MulAssign for Dual<N> {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const N: usize> DivAssign for Dual<N> {
    fn div_assign(&mut self, other: Self) {
        *self = *self / other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each operation once.
    fn formula<T: Real>(x: T, y: T) -> T {
        let mut sum = (x * y + 2.0).sqrt() / (y - 0.5) - x.powi(3) * 0.1;
        sum += (x * x + 1.0).log10() / 3.0 - (-y).abs();
        sum -= x.max(y) * x.min(y);
        sum *= (x * 0.4).clamp(-0.1, 0.9) + T::one();
        sum /= x + y + y;
        sum
    }

    #[test]
    fn derivatives_are_those_of_the_formula() {
        for (x, y) in [(1.3, 0.8), (0.4, 1.9), (2.7, 2.2)] {
            let found = formula(Dual::<2>::along(x, 0), Dual::along(y, 1));
            assert!((found.value - formula(x, y)).abs() < 1e-15);
            let step = 1e-6;
            let differences =
                [formula(x + step, y) - formula(x - step, y), formula(x, y + step) - formula(x, y - step)];
            for (slope, difference) in found.slope.iter().zip(differences) {
                assert!((slope - difference / (2.0 * step)).abs() < 1e-8, "{slope} {difference}");
            }
        }
    }
}
