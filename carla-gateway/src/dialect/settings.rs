//! The episode: settings, map, tokens.

use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;

use super::{Opt, Transform};

/// An object with one field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Token {
    pub(crate) data: ByteBuf,
}

/// How an episode runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EpisodeSettings {
    pub(crate) synchronous_mode: bool,
    pub(crate) no_rendering_mode: bool,
    pub(crate) fixed_delta_seconds: Opt<f64>,
    pub(crate) substepping: bool,
    pub(crate) max_substep_delta_time: f64,
    pub(crate) max_substeps: i32,
    pub(crate) max_culling_distance: f32,
    pub(crate) deterministic_ragdolls: bool,
    pub(crate) tile_stream_distance: f32,
    pub(crate) actor_active_distance: f32,
    pub(crate) spectator_as_ego: bool,
}

impl Default for EpisodeSettings {
    /// CARLA's.
    fn default() -> Self {
        Self {
            synchronous_mode: false,
            no_rendering_mode: false,
            fixed_delta_seconds: Opt(None),
            substepping: true,
            max_substep_delta_time: 0.01,
            max_substeps: 10,
            max_culling_distance: 0.0,
            deterministic_ragdolls: true,
            tile_stream_distance: 3_000.0,
            actor_active_distance: 2_000.0,
            spectator_as_ego: true,
        }
    }
}

impl EpisodeSettings {
    /// The same with frames of this length.
    pub(crate) fn with_step(self, secs: f64) -> Self {
        Self { fixed_delta_seconds: Opt(Some(secs)), ..self }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MapInfo {
    pub(crate) name: String,
    pub(crate) recommended_spawn_points: Vec<Transform>,
}

/// How CARLA would make a mesh of an uploaded map; ours is made one way.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct OpendriveParameters {
    vertex_distance: f64,
    max_road_length: f64,
    wall_height: f64,
    additional_width: f64,
    smooth_junctions: bool,
    enable_mesh_visibility: bool,
    enable_pedestrian_navigation: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_have_the_measured_fields() {
        let settings =
            EpisodeSettings { fixed_delta_seconds: Opt(Some(0.05)), ..Default::default() };
        let bytes = rmp_serde::to_vec(&settings).unwrap();
        assert_eq!(&bytes[..6], [0x9b, 0xc2, 0xc2, 0x92, 0xc3, 0xcb]);
        assert_eq!(rmp_serde::from_slice::<EpisodeSettings>(&bytes).unwrap(), settings);
    }
}
