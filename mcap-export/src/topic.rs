//! The topics of a file, whatever they are called there.

/// One topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    Tf,
    TfStatic,
    Map,
    OpenDrive,
    Actors,
    Poses,
    TrafficLights,
    Odometry,
    Pose,
    Fix,
    State,
    Path,
    Events,
    Weather,
    Frame,
    Commands,
    /// What each piece of ground is.
    Grid,
    /// Where one may drive.
    Drivable,
    /// The ego as a thing to be drawn.
    Car,
}
