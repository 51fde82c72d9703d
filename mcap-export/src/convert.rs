//! Places, times and colours as Foxglove has them.

use schemas::Vec3;
use serde_json::{Value, json};

/// The frame in which everything is.
pub(crate) const MAP_FRAME: &str = "map";
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

/// Where a frame is in another one.
pub(crate) fn transform(
    parent: &str,
    child: &str,
    parent_from_child: &schemas::Pose,
    now: u64,
) -> Value {
    json!({
        "timestamp": time(now),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": vector(parent_from_child.translation.vector),
        "rotation": quaternion(parent_from_child),
    })
}

pub(crate) fn opaque([r, g, b]: [f32; 3]) -> Value {
    json!({"r": r, "g": g, "b": b, "a": 1.0})
}

/// Of `0xRRGGBB`.
pub(crate) fn paint(rgb: u32) -> Value {
    opaque([16, 8, 0].map(|shift| ((rgb >> shift) & 0xFF) as f32 / 255.0))
}

/// One thing to be drawn, in all its forms.
#[derive(Default)]
pub(crate) struct Entity {
    pub(crate) id: String,
    /// `map`, unless it is bound to another.
    pub(crate) frame: &'static str,
    pub(crate) metadata: Vec<Value>,
    pub(crate) arrows: Vec<Value>,
    pub(crate) cubes: Vec<Value>,
    pub(crate) spheres: Vec<Value>,
    pub(crate) lines: Vec<Value>,
    pub(crate) triangles: Vec<Value>,
    pub(crate) texts: Vec<Value>,
}

impl Entity {
    pub(crate) fn new(id: impl ToString) -> Self {
        Self { id: id.to_string(), frame: MAP_FRAME, ..Self::default() }
    }

    /// Whether there is nothing to be seen of it.
    pub(crate) fn is_empty(&self) -> bool {
        let Self { arrows, cubes, spheres, lines, triangles, texts, .. } = self;
        [arrows, cubes, spheres, lines, triangles, texts].iter().all(|all| all.is_empty())
    }

    pub(crate) fn message(self, now: u64) -> Value {
        let none: [Value; 0] = [];
        json!({
            "timestamp": time(now),
            "frame_id": self.frame,
            "id": self.id,
            "lifetime": time(0),
            // Who is bound to a frame moves with it.
            "frame_locked": self.frame != MAP_FRAME,
            "metadata": self.metadata,
            "arrows": self.arrows,
            "cubes": self.cubes,
            "spheres": self.spheres,
            "cylinders": none,
            "lines": self.lines,
            "triangles": self.triangles,
            "texts": self.texts,
            "models": none,
        })
    }
}
