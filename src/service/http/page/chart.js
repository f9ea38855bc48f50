// Lines over time on a canvas, with a cursor.

import { short } from "./scale.js";
import { color } from "./theme.js";
import { prepared, roundTicks } from "./ticks.js";

const LEFT = 62;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 22;

/** The smallest and greatest finite number of lists. */
export function range(lists) {
  let [low, high] = [Infinity, -Infinity];
  for (const list of lists) {
    for (const value of list) {
      if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

/**
 * Draws `lines`, each with `values`, the name of its `color`, `dash`, and `spread` where it has one, over the times `t`; a cursor
 * at row `at`.
 */
export function drawChart(canvas, { t, lines, at }) {
  const { context, width, height } = prepared(canvas);
  const [from, to] = range([t]);
  let [low, high] = range(lines.map((line) => line.values));
  const margin = 0.06 * (high - low) || 1;
  [low, high] = [low - margin, high + margin];
  const x = (time) => LEFT + ((time - from) / (to - from || 1)) * (width - LEFT - RIGHT);
  const y = (value) => TOP + ((high - value) / (high - low)) * (height - TOP - BOTTOM);
  context.fillStyle = color("faint");
  context.strokeStyle = color("rule");
  context.textBaseline = "middle";
  context.textAlign = "right";
  for (const tick of roundTicks(low, high, 4)) {
    stroke(context, [[LEFT, y(tick)], [width - RIGHT, y(tick)]]);
    context.fillText(short(tick), LEFT - 6, y(tick));
  }
  context.textAlign = "center";
  for (const tick of roundTicks(from, to, width / 110)) {
    context.fillText(`${short(tick)} s`, x(tick), height - BOTTOM / 2);
  }
  context.save();
  context.beginPath();
  context.rect(LEFT, TOP, width - LEFT - RIGHT, height - TOP - BOTTOM);
  context.clip();
  for (const line of lines.filter((line) => line.spread)) band(context, t, line, x, y);
  for (const { values, color: name, dash = [] } of lines) {
    context.strokeStyle = color(name);
    context.setLineDash(dash);
    context.lineWidth = 1.6;
    const points = [];
    values.forEach((value, row) => points.push(Number.isFinite(value) ? [x(t[row]), y(value)] : undefined));
    stroke(context, points);
  }
  context.setLineDash([]);
  context.strokeStyle = color("text");
  context.lineWidth = 1;
  if (t.length > 0 && at !== undefined) stroke(context, [[x(t[at]), TOP], [x(t[at]), height - BOTTOM]]);
  context.restore();
  return { rowAt: (px) => nearest(t, from + ((px - LEFT) / (width - LEFT - RIGHT)) * (to - from)) };
}

/** A line through points, broken where there is none. */
function stroke(context, points) {
  context.beginPath();
  let draws = false;
  for (const point of points) {
    if (point) context[draws ? "lineTo" : "moveTo"](...point);
    draws = Boolean(point);
  }
  context.stroke();
}

function band(context, t, { values, spread, color: name }, x, y) {
  const rows = [...t.keys()].filter((row) => Number.isFinite(values[row]) && Number.isFinite(spread[row]));
  context.beginPath();
  for (const row of rows) context.lineTo(x(t[row]), y(values[row] + spread[row]));
  for (const row of rows.reverse()) context.lineTo(x(t[row]), y(values[row] - spread[row]));
  context.globalAlpha = 0.16;
  context.fillStyle = color(name);
  context.fill();
  context.globalAlpha = 1;
}

function nearest(t, time) {
  let [low, high] = [0, t.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] < time) low = middle + 1;
    else high = middle;
  }
  return low > 0 && time - t[low - 1] < t[low] - time ? low - 1 : low;
}
