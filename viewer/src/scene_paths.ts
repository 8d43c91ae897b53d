// The paths flown, of all UAS in one: segments in order of time, so that what has been flown at a
// moment is the first so many of them.

import { Color, Group, InterleavedBufferAttribute } from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import type { Flight, Moment } from "./flight";
import { bright, colour } from "./palette";
import { place } from "./scene_space";
import type { Trail } from "./trail";

const WIDTH_PX = 2.4;
const MANY = 12;
const PALE = 0.75;

export class Paths {
  readonly group = new Group();
  private readonly flown: LineSegments2;
  private readonly latest: LineSegments2;
  /** Whose each segment is, and its sample. */
  private readonly segments: [number, number][] = [];
  /** How many segments are over at a sample. */
  private readonly over: number[] = [];
  private trail: Trail | null = null;
  private focused: number | null = null;

  constructor(private readonly flight: Flight, ghosts: boolean) {
    const corners: number[] = [];
    for (let k = 0; k < flight.data.samples; k++) {
      this.over.push(this.segments.length);
      for (let i = 0; i < flight.uas; i++) {
        if (k >= flight.data.last[i]) continue;
        this.segments.push([i, k]);
        for (const at of [k, k + 1]) corners.push(...place(flight.position(at, i)).toArray());
      }
    }
    const look = {
      linewidth: ghosts ? 1.5 : flight.uas > MANY ? 1.6 : WIDTH_PX,
      ...(ghosts ? { transparent: true, opacity: 0.55 } : {}),
    };
    this.flown = lines(corners, new LineMaterial({ vertexColors: true, ...look }));
    const newest = new Array(6 * flight.uas).fill(0);
    this.latest = lines(newest, new LineMaterial({ vertexColors: true, ...look }));
    this.latest.geometry.setColors(newest);
    this.group.add(this.flown, this.latest);
    this.paint();
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
    this.paint();
  }

  focus(uas: number | null): void {
    if (uas === this.focused) return;
    this.focused = uas;
    this.paint();
  }

  draw(moment: Moment): void {
    const { sample, vehicles } = moment;
    const count = this.over[Math.min(sample, this.over.length - 1)];
    this.flown.geometry.instanceCount = count;
    this.flown.visible = count > 0;
    // in place: new buffers would be new memory of the graphics card in every picture
    const corners = this.latest.geometry.getAttribute("instanceStart") as InterleavedBufferAttribute;
    const colours = this.latest.geometry.getAttribute("instanceColorStart") as InterleavedBufferAttribute;
    vehicles.forEach(({ position }, i) => {
      const flown = Math.min(sample, this.flight.data.last[i]);
      const from = place(this.flight.position(flown, i)).toArray();
      corners.data.array.set([...from, ...place(position).toArray()], 6 * i);
      const ink = this.colour(i, flown);
      colours.data.array.set([...ink, ...ink], 6 * i);
    });
    corners.data.needsUpdate = colours.data.needsUpdate = true;
  }

  private paint(): void {
    if (this.segments.length === 0) return;
    const colours = new Float32Array(6 * this.segments.length);
    this.segments.forEach(([i, k], n) => {
      colours.set(this.colour(i, k), 6 * n);
      colours.set(this.colour(i, k + 1), 6 * n + 3);
    });
    this.flown.geometry.setColors(colours);
  }

  /** Of others than the one that is looked at: nearly that of the ground. */
  private colour(i: number, k: number): number[] {
    const ink = this.trail?.colour(this.flight, i, k) ?? bright(this.flight.scene.uas[i].colour);
    const pale = this.focused !== null && this.focused !== i;
    return new Color(ink).lerp(new Color(colour("--ground")), pale ? PALE : 0).toArray();
  }
}

function lines(corners: number[], paint: LineMaterial): LineSegments2 {
  const geometry = new LineSegmentsGeometry();
  // a buffer cannot be empty
  geometry.setPositions(corners.length > 0 ? corners : new Array(6).fill(0));
  const made = new LineSegments2(geometry, paint);
  // its extent changes with every moment
  made.frustumCulled = false;
  return made;
}
