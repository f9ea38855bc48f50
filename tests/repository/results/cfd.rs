//! What the computed cases say of the CFD itself, from campaigns/*/cases.csv.

use std::collections::{BTreeMap, HashMap};

use super::accuracy::VEHICLES;
use super::{csv, digits, markdown, root};

/// Gravity [m/s2], for depth Froude numbers.
const GRAVITY: f64 = 9.81;

type Case = HashMap<String, String>;

fn all() -> Vec<(&'static str, Vec<Case>)> {
    VEHICLES.map(|name| (name, csv(root().join(format!("campaigns/{name}/cases.csv"))).1)).to_vec()
}

fn value(case: &Case, column: &str) -> f64 {
    case[column].parse().unwrap_or_else(|_| panic!("{column} of {} is no number", case["id"]))
}

/// Cases of each set, and how many settled.
pub fn cases() -> String {
    let mut counts: BTreeMap<(String, String), [usize; 4]> = BTreeMap::new();
    for (index, (_, cases)) in all().into_iter().enumerate() {
        for case in cases {
            let count = counts.entry((case["set"].clone(), case["bed"].clone())).or_default();
            count[2 * index] += 1;
            count[2 * index + 1] += usize::from(case["settled"] == "true");
        }
    }
    let rows = counts.into_iter().map(|((set, bed), count)| {
        [vec![format!("`{set}`"), bed], count.map(|count| count.to_string()).to_vec()].concat()
    });
    markdown(&["set", "bed", "Husky", "settled", "Warthog", "settled"], rows.collect())
}

/// At rest: the vertical force of the flow against Archimedes on the same mesh.
pub fn rest() -> String {
    let mut rows = Vec::new();
    for (name, cases) in all() {
        for case in cases.iter().filter(|case| case["set"] == "check" && value(case, "speed_mps") == 0.0) {
            let (flow, archimedes) = (value(case, "fz_n"), value(case, "rest_fz_n"));
            let difference = format!("{:+.1}", 100.0 * (flow / archimedes - 1.0));
            rows.push(vec![
                name.to_owned(),
                digits(value(case, "depth_m")),
                digits(flow),
                digits(archimedes),
                difference,
            ]);
        }
    }
    let header = ["vehicle", "depth [m]", "Fz of the flow [N]", "Archimedes [N]", "difference [%]"];
    markdown(&header, rows)
}

/// One state on several meshes and in a larger channel.
pub fn meshes() -> String {
    let mut rows = Vec::new();
    for (name, cases) in all() {
        let finer = cases.iter().find(|case| value(case, "cell_scale") < 1.0).expect("a finer mesh");
        let key = |case: &Case| {
            ["speed_mps", "heading_deg", "depth_m", "density_kgpm3", "bed"].map(|c| case[c].clone())
        };
        for case in cases.iter().filter(|case| key(case) == key(finer)) {
            rows.push(vec![
                name.to_owned(),
                case["cell_scale"].clone(),
                case["channel_scale"].clone(),
                case["cells"].clone(),
                digits(-value(case, "fx_n")),
                digits(value(case, "rest_fz_n")),
            ]);
        }
    }
    let header = ["vehicle", "cell length / card", "channel / card", "cells", "drag [N]", "load at rest [N]"];
    markdown(&header, rows)
}

/// Bands of the depth Froude number for the comparison of beds.
const BANDS: [(f64, f64); 4] = [(0.0, 0.8), (0.8, 1.0), (1.0, 1.35), (1.35, f64::INFINITY)];

/// Drag over a moving bed with turning wheels, over that of the parked twin, where both settled.
pub fn driving() -> String {
    let mut rows = Vec::new();
    for (name, cases) in all() {
        let key = |case: &Case| {
            let columns =
                ["speed_mps", "heading_deg", "depth_m", "density_kgpm3", "cell_scale", "channel_scale"];
            columns.map(|column| case[column].clone())
        };
        let steady = |case: &&Case| case["settled"] == "true" && case["set"] != "unsteady";
        let parked: HashMap<_, _> = cases
            .iter()
            .filter(steady)
            .filter(|case| case["bed"] == "parked")
            .map(|case| (key(case), case))
            .collect();
        let driving = cases.iter().filter(steady).filter(|case| case["bed"] == "driving");
        let pairs: Vec<(f64, f64)> = driving
            .filter_map(|case| Some((case, *parked.get(&key(case))?)))
            .map(|(case, twin)| {
                let froude = value(case, "speed_mps") / (GRAVITY * value(case, "depth_m")).sqrt();
                (froude, value(case, "fx_n") / value(twin, "fx_n"))
            })
            .collect();
        for (low, high) in BANDS {
            let mut ratios: Vec<f64> = pairs
                .iter()
                .filter(|(froude, _)| (low..high).contains(froude))
                .map(|(_, ratio)| *ratio)
                .collect();
            if ratios.is_empty() {
                continue;
            }
            ratios.sort_by(f64::total_cmp);
            let band = if high.is_finite() { format!("{low} to {high}") } else { format!("above {low}") };
            rows.push(vec![
                name.to_owned(),
                band,
                ratios.len().to_string(),
                ratios.iter().filter(|ratio| **ratio < 1.0).count().to_string(),
                digits(ratios[0]),
                digits(ratios[ratios.len() / 2]),
                digits(ratios[ratios.len() - 1]),
            ]);
        }
    }
    let header = ["vehicle", "Fr_h", "pairs", "smaller drag", "least ratio", "median", "largest"];
    markdown(&header, rows)
}
