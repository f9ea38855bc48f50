//! What a page of a campaign says before the plots of its data: the answer first, then the checks, then the cases to look at.

use super::report::Report;
use crate::page::{escape, table};

/// The foreword as HTML.
pub fn foreword(report: &Report) -> String {
    let (planned, done) = report.sets.values().fold((0, 0), |(p, d), c| (p + c.planned, d + c.done));
    let mut text = format!(
        "<div class=\"verdict\"><b>{done} of {planned} cases are computed, {:.0} % of them settled.</b> \
         {} remarks on single cases stand below the checks.</div>\n",
        100.0 * report.settled,
        report.suspicious.len()
    );
    let sets = report.sets.iter().map(|(set, count)| {
        [set.clone()]
            .into_iter()
            .chain([count.planned, count.done, count.settled].map(|n| n.to_string()))
            .collect()
    });
    text += &section("Sets", &["set", "planned", "computed", "settled"], sets);
    let [least, most] = report.cells;
    text += &format!(
        "<p>{least} to {most} cells a case; {:.0} s of a core a case (median), {:.1} h in all.</p>\n",
        report.core_s_median, report.core_hours
    );
    if report.outdated > 0 {
        text += &format!(
            "<p>{} cases are of an older method; <code>wade campaign run --outdated</code> computes them again.</p>\n",
            report.outdated
        );
    }
    text += &checks(report);
    if !report.suspicious.is_empty() {
        let rows = report.suspicious.iter().map(|case| vec![escape(&case.id), escape(&case.why)]);
        text += &format!(
            "<h2>Remarks on single cases</h2>\n<details><summary>{} remarks</summary>{}</details>\n",
            report.suspicious.len(),
            table(&["case", "remark"], usize::MAX, rows)
        );
    }
    text
}

/// At rest, head-on, on other meshes, and over a moving bed.
fn checks(report: &Report) -> String {
    let at_rest = report.at_rest.iter().map(|rest| {
        let error = 100.0 * (rest.computed_n / rest.mesh_n - 1.0);
        let numbers = [rest.computed_n, rest.mesh_n].map(|force| format!("{force:.1}"));
        let hull = [rest.hull_dry_n, rest.hull_wetted_n].map(|force| format!("{force:.1}"));
        let error = if error.abs() < 0.05 { "0.0".to_owned() } else { format!("{error:+.1}") };
        [format!("{:.3}", rest.depth_m)].into_iter().chain(numbers).chain([error]).chain(hull).collect()
    });
    let heads = [
        "depth [m]",
        "Fz computed [N]",
        "Archimedes, mesh [N]",
        "difference [%]",
        "hull, dry tires [N]",
        "hull, wet tires [N]",
    ];
    let mut text = section("At rest", &heads, at_rest);
    let head_on = report.head_on.iter().map(|case| {
        let paper = case.paper_c.map_or_else(|| "-".into(), |c| format!("{c:.1}"));
        vec![
            format!("{:.3}", case.depth_m),
            format!("{:.2}", case.speed_mps),
            format!("{:.1}", case.c),
            paper,
        ]
    });
    let heads = ["depth [m]", "speed [m/s]", "C = -Fx / v² [N s²/m²]", "published, different data [N s²/m²]"];
    text += &section("Straight ahead", &heads, head_on);
    let meshes = report.meshes.iter().map(|mesh| {
        vec![
            format!("{:.2}", mesh.cell_scale),
            format!("{:.2}", mesh.channel_scale),
            mesh.cells.to_string(),
            format!("{:.2}", mesh.fx_n),
            format!("{:.1}", mesh.fz_n),
            format!("{:.1}", mesh.rest_fz_n),
        ]
    });
    let heads = ["cell size [-]", "channel size [-]", "cells", "Fx [N]", "Fz [N]", "Fz at rest [N]"];
    text += &section("One case on other meshes and in a larger channel", &heads, meshes);
    if let Some(twins) = &report.twins {
        text += &format!(
            "<p>Moving bed against parked, {} settled pairs: drag times {:.3}, lift {:+.3} of the dynamic pressure on \
             the wet front.</p>\n",
            twins.pairs, twins.drag_ratio, twins.lift_difference
        );
    }
    text
}

/// A heading and a table; nothing where there is no row.
fn section(title: &str, heads: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows: Vec<Vec<String>> = rows.collect();
    match rows.is_empty() {
        true => String::new(),
        false => format!("<h2>{title}</h2>\n{}", table(heads, usize::MAX, rows)),
    }
}
