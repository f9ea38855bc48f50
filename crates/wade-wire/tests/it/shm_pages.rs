//! Promise: pages of shared memory that the first commit of layout v4 wrote are read at every later one: each field lies where it
//! lay and means what it meant.
//!
//! `layout.csv` says where each field lies; `set-*.bin` are pages in which every field is set, word `w` of the field in row `r` of
//! its struct to `100 r + w`; `unset-*.bin` are pages in which nothing is set that need not be. Of a batch only the head, the
//! first entry and the first word of the second are kept. What got a meaning later was reserved and is zero in them. They are never written again: a change that fails here breaks clients.

use std::collections::BTreeMap;
use std::mem::offset_of;

use wade_wire::shm::layout::{
    Answer, BatchAnswer, BatchHeader, BatchQuery, EffectAnswer, MAX_BATCH, MAX_EFFECTS, MAX_QUANTITIES,
    MAX_WHEELS, Query, Status, SurfaceAnswer,
};

fn file(name: &str) -> Vec<u8> {
    let path = crate::common::root().join("tests/data/shm/v4").join(name);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Where the fields of a struct lie, in order: name, offset, size.
fn layout() -> BTreeMap<String, Vec<(String, usize, usize)>> {
    let mut structs: BTreeMap<String, Vec<_>> = BTreeMap::new();
    let table = file("layout.csv");
    let mut reader = csv::Reader::from_reader(table.as_slice());
    for row in reader.deserialize::<(String, String, usize, usize)>() {
        let (name, field, offset, size) = row.expect("a row of the table");
        structs.entry(name).or_default().push((field, offset, size));
    }
    structs
}

/// The numbers of a field, by words.
trait Words {
    fn words(&self) -> Vec<f64>;
}

macro_rules! words_of_numbers {
    ($($number:ty),+) => {
        $(impl Words for $number {
            fn words(&self) -> Vec<f64> {
                vec![*self as f64]
            }
        })+
    };
}

words_of_numbers!(u8, u32, u64, f32);

impl<T: Words, const N: usize> Words for [T; N] {
    fn words(&self) -> Vec<f64> {
        self.iter().flat_map(Words::words).collect()
    }
}

macro_rules! words_of_structs {
    ($($name:ident: $($field:ident),+;)+) => {
        $(impl Words for $name {
            fn words(&self) -> Vec<f64> {
                [$(self.$field.words()),+].concat()
            }
        })+

        /// Name, offset, size of the fields that this version has.
        fn places(name: &str) -> Vec<(&'static str, usize, usize)> {
            match name {
                $(stringify!($name) => {
                    fn size<S, T>(_: impl FnOnce(&S) -> &T) -> usize {
                        size_of::<T>()
                    }
                    vec![$((
                        stringify!($field),
                        offset_of!($name, $field),
                        size(|page: &$name| &page.$field),
                    )),+]
                })+
                _ => panic!("no struct {name}"),
            }
        }
    };
}

words_of_structs! {
    Query: sequence, wake_key, session, flags, depth_m, density_kgpm3, velocity_mps, current_mps,
        angular_velocity_radps, acceleration_mps2, angular_acceleration_radps2, gravity_direction, time_step_s,
        heading_rad, depth_rate_mps, water_level_m, bed_clearance_m, bed, wheel_speed_radps, wheel_water_level_m,
        owner, reserved;
    EffectAnswer: effect, left_out, force_n, moment_nm;
    SurfaceAnswer: force_n, point_m, couple_nm, effect_force_n, wetted_fraction;
    Answer: sequence, compute_ns, flags, status, field, problem, bundle_version, surface_count, effect_count, force_n,
        moment_nm, about_m, force_deviation_n, moment_deviation_nm, outside, effects_outside, water_level_m,
        bed_clearance_m, bed, provenance, effects, surfaces, added_mass, damping, wheel_count,
        shaft_power_w, reserved;
    BatchHeader: sequence, wake_key, flags, count, spare, reserved;
    BatchQuery: header, queries;
    BatchAnswer: sequence, compute_ns, flags, status, index, count, spare, reserved, answers;
}

/// A page as this version reads it. What was not kept of it is zero.
#[allow(unsafe_code, reason = "reads bytes as the other process does")]
fn page<T: Copy + Words>(name: &str) -> Box<T> {
    let bytes = file(name);
    let mut page = Box::<T>::new_zeroed();
    assert!(bytes.len() <= size_of::<T>(), "{name} is too long");
    // SAFETY: the box has room for as many bytes; the structs hold numbers alone, for which every bit pattern is a value.
    unsafe {
        std::ptr::copy_nonoverlapping(bytes.as_ptr(), page.as_mut_ptr().cast(), bytes.len());
        page.assume_init()
    }
}

#[test]
fn every_field_lies_where_it_lay() {
    for (name, fields) in layout() {
        let ours = places(&name);
        let reserved = |field: &str| matches!(field, "reserved" | "spare");
        for (field, offset, size) in fields.iter().filter(|(field, ..)| !reserved(field)) {
            let now = ours.iter().find(|(ours, ..)| ours == field);
            assert_eq!(now, Some(&(field.as_str(), *offset, *size)), "{name}.{field}");
        }
    }
    let sizes = [size_of::<Query>(), size_of::<Answer>(), size_of::<BatchQuery>(), size_of::<BatchAnswer>()];
    assert_eq!(sizes, [328, 5080, 84_128, 1_300_648]);
}

/// What a field of a page says, without what has a meaning of its own.
fn fields<T: Words>(name: &str, page: &T, rows: &[(&str, Vec<f64>)]) {
    let whole: Vec<f64> = rows.iter().flat_map(|(_, words)| words.clone()).collect();
    assert_eq!(format!("{whole:?}"), format!("{:?}", page.words()), "{name}: the rows are the page");
    for (row, (field, words)) in rows.iter().enumerate() {
        let expected: Vec<f64> = match *field {
            "reserved" | "spare" => vec![0.0; words.len()],
            // reserved on the first day
            "owner" | "wheel_count" | "shaft_power_w" => vec![0.0; words.len()],
            // a text, not a number
            "provenance" => {
                let mut text = b"the first page of v4".map(f64::from).to_vec();
                text.resize(words.len(), 0.0);
                text
            }
            _ => (0..words.len()).map(|word| (100 * row + word) as f64).collect(),
        };
        assert_eq!(words, &expected, "{name}.{field}");
    }
}

macro_rules! rows {
    ($page:expr; $($field:ident),+ $(,)?) => { [$((stringify!($field), $page.$field.words())),+] };
}

fn is_a_set_query(name: &str, query: &Query) {
    let rows = rows!(query; sequence, wake_key, session, flags, depth_m, density_kgpm3, velocity_mps, current_mps,
        angular_velocity_radps, acceleration_mps2, angular_acceleration_radps2, gravity_direction, time_step_s,
        heading_rad, depth_rate_mps, water_level_m, bed_clearance_m, bed, wheel_speed_radps, wheel_water_level_m,
        owner, reserved);
    fields(name, query, &rows);
}

fn is_a_set_answer(name: &str, answer: &Answer) {
    let rows = rows!(answer; sequence, compute_ns, flags, status, field, problem, bundle_version, surface_count,
        effect_count, force_n, moment_nm, about_m, force_deviation_n, moment_deviation_nm, outside, effects_outside,
        water_level_m, bed_clearance_m, bed, provenance, effects, surfaces, added_mass, damping, wheel_count,
        shaft_power_w, reserved);
    fields(name, answer, &rows);
    assert_eq!(answer.provenance(), "the first page of v4");
}

#[test]
fn every_field_of_a_page_says_what_it_said() {
    is_a_set_query("query", &page("set-query.bin"));
    is_a_set_answer("answer", &page("set-answer.bin"));
    let batch = page::<BatchQuery>("set-batch-query.bin");
    let header = &batch.header;
    let rows = rows!(header; sequence, wake_key, flags, count, spare, reserved);
    fields("batch header", header, &rows);
    is_a_set_query("query of a batch", &batch.queries[0]);
    assert_eq!((batch.queries[1].sequence, MAX_BATCH), (1, 256));
    let batch = page::<BatchAnswer>("set-batch-answer.bin");
    let head = rows!(batch; sequence, compute_ns, flags, status, index, count, spare, reserved);
    for (row, (field, words)) in head.iter().enumerate() {
        let expected = if matches!(*field, "spare" | "reserved") { 0 } else { 100 * row };
        assert!(words.iter().all(|&word| word == expected as f64), "batch answer: {field}: {words:?}");
    }
    is_a_set_answer("answer of a batch", &batch.answers[0]);
    assert_eq!(batch.answers[1].sequence, 1);
}

#[test]
fn what_is_not_set_is_nan_or_has_no_flag() {
    let query = page::<Query>("unset-query.bin");
    assert_eq!((query.sequence, query.wake_key, query.session, query.flags), (7, 0, 0, 0));
    assert_eq!((query.depth_m, query.density_kgpm3, query.velocity_mps), (0.15, 1000.0, [0.5, 0.0, 0.0]));
    assert_eq!((query.gravity_direction, query.time_step_s), ([0.0, 0.0, -1.0], 0.0));
    let single =
        [query.heading_rad, query.depth_rate_mps, query.water_level_m, query.bed_clearance_m, query.bed];
    assert!(single.iter().all(|value| value.is_nan()), "{single:?}");
    assert!(query.wheel_speed_radps.iter().chain(&query.wheel_water_level_m).all(|value| value.is_nan()));
    assert_eq!(query.wheel_speed_radps.len(), MAX_WHEELS);
    assert!(query.state().is_ok());

    // two surfaces and one effect, of a model that has nothing of what came after it
    let answer = page::<Answer>("unset-answer.bin");
    assert_eq!((answer.status, answer.flags, answer.bundle_version), (Status::Ok as u32, 0, 3));
    assert_eq!((answer.surfaces().len(), answer.effects().len()), (2, 1));
    assert_eq!((answer.force_n, answer.force_deviation_n), ([1.0, 2.0, 3.0], [0.5; 3]));
    assert_eq!((answer.surfaces[1].force_n, answer.surfaces[1].wetted_fraction), ([1.0; 3], 0.25));
    assert_eq!((answer.effects[0].effect, answer.effects[0].force_n), (2, [0.125; 3]));
    assert!(!answer.is_outside() && answer.outside[8..].iter().all(|excess| excess.is_nan()));
    assert_eq!((answer.outside().excess, answer.effects_outside()), ([0.0; 8], [0.0; 5]));
    assert_eq!((answer.outside.len(), answer.effects.len()), (MAX_QUANTITIES, MAX_EFFECTS));
    let unset =
        [answer.moment_deviation_nm.words(), answer.added_mass.words(), answer.damping.words()].concat();
    assert!(unset.iter().all(|word| word.is_nan()), "{unset:?}");
    // the zeros of bytes that were reserved are no power
    assert!(answer.shaft_power().is_nan() && answer.shaft_power_w == 0.0);
    assert!([answer.water_level_m, answer.bed_clearance_m, answer.bed].iter().all(|value| value.is_nan()));
    let couples = answer.surfaces.iter().flat_map(|surface| surface.couple_nm);
    assert!(couples.into_iter().all(f32::is_nan));
    assert!(answer.surfaces[2..].iter().flat_map(Words::words).all(f64::is_nan));
}
