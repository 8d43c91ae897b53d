// What lies under a click on the map or in the 3D scene: a UAS, a waypoint, or a leg flown.

import type { Flight, Moment } from "./flight";
import type { Point2, Point3 } from "./flight_data";
import { coveredBy, legs, legWords, waypointWords } from "./legs";

export interface Picked {
  words: string;
  at: Point3;
  /** When it was, to go there; null: never. */
  sample: number | null;
  /** Whose it is; null: nobody's. */
  uas: number | null;
}

const NEAR_PX = 14;

export class Picker {
  private by: (number | null)[] | null = null;

  constructor(private readonly flight: Flight) {}

  /** @param pixel where a point of the flight is on the picture */
  at(x: number, y: number, moment: Moment, pixel: (point: Point3) => Point2 | null): Picked | null {
    const { flight } = this;
    const by = (this.by ??= coveredBy(flight));
    const away = (point: Point3) => {
      const on = pixel(point);
      return on ? Math.hypot(on[0] - x, on[1] - y) : Infinity;
    };
    const [uas, near] = nearest(moment.vehicles.map(({ position }) => away(position)));
    if (near <= NEAR_PX) return { words: "", at: moment.vehicles[uas].position, sample: null, uas };
    const { waypoints } = flight.scene;
    const [w, far] = nearest(
      waypoints.map(({ at }, w) => (flight.asked(w, moment.sample) ? away(at) : Infinity)),
    );
    const waypoint = (): Picked => {
      const sample = by[w] === null ? null : flight.data.covered_at[w];
      return { words: waypointWords(flight, w, by), at: waypoints[w].at, sample, uas: by[w] };
    };
    if (far <= NEAR_PX) return waypoint();
    const leg = this.leg(away, moment.sample, by);
    if (leg || waypoints.length === 0) return leg;
    // nothing else is there: somewhere in its ring is enough
    const { at: [north, east, down], radius } = waypoints[w];
    const [middle, edge] = [pixel([north, east, down]), pixel([north, east + radius, down])];
    const inRing = middle && edge && far <= Math.hypot(edge[0] - middle[0], edge[1] - middle[1]);
    return inRing ? waypoint() : null;
  }

  private leg(away: (point: Point3) => number, until: number, by: (number | null)[]): Picked | null {
    const { flight } = this;
    let best: [number, number, number] = [NEAR_PX, -1, -1];
    flight.scene.uas.forEach((_, i) => {
      for (let k = 0; k <= Math.min(until, flight.data.last[i]); k++) {
        const distance = away(flight.position(k, i));
        if (distance < best[0]) best = [distance, i, k];
      }
    });
    const [, i, k] = best;
    if (i < 0) return null;
    const leg = legs(flight, i, by).find(({ from, to }) => from <= k && k <= to);
    return leg ? { words: legWords(flight, leg), at: flight.position(k, i), sample: k, uas: i } : null;
  }
}

function nearest(distances: number[]): [number, number] {
  const least = distances.reduce((a, b) => Math.min(a, b), Infinity);
  return [distances.indexOf(least), least];
}
