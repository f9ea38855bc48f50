//! Promise: the page shows in a real browser what the server answers, in numbers and as a picture. Pictures are left in
//! target/page for people to look at.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Command, Output};

use crate::common::{Served, http};
use serde_json::json;
use wade_client::Method;
use wade_wire::State;

/// Settings that a picture needs without a graphics card, and time for the page to ask and to draw.
const BROWSER: [&str; 9] = [
    "180",
    "chromium",
    "--headless",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--virtual-time-budget=6000",
];

/// Runs the browser; none, with a printed reason, where there is none.
fn browse(arguments: &[String]) -> Option<Output> {
    let found = Command::new("chromium").arg("--version").output();
    if let Err(error) = found {
        println!("skipped: chromium cannot be run here: {error}");
        return None;
    }
    let profile = tempfile::TempDir::new().expect("a temporary folder");
    let output = Command::new("timeout")
        .args(BROWSER)
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(arguments)
        .output()
        .expect("timeout is part of coreutils");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(output)
}

fn address(served: &Served) -> SocketAddr {
    served.running.http_address().expect("HTTP is on")
}

/// The text of the element with this id, without tags.
fn text_of(page: &str, id: &str) -> String {
    let start = page.find(&format!("id=\"{id}\"")).unwrap_or_else(|| panic!("no {id} in\n{page}"));
    let rest = &page[start..];
    let inner = &rest[rest.find('>').expect("a tag") + 1..];
    inner[..inner.find('<').expect("a tag")].to_owned()
}

#[test]
fn the_numbers_of_the_page_are_those_of_the_query() {
    let served = Served::start();
    let address = address(&served);
    let url = format!(
        "http://{address}/#vehicle=warthog&speed=1.5&direction=30&depth=0.3&roll=4&pitch=-6&density=1025&dry=1&color=fz"
    );
    let Some(output) = browse(&["--dump-dom".into(), url]) else { return };
    let page = String::from_utf8(output.stdout).expect("text");
    let (direction, roll, pitch) = (30_f64.to_radians(), 4_f64.to_radians(), -6_f64.to_radians());
    let query = json!({"vehicle": "warthog", "state": {
        "velocity_mps": {"x": 1.5 * direction.cos(), "y": 1.5 * direction.sin()},
        "depth_m": 0.3,
        "density_kgpm3": 1025,
        "roll_pitch": {"roll_rad": roll, "pitch_rad": pitch},
        "ground_contact": "GROUND_CONTACT_DRY",
    }});
    let answer = http::post(address, "/v1/query", &query.to_string()).json();
    for axis in ["x", "y", "z"] {
        for (id, value) in [
            ("force", &answer["wrench"]["force_n"]),
            ("moment", &answer["wrench"]["moment_nm"]),
            ("std", &answer["uncertainty_n"]),
        ] {
            let expected = format!("{:.2}", value[axis].as_f64().expect("a number"));
            assert_eq!(text_of(&page, &format!("{id}-{axis}")), expected, "{id}-{axis}");
        }
    }
    assert!(page.contains("outside the training domain: tilt by"), "tilted by 7 degrees");
    let weights = crate::common::model("warthog").provenance().to_owned();
    assert!(page.contains(&format!("weights: {weights}")), "the provenance is told: {weights}");
    for name in ["wheel_fl", "underbody_left"] {
        assert!(page.contains(name), "surfaces are listed: {name}");
    }
    // the page's own query is among the latencies
    assert!(page.contains("this page (JSON)"), "latencies are listed");
    let trouble = page.find("id=\"trouble\"").map(|at| &page[at..at + 60]);
    assert!(trouble.is_some_and(|trouble| trouble.contains("hidden")), "{trouble:?}");
}

#[test]
fn the_surfaces_of_an_imported_robot_have_colors_of_their_own() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let vehicles = crate::import::imported_car(folder.path());
    let served = Served::with(|config| config.vehicles = vehicles);
    let url = format!("http://{}/#vehicle=car&depth=0.05&color=surface", address(&served));
    let Some(output) = browse(&["--dump-dom".into(), url]) else { return };
    let page = String::from_utf8(output.stdout).expect("text");
    let table = &page[page.find("<table id=\"surfaces\"").expect("a table")..];
    let table = &table[..table.find("</table>").expect("an end")];
    let colors: BTreeSet<&str> =
        table.split("background").skip(1).map(|rest| rest.split(';').next().unwrap_or(rest)).collect();
    assert_eq!(colors.len(), 9, "one a surface: {colors:?}");
    assert!(page.contains("physical base alone") && !page.contains("training domain"), "{page}");
}

#[test]
fn the_colors_hold_the_surfaces_share_of_the_effects() {
    let vehicles = crate::common::copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = vehicles.path().into());
    let address = address(&served);
    let url = format!("http://{address}/#vehicle=husky&speed=0.8&direction=0&depth=0.18&color=fx");
    let Some(output) = browse(&["--dump-dom".into(), url]) else { return };
    let page = String::from_utf8(output.stdout).expect("text");
    let query = json!({"vehicle": "husky", "state": {"velocity_mps": {"x": 0.8}, "depth_m": 0.18}});
    let answer = http::post(address, "/v1/query", &query.to_string()).json();
    let numbers = |field: &str| -> Vec<f64> {
        answer[field].as_array().expect("an array").iter().filter_map(serde_json::Value::as_f64).collect()
    };
    let (own, share) = (numbers("surface_force_n"), numbers("effect_surface_force_n"));
    let largest =
        |of: &dyn Fn(usize) -> f64| (0..own.len()).step_by(3).map(|i| of(i).abs()).fold(0.0, f64::max);
    let (with, without) = (largest(&|i| own[i] + share[i]), largest(&|i| own[i]));
    // the scale ends at one of a few round numbers, the smallest that is not below the largest force
    let ticks = &page[page.find("id=\"ticks\"").expect("ticks")..];
    let end = ticks.find(" N<").expect("the last tick has the unit");
    let top = ticks[..end].rsplit('>').next().and_then(|text| text.parse::<f64>().ok()).expect("a number");
    assert!(
        top >= with && top < 1.51 * with && !(top >= without && top < 1.51 * without),
        "{top} {with} {without}"
    );
    assert!(page.contains("share of the effects"));
}

/// The picture of a page of this size as rows of red, green and blue.
fn picture(url: &str, name: &str, width: usize, height: usize) -> Option<Vec<Vec<[u8; 3]>>> {
    picture_with(&[], url, name, [width, height])
}

/// The same with more settings of the browser.
fn picture_with(
    more: &[String],
    url: &str,
    name: &str,
    [width, height]: [usize; 2],
) -> Option<Vec<Vec<[u8; 3]>>> {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("../page");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(name);
    let size = format!("--window-size={width},{height}");
    browse(&[more, &[format!("--screenshot={}", path.display()), size, url.to_owned()]].concat())?;
    let file = std::io::BufReader::new(std::fs::File::open(&path).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("PNG");
    let mut data = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut data).expect("PNG");
    let channels = info.color_type.samples();
    let row = |line: &[u8]| line.chunks(channels).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Some(data[..info.buffer_size()].chunks(info.line_size).map(row).collect())
}

/// Where the hull is drawn at both sizes, as shares of the width and of the height.
fn middle(picture: &[Vec<[u8; 3]>], x: [f64; 2], y: [f64; 2]) -> Vec<[u8; 3]> {
    let span = |[from, to]: [f64; 2], size: usize| (from * size as f64) as usize..(to * size as f64) as usize;
    picture[span(y, picture.len())].iter().flat_map(|line| line[span(x, line.len())].to_vec()).collect()
}

#[test]
fn the_picture_shows_the_hull_and_follows_the_state() {
    let served = Served::start();
    let base = format!("http://{}/#vehicle=husky&speed=0.8&direction=0", address(&served));
    let Some(wide) = picture(&format!("{base}&depth=0.18"), "husky-1440.png", 1440, 900) else { return };
    let pixels = middle(&wide, [0.1, 0.55], [0.2, 0.6]);
    let colors: BTreeSet<[u8; 3]> = pixels.iter().copied().collect();
    assert!(colors.len() > 300, "a blank picture has few colors: {}", colors.len());
    // dry surfaces are a bluish gray, arrows red, also where they shine through the hull
    let share = |value: u8, of: u8| f64::from(value) / f64::from(of.max(1));
    let is_gray = |[r, g, b]: [u8; 3]| {
        b < 190 && (share(r, b) - 0.933).abs() < 0.06 && (share(g, b) - 0.96).abs() < 0.06
    };
    let is_red = |[r, g, b]: [u8; 3]| r > 60 && share(r, g) > 1.7 && share(r, b) > 1.7;
    let count =
        |pixels: &[[u8; 3]], is: &dyn Fn([u8; 3]) -> bool| pixels.iter().filter(|pixel| is(**pixel)).count();
    assert!(count(&pixels, &is_gray) > 2000 && count(&pixels, &is_red) > 150, "surfaces and arrows");
    let Some(dry) = picture(&format!("{base}&depth=0"), "husky-dry-1440.png", 1440, 900) else { return };
    let dry = middle(&dry, [0.1, 0.55], [0.2, 0.6]);
    assert!(count(&dry, &is_gray) > 20_000 && count(&dry, &is_red) == 0, "out of the water nothing acts");
    let changed = dry.iter().zip(&pixels).filter(|(a, b)| a != b).count();
    assert!(changed * 20 > pixels.len(), "the water and the colors change: {changed} of {}", pixels.len());
    let url = format!("http://{}/#vehicle=warthog&speed=2&direction=40&depth=0.35&pitch=8", address(&served));
    let Some(narrow) = picture(&url, "warthog-800.png", 800, 1300) else { return };
    let colors: BTreeSet<[u8; 3]> = middle(&narrow, [0.2, 0.8], [0.15, 0.4]).into_iter().collect();
    assert!(colors.len() > 300, "{}", colors.len());
}

#[test]
fn the_map_of_stability_shows_what_the_server_answers() {
    let served = Served::start();
    let address = address(&served);
    let url = format!("http://{address}/#vehicle=warthog&view=stability&direction=90&speed=1.2&depth=0.3");
    // the page waits for the answer, and a browser whose time is over does not end
    let patience = "--virtual-time-budget=60000".to_owned();
    let Some(output) = browse(&[patience.clone(), "--dump-dom".into(), url.clone()]) else { return };
    let page = String::from_utf8(output.stdout).expect("text");
    assert!(page.contains("99856 states"), "{}", text_of(&page, "map-state"));
    let place = text_of(&page, "map-place");
    let numbers: Vec<f64> = place
        .replace(" m/s", "")
        .replace(" m", "")
        .split(", ")
        .map(|number| number.parse().expect("a number"))
        .collect();
    // the nearest state of the map is within half a step of what was named
    assert!((numbers[0] - 0.3).abs() < 0.002 && (numbers[1] - 1.2).abs() < 0.02, "{place}");
    let table = &page[page.find("id=\"map-at\"").expect("a table")..];
    for mode in ["floats", "slides", "topples", "steers", "friction needed"] {
        assert!(table.contains(mode), "{mode}");
    }
    // at rest in still air nothing is lost, deep in fast water everything
    let Some(map) = picture_with(&[patience], &url, "stability-1280.png", [1280, 900]) else { return };
    let colors = |x: [f64; 2], y: [f64; 2]| -> BTreeSet<[u8; 3]> { middle(&map, x, y).into_iter().collect() };
    let is_dark = |[r, g, b]: &[u8; 3]| *r < 100 && *g < 40 && *b < 120;
    let is_bright = |[r, g, b]: &[u8; 3]| *r > 230 && *g > 200 && *b < 80;
    assert!(colors([0.06, 0.1], [0.55, 0.62]).iter().all(is_dark), "shallow and slow");
    assert!(colors([0.5, 0.64], [0.1, 0.3]).iter().all(is_bright), "deep and fast");
}

#[test]
fn a_drive_is_drawn_over_time_and_a_client_is_followed() {
    let served = Served::start();
    let address = address(&served);
    let dump = |hash: &str| {
        let url = format!("http://{address}/#{hash}");
        let output = browse(&["--dump-dom".into(), "--window-size=1280,1400".into(), url])?;
        Some(String::from_utf8(output.stdout).expect("text"))
    };
    let Some(page) = dump("vehicle=warthog&view=drive&example=1") else { return };
    assert!(page.contains("generated example: 480 rows"), "{}", text_of(&page, "drive-note"));
    assert!(page.contains("depth [m] over time: depth from 0 to"), "a chart says what it shows");
    let mut client = served.tcp("husky", Method::Stream);
    let (stop, stopped) = std::sync::mpsc::channel::<()>();
    let asking = std::thread::spawn(move || {
        let state = State { velocity: [0.7, 0.0, 0.0], time_step: 0.01, ..State::still(0.16) };
        while stopped
            .recv_timeout(std::time::Duration::from_millis(10))
            .is_err_and(|error| error == std::sync::mpsc::RecvTimeoutError::Timeout)
        {
            client.evaluate(&state).expect("answered");
        }
    });
    let id = loop {
        let list = http::get(address, "/v1/streams").json();
        if let Some(id) = list["streams"][0]["id"].as_u64() {
            break id;
        }
    };
    let page = dump(&format!("vehicle=warthog&view=drive&stream={id}"));
    drop(stop);
    asking.join().expect("no panic");
    let page = page.expect("the browser is there");
    assert!(text_of(&page, "drive-note").starts_with("live: "), "{}", text_of(&page, "drive-note"));
    assert!(page.contains("depth from 0.16 to 0.16"), "the depth that the client states");
    let gone = http::get(address, &format!("/v1/streams/{id}"));
    assert!(gone.status == 404 || gone.status == 200, "{gone:?}");
}

#[test]
fn another_version_is_compared_with_the_one_that_is_served() {
    let vehicles = crate::common::copy_of_vehicles();
    let bundle = vehicles.path().join("husky");
    let effects = crate::common::every_effect("husky");
    let version = wade_core::bundle::apply(&bundle, effects).expect("applied");
    let served = Served::with(|config| config.vehicles = vehicles.path().into());
    let address = address(&served);
    let list = http::get(address, "/v1/vehicles/husky/versions").json();
    assert_eq!(list["versions"][0]["version"], version - 1);
    assert_eq!(list["versions"][1]["served"], true);
    let state = json!({"vehicle": "husky", "depth_m": [0.15], "velocity_mps": [0.8, 0, 0]});
    let of = |version: u32| {
        http::post(address, &format!("/v1/batch?version={version}"), &state.to_string()).json()["force"][0]
            .clone()
    };
    assert_ne!(of(version), of(version - 1), "effects act");
    assert_eq!(of(version), http::post(address, "/v1/batch", &state.to_string()).json()["force"][0]);
    let missing = http::post(address, "/v1/batch?version=77", &state.to_string());
    assert!(missing.status == 404 && missing.body.contains("versions"), "{missing:?}");
    let url =
        format!("http://{address}/#vehicle=husky&speed=0.8&direction=0&depth=0.15&compare={}", version - 1);
    let Some(output) = browse(&["--dump-dom".into(), url]) else { return };
    let page = String::from_utf8(output.stdout).expect("text");
    let before = of(version - 1)[0].as_f64().expect("a number");
    assert_eq!(text_of(&page, "other-force-x"), format!("{before:.2}"));
}

/// What a browser finds wrong with the layout of a page that was written to a file, told in its title.
const LAYOUT: &str = "<script>
const drawn = [...document.querySelectorAll('svg')].map(svg => svg.getBoundingClientRect());
const empty = drawn.filter(box => box.width < 20 || box.height < 5).length;
const beyond = document.documentElement.scrollWidth - window.innerWidth;
document.title = `${drawn.length} pictures, ${empty} empty, ${Math.max(beyond, 0)} beyond the window`;
</script>";

#[test]
fn the_page_of_a_gap_report_says_its_verdict_and_fits_a_window_and_a_telephone() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let trials = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/wading");
    let output = Command::new(env!("CARGO_BIN_EXE_wade"))
        .args(["gap", "--vehicle", "husky", "--trials"])
        .args([trials.as_path(), "--out".as_ref(), folder.path()])
        .env("WADE_VEHICLES", crate::common::vehicles())
        .output()
        .expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report = std::fs::read(folder.path().join("report.json")).expect("written");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    let summary = report["summary"].as_str().expect("a sentence");
    let path = folder.path().join("index.html");
    let text = std::fs::read_to_string(&path).expect("written");
    std::fs::write(&path, text + LAYOUT).expect("written");
    let url = format!("file://{}", path.display());
    for (name, width) in [("gap-1280.png", 1280), ("gap-420.png", 420)] {
        let Some(output) = browse(&["--dump-dom".into(), format!("--window-size={width},2000"), url.clone()])
        else {
            return;
        };
        let page = String::from_utf8(output.stdout).expect("text");
        assert!(page.contains(summary), "{summary}");
        let title = &page[page.find("<title>").expect("a title")..page.find("</title>").expect("a title")];
        let pictures = title.trim_start_matches("<title>").split(' ').next().expect("a number");
        assert!(pictures.parse::<usize>().is_ok_and(|count| count >= 3), "{title}");
        assert!(title.ends_with(", 0 empty, 0 beyond the window"), "{width}: {title}");
        let picture = picture(&url, name, width, 2000).expect("the browser is there");
        let colors: BTreeSet<[u8; 3]> = picture.into_iter().flatten().collect();
        assert!(colors.len() > 30, "a blank picture has few colors: {}", colors.len());
    }
}

/// Widths of a telephone and of a window [px].
const WIDTHS: [usize; 2] = [390, 1400];

/// How far a page reaches beyond a window of this width [px]. The browser's own window cannot be as narrow as a telephone, so
/// the page lies in a frame.
fn beyond(text: &str, name: &str, width: usize) -> Option<i64> {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let told =
        "<script>parent.postMessage(document.documentElement.scrollWidth - window.innerWidth, '*')</script>";
    std::fs::write(folder.path().join("page.html"), format!("{text}{told}")).expect("written");
    let frame = format!(
        "<title>nothing</title><body style='margin:0'><script>onmessage = (e) => {{ document.title = `beyond ${{e.data}}` }}\
         </script><iframe src='page.html' style='border:0;width:{width}px;height:2400px'></iframe>"
    );
    let path = folder.path().join("frame.html");
    std::fs::write(&path, frame).expect("written");
    let url = format!("file://{}", path.display());
    let output = browse(&["--dump-dom".into(), "--window-size=1500,2400".into(), url])?;
    let frame = String::from_utf8(output.stdout).expect("text");
    let title =
        frame.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next()).expect("a title");
    Some(
        title
            .strip_prefix("beyond ")
            .and_then(|number| number.parse().ok())
            .unwrap_or_else(|| panic!("{name}: {title}")),
    )
}

#[test]
fn the_page_and_every_report_fit_a_telephone_and_a_window() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let at = |name: &str| folder.path().join(name).display().to_string();
    let wade = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_wade"))
            .args(arguments)
            .current_dir(root)
            .env("WADE_VEHICLES", crate::common::vehicles())
            .output()
            .expect("the program runs");
        // a busy machine makes the generator of a soak late, and the report says so
        let usual = matches!(output.status.code(), Some(0 | 1));
        assert!(usual, "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    };
    let (soak, gap, data, campaign) = (at("soak"), at("gap"), at("data.html"), at("campaign.html"));
    let load = ["soak", "--vehicle", "husky", "--transport", "inproc", "--warm-up", "10ms", "--out", &soak];
    wade(&[&load[..], &["--duration", "300ms", "--rate", "100,200", "--slo", "p99=1s"]].concat());
    wade(&["gap", "--vehicle", "husky", "--trials", "tests/data/wading", "--out", &gap]);
    wade(&["dataset", "describe", "campaigns/husky/sections.parquet", "--html", &data]);
    wade(&["campaign", "report", "campaigns/husky", "--html", &campaign]);
    let read = |path: &str| std::fs::read_to_string(path).expect(path);
    let served = Served::start();
    let style = read(&root.join("src/service/http/page/style.css").display().to_string());
    let style = format!("<style>{style}</style>");
    let mut pages = Vec::new();
    for (name, hash) in [
        ("page", "speed=0.8&direction=0&depth=0.18"),
        ("page, drive", "view=drive&example=1"),
        ("page, stability", "view=stability"),
    ] {
        let url = format!("http://{}/#vehicle=husky&{hash}", address(&served));
        let (size, patience) = ("--window-size=500,900".into(), "--virtual-time-budget=60000".into());
        let Some(output) = browse(&["--dump-dom".into(), size, patience, url]) else { return };
        // what the page has become, with its look and without its program
        let page = String::from_utf8(output.stdout).expect("text");
        let page = page.replace("<link rel=\"stylesheet\" href=\"/page/style.css\">", &style);
        let page = page.replace("<script type=\"module\" src=\"/page/main.js\"></script>", "");
        assert!(page.contains("<style>") && page.contains("<option value=\"husky\""), "{page}");
        pages.push((name, page));
    }
    let reports = [
        ("soak", read(&format!("{soak}/100hz/soak.html"))),
        ("steps", read(&format!("{soak}/steps.html"))),
        ("gap", read(&format!("{gap}/index.html"))),
        ("dataset", read(&data)),
        ("campaign", read(&campaign)),
    ];
    for (name, text) in pages.into_iter().chain(reports) {
        assert!(!text.contains(">-0.0<") && !text.contains(">-0<"), "{name}: a tick of -0");
        for width in WIDTHS {
            let Some(beyond) = beyond(&text, name, width) else { return };
            assert!(beyond <= 0, "{name}: {beyond} px beyond a window of {width}");
        }
    }
}
