//! What the source paper reports on its own CFD, which is not public: other data, to be set beside ours.

use serde::Serialize;

/// How these figures are labelled wherever they stand beside ours.
pub const LABEL: &str = "published, different data";

/// Figures of one vehicle; section "Results".
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Paper {
    /// Held-out samples.
    pub samples: usize,
    /// Mean absolute error of the net force [N].
    pub mae: [f64; 3],
    /// Root mean square error [N].
    pub rmse: [f64; 3],
    /// Symmetric mean absolute percentage error with a floor of 1 N [%].
    pub smape: [f64; 3],
    /// Mean absolute error of the force on a surface [N].
    pub surface_mae: [f64; 3],
    /// Share of the sum of the magnitudes of all forces that wheels carry.
    pub wheel_share: f64,
    /// Mean absolute error of the force on a surface by kind of surface, where stated [N].
    pub kinds: &'static [(&'static str, [Option<f64>; 3])],
    /// Mean absolute error of the net force in slices, where stated [N].
    pub slices: &'static [(&'static str, [Option<f64>; 3])],
    /// Mean absolute error of the net force of ablations, where stated [N].
    pub ablations: &'static [(&'static str, [Option<f64>; 3])],
    /// Mean absolute error of the force on a surface of ablations, where stated [N].
    pub ablation_surfaces: &'static [(&'static str, [Option<f64>; 3])],
}

/// The Husky.
pub const HUSKY: Paper = Paper {
    samples: 1836,
    mae: [1.25, 3.42, 4.38],
    rmse: [2.10, 5.64, 7.75],
    smape: [12.96, 56.19, 2.99],
    surface_mae: [0.17, 0.40, 0.63],
    wheel_share: 0.791,
    kinds: &[("wheel", [Some(1.02), None, Some(1.60)]), ("bottom", [None, None, Some(2.99)])],
    slices: &[("depth high", [None, None, Some(8.67)]), ("speed low", [None, None, Some(10.27)])],
    ablations: &[("no_dimensions", [Some(2.06), None, None]), ("global_only", [Some(0.90), None, None])],
    ablation_surfaces: &[("merged_plates", [None, Some(0.54), None])],
};

/// The Warthog.
pub const WARTHOG: Paper = Paper {
    samples: 433,
    mae: [52.87, 53.28, 67.61],
    rmse: [112.86, 76.70, 117.31],
    smape: [12.98, 54.84, 11.77],
    surface_mae: [8.04, 9.82, 13.02],
    wheel_share: 0.822,
    kinds: &[("bottom", [None, None, Some(58.89)]), ("wheel", [None, None, Some(17.88)])],
    slices: &[("speed high", [Some(66.31), None, Some(66.91)])],
    ablations: &[("no_dimensions", [Some(69.22), None, None])],
    ablation_surfaces: &[],
};

/// The figures of a vehicle, where the paper has any.
pub fn of(vehicle: &str) -> Option<&'static Paper> {
    match vehicle {
        "husky" => Some(&HUSKY),
        "warthog" => Some(&WARTHOG),
        _ => None,
    }
}

/// The entry of that name in one of the lists.
pub fn entry(list: &[(&str, [Option<f64>; 3])], name: &str) -> [Option<f64>; 3] {
    list.iter().find(|(of, _)| *of == name).map_or([None; 3], |(_, values)| *values)
}
