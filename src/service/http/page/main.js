// The page: asks the server whenever the state changes, never twice at a time, and shows what it says.

import { attitude, batchOf, buildControls, firstState, fromAddress, request, settingOf, sliders, toAddress } from "./controls.js";
import { Drive } from "./drive.js";
import { Live, streams } from "./live.js";
import { add, scale, transform, worldFromBody } from "./matrix.js";
import { DRY, QUANTITIES, colorOf, colorOfIndex, gradient, roundUp, short, ticks, topOf } from "./scale.js";
import { CAMERAS, Scene } from "./scene.js";
import { surfaceAt } from "./shapes.js";
import { StabilityMap } from "./stability.js";
import { example } from "./table.js";
import { markSurface, showCurl, showFlags, showLatency, showOther, showRemarks, showSurfaces, showWrench, speak } from "./tables.js";
import { rgb, watchTheme } from "./theme.js";

const FORCE = [0.85, 0.3, 0.05];
const VELOCITY = [0.16, 0.55, 0.5];
const AXIS = [0.42, 0.42, 0.44];
/** The vehicle's own sliders as the source of the state. */
const SLIDERS = "sliders";
const LATENCY_EVERY_MS = 2000;
const RETRY_AFTER_MS = 1000;

const element = (id) => document.getElementById(id);
const canvas = element("canvas");

let [scene, vehicle, hull, state, answer, surfaces, other, began] = [];
let showControls = () => {};
let [asking, stale, pointed] = [false, false, undefined];

/** JSON from the server; its own words where it refuses. */
async function get(path, options) {
  const response = await fetch(path, options);
  const body = await response.json();
  if (!response.ok) throw Object.assign(new Error(body.error.message), { refused: true, code: response.status });
  return body;
}

const post = (path, body) =>
  get(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });

const drive = new Drive(post, () => showRow());
const live = new Live(get, (look) => showLive(look), (reason) => {
  trouble(reason);
  follow(SLIDERS);
});
const map = new StabilityMap(post, (speed, depth) => set({ speed: +speed.toFixed(3), depth: +depth.toFixed(4), view: "state" }));

function trouble(text) {
  element("trouble").hidden = !text;
  element("trouble").textContent = text ?? "";
}

async function ask() {
  if (asking) {
    stale = true;
    return;
  }
  asking = true;
  stale = false;
  const row = state.view === "drive" ? drive.row() : undefined;
  const body = row ? { vehicle: state.vehicle, state: row } : request(state);
  try {
    const fresh = await post("/v1/query", body);
    if (body.vehicle !== state.vehicle || live.id) return;
    if (fresh.bundle_version !== vehicle.summary.bundle_version) await loadVehicle(state.vehicle);
    other = state.compare ? await post(`/v1/batch?version=${state.compare}`, batchOf(body)) : undefined;
    answer = fresh;
    trouble();
    show(body);
  } catch (error) {
    const later = !error.refused || error.code === 429 || error.code === 503;
    trouble(error.refused ? error.message : "The server does not answer. The page shows its last answer and retries.");
    if (later) setTimeout(ask, RETRY_AFTER_MS);
  } finally {
    asking = false;
    if (stale) ask();
  }
}

/** The surfaces with their names, areas, and what the answer says of them; `force` with the effects' share, `own` without. */
function loadsOf(answer) {
  const row = (values, index) => values.slice(3 * index, 3 * index + 3);
  const share = (index) => (answer.effects.length ? row(answer.effect_surface_force_n, index) : [0, 0, 0]);
  return vehicle.surfaces.map((surface, index) => ({
    name: surface.name,
    area: surface.area_m2,
    force: add(row(answer.surface_force_n, index), share(index)),
    own: row(answer.surface_force_n, index),
    point: row(answer.surface_point_m, index),
    wet: answer.wetted_fraction[index],
  }));
}

function show(body) {
  surfaces = loadsOf(answer);
  const quantity = QUANTITIES[state.color] ?? QUANTITIES.force;
  const top = topOf(quantity, surfaces);
  surfaces.forEach((surface, index) => {
    const wet = () => (surface.wet > 0 ? colorOf(quantity, quantity.of(surface), top) : DRY);
    surface.color = quantity.apart ? colorOfIndex(index) : wet();
  });
  element("gradient").style.background = quantity.apart ? "none" : gradient(quantity);
  const labels = quantity.apart ? ["each surface as in the table of surfaces"] : ticks(quantity, top);
  element("ticks").replaceChildren(...labels.map((tick, at) => {
    const unit = at === labels.length - 1 && !quantity.apart ? ` ${quantity.unit}` : "";
    return Object.assign(document.createElement("span"), { textContent: tick + unit });
  }));
  showWrench(answer, vehicle);
  showOther(other, answer);
  speak(answer);
  showFlags(answer);
  showRemarks(answer);
  showSurfaces(surfaces, answer, point);
  showCurl(body);
  draw();
}

/** Newtons that an arrow of one meter stands for, so that the longest stays in the picture. */
function newtonsPerMeter() {
  const net = answer.wrench.force_n;
  const longest = Math.max(Math.hypot(net.x, net.y, net.z), ...surfaces.map((surface) => Math.hypot(...surface.force)));
  return roundUp(longest / (0.6 * vehicle.length_m));
}

function arrows(world) {
  const perMeter = newtonsPerMeter();
  element("arrows").textContent = `arrows: 0.1 m is ${short(0.1 * perMeter)} N; large: net force; gray hull: dry` +
    (answer.effects.length ? "; colors and arrows with the surfaces' share of the effects" : "");
  const place = (point) => transform(world, point).slice(0, 3);
  const turn = (vector) => transform(world, vector).map((x, k) => x - world[12 + k]).slice(0, 3);
  const arrow = (from, force, color, wide) => ({ from: place(from), vector: scale(turn(force), 1 / perMeter), color, wide });
  const { x, y, z } = answer.wrench.force_n;
  const { x: cx, y: cy, z: cz } = answer.wrench.about_m;
  const forces = surfaces.map((surface) => arrow(surface.point, surface.force, FORCE, 0.75));
  forces.push({ ...arrow([cx, cy, cz], [x, y, z], rgb("text"), 1.2), net: true });
  const [speed, heading] = [state.speed, (state.direction * Math.PI) / 180];
  const ahead = [Math.cos(heading), Math.sin(heading), 0];
  if (speed > 0) {
    const reach = 0.5 * (vehicle.length_m * (Math.abs(ahead[0]) + 0.1) + vehicle.width_m * Math.abs(ahead[1]));
    const length = 0.35 * vehicle.length_m * Math.min(speed / sliders(vehicle)[0].max, 1) + 0.08;
    forces.push({ from: place(scale(ahead, reach)), vector: scale(turn(ahead), length), color: VELOCITY });
  }
  for (const axis of axes()) forces.push({ from: place(axis.from), vector: turn(axis.vector), color: AXIS, wide: 0.5 });
  return forces.filter((entry) => Math.hypot(...entry.vector) > 0.004 * vehicle.length_m);
}

/** The axes x and y of the body, on the ground beside the hull. */
function axes() {
  const { length_m: l, width_m: w, z0_m: ground } = vehicle;
  return [
    { from: [0.65 * l, 0, ground], vector: [0.2 * l, 0, 0], text: "x forward" },
    { from: [0, 0.5 * w + 0.15 * l, ground], vector: [0, 0.2 * l, 0], text: "y left" },
  ];
}

function look() {
  const world = worldFromBody(...attitude(state));
  const upwards = world[10];
  return { world, water: (vehicle.z0_m + state.depth) * upwards, ground: vehicle.z0_m, arrows: arrows(world), colors: surfaces.map((surface, index) => lit(surface.color, index)),
    background: rgb("soft"), dry: DRY, everywhere: Boolean(QUANTITIES[state.color]?.apart) };
}

const lit = (color, index) => (index === pointed ? color.map((x) => 0.45 * x + 0.55) : color);

function draw() {
  if (!scene || !answer || !state || canvas.clientWidth === 0) return;
  const shown = look();
  scene.draw(shown);
  showLabels(shown);
}

/** The names of the axes, of the net force and of the velocity, where they are in the picture. */
function showLabels({ world, arrows }) {
  const place = (point) => transform(world, point).slice(0, 3);
  const labels = axes().map(({ from, vector, text }) => [place(add(from, scale(vector, 1.25))), text]);
  const net = arrows.find((arrow) => arrow.net);
  const velocity = arrows.find((arrow) => arrow.color === VELOCITY);
  if (net) labels.push([add(net.from, scale(net.vector, 1.06)), "net force"]);
  if (velocity) labels.push([add(velocity.from, scale(velocity.vector, 1.15)), `velocity ${short(state.speed)} m/s`]);
  const spans = labels.map(([point, text]) => {
    const [x, y] = scene.project(point) ?? [-1000, 0];
    const span = Object.assign(document.createElement("span"), { textContent: text });
    span.style.transform = `translate(${x}px, ${y}px) translate(-50%, -50%)`;
    return span;
  });
  element("labels").replaceChildren(...spans);
}

function point(index, at) {
  if (index !== pointed) {
    pointed = index;
    markSurface(index);
    draw();
  }
  element("labels").querySelector(".tip")?.remove();
  if (index === undefined || !at) return;
  const surface = surfaces[index];
  const text = `${surface.name}: ${short(Math.hypot(...surface.force))} N, ${Math.round(100 * surface.wet)} % wet`;
  const tip = Object.assign(document.createElement("span"), { className: "tip", textContent: text });
  tip.style.transform = `translate(${at[0]}px, ${at[1]}px) translate(-50%, -150%)`;
  element("labels").append(tip);
}

function watchMouse() {
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) {
      scene.turn(event.movementX, event.movementY);
      draw();
    } else if (hull && answer) {
      point(under(event.offsetX, event.offsetY), [event.offsetX, event.offsetY]);
    }
  });
  canvas.addEventListener("pointerleave", () => point(undefined));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    scene.zoom(event.deltaY);
    draw();
  }, { passive: false });
  const look = (camera) => {
    scene.look(camera);
    draw();
  };
  canvas.addEventListener("dblclick", () => look("corner"));
  element("cameras").replaceChildren(...Object.keys(CAMERAS).map((camera, at) => {
    const button = Object.assign(document.createElement("button"), { textContent: camera, title: `${camera} (${at + 1})` });
    button.addEventListener("click", () => look(camera));
    return button;
  }));
  const turns = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, 12], ArrowDown: [0, -12] };
  const zooms = { "+": -120, "=": -120, "-": 120 };
  canvas.addEventListener("keydown", (event) => {
    const camera = event.key === "Home" ? "corner" : Object.keys(CAMERAS)[+event.key - 1];
    if (turns[event.key]) scene.turn(...turns[event.key]);
    else if (zooms[event.key]) scene.zoom(zooms[event.key]);
    else if (camera) scene.look(camera);
    else return;
    event.preventDefault();
    draw();
  });
  canvas.addEventListener("webglcontextlost", () => trouble("The browser took the picture's memory back: load the page again."));
  new ResizeObserver(draw).observe(canvas);
}

/** The surface under a pixel: the ray in the body frame is the world's, turned back. */
function under(x, y) {
  const world = worldFromBody(...attitude(state));
  const back = (v) => [0, 1, 2].map((c) => world[4 * c] * v[0] + world[4 * c + 1] * v[1] + world[4 * c + 2] * v[2]);
  return surfaceAt(hull, back(scene.eye()), back(scene.ray(x, y)));
}

function set(change) {
  const views = change.view !== undefined && change.view !== state.view;
  state = { ...state, ...change };
  history.replaceState(null, "", toAddress(state));
  showState();
  if (views) showView();
  if (state.view === "stability") showMap();
  else if (!live.id) ask();
}

function showState() {
  showControls(state, Boolean(live.id));
  element("vehicle").value = state.vehicle;
  element("color").value = state.color;
  element("dry").checked = Boolean(state.dry);
  element("dry").disabled = Boolean(live.id);
  for (const id of ["compare", "drive-compare"]) element(id).value = String(state.compare);
  element("map-direction").value = state.direction;
  element("friction-min").value = state.friction_min;
  element("friction-max").value = state.friction_max;
}

/** Shows the parts of the page that belong to the view. */
function showView() {
  for (const part of document.querySelectorAll("[data-for]")) part.hidden = !part.dataset.for.split(" ").includes(state.view);
  for (const tab of document.querySelectorAll("[data-view]")) {
    tab.setAttribute("aria-selected", String(tab.dataset.view === state.view));
    tab.tabIndex = tab.dataset.view === state.view ? 0 : -1;
  }
  drive.draw();
  draw();
}

function showMap() {
  const [speed] = sliders(vehicle);
  const { direction, density, dry, friction_min: min, friction_max: max } = state;
  map.show({
    vehicle: state.vehicle, direction, density, dry, friction: [min, Math.max(min, max)], speed: speed.max,
    depth: +(0.75 * vehicle.height_m).toFixed(2), place: [state.speed, state.depth],
  });
}

/** The row of a drive that the cursor is at. */
function showRow() {
  const row = drive.row();
  if (!row) return;
  const { velocity_mps: v, current_mps: c, roll_pitch: { roll_rad: roll, pitch_rad: pitch } } = row;
  const depth = row.depth_m ?? row.water_level_m - vehicle.z0_m;
  set(settingOf({ velocity: [v.x - c.x, v.y - c.y], depth, roll, pitch, density: row.density_kgpm3, dry: false }));
}

/** What a client asked and was answered. */
async function showLive(look) {
  if (look.vehicle !== state.vehicle || look.answer.bundle_version !== vehicle.summary.bundle_version) {
    state = { ...state, vehicle: look.vehicle };
    await loadVehicle(look.vehicle);
  }
  other = undefined;
  answer = look.answer;
  state = { ...state, ...settingOf(look.state) };
  showState();
  element("live").textContent = `stream ${look.id}, answered ${Math.round(1000 * look.age_s)} ms ago`;
  began ??= performance.now();
  if (look.age_s < 0.5) drive.record((performance.now() - began) * 1e-3 - look.age_s, look);
  show(request(state));
}

/** Takes the state from a stream, or from the sliders. */
function follow(source) {
  began = undefined;
  drive.clear();
  live.follow(source === SLIDERS ? undefined : source);
  state = { ...state, stream: live.id ? +live.id : 0 };
  history.replaceState(null, "", toAddress(state));
  element("live").hidden = !live.id;
  for (const id of ["source", "drive-source"]) element(id).value = source;
  showState();
  if (!live.id && vehicle) ask();
}

/** Lists the streams that are open in both choices of a source. */
async function listStreams() {
  const open = await streams(get);
  for (const id of ["source", "drive-source"]) {
    fill(element(id), [[SLIDERS, "this page"], ...open]);
    element(id).value = live.id ?? SLIDERS;
  }
}

/** Evaluates a table, whose `name` stands before what is wrong with it. */
async function loadDrive(name, text) {
  follow(SLIDERS);
  try {
    await drive.load(text, name, state.vehicle, state.compare);
    trouble();
  } catch (error) {
    drive.note(`${name}: ${error.message}`);
  }
}

async function loadFile(file) {
  if (file) await loadDrive(file.name, await file.text());
}

async function loadExample() {
  set({ example: 1, stream: 0 });
  await loadDrive("generated example", example(vehicle));
}

/** What the server says of a vehicle, and its hull. */
async function loadVehicle(name) {
  vehicle = await get(`/v1/vehicles/${encodeURIComponent(name)}`);
  showControls = buildControls(element("controls"), sliders(vehicle), (key, value) => set({ [key]: value }));
  const { versions } = await get(`/v1/vehicles/${encodeURIComponent(name)}/versions`);
  const others = versions.filter(({ served }) => !served).reverse();
  for (const id of ["compare", "drive-compare"]) {
    fill(element(id), [["0", others.length > 0 ? "nothing" : "no other version"], ...others.map(({ version, effects }) => [
      String(version), `version ${version}${effects.length > 0 ? ` with ${effects.join(", ")}` : ""}`])]);
  }
  if (!others.some(({ version }) => version === state?.compare)) state = { ...state, compare: 0 };
  hull = undefined;
  if (scene) {
    try {
      hull = await get(`/v1/vehicles/${encodeURIComponent(name)}/hull`);
    } finally {
      scene.setHull(hull, vehicle.length_m);
    }
  }
}

async function choose(name, change) {
  answer = undefined;
  drive.clear();
  state = { ...state, ...change };
  await loadVehicle(name);
  const { color = "force", view = "state", compare = 0 } = state;
  set({ ...firstState(vehicle), color, ...change, view, compare });
}

async function pollLatency() {
  try {
    if (!document.hidden) {
      showLatency(await get("/v1/latency"));
      if (!document.activeElement?.id.endsWith("source")) await listStreams();
    }
  } catch {
    // the next query says that the server is gone
  }
  setTimeout(pollLatency, LATENCY_EVERY_MS);
}

/** Tabs by click, and by arrow keys from one to the next. */
function watchTabs() {
  const tabs = [...document.querySelectorAll("[data-view]")];
  tabs.forEach((tab, at) => {
    tab.addEventListener("click", () => set({ view: tab.dataset.view }));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = tabs[(at + step + tabs.length) % tabs.length];
      next.focus();
      next.click();
    });
  });
}

function fill(select, entries) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
}

async function start() {
  watchTheme(element("theme"), () => {
    draw();
    drive.draw();
    map.draw();
  });
  try {
    scene = new Scene(canvas);
    watchMouse();
  } catch (error) {
    trouble(error.message);
  }
  fill(element("color"), Object.entries(QUANTITIES).map(([key, { label, unit }]) => [key, unit ? `${label} [${unit}]` : label]));
  const { vehicles } = await get("/v1/vehicles");
  fill(element("vehicle"), vehicles.map(({ name }) => [name, name]));
  element("vehicle").addEventListener("change", (event) => choose(event.target.value).catch((error) => trouble(error.message)));
  element("color").addEventListener("change", (event) => set({ color: event.target.value }));
  for (const id of ["compare", "drive-compare"]) element(id).addEventListener("change", (event) => {
    set({ compare: +event.target.value });
    if (state.example) loadExample();
    else loadFile(element("drive-file").files[0]);
  });
  for (const id of ["source", "drive-source"]) element(id).addEventListener("change", (event) => follow(event.target.value));
  element("drive-file").addEventListener("change", (event) => {
    set({ example: 0 });
    loadFile(event.target.files[0]);
  });
  element("drive-example").addEventListener("click", loadExample);
  element("map-direction").addEventListener("change", (event) => set({ direction: +event.target.value }));
  element("friction-min").addEventListener("change", (event) => set({ friction_min: +event.target.value }));
  element("friction-max").addEventListener("change", (event) => set({ friction_max: +event.target.value }));
  watchTabs();
  element("dry").addEventListener("change", (event) => set({ dry: Number(event.target.checked) }));
  const named = fromAddress(location.hash);
  const known = vehicles.some(({ name }) => name === named.vehicle);
  const name = known ? named.vehicle : vehicles[0].name;
  await choose(name, { ...named, vehicle: name });
  showView();
  await listStreams();
  if (state.stream) follow(String(state.stream));
  else if (state.example) await loadExample();
  pollLatency();
}

start().catch((error) => {
  trouble(`The page could not start: ${error.message}`);
});
