//! What worlds of every tier can do.

use schemas::{ActorId, Frame, TrafficLightColour};

use crate::action::Action;
use crate::course::{AgentStart, Course};
use crate::motion::{Contacts, Motion, Shape};
use crate::scene::Neighbour;

/// A world could not go on: its episode is cut off.
#[derive(Debug)]
pub(crate) struct Fault;

/// One world with its agents, who are numbered from 0.
pub(crate) trait Tier: Clone + Send + Sized {
    /// What all worlds share.
    type Kit: Send + Sync;

    /// About what a world takes, and each agent, car or person in it.
    const WORLD_BYTES: usize;
    const BODY_BYTES: usize;

    /// # Errors
    /// What the course lacks.
    fn kit(course: &Course) -> Result<Self::Kit, schemas::Error>;

    /// A world at one of the course's starts.
    ///
    /// # Errors
    /// Why nobody can start there.
    fn begin(course: &Course, kit: &Self::Kit, start: usize) -> Result<Self, schemas::Error>;

    /// Holds until the next one.
    fn drive(&mut self, agent: usize, action: Action);

    /// # Errors
    /// The world must begin anew.
    fn tick(&mut self) -> Result<(), Fault>;

    fn motion(&self, agent: usize) -> Motion;

    fn shape(&self, agent: usize) -> Shape;

    /// What the agent ran into since it was last asked.
    fn take_contacts(&mut self, agent: usize) -> Contacts;

    /// Adds everybody who is not an agent, in a fixed order.
    fn others(&self, everybody: &mut Vec<Neighbour>);

    /// Adds what lights show, in the order of the map's; nothing in a world without lights.
    fn lights(&self, colours: &mut Vec<TrafficLightColour>);

    /// Takes an agent out whose episode is over, where those of others go on.
    fn remove(&mut self, agent: usize);

    fn hash(&self) -> u64;

    /// The world as it is, and what each agent drives; `None` in a tier without such frames.
    fn frame(&self) -> Option<(Frame, Vec<ActorId>)>;
}

/// How fast an agent of a start moves, along x and y.
pub(crate) fn velocity_mps(start: &AgentStart) -> schemas::Vec3 {
    start.pose.rotation * schemas::Vec3::new(start.speed_mps, 0.0, 0.0)
}
