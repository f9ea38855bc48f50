//! Time of a query in process, by vehicle and instruction set, beside its controls from the same run: what the core can
//! do at most, the plain-loop reference, and an empty measurement. Nothing here fails on a time.
//!
//! `cargo bench --bench query [-- --out benches/results]` prints a table, and writes it as CSV with machine and commit.
#![allow(unsafe_code, reason = "the peak of the core is measured behind a CPU check")]

use std::fmt::Write;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use hdrhistogram::Histogram;
use wade::bundle;
use wade::condition::Condition;
use wade::features;
use wade::forces::Forces;
use wade::frame::{Vec3, WaterPlane, up_from_roll_pitch};
use wade::geometry::hydrostatics::hydrostatics;
use wade::model::kernel::Isa;
use wade::model::network::WIDTH;
use wade::model::{Model, Workspace};

/// Each subject is measured in this many turns, one after the other, so that a drift of the machine meets all.
const TURNS: usize = 10;
/// Length of a turn.
const TURN: Duration = Duration::from_millis(300);

/// A row of the table.
struct Row {
    subject: String,
    histogram: Histogram<u64>,
    /// Multiply-adds of layer 2, where the subject has one.
    multiply_adds: u64,
}

impl Row {
    fn new(subject: impl Into<String>, multiply_adds: u64) -> Self {
        let histogram = Histogram::new_with_bounds(1, 1_000_000_000, 3).expect("valid bounds");
        Self { subject: subject.into(), histogram, multiply_adds }
    }

    fn us(&self, quantile: f64) -> f64 {
        self.histogram.value_at_quantile(quantile) as f64 * 1e-3
    }
}

/// Times each call of `work` for one turn.
fn turn(row: &mut Row, work: &mut dyn FnMut()) {
    let end = Instant::now() + TURN;
    loop {
        let start = Instant::now();
        work();
        let now = Instant::now();
        row.histogram.saturating_record((now - start).as_nanos() as u64);
        if now >= end {
            break;
        }
    }
}

fn model(vehicle: &str, isa: Isa) -> Model {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("vehicles").join(vehicle);
    bundle::load(&path, isa).expect("the shipped bundles are sound")
}

/// Deep enough that every surface is wet.
fn all_wet(model: &Model) -> Condition {
    let condition = Condition::level(Vec3::new(0.6, 0.2, 0.0), 0.95 * model.vehicle().dimensions.height);
    let mut forces = Forces::default();
    model.evaluate(&condition, &mut Workspace::new(), &mut forces);
    assert!(forces.surfaces.iter().all(|load| load.wetted_fraction > 0.0), "every surface is wet");
    condition
}

fn layer2(model: &Model) -> u64 {
    (model.vehicle().surfaces.len() * WIDTH * WIDTH) as u64
}

/// The reference network over every surface's row.
fn reference(model: &Model, condition: &Condition) -> f32 {
    let (vehicle, weights) = (model.vehicle(), model.weights());
    let plane = condition.water_plane(vehicle.z0);
    let global = weights.scaling.standardize(&features::global(condition, &vehicle.dimensions));
    let direction = features::direction(&condition.velocity);
    let rows = vehicle.surfaces.iter().zip(&vehicle.samples.surfaces).map(|(surface, samples)| {
        let wet = samples.submergence(&plane);
        let mut row = [0.0; features::INPUTS];
        let fixed = features::surface_static(surface, &vehicle.dimensions).map(|x| x as f32);
        let dynamic =
            features::surface_dynamic(surface, &wet, &direction, &vehicle.dimensions).map(|x| x as f32);
        row[..features::STATIC].copy_from_slice(&fixed);
        row[features::STATIC..features::STATIC + features::DYNAMIC].copy_from_slice(&dynamic);
        row[features::STATIC + features::DYNAMIC..].copy_from_slice(&global);
        weights.network.forward(&row)[2]
    });
    rows.sum()
}

/// Rounds of twelve independent vector multiply-adds on registers alone: what the core can do at most.
#[cfg(target_arch = "x86_64")]
mod peak {
    use std::arch::x86_64::{
        _mm256_add_ps, _mm256_cvtss_f32, _mm256_fmadd_ps, _mm256_set1_ps, _mm512_add_ps, _mm512_cvtss_f32,
        _mm512_fmadd_ps, _mm512_set1_ps,
    };
    use std::hint::black_box;

    macro_rules! peak {
        ($name:ident, $features:literal, $set:ident, $fma:ident, $add:ident, $first:ident) => {
            #[target_feature(enable = $features)]
            pub fn $name(rounds: usize) -> f32 {
                let (a, b) = ($set(black_box(0.999)), $set(black_box(1e-3)));
                let mut sums = [$set(1.0); 12];
                for _ in 0..rounds {
                    for sum in &mut sums {
                        *sum = $fma(*sum, a, b);
                    }
                }
                $first(sums.into_iter().reduce(|x, y| $add(x, y)).unwrap_or(a))
            }
        };
    }

    peak!(avx512, "avx512f", _mm512_set1_ps, _mm512_fmadd_ps, _mm512_add_ps, _mm512_cvtss_f32);
    peak!(avx2, "avx2,fma", _mm256_set1_ps, _mm256_fmadd_ps, _mm256_add_ps, _mm256_cvtss_f32);
}

/// Multiply-adds a second on this core [1/s], the best of many short runs; NaN where there is no kernel by hand.
fn peak() -> f64 {
    const ROUNDS: usize = 20_000;
    #[cfg(target_arch = "x86_64")]
    let (lanes, run): (usize, fn(usize) -> f32) = match Isa::available()[0].name() {
        // SAFETY: `Isa::available` found the CPU features.
        "avx512" => (16, |rounds| unsafe { peak::avx512(rounds) }),
        // SAFETY: as above.
        "avx2+fma" => (8, |rounds| unsafe { peak::avx2(rounds) }),
        _ => return f64::NAN,
    };
    #[cfg(not(target_arch = "x86_64"))]
    let (lanes, run): (usize, fn(usize) -> f32) = return f64::NAN;
    let times = (0..100).map(|_| {
        let start = Instant::now();
        black_box(run(ROUNDS));
        (ROUNDS * 12 * lanes) as f64 / start.elapsed().as_secs_f64()
    });
    times.fold(0.0, f64::max)
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let out =
        arguments.iter().position(|a| a == "--out").and_then(|i| arguments.get(i + 1)).map(PathBuf::from);
    let mut subjects: Vec<(Row, Box<dyn FnMut()>)> = vec![(Row::new("nothing", 0), Box::new(|| ()))];
    for vehicle in ["husky", "warthog"] {
        for isa in Isa::available() {
            let model = model(vehicle, isa);
            let (condition, multiply_adds) = (all_wet(&model), layer2(&model));
            let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
            let work = move || model.evaluate(black_box(&condition), &mut workspace, &mut forces);
            subjects
                .push((Row::new(format!("{vehicle} query {}", isa.name()), multiply_adds), Box::new(work)));
        }
        let isa = Isa::available()[0];
        let tilted = model(vehicle, isa);
        let condition = Condition { up: up_from_roll_pitch(0.02, 0.05), ..all_wet(&tilted) };
        let multiply_adds = layer2(&tilted);
        let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
        let work = move || tilted.evaluate(black_box(&condition), &mut workspace, &mut forces);
        subjects.push((
            Row::new(format!("{vehicle} query {} tilted", isa.name()), multiply_adds),
            Box::new(work),
        ));

        let batch = model(vehicle, isa);
        let condition = all_wet(&batch);
        let multiply_adds = 256 * layer2(&batch);
        let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
        let work = move || {
            for _ in 0..256 {
                batch.evaluate(black_box(&condition), &mut workspace, &mut forces);
            }
        };
        subjects
            .push((Row::new(format!("{vehicle} 256 queries {}", isa.name()), multiply_adds), Box::new(work)));

        let plain = model(vehicle, isa);
        let condition = all_wet(&plain);
        let multiply_adds = layer2(&plain);
        let work = move || {
            black_box(reference(&plain, black_box(&condition)));
        };
        subjects.push((Row::new(format!("{vehicle} reference"), multiply_adds), Box::new(work)));

        let wet = model(vehicle, isa);
        let level = WaterPlane::level(wet.vehicle().z0, 0.5 * wet.vehicle().dimensions.height);
        let tilted = WaterPlane { normal: up_from_roll_pitch(0.05, 0.1), ..level };
        for (name, plane) in [("level", level), ("tilted", tilted)] {
            let samples = wet.vehicle().samples.clone();
            let work = move || {
                for surface in &samples.surfaces {
                    black_box(surface.submergence(black_box(&plane)));
                }
            };
            subjects.push((Row::new(format!("{vehicle} submergence {name}"), 0), Box::new(work)));
        }
        let work = move || {
            let vehicle = wet.vehicle();
            black_box(hydrostatics(&vehicle.hull.mesh, black_box(&level), 1000.0, &vehicle.center_of_mass));
        };
        subjects.push((Row::new(format!("{vehicle} exact hydrostatics"), 0), Box::new(work)));
    }
    for _ in 0..TURNS {
        for (row, work) in &mut subjects {
            turn(row, work.as_mut());
        }
    }
    let peak = peak();
    let mut csv = String::from(
        "subject,count,p50_us,p99_us,p99_9_us,max_us,dense_share_of_peak,multiply_adds_per_s_peak\n",
    );
    println!(
        "dense / peak: layer 2 as if no input were left out, against the peak of the core in the same run"
    );
    println!("peak of the core: {:.1} GFLOP/s in single precision", 2e-9 * peak);
    println!(
        "{:<30} {:>10} {:>10} {:>10} {:>14}",
        "subject", "p50 [us]", "p99 [us]", "p99.9 [us]", "dense / peak"
    );
    for (row, _) in &subjects {
        let share = row.multiply_adds as f64 / (row.us(0.5) * 1e-6) / peak;
        let shown = if row.multiply_adds == 0 { String::new() } else { format!("{:.1} %", 100.0 * share) };
        let (p50, p99, p99_9) = (row.us(0.5), row.us(0.99), row.us(0.999));
        println!("{:<30} {p50:>10.2} {p99:>10.2} {p99_9:>10.2} {shown:>14}", row.subject);
        let max = row.us(1.0);
        let count = row.histogram.len();
        // writing to a String cannot fail
        let _ = writeln!(
            csv,
            "{},{count},{p50:.3},{p99:.3},{p99_9:.3},{max:.3},{share:.4},{peak:.4e}",
            row.subject
        );
    }
    if let Some(folder) = out {
        write(&folder, &csv);
    }
}

fn write(folder: &std::path::Path, csv: &str) {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs() / 86_400;
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu =
        cpu.lines().find_map(|line| line.strip_prefix("model name\t: ")).unwrap_or("unknown").to_owned();
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let header = format!("# commit {}, {cpu}, {cores} cores, day {days} since 1970\n", env!("WADE_COMMIT"));
    let path = folder.join("query.csv");
    std::fs::create_dir_all(folder).expect("the folder");
    std::fs::write(&path, header + csv).expect("the table");
    println!("{}", path.display());
}
