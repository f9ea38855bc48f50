//! Promise: effects are taken into a bundle as its next version and taken back again; a file that is damaged or belongs
//! elsewhere refuses the bundle with the field and the way out.

use std::path::Path;

use crate::common::{
    copy_folder, copy_of_vehicles, copy_with_every_effect, effect, effects_file, every_effect,
};
use sha2::{Digest, Sha256};
use wade_core::bundle::{self, Bundle};
use wade_core::effects::{ActiveEffect, Effect, EffectRegion, EffectsFile, RegionLimit, RegionQuantity};
use wade_core::model::kernel::Isa;

fn version(folder: &Path) -> u32 {
    bundle::load(folder, Isa::available()[0]).expect("sound").version()
}

fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable"));
    let mut files: Vec<_> = entries
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, std::fs::read(entry.path()).expect("readable"))
        })
        .collect();
    files.sort();
    files
}

#[test]
fn every_version_can_be_taken_back_and_put_back_as_it_was() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let first = version(&husky);
    let original = bytes(&husky);
    let one = effects_file("husky", vec![effect(Effect::AddedMass, 0.4)]);
    assert_eq!(bundle::apply(&husky, one).expect("applied"), first + 1);
    assert_eq!(bundle::apply(&husky, every_effect("husky")).expect("applied"), first + 2);
    let kept: Vec<(u32, usize)> = bundle::kept(&husky)
        .expect("readable")
        .iter()
        .map(|kept| (kept.version, kept.effects.len()))
        .collect();
    assert_eq!(kept, [(first, 0), (first + 1, 1)]);
    let all = bytes(&husky);
    assert_eq!(bundle::roll_back(&husky, None).expect("kept"), first + 1);
    assert_eq!(bundle::roll_back(&husky, None).expect("kept"), first);
    assert_eq!(bytes(&husky), original, "bit for bit");
    let error = bundle::roll_back(&husky, None).expect_err("nothing before it").to_string();
    assert!(error.contains("no version before this one was kept"), "{error}");
    assert!(bundle::roll_back(&husky, Some(77)).expect_err("never made").to_string().contains("77"));
    assert_eq!(bytes(&husky), original);
    assert_eq!(bundle::roll_back(&husky, Some(first + 2)).expect("kept"), first + 2);
    assert_eq!(bytes(&husky), all);
    assert_eq!(bundle::roll_back(&husky, Some(first)).expect("kept"), first);
    // a number is never used for another content
    let other = effects_file("husky", vec![effect(Effect::Squat, 0.4)]);
    assert_eq!(bundle::apply(&husky, other).expect("applied"), first + 3);
    assert_eq!(
        bundle::names_in(copy.path()).expect("listed"),
        ["husky", "warthog"],
        "versions are no vehicles"
    );
}

#[test]
fn no_kept_version_and_no_folder_of_others_is_lost() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let (first, original) = (version(&husky), bytes(&husky));
    let kept = copy.path().join(format!("husky.versions/{first}/husky"));
    copy_folder(&copy.path().join("warthog"), &kept);
    let before = bytes(&kept);
    let error = bundle::apply(&husky, every_effect("husky")).expect_err("another is kept there").to_string();
    assert!(error.contains(&format!("another version {first}")) && error.contains("versions"), "{error}");
    assert_eq!((bytes(&husky), bytes(&kept)), (original, before));
    assert!(!copy.path().join(".husky.new").exists(), "what was staged is gone");

    std::fs::remove_dir_all(copy.path().join("husky.versions")).expect("removed");
    copy_folder(&husky, &copy.path().join("husky.new"));
    std::fs::write(copy.path().join("husky.new/mine"), b"mine").expect("written");
    bundle::apply(&husky, every_effect("husky")).expect("applied");
    assert!(copy.path().join("husky.new/mine").exists());
    assert_eq!(bundle::names_in(copy.path()).expect("listed"), ["husky", "warthog"]);

    std::fs::create_dir(copy.path().join(format!("husky.versions/{}", u32::MAX))).expect("a folder");
    let error = bundle::apply(&husky, every_effect("husky")).expect_err("no number is left").to_string();
    assert!(error.contains("4294967295"), "{error}");
}

#[test]
fn a_hull_without_weights_follows_what_was_there_and_is_the_first_where_nothing_was() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let (first, original) = (version(&husky), bytes(&husky));
    let untrained = || Bundle { trained: None, ..bundle::read(&husky).expect("sound") };
    let elsewhere = copy.path().join("elsewhere/husky");
    std::fs::create_dir(copy.path().join("elsewhere")).expect("a folder");
    assert_eq!(bundle::succeed(&elsewhere, untrained()).expect("written"), 1);
    assert_eq!(bundle::succeed(&husky, untrained()).expect("written"), first + 1);
    assert_eq!(bundle::roll_back(&husky, None).expect("kept"), first);
    assert_eq!(bytes(&husky), original);
}

#[test]
fn bundles_that_belong_together_are_replaced_together_or_not_at_all() {
    let copy = copy_of_vehicles();
    let [husky, warthog] = ["husky", "warthog"].map(|name| copy.path().join(name));
    let new = copy.path().join("new");
    std::fs::create_dir(&new).expect("a folder");
    let first = [version(&husky), version(&warthog)];
    let next = |place: &Path, from: &Path| (place.to_owned(), bundle::read(from).expect("sound"));
    let all = || vec![next(&new.join("husky"), &husky), next(&husky, &husky), next(&warthog, &warthog)];
    let kept =
        |vehicle: &str, version: u32| copy.path().join(format!("{vehicle}.versions/{version}/{vehicle}"));

    // what stands in the way of the last of them
    copy_folder(&husky, &kept("warthog", first[1]));
    let before = [bytes(&husky), bytes(&warthog), bytes(&kept("warthog", first[1]))];
    let error = bundle::succeed_together(all()).expect_err("another is kept there").to_string();
    assert!(error.contains("warthog.versions") && error.contains("another version"), "{error}");
    assert_eq!([bytes(&husky), bytes(&warthog), bytes(&kept("warthog", first[1]))], before);
    assert!(!new.join("husky").exists() && !kept("husky", first[0]).exists());
    // and one that is not even written
    let damaged = || vec![next(&husky, &husky), next(&copy.path().join("elsewhere"), &warthog)];
    bundle::succeed_together(damaged()).expect_err("a bundle stands in a folder of its name");
    assert_eq!(bytes(&husky), before[0]);
    for folder in [copy.path(), &new] {
        assert!(!folder.join(".husky.new").exists() && !folder.join(".warthog.new").exists());
    }

    std::fs::remove_dir_all(copy.path().join("warthog.versions")).expect("removed");
    let versions = bundle::succeed_together(all()).expect("written");
    // a bundle from elsewhere counts on from its own number
    assert_eq!(versions, [first[0] + 1, first[0] + 1, first[1] + 1]);
    assert_eq!([bytes(&kept("husky", first[0])), bytes(&kept("warthog", first[1]))], before[..2]);
}

#[test]
fn a_damaged_kept_version_is_not_put_back() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let first = version(&husky);
    bundle::apply(&husky, every_effect("husky")).expect("applied");
    let kept = copy.path().join(format!("husky.versions/{first}/husky/hull.stl"));
    std::fs::write(kept, b"nothing").expect("written");
    let error = bundle::roll_back(&husky, None).expect_err("damaged").to_string();
    assert!(error.contains("hull.stl"), "{error}");
    assert_eq!(version(&husky), first + 1);
}

/// Files that the program wrote when `shape` was three plain numbers: every effect, and the other forms of their laws.
#[test]
fn files_of_both_formats_are_written_as_they_were() {
    for text in
        [include_str!("fixtures/effects/format_1.toml"), include_str!("fixtures/effects/format_2.toml")]
    {
        assert_eq!(EffectsFile::parse(text.as_bytes(), "husky").expect("sound").to_toml(), text);
    }
}

#[test]
fn a_file_comes_back_as_it_was_written() {
    let file = every_effect("warthog");
    assert_eq!(EffectsFile::parse(file.to_toml().as_bytes(), "warthog").expect("sound"), file);
}

/// Changes effects.toml and mends its checksum, so that what is tested is the check behind it.
fn change(folder: &Path, from: &str, to: &str) {
    let path = folder.join("effects.toml");
    let text = std::fs::read_to_string(&path).expect("readable");
    assert!(text.contains(from), "{from} is in\n{text}");
    let text = text.replacen(from, to, 1);
    let sum: String = Sha256::digest(&text).iter().map(|byte| format!("{byte:02x}")).collect();
    std::fs::write(&path, text).expect("written");
    let sums = std::fs::read_to_string(folder.join("SHA256SUMS")).expect("readable");
    let mend = |line: &str| match line.ends_with("  effects.toml") {
        true => format!("{sum}  effects.toml\n"),
        false => format!("{line}\n"),
    };
    std::fs::write(folder.join("SHA256SUMS"), sums.lines().map(mend).collect::<String>()).expect("written");
}

#[test]
fn a_damaged_file_refuses_the_bundle_and_names_the_field() {
    for (from, to, expected) in [
        ("format = 2", "format = 4", "newer"),
        ("format = 2", "format = 2\ncolour = 3", "colour"),
        ("covariance = [[0.00005", "covariance = [[0.5", "between added_mass and linear_damping"),
        ("covariance = [[0.00005", "covariance = [[nan", "between added_mass and linear_damping"),
        ("covariance = [[0.00005, ", "covariance = [[", "a row each coefficient"),
        (
            "effects = [\"added_mass\", \"linear_damping\"]",
            "effects = [\"added_mass\", \"added_mass\"]",
            "of two effects of a file of format 2",
        ),
        ("vehicle = \"husky\"", "vehicle = \"warthog\"", "vehicle = \"warthog\""),
        ("name = \"added_mass\"", "name = \"antigravity\"", "antigravity"),
        ("name = \"added_mass\"", "name = \"sensor_bias\"", "measuring chain"),
        ("name = \"linear_damping\"", "name = \"drag_coefficient_error\"", "twice"),
        ("share_of_gap = 0.5", "share_of_gap = nan", "added_mass: share_of_gap"),
        ("value = 0.15", "value = nan", "added_mass: parameters.heave.value must be between 0"),
        ("value = 0.15", "value = 99.0", "what is physically possible"),
        ("std = 0.015", "std = -1.0", "std must be 0 or greater"),
        ("unit = \"1\"", "unit = \"kg\"", "unit must be \"1\""),
        (
            "coefficients = [\"surge\", \"sway\"",
            "coefficients = [\"surge\", \"surge\"",
            "different from each other",
        ),
        ("coefficients = [\"surge\"", "coefficients = [\"thrust\"", "some of surge"),
        ("covariance = [[0.0001", "covariance = [[-0.0001", "covariance"),
        ("covariance = [[0.0001, 0.0", "covariance = [[0.0001, 0.5", "symmetric"),
        ("shape = [0.8,", "shape = [0.9,", "parameters.time_constant.value"),
        ("shape = [0.8,", "shape = [nan,", "wave_memory: shape[0] must be finite and 0 or greater"),
        ("shape = [0.8, 2.0, 0.0]", "shape = [0.8, 2.0, 2.0]", "wave_memory: shape[2] must be 0 or 1"),
        ("shape = [0.0, 0.0, 0.0]", "shape = [0.0, 1.0, 0.0]", "added_mass: shape[1] must be 0"),
        ("channel_width = 4.0\n", "", "channel_blockage: channel_width"),
        ("speed_mps = [0.0, 10.0]", "speed_mps = [10.0, 0.0]", "validity.speed_mps"),
    ] {
        let copy = copy_of_vehicles();
        let husky = copy.path().join("husky");
        bundle::apply(&husky, every_effect("husky")).expect("applied");
        change(&husky, from, to);
        let error = bundle::load_served(&husky, Isa::available()[0]).expect_err("refused").to_string();
        assert!(error.contains("effects.toml") && error.contains(expected), "{from}: {error}");
        assert!(error.contains("rollback"), "the way out is named: {error}");
        assert_eq!(bundle::read(&husky).expect_err("refused").to_string(), error);
    }
}

#[test]
fn a_region_that_is_none_refuses_the_bundle_and_names_the_field() {
    let limited = |name: Effect, limits: Vec<RegionLimit>| {
        let effect = ActiveEffect { region: EffectRegion { limits }, ..effect(name, 0.2) };
        effects_file("husky", vec![effect]).to_toml()
    };
    let depth = |above, at_most| RegionLimit { quantity: RegionQuantity::Depth, above, at_most };
    let shallow = depth(None, Some([0.14, 0.16]));
    let drag = Effect::DragCoefficientError;
    let text = limited(drag, vec![shallow]);
    let file = EffectsFile::parse(text.as_bytes(), "husky").expect("sound");
    assert_eq!((file.to_toml(), file.effects[0].region.limits.as_slice()), (text.clone(), &[shallow][..]));
    assert!(text.starts_with("format = 3\n"), "no older program would know that it acts in a part alone");
    let everywhere = effects_file("husky", vec![effect(drag, 0.2)]).to_toml();
    assert!(everywhere.starts_with("format = 1\n") && !everywhere.contains("region"), "{everywhere}");
    for (text, expected) in [
        (text.replace("format = 3", "format = 2"), "region must be in a file of format 3"),
        (text.replace("[0.14, 0.16]", "[0.16, 0.14]"), "region[0] must be above and at_most"),
        (text.replace("[0.14, 0.16]", "[nan, 0.14]"), "region[0] must be above and at_most"),
        (text.replace("\"depth\"", "\"heading\""), "heading"),
        (limited(drag, vec![depth(None, None)]), "region[0] must be above and at_most"),
        (limited(drag, vec![shallow, shallow]), "region[1].quantity must be each quantity once"),
        (limited(Effect::WaveMemory, vec![shallow]), "wave_memory: region must be left out"),
    ] {
        let error = EffectsFile::parse(text.as_bytes(), "husky").expect_err("refused").to_string();
        assert!(error.contains(expected), "{error}\n{text}");
    }
}

#[test]
fn a_file_without_a_checksum_or_gone_or_cut_is_refused() {
    let copy = copy_with_every_effect();
    let husky = copy.path().join("husky");
    let path = husky.join("effects.toml");
    let text = std::fs::read(&path).expect("readable");
    let refusal = || bundle::load_served(&husky, Isa::available()[0]).expect_err("refused").to_string();
    std::fs::write(&path, &text[..text.len() / 2]).expect("written");
    assert!(refusal().contains("effects.toml") && refusal().contains("damaged"), "{}", refusal());
    std::fs::remove_file(&path).expect("removed");
    assert!(refusal().contains("effects.toml"), "{}", refusal());
    let shipped = copy_of_vehicles();
    let plain = shipped.path().join("husky");
    std::fs::write(plain.join("effects.toml"), text).expect("written");
    let error = bundle::load_served(&plain, Isa::available()[0]).expect_err("refused").to_string();
    assert!(error.contains("effects.toml") && error.contains("no checksum"), "{error}");
}

#[test]
fn effects_are_refused_beside_other_weights_and_nothing_is_written() {
    let copy = copy_with_every_effect();
    let husky = copy.path().join("husky");
    let before = bytes(&husky);
    let mut other = bundle::read(&husky).expect("sound");
    other.trained.as_mut().expect("trained").0.network.b1[0] += 1.0;
    let error = bundle::write(&husky, &other).expect_err("refused").to_string();
    assert!(error.contains("weights"), "{error}");
    assert_eq!(bytes(&husky), before);
}

#[test]
fn effects_that_are_refused_leave_the_bundle_as_it_was() {
    let copy = copy_of_vehicles();
    let husky = copy.path().join("husky");
    let before = bytes(&husky);
    let wrong_vehicle = every_effect("warthog");
    let mut impossible = every_effect("husky");
    impossible.effects[0].parameters.get_mut("surge").expect("there").value = -3.0;
    for file in [wrong_vehicle, impossible, effects_file("husky", Vec::new())] {
        bundle::apply(&husky, file).expect_err("refused");
        assert_eq!(bytes(&husky), before);
        assert!(bundle::kept(&husky).expect("readable").is_empty());
    }
}
