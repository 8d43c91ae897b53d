// The map of one flight on a plain canvas: north up. It is drawn where there is no WebGL, and on
// request.

import { bounds } from "./bounds";
import { type Flight, homeAt, type Moment } from "./flight";
import type { Point2, Point3 } from "./flight_data";
import * as marks from "./marks";
import { Overlay } from "./overlay";
import { bright, colour, darker, dim } from "./palette";
import { roundStep } from "./round_step";
import { SEEN_ALPHA, type SeenSheet, sheets } from "./seen";
import { Trail } from "./trail";
import type { Focus, View } from "./view";

const FOLLOWED_ZOOM = 3;
/** Height of the strip under the area, for the scale [px]. */
const FOOT = 18;
/** Length of the scale, about [px]. */
const SCALE_PX = 60;
const MANY = 12;

export class MapView implements View {
  private readonly pen: CanvasRenderingContext2D;
  private readonly low: Point2;
  private readonly high: Point2;
  private readonly gridStep: number;
  private trail: Trail;
  private ghost: Flight | null = null;
  /** Size of marks: smaller on a small map. */
  private unit = 1;
  private scale = 1;
  private middle: Point2 = [0, 0];
  /** Of the canvas [px]: to ask the canvas for each point costs a quarter of a picture. */
  private size: Point2 = [0, 0];
  private readonly overlay: Overlay;
  private readonly seen: SeenSheet[];
  readonly canvases: HTMLCanvasElement[];

  constructor(private readonly canvas: HTMLCanvasElement, private readonly flight: Flight) {
    this.canvases = [canvas];
    this.pen = canvas.getContext("2d")!;
    this.overlay = new Overlay(this.pen, flight, (point) => this.pixel(point));
    this.trail = new Trail("uas", [flight]);
    this.seen = sheets(flight);
    [this.low, this.high] = bounds(flight.scene.fence.outline);
    const extent = Math.max(this.high[0] - this.low[0], this.high[1] - this.low[1]);
    this.gridStep = roundStep(extent / 4);
  }

  resize(): void {
    const ratio = Math.min(devicePixelRatio, 2);
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  repaint(): void {}

  setGhost(ghost: Flight | null): void {
    this.ghost = ghost;
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
  }

  overview(): void {}

  top(): void {}

  draw(moment: Moment, time: number, focus: Focus): void {
    this.frame(moment, focus.uas);
    const { pen, flight } = this;
    pen.fillStyle = colour("--outside");
    pen.fillRect(0, 0, ...this.size);
    this.terrain(moment.sample);
    flight.scene.waypoints.forEach(({ at, radius, heavy }, i) => {
      if (!flight.asked(i, moment.sample)) return;
      const covered = flight.data.covered_at[i] <= moment.sample;
      const [x, y] = this.pixel(at);
      marks.waypoint(pen, x, y, radius * this.scale, 1, heavy, covered);
    });
    this.overlay.reach(moment, focus);
    const other = this.ghost?.moment(time);
    if (this.ghost && other) this.ghosts(this.ghost, other);
    flight.scene.uas.forEach((_, i) => {
      const looked = focus.shown(i) && (focus.uas === null || focus.uas === i);
      pen.globalAlpha = looked ? 1 : 0.2;
      this.path(flight, moment, i);
      pen.globalAlpha = 1;
    });
    this.movingObstacles(moment);
    const zoom = focus.uas === null ? 1 : FOLLOWED_ZOOM;
    this.overlay.draw(moment, focus, this.unit, zoom, true);
    this.scaleBar();
  }

  private frame(moment: Moment, followed: number | null): void {
    const [width, height] = (this.size = [this.canvas.clientWidth, this.canvas.clientHeight]);
    this.unit = Math.min(1, Math.max(0.65, Math.min(width, height) / 500));
    const fit = Math.min(
      (width - 28) / (this.high[1] - this.low[1]),
      (height - 28 - FOOT) / (this.high[0] - this.low[0]),
    );
    const at = followed === null ? null : moment.vehicles[followed].position;
    this.scale = fit * (at ? FOLLOWED_ZOOM : 1);
    this.middle = at
      ? [at[0], at[1]]
      : [(this.low[0] + this.high[0]) / 2, (this.low[1] + this.high[1]) / 2];
  }

  pixel(point: Point2 | Point3): Point2 {
    return [
      this.size[0] / 2 + this.scale * (point[1] - this.middle[1]),
      (this.size[1] - FOOT) / 2 - this.scale * (point[0] - this.middle[0]),
    ];
  }

  private polygon(outline: Point2[], fill: string | null, edge: string | null, width = 1): void {
    const { pen } = this;
    pen.beginPath();
    outline.forEach((corner, i) => {
      const [x, y] = this.pixel(corner);
      if (i === 0) pen.moveTo(x, y);
      else pen.lineTo(x, y);
    });
    pen.closePath();
    if (fill) {
      pen.fillStyle = fill;
      pen.fill();
    }
    if (edge) {
      pen.strokeStyle = edge;
      pen.lineWidth = width;
      pen.stroke();
    }
  }

  private terrain(sample: number): void {
    const { pen } = this;
    const { scene } = this.flight;
    this.polygon(scene.fence.outline, colour("--ground"), null);
    this.grid();
    for (const item of scene.decorations) this.polygon(item.outline, dim(item.colour), null);
    const [[left, top], [right, bottom]] = [this.pixel([this.high[0], this.low[1]]), this.pixel([this.low[0], this.high[1]])];
    pen.globalAlpha = SEEN_ALPHA;
    for (const sheet of this.seen) {
      sheet.until(sample);
      pen.drawImage(sheet.canvas, left, top, right - left, bottom - top);
    }
    pen.globalAlpha = 1;
    for (const obstacle of scene.obstacles) {
      if (obstacle.from > sample) continue;
      const fill = obstacle.overhead ? null : dim(obstacle.colour);
      this.polygon(obstacle.outline, fill, darker(obstacle.colour, 0.45), obstacle.overhead ? 0.6 : 1.2);
    }
    this.polygon(scene.fence.outline, null, colour("--fence"), 1.8);
    for (const { homes, colour: hex } of scene.uas) {
      const [x, y] = this.pixel(homeAt(homes, sample));
      this.circle(x, y, 5 * this.unit, bright(hex), 1.5);
    }
  }

  private grid(): void {
    const step = this.gridStep;
    for (const axis of [0, 1] as const) {
      const first = Math.ceil(this.low[axis] / step) * step;
      for (let at = first; at <= this.high[axis]; at += step) {
        const ends = [[...this.low], [...this.high]] as [Point2, Point2];
        ends[0][axis] = ends[1][axis] = at;
        const [[x1, y1], [x2, y2]] = ends.map((end) => this.pixel(end));
        marks.stroke(this.pen, x1, y1, x2, y2, 1, colour("--grid"));
      }
    }
  }

  /** At the foot of the picture, over what may lie there when a UAS is followed. */
  private scaleBar(): void {
    const { pen } = this;
    const [left, y] = [14, this.size[1] - 12];
    const step = Math.min(this.gridStep, roundStep(SCALE_PX / this.scale));
    const end = left + step * this.scale;
    for (const [width, ink] of [[6, "--halo"], [2, "--ink"]] as const) {
      marks.stroke(pen, left, y, end, y, width, colour(ink));
    }
    marks.words(pen, `${step} m, N ↑`, end + 8, y, 11, colour("--ink"), "left");
  }

  private circle(x: number, y: number, radius: number, edge: string, width: number): void {
    this.pen.beginPath();
    this.pen.arc(x, y, radius, 0, 2 * Math.PI);
    this.pen.strokeStyle = edge;
    this.pen.lineWidth = width;
    this.pen.stroke();
  }

  private ghosts(ghost: Flight, moment: Moment): void {
    const { pen } = this;
    pen.globalAlpha = 0.6;
    pen.setLineDash([5, 4]);
    ghost.scene.uas.forEach((_, i) => this.path(ghost, moment, i));
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    this.overlay.ghosts(ghost, moment, this.unit);
  }

  private path(flight: Flight, moment: Moment, i: number): void {
    const { pen } = this;
    const ink = bright(flight.scene.uas[i].colour);
    pen.strokeStyle = pen.fillStyle = ink;
    pen.lineWidth = flight.uas > MANY ? 1.4 : 2;
    pen.lineJoin = "round";
    const flown = Math.min(moment.sample, flight.data.last[i]);
    // corners that lie on each other are one
    const nearest = flight.uas > MANY ? 3 : 0;
    let drawn: Point2 | null = null;
    for (let k = 0; k <= flown; k++) {
      // one line as long as its colour is the same
      const paint = this.trail.colour(flight, i, k) ?? ink;
      if (!drawn || paint !== pen.strokeStyle) {
        if (drawn) pen.stroke();
        pen.strokeStyle = paint;
        pen.beginPath();
        drawn = this.pixel(flight.position(k, i));
        pen.moveTo(...drawn);
      }
      const to = this.pixel(k < flown ? flight.position(k + 1, i) : moment.vehicles[i].position);
      if (k < flown && Math.abs(to[0] - drawn[0]) + Math.abs(to[1] - drawn[1]) < nearest) continue;
      pen.lineTo(...to);
      drawn = to;
    }
    pen.stroke();
    if (flight !== this.flight) return;
    const predicted = flight.predicted(moment.sample, i);
    for (let n = 0; n + 2 < predicted.length; n += 3) {
      const [x, y] = this.pixel([predicted[n], predicted[n + 1]]);
      pen.beginPath();
      pen.arc(x, y, 2.2, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  private movingObstacles(moment: Moment): void {
    const { pen } = this;
    const red = colour("--discharged");
    this.flight.scene.moving.forEach(({ name, kind, radius, safe, from }, i) => {
      if (from > moment.sample) return;
      const [x, y] = this.pixel(moment.moving[i]);
      pen.globalAlpha = 0.75;
      pen.fillStyle = red;
      pen.beginPath();
      pen.arc(x, y, radius * this.scale, 0, 2 * Math.PI);
      pen.fill();
      pen.globalAlpha = 1;
      pen.setLineDash([4, 4]);
      this.circle(x, y, (radius + safe) * this.scale, red, 1.5);
      pen.setLineDash([]);
      const above = y - (radius + safe) * this.scale - 9;
      marks.words(pen, (kind || name).replaceAll("_", " "), x, above, 11 * this.unit, colour("--ink"));
    });
  }
}
