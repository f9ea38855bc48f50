//! Motion-capture recordings: the form on disk (`recording`), mistakes in their axes and units (`reading`), frames that
//! tracking got wrong (`tracking`), how they become trials (`mocap`), and recordings that are
//! generated after the source paper's table of trials (`generated`).

pub mod generated;
mod mocap;
mod reading;
mod recording;
mod tracking;

pub use mocap::{Kinematics, MocapConfig, Rig, process, trials_from_recordings};
pub use reading::Misreading;
pub use recording::{
    RECORDINGS_FILE, Recording, RecordingEntry, RecordingError, RecordingFault, Recordings, RecordingsFile,
};
