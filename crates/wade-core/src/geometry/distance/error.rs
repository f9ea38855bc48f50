//! Why a grid was refused.

/// Why a grid was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A mesh without faces.
    #[error("a signed distance needs a mesh with faces")]
    Empty,
    /// More points than `MAX_POINTS`: a hull far smaller than the margin.
    #[error(
        "a grid of {x} x {y} x {z} points is too large: the spacing of {spacing_m} m is too fine for a margin of 0.5 m"
    )]
    TooLarge {
        /// Points along x.
        x: usize,
        /// Points along y.
        y: usize,
        /// Points along z.
        z: usize,
        /// Grid spacing [m].
        spacing_m: f64,
    },
    /// Stored values that do not fit the shape, or a spacing that is not positive.
    #[error("{values} values do not fill a grid of {expected} points with spacing {spacing_m} m")]
    Shape {
        /// Number of values.
        values: usize,
        /// Product of the shape.
        expected: usize,
        /// Grid spacing [m].
        spacing_m: f64,
    },
    /// A NaN or infinite number.
    #[error("grid value {index} is not finite")]
    NotFinite {
        /// Index of the value.
        index: usize,
    },
}
