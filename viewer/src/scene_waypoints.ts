// All waypoints of the 3D scene in one draw: rings that face the eye, their shapes computed where
// they are drawn, so that they stay sharp from near and thin from far.

import {
  BufferGeometry,
  Color,
  Float32BufferAttribute,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  PlaneGeometry,
  ShaderMaterial,
} from "three";
import type { Flight, Moment } from "./flight";
import { colour } from "./palette";
import { place } from "./scene_space";

const VERTEX = `
attribute vec4 spot; // place, radius
attribute vec3 kind; // heavy, covered, shown
varying vec2 at;
varying vec2 what;
void main() {
  at = 2.2 * position.xy;
  what = kind.xy;
  vec4 seen = modelViewMatrix * vec4(spot.xyz, 1.0);
  seen.xy += at * spot.w * kind.z;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = `
uniform vec3 open;
uniform vec3 covered;
uniform vec3 edge;
varying vec2 at;
varying vec2 what;
float segment(vec2 from, vec2 to) {
  vec2 along = to - from;
  return length(at - from - along * clamp(dot(at - from, along) / dot(along, along), 0.0, 1.0));
}
void main() {
  float away = length(at);
  float pixel = fwidth(away);
  float width = max(0.035, 0.5 * pixel);
  float strength = clamp(0.09 / pixel, 0.45, 1.0);
  float line = abs(away - 1.0);
  if (what.x > 0.5 && pixel < 0.1) line = min(line, abs(away - 0.82));
  float ring = 1.0 - smoothstep(width - 0.5 * pixel, width + 0.5 * pixel, line);
  float fill = 0.0;
  if (what.y > 0.5) {
    fill = 0.45 * (1.0 - smoothstep(1.0 - pixel, 1.0, away));
    float tick = min(
      segment(vec2(-0.3, 0.0), vec2(-0.08, -0.21)), segment(vec2(-0.08, -0.21), vec2(0.3, 0.21)));
    if (pixel < 0.14) ring = max(ring, 1.0 - smoothstep(0.05, 0.05 + pixel, tick));
  }
  ring *= strength;
  float alpha = max(ring, fill);
  if (alpha < 0.02) discard;
  vec3 ink = what.y > 0.5 ? edge : open;
  gl_FragColor = vec4(mix(covered, ink, ring / max(alpha, 1e-3) * step(fill, ring)), alpha);
  #include <colorspace_fragment>
}`;

export class Waypoints {
  readonly group = new Group();
  private readonly kinds: InstancedBufferAttribute;
  private readonly stalks: Float32BufferAttribute;
  private shownSample = -1;

  constructor(private readonly flight: Flight, private readonly ground: number) {
    const { waypoints } = flight.scene;
    const spots: number[] = [];
    const stalks: number[] = [];
    const kinds: number[] = [];
    for (const { at, radius, heavy } of waypoints) {
      const { x, y, z } = place(at);
      spots.push(x, y, z, radius);
      kinds.push(Number(heavy), 0, 1);
      stalks.push(x, y, z, x, ground, z);
    }
    const square = new PlaneGeometry(1, 1);
    const geometry = new InstancedBufferGeometry();
    geometry.index = square.index;
    geometry.setAttribute("position", square.getAttribute("position"));
    geometry.setAttribute("spot", new InstancedBufferAttribute(new Float32Array(spots), 4));
    this.kinds = new InstancedBufferAttribute(new Float32Array(kinds), 3);
    geometry.setAttribute("kind", this.kinds);
    geometry.instanceCount = waypoints.length;
    const ink = (name: string) => ({ value: new Color(colour(name)) });
    const rings = new Mesh(
      geometry,
      new ShaderMaterial({
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        uniforms: { open: ink("--open"), covered: ink("--covered"), edge: ink("--covered-edge") },
        transparent: true,
        depthWrite: false,
      }),
    );
    rings.frustumCulled = false;
    const down = new BufferGeometry();
    this.stalks = new Float32BufferAttribute(stalks, 3);
    down.setAttribute("position", this.stalks);
    const faint = new LineBasicMaterial({ color: colour("--open"), transparent: true, opacity: 0.25 });
    this.group.add(new LineSegments(down, faint), rings);
  }

  draw(moment: Moment): void {
    if (moment.sample === this.shownSample) return;
    this.shownSample = moment.sample;
    this.flight.data.covered_at.forEach((sample, w) => {
      this.kinds.array[3 * w + 1] = Number(sample <= moment.sample);
      const asked = this.flight.asked(w, moment.sample);
      this.kinds.array[3 * w + 2] = Number(asked);
      this.stalks.setY(2 * w, asked ? -this.flight.scene.waypoints[w].at[2] : this.ground);
    });
    this.kinds.needsUpdate = this.stalks.needsUpdate = true;
  }
}
