//! Promise: what lies in deploy/ fits the code. Where a checking tool is not installed, its test says so and is skipped.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use wade::config::Config;
use wade::metrics::{Metrics, Transport};

fn deploy(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("deploy").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(deploy(name)).expect(name)
}

/// Runs a tool; none, with a printed reason, where it is not installed.
fn tool(name: &str, arguments: &[&Path]) -> Option<Output> {
    match Command::new(name).args(arguments).output() {
        Ok(output) => Some(output),
        Err(error) => {
            println!("skipped: {name} cannot be run here: {error}");
            None
        }
    }
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

/// Dotted names of all values of a table.
fn keys(table: &toml::Table) -> BTreeSet<String> {
    let below = |(key, value): (&String, &toml::Value)| match value {
        toml::Value::Table(table) => keys(table).into_iter().map(|below| format!("{key}.{below}")).collect(),
        _ => vec![key.clone()],
    };
    table.iter().flat_map(below).collect()
}

#[test]
fn the_shown_settings_are_the_defaults() {
    let shown = Config::read(&deploy("wade.toml")).expect("valid");
    assert_eq!(shown, Config::default());
}

#[test]
fn every_setting_is_shown_with_a_comment() {
    let defaults = toml::Table::try_from(Config::default()).expect("the settings are a table");
    let file = text("wade.toml");
    let shown: toml::Table = file.parse().expect("TOML");
    assert_eq!(keys(&shown), keys(&defaults));
    let lines: Vec<&str> = file.lines().collect();
    for pair in lines.windows(2) {
        let is_key = pair[1].starts_with(|c: char| c.is_ascii_lowercase());
        assert!(!is_key || pair[0].starts_with("# "), "no comment above: {}", pair[1]);
    }
}

#[test]
fn a_key_that_does_not_exist_is_refused_by_name() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let path = folder.path().join("wade.toml");
    for (settings, wrong) in [("drain = 1.0", "drain"), ("[grpc]\nmax_stream = 3", "max_stream")] {
        std::fs::write(&path, settings).expect("written");
        let message = Config::read(&path).expect_err("refused").to_string();
        assert!(message.contains(&format!("`{wrong}`")) && message.contains("wade.toml"), "{message}");
    }
}

#[test]
fn alerts_and_dashboard_ask_for_metrics_that_exist() {
    let metrics = Metrics::new();
    metrics.recorder(Transport::shm, "husky").record(std::time::Duration::from_micros(9), 1);
    metrics.refuse(Transport::shm, "invalid_argument");
    metrics.set_bundle_version("husky", 1);
    metrics.count_reload(false);
    metrics.set_transport_up("grpc", true);
    metrics.set_certificate_end(Path::new("server.pem"), std::time::Duration::from_secs(1));
    let rendered = metrics.render();
    for name in ["alerts.yml", "grafana/wade.json"] {
        let file = text(name);
        let words = file.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let asked: BTreeSet<&str> = words.filter(|word| word.starts_with("wade_")).collect();
        assert!(!asked.is_empty(), "{name}");
        for metric in asked {
            assert!(rendered.contains(&format!("\n{metric}{{")), "{name} asks for {metric}:\n{rendered}");
        }
    }
}

#[test]
fn the_dashboard_is_json_and_hadolint_accepts_the_dockerfile() {
    let dashboard: serde_json::Value = serde_json::from_str(&text("grafana/wade.json")).expect("JSON");
    assert!(dashboard["panels"].as_array().is_some_and(|panels| !panels.is_empty()));
    let Some(output) = tool("hadolint", &[&deploy("Dockerfile")]) else { return };
    assert!(output.status.success(), "{}", printed(&output));
}

#[test]
fn systemd_has_nothing_to_say_about_the_unit() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let unit = folder.path().join("wade.service");
    // the program need not be installed where the test runs
    let installed = "ExecStart=/usr/local/bin/wade ";
    let here = format!("ExecStart={} ", env!("CARGO_BIN_EXE_wade"));
    let original = text("wade.service");
    assert!(original.contains(installed));
    std::fs::write(&unit, original.replace(installed, &here)).expect("written");
    let arguments = [Path::new("verify"), Path::new("--man=no"), &unit];
    let Some(output) = tool("systemd-analyze", &arguments) else { return };
    // it warns with exit status 0; on a machine with other units it may speak about those
    let about_ours = printed(&output).lines().filter(|line| line.contains("wade.service")).count();
    assert!(output.status.success() && about_ours == 0, "{}", printed(&output));
}

/// Starts a server with these arguments, its files in a folder of its own, and waits until it says that it is ready.
fn starts(arguments: &[String]) -> String {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let log = folder.path().join("log");
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(arguments).arg("--with-parent").current_dir(folder.path()).env_remove("WADE_CONFIG");
    command.args(["--namespace", &crate::common::namespace()]);
    let mut server = command.stderr(std::fs::File::create(&log).expect("a file")).spawn().expect("started");
    let start = std::time::Instant::now();
    let read = || std::fs::read_to_string(&log).expect("read");
    while !read().contains("ready in") && server.try_wait().expect("asked").is_none() {
        assert!(start.elapsed() < crate::common::PATIENCE, "{}", read());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let _ = server.kill();
    server.wait().expect("reaped");
    read()
}

/// The arguments of `wade` in a file of deploy/, on ports that the system chooses and with files of the test's own.
fn rehearsed<'a>(arguments: impl Iterator<Item = &'a str>) -> Vec<String> {
    let file = |argument: &str| match argument {
        "/etc/wade/wade.toml" => deploy("wade.toml").display().to_string(),
        _ => argument.replace("/run/wade/", "").replace(":50051", ":0").replace(":9464", ":0"),
    };
    arguments.map(file).collect()
}

#[test]
fn the_server_starts_as_the_unit_and_the_image_start_it() {
    let unit = text("wade.service");
    let line =
        unit.lines().find_map(|line| line.strip_prefix("ExecStart=/usr/local/bin/wade ")).expect("a line");
    let mut unit = rehearsed(line.split(' '));
    unit.extend(["--listen", "127.0.0.1:0", "--http", "127.0.0.1:0"].map(str::to_owned));
    let log = starts(&unit);
    assert!(log.contains("ready in") && log.contains("address=unix:wade.sock"), "{log}");
    let image = text("Dockerfile");
    let line = image.lines().find_map(|line| line.strip_prefix("CMD ")).expect("a line");
    let arguments: Vec<String> = serde_json::from_str(line).expect("a list");
    let log = starts(&rehearsed(arguments.iter().map(String::as_str)));
    assert!(log.contains("ready in"), "{log}");
    // on all addresses of the container, and says so
    assert!(log.matches("is not encrypted").count() == 2, "{log}");
    let exposed: Vec<String> = arguments.into_iter().filter(|argument| argument != "--insecure").collect();
    let refused = starts(&rehearsed(exposed.iter().map(String::as_str)));
    assert!(refused.contains("tls.certificate") && !refused.contains("ready in"), "{refused}");
}

#[test]
fn the_unit_and_the_containers_wait_longer_than_the_drain() {
    let seconds = |file: &str, key: &str| -> f64 {
        let content = text(file);
        let (_, rest) = content.split_once(key).expect(key);
        let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
        digits.parse().expect("a number")
    };
    let drain = Config::default().drain_s;
    assert!(seconds("wade.service", "\nTimeoutStopSec=") > drain);
    assert!(seconds("compose.yaml", "stop_grace_period: ") > drain);
}

#[test]
fn prometheus_accepts_its_settings_and_the_alerts_fire() {
    let check = [Path::new("check"), Path::new("config"), &deploy("prometheus.yml")];
    let Some(output) = tool("promtool", &check) else { return };
    assert!(output.status.success(), "{}", printed(&output));
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let story = folder.path().join("story.yml");
    let rules = deploy("alerts.yml").display().to_string();
    std::fs::write(&story, STORY.replace("RULES", &rules)).expect("written");
    let output = tool("promtool", &[Path::new("test"), Path::new("rules"), &story]).expect("it ran before");
    assert!(output.status.success(), "{}", printed(&output));
}

/// Server a is well. Server b has every trouble there is: half of its single requests take 2 ms to 5 ms, it refuses
/// four requests a second, its shared memory does not answer, its certificate has a day left,
/// and it refuses a bundle at minute 5. Server c has no vehicle,
/// server d does not answer.
const STORY: &str = r#"
rule_files: [RULES]
evaluation_interval: 15s
tests:
  - interval: 15s
    input_series:
      - {series: 'up{job="wade", instance="a"}', values: '1x40'}
      - {series: 'up{job="wade", instance="b"}', values: '1x40'}
      - {series: 'up{job="wade", instance="c"}', values: '1x40'}
      - {series: 'up{job="wade", instance="d"}', values: '0x40'}
      - {series: 'wade_bundle_version{instance="a", vehicle="husky"}', values: '1x40'}
      - {series: 'wade_bundle_version{instance="b", vehicle="husky"}', values: '1x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="a", transport="shm", vehicle="husky", le="1e-5"}', values: '0+100x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="a", transport="shm", vehicle="husky", le="+Inf"}', values: '0+100x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="a", transport="shm_batch", vehicle="husky", le="0.01"}', values: '0x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="a", transport="shm_batch", vehicle="husky", le="+Inf"}', values: '0+100x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="b", transport="shm", vehicle="husky", le="0.002"}', values: '0+50x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="b", transport="shm", vehicle="husky", le="0.005"}', values: '0+100x40'}
      - {series: 'wade_request_duration_seconds_bucket{instance="b", transport="shm", vehicle="husky", le="+Inf"}', values: '0+100x40'}
      - {series: 'wade_refusals_total{instance="a", transport="shm", reason="not_found"}', values: '0+1x40'}
      - {series: 'wade_refusals_total{instance="b", transport="shm", reason="not_found"}', values: '0+60x40'}
      - {series: 'wade_transport_up{instance="a", transport="shared_memory"}', values: '1x40'}
      - {series: 'wade_transport_up{instance="b", transport="shared_memory"}', values: '0x40'}
      - {series: 'wade_transport_up{instance="b", transport="grpc"}', values: '1x40'}
      - {series: 'wade_certificate_end_seconds{instance="a", file="server.pem"}', values: '7776000x40'}
      - {series: 'wade_certificate_end_seconds{instance="b", file="server.pem"}', values: '86400x40'}
      - {series: 'wade_reloads_total{instance="a", outcome="accepted"}', values: '0x20 1x20'}
      - {series: 'wade_reloads_total{instance="b", outcome="refused"}', values: '0x20 1x20'}
    promql_expr_test:
      - {expr: 'count by (alertname, instance) (ALERTS{alertstate="firing"})', eval_time: 4m, exp_samples: [
          {labels: '{alertname="WadeSlow", instance="b"}', value: 1},
          {labels: '{alertname="WadeCertificateEnds", instance="b"}', value: 1},
          {labels: '{alertname="WadeRefuses", instance="b"}', value: 1},
          {labels: '{alertname="WadeTransportDown", instance="b"}', value: 1},
          {labels: '{alertname="WadeNotReady", instance="c"}', value: 1},
          {labels: '{alertname="WadeNotReady", instance="d"}', value: 1}]}
      - {expr: 'ALERTS{alertname="WadeReloadRefused"}', eval_time: 6m, exp_samples: [
          {labels: 'ALERTS{alertname="WadeReloadRefused", alertstate="firing", instance="b", outcome="refused", severity="warning"}', value: 1}]}
"#;
