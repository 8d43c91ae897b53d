// The height profile under the map: UAS, roofs and the least height over them, waypoints covered.

import { type Band, BAND_WORDS, bandOf, drawBand } from "./band";
import { DASHES, LEFT, RIGHT, TimeCanvas } from "./chart";
import type { Flight } from "./flight";
import { shortName, stroke } from "./marks";
import { bright, colour, legible } from "./palette";
import { roundStep } from "./round_step";

const TOP = 20;
const BOTTOM = 6;
const FEW = 2;
const MANY = 8;
const WIDE = 560;

export class ProfileChart extends TimeCanvas {
  private readonly altitudes: number[][];
  private readonly floors: number[][];
  private readonly high: number;
  private spread: Band | null = null;

  constructor(private readonly flight: Flight, all: Flight[], duration: number, seek: (time: number) => void) {
    super("Height over ground, roofs and the least height", duration, seek);
    this.canvas.classList.add("profile");
    this.altitudes = flight.scene.uas.map((_, i) => heights(flight, i));
    this.floors = flight.scene.uas.map((_, i) => flight.column(flight.data.floor, i));
    const shown = all.flatMap((each) => [
      ...each.scene.uas.flatMap((_, i) => heights(each, i)),
      ...each.scene.waypoints.filter((_, w) => each.data.covered_at[w] < each.data.samples).map(({ at }) => -at[2]),
    ]);
    this.high = Math.max(1, shown.reduce((a, b) => Math.max(a, b), 0)) * 1.08;
  }

  protected drawStill(): void {
    const { pen, flight } = this;
    const least = flight.data.min_height_m;
    const uas = flight.scene.uas.map((_, i) => i);
    const many = uas.length > MANY;
    const looked = this.focused === null ? (uas.length <= FEW ? uas : []) : [this.focused];
    const dashed = least > 0 && looked.length > 0 && this.width > WIDE;
    const notes = [...(many ? [BAND_WORDS] : []), ...(dashed ? ["dashed: least height"] : [])];
    const title = `Height, m${notes.length > 0 ? ` (${notes.join("; ")})` : ""}`;
    this.write(title, 2, 9, colour("--ink"), "left", 600);
    const step = roundStep(this.high / 2);
    for (let at = 0; at <= this.high; at += step) {
      const y = this.y(at);
      stroke(pen, LEFT, y, this.width - RIGHT, y, 1, colour("--grid"));
      this.write(String(at), LEFT - 5, y, colour("--faint"), "right");
    }
    for (const i of looked) this.below(i);
    if (many) this.band();
    for (const i of many ? looked : uas) {
      pen.globalAlpha = this.focused === null || this.focused === i ? 1 : 0.2;
      pen.setLineDash(DASHES[i % DASHES.length]);
      this.curve(this.altitudes[i], bright(flight.scene.uas[i].colour), 1.8);
    }
    pen.globalAlpha = 1;
    pen.setLineDash([]);
    this.covered();
  }

  protected drawAt(time: number): void {
    const { dt_s } = this.flight.data;
    let right = this.width - RIGHT;
    const all = this.flight.scene.uas.map((_, i) => i);
    const shown = this.focused === null ? all : [this.focused];
    if (shown.length > 4) return;
    for (const i of [...shown].reverse()) {
      const k = Math.min(this.altitudes[i].length - 1, Math.floor(time / dt_s + 1e-6));
      const [height, floor] = [this.altitudes[i][k], this.floors[i][k]];
      const ink = legible(this.flight.scene.uas[i].colour);
      const over = floor > 0 && this.width > WIDE ? `, ${(height - floor).toFixed(1)} over a roof` : "";
      const words = `${shortName(this.flight.scene.uas[i].name)}: ${height.toFixed(1)} m${over}`;
      right -= this.write(words, right, 9, ink, "right", 600) + 10;
    }
  }

  private band(): void {
    this.spread ??= bandOf(this.altitudes);
    const x = (k: number) => this.x(k * this.flight.data.dt_s);
    const ink = this.focused === null ? "--accent" : "--faint";
    drawBand(this.pen, this.spread, colour(ink), x, (height) => this.y(height));
  }

  protected words(time: number): string {
    const { dt_s } = this.flight.data;
    const at = (values: number[]) => values[Math.min(values.length - 1, Math.floor(time / dt_s + 1e-6))];
    const names = this.flight.scene.uas.map(({ name }) => name);
    if (this.focused !== null) {
      const [height, floor] = [at(this.altitudes[this.focused]), at(this.floors[this.focused])];
      return `${names[this.focused]} ${height.toFixed(1)} m, ${(height - floor).toFixed(1)} m over what is below`;
    }
    if (names.length <= MANY) {
      return names.map((name, i) => `${name} ${at(this.altitudes[i]).toFixed(1)} m`).join(", ");
    }
    const heights = this.altitudes.map(at);
    return `${Math.min(...heights).toFixed(1)} to ${Math.max(...heights).toFixed(1)} m`;
  }

  /** What is below one UAS: roofs filled, the least height over them. */
  private below(i: number): void {
    const { pen, flight } = this;
    const floors = this.floors[i];
    pen.fillStyle = colour("--faint");
    pen.globalAlpha = 0.35;
    pen.beginPath();
    pen.moveTo(this.x(0), this.y(0));
    this.along(floors);
    pen.lineTo(this.x((floors.length - 1) * flight.data.dt_s), this.y(0));
    pen.fill();
    const least = flight.data.min_height_m;
    if (least > 0) {
      pen.globalAlpha = 0.8;
      pen.setLineDash([3, 3]);
      this.curve(floors.map((floor) => floor + least), colour("--discharged"), 1);
      pen.setLineDash([]);
    }
    pen.globalAlpha = 1;
  }

  /** A dot at the height of each waypoint when it was covered. */
  private covered(): void {
    const { pen, flight } = this;
    flight.scene.waypoints.forEach(({ at }, w) => {
      const k = flight.data.covered_at[w];
      if (k >= flight.data.samples) return;
      pen.fillStyle = colour("--covered-edge");
      pen.beginPath();
      pen.arc(this.x(k * flight.data.dt_s), this.y(-at[2]), 1.8, 0, 2 * Math.PI);
      pen.fill();
    });
  }

  private curve(values: number[], ink: string, width: number): void {
    this.pen.strokeStyle = ink;
    this.pen.lineWidth = width;
    this.pen.beginPath();
    this.along(values);
    this.pen.stroke();
  }

  private along(values: number[]): void {
    values.forEach((value, k) => this.pen.lineTo(this.x(k * this.flight.data.dt_s), this.y(value)));
  }

  private y(height: number): number {
    const bottom = this.height - BOTTOM;
    return bottom - (height / this.high) * (bottom - TOP);
  }
}

function heights(flight: Flight, i: number): number[] {
  return Array.from({ length: flight.data.last[i] + 1 }, (_, k) => -flight.position(k, i)[2]);
}
