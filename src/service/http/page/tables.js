// Everything in words and numbers.

import { PHYSICS } from "./controls.js";
import { css, short } from "./scale.js";

/** Quantities of the training domain and of the effects' box: in words, and their unit. */
const QUANTITIES = {
  speed_mps: ["speed", "m/s"], angle_rad: ["flow angle", "rad"], density_kgpm3: ["density", "kg/m³"], depth_m: ["depth", "m"],
  tilt_rad: ["tilt", "rad"], vertical_speed_mps: ["vertical speed", "m/s"], angular_speed_radps: ["angular speed", "rad/s"],
  distance: ["distance to the training states", "times their usual spacing"], acceleration_mps2: ["acceleration", "m/s²"],
};
const TRANSPORTS = {
  grpc_unary: "gRPC, TCP", grpc_batch: "gRPC batch, TCP", grpc_stream: "gRPC stream, TCP", uds_unary: "gRPC, Unix socket",
  uds_batch: "gRPC batch, Unix socket", uds_stream: "gRPC stream, Unix socket", shm: "shared memory",
  shm_batch: "shared memory batch", http: "this page (JSON)", grpc_infer: "inference protocol, TCP",
  uds_infer: "inference protocol, Unix socket",
};

const element = (id) => document.getElementById(id);
const fixed = (value) => value.toFixed(2).replace(/^-(0\.00)$/, "$1");
const words = (name) => name.replaceAll("_", " ");

function cell(tag, content, className = "") {
  const made = Object.assign(document.createElement(tag), { className });
  made.append(...[content].flat());
  return made;
}

function row(tag, cells, className) {
  const made = cell("tr", cells.map((content) => cell(tag, content)));
  if (className) made.className = className;
  return made;
}

function swatch(color) {
  const made = document.createElement("i");
  made.style.background = css(color);
  return made;
}

export function showWrench(answer, vehicle) {
  const { force_n: force, moment_nm: moment, about_m: about } = answer.wrench;
  for (const axis of "xyz") {
    element(`force-${axis}`).textContent = fixed(force[axis]);
    element(`std-${axis}`).textContent = fixed(answer.uncertainty_n[axis]);
    element(`moment-${axis}`).textContent = fixed(moment[axis]);
  }
  const weight = 9.81 * vehicle.mass_kg;
  const center = ["x", "y", "z"].map((axis) => about[axis].toFixed(3)).join(", ");
  element("about").textContent = `Moment about the center of mass (${center}) m. The vertical force is ` +
    `${Math.round((100 * force.z) / weight)} % of the weight (${weight.toFixed(0)} N). Computed in ${(answer.compute_ns * 1e-3).toFixed(0)} µs.`;
}

/** The net wrench of another version below that of the answer, with the difference; hidden where there is none. */
export function showOther(other, answer) {
  document.querySelectorAll(".compared").forEach((line) => { line.hidden = !other; });
  if (!other) return;
  for (const [name, unit] of [["force", "N"], ["moment", "N m"]]) {
    element(`other-${name}`).textContent = `version ${other.version}, ${name} [${unit}]`;
    element(`other-difference-${name}`).textContent = "minus the one served";
    ["x", "y", "z"].forEach((axis, k) => {
      const [theirs, ours] = [other[name][0][k], answer.wrench[name][k]];
      element(`other-${name}-${axis}`).textContent = fixed(theirs);
      element(`other-difference-${name}-${axis}`).textContent = fixed(theirs - ours);
    });
  }
}

/** The net force for a screen reader, when it has not changed for a while. */
let spoken;
export function speak(answer) {
  clearTimeout(spoken);
  const [x, y, z] = answer.wrench.force.map(short);
  const text = `Net force ${x}, ${y}, ${z} newtons; ${domainOf(answer)}.`;
  spoken = setTimeout(() => { element("summary").textContent = text; }, 800);
}

/** Where the state is to the training data. */
function domainOf(answer) {
  if (!answer.in_domain) return "outside the training domain";
  return answer.provenance === PHYSICS ? "physical base alone, without training data" : "inside the training domain";
}

export function showFlags(answer) {
  element("bundle").textContent = `bundle version ${answer.bundle_version}, weights: ${answer.provenance}`;
  const excess = ({ quantity, excess }) => {
    const [name, unit] = QUANTITIES[quantity] ?? [quantity, ""];
    return `${name} by ${excess > 0 ? "+" : ""}${short(excess)} ${unit}`.trim();
  };
  const flag = (text, className) => cell("span", text, `flag ${className}`);
  const outside = answer.outside.map(excess).join(", ");
  const kind = answer.provenance === PHYSICS ? "" : "pass";
  const flags = [answer.in_domain ? flag(domainOf(answer), kind) : flag(`${domainOf(answer)}: ${outside}`, "notice")];
  if (answer.effects.length > 0) flags.push(flag(`${answer.effects.length} effects added`, ""));
  const far = answer.effects_outside.map(excess).join(", ");
  if (far) flags.push(flag(`outside what the effects were seen in: ${far}`, "notice"));
  element("flags").replaceChildren(...flags);
}

export function showRemarks(answer) {
  const remarks = answer.effects.filter((effect) => effect.left_out)
    .map((effect) => `${words(effect.name)} left out: ${words(effect.left_out)}`);
  if (!answer.in_domain) remarks.push("Outside the training domain the standard deviation is a lower bound.");
  if (answer.provenance === "analytic") remarks.push("The weights were trained on loads by formula, not on CFD.");
  element("remarks").replaceChildren(...remarks.map((text) => cell("li", text)));
}

/** The forces of each surface; `pointed` is told the surface under the mouse. */
export function showSurfaces(surfaces, answer, pointed) {
  const numbers = (force) => force.map(fixed);
  const head = row("th", ["surface", "wet", "Fx [N]", "Fy [N]", "Fz [N]", "|F| [N]"]);
  const lines = surfaces.map((surface, index) => {
    const made = row("td", [
      [swatch(surface.color), surface.name], `${Math.round(100 * surface.wet)} %`, ...numbers(surface.own), fixed(Math.hypot(...surface.own)),
    ]);
    made.addEventListener("mouseenter", () => pointed(index));
    made.addEventListener("mouseleave", () => pointed(undefined));
    return made;
  });
  const effects = answer.effects.map((effect) => {
    const { x, y, z } = effect.force_n;
    return row("td", [`+ ${words(effect.name)}`, "", ...numbers([x, y, z]), fixed(Math.hypot(x, y, z))]);
  });
  const { x, y, z } = answer.wrench.force_n;
  const sum = row("td", ["net force", "", ...numbers([x, y, z]), fixed(Math.hypot(x, y, z))], "sum");
  element("surfaces").replaceChildren(head, ...lines, ...effects, sum);
}

export function markSurface(index) {
  [...element("surfaces").rows].slice(1).forEach((line, at) => line.classList.toggle("pointed", at === index));
}

/** Percentiles of each transport: of the last full window, and of all since the start. */
export function showLatency({ latencies, window_s: window }) {
  const head = row("th", ["transport", "vehicle", "last", "p50 [µs]", "p99 [µs]", "all", "p50 [µs]", "p99 [µs]"]);
  const micros = (percentiles, name) => (percentiles.count > 0 ? percentiles[name].toFixed(1) : "–");
  const part = (percentiles) => [String(percentiles.count), micros(percentiles, "p50_us"), micros(percentiles, "p99_us")];
  const lines = latencies.filter((entry) => entry.since_start.count > 0).map((entry) => {
    const name = TRANSPORTS[entry.transport] ?? entry.transport;
    return row("td", [name, entry.vehicle, ...part(entry.window), ...part(entry.since_start)]);
  });
  element("latency").replaceChildren(head, ...lines);
  element("window").textContent = `From a request's arrival to its answer. Last: requests in the last full window of ` +
    `${window} s; all: since the server started.`;
}

export function showCurl(request) {
  const body = JSON.stringify(request, (_, value) => (typeof value === "number" ? +value.toPrecision(6) : value));
  element("curl").textContent = `curl -d '${body}' ${location.origin}/v1/query`;
}
