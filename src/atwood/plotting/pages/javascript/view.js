// The picture: a camera that one can turn, light, floor, paths, arrows, names of what one points at.

import {
  AmbientLight, ArrowHelper, Color, DirectionalLight, LineBasicMaterial, LineSegments, BufferGeometry, BufferAttribute,
  Mesh, MeshBasicMaterial, OrbitControls, OrthographicCamera, PlaneGeometry, Raycaster, Scene, Vector2, Vector3,
  WebGLRenderer,
} from "./three.js";
import { Shapes, wideLine } from "./shapes.js";

const FROM = { azimuth: 30, elevation: 20 };
const LONGEST = 4000; // points of a path

export class View {
  /** `host` is the element that holds the canvas; `runs` have stages and tints. */
  constructor(host, runs) {
    this.host = host;
    this.flat = runs[0].stage.stride === 3;
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    host.append(this.renderer.domElement);
    this.scene = new Scene();
    this.scene.background = new Color("#ffffff");
    this.camera = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.render());
    this.controls.addEventListener("start", () => { this.turned = true; });
    this.lights();
    this.runs = runs.map((run) => ({ ...run, shapes: new Shapes(run.stage, run.tint), paths: [], arrows: [] }));
    for (const run of this.runs) this.scene.add(run.shapes.group);
    this.size();
    if (!this.flat) this.floor(runs[0].stage.floor);
    for (const run of this.runs) this.addPaths(run);
    this.front();
    new ResizeObserver(() => this.resize()).observe(host);
  }

  lights() {
    this.scene.add(new AmbientLight("#ffffff", 1.9));
    for (const [x, y, z, strength] of [[0.4, -1, 1.2, 1.5], [-1, -0.3, 0.3, 0.5]]) {
      const light = new DirectionalLight("#ffffff", strength);
      light.position.set(x, y, z);
      this.scene.add(light);
    }
  }

  /** Find the middle and the radius of all that is drawn. */
  size() {
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = new Vector3(-Infinity, -Infinity, -Infinity);
    for (const { stage } of this.runs) {
      for (const box of stage.floor ? [stage.box, stage.floor.box] : [stage.box]) {
        low.min(new Vector3(...box.slice(0, 3))).min(new Vector3(...box.slice(3, 6)));
        high.max(new Vector3(...box.slice(0, 3))).max(new Vector3(...box.slice(3, 6)));
      }
    }
    this.corners = [0, 1, 2, 3, 4, 5, 6, 7].map(
      (k) => new Vector3(k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z),
    );
    this.middle = new Vector3().addVectors(low, high).multiplyScalar(0.5);
    this.radius = 0.5 * low.distanceTo(high) || 1;
    this.unit = Math.max(...this.runs.map(({ stage }) => stage.unit));
  }

  floor(floor) {
    if (!floor) return;
    const [x0, y0, z, x1, y1] = floor.box;
    const plane = new Mesh(new PlaneGeometry(x1 - x0, y1 - y0), new MeshBasicMaterial({ color: "#f4f6f8" }));
    plane.position.set(0.5 * (x0 + x1), 0.5 * (y0 + y1), z - 0.05 * this.unit);
    const ends = [];
    const steps = (a, b) => Math.round((b - a) / floor.step);
    for (let k = 0; k <= steps(x0, x1); k += 1) ends.push(x0 + k * floor.step, y0, z, x0 + k * floor.step, y1, z);
    for (let k = 0; k <= steps(y0, y1); k += 1) ends.push(x0, y0 + k * floor.step, z, x1, y0 + k * floor.step, z);
    const lines = new BufferGeometry();
    lines.setAttribute("position", new BufferAttribute(new Float32Array(ends), 3));
    this.scene.add(plane, new LineSegments(lines, new LineBasicMaterial({ color: "#d3dae1" })));
  }

  /** Look from where still pictures are seen. */
  front() {
    const [azimuth, elevation] = this.flat ? [0, 0] : [FROM.azimuth, FROM.elevation].map((x) => (x * Math.PI) / 180);
    const way = new Vector3(
      Math.sin(azimuth) * Math.cos(elevation), -Math.cos(azimuth) * Math.cos(elevation), Math.sin(elevation),
    );
    this.turned = this.moved = false; // by hand, or after what moves
    this.controls.target.copy(this.middle);
    this.camera.position.copy(this.middle).addScaledVector(way, 4 * this.radius);
    this.camera.near = 0.01 * this.radius;
    this.camera.far = 20 * this.radius;
    this.camera.zoom = 1;
    this.controls.update();
    this.camera.updateMatrixWorld();
    const turn = this.camera.quaternion.clone().invert();
    const seen = this.corners.map((corner) => corner.clone().sub(this.middle).applyQuaternion(turn));
    this.extent = {
      across: Math.max(...seen.map(({ x }) => Math.abs(x))), up: Math.max(...seen.map(({ y }) => Math.abs(y))),
    };
    this.resize();
  }

  /** Turn the eye about what is seen, by angles to the right and up. */
  turn(right, up) {
    this.turned = true;
    const away = this.camera.position.clone().sub(this.controls.target);
    const radius = away.length();
    const elevation = Math.min(1.55, Math.max(-1.55, Math.asin(away.z / radius) + up));
    const azimuth = Math.atan2(away.y, away.x) + right;
    const level = radius * Math.cos(elevation);
    away.set(level * Math.cos(azimuth), level * Math.sin(azimuth), radius * Math.sin(elevation));
    this.camera.position.copy(this.controls.target).add(away);
    this.controls.update();
    this.render();
  }

  /** Come nearer, or go away. */
  zoom(factor) {
    this.turned = true;
    this.camera.zoom *= factor;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  /** Fit what was seen from the front into the window. */
  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    const half = 1.06 * Math.max(this.extent.up, (this.extent.across * height) / width, 1e-9);
    Object.assign(this.camera, { left: (-half * width) / height, right: (half * width) / height, top: half, bottom: -half });
    this.camera.updateProjectionMatrix();
    this.render();
  }

  addPaths(run) {
    for (const trail of run.stage.trails) {
      const line = wideLine(new Float32Array(3 * LONGEST), run.tint ?? trail.colour, 1.1, {
        transparent: true, opacity: 0.7, depthTest: !this.flat,
      });
      line.renderOrder = -1;
      this.scene.add(line);
      run.paths.push({ trail, line, count: 0, last: -1 });
    }
  }

  /** Draw paths up to a sample of a run's track, anew where it went back. */
  drawPaths(run, track, sample) {
    for (const path of run.paths) {
      if (sample < path.last || path.track !== track || track.times.length < path.known) path.count = path.last = 0;
      path.track = track;
      path.known = track.times.length;
      const { array } = path.line.geometry.attributes.instanceStart.data;
      const skip = Math.max(1, Math.ceil(track.times.length / LONGEST));
      for (let k = path.last; k < sample; k += skip) {
        if (path.count >= LONGEST - 1) {
          array.copyWithin(0, 6);
          path.count -= 1;
        }
        array.set(this.pointOf(run, track.poses[k], path.trail), 6 * path.count);
        array.set(this.pointOf(run, track.poses[Math.min(k + skip, sample)], path.trail), 6 * path.count + 3);
        path.count += 1;
        path.last = Math.min(k + skip, sample);
      }
      path.line.geometry.instanceCount = path.count;
      path.line.geometry.attributes.instanceStart.data.needsUpdate = true;
      path.line.visible = path.count > 0 && this.showsPaths !== false;
    }
  }

  pointOf(run, poses, { frame, point: [x, y, z] }) {
    const o = frame * run.stage.stride;
    if (this.flat) {
      const [c, s] = [Math.cos(poses[o + 2]), Math.sin(poses[o + 2])];
      return [poses[o] + c * x - s * z, y, poses[o + 1] + s * x + c * z];
    }
    const row = (k) => poses[o + k] + poses[o + 3 * k + 3] * x + poses[o + 3 * k + 4] * y + poses[o + 3 * k + 5] * z;
    return [row(0), row(1), row(2)];
  }

  /** Draw vectors: each has a part, x, y and z in its unit, a colour, and how many metres a unit is long. */
  drawArrows(run, vectors) {
    for (const one of run.arrows) this.scene.remove(one);
    run.arrows = vectors.flatMap(({ part, vector, colour, scale }) => {
      const anchor = run.stage.anchors[part];
      const way = new Vector3(...vector);
      const length = way.length() * scale;
      if (!anchor || !(length > 1e-3 * this.unit)) return [];
      const head = Math.min(4 * this.unit, 0.4 * length);
      const from = run.shapes.place(anchor.frame, anchor.point);
      const made = new ArrowHelper(way.normalize(), from, length, colour, head, 0.5 * head);
      for (const half of [made.line, made.cone]) {
        half.renderOrder = 1000;
        half.material.depthTest = false;
      }
      return [made];
    });
    if (run.arrows.length) this.scene.add(...run.arrows);
  }

  /** Draw a run at one time. */
  draw(run, poses, sample) {
    run.shapes.move(poses, sample);
    if (run !== this.runs[0]) return;
    if (run.stage.follows) this.follow(run, poses);
    else if (!this.turned) this.keepInSight(run, poses);
  }

  /** Move the eye where nothing that moves is seen any more: a live scene may go on farther than its record. */
  keepInSight(run, poses) {
    const { stride } = run.stage;
    let nearest = null;
    run.first ??= Float64Array.from(poses);
    for (let o = 0; o < poses.length; o += stride) {
      if (run.first.subarray(o, o + stride).every((x, k) => x === poses[o + k])) continue; // it is fixed
      const place = this.flat ? [poses[o], this.middle.y, poses[o + 1]] : poses.slice(o, o + 3);
      const { x, y } = new Vector3(...place).project(this.camera);
      const far = Math.max(Math.abs(x), Math.abs(y));
      if (!(far > 1)) return;
      if (!nearest || far < nearest.far) nearest = { x, y, far };
    }
    if (!nearest) {
      if (this.moved) this.front(); // all is where it began
      return;
    }
    this.moved = true;
    const beyond = (x) => x - Math.min(0.8, Math.max(-0.8, x));
    const by = new Vector3(beyond(nearest.x) * this.camera.right, beyond(nearest.y) * this.camera.top, 0);
    by.divideScalar(this.camera.zoom).applyQuaternion(this.camera.quaternion);
    this.controls.target.add(by);
    this.camera.position.add(by);
    this.camera.updateMatrixWorld();
  }

  follow(run, poses) {
    const { stride } = run.stage;
    const [sum, count] = [new Vector3(), poses.length / stride - 1];
    for (let o = stride; o < poses.length; o += stride) sum.add(new Vector3(poses[o], poses[o + 1], poses[o + 2]));
    const by = sum.divideScalar(count || 1).sub(this.controls.target);
    this.controls.target.add(by);
    this.camera.position.add(by);
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }

  /** Return the line of sight through the pointer. */
  rayAt(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const across = (2 * (event.clientX - box.left)) / box.width - 1;
    const up = 1 - (2 * (event.clientY - box.top)) / box.height;
    const ray = new Raycaster();
    ray.params.Line2 = { threshold: 6 };
    ray.setFromCamera(new Vector2(across, up), this.camera);
    return ray;
  }

  /** Return the part under a place of the window, and where it is hit; null where there is nothing. */
  pick(event) {
    const ray = this.rayAt(event);
    const hits = ray.intersectObjects(this.runs.map((run) => run.shapes.group), true).filter((hit) => hit.object.userData.part);
    if (!hits.length) return null;
    if (this.flat) hits.sort((a, b) => b.object.renderOrder - a.object.renderOrder);
    return { part: hits[0].object.userData.part, point: hits[0].point, object: hits[0].object };
  }

  /** Return the place under the pointer in the plane of the screen through a point; of a flat scene in its own plane. */
  under(event, point) {
    const normal = this.flat ? new Vector3(0, 1, 0) : this.camera.getWorldDirection(new Vector3());
    const { origin, direction } = this.rayAt(event).ray;
    const along = normal.dot(new Vector3().subVectors(point, origin)) / normal.dot(direction);
    return origin.clone().addScaledVector(direction, along);
  }

  /** Return the picture as it is, as a PNG file. */
  png() {
    this.render();
    return new Promise((done) => this.renderer.domElement.toBlob(done, "image/png"));
  }
}
