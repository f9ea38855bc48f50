//! From the rows of the file to samples.

use std::collections::HashMap;

use nalgebra::UnitVector3;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::file::{FORMAT, FORMAT_KEY, Fault, META_KEY};
use super::pages::Pages;
use super::schema::{self, Load, SCALARS, SECTION, STATES, SURFACE, State, TEXTS};
use super::table::Table;
use super::{Dataset, Image, Meta, Rest, Sample, SurfaceLoad};
use wade_core::condition::Condition;
use wade_core::frame::Vec3;

/// The samples in the order of their first row.
pub(super) fn decode(reader: &SerializedFileReader<Pages>) -> Result<Dataset, Fault> {
    let meta = meta(reader)?;
    let table = Table::read(reader)?;
    let mut samples: Vec<Partial> = Vec::new();
    let mut index: HashMap<(&str, &str, u32), usize> = HashMap::new();
    for row in 0..table.rows {
        let case = table.text(schema::CASE.name, row)?;
        let image = table.text(schema::IMAGE.name, row)?;
        let at = *index.entry((case, image, section(&table, row)?)).or_insert(samples.len());
        if at == samples.len() {
            samples.push(Partial::new(&table, &meta, row)?);
        }
        samples[at].add(&table, &meta, row)?;
    }
    let samples = samples.into_iter().map(|sample| sample.finish(&meta)).collect::<Result<_, _>>()?;
    Ok(Dataset { meta, samples })
}

fn meta(reader: &SerializedFileReader<Pages>) -> Result<Meta, Fault> {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let value = |key: &'static str| {
        let pair = pairs.and_then(|pairs| pairs.iter().find(|pair| pair.key == key));
        pair.and_then(|pair| pair.value.as_deref()).ok_or(Fault::NoMeta { key })
    };
    let format = value(FORMAT_KEY)?;
    if format.parse::<u32>().ok().is_none_or(|found| found > FORMAT) {
        return Err(Fault::NewerFormat { found: format.to_owned() });
    }
    Ok(serde_json::from_str(value(META_KEY)?)?)
}

fn section(table: &Table, row: usize) -> Result<u32, Fault> {
    let value = table.number(SECTION, row)?;
    let whole = value >= 0.0 && value <= f64::from(i32::MAX) && value.fract() == 0.0;
    if whole {
        Ok(value as u32)
    } else {
        Err(Fault::Value {
            column: SECTION,
            row,
            value: value.to_string(),
            expected: "a whole number from 0",
        })
    }
}

/// A sample some of whose rows have been seen.
struct Partial {
    sample: Sample,
    loads: Vec<Option<SurfaceLoad>>,
}

impl Partial {
    fn new(table: &Table, meta: &Meta, row: usize) -> Result<Self, Fault> {
        let text = |column: &schema::Text| table.text(column.name, row);
        let number = |column: &schema::Scalar| table.number(column.name, row);
        let vector = |column: &State| vector(table, column.names, row);
        let vehicle = text(&schema::VEHICLE)?.to_owned();
        let surfaces = meta
            .vehicles
            .get(&vehicle)
            .ok_or_else(|| Fault::UnknownVehicle { row, vehicle: vehicle.clone() })?;
        let named = |column: &schema::Text, expected| {
            let value = text(column).map(str::to_owned);
            value.map(|value| Fault::Value { column: column.name, row, value, expected })
        };
        let image = match Image::from_name(text(&schema::IMAGE)?) {
            Some(image) => image,
            None => return Err(named(&schema::IMAGE, "original, left_right, front_rear or both")?),
        };
        let ground_contact = match schema::contact_from_name(text(&schema::GROUND_CONTACT)?) {
            Some(contact) => contact,
            None => return Err(named(&schema::GROUND_CONTACT, "wetted or dry")?),
        };
        let velocity = vector(&schema::VELOCITY)?;
        let condition = Condition {
            ground_velocity: vector(&schema::GROUND_VELOCITY)?,
            angular_velocity: vector(&schema::ANGULAR_VELOCITY)?,
            acceleration: vector(&schema::ACCELERATION)?,
            angular_acceleration: vector(&schema::ANGULAR_ACCELERATION)?,
            density: number(&schema::DENSITY)?,
            up: UnitVector3::new_unchecked(vector(&schema::UP)?),
            ground_contact,
            bed_clearance: table.clearance(row)?,
            ..Condition::level(velocity, number(&schema::DEPTH)?)
        };
        let sample = Sample {
            vehicle,
            case: text(&schema::CASE)?.to_owned(),
            set: text(&schema::SET)?.to_owned(),
            image,
            section: section(table, row)?,
            start_s: number(&schema::START)?,
            end_s: number(&schema::END)?,
            condition,
            surfaces: Vec::new(),
        };
        Ok(Self { sample, loads: vec![None; surfaces.len()] })
    }

    fn add(&mut self, table: &Table, meta: &Meta, row: usize) -> Result<(), Fault> {
        self.agrees(table, row)?;
        let Sample { vehicle, case, section, .. } = &self.sample;
        let name = table.text(SURFACE, row)?;
        let index = meta.vehicles[vehicle].iter().position(|surface| surface == name).ok_or_else(|| {
            Fault::UnknownSurface { row, vehicle: vehicle.clone(), surface: name.to_owned() }
        })?;
        if self.loads[index].is_some() {
            let (surface, case, section) = (name.to_owned(), case.clone(), *section);
            return Err(Fault::RepeatedSurface { row, surface, case, section });
        }
        let rest =
            optional(table, &schema::REST_FORCE, row)?.zip(optional(table, &schema::REST_MOMENT, row)?);
        self.loads[index] = Some(SurfaceLoad {
            force: vector(table, schema::FORCE.names, row)?,
            moment: optional(table, &schema::MOMENT, row)?,
            viscous: optional(table, &schema::VISCOUS, row)?,
            rest: rest.map(|(force, moment)| Rest { force, moment }),
        });
        Ok(())
    }

    /// Every row of a sample repeats its state.
    fn agrees(&self, table: &Table, row: usize) -> Result<(), Fault> {
        let sample = &self.sample;
        let differs =
            |column| Err(Fault::Differs { column, row, case: sample.case.clone(), section: sample.section });
        for column in &TEXTS {
            if table.text(column.name, row)? != (column.of)(sample) {
                return differs(column.name);
            }
        }
        for column in &SCALARS {
            if table.number(column.name, row)? != (column.of)(sample) {
                return differs(column.name);
            }
        }
        let clearance = &schema::BED_CLEARANCE;
        if table.clearance(row)? != (clearance.of)(sample) {
            return differs(clearance.name);
        }
        for column in &STATES {
            let expected = (column.of)(sample);
            for (axis, name) in column.names.into_iter().enumerate() {
                if table.number(name, row)? != expected[axis] {
                    return differs(name);
                }
            }
        }
        Ok(())
    }

    fn finish(mut self, meta: &Meta) -> Result<Sample, Fault> {
        for (load, surface) in self.loads.into_iter().zip(&meta.vehicles[&self.sample.vehicle]) {
            let Some(load) = load else {
                let Sample { case, section, image, .. } = self.sample;
                return Err(Fault::MissingSurface { case, section, image, surface: surface.clone() });
            };
            self.sample.surfaces.push(load);
        }
        Ok(self.sample)
    }
}

fn vector(table: &Table, names: [&'static str; 3], row: usize) -> Result<Vec3, Fault> {
    Ok(Vec3::new(table.number(names[0], row)?, table.number(names[1], row)?, table.number(names[2], row)?))
}

/// All three components or none.
fn optional(table: &Table, column: &Load, row: usize) -> Result<Option<Vec3>, Fault> {
    let mut there = 0;
    for name in column.names {
        there += usize::from(table.optional(name, row)?.is_some());
    }
    if there == 0 { Ok(None) } else { vector(table, column.names, row).map(Some) }
}
