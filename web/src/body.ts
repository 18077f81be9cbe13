// The body in space: its axes, the compass below it, the horizon around it, and the doubt of its nose as a cone.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { RoundedBoxGeometry } from "three/examples/jsm/geometries/RoundedBoxGeometry.js";
import { euler, type Quat } from "./attitude";
import { colour, fitCanvas, make } from "./dom";

const SIZE: [number, number, number] = [1.3, 0.86, 0.17]; // x forward, y left, z up
const NOSE = 1.55; // length of the cone
const RING = 1.55; // radius of the compass
const FLOOR = -0.75;
const WIDEST = 1.4; // rad: a cone beyond is no cone
const VIEWS: [number, number, number][] = [[-1.9, -5.0, 1.75], [-5.5, 0, 1.2], [0, -0.01, 6.2], [0, -5.6, 0.3]];

export interface Doubt { tilt: number; heading: number } // 1σ, rad
export interface Ghost { quat: Quat; colour: string }

export class Body {
  private canvas = make("canvas", { role: "img", "aria-label": "the body in space", tabindex: "-1" });
  private horizon = make("canvas", { class: "horizon", role: "img", "aria-label": "artificial horizon" });
  private renderer: THREE.WebGLRenderer | null = null;
  private scene = new THREE.Scene();
  private camera = new THREE.PerspectiveCamera(34, 1, 0.1, 80);
  private controls: OrbitControls | null = null;
  private body = new THREE.Group();
  private shell = new THREE.MeshStandardMaterial({ roughness: 0.45, metalness: 0.1 });
  private paint = new THREE.MeshStandardMaterial({ roughness: 0.6 });
  private cone: THREE.Mesh;
  private fan = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ transparent: true, side: THREE.DoubleSide, depthWrite: false }));
  private ring = new THREE.Mesh(new THREE.PlaneGeometry(2.75 * RING, 2.75 * RING), new THREE.MeshBasicMaterial({ transparent: true, depthWrite: false }));
  private ground = new THREE.Mesh(new THREE.CircleGeometry(40, 48), new THREE.MeshBasicMaterial());
  private sky: THREE.Mesh<THREE.SphereGeometry, THREE.ShaderMaterial>;
  private ghosts: THREE.LineSegments[] = [];
  private cardinals = [0, 1, 2, 3].map(() => sprite(""));
  private outline = new THREE.EdgesGeometry(new THREE.BoxGeometry(...SIZE));
  private view = 0;
  private fanWidth = -1;
  private quat: Quat = [1, 0, 0, 0];
  private valid = false; // grey until an orientation comes
  private relative = false;
  private dirty = true;
  private sized = false; // it has its place on the page

  constructor(readonly element = make("div", { class: "scene" })) {
    this.element.append(this.canvas, this.horizon);
    this.camera.up.set(0, 0, 1);
    try {
      this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, powerPreference: "low-power" });
      this.controls = new OrbitControls(this.camera, this.canvas);
      this.controls.enablePan = false;
      this.controls.minDistance = 2.5;
      this.controls.maxDistance = 12;
      this.controls.maxPolarAngle = 1.65;
      this.controls.addEventListener("change", () => { this.dirty = true; });
    } catch {
      this.canvas.replaceWith(make("p", { class: "quiet" }, "This browser draws no 3-D here (WebGL is off). The horizon shows the body."));
    }
    this.sky = new THREE.Mesh(new THREE.SphereGeometry(45, 24, 16), new THREE.ShaderMaterial({
      side: THREE.BackSide, depthWrite: false, uniforms: { low: { value: new THREE.Color() }, high: { value: new THREE.Color() } },
      vertexShader: "varying vec3 p; void main() { p = normalize(position); gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
      fragmentShader: "varying vec3 p; uniform vec3 low; uniform vec3 high; void main() { gl_FragColor = vec4(mix(low, high, smoothstep(0.0, 0.55, p.z)), 1.0); }",
    }));
    this.cone = new THREE.Mesh(coneGeometry(), new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.34, side: THREE.DoubleSide, depthWrite: false }));
    this.ground.position.z = FLOOR - 0.01;
    this.ring.position.z = FLOOR;
    this.fan.position.z = FLOOR + 0.005;
    this.cardinals.forEach((label, k) => {
      const angle = 0.5 * Math.PI * (1 - k);
      label.position.set(1.17 * RING * Math.cos(angle), 1.17 * RING * Math.sin(angle), FLOOR + 0.12);
      label.scale.multiplyScalar(1.3);
      label.material.depthTest = true;
      this.scene.add(label);
    });
    this.buildBody();
    const sun = new THREE.DirectionalLight(0xffffff, 2.2), fill = new THREE.DirectionalLight(0xffffff, 0.7);
    sun.position.set(-2, -3, 5);
    fill.position.set(3, 2, 1);
    this.cone.visible = this.fan.visible = false;
    this.scene.add(this.sky, this.ground, this.ring, this.fan, this.body, this.cone, sun, fill, new THREE.HemisphereLight(0xffffff, 0xa9b8c8, 1.7));
    this.nextView(0);
    new ResizeObserver(() => {
      const shown = this.sized;
      this.resize();
      if (shown) this.render(); // at once, or it would flicker; the first time the next frame draws it
    }).observe(this.element);
  }

  private buildBody(): void {
    const box = new THREE.Mesh(new RoundedBoxGeometry(...SIZE, 4, 0.06), this.shell);
    const chevron = new THREE.Shape([[0.42, 0], [0.12, 0.26], [0.02, 0.26], [0.24, 0.04], [-0.42, 0.04], [-0.42, -0.04], [0.24, -0.04], [0.02, -0.26], [0.12, -0.26]]
      .map(([x, y]) => new THREE.Vector2(x, y)));
    const mark = new THREE.Mesh(new THREE.ShapeGeometry(chevron), this.paint);
    mark.position.z = 0.5 * SIZE[2] + 0.003;
    this.body.add(box, mark);
    const lengths = [0.5 * SIZE[0] + 0.42, 0.5 * SIZE[1] + 0.42, 0.62];
    ["axis-x", "axis-y", "axis-z"].forEach((name, k) => {
      const material = new THREE.MeshStandardMaterial({ roughness: 0.5 });
      material.name = name;
      const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.018, 0.018, lengths[k], 12), material);
      const tip = new THREE.Mesh(new THREE.ConeGeometry(0.055, 0.15, 20), material);
      shaft.position.y = 0.5 * lengths[k];
      tip.position.y = lengths[k];
      const arrow = new THREE.Group();
      arrow.add(shaft, tip);
      if (k === 0) arrow.rotation.z = -0.5 * Math.PI;
      if (k === 2) arrow.rotation.x = 0.5 * Math.PI;
      const label = sprite("xyz"[k]);
      label.name = name;
      label.position.set(...([0, 1, 2].map((i) => (i === k ? lengths[k] + 0.2 : 0)) as [number, number, number]));
      this.body.add(arrow, label);
    });
  }

  /** Takes the colours of the style sheet: at the start and when the system's setting changes. */
  recolour(): void {
    this.ground.material.color.set(colour("ground"));
    this.sky.material.uniforms.low.value.set(colour("haze"));
    this.sky.material.uniforms.high.value.set(colour("sky"));
    (this.cone.material as THREE.MeshBasicMaterial).color.set(colour("warm"));
    (this.fan.material as THREE.MeshBasicMaterial).color.set(colour("warm"));
    (this.fan.material as THREE.MeshBasicMaterial).opacity = 0.4;
    this.scene.fog = new THREE.Fog(colour("haze"), 12, 40);
    this.body.traverse((part) => {
      if (part instanceof THREE.Sprite) paintSprite(part, colour("ink"));
      else if (part instanceof THREE.Mesh && (part.material as THREE.Material).name.startsWith("axis")) {
        (part.material as THREE.MeshStandardMaterial).color.set(colour((part.material as THREE.Material).name));
      }
    });
    this.paintRing();
    this.paintBody();
    this.render();
  }

  private paintBody(): void {
    this.shell.color.set(colour(this.valid ? "accent" : "dead"));
    this.paint.color.set(this.valid ? "#ffffff" : colour("card"));
    this.element.dataset.state = this.valid ? "valid" : "invalid";
  }

  private paintRing(): void {
    const side = 1024, canvas = document.createElement("canvas");
    canvas.width = canvas.height = side;
    const context = canvas.getContext("2d")!, centre = side / 2, radius = (side / 2.75) * 0.98;
    context.translate(centre, centre);
    context.strokeStyle = context.fillStyle = colour("soft");
    context.lineWidth = 2.5;
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.stroke();
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (let degrees = 0; degrees < 360; degrees += 10) {
      context.save();
      context.rotate((degrees * Math.PI) / 180);
      const long = degrees % 30 === 0;
      context.fillRect(-1.5, -radius, 3, long ? 26 : 14);
      if (long) {
        const cardinal = degrees % 90 === 0, yaw = ((450 - degrees) % 360 + 180) % 360 - 180;
        const words = this.relative ? `${yaw}°`.replace("-", "−") : cardinal ? "NESW"[degrees / 90] : String(degrees).padStart(3, "0");
        context.font = "30px system-ui";
        if (cardinal) this.cardinals[degrees / 90].userData.text = words;
        else context.fillText(words, 0, -radius - 36);
      }
      context.restore();
    }
    this.cardinals.forEach((label, k) => paintSprite(label, colour(k === 0 && !this.relative ? "bad" : "ink")));
    this.ring.material.map?.dispose();
    this.ring.material.map = new THREE.CanvasTexture(canvas);
    this.ring.material.map.colorSpace = THREE.SRGBColorSpace;
    this.ring.material.map.anisotropy = 8;
    this.ring.material.needsUpdate = true;
  }

  /** Another point of view; 0: from the south and above. */
  nextView(view = this.view + 1): void {
    this.view = view % VIEWS.length;
    this.camera.position.set(...VIEWS[this.view]);
    this.camera.lookAt(0, 0, -0.35);
    this.controls?.target.set(0, 0, -0.35);
    this.controls?.update();
    this.dirty = true;
  }

  /** `relative`: heading counts from the start, so the compass has no north. */
  setRelative(relative: boolean): void {
    if (relative === this.relative) return;
    this.relative = relative;
    this.paintRing();
    this.dirty = true;
  }

  turn(quat: Quat, doubt: Doubt | null, ghosts: Ghost[], valid: boolean): void {
    const known = quat.every(Number.isFinite);
    if (known) this.quat = quat;
    if ((valid && known) !== this.valid) {
      this.valid = valid && known;
      this.paintBody();
    }
    const [w, x, y, z] = this.quat, [, pitch, yaw] = euler(this.quat).map((angle) => (angle * Math.PI) / 180);
    this.body.quaternion.set(x, y, z, w);
    this.cone.visible = this.fan.visible = this.valid && doubt !== null;
    if (doubt !== null && this.valid) {
      const tilt = Math.min(2 * doubt.tilt, WIDEST), heading = Math.min(2 * doubt.heading, WIDEST);
      this.cone.scale.set(NOSE, NOSE * Math.tan(heading), NOSE * Math.tan(tilt));
      if (2 * Math.max(doubt.tilt, doubt.heading) >= WIDEST) this.cone.visible = false;
      this.cone.rotation.set(0, pitch, yaw, "ZYX");
      this.fan.rotation.z = yaw;
      const width = Math.min(2 * doubt.heading, Math.PI);
      if (Math.abs(width - this.fanWidth) > 0.02 * this.fanWidth + 1e-4) {
        this.fanWidth = width;
        this.fan.geometry.dispose();
        this.fan.geometry = new THREE.CircleGeometry(RING * 0.985, 48, -width, 2 * width);
      }
    }
    while (this.ghosts.length < ghosts.length) {
      const lines = new THREE.LineSegments(this.outline, new THREE.LineBasicMaterial());
      this.ghosts.push(lines);
      this.scene.add(lines);
    }
    this.ghosts.forEach((lines, k) => {
      lines.visible = k < ghosts.length && ghosts[k].quat.every(Number.isFinite);
      if (!lines.visible) return;
      const ghost = ghosts[k].quat;
      lines.quaternion.set(ghost[1], ghost[2], ghost[3], ghost[0]);
      (lines.material as THREE.LineBasicMaterial).color.set(colour(ghosts[k].colour));
    });
    this.dirty = true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    this.sized = true;
    this.renderer?.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer?.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = Math.min(52, Math.max(36, 46 / Math.max(0.8, width / height)));
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Draws what has changed. */
  frame(): void {
    if (this.dirty) this.render();
  }

  private render(): void {
    this.dirty = false;
    this.renderer?.render(this.scene, this.camera);
    this.drawHorizon();
  }

  private drawHorizon(): void {
    const { context, width, height } = fitCanvas(this.horizon), radius = 0.5 * Math.min(width, height) - 1;
    if (radius <= 0) return;
    const [roll, pitch] = euler(this.quat);
    context.translate(0.5 * width, 0.5 * height);
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.save();
    context.clip();
    // Pitch is positive with the nose down in ENU: the horizon then rises.
    context.rotate((-roll * Math.PI) / 180);
    const rise = (-pitch / 45) * radius;
    context.fillStyle = colour(this.valid ? "air" : "dead");
    context.fillRect(-2 * radius, -4 * radius, 4 * radius, 8 * radius);
    context.fillStyle = colour(this.valid ? "earth" : "card");
    context.fillRect(-2 * radius, rise, 4 * radius, 6 * radius);
    context.fillStyle = context.strokeStyle = "rgba(255, 255, 255, 0.85)";
    context.fillRect(-2 * radius, rise - 0.75, 4 * radius, 1.5);
    for (const step of [-30, -20, -10, 10, 20, 30]) {
      const half = step % 20 === 0 ? 0.3 * radius : 0.18 * radius;
      context.fillRect(-half, rise + (step / 45) * radius - 0.5, 2 * half, 1);
    }
    context.restore();
    context.strokeStyle = colour("line");
    context.lineWidth = 2;
    context.stroke();
    context.strokeStyle = colour("warm");
    context.lineWidth = 2.5;
    context.beginPath();
    context.moveTo(-0.62 * radius, 0);
    context.lineTo(-0.22 * radius, 0);
    context.lineTo(0, 0.16 * radius);
    context.lineTo(0.22 * radius, 0);
    context.lineTo(0.62 * radius, 0);
    context.stroke();
  }
}

/** A cone along x from its tip at the origin, of length 1 and radius 1. */
function coneGeometry(): THREE.BufferGeometry {
  const geometry = new THREE.ConeGeometry(1, 1, 48, 1, false);
  geometry.translate(0, -0.5, 0);
  geometry.rotateZ(0.5 * Math.PI);
  return geometry;
}

function sprite(text: string): THREE.Sprite {
  const found = new THREE.Sprite(new THREE.SpriteMaterial({ transparent: true, depthTest: false }));
  found.userData.text = text;
  found.scale.set(0.48, 0.24, 1);
  return found;
}

function paintSprite(label: THREE.Sprite, ink: string): void {
  const canvas = document.createElement("canvas");
  canvas.width = 192;
  canvas.height = 96;
  const context = canvas.getContext("2d")!;
  context.font = "600 64px system-ui";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = ink;
  context.fillText(label.userData.text, 96, 48);
  label.material.map?.dispose();
  label.material.map = new THREE.CanvasTexture(canvas);
  label.material.map.colorSpace = THREE.SRGBColorSpace;
  label.material.needsUpdate = true;
}
