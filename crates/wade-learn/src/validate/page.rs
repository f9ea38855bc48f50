//! The report as one HTML page that needs no other file.

use std::fmt::Write;

use plotters::style::RGBColor;

use super::drag::R2_DEFINITION;
use super::plot::{Mark, Series, color, figure};
use super::report::{Report, Source};
use super::section::Section;
use crate::page::{PlotError, document, escape, table};
use crate::published::{self, LABEL, PaperDepth};

const BLACK: RGBColor = RGBColor(0, 0, 0);
const BROWN: RGBColor = RGBColor(0xb0, 0x70, 0x00);

/// The page.
pub(super) fn page(report: &Report) -> Result<String, PlotError> {
    let body = format!(
        "{}\n{}\n{}\n\
         <h2>Test 1: drag against the square of the speed</h2>\n{}\n{}\n{}\n\
         <h2>Test 2: vertical force is buoyancy plus lift</h2>\n{}\n{}\n{}\n{}\n\
         <h2>Sections and trials</h2>\n{}\n{}",
        summary(report),
        generated(report),
        verdict(report),
        drag_table(report),
        drag_figure(report)?,
        pair_table(report),
        vertical_table(report),
        vertical_figure(report)?,
        depth_figure(report)?,
        bin_table(report),
        section_tables(report),
        footer(report),
    );
    Ok(document(&format!("wade validate: {}", report.subject.vehicle), &body))
}

fn summary(report: &Report) -> String {
    let (subject, data) = (&report.subject, &report.data);
    let source = match data.source {
        Source::Trials => "a folder of trials",
        Source::Mocap => "motion-capture recordings",
        Source::Generated => "generated recordings",
    };
    let contact = format!("{:?}", report.config.ground_contact).to_lowercase();
    format!(
        "<p class=\"small\">bundle version {} · weights: {} · ground contact: {contact} · {} trials from {source}, {} \
         planar sections; {:.0} % of their samples lie in the training domain. No force was \
         measured: the test compares the model's forces along the motion of the trials with known laws.</p>",
        subject.version,
        escape(&subject.weights),
        data.trials,
        data.planar_sections,
        100.0 * data.in_domain,
    )
}

fn generated(report: &Report) -> String {
    match &report.data.generated {
        Some(how) => format!(
            "<div class=\"verdict notice\"><b>Generated motion, not measured.</b> {}</div>",
            escape(how)
        ),
        None => String::new(),
    }
}

fn verdict(report: &Report) -> String {
    let (class, word) = if report.passed { ("pass", "Passed.") } else { ("fail", "Failed.") };
    let mut text = format!("<div class=\"verdict {class}\"><b>{word}</b><ul>");
    for check in &report.checks {
        let mark = match check.holds {
            Some(true) => "holds",
            Some(false) => "does not hold",
            None => "not tested",
        };
        let _ = write!(text, "<li><b>{mark}</b> · {}</li>", escape(&check.finding));
    }
    text + "</ul></div>"
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

fn with_error(value: Option<f64>, error: Option<f64>, digits: usize) -> String {
    match (value, error) {
        (Some(value), Some(error)) => format!("{value:.digits$} ± {error:.digits$}"),
        _ => number(value, digits),
    }
}

fn of_paper(paper: &Option<PaperDepth>, of: impl Fn(&PaperDepth) -> Option<f64>, digits: usize) -> String {
    number(paper.as_ref().and_then(of), digits)
}

fn drag_table(report: &Report) -> String {
    let drag = &report.drag_scaling;
    let heads = [
        "depth [m]",
        "sections",
        "C<sub>D,eff</sub> [N s²/m²]",
        "R²",
        "R² about zero",
        "C<sub>D</sub>",
        "sections",
        "C<sub>D,eff</sub>",
        "R²",
        "C<sub>D</sub>",
    ];
    let rows = drag.depths.iter().map(|at| {
        vec![
            format!("{:.4}", at.depth_m),
            at.sections.to_string(),
            with_error(at.c_d_eff, at.c_d_eff_std, 1),
            number(at.r2, 4),
            number(at.r2_about_zero, 4),
            number(at.c_d, 3),
            at.paper.map_or_else(|| "–".into(), |paper| paper.sections.to_string()),
            of_paper(&at.paper, |paper| Some(paper.c_d_eff), 1),
            of_paper(&at.paper, |paper| Some(paper.drag_r2), 3),
            of_paper(&at.paper, |paper| Some(paper.c_d), 2),
        ]
    });
    format!(
        "<p>|F<sub>x</sub>| = C<sub>D,eff</sub> v² at each depth, one point a trial: mean drag against mean squared speed \
         of its planar section. C<sub>D</sub> = 2 C<sub>D,eff</sub> / (ρ W d) with W = {:.3} m; the paper's follow from \
         its C<sub>D,eff</sub> with W = {} m. ± is one standard error. Shaded: {LABEL}.</p>{}\
         <p class=\"small\">R² = {}; the paper does not say which it means.</p>",
        drag.width_m,
        published::WIDTH_M,
        table(&heads, 6, rows),
        escape(R2_DEFINITION),
    )
}

fn pair_table(report: &Report) -> String {
    let drag = &report.drag_scaling;
    let heads = ["depths [m]", "pairs", "mean ratio of pairs", "ratio of fits", "difference"];
    let rows = drag.ratios.iter().map(|ratio| {
        vec![
            format!("{:.4} and {:.4}", ratio.depths_m[0], ratio.depths_m[1]),
            ratio.pairs.to_string(),
            format!("{:.3}", ratio.mean_of_pairs),
            format!("{:.3}", ratio.of_fits),
            format!("{:+.1} %", 100.0 * ratio.difference),
        ]
    });
    let pairs = &report.config.pairs;
    format!(
        "<p>{} speed-matched pairs (within {} m/s, above {} m/s): |F<sub>x</sub>| / v² of the deeper over the shallower. \
         {LABEL}: {} pairs, differences of 1 to 9 %.</p>{}",
        drag.pairs,
        pairs.speed_tolerance_mps,
        pairs.least_speed_mps,
        published::PAIRS,
        table(&heads, usize::MAX, rows),
    )
}

fn vertical_table(report: &Report) -> String {
    let heads = [
        "depth [m]",
        "sections",
        "mean F<sub>z</sub> [N]",
        "F<sub>0</sub> [N]",
        "C<sub>L</sub> [N s²/m²]",
        "R²",
        "mesh, wetted [N]",
        "mesh, dry [N]",
        "mean F<sub>z</sub> [N]",
        "F<sub>0</sub> [N]",
        "R²",
    ];
    let rows = report.vertical_force.depths.iter().map(|at| {
        vec![
            format!("{:.4}", at.depth_m),
            at.sections.to_string(),
            format!("{:.0}", at.mean_fz_n),
            with_error(at.f0_n, at.f0_std_n, 0),
            number(at.c_l, 2),
            number(at.r2, 3),
            format!("{:.0}", at.mesh_wetted_n),
            format!("{:.0}", at.mesh_dry_n),
            of_paper(&at.paper, |paper| Some(paper.mean_fz_n), 0),
            of_paper(&at.paper, |paper| Some(paper.f0_n), 0),
            of_paper(&at.paper, |paper| paper.fz_r2, 2),
        ]
    });
    let line = report.vertical_force.f0_against_depth.as_ref().map_or_else(String::new, |f0| {
        let paper = f0.paper_r2.map_or_else(String::new, |r2| format!(", {r2} for the paper's ({LABEL})"));
        format!(
            "<p>F<sub>0</sub> against depth: a line through {} points, R² {:.4}, {:.0} N/m. Through so few points a high R² \
             says little: the mesh's own hydrostatics, which are no straight line, have {} wetted and {} dry{paper}.</p>",
            f0.points,
            f0.r2,
            f0.slope,
            number(f0.mesh_wetted_r2, 4),
            number(f0.mesh_dry_r2, 4),
        )
    });
    format!(
        "<p>F<sub>z</sub> = F<sub>0</sub> + C<sub>L</sub> v² at each depth. Beside F<sub>0</sub> stands what the mesh \
         displaces at rest, with water under the tires (wetted) and without (dry). Shaded: {LABEL}.</p>{}{line}",
        table(&heads, 8, rows),
    )
}

fn bin_table(report: &Report) -> String {
    let depths = &report.vertical_force.depths;
    let heads: Vec<String> = std::iter::once("speed [m/s]".to_owned())
        .chain(depths.iter().map(|at| format!("{:.4} m", at.depth_m)))
        .collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let rows = report.vertical_force.speed_bins.iter().map(|bin| {
        let cell = |depth: f64| bin.fz_n.iter().find(|(at, _)| *at == depth).map(|(_, fz)| *fz);
        std::iter::once(format!("{} to {}", bin.from_mps, bin.to_mps))
            .chain(depths.iter().map(|at| number(cell(at.depth_m), 0)))
            .collect()
    });
    format!("<p>Mean F<sub>z</sub> [N] at matched speeds:</p>{}", table(&heads, usize::MAX, rows))
}

/// What stands before the title of an axis, so that a figure taken from the page still says what it is.
fn origin(report: &Report) -> &'static str {
    if report.data.generated.is_some() { " (generated motion)" } else { "" }
}

/// The sections of a depth: those to which no other is nearer.
fn points(report: &Report, depth: f64, of: impl Fn(&Section) -> f64) -> Vec<(f64, f64)> {
    let others = || report.drag_scaling.depths.iter().map(|at| at.depth_m);
    let nearest = |section: &&Section| {
        let distance = (section.depth_m - depth).abs();
        others().all(|other| distance <= (section.depth_m - other).abs())
    };
    let here = report.sections.iter().filter(nearest);
    here.map(|section| (section.speed_squared_m2ps2, of(section))).collect()
}

fn drag_figure(report: &Report) -> Result<String, PlotError> {
    let mut series = Vec::new();
    for (index, at) in report.drag_scaling.depths.iter().enumerate() {
        let color = color(index);
        let points = points(report, at.depth_m, |section| section.drag_n);
        let reach = points.iter().map(|point| point.0).fold(0.0, f64::max);
        let line = |slope: f64| vec![(0.0, 0.0), (reach, slope * reach)];
        series.push(Series { name: format!("{:.4} m", at.depth_m), mark: Mark::Circle, color, points });
        let slopes = [(Mark::Line, at.c_d_eff), (Mark::Dashes, at.paper.map(|paper| paper.c_d_eff))];
        for (mark, slope) in slopes {
            let points = slope.map(line).unwrap_or_default();
            series.push(Series { name: String::new(), mark, color, points });
        }
    }
    let svg = figure(&format!("mean v² [m²/s²]{}", origin(report)), "mean |Fx| [N]", &series)?;
    Ok(format!(
        "{svg}<p class=\"small\">Points: trials. Lines: fits. Dashed: the paper's fits ({LABEL}).</p>"
    ))
}

fn vertical_figure(report: &Report) -> Result<String, PlotError> {
    let mut series = Vec::new();
    for (index, at) in report.vertical_force.depths.iter().enumerate() {
        let color = color(index);
        let points = points(report, at.depth_m, |section| section.fz_n);
        let reach = points.iter().map(|point| point.0).fold(0.0, f64::max);
        series.push(Series { name: format!("{:.4} m", at.depth_m), mark: Mark::Circle, color, points });
        if let (Some(f0), Some(c_l)) = (at.f0_n, at.c_l) {
            let points = vec![(0.0, f0), (reach, f0 + c_l * reach)];
            series.push(Series { name: String::new(), mark: Mark::Line, color, points });
            series.push(Series { name: String::new(), mark: Mark::Diamond, color, points: vec![(0.0, f0)] });
        }
    }
    let svg = figure(&format!("mean v² [m²/s²]{}", origin(report)), "mean Fz [N]", &series)?;
    Ok(svg + "<p class=\"small\">Points: trials. Lines: fits. Diamonds: their intercepts F<sub>0</sub>.</p>")
}

fn depth_figure(report: &Report) -> Result<String, PlotError> {
    let vertical = &report.vertical_force;
    let series = |name: &str, mark, color, points| Series { name: name.into(), mark, color, points };
    let curve = |of: fn(&(f64, f64, f64)) -> f64| vertical.mesh_curve.iter().map(|p| (p.0, of(p))).collect();
    let ours = vertical.depths.iter().filter_map(|at| Some((at.depth_m, at.f0_n?)));
    let papers = vertical.depths.iter().filter_map(|at| Some((at.depth_m, at.paper?.f0_n)));
    let series = [
        series("mesh at rest, wetted", Mark::Line, BLACK, curve(|p| p.1)),
        series("mesh at rest, dry", Mark::Dashes, BLACK, curve(|p| p.2)),
        series("F0", Mark::Diamond, color(0), ours.collect()),
        series(&format!("F0, {LABEL}"), Mark::Cross, BROWN, papers.collect()),
    ];
    figure(&format!("depth [m]{}", origin(report)), "vertical force at rest [N]", &series)
}

fn section_tables(report: &Report) -> String {
    let heads = [
        "trial",
        "from [s]",
        "to [s]",
        "samples",
        "depth, measured [m]",
        "v [m/s]",
        "|F<sub>x</sub>| [N]",
        "F<sub>z</sub> [N]",
        "in domain",
    ];
    let rows = report.sections.iter().map(|section| {
        vec![
            escape(&section.trial),
            format!("{:.2}", section.start_s),
            format!("{:.2}", section.end_s),
            section.samples.to_string(),
            format!("{:.4}", section.measured_depth_m),
            format!("{:.2}", section.speed()),
            format!("{:.1}", section.drag_n),
            format!("{:.1}", section.fz_n),
            format!("{:.0} %", 100.0 * section.in_domain),
        ]
    });
    let sections = table(&heads, usize::MAX, rows);
    let mut text = format!(
        "<details><summary>{} planar sections</summary><p class=\"small\">\"in domain\" is the share of samples in the \
         training domain; noise in the angular velocity alone can leave it.</p>{sections}\
         </details>",
        report.sections.len()
    );
    let reasons = report.left_out.iter().map(|out| (&out.trial, &out.why));
    list(&mut text, "trials without a planar section", reasons.map(|(trial, why)| format!("{trial}: {why}")));
    list(&mut text, "remarks on the files", report.data.remarks.iter().cloned());
    text
}

fn list(text: &mut String, what: &str, items: impl Iterator<Item = String>) {
    let items: Vec<String> = items.map(|item| format!("<li>{}</li>", escape(&item))).collect();
    if !items.is_empty() {
        let _ = write!(
            text,
            "<details><summary>{} {what}</summary><ul>{}</ul></details>",
            items.len(),
            items.concat()
        );
    }
}

fn footer(report: &Report) -> String {
    let (planar, mocap) = (&report.config.planar, &report.config.mocap);
    let processing = match report.data.source {
        Source::Trials => String::new(),
        Source::Mocap | Source::Generated => format!(
            " · recordings to {} Hz, Savitzky-Golay window {}, order {}",
            mocap.rate_hz, mocap.window, mocap.order
        ),
    };
    format!(
        "<p class=\"small\">planar: longer than {} s and {} samples, mean vertical velocity below {} m/s, depth within {} m \
         of its most frequent value{processing} · commit {}</p>",
        planar.duration_s,
        planar.samples,
        planar.vertical_speed_mps,
        planar.depth_tolerance_m,
        escape(&report.commit),
    )
}
