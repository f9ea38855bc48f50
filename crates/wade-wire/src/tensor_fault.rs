//! What can be wrong with the tensors of a request.

/// A tensor or a parameter that no answer can be given for. Names are cut to a length that an error can carry.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TensorFault {
    /// No such input or output.
    #[error("there is no tensor {name}; there are {known}")]
    Unknown {
        /// The name.
        name: String,
        /// The names there are.
        known: String,
    },
    /// Named twice.
    #[error("{name} is given twice")]
    Repeated {
        /// The tensor.
        name: String,
    },
    /// Another datatype.
    #[error("{name} is {datatype}, and must be FP32")]
    Datatype {
        /// The tensor.
        name: String,
        /// What it is.
        datatype: String,
    },
    /// Another shape.
    #[error("{name} has shape {shape:?}, and must have {expected:?}: one row a state, as depth_m has")]
    Shape {
        /// The tensor.
        name: String,
        /// Its shape, the first four dimensions.
        shape: Vec<i64>,
        /// What it must be; -1 is any number of states.
        expected: Vec<i64>,
    },
    /// Contents of another length than the shape says.
    #[error("{name} has {len} {unit}, and its shape {expected}")]
    Length {
        /// The tensor.
        name: String,
        /// What is there.
        len: usize,
        /// What the shape says.
        expected: usize,
        /// Values or bytes.
        unit: &'static str,
    },
    /// Both kinds of contents.
    #[error("{name} has contents beside raw_input_contents: give one of them")]
    Both {
        /// The tensor.
        name: String,
    },
    /// Another number of raw contents than of inputs.
    #[error("there are {raw} raw_input_contents for {inputs} inputs: give one for each, or none")]
    RawCount {
        /// Raw contents.
        raw: usize,
        /// Inputs.
        inputs: usize,
    },
    /// The number of states is not known.
    #[error("depth_m is missing: its length is the number of states")]
    NoDepth,
    /// A parameter that does not exist, or has another type.
    #[error("there is no parameter {name} of that type here; there are: {known}")]
    Parameter {
        /// The parameter.
        name: String,
        /// Those that exist, with their types.
        known: &'static str,
    },
}

impl TensorFault {
    /// The field that is wrong.
    pub fn field(&self) -> &str {
        match self {
            Self::Unknown { name, .. }
            | Self::Repeated { name }
            | Self::Datatype { name, .. }
            | Self::Shape { name, .. }
            | Self::Length { name, .. }
            | Self::Both { name }
            | Self::Parameter { name, .. } => name,
            Self::RawCount { .. } => "raw_input_contents",
            Self::NoDepth => "depth_m",
        }
    }
}
