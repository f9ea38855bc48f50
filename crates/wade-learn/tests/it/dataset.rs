//! Promise: a data set is read as it was written, a bad one is refused with what is wrong, mirror images obey the
//! physics, and no split but the one by sample has a case on both sides.

#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use parquet::basic::Encoding;
use parquet::data_type::{ByteArray, ByteArrayType};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use proptest::prelude::*;
use tempfile::TempDir;
use wade_core::condition::{Condition, GroundContact};
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_core::vehicle::{Vehicle, shipped};
use wade_learn::dataset::lift::{Cause, Lift, Question, questions};
use wade_learn::dataset::mirror::{MirrorError, Partners, Plane, augment};
use wade_learn::dataset::split::{By, Split, SplitError, split};
use wade_learn::dataset::summary::Summary;
use wade_learn::dataset::{self, Dataset, Fault, Flaw, Image, MergeError, Meta, Rest, Sample, analytic};
use wade_learn::parameter_table::ParameterTable;
use wade_learn::random::Random;

fn warthog() -> &'static Vehicle {
    static VEHICLE: OnceLock<Vehicle> = OnceLock::new();
    VEHICLE.get_or_init(|| shipped::warthog().unwrap().vehicle().unwrap())
}

fn husky() -> &'static Vehicle {
    static VEHICLE: OnceLock<Vehicle> = OnceLock::new();
    VEHICLE.get_or_init(|| shipped::husky().unwrap().vehicle().unwrap())
}

fn vehicles() -> BTreeMap<String, Vehicle> {
    [husky(), warthog()].map(|vehicle| (vehicle.name.clone(), vehicle.clone())).into()
}

fn names(vehicle: &Vehicle) -> Vec<String> {
    vehicle.surfaces.iter().map(|surface| surface.name.clone()).collect()
}

/// The analytic loads of the paper's plan, two sections a case.
fn data(cases: usize) -> Dataset {
    let mut random = Random::new(1);
    let mut samples = Vec::new();
    for (vehicle, table) in [(husky(), ParameterTable::HUSKY), (warthog(), ParameterTable::WARTHOG)] {
        let steady = analytic::samples(vehicle, "paper", &table.latin_hypercube(cases, &mut random));
        samples.extend(steady.iter().cloned().map(|s| Sample { start_s: 2.0, end_s: 2.1, ..s }));
        samples.extend(steady.into_iter().map(|s| Sample { section: 1, start_s: 2.1, end_s: 2.2, ..s }));
    }
    let meta = Meta {
        provenance: "analytic".into(),
        ground_contact: GroundContact::Wetted,
        vehicles: [husky(), warthog()].map(|vehicle| (vehicle.name.clone(), names(vehicle))).into(),
        notes: BTreeMap::from([("a \"note\"".into(), "with ünicode".into())]),
    };
    Dataset { meta, samples }
}

/// As the file holds it: loads in single precision.
fn rounded(mut data: Dataset) -> Dataset {
    let single = |v: &mut Vec3| *v = v.map(|x| f64::from(x as f32));
    for load in data.samples.iter_mut().flat_map(|sample| &mut sample.surfaces) {
        single(&mut load.force);
        [&mut load.moment, &mut load.viscous].into_iter().flatten().for_each(single);
        load.rest.iter_mut().for_each(|rest| {
            single(&mut rest.force);
            single(&mut rest.moment);
        });
    }
    data
}

#[test]
fn a_data_set_is_read_as_it_was_written() {
    let mut data = data(5);
    data.samples[3].surfaces[2].moment = Some(Vec3::new(1.5, -2.0, 0.1));
    data.samples[3].surfaces[2].viscous = Some(Vec3::new(1e-6, 0.0, -3.0));
    data.samples[4].surfaces[1].rest = None;
    data.samples[5].condition.up = up_from_roll_pitch(0.1, -0.2);
    data.samples[5].condition.angular_velocity = Vec3::new(0.1, 0.2, 0.3);
    data.samples[5].condition.angular_acceleration = Vec3::new(-0.1, 0.2, 0.3);
    data.samples[5].condition.acceleration = Vec3::new(1.0, 2.0, 3.0);
    data.samples[5].condition.ground_velocity = Vec3::new(0.0, 0.5, 0.0);
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("data.parquet");
    dataset::write(&path, &data).unwrap();
    assert_eq!(dataset::read(&path).unwrap(), rounded(data));
}

#[test]
fn a_tilted_hull_over_a_far_bed_is_read_as_it_was_written_and_the_others_keep_their_bytes() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("data.parquet");
    let format = |path: &PathBuf| {
        let bytes = fs::read(path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let at = text.rfind("wade.format").unwrap();
        (text.contains("bed_clearance_m"), text[at..].chars().find(char::is_ascii_digit).unwrap())
    };
    let mut data = data(2);
    dataset::write(&path, &data).unwrap();
    assert_eq!(format(&path), (false, '1'));
    data.samples[1].condition.depth = -0.02;
    data.samples[1].condition.bed_clearance = Some(0.3);
    dataset::write(&path, &data).unwrap();
    assert_eq!(format(&path), (true, '2'));
    assert_eq!(dataset::read(&path).unwrap(), rounded(data));
}

#[test]
fn nothing_is_written_for_a_bad_data_set_and_what_was_there_stays() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("data.parquet");
    dataset::write(&path, &data(2)).unwrap();
    let before = fs::read(&path).unwrap();
    let spoilt = |spoil: &dyn Fn(&mut Dataset)| {
        let mut data = data(2);
        spoil(&mut data);
        let error = dataset::write(&path, &data).unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "a temporary file is left");
        match error.fault {
            Fault::Flaw(flaw) => flaw,
            other => panic!("{other}"),
        }
    };
    let flaw = spoilt(&|data| data.samples[1].surfaces[0].force.y = f64::NAN);
    assert!(
        matches!(&flaw, Flaw::Number { quantity, .. } if quantity == "a load on `front_lower`"),
        "{flaw}"
    );
    let flaw = spoilt(&|data| data.samples[1].condition.velocity.x = f64::INFINITY);
    assert!(matches!(&flaw, Flaw::Number { quantity, .. } if quantity == "velocity"), "{flaw}");
    let flaw = spoilt(&|data| data.samples[1].condition.density = 0.0);
    assert!(matches!(&flaw, Flaw::Number { quantity, .. } if quantity == "density"), "{flaw}");
    let flaw = spoilt(&|data| data.samples[1].condition.bed_clearance = Some(-0.1));
    assert!(matches!(&flaw, Flaw::Number { quantity, .. } if quantity == "bed clearance"), "{flaw}");
    assert!(matches!(spoilt(&|data| data.samples.clear()), Flaw::Empty));
    let flaw = spoilt(&|data| _ = data.samples[0].surfaces.pop());
    assert!(matches!(flaw, Flaw::SurfaceCount { found: 12, expected: 13, .. }), "{flaw}");
    let flaw = spoilt(&|data| data.samples[7].case = data.samples[0].case.clone());
    assert!(
        matches!(&flaw, Flaw::MixedVehicles { vehicles, .. } if vehicles == &["husky", "warthog"]),
        "{flaw}"
    );
    let flaw = spoilt(&|data| data.samples[2].section = 0);
    assert!(matches!(flaw, Flaw::Duplicate { section: 0, .. }), "{flaw}");
    let flaw = spoilt(&|data| _ = data.meta.vehicles.remove("warthog"));
    assert!(matches!(&flaw, Flaw::UnknownVehicle { vehicle, .. } if vehicle == "warthog"), "{flaw}");
    let flaw = spoilt(&|data| data.samples[2].condition.ground_contact = GroundContact::Dry);
    assert!(matches!(flaw, Flaw::GroundContact { .. }), "{flaw}");
}

#[test]
fn a_load_that_the_file_cannot_hold_is_refused_before_anything_is_written() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("data.parquet");
    let mut largest = data(2);
    largest.samples[1].surfaces[0].force.z = f64::from(f32::MAX);
    dataset::write(&path, &largest).unwrap();
    assert_eq!(dataset::read(&path).unwrap().samples[1].surfaces[0].force.z, f64::from(f32::MAX));
    let before = fs::read(&path).unwrap();
    let refused = |spoil: &dyn Fn(&mut dataset::SurfaceLoad)| {
        let mut data = data(2);
        spoil(&mut data.samples[1].surfaces[0]);
        let error = dataset::write(&path, &data).unwrap_err().to_string();
        assert_eq!(fs::read(&path).unwrap(), before);
        error
    };
    let error = refused(&|load| load.force.z = 1e39);
    let expected = "data.parquet: case `husky-0001`, section 0, surface `front_lower`: fz_n is 1e39, beyond";
    assert!(error.contains(expected), "{error}");
    let error = refused(&|load| load.moment = Some(Vec3::new(0.0, -1e300, 0.0)));
    assert!(error.contains("surface `front_lower`: my_nm is -1e300"), "{error}");
    let rest = Rest { force: Vec3::zeros(), moment: Vec3::new(0.0, 0.0, 1e300) };
    let error = refused(&|load| load.rest = Some(rest));
    assert!(error.contains("surface `front_lower`: rest_mz_nm is 1e300"), "{error}");
}

/// A file that pandas wrote; tests/data/README.md says how.
fn by_pandas(name: &str) -> PathBuf {
    crate::common::root().join("tests/data/parquet").join(name).with_extension("parquet")
}

#[test]
fn what_pandas_wrote_back_is_the_same_data_set() {
    let mut random = Random::new(4);
    let states = ParameterTable::HUSKY.latin_hypercube(2, &mut random.fork());
    let mut expected =
        rounded(Dataset { samples: analytic::samples(husky(), "paper", &states), ..data(1) }).samples;
    // its rows stand in reverse, and samples are in the order of their first row
    expected.reverse();
    let read = dataset::read(&by_pandas("rewritten")).unwrap();
    assert_eq!(read.samples.len(), 2);
    for (a, b) in read.samples.iter().zip(&expected) {
        assert_eq!((&a.case, a.condition), (&b.case, b.condition));
        for (a, b) in a.surfaces.iter().zip(&b.surfaces) {
            assert!((a.force - b.force).norm() <= 1e-6 * b.force.norm() && a.moment.is_none(), "{a:?} {b:?}");
        }
    }
}

#[test]
fn a_bad_file_is_refused_with_its_column_and_row() {
    for (name, expected) in [
        ("missing-column", "column ground_vy_mps is missing"),
        ("nan", "column fx_n, row 17: NaN is not finite"),
        ("differs", "column depth_m, row 9: differs from the other rows of case `husky-0000`"),
        ("unknown-surface", "column surface, row 4: vehicle `husky` has no surface `fin`"),
        ("missing-row", "case `husky-0001`, section 0, image original: there is no row for surface `right`"),
        ("text-for-number", "column vx_mps is BYTE_ARRAY, which is not a number"),
        ("unknown-image", "column image, row 3: `rotated` is not original, left_right, front_rear or both"),
        ("newer", "format 3 is newer than 2, the newest that this program reads: update wade"),
        ("no-meta", "no key `wade.format`"),
    ] {
        let error = dataset::read(&by_pandas(name)).unwrap_err().to_string();
        assert!(error.contains(&format!("{name}.parquet: ")) && error.contains(expected), "{error}");
    }
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    let whole = fs::read(by_pandas("rewritten")).unwrap();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cut.parquet");
    for share in 0..20 {
        fs::write(&path, &whole[..whole.len() * share / 20]).unwrap();
        let error = dataset::read(&path).unwrap_err();
        assert!(matches!(error.fault, Fault::Parquet(_)), "{error}");
    }
    let missing = dataset::read(&folder.path().join("none.parquet")).unwrap_err();
    assert!(matches!(missing.fault, Fault::Io(_)), "{missing}");
}

/// A file with our meta data and the column `vehicle` alone, three names in it.
fn one_column(encoding: Option<Encoding>) -> Vec<u8> {
    let schema = "message data { REQUIRED BINARY vehicle (STRING); }";
    let mut properties = WriterProperties::builder().set_key_value_metadata(Some(
        [
            ("wade.format", "1"),
            ("wade.meta", r#"{"provenance":"analytic","ground_contact":"wetted","vehicles":{}}"#),
        ]
        .map(|(key, value)| KeyValue::new(key.into(), value.to_owned()))
        .into(),
    ));
    if let Some(encoding) = encoding {
        properties = properties.set_dictionary_enabled(false).set_encoding(encoding);
    }
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut file = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties.build())).unwrap();
    let mut group = file.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let names = ["husky", "warthog", "other"].map(ByteArray::from);
    column.typed::<ByteArrayType>().write_batch(&names, None, None).unwrap();
    column.close().unwrap();
    group.close().unwrap();
    file.into_inner().unwrap()
}

#[test]
fn a_page_that_claims_more_than_its_bytes_hold_is_refused_before_room_is_made_for_it() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("claims.parquet");
    let refused = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        dataset::read(&path).unwrap_err().to_string()
    };
    // the dictionary of `one_column`: kind 2, its sizes, and as the first field of the seventh its number of values
    let whole = one_column(None);
    assert!(refused(&whole).contains("column case is missing"), "{}", refused(&whole));
    assert_eq!(whole[4..7], [0x15, 4, 0x15]);
    let count = 4 + whole[4..].windows(3).position(|bytes| bytes == [0x4c, 0x15, 6]).unwrap() + 2;
    // 2^30 as a number of Thrift's takes five bytes
    let huge = [0x80, 0x80, 0x80, 0x80, 0x08];
    let with = |place: usize| [&whole[..place], &huge, &whole[place + 1..]].concat();
    let error = refused(&with(count));
    assert!(error.contains("a dictionary of 1073741824 values in bytes for at most"), "{error}");
    let error = refused(&with(7));
    assert!(error.contains("the page at byte 4 says 1073741824 bytes, at most"), "{error}");
    for encoding in [Encoding::DELTA_LENGTH_BYTE_ARRAY, Encoding::DELTA_BYTE_ARRAY] {
        let error = refused(&one_column(Some(encoding)));
        assert!(error.contains(&format!("the encoding {encoding} is not read")), "{error}");
    }
}

#[test]
fn a_file_that_is_damaged_anywhere_is_an_error_and_no_panic() {
    let whole = fs::read(by_pandas("rewritten")).unwrap();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("damaged.parquet");
    let damaged = |place: usize| {
        let mut bytes = whole.clone();
        bytes[place] ^= 1;
        fs::write(&path, bytes).unwrap();
        dataset::read(&path)
    };
    // the encoding of a page and the length of a column, over which the reader of Parquet panics
    for place in [915, 5482] {
        let error = damaged(place).unwrap_err();
        assert!(matches!(error.fault, Fault::Damaged { .. } | Fault::Parquet(_)), "{place}: {error}");
        assert!(error.to_string().contains("damaged.parquet: "), "{place}: {error}");
    }
    // not every byte matters: some are statistics, or of the program that wrote the file
    let refused = (4..whole.len() - 8).step_by(16).filter(|&place| damaged(place).is_err()).count();
    assert!(refused > 100, "{refused}");
}

/// Any state and loads of a vehicle.
fn sample(vehicle: &'static Vehicle) -> impl Strategy<Value = Sample> {
    let vector = || prop::array::uniform3(-3.0..3.0_f64).prop_map(Vec3::from);
    let angle = || -0.3..0.3_f64;
    let states = (vector(), vector(), vector(), vector(), vector(), angle(), angle(), 0.0..0.4_f64);
    let loads =
        prop::collection::vec((vector(), vector(), vector(), vector(), vector()), vehicle.surfaces.len());
    (states, loads).prop_map(|((v, ground, omega, a, alpha, roll, pitch, depth), loads)| {
        let condition = Condition {
            ground_velocity: ground,
            angular_velocity: omega,
            acceleration: a,
            angular_acceleration: alpha,
            up: up_from_roll_pitch(roll, pitch),
            ..Condition::level(v, depth)
        };
        let mut sample = analytic::samples(vehicle, "any", &[condition]).remove(0);
        for (load, (force, moment, viscous, rest_force, rest_moment)) in sample.surfaces.iter_mut().zip(loads)
        {
            let rest = Some(Rest { force: rest_force, moment: rest_moment });
            *load = dataset::SurfaceLoad { force, moment: Some(moment), viscous: Some(viscous), rest };
        }
        sample
    })
}

fn planes(vehicle: &Vehicle) -> [Partners; 2] {
    [Plane::LeftRight, Plane::FrontRear].map(|plane| Partners::new(plane, vehicle, &names(vehicle)).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_mirror_image_of_a_mirror_image_is_the_original(sample in sample(warthog())) {
        for partners in planes(warthog()) {
            let image = partners.reflect(&sample);
            prop_assert_ne!(image.image, sample.image);
            prop_assert_eq!(partners.reflect(&image), sample.clone());
        }
        let [left_right, front_rear] = planes(warthog());
        let both = front_rear.reflect(&left_right.reflect(&sample));
        prop_assert_eq!(both.image, Image::Both);
        prop_assert_eq!(left_right.reflect(&front_rear.reflect(&sample)), both);
    }

    /// The loads at rest come with moments, and a tilted hull has all six components.
    #[test]
    fn on_a_symmetric_hull_the_image_of_the_loads_is_the_load_of_the_image(
        v in prop::array::uniform3(-1.0..1.0_f64), roll in -0.2..0.2_f64, pitch in -0.2..0.2_f64, depth in 0.05..0.25_f64,
    ) {
        let state = Condition { up: up_from_roll_pitch(roll, pitch), ..Condition::level(v.into(), depth) };
        let sample = analytic::samples(husky(), "any", &[state]).remove(0);
        for partners in planes(husky()) {
            let image = partners.reflect(&sample);
            let computed = analytic::samples(husky(), "any", &[image.condition]).remove(0);
            for (index, (a, b)) in image.surfaces.iter().zip(&computed.surfaces).enumerate() {
                let close = |a: Vec3, b: Vec3| (a - b).norm() < 1e-9 + 1e-9 * b.norm();
                let (rest, expected) = (a.rest.unwrap(), b.rest.unwrap());
                prop_assert!(close(a.force, b.force), "{index} {} {}", a.force, b.force);
                prop_assert!(close(rest.force, expected.force), "{index} {rest:?} {expected:?}");
                prop_assert!(close(rest.moment, expected.moment), "{index} {rest:?} {expected:?}");
            }
        }
    }
}

#[test]
fn images_are_added_where_the_hull_is_symmetric_or_on_request() {
    let count = |data: &Dataset, vehicle: &str, image: Image| {
        data.samples.iter().filter(|s| s.vehicle == vehicle && s.image == image).count()
    };
    let original = data(3);
    let careful = augment(&original, &vehicles(), false).unwrap();
    careful.check().unwrap();
    let as_published = augment(&original, &vehicles(), true).unwrap();
    as_published.check().unwrap();
    for image in Image::ALL {
        let lateral = matches!(image, Image::Original | Image::LeftRight);
        assert_eq!(count(&careful, "husky", image), 6);
        assert_eq!(count(&careful, "warthog", image), if lateral { 6 } else { 0 });
        assert_eq!(count(&as_published, "warthog", image), 6);
    }
    assert!(as_published.meta.notes.contains_key("augmentation of warthog"), "what was done says so");
    let twice = augment(&careful, &vehicles(), false);
    assert!(matches!(twice, Err(MirrorError::Mirrored { .. })), "images of images");
    let unknown = augment(&original, &BTreeMap::new(), false);
    assert!(matches!(unknown, Err(MirrorError::UnknownVehicle { .. })));
}

#[test]
fn a_bundle_of_other_surfaces_mirrors_nothing() {
    let mut original = data(2);
    original
        .meta
        .vehicles
        .insert("husky".into(), names(husky()).into_iter().map(|n| n.replace("bottom", "belly")).collect());
    let error = augment(&original, &vehicles(), false).unwrap_err();
    assert!(matches!(&error, MirrorError::Surfaces { vehicle, .. } if vehicle == "husky"), "{error}");
}

const BY_CASE: [By; 5] = [
    By::Case { share: 0.2 },
    By::Folds { count: 4 },
    By::Depth { bins: 5 },
    By::Heading { bins: 3 },
    By::Vehicle,
];

/// Every sample is on one side.
fn is_partition(split: &Split, data: &Dataset) -> bool {
    let mut all = [split.training.clone(), split.held_out.clone()].concat();
    all.sort_unstable();
    all == (0..data.samples.len()).collect::<Vec<_>>()
        && !split.training.is_empty()
        && !split.held_out.is_empty()
}

#[test]
fn no_split_by_case_has_a_case_on_both_sides() {
    let data = augment(&data(40), &vehicles(), true).unwrap();
    for by in BY_CASE {
        for split in split(&data, by, 7).unwrap() {
            assert!(split.leaks(&data).is_empty() && is_partition(&split, &data), "{by:?}: {}", split.name);
        }
    }
    let by_sample = &split(&data, By::Sample { share: 0.2 }, 7).unwrap()[0];
    assert!(is_partition(by_sample, &data));
    assert!(
        by_sample.leaks(&data).len() > 60,
        "by sample nearly every case is on both sides, and that is told"
    );
}

#[test]
fn cases_of_one_state_stay_together_whatever_their_mesh_and_bed() {
    let mut data = data(40);
    let twins = data.samples.clone().into_iter().map(|mut sample| {
        sample.case = format!("{}-driving", sample.case);
        sample.condition.ground_velocity = sample.condition.velocity;
        sample
    });
    data.samples.extend(twins);
    for by in BY_CASE {
        for split in split(&data, by, 7).unwrap() {
            let (training, held_out) = split.parts(&data);
            let states = |side: &Dataset| -> BTreeSet<String> {
                side.samples.iter().map(|s| s.case.trim_end_matches("-driving").to_owned()).collect()
            };
            assert!(states(&training).is_disjoint(&states(&held_out)), "{by:?}: {}", split.name);
        }
    }
    let (training, held_out) =
        (0..data.samples.len()).partition(|&i| !data.samples[i].case.ends_with("-driving"));
    let leaking = Split { name: "by bed".into(), training, held_out };
    assert_eq!(leaking.leaks(&data).len(), 80, "a state that is learnt is no test of what is learnt");
}

#[test]
fn parts_held_out_in_turn_cover_every_case_once() {
    let data = data(40);
    for by in &BY_CASE[1..] {
        let splits = split(&data, *by, 7).unwrap();
        let mut held_out: Vec<usize> = splits.iter().flat_map(|split| split.held_out.clone()).collect();
        held_out.sort_unstable();
        assert_eq!(held_out, (0..data.samples.len()).collect::<Vec<_>>(), "{by:?}");
    }
}

#[test]
fn a_depth_that_is_held_out_is_not_learnt() {
    let data = data(40);
    let splits = split(&data, By::Depth { bins: 5 }, 1).unwrap();
    assert_eq!(splits.len(), 5);
    for (index, split) in splits.iter().enumerate() {
        for (vehicle, table) in [("husky", ParameterTable::HUSKY), ("warthog", ParameterTable::WARTHOG)] {
            let depths = |side: &[usize]| -> Vec<f64> {
                let samples = side.iter().map(|&i| &data.samples[i]).filter(|s| s.vehicle == vehicle);
                samples.map(|s| s.condition.depth).collect()
            };
            let held_out = depths(&split.held_out);
            let (low, high) = held_out.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
            assert!(
                depths(&split.training).iter().all(|d| *d < low || *d > high),
                "{vehicle} {}",
                split.name
            );
            // a fifth of the range, from the plan's least depth on
            let width = (table.depth_m.max - table.depth_m.min) / 5.0;
            let middle = table.depth_m.min + width * (index as f64 + 0.5);
            assert!(
                (low - middle).abs() < 0.6 * width && (high - middle).abs() < 0.6 * width,
                "{low} {high} {middle}"
            );
        }
    }
}

#[test]
fn mirror_images_have_the_heading_of_their_case() {
    let data = augment(&data(30), &vehicles(), true).unwrap();
    for split in split(&data, By::Heading { bins: 3 }, 1).unwrap() {
        let angles: BTreeSet<i64> = split
            .held_out
            .iter()
            .map(|&i| {
                let v = data.samples[i].condition.velocity;
                (v.x.abs().atan2(v.y.abs()).to_degrees() * 1e6) as i64
            })
            .collect();
        let span = (angles.last().unwrap() - angles.first().unwrap()) as f64 * 1e-6;
        assert!(span <= 20.1, "60 degrees in three parts: {span}");
    }
}

#[test]
fn a_seed_gives_its_split_and_no_other() {
    let data = data(40);
    let by = By::Case { share: 0.2 };
    assert_eq!(split(&data, by, 3), split(&data, by, 3));
    assert_ne!(split(&data, by, 3), split(&data, by, 4));
    let held_out = split(&data, by, 3).unwrap()[0].parts(&data).1;
    for vehicle in ["husky", "warthog"] {
        let samples = held_out.samples.iter().filter(|sample| sample.vehicle == vehicle).count();
        assert_eq!(samples, 16, "8 of the 40 cases of each vehicle, two sections each");
    }
}

#[test]
fn an_empty_side_is_refused_with_its_reason() {
    let reason = |data: &Dataset, by: By| split(data, by, 1).unwrap_err();
    let (one, few) = (data(1), data(3));
    assert!(matches!(reason(&one, By::Case { share: 0.2 }), SplitError::TooFew { found: 1, needed: 2, .. }));
    assert!(matches!(reason(&few, By::Folds { count: 4 }), SplitError::TooFew { found: 3, needed: 4, .. }));
    for share in [0.0, 1.0, -0.1, f64::NAN] {
        assert!(matches!(reason(&few, By::Case { share }), SplitError::Share { .. }), "{share}");
        assert!(matches!(reason(&few, By::Sample { share }), SplitError::Share { .. }), "{share}");
    }
    assert!(matches!(reason(&few, By::Depth { bins: 1 }), SplitError::Parts { count: 1 }));
    assert!(matches!(reason(&few, By::Depth { bins: 30 }), SplitError::EmptyPart { .. }));
    for bins in [1001, usize::MAX] {
        assert!(matches!(reason(&few, By::Depth { bins }), SplitError::Parts { .. }), "{bins}");
        assert!(matches!(reason(&few, By::Heading { bins }), SplitError::Parts { .. }), "{bins}");
        assert!(matches!(reason(&few, By::Folds { count: bins }), SplitError::TooFew { .. }), "{bins}");
    }
    let husky = few.subset(&(0..6).collect::<Vec<_>>());
    assert!(matches!(reason(&husky, By::Vehicle), SplitError::OneVehicle { .. }));
    let mut level = few.clone();
    level.samples.iter_mut().for_each(|sample| sample.condition.depth = 0.1);
    assert!(matches!(reason(&level, By::Depth { bins: 2 }), SplitError::Constant { .. }));
}

#[test]
fn the_analytic_set_holds_the_loads_and_what_is_left_at_rest() {
    let state =
        Condition { ground_contact: GroundContact::Dry, density: 1300.0, ..Condition::level(Vec3::x(), 0.3) };
    let moving = analytic::samples(warthog(), "paper", &[state]).remove(0);
    let at_rest = wade_core::analytic::loads(warthog(), &Condition { velocity: Vec3::zeros(), ..state });
    for ((load, force), still) in
        moving.surfaces.iter().zip(wade_core::analytic::loads(warthog(), &state)).zip(at_rest)
    {
        assert_eq!(load.force, force);
        assert!((load.rest.unwrap().force - still).norm() < 1e-9);
    }
    // at rest the lift acts where the hull displaces, and the Warthog displaces more at its rear
    let net = |part: fn(&Rest) -> Vec3| moving.surfaces.iter().map(|l| part(&l.rest.unwrap())).sum::<Vec3>();
    let (force, moment) = (net(|rest| rest.force), net(|rest| rest.moment));
    assert!(force.z > 0.0 && moment.y > 0.0 && moment.x.abs() < 1e-6 * moment.y, "{force} {moment}");
}

#[test]
fn the_summary_counts_and_its_scatter_is_the_one_planted() {
    let data = data(10);
    // two cases whose sections differ by 6 N and by 8 N in Fx: variances 18 and 32, their mean 25
    let mut planted = data.subset(&[0, 1, 10, 11]);
    planted.samples[2].surfaces[0].force.x += 6.0;
    planted.samples[3].surfaces[0].force.x += 8.0;
    let scatter = Summary::of(&planted, &|_, _| None).vehicles[0].scatter.unwrap();
    assert!((scatter[0].between_sections_n - 5.0).abs() < 1e-9, "{scatter:?}");
    assert!(scatter[1].between_sections_n < 1e-9 && scatter[2].between_sections_n < 1e-9, "{scatter:?}");

    let data = augment(&data, &vehicles(), false).unwrap();
    let summary = Summary::of(&data, &|_, surface| {
        Some(if surface.starts_with("wheel") { "wheels" } else { "hull" }.into())
    });
    assert_eq!((summary.cases, summary.samples), (20, 80 + 40));
    let husky = &summary.vehicles[0];
    assert_eq!((husky.cases, husky.samples, husky.images[&Image::Both]), (10, 80, 20));
    assert_eq!(husky.coverage.cases.as_flattened().iter().sum::<usize>(), 10);
    assert_eq!(husky.headings.iter().sum::<usize>(), 10);
    assert!(husky.headings[..6].iter().all(|n| *n == 0), "the plan drifts to the left: {:?}", husky.headings);
    assert!((husky.shares["wheels"].of_drag + husky.shares["hull"].of_drag - 1.0).abs() < 1e-12);
    assert!(husky.shares["wheels"].of_drag > 0.6, "{:?}", husky.shares);
    assert!(husky.ranges["depth_m"].min >= 0.06 && husky.ranges["depth_m"].max <= 0.20);
    assert_eq!((husky.parts.rest, husky.parts.moment), (1.0, 0.0));
}

#[test]
fn two_data_sets_become_one_or_say_why_not() {
    let both = data(3);
    let side = |vehicle: &str| {
        let of_vehicle =
            both.samples.iter().enumerate().filter(|(_, s)| s.vehicle == vehicle).map(|(i, _)| i);
        let mut side = both.subset(&of_vehicle.collect::<Vec<_>>());
        side.meta.vehicles.retain(|name, _| name == vehicle);
        side
    };
    let mut merged = side("husky");
    merged.merge(side("warthog")).unwrap();
    assert_eq!(merged, both);
    assert!(matches!(side("husky").merge(side("husky")), Err(MergeError::Case { .. })));
    let mut dry = side("warthog");
    dry.meta.ground_contact = GroundContact::Dry;
    assert!(matches!(merged.merge(dry), Err(MergeError::GroundContact { .. })));
    let mut other = both.subset(&[]);
    other.meta.vehicles.insert("husky".into(), vec!["hull".into()]);
    assert!(matches!(merged.merge(other), Err(MergeError::Surfaces { .. })));
}

#[test]
fn sets_of_cases_are_taken_alone() {
    let mut both = data(3);
    let cases: BTreeSet<String> = both.samples.iter().take(4).map(|s| s.case.clone()).collect();
    for sample in both.samples.iter_mut().filter(|s| cases.contains(&s.case)) {
        sample.set = "wide".into();
    }
    let (all, mut wide) = (both.samples.len(), both.clone());
    wide.keep_sets(&["wide".into()]).unwrap();
    assert_eq!(wide.samples.iter().map(|s| s.case.clone()).collect::<BTreeSet<_>>(), cases);
    let other = both.samples.iter().find(|s| s.set != "wide").unwrap().set.clone();
    let before = both.clone();
    let error = both.keep_sets(&["wide".into(), "tidal".into()]).unwrap_err().to_string();
    assert!(error.contains("`tidal`") && error.contains("wide") && error.contains(&other), "{error}");
    assert_eq!(both, before, "nothing is lost");
    both.keep_sets(&[other, "wide".into()]).unwrap();
    assert_eq!(both.samples.len(), all);
}

/// The questions about this data's vertical forces.
fn lifts(data: &Dataset) -> Vec<Lift> {
    let lift = |question| match question {
        Question::Lift(lift) => lift,
        other => panic!("{other}"),
    };
    questions(data, &vehicles()).into_iter().map(lift).collect()
}

/// Multiplies the loads of some cases of the Warthog.
fn scale(data: &mut Dataset, cases: &[&str], factor: f64) {
    let of_cases = data.samples.iter_mut().filter(|sample| cases.contains(&sample.case.as_str()));
    of_cases.flat_map(|sample| &mut sample.surfaces).for_each(|load| load.force *= factor);
}

#[test]
fn a_wrong_unit_or_half_a_hull_shows_beside_the_lift_at_rest() {
    let right = data(40);
    assert_eq!(questions(&right, &vehicles()), []);
    for (factor, cause) in [
        (1e-3, Cause::OverDensity),
        (0.5, Cause::HalfDomain),
        (1e3, Cause::Unit),
        (-1.0, Cause::Axis),
        (0.1, Cause::NoHydrostaticPressure),
        (4.0, Cause::Unknown),
    ] {
        let mut wrong = right.clone();
        let warthogs = wrong.samples.iter_mut().filter(|sample| sample.vehicle == "warthog");
        warthogs.flat_map(|sample| &mut sample.surfaces).for_each(|load| load.force *= factor);
        let found = lifts(&wrong);
        assert_eq!(found.len(), 1, "{factor}: {found:?}");
        assert_eq!((found[0].cases.vehicle.as_str(), found[0].cause), ("warthog", cause), "{}", found[0]);
        assert_eq!((found[0].cases.names.len(), found[0].cases.compared), (40, 40));
        let said = found[0].to_string();
        assert!(
            said.contains("Archimedes") && said.starts_with("warthog: in 40 of 40 cases (`warthog-"),
            "{said}"
        );
    }
}

#[test]
fn a_minority_of_wrong_cases_is_named_whatever_the_speed() {
    let mut data = data(40);
    scale(&mut data, &["warthog-0003", "warthog-0017"], 1e-3);
    scale(&mut data, &["warthog-0005"], -1.0);
    let found = lifts(&data);
    let cases = |cause: Cause| {
        let lift = found.iter().find(|lift| lift.cause == cause).unwrap();
        let mut names = lift.cases.names.clone();
        names.sort();
        (names.join(" "), lift.to_string())
    };
    assert_eq!(found.len(), 2, "{found:?}");
    let (names, said) = cases(Cause::OverDensity);
    assert_eq!(names, "warthog-0003 warthog-0017");
    assert!(said.starts_with("warthog: in 2 of 40 cases (`warthog-0"), "{said}");
    assert!(said.contains("it is 0.0010 of it") && said.contains("rhoInf 1"), "{said}");
    let (names, said) = cases(Cause::Axis);
    assert_eq!(names, "warthog-0005");
    assert!(said.starts_with("warthog: in 1 of 40 cases (`warthog-0005`)"), "{said}");
}

#[test]
fn half_a_hull_among_whole_ones_is_named_where_no_suction_explains_it() {
    let half_at = |speed: f64| {
        let mut data = data(40);
        scale(&mut data, &["warthog-0003"], 0.5);
        let sample = data.samples.iter_mut().filter(|sample| sample.case == "warthog-0003");
        sample.for_each(|sample| sample.condition.velocity = Vec3::x() * speed);
        lifts(&data)
    };
    let slow = half_at(0.1);
    assert_eq!(slow.len(), 1, "{slow:?}");
    assert_eq!((slow[0].cause, slow[0].cases.names.join(" ")), (Cause::HalfDomain, "warthog-0003".into()));
    assert_eq!(half_at(4.0), [], "as much as suction takes from a fast hull");
}

#[test]
fn a_question_names_the_first_of_many_cases() {
    let mut data = data(40);
    let names: Vec<String> = (10..15).map(|case| format!("warthog-{case:04}")).collect();
    scale(&mut data, &names.iter().map(String::as_str).collect::<Vec<_>>(), 1e-3);
    let said = lifts(&data)[0].to_string();
    assert!(said.starts_with("warthog: in 5 of 40 cases (") && said.contains(", ...)"), "{said}");
    assert_eq!(said.matches("`warthog-00").count(), 3, "{said}");
}

#[test]
fn a_depth_in_centimeters_is_questioned() {
    let mut data = data(40);
    let in_case = |sample: &&mut Sample| sample.case == "husky-0007";
    data.samples.iter_mut().filter(in_case).for_each(|sample| sample.condition.depth *= 100.0);
    let said: Vec<String> = questions(&data, &vehicles()).iter().map(Question::to_string).collect();
    let depth: Vec<&String> =
        said.iter().filter(|said| said.contains("depth_m of case.toml in meters?")).collect();
    assert_eq!(depth.len(), 1, "{said:?}");
    assert!(
        depth[0].starts_with("husky: in 1 of 40 cases (`husky-0007`) the water is more than 3 times"),
        "{said:?}"
    );

    // a hull that is wholly under water has its lift at any depth
    let deep = Condition::level(Vec3::zeros(), 1.0);
    data.samples.truncate(0);
    for (depth, questioned) in [(1.0, false), (30.0, true)] {
        data.samples = analytic::samples(warthog(), "deep", &[Condition { depth, ..deep }]);
        let found = questions(&data, &vehicles());
        assert_eq!(matches!(found[..], [Question::Depth(_)]), questioned, "{depth}: {found:?}");
    }
}

#[test]
fn moments_about_a_point_far_away_are_questioned() {
    let mut data = data(40);
    let moved = |data: &mut Dataset, by: Vec3| {
        for load in data.samples.iter_mut().filter(|s| s.case == "husky-0007").flat_map(|s| &mut s.surfaces) {
            load.moment = Some(load.moment.unwrap_or_default() + by.cross(&load.force));
        }
    };
    moved(&mut data, Vec3::new(0.4, 0.0, 0.0));
    assert_eq!(questions(&data, &vehicles()), [], "within the vehicle");
    moved(&mut data, Vec3::new(413.0, 0.0, 0.0));
    let found = questions(&data, &vehicles());
    let [Question::Arm(arm)] = &found[..] else { panic!("{found:?}") };
    assert!(arm.arm > 100.0 && arm.cases.names == ["husky-0007"], "{arm:?}");
    let said = arm.to_string();
    assert!(
        said.contains("origin_m and the point of the moments (CofR, moment_center_m) in meters"),
        "{said}"
    );
}

#[test]
fn the_vertical_force_of_our_own_cfd_raises_no_question() {
    for vehicle in [husky(), warthog()] {
        let campaigns = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
        let data = dataset::read(&campaigns.join(&vehicle.name).join("sections.parquet")).unwrap();
        let found = questions(&data, &vehicles());
        assert!(found.is_empty(), "{}", found[0]);
    }
}
