// What is drawn of a scene: surfaces, lines and balls fixed in frames, and ties between frames.

import {
  BufferAttribute, BufferGeometry, CircleGeometry, Color, CylinderGeometry, DoubleSide, Group, Line2, LineGeometry,
  LineMaterial, LineSegments2, LineSegmentsGeometry, Mesh, MeshBasicMaterial, MeshLambertMaterial, SphereGeometry,
  Vector3,
} from "./three.js";

const INK = "#22303c";
const GREY = "#8d99a6";
const ROPE = "#a8642a";
const ROD = "#5d6b78";

/** Return a line through points, as wide on the screen as asked for. */
export function wideLine(points, colour, width, look = {}) {
  const geometry = new LineGeometry();
  geometry.setPositions(points.length >= 6 ? points : new Float32Array(6));
  const made = new Line2(geometry, new LineMaterial({ color: colour, linewidth: 1.35 * width, ...look }));
  made.frustumCulled = false;
  return made;
}

/** Move a line to other points, of which there are as many as before. */
export function moveLine(line, points) {
  const { data } = line.geometry.attributes.instanceStart;
  for (let i = 0; i + 3 < points.length; i += 3) data.array.set(points.slice(i, i + 6), 2 * i);
  data.needsUpdate = true;
}

/** Everything that is drawn of one run. */
export class Shapes {
  /** `stage` is what the page has of the run; `tint` a colour that tells it from other runs, or null. */
  constructor(stage, tint = null) {
    this.stage = stage;
    this.flat = stage.stride === 3;
    this.tint = tint;
    this.group = new Group();
    this.frames = [];
    this.ties = [];
    this.order = 0;
    const count = stage.frames.keys.length;
    for (let k = 0; k < count; k += 1) {
      const frame = new Group();
      frame.matrixAutoUpdate = false;
      this.frames.push(frame);
      this.group.add(frame);
    }
    for (const item of stage.items) this.addItem(item);
  }

  /** Return the look of a surface or a line. */
  look(colour) {
    const own = new Color(colour);
    if (this.tint) own.lerp(new Color(this.tint), 0.65);
    return { color: own, ...(this.flat ? { depthTest: false, transparent: true, opacity: this.tint ? 0.75 : 1 } : {}) };
  }

  surface(geometry, colour) {
    const Material = this.flat ? MeshBasicMaterial : MeshLambertMaterial;
    const shaded = this.flat ? { side: DoubleSide } : { flatShading: true };
    return new Mesh(geometry, new Material({ ...this.look(colour), ...shaded }));
  }

  /** Put something into its frame, in front of what was there before where the scene is flat. */
  put(made, item, where = null) {
    made.userData.part = item.part;
    made.renderOrder = this.order;
    this.order += 1;
    (where ?? (item.frame >= 0 ? this.frames[item.frame] : this.group)).add(made);
    return made;
  }

  line(points, width, colour) {
    const { color, ...look } = this.look(colour);
    return wideLine(points, color, width, look);
  }

  addItem(item) {
    const made = FIXED[item.kind]?.call(this, item);
    if (made) {
      for (const one of [made].flat()) this.put(one, item);
      return;
    }
    const ends = item.ends.map((end) => ({ ...end, point: end.point ?? [0, 0, 0], place: new Vector3() }));
    const draw = (this.flat ? FLAT_TIES : SPATIAL_TIES)[item.kind];
    if (draw) this.ties.push({ ends, ...draw.call(this, item, ends) });
  }

  /** Put all frames and ties where they are at one time; `sample` is that of the run, for ropes that hang. */
  move(poses, sample) {
    const { stride } = this.stage;
    this.frames.forEach((frame, k) => {
      const [o, p] = [k * stride, poses];
      if (this.flat) {
        const [c, s] = [Math.cos(p[o + 2]), Math.sin(p[o + 2])];
        frame.matrix.set(c, 0, -s, p[o], 0, 1, 0, 0, s, 0, c, p[o + 1], 0, 0, 0, 1);
      } else {
        frame.matrix.set(
          p[o + 3], p[o + 4], p[o + 5], p[o], p[o + 6], p[o + 7], p[o + 8], p[o + 1],
          p[o + 9], p[o + 10], p[o + 11], p[o + 2], 0, 0, 0, 1,
        );
      }
      frame.matrixWorldNeedsUpdate = true;
    });
    for (const tie of this.ties) {
      for (const end of tie.ends) end.place.fromArray(end.point).applyMatrix4(this.frames[end.frame].matrix);
      tie.draw(sample);
    }
  }

  /** Return where a point of a frame is. */
  place(frame, point) {
    return new Vector3().fromArray(point).applyMatrix4(this.frames[frame].matrix);
  }
}

function triangles(item) {
  const corners = new Float32Array(3 * item.faces.length);
  item.faces.forEach((vertex, k) => corners.set(item.vertices.slice(3 * vertex, 3 * vertex + 3), 3 * k));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}

const FIXED = {
  mesh(item) {
    const colour = item.marked ? `#${new Color(item.colour).multiplyScalar(0.8).getHexString()}` : item.colour;
    return this.surface(triangles(item), colour);
  },
  ball(item) {
    const made = this.surface(new SphereGeometry(item.size, 32, 20), item.colour);
    made.material.flatShading = false;
    made.position.fromArray(item.point);
    return made;
  },
  line(item) {
    return this.line(item.points, item.width, item.colour);
  },
  edges(item) {
    const { color, ...look } = this.look(item.colour);
    const material = new LineMaterial({ color, linewidth: 1.35 * item.width, ...look });
    return new LineSegments2(new LineSegmentsGeometry().setPositions(item.points), material);
  },
  disc(item) {
    const [around, back] = [new CircleGeometry(item.size, 48), new CircleGeometry(0.86 * item.size, 48)];
    for (const one of [around, back]) one.rotateX(Math.PI / 2);
    return [this.surface(around, item.edge), this.surface(back, item.colour)];
  },
};

const UP = new Vector3(0, 1, 0);

/** Return a round bar that is put between two ends. */
function bar(shapes, item, ends, radius, colour) {
  const made = shapes.put(shapes.surface(new CylinderGeometry(radius, radius, 1, 16), colour), item, shapes.group);
  const [way, middle] = [new Vector3(), new Vector3()];
  return {
    draw() {
      const [a, b] = [ends[0].place, ends[ends.length - 1].place];
      way.subVectors(b, a);
      const length = way.length();
      made.visible = length > 0;
      if (!made.visible) return;
      made.position.copy(middle.addVectors(a, b).multiplyScalar(0.5));
      made.quaternion.setFromUnitVectors(UP, way.divideScalar(length));
      made.scale.set(1, length, 1);
    },
  };
}

/** Return a line whose points are found anew each time. */
function drawn(shapes, item, count, width, colour, points) {
  const made = shapes.put(shapes.line(new Float32Array(3 * count), width, colour), item, shapes.group);
  return { draw: (sample) => moveLine(made, points(sample)) };
}

function straight(width, colour) {
  return function between(item, ends) {
    return drawn(this, item, ends.length, width, colour, () => ends.flatMap((end) => end.place.toArray()));
  };
}

/** Return two directions across a way, and the way's own and its length. */
function across(a, b) {
  const along = new Vector3().subVectors(b, a);
  const length = along.length();
  along.divideScalar(length || 1);
  const side = Math.abs(along.y) > 0.9 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0);
  const first = new Vector3().crossVectors(along, side).normalize();
  return { along, first, second: new Vector3().crossVectors(along, first), length };
}

function coil(turns, steps, point) {
  return function spring(item, ends) {
    const { unit } = this.stage;
    const count = turns * steps + 5;
    return drawn(this, item, count, 1.2, INK, () => {
      const [a, b] = [ends[0].place, ends[1].place];
      const way = across(a, b);
      const lead = Math.min(0.13 * way.length, 6 * unit);
      const found = [a.toArray()];
      for (let k = 0; k <= count - 3; k += 1) {
        const share = k / (count - 3);
        const along = lead + (way.length - 2 * lead) * share;
        found.push(point(way, a, along, share * turns, k, unit));
      }
      found.push(b.toArray());
      return found.flat();
    });
  };
}

const helix = coil(9, 24, (way, a, along, turn, k, unit) => {
  const size = 1.7 * unit * Math.min(1, 2 * turn, 2 * (9 - turn));
  const [c, s] = [size * Math.cos(2 * Math.PI * turn), size * Math.sin(2 * Math.PI * turn)];
  return new Vector3().copy(a).addScaledVector(way.along, along).addScaledVector(way.first, c)
    .addScaledVector(way.second, s).toArray();
});

const zigzag = coil(7, 2, (way, a, along, turn, k, unit) => {
  const size = k === 0 || k >= 16 ? 0 : (k % 2 ? 1.6 : -1.6) * unit;
  return new Vector3().copy(a).addScaledVector(way.along, along).addScaledVector(way.first, size).toArray();
});

function damper(item, ends) {
  const { unit } = this.stage;
  return drawn(this, item, 9, 1.3, INK, () => {
    const [a, b] = [ends[0].place, ends[1].place];
    const way = across(a, b);
    const size = Math.min(4 * unit, 0.25 * way.length);
    const at = (s, side) => new Vector3().addVectors(a, b).multiplyScalar(0.5).addScaledVector(way.along, s)
      .addScaledVector(way.first, 1.5 * unit * side).toArray();
    return [a.toArray(), at(-size, 0), at(-size, 1), at(size, 1), at(-size, 1), at(-size, -1), at(size, -1), at(0, 0),
      b.toArray()].flat();
  });
}

/** Return a rope over pulleys on a vertical line: straight down on both sides, half a turn between. */
function overPulleys(ends) {
  const found = [ends[0].place.toArray()];
  for (const end of ends.slice(1, -1)) {
    const { x, y, z } = end.place;
    const [lastX, , lastZ] = found[found.length - 1];
    const start = lastX <= x ? -1 : 1;
    const over = lastZ <= z ? 1 : -1;
    for (let k = 0; k <= 24; k += 1) {
      const turn = (Math.PI * k) / 24;
      found.push([x + end.radius * start * Math.cos(turn), y, z + end.radius * over * Math.sin(turn)]);
    }
  }
  return [...found, ends[ends.length - 1].place.toArray()].flat();
}

/** Return a slack rope as a parabola, about as much longer than the straight way as it has to spare. */
function hanging(a, b, spare) {
  const apart = a.distanceTo(b);
  const sag = Math.sqrt(0.375 * Math.max(spare, 0) * (apart + 0.5 * Math.max(spare, 0)));
  const found = [];
  for (let k = 0; k <= 24; k += 1) {
    const share = k / 24;
    const point = new Vector3().lerpVectors(a, b, share);
    point.z -= 4 * sag * share * (1 - share);
    found.push(...point.toArray());
  }
  return found;
}

function rope(item, ends) {
  const rounds = ends.slice(1, -1).filter((end) => end.radius > 0).length;
  if (rounds) return drawn(this, item, 2 + 25 * rounds, 1.6, ROPE, () => overPulleys(ends));
  if (ends.length > 2) return straight(1.6, ROPE).call(this, item, ends);
  const made = this.put(this.line(new Float32Array(75), 1.6, ROPE), item, this.group);
  return {
    draw(sample) {
      const spare = item.spare && sample < item.spare.length ? item.spare[sample] : 0;
      made.visible = spare > -1e-6 * ends[0].place.distanceTo(ends[1].place); // else it was let go
      moveLine(made, hanging(ends[0].place, ends[1].place, spare));
    },
  };
}

const FLAT_TIES = {
  rod: straight(2, INK),
  rail: straight(1.2, GREY),
  rope,
  spring: zigzag,
  damper,
  link(item, ends) {
    const both = [straight(8, INK), straight(5.6, "#c8d3de")].map((one) => one.call(this, item, ends));
    return { draw: () => both.forEach((one) => one.draw()) };
  },
};

const SPATIAL_TIES = {
  rod(item, ends) {
    return bar(this, item, ends, 0.6 * this.stage.unit, ROD);
  },
  rope: straight(1.6, ROPE),
  spring: helix,
  damper(item, ends) {
    const line = straight(1.2, INK).call(this, item, [ends[0], ends[ends.length - 1]]);
    const [from, to] = [{ place: new Vector3() }, { place: new Vector3() }];
    const cup = bar(this, item, [from, to], 1.4 * this.stage.unit, "#e7ecf1");
    return {
      draw: () => {
        const [a, b] = [ends[0].place, ends[ends.length - 1].place];
        const half = Math.min(4.5 * this.stage.unit, 0.2 * a.distanceTo(b)) / (a.distanceTo(b) || 1);
        from.place.lerpVectors(a, b, 0.5 - half);
        to.place.lerpVectors(a, b, 0.5 + half);
        line.draw();
        cup.draw();
      },
    };
  },
};
