"use strict";
const byId = id => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);

// Places as they are: metres east and north, radians counter-clockwise from east, metres a second.
const summed = (differences, unit) => {
  let sum = 0;
  return Float64Array.from(differences, difference => (sum += difference) * unit);
};
const actors = data.actors.map(told => ({
  ...told,
  x: summed(told.x, 0.01), y: summed(told.y, 0.01),
  yaw: summed(told.yaw, Math.PI / 1800), speed: summed(told.speed, 0.01),
  box: told.box.map(cm => cm / 100),
}));
const last = data.millis.length - 1;
const begin = data.millis[0] ?? 0, end = data.millis[last] ?? 0;
const ego = actors.find(actor => actor.id === data.ego);
const way = ego ? Float64Array.from(ego.x, (x, k) =>
  k ? Math.hypot(x - ego.x[k - 1], ego.y[k] - ego.y[k - 1]) : 0) : [];
for (let k = 1; k < way.length; k++) way[k] += way[k - 1];

// The map: the paths of its picture, each with its paint. North is up, so y is turned.
const picture = byId("map").querySelector("svg");
const [left, top_, width, height] = picture.getAttribute("viewBox").split(" ").map(Number);
// Lines of lanes, which the picture has as fine as its pixels, are as wide as on a road.
const LANE_LINE = "#f4f4f2", LANE_LINE_M = 0.12;
const painted = [...picture.querySelectorAll("path")].map(path => {
  const number = name => Number(path.getAttribute(name) ?? 0);
  const colour = name => { const told = path.getAttribute(name); return told === "none" ? null : told; };
  return {
    shape: new Path2D(path.getAttribute("d")), fill: colour("fill"), stroke: colour("stroke"),
    line: Math.max(number("stroke-width"), colour("stroke") === LANE_LINE ? LANE_LINE_M : 0),
    dash: number("stroke-dasharray"),
    opacity: path.hasAttribute("opacity") ? number("opacity") : 1,
  };
});
picture.remove();

const canvas = byId("view"), context = canvas.getContext("2d");
const ground = document.createElement("canvas"), groundContext = ground.getContext("2d", { alpha: false });
const view = { x: left + width / 2, y: -(top_ + height / 2), scale: 1, follows: ego ?? null };
const state = { millis: begin, plays: false, rate: 1 };
let drawnGround = "";

function resize() {
  const ratio = devicePixelRatio || 1;
  for (const one of [canvas, ground]) {
    one.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    one.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  }
  drawnGround = "";
}

function showWhole() {
  view.follows = null;
  byId("who").value = "";
  Object.assign(view, { x: left + width / 2, y: -(top_ + height / 2) });
  view.scale = Math.min(canvas.width / width, canvas.height / height);
}

const place = context => context.setTransform(
  view.scale, 0, 0, view.scale, canvas.width / 2 - view.x * view.scale, canvas.height / 2 + view.y * view.scale);

function drawGround() {
  const wanted = [view.x, view.y, view.scale, canvas.width, canvas.height].join();
  if (wanted === drawnGround) return;
  drawnGround = wanted;
  groundContext.setTransform(1, 0, 0, 1, 0, 0);
  groundContext.fillStyle = "#dfe5d8";
  groundContext.fillRect(0, 0, ground.width, ground.height);
  place(groundContext);
  for (const { shape, fill, stroke, line, dash, opacity } of painted) {
    groundContext.globalAlpha = opacity;
    if (fill) { groundContext.fillStyle = fill; groundContext.fill(shape); }
    if (stroke) {
      groundContext.strokeStyle = stroke;
      groundContext.lineWidth = line;
      groundContext.setLineDash(dash ? [dash] : []);
      groundContext.stroke(shape);
    }
  }
  groundContext.globalAlpha = 1;
}

// The frame that a time is in or after, and how far it is to the next one.
function moment(millis) {
  let low = 0, high = last;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (data.millis[middle] <= millis) low = middle; else high = middle - 1;
  }
  const span = low < last ? data.millis[low + 1] - data.millis[low] : 0;
  return { frame: low, share: span > 0 ? Math.min(1, (millis - data.millis[low]) / span) : 0 };
}

function at(actor, { frame, share }) {
  const k = frame - actor.first;
  if (k < 0 || k >= actor.x.length) return null;
  const next = Math.min(k + 1, actor.x.length - 1);
  const between = values => values[k] + (values[next] - values[k]) * share;
  const turn = Math.atan2(Math.sin(actor.yaw[next] - actor.yaw[k]), Math.cos(actor.yaw[next] - actor.yaw[k]));
  return { x: between(actor.x), y: between(actor.y), yaw: actor.yaw[k] + turn * share, speed: between(actor.speed) };
}

const PAINT = { vehicle: "#0072b2", walker: "#d55e00", prop: "#777" };
const LAMP = { red: "#e8271c", yellow: "#f0c000", green: "#12a047", off: "#555" };

function drawActor(actor, here) {
  const [middleX, middleY, halfX, halfY] = actor.box;
  context.save();
  context.translate(here.x, -here.y);
  context.rotate(-here.yaw);
  const thin = 1.2 / view.scale;
  context.fillStyle = PAINT[actor.kind];
  if (actor.kind === "vehicle" && actor.rgb !== "#000000") context.fillStyle = actor.rgb;
  context.strokeStyle = actor === ego ? "#e69f00" : "#111";
  context.lineWidth = actor === ego ? 2 * thin : thin;
  context.beginPath();
  if (actor.kind === "walker") {
    context.arc(0, 0, Math.max(halfX, halfY, 2.5 / view.scale), 0, 2 * Math.PI);
  } else {
    context.rect(middleX - halfX, -middleY - halfY, 2 * halfX, 2 * halfY);
  }
  context.fill();
  context.stroke();
  if (actor.kind === "vehicle") {
    // A light nose.
    context.fillStyle = "#fffc";
    context.beginPath();
    context.moveTo(middleX + halfX, -middleY);
    context.lineTo(middleX + 0.35 * halfX, -middleY - 0.8 * halfY);
    context.lineTo(middleX + 0.35 * halfX, -middleY + 0.8 * halfY);
    context.fill();
  }
  context.restore();
}

function drawTrail(actor, { frame }) {
  const until = Math.min(frame - actor.first, actor.x.length - 1);
  const from = Math.max(0, moment(state.millis - 5000).frame - actor.first);
  if (until <= from) return;
  context.beginPath();
  for (let k = from; k <= until; k++) context.lineTo(actor.x[k], -actor.y[k]);
  context.strokeStyle = "#e69f00aa";
  context.lineWidth = Math.max(0.4, 2 / view.scale);
  context.stroke();
}

const latest = (changes, from, before) => {
  let found = null;
  for (const change of changes) if (change[from] <= before) found = change; else break;
  return found;
};

function draw() {
  const now = moment(state.millis);
  const followed = view.follows && at(view.follows, now);
  if (followed) Object.assign(view, { x: followed.x, y: followed.y });
  drawGround();
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.drawImage(ground, 0, 0);
  place(context);
  if (ego) drawTrail(ego, now);
  for (const light of data.lights) {
    const shown = latest(light.changes, 0, now.frame);
    if (!shown) continue;
    context.beginPath();
    context.arc(light.at[0], -light.at[1], Math.max(0.8, 3 / view.scale), 0, 2 * Math.PI);
    context.fillStyle = LAMP[shown[1]];
    context.strokeStyle = "#111";
    context.lineWidth = 1 / view.scale;
    context.fill();
    context.stroke();
  }
  for (const actor of actors) {
    const here = at(actor, now);
    if (here) drawActor(actor, here);
  }
  tell(now);
}

const secs = millis => (millis / 1000).toFixed(2);
const named = actor => `${actor.id} ${actor.type}${actor.role ? ` (${actor.role})` : ""}`;

function tell(now) {
  byId("clock").textContent = `${secs(state.millis - begin)} of ${secs(end - begin)} s`;
  byId("time").value = state.millis - begin;
  byId("play").textContent = state.plays ? "Pause" : "Play";
  const shown = view.follows ?? ego;
  const here = shown && at(shown, now);
  byId("actor").textContent = !shown ? "" : `${named(shown)}\n` + (here
    ? `${(here.speed * 3.6).toFixed(0)} km/h at ${here.x.toFixed(1)} m east, ${here.y.toFixed(1)} m north`
    : "not there at this time");
  tellScores(now);
  data.told.forEach(({ item, millis }, index) => {
    item.classList.toggle("past", millis <= state.millis);
    const next = data.told[index + 1];
    item.classList.toggle("now", millis <= state.millis && !(next && next.millis <= state.millis));
  });
}

const SCORES = ["collisions", "red lights run", "stop signs run", "rights of way taken", "people cut off at crossings"];

function tellScores({ frame }) {
  const lines = [];
  if (ego && way.length) {
    const k = Math.max(0, Math.min(frame - ego.first, way.length - 1));
    lines.push(["driven", `${way[k].toFixed(0)} m`]);
    const counts = latest(data.scores, 0, state.millis) ?? [];
    SCORES.forEach((name, index) => lines.push([name, String(counts[index + 1] ?? 0)]));
  }
  const steps = data.steps.filter(step => Math.round(step.simulation_time * 1000) <= state.millis);
  if (data.steps.length) {
    lines.push(["steps", String(steps.length)]);
    lines.push(["reward", steps.reduce((sum, step) => sum + step.reward, 0).toFixed(2)]);
  }
  const body = byId("scores").tBodies[0];
  body.replaceChildren(...lines.map(([name, value]) => {
    const row = document.createElement("tr");
    const head = document.createElement("th"), cell = document.createElement("td");
    head.scope = "row";
    head.textContent = name;
    cell.textContent = value;
    row.append(head, cell);
    return row;
  }));
}

function go(millis) {
  state.millis = Math.max(begin, Math.min(end, millis));
}

function list() {
  const steps = data.steps.map(step => ({
    at: Math.round(step.simulation_time * 1000), kind: "step",
    text: `${step.action}, reward ${Number(step.reward.toFixed(4))}${step.done_reason ? `, ends: ${step.done_reason}` : ""}`,
  }));
  const all = [...data.events, ...steps].sort((a, b) => a.at - b.at);
  data.told = all.map(({ at, kind, text }) => {
    const item = document.createElement("li"), button = document.createElement("button");
    button.textContent = `${secs(at - begin)} s ${kind}: ${text}`;
    button.className = kind;
    // Contacts are seen from two seconds before.
    button.onclick = () => go(kind === "collision" ? at - 2000 : at);
    item.append(button);
    byId("events").append(item);
    return { item, millis: at, kind };
  });
  if (!all.length) byId("events").append("Nothing happened.");
}

function drawMarks() {
  const marks = byId("marks"), context = marks.getContext("2d");
  marks.width = Math.max(1, marks.clientWidth);
  for (const { millis, kind } of data.told) {
    context.fillStyle = kind === "collision" ? "#d55e00" : "#8888";
    context.fillRect((millis - begin) / Math.max(1, end - begin) * (marks.width - 2), 0, 2, 8);
  }
}

function choose(actor) {
  view.follows = actor;
  byId("who").value = actor ? actor.id : "";
  if (actor && view.scale < 3) view.scale = Math.max(3, canvas.height / 120);
}

function zoom(factor) {
  view.scale = Math.max(0.02, Math.min(200, view.scale * factor));
}

const onMap = event => {
  const box = canvas.getBoundingClientRect(), ratio = canvas.width / box.width;
  return {
    x: view.x + ((event.clientX - box.left) * ratio - canvas.width / 2) / view.scale,
    y: view.y - ((event.clientY - box.top) * ratio - canvas.height / 2) / view.scale,
  };
};

function listen() {
  let drag = null;
  canvas.onpointerdown = event => {
    drag = { x: event.clientX, y: event.clientY, moved: false };
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.onpointermove = event => {
    if (!drag) return;
    const ratio = canvas.width / canvas.clientWidth;
    const [x, y] = [event.clientX - drag.x, event.clientY - drag.y];
    if (!drag.moved && Math.hypot(x, y) < 4) return;
    choose(null);
    view.x -= x * ratio / view.scale;
    view.y += y * ratio / view.scale;
    drag = { x: event.clientX, y: event.clientY, moved: true };
  };
  canvas.onpointerup = event => {
    if (drag && !drag.moved) {
      const point = onMap(event), now = moment(state.millis);
      const found = actors.map(actor => ({ actor, here: at(actor, now) })).filter(({ here }) => here)
        .map(({ actor, here }) => ({ actor, off: Math.hypot(here.x - point.x, here.y - point.y) }))
        .filter(({ off }) => off < Math.max(3, 12 / view.scale)).sort((a, b) => a.off - b.off)[0];
      if (found) choose(found.actor);
    }
    drag = null;
  };
  canvas.onwheel = event => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 400)); };
  byId("nearer").onclick = () => zoom(1.5);
  byId("farther").onclick = () => zoom(1 / 1.5);
  byId("whole").onclick = showWhole;
  byId("who").onchange = event => choose(actors.find(actor => String(actor.id) === event.target.value) ?? null);
  byId("speed").onchange = event => { state.rate = Number(event.target.value); };
  byId("time").oninput = event => go(begin + Number(event.target.value));
  const step = by => { state.plays = false; go(data.millis[Math.max(0, Math.min(last, moment(state.millis).frame + by))]); };
  const play = () => {
    state.plays = !state.plays;
    if (state.plays && state.millis >= end) go(begin);
  };
  byId("back").onclick = () => step(-1);
  byId("on").onclick = () => step(1);
  byId("play").onclick = play;
  const keys = {
    " ": play, ",": () => step(-1), ".": () => step(1), "+": () => zoom(1.5), "-": () => zoom(1 / 1.5), 0: showWhole,
  };
  addEventListener("keydown", event => {
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest("button, select") && event.key === " ") return;
    event.preventDefault();
    act();
  });
  addEventListener("resize", () => { resize(); drawMarks(); });
}

// `#t=12.5` shows that second, and waits there.
function waitWhereAsked() {
  const asked = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? NaN);
  if (!Number.isFinite(asked)) return;
  state.plays = false;
  go(begin + asked * 1000);
}

function begins() {
  byId("about").textContent = `${data.source} on ${data.map}, ${actors.length} actors, version ${data.version}`;
  byId("time").max = end - begin;
  const nobody = new Option("nobody", "");
  byId("who").append(nobody, ...actors.map(actor => new Option(named(actor), actor.id)));
  list();
  resize();
  drawMarks();
  showWhole();
  if (ego) choose(ego);
  listen();
  state.plays = last > 0;
  waitWhereAsked();
  addEventListener("hashchange", waitWhereAsked);
  let before = null;
  const turn = now => {
    if (state.plays && before !== null) go(state.millis + (now - before) * state.rate);
    if (state.millis >= end) state.plays = false;
    before = now;
    draw();
    requestAnimationFrame(turn);
  };
  draw();
  requestAnimationFrame(turn);
}

begins();
