// The state that is asked for: sliders, the address of the page, and the query made of them.

import { gravity } from "./matrix.js";

const RAD = Math.PI / 180;

/** The provenance of a vehicle without trained weights. */
export const PHYSICS = "physics";
const FIRST = {
  vehicle: "", speed: 0, direction: 0, depth: 0, roll: 0, pitch: 0, density: 1000, dry: 0, color: "force", view: "state", compare: 0,
  friction_min: 0.32, friction_max: 0.9, example: 0, stream: 0,
};

/** What can be set by a slider, for a vehicle as the server describes it. Bands are where the weights were trained. */
export function sliders(vehicle) {
  const range = (quantity) => vehicle.domain.find((r) => r.quantity === `QUANTITY_${quantity}`);
  const trained = vehicle.summary.provenance !== PHYSICS;
  const band = (quantity) => [range(quantity)].filter(Boolean).filter(() => trained).map((r) => [r.minimum, r.maximum]);
  const speed = range("SPEED")?.maximum ?? 2;
  const tilt = (range("TILT")?.maximum ?? 0) / RAD;
  const side = 90 - (range("ANGLE")?.minimum ?? 0) / RAD;
  return [
    { key: "speed", label: "speed", unit: "m/s", min: 0, max: tidy(2 * speed), step: 0.01, bands: band("SPEED") },
    {
      key: "direction", label: "direction of travel", unit: "°", min: -180, max: 180, step: 1,
      bands: trained ? [[-180, side - 180], [-side, side], [180 - side, 180]] : [],
    },
    { key: "depth", label: "water depth", unit: "m", min: 0, max: tidy(1.2 * vehicle.height_m), step: 0.005, bands: band("DEPTH") },
    { key: "roll", label: "roll", unit: "°", min: -30, max: 30, step: 0.5, bands: trained ? [[-tilt, tilt]] : [] },
    { key: "pitch", label: "pitch", unit: "°", min: -30, max: 30, step: 0.5, bands: trained ? [[-tilt, tilt]] : [] },
    { key: "density", label: "density", unit: "kg/m³", min: 950, max: 2000, step: 5, bands: band("DENSITY") },
  ];
}

const tidy = (value) => Math.ceil(value * 20 - 1e-9) / 20;

/** Where a vehicle is shown at first: driving ahead in the middle of the training data. */
export function firstState(vehicle) {
  const middle = (quantity, share) => {
    const r = vehicle.domain.find((entry) => entry.quantity === `QUANTITY_${quantity}`);
    return r ? +(r.minimum + share * (r.maximum - r.minimum)).toFixed(2) : 0;
  };
  return { ...FIRST, vehicle: vehicle.summary.name, speed: middle("SPEED", 0.75), depth: middle("DEPTH", 0.75) };
}

/** The state that the part of the address after # names: only what can be set, and only numbers where numbers belong. */
export function fromAddress(hash) {
  const named = Object.fromEntries(new URLSearchParams(hash.slice(1)));
  const usable = ([key, value]) => key in FIRST && (typeof FIRST[key] === "string" || Number.isFinite(+value));
  const entries = Object.entries(named).filter(usable);
  return Object.fromEntries(entries.map(([key, value]) => [key, typeof FIRST[key] === "string" ? value : +value]));
}

export const toAddress = (state) => `#${new URLSearchParams(state)}`;

/** The message wade.v1.EvaluateRequest of a state. */
export function request(state) {
  const heading = state.direction * RAD;
  return {
    vehicle: state.vehicle,
    state: {
      velocity_mps: { x: state.speed * Math.cos(heading), y: state.speed * Math.sin(heading) },
      depth_m: state.depth,
      density_kgpm3: state.density,
      roll_pitch: { roll_rad: state.roll * RAD, pitch_rad: state.pitch * RAD },
      ground_contact: state.dry ? "GROUND_CONTACT_DRY" : "GROUND_CONTACT_WETTED",
    },
  };
}

/** The same as a batch of one, wade.v1.EvaluateBatchRequest. */
export function batchOf({ vehicle, state }) {
  const vector = (v) => [v?.x ?? 0, v?.y ?? 0, v?.z ?? 0];
  const { roll_rad: roll, pitch_rad: pitch } = state.roll_pitch;
  return {
    vehicle,
    velocity_mps: vector(state.velocity_mps),
    current_mps: vector(state.current_mps),
    angular_velocity_radps: vector(state.angular_velocity_radps),
    acceleration_mps2: vector(state.acceleration_mps2),
    angular_acceleration_radps2: vector(state.angular_acceleration_radps2),
    gravity_direction: gravity(roll, pitch),
    depth_m: state.depth_m === undefined ? [] : [state.depth_m],
    water_level_m: state.water_level_m === undefined ? [] : [state.water_level_m],
    density_kgpm3: [state.density_kgpm3],
    ground_contact: state.ground_contact ?? "GROUND_CONTACT_WETTED",
  };
}

/** The state of the sliders that comes nearest to a velocity through the water, a depth and an attitude [rad]. */
export function settingOf({ velocity: [x, y], depth, roll, pitch, density, dry }) {
  const round = (value, decimals) => +value.toFixed(decimals);
  return {
    speed: round(Math.hypot(x, y), 3), direction: round(Math.atan2(y, x) / RAD, 1), depth: round(depth, 4), roll: round(roll / RAD, 2),
    pitch: round(pitch / RAD, 2), density: round(density, 1), dry: Number(dry),
  };
}

export const attitude = (state) => [state.roll * RAD, state.pitch * RAD];

/** Builds the sliders; `changed` is told the key and the value. Returns what shows a state in them. */
export function buildControls(parent, specs, changed) {
  const rows = specs.map((spec) => row(spec, changed));
  parent.replaceChildren(...rows.map((entry) => entry.element));
  return (state, disabled) => rows.forEach((entry) => entry.show(state[entry.key], disabled));
}

function row({ key, label, unit, min, max, step, bands }, changed) {
  const input = (type) => Object.assign(document.createElement("input"), { type, min, max, step });
  const [slider, number] = [input("range"), input("number")];
  number.setAttribute("aria-label", `${label} [${unit}]`);
  slider.setAttribute("aria-label", label);
  slider.addEventListener("input", () => changed(key, +slider.value));
  number.addEventListener("change", () => number.value !== "" && changed(key, +number.value));
  const track = Object.assign(document.createElement("div"), { className: "track" });
  track.append(slider, ...bands.map((band) => bar(band, min, max)));
  const element = Object.assign(document.createElement("div"), { className: "control" });
  const text = (content) => Object.assign(document.createElement("span"), { textContent: content });
  element.append(text(label), track, number, text(unit));
  const show = (value, disabled) => {
    slider.disabled = number.disabled = disabled;
    slider.value = value;
    slider.setAttribute("aria-valuetext", `${value} ${unit}`);
    // what somebody is typing is theirs
    if (document.activeElement !== number) number.value = value;
  };
  return { key, element, show };
}

/** A bar under the part of a slider between two values. */
function bar([from, to], min, max) {
  // the middle of a thumb travels 16 pixels less than the width of its slider
  const at = (value) => Math.min(Math.max((value - min) / (max - min), 0), 1);
  const place = (share) => `calc(8px + (100% - 16px) * ${share})`;
  const element = document.createElement("i");
  element.style.left = place(at(from));
  element.style.right = `calc(100% - (${place(at(to))}))`;
  element.title = `trained from ${+from.toPrecision(3)} to ${+to.toPrecision(3)}`;
  return element;
}
