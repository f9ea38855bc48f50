//! Test 1: drag grows with the square of the speed.

use serde::{Deserialize, Serialize};

use super::Thresholds;
use super::check::Check;
use super::fit::{OriginFit, through_origin};
use super::section::{DepthGroup, Section};
use crate::published::{self, PaperDepth};

/// How R2 is meant, since the source paper does not say.
pub const R2_DEFINITION: &str = "1 - sum (|Fx| - C v^2)^2 / sum (|Fx| - mean |Fx|)^2: against the mean, although the line \
     goes through the origin; r2_about_zero has sum |Fx|^2 below the line instead";

/// Which sections of two depths are compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PairConfig {
    /// Largest difference of speed [m/s].
    pub speed_tolerance_mps: f64,
    /// Least speed of both [m/s].
    pub least_speed_mps: f64,
}

impl Default for PairConfig {
    fn default() -> Self {
        Self { speed_tolerance_mps: 0.3, least_speed_mps: 0.6 }
    }
}

/// What the test found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DragScaling {
    /// How R2 is meant.
    pub r2_definition: &'static str,
    /// Width in the frontal area W d [m].
    pub width_m: f64,
    /// By rising depth.
    pub depths: Vec<DragAtDepth>,
    /// Speed-matched pairs over all combinations of two depths.
    pub pairs: usize,
    /// Each combination.
    pub ratios: Vec<Ratio>,
}

/// The fit `|Fx| = C_D,eff v^2` at one depth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DragAtDepth {
    /// Depth [m].
    pub depth_m: f64,
    /// Number of points.
    pub sections: usize,
    /// Effective drag parameter [N s2/m2]; none for a single section.
    pub c_d_eff: Option<f64>,
    /// Its standard error [N s2/m2].
    pub c_d_eff_std: Option<f64>,
    /// R2 against the mean.
    pub r2: Option<f64>,
    /// R2 against zero.
    pub r2_about_zero: Option<f64>,
    /// Drag coefficient `2 C_D,eff / (rho W d)`.
    pub c_d: Option<f64>,
    /// The paper's figures: other data.
    pub paper: Option<PaperDepth>,
}

/// Speed-matched pairs of two depths.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ratio {
    /// The shallower and the deeper [m].
    pub depths_m: [f64; 2],
    /// Number of pairs.
    pub pairs: usize,
    /// Mean over the pairs of the deeper section's `|Fx| / v^2` over the shallower one's.
    pub mean_of_pairs: f64,
    /// Ratio of the fits.
    pub of_fits: f64,
    /// `mean_of_pairs / of_fits - 1`.
    pub difference: f64,
}

/// `C_D = 2 C_D,eff / (rho W d)`.
pub fn drag_coefficient(c_d_eff: f64, density: f64, width: f64, depth: f64) -> f64 {
    c_d_eff / (0.5 * density * width * depth)
}

/// Fits each depth and compares speed-matched pairs.
pub fn drag_scaling(
    groups: &[DepthGroup<'_>],
    vehicle: &str,
    width: f64,
    config: &PairConfig,
) -> DragScaling {
    let fits: Vec<Option<OriginFit>> = groups
        .iter()
        .map(|group| through_origin(&group.values(|s| s.speed_squared_m2ps2), &group.values(|s| s.drag_n)))
        .collect();
    let at_depth = |(group, fit): (&DepthGroup<'_>, &Option<OriginFit>)| DragAtDepth {
        depth_m: group.depth_m,
        sections: group.sections.len(),
        c_d_eff: fit.map(|fit| fit.slope),
        c_d_eff_std: fit.map(|fit| fit.slope_std),
        r2: fit.map(|fit| fit.r2),
        r2_about_zero: fit.map(|fit| fit.r2_about_zero),
        c_d: fit.map(|fit| drag_coefficient(fit.slope, group.density_kgpm3, width, group.depth_m)),
        paper: published::at(vehicle, group.depth_m),
    };
    let fitted: Vec<(&DepthGroup<'_>, f64)> =
        groups.iter().zip(&fits).filter_map(|(group, fit)| Some((group, fit.as_ref()?.slope))).collect();
    let combinations = (0..fitted.len()).flat_map(|a| (a + 1..fitted.len()).map(move |b| (a, b)));
    let ratios: Vec<Ratio> = combinations.filter_map(|(a, b)| ratio(fitted[a], fitted[b], config)).collect();
    DragScaling {
        r2_definition: R2_DEFINITION,
        width_m: width,
        depths: groups.iter().zip(&fits).map(at_depth).collect(),
        pairs: ratios.iter().map(|ratio| ratio.pairs).sum(),
        ratios,
    }
}

fn ratio(
    (shallow, shallow_fit): (&DepthGroup<'_>, f64),
    (deep, deep_fit): (&DepthGroup<'_>, f64),
    config: &PairConfig,
) -> Option<Ratio> {
    let matched = |a: &Section, b: &Section| {
        (a.speed() - b.speed()).abs() <= config.speed_tolerance_mps
            && a.speed().min(b.speed()) >= config.least_speed_mps
    };
    let pairs = shallow.sections.iter().flat_map(|a| deep.sections.iter().map(move |b| (a, b)));
    let ratios: Vec<f64> =
        pairs.filter(|(a, b)| matched(a, b)).map(|(a, b)| b.c_d_eff() / a.c_d_eff()).collect();
    let mean_of_pairs = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let of_fits = deep_fit / shallow_fit;
    (!ratios.is_empty()).then(|| Ratio {
        depths_m: [shallow.depth_m, deep.depth_m],
        pairs: ratios.len(),
        mean_of_pairs,
        of_fits,
        difference: mean_of_pairs / of_fits - 1.0,
    })
}

impl DragScaling {
    /// What must hold.
    pub(super) fn checks(&self, sections: &[Section], thresholds: &Thresholds) -> Vec<Check> {
        let least = thresholds.drag_r2;
        let enough = |at: &&DragAtDepth| at.sections >= thresholds.sections;
        let judged: Vec<&DragAtDepth> = self.depths.iter().filter(enough).collect();
        let worst =
            judged.iter().filter_map(|at| Some((at.r2?, at.depth_m))).min_by(|a, b| a.0.total_cmp(&b.0));
        let pushed = sections.iter().find(|section| section.along_motion_n > 0.0);
        let apart = self.ratios.iter().max_by(|a, b| a.difference.abs().total_cmp(&b.difference.abs()));
        let limit = thresholds.ratio_difference;
        vec![
            Check::new(
                "drag_r2",
                worst.map(|(r2, _)| r2 >= least),
                match worst {
                    Some((r2, depth)) => format!(
                        "|Fx| against v^2 through the origin: the least R2 is {r2:.4}, at {depth:.3} m; {least} is \
                         required."
                    ),
                    None => format!(
                        "|Fx| against v^2: no depth has {} sections of different drag.",
                        thresholds.sections
                    ),
                },
            ),
            Check::new(
                "drag_opposes_motion",
                Some(pushed.is_none()),
                match pushed {
                    Some(section) => {
                        format!("In {} the predicted Fx pushes along the motion.", section.trial)
                    }
                    None => "The predicted Fx opposes the motion in every section.".to_owned(),
                },
            ),
            Check::new(
                "pair_ratios",
                apart.map(|ratio| ratio.difference.abs() <= limit),
                match apart {
                    Some(ratio) => format!(
                        "{} speed-matched pairs: their mean ratios differ from those of the fits by {:.1} % at most; \
                         {:.0} % is allowed.",
                        self.pairs,
                        100.0 * ratio.difference.abs(),
                        100.0 * limit
                    ),
                    None => "There are no speed-matched pairs of two depths.".to_owned(),
                },
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::fit::line;
    use super::drag_coefficient;
    use crate::published::{DEPTHS, F0_R2, WIDTH_M};

    #[test]
    fn the_published_width_gives_the_paper_s_drag_coefficients_and_the_mesh_s_does_not() {
        let rounded = |width: f64| {
            DEPTHS.map(|p| (drag_coefficient(p.c_d_eff, 1000.0, width, p.depth_m) * 100.0).round() / 100.0)
        };
        assert_eq!(rounded(WIDTH_M), DEPTHS.map(|p| p.c_d));
        assert_eq!(rounded(1.391), [0.70, 0.77, 0.89]);
    }

    #[test]
    fn the_paper_s_linear_r2_is_that_of_a_line_through_three_points() {
        let fit = line(&DEPTHS.map(|p| p.depth_m), &DEPTHS.map(|p| p.f0_n)).unwrap();
        assert!((fit.r2 - F0_R2).abs() < 5e-4, "{}", fit.r2);
    }
}
