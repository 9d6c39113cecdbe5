// A live motion: an engine whose states become samples of a track.

import { Track } from "./track.js";

const MOST = 20000; // samples that are kept

/** Return an angle, turned by whole turns to where it was before. */
function goingOn(angle, before) {
  return angle + 2 * Math.PI * Math.round((before - angle) / (2 * Math.PI));
}

export class LiveMotion {
  /** `engine` moves the model; `run` is the recorded run of the same scene. */
  constructor(engine, run) {
    this.engine = engine;
    this.stage = run.stage;
    const { quantities } = engine.model.data;
    this.paths = quantities.map((one) => one.path);
    this.periodic = quantities.flatMap((one, k) => (one.periodic ? [k] : []));
    this.track = new Track(run.stage.stride, run.stage.frames.keys.length, this.paths);
    const { bodies, nodes } = engine.model.data;
    const { keys, bodies: bodyOf, turns, columns } = run.stage.frames;
    const bodyAt = new Map(bodies.map((one, k) => [one.index, k]));
    const nodeAt = new Map(nodes.map((one, k) => [one.node, k]));
    this.sources = run.stage.stride === 12
      ? keys.map((key) => 12 * bodyAt.get(key))
      : keys.map((key, k) => ({
        place: 3 * nodeAt.get(key), body: 12 * bodyAt.get(bodyOf[k]), turn: turns[k], column: columns[key],
      }));
    this.pulls = new Set(engine.model.modes.flatMap((mode) => mode.data.pulls.map(([node]) => node)));
    this.loads = new Set(engine.model.modes.flatMap((mode) => mode.data.paths.loads ?? []));
    this.energies = [];
    this.wanted = () => []; // of what reads reactions, which takes longer, the paths that are looked at
    this.begin();
  }

  get status() {
    return this.engine.status;
  }

  get time() {
    return this.engine.time;
  }

  begin() {
    this.track.clear();
    this.energies.length = 0;
    this.sample();
  }

  /** Keep the present state as a sample. */
  sample() {
    const { track } = this;
    if (track.times.length && track.last >= this.engine.time) {
      for (const list of [track.times, track.poses, track.values, this.energies]) list.pop();
    }
    if (track.times.length >= MOST) {
      for (const list of [track.times, track.poses, track.values, this.energies]) list.splice(0, MOST / 10);
    }
    const asked = new Set(this.wanted());
    const values = Float64Array.from(this.paths, (path) => (this.loads.has(path) && !asked.has(path) ? NaN : this.value(path)));
    const last = track.values[track.values.length - 1];
    if (last) for (const k of this.periodic) values[k] = goingOn(values[k], last[k]);
    track.add(this.engine.time, this.frames(), values);
    this.energies.push(this.engine.energy());
  }

  /** Return a quantity now; what the present mode has not is no number. */
  value(path) {
    try {
      return this.engine.value(path);
    } catch {
      return NaN;
    }
  }

  /** Return the node that is pulled where a part is taken hold of at a place: the nearest one, of that part if it can be. */
  nodeAt(part, place) {
    const places = this.engine.places();
    const apart = (k) => Math.hypot(...[0, 1, 2].map((i) => places[3 * k + i] - place[i]));
    const all = this.engine.model.data.nodes.map((one, k) => ({ ...one, apart: apart(k) })).filter((one) => this.pulls.has(one.node));
    const own = all.filter((one) => one.connectors.some((path) => path.startsWith(`${part}.`)));
    return (own.length ? own : all).sort((a, b) => a.apart - b.apart)[0] ?? null;
  }

  /** Pull a node to a place, or let go (null). */
  pull(node, place) {
    return node === null ? this.engine.drag(null) : this.engine.drag(node, place);
  }

  /** Put a node as near to a place as it can be, at rest. */
  put(node, place) {
    const status = this.engine.place(node, place);
    if (status.code !== "refused") this.sample();
    return status;
  }

  /** Return the frames of the stage, from where the engine says that bodies and nodes are. */
  frames() {
    const found = new Float64Array(this.track.width);
    const poses = this.engine.poses();
    if (this.stage.stride === 12) {
      this.sources.forEach((from, k) => found.set(poses.subarray(from, from + 12), 12 * k));
      return found;
    }
    const places = this.engine.places();
    this.sources.forEach(({ place, body, turn, column }, k) => {
      found[3 * k] = column ?? places[place];
      found[3 * k + 1] = places[place + 2];
      found[3 * k + 2] = Math.atan2(poses[body + 9], poses[body + 3]) + turn;
    });
    // Angles go on where they were, so that nothing turns back between two samples.
    const { poses: before } = this.track;
    if (before.length) {
      const last = before[before.length - 1];
      for (let k = 2; k < found.length; k += 3) found[k] = goingOn(found[k], last[k]);
    }
    return found;
  }

  /** Move on to a time, or as far as the milliseconds allow, with samples on the way. */
  advance(time, milliseconds) {
    const begun = performance.now();
    const span = Math.max(1 / 60, (time - this.engine.time) / (MOST / 10));
    let status = { code: "reached", text: "" };
    while (this.engine.time < time) {
      const left = milliseconds - (performance.now() - begun);
      if (left <= 0) return { code: "working", text: "" };
      const next = this.engine.time + span < time - 1e-9 * span ? this.engine.time + span : time;
      status = this.engine.advance(next, { steps: 1e6, milliseconds: left });
      if (this.engine.time > this.track.last) this.sample();
      if (status.code !== "reached") break;
    }
    return status;
  }

  /** Set parameters, starts or inputs; what was before goes where the engine begins anew. */
  set(path, value) {
    const before = this.engine.time;
    const status = this.engine.set(path, value);
    if (status.code === "refused") return status;
    if (this.engine.time < before || this.track.times.length < 2) this.begin();
    else this.sample();
    return status;
  }

  reset() {
    const status = this.engine.reset();
    this.begin();
    return status;
  }
}
