//! What a reset is about.

use super::origin::Origin;
use super::{ResetRequest, Session};
use crate::scenario::{Overrides, Scenario, ScenarioError, registry};

/// A scenario with its settings, before it is drawn.
pub(super) struct Candidate {
    pub(super) scenario: Box<dyn Scenario>,
    pub(super) built_from: String,
    pub(super) ignored_config: Vec<String>,
    pub(super) origin: Option<Origin>,
}

impl Session {
    /// The scenario that a reset asks for, not yet reset itself.
    pub(super) fn candidate(&self, request: &ResetRequest) -> Result<Candidate, ScenarioError> {
        let present = self.scenario.common();
        let asked_name = request.scenario_name.as_deref();
        let other_name = asked_name.filter(|name| *name != present.name);
        let mut overrides = Overrides::new(&request.scenario_config);
        let profile = overrides.profile(present.profile)?;
        let from_defaults = overrides.flag("reset_defaults")?;
        let origin = Origin::of(&mut overrides)?;
        let files = &self.context.files;
        let file_changed = asked_name.is_some()
            && other_name.is_none()
            && registry::has_changed(files, &self.built_from, self.scenario.as_ref())?;
        let rebuild =
            other_name.is_some() || from_defaults || profile != present.profile || file_changed;
        let built_from = other_name.unwrap_or(&self.built_from).to_owned();
        let mut scenario = if rebuild {
            registry::find(files, &built_from, profile)?
        } else {
            self.scenario.clone_box()
        };
        scenario.common_mut().configure(&mut overrides)?;
        scenario.configure(&mut overrides)?;
        Ok(Candidate { scenario, built_from, ignored_config: overrides.ignored(), origin })
    }
}
