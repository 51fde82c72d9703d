//! Places, times and colours as Foxglove has them.

use schemas::Vec3;
use serde_json::{Value, json};

/// The frame in which everything is.
pub(crate) const MAP_FRAME: &str = "map";
/// The frame of the ego, at ground level under the centre of its box.
pub(crate) const EGO_FRAME: &str = "ego";
/// Nanoseconds of a second.
const NANOS: u64 = 1_000_000_000;

/// Simulated time in nanoseconds.
pub(crate) fn nanos(sim_secs: f64) -> u64 {
    (sim_secs.max(0.0) * NANOS as f64).round() as u64
}

pub(crate) fn time(now: u64) -> Value {
    json!({"sec": now / NANOS, "nsec": now % NANOS})
}

pub(crate) fn vector(of: Vec3) -> Value {
    json!({"x": of.x, "y": of.y, "z": of.z})
}

pub(crate) fn quaternion(of: &schemas::Pose) -> Value {
    let [x, y, z, w]: [f32; 4] = of.rotation.coords.into();
    json!({"x": x, "y": y, "z": z, "w": w})
}

pub(crate) fn pose(of: &schemas::Pose) -> Value {
    json!({"position": vector(of.translation.vector), "orientation": quaternion(of)})
}

/// Where a frame is in the map.
pub(crate) fn transforms(child: &str, world_from_child: &schemas::Pose, now: u64) -> Value {
    let transform = json!({
        "timestamp": time(now),
        "parent_frame_id": MAP_FRAME,
        "child_frame_id": child,
        "translation": vector(world_from_child.translation.vector),
        "rotation": quaternion(world_from_child),
    });
    json!({"transforms": [transform]})
}

pub(crate) fn opaque([r, g, b]: [f32; 3]) -> Value {
    json!({"r": r, "g": g, "b": b, "a": 1.0})
}

/// Of `0xRRGGBB`.
pub(crate) fn paint(rgb: u32) -> Value {
    opaque([16, 8, 0].map(|shift| ((rgb >> shift) & 0xFF) as f32 / 255.0))
}

/// One thing to be drawn, in all its forms.
pub(crate) struct Entity {
    pub(crate) id: String,
    pub(crate) metadata: Vec<Value>,
    pub(crate) cubes: Vec<Value>,
    pub(crate) spheres: Vec<Value>,
    pub(crate) lines: Vec<Value>,
    pub(crate) texts: Vec<Value>,
}

impl Entity {
    pub(crate) fn new(id: impl ToString) -> Self {
        let (metadata, cubes, spheres) = (Vec::new(), Vec::new(), Vec::new());
        let (lines, texts) = (Vec::new(), Vec::new());
        Self { id: id.to_string(), metadata, cubes, spheres, lines, texts }
    }

    pub(crate) fn message(self, now: u64) -> Value {
        let none: [Value; 0] = [];
        json!({
            "timestamp": time(now),
            "frame_id": MAP_FRAME,
            "id": self.id,
            "lifetime": time(0),
            "frame_locked": false,
            "metadata": self.metadata,
            "arrows": none,
            "cubes": self.cubes,
            "spheres": self.spheres,
            "cylinders": none,
            "lines": self.lines,
            "triangles": none,
            "texts": self.texts,
            "models": none,
        })
    }
}
