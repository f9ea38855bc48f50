// Force, depth and attitude over time: of a table, or of a client that is followed.

import { drawChart, range } from "./chart.js";
import { short } from "./scale.js";
import { evaluate, parse, stateOf } from "./table.js";

const AXES = ["x", "y", "z"];
const DEGREES = 180 / Math.PI;
/** Samples of a live source that are kept. */
const KEPT = 2400;

const element = (id) => document.getElementById(id);

/** What the charts show; `chosen` is called with the row under the cursor. */
export class Drive {
  constructor(post, chosen) {
    Object.assign(this, { post, chosen, data: undefined, at: 0, charts: [] });
    this.figures = [
      { title: "force [N]", lines: (data) => this.forces(data) },
      { title: "depth [m]", lines: ({ depth }) => [{ name: "depth", values: depth, color: "z" }] },
      {
        title: "attitude [°]",
        lines: ({ roll, pitch }) => [
          { name: "pitch", values: pitch.map((x) => x * DEGREES), color: "x" },
          { name: "roll", values: roll.map((x) => x * DEGREES), color: "y" },
        ],
      },
    ];
    element("charts").replaceChildren(...this.figures.map((figure) => this.build(figure)));
    element("drive-time").addEventListener("input", (event) => this.go(+event.target.value));
    new ResizeObserver(() => this.draw()).observe(element("charts"));
  }

  build(figure) {
    const made = document.createElement("figure");
    figure.canvas = document.createElement("canvas");
    figure.canvas.setAttribute("role", "img");
    figure.caption = document.createElement("figcaption");
    figure.canvas.addEventListener("pointermove", (event) => event.buttons && this.point(figure, event.offsetX));
    figure.canvas.addEventListener("pointerdown", (event) => this.point(figure, event.offsetX));
    made.append(figure.caption, figure.canvas);
    return made;
  }

  point({ drawn }, px) {
    if (this.data?.t.length) this.go(drawn.rowAt(px));
  }

  /** Takes a table of this name for a vehicle, and another version to compare with. */
  async load(text, name, vehicle, version) {
    const table = parse(text);
    const say = (share) => this.note(`evaluating: ${Math.round(100 * share)} %`);
    const answer = await evaluate(this.post, vehicle, table, 0, say);
    const other = version ? await evaluate(this.post, vehicle, table, version, say) : undefined;
    const { columns } = table;
    const column = (name) => columns[name] ?? columns.vx.map(() => 0);
    const measured = AXES.map((axis) => columns[`f${axis}`]);
    this.data = {
      table, answer, other, measured, t: columns.t, depth: columns.depth ?? columns.water_level,
      roll: column("roll"), pitch: column("pitch"),
    };
    const outside = answer.in_domain.filter((inside) => !inside).length;
    const notes = [`${name}: ${table.rows} rows`];
    if (table.every > 1) notes.push(`one of every ${table.every} of the table`);
    if (outside > 0) notes.push(`${outside} outside the training domain`);
    if (table.ignored.length > 0) notes.push(`not used: ${table.ignored.join(", ")}`);
    this.note(notes.join("; "));
    // where the water is deepest
    this.go(this.data.depth.reduce((best, depth, row, all) => (depth > all[best] ? row : best), 0));
  }

  /** Adds what a live source said; the first sample begins a record. */
  record(seconds, { state, answer }) {
    if (!this.data?.live) {
      this.data = { live: true, t: [], depth: [], roll: [], pitch: [], answer: { force: [], deviation: [] }, measured: [] };
    }
    const { data } = this;
    const add = (list, value) => {
      list.push(value);
      if (list.length > KEPT) list.shift();
    };
    add(data.t, seconds);
    add(data.depth, state.depth);
    add(data.roll, state.roll);
    add(data.pitch, state.pitch);
    add(data.answer.force, answer.wrench.force);
    add(data.answer.deviation, answer.uncertainty.force);
    this.note(`live: ${data.t.length} samples, the last ${KEPT} are kept`);
    this.at = data.t.length - 1;
    this.draw();
  }

  clear() {
    this.data = undefined;
    this.note("");
    this.draw();
  }

  note(text) {
    element("drive-note").textContent = text;
  }

  /** The state of the row under the cursor, of a table. */
  row() {
    return this.data?.table && stateOf(this.data.table, this.at);
  }

  go(row) {
    this.at = row;
    this.draw();
    this.chosen();
  }

  forces({ answer, other, measured }) {
    const of = (rows, axis) => rows.map((force) => force[axis]);
    const lines = AXES.map((axis, k) => ({
      name: `F${axis}`, values: of(answer.force, k), spread: of(answer.deviation, k), color: axis,
    }));
    AXES.forEach((axis, k) => measured[k] && lines.push({ name: `F${axis} measured`, values: measured[k], color: axis, dash: [2, 3] }));
    if (other) AXES.forEach((axis, k) => lines.push({ name: `F${axis} of version ${other.version}`, values: of(other.force, k), color: axis, dash: [8, 4] }));
    return lines;
  }

  draw() {
    const { data } = this;
    const slider = element("drive-time");
    slider.disabled = !data?.table;
    slider.max = Math.max((data?.t.length ?? 1) - 1, 0);
    slider.value = this.at;
    if (data?.t.length) slider.setAttribute("aria-valuetext", `${short(data.t[this.at])} seconds`);
    for (const figure of this.figures) {
      const lines = data ? figure.lines(data) : [];
      figure.drawn = drawChart(figure.canvas, { t: data?.t ?? [], lines, at: this.at });
      const label = Object.assign(document.createElement("b"), { textContent: figure.title });
      figure.caption.replaceChildren(label, ...lines.map((line) => this.key(line)));
      const extremes = lines.map(({ name, values }) => `${name} from ${range([values]).map(short).join(" to ")}`);
      figure.canvas.setAttribute("aria-label", data ? `${figure.title} over time: ${extremes.join(", ")}` : `${figure.title}: no data yet`);
    }
  }

  /** An entry of the legend: its line and the value at the cursor. */
  key({ name, values, color, dash }) {
    const made = document.createElement("span");
    const line = document.createElement("i");
    line.style.borderTopColor = `var(--${color})`;
    if (dash) line.style.borderTopStyle = dash[0] < 5 ? "dotted" : "dashed";
    const value = values[this.at];
    made.append(line, Number.isFinite(value) ? `${name} ${short(value)}` : name);
    return made;
  }
}
