// The engine of a live page: it keeps the memory of the printed routines and says what became of each request.

const STACK = 4096;                       // words for arrays of calls
const [REACHED, USED_UP, TOO_SMALL, , , NOTICED] = [0, 1, 2, 3, 4, 5];
const HELD = 1e-6;                        // what constraints may miss, in the scene's sizes
const LOW = 0.6, NEARBY = 0.3, SINGULAR = 1e-3; // shares of what was left of constraints at most

const status = (code, text = "") => ({code, text});
const shown = t => Number(t.toPrecision(9)).toString();

function near(word, known) {
  const parts = word.toLowerCase().split(".");
  return known.map(one => [parts.filter(part => one.toLowerCase().includes(part)).length, one])
    .filter(([count]) => count).sort((a, b) => b[0] - a[0]).slice(0, 3).map(([, one]) => one);
}

// The memory of a scene: one array, in which everything has its place.
function memoryOf(model, length) {
  const {words} = model.data;
  let end = 16 + STACK;
  const room = count => { const at = end; end += count; return at; };
  const places = {scratch: 0};
  for (const [name, [derived, , ...groups]] of Object.entries(words)) {
    places[name] = {derived: room(derived), outputs: groups.map(count => room(count))};
  }
  places.scratch = room(Math.max(...Object.values(words).map(one => one[1])));
  const n = model.data.coordinates.length, m = model.data.speeds.length, size = n + m;
  Object.assign(places, {
    n, m, size, padded: Math.ceil(size / 4) * 4, values: room(length), rates: room(8), time: room(1), y: room(size),
    yp: room(size), moved: room(size + m), session: room(Object.keys(FIELD).length + 8),
  });
  places.arrays = room(ROW.all * places.padded);
  return {M: new Float64Array(end), places};
}

function createEngine(model, options = {}) {
  const data = model.data, {M, places} = memoryOf(model, data.values.length);
  const {n, m, size, session} = places, F = [null];
  const rtol = options.rtol ?? 1e-8;
  M[0] = 16;
  const functions = model.open(M, F), method = steps(M, F);
  const held = functions.held ? {most: new Float64Array(data.constraints.length), largest: 0} : null;
  const values = Float64Array.from(data.values), own = Float64Array.from(data.values);
  const parameters = data.parameters.map(one => ({...one}));
  const starts = data.starts.map(one => ({...one}));
  const paths = new Map(data.quantities.map((one, i) => [one.path, i]));
  const state = new Float64Array(size);
  let time = data.start_time, now = status("ready"), evaluated = NaN, events = [], started = false;

  const field = name => M[session + FIELD[name]];
  const put = (name, value) => { M[session + FIELD[name]] = value; };
  const row = name => places.arrays + places.padded * ROW[name];
  const addressOf = f => F.push(f) - 1;

  // Call a program at a time and state in memory; return whether it has values.
  function call(name, t, y, more = 0) {
    const top = M[0], {derived, outputs} = places[name];
    M[0] = top + 4 + outputs.length;
    M[places.time] = t;
    [places.time, y, y + n, more].forEach((at, i) => { M[top + i] = at; });
    outputs.forEach((at, i) => { M[top + 4 + i] = at; });
    const code = functions[name](top, derived, places.scratch, top + 4);
    M[0] = top;
    return code === 0;
  }

  const outputs = (name, k) => {
    const count = data.words[name][2 + k], at = places[name].outputs[k];
    return M.subarray(at, at + count);
  };

  // Parameters go to all programs.
  function fill() {
    M.set(values, places.values);
    for (const name of Object.keys(data.words)) {
      functions[`${name}_prologue`](places.values, places[name].derived, places.scratch);
    }
    evaluated = NaN;
  }

  function open() {
    const block = [places.kernel.derived, places.scratch];
    if (functions.project) block.push(places.nearer.derived, places.scratch, places.moved);
    block.forEach((one, i) => { M[places.rates + i] = one; });
    put("arrays", places.arrays);
    put("size", size);
    put("padded", places.padded);
    put("function", addressOf(functions.rates));
    put("data", places.rates);
    if (functions.project) {
      put("project", addressOf(functions.project));
      put("project_data", places.rates + 2);
    }
    put("relative", Math.max(rtol * data.relative, 1e-15));
    put("longest", options.longest ?? Infinity);
    put("horizon", data.end_time > data.start_time ? data.end_time - data.start_time : 1);
    const absolute = row("absolute");
    M.fill(1, absolute, absolute + places.padded);
    data.tolerances.forEach((one, i) => { M[absolute + i] = (options.atol ?? rtol) * one; });
    fill();
  }

  // Take a state onto the constraints, and begin there; what stands in the way is said.
  function begin(t, y) {
    normalize(y);
    M.set(y, places.y);
    if (functions.project && functions.project(t, places.y, places.rates + 2) !== 0) {
      return status("failed", `at t = ${shown(t)} s the constraints cannot be met near this state`);
    }
    if (method.begin(session, t, places.y) !== 0) {
      return status("failed", `at t = ${shown(t)} s the equations have no finite value`);
    }
    take(t, places.y);
    return missed(t) ?? status("ready");
  }

  function take(t, from) {
    time = t;
    evaluated = NaN;
    state.set(M.subarray(from, from + size));
  }

  function normalize(y) {
    for (const turn of data.turns) {
      const length = Math.hypot(...turn.map(i => y[i]));
      for (const i of turn) y[i] /= length;
    }
  }

  // What is missed of all constraints, also of those that others make superfluous.
  function missed(t) {
    if (!held) return null;
    if (!call("held", t, places.y)) return status("failed", `at t = ${shown(t)} s a constraint has no finite value`);
    const [gaps, rates] = [outputs("held", 0), outputs("held", 1)], slopes = outputs("held", 2);
    for (let i = 0; i < gaps.length; i++) {
      let size = 0;
      for (let j = 0; j < m; j++) size = Math.max(size, Math.abs(slopes[i * m + j] * data.sizes[j]));
      size = Math.max(size, held.most[i] * NEARBY);
      if (size > 0 && !(Math.abs(gaps[i]) <= HELD * size && Math.abs(rates[i]) * data.time <= HELD * size)) {
        return status("failed", `at t = ${shown(t)} s ${data.constraints[i]} does not hold with these values`);
      }
    }
    return null;
  }

  // What is left of each kept constraint by the others: the least, as a share of the most that each has been.
  function independence(t, y) {
    if (!call("held", t, y)) return [0, 0];
    const slopes = outputs("held", 2), rows = [];
    for (const i of data.kept) {
      const one = Float64Array.from({length: m}, (_, j) => slopes[i * m + j] * data.sizes[j]);
      held.most[i] = Math.max(held.most[i], Math.hypot(...one));
      rows.push([i, one.map(x => x / (held.most[i] || 1))]);
    }
    let least = Infinity, which = 0;
    while (rows.length) {
      let best = 0, squares = -1;
      rows.forEach(([, one], k) => {
        const square = one.reduce((sum, x) => sum + x * x, 0);
        if (square > squares) [best, squares] = [k, square];
      });
      const [[i, pivot]] = rows.splice(best, 1);
      if (squares < least) [least, which] = [squares, i];
      for (const [, one] of rows) {
        const share = one.reduce((sum, x, j) => sum + x * pivot[j], 0) / (squares || 1);
        one.forEach((x, j) => { one[j] = x - share * pivot[j]; });
      }
    }
    return [Math.sqrt(Math.max(least, 0)), which];
  }

  // Whether a singular position lies within the last step: [time, constraint], or null.
  function singular(before) {
    const [t0, t1] = [field("t_old"), field("t")];
    const [after] = independence(t1, row("y"));
    held.largest = Math.max(held.largest, after);
    const low = Math.min(before, after) < LOW * held.largest;
    if (!low) return [after, null];
    const at = t => (method.interpolate(session, t, places.y, places.yp) === 0 ? independence(t, places.y) : [Infinity, 0]);
    const moments = Array.from({length: 13}, (_, k) => t0 + (t1 - t0) * k / 12), found = moments.map(t => at(t)[0]);
    const k = found.indexOf(Math.min(...found));
    let [a, b] = [moments[Math.max(k - 1, 0)], moments[Math.min(k + 1, 12)]];
    for (let i = 0; i < 40 && found[k] < NEARBY * held.largest; i++) {
      const [left, right] = [a + 0.382 * (b - a), a + 0.618 * (b - a)];
      if (at(left)[0] < at(right)[0]) b = right; else a = left;
    }
    const middle = 0.5 * (a + b), [least, which] = at(middle);
    return [after, least < SINGULAR * held.largest ? [middle, data.constraints[which]] : null];
  }

  function restart() {
    if (held) [held.largest] = [0];
    events = [];
    started = false;
    return begin(data.start_time, Float64Array.from(data.state));
  }

  function failure(t) {
    return status("failed", `at t = ${shown(t)} s no step is short enough: something has no value there, or changes too fast`);
  }

  function advance(target, limits = {}) {
    if (!Number.isFinite(target)) return (now = status("refused", "no time to go to"));
    if (["failed", "singular", "stopped"].includes(now.code)) return now;
    if (target < time) return (now = status("refused", `t = ${shown(target)} s lies before t = ${shown(time)} s: reset first`));
    const until = performance.now() + (limits.milliseconds ?? Infinity), most = limits.steps ?? Infinity;
    let left = held ? independence(field("t_old"), row("y_old"))[0] : 0;
    if (held) held.largest = Math.max(held.largest, left);
    put("stop", target);
    started = true;
    for (let count = 0; field("t") < target; count++) {
      if (count >= most || performance.now() > until) {
        take(field("t"), row("y"));
        return (now = status("working"));
      }
      const from = field("t"), turn = data.turns.some(strays);
      if (turn) {
        const y = M.slice(row("y"), row("y") + size);
        normalize(y);
        M.set(y, places.y);
        method.begin(session, from, places.y);
      }
      put("limit", field("steps") + 1);
      if (method.run(session) === TOO_SMALL) {
        take(from, row("y"));
        return (now = failure(from));
      }
      if (held) {
        const [after, found] = singular(left);
        left = after;
        if (found && found[0] <= target) {
          method.interpolate(session, found[0], places.y, places.yp);
          take(found[0], places.y);
          const text = `at t = ${shown(found[0])} s the position is singular: ${found[1]} follows from the other constraints`;
          return (now = status("singular", text));
        }
      }
    }
    if (field("t") === target) {
      take(target, row("y"));
    } else if (method.interpolate(session, target, places.y, places.yp) !== 0) {
      return (now = status("failed", `the equations have no value within a step, at t = ${shown(target)} s`));
    } else {
      if (functions.project) functions.project(target, places.y, places.rates + 2);
      take(target, places.y);
    }
    return (now = status("reached"));
  }

  const strays = turn => {
    const square = turn.reduce((sum, i) => sum + M[row("y") + i] ** 2, 0);
    return !(square > 0.25 && square < 4);
  };

  // Quantities, energies, poses and places at the present state, worked out once.
  function evaluate() {
    if (evaluated === time) return;
    M.set(state, places.y);
    functions.rates(time, places.y, places.yp, places.rates);
    call("quantities", time, places.y, places.yp + n);
    call("places", time, places.y);
    evaluated = time;
  }

  function value(path) {
    const i = paths.get(path);
    if (i === undefined) {
      const why = data.unknown[path], like = near(path, [...paths.keys()]);
      throw new Error(`${path}: ${why ?? `there is no such quantity${like.length ? `; perhaps ${like.join(", ")}` : ""}`}`);
    }
    evaluate();
    return outputs("quantities", 0)[i];
  }

  function set(path, number) {
    const wanted = typeof path === "string" ? {[path]: number} : path, chosen = [];
    for (const [name, one] of Object.entries(wanted)) {
      const known = parameters.find(each => each.path === name);
      if (!known) {
        const like = near(name, parameters.map(each => each.path));
        return status("refused", `${name}: it cannot be changed here${like.length ? `; perhaps ${like.join(", ")}` : ""}`);
      }
      const low = known.low === null || (known.lower_open ? one > known.low : one >= known.low);
      if (!Number.isFinite(one) || !low || (known.high !== null && one > known.high)) {
        return status("refused", `${name}: ${one} is not a value that it can have`);
      }
      chosen.push([known, one]);
    }
    const before = chosen.map(([known]) => [known, known.value]);
    const apply = list => { for (const [known, one] of list) { known.value = one; values[known.number] = one; } fill(); };
    apply(chosen);
    if (!started) return (now = restart());
    const [t, y] = [time, Float64Array.from(state)], made = begin(t, y);
    if (made.code !== "failed") return (now = made);
    apply(before);
    begin(t, y);
    return status("refused", made.text);
  }

  function setState(t, y) {
    if (y.length !== size || ![t, ...y].every(Number.isFinite)) return status("refused", `a state is ${size} numbers`);
    started = true;
    return (now = begin(t, Float64Array.from(y)));
  }

  open();
  now = restart();
  return {
    model, parameters, starts, advance, value, set, setState,
    get time() { return time; },
    get state() { return Float64Array.from(state); },
    get status() { return now; },
    get events() { return events; },
    get statistics() { return {steps: field("steps"), failures: field("failures"), evaluations: field("evaluations")}; },
    reset: () => (now = restart()),
    values: list => Float64Array.from(list, value),
    poses() { evaluate(); return outputs("places", 0); },
    places() { evaluate(); return outputs("places", 1); },
    energy() {
      evaluate();
      const [kinetic, potential] = outputs("quantities", 1);
      return {kinetic, potential, total: kinetic + potential};
    },
  };
}
