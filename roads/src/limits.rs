//! Every bound of the crate, in one place.

/// Largest OpenDRIVE text accepted, in bytes.
pub const TEXT_BYTES_MAX: usize = 128 * 1024 * 1024;
/// Deepest nesting of XML elements accepted.
pub const XML_DEPTH_MAX: u32 = 64;
/// Most XML nodes accepted.
pub const XML_NODES_MAX: u32 = 2_000_000;
/// Largest absolute coordinate, length or other number of a map, in its own unit.
pub const NUMBER_ABS_MAX: f64 = 1e6;
/// Largest absolute x and y of a road's geometry, in metres: maps in UTM coordinates lie thousands
/// of kilometres from their origin.
pub const PLACE_ABS_MAX: f64 = 2e7;
/// Largest absolute x and y, in metres, at which worlds have actors: single precision is 1 cm
/// there.
pub const ACTOR_ABS_MAX: f64 = 1e5;
/// Largest absolute factor of a polynomial.
pub const COEFFICIENT_ABS_MAX: f64 = 1e15;
/// Most diagnostics collected for one map; the rest is only counted.
pub const DIAGNOSTICS_MAX: usize = 100;
/// Longest piece of a user's text repeated in a diagnostic, in characters.
pub const SHOWN_CHARS_MAX: usize = 64;
/// Steps of a metre along all lanes of a map; each may cost an entry of a table. In spirals that
/// turn far a step counts as often as the integral has panels.
pub const LANE_STEPS_MAX: f64 = 2e7;
/// Flat pieces all lanes of a map are cut into; each is up to ten triangles of a mesh.
pub const LANE_PIECES_MAX: f64 = 2e6;
/// Places on roads of junctions that are given a common height; beyond them junctions stay as they
/// are.
pub const LEVEL_PLACES_MAX: f64 = 1e6;
/// Steps of the search for that height, about.
pub const LEVEL_TRIES_MAX: usize = 400_000_000;
/// Most pieces of what carries bridges; others of the map have none.
pub const DECK_PIECES_MAX: usize = 400_000;
/// Flat pieces of sidewalks that are looked at for roads that cross them.
pub const CROSSED_PIECES_MAX: usize = 400_000;
/// Places at which roads cross sidewalks, about; beyond them sidewalks stay as they are.
pub const CROSSED_PLACES_MAX: usize = 20_000;
/// Steps of the search for those places, about.
pub const CROSSED_TRIES_MAX: usize = 50_000_000;
/// Steps of the search for ways that cross those of all stop and yield signs; beyond them signs
/// hold nobody for who crosses.
pub const CROSSING_TRIES_MAX: usize = 50_000_000;
/// Boxes on such ways, about.
pub const CROSSING_BOXES_MAX: usize = 100_000;
/// Corners and stripes of all crosswalks, and windows of all houses.
pub const PARTS_MAX: f64 = 1e6;
/// Largest turn of one arc or spiral, in radians: thirty times round.
pub const TURN_MAX_RAD: f64 = 200.0;
/// Lanes of one section.
pub const SECTION_LANES_MAX: usize = 200;
/// Sum of the lengths of all polynomial geometries, in metres; they are tabulated.
pub const POLYNOMIAL_LENGTH_SUM_MAX_M: f64 = 1e6;
/// Waypoints generated at once, and steps along roads without any.
pub const GENERATED_WAYPOINTS_MAX: f64 = 1e7;
/// Lanes one walk along the lane graph may enter.
pub const WALK_LANES_MAX: usize = 100_000;
/// Waypoints one walk along the lane graph may return.
pub const WALK_RESULTS_MAX: usize = 10_000;
/// Spawn points listed for one map.
pub const SPAWN_POINTS_MAX: usize = 4_096;
/// Sub-intervals used to integrate one spiral.
pub const SPIRAL_PANELS_MAX: usize = 4_096;
/// Flat pieces of ground a navigation mesh may be made of.
pub const NAV_PIECES_MAX: usize = 200_000;
/// Flat pieces of ground that may lie at one place, within some metres.
pub const NAV_PIECES_AT_PLACE_MAX: usize = 1_000;
/// Squares of eight metres under the boxes of all pieces of a navigation mesh.
pub const NAV_SQUARES_MAX: f64 = 4e6;
/// Polygons one search for a walker's way may look at.
pub const NAV_SEARCH_POLYGONS_MAX: usize = 200_000;
/// Longest map, in metres of road, that gets generated surroundings.
pub const SURROUNDINGS_LENGTH_MAX_M: f64 = 5e5;
/// Things generated as the surroundings of one map; the last road may add a few more.
pub const SURROUNDINGS_MAX: usize = 6_000;
