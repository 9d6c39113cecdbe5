// The engine of a live page. It keeps the memory of the printed routines, sends their steps on, and says what became of
// each request. FIELD, ROW, SOUGHT, SEARCHED, POINTS, steps and searches are printed before it.

const STACK = 4096;                             // words for arrays of calls
const PAST = 512, INSIDE = 2, GAINS = 4;          // impacts that are remembered, and how sets are refused that name a part
const TOO_SMALL = 2, FOUND = 1, HAPPENED = 2;   // how steps and searches end, and what a search is told of the start
const HELD = 1e-6;                              // what constraints may miss, in the scene's sizes
const MET = 1e-7;                               // the same of what a start is to fulfil
const LOW = 0.3, NEARBY = 0.1, SINGULAR = 1e-3; // shares of the most that was left of constraints
const ROUNDING = 2 ** -52;
const norm = a => Math.sqrt(a.reduce((sum, one) => sum + one * one, 0));   // Math.hypot differs from browser to browser
const RELATED = {less: x => +(x < 0), less_equal: x => +(x <= 0), nonzero: x => +(x !== 0), sign: Math.sign, floor: Math.floor};

const status = (code, text = "") => ({code, text});
const shown = t => Number(t.toPrecision(9)).toString();
const largest = list => list.reduce((most, x) => Math.max(most, Math.abs(x)), 0);

function near(word, known) {
  const parts = word.toLowerCase().split(".");
  const found = known.map(one => [parts.filter(part => one.toLowerCase().includes(part)).length, one]);
  const like = found.filter(([count]) => count).sort((a, b) => b[0] - a[0]).slice(0, 3).map(([, one]) => one);
  return like.length ? `; perhaps ${like.join(", ")}` : "";
}

// The shortest x with rows x = right: rows are made square to each other, the largest first; what follows is left out.
function leastNorm(rows, right) {
  const left = rows.map((row, i) => {
    const size = norm(row) || 1;
    return {row: row.map(x => x / size), value: right[i] / size};
  });
  const found = new Float64Array(rows.length ? rows[0].length : 0);
  while (left.length) {
    const sizes = left.map(one => norm(one.row)), best = sizes.indexOf(Math.max(...sizes));
    if (!(sizes[best] > 1e-10)) break;
    const [chosen] = left.splice(best, 1), q = chosen.row.map(x => x / sizes[best]), value = chosen.value / sizes[best];
    q.forEach((x, j) => { found[j] += value * x; });
    for (const one of left) {
      for (let pass = 0; pass < 2; pass++) {
        const share = one.row.reduce((sum, x, j) => sum + x * q[j], 0);
        one.row = one.row.map((x, j) => x - share * q[j]);
        one.value -= share * value;
      }
    }
  }
  return found;
}

// The memory of gaps and slips.
function layContacts({keys, size, pattern}, m, room) {
  const counts = {
    sets: Object.keys(SETS).length, units: Object.keys(UNIT).length * keys.length, rows: SET.rows * size, matrix: size * size,
    left: size * (size + 1), shares: 4 * keys.length * size, at: pattern.length, impacts: 2 * PAST,
    log: SET.capacity * (size + SET.entry),
  };
  return {...Object.fromEntries(Object.entries(counts).map(([name, count]) => [name, room(count)])), past: []};
}

// The programs of one mode with their memory: one array, in which everything has its place.
function openMode(mode, options) {
  const {data} = mode, {words} = data, n = data.coordinates.length, m = data.speeds.length, size = n + m;
  let end = 16 + STACK;
  const room = count => { const at = end; end += count; return at; };
  const count = data.events.length, padded = Math.ceil(size / 4) * 4, places = {};
  for (const [name, one] of Object.entries(words)) {
    places[name] = {derived: room(one.derived), outputs: one.outputs.map(room)};
  }
  const scratch = room(Math.max(...Object.values(words).map(one => one.scratch)));
  const wide = Math.max(size, data.passage?.counts.reduce((a, b) => a + b) ?? 0); // bodies have more coordinates
  const most = Math.max(wide, count); // where states are, events are read, too
  const [own, block, clock, y, yp, nearer] = [data.values.length, 8, 1, wide, most, size + m].map(room);
  const judged = room(4), session = room(Object.keys(FIELD).length), arrays = room(ROW.all * padded), shifts = room(count);
  const sought = room(Object.keys(SOUGHT).length), [sy, syp, shifted, turns] = [most, most, size, 2 * size].map(room);
  const rows = room(Object.keys(SEARCHED).length * count + POINTS * (1 + 2 * count));
  const touch = data.contacts && layContacts(data.contacts, m, room);
  const M = new Float64Array(end), F = [null], values = Float64Array.from(data.values);
  M[0] = 16;
  const functions = mode.open(M, F), method = steps(M, F), search = searches(M, F);
  const held = words.held ? {most: new Float64Array(data.kept.length), largest: 0, size: 0} : null;

  const field = name => M[session + FIELD[name]];
  const put = fields => { for (const [name, one] of Object.entries(fields)) M[session + FIELD[name]] = one; };
  const row = name => arrays + padded * ROW[name];
  const seen = name => rows + count * SEARCHED[name];
  const address = f => F.push(f) - 1;
  const read_ = (from, length = size) => M.slice(from, from + length);

  // Call a program of (t, q, u, more); false where a result is not finite.
  function call(name, t, from = y, speeds = from + n, more = 0, target = null) {
    const top = M[0], {derived, outputs} = places[name];
    M[0] = top + 4 + outputs.length;
    M[clock] = t;
    [clock, from, speeds, more].forEach((at, i) => { M[top + i] = at; });
    (target ?? outputs).forEach((at, i) => { M[top + 4 + i] = at; });
    const code = functions[name](top, derived, scratch, top + 4);
    M[0] = top;
    return code === 0;
  }

  const output = (name, k) => {
    const at = places[name].outputs[k];
    return M.subarray(at, at + words[name].outputs[k]);
  };

  function fill(names = Object.keys(words)) {
    M.set(values, own);
    for (const name of names) functions[`${name}_prologue`](own, places[name].derived, scratch);
  }

  // Entries at their places in a matrix, each column in units of a size.
  function matrix(entries, [at, columns], height, sizes) {
    const made = Array.from({length: height}, () => new Array(sizes.length).fill(0));
    at.forEach((i, k) => { made[i][columns[k]] = entries[k] * sizes[columns[k]]; });
    return made;
  }

  const constraints = (t, from) => {
    if (!call("held", t, from)) return null;
    const slopes = matrix(output("held", 1), data.slopes, data.constraints.length, data.sizes), drift = output("held", 2);
    const rates = slopes.map((one, i) => one.reduce((sum, x, j) => sum + x * M[from + n + j] / data.sizes[j], drift[i]));
    return {gaps: output("held", 0), rates, slopes};
  };

  // Which constraint, also of those that follow from others, is missed; null where all are met.
  function missed(t, from = y) {
    if (!held) return null;
    const found = constraints(t, from);
    if (!found) return "a constraint, which has no finite value";
    held.size = Math.max(held.size, ...found.slopes.map(largest));
    const off = found.slopes.findIndex((one, i) => {
      const unit = Math.max(largest(one), 1e-4 * held.size, 1e-300);
      return !(Math.abs(found.gaps[i]) <= HELD * unit && Math.abs(found.rates[i]) * data.time <= HELD * unit);
    });
    return off < 0 ? null : data.constraints[off];
  }

  // What is left of each kept constraint by the others: the least share of the most that each has been, and whose.
  const kept = data.kept.length, slopes = new Float64Array(kept * m), squares = new Float64Array(kept), order = new Int32Array(kept);
  const [among, under] = data.slopes ?? [[], []], rank = new Map(data.kept.map((i, k) => [i, k]));
  const entries = among.flatMap((i, k) => (rank.has(i) ? [[k, rank.get(i) * m + under[k], data.sizes[under[k]]]] : []));
  const [from_, to_, by_] = [0, 1, 2].map(part => Float64Array.from(entries, one => one[part]));

  function independence(t, from) {
    if (!call("held", t, from)) return [0, 0];
    const found = output("held", 1);
    slopes.fill(0);
    for (let e = 0; e < from_.length; e++) slopes[to_[e]] = found[from_[e]] * by_[e];
    for (let k = 0; k < kept; k++) {
      let sum = 0;
      for (let j = k * m; j < (k + 1) * m; j++) sum += slopes[j] * slopes[j];
      const size = held.most[k] = Math.max(held.most[k], Math.sqrt(sum));
      for (let j = k * m; j < (k + 1) * m; j++) slopes[j] /= size || 1;
      [squares[k], order[k]] = [sum / (size * size || 1), k];
    }
    let least = Infinity, which = 0;
    for (let turn = 0; turn < kept; turn++) {
      let best = turn;
      for (let k = turn + 1; k < kept; k++) if (squares[order[k]] > squares[order[best]]) best = k;
      [order[turn], order[best]] = [order[best], order[turn]];
      const p = order[turn], pivot = squares[p];
      if (!(pivot >= least)) [least, which] = [pivot, data.kept[p]];
      for (let k = turn + 1; k < kept; k++) {
        const i = order[k];
        let share = 0, left = 0;
        for (let j = 0; j < m; j++) share += slopes[i * m + j] * slopes[p * m + j];
        share /= pivot || 1;
        for (let j = 0; j < m; j++) {
          const x = slopes[i * m + j] -= share * slopes[p * m + j];
          left += x * x;
        }
        squares[i] = left;
      }
    }
    return [Math.sqrt(Math.max(least, 0)), which];
  }

  // The singular position within the last step: its time and a constraint; null where there is none.
  function singular() {
    const [t0, t1] = [field("t_old"), field("t")], before = held.last;
    [held.last] = independence(t1, row("y"));
    held.largest = Math.max(held.largest, held.last);
    if (Math.min(before, held.last) >= LOW * held.largest) return null;
    const at = t => (method.interpolate(session, t, y, yp) === 0 ? independence(t, y)[0] : Infinity);
    const times = [0, 0.25, 0.5, 0.75, 1].map(share => t0 + share * (t1 - t0));
    const found = [before, ...times.slice(1, 4).map(at), held.last], k = found.indexOf(Math.min(...found));
    if (found[k] >= NEARBY * held.largest) return null;
    let [a, b] = [times[Math.max(k - 1, 0)], times[Math.min(k + 1, 4)]], [left, right] = [a + 0.382 * (b - a), a + 0.618 * (b - a)];
    let [low, high] = [at(left), at(right)];
    while (b - a > 1e-6 * (t1 - t0) && Math.min(low, high) >= SINGULAR * held.largest) {
      if (Math.abs(high - low) <= 1e-9 * held.largest) break;
      if (low < high) {
        [b, right, high] = [right, left, low];
        low = at(left = a + 0.382 * (b - a));
      } else {
        [a, left, low] = [left, right, high];
        high = at(right = a + 0.618 * (b - a));
      }
    }
    const [time, least] = low < high ? [left, low] : [right, high];
    if (least >= SINGULAR * held.largest) return null;
    method.interpolate(session, time, y, yp);
    return {time, constraint: data.constraints[independence(time, y)[1]]};
  }

  function normalize(state) {
    for (const turn of data.turns) {
      const length = norm(turn.map(i => state[i]));
      for (const i of turn) state[i] /= length;
    }
    return state;
  }

  // Coordinates after a step back along the speeds, in units of their sizes.
  function moved(t, q, step, sizes = data.sizes) {
    if (!data.tangent) return q.map((x, i) => x - (step[i] ?? 0) * (sizes[i] ?? 0));
    M.set(q, y);
    M.fill(0, y + q.length, y + q.length + sizes.length);
    call("tangent", t, y, y + q.length);
    const tangent = matrix(output("tangent", 1), data.tangent, q.length, sizes);
    return q.map((x, i) => x - tangent[i].reduce((sum, one, j) => sum + one * step[j], 0));
  }

  const project = t => !functions.project || functions.project(t, y, block + 2) === 0;
  const eventsAt = (t, from, target) => call("events", t, from, from + n, shifts, [target]);

  // Begin at a state, taken onto the constraints; what stands in the way, or null.
  function begin(t, state, fired = null) {
    M.set(normalize(Float64Array.from(state)), y);
    if (!project(t)) return "the constraints cannot be met near this state";
    if (method.begin(session, t, y) !== 0) return "the equations have no finite value";
    if (data.watched) {
      held.last = independence(t, y)[0];
      held.largest = Math.max(held.largest, held.last);
    }
    return count ? listen(t, fired) : null;
  }

  // What becomes of gaps and slips at a moment: a state, and what has happened; or what stands in the way.
  // Triggers are pairs of a gap or slip and what has happened to it.
  function resolve(t, state, triggers, isStart) {
    const {keys, places, rates, size} = data.contacts, near = 10 * Math.max(options.rtol, 1e-13), count = keys.length;
    const units = (name, length = count) => M.subarray(touch.units + count * UNIT[name], touch.units + count * UNIT[name] + length);
    const known = data.contacts.units, isSlip = k => known[UNIT.slip][k] !== 0;
    const set = fields => { for (const [name, one] of Object.entries(fields)) M[touch.sets + SETS[name]] = one; };
    known.forEach((row, i) => { M.set(row, touch.units + count * i); });
    ["small", "slow"].forEach(name => units(name).set(known[UNIT[name]].map(x => near * x)));
    for (const [k, code] of triggers) units("trigger")[k] = code;
    const before = places.map(some => some.map(i => values[i]));
    before.forEach(([is, x = 0, y = 0], k) => {
      [units("state")[k], units("state_x")[k], units("state_y")[k]] = [isSlip(k) ? is : 2 * is, x, y];
    });
    if (isStart) touch.past = [];
    touch.past.flat().forEach((x, i) => { M[touch.impacts + i] = x; });
    const ahead = 10 * Math.sqrt(options.rtol) * data.time, rough = Math.max(ahead, 0.01 * data.time);
    const later = Math.max(0.001 * ahead, 2 ** -23 * data.time); // or two bounces that rounding makes
    set({known: touch.past.length, inside: isStart ? 1 : Math.max(1, HELD / near), ahead, rough, later});
    M.set(state, y);
    const code = functions.resolve(touch.sets, t, 1, 1), at = name => M[touch.sets + SETS[name]];
    if (code !== 0) {
      const number = at("number"), part = [INSIDE, GAINS].includes(code) && number >= 0 ? `${keys[number][0]}: ` : "";
      return {failed: `${part}${REFUSED[code]}`};
    }
    const told = [], tell = (k, kind, message, time = t) => told.push({time, part: keys[k][0], law: keys[k][1], message, target: "", kind});
    if (at("stops")) tell(at("told"), "rests", "impacts have accumulated: it rests", t + at("ahead"));
    for (let i = 0; i < at("logged"); i++) {
      const [k, speed] = read_(touch.log + i * (size + SET.entry), 2);
      tell(k, "impact", `an impact at ${Number((-speed).toPrecision(6))} ${rates[k]}`);
      touch.past = [...touch.past.slice(1 - PAST), [t, known[UNIT.part][k]]];
    }
    const found = places.map((some, k) => {
      const is = units("next")[k];
      return isSlip(k) ? [is, units("next_x")[k], units("next_y")[k]].slice(0, some.length) : [is / 2];
    });
    const closed = Array.from(units("closed")), take = states => {
      places.forEach((some, k) => some.forEach((i, j) => { values[i] = states[k][j]; }));
      fill(["kernel", "nearer", "events"].filter(name => words[name]));
    };
    let after = read_(y);
    if (!isStart && closed.includes(1)) { // what is found to be closed is so to rounding
      take(places.map((some, k) => some.map(() => closed[k])));
      if (!project(t)) return {failed: "what touches cannot be met near this state"};
      after = Float64Array.from([...read_(y, n), ...after.slice(n)]);
    }
    take(found);
    fill();
    found.forEach(([is, ...way], k) => {
      const [was, ...last] = before[k], name = keys[k][1];
      if (!isSlip(k)) {
        if (is !== was) tell(k, is ? "closes" : "opens", `${name} ${is ? "closes" : "opens"}`);
      } else if (is === 1 && was === 1) {
        if (way.reduce((sum, x, i) => sum + x * last[i], 0) < 0) tell(k, "reverses", `${name} reverses`);
      } else if (is && is !== was) tell(k, is === 2 ? "sticks" : "slips", `${name} ${is === 2 ? "sticks" : "begins"}`);
    });
    if (!isStart) return {state: after, events: inOwnWords(told, before, found, t)};
    const begun = before.map(([is, ...way], k) => [is || data.contacts.closed[k], ...way]);
    const kept = inOwnWords(told.filter(one => one.kind === "impact"), begun, found, t);
    return {state: after, events: kept.filter(one => one.kind !== "closes")};
  }

  // Events in which gaps that have words of their own for what happens are told of in these.
  function inOwnWords(told, before, after, t) {
    const {keys, words} = data.contacts;
    words.forEach((said, k) => {
      if (!said.some(Boolean)) return;
      const [part, law] = keys[k], isOwn = one => one.part === part && one.law === law, [was] = before[k], [is] = after[k];
      const at = told.findIndex(isOwn), struck = told.find(one => isOwn(one) && one.kind === "impact"), found = struck && was ? [struck] : [];
      [!was && (is || struck), !is && (was || struck)].forEach((has, i) => {
        if (has && !said[i]) found.push(...told.filter(one => isOwn(one) && (one.kind === "opens") === (i === 1)));
        else if (has) found.push({...(i === 0 && struck ? struck : {time: t, part, kind: ["closes", "opens"][i]}), ...said[i]});
      });
      told = [...told.slice(0, at < 0 ? told.length : at), ...found, ...told.slice(at < 0 ? told.length : at).filter(one => !isOwn(one))];
    });
    return told;
  }

  // Margins of gaps and slips at a start, and which events these keep from having happened there.
  function arm(t) {
    const rates = data.events.some(one => one.contact) && call("contacts", t) ? Float64Array.from(output("contacts", 0)) : null;
    let later = null;
    return data.events.map(({contact, target, small: unit}, i) => {
      const small = unit * options.rtol, at = M[sy + i], size = Math.abs(at), given = seen("given") + i;
      if (!contact) return false;
      M[given] = 1; // what a state watches is positive in it, also where that is less than rounding
      if (target === "contact closes" && !data.contacts.units[UNIT.speed][contact[0]]) {
        const rate = rates[data.contacts.size + data.contacts.units[UNIT.first][contact[0]]];
        const opens = size <= small && rate * data.time > small;
        if (opens) M[shifts + i] = at > 0 ? 0 : 2 * size + 1e-300;
        return opens;
      }
      if (target !== "contact comes to rest" && target !== "contact runs") return false;
      let runs = size > 1000 * small;
      if (size > small && !runs) { // several come to rest together, and one of them is first
        later ??= soon(t);
        runs = Math.abs(later[i]) < size;
      }
      M[shifts + i] = runs === (target === "contact runs") ? 2 * size + 2 : runs ? -small : 1000 * small;
      return true;
    });
  }

  // The values of events a moment later.
  function soon(t) {
    const moment = 1e-12 * data.time, state = read_(y), kept = read_(shifts, count);
    functions.rates(t, y, yp, block);
    M.set(state.map((x, i) => x + moment * M[yp + i]), y);
    M.fill(0, shifts, shifts + count);
    eventsAt(t + moment, y, syp);
    M.set(state, y);
    M.set(kept, shifts);
    return read_(syp, count);
  }

  let calm = [];
  // Take the signs of events at a start; those that start at zero have a margin to pass, in the direction that counts.
  function listen(t, fired) {
    M.fill(0, shifts, shifts + count);
    if (!eventsAt(t, y, sy)) return "an event has no value";
    data.events.forEach((one, i) => {
      const small = one.small * options.rtol, at = M[sy + i];
      M[shifts + i] = !one.noted && Math.abs(at) <= small ? -one.direction * small : 0;
      if (one.target === "side" && at <= 0) M[shifts + i] = 2 * Math.abs(at) + 1e-300;
      M[seen("given") + i] = fired?.[i] ? HAPPENED : 0;
      M[seen("direction") + i] = one.direction;
    });
    calm = touch ? arm(t) : [];
    M.fill(0, seen("sign"), seen("sign") + count);
    M[sought + SOUGHT.is_first] = touch ? 1 : 0;
    return search.restart(sought, t) === 0 ? null : "an event has no value";
  }

  const differences = (t, state, sides) => {
    values.set(sides, data.sides.first);
    fill();
    M.set(state, y);
    return call("sides", t) ? [0, 1].map(k => Float64Array.from(output("sides", k))) : null;
  };

  // The values that relations of what moves have from a state on; null where it stays where one of them changes.
  function settle(t, state, changed) {
    const {first, kinds} = data.sides, before = Array.from(values.slice(first, first + kinds.length));
    const same = (a, b) => a.every((x, i) => x === b[i]);
    let now = before, read = differences(t, state, now);
    for (let turn = 0; read && turn <= kinds.length; turn++) {
      const found = kinds.map((kind, i) => RELATED[kind](read[0][i]));
      if (same(found, now)) break;
      [now, read] = [found, differences(t, state, found)];
    }
    if (!read) return null;
    const zero = ([off, sizes]) => kinds.map((_, i) => Math.abs(off[i]) <= 64 * ROUNDING * sizes[i]), at = zero(read);
    const near = kinds.map((_, i) => i).filter(i => at[i] || changed.includes(i));
    if (!near.length) return now;
    const other = (kind, x, off) => (kind === "floor" ? x + (off > x + 0.5 ? 1 : -1) : kind === "sign" ? -x : 1 - x);
    const passed = now.map((x, i) => (changed.includes(i) ? other(kinds[i], before[i], read[0][i]) : x));
    const ahead = (sides, step) => {
      values.set(sides, first);
      fill();
      const rates = from => { M.set(from, y); functions.rates(t, y, yp, block); return read_(yp); };
      const a = rates(state), half = rates(state.map((x, i) => (i < n ? x : x + 0.5 * step * a[i])));
      const there = differences(t + step, state.map((x, i) => x + step * (i < n ? half : a)[i]), sides);
      if (!there) return [sides, near];
      const found = sides.map((x, i) => (near.includes(i) ? RELATED[kinds[i]](there[0][i]) : x)), still = zero(there);
      return [found, near.filter(i => still[i] && kinds[i] !== "floor")];
    };
    for (const share of [1e-8, 1e-5]) {
      const tried = [passed];
      for (;;) {
        const last = tried.at(-1), [found, open] = ahead(last, share * data.time);
        if (!open.length && near.every(i => found[i] === last[i])) return found;
        if (open.length || tried.some(one => same(one, found))) {
          if (!open.length) return null;
          break;
        }
        tried.push(found);
      }
    }
    return null;
  }

  // The event that has happened where a mode begins; -1 where none has.
  const broken = () => data.events.findIndex((one, i) => {
    const small = one.small * options.rtol;
    return !one.noted && !calm[i] && one.direction * (M[seen("known") + i] - M[shifts + i]) > 0.9 * small;
  });

  // The first event between two times of the last step; null where there is none.
  function event(from, to, began) {
    if (!count || !(from < to)) return null;
    const code = search.search(sought, from, to);
    if (code === 0) return null;
    const t = M[sought + SOUGHT.root];
    if (code !== FOUND) return {time: t, failed: "an event has no value"};
    const fired = data.events.map((_, i) => M[seen("found") + i] !== 0);
    return {...withoutMargin(t, fired, began), found: t, fired};
  }

  // The same at the time at which its value was zero, where it came from the other side and the margin made it late.
  function withoutMargin(t, fired, began) {
    const plain = {time: t, state: read_(sy)}, since = t - began, some = fired.flatMap((one, i) => (one ? [i] : []));
    if (!some.every(i => M[shifts + i]) || !(since > 0)) return plain;
    const [state, rates] = [read_(sy), read_(syp)], short = 1e-6 * since;
    const back = by => {
      M.set(state.map((x, i) => x - by * rates[i]), y);
      eventsAt(t - by, y, yp);
      return some.map(i => M[yp + i] - M[shifts + i]);
    };
    const now = back(0), before = back(short), slopes = now.map((x, k) => (x - before[k]) / short);
    const late = now.map((x, k) => x / slopes[k]), earlier = Math.min(...late);
    const clear = slopes.every((x, k) => x * M[shifts + some[k]] < 0 && Math.abs(now[k]) < 0.1 * since * Math.abs(x));
    if (!clear || !(Math.max(...late) <= (1 + 1e-6) * earlier)) return plain;
    return {time: t - earlier, state: state.map((x, i) => x - earlier * rates[i])};
  }

  // Take one step; what stands in the way, or null.
  function step() {
    const strays = turn => {
      const square = turn.reduce((sum, i) => sum + M[row("y") + i] ** 2, 0);
      return !(square > 0.25 && square < 4);
    };
    if (data.turns.some(strays)) begin(field("t"), read_(row("y")));
    put({limit: field("steps") + 1, stop: Infinity});
    return method.run(session) === TOO_SMALL ? "no step is short enough: something has no value, or changes too fast" : null;
  }

  // The state at a time within the last step; null where there is none.
  function at(t) {
    if (method.interpolate(session, t, y, yp) !== 0) return null;
    if (t !== field("t")) project(t);
    return read_(y);
  }

  function evaluate(t, state) {
    M.set(state, y);
    const is = functions.rates(t, y, yp, block) === 0 && call("quantities", t, y, y + n, yp + n);
    call("places", t);
    return is;
  }

  // What reads reactions, which takes longer.
  function load(t, state) {
    M.set(state, y);
    functions.rates(t, y, yp, block);
    call("loads", t, y, y + n, yp + n);
    return true;
  }

  [places.kernel.derived, scratch, places.nearer?.derived, scratch, nearer].forEach((one, i) => { M[block + i] = one ?? 0; });
  put({arrays, size, padded, function: address(functions.rates), data: block});
  if (functions.project) put({project: address(functions.project), project_data: block + 2});
  if (touch) {
    const {keys, size, pattern} = data.contacts, {sets, units, rows: numbers, matrix: square, left, shares, at, impacts, log} = touch;
    const fields = {derived: places.contacts.derived, scratch, y, out: places.contacts.outputs[0], units, rows: numbers, left, shares};
    Object.assign(fields, {program: address(functions.contacts), matrix: square, pattern: at, past: impacts, log, count: keys.length, size, entries: pattern.length / 2});
    Object.assign(fields, {coordinates: n, speeds: m});
    for (const [name, one] of Object.entries(fields)) M[sets + SETS[name]] = one;
    M.set(pattern, at);
  }
  if (functions.guard) {
    [places.judge.derived, scratch, ...data.judged].forEach((one, i) => { M[judged + i] = one; });
    put({guard: address(functions.guard), guard_data: judged});
  }
  put({relative: Math.max(options.rtol * data.relative, 1e-15), longest: options.longest ?? Infinity, horizon: options.horizon});
  M.fill(1, row("absolute"), row("absolute") + padded);
  M.set(data.tolerances.map(one => (options.atol ?? options.rtol) * one), row("absolute"));
  if (count) {
    const fields = {interpolate: address(method.interpolate), session, data: 0, y: sy, yp: syp, shifted, turns, rows, size, count};
    fields.events = address((t, from, _, target) => (eventsAt(t, from, target) ? 0 : 1));
    fields.moment = 100 * ROUNDING * options.horizon;
    fields.fired_at = NaN;
    for (const [name, one] of Object.entries(fields)) M[sought + SOUGHT[name]] = one;
    for (let i = 0; i < size; i++) [M[turns + i], M[turns + size + i]] = [Math.cos(1 + 2.4 * i), Math.sin(1 + 2.4 * i)];
  }
  return {
    data, M, n, m, y, values, fill, begin, broken, step, at, event, missed, singular, evaluate, load, settle, call, output, matrix,
    constraints: held && constraints, project, normalize, held, moved, resolve, get time() { return field("t"); }, get begun() { return field("t_old"); },
    get statistics() { return ["steps", "failures", "evaluations"].map(field); },
  };
}

// Where a scene starts: conditions on places by Newton's method with steps of least norm, then those on speeds.
function findStart(mode, start, t) {
  const {M, y, data} = mode, [n, m] = start.counts, sizes = start.sizes;
  const offset = (one, x) => (one.wrapped ? x - 2 * Math.PI * Math.round(x / (2 * Math.PI)) : x);
  const normalize = q => {
    for (const turn of start.turns) {
      const length = norm(turn.map(i => q[i]));
      for (const i of turn) q[i] /= length;
    }
    return q;
  };

  function look(name, q, u, wanted) {
    M.set(q, y);
    M.set(u, y + n);
    if (!mode.call(`start_${name}`, t, y, y + n)) return null;
    const {constraints, targets, slopes} = start[name], found = mode.output(`start_${name}`, 0);
    const rows = mode.matrix(mode.output(`start_${name}`, 1), slopes, found.length, sizes);
    const off = i => (i < constraints ? found[i] : offset(targets[i - constraints], found[i] - targets[i - constraints].value));
    const chosen = rows.map((_, i) => i).filter(i => wanted(i < constraints ? null : targets[i - constraints]));
    return {rows: chosen.map(i => rows[i]), off: chosen.map(off), which: chosen};
  }

  const moved = (q, step) => normalize(mode.moved(t, q, step, sizes));
  const still = new Float64Array(m);
  function solve(q, wanted) {
    for (let i = 0, last = Infinity; i < 60; i++) {
      const now = look("places", q, still, wanted);
      if (!now) return null;
      const step = leastNorm(now.rows, now.off), far = largest(step);
      if (!Number.isFinite(far)) return null;
      q = moved(q, step.map(x => x * Math.min(1, 0.5 / (far || 1))));
      if (far < 1e-15 || (far < 1e-12 && far >= last)) break;
      last = far;
    }
    return q;
  }

  function unmet(name, q, u) {
    const now = look(name, q, u, one => !one || one.fixed);
    if (!now) return "a condition, which has no value";
    const k = now.off.findIndex((x, i) => !(Math.abs(x) <= MET * Math.max(largest(now.rows[i]), 1e-6 * largest(sizes))));
    const i = now.which[k] - start[name].constraints;
    return k < 0 ? null : i < 0 ? "a constraint" : `${start[name].targets[i].path} = ${start[name].targets[i].value}`;
  }

  const direct = start.places.targets.every(one => one.direct >= 0);
  function placed(from) {
    let q = Float64Array.from(from);
    for (const one of start.places.targets) if (one.direct >= 0) q[one.direct] = one.value;
    q = normalize(q);
    if (!direct) q = solve(q, one => one !== null);
    q = q && solve(q, one => !one || one.fixed);
    return [q, q ? unmet("places", q, still) : "a condition, which has no value"];
  }
  let [q, wrong] = placed(start.reference);
  if (wrong) [q, wrong] = placed(start.place);
  if (wrong) return {failed: wrong};
  let u = new Float64Array(m);
  for (const one of start.speeds.targets) if (one.direct >= 0) u[one.direct] = one.value;
  const improve = wanted => {
    const now = look("speeds", q, u, wanted);
    if (now) u = u.map((x, j) => x - leastNorm(now.rows, now.off)[j] * sizes[j]);
  };
  if (start.speeds.targets.some(one => !one.fixed && one.direct < 0)) improve(one => one && !one.fixed);
  for (let pass = 0; pass < 3 && (start.speeds.constraints || start.speeds.targets.length); pass++) improve(one => !one || one.fixed);
  const speeds = unmet("speeds", q, u);
  if (speeds) return {failed: speeds};
  if (data.words.start_maximal) {
    M.set(q, y);
    M.set(u, y + n);
    if (!mode.call("start_maximal", t, y, y + n)) return {failed: "the places of its bodies, which have no value"};
    return {state: [...mode.output("start_maximal", 0), ...mode.output("start_maximal", 1)]};
  }
  return {state: [...q, ...u]};
}

// Coordinates and speeds of all bodies in a state of a mode.
function bodiesOf(mode, t, state) {
  const {counts: [n], turns} = mode.data.passage;
  if (!mode.data.words.maximal) return [state.slice(0, n), state.slice(n)];
  mode.M.set(state, mode.y);
  if (!mode.call("maximal", t)) return null;
  const q = Float64Array.from(mode.output("maximal", 0));
  for (const turn of turns) {
    const length = norm(turn.map(i => q[i]));
    for (const i of turn) q[i] /= length;
  }
  return [q, Float64Array.from(mode.output("maximal", 1))];
}

// Velocities after a plastic impact: the nearest admissible ones in the metric of the masses; or what cannot be.
function struck(mode, t, q, u) {
  const {sizes, mass, slopes_of_constraints: place, refused, labels} = mode.data.passage, [n, m] = [q.length, u.length];
  mode.M.set(q, mode.y);
  mode.M.set(u, mode.y + n);
  if (!mode.call("impact", t, mode.y, mode.y + n)) return {failed: "an impact, in which something has no value"};
  const still = mode.output("impact", 6), masses = mode.matrix(mode.output("impact", 0), mass, m, sizes);
  masses.forEach((row, i) => row.forEach((x, j) => { row[j] = x * sizes[i]; }));
  const unit = Math.max(...masses.map(largest)) || 1, slopes = mode.matrix(mode.output("impact", 5), place, refused.length, sizes);
  const units = slopes.map(row => largest(row) || 1), before = u.map((x, i) => x / sizes[i]);
  const top = masses.map((row, i) => [...row.map(x => x / unit), ...slopes.map((one, k) => -one[i] / units[k])]);
  const bottom = slopes.map((row, k) => [...row.map(x => x / units[k]), ...units.map(() => 0)]);
  const right = masses.map(row => row.reduce((sum, x, j) => sum + x * before[j], 0) / unit);
  const found = leastNorm([...top, ...bottom], [...right, ...units.map((one, k) => -still[k] / one)]);
  const impulses = found.slice(m), most = Math.max(largest(impulses), largest(right)); // beside what moves
  for (const [i, ways] of refused.entries()) {
    const way = Math.abs(impulses[i]) > 1e-9 * most && ways.find(([sign]) => sign === Math.sign(impulses[i]));
    if (way) return {failed: `an impact, in which ${labels[i]} would have to act against its one side`, by: way[1]};
  }
  return {speeds: Float64Array.from(found.slice(0, m), (x, i) => x * sizes[i])};
}

// What constraints miss in a state, in the scene's sizes, and how fast; and the fastest of all that moves.
function misses(mode, t, q, u) {
  const {sizes, slopes_of_constraints: place, labels} = mode.data.passage, n = q.length;
  mode.M.set(q, mode.y);
  mode.M.set(u, mode.y + n);
  if (!mode.call("impact", t, mode.y, mode.y + n)) return null;
  const slopes = mode.matrix(mode.output("impact", 5), place, labels.length, sizes), units = slopes.map(row => largest(row) || 1);
  const [values, rates, still] = [2, 3, 6].map(k => Array.from(mode.output("impact", k), (x, i) => x / units[i]));
  return {values, rates, fastest: Math.max(largest(Array.from(u, (x, i) => x / sizes[i])), largest(still))};
}

// The state of a mode that gives coordinates and speeds of bodies, from a first guess of its coordinates.
function stateOf(mode, t, guess, q, u) {
  if (!mode.data.words.maximal) return {state: [...q, ...u]};
  const {sizes, slopes, turned, turns, spins, along} = mode.data.passage, {M, y, n, m} = mode, own = mode.data.sizes;
  for (const [i, k] of turned) guess[i] = q[k];
  const signs = new Float64Array(q.length).fill(1), ones = new Array(m).fill(1);
  const look = place => {
    M.set(place, y);
    M.fill(0, y + n, y + n + m);
    if (!mode.call("maximal", t)) return null;
    const found = Float64Array.from(mode.output("maximal", 0)), drift = Float64Array.from(mode.output("maximal", 1));
    for (const turn of turns) {
      const length = norm(turn.map(i => found[i])), same = turn.reduce((sum, i) => sum + found[i] * q[i], 0);
      for (const i of turn) [found[i], signs[i]] = [found[i] / length, same < 0 ? -1 : 1];
    }
    const rows = mode.matrix(mode.output("maximal", 2), slopes, sizes.length, own);
    return {found, drift, rows: rows.map((row, i) => row.map(x => x / sizes[i]))};
  };
  // Displacements of bodies along their speeds: of quaternions twice the vector part of the turn, in axes of the body.
  const apart = found => {
    const off = new Array(sizes.length).fill(0);
    for (const [i, j] of along) off[j] = found[i] - q[i];
    turns.forEach((turn, k) => {
      const [a, b, c, d] = turn.map(i => q[i]), [e, f, g, h] = turn.map(i => found[i] * signs[i]);
      const turned = [a * f - b * e - c * h + d * g, a * g + b * h - c * e - d * f, a * h - b * g + c * f - d * e];
      spins[k].forEach((j, axis) => { off[j] = 2 * turned[axis]; });
    });
    return off;
  };
  let place = mode.normalize(Float64Array.from(guess));
  for (let i = 0, last = Infinity; i < 30; i++) {
    const now = look(place);
    if (!now) return {failed: "the new mode, in which something has no value"};
    const step = leastNorm(now.rows, apart(now.found).map((x, k) => x / sizes[k])), far = largest(step);
    place = mode.normalize(mode.moved(t, place, step));
    if (far < 1e-15 || (far < 1e-11 && far >= last)) break;
    last = far;
  }
  const now = look(place);
  if (!now || !(largest(apart(now.found).map((x, k) => x / sizes[k])) <= HELD)) {
    return {failed: "a change of mode, which would change a position at once"};
  }
  const speeds = leastNorm(now.rows, Array.from(u, (x, i) => (x - now.drift[i]) / sizes[i]));
  return {state: [...place, ...Array.from(speeds, (x, j) => x * own[j])]};
}

function createEngine(model, options = {}) {
  const {data} = model, span = data.end_time - data.start_time;
  const settings = {...options, rtol: options.rtol ?? 1e-8, horizon: span > 0 ? span : 1};
  const modes = model.modes.map(one => openMode(one, settings));
  const parameters = data.parameters.map(one => ({...one})), starts = data.starts.map(one => ({...one}));
  const numbers = modes.map(one => new Map(Object.entries(one.data.paths).flatMap(([name, list]) => list.map((path, i) => [path, [name, i]]))));
  const first = {parameters: parameters.map(one => one.value), starts: starts.map(one => one.value)};
  let mode = modes[0], time = data.start_time, state = Float64Array.from(mode.data.state), now = status("ready");
  let events = [], started = false, evaluated = false, loaded = false, coming = null, searched = time, began = time, changes = 0, changedAt = -Infinity;

  const say = (code, text, t = time) => (now = status(code, text && `at t = ${shown(t)} s ${text}`));

  function take(t, from) {
    [time, state, evaluated, loaded] = [t, from, false, false];
  }

  // Relations of functions of time have the values that hold at a time and just after it.
  function inPiece(t) {
    const {times, values, first: place} = mode.data.schedule, piece = times.filter(one => one <= t).length;
    mode.values.set(values[piece] ?? [], place);
    mode.fill();
  }

  function nextPiece(t) {
    const {schedule, updates} = mode.data, next = list => list?.find(one => one > t) ?? Infinity;
    return Math.min(next(schedule.times), next(updates?.times), schedule.end ?? Infinity);
  }

  // What updates make of the state, one after the other; false where one has no value.
  function update(list, moment = -1) {
    const from = Float64Array.from(state);
    return list.every(k => {
      const law = mode.data.updates.laws[k];
      mode.M.set(from, mode.y);
      const given = law.given?.[moment], is = given !== undefined || mode.call(`update_${k}`, time);
      const found = given ?? mode.output(`update_${k}`, 0);
      law.sets.forEach(([kind, i], j) => { (kind === "held" ? mode.values : from)[i] = found[j]; });
      mode.fill();
      take(time, from);
      return is && law.sets.every((_, j) => Number.isFinite(found[j]));
    });
  }

  // The updates that are due at a time.
  function sample(t) {
    const moment = mode.data.updates?.times.indexOf(t) ?? -1;
    return moment < 0 || update(mode.data.updates.due[moment], moment);
  }

  function begin(t, from, fired = null, samples = false, changed = [], triggers = []) {
    inPiece(t);
    take(t, Float64Array.from(from));
    if (samples && !sample(t)) return say("failed", "an update has no value", t);
    if (mode.data.contacts) {
      const met = mode.resolve(t, state, triggers, samples);
      if (met.failed) return say("failed", met.failed, t);
      take(t, met.state);
      events.push(...met.events);
      events.sort((one, other) => one.time - other.time); // a rest is told ahead of its time
      const stop = met.events.find(one => one.target === "stop");
      if (stop) return say("stopped", `${stop.part}: ${stop.message}`, t);
    }
    if (mode.data.sides) {
      const sides = mode.settle(t, state, changed);
      if (!sides) return say("failed", "the motion stays where a law switches, which a page does not follow", t);
      mode.values.set(sides, mode.data.sides.first);
      mode.fill();
    }
    const wrong = mode.begin(t, state, fired);
    if (wrong) return say("failed", wrong, t);
    take(t, mode.at(t));
    [coming, searched, began] = [null, t, t];
    const missed = mode.missed(t);
    if (missed) return say("failed", `${missed} does not hold with these values`, t);
    const broken = mode.broken();
    return broken >= 0 && !fired ? happen(broken) : say("ready", "");
  }

  // What an event leads to.
  function happen(i, fired = null) {
    const {part, law, message, target, updates, contact} = mode.data.events[i];
    if (contact) {
      [changes, changedAt] = [time - changedAt <= 1e-9 * settings.horizon ? changes + 1 : 0, time];
      if (changes > 10000) return say("failed", `${part}: ${law} changes without end`);
      const triggers = mode.data.events.flatMap((one, j) => (one.contact && (j === i || fired?.[j]) ? [one.contact] : []));
      return begin(time, state, null, false, [], triggers);
    }
    events.push({time, part, law, message, target});
    if (target === "stop") return say("stopped", `${part}: ${message}`);
    if (updates.length) return alter(time, state, () => update(updates), fired);
    return target ? enter(mode.data.events[i]) : say("ready", "");
  }

  // Go on in the mode that an event leads to.
  function enter({part, message, target, impact}) {
    const modesThen = {...mode.data.modes, [part]: target}, t = time;
    const after = modes.find(one => Object.entries(modesThen).every(([key, is]) => one.data.modes[key] === is));
    if (!after) return say("stopped", `${part}: ${message}; the motion after that is not in this page`);
    [changes, changedAt] = [t - changedAt <= 1e-9 * settings.horizon ? changes + 1 : 0, t];
    if (changes > 50) return say("failed", `${part} changes its mode endlessly`);
    const whole = bodiesOf(mode, t, state), named = new Map(mode.data.coordinates.map((one, i) => [one.name, state[i]]));
    if (!whole) return say("failed", "the bodies have no place");
    const own = numbers[modes.indexOf(mode)];
    const guess = after.data.coordinates.map(({name}, i) => named.get(name) ?? (own.has(name) ? value(name) : after.data.passage.reference[i]));
    let [q, u] = whole;
    for (const [path, k] of Object.entries(mode.data.held)) after.values[after.data.held[path]] = mode.values[k];
    mode = after;
    inPiece(t);
    if (impact) {
      const hit = struck(mode, t, q, u);
      if (hit.failed) return say("failed", hit.failed);
      u = hit.speeds;
    }
    const found = stateOf(mode, t, guess, q, u);
    if (found.failed) return say("failed", found.failed);
    const said = begin(t, found.state);
    return said.code === "ready" && !sided() ? say("failed", "parts have changed sides on their line") : said;
  }

  // Whether parts on a line are on the sides of each other that their equations were made for.
  function sided() {
    if (!mode.data.passage?.signs.length) return true;
    evaluate();
    const at = mode.output("places", 1), {line} = data;
    const place = k => line.reduce((sum, x, j) => sum + x * at[3 * k + j], 0);
    return mode.data.passage.signs.every(([a, b, sign]) => (place(b) - place(a)) * sign >= -1e-9 * mode.data.sizes[0]);
  }

  function apply(anew = false) {
    for (const one of modes) {
      if (anew) one.values.set(one.data.values);
      for (const each of parameters) {
        const number = one.data.numbers[each.path];
        if (number !== undefined) one.values[number] = each.value;
      }
      one.fill();
    }
  }

  function restart() {
    const same = (list, known) => list.every((one, i) => one.value === known[i]);
    [mode, events, started] = [modes[0], [], false];
    apply(true);
    if (mode.held) mode.held.most.fill(mode.held.largest = 0);
    let from = mode.data.state;
    if (!same(parameters, first.parameters) || !same(starts, first.starts)) {
      if (!data.start) return say("failed", "its start is known for the given values alone", data.start_time);
      for (const level of [data.start.places, data.start.speeds]) {
        for (const one of level.targets) one.value = starts.find(each => each.path === one.path)?.value ?? one.value;
      }
      inPiece(data.start_time);
      const found = findStart(mode, data.start, data.start_time);
      if (found.failed) return say("failed", `the start cannot be met: ${found.failed}`, data.start_time);
      from = found.state;
    }
    return begin(data.start_time, from, null, true);
  }

  // Look for what happens up to the end of a step: an event, or a singular position.
  function watch() {
    const until = Math.min(mode.time, nextPiece(began));
    coming = mode.event(searched, until, began);
    if (mode.data.watched) {
      const low = mode.singular();
      if (low && low.time <= (coming?.time ?? until)) coming = {time: low.time, singular: low.constraint};
    }
    searched = coming?.found ?? until;
  }

  // Go over what comes; a status where it ends there.
  function pass() {
    const one = coming;
    if (one.failed) return say("failed", one.failed, one.time);
    if (one.singular) {
      take(one.time, mode.at(one.time));
      return say("singular", `the position is singular: ${one.singular} follows from the other constraints`);
    }
    take(one.time, one.state);
    const list = mode.data.events, which = one.fired.flatMap((is, i) => (is ? [i] : []));
    const sides = which.filter(i => list[i].target === "side").map(i => Number(list[i].law));
    const changing = which.find(i => list[i].target && list[i].target !== "side");
    for (const i of which) if (!list[i].target) happen(i);
    if (changing !== undefined) {
      return happen(changing, one.fired);
    }
    if (sides.length) {
      [changes, changedAt] = [time - changedAt <= 1e-9 * settings.horizon ? changes + 1 : 0, time];
      return changes > 50 ? say("failed", "a law switches endlessly") : begin(time, state, null, false, sides);
    }
    watch();
    return null;
  }

  // Go on from a state where values change that functions of time, or updates, give: a motion that these prescribe may
  // jump in speed, which is an impact.
  function alter(t, from, change, fired = null) {
    const jumps = mode.data.passage?.switches, whole = jumps ? bodiesOf(mode, t, from) : null;
    const was = whole && misses(mode, t, ...whole);
    take(t, from);
    inPiece(t);
    if (!change()) return say("failed", "an update has no value", t);
    if (!jumps) return begin(t, state, fired);
    const now = was && misses(mode, t, ...whole);
    if (!now) return say("failed", "a constraint has no value", t);
    const {labels, laws} = mode.data.passage, moved = labels.find((_, i) => !(Math.abs(now.values[i] - was.values[i]) <= HELD));
    if (moved) return say("failed", `the motion that ${moved} prescribes jumps, and no position can`, t);
    const fast = 1e-9 * Math.max(was.fastest, now.fastest);
    const faster = laws.filter((_, i) => Math.abs(now.rates[i] - was.rates[i]) > fast);
    if (!faster.length) return begin(t, state, fired);
    const hit = struck(mode, t, ...whole);
    if (hit.by?.target) {
      events.push({time: t, ...hit.by});
      return hit.by.target === "stop" ? say("stopped", hit.by.message, t) : enter({...hit.by, impact: true});
    }
    if (hit.failed) return say("failed", hit.failed, t);
    const found = stateOf(mode, t, Float64Array.from(state.slice(0, mode.n)), whole[0], hit.speeds);
    if (found.failed) return say("failed", found.failed, t);
    for (const [part, law] of new Map(faster)) {
      events.push({time: t, part, law, message: "the speed of the prescribed motion jumps: an impact", target: ""});
    }
    return begin(t, found.state, fired);
  }

  function passPiece(t) {
    if (t === mode.data.schedule.end) return say("stopped", "it is not known how its functions of time go on", t);
    const from = mode.at(t);
    return from ? alter(t, from, () => sample(t)) : say("failed", "the equations have no value within a step", t);
  }

  function advance(target, limits = {}) {
    if (!Number.isFinite(target)) return (now = status("refused", "no time to go to"));
    if (["failed", "singular", "stopped"].includes(now.code)) return now;
    if (target < time) return (now = status("refused", `t = ${shown(target)} s lies before t = ${shown(time)} s: reset first`));
    const until = performance.now() + (limits.milliseconds ?? Infinity);
    started = true;
    for (let count = 0; ;) {
      const edge = nextPiece(began), here = Math.min(coming?.time ?? Infinity, edge);
      if (here <= target && here <= mode.time) {
        const said = coming && coming.time <= edge ? pass() : passPiece(edge);
        if (said && said.code !== "ready") return said;
        continue;
      }
      if (mode.time >= target) break;
      if (count++ >= (limits.steps ?? Infinity) || performance.now() > until) {
        take(mode.time, mode.at(mode.time));
        return say("working", "");
      }
      const wrong = mode.step();
      if (wrong) {
        take(mode.time, mode.at(mode.time) ?? state);
        return say("failed", wrong);
      }
      watch();
    }
    const from = mode.at(target);
    if (!from) return say("failed", "the equations have no value within a step", target);
    take(target, from);
    return say("reached", "");
  }

  function evaluate() {
    if (!evaluated) mode.evaluate(time, state);
    evaluated = true;
  }

  function value(path) {
    const known = numbers[modes.indexOf(mode)], place = known.get(path);
    if (!place) throw new Error(`${path}: ${data.unknown[path] ?? `there is no such quantity${near(path, [...known.keys()])}`}`);
    evaluate();
    if (place[0] === "loads" && !loaded) loaded = mode.load(time, state);
    return mode.output(place[0], 0)[place[1]];
  }

  function set(path, number) {
    const wanted = Object.entries(typeof path === "string" ? {[path]: number} : path), all = [...parameters, ...starts];
    for (const [name, one] of wanted) {
      const known = all.find(each => each.path === name);
      if (!known) return status("refused", `${name}: it cannot be changed here${near(name, all.map(each => each.path))}`);
      const {low = null, high = null, lower_open: open} = known;
      if (!Number.isFinite(one) || (low !== null && !(open ? one > low : one >= low)) || (high !== null && one > high)) {
        return status("refused", `${name}: ${one} is not a value that it can have`);
      }
    }
    const before = all.map(one => one.value), [t, from, was] = [time, state, now];
    for (const [name, one] of wanted) all.find(each => each.path === name).value = one;
    const anew = !started || wanted.some(([name]) => starts.some(one => one.path === name));
    const go = () => { if (anew) return restart(); apply(); return begin(t, from); };
    const said = go();
    if (said.code !== "failed") return said;
    all.forEach((one, i) => { one.value = before[i]; });
    if (go().code === "failed") return now;
    now = was;
    return status("refused", said.text);
  }

  // Pull a node to a place by a damped spring, or let go of all (null).
  function drag(node, target = null, strength = 1) {
    const known = mode.data.pulls.find(([one]) => one === node);
    if (node !== null && !known) return status("refused", `the node ${node} cannot be pulled`);
    if (known && !(target?.length === 3 && [...target, strength].every(Number.isFinite) && strength > 0)) {
      return status("refused", "a node is pulled to a place, x y z, by a strength above zero");
    }
    for (const one of modes) {
      for (const [at, [k, c, ...place]] of one.data.pulls) {
        const stiffness = at === node ? 10 * strength * one.data.stiffness : 0;
        [one.values[k], one.values[c]] = [stiffness, stiffness && Math.sqrt(10 * strength) * one.data.stiffness * one.data.time];
        if (at === node) place.forEach((i, axis) => { one.values[i] = target[axis]; });
      }
      one.fill();
    }
    return ["failed", "singular", "stopped"].includes(now.code) ? now : begin(time, state);
  }

  function setState(t, from) {
    if (from.length !== mode.n + mode.m || ![t, ...from].every(Number.isFinite)) {
      return status("refused", `a state is ${mode.n + mode.m} numbers`);
    }
    started = true;
    return begin(t, from);
  }

  // The state at rest in which a node is as near to a place as it can be: Gauss's and Newton's steps, on the constraints.
  function place(node, target, opens = true) {
    const at = data.nodes.findIndex(one => one.node === node), {m, n} = mode, before = [time, state];
    if (at < 0 || !(target?.length === 3 && target.every(Number.isFinite))) return status("refused", "a node is put at a place, x y z");
    const look = q => {
      mode.M.set(q, mode.y);
      mode.M.fill(0, mode.y + n, mode.y + n + m);
      return mode.call("places", time) ? Array.from(mode.output("places", 1).slice(3 * at, 3 * at + 3)) : null;
    };
    const apart = place => norm(place.map((x, i) => x - target[i]));
    const held = mode.data.contacts?.places.flat() ?? [], kept = held.map(i => mode.values[i]);
    const hold = values => { held.forEach((i, k) => { mode.values[i] = values[k]; }); mode.fill(); };
    if (opens && held.length) hold(held.map(() => 0)); // first as if nothing touched, then along what does
    let q = mode.normalize(state.slice(0, n)), here = look(q), damping = 1e-6;
    for (let turn = 0; turn < 200 && here; turn++) {
      const columns = Array.from({length: m}, (_, j) => {
        const there = look(mode.normalize(mode.moved(time, q, Float64Array.from({length: m}, (_, k) => (k === j ? -1e-6 : 0)))));
        return there && there.map((x, i) => 1e6 * (x - here[i]));
      });
      if (columns.includes(null)) break;
      look(q);
      const met = mode.constraints?.(time, mode.y), slopes = met ? met.slopes : [], units = slopes.map(row => largest(row) || 1);
      const square = columns.map(a => columns.map(b => a.reduce((sum, x, i) => sum + x * b[i], 0)));
      const most = Math.max(...square.map((row, j) => row[j])) || 1;
      const top = square.map((row, j) => [...row.map((x, k) => x / most + (j === k ? damping : 0)), ...slopes.map((one, k) => -one[j] / units[k])]);
      const bottom = slopes.map((row, k) => [...row.map(x => x / units[k]), ...units.map(() => 0)]);
      const right = columns.map(a => a.reduce((sum, x, i) => sum + x * (target[i] - here[i]), 0) / most);
      const found = leastNorm([...top, ...bottom], [...right, ...units.map((one, k) => -met.gaps[k] / one)]).slice(0, m);
      const far = largest(found), next = mode.normalize(mode.moved(time, q, found.map(x => -x * Math.min(1, 0.3 / (far || 1)))));
      const there = look(next) && mode.project(time) && look(next.map((_, i) => mode.M[mode.y + i]));
      if (!there || (apart(there) > apart(here) * (1 + 1e-9) && damping < 1e6)) {
        damping *= 4;
        continue;
      }
      // Far from what can be reached its curve counts: how much nearer it came, beside what was foreseen, says so (Nielsen).
      const foreseen = found.reduce((sum, x, j) => sum + x * most * (damping * x + right[j]), 0);
      const share = (apart(here) ** 2 - apart(there) ** 2) / (foreseen || 1);
      [q, here, damping] = [mode.M.slice(mode.y, mode.y + n), there, Math.max(damping * Math.max(1 / 3, 1 - (2 * share - 1) ** 3), 1e-6)];
      if (far < 1e-10) break;
    }
    started = true;
    const said = begin(time, [...q, ...new Float64Array(m)]);
    if (said.code !== "failed") return said;
    hold(kept);
    begin(...before);
    return opens && held.length ? place(node, target, false) : status("refused", said.text);
  }

  restart();
  return {
    model, parameters, starts, advance, value, set, setState, drag, place,
    get time() { return time; },
    get state() { return Float64Array.from(state); },
    get status() { return now; },
    get events() { return events; },
    get mode() { return mode.data.modes; },
    get statistics() {
      const sums = modes.map(one => one.statistics).reduce((a, b) => a.map((x, i) => x + b[i]));
      return {steps: sums[0], failures: sums[1], evaluations: sums[2]};
    },
    reset: restart,
    values: list => Float64Array.from(list, value),
    poses() { evaluate(); return mode.output("places", 0); },
    places() { evaluate(); return mode.output("places", 1); },
    energy() {
      evaluate();
      const [kinetic, potential] = mode.output("quantities", 1);
      return {kinetic, potential, total: kinetic + potential};
    },
  };
}
