//! `wade vehicle import`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use serde_json::json;
use wade_core::bundle::{self, Bundle};
use wade_core::physics::Radiation;
use wade_core::vehicle::Vehicle;
use wade_core::vehicle::spec::Axis;
use wade_import::{Imported, Options, Shapes, Unit};

use super::vehicle::summary;
use super::{emit, interrupt};
use wade::config::Config;

/// Make a bundle from a robot description or meshes: URDF, SDF, MJCF, STL, OBJ, glTF
///
/// Shapes are placed, united where they overlap, and given surfaces by rule: a surface for each wheel, and front, rear,
/// left, right and bottom of the body. What was guessed is printed, what looks wrong is a warning. A vehicle that
/// cannot be made leaves nothing behind.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade vehicle import robot.urdf --out vehicles/robot
  wade vehicle import hull.stl wheels.stl --unit mm --mass 42 \\
    --out vehicles/rover --json")]
pub struct ImportVehicle {
    /// One description with the meshes that it does not find by itself, or meshes that are the parts of one vehicle
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Folder of the bundle; one that is there is replaced, with the next version
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Name of the vehicle; in a folder of another name the bundle is DIR/NAME [default: the name of the folder]
    #[arg(long)]
    name: Option<String>,
    /// Mass [kg] [default: the sum of the links]
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// Unit of the files [default: what the format says; for STL and OBJ a guess by size and mass]
    #[arg(long, value_enum, value_name = "UNIT", conflicts_with = "scale")]
    unit: Option<UnitName>,
    /// Meters a unit of the files, for units that --unit does not name
    #[arg(long, value_name = "METERS")]
    scale: Option<f64>,
    /// The axis of the files that points forward [default: x; z for glTF]
    #[arg(long, value_enum, value_name = "AXIS", allow_hyphen_values = true)]
    forward: Option<AxisName>,
    /// The axis of the files that points up [default: z; y for glTF]
    #[arg(long, value_enum, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<AxisName>,
    /// Which shapes of a link make its hull
    #[arg(long, value_enum, default_value = "auto", value_name = "WHICH")]
    shapes: ShapesName,
    /// Close holes by flat caps, and say the volume before and after
    #[arg(long)]
    seal: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ShapesName {
    /// Those to be looked at; where they are open, those to collide
    Auto,
    /// Those to be looked at
    Visual,
    /// Those to collide
    Collision,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum UnitName {
    /// Meters
    M,
    /// Millimeters
    Mm,
    /// Centimeters
    Cm,
    /// Inches
    In,
}

impl From<UnitName> for Unit {
    fn from(name: UnitName) -> Self {
        match name {
            UnitName::M => Self::Meters,
            UnitName::Mm => Self::Millimeters,
            UnitName::Cm => Self::Centimeters,
            UnitName::In => Self::Inches,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AxisName {
    X,
    #[value(name = "-x")]
    MinusX,
    Y,
    #[value(name = "-y")]
    MinusY,
    Z,
    #[value(name = "-z")]
    MinusZ,
}

impl From<AxisName> for Axis {
    fn from(name: AxisName) -> Self {
        match name {
            AxisName::X => Self::PlusX,
            AxisName::MinusX => Self::MinusX,
            AxisName::Y => Self::PlusY,
            AxisName::MinusY => Self::MinusY,
            AxisName::Z => Self::PlusZ,
            AxisName::MinusZ => Self::MinusZ,
        }
    }
}

impl ImportVehicle {
    /// Imports and writes the bundle.
    pub fn run(self) -> Result<()> {
        let (folder, name) = self.place()?;
        interrupt::end_between_writes()?;
        // before the work
        bundle::check_place(&folder, &name)?;
        let options = Options {
            name,
            mass: self.mass,
            scale: self.scale.or(self.unit.map(|unit| Unit::from(unit).meters())),
            forward: self.forward.map(Axis::from),
            up: self.up.map(Axis::from),
            seal: self.seal,
            shapes: match self.shapes {
                ShapesName::Auto => Shapes::Auto,
                ShapesName::Visual => Shapes::Visual,
                ShapesName::Collision => Shapes::Collision,
            },
        };
        let imported = wade_import::import(&self.files, &options)?;
        let version = write_bundle(&folder, imported.vehicle.clone())?;
        if self.json {
            return emit(&format!("{:#}\n", document(&imported, &folder, version)));
        }
        for note in &imported.notes {
            println!("{note}");
        }
        for warning in &imported.warnings {
            eprintln!("warning: {warning}");
        }
        emit(&summary(&imported.vehicle, &imported.floating))?;
        let surfaces: Vec<&str> =
            imported.vehicle.surfaces.iter().map(|surface| surface.name.as_str()).collect();
        println!("surfaces: {}", surfaces.join(", "));
        println!("{}: version {version}", folder.display());
        print!("{}", next_step(&folder, &imported));
        Ok(())
    }

    /// The folder of the bundle and the name of the vehicle, which are one.
    fn place(&self) -> Result<(PathBuf, String)> {
        let own = self.out.file_name().map(|name| name.to_string_lossy().into_owned());
        match (&self.name, own) {
            (Some(name), Some(own)) if *name == own => Ok((self.out.clone(), own)),
            (Some(name), _) => Ok((self.out.join(name), name.clone())),
            (None, Some(own)) => Ok((self.out.clone(), own)),
            (None, None) => bail!("{} names no folder: add --name NAME", self.out.display()),
        }
    }
}

/// Writes a vehicle without weights as the next version of the bundle in its place, in one step of the file system.
fn write_bundle(folder: &Path, vehicle: Vehicle) -> Result<u32> {
    let radiation = Some(Radiation::estimate(&vehicle));
    let bundle =
        Bundle { vehicle, version: 0, trained: None, radiation, effects: None, distance: None, spec: None };
    Ok(interrupt::whole(|| bundle::succeed(folder, bundle))?)
}

/// How to look at the vehicle and ask for its forces.
fn next_step(folder: &Path, imported: &Imported) -> String {
    let vehicles = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (name, height) = (&imported.vehicle.name, imported.vehicle.dimensions.height);
    let depth = imported.floating.depth.unwrap_or(0.5 * height);
    format!(
        "look at it: wade serve --vehicles {}, then http://{}/#vehicle={name}&depth={depth:.3}&color=surface\n",
        vehicles.display(),
        Config::default().http.listen
    )
}

fn document(imported: &Imported, folder: &Path, version: u32) -> serde_json::Value {
    let Imported { vehicle, floating, wheels, notes, warnings } = imported;
    let surfaces = vehicle.surfaces.iter().map(|surface| {
        json!({"name": surface.name, "kind": surface.kind, "area_m2": surface.area,
            "centroid_m": surface.centroid.as_slice()})
    });
    let wheels = wheels.iter().map(|wheel| {
        let center = wheel.center + vehicle.translation;
        json!({"name": wheel.name, "kind": wheel.kind, "source": wheel.source, "radius_m": wheel.radius, "width_m": wheel.width,
            "center_m": center.as_slice(), "roundness": wheel.roundness})
    });
    let d = &vehicle.dimensions;
    json!({
        "name": vehicle.name,
        "version": version,
        "bundle": folder,
        "surfaces": surfaces.collect::<Vec<_>>(),
        "wheels": wheels.collect::<Vec<_>>(),
        "length": d.length,
        "width": d.width,
        "height": d.height,
        "mass": vehicle.mass,
        "center_of_mass": vehicle.center_of_mass.as_slice(),
        "displaced_volume": floating.displaced_volume,
        "float_depth": floating.depth,
        "trim_pitch_rad": floating.pitch,
        "trim_roll_rad": floating.roll,
        "notes": notes,
        "warnings": warnings,
    })
}
