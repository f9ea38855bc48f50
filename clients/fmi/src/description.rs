//! What a unit says of itself: `modelDescription.xml`, a page for people, and what its figures rest on.

use std::fmt::Write;

use serde_json::json;
use wade_core::condition::Condition;
use wade_core::domain::Quantity;
use wade_core::forces::Forces;
use wade_core::frame::Vec3;
use wade_core::model::{Form, Model, Workspace};

use crate::settings::Settings;
use crate::variables::{Causality, Kind, PHYSICS, Variable};

/// Name of the library in the unit, without its suffix.
pub const IDENTIFIER: &str = "wade_fmu";

/// Units by name, with the exponents of kg, m, s and rad.
const UNITS: [(&str, [i8; 4]); 11] = [
    ("kg/m3", [1, -3, 0, 0]),
    ("m", [0, 1, 0, 0]),
    ("m/s", [0, 1, -1, 0]),
    ("m/s2", [0, 1, -2, 0]),
    ("N", [1, 1, -2, 0]),
    ("N.m", [1, 2, -2, 0]),
    ("rad", [0, 0, 0, 1]),
    ("rad/s", [0, 0, -1, 1]),
    ("rad/s2", [0, 0, -2, 1]),
    ("s", [0, 0, 1, 0]),
    ("W", [1, 2, -3, 0]),
];

/// The variables of a unit.
pub fn variables(settings: &Settings) -> impl Iterator<Item = Variable> {
    Variable::ALL.into_iter().filter(|variable| variable.is_in(settings))
}

/// `modelDescription.xml` of a vehicle's unit. A token names its content.
pub fn xml(settings: &Settings, model: &Model, token: &str) -> String {
    let vehicle = escaped(&settings.vehicle);
    let remote = settings.address.is_some();
    let text = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{vehicle}" instantiationToken="{token}" description="Forces of water on {vehicle}: {}" version="{}" generationTool="wade {}" variableNamingConvention="flat">
  <CoSimulation modelIdentifier="{IDENTIFIER}" needsExecutionTool="{remote}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="{}" providesDirectionalDerivatives="{}"/>
"#,
        escaped(model.provenance()),
        model.version(),
        env!("CARGO_PKG_VERSION"),
        !remote,
        model.base().is_some(),
    );
    let mut text = text;
    units(&mut text);
    types(&mut text);
    text.push_str("  <LogCategories>\n    <Category name=\"logStatusError\" description=\"What went wrong, and the way out\"/>\n    <Category name=\"logStatusWarning\" description=\"Outputs are older than the step\"/>\n  </LogCategories>\n");
    text.push_str(
        "  <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.001\"/>\n  <ModelVariables>\n",
    );
    for variable in variables(settings) {
        describe(&mut text, variable, settings);
    }
    text.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let outputs = variables(settings).filter(|variable| variable.row().causality == Causality::Output);
    let references: Vec<u32> = outputs.map(Variable::reference).collect();
    for kind in ["Output", "InitialUnknown"] {
        for reference in &references {
            let _ = writeln!(text, "    <{kind} valueReference=\"{reference}\"/>");
        }
    }
    text.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
    text
}

fn units(text: &mut String) {
    text.push_str("  <UnitDefinitions>\n");
    for (name, exponents) in UNITS {
        let _ = write!(text, "    <Unit name=\"{name}\"><BaseUnit");
        for (base, exponent) in ["kg", "m", "s", "rad"].into_iter().zip(exponents).filter(|(_, e)| *e != 0) {
            let _ = write!(text, " {base}=\"{exponent}\"");
        }
        text.push_str("/></Unit>\n");
    }
    text.push_str("  </UnitDefinitions>\n");
}

fn types(text: &mut String) {
    text.push_str("  <TypeDefinitions>\n    <EnumerationType name=\"Physics\">\n");
    for (number, name) in PHYSICS.into_iter().enumerate() {
        let _ = writeln!(text, "      <Item name=\"{name}\" value=\"{}\"/>", number + 1);
    }
    text.push_str("    </EnumerationType>\n  </TypeDefinitions>\n");
}

fn describe(text: &mut String, variable: Variable, settings: &Settings) {
    let row = variable.row();
    let (causality, variability) = match (row.causality, row.kind) {
        (Causality::Parameter, _) => ("parameter", "fixed"),
        (Causality::Input, _) => ("input", "continuous"),
        (Causality::Independent, _) => ("independent", "continuous"),
        (Causality::Output, Kind::Real) => ("output", "continuous"),
        (Causality::Output, _) => ("output", "discrete"),
    };
    let element = match row.kind {
        Kind::Real => "Float64",
        Kind::Boolean => "Boolean",
        Kind::Count => "UInt32",
        Kind::Physics => "Enumeration",
    };
    let _ = write!(
        text,
        "    <{element} name=\"{}\" valueReference=\"{}\" causality=\"{causality}\" variability=\"{variability}\" description=\"{}\"",
        row.name,
        variable.reference(),
        escaped(row.description)
    );
    if !row.unit.is_empty() {
        let _ = write!(text, " unit=\"{}\"", row.unit);
    }
    if row.kind == Kind::Physics {
        text.push_str(" declaredType=\"Physics\"");
    }
    if matches!(row.causality, Causality::Parameter | Causality::Input) {
        let shown = |value: f64| match row.kind {
            Kind::Boolean => (value != 0.0).to_string(),
            _ => value.to_string(),
        };
        let start: Vec<String> = variable.start(settings).into_iter().map(shown).collect();
        let _ = write!(text, " start=\"{}\"", start.join(" "));
    }
    if row.lengths.is_empty() {
        text.push_str("/>\n");
        return;
    }
    text.push('>');
    for length in variable.lengths(settings) {
        let _ = write!(text, "<Dimension start=\"{length}\"/>");
    }
    let _ = writeln!(text, "</{element}>");
}

/// The page of the unit.
pub fn page(settings: &Settings, model: &Model) -> String {
    let vehicle = escaped(&settings.vehicle);
    let answers = match &settings.address {
        None => "The unit answers by itself, from the bundle in its resources.".to_owned(),
        Some(address) => format!("The unit asks the server at <code>{}</code>.", escaped(address)),
    };
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{vehicle} in water</title></head>\n<body>\n<h1>{vehicle} in water</h1>\n<p>{answers} \
         Source of the weights: {}; bundle version {}.</p>\n\
         <p>Body frame: x forward, y left, z up, origin at the center of the hull's bounding box. SI units. A step answers the inputs \
         that were set before it, and what the water remembers moves on by its length.</p>\n<h2>Surfaces</h2>\n<ol>\n",
        escaped(model.provenance()),
        model.version(),
    );
    for surface in &settings.surfaces {
        let _ = writeln!(text, "<li>{}</li>", escaped(surface));
    }
    text.push_str("</ol>\n<h2>Variables</h2>\n<table>\n<tr><th>name</th><th>unit</th><th></th></tr>\n");
    for variable in variables(settings) {
        let row = variable.row();
        let _ = writeln!(
            text,
            "<tr><td><code>{}</code></td><td>{}</td><td>{}</td></tr>",
            row.name,
            row.unit,
            escaped(row.description)
        );
    }
    text.push_str("</table>\n</body>\n</html>\n");
    text
}

/// Shares of the ranges of depth and speed at which the deviation is stated as an example.
const EXAMPLES: [f64; 3] = [0.25, 0.5, 0.75];

/// Force and deviation straight ahead in fresh water in the middle of the training domain; none without one.
fn examples(model: &Model) -> Vec<serde_json::Value> {
    let [depth, speed] = [Quantity::Depth, Quantity::Speed].map(|quantity| model.domain().range(quantity));
    let (Some(depth), Some(speed)) = (depth, speed) else { return Vec::new() };
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    let examples = EXAMPLES.map(|share| {
        let within = |range: wade_core::domain::Range| range.min + share * (range.max - range.min);
        let (depth, speed) = (within(depth), within(speed));
        model.evaluate(&Condition::level(Vec3::new(speed, 0.0, 0.0), depth), &mut workspace, &mut forces);
        let single = |vector: Vec3| <[f64; 3]>::from(vector);
        json!({
            "depth_m": depth,
            "velocity_mps": [speed, 0.0, 0.0],
            "force_n": single(forces.wrench.force),
            "force_deviation_n": single(forces.uncertainty),
            "moment_deviation_nm": single(forces.moment_uncertainty),
        })
    });
    examples.into()
}

/// What the figures rest on: source of the training data, the states they hold for, and the deviation to expect.
pub fn credibility(model: &Model, digest: &str) -> String {
    let ranges: serde_json::Map<String, serde_json::Value> = Quantity::ALL
        .into_iter()
        .filter_map(|quantity| {
            let range = model.domain().range(quantity)?;
            let range = json!({ "minimum": range.min, "maximum": range.max, "unit": quantity.unit() });
            Some((quantity.words().to_owned(), range))
        })
        .collect();
    let value = json!({
        "vehicle": model.vehicle().name,
        "bundle_version": model.version(),
        "bundle_sha256": digest,
        "training_data": model.provenance(),
        "training_cases": model.weights().and_then(|weights| match &weights.form {
            Form::Anchored(form) => Some(form.cases.len()),
            Form::Paper(_) => None,
        }),
        "hull_faces": model.vehicle().hull.mesh.faces.len(),
        "drag_elements": model.base().map(|base| base.elements()),
        "physical_base": model.base_name(),
        "training_domain": ranges,
        "deviation": "outputs force_deviation_n and moment_deviation_nm: one standard deviation, for each state",
        "deviation_examples": examples(model),
        "outside_the_domain": "output outside says how far; the physical base answers, and the deviation grows",
        "validation": "docs/src/results of the source tree: errors on held-out CFD cases, and published measurements",
    });
    let mut text = serde_json::to_string_pretty(&value).unwrap_or_default();
    text.push('\n');
    text
}

/// A text within XML and HTML.
fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
        out
    })
}
