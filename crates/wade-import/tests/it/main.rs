//! What the import promises, on robots that the tests write themselves.

mod afloat;
mod bad_input;
mod exporters;
mod forms;
mod mass;
mod solids;
mod time;
mod tracks;
mod units;
mod volume;
mod wheels;
mod write;
