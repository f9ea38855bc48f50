//! Test 2: the vertical force is buoyancy plus lift.

use serde::Serialize;

use super::Thresholds;
use super::check::Check;
use super::fit::{LineFit, line};
use super::section::{DepthGroup, Section};
use crate::published::{self, PaperDepth};
use wade_core::frame::{Vec3, WaterPlane};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::vehicle::Vehicle;

/// Steps from dry to the deepest trials in the mesh's curve.
const CURVE_STEPS: u32 = 50;

/// What the test found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerticalForce {
    /// By rising depth.
    pub depths: Vec<VerticalAtDepth>,
    /// F0 against depth.
    pub f0_against_depth: Option<F0AgainstDepth>,
    /// Mean Fz at matched speeds.
    pub speed_bins: Vec<SpeedBin>,
    /// What the mesh feels at rest over the depths of the trials, for the figure: depth, wetted, dry [m, N, N].
    #[serde(skip)]
    pub mesh_curve: Vec<(f64, f64, f64)>,
}

/// The fit `Fz = F0 + C_L v^2` at one depth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerticalAtDepth {
    /// Depth [m].
    pub depth_m: f64,
    /// Number of points.
    pub sections: usize,
    /// Mean vertical force [N].
    pub mean_fz_n: f64,
    /// Buoyancy intercept [N]; none where the speeds do not differ.
    pub f0_n: Option<f64>,
    /// Its standard error [N].
    pub f0_std_n: Option<f64>,
    /// Lift parameter [N s2/m2].
    pub c_l: Option<f64>,
    /// R2 of the fit.
    pub r2: Option<f64>,
    /// What the mesh displaces at rest, water under the tires [N].
    pub mesh_wetted_n: f64,
    /// What the mesh feels at rest without water under the tires [N].
    pub mesh_dry_n: f64,
    /// The paper's figures: other data.
    pub paper: Option<PaperDepth>,
}

/// The line through the intercepts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct F0AgainstDepth {
    /// Number of depths: with three, a high R2 says little.
    pub points: usize,
    /// Slope [N/m].
    pub slope: f64,
    /// Value at depth 0 [N].
    pub intercept_n: f64,
    /// R2 of the line.
    pub r2: f64,
    /// R2 of the same line through the mesh's hydrostatics, water under the tires.
    pub mesh_wetted_r2: Option<f64>,
    /// The same without water under the tires.
    pub mesh_dry_r2: Option<f64>,
    /// The paper's R2: other data.
    pub paper_r2: Option<f64>,
}

/// Sections of about the same speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpeedBin {
    /// Least speed [m/s].
    pub from_mps: f64,
    /// Speed that is no longer in it [m/s].
    pub to_mps: f64,
    /// Mean Fz by rising depth, of the depths that have sections here [m, N].
    pub fz_n: Vec<(f64, f64)>,
}

impl SpeedBin {
    fn rises(&self) -> bool {
        self.fz_n.windows(2).all(|pair| pair[1].1 > pair[0].1)
    }
}

/// Fits each depth that has at least so many sections, and sets the intercepts against depth and against the mesh.
pub fn vertical_force(
    groups: &[DepthGroup<'_>],
    vehicle: &Vehicle,
    bin_mps: f64,
    least: usize,
) -> VerticalForce {
    let depths: Vec<VerticalAtDepth> = groups.iter().map(|group| at_depth(group, vehicle, least)).collect();
    VerticalForce {
        f0_against_depth: f0_against_depth(&depths, vehicle),
        speed_bins: speed_bins(groups, bin_mps),
        mesh_curve: mesh_curve(groups, vehicle),
        depths,
    }
}

fn mesh_curve(groups: &[DepthGroup<'_>], vehicle: &Vehicle) -> Vec<(f64, f64, f64)> {
    let Some(deepest) = groups.last() else { return Vec::new() };
    let point = |step: u32| {
        let depth = deepest.depth_m * f64::from(step) / f64::from(CURVE_STEPS);
        let (wetted, dry) = at_rest(vehicle, depth, deepest.density_kgpm3);
        (depth, wetted, dry)
    };
    (0..=CURVE_STEPS).map(point).collect()
}

fn at_depth(group: &DepthGroup<'_>, vehicle: &Vehicle, least: usize) -> VerticalAtDepth {
    let fz = group.values(|section| section.fz_n);
    let fit: Option<LineFit> = line(&group.values(|section| section.speed_squared_m2ps2), &fz)
        .filter(|_| group.sections.len() >= least);
    let (mesh_wetted_n, mesh_dry_n) = at_rest(vehicle, group.depth_m, group.density_kgpm3);
    VerticalAtDepth {
        depth_m: group.depth_m,
        sections: group.sections.len(),
        mean_fz_n: group.mean(|section| section.fz_n),
        f0_n: fit.map(|fit| fit.intercept),
        f0_std_n: fit.map(|fit| fit.intercept_std),
        c_l: fit.map(|fit| fit.slope),
        r2: fit.map(|fit| fit.r2),
        mesh_wetted_n,
        mesh_dry_n,
        paper: published::at(&vehicle.name, group.depth_m),
    }
}

/// Vertical force of the level vehicle at rest [N]: with water under the tires, and without.
pub fn at_rest(vehicle: &Vehicle, depth: f64, density: f64) -> (f64, f64) {
    let (plane, about) = (WaterPlane::level(vehicle.z0, depth), Vec3::zeros());
    let wetted = hydrostatics(&vehicle.hull.mesh, &plane, density, &about).wrench.force.z;
    let lost = vehicle.contacts.iter().map(|patch| patch.lost_pressure(&plane, density, &about).force.z);
    (wetted, wetted + lost.sum::<f64>())
}

fn f0_against_depth(depths: &[VerticalAtDepth], vehicle: &Vehicle) -> Option<F0AgainstDepth> {
    let fitted: Vec<(&VerticalAtDepth, f64)> = depths.iter().filter_map(|at| Some((at, at.f0_n?))).collect();
    let depth: Vec<f64> = fitted.iter().map(|(at, _)| at.depth_m).collect();
    let against = |values: Vec<f64>| line(&depth, &values).filter(|_| depth.len() >= 3);
    let fit = against(fitted.iter().map(|(_, f0)| *f0).collect())?;
    let r2 = |of: fn(&VerticalAtDepth) -> f64| {
        against(fitted.iter().map(|(at, _)| of(at)).collect()).map(|fit| fit.r2)
    };
    Some(F0AgainstDepth {
        points: depth.len(),
        slope: fit.slope,
        intercept_n: fit.intercept,
        r2: fit.r2,
        mesh_wetted_r2: r2(|at| at.mesh_wetted_n),
        mesh_dry_r2: r2(|at| at.mesh_dry_n),
        paper_r2: (vehicle.name == published::VEHICLE).then_some(published::F0_R2),
    })
}

/// Bins with sections of two depths or more.
fn speed_bins(groups: &[DepthGroup<'_>], width: f64) -> Vec<SpeedBin> {
    let bin_of = |section: &Section| (section.speed() / width).floor() as u32;
    let mut bins: Vec<u32> = groups.iter().flat_map(|g| g.sections.iter().map(|s| bin_of(s))).collect();
    bins.sort_unstable();
    bins.dedup();
    let fz = |group: &DepthGroup<'_>, bin: u32| {
        let here = group.sections.iter().filter(|section| bin_of(section) == bin);
        let here: Vec<f64> = here.map(|section| section.fz_n).collect();
        (!here.is_empty()).then(|| (group.depth_m, here.iter().sum::<f64>() / here.len() as f64))
    };
    let bin = |bin: u32| SpeedBin {
        from_mps: f64::from(bin) * width,
        to_mps: f64::from(bin + 1) * width,
        fz_n: groups.iter().filter_map(|group| fz(group, bin)).collect(),
    };
    bins.into_iter().map(bin).filter(|bin| bin.fz_n.len() >= 2).collect()
}

impl VerticalForce {
    /// What must hold.
    pub(super) fn checks(&self, thresholds: &Thresholds) -> Vec<Check> {
        let several = self.depths.len() >= 2;
        let rises = self.depths.windows(2).all(|pair| pair[1].mean_fz_n > pair[0].mean_fz_n);
        let means: Vec<String> = self.depths.iter().map(|at| format!("{:.0}", at.mean_fz_n)).collect();
        let bent = self.speed_bins.iter().find(|bin| !bin.rises());
        let least = thresholds.f0_r2;
        let f0 = self.f0_against_depth.as_ref();
        vec![
            Check::new(
                "mean_fz_rises_with_depth",
                several.then_some(rises),
                match several {
                    true => format!(
                        "The mean Fz {} with depth: {} N.",
                        if rises { "rises" } else { "does not rise" },
                        means.join(", ")
                    ),
                    false => "There is one depth only, so Fz has nothing to rise with.".to_owned(),
                },
            ),
            Check::new(
                "f0_linear_in_depth",
                f0.map(|f0| f0.r2 >= least),
                match f0 {
                    Some(f0) => format!(
                        "F0 against depth is a line through {} points with R2 {:.4}; {least} is required.",
                        f0.points, f0.r2
                    ),
                    None => format!(
                        "F0 is known at fewer than three depths, each of {} sections or more: no line can be judged.",
                        thresholds.sections
                    ),
                },
            ),
            Check::new(
                "fz_rises_at_matched_speed",
                (!self.speed_bins.is_empty()).then_some(bent.is_none()),
                match (bent, self.speed_bins.len()) {
                    (Some(bin), _) => {
                        format!(
                            "Between {} and {} m/s Fz does not rise with depth.",
                            bin.from_mps, bin.to_mps
                        )
                    }
                    (None, 0) => "No bin of speed has sections of two depths.".to_owned(),
                    (None, bins) => format!("Fz rises with depth in each of {bins} bins of speed."),
                },
            ),
        ]
    }
}
