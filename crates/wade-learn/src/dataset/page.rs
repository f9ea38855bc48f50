//! A data set's summary as one HTML page that needs no other file.

use std::fmt::Write;

use super::summary::{CaseMean, Summary, VehicleSummary};
use crate::page::plot::{Series, scatter};
use crate::page::{PlotError, document, escape};

/// The page.
pub fn page(title: &str, summary: &Summary) -> Result<String, PlotError> {
    page_with(title, "", summary)
}

/// The page with `foreword`, which is HTML, under its title.
pub fn page_with(title: &str, foreword: &str, summary: &Summary) -> Result<String, PlotError> {
    let mut text = format!(
        "{foreword}<p>{} cases, {} samples. Loads: {}. Ground contact: {}.</p>\n",
        summary.cases,
        summary.samples,
        escape(&summary.provenance),
        super::schema::contact_name(summary.ground_contact),
    );
    for (key, value) in &summary.notes {
        line(&mut text, format_args!("<p class=\"small\">{}: {}</p>", escape(key), escape(value)));
    }
    for vehicle in &summary.vehicles {
        text.push_str(&section(vehicle)?);
    }
    Ok(document(title, &text))
}

/// Writing to a String cannot fail.
fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    let _ = writeln!(text, "{arguments}");
}

fn section(vehicle: &VehicleSummary) -> Result<String, PlotError> {
    let mut text = format!("<h2>{}</h2>\n", escape(&vehicle.name));
    text.push_str(&counts(vehicle));
    text.push_str(&ranges(vehicle));
    text.push_str(&coverage(vehicle));
    text.push_str(&by_set(vehicle, "speed [m/s]", "depth [m]", |case| Some((speed(case), case.depth)))?);
    text.push_str(&by_set(vehicle, "heading, left positive [deg]", "speed [m/s]", |case| {
        Some((case.heading_deg()?, speed(case)))
    })?);
    text.push_str("<h3>Net force, mean of each case</h3>\n");
    text.push_str(&drag(vehicle)?);
    text.push_str(&by_set(vehicle, "depth [m]", "Fz [N]", |case| Some((case.depth, case.net_force.z)))?);
    text.push_str(&scatter_between_sections(vehicle)?);
    text.push_str(&shares(vehicle));
    Ok(text)
}

fn counts(vehicle: &VehicleSummary) -> String {
    let mut text = "<table><tr><th>set</th><th>cases</th><th>samples</th></tr>".to_owned();
    for (set, count) in &vehicle.sets {
        let (set, cases, samples) = (escape(set), count.cases, count.samples);
        line(&mut text, format_args!("<tr><td>{set}</td><td>{cases}</td><td>{samples}</td></tr>"));
    }
    let images: Vec<_> = vehicle.images.iter().map(|(image, count)| format!("{image} {count}")).collect();
    let parts = vehicle.parts;
    line(
        &mut text,
        format_args!(
            "</table><p class=\"small\">Images: {}. Loads with a moment {:.0} %, with a viscous part {:.0} %, with the load \
             at rest {:.0} %. Surfaces: {}.</p>",
            images.join(", "),
            100.0 * parts.moment,
            100.0 * parts.viscous,
            100.0 * parts.rest,
            escape(&vehicle.surfaces.join(", ")),
        ),
    );
    text
}

fn ranges(vehicle: &VehicleSummary) -> String {
    let mut text = "<h3>Ranges</h3><table><tr><th></th><th>least</th><th>most</th></tr>".to_owned();
    for (name, range) in &vehicle.ranges {
        let (min, max) = (range.min, range.max);
        line(&mut text, format_args!("<tr><td>{name}</td><td>{min:.4}</td><td>{max:.4}</td></tr>"));
    }
    text + "</table>\n"
}

fn coverage(vehicle: &VehicleSummary) -> String {
    let table = &vehicle.coverage;
    let span = |edges: &[f64], index: usize| format!("{:.3} to {:.3}", edges[index], edges[index + 1]);
    let mut text = "<h3>Cases by depth [m] and speed [m/s]</h3><table><tr><th></th>".to_owned();
    for column in 0..table.cases[0].len() {
        line(&mut text, format_args!("<th>{}</th>", span(&table.speed_edges_mps, column)));
    }
    for (row, counts) in table.cases.iter().enumerate() {
        line(&mut text, format_args!("</tr><tr><td>{}</td>", span(&table.depth_edges_m, row)));
        for count in counts {
            let class = if *count == 0 { " class=\"none\"" } else { "" };
            line(&mut text, format_args!("<td{class}>{count}</td>"));
        }
    }
    text + "</tr></table>\n"
}

fn speed(case: &CaseMean) -> f64 {
    case.velocity.x.hypot(case.velocity.y)
}

fn by_set(
    vehicle: &VehicleSummary,
    x_title: &str,
    y_title: &str,
    point: impl Fn(&CaseMean) -> Option<(f64, f64)>,
) -> Result<String, PlotError> {
    let group = |set: &String| {
        let cases = vehicle.case_means.iter().filter(|case| case.set == *set);
        Series { name: set.clone(), points: cases.filter_map(&point).collect() }
    };
    scatter(x_title, y_title, &vehicle.sets.keys().map(group).collect::<Vec<_>>())
}

/// Force against the motion over speed, in three parts of the depths.
fn drag(vehicle: &VehicleSummary) -> Result<String, PlotError> {
    let edges = &vehicle.coverage.depth_edges_m;
    let (least, most) = (edges[0], edges[edges.len() - 1]);
    let edge = |third: usize| least + (most - least) * third as f64 / 3.0;
    let third = |case: &CaseMean| (1..3).filter(|third| case.depth >= edge(*third)).count();
    let group = |number: usize| {
        let cases = vehicle.case_means.iter().filter(|case| third(case) == number);
        let moving = cases.filter(|case| case.heading_deg().is_some());
        let point = |case: &CaseMean| (speed(case), -case.net_force.dot(&case.velocity) / speed(case));
        let name = format!("depth {:.3} to {:.3} m", edge(number), edge(number + 1));
        Series { name, points: moving.map(point).collect() }
    };
    scatter("speed [m/s]", "force against the motion [N]", &[0, 1, 2].map(group))
}

fn scatter_between_sections(vehicle: &VehicleSummary) -> Result<String, PlotError> {
    let Some(scatters) = &vehicle.scatter else { return Ok(String::new()) };
    let mut text = "<h3>Scatter of the net force</h3>\n<p>Standard deviation between the sections of a case: a model that \
                    knows the state alone cannot do better. Beside it that between the cases.</p>\n\
                    <table><tr><th></th><th>between sections [N]</th><th>between cases [N]</th></tr>"
        .to_owned();
    for (axis, s) in ["Fx", "Fy", "Fz"].iter().zip(scatters) {
        let (sections, cases) = (s.between_sections_n, s.between_cases_n);
        line(&mut text, format_args!("<tr><td>{axis}</td><td>{sections:.3}</td><td>{cases:.3}</td></tr>"));
    }
    let group = |(axis, name): (usize, &str)| {
        let point = |case: &CaseMean| Some((speed(case), case.deviation?[axis]));
        Series { name: name.to_owned(), points: vehicle.case_means.iter().filter_map(point).collect() }
    };
    let groups: Vec<_> = ["Fx", "Fy", "Fz"].into_iter().enumerate().map(group).collect();
    Ok(text + "</table>\n" + &scatter("speed [m/s]", "deviation between sections [N]", &groups)?)
}

fn shares(vehicle: &VehicleSummary) -> String {
    let mut text =
        "<h3>Who carries it</h3><table><tr><th></th><th>of the force</th><th>of the drag</th></tr>"
            .to_owned();
    for (group, share) in &vehicle.shares {
        let (force, drag) = (100.0 * share.of_force, 100.0 * share.of_drag);
        let group = escape(group);
        line(&mut text, format_args!("<tr><td>{group}</td><td>{force:.1} %</td><td>{drag:.1} %</td></tr>"));
    }
    text + "</table>\n<p class=\"small\">Force: magnitudes summed over surfaces. Drag: against the motion, without the load \
            at rest where the data set has it.</p>\n"
}
