//! Calls about sensors beyond their streams.

use super::astray;
use crate::endpoint::Endpoint;
use crate::rpc::{Answer, Payload, Request};

pub(super) async fn answer(_endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "are_gbuffers_enabled" | "is_sensor_enabled_for_ros" => Payload::value(&false),
        // Without effect, and nobody waits: the compatibility page says so.
        "disable_sensor_for_ros" | "enable_sensor_for_ros" | "send" => {
            tracing::warn!(method = request.method, "this call has no effect");
            Ok(Payload::Void)
        }
        _ => astray(request),
    }
}
