//! The model in a Python process: `wade.InProcess` passes the numbers of its states in and reads rows of bytes.

#![allow(clippy::too_many_arguments, reason = "the signatures are those of Python's methods")]

mod answering;
mod columns;
mod numbers;

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use prost::Message;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyBytes, PyTuple};
use wade_core::bundle::LibraryError;
use wade_core::model::kernel::Isa;
use wade_core::served::ServedVehicle;
use wade_wire::{Refusal, proto, single};

use answering::{Answering, Invalid};
use numbers::NUMBERS;

/// The Python module.
#[pymodule]
mod wade_native {
    #[pymodule_export]
    use super::{InvalidState, Library, UnknownVehicle, UnreadableVehicle, Vehicle};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}

create_exception!(wade_native, InvalidState, PyException, "A field of the state is wrong.");
create_exception!(wade_native, UnknownVehicle, PyException, "No vehicle has this name.");
create_exception!(wade_native, UnreadableVehicle, PyException, "A folder or a bundle cannot be read.");

/// The vehicles of a folder, and behind them those that the module carries.
#[pyclass(frozen, module = "wade_native")]
struct Library(wade_core::bundle::Library);

#[pymethods]
impl Library {
    #[new]
    #[pyo3(signature = (folder = None))]
    fn open(folder: Option<PathBuf>) -> PyResult<Self> {
        wade_core::bundle::Library::open(folder.as_deref()).map(Self).map_err(unreadable)
    }

    fn names(&self) -> PyResult<Vec<String>> {
        self.0.names().map_err(unreadable)
    }

    fn vehicle(&self, py: Python<'_>, name: &str) -> PyResult<Vehicle> {
        let served = py.detach(|| self.0.served(name, Isa::available()[0])).map_err(unreadable)?;
        Ok(Vehicle { served: Box::new(served), answering: Box::default() })
    }
}

fn unreadable(error: LibraryError) -> PyErr {
    let message = error.to_string();
    match error {
        LibraryError::Unknown { .. } => UnknownVehicle::new_err(message),
        _ => UnreadableVehicle::new_err(message),
    }
}

/// A vehicle with its effects, ready to answer one call at a time.
#[pyclass(frozen, module = "wade_native")]
struct Vehicle {
    // boxed, since the kernel's arrays begin at cache lines of 64 bytes and Python's objects at 16
    served: Box<ServedVehicle>,
    answering: Box<Mutex<Answering>>,
}

const _: () = assert!(align_of::<Vehicle>() <= 16);

#[pymethods]
impl Vehicle {
    #[getter]
    fn version(&self) -> u32 {
        self.served.model().version()
    }

    #[getter]
    fn provenance(&self) -> &str {
        self.served.model().provenance()
    }

    #[getter]
    fn about_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, single(&self.served.model().vehicle().center_of_mass))
    }

    #[getter]
    fn effects(&self) -> Vec<u32> {
        columns::effects(&self.served).iter().map(|effect| effect.effect().code()).collect()
    }

    fn description<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &wade_wire::vehicle(&self.served, false).encode_to_vec())
    }

    fn columns<'py>(
        &self,
        py: Python<'py>,
        surfaces: bool,
        jacobian: bool,
    ) -> PyResult<Vec<Bound<'py, PyTuple>>> {
        let columns = columns::columns(&self.served, surfaces, jacobian);
        columns
            .into_iter()
            .map(|column| (column.name, column.kind, PyTuple::new(py, column.shape)?).into_pyobject(py))
            .collect()
    }

    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        numbers: [f32; NUMBERS],
        flags: u64,
        session: u64,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let state = numbers::state(&numbers, flags);
        // a batch of another thread may hold it for long
        let mut answering = self.answering.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner);
        let row = answering.one(&self.served, &state, session);
        row.map(|row| PyBytes::new(py, row)).map_err(|invalid| refused(invalid, None))
    }

    fn evaluate_batch<'py>(
        &self,
        py: Python<'py>,
        numbers: &[u8],
        flags: u64,
        sessions: &[u8],
        surfaces: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (states, sessions) = numbers::batch(numbers, flags, sessions)
            .map_err(|misshapen| PyValueError::new_err(misshapen.to_string()))?;
        let rows = py.detach(|| self.locked().batch(&self.served, &states, &sessions, surfaces));
        rows.map(|rows| PyBytes::new(py, &rows))
            .map_err(|Invalid { invalid, index }| refused(invalid, Some(index)))
    }

    fn stability<'py>(&self, py: Python<'py>, request: &[u8]) -> PyResult<Bound<'py, PyBytes>> {
        let answer = py.detach(|| self.stand(request));
        answer.map(|answer| PyBytes::new(py, &answer)).map_err(|error| match error {
            NoStability::Misshapen(error) => PyValueError::new_err(error.to_string()),
            NoStability::Refused(refusal) => {
                let details = refusal.details();
                let field = details.bad_request().and_then(|bad| bad.field_violations.first());
                let field = field.map(|violation| violation.field.clone()).unwrap_or_default();
                InvalidState::new_err((field, refusal.to_string(), None::<usize>))
            }
        })
    }
}

/// Why a request for how a vehicle stands has no answer.
enum NoStability {
    Misshapen(prost::DecodeError),
    Refused(Refusal),
}

impl From<Refusal> for NoStability {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl Vehicle {
    /// How the vehicle stands.
    fn stand(&self, request: &[u8]) -> Result<Vec<u8>, NoStability> {
        let request = proto::GetStabilityRequest::decode(request).map_err(NoStability::Misshapen)?;
        let response = wade_wire::stability(&request, &self.served, self.locked().evaluator())?;
        Ok(response.encode_to_vec())
    }

    fn locked(&self) -> MutexGuard<'_, Answering> {
        self.answering.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Field, description and index, in the words of the server.
fn refused(invalid: wade_wire::InvalidState, index: Option<usize>) -> PyErr {
    let field = invalid.field.name();
    let description = Refusal::Invalid { invalid, index }.to_string();
    InvalidState::new_err((field, description, index))
}
