// The page: picture, time, curves, values, what can be set, equations and parts, all of one state.

import { COLOURS, download, element, icon, nearMatches, shortNumber, unitText } from "./elements.js";
import { Track } from "./track.js";
import { LiveMotion } from "./live.js";
import { Plot, colourOf } from "./plots.js";
import { View } from "./view.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const FIRST_SLIDERS = 8; // where none are asked for
const FRAME_MS = 12; // what a frame may take for the motion

class Page {
  constructor(payload, createEngine, model, host) {
    Object.assign(this, { payload, embedded: host, speed: 1, playing: false, loops: true, time: 0 });
    this.runs = payload.runs.map((run, k) => ({
      ...run, track: Track.recorded(run), tint: payload.runs.length > 1 ? COLOURS[k % COLOURS.length] : null,
    }));
    this.units = new Map(this.runs.flatMap((run) => run.quantities.paths.map((p, k) => [p, run.quantities.units[k]])));
    this.shown = payload.show.filter((path) => this.units.has(path));
    this.arrows = new Set();
    this.vectors = [];
    this.mode = "recorded";
    this.reason = payload.reason;
    this.swings = payload.oscillation?.swings.map((one) => ({ ...one, track: Track.recorded(one) }));
    if (this.swings) this.speed = payload.oscillation.speed;
    if (model && createEngine) this.goLive(createEngine, model);
    this.time = this.track.first;
    this.build();
    this.readLink();
    this.show();
    if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches && !this.linked) this.play(true);
  }

  get track() {
    return this.live ? this.live.track : this.runs[0].track;
  }

  trackOf(run) {
    return this.live && run === this.runs[0] ? this.live.track : run.track;
  }

  goLive(createEngine, model) {
    const engine = createEngine(model, { rtol: this.payload.rtol });
    if (engine.status.code === "failed") {
      this.reason = engine.status.text;
      return;
    }
    this.live = new LiveMotion(engine, this.runs[0]);
    this.live.wanted = () => [...this.shown, ...this.vectors.filter((one) => this.arrows.has(one.kind)).flatMap((one) => one.paths)];
    this.mode = "live";
    for (const { path, unit } of engine.model.data.quantities) this.units.set(path, unit);
  }

  // -- the document ---------------------------------------------------------------------------------------------

  build() {
    const root = this.embedded?.root ?? document.getElementById("page");
    const still = this.embedded ? "" : document.getElementById("still");
    if (still) still.remove();
    const { payload } = this;
    const label = `Moving picture of ${payload.title}; arrow keys turn it, plus and minus come nearer and go away`;
    this.host = element("div", { class: "view", role: "application", tabindex: 0, "aria-label": label });
    this.tip = element("div", { class: "tip", role: "status", hidden: true });
    this.notice = element("p", { class: "notice", role: "alert", hidden: true });
    const badge = element("span", { class: `badge ${this.mode}`, title: this.reason || "" }, this.mode);
    root.append(
      element("header", {}, element("h1", {}, payload.title), badge, element("p", { class: "facts" }, payload.facts),
        this.reason ? element("p", { class: "facts" }, `Recorded: ${this.reason}`) : null),
      this.notice,
      element("main", {},
        element("section", { class: "stage", "aria-label": "Scene" }, this.host, this.tip, this.timeBar(), this.tools()),
        element("section", { class: "side", "aria-label": "Values and curves" }, ...this.tabs())),
    );
    this.watchPointer();
    if (document.createElement("canvas").getContext("webgl2")) this.view = new View(this.host, this.runs);
    else this.host.append(element("p", { class: "notice" }, "A moving picture needs WebGL, which this browser lacks."), still);
  }

  button(label, text, click, more = {}) {
    return element("button", { type: "button", "aria-label": label, title: label, onclick: click, ...more }, text);
  }

  timeBar() {
    this.playButton = this.button("Play", icon("play"), () => this.play(!this.playing));
    this.slider = element("input", {
      type: "range", min: 0, max: 1000, value: 0, step: "any", "aria-label": "Time", class: "time",
      oninput: () => this.seek(this.track.first + (Number(this.slider.value) / 1000) * (this.track.last - this.track.first)),
    });
    this.clock = element("output", { class: "clock", "aria-label": "Time, s" });
    this.pace = element("span", { class: "pace" });
    const speeds = element("select", { "aria-label": "Speed", onchange: (event) => { this.speed = Number(event.target.value); } },
      ...SPEEDS.map((one) => element("option", { value: one * this.speed, selected: one === 1 }, `${shortNumber(one * this.speed, 2)} ×`)));
    const loop = element("input", { type: "checkbox", checked: true, onchange: (event) => { this.loops = event.target.checked; } });
    this.marks = element("div", { class: "marks" });
    return element("div", { class: "timebar" },
      this.playButton, this.button("One step back", icon("back"), () => this.step(-1)), this.button("One step", icon("forward"), () => this.step(1)),
      this.button("Back to the start", icon("start"), () => this.reset()),
      element("div", { class: "track" }, this.slider, this.marks), this.clock, speeds,
      this.live ? this.pace : element("label", {}, loop, " loop"));
  }

  tools() {
    const paths = element("input", { type: "checkbox", checked: true, onchange: (event) => {
      if (this.view) this.view.showsPaths = event.target.checked;
      this.show();
    } });
    return element("div", { class: "tools" },
      this.button("Look from the front", "Front", () => this.view?.front()),
      element("label", {}, paths, " paths"),
      ...this.arrowChoices(),
      this.button("Save the picture", "PNG", () => this.view?.png().then((blob) => download(`${this.payload.name}.png`, blob))),
      this.button("Save all values", "CSV", () => this.saveTable()),
      this.button("Save a video", "WebM", (event) => this.video(event.currentTarget)),
      this.embedded ? null : this.button("Copy a link with what is set", "Link", (event) => this.copyLink(event.currentTarget)));
  }

  /** Return a switch and a scale for each kind of vectors that parts have. */
  arrowChoices() {
    this.vectors = vectorsOf([...this.units.keys()], this.units, this.runs[0].stage);
    return [...new Set(this.vectors.map((one) => one.kind))].map((kind, k) => {
      const box = element("input", { type: "checkbox", onchange: (event) => {
        if (event.target.checked) this.arrows.add(kind);
        else this.arrows.delete(kind);
        this.show();
      } });
      const of = this.vectors.filter((one) => one.kind === kind);
      for (const one of of) one.colour = COLOURS[(k + 1) % COLOURS.length];
      const scale = element("span", { class: "scale" });
      of.forEach((one) => { one.told = scale; });
      return element("label", {}, box, ` ${kind}`, scale);
    });
  }

  tabs() {
    const pages = [["Curves", this.curves()]];
    if (this.swings) pages.unshift(["Shape", this.shape()]);
    else pages.push(["Energy", this.energies()]);
    if (this.live) pages.unshift(["Set", this.settings()]);
    if (this.payload.equations) pages.push(["Equations", this.written(this.payload.equations)]);
    pages.push(["Parts", this.parts()], ["About", this.about()]);
    const list = element("div", { class: "tabs", role: "tablist" });
    this.panels = pages.map(([name, content], k) => {
      const id = `panel-${name.toLowerCase()}`;
      const panel = element("div", { class: "panel", role: "tabpanel", id, hidden: k > 0, "aria-label": name, tabindex: 0 }, content);
      const tab = element("button", {
        type: "button", role: "tab", "aria-selected": String(k === 0), "aria-controls": id, onclick: () => this.choose(name),
      }, name);
      list.append(tab);
      return { name, panel, tab };
    });
    return [list, ...this.panels.map((one) => one.panel)];
  }

  choose(name) {
    for (const one of this.panels) {
      one.panel.hidden = one.name !== name;
      one.tab.setAttribute("aria-selected", one.name === name);
    }
    this.show();
  }

  isOpen(name) {
    return this.panels?.some((one) => one.name === name && !one.panel.hidden);
  }

  // -- a small oscillation --------------------------------------------------------------------------------------

  /** Return how wide it is to be, and its shape as bars: to the right and to the left, or, with phases, their sizes. */
  shape() {
    const { shape, largest, first } = this.payload.oscillation;
    const out = element("output", { "aria-label": "Amplitude" });
    const swing = (k) => {
      const { track, energy } = this.swings[k];
      Object.assign(this.runs[0], { track, energy });
      if (!track.places.has(largest)) return;
      const values = track.series(largest);
      const half = 0.5 * (Math.max(...values) - Math.min(...values));
      out.textContent = `${largest} swings by ±${shortNumber(half, 3)}${unitText(this.units.get(largest))}`;
    };
    swing(first);
    const range = element("input", { type: "range", min: 0, max: this.swings.length - 1, step: 1, value: first, "aria-label": "Amplitude, in steps", class: "alone",
      oninput: () => { swing(Number(range.value)); this.show(); } });
    const isReal = shape.every((one) => one.signed !== null);
    const most = Math.max(...shape.map((one) => one.size)) || 1;
    const bars = shape.map(({ path, size, signed, degrees, unit }) => {
      const bar = element("span", { class: "bar" });
      const share = (isReal ? 50 : 100) * (size / most);
      bar.style.left = `${isReal ? (signed < 0 ? 50 - share : 50) : 0}%`;
      bar.style.width = `${share}%`;
      const value = isReal ? shortNumber(signed, 4) : `${shortNumber(size, 4)} at ${shortNumber(degrees, 3)}°`;
      return element("tr", {}, element("th", { scope: "row" }, path),
        element("td", {}, element("div", { class: isReal ? "bars signed" : "bars", "aria-hidden": true }, bar)),
        element("td", { class: "number" }, `${value}${unitText(unit)}`));
    });
    return element("div", {}, element("div", { class: "slider" }, element("label", {}, "Amplitude"), range, out),
      element("table", { class: "shape", "aria-label": "Shape of the mode" }, ...bars));
  }

  // -- curves ---------------------------------------------------------------------------------------------------

  curves() {
    const known = [...this.units.keys()];
    const list = element("datalist", { id: "paths" }, ...known.map((path) => element("option", { value: path })));
    const add = element("input", { list: "paths", placeholder: "a quantity, such as " + (known[0] ?? ""), "aria-label": "Quantity to show" });
    const over = element("select", { "aria-label": "Over what", onchange: (event) => { this.over = event.target.value; this.show(); } },
      element("option", { value: "" }, "over time"), ...known.map((path) => element("option", { value: path }, `over ${path}`)));
    const form = element("form", { class: "row", onsubmit: (event) => {
      event.preventDefault();
      if (this.showPath(add.value.trim())) add.value = "";
    } }, add, element("button", { type: "submit" }, "Show"), over);
    const canvas = element("canvas", { class: "plot", role: "img", "aria-label": "Curves of the quantities below" });
    this.plot = new Plot(canvas, {
      lines: () => this.lines(), xLabel: "time, s", onTime: (time) => (this.over ? null : this.seek(time)),
    });
    this.values = element("ul", { class: "values" });
    return element("div", {}, list, form, canvas, this.values);
  }

  /** Show a quantity; say what is like it where there is none. */
  showPath(path) {
    if (!this.units.has(path)) {
      this.say(`There is no quantity ${JSON.stringify(path)}.`, nearMatches(path, [...this.units.keys()]));
      return false;
    }
    if (!this.shown.includes(path)) this.shown.push(path);
    if (this.live) this.live.sample();
    this.say("");
    this.listValues();
    this.show();
    return true;
  }

  listValues() {
    this.values.replaceChildren(...this.shown.flatMap((path, q) => this.runs.map((run, r) => {
      if (!this.trackOf(run).places.has(path)) return "";
      const out = element("output", { "data-path": path, "data-run": r });
      const swatch = element("span", { class: "swatch" });
      swatch.style.background = colourOf(q, r, this.runs.length);
      const close = this.button(`Do not show ${path}`, "×", () => {
        this.shown.splice(this.shown.indexOf(path), 1);
        this.listValues();
        this.show();
      });
      const label = this.runs.length > 1 ? `${path}, ${run.label}` : path;
      return element("li", {}, swatch, element("span", { class: "path" }, label), out, element("span", { class: "unit" }, unitText(this.units.get(path))), close);
    })));
  }

  lines() {
    const dashes = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
    return this.shown.flatMap((path, q) => this.runs.flatMap((run, r) => {
      const track = this.trackOf(run);
      if (!track.places.has(path) || (this.over && !track.places.has(this.over))) return [];
      return [{
        label: path, unit: this.units.get(path), x: this.over ? track.series(this.over) : track.times, y: track.series(path),
        colour: colourOf(q, r, this.runs.length), dash: this.runs.length > 1 ? dashes[q % 4] : dashes[0],
        at: track.nearest(this.time),
      }];
    }));
  }

  energies() {
    const canvas = element("canvas", { class: "plot", role: "img", "aria-label": "Energies over time" });
    const stacked = element("canvas", { class: "plot", role: "img", "aria-label": "Kinetic and potential energies of the parts, stacked" });
    this.energyPlot = new Plot(canvas, { lines: () => this.energyLines(), xLabel: "time, s", onTime: (time) => this.seek(time) });
    this.partPlot = new Plot(stacked, { lines: () => this.partLines(), xLabel: "time, s", onTime: (time) => this.seek(time), stacked: true });
    this.drift = element("p", { class: "facts" });
    const legend = (names) => element("p", { class: "legend" }, ...names.flatMap((name, k) => {
      const swatch = element("span", { class: "swatch" });
      swatch.style.background = COLOURS[k % COLOURS.length];
      return [swatch, ` ${name}  `];
    }));
    this.partLegend = element("div");
    this.legend = legend;
    return element("div", {}, legend(["kinetic", "potential", this.live ? "total" : "total less work"]), canvas, this.drift,
      element("h2", {}, "By part"), this.partLegend, stacked);
  }

  energyPaths() {
    return [...this.track.places.keys()].filter((path) => /\.(kinetic|potential)_energy$/.test(path));
  }

  energyLines() {
    const run = this.runs[0];
    const live = this.live?.energies;
    const x = this.track.times;
    const all = live
      ? [live.map((one) => one.kinetic), live.map((one) => one.potential), live.map((one) => one.total)]
      : [run.energy.kinetic, run.energy.potential, run.energy.kinetic.map((k, i) => k + run.energy.potential[i] - run.energy.work[i])];
    return all.map((y, k) => ({ label: "", unit: "J", x, y: Array.from(y), colour: COLOURS[k] }));
  }

  /** Return the energies of the parts that change, each from its least value on, so that they can stand on one another. */
  partLines() {
    const all = this.energyPaths().map((path) => {
      const y = this.track.series(path);
      const least = Math.min(...y);
      return { label: path, unit: "J", x: this.track.times, y: y.map((one) => one - least) };
    });
    const sizes = all.map((line) => Math.max(...line.y));
    const changing = all.filter((_, k) => sizes[k] > 1e-6 * Math.max(...sizes));
    const told = changing.map((line) => line.label);
    if (told.join() !== this.partsTold) {
      this.partsTold = told.join();
      this.partLegend.replaceChildren(this.legend(told));
    }
    return changing.map((line, k) => ({ ...line, colour: COLOURS[k % COLOURS.length] }));
  }

  // -- what can be set --------------------------------------------------------------------------------------------

  settings() {
    const { parameters, starts } = this.live.engine;
    const chosen = this.payload.sliders;
    const all = [...parameters, ...starts];
    const asked = all.filter((one) => one.path in chosen);
    const first = asked.length ? asked : all.slice(0, FIRST_SLIDERS);
    const more = all.filter((one) => !first.includes(one));
    const rows = (some) => some.map((one) => this.sliderOf(one, chosen[one.path]));
    return element("div", { class: "settings" },
      this.button("Back to what the scene says", "As the scene says", () => this.asScene()), ...rows(first),
      more.length ? element("details", {}, element("summary", {}, `${more.length} more`), ...rows(more)) : null);
  }

  sliderOf(one, bounds) {
    const [low, high] = bounds ?? sliderRange(one);
    const text = one.path;
    const number = element("input", { type: "number", step: "any", value: one.value, "aria-label": `${text}, number` });
    const range = element("input", { type: "range", min: low, max: high, step: "any", value: one.value, "aria-label": text });
    const apply = (value, source) => {
      const status = this.set(one.path, value);
      if (status.code === "refused") return;
      this.embedded?.told({ [one.path]: value });
      for (const other of [number, range]) if (other !== source) other.value = value;
    };
    range.addEventListener("input", () => apply(Number(range.value), range));
    number.addEventListener("change", () => apply(Number(number.value), number));
    this.inputs = (this.inputs ?? new Map()).set(one.path, { number, range, value: one.value });
    return element("div", { class: "slider" }, element("label", {}, text, element("span", { class: "unit" }, unitText(one.unit))), range, number);
  }

  set(path, value) {
    const status = this.live.set(path, value);
    if (status.code === "refused" || status.code === "failed") this.say(status.text);
    else this.say("");
    this.time = this.live.time;
    this.show();
    return status;
  }

  /** Set what another one than the slider asks for. */
  put(path, value) {
    const status = this.set(path, value);
    if (status.code !== "refused") for (const input of [this.inputs.get(path).number, this.inputs.get(path).range]) input.value = value;
    return status;
  }

  asScene() {
    this.embedded?.told(null);
    this.live.set(Object.fromEntries([...this.inputs].map(([path, one]) => [path, one.value])));
    for (const one of this.inputs.values()) one.number.value = one.range.value = one.value;
    this.reset();
  }

  // -- what is written ----------------------------------------------------------------------------------------------

  written(html) {
    const made = element("div", { class: "written" });
    made.innerHTML = html; // made by the page's writer, which escapes all names
    const latex = this.payload.latex;
    if (latex) {
      made.prepend(this.button("Copy the equations as LaTeX", "Copy LaTeX", (event) => copy(latex, event.currentTarget)));
    }
    return made;
  }

  parts() {
    this.partPanel = element("div", { class: "part", "aria-live": "polite" }, element("p", {}, "Click a part in the picture, or choose one:"));
    const parts = this.runs[0].parts;
    const choice = element("select", { "aria-label": "Part", onchange: (event) => this.tellPart(event.target.value) },
      element("option", { value: "" }, "—"), ...parts.map((one) => element("option", { value: one.path }, `${one.path} (${one.kind})`)));
    this.partChoice = choice;
    const diagram = element("div", { class: "diagram" });
    diagram.innerHTML = this.payload.diagram;
    return element("div", {}, choice, this.partPanel, diagram);
  }

  tellPart(path) {
    const part = this.runs[0].parts.find((one) => one.path === path);
    if (!part) return;
    this.partChoice.value = path;
    const own = [...this.units.keys()].filter((one) => one.startsWith(`${path}.`));
    const table = (rows) => element("table", {}, ...rows.map((row) => element("tr", {}, ...row.map((cell, k) => element(k ? "td" : "th", {}, cell)))));
    this.partPanel.replaceChildren(
      element("h2", {}, part.path), element("p", {}, part.doc),
      table(part.parameters.map((one) => [one.name, `${one.value}${unitText(one.unit)}`, one.doc])),
      element("p", {}, `Connectors: ${part.connectors.join(", ") || "none"}`),
      element("ul", { class: "paths" }, ...own.map((one) => element("li", {}, this.button(`Show ${one}`, one, () => {
        if (this.showPath(one)) this.choose("Curves");
      })))));
  }

  about() {
    const rows = this.payload.about.map(([name, value]) => element("tr", {}, element("th", {}, name), element("td", {}, value)));
    return element("div", {}, element("table", {}, ...rows), element("pre", { class: "report" }, this.payload.report));
  }

  // -- time ---------------------------------------------------------------------------------------------------------

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    this.playButton.replaceChildren(icon(on ? "pause" : "play"));
    for (const name of ["aria-label", "title"]) this.playButton.setAttribute(name, on ? "Pause" : "Play");
    if (on && !this.live && this.time >= this.track.last) this.time = this.track.first;
    this.lastFrame = null;
    if (on) requestAnimationFrame((now) => this.tick(now));
  }

  /** Give back what the picture holds of the graphics card, of which a browser has few. */
  close() {
    this.play(false);
    this.view?.renderer.forceContextLoss();
  }

  tick(now) {
    if (!this.playing) return;
    const passed = this.lastFrame === null ? 0 : Math.min(0.1, (now - this.lastFrame) / 1000);
    this.lastFrame = now;
    if (this.live) this.tickLive(passed);
    else {
      this.time += passed * this.speed;
      if (this.time >= this.track.last) {
        if (this.loops) this.time = this.track.first;
        else { this.time = this.track.last; this.play(false); }
      }
    }
    this.show();
    requestAnimationFrame((next) => this.tick(next));
  }

  tickLive(passed) {
    if (this.time < this.live.time) { // what was is shown again up to now
      this.time = Math.min(this.live.time, this.time + passed * this.speed);
      return;
    }
    const [before, wanted] = [this.live.time, this.live.time + passed * this.speed];
    const status = this.live.advance(wanted, FRAME_MS);
    this.time = this.live.time;
    if (passed > 0) {
      const pace = (this.time - before) / passed;
      this.paceNow = 0.9 * (this.paceNow ?? this.speed) + 0.1 * pace;
      this.pace.textContent = this.paceNow < 0.9 * this.speed ? `${shortNumber(this.paceNow, 2)} of real time` : "";
    }
    if (status.code !== "reached" && status.code !== "working") {
      this.play(false);
      this.say(status.text);
    }
  }

  seek(time) {
    this.play(false);
    this.time = Math.min(this.track.last, Math.max(this.track.first, time));
    this.show();
  }

  step(way) {
    this.play(false);
    const k = this.track.nearest(this.time) + way;
    if (this.live && k >= this.track.times.length) {
      this.live.advance(this.live.time + 1 / 60, 1000);
      this.time = this.live.time;
    } else {
      this.time = this.track.times[Math.min(this.track.times.length - 1, Math.max(0, k))];
    }
    this.show();
  }

  reset() {
    if (this.live) {
      const status = this.live.reset();
      this.say(status.code === "failed" ? status.text : "");
    }
    this.time = this.track.first;
    this.show();
  }

  /** Move on to a time exactly, for `window.atwood`. */
  advance(time) {
    this.play(false);
    if (!this.live) {
      this.seek(time);
      return { code: this.time === time ? "reached" : "refused", text: this.time === time ? "" : "the record ends before" };
    }
    const status = this.live.advance(time, Infinity);
    this.time = this.live.time;
    this.show();
    return status;
  }

  // -- what is shown -----------------------------------------------------------------------------------------------

  show() {
    this.embedded?.moved();
    const { first, last } = this.track;
    this.slider.value = last > first ? (1000 * (this.time - first)) / (last - first) : 0;
    this.clock.textContent = `${this.time.toFixed(3)} s`;
    if (this.view) {
      for (const run of this.view.runs) {
        const source = this.runs[this.view.runs.indexOf(run)];
        const track = this.trackOf(source);
        const sample = track.before(this.time);
        this.view.draw(run, track.posesAt(this.time), sample);
        this.view.drawPaths(run, track, sample);
        if (source === this.runs[0]) this.view.drawArrows(run, this.presentVectors(track, sample));
      }
      this.view.render();
    }
    this.showValues();
    if (this.isOpen("Curves")) this.plot.draw(this.time);
    if (this.isOpen("Energy")) {
      this.energyPlot.draw(this.time);
      this.partPlot.draw(this.time);
      this.tellDrift();
    }
    this.showMarks();
  }

  showValues() {
    if (this.values && this.values.children.length === 0 && this.shown.length) this.listValues();
    for (const out of this.values?.querySelectorAll("output") ?? []) {
      const track = this.trackOf(this.runs[Number(out.dataset.run)]);
      const sample = track.nearest(this.time);
      out.textContent = String(track.value(out.dataset.path, sample));
      out.dataset.t = String(track.times[sample]);
    }
  }

  showMarks() {
    const events = this.live ? this.live.engine.events : this.runs[0].events;
    const { first, last } = this.track;
    const key = `${events.length} ${last}`;
    if (key === this.marked) return;
    this.marked = key;
    this.marks.replaceChildren(...events.slice(-200).filter((one) => one.time >= first).map((one) => {
      const mark = element("span", { title: `${one.part}: ${one.message} at ${shortNumber(one.time)} s` });
      mark.style.left = `${(100 * (one.time - first)) / (last - first || 1)}%`;
      return mark;
    }));
  }

  tellDrift() {
    const totals = this.energyLines()[2].y;
    const drift = Math.max(...totals.map((one) => Math.abs(one - totals[0])));
    this.drift.textContent = `${this.live ? "The total" : "Total less work"} has changed by ${shortNumber(drift, 2)} J.`;
  }

  presentVectors(track, sample) {
    return this.vectors.filter((one) => this.arrows.has(one.kind)).flatMap((one) => {
      const vector = one.paths.map((path) => (path && track.places.has(path) ? track.value(path, sample) : 0));
      one.largest = Math.max(one.largest ?? 0, Math.hypot(...vector));
      const largest = Math.max(...this.vectors.filter((other) => other.kind === one.kind).map((other) => other.largest ?? 0));
      const scale = largest > 0 ? (0.3 * this.view.radius) / largest : 0;
      one.told.textContent = scale ? ` ${shortNumber(0.1 * this.view.radius / scale, 2)}${unitText(one.unit)} per ${shortNumber(0.1 * this.view.radius, 2)} m` : "";
      return [{ part: one.part, vector, colour: one.colour, scale }];
    });
  }

  say(text, near = []) {
    this.notice.hidden = !text;
    this.notice.textContent = near.length ? `${text} Did you mean ${near.join(" or ")}?` : text;
  }

  watchPointer() {
    this.host.addEventListener("pointermove", (event) => {
      const found = event.buttons ? null : this.view?.pick(event);
      this.tip.hidden = !found;
      if (!found) return;
      this.tip.textContent = found.part;
      const box = this.host.getBoundingClientRect();
      this.tip.style.left = `${event.clientX - box.left + 12}px`;
      this.tip.style.top = `${event.clientY - box.top + 12}px`;
    });
    this.host.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    const keys = {
      ArrowLeft: () => this.view.turn(-0.12, 0), ArrowRight: () => this.view.turn(0.12, 0),
      ArrowUp: () => this.view.turn(0, 0.12), ArrowDown: () => this.view.turn(0, -0.12),
      "+": () => this.view.zoom(1.15), "-": () => this.view.zoom(1 / 1.15),
    };
    this.host.addEventListener("keydown", (event) => {
      if (!this.view || !(event.key in keys)) return;
      event.preventDefault();
      keys[event.key]();
    });
    let pressed = null;
    this.host.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
    if (this.live) this.watchPulls();
    this.host.addEventListener("click", (event) => {
      const moved = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4;
      const found = moved ? null : this.view?.pick(event); // a drag turns the picture
      if (!found) return;
      this.tellPart(found.part);
      this.choose("Parts");
    });
  }

  /** Let a part be pulled by the pointer: by a spring while the scene moves; at rest it is put where it can be. */
  watchPulls() {
    let held = null;
    this.host.addEventListener("pointerdown", (event) => {
      const found = event.button === 0 && this.view?.pick(event);
      const node = found && this.time === this.live.time ? this.live.nodeAt(found.part, found.point.toArray()) : null;
      if (!node) return;
      held = { node: node.node, point: found.point, rests: !this.playing };
      this.view.controls.enabled = false;
      this.host.setPointerCapture(event.pointerId);
    }, true);
    this.host.addEventListener("pointermove", (event) => {
      if (!held) return;
      const place = this.view.under(event, held.point).toArray();
      const status = held.rests ? this.live.put(held.node, place) : this.live.pull(held.node, place);
      this.say(["refused", "failed"].includes(status.code) ? status.text : "");
      this.show();
    });
    for (const name of ["pointerup", "pointercancel"]) {
      this.host.addEventListener(name, () => {
        if (held && !held.rests) this.live.pull(null);
        held = null;
        if (this.view) this.view.controls.enabled = true;
      });
    }
  }

  // -- out of the page --------------------------------------------------------------------------------------------

  saveTable() {
    const { track } = this;
    const quote = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const rows = [["time", ...track.paths].map(quote).join(",")];
    track.times.forEach((time, k) => rows.push([time, ...track.values[k]].join(",")));
    download(`${this.payload.name}.csv`, `${rows.join("\n")}\n`, "text/csv");
  }

  video(button) {
    if (this.recorder) {
      this.recorder.stop();
      return;
    }
    if (!this.view || typeof MediaRecorder === "undefined") {
      this.say("This browser cannot record videos.");
      return;
    }
    const recorder = new MediaRecorder(this.view.renderer.domElement.captureStream(30), { mimeType: "video/webm" });
    const pieces = [];
    recorder.ondataavailable = (event) => pieces.push(event.data);
    recorder.onstop = () => {
      this.recorder = null;
      button.textContent = "WebM";
      download(`${this.payload.name}.webm`, new Blob(pieces, { type: "video/webm" }));
    };
    this.recorder = recorder;
    recorder.start();
    button.textContent = "Stop";
    this.play(true);
  }

  copyLink(button) {
    const changed = this.live ? [...this.inputs].filter(([, one]) => Number(one.number.value) !== one.value) : [];
    const said = [["t", this.time], ...changed.map(([path, one]) => [path, one.number.value]), ["show", this.shown.join(",")]];
    const hash = said.map(([key, value]) => `${encodeURIComponent(key)}=${encodeURIComponent(value)}`).join("&");
    copy(`${window.location.href.split("#")[0]}#${hash}`, button);
  }

  /** Set what a link asks for; what it names wrongly is said. */
  readLink() {
    const asked = this.embedded ? [] : [...new URLSearchParams(window.location.hash.slice(1))];
    this.linked = asked.length > 0;
    const settable = this.live ? [...this.inputs.keys()] : [];
    const problems = [];
    let time = null;
    for (const [key, text] of asked) {
      if (key === "t") time = Number(text);
      else if (key === "show") {
        const paths = text.split(",").filter(Boolean);
        this.shown = paths.filter((path) => this.units.has(path));
        this.listValues();
        for (const path of paths) if (!this.units.has(path)) problems.push(this.unknown(path, [...this.units.keys()]));
      } else if (!settable.includes(key)) problems.push(this.unknown(key, settable));
      else {
        const status = this.put(key, Number(text));
        if (status.code === "refused") problems.push(status.text);
      }
    }
    if (time !== null && Number.isFinite(time)) {
      const status = this.advance(time);
      if (status.code !== "reached") problems.push(status.text || `t = ${time} s was not reached.`);
    } else if (time !== null) problems.push("t is no number.");
    if (problems.length) this.say(`The link asks for what cannot be had. ${problems.join(" ")}`);
  }

  unknown(path, known) {
    const near = nearMatches(path, known);
    return `There is no ${JSON.stringify(path)}${near.length ? `; did you mean ${near.join(" or ")}?` : "."}`;
  }
}

/** Return vectors that parts have as quantities with components, each with its kind and where its components are. */
function vectorsOf(paths, units, stage) {
  const found = new Map();
  for (const path of paths) {
    const match = /^(.*)\.(force|velocity|acceleration|torque|angular_velocity|angular_momentum|momentum)\.([xyz])$/.exec(path);
    if (!match || !stage.anchors[match[1]]) continue;
    const [, part, kind, axis] = match;
    const key = `${part}.${kind}`;
    if (!found.has(key)) found.set(key, { part, kind: kind.replace("_", " "), unit: units.get(path), paths: [null, null, null] });
    found.get(key).paths["xyz".indexOf(axis)] = path;
  }
  return [...found.values()];
}

/** Return between what values a slider goes: declared bounds, or a few times the value. */
function sliderRange({ value, low, high, lower_open: lowerOpen, unit }) {
  const isAngle = unit === "rad";
  const size = Math.abs(value) || (isAngle ? Math.PI : 1);
  const least = low === 0 || low === null || low === undefined ? (value > 0 && !isAngle ? 0 : -3 * size) : low;
  const from = isAngle && low === null ? -Math.PI : Math.max(low ?? -Infinity, low === 0 ? 0 : least);
  const to = high ?? (isAngle ? Math.PI : value < 0 ? 0 : 3 * size);
  return [lowerOpen && from <= low ? low + 0.02 * (to - low) : from, Math.max(to, from)];
}

function copy(text, button) {
  const before = button.textContent;
  const told = (said) => {
    button.textContent = said;
    setTimeout(() => { button.textContent = before; }, 1500);
  };
  const another = () => { // in the frame of a notebook the clipboard is not to be had
    const field = element("textarea", { readonly: true }, text);
    button.after(field);
    field.select();
    const done = document.execCommand("copy");
    field.remove();
    if (done) told("Copied");
    else window.prompt("Copy this:", text);
  };
  (navigator.clipboard?.writeText(text) ?? Promise.reject(new Error())).then(() => told("Copied"), another);
}

/** Build the page, and give those who embed it a way to it; a `host` has a root, and is told what is set and that time moves. */
export function start(payload, createEngine, model, host = null) {
  const page = new Page(payload, createEngine, model, host);
  const { dataset } = host ? host.root : document.documentElement;
  if (page.reason) dataset.reason = page.reason;
  dataset.mode = page.mode;
  if (host) return page;
  window.atwood = {
    ready: true,
    get mode() { return page.mode; },
    get reason() { return page.reason; },
    get time() { return page.time; },
    get statistics() { return page.live ? page.live.engine.statistics : null; },
    value: (path) => (page.live && page.time === page.live.time
      ? page.live.engine.value(path) : page.track.value(path, page.track.nearest(page.time))),
    set: (path, value) => page.set(path, value),
    advance: (time) => page.advance(time),
    reset: () => page.reset(),
    play: (on) => page.play(on),
  };
  return page;
}
