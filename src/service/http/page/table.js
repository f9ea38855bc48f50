// A table of states: the columns of a trial, SI units and radians by name, and the batches made of it.

import { gravity } from "./matrix.js";

const NUMBERS = [
  "t", "vx", "vy", "vz", "cx", "cy", "cz", "wx", "wy", "wz", "roll", "pitch", "yaw", "depth", "water_level", "bed_clearance", "bed",
  "ax", "ay", "az", "alx", "aly", "alz", "rho", "fx", "fy", "fz", "mx", "my", "mz",
];
/** Most rows that are answered: of longer tables every second, third and so on. */
const MOST_ROWS = 8192;
/** Rows of one request. */
const ROWS_A_BATCH = 2048;

/** The numbers of the known columns by name; what is unknown is listed in `ignored`, and `every` says which rows were taken. */
export function parse(text) {
  const lines = text.split(/\r?\n/).filter((line) => line.trim() !== "");
  const names = (lines.shift() ?? "").split(",").map((name) => name.trim().replace(/^"|"$/g, ""));
  const missing = ["vx", "vy", "vz"].filter((name) => !names.includes(name));
  if (missing.length > 0) throw new Error(`column ${missing.join(", ")} is missing; there are: ${names.join(", ")}`);
  if (!names.includes("depth") && !names.includes("water_level")) throw new Error("column depth is missing, or water_level in its place");
  if (lines.length === 0) throw new Error("the table has no rows");
  const every = Math.ceil(lines.length / MOST_ROWS);
  const columns = Object.fromEntries(names.filter((name) => NUMBERS.includes(name)).map((name) => [name, []]));
  lines.forEach((line, row) => {
    if (row % every > 0) return;
    const cells = line.split(",");
    names.forEach((name, column) => {
      if (!(name in columns)) return;
      const cell = (cells[column] ?? "").trim();
      const value = cell === "" ? NaN : Number(cell);
      if (cell !== "" && Number.isNaN(value)) throw new Error(`row ${row + 2}: "${cell}" in column ${name} is no number`);
      columns[name].push(value);
    });
  });
  const ignored = names.filter((name) => !NUMBERS.includes(name) && name !== "");
  const rows = columns.vx.length;
  columns.t ??= [...Array(rows).keys()];
  return { columns: withAccelerations(columns), rows, ignored, every };
}

/** Accelerations of the velocities where the table has none: of the components, and what turning adds. */
function withAccelerations(columns) {
  const { t } = columns;
  const derivative = (values) => values.map((_, row) => {
    const [before, after] = [Math.max(row - 1, 0), Math.min(row + 1, values.length - 1)];
    return t[after] > t[before] ? (values[after] - values[before]) / (t[after] - t[before]) : 0;
  });
  const zero = columns.vx.map(() => 0);
  const [v, w] = ["v", "w"].map((kind) => ["x", "y", "z"].map((axis) => columns[kind + axis] ?? zero));
  if (!columns.ax) {
    const [dx, dy, dz] = v.map(derivative);
    columns.ax = dx.map((rate, row) => rate + w[1][row] * v[2][row] - w[2][row] * v[1][row]);
    columns.ay = dy.map((rate, row) => rate + w[2][row] * v[0][row] - w[0][row] * v[2][row]);
    columns.az = dz.map((rate, row) => rate + w[0][row] * v[1][row] - w[1][row] * v[0][row]);
  }
  if (!columns.alx) [columns.alx, columns.aly, columns.alz] = w.map(derivative);
  return columns;
}

/** The message wade.v1.EvaluateBatchRequest of some rows. */
function batch(vehicle, { columns }, from, to) {
  const rows = [...Array(to - from).keys()].map((row) => row + from);
  const of = (name, otherwise = 0) => (row) => (Number.isFinite(columns[name]?.[row]) ? columns[name][row] : otherwise);
  const vectors = (names) => rows.flatMap((row) => names.map((name) => of(name)(row)));
  const numbers = (name, otherwise) => rows.map(of(name, otherwise));
  const message = {
    vehicle,
    velocity_mps: vectors(["vx", "vy", "vz"]),
    current_mps: vectors(["cx", "cy", "cz"]),
    angular_velocity_radps: vectors(["wx", "wy", "wz"]),
    acceleration_mps2: vectors(["ax", "ay", "az"]),
    angular_acceleration_radps2: vectors(["alx", "aly", "alz"]),
    gravity_direction: rows.flatMap((row) => gravity(of("roll")(row), of("pitch")(row))),
    density_kgpm3: numbers("rho", 1000),
    omit_surfaces: true,
  };
  if (columns.depth) message.depth_m = numbers("depth", "NaN");
  if (columns.water_level) message.water_level_m = numbers("water_level", "NaN");
  if (columns.bed_clearance) message.bed_clearance_m = numbers("bed_clearance", "NaN");
  if (columns.bed) message.bed = numbers("bed", "NaN");
  if (columns.yaw) message.heading_rad = numbers("yaw", 0);
  return message;
}

/** The forces of each row, of the version that is served or of another. */
export async function evaluate(post, vehicle, table, version, progress) {
  const out = { force: [], moment: [], deviation: [], in_domain: [] };
  for (let from = 0; from < table.rows; from += ROWS_A_BATCH) {
    progress(from / table.rows);
    const answer = await post(`/v1/batch${version ? `?version=${version}` : ""}`, batch(vehicle, table, from, Math.min(from + ROWS_A_BATCH, table.rows)));
    out.force.push(...answer.force);
    out.moment.push(...answer.moment);
    out.deviation.push(...answer.uncertainty.force);
    out.in_domain.push(...answer.in_domain);
    out.version = answer.version;
  }
  return out;
}

/** The message wade.v1.State of a row. */
export function stateOf({ columns }, row) {
  const value = (name, otherwise = 0) => (Number.isFinite(columns[name]?.[row]) ? columns[name][row] : otherwise);
  const vector = (a, b, c) => ({ x: value(a), y: value(b), z: value(c) });
  const level = Number.isFinite(columns.depth?.[row]) ? { depth_m: value("depth") } : { water_level_m: value("water_level") };
  return {
    velocity_mps: vector("vx", "vy", "vz"),
    current_mps: vector("cx", "cy", "cz"),
    angular_velocity_radps: vector("wx", "wy", "wz"),
    acceleration_mps2: vector("ax", "ay", "az"),
    angular_acceleration_radps2: vector("alx", "aly", "alz"),
    roll_pitch: { roll_rad: value("roll"), pitch_rad: value("pitch") },
    density_kgpm3: value("rho", 1000),
    ...level,
  };
}

/** A table of a drive that is generated: down a ramp into water, along the bed across a current, and out again. */
export function example(vehicle) {
  const [length, deepest] = [24, 0.3 * vehicle.height_m];
  const smooth = (x) => {
    const share = Math.min(Math.max(x, 0), 1);
    return share * share * (3 - 2 * share);
  };
  const lines = ["t,vx,vy,vz,cx,cy,cz,pitch,roll,depth"];
  for (let t = 0; t <= length; t += 0.05) {
    const [down, up] = [smooth((t - 3) / 5), smooth((t - 17) / 5)];
    const pitch = 0.12 * (smooth((t - 3) / 1.5) - smooth((t - 6.5) / 1.5) - smooth((t - 17) / 1.5) + smooth((t - 20.5) / 1.5));
    const current = 0.4 * (smooth((t - 9) / 2) - smooth((t - 14) / 2));
    const speed = 0.8 * (smooth(t / 2) - smooth((t - 22) / 2));
    const row = [t, speed, 0, 0, 0, -current, 0, pitch, 0.02 * Math.sin(2 * t) * down, deepest * (down - up)];
    lines.push(row.map((value) => value.toFixed(5)).join(","));
  }
  return lines.join("\n");
}
