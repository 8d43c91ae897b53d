// Trails coloured by a value of the flight, on one scale for all UAS and flights of the page.

import type { Flight } from "./flight";
import { ramp } from "./ramp";

export type TrailKind = "uas" | "power" | "speed" | "height" | "charge";

/** [kind, what it is called, its unit, digits] */
export const TRAILS: [TrailKind, string, string, number][] = [
  ["uas", "by UAS", "", 0],
  ["power", "by power", "W", 0],
  ["speed", "by speed", "m/s", 1],
  ["height", "by height", "m", 0],
  ["charge", "by charge", "%", 0],
];

/** One UAS's value at each sample until it landed or was lost. */
export function trailValues(flight: Flight, i: number, kind: TrailKind): number[] {
  const { voltage, current, soc, dt_s } = flight.data;
  const last = flight.data.last[i];
  const each = (value: (k: number) => number) => Array.from({ length: last + 1 }, (_, k) => value(k));
  switch (kind) {
    case "power": {
      const amperes = flight.column(current, i);
      const watts = flight.column(voltage, i).map((volts, k) => volts * amperes[k]);
      // the current of the last sample acts no more
      if (last > 0) watts[last] = watts[last - 1];
      return watts;
    }
    case "speed":
      return each((k) => {
        const from = flight.position(Math.min(k, Math.max(0, last - 1)), i);
        const to = flight.position(Math.min(k + 1, last), i);
        return Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) / dt_s;
      });
    case "height":
      return each((k) => 0 - flight.position(k, i)[2]);
    case "charge":
      return flight.column(soc, i).map((value) => 100 * value);
    default:
      return each(() => 0);
  }
}

/** How trails are coloured now. */
export class Trail {
  private readonly known = new Map<Flight, number[][]>();
  low = 0;
  high = 1;

  constructor(readonly kind: TrailKind, flights: Flight[]) {
    if (kind === "uas") return;
    for (const flight of flights) {
      this.known.set(flight, flight.scene.uas.map((_, i) => trailValues(flight, i, kind)));
    }
    const all = [...this.known.values()].flat(2);
    this.low = all.reduce((a, b) => Math.min(a, b), Infinity);
    this.high = all.reduce((a, b) => Math.max(a, b), -Infinity);
  }

  /** The colour of the way from a sample to the next; null: that of the UAS. */
  colour(flight: Flight, i: number, k: number): string | null {
    const values = this.known.get(flight)?.[i];
    if (!values) return null;
    const value = values[Math.min(k, values.length - 1)];
    return ramp((value - this.low) / Math.max(1e-9, this.high - this.low));
  }
}
