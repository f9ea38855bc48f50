//! Accuracy of the weights against CFD, from what `wade eval` and `wade validate` wrote.

use serde_json::Value;

use super::{digits, json, markdown, newest, number, root, triple, word};

pub const VEHICLES: [&str; 2] = ["husky", "warthog"];

/// The two networks that are shipped, by the folder of their record.
const SHIPPED: [&str; 2] = ["anchored", "paper"];

/// Names of models in the files of `wade eval`, and what people call them.
const NAMES: [(&str, &str); 11] = [
    ("anchored", "`anchored`"),
    ("paper", "`paper`"),
    ("known physics alone", "known part of `anchored` alone"),
    ("physics alone, nothing learnt", "known part of `anchored` alone"),
    ("hydrostatics + windward drag, nothing learnt", "known part of `anchored` alone"),
    ("Archimedes + one drag constant", "hydrostatics and one drag constant"),
    ("spherical pontoons", "spherical pontoons"),
    ("constant coefficients (Fossen)", "constant coefficients (Fossen)"),
    ("no_dimensions", "without length, width, height"),
    ("merged_plates", "front and rear as whole plates"),
    ("global_only", "net force alone, no surfaces"),
];

fn called(model: &Value) -> String {
    let name = word(&model["name"]);
    NAMES.iter().find(|(from, _)| *from == name).map_or(name, |(_, to)| to).to_owned()
}

fn record(path: &str) -> Value {
    json(root().join("campaigns/training").join(path))
}

fn vehicle<'a>(record: &'a Value, name: &str) -> &'a Value {
    let vehicles = record["vehicles"].as_array().expect("a list");
    vehicles.iter().find(|vehicle| vehicle["name"] == name).expect("both vehicles are judged")
}

fn models(vehicle: &Value) -> &Vec<Value> {
    vehicle["models"].as_array().expect("a list")
}

fn percent(values: &Value) -> String {
    let values = values.as_array().expect("a list");
    values.iter().map(|share| format!("{:.0}", 100.0 * number(share))).collect::<Vec<_>>().join(" / ")
}

fn title(name: &str) -> String {
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + rest
}

fn program(record: &Value) -> &str {
    word(&record["program"])
}

/// Rows of README's table: errors on held-out cases, and what the predicted standard deviation covers.
pub fn summary() -> Vec<Vec<String>> {
    let record = record("anchored/eval.json");
    let row = |name: &str| {
        let vehicle = vehicle(&record, name);
        let axes = ["Fx", "Fy", "Fz"];
        let mae = vehicle["models"][0]["force"]["mae"].as_array().expect("a list");
        let cells = axes.iter().zip(mae).map(|(axis, value)| format!("{axis} {}", digits(number(value))));
        let title = format!("{} force error, {} held-out cases [N]", title(name), vehicle["cases"]);
        let mut row: Vec<String> = std::iter::once(title).chain(cells).collect();
        row.push("MAE".to_owned());
        row
    };
    VEHICLES.map(row).to_vec()
}

/// Net force on the held-out cases of both networks, beside simple models and the paper's own figures.
pub fn forces() -> String {
    let mut rows = Vec::new();
    let mut programs = Vec::new();
    for name in VEHICLES {
        let records = SHIPPED.map(|folder| record(&format!("{folder}/eval.json")));
        programs.extend(records.iter().map(program).map(str::to_owned));
        let [anchored, papers] = [0, 1].map(|index| vehicle(&records[index], name));
        let coverage = |vehicle: &Value| {
            ["within_one", "within_two"].map(|field| percent(&vehicle["calibration"][field])).to_vec()
        };
        let row = |model: &Value, coverage: Vec<String>| {
            let force = &model["force"];
            [vec![title(name), called(model), triple(&force["mae"]), triple(&force["rmse"])], coverage]
                .concat()
        };
        rows.push(row(&models(anchored)[0], coverage(anchored)));
        rows.push(row(&models(papers)[0], coverage(papers)));
        let empty = || vec![String::new(); 2];
        rows.extend(models(anchored)[1..].iter().map(|model| row(model, empty())));
        let published = &anchored["paper"];
        let model = "published, different data".to_owned();
        rows.push(
            [vec![title(name), model, triple(&published["mae"]), triple(&published["rmse"])], empty()]
                .concat(),
        );
    }
    programs.sort();
    programs.dedup();
    let header = [
        "vehicle",
        "model",
        "MAE Fx / Fy / Fz [N]",
        "RMSE [N]",
        "within one predicted std. dev. [%]",
        "within two [%]",
    ];
    format!("Programs: {}.\n\n{}", programs.join(", "), markdown(&header, rows))
}

pub fn moments() -> String {
    let mut rows = Vec::new();
    for name in VEHICLES {
        for folder in SHIPPED {
            let record = record(&format!("{folder}/eval.json"));
            let model = &models(vehicle(&record, name))[0];
            rows.push(vec![title(name), called(model), triple(&model["moment_mae_nm"])]);
        }
        let record = record("anchored/eval.json");
        let vehicle = vehicle(&record, name);
        let fossen = models(vehicle).last().expect("simple models");
        rows.push(vec![title(name), called(fossen), triple(&fossen["moment_mae_nm"])]);
        rows.push(vec![
            title(name),
            "mean size of the moment".to_owned(),
            triple(&vehicle["mean_moment_nm"]),
        ]);
    }
    markdown(&["vehicle", "model", "MAE Mx / My / Mz [N m]"], rows)
}

pub fn surfaces() -> String {
    let mut rows = Vec::new();
    for name in VEHICLES {
        for folder in SHIPPED {
            let record = record(&format!("{folder}/eval.json"));
            let model = &models(vehicle(&record, name))[0];
            rows.push(vec![title(name), called(model), triple(&model["surface_mae_n"])]);
        }
        let record = record("anchored/eval.json");
        let published = &vehicle(&record, name)["paper"]["surface_mae"];
        rows.push(vec![title(name), "published, different data".to_owned(), triple(published)]);
    }
    markdown(&["vehicle", "model", "MAE of a surface, Fx / Fy / Fz [N]"], rows)
}

/// What is held out, the file that judges `anchored`, and the one that judges the paper's network.
const SPLITS: [(&str, &str, &str); 4] = [
    ("vehicle", "anchored/vehicle", "paper/vehicle"),
    ("thirds of the depths", "anchored/depth", "paper/depth"),
    ("thirds of the flow angles", "paper/heading", "paper/heading"),
    ("thirds of the cases", "paper/folds", "paper/folds"),
];

pub fn splits() -> String {
    let mut rows = Vec::new();
    for (held_out, first, second) in SPLITS {
        for name in VEHICLES {
            let [anchored, papers] = [first, second].map(|file| record(&format!("splits/{file}.json")));
            let mae = |record: &Value, model: &str| {
                let models = models(vehicle(record, name));
                let found = models.iter().find(|candidate| word(&candidate["name"]).starts_with(model));
                found.map(|model| triple(&model["force"]["mae"])).unwrap_or_default()
            };
            rows.push(vec![
                held_out.to_owned(),
                title(name),
                mae(&anchored, "anchored"),
                mae(&anchored, "hydrostatics + windward drag"),
                mae(&papers, "paper"),
                [program(&anchored), program(&papers)].join("; "),
            ]);
        }
    }
    let header = [
        "held out",
        "vehicle",
        "`anchored`, MAE Fx / Fy / Fz [N]",
        "known part of `anchored` alone [N]",
        "`paper` [N]",
        "programs",
    ];
    markdown(&header, rows)
}

pub fn ablations() -> String {
    let record = record("splits/ablations.json");
    let kept = ["paper", "no_dimensions", "merged_plates", "global_only"];
    let rows = kept.map(|kept| {
        let mae = VEHICLES.map(|name| {
            let models = models(vehicle(&record, name));
            let model = models.iter().find(|model| model["name"] == kept).expect("an ablation");
            (called(model), triple(&model["force"]["mae"]))
        });
        let [(name, husky), (_, warthog)] = mae;
        vec![name, husky, warthog]
    });
    let header = ["network", "Husky, MAE Fx / Fy / Fz [N]", "Warthog [N]"];
    format!("Program: {}.\n\n{}", program(&record), markdown(&header, rows.to_vec()))
}

/// The paper's two physics tests on generated trials.
pub fn physics() -> String {
    let mut rows = Vec::new();
    let mut checks = Vec::new();
    let mut commits = Vec::new();
    for name in VEHICLES {
        let report = record(&format!("validate/{name}/report.json"));
        commits.push(word(&report["commit"]).to_owned());
        let lift = report["vertical_force"]["depths"].as_array().expect("a list");
        for (drag, lift) in report["drag_scaling"]["depths"].as_array().expect("a list").iter().zip(lift) {
            let published = |field: &str| drag["paper"][field].as_f64().map(digits).unwrap_or_default();
            let ours = |value: &Value| digits(number(value));
            rows.push(vec![
                title(name),
                ours(&drag["depth_m"]),
                ours(&drag["c_d_eff"]),
                published("c_d_eff"),
                ours(&drag["r2"]),
                published("drag_r2"),
                ours(&lift["f0_n"]),
                published("f0_n"),
                ours(&lift["mesh_wetted_n"]),
            ]);
        }
        for check in report["checks"].as_array().expect("a list") {
            let holds = if check["holds"] == true { "yes" } else { "**no**" };
            checks.push(vec![title(name), word(&check["name"]).replace('_', " "), holds.to_owned()]);
        }
        let share = format!("{:.0} %", 100.0 * number(&report["data"]["in_domain"]));
        checks.push(vec![title(name), "share of samples in the training domain".to_owned(), share]);
    }
    commits.dedup();
    let header = [
        "vehicle",
        "depth [m]",
        "drag / v2 [N s2/m2]",
        "published, different data",
        "R2",
        "published, different data",
        "F0 [N]",
        "published, different data",
        "hydrostatics at rest [N]",
    ];
    format!(
        "Commit: {}.\n\n{}\n{}",
        commits.join(", "),
        markdown(&header, rows),
        markdown(&["vehicle", "check", "holds"], checks)
    )
}

/// Stability of generated cars beside what others measured and computed.
pub fn floods() -> String {
    let rows = json(newest("floods.json"));
    let row = |row: &Value| {
        let ours: Vec<String> =
            row["ours"].as_array().expect("a list").iter().map(|value| digits(number(value))).collect();
        let source = word(&row["source"]).to_owned();
        let published = digits(number(&row["published"]));
        vec![
            word(&row["car"]).to_owned(),
            word(&row["quantity"]).to_owned(),
            published,
            source,
            ours.join(", "),
        ]
    };
    let header = ["car", "quantity", "published", "source", "`wade`"];
    markdown(&header, rows.as_array().expect("a list").iter().map(row).collect())
}
