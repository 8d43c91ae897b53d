// The paths flown, of all UAS in one: segments in order of time, so that what has been flown at a
// moment is the first so many of them.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Group,
  InterleavedBufferAttribute,
  LineBasicMaterial,
  LineSegments,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import type { Flight, Moment } from "./flight";
import { bright, colour } from "./palette";
import { place } from "./scene_space";
import type { Trail } from "./trail";
import type { Focus } from "./view";

const WIDTH_PX = 2.4;
const MANY = 12;
const PALE = 0.75;

export class Paths {
  readonly group = new Group();
  private readonly flown: Segments;
  private readonly latest: Segments;
  /** Whose each segment is, and its sample. */
  private readonly segments: [number, number][] = [];
  /** How many segments are over at a sample. */
  private readonly over: number[] = [];
  private trail: Trail | null = null;
  private looked: boolean[];

  constructor(private readonly flight: Flight, ghosts: boolean) {
    this.looked = flight.scene.uas.map(() => true);
    const corners: number[] = [];
    for (let k = 0; k < flight.data.samples; k++) {
      this.over.push(this.segments.length);
      for (let i = 0; i < flight.uas; i++) {
        if (k >= flight.data.last[i]) continue;
        this.segments.push([i, k]);
        for (const at of [k, k + 1]) corners.push(...place(flight.position(at, i)).toArray());
      }
    }
    // with what can be seen through, to be drawn after the discs of waypoints, which would hide them
    const look = { transparent: true, opacity: ghosts ? 0.55 : 1 };
    const width = flight.uas > MANY ? null : ghosts ? 1.5 : WIDTH_PX;
    this.flown = new Segments(this.segments.length, width, look);
    this.flown.corners(corners);
    this.latest = new Segments(flight.uas, width, look);
    this.group.add(this.flown.lines, this.latest.lines);
    this.paint();
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
    this.paint();
  }

  /** @param focus of this flight's UAS; those that are not looked at are pale */
  focus({ uas, shown }: Focus): void {
    const looked = this.flight.scene.uas.map((_, i) => shown(i) && (uas === null || uas === i));
    if (looked.every((each, i) => each === this.looked[i])) return;
    this.looked = looked;
    this.paint();
  }

  draw(moment: Moment): void {
    const { sample, vehicles } = moment;
    this.flown.show(this.over[Math.min(sample, this.over.length - 1)]);
    const corners: number[] = [];
    const colours: number[] = [];
    vehicles.forEach(({ position }, i) => {
      const flown = Math.min(sample, this.flight.data.last[i]);
      corners.push(...place(this.flight.position(flown, i)).toArray(), ...place(position).toArray());
      const ink = this.colour(i, flown);
      colours.push(...ink, ...ink);
    });
    this.latest.corners(corners);
    this.latest.colours(colours);
  }

  private paint(): void {
    const colours: number[] = [];
    for (const [i, k] of this.segments) colours.push(...this.colour(i, k), ...this.colour(i, k + 1));
    this.flown.colours(colours);
  }

  /** Of others than the one that is looked at: nearly that of the ground. */
  private colour(i: number, k: number): number[] {
    const ink = this.trail?.colour(this.flight, i, k) ?? bright(this.flight.scene.uas[i].colour);
    const pale = this.looked[i] ? 0 : PALE;
    return new Color(ink).lerp(new Color(colour("--ground")), pale).toArray();
  }
}

/** Coloured segments: wide ones, or, of very many, those of one pixel. */
class Segments {
  readonly lines: LineSegments | LineSegments2;

  constructor(private readonly count: number, width: number | null, look: object) {
    // a buffer cannot be empty
    const blank = () => new Float32Array(6 * Math.max(1, count));
    if (width === null) {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(blank(), 3));
      geometry.setAttribute("color", new BufferAttribute(blank(), 3));
      this.lines = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, ...look }));
    } else {
      const geometry = new LineSegmentsGeometry();
      geometry.setPositions(blank());
      geometry.setColors(blank());
      const paint = new LineMaterial({ vertexColors: true, linewidth: width, ...look });
      this.lines = new LineSegments2(geometry, paint);
    }
    // its extent changes with every moment
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 1;
  }

  corners(values: number[]): void {
    this.set("position", "instanceStart", values);
  }

  colours(values: number[]): void {
    this.set("color", "instanceColorStart", values);
  }

  /** The first so many. */
  show(count: number): void {
    const { geometry } = this.lines;
    if (geometry instanceof LineSegmentsGeometry) geometry.instanceCount = count;
    else geometry.setDrawRange(0, 2 * count);
    this.lines.visible = count > 0;
  }

  // in place: new buffers would be new memory of the graphics card in every picture
  private set(thin: string, wide: string, values: number[]): void {
    const attribute =
      this.lines.geometry.getAttribute(this.lines instanceof LineSegments2 ? wide : thin);
    const buffer = attribute instanceof InterleavedBufferAttribute ? attribute.data : attribute;
    buffer.array.set(values.slice(0, 6 * this.count));
    buffer.needsUpdate = true;
  }
}
