// The map of stability: a probability over speed and depth.

import { PROBABILITY, colorOf, gradient, short, ticks } from "./scale.js";
import { color } from "./theme.js";
import { prepared, roundTicks } from "./ticks.js";

const RAD = Math.PI / 180;
/** Speeds and depths of the first map and of the full one, which has 100,000 states. */
const SIZES = [40, 316];
const [LEFT, RIGHT, TOP, BOTTOM] = [56, 12, 10, 34];
const LINES = [0.05, 0.5];

/** What can be shown of an answer, 0 where the vehicle keeps its hold. */
const MODES = {
  risk: { label: "any loss of hold" },
  floats: { label: "it floats", of: (a) => a.floats },
  slides: { label: "it slides", of: (a) => a.slides },
  topples: { label: "it topples", of: (a) => a.topples },
  lost: { label: "it cannot be steered", of: (a) => a.steers?.map((row) => row.map((x) => 1 - x)) },
};

const element = (id) => document.getElementById(id);

function risk(answer) {
  const lists = Object.values(MODES).filter((mode) => mode.of).map((mode) => mode.of(answer)).filter(Boolean);
  return lists[0].map((row, i) => row.map((_, j) => Math.max(...lists.map((list) => list[i][j]))));
}

/**
 * The line along which a probability is reached: a piece in each square of four states (marching squares), as its two ends in shares
 * of the greatest speed and depth.
 */
function contour(rows, level) {
  const [n, m] = [rows.length - 1, rows[0].length - 1];
  const ends = [];
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < m; j++) {
      const corners = [[i, j], [i, j + 1], [i + 1, j + 1], [i + 1, j]];
      const values = corners.map(([a, b]) => rows[a][b] - level);
      const cuts = [];
      for (let k = 0; k < 4; k++) {
        const [a, b] = [values[k], values[(k + 1) % 4]];
        if (a < 0 !== b < 0) {
          const share = a / (a - b);
          const [from, to] = [corners[k], corners[(k + 1) % 4]];
          cuts.push([(from[1] + share * (to[1] - from[1])) / m, (from[0] + share * (to[0] - from[0])) / n]);
        }
      }
      // an even number, since the line leaves every square that it enters
      ends.push(...cuts);
    }
  }
  return ends;
}

export class StabilityMap {
  /** `post` asks the server, `choose` gets the state under the cursor as speed and depth. */
  constructor(post, choose) {
    Object.assign(this, { post, choose, canvas: element("map"), run: 0 });
    const select = element("map-mode");
    select.replaceChildren(...Object.entries(MODES).map(([value, { label }]) => new Option(label, value)));
    select.addEventListener("change", () => {
      this.drawn = undefined;
      this.draw();
    });
    element("map-gradient").style.background = gradient(PROBABILITY);
    element("map-ticks").replaceChildren(...ticks(PROBABILITY, 1).map((textContent) => Object.assign(document.createElement("span"), { textContent })));
    this.canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => this.move(...this.placeOf(offsetX, offsetY)));
    this.canvas.addEventListener("click", () => this.pick());
    this.canvas.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  /** Asks for the map of a vehicle up to a speed and a depth, coarse and then in full; `place` is the speed and depth that are read. */
  async show({ vehicle, direction, density, dry, friction, speed, depth, place }) {
    const run = ++this.run;
    Object.assign(this, { speed, depth, place: place.map((value, k) => Math.min(value, [speed, depth][k])) });
    const state = element("map-state");
    for (const size of SIZES) {
      state.textContent = `computing ${size * size} states …`;
      const axis = (top) => [...Array(size).keys()].map((k) => (top * k) / (size - 1));
      const request = {
        vehicle, depth_m: axis(depth), speed_mps: axis(speed), heading_rad: direction * RAD, density_kgpm3: density,
        friction_min: friction[0], friction_max: friction[1],
        ground_contact: dry ? "GROUND_CONTACT_DRY" : "GROUND_CONTACT_WETTED",
      };
      try {
        const answer = await this.post("/v1/stability", request);
        if (run !== this.run) return;
        this.answer = { ...answer, risk: risk(answer) };
        state.textContent = `${size * size} states in ${(answer.compute_ns * 1e-9).toFixed(1)} s, version ${answer.version}; friction ${short(answer.friction.min)} to ${short(answer.friction.max)}`;
      } catch (error) {
        if (run === this.run) state.textContent = error.message;
        return;
      }
      this.drawn = undefined;
      this.draw();
    }
  }

  shown() {
    const mode = element("map-mode").value;
    return mode === "risk" ? this.answer.risk : MODES[mode].of(this.answer);
  }

  sides() {
    const [width, height] = [this.canvas.clientWidth - LEFT - RIGHT, this.canvas.clientHeight - TOP - BOTTOM];
    return { width, height };
  }

  placeOf(px, py) {
    const { width, height } = this.sides();
    const share = (value) => Math.min(Math.max(value, 0), 1);
    return [share((px - LEFT) / width) * this.speed, share((TOP + height - py) / height) * this.depth];
  }

  move(speed, depth) {
    if (!this.answer) return;
    this.place = [speed, depth];
    this.draw();
  }

  press(event) {
    const step = event.shiftKey ? 0.1 : 0.01;
    const moves = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const move = moves[event.key];
    if (event.key === "Enter") this.pick();
    else if (move && this.answer) {
      const tops = [this.speed, this.depth];
      this.move(...this.place.map((value, k) => Math.min(Math.max(value + move[k] * step * tops[k], 0), tops[k])));
    } else return;
    event.preventDefault();
  }

  pick() {
    if (this.answer) this.choose(...this.place);
  }

  draw() {
    if (!this.answer || !this.canvas.clientWidth) return;
    const { rows, picture, lines } = (this.drawn ??= this.made());
    const { context, width: all, height: tall } = prepared(this.canvas);
    const { width, height } = this.sides();
    if (!rows) {
      context.fillStyle = color("text");
      context.fillText("a vehicle without wheels or tracks cannot be steered", LEFT, tall / 2);
    } else {
      context.imageSmoothingEnabled = true;
      context.drawImage(picture, LEFT, TOP, width, height);
      lines.forEach((cuts, at) => this.stroke(context, cuts, LINES[at], [width, height]));
    }
    this.axes(context, [all, tall], [width, height]);
    this.read();
  }

  /** What does not change while the point that is read moves. */
  made() {
    const rows = this.shown();
    return rows ? { rows, picture: this.picture(rows), lines: LINES.map((level) => contour(rows, level)) } : {};
  }

  /** A pixel a state, the deepest above. */
  picture(rows) {
    const canvas = new OffscreenCanvas(rows[0].length, rows.length);
    const context = canvas.getContext("2d");
    const image = context.createImageData(canvas.width, canvas.height);
    rows.forEach((row, depth) => row.forEach((value, speed) => {
      const at = 4 * ((rows.length - 1 - depth) * row.length + speed);
      colorOf(PROBABILITY, value, 1).forEach((part, k) => { image.data[at + k] = 255 * part; });
      image.data[at + 3] = 255;
    }));
    context.putImageData(image, 0, 0);
    return canvas;
  }

  /** A line of the map: dashed where the probability is small. */
  stroke(context, cuts, level, [width, height]) {
    context.strokeStyle = "#fff";
    context.lineWidth = 1.4;
    context.setLineDash(level < 0.1 ? [5, 4] : []);
    context.beginPath();
    cuts.forEach(([speed, depth], at) => context[at % 2 === 0 ? "moveTo" : "lineTo"](LEFT + width * speed, TOP + height * (1 - depth)));
    context.stroke();
    context.setLineDash([]);
  }

  axes(context, [all, tall], [width, height]) {
    context.fillStyle = color("faint");
    context.textBaseline = "middle";
    context.textAlign = "right";
    for (const tick of roundTicks(0, this.depth, 6)) context.fillText(short(tick), LEFT - 5, TOP + height * (1 - tick / this.depth));
    context.textAlign = "center";
    for (const tick of roundTicks(0, this.speed, 7)) context.fillText(short(tick), LEFT + (width * tick) / this.speed, tall - BOTTOM + 10);
    context.fillStyle = color("text");
    context.fillText("speed of the water [m/s]", LEFT + width / 2, tall - 8);
    context.save();
    context.translate(11, TOP + height / 2);
    context.rotate(-Math.PI / 2);
    context.fillText("depth [m]", 0, 0);
    context.restore();
    const [x, y] = [LEFT + (width * this.place[0]) / this.speed, TOP + height * (1 - this.place[1] / this.depth)];
    for (const [style, thick] of [["#000", 3], ["#fff", 1.4]]) {
      context.strokeStyle = style;
      context.lineWidth = thick;
      context.beginPath();
      context.arc(x, y, 6, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  /** The numbers under the cursor, of the nearest state. */
  read() {
    const { answer, place } = this;
    const [i, j] = [
      Math.round((place[1] / this.depth) * (answer.depth.length - 1)), Math.round((place[0] / this.speed) * (answer.speed.length - 1)),
    ];
    element("map-place").textContent = `${short(answer.depth[i])} m, ${short(answer.speed[j])} m/s`;
    const cells = (tag, texts) => texts.map((textContent, k) => Object.assign(document.createElement(k === 0 ? "th" : tag), { textContent }));
    const line = (tag, texts) => {
      const made = document.createElement("tr");
      made.append(...cells(tag, texts));
      return made;
    };
    const modes = ["floats", "slides", "topples", "steers"].filter((mode) => answer[mode]);
    const percent = (value) => `${(100 * value).toFixed(1)} %`;
    const rows = modes.map((mode) => line("td", [mode, percent(answer[mode][i][j]), answer.margins[mode][i][j].toFixed(2)]));
    const needed = answer.friction_needed[i][j];
    rows.push(line("td", ["friction needed", needed === null ? "it floats" : needed.toFixed(2), ""]));
    rows.push(line("td", ["training domain", answer.in_domain[i][j] ? "inside" : "outside", ""]));
    element("map-at").replaceChildren(line("th", ["", "probability", "margin"]), ...rows);
    this.canvas.setAttribute("aria-label", `Probability of a loss of hold over speed up to ${short(this.speed)} and depth up to ${short(this.depth)} meters. ` +
      "Arrow keys move the point that is read, Enter shows its state.");
  }
}
