// Motions as samples in time: those of a run that was recorded, and those that a live model adds.

/** A motion: times, frames of the scene and quantities at these times. */
export class Track {
  /** `stride` numbers a frame, `frames` of them; `paths` names the quantities. */
  constructor(stride, frames, paths) {
    this.stride = stride;
    this.width = stride * frames;
    this.paths = paths;
    this.places = new Map(paths.map((path, k) => [path, k]));
    this.times = [];
    this.poses = [];
    this.values = [];
    this.scratch = new Float64Array(this.width);
  }

  /** Return the track of a run as it is in the page. */
  static recorded(run) {
    const { stride } = run.stage;
    const count = run.time.length;
    const made = new Track(stride, run.poses.length / count / stride, run.quantities.paths);
    const column = (rows, length, k) => Float64Array.from({ length }, (_, row) => rows[row * count + k]);
    run.time.forEach((time, k) => {
      made.add(time, column(run.poses, made.width, k), column(run.quantities.values, made.paths.length, k));
    });
    return made;
  }

  get first() {
    return this.times[0];
  }

  get last() {
    return this.times[this.times.length - 1];
  }

  add(time, poses, values) {
    this.times.push(time);
    this.poses.push(poses);
    this.values.push(values);
  }

  clear() {
    this.times.length = this.poses.length = this.values.length = 0;
  }

  /** Return the number of the last sample that is not after a time. */
  before(time) {
    let low = 0;
    let high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Return the number of the sample nearest to a time. */
  nearest(time) {
    const k = this.before(time);
    return k + 1 < this.times.length && this.times[k + 1] - time < time - this.times[k] ? k + 1 : k;
  }

  /** Return the frames at a time, between samples on the straight line; turns are made orthogonal again. */
  posesAt(time) {
    const k = this.before(time);
    if (k + 1 >= this.times.length || time <= this.times[k]) return this.poses[k];
    const share = (time - this.times[k]) / (this.times[k + 1] - this.times[k]);
    const [a, b, found] = [this.poses[k], this.poses[k + 1], this.scratch];
    for (let i = 0; i < this.width; i += 1) found[i] = a[i] + share * (b[i] - a[i]);
    if (this.stride === 12) for (let i = 3; i < this.width; i += 12) orthogonal(found, i);
    return found;
  }

  /** Return a quantity at a sample. */
  value(path, sample) {
    return this.values[sample][this.places.get(path)];
  }

  /** Return a quantity at all samples. */
  series(path) {
    const place = this.places.get(path);
    return this.values.map((all) => all[place]);
  }
}

/** Make a matrix by rows orthogonal: its columns one after another (Gram and Schmidt). */
function orthogonal(m, o) {
  const size = Math.hypot(m[o], m[o + 3], m[o + 6]) || 1;
  for (let i = 0; i < 9; i += 3) m[o + i] /= size;
  const along = m[o] * m[o + 1] + m[o + 3] * m[o + 4] + m[o + 6] * m[o + 7];
  for (let i = 0; i < 9; i += 3) m[o + i + 1] -= along * m[o + i];
  const across = Math.hypot(m[o + 1], m[o + 4], m[o + 7]) || 1;
  for (let i = 0; i < 9; i += 3) m[o + i + 1] /= across;
  m[o + 2] = m[o + 3] * m[o + 7] - m[o + 6] * m[o + 4];
  m[o + 5] = m[o + 6] * m[o + 1] - m[o] * m[o + 7];
  m[o + 8] = m[o] * m[o + 4] - m[o + 3] * m[o + 1];
}
