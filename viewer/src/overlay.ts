// What is drawn over the map and over the 3D scene alike, wherever a point of the flight lies on
// the picture: rings of charge, names, violations, points of no return, what was clicked.

import { FEW, type Flight, type Moment } from "./flight";
import type { Point2, Point3 } from "./flight_data";
import * as marks from "./marks";
import { bright, colour, legible } from "./palette";
import type { Focus } from "./view";

/** Where a point is on the picture; null: behind the eye. */
export type Project = (point: Point3) => Point2 | null;

type Box = [number, number, number, number];

const PICKED_PX = 13;

export class Overlay {
  private labels: Box[] = [];

  constructor(
    private readonly pen: CanvasRenderingContext2D,
    private readonly flight: Flight,
    private readonly project: Project,
  ) {}

  /** The areas that UAS can still reach and come home from: of the followed one, or of a few. */
  reach(moment: Moment, focus: Focus): void {
    const all = this.flight.scene.uas.map((_, i) => i);
    const looked = all.filter((i) => (focus.uas === null ? focus.shown(i) : focus.uas === i));
    if (looked.length > FEW) return;
    for (const i of looked) this.reachOf(moment, i, focus.uas === i);
  }

  private reachOf(moment: Moment, i: number, followed: boolean): void {
    const corners = this.flight.reach(moment, i);
    if (corners.length === 0) return;
    const { pen } = this;
    const hex = bright(this.flight.scene.uas[i].colour);
    pen.beginPath();
    for (const corner of corners) {
      const at = this.project(corner);
      if (at) pen.lineTo(...at);
    }
    pen.closePath();
    if (followed) {
      pen.globalAlpha = 0.07;
      pen.fillStyle = hex;
      pen.fill();
    }
    pen.globalAlpha = followed ? 0.9 : 0.7;
    pen.setLineDash([7, 4]);
    pen.lineWidth = followed ? 1.6 : 1.1;
    pen.strokeStyle = hex;
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  /** @param unit size of marks: 1 in a large picture; @param crosses draw vehicles, too */
  draw(moment: Moment, focus: Focus, unit: number, zoom: number, crosses: boolean): void {
    this.labels = [];
    this.violations(moment, unit);
    const all = this.flight.scene.uas.map((_, i) => i);
    for (const i of all) this.noReturn(moment, i, focus, unit);
    // the marks of those that are looked at lie above the others, and their names come first
    const order = [...all].sort((a, b) => this.rank(a, focus) - this.rank(b, focus));
    for (const i of [...order].reverse()) this.vehicle(moment, i, focus, unit, zoom, crosses);
    for (const i of order) this.name(moment, i, focus, unit, zoom);
    this.picked(focus);
  }

  ghosts(ghost: Flight, moment: Moment, unit: number): void {
    ghost.scene.uas.forEach(({ name, colour: hex }, i) => {
      const at = this.project(moment.vehicles[i].position);
      if (at) marks.ghost(this.pen, ...at, 9 * unit, marks.shortName(name), hex);
    });
  }

  moving(moment: Moment, unit: number): void {
    this.flight.scene.moving.forEach(({ name, kind, height, from }, i) => {
      if (from > moment.sample) return;
      const [north, east, down] = moment.moving[i];
      const at = this.project([north, east, down - height / 2]);
      const text = (kind || name).replaceAll("_", " ");
      if (at) marks.words(this.pen, text, at[0], at[1] - 12 * unit, 11 * unit, colour("--ink"));
    });
  }

  private rank(i: number, focus: Focus): number {
    return i === focus.uas ? -2 : focus.shown(i) ? -1 : 0;
  }

  /** Size of one UAS's marks: of many smaller, and whole again from near. */
  private size(i: number, focus: Focus, unit: number, zoom: number): number {
    if (i === focus.uas) return unit;
    return unit * marks.crowded(this.flight.uas, zoom, focus.uas !== null);
  }

  private vehicle(moment: Moment, i: number, focus: Focus, unit: number, zoom: number, crosses: boolean): void {
    const { pen } = this;
    const { position, attitude, soc, spare, mode } = moment.vehicles[i];
    const at = this.project(position);
    if (!at) return;
    const { colour: hex } = this.flight.scene.uas[i];
    const size = this.size(i, focus, unit, zoom);
    const hidden = !focus.shown(i) || (focus.uas !== null && focus.uas !== i);
    pen.globalAlpha = focus.shown(i) ? (hidden ? 0.7 : 1) : 0.2;
    if (mode === "lost") marks.cross(pen, ...at, 10 * size);
    else if (mode === "landed") marks.landed(pen, ...at, 5 * size, hex);
    else {
      marks.charge(pen, ...at, 14 * size, soc, spare);
      if (crosses) marks.vehicle(pen, ...at, 8 * size, attitude[2], hex);
    }
    pen.globalAlpha = 1;
  }

  /** The name of a UAS, where it does not lie on another name. */
  private name(moment: Moment, i: number, focus: Focus, unit: number, zoom: number): void {
    const { position, mode } = moment.vehicles[i];
    if (!focus.shown(i) || mode === "landed" || mode === "lost") return;
    const at = this.project(position);
    if (!at) return;
    const size = this.size(i, focus, unit, zoom);
    const { name, colour: hex } = this.flight.scene.uas[i];
    const text = marks.shortName(name);
    const high = Math.max(10, 14.7 * size);
    const [x, y] = [at[0] + 17.5 * size, at[1] - 14.7 * size];
    const half = 0.36 * high * text.length;
    const box: Box = [x - half, y - high / 2, x + half, y + high / 2];
    if (this.labels.some((other) => overlap(box, other))) return;
    this.labels.push(box);
    marks.words(this.pen, text, x, y, high, legible(hex));
  }

  private violations(moment: Moment, unit: number): void {
    for (const violation of this.flight.data.violations) {
      const at = this.project(this.flight.where(violation));
      if (!at) continue;
      this.pen.globalAlpha = violation.t_s <= moment.time + 1e-6 ? 1 : 0.35;
      marks.violation(this.pen, ...at, 10 * unit);
      this.pen.globalAlpha = 1;
    }
  }

  private noReturn(moment: Moment, i: number, focus: Focus, unit: number): void {
    if (!this.flight.nearNoReturn(i, focus.uas)) return;
    const passed = this.flight.data.no_return[i];
    const sample = passed ?? this.flight.data.least_spare[i][0];
    const at = this.project(this.flight.position(sample, i));
    if (!at) return;
    this.pen.globalAlpha = sample <= moment.sample ? 1 : 0.35;
    marks.noReturn(this.pen, ...at, 7 * unit, passed !== null, this.flight.scene.uas[i].colour);
    this.pen.globalAlpha = 1;
  }

  private picked({ picked }: Focus): void {
    const at = picked && this.project(picked);
    if (!at) return;
    const { pen } = this;
    for (const [width, ink] of [
      [5, colour("--halo")],
      [2, colour("--accent")],
    ] as const) {
      pen.lineWidth = width;
      pen.strokeStyle = ink;
      pen.beginPath();
      pen.arc(...at, PICKED_PX, 0, 2 * Math.PI);
      pen.stroke();
    }
  }
}

function overlap(a: Box, b: Box): boolean {
  return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}
