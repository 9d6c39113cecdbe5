// Curves of quantities over time or over each other, with the present time marked.

import { COLOURS, shortNumber, unitText } from "./elements.js";

const PAD = { left: 62, right: 12, top: 12, bottom: 34 };

/** A plot on a canvas: several curves over one axis; a click or a drag asks for a time. */
export class Plot {
  /** `lines` is a function that returns [{label, unit, x, y, colour, dash}]; `onTime` is told the time asked for. */
  constructor(canvas, { lines, xLabel, onTime = null, stacked = false }) {
    Object.assign(this, { canvas, lines, xLabel, onTime, stacked, now: 0 });
    const ask = (event) => {
      if (!this.onTime || !this.scale || (event.type === "pointermove" && !event.buttons)) return;
      const box = canvas.getBoundingClientRect();
      const { x0, x1 } = this.scale;
      const share = (event.clientX - box.left - PAD.left) / (box.width - PAD.left - PAD.right);
      this.onTime(x0 + Math.min(1, Math.max(0, share)) * (x1 - x0));
    };
    canvas.addEventListener("pointerdown", ask);
    canvas.addEventListener("pointermove", ask);
  }

  /** Draw everything; `now` is the present time, `points` where each curve is then. */
  draw(now = this.now) {
    this.now = now;
    const { canvas } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    const density = Math.min(window.devicePixelRatio || 1, 2);
    if (canvas.width !== width * density || canvas.height !== height * density) {
      [canvas.width, canvas.height] = [width * density, height * density];
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(density, 0, 0, density, 0, 0);
    pen.clearRect(0, 0, width, height);
    const lines = this.lines();
    const drawn = this.stacked ? stack(lines) : lines;
    this.scale = ranges(drawn, width, height);
    this.axes(pen, width, height, lines);
    drawn.forEach((line, k) => this.curve(pen, line, this.stacked ? drawn[k - 1] : null));
    this.mark(pen, drawn, height);
  }

  place(x, y) {
    const { x0, x1, y0, y1, width, height } = this.scale;
    return [PAD.left + ((x - x0) / (x1 - x0)) * width, PAD.top + height - ((y - y0) / (y1 - y0)) * height];
  }

  axes(pen, width, height, lines) {
    const { x0, x1, y0, y1 } = this.scale;
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = "#22303c";
    pen.strokeStyle = "#e3e8ed";
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    for (const value of ticks(x0, x1, width / 90)) {
      const [x] = this.place(value, y0);
      stroke(pen, [[x, PAD.top], [x, height - PAD.bottom]]);
      pen.textAlign = "center";
      pen.fillText(shortNumber(value, 4), x, height - PAD.bottom + 11);
    }
    for (const value of ticks(y0, y1, height / 40)) {
      const [, y] = this.place(x0, value);
      stroke(pen, [[PAD.left, y], [width - PAD.right, y]]);
      pen.textAlign = "right";
      pen.fillText(shortNumber(value, 4), PAD.left - 6, y);
    }
    pen.textAlign = "center";
    pen.fillText(this.xLabel, 0.5 * (PAD.left + width - PAD.right), height - 7);
    const units = [...new Set(lines.map((line) => unitText(line.unit).trim()))];
    if (units.length === 1 && units[0]) {
      pen.textAlign = "left";
      pen.fillText(units[0], 4, 8);
    }
  }

  curve(pen, line, below) {
    pen.strokeStyle = pen.fillStyle = line.colour;
    pen.setLineDash(line.dash ?? []);
    pen.lineWidth = 1.8;
    const points = line.x.map((x, k) => this.place(x, line.y[k]));
    if (this.stacked) {
      const under = line.x.map((x, k) => this.place(x, below ? below.y[k] : 0)).reverse();
      pen.globalAlpha = 0.75;
      pen.beginPath();
      [...points, ...under].forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      pen.fill();
      pen.globalAlpha = 1;
    } else {
      stroke(pen, points.filter(([, y]) => Number.isFinite(y)));
    }
    pen.setLineDash([]);
  }

  mark(pen, lines, height) {
    pen.strokeStyle = "#22303c";
    pen.lineWidth = 1;
    if (this.onTime) {
      const [x] = this.place(this.now, this.scale.y0);
      stroke(pen, [[x, PAD.top], [x, height - PAD.bottom]]);
    }
    for (const line of this.stacked ? [] : lines) {
      if (line.at === undefined || line.at < 0 || line.at >= line.x.length) continue;
      const [x, y] = this.place(line.x[line.at], line.y[line.at]);
      pen.fillStyle = line.colour;
      pen.beginPath();
      pen.arc(x, y, 4, 0, 2 * Math.PI);
      pen.fill();
    }
  }
}

function stroke(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}

/** Return curves on top of one another. */
function stack(lines) {
  let under = null;
  return lines.map((line) => {
    const y = line.y.map((value, k) => value + (under ? under[k] : 0));
    under = y;
    return { ...line, y };
  });
}

function ranges(lines, width, height) {
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const { x, y } of lines) {
    for (let k = 0; k < x.length; k += 1) {
      if (!Number.isFinite(x[k]) || !Number.isFinite(y[k])) continue;
      [x0, x1] = [Math.min(x0, x[k]), Math.max(x1, x[k])];
      [y0, y1] = [Math.min(y0, y[k]), Math.max(y1, y[k])];
    }
  }
  if (!(x1 >= x0)) [x0, x1, y0, y1] = [0, 1, 0, 1];
  if (x1 === x0) x1 = x0 + 1;
  const size = Math.max(Math.abs(y0), Math.abs(y1)) || 1;
  if (y1 - y0 <= 1e-9 * size) [y0, y1] = [y0 - 0.5 * size, y1 + 0.5 * size];
  const margin = 0.05 * (y1 - y0);
  const inside = { width: width - PAD.left - PAD.right, height: height - PAD.top - PAD.bottom };
  return { x0, x1, y0: y0 - margin, y1: y1 + margin, ...inside };
}

/** Return round numbers in a range. */
export function ticks(low, high, count) {
  const raw = (high - low) / Math.max(2, count);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= raw);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return found;
}

/** Return the colour of a curve: by quantity, or by run where there are several. */
export function colourOf(quantity, run, runs) {
  return COLOURS[(runs > 1 ? run : quantity) % COLOURS.length];
}
