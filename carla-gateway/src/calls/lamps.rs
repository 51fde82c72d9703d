//! Calls about street lights.

use crate::dialect::LightState;
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;

/// The lights of the map; all clients are told the same.
pub(super) fn all(endpoint: &mut Endpoint, _client: String) -> Result<&[LightState], Refusal> {
    Ok(endpoint.lamps.lights())
}

pub(super) fn set(
    endpoint: &mut Endpoint,
    _client: String,
    lights: Vec<LightState>,
    _leaves_client_out: bool,
) -> Result<(), Refusal> {
    endpoint.lamps.set(&lights);
    Ok(())
}

/// Whether the lights burn by night only.
pub(super) fn follow_the_sun(
    endpoint: &mut Endpoint,
    _client: String,
    on: bool,
) -> Result<(), Refusal> {
    endpoint.lamps.follow_the_sun(on, endpoint.is_night());
    Ok(())
}
