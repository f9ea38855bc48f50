//! Straight lines by least squares.

use serde::Serialize;

/// `y = slope x`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OriginFit {
    /// The slope.
    pub slope: f64,
    /// Its standard error.
    pub slope_std: f64,
    /// `1 - sum (y - slope x)^2 / sum (y - mean y)^2`: judged against the mean, as for a free line.
    pub r2: f64,
    /// `1 - sum (y - slope x)^2 / sum y^2`: judged against zero, as some programs do without an intercept; never lower.
    pub r2_about_zero: f64,
}

/// The line through the origin; `None` below two points, or where x or y do not vary.
pub fn through_origin(x: &[f64], y: &[f64]) -> Option<OriginFit> {
    let n = x.len() as f64;
    let (xx, xy) = (dot(x, x), dot(x, y));
    let slope = xy / xx;
    let rest = x.iter().zip(y).map(|(x, y)| (y - slope * x).powi(2)).sum::<f64>();
    let spread = spread(y);
    (x.len() >= 2 && xx > 0.0 && spread > 0.0).then(|| OriginFit {
        slope,
        slope_std: (rest / (n - 1.0) / xx).sqrt(),
        r2: 1.0 - rest / spread,
        r2_about_zero: 1.0 - rest / dot(y, y),
    })
}

/// `y = intercept + slope x`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LineFit {
    /// Value at zero.
    pub intercept: f64,
    /// Its standard error; zero for two points, which every line fits.
    pub intercept_std: f64,
    /// The slope.
    pub slope: f64,
    /// Coefficient of determination.
    pub r2: f64,
}

/// The line; `None` below two points, or where x or y do not vary.
pub fn line(x: &[f64], y: &[f64]) -> Option<LineFit> {
    let n = x.len() as f64;
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (xx, yy) = (spread(x), spread(y));
    if x.len() < 2 || xx <= 0.0 || yy <= 0.0 {
        return None;
    }
    let xy: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let slope = xy / xx;
    let intercept = mean_y - slope * mean_x;
    let rest = x.iter().zip(y).map(|(x, y)| (y - intercept - slope * x).powi(2)).sum::<f64>();
    let variance = if x.len() > 2 { rest / (n - 2.0) } else { 0.0 };
    let intercept_std = (variance * (1.0 / n + mean_x * mean_x / xx)).sqrt();
    Some(LineFit { intercept, intercept_std, slope, r2: 1.0 - rest / yy })
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|value| (value - mean).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn three_points_by_hand() {
        // slope 28 / 14; y - 2x = 0.5, -1, 0.5
        let fit = through_origin(&[1.0, 2.0, 3.0], &[2.5, 3.0, 6.5]).unwrap();
        assert!((fit.slope - 2.0).abs() < 1e-12);
        assert!((fit.slope_std - (1.5_f64 / 2.0 / 14.0).sqrt()).abs() < 1e-12);
        // mean 4, spread 2.25 + 1 + 6.25; sum of squares 6.25 + 9 + 42.25
        assert!((fit.r2 - (1.0 - 1.5 / 9.5)).abs() < 1e-12);
        assert!((fit.r2_about_zero - (1.0 - 1.5 / 57.5)).abs() < 1e-12);
        let fit = line(&[0.0, 1.0, 2.0], &[1.0, 2.0, 6.0]).unwrap();
        // slope 2.5, intercept 0.5, rest 0.25 + 1 + 0.25, spread 14
        assert!((fit.slope - 2.5).abs() < 1e-12 && (fit.intercept - 0.5).abs() < 1e-12);
        assert!((fit.r2 - (1.0 - 1.5 / 14.0)).abs() < 1e-12);
        assert!((fit.intercept_std - (1.5_f64 * (1.0 / 3.0 + 0.5)).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_does_not_vary_has_no_line() {
        assert_eq!(through_origin(&[1.0], &[2.0]), None);
        assert_eq!(through_origin(&[1.0, 2.0], &[3.0, 3.0]), None);
        assert_eq!(line(&[1.0, 1.0], &[3.0, 4.0]), None);
        assert_eq!(line(&[], &[]), None);
    }
}
