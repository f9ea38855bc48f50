//! Promise: the loads of a case come from one run on all its surfaces, and what lies beside its files is read, refused or
//! named.

use std::fs;
use std::path::Path;

use tempfile::TempDir;
use wade_learn::dataset::import::{Format, Import};
use wade_learn::dataset::sections::Sections;
use wade_learn::dataset::{CutOff, Dataset};

const CASE: &str = "vehicle = \"raft\"\nspeed_mps = 1.0\nheading_deg = 0.0\ndensity_kgpm3 = 1000.0\ndepth_m = 0.3\n\
                    bed = \"parked\"\nground_contact = \"wetted\"\n[frame]\nx = \"x\"\ny = \"y\"\nz = \"z\"\n\
                    origin_m = [0.0, 0.0, 0.0]\n";

/// Imports one case of the vehicle `raft`, whose surfaces are `bow` and `stern`, from 2 s to 4 s.
fn import(format: Format, description: &str, files: &[(&str, &str)]) -> Result<Dataset, String> {
    let folder = TempDir::new().unwrap();
    let write = |path: &str, text: &str| {
        let path = folder.path().join("drift").join(path);
        fs::create_dir_all(path.parent().unwrap_or(Path::new(""))).unwrap();
        fs::write(path, text).unwrap();
    };
    write("case.toml", description);
    files.iter().for_each(|(path, text)| write(path, text));
    let surfaces = ["bow", "stern"].map(str::to_owned).to_vec();
    let import = Import {
        format,
        vehicles: [("raft".to_owned(), surfaces)].into(),
        sections: Sections { transient_s: 2.0, count: 2, length_s: 1.0 },
        cut_off: CutOff::Refuse,
        provenance: "test".to_owned(),
    };
    import.run(folder.path(), &|_, _| ()).map_err(|error| error.to_string())
}

/// A constant force along x at every tenth of a second.
fn forces(force: f64, from: u32, to: u32) -> String {
    let rows = (from..=to).map(|tenth| {
        let time = f64::from(tenth) / 10.0;
        format!("{time} (({force} 0 0) (0 0 0)) ((0 0 0) (0 0 0))\n")
    });
    let header = "# CofR : (0 0 0)\n# Time forces(pressure viscous) moment(pressure viscous)\n";
    format!("{header}{}", rows.collect::<String>())
}

fn openfoam(files: &[(&str, &str)]) -> Result<Dataset, String> {
    let files: Vec<(String, &str)> =
        files.iter().map(|(path, text)| (format!("postProcessing/{path}"), *text)).collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(path, text)| (path.as_str(), *text)).collect();
    import(Format::OpenFoam, CASE, &files)
}

#[test]
fn a_surface_that_lacks_the_run_of_the_others_is_refused_by_surface_and_folder() {
    let (first, again, whole) = (forces(1.0, 1, 45), forces(2.0, 11, 45), forces(2.0, 1, 45));
    let bow = ("bow/0/forces.dat", &*first);
    let (stern, stern_again) = (("stern/0/forces.dat", &*first), ("stern/1/forces.dat", &*again));
    let said = openfoam(&[bow, stern, stern_again]).unwrap_err();
    assert!(said.contains("surface `bow`: ") && said.contains("postProcessing/bow holds no loads"), "{said}");
    assert!(said.contains("stern/1/forces.dat for surface `stern`"), "{said}");
    let said = openfoam(&[bow, stern, ("stern/0/forces_0.1.dat", &whole)]).unwrap_err();
    assert!(said.contains("stern/0/forces_0.1.dat for surface `stern`"), "{said}");

    let both = openfoam(&[bow, ("bow/1/forces.dat", &again), stern, stern_again]).unwrap();
    assert!(both.samples.iter().all(|sample| sample.net_force().x == 4.0), "both of the later run");
    let (late, early) = (forces(1.0, 15, 45), forces(1.0, 1, 45));
    let files =
        [("bow/1/forces.dat", &*late), ("stern/0/forces.dat", &*early), ("stern/1/forces.dat", &*late)];
    assert!(openfoam(&files).is_ok(), "what counts begins after the run that one of them lacks");
}

#[test]
fn a_restart_that_is_compressed_is_refused_and_not_the_old_run_taken() {
    let first = forces(1.0, 1, 45);
    let files =
        [("bow/0/forces.dat", &*first), ("stern/0/forces.dat", &first), ("stern/1/forces.dat.gz", "")];
    let said = openfoam(&files).unwrap_err();
    assert!(
        said.contains("surface `stern`") && said.contains("stern/1/forces.dat.gz is compressed"),
        "{said}"
    );
}

#[test]
fn files_that_are_no_report_are_named_in_the_notes() {
    let description = format!("{CASE}[report]\nforce = \"{{surface}}-f{{axis}}\"\n");
    let names: Vec<String> = ["bow", "stern"]
        .iter()
        .flat_map(|surface| ["x", "y", "z"].map(|axis| format!("\"{surface}-f{axis}\"")))
        .collect();
    let rows = (1..=45).map(|tenth| format!("{tenth} 1 0 0 2 0 0 {}\n", f64::from(tenth) / 10.0));
    let report = format!("(\"Time Step\" {} \"flow-time\")\n{}", names.join(" "), rows.collect::<String>());
    let files = [("rep.out", &*report), ("slurm-12345.out", "starting job\n")];
    let data = import(Format::Fluent, &description, &files).unwrap();
    assert!(data.samples.iter().all(|sample| sample.net_force().x == 3.0));
    assert_eq!(data.meta.notes["passed_over"], "drift/slurm-12345.out");
    let alone = import(Format::Fluent, &description, &files[..1]).unwrap();
    assert!(!alone.meta.notes.contains_key("passed_over"));
}
