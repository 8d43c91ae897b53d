// Who covered which waypoint when, and the legs between: what a click on the map tells.

import type { Flight } from "./flight";

export interface Leg {
  uas: number;
  /** Samples. */
  from: number;
  to: number;
  /** Waypoint at its end; null: home, or the end of the flight. */
  waypoint: number | null;
}

/** Index of the UAS that covered each waypoint: of those that flew, the nearest; null: open. */
export function coveredBy(flight: Flight): (number | null)[] {
  const { covered_at: covered, samples, last } = flight.data;
  return flight.scene.waypoints.map(({ at }, w) => {
    const k = covered[w];
    if (k >= samples) return null;
    const away = flight.scene.uas.map((_, i) => {
      if (k > last[i]) return Infinity;
      const [x, y, z] = flight.position(k, i);
      return Math.hypot(x - at[0], y - at[1], z - at[2]);
    });
    return away.indexOf(Math.min(...away));
  });
}

/** The legs of one UAS in order of time: each ends where it covers a waypoint, the last at its end. */
export function legs(flight: Flight, i: number, by: (number | null)[]): Leg[] {
  const ends = by
    .map((uas, w) => [uas, flight.data.covered_at[w], w] as const)
    .filter(([uas, k]) => uas === i && k > 0)
    .sort((a, b) => a[1] - b[1]);
  const found: Leg[] = [];
  let from = 0;
  for (const [, to, waypoint] of ends) {
    // two waypoints at one sample end one leg
    if (to > from) found.push({ uas: i, from, to, waypoint });
    from = to;
  }
  const last = flight.data.last[i];
  if (last > from) found.push({ uas: i, from, to: last, waypoint: null });
  return found;
}

/** A waypoint in words: where, and when it was covered by whom, how high and fast. */
export function waypointWords(flight: Flight, w: number, by: (number | null)[]): string {
  const { at } = flight.scene.waypoints[w];
  const place = `Waypoint ${w + 1}, N ${flight.metres(at[0])} m, E ${flight.metres(at[1])} m, ${(-at[2]).toFixed(1)} m high`;
  const i = by[w];
  if (i === null) return `${place}: not covered`;
  const k = flight.data.covered_at[w];
  const { name } = flight.scene.uas[i];
  const height = -flight.position(k, i)[2];
  return (
    `${place}: covered at ${seconds(flight, k)} by ${name}, ` +
    `${height.toFixed(1)} m high at ${speed(flight, k, i).toFixed(1)} m/s`
  );
}

/** A leg in words: when, how far, how high and fast, and the energy it took. */
export function legWords(flight: Flight, { uas: i, from, to, waypoint }: Leg): string {
  const { dt_s } = flight.data;
  const energy = flight.energyOf(to, i) - flight.energyOf(from, i);
  let way = 0;
  const heights = [];
  for (let k = from; k < to; k++) {
    const [a, b] = [flight.position(k, i), flight.position(k + 1, i)];
    way += Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    heights.push(-a[2], -b[2]);
  }
  const [low, high] = [Math.min(...heights), Math.max(...heights)];
  const end = waypoint === null ? endWords(flight, i) : `to waypoint ${waypoint + 1}`;
  return (
    `${flight.scene.uas[i].name} ${end}, ${seconds(flight, from)} to ${seconds(flight, to)}: ` +
    `${flight.metres(way)} m at ${(way / ((to - from) * dt_s)).toFixed(1)} m/s, ` +
    `${flight.metres(low)} to ${flight.metres(high)} m high, ${energy.toFixed(2)} Wh`
  );
}

function endWords(flight: Flight, i: number): string {
  const mode = flight.mode(flight.data.last[i], i);
  return mode === "landed" ? "home" : mode === "lost" ? "until it was lost" : "until the end";
}

/** Towards the sample after; of the last one from the one before [m/s]. */
function speed(flight: Flight, k: number, i: number): number {
  const from = Math.min(k, Math.max(0, flight.data.last[i] - 1));
  const [a, b] = [flight.position(from, i), flight.position(Math.min(from + 1, flight.data.last[i]), i)];
  return Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) / flight.data.dt_s;
}

function seconds(flight: Flight, k: number): string {
  return `${Number((k * flight.data.dt_s).toFixed(2))} s`;
}
