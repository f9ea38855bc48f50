// The page: asks the server whenever the state changes, never twice at a time, and shows what it says.

import { attitude, buildControls, firstState, fromAddress, request, sliders, toAddress } from "./controls.js";
import { add, scale, transform, worldFromBody } from "./matrix.js";
import { DRY, QUANTITIES, colorOf, colorOfIndex, gradient, roundUp, short, ticks, topOf } from "./scale.js";
import { Scene } from "./scene.js";
import { surfaceAt } from "./shapes.js";
import { markSurface, showCurl, showFlags, showLatency, showRemarks, showSurfaces, showWrench } from "./tables.js";

const NET = [0.12, 0.12, 0.14];
const FORCE = [0.85, 0.3, 0.05];
const VELOCITY = [0.16, 0.55, 0.5];
const AXIS = [0.42, 0.42, 0.44];
const LATENCY_EVERY_MS = 2000;
const RETRY_AFTER_MS = 1000;

const element = (id) => document.getElementById(id);
const canvas = element("canvas");

let [scene, vehicle, hull, state, answer, surfaces] = [];
let showControls = () => {};
let [asking, stale, pointed] = [false, false, undefined];

/** JSON from the server; its own words where it refuses. */
async function get(path, options) {
  const response = await fetch(path, options);
  const body = await response.json();
  if (!response.ok) throw Object.assign(new Error(body.error.message), { refused: true, code: response.status });
  return body;
}

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
  const body = request(state);
  try {
    const fresh = await get("/v1/query", { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
    if (body.vehicle !== state.vehicle) return;
    if (fresh.bundle_version !== vehicle.summary.bundle_version) await loadVehicle(state.vehicle);
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
  element("arrows").textContent = `arrows: 0.1 m is ${short(0.1 * perMeter)} N; black: net force; gray hull: dry` +
    (answer.effects.length ? "; colors and arrows with the surfaces' share of the effects" : "");
  const place = (point) => transform(world, point).slice(0, 3);
  const turn = (vector) => transform(world, vector).map((x, k) => x - world[12 + k]).slice(0, 3);
  const arrow = (from, force, color, wide) => ({ from: place(from), vector: scale(turn(force), 1 / perMeter), color, wide });
  const { x, y, z } = answer.wrench.force_n;
  const { x: cx, y: cy, z: cz } = answer.wrench.about_m;
  const forces = surfaces.map((surface) => arrow(surface.point, surface.force, FORCE, 0.75));
  forces.push(arrow([cx, cy, cz], [x, y, z], NET, 1.2));
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
  return { world, water: (vehicle.z0_m + state.depth) * upwards, ground: vehicle.z0_m, arrows: arrows(world), colors: surfaces.map((surface, index) => lit(surface.color, index)) };
}

const lit = (color, index) => (index === pointed ? color.map((x) => 0.45 * x + 0.55) : color);

function draw() {
  if (!scene || !answer) return;
  const shown = look();
  scene.draw(shown);
  showLabels(shown);
}

/** The names of the axes, of the net force and of the velocity, where they are in the picture. */
function showLabels({ world, arrows }) {
  const place = (point) => transform(world, point).slice(0, 3);
  const labels = axes().map(({ from, vector, text }) => [place(add(from, scale(vector, 1.25))), text]);
  const tip = (color) => arrows.find((arrow) => arrow.color === color);
  const [net, velocity] = [tip(NET), tip(VELOCITY)];
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
  canvas.addEventListener("dblclick", () => {
    scene.reset();
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
  state = { ...state, ...change };
  history.replaceState(null, "", toAddress(state));
  showState();
  ask();
}

function showState() {
  showControls(state);
  element("vehicle").value = state.vehicle;
  element("color").value = state.color;
  element("dry").checked = Boolean(state.dry);
}

/** What the server says of a vehicle, and its hull. */
async function loadVehicle(name) {
  vehicle = await get(`/v1/vehicles/${encodeURIComponent(name)}`);
  showControls = buildControls(element("controls"), sliders(vehicle), (key, value) => set({ [key]: value }));
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
  await loadVehicle(name);
  set({ ...firstState(vehicle), color: state?.color ?? "force", ...change });
}

async function pollLatency() {
  try {
    if (!document.hidden) showLatency(await get("/v1/latency"));
  } catch {
    // the next query says that the server is gone
  }
  setTimeout(pollLatency, LATENCY_EVERY_MS);
}

function fill(select, entries) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
}

async function start() {
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
  element("dry").addEventListener("change", (event) => set({ dry: Number(event.target.checked) }));
  const named = fromAddress(location.hash);
  const known = vehicles.some(({ name }) => name === named.vehicle);
  await choose(known ? named.vehicle : vehicles[0].name, { ...named, vehicle: known ? named.vehicle : vehicles[0].name });
  pollLatency();
}

start().catch((error) => {
  trouble(`The page could not start: ${error.message}`);
});
