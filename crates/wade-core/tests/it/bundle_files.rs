//! Promise: writers of one bundle take turns, a reader sees one of them whole, and what is no file of a bundle is refused
//! before it is read.

#![allow(clippy::unwrap_used)]

use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::{copy_of_vehicles, effect, effects_file};
use wade_core::bundle;
use wade_core::effects::Effect;
use wade_core::model::kernel::Isa;

/// Far above what a refusal takes, far below what reading a device or waiting for a pipe would.
const SOON: Duration = Duration::from_secs(5);

fn refusal(folder: &Path) -> String {
    let start = Instant::now();
    let said = bundle::load(folder, Isa::available()[0]).expect_err("refused").to_string();
    assert!(start.elapsed() < SOON, "{said} after {:?}", start.elapsed());
    said
}

#[test]
fn three_writers_of_one_bundle_all_succeed_and_a_reader_sees_no_half() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let first = bundle::read(&husky).unwrap().version;
    let (writers, each) = (3, 5);
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut reads = 0;
            while !done.load(Ordering::Relaxed) {
                bundle::load_served(&husky, Isa::available()[0]).expect("whole");
                reads += 1;
            }
            reads
        });
        let write = || {
            for _ in 0..each {
                let file = effects_file("husky", vec![effect(Effect::AddedMass, 0.4)]);
                bundle::apply(&husky, file).expect("written");
            }
        };
        let threads: Vec<_> = (0..writers).map(|_| scope.spawn(write)).collect();
        threads.into_iter().for_each(|thread| thread.join().unwrap());
        done.store(true, Ordering::Relaxed);
        assert!(reader.join().unwrap() > 0);
    });
    assert_eq!(bundle::read(&husky).unwrap().version, first + writers * each);
    assert_eq!(bundle::kept(&husky).unwrap().len() as u32, writers * each);
}

#[test]
fn what_is_no_file_of_a_bundle_is_refused_before_it_is_read() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let (hull, kept) = (husky.join("hull.stl"), copy.path().join("hull.stl"));
    std::fs::rename(&hull, &kept).unwrap();
    assert!(Command::new("mkfifo").arg(&hull).status().unwrap().success());
    let said = refusal(&husky);
    assert!(said.contains("hull.stl: is no regular file"), "{said}");
    std::fs::remove_file(&hull).unwrap();
    std::fs::create_dir(&hull).unwrap();
    assert!(refusal(&husky).contains("is no regular file"));
    std::fs::remove_dir(&hull).unwrap();
    for (target, expected) in [("/dev/zero", "outside the bundle"), ("../hull.stl", "outside the bundle")] {
        symlink(target, &hull).unwrap();
        let said = refusal(&husky);
        assert!(said.contains("hull.stl: is a link to") && said.contains(expected), "{said}");
        std::fs::remove_file(&hull).unwrap();
    }
    // a link inside, as volumes of Kubernetes are laid out
    std::fs::create_dir(husky.join("..data")).unwrap();
    std::fs::rename(&kept, husky.join("..data/hull.stl")).unwrap();
    symlink("..data/hull.stl", &hull).unwrap();
    bundle::load(&husky, Isa::available()[0]).expect("sound");
}

#[test]
fn a_file_larger_than_any_bundles_is_refused_by_its_size() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    for (name, bytes) in [("effects.toml", 2_u64 << 20), ("network.safetensors", 1 << 40)] {
        let path = husky.join(name);
        let before = std::fs::read(&path).ok();
        // takes no room: a hole
        std::fs::File::create(&path).unwrap().set_len(bytes).unwrap();
        let said = refusal(&husky);
        assert!(said.contains(&format!("{name}: {bytes} bytes")), "{said}");
        match before {
            Some(before) => std::fs::write(&path, before).unwrap(),
            None => std::fs::remove_file(&path).unwrap(),
        }
    }
}

#[test]
fn a_writer_that_waits_in_vain_says_for_whom() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let lock = copy.path().join(".husky.lock");
    // a writer that has its lock already ends at once
    bundle::apply(&husky, effects_file("husky", vec![effect(Effect::AddedMass, 0.4)])).unwrap();
    let holder = std::fs::OpenOptions::new().write(true).open(&lock).unwrap();
    holder.lock().unwrap();
    std::fs::write(&lock, b"process 4711\n").unwrap();
    let error = bundle::apply(&husky, effects_file("husky", vec![effect(Effect::Squat, 0.4)])).unwrap_err();
    assert!(error.to_string().contains("process 4711 is writing this bundle"), "{error}");
}
