//! The figures of an evaluation as one HTML page that needs no other file.

use std::fmt::Write;

use super::paper::{LABEL, Paper, entry};
use super::report::{ModelReport, QUANTITIES, Report, VehicleReport};
use crate::page::plot::{Series, parity, scatter};
use crate::page::{PlotError, document, escape, preformatted, table};
use crate::train::page::losses;

const AXES: [&str; 3] = ["F<sub>x</sub>", "F<sub>y</sub>", "F<sub>z</sub>"];

/// The page.
pub(super) fn page(report: &Report) -> Result<String, PlotError> {
    let mut text = format!(
        "<p>Loads: {}. Held out: {}.</p>\n<p class=\"small\">Shaded: {LABEL}. The source paper's CFD is not public, so its \
         figures are of other cases and another mesh; they show the order of magnitude, not which network is better.</p>\n",
        escape(&report.about.data.label()),
        escape(&report.about.splits.join("; ")),
    );
    if report.about.by_sample {
        text.push_str(
            "<div class=\"verdict notice\">Sections and mirror images of one case are on both sides of this split: the figures \
             test interpolation within known runs only.</div>\n",
        );
    }
    for vehicle in &report.vehicles {
        text.push_str(&section(vehicle)?);
    }
    text.push_str(&trainings(report)?);
    let _ = writeln!(text, "<p class=\"small\">{}</p>", escape(&report.program));
    Ok(document(&format!("wade eval: {}", report.about.data.name), &text))
}

fn section(vehicle: &VehicleReport) -> Result<String, PlotError> {
    let paper = vehicle.paper;
    Ok(format!(
        "<h2>{}</h2>\n<p>{} held-out cases, {} states with their mirror images. Mean magnitude of the net force: {} N.</p>\n\
         <h3>Net force</h3>\n{}{}\n<h3>Parity</h3>\n{}\n\
         <h3>Error of the mean flow over the state</h3>\n{}\n<h3>Force on a surface</h3>\n{}{}\n\
         <h3>Ends of the ranges</h3>\n{}\n<h3>Stated uncertainty</h3>\n{}",
        escape(&vehicle.name),
        vehicle.cases,
        vehicle.samples,
        vehicle.mean_force_n.map(|x| format!("{x:.1}")).join(", "),
        net_table(vehicle, paper),
        moment_table(vehicle),
        parity_figures(vehicle)?,
        error_figures(vehicle)?,
        kind_table(vehicle, paper),
        surface_table(vehicle),
        slice_table(vehicle, paper),
        calibration(vehicle)?,
    ))
}

fn number(value: f64) -> String {
    if value.abs() < 100.0 { format!("{value:.2}") } else { format!("{value:.1}") }
}

fn stated(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), number)
}

fn heads(first: &str, groups: &[&str]) -> Vec<String> {
    let of = |group: &&str| AXES.map(|axis| format!("{axis} {group}"));
    std::iter::once(first.to_owned()).chain(groups.iter().flat_map(of)).collect()
}

/// The same of the paper, which is other data.
fn of_paper(quantity: &str) -> [String; 3] {
    AXES.map(|axis| format!("{axis} {quantity} ({LABEL})"))
}

fn net_table(vehicle: &VehicleReport, paper: Option<&Paper>) -> String {
    let quantities = ["MAE [N]", "RMSE [N]", "sMAPE [%]"];
    let heads_of_ours = heads("model", &[&quantities[..], &["MAE on a surface [N]"]].concat());
    let row = |model: &ModelReport| {
        let force = &model.force;
        let ours = [force.mae, force.rmse, force.smape].concat().into_iter().map(number);
        let surfaces = model.surface_mae_n.map_or([None; 3], |mae| mae.map(Some)).map(stated);
        std::iter::once(escape(&model.name)).chain(ours).chain(surfaces).collect()
    };
    let rows: Vec<Vec<String>> = vehicle.models.iter().map(row).collect();
    // a table of its own: both in one are wider than a window
    let published = |model: &ModelReport| {
        let paper = paper?;
        let is_paper = model.name == vehicle.models[0].name;
        let values: Vec<Option<f64>> = match is_paper {
            true => [paper.mae, paper.rmse, paper.smape].concat().into_iter().map(Some).collect(),
            false => [entry(paper.ablations, &model.name), [None; 3], [None; 3]].concat(),
        };
        let is_stated = values.iter().any(Option::is_some);
        is_stated
            .then(|| std::iter::once(escape(&model.name)).chain(values.into_iter().map(stated)).collect())
    };
    let published: Vec<Vec<String>> = vehicle.models.iter().filter_map(published).collect();
    let published = match published.is_empty() {
        true => String::new(),
        false => table(&heads(LABEL, &quantities), 0, published),
    };
    let note = paper.map_or_else(String::new, |paper| {
        let of = |values: [Option<f64>; 3]| values.map(stated).join(", ");
        let merged = of(entry(paper.ablation_surfaces, "merged_plates"));
        format!(
            "<p class=\"small\">{LABEL}: {} held-out samples; MAE on a surface {} N, with merged plates {merged} N \
             (x, y, z). sMAPE: 2 |p − t| / max(|p| + |t|, 1 N), of which the paper states the floor alone.</p>\n",
            paper.samples,
            of(paper.surface_mae.map(Some)),
        )
    });
    table(&heads_of_ours, usize::MAX, rows) + &published + &note
}

fn moment_table(vehicle: &VehicleReport) -> String {
    let Some(scale) = vehicle.mean_moment_nm else {
        return "<p class=\"small\">The data set has no moments.</p>\n".to_owned();
    };
    let heads =
        ["net moment, MAE [N m]", "M<sub>x</sub>", "M<sub>y</sub>", "M<sub>z</sub>"].map(str::to_owned);
    let row = |(name, values): (&str, [f64; 3])| {
        std::iter::once(escape(name)).chain(values.map(number)).collect::<Vec<_>>()
    };
    let models = vehicle.models.iter().filter_map(|model| Some((model.name.as_str(), model.moment_mae_nm?)));
    let rows: Vec<_> = models.chain([("mean magnitude", scale)]).map(row).collect();
    table(&heads, usize::MAX, rows)
        + "<p class=\"small\">About the center of mass. The paper has no moments.</p>\n"
}

fn parity_figures(vehicle: &VehicleReport) -> Result<String, PlotError> {
    let mut text = String::new();
    for (c, axis) in ["Fx", "Fy", "Fz"].into_iter().enumerate() {
        let points = vehicle.parity.iter().map(|(truth, prediction)| (truth[c], prediction[c])).collect();
        let series = Series { name: format!("{axis}, {}", vehicle.name), points };
        text.push_str(&parity(
            &format!("{axis} of the data set [N]"),
            &format!("{axis} of the model [N]"),
            &[series],
        )?);
    }
    Ok(text)
}

/// Points of each component of the force.
fn by_component(of: impl Fn(usize) -> Vec<(f64, f64)>) -> Vec<Series> {
    let component = |(c, axis): (usize, &str)| Series { name: axis.to_owned(), points: of(c) };
    ["Fx", "Fy", "Fz"].into_iter().enumerate().map(component).collect()
}

fn error_figures(vehicle: &VehicleReport) -> Result<String, PlotError> {
    let mut text = String::new();
    for (index, (name, unit, _)) in QUANTITIES.into_iter().enumerate() {
        let series = by_component(|c| {
            vehicle.flows.iter().map(|flow| (flow.place[index], flow.error[c].abs())).collect()
        });
        text.push_str(&scatter(&format!("{name} [{unit}]"), "magnitude of the error [N]", &series)?);
    }
    Ok(text)
}

/// How the model under evaluation was trained, and the settings of all that were.
fn trainings(report: &Report) -> Result<String, PlotError> {
    let mut text = String::from("<h2>Training</h2>\n");
    if !report.about.history.is_empty() {
        text.push_str(&losses(&report.about.history)?);
    }
    for (name, settings) in &report.about.settings {
        let settings = toml::to_string(settings).unwrap_or_default();
        let _ = writeln!(text, "<h3>{}</h3>\n{}", escape(name), preformatted(&settings));
    }
    Ok(text)
}

fn kind_table(vehicle: &VehicleReport, paper: Option<&Paper>) -> String {
    let mut heads = heads("kind", &["MAE [N]"]);
    heads.push("share of the force".to_owned());
    heads.extend(of_paper("MAE [N]"));
    heads.push(format!("share of the force ({LABEL})"));
    let row = |kind: &super::report::GroupReport| {
        let papers = paper.map_or([None; 3], |paper| entry(paper.kinds, &kind.name));
        let share = paper.filter(|_| kind.name == "wheel").map(|paper| paper.wheel_share);
        std::iter::once(escape(&kind.name))
            .chain(kind.mae_n.map(number))
            .chain([percent(kind.share)])
            .chain(papers.map(stated))
            .chain([share.map_or_else(|| "–".to_owned(), percent)])
            .collect()
    };
    table(&heads, 5, vehicle.kinds.iter().map(row))
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn surface_table(vehicle: &VehicleReport) -> String {
    let mut heads = heads("surface", &["MAE [N]"]);
    heads.push("share of the force".to_owned());
    let row = |surface: &super::report::GroupReport| {
        let cells = std::iter::once(escape(&surface.name)).chain(surface.mae_n.map(number));
        cells.chain([percent(surface.share)]).collect()
    };
    table(&heads, usize::MAX, vehicle.surfaces.iter().map(row))
}

fn slice_table(vehicle: &VehicleReport, paper: Option<&Paper>) -> String {
    let mut heads = vec!["slice".to_owned(), "5th or 95th percentile".to_owned(), "states".to_owned()];
    heads.extend(AXES.map(|axis| format!("{axis} MAE [N]")));
    heads.extend(of_paper("MAE [N]"));
    let row = |slice: &super::report::SliceReport| {
        let papers = paper.map_or([None; 3], |paper| entry(paper.slices, &slice.name));
        [escape(&slice.name), format!("{:.3}", slice.bound), slice.samples.to_string()]
            .into_iter()
            .chain(slice.mae_n.map(number))
            .chain(papers.map(stated))
            .collect()
    };
    let rows: Vec<_> = vehicle.slices.iter().map(row).collect();
    table(&heads, 6, rows)
        + "<p class=\"small\">Depth [m], speed [m/s], obliqueness |v<sub>y</sub>| / |v|; net force.</p>\n"
}

fn calibration(vehicle: &VehicleReport) -> Result<String, PlotError> {
    let Some(calibration) = &vehicle.calibration else {
        return Ok("<p class=\"small\">No uncertainty is stated.</p>\n".to_owned());
    };
    let heads = heads("net force", &[""]);
    let row =
        |name: &str, values: [String; 3]| std::iter::once(name.to_owned()).chain(values).collect::<Vec<_>>();
    let rows = [
        row(
            "errors of the mean within one predicted standard deviation (68.3 % where normal)",
            calibration.within_one.map(percent),
        ),
        row("within two (95.4 %)", calibration.within_two.map(percent)),
        row("RMS of error over predicted standard deviation (1)", calibration.error_over_stated.map(number)),
        row("RMS deviation of sections from their mean [N]", calibration.swing.map(number)),
    ];
    let note = format!(
        "<p class=\"small\">The predicted standard deviation is that of the mean flow, without its oscillation: errors are means over the \
         sections of a case, of {} cases.</p>\n",
        calibration.cases,
    );
    Ok(table(&heads, usize::MAX, rows) + &note + &reliability(vehicle)?)
}

/// Share of the mean flows whose error is within so many stated deviations.
fn reliability(vehicle: &VehicleReport) -> Result<String, PlotError> {
    /// Of a normal error.
    const NORMAL: [(f64, f64); 6] =
        [(0.5, 0.383), (1.0, 0.683), (1.5, 0.866), (2.0, 0.954), (2.5, 0.988), (3.0, 0.997)];
    let ratios = |c: usize| {
        let stated = vehicle.flows.iter().filter_map(|flow| Some((flow, flow.stated?)));
        let known = stated.filter(|(_, stated)| stated.min() > 0.0);
        known.map(|(flow, stated)| flow.error[c].abs() / stated[c]).collect::<Vec<f64>>()
    };
    let mut series = by_component(|c| {
        let ratios = ratios(c);
        let within = |bound: f64| ratios.iter().filter(|ratio| **ratio <= bound).count() as f64;
        let at = |step: u32| 0.1 * f64::from(step);
        (0..=30).map(|step| (at(step), within(at(step)) / ratios.len().max(1) as f64)).collect()
    });
    series.push(Series { name: "normal".to_owned(), points: NORMAL.to_vec() });
    scatter("predicted standard deviations", "share of the errors within", &series)
}
