// What is seen through the windows of vehicles: seats, the dashboard, and what is behind them. Appended
// to arriving. The formulas and numbers are those of `raster`'s `cabin`.

const WINDOWS: f32 = 7.0;

// The inside of a body that fills the box from -1 to 1.
struct Plan {
    // Middle of the foremost backs, from each row to the one behind it, rows, a wall behind the seats.
    rows: vec4<f32>,
    // Middle and half width of a seat on either side, hind end and top of the dashboard.
    seat_dash: vec4<f32>,
    // The floor that is seen, lower edges of windows, tops of backs, of head rests.
    levels: vec4<f32>,
    lining: f32,
};

// Of cars, vans, trucks and buses.
fn plan_of(pattern: f32) -> Plan {
    switch u32(pattern - WINDOWS) {
        case 0u: {
            return Plan(vec4<f32>(-0.14, 0.42, 2.0, -9.0), vec4<f32>(0.40, 0.25, 0.30, 0.28), vec4<f32>(0.06, 0.20, 0.50, 0.72), 0.90);
        }
        case 1u: {
            return Plan(vec4<f32>(0.40, 0.5, 1.0, 0.16), vec4<f32>(0.42, 0.30, 0.66, 0.14), vec4<f32>(-0.10, 0.12, 0.42, 0.58), 0.90);
        }
        case 2u: {
            return Plan(vec4<f32>(0.62, 0.5, 1.0, 0.52), vec4<f32>(0.45, 0.30, 0.88, 0.06), vec4<f32>(-0.10, 0.04, 0.26, 0.40), 0.62);
        }
        default: {
            return Plan(vec4<f32>(0.66, 0.20, 8.0, -9.0), vec4<f32>(0.58, 0.30, 0.92, -0.14), vec4<f32>(-0.50, -0.06, 0.16, 0.28), 0.86);
        }
    }
}

// A ray that has come through a window, in the box of its vehicle; the inverse of its step.
struct Inside {
    place: vec3<f32>,
    step: vec3<f32>,
    inverse: vec3<f32>,
};

// Steps to the first thing inside, and what it reflects; 0 for none.
struct Met {
    steps: f32,
    albedo: f32,
};

const DARK: f32 = 0.018;
const SEAT: f32 = 0.06;
const LINING: f32 = 0.11;

// Floor, lining, walls below the windows and behind the seats.
fn shell(in: Inside, plan: Plan) -> Met {
    let falls = in.step.z < 0.0;
    let to_level = max((select(plan.lining, plan.levels.x, falls) - in.place.z) * in.inverse.z, 0.0);
    let to_side = max((select(-1.0, 1.0, in.step.y > 0.0) - in.place.y) * in.inverse.y, 0.0);
    let ahead = in.step.x > 0.0;
    let to_end = max((select(max(plan.rows.w, -1.0), 1.0, ahead) - in.place.x) * in.inverse.x, 0.0);
    let steps = min(min(to_level, to_side), to_end);
    if to_level <= to_side && to_level <= to_end {
        return Met(steps, select(LINING, DARK, falls));
    }
    let is_wall = in.place.z + in.step.z * steps < plan.levels.y;
    let is_back = plan.rows.w > -1.0 && !ahead && to_end <= to_side;
    return Met(steps, select(0.0, DARK, is_wall || is_back));
}

// A box that may be met before what else is.
fn boxed(in: Inside, met: Met, low: vec3<f32>, high: vec3<f32>, albedo: f32) -> Met {
    let one = (low - in.place) * in.inverse;
    let other = (high - in.place) * in.inverse;
    let enter = min(one, other);
    let leave = max(one, other);
    let enters = max(max(enter.x, enter.y), enter.z);
    let steps = max(enters, 0.0);
    if min(min(leave.x, leave.y), leave.z) > steps && steps < met.steps {
        return Met(steps, select(albedo * 1.5, albedo, enter.x >= enters));
    }
    return met;
}

fn met_inside(in: Inside, plan: Plan) -> Met {
    var met = shell(in, plan);
    let dash = plan.seat_dash.zw;
    let floor_z = plan.levels.x;
    met = boxed(in, met, vec3<f32>(dash.x, -1.0, floor_z), vec3<f32>(dash.x + 0.6, 1.0, dash.y), DARK);
    let last = plan.rows.z - 1.0;
    let nearest = clamp(floor((plan.rows.x - in.place.x) / plan.rows.y + 0.5), 0.0, last);
    let next = clamp(nearest + select(-1.0, 1.0, in.step.x < 0.0), 0.0, last);
    let seat = plan.seat_dash.xy;
    let narrow = seat.y * 0.45;
    let back = plan.levels.z;
    for (var at = 0u; at < 4u; at++) {
        let x = plan.rows.x - select(nearest, next, at >= 2u) * plan.rows.y;
        let y = seat.x * select(-1.0, 1.0, (at & 1u) == 1u);
        let low_x = x - 0.045;
        let high_x = x + 0.045;
        met = boxed(in, met, vec3<f32>(low_x, y - seat.y, floor_z), vec3<f32>(high_x, y + seat.y, back), SEAT);
        let rest = vec3<f32>(low_x, y - narrow, back + 0.03);
        met = boxed(in, met, rest, vec3<f32>(high_x, y + narrow, plan.levels.w), SEAT);
    }
    return met;
}

// In the box of a shape: its columns over their squares.
fn inside_of(one: u32, world: vec3<f32>, direction: vec3<f32>) -> Inside {
    let x = placed[one].row_x;
    let y = placed[one].row_y;
    let z = placed[one].row_z;
    let square = max(x.xyz * x.xyz + y.xyz * y.xyz + z.xyz * z.xyz, vec3<f32>(1e-12));
    let away = world - vec3<f32>(x.w, y.w, z.w);
    let place = (x.xyz * away.x + y.xyz * away.y + z.xyz * away.z) / square;
    let turned = (x.xyz * direction.x + y.xyz * direction.y + z.xyz * direction.z) / square;
    let step = select(turned, vec3<f32>(1e-6), abs(turned) < vec3<f32>(1e-6));
    return Inside(place, step, 1.0 / step);
}

// What is seen behind a window; `diffuse` arrives at it, `glow` is of what the cabin is lit by.
fn cabin(in: Inside, pattern: f32, direction: vec3<f32>, diffuse: vec3<f32>, glow: vec3<f32>) -> vec3<f32> {
    let met = met_inside(in, plan_of(pattern));
    if met.albedo > 0.0 {
        return (diffuse * 0.45 + glow * 8.0) * met.albedo;
    }
    return mix(views[view].bounce.rgb * 0.6, sky(direction), smoothstep(-0.12, 0.10, direction.z)) * 0.4;
}
