// What is to be seen of a flight at a moment of it.

import type { FlightData, Home, Mark, Point3, Scene, Series, Violation } from "./flight_data";
import { reachable } from "./reach";

export interface VehicleMoment {
  position: Point3;
  attitude: Point3;
  soc: number;
  /** Charge beyond what the way home takes with margin. */
  spare: number;
  speed: number;
  mode: string;
}

export interface Moment {
  time: number;
  /** The last whole sample. */
  sample: number;
  vehicles: VehicleMoment[];
  moving: Point3[];
  covered: number;
}

/** So many UAS are each shown in full on the map, without being followed. */
export const FEW = 8;
/** Charge beyond the way home below which it is said to be little. */
export const LITTLE_SPARE = 0.1;

const LOW_M = 10;

export class Flight {
  constructor(public data: FlightData) {}

  get scene(): Scene {
    return this.data.scene;
  }

  get uas(): number {
    return this.data.scene.uas.length;
  }

  get duration(): number {
    return (this.data.samples - 1) * this.data.dt_s;
  }

  /** It has gone on. */
  renew(data: FlightData): void {
    this.data = data;
  }

  /** Whether the planner said what it predicted. */
  get predicts(): boolean {
    return this.data.plan.steps.some((step) => step.length > 0);
  }

  /** What is to be seen at a time; between samples, positions are on straight lines. */
  moment(time: number): Moment {
    const last = this.data.samples - 1;
    const exact = Math.min(Math.max(time / this.data.dt_s, 0), last);
    // a time that was computed from a sample may fall short of it by a rounding error
    const sample = Math.min(last, Math.floor(exact + 1e-6));
    const part = Math.min(1, Math.max(0, exact - sample));
    return {
      time: exact * this.data.dt_s,
      sample,
      vehicles: this.scene.uas.map((_, i) => this.vehicle(sample, part, i)),
      moving: this.scene.moving.map((_, i) =>
        this.between(this.data.moving, sample, part, i, this.scene.moving.length),
      ),
      covered: this.data.covered[sample],
    };
  }

  /** Whether another flight is of the same mission, so that both can be shown in one scene. */
  sameMission(other: Flight): boolean {
    const told = ({ scene }: Flight) =>
      JSON.stringify([scene.fence, scene.obstacles, scene.waypoints.map(({ at, radius }) => [at, radius])]);
    return told(this) === told(other);
  }

  /** Energy that the swarm has taken until a time [Wh]. */
  energy(time: number): number {
    const { time: at, sample } = this.moment(time);
    const next = Math.min(sample + 1, this.data.samples - 1);
    const part = at / this.data.dt_s - sample;
    return this.scene.uas.reduce((sum, _, i) => {
      const [before, after] = [sample, next].map((k) => this.energyOf(k, i));
      return sum + before + part * (after - before);
    }, 0);
  }

  /** Energy that a UAS has taken until a sample [Wh]. */
  energyOf(sample: number, i: number): number {
    const { values, unit } = this.data.energy;
    return values[sample * this.uas + i] * unit;
  }

  /** A height or a place in words [m]: in rooms, that are lower than `LOW_M`, with decimals. */
  metres(value: number): string {
    const heights = this.scene.fence.corners.map((corner) => corner[2]);
    return value.toFixed(Math.max(...heights) - Math.min(...heights) < LOW_M ? 1 : 0);
  }

  position(sample: number, i: number): Point3 {
    return point(this.data.position, sample * this.uas + i);
  }

  /** One UAS's series until it landed or was lost. */
  column(series: Series, i: number): number[] {
    const values = [];
    for (let k = 0; k <= this.data.last[i]; k++) {
      values.push(series.values[k * this.uas + i] * series.unit);
    }
    return values;
  }

  mode(sample: number, i: number): string {
    const run = this.data.mode_runs[i].filter(([, first]) => first <= sample).at(-1)!;
    return this.data.modes[run[0]];
  }

  /** Positions that the planner predicted at a sample, x, y, z, x, y, z, ...; often none. */
  predicted(sample: number, i: number): number[] {
    const { unit, steps } = this.data.plan;
    return (steps[sample]?.[i] ?? []).map((value) => value * unit);
  }

  /** Corners of the area that a UAS can still reach and come home from; often none. */
  reach(moment: Moment, i: number): Point3[] {
    const { position, soc, spare, mode } = moment.vehicles[i];
    if (spare <= 0 || mode === "landed" || mode === "lost") return [];
    const reach = this.data.reach.filter(({ from }) => from <= moment.sample).at(-1)!;
    return reachable(reach, i, position, soc);
  }

  /** How many waypoints are to be covered at a sample, or have been. */
  askedFor(sample: number): number {
    return this.scene.waypoints.filter((_, w) => this.asked(w, sample)).length;
  }

  /** Whether a waypoint is to be covered at a sample, or has been. */
  asked(w: number, sample: number): boolean {
    const { from, until } = this.scene.waypoints[w];
    return from <= sample && (until === null || sample < until);
  }

  /** Whether it matters where a UAS had least charge beyond the way home: is it looked at? */
  nearNoReturn(i: number, focused: number | null): boolean {
    if (this.data.no_return[i] !== null || focused === i) return true;
    return focused === null && this.uas <= FEW && this.data.least_spare[i][1] < LITTLE_SPARE;
  }

  /** What is going on at a time: the marks that last, the violations of that sample. */
  at(time: number): Mark[] {
    const near = 0.5 * this.data.dt_s;
    return this.marks().filter(
      ({ t_s, until_s }) => t_s - near < time + 1e-6 && time < until_s + near,
    );
  }

  /** Violations and all else that happened, in order of time. */
  marks(): Mark[] {
    const violations = this.data.violations.map((violation) => ({
      t_s: violation.t_s,
      until_s: violation.t_s,
      kind: "violation",
      uas: violation.uas,
      text: words(violation),
    }));
    return [...violations, ...this.data.marks].sort((a, b) => a.t_s - b.t_s);
  }

  where(violation: Violation): Point3 {
    const i = this.scene.uas.findIndex((uas) => uas.name === violation.uas);
    const sample = Math.min(Math.round(violation.t_s / this.data.dt_s), this.data.samples - 1);
    return this.position(sample, Math.max(0, i));
  }

  private vehicle(sample: number, part: number, i: number): VehicleMoment {
    const { attitude, soc, needed, dt_s, samples } = this.data;
    const next = Math.min(sample + 1, samples - 1);
    const from = this.position(sample, i);
    const to = this.position(next, i);
    const [before, after] = [sample, next].map((k) => soc.values[k * this.uas + i] * soc.unit);
    const [less, more] = [sample, next].map((k) => needed.values[k * this.uas + i] * needed.unit);
    const charge = before + part * (after - before);
    return {
      position: mix(from, to, part),
      attitude: this.between(attitude, sample, part, i, this.uas),
      soc: charge,
      spare: charge - less - part * (more - less),
      speed: Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) / dt_s,
      mode: this.mode(sample, i),
    };
  }

  private between(series: Series, sample: number, part: number, i: number, width: number): Point3 {
    const next = Math.min(sample + 1, this.data.samples - 1);
    return mix(point(series, sample * width + i), point(series, next * width + i), part);
  }
}

/** Where a UAS is to land at a sample. */
export function homeAt(homes: Home[], sample: number): Point3 {
  return homes.filter(({ from }) => from <= sample).at(-1)!.at;
}

/** A violation in words, without its time. */
export function words({ uas, kind, with: partner, value, limit }: Violation): string {
  if (kind === "limit") {
    const numbers = `${value?.toPrecision(3)} of ${limit?.toPrecision(3)}`;
    return `${uas} beyond its limit of ${partner?.replaceAll("_", " ")}, ${numbers}`;
  }
  if (kind === "limits") return `${uas}, out of control beyond its limits`;
  const what = kind.replaceAll("_", " ");
  return `${uas}, ${what} contact${partner ? ` with ${partner}` : ""}`;
}

function point(series: Series, row: number): Point3 {
  const { values, unit } = series;
  return [values[3 * row] * unit, values[3 * row + 1] * unit, values[3 * row + 2] * unit];
}

function mix(a: Point3, b: Point3, part: number): Point3 {
  return [
    a[0] + part * (b[0] - a[0]),
    a[1] + part * (b[1] - a[1]),
    a[2] + part * (b[2] - a[2]),
  ];
}
