//! What is held out, before it is known how much.

use crate::dataset::split::By;

/// What is held out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SplitRule {
    /// A share of the cases of each vehicle.
    Case,
    /// A share of the samples, as the paper seems to: sections and images of one case are then on both sides.
    Sample,
    /// Groups of cases, each in turn.
    Folds,
    /// Parts of the range of depths, each in turn.
    Depth,
    /// Parts of the range of flow angles, each in turn.
    Heading,
    /// Each vehicle in turn.
    Vehicle,
}

impl SplitRule {
    /// With a share for those that have one, and a number of parts for the others.
    pub fn by(self, share: f64, parts: usize) -> By {
        match self {
            Self::Case => By::Case { share },
            Self::Sample => By::Sample { share },
            Self::Folds => By::Folds { count: parts },
            Self::Depth => By::Depth { bins: parts },
            Self::Heading => By::Heading { bins: parts },
            Self::Vehicle => By::Vehicle,
        }
    }
}
