// The map of one flight on a plain canvas: north up. It is drawn where there is no WebGL, and on
// request.

import type { Flight, Moment, Point2, Point3 } from "./flight";
import * as marks from "./marks";
import { bright, colour, darker, dim } from "./palette";
import { roundStep } from "./round_step";
import { Trail } from "./trail";
import type { View } from "./view";

const FOLLOWED_ZOOM = 3;

export class MapView implements View {
  private readonly pen: CanvasRenderingContext2D;
  private readonly low: Point2;
  private readonly high: Point2;
  private readonly gridStep: number;
  private followed: number | null = null;
  private trail: Trail;
  private ghost: Flight | null = null;
  /** Size of marks: smaller on a small map. */
  private unit = 1;
  private scale = 1;
  private middle: Point2 = [0, 0];

  constructor(readonly canvas: HTMLCanvasElement, private readonly flight: Flight) {
    this.pen = canvas.getContext("2d")!;
    this.trail = new Trail("uas", [flight]);
    const { outline } = flight.scene.fence;
    const [north, east] = [0, 1].map((axis) => outline.map((corner) => corner[axis]));
    this.low = [Math.min(...north), Math.min(...east)];
    this.high = [Math.max(...north), Math.max(...east)];
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

  follow(uas: number | null): void {
    this.followed = uas;
  }

  setGhost(ghost: Flight | null): void {
    this.ghost = ghost;
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
  }

  overview(): void {
    this.followed = null;
  }

  top(): void {
    this.followed = null;
  }

  draw(moment: Moment, time: number): void {
    this.frame(moment);
    const { pen, flight } = this;
    pen.fillStyle = colour("--outside");
    pen.fillRect(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    this.terrain();
    flight.scene.waypoints.forEach(({ at, radius, heavy }, i) => {
      const covered = flight.data.covered_at[i] <= moment.sample;
      const [x, y] = this.pixel(at);
      marks.waypoint(pen, x, y, radius * this.scale, 1, heavy, covered);
    });
    const other = this.ghost?.moment(time);
    if (this.ghost && other) this.ghosts(this.ghost, other);
    flight.scene.uas.forEach((_, i) => this.path(flight, moment, i));
    this.movingObstacles(moment);
    flight.data.violations.forEach((violation) => {
      const [x, y] = this.pixel(flight.where(violation));
      pen.globalAlpha = violation.t_s <= moment.time + 1e-6 ? 1 : 0.35;
      marks.cross(pen, x, y, 9);
      pen.globalAlpha = 1;
    });
    flight.scene.uas.forEach((_, i) => this.noReturn(moment, i));
    flight.scene.uas.forEach((_, i) => this.vehicle(moment, i));
  }

  private noReturn(moment: Moment, i: number): void {
    const passed = this.flight.data.no_return[i];
    const sample = passed ?? this.flight.data.least_spare[i][0];
    if (!this.flight.nearNoReturn(i, this.followed)) return;
    const [x, y] = this.pixel(this.flight.position(sample, i));
    this.pen.globalAlpha = sample <= moment.sample ? 1 : 0.35;
    marks.noReturn(this.pen, x, y, 7 * this.unit, passed !== null, this.flight.scene.uas[i].colour);
    this.pen.globalAlpha = 1;
  }

  private frame(moment: Moment): void {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.unit = Math.min(1, Math.max(0.65, Math.min(width, height) / 500));
    const fit = Math.min(
      (width - 28) / (this.high[1] - this.low[1]),
      (height - 28) / (this.high[0] - this.low[0]),
    );
    const at = this.followed === null ? null : moment.vehicles[this.followed].position;
    this.scale = fit * (at ? FOLLOWED_ZOOM : 1);
    this.middle = at
      ? [at[0], at[1]]
      : [(this.low[0] + this.high[0]) / 2, (this.low[1] + this.high[1]) / 2];
  }

  private pixel(point: Point2 | Point3): Point2 {
    return [
      this.canvas.clientWidth / 2 + this.scale * (point[1] - this.middle[1]),
      this.canvas.clientHeight / 2 - this.scale * (point[0] - this.middle[0]),
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

  private terrain(): void {
    const { scene } = this.flight;
    this.polygon(scene.fence.outline, colour("--ground"), null);
    this.grid();
    for (const item of scene.decorations) this.polygon(item.outline, dim(item.colour), null);
    for (const obstacle of scene.obstacles) {
      this.polygon(obstacle.outline, dim(obstacle.colour), darker(obstacle.colour, 0.45), 1.2);
    }
    this.polygon(scene.fence.outline, null, colour("--fence"), 1.8);
    for (const { start, colour: hex } of scene.uas) {
      const [x, y] = this.pixel(start);
      this.circle(x, y, 5 * this.unit, bright(hex), 1.5);
    }
    this.scaleBar();
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

  private scaleBar(): void {
    const step = this.gridStep;
    const [x, y] = this.pixel(this.low);
    const end = x + 8 + step * this.scale;
    marks.stroke(this.pen, x + 8, y - 8, end, y - 8, 2, colour("--ink"));
    marks.words(this.pen, `${step} m`, x + 8, y - 18, 11, colour("--ink"), "left");
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
    ghost.scene.uas.forEach(({ name, colour: hex }, i) => {
      pen.globalAlpha = 0.6;
      pen.setLineDash([5, 4]);
      this.path(ghost, moment, i);
      pen.setLineDash([]);
      const [x, y] = this.pixel(moment.vehicles[i].position);
      marks.ghost(pen, x, y, 9 * this.unit, marks.shortName(name), hex);
      pen.globalAlpha = 1;
    });
  }

  private path(flight: Flight, moment: Moment, i: number): void {
    const { pen } = this;
    const ink = bright(flight.scene.uas[i].colour);
    pen.strokeStyle = pen.fillStyle = ink;
    pen.lineWidth = 2;
    pen.lineJoin = "round";
    const flown = Math.min(moment.sample, flight.data.last[i]);
    for (let k = 0; k <= flown; k++) {
      // one line as long as its colour is the same
      const paint = this.trail.colour(flight, i, k) ?? ink;
      if (k === 0 || paint !== pen.strokeStyle) {
        if (k > 0) pen.stroke();
        pen.strokeStyle = paint;
        pen.beginPath();
        pen.moveTo(...this.pixel(flight.position(k, i)));
      }
      const to = k < flown ? flight.position(k + 1, i) : moment.vehicles[i].position;
      pen.lineTo(...this.pixel(to));
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
    this.flight.scene.moving.forEach(({ name, kind, radius, safe }, i) => {
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

  private vehicle(moment: Moment, i: number): void {
    const { pen } = this;
    const { position, attitude, soc, spare, mode } = moment.vehicles[i];
    const { name, colour: hex } = this.flight.scene.uas[i];
    const [x, y] = this.pixel(position);
    const unit = this.unit * (this.followed === null ? marks.ofMany(this.flight.uas) : 1);
    if (mode === "lost") marks.cross(pen, x, y, 10 * unit);
    else if (mode === "landed") marks.landed(pen, x, y, 5 * unit, hex);
    else {
      marks.charge(pen, x, y, 14 * unit, soc, spare, marks.shortName(name), hex);
      marks.vehicle(pen, x, y, 8 * unit, attitude[2], hex);
    }
  }
}
